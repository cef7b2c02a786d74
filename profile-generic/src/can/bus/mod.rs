//! A CAN bus in virtual time.
//!
//! Stations hand in frames, the bus carries one at a time: of all that wait when it becomes free the one with the lowest
//! identifier goes first, and takes as long as its bits take at the bit rate. Nothing happens between two calls: whoever
//! drives it calls [`Bus::poll`] until it is `None`, and again at [`Bus::wake_at`]. What is handed in at the very moment at
//! which the bus becomes free takes part in that arbitration.
//!
//! Each station has a queue that goes out in the order in which it came, as behind a network card; a full queue refuses
//! ([`SendError::Full`], Linux's `ENOBUFS`). It has the error counters of ISO 11898-1: a frame that is not acknowledged or
//! is spoilt ([`Disturbance`]) is sent again and costs 8, a good one gives 1 back; at 256 the station is off the bus.
//! Nobody acknowledges to a station that is alone, which takes it to error passive and no further.
//!
//! Two stations that send the same bits at the same time are one frame, as slaves answering an LSS fastscan are. The same
//! identifier with other bits behind it is a collision: both spoil each other's frame, again and again, until one is off.
//! The bus tells of this and of everything else that cannot happen on a well-built network by station and rule: [`Violation`].
//!
//! Nothing is allocated once the stations are there, as long as it is polled until `None` after each call.

mod disturbance;
mod station;
#[cfg(test)]
mod tests;
mod violation;

use std::collections::VecDeque;

pub use self::disturbance::{DISTURBANCES_MAX, Disturbance, Effect};
use self::station::{Card, Late, Waiting};
pub use self::station::{State, Statistics};
use self::violation::Checker;
pub use self::violation::{Rule, VIOLATIONS_MAX, Violation};
use super::frame::{Frame, Id};
use super::timing::{BitRate, ERROR_FRAME_BITS, RECOVERY_BITS, exact};
use crate::time::{DurationNs, MonotonicTime};

/// Stations that a bus has at most; more than its 127 node numbers and a few listeners.
pub const STATIONS_MAX: usize = 160;

/// Frames that a queue holds unless told otherwise: what Linux gives a CAN interface.
pub const QUEUE_DEFAULT: usize = 10;

/// A station: its place in the order in which they were added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Station(u8);

impl Station {
    /// Its place, from 0.
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl core::fmt::Display for Station {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "station {}", self.0)
    }
}

/// Why a frame was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The station's queue is full.
    #[error("the transmit queue is full")]
    Full,
    /// The station is off the bus after too many errors.
    #[error("the station is off the bus")]
    BusOff,
    /// The station has no power or no cable.
    #[error("the station is not connected")]
    Disconnected,
    /// The bus carries classic frames only.
    #[error("an FD frame on a classic bus")]
    Fd,
}

/// What comes out of the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// A station has received a frame.
    Received {
        /// The end of the frame, later by what a [`Effect::Delay`] adds.
        at: MonotonicTime,
        /// Who receives.
        to: Station,
        /// Who has sent it; of several that sent the same bits the first.
        from: Station,
        /// The frame.
        frame: Frame,
    },
    /// A frame has gone out.
    Sent {
        /// Its end.
        at: MonotonicTime,
        /// Who has sent it.
        from: Station,
        /// The frame.
        frame: Frame,
    },
    /// The error state of a station has changed.
    State {
        /// When.
        at: MonotonicTime,
        /// Whose.
        station: Station,
        /// What it is now.
        state: State,
    },
}

/// What the bus has carried.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Frames that went through.
    pub frames: u64,
    /// Frames that were spoilt or not acknowledged, each of which was sent again.
    pub errors: u64,
    /// Of them those of two stations with one identifier.
    pub collisions: u64,
    /// For how long the bus was taken, errors included.
    pub busy: DurationNs,
}

/// What is on the wire.
#[derive(Debug, Clone, Copy)]
struct Carried {
    frame: Frame,
    start: MonotonicTime,
    end: MonotonicTime,
    /// Bit n is station n.
    senders: Senders,
    fate: Fate,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Good,
    Spoilt,
    Collision,
    Unacknowledged,
}

/// A set of stations.
#[derive(Debug, Clone, Copy, Default)]
struct Senders([u64; STATIONS_MAX.div_ceil(64)]);

impl Senders {
    fn add(&mut self, station: usize) {
        self.0[station / 64] |= 1 << (station % 64);
    }

    fn has(&self, station: usize) -> bool {
        self.0[station / 64] >> (station % 64) & 1 == 1
    }
}

/// A CAN bus in virtual time, with its stations.
#[derive(Debug)]
pub struct Bus {
    rate: BitRate,
    cards: Vec<Card>,
    /// What the frame that came through last has yet to give out.
    out: VecDeque<Output>,
    carried: Option<Carried>,
    /// When the bus is free, if nothing is on it.
    free: MonotonicTime,
    traffic: Traffic,
    /// Busy time and instant of the last reading of the load.
    load_from: (MonotonicTime, DurationNs),
    disturbances: disturbance::List,
    checker: Checker,
    restart: Option<DurationNs>,
}

impl Bus {
    /// A bus at this rate with no stations.
    #[must_use]
    pub fn new(rate: BitRate) -> Self {
        Self {
            rate,
            cards: Vec::new(),
            out: VecDeque::with_capacity(4 * STATIONS_MAX),
            carried: None,
            free: MonotonicTime::ZERO,
            traffic: Traffic::default(),
            load_from: (MonotonicTime::ZERO, DurationNs::ZERO),
            disturbances: disturbance::List::default(),
            checker: Checker::default(),
            restart: None,
        }
    }

    /// Adds a station whose queue holds `queue` frames; `None` beyond [`STATIONS_MAX`]. The only call that allocates.
    pub fn add(&mut self, queue: usize) -> Option<Station> {
        let place = Some(self.cards.len()).filter(|&len| len < STATIONS_MAX)?;
        let station = Station(u8::try_from(place).ok()?);
        self.cards.push(Card::new(queue.max(1)));
        Some(station)
    }

    /// Its bit rate.
    #[must_use]
    pub const fn rate(&self) -> BitRate {
        self.rate
    }

    /// Lets stations come back by themselves, so long after they went off the bus (Linux: `restart-ms`). With `None`, as at
    /// the start, they wait for [`Bus::restart`].
    pub fn set_restart(&mut self, after: Option<DurationNs>) {
        self.restart = after;
    }

    /// Disturbs frames to come; `false` when there are [`DISTURBANCES_MAX`] disturbances already.
    pub fn disturb(&mut self, disturbance: Disturbance) -> bool {
        self.disturbances.add(disturbance)
    }

    /// Ends all disturbances.
    pub fn calm(&mut self) {
        self.disturbances.clear();
    }

    /// Permits several stations to send this identifier.
    pub fn share(&mut self, id: Id) {
        self.checker.share(id);
    }

    /// Calls it a violation when a frame waits longer than this for the bus.
    pub fn set_patience(&mut self, patience: DurationNs) {
        self.checker.patience = patience;
    }

    /// What could not happen on a well-built network, in order; the first [`VIOLATIONS_MAX`].
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        self.checker.violations()
    }

    /// Forgets the violations so far and gives how many there were.
    pub fn pardon(&mut self) -> usize {
        self.checker.pardon()
    }

    /// Ends a test that broke a rule without meaning to.
    ///
    /// # Panics
    /// With station and rule of each violation since the start or the last [`Bus::pardon`].
    #[track_caller]
    pub fn judge(&self) {
        let violations: Vec<String> = self.violations().iter().map(Violation::to_string).collect();
        assert!(violations.is_empty(), "on the CAN bus:\n{}", violations.join("\n"));
    }

    /// Hands in a frame.
    ///
    /// # Errors
    /// [`SendError`]: the frame is not sent.
    ///
    /// # Panics
    /// When the station is none of this bus.
    pub fn send(&mut self, now: MonotonicTime, station: Station, frame: &Frame) -> Result<(), SendError> {
        self.advance(now);
        let card = &mut self.cards[station.index()];
        let refused = if !card.connected {
            Err(SendError::Disconnected)
        } else if card.state() == State::BusOff {
            Err(SendError::BusOff)
        } else if frame.is_fd() && !self.rate.is_fd() {
            self.checker.broken(Violation { at: now, station, rule: Rule::FdFrame { id: frame.id() } });
            Err(SendError::Fd)
        } else if card.is_full() {
            Err(SendError::Full)
        } else {
            Ok(())
        };
        if refused.is_err() {
            card.statistics.refused += 1;
            return refused;
        }
        card.push(Waiting { since: now, frame: *frame, time: self.rate.time(exact(frame)) });
        self.checker.sent(now, station, frame);
        Ok(())
    }

    /// What has come out of the bus up to `now`, one at a time.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Output> {
        self.advance(now);
        if let Some(output) = self.out.pop_front() {
            return Some(output);
        }
        self.stations().find_map(|to| {
            let Late { at, from, frame } = self.cards[to.index()].late_frame(now)?;
            Some(Output::Received { at, to, from, frame })
        })
    }

    /// When to poll again; `None` when nothing is under way.
    ///
    /// Frames handed in later may make it earlier.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if !self.out.is_empty() {
            return Some(self.free);
        }
        let wire = match &self.carried {
            Some(carried) => Some(carried.end),
            None => self.next_start().and_then(|start| {
                let (winner, ..) = self.arbitrate(start)?;
                Some(start + winner.time)
            }),
        };
        let cards = self.cards.iter().filter_map(Card::wake_at);
        wire.into_iter().chain(cards).min()
    }

    /// Takes a station from the bus (no power, or its plug is pulled): its queue is lost, what it was just sending is spoilt,
    /// and it receives nothing.
    pub fn disconnect(&mut self, now: MonotonicTime, station: Station) {
        self.advance(now);
        self.cards[station.index()].disconnect();
        self.break_off(station);
    }

    /// Puts it back, with no errors counted.
    pub fn connect(&mut self, now: MonotonicTime, station: Station) {
        self.advance(now);
        self.cards[station.index()].connect();
    }

    /// Takes a station off the bus as too many errors would.
    pub fn take_off(&mut self, now: MonotonicTime, station: Station) {
        self.advance(now);
        if self.cards[station.index()].state() != State::BusOff {
            self.cards[station.index()].saturate();
            self.break_off(station);
            self.changed(now, station);
        }
    }

    /// Spoils the frame that a station is just sending.
    fn break_off(&mut self, station: Station) {
        if let Some(carried) = self.carried.as_mut().filter(|carried| carried.senders.has(station.index())) {
            carried.fate = Fate::Spoilt;
        }
    }

    /// Begins the recovery of a station that is off the bus: it is back after 128 times eleven recessive bits.
    pub fn restart(&mut self, now: MonotonicTime, station: Station) {
        self.advance(now);
        let card = &mut self.cards[station.index()];
        if card.state() == State::BusOff {
            card.back_at = Some(now + self.rate.time(RECOVERY_BITS));
        }
    }

    /// Error state of a station.
    #[must_use]
    pub fn state(&self, station: Station) -> State {
        self.cards[station.index()].state()
    }

    /// Frames that a station has waiting.
    #[must_use]
    pub fn waiting(&self, station: Station) -> usize {
        self.cards[station.index()].waiting()
    }

    /// What a station has done.
    #[must_use]
    pub fn statistics(&self, station: Station) -> Statistics {
        self.cards[station.index()].statistics
    }

    /// What the bus has carried.
    #[must_use]
    pub const fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// How much of the time since the last call the bus was taken, in thousandths.
    pub fn take_load(&mut self, now: MonotonicTime) -> u32 {
        self.advance(now);
        let under_way = self.carried.map_or(DurationNs::ZERO, |carried| now.since(carried.start));
        let busy = self.traffic.busy + under_way;
        let (from, before) = core::mem::replace(&mut self.load_from, (now, busy));
        let span = now.since(from).0;
        if span <= 0 {
            return 0;
        }
        let thousandths = i128::from((busy - before).0.max(0)) * 1000 / i128::from(span);
        u32::try_from(thousandths).unwrap_or(u32::MAX)
    }

    /// Lets everything happen that happens before `now`, and ends frames that end at `now`.
    fn advance(&mut self, now: MonotonicTime) {
        loop {
            let end = self.carried.as_ref().map(|carried| carried.end);
            let start = if end.is_none() { self.next_start() } else { None };
            let back = self.next_back();
            let next = end.or(start).map_or(MonotonicTime::MAX, |at| at);
            if let Some((at, station)) = back.filter(|(at, _)| *at <= next.min(now)) {
                self.cards[station.index()].connect();
                self.changed(at, station);
            } else if end.is_some_and(|end| end <= now) {
                self.finish();
            } else if let Some(start) = start.filter(|start| *start < now) {
                self.begin(start, now);
            } else {
                return;
            }
        }
    }

    /// The station that recovers next, and when.
    fn next_back(&self) -> Option<(MonotonicTime, Station)> {
        let backs =
            self.stations().filter_map(|station| Some((self.cards[station.index()].back_at?, station)));
        backs.min()
    }

    fn stations(&self) -> impl Iterator<Item = Station> + use<> {
        (0..self.cards.len()).filter_map(|place| u8::try_from(place).ok().map(Station))
    }

    /// When the next frame could begin.
    fn next_start(&self) -> Option<MonotonicTime> {
        let earliest = self.cards.iter().filter_map(Card::waits_since).min()?;
        Some(earliest.max(self.free))
    }

    /// The frame that wins the bus at `start`, all that send its very bits, and the first that sends other bits behind the same
    /// identifier.
    fn arbitrate(&self, start: MonotonicTime) -> Option<(&Waiting, Senders, Option<usize>)> {
        let candidates = self.cards.iter().enumerate();
        let candidates = candidates.filter_map(|(place, card)| Some((place, card.head(start)?)));
        let (_, winner) = candidates.clone().min_by_key(|(_, waiting)| precedence(&waiting.frame))?;
        let (mut senders, mut rival) = (Senders::default(), None);
        for (place, waiting) in candidates {
            if precedence(&waiting.frame) == precedence(&winner.frame) {
                senders.add(place);
                if waiting.frame != winner.frame {
                    rival = rival.or(Some(place));
                }
            }
        }
        Some((winner, senders, rival))
    }

    /// Puts the next frame on the wire at `start`. A station that is alone tries again and again until `now`.
    fn begin(&mut self, start: MonotonicTime, now: MonotonicTime) {
        let Some((&Waiting { frame, mut time, .. }, senders, rival)) = self.arbitrate(start) else { return };
        let listens = |place: usize| self.cards[place].listens() && !senders.has(place);
        let heard = (0..self.cards.len()).any(listens) || rival.is_some();
        let first = self.stations().find(|station| senders.has(station.index()));
        let fate = if let (Some(rival), Some(station)) = (rival, first) {
            let rule =
                Rule::Collision { with: Station(u8::try_from(rival).unwrap_or(u8::MAX)), id: frame.id() };
            self.checker.broken(Violation { at: start, station, rule });
            self.traffic.collisions += 1;
            Fate::Collision
        } else if !heard {
            Fate::Unacknowledged
        } else if self.disturbances.spoils(first, &frame) {
            Fate::Spoilt
        } else {
            Fate::Good
        };
        let mut start = start;
        if fate != Fate::Good {
            time = time + self.rate.time(ERROR_FRAME_BITS);
            if fate == Fate::Unacknowledged && self.only_passive(senders) {
                // Nothing changes from one attempt to the next: straight to the last one that begins before now.
                let attempts = (now.since(start).0 - 1).max(0) / time.0.max(1);
                start = start + DurationNs(time.0.saturating_mul(attempts));
                self.traffic.errors += attempts.unsigned_abs();
                self.traffic.busy = self.traffic.busy + DurationNs(time.0.saturating_mul(attempts));
            }
        }
        self.carried = Some(Carried { frame, start, end: start + time, senders, fate });
    }

    fn only_passive(&self, senders: Senders) -> bool {
        let mut cards = self.cards.iter().enumerate().filter(|(place, _)| senders.has(*place));
        cards.all(|(_, card)| card.state() == State::Passive)
    }

    /// Ends what is on the wire.
    fn finish(&mut self) {
        let Some(Carried { frame, start, end, senders, fate }) = self.carried.take() else { return };
        self.free = end;
        self.traffic.busy = self.traffic.busy + end.since(start);
        if fate == Fate::Good {
            self.traffic.frames += 1;
        } else {
            self.traffic.errors += 1;
        }
        let first = self.stations().find(|station| senders.has(station.index()));
        for station in self.stations() {
            let card = &mut self.cards[station.index()];
            let before = card.state();
            match (senders.has(station.index()), fate) {
                (true, Fate::Good) => {
                    if let Some(waited) = card.sent(start) {
                        self.out.push_back(Output::Sent { at: end, from: station, frame });
                        self.checker.waited(start, station, frame.id(), waited);
                    }
                }
                (true, Fate::Unacknowledged) => card.unacknowledged(),
                (true, Fate::Spoilt | Fate::Collision) => card.spoilt(),
                (false, Fate::Good) if card.listens() => {
                    card.heard();
                    if let Some(from) = first {
                        self.deliver(end, from, station, frame);
                    }
                }
                (false, Fate::Spoilt | Fate::Collision) if card.listens() => card.heard_error(),
                (false, _) => {}
            }
            if self.cards[station.index()].state() != before {
                self.changed(end, station);
            }
        }
    }

    /// Gives a frame to one receiver, as the disturbances will have it.
    fn deliver(&mut self, at: MonotonicTime, from: Station, to: Station, frame: Frame) {
        let fate = self.disturbances.reception(from, to, &frame);
        let card = &mut self.cards[to.index()];
        if fate.copies == 0 {
            card.statistics.lost += 1;
        }
        for _ in 0..fate.copies {
            if fate.delay == DurationNs::ZERO && card.has_nothing_late() {
                card.statistics.received += 1;
                self.out.push_back(Output::Received { at, to, from, frame });
            } else {
                card.delay(Late { at: at + fate.delay, from, frame });
            }
        }
    }

    /// Tells of a new error state.
    fn changed(&mut self, at: MonotonicTime, station: Station) {
        let state = self.cards[station.index()].state();
        if state == State::BusOff {
            let card = &mut self.cards[station.index()];
            card.clear();
            card.back_at = self.restart.map(|after| at + after + self.rate.time(RECOVERY_BITS));
        }
        self.out.push_back(Output::State { at, station, state });
    }
}

/// Order of frames at arbitration, lowest first: the bits from the identifier on, as far as they decide. A data frame wins
/// against a remote frame with its identifier, 11 bits against 29 that begin with the same ones.
fn precedence(frame: &Frame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        Id::Standard(id) => u32::from(id) << 21 | remote << 20,
        Id::Extended(id) => (id >> 18) << 21 | 0b11 << 19 | (id & 0x3_FFFF) << 1 | remote,
    }
}
