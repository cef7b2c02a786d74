//! The slave role: a group 2 only server of the predefined master/slave connection set.
//!
//! [`Slave`] has the network access, the connections and the objects that every slave has; the rest is an
//! [`Application`].
//!
//! ```text
//! loop {
//!     hand every frame to handle_frame()
//!     while let Some(frame) = poll(now) { send it }
//!     while let Some(event) = poll_event() { .. }
//!     wait until wake_at() or a frame
//! }
//! ```

pub mod allocation;
pub mod application;
pub mod event;
mod explicit;
mod io;
pub mod motion_drive;
mod objects;
pub mod speed_drive;

use std::collections::VecDeque;

use profile_generic::can::Frame;
use profile_generic::time::MonotonicTime;

use self::allocation::Allocation;
use self::application::Application;
use self::event::SlaveEvent;
use self::explicit::ExplicitServer;
use self::io::ChangeOfState;
use super::access::{AccessEvent, AccessState, NetworkAccess};
use super::connection::{Change, Connection, ConnectionEvent, ConnectionKind, ConnectionState};
use super::fragmentation::IoReceiver;
use super::link::{self, Refusal};
use super::wire::{AllocationChoice, BodyFormat, DuplicateMac, Identifier, MacId};
use crate::device::config::IdentityConfig;
use crate::wire::status::GeneralStatus;

/// Frames kept until they are taken: what one call can bring about.
const FRAMES_MAX: usize = 64;

/// Events kept until they are taken; later ones are dropped.
const EVENTS_MAX: usize = 256;

/// What a slave is told before it starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlaveConfig {
    /// Its MAC ID.
    pub mac: MacId,
    /// Data rate: 0 125, 1 250, 2 500 kbit/s. Only shown in the DeviceNet object.
    pub rate: u8,
    /// After bus off it goes through the duplicate MAC ID check again, and otherwise stays off (BOI).
    pub bus_off_reset: bool,
    /// Who it is.
    pub identity: IdentityConfig,
    /// Expected packet rates are rounded up to multiples of this, ms; 1 at least.
    pub rate_resolution_ms: u16,
    /// Widths of class and instance in requests.
    pub body_format: BodyFormat,
}

/// A group 2 only server around an application.
#[derive(Debug)]
pub struct Slave<A> {
    config: SlaveConfig,
    application: A,
    access: NetworkAccess,
    bus_offs: u8,
    master: Option<MacId>,
    acknowledged: bool,
    connections: [Connection; 4],
    explicit: ExplicitServer,
    receivers: [IoReceiver; 4],
    change_of_state: ChangeOfState,
    frames: VecDeque<Frame>,
    events: VecDeque<SlaveEvent>,
    /// The node starts anew once what is to be sent has gone, with this MAC ID.
    restart: bool,
    next_mac: Option<MacId>,
    /// An I/O connection has timed out, and nobody has taken the slave since.
    timed_out: bool,
}

impl<A: Application> Slave<A> {
    /// A slave that is off: [`Slave::start`] begins.
    #[must_use]
    pub fn new(config: SlaveConfig, application: A) -> Self {
        let access = NetworkAccess::new(config.identity.vendor, config.identity.serial_number);
        let connections =
            ConnectionKind::ALL.map(|kind| Connection::new(kind, config.mac, config.rate_resolution_ms));
        Self {
            config,
            application,
            access,
            bus_offs: 0,
            master: None,
            acknowledged: true,
            connections,
            explicit: ExplicitServer::default(),
            receivers: Default::default(),
            change_of_state: ChangeOfState::default(),
            frames: VecDeque::with_capacity(FRAMES_MAX),
            events: VecDeque::with_capacity(EVENTS_MAX),
            restart: false,
            next_mac: None,
            timed_out: false,
        }
    }

    /// Switches the node on, or starts it anew: the duplicate MAC ID check begins.
    pub fn start(&mut self, now: MonotonicTime) {
        self.drop_connections(now);
        self.frames.clear();
        self.timed_out = false;
        self.restart = false;
        let mac = self.next_mac.take().unwrap_or(self.config.mac);
        self.config.mac = mac;
        self.connections = self
            .connections
            .clone()
            .map(|connection| Connection::new(connection.kind(), mac, self.config.rate_resolution_ms));
        self.access.event(AccessEvent::Begin);
    }

    /// The CAN controller has left the bus.
    pub fn handle_bus_off(&mut self, now: MonotonicTime) {
        self.bus_offs = self.bus_offs.saturating_add(1);
        self.drop_connections(now);
        self.frames.clear();
        self.access.event(AccessEvent::BusOff { reset: self.config.bus_off_reset });
        self.tell(SlaveEvent::BusOff);
    }

    /// Its configuration, as services have changed it.
    #[must_use]
    pub const fn config(&self) -> &SlaveConfig {
        &self.config
    }

    /// What stands behind it.
    #[must_use]
    pub const fn application(&self) -> &A {
        &self.application
    }

    /// What stands behind it, to be set from outside.
    pub const fn application_mut(&mut self) -> &mut A {
        &mut self.application
    }

    /// Where the network access is.
    #[must_use]
    pub const fn access(&self) -> AccessState {
        self.access.state()
    }

    /// The connection of this kind, allocated or not.
    #[must_use]
    pub const fn connection(&self, kind: ConnectionKind) -> &Connection {
        &self.connections[kind.index()]
    }

    /// MAC ID of the master that has allocated it; `None` while nobody has.
    #[must_use]
    pub const fn master(&self) -> Option<MacId> {
        self.master
    }

    fn connection_mut(&mut self, kind: ConnectionKind) -> &mut Connection {
        &mut self.connections[kind.index()]
    }

    fn tell(&mut self, event: SlaveEvent) {
        if self.events.len() < EVENTS_MAX {
            self.events.push_back(event);
        }
    }

    fn send(&mut self, identifier: Identifier, data: &[u8]) {
        if let Some(frame) = link::frame(identifier, data)
            && self.frames.len() < FRAMES_MAX
        {
            self.frames.push_back(frame);
        }
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<SlaveEvent> {
        self.events.pop_front()
    }

    /// Takes a frame from the network.
    ///
    /// # Errors
    /// It was not used; if it was meant for this slave, the reason is an event as well.
    pub fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) -> Result<(), Refusal> {
        let (identifier, data) = link::accept(frame)?;
        let outcome = self.dispatch(now, identifier, data);
        if let Err(refusal) = outcome
            && !matches!(refusal, Refusal::NotForUs(_) | Refusal::Offline | Refusal::DuplicateMac { .. })
        {
            self.tell(SlaveEvent::Refused(refusal));
        }
        outcome
    }

    fn dispatch(&mut self, now: MonotonicTime, identifier: Identifier, data: &[u8]) -> Result<(), Refusal> {
        let mac = self.config.mac;
        if identifier == Identifier::DuplicateMacCheck(mac) {
            return self.check_duplicate(now, identifier, data);
        }
        if !self.access.is_online() {
            return Err(Refusal::Offline);
        }
        match identifier {
            Identifier::UnconnectedRequest(to) if to == mac => self.handle_unconnected(now, identifier, data),
            Identifier::ExplicitRequest(to) if to == mac => self.handle_explicit(now, identifier, data),
            Identifier::PollCommand(to) if to == mac => self.handle_poll(now, identifier, data),
            Identifier::BitStrobeCommand(from) if self.master == Some(from) => {
                self.handle_strobe(now, identifier, data)
            }
            Identifier::Acknowledge(to) if to == mac => self.handle_acknowledge(identifier),
            _ => Err(Refusal::NotForUs(identifier)),
        }
    }

    fn check_duplicate(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        data: &[u8],
    ) -> Result<(), Refusal> {
        let message = DuplicateMac::parse(data).map_err(|error| Refusal::Malformed(identifier, error))?;
        if !self.access.handle(&message) {
            return Ok(());
        }
        let (mac, vendor, serial) = (self.config.mac, message.vendor, message.serial);
        self.drop_connections(now);
        self.frames.clear();
        self.tell(SlaveEvent::DuplicateMac { mac, vendor, serial });
        Err(Refusal::DuplicateMac { mac, vendor, serial })
    }

    /// Lets time pass and gives the next frame to be sent.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        if self.frames.is_empty() {
            self.handle_time(now);
        }
        self.frames.pop_front()
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        if self.restart {
            // The answer that said so has gone out.
            self.start(now);
        }
        let was_online = self.access.is_online();
        if let Some(message) = self.access.poll(now) {
            let mut data = [0; super::wire::duplicate_mac::LEN];
            if message.emit(&mut data).is_ok() {
                self.send(Identifier::DuplicateMacCheck(self.config.mac), &data);
            }
        }
        if !was_online && self.access.is_online() {
            self.tell(SlaveEvent::Online);
        }
        for kind in ConnectionKind::ALL {
            let io = self.is_io_established();
            if let Some(change) = self.connection_mut(kind).handle_time(now, io) {
                self.timed_out |= kind.is_io();
                self.changed(now, kind, change);
            }
        }
        self.free(now);
        self.application.handle_time(now);
        self.poll_explicit(now);
        self.poll_change_of_state(now);
    }

    /// When to call [`Slave::poll`] next; `None` when nothing will happen by itself.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if !self.frames.is_empty() || self.restart {
            return Some(MonotonicTime::ZERO);
        }
        let connections = self.connections.iter().filter_map(Connection::deadline);
        let others = [
            self.access.wake_at(),
            self.application.wake_at(),
            self.explicit.wake_at(),
            self.change_of_state_wake_at(),
        ];
        connections.chain(others.into_iter().flatten()).min()
    }

    // -- allocation ---------------------------------------------------------------------------------------------

    fn held(&self) -> AllocationChoice {
        let mut held = AllocationChoice::empty();
        for connection in &self.connections {
            if connection.state() != ConnectionState::NON_EXISTENT {
                held |= choice_of(connection);
            }
        }
        held
    }

    fn allocation(&self) -> Allocation {
        let mut supported = AllocationChoice::EXPLICIT;
        let has = |kind| self.application.setup(kind).is_some();
        supported.set(AllocationChoice::POLL, has(ConnectionKind::Poll));
        supported.set(AllocationChoice::BIT_STROBE, has(ConnectionKind::BitStrobe));
        let fourth = AllocationChoice::CHANGE_OF_STATE_OR_CYCLIC | AllocationChoice::ACKNOWLEDGE_SUPPRESSION;
        supported.set(fourth, has(ConnectionKind::ChangeOfState));
        Allocation { master: self.master, held: self.held(), supported }
    }

    fn is_io_established(&self) -> bool {
        let established =
            |one: &Connection| one.kind().is_io() && one.state() == ConnectionState::ESTABLISHED;
        self.connections.iter().any(established)
    }

    /// Tells everybody who has to know of a change.
    fn changed(&mut self, now: MonotonicTime, kind: ConnectionKind, change: Change) {
        if change.before == change.after {
            return;
        }
        self.told(now, kind, change);
    }

    /// As [`Slave::changed`], also where the state is the same and the rate is another.
    fn told(&mut self, now: MonotonicTime, kind: ConnectionKind, change: Change) {
        self.receivers[kind.index()].reset();
        if kind == ConnectionKind::Explicit && !change.after.takes_messages() {
            self.explicit.reset();
        }
        if kind == ConnectionKind::ChangeOfState {
            self.change_of_state = ChangeOfState::default();
        }
        let master = self.master.unwrap_or(self.config.mac);
        let connection = &self.connections[kind.index()];
        self.application.connection_changed(now, connection, change, master);
        self.tell(SlaveEvent::Connection(kind, change));
        if kind.is_io() && !self.is_io_established() {
            let explicit = self.connection_mut(ConnectionKind::Explicit);
            if let Ok(change) = explicit.event(now, ConnectionEvent::LastIoGone, false) {
                self.changed(now, ConnectionKind::Explicit, change);
            }
        }
    }

    fn connection_event(
        &mut self,
        now: MonotonicTime,
        kind: ConnectionKind,
        event: ConnectionEvent,
    ) -> Result<(), GeneralStatus> {
        let io = self.is_io_established();
        let change = self.connection_mut(kind).event(now, event, io)?;
        self.changed(now, kind, change);
        Ok(())
    }

    fn drop_connections(&mut self, now: MonotonicTime) {
        for kind in [
            ConnectionKind::Poll,
            ConnectionKind::BitStrobe,
            ConnectionKind::ChangeOfState,
            ConnectionKind::Explicit,
        ] {
            // One that does not exist refuses, and stays that.
            let _ = self.connection_event(now, kind, ConnectionEvent::Release);
        }
        self.free(now);
    }

    /// Without a connection that could ever carry a message the slave belongs to nobody: its master could be gone for ever.
    fn free(&mut self, now: MonotonicTime) {
        let dead = |one: &Connection| {
            matches!(one.state(), ConnectionState::NON_EXISTENT | ConnectionState::TIMED_OUT)
        };
        if self.master.is_none() || !self.connections.iter().all(dead) {
            return;
        }
        for kind in ConnectionKind::ALL {
            if self.connection(kind).state() == ConnectionState::TIMED_OUT {
                let _ = self.connection_event(now, kind, ConnectionEvent::Release);
            }
        }
        self.master = None;
        self.tell(SlaveEvent::Freed);
    }

    fn allocate(&mut self, now: MonotonicTime, master: MacId, choice: AllocationChoice) {
        self.master = Some(master);
        self.timed_out = false;
        self.acknowledged = !choice.contains(AllocationChoice::ACKNOWLEDGE_SUPPRESSION);
        for kind in ConnectionKind::ALL {
            let wanted = match kind {
                ConnectionKind::Explicit => AllocationChoice::EXPLICIT,
                ConnectionKind::Poll => AllocationChoice::POLL,
                ConnectionKind::BitStrobe => AllocationChoice::BIT_STROBE,
                ConnectionKind::ChangeOfState => AllocationChoice::CHANGE_OF_STATE_OR_CYCLIC,
            };
            if !choice.intersects(wanted) {
                continue;
            }
            let Some(mut setup) = self.setup(kind) else { continue };
            if kind == ConnectionKind::ChangeOfState {
                setup.transport = io::transport(choice);
            }
            let acknowledged = self.acknowledged;
            if let Ok(change) = self.connection_mut(kind).allocate(now, master, setup, acknowledged) {
                self.changed(now, kind, change);
            }
        }
        self.tell(SlaveEvent::Allocated { master, choice });
    }

    fn release(&mut self, now: MonotonicTime, choice: AllocationChoice) {
        self.tell(SlaveEvent::Released(choice));
        for kind in ConnectionKind::ALL {
            let connection = self.connection(kind);
            if connection.state() != ConnectionState::NON_EXISTENT && choice.intersects(choice_of(connection))
            {
                let _ = self.connection_event(now, kind, ConnectionEvent::Release);
            }
        }
        self.free(now);
    }
}

/// The bit of the allocation choice that stands for a connection that exists.
const fn choice_of(connection: &Connection) -> AllocationChoice {
    match connection.kind() {
        ConnectionKind::Explicit => AllocationChoice::EXPLICIT,
        ConnectionKind::Poll => AllocationChoice::POLL,
        ConnectionKind::BitStrobe => AllocationChoice::BIT_STROBE,
        ConnectionKind::ChangeOfState if connection.is_cyclic() => AllocationChoice::CYCLIC,
        ConnectionKind::ChangeOfState => AllocationChoice::CHANGE_OF_STATE,
    }
}
