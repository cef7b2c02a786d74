//! A simple axis: a mass with a motor. Everything is in millionths of a count, in whole numbers.

use super::settings::Settings;

/// Millionths in a count.
pub const MICRO: i128 = 1_000_000;

/// What the controller does with the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// No current.
    Coast,
    /// Follows this position, which moves at this velocity.
    Position(i128, i128),
    /// Follows this velocity.
    Velocity(i128),
    /// Torque in thousandths of rated.
    Torque(i128),
}

/// The axis.
#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Position, millionths of a count.
    pub pos: i128,
    /// Velocity, millionths of a count per second.
    pub vel: i128,
    /// Torque of the motor, thousandths of rated.
    pub torque: i128,
    /// Something holds the axis.
    pub blocked: bool,
    /// A torque from outside, thousandths of rated.
    pub load: i64,
}

/// A value with a sign as a whole number, rounded to the nearest.
#[must_use]
pub fn rounded(value: i128, by: i128) -> i64 {
    let by = by.max(1);
    let half = if value < 0 { -by / 2 } else { by / 2 };
    let whole = value.saturating_add(half) / by;
    i64::try_from(whole).unwrap_or(if whole < 0 { i64::MIN } else { i64::MAX })
}

/// Goes from one value to another by at most a step.
#[must_use]
pub fn toward(from: i128, to: i128, step: i128) -> i128 {
    if to > from { to.min(from + step.abs()) } else { to.max(from - step.abs()) }
}

impl Axis {
    /// Position in counts.
    #[must_use]
    pub fn counts(&self) -> i64 {
        rounded(self.pos, MICRO)
    }

    /// Lets so many microseconds pass, at most 1000. The torque is limited to `limit` thousandths of rated.
    pub fn step(&mut self, dt: i128, effort: Effort, limit: i128, s: &Settings) {
        let top = i128::from(s.max_velocity.max(1)) * MICRO;
        let strong = i128::from(s.max_acceleration.max(1)) * MICRO;
        let rated = strong / 3;
        let friction = i128::from(s.friction) * self.vel / top;
        let against = friction + i128::from(self.load);
        if self.blocked {
            self.vel = 0;
            self.torque = match effort {
                Effort::Coast => 0,
                Effort::Torque(torque) => torque.clamp(-limit, limit),
                Effort::Position(pos, _) => ((pos - self.pos) / MICRO).clamp(-limit, limit),
                Effort::Velocity(vel) => vel.signum() * limit,
            };
            return;
        }
        let before = self.vel;
        let wanted = match effort {
            Effort::Coast => {
                self.torque = 0;
                // Bearings stop the axis sooner or later.
                toward(self.vel, 0, rated / 5 * dt / MICRO)
            }
            Effort::Torque(torque) => {
                self.torque = torque.clamp(-limit, limit);
                self.vel + (self.torque - against) * rated / 1000 * dt / MICRO
            }
            Effort::Velocity(vel) => toward(self.vel, vel, strong * dt / MICRO),
            Effort::Position(pos, vel) => {
                let behind = pos - self.pos - vel * dt / MICRO;
                if vel == 0
                    && behind.abs() < MICRO / 50
                    && self.vel.abs() < 4 * i128::from(s.position_gain) * MICRO
                {
                    self.pos = pos;
                    0
                } else {
                    let forward = vel * i128::from(s.feed_forward) / 100;
                    let aim = forward + behind * i128::from(s.position_gain);
                    toward(self.vel, aim, strong * dt / MICRO)
                }
            }
        };
        self.vel = wanted.clamp(-top, top);
        self.pos += self.vel * dt / MICRO;
        if matches!(effort, Effort::Position(..) | Effort::Velocity(_)) {
            let needed = (self.vel - before) * MICRO / dt.max(1) * 1000 / rated.max(1) + against;
            self.torque = needed.clamp(-limit, limit);
        }
    }
}

/// One step of a trapezoidal profile: position, velocity, target, then velocity and acceleration limits and the time.
/// Everything in millionths.
#[must_use]
pub fn trapezoid(
    pos: i128,
    vel: i128,
    target: i128,
    top: i128,
    up: i128,
    down: i128,
    dt: i128,
) -> (i128, i128) {
    let way = target - pos;
    // The velocity from which the steps that follow, each slower by `down`, end at the target.
    let half = down.abs() * dt / MICRO / 2;
    let square = way.unsigned_abs().saturating_mul(down.unsigned_abs()).saturating_mul(2);
    let square = square.saturating_add(half.unsigned_abs().saturating_mul(half.unsigned_abs()));
    let allowed = i128::try_from(square.isqrt()).unwrap_or(top).saturating_sub(half).max(0);
    let want = allowed.min(top.abs()) * way.signum();
    let faster = want.abs() > vel.abs() && want.signum() * vel.signum() >= 0;
    let step = (if faster { up } else { down }).abs() * dt / MICRO;
    let vel = toward(vel, want, step.max(1));
    let moved = vel * dt / MICRO;
    let lands =
        moved.abs() >= way.abs() && moved.signum() * way.signum() >= 0 && vel.abs() <= step.max(1) * 2;
    if lands || (way.abs() < MICRO / 100 && vel.abs() <= step.max(1)) {
        (target, 0)
    } else {
        (pos + moved, vel)
    }
}
#[cfg(test)]
mod tests {
    use super::{Axis, Effort, MICRO, rounded, trapezoid};
    use crate::can_drive::Settings;

    #[test]
    fn a_profile_neither_passes_its_target_nor_its_limits() {
        for (goal, top, rate) in
            [(3000, 50_000, 500_000), (-77, 1_000, 9_000), (1, 10, 1_000_000), (90_000, 20_000, 70_000)]
        {
            let (goal, top, rate) = (goal * MICRO, top * MICRO, rate * MICRO);
            let (mut pos, mut vel, mut steps) = (0, 0, 0);
            while (pos, vel) != (goal, 0) {
                let (next, speed) = trapezoid(pos, vel, goal, top, rate, rate, 1000);
                assert!(speed.abs() <= top);
                assert!((next - pos).signum() * goal.signum() >= 0 && next.abs() <= goal.abs());
                (pos, vel) = (next, speed);
                steps += 1;
                assert!(steps < 10_000);
            }
        }
    }

    #[test]
    fn rounding_is_to_the_nearest() {
        assert_eq!([rounded(1_499, 1000), rounded(1_500, 1000), rounded(-1_500, 1000)], [1, 2, -2]);
        assert_eq!(rounded(i128::MAX, 1), i64::MAX);
    }

    #[test]
    fn an_axis_without_current_stops() {
        let mut axis = Axis { vel: 100_000 * MICRO, ..Axis::default() };
        let settings = Settings::default();
        // A fifth of a third of 30 million counts/s^2: 50 ms.
        for _ in 0..50 {
            axis.step(1000, Effort::Coast, 3000, &settings);
        }
        assert_eq!(axis.vel, 0);
        assert_eq!(axis.counts(), 2450);
    }
}
