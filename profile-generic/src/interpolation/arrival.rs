//! The update clock of a controller that shares no clock: estimated from when its updates arrive.
//!
//! A controller sends its updates evenly; the network and the receiver make their arrivals uneven. Phase and period of the
//! controller are estimated by a line through the arrivals, at first through all of them and from then on through about the last
//! [`MEMORY`], older ones counting less and less (an alpha-beta filter). Set-points are placed by that line, not by the moment at which
//! an update happened to arrive.

use crate::time::{DurationNs, MonotonicTime};

/// Updates that the line goes through, about. A tenth of a period of jitter leaves below a hundredth of one between two updates.
const MEMORY: i64 = 64;

/// Late or early by more than this part of a period, an update says nothing about the line.
const OUTLIER_DIVISOR: i64 = 2;

/// After so many of them in a row the line is wrong, not the updates.
const OUTLIERS_MAX: u32 = 4;

/// The estimated period lies this near to the agreed one: a divisor, so 1 % here. Clocks of 100 ppm are usual.
const PERIOD_DIVISOR: i64 = 100;

/// Binary places of the estimated period.
const PLACES: u32 = 20;

/// Estimates when updates would have arrived on an even network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrivalClock {
    nominal: DurationNs,
    /// Estimated period, nanoseconds with [`PLACES`] places.
    period: i64,
    /// Estimated arrival of the last update, and the places behind its nanoseconds.
    last: Option<(MonotonicTime, i64)>,
    /// Updates that the line goes through, up to [`MEMORY`].
    known: i64,
    outliers: u32,
}

impl ArrivalClock {
    /// A clock for updates with this agreed period, above zero.
    #[must_use]
    pub const fn new(nominal: DurationNs) -> Self {
        Self { nominal, period: nominal.0 << PLACES, last: None, known: 0, outliers: 0 }
    }

    /// Takes the arrival of an update, `periods` after the one before (1, or more when some were lost). Returns when it would have
    /// arrived without jitter.
    pub fn arrive(&mut self, arrival: MonotonicTime, periods: u32) -> MonotonicTime {
        let Some((last, part)) = self.last else { return self.begin(arrival) };
        let periods = i64::from(periods.max(1));
        // A period of a tenth of a second needs 27 places, and 256 of them 35: they fit 63 with the 20 behind.
        let Some(way) = self.period.checked_mul(periods).and_then(|way| way.checked_add(part)) else {
            return self.begin(arrival);
        };
        let expected = last + DurationNs(way >> PLACES);
        let late = arrival.since(expected);
        if late.magnitude() > (self.nominal.0 / OUTLIER_DIVISOR).unsigned_abs() {
            self.outliers += 1;
            if self.outliers >= OUTLIERS_MAX {
                return self.begin(arrival);
            }
            self.last = Some((expected, way & ((1 << PLACES) - 1)));
            return expected;
        }
        self.outliers = 0;
        self.known = (self.known + 1).min(MEMORY);
        // The gains of a least-squares line through so many points.
        let n = self.known;
        let late = late.0 << PLACES;
        let phase = late / (n * (n + 1)) * (2 * (2 * n - 1));
        let change = late / (n * (n + 1)) * 6 / periods;
        let slack = (self.nominal.0 << PLACES) / PERIOD_DIVISOR;
        let nominal = self.nominal.0 << PLACES;
        self.period = (self.period + change).clamp(nominal - slack, nominal + slack);
        let way = way + phase;
        let estimate = last + DurationNs(way >> PLACES);
        self.last = Some((estimate, way & ((1 << PLACES) - 1)));
        estimate
    }

    /// The estimated period.
    #[must_use]
    pub const fn period(&self) -> DurationNs {
        DurationNs(self.period >> PLACES)
    }

    fn begin(&mut self, arrival: MonotonicTime) -> MonotonicTime {
        *self = Self { last: Some((arrival, 0)), known: 1, ..Self::new(self.nominal) };
        arrival
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PERIOD: DurationNs = DurationNs::from_millis(8);
    const START: MonotonicTime = MonotonicTime(77_000_000_000);

    /// When update `number` is sent by a controller whose clock is that fast, parts per million.
    fn sent(number: i64, ppm: i64) -> MonotonicTime {
        START + PERIOD * number - DurationNs(PERIOD.0 * number / 1_000_000 * ppm)
    }

    /// Noise from -500 to 500, the same for the same number.
    fn noise(number: i64) -> i64 {
        let mixed = number.cast_unsigned().wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((mixed ^ mixed >> 32) % 1_001).cast_signed() - 500
    }

    #[test]
    fn even_arrivals_are_given_back_exactly() {
        let mut clock = ArrivalClock::new(PERIOD);
        for number in 0..1_000 {
            assert_eq!(clock.arrive(sent(number, 0), 1), sent(number, 0));
        }
    }

    #[test]
    fn a_tenth_of_a_period_of_jitter_leaves_less_than_a_hundredth_between_two_updates() {
        for ppm in [0, 20, -200, 2_000] {
            let mut clock = ArrivalClock::new(PERIOD);
            let mut before = None;
            let (mut worst, mut off) = (0, 0);
            for number in 0..2_000 {
                // A tenth of a period in all: 400 us to either side.
                let arrival = sent(number, ppm) + DurationNs(800 * noise(number));
                let estimate = clock.arrive(arrival, 1);
                if let Some(before) = before.replace(estimate).filter(|_| number > 200) {
                    let way: DurationNs = estimate.since(before);
                    let even = sent(number, ppm).since(sent(number - 1, ppm));
                    worst = worst.max((way - even).magnitude());
                    off = off.max(estimate.since(sent(number, ppm)).magnitude());
                }
            }
            assert!(worst < 80_000, "{ppm}: {worst} ns between two updates");
            assert!(off < 200_000, "{ppm}: {off} ns off the controller's own grid");
        }
    }

    #[test]
    fn lost_and_late_updates_do_not_move_the_line() {
        let mut clock = ArrivalClock::new(PERIOD);
        for number in 0..100 {
            clock.arrive(sent(number, 0), 1);
        }
        assert_eq!(clock.arrive(sent(105, 0), 6), sent(105, 0), "five were lost");
        let late = sent(106, 0) + DurationNs::from_millis(20);
        assert_eq!(clock.arrive(late, 1), sent(106, 0), "one is late by two and a half periods");
        assert_eq!(clock.arrive(late, 1), sent(107, 0), "and the next comes with it");
        assert_eq!(clock.arrive(sent(108, 0), 1), sent(108, 0));
    }

    #[test]
    fn a_controller_that_begins_anew_is_followed_after_a_few_updates() {
        let mut clock = ArrivalClock::new(PERIOD);
        for number in 0..100 {
            clock.arrive(sent(number, 0), 1);
        }
        let pause = DurationNs::from_millis(300);
        for number in 100..103 {
            assert_eq!(clock.arrive(sent(number, 0) + pause, 1), sent(number, 0));
        }
        assert_eq!(clock.arrive(sent(103, 0) + pause, 1), sent(103, 0) + pause);
        assert_eq!(clock.arrive(sent(104, 0) + pause, 1), sent(104, 0) + pause);
    }

    proptest! {
        #[test]
        fn anything_is_survived(
            period in 1..100_000_000_i64,
            arrivals in prop::collection::vec((any::<u64>(), any::<u32>()), 1..40),
        ) {
            let mut clock = ArrivalClock::new(DurationNs(period));
            for (arrival, periods) in arrivals {
                let _ = clock.arrive(MonotonicTime(arrival), periods);
            }
        }
    }
}
