//! The TCP streams of the device and their names.

use core::fmt;

/// Most streams at once. ODVA recommends to expect three; the rest is for tools and for streams a peer
/// forgot.
pub const SESSIONS_MAX: usize = 32;

/// Streams that one host may have.
pub const SESSIONS_OF_HOST_MAX: usize = 24;

/// Streams that are kept for controllers: the hosts that are listed as such, and the owner of the motion connection, also
/// after its connection has ended.
pub const SESSIONS_KEPT: usize = 4;

/// Why a stream is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoRoom {
    /// Too many are open, or the rest is kept for controllers.
    All,
    /// Its host has too many.
    Host,
}

impl fmt::Display for NoRoom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("too many streams are open"),
            Self::Host => write!(f, "this host has {SESSIONS_OF_HOST_MAX} streams open"),
        }
    }
}

impl core::error::Error for NoRoom {}

/// Names one stream; never the same for two streams of one adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SessionSlot {
    pub(super) index: usize,
    pub(super) generation: u64,
}
