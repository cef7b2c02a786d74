//! The slave role: phases, service channel server, parameters, cyclic data, and a simulated drive behind it.
//!
//! A [`Slave`] sits between two ports. Every frame that comes in goes through [`Slave::handle_frame`], which
//! takes what is for this slave, puts in what is from it, and says where the frame goes on. [`Network`] joins
//! slaves. The function-specific profile behind the communication is an [`Application`]; [`drive::Drive`] is
//! one.
//!
//! Nothing is allocated after a slave is built.

pub mod application;
pub mod communication;
pub mod configuration;
pub mod connection;
mod core;
mod cyclic;
mod diagnosis;
pub mod drive;
mod hot_plug;
mod network;
pub mod parameter;
pub mod phase;
mod scan;
pub mod service_channel;
pub mod topology;

use profile_generic::time::{DurationNs, MonotonicTime};

pub use self::application::{Application, Cycle, Diagnosis};
pub use self::core::Core;
pub use self::network::{Network, STRANGER};
pub use crate::port::Port;

use self::communication::{FixedConnection, Identity};
use self::core::Access;
use self::hot_plug::Joining;
use self::parameter::Store;
use self::phase::{Event, Fault, State};
use self::service_channel::Server;
use self::topology::Ports;
use crate::wire::cp0::CommunicationVersion;
use crate::wire::cp12;
use crate::wire::device_control::DeviceControl;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{HEADER_LEN, Header, Kind, Phase};
use crate::wire::idn::Idn;
use crate::wire::scp::ScpEntry;
use crate::wire::svc::MdtSvc;

/// Silence after which a slave leaves CP0 to CP2, and CP3 or CP4 while a switch down is announced. No public
/// figure is known; it has to be longer than the 120 ms pause of a phase switch.
pub const MST_TIMEOUT: DurationNs = DurationNs::from_millis(500);

/// How often the application is called without communication.
pub const NRT_PERIOD: DurationNs = DurationNs::from_millis(10);

/// Where a frame goes after a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Forward {
    /// Out of the other port.
    Through,
    /// Back out of the port it came from: this slave is the end of the line.
    Back,
    /// Both: back, and a copy out of the port where the line ends.
    BackAndThrough,
    /// It ends here.
    Nowhere,
}

/// What a slave is built with.
#[derive(Debug, Clone)]
pub struct Config {
    /// SERCOS address, 0..=511; 0 = none set.
    pub address: u16,
    /// Hardware address.
    pub mac: [u8; 6],
    /// Connections, S-0-1050.0 upwards; 1..=8.
    pub connections: u8,
    /// Serial number.
    pub serial: u32,
    /// What the slave says about itself.
    pub identity: Identity,
    /// Communication classes and versions, S-0-1000.
    pub classes: &'static [ScpEntry],
    /// Connections that cannot be configured, of a slave with SCP_FixCFG; empty for SCP_VarCFG.
    pub fixed: &'static [FixedConnection],
}

impl Default for Config {
    fn default() -> Self {
        Config {
            address: 1,
            mac: [2, 0, 0, 0, 0, 1],
            connections: 4,
            serial: 1,
            identity: Identity::default(),
            classes: communication::CLASSES,
            fixed: &[],
        }
    }
}

/// The cycle that is going on, to tell the second copy of a telegram (ring) from the first.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    /// Phase byte of its MST.
    phase: u8,
    /// MDTs taken, one bit each.
    mdts: u8,
    /// The application has had its cycle.
    acted: bool,
}

/// A SERCOS III slave with its application.
#[derive(Debug)]
pub struct Slave<A> {
    core: Core,
    svc: Server,
    app: A,
    ports: Ports,
    joining: Joining,
    version: CommunicationVersion,
    topology_address: u16,
    /// Cycles of CP0 since a P telegram gave the topology address.
    address_age: u8,
    round: Round,
    last_cycle: MonotonicTime,
    /// Losses in a row before the last MST came.
    losses: u32,
    shown: u32,
}

impl<A: Application> Slave<A> {
    /// A slave in NRT with both ports unconnected.
    pub fn new(config: &Config, mut app: A) -> Self {
        let mut store = Store::new();
        communication::define(&mut store, config);
        app.define(&mut store);
        communication::define_lists(&mut store);
        let svc = Server::new(&store);
        let mut slave = Slave {
            core: Core::new(store),
            svc,
            app,
            ports: Ports::new(),
            joining: Joining::new(config.classes),
            version: CommunicationVersion::empty(),
            topology_address: 0,
            address_age: u8::MAX,
            round: Round::default(),
            last_cycle: MonotonicTime::ZERO,
            losses: 0,
            shown: 0,
        };
        slave.show_diagnosis();
        slave
    }

    /// The parameters.
    pub fn store(&self) -> &Store {
        &self.core.store
    }

    /// The parameters, to change them from inside the slave.
    pub fn store_mut(&mut self) -> &mut Store {
        &mut self.core.store
    }

    /// Sets a number as the one who set the machine up has left it in the slave, past its limits and phases.
    pub fn preset(&mut self, idn: Idn, value: i64) {
        self.core.store.set_number_of(idn, value);
        self.app.written(idn, &mut self.core.store);
    }

    /// What runs on the slave.
    pub fn application(&self) -> &A {
        &self.app
    }

    /// The application, to act on it from outside.
    pub fn application_mut(&mut self) -> &mut A {
        &mut self.app
    }

    /// Where the slave stands.
    pub fn state(&self) -> State {
        self.core.state
    }

    /// Why SERCOS communication ended last; `None` once it has been reset by S-0-0099.
    pub fn fault(&self) -> Option<Fault> {
        self.core.fault
    }

    /// Topology address of the last scan; 0 before the first one.
    pub fn topology_address(&self) -> u16 {
        self.topology_address
    }

    /// The IDN that is open in the service channel.
    pub fn open_idn(&self) -> Option<Idn> {
        self.svc.open_idn(&self.core.store)
    }

    /// Tells whether a port has a link. A slave that loses one turns telegrams round at once.
    pub fn set_link(&mut self, port: Port, up: bool) {
        self.ports.set_link(port, up);
    }

    /// Sets the cycles which it takes to carry a topology command of C-DEV out; 0 after a new slave.
    pub fn set_command_delay(&mut self, cycles: u8) {
        self.ports.set_delay(cycles);
    }

    /// Its ports, and how it passes telegrams on.
    pub fn ports(&self) -> &Ports {
        &self.ports
    }

    /// Starts anew in NRT, as after power-up. Parameters stay as they are.
    pub fn restart(&mut self) {
        self.core.state = State::Nrt;
        self.core.fault = None;
        self.core.connection_failed = false;
        self.enter_nrt(false);
        self.show_diagnosis();
    }

    /// When [`handle_time`](Self::handle_time) has something to do unless a frame comes before.
    pub fn wake_at(&self) -> MonotonicTime {
        match self.core.state {
            State::Nrt => self.last_cycle + NRT_PERIOD,
            _ => self.core.last_mst + self.silence_max() + DurationNs(1),
        }
    }

    /// Looks after time-outs, and after the application where there are no cycles.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        let idle = now.since(self.last_cycle);
        let silent = now.since(self.core.last_mst) > MST_TIMEOUT;
        if self.core.state == State::Nrt && self.ports.is_end() && silent {
            self.ports.stop(false);
        }
        if self.core.state == State::Nrt && idle >= NRT_PERIOD {
            self.act(now, idle, false);
        } else if self.core.state != State::Nrt && now.since(self.core.last_mst) > self.silence_max() {
            self.advance(Event::MstTimeout);
            let elapsed = now.since(self.last_cycle);
            self.act(now, elapsed, false);
        }
    }

    /// Takes a frame that came in on `port` and changes it as it passes.
    pub fn handle_frame(&mut self, now: MonotonicTime, port: Port, frame: &mut [u8]) -> Forward {
        self.handle_time(now);
        if Header::parse_unchecked(frame).is_err() {
            // Another EtherType is no error: it belongs to the unified communication channel.
            return self.ports.pass(port);
        }
        let Ok(header) = Header::parse(frame) else {
            self.count_port_error(port);
            return self.ports.forward(port, None, self.forwards_at_end());
        };
        let channel = header.telegram.channel();
        if self.ports.is_inactive(port) {
            self.ports.hear(now, channel);
            return Forward::Nowhere;
        }
        let scan = header.phase.phase() == Phase::CP0 && !header.phase.switching();
        if scan && header.telegram.is_mst() && self.core.state != State::In(Phase::CP0) {
            self.ports.start(port, channel);
        }
        if let Some(entry) = self.ports.entry(channel) {
            let data = &mut frame[HEADER_LEN..];
            match header.telegram.kind() {
                Kind::Mdt if entry == port => self.handle_mdt(now, &header, data),
                Kind::Mdt => {}
                Kind::At => self.handle_at(now, &header, entry == port, data),
            }
        } else if header.telegram.is_mst() && header.phase.phase() == Phase::CP4 && !header.phase.switching()
        {
            self.listen(port, channel, header.phase, &frame[HEADER_LEN..]);
            self.core.last_mst = now;
        }
        self.ports.forward(port, Some(channel), self.forwards_at_end())
    }

    /// The end of a line sends telegrams on, so that the other end of a broken ring sees them.
    fn forwards_at_end(&self) -> bool {
        !self.version.contains(CommunicationVersion::NO_FORWARD_AT_END)
    }

    /// Permitted silence of the master.
    fn silence_max(&self) -> DurationNs {
        match (self.core.state, &self.core.configuration) {
            (
                State::In(Phase::CP3 | Phase::CP4) | State::Switching(Phase::CP3, Phase::CP4),
                Some(configuration),
            ) => {
                let cycle = i64::from(configuration.cycle_ns);
                // Half a cycle more than the permitted losses need: jitter is no loss.
                DurationNs(cycle * (i64::from(configuration.mst_losses) + 1) + cycle / 2)
            }
            _ => MST_TIMEOUT,
        }
    }

    fn count_port_error(&mut self, port: Port) {
        if let Some(handle) = self.core.store.find(Idn::ERROR_COUNTER_PORT_1_AND_PORT_2) {
            let data = self.core.store.get(handle).data();
            let mut counts = [0; 4];
            counts.copy_from_slice(&data[..4]);
            let at = 2 * port.index();
            let count = u16::from_le_bytes([counts[at], counts[at + 1]]).saturating_add(1);
            counts[at..at + 2].copy_from_slice(&count.to_le_bytes());
            self.core.store.set_data(handle, &counts);
        }
    }

    fn handle_mdt(&mut self, now: MonotonicTime, header: &Header, data: &[u8]) {
        let number = header.telegram.number();
        if header.telegram.is_mst() {
            let copy = self.core.state != State::Nrt
                && self.round.phase == header.phase.0
                && self.round.mdts & 1 != 0
                && now.since(self.core.last_mst) < self.cycle_time();
            if !copy {
                self.handle_mst(now, header);
            }
        }
        if number > 3 || self.round.phase != header.phase.0 || self.round.mdts & 1 << number != 0 {
            return;
        }
        self.round.mdts |= 1 << number;
        match self.core.state.phase() {
            Some(Phase::CP0) => self.scan_mdt(number, data),
            Some(Phase::CP1 | Phase::CP2) => self.slots_mdt(number, data),
            Some(Phase::CP3 | Phase::CP4) => self.cyclic_mdt(number, data),
            _ if matches!(self.core.state, State::Joining(_)) => self.joining_mdt(number, data),
            _ => {}
        }
    }

    fn handle_at(&mut self, now: MonotonicTime, header: &Header, outward: bool, data: &mut [u8]) {
        let number = header.telegram.number();
        if self.round.phase != header.phase.0 || number > 3 {
            return;
        }
        if outward && !self.round.acted {
            self.round.acted = true;
            let elapsed = match self.core.state.phase() {
                Some(Phase::CP3 | Phase::CP4) => {
                    DurationNs(self.cycle_time().0.saturating_mul(1 + i64::from(self.losses)))
                }
                _ => now.since(self.last_cycle),
            };
            self.act(now, elapsed, true);
        }
        match self.core.state {
            State::Nrt => {}
            State::Joining(_) if outward => self.joining_at(number, data),
            State::In(Phase::CP0) => self.scan_at(number, outward, data),
            State::In(Phase::CP1 | Phase::CP2) if outward => self.slots_at(number, data),
            State::In(Phase::CP3 | Phase::CP4) | State::Switching(Phase::CP3, _) => {
                self.cyclic_at(number, outward, data);
            }
            State::Switching(Phase::CP4, _) if outward => self.cyclic_at(number, outward, data),
            _ => {}
        }
    }

    /// A new cycle begins: losses, phase.
    fn handle_mst(&mut self, now: MonotonicTime, header: &Header) {
        let silence = now.since(self.core.last_mst);
        let cyclic = matches!(self.core.state, State::In(Phase::CP3 | Phase::CP4));
        self.losses = 0;
        if cyclic {
            let cycle = self.cycle_time().0.max(1);
            self.losses = u32::try_from((silence.0 - cycle / 2) / cycle).unwrap_or(0);
            let total = self.core.store.number_of(Idn::MST_ERROR_COUNTER) + i64::from(self.losses);
            self.core.store.set_number_of(Idn::MST_ERROR_COUNTER, total);
        }
        self.core.last_mst = now;
        self.round = Round { phase: header.phase.0, mdts: 0, acted: false };
        self.address_age = self.address_age.saturating_add(1);
        self.advance(Event::Mst(header.phase));
        self.finish_joining();
    }

    fn cycle_time(&self) -> DurationNs {
        match &self.core.configuration {
            Some(configuration) if self.core.state.phase() >= Some(Phase::CP3) => {
                DurationNs(i64::from(configuration.cycle_ns))
            }
            _ if matches!(self.core.state, State::Joining(_)) => {
                DurationNs(self.core.store.number_of(Idn::CYCLE_TIME))
            }
            // Shortest cycle of CP0 to CP2.
            _ => DurationNs::from_millis(1),
        }
    }

    /// Applies a phase event.
    fn advance(&mut self, event: Event) {
        let before = self.core.state;
        let transition = before.next(event, self.core.conditions);
        self.core.state = transition.next;
        if let Some(fault) = transition.fault {
            let phase = i64::from(before.phase().map_or(0, |phase| phase.0));
            let status = phase | i64::from(fault.interface_status().0);
            self.core.fault = Some(fault);
            self.core.store.set_number_of(Idn::INTERFACE_STATUS, status);
        }
        match (before, transition.next) {
            (before, after) if before == after => {}
            (_, State::Nrt) => self.enter_nrt(event != Event::MstTimeout),
            (_, State::In(phase)) if before.phase() != Some(phase) => self.enter(phase),
            _ => {}
        }
    }

    fn enter_nrt(&mut self, heard: bool) {
        self.svc.reset();
        self.core.clear_commands(&mut self.app);
        self.core.configuration = None;
        self.ports.stop(heard);
        self.joining.forget();
        self.round = Round::default();
    }

    fn enter(&mut self, phase: Phase) {
        self.ports.reset_toggle();
        match phase {
            Phase::CP0 => {
                self.svc.reset();
                self.core.clear_commands(&mut self.app);
                self.core.configuration = None;
                self.core.device_control = DeviceControl::empty();
                self.topology_address = 0;
                self.address_age = u8::MAX;
            }
            Phase::CP1 => self.ports.hold(),
            Phase::CP2 => self.core.conditions.cp3_checked = false,
            Phase::CP3 => self.core.conditions.cp4_checked = false,
            Phase::CP4 => self.start_connections(),
            _ => {}
        }
    }

    /// Lets the application and the procedure commands act, and brings the diagnosis up to date.
    fn act(&mut self, now: MonotonicTime, elapsed: DurationNs, telegram: bool) {
        let fresh = telegram && self.consume();
        let connected = self.core.state == State::In(Phase::CP4) && self.consumers_deliver();
        self.last_cycle = now;
        let cycle = Cycle { now, elapsed, state: self.core.state, connected, fresh };
        self.app.cycle(cycle, &mut self.core.store);
        self.core.poll_commands(&mut self.app);
        self.show_diagnosis();
    }

    /// C-DEV of this cycle.
    fn handle_device_control(&mut self, word: u16) {
        let control = DeviceControl::from_bits_retain(word);
        self.ports.command(control);
        self.core.device_control = control;
        self.core.store.set_number_of(Idn::DEVICE_CONTROL, i64::from(word));
        if control.contains(DeviceControl::MASTER_VALID) {
            self.svc.set_valid();
        }
    }

    /// S-DEV of this cycle.
    fn device_status(&mut self) -> DeviceStatus {
        let diagnosis = self.app.diagnosis();
        let mut status = self.ports.status(self.core.last_mst, self.cycle_time());
        status.set(DeviceStatus::SLAVE_VALID, !self.core.state.is_switching());
        status.set(DeviceStatus::COMMAND_CHANGE, self.core.command_changed());
        status.set(DeviceStatus::CONNECTION_ERROR, self.core.connection_failed);
        status.set(DeviceStatus::DEVICE_ERROR, diagnosis.errors != 0 || self.communication_error());
        status.set(DeviceStatus::DEVICE_WARNING, diagnosis.warnings != 0 || self.loss_warning());
        status.set(DeviceStatus::COMMUNICATION_WARNING, self.loss_warning());
        self.core.store.set_number_of(Idn::DEVICE_STATUS, i64::from(status.bits()));
        status
    }

    /// MDT of CP1 and CP2.
    fn slots_mdt(&mut self, number: u8, data: &[u8]) {
        let Some(place) = cp12::place(self.topology_address) else { return };
        if place.telegram != number || data.len() < cp12::LEN {
            return;
        }
        self.handle_device_control(u16::from_le_bytes([data[place.device], data[place.device + 1]]));
        self.handle_svc(&data[place.svc..]);
    }

    /// AT of CP1 and CP2.
    fn slots_at(&mut self, number: u8, data: &mut [u8]) {
        let Some(place) = cp12::place(self.topology_address) else { return };
        if place.telegram != number || data.len() < cp12::LEN {
            return;
        }
        let status = self.device_status();
        data[place.device..place.device + 2].copy_from_slice(&status.bits().to_le_bytes());
        // The slot is inside the telegram, so that writing it cannot fail.
        let _ = self.svc.answer().emit(&mut data[place.svc..]);
    }

    fn handle_svc(&mut self, slot: &[u8]) {
        if let Ok(slot) = MdtSvc::parse(slot) {
            self.svc.handle(slot, &mut Access { core: &mut self.core, app: &mut self.app });
        }
    }
}
