//! From the controller to the axis: actions and resets.

use super::{AxisChannel, Loss, RESET_CYCLES, RESET_TIME_OUT, Reset};
use profile_cip::device::drive_link::{AbortOrder, AxisCommandImage, Command, DriveAction, Withheld};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::fault_set::{ActiveFault, Origin};
use profile_generic::sequence::StopPlan;
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::{MonotonicTime, SystemTime};

impl AxisChannel {
    /// Takes what the motion device says about this axis; to be called in every cycle after [`Self::from_drive`]. `target` is the
    /// instant at which its set-points shall be reached, where controller and device share a clock.
    pub fn from_controller(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        image: &AxisCommandImage,
        target: Option<MonotonicTime>,
    ) {
        // Before the action: a lost command stops the axis as its configuration says, whatever the device asks for then.
        if let Command::Withheld(why) = image.command
            && matches!(why, Withheld::Stale | Withheld::ConnectionLost | Withheld::NodeFault)
        {
            self.lose_command(now, system, Loss::Withheld(why));
        }
        self.take_test(now, image.test);
        // Before the action: a stop that is ordered in a particular way is under way when the action asks for any.
        self.take_abort(now, system, image.abort);
        if image.action_id != self.action_id {
            self.action_id = image.action_id;
            self.north_action = image.action;
            self.enable_pending = false;
            self.take_action(now, system, image.action);
        }
        if self.enable_pending && self.state() == DriveState::Ready {
            // The enable came in the very cycle in which the drive was not ready; the controller still asks for it.
            self.enable_pending = false;
            self.take_action(now, system, self.north_action);
        }
        if image.reset_id != self.reset_id && self.reset.is_none_or(|reset| reset.id != image.reset_id) {
            self.begin_reset(now, system, image.reset_id);
        }
        match image.command {
            Command::Follow(set_points) => self.take_set_points(now, system, &set_points, target),
            Command::Withheld(_) => self.sequence = None,
        }
    }

    pub(super) fn take_action(&mut self, now: MonotonicTime, system: SystemTime, action: DriveAction) {
        if !matches!(action, DriveAction::Enable | DriveAction::Abort) {
            self.end_hold(now, system);
        }
        if action == DriveAction::Enable && self.state() == DriveState::Operating {
            // Out of a hold, or of a stop that has not ended: the torque is there already.
            self.prepare_start(now);
        }
        let request = match action {
            DriveAction::Enable if !self.moves => None,
            // What a test is led by is torque: it ends by the drive's own deceleration, not by a ramp of the box.
            DriveAction::None | DriveAction::PowerUp | DriveAction::Disable
                if self.started_for_test && self.may_have_torque() =>
            {
                self.north.drive_request(DriveAction::Disable)
            }
            DriveAction::Disable if self.may_have_torque() => {
                self.begin_stop(now, system, self.stop_settings.plan);
                None
            }
            // Neither a connection that is gone nor a standby state of the axis leaves it with torque.
            DriveAction::None | DriveAction::PowerUp if self.may_have_torque() => {
                self.begin_stop(now, system, StopPlan::default());
                None
            }
            // Without torque there is nothing to abort; the motion device keeps the fault.
            DriveAction::Abort if !self.may_have_torque() => None,
            // A test that has ended before it began needs no torque.
            DriveAction::Test if !self.tests_with_torque() => None,
            action => self.north.drive_request(action),
        };
        if let Some(request) = request {
            self.request(now, system, request);
        }
    }

    /// The motion device wants the axis stopped for a fault, or stopped harder than before.
    fn take_abort(&mut self, now: MonotonicTime, system: SystemTime, order: Option<AbortOrder>) {
        let new = order.filter(|order| self.abort.is_none_or(|known| known.action != order.action));
        self.abort = order;
        let Some(order) = new.filter(|_| self.may_have_torque()) else { return };
        let there = |active: &&ActiveFault| {
            self.north.fault(active.fault.cause).is_some_and(|fault| fault.is(order.fault_type.0, order.code))
        };
        let cause = self.faults.iter().find(there).map(|active| active.fault);
        let fault = cause.unwrap_or_else(|| Fault::new(FaultCause::CONTROLLER_ABORT, system));
        self.take_fault(now, system, fault.with_reaction(self.north.reaction(order.action)));
    }

    pub(super) fn request(&mut self, now: MonotonicTime, system: SystemTime, request: Request) {
        if !self.moves && matches!(request, Request::Enable | Request::Test) {
            return;
        }
        let transition = self.drive.machine.request(request);
        self.follow(now, system, transition);
    }

    /// Whether the drive stands with torque because the reaction to a fault is to hold the position.
    pub(super) fn holds(&self) -> bool {
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
