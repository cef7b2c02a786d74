//! Class 3 connections.

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::connection::manager::{
    EXPLICIT_CONNECTIONS_MAX, EXPLICIT_PER_SESSION_MAX, EXPLICIT_SIZE_MAX,
};
use crate::device::event::Event;
use crate::wire::cpf::{EncapsulatedPacket, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus};
use crate::wire::forward_open::{ConnectionFailure, ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::status::Service;

const GET_VENDOR: &[u8] = &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1];

#[test]
fn a_message_goes_there_and_back() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let answer = rig.ask(client, &open_message(&explicit_open(1)));
    let reply = ForwardOpenReply::parse(&answer.data).unwrap();
    assert_eq!((reply.t_to_o_id, reply.triad), (0x5500_0001, triad(1)));
    assert_eq!((reply.o_to_t_api_us, reply.t_to_o_api_us), (1_000_000, 1_000_000));
    assert_ne!(reply.o_to_t_id, 0);
    rig.send_connected(client, reply.o_to_t_id, 1, GET_VENDOR);
    let (id, sequence, answer) = rig.connected_reply(client);
    assert_eq!((id, sequence, answer.data), (0x5500_0001, 1, vec![0x34, 0x12]));
    // Unconnected and connected messages mix in a session.
    assert_eq!(rig.ask(client, GET_VENDOR).status, 0);
}

#[test]
fn a_repeated_sequence_count_repeats_the_reply_and_not_the_service() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let id = rig.open_explicit(client, 1);
    let set = message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 0x48, 0x24, 1, 0x30, 4], &[46]);
    for _ in 0..3 {
        rig.send_connected(client, id, 7, &set);
        let (_, sequence, answer) = rig.connected_reply(client);
        assert_eq!((sequence, answer.service, answer.status), (7, 0x10, 0));
        // Were it run again, it would be set again.
        rig.adapter.node.config.qos.urgent = 1;
    }
    assert_eq!(rig.adapter.config().qos.urgent, 1);
    assert_eq!(rig.adapter.counters().connected_repeated, 2);
    // Another request under the same count is taken for the repetition it claims to be.
    rig.send_connected(client, id, 7, GET_VENDOR);
    assert_eq!(rig.connected_reply(client).2.service, 0x10);
    rig.send_connected(client, id, 8, GET_VENDOR);
    assert_eq!(rig.connected_reply(client).2.data, [0x34, 0x12]);
}

#[test]
fn repetitions_of_a_request_under_way_get_its_reply() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let id = rig.open_explicit(client, 1);
    let get = [0x0E, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, 0xB9, 1];
    rig.send_connected(client, id, 1, &get);
    rig.send_connected(client, id, 1, &get);
    rig.device_answers(&[3]);
    let replies = rig.received(client.slot);
    assert_eq!(replies.len(), 2);
    assert_eq!(replies[0].data, replies[1].data);
    assert_eq!(rig.adapter.poll_motion(), None, "the device is asked once");
}

#[test]
fn large_connections_carry_large_replies_and_small_ones_say_so() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let large = ForwardOpen {
        large: true,
        o_to_t: point_to_point(EXPLICIT_SIZE_MAX),
        t_to_o: point_to_point(EXPLICIT_SIZE_MAX),
        ..explicit_open(1)
    };
    let answer = rig.ask(client, &open_message(&large));
    assert_eq!((answer.service, answer.status), (0x5B, 0));
    let large = ForwardOpenReply::parse(&answer.data).unwrap().o_to_t_id;
    let small = rig.open_explicit(client, 2);
    let list = [&200u16.to_le_bytes()[..], &[6, 0].repeat(200)].concat();
    let list = message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &list);
    rig.send_connected(client, large, 1, &list);
    let answer = rig.connected_reply(client).2;
    assert_eq!((answer.status, answer.data.len()), (0, 2 + 200 * 8));
    rig.send_connected(client, small, 1, &list);
    assert_eq!(rig.connected_reply(client).2.outcome(), (0x11, 0));
    // A message longer than its connection is malformed.
    let long = message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[0; 500]);
    let bytes = packet(Command::SEND_UNIT_DATA, client.handle, &connected(small, 2, &long));
    assert_eq!(rig.exchange(client.slot, &bytes).header.status, EncapsulationStatus::INCORRECT_DATA);
}

#[test]
fn messages_of_unknown_or_foreign_connections_are_dropped() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let id = rig.open_explicit(a, 1);
    rig.send_connected(b, id, 1, GET_VENDOR);
    rig.send_connected(a, id + 1, 1, GET_VENDOR);
    assert_eq!(rig.received(a.slot), []);
    assert_eq!(rig.received(b.slot), []);
    assert_eq!(rig.adapter.counters().connected_unknown, 2);
}

#[test]
fn close_and_session_end_free_connections() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let id = rig.open_explicit(a, 1);
    rig.open_explicit(a, 2);
    let stranger = rig.ask(b, &close_message(1));
    assert_eq!(stranger.outcome(), (1, 0x107), "only from the address that opened it");
    assert_eq!(ConnectionFailure::parse(&stranger.data).unwrap().triad, triad(1));
    let closed = rig.ask(a, &close_message(1));
    assert_eq!((closed.outcome(), closed.data), ((0, 0), vec![1, 0, 1, 0, 0xFE, 0xCA, 0, 0, 0, 0]));
    assert_eq!(rig.ask(a, &close_message(1)).outcome(), (1, 0x107));
    rig.send_connected(a, id, 1, GET_VENDOR);
    assert_eq!(rig.received(a.slot), []);
    assert_eq!(rig.adapter.explicit_connections(), 1);
    rig.adapter.close(a.slot);
    assert_eq!(rig.adapter.explicit_connections(), 0);
}

#[test]
fn a_silent_connection_times_out_and_its_session_goes_on() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    // 1 s times 16, counted from the last message.
    let id = rig.open_explicit(client, 1);
    rig.pass(DurationNs::from_secs(15));
    rig.send_connected(client, id, 1, GET_VENDOR);
    rig.connected_reply(client);
    assert_eq!(rig.adapter.wake_at(), Some(rig.now + DurationNs::from_secs(16)));
    rig.pass(DurationNs::from_millis(15_999));
    assert_eq!(rig.adapter.explicit_connections(), 1);
    rig.pass(DurationNs::from_millis(1));
    assert_eq!(rig.adapter.explicit_connections(), 0);
    let originator = peer(1);
    let lost =
        Event::ExplicitLost { triad: triad(1), originator, silent_us: 16_000_000, timeout_us: 16_000_000 };
    assert_eq!(rig.events(), [lost]);
    assert_eq!(rig.adapter.counters().connection_timeouts, 1);
    rig.open_explicit(client, 1);
    // Before its first message a connection has 10 s, however short its interval.
    let quick = ForwardOpen { o_to_t_rpi_us: 10_000, t_to_o_rpi_us: 10_000, ..explicit_open(2) };
    assert_eq!(rig.ask(client, &open_message(&quick)).status, 0);
    rig.pass(DurationNs::from_millis(9_999));
    assert_eq!(rig.adapter.explicit_connections(), 2);
    rig.pass(DurationNs::from_millis(1));
    assert_eq!(rig.adapter.explicit_connections(), 1);
}

#[test]
fn connections_are_bounded_for_a_session_and_in_all() {
    let mut rig = Rig::new();
    let per_session = u16::try_from(EXPLICIT_PER_SESSION_MAX).unwrap();
    let sessions = u8::try_from(EXPLICIT_CONNECTIONS_MAX / EXPLICIT_PER_SESSION_MAX).unwrap();
    let mut serial = 0;
    for last in 0..sessions {
        let client = rig.client(last);
        for _ in 0..per_session {
            serial += 1;
            rig.open_explicit(client, serial);
        }
        assert_eq!(rig.refused(client, &explicit_open(serial + 1)).outcome(), (1, 0x113));
    }
    let late = rig.client(99);
    assert_eq!(rig.refused(late, &explicit_open(serial + 1)).outcome(), (1, 0x113));
    assert_eq!(rig.adapter.counters().open_resource_rejects, u64::from(sessions) + 1);
    assert_eq!(rig.adapter.counters().open_refused(1, 0x113), u64::from(sessions) + 1);
    // The motion connection is not theirs to take.
    rig.open_motion(late, 1000);
}

#[test]
fn what_an_explicit_connection_may_not_be_like() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.open_explicit(client, 1);
    let good = explicit_open(2);
    let multicast = NetworkParameters { connection_type: ConnectionType::MULTICAST, ..good.o_to_t };
    let null = NetworkParameters { connection_type: ConnectionType::NULL, ..good.o_to_t };
    let redundant = NetworkParameters { redundant_owner: true, ..good.o_to_t };
    let transport = |server, trigger, class| Transport { server, trigger, class };
    let cases: &[(&str, ForwardOpen<'_>, &[u16])] = &[
        ("duplicate", explicit_open(1), &[0x100]),
        ("class 1", ForwardOpen { transport: transport(true, Trigger::CYCLIC, 1), ..good }, &[0x11C]),
        ("class 2", ForwardOpen { transport: transport(true, Trigger::APPLICATION, 2), ..good }, &[0x11C]),
        ("client", ForwardOpen { transport: transport(false, Trigger::APPLICATION, 3), ..good }, &[0x11E]),
        ("trigger", ForwardOpen { transport: transport(true, Trigger(5), 3), ..good }, &[0x11D]),
        ("multicast", ForwardOpen { t_to_o: multicast, ..good }, &[0x124]),
        ("one null", ForwardOpen { o_to_t: null, ..good }, &[0x123]),
        ("redundant", ForwardOpen { o_to_t: redundant, ..good }, &[0x125]),
        ("multiplier", ForwardOpen { timeout_multiplier: 8, ..good }, &[0x133]),
        ("no interval", ForwardOpen { o_to_t_rpi_us: 0, ..good }, &[0x111, 10_000, 0, 16960, 15]),
        ("tiny", ForwardOpen { o_to_t: point_to_point(5), ..good }, &[0x127, 6]),
        (
            "huge",
            ForwardOpen { large: true, t_to_o: point_to_point(4003), ..good },
            &[0x128, EXPLICIT_SIZE_MAX],
        ),
        ("identity", ForwardOpen { path: PATH_IDENTITY, ..good }, &[0x117]),
        ("no path", ForwardOpen { path: &[], ..good }, &[0x117]),
        ("slot", ForwardOpen { path: &[1, 0, 0x20, 2, 0x24, 1], ..good }, &[0x311]),
        ("symbol", ForwardOpen { path: &[0x91, 2, b'a', b'b'], ..good }, &[0x315]),
        ("router 2", ForwardOpen { path: &[0x20, 2, 0x24, 2], ..good }, &[0x117]),
        ("two classes", ForwardOpen { path: &[0x20, 2, 0x20, 1], ..good }, &[0x117]),
    ];
    for (name, open, extended) in cases {
        let answer = rig.refused(client, open);
        assert_eq!((answer.status, answer.extended.as_slice()), (1, *extended), "{name}");
        assert_eq!(ConnectionFailure::parse(&answer.data).unwrap().triad, open.triad, "{name}");
        assert!(rig.adapter.counters().open_refused(1, extended[0]) > 0, "{name}");
    }
    let routed = rig.refused(client, &ForwardOpen { path: &[1, 0, 0x20, 2, 0x24, 1], ..good });
    assert_eq!(ConnectionFailure::parse(&routed.data).unwrap().remaining_path_words, 3);
    assert_eq!(rig.adapter.explicit_connections(), 1);
}

#[test]
fn a_null_forward_open_opens_nothing() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let null = NetworkParameters { connection_type: ConnectionType::NULL, ..point_to_point(0) };
    let ping = ForwardOpen { o_to_t: null, t_to_o: null, ..explicit_open(1) };
    assert_eq!(rig.ask(client, &open_message(&ping)).outcome(), (0, 0));
    assert_eq!(rig.adapter.explicit_connections(), 0);
    let id = rig.open_explicit(client, 1);
    let answer = rig.ask(client, &open_message(&ping));
    assert_eq!(ForwardOpenReply::parse(&answer.data).unwrap().o_to_t_id, id);
    let elsewhere = ForwardOpen { path: &[0x34, 4, 9, 0, 0, 0, 0, 0, 0, 0, 0x20, 2, 0x24, 1], ..ping };
    assert_eq!(rig.refused(client, &elsewhere).outcome(), (1, 0x114));
}

#[test]
fn a_connection_that_ends_while_its_request_is_under_way_gets_no_reply() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(1));
    let id = rig.open_explicit(a, 1);
    rig.send_connected(a, id, 1, &[0x0E, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, 0xB9, 1]);
    assert_eq!(rig.ask(b, &close_message(1)).outcome(), (0, 0), "same address, other session");
    rig.device_answers(&[1]);
    assert_eq!(rig.received(a.slot), []);
    assert_eq!(rig.ask(a, GET_VENDOR).status, 0);
}

#[test]
fn connected_items_are_two() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let id = rig.open_explicit(client, 1);
    rig.send_connected(client, id, 1, GET_VENDOR);
    let received = rig.the_one(client.slot);
    let body = EncapsulatedPacket::parse(&received.data).unwrap();
    let types: Vec<_> = body.packet.items.iter().map(|item| item.item_type).collect();
    assert_eq!(types, [ItemType::CONNECTED_ADDRESS, ItemType::CONNECTED_DATA]);
}

/// What originators expect of a device: three sessions and six connections of class 3 at least, several of them in a
/// session, unconnected and connected messages at once. Here is what there is.
#[test]
fn capacity_that_originators_expect() {
    let mut rig = Rig::new();
    let clients: Vec<_> = (1..=4).map(|last| rig.client(last)).collect();
    rig.open_motion(clients[0], 1000);
    let mut ids = Vec::new();
    for (serial, client) in (1..).zip(clients.iter().cycle().take(EXPLICIT_CONNECTIONS_MAX)) {
        ids.push((*client, rig.open_explicit(*client, serial)));
    }
    for (client, id) in &ids {
        rig.send_connected(*client, *id, 1, GET_VENDOR);
        rig.send_unconnected(*client, GET_VENDOR);
        let replies = rig.received(client.slot);
        assert_eq!(
            replies.iter().map(|reply| reply.header.command).collect::<Vec<_>>(),
            [Command::SEND_UNIT_DATA, Command::SEND_RR_DATA]
        );
        assert!(replies.iter().all(|reply| reply.data.ends_with(&[0x8E, 0, 0, 0, 0x34, 0x12])));
    }
    assert_eq!(rig.adapter.explicit_connections(), 32);
    assert_eq!(rig.get(clients[1], PATH_ROUTER, 3).data, [33, 0]);
    assert_eq!(rig.refused(clients[2], &explicit_open(99)).outcome(), (1, 0x113));
}
