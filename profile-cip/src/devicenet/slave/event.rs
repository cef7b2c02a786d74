//! What a slave tells its caller.

use core::fmt;

use super::super::connection::{Change, ConnectionKind};
use super::super::link::Refusal;
use super::super::wire::{AllocationChoice, MacId};
use crate::device::event::ResetKind;

/// Something that happened to a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlaveEvent {
    /// The duplicate MAC ID check is over, and nobody else has the MAC ID.
    Online,
    /// Another node has this node's MAC ID. The node is off the network until it is reset.
    DuplicateMac {
        /// The MAC ID.
        mac: MacId,
        /// Vendor ID of the other node.
        vendor: u16,
        /// Its serial number.
        serial: u32,
    },
    /// The CAN controller has left the bus; what became of the node is told by its state.
    BusOff,
    /// A master has taken connections.
    Allocated {
        /// MAC ID of the master.
        master: MacId,
        /// Which ones.
        choice: AllocationChoice,
    },
    /// The master has given connections back.
    Released(AllocationChoice),
    /// No connection is left that could ever carry a message: the slave is free for any master.
    Freed,
    /// The state of a connection has changed.
    Connection(ConnectionKind, Change),
    /// A frame was not used.
    Refused(Refusal),
    /// What was produced by change of state was sent twice and not acknowledged.
    NoAcknowledge,
    /// A response could not be carried over.
    ResponseLost,
    /// The Identity object was reset; the node starts anew.
    Reset(ResetKind),
    /// The MAC ID was set; the node starts anew with it.
    MacChanged(MacId),
    /// The data rate was set (0 125, 1 250, 2 500 kbit/s); it counts from the next start.
    RateChanged(u8),
}

impl fmt::Display for SlaveEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Online => f.write_str("on line"),
            Self::DuplicateMac { mac, vendor, serial } => {
                write!(f, "{}", Refusal::DuplicateMac { mac: *mac, vendor: *vendor, serial: *serial })
            }
            Self::BusOff => f.write_str("bus off"),
            Self::Allocated { master, choice } => write!(f, "allocated by MAC ID {master}: {choice}"),
            Self::Released(choice) => write!(f, "released: {choice}"),
            Self::Freed => f.write_str("free for any master"),
            Self::Connection(kind, change) => write!(f, "{kind}: {} -> {}", change.before, change.after),
            Self::Refused(refusal) => write!(f, "frame refused: {refusal}"),
            Self::NoAcknowledge => f.write_str("change of state: not acknowledged"),
            Self::ResponseLost => f.write_str("explicit response lost"),
            Self::Reset(kind) => write!(f, "reset: {kind:?}"),
            Self::MacChanged(mac) => write!(f, "MAC ID set to {mac}"),
            Self::RateChanged(rate) => write!(f, "data rate set to {rate}"),
        }
    }
}
