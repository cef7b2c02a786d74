//! One axis of a CIP Motion drive: the state model, the fixed connection blocks and a simple mechanism.

mod blocks;
mod control;

use std::collections::BTreeMap;

use super::settings::{Lasts, Settings};

/// Waits for the connection and its configuration.
pub const INITIALIZING: u8 = 0;
/// Waits for the bus.
pub const PRE_CHARGE: u8 = 1;
/// At rest.
pub const STOPPED: u8 = 2;
/// Gets power.
pub const STARTING: u8 = 3;
/// Follows the command.
pub const RUNNING: u8 = 4;
/// Comes to rest.
pub const STOPPING: u8 = 6;
/// Comes to rest because of a fault.
pub const ABORTING: u8 = 7;
/// Has a fault.
pub const MAJOR_FAULTED: u8 = 8;
/// Shut down.
pub const SHUTDOWN: u8 = 10;

const POSITION_MODE: u8 = 1;
const VELOCITY_MODE: u8 = 2;
const ACCELERATION_MODE: u8 = 3;
const TORQUE_MODE: u8 = 4;

const UPDATE_FAULT: u8 = 1;
const DATA_FORMAT_ERROR: u8 = 4;
const CONNECTION_LOSS: u8 = 6;

const EXCESSIVE_POSITION_ERROR: u16 = 54;
const ILLEGAL_CONTROL_MODE: u16 = 60;
const CONTROLLER_EXCEPTION: u16 = 62;

/// The axis cannot do this now.
const STATE_CONFLICT: u8 = 0x0C;
/// There is no such request.
const BAD_VALUE: u8 = 0x09;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fault {
    code: u16,
    since_us: u64,
    one_poll: bool,
}

/// The axis and the communication node.
#[derive(Debug, Clone)]
pub struct MotionDrive {
    pub(super) now_us: u64,
    pub(super) state: u8,
    since_us: u64,
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) torque: f64,
    pub(super) mode: u8,
    pub(super) feedback_mode: u8,
    pub(super) command_position: f64,
    command_velocity: f64,
    command_acceleration: f64,
    command_torque: f64,
    displacement: i32,
    request: u8,
    response: u8,
    response_status: u8,
    working_on: u8,
    pub(super) node_control: u8,
    pub(super) node_fault: u8,
    fault: Option<Fault>,
    reset_source: u8,
    cause: Option<u16>,
    shutdown: bool,
    holding: bool,
    bus_up: bool,
    actual_set: u8,
    status_set: u8,
    told: BTreeMap<u8, Vec<u8>>,
    polls: u32,
    update_id: u8,
    last_update: Option<u8>,
    pub(super) configured: bool,
    pub(super) values: BTreeMap<u16, Vec<u8>>,
    pub(super) class_values: BTreeMap<u16, Vec<u8>>,
}

fn real(data: &[u8], at: usize) -> Option<f64> {
    let bytes: [u8; 4] = data.get(at..at + 4)?.try_into().ok()?;
    let value = f64::from(f32::from_le_bytes(bytes));
    Some(if value.is_finite() { value } else { 0.0 })
}

fn dint(data: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(data.get(at..at + 4)?.try_into().ok()?))
}

/// The bytes of a REAL.
#[must_use]
pub fn real_bytes(value: f64) -> [u8; 4] {
    #[expect(clippy::cast_possible_truncation, reason = "a REAL has no more digits")]
    let short = value as f32;
    short.to_le_bytes()
}

/// The bytes of a DINT that counts on after its highest value.
#[must_use]
pub fn dint_bytes(value: f64) -> [u8; 4] {
    #[expect(clippy::cast_possible_truncation, reason = "64 bits hold every position the axis reaches")]
    let whole = value.round() as i64;
    let [a, b, c, d, ..] = whole.to_le_bytes();
    [a, b, c, d]
}

impl MotionDrive {
    /// A drive that has just got power.
    #[must_use]
    pub fn new(_settings: &Settings, now_us: u64) -> Self {
        Self {
            now_us,
            state: INITIALIZING,
            since_us: now_us,
            position: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            torque: 0.0,
            mode: 0,
            feedback_mode: 0,
            command_position: 0.0,
            command_velocity: 0.0,
            command_acceleration: 0.0,
            command_torque: 0.0,
            displacement: 0,
            request: 0,
            response: 0,
            response_status: 0,
            working_on: 0,
            node_control: 0,
            node_fault: 0,
            fault: None,
            reset_source: 1,
            cause: None,
            shutdown: false,
            holding: false,
            bus_up: false,
            actual_set: 0,
            status_set: 0,
            told: BTreeMap::new(),
            polls: 0,
            update_id: 0,
            last_update: None,
            configured: false,
            values: BTreeMap::new(),
            class_values: BTreeMap::new(),
        }
    }

    /// Axis State.
    #[must_use]
    pub fn state(&self) -> u8 {
        self.state
    }

    /// Feedback counts.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.position
    }

    /// Units per second.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.velocity
    }

    /// Whether there is a fault.
    #[must_use]
    pub fn faulted(&self) -> bool {
        matches!(self.state, ABORTING | MAJOR_FAULTED)
    }

    /// Whether the power structure is enabled.
    #[must_use]
    pub fn enabled(&self) -> bool {
        match self.state {
            STARTING | RUNNING => true,
            STOPPING | ABORTING => self.stopping_action() != 0,
            STOPPED => self.holding,
            _ => false,
        }
    }

    fn enter(&mut self, state: u8) {
        if self.state != state {
            self.state = state;
            self.since_us = self.now_us;
            self.holding = state == STOPPED && self.holding;
        }
    }

    fn byte(&self, attribute: u16) -> u8 {
        self.values.get(&attribute).and_then(|bytes| bytes.first().copied()).unwrap_or(0)
    }

    fn positive(&self, attribute: u16, otherwise: f64) -> f64 {
        let set = self.values.get(&attribute).and_then(|bytes| real(bytes, 0));
        set.filter(|value| *value > 0.0).unwrap_or(otherwise)
    }

    fn stopping_action(&self) -> u8 {
        self.byte(610)
    }

    /// Feedback counts per unit.
    #[must_use]
    pub fn counts(&self, settings: &Settings) -> f64 {
        let number = |attribute| {
            let set =
                self.values.get(&attribute).and_then(|bytes| <[u8; 4]>::try_from(bytes.as_slice()).ok());
            set.map_or(0, u32::from_le_bytes)
        };
        let product = f64::from(number(1416)) * f64::from(number(1417));
        if product > 0.0 { product } else { f64::from(settings.counts_per_unit.max(1)) }
    }

    /// Fault type, code, sub code and action, as the fault log tells them.
    #[must_use]
    pub fn fault_record(&self) -> [u8; 4] {
        match self.fault {
            Some(fault) => [3, u8::try_from(fault.code).unwrap_or(0xFF), 0, 0x22],
            None => [0, self.reset_source, 0, 0],
        }
    }

    /// Axis Faults.
    #[must_use]
    pub fn faults(&self) -> u64 {
        self.fault.map_or(0, |fault| 1_u64.checked_shl(u32::from(fault.code)).unwrap_or(0))
    }

    /// Axis Status.
    #[must_use]
    pub fn status(&self) -> u32 {
        let bit = |at: u32, on: bool| u32::from(on) << at;
        let powered = self.enabled();
        bit(0, self.node_control & 1 == 0)
            | bit(2, self.bus_up)
            | bit(3, powered)
            | bit(5, self.state == RUNNING)
            | bit(6, self.state == RUNNING && (self.command_position - self.position).abs() < 1.0)
            | bit(8, self.state != INITIALIZING && self.stands())
            | bit(17, true)
            | bit(18, self.shutdown)
            | bit(22, powered && self.mode == POSITION_MODE)
            | bit(23, powered && self.mode == VELOCITY_MODE)
            | bit(24, powered && self.mode == TORQUE_MODE)
    }

    /// Node Status.
    #[must_use]
    pub fn node_status(&self) -> u8 {
        (self.node_control & 0x05) | (u8::from(self.node_fault != 0) << 3)
    }

    fn stands(&self) -> bool {
        self.velocity.abs() < self.positive(472, 0.01)
    }

    fn finish(&mut self, request: u8, status: u8) {
        if self.working_on == request {
            self.working_on = 0;
            if self.request == request {
                (self.response, self.response_status) = (request, status);
            }
        }
    }

    fn trip(&mut self, code: u16, one_poll: bool) {
        if self.fault.is_none() {
            self.fault = Some(Fault { code, since_us: self.now_us, one_poll });
        }
        self.fall();
    }

    /// Goes the way of a major fault.
    fn fall(&mut self) {
        match self.state {
            STARTING | RUNNING | STOPPING => self.enter(ABORTING),
            ABORTING => {}
            _ => self.enter(MAJOR_FAULTED),
        }
        self.finish(1, STATE_CONFLICT);
    }

    /// Where the axis belongs when nothing is wrong any more.
    fn recover(&mut self) {
        if self.node_fault != 0 {
            return;
        }
        if let Some(code) = self.cause {
            self.trip(code, false);
            return;
        }
        if self.state == MAJOR_FAULTED {
            let ready = if self.bus_up { STOPPED } else { PRE_CHARGE };
            self.enter(if self.shutdown { SHUTDOWN } else { ready });
        }
    }

    /// Makes a fault whose cause stays.
    pub fn fail(&mut self, code: u16) {
        self.cause = Some(code);
        self.trip(code, false);
    }

    /// Takes the cause away.
    pub fn mend(&mut self) {
        self.cause = None;
    }

    /// The connection is allocated: everything is as after power-on, but where the axis stands.
    pub fn opened(&mut self, settings: &Settings) {
        let mut fresh = Self::new(settings, self.now_us);
        fresh.position = self.position;
        fresh.cause = self.cause;
        fresh.polls = self.polls;
        fresh.reset_source = 4;
        *self = fresh;
    }

    /// The connection is released.
    pub fn closed(&mut self, settings: &Settings) {
        self.opened(settings);
    }

    /// The connection has timed out.
    pub fn lost(&mut self) {
        self.node_fault = CONNECTION_LOSS;
        self.fall();
    }

    /// Counts a poll; a planned fault may come with it.
    pub fn polled(&mut self, settings: &Settings) {
        self.polls = self.polls.saturating_add(1);
        if let Some(plan) = settings.fault.filter(|plan| plan.poll == self.polls) {
            if plan.lasts == Lasts::ForGood {
                self.cause = Some(plan.code);
            }
            self.trip(plan.code, plan.lasts == Lasts::OnePoll);
        }
    }

    /// Lets `seconds` pass up to now.
    pub fn advance(&mut self, settings: &Settings, now_us: u64, seconds: f64) {
        self.now_us = now_us;
        let before = self.velocity;
        let counts = self.counts(settings);
        let top = self.positive(473, settings.top_speed);
        let mut moved = None;
        match self.state {
            RUNNING => match self.mode {
                POSITION_MODE => {
                    let error = (self.command_position - self.position) / counts;
                    let step = (error * (seconds * 200.0).min(1.0)).clamp(-top * seconds, top * seconds);
                    moved = Some(step);
                    if seconds > 0.0 {
                        self.velocity = step / seconds;
                    }
                    let tolerance = self.positive(444, f64::INFINITY);
                    if (error * counts).abs() > tolerance {
                        self.trip(EXCESSIVE_POSITION_ERROR, false);
                    }
                }
                VELOCITY_MODE => {
                    let up = self.positive(376, settings.acceleration);
                    let down = self.positive(377, settings.acceleration);
                    let goal = self.command_velocity.clamp(-top, top);
                    let slower = goal.abs() < self.velocity.abs();
                    self.ramp(goal, if slower { down } else { up } * seconds);
                }
                ACCELERATION_MODE => {
                    self.velocity = (self.velocity + self.command_acceleration * seconds).clamp(-top, top);
                }
                TORQUE_MODE => {
                    let up = self.positive(504, f64::INFINITY);
                    self.torque = self.command_torque.clamp(-up, up);
                    let push = settings.acceleration * self.torque / 100.0;
                    self.velocity = (self.velocity + push * seconds).clamp(-top, top);
                }
                _ => self.velocity = 0.0,
            },
            STOPPING | ABORTING => {
                let coasts = self.stopping_action() == 0;
                let slope = if coasts { settings.acceleration / 5.0 } else { settings.acceleration };
                self.ramp(0.0, slope * seconds);
            }
            _ => self.velocity = 0.0,
        }
        self.position += moved.unwrap_or(self.velocity * seconds) * counts;
        if seconds > 0.0 {
            self.acceleration = (self.velocity - before) / seconds;
        }
        if self.mode != TORQUE_MODE || self.state != RUNNING {
            self.torque = 100.0 * self.acceleration / settings.acceleration.max(1e-9);
        }
        self.step(settings);
    }

    fn ramp(&mut self, goal: f64, step: f64) {
        let gap = goal - self.velocity;
        self.velocity = if gap.abs() <= step { goal } else { self.velocity + step.copysign(gap) };
    }

    /// The transitions that time brings.
    fn step(&mut self, settings: &Settings) {
        let passed_ms = (self.now_us - self.since_us) / 1000;
        match self.state {
            PRE_CHARGE if passed_ms >= u64::from(settings.precharge_ms) => {
                self.bus_up = true;
                self.enter(STOPPED);
            }
            STARTING if passed_ms >= u64::from(settings.starting_ms) => {
                self.enter(RUNNING);
                self.finish(1, 0);
            }
            STOPPING if self.stands() => {
                self.velocity = 0.0;
                self.holding = !self.shutdown && matches!(self.stopping_action(), 3 | 4);
                let held = self.holding;
                self.enter(if self.shutdown { SHUTDOWN } else { STOPPED });
                self.holding = held;
                self.finish(2, 0);
                self.finish(3, 0);
            }
            ABORTING if self.stands() => {
                self.velocity = 0.0;
                self.enter(MAJOR_FAULTED);
                self.finish(2, 0);
                self.finish(3, 0);
            }
            _ => {}
        }
    }
}
