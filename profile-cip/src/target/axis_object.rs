//! One axis: an instance of the Motion Device Axis Object, clauses 5-2.6.1 to 5-2.6.4.
//!
//! The state machine runs once per step of the device: it turns what the drive reports and what the controller asks for into
//! events, follows [`AxisState::next`], and derives the level the drive has to keep. Nothing but an Enable request that
//! begins in Stopped (or, with flying start, in Stopping) ever leads to Starting.

use profile_generic::time::MonotonicTime;

use super::axis_control::AxisControlHandshake;
use super::axis_state::{AxisConditions, AxisEvent, AxisState, ControlKind};
use super::drive_link::{DriveAction, DriveAlarm, DriveFault, DriveImage, SetPoints};
use super::event_channel::EventChannel;
use super::status_report::{RecordLog, Reported};
use crate::wire::motion::actual::SafetyStatus;
use crate::wire::motion::codes::{
    AxisControl, AxisIoStatus, AxisStatus, ClearingEvent, ControlMode, ControlStatus, EventChecking,
    FaultType,
};
use crate::wire::motion::{AlarmRecord, CommandBlock, CommandValues, FaultRecord};
use crate::wire::status::GeneralStatus;

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
    /// The drive went offline while energized.
    pub const DRIVE_LOST: u8 = 1;
}

/// Axis Fault Action, attribute 668: ramped stop, then disable.
const RAMP_AND_DISABLE: u8 = 0x22;
/// Axis Fault Action: coast, then disable.
const COAST_AND_DISABLE: u8 = 0x24;
/// State change nibble of the fault action that latches a shutdown.
const STATE_CHANGE_SHUTDOWN: u8 = 3;
/// Most transitions in one step; more would be a circle.
const TRANSITIONS_MAX: usize = 8;

/// What an axis can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisConfig {
    /// State table that the axis follows.
    pub kind: ControlKind,
    /// Control modes that may be enabled, as bits numbered by the mode code (bit 1 position, bit 2 velocity, ...).
    pub control_modes: u16,
    /// Whether an Enable in Stopping starts again.
    pub flying_start: bool,
    /// Whether the position may be reported as LINT when the controller asks for it.
    pub lint_position: bool,
    /// Events the drive can check for.
    pub events: EventChecking,
}

impl AxisConfig {
    fn supports(&self, mode: ControlMode) -> bool {
        mode != ControlMode::NO_CONTROL && mode.0 < 16 && self.control_modes & (1 << mode.0) != 0
    }
}

/// What surrounds an axis in one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Context {
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
pub(super) struct Held {
    pub set_points: SetPoints,
    pub at: MonotonicTime,
}

/// Time stamps of an update, in this device's system time, ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct UpdateTimes {
    pub time_stamp: Option<u64>,
    pub period: u64,
}

/// An instance of the Motion Device Axis Object.
pub(super) struct Axis {
    pub(super) config: AxisConfig,
    pub(super) state: AxisState,
    pub(super) shutdown: bool,
    faults: u64,
    pub(super) drive: DriveImage,
    seen_fault: Option<DriveFault>,
    pub(super) handshake: AxisControlHandshake,
    pub(super) block: CommandBlock,
    pub(super) held: Option<Held>,
    sequence: u32,
    pub(super) action: DriveAction,
    pub(super) action_id: u32,
    pub(super) reset_id: u32,
    /// Fault Reset or Shutdown Reset that waits for the drive.
    reset: Option<AxisControl>,
    /// The axis left an energized state without a stop of its own and has not stopped yet.
    winding_down: bool,
    pub(super) actual_reference: i64,
    pub(super) command_reference: i64,
    pub(super) displacement: i32,
    alarm: Option<DriveAlarm>,
    pub(super) fault_log: RecordLog<FaultRecord>,
    pub(super) alarm_log: RecordLog<AlarmRecord>,
    pub(super) axis_status: Reported<(AxisStatus, u32)>,
    pub(super) io_status: Reported<(AxisIoStatus, u32)>,
    pub(super) safety: Reported<SafetyStatus>,
    pub(super) events: EventChannel,
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
        Self {
            config,
            state: AxisState::Initializing,
            shutdown: false,
            faults: 0,
            drive: DriveImage::default(),
            seen_fault: None,
            handshake: AxisControlHandshake::default(),
            block: CommandBlock::default(),
            held: None,
            sequence: 0,
            action: DriveAction::None,
            action_id: 0,
            reset_id: 0,
            reset: None,
            winding_down: false,
            actual_reference: 0,
            command_reference: 0,
            displacement: 0,
            alarm: None,
            fault_log: RecordLog::new(),
            alarm_log: RecordLog::new(),
            axis_status: Reported::new(),
            io_status: Reported::new(),
            safety: Reported::new(),
            events: EventChannel::new(config.events),
        }
    }

    pub fn state(&self) -> AxisState {
        self.state
    }

    /// Axis Faults, attribute 657.
    pub fn faults(&self) -> u64 {
        self.faults
    }

    pub fn drive(&self) -> &DriveImage {
        &self.drive
    }

    pub fn block(&self) -> &CommandBlock {
        &self.block
    }

    /// Command Target Time, attribute 93.
    pub fn target_time(&self) -> u64 {
        self.held.and_then(|held| held.set_points.target_time).unwrap_or(0)
    }

    /// Records lost because a log was full.
    pub fn dropped_records(&self) -> u32 {
        self.fault_log.dropped().saturating_add(self.alarm_log.dropped())
    }

    /// Whether attributes are limited to those of Table 5-2.110.
    pub fn is_running(&self) -> bool {
        matches!(self.state, AxisState::Starting | AxisState::Running | AxisState::Testing)
    }

    /// Whether a Fault Reset has something to reset; minor faults count, they are latched as well.
    fn has_fault(&self) -> bool {
        match self.state {
            AxisState::Initializing => false,
            AxisState::MajorFaulted | AxisState::Aborting => true,
            _ => self.faults != 0 || self.drive.fault.is_some(),
        }
    }

    fn conditions(&self) -> AxisConditions {
        AxisConditions {
            bus_up: self.drive.bus_up,
            shutdown: self.shutdown,
            in_process: false,
            start_inhibited: self.inhibited(),
            flying_start: self.config.flying_start,
        }
    }

    fn inhibited(&self) -> bool {
        self.drive.start_inhibits != 0 || self.drive.start_inhibits_mfg != 0
    }

    /// Follows the state table. Returns whether the event had an effect.
    fn fire(&mut self, event: AxisEvent) -> bool {
        let Some(next) = self.state.next(self.config.kind, event, &self.conditions()) else { return false };
        // Close and loss take an axis out of motion without a Stopping state of its own.
        let unconnected = matches!(event, AxisEvent::ConnectionClose | AxisEvent::ConnectionLoss);
        let moves = self.config.kind == ControlKind::Active && self.state.is_energized();
        self.winding_down |= unconnected && moves;
        self.state = next;
        true
    }

    /// Whether the drive speaks of the action that is in force.
    pub(super) fn answers(&self) -> bool {
        self.drive.online && self.drive.action_id == self.action_id
    }

    // -- connection ---------------------------------------------------------------------------------------------

    /// A connection was opened: defaults, no faults, no shutdown (clause 5-2.6.2.3).
    pub fn open(&mut self, system_time: u64) {
        self.fire(AxisEvent::Reconnection);
        self.forget();
        self.log_cleared(ClearingEvent::CONNECTION_RESET, system_time);
    }

    /// The controller closed the connection.
    pub fn close(&mut self) {
        self.fire(AxisEvent::ConnectionClose);
        self.forget();
        self.update_action();
    }

    /// The connection was lost.
    pub fn lose(&mut self) {
        self.fire(AxisEvent::ConnectionLoss);
        self.handshake.reset();
        self.held = None;
        self.reset = None;
        self.events.handle(None);
        self.update_action();
    }

    fn forget(&mut self) {
        self.shutdown = false;
        self.faults = 0;
        self.seen_fault = None;
        self.reset = None;
        self.handshake.reset();
        self.block = CommandBlock::default();
        self.held = None;
        self.actual_reference = 0;
        self.command_reference = 0;
        self.displacement = 0;
        self.fault_log = RecordLog::new();
        self.alarm_log = RecordLog::new();
        self.alarm = None;
        self.axis_status = Reported::new();
        self.io_status = Reported::new();
        self.safety = Reported::new();
        self.events.handle(None);
    }

    // -- controller ---------------------------------------------------------------------------------------------

    /// Takes the cyclic block of an update that was proven timely.
    pub fn handle_block(
        &mut self,
        block: &CommandBlock,
        times: UpdateTimes,
        now: MonotonicTime,
        context: &Context,
    ) {
        self.block = *block;
        let mode = ControlMode(block.control_mode.0 & 0x0F);
        if has_set_point(mode, &block.values) {
            self.sequence = self.sequence.wrapping_add(1);
            let ahead = times.period.saturating_mul(u64::from(block.target.0));
            let set_points = SetPoints {
                control_mode: mode,
                feedback_mode: block.feedback_mode,
                values: block.values,
                target: block.target,
                time_stamp: times.time_stamp,
                target_time: times.time_stamp.map(|t| t.saturating_add(ahead)),
                position_reference: 0,
                sequence: self.sequence,
                age_updates: 0,
            };
            self.held = Some(Held { set_points, at: now });
        } else if self.state == AxisState::Running && self.config.kind == ControlKind::Active {
            self.raise_illegal_mode(sub_code::SET_POINT_MISSING, context);
        }
        let controls = matches!(self.state, AxisState::Starting | AxisState::Running);
        if controls && self.config.kind == ControlKind::Active && !self.config.supports(mode) {
            self.raise_illegal_mode(sub_code::MODE_NOT_SUPPORTED, context);
        }
        if let Some(request) = self.handshake.request(block.axis_control) {
            self.begin(request, block, context);
        }
    }

    /// The block of an update that did not prove timely: what it asks for is not carried out, what it takes away is.
    pub fn handle_status_request(&mut self, block: &CommandBlock) {
        self.block.actual_data_set = block.actual_data_set;
        self.block.status_data_set = block.status_data_set;
    }

    /// Takes the controller's Last Received ID.
    pub fn acknowledge(&mut self, received: u8) {
        self.fault_log.acknowledge(received);
        self.alarm_log.acknowledge(received);
        self.axis_status.acknowledge(received);
        self.io_status.acknowledge(received);
        self.safety.acknowledge(received);
    }

    fn raise_illegal_mode(&mut self, sub_code: u8, context: &Context) {
        let fault = DriveFault {
            fault_type: FaultType::AXIS,
            code: fault_code::ILLEGAL_CONTROL_MODE,
            sub_code,
            action: RAMP_AND_DISABLE,
        };
        self.raise(fault, context.system_time);
    }

    fn begin(&mut self, request: AxisControl, block: &CommandBlock, context: &Context) {
        let done = match request {
            AxisControl::ENABLE => self.begin_enable(context),
            AxisControl::DISABLE => {
                self.fire(AxisEvent::Disable);
                None
            }
            AxisControl::SHUTDOWN if self.state == AxisState::Initializing => {
                Some(GeneralStatus::OBJECT_STATE_CONFLICT)
            }
            AxisControl::SHUTDOWN => {
                self.shutdown = true;
                self.fire(AxisEvent::Shutdown);
                None
            }
            AxisControl::SHUTDOWN_RESET if self.state == AxisState::Shutdown => {
                self.shutdown = false;
                self.fire(AxisEvent::ShutdownReset);
                self.log_cleared(ClearingEvent::SHUTDOWN_RESET, context.system_time);
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::SHUTDOWN_RESET if self.state != AxisState::MajorFaulted => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::FAULT_RESET if !self.has_fault() => {
                self.log_cleared(ClearingEvent::FAULT_RESET, context.system_time);
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::SHUTDOWN_RESET | AxisControl::FAULT_RESET => {
                self.reset_id = self.reset_id.wrapping_add(1);
                self.reset = Some(request);
                None
            }
            AxisControl::ABORT if self.state == AxisState::Initializing => {
                Some(GeneralStatus::OBJECT_STATE_CONFLICT)
            }
            AxisControl::ABORT => {
                let fault = DriveFault {
                    fault_type: FaultType::AXIS,
                    code: fault_code::CONTROLLER_INITIATED,
                    sub_code: 0,
                    action: RAMP_AND_DISABLE,
                };
                self.raise(fault, context.system_time);
                None
            }
            AxisControl::STOP_PROCESS => Some(GeneralStatus::SUCCESS),
            AxisControl::CHANGE_ACTUAL_POSITION | AxisControl::CHANGE_COMMAND_POSITION => {
                Some(self.displace(request, block.values.position_displacement))
            }
            _ => Some(GeneralStatus::SERVICE_NOT_SUPPORTED),
        };
        if let Some(status) = done {
            self.handshake.complete(status);
        }
    }

    fn begin_enable(&mut self, context: &Context) -> Option<GeneralStatus> {
        if self.config.kind != ControlKind::Active {
            return Some(GeneralStatus::OBJECT_STATE_CONFLICT);
        }
        if matches!(self.state, AxisState::Starting | AxisState::Running) {
            return None;
        }
        let ready = context.remote && !context.node_fault && self.drive.online && !self.inhibited();
        let mode = ControlMode(self.block.control_mode.0 & 0x0F);
        if !self.config.supports(mode) {
            return Some(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        if ready && self.fire(AxisEvent::Enable) { None } else { Some(GeneralStatus::OBJECT_STATE_CONFLICT) }
    }

    fn displace(&mut self, request: AxisControl, displacement: Option<i32>) -> GeneralStatus {
        let Some(displacement) = displacement else { return GeneralStatus::NOT_ENOUGH_DATA };
        let reference = if request == AxisControl::CHANGE_ACTUAL_POSITION {
            self.displacement = displacement;
            &mut self.actual_reference
        } else {
            &mut self.command_reference
        };
        *reference = reference.saturating_add(i64::from(displacement));
        GeneralStatus::SUCCESS
    }

    // -- drive --------------------------------------------------------------------------------------------------

    pub fn set_drive(&mut self, image: DriveImage) {
        self.drive = image;
    }

    fn log_cleared(&mut self, by: ClearingEvent, system_time: u64) {
        let record = FaultRecord {
            fault_type: FaultType::CLEARED,
            code: by.0,
            time_stamp: system_time,
            ..FaultRecord::default()
        };
        self.fault_log.push(record);
    }

    fn raise(&mut self, fault: DriveFault, system_time: u64) {
        self.fault_log.push(FaultRecord {
            fault_type: fault.fault_type,
            code: fault.code,
            sub_code: fault.sub_code,
            action: fault.action,
            time_stamp: system_time,
        });
        if fault.fault_type == FaultType::AXIS && fault.code < 64 {
            self.faults |= 1 << fault.code;
        }
        let state_change = fault.action >> 4;
        if state_change == STATE_CHANGE_SHUTDOWN {
            self.shutdown = true;
        }
        if state_change != 0 {
            self.fire(AxisEvent::MajorFault);
        }
    }

    fn log_alarm(&mut self, system_time: u64) {
        if self.alarm == self.drive.alarm {
            return;
        }
        for (alarm, state) in [(self.alarm, 0), (self.drive.alarm, 1)] {
            if let Some(alarm) = alarm {
                self.alarm_log.push(AlarmRecord {
                    alarm_type: alarm.alarm_type,
                    code: alarm.code,
                    sub_code: alarm.sub_code,
                    state,
                    time_stamp: system_time,
                });
            }
        }
        self.alarm = self.drive.alarm;
    }

    // -- state machine ------------------------------------------------------------------------------------------

    /// Lets the state follow the drive, the connection and the requests in progress.
    pub fn step(&mut self, context: &Context) {
        self.log_alarm(context.system_time);
        for _ in 0..TRANSITIONS_MAX {
            let before = self.state;
            self.follow(context);
            self.update_action();
            if self.state == before {
                break;
            }
        }
        self.complete_request();
    }

    fn follow(&mut self, context: &Context) {
        if self.answers() && self.drive.stop_complete {
            self.winding_down = false;
        }
        if self.state == AxisState::Initializing {
            let configured = self.block.control_status.contains(ControlStatus::CONFIGURATION_COMPLETE);
            let ready = context.connected && configured && self.drive.online;
            if ready && !context.node_fault && !self.winding_down {
                self.fire(AxisEvent::InitializationComplete);
            }
            return;
        }
        self.follow_faults(context);
        self.follow_drive(context);
    }

    fn follow_faults(&mut self, context: &Context) {
        if let Some(request) = self.reset
            && self.drive.online
            && self.drive.reset_id == self.reset_id
            && !self.winding_down
        {
            self.reset = None;
            self.faults = 0;
            self.seen_fault = None;
            let (event, cleared) = if request == AxisControl::SHUTDOWN_RESET {
                self.shutdown = false;
                (AxisEvent::ShutdownReset, ClearingEvent::SHUTDOWN_RESET)
            } else {
                (AxisEvent::FaultReset, ClearingEvent::FAULT_RESET)
            };
            self.log_cleared(cleared, context.system_time);
            self.fire(event);
            if self.handshake.executing() == Some(request) {
                self.handshake.complete(GeneralStatus::SUCCESS);
            }
        }
        // An axis that already stops for a fault does not get another one for going silent.
        if self.state.is_energized() && !self.drive.online && self.state != AxisState::Aborting {
            let fault = DriveFault {
                fault_type: FaultType::AXIS,
                code: fault_code::EXTERNAL,
                sub_code: sub_code::DRIVE_LOST,
                action: COAST_AND_DISABLE,
            };
            self.raise(fault, context.system_time);
        }
        if self.drive.fault != self.seen_fault {
            self.seen_fault = self.drive.fault;
            if let Some(fault) = self.drive.fault {
                self.raise(fault, context.system_time);
            }
        }
        if context.node_fault {
            self.fire(AxisEvent::MajorFault);
        }
    }

    fn follow_drive(&mut self, context: &Context) {
        match self.state {
            AxisState::PreCharge if self.drive.online && self.drive.bus_up => self.fire(AxisEvent::BusUp),
            AxisState::PreCharge if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::Stopped if !self.drive.bus_up || !self.drive.online => self.fire(AxisEvent::BusDown),
            AxisState::Stopped if self.inhibited() => self.fire(AxisEvent::StartInhibit),
            AxisState::StartInhibited if !self.inhibited() => self.fire(AxisEvent::InhibitsCleared),
            AxisState::Starting | AxisState::Running if self.inhibited() || !context.remote => {
                self.fire(AxisEvent::Disable)
            }
            AxisState::Starting if self.answers() && self.drive.start_complete => {
                self.fire(AxisEvent::StartComplete)
            }
            // A drive that no longer follows is no longer Running, and does not start again by itself.
            AxisState::Running
                if self.config.kind == ControlKind::Active
                    && self.answers()
                    && !self.drive.start_complete =>
            {
                self.fire(AxisEvent::Disable)
            }
            AxisState::Running if self.config.kind == ControlKind::Converter && !self.drive.bus_up => {
                self.fire(AxisEvent::BusDown)
            }
            AxisState::Stopping | AxisState::Aborting if self.answers() && self.drive.stop_complete => {
                self.fire(AxisEvent::StopComplete)
            }
            _ => false,
        };
    }

    fn complete_request(&mut self) {
        let Some(request) = self.handshake.executing() else { return };
        let state = self.state;
        let done = match request {
            AxisControl::ENABLE if state == AxisState::Running => {
                (self.answers() && self.drive.tracking).then_some(GeneralStatus::SUCCESS)
            }
            AxisControl::ENABLE if state == AxisState::Starting => None,
            AxisControl::ENABLE => Some(GeneralStatus::OBJECT_STATE_CONFLICT),
            AxisControl::DISABLE if !state.is_energized() => Some(GeneralStatus::SUCCESS),
            AxisControl::SHUTDOWN if matches!(state, AxisState::Shutdown | AxisState::MajorFaulted) => {
                Some(GeneralStatus::SUCCESS)
            }
            AxisControl::ABORT if matches!(state, AxisState::Aborting | AxisState::MajorFaulted) => {
                Some(GeneralStatus::SUCCESS)
            }
            _ => None,
        };
        if let Some(status) = done {
            self.handshake.complete(status);
        }
    }

    fn update_action(&mut self) {
        let action = match self.state {
            AxisState::Off | AxisState::SelfTest => DriveAction::None,
            AxisState::Initializing if self.winding_down => DriveAction::Disable,
            AxisState::Initializing => DriveAction::None,
            AxisState::PreCharge | AxisState::Stopped | AxisState::StartInhibited => DriveAction::PowerUp,
            // Only an axis that controls motion is energized by Running.
            AxisState::Running if self.config.kind != ControlKind::Active => DriveAction::PowerUp,
            AxisState::Starting | AxisState::Running | AxisState::Testing => DriveAction::Enable,
            AxisState::Stopping if self.shutdown => DriveAction::Shutdown,
            AxisState::Stopping => DriveAction::Disable,
            AxisState::Aborting | AxisState::MajorFaulted => DriveAction::Abort,
            AxisState::Shutdown => DriveAction::Shutdown,
        };
        if action != self.action {
            self.action = action;
            self.action_id = self.action_id.wrapping_add(1);
        }
    }
}
