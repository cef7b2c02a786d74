//! The fixed connection format against the device role of this crate: one axis, 18 bytes each way, services beside it.

use super::against_device::{Pair, configured, drive_fault};
use super::features::{expect, state};
use super::rig::COUNTS_PER_UNIT;
use crate::controller::condition::{AlarmPattern, Condition, FaultPattern, Number, ValueCheck};
use crate::controller::limits::AxisLimits;
use crate::controller::program::{CyclicDirection, ExplicitMessage, Redefine};
use crate::controller::sets::DataSets;
use crate::controller::{
    AttributeSet, AxisSet, AxisSetup, ControllerConfig, Event, Limits, Misbehaviour, Report, Step,
};
use crate::device::attribute::id;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{
    ActualDataSet, AxisIoStatus, AxisStateCode, AxisStatus, CommandDataSet, CommandTarget, ControlMode,
    EventChecking, EventType, FaultType, FeedbackMode, MotionService, NodeAlarm, NodeFault, StatusDataSet,
    TimeDataSet,
};
use profile_generic::program::Width;
use profile_generic::time::DurationNs;

const LIMITS: Limits = Limits { velocity: 20.0, acceleration: 500.0, jerk: 10_000.0 };
const ONE: AxisSet = AxisSet::NONE.with(1);

/// A configuration for an axis that begins in this mode.
fn in_mode(mode: ControlMode) -> ControllerConfig {
    let mut config = configured(1);
    config.set_fixed();
    config.axes[0].control_mode = mode;
    config.axes[0].sets = DataSets::fixed(mode);
    config
}

fn go(position: f64) -> Step {
    Step::MoveAbsolute { axis: 1, position, limits: LIMITS }
}

fn run_at(velocity: f64) -> Step {
    Step::RunAt { axis: 1, velocity, acceleration: 200.0, jerk: 5000.0 }
}

fn mode(mode: ControlMode) -> Step {
    Step::Mode { axis: 1, mode }
}

fn sets(mode: ControlMode) -> Step {
    Step::DataSets { axis: 1, sets: DataSets::fixed(mode) }
}

fn attribute(id: u16, width: Width, value: i64) -> Condition {
    let size = u8::try_from(width.bytes()).unwrap();
    let check = ValueCheck { width, value: Number::Integer(value), tolerance: 0.0 };
    Condition::Attribute { axis: 1, selector: AttributeSelector::scalar(id, size), check }
}

fn run_with(config: ControllerConfig, program: Vec<Step>) -> (Pair, Report) {
    let mut pair = Pair::new(config, &[4321.0], program);
    let report = pair.run(60);
    assert_eq!(report.failure, None, "step {:?}\n{}", report.failed_step, pair.log());
    assert_eq!(pair.device.connection(), None, "closed");
    (pair, report)
}

fn run(program: Vec<Step>) -> (Pair, Report) {
    run_with(in_mode(ControlMode::POSITION), program)
}

fn fail_with(config: ControllerConfig, program: Vec<Step>) -> (usize, String) {
    let mut pair = Pair::new(config, &[4321.0], program);
    let report = pair.run(60);
    assert_eq!(pair.device.connection(), None, "closed behind the failure");
    (report.failed_step.unwrap_or(usize::MAX), report.failure.expect("a failure").to_string())
}

#[test]
fn a_whole_run_in_position_control() {
    let (pair, report) = run(vec![
        Step::Enable(ONE),
        go(12.5),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
        Step::Jog { axis: 1, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.3 },
        go(0.0),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
        Step::Disable(ONE),
    ]);
    assert_eq!(pair.device.counters().malformed, 0, "{:?}", pair.device.last_error());
    assert!(!report.synchronous);
    let axis = &report.axes[0];
    assert_eq!((axis.commanded, axis.reached), (Some(0.0), Some(0.0)));
    assert_eq!((report.lost_updates, report.malformed, report.device_lost_updates), (0, 0, 0), "{report}");
    assert!(report.interval.count > 1_000 && report.round_trip.count == 0, "no update says what it answers");
    use AxisStateCode as S;
    assert_eq!(
        axis.states.kept(),
        [S::INITIALIZING, S::STOPPED, S::STARTING, S::RUNNING, S::STOPPING, S::STOPPED]
    );
    insta::assert_snapshot!(pair.log());
}

#[test]
fn velocity_and_torque_control_with_the_velocity_as_actual_value() {
    let (pair, report) = run_with(
        in_mode(ControlMode::VELOCITY),
        vec![
            Step::Enable(ONE),
            run_at(10.0),
            Step::Dwell { seconds: 0.2 },
            expect(Condition::Velocity { axis: 1, velocity: 10.0, tolerance: 0.1 }, 100),
            run_at(-5.0),
            expect(Condition::Velocity { axis: 1, velocity: -5.0, tolerance: 0.1 }, 100),
            Step::Stop { axis: 1, acceleration: 200.0, jerk: 5000.0 },
            mode(ControlMode::TORQUE),
            Step::Torque { axis: 1, torque: 4.0, rate: 40.0, velocity_limit: 20.0 },
            expect(Condition::Mode { axis: 1, mode: ControlMode::TORQUE }, 0),
            expect(Condition::Velocity { axis: 1, velocity: 4.0, tolerance: 0.1 }, 100),
            mode(ControlMode::VELOCITY),
            expect(Condition::Velocity { axis: 1, velocity: 0.0, tolerance: 0.1 }, 2_000),
            Step::Disable(ONE),
        ],
    );
    assert_eq!(report.axes[0].reached, None, "nobody has told the position");
    assert!(pair.plants[0].position > 4321.0 + COUNTS_PER_UNIT);
}

#[test]
fn an_axis_in_torque_control_that_races_loses_its_torque() {
    let config = in_mode(ControlMode::TORQUE);
    let torque = Step::Torque { axis: 1, torque: 40.0, rate: 100.0, velocity_limit: 5.0 };
    let (step, text) = fail_with(config, vec![Step::Enable(ONE), torque]);
    assert_eq!(step, 1);
    assert!(text.starts_with("axis 1: velocity in torque control 5."), "{text}");
}

#[test]
fn the_actual_value_changes_between_motions_and_never_blinds_position_control() {
    let (_, report) = run_with(
        in_mode(ControlMode::VELOCITY),
        vec![
            Step::Enable(ONE),
            run_at(10.0),
            Step::Stop { axis: 1, acceleration: 200.0, jerk: 5000.0 },
            sets(ControlMode::POSITION),
            mode(ControlMode::POSITION),
            go(3.0),
            Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
            mode(ControlMode::VELOCITY),
            sets(ControlMode::VELOCITY),
            run_at(2.0),
            expect(Condition::Velocity { axis: 1, velocity: 2.0, tolerance: 0.1 }, 100),
        ],
    );
    assert_eq!(report.axes[0].reached, Some(3.0));
    let blind = "axis 1: expected the position as actual value, which position control needs";
    let velocity = || in_mode(ControlMode::VELOCITY);
    let failures = [
        (velocity(), vec![mode(ControlMode::POSITION)], 0, blind),
        (velocity(), vec![Step::Enable(ONE), mode(ControlMode::POSITION)], 1, blind),
        (in_mode(ControlMode::POSITION), vec![sets(ControlMode::VELOCITY)], 0, blind),
        (in_mode(ControlMode::POSITION), vec![Step::Enable(ONE), sets(ControlMode::VELOCITY)], 1, blind),
        (
            velocity(),
            vec![Step::Enable(ONE), run_at(5.0), sets(ControlMode::POSITION)],
            2,
            "axis 1: a motion is under way already",
        ),
    ];
    for (config, program, step, text) in failures {
        assert_eq!(fail_with(config, program), (step, text.to_owned()));
    }
}

#[test]
fn the_position_reference_changes_at_standstill() {
    let redefine = || Step::RedefinePosition { axis: 1, change: Redefine::To(100.0) };
    let (pair, report) = run(vec![
        redefine(),
        Step::Enable(ONE),
        go(101.0),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
        Step::Disable(ONE),
    ]);
    assert_eq!(report.axes[0].reached, Some(101.0));
    assert!((pair.plants[0].position - 4321.0 - COUNTS_PER_UNIT).abs() < 1.0, "{}", pair.plants[0].position);
    let (step, text) = fail_with(in_mode(ControlMode::POSITION), vec![Step::Enable(ONE), redefine()]);
    assert_eq!(step, 1);
    let expected =
        "the fixed connection format has room for a Position Displacement only while the axis is not Running";
    assert_eq!(text, expected);
}

#[test]
fn services_are_explicit_messages_and_share_the_stream_with_those_of_the_program() {
    let message = ExplicitMessage { service: 0x0E, class: 1, instance: 1, attribute: Some(7), data: vec![] };
    let mut config = in_mode(ControlMode::POSITION);
    config.axes[0].attributes.push(AttributeSet::usint(9999, 1).optional());
    // More than one message has room for.
    let many: Vec<_> = core::iter::repeat_n(AttributeSelector::scalar(441, 4), 100).collect();
    let (pair, _) = run_with(
        config,
        vec![
            Step::Together(vec![
                Step::ReadAttributes { axis: 1, attributes: many },
                Step::Explicit { message: message.clone(), status: Some(0) },
                Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::usint(610, 0)] },
            ]),
            expect(attribute(610, Width::U8, 0), 100),
            Step::Service {
                axis: 1,
                service: MotionService::SET_CYCLIC_READ_LIST,
                data: vec![],
                status: None,
            },
            Step::Target(CommandTarget::EXTRAPOLATE),
            expect(attribute(id::COMMAND_CONTROL, Width::U8, 0b0101), 100),
        ],
    );
    let log = pair.log();
    assert!(
        log.contains("axis 1: attribute 9999 refused with status 0x14 (attribute not supported)"),
        "{log}"
    );
    let read = pair.events.iter().find_map(|event| match event {
        Event::AttributesRead { instance: 1, values } => Some(values.clone()),
        _ => None,
    });
    let values = read.expect("an answer");
    let wanted = Ok(80.0_f32.to_le_bytes().to_vec());
    assert!(values.len() == 100 && values.iter().all(|row| row.value == wanted), "{values:?}");
    assert!(log.contains("explicit service 0x0e: status 0x00"), "{log}");
}

#[test]
fn a_fault_of_the_axis_is_read_expected_and_reset() {
    let pattern = |code| FaultPattern { fault_type: Some(FaultType::AXIS), code: Some(code), sub_code: None };
    let cleared = FaultPattern { fault_type: Some(FaultType::CLEARED), ..FaultPattern::default() };
    let program = vec![
        Step::Enable(ONE),
        expect(Condition::Fault { axis: 1, pattern: pattern(34) }, 1_000),
        state(AxisStateCode::MAJOR_FAULTED),
        Step::FaultReset(ONE),
        expect(Condition::Fault { axis: 1, pattern: cleared }, 500),
        Step::Enable(ONE),
        go(5.0),
        expect(Condition::NoFault, 0),
    ];
    let mut pair = Pair::new(in_mode(ControlMode::POSITION), &[0.0], program);
    let mut raised = false;
    pair.script = Box::new(move |report, plants| {
        if report.steps_finished == 1 && !core::mem::replace(&mut raised, true) {
            plants[0].fault = Some(drive_fault(34, 2, 0x22));
        }
    });
    let report = pair.run(60);
    assert_eq!(report.failure, None, "step {:?}\n{}", report.failed_step, pair.log());
    let fault = report.axes[0].faults.kept()[0];
    assert_eq!((fault.code, fault.sub_code, fault.action, report.axes[0].faults.total), (34, 2, 0x22, 1));
}

#[test]
fn a_fault_that_ends_the_run_is_named_in_the_report_and_none_passes_unseen() {
    let faulty = |program: Vec<Step>, at: usize| {
        let mut pair = Pair::new(in_mode(ControlMode::POSITION), &[0.0], program);
        let mut raised = false;
        pair.script = Box::new(move |report, plants| {
            if report.steps_finished == at && !core::mem::replace(&mut raised, true) {
                plants[0].fault = Some(drive_fault(34, 2, 0x22));
            }
        });
        let report = pair.run(60);
        assert_eq!(report.axes[0].faults.kept().first().map(|fault| fault.code), Some(34), "{}", pair.log());
        report.failure.expect("a failure").to_string()
    };
    let text = faulty(vec![Step::Enable(ONE), go(50.0)], 1);
    assert!(text.starts_with("axis 1: expected state Running, found state "), "{text}");
    // The update that tells of the fault comes with the last moment of the program.
    let text =
        faulty(vec![Step::Enable(ONE), state(AxisStateCode::ABORTING), expect(Condition::NoFault, 0)], 1);
    assert!(text.contains("found axis 1: Axis Fault code 34 sub code 2"), "{text}");
}

#[test]
fn updates_that_are_lost_late_doubled_or_swapped_are_ridden_through() {
    let kinds = [
        Misbehaviour::SkipUpdates { updates: 3 },
        Misbehaviour::Delay { by: DurationNs::from_millis(3), updates: 3 },
        Misbehaviour::Duplicate { updates: 20 },
        Misbehaviour::Reorder { pairs: 5 },
        Misbehaviour::WrongSequence { back: 100, updates: 2 },
        Misbehaviour::WrongUpdateId { back: 3, updates: 2 },
    ];
    for kind in kinds {
        let program = vec![
            Step::Enable(ONE),
            Step::Together(vec![
                go(10.0),
                Step::Sequence(vec![Step::Dwell { seconds: 0.05 }, Step::Misbehave(kind)]),
            ]),
            expect(Condition::NoFault, 0),
        ];
        let (pair, report) = run(program);
        assert_eq!(report.axes[0].reached, Some(10.0), "{kind}");
        if kind == (Misbehaviour::SkipUpdates { updates: 3 }) {
            assert_eq!(pair.device.counters().lost_updates, 3);
        }
    }
}

#[test]
fn what_a_device_cannot_ride_through_is_a_fault_of_the_node_or_the_axis() {
    let node = |fault| Condition::NodeFault(fault);
    let axis = |code| {
        let pattern = FaultPattern { fault_type: Some(FaultType::AXIS), code: Some(code), sub_code: None };
        Condition::Fault { axis: 1, pattern }
    };
    let update = node(NodeFault::CONNECTION_UPDATE);
    let cases: Vec<(Misbehaviour, Condition, Vec<Step>)> = vec![
        (Misbehaviour::SkipUpdates { updates: 6 }, update, vec![Step::Reconnect]),
        (Misbehaviour::WrongUpdateId { back: 20, updates: 7 }, update, vec![Step::Reconnect]),
        (
            Misbehaviour::Truncate { bytes: 5, updates: 1 },
            node(NodeFault::DATA_FORMAT),
            vec![Step::NodeFaultReset, Step::FaultReset(ONE)],
        ),
        (Misbehaviour::OmitSetPoint { axes: ONE, updates: 1 }, axis(60), vec![Step::FaultReset(ONE)]),
        (Misbehaviour::WrongMode { axes: ONE, mode: 3, updates: 1 }, axis(60), vec![Step::FaultReset(ONE)]),
    ];
    for (kind, condition, recovery) in cases {
        let mut program = vec![
            Step::Enable(ONE),
            Step::Misbehave(kind),
            expect(condition, 500),
            state(AxisStateCode::MAJOR_FAULTED),
        ];
        if matches!(condition, Condition::NodeFault(_)) {
            // The axis reports the fault of its node as its own.
            program.push(Step::Dwell { seconds: 0.05 });
        }
        program.extend(recovery);
        program.push(state(AxisStateCode::STOPPED));
        program.extend([Step::Enable(ONE), go(6.0), Step::Disable(ONE)]);
        let (_, report) = run(program);
        assert_eq!(report.axes[0].reached, Some(6.0), "{kind}");
        if let Condition::NodeFault(fault) = condition {
            assert_eq!(report.node_fault, Some(fault), "{kind}");
        }
    }
}

#[test]
fn a_controller_that_vanishes_or_loses_its_stream() {
    let (pair, report) = run(vec![
        Step::Enable(ONE),
        Step::Misbehave(Misbehaviour::Vanish),
        expect(Condition::ConnectionLost, 500),
        Step::Reconnect,
        state(AxisStateCode::STOPPED),
        Step::Enable(ONE),
        go(7.0),
        Step::Disable(ONE),
    ]);
    assert_eq!(report.axes[0].reached, Some(7.0));
    assert_eq!(pair.device.counters().connection_losses, 1);
    // The motion connection outlives the stream; services do not.
    let dropped = |then: Vec<Step>| {
        let mut program = vec![Step::Enable(ONE), Step::Misbehave(Misbehaviour::DropTcp)];
        program.extend(then);
        program
    };
    let mut pair = Pair::new(
        in_mode(ControlMode::POSITION),
        &[0.0],
        dropped(vec![
            Step::Dwell { seconds: 0.2 },
            go(1.0),
            Step::Disable(ONE),
            expect(Condition::NoFault, 0),
        ]),
    );
    let report = pair.run(60);
    assert_eq!((report.failure, report.axes[0].reached), (None, Some(1.0)), "{}", pair.log());
    let read = Step::ReadAttributes { axis: 1, attributes: vec![AttributeSelector::scalar(650, 1)] };
    let mut pair =
        Pair::new(in_mode(ControlMode::POSITION), &[0.0], dropped(vec![Step::Dwell { seconds: 0.1 }, read]));
    let text = pair.run(60).failure.expect("a failure").to_string();
    assert!(text.contains("no answer within 5 s"), "{text}");
}

#[test]
fn a_step_that_the_format_cannot_carry_is_found_before_anything_is_sent() {
    let config = in_mode(ControlMode::POSITION);
    let good = DataSets::fixed(ControlMode::POSITION);
    let with = |change: fn(&mut DataSets)| {
        let mut sets = good;
        change(&mut sets);
        Step::DataSets { axis: 1, sets }
    };
    let on = true;
    let check = ValueCheck { width: Width::U8, value: Number::Integer(0), tolerance: 0.0 };
    let bits = (AxisStatus::empty(), AxisIoStatus::empty());
    let checking = EventChecking::REG_1_POSITIVE;
    let pattern = AlarmPattern::default();
    let service = MotionService::GROUP_SYNC;
    let age = DurationNs::from_millis(5);
    let bad = [
        (
            Step::CyclicList { axis: 1, direction: CyclicDirection::Read, attributes: vec![] },
            "no cyclic write and read data",
        ),
        (Step::CyclicWrite { axis: 1, values: vec![] }, "no cyclic write and read data"),
        (
            expect(Condition::CyclicRead { axis: 1, attribute: 650, check }, 0),
            "no cyclic write and read data",
        ),
        (Step::ArmEvents { axis: 1, checking, parameters: None }, "no events"),
        (Step::DisarmEvents { axis: 1, checking }, "no events"),
        (
            expect(
                Condition::Event { axis: 1, event_type: EventType::REGISTRATION_1_POSITIVE, position: None },
                0,
            ),
            "no events",
        ),
        (Step::TimeData(TimeDataSet::empty()), "no time data"),
        (Step::Service { axis: 0, service, data: vec![0; 8], status: None }, "no time synchronization"),
        (expect(Condition::Synchronous(true), 0), "no time synchronization"),
        (Step::Feedback { axis: 1, mode: FeedbackMode(2).with_lint(true) }, "Actual Position as DINT only"),
        (Step::Misbehave(Misbehaviour::StaleTimeStamp { age, updates: 1 }), "no time stamps"),
        (
            expect(Condition::Status { axis: 1, bits: bits.0, on }, 0),
            "no status data; expect Axis Status (651) or Axis I/O Status (653) as an attribute",
        ),
        (
            expect(Condition::IoStatus { axis: 1, bits: bits.1, on }, 0),
            "no status data; expect Axis Status (651) or Axis I/O Status (653) as an attribute",
        ),
        (
            expect(Condition::Alarm { axis: 1, pattern }, 0),
            "no alarm records; expect Axis Alarms (659) as an attribute",
        ),
        (
            expect(Condition::NodeAlarm(NodeAlarm::NONE), 0),
            "no node alarms; expect Node Alarm Code (17) as an attribute of the class",
        ),
        (
            expect(Condition::LostUpdates(1), 0),
            "no diagnostics; expect Lost Controller Updates as an attribute of the class",
        ),
        (
            expect(Condition::LateUpdates(1), 0),
            "no diagnostics; expect Late Controller Updates as an attribute of the class",
        ),
        (
            with(|sets| sets.command = CommandDataSet::VELOCITY),
            "room for one command value, which is that of the control mode",
        ),
        (with(|sets| sets.integer_position = false), "Command Position as DINT only"),
        (with(|sets| sets.status = StatusDataSet::FAULT), "no status data"),
        (
            with(|sets| sets.actual |= ActualDataSet::VELOCITY),
            "room for one actual value: the position or the velocity, so that the axis is seen",
        ),
    ];
    for (step, text) in bad {
        let expected = format!("the fixed connection format has {text}");
        assert_eq!(step.check(&config).unwrap_err().to_string(), expected, "{step}");
        let inside = Step::Together(vec![Step::Sequence(vec![step.clone()])]);
        assert_eq!(inside.check(&config).unwrap_err().to_string(), expected, "{step}");
        let variable = configured(1);
        assert_eq!(step.check(&variable), Ok(()), "the variable format has it: {step}");
    }
    assert_eq!(with(|_| ()).check(&config), Ok(()));
    let mut limited = in_mode(ControlMode::POSITION);
    limited.axes[0].limits = AxisLimits { position: Some((-1.0, 1.0)), ..AxisLimits::default() };
    let blind = sets(ControlMode::VELOCITY).check(&limited).unwrap_err().to_string();
    assert!(blind.ends_with("one actual value: with position limits it has to be the position"), "{blind}");
}

#[test]
fn a_configuration_that_the_format_cannot_carry_is_refused() {
    let good = ControllerConfig::fixed(AxisSetup::position(1000.0));
    assert_eq!(good.check(), Ok(()));
    assert_eq!((good.connection_size, good.grand_master), (18, None));
    type Spoil = fn(&mut ControllerConfig);
    let broken: [(Spoil, &str); 9] = [
        (|c| c.axes.push(c.axes[0].clone()), "room for one axis"),
        (|c| c.grand_master = Some([0; 8]), "no time stamps, and so no grand master"),
        (|c| c.connection_size = 16, "a connection size of 18 bytes"),
        (|c| c.axes[0].unwind = Some(360), "no room for an Unwind Cycle Count"),
        (|c| c.axes[0].feedback_mode = FeedbackMode(2).with_lint(true), "Actual Position as DINT only"),
        (|c| c.axes[0].sets.integer_position = false, "Command Position as DINT only"),
        (|c| c.axes[0].sets.status = StatusDataSet::ALARM, "no status data"),
        (
            |c| c.axes[0].sets.actual = ActualDataSet::ACCELERATION,
            "room for one actual value: the position or the velocity, so that the axis is seen",
        ),
        (
            |c| c.axes[0].sets.actual = ActualDataSet::VELOCITY,
            "one actual value: in position control it has to be the position",
        ),
    ];
    for (spoil, text) in broken {
        let mut config = good.clone();
        spoil(&mut config);
        assert_eq!(
            config.check().unwrap_err().to_string(),
            format!("the fixed connection format has {text}")
        );
    }
}

#[test]
fn a_device_of_the_other_format_refuses_the_connection() {
    let mut pair = Pair::new(configured(1), &[0.0], vec![]);
    pair.with_controller(in_mode(ControlMode::POSITION));
    let text = pair.run(10).failure.expect("a failure").to_string();
    assert!(text.starts_with("Forward_Open: refused with status 0x01"), "{text}");
    assert!(text.contains("0x011f"), "{text}");
}
