//! The clocks of the host, and sleeping until an instant.
//!
//! | clock | from | used for |
//! |---|---|---|
//! | [`monotonic_now`] | `CLOCK_MONOTONIC` | the cycle, time-outs; never steps |
//! | [`SystemClock::now`] | `CLOCK_TAI`, else `CLOCK_REALTIME` | CIP Sync system time |
//! | [`KernelTime`] | `CLOCK_REALTIME` | the kernel's receive time stamps |
//!
//! CIP Sync counts the seconds of TAI. The kernel knows the offset from UTC to TAI only when a time daemon
//! has told it (`ptp4l`, `phc2sys`, `chronyd` with `leapsectz`). Without one the offset is zero and
//! `CLOCK_TAI` would be UTC under another name; [`SystemClock::detect`] says which of the two it found, so
//! that the box can report it.
#![allow(unsafe_code)]

use std::fmt;
use std::io;

use profile_generic::time::{MonotonicTime, SystemTime};

const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// A time stamp of the kernel: nanoseconds of `CLOCK_REALTIME` (UTC) since 1970.
///
/// [`SystemClock::from_kernel`] turns it into system time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KernelTime(pub u64);

/// The time on the host's monotonic clock.
#[must_use]
pub fn monotonic_now() -> MonotonicTime {
    MonotonicTime(read(libc::CLOCK_MONOTONIC))
}

/// The time on the host's real-time clock (UTC): for file names and time stamps in recordings.
#[must_use]
pub fn realtime_now() -> KernelTime {
    KernelTime(read(libc::CLOCK_REALTIME))
}

/// Sleeps until the monotonic clock reads `deadline`; a deadline in the past returns at once.
///
/// Signals do not shorten the sleep.
///
/// # Errors
/// What `clock_nanosleep` refuses, which for a valid clock and time is nothing.
pub fn sleep_until(deadline: MonotonicTime) -> io::Result<()> {
    let request = libc::timespec {
        // Seconds since boot stay far below 2^63.
        tv_sec: libc::time_t::try_from(deadline.0 / NANOSECONDS_PER_SECOND).unwrap_or(libc::time_t::MAX),
        tv_nsec: libc::c_long::try_from(deadline.0 % NANOSECONDS_PER_SECOND).unwrap_or(0),
    };
    loop {
        // SAFETY: `request` lives through the call; a null remainder is allowed with TIMER_ABSTIME.
        let error = unsafe {
            libc::clock_nanosleep(
                libc::CLOCK_MONOTONIC,
                libc::TIMER_ABSTIME,
                &raw const request,
                std::ptr::null_mut(),
            )
        };
        match error {
            0 => return Ok(()),
            libc::EINTR => {}
            other => return Err(io::Error::from_raw_os_error(other)),
        }
    }
}

/// Which clock of the host serves as system time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeScale {
    /// International atomic time: the kernel has been told the offset, in seconds, from UTC.
    Tai {
        /// Seconds to add to UTC.
        offset_s: i32,
    },
    /// UTC, because nobody has told the kernel the offset to TAI.
    Utc,
}

impl fmt::Display for TimeScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tai { offset_s } => write!(f, "TAI (UTC {offset_s:+} s)"),
            Self::Utc => f.write_str("UTC (the kernel does not know the offset to TAI)"),
        }
    }
}

/// The host's clock as CIP Sync system time.
///
/// The scale is looked up once: an offset that appears later would step the time by 37 s under a running
/// axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SystemClock {
    scale: TimeScale,
}

impl SystemClock {
    /// Asks the kernel which scale it can give.
    #[must_use]
    pub fn detect() -> Self {
        let scale = match tai_offset_s() {
            Some(offset_s) if offset_s != 0 => TimeScale::Tai { offset_s },
            _ => TimeScale::Utc,
        };
        Self { scale }
    }

    /// A clock on a given scale, whatever the kernel knows.
    #[must_use]
    pub const fn with_scale(scale: TimeScale) -> Self {
        Self { scale }
    }

    /// The scale this clock counts.
    #[must_use]
    pub const fn scale(self) -> TimeScale {
        self.scale
    }

    /// System time now.
    #[must_use]
    pub fn now(self) -> SystemTime {
        self.from_kernel(realtime_now())
    }

    /// System time of a kernel time stamp.
    #[must_use]
    pub fn from_kernel(self, stamp: KernelTime) -> SystemTime {
        let offset_s = match self.scale {
            TimeScale::Tai { offset_s } => i64::from(offset_s),
            TimeScale::Utc => 0,
        };
        SystemTime(stamp.0.saturating_add_signed(offset_s.saturating_mul(1_000_000_000)))
    }
}

/// Whether somebody keeps the host's clock right: a daemon of PTP or NTP that has told the kernel so.
#[must_use]
pub fn is_disciplined() -> bool {
    kernel_clock().is_some_and(|state| state.status & libc::STA_UNSYNC == 0)
}

/// The offset of TAI from UTC that the kernel holds, in seconds; `None` when it cannot be asked.
fn tai_offset_s() -> Option<i32> {
    kernel_clock().map(|state| state.tai)
}

/// What the kernel knows of its clock; `None` when it cannot be asked.
fn kernel_clock() -> Option<libc::timex> {
    // SAFETY: `timex` is plain integers, for which all zeroes is a value; modes 0 only reads.
    let mut state: libc::timex = unsafe { std::mem::zeroed() };
    // SAFETY: `state` is a valid, writable `timex` that outlives the call.
    let result = unsafe { libc::adjtimex(&raw mut state) };
    if result < 0 { None } else { Some(state) }
}

fn read(clock: libc::clockid_t) -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is a valid, writable `timespec` that outlives the call.
    let result = unsafe { libc::clock_gettime(clock, &raw mut now) };
    assert_eq!(result, 0, "clock {clock} cannot be read: {}", io::Error::last_os_error());
    nanoseconds(now)
}

/// A `timespec` at or after its epoch as nanoseconds; times before it read as 0.
pub(super) fn nanoseconds(time: libc::timespec) -> u64 {
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    let rest = u64::try_from(time.tv_nsec).unwrap_or(0);
    seconds.saturating_mul(NANOSECONDS_PER_SECOND).saturating_add(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeps_until_the_deadline_and_not_less() {
        let start = monotonic_now();
        let deadline = MonotonicTime(start.0 + 3_000_000);
        sleep_until(deadline).unwrap();
        assert!(monotonic_now() >= deadline);
    }

    #[test]
    fn a_deadline_in_the_past_returns_at_once() {
        let start = monotonic_now();
        sleep_until(MonotonicTime(0)).unwrap();
        assert!(monotonic_now().0 - start.0 < 1_000_000_000);
    }

    #[test]
    fn kernel_time_becomes_system_time_by_the_offset() {
        let stamp = KernelTime(1_800_000_000_000_000_001);
        let tai = SystemClock::with_scale(TimeScale::Tai { offset_s: 37 });
        assert_eq!(tai.from_kernel(stamp), SystemTime(1_800_000_037_000_000_001));
        let utc = SystemClock::with_scale(TimeScale::Utc);
        assert_eq!(utc.from_kernel(stamp), SystemTime(1_800_000_000_000_000_001));
    }

    #[test]
    fn the_detected_scale_agrees_with_the_tai_clock() {
        let clock = SystemClock::detect();
        let offset = i64::try_from(read(libc::CLOCK_TAI)).unwrap() - i64::try_from(realtime_now().0).unwrap();
        let expected_s = match clock.scale() {
            TimeScale::Tai { offset_s } => i64::from(offset_s),
            TimeScale::Utc => 0,
        };
        assert!((offset - expected_s * 1_000_000_000).abs() < 500_000_000, "{offset} {expected_s}");
    }

    #[test]
    fn scales_name_themselves() {
        assert_eq!(TimeScale::Tai { offset_s: 37 }.to_string(), "TAI (UTC +37 s)");
        assert!(TimeScale::Utc.to_string().starts_with("UTC ("));
    }
}
