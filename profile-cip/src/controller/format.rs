//! What the fixed connection format cannot carry, found before anything is sent: clause 6-2.7.3.
//!
//! | not in the updates | instead |
//! |---|---|
//! | time stamps, time data | asynchronous operation |
//! | Control Status, Command Control | attributes 89 and 92, set by a service |
//! | node fault, fault record of the axis | read by a service when Node Status or Axis State reports one |
//! | node alarm, alarm record, Axis Status, Axis I/O Status | attributes, read by steps |
//! | Lost and Late Updates | class attributes, read by steps |
//! | service channel | the same services as explicit messages |
//! | cyclic lists, events | - |

use super::condition::Condition;
use super::config::{AxisSetup, CONNECTION_SIZE_FIXED, ControllerConfig};
use super::failure::Failure;
use super::misbehaviour::Misbehaviour;
use super::program::Step;
use super::sets::DataSets;
use crate::wire::motion::codes::{ActualDataSet, ControlMode, MotionService};

/// Checks a configuration for the fixed format.
///
/// # Errors
/// What the format has, in place of the first thing that it has not.
pub(super) fn check_fixed(config: &ControllerConfig) -> Result<(), &'static str> {
    let [axis] = config.axes.as_slice() else { return Err("room for one axis") };
    if config.grand_master.is_some() {
        return Err("no time stamps, and so no grand master");
    }
    if config.connection_size != CONNECTION_SIZE_FIXED {
        return Err("a connection size of 18 bytes");
    }
    if axis.unwind.is_some() {
        return Err("no room for an Unwind Cycle Count");
    }
    if axis.feedback_mode.position_is_lint() {
        return Err("Actual Position as DINT only");
    }
    check_sets(axis, &axis.sets)?;
    if axis.control_mode == ControlMode::POSITION && !axis.sets.actual.contains(ActualDataSet::POSITION) {
        return Err("one actual value: in position control it has to be the position");
    }
    Ok(())
}

/// Checks what is to travel of an axis.
fn check_sets(axis: &AxisSetup, sets: &DataSets) -> Result<(), &'static str> {
    if !sets.command.is_empty() {
        return Err("room for one command value, which is that of the control mode");
    }
    if !sets.integer_position {
        return Err("Command Position as DINT only");
    }
    if !sets.status.is_empty() {
        return Err("no status data");
    }
    if sets.actual != ActualDataSet::POSITION && sets.actual != ActualDataSet::VELOCITY {
        return Err("room for one actual value: the position or the velocity, so that the axis is seen");
    }
    if axis.limits.position.is_some() && sets.actual != ActualDataSet::POSITION {
        return Err("one actual value: with position limits it has to be the position");
    }
    Ok(())
}

/// Checks a step on a connection of the fixed format.
///
/// # Errors
/// [`Failure::NotInFormat`] with what the format has not.
pub(super) fn check_step(step: &Step, config: &ControllerConfig) -> Result<(), Failure> {
    let lacks = |what| Err(Failure::NotInFormat { what });
    match step {
        Step::CyclicList { .. } | Step::CyclicWrite { .. } => lacks("no cyclic write and read data"),
        Step::ArmEvents { .. } | Step::DisarmEvents { .. } => lacks("no events"),
        Step::TimeData(_) => lacks("no time data"),
        Step::Service { service: MotionService::GROUP_SYNC, .. } => lacks("no time synchronization"),
        Step::Feedback { mode, .. } if mode.position_is_lint() => lacks("Actual Position as DINT only"),
        Step::DataSets { axis, sets } => match config.axes.get(usize::from(*axis).wrapping_sub(1)) {
            Some(setup) => check_sets(setup, sets).map_err(|what| Failure::NotInFormat { what }),
            None => Ok(()),
        },
        Step::Misbehave(Misbehaviour::StaleTimeStamp { .. }) => lacks("no time stamps"),
        Step::Expect { condition, .. } => check_condition(condition),
        _ => Ok(()),
    }
}

fn check_condition(condition: &Condition) -> Result<(), Failure> {
    let what = match condition {
        Condition::Status { .. } | Condition::IoStatus { .. } => {
            "no status data; expect Axis Status (651) or Axis I/O Status (653) as an attribute"
        }
        Condition::Alarm { .. } => "no alarm records; expect Axis Alarms (659) as an attribute",
        Condition::NodeAlarm(_) => "no node alarms; expect Node Alarm Code (17) as an attribute of the class",
        Condition::LostUpdates(_) => {
            "no diagnostics; expect Lost Controller Updates as an attribute of the class"
        }
        Condition::LateUpdates(_) => {
            "no diagnostics; expect Late Controller Updates as an attribute of the class"
        }
        Condition::Event { .. } => "no events",
        Condition::Synchronous(true) => "no time synchronization",
        Condition::CyclicRead { .. } | Condition::CyclicWriteStatus { .. } => "no cyclic write and read data",
        _ => return Ok(()),
    };
    Err(Failure::NotInFormat { what })
}
