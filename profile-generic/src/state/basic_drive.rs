//! The state machine together with its conditions.

use super::{Action, Conditions, DriveState, Event, Report, Request, Transition};
use crate::fault::Reaction;
use crate::inhibit::Inhibits;

/// The basic drive functional element: the state and everything its transitions depend on.
///
/// It folds each event into the conditions before the transition and the latches of the transition after it,
/// so that a shutdown, a pending reset or a fault of the drive cannot be forgotten between the two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BasicDrive {
    state: DriveState,
    conditions: Conditions,
    /// A fault raised from outside is active.
    raised: bool,
    /// The last report was Faulted or FaultReaction.
    drive_faulted: bool,
    /// A halt was ended by an enable that the drive has not answered yet.
    resuming: bool,
}

impl BasicDrive {
    /// A drive that was not heard yet, without power.
    pub fn new() -> Self {
        Self::default()
    }

    /// The state after the last event.
    pub const fn state(&self) -> DriveState {
        self.state
    }

    /// The conditions as they are now.
    pub const fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// Takes a request of the controller.
    pub fn request(&mut self, request: Request) -> Transition {
        self.handle(Event::Request(request))
    }

    /// Takes what the drive reports; to be called in every cycle.
    pub fn report(&mut self, report: Report) -> Transition {
        self.handle(Event::Report(report))
    }

    /// Sets whether the power stage has its supply, where that is known apart from the drive's report.
    pub fn set_power(&mut self, power: bool) {
        self.conditions.power = power;
    }

    /// Sets the inhibits and takes the event when they changed.
    pub fn set_inhibits(&mut self, inhibits: Inhibits) -> Option<Transition> {
        let before = core::mem::replace(&mut self.conditions.inhibits, inhibits);
        if before == inhibits {
            None
        } else if before.contains(inhibits) {
            Some(self.handle(Event::InhibitCleared))
        } else {
            Some(self.handle(Event::InhibitRaised))
        }
    }

    /// Raises a fault. Of several active faults the strongest reaction counts. A reaction that does not stop
    /// the axis changes nothing.
    pub fn raise_fault(&mut self, reaction: Reaction) -> Transition {
        if reaction.stops() {
            let known = if self.conditions.fault_active { self.conditions.reaction } else { reaction };
            self.conditions.reaction = known.max(reaction);
            self.handle(Event::FaultRaised)
        } else {
            self.state.next(Event::FaultRaised, &Conditions { reaction, ..self.conditions })
        }
    }

    /// Tells that no raised fault is active any more. What was latched stays latched.
    pub fn clear_faults(&mut self) -> Transition {
        self.handle(Event::FaultCleared)
    }

    /// Gives up waiting for a reset that the drive did not answer in time.
    pub fn abandon_reset(&mut self) {
        self.conditions.reset_pending = false;
    }

    /// Takes any event. [`Event::FaultRaised`] uses the reaction in the conditions; better call
    /// [`BasicDrive::raise_fault`].
    pub fn handle(&mut self, event: Event) -> Transition {
        self.before(event);
        let transition = self.state.next(event, &self.conditions);
        self.after(&transition);
        transition
    }

    fn before(&mut self, event: Event) {
        let conditions = &mut self.conditions;
        match event {
            Event::Request(Request::Test) => conditions.test_active |= self.state == DriveState::Ready,
            Event::Request(Request::FaultReset) => {
                conditions.reset_pending = self.state == DriveState::Faulted;
            }
            // A shutdown is latched beneath the fault, and the reset leads to it.
            Event::Request(Request::Shutdown) => {}
            Event::Request(_) => conditions.reset_pending = false,
            Event::Report(report) => {
                conditions.initialised = !matches!(report, Report::NotReady | Report::Silent);
                conditions.halted = report == Report::Halted;
                conditions.torque = report.has_torque();
                if report == Report::Operating && core::mem::take(&mut self.resuming) {
                    conditions.halting = false;
                }
                match report {
                    Report::Ready | Report::Enabling | Report::Operating | Report::Halted => {
                        conditions.power = true;
                    }
                    Report::AwaitingPower => conditions.power = false,
                    _ => {}
                }
                self.drive_faulted = matches!(report, Report::Faulted | Report::FaultReaction);
            }
            Event::FaultRaised => {
                self.raised = true;
                conditions.reset_pending = false;
            }
            Event::FaultCleared => self.raised = false,
            _ => {}
        }
        conditions.fault_active = self.raised || self.drive_faulted;
    }

    fn after(&mut self, transition: &Transition) {
        self.state = transition.next;
        let conditions = &mut self.conditions;
        conditions.shutdown_latched = transition.shutdown.unwrap_or(conditions.shutdown_latched);
        match transition.action {
            Action::Halt => (conditions.halting, self.resuming) = (true, false),
            Action::Enable => self.resuming = conditions.halting,
            _ => {}
        }
        conditions.halting &= self.state == DriveState::Operating;
        conditions.test_active &= matches!(self.state, DriveState::Starting | DriveState::Testing);
        conditions.reset_pending &= self.state == DriveState::Faulted && transition.action != Action::Reject;
        if !conditions.fault_active && !matches!(self.state, DriveState::FaultReaction | DriveState::Faulted)
        {
            conditions.reaction = Reaction::default();
        }
    }
}
