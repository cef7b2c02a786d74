//! Option codes: how the drive stops when it is told to, objects 6007h and 605Ah to 605Eh.
//!
//! Values below 0 are of the manufacturer. Names and defaults: Beckhoff's servo sample, Panasonic A6B, omsim.

pub use crate::generated::codes::{
    AbortConnectionOption, DisableOption, FaultReactionOption, HaltOption, QuickStopOption, ShutdownOption,
};

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

impl ShutdownOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 > 1 { None } else { Stop::of(self.0) }
    }
}

impl DisableOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 > 1 { None } else { Stop::of(self.0) }
    }
}

impl HaltOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        if self.0 == 0 { None } else { Stop::of(self.0) }
    }
}

impl FaultReactionOption {
    /// How it stops; `None` for a code of the manufacturer or a reserved one.
    #[must_use]
    pub const fn stop(self) -> Option<Stop> {
        Stop::of(self.0)
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
