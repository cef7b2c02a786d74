//! Slaves that another master speaks to.
//!
//! A network may have several masters, each with slaves of its own, and a slave refuses to be allocated twice. But its poll connection takes a
//! poll from anybody: the identifier names the slave only. So this master listens for polls of its slaves, from the first frame that
//! it hears, the two seconds of the duplicate MAC ID check included:
//!
//! | the slave | a poll of somebody else |
//! |---|---|
//! | waits to be taken | is not asked before it has been left alone for [`LISTEN`] |
//! | is being taken | is left to the other one |
//! | is exchanged with | the second one within [`LISTEN`] is told; the application stops the axis and calls [`Master::give_way`] |

use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::wire::allocation::{ALLOCATE, CLASS_DEVICENET};
use super::super::wire::{Allocate, AllocationChoice, Identifier, MacId};
use super::event::{Event, LossReason};
use super::station::Phase;
use super::{Master, Station};

/// How long nobody else may have polled a slave that is to be taken: more than the packet rates in use, up to a second.
pub const LISTEN: DurationNs = DurationNs::from_millis(1_100);

/// Where the service is in an unconnected request, and the data of an allocation in message body format 8/8.
const SERVICE: usize = 1;
const DATA: usize = 4;

/// What was heard of another master of a slave.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foreign {
    /// Who has asked for it, where that was heard.
    master: Option<MacId>,
    last: Option<MonotonicTime>,
    count: u32,
    told: bool,
}

impl Foreign {
    fn poll(&mut self, now: MonotonicTime) {
        if self.last.is_none_or(|last| now.since(last) > LISTEN) {
            (self.count, self.told) = (0, false);
        }
        self.count = self.count.saturating_add(1);
        self.last = Some(now);
    }
}

impl Station {
    /// Until when it is left alone.
    pub(super) fn occupied_until(&self) -> MonotonicTime {
        self.foreign.last.map_or(MonotonicTime::ZERO, |last| last + LISTEN)
    }
}

impl Master {
    /// Looks at what is meant for a slave and comes from somebody else.
    pub(super) fn overhear(&mut self, now: MonotonicTime, identifier: Identifier, data: &[u8]) {
        let (slave, polled) = match identifier {
            Identifier::PollCommand(slave) => (slave, true),
            Identifier::UnconnectedRequest(slave) => (slave, false),
            _ => return,
        };
        let Some(place) = self.place(slave) else { return };
        let station = &mut self.stations[place];
        if !polled {
            let allocates = data.get(SERVICE..DATA) == Some(&[ALLOCATE, CLASS_DEVICENET, 1]);
            let asked = data.get(DATA..).filter(|_| allocates).and_then(|data| Allocate::parse(data).ok());
            // Who takes the explicit connection only is a tool.
            let asked = asked.filter(|asked| !AllocationChoice::EXPLICIT.contains(asked.choice));
            station.foreign.master = asked.map(|asked| asked.allocator).or(station.foreign.master);
            return;
        }
        station.foreign.poll(now);
        match station.phase {
            Phase::Waiting => self.tell_other(place),
            Phase::Exchange if station.foreign.count > 1 => self.tell_other(place),
            Phase::Exchange => {}
            _ => {
                self.tell_other(place);
                self.lose(now, place, LossReason::AnotherMaster);
            }
        }
    }

    fn tell_other(&mut self, place: usize) {
        let station = &mut self.stations[place];
        let (slave, master) = (station.config.mac, station.foreign.master);
        if !core::mem::replace(&mut station.foreign.told, true) {
            self.tell(Event::OtherMaster { slave, master });
        }
    }

    /// Whether another master polls a slave that this one exchanges with, and that was told.
    #[must_use]
    pub fn has_other_master(&self, slave: MacId) -> bool {
        self.station(slave).is_some_and(|station| station.phase == Phase::Exchange && station.foreign.told)
    }

    /// Leaves a slave to another master, without giving it back. It is asked for again when nobody has polled it for a while.
    /// Nothing when nobody else was heard.
    pub fn give_way(&mut self, now: MonotonicTime, slave: MacId) {
        if let Some(place) = self.place(slave).filter(|_| self.has_other_master(slave)) {
            self.lose(now, place, LossReason::AnotherMaster);
        }
    }
}
