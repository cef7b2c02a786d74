use profile_generic::fault::FaultCause;
use profile_generic::image::Signal;
use profile_generic::image::{AxisCommand, AxisFeedback};
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::state::Report;

use super::*;
use crate::cip_scaling::CipScaling;
use crate::item::Item;

fn mapping() -> Mapping {
    Mapping::embedded().expect("the shipped tables are sound")
}

/// A slide of 5 mm a turn, with 1000 counts in one.
fn scaling() -> CipScaling {
    CipScaling {
        kind: UnitKind::Linear,
        nanounits_per_unit: 5 * NANO,
        counts_per_unit: 1000,
        inverted: false,
        unwind: None,
    }
}

fn motion_axis() -> DriveProgram {
    let modes = vec![OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
    mapping().devicenet_motion_program(&MotionAxis { scaling: scaling(), modes }).unwrap()
}

/// A status of the axis states of the standard.
fn status(state: u32, flags: u32) -> u32 {
    state | flags << 8 | 1 << MODE_SHIFT
}

const STATES: [(u32, Report); 9] = [
    (0, Report::NotReady),
    (1, Report::AwaitingPower),
    (2, Report::Ready),
    (3, Report::Enabling),
    (4, Report::Operating),
    (6, Report::Stopping),
    (7, Report::FaultReaction),
    (8, Report::Faulted),
    (10, Report::AwaitingPower),
];

#[test]
fn every_axis_state_has_its_report_while_it_is_valid() {
    let program = motion_axis();
    for (state, report) in STATES {
        assert_eq!(program.report(status(state, 1)), report, "axis state {state}");
        assert_eq!(program.report(status(state, 0)), Report::NotReady, "axis state {state}, not valid");
        assert_eq!(program.report(status(state, 2)), Report::Faulted, "axis state {state}, node fault");
    }
}

#[test]
fn requests_follow_from_action_and_state() {
    let program = motion_axis();
    let control = |action, state| {
        let selection = ModeSelection::from(OperatingMode::Velocity);
        program.control(action, selection, 0, status(state, 1)).to_le_bytes()
    };
    let (stopped, starting, running, stopping, faulted, shutdown) = (2, 3, 4, 6, 8, 10);
    // Axis Control, whether it may run, Control Mode.
    let cases = [
        (Action::Enable, stopped, [1, 1, 2, 0]),
        (Action::Enable, running, [0, 1, 2, 0]),
        (Action::Enable, shutdown, [4, 1, 2, 0]),
        (Action::Halt, running, [0, 1, 2, 0]),
        (Action::Halt, stopped, [0, 1, 2, 0]),
        (Action::Disable, starting, [2, 0, 2, 0]),
        (Action::Disable, running, [2, 0, 2, 0]),
        (Action::Disable, stopping, [0, 0, 2, 0]),
        (Action::TorqueOff, stopped, [0, 0, 2, 0]),
        (Action::TorqueOff, running, [3, 0, 2, 0]),
        (Action::TorqueOff, stopping, [3, 0, 2, 0]),
        (Action::TorqueOff, shutdown, [4, 0, 2, 0]),
        (Action::ResetFault, faulted, [6, 0, 2, 0]),
        (Action::ResetFault, stopped, [0, 0, 2, 0]),
    ];
    for (action, state, expected) in cases {
        assert_eq!(control(action, state), expected, "{action:?} in axis state {state}");
    }
}

#[test]
fn values_go_in_the_units_of_the_profile_and_positions_wrap() {
    let program = motion_axis();
    let mut row = [0xA5; ROW_LEN];
    let mut command = AxisCommand::default();
    command.set(Signal::PositionCommand, 7_500_000_000);
    command.set(Signal::VelocityCommand, 10_000_000_000);
    command.set(Signal::TorqueCommand, 125_000);
    command.select(OperatingMode::Position.into());
    let mut report = ConversionReport::default();
    program.encode(&command, Action::Enable, 0, status(4, 1), &mut row, &mut report);
    assert_eq!(report.saturated, 0);
    assert_eq!(row[..3], [0, 1, 1]);
    assert_eq!(row[3..7], 1500_i32.to_le_bytes(), "7.5 mm are a turn and a half");
    assert_eq!(row[7..11], 2.0_f32.to_le_bytes(), "10 mm/s are 2 turns a second");
    assert_eq!(row[11..15], 12.5_f32.to_le_bytes(), "percent of the rated torque");
    let mut cached = program.cached_status();
    let mut feedback = AxisFeedback::default();
    let mut back = |position: i32| {
        row[..3].copy_from_slice(&[4, 1, 1]);
        row[3..7].copy_from_slice(&position.to_le_bytes());
        program.decode(&row, false, &mut feedback, &mut cached, &mut report).unwrap();
        (feedback.position, feedback.velocity, feedback.mode)
    };
    let wanted =
        (Position(5_000_000 * i64::from(i32::MAX)), Velocity(10_000_000_000), OperatingMode::Position);
    assert_eq!(back(i32::MAX), wanted);
    assert_eq!(back(i32::MIN).0, Position(5_000_000 * (i64::from(i32::MAX) + 1)), "one count on");
}

#[test]
fn faults_are_told_by_type_and_code_and_all_of_them_stop() {
    let program = motion_axis();
    let item = Item::attribute(motion::CLASS, motion::AXIS_FAULT);
    assert!(program.is_diagnostic(item));
    let following_error = program.faults(item, 54 | 3 << 8).collect::<Vec<_>>();
    assert_eq!(following_error.len(), 1, "{following_error:?}");
    assert_eq!(following_error[0].0, FaultCause::EXCESSIVE_POSITION_ERROR);
    assert_eq!(program.faults(item, 54 | 9 << 8).count(), 0, "another type");
    assert!(program.diagnostic_words(true).eq([item]) && program.diagnostic_words(false).next().is_none());
}

#[test]
fn limits_are_attributes_of_the_drive_in_its_units() {
    let found = |parameter, value| mapping().devicenet_parameter(&scaling(), parameter, value).unwrap();
    assert_eq!(found(Parameter::TORQUE_LIMIT_NEGATIVE, -1_500_000), (505, -150.0));
    assert_eq!(found(Parameter::POSITION_ERROR_TOLERANCE, 5_000_000_000), (444, 1000.0));
    assert_eq!(found(Parameter::ACCELERATION_LIMIT, 50_000_000_000), (485, 10.0));
    let none = mapping().devicenet_parameter(&scaling(), Parameter(0xFFFF), 0);
    assert_eq!(none, Err(DevicenetError::Parameter(Parameter(0xFFFF))));
}

#[test]
fn a_velocity_drive_counts_revolutions_per_minute() {
    let rpm = Ratio::new(NANO, 60).unwrap();
    let program = |extended| mapping().devicenet_speed_program(&SpeedAxis { speed: rpm, extended }).unwrap();
    let mut command = AxisCommand::default();
    command.set(Signal::VelocityCommand, -25_000_000_000);
    command.select(OperatingMode::Velocity.into());
    let mut row = [0; ROW_LEN];
    let mut report = ConversionReport::default();
    program(true).encode(&command, Action::Enable, 0, 0, &mut row, &mut report);
    assert_eq!((row[0], row[2], report.saturated), (speed::RUN, 2, 0));
    assert_eq!(row[3..5], (-1500_i16).to_le_bytes());
    program(false).encode(&command, Action::Enable, 0, 0, &mut row, &mut report);
    assert_eq!(report.saturated, 1, "the basic assembly has no reverse");
}

#[test]
fn a_velocity_drive_that_somebody_else_leads_is_not_ready() {
    let rpm = Ratio::new(NANO, 60).unwrap();
    let program = |extended| mapping().devicenet_speed_program(&SpeedAxis { speed: rpm, extended }).unwrap();
    let extended = program(true);
    let cases = [
        (0x60, 2, Report::AwaitingPower),
        (0x70, 3, Report::Ready),
        (0x74, 4, Report::Operating),
        (0x14, 4, Report::NotReady),
        (0x74, 5, Report::Stopping),
        (0x75, 6, Report::FaultReaction),
        (0x61, 7, Report::Faulted),
        (0, 0, Report::NotReady),
    ];
    for (bits, state, report) in cases {
        assert_eq!(extended.report(bits | state << 8), report, "{bits:#x} in state {state}");
    }
    let basic = program(false);
    let cases =
        [(0, Report::Ready), (1, Report::Faulted), (4, Report::Operating), (5, Report::FaultReaction)];
    for (bits, report) in cases {
        assert_eq!(basic.report(bits), report, "{bits:#x}");
    }
    let item = Item::attribute(speed::CLASS_SUPERVISOR, speed::FAULT_CODE);
    let over_current = extended.faults(item, 0x2310).next();
    assert_eq!(over_current.map(|(cause, _)| cause), Some(FaultCause::MOTOR_OVER_CURRENT));
}
