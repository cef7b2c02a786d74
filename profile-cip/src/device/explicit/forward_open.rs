//! Forward_Open and Large_Forward_Open at this device.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::adapter::DEVICE_TIMEOUT;
use super::node::{Await, AwaitKind, Node, Origin, Step};
use crate::assembly::Assemblies;
use crate::device::connection::manager::{Asked, Motion, Owner, timeout_ns};
use crate::device::connection::path::{self, Application};
use crate::device::connection::refusal::Refusal;
use crate::device::connection::{assembly, motion};
use crate::device::motion_link::{
    AssemblyOpen, AssemblyRole, ConnectionTriad, MotionRequest, OpenParameters, OpenRefusal,
};
use crate::device::objects::object::{Answer, data_status};
use crate::device::objects::tcp_ip::default_group;
use crate::wire::encapsulation::IO_PORT;
use crate::wire::forward_open::{CONNECTION_FAILURE_LEN, ConnectionFailure, ForwardOpen, ForwardOpenReply};
use crate::wire::message_router::Request;
use crate::wire::network_parameters::ConnectionType;
use crate::wire::status::{ConnectionStatus, GeneralStatus, Service};

enum Opened {
    /// Answered here: explicit, or nothing to open.
    Now { o_to_t_id: u32, t_to_o_id: u32 },
    /// The motion device has been asked.
    Asked(OpenParameters),
}

/// Runs the service.
pub(crate) fn open(node: &mut Node, origin: &Origin, request: &Request<'_>) -> Step {
    node.counters.open_requests += 1;
    let service = request.service;
    let open = match ForwardOpen::parse(request.data, service == Service::LARGE_FORWARD_OPEN) {
        Ok(open) => open,
        Err(error) => {
            node.counters.open_format_rejects += 1;
            node.counters.requests_refused += 1;
            let answer = Answer::status(data_status(error));
            return Step::Done(answer.into_reply(service, origin.reply_max));
        }
    };
    let answer = match decide(node, origin, &open) {
        Ok(Opened::Asked(parameters)) => {
            let kind = AwaitKind::Open(parameters, origin.peer);
            return Step::Await(Await { token: parameters.token, service, kind });
        }
        Ok(Opened::Now { o_to_t_id, t_to_o_id }) => success(&ForwardOpenReply {
            o_to_t_id,
            t_to_o_id,
            triad: open.triad,
            o_to_t_api_us: open.o_to_t_rpi_us,
            t_to_o_api_us: open.t_to_o_rpi_us,
            application_reply: &[],
        }),
        Err(refusal) => {
            node.counters.requests_refused += 1;
            node.refuse_open(open.triad, origin.peer, refusal)
        }
    };
    Step::Done(answer.into_reply(service, origin.reply_max))
}

fn decide(node: &mut Node, origin: &Origin, open: &ForwardOpen<'_>) -> Result<Opened, Refusal> {
    let application = path::application(open.path, &node.config.identity)?;
    let null = |direction: ConnectionType| direction == ConnectionType::NULL;
    if null(open.o_to_t.connection_type) && null(open.t_to_o.connection_type) {
        return null_open(node, origin, open, &application);
    }
    if node.connections.has(open.triad) {
        return Err(Refusal::connection(ConnectionStatus::IN_USE_OR_DUPLICATE));
    }
    match application {
        Application::MessageRouter => {
            let (session, peer) = (origin.session, origin.peer);
            let o_to_t_id = node.connections.open_explicit(origin.now, session, peer, open)?;
            Ok(Opened::Now { o_to_t_id, t_to_o_id: open.t_to_o_id })
        }
        Application::Motion(path) => {
            node.check_controller(*origin.peer.ip())?;
            check_motion(node)?;
            let (format_revision, bits) = motion::check_path(&path, &node.config.motion)?;
            motion::check_parameters(open, &node.config.motion)?;
            node.connections.check_owner()?;
            node.check_reset()?;
            open_io(node, origin, open, (format_revision, bits, None))
        }
        Application::Assembly(path) => {
            let assemblies = assemblies(node)?;
            let role = assembly::check_path(&path, assemblies)?;
            if role == AssemblyRole::ExclusiveOwner {
                node.check_controller(*origin.peer.ip())?;
            }
            let stream = node.connections.stream();
            assembly::check_parameters(open, role, assemblies, &node.config.motion, stream)?;
            node.connections.check_assembly(role)?;
            node.check_reset()?;
            let assembly = AssemblyOpen {
                role,
                t_to_o_rpi_us: open.t_to_o_rpi_us,
                t_to_o_priority: open.t_to_o.priority,
                multicast: open.t_to_o.connection_type == ConnectionType::MULTICAST,
            };
            open_io(node, origin, open, (0, 0, Some(assembly)))
        }
    }
}

/// A device with assemblies has no motion connection.
fn check_motion(node: &Node) -> Result<(), Refusal> {
    match node.config.assembly {
        None => Ok(()),
        Some(_) => Err(Refusal::connection(ConnectionStatus::INVALID_APPLICATION_PATH)),
    }
}

/// The assemblies, where the device has some.
fn assemblies(node: &Node) -> Result<&Assemblies, Refusal> {
    let missing = || Refusal::connection(ConnectionStatus::INVALID_APPLICATION_PATH);
    node.config.assembly.as_ref().ok_or_else(missing)
}

/// A Forward_Open without connection type in either direction opens nothing. It asks whether the path, the
/// key and the configuration fit this device; for an open connection of the same address it is answered with that
/// connection's IDs. Nobody else gets them: they are all that data of the connection are known by.
fn null_open(
    node: &Node,
    origin: &Origin,
    open: &ForwardOpen<'_>,
    application: &Application<'_>,
) -> Result<Opened, Refusal> {
    match application {
        Application::Motion(path) => {
            check_motion(node)?;
            motion::check_path(path, &node.config.motion)?;
        }
        Application::Assembly(path) => {
            assembly::check_path(path, assemblies(node)?)?;
        }
        Application::MessageRouter => {}
    }
    let client = *origin.peer.ip();
    let motion = node.connections.motion.parameters();
    let motion = motion.filter(|one| one.triad == open.triad && one.originator == client);
    let motion = motion.map(|one| (one.o_to_t_id, one.t_to_o_id));
    let mut explicit = node.connections.explicit.iter();
    let explicit = explicit.find(|one| one.triad == open.triad && *one.peer.ip() == client);
    let explicit = explicit.map(|one| (one.o_to_t_id, one.t_to_o_id));
    let (o_to_t_id, t_to_o_id) = motion.or(explicit).unwrap_or((open.o_to_t_id, open.t_to_o_id));
    Ok(Opened::Now { o_to_t_id, t_to_o_id })
}

fn open_io(
    node: &mut Node,
    origin: &Origin,
    open: &ForwardOpen<'_>,
    (format_revision, configuration_bits, assembly): (u8, u8, Option<AssemblyOpen>),
) -> Result<Opened, Refusal> {
    let (t_to_o_id, t_to_o_destination) = match assembly {
        Some(AssemblyOpen { multicast: true, .. }) => stream(node, origin)?,
        _ => (open.t_to_o_id, point_to_point(origin)?),
    };
    let parameters = OpenParameters {
        token: node.new_token(),
        triad: open.triad,
        o_to_t_id: node.connections.new_id(),
        t_to_o_id,
        originator: *origin.peer.ip(),
        t_to_o_destination,
        rpi_us: open.o_to_t_rpi_us,
        timeout_us: timeout_ns(open).magnitude() / 1000,
        o_to_t_size: open.o_to_t.size,
        t_to_o_size: open.t_to_o.size,
        o_to_t_variable: open.o_to_t.variable,
        t_to_o_variable: open.t_to_o.variable,
        t_to_o_dscp: node.qos_in_use.of_priority(open.t_to_o.priority),
        format_revision,
        configuration_bits,
        assembly,
    };
    node.ask(MotionRequest::Open(parameters)).map_err(|status| Refusal::new(status, 0))?;
    let is_owner = assembly.is_none_or(|assembly| assembly.role == AssemblyRole::ExclusiveOwner);
    let number = if is_owner { 0 } else { node.connections.listener_number() };
    let owner = Owner { number, open: parameters, peer: origin.peer, multiplier: open.timeout_multiplier };
    let asked = Asked { token: parameters.token, deadline: origin.now + DEVICE_TIMEOUT };
    let opening = Motion::Opening(owner, asked);
    match assembly {
        Some(AssemblyOpen { role: AssemblyRole::InputOnly | AssemblyRole::ListenOnly, .. }) => {
            node.connections.listeners.push(opening);
        }
        _ => node.connections.motion = opening,
    }
    Ok(Opened::Asked(parameters))
}

/// Where data go that are for the originator alone: back to the peer itself, so of its socket address only the port counts. A
/// group address there is a mistake the originator has to hear of.
fn point_to_point(origin: &Origin) -> Result<SocketAddrV4, Refusal> {
    let port = match origin.t_to_o_socket {
        Some(socket) if socket.ip().is_multicast() => return Err(off_subnet(*socket.ip())),
        Some(socket) if socket.port() != 0 => socket.port(),
        _ => IO_PORT,
    };
    Ok(SocketAddrV4::new(*origin.peer.ip(), port))
}

/// Connection ID and group of the multicast stream; a new ID when the stream begins. With a time to live of 1 it does not reach an
/// originator on another subnet.
fn stream(node: &mut Node, origin: &Origin) -> Result<(u32, SocketAddrV4), Refusal> {
    let interface = &node.config.interface;
    let (peer, netmask) = (*origin.peer.ip(), interface.netmask.to_bits());
    if (peer.to_bits() ^ interface.address.to_bits()) & netmask != 0 {
        return Err(off_subnet(peer));
    }
    let group = SocketAddrV4::new(default_group(interface.address, interface.netmask), IO_PORT);
    let id = node.connections.stream().map(|open| open.t_to_o_id);
    Ok((id.unwrap_or_else(|| node.connections.new_id()), group))
}

fn off_subnet(address: Ipv4Addr) -> Refusal {
    let refusal = Refusal::connection(ConnectionStatus::MULTICAST_OFF_SUBNET);
    Refusal { found: Some(u32::from(address)), ..refusal }
}

/// The answer once the motion device has taken or refused the connection.
pub(crate) fn opened(
    node: &mut Node,
    open: &OpenParameters,
    peer: SocketAddrV4,
    outcome: Result<(), OpenRefusal>,
) -> Answer {
    if let Err(refused) = outcome {
        let refusal = Refusal::new(GeneralStatus(refused.general_status), refused.extended_status);
        return node.refuse_open(open.triad, peer, refusal);
    }
    success(&ForwardOpenReply {
        o_to_t_id: open.o_to_t_id,
        t_to_o_id: open.t_to_o_id,
        triad: open.triad,
        o_to_t_api_us: open.rpi_us,
        t_to_o_api_us: open.assembly.map_or(open.rpi_us, |assembly| assembly.t_to_o_rpi_us),
        application_reply: &[],
    })
}

fn success(reply: &ForwardOpenReply<'_>) -> Answer {
    let mut data = vec![0; reply.buffer_len()];
    match reply.emit(&mut data) {
        Ok(_) => Answer::done(data),
        Err(_) => Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE),
    }
}

/// Data of a refusal.
pub(crate) fn failure(triad: ConnectionTriad, remaining_path_words: u8) -> Vec<u8> {
    let mut data = vec![0; CONNECTION_FAILURE_LEN];
    match (ConnectionFailure { triad, remaining_path_words }).emit(&mut data) {
        Ok(_) => data,
        Err(_) => Vec::new(),
    }
}
