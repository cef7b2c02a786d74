//! What the axis does in every row: it is enabled, moves two revolutions on an S-curve with most of a second at constant
//! velocity, and is disabled. The disturbance begins with the motion, or acts once in the middle of the acceleration and once
//! at constant velocity.
//!
//! A new row is another element of a list in one of the tables; a new table is a test that gives [`table`](crate::table) its
//! disturbances as closures over the rig.

use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::motion_checker::statistics::Statistics;
use profile_cip::controller::{AxisSet, Controller, ControllerConfig, Limits, Step};
use profile_generic::time::DurationNs;
use profile_sercos::checker::checked_bus::Tried;
use profile_sercos::checker::{Rule, Violation};

use crate::chain::Chain;

/// The axis.
pub const AXIS: AxisSet = AxisSet::one(1);

/// 2 revolutions per second after 0.15 s.
pub const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 20.0, jerk: 400.0 };

/// From the start of the motion to the middle of its acceleration, and to the middle of its constant velocity.
const ACCELERATING: DurationNs = DurationNs::from_millis(100);
const CONSTANT: DurationNs = DurationNs::from_millis(500);

/// What a row may take beyond the motion: a stop, a reset.
const PATIENCE: DurationNs = DurationNs::from_millis(4_000);

/// Where in the motion a disturbance acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// Before the controller connects.
    Start,
    /// The axis is enabled, and begins to move.
    Begin,
    /// In the middle of the acceleration.
    Accelerating,
    /// In the middle of the constant velocity.
    Constant,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What the set-points were like.
    pub statistics: Statistics,
    /// Updates that the gateway missed.
    pub lost: u64,
    /// Names of the faults, each once.
    pub faults: Vec<String>,
    /// Where it ended.
    pub end: String,
}

/// The program of most rows.
pub fn program() -> Vec<Step> {
    vec![
        Step::Enable(AXIS),
        Step::MoveAbsolute { axis: 1, position: 2.0, limits: LIMITS },
        Step::Disable(AXIS),
    ]
}

/// Runs the usual motion; `act` is called at each moment.
pub fn run(chain: Chain, act: &dyn Fn(&mut Rig, Moment)) -> Outcome {
    run_program(chain, program(), |_| {}, act)
}

/// Runs a program whose first step enables the axis and whose second moves it, with a changed configuration.
pub fn run_program(
    chain: Chain,
    program: Vec<Step>,
    change: impl FnOnce(&mut ControllerConfig),
    act: &dyn Fn(&mut Rig, Moment),
) -> Outcome {
    let mut rig = chain.ready();
    rig.motion_checker.record();
    // An engine that wakes up late sends its MST late.
    let late = |violation: &Violation| matches!(violation.rule, Rule::MstInterval { .. });
    rig.tolerating(late, |rig| go(rig, chain, program, change, act));
    outcome(&rig)
}

fn go(
    rig: &mut Rig,
    chain: Chain,
    program: Vec<Step>,
    change: impl FnOnce(&mut ControllerConfig),
    act: &dyn Fn(&mut Rig, Moment),
) {
    let mut config = chain.controller(rig);
    change(&mut config);
    act(rig, Moment::Start);
    rig.connect_with(config, program);
    let end = rig.now() + PATIENCE;
    let closed = |rig: &Rig| rig.controller.as_ref().is_none_or(Controller::is_closed);
    while rig.report().steps_finished == 0 && !closed(rig) && rig.now() < end {
        rig.step();
    }
    rig.motion_checker.restart_statistics();
    let begin = rig.now();
    act(rig, Moment::Begin);
    for (moment, after) in [(Moment::Accelerating, ACCELERATING), (Moment::Constant, CONSTANT)] {
        while rig.now() < begin + after {
            rig.step();
        }
        act(rig, moment);
    }
    let end = rig.now() + PATIENCE;
    while !closed(rig) && rig.now() < end {
        rig.step();
    }
}

fn outcome(rig: &Rig) -> Outcome {
    let mut faults: Vec<String> = Vec::new();
    let mut add = |name: String| {
        if !faults.contains(&name) {
            faults.push(name);
        }
    };
    for notice in &rig.notices {
        match notice {
            Notice::Fault { fault, .. } => add(fault.cause.to_string()),
            Notice::Node { fault, .. } if fault.0 != 0 => add(fault.to_string()),
            _ => {}
        }
    }
    let report = rig.report();
    let state = rig.engine.axes()[0].state().name();
    let end = match report.failure {
        None if report.steps_finished > 2 => "done".to_owned(),
        None => format!("{state}, goes on"),
        Some(_) => state.to_owned(),
    };
    let lost = rig.engine.devices()[0].device().counters().lost_updates;
    Outcome { statistics: rig.motion_checker.statistics(0), lost, faults, end }
}
