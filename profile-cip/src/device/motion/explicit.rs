//! The explicit requests of the Motion Device Axis Object: those that wait for their turn, the one that is worked on, and
//! the replies.

use core::net::Ipv4Addr;

use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::engine::Engine;
use super::owner::{self, common};
use super::service::{self, Started};
use crate::device::attribute::list_job::ListFormat;
use crate::device::attribute::worker::{AttributeAccess, AttributeWorker};
use crate::device::motion_link::{EXPLICIT_DATA_MAX, ExplicitReply, ExplicitRequest, MotionReply, Token};
use crate::device::objects::class::CLASS_MOTION_DEVICE_AXIS;
use crate::wire::motion::codes::MotionService;
use crate::wire::status::GeneralStatus;

/// Explicit requests that may wait.
const WAITING_MAX: usize = 8;
/// Replies that wait to be taken; requests are refused before this overflows.
const REPLIES_MAX: usize = 16;

/// The request in progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Current {
    token: Token,
    instance: usize,
    originator: Ipv4Addr,
    /// It does more than read.
    changes: bool,
}

/// Requests and replies of the explicit side.
#[derive(Default)]
pub(super) struct ExplicitSide {
    waiting: ArrayVec<ExplicitRequest, WAITING_MAX>,
    current: Option<Current>,
    /// The attribute service of the request in progress.
    worker: AttributeWorker,
    replies: ArrayVec<MotionReply, REPLIES_MAX>,
}

impl ExplicitSide {
    /// Queues a request. Refuses it if too many are waiting, and returns whether it did not.
    pub fn queue(&mut self, request: ExplicitRequest) -> bool {
        let Err(error) = self.waiting.try_push(request) else { return true };
        self.answer(error.element().token, GeneralStatus::RESOURCE_UNAVAILABLE, &[]);
        false
    }

    /// The next reply.
    pub fn poll_reply(&mut self) -> Option<MotionReply> {
        self.replies.pop_at(0)
    }

    pub fn reply(&mut self, reply: MotionReply) {
        // Open, Close and loss alternate and explicit requests are limited, so there is room unless nobody takes the
        // replies; the oldest then has nobody waiting for it.
        if self.replies.is_full() {
            self.replies.remove(0);
        }
        self.replies.push(reply);
    }

    fn answer(&mut self, token: Token, status: GeneralStatus, body: &[u8]) {
        let mut reply = ExplicitReply::status(token, status.0);
        if reply.data.try_extend_from_slice(body).is_err() {
            reply = ExplicitReply::status(token, GeneralStatus::REPLY_DATA_TOO_LARGE.0);
        }
        self.reply(MotionReply::Explicit(reply));
    }

    /// A connection was opened: a list of another client that is being set ends here, because the rest of it would be
    /// set under the new owner.
    pub fn break_off_foreign(&mut self, owner: Ipv4Addr) {
        let foreign = self.current.take_if(|current| current.changes && current.originator != owner);
        if let Some(Current { token, .. }) = foreign {
            self.worker.abandon();
            self.answer(token, GeneralStatus::PRIVILEGE_VIOLATION, &[]);
        }
    }

    /// Works on the requests, one at a time.
    ///
    /// The times are those of the moment, for services that compare them.
    pub fn run(&mut self, engine: &mut Engine, now: MonotonicTime, system_time: Option<SystemTime>) {
        loop {
            if self.current.is_none() {
                let Some(request) = self.waiting.pop_at(0) else { return };
                self.start(engine, &request, now, system_time);
            } else if !self.advance(engine) {
                return;
            }
        }
    }

    fn start(
        &mut self,
        engine: &mut Engine,
        request: &ExplicitRequest,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
    ) {
        let (token, originator) = (request.token, request.originator);
        let instance = usize::try_from(request.path.instance).unwrap_or(usize::MAX);
        let mut response = [0; EXPLICIT_DATA_MAX];
        let started = match refusal(engine, request, instance) {
            Some(status) => Started::Answered(status, 0),
            None => begin(engine, request, instance, (now, system_time), &mut response),
        };
        match started {
            Started::Answered(status, len) => self.answer(token, status, &response[..len]),
            Started::List(format) => {
                let sets = matches!(format, ListFormat::CommonSet | ListFormat::SingleSet(_));
                engine.progress.attribute_set |= sets;
                let begun = match engine.instances.service(instance) {
                    Some((_, space)) => {
                        self.worker.start(format, &request.data, EXPLICIT_DATA_MAX, space.table)
                    }
                    None => Err(GeneralStatus::PATH_DESTINATION_UNKNOWN),
                };
                match begun {
                    Ok(()) => {
                        let changes = !owner::reads(request.service);
                        self.current = Some(Current { token, instance, originator, changes });
                    }
                    Err(status) => self.answer(token, status, &[]),
                }
            }
        }
    }

    /// Carries the current request on; returns whether it has ended.
    fn advance(&mut self, engine: &mut Engine) -> bool {
        let Some(Current { token, instance, .. }) = self.current else { return false };
        engine.publish(instance);
        let Some((_, mut space)) = engine.instances.service(instance) else { return false };
        let reply = self.worker.run(&mut space).map(|(status, body)| {
            let mut reply = ExplicitReply::status(token, status.0);
            // The worker keeps to the limit it was started with.
            reply.data.extend(body.iter().copied().take(EXPLICIT_DATA_MAX));
            reply
        });
        service::adopt(engine, instance);
        let Some(reply) = reply else { return false };
        self.worker.abandon();
        self.current = None;
        self.reply(MotionReply::Explicit(reply));
        true
    }

    /// The next access to an attribute that lives in a drive.
    pub fn take_access(&mut self) -> Option<AttributeAccess> {
        self.worker.take_access()
    }

    /// Takes the drive's answer if it belongs to the request in progress.
    pub fn complete(&mut self, engine: &mut Engine, ticket: u32, answer: Result<&[u8], GeneralStatus>) {
        let Some(Current { instance, .. }) = self.current else { return };
        let service = engine.instances.service(instance);
        let access = service.and_then(|(_, mut space)| self.worker.complete(ticket, answer, &mut space));
        if let Some(access) = access {
            engine.instances.set_by_others(&access);
            // The requests behind it begin with the next poll, which knows the time.
            self.advance(engine);
        }
    }
}

/// Why a request is refused before its service is looked at.
fn refusal(engine: &Engine, request: &ExplicitRequest, instance: usize) -> Option<GeneralStatus> {
    let path = &request.path;
    if path.class != CLASS_MOTION_DEVICE_AXIS || instance > engine.instances.axis_count() {
        return Some(GeneralStatus::PATH_DESTINATION_UNKNOWN);
    }
    if path.member.is_some() || path.connection_point.is_some() {
        return Some(GeneralStatus::PATH_SEGMENT_ERROR);
    }
    let owner = engine.connection.as_ref().map(|connection| connection.parameters.originator);
    owner::is_foreign(owner, request).then_some(GeneralStatus::PRIVILEGE_VIOLATION)
}

fn begin(
    engine: &mut Engine,
    request: &ExplicitRequest,
    instance: usize,
    (now, system_time): (MonotonicTime, Option<SystemTime>),
    response: &mut [u8],
) -> Started {
    match (request.service, request.path.attribute) {
        (common::GET_ATTRIBUTE_LIST, _) => Started::List(ListFormat::CommonGet),
        (common::SET_ATTRIBUTE_LIST, _) => Started::List(ListFormat::CommonSet),
        (common::GET_ATTRIBUTE_SINGLE, Some(id)) => Started::List(ListFormat::SingleGet(id)),
        (common::SET_ATTRIBUTE_SINGLE, Some(id)) => Started::List(ListFormat::SingleSet(id)),
        (common::GET_ATTRIBUTE_SINGLE | common::SET_ATTRIBUTE_SINGLE, None) => {
            Started::Answered(GeneralStatus::PATH_SEGMENT_ERROR, 0)
        }
        (service, _) => {
            let service = MotionService(service);
            // A test moves the axis. In the service channel the update that brings it has been judged; this message
            // says nothing about the updates.
            let stale = engine.connection.as_ref().is_some_and(|connection| !connection.is_current(now));
            if stale && service == MotionService::RUN_HOOKUP_TEST {
                Started::Answered(GeneralStatus::DEVICE_STATE_CONFLICT, 0)
            } else {
                service::start(engine, instance, service, &request.data, system_time, response)
            }
        }
    }
}
