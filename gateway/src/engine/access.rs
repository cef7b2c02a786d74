//! What the engine asks of a drive beside the cycle, and what comes back, whatever the drive's profile: the service channel of
//! SERCOS, SDOs of CANopen.

use arrayvec::ArrayVec;

use crate::mapping::Item;

/// Longest value, bytes.
pub const DATA_LEN: usize = 64;

/// The bytes of a value, as the drive keeps them.
pub type Data = ArrayVec<u8, DATA_LEN>;

/// What is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Operation {
    /// Reads the value.
    Read,
    /// Writes it.
    Write(Data),
    /// Executes a procedure command, waits for its end and cancels it.
    Command,
    /// Sets a procedure command; it stays set.
    Start,
    /// Asks how far a procedure command is.
    Progress,
    /// Cancels a procedure command.
    Cancel,
}

/// An access to something that a drive keeps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Access {
    /// What it is.
    pub item: Item,
    /// What is done with it.
    pub operation: Operation,
    /// Goes before all that is not.
    pub urgent: bool,
}

impl Access {
    /// An access that can wait.
    #[must_use]
    pub const fn new(item: Item, operation: Operation) -> Self {
        Self { item, operation, urgent: false }
    }

    /// Reads a value.
    #[must_use]
    pub const fn read(item: Item) -> Self {
        Self::new(item, Operation::Read)
    }

    /// Writes a value; `None` when it has more than [`DATA_LEN`] bytes.
    #[must_use]
    pub fn write(item: Item, bytes: &[u8]) -> Option<Self> {
        Some(Self::new(item, Operation::Write(ArrayVec::try_from(bytes).ok()?)))
    }

    /// The same before all that can wait.
    #[must_use]
    pub fn urgent(self) -> Self {
        Self { urgent: true, ..self }
    }
}

/// How far a procedure command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Progress {
    /// It is not set, or the item is no command.
    #[default]
    None,
    /// The drive works on it, or will when it is let.
    InProcess,
    /// The procedure command has ended with success.
    Done,
    /// The procedure command has ended with an error.
    Failed,
}

/// Why the drive refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// It has no such item.
    Unknown,
    /// It can only be read.
    ReadOnly,
    /// The value has the wrong length, or is one that the drive does not take.
    Value,
    /// Anything else: mostly that it is not the time for it.
    Other,
}

/// Why an access brought nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccessFailure {
    /// The drive refused.
    Refused(Refusal),
    /// It did not answer in time, is gone, or has said what could not be understood.
    Unanswered,
}
