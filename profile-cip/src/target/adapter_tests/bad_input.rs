//! Malformed input that has brought other targets down, each by its own test: the structure is right up to
//! the one field that lies.

use proptest::prelude::*;

use super::rig::*;
use crate::wire::cpf::ItemType;
use crate::wire::encapsulation::{Command, EncapsulationStatus, HEADER_LEN};
use crate::wire::forward_open::ForwardOpen;
use crate::wire::status::Service;

fn encapsulation_status(rig: &mut Rig, client: Client, command: Command, data: &[u8]) -> EncapsulationStatus {
    let reply = rig.exchange(client.slot, &packet(command, client.handle, data));
    assert_eq!(reply.data, []);
    reply.header.status
}

#[test]
fn eleven_list_services_in_one_datagram() {
    let mut rig = Rig::new();
    let bytes = packet(Command::LIST_SERVICES, 0, &[]).repeat(11);
    // A datagram holds one packet, so this one is malformed; there is no answer to multiply.
    assert_eq!(rig.adapter.handle_datagram(&bytes, &mut [0; 256]), None);
    assert_eq!(rig.adapter.counters().datagrams_dropped, 1);
    // On a stream they are eleven packets.
    let slot = rig.stream(1);
    rig.feed(slot, &bytes);
    assert_eq!(rig.received(slot).len(), 11);
}

#[test]
fn item_count_0xe801() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let mut data = unconnected(&message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    data[6..8].copy_from_slice(&0xE801u16.to_le_bytes());
    for command in [Command::SEND_RR_DATA, Command::SEND_UNIT_DATA] {
        let status = encapsulation_status(&mut rig, client, command, &data);
        assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
    }
    assert_eq!(rig.adapter.counters().data_malformed, 2);
}

#[test]
fn item_lengths_that_lie() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let data = unconnected(&message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    for (at, value) in [(10, 1), (10, 0xFFFF), (14, 0), (14, 5), (14, 7), (14, 0xFFFF)] {
        let mut data = data.clone();
        data[at..at + 2].copy_from_slice(&u16::to_le_bytes(value));
        let status = encapsulation_status(&mut rig, client, Command::SEND_RR_DATA, &data);
        assert_eq!(status, EncapsulationStatus::INCORRECT_DATA, "{value:#x} at {at}");
    }
}

#[test]
fn wrong_items() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let get = message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]);
    let null = item(ItemType::NULL_ADDRESS, &[]);
    let data = item(ItemType::UNCONNECTED_DATA, &get);
    for items in
        [&[][..], &[null], &[data], &[data, null], &[null, null], &[null, item(ItemType::SERVICES, &get)]]
    {
        for command in [Command::SEND_RR_DATA, Command::SEND_UNIT_DATA] {
            let status = encapsulation_status(&mut rig, client, command, &encapsulated(items));
            assert_eq!(status, EncapsulationStatus::INCORRECT_DATA, "{items:?}");
        }
    }
    let odd = [item(ItemType::CONNECTED_ADDRESS, &[1, 2, 3]), item(ItemType::CONNECTED_DATA, &[1, 0, 1, 0])];
    let status = encapsulation_status(&mut rig, client, Command::SEND_UNIT_DATA, &encapsulated(&odd));
    assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
    let mut other_interface = unconnected(&get);
    other_interface[0] = 1;
    let status = encapsulation_status(&mut rig, client, Command::SEND_RR_DATA, &other_interface);
    assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
}

#[test]
fn forward_open_cut_at_every_byte() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for open in [motion_open(1), ForwardOpen { large: true, ..motion_open(1) }] {
        let whole = open_message(&open);
        for cut in 6..whole.len() {
            let answer = rig.ask(client, &whole[..cut]);
            assert_eq!((answer.outcome(), answer.data.len()), ((0x13, 0), 0), "cut at {cut}");
        }
        let longer = [whole.as_slice(), &[0]].concat();
        assert_eq!(rig.ask(client, &longer).outcome(), (0x15, 0));
    }
    assert_eq!(rig.adapter.poll_motion(), None);
    assert_eq!(rig.adapter.motion_connection(), None);
    let counters = rig.adapter.counters();
    assert_eq!(counters.open_requests, counters.open_format_rejects);
}

#[test]
fn padded_path_past_the_buffer() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for words in [3, 0x80, 0xFF] {
        assert_eq!(rig.ask(client, &[0x0E, words, 0x20, 1, 0x24, 1]).outcome(), (0x26, 0), "{words} words");
    }
    // The last segment has to be whole within the path.
    for path in [&[0x20, 1, 0x25, 0][..], &[0x20, 1, 0x26, 0, 1, 0], &[0x21, 0], &[0x34, 4]] {
        let answer = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, path, &[]));
        assert_eq!(answer.outcome(), (0x04, 0), "{path:02x?}");
    }
    // And so in the path of a connection.
    let mut open = open_message(&motion_open(1));
    let length_at = 2 + PATH_MANAGER.len() + 35;
    for words in [0, 7, 9, 0xFF] {
        open[length_at] = words;
        let expected = if words > 8 { (0x13, 0) } else { (0x15, 0) };
        assert_eq!(rig.ask(client, &open).outcome(), expected, "{words} words");
    }
}

#[test]
fn data_segment_length_underflow() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    // Word counts below the block, above the path, and none at all.
    for (path, outcome) in [
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 0][..], (1, 0x126)),
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 1, 1, 1], (1, 0x126)),
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 3, 1, 1, 0, 0, 0x0D, 0x0C], (1, 0x126)),
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 5, 1, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A], (1, 0x315)),
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 0xFF], (1, 0x315)),
        (&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2], (1, 0x126)),
    ] {
        let open = ForwardOpen { path, ..motion_open(1) };
        assert_eq!(rig.refused(client, &open).outcome(), outcome, "{path:02x?}");
    }
}

#[test]
fn get_attribute_list_with_a_huge_count() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let lie = message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &[0xFF, 0xFF, 1, 0]);
    assert_eq!(rig.ask(client, &lie).outcome(), (0x13, 0));
    // An honest long list ends where the reply is full.
    let honest = [&1000u16.to_le_bytes()[..], &[1, 0].repeat(1000)].concat();
    let honest = message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &honest);
    let answer = rig.ask(client, &honest);
    assert_eq!((answer.outcome(), answer.data.len()), ((0x11, 0), 0));
    let lie = message(Service::SET_ATTRIBUTE_LIST, &[0x20, 0x48, 0x24, 1], &[0xFF, 0xFF, 4, 0, 55]);
    let answer = rig.ask(client, &lie);
    assert_eq!((answer.outcome(), answer.data), ((0x13, 0), vec![1, 0, 4, 0, 0, 0]));
}

#[test]
fn multiple_service_packet_that_lies() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (data, status) in [
        (&[][..], 0x13),
        (&[1][..], 0x13),
        (&[0xFF, 0xFF, 0, 0], 0x13),
        (&[1, 0, 2, 0, 1, 2], 0x20),
        (&[1, 0, 0xFF, 0xFF, 1, 2], 0x20),
        (&[2, 0, 8, 0, 6, 0, 1, 2, 3, 4], 0x20),
    ] {
        let answer = rig.ask(client, &message(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, data));
        assert_eq!(answer.outcome(), (status, 0), "{data:02x?}");
    }
    // Two thousand empty services at the same place end when the reply is full.
    let data = [&2000u16.to_le_bytes()[..], &4002u16.to_le_bytes().repeat(2000)].concat();
    let answer = rig.ask(client, &message(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, &data));
    assert_eq!(answer.outcome(), (0x11, 0));
    assert!(rig.adapter.counters().requests_refused < 200);
}

#[test]
fn malformed_forward_close() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.open_motion(client, 1);
    let whole = close_message(1);
    for cut in 6..whole.len() {
        assert_eq!(rig.ask(client, &whole[..cut]).outcome(), (0x13, 0), "cut at {cut}");
    }
    let mut broken_path = whole.clone();
    let path_at = whole.len() - PATH_MOTION.len();
    broken_path[path_at] = 0xE0;
    assert_eq!(rig.ask(client, &broken_path).outcome(), (1, 0x316));
    assert_eq!(rig.adapter.poll_motion(), None);
    assert!(rig.adapter.motion_connection().is_some(), "the connection lives");
    assert_eq!(rig.adapter.counters().close_format_rejects, 23 + 1 + 5);
}

#[test]
fn lengths_beyond_16_bits_do_not_wrap() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    // The largest header there is: its data is skipped as it comes, whatever it holds, and the stream goes
    // on.
    let mut bytes = packet(Command::SEND_RR_DATA, client.handle, &[]);
    bytes[2..4].copy_from_slice(&[0xFF, 0xFF]);
    let reply = rig.exchange(client.slot, &bytes);
    assert_eq!(reply.header.status, EncapsulationStatus::INVALID_LENGTH);
    let filler = packet(Command::LIST_IDENTITY, 0, &[]);
    let data: Vec<u8> = filler.iter().copied().cycle().take(65535).collect();
    for piece in data.chunks(1000) {
        rig.feed(client.slot, piece);
    }
    assert_eq!(rig.received(client.slot), []);
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0);
    assert_eq!(rig.adapter.counters().lengths_invalid, 1);
}

#[test]
fn a_stream_of_something_else_is_closed() {
    let mut rig = Rig::new();
    let slot = rig.stream(1);
    let text = b"GET / HTTP/1.1\r\nHost: 10.0.0.9\r\nAccept: */*\r\n\r\n".repeat(3000);
    let mut at = 0;
    while !rig.adapter.is_done(slot) && at < text.len() {
        let taken = rig.adapter.handle_stream(rig.now, slot, &text[at..]);
        at += taken;
        rig.received(slot);
    }
    assert!(rig.adapter.is_done(slot));
    assert_eq!(rig.adapter.counters().sessions_garbled, 1);
    assert_eq!(rig.adapter.handle_stream(rig.now, slot, &text), 0, "nothing more is taken");
}

#[test]
fn empty_and_tiny_messages() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (bytes, service, status) in
        [(&[][..], 0, 0x13), (&[0x0E], 0x0E, 0x13), (&[0x8E, 0], 0x0E, 0x08), (&[0x0E, 0], 0x0E, 0x04)]
    {
        let answer = rig.ask(client, bytes);
        assert_eq!((answer.service, answer.outcome()), (service, (status, 0)), "{bytes:02x?}");
    }
}

/// One well-formed request of each kind.
fn requests() -> Vec<Vec<u8>> {
    let multiple =
        [&[2, 0, 6, 0, 14, 0][..], &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 7], &[1, 2, 0x20, 1, 0x24, 1]];
    let inner = message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]);
    let length = u8::try_from(inner.len()).unwrap();
    vec![
        open_message(&motion_open(1)),
        open_message(&ForwardOpen { large: true, ..explicit_open(2) }),
        close_message(1),
        message(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, &multiple.concat()),
        message(
            Service::UNCONNECTED_SEND,
            PATH_MANAGER,
            &[&[5, 157, length, 0], &inner[..], &[0, 0]].concat(),
        ),
        message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &[2, 0, 1, 0, 7, 0]),
        message(Service::SET_ATTRIBUTE_LIST, &[0x20, 0x48, 0x24, 1], &[2, 0, 4, 0, 55, 5, 0, 47]),
        message(Service::GET_ATTRIBUTE_SINGLE, &[0x20, 0x42, 0x24, 1, 0x31, 0, 0xB9, 1], &[]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A request with one byte, word or length changed or cut gets one answer, and the device answers the
    /// next one.
    #[test]
    fn one_lie_in_a_good_packet(
        which in 0usize..8, at: u16, wide: bool, cut in prop::option::of(any::<u16>()),
        to in prop_oneof![Just(0u8), Just(1), Just(0x7F), Just(0x80), Just(0xFF), any::<u8>()],
    ) {
        let mut rig = Rig::new();
        let client = rig.client(1);
        let mut bytes = packet(Command::SEND_RR_DATA, client.handle, &unconnected(&requests()[which]));
        // Behind the session handle: a lie there is another test.
        let span = bytes.len() - HEADER_LEN;
        let at = HEADER_LEN + usize::from(at) % span;
        bytes[at] = to;
        if wide && at + 1 < bytes.len() { bytes[at + 1] = to; }
        if let Some(cut) = cut {
            let length = usize::from(cut) % span;
            bytes.truncate(HEADER_LEN + length);
            bytes[2..4].copy_from_slice(&u16::try_from(length).unwrap().to_le_bytes());
        }
        rig.feed(client.slot, &bytes);
        rig.device_obliges();
        prop_assert_eq!(rig.received(client.slot).len(), 1);
        prop_assert_eq!(rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12]);
    }

    /// Any bytes on a stream: bounded memory, no panic, and every other stream goes on.
    #[test]
    fn any_stream(pieces in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..200), 0..10)) {
        let mut rig = Rig::new();
        let slot = rig.stream(1);
        let client = rig.client(2);
        for piece in pieces {
            rig.adapter.handle_stream(rig.now, slot, &piece);
            rig.received(slot);
        }
        prop_assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0);
    }

    #[test]
    fn any_datagram(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
        let mut rig = Rig::new();
        let mut out = [0; 256];
        let length = rig.adapter.handle_datagram(&bytes, &mut out);
        prop_assert!(length.is_none_or(|length| length <= 256));
    }
}
