//! One log line for many events of a kind.

use profile_generic::time::{DurationNs, MonotonicTime};

/// How long events are gathered before the first line, so that it has a count.
const GATHER: DurationNs = DurationNs::from_secs(1);

/// Least time between two lines.
const INTERVAL: DurationNs = DurationNs::from_secs(60);

/// Counts events, and says when a line about them is due: a second after the first one, and at most once a minute.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LogLimit {
    count: u64,
    due: Option<MonotonicTime>,
    logged: Option<MonotonicTime>,
}

impl LogLimit {
    /// So many more events have happened.
    pub fn add(&mut self, now: MonotonicTime, count: u64) {
        if count == 0 {
            return;
        }
        self.count = self.count.saturating_add(count);
        let earliest = self.logged.map_or(MonotonicTime::ZERO, |at| at + INTERVAL);
        self.due.get_or_insert((now + GATHER).max(earliest));
    }

    /// The events since the last line, when another line is due.
    pub fn take(&mut self, now: MonotonicTime) -> Option<u64> {
        self.due.take_if(|due| *due <= now)?;
        self.logged = Some(now);
        Some(std::mem::take(&mut self.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_gathered_for_a_second_and_then_for_a_minute() {
        let mut limit = LogLimit::default();
        let at = |millis: i64| MonotonicTime(1_000_000_000) + DurationNs::from_millis(millis);
        assert_eq!(limit.take(at(0)), None);
        limit.add(at(0), 0);
        assert_eq!(limit.take(at(5_000)), None, "nothing has happened");
        limit.add(at(5_000), 2);
        limit.add(at(5_999), 3);
        assert_eq!(
            (limit.take(at(5_999)), limit.take(at(6_000)), limit.take(at(6_000))),
            (None, Some(5), None)
        );
        limit.add(at(6_001), 7);
        limit.add(at(65_999), 1);
        assert_eq!((limit.take(at(65_999)), limit.take(at(66_000))), (None, Some(8)));
        limit.add(at(500_000), 1);
        assert_eq!((limit.take(at(500_999)), limit.take(at(501_000))), (None, Some(1)), "after a quiet time");
    }
}
