//! A motion profile: velocity changes at a constant acceleration, and targets are reached at standstill.

use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::time::DurationNs;

const SECOND: i128 = 1_000_000_000;

/// A motion profile, computed step by step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionProfile {
    /// Position after the last step.
    position: Position,
    /// Velocity during the last step.
    velocity: Velocity,
    goal: Goal,
    acceleration: Acceleration,
}

/// What a profile goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Goal {
    /// To keep this velocity.
    Velocity(Velocity),
    /// Standstill at this position, with at most this velocity.
    Position(Position, Velocity),
}

impl MotionProfile {
    /// A profile at standstill.
    #[must_use]
    pub fn at_rest(position: Position) -> Self {
        Self::moving(position, Velocity::ZERO, Acceleration(1))
    }

    /// A profile that brakes from this motion.
    #[must_use]
    pub fn moving(position: Position, velocity: Velocity, acceleration: Acceleration) -> Self {
        Self {
            position,
            velocity,
            goal: Goal::Velocity(Velocity::ZERO),
            acceleration: positive(acceleration),
        }
    }

    /// Goes to a velocity.
    pub fn to_velocity(&mut self, velocity: Velocity, acceleration: Acceleration) {
        (self.goal, self.acceleration) = (Goal::Velocity(velocity), positive(acceleration));
    }

    /// Goes to standstill at a position. If the axis is too fast to stop there, it passes the position and returns.
    pub fn to_position(&mut self, place: Position, velocity: Velocity, acceleration: Acceleration) {
        (self.goal, self.acceleration) = (Goal::Position(place, velocity), positive(acceleration));
    }

    /// Brakes to standstill with the present acceleration.
    pub fn brake(&mut self) {
        self.goal = Goal::Velocity(Velocity::ZERO);
    }

    /// Position after the last step.
    #[must_use]
    pub fn position(&self) -> Position {
        self.position
    }

    /// Velocity during the last step.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        self.velocity
    }

    /// With what it accelerates and brakes.
    #[must_use]
    pub fn acceleration(&self) -> Acceleration {
        self.acceleration
    }

    /// Whether it has reached its velocity or position.
    #[must_use]
    pub fn is_done(&self) -> bool {
        match self.goal {
            Goal::Velocity(velocity) => self.velocity == velocity,
            Goal::Position(place, _) => self.velocity == Velocity::ZERO && self.position == place,
        }
    }

    /// Computes the next step. The velocity changes by at most acceleration times `length`, but by at least one nanounit per second.
    pub fn step(&mut self, length: DurationNs) {
        let length = i128::from(length.as_nanos().max(1));
        let change = (i128::from(self.acceleration.get()) * length / SECOND).max(1);
        let now = i128::from(self.velocity.get());
        let (wanted, place) = match self.goal {
            Goal::Velocity(velocity) => (i128::from(velocity.get()), None),
            Goal::Position(place, limit) => {
                let way = i128::from(place.get()) - i128::from(self.position.get());
                let fastest = i128::from(limit.get()).abs().min(Self::stoppable(way, length, change));
                (way.signum() * fastest, Some(place))
            }
        };
        let next = wanted.clamp(now - change, now + change);
        let travel = (next * length + next.signum() * SECOND / 2) / SECOND;
        let position = i64::try_from(i128::from(self.position.get()) + travel);
        self.position = Position(position.unwrap_or(if travel < 0 { i64::MIN } else { i64::MAX }));
        self.velocity = Velocity(narrow(next));
        if let Some(place) = place
            && next.abs() <= change
            && (self.position.get().abs_diff(place.get())) <= 1
        {
            // Rounding may leave one nanounit.
            self.position = place;
        }
    }

    /// The highest velocity v of a step that still lets the axis stop within the remaining distance. With the step length T and the change
    /// of velocity in a step c, braking from v takes v T + v^2 T / 2c - v T / 2. No step passes the target.
    fn stoppable(way: i128, length: i128, change: i128) -> i128 {
        let way = way.unsigned_abs();
        let (length, half) = (length.unsigned_abs(), change.unsigned_abs() / 2);
        let second = SECOND.unsigned_abs();
        let reach = way.saturating_mul(second) / length;
        let root = half
            .saturating_mul(half)
            .saturating_add(change.unsigned_abs().saturating_mul(2).saturating_mul(reach));
        let stoppable = root.isqrt().saturating_sub(half).min(reach);
        // The last nanounit takes a step of its own.
        i128::try_from(if way > 0 { stoppable.max(second / length / 2).max(1) } else { 0 })
            .unwrap_or(i128::MAX)
    }
}

fn positive(acceleration: Acceleration) -> Acceleration {
    Acceleration(acceleration.get().saturating_abs().max(1))
}

fn narrow(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value < 0 { i64::MIN } else { i64::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: i64 = 1_000_000_000;
    const STEP: DurationNs = DurationNs::from_millis(4);

    /// Goes on until it is done; the velocities of the steps.
    fn walk(way: &mut MotionProfile, steps: usize) -> Vec<i64> {
        let mut velocities = vec![way.velocity().get()];
        while !way.is_done() {
            assert!(velocities.len() <= steps, "not done after {steps} steps: {way:?}");
            way.step(STEP);
            velocities.push(way.velocity().get());
        }
        velocities
    }

    fn steepest(velocities: &[i64]) -> i64 {
        velocities.windows(2).map(|pair| (pair[1] - pair[0]).abs()).max().unwrap_or(0)
    }

    #[test]
    fn a_way_to_a_place_is_a_trapezoid() {
        let mut way = MotionProfile::at_rest(Position(UNIT));
        way.to_position(Position(3 * UNIT), Velocity(2 * UNIT), Acceleration(10 * UNIT));
        let velocities = walk(&mut way, 400);
        assert_eq!(way.position(), Position(3 * UNIT));
        assert_eq!(velocities.iter().max(), Some(&(2 * UNIT)));
        assert_eq!(velocities.iter().min(), Some(&0), "it does not come back");
        // 0.2 s up, 0.8 s at speed, 0.2 s down.
        assert!((298..=303).contains(&velocities.len()), "{}", velocities.len());
        assert!(steepest(&velocities) <= 10 * UNIT * 4 / 1_000, "{}", steepest(&velocities));
    }

    #[test]
    fn a_short_way_is_a_triangle_and_none_is_no_step() {
        let mut way = MotionProfile::at_rest(Position(0));
        way.to_position(Position(-UNIT / 100), Velocity(2 * UNIT), Acceleration(10 * UNIT));
        let velocities = walk(&mut way, 40);
        let fastest = velocities.iter().map(|velocity| velocity.abs()).max().unwrap();
        assert!((UNIT / 4..UNIT * 33 / 100).contains(&fastest), "{fastest}");
        assert_eq!((way.position(), way.velocity()), (Position(-UNIT / 100), Velocity::ZERO));
        way.to_position(Position(-UNIT / 100), Velocity(UNIT), Acceleration(UNIT));
        assert!(way.is_done());
        way.step(STEP);
        assert_eq!((way.position(), way.velocity()), (Position(-UNIT / 100), Velocity::ZERO));
    }

    #[test]
    fn a_jog_reaches_its_speed_and_brakes() {
        let mut way = MotionProfile::at_rest(Position(0));
        way.to_velocity(Velocity(-UNIT), Acceleration(5 * UNIT));
        assert!(steepest(&walk(&mut way, 60)) <= 5 * UNIT * 4 / 1_000);
        assert_eq!(way.velocity(), Velocity(-UNIT));
        let before = way.position();
        way.brake();
        assert!(steepest(&walk(&mut way, 60)) <= 5 * UNIT * 4 / 1_000);
        // v^2 / 2a.
        assert!((way.position().get() - before.get() + UNIT / 10).abs() < UNIT / 200, "{way:?}");
    }

    #[test]
    fn a_target_behind_an_axis_on_the_move_is_come_back_to() {
        let mut way = MotionProfile::moving(Position(0), Velocity(2 * UNIT), Acceleration(10 * UNIT));
        way.to_position(Position(UNIT / 20), Velocity(UNIT), Acceleration(10 * UNIT));
        let velocities = walk(&mut way, 400);
        assert!(velocities.iter().any(|velocity| *velocity < 0), "it has passed the place");
        assert!(steepest(&velocities) <= 10 * UNIT * 4 / 1_000);
        assert_eq!(way.position(), Position(UNIT / 20));
    }

    proptest! {
        #[test]
        fn every_place_is_reached_within_speed_and_acceleration(
            from in -1_000 * UNIT..1_000 * UNIT,
            way_to in -20 * UNIT..20 * UNIT,
            speed in UNIT / 100..50 * UNIT,
            acceleration in UNIT / 10..500 * UNIT,
            start in -10 * UNIT..10 * UNIT,
            micros in 250i64..20_000,
        ) {
            let length = DurationNs::from_micros(micros);
            let mut way = MotionProfile::moving(Position(from), Velocity(start), Acceleration(acceleration));
            way.to_position(Position(from + way_to), Velocity(speed), Acceleration(acceleration));
            let change = i64::try_from(i128::from(acceleration) * i128::from(length.as_nanos()) / SECOND).unwrap();
            // Milliseconds: to rest first, then the way and back from where that was, each with its ramps.
            let millis = |way: i64, velocity: i64| 1_000 * way.abs() / velocity.max(1) + 1;
            let braking = i64::try_from(i128::from(start) * i128::from(start) / (2 * i128::from(acceleration))).unwrap();
            let time = millis(start, acceleration)
                + millis(way_to.abs() + braking, speed)
                + 4 * millis(speed.min(20 * UNIT), acceleration)
                + 2 * millis(speed, acceleration);
            let steps = 2 * time * 1_000 / micros + 100;
            let mut last = way.velocity().get();
            for _ in 0..steps {
                way.step(length);
                let now = way.velocity().get();
                prop_assert!((now - last).abs() <= change + 1, "{last} to {now} in a step, {change} allowed");
                prop_assert!(now.abs() <= speed.max(start.abs()), "{now}");
                last = now;
                if way.is_done() {
                    break;
                }
            }
            prop_assert!(way.is_done(), "{way:?}");
            prop_assert_eq!(way.position(), Position(from + way_to));
        }

        #[test]
        fn extremes_saturate(position: i64, velocity: i64, acceleration: i64, place: i64, speed: i64, nanos: i64) {
            let mut way = MotionProfile::moving(Position(position), Velocity(velocity), Acceleration(acceleration));
            way.to_position(Position(place), Velocity(speed), Acceleration(acceleration));
            for _ in 0..4 {
                way.step(DurationNs(nanos));
            }
            way.to_velocity(Velocity(speed), Acceleration(acceleration));
            way.step(DurationNs(nanos));
        }
    }
}
