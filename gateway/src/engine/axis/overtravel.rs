//! The ends of travel: limit switches, and the software limits of the configuration.
//!
//! A switch or limit that the axis runs onto is a condition: the controller has said what is to
//! be done about it. It is over when the axis is not led any more, or leaves. An axis that was started beyond one may stand
//! there and may be led away from it, and not deeper.

use profile_generic::quantity::{Position, Velocity};

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
pub(super) struct Motion {
    /// It is led by the controller.
    pub led: bool,
    /// It has torque, or has had it in the cycle before.
    pub moves: bool,
    pub position: Position,
    pub velocity: Velocity,
    /// Speed of an axis that stands.
    pub zero_speed: Velocity,
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

impl Motion {
    /// The same where the ends are `checked`; else it counts as one of an axis that nobody leads.
    pub fn counted(&self, checked: bool) -> Self {
        Self { led: self.led && checked, moves: self.moves && checked, ..*self }
    }
}

impl Overtravel {
    /// Whether the axis has run onto the positive and the negative end, or deeper.
    pub fn look(&mut self, [positive, negative]: [bool; 2], motion: &Motion) -> [bool; 2] {
        [self.0[0].look(positive, 1, motion), self.0[1].look(negative, -1, motion)]
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
