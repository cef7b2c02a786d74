//! Malformed input of no known name: items and packets that lie, streams of something else, and any bytes at all. What has
//! brought other targets down is in `other_targets`, the table of every service in `malformed`.

use proptest::prelude::*;

use super::rig::*;
use crate::wire::cpf::ItemType;
use crate::wire::encapsulation::{Command, EncapsulationStatus, HEADER_LEN};
use crate::wire::forward_open::ForwardOpen;
use crate::wire::status::Service;

#[test]
fn item_lengths_that_lie() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let data = unconnected(&message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    for (at, value) in [(10, 1), (10, 0xFFFF), (14, 0), (14, 5), (14, 7), (14, 0xFFFF)] {
        let mut data = data.clone();
        data[at..at + 2].copy_from_slice(&u16::to_le_bytes(value));
        let status = rig.encapsulation_status(client, Command::SEND_RR_DATA, &data);
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
            let status = rig.encapsulation_status(client, command, &encapsulated(items));
            assert_eq!(status, EncapsulationStatus::INCORRECT_DATA, "{items:?}");
        }
    }
    let odd = [item(ItemType::CONNECTED_ADDRESS, &[1, 2, 3]), item(ItemType::CONNECTED_DATA, &[1, 0, 1, 0])];
    let status = rig.encapsulation_status(client, Command::SEND_UNIT_DATA, &encapsulated(&odd));
    assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
    let mut other_interface = unconnected(&get);
    other_interface[0] = 1;
    let status = rig.encapsulation_status(client, Command::SEND_RR_DATA, &other_interface);
    assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
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
