//! Each misbehaviour, and the standard fault that the device answers it with.

use super::against_device::{Pair, configured};
use super::features::{expect, state};
use crate::controller::condition::{Condition, FaultPattern};
use crate::controller::{AxisSet, ControllerConfig, Limits, Misbehaviour, Report, Step};
use crate::wire::motion::codes::{AxisStateCode, FaultType, NodeFault};
use profile_generic::time::DurationNs;

const LIMITS: Limits = Limits { velocity: 20.0, acceleration: 500.0, jerk: 10_000.0 };
const ONE: AxisSet = AxisSet::NONE.with(1);

fn misbehave(kind: Misbehaviour) -> Step {
    Step::Misbehave(kind)
}

fn node_fault(fault: NodeFault) -> Step {
    expect(Condition::NodeFault(fault), 500)
}

fn go(position: f64) -> Step {
    Step::MoveAbsolute { axis: 1, position, limits: LIMITS }
}

fn run(config: ControllerConfig, program: Vec<Step>) -> (Pair, Report) {
    let mut pair = Pair::new(config, &[0.0], program);
    let report = pair.run(60);
    assert_eq!(report.failure, None, "step {:?}\n{}", report.failed_step, pair.log());
    (pair, report)
}

/// Gets over a node fault by this step, and moves.
fn recover(by: Step) -> Vec<Step> {
    let reconnects = by == Step::Reconnect;
    vec![
        state(AxisStateCode::MAJOR_FAULTED),
        by,
        if reconnects { state(AxisStateCode::STOPPED) } else { Step::FaultReset(ONE) },
        Step::Enable(ONE),
        go(1.0),
        Step::Disable(ONE),
        expect(Condition::NoFault, 0),
    ]
}

/// A running axis, then this, then what follows.
fn running(kind: Misbehaviour, then: Vec<Step>) -> Vec<Step> {
    let mut program = vec![Step::Enable(ONE), misbehave(kind)];
    program.extend(then);
    program
}

#[test]
fn few_missing_updates_are_counted_and_many_are_a_fault() {
    let few = running(
        Misbehaviour::SkipUpdates { updates: 3 },
        vec![expect(Condition::LostUpdates(3), 100), go(1.0), expect(Condition::NoFault, 0)],
    );
    let (pair, report) = run(configured(1), few);
    assert_eq!(report.axes[0].reached, Some(1.0));
    assert_eq!(pair.device.counters().lost_updates, 3);
    // More than the Update Delay High Limit of 4, fewer than the time-out of 8.
    // It ends only with the connection, clause 6-2.7.1.1.
    let mut many = vec![node_fault(NodeFault::CONNECTION_UPDATE)];
    many.extend(recover(Step::Reconnect));
    run(configured(1), running(Misbehaviour::SkipUpdates { updates: 6 }, many));
}

#[test]
fn a_controller_that_vanishes_loses_its_connection_and_comes_back() {
    let (pair, report) = run(
        configured(1),
        running(
            Misbehaviour::Vanish,
            vec![
                expect(Condition::ConnectionLost, 500),
                Step::Reconnect,
                state(AxisStateCode::STOPPED),
                Step::Enable(ONE),
                go(2.0),
                Step::Disable(ONE),
            ],
        ),
    );
    assert_eq!(report.axes[0].reached, Some(2.0));
    assert_eq!(pair.device.counters().connection_losses, 1);
    assert_eq!(pair.device.connection(), None, "closed orderly in the end");
    assert!(pair.log().contains("connection lost\nstep 2 finished\nstep 3 started\nreconnecting\n"));
}

#[test]
fn a_loss_that_nothing_expects_is_a_failure() {
    let program = running(Misbehaviour::Vanish, vec![Step::Dwell { seconds: 1.0 }]);
    let mut pair = Pair::new(configured(1), &[0.0], program);
    let text = pair.run(60).failure.unwrap().to_string();
    assert!(text.starts_with("connection timed out from device to controller"), "{text}");
    let program = running(Misbehaviour::Vanish, vec![Step::Dwell { seconds: 0.5 }, go(1.0)]);
    let mut pair = Pair::new(configured(1), &[0.0], program);
    let report = pair.run(60);
    assert_eq!(report.failed_step, Some(3), "a step that needs the connection");
    let text = report.failure.unwrap().to_string();
    assert!(text.starts_with("connection timed out from device to controller"), "{text}");
}

#[test]
fn reconnecting_closes_what_is_open_first() {
    let (pair, report) = run(
        configured(1),
        vec![Step::Enable(ONE), go(1.0), Step::Disable(ONE), Step::Reconnect, Step::Enable(ONE), go(2.0)],
    );
    assert_eq!(report.axes[0].reached, Some(2.0));
    assert_eq!(pair.device.counters().connection_losses, 0);
}

#[test]
fn a_connection_update_fault_is_not_reset_by_node_fault_reset() {
    let reset = Step::Within { time_out: DurationNs::from_millis(200), step: Box::new(Step::NodeFaultReset) };
    let skip = Misbehaviour::SkipUpdates { updates: 6 };
    let mut pair = Pair::new(configured(1), &[0.0], running(skip, vec![reset]));
    let text = pair.run(60).failure.unwrap().to_string();
    assert_eq!(text, "node fault: Control Connection Update Fault");
}

#[test]
fn late_doubled_and_swapped_updates_are_ridden_through() {
    let kinds = [
        Misbehaviour::Delay { by: DurationNs::from_millis(3), updates: 3 },
        Misbehaviour::Duplicate { updates: 20 },
        Misbehaviour::Reorder { pairs: 5 },
        Misbehaviour::WrongSequence { back: 100, updates: 2 },
        Misbehaviour::WrongUpdateId { back: 3, updates: 2 },
        Misbehaviour::StaleTimeStamp { age: DurationNs::from_millis(3), updates: 2 },
    ];
    for kind in kinds {
        let program = vec![
            Step::Enable(ONE),
            Step::Together(vec![
                go(1.0),
                Step::Sequence(vec![Step::Dwell { seconds: 0.05 }, misbehave(kind)]),
            ]),
            expect(Condition::NoFault, 0),
        ];
        let (_, report) = run(configured(1), program);
        assert_eq!(report.axes[0].reached, Some(1.0), "{kind}");
    }
}

#[test]
fn updates_that_stay_broken_are_a_connection_update_fault() {
    let kinds = [
        Misbehaviour::WrongUpdateId { back: 20, updates: 7 },
        Misbehaviour::Delay { by: DurationNs::from_millis(13), updates: 7 },
    ];
    for kind in kinds {
        let mut then = vec![node_fault(NodeFault::CONNECTION_UPDATE)];
        then.extend(recover(Step::Reconnect));
        let (pair, _) = run(configured(1), running(kind, then));
        assert_eq!(pair.device.node_fault(), NodeFault::NONE, "{kind}");
    }
}

#[test]
fn a_truncated_update_is_a_data_format_error() {
    let mut then = vec![node_fault(NodeFault::DATA_FORMAT)];
    then.extend(recover(Step::NodeFaultReset));
    run(configured(1), running(Misbehaviour::Truncate { bytes: 5, updates: 1 }, then));
}

#[test]
fn an_update_without_its_set_point_and_one_with_another_mode_fault_the_axis() {
    let cases = [
        (Misbehaviour::OmitSetPoint { axes: ONE, updates: 1 }, 2),
        (Misbehaviour::WrongMode { axes: ONE, mode: 3, updates: 1 }, 1),
    ];
    for (kind, sub_code) in cases {
        let pattern = FaultPattern { fault_type: Some(FaultType::AXIS), code: Some(60), sub_code: None };
        let (pair, report) = run(
            configured(1),
            running(
                kind,
                vec![
                    expect(Condition::Fault { axis: 1, pattern }, 500),
                    state(AxisStateCode::MAJOR_FAULTED),
                    Step::FaultReset(ONE),
                    Step::Enable(ONE),
                    go(1.0),
                ],
            ),
        );
        assert_eq!(report.axes[0].faults.kept()[0].code, 60, "{kind} {sub_code}\n{}", pair.log());
    }
}

#[test]
fn the_motion_connection_outlives_the_tcp_stream() {
    let (pair, report) = run(
        configured(1),
        running(
            Misbehaviour::DropTcp,
            vec![Step::Dwell { seconds: 0.2 }, go(1.0), Step::Disable(ONE), expect(Condition::NoFault, 0)],
        ),
    );
    assert_eq!(report.axes[0].reached, Some(1.0), "{}", pair.log());
}
