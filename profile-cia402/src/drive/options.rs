//! Option codes: how the drive stops when it is told to, objects 6007h and 605Ah to 605Eh.
//!
//! Values below 0 are of the manufacturer. Names and defaults: Beckhoff's servo sample, Panasonic A6B, omsim.

use profile_generic::open_code;

/// How an axis is brought to a stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stop {
    /// Torque off at once: it coasts.
    Disable,
    /// Along the deceleration of the profile, 6084h.
    SlowDownRamp,
    /// Along the quick stop deceleration, 6085h.
    QuickStopRamp,
    /// As hard as the current limit allows.
    CurrentLimit,
    /// As hard as the voltage limit allows.
    VoltageLimit,
}

impl Stop {
    const fn of(code: i16) -> Option<Self> {
        Some(match code {
            0 => Self::Disable,
            1 => Self::SlowDownRamp,
            2 => Self::QuickStopRamp,
            3 => Self::CurrentLimit,
            4 => Self::VoltageLimit,
            _ => return None,
        })
    }
}

open_code! {
    /// 605Ah, quick stop: transition 11. 1 to 4 end in *switch on disabled*, 5 to 8 stand with torque.
    pub struct QuickStopOption(i16) {
        /// Disable the drive.
        DISABLE = 0 => "disable",
        /// Slow-down ramp, then off.
        SLOW_DOWN_RAMP = 1 => "slow-down ramp",
        /// Quick stop ramp, then off; the default.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit, then off.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit, then off.
        VOLTAGE_LIMIT = 4 => "voltage limit",
        /// Slow-down ramp, then hold.
        SLOW_DOWN_RAMP_AND_HOLD = 5 => "slow-down ramp and hold",
        /// Quick stop ramp, then hold.
        QUICK_STOP_RAMP_AND_HOLD = 6 => "quick stop ramp and hold",
        /// Current limit, then hold.
        CURRENT_LIMIT_AND_HOLD = 7 => "current limit and hold",
        /// Voltage limit, then hold.
        VOLTAGE_LIMIT_AND_HOLD = 8 => "voltage limit and hold",
    }
}

impl QuickStopOption {
    /// Whether the drive stays in *quick stop active*.
    #[must_use]
    pub const fn holds(self) -> bool {
        matches!(self.0, 5..=8)
    }

    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        Stop::of(if self.holds() { self.0 - 4 } else { self.0 })
    }
}

open_code! {
    /// 605Bh, shutdown: transition 8.
    pub struct ShutdownOption(i16) {
        /// Disable; the default.
        DISABLE = 0 => "disable",
        /// Slow-down ramp first.
        SLOW_DOWN_RAMP = 1 => "slow-down ramp",
    }
}

impl ShutdownOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 > 1 { None } else { Stop::of(self.0) }
    }
}

open_code! {
    /// 605Ch, disable operation: transition 5.
    pub struct DisableOption(i16) {
        /// Disable.
        DISABLE = 0 => "disable",
        /// Slow-down ramp first; the default.
        SLOW_DOWN_RAMP = 1 => "slow-down ramp",
    }
}

impl DisableOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 > 1 { None } else { Stop::of(self.0) }
    }
}

open_code! {
    /// 605Dh, halt: bit 8 of the controlword. The axis stands with torque.
    pub struct HaltOption(i16) {
        /// Slow-down ramp; the default.
        SLOW_DOWN_RAMP = 1 => "slow-down ramp",
        /// Quick stop ramp.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit.
        VOLTAGE_LIMIT = 4 => "voltage limit",
    }
}

impl HaltOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 == 0 { None } else { Stop::of(self.0) }
    }
}

open_code! {
    /// 605Eh, fault reaction: transition 13.
    pub struct FaultReactionOption(i16) {
        /// Disable.
        DISABLE = 0 => "disable",
        /// Slow-down ramp.
        SLOW_DOWN_RAMP = 1 => "slow-down ramp",
        /// Quick stop ramp; the default.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit.
        VOLTAGE_LIMIT = 4 => "voltage limit",
    }
}

impl FaultReactionOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        Stop::of(self.0)
    }
}

open_code! {
    /// 6007h, abort connection: the master is gone while the axis runs.
    pub struct AbortConnectionOption(i16) {
        /// Nothing.
        NONE = 0 => "no action",
        /// A fault; the default.
        FAULT = 1 => "fault",
        /// As the command disable voltage.
        DISABLE_VOLTAGE = 2 => "disable voltage",
        /// As the command quick stop.
        QUICK_STOP = 3 => "quick stop",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_tell_how_to_stop() {
        use Stop::*;
        let all = [Disable, SlowDownRamp, QuickStopRamp, CurrentLimit, VoltageLimit];
        let quick: Vec<_> = (-1..=9).map(|code| QuickStopOption(code).stop()).collect();
        let held = all[1..].iter().copied().map(Some);
        let expected: Vec<_> = [None].into_iter().chain(all.map(Some)).chain(held).chain([None]).collect();
        assert_eq!(quick, expected);
        assert_eq!((0..=9).filter(|code| QuickStopOption(*code).holds()).collect::<Vec<_>>(), [5, 6, 7, 8]);
        let small = |stop: fn(i16) -> Option<Stop>| (-1..=5).map(stop).collect::<Vec<_>>();
        let [d, s, q, c, v] = all.map(Some);
        assert_eq!(small(|code| ShutdownOption(code).stop()), [None, d, s, None, None, None, None]);
        assert_eq!(small(|code| DisableOption(code).stop()), [None, d, s, None, None, None, None]);
        assert_eq!(small(|code| HaltOption(code).stop()), [None, None, s, q, c, v, None]);
        assert_eq!(small(|code| FaultReactionOption(code).stop()), [None, d, s, q, c, v, None]);
    }
}
