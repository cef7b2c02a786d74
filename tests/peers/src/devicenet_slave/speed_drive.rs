//! An AC drive: Control Supervisor, AC/DC Drive and Motor Data objects, assemblies 20, 21, 70 and 71.

use std::collections::BTreeMap;

use super::objects::{Answer, Refusal};
use super::settings::{Lasts, Settings};

/// Startup: it initializes.
pub const STARTUP: u8 = 1;
/// It is not ready.
pub const NOT_READY: u8 = 2;
/// It waits for a run bit.
pub const READY: u8 = 3;
/// It runs.
pub const ENABLED: u8 = 4;
/// It comes to rest.
pub const STOPPING: u8 = 5;
/// It comes to rest because of a fault.
pub const FAULT_STOP: u8 = 6;
/// It has a fault.
pub const FAULTED: u8 = 7;

/// The code of a fault and what becomes of it.
#[derive(Debug, Clone, Copy)]
struct Fault {
    code: u16,
    since_us: u64,
    one_poll: bool,
}

/// The drive.
#[derive(Debug, Clone)]
pub struct SpeedDrive {
    now_us: u64,
    state: u8,
    since_us: u64,
    run1: bool,
    run2: bool,
    net_ctrl: bool,
    net_ref: bool,
    reset_bit: bool,
    force_fault: bool,
    reverse: bool,
    reference: i16,
    rpm: f64,
    turns: f64,
    polls: u32,
    fault: Option<Fault>,
    cause: Option<u16>,
    warning: u16,
    fault_mode: u8,
    values: BTreeMap<(u16, u16), Vec<u8>>,
}

/// The nearest 16-bit number.
fn int(value: f64) -> i16 {
    let limited = value.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX));
    #[expect(clippy::cast_possible_truncation, reason = "it is limited and rounded")]
    let whole = limited as i16;
    whole
}

fn bits(flags: [bool; 8]) -> u8 {
    flags.iter().enumerate().fold(0, |byte, (at, &flag)| byte | (u8::from(flag) << at))
}

impl SpeedDrive {
    /// A drive that has just got power.
    #[must_use]
    pub fn new(settings: &Settings, now_us: u64) -> Self {
        let scaled = int(f64::from(settings.top_rpm) * f64::from(settings.speed_scale).exp2());
        let mut values = BTreeMap::new();
        let mut put = |class: u16, attribute: u16, bytes: &[u8]| {
            values.insert((class, attribute), bytes.to_vec());
        };
        put(0x2A, 6, &[1]);
        put(0x2A, 10, &100_i16.to_le_bytes());
        put(0x2A, 18, &settings.ramp_ms.to_le_bytes());
        put(0x2A, 19, &settings.ramp_ms.to_le_bytes());
        put(0x2A, 20, &0_u16.to_le_bytes());
        put(0x2A, 21, &scaled.to_le_bytes());
        put(0x2A, 22, &settings.speed_scale.to_le_bytes());
        for attribute in 23..=28 {
            put(0x2A, attribute, &[0]);
        }
        put(0x28, 3, &[7]);
        put(0x28, 6, &25_u16.to_le_bytes());
        put(0x28, 7, &400_u16.to_le_bytes());
        put(0x28, 8, &1100_u32.to_le_bytes());
        put(0x28, 9, &50_u16.to_le_bytes());
        put(0x28, 11, &settings.top_rpm.to_le_bytes());
        put(0x28, 12, &4_u16.to_le_bytes());
        put(0x28, 15, &1430_u16.to_le_bytes());
        Self {
            now_us,
            state: STARTUP,
            since_us: now_us,
            run1: false,
            run2: false,
            net_ctrl: settings.net_at_start,
            net_ref: settings.net_at_start,
            reset_bit: false,
            force_fault: false,
            reverse: false,
            reference: 0,
            rpm: 0.0,
            turns: 0.0,
            polls: 0,
            fault: None,
            cause: None,
            warning: 0,
            fault_mode: 0,
            values,
        }
    }

    /// The state of the Control Supervisor.
    #[must_use]
    pub fn state(&self) -> u8 {
        self.state
    }

    /// The speed in RPM, negative when it turns backwards.
    #[must_use]
    pub fn rpm(&self) -> f64 {
        self.rpm
    }

    /// The turns since power-on.
    #[must_use]
    pub fn turns(&self) -> f64 {
        self.turns
    }

    /// Whether there is a fault.
    #[must_use]
    pub fn faulted(&self) -> bool {
        matches!(self.state, FAULT_STOP | FAULTED)
    }

    /// Whether the motor has power.
    #[must_use]
    pub fn enabled(&self) -> bool {
        matches!(self.state, ENABLED | STOPPING | FAULT_STOP)
    }

    fn enter(&mut self, state: u8) {
        if self.state != state {
            self.state = state;
            self.since_us = self.now_us;
        }
    }

    /// Whether the run bits of the network count.
    fn control_from_net(&self, settings: &Settings) -> bool {
        !settings.local_control && (self.net_ctrl || !settings.run_needs_net_ctrl)
    }

    /// Whether the reference of the network counts.
    fn reference_from_net(&self, settings: &Settings) -> bool {
        !settings.local_control && (self.net_ref || !settings.reference_needs_net_ref)
    }

    fn stored(&self, attribute: u16) -> f64 {
        let value = self.values.get(&(0x2A, attribute)).map(Vec::as_slice);
        match value {
            Some(&[low, high]) => f64::from(u16::from_le_bytes([low, high])),
            _ => 0.0,
        }
    }

    fn scale(&self) -> f64 {
        let scale = self.values.get(&(0x2A, 22)).and_then(|bytes| bytes.first().copied()).unwrap_or(0);
        f64::from(i8::from_le_bytes([scale])).exp2()
    }

    /// The speed it shall have, with its sign.
    fn target(&self, settings: &Settings) -> f64 {
        if !self.reference_from_net(settings) {
            return 0.0;
        }
        let scale = self.scale();
        let top = self.stored(21) / scale;
        let asked = (f64::from(self.reference) / scale).clamp(-top, top);
        if self.reverse { -asked } else { asked }
    }

    fn at_reference(&self, settings: &Settings) -> bool {
        self.state == ENABLED
            && !settings.never_at_reference
            && (self.rpm - self.target(settings)).abs() < 0.5
    }

    /// Lets `seconds` pass up to now.
    pub fn advance(&mut self, settings: &Settings, now_us: u64, seconds: f64) {
        self.now_us = now_us;
        let top = (self.stored(21) / self.scale()).max(1.0);
        let (goal, ramp) = match self.state {
            ENABLED => (self.target(settings), self.stored(18)),
            _ => (0.0, self.stored(19)),
        };
        let step = if ramp > 0.0 { top * 1000.0 / ramp * seconds } else { f64::INFINITY };
        self.rpm =
            if (goal - self.rpm).abs() <= step { goal } else { self.rpm + step.copysign(goal - self.rpm) };
        self.turns += self.rpm / 60.0 * seconds;
        let stands = self.rpm.abs() < 0.5;
        match self.state {
            STARTUP if now_us >= self.since_us + u64::from(settings.startup_ms) * 1000 => {
                self.enter(NOT_READY)
            }
            NOT_READY if !settings.never_ready => self.enter(READY),
            ENABLED if !self.control_from_net(settings) => self.enter(STOPPING),
            STOPPING if stands => self.enter(READY),
            FAULT_STOP if stands => self.enter(FAULTED),
            _ => {}
        }
    }

    fn trip(&mut self, code: u16, one_poll: bool) {
        if self.fault.is_none() {
            self.fault = Some(Fault { code, since_us: self.now_us, one_poll });
        }
        match self.state {
            ENABLED | STOPPING => self.enter(FAULT_STOP),
            FAULT_STOP => {}
            _ => self.enter(FAULTED),
        }
    }

    fn reset(&mut self, settings: &Settings) {
        let Some(fault) = self.fault else { return };
        if self.state != FAULTED || self.now_us < fault.since_us + u64::from(settings.reset_refused_ms) * 1000
        {
            return;
        }
        self.fault = None;
        self.enter(NOT_READY);
        if let Some(code) = self.cause {
            self.trip(code, false);
        }
    }

    /// Sets a cause of a fault that stays.
    pub fn fail(&mut self, code: u16) {
        self.cause = Some(code);
        self.trip(code, false);
    }

    /// Takes the cause away. The fault stays until its reset.
    pub fn mend(&mut self) {
        self.cause = None;
    }

    /// The connection is lost.
    pub fn lost(&mut self, settings: &Settings) {
        if self.fault_mode == 0 {
            if self.control_from_net(settings) {
                self.trip(settings.loss_code, false);
            }
        } else {
            self.warning = settings.loss_code;
        }
    }

    /// The connection is closed by the master: it stops.
    pub fn closed(&mut self) {
        (self.run1, self.run2) = (false, false);
        if self.state == ENABLED {
            self.enter(STOPPING);
        }
    }

    fn inputs(&mut self, settings: &Settings, run1: bool, run2: bool) {
        let changed = (run1, run2) != (self.run1, self.run2);
        (self.run1, self.run2) = (run1, run2);
        if !changed || !self.control_from_net(settings) {
            return;
        }
        match (run1, run2) {
            (false, false) => {
                if self.state == ENABLED {
                    self.enter(STOPPING);
                }
            }
            (true, true) => {}
            (_, reverse) => {
                if matches!(self.state, READY | STOPPING) {
                    self.enter(ENABLED);
                }
                if self.state == ENABLED {
                    self.reverse = reverse;
                }
            }
        }
    }

    fn reset_input(&mut self, settings: &Settings, bit: bool) {
        let rose = bit && !self.reset_bit;
        self.reset_bit = bit;
        if rose {
            self.reset(settings);
        }
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

    /// Takes the data of an output assembly.
    pub fn consume(&mut self, settings: &Settings, assembly: u8, data: &[u8]) {
        let byte = |at: usize| data.get(at).copied().unwrap_or(0);
        let word = byte(0);
        let extended = assembly == 21;
        if extended {
            self.net_ctrl = word & 0x20 != 0;
            self.net_ref = word & 0x40 != 0;
        }
        self.reference = i16::from_le_bytes([byte(2), byte(3)]);
        self.reset_input(settings, word & 0x04 != 0);
        self.inputs(settings, word & 0x01 != 0, extended && word & 0x02 != 0);
    }

    /// The data of an assembly, if there is such a one.
    #[must_use]
    pub fn assembly(&self, settings: &Settings, assembly: u8) -> Option<Vec<u8>> {
        let forward = self.enabled() && !self.reverse;
        let backward = self.enabled() && self.reverse;
        let ready = matches!(self.state, READY | ENABLED | STOPPING);
        let mut speed = self.rpm * self.scale();
        if settings.unsigned_speed {
            speed = speed.abs();
        }
        let [low, high] = int(speed).to_le_bytes();
        let [ref_low, ref_high] = self.reference.to_le_bytes();
        let (run1, run2, reset) = (self.run1, self.run2, self.reset_bit);
        let faulted = self.faulted();
        let off = false;
        Some(match assembly {
            20 => vec![bits([run1, off, reset, off, off, off, off, off]), 0, ref_low, ref_high],
            21 => {
                let word = [run1, run2, reset, off, off, self.net_ctrl, self.net_ref, off];
                vec![bits(word), 0, ref_low, ref_high]
            }
            70 => vec![bits([faulted, off, forward, off, off, off, off, off]), 0, low, high],
            71 => {
                let word = bits([
                    faulted,
                    self.warning != 0,
                    forward,
                    backward,
                    ready,
                    self.control_from_net(settings),
                    self.reference_from_net(settings),
                    self.at_reference(settings),
                ]);
                vec![word, self.state, low, high]
            }
            _ => return None,
        })
    }

    /// The answer to a poll. A fault for one poll is over with it.
    pub fn produce(&mut self, settings: &Settings, assembly: u8) -> Vec<u8> {
        let data = self.assembly(settings, assembly).unwrap_or_default();
        if self.fault.is_some_and(|fault| fault.one_poll) {
            self.fault = None;
            self.enter(NOT_READY);
        }
        data
    }

    /// Reads an attribute of classes 28h, 29h and 2Ah.
    ///
    /// # Errors
    ///
    /// There is no such attribute.
    pub fn get(&self, settings: &Settings, class: u16, attribute: u16) -> Answer {
        let flag = |value: bool| Ok(vec![u8::from(value)]);
        let code = if settings.fault_without_code { 0 } else { self.fault.map_or(0, |fault| fault.code) };
        match (class, attribute) {
            (0x29, 3) => flag(self.run1),
            (0x29, 4) => flag(self.run2),
            (0x29, 5) => flag(self.net_ctrl),
            (0x29, 6) => Ok(vec![self.state]),
            (0x29, 7) => flag(self.enabled() && !self.reverse),
            (0x29, 8) => flag(self.enabled() && self.reverse),
            (0x29, 9) => flag(matches!(self.state, READY | ENABLED | STOPPING)),
            (0x29, 10) => flag(self.faulted()),
            (0x29, 11) => flag(self.warning != 0),
            (0x29, 12) => flag(self.reset_bit),
            (0x29, 13) => Ok(code.to_le_bytes().to_vec()),
            (0x29, 14) => Ok(self.warning.to_le_bytes().to_vec()),
            (0x29, 15) => flag(self.control_from_net(settings)),
            (0x29, 16) => Ok(vec![self.fault_mode]),
            (0x29, 17) => flag(self.force_fault),
            (0x2A, 3) => flag(self.at_reference(settings)),
            (0x2A, 4) => flag(self.net_ref),
            (0x2A, 7) => Ok(self.assembly(settings, 70).unwrap_or_default().split_off(2)),
            (0x2A, 8) => Ok(self.reference.to_le_bytes().to_vec()),
            (0x2A, 9 | 11) => Ok(vec![0, 0]),
            (0x2A, 29) => flag(self.reference_from_net(settings)),
            _ => self.values.get(&(class, attribute)).cloned().ok_or(Refusal::NO_ATTRIBUTE),
        }
    }

    /// Sets an attribute of classes 28h, 29h and 2Ah.
    ///
    /// # Errors
    ///
    /// There is no such attribute, it can only be read, or the value is not possible.
    pub fn set(&mut self, settings: &Settings, class: u16, attribute: u16, data: &[u8]) -> Answer {
        let old = self.get(settings, class, attribute)?;
        let flags = class == 0x29 && matches!(attribute, 3..=5 | 12 | 16 | 17);
        let numbers = class == 0x2A && matches!(attribute, 4 | 6 | 8 | 10 | 18..=28);
        if !(flags || numbers || class == 0x28) {
            return Err(Refusal::READ_ONLY);
        }
        Refusal::length(data, old.len())?;
        let first = data.first().copied().unwrap_or(0);
        let highest = match (class, attribute) {
            (0x29, 16) => 2,
            (0x29, _) | (0x2A, 4) => 1,
            (0x2A, 6) => 2,
            _ => u8::MAX,
        };
        if first > highest {
            return Err(Refusal::BAD_VALUE);
        }
        let on = first != 0;
        match (class, attribute) {
            (0x29, 3) => self.inputs(settings, on, self.run2),
            (0x29, 4) => self.inputs(settings, self.run1, on),
            (0x29, 5) => self.net_ctrl = on,
            (0x29, 12) => self.reset_input(settings, on),
            (0x29, 16) => self.fault_mode = first,
            (0x29, 17) => {
                let rose = on && !self.force_fault;
                self.force_fault = on;
                if rose {
                    self.trip(0xFF00, false);
                }
            }
            (0x2A, 4) => self.net_ref = on,
            (0x2A, 8) => self.reference = i16::from_le_bytes([first, data.get(1).copied().unwrap_or(0)]),
            _ => {
                self.values.insert((class, attribute), data.to_vec());
            }
        }
        Ok(Vec::new())
    }
}
