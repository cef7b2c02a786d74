//! What the cycle thread is told of system time: a few words, written by the thread of the source.

use profile_cip::device::motion_device::SyncState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;

use super::status::TimeStatus;
use crate::engine::Engine;
use crate::latest::{Reader, Words};
use crate::sys::clock::{HostTime, monotonic_now};

/// What of a [`TimeStatus`] the cycle needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTime {
    /// Whether time is synchronized, and with whom. The offset is that of the time base.
    pub sync: SyncState,
    /// System time with the monotonic time of one instant, and its rate.
    pub sample: Option<TimeSample>,
}

impl CycleTime {
    /// What is told of a state.
    #[must_use]
    pub fn of(status: &TimeStatus) -> Self {
        let sync = SyncState {
            grandmaster: status.grandmaster,
            synchronized: status.phase.is_synchronized(),
            offset: 0,
        };
        Self { sync, sample: status.sample }
    }
}

/// Bits of the first word.
const HAS_GRANDMASTER: u64 = 1;
const SYNCHRONIZED: u64 = 2;
const HAS_SAMPLE: u64 = 4;

impl Words for CycleTime {
    type Array = [u64; 5];
    const EMPTY: Self::Array = [0; 5];

    fn to_words(&self, words: &mut Self::Array) -> usize {
        let bit = |is_set: bool, bit: u64| if is_set { bit } else { 0 };
        let flags = bit(self.sync.grandmaster.is_some(), HAS_GRANDMASTER)
            | bit(self.sync.synchronized, SYNCHRONIZED)
            | bit(self.sample.is_some(), HAS_SAMPLE);
        let grandmaster = u64::from_be_bytes(self.sync.grandmaster.unwrap_or_default());
        let [at, system, rate] = self
            .sample
            .map_or([0; 3], |sample| [sample.at.0, sample.system.0, sample.rate_ppb.cast_unsigned()]);
        *words = [flags, grandmaster, at, system, rate];
        words.len()
    }

    fn from_words(words: &Self::Array) -> Self {
        let [flags, grandmaster, at, system, rate] = *words;
        let is_set = |bit: u64| flags & bit != 0;
        Self {
            sync: SyncState {
                grandmaster: is_set(HAS_GRANDMASTER).then(|| grandmaster.to_be_bytes()),
                synchronized: is_set(SYNCHRONIZED),
                offset: 0,
            },
            sample: is_set(HAS_SAMPLE).then_some(TimeSample {
                at: MonotonicTime(at),
                system: SystemTime(system),
                rate_ppb: rate.cast_signed(),
            }),
        }
    }
}

/// Feeds the engine with system time, cycle by cycle.
#[derive(Debug)]
pub struct TimeFeed {
    reader: Reader<CycleTime>,
    /// System time is the host's clock; otherwise what is told.
    is_host: bool,
    last: Option<SyncState>,
}

impl TimeFeed {
    /// A feed from what is told; with `is_host` the time is that of the host's clock.
    #[must_use]
    pub const fn new(reader: Reader<CycleTime>, is_host: bool) -> Self {
        Self { reader, is_host, last: None }
    }

    /// Feeds before the first cycle.
    pub fn begin(&mut self, engine: &mut Engine) {
        if self.is_host {
            engine.feed_time(&HostTime.first_sample());
        }
        self.feed(engine);
    }

    /// Feeds after a cycle: a sample that is a cycle old is as good.
    pub fn feed(&mut self, engine: &mut Engine) {
        let latest = self.reader.read();
        if self.last != Some(latest.sync) {
            self.last = Some(latest.sync);
            engine.set_sync(latest.sync);
        }
        let sample = if self.is_host {
            HostTime.sample()
        } else {
            latest.sample.map(|line| line_at(&line, monotonic_now()))
        };
        if let Some(sample) = sample {
            engine.feed_time(&sample);
        }
    }
}

/// The point of a line at an instant.
#[must_use]
pub fn line_at(line: &TimeSample, at: MonotonicTime) -> TimeSample {
    let elapsed = at.since(line.at);
    let gained = i128::from(elapsed.0) * i128::from(line.rate_ppb) / 1_000_000_000;
    let gained = DurationNs(i64::try_from(gained).unwrap_or(0));
    TimeSample { at, system: line.system + elapsed + gained, ..*line }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_arrives() {
        let sync = SyncState { grandmaster: Some([1, 2, 3, 4, 5, 6, 7, 8]), synchronized: true, offset: 0 };
        let sample = TimeSample { at: MonotonicTime(7), system: SystemTime(u64::MAX), rate_ppb: -40_000 };
        for told in [
            CycleTime::default(),
            CycleTime { sync, sample: Some(sample) },
            CycleTime { sync: SyncState { synchronized: false, ..sync }, sample: None },
            CycleTime { sync: SyncState { grandmaster: None, ..sync }, sample: Some(sample) },
        ] {
            let mut words = CycleTime::EMPTY;
            assert_eq!(told.to_words(&mut words), words.len());
            assert_eq!(CycleTime::from_words(&words), told);
        }
    }

    #[test]
    fn a_line_goes_on_with_its_rate() {
        let line = TimeSample {
            at: MonotonicTime(1_000_000_000),
            system: SystemTime(5_000_000_000),
            rate_ppb: 40_000,
        };
        let later = line_at(&line, MonotonicTime(11_000_000_000));
        assert_eq!((later.system, later.rate_ppb), (SystemTime(15_000_400_000), 40_000));
        assert_eq!(line_at(&line, MonotonicTime(0)).system, SystemTime(3_999_960_000));
    }
}
