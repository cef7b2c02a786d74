//! The buses behind the engine: what they have in common.

pub mod commissioner;
pub mod commissioning;
pub mod sercos;

use super::access::{AccessFailure, Data, Progress};
use super::axis::capture::CaptureAccess;
use super::axis::procedure::ProcedureAccess;
use crate::mapping::Item;

/// What an access to a drive was for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A controller's access to an attribute that lives in the drive.
    Attribute {
        /// The motion device's ticket.
        ticket: u32,
        /// Index of the axis's device.
        device: u8,
        /// The attribute.
        attribute: u16,
        /// Whether it writes.
        write: bool,
    },
    /// A diagnostic word, to find the cause of a fault or a warning.
    Diagnosis,
    /// The drive's fault reset.
    FaultReset,
    /// Capturing events, with the generation of the axis's captures.
    Capture(CaptureAccess, u8),
    /// A procedure command, with the generation of the axis's procedures.
    Procedure(ProcedureAccess, u8),
}

/// An answer to an access.
#[derive(Debug)]
pub struct Answer {
    /// The axis.
    pub axis: usize,
    /// What it was for.
    pub purpose: Purpose,
    /// What was accessed.
    pub item: Item,
    /// What was read and how far a command is, or why there is neither.
    pub result: Result<(Data, Progress), AccessFailure>,
}

/// What a drive sent cyclically.
#[derive(Debug, Clone, Copy)]
pub struct Received<'a> {
    /// Its values as they came last: the status word first, then what the drive's program knows.
    pub data: &'a [u8],
    /// Whether they came in the last cycle.
    pub fresh: bool,
    /// Whether the drive takes part: it was heard, and has not been lost for longer than its connection bears.
    pub alive: bool,
}
