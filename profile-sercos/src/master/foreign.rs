//! Another master on the wire: what is heard of it, and what follows.
//!
//! Slaves obey any MST, regardless of the sender: two masters wreck each other's bus. So a master [listens](super::phase::State::Listen) before its
//! first telegram, and is silent as long as it hears somebody. Who comes later is heard as well: below CP4 the master gives way at
//! once, because no axis has torque there. In CP4 the application is told ([`Event::OtherMaster`](super::event::Event::OtherMaster)), stops its axes while they are still led,
//! and then calls [`Master::give_way`](super::Master::give_way).
//!
//! A single MST of somebody else in operation is counted and nothing more; the second one within [`LISTEN`] is of a master. One that has
//! this master's own hardware address is known in CP4 by a phase that was not sent for that long.

use core::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::event::{Port, Refusal};
use super::phase::State;
use crate::wire::header::{Header, MacAddress, Phase, TelegramType};

/// How long the wire has to be silent before the first telegram. A master in a phase sends in every cycle of at most 65 ms; whoever
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
    /// Who sends them.
    heard: Option<OtherMaster>,
    reported: bool,
    /// How often the wire was found occupied since it was used.
    tries: u32,
}

impl Foreign {
    /// Takes a frame of another master.
    pub fn hear(&mut self, now: MonotonicTime, port: Port, header: &Header) {
        if header.telegram.is_mst() {
            self.count(now, port, header.telegram);
        }
        let (source, phase) = (header.source, header.phase.phase());
        self.heard = Some(OtherMaster { source, phase, port, cycle: self.cycle() });
    }

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

    /// A master, not just a stray MST.
    pub fn is_confirmed(&self) -> bool {
        self.count > 1
    }

    /// Its cycle time is known well enough.
    pub fn is_estimated(&self) -> bool {
        self.count >= ESTIMATE_COUNT
    }

    /// What was heard, once.
    pub fn report(&mut self) -> Option<OtherMaster> {
        self.heard.filter(|_| !core::mem::replace(&mut self.reported, true))
    }

    /// Another master that sends while this one does, or for which this one waits.
    pub fn other(&self, state: State) -> Option<OtherMaster> {
        self.heard.filter(|_| self.reported || state == State::Occupied)
    }

    /// The wire is left to the other master once more.
    pub fn retry(&mut self) {
        self.tries = self.tries.wrapping_add(1);
    }

    /// The other master has been silent for long enough.
    pub fn forget(&mut self) {
        *self = Foreign { tries: self.tries, ..Foreign::default() };
    }

    /// How long another master has to be silent.
    pub fn patience(&self, mac: &MacAddress) -> DurationNs {
        let draw = crc32fast::hash(mac) >> (4 * (self.tries % 8)) & 0xF;
        LISTEN + SPREAD * i64::from(draw)
    }
}

/// Whether a frame that was refused for `reason` is another master's. `age` is the time in this state.
pub(super) fn is_alien(header: &Header, reason: Refusal, state: State, age: DurationNs) -> bool {
    match reason {
        _ if state == State::Nrt => false,
        Refusal::Foreign => true,
        // Nothing was sent: it is not its own.
        Refusal::Silence => state.listens(),
        Refusal::Phase => {
            let other_phase = header.phase.phase() != Phase::CP4;
            header.telegram.is_mst() && state == State::Cp4 && other_phase && age > LISTEN
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::header::{Channel, Kind, PhaseField};

    fn mst(channel: Channel) -> Header {
        let telegram = TelegramType::new(channel, Kind::Mdt, 0);
        Header { source: [2, 0, 0, 0, 0, 9], telegram, phase: PhaseField::new(false, 0, Phase::CP2) }
    }

    #[test]
    fn cycle_of_the_other_master_is_counted_on_one_way() {
        let mut foreign = Foreign::default();
        for cycle in 0..3u64 {
            let at = MonotonicTime(1_000_000 * (300 + cycle));
            foreign.hear(at, Port::One, &mst(Channel::Primary));
            foreign.hear(at, Port::Two, &mst(Channel::Secondary));
        }
        assert!(foreign.is_confirmed() && !foreign.is_estimated());
        let other = foreign.report().unwrap();
        assert_eq!((other.phase, other.cycle), (Phase::CP2, Some(DurationNs(1_000_000))));
        assert_eq!(foreign.report(), None);
        assert_eq!(foreign.other(State::Cp4), Some(other));
        // After a silence a single one is a stray again.
        foreign.hear(MonotonicTime(900_000_000), Port::Two, &mst(Channel::Secondary));
        assert!(!foreign.is_confirmed());
    }

    #[test]
    fn another_try_waits_for_another_time() {
        let (mut foreign, mac) = (Foreign::default(), [2, 0, 0, 0, 0, 1]);
        let waits: Vec<_> = (0..8)
            .map(|_| {
                let wait = foreign.patience(&mac);
                foreign.retry();
                (wait - LISTEN).as_nanos() / SPREAD.as_nanos()
            })
            .collect();
        let draw = i64::from(crc32fast::hash(&mac));
        let wanted: Vec<_> = (0..8).map(|nibble| draw >> (4 * nibble) & 0xF).collect();
        assert_eq!(waits, wanted);
        foreign.forget();
        assert_eq!(foreign.patience(&mac), LISTEN + SPREAD * (draw & 0xF));
    }
}
