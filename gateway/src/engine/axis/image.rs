//! From the axis to its north side.

use super::{AxisChannel, Loss, PositionJump, Trip};
use profile_generic::capture::CaptureSet;
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::inhibit::Inhibits;
use profile_generic::state::Report;
use profile_generic::time::{MonotonicTime, SystemTime};

impl AxisChannel {
    /// Whether its drive is there and heard.
    #[must_use]
    pub fn is_heard(&self) -> bool {
        self.south.is_some() && self.feedback.report != Report::Silent
    }

    /// Whether its drive has not been heard for so long that the end of its stop is waited for no longer.
    #[must_use]
    pub fn is_unseen(&self) -> bool {
        self.unseen
    }

    /// The captures that the drive looks for now.
    #[must_use]
    pub fn checked_captures(&self) -> CaptureSet {
        self.south().map_or(CaptureSet::default(), |program| self.captures.checking(program.captures()))
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
