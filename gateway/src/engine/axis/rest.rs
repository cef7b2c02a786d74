//! Whether an axis stands: what the end of the box waits for, and what is done when another master is on the bus.

use super::AxisChannel;
use crate::engine::notice::axis_number;
use profile_generic::image::FeedbackSet;
use profile_generic::quantity::Velocity;
use profile_generic::state::{DriveState, Report};

/// What the drive tells of the motion of its axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// At most at zero speed.
    Stands,
    /// Faster.
    Moves(Velocity),
    /// It is not heard, or reports no speed.
    Unseen,
}

/// An axis that was stopped and did not come to rest, as far as is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unrested {
    /// Its number.
    pub axis: u8,
    /// The generic state of its drive.
    pub state: DriveState,
    /// Its speed; `None` when its drive is not heard, or does not report.
    pub velocity: Option<Velocity>,
}

/// See [`AxisChannel::rest`].
pub(super) fn rest(axis: &AxisChannel) -> Rest {
    if !axis.is_heard() || !axis.feedback.present.contains(FeedbackSet::VELOCITY) {
        return Rest::Unseen;
    }
    let velocity = axis.feedback.velocity;
    if axis.start_stop.stands(velocity) { Rest::Stands } else { Rest::Moves(velocity) }
}

/// See [`AxisChannel::has_stopped`].
pub(super) fn has_stopped(axis: &AxisChannel) -> bool {
    !axis.may_have_torque()
        && match rest(axis) {
            Rest::Stands => true,
            Rest::Moves(_) => false,
            // A drive that the box itself has let go of had no torque when it did.
            Rest::Unseen => {
                let let_go = axis.south().is_none() && axis.feedback.report != Report::Silent;
                axis.is_unseen() || let_go || !axis.start_stop.is_stopping()
            }
        }
}

/// See [`AxisChannel::unrested`].
pub(super) fn unrested(axis: &AxisChannel, number: usize) -> Option<Unrested> {
    let velocity = match rest(axis) {
        Rest::Stands if !axis.may_have_torque() => return None,
        Rest::Stands => Some(axis.feedback.velocity),
        Rest::Moves(velocity) => Some(velocity),
        Rest::Unseen => None,
    };
    Some(Unrested { axis: axis_number(number), state: axis.state(), velocity })
}
