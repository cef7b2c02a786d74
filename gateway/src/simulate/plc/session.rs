//! The explicit side of the simulated controller: a session, and the Connection Manager of the device.

use std::io::{Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4, TcpStream};
use std::time::Duration;

use profile_cip::assembly::Assemblies;
use profile_cip::assembly::layout::CONFIGURATION_POINT;
use profile_cip::wire::ConnectionTriad;
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

use super::{Plan, PlcError, socket};

/// How long the device may take for an explicit answer.
const ANSWER: Duration = Duration::from_secs(5);

/// Time-out multiplier of the connection: the code of the Forward_Open, and the intervals of silence that it stands for.
const TIMEOUT_MULTIPLIER: u8 = 2;
pub(super) const TIMEOUT_INTERVALS: u32 = 4 << TIMEOUT_MULTIPLIER;

/// The connection IDs of an open connection, O->T and T->O, and its triad.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ids {
    pub o_to_t: u32,
    pub t_to_o: u32,
    pub triad: ConnectionTriad,
}

/// An encapsulation session.
#[derive(Debug)]
pub(super) struct Session {
    stream: TcpStream,
    handle: u32,
    /// Address of this side.
    pub local: Ipv4Addr,
    /// Connections opened.
    opened: u16,
}

impl Session {
    /// Registers a session at the device.
    pub fn open(address: Ipv4Addr) -> Result<Self, PlcError> {
        let to = SocketAddrV4::new(address, EXPLICIT_PORT);
        let stream = TcpStream::connect_timeout(&to.into(), ANSWER).map_err(socket("cannot connect"))?;
        stream.set_read_timeout(Some(ANSWER)).map_err(socket("cannot connect"))?;
        let IpAddr::V4(local) = stream.local_addr().map_err(socket("cannot connect"))?.ip() else {
            return Err(PlcError::Answer("connect"));
        };
        let mut session = Self { stream, handle: 0, local, opened: 0 };
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

    /// Opens a connection as owner, whose data are received at `port`.
    pub fn forward_open(&mut self, plan: &Plan, port: u16) -> Result<Ids, PlcError> {
        let direction = |size| NetworkParameters {
            redundant_owner: false,
            connection_type: ConnectionType::POINT_TO_POINT,
            priority: Priority::SCHEDULED,
            variable: false,
            size,
        };
        let interval = u32::try_from(plan.interval.as_micros()).unwrap_or(u32::MAX);
        let serial = u32::from(port) << 16 | std::process::id() & 0xFFFF;
        self.opened = self.opened.wrapping_add(1);
        let connection_serial = port.wrapping_add(self.opened);
        let triad =
            ConnectionTriad { connection_serial, originator_vendor: 0xFFFF, originator_serial: serial };
        let (o_to_t, t_to_o) = (plan.assemblies.o_to_t_size(), plan.assemblies.t_to_o_size());
        let path = path(&plan.assemblies);
        let open = ForwardOpen {
            large: o_to_t.max(t_to_o) > profile_cip::wire::network_parameters::SMALL_SIZE_MAX,
            priority_tick: 5,
            timeout_ticks: 157,
            o_to_t_id: 0,
            t_to_o_id: serial.wrapping_add(u32::from(self.opened)),
            triad,
            timeout_multiplier: TIMEOUT_MULTIPLIER,
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

    /// Closes it.
    pub fn forward_close(&mut self, plan: &Plan, ids: Ids) -> Result<(), PlcError> {
        let path = path(&plan.assemblies);
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
