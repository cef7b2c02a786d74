//! The drive: its state machine behind S-0-0134 and S-0-0135, and a motor that follows within its limits.
//!
//! Assumptions where the sheets are silent. The mode of S-0-0134 is in bits 10..8 unless the setting says otherwise. Halt is
//! acknowledged (bit 4) at standstill. Bit 15 given again while the drive stops turns it on again. When the network leaves CP4
//! under an enabled drive, it stops and shows C1D bit 12. Homing runs a quarter of a revolution in the direction of S-0-0147
//! bit 0, takes that place as the reference point, and gives it the value of S-0-0052. A mode with bit 4 (drive controlled
//! interpolation) takes its target from S-0-0258, and S-0-0259 as its velocity when it is not 0.

use super::idn::{Idn, Table};
use super::scaling::{Scaling, real, whole};
use super::settings::Settings;

/// S-0-0011: excessive position deviation.
pub const C1D_DEVIATION: u16 = 1 << 11;
/// S-0-0011: communication.
pub const C1D_COMMUNICATION: u16 = 1 << 12;
/// S-0-0011: travel limit.
pub const C1D_LIMIT: u16 = 1 << 13;

const HOMING_WAY: f64 = 0.25;
const STEP_NS: u64 = 1_000_000;

/// Where the power stage stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Power {
    NotReady,
    Ready,
    Mains,
    Starting(u64),
    On(u64),
    Stopping,
    Reacting,
    Waiting(u64),
}

/// How homing stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Homing {
    No,
    Moving { mark: f64 },
    Done,
    Failed,
}

/// The drive and its motor.
#[derive(Debug, Clone)]
pub struct Drive {
    scaling: Scaling,
    power: Power,
    since: Option<u64>,
    last: Option<u64>,
    bit15: bool,
    armed: bool,
    mode: u16,
    /// The last position command, for feed forward.
    target: Option<f64>,
    /// The position the motor holds when it does not follow commands.
    held: f64,
    pos: f64,
    vel: f64,
    torque: f64,
    /// Added to the position of the motor, from homing.
    shift: f64,
    error: f64,
    homing: Homing,
    following: bool,
    halted: bool,
    /// The bits of S-0-0011.
    pub errors: u16,
    /// Set when an undefined mode was selected: S-0-0014 bit 9.
    pub no_mode: bool,
}

impl Drive {
    /// A drive at rest.
    #[must_use]
    pub fn new(table: &Table, settings: &Settings) -> Self {
        Self {
            scaling: Scaling::new(table, settings.encoder, settings.stall_torque),
            power: Power::NotReady,
            since: None,
            last: None,
            bit15: false,
            armed: true,
            mode: 0,
            target: None,
            held: settings.start_position,
            pos: settings.start_position,
            vel: 0.0,
            torque: 0.0,
            shift: 0.0,
            error: 0.0,
            homing: Homing::No,
            following: false,
            halted: false,
            errors: 0,
            no_mode: false,
        }
    }

    /// Reads the scaling again, after a parameter was written.
    pub fn configure(&mut self, table: &Table, settings: &Settings) {
        self.scaling = Scaling::new(table, settings.encoder, settings.stall_torque);
    }

    /// Revolutions of the motor, as S-0-0051 shows them without polarity.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.pos + self.shift
    }

    /// Revolutions a second of the motor.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.vel
    }

    /// Torque in newton metres.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.torque
    }

    /// Is the torque on?
    #[must_use]
    pub fn enabled(&self) -> bool {
        matches!(self.power, Power::On(_) | Power::Stopping | Power::Reacting | Power::Waiting(_))
    }

    /// The scaling in use.
    #[must_use]
    pub fn scaling(&self) -> Scaling {
        self.scaling
    }

    /// Raises bits of S-0-0011.
    pub fn raise(&mut self, bits: u16) {
        self.errors |= bits;
        if bits != 0 && matches!(self.power, Power::On(_) | Power::Stopping | Power::Waiting(_)) {
            self.power = Power::Reacting;
        }
    }

    /// S-0-0099: takes the errors away whose cause is gone. False: some stay.
    pub fn reset(&mut self, lasting: u16) -> bool {
        self.errors &= lasting;
        self.no_mode &= self.errors != 0;
        self.errors == 0
    }

    /// Starts homing. False: the drive cannot.
    pub fn home(&mut self, table: &Table) -> bool {
        if !matches!(self.power, Power::On(_)) || self.errors != 0 {
            return false;
        }
        let way = if table.word(Idn::s(147)) & 1 == 0 { HOMING_WAY } else { -HOMING_WAY };
        self.homing = Homing::Moving { mark: self.pos + way };
        true
    }

    /// How homing ended, if it has.
    #[must_use]
    pub fn homed(&self) -> Option<bool> {
        match self.homing {
            Homing::Done => Some(true),
            Homing::Failed => Some(false),
            _ => None,
        }
    }

    /// The command of homing was cancelled.
    pub fn end_homing(&mut self) {
        self.homing = Homing::No;
    }

    /// S-0-0135 as it stands, error bits of one telegram included.
    #[must_use]
    pub fn status(&self, settings: &Settings, flash: u16) -> u16 {
        let failed = self.errors | flash != 0;
        let power: u16 = match self.power {
            Power::NotReady => 0,
            Power::Ready => 1,
            _ if self.enabled() => 3,
            _ if self.errors != 0 && settings.error_shows_not_ready => 0,
            _ => 2,
        };
        power << 14
            | u16::from(failed) << 13
            | (self.mode & 7) << 8
            | u16::from(self.halted) << 4
            | u16::from(self.following && !settings.no_follow_bit) << 3
    }

    /// Lets time pass up to `now`.
    pub fn tick(&mut self, now: u64, table: &mut Table, settings: &Settings, cp4: bool) {
        let mut at = self.last.unwrap_or(now).min(now);
        // After a long sleep only the last ten seconds are lived through.
        at = at.max(now.saturating_sub(10_000_000_000));
        self.supervise(now, table, settings, cp4);
        let target = self.command_position(table);
        let speed = match (self.target, target) {
            (Some(old), new) if now > at => (new - old) / (real(i64::try_from(now - at).unwrap_or(1)) * 1e-9),
            _ => 0.0,
        };
        while at < now {
            let step = (now - at).min(STEP_NS);
            at += step;
            self.motion(real(i64::try_from(step).unwrap_or(0)) * 1e-9, target, speed, table, settings);
        }
        self.target = self.enabled().then_some(target);
        self.last = Some(now);
        self.watch(table);
        self.feedback(table);
    }

    fn supervise(&mut self, now: u64, table: &Table, settings: &Settings, cp4: bool) {
        let ms = |value: u32| u64::from(value) * 1_000_000;
        if !cp4 {
            self.since = None;
            if self.enabled() {
                self.raise(C1D_COMMUNICATION);
            } else {
                self.power = Power::NotReady;
            }
        }
        let since = if cp4 { *self.since.get_or_insert(now) } else { now };
        let control = if cp4 { table.word(Idn::s(134)) } else { 0x4000 };
        let (on, enable) = (control & 0x8000 != 0, control & 0x4000 != 0);
        let edge = on && !self.bit15;
        self.bit15 = on;
        self.select_mode(control, table, settings);
        let age = now.saturating_sub(since);
        if self.power == Power::NotReady && cp4 && age >= ms(settings.ready_ms) {
            self.power = Power::Ready;
        }
        if self.power == Power::Ready && settings.mains && age >= ms(settings.ready_ms + settings.mains_ms) {
            self.power = Power::Mains;
        }
        if edge || !settings.enable_needs_edge || !on {
            self.armed = true;
        }
        if self.power == Power::Mains && self.errors != 0 {
            self.armed = !settings.enable_needs_edge;
        }
        if self.power == Power::Mains && on && enable && self.armed && self.errors == 0 {
            self.power = Power::Starting(now);
        }
        if let Power::Starting(start) = self.power {
            if !on || !enable || self.errors != 0 {
                self.power = Power::Mains;
            } else if now.saturating_sub(start) >= ms(settings.power_up_ms) {
                self.power = Power::On(now);
                self.held = self.pos;
                self.armed = !settings.enable_needs_edge;
            }
        }
        self.run_down(now, on, enable, settings);
        let follow =
            matches!(self.power, Power::On(start) if now.saturating_sub(start) >= ms(settings.follow_ms));
        let run = control & 0x2000 != 0;
        let was = self.following;
        self.following = follow && run && self.homing == Homing::No && self.mode_code(table) != 0;
        if was && !self.following {
            self.held = self.pos;
        }
        self.halted = matches!(self.power, Power::On(_)) && !run && self.vel == 0.0;
    }

    fn run_down(&mut self, now: u64, on: bool, enable: bool, settings: &Settings) {
        if !enable && self.enabled() {
            self.power = Power::Mains;
        }
        match self.power {
            Power::On(_) if self.errors != 0 => self.power = Power::Reacting,
            Power::On(_) if !on => self.power = Power::Stopping,
            Power::Stopping if on => self.power = Power::On(now),
            Power::Stopping | Power::Reacting if self.vel == 0.0 => self.power = Power::Waiting(now),
            _ => {}
        }
        if let Power::Waiting(start) = self.power
            && now.saturating_sub(start) >= u64::from(settings.off_ms) * 1_000_000
        {
            self.power = Power::Mains;
        }
        if self.homing != Homing::No && self.homing != Homing::Done && !matches!(self.power, Power::On(_)) {
            self.homing = Homing::Failed;
        }
    }

    fn select_mode(&mut self, control: u16, table: &Table, settings: &Settings) {
        let wanted =
            if settings.old_mode_bits { control >> 11 << 2 & 4 | control >> 8 & 3 } else { control >> 8 & 7 };
        if wanted == self.mode {
            return;
        }
        self.mode = wanted;
        self.held = self.pos;
        if self.mode_code(table) == 0 && self.enabled() {
            self.no_mode = true;
            self.raise(C1D_COMMUNICATION);
        }
    }

    fn mode_code(&self, table: &Table) -> u16 {
        let blocks = [32, 33, 34, 35, 284, 285, 286, 287];
        blocks.get(usize::from(self.mode & 7)).map_or(0, |block| table.word(Idn::s(*block)))
    }

    /// The position command in revolutions of the motor.
    fn command_position(&self, table: &Table) -> f64 {
        let s = &self.scaling;
        let polarity = s.position_polarity;
        let sum = if self.mode_code(table) & 0x10 != 0 {
            real(table.signed(Idn::s(258))) * Scaling::sign(polarity, 0)
        } else {
            real(table.signed(Idn::s(47))) * Scaling::sign(polarity, 0)
                + real(table.signed(Idn::s(48))) * Scaling::sign(polarity, 1)
        };
        let target = sum / s.position - self.shift;
        if s.modulo == 0 {
            return target;
        }
        // The way to the command is never longer than half of the modulo range.
        let range = real(s.modulo) / s.position;
        let from = self.target.unwrap_or(self.pos);
        target + ((from - target) / range).round() * range
    }

    fn motion(&mut self, dt: f64, target: f64, speed: f64, table: &Table, settings: &Settings) {
        let s = self.scaling;
        let limit = real(table.signed(Idn::s(138))).abs() / s.acceleration;
        let ramp = if limit > 0.0 { limit } else { settings.max_acceleration };
        let top = f64::from(table.unsigned(Idn::s(91))) / s.velocity;
        let top = if top > 0.0 { top } else { settings.max_velocity };
        let strongest = f64::from(table.unsigned(Idn::s(92))) / s.torque;
        let strongest = if strongest > 0.0 { strongest } else { settings.stall_torque * 4.0 };
        let inertia = settings.inertia * std::f64::consts::TAU;
        let drag = settings.friction * self.vel;
        let code = self.mode_code(table);
        let wanted = if !self.enabled() {
            // Coasts.
            self.torque = 0.0;
            let slow = settings.friction / inertia * dt;
            self.vel * (1.0 - slow).max(0.0)
        } else if !self.following {
            self.stand(dt, ramp, table)
        } else {
            let code = if code & 7 == 6 || code & 7 == 7 { 0 } else { code };
            match code & 7 {
                1 => {
                    let p = s.torque_polarity;
                    let torque = real(table.signed(Idn::s(80))) * Scaling::sign(p, 0)
                        + real(table.signed(Idn::s(81))) * Scaling::sign(p, 1);
                    let torque = (torque / s.torque).clamp(-strongest, strongest);
                    self.torque = torque;
                    (self.vel + (torque - drag - settings.load_torque) / inertia * dt).clamp(-top, top)
                }
                2 => {
                    let p = s.velocity_polarity;
                    let sum = real(table.signed(Idn::s(36))) * Scaling::sign(p, 0)
                        + real(table.signed(Idn::s(37))) * Scaling::sign(p, 1);
                    approach(self.vel, (sum / s.velocity).clamp(-top, top), ramp * dt)
                }
                0 => approach(self.vel, 0.0, ramp * dt),
                _ => {
                    let (forward, top) = if code & 0x10 != 0 {
                        let own = real(table.signed(Idn::s(259))).abs() / s.velocity;
                        (0.0, if own > 0.0 { own.min(top) } else { top })
                    } else {
                        (if code & 8 != 0 { speed } else { 0.0 }, top)
                    };
                    self.follow(target, forward, dt, ramp, top, table)
                }
            }
        };
        let torque_mode = self.following && code & 7 == 1;
        let mut next = if settings.blocked { 0.0 } else { wanted };
        if self.enabled() && !torque_mode {
            let needed = (wanted - self.vel) / dt * inertia + drag + settings.load_torque;
            self.torque = needed.clamp(-strongest, strongest);
            if needed.abs() > strongest && !settings.blocked {
                next = self.vel + (self.torque - drag - settings.load_torque) / inertia * dt;
            }
        }
        self.pos += (self.vel + next) / 2.0 * dt;
        self.vel = if next.abs() < 1e-6 { 0.0 } else { next };
        self.error = if self.following && code & 7 >= 3 { target - self.pos } else { 0.0 };
    }

    /// Not following: homing, or down to standstill.
    fn stand(&mut self, dt: f64, ramp: f64, table: &Table) -> f64 {
        let Homing::Moving { mark } = self.homing else {
            return approach(self.vel, 0.0, ramp * dt);
        };
        if (mark - self.pos).abs() < 1e-6 && self.vel.abs() < 1e-3 {
            self.pos = mark;
            let reference = real(table.signed(Idn::s(52))) / self.scaling.position;
            self.shift = reference - self.pos;
            self.homing = Homing::Done;
            return 0.0;
        }
        let top = (real(table.signed(Idn::s(41))).abs() / self.scaling.velocity).max(0.1);
        self.follow(mark, 0.0, dt, ramp, top, table)
    }

    fn follow(&self, target: f64, forward: f64, dt: f64, ramp: f64, top: f64, table: &Table) -> f64 {
        let kv = f64::from(table.unsigned(Idn::s(104))) / 6.0;
        let kv = if kv > 0.0 { kv.min(500.0) } else { 100.0 };
        let way = target - self.pos;
        let braking = (2.0 * ramp * way.abs()).sqrt();
        let wanted = forward + (way * kv).clamp(-braking, braking);
        approach(self.vel, wanted.clamp(-top, top), ramp * dt)
    }

    fn watch(&mut self, table: &Table) {
        let window = table.signed(Idn::s(159));
        if window > 0 && whole((self.error * self.scaling.position).abs()) > window {
            self.raise(C1D_DEVIATION);
        }
        let polarity = self.scaling.position_polarity;
        if polarity & 0x10 != 0 && self.enabled() {
            let here = whole(self.position() * self.scaling.position * Scaling::sign(polarity, 2));
            if here > table.signed(Idn::s(49)) || here < table.signed(Idn::s(50)) {
                self.raise(C1D_LIMIT);
            }
        }
    }

    fn feedback(&self, table: &mut Table) {
        let s = &self.scaling;
        let position = self.position() * s.position * Scaling::sign(s.position_polarity, 2);
        let position = s.wrap(whole(position));
        table.set_signed(Idn::s(51), position);
        table.set_signed(Idn::s(53), position);
        let velocity = whole(self.vel * s.velocity * Scaling::sign(s.velocity_polarity, 2));
        table.set_signed(Idn::s(40), velocity);
        let torque = whole(self.torque * s.torque * Scaling::sign(s.torque_polarity, 2));
        table.set_signed(Idn::s(84), torque);
        table.set_signed(Idn::s(189), whole(self.error * s.position));
        let window = table.signed(Idn::s(124)).abs();
        let commanded = velocity - table.signed(Idn::s(36));
        let c3d = u16::from(commanded.abs() <= window) | u16::from(velocity.abs() <= window) << 1;
        table.set(Idn::s(13), &c3d.to_le_bytes());
    }
}

fn approach(from: f64, to: f64, most: f64) -> f64 {
    from + (to - from).clamp(-most, most)
}

#[cfg(test)]
#[path = "drive_tests.rs"]
mod tests;
