//! Targets that a drive takes over step by step, as in profile position: new set-point and its acknowledge.
//!
//! ```text
//! Resting --another target--> Placed --drive does not answer--> Asked --it answers--> Released --no more--> Resting
//!                 values in the telegram, no bit          bit           no bit
//! ```
//!
//! The values stand one telegram longer than the bit on either side of it: whatever the drive takes first, it takes them whole.
//! A target that comes meanwhile waits for its turn, only the newest does. A drive that leaves the mode or its operation has
//! forgotten its target, and nothing is handed over to it by itself.

use profile_generic::image::AxisCommand;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

/// How long a drive may take to answer.
pub const HANDSHAKE_TIME_OUT: DurationNs = DurationNs::from_secs(1);

/// Where to, and how.
type Target = (Position, Velocity, Acceleration, Acceleration);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    /// The drive has the target that was handed over last, if there was one.
    #[default]
    Resting,
    Placed,
    Asked,
    Released,
}

/// The targets of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Handshake {
    stage: Stage,
    /// What stands in the telegram.
    placed: Option<Target>,
    since: MonotonicTime,
}

impl Handshake {
    /// Goes on once before each telegram. `answers` is whether the drive, which is in operation and shows a mode that takes
    /// targets over, shows its answer; `None` of any other. Returns `false` when it has taken too long for it.
    pub fn advance(
        &mut self,
        now: MonotonicTime,
        answers: Option<bool>,
        wanted: Option<&AxisCommand>,
    ) -> bool {
        let (Some(answers), Some(wanted)) = (answers, wanted) else {
            *self = Self::default();
            return true;
        };
        let target = target(wanted);
        let next = match (self.stage, answers) {
            (Stage::Resting, _) if self.placed != Some(target) => {
                self.placed = Some(target);
                Stage::Placed
            }
            // What is left of an answer to somebody else goes by itself.
            (Stage::Placed, false) => Stage::Asked,
            (Stage::Asked, true) => Stage::Released,
            (Stage::Released, false) => Stage::Resting,
            (stage, _) => stage,
        };
        if std::mem::replace(&mut self.stage, next) != next {
            self.since = now;
        }
        self.stage == Stage::Resting || now.since(self.since) <= HANDSHAKE_TIME_OUT
    }

    /// Whether the bit stands.
    pub fn is_requested(&self) -> bool {
        self.stage == Stage::Asked
    }

    /// The command with the target whose turn it is.
    pub fn apply(&self, command: &AxisCommand) -> AxisCommand {
        let mut command = *command;
        if let Some((position, velocity, acceleration, deceleration)) = self.placed {
            command.target_position = position;
            command.profile_velocity = velocity;
            command.profile_acceleration = acceleration;
            command.profile_deceleration = deceleration;
        }
        command
    }

    /// Whether the drive has the target that is wanted: before that nothing that it says is about it.
    pub fn is_done(&self, wanted: &AxisCommand) -> bool {
        self.stage == Stage::Resting && self.placed == Some(target(wanted))
    }
}

fn target(command: &AxisCommand) -> Target {
    let AxisCommand { target_position, profile_velocity, profile_acceleration, profile_deceleration, .. } =
        *command;
    (target_position, profile_velocity, profile_acceleration, profile_deceleration)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn to(position: i64) -> AxisCommand {
        AxisCommand { target_position: Position(position), ..AxisCommand::default() }
    }

    const AT: fn(i64) -> MonotonicTime = |ms| MonotonicTime::ZERO + DurationNs::from_millis(ms);

    #[test]
    fn a_target_stands_before_the_bit_and_until_the_answer_is_gone() {
        let mut unit = Handshake::default();
        let mut steps = Vec::new();
        // The drive answers two telegrams late, both ways; another target comes while the first one is handed over.
        let shown = [false, false, false, true, true, false, false, false, true, false, false];
        for (step, answers) in (0_i64..).zip(shown) {
            let wanted = to(if step < 3 { 7 } else { 9 });
            assert!(unit.advance(AT(step), Some(answers), Some(&wanted)));
            steps.push((
                unit.is_requested(),
                unit.apply(&wanted).target_position.get(),
                unit.is_done(&wanted),
            ));
        }
        let expected = [
            (false, 7, false),
            (true, 7, false),
            (true, 7, false),
            (false, 7, false),
            (false, 7, false),
            (false, 7, false),
            (false, 9, false),
            (true, 9, false),
            (false, 9, false),
            (false, 9, true),
            (false, 9, true),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn an_answer_to_somebody_else_is_waited_for() {
        let mut unit = Handshake::default();
        for step in 0..5 {
            assert!(unit.advance(AT(step), Some(true), Some(&to(1))));
            assert!(!unit.is_requested());
        }
        unit.advance(AT(5), Some(false), Some(&to(1)));
        assert!(unit.is_requested());
    }

    #[test]
    fn a_drive_that_does_not_answer_is_told_of_and_one_that_leaves_forgets() {
        let mut unit = Handshake::default();
        assert!(unit.advance(AT(0), Some(false), Some(&to(1))));
        assert!(unit.advance(AT(1), Some(false), Some(&to(1))));
        assert!(unit.advance(AT(1_001), Some(false), Some(&to(1))));
        assert!(!unit.advance(AT(1_002), Some(false), Some(&to(1))));
        assert!(unit.advance(AT(1_003), None, Some(&to(1))));
        assert!(!unit.is_requested() && !unit.is_done(&to(1)));
        assert!(unit.advance(AT(1_004), Some(false), None), "nothing is wanted");
        assert_eq!(unit.apply(&to(3)), to(3));
    }
}
