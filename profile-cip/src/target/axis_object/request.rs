//! What the controller asks of an axis: its cyclic block and the requests of Axis Control (clause 5-2.6.4).

use super::super::axis_state::{AxisEvent, AxisState, ControlKind};
use super::super::drive_link::{SetPoints, Trims};
use super::{Axis, Context, Held, RAMP_AND_DISABLE, UpdateTimes, fault_code, has_set_point, sub_code};
use crate::wire::motion::CommandBlock;
use crate::wire::motion::codes::{AxisControl, ClearingEvent, ControlMode, FeedbackMode};
use crate::wire::status::GeneralStatus;
use profile_generic::time::MonotonicTime;

impl Axis {
    /// Takes the cyclic block of an update that was proven timely, with the trims of the same update.
    pub fn handle_block(
        &mut self,
        block: &CommandBlock,
        trims: Trims,
        times: UpdateTimes,
        now: MonotonicTime,
        context: &Context,
    ) {
        let before = ControlMode(self.block.control_mode.0 & 0x0F);
        self.block = *block;
        let mode = ControlMode(block.control_mode.0 & 0x0F);
        if has_set_point(mode, &block.values) {
            self.sequence = self.sequence.wrapping_add(1);
            let ahead = times.period.saturating_mul(u64::from(block.target.0));
            let set_points = SetPoints {
                control_mode: mode,
                feedback_mode: block.feedback_mode,
                values: block.values,
                trims,
                target: block.target,
                time_stamp: times.time_stamp,
                target_time: times.time_stamp.map(|t| t.saturating_add(ahead)),
                paced_at: times.paced_at,
                position_reference: 0,
                sequence: self.sequence,
                age_updates: 0,
            };
            self.held = Some(Held { set_points, at: now });
        } else if self.state == AxisState::Running && self.config.kind == ControlKind::Active {
            self.raise_illegal_mode(sub_code::SET_POINT_MISSING, context);
        }
        let controls = matches!(self.state, AxisState::Starting | AxisState::Running);
        if controls
            && self.config.kind == ControlKind::Active
            && let Some(sub_code) = self.illegal_change(before, mode, block.feedback_mode)
        {
            self.raise_illegal_mode(sub_code, context);
        }
        if let Some(request) = self.handshake.request(block.axis_control) {
            self.begin(request, block, context);
        }
    }

    /// The block of an update that did not prove timely: what it asks for is not carried out, what it takes away is.
    pub fn handle_status_request(&mut self, block: &CommandBlock) {
        self.block.actual_data_set = block.actual_data_set;
        self.block.status_data_set = block.status_data_set;
    }

    /// Takes the controller's Last Received ID.
    pub fn acknowledge(&mut self, received: u8) {
        self.faults.fault_records.acknowledge(received);
        self.faults.alarm_records.acknowledge(received);
        self.axis_status.acknowledge(received);
        self.io_status.acknowledge(received);
        self.safety.acknowledge(received);
    }

    /// Why an axis that is energized cannot go on with these modes (clause 6-2.7.1.2.2 and exception 60, Illegal Control
    /// Mode, which stands for both modes).
    fn illegal_change(&self, before: ControlMode, mode: ControlMode, feedback: FeedbackMode) -> Option<u8> {
        if !self.config.supports(mode) {
            Some(sub_code::MODE_NOT_SUPPORTED)
        } else if self.is_testing() {
            // A test follows no set-points and was started without an Enable.
            None
        } else if feedback.source() != self.feedback_source {
            // The drive would measure its position with another encoder from one cycle to the next.
            Some(sub_code::FEEDBACK_NOT_SUPPORTED)
        } else if mode != before && !self.may_follow(mode) {
            Some(sub_code::REFERENCE_CHANGING)
        } else {
            None
        }
    }

    pub(super) fn raise_illegal_mode(&mut self, sub_code: u8, context: &Context) {
        self.raise(fault_code::ILLEGAL_CONTROL_MODE, sub_code, RAMP_AND_DISABLE, context.system_time);
    }

    pub(super) fn begin(&mut self, request: AxisControl, block: &CommandBlock, context: &Context) {
        let done = match request {
            AxisControl::ENABLE => self.begin_enable(context),
            AxisControl::DISABLE => {
                self.fire(AxisEvent::Disable);
                None
            }
            AxisControl::SHUTDOWN if self.state == AxisState::Initializing => {
                Some(GeneralStatus::OBJECT_STATE_CONFLICT)
            }
            AxisControl::SHUTDOWN => {
                self.shutdown = true;
                self.fire(AxisEvent::Shutdown);
                None
            }
            AxisControl::SHUTDOWN_RESET if self.state == AxisState::Shutdown => {
                self.shutdown = false;
                self.fire(AxisEvent::ShutdownReset);
                self.faults.record_cleared(ClearingEvent::SHUTDOWN_RESET, context.system_time);
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::SHUTDOWN_RESET if self.state != AxisState::MajorFaulted => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::FAULT_RESET if !self.has_fault() => {
                self.faults.record_cleared(ClearingEvent::FAULT_RESET, context.system_time);
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::SHUTDOWN_RESET | AxisControl::FAULT_RESET => {
                self.reset_id = self.reset_id.wrapping_add(1);
                self.reset = Some(request);
                None
            }
            AxisControl::ABORT if self.state == AxisState::Initializing => {
                Some(GeneralStatus::OBJECT_STATE_CONFLICT)
            }
            AxisControl::ABORT => {
                let stop = self.sequence_settings.abort;
                self.raise(fault_code::CONTROLLER_INITIATED, 0, stop, context.system_time);
                None
            }
            AxisControl::STOP_PROCESS => self.stop_process(),
            AxisControl::CHANGE_ACTUAL_POSITION | AxisControl::CHANGE_COMMAND_POSITION => {
                Some(self.change_reference(request, block))
            }
            _ => Some(GeneralStatus::SERVICE_NOT_SUPPORTED),
        };
        if let Some(status) = done {
            self.handshake.complete(status);
        }
    }

    pub(super) fn begin_enable(&mut self, context: &Context) -> Option<GeneralStatus> {
        if self.config.kind != ControlKind::Active {
            return Some(GeneralStatus::OBJECT_STATE_CONFLICT);
        }
        if self.is_testing() {
            return Some(GeneralStatus::OBJECT_STATE_CONFLICT);
        }
        if matches!(self.state, AxisState::Starting | AxisState::Running) {
            return None;
        }
        let ready = context.remote && !context.node_fault && self.drive.online && !self.inhibited();
        let mode = ControlMode(self.block.control_mode.0 & 0x0F);
        let feedback = self.block.feedback_mode;
        if !self.config.supports(mode) || !self.config.supports_feedback(feedback) {
            return Some(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        if !self.may_follow(mode) {
            return Some(GeneralStatus::OBJECT_STATE_CONFLICT);
        }
        self.feedback_source = feedback.source();
        if ready && self.fire(AxisEvent::Enable) { None } else { Some(GeneralStatus::OBJECT_STATE_CONFLICT) }
    }
}
