//! What an axis tells: the command image for its drive and the cyclic actual block for the controller.

use profile_generic::time::MonotonicTime;

use super::RAMP_AND_DISABLE;
use super::drive_link::{
    AbortCause, AbortOrder, AxisCommandImage, Command, DriveAction, SetPoints, Withheld,
};
use super::state::{AxisState, ControlKind};
use super::status::allowed;
use crate::device::axis::{Axis, Context};
use crate::wire::motion::codes::{ActualDataSet, AxisControl, AxisStatus, ControlMode, StatusDataSet};
use crate::wire::motion::{ActualBlock, ActualValues, StatusValues};

/// Captures further apart than this are not of one update: longer than a drive is silent on the slowest bus (a cycle of 65 ms)
/// before it counts as lost.
const CORRECTION_MAX_NS: u64 = 1_000_000_000;

/// Updates that should have come within `elapsed` ns since the last one and have not. An update counts as missed when
/// it is half a period overdue, so that jitter of the network makes no difference.
pub(crate) fn missed_updates(elapsed: u64, period: u64) -> u64 {
    let period = period.max(1);
    elapsed.saturating_sub(period / 2) / period
}

/// What the drive has to do at `now`. `period_ns` and `limit` judge the age of the set-points.
pub(super) fn command(
    axis: &Axis,
    now: MonotonicTime,
    context: &Context,
    period_ns: u64,
    limit: u32,
) -> AxisCommandImage {
    let command = match axis.command.held {
        _ if !context.connected && axis.machine.state == AxisState::Initializing => {
            Command::Withheld(Withheld::NotConnected)
        }
        _ if !context.connected => Command::Withheld(Withheld::ConnectionLost),
        _ if context.node_fault => Command::Withheld(Withheld::NodeFault),
        _ if !context.remote => Command::Withheld(Withheld::LocalControl),
        _ if axis.machine.state != AxisState::Running || axis.machine.kind != ControlKind::Active => {
            Command::Withheld(Withheld::NotRunning)
        }
        None => Command::Withheld(Withheld::NoSetPoint),
        Some(held) => {
            let age = missed_updates(now.0.saturating_sub(held.at.0), period_ns);
            let age_updates = u32::try_from(age).unwrap_or(u32::MAX);
            if age_updates > limit {
                Command::Withheld(Withheld::Stale)
            } else {
                let position_reference = axis.references.command();
                Command::Follow(SetPoints { age_updates, position_reference, ..held.set_points })
            }
        }
    };
    let unled = (!context.connected || context.node_fault)
        .then_some(AbortOrder { action: RAMP_AND_DISABLE, cause: AbortCause::Node });
    let abort = axis.faults.order().or(unled).filter(|_| axis.orders.action == DriveAction::Abort);
    AxisCommandImage {
        state: axis.machine.state,
        action: axis.orders.action,
        action_id: axis.orders.action_id,
        reset_id: axis.orders.reset_id,
        abort,
        command,
        test: axis.test.order().filter(|_| context.connected && context.remote && !context.node_fault),
    }
}

/// Axis Status, attribute 651: the drive's bits, completed and masked by Table 5-2.61.
pub(super) fn status(axis: &Axis, context: &Context) -> AxisStatus {
    let mode = axis.command.block.control_mode.0 & 0x0F;
    let powered = axis.drive.power_enabled;
    let mut status = axis.drive.axis_status;
    status.set(AxisStatus::LOCAL_CONTROL, !context.remote);
    status.set(AxisStatus::ALARM, axis.faults.any_axis_alarm());
    status.set(AxisStatus::DC_BUS_UP, is_bus_up(axis));
    status.set(AxisStatus::POWER_STRUCTURE_ENABLED, powered);
    status.set(AxisStatus::TRACKING_COMMAND, axis.answers() && axis.drive.tracking);
    let has_feedback = axis.config.kind != ControlKind::Converter;
    let doubted = axis.faults.any_of_feedback(&axis.drive);
    status.set(AxisStatus::FEEDBACK_INTEGRITY, has_feedback && !doubted);
    status.set(AxisStatus::SHUTDOWN, axis.machine.shutdown);
    status.set(AxisStatus::IN_PROCESS, axis.test.is_in_process());
    status.set(AxisStatus::POSITION_CONTROL_MODE, powered && mode == ControlMode::POSITION.0);
    status.set(AxisStatus::VELOCITY_CONTROL_MODE, powered && mode == ControlMode::VELOCITY.0);
    status.set(AxisStatus::TORQUE_CONTROL_MODE, powered && mode == ControlMode::TORQUE.0);
    if !axis.drive.online {
        // Nobody sees the axis: nothing is said about how it moves.
        status &= AxisStatus::LOCAL_CONTROL
            | AxisStatus::ALARM
            | AxisStatus::DC_BUS_UP
            | AxisStatus::POWER_STRUCTURE_ENABLED
            | AxisStatus::SHUTDOWN;
    }
    status & allowed(axis.machine.kind, axis.machine.state, powered)
}

/// Whether the DC bus is charged. The condition of the state machine says so, except that a fault or a shutdown of the drive ends it and
/// leaves the bus as it is (Table 5-2.60).
fn is_bus_up(axis: &Axis) -> bool {
    let is_over =
        matches!(axis.machine.state, AxisState::Aborting | AxisState::MajorFaulted | AxisState::Shutdown);
    axis.drive.bus_up || is_over && axis.drive.axis_status.contains(AxisStatus::DC_BUS_UP)
}

/// The cyclic actual block of D-to-C update `update_id`, whose time stamp is `stamp`, system time in ns; `None` for an
/// update without one.
pub(super) fn actual_block(
    axis: &mut Axis,
    update_id: u8,
    stamp: Option<u64>,
    context: &Context,
) -> ActualBlock {
    let (axis_response, response_status) = axis.requests.handshake.response();
    let lint = axis.config.lint_position && axis.command.block.feedback_mode.position_is_lint();
    ActualBlock {
        control_mode: axis.command.block.control_mode,
        feedback_mode: axis.command.block.feedback_mode.with_lint(lint),
        axis_response,
        response_status,
        axis_state: axis.machine.state.code(),
        actual: actual_values(axis, lint, stamp),
        status: status_values(axis, update_id, context),
    }
}

/// The actual values that the controller asks for and this axis has. A bit for which there is no value is clear in the
/// answer, so that nobody takes a zero for a measurement: everything of a converter, what the drive does not report, and
/// the Unwind Cycle Count where nothing is unwound. Of a drive that is not online only the position remains, the last
/// one that it has reported: state and faults of the axis say that it is not measured any more.
fn actual_values(axis: &Axis, lint: bool, stamp: Option<u64>) -> ActualValues {
    let asked = axis.command.block.actual_data_set;
    if axis.machine.kind == ControlKind::Converter {
        return ActualValues::default();
    }
    let position = stamp.map_or(axis.drive.position, |stamp| position_at(axis, stamp));
    let seen = axis.references.see(position, axis.drive.unwind);
    let has = |bit| asked.contains(bit);
    let measured = |bit| has(bit) && axis.drive.online;
    ActualValues {
        position: has(ActualDataSet::POSITION).then(|| seen.value(lint)),
        velocity: axis.drive.velocity.filter(|_| measured(ActualDataSet::VELOCITY)),
        acceleration: axis.drive.acceleration.filter(|_| measured(ActualDataSet::ACCELERATION)),
        unwind_count: seen.unwind_count().filter(|_| has(ActualDataSet::UNWIND_COUNT)),
        position_displacement: has(ActualDataSet::POSITION_DISPLACEMENT).then(|| displacement(axis)),
    }
}

/// When the actual values were captured, system time in ns; `None` while the drive measures nothing or does not say
/// when.
pub(super) fn captured_at(axis: &Axis) -> Option<u64> {
    Some(axis.drive.captured_at).filter(|at| axis.drive.online && *at != 0)
}

/// The actual position at the instant of a time stamp: where the drive was when it was captured, and on from there at
/// the velocity it had. An update has one time stamp for all of its instances, but drives of different buses, or one
/// whose last telegram is missing, were captured at different instants.
fn position_at(axis: &Axis, stamp: u64) -> i64 {
    const SECOND: i128 = 1_000_000_000;
    let position = axis.drive.position;
    let Some(captured_at) = captured_at(axis).filter(|at| at.abs_diff(stamp) <= CORRECTION_MAX_NS) else {
        return position;
    };
    let span = i128::from(stamp) - i128::from(captured_at);
    let way = i128::from(axis.drive.position_rate) * span;
    let way = (way + way.signum() * SECOND / 2) / SECOND;
    i64::try_from(way).map_or(position, |way| position.saturating_add(way))
}

fn status_values(axis: &mut Axis, update_id: u8, context: &Context) -> StatusValues {
    let asked = axis.command.block.status_data_set;
    let mut values = StatusValues::default();
    if asked.contains(StatusDataSet::FAULT) {
        values.fault = axis.faults.fault_records.due(update_id);
    }
    if asked.contains(StatusDataSet::ALARM) {
        values.alarm = axis.faults.alarm_records.due(update_id);
    }
    if asked.contains(StatusDataSet::AXIS_STATUS) {
        let status = (status(axis, context), axis.drive.axis_status_mfg);
        values.axis_status = axis.reported.axis_status.due(status, update_id);
    }
    if asked.contains(StatusDataSet::IO_STATUS) {
        values.io_status =
            axis.reported.io_status.due((axis.drive.io_status, axis.drive.io_status_mfg), update_id);
    }
    if asked.contains(StatusDataSet::SAFETY_STATUS)
        && let Some(safety) = axis.drive.safety
    {
        values.safety = axis.reported.safety.due(safety, update_id);
    }
    values
}

/// Position Displacement of the next update: that of the change which is being acknowledged.
fn displacement(axis: &Axis) -> i32 {
    let acknowledged = axis.requests.handshake.response() == (AxisControl::CHANGE_ACTUAL_POSITION, 0);
    if acknowledged { axis.references.displacement() } else { 0 }
}
