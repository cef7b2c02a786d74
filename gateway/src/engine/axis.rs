//! One axis between its two sides: what the controller wants goes in at the top, what the drive is told comes out at the
//! bottom, and the same way back.
//!
//! ```text
//! AxisCommandImage --CipProgram--> AxisCommand --BasicDrive, FineInterpolator--> AxisCommand --SercosProgram--> MDT
//! DriveImage     <--CipProgram-- AxisFeedback <--BasicDrive------------------ AxisFeedback <--SercosProgram-- AT
//! ```
//!
//! Everything here runs in the cycle: no allocation, no waiting. What corresponds to what stands in the two programs.

use profile_cip::target::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveImage, SetPoints, Withheld,
};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::image::{AxisCommand, AxisFeedback, FeedbackSet};
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::{
    FineInterpolator, InterpolatorConfig, Quality, SetPoints as FinePoints, TargetUpdate, UpdateError,
};
use profile_generic::mode::OperatingMode;
use profile_generic::program::{ConversionReport, Trackers};
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::state::{Action, DriveState, Event, Report, Request, Transition};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_sercos::master::connection::{Consumer, ConsumerState};

use crate::mapping::{CipFault, CipProgram, CipTrackers, CyclicValues, SercosProgram};

/// How long a drive may take from the enable to following set-points; a commutation search may take seconds.
pub const START_TIME_OUT: DurationNs = DurationNs::from_secs(10);

/// How long a drive may take to come to rest before its torque is taken away.
pub const STOP_TIME_OUT: DurationNs = DurationNs::from_secs(30);

/// How long the drive may take to clear its faults after a reset.
pub const RESET_TIME_OUT: DurationNs = DurationNs::from_secs(5);

/// How long a fault of the drive waits for its cause to be read before it is reported without.
const CAUSE_TIME_OUT: DurationNs = DurationNs::from_millis(500);

/// Update periods that the interpolator goes on beyond its last target before it holds and the command counts as lost.
/// The connection's own limit for missed updates, 4 by default (class attribute Controller Update Delay High Limit), is
/// of the same order: whichever is reached first stops the axis.
const EXTRAPOLATE_PERIODS: u32 = 4;

/// What the box itself watches.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Limits {
    /// Lowest position command.
    pub position_min: Option<Position>,
    /// Highest position command.
    pub position_max: Option<Position>,
    /// Highest speed of the drive, either direction, with a tenth to spare for its overshoot.
    pub velocity: Option<Velocity>,
    /// Largest distance of actual from commanded position.
    pub following_error: Option<Position>,
}

/// What an axis has counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AxisCounters {
    /// Set-points taken from the controller.
    pub commands: u64,
    /// Cycles without a fresh value from the drive.
    pub lost_telegrams: u32,
    /// Values that were clamped in a conversion.
    pub saturated: u32,
    /// Faults.
    pub faults: u32,
}

/// Why a command counts as lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// The motion device gives no set-points.
    #[error("the motion connection gives no set-points: {0:?}")]
    Withheld(Withheld),
    /// No update came for longer than the interpolator can go on.
    #[error("no update of the controller came in time")]
    Silent,
    /// The update does not fit those before it.
    #[error("{0}")]
    Update(#[from] UpdateError),
    /// No update period is known.
    #[error("no update period is known")]
    NoPeriod,
    /// The box ends.
    #[error("the box ends")]
    End,
}

/// A reset of faults under way.
#[derive(Debug, Clone, Copy)]
struct Reset {
    id: u32,
    /// Since it was asked for, then since it was begun.
    since: MonotonicTime,
    begun: bool,
}

/// One axis.
#[derive(Debug)]
pub struct AxisChannel {
    north: CipProgram,
    trackers: CipTrackers,
    south: Option<(SercosProgram, Trackers)>,
    limits: Limits,
    command_loss: Reaction,
    drive: BasicDriveClock,
    interpolator: Option<FineInterpolator>,
    command: AxisCommand,
    feedback: AxisFeedback,
    /// The action whose bits stand in the control word.
    action: Action,
    control_word: u16,
    action_id: u32,
    north_action: DriveAction,
    reset_id: u32,
    reset: Option<Reset>,
    /// Set-points of this number were taken.
    sequence: Option<u32>,
    fault: Option<Fault>,
    loss: Option<Loss>,
    /// The drive shows a fault whose cause is being read since then.
    cause_wanted: Option<MonotonicTime>,
    drive_reset_wanted: bool,
    /// An enable was rejected and is still asked for.
    enable_pending: bool,
    /// A connection was opened, and the axis has not been powered up on it yet.
    new_connection: bool,
    counters: AxisCounters,
}

/// The generic state machine and since when it is in its state.
#[derive(Debug, Default)]
struct BasicDriveClock {
    machine: profile_generic::state::BasicDrive,
    since: MonotonicTime,
}

impl AxisChannel {
    /// An axis whose drive is not there yet.
    #[must_use]
    pub fn new(north: CipProgram, limits: Limits, command_loss: Reaction) -> Self {
        let trackers = north.trackers();
        Self {
            north,
            trackers,
            south: None,
            limits,
            command_loss,
            drive: BasicDriveClock::default(),
            interpolator: None,
            command: AxisCommand::default(),
            feedback: AxisFeedback::default(),
            action: Action::TorqueOff,
            control_word: 0,
            action_id: 0,
            north_action: DriveAction::None,
            reset_id: 0,
            reset: None,
            sequence: None,
            fault: None,
            loss: None,
            cause_wanted: None,
            drive_reset_wanted: false,
            enable_pending: false,
            new_connection: false,
            counters: AxisCounters::default(),
        }
    }

    /// The generic state.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.drive.machine.state()
    }

    /// The newest feedback.
    #[must_use]
    pub fn feedback(&self) -> &AxisFeedback {
        &self.feedback
    }

    /// The command as the drive got it last.
    #[must_use]
    pub fn command(&self) -> &AxisCommand {
        &self.command
    }

    /// Counters.
    #[must_use]
    pub fn counters(&self) -> AxisCounters {
        self.counters
    }

    /// The program of the CIP side.
    #[must_use]
    pub fn north(&self) -> &CipProgram {
        &self.north
    }

    /// The program of the drive, once it is commissioned.
    #[must_use]
    pub fn south(&self) -> Option<&SercosProgram> {
        self.south.as_ref().map(|(program, _)| program)
    }

    /// Whether the torque may be on: then neither program may be replaced.
    #[must_use]
    pub fn may_have_torque(&self) -> bool {
        self.state().may_have_torque()
    }

    /// Takes another scaling of the controller; `false`, and nothing done, while the torque may be on.
    pub fn set_north(&mut self, program: CipProgram) -> bool {
        if self.may_have_torque() {
            return false;
        }
        self.trackers = program.trackers();
        self.north = program;
        true
    }

    /// The drive is commissioned and will be spoken to by this program.
    pub fn set_south(&mut self, program: SercosProgram) {
        let trackers = program.feedback.trackers();
        self.south = Some((program, trackers));
        self.action = Action::TorqueOff;
        self.control_word = 0;
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
        self.report(now, system, report);
        self.south = None;
    }

    /// Fine interpolation for a connection with this update period, in the way the last update asked for.
    pub fn keep_update_period(&mut self, period: DurationNs, first: TargetUpdate) {
        let present = self.interpolator.as_ref().map(FineInterpolator::config);
        if present.is_none_or(|config| config.period != period) {
            self.set_update_period(period, present.map_or(first, |config| config.target_update));
        }
    }

    /// The controller's configuration of this axis makes no sense.
    pub fn refuse_configuration(&mut self, now: MonotonicTime, system: SystemTime) {
        self.raise(now, system, Fault::new(FaultCause::CONFIGURATION, system));
    }

    /// Fine interpolation for a connection with this update period; without one, commands act as they come.
    fn set_update_period(&mut self, period: DurationNs, target_update: TargetUpdate) {
        let wanted = InterpolatorConfig { target_update, period, extrapolate_periods: EXTRAPOLATE_PERIODS };
        if self.interpolator.as_ref().is_none_or(|present| *present.config() != wanted) {
            self.interpolator = FineInterpolator::new(wanted);
            self.start_interpolator();
        }
    }

    // ---- from the drive ----------------------------------------------------------------------------------------

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

    fn age_feedback(&mut self) {
        self.feedback.fresh = false;
        self.feedback.age_cycles = self.feedback.age_cycles.saturating_add(1);
    }

    fn report(&mut self, now: MonotonicTime, system: SystemTime, report: Report) {
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
    fn tick(&mut self, now: MonotonicTime, system: SystemTime) {
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
    fn watch(&mut self, now: MonotonicTime, system: SystemTime) {
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

    fn set_cause(
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

    fn raise(&mut self, now: MonotonicTime, system: SystemTime, fault: Fault) {
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

    // ---- from the controller -----------------------------------------------------------------------------------

    /// Takes what the motion device says about this axis; to be called in every cycle after [`Self::from_drive`].
    pub fn from_controller(&mut self, now: MonotonicTime, system: SystemTime, image: &AxisCommandImage) {
        // Before the action: a lost command stops the axis as its configuration says, whatever the device asks for then.
        if let Command::Withheld(why) = image.command
            && matches!(why, Withheld::Stale | Withheld::NotConnected | Withheld::NodeFault)
        {
            self.lose_command(now, system, Loss::Withheld(why));
        }
        if image.action_id != self.action_id {
            self.action_id = image.action_id;
            self.north_action = image.action;
            self.enable_pending = false;
            self.take_action(now, system, image.action);
        }
        if self.enable_pending && self.state() == DriveState::Ready {
            // The enable came in the very cycle in which the drive was not ready; the controller still asks for it.
            self.enable_pending = false;
            self.take_action(now, system, DriveAction::Enable);
        }
        if image.reset_id != self.reset_id && self.reset.is_none_or(|reset| reset.id != image.reset_id) {
            self.begin_reset(now, system, image.reset_id);
        }
        match image.command {
            Command::Follow(set_points) => self.take_set_points(now, system, &set_points),
            Command::Withheld(_) => self.sequence = None,
        }
    }

    fn take_action(&mut self, now: MonotonicTime, system: SystemTime, action: DriveAction) {
        let drive_faulted = matches!(self.feedback.report, Report::Faulted | Report::FaultReaction);
        if action == DriveAction::PowerUp
            && std::mem::take(&mut self.new_connection)
            && !drive_faulted
            && self.fault.is_some_and(|fault| caused_by_controller(fault.cause))
        {
            // A new connection with a new configuration; nothing moves before the controller enables the axis anew.
            self.reset = Some(Reset { id: self.reset_id, since: now, begun: false });
            self.go_on_with_reset(now, system);
        }
        if !matches!(action, DriveAction::Enable | DriveAction::Abort) {
            self.end_hold(now, system);
        }
        let request = match action {
            // Without torque there is nothing to abort; the motion device keeps the fault.
            DriveAction::Abort if !self.may_have_torque() => None,
            // A connection that is gone asks for nothing, but nothing may go on moving either.
            DriveAction::None if self.may_have_torque() => self.north.drive_request(DriveAction::Disable),
            action => self.north.drive_request(action),
        };
        if let Some(request) = request {
            self.request(now, system, request);
        }
    }

    fn request(&mut self, now: MonotonicTime, system: SystemTime, request: Request) {
        let transition = self.drive.machine.request(request);
        self.follow(now, system, transition);
    }

    /// Whether the drive stands with torque because the reaction to a fault is to hold the position.
    fn holds(&self) -> bool {
        self.state() == DriveState::FaultReaction
            && self.action == Action::Halt
            && self.feedback.report == Report::Halted
    }

    /// Takes the torque away from an axis that holds its position; the fault stays.
    fn end_hold(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.holds() {
            let transition = self.drive.machine.clear_faults();
            self.follow(now, system, transition);
            self.request(now, system, Request::FaultReset);
        }
    }

    fn clear_fault(&mut self, now: MonotonicTime, system: SystemTime) {
        self.fault = None;
        self.cause_wanted = None;
        let transition = self.drive.machine.clear_faults();
        self.follow(now, system, transition);
        self.request(now, system, Request::FaultReset);
    }

    fn begin_reset(&mut self, now: MonotonicTime, system: SystemTime, id: u32) {
        self.reset = Some(Reset { id, since: now, begun: false });
        self.go_on_with_reset(now, system);
    }

    /// A stop under way is not interrupted: faults are reset once the axis is without torque.
    fn go_on_with_reset(&mut self, now: MonotonicTime, system: SystemTime) {
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
    }

    /// A controller has opened a connection: what the last one had caused may be forgotten once the axis is powered up.
    pub fn connection_opened(&mut self) {
        self.new_connection = true;
    }

    fn take_set_points(&mut self, now: MonotonicTime, system: SystemTime, points: &SetPoints) {
        if self.sequence == Some(points.sequence) {
            return;
        }
        let first = self.sequence.is_none();
        self.sequence = Some(points.sequence);
        let Some(mode) = self.north.mode(points.control_mode.0) else {
            self.raise(now, system, Fault::new(FaultCause::ILLEGAL_MODE, system));
            return;
        };
        if first || self.command.mode != mode {
            // Where the drive is now is where the controller counts from: turns made without position commands do not
            // show in a command that wraps.
            self.trackers = self.north.trackers();
            let counts = self.north.counts(self.feedback.position.get()).value;
            self.trackers.set_counts(counts.saturating_add(points.position_reference));
        }
        let mut fresh = self.command;
        let values = CyclicValues::from(&points.values);
        let conversions =
            self.north.decode(&values, points.position_reference, &mut self.trackers, &mut fresh);
        self.count_saturated(conversions.saturated);
        if conversions.not_finite > 0 || conversions.saturated > 0 {
            // Half understood is not understood.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
            return;
        }
        if let Some(cause) = self.beyond_limits(&fresh) {
            self.raise(now, system, Fault::new(cause, system));
            return;
        }
        if self.command.mode != mode || first {
            self.start_interpolator();
        }
        self.command.mode = mode;
        self.counters.commands = self.counters.commands.saturating_add(1);
        let target_update = TargetUpdate::ALL.get(usize::from(points.target.0)).copied().unwrap_or_default();
        let Some(interpolator) = self.interpolator.as_mut() else {
            self.lose_command(now, system, Loss::NoPeriod);
            return;
        };
        if interpolator.config().target_update != target_update {
            let period = interpolator.config().period;
            self.set_update_period(period, target_update);
        }
        let Some(interpolator) = self.interpolator.as_mut() else { return };
        let target = match points.target_time {
            Some(target) => SystemTime(target),
            None => target_update.target(system, interpolator.config().period),
        };
        match interpolator.update(target, &FinePoints::from(&fresh)) {
            Ok(()) => {}
            Err(UpdateError::Jump) => {
                self.raise(now, system, Fault::new(FaultCause::VELOCITY_COMMAND_LIMIT, system));
            }
            // Set-points overtaken by newer ones; silence is watched elsewhere.
            Err(UpdateError::NotNewer { .. }) => {}
            Err(error) => self.lose_command(now, system, Loss::Update(error)),
        }
    }

    fn beyond_limits(&self, command: &AxisCommand) -> Option<FaultCause> {
        let position = command.present.contains(profile_generic::image::CommandSet::POSITION);
        let below = self.limits.position_min.is_some_and(|limit| command.position < limit);
        let above = self.limits.position_max.is_some_and(|limit| command.position > limit);
        (position && (below || above)).then_some(FaultCause::POSITION_COMMAND_LIMIT)
    }

    fn lose_command(&mut self, now: MonotonicTime, system: SystemTime, loss: Loss) {
        if self.fault.is_none() && self.state().is_running() {
            self.loss = Some(loss);
            let fault = Fault::new(FaultCause::COMMAND_LOST, system).with_reaction(self.command_loss);
            self.raise(now, system, fault);
        }
    }

    fn start_interpolator(&mut self) {
        let position =
            self.feedback.present.contains(FeedbackSet::POSITION).then_some(self.feedback.position);
        if let Some(interpolator) = self.interpolator.as_mut() {
            interpolator.start(position);
        }
    }

    // ---- to the drive ------------------------------------------------------------------------------------------

    /// Fills the values of the drive's connection for the cycle that acts at `acts_at`; `false` when there is no program
    /// or no place, and then nothing may be sent.
    pub fn to_drive(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        acts_at: SystemTime,
        telegram: Option<&mut [u8]>,
    ) -> bool {
        self.fine_command(now, system, acts_at);
        let (Some((program, _)), Some(telegram)) = (self.south.as_ref(), telegram) else { return false };
        let mut conversions = ConversionReport::default();
        self.control_word =
            program.encode(&self.command, self.action, self.control_word, telegram, &mut conversions);
        self.count_saturated(conversions.saturated);
        if conversions.saturated > 0 && self.state() == DriveState::Operating {
            // The drive would be led elsewhere than the controller means.
            self.raise(now, system, Fault::new(FaultCause::POSITION_COMMAND_LIMIT, system));
        }
        true
    }

    /// The set-points of this cycle. A drive that does not follow is shown its own position: it will not jump when it
    /// begins to.
    fn fine_command(&mut self, now: MonotonicTime, system: SystemTime, acts_at: SystemTime) {
        let operating = self.state() == DriveState::Operating;
        let fine = match self.interpolator.as_mut() {
            Some(interpolator) if operating && self.sequence.is_some() => Some(interpolator.at(acts_at)),
            _ => None,
        };
        let points = match fine {
            Some(fine) => {
                if fine.quality == Quality::Lost {
                    self.lose_command(now, system, Loss::Silent);
                }
                fine.set_points
            }
            None => FinePoints::default(),
        };
        // Where the axis stops by itself or is led by velocity or torque, the position of its last command would pull at it.
        let led = operating && self.command.mode == OperatingMode::Position;
        let rest = if led { self.command.position } else { self.feedback.position };
        let all = FinePoints {
            position: Some(points.position.unwrap_or(rest)),
            velocity: Some(points.velocity.unwrap_or(Velocity::ZERO)),
            acceleration: Some(points.acceleration.unwrap_or_default()),
            torque: Some(points.torque.unwrap_or(Torque::ZERO)),
        };
        all.write_to(&mut self.command);
    }

    fn follow(&mut self, now: MonotonicTime, system: SystemTime, transition: Transition) {
        if self.feedback.state != transition.next {
            self.drive.since = now;
            if matches!(transition.next, DriveState::Starting) {
                // Until the controller's first set-points the axis holds its position, whatever it did last.
                self.command.mode = OperatingMode::Position;
                self.sequence = None;
                self.start_interpolator();
            }
            self.feedback.state = transition.next;
        }
        match transition.action {
            Action::None => {}
            Action::Reject => self.enable_pending = self.north_action == DriveAction::Enable,
            Action::ResetFault => {
                // The reset is a pulse, here a procedure command; the control word stays without torque.
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

    fn count_saturated(&mut self, count: u32) {
        self.counters.saturated = self.counters.saturated.saturating_add(count);
    }

    // ---- to the controller -------------------------------------------------------------------------------------

    /// What the motion device has to know of the drive.
    #[must_use]
    pub fn drive_image(&self) -> DriveImage {
        let mut image = DriveImage {
            online: self.south.is_some() && self.feedback.report != Report::Silent,
            action_id: self.action_id,
            reset_id: self.reset_id,
            ..DriveImage::default()
        };
        // What the controller itself asked for is no fault of the drive; the motion device knows of it.
        let mut feedback = self.feedback;
        feedback.fault = self.fault.filter(|fault| fault.cause != FaultCause::CONTROLLER_ABORT);
        // The controller is about to end it, or has a fault that says why it cannot be ended.
        feedback.inhibits.remove(Inhibits::CONFIGURATION_INCOMPLETE);
        self.north.drive_image(&feedback, &mut image);
        if self.cause_wanted.is_some() {
            // The stop ends with the fault that says why, once the drive has told it.
            image.stop_complete = false;
        }
        image
    }

    /// The fault, where the controller knows it as one of the communications node: its code, and since when.
    #[must_use]
    pub fn node_fault(&self) -> Option<(u8, SystemTime)> {
        let fault = self.fault?;
        match self.north.fault(fault.cause) {
            Some(CipFault::Node(code)) => Some((code, fault.at)),
            _ => None,
        }
    }

    /// The box ends: the axis stops as on a lost command, but holds nothing.
    pub fn end(&mut self, now: MonotonicTime, system: SystemTime) {
        self.command_loss = self.command_loss.max(Reaction::DecelerateAndDisable);
        self.lose_command(now, system, Loss::End);
        self.end_hold(now, system);
    }

    /// Sets what keeps the axis from starting for reasons the box knows.
    pub fn set_inhibits(&mut self, now: MonotonicTime, system: SystemTime, inhibits: Inhibits) {
        if let Some(transition) = self.drive.machine.set_inhibits(inhibits) {
            self.follow(now, system, transition);
        }
    }

    /// Why the command was lost, when that is the fault.
    #[must_use]
    pub fn loss(&self) -> Option<Loss> {
        self.loss.filter(|_| self.fault.is_some_and(|fault| fault.cause == FaultCause::COMMAND_LOST))
    }

    /// The fault that stands.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }
}

/// Faults that only say what the controller did or failed to do.
fn caused_by_controller(cause: FaultCause) -> bool {
    matches!(cause, FaultCause::CONTROLLER_ABORT | FaultCause::COMMAND_LOST | FaultCause::CONNECTION_CLOSED)
}
