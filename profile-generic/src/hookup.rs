//! A gentle move that shows which way a feedback counts.
//!
//! [`HookupMove`] leads an axis by torque, not by position: a position loop whose feedback counts the wrong way round
//! runs away with all the torque there is, a small torque cannot. The torque grows slowly from zero until the axis
//! moves, is taken away whenever the axis is as fast as it shall be, and grows again from three quarters of what it was.
//! Nothing but a distance gone, in whichever direction, or the time asked for ends the move well.
//!
//! ```text
//! in every cycle                                     torque        result
//! time asked for is over                             none          Done
//! distance gone                                      none          Done, direction known
//! faster than four times the speed limit              none          TooFast
//! time limit over, nothing has moved                 none          NoMotion
//! time limit over                                    none          TimedOut
//! no fresh actual values                             none          goes on
//! at the speed limit                                 none          goes on, from 3/4 of the torque
//! else                                               grows         goes on
//! ```
//!
//! It holds no load: an axis that gravity moves has to be held or uncoupled by people.

use crate::quantity::{Position, Torque, Velocity};
use crate::time::DurationNs;

/// Part of the distance below which an axis counts as unmoved.
const UNMOVED: i64 = 1_000;

/// When a move has succeeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// So far from where it began, in either direction; above 0.
    Distance(Position),
    /// So long; for an axis whose feedback is not to be judged.
    Time(DurationNs),
}

/// The limits of a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HookupLimits {
    /// Largest torque; its sign is the forward direction.
    pub torque: Torque,
    /// How fast the torque grows, per second, above 0.
    pub torque_rate: Torque,
    /// Speed at which the torque is taken away, above 0. Four times this ends the move.
    pub speed: Velocity,
    /// Longest duration.
    pub time: DurationNs,
}

/// How a move ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The goal is reached. `negative` is the direction in which the feedback counted; `None` if it was not judged.
    Done {
        /// The actual position fell.
        negative: Option<bool>,
    },
    /// The axis did not move although the torque was all there.
    NoMotion,
    /// The axis moved, but not far enough in time.
    TimedOut,
    /// The axis became too fast.
    TooFast,
}

/// What to do in this cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Apply this torque.
    Torque(Torque),
    /// No torque any more.
    Ended(Outcome),
}

/// A move under way.
#[derive(Debug, Clone, Copy)]
pub struct HookupMove {
    goal: Goal,
    limits: HookupLimits,
    start: Position,
    /// Without sign, parts per million.
    torque: i64,
    elapsed: DurationNs,
    /// The torque was taken away for speed and has not grown since.
    cut: bool,
}

impl HookupMove {
    /// A move that begins at `start`. `None` if a limit or the goal is not above 0.
    #[must_use]
    pub fn new(goal: Goal, limits: HookupLimits, start: Position) -> Option<Self> {
        let aim = match goal {
            Goal::Distance(distance) => distance.0,
            Goal::Time(time) => time.0,
        };
        let positive =
            [aim, limits.torque_rate.0, limits.speed.0, limits.time.0].iter().all(|value| *value > 0);
        let torque = limits.torque.0 != 0;
        let cut = false;
        (positive && torque).then_some(Self { goal, limits, start, torque: 0, elapsed: DurationNs(0), cut })
    }

    /// Goes on by `span`. `actual` are position and velocity, `None` in a cycle that brought no fresh ones.
    pub fn step(&mut self, span: DurationNs, actual: Option<(Position, Velocity)>) -> Progress {
        self.elapsed = self.elapsed + span;
        if let Goal::Time(time) = self.goal
            && self.elapsed >= time
        {
            return Progress::Ended(Outcome::Done { negative: None });
        }
        let moved = actual.map(|(position, _)| position.saturating_sub(self.start).0);
        if let (Goal::Distance(distance), Some(moved)) = (self.goal, moved)
            && moved.unsigned_abs() >= distance.0.unsigned_abs()
        {
            return Progress::Ended(Outcome::Done { negative: Some(moved < 0) });
        }
        let speed = actual.map(|(_, velocity)| velocity.0.unsigned_abs());
        let limit = self.limits.speed.0.unsigned_abs();
        if speed.is_some_and(|speed| speed > limit.saturating_mul(4)) {
            return Progress::Ended(Outcome::TooFast);
        }
        if self.elapsed > self.limits.time {
            let unmoved = match self.goal {
                Goal::Distance(distance) => moved
                    .is_none_or(|moved| moved.unsigned_abs() < (distance.0 / UNMOVED).unsigned_abs().max(1)),
                Goal::Time(_) => false,
            };
            return Progress::Ended(if unmoved { Outcome::NoMotion } else { Outcome::TimedOut });
        }
        let Some(speed) = speed else { return Progress::Torque(Torque(0)) };
        if speed >= limit {
            if !self.cut {
                self.cut = true;
                self.torque = self.torque / 4 * 3;
            }
            return Progress::Torque(Torque(0));
        }
        if self.cut && speed >= limit / 2 {
            return Progress::Torque(Torque(0));
        }
        self.cut = false;
        let step = i128::from(self.limits.torque_rate.0) * i128::from(span.0.max(0)) / 1_000_000_000;
        let most = self.limits.torque.0.saturating_abs();
        self.torque = self.torque.saturating_add(i64::try_from(step).unwrap_or(most)).min(most);
        Progress::Torque(Torque(if self.limits.torque.0 < 0 { -self.torque } else { self.torque }))
    }
}

/// A test of the connections of motor and feedback (Hookup Test of CIP Volume 9).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Test {
    /// Moves the axis by torque and looks at its feedback.
    MotorFeedback,
    /// Watches the feedback while somebody else moves the axis.
    Feedback,
}

impl Test {
    /// Whether it needs torque.
    #[must_use]
    pub const fn is_active(self) -> bool {
        matches!(self, Self::MotorFeedback)
    }
}

/// A test that is to be carried out, as long as it is ordered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestOrder {
    /// Another number for every order.
    pub id: u32,
    /// The motor with torque, or the feedback alone.
    pub test: Test,
    /// The distance that ends it, in revolutions or metres.
    pub distance: f32,
    /// The time that ends it, in seconds; 0 where the distance does.
    pub time: f32,
}

/// How a test ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestResult {
    /// The feedback moved as far as it was to.
    Successful,
    /// The motor had torque and the feedback did not move.
    NoFeedback,
    /// It took too long.
    TimedOut,
    /// It could not be carried out, or was too fast.
    Faulted,
}

/// The end of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TestReport {
    /// The order that it belongs to.
    pub id: u32,
    /// How it ended.
    pub result: TestResult,
    /// The feedback moved in negative direction.
    pub negative: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CYCLE: DurationNs = DurationNs::from_millis(1);
    const LIMITS: HookupLimits = HookupLimits {
        torque: Torque(200_000),
        torque_rate: Torque(100_000),
        speed: Velocity(500_000_000),
        time: DurationNs::from_secs(30),
    };
    const TURN: Goal = Goal::Distance(Position(1_000_000_000));

    /// An axis of one inertia with sliding friction; `sign` is how its feedback counts. Units: revolutions, seconds,
    /// parts of rated torque.
    struct Plant {
        position: f64,
        velocity: f64,
        acceleration_at_rated: f64,
        friction: f64,
        load: f64,
        sign: f64,
    }

    impl Plant {
        fn step(&mut self, torque: Torque) {
            let drive = crate::cast::f64_from_i64(torque.0) / 1e6 + self.load;
            let seconds = 1e-3;
            let held = self.velocity == 0.0 && drive.abs() <= self.friction;
            if !held {
                let friction = if self.velocity == 0.0 { drive.signum() } else { self.velocity.signum() };
                let next =
                    self.velocity + (drive - friction * self.friction) * self.acceleration_at_rated * seconds;
                let stops = self.velocity != 0.0 && next.signum() != self.velocity.signum();
                self.velocity = if stops && drive.abs() <= self.friction { 0.0 } else { next };
            }
            self.position += self.velocity * seconds;
        }

        fn actual(&self) -> (Position, Velocity) {
            let nano = |value: f64| crate::cast::i64_from_f64(value * self.sign * 1e9);
            (Position(nano(self.position)), Velocity(nano(self.velocity)))
        }
    }

    /// Runs a move; returns how it ended, after how many cycles, and the greatest speed and torque on the way.
    fn run(goal: Goal, plant: &mut Plant) -> (Outcome, u32, f64, i64) {
        let mut test = HookupMove::new(goal, LIMITS, Position(0)).expect("good limits");
        let (mut fastest, mut most) = (0.0_f64, 0);
        for cycle in 1..40_000 {
            match test.step(CYCLE, Some(plant.actual())) {
                Progress::Ended(outcome) => return (outcome, cycle, fastest, most),
                Progress::Torque(torque) => {
                    most = most.max(torque.0.abs());
                    plant.step(torque);
                }
            }
            fastest = fastest.max(plant.velocity.abs());
        }
        panic!("it never ends");
    }

    fn plant(acceleration_at_rated: f64, friction: f64) -> Plant {
        Plant { position: 0.0, velocity: 0.0, acceleration_at_rated, friction, load: 0.0, sign: 1.0 }
    }

    #[test]
    fn finds_which_way_the_feedback_counts_and_stays_gentle() {
        for sign in [1.0, -1.0] {
            for (acceleration, friction) in [(1_600.0, 0.02), (1_600.0, 0.0), (20.0, 0.05), (400.0, 0.15)] {
                let mut axis = Plant { sign, ..plant(acceleration, friction) };
                let (outcome, cycles, fastest, most) = run(TURN, &mut axis);
                assert_eq!(outcome, Outcome::Done { negative: Some(sign < 0.0) });
                assert!((1_500..25_000).contains(&cycles), "{cycles} at {acceleration} {friction}");
                assert!(fastest < 1.0, "{fastest} at {acceleration} {friction}");
                assert!(most <= LIMITS.torque.0);
            }
        }
    }

    #[test]
    fn ends_by_itself_when_the_axis_cannot_or_does_not_do_what_it_should() {
        let (outcome, cycles, _, most) = run(TURN, &mut plant(1_600.0, 0.5));
        assert_eq!((outcome, cycles, most), (Outcome::NoMotion, 30_001, 200_000));
        // Very heavy: it moves, but not far enough.
        let (outcome, ..) = run(TURN, &mut plant(0.002, 0.0));
        assert_eq!(outcome, Outcome::TimedOut);
        // Dropped by its load: it ends once it is too fast, or has gone the distance, whichever is first.
        let mut falls = Plant { load: -0.5, ..plant(1_600.0, 0.02) };
        assert_eq!(run(TURN, &mut falls).0, Outcome::TooFast);
        assert!(falls.position > -0.01, "{}", falls.position);
        let (outcome, cycles, ..) = run(Goal::Time(DurationNs::from_millis(700)), &mut plant(1_600.0, 0.02));
        assert_eq!((outcome, cycles), (Outcome::Done { negative: None }, 700));
    }

    #[test]
    fn has_no_torque_without_fresh_values_and_the_time_goes_on() {
        let mut test = HookupMove::new(TURN, LIMITS, Position(0)).expect("good limits");
        let rest = Some((Position(0), Velocity(0)));
        for _ in 0..100 {
            test.step(CYCLE, rest);
        }
        assert_eq!(test.step(CYCLE, rest), Progress::Torque(Torque(10_100)));
        assert_eq!(test.step(CYCLE, None), Progress::Torque(Torque(0)));
        let ended = (0..40_000).find_map(|_| match test.step(CYCLE, None) {
            Progress::Ended(outcome) => Some(outcome),
            Progress::Torque(torque) => {
                assert_eq!(torque, Torque(0));
                None
            }
        });
        assert_eq!(ended, Some(Outcome::NoMotion));
    }

    #[test]
    fn refuses_limits_that_are_none() {
        let none = |limits| HookupMove::new(TURN, limits, Position(0)).is_none();
        assert!(none(HookupLimits { torque: Torque(0), ..LIMITS }));
        assert!(none(HookupLimits { speed: Velocity(0), ..LIMITS }));
        assert!(none(HookupLimits { torque_rate: Torque(-1), ..LIMITS }));
        assert!(none(HookupLimits { time: DurationNs(0), ..LIMITS }));
        assert!(HookupMove::new(Goal::Distance(Position(0)), LIMITS, Position(0)).is_none());
    }

    proptest! {
        /// Whatever the feedback says, the torque keeps to its limit and the move to its time.
        #[test]
        fn is_bounded_whatever_comes_back(
            values in proptest::collection::vec(proptest::option::of((any::<i64>(), any::<i64>())), 1..200),
            torque in (1..1_000_000_i64, any::<bool>()),
            span in 1..5_000_000_i64,
        ) {
            let signed = if torque.1 { torque.0 } else { -torque.0 };
            let limits = HookupLimits { torque: Torque(signed), ..LIMITS };
            let mut test = HookupMove::new(TURN, limits, Position(0)).expect("good limits");
            for value in values {
                let actual = value.map(|(position, velocity)| (Position(position), Velocity(velocity)));
                match test.step(DurationNs(span), actual) {
                    Progress::Ended(_) => break,
                    Progress::Torque(given) => {
                        prop_assert!(given.0.abs() <= torque.0);
                        prop_assert!(given.0 == 0 || (given.0 > 0) == torque.1);
                    }
                }
            }
        }
    }
}
