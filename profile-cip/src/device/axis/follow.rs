//! The axis follows its drive, its connection and the requests in progress.

use super::drive_link::{AbortCause, DriveAction};
use super::exception::{DriveCondition, ExceptionAction, ExceptionActions};
use super::refused::RefusalReason;
use super::state::{AxisEvent, AxisState, ControlKind};
use super::{Axis, COAST_AND_DISABLE, Context, fault_code, sub_code};
use crate::wire::motion::codes::{
    AxisControl, ClearingEvent, ControlMode, ControlStatus, FaultType, TestStatus,
};
use crate::wire::status::GeneralStatus;

/// Most transitions in one step; more would be a circle.
const TRANSITIONS_MAX: usize = 8;

impl Axis {
    /// Lets the state follow the drive, the connection and the requests in progress. `actions` are what the controller
    /// wants done about exceptions.
    pub fn step(&mut self, context: &Context, actions: &ExceptionActions<'_>) {
        for _ in 0..TRANSITIONS_MAX {
            let before = self.machine.state;
            self.follow(context, actions);
            self.update_action();
            if self.machine.state == before {
                break;
            }
        }
        self.complete_request();
    }

    pub(super) fn follow(&mut self, context: &Context, actions: &ExceptionActions<'_>) {
        if self.has_stopped() {
            self.machine.winding_down = false;
        }
        if self.machine.state == AxisState::Initializing {
            self.look_at_conditions(actions, context.system_time);
        }
        if self.machine.state == AxisState::Initializing {
            return self.follow_configuration(context);
        }
        self.follow_reset(context);
        self.follow_control_mode();
        self.look_at_conditions(actions, context.system_time);
        // One cause, one fault: an axis that already stops for a fault, perhaps for this one, does not get another for
        // going silent.
        if self.machine.state.is_energized()
            && !self.drive.online
            && self.machine.state != AxisState::Aborting
        {
            self.lose_drive(context.system_time);
        }
        if context.node_fault {
            self.fire(AxisEvent::MajorFault);
        }
        // First, because the drive leaves its test in the same cycle in which it reports the end.
        self.follow_test(context);
        self.follow_drive(context);
    }

    /// Ends the initialization once the axis is configured and its drive has reset its faults.
    fn follow_configuration(&mut self, context: &Context) {
        let reset = self.follow_connection_reset();
        let configured = self.command.block.control_status.contains(ControlStatus::CONFIGURATION_COMPLETE);
        // A drive that is lost is a fault that stands: the controller learns of it, and goes on with the other axes.
        let lost = !self.drive.online && self.drive.conditions.as_slice().iter().any(DriveCondition::stops);
        let ready = context.connected && configured && (lost || self.drive.online && reset);
        if ready && !context.node_fault && !self.machine.winding_down {
            self.orders.connection_reset = false;
            self.follow_control_mode();
            self.fire(AxisEvent::InitializationComplete);
        }
    }

    /// The drive is gone, and no condition of it says so.
    fn lose_drive(&mut self, system_time: u64) {
        let condition = DriveCondition {
            fault_type: FaultType::AXIS,
            code: fault_code::EXTERNAL,
            sub_code: sub_code::DRIVE_LOST,
            detail: 0,
            action: COAST_AND_DISABLE,
            least: ExceptionAction::MAJOR_FAULT,
            at: system_time,
        };
        self.faults.latch(&condition, true, Some(AbortCause::DriveLost), self.machine.state);
        self.follow_major_faults();
    }

    /// Answers an Abort Request that the controller wants no stop from.
    fn end_abort(&mut self, found: &[DriveCondition], actions: &ExceptionActions<'_>) {
        let abort = found.iter().find(|condition| condition.code == fault_code::CONTROLLER_INITIATED);
        let Some(action) = abort.map(|abort| actions.action(abort)) else { return };
        if self.requests.handshake.executing() != Some(AxisControl::ABORT) {
            return;
        }
        match action {
            ExceptionAction::MAJOR_FAULT => {}
            ExceptionAction::IGNORE => self.refuse(RefusalReason::Ignored),
            _ => self.requests.handshake.complete(GeneralStatus::SUCCESS),
        }
    }

    /// Takes the conditions of the drive into account.
    pub(super) fn look_at_conditions(&mut self, actions: &ExceptionActions<'_>, system_time: u64) {
        let found = core::mem::take(&mut self.faults.found);
        self.faults.look(&self.drive, &found, actions, self.machine.state, system_time);
        self.end_abort(&found, actions);
        if self.machine.state == AxisState::Initializing {
            if self.faults.any_unrecoverable() {
                self.fire(AxisEvent::InitializationFault);
            }
        } else {
            self.follow_major_faults();
        }
    }

    fn follow_major_faults(&mut self) {
        if !self.faults.any_major() {
            return;
        }
        if self.faults.shuts_down() {
            self.machine.shutdown = true;
        }
        self.fire(AxisEvent::MajorFault);
    }

    /// Lets the test follow the drive and the state of the axis.
    fn follow_test(&mut self, context: &Context) {
        let Some((order, ended)) = self.test.given() else { return };
        let report = self.drive.test.filter(|report| report.id == order.id);
        let passive_allowed = context.connected && context.remote && !context.node_fault && self.drive.online;
        match self.machine.state {
            AxisState::Starting | AxisState::Testing if order.test.is_active() && !ended => {
                if let Some(report) = report {
                    self.test.record(report.data);
                    let event = if self.machine.state == AxisState::Testing {
                        AxisEvent::TestComplete
                    } else {
                        AxisEvent::Disable
                    };
                    self.fire(event);
                }
            }
            AxisState::Stopping if order.test.is_active() => self.test.break_off(TestStatus::ABORTED),
            AxisState::Aborting | AxisState::MajorFaulted => {
                self.test.break_off(TestStatus::FAULTED);
                if self.machine.state == AxisState::MajorFaulted {
                    self.test.end();
                }
            }
            AxisState::Stopped | AxisState::Shutdown | AxisState::PreCharge | AxisState::StartInhibited
                if !order.test.is_active() && !ended && passive_allowed =>
            {
                if let Some(report) = report {
                    self.test.record(report.data);
                    self.test.end();
                }
            }
            _ => {
                self.test.break_off(TestStatus::ABORTED);
                self.test.end();
            }
        }
    }

    /// Control Mode 0 makes the axis of a drive a feedback device (Table 5-2.99), and another one makes it an axis again. Neither while
    /// it is energized or holds, and never into motion.
    fn follow_control_mode(&mut self) {
        let passive = ControlMode(self.command.block.control_mode.0 & 0x0F) == ControlMode::NO_CONTROL;
        let kind = match self.config.kind {
            ControlKind::Active if passive => ControlKind::FeedbackOnly,
            kind => kind,
        };
        let busy = self.machine.kind == ControlKind::Active
            && (self.machine.state.is_energized() || self.machine.holding)
            || self.machine.winding_down
            || self.drive.power_enabled
            || self.test.is_in_process();
        if kind == self.machine.kind || busy {
            return;
        }
        self.machine.kind = kind;
        use AxisState as S;
        self.machine.state = match (kind, self.machine.state) {
            (ControlKind::FeedbackOnly, S::PreCharge | S::Stopped | S::StartInhibited) => S::StartInhibited,
            (ControlKind::Active, S::Running | S::StartInhibited) => S::PreCharge,
            (_, state) => state,
        };
    }

    /// Has the drive reset its faults after a connection began or ended, as soon as it is there and has stopped. Returns
    /// whether it has tried.
    fn follow_connection_reset(&mut self) -> bool {
        if self.orders.connection_reset && self.drive.online && !self.machine.winding_down {
            self.orders.connection_reset = false;
            self.orders.ask_reset();
        }
        !self.orders.connection_reset && self.drive.reset_id == self.orders.reset_id
    }

    /// Ends a reset that the drive has carried out, or that its time limit has ended.
    pub(super) fn follow_reset(&mut self, context: &Context) {
        let Some(request) = self.orders.reset else { return };
        if self.drive.reset_id != self.orders.reset_id || self.machine.winding_down {
            return;
        }
        self.orders.reset = None;
        let (event, cleared) = if request == AxisControl::SHUTDOWN_RESET {
            self.machine.shutdown = false;
            (AxisEvent::ShutdownReset, ClearingEvent::SHUTDOWN_RESET)
        } else {
            (AxisEvent::FaultReset, ClearingEvent::FAULT_RESET)
        };
        self.faults.clear(cleared, context.system_time);
        // Only a restart of the device clears an initialization fault (clause 5-2.6.3.6).
        let stands = self.faults.any_unrecoverable();
        if !stands {
            self.fire(event);
        }
        match self.requests.handshake.executing() {
            Some(executing) if executing == request && stands => self.refuse(RefusalReason::Unrecoverable),
            Some(executing) if executing == request => {
                self.requests.handshake.complete(GeneralStatus::SUCCESS)
            }
            _ => {}
        }
    }

    pub(super) fn follow_drive(&mut self, context: &Context) {
        match self.machine.state {
            AxisState::PreCharge if self.drive.online && self.drive.bus_up => self.fire(AxisEvent::BusUp),
            AxisState::PreCharge if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::Stopped if !self.drive.bus_up || !self.drive.online => self.fire(AxisEvent::BusDown),
            AxisState::Stopped if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::StartInhibited if !self.inhibited() => self.fire(AxisEvent::InhibitsCleared),
            AxisState::Starting | AxisState::Running | AxisState::Testing
                if self.machine.kind == ControlKind::Active && !context.remote =>
            {
                self.fire(AxisEvent::Disable)
            }
            // A start inhibit keeps an axis from starting (clause 5-2.6.4). One that runs it does not stop.
            AxisState::Starting if self.inhibited() => self.fire(AxisEvent::Disable),
            AxisState::Starting if self.answers() && self.drive.start_complete => {
                self.fire(AxisEvent::StartComplete)
            }
            // A drive that no longer follows is no longer Running, and does not start again by itself.
            AxisState::Running | AxisState::Testing
                if self.machine.kind == ControlKind::Active
                    && self.answers()
                    && !self.drive.start_complete =>
            {
                self.fire(AxisEvent::Disable)
            }
            AxisState::Running if self.machine.kind == ControlKind::Converter && !self.drive.bus_up => {
                self.fire(AxisEvent::BusDown)
            }
            AxisState::Stopping | AxisState::Aborting if self.has_stopped() => {
                self.fire(AxisEvent::StopComplete)
            }
            _ => false,
        };
    }

    pub(super) fn complete_request(&mut self) {
        let Some(request) = self.requests.handshake.executing() else { return };
        let state = self.machine.state;
        let done = match request {
            AxisControl::ENABLE if state == AxisState::Running => {
                (self.answers() && self.drive.tracking).then_some(GeneralStatus::SUCCESS)
            }
            AxisControl::ENABLE if state == AxisState::Starting => None,
            AxisControl::ENABLE => return self.refuse(RefusalReason::EndedIn(state)),
            AxisControl::DISABLE if !state.is_energized() || self.machine.kind != ControlKind::Active => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::SHUTDOWN if matches!(state, AxisState::Shutdown | AxisState::MajorFaulted) => {
                // Out of a hold the state is there before the torque has gone.
                let powered = self.drive.online && self.drive.power_enabled;
                (!powered).then_some(GeneralStatus::SUCCESS)
            }
            AxisControl::ABORT if matches!(state, AxisState::Aborting | AxisState::MajorFaulted) => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::STOP_PROCESS if !self.test.is_in_process() => Some(GeneralStatus::SUCCESS),
            _ => None,
        };
        if let Some(status) = done {
            self.requests.handshake.complete(status);
        }
    }

    pub(super) fn update_action(&mut self) {
        let action = match self.machine.state {
            AxisState::Off | AxisState::SelfTest => DriveAction::None,
            AxisState::Initializing if self.machine.winding_down => DriveAction::Disable,
            AxisState::Initializing => DriveAction::None,
            AxisState::Stopped if self.machine.holding => DriveAction::Disable,
            AxisState::PreCharge | AxisState::Stopped | AxisState::StartInhibited => DriveAction::PowerUp,
            // Only an axis that controls motion is energized by Running.
            AxisState::Running if self.machine.kind != ControlKind::Active => DriveAction::PowerUp,
            AxisState::Testing => DriveAction::Test,
            AxisState::Starting if self.test.is_energizing() => DriveAction::Test,
            AxisState::Starting | AxisState::Running => DriveAction::Enable,
            AxisState::Stopping if self.machine.shutdown => DriveAction::Shutdown,
            AxisState::Stopping => DriveAction::Disable,
            // With a shutdown beneath its fault the axis is free of torque, also where the fault's own action holds it.
            AxisState::MajorFaulted if self.machine.shutdown => DriveAction::Shutdown,
            AxisState::Aborting | AxisState::MajorFaulted => DriveAction::Abort,
            AxisState::Shutdown => DriveAction::Shutdown,
        };
        self.orders.set_action(action);
    }
}
