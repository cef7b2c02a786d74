//! What the cycle thread is told of system time: a few words, written by the thread of the source.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use profile_cip::device::motion_device::{SyncQuality, SyncState};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;

use super::ptp::LOG_SYNC;
use super::ptp::wire::Control;
use super::status::TimeStatus;
use crate::engine::Engine;
use crate::latest::{Reader, Words};
use crate::sys::clock::{HostTime, monotonic_now};

/// What of a [`TimeStatus`] the cycle needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTime {
    /// Whether time is synchronized, and with whom. The offset is that of the time base.
    pub sync: SyncState,
    /// How well it is measured.
    pub quality: SyncQuality,
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
        let master = status.master;
        let quality = SyncQuality {
            // Before the first offset there is nothing that could vary.
            variance: match status.offset_from_master {
                Some(_) => u32::try_from(status.spread).unwrap_or(u32::MAX),
                None => u32::MAX,
            },
            steps_removed: master.map_or(0, |master| master.steps_removed),
            log_sync_interval: LOG_SYNC,
        };
        Self { sync, quality, sample: status.sample }
    }
}

/// Bits of the first word.
const HAS_GRANDMASTER: u64 = 1;
const SYNCHRONIZED: u64 = 2;
const HAS_SAMPLE: u64 = 4;

impl Words for CycleTime {
    type Array = [u64; 6];
    const EMPTY: Self::Array = [0; 6];

    fn to_words(&self, words: &mut Self::Array) -> usize {
        let bit = |is_set: bool, bit: u64| if is_set { bit } else { 0 };
        let flags = bit(self.sync.grandmaster.is_some(), HAS_GRANDMASTER)
            | bit(self.sync.synchronized, SYNCHRONIZED)
            | bit(self.sample.is_some(), HAS_SAMPLE);
        let grandmaster = u64::from_be_bytes(self.sync.grandmaster.unwrap_or_default());
        let [at, system, rate] = self
            .sample
            .map_or([0; 3], |sample| [sample.at.0, sample.system.0, sample.rate_ppb.cast_unsigned()]);
        let SyncQuality { variance, steps_removed, log_sync_interval } = self.quality;
        let [steps_low, steps_high] = steps_removed.to_le_bytes();
        let [a, b, c, d] = variance.to_le_bytes();
        let [interval] = log_sync_interval.to_le_bytes();
        let quality = u64::from_le_bytes([a, b, c, d, steps_low, steps_high, interval, 0]);
        *words = [flags, grandmaster, at, system, rate, quality];
        words.len()
    }

    fn from_words(words: &Self::Array) -> Self {
        let [flags, grandmaster, at, system, rate, quality] = *words;
        let [a, b, c, d, steps_low, steps_high, interval, _] = quality.to_le_bytes();
        let is_set = |bit: u64| flags & bit != 0;
        Self {
            sync: SyncState {
                grandmaster: is_set(HAS_GRANDMASTER).then(|| grandmaster.to_be_bytes()),
                synchronized: is_set(SYNCHRONIZED),
                offset: 0,
            },
            quality: SyncQuality {
                variance: u32::from_le_bytes([a, b, c, d]),
                steps_removed: u16::from_le_bytes([steps_low, steps_high]),
                log_sync_interval: i8::from_le_bytes([interval]),
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
    /// What was read last.
    latest: CycleTime,
    /// System time is the host's clock; otherwise what is told.
    is_host: bool,
    last: Option<(SyncState, SyncQuality)>,
    /// What the source is asked for.
    control: Arc<Control>,
    /// Threshold of the configuration, ns.
    threshold: u64,
}

impl TimeFeed {
    /// A feed from what the source reports; with `is_host` the time is that of the host's clock. `threshold` is that of a clock that no
    /// controller has said another one to, ns.
    #[must_use]
    pub fn new(reader: Reader<CycleTime>, is_host: bool, control: Arc<Control>, threshold: u64) -> Self {
        let latest = reader.read();
        Self { reader, latest, is_host, last: None, control, threshold }
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
        // The thread that writes may have lost its processor to this one: what it is writing is there in the next cycle.
        if let Some(latest) = self.reader.try_read() {
            self.latest = latest;
        }
        let latest = self.latest;
        if self.last != Some((latest.sync, latest.quality)) {
            self.last = Some((latest.sync, latest.quality));
            engine.set_sync(latest.sync);
            engine.set_sync_quality(latest.quality);
        }
        let threshold = engine.sync_threshold().unwrap_or(self.threshold);
        self.control.threshold.store(threshold, Ordering::Relaxed);
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
        let quality = SyncQuality { variance: 0x0102_0304, steps_removed: 0x0506, log_sync_interval: -3 };
        let sample = TimeSample { at: MonotonicTime(7), system: SystemTime(u64::MAX), rate_ppb: -40_000 };
        for told in [
            CycleTime::default(),
            CycleTime { sync, quality, sample: Some(sample) },
            CycleTime { sync: SyncState { synchronized: false, ..sync }, quality, sample: None },
            CycleTime { sync: SyncState { grandmaster: None, ..sync }, quality, sample: Some(sample) },
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
