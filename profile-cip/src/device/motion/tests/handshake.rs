//! Axis Control requests on a living device: completion criteria and errors of Tables 5-2.103 and 5-2.104.

use super::*;
use crate::device::axis::SequenceSettings;
use crate::device::axis::drive_link::{DriveAction, DriveConditions, Withheld};
use crate::device::axis::fault_log::LogKind;
use crate::device::axis::state::AxisState;
use crate::wire::motion::codes::{AxisStatus, ClearingEvent, FaultType, FeedbackMode};

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

/// What follows from an Abort Request the controller sets, action 0 to 3: the state, the answer, and what is latched.
#[test]
fn an_abort_does_what_its_exception_action_says() {
    let rows = [
        (0_u8, AxisState::Running, 0x0C, 0, 0),
        (1, AxisState::Running, 0, 0, 1),
        (2, AxisState::Running, 0, 1 << 62, 0),
        (3, AxisState::Aborting, 0, 1 << 62, 0),
    ];
    for (action, state, status, faults, alarms) in rows {
        let mut rig = Rig::running();
        rig.blocks[0].status_data_set |= StatusDataSet::ALARM;
        rig.cycles(3);
        let mut actions = [0; 64];
        actions[62] = action;
        rig.device.put_attribute(0, 672, &actions).expect("the array");
        assert_eq!(ask(&mut rig, AxisControl::ABORT, 1), (AxisControl::ABORT, status), "action {action}");
        assert_eq!((rig.state(0), rig.device.axis_faults(0)), (state, Some(faults)), "action {action}");
        let log = rig.device.fault_log(0).expect("the log");
        let came = log.entries().filter(|entry| matches!(entry.kind, LogKind::Alarm(_)) && entry.code == 62);
        assert_eq!(came.count(), alarms, "action {action}");
        let refused = rig.device.poll_refused(0).map(|refused| refused.to_string());
        let text = "the request Abort (5) was refused with status 0x0c: its Axis Exception Action is Ignore";
        assert_eq!(refused.as_deref(), (action == 0).then_some(text));
        if action < 3 {
            assert!(rig.follow(0).age_updates <= 1, "it goes on");
        }
    }
}

/// A mode that the axis cannot go on in is not followed, whatever the controller wants from that.
#[test]
fn an_illegal_mode_is_followed_by_nobody() {
    for (action, state, faults) in
        [(0_u8, AxisState::Running, 0), (2, AxisState::Running, 1 << 60), (3, AxisState::Aborting, 1 << 60)]
    {
        let mut rig = Rig::running();
        let mut actions = [0; 64];
        actions[60] = action;
        rig.device.put_attribute(0, 672, &actions).expect("the array");
        let known = rig.follow(0);
        rig.blocks[0].control_mode = ControlMode::TORQUE;
        rig.blocks[0].values = CommandValues { torque: Some(50.0), ..CommandValues::default() };
        rig.cycle();
        assert_eq!((rig.state(0), rig.device.axis_faults(0)), (state, Some(faults)), "action {action}");
        if action < 3 {
            let follow = rig.follow(0);
            assert_eq!((follow.control_mode, follow.values), (known.control_mode, known.values));
            // What it follows grows old, and is not followed for ever.
            rig.cycles(12);
            assert_eq!(rig.withheld(0), Some(Withheld::Stale), "action {action}");
        }
    }
}

/// With Control Mode 0 the axis of a drive tells its feedback: Running, without torque. It becomes an axis again by another mode,
/// and does not start by that.
#[test]
fn control_mode_0_is_feedback_only() {
    let mut rig = Rig::new();
    rig.open();
    let idle = rig.blocks[0];
    rig.blocks[0].control_mode = ControlMode::NO_CONTROL;
    rig.blocks[0].values = CommandValues::default();
    rig.configure();
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Running, DriveAction::PowerUp));
    assert_eq!(rig.withheld(0), Some(Withheld::NotRunning));
    assert_eq!(rig.device.axis_faults(0), Some(0));
    rig.drives[0].image.bus_up = false;
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::Running, "the bus does not count");
    rig.drives[0].image.bus_up = true;
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 1), (AxisControl::ENABLE, 0x0C));
    let refused = rig.device.poll_refused(0).expect("the refusal").to_string();
    assert_eq!(
        refused,
        "the request Enable (1) was refused with status 0x0c: Control Mode is 0: the axis tells its feedback and follows nothing"
    );
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.cycle();
    assert_eq!(ask(&mut rig, AxisControl::DISABLE, 1), (AxisControl::DISABLE, 0));
    rig.blocks[0] = idle;
    rig.cycles(2);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopped, DriveAction::PowerUp));
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 6), (AxisControl::ENABLE, 0));
    // An axis that follows does not become one by a word.
    rig.blocks[0].control_mode = ControlMode::NO_CONTROL;
    rig.cycle();
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Aborting, Some(1 << 60)));
}

/// Every reason for which an Enable is refused, by its text.
#[test]
fn every_refused_enable_says_why() {
    type Case = (fn(&mut Rig), &'static str);
    let cases: [Case; 9] = [
        (
            |rig| rig.blocks[0].control_mode = ControlMode::TORQUE,
            "0x09: the axis does not have Control Mode 4 (Torque Control)",
        ),
        (
            |rig| rig.blocks[0].feedback_mode = FeedbackMode(1),
            "0x09: the axis does not have Feedback Mode 1 in this Control Mode",
        ),
        (
            |rig| rig.drives[0].image.online = false,
            "0x0c: the drive is not on its bus, or not commissioned yet",
        ),
        (
            |rig| rig.drives[0].image.start_inhibits = 0x22,
            "0x0c: start inhibits stand: 0x0022, of the manufacturer 0x0000",
        ),
        (
            |rig| rig.drives[0].image.start_inhibits_mfg = 4,
            "0x0c: start inhibits stand: 0x0000, of the manufacturer 0x0004",
        ),
        (|rig| rig.drives[0].image.bus_up = false, "0x0c: the axis is Pre-Charge"),
        (|rig| rig.raise(0, 9, 0x24), "0x0c: the axis is Major Faulted"),
        (
            |rig| {
                ask(rig, AxisControl::SHUTDOWN, 1);
            },
            "0x0c: the axis is Shutdown",
        ),
        (
            |rig| {
                rig.blocks[0].values.position_displacement = Some(5);
                ask(rig, AxisControl::CHANGE_COMMAND_POSITION, 1);
            },
            "0x0c: only one of the two position references was changed",
        ),
    ];
    for (prepare, text) in cases {
        let mut rig = Rig::stopped();
        prepare(&mut rig);
        rig.cycles(2);
        rig.blocks[0].axis_control = AxisControl::NONE;
        rig.cycle();
        ask(&mut rig, AxisControl::ENABLE, 1);
        let refused: Vec<_> =
            std::iter::from_fn(|| rig.device.poll_refused(0)).map(|r| r.to_string()).collect();
        assert_eq!(refused, [format!("the request Enable (1) was refused with status {text}")]);
    }
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

    // A start inhibit keeps an axis from starting; it stops none.
    let mut rig = Rig::running();
    rig.drives[0].image.start_inhibits = 1 << 5;
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::Running);
    assert_eq!(rig.follow(0).control_mode, ControlMode::POSITION);
    rig.request_all(AxisControl::DISABLE);
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::StartInhibited, "by way of Stopping");
    rig.request_all(AxisControl::NONE);
    rig.cycle();
    assert_eq!(ask(&mut rig, AxisControl::ENABLE, 1), (AxisControl::ENABLE, 0x0C));

    let mut rig = Rig::stopped();
    rig.drives[0].stuck = true;
    ask(&mut rig, AxisControl::ENABLE, 2);
    assert_eq!(rig.state(0), AxisState::Starting);
    rig.drives[0].image.start_inhibits = 1 << 5;
    rig.cycle();
    assert_eq!((rig.state(0), answer(&rig)), (AxisState::Stopping, (AxisControl::ENABLE, 0x0C)));

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

/// A reset that the controller cancels goes on (Table 5-2.108). What it asks for meanwhile is newer, and stands (clause 5-2.6.2.13).
#[test]
fn a_shutdown_or_an_abort_outlives_a_reset_that_was_under_way() {
    for reset in [AxisControl::FAULT_RESET, AxisControl::SHUTDOWN_RESET] {
        for (request, end, faults) in [
            (AxisControl::SHUTDOWN, AxisState::Shutdown, 0),
            (AxisControl::ABORT, AxisState::MajorFaulted, 1 << 54 | 1 << 62),
        ] {
            let mut rig = Rig::running();
            rig.raise(0, 54, 0x22);
            rig.cycles(4);
            rig.drives[0].resetting = true;
            assert_eq!(ask(&mut rig, reset, 2), (AxisControl::NONE, 0));
            rig.blocks[0].axis_control = AxisControl::CANCEL;
            rig.cycle();
            assert_eq!(answer(&rig), (AxisControl::CANCEL, 0));
            assert_eq!(ask(&mut rig, request, 2), (request, 0), "there is no torque to wait for");
            assert_eq!(rig.state(0), AxisState::MajorFaulted);
            rig.drives[0].resetting = false;
            rig.cycles(4);
            assert_eq!((rig.state(0), rig.device.axis_faults(0)), (end, Some(faults)), "{reset}, {request}");
            assert_eq!(ask(&mut rig, AxisControl::SHUTDOWN_RESET, 4), (AxisControl::SHUTDOWN_RESET, 0));
            assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Stopped, Some(0)));
        }
    }
}

#[test]
fn a_stop_that_ends_in_shutdown_is_no_place_for_a_flying_start() {
    for (stop, answer, state, end) in [
        (AxisControl::DISABLE, (AxisControl::NONE, 0), AxisState::Starting, AxisState::Running),
        (AxisControl::SHUTDOWN, (AxisControl::ENABLE, 0x0C), AxisState::Stopping, AxisState::Shutdown),
    ] {
        let mut rig = Rig::running();
        rig.device.set_sequence(0, SequenceSettings { flying_start: true, abort: 0x22 });
        rig.drives[0].stuck = true;
        ask(&mut rig, stop, 2);
        assert_eq!(rig.state(0), AxisState::Stopping);
        assert_eq!((ask(&mut rig, AxisControl::ENABLE, 2), rig.state(0)), (answer, state), "{stop}");
        rig.drives[0].stuck = false;
        rig.cycles(4);
        assert_eq!(rig.state(0), end, "{stop}");
    }
}
