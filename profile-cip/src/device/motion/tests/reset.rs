//! When the box may be started anew, and what a connection that begins or ends resets.

use super::*;
use crate::device::axis::state::AxisState;
use crate::device::motion_link::{MotionReply, MotionRequest, Token};
use crate::wire::motion::codes::{ClearingEvent, NodeFault};

fn granted(rig: &mut Rig) -> bool {
    match rig.request(MotionRequest::PrepareReset(Token(9))) {
        Some(MotionReply::ResetPrepared { token: Token(9), granted }) => granted,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_device_without_controller_and_power_may_be_started_anew() {
    let mut rig = Rig::new();
    assert!(granted(&mut rig));
    rig.open();
    assert!(!granted(&mut rig), "a connection without data is one");
    rig.close();
    rig.silence();
    assert!(granted(&mut rig));
    let mut rig = Rig::stopped();
    assert!(!granted(&mut rig), "owned");
}

#[test]
fn a_device_whose_axes_come_to_a_stop_is_not_started_anew() {
    // Closed and lost in motion, with a drive that takes its time.
    for lost in [false, true] {
        let mut rig = Rig::running();
        rig.drives[1].stuck = true;
        if lost {
            rig.now += 17 * PERIOD;
            let (now, system) = (rig.now(), rig.system());
            rig.device.poll(now, system);
            assert!(matches!(rig.device.poll_reply(), Some(MotionReply::ConnectionLost { .. })));
        } else {
            rig.close();
        }
        rig.silence();
        rig.silence();
        assert!(!rig.drives[0].image.power_enabled && rig.drives[1].image.power_enabled);
        assert!(!granted(&mut rig), "lost {lost}: axis 2 is energized");
        rig.drives[1].stuck = false;
        rig.silence();
        rig.silence();
        assert!(granted(&mut rig), "lost {lost}: both are not");
    }
}

#[test]
fn a_closed_connection_is_no_lost_one() {
    let mut rig = Rig::running();
    rig.close();
    assert_eq!((rig.state(0), rig.withheld(0)), (AxisState::Initializing, Some(Withheld::NotConnected)));
    assert_eq!(rig.command(0).action, DriveAction::Disable);
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    for _ in 0..4 {
        rig.silence();
    }
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Initializing, DriveAction::None));
    assert!(!rig.drives[0].image.power_enabled);

    let mut rig = Rig::running();
    rig.now += 17 * PERIOD;
    let (now, system) = (rig.now(), rig.system());
    rig.device.poll(now, system);
    assert_eq!((rig.state(0), rig.withheld(0)), (AxisState::MajorFaulted, Some(Withheld::ConnectionLost)));
    assert_eq!(rig.command(0).action, DriveAction::Abort);
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_LOSS);
}

/// Latched faults of an axis, and code and end of each entry of its log, oldest first.
fn faults(rig: &Rig) -> (Option<u64>, Vec<(u8, Option<ClearingEvent>)>) {
    let log = rig.device.fault_log(0).expect("an axis");
    let mut entries: Vec<_> = log.entries().map(|one| (one.code, one.ended.map(|(by, _)| by))).collect();
    entries.reverse();
    (rig.device.axis_faults(0), entries)
}

#[test]
fn a_connection_has_the_drive_reset_its_faults_and_what_stands_is_a_fault_again() {
    const BY: Option<ClearingEvent> = Some(ClearingEvent::CONNECTION_RESET);
    for stands in [false, true] {
        let mut rig = Rig::running();
        rig.drives[0].sticky = stands;
        rig.raise(0, 10, 0x24);
        rig.cycles(5);
        assert_eq!(
            (rig.state(0), faults(&rig)),
            (AxisState::MajorFaulted, (Some(1 << 10), vec![(10, None)]))
        );
        let resets = rig.command(0).reset_id;
        rig.request_all(AxisControl::NONE);
        let closed = EPOCH + rig.now;
        rig.close();
        assert_eq!((rig.state(0), faults(&rig)), (AxisState::Initializing, (Some(0), vec![(10, BY)])));
        for _ in 0..4 {
            rig.silence();
        }
        assert_eq!(rig.command(0).reset_id, resets + 1, "once, after the drive has stopped");
        assert_eq!(rig.drives[0].image.conditions.as_slice().is_empty(), !stands);
        rig.packet.clear();
        rig.open();
        assert_eq!(rig.command(0).reset_id, resets + 1);
        rig.configure();
        rig.cycles(4);
        assert_eq!(rig.command(0).reset_id, resets + 2, "a connection that begins resets as well");
        if stands {
            let log = vec![(10, BY), (10, None)];
            assert_eq!((rig.state(0), faults(&rig)), (AxisState::MajorFaulted, (Some(1 << 10), log)));
            let newest = rig.device.fault_log(0).and_then(|log| log.entries().next().copied());
            assert!(newest.is_some_and(|entry| entry.at == closed), "raised anew, not as old as the first");
        } else {
            assert_eq!((rig.state(0), faults(&rig)), (AxisState::Stopped, (Some(0), vec![(10, BY)])));
        }
        assert_eq!(rig.state(1), AxisState::Stopped);
        assert!(!rig.drives[0].image.power_enabled);
    }
}

#[test]
fn an_axis_leaves_initializing_only_when_its_drive_has_tried_the_reset() {
    let mut rig = Rig::new();
    rig.open();
    rig.configure();
    rig.drives[0].resetting = true;
    rig.cycles(20);
    assert_eq!((rig.state(0), rig.state(1)), (AxisState::Initializing, AxisState::Stopped));
    rig.drives[0].resetting = false;
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn a_lost_drive_is_told_and_one_that_has_not_come_yet_is_waited_for() {
    let mut rig = Rig::new();
    rig.drives[0].image.online = false;
    rig.open();
    rig.configure();
    rig.cycles(10);
    assert_eq!((rig.state(0), rig.state(1)), (AxisState::Initializing, AxisState::Stopped));
    rig.raise(0, 12, 0x24);
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::MajorFaulted, Some(1 << 12)));
    rig.drives[0].image.online = true;
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(6);
    assert_eq!(rig.state(0), AxisState::Stopped);
}
