//! Controlword, object 6040h.
//!
//! | bit | meaning |
//! |---|---|
//! | 0 | switch on |
//! | 1 | enable voltage |
//! | 2 | quick stop; 0 does it |
//! | 3 | enable operation |
//! | 4..6, 9 | of the mode of operation |
//! | 7 | fault reset, on its rising edge |
//! | 8 | halt |
//! | 10 | reserved |
//! | 11..15 | of the manufacturer |

use crate::generated::bits::controlword;
use core::fmt;

use bitflags::bitflags;

bitflags! {
    /// Controlword. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Controlword: u16 {
        /// Bit 0: switch on.
        const SWITCH_ON = controlword::SWITCH_ON;
        /// Bit 1: enable voltage.
        const ENABLE_VOLTAGE = controlword::ENABLE_VOLTAGE;
        /// Bit 2: 0 makes a quick stop.
        const QUICK_STOP = controlword::QUICK_STOP;
        /// Bit 3: enable operation.
        const ENABLE_OPERATION = controlword::ENABLE_OPERATION;
        /// Bit 4, of the mode of operation.
        const MODE_4 = controlword::NEW_SET_POINT;
        /// Bit 5, of the mode of operation.
        const MODE_5 = controlword::CHANGE_SET_IMMEDIATELY;
        /// Bit 6, of the mode of operation.
        const MODE_6 = controlword::RELATIVE;
        /// Bit 7: a rising edge resets the fault.
        const FAULT_RESET = controlword::FAULT_RESET;
        /// Bit 8: halt.
        const HALT = controlword::HALT;
        /// Bit 9, of the mode of operation.
        const MODE_9 = controlword::CHANGE_ON_SET_POINT;
        /// Bit 10.
        const RESERVED = 1 << 10;
        /// Bits 11 to 15.
        const MANUFACTURER = controlword::MANUFACTURER_SPECIFIC;
    }
}

/// Bits by the name that they have in one mode of operation.
impl Controlword {
    /// pp: a rising edge hands over a set-point.
    pub const NEW_SET_POINT: Self = Self::MODE_4;
    /// pp: the set-point replaces the one that is under way, instead of following it.
    pub const CHANGE_IMMEDIATELY: Self = Self::MODE_5;
    /// pp: the target is a distance.
    pub const RELATIVE: Self = Self::MODE_6;
    /// pp: the next set-point is taken on at speed, without a stop between.
    pub const CHANGE_ON_SET_POINT: Self = Self::MODE_9;
    /// vl: the ramp generator runs.
    pub const ENABLE_RAMP: Self = Self::MODE_4;
    /// vl: 0 holds the output of the ramp generator.
    pub const UNLOCK_RAMP: Self = Self::MODE_5;
    /// vl: 0 leads the ramp to 0 instead of the target.
    pub const REFERENCE_RAMP: Self = Self::MODE_6;
    /// hm: start; 0 ends homing.
    pub const START_HOMING: Self = Self::MODE_4;
    /// ip: follow the interpolation data.
    pub const ENABLE_INTERPOLATION: Self = Self::MODE_4;
}

/// What bits 7 and 3 to 0 ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Command {
    /// `0 x 1 1 0`.
    Shutdown,
    /// `0 0 1 1 1`; in *operation enabled* it disables operation.
    SwitchOn,
    /// `0 1 1 1 1`; in *ready to switch on* it switches on first.
    EnableOperation,
    /// `0 x x 0 x`.
    DisableVoltage,
    /// `0 x 0 1 x`.
    QuickStop,
}

impl Command {
    /// Every command.
    pub const ALL: [Self; 5] =
        [Self::Shutdown, Self::SwitchOn, Self::EnableOperation, Self::DisableVoltage, Self::QuickStop];

    /// The command of a word; `None` while bit 7 is set, whose edge is a command of its own.
    #[must_use]
    pub const fn decode(word: Controlword) -> Option<Self> {
        let bits = word.bits();
        if bits & 0x82 == 0 {
            Some(Self::DisableVoltage)
        } else if bits & 0x86 == 0x02 {
            Some(Self::QuickStop)
        } else if bits & 0x87 == 0x06 {
            Some(Self::Shutdown)
        } else if bits & 0x8F == 0x07 {
            Some(Self::SwitchOn)
        } else if bits & 0x8F == 0x0F {
            Some(Self::EnableOperation)
        } else {
            None
        }
    }

    /// The word that asks for it, with all other bits 0.
    #[must_use]
    pub const fn word(self) -> Controlword {
        Controlword::from_bits_retain(match self {
            Self::Shutdown => 0x06,
            Self::SwitchOn => 0x07,
            Self::EnableOperation => 0x0F,
            Self::DisableVoltage => 0x00,
            Self::QuickStop => 0x02,
        })
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shutdown => "shutdown",
            Self::SwitchOn => "switch on",
            Self::EnableOperation => "enable operation",
            Self::DisableVoltage => "disable voltage",
            Self::QuickStop => "quick stop",
        }
    }
}

impl Controlword {
    /// The same word with the bits of a command, 7 and 3 to 0.
    #[must_use]
    pub const fn with_command(self, command: Command) -> Self {
        Self::from_bits_retain(self.bits() & !0x8F | command.word().bits())
    }
}

impl fmt::Display for Controlword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Command::decode(*self) {
            Some(command) => f.write_str(command.name())?,
            None => f.write_str("fault reset")?,
        }
        if self.contains(Self::HALT) {
            f.write_str(", halt")?;
        }
        for (bit, number) in [(Self::MODE_4, 4), (Self::MODE_5, 5), (Self::MODE_6, 6), (Self::MODE_9, 9)] {
            if self.contains(bit) {
                write!(f, ", bit {number}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words and what they ask for: ros2_canopen `command.cpp`, python canopen `p402.py`.
    const VECTORS: [(u16, Option<Command>); 10] = [
        (0x0006, Some(Command::Shutdown)),
        (0x0007, Some(Command::SwitchOn)),
        (0x000F, Some(Command::EnableOperation)),
        (0x010F, Some(Command::EnableOperation)),
        (0x003F, Some(Command::EnableOperation)),
        (0x0000, Some(Command::DisableVoltage)),
        (0x000D, Some(Command::DisableVoltage)),
        (0x0002, Some(Command::QuickStop)),
        (0x0080, None),
        (0x008F, None),
    ];

    #[test]
    fn words_ask_for_commands() {
        for (word, command) in VECTORS {
            assert_eq!(Command::decode(Controlword::from_bits_retain(word)), command, "{word:04x}");
        }
    }

    #[test]
    fn every_word_without_bit_7_is_one_command_and_leads_back() {
        for bits in 0..=u16::MAX {
            let word = Controlword::from_bits_retain(bits);
            let command = Command::decode(word);
            assert_eq!(command.is_none(), bits & 0x80 != 0, "{bits:04x}");
            if let Some(command) = command {
                assert_eq!(Command::decode(word.with_command(command)), Some(command));
                assert_eq!(word.with_command(command).bits() & !0x8F, bits & !0x8F);
            }
        }
    }

    #[test]
    fn words_print_what_they_ask_for() {
        let text = |bits| Controlword::from_bits_retain(bits).to_string();
        assert_eq!(text(0x013F), "enable operation, halt, bit 4, bit 5");
        assert_eq!(text(0x0080), "fault reset");
    }
}
