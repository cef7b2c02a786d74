//! The TCP streams of the device and their names.

/// Most streams at once. ODVA recommends to expect three; the rest is for tools and for streams a peer
/// forgot.
pub const SESSIONS_MAX: usize = 32;

/// Names one stream; never the same for two streams of one adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SessionSlot {
    pub(super) index: usize,
    pub(super) generation: u64,
}
