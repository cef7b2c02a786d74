//! Modes of operation, objects 6060h (set), 6061h (shown) and 6502h (supported).

use crate::generated::bits::supported_modes;
pub use crate::generated::codes::Mode;
use bitflags::bitflags;

impl Mode {
    /// Whether the set-points of the master are followed from SYNC to SYNC.
    #[must_use]
    pub const fn is_cyclic(self) -> bool {
        matches!(
            self,
            Self::INTERPOLATED_POSITION
                | Self::CYCLIC_POSITION
                | Self::CYCLIC_VELOCITY
                | Self::CYCLIC_TORQUE
                | Self::CYCLIC_TORQUE_COMMUTATION
        )
    }
}

bitflags! {
    /// Supported drive modes, object 6502h. Bits 16 to 31 are of the manufacturer.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct SupportedModes: u32 {
        /// pp.
        const PROFILE_POSITION = supported_modes::PP;
        /// vl.
        const VELOCITY = supported_modes::VL;
        /// pv.
        const PROFILE_VELOCITY = supported_modes::PV;
        /// tq.
        const TORQUE = supported_modes::TQ;
        /// hm.
        const HOMING = supported_modes::HM;
        /// ip.
        const INTERPOLATED_POSITION = supported_modes::IP;
        /// csp.
        const CYCLIC_POSITION = supported_modes::CSP;
        /// csv.
        const CYCLIC_VELOCITY = supported_modes::CSV;
        /// cst.
        const CYCLIC_TORQUE = supported_modes::CST;
        /// cstca.
        const CYCLIC_TORQUE_COMMUTATION = supported_modes::CSTCA;
    }
}

impl SupportedModes {
    /// Whether a mode is among them. Of modes of the manufacturer 6502h does not say which bit is which.
    #[must_use]
    pub const fn has(self, mode: Mode) -> bool {
        match mode.0 {
            0 => true,
            1..=11 => self.bits() & 1 << (mode.0 - 1) != 0,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_has_its_bit() {
        let bits = [
            (Mode::PROFILE_POSITION, SupportedModes::PROFILE_POSITION),
            (Mode::VELOCITY, SupportedModes::VELOCITY),
            (Mode::PROFILE_VELOCITY, SupportedModes::PROFILE_VELOCITY),
            (Mode::TORQUE, SupportedModes::TORQUE),
            (Mode::HOMING, SupportedModes::HOMING),
            (Mode::INTERPOLATED_POSITION, SupportedModes::INTERPOLATED_POSITION),
            (Mode::CYCLIC_POSITION, SupportedModes::CYCLIC_POSITION),
            (Mode::CYCLIC_VELOCITY, SupportedModes::CYCLIC_VELOCITY),
            (Mode::CYCLIC_TORQUE, SupportedModes::CYCLIC_TORQUE),
            (Mode::CYCLIC_TORQUE_COMMUTATION, SupportedModes::CYCLIC_TORQUE_COMMUTATION),
        ];
        for (mode, bit) in bits {
            assert!(bit.has(mode) && !bit.complement().has(mode), "{mode}");
        }
        assert!(SupportedModes::empty().has(Mode::NONE));
        assert!(!SupportedModes::all().has(Mode(5)));
        assert!(!SupportedModes::all().has(Mode(-1)));
    }

    #[test]
    fn modes_of_the_manufacturer_are_kept() {
        assert_eq!(Mode(-3).name(), None);
        assert_eq!(Mode(-3).to_string(), "0xfd");
        // All but vl and cstca.
        let drive = SupportedModes::from_bits_retain(0x3ED);
        let known: Vec<_> =
            Mode::NAMED.iter().filter(|(mode, _)| drive.has(*mode)).map(|(m, _)| m.0).collect();
        assert_eq!(known, [0, 1, 3, 4, 6, 7, 8, 9, 10]);
    }
}
