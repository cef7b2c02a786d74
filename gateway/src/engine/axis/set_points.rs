//! From the set-points of the north side to the command of a cycle: what was taken, the interpolator, trims and the guard.

use profile_generic::fault::FaultCause;
use profile_generic::image::{AxisCommand, AxisFeedback, FeedbackSet};
use profile_generic::interpolation::{
    FineInterpolator, InterpolatorConfig, MAX_EXTRAPOLATION, MAX_GAP, Motion, Quality, TargetUpdate,
    UpdateError,
};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Quantity, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::guard::{Bounds, Finding, Guard, Lead, Trip};
use super::ramp::Ramp;
use super::trim::Trims;
use super::{Limits, Loss, MODE_TIME_OUT};
use crate::engine::cyclic::Cycle;

/// How a north side sends its set-points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Updates {
    /// Time between two of them: above zero, at most [`MAX_PERIOD`](profile_generic::interpolation::MAX_PERIOD).
    pub period: DurationNs,
    /// How many may be missed before the command counts as lost; more than [`MAX_EXTRAPOLATION`] are that many.
    pub may_miss: u32,
    /// When they are meant, until they say it themselves.
    pub first: TargetUpdate,
}

/// When set-points shall be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// At this instant, on the way that the north side wants.
    At(MonotonicTime, TargetUpdate),
    /// North side and drives share no clock: as soon as the interpolator can, for an update of this instant of the north side's update
    /// clock.
    Paced(MonotonicTime),
}

/// Set-points of a north side, in generic units.
#[derive(Debug, Clone, Copy)]
pub struct NorthPoints {
    /// Mode, set-points and offsets.
    pub command: AxisCommand,
    /// Another number for every fresh set of them.
    pub sequence: u32,
    /// When they shall be reached.
    pub target: Target,
    /// Values that were clamped on the way.
    pub saturated: u32,
    /// Values that could not be converted.
    pub unusable: u32,
    /// The position was put together from parts that can be of two updates.
    pub is_counted: bool,
}

/// The set-points of one axis.
#[derive(Debug, Default)]
pub(super) struct SetPoints {
    /// Nanounits in a count of the north side: it cannot command anything finer.
    pub count: i64,
    interpolator: Option<FineInterpolator>,
    /// Set-points of this number were taken.
    sequence: Option<u32>,
    pub trims: Trims,
    /// The speed at which the axis was started on the move, until its first set-points.
    pub caught: Option<Velocity>,
    /// The instant of the grid that the last command is for.
    acts_at: MonotonicTime,
    /// By how much the last cycle was late.
    late: DurationNs,
    /// How far set-points are ahead of the moment at which they are made.
    ahead: DurationNs,
    guard: Guard,
    /// Since when the drive in operation shows another operating mode than it is told.
    other_mode_since: Option<MonotonicTime>,
    /// Set-points taken.
    pub commands: u64,
    /// Values of set-points that were clamped.
    pub saturated: u32,
}

/// What the interpolator goes on from: the command before, and how the axis moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// The command that these set-points follow.
    pub command: AxisCommand,
    /// Set-points have led the axis until now, and not the drive.
    pub led: bool,
    /// They are the first after a start.
    pub first: bool,
}

/// Where the axis is, when that is known.
fn place(feedback: &AxisFeedback) -> Option<Position> {
    feedback.present.contains(FeedbackSet::POSITION).then_some(feedback.position)
}

impl SetPoints {
    /// None yet, of a north side that commands as finely as the model.
    pub fn new() -> Self {
        Self { count: 1, ..Self::default() }
    }

    /// The instant of the grid that the last command is for.
    pub fn acts_at(&self) -> MonotonicTime {
        self.acts_at
    }

    /// Whether set-points of this number were taken.
    pub fn has_taken(&self, sequence: u32) -> bool {
        self.sequence == Some(sequence)
    }

    /// Whether any were taken since the start.
    pub fn any(&self) -> bool {
        self.sequence.is_some()
    }

    /// Set-points of this number are taken; whether they are the first.
    pub fn take(&mut self, sequence: u32) -> bool {
        self.sequence.replace(sequence).is_none()
    }

    /// The next ones are the first.
    pub fn end(&mut self) {
        self.sequence = None;
    }

    /// Whether set-points in this mode would be the first ones after a start or a change of mode, after this command.
    pub fn begins(&self, command: &AxisCommand, selection: ModeSelection) -> bool {
        self.sequence.is_none() || command.selection() != selection
    }

    pub fn count_saturated(&mut self, count: u32) {
        self.saturated = self.saturated.saturating_add(count);
    }

    pub fn count_command(&mut self) {
        self.commands = self.commands.saturating_add(1);
    }

    // ---- interpolation -----------------------------------------------------------------------------------------

    /// Time between two updates; zero while none is known.
    pub fn period(&self) -> Option<DurationNs> {
        self.interpolator.as_ref().map(|known| known.config().period)
    }

    /// Fine interpolation for updates like these, in the way the last one asked for.
    pub fn keep_updates(&mut self, updates: Updates, feedback: &AxisFeedback) {
        let Updates { period, may_miss, first } = updates;
        let target_update = match &mut self.interpolator {
            Some(present) if present.config().period == period => return present.set_extrapolation(may_miss),
            Some(present) => present.config().target_update,
            None => first,
        };
        self.interpolator = FineInterpolator::new(InterpolatorConfig {
            target_update,
            period,
            extrapolate_periods: may_miss.min(MAX_EXTRAPOLATION),
        });
        self.start(feedback);
    }

    /// The interpolator begins where the axis is.
    pub fn start(&mut self, feedback: &AxisFeedback) {
        if let Some(interpolator) = self.interpolator.as_mut() {
            interpolator.start(place(feedback));
        }
    }

    /// When these set-points shall be reached, and on which way.
    pub fn target(&self, target: Target) -> (TargetUpdate, MonotonicTime) {
        match target {
            Target::At(at, update) => (update, at),
            // A period later than the drives could have it at the earliest: by then they can have the next one.
            Target::Paced(paced_at) => {
                (TargetUpdate::Interpolate, paced_at + self.ahead + self.period().unwrap_or_default())
            }
        }
    }

    /// Hands set-points to the interpolator.
    ///
    /// # Errors
    /// The command counts as lost, or steps by more than a drive of its kind can follow.
    pub fn interpolate(
        &mut self,
        now: MonotonicTime,
        fresh: &AxisCommand,
        before: &Before,
        feedback: &AxisFeedback,
        (target_update, target): (TargetUpdate, Option<MonotonicTime>),
    ) -> Result<(), Loss> {
        let actual = self.actual_motion(&before.command, feedback);
        let other_mode = before.command.selection() != fresh.selection();
        self.count_command();
        let acts_at = self.acts_at;
        let interpolator = self.interpolator.as_mut().ok_or(Loss::NoPeriod)?;
        let period = interpolator.config().period;
        let target = target.unwrap_or_else(|| target_update.target(now, period));
        // The interpolator compares targets with each other; the first one has none before it.
        if target.since(now + self.ahead) > period * MAX_GAP {
            return Err(Loss::Update(UpdateError::Ahead { target }));
        }
        if before.first {
            match self.caught.take() {
                // From the speed that it has, as the ramp generator would begin there (clause 5-2.6.5.4).
                Some(velocity) => interpolator.start_moving(acts_at, &Motion { velocity, ..actual }),
                None => interpolator.start(place(feedback).map(|_| actual.position)),
            }
        } else if !before.led {
            // The drive has led the axis by itself: what was sent before that leads nowhere.
            interpolator.start_moving(acts_at, &actual);
        }
        if other_mode || interpolator.config().target_update != target_update {
            // On the move the new command begins where the old one has led the axis.
            interpolator.change(acts_at, target_update, (before.command.mode, fresh.mode), &actual);
        }
        match interpolator.update(target, fresh) {
            // Set-points overtaken by newer ones; silence is watched elsewhere.
            Ok(()) | Err(UpdateError::NotNewer { .. }) => Ok(()),
            Err(error) => Err(Loss::Update(error)),
        }
    }

    /// How the axis moves at the instant of its last command, as far as its drive has reported.
    fn actual_motion(&self, command: &AxisCommand, feedback: &AxisFeedback) -> Motion {
        let seen = Motion {
            position: feedback.position,
            velocity: feedback.velocity,
            torque: command.torque,
            ..Motion::default()
        };
        seen.after(self.acts_at.since(feedback.at))
    }

    /// A position that is further from the present command than the axis may move until it is to be reached, and in the period that
    /// the update may have been under way.
    pub fn leaps(
        &self,
        fresh: &AxisCommand,
        here: Position,
        target: MonotonicTime,
        limits: &Limits,
    ) -> Option<Finding> {
        const SECOND: i128 = 1_000_000_000;
        let (limit, period) = (limits.velocity?, self.period()?);
        let span = target.since(self.acts_at).max(DurationNs::ZERO) + period * 2;
        let span = i128::from(span.as_nanos());
        let way = i128::from(fresh.position.get()) - i128::from(here.get());
        // A tenth to spare, as everywhere.
        let beyond = way.abs() * 10 * SECOND > i128::from(limit.get()).abs() * 11 * span;
        let value = i64::try_from(way * SECOND / span.max(1)).unwrap_or(i64::MAX);
        let trip = Trip { quantity: Quantity::Velocity, value, limit: limit.get(), late: self.late };
        beyond.then_some(Finding { cause: FaultCause::VELOCITY_COMMAND_LIMIT, trip })
    }

    /// A position that passes this software limit.
    pub fn beyond(&self, position: Position, limit: Position) -> Finding {
        let (value, limit) = (position.get(), limit.get());
        let trip = Trip { quantity: Quantity::Position, value, limit, late: self.late };
        Finding { cause: FaultCause::POSITION_COMMAND_LIMIT, trip }
    }

    // ---- the command of a cycle --------------------------------------------------------------------------------

    /// A cycle begins; returns the times between its command and the one before: as the grid has it, and at least.
    pub fn begin_cycle(&mut self, cycle: &Cycle) -> (DurationNs, DurationNs) {
        (self.late, self.ahead) = (cycle.late, cycle.ahead);
        let passed = cycle.acts_at.since(std::mem::replace(&mut self.acts_at, cycle.acts_at));
        (passed, passed.max(cycle.span))
    }

    /// Puts the set-points of this cycle into `command`, where they `count`: else time passes for them.
    /// Velocities that are commanded at once go by the `ramp`; a time has `passed` since the last cycle.
    pub fn write(
        &mut self,
        counts: bool,
        (ramp, passed): (&Ramp, DurationNs),
        command: &mut AxisCommand,
    ) -> Option<Quality> {
        let interpolator = self.interpolator.as_mut()?;
        if counts && self.sequence.is_some() {
            let before = command.velocity;
            let quality = interpolator.write_ahead(self.acts_at, self.ahead, command);
            let is_immediate = interpolator.config().target_update == TargetUpdate::Immediate;
            if is_immediate && command.selection() == OperatingMode::Velocity.into() {
                command.velocity = ramp.follow(before, command.velocity, passed);
            }
            return Some(quality);
        }
        interpolator.pass(self.acts_at);
        None
    }

    /// The acceleration of the set-points of this cycle.
    pub fn acceleration(&self) -> Acceleration {
        let interpolator = self.interpolator.as_ref();
        interpolator.map_or(Acceleration::ZERO, |interpolator| interpolator.acceleration(self.acts_at))
    }

    /// Judges the command of this cycle, the last thing before it goes into the telegram.
    pub fn judge(
        &mut self,
        command: &mut AxisCommand,
        lead: Lead,
        actual: Velocity,
        (limits, step): (&Limits, Option<i64>),
        (cycle, elapsed): (DurationNs, DurationNs),
    ) -> Option<Finding> {
        let bounds = Bounds {
            velocity: limits.velocity,
            acceleration: limits.acceleration,
            step,
            cycle,
            elapsed,
            period: self.period().unwrap_or(cycle),
            count: self.count,
        };
        self.guard.judge(command, lead, actual, &bounds, self.late)
    }

    /// A drive that does not come to the operating mode that it is told follows values that are meant for no one. Returns whether it
    /// takes too long; `other` is whether it shows another one.
    pub fn misses_mode(&mut self, now: MonotonicTime, other: bool) -> bool {
        if !other {
            self.other_mode_since = None;
            return false;
        }
        let since = *self.other_mode_since.get_or_insert(now);
        let late = now.since(since) > MODE_TIME_OUT;
        if late {
            self.other_mode_since = None;
        }
        late
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::image::CommandSet;

    const UNIT: i64 = 1_000_000_000;
    const PERIOD: DurationNs = DurationNs::from_millis(4);
    const NO_RAMP: (&Ramp, DurationNs) =
        (&Ramp { positive: None, negative: None, acceleration: None, deceleration: None }, PERIOD);
    const UPDATES: Updates = Updates { period: PERIOD, may_miss: 4, first: TargetUpdate::Interpolate };

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime(1_000_000_000) + DurationNs::from_millis(millis)
    }

    fn feedback(position: i64) -> AxisFeedback {
        AxisFeedback {
            position: Position(position),
            present: FeedbackSet::POSITION,
            ..AxisFeedback::default()
        }
    }

    fn command(position: i64) -> AxisCommand {
        AxisCommand {
            mode: OperatingMode::Position,
            position: Position(position),
            present: CommandSet::POSITION,
            ..AxisCommand::default()
        }
    }

    fn cycle(millis: i64) -> Cycle {
        Cycle {
            acts_at: at(millis),
            late: DurationNs::from_micros(3),
            ahead: DurationNs::from_millis(1),
            span: DurationNs::from_millis(1),
        }
    }

    #[test]
    fn set_points_count_once_and_the_first_are_those_after_an_end_or_in_another_mode() {
        let mut points = SetPoints::new();
        let position = command(0);
        assert!(points.begins(&position, position.selection()) && !points.any());
        assert!(points.take(7));
        assert!(points.has_taken(7) && !points.has_taken(8) && points.any());
        assert!(!points.begins(&position, position.selection()));
        assert!(points.begins(&position, OperatingMode::Velocity.into()), "another mode");
        assert!(!points.take(8));
        points.end();
        assert!(points.take(8), "the first again");
    }

    #[test]
    fn a_command_without_an_update_period_is_lost() {
        let mut points = SetPoints::new();
        let before = Before { command: command(0), led: true, first: true };
        let way = (TargetUpdate::Interpolate, None);
        assert_eq!(points.interpolate(at(0), &command(5), &before, &feedback(0), way), Err(Loss::NoPeriod));
        assert_eq!(points.commands, 1);
        points.keep_updates(UPDATES, &feedback(0));
        assert_eq!(points.period(), Some(PERIOD));
        assert_eq!(points.interpolate(at(0), &command(5), &before, &feedback(0), way), Ok(()));
    }

    #[test]
    fn set_points_too_far_ahead_are_a_lost_command_the_first_ones_too() {
        let mut points = SetPoints::new();
        points.keep_updates(UPDATES, &feedback(0));
        points.begin_cycle(&cycle(0));
        // The cycle is 1 ms ahead, and updates are kept for 16 periods.
        let last = at(1) + PERIOD * MAX_GAP;
        for first in [true, false] {
            let before = Before { command: command(0), led: true, first };
            let mut take = |target: MonotonicTime| {
                let way = (TargetUpdate::Interpolate, Some(target));
                points.interpolate(at(0), &command(5), &before, &feedback(0), way)
            };
            for target in [last + DurationNs(1), at(2_000)] {
                let ahead = UpdateError::Ahead { target };
                assert_eq!(take(target), Err(Loss::Update(ahead)), "first: {first}");
            }
            assert_eq!(take(last), Ok(()), "first: {first}");
        }
    }

    #[test]
    fn a_cycle_gives_the_times_since_the_one_before_and_set_points_only_where_they_count() {
        let mut points = SetPoints::new();
        points.keep_updates(UPDATES, &feedback(0));
        points.begin_cycle(&cycle(0));
        assert_eq!(points.begin_cycle(&cycle(1)), (cycle(0).span, cycle(0).span));
        assert_eq!(points.begin_cycle(&cycle(4)), (DurationNs::from_millis(3), DurationNs::from_millis(3)));
        let mut fine = command(0);
        assert!(points.write(true, NO_RAMP, &mut fine).is_none(), "none were taken");
        points.take(1);
        assert!(points.write(false, NO_RAMP, &mut fine).is_none());
        assert!(points.write(true, NO_RAMP, &mut fine).is_some());
    }

    #[test]
    fn set_points_without_a_shared_clock_are_for_a_period_after_the_earliest_instant() {
        let mut points = SetPoints::new();
        points.keep_updates(UPDATES, &feedback(0));
        points.begin_cycle(&cycle(0));
        assert_eq!(points.target(Target::Paced(at(10))), (TargetUpdate::Interpolate, at(15)));
        let direct = TargetUpdate::ALL[1];
        assert_eq!(points.target(Target::At(at(10), direct)), (direct, at(10)));
    }

    #[test]
    fn a_leap_is_further_than_the_velocity_limit_allows_until_the_target() {
        let mut points = SetPoints::new();
        let limits = Limits { velocity: Some(Velocity(10 * UNIT)), ..Limits::default() };
        assert!(points.leaps(&command(UNIT), Position::ZERO, at(2), &limits).is_none(), "no period");
        points.keep_updates(UPDATES, &feedback(0));
        points.begin_cycle(&cycle(0));
        // 2 ms to the target and two periods of 4 ms: 0.1 units, with a tenth to spare.
        assert!(points.leaps(&command(UNIT * 11 / 100), Position::ZERO, at(2), &limits).is_none());
        let leap = points.leaps(&command(UNIT * 12 / 100), Position::ZERO, at(2), &limits).expect("a leap");
        assert_eq!((leap.cause, leap.trip.value), (FaultCause::VELOCITY_COMMAND_LIMIT, 12 * UNIT));
        assert_eq!(leap.trip.late, DurationNs::from_micros(3));
        assert!(points.leaps(&command(9 * UNIT), Position::ZERO, at(2), &Limits::default()).is_none());
    }

    #[test]
    fn a_drive_in_another_mode_has_its_time_to_come_to_it() {
        let mut points = SetPoints::new();
        assert!(!points.misses_mode(at(0), true));
        assert!(!points.misses_mode(at(0) + MODE_TIME_OUT, true));
        assert!(!points.misses_mode(at(0) + MODE_TIME_OUT, false), "it is there");
        assert!(!points.misses_mode(at(500), true));
        let late = at(500) + MODE_TIME_OUT + DurationNs(1);
        assert!(points.misses_mode(late, true) && !points.misses_mode(late, true), "told once");
    }
}
