//! System time as a line over the monotonic clock.
//!
//! ```text
//! system time = local clock + System Time Offset        (CIP Volume 9, 2-2.1)
//! local clock = monotonic clock at the rate of the source, slewed to small differences
//! ```
//!
//! A source measures pairs of monotonic and system time ([`TimeSample`]). Small differences are slewed, as clause 2-2.2 does, at
//! most a thousandth of the time that passes. A larger one is a step: it goes into the System Time Offset, is reported with its
//! size, and moves nothing on the monotonic clock. Everything that moves an axis works in monotonic time; an instant of system
//! time is converted where it comes in ([`TimeBase::monotonic_at`]), so that no step of a clock is ever a step of a set-point
//! (clause 5-2.6.5.2 allows local time for the interpolator).

use crate::time::{DurationNs, MonotonicTime, SystemTime};

/// A difference beyond this is a step. Below, `SLEW_PPB` removes it within a tenth of a second.
pub const STEP_THRESHOLD: DurationNs = DurationNs::from_micros(100);

/// Time constant of the slew.
const SLEW_TIME: DurationNs = DurationNs::from_millis(100);

/// Fastest slew, parts per thousand million: a thousandth (clause 2-2.2).
const SLEW_PPB: i64 = 1_000_000;

/// Largest rate of a source that is believed, parts per thousand million: an ordinary crystal is 100 parts in a million off.
const RATE_PPB_MAX: i64 = 1_000_000;

const BILLION: i64 = 1_000_000_000;

/// System time as a source has measured it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeSample {
    /// When, on the monotonic clock.
    pub at: MonotonicTime,
    /// System time at that instant.
    pub system: SystemTime,
    /// Rate of system time against the monotonic clock, parts per thousand million, as far as the source knows it; 0 for a clock
    /// of the same rate.
    pub rate_ppb: i64,
}

/// The relation of system time to the monotonic clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeBase {
    anchor: MonotonicTime,
    /// System time at the anchor.
    system: SystemTime,
    /// Rate that the source knows, parts per thousand million.
    source_ppb: i64,
    /// What the slew adds to it, for [`SLEW_TIME`] from the anchor.
    slew_ppb: i64,
    /// System Time Offset: system time less local clock.
    offset: DurationNs,
    /// A difference beyond the threshold waits for a second sample: one alone may be a reading that was interrupted.
    candidate: Option<DurationNs>,
    /// Steps so far.
    steps: u32,
}

impl TimeBase {
    /// A time base that begins with this sample. Its System Time Offset is system time less monotonic time.
    #[must_use]
    pub const fn new(first: TimeSample) -> Self {
        let offset = first.system.0.wrapping_sub(first.at.0).cast_signed();
        Self {
            anchor: first.at,
            system: first.system,
            source_ppb: 0,
            slew_ppb: 0,
            offset: DurationNs(offset),
            candidate: None,
            steps: 0,
        }
    }

    /// System time at an instant of the monotonic clock.
    #[must_use]
    pub fn system_at(&self, at: MonotonicTime) -> SystemTime {
        let elapsed = at.since(self.anchor);
        self.system + elapsed + self.gained(elapsed)
    }

    /// What system time gains on the monotonic clock in a time from the anchor. The slew ends when it has removed the difference, also
    /// when no sample comes that shows that.
    fn gained(&self, elapsed: DurationNs) -> DurationNs {
        let slewed = DurationNs(elapsed.0.clamp(-SLEW_TIME.0, SLEW_TIME.0));
        drift(elapsed, self.source_ppb) + drift(slewed, self.slew_ppb)
    }

    /// The instant of the monotonic clock at which it is this system time, to some nanoseconds within an hour of the last sample.
    /// Saturates at both ends of the clock.
    #[must_use]
    pub fn monotonic_at(&self, system: SystemTime) -> MonotonicTime {
        let elapsed = system.since(self.system);
        // Each round leaves a thousandth of the error of the one before.
        let correction = (0..3).fold(DurationNs::ZERO, |gained, _| self.gained(elapsed - gained));
        self.anchor + elapsed - correction
    }

    /// The instant of the monotonic clock at which something is due for this system time, some milliseconds from the last sample. A
    /// slew that is under way is left out: it is over soon, and nobody knows when. So a target moves by what has been slewed
    /// when it is converted; with the slew in it, the targets of the first update behind a change of rate would move by what
    /// will be slewed until then as well, two to three times as much as in the ones that follow.
    #[must_use]
    pub fn target_at(&self, system: SystemTime) -> MonotonicTime {
        let elapsed = system.since(self.system);
        self.anchor + elapsed - drift(elapsed, self.source_ppb)
    }

    /// System Time Offset (CIP Sync): system time less local clock. Changes with a step, never with a slew.
    #[must_use]
    pub const fn offset(&self) -> DurationNs {
        self.offset
    }

    /// Steps since the start.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// Takes a sample. A difference that two samples in a row show beyond [`STEP_THRESHOLD`] is a step: its size comes back.
    pub fn feed(&mut self, sample: &TimeSample) -> Option<DurationNs> {
        let expected = self.system_at(sample.at);
        let difference = sample.system.since(expected);
        if difference.magnitude() <= STEP_THRESHOLD.magnitude() {
            self.candidate = None;
            (self.anchor, self.system) = (sample.at, expected);
            let slew = difference.0 * BILLION / SLEW_TIME.0;
            self.source_ppb = sample.rate_ppb.clamp(-RATE_PPB_MAX, RATE_PPB_MAX);
            self.slew_ppb = slew.clamp(-SLEW_PPB, SLEW_PPB);
            return None;
        }
        let before = self.candidate.replace(difference)?;
        if (difference - before).magnitude() > STEP_THRESHOLD.magnitude() {
            return None;
        }
        self.candidate = None;
        (self.anchor, self.system) = (sample.at, sample.system);
        self.offset = self.offset + difference;
        self.steps = self.steps.saturating_add(1);
        Some(difference)
    }
}

/// What a rate adds in a time.
fn drift(elapsed: DurationNs, rate_ppb: i64) -> DurationNs {
    DurationNs(match elapsed.0.checked_mul(rate_ppb) {
        Some(product) => product / BILLION,
        // Beyond some hours.
        None => (elapsed.0 / BILLION).saturating_mul(rate_ppb),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EPOCH: SystemTime = SystemTime(1_700_000_000_000_000_000);

    fn ms(count: u64) -> MonotonicTime {
        MonotonicTime(5_000_000_000 + count * 1_000_000)
    }

    /// A sample whose system time is that much later than on the line from the first.
    fn sample(at: MonotonicTime, later: i64) -> TimeSample {
        TimeSample { at, system: EPOCH + at.since(ms(0)) + DurationNs(later), rate_ppb: 0 }
    }

    fn begun() -> TimeBase {
        TimeBase::new(sample(ms(0), 0))
    }

    #[test]
    fn the_offset_is_system_time_less_local_clock() {
        let base = begun();
        assert_eq!(base.offset().0, 1_700_000_000_000_000_000 - 5_000_000_000);
        assert_eq!(base.system_at(ms(7)), EPOCH + DurationNs::from_millis(7));
        assert_eq!(base.monotonic_at(EPOCH + DurationNs::from_millis(7)), ms(7));
        assert_eq!(base.monotonic_at(EPOCH - DurationNs::from_millis(3)), ms(0) - DurationNs::from_millis(3));
    }

    #[test]
    fn a_small_difference_is_slewed_and_changes_no_offset() {
        let mut base = begun();
        let offset = base.offset();
        let mut last = base.system_at(ms(0));
        for cycle in 1..=500 {
            assert_eq!(base.feed(&sample(ms(cycle), 90_000)), None);
            let now = base.system_at(ms(cycle));
            let rate = now.since(last).0 - 1_000_000;
            assert!((0..=1_001).contains(&rate), "a thousandth of the time at most: {rate} ns in 1 ms");
            last = now;
        }
        let left = sample(ms(500), 90_000).system.since(base.system_at(ms(500)));
        assert!(left.0.abs() < 1_000, "{left} is left after five time constants");
        assert_eq!((base.offset(), base.steps()), (offset, 0));
    }

    /// Targets two update periods of 8 ms ahead, while 90 us are slewed: none moves by more than a thousandth of the time between two
    /// of them.
    #[test]
    fn targets_move_by_no_more_than_the_slew() {
        for (later, ppb) in [(90_000, 0), (-90_000, 0), (90_000, 20_000), (-90_000, -200_000)] {
            let mut base = begun();
            let mut last = None;
            for cycle in 0..500_u64 {
                let gained = at_rate(ms(cycle), ppb);
                let later = gained + if cycle > 100 { later } else { 0 };
                base.feed(&TimeSample { rate_ppb: ppb, ..sample(ms(cycle), later) });
                if !cycle.is_multiple_of(8) {
                    continue;
                }
                let system = EPOCH + ms(cycle + 16).since(ms(0)) + DurationNs(at_rate(ms(cycle + 16), ppb));
                let target = base.target_at(system);
                if let Some(before) = last.replace(target) {
                    let off = target.since(before) - DurationNs::from_millis(8);
                    assert!(off.magnitude() <= 8_010, "{later} {ppb} {cycle}: {off}");
                }
            }
        }
    }

    fn at_rate(at: MonotonicTime, ppb: i64) -> i64 {
        at.since(ms(0)).0 * ppb / BILLION
    }

    #[test]
    fn a_step_is_an_event_with_its_size() {
        for step in [20_000_000, -20_000_000, 3_600_000_000_000, -3_600_000_000_000, 37_000_000_000, 100_001]
        {
            let mut base = begun();
            let offset = base.offset();
            assert_eq!(base.feed(&sample(ms(1), 0)), None);
            assert_eq!(base.feed(&sample(ms(2), step)), None, "one sample may be an interrupted reading");
            assert_eq!(base.system_at(ms(2)), sample(ms(2), 0).system);
            assert_eq!(base.feed(&sample(ms(3), step)), Some(DurationNs(step)));
            assert_eq!(base.system_at(ms(3)), sample(ms(3), step).system);
            assert_eq!((base.offset() - offset, base.steps()), (DurationNs(step), 1));
            assert_eq!(base.feed(&sample(ms(4), step)), None);
        }
    }

    #[test]
    fn readings_that_disagree_are_no_step() {
        let mut base = begun();
        for (cycle, later) in [(1, 5_000_000), (2, 0), (3, 5_000_000), (4, -5_000_000), (5, 9_000_000)] {
            assert_eq!(base.feed(&sample(ms(cycle), later)), None, "{cycle}");
        }
        assert_eq!(base.steps(), 0);
        assert_eq!(base.system_at(ms(9)), sample(ms(9), 0).system);
    }

    #[test]
    fn a_slew_ends_though_no_sample_comes() {
        for later in [50_000, -50_000, 1_000] {
            let mut base = begun();
            base.feed(&TimeSample { rate_ppb: 20_000, ..sample(ms(1), later) });
            for seconds in [1, 10, 600] {
                let at = ms(1 + seconds * 1_000);
                let source = sample(at, later + at_rate(at, 20_000) - at_rate(ms(1), 20_000)).system;
                assert!(source.since(base.system_at(at)).magnitude() <= 5, "{later} {seconds}");
                assert!(base.monotonic_at(source).since(at).magnitude() <= 5, "{later} {seconds}");
            }
        }
    }

    #[test]
    fn a_source_of_another_rate_is_followed() {
        for ppb in [20_000, -20_000, 200_000, -200_000] {
            for known in [0, ppb] {
                let mut base = begun();
                for cycle in 1..=2_000_u64 {
                    let at = ms(cycle);
                    let gained = at.since(ms(0)).0 * ppb / BILLION;
                    let fed = TimeSample { rate_ppb: known, ..sample(at, gained) };
                    assert_eq!(base.feed(&fed), None);
                    if cycle > 1_000 {
                        let error = fed.system.since(base.system_at(at)).magnitude();
                        // A rate that nobody tells leaves what the slew needs: its time constant at that rate.
                        let bound = if known == 0 { ppb.unsigned_abs() / 10 + 100 } else { 100 };
                        assert!(error <= bound, "{ppb} {known}: {error} ns");
                    }
                }
            }
        }
    }

    #[test]
    fn the_ends_of_the_clock_are_survived() {
        let mut base = TimeBase::new(TimeSample { at: ms(0), system: SystemTime::MAX, rate_ppb: i64::MAX });
        base.feed(&TimeSample { at: MonotonicTime::MAX, system: SystemTime::ZERO, rate_ppb: i64::MIN });
        base.feed(&TimeSample { at: MonotonicTime::ZERO, system: SystemTime::MAX, rate_ppb: i64::MAX });
        assert_eq!(base.system_at(MonotonicTime::MAX), SystemTime::MAX);
        let _ = base.monotonic_at(SystemTime::ZERO);
    }

    proptest! {
        /// Whatever the rate, both directions agree within some nanoseconds over an hour either way.
        #[test]
        fn there_and_back(
            source_ppb in -1_000_000_i64..=1_000_000,
            slew_ppb in -1_000_000_i64..=1_000_000,
            elapsed in prop_oneof![-3_600_000_000_000_i64..=3_600_000_000_000, -200_000_000_i64..=200_000_000],
        ) {
            let base = TimeBase { source_ppb, slew_ppb, anchor: MonotonicTime(10_000_000_000_000), ..begun() };
            let at = base.anchor + DurationNs(elapsed);
            let error = base.monotonic_at(base.system_at(at)).since(at);
            prop_assert!(error.magnitude() <= 5, "{error}");
        }

        #[test]
        fn anything_is_survived(samples in prop::collection::vec((any::<u64>(), any::<u64>(), any::<i64>()), 1..30)) {
            let mut base = begun();
            for (at, system, rate_ppb) in samples {
                base.feed(&TimeSample { at: MonotonicTime(at), system: SystemTime(system), rate_ppb });
                let _ = (base.system_at(MonotonicTime(system)), base.monotonic_at(SystemTime(at)));
                let _ = base.target_at(SystemTime(at));
            }
        }
    }
}
