//! A device with one axis over the fixed connection format: 16 octets each way, services beside it.

use axisbridge_tests::rig::motion::{NANO, TURNTABLE, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::condition::{Condition, FaultPattern};
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{AxisSet, ControllerConfig, Misbehaviour, Report, Step};
use profile_cip::wire::motion::codes::{AxisStateCode, CommandTarget, ControlMode, FaultType, NodeFault};
use profile_generic::fault::FaultCause;
use profile_generic::time::DurationNs;

const ONE: AxisSet = AxisSet::NONE.with(1);

fn rig() -> Rig {
    Rig::ready(Settings::fixed())
}

fn config(rig: &Rig, mode: ControlMode) -> ControllerConfig {
    let mut config = rig.controller_config();
    config.axes[0].control_mode = mode;
    config.axes[0].sets = DataSets::fixed(mode);
    config
}

fn run_at(velocity: f64) -> Step {
    Step::RunAt { axis: 1, velocity, acceleration: 4.0, jerk: 400.0 }
}

fn go(position: f64) -> Step {
    Step::MoveAbsolute { axis: 1, position, limits: TURNTABLE }
}

fn expect(condition: Condition) -> Step {
    Step::Expect { condition, within: DurationNs::from_millis(500) }
}

fn close(value: i64, wanted: i64, within: i64) -> bool {
    (value - wanted).abs() < within
}

/// Runs a program in position control that has to succeed.
fn run(program: Vec<Step>) -> (Rig, Report) {
    let mut rig = rig();
    rig.connect(program);
    let report = rig.run(millis(60_000));
    let at = report.failed_step;
    assert_eq!(report.failure, None, "step {at:?}\n{}\n{}", rig.log(), rig.told());
    assert!(rig.torque_free());
    (rig, report)
}

#[test]
fn a_connection_of_another_size_is_refused() {
    let mut rig = rig();
    let variable = {
        let mut config = ControllerConfig::new(None, rig.controller_config().axes);
        config.axes[0].sets = DataSets::default();
        config
    };
    rig.connect_with(variable, vec![]);
    let text = rig.run(millis(1_000)).failure.expect("a refusal").to_string();
    assert!(text.contains("0x011f") || text.contains("0x0120"), "the size type: {text}");
}

#[test]
fn an_axis_runs_in_velocity_control_and_stops_when_the_controller_vanishes() {
    let mut rig = rig();
    let config = config(&rig, ControlMode::VELOCITY);
    let velocity = Condition::Velocity { axis: 1, velocity: 2.0, tolerance: 0.02 };
    rig.connect_with(
        config,
        vec![
            Step::Enable(ONE),
            run_at(2.0),
            expect(velocity),
            Step::Misbehave(Misbehaviour::Vanish),
            Step::Dwell { seconds: 10.0 },
        ],
    );
    let steps = |rig: &Rig| rig.report().steps_finished;
    rig.run_until(millis(20_000), "the vanishing", |rig| steps(rig) == 4);
    assert!(close(rig.velocity(0), 2 * NANO, NANO / 50), "{}", rig.velocity(0));
    // Nothing comes any more.
    let stop = rig.run_until(DurationNs::from_secs(3), "rest", Rig::torque_free);
    assert!(stop < DurationNs::from_millis(1500), "{stop}");
    assert!(close(rig.velocity(0), 0, NANO / 100), "{}", rig.velocity(0));
}

#[test]
fn an_axis_moves_half_a_revolution_in_position_control() {
    let from = rig().position(0);
    for target in [CommandTarget::INTERPOLATE, CommandTarget::EXTRAPOLATE, CommandTarget::IMMEDIATE] {
        let mut rig = rig();
        let mut config = rig.controller_config();
        config.command_target = target;
        rig.connect_with(
            config,
            vec![
                Step::Enable(ONE),
                go(0.5),
                Step::WaitInWindow { axis: 1, window: 0.0001, seconds: 1.0 },
                Step::Dwell { seconds: 0.2 },
                Step::Disable(ONE),
            ],
        );
        rig.run_until(millis(20_000), "the end of the wait", |rig| rig.report().steps_finished == 4);
        let moved = rig.position(0) - from;
        assert!((moved - NANO / 2).abs() < NANO / 10_000, "{target}: {moved}");
        let report = rig.run(millis(10_000));
        assert_eq!(report.failure, None, "{target}\n{}\n{}", rig.log(), rig.told());
        assert_eq!(report.axes[0].state, Some(AxisStateCode::STOPPED));
        assert!(report.axes[0].following_error_max < 0.1, "{target}: {report}");
        assert!(rig.torque_free());
    }
}

#[test]
fn a_fault_of_the_drive_is_read_by_a_service_and_reset() {
    let pattern =
        |fault_type, code| FaultPattern { fault_type: Some(fault_type), code: Some(code), sub_code: None };
    // The drive has an error; then which one.
    let (undiagnosed, overcurrent) = (pattern(FaultType::AXIS_MFG, 1), pattern(FaultType::AXIS, 10));
    let mut rig = rig();
    rig.connect(vec![
        Step::Enable(ONE),
        expect(Condition::Fault { axis: 1, pattern: undiagnosed }),
        expect(Condition::Fault { axis: 1, pattern: overcurrent }),
        Step::FaultReset(ONE),
        Step::Enable(ONE),
        go(0.25),
        Step::Disable(ONE),
        Step::Expect { condition: Condition::NoFault, within: DurationNs::ZERO },
    ]);
    rig.run_until(millis(20_000), "the axis enabled", |rig| rig.report().steps_finished == 1);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    rig.run_until(millis(1_000), "the fault told", |rig| rig.report().steps_finished == 3);
    rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "step {:?}\n{}\n{}", report.failed_step, rig.log(), rig.told());
    assert_eq!(report.axes[0].faults.kept().iter().map(|fault| fault.code).collect::<Vec<_>>(), [1, 10]);
    assert!(rig.velocity(0).abs() < NANO / 100);
}

#[test]
fn broken_updates_stop_the_axis_and_it_comes_back() {
    let wrong = vec![
        Step::Enable(ONE),
        go(1.0),
        Step::Misbehave(Misbehaviour::Truncate { bytes: 2, updates: 1 }),
        expect(Condition::NodeFault(NodeFault::DATA_FORMAT)),
        expect(Condition::State { axis: 1, state: AxisStateCode::MAJOR_FAULTED }),
        Step::NodeFaultReset,
        Step::FaultReset(ONE),
        Step::Enable(ONE),
        go(0.0),
        Step::Disable(ONE),
    ];
    let (_, report) = run(wrong);
    assert_eq!(report.node_fault, Some(NodeFault::DATA_FORMAT));
}
