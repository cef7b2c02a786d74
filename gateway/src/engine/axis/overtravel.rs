//! The ends of travel: limit switches, and the software limits of the configuration.
//!
//! A switch or limit that the axis runs onto is a condition: the controller has said what is to
//! be done about it. It is over when the axis is not led any more, or leaves. An axis that was started beyond one may stand
//! there and may be led away from it, and not deeper.

use super::{AxisChannel, Limits};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::fault_set::Origin;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::state::DriveState;
use profile_generic::time::SystemTime;

/// Cause and status bit of each end of the way, with the sign of the motion towards it.
const ENDS: [(FaultCause, StatusBits, i64); 2] = [
    (FaultCause::HARDWARE_OVERTRAVEL_POSITIVE, StatusBits::POSITIVE_LIMIT_SWITCH, 1),
    (FaultCause::HARDWARE_OVERTRAVEL_NEGATIVE, StatusBits::NEGATIVE_LIMIT_SWITCH, -1),
];

/// Cause of each software limit, with the sign of the motion towards it.
const SOFTWARE_ENDS: [(FaultCause, i64); 2] =
    [(FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE, 1), (FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE, -1)];

/// An axis at zero speed may go deeper by what it makes in such a part of a second: it never stands quite still.
const REST: i64 = 10;

/// What is known of one end of the way.
#[derive(Debug, Clone, Copy, Default)]
struct End {
    /// The switch is active.
    active: bool,
    /// The farthest out that the axis has been since.
    outermost: Position,
    /// The axis has run onto it, or deeper.
    there: bool,
}

/// What is known of both ends.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Overtravel([End; 2]);

/// What an axis does.
#[derive(Debug, Clone, Copy)]
struct Motion {
    /// It is led by the controller.
    led: bool,
    /// It has torque, or has had it in the cycle before.
    moves: bool,
    position: Position,
    velocity: Velocity,
    /// Speed of an axis that stands.
    zero_speed: Velocity,
}

impl End {
    /// Whether the axis has run onto the switch, or deeper; `sign` is that of the motion towards it.
    fn look(&mut self, active: bool, sign: i64, motion: &Motion) -> bool {
        let zero_speed = motion.zero_speed.get().saturating_abs();
        let inward = motion.velocity.get().saturating_mul(sign);
        let depth = |of: Position| motion.position.get().saturating_sub(of.get()).saturating_mul(sign);
        let hit = active && !self.active;
        if hit || !motion.led || depth(self.outermost) < 0 {
            self.outermost = motion.position;
        }
        self.active = active;
        let deeper = inward > zero_speed || depth(self.outermost) > zero_speed / REST;
        let leaves = inward < -zero_speed;
        let stays = motion.led && (self.there || deeper);
        self.there = active && !leaves && (motion.moves && hit || stays);
        self.there
    }
}

impl AxisChannel {
    /// Whether the controller wants limit switches checked that the drive does not tell.
    #[must_use]
    pub fn misses_limit_switches(&self) -> bool {
        self.stop_settings.checks_overtravel
            && self.south().is_some_and(|program| !program.knows_status(StatusBits::LIMIT_SWITCHES))
    }

    /// Whether the axis may be moving.
    pub(super) fn may_move(&self) -> bool {
        matches!(
            self.state(),
            DriveState::Operating | DriveState::Testing | DriveState::Stopping | DriveState::FaultReaction
        )
    }

    /// Looks at the limit switches. `moved` is whether the axis could move before the drive has spoken: a drive that stops by
    /// itself tells the switch and its fault at once.
    pub(super) fn watch_limit_switches(&mut self, system: SystemTime, moved: bool) {
        let status = self.feedback.status;
        // A drive that homes looks for the switches, and turns round at them.
        let checked = self.stop_settings.checks_overtravel
            && status.contains(StatusBits::LIMIT_SWITCHES)
            && self.command.mode != OperatingMode::Homing;
        let motion = Motion {
            led: checked && matches!(self.state(), DriveState::Operating | DriveState::Testing),
            moves: checked && (moved || self.may_move()),
            position: self.feedback.position,
            velocity: self.feedback.velocity,
            zero_speed: self.stop_settings.times.zero_speed,
        };
        for (end, (cause, bit, sign)) in self.overtravel.0.iter_mut().zip(ENDS) {
            if end.look(status.contains(bit), sign, &motion) {
                self.faults.raise(Fault::new(cause, system), Origin::Watch);
            } else {
                self.faults.clear(cause, Origin::Watch);
            }
        }
    }
}

impl AxisChannel {
    /// Looks at the software limits as at limit switches.
    pub(super) fn watch_software_limits(&mut self, system: SystemTime, moved: bool) {
        let Limits { position_min, position_max, .. } = self.limits;
        // Before its homing is done nobody knows where the axis is.
        let known = self.command.mode != OperatingMode::Homing;
        let position = self.feedback.position;
        let motion = Motion {
            led: known && matches!(self.state(), DriveState::Operating | DriveState::Testing),
            moves: known && (moved || self.may_move()),
            position,
            velocity: self.feedback.velocity,
            zero_speed: self.stop_settings.times.zero_speed,
        };
        let beyond = [
            position_max.is_some_and(|limit| position > limit),
            position_min.is_some_and(|limit| position < limit),
        ];
        for ((end, (cause, sign)), beyond) in
            self.software_overtravel.0.iter_mut().zip(SOFTWARE_ENDS).zip(beyond)
        {
            if end.look(beyond, sign, &motion) {
                self.faults.raise(Fault::new(cause, system), Origin::Watch);
            } else {
                self.faults.clear(cause, Origin::Watch);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOW: i64 = 100;

    fn motion(led: bool, position: i64, velocity: i64) -> Motion {
        Motion {
            led,
            moves: led,
            position: Position(position),
            velocity: Velocity(velocity),
            zero_speed: Velocity(SLOW),
        }
    }

    #[test]
    fn running_onto_a_switch_counts_until_the_axis_leaves_it_or_is_not_led() {
        for sign in [1, -1] {
            let mut end = End::default();
            let mut look = |active, led, position: i64, velocity: i64| {
                end.look(active, sign, &motion(led, sign * position, sign * velocity))
            };
            assert!(!look(false, true, 1_000, 500));
            assert!(look(true, true, 1_100, 500), "onto it");
            assert!(look(true, true, 1_200, 0), "it stands there");
            assert!(!look(true, true, 1_100, -500), "on the way out");
            assert!(!look(true, true, 1_100, 0), "and stands");
            assert!(look(true, true, 1_200, 500), "deeper");
            assert!(!look(true, false, 1_200, 500), "without torque");
            assert!(!look(false, true, 900, 0));
            // A touch, however slow.
            assert!(look(true, true, 1_000, 1));
        }
    }

    #[test]
    fn an_axis_that_starts_on_a_switch_may_stand_and_leave_and_not_creep_deeper() {
        let mut end = End::default();
        let mut look = |led, position, velocity| end.look(true, 1, &motion(led, position, velocity));
        assert!(!look(false, 1_000, 0));
        assert!(!look(true, 1_000, 0) && !look(true, 1_010, 10) && !look(true, 990, -10), "it trembles");
        assert!(look(true, 1_001, 10), "deeper than it has been: {}", SLOW / REST);
        assert!(!look(false, 1_001, 0) && !look(true, 1_001, 0), "from there again");
        assert!(!look(true, 500, -400), "out");
        assert!(!look(true, 505, 50) && look(true, 511, 50), "and in again, slowly");
    }
}
