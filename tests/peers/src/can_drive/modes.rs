//! The modes of operation: what each makes of the set-points.

use super::axis::{Axis, Effort, MICRO, rounded, toward, trapezoid};
use super::dictionary::Dictionary;
use super::settings::Settings;

/// How homing stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Homing {
    Idle,
    Running,
    Done,
    Error,
}

/// What the modes keep.
#[derive(Debug, Clone)]
pub struct Modes {
    /// The mode in force.
    pub mode: i8,
    /// What 6061 shows.
    pub shown: i8,
    /// Velocity the controller wants, millionths of a count per second.
    pub demand_vel: i128,
    /// A new 607A or 60C1 came since enabling.
    pub fresh: bool,
    /// SYNCs since enabling.
    pub syncs: u32,
    demand_pos: i128,
    holds_position: bool,
    wanted: Option<(i8, u64)>,
    target: Option<i128>,
    next: Option<i128>,
    acknowledged: bool,
    homing: Homing,
    home_offset: i128,
    segment: Option<Segment>,
    last_sync: Option<u64>,
    follow_us: i128,
    torque: i128,
    following: bool,
    limited: bool,
}

/// A straight way from one position to another.
#[derive(Debug, Clone, Copy)]
struct Segment {
    to: i128,
    until: u64,
}

impl Modes {
    /// At power on.
    #[must_use]
    pub fn new(s: &Settings) -> Self {
        Self {
            mode: s.mode_at_start,
            shown: s.mode_at_start,
            demand_vel: 0,
            fresh: false,
            syncs: 0,
            demand_pos: 0,
            holds_position: false,
            wanted: None,
            target: None,
            next: None,
            acknowledged: false,
            homing: Homing::Idle,
            home_offset: 0,
            segment: None,
            last_sync: None,
            follow_us: 0,
            torque: 0,
            following: false,
            limited: false,
        }
    }

    /// An acceleration object in millionths of a count per second squared; 0 is as fast as can be.
    #[must_use]
    pub fn acceleration(od: &Dictionary, index: u16, s: &Settings) -> i128 {
        let most = i128::from(s.max_acceleration) * MICRO;
        let (num, den) = s.acceleration_unit;
        let value = i128::from(od.int(index, 0)) * i128::from(num) * MICRO / i128::from(den.max(1));
        if value == 0 { most } else { value.min(most) }
    }

    fn velocity(value: i64, s: &Settings) -> i128 {
        let (num, den) = s.velocity_unit;
        i128::from(value) * i128::from(num) * MICRO / i128::from(den.max(1))
    }

    /// A velocity in the unit of 606C.
    #[must_use]
    pub fn shown_velocity(vel: i128, s: &Settings) -> i64 {
        let (num, den) = s.velocity_unit;
        rounded(vel * i128::from(den), i128::from(num) * MICRO)
    }

    /// 60C2 in microseconds; 0 if there is none.
    #[must_use]
    pub fn period_us(&self, od: &Dictionary) -> i64 {
        let (value, exponent) = (od.int(0x60C2, 1), od.int(0x60C2, 2));
        match u32::try_from(exponent + 6) {
            Ok(power) => value.saturating_mul(10_i64.saturating_pow(power)),
            Err(_) => 0,
        }
    }

    /// "Operation enabled" begins.
    pub fn start(&mut self, axis: &Axis) {
        self.demand_pos = axis.pos;
        self.demand_vel = axis.vel;
        self.holds_position = true;
        self.fresh = false;
        self.syncs = 0;
        self.segment = None;
        self.target = None;
        self.next = None;
        self.homing = Homing::Idle;
        self.follow_us = 0;
        self.torque = 0;
        self.limited = false;
    }

    /// The drive is no longer enabled.
    pub fn stop(&mut self) {
        self.target = None;
        self.next = None;
        self.segment = None;
        self.acknowledged = false;
        self.following = false;
        self.homing = Homing::Idle;
        self.demand_vel = 0;
    }

    /// 6060 was written.
    pub fn request(&mut self, value: i64, by_pdo: bool, now: u64, s: &Settings) {
        let Ok(mode) = i8::try_from(value) else { return };
        if mode == 0 && !(by_pdo && s.mode_zero_clears) {
            self.wanted = None;
            return;
        }
        if s.mode_detour.is_some_and(|(from, via)| self.mode == from && mode != via && mode != from) {
            return;
        }
        if self.wanted.is_some_and(|(wanted, _)| wanted == mode)
            || (self.wanted.is_none() && self.mode == mode)
        {
            return;
        }
        self.wanted = Some((mode, now + s.mode_delay_ms * 1000));
        if s.mode_delay_ms == 0 {
            self.take(mode);
        } else if let Some(meanwhile) = s.mode_meanwhile {
            self.shown = meanwhile;
        }
    }

    /// The axis is caught where it is by the next effort.
    fn take(&mut self, mode: i8) {
        self.wanted = None;
        self.mode = mode;
        self.shown = mode;
        self.holds_position = false;
        self.fresh = false;
        self.target = None;
        self.next = None;
        self.segment = None;
        self.acknowledged = false;
        self.homing = Homing::Idle;
        self.follow_us = 0;
        self.torque = 0;
        self.limited = false;
    }

    /// A mode change may be due.
    pub fn settle(&mut self, now: u64) {
        if let Some((mode, due)) = self.wanted
            && now >= due
        {
            self.take(mode);
        }
    }

    /// A controlword came: edges of bit 4 matter in pp and hm.
    pub fn control(
        &mut self,
        before: u16,
        word: u16,
        axis: &Axis,
        enabled: bool,
        od: &Dictionary,
        s: &Settings,
    ) {
        let rises = word & 0x10 != 0 && before & 0x10 == 0;
        match self.mode {
            1 if word & 0x10 == 0 => self.acknowledged = false,
            1 if rises && enabled => self.set_point(word, axis, od),
            6 if rises && enabled => {
                self.homing = Homing::Running;
                let method = od.int(0x6098, 0);
                self.home_offset = i128::from(od.int(0x607C, 0)) * MICRO;
                let (low, high) = s.homing_methods;
                let known = (i64::from(low)..=i64::from(high)).contains(&method);
                if s.homing_fails || method == 0 || !known {
                    self.homing = Homing::Error;
                }
            }
            6 if word & 0x10 == 0 && self.homing == Homing::Running => self.homing = Homing::Idle,
            _ => {}
        }
    }

    fn set_point(&mut self, word: u16, axis: &Axis, od: &Dictionary) {
        let value = i128::from(od.int(0x607A, 0)) * MICRO;
        let at_once = word & 0x20 != 0;
        let from = match (self.target, at_once) {
            (Some(target), false) => target,
            _ if self.holds_position => self.demand_pos,
            _ => axis.pos,
        };
        let target = if word & 0x40 != 0 { from + value } else { value };
        if self.target.is_none() || at_once {
            self.target = Some(target);
            self.next = None;
            self.acknowledged = true;
        } else if self.next.is_none() {
            self.next = Some(target);
            self.acknowledged = true;
        }
    }

    /// A SYNC came: the cyclic set-points begin.
    pub fn sync(&mut self, now: u64, od: &Dictionary) {
        self.syncs = self.syncs.saturating_add(1);
        let gap = self.last_sync.map_or(0, |last| now - last);
        self.last_sync = Some(now);
        if matches!(self.mode, 7 | 8) {
            let period = match u64::try_from(self.period_us(od)) {
                Ok(period) if period > 0 => period,
                _ if gap > 0 && gap < 100_000 => gap,
                _ => 1000,
            };
            self.segment = self.cyclic_target(od).map(|to| Segment { to, until: now + period });
        }
    }

    fn cyclic_target(&self, od: &Dictionary) -> Option<i128> {
        let value = match self.mode {
            8 => od.int(0x607A, 0) + od.int(0x60B0, 0),
            _ => od.int(0x60C1, 1),
        };
        self.fresh.then(|| i128::from(value) * MICRO)
    }

    fn catch(&mut self, axis: &Axis) {
        if !self.holds_position {
            self.demand_pos = axis.pos;
            self.demand_vel = axis.vel;
            self.holds_position = true;
        }
    }

    /// The axis is being halted.
    pub fn halted(&mut self, axis: &Axis, down: i128, dt: i128) -> Effort {
        if !self.holds_position && self.mode == 4 {
            self.demand_vel = axis.vel;
        }
        self.following = false;
        self.torque = 0;
        self.demand_vel = toward(self.demand_vel, 0, down * dt / MICRO);
        if self.holds_position {
            self.demand_pos += self.demand_vel * dt / MICRO;
            self.segment = None;
            return Effort::Position(self.demand_pos, self.demand_vel);
        }
        Effort::Velocity(self.demand_vel)
    }

    /// What the mode does with the axis for this time.
    pub fn effort(
        &mut self,
        axis: &mut Axis,
        word: u16,
        now: u64,
        dt: i128,
        od: &Dictionary,
        s: &Settings,
    ) -> Effort {
        self.following = false;
        self.limited = false;
        let warm = self.syncs >= s.sync_warmup && word & s.cyclic_needs_bits == s.cyclic_needs_bits;
        match self.mode {
            1 => self.profile(axis, dt, od, s),
            6 => self.home(axis, dt, od, s),
            7 if word & 0x10 != 0 && self.syncs >= s.sync_warmup => self.track(axis, now, dt, od),
            8 if warm => self.track(axis, now, dt, od),
            3 => {
                let target = self.speed_limit(Self::velocity(od.int(0x60FF, 0), s), od, s);
                let slows = target.abs() < self.demand_vel.abs();
                let rate = Self::acceleration(od, if slows { 0x6084 } else { 0x6083 }, s);
                self.speed(toward(self.demand_vel, target, rate * dt / MICRO))
            }
            9 if warm => {
                let target = Self::velocity(od.int(0x60FF, 0) + od.int(0x60B1, 0), s);
                self.following = true;
                let target = self.speed_limit(target, od, s);
                self.speed(target)
            }
            9 => self.speed(0),
            4 => {
                let rated = i128::from(s.torque_rated.max(1));
                let slope = i128::from(od.int_or(0x6087, 0, 10_000)) * MICRO / rated * 1000 * dt / MICRO;
                let target = i128::from(od.int(0x6071, 0)) * 1000 * MICRO / rated;
                self.torque = toward(self.torque, target, slope);
                self.push(axis)
            }
            10 if warm => {
                let value = od.int(0x6071, 0) + od.int(0x60B2, 0);
                self.torque = i128::from(value) * 1000 * MICRO / i128::from(s.torque_rated.max(1));
                self.following = true;
                self.push(axis)
            }
            10 => {
                self.torque = 0;
                self.push(axis)
            }
            _ => {
                self.catch(axis);
                self.demand_vel = toward(self.demand_vel, 0, Self::acceleration(od, 0x6084, s) * dt / MICRO);
                self.demand_pos += self.demand_vel * dt / MICRO;
                Effort::Position(self.demand_pos, self.demand_vel)
            }
        }
    }

    fn push(&mut self, axis: &Axis) -> Effort {
        self.holds_position = false;
        self.demand_vel = axis.vel;
        Effort::Torque(self.torque / MICRO)
    }

    fn speed(&mut self, vel: i128) -> Effort {
        self.demand_vel = vel;
        self.holds_position = false;
        Effort::Velocity(vel)
    }

    fn speed_limit(&mut self, vel: i128, od: &Dictionary, s: &Settings) -> i128 {
        let top = Self::top(od, s);
        self.limited = vel.abs() > top;
        vel.clamp(-top, top)
    }

    fn top(od: &Dictionary, s: &Settings) -> i128 {
        let most = i128::from(s.max_velocity) * MICRO;
        let value = Self::velocity(od.int(0x607F, 0), s);
        if value == 0 { most } else { value.min(most) }
    }

    fn range(&mut self, target: i128, od: &Dictionary) -> i128 {
        let (low, high) = (i128::from(od.int(0x607D, 1)) * MICRO, i128::from(od.int(0x607D, 2)) * MICRO);
        if low >= high {
            return target;
        }
        self.limited |= target < low || target > high;
        target.clamp(low, high)
    }

    fn track(&mut self, axis: &Axis, now: u64, dt: i128, od: &Dictionary) -> Effort {
        self.catch(axis);
        self.following = self.fresh;
        // Without a SYNC a target counts as soon as it is written.
        if self.last_sync.is_none() {
            self.segment = self.cyclic_target(od).map(|to| Segment { to, until: now });
        }
        self.demand_vel = 0;
        if let Some(segment) = self.segment {
            let to = self.range(segment.to, od);
            let left = i128::from(segment.until.saturating_sub(now)) + dt;
            let moved = (to - self.demand_pos) * dt.min(left) / left.max(1);
            self.demand_pos += moved;
            // A set-point that jumps gives no feed-forward.
            self.demand_vel = if self.last_sync.is_some() { moved * MICRO / dt.max(1) } else { 0 };
            if segment.until <= now {
                self.segment = None;
            }
        }
        Effort::Position(self.demand_pos, self.demand_vel)
    }

    fn profile(&mut self, axis: &Axis, dt: i128, od: &Dictionary, s: &Settings) -> Effort {
        self.catch(axis);
        let (up, down) = (Self::acceleration(od, 0x6083, s), Self::acceleration(od, 0x6084, s));
        if let Some(target) = self.target {
            let top = Self::velocity(od.int(0x6081, 0), s);
            let top = self.speed_limit(top, od, s);
            let goal = self.range(target, od);
            (self.demand_pos, self.demand_vel) =
                trapezoid(self.demand_pos, self.demand_vel, goal, top, up, down, dt);
            if self.demand_pos == goal && self.demand_vel == 0 {
                self.target = self.next.take();
            }
        } else {
            self.demand_vel = toward(self.demand_vel, 0, down * dt / MICRO);
            self.demand_pos += self.demand_vel * dt / MICRO;
        }
        Effort::Position(self.demand_pos, self.demand_vel)
    }

    fn home(&mut self, axis: &mut Axis, dt: i128, od: &Dictionary, s: &Settings) -> Effort {
        self.catch(axis);
        let rate = Self::acceleration(od, 0x609A, s);
        if self.homing != Homing::Running {
            self.demand_vel = toward(self.demand_vel, 0, rate * dt / MICRO);
            self.demand_pos += self.demand_vel * dt / MICRO;
            return Effort::Position(self.demand_pos, self.demand_vel);
        }
        let here = matches!(od.int(0x6098, 0), 35 | 37);
        let switch = i128::from(s.home_at) * MICRO;
        if !here {
            let top = Self::velocity(od.int(0x6099, 1), s);
            (self.demand_pos, self.demand_vel) =
                trapezoid(self.demand_pos, self.demand_vel, switch, top, rate, rate, dt);
        }
        if here || (self.demand_pos == switch && (axis.pos - switch).abs() < MICRO) {
            // The place where the axis stands gets the offset's number.
            let shift = self.home_offset - if here { axis.pos } else { switch };
            axis.pos += shift;
            self.demand_pos += shift;
            self.homing = Homing::Done;
        }
        Effort::Position(self.demand_pos, self.demand_vel)
    }

    /// Watches the following error and the SYNC: gives the code of a fault.
    pub fn watch(
        &mut self,
        axis: &Axis,
        on: bool,
        effort: Effort,
        dt: i128,
        od: &Dictionary,
        s: &Settings,
    ) -> Option<u16> {
        let window = od.int(0x6065, 0);
        let off = window == 0xFFFF_FFFF || !s.follow_fault;
        match effort {
            Effort::Position(pos, _) if on && !off && (pos - axis.pos).abs() > i128::from(window) * MICRO => {
                self.follow_us += dt;
            }
            _ => self.follow_us = 0,
        }
        (self.follow_us > i128::from(od.int(0x6066, 0)) * 1000).then_some(0x8611)
    }

    /// Whether SYNC has been away for too long.
    #[must_use]
    pub fn sync_lost(&self, now: u64, od: &Dictionary, s: &Settings) -> bool {
        let Some(periods) = s.sync_lost_periods else { return false };
        let limit = u64::try_from(od.int(0x1006, 0)).unwrap_or(0) * u64::from(periods);
        let cyclic = matches!(self.mode, 7..=10);
        limit > 0 && cyclic && self.syncs > 0 && self.last_sync.is_some_and(|last| now - last > limit)
    }

    /// Demand position and following error in counts.
    #[must_use]
    pub fn demand(&self, axis: &Axis, on: bool) -> (i64, i64) {
        if on && self.holds_position {
            (rounded(self.demand_pos, MICRO), rounded(self.demand_pos - axis.pos, MICRO))
        } else {
            (axis.counts(), 0)
        }
    }

    /// Bits 10 to 13 of the statusword.
    #[must_use]
    pub fn status(
        &self,
        axis: &Axis,
        word: u16,
        on: bool,
        halted: bool,
        od: &Dictionary,
        s: &Settings,
    ) -> u16 {
        let stands = axis.vel.abs() < i128::from(s.max_velocity) * MICRO / 10_000;
        let mut reached = stands;
        let mut twelve = false;
        let mut thirteen = false;
        match self.mode {
            _ if !on => {}
            1 => {
                let window = i128::from(od.int_or(0x6067, 0, 10)) * MICRO;
                let near = (self.demand_pos - axis.pos).abs() <= window;
                twelve = self.acknowledged;
                reached = if halted { stands } else { self.target.is_none() && near };
                thirteen = self.follow_us > 0;
            }
            3 => {
                let shown = Self::shown_velocity(axis.vel, s);
                let target = od.int(0x60FF, 0);
                reached = if halted { stands } else { (shown - target).abs() <= od.int_or(0x606D, 0, 10) };
                twelve = shown.abs() <= od.int_or(0x606F, 0, 10);
            }
            4 => {
                let target = i128::from(od.int(0x6071, 0)) * 1000 * MICRO / i128::from(s.torque_rated.max(1));
                reached = if halted { stands } else { self.torque == target };
            }
            6 => {
                twelve = self.homing == Homing::Done;
                thirteen = self.homing == Homing::Error;
                reached = self.homing != Homing::Running && stands && !s.homing_without_bit_10;
            }
            7 => {
                twelve = self.following && word & 0x10 != 0;
                reached = (self.demand_pos - axis.pos).abs() <= i128::from(od.int_or(0x6067, 0, 10)) * MICRO;
            }
            8..=10 => {
                twelve = self.following && !s.never_follows;
                reached = false;
                thirteen = self.mode == 8 && self.follow_us > 0;
            }
            _ => reached = false,
        }
        let bit = |on: bool, mask: u16| if on { mask } else { 0 };
        bit(reached, 0x400) | bit(self.limited, 0x800) | bit(twelve, 0x1000) | bit(thirteen, 0x2000)
    }
}
