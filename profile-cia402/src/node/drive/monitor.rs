//! Windows with times: following error, target reached, standstill.

use profile_generic::time::DurationNs;

/// What has been inside or outside of its window, and for how long.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Monitor {
    /// Target of the cyclic modes in this step, nanounits.
    pub target: Option<i64>,
    /// Following error, nanounits.
    pub error: i64,
    /// It is beyond its window.
    pub is_beyond: bool,
    beyond_for: DurationNs,
    /// The target is reached.
    pub has_reached: bool,
    reached_for: DurationNs,
    /// The axis stands.
    pub stands: bool,
    standing_for: DurationNs,
}

/// Counts how long something is so; whether it has been for long enough.
fn lasts(counted: &mut DurationNs, is_so: bool, elapsed: DurationNs, needed: DurationNs) -> bool {
    if !is_so {
        *counted = DurationNs::ZERO;
        return false;
    }
    *counted = DurationNs(counted.0.saturating_add(elapsed.0));
    *counted >= needed
}

impl Monitor {
    /// Whether the following error has been beyond its window for too long.
    pub fn following(&mut self, beyond: bool, elapsed: DurationNs, time_out: DurationNs) -> bool {
        self.is_beyond = beyond;
        lasts(&mut self.beyond_for, beyond, elapsed, time_out)
    }

    /// Whether the axis is in the window of its target.
    pub fn reached(&mut self, inside: bool, elapsed: DurationNs, needed: DurationNs) {
        self.has_reached = lasts(&mut self.reached_for, inside, elapsed, needed);
    }

    /// Whether the axis is slower than its threshold.
    pub fn standing(&mut self, slow: bool, elapsed: DurationNs, needed: DurationNs) {
        self.stands = lasts(&mut self.standing_for, slow, elapsed, needed);
    }
}
