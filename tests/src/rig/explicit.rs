//! Explicit messages to the box, beside the stream of the controller.

use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::device::adapter::SessionSlot;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{Command, EncapsulationStatus, HEADER_LEN, Header, Packet};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::status::Service;

use super::Rig;
use super::motion::millis;

/// A client with a session of its own.
#[derive(Debug, Clone, Copy)]
pub struct Client {
    slot: SessionSlot,
    handle: u32,
}

/// An encapsulation packet.
///
/// # Panics
/// When the data are too long for one.
#[must_use]
pub fn packet(command: Command, session_handle: u32, data: &[u8]) -> Vec<u8> {
    let status = EncapsulationStatus::SUCCESS;
    let packet = Packet { command, session_handle, status, sender_context: *b"explicit", options: 0, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).expect("it fits");
    bytes
}

impl Client {
    /// Opens a stream from this address and registers a session.
    ///
    /// # Panics
    /// When the box has no room for another stream.
    #[must_use]
    pub fn connect(rig: &mut Rig, from: Ipv4Addr) -> Self {
        let slot = rig.open_stream(SocketAddrV4::new(from, 50_100)).expect("room for a stream");
        let answer = rig.exchange(slot, &packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]), millis(100));
        Self { slot, handle: Header::parse(&answer).expect("a header").session_handle }
    }

    /// Sends a service to an instance of the Motion Device Axis Object, with an attribute in the path for the single
    /// attribute services; returns general status and data.
    ///
    /// # Panics
    /// When there is no answer in time, or none that can be read.
    pub fn ask(
        &self,
        rig: &mut Rig,
        service: u8,
        instance: u8,
        attribute: Option<u16>,
        data: &[u8],
    ) -> (u8, Vec<u8>) {
        let mut path = vec![0x20, 0x42, 0x24, instance];
        if let Some(attribute) = attribute {
            path.extend([0x31, 0]);
            path.extend(attribute.to_le_bytes());
        }
        self.request(rig, service, &path, data)
    }

    /// Sets an attribute; `each` is called after each step until the answer is there. Returns the general status.
    ///
    /// # Panics
    /// When there is no answer in time, or none that can be read.
    pub fn set_while(
        &self,
        rig: &mut Rig,
        (instance, attribute): (u8, u16),
        value: &[u8],
        each: impl FnMut(&mut Rig),
    ) -> u8 {
        let [low, high] = attribute.to_le_bytes();
        let path = [0x20, 0x42, 0x24, instance, 0x31, 0, low, high];
        self.request_while(rig, 0x10, &path, value, each).0
    }

    /// The session.
    #[must_use]
    pub const fn handle(&self) -> u32 {
        self.handle
    }

    /// Sends a service to any object; returns general status and data.
    ///
    /// # Panics
    /// When there is no answer in time, or none that can be read.
    pub fn request(&self, rig: &mut Rig, service: u8, path: &[u8], data: &[u8]) -> (u8, Vec<u8>) {
        let (status, _, data) = self.request_extended(rig, service, path, data);
        (status, data)
    }

    /// Sends a service to any object; returns general status, first word of the extended status or 0, and data.
    ///
    /// # Panics
    /// When there is no answer in time, or none that can be read.
    pub fn request_extended(
        &self,
        rig: &mut Rig,
        service: u8,
        path: &[u8],
        data: &[u8],
    ) -> (u8, u16, Vec<u8>) {
        self.request_while(rig, service, path, data, |_| {})
    }

    fn request_while(
        &self,
        rig: &mut Rig,
        service: u8,
        path: &[u8],
        data: &[u8],
        each: impl FnMut(&mut Rig),
    ) -> (u8, u16, Vec<u8>) {
        let request = Request { service: Service(service), path, data };
        let mut message = vec![0; request.buffer_len()];
        request.emit(&mut message).expect("it fits");
        let items = [
            Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
            Item { item_type: ItemType::UNCONNECTED_DATA, data: &message },
        ];
        let body = EncapsulatedPacket { packet: CommonPacket::new(&items), ..EncapsulatedPacket::default() };
        let mut bytes = vec![0; body.buffer_len()];
        body.emit(&mut bytes).expect("it fits");
        let bytes = packet(Command::SEND_RR_DATA, self.handle, &bytes);
        let answer = rig.exchange_while(self.slot, &bytes, millis(500), each);
        let body = EncapsulatedPacket::parse(&answer[HEADER_LEN..]).expect("an answer");
        let reply = Reply::parse(body.packet.items[1].data).expect("a reply");
        (reply.status.0, reply.extended.first().copied().unwrap_or(0), reply.data.to_vec())
    }
}
