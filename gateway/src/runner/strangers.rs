//! What the kernel keeps from the UDP port of a device, and the log line about it.

use std::net::SocketAddrV4;
use std::sync::Arc;

use tracing::warn;

use crate::log_limit::LogLimit;
use crate::sys::clock::monotonic_now;
use crate::sys::gate::Gate;

/// Fewer than this are not worth a line: the last updates of a connection that has just ended.
const WORTH_A_LINE: u32 = 16;

/// Looks at the count of dropped datagrams of one device, beside the cycle.
#[derive(Debug)]
pub(super) struct DropWatch {
    gate: Arc<Gate>,
    address: SocketAddrV4,
    /// The kernel's count that has been reported.
    seen: u32,
    limit: LogLimit,
}

impl DropWatch {
    /// A watch for the socket at this address.
    pub fn new(gate: Arc<Gate>, address: SocketAddrV4) -> Self {
        let seen = gate.dropped().unwrap_or(0);
        Self { gate, address, seen, limit: LogLimit::default() }
    }

    /// Looks, and logs what is to be said; to be called every now and then.
    pub fn look(&mut self) {
        let now = monotonic_now();
        let dropped = self.gate.dropped().unwrap_or(self.seen);
        let new = dropped.wrapping_sub(self.seen);
        if new >= WORTH_A_LINE {
            self.seen = dropped;
            self.limit.add(now, u64::from(new));
        }
        if let Some(count) = self.limit.take(now) {
            warn!(
                count,
                at = %self.address,
                "datagrams were dropped before they reached the cycle: they are not of the open motion connection"
            );
        }
    }
}
