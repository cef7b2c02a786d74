//! The ring in operation: where it is open, and how it is closed again.
//!
//! The slaves themselves turn telegrams round where a link is lost, within the cycle. The master sees from S-DEV
//! which ones do, and so which cable is open; it takes each slave's data from the telegram that has it. It closes
//! the ring when both ends of the gap see each other's telegrams and nothing but a cable lies between them. With a
//! lost slave in between it stays open: that one would pass the telegrams on as a switch does, and it can be
//! brought in only at the end of a line.

use arrayvec::ArrayVec;

use super::config::{MasterConfig, Ports};
use super::event::{End, Event, Port, SlaveId};
use super::journal::Journal;
use super::scan::Survey;
use super::stations::Stations;
use super::topology::{Closing, ClosingEvent, Route, Seen, Topology, Watch};
use crate::wire::device_control::Topology as Loop;
use crate::wire::device_status::InactivePort;
use crate::wire::header::Channel;

/// Cycles in which a slave has to follow a topology command.
pub(super) const COMMAND_CYCLES: u16 = 12;
/// Cycles before a refused closing is tried again.
const REFUSED_CYCLES: u16 = 1000;
/// Slaves that are commanded at the same time: both ends of a gap.
const ENDS_MAX: usize = 2;

/// What the master knows of the way telegrams take.
#[derive(Debug)]
pub(super) struct Redundancy {
    ports: Ports,
    watch: Watch,
    /// Slaves from port 1 to port 2, by their index.
    order: Vec<u16>,
    /// Cables from port 1 to port 2 that are open; one more than there are slaves.
    open: Vec<bool>,
    closing: Closing,
    /// Cycles in the present state of the closing.
    cycles: u16,
    /// Cycles in a row in which a slave was not seen while the ring is being closed.
    blind: u16,
    /// The ends that are commanded.
    ends: ArrayVec<usize, ENDS_MAX>,
}

impl Redundancy {
    /// Storage for `slaves` slaves.
    pub fn new(ports: Ports, slaves: usize) -> Redundancy {
        let topology = match ports {
            Ports::One => Topology::LineOne,
            Ports::Two => Topology::LineTwo,
            Ports::Both => Topology::Absent,
        };
        Redundancy {
            ports,
            watch: Watch::new(topology),
            order: Vec::with_capacity(slaves),
            open: Vec::with_capacity(slaves + 1),
            closing: Closing::Idle,
            cycles: 0,
            blind: 0,
            ends: ArrayVec::new(),
        }
    }

    /// CP0 begins: with two ports anything may come back.
    pub fn start(&mut self) {
        if !self.is_fixed() {
            self.watch = Watch::new(Topology::Absent);
        }
    }

    /// With one port there is nothing but a line.
    pub fn is_fixed(&self) -> bool {
        self.ports != Ports::Both
    }

    pub fn topology(&self) -> Topology {
        self.watch.topology
    }

    /// Routes on which telegrams can come in at all.
    pub fn possible_routes(&self) -> &'static [Route] {
        match self.ports {
            Ports::One | Ports::Two => self.watch.topology.routes(),
            Ports::Both => &Route::ALL,
        }
    }

    /// Whether telegrams can come in on this route; `changing` while stations are being commanded.
    pub fn admits(&self, route: Route, changing: bool) -> bool {
        self.watch.topology.admits(route, changing || self.closing != Closing::Idle)
    }

    /// The index of the station at a position from port 1 on.
    pub fn at(&self, position: usize) -> Option<usize> {
        self.order.get(position).copied().map(usize::from)
    }

    /// The position next to another one, or to the port, on the way of this channel's telegrams. None behind an open cable.
    pub fn neighbour(&self, channel: Channel, position: Option<usize>) -> Option<usize> {
        let (next, cable) = match (channel, position) {
            (Channel::Primary, None) => (0, 0),
            (Channel::Primary, Some(position)) => (position + 1, position + 1),
            (Channel::Secondary, None) => (self.order.len().checked_sub(1)?, self.order.len()),
            (Channel::Secondary, Some(position)) => (position.checked_sub(1)?, position),
        };
        let whole = self.open.get(cable).is_some_and(|open| !open);
        (whole && next < self.order.len()).then_some(next)
    }

    /// A cable is open of which nobody is told by the slaves at its ends.
    pub fn note_open(&mut self, cable: usize) {
        if let Some(open) = self.open.get_mut(cable) {
            *open = true;
        }
    }

    /// What spoke for closing the ring counts no more.
    pub fn leave_open(&mut self) {
        self.closing = Closing::Idle;
    }

    /// The cables make a ring, or are being made one: C-DEV bit 11.
    pub fn is_closed(&self) -> bool {
        self.watch.topology.is_ring() || matches!(self.closing, Closing::Commanded | Closing::Restoring)
    }

    /// Puts a slave that has come in behind the end of a line: on the port 2 side of `low`, or on the port 1 side of
    /// `high`. Without either it is alone on its port.
    pub fn insert(&mut self, index: usize, behind: Option<usize>, channel: Channel) {
        if let Some(old) = self.position(index) {
            self.order.remove(old);
            let above = old + 1 < self.open.len() && self.open.remove(old + 1);
            if let Some(below) = self.open.get_mut(old) {
                *below |= above;
            }
        }
        let at = match (behind.and_then(|end| self.position(end)), channel) {
            (Some(end), Channel::Primary) => end + 1,
            (Some(end), Channel::Secondary) => end,
            (None, Channel::Primary) => 0,
            (None, Channel::Secondary) => self.order.len(),
        };
        // As many places as there are stations were set aside.
        if self.order.len() < self.order.capacity() && self.open.len() < self.open.capacity() {
            self.order.insert(at, SlaveId::from_index(index).0);
            // The cable to the end is whole; behind the new slave nothing is known to be there.
            let outer = self.open.get(at).copied().unwrap_or(true);
            let (below, above) = match channel {
                Channel::Primary => (false, outer),
                Channel::Secondary => (outer, false),
            };
            if let Some(cable) = self.open.get_mut(at) {
                *cable = below;
            }
            self.open.insert((at + 1).min(self.open.len()), above);
        }
    }

    /// The neighbour of a slave on the far side of its line.
    pub fn next_to(&self, index: usize, channel: Channel) -> Option<usize> {
        let at = self.position(index)?;
        let next = match channel {
            Channel::Primary => self.order.get(at + 1),
            Channel::Secondary => at.checked_sub(1).and_then(|at| self.order.get(at)),
        };
        next.map(|&index| usize::from(index))
    }

    /// No commands to close the ring are under way.
    pub fn is_at_ease(&self) -> bool {
        matches!(self.closing, Closing::Idle | Closing::Settling | Closing::Refused)
    }

    /// Where a station is in the line. As the scan numbers them, most are where their number says.
    pub fn position(&self, index: usize) -> Option<usize> {
        let is = |&other: &u16| usize::from(other) == index;
        if self.order.get(index).is_some_and(is) { Some(index) } else { self.order.iter().position(is) }
    }

    fn move_on(&mut self, event: ClosingEvent) -> bool {
        let next = self.closing.next(event);
        let moved = next != self.closing;
        if moved {
            self.closing = next;
            self.cycles = 0;
            self.blind = 0;
        }
        moved
    }

    /// Takes a cycle's routes; gives the topology when it is another one.
    pub fn see(&mut self, seen: Seen) -> Option<Topology> {
        self.watch.update(seen)
    }

    /// Takes the topology over from the scan.
    pub fn take_over(&mut self, survey: &Survey, stations: &Stations, journal: &mut Journal) {
        let (topology, from_one) = (survey.topology, usize::from(survey.from_one));
        self.order.clear();
        let numbered = (0..from_one).chain((from_one..stations.scanned).rev());
        self.order.extend(numbered.map(|index| SlaveId::from_index(index).0));
        self.open.clear();
        self.open.resize(stations.scanned + 1, false);
        let gap = match topology {
            Topology::LineOne => Some(stations.scanned),
            Topology::LineTwo => Some(0),
            Topology::BrokenRing => Some(from_one),
            _ => None,
        };
        if let Some(open) = gap.and_then(|gap| self.open.get_mut(gap)) {
            *open = true;
        }
        self.closing = Closing::Idle;
        if self.is_fixed() {
            return;
        }
        self.watch = Watch::new(topology);
        journal.emit(Event::Topology(topology));
        if let Some(gap) = gap.filter(|_| topology == Topology::BrokenRing) {
            let (low, high) = self.cable(gap, stations);
            journal.emit(Event::CableOpen { low, high });
        }
    }

    /// The ends of a cable by its position.
    pub fn cable(&self, cable: usize, stations: &Stations) -> (End, End) {
        let slave = |position: usize| {
            let index = usize::from(*self.order.get(position)?);
            let address = stations.get(index)?.address;
            Some(End::Slave { slave: SlaveId::from_index(index), address })
        };
        let low = cable.checked_sub(1).and_then(slave).unwrap_or(End::Master(Port::One));
        (low, slave(cable).unwrap_or(End::Master(Port::Two)))
    }

    /// A slave that has turned the telegrams round has no link on its other side.
    pub fn find_open_cables(&mut self, stations: &Stations, journal: &mut Journal) {
        for place in 0..stations.turning.len() {
            let index = usize::from(stations.turning[place]);
            let position = self.position(index);
            let Some((position, status)) = position.zip(stations.valid_status(index)) else { continue };
            let cable = match status.topology() {
                Loop::LoopbackForwardPrimary => position + 1,
                Loop::LoopbackForwardSecondary => position,
                Loop::FastForward | Loop::StoreAndForward => continue,
            };
            let newly = self.open.get_mut(cable).is_some_and(|open| !core::mem::replace(open, true));
            if newly {
                let (low, high) = self.cable(cable, stations);
                journal.emit(Event::CableOpen { low, high });
            }
        }
    }

    /// The slaves that turn telegrams round, if closing the ring is a matter of commanding them.
    fn closable_ends(&self, stations: &Stations) -> Option<ArrayVec<usize, ENDS_MAX>> {
        let (mut low, mut high) = (None, None);
        for &index in &stations.turning {
            let station = &stations[usize::from(index)];
            let position = self.position(usize::from(index));
            let Some((position, status)) = position.zip(stations.valid_status(usize::from(index))) else {
                continue;
            };
            let (end, wanted) = match status.topology() {
                Loop::LoopbackForwardPrimary => (&mut low, InactivePort::SecondaryTelegram),
                Loop::LoopbackForwardSecondary => (&mut high, InactivePort::PrimaryTelegram),
                Loop::FastForward | Loop::StoreAndForward => continue,
            };
            let sees = status.inactive_port() == wanted && station.is_active();
            if !sees || end.replace(position).is_some() {
                return None;
            }
        }
        let last = self.order.len().checked_sub(1);
        let joined = match (self.topology(), low, high) {
            (Topology::BrokenRing, Some(low), Some(high)) => low + 1 == high,
            (Topology::LineOne, Some(low), None) => Some(low) == last,
            (Topology::LineTwo, None, Some(high)) => high == 0,
            (Topology::DefectRing { .. }, Some(_), None) | (Topology::DefectRing { .. }, None, Some(_)) => {
                true
            }
            _ => false,
        };
        let station = |position: usize| self.order.get(position).copied().map(usize::from);
        joined.then(|| [low, high].into_iter().flatten().filter_map(station).collect())
    }

    /// One cycle of closing the ring; `true` in the one in which it is closed.
    pub fn close_ring(
        &mut self,
        stations: &mut Stations,
        config: &MasterConfig,
        journal: &mut Journal,
    ) -> bool {
        self.cycles = self.cycles.saturating_add(1);
        let Some(event) = self.judge_closing(stations, config) else { return false };
        let before = self.closing;
        let culprit = self.ends.iter().copied().find(|&end| !stations[end].follows_command());
        if !self.move_on(event) {
            return false;
        }
        match (before, self.closing) {
            (Closing::Settling, Closing::Commanded) => {
                for &end in &self.ends {
                    stations[end].command_topology(Loop::FastForward);
                }
            }
            (Closing::Commanded, Closing::Idle) => {
                self.open.fill(false);
                journal.emit(Event::RingClosed);
                return true;
            }
            (Closing::Commanded, Closing::Restoring) => {
                if let Some(index) = culprit.or(self.ends.last().copied()) {
                    let (slave, address) = (SlaveId::from_index(index), stations[index].address);
                    journal.emit(Event::RingNotClosed { slave, address });
                }
                self.restore_loopback(stations);
            }
            _ => {}
        }
        false
    }

    /// What this cycle means to the closing.
    fn judge_closing(&mut self, stations: &Stations, config: &MasterConfig) -> Option<ClosingEvent> {
        let wait = match self.closing {
            Closing::Commanded => {
                let done = self.follow(stations) && self.topology() == Topology::Ring;
                return Some(if done { ClosingEvent::Done } else { self.judge_command(stations, config) });
            }
            Closing::Restoring if self.follow(stations) => return Some(ClosingEvent::Done),
            Closing::Restoring => return (self.cycles >= COMMAND_CYCLES).then_some(ClosingEvent::Failed),
            Closing::Settling => config.close_cycles,
            Closing::Refused => REFUSED_CYCLES,
            Closing::Idle => u16::MAX,
        };
        let Some(ends) = self.closable_ends(stations) else { return Some(ClosingEvent::Open) };
        self.ends = ends;
        Some(if self.cycles >= wait { ClosingEvent::Elapsed } else { ClosingEvent::Closable })
    }

    fn follow(&self, stations: &Stations) -> bool {
        self.ends.iter().all(|&end| stations[end].follows_command())
    }

    /// While one end has followed and the other has not, the slaves of a line are not seen. That must not last until
    /// they count as lost.
    fn judge_command(&mut self, stations: &Stations, config: &MasterConfig) -> ClosingEvent {
        let unseen = stations.any_unseen();
        self.blind = if unseen { self.blind + 1 } else { 0 };
        if self.blind >= config.slave_valid_misses.max(1) || self.cycles >= COMMAND_CYCLES {
            ClosingEvent::Failed
        } else {
            ClosingEvent::Closable
        }
    }

    /// Commands the ends back to what they were before.
    fn restore_loopback(&self, stations: &mut Stations) {
        for &end in &self.ends {
            let position = self.position(end);
            let cable_above =
                position.is_some_and(|position| self.open.get(position + 1).copied().unwrap_or(false));
            let topology =
                if cable_above { Loop::LoopbackForwardPrimary } else { Loop::LoopbackForwardSecondary };
            stations[end].command_topology(topology);
        }
    }
}
