//! What the server has counted.

use profile_cip::device::counters::Counters;

/// Counted since the server started; only `streams` falls.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Streams that are open.
    pub streams: usize,
    /// Streams that were accepted and served.
    pub accepted: u64,
    /// Streams that were closed at once, because all places are taken.
    pub refused: u64,
    /// Streams dropped because the peer did not take what was sent to it.
    pub stalled: u64,
    /// Datagrams received.
    pub datagrams: u64,
    /// Answers to datagrams that could not be sent.
    pub datagrams_unsent: u64,
    /// Requests sent to the motion device.
    pub motion_requests: u64,
    /// Times a request had to wait, because the queue to the motion device was full.
    pub motion_requests_held: u64,
    /// Replies and notices of the motion device.
    pub motion_replies: u64,
    /// Motion connections that were opened.
    pub motion_opened: u64,
    /// Motion connections that were closed by their originator.
    pub motion_closed: u64,
    /// Motion connections that timed out.
    pub motion_lost: u64,
    /// Events of the adapter, those above among them.
    pub events: u64,
    /// What the adapter has counted.
    pub adapter: Counters,
}
