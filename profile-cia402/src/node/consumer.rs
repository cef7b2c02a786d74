//! Heartbeats of others that the device watches, object 1016h.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::communication::{self, CONSUMERS};
use super::dictionary::Dictionary;
use crate::generated::objects;

/// One node under watch.
#[derive(Debug, Clone, Copy, Default)]
struct Watched {
    node: u8,
    time: DurationNs,
    /// The next one has to come by then; watching begins with the first one.
    due: Option<MonotonicTime>,
    lost: bool,
}

/// What a heartbeat, or its absence, means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Change {
    /// The first one, or one more.
    None,
    /// It stays away.
    Lost(u8),
    /// It is back.
    Back(u8),
}

/// The nodes under watch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Consumers {
    watched: [Watched; CONSUMERS as usize],
}

impl Consumers {
    /// Takes 1016h over; an entry that did not change goes on.
    pub fn refresh(&mut self, dictionary: &Dictionary) {
        for (sub, watched) in (1..=CONSUMERS).zip(&mut self.watched) {
            let (node, time) =
                communication::consumer(dictionary.number(objects::CONSUMER_HEARTBEAT_TIME, sub));
            let (node, time) = (u8::try_from(node).unwrap_or(0), DurationNs::from_millis(time));
            if (watched.node, watched.time) != (node, time) {
                *watched = Watched { node, time, due: None, lost: false };
            }
        }
    }

    /// A heartbeat or a boot-up message came.
    pub fn heard(&mut self, node: u8, now: MonotonicTime) -> Change {
        let watched =
            self.watched.iter_mut().find(|watched| watched.node == node && watched.time > DurationNs::ZERO);
        let Some(watched) = watched else { return Change::None };
        watched.due = Some(now + watched.time);
        if core::mem::take(&mut watched.lost) { Change::Back(node) } else { Change::None }
    }

    /// The next one that stays away.
    pub fn poll(&mut self, now: MonotonicTime) -> Change {
        for watched in &mut self.watched {
            if watched.due.is_some_and(|due| now >= due) {
                watched.due = None;
                watched.lost = true;
                return Change::Lost(watched.node);
            }
        }
        Change::None
    }
}
