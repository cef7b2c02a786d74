//! Findings about the gateway that are known and not mended yet: what they break is tolerated everywhere, and a test that
//! shows one of them has to see it. A finding that is mended is deleted here, and its tests then see that nothing is broken.

use super::violation::{Rule, Violation};

/// A finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// Set-points are made for the instant of the wake-up, not for that of the grid.
    M1,
    /// Nothing limits the last step.
    M2,
    /// Steps and drift of the gateway's system time reach the drives.
    M3,
    /// A controller clock that is ahead is trusted and not served.
    M4,
    /// Asynchronous operation is a staircase.
    M5,
}

/// Those that are not mended.
pub const OPEN: &[Known] = &[];

impl Known {
    /// Whether it is not mended yet.
    #[must_use]
    pub fn is_open(self) -> bool {
        OPEN.contains(&self)
    }

    /// Whether a violation is of this finding.
    #[must_use]
    pub fn explains(self, violation: &Violation) -> bool {
        let c = &violation.circumstances;
        let of_the_curve = matches!(violation.rule, Rule::Velocity | Rule::Acceleration | Rule::Stop);
        match self {
            Self::M1 => of_the_curve && c.late.as_nanos() > 0,
            Self::M2 => violation.rule == Rule::Limit,
            Self::M3 => of_the_curve && (c.stepped || c.drifts),
            Self::M4 => of_the_curve && c.offset.as_nanos() > 0 && !c.stepped,
            Self::M5 => of_the_curve && !c.synchronous,
        }
    }
}
