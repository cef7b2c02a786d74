//! The power state machine, its controlword and statusword, and faults.

use super::axis::{Axis, Effort, MICRO, rounded, toward};
use super::dictionary::{Dictionary, abort, word};
use super::modes::Modes;
use super::settings::{CyclicBit, RemoteBit, SafetyReaction, Settings, VoltageBit};

/// The states of CiA 402.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Not ready to switch on.
    NotReady,
    /// Switch on disabled.
    SwitchOnDisabled,
    /// Ready to switch on.
    ReadyToSwitchOn,
    /// Switched on.
    SwitchedOn,
    /// Operation enabled.
    OperationEnabled,
    /// Quick stop active.
    QuickStopActive,
    /// Fault reaction active.
    FaultReaction,
    /// Fault.
    Fault,
}

/// A state that comes after a time, and after the axis stands if there is a ramp.
#[derive(Debug, Clone, Copy)]
struct Pending {
    to: State,
    due: u64,
    ramp: Option<i128>,
}

/// The drive behind the communication.
#[derive(Debug, Clone)]
pub struct Motion {
    /// The state.
    pub state: State,
    /// The axis.
    pub axis: Axis,
    /// What the modes keep.
    pub modes: Modes,
    /// Error codes to tell; 0 for "no error".
    pub emergencies: Vec<u16>,
    /// What happened, for the log.
    pub notes: Vec<String>,
    /// The last error code.
    pub code: u16,
    /// The mains are there.
    pub mains: bool,
    /// The safety input cuts the torque.
    pub safe: bool,
    /// The node is operational.
    pub operational: bool,
    /// The last controlword taken.
    pub word: u16,
    /// When the drive was enabled.
    pub enabled_at: u64,
    cause: bool,
    failed_at: u64,
    word_at: Option<u64>,
    pending: Option<Pending>,
    entered: u64,
    started: u64,
    released: bool,
    ramp_vel: i128,
    last: u64,
    now: u64,
}

impl Motion {
    /// A drive that has just got power.
    #[must_use]
    pub fn new(s: &Settings, now: u64) -> Self {
        Self {
            state: State::NotReady,
            axis: Axis { pos: i128::from(s.start_position) * MICRO, ..Axis::default() },
            modes: Modes::new(s),
            emergencies: Vec::new(),
            notes: Vec::new(),
            code: 0,
            mains: true,
            safe: false,
            operational: false,
            word: 0,
            enabled_at: 0,
            cause: false,
            failed_at: 0,
            word_at: None,
            pending: None,
            entered: now,
            started: now,
            released: false,
            ramp_vel: 0,
            last: now,
            now,
        }
    }

    /// Whether the stage controls the motor.
    #[must_use]
    pub fn enabled(&self) -> bool {
        matches!(self.state, State::OperationEnabled | State::QuickStopActive | State::FaultReaction)
    }

    /// Whether the axis is being stopped on the way out of "operation enabled".
    #[must_use]
    pub fn leaving(&self) -> bool {
        self.pending.is_some_and(|pending| pending.ramp.is_some())
    }

    fn enter(&mut self, state: State, od: &mut Dictionary, s: &Settings) {
        self.notes.push(format!("{:?} -> {state:?}", self.state));
        let was = self.enabled();
        self.state = state;
        self.entered = self.now;
        self.pending = None;
        self.ramp_vel = self.axis.vel;
        if state == State::OperationEnabled {
            self.enabled_at = self.now;
            if s.clears_targets {
                for index in [0x60FF, 0x6071, 0x6042] {
                    od.set(index, 0, 0);
                }
            }
            self.modes.start(&self.axis);
            let cyclic = matches!(self.modes.mode, 7..=10);
            if cyclic && s.sync_needs_period && self.modes.period_us(od) != od.int(0x1006, 0) {
                self.fail(0x8700, od, s);
            }
        } else if !was || !self.enabled() {
            self.modes.stop();
        }
    }

    fn go(&mut self, to: State, ramp: Option<i128>, od: &mut Dictionary, s: &Settings) {
        let extra = if to == State::OperationEnabled { s.enable_ms } else { 0 };
        let wait = (s.transition_ms + extra) * 1000;
        if wait == 0 && ramp.is_none() {
            self.enter(to, od, s);
        } else {
            self.ramp_vel = self.axis.vel;
            self.pending = Some(Pending { to, due: self.now + wait, ramp });
        }
    }

    /// A fault. The drive reacts as 605E says.
    pub fn fail(&mut self, code: u16, od: &mut Dictionary, s: &Settings) {
        self.cause = true;
        if matches!(self.state, State::Fault | State::FaultReaction) {
            return;
        }
        self.code = code;
        self.failed_at = self.now;
        self.emergencies.push(code);
        self.notes.push(format!("fault {code:04X}"));
        let ramps = self.enabled() && od.int_or(0x605E, 0, 2) != 0;
        self.enter(if ramps { State::FaultReaction } else { State::Fault }, od, s);
    }

    /// The cause of the fault has gone.
    pub fn mend(&mut self) {
        self.cause = false;
    }

    /// The safety input changed.
    pub fn set_safe(&mut self, on: bool, od: &mut Dictionary, s: &Settings) {
        self.safe = on;
        if !on {
            return;
        }
        match s.safety {
            SafetyReaction::Fault(code) => self.fail(code, od, s),
            SafetyReaction::SwitchedOn if self.enabled() => self.enter(State::SwitchedOn, od, s),
            SafetyReaction::SwitchOnDisabled
                if !matches!(self.state, State::NotReady | State::Fault | State::FaultReaction) =>
            {
                self.enter(State::SwitchOnDisabled, od, s);
            }
            _ => {}
        }
    }

    /// What 6007 says when the master is gone or the node stops.
    pub fn connection_lost(&mut self, od: &mut Dictionary, s: &Settings) {
        if self.state != State::OperationEnabled {
            return;
        }
        match od.int(0x6007, 0) {
            1 => self.fail(0x8130, od, s),
            2 => self.go(State::SwitchOnDisabled, None, od, s),
            3 => self.quick_stop(od, s),
            _ => {}
        }
    }

    /// An object was written that releases "not ready".
    pub fn released(&mut self) {
        self.released = true;
    }

    fn quick_stop(&mut self, od: &mut Dictionary, s: &Settings) {
        let to = if od.int_or(0x605A, 0, 2) == 0 { State::SwitchOnDisabled } else { State::QuickStopActive };
        self.go(to, None, od, s);
    }

    /// A controlword came.
    pub fn control(&mut self, value: u16, od: &mut Dictionary, s: &Settings) {
        if self.word_at.is_some_and(|at| self.now.saturating_sub(at) < s.control_gap_us) {
            self.notes.push(format!("controlword {value:04X} missed"));
            return;
        }
        self.word_at = Some(self.now);
        let before = self.word;
        // In remote control only quick stop, fault reset and halt get through.
        self.word = if s.remote_obeys { value } else { (before & !0x0184) | (value & 0x0184) };
        let edge = self.word & 0x80 != 0 && before & 0x80 == 0;
        if self.state == State::Fault && (edge || (s.reset_by_level && self.word & 0x80 != 0)) {
            self.reset_fault(od, s);
        }
        self.modes.control(before, self.word, &self.axis, self.state == State::OperationEnabled, od, s);
        self.follow_word(od, s);
    }

    fn reset_fault(&mut self, od: &mut Dictionary, s: &Settings) {
        let early = self.now - self.failed_at < s.reset_blocked_ms * 1000;
        if early || (s.reset_needs_mend && self.cause) {
            self.notes.push("fault reset refused".into());
            return;
        }
        self.cause = false;
        if !s.keeps_error_code {
            self.code = 0;
        }
        self.emergencies.push(0);
        self.go(State::SwitchOnDisabled, None, od, s);
    }

    /// Does what the controlword says until the state stays.
    fn follow_word(&mut self, od: &mut Dictionary, s: &Settings) {
        for _ in 0..4 {
            if self.pending.is_some() {
                return;
            }
            let before = self.state;
            self.one_step(od, s);
            if self.state == before {
                return;
            }
        }
    }

    fn one_step(&mut self, od: &mut Dictionary, s: &Settings) {
        let w = self.word;
        let shutdown = w & 0x87 == 0x06;
        let switch_on = w & 0x8F == 0x07;
        let enable = w & 0x8F == 0x0F;
        let off = w & 0x82 == 0x00;
        let stop = w & 0x86 == 0x02;
        let deceleration = |index| Modes::acceleration(od, index, s);
        let target = match self.state {
            State::SwitchOnDisabled if shutdown && !self.blocks_switch_on(s) => {
                (State::ReadyToSwitchOn, None)
            }
            State::ReadyToSwitchOn if off || stop => (State::SwitchOnDisabled, None),
            State::ReadyToSwitchOn if switch_on || (enable && s.switch_on_and_enable) => {
                if s.needs_mains && !self.mains && s.mains_wait_ms.is_none() {
                    return;
                }
                (State::SwitchedOn, None)
            }
            State::SwitchedOn if off || stop => (State::SwitchOnDisabled, None),
            State::SwitchedOn if shutdown => (State::ReadyToSwitchOn, None),
            State::SwitchedOn if enable => {
                let no_mode = s.enable_needs_mode && od.int(0x6060, 0) == 0;
                if self.safe || no_mode || (s.needs_mains && !self.mains) {
                    return;
                }
                (State::OperationEnabled, None)
            }
            State::OperationEnabled if off => (State::SwitchOnDisabled, None),
            State::OperationEnabled if stop => return self.quick_stop(od, s),
            State::OperationEnabled if shutdown => {
                (State::ReadyToSwitchOn, (od.int(0x605B, 0) == 1).then(|| deceleration(0x6084)))
            }
            State::OperationEnabled if switch_on => {
                (State::SwitchedOn, (od.int_or(0x605C, 0, 1) == 1).then(|| deceleration(0x6084)))
            }
            State::QuickStopActive if off => (State::SwitchOnDisabled, None),
            State::QuickStopActive if enable && s.resumes_from_quick_stop && od.int(0x605A, 0) >= 5 => {
                (State::OperationEnabled, None)
            }
            _ => return,
        };
        self.go(target.0, target.1, od, s);
    }

    fn blocks_switch_on(&self, s: &Settings) -> bool {
        self.safe && s.safety != SafetyReaction::SwitchedOn
    }

    /// Lets time pass until `now`.
    pub fn advance(&mut self, now: u64, od: &mut Dictionary, s: &Settings) {
        // After a long silence only the last ten seconds are played.
        self.last = self.last.max(now.saturating_sub(10_000_000));
        while self.last < now {
            let dt = (now - self.last).min(1000);
            self.last += dt;
            self.now = self.last;
            self.slice(i128::from(dt), od, s);
        }
        self.now = self.now.max(now);
        self.publish(od, s);
    }

    fn slice(&mut self, dt: i128, od: &mut Dictionary, s: &Settings) {
        self.timers(od, s);
        self.modes.settle(self.now);
        let limit =
            i128::from(od.int_or(0x6072, 0, s.torque_rated * 3)) * 1000 / i128::from(s.torque_rated.max(1));
        let effort = match self.state {
            State::OperationEnabled => match self.pending.and_then(|pending| pending.ramp) {
                Some(down) => self.ramp(down, dt),
                None if self.word & 0x100 != 0 => {
                    let index = if od.int(0x605D, 0) == 2 { 0x6085 } else { 0x6084 };
                    let down = Modes::acceleration(od, index, s);
                    self.modes.halted(&self.axis, down, dt)
                }
                None => self.modes.effort(&mut self.axis, self.word, self.now, dt, od, s),
            },
            State::QuickStopActive => {
                let down = match od.int_or(0x605A, 0, 2) {
                    1 | 5 => Modes::acceleration(od, 0x6084, s),
                    2 | 6 => Modes::acceleration(od, 0x6085, s),
                    _ => i128::from(s.max_acceleration) * MICRO,
                };
                self.ramp(down, dt)
            }
            State::FaultReaction => {
                let down = match od.int_or(0x605E, 0, 2) {
                    1 => Modes::acceleration(od, 0x6084, s),
                    2 => Modes::acceleration(od, 0x6085, s),
                    _ => i128::from(s.max_acceleration) * MICRO,
                };
                self.ramp(down, dt)
            }
            _ => Effort::Coast,
        };
        self.axis.step(dt, effort, limit.max(0), s);
        if let Some(code) =
            self.modes.watch(&self.axis, self.state == State::OperationEnabled, effort, dt, od, s)
        {
            self.fail(code, od, s);
        }
    }

    fn ramp(&mut self, down: i128, dt: i128) -> Effort {
        self.ramp_vel = toward(self.ramp_vel, 0, down * dt / MICRO);
        Effort::Velocity(self.ramp_vel)
    }

    fn timers(&mut self, od: &mut Dictionary, s: &Settings) {
        let age = self.now - self.entered;
        let stands = self.axis.vel == 0;
        if let Some(pending) = self.pending {
            if self.now >= pending.due && (pending.ramp.is_none() || stands) {
                self.enter(pending.to, od, s);
                self.follow_word(od, s);
            }
            return;
        }
        match self.state {
            State::NotReady => {
                let old = self.now >= self.started && self.now - self.started >= s.not_ready_ms * 1000;
                if old && (s.ready_after.is_none() || self.released) {
                    self.enter(State::SwitchOnDisabled, od, s);
                    if self.safe && s.safety == SafetyReaction::SwitchOnDisabled {
                        self.notes.push("safety input is active".into());
                    }
                }
            }
            State::QuickStopActive => {
                let passes = s.quick_stop_passes_ms.is_some_and(|ms| age >= ms * 1000);
                if passes || (stands && (1..=4).contains(&od.int_or(0x605A, 0, 2))) {
                    self.enter(State::SwitchOnDisabled, od, s);
                }
            }
            State::FaultReaction if stands => self.enter(State::Fault, od, s),
            State::SwitchedOn | State::OperationEnabled if s.needs_mains && !self.mains => {
                if self.state == State::OperationEnabled {
                    self.fail(0x3220, od, s);
                } else if s.mains_wait_ms.is_none_or(|ms| age >= ms * 1000) {
                    self.enter(State::SwitchOnDisabled, od, s);
                }
            }
            _ => {}
        }
    }

    /// A download of 6060 is about to happen: is it allowed?
    ///
    /// # Errors
    /// The abort code.
    pub fn check_mode(&self, mode: i64, s: &Settings) -> Result<(), u32> {
        let known = mode == 0 || s.modes.iter().any(|have| i64::from(*have) == mode);
        if !known || (mode == 0 && s.mode_zero_refused) {
            return Err(abort::VALUE);
        }
        let enabled = self.state == State::OperationEnabled && s.mode_refused_enabled;
        if mode != i64::from(self.modes.mode)
            && (enabled || (s.mode_refused_halted && self.word & 0x100 != 0))
        {
            return Err(abort::STATE);
        }
        Ok(())
    }

    /// An object of the drive was written; `by_pdo` tells how.
    pub fn written(&mut self, index: u16, by_pdo: bool, od: &mut Dictionary, s: &Settings) {
        match index {
            0x6040 => self.control(word(od.int(0x6040, 0)), od, s),
            0x6060 => self.modes.request(od.int(0x6060, 0), by_pdo, self.now, s),
            0x607A | 0x60C1 => self.modes.fresh = true,
            _ => {}
        }
        self.publish(od, s);
    }

    /// A SYNC came.
    pub fn sync(&mut self, od: &Dictionary) {
        self.modes.sync(self.now, od);
    }

    /// Writes what the drive shows into the dictionary.
    pub fn publish(&mut self, od: &mut Dictionary, s: &Settings) {
        let status = self.status(od, s);
        od.set(0x6041, 0, i64::from(status));
        od.set(0x603F, 0, i64::from(self.code));
        let vel = Modes::shown_velocity(self.axis.vel, s);
        let demand_vel = if self.enabled() { Modes::shown_velocity(self.modes.demand_vel, s) } else { 0 };
        let torque = rounded(self.axis.torque * i128::from(s.torque_rated), 1000);
        let (demand, following) = self.modes.demand(&self.axis, self.state == State::OperationEnabled);
        od.set(0x6061, 0, i64::from(self.modes.shown));
        for (index, value) in [
            (0x6062, demand),
            (0x6064, self.axis.counts()),
            (0x6069, vel),
            (0x606B, demand_vel),
            (0x606C, vel),
            (0x6074, torque),
            (0x6077, torque),
            (0x6078, torque),
            (0x6079, if self.mains { 48_000 } else { 0 }),
            (0x60F4, following),
        ] {
            od.set(index, 0, value);
        }
    }

    /// The statusword.
    #[must_use]
    pub fn status(&self, od: &Dictionary, s: &Settings) -> u16 {
        let mut bits: u16 = match self.state {
            State::NotReady if s.not_ready_bit_6 => 0x40,
            State::NotReady => 0x00,
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReaction => 0x0F,
            State::Fault => 0x08,
        };
        let voltage = match s.voltage_bit {
            VoltageBit::Zero => false,
            VoltageBit::One => true,
            VoltageBit::Enabled => self.enabled(),
            VoltageBit::SwitchedOn => self.enabled() || self.state == State::SwitchedOn,
            VoltageBit::DcLink => self.mains,
        };
        let remote = match s.remote_bit {
            RemoteBit::One => true,
            RemoteBit::Zero => false,
            RemoteBit::Operational => self.operational,
        };
        bits |= if voltage { 0x10 } else { 0 } | if remote { 0x200 } else { 0 };
        let enabled = self.state == State::OperationEnabled;
        let halted = enabled && (self.word & 0x100 != 0 || self.leaving());
        if enabled || self.state == State::QuickStopActive {
            bits |= self.modes.status(&self.axis, self.word, enabled, halted, od, s);
        }
        if matches!(self.modes.mode, 8..=10) && s.cyclic_bit_10 != CyclicBit::Zero && enabled {
            let on = s.cyclic_bit_10 == CyclicBit::One || self.modes.syncs % 2 == 1;
            bits = (bits & !0x400) | if on { 0x400 } else { 0 };
        }
        if s.noise != 0 && self.now / (s.noise_ms.max(1) * 1000) % 2 == 1 {
            bits ^= s.noise;
        }
        (bits | s.bits_always) & !s.bits_never
    }
}
