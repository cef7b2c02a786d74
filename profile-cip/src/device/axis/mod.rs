//! One axis: an instance of the Motion Device Axis Object, clauses 5-2.6.1 to 5-2.6.4.
//!
//! The state machine runs once per step of the device: it turns what the drive reports and what the controller asks for into
//! events, follows [`AxisState::next`], and derives the level the drive has to keep. Nothing but an Enable request that
//! begins in Stopped (or, with flying start, in Stopping) ever leads to Starting.

pub mod drive_link;
pub mod event_channel;
mod events;
pub mod exception;
mod fault;
pub mod fault_log;
mod follow;
pub(super) mod handshake;
mod reference;
pub mod refused;
pub(super) mod report;
mod request;
pub mod state;
mod status;
mod test;

pub use fault::FaultWords;
pub(crate) use fault::Faults;
pub use reference::PositionView;
use reference::References;

use self::drive_link::{AxisCommandImage, DriveAction, DriveImage, SetPoints};
use self::event_channel::EventChannel;
use self::events::{Sample, Watch};
use self::exception::DriveCondition;
use self::fault_log::FaultLog;
use self::handshake::AxisControlHandshake;
use self::refused::RefusedRequest;
use self::state::{AxisConditions, AxisEvent, AxisState, ControlKind};
use self::test::AxisTest;
use crate::reported::Reported;
use crate::wire::motion::actual::SafetyStatus;
use crate::wire::motion::codes::{
    AxisControl, AxisIoStatus, AxisStatus, ClearingEvent, ControlMode, EventType, FeedbackMode,
    FeedbackSource, TestStatus,
};
use crate::wire::motion::test_service::HookupTestData;
use crate::wire::motion::{ActualBlock, CommandBlock, CommandValues};
use arrayvec::ArrayVec;
use profile_generic::time::MonotonicTime;

/// Bit numbers of the axis faults that this module raises itself, Table 5-2.65.
mod fault_code {
    pub const ILLEGAL_CONTROL_MODE: u8 = 60;
    pub const CONTROLLER_INITIATED: u8 = 62;
    pub const EXTERNAL: u8 = 63;
}

/// Sub codes of [`fault_code::ILLEGAL_CONTROL_MODE`] and [`fault_code::EXTERNAL`].
mod sub_code {
    /// The Control Mode is not one of the axis.
    pub const MODE_NOT_SUPPORTED: u8 = 1;
    /// The update lacks the set-point of its Control Mode.
    pub const SET_POINT_MISSING: u8 = 2;
    /// The Feedback Mode is not one of the axis, or not to be changed now.
    pub const FEEDBACK_NOT_SUPPORTED: u8 = 3;
    /// Position control was asked for between the two steps of a change of reference.
    pub const REFERENCE_CHANGING: u8 = 4;
    /// The drive went offline while energized.
    pub const DRIVE_LOST: u8 = 1;
}

/// Refusals between two looks at them; the first ones count.
const REFUSED_MAX: usize = 4;

/// Axis Fault Action, attribute 668: ramped stop, then disable.
const RAMP_AND_DISABLE: u8 = 0x22;
/// Axis Fault Action: coast, then disable.
const COAST_AND_DISABLE: u8 = 0x24;
/// State change nibble of the fault action that latches a shutdown.
const STATE_CHANGE_SHUTDOWN: u8 = 3;

/// What an axis can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisConfig {
    /// State table that the axis follows.
    pub kind: ControlKind,
    /// Control modes that may be enabled, as bits numbered by the mode code (bit 1 position, bit 2 velocity, ...).
    pub control_modes: u16,
    /// Feedback Modes that the axis can work with, as bits numbered by the code (bit 2 motor, bit 3 load, ...).
    pub feedback_modes: u16,
    /// Whether the position may be reported as LINT when the controller asks for it.
    pub lint_position: bool,
    /// Hookup tests that can be run, as bits numbered by the code of the test (Table 5-2.94).
    pub hookup_tests: u8,
}

impl AxisConfig {
    fn supports(&self, mode: ControlMode) -> bool {
        mode != ControlMode::NO_CONTROL && mode.0 < 16 && self.control_modes & (1 << mode.0) != 0
    }

    fn supports_feedback(&self, mode: FeedbackMode) -> bool {
        self.feedback_modes & (1 << mode.source().0) != 0
    }
}

/// How the drive of an axis starts and stops, as far as the axis has to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SequenceSettings {
    /// An Enable in Stopping starts again (Flying Start Enable, attribute 380).
    pub flying_start: bool,
    /// Axis Fault Action (attribute 668) of an Abort request: the configured Stopping Action.
    pub abort: u8,
}

/// What surrounds an axis in one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context {
    /// A connection is open.
    pub connected: bool,
    /// The controller has remote control.
    pub remote: bool,
    /// A node fault is active.
    pub node_fault: bool,
    /// System time, ns; 0 if it is not known.
    pub system_time: u64,
}

/// The newest good cyclic block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    pub set_points: SetPoints,
    pub at: MonotonicTime,
}

/// Times of an update; the stamp in this device's system time, ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct UpdateTimes {
    pub time_stamp: Option<u64>,
    pub period: u64,
    /// When the update would have arrived on an even network.
    pub paced_at: MonotonicTime,
}

/// The cyclic block of the controller.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Commanded {
    /// The last one.
    pub block: CommandBlock,
    /// Set-points of the newest good one.
    pub held: Option<Held>,
    /// Counts the set-points.
    sequence: u32,
    /// Feedback Mode with which the axis was enabled.
    feedback_source: FeedbackSource,
}

/// The handshake of Axis Control.
#[derive(Debug, Clone, Default)]
pub(crate) struct Requests {
    handshake: AxisControlHandshake,
    /// Requests that were refused and not reported yet.
    pub refused: ArrayVec<RefusedRequest, REFUSED_MAX>,
}

/// What the drive is ordered to do.
#[derive(Debug, Clone, Copy, Default)]
struct Orders {
    action: DriveAction,
    action_id: u32,
    reset_id: u32,
    /// Fault Reset or Shutdown Reset that waits for the drive.
    reset: Option<AxisControl>,
    /// A connection began or ended, and the drive has not been asked to reset its faults since.
    connection_reset: bool,
}

impl Orders {
    /// Puts another action in force; the drive sees by the number that it is another one.
    fn set_action(&mut self, action: DriveAction) {
        if action != self.action {
            self.action = action;
            self.action_id = self.action_id.wrapping_add(1);
        }
    }

    /// Has the drive reset its faults.
    fn ask_reset(&mut self) {
        self.reset_id = self.reset_id.wrapping_add(1);
    }
}

/// The state of the axis and what goes with it.
#[derive(Debug, Clone, Copy)]
struct Machine {
    state: AxisState,
    /// The state table that it follows: of its kind, or that of a feedback device while Control Mode is 0.
    kind: ControlKind,
    /// A shutdown is latched.
    shutdown: bool,
    /// Stopped with torque: a category 2 stop has ended.
    holding: bool,
    /// The axis left an energized state without a stop of its own and has not stopped yet.
    winding_down: bool,
}

impl Machine {
    /// Follows the state table. Returns whether the event had an effect.
    fn fire(&mut self, event: AxisEvent, conditions: &AxisConditions, power_enabled: bool) -> bool {
        let Some(next) = self.state.next(self.kind, event, conditions) else { return false };
        // Close and loss take an axis out of motion, and a new connection out of a hold, without a Stopping state of its own.
        let unconnected =
            matches!(event, AxisEvent::ConnectionClose | AxisEvent::ConnectionLoss | AxisEvent::Reconnection);
        let energized = self.state.is_energized() || power_enabled;
        self.winding_down |= unconnected && energized && self.kind == ControlKind::Active;
        // A category 2 stop ends with the power structure on, and the drive goes on doing what Disable asked for.
        self.holding = event == AxisEvent::StopComplete && next == AxisState::Stopped && power_enabled;
        self.state = next;
        true
    }
}

/// Status values on their way to the controller.
#[derive(Default)]
struct ReportedStatus {
    axis_status: Reported<(AxisStatus, u32)>,
    io_status: Reported<(AxisIoStatus, u32)>,
    safety: Reported<SafetyStatus>,
}

impl ReportedStatus {
    fn acknowledge(&mut self, received: u8) {
        self.axis_status.acknowledge(received);
        self.io_status.acknowledge(received);
        self.safety.acknowledge(received);
    }
}

/// An instance of the Motion Device Axis Object.
pub(crate) struct Axis {
    pub config: AxisConfig,
    sequence_settings: SequenceSettings,
    machine: Machine,
    pub faults: Faults,
    drive: DriveImage,
    pub requests: Requests,
    pub command: Commanded,
    orders: Orders,
    references: References,
    reported: ReportedStatus,
    pub events: EventChannel,
    watch: Watch,
    test: AxisTest,
}

/// Whether the command values hold the one that the mode needs.
fn has_set_point(mode: ControlMode, values: &CommandValues) -> bool {
    match mode {
        ControlMode::POSITION => values.position.is_some(),
        ControlMode::VELOCITY => values.velocity.is_some(),
        ControlMode::ACCELERATION => values.acceleration.is_some(),
        ControlMode::TORQUE => values.torque.is_some(),
        _ => true,
    }
}

impl Axis {
    /// An axis after its self test: Initializing.
    pub fn new(config: AxisConfig) -> Self {
        let machine = Machine {
            state: AxisState::Initializing,
            kind: config.kind,
            shutdown: false,
            holding: false,
            winding_down: false,
        };
        Self {
            config,
            sequence_settings: SequenceSettings { flying_start: false, abort: RAMP_AND_DISABLE },
            machine,
            faults: Faults::new(),
            drive: DriveImage::default(),
            requests: Requests::default(),
            command: Commanded::default(),
            orders: Orders::default(),
            references: References::default(),
            reported: ReportedStatus::default(),
            events: EventChannel::default(),
            watch: Watch::default(),
            test: AxisTest::default(),
        }
    }

    pub fn set_sequence(&mut self, settings: SequenceSettings) {
        self.sequence_settings = settings;
    }

    /// The state table that it follows.
    pub fn kind(&self) -> ControlKind {
        self.machine.kind
    }

    pub fn state(&self) -> AxisState {
        self.machine.state
    }

    /// Exceptions, faults and alarms.
    pub fn fault_words(&self) -> &FaultWords {
        self.faults.words()
    }

    /// The log for people.
    pub fn log(&self) -> &FaultLog {
        &self.faults.log
    }

    pub fn drive(&self) -> &DriveImage {
        &self.drive
    }

    pub fn block(&self) -> &CommandBlock {
        &self.command.block
    }

    /// Command Target Time, attribute 93.
    pub fn target_time(&self) -> u64 {
        self.command.held.and_then(|held| held.set_points.target_time).unwrap_or(0)
    }

    /// Records lost because a log was full.
    pub fn dropped_records(&self) -> u32 {
        self.faults.fault_records.dropped().saturating_add(self.faults.alarm_records.dropped())
    }

    /// Whether attributes are limited to those of Table 5-2.110.
    pub fn is_running(&self) -> bool {
        matches!(self.machine.state, AxisState::Starting | AxisState::Running | AxisState::Testing)
    }

    /// Whether a Fault Reset has something to reset; minor faults count, they are latched as well.
    fn has_fault(&self) -> bool {
        match self.machine.state {
            AxisState::Initializing => false,
            AxisState::MajorFaulted | AxisState::Aborting => true,
            _ => self.faults.any() || self.drive.conditions.as_slice().iter().any(DriveCondition::stops),
        }
    }

    fn conditions(&self) -> AxisConditions {
        AxisConditions {
            bus_up: self.drive.bus_up,
            shutdown: self.machine.shutdown,
            in_process: self.test.is_energizing(),
            start_inhibited: self.inhibited(),
            flying_start: self.sequence_settings.flying_start,
        }
    }

    fn inhibited(&self) -> bool {
        self.drive.start_inhibits != 0 || self.drive.start_inhibits_mfg != 0
    }

    /// Follows the state table. Returns whether the event had an effect.
    fn fire(&mut self, event: AxisEvent) -> bool {
        let conditions = self.conditions();
        self.machine.fire(event, &conditions, self.drive.power_enabled)
    }

    /// Whether the drive speaks of the action that is in force.
    pub(crate) fn answers(&self) -> bool {
        self.drive.online && self.drive.action_id == self.orders.action_id
    }

    /// Whether the stop that is in force has ended. Also of a drive that is gone: nobody sees it come to rest, but the
    /// time limit of its stop runs out, and that ends Aborting as well (clause 5-2.6.2.11).
    pub(crate) fn has_stopped(&self) -> bool {
        self.drive.action_id == self.orders.action_id && self.drive.stop_complete
    }

    // -- connection ---------------------------------------------------------------------------------------------

    /// A connection was opened: defaults, no faults, no shutdown (clause 5-2.6.2.3). That includes the faults of the drive,
    /// which is asked to reset them; what is still wrong after that is a fault again when the axis leaves Initializing.
    pub fn open(&mut self, system_time: u64) {
        self.fire(AxisEvent::Reconnection);
        self.forget(system_time);
        self.faults.record_cleared(ClearingEvent::CONNECTION_RESET, system_time);
        // At once: a stop that ended before the connection is no answer to what is asked for now.
        self.update_action();
    }

    /// The controller closed the connection: no faults and no alarms (clause 5-2.6.2.3), and the axis stops as for a Disable.
    pub fn close(&mut self, system_time: u64) {
        self.fire(AxisEvent::ConnectionClose);
        self.forget(system_time);
        self.update_action();
    }

    /// The connection was lost.
    pub fn lose(&mut self) {
        self.fire(AxisEvent::ConnectionLoss);
        self.test.break_off(TestStatus::ABORTED);
        self.test.end();
        self.requests.handshake.reset();
        self.command.held = None;
        self.orders.reset = None;
        self.events.handle(None);
        self.update_action();
    }

    fn forget(&mut self, system_time: u64) {
        self.machine.kind = self.config.kind;
        self.test.forget();
        self.machine.shutdown = false;
        self.faults.forget(system_time);
        self.orders.reset = None;
        self.orders.connection_reset = true;
        self.requests.handshake.reset();
        self.command.block = CommandBlock::default();
        self.command.held = None;
        self.references.reset();
        self.reported = ReportedStatus::default();
        self.events.reset();
        self.watch = Watch::default();
    }

    // -- what it reports ----------------------------------------------------------------------------------------

    /// What the drive reports is written over what it reported before: `fill` has to leave nothing of that.
    pub fn update_drive(&mut self, fill: impl FnOnce(&mut DriveImage)) {
        let before = Sample::of(&self.drive);
        fill(&mut self.drive);
        // Another scaling or another unwind is in use: positions of before mean nothing in it.
        if before.scaling_id != self.drive.scaling_id {
            self.references.reset();
        }
        self.watch.check(&mut self.events, &before, &self.drive, &self.references);
    }

    /// An event that the drive was looking for; `position` is in the reference system of power-up.
    pub fn notify_event(&mut self, event: EventType, status: u8, position: i64, time_stamp: u64) -> bool {
        let position = self.references.see(position, self.drive.unwind).dint();
        self.events.notify(event, status, position, time_stamp)
    }

    pub fn position_view(&self) -> PositionView {
        PositionView::new(self.references, self.drive.unwind)
    }

    /// Get_Hookup_Test_Data: the result of the last test; `None` before the first one.
    pub fn hookup_test_data(&self) -> Option<HookupTestData> {
        self.test.data()
    }

    /// Whether exceptions wait to be looked at.
    pub fn has_found(&self) -> bool {
        self.faults.has_found()
    }

    /// What the drive has to do at `now`. `period_ns` and `limit` judge the age of the set-points.
    pub fn command(
        &self,
        now: MonotonicTime,
        context: &Context,
        period_ns: u64,
        limit: u32,
    ) -> AxisCommandImage {
        report::command(self, now, context, period_ns, limit)
    }

    /// Axis Status, attribute 651.
    pub fn status(&self, context: &Context) -> AxisStatus {
        report::status(self, context)
    }

    /// The cyclic actual block of D-to-C update `update_id`, whose time stamp is `stamp`, system time in ns; `None` for an
    /// update without one.
    pub fn actual_block(&mut self, update_id: u8, stamp: Option<u64>, context: &Context) -> ActualBlock {
        report::actual_block(self, update_id, stamp, context)
    }

    /// When the actual values were captured, system time in ns; `None` while the drive measures nothing or does not say
    /// when.
    pub fn captured_at(&self) -> Option<u64> {
        report::captured_at(self)
    }
}
