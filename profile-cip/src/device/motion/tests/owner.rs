//! Who may change the axis object by explicit message while a connection is open, and while none is.

use super::services::{explicit, reply_of};
use super::*;
use crate::device::motion_link::{ExplicitReply, ExplicitRequest};
use crate::wire::Writer;
use crate::wire::motion::codes::FeedbackMode;
use crate::wire::motion::test_service::RunHookupTest;
use crate::wire::status::GeneralStatus;

const REFUSED: u8 = GeneralStatus::PRIVILEGE_VIOLATION.0;

/// The same request from another address.
fn foreign(request: MotionRequest) -> MotionRequest {
    match request {
        MotionRequest::Explicit(request) => {
            MotionRequest::Explicit(ExplicitRequest { originator: Ipv4Addr::new(10, 0, 0, 9), ..request })
        }
        other => other,
    }
}

fn hookup_test() -> Vec<u8> {
    let mut body = [0; 12];
    let request = RunHookupTest { test_type: 0, feedback_channel: 0, distance: 1.0, time: 0.0 };
    request.emit(&mut Writer::new(&mut body)).expect("room");
    body.to_vec()
}

/// Service, instance, attribute, data, and the status that the owner gets for it.
type Row = (u8, u32, Option<u16>, Vec<u8>, u8);

/// What changes something.
fn changes() -> Vec<Row> {
    vec![
        (0x04, 1, None, vec![1, 0, 0x62, 2, 3], 0),
        (0x10, 1, Some(610), vec![4], 0),
        (0x10, 0, Some(21), vec![9], 0),
        (0x4C, 1, None, vec![1, 0, 0, 0, 0x62, 2, 0, 1, 2, 0, 0, 0], 0),
        (0x4D, 1, None, vec![1, 0, 0, 0, 0xCD, 1, 0, 0], 0),
        (0x4E, 1, None, vec![1, 0, 0, 0, 0x8A, 2, 0, 0], 0),
        (0x1C, 0, None, GRANDMASTER.to_vec(), 0),
        (0x4F, 1, None, vec![0; 4], 0x08),
        (0x51, 1, None, vec![0; 4], 0x08),
        (0x53, 1, None, hookup_test(), 0),
        // Nobody knows what this would do.
        (0x7A, 1, None, vec![], 0x08),
    ]
}

/// What only reads; anybody gets the status.
fn reads() -> Vec<Row> {
    vec![
        (0x01, 1, None, vec![], 0x08),
        (0x03, 1, None, vec![1, 0, 0x8A, 2], 0),
        (0x0E, 1, Some(610), vec![], 0),
        (0x0E, 0, Some(14), vec![], 0),
        (0x4B, 1, None, vec![1, 0, 0, 0, 0x8A, 2, 0, 1], 0),
        (0x50, 1, None, vec![], 0x08),
        (0x52, 1, None, vec![], 0x08),
        // There was no test.
        (0x54, 1, None, vec![], GeneralStatus::OBJECT_STATE_CONFLICT.0),
    ]
}

impl Rig {
    fn ask_as(&mut self, who: fn(MotionRequest) -> MotionRequest, row: &Row) -> u8 {
        let (service, instance, attribute, data, _) = row;
        reply_of(self.request(who(explicit(1, *service, *instance, *attribute, data)))).1
    }

    fn attributes_now(&mut self) -> (Vec<u8>, Vec<u8>) {
        let stopping = reply_of(self.request(explicit(90, 0x0E, 1, Some(610), &[]))).2;
        let limit = reply_of(self.request(explicit(91, 0x0E, 0, Some(21), &[]))).2;
        (stopping, limit)
    }
}

#[test]
fn while_a_connection_is_open_only_its_owner_may_do_more_than_read() {
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    let before = rig.attributes_now();
    for row in changes() {
        assert_eq!(rig.ask_as(foreign, &row), REFUSED, "{row:?}");
    }
    for row in reads() {
        assert_eq!(rig.ask_as(foreign, &row), row.4, "{row:?}");
    }
    assert_eq!(rig.attributes_now(), before);
    assert_eq!((rig.state(0), rig.command(0).test), (AxisState::Stopped, None));
    for row in changes().into_iter().chain(reads()) {
        let started = row.0 == 0x54;
        assert_eq!(rig.ask_as(|request| request, &row), if started { 0 } else { row.4 }, "{row:?}");
    }
    assert_ne!(rig.attributes_now(), before);
    assert_eq!(rig.state(0), AxisState::Starting, "the owner's test has begun");
}

#[test]
fn a_malformed_list_of_another_is_refused_for_whose_it_is() {
    let mut rig = Rig::stopped();
    let row = (0x04, 1, None, vec![9, 0], GeneralStatus::NOT_ENOUGH_DATA.0);
    assert_eq!((rig.ask_as(foreign, &row), rig.ask_as(|request| request, &row)), (REFUSED, row.4));
}

#[test]
fn without_a_connection_anybody_may_set() {
    let set = (0x10, 1, Some(610), vec![4], 0);
    let mut rig = Rig::new();
    assert_eq!(rig.ask_as(foreign, &set), 0);
    let mut rig = Rig::stopped();
    assert_eq!(rig.ask_as(foreign, &set), REFUSED);
    rig.close();
    assert_eq!(rig.ask_as(foreign, &set), 0, "closed");
    let mut rig = Rig::stopped();
    for _ in 0..20 {
        rig.silence();
    }
    rig.device.poll(rig.now(), rig.system());
    assert!(matches!(rig.device.poll_reply(), Some(MotionReply::ConnectionLost { .. })));
    assert_eq!(rig.ask_as(foreign, &set), 0, "lost");
}

#[test]
fn a_list_of_another_that_waits_for_the_drive_ends_when_the_connection_opens() {
    // Attribute 1316 is the drive's; 610 stands behind it and must not be set under the new owner.
    let list = [2, 0, 0, 0, 0x24, 5, 0, 4, 1, 2, 3, 4, 0x62, 2, 0, 1, 4, 0, 0, 0];
    let mut rig = Rig::new();
    assert_eq!(rig.request(foreign(explicit(5, 0x4C, 1, None, &list))), None, "it waits");
    let access = rig.device.poll_attribute_access().expect("an access");
    let parameters = rig.open_parameters();
    let first = rig.request(MotionRequest::Open(parameters));
    assert_eq!(first, Some(MotionReply::Explicit(ExplicitReply::status(Token(5), REFUSED))));
    assert_eq!(
        rig.device.poll_reply(),
        Some(MotionReply::Opened { token: parameters.token, outcome: Ok(()) })
    );
    rig.device.complete_attribute(access.ticket, Ok(&[]));
    rig.device.poll(rig.now(), rig.system());
    assert_eq!(rig.device.poll_reply(), None);
    assert_eq!(rig.device.attribute(0, 610), Ok(&[0][..]), "as the connection found it");

    // A list that is read goes on, and so does one of the owner-to-be.
    let get = [1, 0, 0, 0, 0x24, 5, 0, 4];
    for request in [foreign(explicit(6, 0x4B, 1, None, &get)), explicit(6, 0x4C, 1, None, &list)] {
        let mut rig = Rig::new();
        assert_eq!(rig.request(request), None);
        let access = rig.device.poll_attribute_access().expect("an access");
        rig.open();
        rig.device.complete_attribute(access.ticket, Ok(&[1, 2, 3, 4]));
        assert_eq!(reply_of(rig.device.poll_reply()).1, 0);
    }
}
