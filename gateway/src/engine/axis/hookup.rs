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
use profile_generic::time::{DurationNs, MonotonicTime};

use super::START_TIME_OUT;

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
struct TestRun {
    order: TestOrder,
    since: MonotonicTime,
    last: MonotonicTime,
    start: Option<Position>,
    lead: Option<HookupMove>,
    report: Option<TestReport>,
}

/// The hookup test that the controller has asked for.
#[derive(Debug, Default)]
pub(super) struct HookupUnit(Option<TestRun>);

/// The torque of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TestStep {
    pub torque: Torque,
    /// The move is over: the drive stops in this very cycle.
    pub ends: bool,
}

impl TestStep {
    const IDLE: Self = Self { torque: Torque::ZERO, ends: false };
    const END: Self = Self { torque: Torque::ZERO, ends: true };
}

impl HookupUnit {
    /// Takes the order of the north side; `None` ends a test in progress. `able` is whether the axis may be moved by one.
    pub fn take(&mut self, now: MonotonicTime, order: Option<TestOrder>, able: bool) {
        let Some(order) = order else {
            self.0 = None;
            return;
        };
        if self.0.is_some_and(|test| test.order.id == order.id) {
            return;
        }
        self.0 = Some(TestRun { order, since: now, last: now, start: None, lead: None, report: None });
        if order.test.is_active() && !able {
            self.end(TestResult::Faulted, false);
        }
    }

    /// Whether a test that needs torque is under way.
    pub fn needs_torque(&self) -> bool {
        self.0.is_some_and(|test| test.order.test.is_active() && test.report.is_none())
    }

    /// The end of the test, once it has ended.
    pub fn report(&self) -> Option<TestReport> {
        self.0.and_then(|test| test.report)
    }

    fn end(&mut self, result: TestResult, negative: bool) {
        if let Some(test) = self.0.as_mut().filter(|test| test.report.is_none()) {
            test.report = Some(TestReport { id: test.order.id, result, negative });
        }
    }

    /// Goes on with the test. `led` is whether the drive is in the test, with its brake open.
    pub fn step(
        &mut self,
        now: MonotonicTime,
        feedback: &AxisFeedback,
        settings: Option<HookupSettings>,
        led: bool,
    ) -> TestStep {
        let Some(test) = self.0.filter(|test| test.report.is_none()) else { return TestStep::IDLE };
        let known = feedback.fresh && feedback.present.contains(FeedbackSet::POSITION);
        let position = known.then_some(feedback.position);
        let Some(settings) = settings else {
            self.end(TestResult::Faulted, false);
            return TestStep::IDLE;
        };
        match test.order.test {
            Test::Feedback => {
                self.watch_feedback(now, &test, position, settings.nanounits(test.order.distance));
                TestStep::IDLE
            }
            // Not before the brake is open.
            Test::MotorFeedback if led => self.lead_motor(now, feedback, test, position, &settings),
            Test::MotorFeedback => {
                // Not there yet. The start has a time limit of its own; this one is for a start that never began.
                if now.since(test.since) > START_TIME_OUT {
                    self.end(TestResult::TimedOut, false);
                }
                TestStep::IDLE
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
        if let Some(test) = self.0.as_mut() {
            test.start = start;
        }
        let moved = position.zip(start).map_or(0, |(position, start)| position.saturating_sub(start).0);
        if moved.unsigned_abs() >= distance.0.unsigned_abs().max(1) {
            self.end(TestResult::Successful, moved < 0);
        } else if now.since(test.since) > TIME_LIMIT {
            self.end(TestResult::TimedOut, false);
        }
    }

    fn lead_motor(
        &mut self,
        now: MonotonicTime,
        feedback: &AxisFeedback,
        mut test: TestRun,
        position: Option<Position>,
        settings: &HookupSettings,
    ) -> TestStep {
        let span = now.since(test.last).min(SPAN_MAX);
        test.last = now;
        if test.lead.is_none()
            && let Some(position) = position
        {
            test.lead = motion(&test.order, settings, position);
            if test.lead.is_none() {
                self.end(TestResult::Faulted, false);
                return TestStep::END;
            }
        }
        let progress = match test.lead.as_mut() {
            Some(lead) => lead.step(span, seen(feedback)),
            None if now.since(test.since) > TIME_LIMIT => Progress::Ended(Outcome::NoMotion),
            None => Progress::Torque(Torque::ZERO),
        };
        self.0 = Some(test);
        let outcome = match progress {
            Progress::Torque(torque) => return TestStep { torque, ends: false },
            Progress::Ended(outcome) => outcome,
        };
        match outcome {
            Outcome::Done { negative } => self.end(TestResult::Successful, negative == Some(true)),
            Outcome::NoMotion => self.end(TestResult::NoFeedback, false),
            Outcome::TimedOut => self.end(TestResult::TimedOut, false),
            Outcome::TooFast => self.end(TestResult::Faulted, false),
        }
        TestStep::END
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

    const NOW: MonotonicTime = MonotonicTime(1_000_000_000);

    fn order(id: u32, test: Test) -> TestOrder {
        TestOrder { id, test, distance: 1.0, time: 0.0 }
    }

    fn at(position: i64) -> AxisFeedback {
        let present = FeedbackSet::POSITION;
        AxisFeedback { fresh: true, present, position: Position(position), ..AxisFeedback::default() }
    }

    #[test]
    fn a_feedback_test_ends_with_its_distance_and_has_no_torque() {
        let settings = Some(HookupSettings::new(UnitKind::Rotary, None, None));
        let mut unit = HookupUnit::default();
        unit.take(NOW, Some(order(4, Test::Feedback)), false);
        assert!(!unit.needs_torque());
        for position in [500, 500 - NANO + 1] {
            assert_eq!(unit.step(NOW, &at(position), settings, false), TestStep::IDLE);
            assert_eq!(unit.report(), None, "{position}");
        }
        unit.step(NOW, &at(500 - NANO), settings, false);
        let report = unit.report().expect("a report");
        assert_eq!((report.id, report.result, report.negative), (4, TestResult::Successful, true));
        unit.take(NOW, None, false);
        assert_eq!(unit.report(), None, "gone with its order");
    }

    #[test]
    fn a_motor_test_needs_an_axis_that_is_able_and_a_start_that_begins() {
        let settings = Some(HookupSettings::new(UnitKind::Rotary, None, None));
        let result = |unit: &HookupUnit| unit.report().map(|report| report.result);
        let mut unit = HookupUnit::default();
        unit.take(NOW, Some(order(1, Test::MotorFeedback)), false);
        assert_eq!((result(&unit), unit.needs_torque()), (Some(TestResult::Faulted), false));
        unit.take(NOW, Some(order(2, Test::MotorFeedback)), true);
        assert!(unit.needs_torque());
        unit.take(NOW + START_TIME_OUT, Some(order(2, Test::MotorFeedback)), true);
        let late = NOW + START_TIME_OUT + DurationNs(1);
        assert_eq!(unit.step(late, &at(0), settings, false), TestStep::IDLE);
        assert_eq!(result(&unit), Some(TestResult::TimedOut), "the same order does not begin anew");
    }

    #[test]
    fn a_motor_that_cannot_be_seen_ends_its_test_and_stops_the_drive() {
        let settings = Some(HookupSettings::new(UnitKind::Rotary, None, None));
        let mut unit = HookupUnit::default();
        unit.take(NOW, Some(order(1, Test::MotorFeedback)), true);
        let blind = AxisFeedback::default();
        assert_eq!(unit.step(NOW, &blind, settings, true), TestStep::IDLE);
        let late = NOW + TIME_LIMIT + DurationNs(1);
        assert_eq!(unit.step(late, &blind, settings, true), TestStep::END);
        assert_eq!(unit.report().map(|report| report.result), Some(TestResult::NoFeedback));
        assert_eq!(unit.step(late, &blind, settings, true), TestStep::IDLE, "once");
    }
}
