//! What a north side wants of the axis: wishes, resets, tests and set-points.
//!
//! CIP Motion hands on a [`Wish`] and [`NorthPoints`], with its handshakes and its wrapping positions. A north side that speaks in
//! the generic model hands on an [`AxisCommand`] ([`AxisChannel::from_north`]), which has requests for homing by the drive and targets
//! that the drive goes to by itself. Both paths end in the same state machine, interpolator and limits.

use super::guard::Finding;
use super::set_points::{Before, Updates};
use super::{
    AxisChannel, Intent, Loss, NorthPoints, Owner, ProcedureUnit, Reactions, StopSettings, Target, Wish,
};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::hookup::TestOrder;
use profile_generic::image::{AxisCommand, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::{TargetUpdate, UpdateError};
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::quantity::Position;
use profile_generic::sequence::StopPlan;
use profile_generic::state::{Action, DriveState, Request};
use profile_generic::time::{MonotonicTime, SystemTime};

impl AxisChannel {
    // ---- owner ------------------------------------------------------------------------------------------------

    /// Who controls the axis.
    #[must_use]
    pub fn owner(&self) -> Owner {
        self.orders.owner()
    }

    /// Whether a controller is connected to the device of the axis: it takes precedence over local control.
    #[must_use]
    pub fn has_controller(&self) -> bool {
        self.orders.controller
    }

    /// Sets whether a controller is connected to the device of the axis. Call it in every cycle, ahead of the north sides.
    pub fn set_controller(&mut self, connected: bool) {
        self.orders.controller = connected;
    }

    /// Sets whether a client of local control controls the axis.
    pub fn set_local_control(&mut self, taken: bool) {
        self.orders.local = taken;
    }

    // ---- configuration -----------------------------------------------------------------------------------------

    /// Sets how fine the north side can command, in nanounits.
    pub fn set_count(&mut self, count: i64) {
        self.set_points.count = count;
    }

    /// Sets how the axis starts and stops from now on. A stop in progress keeps its method.
    pub fn set_stop_settings(&mut self, settings: StopSettings) {
        self.start_stop.settings = settings;
    }

    /// How the axis starts and stops.
    #[must_use]
    pub fn stop_settings(&self) -> &StopSettings {
        &self.start_stop.settings
    }

    /// Whether the controller wants limit switches checked that the drive does not report.
    #[must_use]
    pub fn misses_limit_switches(&self) -> bool {
        self.start_stop.settings.checks_overtravel
            && self.south().is_some_and(|program| !program.knows_status(StatusBits::LIMIT_SWITCHES))
    }

    /// Sets the reaction to each cause from now on. Faults that stand are judged again.
    pub fn set_reactions(&mut self, now: MonotonicTime, system: SystemTime, reactions: &Reactions) {
        if self.faults.configure(reactions) {
            self.react_to_all(now, system);
        }
    }

    /// Sets the start inhibits for which the north side is the reason.
    pub fn set_inhibits(&mut self, now: MonotonicTime, system: SystemTime, mut inhibits: Inhibits) {
        inhibits.set(Inhibits::TRANSFER_ACTIVE, self.rescaled > 0);
        if let Some(transition) = self.drive.machine.set_inhibits(inhibits) {
            self.follow(now, system, transition);
        }
    }

    /// Sets how the north side sends its set-points.
    pub fn keep_updates(&mut self, updates: Updates) {
        self.set_points.keep_updates(updates, &self.feedback);
    }

    /// A parameter was written that decides what the values of the drive mean: the axis cannot be enabled before its drive was
    /// commissioned again, unless each such write was taken back because the drive had refused it. Only without torque.
    pub fn rescale(&mut self, now: MonotonicTime, system: SystemTime, is_written: bool) {
        let count = self.rescaled;
        self.rescaled = if is_written { count.saturating_add(1) } else { count.saturating_sub(1) };
        self.set_inhibits(now, system, self.drive.machine.conditions().inhibits);
    }

    /// Raises a fault: the controller's configuration of this axis cannot be used.
    pub fn refuse_configuration(&mut self, now: MonotonicTime, system: SystemTime) {
        self.raise(now, system, Fault::new(FaultCause::CONFIGURATION, system));
    }

    // ---- wishes, resets, tests ---------------------------------------------------------------------------------

    /// Takes a new wish and carries it out. Call it when the wish changes.
    pub fn take_wish(&mut self, now: MonotonicTime, system: SystemTime, wish: Wish) {
        self.orders.want(wish);
        self.carry_out_wish(now, system);
    }

    /// Tries an enable again that was rejected because the drive was not ready. One that has waited for
    /// [`READY_TIME_OUT`](super::READY_TIME_OUT) becomes a fault: an axis does not start by itself when power returns later. Call it in every
    /// cycle.
    pub fn retry_wish(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.orders.is_pending_late(now, self.state() == DriveState::Stopping) {
            self.raise(now, system, Fault::new(FaultCause::START_TIME_OUT, system));
        } else if self.state() == DriveState::Ready && self.orders.take_pending() {
            self.carry_out_wish(now, system);
        }
    }

    /// An enable that was rejected is not tried again.
    pub fn forget_pending_enable(&mut self) {
        self.orders.forget_pending();
    }

    fn carry_out_wish(&mut self, now: MonotonicTime, system: SystemTime) {
        let Wish { intent, request } = self.orders.wish();
        if !self.may_start() && matches!(intent, Intent::Enable | Intent::Test) {
            return;
        }
        self.leave_hold(now, system, intent);
        let torque = self.may_have_torque();
        match intent {
            // What a test is led by is torque: it ends by the drive's own deceleration, not by a ramp of the box.
            Intent::Standby | Intent::Disable if torque && self.start_stop.started_for_test => {
                self.request(now, system, Request::Disable);
            }
            Intent::Disable if torque => self.begin_stop(now, system, self.start_stop.settings.plan),
            // Neither a connection that is gone nor a standby state of the axis leaves it with torque.
            Intent::Standby if torque => self.begin_stop(now, system, StopPlan::default()),
            // Without torque there is nothing to abort; the north side keeps the fault.
            Intent::Abort if !torque => {}
            // A test that has ended before it began needs no torque.
            Intent::Test if !self.hookup.needs_torque() => {}
            _ => {
                if let Some(request) = request {
                    self.request(now, system, request);
                }
            }
        }
    }

    fn leave_hold(&mut self, now: MonotonicTime, system: SystemTime, intent: Intent) {
        match intent {
            // Out of a hold, or of a stop that has not ended: the torque is there already.
            Intent::Enable if self.state() == DriveState::Operating => self.prepare_start(now),
            Intent::Enable | Intent::Abort => {}
            // An axis that is not halted in this very cycle loses its torque as soon as it is.
            _ => {
                self.orders.hold_unwanted = self.is_to_hold();
                self.end_hold(now, system);
            }
        }
    }

    /// Starts the fault reset with this number, unless it was carried out or is in progress.
    pub fn want_reset(&mut self, now: MonotonicTime, system: SystemTime, id: u32) {
        if self.orders.is_new_reset(id) {
            self.begin_reset(now, system, id);
        }
    }

    /// Whether a reset waits for the end of a stop, or is under way.
    #[must_use]
    pub fn has_reset(&self) -> bool {
        self.orders.has_reset()
    }

    /// Does without a reset that waits for the end of a stop: something newer has come.
    pub fn drop_waiting_reset(&mut self) {
        self.orders.drop_waiting_reset();
    }

    /// Number of the last reset that was carried out.
    #[must_use]
    pub fn reset_id(&self) -> u32 {
        self.orders.reset_id()
    }

    fn begin_reset(&mut self, now: MonotonicTime, system: SystemTime, id: u32) {
        self.orders.begin_reset(now, id);
        self.advance_reset(now, system);
    }

    /// Takes the order for a hookup test. `None` ends a test in progress.
    pub fn take_test(&mut self, now: MonotonicTime, order: Option<TestOrder>) {
        let able = self.supervision.limits.hookup.is_some()
            && self.south().is_some_and(|program| program.has_mode(OperatingMode::Torque));
        self.hookup.take(now, order, able);
    }

    // ---- losses ------------------------------------------------------------------------------------------------

    /// The command is lost: the axis stops as configured for a lost command.
    pub fn lose_command(&mut self, now: MonotonicTime, system: SystemTime, loss: Loss) {
        let command_loss = self.faults.command_loss;
        if self.fault().is_none() && self.state().is_running() {
            self.note_loss(Some(loss));
            let fault = Fault::new(FaultCause::COMMAND_LOST, system).with_reaction(command_loss);
            self.raise(now, system, fault);
        } else if self.state() == DriveState::FaultReaction
            && self.drive.action == Action::Halt
            && command_loss > Reaction::HoldPosition
        {
            // A fault has stopped the axis already and would hold it; without a controller the configured reaction counts.
            let transition = self.drive.machine.raise_fault(command_loss);
            self.follow(now, system, transition);
        }
    }

    /// Says why the command is lost, ahead of the fault that is about it.
    pub fn note_loss(&mut self, loss: Option<Loss>) {
        self.faults.note_loss(loss);
    }

    /// The north side is lost: the axis stops as configured for a lost command.
    pub fn lose_north(&mut self, now: MonotonicTime, system: SystemTime) {
        self.lose_command(now, system, Loss::Silent);
    }

    /// The gateway ends: the axis stops as on a lost command, but without holding torque, and is not switched on again.
    pub fn end(&mut self, now: MonotonicTime, system: SystemTime) {
        self.ends = true;
        self.faults.command_loss = self.faults.command_loss.max(Reaction::DecelerateAndDisable);
        self.lose_command(now, system, Loss::End);
        self.end_hold(now, system);
    }

    /// Another master is on the bus, so the drive may get other commands. The axis stops as on a lost command, without holding torque.
    pub fn doubt_south(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.may_have_torque() {
            let reaction = self.faults.command_loss.max(Reaction::DecelerateAndDisable);
            let fault = Fault::new(FaultCause::SOUTH_SILENCE, system);
            self.raise(now, system, fault.with_reaction(reaction));
        }
    }

    /// The same in every call as long as the other master is there: an axis that was switched on meanwhile stops as well.
    pub fn doubt_run(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.state().is_running() {
            self.doubt_south(now, system);
        }
    }

    // ---- set-points --------------------------------------------------------------------------------------------

    /// Whether set-points of this number were taken.
    #[must_use]
    pub fn has_taken(&self, sequence: u32) -> bool {
        self.set_points.has_taken(sequence)
    }

    /// Whether set-points in this mode would be the first ones after a start or a change of mode.
    #[must_use]
    pub fn begins(&self, selection: ModeSelection) -> bool {
        self.set_points.begins(&self.command, selection)
    }

    /// Another north side has the axis: its commands and set-points count by numbers of its own.
    pub fn begin_north(&mut self) {
        self.orders.forget_number();
        self.orders.forget_pending();
        self.end_set_points();
    }

    /// A procedure that is still chosen and over is carried out again.
    pub fn repeat_procedure(&mut self) {
        if self.procedure.repeat() {
            // What it showed was of the one before.
            self.feedback.status.remove(ProcedureUnit::STATUS);
        }
    }

    /// The north side has no set-points: the next ones are the first.
    pub fn end_set_points(&mut self) {
        self.set_points.end();
    }

    /// Refuses the set-points of this number: the axis stops with a fault of this cause.
    pub fn refuse_set_points(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        sequence: u32,
        cause: FaultCause,
    ) {
        self.set_points.take(sequence);
        self.raise(now, system, Fault::new(cause, system));
    }

    /// The instant at which set-points with this target are to be reached.
    #[must_use]
    pub fn instant_of(&self, target: Target) -> MonotonicTime {
        self.set_points.target(target).1
    }

    /// Takes set-points for the interpolator. A number that was taken before has no effect.
    pub fn take_set_points(&mut self, now: MonotonicTime, system: SystemTime, points: NorthPoints) {
        if self.has_taken(points.sequence) {
            return;
        }
        let mut fresh = points.command;
        let begins = self.begins(fresh.selection());
        let first = self.set_points.take(points.sequence);
        let trimmed = self.set_points.trims.take(&mut fresh, begins);
        let saturated = points.saturated + u32::from(trimmed.is_none());
        self.set_points.count_saturated(saturated);
        if points.unusable + saturated > 0 {
            // Values that cannot be expressed are not followed in part.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
            return;
        }
        if let Some(finding) = self.beyond_limits(&fresh) {
            self.trip(now, system, finding);
            return;
        }
        let (target_update, target) = self.set_points.target(points.target);
        let trimmed = trimmed == Some(true) && fresh.mode == OperatingMode::Position;
        let watched = if begins { trimmed } else { points.is_counted || trimmed };
        let (here, limits) = (self.command.position, &self.supervision.limits);
        if watched && let Some(finding) = self.set_points.leaps(&fresh, here, target, limits) {
            // Position and count that do not belong together: one of them is of the cycle before or after. Or a trim that
            // would throw the axis aside.
            self.trip(now, system, finding);
            return;
        }
        self.interpolate(now, system, &fresh, first, (target_update, Some(target)));
    }

    /// Hands set-points to the interpolator; `first` are those after a start.
    fn interpolate(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        fresh: &AxisCommand,
        first: bool,
        target: (TargetUpdate, Option<MonotonicTime>),
    ) {
        let before = Before { command: self.command, led: self.takes_set_points(), first };
        self.command.select(fresh.selection());
        match self.set_points.interpolate(now, fresh, &before, &self.feedback, target) {
            Ok(()) => {}
            Err(Loss::Update(UpdateError::Jump)) => {
                self.raise(now, system, Fault::new(FaultCause::VELOCITY_COMMAND_LIMIT, system));
            }
            Err(loss) => self.lose_command(now, system, loss),
        }
    }

    /// A position beyond the software limits. An axis that is beyond one already may stand there, to a count, and come back.
    fn beyond_limits(&self, command: &AxisCommand) -> Option<Finding> {
        let (here, count) = (self.command.position, Position(self.set_points.count));
        let limit = self.supervision.position_limit(command, here, count)?;
        Some(self.set_points.beyond(command.position, limit))
    }

    // ---- the generic model -------------------------------------------------------------------------------------

    /// Takes a command in generic units. Call it in every cycle after [`Self::from_drive`]. A command with the `sequence` of
    /// the one before has no effect.
    ///
    /// Set-points need an update period ([`Self::keep_updates`]) and go on without an update for a few periods only.
    /// A drive that goes to a target or homes does so until it gets another command: if the north side is lost, call
    /// [`Self::lose_north`].
    pub fn from_north(&mut self, now: MonotonicTime, system: SystemTime, command: &AxisCommand) {
        if self.orders.is_new(command.sequence)
            && let Some(request) = command.request
        {
            self.take_request(now, system, request);
        }
        // An axis that is told no mode stands where it was started.
        let idle = self.state() != DriveState::Operating || command.mode == OperatingMode::None;
        if idle || self.has_taken(command.sequence) {
            return;
        }
        let first = self.set_points.take(command.sequence);
        let mut command = *command;
        let fits = self.set_points.trims.take(&mut command, first).is_some();
        let command = &command;
        let led = command.interpolation == InterpolationSource::Controller;
        if fits
            && led
            && command.mode != OperatingMode::Homing
            && let Some(finding) = self.beyond_limits(command)
        {
            self.trip(now, system, finding);
            return;
        }
        let refusal = if fits { self.refusal(command) } else { Some(FaultCause::POSITION_COMMAND_LIMIT) };
        if let Some(cause) = refusal {
            self.raise(now, system, Fault::new(cause, system));
        } else if led {
            let target = (TargetUpdate::Interpolate, command.target_time);
            self.interpolate(now, system, command, first, target);
        } else {
            self.take_target(command);
        }
    }

    fn take_request(&mut self, now: MonotonicTime, system: SystemTime, request: Request) {
        if request == Request::FaultReset {
            self.begin_reset(now, system, self.reset_id());
            return;
        }
        if request == Request::Enable && self.halts() && self.may_start() {
            // The torque is there already, and what the axis was led by is of before the halt.
            self.prepare_start(now);
        }
        self.request(now, system, request);
    }

    /// Takes a target that the drive goes to by itself, or a homing.
    fn take_target(&mut self, command: &AxisCommand) {
        self.command.select(command.selection());
        self.set_points.count_command();
        if command.mode != OperatingMode::Homing {
            self.command.target_position = command.target_position;
            self.command.profile_velocity = command.profile_velocity;
            self.command.profile_acceleration = command.profile_acceleration;
            self.command.profile_deceleration = command.profile_deceleration;
            self.command.present |= command.present & AxisCommand::PROFILE;
        }
    }

    /// Whether the axis was halted in operation.
    pub fn halts(&self) -> bool {
        self.state() == DriveState::Operating && self.drive.action == Action::Halt
    }

    /// Why a command is not followed.
    fn refusal(&self, command: &AxisCommand) -> Option<FaultCause> {
        let program = self.south()?;
        let selection = command.selection();
        if !program.has_mode(selection) {
            return Some(FaultCause::ILLEGAL_MODE);
        }
        if !command.present.contains(program.needs(selection)) {
            // Half understood is not understood.
            return Some(FaultCause::POSITION_COMMAND_LIMIT);
        }
        if command.interpolation == InterpolationSource::Controller || command.mode == OperatingMode::Homing {
            return None;
        }
        let (target, limits) = (command.target_position, &self.supervision.limits);
        let far = |step: i64| target.get().abs_diff(self.feedback.position.get()) > step.unsigned_abs();
        let beyond = limits.position_min.is_some_and(|limit| target < limit)
            || limits.position_max.is_some_and(|limit| target > limit)
            // A drive that works modulo would go there the other way round.
            || program.position_step().is_some_and(far);
        let speed = command.profile_velocity.get();
        let fast = limits.velocity.is_some_and(|limit| speed > limit.get()) || speed < 0;
        match (beyond, fast) {
            (true, _) => Some(FaultCause::POSITION_COMMAND_LIMIT),
            (false, true) => Some(FaultCause::VELOCITY_COMMAND_LIMIT),
            (false, false) => None,
        }
    }
}
