//! A simulated servo axis: the drive, its motor and its load.
//!
//! It is what stands behind the simulated slaves and nodes: a cascade of position, velocity and torque loops
//! on an inertia with friction, seen through a quantised encoder that wraps. It lags and overshoots as a
//! drive does. Time is told to it, and the same commands always give the same motion.
//!
//! Inside it computes in floating point; at its edges stand the integer quantities of the generic model. The
//! actual position is an integer with a fraction, so that it does not lose resolution far from zero.

use crate::fault::FaultCause;
use crate::image::StatusBits;
use crate::mode::OperatingMode;
use crate::quantity::{
    Acceleration, Current, Position, Temperature, Torque, TorqueAbsolute, Velocity, Voltage,
};
use crate::scaling::UnitKind;
use crate::state::Report;
use crate::time::{DurationNs, MonotonicTime};

mod captures;
mod control;
mod drive;
mod marks;
pub mod motion;
mod plant;

pub use drive::Servo;
pub use marks::Marks;

/// The longest step of the simulation inside [`Servo::step`].
pub const SUB_STEP: DurationNs = DurationNs(31_250);

/// The longest time that one call of [`Servo::step`] may cover.
pub const MAX_STEP: DurationNs = DurationNs::from_millis(100);

/// The most faults that can be active at once.
pub const MAX_ACTIVE_FAULTS: usize = 8;

/// Bits of [`ServoActual::digital_inputs`].
pub mod input {
    /// The home switch.
    pub const HOME_SWITCH: u32 = 1 << 0;
    /// Registration input 1.
    pub const REGISTRATION_1: u32 = 1 << 1;
    /// Registration input 2.
    pub const REGISTRATION_2: u32 = 1 << 2;
    /// The inputs set with [`super::Servo::set_inputs`] begin at this bit.
    pub const USER_SHIFT: u32 = 8;
}

/// What drive, motor and load are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoParameters {
    /// Whether the axis turns or moves along a line.
    pub kind: UnitKind,
    /// Counts of the encoder in one axis unit, above zero.
    pub encoder_counts: u32,
    /// Bits of the encoder's counter, 8 to 62.
    pub encoder_bits: u32,
    /// Where the axis is at the beginning.
    pub start_position: Position,
    /// Rated torque or force, above zero.
    pub rated_torque: TorqueAbsolute,
    /// Inertia of motor and load in nano kilogram metre squared, or their mass in micro kilogram; above zero.
    pub inertia: i64,
    /// Sliding friction, in parts of the rated torque.
    pub coulomb_friction: Torque,
    /// Friction that grows with the velocity, in parts of the rated torque at rated velocity.
    pub viscous_friction: Torque,
    /// Rated velocity, above zero.
    pub rated_velocity: Velocity,
    /// The velocity loop does not ask for more than this; above zero.
    pub velocity_limit: Velocity,
    /// The torque does not rise beyond this, in either direction; above zero.
    pub torque_limit: Torque,
    /// Deceleration of a controlled stop, above zero.
    pub deceleration_limit: Acceleration,
    /// Gain of the position loop in 1e-6 per second, above zero and at most half of the velocity loop's.
    pub position_gain: i64,
    /// Gain of the velocity loop in 1e-6 per second: acceleration asked for per velocity error; above zero.
    pub velocity_gain: i64,
    /// Integral action time of the velocity loop; zero for none, else at least two over the gain.
    pub velocity_integral_time: DurationNs,
    /// Part of the velocity of the position set-point that is fed forward, in parts per million.
    pub velocity_feed_forward: i64,
    /// Time constant of the torque (current) loop.
    pub torque_time_constant: DurationNs,
    /// From the enable to the torque: commutation.
    pub starting_time: DurationNs,
    /// From a charged DC bus until the drive is ready.
    pub power_up_time: DurationNs,
    /// How long the brake takes to open once there is torque, and to close at standstill before the torque ends. The
    /// axis follows nothing meanwhile.
    pub brake_time: DurationNs,
    /// Position error that makes the drive fault; zero for none.
    pub position_error_tolerance: Position,
    /// Distance from the set-point within which the axis is in position.
    pub in_position_window: Position,
    /// Velocity below which the axis stands.
    pub standstill_window: Velocity,
    /// Distance from the velocity set-point within which the axis is at velocity.
    pub at_velocity_window: Velocity,
    /// Motor current at rated torque, above zero.
    pub rated_current: Current,
    /// Voltage of the DC bus when it is charged, above zero.
    pub bus_voltage: Voltage,
    /// Temperature of the surroundings.
    pub ambient_temperature: Temperature,
    /// How much warmer than its surroundings the motor gets at rated current.
    pub temperature_rise: Temperature,
    /// Time constant of the motor's warming, above zero.
    pub thermal_time_constant: DurationNs,
    /// Temperature at which the drive faults.
    pub max_temperature: Temperature,
    /// Time constant of the overload model (current squared over time), above zero.
    pub overload_time_constant: DurationNs,
    /// Distance from one marker of the encoder to the next, above zero. A marker stands at position zero.
    pub marker_distance: Position,
    /// How long a marker is, from its place upward; above zero and below the distance.
    pub marker_width: Position,
}

impl Default for ServoParameters {
    /// A rotary servo of 1 Nm and 3000 revolutions per minute.
    fn default() -> Self {
        Self {
            kind: UnitKind::Rotary,
            encoder_counts: 1 << 20,
            encoder_bits: 32,
            start_position: Position::ZERO,
            rated_torque: TorqueAbsolute(1_000_000),
            inertia: 100_000,
            coulomb_friction: Torque(20_000),
            viscous_friction: Torque(30_000),
            rated_velocity: Velocity(50_000_000_000),
            velocity_limit: Velocity(60_000_000_000),
            torque_limit: Torque(3_000_000),
            deceleration_limit: Acceleration(500_000_000_000),
            position_gain: 50_000_000,
            velocity_gain: 400_000_000,
            velocity_integral_time: DurationNs::from_millis(10),
            velocity_feed_forward: 0,
            torque_time_constant: DurationNs::from_micros(500),
            starting_time: DurationNs::from_millis(5),
            power_up_time: DurationNs::ZERO,
            brake_time: DurationNs::ZERO,
            position_error_tolerance: Position(2_000_000_000),
            in_position_window: Position(1_000_000),
            standstill_window: Velocity(50_000_000),
            at_velocity_window: Velocity(50_000_000),
            rated_current: Current(3_000_000),
            bus_voltage: Voltage(560_000_000),
            ambient_temperature: Temperature(25_000),
            temperature_rise: Temperature(80_000),
            thermal_time_constant: DurationNs::from_secs(600),
            max_temperature: Temperature(140_000),
            overload_time_constant: DurationNs::from_secs(10),
            marker_distance: Position(1_000_000_000),
            marker_width: Position(1_000_000),
        }
    }
}

/// The parameters describe no servo that works.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServoError {
    /// A value that has to be above zero (or not below it) is not, or one is out of its range.
    #[error("servo parameter {0} is out of range")]
    OutOfRange(&'static str),
    /// The loops would oscillate.
    #[error("servo parameter {0} makes the control loops unstable")]
    Unstable(&'static str),
}

/// What the drive is told to do, as the control word of a real one tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ServoControl {
    /// No torque, at once.
    #[default]
    TorqueOff,
    /// Stop under control, then no torque.
    Disable,
    /// Torque, and follow the set-points. Only a change from [`ServoControl::TorqueOff`] or
    /// [`ServoControl::Disable`] seen while the drive is ready switches the torque on.
    Enable,
    /// Stop under control, keep the torque, hold the position.
    Halt,
}

/// The inputs of the drive for one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoCommand {
    /// What to do.
    pub control: ServoControl,
    /// Whether the power stage has its supply.
    pub power: bool,
    /// A change from `false` to `true` acknowledges the fault.
    pub reset_fault: bool,
    /// What to follow.
    pub mode: OperatingMode,
    /// Position set-point, in position mode. It is approached in a straight line during the step.
    pub position: Position,
    /// Velocity set-point, in velocity mode.
    pub velocity: Velocity,
    /// Acceleration set-point, in acceleration mode.
    pub acceleration: Acceleration,
    /// Torque set-point, in torque mode.
    pub torque: Torque,
    /// Added to the velocity set-point of the velocity loop.
    pub velocity_offset: Velocity,
    /// Added to the torque set-point of the torque loop.
    pub torque_offset: Torque,
}

impl Default for ServoCommand {
    fn default() -> Self {
        Self {
            control: ServoControl::TorqueOff,
            power: true,
            reset_fault: false,
            mode: OperatingMode::None,
            position: Position::ZERO,
            velocity: Velocity::ZERO,
            acceleration: Acceleration::ZERO,
            torque: Torque::ZERO,
            velocity_offset: Velocity::ZERO,
            torque_offset: Torque::ZERO,
        }
    }
}

/// The outputs of the drive after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoActual {
    /// The state of the drive.
    pub report: Report,
    /// Actual position, as the encoder counts it, unrolled.
    pub position: Position,
    /// The encoder's counter, 0 to two to the number of its bits.
    pub encoder: i64,
    /// Actual velocity.
    pub velocity: Velocity,
    /// Actual acceleration.
    pub acceleration: Acceleration,
    /// Actual torque.
    pub torque: Torque,
    /// Motor current, with the sign of the torque.
    pub current: Current,
    /// Voltage of the DC bus.
    pub bus_voltage: Voltage,
    /// Temperature of the motor.
    pub temperature: Temperature,
    /// Use of the overload model: parts per million of what the motor stands for ever.
    pub overload: i64,
    /// Position set-point in effect less actual position; zero outside position control.
    pub following_error: Position,
    /// Digital inputs, see [`input`].
    pub digital_inputs: u32,
    /// Status bits.
    pub status: StatusBits,
    /// The latched fault.
    pub fault: Option<FaultCause>,
    /// The warning raised from outside.
    pub warning: Option<FaultCause>,
    /// The simulated instant.
    pub at: MonotonicTime,
}

#[cfg(test)]
mod tests;
