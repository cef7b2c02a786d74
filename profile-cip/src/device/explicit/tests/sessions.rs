//! Encapsulation sessions and List commands.

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::explicit::adapter::{NoRoom, SESSIONS_KEPT, SESSIONS_MAX, SESSIONS_OF_HOST_MAX};
use crate::device::explicit::session::{INPUT_MAX, OUTPUT_HIGH};
use crate::device::hosts::Hosts;
use crate::device::motion_link::MotionReply;
use crate::wire::cpf::{CommonPacket, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, Packet};
use crate::wire::list_identity::IdentityItem;
use crate::wire::list_services::ServicesItem;
use crate::wire::status::Service;

#[test]
fn register_session_gives_each_stream_its_own_handle() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    assert_ne!(a.handle, b.handle);
    assert_ne!(a.handle, 0);
    // The incarnation of the configuration keeps the handles of two runs apart.
    assert_eq!(a.handle >> 16, 0x7A00);
}

#[test]
fn another_protocol_version_is_refused_and_told_ours() {
    let mut rig = Rig::new();
    let slot = rig.stream(1);
    let reply = rig.exchange(slot, &packet(Command::REGISTER_SESSION, 0, &[2, 0, 0, 0]));
    assert_eq!(reply.header.status, EncapsulationStatus::UNSUPPORTED_PROTOCOL);
    assert_eq!(reply.header.session_handle, 0);
    assert_eq!(reply.data, [1, 0, 0, 0]);
    let reply = rig.exchange(slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0, 1, 0]));
    assert_eq!(reply.header.status, EncapsulationStatus::UNSUPPORTED_PROTOCOL, "options");
    assert_eq!(rig.adapter.counters().versions_refused, 2);
    // The stream may still register rightly.
    let reply = rig.exchange(slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]));
    assert_eq!(reply.header.status, EncapsulationStatus::SUCCESS);
}

#[test]
fn a_second_register_and_a_wrong_length_are_refused() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let again = rig.exchange(client.slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]));
    assert_eq!(again.header.status, EncapsulationStatus::INVALID_COMMAND);
    let short = rig.exchange(client.slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0]));
    assert_eq!(short.header.status, EncapsulationStatus::INVALID_LENGTH);
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12], "the session lives on");
}

#[test]
fn unregister_session_ends_the_stream_without_an_answer() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.feed(client.slot, &packet(Command::UNREGISTER_SESSION, client.handle, &[]));
    assert_eq!(rig.received(client.slot), []);
    assert!(rig.adapter.is_done(client.slot));
    rig.adapter.close(client.slot);
    assert_eq!(rig.adapter.sessions(), 0);
}

#[test]
fn nop_is_never_answered() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.feed(client.slot, &packet(Command::NOP, client.handle, &[1, 2, 3]));
    assert_eq!(rig.received(client.slot), []);
    let mut out = [0; 256];
    assert_eq!(rig.adapter.handle_datagram(&packet(Command::NOP, 0, &[]), &mut out), None);
}

#[test]
fn packets_with_options_or_a_status_are_dropped() {
    let mut rig = Rig::new();
    let slot = rig.stream(1);
    for at in [8, 20] {
        let mut bytes = packet(Command::LIST_IDENTITY, 0, &[]);
        bytes[at] = 1;
        rig.feed(slot, &bytes);
        assert_eq!(rig.received(slot), []);
        assert_eq!(rig.adapter.handle_datagram(&bytes, &mut [0; 256]), None);
    }
    assert_eq!(rig.adapter.counters().packets_dropped, 2);
    assert_eq!(rig.adapter.counters().datagrams_dropped, 2);
}

#[test]
fn list_commands_are_answered_on_tcp_and_udp_alike() {
    let mut rig = Rig::new();
    let slot = rig.stream(1);
    for command in [Command::LIST_SERVICES, Command::LIST_IDENTITY, Command::LIST_INTERFACES] {
        let request = packet(command, 0, &[]);
        let tcp = rig.exchange(slot, &request);
        let mut out = [0xA5; 256];
        let length = rig.adapter.handle_datagram(&request, &mut out).unwrap();
        let udp = Packet::parse(&out[..length]).unwrap();
        assert_eq!((udp.command, udp.data), (command, tcp.data.as_slice()));
        assert_eq!(udp.sender_context, CONTEXT);
        assert_eq!(tcp.header.sender_context, CONTEXT);
        let list = CommonPacket::parse(udp.data).unwrap();
        match command {
            Command::LIST_SERVICES => {
                let item = ServicesItem::parse(list.find(ItemType::SERVICES).unwrap()).unwrap();
                assert_eq!(item.to_string(), "Communications capabilities 0x0120");
            }
            Command::LIST_IDENTITY => {
                let item = IdentityItem::parse(list.find(ItemType::IDENTITY).unwrap()).unwrap();
                assert_eq!(
                    item.to_string(),
                    "\"Axisbridge\" at 10.0.0.9:44818: vendor 0x1234 type 0x25 product 0x7 revision 2.3 \
                     serial 0xdeadbeef"
                );
                assert_eq!((item.status, item.state), (0x30, 3));
            }
            _ => assert_eq!(list.items.len(), 0),
        }
    }
}

#[test]
fn other_commands_by_datagram_are_refused() {
    let mut rig = Rig::new();
    let mut out = [0; 256];
    let length = rig.adapter.handle_datagram(&packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]), &mut out);
    let reply = Packet::parse(&out[..length.unwrap()]).unwrap();
    assert_eq!(reply.status, EncapsulationStatus::INVALID_COMMAND);
    assert_eq!(reply.data, []);
    // An answer that does not fit is none.
    let identity = packet(Command::LIST_IDENTITY, 0, &[]);
    assert_eq!(rig.adapter.handle_datagram(&identity, &mut [0; 40]), None);
}

#[test]
fn more_streams_than_slots_are_refused_until_one_ends() {
    let mut rig = Rig::new();
    let slots: Vec<_> = (0..SESSIONS_OF_HOST_MAX).map(|_| rig.stream(1)).collect();
    assert_eq!(rig.adapter.open(rig.now, peer(1)), Err(NoRoom::Host));
    for _ in SESSIONS_OF_HOST_MAX..SESSIONS_MAX - SESSIONS_KEPT {
        rig.stream(2);
    }
    assert_eq!(rig.adapter.open(rig.now, peer(3)), Err(NoRoom::All), "the rest is for controllers");
    assert_eq!(rig.adapter.counters().sessions_refused, 2);
    rig.adapter.close(slots[7]);
    let fresh = rig.stream(3);
    assert_ne!(fresh, slots[7], "a slot is not mistaken for its predecessor");
    assert!(rig.adapter.is_done(slots[7]));
    assert_eq!(rig.adapter.handle_stream(rig.now, slots[7], &[0; 24]), 0);
    rig.adapter.close(slots[7]);
    assert_eq!(rig.adapter.sessions(), SESSIONS_MAX - SESSIONS_KEPT);
}

#[test]
fn streams_are_kept_for_the_owner_and_for_listed_controllers() {
    /// Streams of two other hosts, as many as they get.
    fn fill(rig: &mut Rig) {
        for host in [5, 6] {
            while rig.adapter.open(rig.now, peer(host)).is_ok() {}
        }
        assert_eq!(rig.adapter.open(rig.now, peer(7)), Err(NoRoom::All));
    }
    let mut rig = Rig::new();
    let owner = rig.client(1);
    let open = rig.open_motion(owner, 1);
    rig.adapter.close(owner.slot);
    fill(&mut rig);
    for _ in 0..SESSIONS_KEPT {
        rig.stream(1);
    }
    assert_eq!(
        (rig.adapter.sessions(), rig.adapter.open(rig.now, peer(1))),
        (SESSIONS_MAX, Err(NoRoom::All))
    );

    // Also after the connection has ended, and the network with it.
    let mut rig = Rig::new();
    let owner = rig.client(1);
    rig.open_motion(owner, 1);
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    rig.adapter.close(owner.slot);
    fill(&mut rig);
    rig.stream(1);

    let mut rig = Rig::new();
    rig.adapter.node.config.controllers = Hosts::of([(*peer(1).ip()).into()..=(*peer(1).ip()).into()]);
    fill(&mut rig);
    rig.stream(1);
}

#[test]
fn a_packet_may_come_in_any_pieces() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let get = message(Service::GET_ATTRIBUTE_SINGLE, &[0x20, 1, 0x24, 1, 0x30, 1], &[]);
    let bytes = packet(Command::SEND_RR_DATA, client.handle, &unconnected(&get)).repeat(3);
    for size in [1, 3, 7, 25, bytes.len()] {
        for piece in bytes.chunks(size) {
            rig.feed(client.slot, piece);
        }
        let replies = rig.received(client.slot);
        assert_eq!(replies.len(), 3, "pieces of {size}");
        assert!(replies.iter().all(|reply| reply.data.ends_with(&[0x8E, 0, 0, 0, 0x34, 0x12])));
    }
}

#[test]
fn a_silent_session_is_closed_after_the_inactivity_time_out() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.pass(DurationNs::from_secs(100));
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0);
    rig.pass(DurationNs::from_secs(119));
    assert!(!rig.adapter.is_done(client.slot));
    // Half a packet is no sign of life.
    rig.feed(client.slot, &[0x65]);
    rig.pass(DurationNs::from_secs(1));
    assert!(rig.adapter.is_done(client.slot));
    let mut rig = Rig::with(|config| config.interface.inactivity_timeout_s = 0);
    let client = rig.client(1);
    rig.pass(DurationNs::from_secs(1_000_000));
    assert!(!rig.adapter.is_done(client.slot), "0 is never");
    assert_eq!(rig.adapter.wake_at(), None);
}

#[test]
fn a_request_under_way_is_not_silence() {
    let mut rig = Rig::with(|config| config.interface.inactivity_timeout_s = 1);
    let client = rig.client(1);
    rig.send_unconnected(client, &[0x0E, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, 0xB9, 1]);
    rig.pass(DurationNs::from_secs(2));
    assert!(!rig.adapter.is_done(client.slot));
    rig.device_answers(&[1]);
    assert_eq!(rig.unconnected_reply(client).0.data, [1]);
}

#[test]
fn a_peer_that_does_not_read_is_not_read_from() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let bytes = packet(Command::LIST_IDENTITY, 0, &[]).repeat(1000);
    let mut taken = 0;
    loop {
        match rig.adapter.handle_stream(rig.now, client.slot, &bytes[taken..]) {
            0 => break,
            more => taken += more,
        }
    }
    assert_eq!(rig.adapter.room(client.slot), 0);
    assert!(taken < bytes.len(), "input of {taken} bytes is bounded");
    // What was held back comes when the output goes.
    let waiting = taken / 24;
    assert_eq!(rig.received(client.slot).len(), waiting);
    assert!(waiting * 71 < OUTPUT_HIGH + 71 + INPUT_MAX / 24 * 71);
    assert_eq!(rig.adapter.room(client.slot), INPUT_MAX - taken % 24);
}
