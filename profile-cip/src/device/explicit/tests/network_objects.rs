//! The objects of the Ethernet port: TCP/IP Interface, Ethernet Link, QoS.

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::event::Event;
use crate::device::objects::ethernet_link::{GET_AND_CLEAR, InterfaceCounters, LinkState, MediaCounters};
use crate::wire::status::Service;

const TCP_IP: &[u8] = &[0x20, 0xF5, 0x24, 1];
const LINK: &[u8] = &[0x20, 0xF6, 0x24, 1];
const QOS: &[u8] = &[0x20, 0x48, 0x24, 1];

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
