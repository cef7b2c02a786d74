//! Velocity and acceleration of an axis whose drive does not report them: its way from one position to a later one, and what its
//! velocity has gained from one cycle to a later one.

use arrayvec::ArrayVec;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Values between which the difference is taken: over more of them one count weighs less, and the result is older.
const SAMPLES: usize = 4;

/// The last values with their instants, the oldest first.
#[derive(Debug, Clone, Default)]
struct Slope {
    samples: ArrayVec<(i64, MonotonicTime), SAMPLES>,
}

impl Slope {
    fn restart(&mut self) {
        self.samples.clear();
    }

    /// Takes a value. What it has gained in a second since the oldest of the last ones; `None` with the first.
    fn sample(&mut self, value: i64, at: MonotonicTime) -> Option<i64> {
        if self.samples.last().is_some_and(|(_, newest)| at <= *newest) {
            // The clock was set.
            self.restart();
        }
        if self.samples.is_full() {
            self.samples.remove(0);
        }
        let oldest = self.samples.first().copied();
        self.samples.push((value, at));
        let (from, begin) = oldest?;
        let gain = i128::from(value) - i128::from(from);
        let slope = gain * 1_000_000_000 / i128::from(at.since(begin).as_nanos());
        let end = if gain < 0 { i64::MIN } else { i64::MAX };
        Some(i64::try_from(slope).unwrap_or(end))
    }
}

/// The velocity by the last positions.
#[derive(Debug, Clone, Default)]
pub(super) struct Velocimeter(Slope);

impl Velocimeter {
    /// Forgets all positions: those that come have nothing to do with them.
    pub(super) fn restart(&mut self) {
        self.0.restart();
    }

    /// Takes a position. The velocity since the oldest of the last ones; `None` with the first.
    pub(super) fn sample(&mut self, position: Position, at: MonotonicTime) -> Option<Velocity> {
        self.0.sample(position.get(), at).map(Velocity)
    }
}

/// The acceleration by the last velocities, through a low-pass filter (clause 5-2.6.6.4).
#[derive(Debug, Clone, Default)]
pub(super) struct Accelerometer {
    slope: Slope,
    /// What the filter has put out last, and when.
    filtered: Option<(i64, MonotonicTime)>,
}

impl Accelerometer {
    /// Takes a velocity. The acceleration since the oldest of the last ones, filtered with this time constant, where 0 is no filter;
    /// `None` with the first.
    pub(super) fn sample(
        &mut self,
        velocity: Velocity,
        at: MonotonicTime,
        time_constant: DurationNs,
    ) -> Option<Acceleration> {
        let raw = self.slope.sample(velocity.get(), at);
        let before = self.filtered.take().filter(|(_, newest)| *newest < at);
        let now = match (raw?, before) {
            (raw, None) => raw,
            (raw, Some((held, newest))) => {
                let step = i128::from(at.since(newest).as_nanos());
                let gain = (i128::from(raw) - i128::from(held)) * step;
                let gain = gain / (step + i128::from(time_constant.as_nanos()));
                // Between two values of 64 bits.
                i64::try_from(i128::from(held) + gain).unwrap_or(raw)
            }
        };
        self.filtered = Some((now, at));
        Some(Acceleration(now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn the_way_over_three_cycles() {
        let mut meter = Velocimeter::default();
        let mut sample = |position, ms: u64| {
            meter.sample(Position(position), MonotonicTime(ms * MS)).map(|velocity| velocity.get())
        };
        assert_eq!(sample(1_000, 10), None, "one position is no way");
        assert_eq!(sample(3_000, 12), Some(1_000_000));
        assert_eq!(sample(3_000, 14), Some(500_000));
        assert_eq!(sample(3_000, 16), Some(333_333));
        assert_eq!(sample(3_000, 18), Some(0), "the first one counts no more");
        // A telegram is lost: what comes next is measured over its own time.
        assert_eq!(sample(-2_000, 22), Some(-5_000 * 1_000 / 8));
        assert_eq!(sample(7_000, 21), None, "a clock that was set back");
        assert_eq!(sample(i64::MAX, 22), Some(i64::MAX), "what no number holds is not told smaller");
    }

    #[test]
    fn positions_of_before_a_restart_count_no_more() {
        let mut meter = Velocimeter::default();
        meter.sample(Position(0), MonotonicTime(0));
        meter.restart();
        assert_eq!(meter.sample(Position(1_000_000), MonotonicTime(MS)), None);
        assert_eq!(meter.sample(Position(1_000_001), MonotonicTime(2 * MS)), Some(Velocity(1_000)));
    }

    #[test]
    fn acceleration_is_what_the_velocity_gains_and_its_filter_lets_it_follow_slowly() {
        let run = |time_constant: DurationNs| {
            let mut meter = Accelerometer::default();
            let mut all = Vec::new();
            for cycle in 0..40_i64 {
                // At rest for ten cycles of 1 ms, then 2 units per second squared.
                let velocity = Velocity((cycle - 10).max(0) * 2_000_000);
                let at = MonotonicTime(1 + cycle.unsigned_abs() * MS);
                all.push(meter.sample(velocity, at, time_constant).map(|value| value.get()));
            }
            all
        };
        let plain = run(DurationNs::ZERO);
        assert_eq!((plain[0], plain[1], plain[10]), (None, Some(0), Some(0)));
        assert_eq!(plain[14..].iter().filter(|value| **value != Some(2_000_000_000)).count(), 0);
        // 10 ms: 63 % after 10 ms, and never more than all of it.
        let slow = run(DurationNs::from_millis(10));
        let after = slow[22].expect("a value");
        assert!((1_100_000_000..1_400_000_000).contains(&after), "{after}");
        assert!(slow.windows(2).all(|pair| pair[0] <= pair[1] && pair[1] <= Some(2_000_000_000)), "{slow:?}");
    }

    #[test]
    fn acceleration_beyond_64_bits_is_held_and_a_clock_that_was_set_begins_anew() {
        let mut meter = Accelerometer::default();
        let mut sample = |velocity, at: u64| {
            let filter = DurationNs::from_millis(1);
            meter.sample(Velocity(velocity), MonotonicTime(at), filter).map(|value| value.get())
        };
        assert_eq!(sample(i64::MIN, 10), None);
        assert_eq!(sample(i64::MAX, 11), Some(i64::MAX));
        assert_eq!(sample(0, 5), None, "earlier than before");
        assert_eq!(sample(1, 6), Some(1_000_000_000));
    }
}
