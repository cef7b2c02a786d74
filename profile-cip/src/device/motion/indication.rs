//! What the motion device has to show: from its connection and its axes to the conditions of
//! [`crate::device::visualization`].

use super::device::{MotionDevice, Slot};
use crate::device::axis::Axis;
use crate::device::axis::state::AxisState;
use crate::device::objects::identity::ModuleState;
use crate::device::visualization::display::{self, Line, NodeCondition, Startup};
use crate::device::visualization::{self, AxisCondition, Indication};
use crate::wire::motion::codes::{AlarmType, FaultType};

/// How far the controller has come since it opened the connection.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::device) struct StartupProgress {
    /// A Set of attributes has come.
    pub attribute_set: bool,
    /// A Group_Sync has succeeded.
    pub group_synced: bool,
    /// The connection was lost, and there has been none since.
    pub connection_lost: bool,
}

/// The faults in the order in which they are told: what keeps the device from working at all, what endangers people,
/// then the others. A code is the number of the lowest bit that is set.
const FAULTS: [FaultType; 8] = [
    FaultType::INITIALIZATION,
    FaultType::INITIALIZATION_MFG,
    FaultType::SAFETY,
    FaultType::SAFETY_MFG,
    FaultType::AXIS,
    FaultType::AXIS_MFG,
    FaultType::APR,
    FaultType::APR_MFG,
];

fn lowest_bit(word: u64) -> Option<u8> {
    (word != 0).then(|| u8::try_from(word.trailing_zeros()).unwrap_or(u8::MAX))
}

impl MotionDevice {
    /// The node as it shows.
    #[must_use]
    pub fn node_condition(&self) -> NodeCondition {
        NodeCondition { startup: self.startup(), fault: self.node_fault(), alarm: self.node_alarm() }
    }

    fn startup(&self) -> Startup {
        let initializing = |slot: &Slot| slot.axis.state() == AxisState::Initializing;
        if self.connection.is_none() {
            Startup::Standby
        } else if !self.progress.attribute_set && self.slots.iter().all(initializing) {
            Startup::Connecting
        } else if self.slots.iter().any(initializing) {
            Startup::Configuring
        } else if self.config.supports_sync && !self.progress.group_synced {
            Startup::Syncing
        } else {
            Startup::Complete
        }
    }

    /// An axis as it shows, or `None` if there is no such axis.
    #[must_use]
    pub fn axis_condition(&self, axis: usize) -> Option<AxisCondition> {
        self.slots.get(axis).map(condition)
    }

    /// State of the device as the Identity object and the Module Status LED have it.
    #[must_use]
    pub fn module_state(&self) -> ModuleState {
        let mut axes = arrayvec::ArrayVec::<AxisCondition, { super::device::AXES_MAX }>::new();
        axes.extend(self.slots.iter().map(condition));
        visualization::module_state(axes.iter())
    }

    /// The Axis Status LED of an axis; dark without such an axis.
    #[must_use]
    pub fn axis_indication(&self, axis: usize) -> Indication {
        self.axis_condition(axis).map_or(Indication::OFF, |axis| visualization::axis_status(&axis))
    }

    /// The line of the display for an axis; empty without such an axis.
    #[must_use]
    pub fn display_line(&self, axis: usize) -> Line {
        self.axis_condition(axis).map_or(Line::default(), |axis| display::line(&self.node_condition(), &axis))
    }

    /// Whether the motion connection was lost and nobody has opened it since.
    #[must_use]
    pub fn is_connection_lost(&self) -> bool {
        self.progress.connection_lost
    }
}

/// While the axis is Initializing nothing is latched, but a drive that has switched itself off for a fault is no drive in
/// standby.
fn standing_fault(axis: &Axis) -> Option<(FaultType, u8)> {
    let conditions = axis.drive().conditions.as_slice();
    let initializing = axis.state() == AxisState::Initializing;
    let standing = conditions.iter().find(|condition| initializing && condition.stops());
    standing.map(|condition| (condition.fault_type, condition.code))
}

fn condition(slot: &Slot) -> AxisCondition {
    let axis = &slot.axis;
    let words = axis.fault_words();
    let faults = if axis.faults.any() { &FAULTS[..] } else { &[] };
    let alarm = |types: [AlarmType; 2]| {
        types.into_iter().find_map(|one| lowest_bit(words.alarm(one)).map(|code| (one, code)))
    };
    AxisCondition {
        kind: axis.kind,
        state: axis.state(),
        bus_up: axis.drive().bus_up,
        fault: faults
            .iter()
            .find_map(|one| lowest_bit(words.fault(*one)).map(|code| (*one, code)))
            .or_else(|| standing_fault(axis)),
        unrecoverable: axis.faults.any_unrecoverable(),
        // Latched, and it has not taken the axis out of operation.
        minor_fault: axis.faults.any() && !axis.faults.any_major(),
        alarm: alarm([AlarmType::AXIS, AlarmType::AXIS_MFG]),
        inhibit: alarm([AlarmType::START_INHIBIT, AlarmType::START_INHIBIT_MFG]),
    }
}
