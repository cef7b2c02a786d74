//! How the axis starts and stops: the steps of [`Sequencer`], carried out by the state machine and the command.
//!
//! ```text
//! step          control word      who brings the axis to rest
//! energizing    enable            - (the drive: flux, commutation, its own release of the brake)
//! releasing     enable            - (the box waits at a static command where the drive has no delay of its own)
//! running       enable            -
//! ramping       enable            the box: its command goes to rest at the configured deceleration
//! braking       halt              the drive, by its own halt
//! engaging      enable or halt    - (the box waits where the drive has no delay of its own)
//! switching off disable           the drive, by its best possible deceleration; then it closes its brake
//! holding       halt              -
//! coasting      torque off        nobody
//! ```

use super::{AxisChannel, START_TIME_OUT};
use crate::mapping::DriveProgram;
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::image::FeedbackSet;
use profile_generic::interpolation::SetPoints as FinePoints;
use profile_generic::mode::{InterpolationSource, OperatingMode};
use profile_generic::quantity::{Acceleration, Torque, Velocity};
use profile_generic::sequence::{Order, Sensed, SequenceStep, SequenceTimes, StopPlan, StopRamp};
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::{MonotonicTime, SystemTime};

/// How an axis is to start and stop, and what stops it, as controller and configuration have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StopSettings {
    /// How a disable stops it.
    pub plan: StopPlan,
    /// Delays and limits.
    pub times: SequenceTimes,
    /// Deceleration of a ramped stop; without one the drive decelerates by itself.
    pub deceleration: Option<Acceleration>,
    /// It may be started while it moves, at the speed it has.
    pub flying_start: bool,
    /// A limit switch stops it.
    pub checks_overtravel: bool,
}

impl AxisChannel {
    /// Says how the axis is to start and stop from now on. A stop under way keeps its method.
    pub fn set_stop_settings(&mut self, settings: StopSettings) {
        self.stop_settings = settings;
    }

    /// How the axis is to start and stop.
    #[must_use]
    pub fn stop_settings(&self) -> &StopSettings {
        &self.stop_settings
    }

    /// Where in a start or stop the axis is.
    #[must_use]
    pub fn sequence_step(&self) -> SequenceStep {
        self.sequencer.step()
    }

    fn sensed(&self) -> Sensed {
        let report = self.feedback.report;
        let heard = report != Report::Silent && self.feedback.present.contains(FeedbackSet::VELOCITY);
        Sensed {
            torque: self.may_have_torque() || report.has_torque(),
            follows: matches!(self.state(), DriveState::Operating | DriveState::Testing)
                && report == Report::Operating,
            halted: report == Report::Halted && self.action == Action::Halt,
            velocity: heard.then_some(self.feedback.velocity),
        }
    }

    /// The axis begins to start: it stands where it is, or goes on as fast as it is, until the controller's first
    /// set-points.
    pub(super) fn prepare_start(&mut self, now: MonotonicTime) {
        self.sequencer.start(now);
        self.started_for_test = self.state() != DriveState::Operating && self.tests_with_torque();
        self.ramp = None;
        self.sequence = None;
        self.start_interpolator();
        let velocity = self.feedback.velocity;
        let stands =
            velocity.get().unsigned_abs() <= self.stop_settings.times.zero_speed.get().unsigned_abs();
        let catches = self.stop_settings.flying_start && !stands && !self.started_for_test;
        self.caught = catches.then_some(velocity);
        let mode = match catches {
            // What a test is to find out is whether a position loop would hold at all.
            _ if self.started_for_test => OperatingMode::Torque,
            true => OperatingMode::Velocity,
            false => OperatingMode::Position,
        };
        let south = self.south();
        // A drive that is not used in that mode starts in its own.
        let other = south.filter(|program| !program.has_mode(mode)).and_then(DriveProgram::first_mode);
        self.command.select(other.unwrap_or(mode.into()));
    }

    pub(super) fn begin_stop(&mut self, now: MonotonicTime, system: SystemTime, plan: StopPlan) {
        match self.sequencer.stop(now, plan, &self.sensed(), &self.stop_settings.times) {
            Some(order) => self.carry_out(now, system, order),
            // The state machine may know of torque that no sequence does.
            None => self.request(now, system, Request::Disable),
        }
    }

    /// Time passes in a start or stop.
    pub(super) fn advance_sequence(&mut self, now: MonotonicTime, system: SystemTime) {
        let late = now.since(self.sequencer.since()) > START_TIME_OUT;
        if self.sequencer.step() == SequenceStep::Energizing && self.state() == DriveState::Operating && late
        {
            // Out of a hold, where the state machine waits for nothing: the drive does not follow again.
            let fault = Fault::new(FaultCause::START_TIME_OUT, system);
            self.raise(now, system, fault.with_reaction(Reaction::DecelerateAndDisable));
        }
        if let Some(order) = self.sequencer.poll(now, &self.sensed(), &self.stop_settings.times) {
            self.carry_out(now, system, order);
        }
    }

    fn carry_out(&mut self, now: MonotonicTime, system: SystemTime, order: Order) {
        match order {
            Order::Enable => self.request(now, system, Request::Enable),
            Order::TorqueOff => self.request(now, system, Request::Coast),
            Order::Disable => self.request(now, system, Request::Disable),
            Order::Halt => self.request(now, system, Request::Stop),
            Order::Ramp => self.begin_ramp(now, system),
            Order::TimeOut => {
                let fault = Fault::new(FaultCause::STOP_TIME_OUT, system);
                self.raise(now, system, fault.with_reaction(Reaction::CoastAndDisable));
            }
        }
    }

    fn begin_ramp(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.command.interpolation == InterpolationSource::Drive {
            // A drive that makes its way by itself brakes by itself.
            return self.brake(now, system);
        }
        // From the last command, not from what the drive has made of it: the command does not step.
        let velocity = match self.command.mode {
            OperatingMode::Position | OperatingMode::Velocity => self.command.velocity,
            _ => {
                self.command.mode = OperatingMode::Velocity;
                self.feedback.velocity
            }
        };
        let deceleration = self.stop_settings.deceleration.unwrap_or_default();
        self.ramp = StopRamp::new(self.acts_at, self.command.position, velocity, deceleration);
        if self.ramp.is_none() {
            self.brake(now, system);
        }
    }

    /// Stops by the drive's own deceleration instead of a ramp.
    fn brake(&mut self, now: MonotonicTime, system: SystemTime) {
        let method = profile_generic::sequence::StopMethod::Decelerate;
        self.begin_stop(now, system, StopPlan { method, ..self.stop_settings.plan });
    }

    /// The command for the instant `acts_at` while no controller leads the axis.
    pub(super) fn led_by_box(&mut self, acts_at: MonotonicTime) -> FinePoints {
        // What the controller had added to its set-points ends with them.
        self.command.velocity_offset = Velocity::ZERO;
        self.command.torque_offset = Torque::ZERO;
        match (self.ramp, self.caught) {
            (Some(ramp), _) => {
                let (position, velocity) = ramp.at(acts_at);
                FinePoints { position: Some(position), velocity: Some(velocity), ..FinePoints::default() }
            }
            (None, velocity) => FinePoints { velocity, ..FinePoints::default() },
        }
    }

    /// Whether the drive moves the axis by itself, or nobody does: the command follows it.
    pub(super) fn drive_leads(&self) -> bool {
        match self.sequencer.step() {
            SequenceStep::Energizing
            | SequenceStep::Releasing
            | SequenceStep::Running
            | SequenceStep::Ramping => false,
            SequenceStep::Engaging => self.action != Action::Enable,
            SequenceStep::Off
            | SequenceStep::Coasting
            | SequenceStep::Braking
            | SequenceStep::SwitchingOff
            | SequenceStep::Holding => true,
        }
    }

    /// The state machine goes to another state: a sequence that it does not fit into ends.
    pub(super) fn follow_sequence(&mut self, now: MonotonicTime, next: DriveState) {
        match next {
            DriveState::Starting => self.prepare_start(now),
            DriveState::Operating | DriveState::Testing => {}
            DriveState::Stopping => {
                self.ramp = None;
                self.caught = None;
                self.sequencer.drive_stops(now);
            }
            _ => {
                self.ramp = None;
                self.caught = None;
                if self.sequencer.step() != SequenceStep::SwitchingOff {
                    self.sequencer.lose_torque(now);
                }
            }
        }
    }
}
