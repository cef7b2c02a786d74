//! Forward_Close at this device.

use super::adapter::DEVICE_TIMEOUT;
use super::forward_open::failure;
use super::node::{Await, AwaitKind, Node, Origin, Step};
use crate::device::connection::manager::{Asked, Motion};
use crate::device::motion_link::{CloseParameters, ConnectionTriad, MotionRequest};
use crate::device::objects::object::{Answer, data_status};
use crate::wire::epath::{self, Encoding};
use crate::wire::forward_close::{ForwardClose, ForwardCloseReply};
use crate::wire::message_router::Request;
use crate::wire::status::{ConnectionStatus, GeneralStatus};

/// Runs the service. The triad says which connection; it must have been opened from the same address.
pub(crate) fn close(node: &mut Node, origin: &Origin, request: &Request<'_>) -> Step {
    node.counters.close_requests += 1;
    let service = request.service;
    let answer = match ForwardClose::parse(request.data) {
        Err(error) => {
            node.counters.close_format_rejects += 1;
            Answer::status(data_status(error))
        }
        Ok(close) if epath::segments(close.path, Encoding::Padded).any(|segment| segment.is_err()) => {
            node.counters.close_format_rejects += 1;
            Answer::connection(ConnectionStatus::CLOSE_PATH_ERROR, failure(close.triad, 0))
        }
        Ok(close) => {
            let triad = close.triad;
            if node.connections.close_explicit(triad, *origin.peer.ip()) {
                closed(triad)
            } else {
                match close_motion(node, origin, triad) {
                    Ok(parameters) => {
                        let kind = AwaitKind::Close(parameters);
                        return Step::Await(Await { token: parameters.token, service, kind });
                    }
                    Err(answer) => {
                        node.counters.close_other_rejects += 1;
                        answer
                    }
                }
            }
        }
    };
    if answer.status != GeneralStatus::SUCCESS {
        node.counters.requests_refused += 1;
    }
    Step::Done(answer.into_reply(service, origin.reply_max))
}

fn close_motion(node: &mut Node, origin: &Origin, triad: ConnectionTriad) -> Result<CloseParameters, Answer> {
    let Some(&mut Motion::Open(owner)) = node.connections.io_of(triad) else {
        return Err(not_found(triad));
    };
    if owner.open.triad != triad || owner.peer.ip() != origin.peer.ip() {
        return Err(not_found(triad));
    }
    let close = CloseParameters { token: node.new_token(), triad, o_to_t_id: owner.open.o_to_t_id };
    if let Err(status) = node.ask(MotionRequest::Close(close)) {
        return Err(Answer { status, data: failure(triad, 0), ..Answer::default() });
    }
    let asked = Asked { token: close.token, deadline: origin.now + DEVICE_TIMEOUT };
    if let Some(state) = node.connections.io_of(triad) {
        *state = Motion::Closing(owner, asked);
    }
    Ok(close)
}

fn not_found(triad: ConnectionTriad) -> Answer {
    Answer::connection(ConnectionStatus::NOT_FOUND, failure(triad, 0))
}

/// The answer once the connection is gone.
pub(crate) fn closed(triad: ConnectionTriad) -> Answer {
    let reply = ForwardCloseReply { triad, application_reply: &[] };
    let mut data = vec![0; reply.buffer_len()];
    match reply.emit(&mut data) {
        Ok(_) => Answer::done(data),
        Err(_) => Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE),
    }
}
