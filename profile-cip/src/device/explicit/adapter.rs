//! The explicit side of the device: encapsulation sessions and everything that is asked over them.
//!
//! Sans-IO. For each TCP stream the caller has a [`SessionSlot`]:
//!
//! ```text
//! open(now, peer) -> slot                     accept
//! handle_stream(now, slot, bytes) -> taken    bytes came in; what was not taken is offered again later
//! poll_transmit(now, slot, out) -> count      bytes to send, until 0
//! is_done(slot)                               close the stream now
//! close(slot)                                 the stream has ended
//! ```
//!
//! Datagrams of UDP port 44818 go through [`Adapter::handle_datagram`]. What concerns the motion device
//! leaves by [`Adapter::poll_motion`] and its answers come back by [`Adapter::complete`].
//!
//! Nothing here waits: a session whose request is with the motion device takes no further packet until the
//! answer, the others go on.

use core::net::{Ipv4Addr, SocketAddrV4};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::list;
use super::node::{AwaitKind, Node, micros};
use super::session::{Input, Opened, ReplyTo, Session};
use crate::device::config::{AdapterConfig, ConfigError, QosConfig};
use crate::device::counters::Counters;
use crate::device::event::Event;
use crate::device::motion_link::{MotionReply, MotionRequest, OpenParameters};
use crate::device::objects::identity::Health;
use crate::device::objects::time_sync::TimeSyncState;
use crate::device::port::LinkState;
pub use crate::device::session_slot::{
    NoRoom, SESSIONS_KEPT, SESSIONS_MAX, SESSIONS_OF_HOST_MAX, SessionSlot,
};
use crate::wire::Reader;
use crate::wire::cpf::{EncapsulatedPacket, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, Header, PROTOCOL_VERSION, Packet};
use crate::wire::register_session::{REGISTER_SESSION_LEN, RegisterSession};
use crate::wire::sockaddr::SockaddrInfo;

/// Longest unconnected reply in bytes, from the service code on.
pub const UNCONNECTED_REPLY_MAX: usize = 508;

/// How long the motion device may take for an answer.
pub const DEVICE_TIMEOUT: DurationNs = DurationNs::from_secs(3);

/// The explicit side of one device.
#[derive(Debug)]
pub struct Adapter {
    pub(crate) node: Node,
    sessions: Vec<Option<Session>>,
    generation: u64,
    next_handle: u32,
}

impl Adapter {
    /// An adapter for the device `config` describes.
    ///
    /// # Errors
    /// A value outside its range.
    pub fn new(config: AdapterConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            next_handle: u32::from(config.incarnation) << 16 | 1,
            node: Node::new(config),
            sessions: (0..SESSIONS_MAX).map(|_| None).collect(),
            generation: 0,
        })
    }

    /// Draws connection IDs with a secret from now on, instead of counting up: a client that has a connection of its own
    /// cannot guess the ID of another's. The caller takes it from the system's random numbers, anew at each start.
    pub fn hide_connection_ids(&mut self, secret: u64) {
        self.node.connections.set_secret(secret);
    }

    /// What has been counted so far.
    pub fn counters(&self) -> &Counters {
        &self.node.counters
    }

    /// The configuration with what was set over the network since the start.
    pub fn config(&self) -> &AdapterConfig {
        &self.node.config
    }

    /// The motion connection while it is open, opening or closing.
    pub fn motion_connection(&self) -> Option<&OpenParameters> {
        self.node.connections.motion.parameters()
    }

    /// Streams that are open.
    pub fn sessions(&self) -> usize {
        self.sessions.iter().flatten().count()
    }

    /// Explicit connections that are open.
    pub fn explicit_connections(&self) -> usize {
        self.node.connections.explicit.len()
    }

    /// How the device is, for the Identity object.
    pub fn set_health(&mut self, health: Health) {
        self.node.health = health;
    }

    /// How the clock of the device is, for the Time Sync object.
    pub fn set_time_sync(&mut self, state: TimeSyncState) {
        self.node.time_sync = state;
    }

    /// How the Ethernet port is, for the Ethernet Link object.
    pub fn set_link(&mut self, state: LinkState) {
        self.node.config.link.state = state;
    }

    /// The code points in use: those of the start. [`Adapter::config`] has those for the next one.
    pub fn qos_in_use(&self) -> &QosConfig {
        &self.node.qos_in_use
    }

    /// Takes a new stream.
    ///
    /// # Errors
    /// There are too many: the caller closes it.
    pub fn open(&mut self, now: MonotonicTime, peer: SocketAddrV4) -> Result<SessionSlot, NoRoom> {
        let index = self.free_slot(*peer.ip()).inspect_err(|_| self.node.counters.sessions_refused += 1)?;
        self.generation += 1;
        let slot = SessionSlot { index, generation: self.generation };
        self.sessions[index] = Some(Session::new(slot, peer, now));
        Ok(slot)
    }

    /// A free slot that a stream of this host may have.
    fn free_slot(&self, host: Ipv4Addr) -> Result<usize, NoRoom> {
        let open = || self.sessions.iter().flatten();
        if open().filter(|session| *session.peer.ip() == host).count() >= SESSIONS_OF_HOST_MAX {
            return Err(NoRoom::Host);
        }
        let kept = if self.node.is_controller(host) { 0 } else { SESSIONS_KEPT };
        let free = self.sessions.iter().position(Option::is_none);
        free.filter(|_| SESSIONS_MAX - open().count() > kept).ok_or(NoRoom::All)
    }

    /// The stream has ended: its session and its explicit connections are gone. The motion connection is not:
    /// it lives from its own datagrams.
    pub fn close(&mut self, slot: SessionSlot) {
        if self.session(slot).is_some() {
            self.sessions[slot.index] = None;
            self.node.connections.close_session(slot);
            self.node.uploads.close_session(slot);
        }
    }

    /// How many bytes [`Adapter::handle_stream`] would take now. At 0 the caller stops reading from the
    /// stream.
    pub fn room(&self, slot: SessionSlot) -> usize {
        self.session(slot).map_or(0, Session::room)
    }

    /// Takes bytes of a stream and returns how many; the caller offers the rest again when there is room.
    pub fn handle_stream(&mut self, now: MonotonicTime, slot: SessionSlot, bytes: &[u8]) -> usize {
        let mut taken = 0;
        // A whole packet makes room for the next one, so this goes on as long as something moves.
        while let Some(session) = self.session_mut(slot) {
            let more = session.take(&bytes[taken..]);
            taken += more;
            self.pump(now, slot);
            if more == 0 || taken == bytes.len() {
                break;
            }
        }
        taken
    }

    /// Writes bytes for the stream into `out` and returns how many; 0 when there is nothing to send.
    pub fn poll_transmit(&mut self, now: MonotonicTime, slot: SessionSlot, out: &mut [u8]) -> usize {
        let Some(session) = self.session_mut(slot) else { return 0 };
        let count = session.fetch(out);
        // Room in the output lets packets through that were held back.
        self.pump(now, slot);
        count
    }

    /// Whether the stream is to be closed by the caller: the session has ended and everything is sent. Also
    /// true for a slot that is no more.
    pub fn is_done(&self, slot: SessionSlot) -> bool {
        self.session(slot).is_none_or(|session| session.closing && !session.has_output())
    }

    /// The streams that have something to send or are to be closed.
    pub fn ready(&self) -> impl Iterator<Item = SessionSlot> + '_ {
        let ready = |session: &&Session| session.has_output() || session.closing;
        self.sessions.iter().flatten().filter(ready).map(|session| session.slot)
    }

    /// Answers a datagram of UDP port 44818: List commands. Writes the answer for the same peer into `out`
    /// and returns its length; 256 bytes hold any.
    pub fn handle_datagram(&mut self, bytes: &[u8], out: &mut [u8]) -> Option<usize> {
        let answer = Packet::parse(bytes).ok().and_then(|packet| {
            if packet.options != 0 || packet.status != EncapsulationStatus::SUCCESS {
                return None;
            }
            list::answer(&self.node, &packet).or_else(|| match packet.command {
                Command::NOP => None,
                _ => Some(status_packet(&packet, EncapsulationStatus::INVALID_COMMAND)),
            })
        });
        let sent = answer.and_then(|answer| {
            out.get_mut(..answer.len())?.copy_from_slice(&answer);
            Some(answer.len())
        });
        if sent.is_none() {
            self.node.counters.datagrams_dropped += 1;
        }
        sent
    }

    /// The next request for the motion device.
    pub fn poll_motion(&mut self) -> Option<MotionRequest> {
        self.node.poll_request()
    }

    /// Takes an answer of the motion device. Returns the stream that has a reply to send now.
    pub fn complete(&mut self, now: MonotonicTime, reply: &MotionReply) -> Option<SessionSlot> {
        self.node.note(reply);
        let token = match reply {
            MotionReply::Opened { token, .. }
            | MotionReply::Closed { token }
            | MotionReply::ResetPrepared { token, .. } => *token,
            MotionReply::Explicit(explicit) => explicit.token,
            MotionReply::ConnectionLost { .. } => return None,
        };
        let waits = |session: &&Session| {
            session.transaction.as_ref().is_some_and(|transaction| transaction.awaited.token == token)
        };
        let Some(slot) = self.sessions.iter().flatten().find(waits).map(|session| session.slot) else {
            self.node.counters.replies_orphaned += 1;
            return None;
        };
        let transaction = self.session_mut(slot)?.transaction.take()?;
        let reply_max = self.reply_max(slot, transaction.reply_to);
        let Some(bytes) = self.node.finish(&transaction.awaited, reply, reply_max) else {
            // An answer of the wrong kind is none: the request stays and will be given up in time.
            self.node.counters.replies_orphaned += 1;
            self.session_mut(slot)?.transaction = Some(transaction);
            return None;
        };
        let opened = match (reply, transaction.awaited.kind) {
            (MotionReply::Opened { outcome: Ok(()), .. }, AwaitKind::Open(open, _)) => {
                Opened { io: true, group: open.group() }
            }
            _ => Opened::default(),
        };
        self.resume(now, slot, transaction, bytes, opened);
        self.pump(now, slot);
        Some(slot)
    }

    /// The next thing the application should know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.node.poll_event()
    }

    /// When [`Adapter::handle_time`] has to be called next.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let inactivity = self.node.config.interface.inactivity_timeout_s;
        let sessions = self.sessions.iter().flatten().filter_map(|session| {
            let transaction = session.transaction.as_ref().map(|transaction| transaction.deadline);
            transaction.or(session.inactive_at(inactivity))
        });
        sessions.chain(self.node.wake_at()).min()
    }

    /// Ends what has taken too long: requests at the motion device, explicit connections, silent streams.
    /// Afterwards [`Adapter::ready`] tells which streams want service.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        self.node.handle_time(now);
        let inactivity = self.node.config.interface.inactivity_timeout_s;
        for index in 0..self.sessions.len() {
            let Some(session) = self.sessions[index].as_mut() else { continue };
            let slot = session.slot;
            if let Some(transaction) = session.transaction.take_if(|one| one.deadline <= now) {
                let bytes = self.node.give_up(&transaction.awaited);
                self.resume(now, slot, transaction, bytes, Opened::default());
                self.pump(now, slot);
            } else if let Some(at) = session.inactive_at(inactivity).filter(|at| *at <= now) {
                session.closing = true;
                let event = Event::SessionLost {
                    peer: session.peer,
                    registered: session.handle.is_some(),
                    silent_us: micros(now - session.last_activity),
                    timeout_us: micros(at - session.last_activity),
                };
                self.node.counters.sessions_timed_out += 1;
                self.node.tell(event);
            }
        }
    }

    pub(crate) fn session(&self, slot: SessionSlot) -> Option<&Session> {
        self.sessions.get(slot.index)?.as_ref().filter(|session| session.slot == slot)
    }

    pub(crate) fn session_mut(&mut self, slot: SessionSlot) -> Option<&mut Session> {
        self.sessions.get_mut(slot.index)?.as_mut().filter(|session| session.slot == slot)
    }

    pub(crate) fn send(&mut self, slot: SessionSlot, packet: &[u8]) {
        if let Some(session) = self.session_mut(slot) {
            session.send(packet);
        }
    }

    /// Works through the input of a stream as far as it goes.
    fn pump(&mut self, now: MonotonicTime, slot: SessionSlot) {
        while let Some(session) = self.session_mut(slot) {
            if !session.is_ready() {
                return;
            }
            let sensible = match session.next() {
                Input::Wait => return,
                Input::Oversize(header) => {
                    self.node.counters.lengths_invalid += 1;
                    let refused = Packet { data: &[], ..packet_of(&header) };
                    let reply = status_packet(&refused, EncapsulationStatus::INVALID_LENGTH);
                    self.send(slot, &reply);
                    false
                }
                Input::Packet(bytes) => {
                    session.last_activity = now;
                    self.packet(now, slot, &bytes)
                }
            };
            if let Some(session) = self.session_mut(slot)
                && !session.judge(sensible)
            {
                session.closing = true;
                self.node.counters.sessions_garbled += 1;
            }
        }
    }

    /// Handles one packet; reports whether it was one a client would send.
    fn packet(&mut self, now: MonotonicTime, slot: SessionSlot, bytes: &[u8]) -> bool {
        let Ok(packet) = Packet::parse(bytes) else { return false };
        if packet.options != 0 || packet.status != EncapsulationStatus::SUCCESS {
            self.node.counters.packets_dropped += 1;
            return false;
        }
        if let Some(answer) = list::answer(&self.node, &packet) {
            self.send(slot, &answer);
            return true;
        }
        let outcome = match packet.command {
            Command::NOP => Ok(()),
            Command::REGISTER_SESSION => self.register(slot, &packet),
            Command::UNREGISTER_SESSION => self.unregister(slot, &packet),
            Command::SEND_RR_DATA => self.unconnected(now, slot, &packet),
            Command::SEND_UNIT_DATA => self.connected(now, slot, &packet),
            _ => Err(EncapsulationStatus::INVALID_COMMAND),
        };
        let Err(status) = outcome else { return true };
        let counters = &mut self.node.counters;
        match status {
            EncapsulationStatus::INVALID_COMMAND => counters.commands_unknown += 1,
            EncapsulationStatus::INVALID_LENGTH => counters.lengths_invalid += 1,
            EncapsulationStatus::INVALID_SESSION_HANDLE => counters.handles_invalid += 1,
            _ => counters.data_malformed += 1,
        }
        self.send(slot, &status_packet(&packet, status));
        status != EncapsulationStatus::INVALID_COMMAND
    }

    fn register(&mut self, slot: SessionSlot, packet: &Packet<'_>) -> Result<(), EncapsulationStatus> {
        let request = RegisterSession::parse(packet.data).map_err(|_| EncapsulationStatus::INVALID_LENGTH)?;
        let registered = self.session(slot).is_some_and(|session| session.handle.is_some());
        if registered {
            return Err(EncapsulationStatus::INVALID_COMMAND);
        }
        let supported = request.protocol_version == PROTOCOL_VERSION && request.options == 0;
        let status = if supported {
            EncapsulationStatus::SUCCESS
        } else {
            self.node.counters.versions_refused += 1;
            EncapsulationStatus::UNSUPPORTED_PROTOCOL
        };
        let handle = if supported { self.new_handle() } else { 0 };
        let mut data = [0; REGISTER_SESSION_LEN];
        let _ = RegisterSession { protocol_version: PROTOCOL_VERSION, options: 0 }.emit(&mut data);
        let reply = packet_bytes(&Packet { session_handle: handle, status, data: &data, ..*packet });
        if let Some(session) = self.session_mut(slot) {
            session.handle = (handle != 0).then_some(handle);
            session.send(&reply);
        }
        Ok(())
    }

    fn new_handle(&mut self) -> u32 {
        loop {
            let handle = self.next_handle;
            self.next_handle = self.next_handle.wrapping_add(1);
            let used = self.sessions.iter().flatten().any(|session| session.handle == Some(handle));
            if handle != 0 && !used {
                return handle;
            }
        }
    }

    fn check_handle(&self, slot: SessionSlot, packet: &Packet<'_>) -> Result<(), EncapsulationStatus> {
        match self.session(slot).and_then(|session| session.handle) {
            Some(handle) if handle == packet.session_handle => Ok(()),
            _ => Err(EncapsulationStatus::INVALID_SESSION_HANDLE),
        }
    }

    /// Ends the session of this very stream; there is no answer.
    fn unregister(&mut self, slot: SessionSlot, packet: &Packet<'_>) -> Result<(), EncapsulationStatus> {
        self.check_handle(slot, packet)?;
        if let Some(session) = self.session_mut(slot) {
            session.closing = true;
        }
        Ok(())
    }

    fn unconnected(
        &mut self,
        now: MonotonicTime,
        slot: SessionSlot,
        packet: &Packet<'_>,
    ) -> Result<(), EncapsulationStatus> {
        const MALFORMED: EncapsulationStatus = EncapsulationStatus::INCORRECT_DATA;
        self.check_handle(slot, packet)?;
        let body = EncapsulatedPacket::parse(packet.data).map_err(|_| MALFORMED)?;
        let [address, data, more @ ..] = body.packet.items.as_slice() else { return Err(MALFORMED) };
        let right_items = address.item_type == ItemType::NULL_ADDRESS
            && address.data.is_empty()
            && data.item_type == ItemType::UNCONNECTED_DATA;
        if !right_items || body.interface_handle != 0 {
            return Err(MALFORMED);
        }
        let socket = more.iter().find(|item| item.item_type == ItemType::SOCKADDR_T_TO_O);
        let socket = socket.map(|item| SockaddrInfo::parse(item.data).map(|info| info.address));
        let t_to_o_socket = socket.transpose().map_err(|_| MALFORMED)?;
        let reply_to = ReplyTo::Unconnected { sender_context: packet.sender_context };
        self.begin(now, slot, reply_to, t_to_o_socket, data.data);
        Ok(())
    }

    fn connected(
        &mut self,
        now: MonotonicTime,
        slot: SessionSlot,
        packet: &Packet<'_>,
    ) -> Result<(), EncapsulationStatus> {
        const MALFORMED: EncapsulationStatus = EncapsulationStatus::INCORRECT_DATA;
        self.check_handle(slot, packet)?;
        let body = EncapsulatedPacket::parse(packet.data).map_err(|_| MALFORMED)?;
        let [address, data] = body.packet.items.as_slice() else { return Err(MALFORMED) };
        let right_items = address.item_type == ItemType::CONNECTED_ADDRESS
            && address.data.len() == 4
            && data.item_type == ItemType::CONNECTED_DATA;
        if !right_items || body.interface_handle != 0 {
            return Err(MALFORMED);
        }
        let o_to_t_id = Reader::new(address.data).u32("connection ID").map_err(|_| MALFORMED)?;
        let mut r = Reader::new(data.data);
        let sequence = r.u16("sequence count").map_err(|_| MALFORMED)?;
        let message = r.rest();
        let Some(connection) = self.node.connections.explicit_mut(slot, o_to_t_id) else {
            // There is no answer to a message of a connection that is not: its originator will time out.
            self.node.counters.connected_unknown += 1;
            return Ok(());
        };
        if data.data.len() > usize::from(connection.o_to_t_size) {
            return Err(MALFORMED);
        }
        connection.heard = now;
        connection.deadline = now + connection.timeout;
        let sender_context = packet.sender_context;
        let reply_to = ReplyTo::Connected { sender_context, o_to_t_id, sequence };
        if connection.last_sequence == Some(sequence) {
            let reply = connection.last_reply.clone();
            self.node.counters.connected_repeated += 1;
            self.reply(slot, reply_to, &reply, Opened::default());
            return Ok(());
        }
        connection.last_sequence = Some(sequence);
        connection.last_reply.clear();
        self.begin(now, slot, reply_to, None, message);
        Ok(())
    }
}

fn packet_of(header: &Header) -> Packet<'static> {
    let Header { command, session_handle, status, sender_context, options, .. } = *header;
    Packet { command, session_handle, status, sender_context, options, data: &[] }
}

/// A reply without data.
fn status_packet(packet: &Packet<'_>, status: EncapsulationStatus) -> Vec<u8> {
    packet_bytes(&Packet { status, data: &[], ..*packet })
}

/// A packet as bytes. One that cannot be is sent without data and says so.
pub(crate) fn packet_bytes(packet: &Packet<'_>) -> Vec<u8> {
    let mut bytes = vec![0; packet.buffer_len()];
    match packet.emit(&mut bytes) {
        Ok(_) => bytes,
        Err(_) => status_packet(packet, EncapsulationStatus::INSUFFICIENT_MEMORY),
    }
}
