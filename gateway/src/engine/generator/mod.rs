//! The profile generator: set-points of the gateway itself, for a north that gives targets or velocities instead of set-points.
//!
//! ```text
//! target, velocity --reach--> MotionProfile --every 4 ms--> AxisCommand
//!                  `-> Misfit: the axis cannot or must not
//! ```

mod profile;
mod reach;

pub use self::profile::MotionProfile;
pub(super) use self::reach::{Misfit, acceleration, end_of_travel, has, is_in_position, run_mode, target};

use profile_generic::image::{AxisCommand, CommandSet};
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::axis::{AxisChannel, Updates};

/// Position control with set-points of the gateway.
pub(super) const POSITION: ModeSelection =
    ModeSelection { mode: OperatingMode::Position, interpolation: InterpolationSource::Controller };
/// Velocity control with set-points of the gateway.
pub(super) const VELOCITY: ModeSelection =
    ModeSelection { mode: OperatingMode::Velocity, interpolation: InterpolationSource::Controller };

/// Time between two set-points.
const UPDATE_PERIOD: DurationNs = DurationNs::from_millis(4);

/// How they are handed to the axis.
pub(super) const UPDATES: Updates =
    Updates { period: UPDATE_PERIOD, may_miss: 4, first: TargetUpdate::Interpolate };

/// How long a drive takes to follow a set-point: two periods until its instant, and a few cycles of the bus.
const REACTION: DurationNs = DurationNs::from_millis(16);

/// Most set-points computed in one call; after a longer pause the profile continues from now.
const CATCH_UP_MAX: i64 = 4;

/// How long an axis has to be slower than its standstill speed to count as standing.
const REST_TIME: DurationNs = DurationNs::from_millis(20);

/// A profile in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProfileGenerator {
    pub profile: MotionProfile,
    pub mode: ModeSelection,
    /// Time between two set-points.
    period: DurationNs,
    next: MonotonicTime,
}

/// A set-point that was handed to an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SetPoint {
    /// The instant that it is for.
    pub at: MonotonicTime,
    pub position: Position,
    pub velocity: Velocity,
}

impl ProfileGenerator {
    /// A profile in this mode, from how the axis moves.
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
        Self { profile, mode, period: UPDATE_PERIOD, next: now }
    }

    /// A profile that brakes in this mode, from the last set-point of somebody who has sent one in each `period`. It is the next one of
    /// them: what the axis is to do until then stays as it is.
    pub fn behind(last: &SetPoint, mode: ModeSelection, period: DurationNs, braking: Acceleration) -> Self {
        let profile = MotionProfile::moving(last.position, last.velocity, braking);
        Self { profile, mode, period, next: last.at - period }
    }

    /// Moves at a velocity. In position control it stops at the end of travel; velocity control brakes ahead of it while it runs.
    pub fn run(&mut self, velocity: Velocity, acceleration: Acceleration, end: Option<Position>) {
        let speed = Velocity(velocity.get().saturating_abs());
        match end {
            Some(end) if self.mode == POSITION => self.profile.to_position(end, speed, acceleration),
            _ => self.profile.to_velocity(velocity, acceleration),
        }
    }

    /// The next set-points that are due.
    pub fn poll(&mut self, now: MonotonicTime, axis: &AxisChannel) -> Option<AxisCommand> {
        if now.since(self.next) > self.period * CATCH_UP_MAX {
            self.next = now;
        }
        if now < self.next {
            return None;
        }
        if self.mode == VELOCITY && reach::runs_beyond(axis, self.profile.acceleration(), REACTION) {
            self.profile.brake();
        }
        self.profile.step(self.period);
        let mut command = AxisCommand {
            position: self.profile.position(),
            velocity: self.profile.velocity(),
            present: if self.mode == POSITION { CommandSet::POSITION } else { CommandSet::VELOCITY },
            target_time: Some(self.next + self.period * 2),
            ..AxisCommand::default()
        };
        command.select(self.mode);
        self.next = self.next + self.period;
        Some(command)
    }
}

/// Since when an axis is slower than its standstill speed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Standstill(Option<MonotonicTime>);

impl Standstill {
    /// An axis that was not looked at yet.
    pub const fn new() -> Self {
        Self(None)
    }

    /// Looks at the axis. Call it in every cycle.
    pub fn watch(&mut self, now: MonotonicTime, axis: &AxisChannel) {
        self.0 = axis.stands().then(|| self.0.unwrap_or(now));
    }

    /// Whether the axis stands.
    pub fn is_reached(self, now: MonotonicTime) -> bool {
        self.0.is_some_and(|since| now.since(since) >= REST_TIME)
    }
}
