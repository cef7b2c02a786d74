//! One axis as the controller sees it: what the device says of it, and the command stream to it.
//!
//! Commands are planned for an instant of the controller's own clock, the command target time, so that an
//! update that is sent late or lost leaves the path as it is. Whenever the axis is not Running the command
//! stands at the actual position; a motion begins there, and the control mode changes only at standstill.
//! So no command jumps.
//!
//! Motion is planned in counts. On the connection positions are in counts, the position control unit, while
//! velocity and acceleration are in units, the velocity and acceleration control unit (Table 5-2.8).

use super::config::AxisSetup;
use super::event::Event;
use super::events::EventChecks;
use super::failure::Failure;
use super::following::Following;
use super::handshake::Handshake;
use super::number::{counts, float, real, roll, seconds, unroll};
use super::report::AxisReport;
use super::trajectory::{Limits, Profile, ProfileError, State};
use crate::wire::motion::codes::{
    ActualDataSet, AxisStateCode, AxisStatus, CommandTarget, ControlMode, ControlStatus, FaultType,
    StatusDataSet,
};
use crate::wire::motion::{
    ActualBlock, ActualPosition, CommandBlock, CommandPosition, CommandValues, FaultRecord,
};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// Updates without movement that end a jog.
const SETTLED_UPDATES: u8 = 8;
/// Parts of a unit by which a standing axis may still move between two updates.
const STANDSTILL_PARTS: f64 = 1e4;
/// Longest wait for standstill after a jog, beyond which position control takes over anyway.
const SETTLING_MAX: DurationNs = DurationNs::from_secs(1);

/// The motion under way.
#[expect(clippy::large_enum_variant, reason = "one per axis, and a box would be allocated in the cycle")]
#[derive(Debug, Clone)]
enum Motion {
    /// The command stands.
    None,
    /// The command follows a profile that began at `start`; profile and limits are in counts.
    Moving { profile: Profile, start: MonotonicTime, limits: Limits },
    /// Velocity control at zero until the axis stands.
    Settling { since: MonotonicTime, last: i64, still: u8 },
}

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
    setup: AxisSetup,
    state: Option<AxisStateCode>,
    status: Option<AxisStatus>,
    fault: Option<FaultRecord>,
    last_records: (Option<FaultRecord>, Option<crate::wire::motion::AlarmRecord>),
    actual: Option<i64>,
    mode: ControlMode,
    motion: Motion,
    /// In counts.
    command: State,
    planned_for: MonotonicTime,
    following: Following,
}

impl Axis {
    pub fn new(instance: u8, setup: AxisSetup) -> Self {
        Self {
            handshake: Handshake::default(),
            events: EventChecks::default(),
            report: AxisReport { axis: instance, ..AxisReport::default() },
            state: None,
            status: None,
            fault: None,
            last_records: (None, None),
            actual: None,
            mode: setup.control_mode,
            motion: Motion::None,
            command: State::default(),
            planned_for: MonotonicTime::ZERO,
            following: Following::default(),
            setup,
        }
    }

    pub const fn instance(&self) -> u8 {
        self.report.axis
    }

    pub const fn state(&self) -> Option<AxisStateCode> {
        self.state
    }

    /// The fault that has not been reset yet.
    pub const fn fault(&self) -> Option<FaultRecord> {
        self.fault
    }

    /// Whether the device follows the command.
    pub fn is_running(&self) -> bool {
        let tracking = self.status.is_none_or(|s| s.contains(AxisStatus::TRACKING_COMMAND));
        self.state == Some(AxisStateCode::RUNNING) && tracking && self.actual.is_some()
    }

    /// Whether a motion is under way.
    pub const fn is_moving(&self) -> bool {
        !matches!(self.motion, Motion::None)
    }

    /// Distance between command and actual position, in units.
    pub fn distance(&self) -> Option<f64> {
        self.actual.map(|actual| (self.command.position - float(actual)).abs() / self.setup.counts_per_unit)
    }

    /// The commanded position in units.
    pub fn commanded(&self) -> f64 {
        self.command.position / self.setup.counts_per_unit
    }

    /// Takes the axis' block of a D-to-C update.
    pub fn handle(&mut self, block: &ActualBlock, time: UpdateTime, mut event: impl FnMut(Event)) {
        let axis = self.instance();
        self.handshake.handle(block.axis_response, block.response_status);
        if self.state != Some(block.axis_state) {
            event(Event::AxisState { axis, from: self.state, to: block.axis_state });
            self.report.states.push(block.axis_state);
            self.report.state = Some(block.axis_state);
            self.state = Some(block.axis_state);
        }
        if let Some((status, _)) = block.status.axis_status {
            self.status = Some(status);
        }
        self.handle_records(block, &mut event);
        self.handle_position(block.actual.position, time);
    }

    /// A record stays in the updates until the device has seen that it arrived; it counts once.
    fn handle_records(&mut self, block: &ActualBlock, event: &mut impl FnMut(Event)) {
        let axis = self.instance();
        if let Some(fault) = block.status.fault
            && self.last_records.0.replace(fault) != Some(fault)
        {
            event(Event::AxisFault { axis, fault });
            let cleared = fault.fault_type == FaultType::CLEARED;
            self.fault = (!cleared).then_some(fault);
            if !cleared {
                self.report.faults.push(fault);
            }
        }
        if let Some(alarm) = block.status.alarm
            && self.last_records.1.replace(alarm) != Some(alarm)
        {
            event(Event::AxisAlarm { axis, alarm });
            self.report.alarms.push(alarm);
        }
    }

    fn handle_position(&mut self, position: Option<ActualPosition>, time: UpdateTime) {
        let position = match position {
            Some(ActualPosition::Dint(raw)) => self.actual.map_or(i64::from(raw), |near| unroll(near, raw)),
            Some(ActualPosition::Lint(position)) => position,
            None => return,
        };
        self.actual = Some(position);
        let units = float(position) / self.setup.counts_per_unit;
        self.report.actual = Some(units);
        if !self.is_running() {
            return;
        }
        self.report.reached = Some(units);
        if let Some(command) = self.following.command_at(time.at, time.ahead) {
            let error = (command - float(position)).abs() / self.setup.counts_per_unit;
            self.report.following_error_max = self.report.following_error_max.max(error);
            self.report.following_samples += 1;
        }
    }

    /// Plans the command for `target`; `applies_at` is the same instant in system time.
    pub fn plan(&mut self, target: MonotonicTime, applies_at: SystemTime) {
        self.planned_for = target;
        let Some(actual) = self.actual else { return };
        if !self.is_running() {
            self.motion = Motion::None;
            self.mode = self.setup.control_mode;
            self.command = State::at_rest(float(self.rebased(actual)));
            self.following.clear();
            return;
        }
        self.advance(target, actual);
        if self.mode == ControlMode::POSITION {
            self.report.commanded = Some(self.commanded());
            self.following.push(applies_at, self.command);
        } else {
            self.following.clear();
        }
    }

    fn advance(&mut self, target: MonotonicTime, actual: i64) {
        match &mut self.motion {
            Motion::None if self.mode == ControlMode::POSITION => {}
            Motion::None => self.command = State::at_rest(float(actual)),
            Motion::Moving { profile, start, .. } => {
                let elapsed = seconds(target - *start);
                self.command = profile.sample(elapsed);
                if elapsed >= profile.seconds() {
                    self.command = profile.end();
                    let jogged = self.mode != self.setup.control_mode;
                    self.motion = if jogged {
                        Motion::Settling { since: target, last: actual, still: 0 }
                    } else {
                        Motion::None
                    };
                }
            }
            Motion::Settling { since, last, still } => {
                let moved = float((actual - *last).abs());
                let stands = moved <= (self.setup.counts_per_unit / STANDSTILL_PARTS).max(1.0);
                *still = if stands { *still + 1 } else { 0 };
                *last = actual;
                let settled = *still >= SETTLED_UPDATES || target - *since > SETTLING_MAX;
                if settled {
                    self.motion = Motion::None;
                    self.mode = self.setup.control_mode;
                }
                self.command = State::at_rest(float(if settled { self.rebased(actual) } else { actual }));
            }
        }
    }

    /// Command Position has 32 bits: a position beyond them, after endless turning, is counted anew from
    /// what the device gives.
    fn rebased(&mut self, actual: i64) -> i64 {
        if i32::try_from(actual).is_ok() {
            return actual;
        }
        let rolled = i64::from(roll(actual));
        self.actual = Some(rolled);
        rolled
    }

    /// The cyclic command block for the command planned last.
    pub fn block(&self, configured: bool, target: CommandTarget) -> CommandBlock {
        let in_units = |counts: f64| Some(real(counts / self.setup.counts_per_unit));
        let velocity = in_units(self.command.velocity);
        let position_control = self.mode == ControlMode::POSITION;
        let mut actual_data_set = ActualDataSet::POSITION;
        actual_data_set.set(ActualDataSet::VELOCITY, self.setup.actual_velocity);
        let mut control_status = ControlStatus::empty();
        control_status.set(ControlStatus::CONFIGURATION_COMPLETE, configured);
        CommandBlock {
            control_mode: self.mode,
            feedback_mode: self.setup.feedback_mode,
            axis_control: self.handshake.code(),
            control_status,
            actual_data_set,
            status_data_set: StatusDataSet::FAULT | StatusDataSet::ALARM | StatusDataSet::AXIS_STATUS,
            target,
            values: CommandValues {
                position: position_control.then(|| self.command_position()),
                velocity: velocity.filter(|_| !position_control || self.setup.velocity_feed_forward),
                acceleration: in_units(self.command.acceleration)
                    .filter(|_| self.setup.acceleration_feed_forward),
                ..CommandValues::default()
            },
        }
    }

    fn command_position(&self) -> CommandPosition {
        if self.setup.integer_position {
            CommandPosition::Integer(roll(counts(self.command.position)))
        } else {
            CommandPosition::Float(self.command.position)
        }
    }

    /// Begins a motion from rest to `units`; returns its planned length.
    pub fn move_to(&mut self, units: f64, limits: Limits) -> Result<DurationNs, Failure> {
        let axis = self.instance();
        self.ready_for_motion()?;
        if self.mode != ControlMode::POSITION {
            return Err(Failure::WrongMode { axis });
        }
        let target = units * self.setup.counts_per_unit;
        if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&target) {
            return Err(Failure::OutOfRange { axis, counts: target });
        }
        let limits = limits.scaled(self.setup.counts_per_unit);
        let profile = Profile::to_position(self.command.position, target, limits);
        self.begin(profile, limits)
    }

    /// Begins a jog at `velocity` in units/s for `run` seconds; returns its planned length.
    pub fn jog(&mut self, velocity: f64, run: f64, limits: Limits) -> Result<DurationNs, Failure> {
        self.ready_for_motion()?;
        let scale = self.setup.counts_per_unit;
        let limits = limits.scaled(scale);
        let profile = Profile::jog(State::at_rest(self.command.position), velocity * scale, run, limits);
        let length = self.begin(profile, limits)?;
        self.mode = ControlMode::VELOCITY;
        let settling =
            if self.setup.control_mode == ControlMode::VELOCITY { DurationNs::ZERO } else { SETTLING_MAX };
        Ok(length + settling)
    }

    /// Ends the motion under way; without one nothing happens. Without limits those of the motion count.
    pub fn stop(&mut self, limits: Option<Limits>) -> Result<DurationNs, Failure> {
        let Motion::Moving { limits: present, .. } = &self.motion else { return Ok(SETTLING_MAX) };
        let limits = limits.map_or(*present, |l| l.scaled(self.setup.counts_per_unit));
        let profile = Profile::to_velocity(self.command, 0.0, limits);
        Ok(self.begin(profile, limits)? + SETTLING_MAX)
    }

    fn ready_for_motion(&self) -> Result<(), Failure> {
        let axis = self.instance();
        if !self.is_running() {
            return Err(Failure::AxisNotRunning { axis, state: self.state, fault: self.fault });
        }
        if self.is_moving() { Err(Failure::AxisBusy { axis }) } else { Ok(()) }
    }

    /// The profile continues the command planned last.
    fn begin(
        &mut self,
        profile: Result<Profile, ProfileError>,
        limits: Limits,
    ) -> Result<DurationNs, Failure> {
        let profile = profile.map_err(|error| Failure::Profile { axis: self.instance(), error })?;
        let length = super::number::span(profile.seconds());
        self.motion = Motion::Moving { profile, start: self.planned_for, limits };
        Ok(length)
    }
}
