//! CIP requests and replies.

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::epath::{Encoding, LogicalType, Segment, segments};
use profile_cip::wire::forward_close::{ForwardClose, ForwardCloseReply};
use profile_cip::wire::forward_open::{ConnectionFailure, ForwardOpen, ForwardOpenReply};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::motion::codes::{ConnectionFormat, MotionService};
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_cip::wire::motion::{
    ActualFrame, CommandFrame, FORMAT_REVISION_RUN_IDLE, ServiceRequest, ServiceResponse, run_idle,
};
use profile_cip::wire::multiple_service::MultipleService;
use profile_cip::wire::status::{ConnectionStatus, GeneralStatus, Service};
use profile_cip::wire::unconnected_send::UnconnectedSend;
use profile_cip::wire::{ConnectionTriad, Error};

use super::connections::{CLASS_MOTION, Opening};
use super::text::Text;

/// Class of the Connection Manager.
const CLASS_CONNECTION_MANAGER: u32 = 0x06;

/// Requests inside requests that are followed: an Unconnected_Send with a Multiple_Service_Packet has two.
const NESTING_MAX: usize = 4;

/// What is remembered of a request until its reply comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Asked {
    pub service: Service,
    pub class: Option<u32>,
    pub opening: Option<Opening>,
}

/// What a reply has done to connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effect {
    Opened { opening: Opening, o_to_t_id: u32, t_to_o_id: u32 },
    Closed(ConnectionTriad),
}

/// The last class that a path names.
pub(super) fn last_class(path: &[u8]) -> Option<u32> {
    segments(path, Encoding::Padded)
        .filter_map(|segment| match segment {
            Ok(Segment::Logical { kind: LogicalType::CLASS, value }) => Some(value.get()),
            _ => None,
        })
        .last()
}

/// Prints a request; returns what its reply will need.
pub(super) fn request(bytes: &[u8], level: usize, text: &mut Text) -> Option<Asked> {
    nested_request(bytes, level, text, 0)
}

fn nested_request(bytes: &[u8], level: usize, text: &mut Text, depth: usize) -> Option<Asked> {
    let request = match Request::parse(bytes) {
        Ok(request) => request,
        Err(error) => {
            unreadable(text, level, "CIP request", error, bytes);
            return None;
        }
    };
    let class = last_class(request.path);
    let mut asked = Asked { service: request.service, class, opening: None };
    text.line(
        level,
        format_args!("{} request to {}", service_name(request.service, class), path(request.path)),
    );
    if depth == NESTING_MAX {
        text.bytes(level + 1, "data, nested too deep to follow", request.data);
        return Some(asked);
    }
    let manager = class == Some(CLASS_CONNECTION_MANAGER);
    match request.service {
        Service::FORWARD_OPEN | Service::LARGE_FORWARD_OPEN if manager => {
            let large = request.service == Service::LARGE_FORWARD_OPEN;
            match ForwardOpen::parse(request.data, large) {
                Ok(open) => {
                    forward_open(&open, level + 1, text);
                    asked.opening = Some(Opening::new(&open));
                }
                Err(error) => unreadable(text, level + 1, "Forward_Open", error, request.data),
            }
        }
        Service::FORWARD_CLOSE if manager => match ForwardClose::parse(request.data) {
            Ok(close) => text.line(level + 1, format_args!("{close}")),
            Err(error) => unreadable(text, level + 1, "Forward_Close", error, request.data),
        },
        Service::UNCONNECTED_SEND if manager => match UnconnectedSend::parse(request.data) {
            Ok(send) => {
                text.line(level + 1, format_args!("route: {}", path(send.route)));
                // The reply is that of the request inside.
                return nested_request(send.message, level + 1, text, depth + 1);
            }
            Err(error) => unreadable(text, level + 1, "Unconnected_Send", error, request.data),
        },
        Service::MULTIPLE_SERVICE_PACKET => match MultipleService::parse(request.data) {
            Ok(services) => {
                for message in services.iter() {
                    nested_request(message, level + 1, text, depth + 1);
                }
            }
            Err(error) => unreadable(text, level + 1, "Multiple_Service_Packet", error, request.data),
        },
        service if class == Some(CLASS_MOTION) && MotionService(service.0).name().is_some() => {
            let body =
                ServiceRequest { transaction_id: 0, service: MotionService(service.0), data: request.data };
            motion_body(&body.to_string(), level + 1, text);
        }
        _ => text.bytes(level + 1, "data", request.data),
    }
    Some(asked)
}

/// Prints a reply to `asked`, if the request was seen; returns what it changed.
pub(super) fn reply(bytes: &[u8], asked: Option<Asked>, level: usize, text: &mut Text) -> Option<Effect> {
    let reply = match Reply::parse(bytes) {
        Ok(reply) => reply,
        Err(error) => {
            unreadable(text, level, "CIP reply", error, bytes);
            return None;
        }
    };
    let class = asked.and_then(|asked| asked.class);
    text.line(level, format_args!("{} reply: {}", service_name(reply.service, class), reply.status));
    let of_connection =
        [Service::FORWARD_OPEN, Service::LARGE_FORWARD_OPEN, Service::FORWARD_CLOSE].contains(&reply.service);
    for word in &reply.extended {
        match ConnectionStatus(*word).name() {
            Some(name) if of_connection => text.append(format_args!("{word:#06x} ({name})")),
            _ => text.append(format_args!("{word:#06x}")),
        }
    }
    if asked.is_some_and(|asked| asked.service != reply.service) {
        text.append(format_args!("(the request was another service)"));
    }
    let success = reply.status == GeneralStatus::SUCCESS;
    match reply.service {
        Service::FORWARD_OPEN | Service::LARGE_FORWARD_OPEN if success => {
            match ForwardOpenReply::parse(reply.data) {
                Ok(open) => {
                    text.line(level + 1, format_args!("{}", open.triad));
                    text.line(
                        level + 1,
                        format_args!(
                            "O->T ID {:#010x} every {} us, T->O ID {:#010x} every {} us",
                            open.o_to_t_id, open.o_to_t_api_us, open.t_to_o_id, open.t_to_o_api_us
                        ),
                    );
                    text.bytes(level + 1, "application reply", open.application_reply);
                    let opening = asked?.opening.filter(|opening| opening.triad == open.triad)?;
                    let (o_to_t_id, t_to_o_id) = (open.o_to_t_id, open.t_to_o_id);
                    return Some(Effect::Opened { opening, o_to_t_id, t_to_o_id });
                }
                Err(error) => unreadable(text, level + 1, "Forward_Open reply", error, reply.data),
            }
        }
        Service::FORWARD_CLOSE if success => match ForwardCloseReply::parse(reply.data) {
            Ok(close) => {
                text.line(level + 1, format_args!("{}", close.triad));
                return Some(Effect::Closed(close.triad));
            }
            Err(error) => unreadable(text, level + 1, "Forward_Close reply", error, reply.data),
        },
        _ if of_connection && !reply.data.is_empty() => match ConnectionFailure::parse(reply.data) {
            Ok(failure) => text.line(
                level + 1,
                format_args!("{}, {} words of path left", failure.triad, failure.remaining_path_words),
            ),
            Err(error) => unreadable(text, level + 1, "connection failure", error, reply.data),
        },
        Service::MULTIPLE_SERVICE_PACKET if !reply.data.is_empty() => {
            match MultipleService::parse(reply.data) {
                Ok(services) => {
                    for message in services.iter() {
                        // Their requests are not remembered one by one; a reply reports its own service.
                        inner_reply(message, level + 1, text);
                    }
                }
                Err(error) => unreadable(text, level + 1, "Multiple_Service_Packet", error, reply.data),
            }
        }
        service if class == Some(CLASS_MOTION) && MotionService(service.0).name().is_some() => {
            let body = ServiceResponse {
                transaction_id: 0,
                service: MotionService(service.0),
                general_status: reply.status.0,
                extended_status: 0,
                data: reply.data,
            };
            motion_body(&body.to_string(), level + 1, text);
        }
        _ => text.bytes(level + 1, "data", reply.data),
    }
    None
}

/// A reply out of a Multiple_Service_Packet.
fn inner_reply(bytes: &[u8], level: usize, text: &mut Text) {
    match Reply::parse(bytes) {
        Ok(reply) => {
            text.line(level, format_args!("{} reply: {}", reply.service, reply.status));
            for word in &reply.extended {
                text.append(format_args!("{word:#06x}"));
            }
            text.bytes(level + 1, "data", reply.data);
        }
        Err(error) => unreadable(text, level, "CIP reply", error, bytes),
    }
}

/// Prints class-1 data. `expected` is whether the connection is known to be one of CIP Motion, or `None` when
/// its opening was not seen.
pub(super) fn class1(datagram: &Class1Datagram<'_>, expected: Option<bool>, level: usize, text: &mut Text) {
    if datagram.data.is_empty() {
        return;
    }
    if expected == Some(false) {
        text.bytes(level, "data", datagram.data);
        return;
    }
    match (motion_update(datagram.data), expected) {
        (Ok(tree), Some(_)) => text.block(level, &tree),
        (Ok(tree), None) => {
            text.line(
                level,
                format_args!(
                    "no connection of this ID is open in the recording; read as CIP Motion because it fits"
                ),
            );
            text.block(level, &tree);
        }
        (Err(error), Some(_)) => unreadable(text, level, "CIP Motion", error, datagram.data),
        (Err(_), None) => {
            text.line(level, format_args!("no connection of this ID is open in the recording"));
            text.bytes(level, "data", datagram.data);
        }
    }
}

/// The tree of an update of either direction.
fn motion_update(data: &[u8]) -> Result<String, Error> {
    match ConnectionFormat(data.first().copied().unwrap_or(0)) {
        ConnectionFormat::FIXED_COMMAND => Ok(FixedCommand::parse(data)?.to_string()),
        ConnectionFormat::FIXED_ACTUAL => Ok(FixedActual::parse(data)?.to_string()),
        ConnectionFormat::VARIABLE_ACTUAL => Ok(ActualFrame::parse(data)?.to_string()),
        _ if run_idle::revision_of(data) == FORMAT_REVISION_RUN_IDLE => behind_run_idle(data),
        // Of the formats that do not exist the error of this one tells the number.
        _ => Ok(CommandFrame::parse(data)?.to_string()),
    }
}

/// The tree of an update behind a run/idle header.
fn behind_run_idle(data: &[u8]) -> Result<String, Error> {
    let (run, update) = run_idle::split(FORMAT_REVISION_RUN_IDLE, data)?;
    let tree = match ConnectionFormat(update.first().copied().unwrap_or(0)) {
        ConnectionFormat::VARIABLE_ACTUAL => {
            ActualFrame::parse_as(update, FORMAT_REVISION_RUN_IDLE)?.to_string()
        }
        _ => CommandFrame::parse_as(update, FORMAT_REVISION_RUN_IDLE)?.to_string(),
    };
    Ok(format!("Run/idle header: {}\n{tree}", if run { "run" } else { "idle" }))
}

fn forward_open(open: &ForwardOpen<'_>, level: usize, text: &mut Text) {
    text.line(level, format_args!("{open}"));
    text.line(level, format_args!("O->T ID {:#010x}, T->O ID {:#010x},", open.o_to_t_id, open.t_to_o_id));
    match open.multiplier() {
        Some(multiplier) => text.append(format_args!("time-out x{multiplier}")),
        None => {
            text.append(format_args!("time-out multiplier {:#04x}, not defined", open.timeout_multiplier))
        }
    }
    text.line(level, format_args!("path: {}", path(open.path)));
    for segment in segments(open.path, Encoding::Padded).flatten() {
        if let Segment::Data(data) = segment {
            text.bytes(level + 1, "configuration", data);
        }
    }
}

/// The service block's tree without its first line, which names a transaction that explicit messages do not
/// have.
fn motion_body(tree: &str, level: usize, text: &mut Text) {
    for line in tree.lines().skip(1) {
        text.line(level, format_args!("{}", line.trim_start()));
    }
}

/// The name of a service of a class.
pub(super) fn service_name(service: Service, class: Option<u32>) -> String {
    match MotionService(service.0).name() {
        Some(name) if class == Some(CLASS_MOTION) && service.name().is_none() => name.to_owned(),
        _ => service.to_string(),
    }
}

/// The segments of a path.
fn path(bytes: &[u8]) -> String {
    let segments: Vec<String> = segments(bytes, Encoding::Padded)
        .map(|segment| match segment {
            Ok(segment) => segment.to_string(),
            Err(error) => format!("not readable ({error})"),
        })
        .collect();
    if segments.is_empty() { "empty".to_owned() } else { segments.join(", ") }
}

/// Says why bytes are not what they should be, and shows them.
pub(super) fn unreadable(text: &mut Text, level: usize, what: &str, error: Error, bytes: &[u8]) {
    text.line(level, format_args!("{what} not readable: {error}"));
    text.bytes(level + 1, "bytes", bytes);
}
