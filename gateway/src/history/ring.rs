//! The last lines of the log, in memory.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::event::LogEvent;
use crate::config::LogLevel;

/// Lines that are kept, and most lines of an answer.
pub const LINES_MAX: usize = 10_000;

/// Bytes of a text that are kept; a line has a few hundred.
const TEXT_LEN_MAX: usize = 2_048;

/// The last lines of the log. A line costs one short lock; nothing of the cycle comes here.
#[derive(Debug, Default)]
pub struct EventRing(Mutex<Lines>);

#[derive(Debug, Default)]
struct Lines {
    /// Oldest first.
    events: VecDeque<Arc<LogEvent>>,
    /// Number of the newest line; 0 before the first one.
    newest: u64,
}

/// Which lines are wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogQuery {
    /// Only lines after this number, the oldest of them; without it the newest lines.
    pub after: Option<u64>,
    /// At most so many.
    pub lines: usize,
    /// The least level.
    pub level: LogLevel,
    /// Only lines about this axis.
    pub axis: Option<String>,
}

impl Default for LogQuery {
    fn default() -> Self {
        Self { after: None, lines: 100, level: LogLevel::Trace, axis: None }
    }
}

/// Lines that were asked for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// The lines, oldest first.
    pub events: Vec<Arc<LogEvent>>,
    /// The number to go on after.
    pub next: u64,
    /// Lines after the wanted number that are no longer there.
    pub missed: u64,
}

impl EventRing {
    /// Adds a line, and gives it its number. The oldest line goes when there are too many.
    pub fn push(&self, mut event: LogEvent) {
        if event.text.len() > TEXT_LEN_MAX {
            let end = (0..=TEXT_LEN_MAX).rev().find(|end| event.text.is_char_boundary(*end)).unwrap_or(0);
            event.text.truncate(end);
            event.text.push_str(" ...");
        }
        let mut lines = self.lock();
        lines.newest += 1;
        event.number = lines.newest;
        if lines.events.len() == LINES_MAX {
            lines.events.pop_front();
        }
        lines.events.push_back(Arc::new(event));
    }

    /// Number of the newest line; 0 before the first one.
    #[must_use]
    pub fn newest(&self) -> u64 {
        self.lock().newest
    }

    /// The lines that are asked for.
    #[must_use]
    pub fn select(&self, query: &LogQuery) -> Selection {
        let (events, newest) = {
            let lines = self.lock();
            // A number that is not there yet is of another process.
            let after = query.after.filter(|after| *after <= lines.newest).unwrap_or(0);
            let known = lines.events.iter().filter(|event| event.number > after);
            (known.map(Arc::clone).collect::<Vec<_>>(), lines.newest)
        };
        let oldest = events.first().map_or(newest + 1, |event| event.number);
        let missed = query.after.filter(|after| *after <= newest).map_or(0, |after| oldest - after - 1);
        let about = |event: &&Arc<LogEvent>| {
            event.is_of(query.level) && (query.axis.is_none() || event.axis == query.axis)
        };
        let lines = query.lines.min(LINES_MAX);
        if query.after.is_none() {
            let mut chosen: Vec<_> = events.iter().rev().filter(about).take(lines).cloned().collect();
            chosen.reverse();
            return Selection { events: chosen, next: newest, missed };
        }
        let chosen: Vec<_> = events.iter().filter(about).take(lines).cloned().collect();
        // What did not fit into the answer comes with the next one.
        let next = chosen.last().filter(|_| chosen.len() == lines).map_or(newest, |event| event.number);
        Selection { events: chosen, next, missed }
    }

    fn lock(&self) -> MutexGuard<'_, Lines> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(text: &str, level: LogLevel, axis: Option<&str>) -> LogEvent {
        LogEvent {
            level: level.name().to_owned(),
            axis: axis.map(str::to_owned),
            text: text.to_owned(),
            ..LogEvent::default()
        }
    }

    fn texts(selection: &Selection) -> Vec<&str> {
        selection.events.iter().map(|event| event.text.as_str()).collect()
    }

    fn ring() -> EventRing {
        let ring = EventRing::default();
        for (text, level, axis) in [
            ("a", LogLevel::Info, Some("x")),
            ("b", LogLevel::Warn, None),
            ("c", LogLevel::Debug, Some("y")),
            ("d", LogLevel::Error, Some("x")),
        ] {
            ring.push(event(text, level, axis));
        }
        ring
    }

    #[test]
    fn newest_lines_come_in_their_order_by_level_and_axis() {
        let ring = ring();
        let all = ring.select(&LogQuery::default());
        assert_eq!((texts(&all), all.next, all.missed), (vec!["a", "b", "c", "d"], 4, 0));
        assert_eq!(all.events.iter().map(|event| event.number).collect::<Vec<_>>(), [1, 2, 3, 4]);
        let two = ring.select(&LogQuery { lines: 2, ..LogQuery::default() });
        assert_eq!((texts(&two), two.next), (vec!["c", "d"], 4));
        let warnings = ring.select(&LogQuery { level: LogLevel::Warn, ..LogQuery::default() });
        assert_eq!(texts(&warnings), ["b", "d"]);
        let of_x = LogQuery { axis: Some("x".to_owned()), lines: 1, ..LogQuery::default() };
        assert_eq!(texts(&ring.select(&of_x)), ["d"]);
    }

    #[test]
    fn lines_after_a_number_are_neither_repeated_nor_left_out() {
        let ring = ring();
        let mut query = LogQuery { after: Some(1), lines: 2, ..LogQuery::default() };
        let first = ring.select(&query);
        assert_eq!((texts(&first), first.next, first.missed), (vec!["b", "c"], 3, 0));
        query.after = Some(first.next);
        let second = ring.select(&query);
        assert_eq!((texts(&second), second.next), (vec!["d"], 4));
        query.after = Some(4);
        assert_eq!(ring.select(&query), Selection { events: vec![], next: 4, missed: 0 });
        // Of lines that are not wanted nothing is asked again.
        let of_y = LogQuery { after: Some(0), axis: Some("y".to_owned()), ..LogQuery::default() };
        assert_eq!(ring.select(&of_y).next, 4);
        // A number of another process.
        query.after = Some(77);
        assert_eq!(texts(&ring.select(&query)), ["a", "b"]);
    }

    #[test]
    fn ring_is_bounded_in_lines_and_bytes_and_says_what_is_missing() {
        let ring = EventRing::default();
        for number in 1..=LINES_MAX + 25 {
            ring.push(event(&number.to_string(), LogLevel::Info, None));
        }
        let all = ring.select(&LogQuery { after: Some(5), lines: LINES_MAX + 9, ..LogQuery::default() });
        assert_eq!((all.events.len(), all.events[0].number, all.missed), (LINES_MAX, 26, 20));
        assert_eq!((all.events[0].text.as_str(), all.next), ("26", 10_025));
        ring.push(event(&"\u{e4}".repeat(TEXT_LEN_MAX), LogLevel::Info, None));
        let last = ring.select(&LogQuery { lines: 1, ..LogQuery::default() });
        assert_eq!(last.events[0].text.len(), TEXT_LEN_MAX + " ...".len());
    }
}
