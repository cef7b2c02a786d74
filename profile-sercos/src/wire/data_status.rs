//! Data status: the answer to opening a data block.
//!
//! Parameters: bit 8 set when the operation data is invalid. Procedure commands: bits 3..0 say how far the
//! command is (set, started, busy, error).

use crate::generated::bits::{data_status, procedure_acknowledgement};
use core::fmt;

use bitflags::bitflags;

bitflags! {
    /// The data status word. Reserved bits are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct DataStatus: u16 {
        /// Procedure command: set in the slave.
        const SET = procedure_acknowledgement::SET_IN_DRIVE;
        /// Procedure command: started.
        const STARTED = procedure_acknowledgement::STARTED;
        /// Procedure command: not finished.
        const BUSY = procedure_acknowledgement::BUSY;
        /// Procedure command: failed.
        const ERROR = procedure_acknowledgement::ERROR;
        /// Parameter: the operation data is invalid.
        const INVALID = data_status::OPERATION_DATA_INVALID;
        /// Reserved bits, transmitted as 0.
        const RESERVED = !0x010F;
    }
}

/// How far a procedure command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CommandState {
    /// Not set, or cancelled: 0x0.
    Idle,
    /// Set but not started: 0x1.
    Set,
    /// Set, started and executed without error: 0x3.
    Done,
    /// Interrupted by the master: 0x5, and 0x6 as one master's constants have it.
    Interrupted,
    /// Being executed: 0x7.
    InProcess,
    /// Failed: bit 3, busy still set (0xF) or not (0xB).
    Failed,
    /// A pattern without meaning.
    Undefined(u8),
}

impl DataStatus {
    /// The procedure command's state in bits 3..0.
    #[must_use]
    pub const fn command_state(self) -> CommandState {
        let nibble = self.bits().to_le_bytes()[0] & 0xF;
        match nibble {
            0x0 => CommandState::Idle,
            0x1 => CommandState::Set,
            0x3 => CommandState::Done,
            0x5 | 0x6 => CommandState::Interrupted,
            0x7 => CommandState::InProcess,
            0x8..=0xF => CommandState::Failed,
            other => CommandState::Undefined(other),
        }
    }

    /// Whether the parameter's operation data is valid.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        !self.contains(DataStatus::INVALID)
    }
}

impl fmt::Display for CommandState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CommandState::Idle => f.write_str("not set"),
            CommandState::Set => f.write_str("set, not started"),
            CommandState::Done => f.write_str("done"),
            CommandState::Interrupted => f.write_str("interrupted"),
            CommandState::InProcess => f.write_str("in process"),
            CommandState::Failed => f.write_str("failed"),
            CommandState::Undefined(nibble) => write!(f, "undefined state {nibble:#x}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_state() {
        let states: Vec<String> =
            (0..16).map(|bits| DataStatus::from_bits_retain(bits).command_state().to_string()).collect();
        assert_eq!(
            states,
            [
                "not set",
                "set, not started",
                "undefined state 0x2",
                "done",
                "undefined state 0x4",
                "interrupted",
                "interrupted",
                "in process",
                "failed",
                "failed",
                "failed",
                "failed",
                "failed",
                "failed",
                "failed",
                "failed",
            ]
        );
    }

    #[test]
    fn validity_is_bit_8() {
        assert!(DataStatus::empty().is_valid());
        assert!(!DataStatus::from_bits_retain(0x0100).is_valid());
        assert_eq!(DataStatus::from_bits_retain(0xFFFF).bits(), 0xFFFF);
    }
}
