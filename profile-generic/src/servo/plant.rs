//! Motor and load: mechanics, DC bus and warming.

use super::{ServoError, ServoParameters};
use crate::cast;
use crate::quantity::Position;
use crate::scaling::{NANO, UnitKind};
use core::f64::consts::TAU;

/// One in the integer units of a millionth.
const MILLION: f64 = 1e6;

/// How fast the DC bus charges and discharges.
const BUS_CHARGE_S: f64 = 0.05;
const BUS_DISCHARGE_S: f64 = 0.5;

/// How far rated power pulls the DC bus down, or up when the motor brakes.
const BUS_SAG: f64 = 0.03;

/// The part of the nominal voltage from which the DC bus counts as charged.
const BUS_CHARGED: f64 = 0.8;

pub(super) fn seconds(span: crate::time::DurationNs) -> f64 {
    cast::f64_from_i64(span.0) / 1e9
}

pub(super) fn units(nano: i64) -> f64 {
    cast::f64_from_i64(nano) / 1e9
}

pub(super) fn parts(ppm: i64) -> f64 {
    cast::f64_from_i64(ppm) / MILLION
}

pub(super) fn nano(units: f64) -> i64 {
    cast::i64_from_f64(units * 1e9)
}

pub(super) fn ppm(parts: f64) -> i64 {
    cast::i64_from_f64(parts * MILLION)
}

/// The state of motor and load. Torques are parts of the rated torque, velocities in axis units per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plant {
    /// Acceleration per rated torque.
    pub(super) gain: f64,
    coulomb: f64,
    viscous: f64,
    rated_velocity: f64,
    torque_lag_s: f64,
    /// Whole nanounits.
    position: i64,
    /// The rest, within half a nanounit.
    fraction: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) torque: f64,
    /// Torque of the load against the motor.
    pub(super) load: f64,
    /// Part of the nominal voltage without load.
    charge: f64,
    /// Warming of the motor, in parts of that at rated current.
    warmth: f64,
    thermal_s: f64,
    pub(super) overload: f64,
    overload_s: f64,
}

impl Plant {
    pub(super) fn new(parameters: &ServoParameters) -> Result<Self, ServoError> {
        let torque = parts(parameters.rated_torque.0);
        let inertia = cast::f64_from_i64(parameters.inertia);
        let gain = match parameters.kind {
            // Newton metre over kilogram metre squared is radian per second squared.
            UnitKind::Rotary => torque / (inertia / 1e9) / TAU,
            // Newton over kilogram is metre per second squared.
            UnitKind::Linear => torque / (inertia / 1e6) * 1_000.0,
        };
        if !gain.is_finite() || !(1e-3..1e9).contains(&gain) {
            return Err(ServoError::OutOfRange("inertia"));
        }
        let rated_velocity = units(parameters.rated_velocity.0);
        Ok(Self {
            gain,
            coulomb: parts(parameters.coulomb_friction.0),
            viscous: parts(parameters.viscous_friction.0) / rated_velocity,
            rated_velocity,
            torque_lag_s: seconds(parameters.torque_time_constant),
            position: parameters.start_position.0,
            fraction: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            torque: 0.0,
            load: 0.0,
            charge: 0.0,
            warmth: 0.0,
            thermal_s: seconds(parameters.thermal_time_constant),
            overload: 0.0,
            overload_s: seconds(parameters.overload_time_constant),
        })
    }

    /// The position to the nanounit.
    pub(super) const fn position(&self) -> Position {
        Position(self.position)
    }

    /// Puts the axis at another position without moving it: a new reference.
    pub(super) fn set_position(&mut self, position: Position) {
        self.position = position.0;
        self.fraction = 0.0;
    }

    /// Takes the properties of another plant and stays as it is.
    pub(super) fn retune(&mut self, other: &Self) {
        self.coulomb = other.coulomb;
        self.viscous = other.viscous;
        self.rated_velocity = other.rated_velocity;
        self.torque_lag_s = other.torque_lag_s;
        self.thermal_s = other.thermal_s;
        self.overload_s = other.overload_s;
    }

    /// Lets `time_s` pass with the torque asked for; `None` is a power stage that is off.
    pub(super) fn step(&mut self, time_s: f64, torque: Option<f64>, power: bool) {
        self.torque = match torque {
            // Implicit, so that it is stable for any step.
            Some(target) => self.torque + (target - self.torque) * time_s / (self.torque_lag_s + time_s),
            None => 0.0,
        };
        let before = self.velocity;
        self.velocity = self.after_friction(time_s);
        self.acceleration = (self.velocity - before) / time_s;
        let moved = self.fraction + (before + self.velocity) / 2.0 * time_s * 1e9;
        let whole = cast::i64_from_f64(moved);
        self.position = self.position.saturating_add(whole);
        self.fraction = moved - cast::f64_from_i64(whole);
        self.settle_electrics(time_s, power);
    }

    fn after_friction(&self, time_s: f64) -> f64 {
        let driven = self.velocity + self.gain * (self.torque - self.load) * time_s;
        let slowed = driven / (1.0 + self.gain * self.viscous * time_s);
        // Sliding friction takes velocity away but never turns it round; at standstill it holds.
        let sliding = self.gain * self.coulomb * time_s;
        if slowed.abs() <= sliding { 0.0 } else { slowed - sliding.copysign(slowed) }
    }

    fn settle_electrics(&mut self, time_s: f64, power: bool) {
        let (target, slowness) = if power { (1.0, BUS_CHARGE_S) } else { (0.0, BUS_DISCHARGE_S) };
        self.charge += (target - self.charge) * time_s / (slowness + time_s);
        let heat = self.torque * self.torque;
        self.warmth += (heat - self.warmth) * time_s / (self.thermal_s + time_s);
        self.overload += (heat - self.overload) * time_s / (self.overload_s + time_s);
    }

    /// Whether the DC bus has enough voltage.
    pub(super) const fn is_charged(&self) -> bool {
        self.charge >= BUS_CHARGED
    }

    /// The voltage of the DC bus in parts of the nominal one.
    pub(super) fn bus_voltage(&self) -> f64 {
        let power = self.torque * self.velocity / self.rated_velocity;
        self.charge * (1.0 - BUS_SAG * power)
    }

    /// Warming of the motor, in parts of that at rated current.
    pub(super) const fn warmth(&self) -> f64 {
        self.warmth
    }
}

/// Checks the parameters that a plant and its control are made of.
pub(super) fn check(parameters: &ServoParameters) -> Result<(), ServoError> {
    let above_zero = [
        ("encoder_counts", i64::from(parameters.encoder_counts)),
        ("rated_torque", parameters.rated_torque.0),
        ("inertia", parameters.inertia),
        ("rated_velocity", parameters.rated_velocity.0),
        ("velocity_limit", parameters.velocity_limit.0),
        ("torque_limit", parameters.torque_limit.0),
        ("deceleration_limit", parameters.deceleration_limit.0),
        ("position_gain", parameters.position_gain),
        ("velocity_gain", parameters.velocity_gain),
        ("rated_current", parameters.rated_current.0),
        ("bus_voltage", parameters.bus_voltage.0),
        ("thermal_time_constant", parameters.thermal_time_constant.0),
        ("overload_time_constant", parameters.overload_time_constant.0),
        ("marker_distance", parameters.marker_distance.0),
        ("marker_width", parameters.marker_width.0),
        ("marker_distance", parameters.marker_distance.0.saturating_sub(parameters.marker_width.0)),
    ];
    let not_below_zero = [
        ("coulomb_friction", parameters.coulomb_friction.0),
        ("viscous_friction", parameters.viscous_friction.0),
        ("velocity_integral_time", parameters.velocity_integral_time.0),
        ("velocity_feed_forward", parameters.velocity_feed_forward),
        ("torque_time_constant", parameters.torque_time_constant.0),
        ("starting_time", parameters.starting_time.0),
        ("power_up_time", parameters.power_up_time.0),
        ("brake_time", parameters.brake_time.0),
        ("position_error_tolerance", parameters.position_error_tolerance.0),
        ("in_position_window", parameters.in_position_window.0),
        ("standstill_window", parameters.standstill_window.0),
        ("at_velocity_window", parameters.at_velocity_window.0),
    ];
    for (name, value) in above_zero {
        if value <= 0 {
            return Err(ServoError::OutOfRange(name));
        }
    }
    for (name, value) in not_below_zero {
        if value < 0 {
            return Err(ServoError::OutOfRange(name));
        }
    }
    if !(8..=62).contains(&parameters.encoder_bits) {
        return Err(ServoError::OutOfRange("encoder_bits"));
    }
    // Faster than a hundredth of what 64 bits hold is no axis; it would leave the position range within
    // seconds.
    if parameters.velocity_limit.0 > 1_000_000 * NANO {
        return Err(ServoError::OutOfRange("velocity_limit"));
    }
    Ok(())
}
