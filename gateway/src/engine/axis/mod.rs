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
//!
//! An axis is made of parts, each with a state of its own. [`AxisChannel`] has the state machine in the middle and orders what the parts do:
//! [`cycle`] in each cycle of the bus, [`north`] when the north side wants something.
//!
//! | part | what it owns |
//! |---|---|
//! | [`link`] | the drive's program, the words that went and came last, the handshake of targets |
//! | [`supervision`] | limits, ends of travel, jumps of the position, silence |
//! | [`diagnosis`] | what is read of a drive that shows an error or a warning |
//! | [`faults`] | what is wrong, the fault that has stopped the axis, and the reactions that are wanted |
//! | [`orders`] | the wish of the north side, resets |
//! | [`start_stop`] | the steps of a start or stop, and the ramp |
//! | [`set_points`] | what was taken of the north side, interpolator, trims, guard |
//! | [`hookup`], [`capture`], [`procedure`] | tests, captured positions, procedures that the drive carries out |

pub mod capture;
mod counters;
mod cycle;
mod diagnosis;
mod diagnostic_message;
mod faults;
mod feed_forward;
mod guard;
mod handshake;
mod heat;
mod history;
mod hookup;
mod link;
pub(super) mod nameplate;
mod north;
mod orders;
mod overtravel;
mod position_jump;
pub mod procedure;
mod ramp;
mod reactions;
pub mod rest;
mod set_points;
mod slow_values;
mod start_stop;
mod supervision;
#[cfg(test)]
mod tests;
mod tolerance;
mod trim;
mod user_limits;
mod velocimeter;
mod waiting;

use std::sync::Arc;

pub use self::counters::Totals;
pub use self::diagnostic_message::DiagnosticMessage;
pub use self::feed_forward::FeedForward;
pub use self::guard::Trip;
pub use self::hookup::HookupSettings;
pub use self::orders::{Intent, Owner, Wish};
pub use self::position_jump::PositionJump;
pub use self::ramp::Ramp;
pub use self::reactions::Reactions;
pub use self::set_points::{NorthPoints, Target, Updates};
pub use self::start_stop::StopSettings;
pub use self::tolerance::Tolerances;
pub use self::user_limits::UserLimits;
pub use self::waiting::{Awaited, Waiting};

use crate::mapping::{Control, DriveProgram};
use profile_generic::capture::{CaptureResult, CaptureSet};
use profile_generic::fault::{Fault, Reaction};
use profile_generic::fault_set::{ActiveFault, FaultSet};
use profile_generic::hookup::TestReport;
use profile_generic::image::{AxisCommand, AxisFeedback, FeedbackSet, Signal};
use profile_generic::interpolation::UpdateError;
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::sequence::SequenceStep;
use profile_generic::state::{Action, BasicDrive, DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::access::{Access, AccessFailure, Progress};
use crate::mapping::Item;

use self::capture::{CaptureAccess, CaptureUnit};
use self::counters::Counters;
use self::diagnosis::{Diagnosis, Shows};
use self::faults::Faults;
use self::hookup::HookupUnit;
use self::link::Link;
use self::orders::Orders;
use self::procedure::{ProcedureAccess, ProcedureUnit};
use self::rest::{Rest, Unrested};
use self::set_points::SetPoints;
use self::start_stop::StartStop;
use self::supervision::Supervision;

/// How long a drive may take from the enable to following set-points; a commutation search may take seconds.
pub const START_TIME_OUT: DurationNs = DurationNs::from_secs(10);

/// How long an enable waits for the drive to become ready.
pub const READY_TIME_OUT: DurationNs = DurationNs::from_secs(2);

/// How long a drive may take to come to rest before its torque is taken away.
pub const STOP_TIME_OUT: DurationNs = DurationNs::from_secs(30);

/// How long the stop of a drive that cannot be heard is waited for. It brakes by itself, as fast as it can, when it misses
/// its commands. Waiting longer shows nothing more, and the axis cannot be used before the drive is heard again.
pub const SILENCE_TIME_OUT: DurationNs = DurationNs::from_secs(1);

/// How long a drive in operation may take to another operating mode.
pub const MODE_TIME_OUT: DurationNs = DurationNs::from_millis(100);

/// How long the drive may take to clear its faults after a reset.
pub const RESET_TIME_OUT: DurationNs = DurationNs::from_secs(5);

/// Cycles for which a fault reset stands in the control word: its edge counts, and a telegram or two may be lost.
const RESET_CYCLES: u8 = 5;

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
    /// Faults raised since the start.
    pub faults: u32,
}

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
    #[error("the gateway ends")]
    End,
}

/// An axis in generic terms, between one north side at a time and one drive.
#[derive(Debug)]
pub struct AxisChannel {
    /// It may be switched on.
    moves: bool,
    /// The box ends: it is not switched on any more.
    ends: bool,
    drive: Drive,
    command: AxisCommand,
    feedback: AxisFeedback,
    link: Link,
    supervision: Supervision,
    diagnosis: Diagnosis,
    faults: Faults,
    orders: Orders,
    start_stop: StartStop,
    set_points: SetPoints,
    hookup: HookupUnit,
    captures: CaptureUnit,
    procedure: ProcedureUnit,
    /// Values of the drive mean something else than its program was made of.
    rescaled: u32,
    /// What the configuration has of motor and power stage.
    data: Vec<(Parameter, i64)>,
    /// What is known of the values of the drive that change slowly.
    slow: slow_values::SlowValues,
    /// Whether the drive is of the motor that the configuration says.
    nameplate: nameplate::NameplateCheck,
    /// How warm it is by its load.
    heats: heat::Heats,
    /// What it has done in its life.
    totals: Counters,
}

/// The generic state machine.
#[derive(Debug)]
struct Drive {
    machine: BasicDrive,
    /// Since when it is in its state.
    since: MonotonicTime,
    /// The action whose bits stand in the control word.
    action: Action,
}

impl AxisChannel {
    /// An axis whose drive is not there yet.
    /// `moves` is whether it may ever be switched on: an encoder or a converter may not, regardless of who asks.
    #[must_use]
    pub fn new(limits: Limits, command_loss: Reaction, moves: bool) -> Self {
        let since = MonotonicTime::default();
        Self {
            moves,
            ends: false,
            drive: Drive { machine: BasicDrive::default(), since, action: Action::TorqueOff },
            command: AxisCommand::default(),
            feedback: AxisFeedback::default(),
            link: Link::default(),
            supervision: Supervision::new(limits),
            diagnosis: Diagnosis::default(),
            faults: Faults::new(command_loss),
            orders: Orders::default(),
            start_stop: StartStop::default(),
            set_points: SetPoints::new(),
            hookup: HookupUnit::default(),
            captures: CaptureUnit::default(),
            procedure: ProcedureUnit::default(),
            rescaled: 0,
            data: Vec::new(),
            slow: slow_values::SlowValues::default(),
            nameplate: nameplate::NameplateCheck::default(),
            heats: heat::Heats::default(),
            totals: Counters::default(),
        }
    }

    /// Forgets what the drive was told, as an axis that has told it nothing yet. Only without torque.
    pub fn forget_command(&mut self) {
        self.command = AxisCommand::default();
    }

    // ---- state -------------------------------------------------------------------------------------------------

    /// The generic state.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.drive.machine.state()
    }

    /// The action that the control word asks for.
    #[must_use]
    pub fn action(&self) -> Action {
        self.drive.action
    }

    /// Whether the torque may be on: then no program may be replaced.
    #[must_use]
    pub fn may_have_torque(&self) -> bool {
        self.state().may_have_torque()
    }

    /// What the box itself watches.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.supervision.limits
    }

    /// Whether it may ever be switched on: an encoder or a converter may not.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// Whether it may be switched on now, whoever asks.
    const fn may_start(&self) -> bool {
        self.moves && !self.ends
    }

    /// Where in a start or stop the axis is.
    #[must_use]
    pub fn sequence_step(&self) -> SequenceStep {
        self.start_stop.step()
    }

    /// Whether the drive stands with torque because the reaction to a fault is to hold the position.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.is_to_hold() && self.feedback.report == Report::Halted
    }

    /// Whether the reaction to a fault is to hold the position; the axis may still move.
    fn is_to_hold(&self) -> bool {
        self.state() == DriveState::FaultReaction && self.drive.action == Action::Halt
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

    /// The value of a signal: set-points as the drive got them last, trims as they count.
    #[must_use]
    pub fn signal(&self, signal: Signal) -> Option<i64> {
        match self.set_points.trims.applied(signal) {
            None if signal.is_command() => self.command.get(signal),
            None => self.feedback.get(signal),
            trim => trim,
        }
    }

    /// What the gateway keeps of the parameters that it goes by for a drive without them; `None` for others.
    #[must_use]
    pub fn kept(&self, parameter: Parameter) -> Option<i64> {
        let FeedForward { gain, inertia } = self.start_stop.settings.feed_forward;
        match parameter {
            Parameter::SYSTEM_INERTIA => Some(inertia),
            Parameter::ACCELERATION_FEED_FORWARD_GAIN => Some(gain),
            Parameter::MOTOR_USE => Some(self.heats.motor.millionths()),
            Parameter::DRIVE_USE => Some(self.heats.drive.millionths()),
            Parameter::HEARD_TIME => Some(self.supervision.heard_for().0),
            Parameter::MOTOR_ENCODER_SHOWN => Some(1),
            Parameter::COUNTED_RUN_TIME => Some(self.totals().run_time.0),
            Parameter::COUNTED_WORK => Some(self.totals().motor_work),
            Parameter::COUNTED_TURNS => Some(self.totals().motor_turns),
            _ => None,
        }
    }

    /// What controls the axis, for what follows from its loops.
    #[must_use]
    pub fn control(&self) -> Control {
        let state = self.state();
        let follows = state == DriveState::Operating && self.drive.action == Action::Enable;
        match self.command.selection() {
            _ if !state.may_have_torque() => Control::Off,
            ModeSelection { mode, interpolation: InterpolationSource::Controller }
                if follows && mode != OperatingMode::Homing =>
            {
                Control::Gateway(mode)
            }
            _ => Control::Drive,
        }
    }

    /// What it has counted since the start.
    #[must_use]
    pub fn counters(&self) -> AxisCounters {
        AxisCounters {
            commands: self.set_points.commands,
            lost_telegrams: self.link.lost_telegrams,
            saturated: self.set_points.saturated.saturating_add(self.link.saturated),
            faults: self.faults.count(),
        }
    }

    /// What it has done in its life, as far as gateways have counted it.
    #[must_use]
    pub fn totals(&self) -> Totals {
        self.totals.totals()
    }

    /// Sets what was counted before; to be called before the first cycle.
    pub fn begin_totals(&mut self, totals: Totals) {
        self.totals.begin_with(totals);
    }

    /// What the axis waits for; `None` when it does what it was told, or has nothing to do.
    #[must_use]
    pub fn waiting(&self) -> Option<Waiting> {
        waiting::waiting(self)
    }

    /// The same without what the drive shows: cheap enough for every cycle.
    #[must_use]
    pub fn awaited(&self) -> Option<Awaited> {
        waiting::awaited(self)
    }

    // ---- faults ------------------------------------------------------------------------------------------------

    /// Everything that is wrong now.
    pub fn faults(&self) -> impl Iterator<Item = &ActiveFault> {
        self.faults.set().iter()
    }

    /// The same, as the set that it is.
    #[must_use]
    pub fn fault_set(&self) -> &FaultSet {
        self.faults.set()
    }

    /// The fault that stands.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.faults.first()
    }

    /// Whether the drive reports a fault whose cause is still being read.
    #[must_use]
    pub fn is_diagnosing(&self) -> bool {
        self.diagnosis.is_searching()
    }

    /// Why the command was lost, when that is the fault.
    #[must_use]
    pub fn loss(&self) -> Option<Loss> {
        self.faults.loss()
    }

    /// The limit that a set-point has exceeded, when that is the fault.
    #[must_use]
    pub fn tripped(&self) -> Option<Trip> {
        self.faults.tripped()
    }

    /// The jump of the actual position, when that is the fault.
    #[must_use]
    pub fn jump(&self) -> Option<PositionJump> {
        self.faults.jump()
    }

    // ---- rest --------------------------------------------------------------------------------------------------

    /// How long its stop may take by its own limits: to the end of the torque, and from there to rest.
    #[must_use]
    pub fn stop_limit(&self) -> DurationNs {
        self.start_stop.limit()
    }

    /// Whether it may have torque, or is on its way to rest without.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.may_have_torque() || self.start_stop.is_stopping()
    }

    /// What is known of its motion.
    #[must_use]
    pub fn rest(&self) -> Rest {
        rest::rest(self)
    }

    /// Whether the actual velocity is known and not above the standstill speed.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.feedback.present.contains(FeedbackSet::VELOCITY)
            && self.start_stop.stands(self.feedback.velocity)
    }

    /// Whether it follows set-points: the drive operates, and its start sequence has ended.
    #[must_use]
    pub fn operates(&self) -> bool {
        self.state() == DriveState::Operating && self.sequence_step() == SequenceStep::Running
    }

    /// Whether the drive starts, operates or is tested, and no stop has begun.
    #[must_use]
    pub fn runs(&self) -> bool {
        self.state().is_running() && !self.start_stop.is_stopping()
    }

    /// Whether there is nothing to be waited for: it stands without torque, or will not be seen to.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        rest::has_stopped(self)
    }

    /// What there is to say of it when it is waited for no longer; `None` when it stands without torque.
    #[must_use]
    pub fn unrested(&self, number: usize) -> Option<Unrested> {
        rest::unrested(self, number)
    }

    // ---- its drive ---------------------------------------------------------------------------------------------

    /// Whether its drive is there and heard.
    #[must_use]
    pub fn is_heard(&self) -> bool {
        self.south().is_some() && self.feedback.report != Report::Silent
    }

    /// Whether its drive has not been heard for so long that the end of its stop is waited for no longer.
    #[must_use]
    pub fn is_unseen(&self) -> bool {
        self.supervision.is_unseen()
    }

    /// The program of the drive, once it is commissioned.
    #[must_use]
    pub fn south(&self) -> Option<&DriveProgram> {
        self.link.program()
    }

    /// The same, to be kept.
    #[must_use]
    pub fn shared_south(&self) -> Option<Arc<DriveProgram>> {
        self.link.shared_program()
    }

    /// Sets the data that the configuration has of motor and power stage; to be called before the first cycle.
    pub fn set_data(&mut self, data: Vec<(Parameter, i64)>) {
        self.data = data;
    }

    /// The data that the configuration has of motor and power stage.
    #[must_use]
    pub fn data(&self) -> &[(Parameter, i64)] {
        &self.data
    }

    /// A number that is another one after the drive has got another program or is gone: what was made of [`Self::south`] may be kept
    /// as long as it is the same.
    #[must_use]
    pub fn programs(&self) -> u64 {
        self.link.programs()
    }

    /// The drive is commissioned and will be spoken to by this program. One that others hold too should have the data of the axis:
    /// otherwise it is copied, which allocates.
    pub fn set_south(&mut self, program: impl Into<Arc<DriveProgram>>) {
        let mut program = program.into();
        if !program.has_data(&self.data) {
            Arc::make_mut(&mut program).set_data(&self.data);
        }
        let constant = |of| program.datum(of).map(DurationNs);
        let constants = [Parameter::MOTOR_THERMAL_TIME, Parameter::DRIVE_THERMAL_TIME].map(constant);
        self.heats.set_constants(constants);
        self.procedure.restart(program.procedures());
        self.nameplate.begin(&self.data, &program);
        self.link.connect(program);
        self.captures.restart();
        self.drive.action = Action::TorqueOff;
        self.rescaled = 0;
    }

    /// Whether the drive's own fault reset is to be executed, until [`Self::drive_reset_sent`].
    #[must_use]
    pub fn wants_drive_reset(&self) -> bool {
        self.orders.drive_reset_wanted
    }

    /// The drive's own fault reset is on its way.
    pub fn drive_reset_sent(&mut self) {
        self.orders.drive_reset_wanted = false;
        self.link.pulse_reset();
    }

    /// The diagnostic word that should be read now.
    #[must_use]
    pub fn wants_word(&self, now: MonotonicTime) -> Option<Item> {
        self.diagnosis.wanted(now, self.south()?, Shows::of(&self.feedback))
    }

    /// The word that was wanted is on its way.
    pub fn word_asked(&mut self, now: MonotonicTime, item: Item) {
        self.diagnosis.ask(now, item, Shows::of(&self.feedback));
    }

    /// What should be read now, so that people are told what the drive says.
    #[must_use]
    pub fn wanted_diagnostic(&self, now: MonotonicTime) -> Option<Item> {
        self.diagnosis.message.wanted(now, self.south()?.diagnosis())
    }

    /// What was wanted is on its way.
    pub fn diagnostic_requested(&mut self, now: MonotonicTime, item: Item) {
        self.diagnosis.message.ask(now, item);
    }

    /// The drive has answered, or has nothing to say. Returns all that it said when that was the last of it, and the fault or
    /// warning is still there.
    pub fn diagnostic_message_read(&mut self, item: Item, data: Option<&[u8]>) -> Option<DiagnosticMessage> {
        let items = self.south().map_or(0, |program| program.diagnosis().len());
        self.diagnosis.message.take(item, data, items, Shows::of(&self.feedback).any())
    }

    /// The value that should be read now, because a limit of it is watched: its place and what carries it.
    pub(in crate::engine) fn wanted_slow_value(&self, now: MonotonicTime) -> Option<(usize, Item)> {
        self.slow.wanted(now, &self.start_stop.settings.user_limits, self.south()?)
    }

    /// What was wanted is on its way.
    pub(in crate::engine) fn slow_value_requested(&mut self, now: MonotonicTime, place: usize) {
        self.slow.ask(now, place);
    }

    /// The drive has answered, or does not give it.
    pub(in crate::engine) fn slow_value_read(&mut self, now: MonotonicTime, item: Item, data: Option<&[u8]>) {
        self.slow.take(now, item, data, self.link.program());
    }

    /// The value of the nameplate that should be read now, to compare it.
    pub(in crate::engine) fn wanted_nameplate_value(&self) -> Option<Item> {
        self.nameplate.wanted(self.south()?)
    }

    /// What was wanted is on its way.
    pub(in crate::engine) fn nameplate_value_requested(&mut self) {
        self.nameplate.ask();
    }

    /// The drive has answered, or does not give it. Returns how it differs from the nameplate.
    pub(in crate::engine) fn nameplate_value_read(
        &mut self,
        item: Item,
        data: Option<&[u8]>,
    ) -> Option<nameplate::Difference> {
        self.nameplate.take(item, data, self.link.program())
    }

    // ---- tests, captures, procedures ---------------------------------------------------------------------------

    /// The end of the test, once it has ended.
    #[must_use]
    pub fn test_report(&self) -> Option<TestReport> {
        self.hookup.report()
    }

    /// Tells what events need captured, in each cycle and after [`AxisChannel::poll_capture`] gives no more.
    pub fn want_captures(&mut self, wanted: CaptureSet) {
        if let Some(program) = self.link.program() {
            self.captures.want(program.captures(), wanted);
        }
    }

    /// The captures that the drive looks for now.
    #[must_use]
    pub fn checked_captures(&self) -> CaptureSet {
        self.south().map_or(CaptureSet::default(), |program| self.captures.checking(program.captures()))
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
        if let Some(program) = self.link.program() {
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
        let Some(program) = self.link.program() else { return };
        if self.procedure.answer(program.procedures(), access, generation, result, now) {
            self.restart_position();
        }
    }

    /// The drive has given its place another position: it is what the drive says, not so many turns more.
    fn restart_position(&mut self) {
        self.link.restart_position();
        self.supervision.restart_plausibility();
        self.totals.restart_position();
    }
}
