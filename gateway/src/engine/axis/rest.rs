//! Whether an axis stands: what the end of the box waits for, and what is done when another master is on the bus.

use super::{AxisChannel, STOP_TIME_OUT};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::image::FeedbackSet;
use profile_generic::quantity::Velocity;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// What the drive tells of the motion of its axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// At most at zero speed.
    Stands,
    /// Faster.
    Moves(Velocity),
    /// It is not heard, or tells no speed.
    Unseen,
}

/// An axis that was stopped and did not come to rest, as far as is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unrested {
    /// Its number.
    pub axis: u8,
    /// The generic state of its drive.
    pub state: DriveState,
    /// Its speed; `None` when its drive is not heard, or does not tell.
    pub velocity: Option<Velocity>,
}

impl AxisChannel {
    /// How long its stop may take by its own limits: to the end of the torque, and from there to rest.
    #[must_use]
    pub fn stop_limit(&self) -> DurationNs {
        let times = &self.stop_settings.times;
        times.stopping_limit.min(STOP_TIME_OUT) + times.coasting_limit.min(STOP_TIME_OUT)
    }

    /// Whether it may have torque, or is on its way to rest without.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.may_have_torque() || self.sequencer.is_stopping()
    }

    /// What is known of its motion.
    #[must_use]
    pub fn rest(&self) -> Rest {
        let heard = self.south.is_some() && self.feedback.report != Report::Silent;
        if !heard || !self.feedback.present.contains(FeedbackSet::VELOCITY) {
            return Rest::Unseen;
        }
        let velocity = self.feedback.velocity;
        let zero_speed = self.stop_settings.times.zero_speed.get().unsigned_abs();
        if velocity.get().unsigned_abs() <= zero_speed { Rest::Stands } else { Rest::Moves(velocity) }
    }

    /// Whether there is nothing to be waited for: it stands without torque, or will not be seen to.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        !self.may_have_torque()
            && match self.rest() {
                Rest::Stands => true,
                Rest::Moves(_) => false,
                // A drive that the box itself has let go of had no torque when it did.
                Rest::Unseen => {
                    let let_go = self.south.is_none() && self.feedback.report != Report::Silent;
                    self.unseen || let_go || !self.sequencer.is_stopping()
                }
            }
    }

    /// What there is to say of it when it is waited for no longer; `None` when it stands without torque.
    #[must_use]
    pub fn unrested(&self, number: usize) -> Option<Unrested> {
        let velocity = match self.rest() {
            Rest::Stands if !self.may_have_torque() => return None,
            Rest::Stands => Some(self.feedback.velocity),
            Rest::Moves(velocity) => Some(velocity),
            Rest::Unseen => None,
        };
        Some(Unrested { axis: u8::try_from(number).unwrap_or(u8::MAX), state: self.state(), velocity })
    }

    /// Another master is on the bus: nobody knows what the drive is told. The axis stops as on a lost command, but holds nothing.
    pub fn doubt_south(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.may_have_torque() {
            let reaction = self.command_loss.max(Reaction::DecelerateAndDisable);
            let fault = Fault::new(FaultCause::SOUTH_SILENCE, system);
            self.raise(now, system, fault.with_reaction(reaction));
        }
    }
}
