//! Orders of local control, their answers, and the reasons for refusals.

use std::fmt;

use profile_generic::fault::FaultCause;
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;

use crate::engine::axis::Awaited;
use crate::engine::generator::Misfit;
use crate::engine::parameter::ParameterFailure;

/// A connection to local control. Numbers are not used again while the gateway runs, and start at 1.
pub type ClientId = u32;

/// An order for one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Switch the torque on; the axis holds its position.
    Enable,
    /// Stop as configured and switch the torque off.
    Disable,
    /// Stop and hold the position.
    Stop,
    /// Clear the faults.
    Reset,
    /// Move at this velocity for a time; repeat the order to keep moving.
    Jog(Jog),
    /// Move to a position.
    Move(Move),
    /// Run the homing procedure of the drive.
    Home,
}

/// A movement without a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jog {
    /// The sign is the direction.
    pub velocity: Velocity,
    /// Acceleration and deceleration; `None` takes the configured one.
    pub acceleration: Option<Acceleration>,
    /// How long the axis moves before it brakes: at most [`super::JOG_TIME`].
    pub time: DurationNs,
}

/// A movement to a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Move {
    /// The target.
    pub to: Position,
    /// Above zero.
    pub velocity: Velocity,
    /// Acceleration and deceleration; `None` takes the configured one.
    pub acceleration: Option<Acceleration>,
    /// Who generates the profile; `None` takes the drive if it is set up for positioning.
    pub by: Option<Generator>,
}

/// Who generates the profile of a movement to a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generator {
    /// The drive, which gets the target.
    Drive,
    /// The gateway, which sends position set-points.
    Gateway,
}

impl Order {
    /// The word for it in the protocol.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Enable => "enable",
            Self::Disable => "disable",
            Self::Stop => "stop",
            Self::Reset => "reset",
            Self::Jog(_) => "jog",
            Self::Move(_) => "move",
            Self::Home => "home",
        }
    }
}

/// From a client to the engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// An order for an axis.
    Order {
        /// Who has sent it; the answer goes there.
        client: ClientId,
        /// Returned in the [`Answer`].
        id: u32,
        /// Position of the axis in the configuration, from 0.
        axis: u8,
        /// What is to be done.
        order: Order,
    },
    /// An access to a parameter of a drive.
    Parameter {
        /// Who has sent it; the answer goes there.
        client: ClientId,
        /// Returned in the [`Answer`].
        id: u32,
        /// Position of the axis in the configuration, from 0.
        axis: u8,
        /// The parameter.
        parameter: Parameter,
        /// What is written, in the unit of the parameter's quantity; `None` reads.
        wanted: Option<i64>,
    },
    /// The client has disconnected: its axes stop and lose their torque.
    Gone {
        /// Who has sent it; the answer goes there.
        client: ClientId,
    },
}

/// Result of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// The client that gave it.
    pub client: ClientId,
    /// The number of the order.
    pub id: u32,
    /// `Ok` once the effect was measured; with the value of a parameter, in the unit of its quantity.
    pub result: Result<Option<i64>, Failure>,
}

/// Why an order was refused or not completed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// No such axis.
    NoAxis,
    /// A controller is connected to the device of the axis.
    Controller,
    /// Another client controls the axis.
    Held,
    /// The gateway is stopping.
    Ending,
    /// The axis is an encoder or a converter.
    NeverMoves,
    /// The axis stays in this state, waiting for this.
    State(DriveState, Option<Awaited>),
    /// The axis is not in operation but in this state.
    NotEnabled(DriveState),
    /// The drive is still halting the axis, or has to stop it because its controller has disconnected.
    Stopping,
    /// The axis has this fault.
    Fault(FaultCause),
    /// The drive is not set up for this mode.
    Mode(ModeSelection),
    /// Neither the order nor the configuration gives an acceleration.
    NoAcceleration,
    /// Above this limit of the configuration.
    TooFast(Velocity),
    /// Above this limit of the configuration.
    TooSteep(Acceleration),
    /// The target is beyond this limit of the configuration.
    Beyond(Position),
    /// Velocity or acceleration is zero or negative.
    NotPositive,
    /// The drive reports that homing failed.
    HomingFailed,
    /// The order did not complete in time.
    TimedOut,
    /// The axis stands here, too far from its target.
    OffTarget(Position),
    /// This order replaced it.
    Replaced(&'static str),
    /// A controller connected; the axis stops.
    Taken,
    /// A parameter was not read or written.
    Parameter(ParameterFailure),
}

impl From<Misfit> for Failure {
    fn from(misfit: Misfit) -> Self {
        match misfit {
            Misfit::Mode(mode) => Self::Mode(mode),
            Misfit::NoAcceleration => Self::NoAcceleration,
            Misfit::NotPositive => Self::NotPositive,
            Misfit::TooFast(limit) => Self::TooFast(limit),
            Misfit::TooSteep(limit) => Self::TooSteep(limit),
            Misfit::Beyond(limit) => Self::Beyond(limit),
        }
    }
}

impl Failure {
    /// The code in the protocol. Codes never change.
    #[must_use]
    // A flat match: one arm for each variant.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::NoAxis => "no-axis",
            Self::Controller => "controller",
            Self::Held => "held",
            Self::Ending => "ending",
            Self::NeverMoves => "never-moves",
            Self::State(..) => "state",
            Self::NotEnabled(_) => "not-enabled",
            Self::Stopping => "stopping",
            Self::Fault(_) => "fault",
            Self::Mode(_) => "mode",
            Self::NoAcceleration => "no-acceleration",
            Self::TooFast(_) => "too-fast",
            Self::TooSteep(_) => "too-steep",
            Self::Beyond(_) => "beyond",
            Self::NotPositive => "not-positive",
            Self::HomingFailed => "homing-failed",
            Self::TimedOut => "timed-out",
            Self::OffTarget(_) => "off-target",
            Self::Replaced(_) => "replaced",
            Self::Taken => "taken",
            Self::Parameter(failure) => match failure {
                ParameterFailure::Absent => "absent",
                ParameterFailure::ReadOnly => "read-only",
                ParameterFailure::Value => "value",
                ParameterFailure::Torque => "torque",
                ParameterFailure::NoValue(_) => "no-value",
                ParameterFailure::NotKept => "not-kept",
                ParameterFailure::Refused => "refused",
                ParameterFailure::Unanswered => "unanswered",
                ParameterFailure::Busy => "busy",
            },
        }
    }
}

impl fmt::Display for Failure {
    // A flat match: one arm for each variant.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAxis => f.write_str("no such axis"),
            Self::Controller => f.write_str("a controller is connected to the device of this axis"),
            Self::Held => f.write_str("another client controls this axis"),
            Self::Ending => f.write_str("the gateway is stopping"),
            Self::NeverMoves => f.write_str("the axis is configured as an encoder or a converter"),
            Self::State(state, None) => write!(f, "the axis stays in state {state}"),
            Self::State(state, Some(awaited)) => {
                write!(f, "the axis stays in state {state}: it waits for {awaited}")
            }
            Self::NotEnabled(state) => write!(f, "the axis is in state {state}: enable it first"),
            Self::Stopping => f.write_str("the axis is still stopping"),
            Self::Fault(cause) => write!(f, "the axis has the fault {cause}"),
            Self::Mode(mode) => write!(f, "the drive is not set up for {mode} (key `modes` of the drive)"),
            Self::NoAcceleration => {
                f.write_str("neither the order nor the configuration has an acceleration")
            }
            Self::TooFast(limit) => write!(f, "the velocity limit of the axis is {limit}"),
            Self::TooSteep(limit) => write!(f, "the acceleration limit of the axis is {limit}"),
            Self::Beyond(limit) => write!(f, "the position limit of the axis is {limit}"),
            Self::NotPositive => f.write_str("velocity and acceleration must be above zero"),
            Self::HomingFailed => f.write_str("the drive reports that homing failed"),
            Self::TimedOut => f.write_str("the order did not complete in time"),
            Self::OffTarget(place) => write!(f, "the axis stands at {place}, not at its target"),
            Self::Replaced(by) => write!(f, "replaced by `{by}`"),
            Self::Taken => f.write_str("a controller connected: the axis stops"),
            Self::Parameter(failure) => failure.fmt(f),
        }
    }
}
