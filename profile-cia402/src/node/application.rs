//! What stands behind the communication of a device.

use profile_generic::time::DurationNs;

use super::dictionary::Dictionary;
use crate::drive::ErrorCode;
use crate::wire::{AbortCode, Mux};

/// What happens to the communication while the application runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// The device starts anew; objects have their values after power-on.
    Reset,
    /// The master is gone, or takes the device out of *operational*: the abort connection option code 6007h reports what
    /// to do.
    ConnectionLost,
    /// The SYNC messages that 1006h promises stay away.
    SyncLost,
    /// SYNC: sampled values have been sent, new set-points have been taken.
    Sync,
}

/// An error that came, or that is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Report {
    /// Which.
    pub code: ErrorCode,
    /// Which axis or part, for the first byte of the manufacturer in EMCY.
    pub source: u8,
    /// It came.
    pub active: bool,
}

/// A device profile.
pub trait Application {
    /// Adds its objects.
    fn define(&mut self, dictionary: &mut Dictionary);

    /// Whether a number that fits type and limits may be written now.
    ///
    /// # Errors
    /// The abort code for the client.
    fn check(&self, mux: Mux, number: i64, dictionary: &Dictionary) -> Result<(), AbortCode>;

    /// Objects were written, by SDO or PDO; no time has passed.
    fn commanded(&mut self, dictionary: &mut Dictionary);

    /// Time passes, at most some milliseconds at once.
    fn step(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary);

    /// Something happens to the communication.
    fn event(&mut self, event: Event, dictionary: &mut Dictionary);

    /// Takes the next report.
    fn poll_report(&mut self) -> Option<Report>;
}
