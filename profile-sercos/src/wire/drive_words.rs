//! Drive control S-0-0134 and drive status S-0-0135 in the layout of SERCOS III (CP16/3).
//!
//! The service channel bits of SERCOS I and II are gone from both words, and IPOSYNC, real-time and change bits
//! are reserved here.
//!
//! | bit | S-0-0134 | S-0-0135 |
//! |---|---|---|
//! | 15 | drive on | ready state, high bit |
//! | 14 | enable | ready state, low bit |
//! | 13 | 1 follow, 0 halt | class 1 diagnostics error |
//! | 12 | | class 2 diagnostics warning |
//! | 10..8 | operation mode | actual operation mode |
//! | 5 | | position feedback is referenced |
//! | 4 | | halt is active |
//! | 3 | | command values are followed |

use crate::generated::bits::{drive_control, drive_status};
use core::fmt;

use bitflags::bitflags;

const MODE_SHIFT: u32 = MODE_MASK.trailing_zeros();
const MODE_MASK: u16 = drive_control::OPERATION_MODE;
const READY_SHIFT: u32 = drive_status::READY_TO_OPERATE.trailing_zeros();

bitflags! {
    /// Drive control word, S-0-0134. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct DriveControl: u16 {
        /// Drive on; 1 to 0 brakes as well as possible and then removes the torque.
        const ON = drive_control::DRIVE_ON;
        /// Enable; 1 to 0 removes the torque at once.
        const ENABLE = drive_control::ENABLE_DRIVE;
        /// Follow the command values; 1 to 0 halts in control.
        const RESTART = drive_control::RESTART_DRIVE;
        /// Operation mode selection, see [`DriveControl::mode`].
        const MODE = MODE_MASK;
        /// Bits without a public meaning.
        const RESERVED = drive_control::RESERVED;
    }
}

impl DriveControl {
    /// Drive on, enabled and following: 0xE000 in mode 0.
    pub const FOLLOW: DriveControl =
        DriveControl::ON.union(DriveControl::ENABLE).union(DriveControl::RESTART);

    /// Selected operation mode: 0 primary (S-0-0032), 1..=3 S-0-0033..0035, 4..=7 S-0-0284..0287.
    #[must_use]
    pub const fn mode(self) -> u8 {
        ((self.bits() & MODE_MASK) >> MODE_SHIFT).to_le_bytes()[0]
    }

    /// The same word with another operation mode, taken modulo 8.
    #[must_use]
    pub const fn with_mode(self, mode: u8) -> DriveControl {
        DriveControl::from_bits_retain(self.bits() & !MODE_MASK | ((mode as u16) << MODE_SHIFT) & MODE_MASK)
    }
}

/// Ready state of a drive, bits 15..14 of S-0-0135. All four values have a meaning.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum ReadyState {
    /// 00: internal checks are not finished.
    #[default]
    NotReady = 0,
    /// 01: logic ready, main power may be switched on.
    ReadyForPower = 1,
    /// 10: main power applied, no torque.
    PowerOn = 2,
    /// 11: in operation, torque.
    InOperation = 3,
}

impl fmt::Display for ReadyState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ReadyState::NotReady => "not ready",
            ReadyState::ReadyForPower => "ready for main power",
            ReadyState::PowerOn => "ready, main power on",
            ReadyState::InOperation => "in operation",
        })
    }
}

bitflags! {
    /// Drive status word, S-0-0135. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct DriveStatus: u16 {
        /// Ready state, see [`DriveStatus::ready`].
        const READY = drive_status::READY_TO_OPERATE;
        /// Class 1 diagnostics: the drive is locked until S-0-0099 succeeds.
        const ERROR = drive_status::DRIVE_SHUT_DOWN_ERROR;
        /// Class 2 diagnostics: a warning is pending.
        const WARNING = drive_status::DRIVE_WARNING;
        /// Actual operation mode, see [`DriveStatus::mode`].
        const MODE = drive_status::ACTUAL_OPERATION_MODE;
        /// Position feedback refers to machine zero (S-0-0403 bit 0).
        const REFERENCED = drive_status::POSITION_FEEDBACK_VALUE_STATUS;
        /// Halt is active.
        const HALT = drive_status::DRIVE_HALT_ACKNOWLEDGE;
        /// The drive follows the command values.
        const FOLLOWS = drive_status::COMMAND_VALUE_PROCESSING;
        /// Bits without a public meaning.
        const RESERVED = drive_status::RESERVED | drive_status::QUICK_STOP_ACTIVE;
    }
}

impl DriveStatus {
    /// Ready state, bits 15..14.
    #[must_use]
    pub const fn ready(self) -> ReadyState {
        match self.bits() >> READY_SHIFT {
            0 => ReadyState::NotReady,
            1 => ReadyState::ReadyForPower,
            2 => ReadyState::PowerOn,
            _ => ReadyState::InOperation,
        }
    }

    /// The same word with another ready state.
    #[must_use]
    pub const fn with_ready(self, ready: ReadyState) -> DriveStatus {
        DriveStatus::from_bits_retain(
            self.bits() & !drive_status::READY_TO_OPERATE | (ready as u16) << READY_SHIFT,
        )
    }

    /// Actual operation mode, numbered as in [`DriveControl::mode`].
    #[must_use]
    pub const fn mode(self) -> u8 {
        ((self.bits() & MODE_MASK) >> MODE_SHIFT).to_le_bytes()[0]
    }

    /// The same word with another actual operation mode, taken modulo 8.
    #[must_use]
    pub const fn with_mode(self, mode: u8) -> DriveStatus {
        DriveStatus::from_bits_retain(self.bits() & !MODE_MASK | ((mode as u16) << MODE_SHIFT) & MODE_MASK)
    }
}

impl fmt::Display for DriveStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, mode {}", self.ready(), self.mode())?;
        for (bit, name) in [
            (DriveStatus::ERROR, "error"),
            (DriveStatus::WARNING, "warning"),
            (DriveStatus::REFERENCED, "referenced"),
            (DriveStatus::HALT, "halt"),
            (DriveStatus::FOLLOWS, "follows"),
        ] {
            if self.contains(bit) {
                write!(f, ", {name}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_word() {
        assert_eq!(DriveControl::FOLLOW.bits(), 0xE000);
        assert_eq!(DriveControl::FOLLOW.with_mode(5).bits(), 0xE500);
        assert_eq!(DriveControl::from_bits_retain(0xFFFF).with_mode(0).bits(), 0xF8FF);
        assert_eq!(DriveControl::from_bits_retain(0x0700).mode(), 7);
    }

    #[test]
    fn status_word() {
        // Startup recording, frame 5228: 0x8000 in CP4 before power on.
        assert_eq!(DriveStatus::from_bits_retain(0x8000).to_string(), "ready, main power on, mode 0");
        let word = DriveStatus::FOLLOWS.with_ready(ReadyState::InOperation).with_mode(1);
        assert_eq!(word.bits(), 0xC108);
        assert_eq!(word.to_string(), "in operation, mode 1, follows");
        let ready: Vec<_> =
            [0u16, 0x4000, 0x8000, 0xC000].map(|bits| DriveStatus::from_bits_retain(bits).ready()).into();
        use ReadyState::*;
        assert_eq!(ready, [NotReady, ReadyForPower, PowerOn, InOperation]);
        assert_eq!(DriveStatus::from_bits_retain(0xFFFF).with_ready(NotReady).with_mode(0).bits(), 0x38FF);
    }
}
