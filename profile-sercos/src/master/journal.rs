//! Events that wait for the application, and the counters.

use std::collections::VecDeque;

use super::event::{Event, Statistics};

/// Events kept until they are taken; later ones are dropped and counted.
pub const EVENTS_MAX: usize = 1024;

/// What the master has to say.
#[derive(Debug)]
pub(super) struct Journal {
    events: VecDeque<Event>,
    pub statistics: Statistics,
}

impl Journal {
    pub fn new() -> Journal {
        Journal { events: VecDeque::with_capacity(EVENTS_MAX), statistics: Statistics::default() }
    }

    /// Keeps an event while there is room.
    pub fn emit(&mut self, event: Event) {
        if self.events.len() < EVENTS_MAX {
            self.events.push_back(event);
        } else {
            self.statistics.events_lost += 1;
        }
    }

    /// The oldest event.
    pub fn take(&mut self) -> Option<Event> {
        self.events.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn event_beyond_the_room_is_counted_and_dropped() {
        let mut journal = Journal::new();
        for slaves in 0..=u16::try_from(EVENTS_MAX).unwrap() {
            journal.emit(Event::Scanned { slaves });
        }
        assert_eq!(journal.statistics.events_lost, 1);
        let taken: Vec<_> = std::iter::from_fn(|| journal.take()).collect();
        assert_eq!((taken.len(), &taken[0]), (EVENTS_MAX, &Event::Scanned { slaves: 0 }));
        assert_eq!(taken.last(), Some(&Event::Scanned { slaves: 1023 }));
    }
}
