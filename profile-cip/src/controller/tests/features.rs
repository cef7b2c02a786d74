//! Every kind of step against the device role of this crate.

use super::against_device::{Pair, assert_good, configured, drive_fault};
use super::rig::COUNTS_PER_UNIT;
use crate::controller::condition::{AlarmPattern, Condition, FaultPattern, Number, ValueCheck};
use crate::controller::limits::AxisLimits;
use crate::controller::program::{CyclicAttribute, CyclicDirection, ExplicitMessage, Redefine};
use crate::controller::sets::DataSets;
use crate::controller::{AxisSet, ControllerConfig, Event, Failure, Limits, Report, Scaling, Step};
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{
    ActualDataSet, AxisControl, AxisStateCode, AxisStatus, CommandDataSet, CommandTarget, ControlMode,
    FaultType, FeedbackMode, MotionService, NodeFault, StatusDataSet, TimeDataSet,
};
use profile_generic::program::Width;
use profile_generic::time::DurationNs;

const LIMITS: Limits = Limits { velocity: 20.0, acceleration: 500.0, jerk: 10_000.0 };
const ONE: AxisSet = AxisSet::NONE.with(1);

pub fn expect(condition: Condition, millis: i64) -> Step {
    Step::Expect { condition, within: DurationNs::from_millis(millis) }
}

pub fn state(state: AxisStateCode) -> Step {
    expect(Condition::State { axis: 1, state }, 1_000)
}

fn position(position: f64) -> Step {
    expect(Condition::Position { axis: 1, position, tolerance: 0.002 }, 500)
}

fn go(position: f64) -> Step {
    Step::MoveAbsolute { axis: 1, position, limits: LIMITS }
}

fn mode(mode: ControlMode) -> Step {
    Step::Mode { axis: 1, mode }
}

/// Runs a program that has to succeed; gives the pair for a look.
fn run_with(config: ControllerConfig, program: Vec<Step>) -> (Pair, Report) {
    let mut pair = Pair::new(config, &[0.0], program);
    let report = pair.run(60);
    assert_eq!(report.failure, None, "step {:?}\n{}", report.failed_step, pair.log());
    (pair, report)
}

fn run(program: Vec<Step>) -> (Pair, Report) {
    run_with(configured(1), program)
}

/// Runs a program that has to fail; gives the step and the text.
fn fail_with(config: ControllerConfig, program: Vec<Step>) -> (usize, String) {
    let mut pair = Pair::new(config, &[0.0], program);
    let report = pair.run(60);
    assert_eq!(pair.device.connection(), None, "closed behind the failure");
    (report.failed_step.unwrap_or(usize::MAX), report.failure.expect("a failure").to_string())
}

fn fail(program: Vec<Step>) -> (usize, String) {
    fail_with(configured(1), program)
}

#[test]
fn all_control_modes_are_changed_on_line() {
    let (pair, report) = run(vec![
        Step::Enable(ONE),
        go(1.0),
        mode(ControlMode::VELOCITY),
        expect(Condition::Mode { axis: 1, mode: ControlMode::VELOCITY }, 0),
        Step::RunAt { axis: 1, velocity: 10.0, acceleration: 200.0, jerk: 5000.0 },
        expect(Condition::Velocity { axis: 1, velocity: 10.0, tolerance: 0.1 }, 100),
        Step::Dwell { seconds: 0.2 },
        Step::RunAt { axis: 1, velocity: -5.0, acceleration: 200.0, jerk: 5000.0 },
        Step::Stop { axis: 1, acceleration: 200.0, jerk: 5000.0 },
        mode(ControlMode::TORQUE),
        Step::Torque { axis: 1, torque: 4.0, rate: 40.0, velocity_limit: 20.0 },
        expect(Condition::Status { axis: 1, bits: AxisStatus::TORQUE_CONTROL_MODE, on: true }, 100),
        Step::Dwell { seconds: 0.1 },
        mode(ControlMode::POSITION),
        go(0.0),
        position(0.0),
        Step::Disable(ONE),
    ]);
    assert_good(&report, &pair);
    assert_eq!(report.axes[0].reached, Some(0.0));
    assert_eq!(report.steps.len(), 17);
    assert!(report.steps.windows(2).all(|two| two[0].ended == Some(two[1].began)));
}

#[test]
fn an_axis_in_torque_control_that_races_loses_its_torque() {
    let program = vec![
        Step::Enable(ONE),
        mode(ControlMode::TORQUE),
        Step::Torque { axis: 1, torque: 40.0, rate: 100.0, velocity_limit: 5.0 },
    ];
    let (step, text) = fail(program);
    assert_eq!(step, 2);
    assert!(text.starts_with("axis 1: velocity in torque control 5."), "{text}");
}

#[test]
fn data_sets_change_on_line_in_any_combination() {
    let all = DataSets {
        command: CommandDataSet::VELOCITY
            | CommandDataSet::ACCELERATION
            | CommandDataSet::TORQUE
            | CommandDataSet::POSITION_DISPLACEMENT,
        actual: ActualDataSet::POSITION | ActualDataSet::VELOCITY | ActualDataSet::ACCELERATION,
        status: StatusDataSet::FAULT
            | StatusDataSet::ALARM
            | StatusDataSet::AXIS_STATUS
            | StatusDataSet::IO_STATUS
            | StatusDataSet::SAFETY_STATUS,
        integer_position: true,
    };
    let least = DataSets {
        command: CommandDataSet::empty(),
        actual: ActualDataSet::POSITION,
        status: StatusDataSet::empty(),
        integer_position: false,
    };
    let (pair, report) = run(vec![
        Step::Enable(ONE),
        Step::DataSets { axis: 1, sets: all },
        Step::TimeData(TimeDataSet::UPDATE_DIAGNOSTICS | TimeDataSet::TIME_DIAGNOSTICS),
        go(2.0),
        position(2.0),
        expect(
            Condition::IoStatus {
                axis: 1,
                bits: crate::wire::motion::codes::AxisIoStatus::ENABLE_INPUT,
                on: false,
            },
            100,
        ),
        Step::DataSets { axis: 1, sets: least },
        Step::TimeData(TimeDataSet::empty()),
        Step::Feedback { axis: 1, mode: FeedbackMode(2) },
        go(-1.0),
        position(-1.0),
    ]);
    assert_good(&report, &pair);
    assert_eq!(report.malformed, 0);
}

#[test]
fn every_command_target_is_followed() {
    for target in [CommandTarget::IMMEDIATE, CommandTarget::EXTRAPOLATE, CommandTarget::INTERPOLATE] {
        let (_, report) = run(vec![Step::Enable(ONE), Step::Target(target), go(3.0), position(3.0)]);
        assert_eq!(report.axes[0].reached, Some(3.0), "{target}");
    }
}

#[test]
fn a_position_reference_is_redefined_without_a_movement() {
    let redefine = |change| Step::RedefinePosition { axis: 1, change };
    let (pair, report) = run(vec![
        Step::Enable(ONE),
        go(2.0),
        position(2.0),
        redefine(Redefine::To(100.0)),
        position(100.0),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
        go(101.0),
        position(101.0),
        redefine(Redefine::By(-0.5)),
        go(100.0),
        position(100.0),
        Step::Disable(ONE),
        redefine(Redefine::To(0.0)),
        position(0.0),
        Step::Enable(ONE),
        go(1.0),
        position(1.0),
    ]);
    assert_good(&report, &pair);
    // 2 + 1 - 0.5 + 1 units of movement, the rest was renaming.
    assert!((pair.plants[0].position / COUNTS_PER_UNIT - 3.5).abs() < 0.002, "{}", pair.plants[0].position);
}

#[test]
fn requests_are_cancelled_refused_and_made_without_waiting() {
    let conflict = Some(0x0C);
    let refused = |request, status| Step::Refused { axes: ONE, request, status };
    let (pair, _) = run(vec![
        Step::Ask { axes: ONE, request: AxisControl::ENABLE },
        Step::Cancel(ONE),
        // What was asked goes on without its acknowledge.
        state(AxisStateCode::RUNNING),
        Step::Disable(ONE),
        // Without a displacement there is nothing to change the reference by.
        refused(AxisControl::CHANGE_ACTUAL_POSITION, Some(0x13)),
        refused(AxisControl(77), Some(0x08)),
        Step::StopProcess(ONE),
        Step::Shutdown(ONE),
        state(AxisStateCode::SHUTDOWN),
        refused(AxisControl::ENABLE, conflict),
        Step::ShutdownReset(ONE),
        Step::Enable(ONE),
        Step::Abort(ONE),
        expect(
            Condition::Fault {
                axis: 1,
                pattern: FaultPattern { fault_type: Some(FaultType::AXIS), code: Some(62), sub_code: None },
            },
            500,
        ),
        state(AxisStateCode::MAJOR_FAULTED),
        Step::FaultReset(ONE),
        expect(
            Condition::Fault {
                axis: 1,
                pattern: FaultPattern { fault_type: Some(FaultType::CLEARED), code: Some(2), sub_code: None },
            },
            500,
        ),
        state(AxisStateCode::STOPPED),
        expect(Condition::NoFault, 0),
    ]);
    assert_eq!(pair.device.node_fault(), NodeFault::NONE);
    let (step, text) =
        fail(vec![Step::Refused { axes: ONE, request: AxisControl::ENABLE, status: conflict }]);
    assert_eq!(step, 0);
    assert_eq!(
        text,
        "axis 1: expected Enable refused with status 0x0c (object state conflict), found status 0x00 (success)"
    );
}

#[test]
fn expectations_say_what_came_instead() {
    let cases = [
        (
            Condition::State { axis: 1, state: AxisStateCode::RUNNING },
            "expected axis 1: state Running, found state Stopped after",
        ),
        (
            Condition::Position { axis: 1, position: 1.0, tolerance: 0.5 },
            "expected axis 1: position 1 within 0.5, found 0 after",
        ),
        (
            Condition::Fault { axis: 1, pattern: FaultPattern { code: Some(3), ..FaultPattern::default() } },
            "expected axis 1: a fault code 3, found Faults Cleared by Connection Reset at",
        ),
        (
            Condition::Alarm { axis: 1, pattern: AlarmPattern::default() },
            "expected axis 1: an alarm, found nothing after",
        ),
        (
            Condition::NodeFault(NodeFault::CLOCK_SKEW),
            "expected node fault: Clock Skew Fault, found node fault: No Fault after",
        ),
        (Condition::ConnectionLost, "expected the connection lost, found the opposite after"),
        (Condition::LostUpdates(1), "expected 1 lost updates or more counted by the device, found 0 after"),
        (Condition::Synchronous(false), "expected asynchronous operation, found the opposite after"),
    ];
    for (condition, text) in cases {
        let (step, found) = fail(vec![Step::Dwell { seconds: 0.01 }, expect(condition, 50)]);
        let found = found.replace("found axis 1: ", "found ");
        assert!(step == 1 && found.starts_with(text), "{found}");
    }
}

#[test]
fn attributes_are_expected_by_value() {
    let check = |value| ValueCheck { width: Width::F32, value: Number::Float(value), tolerance: 0.01 };
    let attribute = |value| Condition::Attribute {
        axis: 1,
        selector: AttributeSelector::scalar(441, 4),
        check: check(value),
    };
    run(vec![expect(attribute(80.0), 0)]);
    let (_, text) = fail(vec![expect(attribute(81.0), 30)]);
    assert!(text.starts_with("expected axis 1: attribute 441 81 within 0.01, found 80 after"), "{text}");
    let unknown =
        Condition::Attribute { axis: 1, selector: AttributeSelector::scalar(9999, 4), check: check(0.0) };
    let (_, text) = fail(vec![expect(unknown, 0)]);
    assert!(text.contains("found status 0x14 (attribute not supported)"), "{text}");
}

#[test]
fn cyclic_lists_are_agreed_used_and_handed_over() {
    let real = |value: f32| CyclicAttribute { id: 441, element_size: 4, value: value.to_le_bytes().to_vec() };
    let byte = |value| CyclicAttribute { id: 610, element_size: 1, value: vec![value] };
    let write = |attributes| Step::CyclicList { axis: 1, direction: CyclicDirection::Write, attributes };
    let read = |attributes| Step::CyclicList { axis: 1, direction: CyclicDirection::Read, attributes };
    let seen = |attribute, width, value| {
        let check = ValueCheck { width, value, tolerance: 0.0 };
        expect(Condition::CyclicRead { axis: 1, attribute, check }, 200)
    };
    let (pair, _) = run(vec![
        write(vec![byte(2), real(55.5)]),
        read(vec![real(0.0)]),
        seen(441, Width::F32, Number::Float(55.5)),
        Step::CyclicWrite { axis: 1, values: vec![(441, 66.5_f32.to_le_bytes().to_vec())] },
        seen(441, Width::F32, Number::Float(66.5)),
        // Another list takes over while the first one is in use.
        read(vec![byte(0), real(0.0)]),
        seen(610, Width::U8, Number::Integer(2)),
        Step::Enable(ONE),
        go(1.0),
        seen(441, Width::F32, Number::Float(66.5)),
    ]);
    assert!(pair.log().contains("axis 1: cyclic list in use as block 2"), "{}", pair.log());
    let (step, text) =
        fail(vec![read(vec![CyclicAttribute { id: 9999, element_size: 4, value: vec![0; 4] }])]);
    assert_eq!(step, 0);
    assert_eq!(text, "axis 1: attribute 9999 refused with status 0x14 (attribute not supported)");
    let (_, text) = fail(vec![Step::CyclicWrite { axis: 1, values: vec![(441, vec![0; 4])] }]);
    assert_eq!(text, "axis 1: attribute 441 is not in the cyclic list with this length");
}

#[test]
fn services_and_explicit_messages_go_beside_the_program() {
    let explicit = |service, attribute, data: &[u8], status| Step::Explicit {
        message: ExplicitMessage { service, class: 0x42, instance: 1, attribute, data: data.to_vec() },
        status,
    };
    let raw = |service, data: &[u8], status| Step::Service {
        axis: 1,
        service: MotionService(service),
        data: data.to_vec(),
        status,
    };
    let (pair, report) = run(vec![
        explicit(0x10, Some(441), &12.5_f32.to_le_bytes(), Some(0)),
        Step::Enable(ONE),
        explicit(0x0E, Some(441), &[], Some(0)),
        explicit(0x0E, Some(9999), &[], Some(0x14)),
        raw(0x7F, &[1, 2, 3, 4], Some(0x08)),
        // Get_Axis_Attributes_List by hand: one attribute, 441, one element of four bytes.
        raw(0x4B, &[1, 0, 0, 0, 0xB9, 1, 0, 4], Some(0)),
        go(1.0),
    ]);
    assert_good(&report, &pair);
    let answers: Vec<_> = pair
        .events
        .iter()
        .filter_map(|event| match event {
            Event::ExplicitAnswered { status, data, .. } => Some((*status, data.clone())),
            Event::ServiceAnswered { status, data, .. } => Some((*status, data.clone())),
            _ => None,
        })
        .collect();
    assert_eq!(answers[1], (0, 12.5_f32.to_le_bytes().to_vec()));
    assert_eq!(answers[4].1, [[1, 0, 0, 0, 0xB9, 1, 0, 4], [0, 0, 0x48, 0x41, 0, 0, 0, 0]].concat()[..12]);
    let (step, text) = fail(vec![raw(0x7F, &[], Some(0))]);
    assert_eq!(step, 0);
    assert!(text.starts_with("service 0x7f: expected status 0x00 (success), found status 0x08"), "{text}");
}

#[test]
fn limits_hold_before_and_while_moving() {
    let mut config = configured(1);
    config.axes[0].limits = AxisLimits { position: Some((-1.0, 2.0)), ..AxisLimits::default() };
    // Where a relative move ends is known only when it begins.
    let relative = Step::MoveRelative { axis: 1, distance: 1.5, limits: LIMITS };
    let program = vec![Step::Enable(ONE), relative.clone(), relative];
    let (step, text) = fail_with(config.clone(), program);
    assert_eq!((step, text.as_str()), (2, "axis 1: position 3 is beyond the limit 2"));
    // Velocity control knows no end: the last look at each command stops it.
    let run_at = Step::RunAt { axis: 1, velocity: 5.0, acceleration: 500.0, jerk: 10_000.0 };
    let program = vec![Step::Enable(ONE), mode(ControlMode::VELOCITY), run_at, Step::Dwell { seconds: 5.0 }];
    let mut pair = Pair::new(config, &[0.0], program);
    let report = pair.run(60);
    let text = report.failure.unwrap().to_string();
    assert!(text.starts_with("axis 1: position 2.0"), "{text}");
    let end = pair.plants[0].position / COUNTS_PER_UNIT;
    assert!((2.0..2.4).contains(&end), "{end}");
}

#[test]
fn an_axis_of_unknown_scaling_is_enabled_and_watched_but_not_moved() {
    let mut config = configured(1);
    config.axes[0].scaling = Scaling::Unknown;
    let (pair, report) = run_with(config.clone(), vec![Step::Enable(ONE), Step::Disable(ONE)]);
    assert_good(&report, &pair);
    let error = crate::controller::Controller::new(config.clone(), vec![go(1.0)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "step 0: axis 1: does not move, because the counts of its unit are not known"
    );
    let (_, text) = fail_with(config.clone(), vec![position(0.0)]);
    assert!(text.contains("does not move"), "{text}");
    // The device of these tests does not scale.
    config.axes[0].scaling = Scaling::Device;
    let (_, text) = fail_with(config, vec![]);
    assert_eq!(text, "axis 1: expected the device to scale (attribute 45 is 1), found no such attribute");
}

#[test]
fn a_fault_that_nothing_expects_is_found_at_the_end() {
    let program = vec![Step::Enable(ONE), Step::Dwell { seconds: 0.3 }, expect(Condition::NoFault, 0)];
    let mut pair = Pair::new(configured(1), &[0.0], program);
    pair.script = Box::new(|report, plants| {
        if report.steps_finished == 1 && report.axes[0].faults.total == 0 {
            plants[0].fault = Some(drive_fault(11, 0, 0x22));
        }
    });
    let text = pair.run(30).failure.unwrap().to_string();
    assert!(
        text.starts_with("expected no fault that nothing expected, found axis 1: Axis Fault code 11"),
        "{text}"
    );
}

#[test]
fn an_interrupted_run_ends_on_the_ramp_and_disabled() {
    for program in [
        vec![Step::Enable(ONE), go(50.0)],
        vec![
            Step::Enable(ONE),
            mode(ControlMode::VELOCITY),
            Step::RunAt { axis: 1, velocity: 20.0, acceleration: 500.0, jerk: 10_000.0 },
            Step::Dwell { seconds: 60.0 },
        ],
    ] {
        let mut pair = Pair::new(configured(1), &[0.0], program);
        pair.interrupt_at = Some(1_000_000_000);
        let report = pair.run(60);
        assert_eq!(report.failure, Some(Failure::Interrupted), "{}", pair.log());
        use AxisStateCode as S;
        assert_eq!(report.axes[0].states.kept().last(), Some(&S::STOPPED));
        assert_eq!((report.axes[0].faults.total, pair.device.connection()), (0, None), "closed orderly");
        // 500 units/s² for an update of 2 ms change the velocity by 1 unit/s, 0.25 counts a drive cycle; a jump from
        // full speed would be 5.
        let jump = pair.plants[0].brake_max;
        assert!(jump < 0.3, "{jump} counts of change between two drive cycles");
    }
}

#[test]
fn figures_of_the_traffic_are_kept() {
    let (_, report) = run(vec![Step::Dwell { seconds: 0.5 }]);
    assert!(report.interval.count > 200 && report.round_trip.count > 200, "{report}");
    let period = DurationNs::from_millis(2);
    assert!((report.interval.mean() - period).magnitude() < 50_000, "{}", report.interval);
    assert!(report.round_trip.min.0 > 0 && report.round_trip.max < period * 3, "{}", report.round_trip);
}
