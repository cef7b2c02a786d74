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

use profile_generic::image::{AxisCommand, AxisFeedback, FeedbackSet};
use profile_generic::mode::{InterpolationSource, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::sequence::{
    Order, Sensed, SequenceStep, SequenceTimes, Sequencer, StopMethod, StopPlan, StopRamp,
};
use profile_generic::state::{Action, DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::{FeedForward, Ramp, START_TIME_OUT, STOP_TIME_OUT, Tolerances, UserLimits};

/// How an axis is to start and stop, and what stops it, as controller and configuration have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StopSettings {
    /// How a disable stops it.
    pub plan: StopPlan,
    /// Delays and limits.
    pub times: SequenceTimes,
    /// Deceleration of a ramped stop; without one the drive decelerates by itself.
    pub deceleration: Option<Acceleration>,
    /// The ramp of a velocity that is commanded at once.
    pub ramp: Ramp,
    /// It may be started while it moves, at the speed it has.
    pub flying_start: bool,
    /// A limit switch stops it.
    pub checks_overtravel: bool,
    /// Limits that may be passed for a time.
    pub tolerances: Tolerances,
    /// What is watched beside them.
    pub user_limits: UserLimits,
    /// Time constant of the filter of an acceleration that the drive does not report; 0 is none (attribute 1435).
    pub acceleration_filter: DurationNs,
    /// Torque that is fed forward.
    pub feed_forward: FeedForward,
}

/// Where in a start or stop one axis is.
#[derive(Debug, Default)]
pub(super) struct StartStop {
    sequencer: Sequencer,
    /// A stop under way keeps its method when they change.
    pub settings: StopSettings,
    /// The command's way to rest, in a ramped stop.
    ramp: Option<StopRamp>,
    /// Where the axis came to rest in a halt.
    pub halted_at: Option<Position>,
    /// The torque was switched on for a test.
    pub started_for_test: bool,
}

impl StartStop {
    pub fn step(&self) -> SequenceStep {
        self.sequencer.step()
    }

    pub fn is_stopping(&self) -> bool {
        self.sequencer.is_stopping()
    }

    /// How long a stop may take by its own limits: to the end of the torque, and from there to rest.
    pub fn limit(&self) -> DurationNs {
        let times = &self.settings.times;
        times.stopping_limit.min(STOP_TIME_OUT) + times.coasting_limit.min(STOP_TIME_OUT)
    }

    /// Whether an axis of this velocity stands.
    pub fn stands(&self, velocity: Velocity) -> bool {
        velocity.get().unsigned_abs() <= self.settings.times.zero_speed.get().unsigned_abs()
    }

    /// What the sequences go by.
    pub fn sensed(feedback: &AxisFeedback, state: DriveState, action: Action) -> Sensed {
        let report = feedback.report;
        let heard = report != Report::Silent && feedback.present.contains(FeedbackSet::VELOCITY);
        Sensed {
            torque: state.may_have_torque() || report.has_torque(),
            follows: matches!(state, DriveState::Operating | DriveState::Testing)
                && report == Report::Operating,
            halted: report == Report::Halted && action == Action::Halt,
            velocity: heard.then_some(feedback.velocity),
        }
    }

    /// The axis begins to start, for a test or not. Returns the speed at which it is caught when it moves.
    pub fn start(&mut self, now: MonotonicTime, for_test: bool, velocity: Velocity) -> Option<Velocity> {
        self.sequencer.start(now);
        self.started_for_test = for_test;
        self.ramp = None;
        let catches = self.settings.flying_start && !self.stands(velocity) && !for_test;
        catches.then_some(velocity)
    }

    /// A stop begins; `None` when there is none for the sequences.
    pub fn stop(&mut self, now: MonotonicTime, plan: StopPlan, sensed: &Sensed) -> Option<Order> {
        self.sequencer.stop(now, plan, sensed, &self.settings.times)
    }

    /// The plan by which the drive decelerates by itself instead of a ramp.
    pub fn by_drive(&self) -> StopPlan {
        StopPlan { method: StopMethod::Decelerate, ..self.settings.plan }
    }

    /// Time passes.
    pub fn poll(&mut self, now: MonotonicTime, sensed: &Sensed) -> Option<Order> {
        self.sequencer.poll(now, sensed, &self.settings.times)
    }

    /// Whether the drive takes too long to follow again out of a hold, where the state machine waits for nothing.
    pub fn is_late(&self, now: MonotonicTime) -> bool {
        self.step() == SequenceStep::Energizing && now.since(self.sequencer.since()) > START_TIME_OUT
    }

    /// The command goes to rest, from where it is at `acts_at`, not from what the drive has made of it: so it does not step. `false` when
    /// the drive has to brake by itself; out of torque control a ramp goes `by_velocity`, where the drive has that mode.
    pub fn begin_ramp(
        &mut self,
        acts_at: MonotonicTime,
        command: &mut AxisCommand,
        actual: Velocity,
        by_velocity: bool,
    ) -> bool {
        if command.interpolation == InterpolationSource::Drive {
            // A drive that makes its way by itself brakes by itself.
            return false;
        }
        let velocity = match command.mode {
            OperatingMode::Position | OperatingMode::Velocity => command.velocity,
            _ if !by_velocity => return false,
            _ => {
                command.mode = OperatingMode::Velocity;
                actual
            }
        };
        let deceleration = self.settings.deceleration.unwrap_or_default();
        self.ramp = StopRamp::new(acts_at, command.position, velocity, deceleration);
        self.ramp.is_some()
    }

    /// Position and velocity for the instant `acts_at` while no controller leads the axis; `caught` is the speed that it was
    /// caught at.
    pub fn led_by_gateway(
        &self,
        acts_at: MonotonicTime,
        caught: Option<Velocity>,
    ) -> (Option<Position>, Option<Velocity>) {
        let Some(ramp) = self.ramp else { return (None, caught) };
        let (position, velocity) = ramp.at(acts_at);
        (Some(position), Some(velocity))
    }

    /// Whether the drive moves the axis by itself, or nobody does: the command follows it.
    pub fn drive_leads(&self, action: Action) -> bool {
        match self.step() {
            SequenceStep::Energizing
            | SequenceStep::Releasing
            | SequenceStep::Running
            | SequenceStep::Ramping => false,
            SequenceStep::Engaging => action != Action::Enable,
            SequenceStep::Off
            | SequenceStep::Coasting
            | SequenceStep::Braking
            | SequenceStep::SwitchingOff
            | SequenceStep::Holding => true,
        }
    }

    /// The state machine goes to a state without operation: a sequence that does not fit into it ends.
    pub fn follow(&mut self, now: MonotonicTime, next: DriveState) {
        self.ramp = None;
        if next == DriveState::Stopping {
            self.sequencer.drive_stops(now);
        } else if self.step() != SequenceStep::SwitchingOff {
            self.sequencer.lose_torque(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: i64 = 1_000_000_000;
    const NOW: MonotonicTime = MonotonicTime(5_000_000_000);

    fn start_stop() -> StartStop {
        let times = SequenceTimes { zero_speed: Velocity(100), ..SequenceTimes::default() };
        StartStop {
            settings: StopSettings {
                times,
                deceleration: Some(Acceleration(10 * UNIT)),
                flying_start: true,
                ..StopSettings::default()
            },
            ..StartStop::default()
        }
    }

    #[test]
    fn an_axis_on_the_move_is_caught_at_its_speed_but_not_for_a_test() {
        let mut axis = start_stop();
        assert_eq!(axis.start(NOW, false, Velocity(101)), Some(Velocity(101)));
        assert_eq!(axis.start(NOW, false, Velocity(-100)), None, "it stands");
        assert_eq!((axis.start(NOW, true, Velocity(500)), axis.started_for_test), (None, true));
        axis.settings.flying_start = false;
        assert_eq!(axis.start(NOW, false, Velocity(500)), None);
    }

    #[test]
    fn a_ramp_begins_at_the_command_and_comes_to_rest() {
        let mut axis = start_stop();
        axis.start(NOW, false, Velocity::ZERO);
        let mut command = AxisCommand {
            mode: OperatingMode::Position,
            position: Position(7 * UNIT),
            velocity: Velocity(2 * UNIT),
            ..AxisCommand::default()
        };
        assert!(axis.begin_ramp(NOW, &mut command, Velocity(UNIT), true));
        let at = |millis| axis.led_by_gateway(NOW + DurationNs::from_millis(millis), None);
        assert_eq!(at(0), (Some(Position(7 * UNIT)), Some(Velocity(2 * UNIT))));
        // 2 u/s at 10 u/s2: 0.2 s and 0.2 u.
        assert_eq!(at(200), (Some(Position(7 * UNIT + UNIT / 5)), Some(Velocity::ZERO)));
        // The state machine leaves operation: no ramp any more, and what was caught leads.
        axis.follow(NOW, DriveState::Faulted);
        assert_eq!(axis.led_by_gateway(NOW, Some(Velocity(3))), (None, Some(Velocity(3))));
    }

    #[test]
    fn torque_is_ramped_in_velocity_from_the_actual_one_and_a_drive_on_its_own_way_brakes_itself() {
        let mut axis = start_stop();
        let mut command = AxisCommand { mode: OperatingMode::Torque, ..AxisCommand::default() };
        assert!(!axis.begin_ramp(NOW, &mut command, Velocity(UNIT), false), "the drive has no such mode");
        assert_eq!(command.mode, OperatingMode::Torque);
        assert!(axis.begin_ramp(NOW, &mut command, Velocity(UNIT), true));
        assert_eq!(command.mode, OperatingMode::Velocity);
        assert_eq!(axis.led_by_gateway(NOW, None).1, Some(Velocity(UNIT)));
        let mut command = AxisCommand { interpolation: InterpolationSource::Drive, ..command };
        assert!(!axis.begin_ramp(NOW, &mut command, Velocity(UNIT), true));
    }

    #[test]
    fn a_start_is_late_after_its_time_while_the_drive_is_energized() {
        let mut axis = start_stop();
        assert!(!axis.is_late(NOW + START_TIME_OUT * 2), "nothing starts");
        axis.start(NOW, false, Velocity::ZERO);
        assert_eq!(axis.step(), SequenceStep::Energizing);
        assert!(!axis.is_late(NOW + START_TIME_OUT) && axis.is_late(NOW + START_TIME_OUT + DurationNs(1)));
    }

    #[test]
    fn a_drive_that_is_not_heard_has_no_velocity_and_torque_may_be_known_by_either_side() {
        let feedback =
            AxisFeedback { report: Report::Silent, velocity: Velocity(7), ..AxisFeedback::default() };
        let sensed = StartStop::sensed(&feedback, DriveState::Operating, Action::Enable);
        assert_eq!((sensed.velocity, sensed.torque, sensed.follows), (None, true, false));
        let feedback = AxisFeedback { report: Report::Halted, present: FeedbackSet::VELOCITY, ..feedback };
        let sensed = StartStop::sensed(&feedback, DriveState::Ready, Action::Halt);
        assert_eq!((sensed.velocity, sensed.halted), (Some(Velocity(7)), true));
    }
}
