//! Faults of a device whose updates do not say which: the fixed connection format has one bit of Node Status for a fault
//! of the node, and the Axis State for one of the axis. Which one it is stands in attributes, which are read when
//! something has changed.

use super::event::AttributeValue;
use super::failure::Failure;
use super::services::{Outcome, Room, Services, Ticket};
use crate::wire::motion::FaultRecord;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{AxisStateCode, FaultType, NodeFault, NodeStatus};
use crate::wire::motion::fixed::FixedActual;

/// Class attribute.
const NODE_FAULT_CODE: u16 = 16;
/// Attributes of the newest record of the fault log, and their lengths.
const AXIS_FAULT_CODE: u16 = 661;
const AXIS_FAULT_TYPE: u16 = 662;
const AXIS_FAULT_TIME_STAMP: u16 = 663;
const AXIS_FAULT_SUB_CODE: u16 = 666;
const AXIS_FAULT_ACTION: u16 = 668;
const RECORD: [(u16, u8); 5] = [
    (AXIS_FAULT_TYPE, 1),
    (AXIS_FAULT_CODE, 1),
    (AXIS_FAULT_SUB_CODE, 1),
    (AXIS_FAULT_ACTION, 1),
    (AXIS_FAULT_TIME_STAMP, 8),
];

/// Updates after which the record of an axis that stands for a fault is read again: a device may report at first only that its
/// drive has one, and a moment later which.
const READ_AGAIN: u16 = 16;

/// One thing to be read.
#[derive(Debug, Default)]
struct Reading {
    wanted: bool,
    ticket: Option<Ticket>,
}

impl Reading {
    const fn is_busy(&self) -> bool {
        self.wanted || self.ticket.is_some()
    }

    /// Asks if something is wanted and nothing is asked; gives what has come.
    fn poll(
        &mut self,
        instance: u8,
        attributes: &[(u16, u8)],
        services: &mut Services,
        room: Room,
    ) -> Result<Option<Vec<AttributeValue>>, Failure> {
        if self.ticket.is_none() && core::mem::take(&mut self.wanted) {
            let selectors: Vec<_> =
                attributes.iter().map(|(id, size)| AttributeSelector::scalar(*id, *size)).collect();
            self.ticket = Some(services.get(instance, &selectors, room)?);
        }
        let Some(result) = self.ticket.and_then(|ticket| services.take(ticket)) else { return Ok(None) };
        self.ticket = None;
        match result? {
            Outcome::Get { values } => Ok(Some(values)),
            _ => Ok(None),
        }
    }
}

/// What was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FaultRead {
    /// The fault of the node, and whether it has gone since.
    Node {
        fault: NodeFault,
        over: bool,
    },
    Axis(FaultRecord),
}

/// Reads faults of the node and of the one axis.
#[derive(Debug, Default)]
pub(super) struct FaultReader {
    node: Reading,
    axis: Reading,
    faulted: bool,
    state: AxisStateCode,
    /// Updates since the axis' record was read.
    updates: u16,
    /// The axis' record that was reported last in this trouble; what is read after it need not be new.
    told: Option<FaultRecord>,
}

/// States that an axis is in for a fault.
fn is_troubled(state: AxisStateCode) -> bool {
    [AxisStateCode::ABORTING, AxisStateCode::MAJOR_FAULTED].contains(&state)
}

impl FaultReader {
    /// Whether a fault is there or may be there of which nobody knows yet which one it is.
    pub const fn is_busy(&self) -> bool {
        self.node.is_busy() || self.axis.is_busy() && self.told.is_none()
    }

    /// What was asked is not answered any more; it is asked again.
    pub fn restart(&mut self) {
        for reading in [&mut self.node, &mut self.axis] {
            reading.wanted |= reading.ticket.take().is_some();
        }
    }

    /// Takes what an update says. Only with the device's Data Valid does it have an axis state.
    pub fn handle(&mut self, actual: &FixedActual) {
        let faulted = actual.node_status.contains(NodeStatus::FAULT);
        self.node.wanted |= faulted && !self.faulted;
        self.faulted = faulted;
        if actual.node_status.contains(NodeStatus::DATA_VALID) {
            let (before, after) = (self.state, actual.axis_state);
            // The record of the clearing event follows the one of the fault.
            let changed = before != after && (is_troubled(before) || is_troubled(after));
            if changed {
                self.told = None;
            }
            let again = is_troubled(after) && self.updates >= READ_AGAIN && !self.axis.is_busy();
            self.updates = if again { 0 } else { self.updates.saturating_add(1) };
            self.axis.wanted |= changed || again;
            self.state = after;
        }
    }

    /// Reads what is to be read; gives what has come of it.
    ///
    /// # Errors
    /// The device does not answer, or has no such attributes.
    pub fn poll(&mut self, services: &mut Services, room: Room) -> Result<Option<FaultRead>, Failure> {
        if let Some(values) = self.node.poll(0, &[(NODE_FAULT_CODE, 1)], services, room)? {
            let fault = NodeFault(octet(&values, 0, NODE_FAULT_CODE)?);
            if self.faulted && fault == NodeFault::NONE {
                // A fault that the device does not name is still one.
                return Err(Failure::NodeFault(fault));
            }
            return Ok(Some(FaultRead::Node { fault, over: !self.faulted }));
        }
        let Some(values) = self.axis.poll(1, &RECORD, services, room)? else { return Ok(None) };
        let stamp = value(&values, AXIS_FAULT_TIME_STAMP).and_then(|bytes| bytes.try_into().ok());
        let record = FaultRecord {
            fault_type: FaultType(octet(&values, 1, AXIS_FAULT_TYPE)?),
            code: octet(&values, 1, AXIS_FAULT_CODE)?,
            // A device may do without these.
            sub_code: octet(&values, 1, AXIS_FAULT_SUB_CODE).unwrap_or(0),
            action: octet(&values, 1, AXIS_FAULT_ACTION).unwrap_or(0),
            time_stamp: stamp.map_or(0, u64::from_le_bytes),
        };
        let known = self.told.replace(record) == Some(record);
        Ok((!known).then_some(FaultRead::Axis(record)))
    }
}

fn value(values: &[AttributeValue], id: u16) -> Option<&[u8]> {
    values.iter().find(|row| row.id == id).and_then(|row| row.value.as_deref().ok())
}

/// A value of one byte; without it nobody knows what is wrong.
fn octet(values: &[AttributeValue], instance: u8, id: u16) -> Result<u8, Failure> {
    match values.iter().find(|row| row.id == id).map(|row| &row.value) {
        Some(Ok(bytes)) if bytes.len() == 1 => Ok(bytes[0]),
        Some(Err(status)) => Err(Failure::AttributeRefused { instance, attribute: id, status: *status }),
        _ => Err(Failure::AttributeMissing { instance, attribute: id }),
    }
}
