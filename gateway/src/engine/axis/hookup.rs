//! The hookup tests of an axis: what the north side orders, carried out between the cycles of the drive.
//!
//! The motor and feedback test runs in torque control ([`HookupMove`]) and only while the drive says that it is in torque
//! control; the feedback test only watches. Either is gone the moment its order is.

use profile_generic::cast;
use profile_generic::hookup::{
    Goal, HookupLimits, HookupMove, Outcome, Progress, Test, TestOrder, TestReport, TestResult,
};
use profile_generic::image::{AxisFeedback, FeedbackSet};
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::sequence::SequenceStep;
use profile_generic::state::{DriveState, Event};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::{AxisChannel, START_TIME_OUT};

/// Longest duration of a test; the standard speaks of 30 s.
const TIME_LIMIT: DurationNs = DurationNs::from_secs(30);

/// Largest torque, parts per million of rated torque.
const TORQUE: Torque = Torque(200_000);

/// Growth of the torque in a second, parts per million.
const TORQUE_RATE: Torque = Torque(100_000);

/// In how many seconds the distance may be gone at the earliest.
const DISTANCE_TIME: i64 = 2;

/// Longest time between two cycles in which the torque grows; beyond, the box was busy elsewhere.
const SPAN_MAX: DurationNs = DurationNs::from_millis(20);

/// What the hookup tests of an axis may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HookupSettings {
    /// Nanounits in the unit of Test Distance: a revolution, or a metre of a linear axis (Table 5-2.94).
    pub nanounits_per_unit: i64,
    /// Highest speed.
    pub speed: Velocity,
    /// Largest torque, above 0.
    pub torque: Torque,
}

impl HookupSettings {
    /// Gentle values for an axis of this kind, within the limits that are configured for it.
    #[must_use]
    pub fn new(kind: UnitKind, velocity: Option<Velocity>, torque: Option<Torque>) -> Self {
        let (nanounits_per_unit, speed) = match kind {
            UnitKind::Rotary => (NANO, Velocity(NANO / 2)),
            UnitKind::Linear => (1_000 * NANO, Velocity(20 * NANO)),
        };
        let tenth = velocity.map(|limit| Velocity((limit.0.saturating_abs() / 10).max(1)));
        Self {
            nanounits_per_unit,
            speed: tenth.map_or(speed, |tenth| tenth.min(speed)),
            torque: torque.map_or(TORQUE, |limit| Torque(limit.0.saturating_abs()).min(TORQUE)),
        }
    }

    fn nanounits(&self, distance: f32) -> Position {
        Position(cast::i64_from_f64(f64::from(distance) * cast::f64_from_i64(self.nanounits_per_unit)))
    }
}

/// A test under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct TestRun {
    order: TestOrder,
    since: MonotonicTime,
    last: MonotonicTime,
    start: Option<Position>,
    lead: Option<HookupMove>,
    report: Option<TestReport>,
}

impl AxisChannel {
    /// Takes the order of the north side, or that there is none any more.
    pub fn take_test(&mut self, now: MonotonicTime, order: Option<TestOrder>) {
        let Some(order) = order else {
            self.test = None;
            return;
        };
        if self.test.is_some_and(|test| test.order.id == order.id) {
            return;
        }
        let fresh = TestRun { order, since: now, last: now, start: None, lead: None, report: None };
        self.test = Some(fresh);
        let able = self.limits.hookup.is_some()
            && self.south().is_some_and(|program| program.has_mode(OperatingMode::Torque));
        if order.test.is_active() && !able {
            self.end_test(TestResult::Faulted, false);
        }
    }

    /// Whether a test that needs torque is under way.
    pub(super) fn tests_with_torque(&self) -> bool {
        self.test.is_some_and(|test| test.order.test.is_active() && test.report.is_none())
    }

    /// The end of the test, once it has ended.
    #[must_use]
    pub fn test_report(&self) -> Option<TestReport> {
        self.test.and_then(|test| test.report)
    }

    fn end_test(&mut self, result: TestResult, negative: bool) {
        if let Some(test) = self.test.as_mut().filter(|test| test.report.is_none()) {
            test.report = Some(TestReport { id: test.order.id, result, negative });
        }
    }

    /// Goes on with the test; returns the torque for this cycle.
    pub(super) fn run_test(&mut self, now: MonotonicTime, system: SystemTime) -> Torque {
        let Some(test) = self.test.filter(|test| test.report.is_none()) else { return Torque::ZERO };
        let known = self.feedback.fresh && self.feedback.present.contains(FeedbackSet::POSITION);
        let position = known.then_some(self.feedback.position);
        let Some(settings) = self.limits.hookup else {
            self.end_test(TestResult::Faulted, false);
            return Torque::ZERO;
        };
        match test.order.test {
            Test::Feedback => {
                self.watch_feedback(now, &test, position, settings.nanounits(test.order.distance));
                Torque::ZERO
            }
            // Not before the brake is open.
            Test::MotorFeedback
                if self.state() == DriveState::Testing && self.sequence_step() == SequenceStep::Running =>
            {
                self.lead_motor(now, system, test, position, &settings)
            }
            Test::MotorFeedback => {
                // Not there yet. The start has a time limit of its own; this one is for a start that never began.
                if now.since(test.since) > START_TIME_OUT {
                    self.end_test(TestResult::TimedOut, false);
                }
                Torque::ZERO
            }
        }
    }

    fn watch_feedback(
        &mut self,
        now: MonotonicTime,
        test: &TestRun,
        position: Option<Position>,
        distance: Position,
    ) {
        let start = test.start.or(position);
        if let Some(test) = self.test.as_mut() {
            test.start = start;
        }
        let moved = position.zip(start).map_or(0, |(position, start)| position.saturating_sub(start).0);
        if moved.unsigned_abs() >= distance.0.unsigned_abs().max(1) {
            self.end_test(TestResult::Successful, moved < 0);
        } else if now.since(test.since) > TIME_LIMIT {
            self.end_test(TestResult::TimedOut, false);
        }
    }

    fn lead_motor(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        mut test: TestRun,
        position: Option<Position>,
        settings: &HookupSettings,
    ) -> Torque {
        let span = now.since(test.last).min(SPAN_MAX);
        test.last = now;
        if test.lead.is_none()
            && let Some(position) = position
        {
            test.lead = motion(&test.order, settings, position);
            if test.lead.is_none() {
                self.finish(now, system, TestResult::Faulted, false);
                return Torque::ZERO;
            }
        }
        let progress = match test.lead.as_mut() {
            Some(lead) => lead.step(span, seen(&self.feedback)),
            None if now.since(test.since) > TIME_LIMIT => Progress::Ended(Outcome::NoMotion),
            None => Progress::Torque(Torque::ZERO),
        };
        self.test = Some(test);
        match progress {
            Progress::Torque(torque) => torque,
            Progress::Ended(outcome) => {
                let (status, negative) = match outcome {
                    Outcome::Done { negative } => (TestResult::Successful, negative == Some(true)),
                    Outcome::NoMotion => (TestResult::NoFeedback, false),
                    Outcome::TimedOut => (TestResult::TimedOut, false),
                    Outcome::TooFast => (TestResult::Faulted, false),
                };
                self.finish(now, system, status, negative);
                Torque::ZERO
            }
        }
    }

    /// The test is over: the drive stops in this very cycle, and the motion device hears of it in the next.
    fn finish(&mut self, now: MonotonicTime, system: SystemTime, result: TestResult, negative: bool) {
        self.end_test(result, negative);
        let transition = self.drive.machine.handle(Event::TestComplete);
        self.follow(now, system, transition);
    }
}

/// What the move goes by; without it there is no torque. A torque has a meaning only for a drive that is in torque control,
/// and a position alone says nothing of the speed at which the torque has to end.
fn seen(feedback: &AxisFeedback) -> Option<(Position, Velocity)> {
    let known = feedback.present.contains(FeedbackSet::POSITION | FeedbackSet::VELOCITY);
    let led = feedback.fresh && known && feedback.mode == OperatingMode::Torque;
    led.then_some((feedback.position, feedback.velocity))
}

/// The move that an order asks for.
fn motion(order: &TestOrder, settings: &HookupSettings, start: Position) -> Option<HookupMove> {
    let (goal, speed) = if order.time > 0.0 {
        let time = cast::i64_from_f64(f64::from(order.time) * 1e9);
        (Goal::Time(DurationNs(time)), settings.speed)
    } else {
        let distance = settings.nanounits(order.distance);
        let speed = Velocity((distance.0 / DISTANCE_TIME).max(1)).min(settings.speed);
        (Goal::Distance(distance), speed)
    };
    let limits = HookupLimits { torque: settings.torque, torque_rate: TORQUE_RATE, speed, time: TIME_LIMIT };
    HookupMove::new(goal, limits, start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_torque_without_a_fresh_position_and_speed_in_torque_control() {
        let good = AxisFeedback {
            fresh: true,
            present: FeedbackSet::POSITION | FeedbackSet::VELOCITY,
            mode: OperatingMode::Torque,
            position: Position(5),
            velocity: Velocity(7),
            ..AxisFeedback::default()
        };
        assert_eq!(seen(&good), Some((Position(5), Velocity(7))));
        assert_eq!(seen(&AxisFeedback { fresh: false, ..good }), None);
        assert_eq!(seen(&AxisFeedback { present: FeedbackSet::POSITION, ..good }), None);
        assert_eq!(seen(&AxisFeedback { present: FeedbackSet::VELOCITY, ..good }), None);
        assert_eq!(seen(&AxisFeedback { mode: OperatingMode::Position, ..good }), None);
    }
}
