//! What the motion connection has seen: every update is counted under exactly one of these, and so is every refusal.

/// Counters of the motion I/O connection since construction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotionCounters {
    /// Updates that were taken over.
    pub applied: u64,
    /// Updates without the data valid bit: only their header counted.
    pub not_valid: u64,
    /// Packets with the sequence count of the one before: they keep the connection alive and nothing else.
    pub refreshes: u64,
    /// Packets with an older sequence count or Update ID.
    pub out_of_order: u64,
    /// New packets with the Update ID of the one before.
    pub repeated: u64,
    /// Packets while no connection was open.
    pub unconnected: u64,
    /// Packets longer than the connection size.
    pub oversize: u64,
    /// Packets whose form is wrong: format, revision, sizes, order of instances, reserved codes.
    pub malformed: u64,
    /// Updates with a command that is not a finite number.
    pub not_finite: u64,
    /// Updates for an instance that is not there.
    pub unknown_instance: u64,
    /// Updates beyond the update delay high limit: not applied.
    pub too_late: u64,
    /// Updates in synchronous operation whose time cannot be judged: not applied.
    pub untimed: u64,
    /// Updates whose time stamp lies too far ahead: not applied.
    pub ahead_of_time: u64,
    /// Updates whose time stamp does not follow from the one before: not applied.
    pub stamp_jumps: u64,
    /// Update IDs that were skipped.
    pub lost_updates: u64,
    /// Updates later than one update period.
    pub late_updates: u64,
    /// Connections that timed out.
    pub connection_losses: u64,
    /// D-to-C updates produced.
    pub transmitted: u64,
    /// Instances that did not fit into a D-to-C update.
    pub left_out: u64,
    /// Explicit requests refused because too many were waiting.
    pub explicit_overflow: u64,
}
