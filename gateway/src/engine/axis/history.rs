//! Where an axis was in the last cycles.

use profile_generic::quantity::Position;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Cycles that are remembered: as long as a service channel needs to report an edge.
const SAMPLES: usize = 128;

/// The last actual positions with their instants.
#[derive(Debug, Clone)]
pub struct History {
    samples: [(Position, MonotonicTime); SAMPLES],
    newest: usize,
    len: usize,
}

impl Default for History {
    fn default() -> Self {
        Self { samples: [(Position::ZERO, MonotonicTime::ZERO); SAMPLES], newest: 0, len: 0 }
    }
}

impl History {
    /// Adds a sample.
    pub fn push(&mut self, position: Position, at: MonotonicTime) {
        self.newest = (self.newest + 1) % SAMPLES;
        self.samples[self.newest] = (position, at);
        self.len = (self.len + 1).min(SAMPLES);
    }

    /// The last sample.
    pub fn newest(&self) -> Option<(Position, MonotonicTime)> {
        (self.len > 0).then(|| self.samples[self.newest])
    }

    /// The samples, the newest first.
    fn backward(&self) -> impl Iterator<Item = (Position, MonotonicTime)> {
        (0..self.len).map(|back| self.samples[(self.newest + SAMPLES - back) % SAMPLES])
    }

    /// When the axis was last at a position, not before `since`: between two samples at even speed. For a position
    /// where it was not, the instant of the closest sample.
    pub fn time_at(&self, position: Position, since: Option<MonotonicTime>) -> MonotonicTime {
        let since = since.unwrap_or(MonotonicTime::ZERO);
        let pairs =
            self.backward().zip(self.backward().skip(1)).take_while(|(_, (_, begin))| *begin >= since);
        for ((to, end), (from, begin)) in pairs {
            let (low, high) = (from.min(to), from.max(to));
            if low <= position && position <= high && low != high {
                let way = i128::from(to.get()) - i128::from(from.get());
                let part = i128::from(position.get()) - i128::from(from.get());
                let span = i128::from(end.since(begin).as_nanos());
                return begin + DurationNs(i64::try_from(part * span / way).unwrap_or(0));
            }
        }
        let apart = |sample: &(Position, MonotonicTime)| sample.0.get().abs_diff(position.get());
        let closest = self.backward().take_while(|(_, at)| *at >= since).min_by_key(apart);
        closest.map_or(MonotonicTime::ZERO, |(_, at)| at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(samples: &[(i64, u64)]) -> History {
        let mut history = History::default();
        for (position, at) in samples {
            history.push(Position(*position), MonotonicTime(*at));
        }
        history
    }

    #[test]
    fn the_last_time_at_a_place() {
        let history = history(&[(0, 1_000), (10, 2_000), (0, 3_000), (0, 4_000)]);
        let rows = [
            ("on the way back", 5, None, 2_500),
            ("at the turn", 10, None, 2_000),
            ("where it stands, when it came there", 0, None, 3_000),
            ("not before it stood", 5, Some(3_000), 4_000),
            ("where it never was", 40, None, 2_000),
        ];
        for (what, position, since, expected) in rows {
            assert_eq!(
                history.time_at(Position(position), since.map(MonotonicTime)),
                MonotonicTime(expected),
                "{what}"
            );
        }
        assert_eq!(History::default().time_at(Position(1), None), MonotonicTime::ZERO);
        assert_eq!(History::default().newest(), None);
    }

    #[test]
    fn old_samples_make_room() {
        let samples: Vec<_> = (0..300_i64).map(|n| (n, 1_000 * n.cast_unsigned())).collect();
        let history = history(&samples);
        assert_eq!(history.newest(), Some((Position(299), MonotonicTime(299_000))));
        assert_eq!(history.time_at(Position(172), None), MonotonicTime(172_000));
        assert_eq!(history.time_at(Position(10), None), MonotonicTime(172_000), "as far back as it goes");
    }
}
