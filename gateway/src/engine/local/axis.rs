//! One axis under local control: the order in progress, and the source of its set-points.
//!
//! ```text
//! order    what it does                                completed when
//! enable   waits for a ready drive, then enables it    the axis operates, and the start sequence has ended
//! jog      the profile goes to a velocity              immediately; the axis brakes after the time of the order
//! move     profile or drive positioning to a target    the axis stands at the target
//! home     the drive's own homing                      the drive reports that it is homed
//! stop     the profile brakes, or the drive halts      the axis stands
//! disable  the configured stop                         the axis is without torque
//! reset    clears the faults                           there is no fault
//! ```

use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{AxisCommand, StatusBits};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Velocity};
use profile_generic::state::{DriveState, Report, Request};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::JOG_TIME;
use super::order::{ClientId, Failure, Generator, Jog, Move, Order};
use crate::engine::axis::{
    AxisChannel, Intent, READY_TIME_OUT, RESET_TIME_OUT, Reactions, START_TIME_OUT, STOP_TIME_OUT, Wish,
};
use crate::engine::generator::{self, Misfit, POSITION, ProfileGenerator, Standstill, UPDATES};

/// Longest homing.
const HOMING_TIME_OUT: DurationNs = DurationNs::from_secs(600);

/// How long an axis may take to settle at its target after the end of the profile.
const SETTLE_TIME_OUT: DurationNs = DurationNs::from_secs(5);

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
    /// The profile generator of the gateway.
    Generator { generator: ProfileGenerator, jog_ends: Option<MonotonicTime> },
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
    standstill: Standstill,
}

impl LocalAxis {
    pub(super) const fn new() -> Self {
        Self { holder: None, task: None, source: Source::None, sequence: 0, standstill: Standstill::new() }
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
        axis.begin_north();
        axis.keep_updates(UPDATES);
        // A disable ends without torque, whatever Stopping Action a controller had set.
        let mut settings = *axis.stop_settings();
        settings.plan.hold = false;
        // An enable holds the axis: nobody would lead on one that is caught at its speed.
        settings.flying_start = false;
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
            // The stop of a movement of the drive ends with its halt.
            Order::Enable | Order::Reset if axis.halts() && matches!(self.source, Source::Drive) => {
                return Err(Failure::Stopping);
            }
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
        self.standstill.watch(now.0, axis);
        let mut task = self.task?;
        let result = self.progress(now, axis, &mut task);
        self.task = if result.is_some() { None } else { Some(task) };
        result.map(|result| (task, result))
    }

    // ---- orders --------------------------------------------------------------------------------------------------

    fn jog(&mut self, now: Now, axis: &mut AxisChannel, jog: Jog) -> Result<(), Failure> {
        check_enabled(axis)?;
        // The axis may have no acceleration of its own.
        if jog.velocity == Velocity::ZERO && jog.acceleration.is_none() {
            match &mut self.source {
                // It holds its position.
                Source::None => return Ok(()),
                // A profile in progress brakes with its acceleration.
                Source::Generator { generator, jog_ends } => {
                    generator.profile.brake();
                    *jog_ends = None;
                    return Ok(());
                }
                Source::Drive => {}
            }
        }
        let acceleration = generator::acceleration(axis, jog.velocity, jog.acceleration)?;
        let mode = generator::run_mode(axis)?;
        let end = generator::end_of_travel(axis, jog.velocity)?;
        let mut generator = self.generator(now, axis, mode, acceleration);
        generator.run(jog.velocity, acceleration, end);
        self.source = Source::Generator { generator, jog_ends: Some(now.0 + jog.time.min(JOG_TIME)) };
        Ok(())
    }

    fn go(&mut self, now: Now, axis: &mut AxisChannel, to: Move) -> Result<(), Failure> {
        check_enabled(axis)?;
        generator::target(axis, to.to, to.velocity)?;
        let acceleration = generator::acceleration(axis, to.velocity, to.acceleration)?;
        let by_drive = match to.by {
            Some(by) => by == Generator::Drive,
            None => generator::has(axis, POSITIONING),
        };
        check_mode(axis, if by_drive { POSITIONING } else { POSITION })?;
        if !by_drive {
            let mut generator = self.generator(now, axis, POSITION, acceleration);
            generator.profile.to_position(to.to, to.velocity, acceleration);
            self.source = Source::Generator { generator, jog_ends: None };
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
        check_mode(axis, HOMING)?;
        axis.repeat_procedure();
        let mut command = AxisCommand::default();
        command.select(HOMING);
        self.source = Source::Drive;
        self.send(now, axis, command);
        Ok(())
    }

    /// Brings the axis to standstill, and cancels a start in progress.
    fn stop(&mut self, now: Now, axis: &mut AxisChannel) {
        axis.forget_pending_enable();
        match &mut self.source {
            Source::Generator { generator, jog_ends } => {
                generator.profile.brake();
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

    /// The generator in this mode: the one in progress, or one from how the axis moves.
    fn generator(
        &self,
        now: Now,
        axis: &AxisChannel,
        mode: ModeSelection,
        braking: Acceleration,
    ) -> ProfileGenerator {
        match self.source {
            Source::Generator { generator, .. } if generator.mode == mode => generator,
            _ => ProfileGenerator::from_axis(now.0, axis, mode, braking),
        }
    }

    fn set_points(&mut self, now: Now, axis: &mut AxisChannel) {
        let Source::Generator { mut generator, jog_ends } = self.source else { return };
        if jog_ends.is_some_and(|ends| now.0 >= ends) {
            generator.profile.brake();
        }
        while let Some(command) = generator.poll(now.0, axis) {
            self.send(now, axis, command);
        }
        self.source = Source::Generator { generator, jog_ends };
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
                // It has ended without success.
                (Some(fault), _) if !axis.has_reset() => Some(Err(Failure::Fault(fault.cause))),
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

    fn enabling(&mut self, now: Now, axis: &mut AxisChannel, task: &mut Task) -> Option<Result<(), Failure>> {
        if axis.operates() {
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
        let rests = self.standstill.is_reached(now.0);
        let done = match self.source {
            Source::Generator { generator, .. } => generator.profile.is_done() && rests,
            Source::Drive => {
                if rests && axis.feedback().report == Report::Halted {
                    // The drive follows set-points again, and holds the position at which it stopped.
                    let enable = AxisCommand { request: Some(Request::Enable), ..AxisCommand::default() };
                    self.source = Source::None;
                    self.send(now, axis, enable);
                }
                false
            }
            Source::None => rests && axis.operates() || !axis.may_have_torque(),
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
            Source::Generator { generator, .. } => generator.profile.is_done(),
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
        if generator::is_in_position(axis, to.to) && self.standstill.is_reached(now.0) {
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
        if homed && task.begun.is_some() && self.standstill.is_reached(now.0) {
            if generator::has(axis, POSITION) {
                let mut generator = self.generator(now, axis, POSITION, Acceleration(1));
                generator.profile.brake();
                self.source = Source::Generator { generator, jog_ends: None };
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
        None if !axis.operates() => Err(Failure::NotEnabled(axis.state())),
        // It would not follow before the drive has ended its halt.
        None if axis.halts() => Err(Failure::Stopping),
        None => Ok(()),
    }
}

/// Whether the drive of the axis is set up for a mode.
fn check_mode(axis: &AxisChannel, mode: ModeSelection) -> Result<(), Misfit> {
    if generator::has(axis, mode) { Ok(()) } else { Err(Misfit::Mode(mode)) }
}

fn not_enabled(axis: &AxisChannel) -> Option<Result<(), Failure>> {
    let lost = axis.state() != DriveState::Operating && axis.fault().is_none();
    lost.then(|| Err(Failure::NotEnabled(axis.state())))
}
