//! What an axis tells: the command image for its drive and the cyclic actual block for the controller.

use profile_generic::time::MonotonicTime;

use super::axis_object::{Axis, Context};
use super::axis_state::{AxisState, ControlKind};
use super::axis_status::allowed;
use super::drive_link::{AbortOrder, AxisCommandImage, Command, DriveAction, SetPoints, Withheld};
use super::io_connection::missed_updates;
use crate::wire::motion::codes::{ActualDataSet, AxisStatus, ControlMode, StatusDataSet};
use crate::wire::motion::{ActualBlock, ActualValues, StatusValues};

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
            _ if !context.connected => Command::Withheld(Withheld::NotConnected),
            _ if context.node_fault => Command::Withheld(Withheld::NodeFault),
            _ if !context.remote => Command::Withheld(Withheld::LocalControl),
            _ if self.state != AxisState::Running || self.config.kind != ControlKind::Active => {
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
        status & allowed(self.config.kind, self.state, powered)
    }

    /// The cyclic actual block of D-to-C update `update_id`.
    pub fn actual_block(&mut self, update_id: u8, context: &Context) -> ActualBlock {
        let (axis_response, response_status) = self.handshake.response();
        let lint = self.config.lint_position && self.block.feedback_mode.position_is_lint();
        ActualBlock {
            control_mode: self.block.control_mode,
            feedback_mode: self.block.feedback_mode.with_lint(lint),
            axis_response,
            response_status,
            axis_state: self.state.code(),
            actual: self.actual_values(lint),
            status: self.status_values(update_id, context),
        }
    }

    /// The actual values that the controller asks for and this axis has. A bit for which there is no value is clear in the
    /// answer, so that nobody takes a zero for a measurement: everything of a converter, what the drive does not tell, and
    /// the Unwind Cycle Count where nothing is unwound.
    fn actual_values(&self, lint: bool) -> ActualValues {
        let asked = self.block.actual_data_set;
        if self.config.kind == ControlKind::Converter {
            return ActualValues::default();
        }
        let seen = self.seen_by_controller(self.drive.position);
        let has = |bit| asked.contains(bit);
        ActualValues {
            position: has(ActualDataSet::POSITION).then(|| seen.value(lint)),
            velocity: self.drive.velocity.filter(|_| has(ActualDataSet::VELOCITY)),
            acceleration: self.drive.acceleration.filter(|_| has(ActualDataSet::ACCELERATION)),
            unwind_count: seen.unwind_count().filter(|_| has(ActualDataSet::UNWIND_COUNT)),
            position_displacement: has(ActualDataSet::POSITION_DISPLACEMENT).then(|| self.displacement()),
        }
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
