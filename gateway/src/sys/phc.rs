//! The clock of a network card (PHC), which a PTP daemon keeps.

use std::fs::File;
use std::io;
use std::os::fd::AsFd as _;
use std::path::Path;

use rustix::time::{DynamicClockId, clock_gettime_dynamic};

use super::clock::{PairedReading, nanoseconds, paired};

/// An open clock.
#[derive(Debug)]
pub struct Phc(File);

impl Phc {
    /// Opens it: `/dev/ptp0` and such.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(path: &Path) -> io::Result<Self> {
        File::open(path).map(Self)
    }

    /// Its time with the monotonic time of the same instant; `None` when the thread was interrupted at each try.
    #[must_use]
    pub fn read(&self) -> Option<PairedReading> {
        let read = || {
            let now = clock_gettime_dynamic(DynamicClockId::Dynamic(self.0.as_fd()));
            now.map_or(0, |now| nanoseconds(now.tv_sec, now.tv_nsec))
        };
        paired(read).usable().filter(|reading| reading.time > 0)
    }
}
