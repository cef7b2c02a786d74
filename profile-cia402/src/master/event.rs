//! What the master tells its caller.

use core::fmt;

use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;

use super::boot::BootStatus;
use super::config::Direction;
use super::foreign::OtherMaster;
use super::report::ReportRow;
use crate::sdo::request::SdoOutcome;
use crate::wire::emcy::Emcy;
use crate::wire::nmt::NmtState;
use crate::wire::pdo::{SUB_TYPE, TransmissionType};
use crate::wire::{Function, NodeId};

/// Names one submitted SDO request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ticket {
    /// The device.
    pub node: NodeId,
    /// Serial number at the device.
    pub(super) serial: u64,
}

/// What the master wants done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Send this frame.
    Transmit(Frame),
}

/// Why two devices seem to have the same node-id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DuplicateSign {
    /// Two boot-up messages within the shortest time that a start takes. Some devices send two; it comes up nevertheless.
    BootUps,
    /// Two answers to one question. The device is stopped.
    Answers,
    /// Two TPDOs in one SYNC period, again and again. The device is stopped.
    Pdos,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "events are taken one by one; only a few are kept")]
pub enum Event {
    /// The device is the right one and has its configuration. The application may work and then call `node_ready`.
    AwaitingApplication {
        /// The device.
        node: NodeId,
        /// It has been in operation all the time (status L): its configuration was not written.
        kept: bool,
    },
    /// The device does not take the mapping of a PDO, and the one that it has is used. The application must look what that is.
    MappingAdopted {
        /// The device.
        node: NodeId,
        /// Which way.
        direction: Direction,
        /// Number of the PDO.
        number: u16,
    },
    /// The device has another program than it must, and is given it. It comes again when it runs.
    ProgramDownload {
        /// The device.
        node: NodeId,
    },
    /// The device is in operation.
    Operational {
        /// The device.
        node: NodeId,
    },
    /// The device does not come up. A boot-up message or `retry` starts it again; with status B it is asked again by itself
    /// until its boot time is over.
    BootFailed {
        /// The device.
        node: NodeId,
        /// Error status; `None` for two devices with one node-id, for which CiA 302 has no letter.
        status: Option<BootStatus>,
        /// The step that failed, and how.
        step: Option<ReportRow>,
        /// Whether the network needs it.
        mandatory: bool,
    },
    /// All mandatory devices are in operation.
    NetworkOperational,
    /// A device that was set up already has restarted: its data are not valid any more. It is brought up again.
    Rebooted {
        /// The device.
        node: NodeId,
        /// Whether it was in operation.
        operational: bool,
    },
    /// The device's heartbeat is gone. It is stopped, and brought up again after a while.
    HeartbeatLost {
        /// The device.
        node: NodeId,
    },
    /// The device does not answer to node guarding any more. It is stopped, and brought up again after a while.
    GuardingLost {
        /// The device.
        node: NodeId,
    },
    /// The device has left operation by itself, or by somebody else's command. It is brought up again after a while.
    StateChanged {
        /// The device.
        node: NodeId,
        /// What its heartbeat, or its answer to node guarding, tells.
        state: NmtState,
    },
    /// EMCY.
    Emcy {
        /// The device.
        node: NodeId,
        /// What it tells.
        emcy: Emcy,
    },
    /// The device sends more EMCYs than are logged one by one. The last one can be read at any time.
    EmcyStorm {
        /// The device.
        node: NodeId,
    },
    /// A PDO has another transmission type than it was to have: the device does not take that one. Told before
    /// [`Event::Operational`].
    TransmissionAdopted {
        /// The device.
        node: NodeId,
        /// Which way the PDO goes.
        direction: Direction,
        /// Its number.
        number: u16,
        /// What it was to have.
        wanted: TransmissionType,
        /// What it has.
        found: TransmissionType,
    },
    /// A device falls out again and again: nothing is done with it for a while.
    LeftAlone {
        /// The device.
        node: NodeId,
        /// How often in a row.
        times: u32,
        /// How long.
        pause: DurationNs,
    },
    /// More TPDOs than permitted did not come.
    PdoLost {
        /// The device.
        node: NodeId,
        /// Number of the TPDO.
        number: u16,
    },
    /// A TPDO that was lost comes again.
    PdoBack {
        /// The device.
        node: NodeId,
        /// Number of the TPDO.
        number: u16,
    },
    /// A TPDO has another length than its mapping. It is not taken. Told once until a good one comes.
    PdoLength {
        /// The device.
        node: NodeId,
        /// Number of the TPDO.
        number: u16,
        /// Bytes mapped.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// Two devices seem to have the same node-id. Told once per boot and sign.
    DuplicateNode {
        /// The node-id.
        node: NodeId,
        /// Why it seems so.
        sign: DuplicateSign,
    },
    /// A device that is not in the list is there (status A). Told once.
    UnknownNode {
        /// Its node-id.
        node: NodeId,
    },
    /// Somebody else sends what only the master may send. Told once per kind of frame.
    SecondMaster {
        /// The kind of frame.
        function: Option<Function>,
        /// Its identifier.
        id: Id,
    },
    /// Another master is on the bus. Before the first frame this one waits until he is silent; in operation the application stops
    /// what it leads and calls `give_way`.
    OtherMaster(OtherMaster),
    /// Nothing is sent any more, because of another master, until he has been silent for a while.
    GaveWay,
    /// The bus is off: no device can be reached, and nothing is valid.
    BusOff,
    /// The bus is back. All devices are brought up again.
    BusOn,
    /// A frame could not be sent. Told once until a SYNC period without.
    TransmitFailed {
        /// Its identifier.
        id: Id,
    },
    /// A request of the application has ended.
    Sdo {
        /// The ticket that `sdo_submit` returned.
        ticket: Ticket,
        /// What came out.
        outcome: SdoOutcome,
    },
}

impl fmt::Display for Event {
    // Flat: one arm per event.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AwaitingApplication { node, kept: false } => {
                write!(f, "node {node} is the expected device")
            }
            Self::AwaitingApplication { node, kept: true } => {
                write!(f, "node {node} is the expected device and still in operation")
            }
            Self::MappingAdopted { node, direction, number } => {
                write!(f, "node {node} keeps its own mapping of {direction} {number}")
            }
            Self::TransmissionAdopted { node, direction, number, wanted, found } => {
                let object = direction.communication_object(*number, SUB_TYPE);
                let effect = match (direction, found.is_event_driven()) {
                    (_, false) => "",
                    (Direction::Receive, true) => {
                        "; it counts as soon as it is there, and is sent a cycle later"
                    }
                    (Direction::Transmit, true) => "; it comes by its event timer, not at SYNC",
                };
                write!(
                    f,
                    "node {node} does not take transmission type {} for {direction} {number} ({object}), and has {}{effect}",
                    wanted.0, found.0
                )
            }
            Self::Operational { node } => write!(f, "node {node} is in operation"),
            Self::BootFailed { node, status, step, .. } => {
                write!(f, "node {node} does not come up")?;
                if let Some(status) = status {
                    write!(f, ": {status}")?;
                }
                match step {
                    Some(step) => write!(f, ": {step}"),
                    None => Ok(()),
                }
            }
            Self::NetworkOperational => f.write_str("all mandatory nodes are in operation"),
            Self::Rebooted { node, operational: true } => {
                write!(f, "node {node} has restarted while it was in operation")
            }
            Self::Rebooted { node, operational: false } => write!(f, "node {node} has restarted"),
            Self::LeftAlone { node, times, pause } => write!(
                f,
                "node {node} has restarted or was lost {times} times without being in operation for 10 s; it is left alone for {pause}"
            ),
            Self::ProgramDownload { node } => {
                write!(f, "node {node} has another program and is given its own")
            }
            Self::HeartbeatLost { node } => write!(f, "the heartbeat of node {node} is gone"),
            Self::GuardingLost { node } => write!(f, "node {node} does not answer to node guarding any more"),
            Self::StateChanged { node, state } => write!(f, "node {node} has left operation: it is {state}"),
            Self::Emcy { node, emcy } => write!(f, "node {node}: {emcy}"),
            Self::EmcyStorm { node } => {
                write!(f, "node {node} sends more emergency messages than are logged one by one")
            }
            Self::PdoLost { node, number } => {
                write!(f, "TPDO {number} of node {node} is missing more often than permitted")
            }
            Self::PdoBack { node, number } => write!(f, "TPDO {number} of node {node} comes again"),
            Self::PdoLength { node, number, expected, found } => {
                write!(
                    f,
                    "TPDO {number} of node {node}: expected {expected} bytes, got {found}; it is ignored"
                )
            }
            Self::DuplicateNode { node, sign } => {
                let sign = match sign {
                    DuplicateSign::BootUps => "two boot-up messages in a row",
                    DuplicateSign::Answers => "two answers to one question",
                    DuplicateSign::Pdos => "two of each TPDO",
                };
                write!(f, "two devices seem to have node-id {node}: {sign}")
            }
            Self::UnknownNode { node } => write!(f, "node {node} is on the bus and not in the configuration"),
            Self::SecondMaster { id, .. } => {
                write!(f, "another station sends {id}, which only the master may send")
            }
            Self::OtherMaster(other) => write!(f, "{other}"),
            Self::GaveWay => {
                f.write_str("nothing is sent until the other master has been silent for a while")
            }
            Self::BusOff => f.write_str("the controller is off the bus"),
            Self::BusOn => f.write_str("the controller is back on the bus"),
            Self::TransmitFailed { id } => write!(f, "frame {id} could not be sent"),
            Self::Sdo { outcome, .. } => write!(f, "{outcome}"),
        }
    }
}

/// Why a frame was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// A remote frame.
    Remote,
    /// A frame that is not for the master.
    NotOurs,
    /// A device that is not in the list.
    UnknownNode,
    /// The frame has a wrong length or content for what it is.
    Malformed,
    /// An answer to no request.
    Unexpected,
    /// A PDO of a device that is not in operation.
    NotOperational,
    /// A frame that only the master may send.
    SecondMaster,
}

impl Refusal {
    /// All reasons.
    pub const ALL: [Self; 7] = [
        Self::Remote,
        Self::NotOurs,
        Self::UnknownNode,
        Self::Malformed,
        Self::Unexpected,
        Self::NotOperational,
        Self::SecondMaster,
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Remote => "remote frame",
            Self::NotOurs => "not for the master",
            Self::UnknownNode => "device that is not in the list",
            Self::Malformed => "wrong length or content",
            Self::Unexpected => "answer to no request",
            Self::NotOperational => "PDO of a device that is not in operation",
            Self::SecondMaster => "frame that only the master may send",
        })
    }
}

/// Counters since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Frames taken.
    pub accepted: u64,
    /// Frames not taken, in the order of [`Refusal::ALL`].
    pub refused: [u64; Refusal::ALL.len()],
    /// SYNCs sent.
    pub syncs: u64,
    /// SYNCs left out because the caller came too late.
    pub syncs_skipped: u64,
    /// TPDOs that were due and did not come.
    pub pdos_missed: u64,
    /// TPDOs that came after the synchronous window.
    pub pdos_late: u64,
    /// Frames that could not be sent.
    pub transmit_failures: u64,
    /// EMCYs that were not told one by one.
    pub emcys_suppressed: u64,
    /// Events for which there was no room.
    pub events_lost: u64,
}

impl Statistics {
    /// Frames refused for this reason.
    #[must_use]
    pub fn refused(&self, reason: Refusal) -> u64 {
        self.refused[reason as usize]
    }

    pub(super) fn count(&mut self, reason: Refusal) {
        self.refused[reason as usize] += 1;
    }
}
