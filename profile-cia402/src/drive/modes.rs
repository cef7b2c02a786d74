//! Modes of operation, objects 6060h (set), 6061h (shown) and 6502h (supported).

use bitflags::bitflags;
use profile_generic::open_code;

open_code! {
    /// A mode of operation. Below 0: of the manufacturer.
    pub struct Mode(i8) {
        /// No mode.
        NONE = 0 => "no mode",
        /// pp.
        PROFILE_POSITION = 1 => "profile position",
        /// vl, of frequency converters.
        VELOCITY = 2 => "velocity",
        /// pv.
        PROFILE_VELOCITY = 3 => "profile velocity",
        /// tq.
        TORQUE = 4 => "profile torque",
        /// hm.
        HOMING = 6 => "homing",
        /// ip.
        INTERPOLATED_POSITION = 7 => "interpolated position",
        /// csp.
        CYCLIC_POSITION = 8 => "cyclic synchronous position",
        /// csv.
        CYCLIC_VELOCITY = 9 => "cyclic synchronous velocity",
        /// cst.
        CYCLIC_TORQUE = 10 => "cyclic synchronous torque",
        /// cstca.
        CYCLIC_TORQUE_COMMUTATION = 11 => "cyclic synchronous torque with commutation angle",
    }
}

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
        const PROFILE_POSITION = 1 << 0;
        /// vl.
        const VELOCITY = 1 << 1;
        /// pv.
        const PROFILE_VELOCITY = 1 << 2;
        /// tq.
        const TORQUE = 1 << 3;
        /// hm.
        const HOMING = 1 << 5;
        /// ip.
        const INTERPOLATED_POSITION = 1 << 6;
        /// csp.
        const CYCLIC_POSITION = 1 << 7;
        /// csv.
        const CYCLIC_VELOCITY = 1 << 8;
        /// cst.
        const CYCLIC_TORQUE = 1 << 9;
        /// cstca.
        const CYCLIC_TORQUE_COMMUTATION = 1 << 10;
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
