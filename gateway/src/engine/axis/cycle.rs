//! What an axis does in a cycle of its bus: from the drive's telegram to feedback and faults, and from set-points to the next
//! telegram. In between stands the state machine: whatever changes its state goes through [`AxisChannel::follow`].

use super::counters::Sample;
use super::diagnosis::{Kind, Shown, Shows};
use super::guard::{Finding, Lead, way};
use super::orders::ResetStep;
use super::overtravel::Motion;
use super::procedure::{ProcedureUnit, Surroundings};
use super::slow_values::SlowValues;
use super::start_stop::StartStop;
use super::{AxisChannel, Loss, START_TIME_OUT, STOP_TIME_OUT};
use crate::engine::cyclic::{Cycle, Received};
use crate::mapping::{DriveProgram, Item, Order as Told};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::fault_set::Origin;
use profile_generic::image::{AxisCommand, CommandSet, FeedbackSet, Signal, StatusBits};
use profile_generic::interpolation::Quality;
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::sequence::{Order, Sensed, SequenceStep, StopPlan};
use profile_generic::state::{Action, DriveState, Event, Report, Request, Transition};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

impl AxisChannel {
    // ---- from the drive ----------------------------------------------------------------------------------------

    /// Takes what the drive's connection brought in this cycle; its values were captured at `sampled`.
    pub fn from_drive(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        sampled: MonotonicTime,
        received: Option<Received<'_>>,
    ) {
        if self.south().is_none() {
            return self.tick(now, system);
        }
        let Some(received) = received.filter(|received| received.alive) else {
            // Not connected yet, or more losses in a row than the connection bears.
            self.age_feedback();
            self.supervision.restart_plausibility();
            self.totals.restart_position();
            return self.report(now, system, Report::Silent);
        };
        if !received.fresh {
            self.age_feedback();
            if received.at.is_none() {
                self.link.lost_telegrams = self.link.lost_telegrams.saturating_add(1);
            }
            return self.tick(now, system);
        }
        let sampled = received.at.unwrap_or(sampled);
        let referenced = self.feedback.status.contains(StatusBits::REFERENCED);
        let led = self.procedure.leads();
        if !self.link.decode(received.data, led, &self.command, &mut self.feedback) {
            return;
        }
        self.take_position(sampled, received.data, referenced);
        self.take_acceleration(sampled);
        self.sense_halt(now);
        let moved = self.may_move();
        self.report(now, system, self.feedback.report);
        self.advance_procedure(now);
        self.judge_position(now, system, sampled);
        self.count(sampled);
        self.watch(now, system, moved);
    }

    fn age_feedback(&mut self) {
        self.feedback.fresh = false;
        self.feedback.age_cycles = self.feedback.age_cycles.saturating_add(1);
    }

    /// Takes the position of a fresh telegram; `referenced` is whether the one before had a reference.
    fn take_position(&mut self, sampled: MonotonicTime, data: &[u8], referenced: bool) {
        let refers = self.feedback.status.contains(StatusBits::REFERENCED);
        if referenced && !refers {
            self.procedure.lose_reference();
        }
        self.feedback.fresh = true;
        self.feedback.age_cycles = 0;
        self.feedback.at = sampled;
        let Some(program) = self.link.program() else { return };
        if !self.feedback.present.contains(FeedbackSet::POSITION) {
            return;
        }
        let position = self.feedback.position;
        if referenced != refers {
            // The drive counts from another place.
            self.supervision.restart();
            self.totals.restart_position();
        }
        if !program.tells(Signal::VelocityActual) {
            self.feedback.present.remove(FeedbackSet::VELOCITY);
            if let Some(velocity) = self.supervision.velocity(position, sampled) {
                self.feedback.set(Signal::VelocityActual, velocity.get());
            }
        }
        self.captures.sample(program.captures(), data, position, sampled);
    }

    /// The acceleration of a drive that reports none: from velocities of earlier cycles.
    fn take_acceleration(&mut self, sampled: MonotonicTime) {
        if !self.link.program().is_some_and(|program| program.derives(Signal::AccelerationActual)) {
            return;
        }
        self.feedback.present.remove(FeedbackSet::ACCELERATION);
        let filter = self.start_stop.settings.acceleration_filter;
        let velocity = self.feedback.get(Signal::VelocityActual).map(Velocity);
        let found = velocity.and_then(|velocity| self.supervision.acceleration(velocity, sampled, filter));
        if let Some(acceleration) = found {
            self.feedback.set(Signal::AccelerationActual, acceleration.get());
        }
    }

    /// Adds the torque that is fed forward to the trim, for a drive that adds it both in the commanded mode and in the one that it
    /// shows; `lead` is whether the axis follows set-points.
    fn feed_forward(&mut self, shown: ModeSelection, lead: bool) {
        let commanded = self.command.selection();
        let feed_forward = self.start_stop.settings.feed_forward;
        let Some(program) = self.link.program().filter(|_| lead && feed_forward.gain != 0) else { return };
        let closes_loop = matches!(commanded.mode, OperatingMode::Position | OperatingMode::Velocity);
        let carried = program.carries(commanded) & program.carries(shown);
        if !closes_loop
            || !carried.contains(CommandSet::TORQUE_OFFSET)
            || !program.keeps(Parameter::ACCELERATION_FEED_FORWARD_GAIN)
        {
            return;
        }
        let Some(turns) = program.motor_turns_per_unit() else { return };
        // It is what the set-points come to, also of a controller that commands positions alone.
        let acceleration = self.set_points.acceleration();
        self.command.set(Signal::AccelerationCommand, acceleration.get());
        let torque = self.command.torque_offset.saturating_add(feed_forward.torque(acceleration, turns));
        self.command.set(Signal::TorqueOffset, torque.get());
    }

    /// A drive that knows no halt has halted when it stands: nothing in its status word would say so.
    fn sense_halt(&mut self, now: MonotonicTime) {
        let with_torque = matches!(self.feedback.report, Report::Operating | Report::Enabling);
        if self.halts_by_command() && with_torque {
            if self.start_stop.stands(self.feedback.velocity) {
                self.feedback.report = Report::Halted;
                self.start_stop.halted_at.get_or_insert(self.feedback.position);
            }
        } else {
            self.start_stop.halted_at = None;
            self.feedback.report = self.link.report(now, self.feedback.report, self.state());
        }
    }

    pub(in crate::engine) fn report(&mut self, now: MonotonicTime, system: SystemTime, report: Report) {
        self.feedback.report = report;
        self.supervision.hear(now, report);
        let shows = Shows::of(&self.feedback);
        self.diagnosis.follow(shows);
        if !shows.error {
            self.faults.end_all(Origin::Drive, |_| false);
        }
        if !shows.warning {
            self.faults.end_all(Origin::Warning, |_| false);
        }
        if report == Report::Silent && self.state() != DriveState::NotReady {
            // Also when another fault has stopped it: the drive cannot be reset before it is back.
            self.faults.raise(Fault::new(FaultCause::SOUTH_SILENCE, system), Origin::Event);
        }
        if !shows.error {
            self.diagnosis.end_search();
        } else if !self.orders.has_reset() && !self.faults.set().has(Origin::Drive) {
            // A fault from its first telegram: the diagnosis says later which one, and may come too late to find any. While
            // a reset is under way the drive may still show what is being reset.
            let cause = FaultCause::DRIVE_SPECIFIC;
            self.drive_fault(now, system, cause, cause.default_reaction(), 0);
            self.diagnosis.want_cause(now);
        }
        let transition = self.drive.machine.report(report);
        self.follow(now, system, transition);
        self.tick(now, system);
    }

    /// Time passes, without a telegram of the drive: states and resets that have a limit come to it.
    pub fn tick(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.holds() {
            // A hold is a stop that has ended: a movement or a silence that follows has a time limit of its own.
            self.drive.since = now;
        }
        let limit = match self.state() {
            DriveState::Starting => Some(START_TIME_OUT),
            DriveState::Stopping | DriveState::FaultReaction => Some(STOP_TIME_OUT),
            _ => None,
        };
        let late = limit.is_some_and(|limit| now.since(self.drive.since) > limit);
        self.supervision.tick(now);
        if late || self.is_unseen() && self.state() == DriveState::FaultReaction {
            let transition = self.drive.machine.handle(Event::Timeout);
            self.follow(now, system, transition);
        }
        self.diagnosis.tick(now);
        self.advance_sequence(now, system);
        if self.orders.hold_unwanted {
            self.end_hold(now, system);
        }
        self.advance_reset(now, system);
        self.feedback.state = self.state();
        self.feedback.inhibits = self.drive.machine.conditions().inhibits;
        self.feedback.fault = self.faults.first();
    }

    /// Begins, carries on with or ends the procedure that the chosen mode stands for.
    fn advance_procedure(&mut self, now: MonotonicTime) {
        let around = Surroundings {
            now,
            operating: self.state() == DriveState::Operating && self.drive.action == Action::Enable,
            stands: self.start_stop.stands(self.feedback.velocity),
            follows: self.link.follows(),
            shown: self.link.shown(),
            status: self.link.status(),
        };
        let wanted = self.link.program().and_then(|program| program.procedure(self.command.selection()));
        self.procedure.want(wanted, &around);
        if self.procedure.has_shifted() {
            self.restart_position();
        }
        if let Some(selection) = self.procedure.selection() {
            (self.feedback.mode, self.feedback.interpolation) = (selection.mode, selection.interpolation);
        }
        let status = self.feedback.status.difference(ProcedureUnit::STATUS);
        self.feedback.status = status.union(self.procedure.status());
    }

    /// A position that the axis cannot have come to stops it: what goes by it would be as wrong.
    fn judge_position(&mut self, now: MonotonicTime, system: SystemTime, sampled: MonotonicTime) {
        let settled = self.is_settled();
        if let Some(jump) = self.supervision.jump(&self.feedback, sampled, settled) {
            self.raise(now, system, Fault::new(FaultCause::FEEDBACK_DATA_LOSS, system));
            self.faults.note_jump(system, jump);
            self.totals.restart_position();
        }
    }

    /// Whether positions go on from the last one: a drive that seeks its reference or starts up may count from another place at any
    /// moment.
    fn is_settled(&self) -> bool {
        self.procedure.selection().is_none() && self.state() != DriveState::NotReady
    }

    /// Counts what the axis has done in this cycle.
    fn count(&mut self, sampled: MonotonicTime) {
        let position = self.feedback.get(Signal::PositionActual).map(Position);
        self.totals.sample(&Sample {
            at: sampled,
            running: self.state() == DriveState::Operating,
            position: position.filter(|_| self.is_settled()),
            velocity: self.feedback.get(Signal::VelocityActual).map(Velocity),
            torque: self.feedback.get(Signal::TorqueActual).map(Torque),
            turns_per_unit: self.south().and_then(DriveProgram::motor_turns_per_unit),
        });
    }

    /// Whether the axis may be moving.
    fn may_move(&self) -> bool {
        let state = self.state();
        state != DriveState::Starting && state.may_have_torque()
    }

    /// The limits that the gateway itself watches. Passing one is a condition, and the north side has said what is to be done
    /// about it. It is over when the axis is not led any more. `moved` is whether the axis could move before the drive has
    /// spoken: a drive that stops by itself reports a switch and its fault at once.
    fn watch(&mut self, now: MonotonicTime, system: SystemTime, moved: bool) {
        let followed = self.state() == DriveState::Operating
            && self.command.selection() == OperatingMode::Position.into();
        let error = followed.then(|| self.command.position.saturating_sub(self.feedback.position));
        if self.feedback.get(Signal::FollowingError).is_none() {
            self.feedback.following_error = error.unwrap_or_default();
        }
        // In its own halt the drive comes to rest behind the last command, and shall.
        let error = error.filter(|_| self.drive.action == Action::Enable);
        let is_led = |axis: &Self| matches!(axis.state(), DriveState::Operating | DriveState::Testing);
        let of_user = self.start_stop.settings.user_limits.speed;
        let passed = self.supervision.passed_limits(&self.feedback, is_led(self), error, of_user);
        self.watch_conditions(now, system, &passed);
        let error = self.velocity_error();
        let torque = self.feedback.get(Signal::TorqueActual).filter(|_| is_led(self)).map(Torque);
        let tolerances = self.start_stop.settings.tolerances;
        let passed = self.supervision.tolerances.look(now, &tolerances, error, torque);
        self.watch_conditions(now, system, &passed);
        self.watch_user_limits(now, system);
        let motion = |axis: &Self| Motion {
            led: is_led(axis),
            moves: moved || axis.may_move(),
            position: axis.feedback.position,
            velocity: axis.feedback.velocity,
            zero_speed: axis.start_stop.settings.times.zero_speed,
        };
        // Before its homing is done nobody knows where the axis is; and a drive that homes looks for the switches, and turns
        // round at them.
        let homes = self.command.mode == OperatingMode::Homing;
        let passed = self.supervision.passed_software_limits(!homes, &motion(self));
        self.watch_conditions(now, system, &passed);
        let checked = !homes && self.start_stop.settings.checks_overtravel;
        let passed = self.supervision.passed_switches(self.feedback.status, checked, &motion(self));
        self.watch_conditions(now, system, &passed);
    }

    /// What the controller wants watched beside that, of an axis that is led or not.
    fn watch_user_limits(&mut self, now: MonotonicTime, system: SystemTime) {
        let limits = self.start_stop.settings.user_limits;
        let velocity = self.feedback.get(Signal::VelocityActual).map(Velocity);
        let torque = self.feedback.get(Signal::TorqueActual).map(Torque);
        let values = self.slow.at(now, |signal| self.feedback.get(signal));
        if let Some(torque) = torque {
            self.heats.sample(now, torque);
        }
        let charged = self.feedback.status.contains(StatusBits::POWER);
        let passed = limits.passed(values, charged);
        self.watch_conditions(now, system, &passed);
        self.feedback.status.remove(StatusBits::THRESHOLDS);
        self.feedback.status.insert(limits.thresholds(velocity, torque));
    }

    /// How much the velocity differs from the commanded one, which in position control is that of the commanded position; `None` while the
    /// drive does not follow one.
    fn velocity_error(&self) -> Option<Velocity> {
        let follows = self.state() == DriveState::Operating && self.drive.action == Action::Enable;
        let has_one = [OperatingMode::Position, OperatingMode::Velocity]
            .iter()
            .any(|mode| self.command.selection() == (*mode).into());
        (follows && has_one).then(|| self.command.velocity.saturating_sub(self.feedback.velocity))
    }

    /// Conditions that the gateway watches are there, or are not.
    pub(super) fn watch_conditions(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        conditions: &[(FaultCause, bool)],
    ) {
        for &(cause, is_there) in conditions {
            if is_there {
                self.notice(now, system, Fault::new(cause, system), Origin::Watch);
            } else {
                self.faults.end(cause, Origin::Watch);
            }
        }
    }

    /// A diagnostic word of the drive has been read, or could not be.
    pub fn diagnostic_word(&mut self, now: MonotonicTime, system: SystemTime, item: Item, word: Option<u32>) {
        let (program, shows) = (self.link.program(), Shows::of(&self.feedback));
        let Some(shown) = self.diagnosis.take(now, item, word, program, shows) else { return };
        let Shown { word, causes, kind } = shown;
        let here = |cause: FaultCause| causes.iter().any(|(known, _)| *known == cause);
        match kind {
            Kind::Errors => {
                self.faults.end_all(Origin::Drive, here);
                for (cause, reaction) in causes {
                    self.drive_fault(now, system, cause, reaction, word);
                }
            }
            Kind::Warnings { first, nameless } => {
                if first {
                    self.faults.end_all(Origin::Warning, here);
                }
                for (cause, reaction) in causes {
                    self.warn(now, system, Fault::new(cause, system).with_reaction(reaction), word);
                }
                if nameless {
                    // It warns, and no row of the tables says of what.
                    self.warn(now, system, Fault::new(FaultCause::DRIVE_WARNING, system), word);
                }
            }
        }
    }

    fn warn(&mut self, now: MonotonicTime, system: SystemTime, warning: Fault, word: u32) {
        if self.notice(now, system, warning.with_vendor_code(word), Origin::Warning) {
            self.diagnosis.message.want();
        }
    }

    /// The cause of an error of the drive is known, or is not known yet.
    pub(super) fn drive_fault(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        cause: FaultCause,
        reaction: Reaction,
        word: u32,
    ) {
        let refines = self.diagnosis.end_search();
        let fault = Fault::new(cause, system).with_reaction(reaction).with_vendor_code(word);
        let new = self.faults.raise(fault, Origin::Drive);
        if new {
            self.diagnosis.message.want();
        }
        // While a reset is under way the drive may still show what is being reset; what stands is found after it.
        if self.orders.resets() {
            return;
        }
        if refines {
            self.faults.refine(fault);
        }
        if new || self.faults.knows_nothing_better() {
            let fault = self.faults.decided(fault, Origin::Drive);
            self.take_fault(now, system, fault);
        }
    }

    /// The drive is gone: until it is commissioned again there is nobody to speak to.
    pub fn lose_south(&mut self, now: MonotonicTime, system: SystemTime) {
        self.end_south(now, system, Report::Silent);
    }

    /// The bus is taken down while the axis is without torque: the drive is not ready, and nothing is wrong.
    pub fn leave_south(&mut self, now: MonotonicTime, system: SystemTime) {
        self.end_south(now, system, Report::NotReady);
    }

    fn end_south(&mut self, now: MonotonicTime, system: SystemTime, report: Report) {
        self.feedback.fresh = false;
        self.feedback.present = FeedbackSet::empty();
        self.feedback.following_error = Position::ZERO;
        self.diagnosis = super::Diagnosis::default();
        self.faults.end_all(Origin::Drive, |_| false);
        self.faults.end_all(Origin::Warning, |_| false);
        self.supervision.restart();
        self.totals.restart_position();
        self.report(now, system, report);
        self.link.disconnect();
        self.captures.restart();
        self.procedure.restart(&[]);
        self.feedback.status.remove(ProcedureUnit::STATUS | StatusBits::INPUTS | StatusBits::THRESHOLDS);
        self.slow = SlowValues::default();
    }

    // ---- faults ------------------------------------------------------------------------------------------------

    /// A fault that the gateway itself has found, and for which it stops the axis whatever the north side wants.
    pub(super) fn raise(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
        self.faults.raise(fault, Origin::Event);
        let fault = self.faults.decided(fault, Origin::Event);
        self.take_fault(now, system, fault);
    }

    /// Something is wrong that stops nothing by itself; returns whether it is new. Whether it stops the axis is for the north
    /// side to have said.
    pub(super) fn notice(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        fault: Fault,
        origin: Origin,
    ) -> bool {
        let new = self.faults.raise(fault, origin);
        if new {
            let fault = self.faults.decided(fault, origin);
            self.react(now, system, fault);
        }
        new
    }

    /// Stops an axis with torque for a fault whose reaction is a stop. Without torque there is nothing to stop.
    fn react(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
        if fault.reaction.stops() && self.may_have_torque() {
            self.take_fault(now, system, fault);
        }
    }

    /// Reacts to everything that is there: the reactions are others, or the axis gets torque.
    pub(super) fn react_to_all(&mut self, now: MonotonicTime, system: SystemTime) {
        for fault in self.faults.all_decided() {
            self.react(now, system, fault);
        }
    }

    /// Stops the axis for a fault, by the reaction that is decided for it.
    pub fn take_fault(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
        self.faults.stop_for(fault);
        // An order from before the fault does not switch the axis on after the reset.
        self.orders.forget_pending();
        let transition = self.drive.machine.raise_fault(fault.reaction);
        self.follow(now, system, transition);
    }

    /// A set-point is beyond a limit: it is not followed, and the axis stops.
    pub(super) fn trip(&mut self, now: MonotonicTime, system: SystemTime, finding: Finding) {
        self.raise(now, system, Fault::new(finding.cause, system));
        self.faults.note_trip(finding.cause, system, finding.trip);
    }

    // ---- the state machine -------------------------------------------------------------------------------------

    pub(in crate::engine) fn request(&mut self, now: MonotonicTime, system: SystemTime, request: Request) {
        let is_start = matches!(request, Request::Enable | Request::Test);
        if is_start && !self.may_start() {
            return;
        }
        let transition = self.drive.machine.request(request);
        if is_start && transition.action == Action::Reject {
            self.orders.reject_enable(now);
        }
        self.follow(now, system, transition);
    }

    pub(super) fn follow(&mut self, now: MonotonicTime, system: SystemTime, transition: Transition) {
        let changes = self.feedback.state != transition.next;
        if changes {
            self.drive.since = now;
            self.orders.hold_unwanted = false;
            self.follow_sequence(now, transition.next);
            self.feedback.state = transition.next;
        }
        match transition.action {
            // What a rejection means depends on the request: see `request`.
            Action::None | Action::Reject => {}
            Action::ResetFault => {
                // The reset is a pulse, of the control word or a procedure command; the axis stays without torque.
                self.drive.action = Action::TorqueOff;
                self.orders.drive_reset_wanted = true;
            }
            action => self.drive.action = action,
        }
        if let Some(cause) = transition.fault
            && self.faults.first().is_none()
        {
            self.raise(now, system, Fault::new(cause, system));
        }
        if changes && transition.next == DriveState::Starting {
            // What stands already and stops an axis lets none start.
            self.react_to_all(now, system);
        }
    }

    /// The state machine goes to another state: a sequence that it does not fit into ends.
    fn follow_sequence(&mut self, now: MonotonicTime, next: DriveState) {
        match next {
            DriveState::Starting => self.prepare_start(now),
            DriveState::Operating | DriveState::Testing => {}
            _ => {
                self.set_points.caught = None;
                self.start_stop.follow(now, next);
            }
        }
    }

    /// The axis begins to start: it stands where it is, or goes on as fast as it is, until the controller's first
    /// set-points.
    pub(super) fn prepare_start(&mut self, now: MonotonicTime) {
        let for_test = self.state() != DriveState::Operating && self.hookup.needs_torque();
        let caught = self.start_stop.start(now, for_test, self.feedback.velocity);
        self.set_points.caught = caught;
        self.set_points.end();
        self.set_points.start(&self.feedback);
        let mode = match caught {
            // What a test is to find out is whether a position loop would hold at all.
            _ if for_test => OperatingMode::Torque,
            Some(_) => OperatingMode::Velocity,
            None => OperatingMode::Position,
        };
        // A drive that is not used in that mode starts in its own.
        let other = self.south().filter(|program| !program.has_mode(mode)).and_then(DriveProgram::first_mode);
        self.command.select(other.unwrap_or(mode.into()));
    }

    fn sensed(&self) -> Sensed {
        StartStop::sensed(&self.feedback, self.state(), self.drive.action)
    }

    pub(super) fn begin_stop(&mut self, now: MonotonicTime, system: SystemTime, plan: StopPlan) {
        match self.start_stop.stop(now, plan, &self.sensed()) {
            Some(order) => self.carry_out(now, system, order),
            // The state machine may know of torque that no sequence does.
            None => self.request(now, system, Request::Disable),
        }
    }

    /// Time passes in a start or stop.
    fn advance_sequence(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.state() == DriveState::Operating && self.start_stop.is_late(now) {
            // Out of a hold the drive does not follow again.
            let fault = Fault::new(FaultCause::START_TIME_OUT, system);
            self.raise(now, system, fault.with_reaction(Reaction::DecelerateAndDisable));
        }
        if let Some(order) = self.start_stop.poll(now, &self.sensed()) {
            self.carry_out(now, system, order);
        }
    }

    fn carry_out(&mut self, now: MonotonicTime, system: SystemTime, order: Order) {
        match order {
            Order::Enable => self.request(now, system, Request::Enable),
            Order::TorqueOff => self.request(now, system, Request::Coast),
            Order::Disable => self.request(now, system, Request::Disable),
            Order::Halt => self.request(now, system, Request::Stop),
            Order::Ramp => {
                let (acts_at, actual) = (self.set_points.acts_at(), self.feedback.velocity);
                let by_velocity =
                    self.south().is_some_and(|program| program.has_mode(OperatingMode::Velocity));
                if !self.start_stop.begin_ramp(acts_at, &mut self.command, actual, by_velocity) {
                    self.begin_stop(now, system, self.start_stop.by_drive());
                }
            }
            Order::TimeOut => {
                let fault = Fault::new(FaultCause::STOP_TIME_OUT, system);
                self.raise(now, system, fault.with_reaction(Reaction::CoastAndDisable));
            }
        }
    }

    /// Takes the torque away from an axis that holds its position; the fault stays.
    pub(super) fn end_hold(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.holds() {
            let transition = self.drive.machine.clear_faults();
            self.follow(now, system, transition);
            self.request(now, system, Request::FaultReset);
        }
    }

    /// A stop under way is not interrupted: faults are reset once the axis is without torque.
    pub(super) fn advance_reset(&mut self, now: MonotonicTime, system: SystemTime) {
        if !self.orders.has_reset() {
            return;
        }
        self.end_hold(now, system);
        let stops = matches!(self.state(), DriveState::FaultReaction | DriveState::Stopping);
        let begins = self.orders.advance_reset(now, stops) == Some(ResetStep::Clear);
        let silent = self.feedback.report == Report::Silent;
        if begins || silent && self.orders.resets() {
            self.faults.reset(silent);
            self.diagnosis.end_search();
        }
        // A drive that is not heard is not reset: the axis stays faulted until a reset after it is heard again.
        let lost = silent && self.faults.first().is_some();
        if begins && !lost {
            let transition = self.drive.machine.clear_faults();
            self.follow(now, system, transition);
            self.request(now, system, Request::FaultReset);
        }
        let faulted = self.state() == DriveState::Faulted;
        if self.orders.end_reset(now, faulted, lost) == Some(ResetStep::Abandon) {
            self.drive.machine.abandon_reset();
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
        let (passed, elapsed) = self.set_points.begin_cycle(cycle);
        let lead = self.fine_command(now, system, passed);
        self.hand_over(now, system);
        let limits = (&self.supervision.limits, self.link.program().and_then(DriveProgram::position_step));
        let (actual, times) = (self.feedback.velocity, (cycle.span, elapsed));
        if let Some(finding) = self.set_points.judge(&mut self.command, lead, actual, limits, times) {
            self.trip(now, system, finding);
        }
        let Some(telegram) = telegram.filter(|_| self.south().is_some()) else { return false };
        let pulsed = self.link.pulsed(self.drive.action);
        let order = Told {
            action: if self.moves { pulsed } else { Action::TorqueOff },
            told: self.procedure.told(),
            asks: self.procedure.is_requested(),
        };
        let saturated = self.link.encode(now, &self.command, order, telegram);
        if let Some(program) = self.link.program() {
            self.captures.encode(program.captures(), telegram);
        }
        if saturated > 0 && self.state() == DriveState::Operating {
            // The drive would be led elsewhere than the controller means.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
        }
        true
    }

    /// Whether the command is what the drive shall follow, and not a procedure.
    fn command_leads(&self) -> bool {
        self.state() == DriveState::Operating
            && self.drive.action == Action::Enable
            && self.procedure.told().is_none()
    }

    /// Goes on with handing the target over, where the drive takes it over step by step.
    fn hand_over(&mut self, now: MonotonicTime, system: SystemTime) {
        let leads = self.command_leads();
        let wanted = self.command.present.contains(CommandSet::TARGET_POSITION) && self.set_points.any();
        if !self.link.hand_over(now, &self.command, leads, wanted) {
            // It goes on to the target of before, or nowhere.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
        }
    }

    /// Works out the set-points of this cycle, in which a time has `passed`, and returns who leads the axis. A drive that does not follow
    /// is shown its own position: it will not jump when it begins to.
    fn fine_command(&mut self, now: MonotonicTime, system: SystemTime, passed: DurationNs) -> Lead {
        let test_torque = self.run_test(now, system);
        let operating = self.state() == DriveState::Operating;
        // What comes while the axis is halted leads it nowhere, now or later.
        let halts = self.drive.action == Action::Halt;
        let mut points = self.command;
        let counts = operating && !halts && self.takes_set_points();
        let ramp = (&self.start_stop.settings.ramp, passed);
        let fine = self.set_points.write(counts, ramp, &mut points);
        match fine {
            Some(Quality::Lost) => self.lose_command(now, system, Loss::Silent),
            Some(_) => (),
            None => {
                // What the controller had added to its set-points ends with them.
                self.command.velocity_offset = Velocity::ZERO;
                self.command.torque_offset = Torque::ZERO;
                let (acts_at, caught) = (self.set_points.acts_at(), self.set_points.caught);
                let (position, velocity) = self.start_stop.led_by_gateway(acts_at, caught);
                let torque = self.start_stop.started_for_test.then_some(test_torque);
                let values =
                    [position.map(Position::get), velocity.map(Velocity::get), None, torque.map(Torque::get)];
                points.put_set_points(values);
            }
        }
        self.watch_mode(now, system);
        let rests = self.start_stop.halted_at.filter(|_| self.halts_by_command());
        let led = self.is_led_by_position(operating);
        self.complete(points, operating, led, rests, passed);
        let lead = fine.is_some_and(|quality| quality != Quality::Lost);
        let shown = self.feedback.selection();
        self.set_points.trims.write(&mut self.command, shown, self.link.program(), lead);
        self.feed_forward(shown, lead);
        match fine {
            Some(_) if lead => Lead::SetPoints,
            _ if rests.is_some() => Lead::Nobody,
            // It holds, or ramps down.
            _ if led || fine.is_some() => Lead::Gateway,
            _ => Lead::Nobody,
        }
    }

    /// Where the axis stops by itself or is led by velocity or torque, the position of its last command would pull at it;
    /// only a drive that knows no halt has nothing else to hold by.
    fn is_led_by_position(&self, operating: bool) -> bool {
        let position = self.command.selection() == OperatingMode::Position.into();
        let drive_leads = self.start_stop.drive_leads(self.drive.action);
        operating && (position && !drive_leads || self.stands_by_command())
    }

    /// Puts the set-points of this cycle into the command, and what they leave out after the motion there is.
    fn complete(
        &mut self,
        mut points: AxisCommand,
        operating: bool,
        led: bool,
        rests: Option<Position>,
        passed: DurationNs,
    ) {
        let last = self.command;
        let given = points.present;
        // Until the drive shows the new operating mode it goes on by the values of the old one.
        let still = |mode: OperatingMode| {
            let mode = ModeSelection::from(mode);
            operating && self.feedback.selection() == mode && last.selection() != mode
        };
        // A drive that brakes by itself comes to rest behind its last command, which is moved there while the drive halts.
        let rest = if still(OperatingMode::Position) {
            last.position.saturating_add(way(
                if given.contains(CommandSet::VELOCITY) { points.velocity } else { last.velocity },
                passed,
            ))
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
        for (signal, value) in [
            (Signal::PositionCommand, rest.get()),
            (Signal::VelocityCommand, speed.get()),
            (Signal::AccelerationCommand, 0),
            (Signal::TorqueCommand, kept(OperatingMode::Torque, last.torque.0)),
        ] {
            if points.get(signal).is_none() {
                points.set(signal, value);
            }
        }
        self.command.take_set_points(&points);
    }

    /// Goes on with a hookup test; returns the torque for this cycle.
    fn run_test(&mut self, now: MonotonicTime, system: SystemTime) -> Torque {
        // Not before the brake is open.
        let led = self.state() == DriveState::Testing && self.sequence_step() == SequenceStep::Running;
        let step = self.hookup.step(now, &self.feedback, self.supervision.limits.hookup, led);
        if step.ends {
            // The drive stops in this very cycle, and the motion device hears of it in the next.
            let transition = self.drive.machine.handle(Event::TestComplete);
            self.follow(now, system, transition);
        }
        step.torque
    }

    /// A drive that does not come to the operating mode that it is told follows values that are meant for no one.
    fn watch_mode(&mut self, now: MonotonicTime, system: SystemTime) {
        // A drive that is led through a procedure is told another mode, with times of its own.
        let expected = self.south().and_then(|program| program.shown_in(self.command.selection()));
        let other = expected.is_some_and(|mode| self.link.shown() != Some(mode));
        if self.set_points.misses_mode(now, other && self.command_leads()) {
            self.raise(now, system, Fault::new(FaultCause::ILLEGAL_MODE, system));
        }
    }

    /// Whether set-points lead the axis in the chosen mode, and not the drive.
    pub(super) fn takes_set_points(&self) -> bool {
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
        let beside = !self.procedure.leads() || program.acknowledges() && self.link.follows();
        program.procedure(self.command.selection()).is_some() && beside
    }

    /// Whether the drive is to halt and has no halt of its own: then its command stands still.
    fn halts_by_command(&self) -> bool {
        self.drive.action == Action::Halt && self.south().is_some_and(|program| !program.acknowledges())
    }
}
