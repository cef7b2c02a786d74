//! The ramp generator: it forms velocities that are commanded at once into ramps (CIP Volume 9, clause 5-2.6.5.4). Set-points that are
//! interpolated pass it as they are.

use profile_generic::quantity::{Acceleration, Velocity};
use profile_generic::time::DurationNs;

/// Limits of the ramp generator; where one is not set the velocity is not limited, or changes at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ramp {
    /// Highest velocity forward, above 0.
    pub positive: Option<Velocity>,
    /// Highest velocity backward, below 0.
    pub negative: Option<Velocity>,
    /// How fast the speed rises, above 0.
    pub acceleration: Option<Acceleration>,
    /// How fast it falls, above 0.
    pub deceleration: Option<Acceleration>,
}

/// By how much a velocity changes in a time; `None` where nothing limits it.
fn change(limit: Option<Acceleration>, passed: DurationNs) -> Option<i64> {
    let change = i128::from(limit?.get()) * i128::from(passed.as_nanos().max(0)) / 1_000_000_000;
    Some(i64::try_from(change).unwrap_or(i64::MAX))
}

impl Ramp {
    /// The velocity after `passed`, from the one before towards the wanted one. A change of direction goes through rest.
    #[must_use]
    pub fn follow(&self, before: Velocity, wanted: Velocity, passed: DurationNs) -> Velocity {
        let highest = self.positive.map_or(i64::MAX, Velocity::get);
        let lowest = self.negative.map_or(i64::MIN, Velocity::get);
        let (before, wanted) = (before.get(), wanted.get().clamp(lowest, highest));
        let turns = (before > 0 && wanted < 0) || (before < 0 && wanted > 0);
        let goal = if turns { 0 } else { wanted };
        let slows = goal.unsigned_abs() < before.unsigned_abs();
        let limit = if slows { self.deceleration } else { self.acceleration };
        let Some(most) = change(limit, passed) else {
            // Braking at once, it may turn at once as well.
            return if turns {
                self.follow(Velocity::ZERO, Velocity(wanted), passed)
            } else {
                Velocity(goal)
            };
        };
        Velocity(goal.clamp(before.saturating_sub(most), before.saturating_add(most)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLI: DurationNs = DurationNs::from_millis(1);

    fn ramp() -> Ramp {
        Ramp {
            positive: Some(Velocity(5_000)),
            negative: Some(Velocity(-3_000)),
            acceleration: Some(Acceleration(1_000_000)),
            deceleration: Some(Acceleration(2_000_000)),
        }
    }

    #[test]
    fn each_direction_has_its_ramp_and_its_limit() {
        for (before, wanted, expected) in [
            (0, 4_000, 1_000),
            (3_500, 4_000, 4_000),
            (4_500, 9_000, 5_000),
            (4_000, 1_000, 2_000),
            (2_500, 1_000, 1_000),
            (0, -9_000, -1_000),
            (-2_500, -9_000, -3_000),
            (-3_000, -500, -1_000),
            // Through rest, with the ramp of each side.
            (3_000, -3_000, 1_000),
            (1_500, -3_000, 0),
            (-1_500, 3_000, 0),
            // A limit that is lowered on the move is come to by the ramp.
            (9_000, 9_000, 7_000),
        ] {
            let found = ramp().follow(Velocity(before), Velocity(wanted), MILLI);
            assert_eq!(found, Velocity(expected), "from {before} to {wanted}");
        }
    }

    #[test]
    fn what_is_not_set_limits_nothing() {
        let (before, wanted) = (Velocity(100), Velocity(-1_000_000_000));
        assert_eq!(Ramp::default().follow(before, wanted, MILLI), wanted);
        let rises = Ramp { acceleration: Some(Acceleration(1_000_000)), ..Ramp::default() };
        assert_eq!(
            rises.follow(before, wanted, MILLI),
            Velocity(-1_000),
            "braked at once, and up by the ramp"
        );
        assert_eq!(rises.follow(before, Velocity(7), MILLI), Velocity(7));
        let falls = Ramp { deceleration: Some(Acceleration(50_000)), ..Ramp::default() };
        assert_eq!(falls.follow(before, wanted, MILLI), Velocity(50));
        assert_eq!(falls.follow(Velocity::ZERO, wanted, MILLI), wanted);
    }

    #[test]
    fn extremes_do_not_overflow() {
        for before in [i64::MIN, -1, 0, 1, i64::MAX] {
            for wanted in [i64::MIN, -1, 0, 1, i64::MAX] {
                for limit in [0, 1, i64::MAX] {
                    for passed in [DurationNs(-1), DurationNs::ZERO, DurationNs(i64::MAX)] {
                        let limit = Some(Acceleration(limit));
                        let ramp = Ramp { acceleration: limit, deceleration: limit, ..Ramp::default() };
                        let found = ramp.follow(Velocity(before), Velocity(wanted), passed).get();
                        assert!(
                            found >= before.min(wanted) && found <= before.max(wanted),
                            "{before} {wanted}"
                        );
                    }
                }
            }
        }
    }
}
