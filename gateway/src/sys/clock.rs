//! The clocks of the host, and sleeping until an instant.
//!
//! | clock | from | used for |
//! |---|---|---|
//! | [`monotonic_now`] | `CLOCK_MONOTONIC` | the cycle, time-outs; never steps |
//! | [`HostTime::sample`] | `CLOCK_TAI` against `CLOCK_MONOTONIC` | the source of CIP Sync system time |
//! | [`KernelTime`] | `CLOCK_REALTIME` | the kernel's receive time stamps, recordings |
//!
//! System time itself is a [`TimeBase`](profile_generic::time_base::TimeBase) over the monotonic clock: when somebody sets the host's
//! clock, that is a step of its source and moves no axis. `CLOCK_TAI` knows no leap seconds, so that one is none either, where the
//! kernel has been told the offset.
//!
//! CIP Sync counts the seconds of TAI. The kernel knows the offset from UTC to TAI only when a time daemon
//! has told it (`ptp4l`, `phc2sys`, `chronyd` with `leapsectz`). Without one the offset is zero and
//! `CLOCK_TAI` is UTC under another name; [`HostTime::scale`] says which of the two it is, so that the
//! box can report it. An offset that appears later is a step of the source.
#![allow(unsafe_code)]

use std::fmt;
use std::io;
use std::mem::MaybeUninit;

use profile_generic::time::{MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// A time stamp of the kernel: nanoseconds of `CLOCK_REALTIME` (UTC) since 1970.
///
/// [`monotonic_of`] turns a fresh one into monotonic time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KernelTime(pub u64);

/// The time on the host's monotonic clock.
#[must_use]
pub fn monotonic_now() -> MonotonicTime {
    MonotonicTime(read(ClockId::Monotonic))
}

/// The time on the host's real-time clock (UTC): for file names and time stamps in recordings.
#[must_use]
pub fn realtime_now() -> KernelTime {
    KernelTime(read(ClockId::Realtime))
}

/// An instant of the monotonic clock on the clock of TAI, for instants around now.
#[must_use]
pub fn tai_of(at: MonotonicTime) -> KernelTime {
    on(ClockId::Tai, at)
}

/// An instant of the monotonic clock on the real-time clock, for instants around now.
#[must_use]
pub fn realtime_of(at: MonotonicTime) -> KernelTime {
    on(ClockId::Realtime, at)
}

fn on(clock: ClockId, at: MonotonicTime) -> KernelTime {
    let (now, there) = (monotonic_now(), read(clock));
    KernelTime(there.wrapping_add(at.0).wrapping_sub(now.0))
}

/// Sleeps until the monotonic clock reads `deadline`; a deadline in the past returns at once.
///
/// Signals do not shorten the sleep.
///
/// # Errors
/// What `clock_nanosleep` refuses, which for a valid clock and time is nothing.
pub fn sleep_until(deadline: MonotonicTime) -> io::Result<()> {
    let request = Timespec {
        // Seconds since boot stay far below 2^63.
        tv_sec: i64::try_from(deadline.0 / NANOSECONDS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: (deadline.0 % NANOSECONDS_PER_SECOND).try_into().unwrap_or(0),
    };
    loop {
        match clock_nanosleep_absolute(ClockId::Monotonic, &request) {
            Err(Errno::INTR) => {}
            result => return result.map_err(io::Error::from),
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

/// Readings of which the best is taken: between the two of the monotonic clock the thread may be interrupted.
const READINGS: usize = 3;

/// A pair of readings further apart than this says nothing.
const APART_MAX_NS: u64 = 20_000;

/// The host's clock as a source of system time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HostTime;

impl HostTime {
    /// System time with the monotonic time of the same instant, to some hundred nanoseconds; `None` when the thread was interrupted
    /// at each try. Two to nine readings of clocks, no waiting.
    #[must_use]
    pub fn sample(self) -> Option<TimeSample> {
        let PairedReading { at, time, .. } = paired(|| read(ClockId::Tai)).usable()?;
        Some(TimeSample { at, system: SystemTime(time), rate_ppb: 0 })
    }

    /// The first sample, whatever interrupts it: as good as there is one.
    #[must_use]
    pub fn first_sample(self) -> TimeSample {
        self.sample().unwrap_or_else(|| TimeSample {
            at: monotonic_now(),
            system: SystemTime(read(ClockId::Tai)),
            rate_ppb: 0,
        })
    }

    /// The scale that it counts now.
    #[must_use]
    pub fn scale(self) -> TimeScale {
        match kernel_clock() {
            Some(KernelClock { tai_offset_s: offset_s, .. }) if offset_s != 0 => TimeScale::Tai { offset_s },
            _ => TimeScale::Utc,
        }
    }
}

/// A reading of a clock with the monotonic time of the same instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairedReading {
    /// How far the two readings of the monotonic clock around it are apart, ns.
    pub apart: u64,
    /// Their middle.
    pub at: MonotonicTime,
    /// The reading, ns.
    pub time: u64,
}

impl PairedReading {
    /// Itself, if the thread was not interrupted between the readings.
    pub(super) fn usable(self) -> Option<Self> {
        Some(self).filter(|reading| reading.apart <= APART_MAX_NS)
    }
}

/// The best of some readings of a clock beside the monotonic one.
pub(super) fn paired(read: impl Fn() -> u64) -> PairedReading {
    let once = || {
        let before = monotonic_now();
        let time = read();
        let apart = monotonic_now().0.saturating_sub(before.0);
        PairedReading { apart, at: MonotonicTime(before.0 + apart / 2), time }
    };
    let mut best = once();
    for _ in 1..READINGS {
        if best.apart <= APART_MAX_NS / 10 {
            break;
        }
        let next = once();
        if next.apart < best.apart {
            best = next;
        }
    }
    best
}

/// The host's real-time clock beside the monotonic one; `None` when the thread was interrupted at each try.
#[must_use]
pub fn realtime_reading() -> Option<PairedReading> {
    paired(|| read(ClockId::Realtime)).usable()
}

/// The monotonic time of a stamp of the kernel that was taken just now, to some hundred nanoseconds; `None` for one that is older
/// than a second, as the clock may have been set since, and when the thread was interrupted at each reading.
#[must_use]
pub fn exactly_monotonic(stamp: KernelTime) -> Option<MonotonicTime> {
    let PairedReading { at, time, .. } = realtime_reading()?;
    let age = time.checked_sub(stamp.0).filter(|age| *age < NANOSECONDS_PER_SECOND)?;
    at.0.checked_sub(age).map(MonotonicTime)
}

/// The monotonic time of a stamp of the kernel that was taken just now: within the last second. `None` for any other, as the clock
/// may have been set since.
#[must_use]
pub fn monotonic_of(stamp: KernelTime) -> Option<MonotonicTime> {
    let (now, realtime) = (monotonic_now(), realtime_now());
    let age = realtime.0.checked_sub(stamp.0).filter(|age| *age < NANOSECONDS_PER_SECOND)?;
    now.0.checked_sub(age).map(MonotonicTime)
}

/// What the kernel knows of its clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KernelClock {
    /// Somebody keeps it right: a daemon of PTP or NTP that has told the kernel so.
    pub disciplined: bool,
    /// Bound of its error, ns, as far as the daemon has told one: the smaller of its estimate and its maximum.
    pub error_bound: u64,
    /// Offset of TAI from UTC, s; 0 where nobody has told it.
    pub tai_offset_s: i32,
}

/// What the kernel knows of its clock; `None` when it cannot be asked.
#[must_use]
pub fn kernel_clock() -> Option<KernelClock> {
    let mut state = MaybeUninit::<libc::timex>::zeroed();
    // SAFETY: `state` is writable and outlives the call; `timex` is plain integers, for which all zeroes is a value, and its modes
    // of 0 only read.
    let (result, state) = unsafe { (libc::adjtimex(state.as_mut_ptr()), state.assume_init()) };
    let micros = |value: libc::c_long| u64::try_from(value).unwrap_or(u64::MAX).saturating_mul(1_000);
    (result >= 0).then(|| KernelClock {
        disciplined: state.status & libc::STA_UNSYNC == 0,
        error_bound: micros(state.esterror).min(micros(state.maxerror)),
        tai_offset_s: state.tai,
    })
}

/// Whether somebody keeps the host's clock right: a daemon of PTP or NTP that has told the kernel so.
#[must_use]
pub fn is_disciplined() -> bool {
    kernel_clock().is_some_and(|clock| clock.disciplined)
}

fn read(clock: ClockId) -> u64 {
    let now = clock_gettime(clock);
    nanoseconds(now.tv_sec, now.tv_nsec)
}

/// A time at or after its epoch as nanoseconds; times before it read as 0.
pub(super) fn nanoseconds(seconds: impl TryInto<u64>, rest: impl TryInto<u64>) -> u64 {
    let (seconds, rest) = (seconds.try_into().unwrap_or(0), rest.try_into().unwrap_or(0));
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
    fn a_sample_is_the_tai_clock_at_an_instant_of_the_monotonic_one() {
        let before = monotonic_now();
        let sample = HostTime.first_sample();
        let after = monotonic_now();
        assert!((before..=after).contains(&sample.at), "{before} {} {after}", sample.at);
        let offset = |at: MonotonicTime, system: u64| system.wrapping_sub(at.0).cast_signed();
        let again = HostTime.first_sample();
        let apart = offset(sample.at, sample.system.0) - offset(again.at, again.system.0);
        assert!(apart.abs() < 1_000_000, "{apart} ns between two samples");
    }

    #[test]
    fn a_fresh_stamp_of_the_kernel_is_an_instant_of_the_monotonic_clock() {
        let (before, stamp) = (monotonic_now(), realtime_now());
        let at = monotonic_of(stamp).unwrap();
        assert!(at.0.abs_diff(before.0) < 100_000_000, "{at} {before}");
        assert_eq!(
            monotonic_of(KernelTime(stamp.0 - 2_000_000_000)),
            None,
            "long ago: the clock may have been set"
        );
        assert_eq!(monotonic_of(KernelTime(stamp.0 + 2_000_000_000)), None, "not yet");
    }

    #[test]
    fn the_scale_agrees_with_the_tai_clock() {
        let offset = i64::try_from(read(ClockId::Tai)).unwrap() - i64::try_from(realtime_now().0).unwrap();
        let expected_s = match HostTime.scale() {
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
