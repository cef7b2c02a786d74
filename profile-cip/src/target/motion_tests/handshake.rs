//! Axis Control requests on a living device: completion criteria and errors of Tables 5-2.103 and 5-2.104.

use super::super::axis_state::AxisState;
use super::super::drive_link::{DriveAction, DriveConditions, Withheld};
use super::*;
use crate::wire::motion::codes::{AxisStatus, ClearingEvent, FaultType};

fn answer(rig: &Rig) -> (AxisControl, u8) {
    (rig.actual(0).axis_response, rig.actual(0).response_status)
}

fn ask(rig: &mut Rig, control: AxisControl, cycles: usize) -> (AxisControl, u8) {
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.cycle();
    rig.blocks[0].axis_control = control;
    rig.cycles(cycles);
    answer(rig)
}

#[test]
fn enable_and_disable_complete_when_the_drive_has_done_it() {
    let mut rig = Rig::stopped();
    rig.drives[0].stuck = true;
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 5), (AxisControl::NONE, 0));
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Starting, DriveAction::Enable));
    assert_eq!(rig.withheld(0), Some(Withheld::NotRunning));
    rig.drives[0].stuck = false;
    rig.cycle();
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Running, (AxisControl::ENABLE, 0)));

    rig.drives[0].stuck = true;
    assert_eq!(ask(&mut rig, AxisControl::DISABLE, 3), (AxisControl::NONE, 0));
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopping, DriveAction::Disable));
    rig.drives[0].stuck = false;
    rig.cycle();
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Stopped, (AxisControl::DISABLE, 0)));
    assert_eq!(ask(&mut rig, AxisControl::DISABLE, 1), (AxisControl::DISABLE, 0), "already there");
}

#[test]
fn an_answer_to_an_older_action_does_not_count() {
    let mut rig = Rig::stopped();
    rig.drives[0].stuck = true;
    // The image keeps "start complete" of no known action standing.
    rig.drives[0].image.start_complete = true;
    let stale = rig.drives[0].image.action_id;
    rig.blocks[0].axis_control = AxisControl::ENABLE;
    for _ in 0..3 {
        let packet = rig.command_packet();
        rig.send(&packet);
        let mut image = rig.drives[0].image;
        image.action_id = stale;
        rig.device.set_drive(0, image);
        rig.device.poll(rig.now(), rig.system());
        assert_eq!(rig.state(0), AxisState::Starting);
        rig.now += PERIOD;
    }
}

#[test]
fn enable_is_refused_where_the_table_has_no_way() {
    let conflict = (AxisControl::ENABLE, 0x0C);
    let mut rig = Rig::stopped();
    rig.drives[0].image.bus_up = false;
    rig.cycle();
    assert_eq!(rig.state(0), AxisState::PreCharge);
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 2), conflict);
    rig.drives[0].image.bus_up = true;
    rig.drives[0].image.start_inhibits = 1 << 5;
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::StartInhibited);
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 2), conflict);
    assert_eq!(
        rig.device.axis_faults(0),
        Some(0),
        "a start that is refused is no exception (clause 5-2.6.4)"
    );
    rig.drives[0].image.start_inhibits = 0;
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::Stopped, "a refused Enable does not wait for its chance");
    rig.blocks[0].control_mode = ControlMode::TORQUE;
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 2), (AxisControl::ENABLE, 0x09));
    rig.blocks[0].control_mode = ControlMode::POSITION;
    // Faulted on the way to Running: the request ends with an error.
    rig.drives[0].stuck = true;
    ask(&mut rig, AxisControl::ENABLE, 2);
    rig.raise(0, 54, 0x22);
    rig.cycles(2);
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Aborting, conflict));
}

#[test]
fn a_fault_goes_through_aborting_and_only_a_reset_clears_it() {
    let mut rig = Rig::running();
    rig.raise(0, 54, 0x22);
    rig.cycles(4);
    assert_eq!((rig.state(0), rig.state(1)), (AxisState::MajorFaulted, AxisState::Running));
    assert_eq!(rig.device.axis_faults(0), Some(1 << 54));
    rig.drives[0].image.conditions = DriveConditions::default();
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::MajorFaulted, "latched");
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 3), (AxisControl::ENABLE, 0x0C));
    assert_eq!(ask(&mut rig, AxisControl::FAULT_RESET, 2), (AxisControl::FAULT_RESET, 0));
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Stopped, Some(0)));
    rig.cycles(5);
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn a_fault_that_persists_comes_back_after_its_reset() {
    let mut rig = Rig::running();
    rig.drives[0].sticky = true;
    rig.raise(0, 47, 0x24);
    rig.cycles(4);
    let mut records = Vec::new();
    rig.blocks[0].axis_control = AxisControl::FAULT_RESET;
    for _ in 0..8 {
        rig.cycle();
        records.extend(rig.actual(0).status.fault.map(|r| (r.fault_type, r.code)));
    }
    records.dedup();
    assert_eq!(
        answer(&rig),
        (AxisControl::FAULT_RESET, 0),
        "acknowledged: the faults were clear for a moment"
    );
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    let cleared = (FaultType::CLEARED, ClearingEvent::FAULT_RESET.0);
    assert_eq!(records, [cleared, (FaultType::AXIS, 47)]);
}

#[test]
fn shutdown_latches_and_its_reset_leads_to_pre_charge() {
    let mut rig = Rig::running();
    assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN, 1), (AxisControl::NONE, 0));
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopping, DriveAction::Shutdown));
    rig.cycles(2);
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Shutdown, (AxisControl::SHUTDOWN, 0)));
    // The bus stays up, so Pre-Charge is only passed through.
    assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN_RESET, 1), (AxisControl::SHUTDOWN_RESET, 0));
    assert_eq!(rig.state(0), AxisState::Stopped);
    let (status, _) = rig.actual(0).status.axis_status.expect("changed");
    assert!(!status.contains(AxisStatus::SHUTDOWN));
    assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN_RESET, 1), (AxisControl::SHUTDOWN_RESET, 0), "no effect");
}

#[test]
fn shutdown_under_a_fault_is_a_sub_state() {
    // Clause 5-2.6.2.13: a fault reset leads to Shutdown, a shutdown reset clears both.
    for (reset, end) in
        [(AxisControl::FAULT_RESET, AxisState::Shutdown), (AxisControl::SHUTDOWN_RESET, AxisState::Stopped)]
    {
        let mut rig = Rig::running();
        rig.raise(0, 54, 0x32);
        rig.cycles(4);
        rig.drives[0].image.conditions = DriveConditions::default();
        assert_eq!(rig.state(0), AxisState::MajorFaulted);
        assert_eq!(ask(&mut rig, reset, 3), (reset, 0));
        assert_eq!(rig.state(0), end);
    }
}

/// A rig whose first axis is held in Major Faulted.
fn held() -> Rig {
    let mut rig = Rig::running();
    rig.drives[0].holds = true;
    assert_eq!(ask(&mut rig, AxisControl::ABORT, 3), (AxisControl::ABORT, 0));
    assert_eq!(ask(&mut rig, AxisControl::NONE, 1), (AxisControl::NONE, 0));
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::MajorFaulted, DriveAction::Abort));
    rig
}

#[test]
fn an_abort_that_holds_ends_in_major_faulted_with_the_power_structure_on() {
    // Table 5-2.61 has the bit in Major Faulted after a category 2 stop.
    let mut rig = held();
    let power = |rig: &mut Rig| {
        let reply =
            super::services::reply_of(rig.request(super::services::explicit(9, 0x0E, 1, Some(651), &[])));
        reply.2[0] & 8 != 0
    };
    assert!(power(&mut rig));
    rig.cycles(100);
    assert_eq!((rig.state(0), power(&mut rig)), (AxisState::MajorFaulted, true));
    // A shutdown takes the torque and is acknowledged when it has gone (5-2.6.2.13).
    rig.drives[0].stuck = true;
    assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN, 3), (AxisControl::NONE, 0));
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::MajorFaulted, DriveAction::Shutdown));
    rig.drives[0].stuck = false;
    rig.cycles(2);
    assert_eq!((answer(&rig), power(&mut rig)), ((AxisControl::SHUTDOWN, 0), false));
    assert_eq!(ask(&mut rig, AxisControl::FAULT_RESET, 3), (AxisControl::FAULT_RESET, 0));
    assert_eq!(rig.state(0), AxisState::Shutdown);
    // Nobody sees the torque of a drive that is gone: the shutdown does not wait for it.
    let mut rig = held();
    rig.drives[0].image.online = false;
    rig.drives[0].stuck = true;
    assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN, 2), (AxisControl::SHUTDOWN, 0));
}

#[test]
fn an_axis_that_was_held_is_not_ready_before_it_has_let_go() {
    let mut rig = held();
    rig.drives[0].stuck = true;
    rig.close();
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Initializing, DriveAction::Disable));
    rig.open();
    rig.configure();
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.state(1)), (AxisState::Initializing, AxisState::Stopped));
    rig.drives[0].stuck = false;
    rig.cycles(4);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopped, DriveAction::PowerUp));
    // After a loss the drive may go on holding until somebody connects.
    let mut rig = held();
    for _ in 0..20 {
        rig.silence();
        rig.device.poll(rig.now(), rig.system());
    }
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::MajorFaulted, DriveAction::Abort));
    while rig.device.poll_reply().is_some() {}
    rig.drives[0].stuck = true;
    rig.open();
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Initializing, DriveAction::Disable));
    rig.drives[0].stuck = false;
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn abort_is_a_controller_initiated_exception() {
    let mut rig = Rig::running();
    assert_eq!(ask(&mut rig, AxisControl::ABORT, 1), (AxisControl::ABORT, 0));
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Aborting, Some(1 << 62)));
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    assert_eq!(ask(&mut rig, AxisControl::FAULT_RESET, 2), (AxisControl::FAULT_RESET, 0));
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn cancel_frees_the_handshake_and_the_enable_goes_on() {
    let mut rig = Rig::stopped();
    rig.drives[0].stuck = true;
    ask(&mut rig, AxisControl::ENABLE, 2);
    rig.blocks[0].axis_control = AxisControl::CANCEL;
    rig.cycle();
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Starting, (AxisControl::CANCEL, 0)));
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.cycle();
    assert_eq!(answer(&rig), (AxisControl::NONE, 0));
    rig.blocks[0].axis_control = AxisControl::DISABLE;
    rig.cycle();
    assert_eq!(rig.state(0), AxisState::Stopping);
    rig.drives[0].stuck = false;
    rig.cycles(2);
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Stopped, (AxisControl::DISABLE, 0)));
}

#[test]
fn reserved_requests_are_answered_with_an_error() {
    let mut rig = Rig::stopped();
    assert_eq!(ask(&mut rig, AxisControl(10), 1), (AxisControl(10), 0x08));
    assert_eq!(ask(&mut rig, AxisControl(200), 1), (AxisControl(200), 0x08));
    assert_eq!(ask(&mut rig, AxisControl::STOP_PROCESS, 1), (AxisControl::STOP_PROCESS, 0));
}

#[test]
fn the_position_reference_changes_as_in_table_5_2_109() {
    let mut rig = Rig::running();
    rig.drives[0].image.position = 1000;
    rig.blocks[0].actual_data_set = ActualDataSet::POSITION | ActualDataSet::POSITION_DISPLACEMENT;
    rig.cycles(2);
    let position = |rig: &Rig| match rig.actual(0).actual.position {
        Some(crate::wire::motion::ActualPosition::Dint(p)) => p,
        other => panic!("{other:?}"),
    };
    assert_eq!((position(&rig), rig.actual(0).actual.position_displacement), (1000, Some(0)));
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    rig.blocks[0].values.position_displacement = Some(-300);
    rig.cycle();
    assert_eq!(answer(&rig), (AxisControl::CHANGE_ACTUAL_POSITION, 0));
    assert_eq!((position(&rig), rig.actual(0).actual.position_displacement), (700, Some(-300)));
    rig.blocks[0].axis_control = AxisControl::CHANGE_COMMAND_POSITION;
    rig.blocks[0].values.position = Some(CommandPosition::Float(700.0));
    rig.cycle();
    assert_eq!(answer(&rig), (AxisControl::CHANGE_COMMAND_POSITION, 0));
    let set_points = rig.follow(0);
    assert_eq!(set_points.position_reference, -300, "700 less -300 is the drive's 1000");
    assert_eq!(rig.actual(0).actual.position_displacement, Some(0));
    rig.blocks[0].values.position_displacement = None;
    assert_eq!(
        ask(&mut rig, AxisControl::CHANGE_ACTUAL_POSITION, 1),
        (AxisControl::CHANGE_ACTUAL_POSITION, 0x13)
    );
    assert_eq!(position(&rig), 700);
}

#[test]
fn a_drive_that_stops_following_is_not_running_any_more() {
    let mut rig = Rig::running();
    rig.drives[0].stuck = true;
    rig.drives[0].image.start_complete = false;
    rig.cycle();
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopping, DriveAction::Disable));
    rig.drives[0].stuck = false;
    rig.cycles(5);
    assert_eq!(rig.state(0), AxisState::Stopped);

    let mut rig = Rig::running();
    rig.drives[0].image.start_inhibits = 1 << 5;
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::StartInhibited, "by way of Stopping");

    let mut rig = Rig::running();
    rig.drives[0].image.online = false;
    rig.cycle();
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Aborting, Some(1 << 63)));
}

#[test]
fn the_position_rolls_over_as_a_dint() {
    let mut rig = Rig::running();
    rig.drives[0].image.position = i64::from(i32::MAX) + 5;
    rig.cycle();
    let position = rig.actual(0).actual.position;
    assert_eq!(position, Some(crate::wire::motion::ActualPosition::Dint(i32::MIN + 4)));
}
