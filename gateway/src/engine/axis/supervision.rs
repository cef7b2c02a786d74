//! What the gateway watches of an axis by itself: silence of the drive, jumps of the position, ends of travel and limits.

use profile_generic::fault::FaultCause;
use profile_generic::image::{AxisCommand, AxisFeedback, CommandSet, FeedbackSet, StatusBits};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::overtravel::{Motion, Overtravel};
use super::position_jump::Plausibility;
use super::tolerance::ToleranceWatch;
use super::velocimeter::{Accelerometer, Velocimeter};
use super::{Limits, PositionJump, SILENCE_TIME_OUT};

/// Conditions that are watched, each with whether it is there.
pub(super) type Conditions<const N: usize> = [(FaultCause, bool); N];

/// What is watched of one axis.
#[derive(Debug)]
pub(super) struct Supervision {
    pub limits: Limits,
    /// For a drive that reports positions and no velocity.
    velocimeter: Velocimeter,
    /// For a drive that reports no acceleration.
    accelerometer: Accelerometer,
    plausibility: Plausibility,
    switches: Overtravel,
    software_limits: Overtravel,
    pub tolerances: ToleranceWatch,
    /// Since when the drive is not heard.
    silent_since: Option<MonotonicTime>,
    /// Since when it is, and for how long by now.
    heard: Option<(MonotonicTime, DurationNs)>,
    /// That is so long ago that the end of its stop is waited for no longer.
    unseen: bool,
}

impl Supervision {
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            velocimeter: Velocimeter::default(),
            accelerometer: Accelerometer::default(),
            plausibility: Plausibility::default(),
            switches: Overtravel::default(),
            software_limits: Overtravel::default(),
            tolerances: ToleranceWatch::default(),
            silent_since: None,
            heard: None,
            unseen: false,
        }
    }

    /// The drive is another one, or counts from another place.
    pub fn restart(&mut self) {
        self.velocimeter.restart();
        self.accelerometer = Accelerometer::default();
        self.plausibility.restart();
    }

    /// The next position has nothing to do with the last one.
    pub fn restart_plausibility(&mut self) {
        self.plausibility.restart();
    }

    /// Takes what the drive reports in this cycle.
    pub fn hear(&mut self, now: MonotonicTime, report: Report) {
        self.silent_since = (report == Report::Silent).then(|| self.silent_since.unwrap_or(now));
        let since = self.heard.map_or(now, |(since, _)| since);
        self.heard = (report != Report::Silent).then(|| (since, now.since(since)));
    }

    /// How long the drive has been heard without a break.
    pub fn heard_for(&self) -> DurationNs {
        self.heard.map(|(_, time)| time).unwrap_or_default()
    }

    /// Time passes.
    pub fn tick(&mut self, now: MonotonicTime) {
        self.unseen = self.silent_since.is_some_and(|since| now.since(since) > SILENCE_TIME_OUT);
    }

    /// Whether the drive has not been heard for so long that the end of its stop is waited for no longer.
    pub fn is_unseen(&self) -> bool {
        self.unseen
    }

    /// The velocity of a drive that reports none; `None` with its first position.
    pub fn velocity(&mut self, position: Position, at: MonotonicTime) -> Option<Velocity> {
        self.velocimeter.sample(position, at)
    }

    /// The acceleration of a drive that reports none, filtered; `None` with its first velocity.
    pub fn acceleration(
        &mut self,
        velocity: Velocity,
        at: MonotonicTime,
        filter: DurationNs,
    ) -> Option<Acceleration> {
        self.accelerometer.sample(velocity, at, filter)
    }

    /// A position that the axis cannot have come to. `settled` is false while the drive may count from another place at any moment.
    pub fn jump(
        &mut self,
        feedback: &AxisFeedback,
        at: MonotonicTime,
        settled: bool,
    ) -> Option<PositionJump> {
        if !settled {
            self.plausibility.restart();
            return None;
        }
        let known = feedback.present.contains(FeedbackSet::POSITION);
        known.then(|| self.plausibility.judge(feedback.position, at, self.limits.velocity)).flatten()
    }

    /// The limits of an axis that is `led`; `error` is its following error where that counts. The speed that the controller has set a
    /// limit of counts also of an axis that is not led.
    pub fn passed_limits(
        &self,
        feedback: &AxisFeedback,
        led: bool,
        error: Option<Position>,
        of_user: Option<Velocity>,
    ) -> Conditions<3> {
        let speed = feedback.velocity.get().unsigned_abs();
        let too_fast = |limit: Velocity| {
            let limit = limit.get().unsigned_abs();
            speed > limit.saturating_add(limit / 10)
        };
        let beyond_user = |limit: Velocity| {
            feedback.present.contains(FeedbackSet::VELOCITY) && speed > limit.get().unsigned_abs()
        };
        let too_fast = led && self.limits.velocity.is_some_and(too_fast) || of_user.is_some_and(beyond_user);
        let astray =
            |(error, limit): (Position, Position)| error.get().unsigned_abs() > limit.get().unsigned_abs();
        let homing_failed = feedback.status.contains(StatusBits::HOMING_FAILED);
        [
            (FaultCause::MOTOR_OVER_SPEED_USER_LIMIT, too_fast),
            (
                FaultCause::EXCESSIVE_POSITION_ERROR,
                led && error.zip(self.limits.following_error).is_some_and(astray),
            ),
            (FaultCause::HOMING, led && homing_failed),
        ]
    }

    /// The limit switches, where they are `checked`.
    pub fn passed_switches(&mut self, status: StatusBits, checked: bool, motion: &Motion) -> Conditions<2> {
        let motion = motion.counted(checked && status.contains(StatusBits::LIMIT_SWITCHES));
        let switches = [StatusBits::POSITIVE_LIMIT_SWITCH, StatusBits::NEGATIVE_LIMIT_SWITCH];
        let [positive, negative] = self.switches.look(switches.map(|bit| status.contains(bit)), &motion);
        [
            (FaultCause::HARDWARE_OVERTRAVEL_POSITIVE, positive),
            (FaultCause::HARDWARE_OVERTRAVEL_NEGATIVE, negative),
        ]
    }

    /// The software limits, where they are `checked`, as limit switches.
    pub fn passed_software_limits(&mut self, checked: bool, motion: &Motion) -> Conditions<2> {
        let Limits { position_min, position_max, .. } = self.limits;
        let position = motion.position;
        let beyond = [
            position_max.is_some_and(|limit| position > limit),
            position_min.is_some_and(|limit| position < limit),
        ];
        let [positive, negative] = self.software_limits.look(beyond, &motion.counted(checked));
        [
            (FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE, positive),
            (FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE, negative),
        ]
    }

    /// The software limit that a command passes. An axis whose last command was beyond one already, `here`, may stand there, to
    /// a `count`, and come back.
    pub fn position_limit(&self, command: &AxisCommand, here: Position, count: Position) -> Option<Position> {
        let position = command.position;
        let above = |limit: &Position| position > *limit && position > here.saturating_add(count);
        let below = |limit: &Position| position < *limit && position < here.saturating_sub(count);
        let limit = self.limits.position_max.filter(above).or(self.limits.position_min.filter(below));
        limit.filter(|_| command.present.contains(CommandSet::POSITION))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::time::DurationNs;

    const UNIT: i64 = 1_000_000_000;

    fn supervision() -> Supervision {
        Supervision::new(Limits {
            position_min: Some(Position(-UNIT)),
            position_max: Some(Position(UNIT)),
            velocity: Some(Velocity(10 * UNIT)),
            following_error: Some(Position(UNIT / 10)),
            ..Limits::default()
        })
    }

    fn there<const N: usize>(conditions: Conditions<N>) -> Vec<FaultCause> {
        conditions.into_iter().filter(|(_, is_there)| *is_there).map(|(cause, _)| cause).collect()
    }

    #[test]
    fn a_drive_is_unseen_once_it_has_been_silent_for_long() {
        let mut watch = supervision();
        let at = |millis| MonotonicTime(1) + DurationNs::from_millis(millis);
        for (millis, report, unseen) in [
            (0, Report::Silent, false),
            (900, Report::Silent, false),
            (1_000, Report::Silent, false),
            (1_001, Report::Silent, true),
            (1_002, Report::Ready, false),
            (1_003, Report::Silent, false),
            (2_003, Report::Silent, false),
            (2_004, Report::Silent, true),
        ] {
            watch.hear(at(millis), report);
            watch.tick(at(millis));
            assert_eq!(watch.is_unseen(), unseen, "{millis}");
        }
        assert_eq!(watch.heard_for(), DurationNs::ZERO, "it is silent");
        for millis in [3_000, 3_500, 5_250] {
            watch.hear(at(millis), Report::Ready);
        }
        assert_eq!(watch.heard_for(), DurationNs::from_millis(2_250));
    }

    #[test]
    fn limits_count_while_the_axis_is_led() {
        let watch = supervision();
        let fast = AxisFeedback { velocity: Velocity(-11 * UNIT - 1), ..AxisFeedback::default() };
        let passed = |feedback, led, error| there(watch.passed_limits(feedback, led, error, None));
        assert_eq!(passed(&fast, true, None), [FaultCause::MOTOR_OVER_SPEED_USER_LIMIT]);
        assert_eq!(passed(&fast, false, Some(Position(UNIT))), []);
        let even = AxisFeedback { velocity: Velocity(11 * UNIT), ..AxisFeedback::default() };
        assert_eq!(passed(&even, true, Some(Position(UNIT / 10))), []);
        let astray = passed(&even, true, Some(Position(-UNIT / 10 - 1)));
        assert_eq!(astray, [FaultCause::EXCESSIVE_POSITION_ERROR]);
        let failed = AxisFeedback { status: StatusBits::HOMING_FAILED, ..AxisFeedback::default() };
        assert_eq!(passed(&failed, true, None), [FaultCause::HOMING]);
    }

    #[test]
    fn the_speed_of_the_controller_counts_without_torque_too() {
        let watch = supervision();
        let slow = AxisFeedback {
            velocity: Velocity(-3 * UNIT),
            present: FeedbackSet::VELOCITY,
            ..AxisFeedback::default()
        };
        let passed =
            |feedback, limit| there(watch.passed_limits(feedback, false, None, Some(Velocity(limit))));
        assert_eq!(passed(&slow, 3 * UNIT), []);
        assert_eq!(passed(&slow, 3 * UNIT - 1), [FaultCause::MOTOR_OVER_SPEED_USER_LIMIT]);
        let unknown = AxisFeedback { present: FeedbackSet::empty(), ..slow };
        assert_eq!(passed(&unknown, 1), [], "the drive does not report it");
    }

    #[test]
    fn a_command_beyond_a_software_limit_is_one_that_leads_further_out() {
        let watch = supervision();
        let passes = |position: i64, here: i64| {
            let position = Position(position);
            let command = AxisCommand { position, present: CommandSet::POSITION, ..AxisCommand::default() };
            watch.position_limit(&command, Position(here), Position(1_000)).map(Position::get)
        };
        assert_eq!(passes(UNIT, 0), None);
        assert_eq!(passes(UNIT + 1_001, UNIT), Some(UNIT));
        assert_eq!(passes(UNIT + 1_000, UNIT), None, "to a count");
        assert_eq!(passes(2 * UNIT, 3 * UNIT), None, "it comes back");
        assert_eq!(passes(-2 * UNIT, 0), Some(-UNIT));
        let without = AxisCommand { position: Position(9 * UNIT), ..AxisCommand::default() };
        assert_eq!(watch.position_limit(&without, Position::ZERO, Position(1)), None);
    }

    #[test]
    fn a_jump_counts_only_between_two_settled_positions() {
        let mut watch = supervision();
        let at = |millis| MonotonicTime(1) + DurationNs::from_millis(millis);
        let feedback = |position| AxisFeedback {
            position: Position(position),
            present: FeedbackSet::POSITION,
            ..AxisFeedback::default()
        };
        for millis in 0..300 {
            assert_eq!(watch.jump(&feedback(0), at(millis), true), None);
        }
        assert_eq!(watch.jump(&feedback(9 * UNIT), at(301), false), None, "it counts from another place");
        for millis in 302..600 {
            assert_eq!(watch.jump(&feedback(9 * UNIT), at(millis), true), None);
        }
        let jump = watch.jump(&feedback(0), at(600), true).expect("a jump");
        assert_eq!(jump.way, -9 * UNIT);
    }
}
