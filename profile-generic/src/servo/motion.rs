//! Motion that the drive makes up by itself: to a target, or with a velocity, for homing and drive-controlled interpolation.

/// How fast, and how quickly faster and slower. Nanounits, all above 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// Highest speed, per second.
    pub velocity: i64,
    /// Per second squared.
    pub acceleration: i64,
    /// Per second squared.
    pub deceleration: i64,
}

/// A set-point that moves with limited acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Motion {
    /// Where it is, nanounits.
    pub position: i64,
    /// How fast it moves, nanounits per second.
    pub velocity: i64,
}

const SECOND: i128 = 1_000_000_000;

impl Motion {
    /// Moves on for `span` nanoseconds toward `target`, to stop there; whether it stands there now. A target that lies
    /// nearer than it can stop is passed and come back to.
    pub fn advance_to(&mut self, span: i64, target: i64, pace: Pace) -> bool {
        let way = i128::from(target) - i128::from(self.position);
        let rate = i128::from(pace.deceleration.max(1));
        let change = (rate * i128::from(span) / SECOND).max(1);
        // Near enough to stop in this step.
        if 2 * rate * way.abs() <= change * change && i128::from(self.velocity).abs() <= change {
            *self = Motion { position: target, velocity: 0 };
            return true;
        }
        // From this speed it stops in time, with what a step is late.
        let fast = (2 * rate * way.abs()).unsigned_abs().isqrt().cast_signed() - change / 2;
        let fast = fast.max(way.abs().min(change)).min(i128::from(pace.velocity.max(1)));
        let wanted = if way < 0 { -fast } else { fast };
        self.advance(span, i64::try_from(wanted).unwrap_or(0), pace);
        false
    }

    /// Moves on for `span` nanoseconds, toward this velocity.
    pub fn advance(&mut self, span: i64, wanted: i64, pace: Pace) {
        let slower = wanted.abs() < self.velocity.abs() || wanted.signum() * self.velocity.signum() < 0;
        let rate = if slower { pace.deceleration } else { pace.acceleration }.max(1);
        let change = i64::try_from((i128::from(rate) * i128::from(span) / SECOND).max(1)).unwrap_or(i64::MAX);
        let (low, high) = (self.velocity.saturating_sub(change), self.velocity.saturating_add(change));
        let velocity = wanted.clamp(low, high);
        let way = (i128::from(self.velocity) + i128::from(velocity)) * i128::from(span) / (2 * SECOND);
        self.position = self.position.saturating_add(i64::try_from(way).unwrap_or(0));
        self.velocity = velocity;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// It gets there, never faster than it may, never changing its speed quicker than it may.
        #[test]
        fn targets_are_reached_within_the_limits(
            target in -10_000_000_000_i64..10_000_000_000, velocity in 1_000_000..50_000_000_000_i64,
            acceleration in 1_000_000_000..1_000_000_000_000_i64, deceleration in 1_000_000_000..1_000_000_000_000_i64,
            start in -1_000_000_000..1_000_000_000_i64,
        ) {
            let pace = Pace { velocity, acceleration, deceleration };
            let mut motion = Motion { position: 0, velocity: start };
            let span = 1_000_000;
            let most = acceleration.max(deceleration) / 1_000 + 1;
            let way = target.abs() + 1_000_000_000;
            let time = way / velocity.min(way) * 2 + velocity / acceleration + velocity / deceleration + 20;
            let mut done = false;
            for _ in 0..time * 2_000 {
                let before = motion.velocity;
                done = motion.advance_to(span, target, pace);
                prop_assert!((motion.velocity - before).abs() <= most);
                prop_assert!(motion.velocity.abs() <= velocity.max(start.abs()));
                if done {
                    break;
                }
            }
            prop_assert!(done, "{:?} for {}", motion, target);
            prop_assert_eq!(motion, Motion { position: target, velocity: 0 });
        }
    }
}
