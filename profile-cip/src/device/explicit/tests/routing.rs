//! Requests on their way: to the motion device, in packets of several, in Unconnected_Send.

use arrayvec::ArrayVec;
use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::explicit::adapter::{DEVICE_TIMEOUT, UNCONNECTED_REPLY_MAX};
use crate::device::motion_link::*;
use crate::wire::status::Service;

const AXIS_1: &[u8] = &[0x20, 0x42, 0x24, 1];
const GET_AXIS: &[u8] = &[0x0E, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, 0xB9, 1];
const GET_VENDOR: &[u8] = &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1];
const GET_NONE: &[u8] = &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 99];

fn packet_of(messages: &[&[u8]]) -> Vec<u8> {
    let mut data = vec![0; crate::wire::multiple_service::buffer_len(messages)];
    crate::wire::multiple_service::emit(messages, &mut data).unwrap();
    message(Service::MULTIPLE_SERVICE_PACKET, PATH_ROUTER, &data)
}

fn replies_of(answer: &Answered) -> Vec<Answered> {
    let packet = crate::wire::multiple_service::MultipleService::parse(&answer.data).unwrap();
    packet.iter().map(Answered::parse).collect()
}

#[test]
fn requests_to_the_motion_axis_object_are_handed_on_and_answered() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, GET_AXIS);
    assert_eq!(rig.received(client.slot), [], "nothing yet");
    let request = rig.device_answers(&[1, 2, 3, 4]);
    assert_eq!(
        (request.service, request.path),
        (0x0E, ObjectPath { class: 0x42, instance: 1, attribute: Some(441), ..ObjectPath::default() })
    );
    assert_eq!(request.data.len(), 0);
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!((answer.service, answer.status, answer.data), (0x0E, 0, vec![1, 2, 3, 4]));
    // Status words of the device travel back.
    rig.send_unconnected(client, &message(Service(0x4B), AXIS_1, &[1, 0, 9, 0]));
    let MotionRequest::Explicit(request) = rig.motion_request() else { panic!("explicit") };
    assert_eq!((request.service, request.data.as_slice()), (0x4B, &[1, 0, 9, 0][..]));
    let mut reply = ExplicitReply::status(request.token, 0x1F);
    reply.extended_status = ArrayVec::from_iter([0xAAAA, 2]);
    assert_eq!(rig.complete(&MotionReply::Explicit(reply)), Some(client.slot));
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!((answer.service, answer.status, answer.extended), (0x4B, 0x1F, vec![0xAAAA, 2]));
}

#[test]
fn sessions_do_not_wait_for_each_other_and_keep_their_order() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, GET_AXIS);
    rig.send_unconnected(a, GET_VENDOR);
    assert_eq!(rig.ask(b, GET_VENDOR).data, [0x34, 0x12]);
    assert_eq!(rig.received(a.slot), [], "the second request waits for the first");
    rig.device_answers(&[7]);
    let replies = rig.received(a.slot);
    assert_eq!(replies.len(), 2);
    assert!(replies[0].data.ends_with(&[0x8E, 0, 0, 0, 7]));
    assert!(replies[1].data.ends_with(&[0x8E, 0, 0, 0, 0x34, 0x12]));
}

#[test]
fn a_device_that_does_not_answer_is_given_up() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, GET_AXIS);
    let MotionRequest::Explicit(request) = rig.motion_request() else { panic!("explicit") };
    assert_eq!(rig.adapter.wake_at(), Some(rig.now + DEVICE_TIMEOUT));
    rig.pass(DEVICE_TIMEOUT - DurationNs(1));
    assert_eq!(rig.received(client.slot), []);
    rig.pass(DurationNs(1));
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x02, 0));
    assert_eq!(rig.adapter.counters().device_timeouts, 1);
    // Its late answer finds nobody and does no harm to the next request.
    rig.send_unconnected(client, GET_AXIS);
    let late = MotionReply::Explicit(ExplicitReply::status(request.token, 0));
    assert_eq!(rig.complete(&late), None);
    assert_eq!(rig.received(client.slot), []);
    assert_eq!(rig.adapter.counters().replies_orphaned, 1);
    rig.device_answers(&[9]);
    assert_eq!(rig.unconnected_reply(client).0.data, [9]);
}

#[test]
fn an_answer_of_the_wrong_kind_is_none() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, GET_AXIS);
    let token = rig.motion_request().token();
    assert_eq!(rig.complete(&MotionReply::Closed { token }), None);
    assert_eq!(rig.received(client.slot), []);
    rig.complete(&MotionReply::Explicit(ExplicitReply::status(token, 0)));
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
}

#[test]
fn service_data_beyond_an_unconnected_message_is_refused() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let data = [0x5A; EXPLICIT_DATA_MAX + 1];
    assert_eq!(rig.ask(client, &message(Service(0x4C), AXIS_1, &data)).outcome(), (0x15, 0));
    rig.send_unconnected(client, &message(Service(0x4C), AXIS_1, &data[1..]));
    let request = rig.device_answers(&data[1..]);
    assert_eq!(request.data.as_slice(), &data[1..]);
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!((answer.status, answer.data.len()), (0, EXPLICIT_DATA_MAX), "the longest answer passes");
    assert_eq!(UNCONNECTED_REPLY_MAX, EXPLICIT_DATA_MAX + 4);
}

#[test]
fn a_session_that_ends_takes_its_request_along() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, GET_AXIS);
    let token = rig.motion_request().token();
    rig.adapter.close(client.slot);
    let next = rig.client(1);
    assert_eq!(rig.complete(&MotionReply::Explicit(ExplicitReply::status(token, 0))), None);
    assert_eq!(rig.received(next.slot), []);
}

#[test]
fn several_services_in_one_message() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let answer = rig.ask(client, &packet_of(&[GET_VENDOR, GET_VENDOR]));
    assert_eq!((answer.service, answer.outcome()), (0x0A, (0, 0)));
    assert_eq!(answer.data, [2, 0, 6, 0, 12, 0, 0x8E, 0, 0, 0, 0x34, 0x12, 0x8E, 0, 0, 0, 0x34, 0x12]);
    // One that fails does not stop the others, and the packet says so.
    let answer = rig.ask(client, &packet_of(&[GET_NONE, GET_VENDOR]));
    assert_eq!(answer.outcome(), (0x1E, 0));
    assert_eq!(replies_of(&answer)[0].outcome(), (0x14, 0));
    assert_eq!(replies_of(&answer)[1].data, [0x34, 0x12]);
    assert_eq!(rig.ask(client, &packet_of(&[])).data, [0, 0]);
    // A packet inside a packet is not a service the router has.
    let inner = packet_of(&[GET_VENDOR]);
    let answer = rig.ask(client, &packet_of(&[&inner]));
    assert_eq!(replies_of(&answer)[0].outcome(), (0x08, 0));
}

#[test]
fn services_for_the_motion_device_keep_their_place_in_the_packet() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &packet_of(&[GET_AXIS, GET_VENDOR, GET_AXIS, GET_NONE]));
    rig.device_answers(&[1]);
    assert_eq!(rig.received(client.slot), []);
    rig.device_answers(&[2]);
    let (answer, _) = rig.unconnected_reply(client);
    let data: Vec<_> = replies_of(&answer).into_iter().map(|reply| (reply.status, reply.data)).collect();
    assert_eq!(data, [(0, vec![1]), (0, vec![0x34, 0x12]), (0, vec![2]), (0x14, vec![])]);
    // One given up counts as failed; the rest goes on.
    rig.send_unconnected(client, &packet_of(&[GET_AXIS, GET_VENDOR]));
    rig.motion_request();
    rig.pass(DEVICE_TIMEOUT);
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!(answer.outcome(), (0x1E, 0));
    assert_eq!(replies_of(&answer)[0].outcome(), (0x02, 0));
    assert_eq!(replies_of(&answer)[1].status, 0);
}

#[test]
fn unconnected_send_ends_here_or_nowhere() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let send = |inner: &[u8], route: &[u8]| {
        let length = u8::try_from(inner.len()).unwrap();
        let pad = vec![0; inner.len() % 2];
        let words = u8::try_from(route.len() / 2).unwrap();
        message(
            Service::UNCONNECTED_SEND,
            PATH_MANAGER,
            &[&[5, 157, length, 0], inner, &pad, &[words, 0], route].concat(),
        )
    };
    let answer = rig.ask(client, &send(GET_VENDOR, &[]));
    assert_eq!((answer.service, answer.data), (0x0E, vec![0x34, 0x12]), "the embedded reply, unwrapped");
    let answer = rig.ask(client, &send(GET_VENDOR, &[1, 0]));
    assert_eq!((answer.service, answer.outcome(), answer.data), (0x52, (1, 0x311), vec![1]));
    // Odd length, motion device, packet inside.
    let set = message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 0x48, 0x24, 1, 0x30, 4], &[46]);
    assert_eq!(set.len() % 2, 1);
    assert_eq!(rig.ask(client, &send(&set, &[])).outcome(), (0, 0));
    rig.send_unconnected(client, &send(GET_AXIS, &[]));
    rig.device_answers(&[5]);
    assert_eq!(rig.unconnected_reply(client).0.data, [5]);
    assert_eq!(replies_of(&rig.ask(client, &send(&packet_of(&[GET_VENDOR]), &[]))).len(), 1);
    // It does not nest, and its lengths must add up.
    let nested = send(&send(GET_VENDOR, &[]), &[]);
    assert_eq!(rig.ask(client, &nested).outcome(), (0x08, 0));
    let whole = send(GET_VENDOR, &[]);
    for cut in 6..whole.len() {
        assert_eq!(rig.ask(client, &whole[..cut]).outcome(), (0x13, 0), "cut at {cut}");
    }
}
