//! Torque that is fed forward to a drive whose own loops do not do it: a part of what the commanded acceleration takes
//! (clause 5-2.6.13.6).

use profile_generic::quantity::{Acceleration, Torque};

/// What the controller has set for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FeedForward {
    /// Part of the acceleration that is fed forward, 1e-6 (Kaff, attribute 460).
    pub gain: i64,
    /// Torque for a motor revolution per second squared, 1e-9 percent of the rated one (Kj, attribute 496).
    pub inertia: i64,
}

/// No drive gives more than ten times the rated torque, and its telegram holds no more than some times that.
const MOST: i128 = 10_000_000;

impl FeedForward {
    /// The torque for an acceleration of the axis; `motor_turns` are revolutions of the motor in one axis unit, 1e-15.
    pub(super) fn torque(&self, acceleration: Acceleration, motor_turns: i64) -> Torque {
        let product = |one: i128, other: i64| one.saturating_mul(i128::from(other));
        // 1e-9 revolutions per second squared.
        let of_motor = product(i128::from(acceleration.get()), motor_turns) / 1_000_000_000_000_000;
        // 1e-9 percent, then millionths of the rated torque.
        let percent = product(product(of_motor, self.inertia) / 1_000_000_000, self.gain) / 1_000_000;
        let torque = (percent / 100_000).clamp(-MOST, MOST);
        Torque(i64::try_from(torque).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 units per second squared behind a gear of 5:2 are 25 revolutions of the motor; at 0.4 % for each they take 10 % of the rated
    /// torque, and half of it is fed forward.
    #[test]
    fn torque_is_the_part_of_what_the_acceleration_of_the_motor_takes() {
        let feed_forward = FeedForward { gain: 500_000, inertia: 400_000_000 };
        let torque =
            |acceleration| feed_forward.torque(Acceleration(acceleration), 2_500_000_000_000_000).get();
        assert_eq!(torque(10_000_000_000), 50_000);
        assert_eq!(torque(-10_000_000_000), -50_000);
        assert_eq!(torque(0), 0);
        let most = FeedForward { gain: i64::MAX, inertia: i64::MAX };
        assert_eq!(
            most.torque(Acceleration(i64::MIN), i64::MAX),
            Torque(-10_000_000),
            "ten times the rated one"
        );
        assert_eq!(FeedForward::default().torque(Acceleration(i64::MAX), i64::MAX), Torque(0));
    }
}
