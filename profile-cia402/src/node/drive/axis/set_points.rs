//! Set-points of the modes of operation, braking, homing, and the limits of all of them.

use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::servo::motion::{Motion, Pace};
use profile_generic::servo::{ServoCommand, ServoControl};
use profile_generic::state::Report as ServoReport;

use super::Axis;
use crate::drive::options::{FaultReactionOption, HaltOption, QuickStopOption, Stop};
use crate::drive::period::InterpolationPeriod;
use crate::drive::{Controlword, Mode, State, index};
use crate::node::dictionary::Dictionary;
use crate::node::drive::homing::{Homing, Speeds};
use crate::node::drive::monitor::Monitor;
use crate::node::drive::probe::Passed;
use crate::node::drive::profile::Profile;
use crate::node::drive::scaling::TORQUE;

/// What stops the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Brake {
    pub stop: Stop,
    /// It stands, and holds this place, nanounits.
    pub held: Option<i64>,
}

/// The set-point of the cyclic modes on its way from one SYNC to the next.
#[derive(Debug, Clone, Copy, Default)]
struct Segment {
    /// Value of the object that it leads to.
    object: Option<i64>,
    from: i64,
    to: i64,
    passed: i64,
}

/// Where the set-points are, and what is followed.
#[derive(Debug)]
pub(super) struct Path {
    pub mode: Mode,
    pub motion: Motion,
    segment: Segment,
    /// SYNC has come since the last step.
    pub synced: bool,
    pub profile: Profile,
    /// Torque set-point, ppm.
    pub torque: i64,
    /// A limit clips the set-point.
    pub limited: bool,
    /// Set-points of the master are followed.
    pub follows: bool,
}

impl Path {
    pub fn new() -> Self {
        Self {
            mode: Mode::NONE,
            motion: Motion::default(),
            segment: Segment::default(),
            synced: false,
            profile: Profile::default(),
            torque: 0,
            limited: false,
            follows: false,
        }
    }
}

impl Axis {
    /// What the servo is told, by the state.
    pub(super) fn servo_command(&mut self, span: i64, dictionary: &mut Dictionary) -> ServoCommand {
        (self.path.follows, self.path.limited) = (false, false);
        let off = ServoCommand::default();
        let command = match self.machine.state {
            State::SwitchedOn if self.machine.enabling => {
                let position = self.actual.position;
                self.path.motion = Motion { position: position.0, velocity: 0 };
                ServoCommand { mode: OperatingMode::Position, position, ..off }
            }
            State::OperationEnabled => {
                let halts = self.machine.before.contains(Controlword::HALT) && self.wiring.remote;
                let halt = HaltOption(self.option(dictionary, index::HALT_OPTION)).stop();
                match (self.machine.leaving, halts) {
                    (Some((stop, _)), _) => self.brake(stop, span, dictionary),
                    (None, true) => self.brake(halt.unwrap_or(Stop::SlowDownRamp), span, dictionary),
                    (None, false) => {
                        if self.machine.brake.take().is_some() {
                            // The way goes on from where it was halted.
                            self.path.segment = Segment::default();
                            self.path.torque = self.actual.torque.0;
                        }
                        self.follow(span, dictionary)
                    }
                }
            }
            State::QuickStopActive => {
                let option = QuickStopOption(self.option(dictionary, index::QUICK_STOP_OPTION));
                match option.stop() {
                    None | Some(Stop::Disable) => return off,
                    Some(stop) => self.brake(stop, span, dictionary),
                }
            }
            State::FaultReactionActive => {
                let option = FaultReactionOption(self.option(dictionary, index::FAULT_REACTION_OPTION));
                let runs = matches!(self.actual.report, ServoReport::Operating | ServoReport::Halted);
                match (self.actual.fault, option.stop()) {
                    // The servo does what it must by itself.
                    (Some(_), _) => return ServoCommand { control: ServoControl::Disable, ..off },
                    (None, Some(stop)) if runs && stop != Stop::Disable => self.brake(stop, span, dictionary),
                    // A fault never gives torque to an axis that has none.
                    _ => return off,
                }
            }
            _ => return off,
        };
        ServoCommand { control: ServoControl::Enable, ..command }
    }

    /// The set-points of the mode.
    fn follow(&mut self, span: i64, dictionary: &mut Dictionary) -> ServoCommand {
        let off = ServoCommand::default();
        let number = |axis: &Self, index| axis.number(dictionary, index);
        let at = |position: i64| ServoCommand {
            mode: OperatingMode::Position,
            position: Position(position),
            ..off
        };
        match self.path.mode {
            Mode::PROFILE_POSITION => {
                self.path.profile.advance(&mut self.path.motion, span);
                at(self.path.motion.position)
            }
            Mode::HOMING if self.homing.is_active() => at(self.path.motion.position),
            Mode::CYCLIC_POSITION => {
                let offset = number(self, index::POSITION_OFFSET);
                let object = number(self, index::TARGET_POSITION).saturating_add(offset);
                let position = self.interpolate(object, span, dictionary);
                let velocity_offset = Velocity(self.scales.velocity_of(number(self, index::VELOCITY_OFFSET)));
                let torque_offset = self.torque_offset(dictionary);
                ServoCommand { velocity_offset, torque_offset, ..at(position) }
            }
            Mode::INTERPOLATED_POSITION
                if self.machine.before.contains(Controlword::ENABLE_INTERPOLATION) =>
            {
                let object = self.part(dictionary, index::INTERPOLATION_DATA, 1);
                at(self.interpolate(object, span, dictionary))
            }
            Mode::CYCLIC_VELOCITY => {
                let object = number(self, index::TARGET_VELOCITY) + number(self, index::VELOCITY_OFFSET);
                self.path.follows = true;
                let wanted = self.scales.velocity_of(object);
                let velocity = self.limited_speed(wanted, dictionary);
                self.path.motion = Motion { position: self.actual.position.0, velocity };
                let torque_offset = self.torque_offset(dictionary);
                ServoCommand {
                    mode: OperatingMode::Velocity,
                    velocity: Velocity(velocity),
                    torque_offset,
                    ..off
                }
            }
            Mode::PROFILE_VELOCITY => {
                let wanted = self.scales.velocity_of(number(self, index::TARGET_VELOCITY));
                let wanted = self.limited_speed(wanted, dictionary);
                let pace = self.pace(index::PROFILE_ACCELERATION, index::PROFILE_DECELERATION, dictionary);
                self.turn(wanted, pace, span)
            }
            Mode::VELOCITY => self.follow_speed(span, dictionary),
            Mode::CYCLIC_TORQUE => {
                self.path.follows = true;
                let wanted = number(self, index::TARGET_TORQUE) * TORQUE;
                self.path.torque = wanted + self.torque_offset(dictionary).0;
                self.push(dictionary)
            }
            Mode::TORQUE => {
                let wanted = number(self, index::TARGET_TORQUE) * TORQUE;
                let slope = number(self, index::TORQUE_SLOPE).saturating_mul(TORQUE);
                let change = (i128::from(slope) * i128::from(span) / 1_000_000_000).max(1);
                let change = i64::try_from(change).unwrap_or(i64::MAX);
                let (low, high) =
                    (self.path.torque.saturating_sub(change), self.path.torque.saturating_add(change));
                self.path.torque = wanted.clamp(low, high);
                self.push(dictionary)
            }
            // Nothing is to be followed: the axis comes to a stand and holds.
            _ => {
                let command = self.brake(Stop::SlowDownRamp, span, dictionary);
                self.path.motion.position = self.actual.position.0;
                command
            }
        }
    }

    /// Follows a velocity with a ramp.
    fn turn(&mut self, wanted: i64, pace: Pace, span: i64) -> ServoCommand {
        self.path.motion.position = self.actual.position.0;
        self.path.motion.advance(span, wanted, pace);
        let velocity = Velocity(self.path.motion.velocity);
        ServoCommand { mode: OperatingMode::Velocity, velocity, ..ServoCommand::default() }
    }

    /// Follows a torque; at the travel limits it does not push further.
    fn push(&mut self, dictionary: &Dictionary) -> ServoCommand {
        self.path.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        if self.ends_travel(self.path.torque, dictionary) {
            self.path.limited = true;
            let still = ServoCommand { mode: OperatingMode::Velocity, ..ServoCommand::default() };
            return still;
        }
        ServoCommand {
            mode: OperatingMode::Torque,
            torque: Torque(self.path.torque),
            ..ServoCommand::default()
        }
    }

    /// vl: bits 4 to 6 steer the ramp generator.
    fn follow_speed(&mut self, span: i64, dictionary: &Dictionary) -> ServoCommand {
        let bit = |flag| self.machine.before.contains(flag);
        let rates = (
            self.speed_ramp(index::VL_ACCELERATION, dictionary),
            self.speed_ramp(index::VL_DECELERATION, dictionary),
        );
        let pace = Pace { velocity: 1, acceleration: rates.0, deceleration: rates.1 };
        let wanted = match (
            bit(Controlword::ENABLE_RAMP),
            bit(Controlword::UNLOCK_RAMP),
            bit(Controlword::REFERENCE_RAMP),
        ) {
            (true, false, _) => self.path.motion.velocity,
            (true, true, true) => {
                let object = self.number(dictionary, index::VL_TARGET_VELOCITY);
                let [least, most] = [1, 2].map(|sub| self.part(dictionary, index::VL_VELOCITY_LIMITS, sub));
                let amount = object.abs().max(least).min(most.max(least));
                let amount = if object == 0 && least == 0 { 0 } else { amount };
                let sign = if object < 0 { -1 } else { 1 };
                self.scales.velocity_sign() * self.scales.speed.servo(sign * amount)
            }
            _ => 0,
        };
        let wanted = self.limited_speed(wanted, dictionary);
        self.turn(wanted, pace, span)
    }

    /// The position set-point on the way to what the object says, which it reaches after the interpolation period.
    fn interpolate(&mut self, object: i64, span: i64, dictionary: &Dictionary) -> i64 {
        let part = |sub| self.part(dictionary, index::INTERPOLATION_PERIOD, sub);
        let period = InterpolationPeriod {
            value: u8::try_from(part(1)).unwrap_or(1),
            exponent: i8::try_from(part(2)).unwrap_or(-3),
        };
        let length = period.duration().map_or(1, |length| length.0);
        if self.path.synced || self.path.segment.object != Some(object) {
            let target = self.scales.position_near(object, self.path.motion.position);
            let (target, _) = self.within_travel(target, dictionary);
            let from = self.path.motion.position;
            self.path.segment = Segment { object: Some(object), from, to: target, passed: 0 };
        }
        let asked = self.scales.position_near(object, self.path.motion.position);
        let (_, clipped) = self.within_travel(asked, dictionary);
        self.path.segment.passed = self.path.segment.passed.saturating_add(span).min(length);
        let way = i128::from(self.path.segment.to) - i128::from(self.path.segment.from);
        let gone = way * i128::from(self.path.segment.passed) / i128::from(length);
        let wanted = i128::from(self.path.segment.from) + gone;
        // No faster than the limits allow: what is beyond them becomes a following error.
        let most = i128::from(self.top_speed(dictionary)) * i128::from(span) / 1_000_000_000;
        let here = i128::from(self.path.motion.position);
        let position =
            i64::try_from(wanted.clamp(here - most, here + most)).unwrap_or(self.path.motion.position);
        let change = (i128::from(position) - here) * 1_000_000_000 / i128::from(span.max(1));
        self.path.motion = Motion { position, velocity: i64::try_from(change).unwrap_or(0) };
        self.path.limited = clipped || i128::from(position) != wanted;
        self.path.follows = !clipped;
        self.monitor.target = i64::try_from(wanted).ok();
        position
    }

    /// Set-points count from where the axis is.
    pub(super) fn begin_following(&mut self) {
        self.path.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        (self.path.segment, self.path.profile, self.homing) =
            (Segment::default(), Profile::default(), Homing::default());
        self.path.torque = self.actual.torque.0;
        self.monitor = Monitor::default();
    }

    /// What the drive does about a stop: the servo's command.
    fn brake(&mut self, stop: Stop, span: i64, dictionary: &Dictionary) -> ServoCommand {
        let stands = self.actual.status.contains(StatusBits::STANDSTILL);
        let brake = match self.machine.brake {
            Some(brake) if brake.stop == stop => brake,
            _ => {
                self.path.motion =
                    Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
                Brake { stop, held: None }
            }
        };
        let held = brake
            .held
            .or_else(|| (self.path.motion.velocity == 0 && stands).then_some(self.actual.position.0));
        self.machine.brake = Some(Brake { stop, held });
        if let Some(place) = held {
            self.path.motion = Motion { position: place, velocity: 0 };
            return ServoCommand {
                mode: OperatingMode::Position,
                position: Position(place),
                ..ServoCommand::default()
            };
        }
        let rate = match (stop, self.path.mode) {
            (Stop::SlowDownRamp, Mode::VELOCITY) => self.speed_ramp(index::VL_DECELERATION, dictionary),
            (Stop::QuickStopRamp, Mode::VELOCITY) => self.speed_ramp(index::VL_QUICK_STOP, dictionary),
            (Stop::SlowDownRamp, _) => self.rate(index::PROFILE_DECELERATION, dictionary),
            (Stop::QuickStopRamp, _) => self.rate(index::QUICK_STOP_DECELERATION, dictionary),
            // As hard as the torque allows.
            (Stop::CurrentLimit | Stop::VoltageLimit | Stop::Disable, _) => i64::MAX,
        };
        let pace = Pace { velocity: 1, acceleration: rate, deceleration: rate };
        self.path.motion.advance(span, 0, pace);
        let velocity = Velocity(self.path.motion.velocity);
        ServoCommand { mode: OperatingMode::Velocity, velocity, ..ServoCommand::default() }
    }

    /// Profile velocity and accelerations within their limits.
    pub(super) fn pace(&self, acceleration: u16, deceleration: u16, dictionary: &Dictionary) -> Pace {
        let rate = |index, limit| {
            let number = self.number(dictionary, index).min(self.number(dictionary, limit));
            self.scales.acceleration.servo(number).max(1)
        };
        let velocity = self.scales.velocity.servo(self.number(dictionary, index::PROFILE_VELOCITY));
        Pace {
            velocity: velocity.clamp(1, self.top_speed(dictionary)),
            acceleration: rate(acceleration, index::MAX_ACCELERATION),
            deceleration: rate(deceleration, index::MAX_DECELERATION),
        }
    }

    fn rate(&self, index: u16, dictionary: &Dictionary) -> i64 {
        self.scales.acceleration.servo(self.number(dictionary, index)).max(1)
    }

    /// A ramp of vl: a speed, :1, in a time, :2 in seconds.
    fn speed_ramp(&self, index: u16, dictionary: &Dictionary) -> i64 {
        let time = self.part(dictionary, index, 2).max(1);
        (self.scales.speed.servo(self.part(dictionary, index, 1)) / time).max(1)
    }

    /// The lower one of 607Fh and 6080h, and what the servo can, above 0.
    fn top_speed(&self, dictionary: &Dictionary) -> i64 {
        let profile = self.scales.velocity.servo(self.number(dictionary, index::MAX_PROFILE_VELOCITY));
        let motor = self.number(dictionary, index::MAX_MOTOR_SPEED).saturating_mul(100_000_000) / 6;
        profile.min(motor).min(self.servo.parameters().velocity_limit.0).max(1)
    }

    fn torque_offset(&self, dictionary: &Dictionary) -> Torque {
        Torque(self.number(dictionary, index::TORQUE_OFFSET) * TORQUE)
    }

    /// A velocity within the limits.
    fn limited_speed(&mut self, wanted: i64, dictionary: &Dictionary) -> i64 {
        let top = self.top_speed(dictionary);
        if self.ends_travel(wanted, dictionary) {
            self.path.limited = true;
            return 0;
        }
        let speed = wanted.clamp(-top, top);
        self.path.limited |= speed != wanted;
        speed
    }

    /// Whether going on in this direction would leave the travel.
    fn ends_travel(&self, way: i64, dictionary: &Dictionary) -> bool {
        let here = self.actual.position.0;
        self.travel(dictionary).is_some_and(|(low, high)| here >= high && way > 0 || here <= low && way < 0)
    }

    /// The travel limits 607Dh in nanounits; `None` where they are none: both alike, or the wrong way round.
    fn travel(&self, dictionary: &Dictionary) -> Option<(i64, i64)> {
        let limit = |sub| self.part(dictionary, index::SOFTWARE_LIMIT, sub);
        if limit(1) >= limit(2) || self.scales.is_modulo() {
            return None;
        }
        let [a, b] = [limit(1), limit(2)].map(|limit| self.scales.distance(limit));
        Some((a.min(b), a.max(b)))
    }

    /// A target within the travel limits, and whether they have clipped it.
    pub(super) fn within_travel(&self, target: i64, dictionary: &Dictionary) -> (i64, bool) {
        match self.travel(dictionary) {
            Some((low, high)) => (target.clamp(low, high), !(low..=high).contains(&target)),
            None => (target, false),
        }
    }

    /// One step of homing.
    pub(super) fn home(&mut self, span: i64, passed: Passed, dictionary: &mut Dictionary) {
        let able = self.machine.state == State::OperationEnabled && self.machine.leaving.is_none();
        if self.path.mode != Mode::HOMING || !self.homing.is_active() {
            return;
        }
        if !able {
            self.homing.abort();
            return;
        }
        if self.machine.brake.is_some() {
            // Halted: it goes on from there.
            return;
        }
        let speed = |sub| self.scales.velocity.servo(self.part(dictionary, index::HOMING_SPEEDS, sub));
        let top = self.top_speed(dictionary);
        let speeds = Speeds {
            fast: speed(1).min(top),
            slow: speed(2).min(top),
            acceleration: self.rate(index::HOMING_ACCELERATION, dictionary),
        };
        let senses = self.senses(passed, span);
        if let Some(home) = self.homing.advance(&mut self.path.motion, &senses, &speeds) {
            let value = self.scales.distance(self.number(dictionary, index::HOME_OFFSET));
            self.displace(value.saturating_sub(home));
        }
    }

    /// The place of the axis gets a position that is `shift` nanounits more.
    fn displace(&mut self, shift: i64) {
        let moved = |position: Position| Position(position.0.saturating_add(shift));
        self.servo.set_position(moved(self.servo.position()));
        self.actual.position = moved(self.actual.position);
        self.path.motion.position = self.path.motion.position.saturating_add(shift);
        self.wiring.limit_switches = self.wiring.limit_switches.map(moved);
        self.path.profile.shift(shift);
        self.path.segment = Segment::default();
    }
}
