//! A north side that speaks in the generic model: requests, modes and set-points as an [`AxisCommand`].
//!
//! CIP Motion comes by its own way, [`AxisChannel::from_controller`], with its handshakes and its wrapping positions; it has
//! no request for homing by the drive, nor for targets that the drive goes to by itself. Both ways end in the same
//! state machine, interpolator and limits.

use super::{AxisChannel, Loss};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::image::AxisCommand;
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::{InterpolationSource, OperatingMode};
use profile_generic::state::{Action, DriveState, Request};
use profile_generic::time::{MonotonicTime, SystemTime};

impl AxisChannel {
    /// Takes what the north side wants; to be called in every cycle after [`Self::from_drive`]. What has the `sequence` of
    /// the command before counts no second time.
    ///
    /// Set-points need an update period ([`Self::keep_update_period`]) and go on without an update for a few periods only.
    /// A drive that goes to a target or homes does so until it gets another command: a north side that is lost has to be
    /// told of by [`Self::lose_north`].
    pub fn from_north(&mut self, now: MonotonicTime, system: SystemTime, command: &AxisCommand) {
        if self.requested != Some(command.sequence) {
            self.requested = Some(command.sequence);
            match command.request {
                Some(Request::FaultReset) => self.begin_reset(now, system, self.reset_id),
                Some(request) => {
                    if request == Request::Enable && self.halts() {
                        // The torque is there already, and what the axis was led by is of before the halt.
                        self.prepare_start(now);
                    }
                    self.request(now, system, request);
                }
                None => {}
            }
        }
        // An axis that is told no mode stands where it was started.
        let idle = self.state() != DriveState::Operating || command.mode == OperatingMode::None;
        if idle || self.sequence == Some(command.sequence) {
            return;
        }
        let first = self.sequence.is_none();
        self.sequence = Some(command.sequence);
        let mut command = *command;
        let fits = self.take_trims(&mut command, first).is_some();
        let command = &command;
        if let Some(finding) = self.beyond_limits(command).filter(|_| {
            fits && command.interpolation == InterpolationSource::Controller
                && command.mode != OperatingMode::Homing
        }) {
            self.trip(now, system, finding);
            return;
        }
        let refusal = if fits { self.refusal(command) } else { Some(FaultCause::POSITION_COMMAND_LIMIT) };
        if let Some(cause) = refusal {
            self.raise(now, system, Fault::new(cause, system));
            return;
        }
        match (command.mode, command.interpolation) {
            (_, InterpolationSource::Controller) => {
                let way = TargetUpdate::Interpolate;
                self.interpolate(now, system, command, first, way, command.target_time);
            }
            (mode, InterpolationSource::Drive) => {
                self.command.select(command.selection());
                self.counters.commands = self.counters.commands.saturating_add(1);
                if mode != OperatingMode::Homing {
                    self.command.target_position = command.target_position;
                    self.command.profile_velocity = command.profile_velocity;
                    self.command.profile_acceleration = command.profile_acceleration;
                    self.command.profile_deceleration = command.profile_deceleration;
                    self.command.present |= command.present & AxisCommand::PROFILE;
                }
            }
        }
    }

    /// The north side is lost: the axis stops as its configuration says.
    pub fn lose_north(&mut self, now: MonotonicTime, system: SystemTime) {
        self.lose_command(now, system, Loss::Silent);
    }

    /// Whether the axis was halted in operation.
    fn halts(&self) -> bool {
        self.state() == DriveState::Operating && self.action == Action::Halt
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
        let target = command.target_position;
        let far = |step: i64| target.get().abs_diff(self.feedback.position.get()) > step.unsigned_abs();
        let beyond = self.limits.position_min.is_some_and(|limit| target < limit)
            || self.limits.position_max.is_some_and(|limit| target > limit)
            // A drive that works modulo would go there the other way round.
            || program.position_step().is_some_and(far);
        let speed = command.profile_velocity.get();
        let fast = self.limits.velocity.is_some_and(|limit| speed > limit.get()) || speed < 0;
        match (beyond, fast) {
            (true, _) => Some(FaultCause::POSITION_COMMAND_LIMIT),
            (false, true) => Some(FaultCause::VELOCITY_COMMAND_LIMIT),
            (false, false) => None,
        }
    }
}
