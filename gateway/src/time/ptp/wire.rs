//! Where a clock of PTP gets its messages and the time from.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

use profile_generic::time::{DurationNs, MonotonicTime};

pub use crate::sys::ptp_socket::Arrived;

use crate::sys::clock::monotonic_now;
use crate::sys::ptp_socket::PtpSockets;

/// Sockets and oscillator of a clock.
pub trait Wire {
    /// The monotonic time.
    fn now(&self) -> MonotonicTime;

    /// Waits for a message until an instant at most.
    ///
    /// # Errors
    /// What the sockets say.
    fn wait(&mut self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>>;

    /// Sends an event message to all. Returns when it left, if that is known.
    ///
    /// # Errors
    /// What the socket says.
    fn send_event(&mut self, message: &[u8]) -> io::Result<Option<MonotonicTime>>;

    /// Sends a general message to all. One that is lost is no error: the next one comes.
    fn send_general(&mut self, message: &[u8]);

    /// Whether the clock is to end.
    fn is_ended(&self) -> bool;

    /// Whether the largest offset is to begin anew, once.
    fn take_forget(&mut self) -> bool {
        false
    }

    /// Largest offset of a synchronized clock, ns, if somebody has said another one than that of the configuration.
    fn threshold(&self) -> Option<u64> {
        None
    }
}

/// What a clock is told while it runs.
#[derive(Debug, Default)]
pub struct Control {
    /// It ends.
    pub stop: AtomicBool,
    /// Its domain.
    pub domain: AtomicU8,
    /// The largest offset begins anew.
    pub forget: AtomicBool,
    /// Largest offset of a synchronized clock, ns.
    pub threshold: AtomicU64,
}

/// How often is looked whether the interface is still the same.
const LOOK: DurationNs = DurationNs::from_millis(1_000);

/// The sockets of the host.
#[derive(Debug)]
pub struct HostWire {
    sockets: PtpSockets,
    domain: u8,
    control: Arc<Control>,
    looked: MonotonicTime,
}

impl HostWire {
    /// The wire of a clock in a domain on open sockets; `control` sets it while it runs.
    #[must_use]
    pub fn new(sockets: PtpSockets, domain: u8, control: Arc<Control>) -> Self {
        Self { sockets, domain, control, looked: monotonic_now() }
    }
}

impl Wire for HostWire {
    fn now(&self) -> MonotonicTime {
        monotonic_now()
    }

    fn wait(&mut self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
        let now = monotonic_now();
        if now.since(self.looked) >= LOOK {
            self.looked = now;
            if self.sockets.is_replaced() {
                return Err(io::Error::other("the interface was replaced by another one of its name"));
            }
        }
        self.sockets.wait(until, buffer)
    }

    fn send_event(&mut self, message: &[u8]) -> io::Result<Option<MonotonicTime>> {
        self.sockets.send_event(message)
    }

    fn send_general(&mut self, message: &[u8]) {
        self.sockets.send_general(message);
    }

    /// A clock has one domain: for another one it begins anew.
    fn is_ended(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed)
            || self.control.domain.load(Ordering::Relaxed) != self.domain
    }

    fn take_forget(&mut self) -> bool {
        self.control.forget.swap(false, Ordering::Relaxed)
    }

    fn threshold(&self) -> Option<u64> {
        Some(self.control.threshold.load(Ordering::Relaxed))
    }
}
