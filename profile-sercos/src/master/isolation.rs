//! A station that hangs with its links up: found, and left out by loopback.
//!
//! Its neighbours have their links, so that nobody turns the telegrams round: they end at it, on both channels, and nothing comes
//! back at all. What the master sends still reaches every station in front of it, on either side. So the master has the
//! stations turn the telegrams round (loopback by C-DEV), one after the other from its own port on:
//!
//! ```text
//! port 1 === 1 === 2 === 3 = x = 4 === 5 === 6 === port 2
//!            P>                             <S    first: the stations next to the ports
//!            ok    P>                 <S    ok    then the next ones; the one before hears its own telegrams come back
//!                  ok    P>    <S     ok          and is commanded to fast forward
//! ```
//!
//! The station that turns the telegrams round hears its own ones on its inactive port as soon as the next one does so as
//! well. Only then it is commanded to fast forward: nobody who has been found is lost again, and the last one that was found is
//! where it has to be when the next one does not answer. What is behind it is left out until the next start, or comes in
//! by hot plug.
//!
//! A station is commanded by the telegrams of one channel only, until it has answered on it. Were it told by both, one
//! behind the break would hear of it from the other side, turn its back on the only telegrams it gets, and be lost.
//!
//! Cycles without any telegram may as well be the master's own fault, or over. When the first station found on a line hears
//! its own telegrams, or telegrams get from one port to the other, nothing is wrong any more, and those that turn telegrams round
//! are commanded to fast forward at once.

use super::event::{End, Event, Port, SlaveId};
use super::network::Network;
use super::redundancy::COMMAND_CYCLES;
use super::station::Station;
use super::topology::{Route, Topology};
use crate::wire::device_control::{DeviceControl, Topology as Loop};
use crate::wire::device_status::{DeviceStatus, InactivePort};
use crate::wire::header::{Channel, Kind};

/// Cycles in a row without a telegram, at least, before anything is done about it.
const SILENT_CYCLES_MIN: u16 = 2;

/// How far the search is from one port on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    /// Nothing is searched for on this side.
    #[default]
    Off,
    /// The next station is asked to turn the telegrams round.
    Asking,
    /// The station in front of the one found last is commanded to fast forward.
    Opening,
    /// Nothing is wrong behind the one that turns the telegrams round: it is commanded to fast forward.
    Passing,
    /// There is nobody else to ask.
    Done,
}

/// What a channel's telegrams reach from their port on. Stations by their position from port 1 on.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    stage: Stage,
    /// The one that turns the telegrams round.
    end: Option<usize>,
    /// The one that did so before.
    before: Option<usize>,
    /// The one that is asked to.
    asked: Option<usize>,
    /// Cycles in this stage.
    cycles: u16,
}

impl Side {
    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.cycles = 0;
    }

    const fn is_open(&self) -> bool {
        matches!(self.stage, Stage::Asking | Stage::Opening | Stage::Passing)
    }
}

/// The search for a station that hangs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Isolation {
    /// Cycles in a row without a telegram, by channel.
    silent: [u16; 2],
    sides: [Side; 2],
    /// Cycles since both ends were commanded to fast forward because they hear each other.
    resuming: Option<u16>,
    /// That was tried, in vain.
    resumed: bool,
}

impl Isolation {
    /// Stations are being commanded.
    pub fn is_busy(&self) -> bool {
        self.sides.iter().any(|side| side.stage != Stage::Off)
    }
}

/// The port from which the telegrams of this channel are sent.
const fn port_of(channel: Channel) -> Port {
    match channel {
        Channel::Primary => Port::One,
        Channel::Secondary => Port::Two,
    }
}

/// The route on which telegrams come back that were turned round.
const fn route_of(channel: Channel) -> Route {
    match channel {
        Channel::Primary => Route::PRIMARY_ONE,
        Channel::Secondary => Route::SECONDARY_TWO,
    }
}

/// The command that asks a station to turn the telegrams of this channel round.
fn asks(station: &Station, channel: Channel) -> DeviceControl {
    station
        .link
        .command
        .with_topology(Loop::loopback(channel))
        .symmetric_difference(DeviceControl::TOPOLOGY_CHANGE)
}

impl Isolation {
    /// One cycle of the search; `true` in the one in which it turns out that the ring is closed.
    pub fn step(&mut self, net: &mut Network) -> bool {
        for channel in Channel::ALL {
            let silent = &mut self.silent[channel.index()];
            let topology = net.redundancy.topology();
            let expected = match topology {
                Topology::Absent => false,
                Topology::Ring | Topology::DefectRing { .. } => true,
                _ => topology.routes().contains(&route_of(channel)),
            };
            // In a ring both are needed: where one of them comes back, no station swallows everything.
            let frames = &net.frames;
            let came = if topology.is_ring() {
                Route::ALL.iter().any(|&route| frames.came(route))
            } else {
                frames.came(route_of(channel))
            };
            *silent = if expected && !came { silent.saturating_add(1) } else { 0 };
            // Once for each silence: whom nobody answers is not asked again and again.
            if *silent == SILENT_CYCLES_MIN.max(net.config.slave_valid_misses / 2) {
                self.begin_search(net, channel);
            }
        }
        if !self.is_busy() {
            return false;
        }
        if let Some(cycles) = self.resuming {
            return self.resume(net, cycles + 1);
        }
        for channel in Channel::ALL {
            self.search(net, channel);
        }
        if self.is_whole(net) {
            self.begin_resuming(net);
        } else if !self.sides.iter().any(Side::is_open) {
            self.end_search(net);
        }
        false
    }

    fn begin_search(&mut self, net: &mut Network, channel: Channel) {
        if self.sides[channel.index()].stage != Stage::Off {
            return;
        }
        net.redundancy.leave_open();
        let asked = self.next_addressed(net, channel, None);
        self.sides[channel.index()] = Side { stage: Stage::Asking, asked, ..Side::default() };
    }

    /// The next station behind `position`, or from the port on, that hears commands. A cable that is known to be open ends the
    /// line, and so does what has been reached from the other port.
    fn next_addressed(&self, net: &Network, channel: Channel, position: Option<usize>) -> Option<usize> {
        let stop = self.sides[channel.other().index()].end;
        let mut position = position;
        loop {
            let next = net.redundancy.neighbour(channel, position)?;
            if Some(next) == stop {
                return None;
            }
            if net.station_at(next)?.1.is_addressed(net.stations.phase) {
                return Some(next);
            }
            position = Some(next);
        }
    }

    /// What a station says that turns the telegrams of this channel round, seen on their own way back.
    fn turns(
        &self,
        net: &Network,
        channel: Channel,
        position: usize,
        command: DeviceControl,
    ) -> Option<DeviceStatus> {
        let (index, station) = net.station_at(position)?;
        let status = net.stations.valid_status(index)?;
        let acknowledged = status.contains(DeviceStatus::TOPOLOGY_CHANGE)
            == command.contains(DeviceControl::TOPOLOGY_CHANGE);
        let own = station.link.valid_routes & 1 << route_of(channel).index() != 0;
        (own && acknowledged && status.topology() == Loop::loopback(channel)).then_some(status)
    }

    /// The same of the station that turns this channel's telegrams round.
    fn end_status(&self, net: &Network, channel: Channel) -> Option<DeviceStatus> {
        let end = self.sides[channel.index()].end?;
        self.turns(net, channel, end, net.station_at(end)?.1.link.command)
    }

    /// The station that turns this channel's telegrams round hears those of channel `wanted` on its inactive port.
    fn hears(&self, net: &Network, channel: Channel, wanted: Channel) -> bool {
        self.end_status(net, channel)
            .is_some_and(|status| status.inactive_port() == InactivePort::hearing(wanted))
    }

    /// One cycle of the search on one side.
    fn search(&mut self, net: &mut Network, channel: Channel) {
        let at = channel.index();
        let mut side = self.sides[at];
        side.cycles = side.cycles.saturating_add(1);
        if side.stage == Stage::Passing {
            let end = side.end.and_then(|end| net.redundancy.at(end));
            if end.is_none_or(|index| net.stations[index].follows_command()) {
                side = Side::default();
            } else if side.cycles > COMMAND_CYCLES {
                end.into_iter()
                    .for_each(|index| net.stations[index].command_topology(Loop::loopback(channel)));
                side.asked = self.next_addressed(net, channel, side.end);
                side.enter(Stage::Opening);
            }
        }
        if side.stage == Stage::Opening {
            if self.end_status(net, channel).is_some() {
                side.enter(Stage::Asking);
            } else if side.cycles > COMMAND_CYCLES {
                // It was there when the one before heard its telegrams, and is not any more: the search ends where that one is.
                let back = side.before.and_then(|before| net.redundancy.at(before));
                if let Some(index) = back {
                    net.stations[index].command_topology(Loop::loopback(channel));
                }
                (side.end, side.asked) = (side.before, None);
                side.enter(Stage::Done);
            }
        }
        if side.stage == Stage::Asking {
            let answered = match (side.end, side.asked) {
                (_, None) => false,
                (None, Some(asked)) => {
                    let command = net.station_at(asked).map(|(_, station)| asks(station, channel));
                    command.and_then(|command| self.turns(net, channel, asked, command)).is_some()
                }
                (Some(_), Some(_)) => self.hears(net, channel, channel),
            };
            let rival = &mut self.sides[channel.other().index()].asked;
            if answered && *rival == side.asked {
                // It is asked by both: the other channel takes its question back first, in a cycle of its own, so that the
                // handshake bits of both stay in step.
                *rival = None;
            } else if answered {
                self.find(net, channel, &mut side);
            } else if side.cycles > COMMAND_CYCLES || side.asked.is_none() {
                side.asked = None;
                side.enter(Stage::Done);
            }
        }
        self.sides[at] = side;
    }

    /// The station that was asked turns the telegrams round.
    fn find(&mut self, net: &mut Network, channel: Channel, side: &mut Side) {
        let Some(found) = side.asked else { return };
        if let Some(index) = net.redundancy.at(found) {
            net.stations[index].link.command = asks(&net.stations[index], channel);
        }
        side.before = side.end.replace(found);
        match side.before.and_then(|before| net.redundancy.at(before)) {
            Some(index) => {
                net.stations[index].command_topology(Loop::FastForward);
                side.enter(Stage::Opening);
            }
            None => side.enter(Stage::Asking),
        }
        side.asked = self.next_addressed(net, channel, Some(found));
        let command = net.station_at(found).map(|(_, station)| station.link.command);
        let status = command.and_then(|command| self.turns(net, channel, found, command));
        let hears_own = status.is_some_and(|status| status.inactive_port() == InactivePort::hearing(channel));
        if side.before.is_none() && hears_own {
            // Nobody else has been asked yet: the end of the line turns the telegrams round, and all is well.
            if let Some(index) = net.redundancy.at(found) {
                net.stations[index].command_topology(Loop::FastForward);
            }
            side.asked = None;
            side.enter(Stage::Passing);
        }
    }

    /// Whether telegrams get from one port to the other, or would if the stations at the ends let them: nothing is wrong between
    /// those.
    fn is_whole(&self, net: &Network) -> bool {
        let round = [Route::PRIMARY_TWO, Route::SECONDARY_ONE].iter().any(|&route| net.frames.came(route));
        let [low, high] = self.sides.map(|side| side.end);
        // Next to each other they are the ends of a ring that is closed in the usual way.
        let apart = low.zip(high).is_some_and(|(low, high)| high > low + 1);
        let hear = || Channel::ALL.into_iter().all(|channel| self.hears(net, channel, channel.other()));
        !self.resumed && (round || apart && hear())
    }

    /// Both ends are commanded to pass everything on again.
    fn begin_resuming(&mut self, net: &mut Network) {
        self.command_ends(net, |_| Loop::FastForward);
        for side in &mut self.sides {
            side.asked = None;
        }
        self.resuming = Some(0);
    }

    fn command_ends(&mut self, net: &mut Network, command: impl Fn(Channel) -> Loop) {
        for channel in Channel::ALL {
            let end = self.sides[channel.index()].end;
            if let Some(index) = end.and_then(|end| net.redundancy.at(end)) {
                net.stations[index].command_topology(command(channel));
            }
        }
    }

    /// One cycle of that.
    fn resume(&mut self, net: &mut Network, cycles: u16) -> bool {
        self.resuming = Some(cycles);
        let follows = |side: &Side| {
            let end = side.end.and_then(|end| net.station_at(end));
            end.is_none_or(|(_, station)| station.follows_command())
        };
        if net.redundancy.topology().is_ring() && self.sides.iter().all(follows) {
            *self = Isolation::default();
            net.emit(Event::RingClosed);
            return true;
        }
        if cycles > COMMAND_CYCLES {
            self.command_ends(net, Loop::loopback);
            (self.resuming, self.resumed) = (None, true);
            for channel in Channel::ALL {
                let end = self.sides[channel.index()].end;
                let asked = self.next_addressed(net, channel, end);
                let side = &mut self.sides[channel.index()];
                side.asked = asked;
                side.enter(Stage::Opening);
            }
        }
        false
    }

    /// Every side has found its end: what is behind is left out.
    fn end_search(&mut self, net: &mut Network) {
        let sides = self.sides;
        let [low, high] = sides.map(|side| side.end);
        let found = low.is_some() || high.is_some();
        let joined = low.zip(high).is_some_and(|(low, high)| low + 1 == high);
        if joined {
            // Nobody hangs: it is the cable, or it was the master. The ring is closed like any other that is open there.
            let heard = Channel::ALL.into_iter().all(|channel| self.hears(net, channel, channel.other()));
            let cable = low.map_or(0, |low| low + 1);
            net.redundancy.note_open(cable);
            if !heard {
                let (low, high) = net.cable(cable);
                net.emit(Event::CableOpen { low, high });
            }
        }
        for channel in Channel::ALL.into_iter().filter(|_| found && !joined) {
            let Side { stage, end, .. } = sides[channel.index()];
            let behind = net.redundancy.neighbour(channel, end);
            if let Some(position) = behind.filter(|_| stage != Stage::Off) {
                self.tell_isolated(net, channel, end, position);
            }
        }
        *self = Isolation { silent: self.silent, ..Isolation::default() };
    }

    fn tell_isolated(&mut self, net: &mut Network, channel: Channel, end: Option<usize>, position: usize) {
        let cable = if channel == Channel::Primary { position } else { position + 1 };
        let end = end.and_then(|end| net.station_at(end)).map(|(index, station)| End::Slave {
            slave: SlaveId::from_index(index),
            address: station.address,
        });
        if end.is_some() {
            net.redundancy.note_open(cable);
        }
        let Some((index, station)) = net.station_at(position) else { return };
        let (slave, address, port) = (SlaveId::from_index(index), station.address, port_of(channel));
        net.emit(Event::Isolated { slave, address, port, end: end.unwrap_or(End::Master(port)) });
    }

    /// C-DEV of the stations that are asked, in the MDTs of their channel alone.
    pub fn build_questions(&self, net: &mut Network) {
        for channel in Channel::ALL {
            let Some(asked) = self.sides[channel.index()].asked else { continue };
            let Some((index, station)) = net.station_at(asked) else { continue };
            let mut control = asks(station, channel);
            control.insert(DeviceControl::MASTER_VALID);
            control.set(DeviceControl::RING_CLOSED, net.redundancy.is_closed());
            net.write_control(channel, index, control);
        }
    }

    /// During the search: whether every AT is back that can be waited for. `None` when nothing is searched for.
    pub fn search_is_complete(&self, net: &Network) -> Option<bool> {
        if !self.is_busy() || self.resuming.is_some() {
            return None;
        }
        let routes = net.redundancy.topology().routes();
        Some(Channel::ALL.into_iter().all(|channel| {
            let side = &self.sides[channel.index()];
            let back = || net.frames.all_back(Kind::At, route_of(channel));
            match side.stage {
                Stage::Off => !routes.contains(&route_of(channel)) || back(),
                // Whether anybody answers at all is known when the cycle is over.
                stage => back() || side.end.is_none() && stage == Stage::Done,
            }
        }))
    }
}
