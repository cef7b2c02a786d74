//! What the motion device has to show: from its connection and its axes to the conditions of
//! [`crate::device::visualization`].

use super::engine::Engine;
use crate::device::axis::Axis;
use crate::device::axis::state::AxisState;
use crate::device::visualization::AxisCondition;
use crate::device::visualization::display::Startup;
use crate::wire::motion::codes::{AlarmType, FaultType};

/// How far the controller has come since it opened the connection.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StartupProgress {
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

/// How far the start of the device has come.
pub(super) fn startup(engine: &Engine) -> Startup {
    let mut states = engine.instances.slots.iter().map(|slot| slot.axis.state());
    if engine.connection.is_none() {
        Startup::Standby
    } else if !engine.progress.attribute_set && states.clone().all(|state| state == AxisState::Initializing) {
        Startup::Connecting
    } else if states.any(|state| state == AxisState::Initializing) {
        Startup::Configuring
    } else if engine.config.supports_sync && !engine.progress.group_synced {
        Startup::Syncing
    } else {
        Startup::Complete
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

/// An axis as it shows.
pub(super) fn condition(axis: &Axis) -> AxisCondition {
    let words = axis.fault_words();
    let faults = if axis.faults.any() { &FAULTS[..] } else { &[] };
    let alarm = |types: [AlarmType; 2]| {
        types.into_iter().find_map(|one| lowest_bit(words.alarm(one)).map(|code| (one, code)))
    };
    AxisCondition {
        kind: axis.kind(),
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
