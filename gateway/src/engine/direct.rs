//! Direct accesses to what a drive keeps, by the number that it has there: elements of IDNs, objects, attributes.
//!
//! They are for people and their tools, over local control: the bytes are those of the drive, and so are its error codes. Data of
//! any length travel in a buffer that the client brings and gets back. One access is in progress at a time, whatever the bus.
//!
//! A write is only done while nobody controls an axis of the device and none of them has torque.
//!
//! This runs in the cycle: it does not allocate or wait. Requests come through a bounded queue.

use profile_cia402::sdo::request::SdoFailure;
use profile_cia402::wire::abort::AbortCode;
use profile_cip::wire::status::GeneralStatus;
use profile_sercos::master::svc::request::SvcFailure;
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use super::access::{AccessFailure, Refusal};
use super::axis::{AxisChannel, Owner};
use super::bus::{Buses, can, devicenet, sercos};
use super::local::ClientId;
use super::north::Exchange;
use super::sharing::{rescale, sharing};
use crate::mapping::{Item, Object};

/// Length of the queues of requests and of answers.
const QUEUE_LEN: usize = 16;

/// Longest data of an access, bytes: a list or text of SERCOS has no more.
pub const DATA_MAX: usize = 65_535;

/// Longest data that every bus writes in a single step, bytes: the drive takes them all or none.
const SINGLE_STEP_MAX: usize = 4;

/// What is accessed in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// An element of an IDN of a SERCOS drive.
    Element(Idn, Element),
    /// The data status of an IDN of a SERCOS drive, two bytes; it is only read.
    Status(Idn),
    /// An object of a CANopen device.
    Object(Object),
    /// An attribute of a drive on DeviceNet.
    Attribute {
        /// Class code.
        class: u16,
        /// Instance number; 0 is the class.
        instance: u16,
        /// Number of the attribute.
        attribute: u16,
    },
}

impl Target {
    /// The value of the drive that it is; `None` for what describes one, and for another instance than the axis itself.
    fn item(self) -> Option<Item> {
        match self {
            Self::Element(idn, Element::Data) => Some(Item::Idn(idn)),
            Self::Object(object) => Some(Item::Object(object)),
            Self::Attribute { class, instance: 1, attribute } => Some(Item::attribute(class, attribute)),
            Self::Element(..) | Self::Status(_) | Self::Attribute { .. } => None,
        }
    }
}

/// Whether a target is read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Into the buffer of the request.
    Read,
    /// What is in the buffer.
    Write {
        /// The drive's values mean something else afterwards: the axis is not enabled before its drive was commissioned again.
        rescales: bool,
    },
}

/// From a client to the engine.
#[derive(Debug, PartialEq, Eq)]
pub struct DirectRequest {
    /// Who has sent it; the answer goes there.
    pub client: ClientId,
    /// Returned in the [`DirectAnswer`].
    pub id: u32,
    /// Position of the axis in the configuration, from 0.
    pub axis: u8,
    /// What is accessed.
    pub target: Target,
    /// Whether it is read or written.
    pub direction: Direction,
    /// What is written, or the place for what is read: as much as its capacity.
    pub data: Vec<u8>,
}

/// What a bus is asked for.
#[derive(Debug)]
pub struct DirectTask {
    /// What is accessed.
    pub target: Target,
    /// Whether it is written.
    pub write: bool,
    /// What is written, or the place for what is read.
    pub data: Vec<u8>,
}

/// Why a bus has not begun with it, and the buffer.
pub type NotBegun = (DirectFailure, Vec<u8>);

/// Its result.
#[derive(Debug, PartialEq, Eq)]
pub struct DirectAnswer {
    /// The client that sent the request.
    pub client: ClientId,
    /// The number of the request.
    pub id: u32,
    /// The attribute of the IDN, if the drive was asked for it; or why the access failed.
    pub result: Result<Option<Attribute>, DirectFailure>,
    /// What was read, or written.
    pub data: Vec<u8>,
}

/// What a bus has to say of an access that has ended.
#[derive(Debug, PartialEq, Eq)]
pub struct DirectResult {
    /// As in the [`DirectAnswer`].
    pub result: Result<Option<Attribute>, DirectFailure>,
    /// The buffer.
    pub data: Vec<u8>,
}

/// Why an access failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DirectFailure {
    /// No such axis.
    #[error("no such axis")]
    NoAxis,
    /// A controller is connected to a device of the axes of this drive.
    #[error("a controller is connected to the device of this axis")]
    Controller,
    /// A client of local control has an axis of this drive.
    #[error("a client of local control has this axis")]
    Held,
    /// An axis of this drive may have torque.
    #[error("parameters are not written while the drive has torque")]
    Torque,
    /// The gateway is stopping.
    #[error("the gateway is stopping")]
    Ending,
    /// The drive of the axis is on another kind of bus.
    #[error("the drive of this axis is on another kind of bus")]
    OtherBus,
    /// The drive is not there, or not ready for it.
    #[error("the drive is not there, or is not commissioned yet")]
    NoDrive,
    /// Too many accesses wait, or no message can carry this one.
    #[error("the access cannot be sent to the drive")]
    Unsent,
    /// The service channel of a SERCOS drive.
    #[error("{}", svc_text(.0))]
    Svc(SvcFailure),
    /// SDO of a CANopen device.
    #[error("{}", sdo_text(.0))]
    Sdo(SdoFailure),
    /// An explicit message of DeviceNet, with its status.
    #[error("the drive refuses it with status {:#04x}: {}", .0.0, .0)]
    Cip(GeneralStatus),
    /// The drive did not answer, or its answer makes no sense.
    #[error("the drive does not answer")]
    Unanswered,
    /// The drive has more bytes than the buffer.
    #[error("the drive has more than {0} bytes")]
    TooLong(usize),
}

impl DirectFailure {
    /// Whether the drive may have taken a write of `len` bytes that failed so, in whole or in part: not one that did not reach it, and
    /// not one of a single step that it has refused.
    #[must_use]
    pub fn may_have_written(&self, len: usize) -> bool {
        match self {
            Self::NoAxis
            | Self::Controller
            | Self::Held
            | Self::Torque
            | Self::Ending
            | Self::OtherBus
            | Self::NoDrive
            | Self::Unsent
            | Self::Svc(SvcFailure::Length { .. }) => false,
            // Nobody knows how far a memory that fails has come.
            Self::Sdo(SdoFailure::Refused(AbortCode::HARDWARE)) => true,
            Self::Svc(SvcFailure::Refused { .. }) | Self::Sdo(SdoFailure::Refused(_)) | Self::Cip(_) => {
                len > SINGLE_STEP_MAX
            }
            Self::Svc(_) | Self::Sdo(_) | Self::Unanswered | Self::TooLong(_) => true,
        }
    }

    /// The code in the protocol of local control. Codes never change.
    #[must_use]
    pub fn code(&self) -> &'static str {
        let refusal = match self {
            Self::NoAxis => return "no-axis",
            Self::Controller => return "controller",
            Self::Held => return "held",
            Self::Torque => return "torque",
            Self::Ending => return "ending",
            Self::OtherBus => return "no-parameter",
            Self::Unsent => return "busy",
            Self::TooLong(_) => return "too-long",
            Self::NoDrive | Self::Unanswered => return "unanswered",
            Self::Svc(SvcFailure::TooLong { .. }) | Self::Sdo(SdoFailure::TooLong { .. }) => {
                return "too-long";
            }
            Self::Svc(SvcFailure::Length { .. }) => return "value",
            Self::Svc(failure) => sercos::failure(*failure),
            Self::Sdo(failure) => can::failure(*failure),
            Self::Cip(status) => {
                AccessFailure::Refused(devicenet::access::refusal(*status).unwrap_or(Refusal::Other))
            }
        };
        match refusal {
            AccessFailure::Refused(Refusal::Unknown) => "absent",
            AccessFailure::Refused(Refusal::ReadOnly) => "read-only",
            AccessFailure::Refused(Refusal::Value) => "value",
            AccessFailure::Refused(Refusal::Other) => "refused",
            AccessFailure::Unanswered => "unanswered",
        }
    }
}

fn svc_text(failure: &SvcFailure) -> String {
    match failure {
        SvcFailure::Refused { element, code } => {
            let name = code.name().unwrap_or("unknown code");
            format!("the drive refuses the {element} with {:#06x}: {name}", code.0)
        }
        other => other.to_string(),
    }
}

fn sdo_text(failure: &SdoFailure) -> String {
    match failure {
        SdoFailure::Refused(code) => {
            format!("the drive refuses it with {:#010x}: {}", code.0, code.name().unwrap_or("unknown code"))
        }
        other => other.to_string(),
    }
}

/// The client side of the queues.
#[derive(Debug)]
pub struct DirectEnd {
    /// To the engine.
    pub requests: rtrb::Producer<DirectRequest>,
    /// From the engine.
    pub answers: rtrb::Consumer<DirectAnswer>,
}

/// The accesses of all clients, one after the other.
#[derive(Debug)]
pub struct DirectNorth {
    requests: rtrb::Consumer<DirectRequest>,
    answers: rtrb::Producer<DirectAnswer>,
    active: Option<Active>,
}

/// The access that the drive of an axis was asked for.
#[derive(Debug)]
struct Active {
    client: ClientId,
    id: u32,
    axis: usize,
    /// It has so many bytes of what decides what the values of the device mean.
    rescales: Option<usize>,
}

impl DirectNorth {
    /// Without accesses, and the client side of its queues.
    #[must_use]
    pub fn new() -> (Self, DirectEnd) {
        let (requests, taken) = rtrb::RingBuffer::new(QUEUE_LEN);
        let (given, answers) = rtrb::RingBuffer::new(QUEUE_LEN);
        (Self { requests: taken, answers: given, active: None }, DirectEnd { requests, answers })
    }

    /// Answers the access that has ended, and begins the next one. Gives the axis and the item that are written by it.
    pub(super) fn exchange(
        &mut self,
        exchange: &mut Exchange<'_>,
        buses: &mut Buses,
    ) -> Option<(usize, Item)> {
        let now = (exchange.now, exchange.system());
        let Exchange { ending, ref mut axes, .. } = *exchange;
        // A buffer is freed by who has made it: nothing is taken that cannot be answered.
        if self.answers.is_full() {
            return None;
        }
        if let Some(Active { client, id, axis, rescales }) = self.active {
            let DirectResult { result, data } = buses.take_direct(axis)?;
            self.active = None;
            if let (Err(failure), Some(len)) = (&result, rescales)
                && !failure.may_have_written(len)
            {
                rescale(now, axis, (axes, buses), false);
            }
            let _ = self.answers.push(DirectAnswer { client, id, result, data });
            return None;
        }
        let request = self.requests.pop().ok()?;
        let DirectRequest { client, id, axis, target, direction, data } = request;
        let axis = usize::from(axis);
        let len = data.len();
        let begun = match refusal(axis, direction, axes, ending, buses) {
            Some(failure) => Err((failure, data)),
            None => {
                let write = direction != Direction::Read;
                buses.begin_direct(axis, DirectTask { target, write, data })
            }
        };
        // Before it is known whether the drive takes it: a lost answer is no sign that it does not.
        let written = target.item().filter(|_| begun.is_ok() && direction != Direction::Read);
        match begun {
            Ok(()) => {
                let rescales = direction == (Direction::Write { rescales: true });
                if rescales {
                    rescale(now, axis, (axes, buses), true);
                }
                self.active = Some(Active { client, id, axis, rescales: rescales.then_some(len) });
            }
            Err((failure, data)) => {
                let _ = self.answers.push(DirectAnswer { client, id, result: Err(failure), data });
            }
        }
        written.map(|item| (axis, item))
    }
}

/// Why an access is not begun. Reading disturbs nobody.
fn refusal(
    number: usize,
    direction: Direction,
    axes: &[AxisChannel],
    ending: bool,
    buses: &Buses,
) -> Option<DirectFailure> {
    if ending {
        return Some(DirectFailure::Ending);
    }
    let Some(axis) = axes.get(number) else { return Some(DirectFailure::NoAxis) };
    if direction == Direction::Read {
        return None;
    }
    // What an axis needs is known once it has a program; what is written before is not what the program was made of.
    if axis.south().is_none() {
        return Some(DirectFailure::NoDrive);
    }
    sharing(number, axes, buses).find_map(|(_, axis)| match axis.owner() {
        _ if axis.has_controller() => Some(DirectFailure::Controller),
        Owner::Controller => Some(DirectFailure::Controller),
        Owner::Local => Some(DirectFailure::Held),
        Owner::Nobody => axis.may_have_torque().then_some(DirectFailure::Torque),
    })
}

#[cfg(test)]
mod tests {
    use profile_sercos::wire::svc_error::SvcError;

    use super::*;

    #[test]
    fn only_a_refusal_of_a_single_step_leaves_what_the_drive_has() {
        let svc =
            |code| DirectFailure::Svc(SvcFailure::Refused { element: Element::Data, code: SvcError(code) });
        let sdo = |code| DirectFailure::Sdo(SdoFailure::Refused(code));
        for (failure, len, may) in [
            (DirectFailure::Torque, 2, false),
            (DirectFailure::Unsent, 8, false),
            (svc(0x7005), 4, false),
            (svc(0x7005), 5, true),
            (sdo(AbortCode::READ_ONLY), 4, false),
            (sdo(AbortCode::READ_ONLY), 8, true),
            (sdo(AbortCode::HARDWARE), 4, true),
            (DirectFailure::Cip(GeneralStatus::ATTRIBUTE_NOT_SETTABLE), 2, false),
            (DirectFailure::Sdo(SdoFailure::Timeout { milliseconds: 500 }), 1, true),
            (DirectFailure::Unanswered, 1, true),
        ] {
            assert_eq!(failure.may_have_written(len), may, "{failure:?} {len}");
        }
    }
}
