//! What clients may ask while a controller owns the device.

use super::rig::*;
use crate::device::hosts::Hosts;
use crate::device::motion_link::{MotionReply, MotionRequest};
use crate::device::objects::ethernet_link::GET_AND_CLEAR;
use crate::device::objects::file::{CLASS_FILE, INITIATE_UPLOAD, INSTANCE_EDS, UPLOAD_TRANSFER};
use crate::device::objects::list::OBJECT_CLASSES;
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::status::{GeneralStatus, Service};

const REFUSED: (u8, u16) = (GeneralStatus::PRIVILEGE_VIOLATION.0, 0);
const TCP_IP: &[u8] = &[0x20, 0xF5, 0x24, 1, 0x30, 13];
const QOS: &[u8] = &[0x20, 0x48, 0x24, 1, 0x30, 4];
const LINK: &[u8] = &[0x20, 0xF6, 0x24, 1, 0x30, 4];
const TIME_SYNC: &[u8] = &[0x20, 0x43, 0x24, 1, 0x30, 1];

/// Requests that change something for everybody, with what nobody's device and the owner answer.
fn changes() -> Vec<(Vec<u8>, (u8, u16))> {
    let set = |path: &[u8], value: &[u8]| message(Service::SET_ATTRIBUTE_SINGLE, path, value);
    let list = |path: &[u8], data: &[u8]| message(Service::SET_ATTRIBUTE_LIST, &path[..4], data);
    vec![
        (set(TCP_IP, &[10, 0]), (0, 0)),
        (set(QOS, &[46]), (0, 0)),
        (set(TIME_SYNC, &[0]), (0, 0)),
        (list(TCP_IP, &[1, 0, 13, 0, 10, 0]), (0, 0)),
        (list(QOS, &[1, 0, 5, 0, 40]), (0, 0)),
        // The host of these tests counts nothing.
        (message(GET_AND_CLEAR, LINK, &[]), (0x14, 0)),
        (message(Service::SET_ATTRIBUTES_ALL, &TCP_IP[..4], &[]), (0x08, 0)),
        // Nobody knows what this would do.
        (message(Service(0x32), PATH_IDENTITY, &[]), (0x08, 0)),
    ]
}

#[test]
fn others_read_and_change_nothing_while_a_controller_owns_the_device() {
    let mut rig = Rig::new();
    let (owner, other) = (rig.client(1), rig.client(2));
    rig.send_unconnected(owner, &open_message(&motion_open(1)));
    let before = rig.adapter.config().qos;
    assert_eq!(rig.ask(other, &changes()[0].0).outcome(), REFUSED, "it counts from the request to open on");
    let open = rig.device_opens();
    rig.received(owner.slot);
    for (request, _) in changes() {
        assert_eq!(rig.ask(other, &request).outcome(), REFUSED, "{request:02x?}");
    }
    let reset = message(Service::RESET, PATH_IDENTITY, &[0]);
    assert_eq!(rig.ask(other, &reset).outcome(), REFUSED);
    assert_eq!(rig.ask(owner, &reset).outcome(), (0x10, 0), "not under the feet of its own axes");
    assert_eq!(
        (rig.adapter.config().interface.inactivity_timeout_s, rig.adapter.config().qos),
        (120, before)
    );
    for (path, attribute, value) in
        [(TCP_IP, 13, &[120, 0][..]), (QOS, 4, &[55]), (PATH_IDENTITY, 1, &[0x34, 0x12])]
    {
        assert_eq!(rig.get(other, &path[..4], attribute).data, value, "reading is free");
    }
    // Several services in one message are judged one by one.
    let both = [message(Service::GET_ATTRIBUTE_SINGLE, QOS, &[]), changes().swap_remove(1).0];
    let messages = both.each_ref().map(Vec::as_slice);
    let mut data = vec![0; crate::wire::multiple_service::buffer_len(&messages)];
    crate::wire::multiple_service::emit(&messages, &mut data).unwrap();
    let answer = rig.ask(other, &message(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, &data));
    let packet = crate::wire::multiple_service::MultipleService::parse(&answer.data).unwrap();
    let statuses: Vec<_> = packet.iter().map(|reply| reply[2]).collect();
    assert_eq!(statuses, [0, REFUSED.0]);

    for (request, outcome) in changes() {
        assert_eq!(rig.ask(owner, &request).outcome(), outcome, "{request:02x?}");
    }
    assert_eq!(rig.adapter.config().interface.inactivity_timeout_s, 10);
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    for (request, outcome) in changes() {
        assert_eq!(rig.ask(other, &request).outcome(), outcome, "nobody's device: {request:02x?}");
    }
}

#[test]
fn hosts_that_are_no_controllers_read_and_own_nothing_at_any_time() {
    let mut rig = Rig::new();
    let (controller, tool) = (rig.client(1), rig.client(2));
    let address = (*peer(1).ip()).into();
    rig.adapter.node.config.controllers = Hosts::of([address..=address]);
    for (request, _) in changes() {
        assert_eq!(rig.ask(tool, &request).outcome(), REFUSED, "{request:02x?}");
    }
    let axis = [0x20, 0x42, 0x24, 1, 0x30, 40];
    let forbidden = [
        message(Service::RESET, PATH_IDENTITY, &[0]),
        message(Service::SET_ATTRIBUTE_SINGLE, &axis, &[0]),
        // Group_Sync, and a service that nobody knows.
        message(Service(0x1C), &[0x20, 0x42, 0x24, 0], &[0; 20]),
        message(Service(0x4E), &axis[..4], &[0; 4]),
        message(Service(0x7B), &axis[..4], &[]),
        open_message(&motion_open(1)),
    ];
    for request in forbidden {
        assert_eq!(rig.ask(tool, &request).outcome(), REFUSED, "{request:02x?}");
    }
    assert_eq!(rig.adapter.poll_motion(), None, "nothing of it reaches the motion device");
    assert_eq!(rig.get(tool, PATH_IDENTITY, 1).data, [0x34, 0x12]);
    rig.open_explicit(tool, 2);
    rig.send_unconnected(tool, &message(Service::GET_ATTRIBUTE_SINGLE, &axis, &[]));
    assert!(matches!(rig.adapter.poll_motion(), Some(MotionRequest::Explicit(_))), "reading is free");

    rig.open_motion(controller, 3);
    for (request, outcome) in changes() {
        assert_eq!(rig.ask(controller, &request).outcome(), outcome, "{request:02x?}");
    }
}

#[test]
fn no_service_of_another_client_but_a_known_harmless_one_reaches_an_object() {
    let mut rig = Rig::new();
    let (owner, other) = (rig.client(1), rig.client(2));
    rig.open_motion(owner, 1);
    let mut free = Vec::new();
    for class in OBJECT_CLASSES.into_iter().filter(|class| class.instance.is_some()) {
        let [low, high] = class.class.to_le_bytes();
        assert_eq!(high, 0);
        let instance = class.instance.unwrap().to_le_bytes()[0];
        for service in 0..0x80 {
            if service == Service::MULTIPLE_SERVICE_PACKET.0 {
                continue;
            }
            let answer = rig.ask(other, &message(Service(service), &[0x20, low, 0x24, instance], &[]));
            if answer.outcome() != REFUSED && ![0x01, 0x03, 0x0E].contains(&service) {
                free.push((class.class, service));
            }
        }
    }
    assert_eq!(u16::from(INSTANCE_EDS.to_le_bytes()[0]), INSTANCE_EDS);
    let manager = [0x4E, 0x54, 0x56, 0x57, 0x5B].map(|service| (6, service));
    let file = [INITIATE_UPLOAD, UPLOAD_TRANSFER].map(|service| (CLASS_FILE, service.0));
    // The path of an unconnected request to be carried on is looked at first.
    let carried = free.iter().position(|one| *one == (6, Service::UNCONNECTED_SEND.0));
    carried.map(|at| free.remove(at));
    assert_eq!(free, [&manager[..], &file].concat());
}

#[test]
fn connection_ids_are_for_the_originator_of_the_connection_only() {
    let mut rig = Rig::new();
    let (owner, other) = (rig.client(1), rig.client(2));
    let open = rig.open_motion(owner, 1);
    rig.open_explicit(owner, 2);
    let get = |number: u8| message(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[number, 0]);
    let search = |serial: u8| {
        message(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[serial, 0, 1, 0, 0xFE, 0xCA, 0, 0])
    };
    for request in [get(0), search(1), get(1), search(2)] {
        let (whole, blank) = (rig.ask(owner, &request).data, rig.ask(other, &request).data);
        let mut expected = whole.clone();
        expected[16..24].fill(0);
        expected[36..44].fill(0);
        assert_eq!(blank, expected, "state, ports, triad and intervals are free");
        assert!(whole[16..20] != [0; 4] && whole[36..40] != [0; 4]);
    }
    // A Forward_Open that opens nothing and names the connection of the owner.
    let null = NetworkParameters { connection_type: ConnectionType::NULL, ..point_to_point(0) };
    let check = ForwardOpen { o_to_t: null, t_to_o: null, o_to_t_id: 7, t_to_o_id: 8, ..motion_open(1) };
    let path = explicit_open(2).path;
    let mut ids = |client, open: &ForwardOpen<'_>| {
        let answer = rig.ask(client, &open_message(open));
        assert_eq!(answer.outcome(), (0, 0));
        let reply = ForwardOpenReply::parse(&answer.data).unwrap();
        (reply.o_to_t_id, reply.t_to_o_id)
    };
    assert_eq!(ids(owner, &check), (open.o_to_t_id, open.t_to_o_id));
    assert_eq!(ids(other, &check), (7, 8));
    let explicit = ForwardOpen { triad: triad(2), path, ..check };
    assert_eq!(ids(owner, &explicit).1, 0x5500_0002);
    assert_eq!(ids(other, &explicit), (7, 8));
}
