//! The control loops: position over velocity over torque.

use super::plant::{Plant, parts, seconds, units};
use super::{SUB_STEP, ServoError, ServoParameters};
use crate::cast;
use crate::quantity::Position;

/// The most that velocity gain times the lag of the torque loop may be. At 0.5 the loop still has a phase
/// margin above 60 degrees without its integral part.
const MAX_GAIN_TIMES_LAG: f64 = 0.5;

/// What the loops follow during a sub-step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// A position, and the velocity with which it moves.
    Position(Position, f64),
    /// A velocity.
    Velocity(f64),
    /// A torque, in parts of the rated one.
    Torque(f64),
}

/// Offsets that are added inside the cascade.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offsets {
    pub(super) velocity: f64,
    pub(super) torque: f64,
}

/// The loops and their memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    position_gain: f64,
    velocity_gain: f64,
    /// Integral gain over proportional gain, zero for no integral part.
    integral_rate: f64,
    feed_forward: f64,
    pub(super) velocity_limit: f64,
    torque_limit: f64,
    /// The integral part, as an acceleration.
    integral: f64,
    pub(super) velocity_limited: bool,
    pub(super) torque_limited: bool,
}

impl Control {
    pub(super) fn new(parameters: &ServoParameters) -> Result<Self, ServoError> {
        let position_gain = parts(parameters.position_gain);
        let velocity_gain = parts(parameters.velocity_gain);
        let lag = seconds(parameters.torque_time_constant) + seconds(SUB_STEP);
        if velocity_gain * lag > MAX_GAIN_TIMES_LAG {
            return Err(ServoError::Unstable("velocity_gain"));
        }
        if position_gain * 2.0 > velocity_gain {
            return Err(ServoError::Unstable("position_gain"));
        }
        let integral_time = seconds(parameters.velocity_integral_time);
        if integral_time > 0.0 && integral_time * velocity_gain < 2.0 {
            return Err(ServoError::Unstable("velocity_integral_time"));
        }
        Ok(Self {
            position_gain,
            velocity_gain,
            integral_rate: if integral_time > 0.0 { 1.0 / integral_time } else { 0.0 },
            feed_forward: cast::f64_from_i64(parameters.velocity_feed_forward) / 1e6,
            velocity_limit: units(parameters.velocity_limit.0),
            torque_limit: parts(parameters.torque_limit.0),
            integral: 0.0,
            velocity_limited: false,
            torque_limited: false,
        })
    }

    /// The same loops with the memory of others.
    pub(super) fn resuming(self, before: &Self) -> Self {
        Self {
            integral: before.integral,
            velocity_limited: before.velocity_limited,
            torque_limited: before.torque_limited,
            ..self
        }
    }

    /// Forgets the past: when the torque is switched on.
    pub(super) fn reset(&mut self) {
        self.integral = 0.0;
        self.velocity_limited = false;
        self.torque_limited = false;
    }

    /// The torque to ask for, in parts of the rated one. `seen` is the position that the encoder shows.
    pub(super) fn torque(
        &mut self,
        target: Target,
        offsets: Offsets,
        seen: Position,
        plant: &Plant,
        time_s: f64,
    ) -> f64 {
        let wanted = match target {
            Target::Torque(torque) => return self.limited_torque(torque + offsets.torque, plant),
            Target::Velocity(velocity) => velocity,
            Target::Position(position, velocity) => {
                let error = units(position.0.saturating_sub(seen.0));
                self.position_gain * error + self.feed_forward * velocity
            }
        };
        let wanted = wanted + offsets.velocity;
        let velocity = wanted.clamp(-self.velocity_limit, self.velocity_limit);
        self.velocity_limited = velocity != wanted;
        let error = velocity - plant.velocity;
        let acceleration = self.velocity_gain * error + self.integral;
        let torque = acceleration / plant.gain + offsets.torque;
        let held = torque.clamp(-self.torque_limit, self.torque_limit);
        self.torque_limited = held != torque;
        // Against wind-up: while the torque is at its limit, the integral may only lead away from it.
        if !self.torque_limited || (error < 0.0) != (torque < 0.0) {
            self.integral += self.velocity_gain * self.integral_rate * error * time_s;
        }
        held
    }

    /// Torque control with the velocity limit as a fence: near it the velocity loop takes over.
    fn limited_torque(&mut self, torque: f64, plant: &Plant) -> f64 {
        let fence = |limit: f64| self.velocity_gain * (limit - plant.velocity) / plant.gain;
        let (lowest, highest) = (fence(-self.velocity_limit), fence(self.velocity_limit));
        let fenced = torque.clamp(lowest, highest);
        self.velocity_limited = fenced != torque;
        let held = fenced.clamp(-self.torque_limit, self.torque_limit);
        self.torque_limited = held != fenced;
        // So that a change to velocity control starts from the present torque.
        self.integral = held * plant.gain;
        held
    }
}
