//! From a north side to the axis: what it wants of the drive, as a level, and resets.

use super::{AxisChannel, RESET_CYCLES, RESET_TIME_OUT, Reset};
use profile_generic::fault::FaultCause;
use profile_generic::fault_set::Origin;
use profile_generic::sequence::StopPlan;
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::{MonotonicTime, SystemTime};

/// What a north side wants the axis to be: it holds until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Intent {
    /// Nothing: without torque.
    #[default]
    Standby,
    /// In operation.
    Enable,
    /// In a test, with torque where the test needs it.
    Test,
    /// Stopped as configured.
    Disable,
    /// Shut down.
    Shutdown,
    /// Stopped for a fault.
    Abort,
}

/// An intent, and the request to the generic state machine by which it is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wish {
    /// What the axis shall be.
    pub intent: Intent,
    /// The request; `None` when nothing is asked of the drive.
    pub request: Option<Request>,
}

impl AxisChannel {
    /// Takes another wish of the north side.
    pub fn take_wish(&mut self, now: MonotonicTime, system: SystemTime, wish: Wish) {
        self.wish = wish;
        self.enable_pending = false;
        self.carry_out_wish(now, system);
    }

    /// An enable that came in the very cycle in which the drive was not ready is still asked for; to be called in every cycle.
    pub fn retry_wish(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.enable_pending && self.state() == DriveState::Ready {
            self.enable_pending = false;
            self.carry_out_wish(now, system);
        }
    }

    fn carry_out_wish(&mut self, now: MonotonicTime, system: SystemTime) {
        let Wish { intent, request } = self.wish;
        if !matches!(intent, Intent::Enable | Intent::Abort) {
            self.end_hold(now, system);
        }
        if intent == Intent::Enable && self.state() == DriveState::Operating {
            // Out of a hold, or of a stop that has not ended: the torque is there already.
            self.prepare_start(now);
        }
        let request = match intent {
            Intent::Enable if !self.moves => None,
            // What a test is led by is torque: it ends by the drive's own deceleration, not by a ramp of the box.
            Intent::Standby | Intent::Disable if self.started_for_test && self.may_have_torque() => {
                Some(Request::Disable)
            }
            Intent::Disable if self.may_have_torque() => {
                self.begin_stop(now, system, self.stop_settings.plan);
                None
            }
            // Neither a connection that is gone nor a standby state of the axis leaves it with torque.
            Intent::Standby if self.may_have_torque() => {
                self.begin_stop(now, system, StopPlan::default());
                None
            }
            // Without torque there is nothing to abort; the north side keeps the fault.
            Intent::Abort if !self.may_have_torque() => None,
            // A test that has ended before it began needs no torque.
            Intent::Test if !self.tests_with_torque() => None,
            _ => request,
        };
        if let Some(request) = request {
            self.request(now, system, request);
        }
    }

    pub(super) fn request(&mut self, now: MonotonicTime, system: SystemTime, request: Request) {
        if !self.moves && matches!(request, Request::Enable | Request::Test) {
            return;
        }
        let transition = self.drive.machine.request(request);
        self.follow(now, system, transition);
    }

    /// Whether the drive stands with torque because the reaction to a fault is to hold the position.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.state() == DriveState::FaultReaction
            && self.action == Action::Halt
            && self.feedback.report == Report::Halted
    }

    /// Takes the torque away from an axis that holds its position; the fault stays.
    pub(super) fn end_hold(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.holds() {
            let transition = self.drive.machine.clear_faults();
            self.follow(now, system, transition);
            self.request(now, system, Request::FaultReset);
        }
    }

    pub(super) fn clear_fault(&mut self, now: MonotonicTime, system: SystemTime) {
        self.fault = None;
        self.cause_wanted = None;
        // A drive that is not there is no event: it is still not there.
        let silent = self.feedback.report == Report::Silent;
        self.faults.clear_all(Origin::Event, |cause| silent && cause == FaultCause::SOUTH_SILENCE);
        let transition = self.drive.machine.clear_faults();
        self.follow(now, system, transition);
        self.request(now, system, Request::FaultReset);
    }

    /// The north side wants this reset of faults, unless it was carried out or is under way.
    pub fn want_reset(&mut self, now: MonotonicTime, system: SystemTime, id: u32) {
        if id != self.reset_id && self.reset.is_none_or(|reset| reset.id != id) {
            self.begin_reset(now, system, id);
        }
    }

    /// The reset that was carried out last.
    #[must_use]
    pub fn reset_id(&self) -> u32 {
        self.reset_id
    }

    pub(super) fn begin_reset(&mut self, now: MonotonicTime, system: SystemTime, id: u32) {
        self.reset = Some(Reset { id, since: now, begun: false });
        self.advance_reset(now, system);
    }

    /// A stop under way is not interrupted: faults are reset once the axis is without torque.
    pub(super) fn advance_reset(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.reset.is_some() {
            self.end_hold(now, system);
        }
        let Some(reset) = self.reset.as_mut() else { return };
        let stops = matches!(self.drive.machine.state(), DriveState::FaultReaction | DriveState::Stopping);
        if !reset.begun && !stops {
            *reset = Reset { since: now, begun: true, ..*reset };
            self.clear_fault(now, system);
        }
        let Some(reset) = self.reset.filter(|reset| reset.begun) else { return };
        let late = now.since(reset.since) > RESET_TIME_OUT;
        if self.state() != DriveState::Faulted || late {
            if late {
                self.drive.machine.abandon_reset();
            }
            self.reset = None;
            self.reset_id = reset.id;
        }
    }

    /// Whether the drive's own fault reset is to be executed, until [`Self::drive_reset_sent`].
    #[must_use]
    pub fn wants_drive_reset(&self) -> bool {
        self.drive_reset_wanted
    }

    /// The drive's own fault reset is on its way.
    pub fn drive_reset_sent(&mut self) {
        self.drive_reset_wanted = false;
        self.reset_cycles = RESET_CYCLES;
    }
}
