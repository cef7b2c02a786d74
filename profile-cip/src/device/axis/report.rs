//! What an axis tells: the command image for its drive and the cyclic actual block for the controller.

use profile_generic::time::MonotonicTime;

use super::drive_link::{AbortOrder, AxisCommandImage, Command, DriveAction, SetPoints, Withheld};
use super::state::{AxisState, ControlKind};
use super::status::allowed;
use crate::device::axis::{Axis, Context};
use crate::wire::motion::codes::{ActualDataSet, AxisStatus, ControlMode, StatusDataSet};
use crate::wire::motion::{ActualBlock, ActualValues, StatusValues};

/// Captures further apart than this are not of one update: longer than a drive is silent on the slowest bus (a cycle of 65 ms)
/// before it counts as lost.
const CORRECTION_MAX_NS: u64 = 1_000_000_000;

/// Updates that should have come within `elapsed` ns since the last one and have not. An update counts as missed when
/// it is half a period overdue, so that jitter of the network makes no difference.
pub(in crate::device) fn missed_updates(elapsed: u64, period: u64) -> u64 {
    let period = period.max(1);
    elapsed.saturating_sub(period / 2) / period
}

impl Axis {
    /// What the drive has to do at `now`. `period_ns` and `limit` judge the age of the set-points.
    pub fn command(
        &self,
        now: MonotonicTime,
        context: &Context,
        period_ns: u64,
        limit: u32,
    ) -> AxisCommandImage {
        let command = match self.held {
            _ if !context.connected && self.state == AxisState::Initializing => {
                Command::Withheld(Withheld::NotConnected)
            }
            _ if !context.connected => Command::Withheld(Withheld::ConnectionLost),
            _ if context.node_fault => Command::Withheld(Withheld::NodeFault),
            _ if !context.remote => Command::Withheld(Withheld::LocalControl),
            _ if self.state != AxisState::Running || self.kind != ControlKind::Active => {
                Command::Withheld(Withheld::NotRunning)
            }
            None => Command::Withheld(Withheld::NoSetPoint),
            Some(held) => {
                let age = missed_updates(now.0.saturating_sub(held.at.0), period_ns);
                let age_updates = u32::try_from(age).unwrap_or(u32::MAX);
                if age_updates > limit {
                    Command::Withheld(Withheld::Stale)
                } else {
                    let position_reference = self.references.command();
                    Command::Follow(SetPoints { age_updates, position_reference, ..held.set_points })
                }
            }
        };
        let abort = self.faults.abort().filter(|_| self.action == DriveAction::Abort);
        AxisCommandImage {
            state: self.state,
            action: self.action,
            action_id: self.action_id,
            reset_id: self.reset_id,
            abort: abort.map(|fault| AbortOrder {
                action: fault.action,
                fault_type: fault.fault_type,
                code: fault.code,
            }),
            command,
            test: self.test_order().filter(|_| context.connected && context.remote && !context.node_fault),
        }
    }

    /// Axis Status, attribute 651: the drive's bits, completed and masked by Table 5-2.61.
    pub fn status(&self, context: &Context) -> AxisStatus {
        let mode = self.block.control_mode.0 & 0x0F;
        let powered = self.drive.power_enabled;
        let mut status = self.drive.axis_status;
        status.set(AxisStatus::LOCAL_CONTROL, !context.remote);
        status.set(AxisStatus::ALARM, self.faults.any_axis_alarm());
        status.set(AxisStatus::DC_BUS_UP, self.drive.bus_up);
        status.set(AxisStatus::POWER_STRUCTURE_ENABLED, powered);
        status.set(AxisStatus::TRACKING_COMMAND, self.answers() && self.drive.tracking);
        status.set(AxisStatus::SHUTDOWN, self.shutdown);
        status.set(AxisStatus::IN_PROCESS, self.in_process());
        status.set(AxisStatus::POSITION_CONTROL_MODE, powered && mode == ControlMode::POSITION.0);
        status.set(AxisStatus::VELOCITY_CONTROL_MODE, powered && mode == ControlMode::VELOCITY.0);
        status.set(AxisStatus::TORQUE_CONTROL_MODE, powered && mode == ControlMode::TORQUE.0);
        if !self.drive.online {
            // Nobody sees the axis: nothing is said about how it moves.
            status &= AxisStatus::LOCAL_CONTROL
                | AxisStatus::ALARM
                | AxisStatus::DC_BUS_UP
                | AxisStatus::POWER_STRUCTURE_ENABLED
                | AxisStatus::SHUTDOWN;
        }
        status & allowed(self.kind, self.state, powered)
    }

    /// The cyclic actual block of D-to-C update `update_id`, whose time stamp is `stamp`, system time in ns; `None` for an
    /// update without one.
    pub fn actual_block(&mut self, update_id: u8, stamp: Option<u64>, context: &Context) -> ActualBlock {
        let (axis_response, response_status) = self.handshake.response();
        let lint = self.config.lint_position && self.block.feedback_mode.position_is_lint();
        ActualBlock {
            control_mode: self.block.control_mode,
            feedback_mode: self.block.feedback_mode.with_lint(lint),
            axis_response,
            response_status,
            axis_state: self.state.code(),
            actual: self.actual_values(lint, stamp),
            status: self.status_values(update_id, context),
        }
    }

    /// The actual values that the controller asks for and this axis has. A bit for which there is no value is clear in the
    /// answer, so that nobody takes a zero for a measurement: everything of a converter, what the drive does not tell, and
    /// the Unwind Cycle Count where nothing is unwound. Of a drive that is not online only the position remains, the last
    /// one that it has reported: state and faults of the axis say that it is not measured any more.
    fn actual_values(&self, lint: bool, stamp: Option<u64>) -> ActualValues {
        let asked = self.block.actual_data_set;
        if self.kind == ControlKind::Converter {
            return ActualValues::default();
        }
        let position = stamp.map_or(self.drive.position, |stamp| self.position_at(stamp));
        let seen = self.seen_by_controller(position);
        let has = |bit| asked.contains(bit);
        let measured = |bit| has(bit) && self.drive.online;
        ActualValues {
            position: has(ActualDataSet::POSITION).then(|| seen.value(lint)),
            velocity: self.drive.velocity.filter(|_| measured(ActualDataSet::VELOCITY)),
            acceleration: self.drive.acceleration.filter(|_| measured(ActualDataSet::ACCELERATION)),
            unwind_count: seen.unwind_count().filter(|_| has(ActualDataSet::UNWIND_COUNT)),
            position_displacement: has(ActualDataSet::POSITION_DISPLACEMENT).then(|| self.displacement()),
        }
    }

    /// When the actual values were captured, system time in ns; `None` while the drive measures nothing or does not say
    /// when.
    pub fn captured_at(&self) -> Option<u64> {
        Some(self.drive.captured_at).filter(|at| self.drive.online && *at != 0)
    }

    /// The actual position at the instant of a time stamp: where the drive was when it was captured, and on from there at
    /// the velocity it had. An update has one time stamp for all of its instances, but drives of different buses, or one
    /// whose last telegram is missing, were captured at different instants.
    fn position_at(&self, stamp: u64) -> i64 {
        const SECOND: i128 = 1_000_000_000;
        let position = self.drive.position;
        let Some(captured_at) = self.captured_at().filter(|at| at.abs_diff(stamp) <= CORRECTION_MAX_NS)
        else {
            return position;
        };
        let span = i128::from(stamp) - i128::from(captured_at);
        let way = i128::from(self.drive.position_rate) * span;
        let way = (way + way.signum() * SECOND / 2) / SECOND;
        i64::try_from(way).map_or(position, |way| position.saturating_add(way))
    }

    fn status_values(&mut self, update_id: u8, context: &Context) -> StatusValues {
        let asked = self.block.status_data_set;
        let mut values = StatusValues::default();
        if asked.contains(StatusDataSet::FAULT) {
            values.fault = self.faults.fault_records.due(update_id);
        }
        if asked.contains(StatusDataSet::ALARM) {
            values.alarm = self.faults.alarm_records.due(update_id);
        }
        if asked.contains(StatusDataSet::AXIS_STATUS) {
            let status = (self.status(context), self.drive.axis_status_mfg);
            values.axis_status = self.axis_status.due(status, update_id);
        }
        if asked.contains(StatusDataSet::IO_STATUS) {
            values.io_status =
                self.io_status.due((self.drive.io_status, self.drive.io_status_mfg), update_id);
        }
        if asked.contains(StatusDataSet::SAFETY_STATUS)
            && let Some(safety) = self.drive.safety
        {
            values.safety = self.safety.due(safety, update_id);
        }
        values
    }
}
