//! Rows of a drive's program and messages of its poll connection: the one from the other.
//!
//! What stands in a row says `mapping::devicenet`.

mod motion;
mod speed;

use profile_cip::devicenet::master::motion::{UPDATE_LEN, UpdateError};
use profile_cip::wire::Error;

pub use self::motion::MotionLink;
pub use self::speed::SpeedLink;
use crate::mapping::devicenet::ROW_LEN;

/// The values of a drive as its program sees them.
pub type Row = [u8; ROW_LEN];

/// Why a message of a drive was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// Of a CIP Motion drive.
    #[error(transparent)]
    Update(#[from] UpdateError),
    /// Of a velocity drive.
    #[error(transparent)]
    Assembly(#[from] Error),
}

/// The box's end of a poll connection.
#[derive(Debug, Clone)]
pub enum End {
    /// Of a CIP Motion drive.
    Motion(MotionLink),
    /// Of a velocity drive.
    Speed(SpeedLink),
}

impl End {
    /// Lengths of its messages: to the drive, and from it.
    #[must_use]
    pub const fn lengths(&self) -> (usize, usize) {
        match self {
            Self::Motion(_) => (UPDATE_LEN, UPDATE_LEN),
            Self::Speed(link) => link.lengths(),
        }
    }

    /// The connection was taken anew: nothing of before counts.
    pub fn restart(&mut self) {
        match self {
            Self::Motion(link) => link.restart(),
            Self::Speed(link) => link.restart(),
        }
    }

    /// Writes the next message of a drive that is led; `false` when there is none.
    pub fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
        match self {
            Self::Motion(link) => link.emit(row, message),
            Self::Speed(link) => link.emit(row, message),
        }
    }

    /// Writes the next message of a drive that is set up: it asks for nothing.
    pub fn emit_neutral(&mut self, message: &mut [u8]) -> bool {
        match self {
            Self::Motion(link) => link.emit_neutral(message),
            Self::Speed(link) => link.emit_neutral(message),
        }
    }

    /// The message that was written last has gone out: the next one is another one, and does not take its place.
    pub const fn sent(&mut self) {
        if let Self::Motion(link) = self {
            link.sent();
        }
    }

    /// Takes a message that somebody else has sent to the drive into a row of commands: the next message of the drive answers it.
    ///
    /// # Errors
    /// It cannot be read, and the row stays as it was.
    pub fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        match self {
            Self::Motion(link) => link.overhear(message, row),
            Self::Speed(link) => link.overhear(message, row),
        }
    }

    /// The next message of the drive is this one, whatever was sent before.
    pub fn expect(&mut self, message: &[u8]) {
        if let Self::Motion(link) = self {
            link.expect(message);
        }
    }

    /// Takes a message of the drive into its row; `cycle` counts those of the bus.
    ///
    /// # Errors
    /// It does not count, and the row stays as it was.
    pub fn handle(&mut self, cycle: u64, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        match self {
            Self::Motion(link) => link.handle(cycle, message, row),
            Self::Speed(link) => link.handle(message, row),
        }
    }

    /// Whether the drive has answered on this connection: its explicit side can be set up then.
    #[must_use]
    pub const fn is_answered(&self) -> bool {
        match self {
            Self::Motion(link) => link.is_answered(),
            Self::Speed(link) => link.is_answered(),
        }
    }
}

/// Four bytes of a row.
fn word(row: &Row, at: usize) -> [u8; 4] {
    row.get(at..).and_then(|bytes| bytes.first_chunk()).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests;
