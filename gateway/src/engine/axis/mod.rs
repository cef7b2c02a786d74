//! One axis between its two sides: what the controller wants goes in at the top, what the drive is told comes out at the
//! bottom, and the same way back.
//!
//! ```text
//! Wish, NorthPoints, AxisCommand --BasicDrive, FineInterpolator--> AxisCommand --DriveProgram--> bus
//! AxisFeedback, faults           <--BasicDrive------------------- AxisFeedback <--DriveProgram-- bus
//! ```
//!
//! The axis knows no protocol: a north side ([`super::device`]) speaks to it in the generic model, and the program
//! of its drive is made of the tables.
//!
//! Everything here runs in the cycle: no allocation, no waiting. What corresponds to what stands in the two programs.

pub mod capture;
mod diagnosis;
mod diagnostic_message;
mod feedback;
mod guard;
mod handshake;
mod history;
mod hookup;
mod image;
mod north;
mod overtravel;
mod position_jump;
pub mod procedure;
pub mod rest;
mod sequence;
mod set_point;
mod trim;
mod velocimeter;
mod waiting;
mod wish;

pub use self::diagnostic_message::DiagnosticMessage;
pub use self::guard::Trip;
pub use self::hookup::HookupSettings;
pub use self::position_jump::PositionJump;
pub use self::set_point::{NorthPoints, Target};
pub use self::waiting::{Awaited, Waiting};
pub use self::wish::{Intent, Wish};

use self::hookup::TestRun;
use crate::mapping::{CachedStatus, DriveProgram};
use profile_generic::capture::{CaptureResult, CaptureSet};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::fault_set::{ActiveFault, FaultSet};
use profile_generic::image::{AxisCommand, AxisFeedback, FeedbackSet, StatusBits};
use profile_generic::interpolation::{FineInterpolator, InterpolatorConfig, TargetUpdate, UpdateError};
use profile_generic::mode::ModeSelection;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::sequence::{Sequencer, StopRamp};
use profile_generic::state::{Action, DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use crate::engine::access::{Access, AccessFailure, Progress};

use self::capture::CaptureAccess;
use self::procedure::{ProcedureAccess, ProcedureUnit};

/// How long a drive may take from the enable to following set-points; a commutation search may take seconds.
pub const START_TIME_OUT: DurationNs = DurationNs::from_secs(10);

/// How long a drive may take to come to rest before its torque is taken away.
pub const STOP_TIME_OUT: DurationNs = DurationNs::from_secs(30);

/// How long the stop of a drive that cannot be heard is waited for. It brakes by itself, as fast as it can, when it misses
/// its commands; whoever waits longer sees nothing either, and the axis can be of no use before it is heard again.
pub const SILENCE_TIME_OUT: DurationNs = DurationNs::from_secs(1);

/// How long a drive in operation may take to another operating mode.
pub const MODE_TIME_OUT: DurationNs = DurationNs::from_millis(100);

/// How long the drive may take to clear its faults after a reset.
pub const RESET_TIME_OUT: DurationNs = DurationNs::from_secs(5);

/// Cycles for which a fault reset stands in the control word: its edge counts, and a telegram or two may be lost.
const RESET_CYCLES: u8 = 5;

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
    /// Highest velocity of set-points and of the drive, either direction, with a tenth to spare for its overshoot.
    pub velocity: Option<Velocity>,
    /// Highest acceleration and deceleration of set-points, with a tenth to spare.
    pub acceleration: Option<Acceleration>,
    /// Largest distance of actual from commanded position. What follows from it is for the controller to say.
    pub following_error: Option<Position>,
    /// What the hookup tests may do; without it none of them moves the axis.
    pub hookup: Option<HookupSettings>,
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

pub use sequence::StopSettings;

/// Why a command counts as lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// The north side gives no set-points, for this reason.
    #[error("the motion connection gives no set-points: {0}")]
    Withheld(&'static str),
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
    /// Nanounits in a count of the north side: it cannot command anything finer.
    count: i64,
    /// Counts the programs of the drive that were taken or given up.
    programs: u64,
    south: Option<(DriveProgram, CachedStatus)>,
    limits: Limits,
    command_loss: Reaction,
    /// It may be switched on.
    moves: bool,
    drive: BasicDriveClock,
    /// Since when the drive is not heard.
    silent_since: Option<MonotonicTime>,
    /// That is so long ago that the end of its stop is waited for no longer.
    unseen: bool,
    interpolator: Option<FineInterpolator>,
    sequencer: Sequencer,
    stop_settings: StopSettings,
    /// The command's way to rest, in a ramped stop.
    ramp: Option<StopRamp>,
    /// The speed at which the axis was started on the move, until its first set-points.
    caught: Option<Velocity>,
    /// The instant of the grid that the last command is for.
    acts_at: MonotonicTime,
    /// By how much the last cycle was late.
    late: DurationNs,
    /// How far set-points are ahead of the moment at which they are made.
    ahead: DurationNs,
    guard: guard::Guard,
    /// The limit that the fault is about, when it is about one.
    tripped: Option<Trip>,
    /// Since when the drive in operation shows another operating mode than it is told.
    other_mode_since: Option<MonotonicTime>,
    command: AxisCommand,
    trims: trim::Trims,
    feedback: AxisFeedback,
    /// The action whose bits stand in the control word.
    action: Action,
    /// What was sent last, and what the drive showed last: words, and operating modes above them.
    control: u32,
    status: u32,
    /// Cycles for which a fault reset still stands in the control word.
    reset_cycles: u8,
    wish: Wish,
    reset_id: u32,
    reset: Option<Reset>,
    /// Set-points of this number were taken.
    sequence: Option<u32>,
    /// The fault that has stopped the axis: the first one, until a reset.
    fault: Option<Fault>,
    /// Everything that is wrong now.
    faults: FaultSet,
    diagnosis: diagnosis::Diagnosis,
    diagnostic_message: diagnostic_message::Reading,
    /// For a drive that tells positions and no velocity.
    velocimeter: velocimeter::Velocimeter,
    plausibility: position_jump::Plausibility,
    /// The jump that the fault of this instant is about.
    jump: Option<(SystemTime, PositionJump)>,
    loss: Option<Loss>,
    /// The drive shows a fault whose cause is being read since then.
    cause_wanted: Option<MonotonicTime>,
    drive_reset_wanted: bool,
    /// An enable was rejected and is still asked for.
    enable_pending: bool,
    /// The hookup test that the controller has asked for.
    test: Option<TestRun>,
    /// The torque was switched on for a test.
    started_for_test: bool,
    counters: AxisCounters,
    captures: capture::CaptureUnit,
    procedure: ProcedureUnit,
    overtravel: overtravel::Overtravel,
    /// The same of the software limits.
    software_overtravel: overtravel::Overtravel,
    handshake: handshake::Handshake,
    /// Since when the drive is told the operating mode that it is told now.
    told_since: MonotonicTime,
    /// Where the axis came to rest in a halt.
    halted_at: Option<Position>,
    /// The operation mode that the drive shows, and whether it follows command values, whatever it carries out.
    shown: Option<ModeSelection>,
    follows: bool,
    /// A request of this number was taken from a north side that speaks in the generic model.
    requested: Option<u32>,
}

/// The generic state machine and since when it is in its state.
#[derive(Debug, Default)]
struct BasicDriveClock {
    machine: profile_generic::state::BasicDrive,
    since: MonotonicTime,
}

impl AxisChannel {
    /// An axis whose drive is not there yet.
    /// `moves` is whether it may ever be switched on: an encoder or a converter may not, whoever asks.
    #[must_use]
    pub fn new(limits: Limits, command_loss: Reaction, moves: bool) -> Self {
        Self {
            count: 1,
            programs: 0,
            south: None,
            limits,
            command_loss,
            moves,
            drive: BasicDriveClock::default(),
            silent_since: None,
            unseen: false,
            interpolator: None,
            sequencer: Sequencer::default(),
            stop_settings: StopSettings::default(),
            ramp: None,
            caught: None,
            acts_at: MonotonicTime::default(),
            late: DurationNs::ZERO,
            ahead: DurationNs::ZERO,
            guard: guard::Guard::default(),
            tripped: None,
            other_mode_since: None,
            command: AxisCommand::default(),
            trims: trim::Trims::default(),
            feedback: AxisFeedback::default(),
            action: Action::TorqueOff,
            control: 0,
            status: 0,
            reset_cycles: 0,
            wish: Wish::default(),
            reset_id: 0,
            reset: None,
            sequence: None,
            fault: None,
            faults: FaultSet::new(),
            diagnosis: diagnosis::Diagnosis::default(),
            diagnostic_message: diagnostic_message::Reading::default(),
            velocimeter: velocimeter::Velocimeter::default(),
            plausibility: position_jump::Plausibility::default(),
            jump: None,
            loss: None,
            cause_wanted: None,
            drive_reset_wanted: false,
            enable_pending: false,
            test: None,
            started_for_test: false,
            counters: AxisCounters::default(),
            captures: capture::CaptureUnit::default(),
            procedure: ProcedureUnit::default(),
            overtravel: overtravel::Overtravel::default(),
            software_overtravel: overtravel::Overtravel::default(),
            handshake: handshake::Handshake::default(),
            told_since: MonotonicTime::default(),
            halted_at: None,
            shown: None,
            follows: false,
            requested: None,
        }
    }

    /// The generic state.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.drive.machine.state()
    }

    /// What the drive is told to do.
    #[must_use]
    pub fn action(&self) -> Action {
        self.action
    }

    /// Everything that is wrong now.
    pub fn faults(&self) -> impl Iterator<Item = &ActiveFault> {
        self.faults.iter()
    }

    /// The same, as the set that it is.
    #[must_use]
    pub fn fault_set(&self) -> &FaultSet {
        &self.faults
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

    /// The program of the drive, once it is commissioned.
    #[must_use]
    pub fn south(&self) -> Option<&DriveProgram> {
        self.south.as_ref().map(|(program, _)| program)
    }

    /// A number that is another one after the drive has got another program or is gone: what was made of [`Self::south`] may be kept
    /// as long as it is the same.
    #[must_use]
    pub fn programs(&self) -> u64 {
        self.programs
    }

    /// Whether the torque may be on: then no program may be replaced.
    #[must_use]
    pub fn may_have_torque(&self) -> bool {
        self.state().may_have_torque()
    }

    /// Sets how fine the north side can command, in nanounits.
    pub fn set_count(&mut self, count: i64) {
        self.count = count;
    }

    /// The drive is commissioned and will be spoken to by this program.
    pub fn set_south(&mut self, program: DriveProgram) {
        let cached = program.cached_status();
        self.procedure.restart(program.procedures());
        self.south = Some((program, cached));
        self.programs += 1;
        self.captures.restart();
        self.action = Action::TorqueOff;
        (self.control, self.status, self.reset_cycles) = (0, 0, 0);
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
        self.end_diagnosis();
        self.velocimeter.restart();
        self.plausibility.restart();
        self.report(now, system, report);
        self.south = None;
        self.programs += 1;
        self.captures.restart();
        self.procedure.restart(&[]);
        self.shown = None;
        self.follows = false;
        self.feedback.status.remove(ProcedureUnit::STATUS | StatusBits::INPUTS);
    }

    /// Tells what events need captured, in each cycle and after [`AxisChannel::poll_capture`] gives no more.
    pub fn want_captures(&mut self, wanted: CaptureSet) {
        if let Some((program, _)) = &self.south {
            self.captures.want(program.captures(), wanted);
        }
    }

    /// The oldest capture that has come, or has failed.
    pub fn poll_capture(&mut self) -> Option<CaptureResult> {
        self.captures.poll()
    }

    /// A service channel access that the captures need, with what [`AxisChannel::capture_answer`] wants back.
    #[must_use]
    pub fn capture_access(&self) -> Option<(Access, CaptureAccess, u8)> {
        self.captures.access(self.south()?.captures())
    }

    /// The access is on its way.
    pub fn capture_sent(&mut self, access: CaptureAccess) {
        self.captures.sent(access);
    }

    /// The drive has answered such an access.
    pub fn capture_answer(
        &mut self,
        access: CaptureAccess,
        generation: u8,
        result: Result<&[u8], AccessFailure>,
    ) {
        if let Some((program, _)) = &self.south {
            self.captures.answer(program.captures(), access, generation, result);
        }
    }

    /// A service channel access that a procedure needs, with what [`AxisChannel::procedure_answer`] wants back.
    #[must_use]
    pub fn procedure_access(&self, now: MonotonicTime) -> Option<(Access, ProcedureAccess, u8)> {
        // Procedure commands belong to CP4, in which the drive is heard.
        let heard = self.feedback.fresh || self.procedure.selection().is_some();
        self.procedure.access(self.south().filter(|_| heard)?.procedures(), now)
    }

    /// The access is on its way.
    pub fn procedure_sent(&mut self, access: ProcedureAccess) {
        self.procedure.sent(access);
    }

    /// The drive has answered such an access.
    pub fn procedure_answer(
        &mut self,
        now: MonotonicTime,
        access: ProcedureAccess,
        generation: u8,
        result: Result<Progress, AccessFailure>,
    ) {
        let Some((program, cached)) = &mut self.south else { return };
        if self.procedure.answer(program.procedures(), access, generation, result, now) {
            // The drive has given its place another position: it is what the drive says, not so many turns more.
            cached.restart();
            self.plausibility.restart();
        }
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

    fn count_saturated(&mut self, count: u32) {
        self.counters.saturated = self.counters.saturated.saturating_add(count);
    }
}

/// Faults that only say what the controller did or failed to do.
fn caused_by_controller(cause: FaultCause) -> bool {
    matches!(cause, FaultCause::CONTROLLER_ABORT | FaultCause::COMMAND_LOST | FaultCause::CONNECTION_CLOSED)
}
