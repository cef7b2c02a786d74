//! From the axis to the controller.

use super::{AxisChannel, Loss, PositionJump, Trip};
use crate::mapping::CipFault;
use profile_cip::device::drive_link::DriveImage;
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::inhibit::Inhibits;
use profile_generic::state::Report;
use profile_generic::time::{MonotonicTime, SystemTime};

impl AxisChannel {
    /// Writes what the motion device has to know of the drive over what it was told before.
    pub fn fill_drive_image(&mut self, image: &mut DriveImage) {
        image.clear();
        image.online = self.south.is_some() && self.feedback.report != Report::Silent;
        image.action_id = self.action_id;
        image.reset_id = self.reset_id;
        image.test = self.test_report();
        image.scaling_id = self.scaling_id;
        image.control_modes = self.control_modes;
        let mut feedback = self.feedback;
        // The controller is about to end it, or has a fault that says why it cannot be ended.
        feedback.inhibits.remove(Inhibits::CONFIGURATION_INCOMPLETE);
        self.north.drive_image(&feedback, &self.faults, &mut self.said, image);
        self.sequence_image(image);
        if let Some((program, _)) = &self.south {
            let captures = program.captures();
            image.events = self.said.checkable(&self.north, (self.programs, || captures.kinds()), &feedback);
            image.events_checking = self.north.events().captured(self.captures.checking(captures));
        }
    }

    /// The fault, where the controller knows it as one of the communications node: its code, and since when.
    #[must_use]
    pub fn node_fault(&self) -> Option<(u8, SystemTime)> {
        let fault = self.fault?;
        match self.north.fault(fault.cause) {
            Some(CipFault::Node(code)) => Some((code, fault.at)),
            _ => None,
        }
    }

    /// The box ends: the axis stops as on a lost command, but holds nothing.
    pub fn end(&mut self, now: MonotonicTime, system: SystemTime) {
        self.command_loss = self.command_loss.max(Reaction::DecelerateAndDisable);
        self.lose_command(now, system, Loss::End);
        self.end_hold(now, system);
    }

    /// Sets what keeps the axis from starting for reasons the box knows.
    pub fn set_inhibits(&mut self, now: MonotonicTime, system: SystemTime, inhibits: Inhibits) {
        if let Some(transition) = self.drive.machine.set_inhibits(inhibits) {
            self.follow(now, system, transition);
        }
    }

    /// Why the command was lost, when that is the fault.
    #[must_use]
    pub fn loss(&self) -> Option<Loss> {
        self.loss.filter(|_| self.fault.is_some_and(|fault| fault.cause == FaultCause::COMMAND_LOST))
    }

    /// The limit that a set-point has exceeded, when that is the fault.
    #[must_use]
    pub fn tripped(&self) -> Option<Trip> {
        let limits = |fault: Fault| {
            matches!(
                fault.cause,
                FaultCause::POSITION_COMMAND_LIMIT
                    | FaultCause::VELOCITY_COMMAND_LIMIT
                    | FaultCause::ACCELERATION_COMMAND_LIMIT
            )
        };
        self.tripped.filter(|_| self.fault.is_some_and(limits))
    }

    /// The jump of the actual position, when that is the fault.
    #[must_use]
    pub fn jump(&self) -> Option<PositionJump> {
        let (at, jump) = self.jump?;
        self.fault
            .filter(|fault| fault.cause == FaultCause::FEEDBACK_DATA_LOSS && fault.at == at)
            .map(|_| jump)
    }

    /// The fault that stands.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }
}
