//! The node role: object dictionary, network management, SDO server, PDOs, and a simulated drive behind it.
//!
//! A [`Node`] takes every frame of the bus by [`Node::handle_frame`] and gives its own by [`Node::poll`]. The device profile
//! behind the communication is an [`Application`]; [`drive::Device`] is one.
//!
//! In a SYNC cycle the node sends what it has sampled, then takes the set-points that came before the SYNC: a set-point
//! takes one cycle to the drive and an actual value one cycle to the master.
//!
//! Nothing is allocated after a node is built.

pub mod application;
pub mod communication;
mod consumer;
pub mod dictionary;
pub mod drive;
pub mod eds;
pub mod errors;
mod gate;
mod guarding;
pub mod nmt;
pub mod pdo;

use std::collections::VecDeque;

use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

pub use self::application::{Application, Event, Report};

use self::consumer::{Change, Consumers};
use self::dictionary::{Dictionary, Group};
use self::errors::Errors;
use self::gate::Gate;
use self::guarding::Guarding;
use self::nmt::Effect;
use self::pdo::Pdo;
use crate::drive::ErrorCode;
use crate::generated::objects;
use crate::lss::slave::{self as lss, SlaveEvent};
use crate::sdo::server::{Server, ServerConfig};
use crate::wire::cob_id::{self, CobId, Function};
use crate::wire::error_control::Heartbeat;
use crate::wire::lss::LssAddress;
use crate::wire::nmt::{Nmt, NmtState};
use crate::wire::pdo::PDO_LEN_MAX;
use crate::wire::sync::Sync;
use crate::wire::time::TimeOfDay;
use crate::wire::{self, NodeId};

/// How often the application is called between SYNCs.
pub const TICK: DurationNs = DurationNs::from_millis(1);

/// A node that was not called for longer has missed the time in between: a stopped process does not catch up.
pub const CATCH_UP_MAX: DurationNs = DurationNs::from_millis(100);

/// Frames that wait to be sent: the PDOs of eight axes twice, and some. Beyond that they are lost.
const WAITING_MAX: usize = 96;

/// Cycles of 1006h without a SYNC after which it is lost, unless somebody says otherwise.
const SYNC_CYCLES: u16 = 3;

/// Source of errors of the communication, in the first byte of the manufacturer in EMCY; those of axes are 1 to 8.
const COMMUNICATION: u8 = 0;

/// What a device says about itself.
#[derive(Debug, Clone, Copy)]
pub struct Identity {
    /// 1000h.
    pub device_type: u32,
    /// 1018h:1.
    pub vendor: u32,
    /// 1018h:2.
    pub product: u32,
    /// 1018h:3.
    pub revision: u32,
    /// 1018h:4.
    pub serial: u32,
    /// 1008h.
    pub name: &'static str,
    /// 1009h.
    pub hardware: &'static str,
    /// 100Ah.
    pub software: &'static str,
}

/// What a node is built with.
#[derive(Debug, Clone, Copy)]
pub struct Config {
    /// Its node-id; `None` waits for one by LSS.
    pub node: Option<NodeId>,
    /// What it says about itself.
    pub identity: Identity,
    /// From a reset to the boot-up message.
    pub boot_time: DurationNs,
    /// Whether its SDO server has block transfers.
    pub has_blocks: bool,
    /// Whether the mapping of its PDOs can be written.
    pub has_mapping: bool,
}

/// What a node has met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Frames for this node whose length or content was wrong.
    pub malformed: u64,
    /// SYNCs taken.
    pub syncs: u64,
    /// RPDOs taken.
    pub rpdos: u64,
    /// Synchronous RPDOs that came after the window of 1007h, and were ignored.
    pub late_rpdos: u64,
    /// TPDOs sent.
    pub tpdos: u64,
    /// Frames that found no room among those that wait to be sent.
    pub lost: u64,
}

/// A CANopen device with its application.
#[derive(Debug)]
pub struct Node<A> {
    config: Config,
    node: Option<NodeId>,
    dictionary: Dictionary,
    application: A,
    server: Server,
    lss: lss::Slave,
    state: NmtState,
    /// When the boot-up message is due, while initialising.
    boot_at: Option<MonotonicTime>,
    rpdos: Vec<Pdo>,
    tpdos: Vec<Pdo>,
    errors: Errors,
    consumers: Consumers,
    heartbeat_at: MonotonicTime,
    guarding: Guarding,
    /// Last SYNC since the communication started.
    last_sync: Option<MonotonicTime>,
    sync_cycles: u16,
    sync_lost: bool,
    time: TimeOfDay,
    /// Up to when the application has been called; `None` before the first call.
    stepped: Option<MonotonicTime>,
    waiting: VecDeque<Frame>,
    statistics: Statistics,
}

impl<A: Application> Node<A> {
    /// A node that sends its boot-up message after the first call and [`Config::boot_time`].
    pub fn new(config: &Config, mut application: A) -> Self {
        let identity = &config.identity;
        let mut dictionary = Dictionary::new(config.node);
        communication::define(&mut dictionary, config);
        application.define(&mut dictionary);
        if !config.has_mapping {
            dictionary.make_constant(|index| {
                wire::pdo::Direction::BOTH.iter().any(|way| way.mapping().contains(&index))
            });
        }
        let eds = eds::write(&dictionary, &config.identity);
        dictionary.fill(wire::Mux::new(objects::STORE_EDS, 0), eds.as_bytes());
        let capacity =
            dictionary.entries().iter().map(|entry| entry.bytes().len().max(entry.definition().bytes.1));
        let server = Server::new(ServerConfig {
            capacity: capacity.max().unwrap_or(0).max(8),
            block_size: if config.has_blocks { wire::sdo::BLOCK_MAX } else { 0 },
            ..ServerConfig::default()
        });
        let pdos = |first: u16| {
            let own = first..first + 0x200;
            let own = dictionary.objects().iter().filter(|object| own.contains(&object.index));
            own.take(pdo::PDOS_MAX).map(|object| Pdo::new(object.index, &dictionary)).collect()
        };
        Self {
            config: *config,
            node: config.node,
            lss: lss::Slave::new(lss::SlaveConfig {
                address: LssAddress([identity.vendor, identity.product, identity.revision, identity.serial]),
                node: config.node,
                bit_timings: arrayvec::ArrayVec::new(),
                storable: true,
            }),
            rpdos: pdos(wire::pdo::RPDO_COMMUNICATION),
            tpdos: pdos(wire::pdo::TPDO_COMMUNICATION),
            dictionary,
            application,
            server,
            state: NmtState::BOOT_UP,
            boot_at: None,
            errors: Errors::default(),
            consumers: Consumers::default(),
            heartbeat_at: MonotonicTime::ZERO,
            guarding: Guarding::default(),
            last_sync: None,
            sync_cycles: SYNC_CYCLES,
            sync_lost: false,
            time: TimeOfDay::default(),
            stepped: None,
            waiting: VecDeque::with_capacity(WAITING_MAX),
            statistics: Statistics::default(),
        }
    }

    /// Its node-id, if it has one.
    pub fn node(&self) -> Option<NodeId> {
        self.node
    }

    /// The objects.
    pub fn dictionary(&self) -> &Dictionary {
        &self.dictionary
    }

    /// The objects, to change them from inside the device.
    pub fn dictionary_mut(&mut self) -> &mut Dictionary {
        &mut self.dictionary
    }

    /// What runs on the node.
    pub fn application(&self) -> &A {
        &self.application
    }

    /// The application, to act on it from outside.
    pub fn application_mut(&mut self) -> &mut A {
        &mut self.application
    }

    /// State of network management; `NmtState::BOOT_UP` while initialising.
    pub fn state(&self) -> NmtState {
        self.state
    }

    /// The last time of day that came.
    pub fn time(&self) -> TimeOfDay {
        self.time
    }

    /// What it has met.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Its electronic data sheet.
    pub fn eds(&self) -> &[u8] {
        let handle = self.dictionary.find(wire::Mux::new(objects::STORE_EDS, 0));
        handle.map_or(&[], |handle| self.dictionary.entry(handle).bytes())
    }

    /// Reports an error of the CAN controller, as [`ErrorCode::CAN_OVERRUN`], or that it is gone.
    pub fn report_controller(&mut self, code: ErrorCode, active: bool) {
        if active {
            self.errors.raise(code, COMMUNICATION, &mut self.dictionary);
        } else {
            self.errors.clear(code, COMMUNICATION, &mut self.dictionary);
        }
    }

    /// How many cycles of 1006h may pass without a SYNC; 3 where this is not called.
    pub fn set_sync_cycles(&mut self, cycles: u16) {
        self.sync_cycles = cycles;
    }

    /// The bus is off: the master is gone.
    pub fn bus_off(&mut self) {
        self.lose_connection();
    }

    /// Switches it off and on: everything starts anew, with the parameters that were stored.
    pub fn power_cycle(&mut self, now: MonotonicTime) {
        self.apply(now, NmtState::BOOT_UP, Effect::ResetNode);
    }

    /// When [`Node::handle_time`] has something to do, unless a frame comes before.
    pub fn wake_at(&self) -> MonotonicTime {
        self.stepped.map_or(MonotonicTime::ZERO, |stepped| stepped + TICK)
    }

    /// Lets time pass.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        let mut stepped = *self.stepped.get_or_insert(now);
        if self.state == NmtState::BOOT_UP && self.boot_at.is_none() && self.node.is_some() {
            self.boot_at = Some(now + self.config.boot_time);
        }
        if now.since(stepped) > CATCH_UP_MAX {
            stepped = now;
        }
        while now.since(stepped) >= TICK {
            stepped = stepped + TICK;
            self.application.step(TICK, &mut self.dictionary);
        }
        self.stepped = Some(stepped);
        self.boot(now);
        self.watch(now);
        self.tell(now);
    }

    /// Takes a frame of the bus that another station has sent. Those that are none of this node's business are left alone.
    // Flat: one arm per kind of frame.
    pub fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        self.handle_time(now);
        let Id::Standard(_) = frame.id() else { return };
        // No PDO is sent when it is asked for, and no device here speaks FD.
        if frame.is_remote() {
            self.handle_guarding(now, frame.id());
            return;
        }
        if frame.is_fd() {
            return;
        }
        let data = frame.data();
        if frame.id() == cob_id::LSS_REQUEST && self.hears_lss() {
            self.handle_lss(now, data);
            return;
        }
        let Some(own) = self.node.filter(|_| self.state != NmtState::BOOT_UP) else { return };
        let word = |index| CobId(u32::try_from(self.dictionary.number(index, 0)).unwrap_or(u32::MAX));
        match Function::of(frame.id()) {
            Some(Function::Nmt) => self.handle_nmt(now, data),
            Some(Function::SdoRequest(node)) if node == own => self.handle_sdo(now, data),
            Some(Function::ErrorControl(node)) if node != own => self.handle_heartbeat(now, node, data),
            _ if !self.state.has_sdo() => {}
            _ if frame.id() == word(objects::COB_ID_SYNC).id() => self.handle_sync(now, data),
            _ if frame.id() == word(objects::COB_ID_TIME).id() && !word(objects::COB_ID_TIME).is_valid() => {
                self.handle_time_stamp(data);
            }
            _ if self.is_mine(frame.id()) => {
                self.errors.raise(ErrorCode::IDENTIFIER_COLLISION, COMMUNICATION, &mut self.dictionary);
            }
            _ if self.state.has_pdo() => self.handle_rpdo(now, frame.id(), data),
            _ => {}
        }
        self.tell(now);
    }

    /// A node that boots hears nothing, unless it waits for its node-id.
    fn hears_lss(&self) -> bool {
        self.state != NmtState::BOOT_UP || self.node.is_none()
    }

    fn handle_time_stamp(&mut self, data: &[u8]) {
        match TimeOfDay::parse(data) {
            Ok(time) => self.time = time,
            Err(_) => self.statistics.malformed += 1,
        }
    }

    fn handle_sdo(&mut self, now: MonotonicTime, data: &[u8]) {
        if !self.state.has_sdo() {
            return;
        }
        let mut gate = Gate {
            dictionary: &mut self.dictionary,
            application: &mut self.application,
            rpdos: &mut self.rpdos,
            tpdos: &mut self.tpdos,
            consumers: &mut self.consumers,
        };
        if self.server.handle(now, data, &mut gate).is_err() {
            self.statistics.malformed += 1;
        }
    }

    fn handle_heartbeat(&mut self, now: MonotonicTime, node: NodeId, data: &[u8]) {
        if Heartbeat::parse(data).is_err() {
            self.statistics.malformed += 1;
        } else if let Change::Back(node) = self.consumers.heard(node.get(), now) {
            self.errors.clear(ErrorCode::HEARTBEAT, node, &mut self.dictionary);
        }
    }

    /// The next frame to send.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        if let Some(frame) = self.waiting.pop_front() {
            return Some(frame);
        }
        if let Some(answer) = self.lss.poll() {
            return Some(wire::frame(cob_id::LSS_RESPONSE, &answer));
        }
        let node = self.node.filter(|_| self.state.has_sdo())?;
        let emcy = CobId(u32::try_from(self.dictionary.number(objects::COB_ID_EMCY, 0)).unwrap_or(u32::MAX));
        if let Some(message) = self.errors.poll(now, &self.dictionary)
            && emcy.is_valid()
        {
            return Some(wire::frame(emcy.id(), &message.emit()));
        }
        let answer = self.server.poll(now)?;
        Some(wire::frame(cob_id::sdo_response(node), &answer))
    }

    fn send(&mut self, id: Id, data: &[u8]) {
        if self.waiting.len() < WAITING_MAX {
            self.waiting.push_back(wire::frame(id, data));
        } else {
            self.statistics.lost += 1;
        }
    }

    /// Whether only this node may send frames with this identifier.
    fn is_mine(&self, id: Id) -> bool {
        let Some(own) = self.node else { return false };
        let emcy = CobId(u32::try_from(self.dictionary.number(objects::COB_ID_EMCY, 0)).unwrap_or(u32::MAX));
        id == cob_id::error_control(own)
            || id == cob_id::sdo_response(own)
            || emcy.is_valid() && id == emcy.id()
            || self.tpdos.iter().any(|pdo| pdo.valid && pdo.id == id)
    }

    fn handle_guarding(&mut self, now: MonotonicTime, id: Id) {
        let Some(node) = self.node.filter(|_| self.state != NmtState::BOOT_UP) else { return };
        if id != cob_id::error_control(node) {
            return;
        }
        if let Some((answer, back)) = self.guarding.request(now, self.state, &self.dictionary) {
            if back {
                self.errors.clear(ErrorCode::HEARTBEAT, COMMUNICATION, &mut self.dictionary);
            }
            self.send(id, &answer.emit());
        }
    }

    fn handle_nmt(&mut self, now: MonotonicTime, data: &[u8]) {
        match Nmt::parse(data) {
            Ok(nmt) if nmt.node.is_none() || nmt.node == self.node => {
                let (state, effect) = nmt::obey(self.state, nmt.command);
                self.apply(now, state, effect);
            }
            Ok(_) => {}
            Err(_) => self.statistics.malformed += 1,
        }
    }

    fn handle_lss(&mut self, now: MonotonicTime, data: &[u8]) {
        match self.lss.handle(data) {
            // With a node-id, another one counts from the next reset of the communication on.
            Ok(Some(SlaveEvent::NodeId(node))) if self.node.is_none() && node.is_some() => {
                self.dictionary.reset(Group::Communication);
                self.restart(now);
            }
            // The simulated device keeps its node-id as long as it lives; its bit rate is that of its interface.
            Ok(_) => {}
            Err(_) => self.statistics.malformed += 1,
        }
    }

    fn apply(&mut self, now: MonotonicTime, state: NmtState, effect: Effect) {
        self.state = state;
        match effect {
            Effect::None => {}
            Effect::Start => {
                self.rpdos.iter_mut().chain(&mut self.tpdos).for_each(Pdo::start);
                (self.last_sync, self.sync_lost) = (None, false);
            }
            Effect::Leave => self.lose_connection(),
            Effect::ResetNode => {
                self.dictionary.reset(Group::All);
                self.application.event(Event::Reset, &mut self.dictionary);
                while self.application.poll_report().is_some() {}
                self.errors = Errors::default();
                self.restart(now);
            }
            Effect::ResetCommunication => {
                self.lose_connection();
                self.dictionary.reset(Group::Communication);
                self.restart(now);
                self.errors.restart(&mut self.dictionary);
            }
        }
    }

    /// What both resets have in common.
    fn restart(&mut self, now: MonotonicTime) {
        self.state = NmtState::BOOT_UP;
        // A node-id that LSS has set counts from now on.
        if self.node != self.lss.node() {
            self.node = self.lss.node();
            self.dictionary.set_node(self.node);
        }
        self.lss.reset();
        self.boot_at = self.node.map(|_| now + self.config.boot_time);
        self.server.reset();
        self.waiting.clear();
        self.guarding = Guarding::default();
        self.consumers = Consumers::default();
        self.consumers.refresh(&self.dictionary);
        for pdo in self.rpdos.iter_mut().chain(&mut self.tpdos) {
            pdo.refresh(&self.dictionary);
            pdo.start();
        }
        (self.last_sync, self.sync_lost) = (None, false);
    }

    fn boot(&mut self, now: MonotonicTime) {
        let Some(node) = self.node else { return };
        if self.state == NmtState::BOOT_UP && self.boot_at.is_some_and(|at| now >= at) {
            self.boot_at = None;
            self.state = NmtState::PRE_OPERATIONAL;
            self.heartbeat_at = now;
            self.send(cob_id::error_control(node), &Heartbeat::new(NmtState::BOOT_UP).emit());
        }
    }

    fn lose_connection(&mut self) {
        self.application.event(Event::ConnectionLost, &mut self.dictionary);
    }

    /// A communication error: the application is told, and 1029h:1 says what else.
    fn fail(&mut self, now: MonotonicTime) {
        self.lose_connection();
        let behaviour = self.dictionary.number(objects::ERROR_BEHAVIOR, 1);
        let (state, effect) = nmt::fail(self.state, behaviour);
        if state != self.state {
            self.apply(now, state, effect);
        }
    }

    /// Heartbeats of others, requests of node guarding, deadlines of RPDOs and SYNC.
    fn watch(&mut self, now: MonotonicTime) {
        while let Change::Lost(node) = self.consumers.poll(now) {
            self.errors.raise(ErrorCode::HEARTBEAT, node, &mut self.dictionary);
            self.fail(now);
        }
        if self.state != NmtState::BOOT_UP && self.guarding.misses(now, &self.dictionary) {
            self.errors.raise(ErrorCode::HEARTBEAT, COMMUNICATION, &mut self.dictionary);
            self.fail(now);
        }
        if !self.state.has_pdo() {
            return;
        }
        for number in 0..self.rpdos.len() {
            if self.rpdos[number].valid && self.rpdos[number].is_late(now) {
                self.errors.raise(ErrorCode::RPDO_TIME_OUT, source(number), &mut self.dictionary);
                self.fail(now);
            }
        }
        let period = DurationNs::from_micros(self.dictionary.number(objects::COMMUNICATION_CYCLE_PERIOD, 0));
        let silence = self.last_sync.map_or(DurationNs::ZERO, |last| now.since(last));
        if period > DurationNs::ZERO && silence.0 > i64::from(self.sync_cycles) * period.0 && !self.sync_lost
        {
            self.sync_lost = true;
            self.application.event(Event::SyncLost, &mut self.dictionary);
        }
    }

    /// What the node says by itself: heartbeats, errors, PDOs whose objects have changed.
    fn tell(&mut self, now: MonotonicTime) {
        while let Some(report) = self.application.poll_report() {
            if report.active {
                self.errors.raise(report.code, report.source, &mut self.dictionary);
            } else {
                self.errors.clear(report.code, report.source, &mut self.dictionary);
            }
        }
        let Some(node) = self.node.filter(|_| self.state != NmtState::BOOT_UP) else { return };
        let period = DurationNs::from_millis(self.dictionary.number(objects::PRODUCER_HEARTBEAT_TIME, 0));
        if period > DurationNs::ZERO && now.since(self.heartbeat_at) >= period {
            // On the grid of its period, unless it was not called for longer.
            let next = self.heartbeat_at + period;
            self.heartbeat_at = if now.since(next) < period { next } else { now };
            self.send(cob_id::error_control(node), &Heartbeat::new(self.state).emit());
        }
        if !self.state.has_pdo() {
            return;
        }
        self.send_tpdos(|pdo, dictionary| pdo.event(now, dictionary));
    }

    /// Sends the valid TPDOs for which `due` gives bytes.
    fn send_tpdos(&mut self, mut due: impl FnMut(&mut Pdo, &Dictionary) -> Option<[u8; PDO_LEN_MAX]>) {
        for number in 0..self.tpdos.len() {
            let pdo = &mut self.tpdos[number];
            if !pdo.valid {
                continue;
            }
            let (id, len) = (pdo.id, pdo.len());
            if let Some(bytes) = due(pdo, &self.dictionary) {
                self.statistics.tpdos += 1;
                self.send(id, &bytes[..len]);
            }
        }
    }

    fn handle_sync(&mut self, now: MonotonicTime, data: &[u8]) {
        let counts = self.dictionary.number(objects::SYNC_OVERFLOW, 0) != 0;
        let sync = match Sync::parse(data) {
            Ok(sync) if sync.counter.is_some() == counts => sync,
            _ => {
                self.statistics.malformed += 1;
                self.errors.raise(ErrorCode::SYNC_LENGTH, COMMUNICATION, &mut self.dictionary);
                return;
            }
        };
        self.errors.clear(ErrorCode::SYNC_LENGTH, COMMUNICATION, &mut self.dictionary);
        self.statistics.syncs += 1;
        self.last_sync = Some(now);
        self.sync_lost = false;
        if let Some(stepped) = self.stepped.filter(|stepped| *stepped < now) {
            self.application.step(now.since(stepped), &mut self.dictionary);
            self.stepped = Some(now);
        }
        if !self.state.has_pdo() {
            return;
        }
        self.send_tpdos(|pdo, dictionary| pdo.sync(sync.counter, dictionary));
        for pdo in self.rpdos.iter_mut().filter(|pdo| pdo.valid && pdo.transmission.is_synchronous()) {
            pdo.apply(&mut self.dictionary);
        }
        self.application.commanded(&mut self.dictionary);
        self.application.event(Event::Sync, &mut self.dictionary);
    }

    fn handle_rpdo(&mut self, now: MonotonicTime, id: Id, data: &[u8]) {
        let Some(number) = self.rpdos.iter().position(|pdo| pdo.valid && pdo.id == id) else { return };
        let (pdo, source) = (&mut self.rpdos[number], source(number));
        if data.len() < pdo.len() {
            self.statistics.malformed += 1;
            self.errors.raise(ErrorCode::PDO_TOO_SHORT, source, &mut self.dictionary);
            return;
        }
        self.errors.clear(ErrorCode::PDO_TOO_SHORT, source, &mut self.dictionary);
        if data.len() > pdo.len() {
            self.statistics.malformed += 1;
            self.errors.raise(ErrorCode::PDO_TOO_LONG, source, &mut self.dictionary);
        } else {
            self.errors.clear(ErrorCode::PDO_TOO_LONG, source, &mut self.dictionary);
        }
        let window = DurationNs::from_micros(self.dictionary.number(objects::SYNCHRONOUS_WINDOW_LENGTH, 0));
        let since = self.last_sync.map_or(DurationNs::ZERO, |last| now.since(last));
        if pdo.transmission.is_synchronous() && window > DurationNs::ZERO && since > window {
            self.statistics.late_rpdos += 1;
            return;
        }
        self.statistics.rpdos += 1;
        self.errors.clear(ErrorCode::RPDO_TIME_OUT, source, &mut self.dictionary);
        if pdo.receive(now, data) && pdo.apply(&mut self.dictionary) {
            self.application.commanded(&mut self.dictionary);
        }
    }
}

/// Source of an error of an RPDO: its place, from 1.
fn source(number: usize) -> u8 {
    u8::try_from(number + 1).unwrap_or(u8::MAX)
}

#[cfg(test)]
pub(crate) mod tests;
