//! What the master tells its caller.

use core::fmt;

use arrayvec::ArrayVec;

use super::connection::ConsumerState;
use super::foreign::OtherMaster;
pub use super::hot_plug::refusal::HotPlugRefusal;
use super::layout::LayoutError;
use super::svc::request::{SvcFailure, SvcOutcome};
use super::topology::Topology;
pub use crate::port::Port;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, Phase};
use crate::wire::idn::Idn;

/// A slave by its position on the network, counted from 0 in the order of the line. It stays the same until the
/// next scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlaveId(pub u16);

impl SlaveId {
    /// Topology address, 1..=511.
    #[must_use]
    pub const fn topology_address(self) -> u16 {
        self.0 + 1
    }

    pub(crate) fn index(self) -> usize {
        usize::from(self.0)
    }

    pub(crate) fn from_index(index: usize) -> SlaveId {
        SlaveId(u16::try_from(index).unwrap_or(u16::MAX))
    }
}

impl fmt::Display for SlaveId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "slave at position {}", self.topology_address())
    }
}

/// One end of a cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum End {
    /// A port of the master.
    Master(Port),
    /// A slave.
    Slave {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
    },
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            End::Master(port) => write!(f, "the master's {port}"),
            End::Slave { address, .. } => write!(f, "the slave with address {address}"),
        }
    }
}

/// Names one submitted service channel request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ticket {
    /// Place of the slave in the line.
    pub slave: SlaveId,
    /// Place in the slave's queue.
    pub(crate) place: usize,
    /// Serial number at the slave.
    pub(crate) serial: u64,
}

/// Parameters that are told with [`Event::CheckFailed`]; of more the number is told.
const INVALID_TOLD: usize = 8;

/// What a slave finds wrong when a phase is to be left.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Invalid {
    /// The first parameters of its list.
    idns: ArrayVec<Idn, INVALID_TOLD>,
    /// How many there are.
    count: usize,
}

impl FromIterator<Idn> for Invalid {
    fn from_iter<T: IntoIterator<Item = Idn>>(list: T) -> Self {
        let mut invalid = Self::default();
        for idn in list {
            invalid.count += 1;
            // Of those without room the number is told.
            let _ = invalid.idns.try_push(idn);
        }
        invalid
    }
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.idns.is_empty() {
            return f.write_str("the slave does not report which parameter is invalid");
        }
        f.write_str("the slave reports as invalid")?;
        for (place, idn) in self.idns.iter().enumerate() {
            write!(f, "{} {idn}", if place > 0 { "," } else { "" })?;
        }
        match self.count - self.idns.len() {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "events are taken one by one; only a few are kept")]
pub enum Event {
    /// The telegrams of this phase have started; CP4: all slaves are valid in it.
    Phase(Phase),
    /// No more SERCOS telegrams are sent.
    Stopped,
    /// Another master sends on the wire. Before the first telegram, and below CP4, this one waits until he is silent; in CP4 the
    /// application stops what it leads and calls `give_way`.
    OtherMaster(OtherMaster),
    /// No more SERCOS telegrams are sent, because of another master. They begin again when he is silent.
    GaveWay,
    /// CP0: topology and address list are stable.
    Scanned {
        /// Slaves found.
        slaves: u16,
    },
    /// CP0: no telegram comes back, or nobody is there. Where the link is up, a station does not pass telegrams on: C-DEV, by
    /// which it could be found, exists from CP1 on.
    NoSlaves,
    /// CP0: topology or address list do not become stable.
    ScanUnstable,
    /// CP0: more slaves than there is storage for. No higher phase is entered.
    TooManySlaves {
        /// Slaves found.
        found: u16,
        /// Slaves that fit.
        max: u16,
    },
    /// A configured slave was not found.
    Missing {
        /// Its SERCOS address.
        address: u16,
    },
    /// A slave was found which is not configured. It takes part without connections.
    Unknown {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address, 0 when none is set.
        address: u16,
    },
    /// Two slaves have the same SERCOS address. CP2 is possible, CP3 is not.
    DoubleAddress {
        /// SERCOS address that both have.
        address: u16,
        /// The slave nearer to the master.
        first: SlaveId,
        /// The other one.
        second: SlaveId,
    },
    /// The slave has no SERCOS address, or shares it. CP3 was refused.
    AddressConflict {
        /// Place of the slave in the line.
        slave: SlaveId,
    },
    /// The slave was given another SERCOS address by S-0-1040. It takes part without connections.
    AddressAssigned {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// The address before, 0 for none.
        old: u16,
        /// The new address.
        new: u16,
    },
    /// The application may work and then call `proceed`.
    AwaitingApplication {
        /// CP2 or CP3.
        phase: Phase,
    },
    /// A step of the phase-up failed at a slave.
    StepFailed {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// The parameter.
        idn: Idn,
        /// Why.
        failure: SvcFailure,
    },
    /// The slave's SCP classes leave open how its connections are configured: it needs exactly one of SCP_FixCFG
    /// and SCP_VarCFG.
    ClassMismatch {
        /// Place of the slave in the line.
        slave: SlaveId,
    },
    /// The slave does not have this connection: S-0-1051, or its fixed configuration.
    NoConnection {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// The configured connection.
        instance: u8,
        /// Connections which the slave has, numbered from 0.
        available: u16,
    },
    /// S-0-0127 or S-0-0128 failed.
    CheckFailed {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// The phase that cannot be left: CP2 or CP3.
        phase: Phase,
        /// What the slave finds wrong: S-0-0021 or S-0-0022.
        invalid: Invalid,
    },
    /// The slave has been checked for CP3 and takes no part any more. It would write where it was told to, over what
    /// others have there in a new layout: the master goes back to CP0.
    Stale {
        /// Place of the slave in the line.
        slave: SlaveId,
    },
    /// The telegrams of CP3 and CP4 cannot be laid out.
    LayoutRefused(LayoutError),
    /// No slave is left that could take part in CP3: back to CP0.
    NobodyLeft,
    /// Slaves did not stop or start within the time of a phase switch.
    SwitchFailed {
        /// The phase left.
        from: Phase,
        /// The phase wanted.
        to: Phase,
        /// The first slave that kept on inserting data; `None` in CP0.
        slave: Option<SlaveId>,
    },
    /// What a slave says about errors and warnings in S-DEV has changed: bits 15, 9, 7, 6 and 4.
    DeviceStatus {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Those bits, the others 0.
        status: DeviceStatus,
    },
    /// The topology is another one; with two ports also after each scan.
    Topology(Topology),
    /// A slave at the end of a cable has no link any more and turns the telegrams round: the cable is cut, or what
    /// it leads to is off.
    CableOpen {
        /// The end nearer to port 1.
        low: End,
        /// The end nearer to port 2.
        high: End,
    },
    /// Nothing came back any more though no slave had lost a link. The slaves were asked one after the other to turn the telegrams
    /// round, and this one does not answer: it passes nothing on. What is in front of it goes on.
    Isolated {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
        /// The master's port from which the telegrams come that end at it.
        port: Port,
        /// Who turns them round in front of it; the master's own port when nobody is in front of it.
        end: End,
    },
    /// The ring was open and is closed again.
    RingClosed,
    /// A slave did not do what closes the ring. It is open as before, and tried again after a while.
    RingNotClosed {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
    },
    /// A slave is not valid any more. It takes no part until it is valid again in CP4, comes in by hot plug, or is found by
    /// the next scan.
    SlaveLost {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
        /// The phase in which it went.
        phase: Phase,
    },
    /// A lost slave is valid again in CP4 and takes part: it had never left.
    SlaveReturned {
        /// Place of the slave in the line.
        slave: SlaveId,
    },
    /// A configured slave was not found, and the telegrams keep its place: it can be plugged in later.
    PlaceKept {
        /// Its SERCOS address.
        address: u16,
    },
    /// A slave is on its way in by hot plug and can be set up: the application may work as in this phase, and then call
    /// `proceed_hot_plug`, or `exclude`.
    HotPlugAwaits {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
        /// CP2, with the write protections of CP2, and then CP3.
        phase: Phase,
    },
    /// A slave has come in by hot plug and takes part from now on.
    HotPlugged {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// Its SERCOS address.
        address: u16,
    },
    /// A slave does not come in by hot plug. The others go on.
    HotPlugRefused {
        /// The SERCOS address which the slave has reported, or which is known from before.
        address: Option<u16>,
        /// Why.
        reason: HotPlugRefusal,
    },
    /// The slaves have measured their delays again, because the way of the telegrams is another one.
    Measured {
        /// Slaves that have.
        slaves: u16,
    },
    /// A slave has not measured its delays once more; it goes on with the old ones.
    MeasureFailed {
        /// Place of the slave in the line.
        slave: SlaveId,
        /// S-0-1015 or S-0-1024.
        idn: Idn,
        /// Why.
        failure: SvcFailure,
    },
    /// Every slave is lost; the master goes back to CP0.
    AllSlavesLost,
    /// A consumer has changed its state.
    Connection {
        /// The producing slave.
        slave: SlaveId,
        /// Connection number at the slave.
        instance: u8,
        /// The new state.
        state: ConsumerState,
    },
    /// A service channel request is finished.
    Svc {
        /// What `svc_submit` gave.
        ticket: Ticket,
        /// What came out.
        outcome: SvcOutcome,
    },
}

impl fmt::Display for Event {
    // Flat: one arm per event.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Phase(phase) => write!(f, "{phase}"),
            Event::Stopped => f.write_str("no SERCOS telegrams any more"),
            Event::OtherMaster(other) => write!(f, "{other}"),
            Event::GaveWay => {
                f.write_str("no SERCOS telegrams any more until the other master has been silent for a while")
            }
            Event::Scanned { slaves } => write!(f, "{slaves} slaves found"),
            Event::NoSlaves => f.write_str(
                "no slave answers; with the link up: a station passes no telegrams on, or it is no SERCOS III slave",
            ),
            Event::ScanUnstable => f.write_str("topology or address list do not become stable"),
            Event::TooManySlaves { found, max } => write!(f, "{found} slaves found, room for {max}"),
            Event::Missing { address } => write!(f, "the slave with address {address} was not found"),
            Event::Topology(topology) => write!(f, "topology: {topology}"),
            Event::CableOpen { low, high } => write!(f, "no connection between {low} and {high}"),
            Event::Isolated { slave, address, port, end: End::Master(_) } => {
                write!(f, "{slave} with address {address} passes no telegrams on: no slave is reached from {port}")
            }
            Event::Isolated { slave, address, port, end } => write!(
                f,
                "{slave} with address {address} passes no telegrams on though its link is up: those from {port} are \
                 turned round in front of it by {end}"
            ),
            Event::RingClosed => f.write_str("the ring is closed again"),
            Event::RingNotClosed { slave, address } => {
                write!(f, "the ring cannot be closed: {slave} (address {address}) does not follow the command")
            }
            Event::Unknown { slave, address } => {
                write!(f, "{slave} with address {address} is not configured")
            }
            Event::DoubleAddress { address, first, second } => {
                write!(f, "{first} and {second} both have address {address}")
            }
            Event::AddressConflict { slave } => write!(f, "{slave} has no address of its own: CP3 refused"),
            Event::AddressAssigned { slave, old, new } => {
                write!(f, "{slave} with address {old} was given address {new}")
            }
            Event::AwaitingApplication { phase } => write!(f, "{phase}: waiting for the application"),
            Event::StepFailed { slave, idn, failure } => write!(f, "{slave}: {idn}: {failure}"),
            Event::ClassMismatch { slave } => {
                write!(f, "{slave}: exactly one of SCP_FixCFG and SCP_VarCFG is needed")
            }
            Event::NoConnection { slave, instance, available } => {
                write!(f, "{slave} has {available} connections, connection {instance} is not one of them")
            }
            Event::CheckFailed { slave, phase, invalid } => {
                write!(f, "{slave}: the check to leave {phase} failed: {invalid}")
            }
            Event::Stale { slave } => {
                write!(f, "{slave} was left out after its check for CP3: back to CP0")
            }
            Event::LayoutRefused(error) => write!(f, "telegrams of CP3 and CP4: {error}"),
            Event::NobodyLeft => f.write_str("no slave is left that can be used: back to CP0"),
            Event::SwitchFailed { from, to, slave: Some(slave) } => {
                write!(f, "{from} to {to}: {slave} did not stop inserting data in time")
            }
            Event::SwitchFailed { from, to, slave: None } => write!(f, "{from} to {to}: not in time"),
            Event::DeviceStatus { slave, status } => match status.condition_names().next() {
                None => write!(f, "{slave}: no error or warning any more"),
                Some(_) => {
                    write!(f, "{slave}:")?;
                    let mut comma = "";
                    status.condition_names().try_for_each(|name| {
                        let comma = core::mem::replace(&mut comma, ",");
                        write!(f, "{comma} {name}")
                    })
                }
            },
            Event::SlaveLost { slave, address, phase } => {
                write!(f, "{slave} with address {address} was lost in {phase}")
            }
            Event::SlaveReturned { slave } => {
                write!(f, "{slave} is valid again and takes part")
            }
            Event::PlaceKept { address } => {
                write!(f, "a place is kept for the slave with address {address}: it can be plugged in later")
            }
            Event::HotPlugAwaits { slave, address, phase } => {
                write!(f, "hot plug: {slave} with address {address} can be set up as in {phase}")
            }
            Event::HotPlugged { slave, address } => {
                write!(f, "hot plug: {slave} with address {address} takes part")
            }
            Event::HotPlugRefused { address: Some(address), reason } => {
                write!(f, "hot plug: the slave with address {address} does not come in: {reason}")
            }
            Event::HotPlugRefused { address: None, reason } => {
                write!(f, "hot plug: no slave comes in: {reason}")
            }
            Event::Measured { slaves } => write!(f, "{slaves} slaves have measured their delays again"),
            Event::MeasureFailed { slave, idn, failure } => {
                write!(f, "{slave} goes on with its old delay: {idn}: {failure}")
            }
            Event::AllSlavesLost => f.write_str("all slaves are lost"),
            Event::Connection { slave, instance, state } => {
                write!(f, "{slave}: connection {instance} is in state {state}")
            }
            Event::Svc { ticket, outcome } => write!(f, "{}: {outcome}", ticket.slave),
        }
    }
}

/// Why a received frame was refused. It changed nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Refusal {
    /// Too short, another EtherType or not a broadcast.
    #[error("not a SERCOS frame")]
    NotSercos,
    /// The header CRC is wrong.
    #[error("wrong header CRC")]
    Crc,
    /// Another master's telegram.
    #[error("telegram of another master")]
    Foreign,
    /// No telegrams are out.
    #[error("no telegram is expected")]
    Silence,
    /// A port or channel on which the topology gives no telegram back.
    #[error("telegram on a port where none is expected")]
    Port,
    /// The telegram number is not used in this phase.
    #[error("telegram number that is not in use")]
    Number,
    /// Phase or CPS are not what was sent.
    #[error("wrong phase")]
    Phase,
    /// The cycle counter is not the one of this cycle: late or replayed.
    #[error("wrong cycle counter")]
    CycleCount,
    /// The data field has another length than was sent.
    #[error("wrong length")]
    Length,
    /// The telegram has come back in this cycle already.
    #[error("telegram came back twice")]
    Duplicate,
}

impl Refusal {
    /// All reasons.
    pub const ALL: [Refusal; 10] = [
        Refusal::NotSercos,
        Refusal::Crc,
        Refusal::Foreign,
        Refusal::Silence,
        Refusal::Port,
        Refusal::Number,
        Refusal::Phase,
        Refusal::CycleCount,
        Refusal::Length,
        Refusal::Duplicate,
    ];
}

/// Counters since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Cycles sent.
    pub cycles: u64,
    /// Cycles left out because `poll` came too late.
    pub skipped: u64,
    /// Frames accepted.
    pub accepted: u64,
    /// Cycles whose ATs, taken together from all ports, did not have the data of every slave.
    pub at_missing: u64,
    /// Cycles in which at least one MDT did not come back on a port where the topology gives it back.
    pub mdt_missing: u64,
    /// Events dropped because nobody took them.
    pub events_lost: u64,
    refused: [u64; Refusal::ALL.len()],
    lost: [[u64; 2]; 2],
}

impl Statistics {
    /// Frames refused for this reason.
    #[must_use]
    pub const fn refused(&self, reason: Refusal) -> u64 {
        self.refused[reason as usize]
    }

    /// Telegrams of this kind that did not come back on this port, where the topology gives them back.
    #[must_use]
    pub const fn lost(&self, port: Port, kind: Kind) -> u64 {
        self.lost[port.index()][kind as usize]
    }

    pub(crate) fn count_lost(&mut self, port: Port, kind: Kind, count: usize) {
        self.lost[port.index()][kind as usize] += u64::try_from(count).unwrap_or(u64::MAX);
    }

    pub(crate) fn count_refusal(&mut self, reason: Refusal) {
        self.refused[reason as usize] += 1;
    }
}

/// What `poll` gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output<'a> {
    /// Send this frame now.
    Transmit {
        /// The port to send it on.
        port: Port,
        /// The whole Ethernet frame without FCS.
        frame: &'a [u8],
    },
}
