//! A programmable controller that moves one axis through the assemblies of a device, over sockets.
//!
//! ```text
//! arm       word 0                 until the axis is not locked
//! enable    ENABLE                 until it is in operation
//! move      ENABLE, START          until the movement is done
//! disable   word 0                 until the torque is off
//! ```
//!
//! Whatever goes wrong, it disables, and closes the connection. It ends the same way when it is asked to stop.

use std::io::{self, Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use profile_cip::assembly::handshake::Status;
use profile_cip::assembly::layout::CONFIGURATION_POINT;
use profile_cip::assembly::{Assemblies, Control, Placed, RUN, Refusal};
use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{
    Command, EXPLICIT_PORT, EncapsulationStatus, HEADER_LEN, Header, Packet,
};
use profile_cip::wire::epath::{Encoding, Segment, emit_path, path_len};
use profile_cip::wire::forward_close::ForwardClose;
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_cip::wire::sockaddr::SockaddrInfo;
use profile_cip::wire::status::{ConnectionStatus, Service};
use profile_generic::fault::FaultCause;
use thiserror::Error;

use crate::sys::udp::PORT_IO;

/// How long the device may take for an explicit answer.
const ANSWER: Duration = Duration::from_secs(5);
/// How long the axis may take to be enabled, and to lose its torque.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// What the controller does.
#[derive(Debug)]
pub struct Plan<'a> {
    /// Address of the device.
    pub address: Ipv4Addr,
    /// Its assemblies.
    pub assemblies: &'a Assemblies,
    /// Place of the axis in them.
    pub axis: usize,
    /// Target, counts.
    pub target: i64,
    /// Velocity, counts/s.
    pub velocity: i64,
    /// Acceleration, counts/s^2; 0 takes the limit of the axis.
    pub acceleration: i64,
    /// Interval of both directions.
    pub interval: Duration,
    /// Longest movement.
    pub limit: Duration,
}

/// Why the axis is not at its target.
#[derive(Debug, Error)]
pub enum PlcError {
    /// A socket failed.
    #[error("{what}: {source}")]
    Socket {
        /// What was being done.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The device answered something else.
    #[error("{0}: the answer cannot be read")]
    Answer(&'static str),
    /// The device refused a service.
    #[error("{service} is refused with status {general:#04x}, extended {extended}")]
    Refused {
        /// The service.
        service: Service,
        /// General status.
        general: u8,
        /// First extended status.
        extended: ConnectionStatus,
    },
    /// The layout cannot carry the order.
    #[error("the layout of the device has no field `{0}` in the output or input")]
    Field(&'static str),
    /// A value does not fit its field.
    #[error("{value} does not fit the field `{field}`")]
    Value {
        /// The field.
        field: &'static str,
        /// The value.
        value: i64,
    },
    /// The axis refused an order.
    #[error("the axis refuses to {step}: {refusal}")]
    Order {
        /// What was to be done.
        step: &'static str,
        /// Why not.
        refusal: Refusal,
    },
    /// The axis has a fault.
    #[error("the axis has a fault: {0}")]
    Fault(FaultCause),
    /// It took too long.
    #[error("the axis did not {step} within {} s", limit.as_secs())]
    Late {
        /// What was to be done.
        step: &'static str,
        /// The time it had.
        limit: Duration,
    },
    /// It was asked to stop.
    #[error("stopped before the target")]
    Stopped,
}

fn socket(what: &'static str) -> impl Fn(io::Error) -> PlcError {
    move |source| PlcError::Socket { what, source }
}

/// Moves the axis to its target and takes its torque away; the position that the device shows then, in counts.
///
/// # Errors
/// See [`PlcError`].
pub fn run(plan: &Plan<'_>, stop: &AtomicBool, say: &mut dyn FnMut(&str)) -> Result<i64, PlcError> {
    let mut output = Output::new(plan)?;
    let input = Input::new(plan)?;
    let mut session = Session::open(plan.address)?;
    let io = UdpSocket::bind((session.local, 0)).map_err(socket("cannot open a UDP port"))?;
    let port = io.local_addr().map_err(socket("cannot open a UDP port"))?.port();
    let ids = session.forward_open(plan, port)?;
    say(&format!("connected to {}, interval {} us", plan.address, plan.interval.as_micros()));
    let mut line = Line { plan, io, ids, sent: 0, shown: vec![0; plan.assemblies.input_len()], heard: false };
    let mut moved =
        step(&mut line, &mut output, &input, (Control::empty(), "unlock", HANDSHAKE), stop, |status| {
            status.contains(Status::RUN) && !status.contains(Status::LOCKED)
        });
    for (word, name, done) in [
        (Control::ENABLE, "enable", Status::ENABLED),
        (Control::ENABLE | Control::START, "move", Status::DONE | Status::START_TAKEN),
    ] {
        if moved.is_ok() {
            let limit = if name == "move" { plan.limit } else { HANDSHAKE };
            moved = step(&mut line, &mut output, &input, (word, name, limit), stop, |status| {
                status.contains(done)
            });
            if moved.is_ok() {
                say(&format!("{name}: done, position {}", input.position(&line.shown)));
            }
        }
    }
    // Nothing stops this but its time.
    output.word(Control::empty());
    let begun = Instant::now();
    let mut off = false;
    while !off && begun.elapsed() < HANDSHAKE {
        line.exchange(&output.data)?;
        off = !input.status(&line.shown).contains(Status::TORQUE);
    }
    let closed = session.forward_close(plan, ids);
    moved?;
    closed?;
    if !off {
        return Err(PlcError::Late { step: "lose its torque", limit: HANDSHAKE });
    }
    say("disabled and closed");
    Ok(input.position(&line.shown))
}

/// Sends a word until `done`, or until something speaks against it.
fn step(
    line: &mut Line<'_>,
    output: &mut Output,
    input: &Input,
    (word, name, limit): (Control, &'static str, Duration),
    stop: &AtomicBool,
    done: impl Fn(Status) -> bool,
) -> Result<(), PlcError> {
    output.word(word);
    let begun = Instant::now();
    loop {
        line.exchange(&output.data)?;
        if stop.load(Ordering::Relaxed) {
            return Err(PlcError::Stopped);
        }
        let status = input.status(&line.shown);
        if line.heard && status.contains(Status::FAULT) {
            return Err(PlcError::Fault(input.fault(&line.shown)));
        }
        if line.heard && status.contains(Status::REFUSED) {
            return Err(PlcError::Order { step: name, refusal: input.refusal(&line.shown) });
        }
        if line.heard && done(status) {
            return Ok(());
        }
        if begun.elapsed() >= limit {
            return Err(PlcError::Late { step: name, limit });
        }
    }
}

/// The output assembly.
struct Output {
    data: Vec<u8>,
    control: Placed,
}

impl Output {
    fn new(plan: &Plan<'_>) -> Result<Self, PlcError> {
        let fields = plan.assemblies.output();
        let find = |name: &'static str| {
            fields.iter().find(|field| field.axis == plan.axis && field.name == name).copied()
        };
        let mut data = vec![0; plan.assemblies.output_len()];
        let mut put = |field: Placed, value: i64| {
            let bits = u32::try_from(8 * field.len - 1).unwrap_or(63);
            let fits = field.len == 8 || (-(1_i64 << bits)..1_i64 << bits).contains(&value);
            if !fits {
                return Err(PlcError::Value { field: field.name, value });
            }
            data[field.offset..field.offset + field.len].copy_from_slice(&value.to_le_bytes()[..field.len]);
            Ok(())
        };
        let control = find("control").ok_or(PlcError::Field("control"))?;
        let target = find("target_position_32").or_else(|| find("target_position_64"));
        put(target.ok_or(PlcError::Field("target_position_32"))?, plan.target)?;
        put(find("velocity").ok_or(PlcError::Field("velocity"))?, plan.velocity)?;
        match find("acceleration") {
            Some(field) => put(field, plan.acceleration)?,
            None if plan.acceleration != 0 => return Err(PlcError::Field("acceleration")),
            None => {}
        }
        if let Some(field) = find("mode") {
            put(field, 1)?;
        }
        Ok(Self { data, control })
    }

    fn word(&mut self, word: Control) {
        let at = self.control.offset;
        self.data[at..at + 2].copy_from_slice(&word.bits().to_le_bytes());
    }
}

/// Where the input assembly has what is looked at.
struct Input {
    status: Placed,
    position: Placed,
    refusal: Option<Placed>,
    fault: Option<Placed>,
}

impl Input {
    fn new(plan: &Plan<'_>) -> Result<Self, PlcError> {
        let fields = plan.assemblies.input();
        let find = |name: &'static str| {
            fields.iter().find(|field| field.axis == plan.axis && field.name == name).copied()
        };
        let position = find("actual_position_64").or_else(|| find("actual_position_32"));
        Ok(Self {
            status: find("status").ok_or(PlcError::Field("status"))?,
            position: position.ok_or(PlcError::Field("actual_position_32"))?,
            refusal: find("refusal"),
            fault: find("fault"),
        })
    }

    fn status(&self, data: &[u8]) -> Status {
        Status::from_bits_retain(word(data, &self.status))
    }

    fn fault(&self, data: &[u8]) -> FaultCause {
        FaultCause(self.fault.as_ref().map_or(0, |field| word(data, field)))
    }

    fn refusal(&self, data: &[u8]) -> Refusal {
        Refusal(self.refusal.as_ref().map_or(0, |field| data[field.offset]))
    }

    fn position(&self, data: &[u8]) -> i64 {
        let bytes = &data[self.position.offset..self.position.offset + self.position.len];
        let negative = bytes.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut octets = [if negative { 0xFF } else { 0 }; 8];
        octets[..bytes.len()].copy_from_slice(bytes);
        i64::from_le_bytes(octets)
    }
}

fn word(data: &[u8], field: &Placed) -> u16 {
    u16::from_le_bytes([data[field.offset], data[field.offset + 1]])
}

/// The connection IDs of an open connection, O->T and T->O, and its triad.
#[derive(Clone, Copy)]
struct Ids {
    o_to_t: u32,
    t_to_o: u32,
    triad: ConnectionTriad,
}

/// The class 1 connection.
struct Line<'a> {
    plan: &'a Plan<'a>,
    io: UdpSocket,
    ids: Ids,
    sent: u32,
    /// The last input assembly.
    shown: Vec<u8>,
    /// One has come.
    heard: bool,
}

impl Line<'_> {
    /// One interval: sends the output and takes what comes.
    fn exchange(&mut self, output: &[u8]) -> Result<(), PlcError> {
        let end = Instant::now() + self.plan.interval;
        let data = [&RUN.to_le_bytes()[..], output].concat();
        self.sent = self.sent.wrapping_add(1);
        let [low, high, ..] = self.sent.to_le_bytes();
        let datagram = Class1Datagram {
            connection_id: self.ids.o_to_t,
            encapsulation_sequence: self.sent,
            sequence_count: u16::from_le_bytes([low, high]),
            data: &data,
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).map_err(|_| PlcError::Answer("class 1"))?;
        self.io.send_to(&bytes, (self.plan.address, PORT_IO)).map_err(socket("cannot send"))?;
        let mut buffer = vec![0; CLASS1_HEADER_LEN + self.shown.len() + 1];
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            self.io.set_read_timeout(Some(left)).map_err(socket("cannot wait"))?;
            let (len, from) = match self.io.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(());
                }
                Err(source) => return Err(PlcError::Socket { what: "cannot receive", source }),
            };
            if from.ip() == IpAddr::V4(self.plan.address)
                && let Ok(datagram) = Class1Datagram::parse(&buffer[..len])
                && datagram.connection_id == self.ids.t_to_o
                && datagram.data.len() == self.shown.len()
            {
                self.shown.copy_from_slice(datagram.data);
                self.heard = true;
            }
        }
    }
}

/// An encapsulation session.
struct Session {
    stream: TcpStream,
    handle: u32,
    local: Ipv4Addr,
}

impl Session {
    fn open(address: Ipv4Addr) -> Result<Self, PlcError> {
        let to = SocketAddrV4::new(address, EXPLICIT_PORT);
        let stream = TcpStream::connect_timeout(&to.into(), ANSWER).map_err(socket("cannot connect"))?;
        stream.set_read_timeout(Some(ANSWER)).map_err(socket("cannot connect"))?;
        let IpAddr::V4(local) = stream.local_addr().map_err(socket("cannot connect"))?.ip() else {
            return Err(PlcError::Answer("connect"));
        };
        let mut session = Self { stream, handle: 0, local };
        let (header, _) = session.packet(Command::REGISTER_SESSION, &[1, 0, 0, 0])?;
        session.handle = header.session_handle;
        Ok(session)
    }

    fn packet(&mut self, command: Command, data: &[u8]) -> Result<(Header, Vec<u8>), PlcError> {
        let packet = Packet {
            command,
            session_handle: self.handle,
            status: EncapsulationStatus::SUCCESS,
            sender_context: *b"abridge0",
            options: 0,
            data,
        };
        let mut bytes = vec![0; packet.buffer_len()];
        packet.emit(&mut bytes).map_err(|_| PlcError::Answer("encapsulation"))?;
        self.stream.write_all(&bytes).map_err(socket("cannot send"))?;
        let mut header = [0; HEADER_LEN];
        self.stream.read_exact(&mut header).map_err(socket("no answer"))?;
        let header = Header::parse(&header).map_err(|_| PlcError::Answer("encapsulation"))?;
        let mut data = vec![0; usize::from(header.length)];
        self.stream.read_exact(&mut data).map_err(socket("no answer"))?;
        match header.status {
            EncapsulationStatus::SUCCESS => Ok((header, data)),
            _ => Err(PlcError::Answer("encapsulation")),
        }
    }

    /// A service of the Connection Manager; `port` is where data are received.
    fn ask(&mut self, service: Service, data: &[u8], port: Option<u16>) -> Result<Vec<u8>, PlcError> {
        let unread = |_| PlcError::Answer("Connection Manager");
        let request = Request { service, path: &[0x20, 0x06, 0x24, 0x01], data };
        let mut message = vec![0; request.buffer_len()];
        request.emit(&mut message).map_err(unread)?;
        let mut info = [0; 16];
        let address = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port.unwrap_or(0));
        SockaddrInfo { address }.emit(&mut info).map_err(unread)?;
        let mut items = vec![
            Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
            Item { item_type: ItemType::UNCONNECTED_DATA, data: &message },
        ];
        if port.is_some() {
            items.push(Item { item_type: ItemType::SOCKADDR_T_TO_O, data: &info });
        }
        let body = EncapsulatedPacket { packet: CommonPacket::new(&items), ..EncapsulatedPacket::default() };
        let mut bytes = vec![0; body.buffer_len()];
        body.emit(&mut bytes).map_err(unread)?;
        let (_, answer) = self.packet(Command::SEND_RR_DATA, &bytes)?;
        let body = EncapsulatedPacket::parse(&answer).map_err(unread)?;
        let item = body.packet.items.get(1).ok_or(PlcError::Answer("Connection Manager"))?;
        let reply = Reply::parse(item.data).map_err(unread)?;
        if reply.status.0 != 0 {
            let extended = ConnectionStatus(reply.extended.first().copied().unwrap_or(0));
            return Err(PlcError::Refused { service, general: reply.status.0, extended });
        }
        Ok(reply.data.to_vec())
    }

    fn forward_open(&mut self, plan: &Plan<'_>, port: u16) -> Result<Ids, PlcError> {
        let direction = |size| NetworkParameters {
            redundant_owner: false,
            connection_type: ConnectionType::POINT_TO_POINT,
            priority: Priority::SCHEDULED,
            variable: false,
            size,
        };
        let interval = u32::try_from(plan.interval.as_micros()).unwrap_or(u32::MAX);
        let serial = u32::from(port) << 16 | std::process::id() & 0xFFFF;
        let triad =
            ConnectionTriad { connection_serial: port, originator_vendor: 0xFFFF, originator_serial: serial };
        let (o_to_t, t_to_o) = (plan.assemblies.o_to_t_size(), plan.assemblies.t_to_o_size());
        let path = path(plan.assemblies);
        let open = ForwardOpen {
            large: o_to_t.max(t_to_o) > profile_cip::wire::network_parameters::SMALL_SIZE_MAX,
            priority_tick: 5,
            timeout_ticks: 157,
            o_to_t_id: 0,
            t_to_o_id: serial,
            triad,
            timeout_multiplier: 2,
            o_to_t_rpi_us: interval,
            o_to_t: direction(o_to_t),
            t_to_o_rpi_us: interval,
            t_to_o: direction(t_to_o),
            transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
            path: &path,
        };
        let mut data = vec![0; open.buffer_len()];
        open.emit(&mut data).map_err(|_| PlcError::Answer("Forward_Open"))?;
        let answer = self.ask(open.service(), &data, Some(port))?;
        let reply = ForwardOpenReply::parse(&answer).map_err(|_| PlcError::Answer("Forward_Open"))?;
        Ok(Ids { o_to_t: reply.o_to_t_id, t_to_o: reply.t_to_o_id, triad })
    }

    fn forward_close(&mut self, plan: &Plan<'_>, ids: Ids) -> Result<(), PlcError> {
        let path = path(plan.assemblies);
        let close = ForwardClose { priority_tick: 5, timeout_ticks: 157, triad: ids.triad, path: &path };
        let mut data = vec![0; close.buffer_len()];
        close.emit(&mut data).map_err(|_| PlcError::Answer("Forward_Close"))?;
        self.ask(Service::FORWARD_CLOSE, &data, None).map(|_| ())
    }
}

/// The path to the assemblies of an exclusive owner.
fn path(assemblies: &Assemblies) -> Vec<u8> {
    let path = [
        Segment::class(profile_cip::device::objects::class::CLASS_ASSEMBLY),
        Segment::connection_point(CONFIGURATION_POINT),
        Segment::connection_point(assemblies.output_point()),
        Segment::connection_point(assemblies.input_point()),
    ];
    let mut out = vec![0; path_len(&path, Encoding::Padded)];
    // The length is that of the path.
    let written = emit_path(&path, Encoding::Padded, &mut out).unwrap_or(0);
    out.truncate(written);
    out
}
