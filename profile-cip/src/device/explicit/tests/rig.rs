//! An adapter, its peers, and a motion device that answers what the test says.

use core::net::{Ipv4Addr, SocketAddrV4};

use arrayvec::ArrayVec;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::device::config::tests::device;
use crate::device::event::Event;
use crate::device::explicit::adapter::{Adapter, SessionSlot};
use crate::device::motion_link::*;
use crate::wire::ConnectionTriad;
use crate::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, HEADER_LEN, Header, Packet};
use crate::wire::forward_close::ForwardClose;
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::message_router::{Reply, Request};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use crate::wire::status::{GeneralStatus, Service};

pub const PATH_IDENTITY: &[u8] = &[0x20, 1, 0x24, 1];
pub const PATH_ROUTER: &[u8] = &[0x20, 2, 0x24, 1];
pub const PATH_MANAGER: &[u8] = &[0x20, 6, 0x24, 1];
/// Path and configuration block revision 1 of Volume 9 clause 7-1.1, power ratings to be verified.
pub const PATH_MOTION: &[u8] =
    &[0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 4, 1, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A];

pub const CONTEXT: [u8; 8] = *b"context!";

pub fn peer(last: u8) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, last), 50_000)
}

/// A packet as it came back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Received {
    pub header: Header,
    pub data: Vec<u8>,
}

/// An explicit reply as it came back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answered {
    pub service: u8,
    pub status: u8,
    pub extended: Vec<u16>,
    pub data: Vec<u8>,
}

impl Answered {
    pub fn parse(bytes: &[u8]) -> Self {
        let reply = Reply::parse(bytes).expect("a reply");
        Self {
            service: reply.service.0,
            status: reply.status.0,
            extended: reply.extended.to_vec(),
            data: reply.data.to_vec(),
        }
    }

    /// General status and first extended status.
    pub fn outcome(&self) -> (u8, u16) {
        (self.status, self.extended.first().copied().unwrap_or(0))
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Client {
    pub slot: SessionSlot,
    pub handle: u32,
}

pub struct Rig {
    pub adapter: Adapter,
    pub now: MonotonicTime,
}

pub fn message(service: Service, path: &[u8], data: &[u8]) -> Vec<u8> {
    let request = Request { service, path, data };
    let mut bytes = vec![0; request.buffer_len()];
    request.emit(&mut bytes).unwrap();
    bytes
}

pub fn packet(command: Command, session_handle: u32, data: &[u8]) -> Vec<u8> {
    let status = EncapsulationStatus::SUCCESS;
    let packet = Packet { command, session_handle, status, sender_context: CONTEXT, options: 0, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).unwrap();
    bytes
}

pub fn encapsulated(items: &[Item<'_>]) -> Vec<u8> {
    let body = EncapsulatedPacket { packet: CommonPacket::new(items), ..EncapsulatedPacket::default() };
    let mut bytes = vec![0; body.buffer_len()];
    body.emit(&mut bytes).unwrap();
    bytes
}

pub fn item(item_type: ItemType, data: &[u8]) -> Item<'_> {
    Item { item_type, data }
}

/// Items of an unconnected message.
pub fn unconnected(message: &[u8]) -> Vec<u8> {
    encapsulated(&[item(ItemType::NULL_ADDRESS, &[]), item(ItemType::UNCONNECTED_DATA, message)])
}

/// Items of a connected message.
pub fn connected(id: u32, sequence: u16, message: &[u8]) -> Vec<u8> {
    let data = [&sequence.to_le_bytes()[..], message].concat();
    encapsulated(&[
        item(ItemType::CONNECTED_ADDRESS, &id.to_le_bytes()),
        item(ItemType::CONNECTED_DATA, &data),
    ])
}

pub fn triad(connection_serial: u16) -> ConnectionTriad {
    ConnectionTriad { connection_serial, originator_vendor: 1, originator_serial: 0xCAFE }
}

pub fn point_to_point(size: u16) -> NetworkParameters {
    NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size,
    }
}

/// A Forward_Open of the motion connection that this device takes.
pub fn motion_open(serial: u16) -> ForwardOpen<'static> {
    ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 0x5500_0000 + u32::from(serial),
        triad: triad(serial),
        timeout_multiplier: 2,
        o_to_t_rpi_us: 2000,
        o_to_t: point_to_point(220),
        t_to_o_rpi_us: 2000,
        t_to_o: point_to_point(230),
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: PATH_MOTION,
    }
}

/// A Forward_Open of an explicit connection that this device takes.
pub fn explicit_open(serial: u16) -> ForwardOpen<'static> {
    ForwardOpen {
        o_to_t_rpi_us: 1_000_000,
        t_to_o_rpi_us: 1_000_000,
        o_to_t: point_to_point(500),
        t_to_o: point_to_point(500),
        transport: Transport { server: true, trigger: Trigger::APPLICATION, class: 3 },
        path: PATH_ROUTER,
        ..motion_open(serial)
    }
}

pub fn open_message(open: &ForwardOpen<'_>) -> Vec<u8> {
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).unwrap();
    message(open.service(), PATH_MANAGER, &data)
}

pub fn close_message(serial: u16) -> Vec<u8> {
    let close =
        ForwardClose { priority_tick: 5, timeout_ticks: 157, triad: triad(serial), path: PATH_MOTION };
    let mut data = vec![0; close.buffer_len()];
    close.emit(&mut data).unwrap();
    message(Service::FORWARD_CLOSE, PATH_MANAGER, &data)
}

impl Rig {
    pub fn new() -> Self {
        Self { adapter: Adapter::new(device()).unwrap(), now: MonotonicTime(1_000_000_000) }
    }

    pub fn with(change: impl FnOnce(&mut crate::device::config::AdapterConfig)) -> Self {
        let mut config = device();
        change(&mut config);
        Self { adapter: Adapter::new(config).unwrap(), now: MonotonicTime(1_000_000_000) }
    }

    pub fn pass(&mut self, time: DurationNs) {
        self.now = self.now + time;
        self.adapter.handle_time(self.now);
    }

    pub fn stream(&mut self, last: u8) -> SessionSlot {
        self.adapter.open(self.now, peer(last)).expect("a free slot")
    }

    /// A peer with a registered session.
    pub fn client(&mut self, last: u8) -> Client {
        let slot = self.stream(last);
        let reply = self.exchange(slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]));
        assert_eq!(reply.header.status, EncapsulationStatus::SUCCESS);
        Client { slot, handle: reply.header.session_handle }
    }

    pub fn feed(&mut self, slot: SessionSlot, bytes: &[u8]) {
        assert_eq!(self.adapter.handle_stream(self.now, slot, bytes), bytes.len(), "all taken");
    }

    /// Everything the adapter has to send, cut into packets.
    pub fn received(&mut self, slot: SessionSlot) -> Vec<Received> {
        let mut bytes = Vec::new();
        let mut chunk = [0; 100];
        loop {
            match self.adapter.poll_transmit(self.now, slot, &mut chunk) {
                0 => break,
                count => bytes.extend_from_slice(&chunk[..count]),
            }
        }
        let mut packets = Vec::new();
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            let header = Header::parse(rest).expect("a whole header");
            let end = HEADER_LEN + usize::from(header.length);
            packets.push(Received { header, data: rest[HEADER_LEN..end].to_vec() });
            rest = &rest[end..];
        }
        packets
    }

    /// Whether the adapter has nothing to send to that client.
    pub fn received_is_empty(&self, client: Client) -> bool {
        !self.adapter.ready().any(|slot| slot == client.slot)
    }

    /// Sends one packet and gets exactly one back.
    pub fn exchange(&mut self, slot: SessionSlot, bytes: &[u8]) -> Received {
        self.feed(slot, bytes);
        self.the_one(slot)
    }

    /// Status of an encapsulation packet that is refused.
    pub fn encapsulation_status(
        &mut self,
        client: Client,
        command: Command,
        data: &[u8],
    ) -> EncapsulationStatus {
        let reply = self.exchange(client.slot, &packet(command, client.handle, data));
        assert_eq!(reply.data, []);
        reply.header.status
    }

    pub fn the_one(&mut self, slot: SessionSlot) -> Received {
        let mut packets = self.received(slot);
        assert_eq!(packets.len(), 1, "one packet: {packets:02x?}");
        packets.remove(0)
    }

    pub fn send_unconnected(&mut self, client: Client, message: &[u8]) {
        self.feed(client.slot, &packet(Command::SEND_RR_DATA, client.handle, &unconnected(message)));
    }

    /// The one unconnected reply that is there, with all its items.
    pub fn unconnected_reply(&mut self, client: Client) -> (Answered, Vec<(ItemType, Vec<u8>)>) {
        let received = self.the_one(client.slot);
        assert_eq!(received.header.command, Command::SEND_RR_DATA);
        assert_eq!(received.header.status, EncapsulationStatus::SUCCESS);
        assert_eq!(received.header.session_handle, client.handle);
        assert_eq!(received.header.sender_context, CONTEXT);
        let body = EncapsulatedPacket::parse(&received.data).unwrap();
        assert_eq!(body.packet.items[0], item(ItemType::NULL_ADDRESS, &[]));
        assert_eq!(body.packet.items[1].item_type, ItemType::UNCONNECTED_DATA);
        let answered = Answered::parse(body.packet.items[1].data);
        (answered, body.packet.items.iter().map(|item| (item.item_type, item.data.to_vec())).collect())
    }

    /// An unconnected request that is answered without the motion device.
    pub fn ask(&mut self, client: Client, message: &[u8]) -> Answered {
        self.send_unconnected(client, message);
        self.unconnected_reply(client).0
    }

    pub fn get(&mut self, client: Client, path: &[u8], attribute: u8) -> Answered {
        let path = [path, &[0x30, attribute]].concat();
        self.ask(client, &message(Service::GET_ATTRIBUTE_SINGLE, &path, &[]))
    }

    /// Sends a connected message.
    pub fn send_connected(&mut self, client: Client, id: u32, sequence: u16, message: &[u8]) {
        let bytes = packet(Command::SEND_UNIT_DATA, client.handle, &connected(id, sequence, message));
        self.feed(client.slot, &bytes);
    }

    /// The one connected reply that is there: connection ID, sequence count, reply.
    pub fn connected_reply(&mut self, client: Client) -> (u32, u16, Answered) {
        let received = self.the_one(client.slot);
        assert_eq!(received.header.command, Command::SEND_UNIT_DATA);
        assert_eq!(received.header.status, EncapsulationStatus::SUCCESS);
        let body = EncapsulatedPacket::parse(&received.data).unwrap();
        let [address, data] = body.packet.items.as_slice() else { panic!("two items") };
        let id = u32::from_le_bytes(address.data.try_into().unwrap());
        let sequence = u16::from_le_bytes([data.data[0], data.data[1]]);
        (id, sequence, Answered::parse(&data.data[2..]))
    }

    /// Opens an explicit connection and returns its O->T ID.
    pub fn open_explicit(&mut self, client: Client, serial: u16) -> u32 {
        let answer = self.ask(client, &open_message(&explicit_open(serial)));
        assert_eq!(answer.outcome(), (0, 0));
        ForwardOpenReply::parse(&answer.data).unwrap().o_to_t_id
    }

    /// The one request the motion device gets.
    pub fn motion_request(&mut self) -> MotionRequest {
        let request = self.adapter.poll_motion().expect("a request for the motion device");
        assert_eq!(self.adapter.poll_motion(), None);
        request
    }

    /// The motion device takes the connection it was asked for.
    pub fn device_opens(&mut self) -> OpenParameters {
        let MotionRequest::Open(open) = self.motion_request() else { panic!("an open request") };
        self.complete(&MotionReply::Opened { token: open.token, outcome: Ok(()) });
        open
    }

    /// The motion device gives the connection up as it was asked.
    pub fn device_closes(&mut self) -> CloseParameters {
        let MotionRequest::Close(close) = self.motion_request() else { panic!("a close request") };
        self.complete(&MotionReply::Closed { token: close.token });
        close
    }

    /// The motion device answers an explicit request with these data.
    pub fn device_answers(&mut self, data: &[u8]) -> ExplicitRequest {
        let MotionRequest::Explicit(request) = self.motion_request() else { panic!("an explicit request") };
        let data = ArrayVec::try_from(data).unwrap();
        let reply = ExplicitReply { data, ..ExplicitReply::status(request.token, 0) };
        self.complete(&MotionReply::Explicit(reply));
        request
    }

    /// The motion device lets the box be started anew, or not.
    pub fn device_prepares_reset(&mut self, granted: bool) {
        let MotionRequest::PrepareReset(token) = self.motion_request() else { panic!("a reset request") };
        self.complete(&MotionReply::ResetPrepared { token, granted });
    }

    /// Answers whatever the motion device is asked, as a willing device does.
    pub fn device_obliges(&mut self) {
        while let Some(request) = self.adapter.poll_motion() {
            self.complete(&match request {
                MotionRequest::Open(open) => MotionReply::Opened { token: open.token, outcome: Ok(()) },
                MotionRequest::Close(close) => MotionReply::Closed { token: close.token },
                MotionRequest::Explicit(explicit) => {
                    MotionReply::Explicit(ExplicitReply::status(explicit.token, 0))
                }
                MotionRequest::PrepareReset(token) => MotionReply::ResetPrepared { token, granted: true },
            });
        }
    }

    pub fn complete(&mut self, reply: &MotionReply) -> Option<SessionSlot> {
        self.adapter.complete(self.now, reply)
    }

    /// Opens the motion connection.
    pub fn open_motion(&mut self, client: Client, serial: u16) -> OpenParameters {
        self.send_unconnected(client, &open_message(&motion_open(serial)));
        let open = self.device_opens();
        assert_eq!(self.unconnected_reply(client).0.outcome(), (0, 0));
        open
    }

    /// Sends a Forward_Open that is refused and returns the outcome.
    pub fn refused(&mut self, client: Client, open: &ForwardOpen<'_>) -> Answered {
        let answer = self.ask(client, &open_message(open));
        assert_ne!(answer.status, GeneralStatus::SUCCESS.0);
        assert_eq!(self.adapter.poll_motion(), None, "a refused request does not reach the device");
        answer
    }

    pub fn events(&mut self) -> Vec<Event> {
        core::iter::from_fn(|| self.adapter.poll_event()).collect()
    }
}
