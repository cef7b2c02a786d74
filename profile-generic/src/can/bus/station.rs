//! What stands between a station and the bus: queue, error counters, what is late.

use std::collections::VecDeque;

use super::Station;
use crate::can::frame::Frame;
use crate::time::{DurationNs, MonotonicTime};

/// Late frames that a station holds; what comes beyond is lost, as in a receiver that is not read.
const LATE_MAX: usize = 256;

/// Error counts at which a controller warns, becomes passive and goes off the bus (ISO 11898-1; the warning is custom).
const WARNING: u16 = 96;
const PASSIVE: u16 = 128;
const BUS_OFF: u16 = 256;

/// What an error adds to the counter of the sender.
const SEND_ERROR: u16 = 8;

/// Where the counter of a receiver that was passive stands after a good frame.
const RECEIVER_BACK: u16 = 127;

/// Error state of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum State {
    /// Few errors.
    Active,
    /// 96 errors counted: takes part as before.
    Warning,
    /// 128 errors counted: still takes part, and can no longer spoil the frames of others.
    Passive,
    /// 256 errors counted: neither sends nor receives.
    BusOff,
}

/// What a station has done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Frames that went out.
    pub sent: u64,
    /// Frames that came in.
    pub received: u64,
    /// Frames that were not taken.
    pub refused: u64,
    /// Frames that others have received and this station has not.
    pub lost: u64,
    /// Attempts to send that failed.
    pub errors: u64,
    /// Most frames that ever waited.
    pub queue_max: usize,
    /// Longest that a frame ever waited for the bus.
    pub wait_max: DurationNs,
}

/// A frame that waits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Waiting {
    /// Since when.
    pub since: MonotonicTime,
    /// The frame.
    pub frame: Frame,
    /// How long it takes on the wire. Counted once: it is asked for again and again while the frame waits.
    pub time: DurationNs,
}

/// A frame that is held back from a receiver.
#[derive(Debug, Clone, Copy)]
pub(super) struct Late {
    pub at: MonotonicTime,
    pub from: Station,
    pub frame: Frame,
}

#[derive(Debug)]
pub(super) struct Card {
    queue: VecDeque<Waiting>,
    capacity: usize,
    late: VecDeque<Late>,
    transmit_errors: u16,
    receive_errors: u16,
    pub connected: bool,
    /// When it is back on the bus.
    pub back_at: Option<MonotonicTime>,
    pub statistics: Statistics,
}

impl Card {
    pub fn new(capacity: usize) -> Self {
        Self {
            queue: VecDeque::with_capacity(capacity),
            capacity,
            late: VecDeque::with_capacity(LATE_MAX),
            transmit_errors: 0,
            receive_errors: 0,
            connected: true,
            back_at: None,
            statistics: Statistics::default(),
        }
    }

    pub fn state(&self) -> State {
        match self.transmit_errors.max(self.receive_errors) {
            _ if self.transmit_errors >= BUS_OFF => State::BusOff,
            PASSIVE.. => State::Passive,
            WARNING.. => State::Warning,
            _ => State::Active,
        }
    }

    /// Whether it takes part in the traffic.
    pub fn listens(&self) -> bool {
        self.connected && self.state() != State::BusOff
    }

    pub fn is_full(&self) -> bool {
        self.queue.len() >= self.capacity
    }

    pub fn waiting(&self) -> usize {
        self.queue.len()
    }

    pub fn push(&mut self, waiting: Waiting) {
        self.queue.push_back(waiting);
        self.statistics.queue_max = self.statistics.queue_max.max(self.queue.len());
    }

    pub fn waits_since(&self) -> Option<MonotonicTime> {
        self.queue.front().map(|waiting| waiting.since)
    }

    /// What it has to send at `start`.
    pub fn head(&self, start: MonotonicTime) -> Option<&Waiting> {
        self.queue.front().filter(|waiting| waiting.since <= start)
    }

    /// Its first frame, which began at `start`, has gone out; gives how long it had waited.
    pub fn sent(&mut self, start: MonotonicTime) -> Option<DurationNs> {
        let waiting = self.queue.pop_front()?;
        self.transmit_errors = self.transmit_errors.saturating_sub(1);
        self.statistics.sent += 1;
        let waited = start.since(waiting.since);
        self.statistics.wait_max = self.statistics.wait_max.max(waited);
        Some(waited)
    }

    pub fn spoilt(&mut self) {
        self.statistics.errors += 1;
        self.transmit_errors = (self.transmit_errors + SEND_ERROR).min(BUS_OFF);
    }

    /// A passive sender that is not acknowledged does not count on: it would go off a bus on which it is alone.
    pub fn unacknowledged(&mut self) {
        self.statistics.errors += 1;
        if self.transmit_errors < PASSIVE {
            self.transmit_errors += SEND_ERROR;
        }
    }

    pub fn heard(&mut self) {
        self.receive_errors = match self.receive_errors {
            PASSIVE.. => RECEIVER_BACK,
            count => count.saturating_sub(1),
        };
    }

    pub fn heard_error(&mut self) {
        self.receive_errors = (self.receive_errors + 1).min(PASSIVE);
    }

    pub fn saturate(&mut self) {
        self.transmit_errors = BUS_OFF;
    }

    pub fn clear(&mut self) {
        self.queue.clear();
    }

    pub fn disconnect(&mut self) {
        self.clear();
        self.late.clear();
        self.connected = false;
        self.back_at = None;
    }

    /// Takes part from now on, with nothing counted.
    pub fn connect(&mut self) {
        (self.transmit_errors, self.receive_errors) = (0, 0);
        self.connected = true;
        self.back_at = None;
    }

    pub fn has_nothing_late(&self) -> bool {
        self.late.is_empty()
    }

    /// Holds a frame back, and behind those that are late already: a station receives in order.
    pub fn delay(&mut self, late: Late) {
        if self.late.len() >= LATE_MAX {
            self.statistics.lost += 1;
            return;
        }
        let at = self.late.back().map_or(late.at, |before| before.at.max(late.at));
        self.late.push_back(Late { at, ..late });
    }

    /// A late frame whose time has come.
    pub fn late_frame(&mut self, now: MonotonicTime) -> Option<Late> {
        self.late.front().filter(|late| late.at <= now)?;
        self.statistics.received += 1;
        self.late.pop_front()
    }

    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let late = self.late.front().map(|late| late.at);
        late.into_iter().chain(self.back_at).min()
    }
}
