//! From the drive to the axis: feedback, limits that the box watches, faults and their causes.

use super::diagnosis::CAUSE_TIME_OUT;
use super::procedure::{ProcedureUnit, Surroundings};
use super::{
    AxisChannel, MODE_TIME_OUT, SILENCE_TIME_OUT, START_TIME_OUT, STOP_TIME_OUT, caused_by_controller,
};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::fault_set::Origin;
use profile_generic::image::{FeedbackSet, Signal, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::state::{Action, DriveState, Event, Report};
use profile_generic::time::{MonotonicTime, SystemTime};

use crate::engine::bus::Received;

impl AxisChannel {
    /// Takes what the drive's connection brought in this cycle; its values were captured at `sampled`.
    pub fn from_drive(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        sampled: MonotonicTime,
        received: Option<Received<'_>>,
    ) {
        let Some((program, cached)) = self.south.as_mut() else {
            self.tick(now, system);
            return;
        };
        let Some(received) = received.filter(|received| received.alive) else {
            // Not connected yet, or more losses in a row than the connection bears.
            self.age_feedback();
            self.plausibility.restart();
            self.report(now, system, Report::Silent);
            return;
        };
        let sampled = received.at.unwrap_or(sampled);
        if !received.fresh {
            self.age_feedback();
            if received.at.is_none() {
                self.counters.lost_telegrams = self.counters.lost_telegrams.saturating_add(1);
            }
            self.tick(now, system);
            return;
        }
        let mut conversions = ConversionReport::default();
        let led = self.procedure.leads();
        let referenced = self.feedback.status.contains(StatusBits::REFERENCED);
        let status = program.decode(received.data, led, &mut self.feedback, cached, &mut conversions);
        let Some(status) = status else { return };
        let tells_velocity = program.tells(Signal::VelocityActual);
        self.status = status;
        self.shown = program.mode(status);
        if program.handshake(self.command.selection()).is_some() && !self.handshake.is_done(&self.command) {
            // It has come to the target of before.
            self.feedback.status.remove(StatusBits::TARGET_REACHED);
        }
        self.follows = program.report(status) == Report::Operating;
        if referenced && !self.feedback.status.contains(StatusBits::REFERENCED) {
            self.procedure.lose_reference();
        }
        self.feedback.fresh = true;
        self.feedback.age_cycles = 0;
        self.feedback.at = sampled;
        if self.feedback.present.contains(FeedbackSet::POSITION) {
            let position = self.feedback.position;
            if referenced != self.feedback.status.contains(StatusBits::REFERENCED) {
                // The drive counts from another place.
                self.velocimeter.restart();
                self.plausibility.restart();
            }
            if !tells_velocity {
                self.feedback.present.remove(FeedbackSet::VELOCITY);
                if let Some(velocity) = self.velocimeter.sample(position, sampled) {
                    self.feedback.set(Signal::VelocityActual, velocity.get());
                }
            }
            self.captures.sample(program.captures(), received.data, position, sampled);
        }
        let zero_speed = self.stop_settings.times.zero_speed.get().unsigned_abs();
        let stands = self.feedback.velocity.get().unsigned_abs() <= zero_speed;
        let with_torque = matches!(self.feedback.report, Report::Operating | Report::Enabling);
        if !program.acknowledges() && self.action == Action::Halt && with_torque {
            if stands {
                // Nothing in its status word would say so.
                self.feedback.report = Report::Halted;
                self.halted_at.get_or_insert(self.feedback.position);
            }
        } else {
            self.halted_at = None;
            if self.feedback.report == Report::Enabling && now.since(self.told_since) <= MODE_TIME_OUT {
                // It changes the operating mode: it follows again in a moment.
                let changes = self.drive.machine.state() == DriveState::Operating
                    && program.mode_octet(status).is_some();
                self.feedback.report = if changes { Report::Operating } else { Report::Enabling };
            }
        }
        self.count_saturated(conversions.saturated);
        let report = self.feedback.report;
        let moved = self.may_move();
        self.report(now, system, report);
        self.advance_procedure(now);
        self.judge_position(now, system, sampled);
        self.watch(system);
        self.watch_software_limits(system, moved);
        self.watch_limit_switches(system, moved);
    }

    /// Begins, carries on with or ends the procedure that the chosen mode stands for.
    fn advance_procedure(&mut self, now: MonotonicTime) {
        let zero_speed = self.stop_settings.times.zero_speed.get().unsigned_abs();
        let around = Surroundings {
            now,
            operating: self.state() == DriveState::Operating && self.action == Action::Enable,
            stands: self.feedback.velocity.get().unsigned_abs() <= zero_speed,
            follows: self.follows,
            shown: self.shown,
            status: self.status,
        };
        let mut unit = self.procedure;
        unit.want(self.south().and_then(|program| program.procedure(self.command.selection())), &around);
        self.procedure = unit;
        if unit.has_shifted()
            && let Some((_, cached)) = &mut self.south
        {
            // The drive has given its place another position: it is what the drive says, not so many turns more.
            cached.restart();
            self.plausibility.restart();
        }
        if let Some(selection) = unit.selection() {
            (self.feedback.mode, self.feedback.interpolation) = (selection.mode, selection.interpolation);
        }
        self.feedback.status = self.feedback.status.difference(ProcedureUnit::STATUS).union(unit.status());
    }

    /// A position that the axis cannot have come to stops it: what goes by it would be as wrong.
    fn judge_position(&mut self, now: MonotonicTime, system: SystemTime, sampled: MonotonicTime) {
        // A drive that seeks its reference or starts up may count from another place at any moment.
        if self.procedure.selection().is_some() || self.state() == DriveState::NotReady {
            return self.plausibility.restart();
        }
        if !self.feedback.present.contains(FeedbackSet::POSITION) {
            return;
        }
        let judged = self.plausibility.judge(self.feedback.position, sampled, self.limits.velocity);
        if let Some(jump) = judged {
            self.raise(now, system, Fault::new(FaultCause::FEEDBACK_DATA_LOSS, system));
            self.jump = Some((system, jump));
        }
    }

    pub(super) fn age_feedback(&mut self) {
        self.feedback.fresh = false;
        self.feedback.age_cycles = self.feedback.age_cycles.saturating_add(1);
    }

    pub(super) fn report(&mut self, now: MonotonicTime, system: SystemTime, report: Report) {
        self.feedback.report = report;
        self.silent_since = (report == Report::Silent).then(|| self.silent_since.unwrap_or(now));
        self.end_drive_faults();
        if report == Report::Silent && self.state() != DriveState::NotReady {
            // Also when another fault has stopped it: the drive cannot be reset before it is back.
            self.faults.raise(Fault::new(FaultCause::SOUTH_SILENCE, system), Origin::Event);
        }
        if !self.shows_error() {
            self.cause_wanted = None;
        } else if self.reset.is_none() && !self.faults.has(Origin::Drive) {
            // A fault from its first telegram: the diagnosis says later which one, and may come too late to find any. While
            // a reset is under way the drive may still show what is being reset.
            self.undiagnosed_fault(now, system);
        }
        let transition = self.drive.machine.report(report);
        self.follow(now, system, transition);
        self.tick(now, system);
    }

    /// Time passes in a state that has a limit.
    pub(super) fn tick(&mut self, now: MonotonicTime, system: SystemTime) {
        let limit = match self.state() {
            DriveState::Starting => Some(START_TIME_OUT),
            // A hold is a stop that has ended.
            DriveState::FaultReaction if self.holds() => None,
            DriveState::Stopping | DriveState::FaultReaction => Some(STOP_TIME_OUT),
            _ => None,
        };
        let late = limit.is_some_and(|limit| now.since(self.drive.since) > limit);
        self.unseen = self.silent_since.is_some_and(|since| now.since(since) > SILENCE_TIME_OUT);
        if late || self.unseen && self.state() == DriveState::FaultReaction {
            let transition = self.drive.machine.handle(Event::Timeout);
            self.follow(now, system, transition);
        }
        // Nothing but how often its words are read depends on it.
        self.cause_wanted.take_if(|since| now.since(*since) > CAUSE_TIME_OUT);
        self.advance_sequence(now, system);
        self.advance_reset(now, system);
        self.feedback.state = self.state();
        self.feedback.inhibits = self.drive.machine.conditions().inhibits;
        self.feedback.fault = self.fault;
    }

    /// The limits that the box itself watches while it leads the axis. Passing one stops nothing by itself: it is a
    /// condition, and the controller has said what is to be done about it. It is over when the axis is not led any more.
    pub(super) fn watch(&mut self, system: SystemTime) {
        let operating = self.state() == DriveState::Operating;
        let led = operating || self.state() == DriveState::Testing;
        let position = self.feedback.position;
        let speed = self.feedback.velocity.get().unsigned_abs();
        let too_fast = |limit: Velocity| {
            speed > limit.get().unsigned_abs().saturating_add(limit.get().unsigned_abs() / 10)
        };
        let too_fast = self.limits.velocity.is_some_and(too_fast);
        let mut astray = false;
        if operating && self.command.selection() == OperatingMode::Position.into() {
            let error = self.command.position.get().saturating_sub(position.get());
            if self.feedback.get(profile_generic::image::Signal::FollowingError).is_none() {
                self.feedback.following_error = Position(error);
            }
            let limit = self.limits.following_error;
            astray = limit.is_some_and(|limit| error.unsigned_abs() > limit.get().unsigned_abs());
        }
        for (cause, there) in [
            (FaultCause::MOTOR_OVER_SPEED_USER_LIMIT, too_fast),
            (FaultCause::EXCESSIVE_POSITION_ERROR, astray),
            (FaultCause::HOMING, self.feedback.status.contains(StatusBits::HOMING_FAILED)),
        ] {
            if led && there {
                self.faults.raise(Fault::new(cause, system), Origin::Watch);
            } else {
                self.faults.clear(cause, Origin::Watch);
            }
        }
    }

    /// A fault that the gateway itself has found, and for which it stops the axis whatever the controller wants.
    pub(super) fn raise(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
        if !caused_by_controller(fault.cause) {
            self.faults.raise(fault, Origin::Event);
        }
        self.take_fault(now, system, fault);
    }

    /// Stops the axis for a fault.
    pub fn take_fault(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
        // What the drive has is worth more to know than that the controller had stopped it.
        let weightier =
            |known: Fault| caused_by_controller(known.cause) && !caused_by_controller(fault.cause);
        if self.fault.is_none_or(weightier) {
            self.fault = Some(fault);
            self.counters.faults = self.counters.faults.saturating_add(1);
        }
        let transition = self.drive.machine.raise_fault(fault.reaction);
        self.follow(now, system, transition);
    }
}
