//! The network's master (CiA 302).
//!
//! [`Master`] brings every device of its list up, each by itself, and keeps SYNC and PDOs going meanwhile. It is driven by time
//! and frames:
//!
//! ```text
//! loop {
//!     wait until wake_at(), hand every frame that arrives meanwhile to handle_frame()
//!     take consumer() values, write producer() values, commit()
//!     while let Some(output) = poll(now) { send it }
//!     while let Some(event) = poll_event() { .. }
//! }
//! ```
//!
//! SYNC lies on a grid of absolute times: a late caller makes one SYNC late, not those behind it. Right after SYNC go the RPDOs that
//! were committed, which take effect at the next SYNC; what else there is to send follows. A device that is not in operation gets
//! no RPDO, and nothing of it is fresh.
//!
//! All storage is set aside in [`Master::new`], and for other PDOs in [`pdo_set::PdoSet::new`]; nothing is allocated or freed
//! afterwards.

pub mod boot;
pub mod config;
mod cycle;
mod ends;
pub mod event;
pub mod foreign;
pub mod pdo_set;
mod plan;
mod program;
mod queue;
mod receive;
mod relapse;
pub mod report;
mod sequence;
mod station;

use std::collections::VecDeque;

use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

use self::boot::{BootEvent, BootState, BootStatus};
use self::config::{ConfigError, Direction, MasterConfig};
pub use self::ends::{Consumer, ConsumerState};
use self::event::{DuplicateSign, Event, Output, Refusal, Statistics, Ticket};
use self::foreign::{Bus, Foreign};
pub use self::queue::Priority;
use self::receive::Routes;
use self::report::ReportRow;
use self::station::Station;
use crate::sdo::request::SdoRequest;
use crate::wire::emcy::Emcy;
use crate::wire::error_control::Heartbeat;
use crate::wire::nmt::{Nmt, NmtCommand, NmtState};
use crate::wire::pdo::MappingEntry;
use crate::wire::time::TimeOfDay;
use crate::wire::{Function, NodeId, cob_id};

/// Events kept until they are taken; later ones are dropped and counted.
pub const EVENTS_MAX: usize = 1024;

/// Why an SDO request was not taken. It is given back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SubmitError {
    /// The device is not in the list.
    #[error("no such node in the list")]
    NoNode,
    /// The device is not that far, or not there.
    #[error("the node is {0}: requests are carried from await on")]
    State(BootState),
    /// All places of the device are taken.
    #[error("the node's queue is full")]
    Full,
}

/// Why a call of the application does not fit the state of the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// The device is not in the list.
    #[error("no such node in the list")]
    NoNode,
    /// The device is in another state.
    #[error("not possible while the node is {0}")]
    State(BootState),
    /// The configuration is not acceptable.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// What is known of a device.
#[derive(Debug, Clone, Copy)]
pub struct NodeInfo<'a> {
    /// The device.
    pub node: NodeId,
    /// Where it is.
    pub state: BootState,
    /// What its heartbeat, or its answer to node guarding, told last.
    pub heartbeat: Option<NmtState>,
    /// 1000, once read.
    pub device_type: Option<u32>,
    /// 1018:1 to 4, once read and where it has them.
    pub identity: [Option<u32>; 4],
    /// Error status of its last boot-up.
    pub status: Option<BootStatus>,
    /// Its last EMCY.
    pub emcy: Option<Emcy>,
    /// What was read and written on the way up.
    pub report: &'a [ReportRow],
}

/// The master of a network.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    stations: Vec<Station>,
    routes: Routes,
    running: bool,
    bus_off: bool,
    /// All mandatory devices are in operation, and that was told.
    complete: bool,
    next_sync: MonotonicTime,
    last_sync: MonotonicTime,
    counter: u8,
    sync_due: bool,
    /// SDO frames that may go in this period.
    sdo_left: u8,
    next_client: usize,
    /// A command for all devices.
    nmt_all: Option<NmtCommand>,
    time: Option<TimeOfDay>,
    heartbeat: Option<NmtState>,
    next_heartbeat: MonotonicTime,
    events: VecDeque<Event>,
    next_outcome: usize,
    statistics: Statistics,
    unknown: [u64; 2],
    second_master: u8,
    /// Whose the bus is, and what was heard of somebody else.
    bus: Bus,
    foreign: Foreign,
    transmit_told: bool,
}

impl Master {
    /// A master that sends nothing until it is started.
    ///
    /// # Errors
    /// When the network is not possible.
    pub fn new(config: MasterConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let stations: Vec<_> = config.nodes.iter().map(|node| Station::new(&config, node)).collect();
        Ok(Self {
            routes: Routes::new(&stations),
            stations,
            running: false,
            bus_off: false,
            complete: false,
            next_sync: MonotonicTime::ZERO,
            last_sync: MonotonicTime::ZERO,
            counter: 0,
            sync_due: false,
            sdo_left: u8::MAX,
            next_client: 0,
            nmt_all: None,
            time: None,
            heartbeat: None,
            next_heartbeat: MonotonicTime::MAX,
            events: VecDeque::with_capacity(EVENTS_MAX),
            next_outcome: 0,
            statistics: Statistics::default(),
            unknown: [0; 2],
            second_master: 0,
            bus: Bus::Ours,
            foreign: Foreign::default(),
            transmit_told: false,
            config,
        })
    }

    /// Starts: once the bus has been silent for [`foreign::LISTEN`], devices are reset, unless they may stay in operation, and
    /// brought up; SYNC begins. Nothing when it runs already.
    pub fn start(&mut self, now: MonotonicTime) {
        if core::mem::replace(&mut self.running, true) {
            return;
        }
        // Somebody has stopped the network to see to it.
        self.stations.iter_mut().for_each(|station| station.programmed = false);
        self.heartbeat = None;
        self.listen(now);
    }

    /// Stops: all devices are told to stop, and nothing is sent any more.
    pub fn stop(&mut self, now: MonotonicTime) {
        let led = self.leads();
        if !core::mem::replace(&mut self.running, false) || !led {
            // Nothing was sent, or the devices are another master's.
            self.bus = Bus::Ours;
            return;
        }
        for index in 0..self.stations.len() {
            self.advance(now, index, BootEvent::Stop);
            self.stations[index].nmt = None;
        }
        self.nmt_all = Some(NmtCommand::STOP);
        (self.sync_due, self.heartbeat) = (false, None);
        self.complete = false;
    }

    /// Whether it has been started.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// When to call [`Master::poll`] next; `None` when nothing will happen by itself.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.bus_off {
            return None;
        }
        if let Some(until) = self.listens_until() {
            return Some(until);
        }
        let pending = self.nmt_all.is_some() || self.time.is_some() || self.sync_due || self.has_rpdo();
        if pending {
            return Some(MonotonicTime::ZERO);
        }
        if !self.running {
            return None;
        }
        let sync = self.config.sync.map(|_| self.next_sync);
        let heartbeat = self.heartbeat.map(|_| self.next_heartbeat);
        let stations = (0..self.stations.len()).filter_map(|index| self.station_wakes(index));
        stations.chain(sync).chain(heartbeat).min()
    }

    /// The next SYNC; `None` while there is none.
    #[must_use]
    pub fn next_sync(&self) -> Option<MonotonicTime> {
        self.config.sync.filter(|_| self.leads() && !self.bus_off).map(|_| self.next_sync)
    }

    /// Does what is due, and gives the frames to send one by one.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Output> {
        if self.bus_off || !self.may_send(now) {
            return None;
        }
        self.cycle(now);
        if let Some(frame) = self.next_cyclic() {
            return Some(Output::Transmit(frame));
        }
        self.work(now);
        self.next_other(now).map(Output::Transmit)
    }

    /// Takes a frame from the bus. A refused one changes nothing; it is counted by its reason.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) -> Result<(), Refusal> {
        let taken = match self.bus {
            _ if !self.running => Err(Refusal::NotOurs),
            Bus::Ours => self.receive(now, frame),
            Bus::Listening(_) | Bus::Occupied(_) => Err(self.overhear(now, frame)),
        };
        match taken {
            Ok(()) => self.statistics.accepted += 1,
            Err(reason) => self.statistics.count(reason),
        }
        taken
    }

    /// The controller is bus off: nothing can be sent, and nothing is valid.
    pub fn bus_off(&mut self, now: MonotonicTime) {
        if core::mem::replace(&mut self.bus_off, true) {
            return;
        }
        self.emit(Event::BusOff);
        for index in 0..self.stations.len() {
            self.advance(now, index, BootEvent::Stop);
            self.stations[index].nmt = None;
        }
        (self.sync_due, self.complete) = (false, false);
    }

    /// The controller is back on the bus: all devices are brought up again, if nobody else has the bus.
    pub fn bus_on(&mut self, now: MonotonicTime) {
        if !core::mem::replace(&mut self.bus_off, false) {
            return;
        }
        self.emit(Event::BusOn);
        if self.running {
            self.listen(now);
        }
    }

    /// A frame could not be sent. What depends on it has a time-out.
    pub fn transmit_failed(&mut self, id: Id) {
        self.statistics.transmit_failures += 1;
        if !core::mem::replace(&mut self.transmit_told, true) {
            self.emit(Event::TransmitFailed { id });
        }
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        let stations = self.stations.len();
        for turn in 0..stations {
            let index = (self.next_outcome + turn) % stations;
            let station = &mut self.stations[index];
            if let Some((serial, outcome)) = station.queue.take_outcome() {
                self.next_outcome = index + 1;
                return Some(Event::Sdo { ticket: Ticket { node: station.node, serial }, outcome });
            }
        }
        None
    }

    fn place(&self, node: NodeId) -> Option<usize> {
        self.stations.iter().position(|station| station.node == node)
    }

    /// The devices of the list.
    pub fn nodes(&self) -> impl Iterator<Item = NodeInfo<'_>> {
        self.stations.iter().map(|station| NodeInfo {
            node: station.node,
            state: station.state,
            heartbeat: station.heartbeat,
            device_type: station.device_type,
            identity: station.identity,
            status: station.status,
            emcy: station.emcy,
            report: &station.report,
        })
    }

    /// One device.
    #[must_use]
    pub fn node(&self, node: NodeId) -> Option<NodeInfo<'_>> {
        self.nodes().find(|info| info.node == node)
    }

    fn call(&self, node: NodeId) -> Result<(usize, BootState), CallError> {
        let place = self.place(node).ok_or(CallError::NoNode)?;
        Ok((place, self.stations[place].state))
    }

    /// The application is through with a device that awaits it. Its requests are finished first.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn node_ready(&mut self, node: NodeId) -> Result<(), CallError> {
        match self.call(node)? {
            (place, BootState::Await) => self.stations[place].proceed = true,
            (_, state) => return Err(CallError::State(state)),
        }
        Ok(())
    }

    /// Tries a device again that has failed, was lost or was stopped.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn retry(&mut self, now: MonotonicTime, node: NodeId) -> Result<(), CallError> {
        let (place, state) = self.call(node)?;
        if !self.leads() || self.bus_off || !self.advance(now, place, BootEvent::Start) {
            return Err(CallError::State(state));
        }
        Ok(())
    }

    /// Stops a device. It stays so until [`Master::retry`].
    ///
    /// # Errors
    /// [`CallError`].
    pub fn stop_node(&mut self, now: MonotonicTime, node: NodeId) -> Result<(), CallError> {
        let (place, state) = self.call(node)?;
        if !self.advance(now, place, BootEvent::Stop) {
            return Err(CallError::State(state));
        }
        self.stations[place].nmt = Some(NmtCommand::STOP);
        Ok(())
    }

    /// Hands a request to a device's SDO server. Its outcome comes as [`Event::Sdo`].
    ///
    /// # Errors
    /// Why not, and the request.
    #[allow(clippy::result_large_err, reason = "the request goes back with the caller's buffer")]
    pub fn sdo_submit(
        &mut self,
        node: NodeId,
        request: SdoRequest,
        priority: Priority,
    ) -> Result<Ticket, (SubmitError, SdoRequest)> {
        let Some(place) = self.place(node) else { return Err((SubmitError::NoNode, request)) };
        let station = &mut self.stations[place];
        if !station.state.serves() {
            return Err((SubmitError::State(station.state), request));
        }
        match station.queue.submit(priority, request) {
            Ok(serial) => Ok(Ticket { node, serial }),
            Err(request) => Err((SubmitError::Full, request)),
        }
    }

    fn end(&self, node: NodeId) -> Option<&Station> {
        self.stations.iter().find(|station| station.node == node)
    }

    fn end_mut(&mut self, node: NodeId) -> Option<&mut Station> {
        self.stations.iter_mut().find(|station| station.node == node)
    }

    /// What a device transmits in a TPDO.
    #[must_use]
    pub fn consumer(&self, node: NodeId, tpdo: u16) -> Option<Consumer<'_>> {
        self.end(node)?.tpdos.iter().find(|end| end.number == tpdo).map(|end| end.view())
    }

    /// The values that a device receives in an RPDO, for the next commit.
    pub fn producer(&mut self, node: NodeId, rpdo: u16) -> Option<&mut [u8]> {
        let end = self.end_mut(node)?.rpdos.iter_mut().find(|end| end.number == rpdo)?;
        Some(end.data_mut())
    }

    /// Sends the values once: after the next SYNC, for the device to take them at the one behind it. An event-driven RPDO goes after
    /// that one, or at once in a network without SYNC. Has an effect only while the device is in operation; `false` otherwise.
    pub fn commit(&mut self, node: NodeId, rpdo: u16) -> bool {
        let has_sync = self.config.sync.is_some();
        let Some(station) = self.end_mut(node).filter(|station| station.state == BootState::Operational)
        else {
            return false;
        };
        let Some(end) = station.rpdos.iter_mut().find(|end| end.number == rpdo) else { return false };
        if end.is_event_driven() && !has_sync {
            end.due = true;
        } else {
            end.committed = true;
        }
        true
    }

    /// Takes back what has not been sent yet.
    pub fn withdraw(&mut self, node: NodeId, rpdo: u16) {
        let end =
            self.end_mut(node).and_then(|station| station.rpdos.iter_mut().find(|end| end.number == rpdo));
        if let Some(end) = end {
            end.withdraw();
        }
    }

    /// What is in a PDO: as it is configured, or as the device has it after [`Event::MappingAdopted`].
    #[must_use]
    pub fn mapping(&self, node: NodeId, direction: Direction, number: u16) -> Option<&[MappingEntry]> {
        let station = self.end(node)?;
        match direction {
            Direction::Receive => {
                station.rpdos.iter().find(|end| end.number == number).map(|end| end.mapping.as_slice())
            }
            Direction::Transmit => {
                station.tpdos.iter().find(|end| end.number == number).map(|end| end.mapping.as_slice())
            }
        }
    }

    /// Sends TIME once.
    pub fn send_time(&mut self, time: TimeOfDay) {
        if self.leads() {
            self.time = Some(time);
        }
    }

    /// Counters.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &MasterConfig {
        &self.config
    }

    fn emit(&mut self, event: Event) {
        if self.events.len() < EVENTS_MAX {
            self.events.push_back(event);
        } else {
            self.statistics.events_lost += 1;
        }
    }

    /// Tells once per boot that two devices seem to have one node-id.
    fn tell_duplicate(&mut self, index: usize, sign: DuplicateSign) {
        let station = &mut self.stations[index];
        if station.signs.contains(&sign) || station.signs.try_push(sign).is_err() {
            return;
        }
        let node = station.node;
        self.emit(Event::DuplicateNode { node, sign });
    }
}

#[cfg(test)]
mod tests;
