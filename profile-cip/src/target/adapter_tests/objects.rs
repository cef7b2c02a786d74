//! The objects every CIP node has, attribute by attribute.

use std::sync::Arc;

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::target::adapter::DEVICE_TIMEOUT;
use crate::target::config::AdapterConfig;
use crate::target::ethernet_link::{GET_AND_CLEAR, InterfaceCounters, LinkState, MediaCounters};
use crate::target::event::{Event, ResetKind};
use crate::target::identity::{Health, ModuleState};
use crate::target::motion_link::MotionReply;
use crate::wire::status::Service;

const TCP_IP: &[u8] = &[0x20, 0xF5, 0x24, 1];
const LINK: &[u8] = &[0x20, 0xF6, 0x24, 1];
const QOS: &[u8] = &[0x20, 0x48, 0x24, 1];

#[test]
fn identity_attributes() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let attributes: [&[u8]; 9] = [
        &[0x34, 0x12],
        &[0x25, 0],
        &[7, 0],
        &[2, 3],
        &[0x30, 0],
        &[0xEF, 0xBE, 0xAD, 0xDE],
        b"\x0AAxisbridge",
        &[3],
        // The CRC of the settings.
        &[0xB1, 0xFB],
    ];
    for (number, value) in (1..).zip(attributes) {
        let answer = rig.get(client, PATH_IDENTITY, number);
        assert_eq!((answer.status, answer.data.as_slice()), (0, value), "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    assert_eq!((all.service, all.status, all.data), (1, 0, attributes.concat()));
    let class_all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, &[0x20, 1], &[]));
    assert_eq!((class_all.status, class_all.data), (0, vec![1, 0, 1, 0, 7, 0, 9, 0]));
    assert_eq!(rig.get(client, PATH_IDENTITY, 10).outcome(), (0x14, 0));
    assert_eq!(rig.get(client, &[0x20, 1, 0x24, 2], 1).outcome(), (0x05, 0));
    assert_eq!(rig.get(client, &[0x20, 0x99, 0x24, 1], 1).outcome(), (0x05, 0));
    let bare = rig.ask(client, &message(Service::GET_ATTRIBUTE_SINGLE, PATH_IDENTITY, &[]));
    assert_eq!(bare.outcome(), (0x04, 0), "an attribute must be named");
    let set = message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 1, 0x24, 1, 0x30, 1], &[1, 0]);
    assert_eq!(rig.ask(client, &set).outcome(), (0x0E, 0));
    let unknown = message(Service(0x4B), PATH_IDENTITY, &[]);
    assert_eq!(rig.ask(client, &unknown).outcome(), (0x08, 0));
}

#[test]
fn identity_list_says_what_it_lacks_and_gives_the_rest() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let request = message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &[3, 0, 1, 0, 99, 0, 4, 0]);
    let answer = rig.ask(client, &request);
    assert_eq!(answer.outcome(), (0x0A, 0));
    assert_eq!(answer.data, [3, 0, 1, 0, 0, 0, 0x34, 0x12, 99, 0, 0x14, 0, 4, 0, 0, 0, 2, 3]);
    let class = message(Service::GET_ATTRIBUTE_LIST, &[0x20, 1, 0x24, 0], &[1, 0, 1, 0]);
    let answer = rig.ask(client, &class);
    assert_eq!((answer.status, answer.data), (0, vec![1, 0, 1, 0, 0, 0, 1, 0]));
}

#[test]
fn identity_status_follows_health_and_ownership() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let health = |state| Health { state, ..Health::default() };
    let open = rig.open_motion(client, 1);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 0], "in run mode");
    rig.adapter.set_health(health(ModuleState::Standby));
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x71, 0], "in idle mode");
    assert_eq!(rig.get(client, PATH_IDENTITY, 8).data, [2]);
    rig.adapter.set_health(Health { minor_recoverable: true, configured: true, ..Health::default() });
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x65, 1]);
    rig.adapter.set_health(health(ModuleState::MajorRecoverableFault));
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x51, 4]);
    assert_eq!(rig.get(client, PATH_IDENTITY, 8).data, [4]);
    rig.adapter.set_health(Health::default());
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x20, 0], "an I/O connection is faulted");
    rig.open_motion(client, 2);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 0]);
    rig.send_unconnected(client, &close_message(2));
    rig.device_closes();
    rig.received(client.slot);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x30, 0], "none, and none was lost");
}

#[test]
fn the_consistency_value_changes_with_every_setting() {
    let consistency = |change: &dyn Fn(&mut AdapterConfig)| {
        let mut rig = Rig::with(change);
        let client = rig.client(1);
        rig.get(client, PATH_IDENTITY, 9).data
    };
    let values = [
        consistency(&|_| {}),
        consistency(&|config| config.identity.configuration = 1),
        consistency(&|config| config.qos.urgent = 54),
        consistency(&|config| config.qos.explicit = 26),
        consistency(&|config| config.interface.inactivity_timeout_s = 121),
    ];
    let mut distinct = values.to_vec();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), values.len(), "{values:02x?}");
    assert_eq!(
        consistency(&|config| config.identity.serial_number = 5),
        values[0],
        "who it is does not count"
    );
}

#[test]
fn a_key_in_the_path_is_checked() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let ours = [&[0x34, 4, 0x34, 0x12, 0x25, 0, 7, 0, 2, 3][..], PATH_IDENTITY].concat();
    assert_eq!(rig.get(client, &ours, 1).outcome(), (0, 0));
    let other = [&[0x34, 4, 1, 0, 0, 0, 0, 0, 0, 0][..], PATH_IDENTITY].concat();
    assert_eq!(rig.get(client, &other, 1).outcome(), (0x25, 0));
}

#[test]
fn paths_that_name_no_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for path in [
        &[][..],
        &[0x24, 1],
        &[0x20, 1, 0x20, 1],
        &[0x20, 1, 0x24, 1, 0x24, 1],
        &[0x20, 1, 0x24, 1, 0x28, 1],
        &[0x20, 1, 0x24, 1, 0x2C, 1],
        &[1, 0, 0x20, 1, 0x24, 1],
        &[0x91, 2, b'a', b'b'],
        &[0x80, 1, 0, 0],
        &[0x22, 0, 1, 0, 1, 0, 0x24, 1],
    ] {
        let answer = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, path, &[]));
        assert_eq!(answer.outcome(), (0x04, 0), "{path:02x?}");
    }
    // Wider formats of the same numbers are the same object.
    let wide = [0x21, 0, 1, 0, 0x26, 0, 1, 0, 0, 0];
    assert_eq!(rig.get(client, &wide, 1).data, [0x34, 0x12]);
}

#[test]
fn reset_is_answered_and_told() {
    for (data, kind) in
        [(&[][..], ResetKind::PowerCycle), (&[0], ResetKind::PowerCycle), (&[1], ResetKind::FactoryDefaults)]
    {
        let mut rig = Rig::new();
        let client = rig.client(1);
        rig.send_unconnected(client, &message(Service::RESET, PATH_IDENTITY, data));
        assert_eq!(rig.events(), [], "not before the device has agreed");
        rig.device_prepares_reset(true);
        let (answer, _) = rig.unconnected_reply(client);
        assert_eq!((answer.service, answer.outcome(), answer.data.len()), (5, (0, 0), 0), "{data:?}");
        assert_eq!(rig.events(), [Event::Reset { kind, originator: peer(1) }]);
        // What was granted for axes at rest must not happen to axes that were enabled since.
        assert_eq!(rig.refused(client, &motion_open(1)).outcome(), (0x10, 0));
        let again = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, &[]));
        assert_eq!(again.outcome(), (0x0B, 0));
        // The rest goes on until the restart.
        assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0);
    }
}

#[test]
fn a_reset_of_no_kind_asks_nobody() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (data, outcome) in [(&[2][..], 0x20), (&[255], 0x20), (&[0, 0], 0x15)] {
        let answer = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, data));
        assert_eq!(answer.outcome(), (outcome, 0), "{data:?}");
    }
    assert_eq!(rig.adapter.poll_motion(), None);
    assert_eq!(rig.events(), []);
}

#[test]
fn a_reset_is_refused_while_a_controller_owns_the_axes_or_one_is_energized() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let reset = message(Service::RESET, PATH_IDENTITY, &[0]);
    let open = rig.open_motion(client, 1);
    rig.events();
    assert_eq!(rig.ask(client, &reset).outcome(), (0x10, 0), "owned");
    // The controller is gone, the axes are still coming to a stop.
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    rig.events();
    rig.send_unconnected(client, &reset);
    rig.device_prepares_reset(false);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x10, 0));
    assert_eq!(rig.events(), []);
    // Nothing is left behind: the next owner may come, and a later reset is asked for anew.
    rig.open_motion(client, 2);
}

#[test]
fn nothing_is_opened_between_the_question_for_a_reset_and_its_answer() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, &message(Service::RESET, PATH_IDENTITY, &[0]));
    assert_eq!(rig.ask(b, &open_message(&motion_open(1))).outcome(), (0x10, 0));
    assert_eq!(
        rig.ask(b, &message(Service::RESET, PATH_IDENTITY, &[0])).outcome(),
        (0x10, 0),
        "one at a time"
    );
    // The one who asked does not wait for the answer; it counts all the same.
    rig.adapter.close(a.slot);
    rig.device_prepares_reset(true);
    assert!(matches!(rig.events().last(), Some(Event::Reset { .. })));
}

#[test]
fn a_reset_the_device_does_not_answer_is_given_up() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &message(Service::RESET, PATH_IDENTITY, &[0]));
    let token = rig.motion_request().token();
    rig.pass(DEVICE_TIMEOUT);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x02, 0));
    let silent = Event::DeviceSilent { service: Service::RESET, waited_us: 3_000_000 };
    assert_eq!(rig.events(), [silent]);
    assert_eq!(silent.to_string(), "Reset: no answer of the motion device within 3000000 us");
    // Its late consent restarts nothing.
    rig.complete(&MotionReply::ResetPrepared { token, granted: true });
    assert_eq!(rig.events(), []);
    rig.open_motion(client, 1);
}

#[test]
fn message_router_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let classes = rig.get(client, PATH_ROUTER, 1);
    assert_eq!(classes.data, [7, 0, 1, 0, 2, 0, 6, 0, 0x42, 0, 0x48, 0, 0xF5, 0, 0xF6, 0]);
    assert_eq!(rig.get(client, PATH_ROUTER, 2).data, [33, 0]);
    rig.open_motion(client, 1);
    rig.open_explicit(client, 2);
    assert_eq!(rig.get(client, PATH_ROUTER, 3).data, [2, 0]);
    let mut rig = Rig::with(|config| config.eds = Arc::from(&b"[File]"[..]));
    let client = rig.client(1);
    let classes = rig.get(client, PATH_ROUTER, 1);
    assert_eq!(classes.data, [8, 0, 1, 0, 2, 0, 6, 0, 0x37, 0, 0x42, 0, 0x48, 0, 0xF5, 0, 0xF6, 0]);
}

#[test]
fn connection_manager_counts() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.open_explicit(client, 1);
    rig.refused(client, &explicit_open(1));
    rig.ask(client, &open_message(&explicit_open(2))[..20]);
    assert_eq!(rig.ask(client, &close_message(9)).outcome(), (1, 0x107));
    rig.pass(DurationNs::from_secs(17));
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, PATH_MANAGER, &[]));
    // Requests, format, resource and other rejects of opens; requests, format and other rejects of closes;
    // time-outs.
    let counts = [3, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 0];
    // And of 33 connections none is open.
    assert_eq!(all.data, [&counts[..], &[33, 0, 0, 0, 0, 0, 0]].concat());
}

#[test]
fn connection_data_by_number_and_by_triad() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let get = |number: u16| message(Service::GET_CONNECTION_DATA, PATH_MANAGER, &number.to_le_bytes());
    let search = |serial: u8| {
        message(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[serial, 0, 1, 0, 0xFE, 0xCA, 0, 0])
    };
    for request in [get(0), get(1), get(33), get(0xFFFF), search(1)] {
        assert_eq!(rig.ask(client, &request).outcome(), (0x05, 0), "none is open");
    }
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    let other = rig.client(2);
    assert_eq!(rig.ask(other, &get(0)).data[..4], [0, 0, 1, 0], "configuring");
    let open = rig.device_opens();
    rig.received(client.slot);
    let data = rig.ask(client, &get(0)).data;
    let (o_to_t, t_to_o) = (open.o_to_t_id.to_le_bytes(), open.t_to_o_id.to_le_bytes());
    // Number 0, established, ports 50000 and 2222, triad, IDs, multiplier code 2, 2000 us.
    let head = [0, 0, 3, 0, 0x50, 0xC3, 0xAE, 8, 1, 0, 1, 0, 0xFE, 0xCA, 0, 0];
    let tail = [2, 0, 0, 0, 0xD0, 7, 0, 0, 0xD0, 7, 0, 0];
    let expected = [&head[..], &o_to_t, &o_to_t, &tail, &t_to_o, &t_to_o, &tail].concat();
    assert_eq!(data, expected);
    assert_eq!(rig.ask(client, &search(1)).data, expected);
    rig.open_explicit(client, 2);
    rig.open_explicit(client, 3);
    assert_eq!(rig.get(client, PATH_MANAGER, 9).data, [33, 0, 0b0000_0111, 0, 0, 0, 0]);
    assert_eq!(rig.ask(client, &close_message(2)).status, 0);
    // Numbers stay with their connections, and a free one is given again.
    assert_eq!(rig.get(client, PATH_MANAGER, 9).data, [33, 0, 0b0000_0101, 0, 0, 0, 0]);
    let third = rig.ask(client, &get(2)).data;
    assert_eq!((&third[..10], third.len()), (&[2, 0, 3, 0, 0x50, 0xC3, 0x12, 0xAF, 3, 0][..], 56));
    assert_eq!(rig.ask(client, &search(2)).outcome(), (0x05, 0));
    rig.open_explicit(client, 4);
    assert_eq!(rig.ask(client, &search(4)).data[..4], [1, 0, 3, 0]);
    rig.send_unconnected(client, &close_message(1));
    assert_eq!(rig.ask(other, &get(0)).data[..4], [0, 0, 6, 0], "closing");
    rig.device_closes();
}

#[test]
fn tcp_ip_interface_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let interface: &[u8] = &[
        9, 0, 0, 10, 0, 255, 255, 255, 1, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, b'p', b'l', b'a', b'n',
        b't', 0,
    ];
    // Safety network number and quick connect, which are not there, stand in the whole with zeros. Host 9 of a /24
    // has the ninth block of 32 groups from 239.192.1.0 on.
    let attributes: [(u8, &[u8]); 13] = [
        (0, &[1, 0, 0, 0]),
        (0, &[0; 4]),
        (0, &[0; 4]),
        (0, &[2, 0, 0x20, 0xF6, 0x24, 1]),
        (0, interface),
        (0, b"\x06\x00axis-1"),
        (0x14, &[0; 6]),
        (0, &[1]),
        (0, &[0, 0, 1, 0, 0, 2, 192, 239]),
        (0, &[0]),
        (0, &[0; 35]),
        (0x14, &[0]),
        (0, &[120, 0]),
    ];
    for (number, (status, value)) in (1..).zip(attributes) {
        let answer = rig.get(client, TCP_IP, number);
        let value = if status == 0 { value } else { &[] };
        assert_eq!((answer.status, answer.data.as_slice()), (status, value), "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, TCP_IP, &[]));
    assert_eq!(all.data, attributes.map(|(_, value)| value).concat());
    let set = |attribute: u8, value: &[u8]| {
        message(Service::SET_ATTRIBUTE_SINGLE, &[TCP_IP, &[0x30, attribute]].concat(), value)
    };
    for (attribute, value, status) in [
        // Configuration control: the stored configuration and nothing else.
        (3, &[0, 0, 0, 0][..], 0),
        (3, &[2, 0, 0, 0], 0x09),
        (3, &[0, 0], 0x13),
        (5, interface, 0x0E),
        (6, b"\x01\x00x\x00", 0x0E),
        (8, &[2], 0x0E),
        (10, &[0], 0),
        (10, &[1], 0x09),
        (12, &[0], 0x14),
        // 3601 s.
        (13, &[0x11, 0x0E], 0x09),
        (13, &[10], 0x13),
        (13, &[10, 0, 0], 0x15),
    ] {
        assert_eq!(rig.ask(client, &set(attribute, value)).outcome(), (status, 0), "{attribute} {value:?}");
    }
    assert_eq!(rig.events(), []);
    assert_eq!(rig.get(client, TCP_IP, 13).data, [120, 0], "refused values change nothing");
    assert_eq!(rig.ask(client, &set(13, &[10, 0])).outcome(), (0, 0));
    assert_eq!(rig.events(), [Event::InactivityTimeoutChanged { seconds: 10 }]);
    rig.pass(DurationNs::from_secs(10));
    assert!(rig.adapter.is_done(client.slot), "the new value counts at once");
    let [lost] = rig.events()[..] else { panic!("one event") };
    assert_eq!(
        lost.to_string(),
        "session of 10.0.0.1:50000 timed out: nothing O->T for 10000000 us, expected within 10000000 us, late by \
         0 us"
    );
}

fn link_state() -> LinkState {
    LinkState {
        up: true,
        enabled: true,
        speed_mbit: 1000,
        full_duplex: true,
        counters: Some(InterfaceCounters {
            in_octets: 0x1_0000_0007,
            in_unicast: 2,
            in_multicast: 3,
            in_discards: 4,
            in_errors: 5,
            in_unknown_protocols: 6,
            out_octets: 7,
            out_unicast: 8,
            out_multicast: 9,
            out_discards: 10,
            out_errors: 11,
        }),
        media: Some(MediaCounters {
            alignment_errors: 1,
            fcs_errors: 2,
            single_collisions: 3,
            multiple_collisions: 4,
            sqe_test_errors: 5,
            deferred: 6,
            late_collisions: 7,
            excessive_collisions: 8,
            mac_transmit_errors: 9,
            carrier_sense_errors: 10,
            frames_too_long: 11,
            mac_receive_errors: 12,
        }),
    }
}

#[test]
fn ethernet_link_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    // What the host does not count is not there.
    assert_eq!(rig.get(client, LINK, 4).outcome(), (0x14, 0));
    assert_eq!(rig.get(client, LINK, 5).outcome(), (0x14, 0));
    rig.adapter.set_link(link_state());
    let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    // The counters of the host are wider and start over.
    let counters = words(&[7, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    let media = words(&[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    let attributes: [&[u8]; 11] = [
        &[0xE8, 3, 0, 0],
        &[0x0F, 0, 0, 0],
        &[2, 0, 0, 0, 0, 9],
        &counters,
        &media,
        &[1, 0, 0, 0],
        &[2],
        &[1],
        &[1],
        b"\x05north",
        &[2, 0, 0, 0, 0],
    ];
    for (number, value) in (1..).zip(attributes) {
        let answer = rig.get(client, LINK, number);
        assert_eq!((answer.status, answer.data.as_slice()), (0, value), "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, LINK, &[]));
    assert_eq!(all.data, attributes.concat());
    assert_eq!(rig.get(client, LINK, 12).outcome(), (0x14, 0));
    rig.adapter.set_link(LinkState::default());
    assert_eq!(rig.get(client, LINK, 1).data, [0; 4]);
    assert_eq!(rig.get(client, LINK, 2).data, [0x10, 0, 0, 0], "no link, nothing negotiated");
    assert_eq!((rig.get(client, LINK, 8).data, rig.get(client, LINK, 9).data), (vec![2], vec![2]));
}

#[test]
fn counters_of_the_port_are_cleared_for_the_network_alone() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let clear = |attribute: u8| message(GET_AND_CLEAR, &[LINK, &[0x30, attribute]].concat(), &[]);
    assert_eq!(rig.ask(client, &clear(4)).outcome(), (0x14, 0));
    rig.adapter.set_link(link_state());
    let before = rig.get(client, LINK, 4).data;
    assert_eq!(rig.ask(client, &clear(4)).data, before);
    assert_eq!(rig.get(client, LINK, 4).data, [0; 44]);
    assert_eq!(rig.get(client, LINK, 5).data[..4], [1, 0, 0, 0], "the others go on");
    let mut later = link_state();
    later.counters.as_mut().unwrap().in_octets += 3;
    rig.adapter.set_link(later);
    assert_eq!(rig.get(client, LINK, 4).data[..8], [3, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.ask(client, &clear(5)).data.len(), 48);
    assert_eq!(rig.get(client, LINK, 5).data, [0; 48]);
    assert_eq!(rig.ask(client, &clear(1)).outcome(), (0x08, 0));
    assert_eq!(rig.ask(client, &message(GET_AND_CLEAR, LINK, &[])).outcome(), (0x04, 0));
    let long = message(GET_AND_CLEAR, &[LINK, &[0x30, 4]].concat(), &[0]);
    assert_eq!(rig.ask(client, &long).outcome(), (0x15, 0));
}

#[test]
fn qos_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (number, value) in (1..).zip([0, 59, 47, 55, 47, 43, 31, 27]) {
        assert_eq!(rig.get(client, QOS, number).data, [value], "attribute {number}");
    }
    let set = |attribute: u8, value: &[u8]| {
        message(Service::SET_ATTRIBUTE_SINGLE, &[QOS, &[0x30, attribute]].concat(), value)
    };
    assert_eq!(rig.ask(client, &set(1, &[1])).outcome(), (0x0E, 0));
    assert_eq!(rig.ask(client, &set(9, &[1])).outcome(), (0x14, 0));
    assert_eq!(rig.ask(client, &set(4, &[64])).outcome(), (0x09, 0));
    assert_eq!(rig.events(), []);
    assert_eq!(rig.ask(client, &set(4, &[46])).outcome(), (0, 0));
    assert_eq!(rig.get(client, QOS, 4).data, [46]);
    let [Event::QosChanged(qos)] = rig.events()[..] else { panic!("one event") };
    assert_eq!(qos.urgent, 46);
    // It is stored and told, and used from the next start on.
    assert_eq!(rig.adapter.qos_in_use().urgent, 55);
    assert_eq!(rig.open_motion(client, 1).t_to_o_dscp, 55);
    rig.events();
    let list = message(Service::SET_ATTRIBUTE_LIST, QOS, &[3, 0, 5, 0, 40, 1, 0, 1, 6, 0, 41]);
    let answer = rig.ask(client, &list);
    assert_eq!(answer.outcome(), (0x0A, 0));
    assert_eq!(answer.data, [2, 0, 5, 0, 0, 0, 1, 0, 0x0E, 0], "ends at the first that cannot be written");
    assert_eq!((rig.adapter.config().qos.scheduled, rig.adapter.config().qos.high), (40, 43));
}
