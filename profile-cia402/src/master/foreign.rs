//! Another master on the bus: what is heard of it, and what follows.
//!
//! A device acts at any SYNC, obeys any NMT and takes any RPDO, regardless of the sender. So a master listens before its first frame, and after each
//! return of the bus, and is silent as long as it hears somebody:
//!
//! ```text
//!           start, bus on            silent for so long
//! Ours <------------------ Listening -----------------> Ours
//!  |                          | a master's frame          ^
//!  | give_way                 v                           |
//!  +-----------------------> Occupied --------------------+
//!                              silent for so long
//! ```
//!
//! What counts are SYNC (of a network with SYNC), NMT, RPDOs of the devices in the list, and a heartbeat with the master's own
//! node-id. In operation each of these is told once per kind ([`Event::SecondMaster`]). A tool sends one now and then, and a device that
//! obeys it leaves operation, which stops its axes; but a station that sends SYNC twice within [`LISTEN`] is a master: the application stops its
//! axes and calls [`Master::give_way`].

use core::fmt;

use super::*;
use crate::wire::error_control::Heartbeat;

/// How long the bus has to be silent before the first frame: more than the longest period of SYNC in use, a second.
pub const LISTEN: DurationNs = DurationNs::from_millis(1_100);

/// What the wait behind another master is longer in steps of, by the low digits of the time: two masters that began in the same moment and
/// have heard each other do not begin in the same moment again.
const SPREAD: DurationNs = DurationNs::from_millis(50);

/// SYNCs by which the period of another master is known well enough to be said.
const ESTIMATE_COUNT: u32 = 10;

/// What is known of another master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherMaster {
    /// The kind of its last frame.
    pub function: Option<Function>,
    /// Its identifier: no frame of a master says who has sent it.
    pub id: Id,
    /// Time from one of its SYNCs to the next on average, once there were two.
    pub period: Option<DurationNs>,
}

impl fmt::Display for OtherMaster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.function {
            Some(Function::Sync) => "SYNC, ",
            Some(Function::Nmt) => "NMT, ",
            Some(Function::ErrorControl(_)) => "a heartbeat with this master's node-id, ",
            _ => "an RPDO, ",
        };
        write!(f, "another master is on this bus: {what}identifier {}", self.id)?;
        match self.period {
            Some(period) => write!(f, ", a SYNC every {} us or so", period.as_nanos() / 1_000),
            None => Ok(()),
        }
    }
}

/// Whose the bus is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bus {
    /// Nobody else was heard.
    Ours,
    /// Nothing is sent until then.
    Listening(MonotonicTime),
    /// Somebody else was heard; nothing is sent until he has been silent until then.
    Occupied(MonotonicTime),
}

/// What was heard of somebody else.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foreign {
    heard: Option<OtherMaster>,
    since: MonotonicTime,
    first_sync: Option<MonotonicTime>,
    last_sync: MonotonicTime,
    syncs: u32,
    told: bool,
}

impl Foreign {
    fn take(&mut self, now: MonotonicTime, id: Id, function: Option<Function>) {
        if function == Some(Function::Sync) {
            if now.since(self.last_sync) > LISTEN {
                (self.first_sync, self.syncs) = (None, 0);
            }
            self.first_sync.get_or_insert(now);
            self.last_sync = now;
            self.syncs = self.syncs.saturating_add(1);
        }
        if self.heard.is_none() {
            self.since = now;
        }
        self.heard = Some(OtherMaster { function, id, period: self.period() });
    }

    fn period(&self) -> Option<DurationNs> {
        let span = self.last_sync.since(self.first_sync?).as_nanos();
        (self.syncs > 1 && span > 0).then(|| DurationNs(span / i64::from(self.syncs - 1)))
    }
}

impl Master {
    /// Whether this master has the bus: it listens no longer and waits for nobody.
    #[must_use]
    pub fn leads(&self) -> bool {
        self.running && self.bus == Bus::Ours
    }

    /// Another master that sends while this one does, or for which this one waits. `None` when nobody is heard.
    #[must_use]
    pub fn other_master(&self) -> Option<OtherMaster> {
        self.foreign.heard.filter(|_| self.foreign.told || matches!(self.bus, Bus::Occupied(_)))
    }

    /// Leaves the bus to another master: nothing is sent any more, until he has been silent for a while. Nothing when nobody
    /// was heard.
    pub fn give_way(&mut self, now: MonotonicTime) {
        if !self.leads() || self.other_master().is_none() {
            return;
        }
        for index in 0..self.stations.len() {
            self.advance(now, index, BootEvent::Stop);
            let station = &mut self.stations[index];
            station.nmt = None;
            station.rpdos.iter_mut().for_each(|end| (end.committed, end.due) = (false, false));
        }
        (self.nmt_all, self.time, self.sync_due, self.complete) = (None, None, false, false);
        self.occupy(now);
        self.emit(Event::GaveWay);
    }

    fn occupy(&mut self, now: MonotonicTime) {
        let draw = i64::try_from((now.0 / 1_000) & 0xF).unwrap_or_default();
        self.bus = Bus::Occupied(now + LISTEN + SPREAD * draw);
    }

    /// Begins to listen, before anything is sent.
    pub(super) fn listen(&mut self, now: MonotonicTime) {
        self.foreign = Foreign::default();
        self.second_master = 0;
        if self.config.listens {
            self.bus = Bus::Listening(now + LISTEN);
        } else {
            self.lead(now);
        }
    }

    /// Takes the bus.
    fn lead(&mut self, now: MonotonicTime) {
        self.bus = Bus::Ours;
        self.foreign = Foreign::default();
        self.begin(now);
        if self.config.heartbeat.is_some() && self.heartbeat.is_none() {
            self.heartbeat = Some(NmtState::BOOT_UP);
            self.next_heartbeat = now;
        }
    }

    /// Whether it may send; takes the bus when the time for that has come.
    pub(super) fn may_send(&mut self, now: MonotonicTime) -> bool {
        match self.bus {
            Bus::Listening(until) | Bus::Occupied(until) if self.running && now >= until => {
                if matches!(self.bus, Bus::Occupied(_)) {
                    // Who has said so little that it was not told of yet.
                    self.tell_other();
                }
                self.lead(now);
                true
            }
            Bus::Listening(_) | Bus::Occupied(_) => !self.running,
            Bus::Ours => true,
        }
    }

    /// When the wait for silence is over.
    pub(super) fn listens_until(&self) -> Option<MonotonicTime> {
        match self.bus {
            Bus::Listening(until) | Bus::Occupied(until) => Some(until),
            Bus::Ours => None,
        }
    }

    /// Takes a frame while nothing is sent.
    pub(super) fn overhear(&mut self, now: MonotonicTime, frame: &Frame) -> Refusal {
        let id = frame.id();
        let function = Function::of(id);
        let own = self.config.heartbeat.map(|own| own.node);
        let masters = match function {
            _ if frame.is_remote() => false,
            _ if self.is_rpdo(id) => true,
            Some(Function::Nmt) => true,
            Some(Function::Sync) => self.config.sync.is_some(),
            Some(Function::ErrorControl(node)) => own == Some(node) && Heartbeat::parse(frame.data()).is_ok(),
            _ => false,
        };
        if !masters {
            return Refusal::NotOurs;
        }
        self.foreign.take(now, id, function);
        self.occupy(now);
        if self.foreign.syncs >= ESTIMATE_COUNT || now.since(self.foreign.since) >= LISTEN {
            self.tell_other();
        }
        Refusal::SecondMaster
    }

    /// Somebody else sends SYNC in operation.
    pub(super) fn foreign_sync(&mut self, now: MonotonicTime, id: Id) {
        self.foreign.take(now, id, Some(Function::Sync));
        if self.foreign.syncs > 1 {
            self.tell_other();
        }
    }

    fn tell_other(&mut self) {
        if let Some(other) = self.foreign.heard.filter(|_| !core::mem::replace(&mut self.foreign.told, true))
        {
            self.emit(Event::OtherMaster(other));
        }
    }
}
