//! From the set-points of the north side to the telegram of the drive.

use super::guard::{Bounds, Finding, Lead, Trip, way};
use super::{AxisChannel, Intent, Loss, MODE_TIME_OUT};
use crate::engine::bus::Cycle;
use crate::mapping::{DriveProgram, Order};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::image::{AxisCommand, CommandSet, FeedbackSet};
use profile_generic::interpolation::{Motion, Quality, SetPoints as FinePoints, TargetUpdate, UpdateError};
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Quantity, Torque, Velocity};
use profile_generic::state::{Action, DriveState, Transition};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

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

impl AxisChannel {
    /// Whether set-points of this number were taken.
    #[must_use]
    pub fn has_taken(&self, sequence: u32) -> bool {
        self.sequence == Some(sequence)
    }

    /// Whether set-points in this mode would be the first ones after a start or a change of mode.
    #[must_use]
    pub fn begins(&self, selection: ModeSelection) -> bool {
        self.sequence.is_none() || self.command.selection() != selection
    }

    /// The north side has no set-points: the next ones are the first.
    pub fn end_set_points(&mut self) {
        self.sequence = None;
    }

    /// Set-points of this number make no sense: the axis stops.
    pub fn refuse_set_points(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        sequence: u32,
        cause: FaultCause,
    ) {
        self.sequence = Some(sequence);
        self.raise(now, system, Fault::new(cause, system));
    }

    /// Takes set-points of a north side that leads the axis by interpolation.
    pub fn take_set_points(&mut self, now: MonotonicTime, system: SystemTime, points: NorthPoints) {
        if self.has_taken(points.sequence) {
            return;
        }
        let mut fresh = points.command;
        let (first, begins) = (self.sequence.is_none(), self.begins(fresh.selection()));
        self.sequence = Some(points.sequence);
        let trimmed = self.take_trims(&mut fresh, begins);
        let saturated = points.saturated + u32::from(trimmed.is_none());
        self.count_saturated(saturated);
        if points.unusable + saturated > 0 {
            // Values that cannot be expressed are not followed in part.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
            return;
        }
        if let Some(finding) = self.beyond_limits(&fresh) {
            self.trip(now, system, finding);
            return;
        }
        let (target_update, target) = match points.target {
            Target::At(at, update) => (update, at),
            Target::Paced(paced_at) => {
                // A period later than the drives could have it at the earliest: by then they can have the next one.
                let period =
                    self.interpolator.as_ref().map_or(DurationNs::ZERO, |known| known.config().period);
                (TargetUpdate::Interpolate, paced_at + self.ahead + period)
            }
        };
        let trimmed = trimmed == Some(true) && fresh.mode == OperatingMode::Position;
        let watched = if begins { trimmed } else { points.is_counted || trimmed };
        if watched && let Some(finding) = self.leaps(&fresh, target) {
            // Position and count that do not belong together: one of them is of the cycle before or after. Or a trim that
            // would throw the axis aside.
            self.trip(now, system, finding);
            return;
        }
        self.interpolate(now, system, &fresh, first, target_update, Some(target));
    }

    /// Hands set-points to the interpolator; `first` are those after a start.
    pub(super) fn interpolate(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        fresh: &AxisCommand,
        first: bool,
        target_update: TargetUpdate,
        target_time: Option<MonotonicTime>,
    ) {
        let other_mode = self.command.selection() != fresh.selection();
        let actual = self.actual_motion();
        let before = self.command.mode;
        let led = self.takes_set_points();
        self.command.select(fresh.selection());
        self.counters.commands = self.counters.commands.saturating_add(1);
        let Some(interpolator) = self.interpolator.as_mut() else {
            self.lose_command(now, system, Loss::NoPeriod);
            return;
        };
        if first {
            match self.caught.take() {
                // From the speed that it has, as the ramp generator would begin there (clause 5-2.6.5.4).
                Some(velocity) => interpolator.start_moving(self.acts_at, &Motion { velocity, ..actual }),
                None => interpolator
                    .start(self.feedback.present.contains(FeedbackSet::POSITION).then_some(actual.position)),
            }
        } else if !led {
            // The drive has led the axis by itself: what was sent before that leads nowhere.
            interpolator.start_moving(self.acts_at, &actual);
        }
        if other_mode || interpolator.config().target_update != target_update {
            // On the move the new command begins where the old one has led the axis.
            interpolator.change(self.acts_at, target_update, (before, fresh.mode), &actual);
        }
        let period = interpolator.config().period;
        let target = target_time.unwrap_or_else(|| target_update.target(now, period));
        match interpolator.update(target, &FinePoints::from(fresh)) {
            Ok(()) => {}
            Err(UpdateError::Jump) => {
                self.raise(now, system, Fault::new(FaultCause::VELOCITY_COMMAND_LIMIT, system));
            }
            // Set-points overtaken by newer ones; silence is watched elsewhere.
            Err(UpdateError::NotNewer { .. }) => {}
            Err(error) => self.lose_command(now, system, Loss::Update(error)),
        }
    }

    /// A position that is further from the present command than the axis may move until it is to be reached, and in the period that
    /// the update may have been under way.
    fn leaps(&self, fresh: &AxisCommand, target: MonotonicTime) -> Option<Finding> {
        const SECOND: i128 = 1_000_000_000;
        let (limit, interpolator) = (self.limits.velocity?, self.interpolator.as_ref()?);
        let span = target.since(self.acts_at).max(DurationNs::ZERO) + interpolator.config().period * 2;
        let span = i128::from(span.as_nanos());
        let way = i128::from(fresh.position.get()) - i128::from(self.command.position.get());
        // A tenth to spare, as everywhere.
        let beyond = way.abs() * 10 * SECOND > i128::from(limit.get()).abs() * 11 * span;
        let value = i64::try_from(way * SECOND / span.max(1)).unwrap_or(i64::MAX);
        let trip = Trip { quantity: Quantity::Velocity, value, limit: limit.get(), late: self.late };
        beyond.then_some(Finding { cause: FaultCause::VELOCITY_COMMAND_LIMIT, trip })
    }

    /// A position beyond the software limits. An axis that is beyond one already may stand there, to a count, and come back.
    pub(super) fn beyond_limits(&self, command: &AxisCommand) -> Option<Finding> {
        if !command.present.contains(CommandSet::POSITION) {
            return None;
        }
        let (position, here) = (command.position, self.command.position);
        let count = Position(self.count);
        let above = |limit: &Position| position > *limit && position > here.saturating_add(count);
        let below = |limit: &Position| position < *limit && position < here.saturating_sub(count);
        let limit = self.limits.position_max.filter(above).or(self.limits.position_min.filter(below))?;
        let (value, limit) = (position.get(), limit.get());
        let trip = Trip { quantity: Quantity::Position, value, limit, late: self.late };
        Some(Finding { cause: FaultCause::POSITION_COMMAND_LIMIT, trip })
    }

    /// A set-point is beyond a limit: it is not followed, and the axis stops.
    pub(super) fn trip(&mut self, now: MonotonicTime, system: SystemTime, finding: Finding) {
        self.raise(now, system, Fault::new(finding.cause, system));
        if self.fault.is_some_and(|fault| fault.cause == finding.cause && fault.at == system) {
            self.tripped = Some(finding.trip);
        }
    }

    /// The command is lost: the axis stops as it is configured for that.
    pub fn lose_command(&mut self, now: MonotonicTime, system: SystemTime, loss: Loss) {
        if self.fault.is_none() && self.state().is_running() {
            self.loss = Some(loss);
            let fault = Fault::new(FaultCause::COMMAND_LOST, system).with_reaction(self.command_loss);
            self.raise(now, system, fault);
        } else if self.state() == DriveState::FaultReaction
            && self.action == Action::Halt
            && self.command_loss > Reaction::HoldPosition
        {
            // A fault has stopped the axis already and would hold it; without a controller the configured reaction counts.
            let transition = self.drive.machine.raise_fault(self.command_loss);
            self.follow(now, system, transition);
        }
    }

    /// How the axis moves at the instant of its last command, as far as its drive has told.
    fn actual_motion(&self) -> Motion {
        let feedback = &self.feedback;
        let seen = Motion {
            position: feedback.position,
            velocity: feedback.velocity,
            torque: self.command.torque,
            ..Motion::default()
        };
        seen.after(self.acts_at.since(feedback.at))
    }

    pub(super) fn start_interpolator(&mut self) {
        let position =
            self.feedback.present.contains(FeedbackSet::POSITION).then_some(self.feedback.position);
        if let Some(interpolator) = self.interpolator.as_mut() {
            interpolator.start(position);
        }
    }

    // ---- to the drive ------------------------------------------------------------------------------------------

    /// Fills the values of the drive's connection for a cycle; `false` when there is no program or no place, and then nothing may
    /// be sent.
    pub fn to_drive(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        cycle: &Cycle,
        telegram: Option<&mut [u8]>,
    ) -> bool {
        (self.late, self.ahead) = (cycle.late, cycle.ahead);
        let elapsed = cycle.acts_at.since(self.acts_at).max(cycle.span);
        let lead = self.fine_command(now, system, cycle.acts_at);
        self.hand_over(now, system);
        self.guard(now, system, lead, (cycle.span, elapsed));
        let (Some((program, _)), Some(telegram)) = (self.south.as_ref(), telegram) else { return false };
        let mut conversions = ConversionReport::default();
        let action = match self.action {
            _ if !self.moves => Action::TorqueOff,
            Action::TorqueOff if self.reset_cycles > 0 => Action::ResetFault,
            action => action,
        };
        self.reset_cycles = self.reset_cycles.saturating_sub(1);
        let order = Order {
            action,
            told: self.procedure.told(),
            asks: self.procedure.is_requested() || self.handshake.is_requested(),
        };
        let command = self.handshake.apply(&self.command);
        let control = program.encode(&command, order, self.control, self.status, telegram, &mut conversions);
        if program.mode_octet(control) != program.mode_octet(self.control) {
            self.told_since = now;
        }
        self.control = control;
        self.captures.encode(program.captures(), telegram);
        self.count_saturated(conversions.saturated);
        if conversions.saturated > 0 && self.state() == DriveState::Operating {
            // The drive would be led elsewhere than the controller means.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
        }
        true
    }

    /// Goes on with handing the target over, where the drive takes it over step by step.
    fn hand_over(&mut self, now: MonotonicTime, system: SystemTime) {
        let selection = self.command.selection();
        let leads = self.state() == DriveState::Operating
            && self.action == Action::Enable
            && self.procedure.told().is_none();
        let south = self.south().filter(|program| leads && program.shows(selection, self.status));
        let answers = south
            .and_then(|program| program.handshake(selection))
            .map(|handshake| handshake.taken.matches(self.status));
        let wanted = self.command.present.contains(CommandSet::TARGET_POSITION) && self.sequence.is_some();
        if !self.handshake.advance(now, answers, wanted.then_some(&self.command)) {
            // It goes on to the target of before, or nowhere.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
        }
    }

    /// Judges the command of this cycle, the last thing before it goes into the telegram.
    fn guard(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        lead: Lead,
        (span, elapsed): (DurationNs, DurationNs),
    ) {
        let bounds = Bounds {
            velocity: self.limits.velocity,
            acceleration: self.limits.acceleration,
            step: self.south.as_ref().and_then(|(program, _)| program.position_step()),
            cycle: span,
            elapsed,
            period: self.interpolator.as_ref().map_or(span, |known| known.config().period),
            count: self.count,
        };
        let actual = self.feedback.velocity;
        if let Some(finding) = self.guard.judge(&mut self.command, lead, actual, &bounds, self.late) {
            self.trip(now, system, finding);
        }
    }

    /// Works out the set-points of this cycle and returns who leads the axis. A drive that does not follow is shown its own
    /// position: it will not jump when it begins to.
    pub(super) fn fine_command(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        acts_at: MonotonicTime,
    ) -> Lead {
        let span = acts_at.since(std::mem::replace(&mut self.acts_at, acts_at));
        let test_torque = self.run_test(now, system);
        let operating = self.state() == DriveState::Operating;
        // What comes while the axis is halted leads it nowhere, now or later.
        let halts = self.action == Action::Halt;
        let counts = operating && !halts && self.sequence.is_some() && self.takes_set_points();
        let fine = match self.interpolator.as_mut() {
            Some(interpolator) if counts => Some(interpolator.at(acts_at)),
            Some(interpolator) => {
                interpolator.pass(acts_at);
                None
            }
            None => None,
        };
        let points = match fine {
            Some(fine) => {
                if fine.quality == Quality::Lost {
                    self.lose_command(now, system, Loss::Silent);
                }
                fine.set_points
            }
            None => {
                let torque = self.started_for_test.then_some(test_torque);
                FinePoints { torque, ..self.led_by_box(acts_at) }
            }
        };
        self.watch_mode(now, system);
        let last = self.command;
        // Until the drive shows the new operating mode it goes on by the values of the old one.
        let still = |mode: OperatingMode| {
            let mode = ModeSelection::from(mode);
            operating && self.feedback.selection() == mode && last.selection() != mode
        };
        // Where the axis stops by itself or is led by velocity or torque, the position of its last command would pull at it;
        // only a drive that knows no halt has nothing else to hold by.
        let position = last.selection() == OperatingMode::Position.into();
        let led = operating && (position && !self.drive_leads() || self.stands_by_command());
        let velocity = points.velocity.unwrap_or(last.velocity);
        // A drive that brakes by itself comes to rest behind its last command, which is moved there while the drive halts.
        let rests = self.halted_at.filter(|_| self.halts_by_command());
        let rest = if still(OperatingMode::Position) {
            last.position.saturating_add(way(velocity, span))
        } else if let Some(place) = rests {
            place
        } else if led || self.halts_by_command() {
            last.position
        } else {
            self.feedback.position
        };
        let kept = |mode, value: i64| if still(mode) { value } else { 0 };
        // A position that goes on has its speed.
        let speed = if still(OperatingMode::Position) {
            last.velocity
        } else {
            Velocity(kept(OperatingMode::Velocity, last.velocity.0))
        };
        let all = FinePoints {
            position: Some(points.position.unwrap_or(rest)),
            velocity: Some(points.velocity.unwrap_or(speed)),
            acceleration: Some(points.acceleration.unwrap_or_default()),
            torque: Some(points.torque.unwrap_or(Torque(kept(OperatingMode::Torque, last.torque.0)))),
        };
        all.write_to(&mut self.command);
        self.write_trims(fine.is_some_and(|fine| fine.quality != Quality::Lost));
        match fine {
            Some(fine) if fine.quality != Quality::Lost => Lead::SetPoints,
            _ if rests.is_some() => Lead::Nobody,
            // It holds, or ramps down.
            _ if led || fine.is_some() => Lead::Gateway,
            _ => Lead::Nobody,
        }
    }

    /// A drive that does not come to the operating mode that it is told follows values that are meant for no one.
    fn watch_mode(&mut self, now: MonotonicTime, system: SystemTime) {
        // A drive that is led through a procedure is told another mode, with times of its own.
        let led = self.state() == DriveState::Operating
            && self.action == Action::Enable
            && self.procedure.told().is_none();
        let expected = self.south().and_then(|program| program.shown_in(self.command.selection()));
        if !led || expected.is_none_or(|mode| self.shown == Some(mode)) {
            self.other_mode_since = None;
            return;
        }
        let since = *self.other_mode_since.get_or_insert(now);
        if now.since(since) > MODE_TIME_OUT {
            self.other_mode_since = None;
            self.raise(now, system, Fault::new(FaultCause::ILLEGAL_MODE, system));
        }
    }

    /// Whether set-points lead the axis in the chosen mode, and not the drive.
    fn takes_set_points(&self) -> bool {
        let selection = self.command.selection();
        match self.south().and_then(|program| program.procedure(selection)) {
            Some(procedure) => self.procedure.takes_set_points(procedure),
            None => selection.interpolation == InterpolationSource::Controller,
        }
    }

    /// Whether the drive holds by its last command beside a procedure: before it goes its own way and after it follows
    /// again. In between it is shown its own position.
    fn stands_by_command(&self) -> bool {
        let Some(program) = self.south() else { return false };
        let beside = !self.procedure.leads() || program.acknowledges() && self.follows;
        program.procedure(self.command.selection()).is_some() && beside
    }

    /// Whether the drive is to halt and has no halt of its own: then its command stands still.
    fn halts_by_command(&self) -> bool {
        let knows = |(program, _): &(DriveProgram, _)| program.acknowledges();
        self.action == Action::Halt && !self.south.as_ref().is_none_or(knows)
    }

    pub(super) fn follow(&mut self, now: MonotonicTime, system: SystemTime, transition: Transition) {
        if self.feedback.state != transition.next {
            self.drive.since = now;
            self.follow_sequence(now, transition.next);
            self.feedback.state = transition.next;
        }
        match transition.action {
            Action::None => {}
            Action::Reject => {
                self.enable_pending = matches!(self.wish.intent, Intent::Enable | Intent::Test);
            }
            Action::ResetFault => {
                // The reset is a pulse, of the control word or a procedure command; the axis stays without torque.
                self.action = Action::TorqueOff;
                self.drive_reset_wanted = true;
            }
            action => self.action = action,
        }
        if let Some(cause) = transition.fault
            && self.fault.is_none()
        {
            self.raise(now, system, Fault::new(cause, system));
        }
    }
}
