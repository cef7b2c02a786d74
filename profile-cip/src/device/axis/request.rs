//! What the controller asks of an axis: its cyclic block and the requests of Axis Control (clause 5-2.6.4).

use super::drive_link::{HookupTest, SetPoints, Trims};
use super::refused::{RefusalReason, RefusedRequest};
use super::state::{AxisEvent, AxisState, ControlKind};
use super::{Axis, Context, Held, RAMP_AND_DISABLE, UpdateTimes, fault_code, has_set_point, sub_code, test};
use crate::wire::motion::CommandBlock;
use crate::wire::motion::codes::{
    AxisControl, ClearingEvent, ControlMode, FeedbackMode, FeedbackSource, TestStatus,
};
use crate::wire::motion::test_service::RunHookupTest;
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
        let before = ControlMode(self.command.block.control_mode.0 & 0x0F);
        let known = core::mem::replace(&mut self.command.block, *block);
        let mode = ControlMode(block.control_mode.0 & 0x0F);
        let controls = matches!(self.machine.state, AxisState::Starting | AxisState::Running)
            && self.machine.kind == ControlKind::Active;
        let illegal = if controls { self.illegal_change(before, mode, block.feedback_mode) } else { None };
        if let Some(sub_code) = illegal {
            // Whatever follows from it, the axis does not go where an illegal mode says.
            self.find_illegal_mode(sub_code, context);
            (self.command.block.control_mode, self.command.block.feedback_mode) =
                (known.control_mode, known.feedback_mode);
        } else if has_set_point(mode, &block.values) {
            self.command.sequence = self.command.sequence.wrapping_add(1);
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
                sequence: self.command.sequence,
                age_updates: 0,
            };
            self.command.held = Some(Held { set_points, at: now });
        } else if self.machine.state == AxisState::Running && self.machine.kind == ControlKind::Active {
            self.find_illegal_mode(sub_code::SET_POINT_MISSING, context);
        }
        if let Some(request) = self.requests.handshake.request(block.axis_control) {
            self.begin(request, block, context);
        }
    }

    /// The block of an update that did not prove timely: what it asks for is not carried out, what it takes away is.
    pub fn handle_status_request(&mut self, block: &CommandBlock) {
        self.command.block.actual_data_set = block.actual_data_set;
        self.command.block.status_data_set = block.status_data_set;
    }

    /// Takes the controller's Last Received ID.
    pub fn acknowledge(&mut self, received: u8) {
        self.faults.fault_records.acknowledge(received);
        self.faults.alarm_records.acknowledge(received);
        self.reported.acknowledge(received);
    }

    /// Whether the axis, and the drive that it has now, have a Control Mode.
    fn supports(&self, mode: ControlMode) -> bool {
        let has = |modes: u16| mode.0 < 16 && modes & (1 << mode.0) != 0;
        self.config.supports(mode) && self.drive.control_modes.is_none_or(has)
    }

    /// Why an axis that is energized cannot go on with these modes (clause 6-2.7.1.2.2 and exception 60, Illegal Control
    /// Mode, which stands for both modes).
    fn illegal_change(&self, before: ControlMode, mode: ControlMode, feedback: FeedbackMode) -> Option<u8> {
        if !self.supports(mode) {
            Some(sub_code::MODE_NOT_SUPPORTED)
        } else if self.test.is_energizing() {
            // A test follows no set-points and was started without an Enable.
            None
        } else if feedback.source() != self.command.feedback_source {
            // The drive would measure its position with another encoder from one cycle to the next.
            Some(sub_code::FEEDBACK_NOT_SUPPORTED)
        } else if mode != before && !self.references.allow(mode) {
            Some(sub_code::REFERENCE_CHANGING)
        } else {
            None
        }
    }

    fn find_illegal_mode(&mut self, sub_code: u8, context: &Context) {
        self.faults.find(fault_code::ILLEGAL_CONTROL_MODE, sub_code, RAMP_AND_DISABLE, context.system_time);
    }

    pub(super) fn begin(&mut self, request: AxisControl, block: &CommandBlock, context: &Context) {
        let done = match request {
            AxisControl::ENABLE => self.begin_enable(context),
            AxisControl::DISABLE => {
                self.fire(AxisEvent::Disable);
                Ok(false)
            }
            AxisControl::SHUTDOWN | AxisControl::ABORT if self.machine.state == AxisState::Initializing => {
                Err(RefusalReason::State(self.machine.state))
            }
            AxisControl::SHUTDOWN => {
                // Only a Shutdown Reset that comes after it ends it (clause 5-2.6.2.13). One that was cancelled and still waits for the
                // drive resets the faults alone.
                if self.orders.reset == Some(AxisControl::SHUTDOWN_RESET) {
                    self.orders.reset = Some(AxisControl::FAULT_RESET);
                }
                self.machine.shutdown = true;
                self.fire(AxisEvent::Shutdown);
                Ok(false)
            }
            AxisControl::SHUTDOWN_RESET if self.machine.state == AxisState::Shutdown => {
                self.machine.shutdown = false;
                self.fire(AxisEvent::ShutdownReset);
                // Minor faults may be latched.
                self.faults.clear(ClearingEvent::SHUTDOWN_RESET, context.system_time);
                Ok(true)
            }
            AxisControl::SHUTDOWN_RESET if self.machine.state != AxisState::MajorFaulted => Ok(true),
            AxisControl::FAULT_RESET if !self.has_fault() => {
                self.faults.record_cleared(ClearingEvent::FAULT_RESET, context.system_time);
                Ok(true)
            }
            AxisControl::SHUTDOWN_RESET | AxisControl::FAULT_RESET => {
                self.orders.ask_reset();
                self.orders.reset = Some(request);
                Ok(false)
            }
            AxisControl::ABORT => {
                // A reset that still waits for the drive is older than the fault of this request.
                self.orders.reset = None;
                let stop = self.sequence_settings.abort;
                self.faults.find(fault_code::CONTROLLER_INITIATED, 0, stop, context.system_time);
                Ok(false)
            }
            AxisControl::STOP_PROCESS => Ok(self.stop_process()),
            AxisControl::CHANGE_ACTUAL_POSITION | AxisControl::CHANGE_COMMAND_POSITION => {
                self.change_reference(request, block.values.position_displacement).map(|()| true)
            }
            _ => Err(RefusalReason::Unknown),
        };
        match done {
            Ok(true) => self.requests.handshake.complete(GeneralStatus::SUCCESS),
            Ok(false) => {}
            Err(reason) => self.refuse(reason),
        }
    }

    /// Answers the request in progress with a refusal, and keeps why.
    pub(super) fn refuse(&mut self, reason: RefusalReason) {
        let Some(request) = self.requests.handshake.executing() else { return };
        let status = reason.status();
        self.requests.handshake.complete(status);
        let _ = self.requests.refused.try_push(RefusedRequest { request, status, reason });
    }

    /// Whether the axis is enabled already; not yet, or why not.
    fn begin_enable(&mut self, context: &Context) -> Result<bool, RefusalReason> {
        use RefusalReason as R;
        if self.config.kind != ControlKind::Active {
            return Err(R::ControlsNothing);
        }
        if self.test.is_energizing() {
            return Err(R::Testing);
        }
        if self.machine.kind == ControlKind::Active
            && matches!(self.machine.state, AxisState::Starting | AxisState::Running)
        {
            return Ok(false);
        }
        let mode = ControlMode(self.command.block.control_mode.0 & 0x0F);
        let feedback = self.command.block.feedback_mode;
        if mode == ControlMode::NO_CONTROL {
            return Err(R::FeedbackOnly);
        }
        if !self.supports(mode) {
            return Err(R::ControlMode(mode));
        }
        if !self.config.supports_feedback(feedback) {
            return Err(R::FeedbackMode(feedback));
        }
        if !self.references.allow(mode) {
            return Err(R::ReferenceChanging);
        }
        let reasons = [
            (!context.remote, R::LocalControl),
            (context.node_fault, R::NodeFault),
            (!self.drive.online, R::DriveOffline),
            (self.inhibited(), R::Inhibited(self.drive.start_inhibits, self.drive.start_inhibits_mfg)),
        ];
        if let Some((_, reason)) = reasons.into_iter().find(|(stands, _)| *stands) {
            return Err(reason);
        }
        self.command.feedback_source = feedback.source();
        if self.fire(AxisEvent::Enable) { Ok(false) } else { Err(R::State(self.machine.state)) }
    }

    fn change_reference(
        &mut self,
        request: AxisControl,
        displacement: Option<i32>,
    ) -> Result<(), RefusalReason> {
        if self.machine.state == AxisState::Initializing {
            // What a count is has not been said yet.
            return Err(RefusalReason::State(self.machine.state));
        }
        self.references.change(request, displacement.ok_or(RefusalReason::ValueMissing)?)
    }

    /// Run_Hookup_Test: checks the request and gives the order.
    pub fn begin_hookup_test(&mut self, request: &RunHookupTest, context: &Context) -> GeneralStatus {
        if self.config.hookup_tests == 0 || self.config.kind == ControlKind::Converter {
            return GeneralStatus::SERVICE_NOT_SUPPORTED;
        }
        let known = request.test_type < 8 && self.config.hookup_tests & (1 << request.test_type) != 0;
        let (true, Some(test)) = (known, HookupTest::from_code(request.test_type)) else {
            return GeneralStatus::INVALID_PARAMETER;
        };
        let source = self.command.block.feedback_mode.source();
        let Some(order) = test::order(test, request, source) else {
            return GeneralStatus::INVALID_PARAMETER;
        };
        if !self.is_free_for(test) {
            return GeneralStatus::OBJECT_STATE_CONFLICT;
        }
        let allowed = context.connected && context.remote && !context.node_fault && self.drive.online;
        if !allowed || (test.is_active() && !self.may_move_for_test(source)) {
            return GeneralStatus::DEVICE_STATE_CONFLICT;
        }
        if test.is_active() && !self.fire(AxisEvent::Test) {
            return GeneralStatus::OBJECT_STATE_CONFLICT;
        }
        self.test.begin(order);
        self.update_action();
        GeneralStatus::SUCCESS
    }

    /// Whether a test can begin in the present state: no other one is in process, and no request.
    fn is_free_for(&self, test: HookupTest) -> bool {
        let state = match self.machine.state {
            AxisState::Stopped => true,
            AxisState::Shutdown | AxisState::PreCharge | AxisState::StartInhibited => !test.is_active(),
            _ => false,
        };
        state && !self.test.is_in_process() && self.requests.handshake.executing().is_none()
    }

    /// Whether the motor may move for a test. With load feedback it would although channel 2 cannot be judged.
    fn may_move_for_test(&self, source: FeedbackSource) -> bool {
        let judged = !matches!(source, FeedbackSource::LOAD | FeedbackSource::DUAL);
        judged && !self.inhibited() && self.drive.bus_up
    }

    /// Stop Process: the axis stops as by a Disable. Returns the status when there is nothing to wait for.
    pub(super) fn stop_process(&mut self) -> bool {
        let moves = self.test.is_energizing();
        self.test.break_off(TestStatus::ABORTED);
        if moves {
            self.fire(AxisEvent::Disable);
            return false;
        }
        self.test.end();
        true
    }
}
