//! What all parts of the master work with: the slaves, the telegrams of the cycle, and the ways they take.

use super::build::{TimeField, slot};
use super::config::MasterConfig;
use super::event::{End as CableEnd, Event, SlaveId};
use super::frames::Frames;
use super::journal::Journal;
use super::layout::CyclicLayout;
use super::phase::State;
use super::redundancy::Redundancy;
use super::station::{End, Presence, Station};
use super::stations::{Stations, is_valid};
use super::svc::request::SvcFailure;
use super::topology::Route;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, Phase};
use crate::wire::layout::DEVICE_WORD_LEN;
use crate::wire::svc::{AtSvc, SVC_LEN, SvcStatus};
use profile_generic::time::MonotonicTime;
use profile_generic::wire::u16_at;

/// Cycles in a row in which a lost slave has to be valid before it takes part again: a bad contact lets one through now and
/// then.
const RETURN_CYCLES: u16 = 10;

/// The network.
#[derive(Debug)]
pub(super) struct Network {
    pub config: MasterConfig,
    pub stations: Stations,
    pub frames: Frames,
    pub layout: CyclicLayout,
    pub redundancy: Redundancy,
    pub time: TimeField,
    pub cycle_count: u8,
    pub journal: Journal,
}

impl Network {
    /// Storage for the network of a configuration that has been checked.
    pub fn new(config: MasterConfig) -> Network {
        let slaves = usize::from(config.slaves_max);
        Network {
            stations: Stations::new(&config),
            frames: Frames::new(config.mac, config.ports),
            layout: CyclicLayout::with_capacity(slaves),
            redundancy: Redundancy::new(config.ports, slaves),
            time: TimeField::default(),
            cycle_count: 0,
            journal: Journal::new(),
            config,
        }
    }

    pub fn emit(&mut self, event: Event) {
        self.journal.emit(event);
    }

    /// The station at a position from port 1 on, with its index.
    pub fn station_at(&self, position: usize) -> Option<(usize, &Station)> {
        let index = self.redundancy.at(position)?;
        Some((index, self.stations.get(index)?))
    }

    /// The ends of a cable by its position.
    pub fn cable(&self, cable: usize) -> (CableEnd, CableEnd) {
        self.redundancy.cable(cable, &self.stations)
    }

    /// Whether telegrams get past a slave to others: all the way round a ring, or to an active one behind it on its line.
    pub fn is_passed(&self, index: usize) -> bool {
        let Some(position) = self.redundancy.position(index) else { return false };
        let is_behind = |(other, station): (usize, &Station)| {
            let on = |route: Route| station.link.valid_routes & 1 << route.index() != 0;
            station.is_active()
                && self.redundancy.position(other).is_some_and(|other| {
                    on(Route::PRIMARY_ONE) && other > position || on(Route::SECONDARY_TWO) && other < position
                })
        };
        self.redundancy.topology().is_ring() || self.stations.iter().enumerate().any(is_behind)
    }

    /// Whether the ATs that have come back have the data of every slave.
    pub fn is_complete(&mut self, scanned: &[Route]) -> bool {
        let back = |route: &Route| self.frames.all_back(Kind::At, *route);
        let scanning = self.stations.phase == Phase::CP0;
        let one_port = self.redundancy.is_fixed();
        let routes = if scanning && !one_port { scanned } else { self.redundancy.topology().routes() };
        if !routes.is_empty() && routes.iter().all(back) {
            return true;
        }
        // In a ring one of the two copies is enough.
        let whole = !scanning && !one_port && Route::ALL.iter().any(back);
        whole
            && (0..self.stations.len()).all(|index| {
                self.read_station(index);
                let station = &self.stations[index];
                match station.presence {
                    Presence::Active => self.stations.is_valid(index),
                    // It has nothing but a service channel yet.
                    Presence::Joining => {
                        station.link.svc.is_some_and(|svc| svc.status.contains(SvcStatus::VALID))
                    }
                    Presence::Lost | Presence::Excluded | Presence::Absent => true,
                }
            })
    }

    /// Takes every slave's part of the ATs.
    pub fn read_stations(&mut self) {
        for index in 0..self.stations.len() {
            self.read_station(index);
        }
        self.stations.find_turning();
    }

    /// Of the copies that a ring gives, a valid one counts, then one into which the slave has put anything at all.
    fn read_station(&mut self, index: usize) {
        let slot = slot(self.stations.phase, &self.layout, index, Kind::At);
        let mut best = (0, None, None);
        let mut valid_routes = 0;
        for &route in self.redundancy.possible_routes() {
            let part = |(telegram, offset): (u8, usize), len: usize| {
                self.frames.at(route, telegram).and_then(|data| data.get(offset..offset + len))
            };
            let svc =
                slot.and_then(|slot| part(slot.svc, SVC_LEN)).and_then(|bytes| AtSvc::parse(bytes).ok());
            let status = slot
                .and_then(|slot| part(slot.device, DEVICE_WORD_LEN))
                .map(|bytes| DeviceStatus::from_bits_retain(u16_at(bytes, 0)));
            let inserted = status.is_some_and(|status| !status.is_empty())
                || svc.is_some_and(|svc| svc.status.contains(SvcStatus::VALID));
            let rank = match status {
                Some(status) if is_valid(self.stations.phase, status) => 3,
                _ if inserted => 2,
                Some(_) => 1,
                None => 0,
            };
            if rank == 3 {
                valid_routes |= 1 << route.index();
            }
            if rank > best.0 {
                best = (rank, status, svc);
            }
        }
        let station = &mut self.stations[index];
        (station.link.status, station.link.svc) = (best.1, best.2);
        station.link.valid_routes = valid_routes;
    }

    /// A slave meets the condition of this state.
    pub fn meets(&self, index: usize, state: State) -> bool {
        let station = &self.stations[index];
        let svc = station.link.svc.unwrap_or_default().status;
        let handshake = svc.contains(SvcStatus::AHS) == station.channel.mhs();
        let svc_valid = svc.contains(SvcStatus::VALID);
        self.stations.is_valid(index)
            && match state {
                State::Identify => svc_valid,
                State::OpenSvc | State::Start2 | State::Start3 => svc_valid && handshake,
                _ => true,
            }
    }

    /// A slave has stopped inserting data for the phase that is left, or takes no part.
    pub fn has_left(&self, index: usize) -> bool {
        let station = &self.stations[index];
        if !station.is_active() {
            return true;
        }
        match self.stations.phase {
            Phase::CP1 => {
                station.link.svc.is_some_and(|svc| !svc.status.intersects(SvcStatus::VALID | SvcStatus::AHS))
            }
            Phase::CP2 => station.link.status.is_some_and(|status| status.is_empty()),
            _ => station.link.status.is_some_and(|status| !status.contains(DeviceStatus::SLAVE_VALID)),
        }
    }

    /// Counts the cycles in which slaves are not heard; `excused` where that is nobody's fault. Those that were lost in CP4 may
    /// be `returning`.
    pub fn supervise(&mut self, excused: bool, returning: bool) {
        for index in 0..self.stations.len() {
            let valid = self.stations.is_valid(index);
            let allowed = self.config.slave_valid_misses;
            let station = &mut self.stations[index];
            let conditions = station.link.status.map(|status| status.intersection(DeviceStatus::CONDITIONS));
            if let Some(status) = conditions.filter(|&status| valid && status != station.link.reported) {
                station.link.reported = status;
                self.journal.emit(Event::DeviceStatus { slave: SlaveId::from_index(index), status });
            }
            match station.presence {
                Presence::Active if valid => station.link.misses = 0,
                Presence::Active if excused => {}
                Presence::Active => {
                    station.link.misses = station.link.misses.saturating_add(1);
                    if station.link.misses > allowed {
                        self.lose(index);
                    }
                }
                Presence::Lost if valid && returning => {
                    station.link.valid_cycles = station.link.valid_cycles.saturating_add(1);
                    if station.link.valid_cycles >= RETURN_CYCLES {
                        self.take_back(index);
                    }
                }
                Presence::Lost => station.link.valid_cycles = 0,
                Presence::Excluded | Presence::Absent | Presence::Joining => {}
            }
        }
    }

    pub fn lose(&mut self, index: usize) {
        let station = &mut self.stations[index];
        station.presence = Presence::Lost;
        station.link.valid_cycles = 0;
        station.channel.abort(SvcFailure::SlaveLost);
        let (slave, address) = (SlaveId::from_index(index), station.address);
        self.stations.count_anew();
        self.emit(Event::SlaveLost { slave, address, phase: self.stations.phase });
    }

    /// A lost slave is valid again. One that had gone to NRT could not be: it is as it was, and takes part again.
    fn take_back(&mut self, index: usize) {
        let station = &mut self.stations[index];
        station.presence = Presence::Active;
        station.link.misses = 0;
        for end in &mut station.ends {
            if let End::Consumer(end) = end {
                end.reset();
            }
        }
        self.stations.count_anew();
        self.emit(Event::SlaveReturned { slave: SlaveId::from_index(index) });
    }

    /// Serves the service channels with what the ATs of this cycle brought.
    pub fn serve(&mut self, now: MonotonicTime) {
        for station in self.stations.iter_mut().filter(|station| station.is_served()) {
            let answer = station.link.svc;
            if let Some(status) = station.link.status {
                station.channel.command_change(status.contains(DeviceStatus::COMMAND_CHANGE));
            }
            station.channel.receive(now, answer);
        }
    }

    /// Takes what the slaves produce.
    pub fn consume(&mut self) {
        for index in 0..self.stations.len() {
            let valid = self.stations[index].is_active() && self.stations.is_valid(index);
            let Some(Some(places)) = self.layout.slaves.get(index) else { continue };
            let station = &mut self.stations[index];
            for (connection, end) in station.connections.iter().zip(&mut station.ends) {
                let End::Consumer(consumer) = end else { continue };
                let instance = connection.instance;
                let place = places.connections.iter().find(|place| place.instance == instance);
                let routes = station.link.valid_routes;
                let bytes = place.filter(|_| valid).and_then(|place| {
                    Route::ALL.into_iter().filter(|route| routes & 1 << route.index() != 0).find_map(
                        |route| {
                            let data = self.frames.at(route, place.at.telegram)?;
                            data.get(place.at.range(usize::from(place.len)))
                        },
                    )
                });
                if let Some(state) = consumer.update(bytes) {
                    let slave = SlaveId::from_index(index);
                    self.journal.emit(Event::Connection { slave, instance, state });
                }
            }
        }
    }

    /// Sets the service channels to a handshake bit, or leaves that as it was, and to nothing else.
    pub fn rest_channels(&mut self, mhs: Option<bool>) {
        for station in self.stations.iter_mut() {
            let mhs = mhs.unwrap_or(station.channel.mhs());
            station.channel.rest(mhs);
        }
    }

    pub fn open_channels(&mut self, open: bool) {
        for station in self.stations.iter_mut() {
            station.channel.set_open(open);
        }
    }

    /// The phase is left: no requests any more.
    pub fn close_channels(&mut self) {
        for station in self.stations.iter_mut() {
            station.channel.abort(SvcFailure::PhaseLeft);
            station.channel.set_open(false);
        }
    }
}
