//! What the master tells its caller.

use core::fmt;

use super::super::connection::ConnectionKind;
use super::super::fragmentation::{Body, FragmentError};
use super::super::link::Refusal;
use super::super::wire::{AllocationChoice, MacId};
use super::station::Phase;
use crate::wire::Error;
use crate::wire::status::{GeneralStatus, Service};

/// Names one submitted request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ticket {
    /// MAC ID of the slave.
    pub slave: MacId,
    pub(super) serial: u64,
}

/// A request for the explicit connection of a slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExplicitRequest {
    /// Service code.
    pub service: Service,
    /// Class code.
    pub class: u16,
    /// Instance number; 0 is the class.
    pub instance: u16,
    /// Data of the service.
    pub data: Body,
}

impl ExplicitRequest {
    /// Any service. `None` if the data are longer than a message can be.
    #[must_use]
    pub fn new(service: Service, class: u16, instance: u16, data: &[u8]) -> Option<Self> {
        // The longest head in front of the data.
        let fits = data.len() + 5 <= super::super::fragmentation::EXPLICIT_MAX;
        fits.then(|| Self { service, class, instance, data: data.iter().copied().collect() })
    }

    /// Reads an attribute.
    #[must_use]
    pub fn get(class: u16, instance: u16, attribute: u8) -> Self {
        let data = core::iter::once(attribute).collect();
        Self { service: Service::GET_ATTRIBUTE_SINGLE, class, instance, data }
    }

    /// Writes an attribute. `None` if the value is longer than a message can be.
    #[must_use]
    pub fn set(class: u16, instance: u16, attribute: u8, value: &[u8]) -> Option<Self> {
        let mut request = Self::new(Service::SET_ATTRIBUTE_SINGLE, class, instance, value)?;
        request.data.try_insert(0, attribute).ok()?;
        Some(request)
    }
}

/// How a request ended.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "an answer is moved a few times; boxing it would allocate")]
pub enum Outcome {
    /// Done; the data of the response.
    Done(Body),
    /// The slave refuses.
    Refused {
        /// Why.
        status: GeneralStatus,
        /// Why more exactly; FF for nothing more.
        additional: u8,
    },
    /// No answer, though it was sent twice.
    NoAnswer,
    /// A fragment of the request was not taken, or not acknowledged.
    NotTaken(FragmentError),
    /// The answer cannot be read.
    Malformed(Error),
    /// The slave was lost, or given back, before there was an answer.
    Lost,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done(data) => write!(f, "done, data {data:02x?}"),
            Self::Refused { status, additional: 0xFF } => write!(f, "refused: {status}"),
            Self::Refused { status, additional } => {
                write!(f, "refused: {status}, additional code {additional:#04x}")
            }
            Self::NoAnswer => f.write_str("no answer"),
            Self::NotTaken(error) => write!(f, "not taken: {error}"),
            Self::Malformed(error) => write!(f, "the answer cannot be read: {error}"),
            Self::Lost => f.write_str("the slave was lost"),
        }
    }
}

/// Why a slave is not exchanged with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LossReason {
    /// It does not answer.
    NoAnswer(Phase),
    /// Another master has it.
    AnotherMaster,
    /// It refuses something.
    Refused {
        /// When.
        phase: Phase,
        /// Why.
        status: GeneralStatus,
        /// Why more exactly.
        additional: u8,
    },
    /// Its answer is not a valid response to the request.
    Malformed(Phase),
    /// It is another device than expected.
    Identity {
        /// Attribute of the Identity object: 1 vendor, 2 device type, 3 product code.
        attribute: u8,
        /// What is expected.
        expected: u16,
        /// What it is.
        found: u16,
    },
    /// A connection has another length than expected.
    Size {
        /// The connection.
        kind: ConnectionKind,
        /// What the slave produces, or what it consumes.
        produced: bool,
        /// Bytes expected.
        expected: usize,
        /// Bytes that the slave says.
        found: usize,
    },
    /// A connection carries another assembly, and does not let it be changed.
    Assembly {
        /// The connection.
        kind: ConnectionKind,
        /// Of what the slave produces, or what it consumes.
        produced: bool,
        /// The one that is expected.
        expected: u8,
        /// The one that it has; `None` where it has none that can be told.
        found: Option<u8>,
        /// What it says to another one.
        status: GeneralStatus,
    },
    /// Too many answers in a row have stayed away.
    Missed {
        /// The connection.
        kind: ConnectionKind,
        /// How many.
        count: u32,
    },
    /// It has started anew.
    Restarted,
    /// The master has left the network.
    MasterOffline,
}

impl fmt::Display for LossReason {
    // Flat: one arm per event.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAnswer(phase) => write!(f, "no answer ({phase})"),
            Self::AnotherMaster => f.write_str("another master has it"),
            Self::Refused { phase, status, additional } => {
                write!(f, "refuses ({phase}): {status}, additional code {additional:#04x}")
            }
            Self::Malformed(phase) => write!(f, "its answer cannot be read ({phase})"),
            Self::Identity { attribute, expected, found } => {
                let what = match attribute {
                    1 => "vendor ID",
                    2 => "device type",
                    _ => "product code",
                };
                write!(f, "{what}: expected {expected:#06x}, found {found:#06x}")
            }
            Self::Size { kind, produced, expected, found } => {
                let what = if *produced { "produced" } else { "consumed" };
                write!(f, "{kind}: expected {expected} bytes {what}, found {found}")
            }
            Self::Assembly { kind, produced, expected, found, status } => {
                let what = if *produced { "produced" } else { "consumed" };
                write!(f, "{kind}: expected assembly {expected} {what}, found ")?;
                match found {
                    Some(found) => write!(f, "{found}")?,
                    None => f.write_str("none that could be read")?,
                }
                write!(f, ", and it cannot be set: {status}")
            }
            Self::Missed { kind, count } => write!(f, "{kind}: {count} answers in a row are missing"),
            Self::Restarted => f.write_str("it has started anew"),
            Self::MasterOffline => f.write_str("the master has left the network"),
        }
    }
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(
    clippy::large_enum_variant,
    reason = "events are taken one by one, and answers are not kept among them"
)]
pub enum Event {
    /// The master is on line.
    Online,
    /// Another node has the master's MAC ID. The master is off the network until it is started again.
    DuplicateMac {
        /// The MAC ID.
        mac: MacId,
        /// Vendor ID of the other node.
        vendor: u16,
        /// Its serial number.
        serial: u32,
    },
    /// Another node has tried to take the MAC ID of a slave, which goes on.
    SlaveDuplicate {
        /// MAC ID of the slave.
        slave: MacId,
        /// Vendor ID of the other node.
        vendor: u16,
        /// Its serial number.
        serial: u32,
    },
    /// Another master polls a slave. One that is not taken yet is left alone until that has ended; for one that is exchanged
    /// with the application stops its axis and calls `give_way`. Told once until it has ended.
    OtherMaster {
        /// MAC ID of the slave.
        slave: MacId,
        /// The other master, where it was heard how it has asked for the slave.
        master: Option<MacId>,
    },
    /// The CAN controller has left the bus.
    BusOff,
    /// A slave is allocated and set up, and exchanged with from the next cycle on.
    Exchanging(MacId),
    /// A slave is not exchanged with any more, or could not be brought to it. It is tried again after a while. The same
    /// reason is reported once in a row.
    Lost {
        /// MAC ID of the slave.
        slave: MacId,
        /// Why.
        reason: LossReason,
    },
    /// A slave was given back.
    Released {
        /// MAC ID of the slave.
        slave: MacId,
        /// What was given back.
        choice: AllocationChoice,
    },
    /// A frame was not used. What it belonged to was dropped.
    Refused(Refusal),
    /// A submitted request has ended.
    Explicit {
        /// The ticket that `submit` returned.
        ticket: Ticket,
        /// How.
        outcome: Outcome,
    },
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Online => f.write_str("on line"),
            Self::DuplicateMac { mac, vendor, serial } => {
                write!(f, "{}", Refusal::DuplicateMac { mac: *mac, vendor: *vendor, serial: *serial })
            }
            Self::SlaveDuplicate { slave, vendor, serial } => write!(
                f,
                "slave {slave}: another node wants its MAC ID: vendor {vendor:#06x}, serial {serial:#010x}"
            ),
            Self::OtherMaster { slave, master: Some(master) } => {
                write!(f, "slave {slave}: another master polls it: MAC ID {master}")
            }
            Self::OtherMaster { slave, master: None } => {
                write!(f, "slave {slave}: another master polls it, whose MAC ID is not known")
            }
            Self::BusOff => f.write_str("bus off"),
            Self::Exchanging(slave) => write!(f, "slave {slave}: exchanging"),
            Self::Lost { slave, reason } => write!(f, "slave {slave}: {reason}"),
            Self::Released { slave, choice } => write!(f, "slave {slave}: given back: {choice}"),
            Self::Refused(refusal) => write!(f, "frame refused: {refusal}"),
            Self::Explicit { ticket, outcome } => write!(f, "slave {}: {outcome}", ticket.slave),
        }
    }
}
