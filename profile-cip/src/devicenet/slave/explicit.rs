//! Explicit messages of a slave: the unconnected port, the explicit connection, and the way to the objects.

use profile_generic::time::MonotonicTime;

use super::super::connection::{
    CLASS_CONNECTION, ConnectionEvent, ConnectionKind, ConnectionSetup, ConnectionState,
};
use super::super::fragmentation::{Body, EXPLICIT_MAX, ExplicitReceiver, ExplicitSender};
use super::super::link::Refusal;
use super::super::wire::allocation::{ALLOCATE, CLASS_DEVICENET, RELEASE};
use super::super::wire::explicit::{ERROR_RESPONSE, UNFRAGMENTED_MAX};
use super::super::wire::{
    AcknowledgeStatus, BodyFormat, Fragment, FragmentKind, Header, Identifier, MacId, Request, Response,
};
use super::Slave;
use super::allocation::NOT_ON_UNCONNECTED_PORT;
use super::application::{Application, ServiceError};
use super::event::SlaveEvent;
use super::objects::{DeviceNetObject, Router};
use crate::device::motion_link::ObjectPath;
use crate::device::objects::class::CLASS_MESSAGE_ROUTER;
use crate::device::objects::identity::{CLASS_IDENTITY, Identity, Ownership, reset_kind};
use crate::device::objects::object::{self, Answer, Object};
use crate::wire::Error;
use crate::wire::status::{GeneralStatus, REPLY_BIT, Service};

/// Service: ends a connection.
const DELETE: Service = Service(0x09);
/// Service: takes attributes over.
const APPLY_ATTRIBUTES: Service = Service(0x0D);

/// Size of the explicit connection as attributes 7 and 8 show it.
const EXPLICIT_SIZE: u16 = 512;
const _: () = assert!(EXPLICIT_SIZE as usize == EXPLICIT_MAX);

/// Transport class and trigger of the explicit connection: server, application, class 3.
const EXPLICIT_TRANSPORT: u8 = 0x83;

/// The message under way on the explicit connection.
#[derive(Debug, Default)]
pub(super) struct ExplicitServer {
    receiver: ExplicitReceiver,
    sender: ExplicitSender,
    /// XID of the response that is being sent.
    xid: bool,
}

impl ExplicitServer {
    pub fn reset(&mut self) {
        self.receiver.reset();
        self.sender.abandon();
    }

    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.sender.wake_at()
    }
}

fn splits_attribute(service: Service) -> bool {
    matches!(service, Service::GET_ATTRIBUTE_SINGLE | Service::SET_ATTRIBUTE_SINGLE)
}

/// Path and data of a request to an object of this crate: the attribute is the first byte of data where the service has one.
pub(super) fn path_of<'a>(request: &Request<'a>) -> Result<(ObjectPath, &'a [u8]), ServiceError> {
    let path =
        ObjectPath { class: request.class, instance: u32::from(request.instance), ..ObjectPath::default() };
    if !splits_attribute(request.service) {
        return Ok((path, request.data));
    }
    let (attribute, data) = request.data.split_first().ok_or(GeneralStatus::NOT_ENOUGH_DATA)?;
    Ok((ObjectPath { attribute: Some(u16::from(*attribute)), ..path }, data))
}

pub(super) fn serve<T: Object>(
    object: &mut T,
    request: &Request<'_>,
    reply: &mut Body,
) -> Result<(), ServiceError> {
    let (path, data) = path_of(request)?;
    let Answer { status, data, .. } = object::serve(object, request.service, &path, data, EXPLICIT_MAX);
    if status != GeneralStatus::SUCCESS {
        let missing = status == GeneralStatus::PATH_DESTINATION_UNKNOWN;
        return Err(if missing { GeneralStatus::OBJECT_DOES_NOT_EXIST } else { status }.into());
    }
    append(reply, &data)
}

pub(super) fn append(reply: &mut Body, data: &[u8]) -> Result<(), ServiceError> {
    reply.try_extend_from_slice(data).map_err(|_| GeneralStatus::REPLY_DATA_TOO_LARGE.into())
}

impl<A: Application> Slave<A> {
    /// What a connection carries.
    pub(super) fn setup(&self, kind: ConnectionKind) -> Option<ConnectionSetup> {
        match kind {
            ConnectionKind::Explicit => Some(ConnectionSetup {
                transport: EXPLICIT_TRANSPORT,
                produced_size: EXPLICIT_SIZE,
                consumed_size: EXPLICIT_SIZE,
                supervised: false,
            }),
            io => self.application.setup(io),
        }
    }

    /// The unconnected port of a group 2 only server: Allocate and Release, in one frame each.
    pub(super) fn handle_unconnected(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        data: &[u8],
    ) -> Result<(), Refusal> {
        let malformed = |error| Refusal::Malformed(identifier, error);
        let (first, body) = data.split_first().ok_or(malformed(short()))?;
        let header = Header::parse(*first);
        if header.fragmented {
            return Err(malformed(Error::invalid("fragmentation of an unconnected request", 0, 0, 1)));
        }
        // The format that the answer to an allocation names is that of the explicit connection.
        let request = Request::parse(BodyFormat::CLASS_8_INSTANCE_8, body).map_err(malformed)?;
        let mut reply = Body::new();
        let allocates = matches!(request.service.0, ALLOCATE | RELEASE)
            && (request.class, request.instance) == (u16::from(CLASS_DEVICENET), 1);
        let outcome = if allocates {
            self.serve_devicenet(now, header.mac, &request, &mut reply)
        } else {
            Err(ServiceError {
                status: GeneralStatus::SERVICE_NOT_SUPPORTED,
                additional: NOT_ON_UNCONNECTED_PORT,
            })
        };
        let body = response_body(request.service, outcome, &reply);
        self.respond(header, &body);
        Ok(())
    }

    /// The explicit connection.
    pub(super) fn handle_explicit(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        data: &[u8],
    ) -> Result<(), Refusal> {
        let (first, rest) = data.split_first().ok_or(Refusal::Malformed(identifier, short()))?;
        let header = Header::parse(*first);
        if !self.connection(ConnectionKind::Explicit).state().takes_messages() {
            return Err(Refusal::NoConnection(identifier));
        }
        let expected = self.master.unwrap_or(self.config.mac);
        if header.mac != expected {
            return Err(Refusal::Peer { expected, found: header.mac });
        }
        let _ = self.connection_event(now, ConnectionKind::Explicit, ConnectionEvent::Message);
        if !header.fragmented {
            self.explicit.receiver.reset();
            return self.execute(now, identifier, header, rest);
        }
        let (byte, rest) = rest.split_first().ok_or(Refusal::Malformed(identifier, short()))?;
        let fragment = Fragment::parse(*byte);
        if fragment.kind == FragmentKind::Acknowledge {
            let status = rest.first().ok_or(Refusal::Malformed(identifier, short()))?;
            let outcome = self.explicit.sender.handle(fragment.count, AcknowledgeStatus(*status));
            self.poll_explicit(now);
            return outcome.map(drop).map_err(|error| Refusal::Fragment(identifier, error));
        }
        let received = self.explicit.receiver.handle(fragment, rest);
        if let Some((count, status)) = received.acknowledge {
            let byte = Fragment { kind: FragmentKind::Acknowledge, count }.byte();
            let header = Header { fragmented: true, ..header };
            self.send(Identifier::ExplicitResponse(self.config.mac), &[header.byte(), byte, status.0]);
        }
        if received.complete {
            let body: Body = self.explicit.receiver.body().iter().copied().collect();
            return self.execute(now, identifier, header, &body);
        }
        received.error.map_or(Ok(()), |error| Err(Refusal::Fragment(identifier, error)))
    }

    fn execute(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        header: Header,
        body: &[u8],
    ) -> Result<(), Refusal> {
        let parsed = Request::parse(self.config.body_format, body);
        let request = parsed.map_err(|error| Refusal::Malformed(identifier, error))?;
        let mut reply = Body::new();
        let outcome = self.serve(now, header.mac, &request, &mut reply);
        let body = response_body(request.service, outcome, &reply);
        self.respond(header, &body);
        self.poll_explicit(now);
        Ok(())
    }

    /// Sends a response, in fragments where it has to be.
    fn respond(&mut self, header: Header, body: &[u8]) {
        self.explicit.sender.abandon();
        if body.len() > UNFRAGMENTED_MAX {
            self.explicit.xid = header.xid;
            self.explicit.sender.start(body);
            return;
        }
        let mut data = [0; 8];
        data[0] = Header { fragmented: false, ..header }.byte();
        data[1..=body.len()].copy_from_slice(body);
        self.send(Identifier::ExplicitResponse(self.config.mac), &data[..=body.len()]);
    }

    /// Sends the fragment that is due.
    pub(super) fn poll_explicit(&mut self, now: MonotonicTime) {
        if self.explicit.sender.handle_time(now).is_err() {
            self.tell(SlaveEvent::ResponseLost);
        }
        let Some(part) = self.explicit.sender.poll(now) else { return };
        let mac = self.master.unwrap_or(self.config.mac);
        let header = Header { fragmented: true, xid: self.explicit.xid, mac };
        let mut data = [0; 8];
        data[..2].copy_from_slice(&[header.byte(), part.fragment.byte()]);
        let len = 2 + part.data.len().min(6);
        data[2..len].copy_from_slice(&part.data[..len - 2]);
        self.send(Identifier::ExplicitResponse(self.config.mac), &data[..len]);
    }

    // -- objects ------------------------------------------------------------------------------------------------

    fn serve(
        &mut self,
        now: MonotonicTime,
        originator: MacId,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        match request.class {
            CLASS_IDENTITY => self.serve_identity(now, request, reply),
            CLASS_MESSAGE_ROUTER => {
                let exists = |one: &&super::Connection| one.state() != ConnectionState::NON_EXISTENT;
                let active = u16::try_from(self.connections.iter().filter(exists).count()).unwrap_or(0);
                serve(&mut Router { classes: self.application.classes(), active }, request, reply)
            }
            class if class == u16::from(CLASS_DEVICENET) => {
                self.serve_devicenet(now, originator, request, reply)
            }
            class if class == u16::from(CLASS_CONNECTION) => self.serve_connection(now, request, reply),
            class if self.application.classes().contains(&class) => {
                self.application.serve(now, originator, request, reply)
            }
            _ => Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into()),
        }
    }

    fn serve_identity(
        &mut self,
        now: MonotonicTime,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        if request.service == Service::RESET && request.instance == 1 {
            let kind = reset_kind(request.data)?;
            if !self.application.permits_reset(now) {
                return Err(GeneralStatus::DEVICE_STATE_CONFLICT.into());
            }
            self.application.reset(kind);
            self.restart = true;
            self.tell(SlaveEvent::Reset(kind));
            return Ok(());
        }
        let ownership = match (self.is_io_established(), self.timed_out) {
            (true, _) => Ownership::Owned,
            (false, true) => Ownership::Lost,
            (false, false) => Ownership::Free,
        };
        let health = self.application.health();
        let config = &self.config.identity;
        serve(&mut Identity { config, health, ownership, consistency: config.configuration }, request, reply)
    }

    fn serve_devicenet(
        &mut self,
        now: MonotonicTime,
        originator: MacId,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        match (request.service.0, request.instance) {
            (ALLOCATE, 1) => {
                let allocate = self.allocation().check_allocate(originator, request.data)?;
                self.allocate(now, allocate.allocator, allocate.choice);
                return append(reply, &[self.config.body_format.0]);
            }
            (RELEASE, 1) => {
                let choice = self.allocation().check_release(originator, request.data)?;
                self.release(now, choice);
                return Ok(());
            }
            _ => {}
        }
        let (mac, rate) = (self.config.mac, self.config.rate);
        let (held, master) = (self.held(), self.master);
        let io_established = self.is_io_established();
        let (config, bus_offs) = (&mut self.config, &mut self.bus_offs);
        serve(&mut DeviceNetObject { config, bus_offs, held, master, io_established }, request, reply)?;
        if self.config.rate != rate {
            self.tell(SlaveEvent::RateChanged(self.config.rate));
        }
        if self.config.mac != mac {
            // The answer still goes out under the old one.
            let new = core::mem::replace(&mut self.config.mac, mac);
            self.next_mac = Some(new);
            self.restart = true;
            self.tell(SlaveEvent::MacChanged(new));
        }
        Ok(())
    }

    // Flat: one arm per service.
    fn serve_connection(
        &mut self,
        now: MonotonicTime,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        if request.instance == 0 {
            // Revision of the class.
            return match (request.service, request.data) {
                (Service::GET_ATTRIBUTE_SINGLE, [1]) => append(reply, &1_u16.to_le_bytes()),
                (Service::GET_ATTRIBUTE_SINGLE, _) => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
                _ => Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
            };
        }
        let kind =
            ConnectionKind::ALL.into_iter().find(|kind| u16::from(kind.instance()) == request.instance);
        let Some(kind) = kind.filter(|kind| self.connection(*kind).state() != ConnectionState::NON_EXISTENT)
        else {
            return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into());
        };
        let plain = |event| match request.data {
            [] => Ok(event),
            _ => Err(ServiceError::from(GeneralStatus::TOO_MUCH_DATA)),
        };
        let event = match (request.service, request.data) {
            (Service::GET_ATTRIBUTE_SINGLE, [attribute]) => {
                let paths = self.application.paths(kind);
                self.connections[kind.index()].get(*attribute, paths, reply)?;
                return Ok(());
            }
            (Service::SET_ATTRIBUTE_SINGLE, [attribute, value @ ..]) => {
                let before = self.connection(kind).rate_ms();
                let change = self.connection_mut(kind).set(now, *attribute, value)?;
                if self.connection(kind).rate_ms() == before {
                    self.changed(now, kind, change);
                } else {
                    self.told(now, kind, change);
                }
                if *attribute == 9 {
                    append(reply, &self.connection(kind).rate_ms().to_le_bytes())?;
                }
                return Ok(());
            }
            (Service::GET_ATTRIBUTE_SINGLE | Service::SET_ATTRIBUTE_SINGLE, []) => {
                return Err(GeneralStatus::NOT_ENOUGH_DATA.into());
            }
            (Service::GET_ATTRIBUTE_SINGLE, _) => return Err(GeneralStatus::TOO_MUCH_DATA.into()),
            (Service::RESET, _) => plain(ConnectionEvent::Reset)?,
            (DELETE, _) => plain(ConnectionEvent::Release)?,
            // Without an expected packet rate there would be no watchdog.
            (APPLY_ATTRIBUTES, _) if self.connection(kind).lacks_rate() => {
                return Err(GeneralStatus::OBJECT_STATE_CONFLICT.into());
            }
            (APPLY_ATTRIBUTES, _) => plain(ConnectionEvent::Apply)?,
            _ => return Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
        };
        self.connection_event(now, kind, event)?;
        self.free(now);
        Ok(())
    }
}

const fn short() -> Error {
    Error::truncated("explicit message", 0, 1, 0)
}

/// The body of a response.
fn response_body(service: Service, outcome: Result<(), ServiceError>, reply: &Body) -> Body {
    let too_large = ServiceError::from(GeneralStatus::REPLY_DATA_TOO_LARGE);
    let response = match &outcome {
        Ok(()) => Response::Success { service, data: reply },
        Err(error) => Response::Error { status: error.status, additional: error.additional },
    };
    let refusal = |error: ServiceError| [ERROR_RESPONSE | REPLY_BIT, error.status.0, error.additional];
    let mut bytes = [0; EXPLICIT_MAX];
    let body = match response.emit(&mut bytes) {
        Ok(len) => &bytes[..len],
        Err(_) => &refusal(too_large),
    };
    body.iter().copied().collect()
}
