//! The profile generator of an axis: set-points every 4 ms on the way to a velocity or a target.

use profile_generic::image::{AxisCommand, CommandSet};
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position};
use profile_generic::time::MonotonicTime;

use crate::engine::axis::AxisChannel;
use crate::engine::local::{MotionProfile, UPDATE_PERIOD};

/// Most set-points computed in one call; after a longer pause the profile continues from now.
const CATCH_UP_MAX: i64 = 4;

pub(super) const POSITION: ModeSelection =
    ModeSelection { mode: OperatingMode::Position, interpolation: InterpolationSource::Controller };
pub(super) const VELOCITY: ModeSelection =
    ModeSelection { mode: OperatingMode::Velocity, interpolation: InterpolationSource::Controller };

/// A profile in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct Generator {
    pub profile: MotionProfile,
    pub mode: ModeSelection,
    next: MonotonicTime,
}

impl Generator {
    /// A profile in this mode from how the axis moves.
    pub fn from_axis(
        now: MonotonicTime,
        axis: &AxisChannel,
        mode: ModeSelection,
        braking: Acceleration,
    ) -> Self {
        let feedback = axis.feedback();
        let profile = if axis.stands() {
            MotionProfile::at_rest(feedback.position)
        } else {
            let first = now + UPDATE_PERIOD * 2;
            let travel =
                i128::from(feedback.velocity.get()) * i128::from(first.since(feedback.at).as_nanos());
            let travel = i64::try_from(travel / 1_000_000_000).unwrap_or(0);
            let position = Position(feedback.position.get().saturating_add(travel));
            MotionProfile::moving(position, feedback.velocity, braking)
        };
        Self { profile, mode, next: now }
    }

    /// The next set-points that are due.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<AxisCommand> {
        if now.since(self.next) > UPDATE_PERIOD * CATCH_UP_MAX {
            self.next = now;
        }
        if now < self.next {
            return None;
        }
        self.profile.step(UPDATE_PERIOD);
        let mut command = AxisCommand {
            position: self.profile.position(),
            velocity: self.profile.velocity(),
            present: if self.mode == POSITION { CommandSet::POSITION } else { CommandSet::VELOCITY },
            target_time: Some(self.next + UPDATE_PERIOD * 2),
            ..AxisCommand::default()
        };
        command.select(self.mode);
        self.next = self.next + UPDATE_PERIOD;
        Some(command)
    }
}
