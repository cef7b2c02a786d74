//! The axis follows its drive, its connection and the requests in progress.

use super::super::axis_state::{AxisEvent, AxisState, ControlKind};
use super::super::drive_link::{DriveAction, DriveFault};
use super::{Axis, COAST_AND_DISABLE, Context, fault_code, sub_code};
use crate::wire::motion::codes::{AxisControl, ClearingEvent, ControlStatus, FaultType};
use crate::wire::status::GeneralStatus;

/// Most transitions in one step; more would be a circle.
const TRANSITIONS_MAX: usize = 8;

impl Axis {
    /// Lets the state follow the drive, the connection and the requests in progress.
    pub fn step(&mut self, context: &Context) {
        self.log_alarm(context.system_time);
        for _ in 0..TRANSITIONS_MAX {
            let before = self.state;
            self.follow(context);
            self.update_action();
            if self.state == before {
                break;
            }
        }
        self.complete_request();
    }

    pub(super) fn follow(&mut self, context: &Context) {
        if self.answers() && self.drive.stop_complete {
            self.winding_down = false;
        }
        if self.state == AxisState::Initializing {
            let configured = self.block.control_status.contains(ControlStatus::CONFIGURATION_COMPLETE);
            let ready = context.connected && configured && self.drive.online;
            if ready && !context.node_fault && !self.winding_down {
                self.fire(AxisEvent::InitializationComplete);
            }
            return;
        }
        self.follow_faults(context);
        self.follow_drive(context);
    }

    pub(super) fn follow_faults(&mut self, context: &Context) {
        if let Some(request) = self.reset
            && self.drive.online
            && self.drive.reset_id == self.reset_id
            && !self.winding_down
        {
            self.reset = None;
            self.faults = 0;
            self.seen_fault = None;
            let (event, cleared) = if request == AxisControl::SHUTDOWN_RESET {
                self.shutdown = false;
                (AxisEvent::ShutdownReset, ClearingEvent::SHUTDOWN_RESET)
            } else {
                (AxisEvent::FaultReset, ClearingEvent::FAULT_RESET)
            };
            self.log_cleared(cleared, context.system_time);
            self.fire(event);
            if self.handshake.executing() == Some(request) {
                self.handshake.complete(GeneralStatus::SUCCESS);
            }
        }
        // An axis that already stops for a fault does not get another one for going silent.
        if self.state.is_energized() && !self.drive.online && self.state != AxisState::Aborting {
            let fault = DriveFault {
                fault_type: FaultType::AXIS,
                code: fault_code::EXTERNAL,
                sub_code: sub_code::DRIVE_LOST,
                action: COAST_AND_DISABLE,
            };
            self.raise(fault, context.system_time);
        }
        if self.drive.fault != self.seen_fault {
            self.seen_fault = self.drive.fault;
            if let Some(fault) = self.drive.fault {
                self.raise(fault, context.system_time);
            }
        }
        if context.node_fault {
            self.fire(AxisEvent::MajorFault);
        }
    }

    pub(super) fn follow_drive(&mut self, context: &Context) {
        match self.state {
            AxisState::PreCharge if self.drive.online && self.drive.bus_up => self.fire(AxisEvent::BusUp),
            AxisState::PreCharge if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::Stopped if !self.drive.bus_up || !self.drive.online => self.fire(AxisEvent::BusDown),
            AxisState::Stopped if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::StartInhibited if !self.inhibited() => self.fire(AxisEvent::InhibitsCleared),
            AxisState::Starting | AxisState::Running if self.inhibited() || !context.remote => {
                self.fire(AxisEvent::Disable)
            }
            AxisState::Starting if self.answers() && self.drive.start_complete => {
                self.fire(AxisEvent::StartComplete)
            }
            // A drive that no longer follows is no longer Running, and does not start again by itself.
            AxisState::Running
                if self.config.kind == ControlKind::Active
                    && self.answers()
                    && !self.drive.start_complete =>
            {
                self.fire(AxisEvent::Disable)
            }
            AxisState::Running if self.config.kind == ControlKind::Converter && !self.drive.bus_up => {
                self.fire(AxisEvent::BusDown)
            }
            AxisState::Stopping | AxisState::Aborting if self.answers() && self.drive.stop_complete => {
                self.fire(AxisEvent::StopComplete)
            }
            _ => false,
        };
    }

    pub(super) fn complete_request(&mut self) {
        let Some(request) = self.handshake.executing() else { return };
        let state = self.state;
        let done = match request {
            AxisControl::ENABLE if state == AxisState::Running => {
                (self.answers() && self.drive.tracking).then_some(GeneralStatus::SUCCESS)
            }
            AxisControl::ENABLE if state == AxisState::Starting => None,
            AxisControl::ENABLE => Some(GeneralStatus::OBJECT_STATE_CONFLICT),
            AxisControl::DISABLE if !state.is_energized() => Some(GeneralStatus::SUCCESS),
            AxisControl::SHUTDOWN if matches!(state, AxisState::Shutdown | AxisState::MajorFaulted) => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::ABORT if matches!(state, AxisState::Aborting | AxisState::MajorFaulted) => {
                Some(GeneralStatus::SUCCESS)
            }
            _ => None,
        };
        if let Some(status) = done {
            self.handshake.complete(status);
        }
    }

    pub(super) fn update_action(&mut self) {
        let action = match self.state {
            AxisState::Off | AxisState::SelfTest => DriveAction::None,
            AxisState::Initializing if self.winding_down => DriveAction::Disable,
            AxisState::Initializing => DriveAction::None,
            AxisState::PreCharge | AxisState::Stopped | AxisState::StartInhibited => DriveAction::PowerUp,
            // Only an axis that controls motion is energized by Running.
            AxisState::Running if self.config.kind != ControlKind::Active => DriveAction::PowerUp,
            AxisState::Starting | AxisState::Running | AxisState::Testing => DriveAction::Enable,
            AxisState::Stopping if self.shutdown => DriveAction::Shutdown,
            AxisState::Stopping => DriveAction::Disable,
            AxisState::Aborting | AxisState::MajorFaulted => DriveAction::Abort,
            AxisState::Shutdown => DriveAction::Shutdown,
        };
        if action != self.action {
            self.action = action;
            self.action_id = self.action_id.wrapping_add(1);
        }
    }
}
