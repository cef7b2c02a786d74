//! EtherNet/IP: encapsulation, common packet format, and which request a reply answers.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, ItemType};
use profile_cip::wire::encapsulation::{Command, EXPLICIT_PORT, HEADER_LEN, Header, Packet};
use profile_cip::wire::list_identity::IdentityItem;
use profile_cip::wire::list_services::ServicesItem;
use profile_cip::wire::register_session::RegisterSession;
use profile_cip::wire::sockaddr::SockaddrInfo;
use profile_cip::wire::status::REPLY_BIT;

use super::Protocol;
use super::connections::{Connection, Connections, Direction};
use super::explicit::{self, Asked, Effect, unreadable};
use super::packet::{Segment, is_io};
use super::stream::{Arrival, Streams};
use super::text::Text;

/// Requests waiting for their reply; the oldest is forgotten.
const PENDING_MAX: usize = 256;

const FLAGS: [(u8, &str); 3] = [(0x02, "SYN"), (0x01, "FIN"), (0x04, "RST")];

/// By what a reply finds its request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Key {
    client: SocketAddrV4,
    server: SocketAddrV4,
    session: u32,
    /// Sender context of an unconnected message, sequence count of a connected one.
    message: [u8; 8],
    connected: bool,
}

/// What is known so far.
#[derive(Debug, Default)]
pub(super) struct EtherNetIp {
    streams: Streams,
    context: Context,
}

/// What one message may need from another.
#[derive(Debug, Default)]
struct Context {
    connections: Connections,
    pending: VecDeque<(Key, Asked)>,
    /// Replies since they were taken, where somebody takes them.
    replies: Option<Vec<Answered>>,
}

/// A CIP reply of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Answered {
    /// The last class that its request names; `None` where the request was not seen.
    pub class: Option<u32>,
    /// The reply.
    pub reply: Vec<u8>,
}

impl EtherNetIp {
    /// One that collects the replies for [`Self::take_replies`].
    pub fn collecting() -> Self {
        Self { context: Context { replies: Some(Vec::new()), ..Context::default() }, ..Self::default() }
    }

    /// The replies since the last call.
    pub fn take_replies(&mut self) -> Vec<Answered> {
        self.context.replies.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The target of a connection, and whether it is one of CIP Motion.
    pub fn connection(&self, id: u32, from: Ipv4Addr, to: Ipv4Addr) -> Option<(Ipv4Addr, bool)> {
        let (connection, _) = self.context.connections.find(id, from, to)?;
        Some((connection.target, connection.opening.motion))
    }

    /// A UDP datagram.
    pub fn datagram(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        payload: &[u8],
        text: &mut Text,
    ) -> Protocol {
        if to.port() == EXPLICIT_PORT || from.port() == EXPLICIT_PORT {
            match Packet::parse(payload) {
                Ok(packet) => self.context.message(from, to, &packet, text),
                Err(error) => unreadable(text, 1, "encapsulation message", error, payload),
            }
        } else if is_io(from, to) {
            match Class1Datagram::parse(payload) {
                Ok(datagram) => self.context.class1(from, to, &datagram, text),
                Err(error) => unreadable(text, 1, "class 1 datagram", error, payload),
            }
        } else {
            text.append(format_args!("with {} bytes, not decoded", payload.len()));
            return Protocol::Other;
        }
        Protocol::EtherNetIp
    }

    /// A TCP segment.
    pub fn segment(&mut self, segment: &Segment<'_>, text: &mut Text) -> Protocol {
        if segment.to.port() != EXPLICIT_PORT && segment.from.port() != EXPLICIT_PORT {
            text.append(format_args!("with {} bytes, not decoded", segment.payload.len()));
            return Protocol::Other;
        }
        for (flag, name) in FLAGS {
            if segment.flags & flag != 0 {
                text.append(format_args!("{name}"));
            }
        }
        let Self { streams, context } = self;
        streams.segment(segment, |arrival, bytes| {
            match arrival {
                Arrival::InOrder => {}
                Arrival::Repeated => {
                    text.line(1, format_args!("repeated"));
                    return 0;
                }
                Arrival::Gap(missing) => {
                    text.line(1, format_args!("{missing} bytes before it are missing in the recording"));
                }
            }
            context.stream(segment.from, segment.to, bytes, text)
        });
        Protocol::EtherNetIp
    }
}

impl Context {
    /// Messages at the start of a stream's bytes; returns how many bytes they take.
    fn stream(&mut self, from: SocketAddrV4, to: SocketAddrV4, bytes: &[u8], text: &mut Text) -> usize {
        let mut used = 0;
        loop {
            let rest = &bytes[used..];
            if rest.is_empty() {
                return used;
            }
            let Ok(header) = Header::parse(rest) else {
                text.line(1, format_args!("{} bytes of a message that goes on in a later frame", rest.len()));
                return used;
            };
            if header.command.name().is_none() {
                // Lost in the stream: nothing reports where the next message begins.
                text.line(1, format_args!("{} bytes that are no encapsulation message", rest.len()));
                text.bytes(2, "bytes", rest);
                return bytes.len();
            }
            let length = HEADER_LEN + usize::from(header.length);
            let Some(message) = rest.get(..length) else {
                text.line(
                    1,
                    format_args!(
                        "{} of {length} bytes of a message that goes on in a later frame",
                        rest.len()
                    ),
                );
                return used;
            };
            match Packet::parse(message) {
                Ok(packet) => self.message(from, to, &packet, text),
                Err(error) => unreadable(text, 1, "encapsulation message", error, message),
            }
            used += length;
        }
    }

    fn message(&mut self, from: SocketAddrV4, to: SocketAddrV4, packet: &Packet<'_>, text: &mut Text) {
        text.line(1, format_args!("{packet}"));
        match packet.command {
            Command::REGISTER_SESSION => match RegisterSession::parse(packet.data) {
                Ok(register) => text.line(2, format_args!("{register}")),
                Err(error) => unreadable(text, 2, "session data", error, packet.data),
            },
            Command::LIST_IDENTITY | Command::LIST_SERVICES | Command::LIST_INTERFACES
                if !packet.data.is_empty() =>
            {
                match CommonPacket::parse(packet.data) {
                    Ok(items) => list_reply(&items, text),
                    Err(error) => unreadable(text, 2, "items", error, packet.data),
                }
            }
            Command::SEND_RR_DATA | Command::SEND_UNIT_DATA if !packet.data.is_empty() => {
                match EncapsulatedPacket::parse(packet.data) {
                    Ok(data) => self.items(from, to, packet, &data.packet, text),
                    Err(error) => unreadable(text, 2, "items", error, packet.data),
                }
            }
            _ => text.bytes(2, "data", packet.data),
        }
    }

    fn items(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        packet: &Packet<'_>,
        items: &CommonPacket<'_>,
        text: &mut Text,
    ) {
        let to_server = to.port() == EXPLICIT_PORT;
        let (client, server) = if to_server { (from, to) } else { (to, from) };
        let mut key = Key {
            client,
            server,
            session: packet.session_handle,
            message: packet.sender_context,
            connected: false,
        };
        for item in &items.items {
            match item.item_type {
                ItemType::NULL_ADDRESS if item.data.is_empty() => {}
                ItemType::UNCONNECTED_DATA => self.cip(key, item.data, text),
                ItemType::CONNECTED_ADDRESS if item.data.len() == 4 => {
                    let id = [item.data[0], item.data[1], item.data[2], item.data[3]].map(u32::from);
                    let id = id[0] | id[1] << 8 | id[2] << 16 | id[3] << 24;
                    text.line(2, format_args!("connection {id:#010x}"));
                }
                ItemType::CONNECTED_DATA if item.data.len() >= 2 => {
                    let (count, message) = item.data.split_at(2);
                    text.line(2, format_args!("sequence count {}", u16::from_le_bytes([count[0], count[1]])));
                    key.message = [count[0], count[1], 0, 0, 0, 0, 0, 0];
                    key.connected = true;
                    self.cip(key, message, text);
                }
                ItemType::SOCKADDR_O_TO_T | ItemType::SOCKADDR_T_TO_O => {
                    match SockaddrInfo::parse(item.data) {
                        Ok(info) => text.line(2, format_args!("{} {}", item.item_type, info.address)),
                        Err(error) => unreadable(text, 2, "socket address", error, item.data),
                    }
                }
                other => {
                    text.line(2, format_args!("item {other}"));
                    text.bytes(3, "data", item.data);
                }
            }
        }
    }

    /// A request or a reply: a reply has the top bit of its service set.
    fn cip(&mut self, key: Key, bytes: &[u8], text: &mut Text) {
        if bytes.first().is_none_or(|service| service & REPLY_BIT == 0) {
            if let Some(asked) = explicit::request(bytes, 2, text) {
                self.pending.retain(|(known, _)| *known != key);
                if self.pending.len() == PENDING_MAX {
                    self.pending.pop_front();
                }
                self.pending.push_back((key, asked));
            }
            return;
        }
        let index = self.pending.iter().position(|(known, _)| *known == key);
        let asked = index.and_then(|index| self.pending.remove(index)).map(|(_, asked)| asked);
        if let Some(replies) = &mut self.replies {
            let class = asked.and_then(|asked| asked.class);
            replies.push(Answered { class, reply: bytes.to_vec() });
        }
        match explicit::reply(bytes, asked, 2, text) {
            Some(Effect::Opened { opening, o_to_t_id, t_to_o_id }) => self.connections.opened(Connection {
                opening,
                originator: *key.client.ip(),
                target: *key.server.ip(),
                o_to_t_id,
                t_to_o_id,
            }),
            Some(Effect::Closed(triad)) => self.connections.closed(&triad),
            None => {}
        }
    }

    fn class1(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        datagram: &Class1Datagram<'_>,
        text: &mut Text,
    ) {
        text.line(1, format_args!("{datagram}"));
        let found = self.connections.find(datagram.connection_id, *from.ip(), *to.ip());
        let expected = found.map(|(connection, direction)| {
            let arrow = match direction {
                Direction::OriginatorToTarget => "O->T",
                Direction::TargetToOriginator => "T->O",
            };
            text.append(format_args!("({arrow} of {})", connection.opening.triad));
            connection.opening.motion && connection.opening.transport_class <= 1
        });
        explicit::class1(datagram, expected, 1, text);
    }
}

fn list_reply(items: &CommonPacket<'_>, text: &mut Text) {
    for item in &items.items {
        match item.item_type {
            ItemType::IDENTITY => match IdentityItem::parse(item.data) {
                Ok(identity) => text.line(2, format_args!("{identity}")),
                Err(error) => unreadable(text, 2, "identity", error, item.data),
            },
            ItemType::SERVICES => match ServicesItem::parse(item.data) {
                Ok(services) => text.line(2, format_args!("{services}")),
                Err(error) => unreadable(text, 2, "services", error, item.data),
            },
            other => {
                text.line(2, format_args!("item {other}"));
                text.bytes(3, "data", item.data);
            }
        }
    }
}
