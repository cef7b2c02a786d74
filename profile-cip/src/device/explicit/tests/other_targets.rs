//! Faults that were found in other targets, by running them or in public reports, each by its name. None is in this one.
//!
//! Two more stand where sockets and the whole chain are: a client that stalls after four bytes, in
//! `gateway/src/north/tests/streams.rs` and in `tests/tests/virtual_time/`.

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::axis_object::AxisConfig;
use crate::device::connection::manager::{EXPLICIT_CONNECTIONS_MAX, EXPLICIT_PER_SESSION_MAX};
use crate::device::event::Event;
use crate::device::motion::device::{DeviceConfig, MotionDevice};
use crate::wire::cpf::ItemType;
use crate::wire::encapsulation::{Command, EncapsulationStatus};
use crate::wire::forward_open::ForwardOpen;
use crate::wire::motion::codes::{NodeControl, TimeDataSet};
use crate::wire::motion::{CommandHeader, CommandWriter, Format};
use crate::wire::status::Service;

/// A rig with the real motion device behind the adapter, both on one virtual clock.
struct Whole {
    rig: Rig,
    device: MotionDevice,
}

impl Whole {
    fn new() -> Self {
        let config = DeviceConfig {
            format: Format::Variable,
            axes: vec![AxisConfig::default(); 2],
            attributes: Vec::new(),
            power_structure_class_id: 0x0A0B_0C0D,
            supports_sync: true,
            sync_threshold: None,
            transmission_processing_ns: 100_000,
        };
        Self { rig: Rig::new(), device: MotionDevice::new(config).unwrap() }
    }

    /// One cycle of the device after `step`.
    fn cycle(&mut self, step: DurationNs) {
        self.rig.pass(step);
        while let Some(request) = self.rig.adapter.poll_motion() {
            self.device.request(self.rig.now, None, request);
        }
        self.device.poll(self.rig.now, None);
        while let Some(reply) = self.device.poll_reply() {
            self.rig.complete(&reply);
        }
    }

    /// Asks for the motion connection and runs one cycle of the device.
    fn open(&mut self, client: Client, serial: u16) -> Answered {
        self.rig.send_unconnected(client, &open_message(&motion_open(serial)));
        self.cycle(DurationNs(0));
        self.rig.unconnected_reply(client).0
    }
}

/// A well-known stack refuses for minutes. Until its first update an owner has ten seconds.
#[test]
fn a_vanished_exclusive_owner_blocks_nobody_once_its_time_is_up() {
    let mut update = [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let header = CommandHeader {
        update_id: 1,
        node_control: NodeControl::empty(),
        instance_count: 0,
        last_received_id: 0,
        time_stamp: None,
        time_offset: None,
        diagnostics: TimeDataSet::empty(),
    };
    let len = 2 + CommandWriter::new(&mut update[2..], &header).expect("room").finish();
    // Every multiplier: 4, 8, .. 512 intervals of 2 ms.
    for (code, is_heard) in (0..8u8).flat_map(|code| [(code, false), (code, true)]) {
        let timeout = DurationNs::from_millis(2 * (4 << code));
        let mut all = Whole::new();
        let (a, b) = (all.rig.client(1), all.rig.client(2));
        let open = ForwardOpen { timeout_multiplier: code, ..motion_open(1) };
        all.rig.send_unconnected(a, &open_message(&open));
        all.cycle(DurationNs(0));
        assert_eq!(all.rig.unconnected_reply(a).0.outcome(), (0, 0));
        all.rig.events();
        let (now, mut silence) = (all.rig.now, DurationNs::from_secs(10));
        if is_heard {
            all.device.handle_io(now, None, &update[..len]);
            silence = timeout;
        }
        // It vanishes without a word: no datagram, no Forward_Close, its stream half open.
        all.cycle(silence);
        assert_eq!(all.open(b, 2).outcome(), (1, 0x106), "multiplier {code}: until then it is its");
        all.rig.events();
        all.cycle(DurationNs(1));
        assert_eq!(all.open(b, 2).outcome(), (0, 0), "multiplier {code}: the next cycle, and no later");
        let (silent_us, timeout_us) = (silence.magnitude() / 1000, timeout.magnitude() / 1000);
        let lost = Event::MotionLost { triad: triad(1), originator: peer(1), silent_us, timeout_us };
        assert_eq!(all.rig.events()[0], lost);
        // The first one cannot close what is no longer its.
        assert_eq!(all.rig.ask(a, &close_message(1)).outcome(), (1, 0x107));
        assert!(all.rig.adapter.motion_connection().is_some());
    }
}

#[test]
fn a_client_that_stalls_after_four_bytes_costs_nothing_and_is_closed_in_time() {
    let mut rig = Rig::new();
    let stalled = rig.stream(1);
    let client = rig.client(2);
    rig.feed(stalled, &[0x65, 0, 4, 0]);
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0, "others go on");
    assert_eq!(rig.received(stalled), []);
    rig.pass(DurationNs::from_millis(29_999));
    assert!(!rig.adapter.is_done(stalled));
    assert_eq!(rig.adapter.wake_at(), Some(rig.now + DurationNs::from_millis(1)));
    rig.pass(DurationNs::from_millis(1));
    assert!(rig.adapter.is_done(stalled));
    assert!(!rig.adapter.is_done(client.slot));
    assert_eq!(rig.adapter.ready().collect::<Vec<_>>(), [stalled]);
    assert_eq!(rig.adapter.counters().sessions_timed_out, 1);
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
        let status = rig.encapsulation_status(client, command, &data);
        assert_eq!(status, EncapsulationStatus::INCORRECT_DATA);
    }
    assert_eq!(rig.adapter.counters().data_malformed, 2);
}

#[test]
fn short_forward_open_cut_at_every_byte() {
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
fn session_handle_used_from_another_socket() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let stranger = rig.stream(3);
    let get = unconnected(&message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    for (slot, handle) in [(b.slot, a.handle), (stranger, a.handle), (stranger, 0), (a.slot, 0)] {
        for command in [Command::SEND_RR_DATA, Command::SEND_UNIT_DATA] {
            let reply = rig.exchange(slot, &packet(command, handle, &get));
            assert_eq!(reply.header.status, EncapsulationStatus::INVALID_SESSION_HANDLE);
            assert_eq!(reply.data, []);
        }
    }
    assert_eq!(rig.adapter.counters().handles_invalid, 8);
}

#[test]
fn unregister_session_of_another_session() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let reply = rig.exchange(b.slot, &packet(Command::UNREGISTER_SESSION, a.handle, &[]));
    assert_eq!(reply.header.status, EncapsulationStatus::INVALID_SESSION_HANDLE);
    assert_eq!(rig.adapter.counters().handles_invalid, 1);
    assert_eq!(rig.get(a, PATH_IDENTITY, 1).status, 0);
    assert_eq!(rig.get(b, PATH_IDENTITY, 1).status, 0);
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
fn oversize_length_fields_are_not_cut_to_16_bits() {
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
fn time_out_multipliers_that_do_not_exist() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for code in 8..=255 {
        for open in [motion_open(1), explicit_open(1)] {
            let open = ForwardOpen { timeout_multiplier: code, ..open };
            assert_eq!(rig.refused(client, &open).outcome(), (1, 0x133), "multiplier {code}");
        }
    }
}

#[test]
fn expired_explicit_connections_are_released_and_counted() {
    let mut rig = Rig::new();
    let rounds = 5;
    for round in 0..rounds {
        // All there are, on sessions whose clients never speak again.
        let mut serial = 0;
        for _ in 0..EXPLICIT_CONNECTIONS_MAX / EXPLICIT_PER_SESSION_MAX {
            let client = rig.client(1);
            for _ in 0..EXPLICIT_PER_SESSION_MAX {
                serial += 1;
                rig.open_explicit(client, serial);
            }
        }
        let late = rig.client(2);
        assert_eq!(rig.refused(late, &explicit_open(99)).outcome(), (1, 0x113));
        rig.pass(DurationNs::from_secs(16));
        assert_eq!(rig.adapter.explicit_connections(), 0, "round {round}");
        assert_eq!(rig.ask(late, &message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[])).status, 0);
        rig.open_explicit(late, 99);
        // Their streams end as well, and the places are free again.
        rig.pass(DurationNs::from_secs(120));
        let done: Vec<_> = rig.adapter.ready().collect();
        done.into_iter().for_each(|slot| rig.adapter.close(slot));
        assert_eq!((rig.adapter.sessions(), rig.adapter.explicit_connections()), (0, 0));
    }
    let all = u64::try_from(EXPLICIT_CONNECTIONS_MAX + 1).unwrap() * rounds;
    assert_eq!(rig.adapter.counters().connection_timeouts, all);
}

/// The device follows no PTP clock itself and opens no PTP port (319, 320). What comes to the ports it has is dropped
/// and counted, whole or broken.
#[test]
fn malformed_ptp_reaches_nothing() {
    let mut all = Whole::new();
    let client = all.rig.client(1);
    assert_eq!(all.open(client, 1).outcome(), (0, 0));
    // Announce and Sync with lengths that lie.
    let mut ptp = vec![0x0B, 0x02, 0, 64, 0, 0, 0x02, 0];
    ptp.resize(64, 0);
    let mut datagrams = 0;
    for kind in 0..=0x0F {
        for length in [0u16, 10, 34, 64, 0xFFFF] {
            for size in [1, 8, 34, 44, 64] {
                let mut message = ptp[..size].to_vec();
                message[0] = kind;
                if size > 4 {
                    message[2..4].copy_from_slice(&length.to_be_bytes());
                }
                assert_eq!(all.rig.adapter.handle_datagram(&message, &mut [0; 256]), None);
                all.device.handle_io(all.rig.now, None, &message);
                datagrams += 1;
            }
        }
    }
    assert_eq!(all.rig.adapter.counters().datagrams_dropped, datagrams);
    assert_eq!(all.device.counters().applied, 0);
    assert_eq!(all.rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12]);
}

/// Lengths and counts of nothing, everywhere at once: where other targets stopped at an assertion. The table of every
/// service is in `malformed`, and any bytes at all in `bad_input`.
#[test]
fn reachable_assertions() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let id = rig.open_explicit(client, 1);
    for message in [
        &[][..],
        &[0],
        &[0, 0],
        &[0x80],
        &[0x80, 0],
        &[0xFF, 0xFF],
        &[0x0E],
        &[0x0A, 0],
        &[0x52, 0],
        &[0x54, 0],
        &[0x4E, 0],
    ] {
        rig.send_unconnected(client, message);
        assert_ne!(rig.unconnected_reply(client).0.status, 0, "{message:02x?}");
    }
    for sequence in 1..=3 {
        rig.send_connected(client, id, sequence, &[]);
        assert_eq!(rig.connected_reply(client).2.outcome(), (0x13, 0));
    }
    // An item without room for the sequence count.
    let id = id.to_le_bytes();
    let items = [item(ItemType::CONNECTED_ADDRESS, &id), item(ItemType::CONNECTED_DATA, &[1])];
    let reply =
        rig.exchange(client.slot, &packet(Command::SEND_UNIT_DATA, client.handle, &encapsulated(&items)));
    assert_eq!(reply.header.status, EncapsulationStatus::INCORRECT_DATA);
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12]);
}
