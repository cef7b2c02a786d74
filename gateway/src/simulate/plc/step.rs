//! What the controller does, step by step.

use std::fmt;
use std::time::Duration;

use profile_cip::assembly::handshake::Status;
use profile_cip::assembly::{Control, Refusal};
use profile_generic::fault::FaultCause;

/// A movement to a target, in counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Movement {
    /// Where to, or how far.
    pub target: i64,
    /// The target counts from the position set-point.
    pub relative: bool,
    /// Velocity, counts/s.
    pub velocity: i64,
    /// Acceleration, counts/s^2; 0 takes the limit of the axis.
    pub acceleration: i64,
}

/// What is expected of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// All of these bits of the status word are on, or off.
    Status {
        /// The bits.
        bits: Status,
        /// Whether they are on.
        on: bool,
    },
    /// Cause of the fault; 0 for none.
    Fault(FaultCause),
    /// Why the last order was refused.
    Refusal(Refusal),
    /// The actual position, counts.
    Position {
        /// Expected.
        value: i64,
        /// May differ by so much.
        tolerance: i64,
    },
    /// The actual velocity, counts/s.
    Velocity {
        /// Expected.
        value: i64,
        /// May differ by so much.
        tolerance: i64,
    },
}

/// A step. Axes count from 0, in the order of the assemblies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Enables axes, and waits until they are in operation.
    Enable(Vec<usize>),
    /// Takes their torque away, and waits until it is off.
    Disable(Vec<usize>),
    /// Resets their faults, and waits until they have none.
    FaultReset(Vec<usize>),
    /// Brakes them, and waits until they stand.
    Stop(Vec<usize>),
    /// Moves an axis to a target.
    Move {
        /// The axis.
        axis: usize,
        /// The movement.
        movement: Movement,
        /// Until it is there; else until the movement has begun.
        wait: bool,
    },
    /// Lets an axis follow a velocity.
    Velocity {
        /// The axis.
        axis: usize,
        /// Velocity, counts/s.
        velocity: i64,
        /// Acceleration, counts/s^2; 0 takes the limit of the axis.
        acceleration: i64,
        /// Until it has this velocity; else until it is in the mode.
        wait: bool,
    },
    /// Writes the control word of an axis as it is.
    Word {
        /// The axis.
        axis: usize,
        /// The word.
        word: Control,
    },
    /// Writes a field of an axis.
    Set {
        /// The axis.
        axis: usize,
        /// Name of the field.
        field: &'static str,
        /// The value as it is sent.
        value: i64,
    },
    /// Goes on with what is sent for a time.
    Dwell(Duration),
    /// Is idle for a time, and runs again.
    Idle(Duration),
    /// Sends nothing for a time.
    Silence(Duration),
    /// Closes the connection.
    Close,
    /// Opens a connection, with the output as it is. One that is open is left without a word.
    Connect,
    /// Waits for something.
    Expect {
        /// The axis.
        axis: usize,
        /// What is expected.
        condition: Condition,
    },
}

/// A step with what goes with any of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Planned {
    /// The step.
    pub step: Step,
    /// How long it may take.
    pub within: Duration,
    /// What it does, in words.
    pub title: String,
    /// Its line in a script.
    pub line: Option<usize>,
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Status { bits, on } => {
                write!(f, "{} {}", names(*bits), if *on { "on" } else { "off" })
            }
            Self::Fault(FaultCause(0)) => f.write_str("no fault"),
            Self::Fault(cause) => write!(f, "the fault {cause}"),
            Self::Refusal(Refusal::NONE) => f.write_str("no refusal"),
            Self::Refusal(refusal) => write!(f, "the refusal {refusal}"),
            Self::Position { value, tolerance } => write!(f, "position {value} +/- {tolerance} counts"),
            Self::Velocity { value, tolerance } => write!(f, "velocity {value} +/- {tolerance} counts/s"),
        }
    }
}

/// Bits of a status word by their names.
pub(super) fn names(bits: Status) -> String {
    let names = bits.iter_names().map(|(name, _)| name.to_lowercase().replace('_', " "));
    let names = names.collect::<Vec<_>>().join(", ");
    if names.is_empty() { "nothing".to_owned() } else { names }
}
