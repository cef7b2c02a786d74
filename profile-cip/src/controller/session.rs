//! The explicit side: encapsulation session, Identity, Forward_Open and Forward_Close on one TCP stream.
//!
//! | state | sent | next |
//! |---|---|---|
//! | Idle | | `start` |
//! | Asked(ListIdentity) | ListIdentity | RegisterSession |
//! | Asked(RegisterSession) | RegisterSession | Identity |
//! | Asked(ReadIdentity) | Get_Attributes_All | Forward_Open |
//! | Asked(ForwardOpen) | Forward_Open, or the large one above 511 bytes | Open |
//! | Open | | `close`, `message`, or `keep_alive` |
//! | Asked(Message) | any request of the program | Open |
//! | Asked(KeepAlive) | Get_Attribute_Single of the Vendor ID | Open, or Lost |
//! | Lost | | `resume`: RegisterSession, then Open |
//! | Asked(ForwardClose) | Forward_Close | Closed |
//! | Closed | UnRegisterSession | |
//!
//! A reply counts only with the sender context of the request under way.
//!
//! A device closes an idle stream, after 120 s where nobody has said otherwise (TCP/IP Interface object, attribute 13). The
//! motion connection does not end with it, but nobody could close that in order any more: so an idle session is kept open by
//! a harmless request, and one that is lost is registered anew on another stream.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::collections::VecDeque;

use super::config::ControllerConfig;
use super::event::DeviceIdentity;
use super::failure::{Exchange, Failure};
use super::program::ExplicitMessage;
use crate::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use crate::wire::encapsulation::{
    Command, EncapsulationStatus, HEADER_LEN, Header, PROTOCOL_VERSION, Packet,
};
use crate::wire::epath::{ElectronicKey, Encoding, Segment, emit_path, path_len};
use crate::wire::forward_close::ForwardClose;
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::list_identity::IdentityItem;
use crate::wire::message_router::{Reply, Request};
use crate::wire::motion::Format;
use crate::wire::network_parameters::{ConnectionType, NetworkParameters, Priority, SMALL_SIZE_MAX};
use crate::wire::register_session::RegisterSession;
use crate::wire::sockaddr::{SOCKADDR_LEN, SockaddrInfo};
use crate::wire::status::{GeneralStatus, Service};
use crate::wire::{ConnectionTriad, Error, Reader};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Longest packet that the device may send: far more than any answer to what is asked here.
const PACKET_MAX: usize = 4096;
/// Time without a request after which an idle session is kept alive.
const KEEP_ALIVE: DurationNs = DurationNs::from_secs(30);
/// Vendor ID, an attribute of the Identity object that every device lets read.
const VENDOR_ID: u16 = 1;
/// Class code of the Motion Device Axis Object.
pub(super) const MOTION_DEVICE_AXIS: u16 = 0x42;
const IDENTITY: u16 = 1;
const CONNECTION_MANAGER: u16 = 6;
/// Connection point of the configuration block of format revision 1, clause 7-1.1.
const CONFIGURATION_POINT: u16 = 0x51;
const CONFIGURATION_REVISION: u8 = 1;
const VERIFY_POWER_RATING: u8 = 1;
/// Priority and time tick, and ticks: 2^10 ms times 4 for the request itself.
const TIME_TICK: u8 = 10;
const TIME_OUT_TICKS: u8 = 4;

/// What the session tells the controller.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Output {
    Identified(DeviceIdentity),
    Registered(u32),
    Opened(Opened),
    Closed,
    /// The session does not answer any more; the motion connection is not concerned.
    Lost,
    Malformed(Error),
    Failed(Failure),
    /// The answer to a message.
    Answered(Asker, Result<Answer, Failure>),
}

/// Whose message it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asker {
    /// A step of the program.
    Program,
    /// The services, where the connection has no channel for them: instance and transaction ID.
    Services(u8, u8),
}

/// An answer that is not looked into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Answer {
    pub service: u8,
    pub status: u8,
    pub extended: Option<u16>,
    pub data: Vec<u8>,
}

/// The connection as the device granted it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Opened {
    pub o_to_t_id: u32,
    pub t_to_o_id: u32,
    /// Where C-to-D datagrams go, if the device said so.
    pub destination: Option<SocketAddrV4>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    Asked {
        exchange: Exchange,
        since: MonotonicTime,
    },
    Open,
    /// The stream or the session is gone, the motion connection is not.
    Lost,
    Closed,
}

/// The explicit side of the controller.
#[derive(Debug)]
pub(super) struct Session {
    state: State,
    handle: u32,
    context: u64,
    /// When the last request was made.
    asked_at: MonotonicTime,
    /// The session is being registered anew beside the open connection.
    resuming: bool,
    received: Vec<u8>,
    sent: Vec<u8>,
    outputs: VecDeque<Output>,
    time_out: DurationNs,
    list_identity: bool,
    /// Whose message is under way, or was last.
    asker: Asker,
    rpi_us: u32,
    variable: bool,
    triad: ConnectionTriad,
    path: Vec<u8>,
    timeout_multiplier: u8,
    connection_size: u16,
    t_to_o_id: u32,
    t_to_o_port: Option<u16>,
}

impl Session {
    pub fn new(config: &ControllerConfig) -> Self {
        Self {
            state: State::Idle,
            handle: 0,
            context: 0,
            asked_at: MonotonicTime::ZERO,
            resuming: false,
            received: Vec::with_capacity(PACKET_MAX),
            sent: Vec::with_capacity(1024),
            outputs: VecDeque::with_capacity(8),
            time_out: config.time_outs.explicit,
            list_identity: config.list_identity,
            asker: Asker::Program,
            rpi_us: config.rpi_us,
            variable: config.format == Format::Variable,
            triad: ConnectionTriad {
                connection_serial: config.connection_serial,
                originator_vendor: config.originator_vendor,
                originator_serial: config.originator_serial,
            },
            path: connection_path(config),
            timeout_multiplier: config.timeout_multiplier,
            connection_size: config.connection_size,
            t_to_o_id: config.t_to_o_id,
            t_to_o_port: config.t_to_o_port,
        }
    }

    /// The stream to the device is there.
    pub fn start(&mut self, now: MonotonicTime) {
        if self.state != State::Idle {
            return;
        }
        if self.list_identity {
            self.ask(now, Exchange::ListIdentity, Command::LIST_IDENTITY, &[]);
        } else {
            self.register(now);
        }
    }

    /// Closes the connection as far as it was opened, and the session.
    pub fn close(&mut self, now: MonotonicTime) {
        match self.state {
            State::Open | State::Asked { exchange: Exchange::Message(_) | Exchange::KeepAlive, .. } => {
                let close = ForwardClose {
                    priority_tick: TIME_TICK,
                    timeout_ticks: TIME_OUT_TICKS,
                    triad: self.triad,
                    path: &self.path,
                };
                let mut data = vec![0; close.buffer_len()];
                let length = close.emit(&mut data);
                self.ask_object(now, Exchange::ForwardClose, CONNECTION_MANAGER, length.map(|_| data), None);
            }
            State::Idle | State::Asked { .. } | State::Lost => self.unregister(),
            State::Closed => {}
        }
    }

    /// Makes a request beside the connection, if none is under way; false if one is.
    pub fn message(&mut self, now: MonotonicTime, asker: Asker, message: &ExplicitMessage) -> bool {
        if self.state != State::Open {
            return false;
        }
        self.asker = asker;
        let exchange = Exchange::Message(message.service);
        let service = Service(message.service);
        match unconnected(service, message.class, message.instance, message.attribute, &message.data, None) {
            Ok(block) => self.ask(now, exchange, Command::SEND_RR_DATA, &block),
            Err(error) => {
                let failure = Failure::AnswerMalformed { exchange, error };
                self.outputs.push_back(Output::Answered(asker, Err(failure)));
            }
        }
        true
    }

    /// Whether there is no session for the open connection: it is lost, or not registered again yet.
    pub fn is_lost(&self) -> bool {
        self.resuming || self.state == State::Lost
    }

    /// The stream is gone, the motion connection is not. A message under way is answered by that.
    pub fn lose(&mut self) {
        if matches!(self.state, State::Asked { exchange: Exchange::Message(_), .. }) {
            self.outputs.push_back(Output::Answered(self.asker, Err(Failure::StreamClosed)));
        }
        self.sent.clear();
        self.received.clear();
        (self.handle, self.resuming, self.state) = (0, false, State::Lost);
    }

    /// Another stream is there for a session that was lost.
    pub fn resume(&mut self, now: MonotonicTime) {
        if self.state == State::Lost {
            self.resuming = true;
            self.register(now);
        }
    }

    /// When an idle session is to be kept alive.
    pub fn keep_alive_at(&self) -> Option<MonotonicTime> {
        (self.state == State::Open).then(|| self.asked_at + KEEP_ALIVE)
    }

    /// Makes a harmless request if none was made for long.
    pub fn keep_alive(&mut self, now: MonotonicTime) {
        if self.keep_alive_at().is_none_or(|at| now < at) {
            return;
        }
        let exchange = Exchange::KeepAlive;
        match unconnected(service_of(exchange), IDENTITY, 1, Some(VENDOR_ID), &[], None) {
            Ok(block) => self.ask(now, exchange, Command::SEND_RR_DATA, &block),
            Err(error) => self.fail(Failure::AnswerMalformed { exchange, error }),
        }
    }

    /// Closes the session of a connection that is no more.
    pub fn leave(&mut self) {
        if self.state != State::Closed {
            self.unregister();
        }
    }

    /// The stream is gone; what was to be sent cannot be sent any more.
    pub fn stream_closed(&mut self) {
        self.sent.clear();
        if self.state != State::Closed {
            self.state = State::Closed;
            self.outputs.push_back(Output::Closed);
        }
    }

    /// The next thing to tell.
    pub fn poll(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// Bytes for the stream.
    pub fn poll_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        if self.sent.is_empty() || buffer.is_empty() {
            return None;
        }
        let count = self.sent.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.sent[..count]);
        self.sent.drain(..count);
        Some(count)
    }

    /// When the request under way has lasted too long.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        match self.state {
            State::Asked { since, .. } => Some(since + self.time_out),
            _ => None,
        }
    }

    /// Checks the time-out.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        if let State::Asked { exchange, since } = self.state
            && now - since >= self.time_out
        {
            self.fail(Failure::ExplicitTimeOut { exchange, waited: now - since });
        }
    }

    /// Takes bytes of the stream.
    pub fn handle_stream(&mut self, now: MonotonicTime, bytes: &[u8]) {
        if matches!(self.state, State::Closed | State::Lost) {
            return;
        }
        self.received.extend_from_slice(bytes);
        while let Ok(header) = Header::parse(&self.received) {
            let length = HEADER_LEN + usize::from(header.length);
            if length > PACKET_MAX {
                let (value, max) = (u32::from(header.length), 4096 - 24);
                let error = Error::too_large("encapsulation length", max, value);
                self.received.clear();
                self.fail(Failure::StreamMalformed(error));
                return;
            }
            if self.received.len() < length {
                return;
            }
            let rest = self.received.split_off(length);
            let packet = core::mem::replace(&mut self.received, rest);
            match Packet::parse(&packet) {
                Ok(packet) => self.handle_packet(now, &packet),
                Err(error) => self.outputs.push_back(Output::Malformed(error)),
            }
        }
    }

    fn handle_packet(&mut self, now: MonotonicTime, packet: &Packet<'_>) {
        if packet.command == Command::NOP {
            return;
        }
        let State::Asked { exchange, .. } = self.state else {
            let found = u32::from(packet.command.0);
            return self.unexpected("command of a reply to nothing asked", 0, found, 0);
        };
        let (found, expected) = (packet.command, command_of(exchange));
        if found != expected {
            let (found, expected) = (u32::from(found.0), u32::from(expected.0));
            return self.unexpected("command of a reply", 0, found, expected);
        }
        if packet.sender_context != self.context.to_le_bytes() {
            let low = |context: [u8; 8]| u32::from_le_bytes([context[0], context[1], context[2], context[3]]);
            let (found, expected) = (low(packet.sender_context), low(self.context.to_le_bytes()));
            return self.unexpected("sender context of a reply", 12, found, expected);
        }
        if packet.status != EncapsulationStatus::SUCCESS {
            return self.fail(Failure::Encapsulation { exchange, status: packet.status.0 });
        }
        let taken = match exchange {
            Exchange::ListIdentity => self.take_identity_list(now, packet.data),
            Exchange::RegisterSession => self.take_registration(now, packet),
            _ => self.take_reply(now, exchange, packet.data),
        };
        if let Err(error) = taken {
            self.fail(Failure::AnswerMalformed { exchange, error });
        }
    }

    fn unexpected(&mut self, what: &'static str, offset: usize, found: u32, expected: u32) {
        self.outputs.push_back(Output::Malformed(Error::invalid(what, offset, expected, found)));
    }

    fn take_identity_list(&mut self, now: MonotonicTime, data: &[u8]) -> Result<(), Error> {
        let list = CommonPacket::parse(data)?;
        if let Some(item) = list.find(ItemType::IDENTITY) {
            let item = IdentityItem::parse(item)?;
            self.outputs.push_back(Output::Identified(DeviceIdentity {
                vendor: item.vendor,
                device_type: item.device_type,
                product_code: item.product_code,
                major_revision: item.revision.0,
                minor_revision: item.revision.1,
                status: item.status,
                serial_number: item.serial_number,
                product_name: String::from_utf8_lossy(item.product_name).into_owned(),
            }));
        }
        self.register(now);
        Ok(())
    }

    fn take_registration(&mut self, now: MonotonicTime, packet: &Packet<'_>) -> Result<(), Error> {
        RegisterSession::parse(packet.data)?;
        self.handle = packet.session_handle;
        self.outputs.push_back(Output::Registered(self.handle));
        if self.resuming {
            (self.resuming, self.state) = (false, State::Open);
            return Ok(());
        }
        self.ask_object(now, Exchange::ReadIdentity, IDENTITY, Ok(Vec::new()), None);
        Ok(())
    }

    fn take_reply(&mut self, now: MonotonicTime, exchange: Exchange, data: &[u8]) -> Result<(), Error> {
        let packet = EncapsulatedPacket::parse(data)?.packet;
        let missing = Error::truncated("unconnected data item", 0, 4, 0);
        let reply = Reply::parse(packet.find(ItemType::UNCONNECTED_DATA).ok_or(missing)?)?;
        let service = service_of(exchange);
        if reply.service != service {
            let (found, expected) = (u32::from(reply.service.0), u32::from(service.0));
            return Err(Error::invalid("reply service", 0, expected, found));
        }
        if let Exchange::Message(service) = exchange {
            self.state = State::Open;
            let answer = Answer {
                service,
                status: reply.status.0,
                extended: reply.extended.first().copied(),
                data: reply.data.to_vec(),
            };
            self.outputs.push_back(Output::Answered(self.asker, Ok(answer)));
            return Ok(());
        }
        if exchange == Exchange::KeepAlive {
            // Whatever the device thinks of the attribute, it has answered.
            self.state = State::Open;
            return Ok(());
        }
        if reply.status != GeneralStatus::SUCCESS {
            let failure = Failure::Explicit {
                exchange,
                general: reply.status.0,
                extended: reply.extended.first().copied(),
                detail: reply.extended.get(1).copied(),
            };
            self.fail(failure);
            return Ok(());
        }
        match exchange {
            Exchange::ReadIdentity => {
                self.outputs.push_back(Output::Identified(parse_identity(reply.data)?));
                self.forward_open(now);
            }
            Exchange::ForwardClose => self.unregister(),
            _ => self.take_forward_open(&reply, &packet)?,
        }
        Ok(())
    }

    fn take_forward_open(&mut self, reply: &Reply<'_>, packet: &CommonPacket<'_>) -> Result<(), Error> {
        let open = ForwardOpenReply::parse(reply.data)?;
        if open.triad != self.triad {
            let found = u32::from(open.triad.connection_serial);
            let expected = u32::from(self.triad.connection_serial);
            return Err(Error::invalid("connection triad", 8, expected, found));
        }
        let destination = packet.find(ItemType::SOCKADDR_O_TO_T).map(SockaddrInfo::parse).transpose()?;
        // From here on the connection is there and has to be closed, whatever is wrong with it.
        self.state = State::Open;
        if open.o_to_t_api_us != self.rpi_us || open.t_to_o_api_us != self.rpi_us {
            self.outputs.push_back(Output::Failed(Failure::PacketInterval {
                requested_us: self.rpi_us,
                o_to_t_us: open.o_to_t_api_us,
                t_to_o_us: open.t_to_o_api_us,
            }));
            return Ok(());
        }
        self.outputs.push_back(Output::Opened(Opened {
            o_to_t_id: open.o_to_t_id,
            t_to_o_id: open.t_to_o_id,
            destination: destination.map(|info| info.address),
        }));
        Ok(())
    }

    fn register(&mut self, now: MonotonicTime) {
        let mut data = [0; 4];
        let block = RegisterSession { protocol_version: PROTOCOL_VERSION, options: 0 };
        match block.emit(&mut data) {
            Ok(_) => self.ask(now, Exchange::RegisterSession, Command::REGISTER_SESSION, &data),
            Err(error) => {
                self.fail(Failure::AnswerMalformed { exchange: Exchange::RegisterSession, error });
            }
        }
    }

    fn unregister(&mut self) {
        if self.handle != 0 {
            self.context += 1;
            self.send(Command::UNREGISTER_SESSION, &[]);
        }
        self.state = State::Closed;
        self.outputs.push_back(Output::Closed);
    }

    fn forward_open(&mut self, now: MonotonicTime) {
        let parameters = NetworkParameters {
            redundant_owner: false,
            connection_type: ConnectionType::POINT_TO_POINT,
            priority: Priority::URGENT,
            variable: self.variable,
            size: self.connection_size,
        };
        let large = self.connection_size > SMALL_SIZE_MAX;
        let open = ForwardOpen {
            large,
            priority_tick: TIME_TICK,
            timeout_ticks: TIME_OUT_TICKS,
            o_to_t_id: 0,
            t_to_o_id: self.t_to_o_id,
            triad: self.triad,
            timeout_multiplier: self.timeout_multiplier,
            o_to_t_rpi_us: self.rpi_us,
            o_to_t: parameters,
            t_to_o_rpi_us: self.rpi_us,
            t_to_o: parameters,
            transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
            path: &self.path,
        };
        let exchange = if large { Exchange::LargeForwardOpen } else { Exchange::ForwardOpen };
        let mut data = vec![0; open.buffer_len()];
        let length = open.emit(&mut data);
        let port = self.t_to_o_port;
        self.ask_object(now, exchange, CONNECTION_MANAGER, length.map(|_| data), port);
    }

    /// Sends a request to instance 1 of `class` as an unconnected message, with the UDP port for answers if
    /// one is given.
    fn ask_object(
        &mut self,
        now: MonotonicTime,
        exchange: Exchange,
        class: u16,
        data: Result<Vec<u8>, Error>,
        port: Option<u16>,
    ) {
        match data.and_then(|data| unconnected(service_of(exchange), class, 1, None, &data, port)) {
            Ok(block) => self.ask(now, exchange, Command::SEND_RR_DATA, &block),
            Err(error) => self.fail(Failure::AnswerMalformed { exchange, error }),
        }
    }

    fn ask(&mut self, now: MonotonicTime, exchange: Exchange, command: Command, data: &[u8]) {
        self.context += 1;
        self.asked_at = now;
        self.state = State::Asked { exchange, since: now };
        self.send(command, data);
    }

    fn send(&mut self, command: Command, data: &[u8]) {
        let packet = Packet {
            command,
            session_handle: self.handle,
            status: EncapsulationStatus::SUCCESS,
            sender_context: self.context.to_le_bytes(),
            options: 0,
            data,
        };
        let start = self.sent.len();
        self.sent.resize(start + packet.buffer_len(), 0);
        // The room is right and no request here comes near 65535 bytes.
        if packet.emit(&mut self.sent[start..]).is_err() {
            self.sent.truncate(start);
        }
    }

    /// A failed Forward_Close leaves nothing more to be done than to end the session. A session that fails beside an open
    /// connection is lost, and does not take the connection with it.
    fn fail(&mut self, failure: Failure) {
        if self.resuming || matches!(self.state, State::Asked { exchange: Exchange::KeepAlive, .. }) {
            self.lose();
            self.outputs.push_back(Output::Lost);
            return;
        }
        if matches!(self.state, State::Asked { exchange: Exchange::Message(_), .. }) {
            self.state = State::Open;
            self.outputs.push_back(Output::Answered(self.asker, Err(failure)));
            return;
        }
        let closing = matches!(self.state, State::Asked { exchange: Exchange::ForwardClose, .. });
        self.state = State::Idle;
        self.outputs.push_back(Output::Failed(failure));
        if closing {
            self.unregister();
        }
    }
}

const fn command_of(exchange: Exchange) -> Command {
    match exchange {
        Exchange::ListIdentity => Command::LIST_IDENTITY,
        Exchange::RegisterSession => Command::REGISTER_SESSION,
        _ => Command::SEND_RR_DATA,
    }
}

const fn service_of(exchange: Exchange) -> Service {
    match exchange {
        Exchange::ForwardOpen => Service::FORWARD_OPEN,
        Exchange::LargeForwardOpen => Service::LARGE_FORWARD_OPEN,
        Exchange::ForwardClose => Service::FORWARD_CLOSE,
        Exchange::Message(service) => Service(service),
        Exchange::KeepAlive => Service::GET_ATTRIBUTE_SINGLE,
        _ => Service::GET_ATTRIBUTES_ALL,
    }
}

/// Electronic key, 20 42 2C 51 2C 02, and the configuration block of format revision 1: clause 7-1.1.
fn connection_path(config: &ControllerConfig) -> Vec<u8> {
    let key = &config.key;
    let mut block = [0; 8];
    block[0] = CONFIGURATION_REVISION;
    if let Some(id) = config.power_structure {
        block[1] = VERIFY_POWER_RATING;
        block[4..].copy_from_slice(&id.to_le_bytes());
    }
    let segments = [
        Segment::Key(ElectronicKey {
            vendor: key.vendor,
            device_type: key.device_type,
            product_code: key.product_code,
            compatible: key.compatible,
            major: key.major_revision,
            minor: key.minor_revision,
        }),
        Segment::class(MOTION_DEVICE_AXIS),
        Segment::connection_point(CONFIGURATION_POINT),
        Segment::connection_point(u16::from(config.format_revision)),
        Segment::Data(&block),
    ];
    let mut path = vec![0; path_len(&segments, Encoding::Padded)];
    // Only a major revision above 127 could fail, which the configuration check refuses.
    if emit_path(&segments, Encoding::Padded, &mut path).is_err() {
        path.clear();
    }
    path
}

fn unconnected(
    service: Service,
    class: u16,
    instance: u16,
    attribute: Option<u16>,
    data: &[u8],
    port: Option<u16>,
) -> Result<Vec<u8>, Error> {
    let mut path = [0; 16];
    let segments: Vec<_> = [Segment::class(class), Segment::instance(u32::from(instance))]
        .into_iter()
        .chain(attribute.map(Segment::attribute))
        .collect();
    let length = emit_path(&segments, Encoding::Padded, &mut path)?;
    let request = Request { service, path: &path[..length], data };
    let mut message = vec![0; request.buffer_len()];
    request.emit(&mut message)?;
    let mut items = vec![
        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
        Item { item_type: ItemType::UNCONNECTED_DATA, data: &message },
    ];
    let mut address = [0; SOCKADDR_LEN];
    if let Some(port) = port {
        SockaddrInfo { address: SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port) }.emit(&mut address)?;
        items.push(Item { item_type: ItemType::SOCKADDR_T_TO_O, data: &address });
    }
    let packet = EncapsulatedPacket { interface_handle: 0, timeout_s: 0, packet: CommonPacket::new(&items) };
    let mut block = vec![0; packet.buffer_len()];
    packet.emit(&mut block)?;
    Ok(block)
}

/// Attributes 1 to 7 of the Identity object in order; a device may append more.
fn parse_identity(data: &[u8]) -> Result<DeviceIdentity, Error> {
    let mut r = Reader::new(data);
    let mut identity = DeviceIdentity {
        vendor: r.u16("vendor ID")?,
        device_type: r.u16("device type")?,
        product_code: r.u16("product code")?,
        major_revision: r.u8("major revision")?,
        minor_revision: r.u8("minor revision")?,
        status: r.u16("status")?,
        serial_number: r.u32("serial number")?,
        product_name: String::new(),
    };
    let length = r.u8("product name length")?;
    let name = r.take("product name", usize::from(length))?;
    identity.product_name = String::from_utf8_lossy(name).into_owned();
    Ok(identity)
}
