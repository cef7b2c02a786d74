//! The master role: a scanner that takes slaves of the predefined master/slave connection set and exchanges with them.
//!
//! ```text
//! start(now)
//! loop {
//!     hand every frame to handle_frame()
//!     take consumer() values, write producer() values, commit()
//!     while let Some(frame) = poll(now) { send it }
//!     while let Some(event) = poll_event() { .. }
//!     wait until wake_at() or a frame
//! }
//! ```
//!
//! A slave is polled in every cycle with the values that were committed for it. A command goes out once, or as often as
//! [`SlaveConfig::hold_cycles`](config::SlaveConfig::hold_cycles) says; without one the slave gets a message without data, which
//! keeps its connection and commands nothing.
//!
//! Slaves do not know of each other: one that is lost, refuses or talks nonsense is waited for and taken anew, and the others
//! go on. Only a duplicate of the master's own MAC ID and a bus that is off end everything.
//!
//! All storage is set aside in [`Master::new`].

mod client;
pub mod config;
mod cycle;
pub mod event;
pub mod foreign;
pub mod io;
pub mod motion;
mod setup;
pub mod speed;
pub mod station;

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

use self::client::Client;
use self::config::{CONNECTIONS_MAX, ConfigError, MasterConfig, SlaveConfig};
use self::event::{Event, ExplicitRequest, LossReason, Outcome, Ticket};
use self::foreign::Foreign;
use self::io::{Consumer, IoEnd};
use self::station::Phase;
use super::access::{AccessEvent, AccessState, NetworkAccess};
use super::connection::ConnectionKind;
use super::link::{self, Refusal};
use super::wire::{BodyFormat, DuplicateMac, Identifier, MacId};

/// Requests of a slave that wait or have ended without being taken.
pub const REQUESTS_MAX: usize = 4;

/// Events kept until they are taken; later ones are dropped and counted.
pub const EVENTS_MAX: usize = 512;

/// Frames of one slave that are kept until they are taken.
const FRAMES_PER_SLAVE: usize = 16;

/// Why a request was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// There is no such slave.
    #[error("no such slave")]
    NoSlave,
    /// The slave is not exchanged with.
    #[error("the slave is not exchanged with")]
    NotExchanging,
    /// All places are taken.
    #[error("the slave's queue is full")]
    Full,
}

/// What the master has counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Cycles that have begun.
    pub cycles: u64,
    /// Cycles that were left out, because they could only have begun late.
    pub skipped: u64,
    /// Whole I/O messages of slaves.
    pub received: u64,
    /// Answers that stayed away.
    pub missed: u64,
    /// Frames that were not used, of those that were meant for the master or its slaves.
    pub refused: u64,
    /// Times that a slave was lost or could not be taken.
    pub losses: u64,
    /// Frames that had no place in the queue.
    pub frames_dropped: u64,
    /// Events that had no place in the queue.
    pub events_dropped: u64,
}

/// A request that waits, or its end.
#[derive(Debug, Clone)]
enum Place {
    Waiting(u64, ExplicitRequest),
    Running(u64),
    Ended(u64, Outcome),
}

/// What is known of a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Facts {
    /// Vendor ID, once it was asked.
    pub vendor: Option<u16>,
    /// Device type.
    pub device_type: Option<u16>,
    /// Product code.
    pub product_code: Option<u16>,
    /// Serial number.
    pub serial: Option<u32>,
    /// Status word of the Identity object, read again and again.
    pub status: Option<u16>,
    /// The assembly that the path leads to which was read last.
    pub(super) assembly: Option<u8>,
}

#[derive(Debug, Clone)]
struct Station {
    config: SlaveConfig,
    phase: Phase,
    /// Which question of the phase is asked.
    step: usize,
    since: MonotonicTime,
    /// The slave is asked again then.
    retry_at: MonotonicTime,
    /// Time from the next loss to the next attempt.
    retry_pause: DurationNs,
    /// Reason told last.
    told: Option<LossReason>,
    /// What was heard of another master.
    foreign: Foreign,
    client: Client,
    /// The request that the client carries out is the master's own.
    own: bool,
    /// The explicit connection did not answer, and is to be allocated again.
    explicit_gone: bool,
    /// The next keep-alive of the explicit connection.
    keep_alive_at: MonotonicTime,
    format: BodyFormat,
    facts: Facts,
    ends: ArrayVec<IoEnd, CONNECTIONS_MAX>,
    places: ArrayVec<Place, REQUESTS_MAX>,
}

/// The master of a network.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    access: NetworkAccess,
    stations: Vec<Station>,
    /// Index into `stations` by MAC ID.
    index: [Option<u8>; MacId::COUNT],
    running: bool,
    next_cycle: MonotonicTime,
    frames: VecDeque<Frame>,
    frames_max: usize,
    events: VecDeque<Event>,
    serial: u64,
    next_station: usize,
    statistics: Statistics,
}

impl Master {
    /// A master that is off.
    ///
    /// # Errors
    /// The configuration cannot be used.
    pub fn new(config: MasterConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let mut index = [None; MacId::COUNT];
        for (place, slave) in (0_u8..).zip(&config.slaves) {
            index[usize::from(slave.mac.get())] = Some(place);
        }
        let station = |slave: &SlaveConfig| Station {
            phase: Phase::Waiting,
            step: 0,
            since: MonotonicTime::ZERO,
            retry_at: MonotonicTime::ZERO,
            retry_pause: config.retry,
            told: None,
            foreign: Foreign::default(),
            client: Client::new(config.mac, slave.mac, config.explicit_timeout),
            own: false,
            explicit_gone: false,
            keep_alive_at: MonotonicTime::ZERO,
            format: BodyFormat::CLASS_8_INSTANCE_8,
            facts: Facts::default(),
            ends: slave.connections.iter().map(|one| IoEnd::new(*one)).collect(),
            places: ArrayVec::new(),
            config: slave.clone(),
        };
        let frames_max = (config.slaves.len() + 1) * FRAMES_PER_SLAVE;
        Ok(Self {
            access: NetworkAccess::new(config.vendor, config.serial),
            stations: config.slaves.iter().map(station).collect(),
            index,
            running: false,
            next_cycle: MonotonicTime::ZERO,
            frames: VecDeque::with_capacity(frames_max),
            frames_max,
            events: VecDeque::with_capacity(EVENTS_MAX),
            serial: 0,
            next_station: 0,
            statistics: Statistics::default(),
            config,
        })
    }

    /// Goes on line: the duplicate MAC ID check begins. Also the way back from a communication fault.
    pub fn start(&mut self, now: MonotonicTime) {
        self.lose_all(now);
        self.frames.clear();
        self.running = true;
        self.access.event(AccessEvent::Begin);
    }

    /// Gives every slave back and asks for none any more. The master stays on line.
    pub fn stop(&mut self, now: MonotonicTime) {
        self.running = false;
        for place in 0..self.stations.len() {
            self.give_back(now, place);
        }
    }

    /// The CAN controller has left the bus.
    pub fn handle_bus_off(&mut self, now: MonotonicTime) {
        self.tell(Event::BusOff);
        self.lose_all(now);
        self.frames.clear();
        self.access.event(AccessEvent::BusOff { reset: self.config.bus_off_reset });
    }

    /// Where the network access is.
    #[must_use]
    pub const fn access(&self) -> AccessState {
        self.access.state()
    }

    /// When the next cycle begins; `None` while the master is not on line.
    #[must_use]
    pub fn next_cycle(&self) -> Option<MonotonicTime> {
        self.access.is_online().then_some(self.next_cycle)
    }

    /// Whether everything that was made is sent.
    #[must_use]
    pub fn is_drained(&self) -> bool {
        self.frames.is_empty()
    }

    /// What it was told.
    #[must_use]
    pub const fn config(&self) -> &MasterConfig {
        &self.config
    }

    /// What it has counted.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Where a slave is.
    #[must_use]
    pub fn phase(&self, slave: MacId) -> Option<Phase> {
        self.station(slave).map(|station| station.phase)
    }

    /// What is known of a slave.
    #[must_use]
    pub fn facts(&self, slave: MacId) -> Option<&Facts> {
        self.station(slave).map(|station| &station.facts)
    }

    fn place(&self, slave: MacId) -> Option<usize> {
        self.index[usize::from(slave.get())].map(usize::from)
    }

    fn station(&self, slave: MacId) -> Option<&Station> {
        self.stations.get(self.place(slave)?)
    }

    fn end_mut(&mut self, slave: MacId, kind: ConnectionKind) -> Option<&mut IoEnd> {
        let place = self.place(slave)?;
        self.stations.get_mut(place)?.ends.iter_mut().find(|end| end.config.kind == kind)
    }

    fn tell(&mut self, event: Event) {
        if self.events.len() < EVENTS_MAX {
            self.events.push_back(event);
        } else {
            self.statistics.events_dropped += 1;
        }
    }

    fn send(&mut self, identifier: Identifier, data: &[u8]) {
        match link::frame(identifier, data) {
            Some(frame) if self.frames.len() < self.frames_max => self.frames.push_back(frame),
            _ => self.statistics.frames_dropped += 1,
        }
    }

    /// The values for a slave, for the next [`Master::commit`].
    pub fn producer(&mut self, slave: MacId, kind: ConnectionKind) -> Option<&mut [u8]> {
        self.end_mut(slave, kind).map(IoEnd::output_mut)
    }

    /// The values are whole and go out with the next message. `false` if there is no such connection, or it is not exchanged
    /// on: nothing that was written before then ever goes out.
    pub fn commit(&mut self, slave: MacId, kind: ConnectionKind) -> bool {
        let exchanging = self.phase(slave) == Some(Phase::Exchange);
        match self.end_mut(slave, kind).filter(|_| exchanging) {
            Some(end) => {
                end.commit();
                true
            }
            None => false,
        }
    }

    /// Whether what was committed last has not gone out: its cycle was left out, or has not come yet. The next commit takes its
    /// place.
    #[must_use]
    pub fn is_unsent(&self, slave: MacId, kind: ConnectionKind) -> bool {
        self.station(slave)
            .is_some_and(|station| station.ends.iter().any(|end| end.config.kind == kind && end.is_unsent()))
    }

    /// What a slave has sent.
    #[must_use]
    pub fn consumer(&self, slave: MacId, kind: ConnectionKind) -> Option<Consumer<'_>> {
        let end = self.station(slave)?.ends.iter().find(|end| end.config.kind == kind)?;
        Some(end.consumer())
    }

    /// Hands a request to the explicit connection of a slave. Its end comes as [`Event::Explicit`].
    ///
    /// # Errors
    /// The request is not taken.
    pub fn submit(&mut self, slave: MacId, request: ExplicitRequest) -> Result<Ticket, SubmitError> {
        let place = self.place(slave).ok_or(SubmitError::NoSlave)?;
        let station = &mut self.stations[place];
        if station.phase != Phase::Exchange {
            return Err(SubmitError::NotExchanging);
        }
        let serial = self.serial;
        station.places.try_push(Place::Waiting(serial, request)).map_err(|_| SubmitError::Full)?;
        self.serial += 1;
        Ok(Ticket { slave, serial })
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        let count = self.stations.len();
        for turn in 0..count {
            let place = (self.next_station + turn) % count;
            let station = &mut self.stations[place];
            let ended = station.places.iter().position(|place| matches!(place, Place::Ended(..)));
            let Some(ended) = ended else { continue };
            if let Place::Ended(serial, outcome) = station.places.remove(ended) {
                let ticket = Ticket { slave: station.config.mac, serial };
                self.next_station = place + 1;
                return Some(Event::Explicit { ticket, outcome });
            }
        }
        None
    }

    /// Takes a frame from the network.
    ///
    /// # Errors
    /// It was not used; if it was meant for the master or came from one of its slaves, the reason is an event as well.
    pub fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) -> Result<(), Refusal> {
        let (identifier, data) = link::accept(frame)?;
        let outcome = self.dispatch(now, identifier, data);
        if let Err(refusal) = outcome
            && !matches!(refusal, Refusal::NotForUs(_) | Refusal::Offline | Refusal::DuplicateMac { .. })
        {
            self.statistics.refused += 1;
            self.tell(Event::Refused(refusal));
        }
        outcome
    }

    fn dispatch(&mut self, now: MonotonicTime, identifier: Identifier, data: &[u8]) -> Result<(), Refusal> {
        if let Identifier::DuplicateMacCheck(mac) = identifier {
            return self.check_duplicate(now, identifier, mac, data);
        }
        self.overhear(now, identifier, data);
        if !self.access.is_online() {
            return Err(Refusal::Offline);
        }
        let not_ours = Refusal::NotForUs(identifier);
        let (kind, slave) = match identifier {
            Identifier::ExplicitResponse(slave) => (ConnectionKind::Explicit, slave),
            Identifier::PollResponse(slave) => (ConnectionKind::Poll, slave),
            Identifier::BitStrobeResponse(slave) => (ConnectionKind::BitStrobe, slave),
            Identifier::ChangeOfState(slave) => (ConnectionKind::ChangeOfState, slave),
            _ => return Err(not_ours),
        };
        let place = self.place(slave).ok_or(not_ours)?;
        if kind == ConnectionKind::Explicit {
            let outcome = self.stations[place].client.handle(now, identifier, data);
            self.advance(now, place);
            return outcome;
        }
        self.receive(place, kind, identifier, data)
    }

    fn check_duplicate(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        mac: MacId,
        data: &[u8],
    ) -> Result<(), Refusal> {
        let message = DuplicateMac::parse(data).map_err(|error| Refusal::Malformed(identifier, error))?;
        let (vendor, serial) = (message.vendor, message.serial);
        if mac == self.config.mac {
            if !self.access.handle(&message) {
                return Ok(());
            }
            self.tell(Event::DuplicateMac { mac, vendor, serial });
            self.lose_all(now);
            self.frames.clear();
            return Err(Refusal::DuplicateMac { mac, vendor, serial });
        }
        let place = self.place(mac).ok_or(Refusal::NotForUs(identifier))?;
        let station = &self.stations[place];
        let known = station.facts.vendor == Some(vendor) && station.facts.serial == Some(serial);
        if !station.phase.is_allocated() || message.response {
            return Ok(());
        }
        if known || station.facts.serial.is_none() {
            // The slave itself: it has lost its connections with everything else.
            self.lose(now, place, LossReason::Restarted);
        } else {
            self.tell(Event::SlaveDuplicate { slave: mac, vendor, serial });
        }
        Ok(())
    }

    /// Lets time pass and gives the next frame to be sent.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        if self.frames.is_empty() {
            self.handle_time(now);
        }
        self.frames.pop_front()
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        let was_online = self.access.is_online();
        if let Some(message) = self.access.poll(now) {
            let mut data = [0; super::wire::duplicate_mac::LEN];
            if message.emit(&mut data).is_ok() {
                self.send(Identifier::DuplicateMacCheck(self.config.mac), &data);
            }
        }
        if !self.access.is_online() {
            return;
        }
        if !was_online {
            self.next_cycle = now;
            self.tell(Event::Online);
        }
        if now >= self.next_cycle {
            self.cycle(now);
        }
        for place in 0..self.stations.len() {
            self.advance(now, place);
        }
    }

    /// When to call [`Master::poll`] next; `None` when nothing will happen by itself.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if !self.frames.is_empty() {
            return Some(MonotonicTime::ZERO);
        }
        if !self.access.is_online() {
            return self.access.wake_at();
        }
        let stations = self.stations.iter().filter_map(|station| self.station_wake_at(station));
        stations.chain([self.next_cycle]).chain(self.access.wake_at()).min()
    }
}
