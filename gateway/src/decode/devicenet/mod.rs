//! DeviceNet: frames by their identifiers, explicit messages and I/O messages put together from their fragments.
//!
//! What an I/O message is depends on what the master has asked before: the sizes of the connection tell whether it comes in
//! fragments, the device type which profile its contents belong to.

use std::fmt;

use profile_cip::device::config::DEVICE_TYPE_CIP_MOTION_DRIVE;
use profile_cip::device::identity::CLASS_IDENTITY;
use profile_cip::devicenet::connection::{CLASS_CONNECTION, ConnectionKind};
use profile_cip::devicenet::fragmentation::{ExplicitReceiver, FragmentError, IO_MAX, IoReceiver};
use profile_cip::devicenet::wire::allocation::{ALLOCATE, CLASS_DEVICENET, RELEASE};
use profile_cip::devicenet::wire::speed::{Assembly, SpeedActual, SpeedCommand};
use profile_cip::devicenet::wire::{
    AcknowledgeStatus, Allocate, AllocationChoice, BodyFormat, DuplicateMac, Fragment, FragmentKind, Header,
    Identifier, MacId, Request, Response,
};
use profile_cip::wire::Error;
use profile_cip::wire::motion::codes::ConnectionFormat;
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_cip::wire::status::Service;
use profile_generic::can::{Frame, Id};

use super::explicit::unreadable;
use super::text::Text;

/// Device types of the AC/DC drive profile: AC drive, DC drive.
const DEVICE_TYPES_SPEED: [u16; 2] = [0x02, 0x13];

/// Attribute of the Identity object.
const DEVICE_TYPE: u8 = 2;

/// Attributes of the Connection object.
const PRODUCED_SIZE: u8 = 7;
const CONSUMED_SIZE: u8 = 8;

/// What is known of a network.
#[derive(Debug)]
pub(super) struct Devicenet {
    nodes: Vec<Node>,
}

/// What is known of a slave.
#[derive(Debug, Clone, Default)]
struct Node {
    device_type: Option<u16>,
    /// By the instance of the connection, 1 first.
    sizes: [Sizes; ConnectionKind::ALL.len()],
    /// How connected requests name class and instance.
    format: BodyFormat,
    /// The request that a response will be to.
    asked: Option<Asked>,
    request: ExplicitReceiver,
    response: ExplicitReceiver,
    /// By [`Way`].
    io: [IoReceiver; 3],
}

/// Longest messages of a connection, as the slave has told them.
#[derive(Debug, Clone, Copy, Default)]
struct Sizes {
    produced: Option<u16>,
    consumed: Option<u16>,
}

/// A request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Asked {
    service: Service,
    class: u16,
    instance: u16,
    attribute: Option<u8>,
}

/// An I/O message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Of the master.
    Command,
    /// Of a slave that was polled.
    Answer,
    /// Of a slave by itself.
    Change,
}

impl Default for Devicenet {
    fn default() -> Self {
        Self { nodes: vec![Node::default(); MacId::COUNT] }
    }
}

impl Devicenet {
    /// Prints what a frame means.
    pub(super) fn frame(&mut self, frame: &Frame, text: &mut Text) {
        let identifier = match frame.id() {
            Id::Standard(bits) if !frame.is_fd() => Identifier::parse(bits).ok(),
            _ => None,
        };
        let Some(identifier) = identifier else {
            text.line(1, format_args!("no identifier of DeviceNet"));
            return;
        };
        text.line(1, format_args!("group {}: {identifier}", identifier.group()));
        if frame.is_remote() {
            text.line(2, format_args!("a remote frame, which DeviceNet does not have"));
            return;
        }
        let data = frame.data();
        match identifier {
            Identifier::DuplicateMacCheck(mac) => match DuplicateMac::parse(data) {
                Ok(message) => {
                    if !message.response {
                        // Whoever asks has just started: nothing of before counts.
                        *self.node(mac) = Node::default();
                    }
                    text.line(2, format_args!("{message}"));
                }
                Err(error) => unreadable(text, 2, "duplicate MAC ID check", error, data),
            },
            Identifier::UnconnectedRequest(mac) => self.node(mac).explicit(true, false, data, text),
            Identifier::ExplicitRequest(mac) => self.node(mac).explicit(true, true, data, text),
            Identifier::ExplicitResponse(mac) => self.node(mac).explicit(false, true, data, text),
            Identifier::PollCommand(mac) => self.node(mac).io(Way::Command, data, text),
            Identifier::PollResponse(mac) => self.node(mac).io(Way::Answer, data, text),
            Identifier::ChangeOfState(mac) => self.node(mac).io(Way::Change, data, text),
            Identifier::BitStrobeCommand(_) => strobe(data, text),
            _ => text.bytes(2, "data", data),
        }
    }

    fn node(&mut self, mac: MacId) -> &mut Node {
        &mut self.nodes[usize::from(mac.get())]
    }
}

/// A bit strobe has a bit for each MAC ID.
fn strobe(data: &[u8], text: &mut Text) {
    let is_set = |mac: &usize| data.get(mac / 8).is_some_and(|byte| byte >> (mac % 8) & 1 != 0);
    let set: Vec<String> = (0..MacId::COUNT).filter(is_set).map(|mac| mac.to_string()).collect();
    let set = if set.is_empty() { "none".to_owned() } else { set.join(", ") };
    text.line(2, format_args!("bits of MAC IDs: {set}"));
}

impl Node {
    /// An explicit message to the slave, or from it.
    fn explicit(&mut self, to_slave: bool, connected: bool, data: &[u8], text: &mut Text) {
        let Some((first, rest)) = data.split_first() else {
            text.line(2, format_args!("not readable: {}", FragmentError::Short));
            return;
        };
        let header = Header::parse(*first);
        text.line(2, format_args!("header: MAC ID {}, transaction {}", header.mac, u8::from(header.xid)));
        if !header.fragmented {
            self.body(to_slave, connected, rest, text);
            return;
        }
        let Some((byte, rest)) = rest.split_first() else {
            text.line(2, format_args!("not readable: {}", FragmentError::Short));
            return;
        };
        let fragment = Fragment::parse(*byte);
        text.line(2, format_args!("{fragment}"));
        if fragment.kind == FragmentKind::Acknowledge {
            match rest.first() {
                Some(status) => text.append(format_args!("{}", AcknowledgeStatus(*status))),
                None => text.append(format_args!("without its status")),
            }
            return;
        }
        text.bytes(3, "bytes", rest);
        let receiver = if to_slave { &mut self.request } else { &mut self.response };
        let received = receiver.handle(fragment, rest);
        if let Some(error) = received.error {
            text.line(3, format_args!("dropped: {error}"));
        }
        if received.complete {
            let body = receiver.body().to_vec();
            text.line(2, format_args!("put together, {} bytes", body.len()));
            self.body(to_slave, connected, &body, text);
        }
    }

    fn body(&mut self, to_slave: bool, connected: bool, body: &[u8], text: &mut Text) {
        if to_slave {
            let format = if connected { self.format } else { BodyFormat::CLASS_8_INSTANCE_8 };
            match Request::parse(format, body) {
                Ok(request) => self.asked = Some(asks(&request, text)),
                Err(error) => unreadable(text, 2, "request", error, body),
            }
        } else {
            match Response::parse(body) {
                Ok(response) => self.response(&response, text),
                Err(error) => unreadable(text, 2, "response", error, body),
            }
        }
    }

    /// Prints what an answer says, and keeps what later frames need.
    fn response(&mut self, response: &Response<'_>, text: &mut Text) {
        let asked = self.asked.take();
        let (service, data) = match response {
            Response::Success { service, data } => (*service, *data),
            Response::Error { .. } => {
                text.line(2, format_args!("{response}"));
                match asked {
                    Some(asked) => {
                        text.line(3, format_args!("{} request to {asked}", name(asked.service, asked.class)))
                    }
                    None => text.append(format_args!("(the request was not seen)")),
                }
                return;
            }
        };
        text.line(2, format_args!("{} response", name(service, asked.map_or(0, |asked| asked.class))));
        match asked {
            Some(asked) if asked.service == service => text.append(format_args!("of {asked}")),
            Some(_) => text.append(format_args!("(the request was another service)")),
            None => text.append(format_args!("(the request was not seen)")),
        }
        let Some(asked) = asked.filter(|asked| asked.service == service) else {
            text.bytes(3, "data", data);
            return;
        };
        let word = match data {
            [low, high] => Some(u16::from_le_bytes([*low, *high])),
            _ => None,
        };
        match (asked.class, asked.service, asked.attribute, data) {
            (class, Service(ALLOCATE), _, [format]) if class == u16::from(CLASS_DEVICENET) => {
                self.format = BodyFormat(format & 0x0F);
                text.line(3, format_args!("message body format {}", self.format));
            }
            (CLASS_IDENTITY, Service::GET_ATTRIBUTE_SINGLE, Some(DEVICE_TYPE), _) if word.is_some() => {
                self.device_type = word;
                text.line(3, format_args!("device type {:#04x}", word.unwrap_or_default()));
            }
            (class, Service::GET_ATTRIBUTE_SINGLE, Some(attribute @ (PRODUCED_SIZE | CONSUMED_SIZE)), _)
                if class == u16::from(CLASS_CONNECTION) && word.is_some() =>
            {
                let size = word.unwrap_or_default();
                let place = usize::from(asked.instance).wrapping_sub(1);
                if let Some(sizes) = self.sizes.get_mut(place) {
                    let which =
                        if attribute == PRODUCED_SIZE { &mut sizes.produced } else { &mut sizes.consumed };
                    *which = word;
                }
                let what = if attribute == PRODUCED_SIZE { "produced" } else { "consumed" };
                text.line(3, format_args!("{what} connection size {size} bytes"));
            }
            _ => text.bytes(3, "data", data),
        }
    }

    /// Longest message of this kind.
    fn size(&self, way: Way) -> Option<u16> {
        let of = |kind: ConnectionKind| self.sizes[kind.index()];
        match way {
            Way::Command => of(ConnectionKind::Poll).consumed.or(of(ConnectionKind::ChangeOfState).consumed),
            Way::Answer => of(ConnectionKind::Poll).produced,
            Way::Change => of(ConnectionKind::ChangeOfState).produced,
        }
    }

    fn io(&mut self, way: Way, data: &[u8], text: &mut Text) {
        let (size, device_type) = (self.size(way), self.device_type);
        let receiver = &mut self.io[way as usize];
        let Some(size) = size else {
            text.line(2, format_args!("the size of the connection was not seen"));
            let whole = receiver.handle(IO_MAX, data).unwrap_or(false);
            match update(receiver.data()).ok().filter(|_| whole) {
                Some(tree) => {
                    text.line(
                        2,
                        format_args!("with the fragments before read as CIP Motion because it fits"),
                    );
                    text.block(2, &tree);
                }
                None => text.bytes(2, "data", data),
            }
            return;
        };
        match receiver.handle(size.into(), data) {
            Ok(true) => contents(way, receiver.data(), device_type, text),
            Ok(false) => {
                text.line(2, format_args!("{}", Fragment::parse(data.first().copied().unwrap_or_default())));
                text.bytes(3, "bytes", data.get(1..).unwrap_or_default());
            }
            Err(error) => {
                text.line(2, format_args!("dropped: {error}"));
                text.bytes(3, "bytes", data);
            }
        }
    }
}

/// Prints a request and gives what is kept of it.
fn asks(request: &Request<'_>, text: &mut Text) -> Asked {
    let Request { service, class, instance, data } = *request;
    let single = matches!(service, Service::GET_ATTRIBUTE_SINGLE | Service::SET_ATTRIBUTE_SINGLE);
    let attribute = data.first().copied().filter(|_| single);
    let asked = Asked { service, class, instance, attribute };
    text.line(2, format_args!("{} request to {asked}", name(service, class)));
    let of_devicenet = class == u16::from(CLASS_DEVICENET);
    match (service, data) {
        (Service(ALLOCATE), _) if of_devicenet => match Allocate::parse(data) {
            Ok(Allocate { choice, allocator }) => {
                text.line(3, format_args!("{choice}, for MAC ID {allocator}"));
            }
            Err(error) => unreadable(text, 3, "allocation", error, data),
        },
        (Service(RELEASE), [choice]) if of_devicenet => {
            text.line(3, format_args!("{}", AllocationChoice::from_bits_retain(*choice)));
        }
        (Service::GET_ATTRIBUTE_LIST, [low, high, ids @ ..])
            if ids.len() == 2 * usize::from(u16::from_le_bytes([*low, *high])) =>
        {
            let ids = ids.chunks_exact(2).map(|id| u16::from_le_bytes([id[0], id[1]]).to_string());
            text.line(3, format_args!("attributes {}", ids.collect::<Vec<_>>().join(", ")));
        }
        _ => text.bytes(3, "data", data.get(usize::from(attribute.is_some())..).unwrap_or_default()),
    }
    asked
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "class {:#04x} instance {}", self.class, self.instance)?;
        self.attribute.map_or(Ok(()), |attribute| write!(f, " attribute {attribute}"))
    }
}

/// The DeviceNet object has services of its own.
fn name(service: Service, class: u16) -> String {
    match service.0 {
        ALLOCATE if class == u16::from(CLASS_DEVICENET) => "Allocate_Master/Slave_Connection_Set".to_owned(),
        RELEASE if class == u16::from(CLASS_DEVICENET) => "Release_Group_2_Identifier_Set".to_owned(),
        _ => service.to_string(),
    }
}

/// Prints a whole I/O message.
fn contents(way: Way, data: &[u8], device_type: Option<u16>, text: &mut Text) {
    if data.is_empty() {
        let what = if way == Way::Command { "it commands nothing" } else { "there is nothing valid to tell" };
        text.line(2, format_args!("without data: {what}"));
        return;
    }
    if device_type.is_some_and(|device_type| DEVICE_TYPES_SPEED.contains(&device_type)) {
        match assembly(way, data) {
            Ok(told) => text.line(2, format_args!("{told}")),
            Err(error) => unreadable(text, 2, "drive assembly", error, data),
        }
        return;
    }
    let is_motion = device_type == Some(DEVICE_TYPE_CIP_MOTION_DRIVE);
    match update(data) {
        Ok(tree) => {
            if !is_motion {
                text.line(2, format_args!("read as CIP Motion because it fits"));
            }
            text.block(2, &tree);
        }
        Err(error) if is_motion => unreadable(text, 2, "CIP Motion", error, data),
        Err(_) => text.bytes(2, "data", data),
    }
}

/// An update of the fixed format, the only one that DeviceNet has.
fn update(data: &[u8]) -> Result<String, Error> {
    Ok(match data.first().copied().map(ConnectionFormat) {
        Some(ConnectionFormat::FIXED_ACTUAL) => FixedActual::parse(data)?.to_string(),
        _ => FixedCommand::parse(data)?.to_string(),
    })
}

/// What an assembly of a velocity drive says. The basic ones are like the extended ones, with fewer bits, and nothing in them
/// tells which it is.
fn assembly(way: Way, data: &[u8]) -> Result<String, Error> {
    let torque_there = data.len() == Assembly::EXTENDED_TORQUE_CONTROL.buffer_len();
    let (output, basic) = if torque_there {
        (Assembly::EXTENDED_TORQUE_CONTROL, Assembly::BASIC_TORQUE_CONTROL)
    } else {
        (Assembly::EXTENDED_SPEED_CONTROL, Assembly::BASIC_SPEED_CONTROL)
    };
    let input = |output: Assembly| output.status().unwrap_or(output);
    Ok(match way {
        Way::Command => {
            let SpeedCommand { control, speed, torque } = SpeedCommand::parse(output, data)?;
            let bits = flags(control.iter_names());
            format!("assembly {}, or {} with fewer bits: {bits}, speed reference {speed}", output.0, basic.0)
                + &if torque_there { format!(", torque reference {torque}") } else { String::new() }
        }
        Way::Answer | Way::Change => {
            let (output, basic) = (input(output), input(basic));
            let SpeedActual { status, state, speed, torque } = SpeedActual::parse(output, data)?;
            let bits = flags(status.iter_names());
            format!("assembly {}, or {} with fewer bits: {bits}, {state}, speed {speed}", output.0, basic.0)
                + &if torque_there { format!(", torque {torque}") } else { String::new() }
        }
    })
}

/// Bits by their names.
fn flags<T>(names: impl Iterator<Item = (&'static str, T)>) -> String {
    let names: Vec<_> = names.map(|(name, _)| name.to_lowercase().replace('_', " ")).collect();
    if names.is_empty() { "no bit".to_owned() } else { names.join(" and ") }
}

#[cfg(test)]
mod tests;
