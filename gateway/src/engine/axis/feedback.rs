//! From the drive to the axis: feedback, limits that the box watches, faults and their causes.

use super::{AxisChannel, CAUSE_TIME_OUT, START_TIME_OUT, STOP_TIME_OUT, caused_by_controller};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::state::{DriveState, Event, Report};
use profile_generic::time::{MonotonicTime, SystemTime};
use profile_sercos::master::connection::{Consumer, ConsumerState};

impl AxisChannel {
    /// Takes what the drive's connection brought in this cycle.
    pub fn from_drive(&mut self, now: MonotonicTime, system: SystemTime, consumer: Option<Consumer<'_>>) {
        let Some((program, trackers)) = self.south.as_mut() else {
            self.tick(now, system);
            return;
        };
        let consumer = consumer
            .filter(|consumer| matches!(consumer.state, ConsumerState::Consuming | ConsumerState::Warning));
        let Some(consumer) = consumer else {
            // Not connected yet, or more losses in a row than the connection bears.
            self.age_feedback();
            self.report(now, system, Report::Silent);
            return;
        };
        if !consumer.fresh {
            self.age_feedback();
            self.counters.lost_telegrams = self.counters.lost_telegrams.saturating_add(1);
            self.tick(now, system);
            return;
        }
        let mut conversions = ConversionReport::default();
        if program.decode(consumer.data, &mut self.feedback, trackers, &mut conversions).is_none() {
            return;
        }
        self.count_saturated(conversions.saturated);
        self.feedback.fresh = true;
        self.feedback.age_cycles = 0;
        self.feedback.at = system;
        let report = self.feedback.report;
        self.report(now, system, report);
        self.watch(now, system);
    }

    pub(super) fn age_feedback(&mut self) {
        self.feedback.fresh = false;
        self.feedback.age_cycles = self.feedback.age_cycles.saturating_add(1);
    }

    pub(super) fn report(&mut self, now: MonotonicTime, system: SystemTime, report: Report) {
        self.feedback.report = report;
        let faulted = matches!(report, Report::Faulted | Report::FaultReaction);
        let unknown = self.fault.is_none_or(|fault| caused_by_controller(fault.cause));
        if !faulted {
            self.cause_wanted = None;
        } else if unknown && self.reset.is_none() && self.cause_wanted.is_none() {
            // While a reset is under way the drive may still show what is being reset.
            self.cause_wanted = Some(now);
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
        if limit.is_some_and(|limit| now.since(self.drive.since) > limit) {
            let transition = self.drive.machine.handle(Event::Timeout);
            self.follow(now, system, transition);
        }
        if self.cause_wanted.is_some_and(|since| now.since(since) > CAUSE_TIME_OUT) {
            self.set_cause(
                now,
                system,
                FaultCause::DRIVE_SPECIFIC,
                FaultCause::DRIVE_SPECIFIC.default_reaction(),
                0,
            );
        }
        self.go_on_with_reset(now, system);
        self.feedback.state = self.state();
        self.feedback.inhibits = self.drive.machine.conditions().inhibits;
        self.feedback.fault = self.fault;
    }

    /// The limits that the box itself watches.
    pub(super) fn watch(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.state() != DriveState::Operating || self.fault.is_some() {
            return;
        }
        let speed = self.feedback.velocity.get().unsigned_abs();
        let too_fast = |limit: Velocity| {
            speed > limit.get().unsigned_abs().saturating_add(limit.get().unsigned_abs() / 10)
        };
        if self.limits.velocity.is_some_and(too_fast) {
            self.raise(now, system, Fault::new(FaultCause::MOTOR_OVER_SPEED_USER_LIMIT, system));
        }
        if self.command.mode == OperatingMode::Position {
            let error = self.command.position.get().saturating_sub(self.feedback.position.get());
            if self.feedback.get(profile_generic::image::Signal::FollowingError).is_none() {
                self.feedback.following_error = Position(error);
            }
            if self
                .limits
                .following_error
                .is_some_and(|limit| error.unsigned_abs() > limit.get().unsigned_abs())
            {
                self.raise(now, system, Fault::new(FaultCause::EXCESSIVE_POSITION_ERROR, system));
            }
        }
    }

    /// Whether the drive's diagnostic words should be read now, urgently.
    #[must_use]
    pub fn wants_cause(&self) -> bool {
        self.cause_wanted.is_some()
    }

    /// A diagnostic word of the drive has been read; `true` when it names the cause.
    pub fn diagnostic_word(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        idn: profile_sercos::wire::idn::Idn,
        word: u32,
    ) -> bool {
        let found = self.south.as_ref().and_then(|(program, _)| program.fault(idn, word));
        match (found, self.cause_wanted) {
            // A warning is no cause of a stop.
            (Some((cause, reaction)), Some(_)) if reaction.stops() => {
                self.set_cause(now, system, cause, reaction, word);
                true
            }
            _ => false,
        }
    }

    pub(super) fn set_cause(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        cause: FaultCause,
        reaction: Reaction,
        vendor_code: u32,
    ) {
        self.cause_wanted = None;
        self.raise(
            now,
            system,
            Fault::new(cause, system).with_reaction(reaction).with_vendor_code(vendor_code),
        );
    }

    pub(super) fn raise(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
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
