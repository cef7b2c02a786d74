//! What a bus hands its axes in each cycle.

use profile_generic::time::{DurationNs, MonotonicTime};

/// The cyclic values of a drive, borrowed from the bus.
#[derive(Debug, Clone, Copy)]
pub struct Received<'a> {
    /// The last values received: the status word first, then the values in the order of the drive's program.
    pub data: &'a [u8],
    /// Whether they were received in the last cycle.
    pub fresh: bool,
    /// When they were received, for a drive that sends by a timer of its own. Not every cycle has values then.
    pub at: Option<MonotonicTime>,
    /// Whether the drive takes part: it was received, and no more values in a row are missing than its connection permits.
    pub alive: bool,
}

/// The times of a bus cycle that its axes need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// The instant on the grid at which the drives take the values that are sent in this cycle.
    pub acts_at: MonotonicTime,
    /// Time from one cycle to the next.
    pub span: DurationNs,
    /// Time from the latest moment at which an update still counts for this cycle to [`Self::acts_at`].
    pub ahead: DurationNs,
    /// How late the engine was called for this cycle.
    pub late: DurationNs,
}
