//! The velocity of an axis whose drive does not report it: its way from one position to a later one.

use arrayvec::ArrayVec;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::time::MonotonicTime;

/// Positions between which the way is taken: over more of them one count weighs less, and the velocity is older.
const SAMPLES: usize = 4;

/// The last positions with their instants, the oldest first.
#[derive(Debug, Clone, Default)]
pub(super) struct Velocimeter {
    samples: ArrayVec<(Position, MonotonicTime), SAMPLES>,
}

impl Velocimeter {
    /// Forgets all positions: those that come have nothing to do with them.
    pub(super) fn restart(&mut self) {
        self.samples.clear();
    }

    /// Takes a position. The velocity since the oldest of the last ones; `None` with the first.
    pub(super) fn sample(&mut self, position: Position, at: MonotonicTime) -> Option<Velocity> {
        if self.samples.last().is_some_and(|(_, newest)| at <= *newest) {
            // The clock was set.
            self.restart();
        }
        if self.samples.is_full() {
            self.samples.remove(0);
        }
        let oldest = self.samples.first().copied();
        self.samples.push((position, at));
        let (from, begin) = oldest?;
        let way = i128::from(position.get()) - i128::from(from.get());
        let velocity = way * 1_000_000_000 / i128::from(at.since(begin).as_nanos());
        let end = if way < 0 { i64::MIN } else { i64::MAX };
        Some(Velocity(i64::try_from(velocity).unwrap_or(end)))
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
}
