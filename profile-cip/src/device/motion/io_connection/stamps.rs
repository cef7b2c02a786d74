//! Time stamps and arrivals of the updates: what can be trusted, and when the controller's update clock ticks.

use profile_generic::interpolation::ArrivalClock;
use profile_generic::time::{DurationNs, MonotonicTime};

/// What an update is, by its time stamp in synchronous operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Age {
    OnTime,
    /// More than one period old.
    Late,
    /// Beyond the low limit.
    Alarming,
    /// Beyond the high limit.
    TooLate,
    /// Further ahead than the high limit.
    Ahead,
}

/// The controller's update clock.
#[derive(Debug, Clone)]
pub(crate) struct Stamps {
    /// Controller Update Period, ns.
    period: u64,
    /// The update clock, estimated from the arrivals of the updates.
    arrivals: ArrivalClock,
    /// The last time stamp that was trusted, on the local clock, with Update ID and arrival of its update.
    stamped: Option<(u64, u8, MonotonicTime)>,
}

impl Stamps {
    pub fn new(period: u64) -> Self {
        let length = DurationNs(i64::try_from(period).unwrap_or(i64::MAX).max(1));
        Self { period, arrivals: ArrivalClock::new(length), stamped: None }
    }

    /// Judges a time stamp in this device's system time; all in ns.
    pub fn age(&self, time_stamp: u64, system_time: u64, low_limit: u64, high_limit: u64) -> Age {
        let period = self.period;
        let ahead = time_stamp.saturating_sub(system_time);
        let age = system_time.saturating_sub(time_stamp);
        if ahead > period.saturating_mul(high_limit.max(1)) {
            Age::Ahead
        } else if age > period.saturating_mul(high_limit) {
            Age::TooLate
        } else if age > period.saturating_mul(low_limit) {
            Age::Alarming
        } else if age > period {
            Age::Late
        } else {
            Age::OnTime
        }
    }

    /// An update has arrived, after so many lost ones: when it would have arrived without the jitter of the network.
    pub fn arrive(&mut self, arrival: MonotonicTime, lost: u8) -> MonotonicTime {
        self.arrivals.arrive(arrival, u32::from(lost) + 1)
    }

    /// Whether a time stamp, on the local clock in ns, follows from the one before: to half a period as many periods later as the
    /// Update ID says. After a gap in the arrivals it may be as long later as the update has arrived later, to one and a half
    /// periods: a controller that was held up leaves out cycles. One that does neither is of a clock that was set.
    pub fn follows(&mut self, stamp: u64, id: u8, arrival: MonotonicTime) -> bool {
        let period = self.period;
        let plausible = self.stamped.is_none_or(|(last, before, arrived)| {
            let advance = stamp.wrapping_sub(last).cast_signed();
            let expected = u64::from(id.wrapping_sub(before)).saturating_mul(period);
            let gap = arrival.0.saturating_sub(arrived.0);
            let near = |expected: u64| advance.abs_diff(expected.cast_signed());
            near(expected) <= period / 2
                || gap > expected.saturating_add(period / 2) && near(gap) <= period + period / 2
        });
        if plausible {
            self.stamped = Some((stamp, id, arrival));
        }
        plausible
    }

    /// Time stamps are not looked at any more: the next one begins anew.
    pub fn forget(&mut self) {
        self.stamped = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 1_000;

    #[test]
    fn age_is_counted_in_periods() {
        let stamps = Stamps::new(PERIOD);
        let age = |time_stamp| stamps.age(time_stamp, 100_000, 2, 4);
        let cases = [
            (104_001, Age::Ahead),
            (104_000, Age::OnTime),
            (99_000, Age::OnTime),
            (98_999, Age::Late),
            (97_999, Age::Alarming),
            (95_999, Age::TooLate),
        ];
        for (time_stamp, wanted) in cases {
            assert_eq!(age(time_stamp), wanted, "{time_stamp}");
        }
    }

    #[test]
    fn stamp_of_a_clock_that_was_set_does_not_follow() {
        let mut stamps = Stamps::new(PERIOD);
        assert!(stamps.follows(50_000, 1, MonotonicTime(0)));
        assert!(stamps.follows(52_500, 3, MonotonicTime(2_000)));
        assert!(!stamps.follows(54_001, 4, MonotonicTime(3_000)));
        // The controller was held up: later by as much as it arrived later.
        assert!(stamps.follows(62_500, 4, MonotonicTime(12_000)));
        assert!(!stamps.follows(10, 5, MonotonicTime(13_000)));
        stamps.forget();
        assert!(stamps.follows(10, 5, MonotonicTime(13_000)));
    }
}
