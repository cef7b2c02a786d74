//! A client of explicit messages.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};

use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{Command, EncapsulationStatus, HEADER_LEN, Header, Packet};
use profile_cip::wire::forward_close::ForwardClose;
use profile_cip::wire::forward_open::{ForwardOpen, Transport, Trigger};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_cip::wire::status::Service;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;

use super::LIMIT;

pub const PATH_IDENTITY: &[u8] = &[0x20, 1, 0x24, 1];
pub const PATH_AXIS_1: &[u8] = &[0x20, 0x42, 0x24, 1];
const PATH_MANAGER: &[u8] = &[0x20, 6, 0x24, 1];
/// Class, configuration point, I/O point, and the configuration block that asks for the power structure.
const PATH_MOTION: &[u8] = &[0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 4, 1, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A];

pub fn packet(command: Command, session_handle: u32, data: &[u8]) -> Vec<u8> {
    let status = EncapsulationStatus::SUCCESS;
    let sender_context = *b"context!";
    let packet = Packet { command, session_handle, status, sender_context, options: 0, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).unwrap();
    bytes
}

/// The one packet in `bytes`.
pub fn parse(bytes: &[u8]) -> (Header, Vec<u8>) {
    (Header::parse(bytes).unwrap(), Packet::parse(bytes).unwrap().data.to_vec())
}

pub fn message(service: Service, path: &[u8], data: &[u8]) -> Vec<u8> {
    let request = Request { service, path, data };
    let mut bytes = vec![0; request.buffer_len()];
    request.emit(&mut bytes).unwrap();
    bytes
}

/// Items of an unconnected message.
pub fn unconnected(message: &[u8]) -> Vec<u8> {
    let items = [
        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
        Item { item_type: ItemType::UNCONNECTED_DATA, data: message },
    ];
    let body = EncapsulatedPacket { packet: CommonPacket::new(&items), ..EncapsulatedPacket::default() };
    let mut bytes = vec![0; body.buffer_len()];
    body.emit(&mut bytes).unwrap();
    bytes
}

pub fn triad(connection_serial: u16) -> ConnectionTriad {
    ConnectionTriad { connection_serial, originator_vendor: 1, originator_serial: 0xCAFE }
}

/// A Forward_Open of the motion connection that the device of these tests takes.
pub fn motion_open(serial: u16) -> Vec<u8> {
    motion_open_at(serial, Priority::URGENT)
}

/// The same at another priority.
pub fn motion_open_at(serial: u16, priority: Priority) -> Vec<u8> {
    let size = |size| NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority,
        variable: true,
        size,
    };
    let open = ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 0x5500_0000 + u32::from(serial),
        triad: triad(serial),
        timeout_multiplier: 2,
        o_to_t_rpi_us: 2000,
        o_to_t: size(220),
        t_to_o_rpi_us: 2000,
        t_to_o: size(230),
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: PATH_MOTION,
    };
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).unwrap();
    message(open.service(), PATH_MANAGER, &data)
}

pub fn motion_close(serial: u16) -> Vec<u8> {
    let close =
        ForwardClose { priority_tick: 5, timeout_ticks: 157, triad: triad(serial), path: PATH_MOTION };
    let mut data = vec![0; close.buffer_len()];
    close.emit(&mut data).unwrap();
    message(Service::FORWARD_CLOSE, PATH_MANAGER, &data)
}

/// An explicit reply as it came back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answered {
    pub status: u8,
    pub extended: Option<u16>,
    pub data: Vec<u8>,
}

impl Answered {
    /// General status and first extended status.
    pub fn outcome(&self) -> (u8, u16) {
        (self.status, self.extended.unwrap_or(0))
    }
}

pub struct Client {
    pub stream: TcpStream,
    handle: u32,
}

impl Client {
    pub async fn connect(address: SocketAddrV4) -> Self {
        Self { stream: TcpStream::connect(address).await.unwrap(), handle: 0 }
    }

    /// From this address of the host.
    pub async fn connect_from(host: Ipv4Addr, address: SocketAddrV4) -> Self {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddrV4::new(host, 0).into()).unwrap();
        Self { stream: socket.connect(address.into()).await.unwrap(), handle: 0 }
    }

    pub async fn register(address: SocketAddrV4) -> Self {
        let mut client = Self::connect(address).await;
        client.register_session().await;
        client
    }

    pub async fn register_session(&mut self) {
        let (header, data) = self.exchange(&packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0])).await;
        assert_eq!((header.status, data.as_slice()), (EncapsulationStatus::SUCCESS, &[1, 0, 0, 0][..]));
        self.handle = header.session_handle;
    }

    pub fn local(&self) -> SocketAddrV4 {
        let SocketAddr::V4(local) = self.stream.local_addr().unwrap() else { panic!("an IPv4 stream") };
        local
    }

    pub async fn read_packet(&mut self) -> (Header, Vec<u8>) {
        let mut header = [0; HEADER_LEN];
        timeout(LIMIT, self.stream.read_exact(&mut header)).await.expect("an answer").unwrap();
        let header = Header::parse(&header).unwrap();
        let mut data = vec![0; usize::from(header.length)];
        timeout(LIMIT, self.stream.read_exact(&mut data)).await.expect("the rest").unwrap();
        (header, data)
    }

    pub async fn exchange(&mut self, bytes: &[u8]) -> (Header, Vec<u8>) {
        self.stream.write_all(bytes).await.unwrap();
        self.read_packet().await
    }

    /// A packet of this client's session.
    pub fn packet(&self, command: Command, data: &[u8]) -> Vec<u8> {
        packet(command, self.handle, data)
    }

    pub async fn send_message(&mut self, message: &[u8]) {
        let bytes = self.packet(Command::SEND_RR_DATA, &unconnected(message));
        self.stream.write_all(&bytes).await.unwrap();
    }

    pub async fn reply(&mut self) -> Answered {
        let (header, data) = self.read_packet().await;
        assert_eq!((header.command, header.status), (Command::SEND_RR_DATA, EncapsulationStatus::SUCCESS));
        let body = EncapsulatedPacket::parse(&data).unwrap();
        let reply = Reply::parse(body.packet.items[1].data).unwrap();
        let extended = reply.extended.first().copied();
        Answered { status: reply.status.0, extended, data: reply.data.to_vec() }
    }

    /// An unconnected request and its reply.
    pub async fn ask(&mut self, message: &[u8]) -> Answered {
        self.send_message(message).await;
        self.reply().await
    }

    /// An attribute that can be read.
    pub async fn get(&mut self, path: &[u8], attribute: u8) -> Vec<u8> {
        let path = [path, &[0x30, attribute]].concat();
        let answer = self.ask(&message(Service::GET_ATTRIBUTE_SINGLE, &path, &[])).await;
        assert_eq!(answer.outcome(), (0, 0));
        answer.data
    }

    /// Whether the server closes the stream, with whatever it has still to say.
    pub async fn is_closed(&mut self) -> bool {
        let mut bytes = [0; 4096];
        let closed = async { while !matches!(self.stream.read(&mut bytes).await, Ok(0) | Err(_)) {} };
        timeout(LIMIT, closed).await.is_ok()
    }
}
