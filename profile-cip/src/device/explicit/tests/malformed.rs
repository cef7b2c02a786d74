//! Every service the device knows, malformed in each way its structure allows: the exact general and extended status of
//! every one. Whole requests are in the tests of their objects.

use std::sync::Arc;

use super::rig::*;
use crate::device::event::Event;
use crate::device::objects::ethernet_link::GET_AND_CLEAR;
use crate::device::objects::file::{INITIATE_UPLOAD, UPLOAD_TRANSFER};
use crate::wire::encapsulation::{Command, EncapsulationStatus};
use crate::wire::status::Service;

const AXIS_1: &[u8] = &[0x20, 0x42, 0x24, 1];
const FILE: &[u8] = &[0x20, 0x37, 0x24, 0xC8];
const QOS: &[u8] = &[0x20, 0x48, 0x24, 1];
const TCP_IP: &[u8] = &[0x20, 0xF5, 0x24, 1];
const LINK: &[u8] = &[0x20, 0xF6, 0x24, 1];

/// What is wrong, the whole message, and what it is answered with.
type Case<'a> = (&'a str, Vec<u8>, (u8, u16));

fn attribute(object: &[u8], number: u8) -> Vec<u8> {
    [object, &[0x30, number]].concat()
}

/// A request in one call: service, path, data.
fn m(service: Service, path: &[u8], data: &[u8]) -> Vec<u8> {
    message(service, path, data)
}

/// Sends all of them to a device with a file, one motion and one explicit connection, and looks at every answer. None of
/// them reaches the motion device, none leaves an event of something that has happened, and the device goes on.
fn check(cases: &[Case<'_>]) {
    let mut rig = Rig::with(|config| config.eds = Arc::from(&b"[File]"[..]));
    let client = rig.client(1);
    rig.open_motion(client, 1);
    rig.open_explicit(client, 2);
    rig.events();
    for (what, message, outcome) in cases {
        let answer = rig.ask(client, message);
        assert_eq!(answer.outcome(), *outcome, "{what}: {message:02x?}");
        assert_eq!(answer.service, message.first().map_or(0, |service| service & 0x7F), "{what}");
        assert_eq!(rig.adapter.poll_motion(), None, "{what}");
        let events = rig.events();
        assert!(events.iter().all(|event| matches!(event, Event::OpenRefused { .. })), "{what}: {events:?}");
    }
    assert_eq!((rig.adapter.explicit_connections(), rig.adapter.motion_connection().is_some()), (1, true));
    assert_eq!(rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12]);
}

#[test]
fn messages_and_paths() {
    check(&[
        ("nothing", vec![], (0x13, 0)),
        ("a service alone", vec![0x0E], (0x13, 0)),
        ("the reply bit", vec![0x8E, 2, 0x20, 1, 0x24, 1], (0x08, 0)),
        ("a path longer than the message", vec![0x0E, 3, 0x20, 1, 0x24, 1], (0x26, 0)),
        ("the longest path in nothing", vec![0x0E, 255], (0x26, 0)),
        ("no path", m(Service::GET_ATTRIBUTES_ALL, &[], &[]), (0x04, 0)),
        ("half a class segment", vec![0x01, 1, 0x21, 0], (0x04, 0)),
        (
            "a class of 32 bits beyond 16",
            m(Service::GET_ATTRIBUTES_ALL, &[0x22, 0, 1, 0, 1, 0], &[]),
            (0x04, 0),
        ),
        ("the instance first and no class", m(Service::GET_ATTRIBUTES_ALL, &[0x24, 1], &[]), (0x04, 0)),
        ("a reserved logical type", m(Service::GET_ATTRIBUTES_ALL, &[0x20, 1, 0x3C, 1], &[]), (0x04, 0)),
        ("a reserved segment type", m(Service::GET_ATTRIBUTES_ALL, &[0x20, 1, 0xE0, 1], &[]), (0x04, 0)),
        (
            "a key of another format",
            m(Service::GET_ATTRIBUTES_ALL, &[0x34, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0x20, 1], &[]),
            (0x04, 0),
        ),
        ("a key cut short", m(Service::GET_ATTRIBUTES_ALL, &[0x34, 4, 0, 0], &[]), (0x04, 0)),
        (
            "a key of another device",
            m(Service::GET_ATTRIBUTES_ALL, &[0x34, 4, 0, 0, 9, 0, 0, 0, 0, 0, 0x20, 1, 0x24, 1], &[]),
            (0x25, 0),
        ),
        (
            "a symbol longer than the path",
            m(Service::GET_ATTRIBUTES_ALL, &[0x91, 9, b'a', b'b'], &[]),
            (0x04, 0),
        ),
        ("a class nobody has", m(Service::GET_ATTRIBUTES_ALL, &[0x20, 0x99, 0x24, 1], &[]), (0x05, 0)),
        ("an instance nobody has", m(Service::GET_ATTRIBUTES_ALL, &[0x20, 1, 0x24, 2], &[]), (0x05, 0)),
        (
            "a member of what has none",
            m(Service::GET_ATTRIBUTE_SINGLE, &[0x20, 1, 0x24, 1, 0x30, 4, 0x28, 1], &[]),
            (0x04, 0),
        ),
        ("service 0", m(Service(0), PATH_IDENTITY, &[]), (0x08, 0)),
        ("service 0x7F", m(Service(0x7F), PATH_IDENTITY, &[]), (0x08, 0)),
    ]);
}

#[test]
fn attribute_services_of_every_object() {
    for object in [PATH_IDENTITY, PATH_ROUTER, PATH_MANAGER, FILE, QOS, TCP_IP, LINK] {
        let known = attribute(object, 2);
        check(&[
            ("get without an attribute", m(Service::GET_ATTRIBUTE_SINGLE, object, &[]), (0x04, 0)),
            (
                "get of an attribute nobody has",
                m(Service::GET_ATTRIBUTE_SINGLE, &attribute(object, 200), &[]),
                (0x14, 0),
            ),
            ("get with data", m(Service::GET_ATTRIBUTE_SINGLE, &known, &[0]), (0x15, 0)),
            (
                "get of a class attribute nobody has",
                m(Service::GET_ATTRIBUTE_SINGLE, &[object[0], object[1], 0x24, 0, 0x30, 5], &[]),
                (0x14, 0),
            ),
            ("list without a count", m(Service::GET_ATTRIBUTE_LIST, object, &[]), (0x13, 0)),
            ("list with half a count", m(Service::GET_ATTRIBUTE_LIST, object, &[1]), (0x13, 0)),
            ("list shorter than its count", m(Service::GET_ATTRIBUTE_LIST, object, &[2, 0, 1, 0]), (0x13, 0)),
            (
                "list longer than its count",
                m(Service::GET_ATTRIBUTE_LIST, object, &[1, 0, 2, 0, 3, 0]),
                (0x15, 0),
            ),
            (
                "list of the largest count",
                m(Service::GET_ATTRIBUTE_LIST, object, &[0xFF, 0xFF, 1, 0]),
                (0x13, 0),
            ),
            ("list of one nobody has", m(Service::GET_ATTRIBUTE_LIST, object, &[1, 0, 200, 0]), (0x0A, 0)),
            ("set without an attribute", m(Service::SET_ATTRIBUTE_SINGLE, object, &[1]), (0x04, 0)),
            (
                "set of an attribute nobody has",
                m(Service::SET_ATTRIBUTE_SINGLE, &attribute(object, 200), &[1]),
                (0x14, 0),
            ),
            (
                "set of a class attribute",
                m(Service::SET_ATTRIBUTE_SINGLE, &[object[0], object[1], 0x24, 0, 0x30, 1], &[1, 0]),
                (0x0E, 0),
            ),
            ("set list without a count", m(Service::SET_ATTRIBUTE_LIST, object, &[]), (0x13, 0)),
            ("set list shorter than its count", m(Service::SET_ATTRIBUTE_LIST, object, &[1, 0]), (0x13, 0)),
            (
                "set list of one nobody has",
                m(Service::SET_ATTRIBUTE_LIST, object, &[1, 0, 200, 0, 1]),
                (0x0A, 0),
            ),
            ("set list of none with data", m(Service::SET_ATTRIBUTE_LIST, object, &[0, 0, 1]), (0x15, 0)),
            ("set all", m(Service::SET_ATTRIBUTES_ALL, object, &[1]), (0x08, 0)),
            ("reset of what has none", m(Service(0x06), object, &[]), (0x08, 0)),
        ]);
    }
    for object in [PATH_IDENTITY, PATH_ROUTER, PATH_MANAGER, TCP_IP, LINK] {
        check(&[("all with data", m(Service::GET_ATTRIBUTES_ALL, object, &[0]), (0x15, 0))]);
    }
    for object in [PATH_ROUTER, PATH_MANAGER, FILE, QOS, TCP_IP, LINK] {
        check(&[("reset", m(Service::RESET, object, &[0]), (0x08, 0))]);
    }
    for (object, number, size) in [(QOS, 2, 1), (QOS, 8, 1), (TCP_IP, 3, 4), (TCP_IP, 10, 1), (TCP_IP, 13, 2)]
    {
        let path = attribute(object, number);
        check(&[
            ("set of nothing", m(Service::SET_ATTRIBUTE_SINGLE, &path, &[]), (0x13, 0)),
            ("set of too little", m(Service::SET_ATTRIBUTE_SINGLE, &path, &vec![0; size - 1]), (0x13, 0)),
            ("set of too much", m(Service::SET_ATTRIBUTE_SINGLE, &path, &vec![0; size + 1]), (0x15, 0)),
            ("set out of range", m(Service::SET_ATTRIBUTE_SINGLE, &path, &vec![0xFF; size]), (0x09, 0)),
            (
                "set list with too little",
                m(
                    Service::SET_ATTRIBUTE_LIST,
                    object,
                    &[&[1, 0, number, 0][..], &vec![0; size - 1]].concat(),
                ),
                (0x0A, 0),
            ),
        ]);
    }
}

#[test]
fn services_of_single_objects() {
    check(&[
        ("reset of no kind", m(Service::RESET, PATH_IDENTITY, &[2]), (0x20, 0)),
        ("reset with too much", m(Service::RESET, PATH_IDENTITY, &[0, 0]), (0x15, 0)),
        ("reset of the class", m(Service::RESET, &[0x20, 1, 0x24, 0], &[0]), (0x08, 0)),
        ("reset while owned", m(Service::RESET, PATH_IDENTITY, &[0]), (0x10, 0)),
        ("clear of nothing named", m(GET_AND_CLEAR, LINK, &[]), (0x04, 0)),
        ("clear of no counter", m(GET_AND_CLEAR, &attribute(LINK, 3), &[]), (0x08, 0)),
        ("clear of counters the host has not", m(GET_AND_CLEAR, &attribute(LINK, 4), &[]), (0x14, 0)),
        ("clear with data", m(GET_AND_CLEAR, &attribute(LINK, 4), &[0]), (0x15, 0)),
        ("upload of nothing", m(INITIATE_UPLOAD, FILE, &[]), (0x13, 0)),
        ("upload by nothing", m(INITIATE_UPLOAD, FILE, &[0]), (0x20, 8)),
        ("upload with too much", m(INITIATE_UPLOAD, FILE, &[1, 1]), (0x15, 0)),
        ("transfer without a number", m(UPLOAD_TRANSFER, FILE, &[]), (0x13, 0)),
        ("transfer with too much", m(UPLOAD_TRANSFER, FILE, &[0, 0]), (0x15, 0)),
        ("transfer that was not begun", m(UPLOAD_TRANSFER, FILE, &[0]), (0x0C, 2)),
        ("download", m(Service(0x4C), FILE, &[0; 10]), (0x08, 0)),
        ("an explicit service longer than a message", m(Service(0x4B), AXIS_1, &[0; 505]), (0x15, 0)),
    ]);
}

#[test]
fn connection_manager_services() {
    let open = open_message(&motion_open(9));
    let large = open_message(&crate::wire::forward_open::ForwardOpen { large: true, ..explicit_open(9) });
    let close = close_message(1);
    // Service, path length, path of the manager.
    let body = 2 + PATH_MANAGER.len();
    let changed = |message: &[u8], at: usize, to: u8| {
        let mut message = message.to_vec();
        message[body + at] = to;
        message
    };
    let cut = |message: &[u8], by: usize| message[..message.len() - by].to_vec();
    check(&[
        ("open of nothing", m(Service::FORWARD_OPEN, PATH_MANAGER, &[]), (0x13, 0)),
        ("open without its last byte", cut(&open, 1), (0x13, 0)),
        ("open with a byte too many", [&open[..], &[0]].concat(), (0x15, 0)),
        ("open with a path longer than it says", changed(&open, 35, 7), (0x15, 0)),
        ("open with a path shorter than it says", changed(&open, 35, 9), (0x13, 0)),
        (
            "a small open by the large service",
            changed(&open, 0, 5)
                .into_iter()
                .enumerate()
                .map(|(at, byte)| if at == 0 { 0x5B } else { byte })
                .collect(),
            (0x13, 0),
        ),
        (
            "a large open by the small service",
            large.iter().enumerate().map(|(at, byte)| if at == 0 { 0x54 } else { *byte }).collect(),
            (0x15, 0),
        ),
        ("a large open cut", cut(&large, 1), (0x13, 0)),
        ("an open of the class", m(Service::FORWARD_OPEN, &[0x20, 6, 0x24, 0], &open[body..]), (0x08, 0)),
        (
            "an open of another instance",
            m(Service::FORWARD_OPEN, &[0x20, 6, 0x24, 2], &open[body..]),
            (0x05, 0),
        ),
        ("a connection type that does not exist", changed(&open, 27, 0x6E), (1, 0x123)),
        ("a transport class that does not exist", changed(&open, 34, 0x0F), (1, 0x11C)),
        ("a multiplier that does not exist", changed(&open, 18, 8), (1, 0x133)),
        ("close of nothing", m(Service::FORWARD_CLOSE, PATH_MANAGER, &[]), (0x13, 0)),
        ("close without its last byte", cut(&close, 1), (0x13, 0)),
        ("close with a byte too many", [&close[..], &[0]].concat(), (0x15, 0)),
        ("close with a path longer than it says", changed(&close, 10, 7), (0x15, 0)),
        ("close with a path shorter than it says", changed(&close, 10, 255), (0x13, 0)),
        ("close with a segment that does not exist", changed(&close, 12, 0xE0), (1, 0x316)),
        ("close of nobody's connection", close_message(77), (1, 0x107)),
        ("data of nothing", m(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[]), (0x13, 0)),
        ("data of half a number", m(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[0]), (0x13, 0)),
        ("data of a number and more", m(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[0, 0, 0]), (0x15, 0)),
        ("data of nobody's number", m(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[33, 0]), (0x05, 0)),
        ("search for nothing", m(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[]), (0x13, 0)),
        (
            "search for half a triad",
            m(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[1, 0, 1, 0, 0xFE]),
            (0x13, 0),
        ),
        (
            "search for a triad and more",
            m(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[1, 0, 1, 0, 0xFE, 0xCA, 0, 0, 0]),
            (0x15, 0),
        ),
        (
            "search for nobody's triad",
            m(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[9, 9, 1, 0, 0xFE, 0xCA, 0, 0]),
            (0x05, 0),
        ),
        ("owner of a connection", m(Service(0x5A), PATH_MANAGER, &[]), (0x08, 0)),
    ]);
}

#[test]
fn messages_inside_messages() {
    let get: &[u8] = &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1];
    let send = |length: u16, inner: &[u8], rest: &[u8]| {
        m(
            Service::UNCONNECTED_SEND,
            PATH_MANAGER,
            &[&[5, 157][..], &length.to_le_bytes(), inner, rest].concat(),
        )
    };
    let packet = |data: &[u8]| m(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, data);
    let many = [&[0xE8, 3][..], &2002u16.to_le_bytes().repeat(1000)].concat();
    check(&[
        ("send of nothing", m(Service::UNCONNECTED_SEND, PATH_MANAGER, &[]), (0x13, 0)),
        ("send without a route", send(8, get, &[]), (0x13, 0)),
        ("send with half a route length", send(8, get, &[0]), (0x13, 0)),
        ("send with a length too long", send(9, get, &[0, 0]), (0x13, 0)),
        ("send with the longest length", send(0xFFFF, get, &[0, 0]), (0x13, 0)),
        ("send with a length too short", send(6, get, &[0, 0]), (0x13, 0)),
        ("send with an odd length and no pad", send(7, &get[..7], &[0]), (0x13, 0)),
        ("send with a route longer than it says", send(8, get, &[0, 0, 1, 0]), (0x15, 0)),
        ("send with a route shorter than it says", send(8, get, &[2, 0, 1, 0]), (0x13, 0)),
        ("send to another device", send(8, get, &[1, 0, 1, 5]), (1, 0x311)),
        ("packet of nothing", packet(&[]), (0x13, 0)),
        ("packet with half a count", packet(&[1]), (0x13, 0)),
        ("packet without offsets", packet(&[1, 0]), (0x13, 0)),
        ("packet of the largest count", packet(&[0xFF, 0xFF, 0, 0]), (0x13, 0)),
        ("packet with an offset into its list", packet(&[1, 0, 2, 0, 1, 2]), (0x20, 0)),
        ("packet with an offset past its end", packet(&[1, 0, 7, 0, 1, 2]), (0x20, 0)),
        ("packet with offsets that go back", packet(&[2, 0, 8, 0, 6, 0, 1, 2, 3, 4]), (0x20, 0)),
        ("packet of another object", m(Service::MULTIPLE_SERVICE_PACKET, PATH_IDENTITY, &[0, 0]), (0x08, 0)),
        ("packet of the class", m(Service::MULTIPLE_SERVICE_PACKET, &[0x20, 2, 0x24, 0], &[0, 0]), (0x08, 0)),
        ("a thousand services of no bytes", packet(&many), (0x11, 0)),
        ("a service of no bytes", packet(&[1, 0, 4, 0]), (0x1E, 0)),
    ]);
}

#[test]
fn encapsulation_commands() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let get = unconnected(&m(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    let malformed = EncapsulationStatus::INCORRECT_DATA;
    let length = EncapsulationStatus::INVALID_LENGTH;
    let unknown = EncapsulationStatus::INVALID_COMMAND;
    for (what, command, data, status) in [
        ("register of nothing", Command::REGISTER_SESSION, vec![], length),
        ("register of three bytes", Command::REGISTER_SESSION, vec![1, 0, 0], length),
        ("register of five bytes", Command::REGISTER_SESSION, vec![1, 0, 0, 0, 0], length),
        ("register again", Command::REGISTER_SESSION, vec![1, 0, 0, 0], unknown),
        ("list with data", Command::LIST_IDENTITY, vec![0], length),
        ("services with data", Command::LIST_SERVICES, vec![0; 4], length),
        ("interfaces with data", Command::LIST_INTERFACES, vec![0; 100], length),
        ("send of nothing", Command::SEND_RR_DATA, vec![], malformed),
        ("send without items", Command::SEND_RR_DATA, vec![0; 6], malformed),
        ("send of no items", Command::SEND_RR_DATA, vec![0; 8], malformed),
        ("send cut", Command::SEND_RR_DATA, get[..get.len() - 1].to_vec(), malformed),
        ("send with a byte too many", Command::SEND_RR_DATA, [&get[..], &[0]].concat(), malformed),
        ("unconnected items in a connected command", Command::SEND_UNIT_DATA, get.clone(), malformed),
        ("unit of nothing", Command::SEND_UNIT_DATA, vec![], malformed),
        ("command 2", Command(2), vec![], unknown),
        ("command 0xFFFF", Command(0xFFFF), vec![1, 2, 3], unknown),
    ] {
        let reply = rig.exchange(client.slot, &packet(command, client.handle, &data));
        assert_eq!((reply.header.status, reply.data.len()), (status, 0), "{what}");
        assert_eq!(rig.get(client, PATH_IDENTITY, 1).data, [0x34, 0x12], "{what}");
    }
}
