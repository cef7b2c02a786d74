//! Inhibits: the named conditions that keep an axis from being enabled.

use bitflags::bitflags;

bitflags! {
    /// The set of conditions that keep the axis from starting.
    ///
    /// An inhibit is not a fault: it clears itself when its condition goes away. Some of them also take the
    /// torque away when they appear while the axis runs, see [`Inhibits::REMOVE_TORQUE`].
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub struct Inhibits: u32 {
        /// A safety function (safe torque off, safe stop) holds the torque off.
        const SAFETY = 1 << 0;
        /// The hardware enable input is not active.
        const HARDWARE_ENABLE = 1 << 1;
        /// The power stage has no power.
        const NO_POWER = 1 << 2;
        /// The configuration is not complete or was not accepted.
        const CONFIGURATION_INCOMPLETE = 1 << 3;
        /// The motor is not configured.
        const MOTOR_NOT_CONFIGURED = 1 << 4;
        /// The feedback device is not configured.
        const FEEDBACK_NOT_CONFIGURED = 1 << 5;
        /// The commutation of the motor is not configured or not found.
        const COMMUTATION_NOT_CONFIGURED = 1 << 6;
        /// The axis has to be homed before it may run in this mode.
        const NOT_HOMED = 1 << 7;
        /// Cyclic communication with the controller is not established.
        const NO_CONTROLLER = 1 << 8;
        /// Cyclic communication with the drive is not established.
        const NO_DRIVE = 1 << 9;
        /// The local clock is not yet synchronised with the system time.
        const NOT_SYNCHRONIZED = 1 << 10;
        /// No operating mode that can be enabled is selected.
        const NO_OPERATING_MODE = 1 << 11;
        /// Somebody else (a panel, a commissioning tool) has control of the drive.
        const LOCAL_CONTROL = 1 << 12;
        /// A firmware or parameter transfer is under way.
        const TRANSFER_ACTIVE = 1 << 13;
        /// The brake is not released or is being tested.
        const BRAKE = 1 << 14;
        /// The drive still cools or charges down after the last start.
        const RESTART_DELAY = 1 << 15;
        /// The drive reports an inhibit of its own that has no generic name.
        const DRIVE_SPECIFIC = 1 << 16;
        /// The controller wants the limit switches checked, and the drive does not report them.
        const LIMIT_SWITCHES_NOT_TOLD = 1 << 17;

        // Bits above are kept when they come from a newer table.
        const _ = !0;
    }
}

impl Inhibits {
    /// The inhibits that mean that torque is gone or must go at once when they appear on a running axis.
    pub const REMOVE_TORQUE: Self = Self::SAFETY
        .union(Self::HARDWARE_ENABLE)
        .union(Self::NO_POWER)
        .union(Self::COMMUTATION_NOT_CONFIGURED);

    /// Every named inhibit with its name in snake case.
    pub const NAMED: &'static [(Self, &'static str)] = &[
        (Self::SAFETY, "safety"),
        (Self::HARDWARE_ENABLE, "hardware_enable"),
        (Self::NO_POWER, "no_power"),
        (Self::CONFIGURATION_INCOMPLETE, "configuration_incomplete"),
        (Self::MOTOR_NOT_CONFIGURED, "motor_not_configured"),
        (Self::FEEDBACK_NOT_CONFIGURED, "feedback_not_configured"),
        (Self::COMMUTATION_NOT_CONFIGURED, "commutation_not_configured"),
        (Self::NOT_HOMED, "not_homed"),
        (Self::NO_CONTROLLER, "no_controller"),
        (Self::NO_DRIVE, "no_drive"),
        (Self::NOT_SYNCHRONIZED, "not_synchronized"),
        (Self::NO_OPERATING_MODE, "no_operating_mode"),
        (Self::LOCAL_CONTROL, "local_control"),
        (Self::TRANSFER_ACTIVE, "transfer_active"),
        (Self::BRAKE, "brake"),
        (Self::RESTART_DELAY, "restart_delay"),
        (Self::DRIVE_SPECIFIC, "drive_specific"),
        (Self::LIMIT_SWITCHES_NOT_TOLD, "limit_switches_not_told"),
    ];

    /// The single inhibit with this exact name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(_, known)| *known == name).map(|(inhibit, _)| *inhibit)
    }

    /// The name of the lowest inhibit in the set, or `None` when the set is empty or the bit has no name.
    pub fn first_name(self) -> Option<&'static str> {
        let lowest = 1_u32.checked_shl(self.bits().trailing_zeros())?;
        Self::NAMED.iter().find(|(inhibit, _)| inhibit.bits() == lowest).map(|(_, name)| *name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_and_cover_single_bits_once() {
        let mut seen = Inhibits::empty();
        for (inhibit, name) in Inhibits::NAMED {
            assert_eq!(inhibit.bits().count_ones(), 1, "{name}");
            assert!(!seen.contains(*inhibit), "{name} twice");
            seen |= *inhibit;
            assert_eq!(Inhibits::parse(name), Some(*inhibit));
            assert_eq!(inhibit.first_name(), Some(*name));
        }
        assert_eq!(seen.bits(), (1 << Inhibits::NAMED.len()) - 1);
        assert_eq!(Inhibits::parse("none"), None);
    }

    #[test]
    fn the_first_name_is_the_lowest_bit() {
        assert_eq!((Inhibits::NO_POWER | Inhibits::NOT_HOMED).first_name(), Some("no_power"));
        assert_eq!(Inhibits::empty().first_name(), None);
        assert_eq!(Inhibits::from_bits_retain(1 << 31).first_name(), None);
    }
}
