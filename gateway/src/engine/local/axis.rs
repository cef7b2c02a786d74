//! One axis under local control: the order in progress, and the source of its set-points.
//!
//! ```text
//! order    what it does                                completed when
//! enable   waits for a ready drive, then enables it    the axis operates, and the start sequence has ended
//! jog      the profile goes to a velocity              immediately; the axis brakes after JOG_TIME
//! move     profile or drive positioning to a target    the axis stands at the target
//! home     the drive's own homing                      the drive reports that it is homed
//! stop     the profile brakes, or the drive halts      the axis stands
//! disable  the configured stop                         the axis is without torque
//! reset    clears the faults                           there is no fault
//! ```

use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{AxisCommand, CommandSet, StatusBits};
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::sequence::SequenceStep;
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::order::{ClientId, Failure, Generator, Jog, Move, Order};
use super::profile::MotionProfile;
use super::{JOG_TIME, UPDATE_PERIOD, UPDATES};
use crate::engine::axis::{
    AxisChannel, Intent, RESET_TIME_OUT, Reactions, START_TIME_OUT, STOP_TIME_OUT, Wish,
};

/// How long an enable waits for the drive to become ready.
const READY_TIME_OUT: DurationNs = DurationNs::from_secs(2);

/// Longest homing.
const HOMING_TIME_OUT: DurationNs = DurationNs::from_secs(600);

/// How long an axis may take to settle at its target after the end of the profile.
const SETTLE_TIME_OUT: DurationNs = DurationNs::from_secs(5);

/// How long an axis has to be slower than its standstill speed to count as standing.
const REST_TIME: DurationNs = DurationNs::from_millis(20);

/// Largest distance from the target at which a movement counts as completed: a hundredth of a unit, or this part of the following error
/// limit if that is more.
const IN_POSITION: Position = Position(10_000_000);
const IN_POSITION_DIVISOR: i64 = 20;

/// Most set-points computed in one call; after a longer pause the profile continues from now.
const CATCH_UP_MAX: u32 = 4;

const POSITION: ModeSelection =
    ModeSelection { mode: OperatingMode::Position, interpolation: InterpolationSource::Controller };
const VELOCITY: ModeSelection =
    ModeSelection { mode: OperatingMode::Velocity, interpolation: InterpolationSource::Controller };
const POSITIONING: ModeSelection = ModeSelection::by_drive(OperatingMode::Position);
const HOMING: ModeSelection = ModeSelection::by_drive(OperatingMode::Homing);

/// The current time on both clocks.
pub(super) type Now = (MonotonicTime, SystemTime);

/// An order in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) client: ClientId,
    pub(super) id: u32,
    order: Order,
    since: MonotonicTime,
    /// When its decisive step began: the enable request, the start of homing, or the end of the profile.
    begun: Option<MonotonicTime>,
}

/// Where the set-points of an operating axis come from.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// Nowhere yet: it holds the position at which it was enabled.
    None,
    /// The gateway's profile generator, in this mode.
    Profile {
        profile: MotionProfile,
        mode: ModeSelection,
        next: MonotonicTime,
        jog_ends: Option<MonotonicTime>,
    },
    /// The drive itself: positioning or homing.
    Drive,
}

/// Local control of one axis.
#[derive(Debug)]
pub(super) struct LocalAxis {
    /// The client that controls the axis.
    pub(super) holder: Option<ClientId>,
    task: Option<Task>,
    source: Source,
    sequence: u32,
    /// Since when the axis is slower than its standstill speed.
    slow_since: Option<MonotonicTime>,
}

impl LocalAxis {
    pub(super) const fn new() -> Self {
        Self { holder: None, task: None, source: Source::None, sequence: 0, slow_since: None }
    }

    pub(super) const fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// Removes the order in progress.
    pub(super) fn take_task(&mut self) -> Option<Task> {
        self.task.take()
    }

    /// Takes control of the axis for a client.
    pub(super) fn begin(&mut self, client: ClientId, (now, system): Now, axis: &mut AxisChannel) {
        self.holder = Some(client);
        // The drive stops by itself when homing fails; the order reports it, and the axis keeps its torque.
        let mut reactions = Reactions::default();
        reactions.set(FaultCause::HOMING, Reaction::Alarm);
        axis.set_reactions(now, system, &reactions);
        self.source = Source::None;
        axis.set_local_control(true);
        axis.end_set_points();
        axis.keep_updates(UPDATES);
        // A disable ends without torque, whatever Stopping Action a controller had set.
        let mut settings = *axis.stop_settings();
        settings.plan.hold = false;
        axis.set_stop_settings(settings);
    }

    /// Gives up control of the axis; its reactions are those of the faults again.
    pub(super) fn release(&mut self, (now, system): Now, axis: &mut AxisChannel) {
        self.holder = None;
        axis.set_reactions(now, system, &Reactions::default());
        axis.set_local_control(false);
    }

    /// Stops the axis as configured, and removes its torque.
    pub(super) fn disable(&mut self, (now, system): Now, axis: &mut AxisChannel) {
        self.source = Source::None;
        let wish = Wish { intent: Intent::Disable, request: Some(Request::Disable) };
        axis.take_wish(now, system, wish);
        axis.end_set_points();
    }

    /// Starts an order and returns the one that it replaces. The caller has checked that the client may control the axis.
    ///
    /// # Errors
    /// The order is refused; the one in progress continues.
    pub(super) fn take(
        &mut self,
        now: Now,
        axis: &mut AxisChannel,
        (client, id, order): (ClientId, u32, Order),
    ) -> Result<Option<Task>, Failure> {
        match order {
            Order::Enable => {}
            Order::Disable => self.disable(now, axis),
            Order::Stop => self.stop(now, axis),
            Order::Reset => {
                let reset = AxisCommand { request: Some(Request::FaultReset), ..AxisCommand::default() };
                self.send(now, axis, reset);
            }
            Order::Jog(jog) => self.jog(now, axis, jog)?,
            Order::Move(to) => self.go(now, axis, to)?,
            Order::Home => self.home(now, axis)?,
        }
        Ok(self.task.replace(Task { client, id, order, since: now.0, begun: None }))
    }

    /// Sends the set-points that are due, and checks whether the order in progress has completed. Call it in every cycle.
    pub(super) fn advance(
        &mut self,
        now: Now,
        axis: &mut AxisChannel,
    ) -> Option<(Task, Result<(), Failure>)> {
        axis.retry_wish(now.0, now.1);
        if axis.state() != DriveState::Operating {
            self.source = Source::None;
        }
        self.set_points(now, axis);
        let slow = axis.stands();
        self.slow_since = slow.then(|| self.slow_since.unwrap_or(now.0));
        let mut task = self.task?;
        let result = self.progress(now, axis, &mut task);
        self.task = if result.is_some() { None } else { Some(task) };
        result.map(|result| (task, result))
    }

    // ---- orders --------------------------------------------------------------------------------------------------

    fn jog(&mut self, now: Now, axis: &mut AxisChannel, jog: Jog) -> Result<(), Failure> {
        let acceleration = checked_acceleration(axis, jog.velocity, jog.acceleration)?;
        let mode = [POSITION, VELOCITY].into_iter().find(|mode| has(axis, *mode));
        let mode = mode.ok_or(Failure::Mode(POSITION))?;
        let limits = axis.limits();
        let here = axis.feedback().position;
        // Speed zero brakes, wherever the axis is.
        let moves = jog.velocity != Velocity::ZERO;
        let backward = jog.velocity < Velocity::ZERO;
        let limit = if backward { limits.position_min } else { limits.position_max };
        let is_beyond = |limit: &Position| if backward { here < *limit } else { here > *limit };
        if let Some(limit) = limit.filter(|limit| moves && is_beyond(limit)) {
            return Err(Failure::Beyond(limit));
        }
        // The drive may overshoot the profile slightly.
        let end = limit.map(|limit| match backward {
            true => limit.saturating_add(IN_POSITION).min(here),
            false => limit.saturating_sub(IN_POSITION).max(here),
        });
        let speed = Velocity(jog.velocity.get().saturating_abs());
        self.follow_profile(now, axis, mode, acceleration, |profile| match end {
            Some(end) if mode == POSITION && moves => profile.to_position(end, speed, acceleration),
            _ => profile.to_velocity(jog.velocity, acceleration),
        });
        if let Source::Profile { jog_ends, .. } = &mut self.source {
            *jog_ends = Some(now.0 + JOG_TIME);
        }
        Ok(())
    }

    fn go(&mut self, now: Now, axis: &mut AxisChannel, to: Move) -> Result<(), Failure> {
        if to.velocity <= Velocity::ZERO {
            return Err(Failure::NotPositive);
        }
        let acceleration = checked_acceleration(axis, to.velocity, to.acceleration)?;
        let limits = axis.limits();
        let beyond = limits.position_max.filter(|end| to.to > *end);
        if let Some(end) = beyond.or(limits.position_min.filter(|end| to.to < *end)) {
            return Err(Failure::Beyond(end));
        }
        let by_drive = match to.by {
            Some(Generator::Drive) if !has(axis, POSITIONING) => return Err(Failure::Mode(POSITIONING)),
            Some(by) => by == Generator::Drive,
            None => has(axis, POSITIONING),
        };
        if !by_drive {
            if !has(axis, POSITION) {
                return Err(Failure::Mode(POSITION));
            }
            self.follow_profile(now, axis, POSITION, acceleration, |profile| {
                profile.to_position(to.to, to.velocity, acceleration)
            });
            return Ok(());
        }
        let mut command = AxisCommand {
            target_position: to.to,
            profile_velocity: to.velocity,
            profile_acceleration: acceleration,
            profile_deceleration: acceleration,
            present: AxisCommand::PROFILE,
            ..AxisCommand::default()
        };
        command.select(POSITIONING);
        self.source = Source::Drive;
        self.send(now, axis, command);
        Ok(())
    }

    fn home(&mut self, now: Now, axis: &mut AxisChannel) -> Result<(), Failure> {
        check_enabled(axis)?;
        if !has(axis, HOMING) {
            return Err(Failure::Mode(HOMING));
        }
        let mut command = AxisCommand::default();
        command.select(HOMING);
        self.source = Source::Drive;
        self.send(now, axis, command);
        Ok(())
    }

    /// Brings the axis to standstill, and cancels a start in progress.
    fn stop(&mut self, now: Now, axis: &mut AxisChannel) {
        match &mut self.source {
            Source::Profile { profile, jog_ends, .. } => {
                profile.brake();
                *jog_ends = None;
            }
            Source::Drive => {
                let stop = AxisCommand { request: Some(Request::Stop), ..AxisCommand::default() };
                self.send(now, axis, stop);
            }
            Source::None if axis.state() == DriveState::Starting => self.disable(now, axis),
            Source::None => {}
        }
    }

    // ---- set-points ----------------------------------------------------------------------------------------------

    /// Makes the profile generator the source: from its present profile if it runs in this mode, otherwise from the actual motion.
    fn follow_profile(
        &mut self,
        now: Now,
        axis: &AxisChannel,
        mode: ModeSelection,
        acceleration: Acceleration,
        change: impl FnOnce(&mut MotionProfile),
    ) {
        let (mut profile, next) = match self.source {
            Source::Profile { profile, mode: known, next, .. } if known == mode => (profile, next),
            _ => {
                let feedback = axis.feedback();
                let first = now.0 + UPDATE_PERIOD * 2;
                let travel =
                    i128::from(feedback.velocity.get()) * i128::from(first.since(feedback.at).as_nanos());
                let travel = i64::try_from(travel / 1_000_000_000).unwrap_or(0);
                let stands = axis.stands();
                let velocity = if stands { Velocity::ZERO } else { feedback.velocity };
                let position =
                    Position(feedback.position.get().saturating_add(if stands { 0 } else { travel }));
                (MotionProfile::moving(position, velocity, acceleration), now.0)
            }
        };
        change(&mut profile);
        self.source = Source::Profile { profile, mode, next, jog_ends: None };
    }

    fn set_points(&mut self, now: Now, axis: &mut AxisChannel) {
        let Source::Profile { mut profile, mode, mut next, jog_ends } = self.source else { return };
        if jog_ends.is_some_and(|ends| now.0 >= ends) || mode == VELOCITY && runs_beyond(axis) {
            profile.brake();
        }
        if now.0.since(next) > UPDATE_PERIOD * i64::from(CATCH_UP_MAX) {
            next = now.0;
        }
        while now.0 >= next {
            profile.step(UPDATE_PERIOD);
            let mut command = AxisCommand {
                position: profile.position(),
                velocity: profile.velocity(),
                present: if mode == POSITION { CommandSet::POSITION } else { CommandSet::VELOCITY },
                target_time: Some(next + UPDATE_PERIOD * 2),
                ..AxisCommand::default()
            };
            command.select(mode);
            self.send(now, axis, command);
            next = next + UPDATE_PERIOD;
        }
        self.source = Source::Profile { profile, mode, next, jog_ends };
    }

    fn send(&mut self, (now, system): Now, axis: &mut AxisChannel, command: AxisCommand) {
        self.sequence = self.sequence.wrapping_add(1);
        axis.from_north(now, system, &AxisCommand { sequence: self.sequence, ..command });
    }

    // ---- completion of orders -------------------------------------------------------------------------------------

    fn progress(&mut self, now: Now, axis: &mut AxisChannel, task: &mut Task) -> Option<Result<(), Failure>> {
        let fault = axis.fault().filter(|_| !axis.is_diagnosing());
        let fault = fault.map(|fault| Err(Failure::Fault(fault.cause)));
        let waited = now.0.since(task.since);
        match task.order {
            Order::Enable => fault.or_else(|| self.enabling(now, axis, task)),
            Order::Disable => match axis.may_have_torque() {
                false => Some(Ok(())),
                // The axis itself removes the torque when a stop exceeds its time limit.
                true => (waited > STOP_TIME_OUT * 2).then_some(Err(Failure::TimedOut)),
            },
            Order::Reset => match (axis.fault(), axis.state()) {
                (None, state) if state != DriveState::Faulted && state != DriveState::FaultReaction => {
                    Some(Ok(()))
                }
                (fault, state) if waited > STOP_TIME_OUT + RESET_TIME_OUT => {
                    let failure = fault
                        .map_or(Failure::State(state, axis.awaited()), |fault| Failure::Fault(fault.cause));
                    Some(Err(failure))
                }
                _ => None,
            },
            Order::Stop => fault.or_else(|| self.stopping(now, axis, waited)),
            Order::Move(to) => {
                fault.or_else(|| not_enabled(axis)).or_else(|| self.going(now, axis, to, task))
            }
            Order::Home => fault.or_else(|| not_enabled(axis)).or_else(|| self.homing(now, axis, task)),
            Order::Jog(_) => Some(Ok(())),
        }
    }

    fn is_standing(&self, now: MonotonicTime) -> bool {
        self.slow_since.is_some_and(|since| now.since(since) >= REST_TIME)
    }

    fn enabling(&mut self, now: Now, axis: &mut AxisChannel, task: &mut Task) -> Option<Result<(), Failure>> {
        if is_operating(axis) {
            return Some(Ok(()));
        }
        let Some(begun) = task.begun else {
            match axis.state() {
                DriveState::Ready => {
                    task.begun = Some(now.0);
                    axis.take_wish(
                        now.0,
                        now.1,
                        Wish { intent: Intent::Enable, request: Some(Request::Enable) },
                    );
                }
                state if now.0.since(task.since) > READY_TIME_OUT => {
                    return Some(Err(Failure::State(state, axis.awaited())));
                }
                _ => {}
            }
            return None;
        };
        if now.0.since(begun) > START_TIME_OUT {
            self.disable(now, axis);
            return Some(Err(Failure::State(axis.state(), axis.awaited())));
        }
        None
    }

    fn stopping(
        &mut self,
        now: Now,
        axis: &mut AxisChannel,
        waited: DurationNs,
    ) -> Option<Result<(), Failure>> {
        let rests = self.is_standing(now.0);
        let done = match self.source {
            Source::Profile { profile, .. } => profile.is_done() && rests,
            Source::Drive => {
                if rests && axis.feedback().report == Report::Halted {
                    // The drive follows set-points again, and holds the position at which it stopped.
                    let enable = AxisCommand { request: Some(Request::Enable), ..AxisCommand::default() };
                    self.source = Source::None;
                    self.send(now, axis, enable);
                }
                false
            }
            Source::None => rests && is_operating(axis) || !axis.may_have_torque(),
        };
        if done { Some(Ok(())) } else { (waited > STOP_TIME_OUT).then_some(Err(Failure::TimedOut)) }
    }

    fn going(
        &mut self,
        now: Now,
        axis: &AxisChannel,
        to: Move,
        task: &mut Task,
    ) -> Option<Result<(), Failure>> {
        let feedback = axis.feedback();
        let there = match self.source {
            Source::Profile { profile, .. } => profile.is_done(),
            Source::Drive => {
                feedback.selection() == POSITIONING && feedback.status.contains(StatusBits::TARGET_REACHED)
            }
            Source::None => false,
        };
        let begun = *task.begun.get_or_insert(now.0);
        if !there {
            task.begun = Some(now.0);
            return None;
        }
        let error = feedback.position.get().abs_diff(to.to.get());
        let bound = axis
            .limits()
            .following_error
            .map_or(0, |limit| limit.get() / IN_POSITION_DIVISOR)
            .max(IN_POSITION.get());
        let bound = bound.unsigned_abs();
        if error <= bound && self.is_standing(now.0) {
            return Some(Ok(()));
        }
        (now.0.since(begun) > SETTLE_TIME_OUT).then_some(Err(Failure::OffTarget(feedback.position)))
    }

    fn homing(&mut self, now: Now, axis: &mut AxisChannel, task: &mut Task) -> Option<Result<(), Failure>> {
        let status = axis.feedback().status;
        if status.contains(StatusBits::HOMING_FAILED) {
            return Some(Err(Failure::HomingFailed));
        }
        let homed = status.contains(StatusBits::HOMED);
        if axis.feedback().selection() == HOMING && !homed {
            task.begun = Some(now.0);
        }
        if homed && task.begun.is_some() && self.is_standing(now.0) {
            if has(axis, POSITION) {
                let hold = |profile: &mut MotionProfile| profile.brake();
                self.follow_profile(now, axis, POSITION, Acceleration(1), hold);
            }
            return Some(Ok(()));
        }
        (now.0.since(task.since) > HOMING_TIME_OUT).then_some(Err(Failure::TimedOut))
    }
}

/// Whether the axis can move now.
fn check_enabled(axis: &AxisChannel) -> Result<(), Failure> {
    match axis.fault() {
        Some(fault) => Err(Failure::Fault(fault.cause)),
        None if !is_operating(axis) => Err(Failure::NotEnabled(axis.state())),
        // It would not follow before the drive has ended its halt.
        None if axis.action() == Action::Halt => Err(Failure::Stopping),
        None => Ok(()),
    }
}

/// Checks a velocity and an acceleration against the limits of the axis; returns the acceleration to use.
fn checked_acceleration(
    axis: &AxisChannel,
    velocity: Velocity,
    acceleration: Option<Acceleration>,
) -> Result<Acceleration, Failure> {
    check_enabled(axis)?;
    let limits = axis.limits();
    let beyond = |limit: &Velocity| velocity.get().unsigned_abs() > limit.get().unsigned_abs();
    if let Some(limit) = limits.velocity.filter(beyond) {
        return Err(Failure::TooFast(limit));
    }
    let configured = limits.acceleration.or(axis.stop_settings().deceleration);
    let acceleration = acceleration.or(configured).ok_or(Failure::NoAcceleration)?;
    if acceleration <= Acceleration::ZERO {
        return Err(Failure::NotPositive);
    }
    match limits.acceleration.filter(|limit| acceleration > *limit) {
        Some(limit) => Err(Failure::TooSteep(limit)),
        None => Ok(acceleration),
    }
}

fn has(axis: &AxisChannel, mode: ModeSelection) -> bool {
    axis.south().is_some_and(|program| program.has_mode(mode))
}

fn is_operating(axis: &AxisChannel) -> bool {
    axis.state() == DriveState::Operating && axis.sequence_step() == SequenceStep::Running
}

fn not_enabled(axis: &AxisChannel) -> Option<Result<(), Failure>> {
    let lost = axis.state() != DriveState::Operating && axis.fault().is_none();
    lost.then(|| Err(Failure::NotEnabled(axis.state())))
}

/// Whether an axis in velocity control can no longer stop ahead of its position limit.
fn runs_beyond(axis: &AxisChannel) -> bool {
    let (limits, feedback) = (axis.limits(), axis.feedback());
    let Some(deceleration) = limits.acceleration.or(axis.stop_settings().deceleration) else { return false };
    let velocity = i128::from(feedback.velocity.get());
    let rest = velocity * velocity / (2 * i128::from(deceleration.get().max(1))) * velocity.signum();
    let place = i128::from(feedback.position.get()) + rest;
    let above = |end: Position| velocity > 0 && place > i128::from(end.get());
    let below = |end: Position| velocity < 0 && place < i128::from(end.get());
    limits.position_max.is_some_and(above) || limits.position_min.is_some_and(below)
}
