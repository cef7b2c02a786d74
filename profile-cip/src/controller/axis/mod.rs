//! One axis as the controller sees it: what the device says of it, and the command stream to it.
//!
//! Commands are planned for an instant of the controller's own clock, the command target time, so that an
//! update that is sent late or lost leaves the path as it is.

mod motion;
mod reference;
mod seen;

use self::motion::Motion;
pub(super) use self::motion::check_torque_step;
use self::reference::Reference;
use self::seen::Seen;
use super::config::{AxisSetup, Scaling};
use super::cyclic_lists::CyclicLists;
use super::event::Event;
use super::events::EventChecks;
use super::failure::Failure;
use super::following::Following;
use super::handshake::Handshake;
use super::misbehaviour::Spoil;
use super::number::{counts, float, fold, real, roll};
use super::report::AxisReport;
use super::sets::DataSets;
use super::trajectory::State;
use crate::wire::motion::codes::{
    ActualDataSet, AxisStateCode, AxisStatus, CommandDataSet, CommandTarget, ControlMode, ControlStatus,
    FeedbackMode, StatusDataSet,
};
use crate::wire::motion::event::{ACTUAL_EVENTS_BARE, COMMAND_EVENTS_MAX};
use crate::wire::motion::{
    ActualBlock, CommandBlock, CommandPosition, CommandValues, FaultRecord, Format, StatusValues,
};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// What a D-to-C update says beside the axis' own block.
#[derive(Debug, Clone, Copy)]
pub(super) struct UpdateTime {
    /// Instant of the actual values.
    pub at: SystemTime,
    /// How far a command may be carried on for comparison.
    pub ahead: DurationNs,
}

/// One axis.
#[derive(Debug)]
pub(super) struct Axis {
    pub handshake: Handshake,
    pub events: EventChecks,
    pub report: AxisReport,
    pub seen: Seen,
    pub lists: CyclicLists,
    /// Whether an update has room for one value of 32 bits each way.
    fixed: bool,
    /// Sets and modes are those of now; steps change them.
    setup: AxisSetup,
    /// Counts in a unit, once that is known.
    scale: Option<f64>,
    mode: ControlMode,
    motion: Motion,
    /// In counts.
    command: State,
    /// In % of motor rated torque.
    torque: f64,
    /// Velocity in units/s above which an axis in torque control loses its torque.
    torque_guard: Option<f64>,
    reference: Reference,
    planned_for: MonotonicTime,
    following: Following,
}

impl Axis {
    pub fn new(instance: u8, format: Format, setup: AxisSetup) -> Self {
        Self {
            fixed: format == Format::Fixed,
            handshake: Handshake::default(),
            events: EventChecks::default(),
            report: AxisReport { axis: instance, ..AxisReport::default() },
            seen: Seen::default(),
            lists: CyclicLists::default(),
            scale: match setup.scaling {
                Scaling::Counts(counts) => Some(counts),
                Scaling::Unknown | Scaling::Device => None,
            },
            mode: setup.control_mode,
            motion: Motion::None,
            command: State::default(),
            torque: 0.0,
            torque_guard: None,
            reference: Reference::default(),
            planned_for: MonotonicTime::ZERO,
            following: Following::default(),
            setup,
        }
    }

    /// The connection is a new one: nothing that was seen or agreed on the old one counts.
    pub fn reconnect(&mut self) {
        self.handshake = Handshake::default();
        self.events = EventChecks::default();
        self.seen.reconnect();
        self.lists = CyclicLists::default();
        self.reference = Reference::default();
        self.motion = Motion::None;
        self.torque = 0.0;
        self.mode = self.setup.control_mode;
        self.following.clear();
    }

    pub const fn instance(&self) -> u8 {
        self.report.axis
    }

    pub const fn state(&self) -> Option<AxisStateCode> {
        self.seen.state
    }

    /// The fault that has not been reset yet.
    pub const fn fault(&self) -> Option<FaultRecord> {
        self.seen.fault
    }

    /// Counts in a unit; 1 as long as nobody knows, which only serves reports.
    pub fn scale(&self) -> f64 {
        self.scale.unwrap_or(1.0)
    }

    /// Whether steps may move the axis.
    pub const fn is_scaled(&self) -> bool {
        self.scale.is_some()
    }

    /// The device has reported its scaling.
    pub fn set_scale(&mut self, counts: f64) {
        self.scale = Some(counts);
    }

    /// Whether the device follows the command.
    pub fn is_running(&self) -> bool {
        let tracking = self.seen.status.is_none_or(|s| s.contains(AxisStatus::TRACKING_COMMAND));
        self.seen.state == Some(AxisStateCode::RUNNING) && tracking && self.place().is_some()
    }

    /// The actual values asked for: in the variable format always with the position.
    pub fn asked(&self) -> ActualDataSet {
        let always = if self.fixed { ActualDataSet::empty() } else { ActualDataSet::POSITION };
        self.setup.sets.actual | always
    }

    /// Whether the position is among the actual values.
    pub fn has_position(&self) -> bool {
        self.asked().contains(ActualDataSet::POSITION)
    }

    /// Whether the actual value that is asked for in the fixed format has come.
    pub fn is_seen(&self) -> bool {
        !self.fixed || self.place().is_some()
    }

    /// Where the axis is, in counts; zero for one that is led without a position.
    pub(super) fn place(&self) -> Option<i64> {
        if self.has_position() { self.seen.actual } else { Some(0) }
    }

    /// Distance between command and actual position, in units.
    pub fn distance(&self) -> Option<f64> {
        self.seen.actual.map(|actual| (self.command.position - float(actual)).abs() / self.scale())
    }

    /// The commanded position in units.
    pub fn commanded(&self) -> f64 {
        self.command.position / self.scale()
    }

    /// What travels in the updates.
    pub const fn sets(&self) -> &DataSets {
        &self.setup.sets
    }

    /// Changes what travels in the updates. In the fixed format another actual value comes instead of the one before:
    /// under a motion, and from the position in position control, that would blind the controller.
    pub fn change_sets(&mut self, sets: DataSets) -> Result<(), Failure> {
        let axis = self.instance();
        if self.fixed && sets.actual != self.setup.sets.actual {
            if self.is_moving() {
                return Err(Failure::AxisBusy { axis });
            }
            if [self.mode, self.setup.control_mode].contains(&ControlMode::POSITION) {
                return Err(Failure::NoPosition { axis });
            }
            self.seen.forget_motion();
        }
        self.setup.sets = sets;
        Ok(())
    }

    /// Changes back what travels in the updates.
    pub fn set_sets(&mut self, sets: DataSets) {
        self.setup.sets = sets;
    }

    /// Feedback Mode that is being sent.
    pub const fn feedback_mode(&self) -> FeedbackMode {
        self.setup.feedback_mode
    }

    /// Changes the Feedback Mode.
    pub fn set_feedback_mode(&mut self, mode: FeedbackMode) {
        self.setup.feedback_mode = mode;
    }

    /// Bytes of the axis in an update of either direction, beside its service.
    pub fn lens(&self) -> (usize, usize) {
        let command = self.setup.sets.command_len() + self.lists.command_len();
        let actual = self.setup.sets.actual_len(self.setup.feedback_mode) + self.lists.actual_len();
        if self.events.is_open() {
            // The device keeps notifications back for which there is no room.
            return (command + COMMAND_EVENTS_MAX, actual + ACTUAL_EVENTS_BARE);
        }
        (command, actual)
    }

    /// Takes the axis' block of a D-to-C update.
    pub fn handle(&mut self, block: &ActualBlock, time: UpdateTime, mut event: impl FnMut(Event)) {
        self.handshake.handle(block.axis_response, block.response_status);
        self.advance_reference();
        self.seen.handle(block, &mut self.report, &mut event);
        if !self.has_position() {
            // A position that is no longer told is nowhere to go on from.
            return;
        }
        let Some(position) = self.seen.handle_position(&block.actual, self.setup.unwind, time.at) else {
            return;
        };
        let units = float(position) / self.scale();
        self.report.actual = Some(units);
        if !self.is_running() {
            return;
        }
        self.report.reached = Some(units);
        if let Some(command) = self.following.command_at(time.at, time.ahead) {
            let error = (command - float(position)).abs() / self.scale();
            self.report.following_error_max = self.report.following_error_max.max(error);
            self.report.following_samples += 1;
        }
    }

    /// Takes a fault record that was read beside the updates.
    pub fn handle_fault(&mut self, fault: FaultRecord, mut event: impl FnMut(Event)) {
        let status = StatusValues { fault: Some(fault), ..StatusValues::default() };
        self.seen.handle_records(&status, &mut self.report, &mut event);
    }

    /// The cyclic command block for the command planned last.
    pub fn block(&self, configured: bool, target: CommandTarget, spoil: &Spoil) -> CommandBlock {
        let sets = &self.setup.sets;
        let in_units = |counts: f64| real(counts / self.scale());
        let omitted = spoil.omit.contains(self.instance());
        // The value of the Control Mode goes always, the others as the data set has them.
        let sent = |bit: CommandDataSet, mode: ControlMode| {
            if self.mode == mode { !omitted } else { sets.command.contains(bit) }
        };
        let mut control_status = ControlStatus::empty();
        control_status.set(ControlStatus::CONFIGURATION_COMPLETE, configured);
        let displacement = self.displacement();
        let zero = |bit: CommandDataSet| sets.command.contains(bit).then_some(0);
        let (position, cycles) = self.command_position();
        CommandBlock {
            control_mode: match spoil.wrong_mode {
                Some((axes, mode)) if axes.contains(self.instance()) => ControlMode(mode),
                _ => self.mode,
            },
            feedback_mode: self.setup.feedback_mode,
            axis_control: self.handshake.code(),
            control_status,
            actual_data_set: self.asked(),
            status_data_set: if self.fixed {
                StatusDataSet::empty()
            } else {
                sets.status | StatusDataSet::FAULT | StatusDataSet::AXIS_STATUS
            },
            target,
            // One value alone: a standing axis, of which the references are changed, needs no other.
            values: if self.fixed && displacement.is_some() {
                CommandValues { position_displacement: displacement, ..CommandValues::default() }
            } else {
                CommandValues {
                    position: sent(CommandDataSet::POSITION, ControlMode::POSITION).then_some(position),
                    velocity: sent(CommandDataSet::VELOCITY, ControlMode::VELOCITY)
                        .then(|| in_units(self.command.velocity)),
                    acceleration: sent(CommandDataSet::ACCELERATION, ControlMode::ACCELERATION)
                        .then(|| in_units(self.command.acceleration)),
                    torque: sent(CommandDataSet::TORQUE, ControlMode::TORQUE).then(|| real(self.torque)),
                    unwind_count: zero(CommandDataSet::UNWIND_COUNT).map(|_| cycles),
                    position_displacement: displacement.or(zero(CommandDataSet::POSITION_DISPLACEMENT)),
                }
            },
        }
    }

    /// Command Position, and the cycle of an axis that the device unwinds.
    fn command_position(&self) -> (CommandPosition, i32) {
        let whole = self.setup.sets.integer_position;
        let position = if whole { float(counts(self.command.position)) } else { self.command.position };
        let (position, cycles) = self.setup.unwind.map_or((position, 0), |unwind| fold(position, unwind));
        if whole {
            (CommandPosition::Integer(roll(counts(position))), cycles)
        } else {
            (CommandPosition::Float(position), cycles)
        }
    }
}
