//! Another master on the wire: what is heard of it, and what follows.
//!
//! Slaves do as any MST says, whoever has sent it: two masters wreck each other's bus. So a master [listens](State::Listen) before its
//! first telegram, and is silent as long as it hears somebody. Who comes later is heard as well: below CP4 the master gives way at
//! once, because no axis has torque there. In CP4 the application is told ([`Event::OtherMaster`]), stops its axes while they are still led,
//! and then calls [`Master::give_way`].
//!
//! A single MST of somebody else in operation is counted and nothing more; the second one within [`LISTEN`] is of a master. One that has
//! this master's own hardware address is known in CP4 by a phase that was not sent for that long.

use core::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::Master;
use super::event::{Event, Port, Refusal};
use super::phase::{PhaseEvent, State};
use super::svc::request::SvcFailure;
use crate::wire::header::{Header, MacAddress, Phase, TelegramType};

/// How long the wire has to be silent before the first telegram. Whoever is in a phase sends in every cycle of at most 65 ms; whoever
/// is between two phases is silent for 120 ms. The rest is for hosts that are late.
pub const LISTEN: DurationNs = DurationNs::from_millis(200);

/// What the wait behind another master is longer in steps of, by a number drawn from the hardware address: two masters that began in
/// the same moment and have heard each other do not begin in the same moment again. Longer than the longest cycle.
const SPREAD: DurationNs = DurationNs::from_millis(70);

/// MSTs by which the cycle time of another master is known well enough to be said.
const ESTIMATE_COUNT: u32 = 10;

/// What is known of another master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherMaster {
    /// Source address of its telegrams.
    pub source: MacAddress,
    /// The phase of its last telegram.
    pub phase: Phase,
    /// The port at which it was heard.
    pub port: Port,
    /// Time from one of its MSTs to the next on average, once there were two.
    pub cycle: Option<DurationNs>,
}

impl fmt::Display for OtherMaster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e, g] = self.source;
        write!(
            f,
            "another master sends on this wire: {} from {a:02x}:{b:02x}:{c:02x}:{d:02x}:{e:02x}:{g:02x}",
            self.phase
        )?;
        if let Some(cycle) = self.cycle {
            write!(f, ", a cycle of about {} us", cycle.as_nanos() / 1_000)?;
        }
        write!(f, ", heard on {}", self.port)
    }
}

/// The MSTs of somebody else.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foreign {
    /// The first one on its way: where and which, and when.
    first: Option<(Port, TelegramType, MonotonicTime)>,
    last: MonotonicTime,
    count: u32,
    told: bool,
    /// How often the wire was found occupied since it was used.
    tries: u32,
}

impl Foreign {
    /// Counts an MST; copies on other ways are not counted again.
    fn count(&mut self, now: MonotonicTime, port: Port, telegram: TelegramType) {
        if now.since(self.last) > LISTEN {
            (self.first, self.count) = (None, 0);
        }
        let (first_port, first_telegram, _) = *self.first.get_or_insert((port, telegram, now));
        if (first_port, first_telegram) == (port, telegram) {
            self.count = self.count.saturating_add(1);
            self.last = now;
        }
    }

    fn cycle(&self) -> Option<DurationNs> {
        let (_, _, first) = self.first?;
        let span = self.last.since(first).as_nanos();
        (self.count > 1 && span > 0).then(|| DurationNs(span / i64::from(self.count - 1)))
    }
}

impl Master {
    /// Takes a frame that is not one of those that were sent in this cycle. Returns why it is refused.
    pub(super) fn hear(&mut self, now: MonotonicTime, port: Port, frame: &[u8], reason: Refusal) -> Refusal {
        let Ok(header) = Header::parse(frame) else { return reason };
        let listens = self.state.listens();
        let alien = match reason {
            Refusal::Foreign => true,
            // Nothing was sent: it is not its own.
            Refusal::Silence => listens,
            Refusal::Phase => {
                header.telegram.is_mst()
                    && self.state == State::Cp4
                    && header.phase.phase() != Phase::CP4
                    && now.since(self.since) > LISTEN
            }
            _ => false,
        };
        if !alien || self.state == State::Nrt {
            return reason;
        }
        if header.telegram.is_mst() {
            self.foreign.count(now, port, header.telegram);
        }
        let other = OtherMaster {
            source: header.source,
            phase: header.phase.phase(),
            port,
            cycle: self.foreign.cycle(),
        };
        self.heard = Some(other);
        let confirmed = self.foreign.count > 1;
        if listens {
            self.advance(now, PhaseEvent::Foreign);
            self.next_cycle = now + self.patience();
            if self.foreign.count >= ESTIMATE_COUNT {
                self.tell_other();
            }
        } else if confirmed {
            self.tell_other();
            if self.state != State::Cp4 {
                self.advance(now, PhaseEvent::Foreign);
            }
        }
        Refusal::Foreign
    }

    /// Says once what was heard.
    fn tell_other(&mut self) {
        if let Some(other) = self.heard.filter(|_| !core::mem::replace(&mut self.foreign.told, true)) {
            self.emit(Event::OtherMaster(other));
        }
    }

    /// Another master that sends while this one does, or for which this one waits. `None` when nobody is heard.
    #[must_use]
    pub fn other_master(&self) -> Option<OtherMaster> {
        self.heard.filter(|_| self.foreign.told || self.state == State::Occupied)
    }

    /// Leaves the wire to another master: no telegrams any more, not even those towards CP0, until he has been silent for a
    /// while. Nothing when nobody was heard.
    pub fn give_way(&mut self, now: MonotonicTime) {
        if self.other_master().is_some() {
            self.advance(now, PhaseEvent::Foreign);
        }
    }

    /// How long another master has to be silent.
    fn patience(&self) -> DurationNs {
        let draw = crc32fast::hash(&self.config.mac) >> (4 * (self.foreign.tries % 8)) & 0xF;
        LISTEN + SPREAD * i64::from(draw)
    }

    pub(super) fn decide_listen(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if now < self.next_cycle {
            return None;
        }
        if self.state == State::Occupied {
            // One that has said so little that it was not told of yet.
            self.tell_other();
        }
        self.heard = None;
        self.foreign = Foreign { tries: self.foreign.tries, ..Foreign::default() };
        Some(PhaseEvent::Elapsed)
    }

    pub(super) fn enter_listen(&mut self, now: MonotonicTime) {
        self.frames.silence();
        self.evaluated = true;
        (self.foreign, self.heard) = (Foreign::default(), None);
        self.next_cycle = now + LISTEN;
    }

    pub(super) fn enter_occupied(&mut self, now: MonotonicTime, last: State) {
        self.frames.silence();
        self.evaluated = true;
        self.foreign.tries = self.foreign.tries.wrapping_add(1);
        self.next_cycle = now + self.patience();
        if last == State::Listen {
            return;
        }
        for station in &mut self.stations[..self.found] {
            station.channel.abort(SvcFailure::PhaseLeft);
        }
        self.open_channels(false);
        self.emit(Event::GaveWay);
    }
}
