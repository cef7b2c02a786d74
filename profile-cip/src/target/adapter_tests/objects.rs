//! The objects every CIP node has, attribute by attribute.

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::target::event::{Event, ResetKind};
use crate::target::identity::Health;
use crate::wire::status::Service;

const TCP_IP: &[u8] = &[0x20, 0xF5, 0x24, 1];
const LINK: &[u8] = &[0x20, 0xF6, 0x24, 1];
const QOS: &[u8] = &[0x20, 0x48, 0x24, 1];

#[test]
fn identity_attributes() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let attributes: [&[u8]; 8] = [
        &[0x34, 0x12],
        &[0x25, 0],
        &[7, 0],
        &[2, 3],
        &[0x30, 0],
        &[0xEF, 0xBE, 0xAD, 0xDE],
        b"\x0AAxisbridge",
        &[3],
    ];
    for (number, value) in (1..).zip(attributes) {
        let answer = rig.get(client, PATH_IDENTITY, number);
        assert_eq!((answer.status, answer.data.as_slice()), (0, value), "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    assert_eq!((all.service, all.status, all.data), (1, 0, attributes.concat()));
    let class_all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, &[0x20, 1], &[]));
    assert_eq!((class_all.status, class_all.data), (0, vec![1, 0, 1, 0, 7, 0, 8, 0]));
    assert_eq!(rig.get(client, PATH_IDENTITY, 9).outcome(), (0x14, 0));
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
    rig.open_motion(client, 1);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 0]);
    rig.adapter.set_health(Health::MinorRecoverableFault);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 1]);
    rig.adapter.set_health(Health::MajorRecoverableFault);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x51, 4]);
    assert_eq!(rig.get(client, PATH_IDENTITY, 8).data, [4]);
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
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (data, outcome) in [(&[][..], 0), (&[0], 0), (&[1], 0), (&[2], 0x20), (&[0, 0], 0x15)] {
        let answer = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, data));
        assert_eq!(answer.outcome(), (outcome, 0), "{data:?}");
    }
    let originator = peer(1);
    assert_eq!(
        rig.events(),
        [
            Event::Reset { kind: ResetKind::PowerCycle, originator },
            Event::Reset { kind: ResetKind::PowerCycle, originator },
            Event::Reset { kind: ResetKind::FactoryDefaults, originator },
        ]
    );
    rig.open_motion(client, 1);
    rig.events();
    let answer = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, &[0]));
    assert_eq!(answer.outcome(), (0x10, 0), "not while a controller owns the axes");
    assert_eq!(rig.events(), []);
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
    assert_eq!(all.data, [3, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 0]);
}

#[test]
fn tcp_ip_interface_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let interface: &[u8] = &[
        9, 0, 0, 10, 0, 255, 255, 255, 1, 0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, b'p', b'l', b'a', b'n',
        b't', 0,
    ];
    let attributes: [&[u8]; 6] =
        [&[1, 0, 0, 0], &[0; 4], &[0; 4], &[2, 0, 0x20, 0xF6, 0x24, 1], interface, b"\x06\x00axis-1"];
    for (number, value) in (1..).zip(attributes) {
        assert_eq!(rig.get(client, TCP_IP, number).data, value, "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, TCP_IP, &[]));
    assert_eq!(all.data, attributes.concat());
    assert_eq!(rig.get(client, TCP_IP, 13).data, [120, 0]);
    let path = [TCP_IP, &[0x30, 13]].concat();
    let set = |value: &[u8]| message(Service::SET_ATTRIBUTE_SINGLE, &path, value);
    assert_eq!(rig.ask(client, &set(&[0x11, 0x0E])).outcome(), (0x09, 0), "3601 s");
    assert_eq!(rig.ask(client, &set(&[10])).outcome(), (0x13, 0));
    assert_eq!(rig.ask(client, &set(&[10, 0, 0])).outcome(), (0x15, 0));
    assert_eq!(rig.get(client, TCP_IP, 13).data, [120, 0], "refused values change nothing");
    assert_eq!(rig.ask(client, &set(&[10, 0])).outcome(), (0, 0));
    assert_eq!(rig.events(), [Event::InactivityTimeoutChanged { seconds: 10 }]);
    rig.pass(DurationNs::from_secs(10));
    assert!(rig.adapter.is_done(client.slot), "the new value counts at once");
}

#[test]
fn ethernet_link_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    assert_eq!(rig.get(client, LINK, 1).data, [100, 0, 0, 0]);
    assert_eq!(rig.get(client, LINK, 2).data, [0x0F, 0, 0, 0]);
    assert_eq!(rig.get(client, LINK, 3).data, [2, 0, 0, 0, 0, 9]);
    assert_eq!(rig.get(client, LINK, 10).data, b"\x05north");
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, LINK, &[]));
    assert_eq!(all.data, [100, 0, 0, 0, 0x0F, 0, 0, 0, 2, 0, 0, 0, 0, 9]);
    rig.adapter.set_link(0, false);
    assert_eq!(rig.get(client, LINK, 1).data, [0; 4]);
    assert_eq!(rig.get(client, LINK, 2).data, [0x10, 0, 0, 0]);
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
    let list = message(Service::SET_ATTRIBUTE_LIST, QOS, &[3, 0, 5, 0, 40, 1, 0, 1, 6, 0, 41]);
    let answer = rig.ask(client, &list);
    assert_eq!(answer.outcome(), (0x0A, 0));
    assert_eq!(answer.data, [2, 0, 5, 0, 0, 0, 1, 0, 0x0E, 0], "ends at the first that cannot be written");
    assert_eq!((rig.adapter.config().qos.scheduled, rig.adapter.config().qos.high), (40, 43));
}
