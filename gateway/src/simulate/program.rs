//! The motion that `demo` and `simulate controller` run: enough of everything to show that an axis works.
//!
//! Each axis makes an S-curve move in position control, then a velocity move that a controlled stop ends, then an
//! S-curve move to its target, where it has to stay within the window. The time it takes is given; distances and limits
//! follow from it.

use profile_cip::controller::{AxisSet, Limits, Step};

use super::setup::patient;

/// Share of the time for each of the two position moves; the rest is the velocity move and its stop.
pub const MOVE_SHARE: f64 = 0.35;
/// Share of the time for the velocity move and its stop.
pub const JOG_SHARE: f64 = 1.0 - 2.0 * MOVE_SHARE;

/// What an axis is asked to do, in its units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPlan {
    /// Instance number.
    pub axis: u8,
    /// Where the first move ends.
    pub first: f64,
    /// Velocity of the velocity move, in units per second; its sign is the direction.
    pub velocity: f64,
    /// Where the last move ends.
    pub target: f64,
    /// How far from the target still counts as reached.
    pub window: f64,
}

impl AxisPlan {
    /// A plan for an axis that moves at about `speed` units per second for `seconds` and stays within 0 and `reach`.
    #[must_use]
    pub fn new(axis: u8, speed: f64, reach: f64, window: f64, seconds: f64) -> Self {
        let first = (speed * seconds * 0.5).min(reach * 0.6);
        // Back and forth at speeds of the same order: the velocity move goes back over a part of the way.
        let velocity = -(first * 0.5) / (seconds * (1.0 - 2.0 * MOVE_SHARE));
        Self { axis, first, velocity, target: first * 1.25, window }
    }

    /// Limits that make an S-curve over `distance` take about `seconds`: a tenth of the time for the jerk phases, a
    /// quarter for speeding up.
    #[must_use]
    pub fn limits(distance: f64, seconds: f64) -> Limits {
        let velocity = 1.6 * distance.abs().max(1e-6) / seconds;
        let acceleration = velocity / (0.25 * seconds);
        Limits { velocity, acceleration, jerk: acceleration / (0.1 * seconds) }
    }
}

/// What each step of [`standard`] does, in words.
#[must_use]
pub fn titles(plans: &[AxisPlan]) -> Vec<String> {
    let each = |value: &dyn Fn(&AxisPlan) -> f64| {
        plans.iter().map(|plan| format!("{:.3}", value(plan))).collect::<Vec<_>>().join(" and ")
    };
    vec![
        "enable the axes, which hold their positions".to_owned(),
        format!("S-curve moves to {}", each(&|plan| plan.first)),
        "wait until the axes stand within their windows".to_owned(),
        format!("velocity moves at {} per second, ended by controlled stops", each(&|plan| plan.velocity)),
        format!("S-curve moves to the targets {}", each(&|plan| plan.target)),
        "wait until the axes stand within their windows".to_owned(),
        "rest".to_owned(),
        "disable the axes".to_owned(),
    ]
}

/// The steps for all axes together, taking about `seconds`.
#[must_use]
pub fn standard(plans: &[AxisPlan], seconds: f64) -> Vec<Step> {
    let axes = plans.iter().fold(AxisSet::NONE, |set, plan| set.with(plan.axis));
    let move_time = seconds * MOVE_SHARE;
    let jog_time = seconds * JOG_SHARE;
    let each = |step: &dyn Fn(&AxisPlan) -> Step| Step::Together(plans.iter().map(step).collect());
    vec![
        patient(Step::Enable(axes)),
        each(&|plan| Step::MoveAbsolute {
            axis: plan.axis,
            position: plan.first,
            limits: AxisPlan::limits(plan.first, move_time),
        }),
        each(&|plan| Step::WaitInWindow { axis: plan.axis, window: plan.window, seconds: 5.0 }),
        each(&|plan| {
            let acceleration = plan.velocity.abs() / (0.2 * jog_time);
            let jerk = acceleration / (0.05 * jog_time);
            Step::Together(vec![
                // Meant to go on for longer than it is let.
                Step::Jog {
                    axis: plan.axis,
                    velocity: plan.velocity,
                    acceleration,
                    jerk,
                    seconds: 2.0 * jog_time,
                },
                Step::Sequence(vec![
                    Step::Dwell { seconds: 0.7 * jog_time },
                    Step::Stop { axis: plan.axis, acceleration, jerk },
                ]),
            ])
        }),
        each(&|plan| Step::MoveAbsolute {
            axis: plan.axis,
            position: plan.target,
            limits: AxisPlan::limits(plan.first, move_time),
        }),
        each(&|plan| Step::WaitInWindow { axis: plan.axis, window: plan.window, seconds: 5.0 }),
        Step::Dwell { seconds: 0.1 },
        Step::Disable(axes),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_has_a_title() {
        let plans = [AxisPlan::new(1, 2.0, 600.0, 0.01, 5.0), AxisPlan::new(2, 40.0, 700.0, 0.01, 5.0)];
        assert_eq!(titles(&plans).len(), standard(&plans, 5.0).len());
        assert_eq!(titles(&plans)[1], "S-curve moves to 5.000 and 100.000");
    }

    #[test]
    fn a_plan_stays_within_its_reach_for_any_time() {
        for seconds in [1.0, 3.0, 10.0, 3600.0] {
            let plan = AxisPlan::new(1, 40.0, 800.0, 0.01, seconds);
            assert!(plan.first > 0.0 && plan.target > plan.first && plan.target <= 800.0, "{plan:?}");
            // The velocity move goes back less far than the first move went.
            let back = -plan.velocity * seconds * (1.0 - 2.0 * MOVE_SHARE);
            assert!(back > 0.0 && back < plan.first, "{plan:?}");
        }
    }
}
