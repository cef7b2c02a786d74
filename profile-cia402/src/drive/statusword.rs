//! Statusword, object 6041h.
//!
//! | bit | meaning |
//! |---|---|
//! | 0 | ready to switch on |
//! | 1 | switched on |
//! | 2 | operation enabled |
//! | 3 | fault |
//! | 4 | voltage enabled; comes and goes with the mains, and is no part of the state |
//! | 5 | quick stop; 0 is active |
//! | 6 | switch on disabled |
//! | 7 | warning |
//! | 8, 14, 15 | of the manufacturer |
//! | 9 | remote: the controlword is obeyed |
//! | 10 | target reached |
//! | 11 | an internal limit is active |
//! | 12, 13 | of the mode of operation |

use crate::generated::bits::statusword;
use core::fmt;

use bitflags::bitflags;

use super::modes::Mode;
use super::states::State;

bitflags! {
    /// Statusword. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Statusword: u16 {
        /// Bit 0: ready to switch on.
        const READY_TO_SWITCH_ON = statusword::READY_TO_SWITCH_ON;
        /// Bit 1: switched on.
        const SWITCHED_ON = statusword::SWITCHED_ON;
        /// Bit 2: operation enabled.
        const OPERATION_ENABLED = statusword::OPERATION_ENABLED;
        /// Bit 3: fault.
        const FAULT = statusword::FAULT;
        /// Bit 4: the power stage has its voltage.
        const VOLTAGE_ENABLED = statusword::VOLTAGE_ENABLED;
        /// Bit 5: 0 while a quick stop is active.
        const QUICK_STOP = statusword::QUICK_STOP;
        /// Bit 6: switch on disabled.
        const SWITCH_ON_DISABLED = statusword::SWITCH_ON_DISABLED;
        /// Bit 7: warning.
        const WARNING = statusword::WARNING;
        /// Bit 8, of the manufacturer.
        const MANUFACTURER_8 = statusword::MANUFACTURER_SPECIFIC;
        /// Bit 9: the controlword is obeyed.
        const REMOTE = statusword::REMOTE;
        /// Bit 10: target reached; with halt, standing.
        const TARGET_REACHED = statusword::TARGET_REACHED;
        /// Bit 11: an internal limit is active.
        const INTERNAL_LIMIT = statusword::INTERNAL_LIMIT_ACTIVE;
        /// Bit 12, of the mode of operation.
        const MODE_12 = statusword::SET_POINT_ACKNOWLEDGE;
        /// Bit 13, of the mode of operation.
        const MODE_13 = statusword::FOLLOWING_ERROR;
        /// Bits 14 and 15, of the manufacturer.
        const MANUFACTURER = statusword::MANUFACTURER_SPECIFIC_14;
    }
}

/// Bits by the name that they have in one mode of operation.
impl Statusword {
    /// pp: the set-point was taken; no other one is until bit 4 of the controlword is 0.
    pub const SET_POINT_ACKNOWLEDGE: Self = Self::MODE_12;
    /// pp, ip, csp: the following error is beyond its window.
    pub const FOLLOWING_ERROR: Self = Self::MODE_13;
    /// pv: the axis stands.
    pub const SPEED_ZERO: Self = Self::MODE_12;
    /// pv: the slippage is at its limit.
    pub const MAX_SLIPPAGE: Self = Self::MODE_13;
    /// hm: attained.
    pub const HOMING_ATTAINED: Self = Self::MODE_12;
    /// hm: failed.
    pub const HOMING_ERROR: Self = Self::MODE_13;
    /// ip: interpolation data are followed.
    pub const INTERPOLATION_ACTIVE: Self = Self::MODE_12;
    /// csp, csv, cst: the set-points of the master are followed.
    pub const FOLLOWS_COMMAND: Self = Self::MODE_12;

    /// The state, or `None` when the bits show none.
    #[must_use]
    pub const fn state(self) -> Option<State> {
        State::decode(self)
    }

    /// The same word in another state.
    #[must_use]
    pub const fn with_state(self, state: State) -> Self {
        Self::from_bits_retain(self.bits() & !0x6F | state.bits())
    }

    /// What bits 12 and 13 say in a mode; an empty text for nothing.
    #[must_use]
    pub const fn mode_bit_names(mode: Mode) -> [&'static str; 2] {
        match mode {
            Mode::PROFILE_POSITION => ["set-point acknowledged", "following error"],
            Mode::PROFILE_VELOCITY => ["speed is zero", "maximum slippage"],
            Mode::HOMING => ["homing attained", "homing error"],
            Mode::INTERPOLATED_POSITION => ["interpolation active", "following error"],
            Mode::CYCLIC_POSITION => ["follows the command", "following error"],
            Mode::CYCLIC_VELOCITY | Mode::CYCLIC_TORQUE | Mode::CYCLIC_TORQUE_COMMUTATION => {
                ["follows the command", ""]
            }
            _ => ["", ""],
        }
    }

    /// The word in words, for one mode of operation.
    pub fn describe(self, mode: Mode) -> impl fmt::Display {
        Description { word: self, mode }
    }
}

struct Description {
    word: Statusword,
    mode: Mode,
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { word, mode } = self;
        match word.state() {
            Some(state) => f.write_str(state.name())?,
            None => f.write_str("no state")?,
        }
        let [bit_12, bit_13] = Statusword::mode_bit_names(*mode);
        let bits = [
            (Statusword::VOLTAGE_ENABLED, "voltage enabled"),
            (Statusword::WARNING, "warning"),
            (Statusword::REMOTE, "remote"),
            (Statusword::TARGET_REACHED, "target reached"),
            (Statusword::INTERNAL_LIMIT, "internal limit"),
            (Statusword::MODE_12, bit_12),
            (Statusword::MODE_13, bit_13),
        ];
        for (bit, name) in bits {
            match (word.contains(bit), name) {
                (false, _) => {}
                (true, "") => write!(f, ", bit {}", bit.bits().trailing_zeros())?,
                (true, name) => write!(f, ", {name}")?,
            }
        }
        Ok(())
    }
}

impl fmt::Display for Statusword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.describe(Mode::NONE).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words as drives send them: Nanotec's manual (0637h, 1237h), Beckhoff's servo sample (0650h), ours.
    const VECTORS: [(u16, Mode, &str); 5] = [
        (0x0650, Mode::NONE, "switch on disabled, voltage enabled, remote, target reached"),
        (0x0637, Mode::PROFILE_POSITION, "operation enabled, voltage enabled, remote, target reached"),
        (0x1237, Mode::CYCLIC_POSITION, "operation enabled, voltage enabled, remote, follows the command"),
        (0x2208, Mode::HOMING, "fault, remote, homing error"),
        (0x3A07, Mode::VELOCITY, "quick stop active, remote, internal limit, bit 12, bit 13"),
    ];

    #[test]
    fn words_print_what_they_say() {
        for (word, mode, text) in VECTORS {
            assert_eq!(Statusword::from_bits_retain(word).describe(mode).to_string(), text, "{word:04x}");
        }
    }

    #[test]
    fn the_state_is_put_in_without_touching_the_rest() {
        for state in State::ALL {
            let word = Statusword::from_bits_retain(0xFFFF).with_state(state);
            assert_eq!(word.bits() & !0x6F, 0xFF90);
            assert_eq!(word.state(), Some(state));
        }
    }
}
