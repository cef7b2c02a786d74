//! The explicit messages of the master to one slave: one request at a time, in fragments where it has to be.
//!
//! A request is sent, and once more after the time-out; then it has no answer. The time-out is longer than a server needs to
//! send a fragment twice, so that the two never repeat themselves into each other; on the unconnected port, where nothing is
//! fragmented, it is one second. Its XID tells its answer from a late one to
//! the request before.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::fragmentation::{
    ACKNOWLEDGE_TIMEOUT, Body, EXPLICIT_MAX, ExplicitReceiver, ExplicitSender,
};
use super::super::link::Refusal;
use super::super::wire::explicit::UNFRAGMENTED_MAX;
use super::super::wire::{
    AcknowledgeStatus, BodyFormat, Fragment, FragmentKind, Header, Identifier, MacId, Request, Response,
};
use super::event::{ExplicitRequest, Outcome};
use crate::wire::Error;
use arrayvec::ArrayVec;

/// Data of a frame.
pub(super) type FrameData = ArrayVec<u8, 8>;

/// Whom a request goes to, and which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// The unconnected port: one frame.
    Unconnected,
    /// The explicit connection.
    Connected,
}

/// The client of one slave.
#[derive(Debug, Clone)]
pub(super) struct Client {
    master: MacId,
    slave: MacId,
    timeout: DurationNs,
    xid: bool,
    way: Way,
    body: Body,
    /// A request is out.
    active: bool,
    /// The whole request has to be sent.
    due: bool,
    repeated: bool,
    /// Time by which the answer has to be there, once the request is out.
    deadline: Option<MonotonicTime>,
    sender: ExplicitSender,
    receiver: ExplicitReceiver,
    /// The acknowledge of a fragment has to be sent.
    acknowledge: Option<(u8, AcknowledgeStatus)>,
    outcome: Option<Outcome>,
}

impl Client {
    pub fn new(master: MacId, slave: MacId, timeout: DurationNs) -> Self {
        Self {
            master,
            slave,
            timeout,
            xid: false,
            way: Way::Connected,
            body: Body::new(),
            active: false,
            due: false,
            repeated: false,
            deadline: None,
            sender: ExplicitSender::default(),
            receiver: ExplicitReceiver::default(),
            acknowledge: None,
            outcome: None,
        }
    }

    /// Whether another request can begin.
    pub const fn is_free(&self) -> bool {
        !self.active && self.outcome.is_none()
    }

    /// Begins a request. A request that cannot be written in this format ends at once.
    pub fn start(&mut self, connected: bool, format: BodyFormat, request: &ExplicitRequest) {
        self.reset();
        let request = Request {
            service: request.service,
            class: request.class,
            instance: request.instance,
            data: &request.data,
        };
        let mut bytes = [0; EXPLICIT_MAX];
        let len = match request.emit(format, &mut bytes) {
            Ok(len) => len,
            Err(error) => {
                self.outcome = Some(Outcome::Malformed(error));
                return;
            }
        };
        self.body = bytes[..len].iter().copied().collect();
        self.way = if connected { Way::Connected } else { Way::Unconnected };
        self.xid = !self.xid;
        self.active = true;
        self.due = true;
    }

    /// Gives up whatever is under way.
    pub fn reset(&mut self) {
        self.active = false;
        self.due = false;
        self.repeated = false;
        self.deadline = None;
        self.acknowledge = None;
        self.outcome = None;
        self.sender.abandon();
        self.receiver.reset();
    }

    /// How the request has ended, once.
    pub fn take_outcome(&mut self) -> Option<Outcome> {
        self.outcome.take()
    }

    /// Whether the request has ended.
    pub const fn has_outcome(&self) -> bool {
        self.outcome.is_some()
    }

    fn end(&mut self, outcome: Outcome) {
        self.active = false;
        self.deadline = None;
        self.sender.abandon();
        self.receiver.reset();
        self.outcome = Some(outcome);
    }

    /// How long to wait for an answer.
    const fn patience(&self) -> DurationNs {
        match self.way {
            Way::Connected => self.timeout,
            Way::Unconnected => ACKNOWLEDGE_TIMEOUT,
        }
    }

    fn header(&self, fragmented: bool) -> u8 {
        Header { fragmented, xid: self.xid, mac: self.master }.byte()
    }

    /// Lets time pass and gives the next frame to be sent.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<(Identifier, FrameData)> {
        let connected = Identifier::ExplicitRequest(self.slave);
        if let Some((count, status)) = self.acknowledge.take() {
            let byte = Fragment { kind: FragmentKind::Acknowledge, count }.byte();
            return Some((connected, FrameData::from_iter([self.header(true), byte, status.0])));
        }
        if !self.active {
            return None;
        }
        if let Err(error) = self.sender.handle_time(now) {
            self.end(Outcome::NotTaken(error));
            return None;
        }
        if self.deadline.is_some_and(|deadline| now >= deadline) {
            if self.repeated {
                self.end(Outcome::NoAnswer);
                return None;
            }
            self.repeated = true;
            self.due = true;
        }
        if core::mem::take(&mut self.due) {
            self.deadline = Some(now + self.patience());
            self.receiver.reset();
            if self.body.len() <= UNFRAGMENTED_MAX {
                let mut data = FrameData::from_iter([self.header(false)]);
                data.extend(self.body.iter().copied().take(UNFRAGMENTED_MAX));
                let identifier = match self.way {
                    Way::Connected => connected,
                    Way::Unconnected => Identifier::UnconnectedRequest(self.slave),
                };
                return Some((identifier, data));
            }
            // The time for the answer begins with the last acknowledge.
            self.deadline = None;
            self.sender.start(&self.body);
        }
        let part = self.sender.poll(now)?;
        let mut data = FrameData::from_iter([self.header(true), part.fragment.byte()]);
        data.extend(part.data.iter().copied().take(6));
        Some((connected, data))
    }

    /// When [`Client::poll`] has something to do.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.acknowledge.is_some() || self.due || self.outcome.is_some() {
            return Some(MonotonicTime::ZERO);
        }
        if self.sender.is_active() {
            Some(self.sender.wake_at().unwrap_or(MonotonicTime::ZERO))
        } else {
            self.deadline
        }
    }

    /// Takes a frame of the slave's explicit response.
    pub fn handle(&mut self, now: MonotonicTime, identifier: Identifier, data: &[u8]) -> Result<(), Refusal> {
        let (first, rest) = data.split_first().ok_or(Refusal::Malformed(identifier, short()))?;
        let header = Header::parse(*first);
        if header.mac != self.master {
            return Err(Refusal::NotForUs(identifier));
        }
        if !self.active || header.xid != self.xid {
            return Err(Refusal::Unasked(identifier));
        }
        if !header.fragmented {
            self.answer(rest);
            return Ok(());
        }
        let (byte, rest) = rest.split_first().ok_or(Refusal::Malformed(identifier, short()))?;
        let fragment = Fragment::parse(*byte);
        let dropped = |error| Refusal::Fragment(identifier, error);
        if fragment.kind == FragmentKind::Acknowledge {
            let status = rest.first().ok_or(Refusal::Malformed(identifier, short()))?;
            let was_active = self.sender.is_active();
            return match self.sender.handle(fragment.count, AcknowledgeStatus(*status)) {
                Ok(true) => {
                    self.deadline = Some(now + self.timeout);
                    Ok(())
                }
                Ok(false) => Ok(()),
                Err(error) => {
                    if was_active && !self.sender.is_active() {
                        self.end(Outcome::NotTaken(error));
                    }
                    Err(dropped(error))
                }
            };
        }
        let received = self.receiver.handle(fragment, rest);
        self.acknowledge = received.acknowledge;
        if received.complete {
            let body = core::mem::take(&mut self.receiver);
            self.answer(body.body());
        } else if received.error.is_none() {
            // Every fragment has its own time.
            self.deadline = Some(now + self.timeout);
        }
        received.error.map_or(Ok(()), |error| Err(dropped(error)))
    }

    fn answer(&mut self, body: &[u8]) {
        let asked = self.body.first().copied().unwrap_or(0);
        let outcome = match Response::parse(body) {
            Ok(Response::Success { service, data }) if service.0 == asked => {
                Outcome::Done(data.iter().copied().take(EXPLICIT_MAX).collect())
            }
            Ok(Response::Success { service, .. }) => Outcome::Malformed(Error::invalid(
                "service of a response",
                0,
                u32::from(asked),
                u32::from(service.0),
            )),
            Ok(Response::Error { status, additional }) => Outcome::Refused { status, additional },
            Err(error) => Outcome::Malformed(error),
        };
        let acknowledge = self.acknowledge.take();
        self.end(outcome);
        self.acknowledge = acknowledge;
    }
}

const fn short() -> Error {
    Error::truncated("explicit message", 0, 1, 0)
}
