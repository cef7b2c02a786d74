//! One axis: the state machine, the modes of operation, and the servo behind them.

use arrayvec::ArrayVec;
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::servo::motion::{Motion, Pace};
use profile_generic::servo::{Servo, ServoActual, ServoCommand, ServoControl, ServoError, ServoParameters};
use profile_generic::state::Report as ServoReport;
use profile_generic::time::DurationNs;

use super::faults;
use super::homing::{Homing, Senses, Speeds};
use super::monitor::Monitor;
use super::objects::{FAULT_INJECTION, FEED_FORWARD, MODES};
use super::probe::{Passed, Probes};
use super::profile::{Profile, SetPoint};
use super::scaling::{Scales, TORQUE};
use crate::drive::controlword::Command;
use crate::drive::homing::Method;
use crate::drive::options::{
    AbortConnectionOption, DisableOption, FaultReactionOption, HaltOption, QuickStopOption, ShutdownOption,
    Stop,
};
use crate::drive::period::InterpolationPeriod;
use crate::drive::states::transition;
use crate::drive::{Controlword, ErrorCode, Mode, State, Statusword, index};
use crate::node::application::{Event, Report};
use crate::node::dictionary::Dictionary;

/// From power-on to *switch on disabled*.
pub const BOOT_TIME: DurationNs = DurationNs::from_millis(20);

/// Reports that wait to be taken; a step makes two at most.
const REPORTS_MAX: usize = 8;

/// Part of the overload model, ppm, from which the drive warns.
const OVERLOAD_WARNING_PPM: i64 = 900_000;

/// Distance of the motor temperature to its limit from which the drive warns.
const TEMPERATURE_MARGIN_MILLIDEGREE: i64 = 10_000;

/// What stops the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Brake {
    stop: Stop,
    /// It stands, and holds this place, nanounits.
    held: Option<i64>,
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

/// An axis.
#[derive(Debug)]
pub struct Axis {
    /// Of its objects.
    offset: u16,
    /// In EMCY.
    source: u8,
    servo: Servo,
    actual: ServoActual,
    scales: Scales,
    state: State,
    /// Time in *not ready to switch on*.
    booting: DurationNs,
    /// Transition 4 has begun; the torque builds up.
    enabling: bool,
    /// Transition 5 or 8 has begun: the axis brakes before it.
    leaving: Option<(Stop, State)>,
    brake: Option<Brake>,
    before: Controlword,
    mode: Mode,
    motion: Motion,
    segment: Segment,
    /// SYNC has come since the last step.
    synced: bool,
    profile: Profile,
    homing: Homing,
    probes: Probes,
    pub(super) monitor: Monitor,
    /// Torque set-point, ppm.
    torque: i64,
    /// A limit clips the set-point.
    limited: bool,
    /// Set-points of the master are followed.
    follows: bool,
    fault: Option<ErrorCode>,
    /// It leaves Fault by itself.
    recovering: bool,
    /// Bits of the statusword that stay as they are, and how.
    held_bits: (Statusword, Statusword),
    reports: ArrayVec<Report, REPORTS_MAX>,
    main_power: bool,
    remote: bool,
    limit_switches: [Position; 2],
    /// It tells its limit switches, and does nothing about them.
    ignores_limit_switches: bool,
}

impl Axis {
    /// Axis `number`, from 0, with this servo.
    ///
    /// # Errors
    /// As [`Servo::new`].
    pub fn new(number: u8, parameters: ServoParameters) -> Result<Self, ServoError> {
        // What a drive watches itself stands in its objects.
        let parameters = ServoParameters { position_error_tolerance: Position::ZERO, ..parameters };
        let mut servo = Servo::new(parameters)?;
        let probes = Probes::new(&mut servo);
        Ok(Self {
            offset: u16::from(number) * index::AXIS_OFFSET,
            source: number + 1,
            servo,
            probes,
            actual: ServoActual::default(),
            scales: Scales::preset(),
            state: State::NotReadyToSwitchOn,
            booting: DurationNs::ZERO,
            enabling: false,
            leaving: None,
            brake: None,
            before: Controlword::empty(),
            mode: Mode::NONE,
            motion: Motion::default(),
            segment: Segment::default(),
            synced: false,
            profile: Profile::default(),
            homing: Homing::default(),
            monitor: Monitor::default(),
            torque: 0,
            limited: false,
            follows: false,
            fault: None,
            recovering: false,
            held_bits: (Statusword::empty(), Statusword::empty()),
            reports: ArrayVec::new(),
            main_power: true,
            remote: true,
            limit_switches: [Position(i64::MIN), Position(i64::MAX)],
            ignores_limit_switches: false,
        })
    }

    /// The servo, to look at it.
    pub fn servo(&self) -> &Servo {
        &self.servo
    }

    /// The servo, to load it, to move its switches, to place it.
    pub fn servo_mut(&mut self) -> &mut Servo {
        &mut self.servo
    }

    /// What the servo did in the last step.
    pub fn actual(&self) -> &ServoActual {
        &self.actual
    }

    /// Its state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Switches main power.
    pub fn set_main_power(&mut self, on: bool) {
        self.main_power = on;
    }

    /// Whether the controlword is obeyed: bit 9 of the statusword.
    pub fn set_remote(&mut self, remote: bool) {
        self.remote = remote;
    }

    /// Holds bits of the statusword at a value whatever the drive does, as makers do who use them for something else.
    pub fn hold_status_bits(&mut self, bits: Statusword, value: Statusword) {
        self.held_bits = (bits, value.intersection(bits));
    }

    /// Sets where the limit switches close, in positions of the servo: one at and below, the other at and above its place.
    pub fn set_limit_switches(&mut self, lower: Position, upper: Position) {
        self.limit_switches = [lower, upper];
    }

    /// Whether the drive leaves it to its master to stop the axis at a limit switch.
    pub fn set_ignores_limit_switches(&mut self, ignores: bool) {
        self.ignores_limit_switches = ignores;
    }

    /// Raises a fault, as writing its code to 2FFFh:1 does. One that comes while another one is present is not told.
    pub fn raise_fault(&mut self, code: ErrorCode, dictionary: &mut Dictionary) {
        if code == ErrorCode::NO_ERROR || matches!(self.state, State::FaultReactionActive | State::Fault) {
            return;
        }
        self.fault = Some(code);
        self.report(code, true);
        (self.enabling, self.leaving, self.brake) = (false, None, None);
        self.homing.abort();
        self.state = State::FaultReactionActive;
        self.set(dictionary, index::ERROR_CODE, i64::from(code.0));
    }

    /// Takes the next report.
    pub(super) fn poll_report(&mut self) -> Option<Report> {
        (!self.reports.is_empty()).then(|| self.reports.remove(0))
    }

    fn report(&mut self, code: ErrorCode, active: bool) {
        if self.reports.is_full() {
            self.reports.remove(0);
        }
        self.reports.push(Report { code, source: self.source, active });
    }

    fn number(&self, dictionary: &Dictionary, index: u16) -> i64 {
        dictionary.number(index + self.offset, 0)
    }

    fn part(&self, dictionary: &Dictionary, index: u16, sub: u8) -> i64 {
        dictionary.number(index + self.offset, sub)
    }

    fn set(&self, dictionary: &mut Dictionary, index: u16, number: i64) {
        dictionary.set(index + self.offset, 0, number);
    }

    fn option(&self, dictionary: &Dictionary, index: u16) -> i16 {
        i16::try_from(self.number(dictionary, index)).unwrap_or(0)
    }

    /// Takes scaling and limits over.
    pub(super) fn adopt(&mut self, dictionary: &Dictionary) {
        // What makes no scale keeps the one before it; `Device::check` refuses it.
        self.scales = Scales::read(dictionary, self.offset).unwrap_or(self.scales);
        let torque = [
            index::MAX_TORQUE,
            index::MAX_CURRENT,
            index::POSITIVE_TORQUE_LIMIT,
            index::NEGATIVE_TORQUE_LIMIT,
        ];
        let torque = torque.into_iter().map(|index| self.number(dictionary, index)).min().unwrap_or(1).max(1);
        let quick = self.scales.acceleration.servo(self.number(dictionary, index::QUICK_STOP_DECELERATION));
        let window = self.scales.position.servo(self.number(dictionary, index::POSITION_WINDOW));
        let parameters = ServoParameters {
            torque_limit: Torque(torque * TORQUE),
            deceleration_limit: Acceleration(quick.max(1)),
            in_position_window: Position(window.max(1)),
            velocity_feed_forward: self.number(dictionary, FEED_FORWARD) * 1_000,
            ..*self.servo.parameters()
        };
        if parameters != *self.servo.parameters() {
            // All of these fit any servo that works.
            let _ = self.servo.set_parameters(parameters);
        }
    }

    /// The device starts anew.
    fn reset(&mut self, dictionary: &mut Dictionary) {
        (self.state, self.booting) = (State::NotReadyToSwitchOn, DurationNs::ZERO);
        (self.enabling, self.leaving, self.brake, self.fault) = (false, None, None, None);
        (self.before, self.mode) = (Controlword::empty(), Mode::NONE);
        (self.profile, self.homing) = (Profile::default(), Homing::default());
        self.adopt(dictionary);
        self.acknowledge();
    }

    /// Resets what the servo has latched; whether that could be.
    fn acknowledge(&mut self) -> bool {
        let command = ServoCommand { power: self.main_power, reset_fault: true, ..ServoCommand::default() };
        self.actual = self.servo.step(1, &command);
        self.actual.fault.is_none()
    }

    /// Out of Fault, to Switch on disabled.
    fn leave_fault(&mut self, dictionary: &mut Dictionary) {
        self.recovering = false;
        self.disable();
        if let Some(code) = self.fault.take() {
            self.report(code, false);
        }
        self.set(dictionary, index::ERROR_CODE, 0);
    }

    /// Ends a fault of the servo, as in a drive that resets itself: it leaves Fault when the reaction to it has ended.
    pub fn recover(&mut self, cause: FaultCause) {
        self.servo.recover(cause);
        self.recovering = true;
    }

    /// Something happens to the communication.
    pub(super) fn event(&mut self, event: Event, dictionary: &mut Dictionary) {
        let runs = self.enabling || matches!(self.state, State::OperationEnabled | State::QuickStopActive);
        match event {
            Event::Reset => self.reset(dictionary),
            Event::Sync => self.synced = true,
            Event::SyncLost if runs && self.mode.is_cyclic() => {
                self.raise_fault(ErrorCode::SYNC_CONTROLLER, dictionary);
            }
            Event::ConnectionLost if runs => {
                match AbortConnectionOption(self.option(dictionary, index::ABORT_CONNECTION_OPTION)) {
                    AbortConnectionOption::NONE => {}
                    AbortConnectionOption::DISABLE_VOLTAGE => self.disable(),
                    AbortConnectionOption::QUICK_STOP if self.state == State::OperationEnabled => {
                        self.quick_stop()
                    }
                    AbortConnectionOption::QUICK_STOP if self.enabling => self.disable(),
                    AbortConnectionOption::QUICK_STOP => {}
                    _ => self.raise_fault(ErrorCode::COMMUNICATION_MODULE, dictionary),
                }
            }
            Event::SyncLost | Event::ConnectionLost => {}
        }
        self.show_status(dictionary);
    }

    fn disable(&mut self) {
        self.state = State::SwitchOnDisabled;
        (self.enabling, self.leaving, self.brake) = (false, None, None);
    }

    fn quick_stop(&mut self) {
        self.state = State::QuickStopActive;
        (self.leaving, self.brake) = (None, None);
    }

    /// Takes controlword, mode and touch probe function. No time passes.
    pub(super) fn command(&mut self, dictionary: &mut Dictionary) {
        let injected = u16::try_from(self.part(dictionary, FAULT_INJECTION, 1)).unwrap_or_default();
        if injected != 0 {
            dictionary.set(FAULT_INJECTION + self.offset, 1, 0);
            self.raise_fault(ErrorCode(injected), dictionary);
        }
        self.probes.command(self.offset, dictionary);
        self.select_mode(dictionary);
        if self.remote {
            self.obey(dictionary);
        }
        self.show_status(dictionary);
    }

    fn select_mode(&mut self, dictionary: &mut Dictionary) {
        let wanted = Mode(i8::try_from(self.number(dictionary, index::MODE)).unwrap_or_default());
        // A mode that came by PDO and is not supported changes nothing; by SDO it is refused.
        if wanted != self.mode && MODES.has(wanted) {
            self.mode = wanted;
            self.begin_following();
            self.set(dictionary, index::MODE_DISPLAY, i64::from(wanted.0));
        }
    }

    /// Set-points count from where the axis is.
    fn begin_following(&mut self) {
        self.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        (self.segment, self.profile, self.homing) =
            (Segment::default(), Profile::default(), Homing::default());
        self.torque = self.actual.torque.0;
        self.monitor = Monitor::default();
    }

    fn obey(&mut self, dictionary: &mut Dictionary) {
        let word = u16::try_from(self.number(dictionary, index::CONTROLWORD)).unwrap_or_default();
        let word = Controlword::from_bits_retain(word);
        let before = core::mem::replace(&mut self.before, word);
        if self.enabling && Command::decode(word) != Some(Command::EnableOperation) {
            self.enabling = false;
        }
        let holds = QuickStopOption(self.option(dictionary, index::QUICK_STOP_OPTION)).holds();
        if let Some(taken) = transition(self.state, word, before, holds) {
            self.take(taken.number(), dictionary);
        }
        if self.state == State::OperationEnabled {
            let rises = word.contains(Controlword::MODE_4) && !before.contains(Controlword::MODE_4);
            self.obey_mode(word, rises, dictionary);
        }
    }

    fn take(&mut self, number: u8, dictionary: &mut Dictionary) {
        let charged = self.actual.status.contains(StatusBits::POWER);
        let leave = |stop: Option<Stop>, to| match stop {
            None | Some(Stop::Disable) => (to, None),
            Some(stop) => (State::OperationEnabled, Some((stop, to))),
        };
        match number {
            2 | 6 => self.state = State::ReadyToSwitchOn,
            // Without voltage there is nothing to switch on.
            3 if charged => self.state = State::SwitchedOn,
            4 if !self.enabling => {
                self.enabling = true;
                self.begin_following();
                self.motion.velocity = 0;
            }
            5 => {
                let stop = DisableOption(self.option(dictionary, index::DISABLE_OPTION)).stop();
                (self.state, self.leaving) = leave(stop, State::SwitchedOn);
            }
            8 => {
                let stop = ShutdownOption(self.option(dictionary, index::SHUTDOWN_OPTION)).stop();
                (self.state, self.leaving) = leave(stop, State::ReadyToSwitchOn);
            }
            7 | 9 | 10 | 12 => self.disable(),
            11 => self.quick_stop(),
            15 if self.acknowledge() => self.leave_fault(dictionary),
            16 => {
                self.state = State::OperationEnabled;
                self.brake = None;
                self.begin_following();
            }
            _ => {}
        }
    }

    /// Bits 4 to 6 and 9, while operation is enabled.
    fn obey_mode(&mut self, word: Controlword, rises: bool, dictionary: &Dictionary) {
        match self.mode {
            Mode::PROFILE_POSITION if rises && self.leaving.is_none() => {
                let object = self.number(dictionary, index::TARGET_POSITION);
                let target = if word.contains(Controlword::RELATIVE) {
                    let from = self.profile.last_target().unwrap_or(self.motion.position);
                    from.saturating_add(self.scales.distance(object))
                } else {
                    self.scales.position_near(object, self.motion.position)
                };
                let (target, _) = self.within_travel(target, dictionary);
                let point = SetPoint {
                    target,
                    pace: self.pace(index::PROFILE_ACCELERATION, index::PROFILE_DECELERATION, dictionary),
                    blends: word.contains(Controlword::CHANGE_ON_SET_POINT),
                };
                self.profile.offer(point, word.contains(Controlword::CHANGE_IMMEDIATELY));
            }
            Mode::PROFILE_POSITION if !word.contains(Controlword::NEW_SET_POINT) => self.profile.release(),
            Mode::HOMING if rises && self.leaving.is_none() => {
                let method = Method(i8::try_from(self.number(dictionary, index::HOMING_METHOD)).unwrap_or(0));
                self.homing.start(method.plan(), &self.senses(Passed::default(), 0));
            }
            Mode::HOMING if !word.contains(Controlword::START_HOMING) => self.homing.stop(),
            _ => {}
        }
    }

    /// Profile velocity and accelerations within their limits.
    fn pace(&self, acceleration: u16, deceleration: u16, dictionary: &Dictionary) -> Pace {
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

    /// The lower one of 607Fh and 6080h, and what the servo can, above 0.
    fn top_speed(&self, dictionary: &Dictionary) -> i64 {
        let profile = self.scales.velocity.servo(self.number(dictionary, index::MAX_PROFILE_VELOCITY));
        let motor = self.number(dictionary, index::MAX_MOTOR_SPEED).saturating_mul(100_000_000) / 6;
        profile.min(motor).min(self.servo.parameters().velocity_limit.0).max(1)
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
    fn within_travel(&self, target: i64, dictionary: &Dictionary) -> (i64, bool) {
        match self.travel(dictionary) {
            Some((low, high)) => (target.clamp(low, high), !(low..=high).contains(&target)),
            None => (target, false),
        }
    }

    /// What the drive does about a stop: the servo's command.
    fn brake(&mut self, stop: Stop, span: i64, dictionary: &Dictionary) -> ServoCommand {
        let stands = self.actual.status.contains(StatusBits::STANDSTILL);
        let brake = match self.brake {
            Some(brake) if brake.stop == stop => brake,
            _ => {
                self.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
                Brake { stop, held: None }
            }
        };
        let held =
            brake.held.or_else(|| (self.motion.velocity == 0 && stands).then_some(self.actual.position.0));
        self.brake = Some(Brake { stop, held });
        if let Some(place) = held {
            self.motion = Motion { position: place, velocity: 0 };
            return ServoCommand {
                mode: OperatingMode::Position,
                position: Position(place),
                ..ServoCommand::default()
            };
        }
        let rate = match (stop, self.mode) {
            (Stop::SlowDownRamp, Mode::VELOCITY) => self.speed_ramp(index::VL_DECELERATION, dictionary),
            (Stop::QuickStopRamp, Mode::VELOCITY) => self.speed_ramp(index::VL_QUICK_STOP, dictionary),
            (Stop::SlowDownRamp, _) => self.rate(index::PROFILE_DECELERATION, dictionary),
            (Stop::QuickStopRamp, _) => self.rate(index::QUICK_STOP_DECELERATION, dictionary),
            // As hard as the torque allows.
            (Stop::CurrentLimit | Stop::VoltageLimit | Stop::Disable, _) => i64::MAX,
        };
        let pace = Pace { velocity: 1, acceleration: rate, deceleration: rate };
        self.motion.advance(span, 0, pace);
        let velocity = Velocity(self.motion.velocity);
        ServoCommand { mode: OperatingMode::Velocity, velocity, ..ServoCommand::default() }
    }

    fn rate(&self, index: u16, dictionary: &Dictionary) -> i64 {
        self.scales.acceleration.servo(self.number(dictionary, index)).max(1)
    }

    /// A ramp of vl: a speed, :1, in a time, :2 in seconds.
    fn speed_ramp(&self, index: u16, dictionary: &Dictionary) -> i64 {
        let time = self.part(dictionary, index, 2).max(1);
        (self.scales.speed.servo(self.part(dictionary, index, 1)) / time).max(1)
    }

    fn stands_braked(&self) -> bool {
        self.brake.is_some_and(|brake| brake.held.is_some())
    }

    /// Time passes.
    pub(super) fn step(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary) {
        if self.state == State::NotReadyToSwitchOn {
            self.booting = self.booting + elapsed;
            if self.booting >= BOOT_TIME {
                self.state = State::SwitchOnDisabled;
            }
        }
        self.command(dictionary);
        let command = self.servo_command(elapsed.0, dictionary);
        self.synced = false;
        self.actual = self.servo.step(elapsed.0, &ServoCommand { power: self.main_power, ..command });
        self.proceed(dictionary);
        let passed = self.probes.collect(&mut self.servo, &self.scales, self.offset, dictionary);
        self.home(elapsed.0, passed, dictionary);
        self.supervise(elapsed, dictionary);
        self.publish(dictionary);
    }

    /// What the servo is told, by the state.
    fn servo_command(&mut self, span: i64, dictionary: &mut Dictionary) -> ServoCommand {
        (self.follows, self.limited) = (false, false);
        let off = ServoCommand::default();
        let command = match self.state {
            State::SwitchedOn if self.enabling => {
                let position = self.actual.position;
                self.motion = Motion { position: position.0, velocity: 0 };
                ServoCommand { mode: OperatingMode::Position, position, ..off }
            }
            State::OperationEnabled => {
                let halts = self.before.contains(Controlword::HALT) && self.remote;
                let halt = HaltOption(self.option(dictionary, index::HALT_OPTION)).stop();
                match (self.leaving, halts) {
                    (Some((stop, _)), _) => self.brake(stop, span, dictionary),
                    (None, true) => self.brake(halt.unwrap_or(Stop::SlowDownRamp), span, dictionary),
                    (None, false) => {
                        if self.brake.take().is_some() {
                            // The way goes on from where it was halted.
                            self.segment = Segment::default();
                            self.torque = self.actual.torque.0;
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
        match self.mode {
            Mode::PROFILE_POSITION => {
                self.profile.advance(&mut self.motion, span);
                at(self.motion.position)
            }
            Mode::HOMING if self.homing.is_active() => at(self.motion.position),
            Mode::CYCLIC_POSITION => {
                let offset = number(self, index::POSITION_OFFSET);
                let object = number(self, index::TARGET_POSITION).saturating_add(offset);
                let position = self.interpolate(object, span, dictionary);
                let velocity_offset = Velocity(self.scales.velocity_of(number(self, index::VELOCITY_OFFSET)));
                let torque_offset = self.torque_offset(dictionary);
                ServoCommand { velocity_offset, torque_offset, ..at(position) }
            }
            Mode::INTERPOLATED_POSITION if self.before.contains(Controlword::ENABLE_INTERPOLATION) => {
                let object = self.part(dictionary, index::INTERPOLATION_DATA, 1);
                at(self.interpolate(object, span, dictionary))
            }
            Mode::CYCLIC_VELOCITY => {
                let object = number(self, index::TARGET_VELOCITY) + number(self, index::VELOCITY_OFFSET);
                self.follows = true;
                let wanted = self.scales.velocity_of(object);
                let velocity = self.limited_speed(wanted, dictionary);
                self.motion = Motion { position: self.actual.position.0, velocity };
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
                self.follows = true;
                let wanted = number(self, index::TARGET_TORQUE) * TORQUE;
                self.torque = wanted + self.torque_offset(dictionary).0;
                self.push(dictionary)
            }
            Mode::TORQUE => {
                let wanted = number(self, index::TARGET_TORQUE) * TORQUE;
                let slope = number(self, index::TORQUE_SLOPE).saturating_mul(TORQUE);
                let change = (i128::from(slope) * i128::from(span) / 1_000_000_000).max(1);
                let change = i64::try_from(change).unwrap_or(i64::MAX);
                let (low, high) = (self.torque.saturating_sub(change), self.torque.saturating_add(change));
                self.torque = wanted.clamp(low, high);
                self.push(dictionary)
            }
            // Nothing is to be followed: the axis comes to a stand and holds.
            _ => {
                let command = self.brake(Stop::SlowDownRamp, span, dictionary);
                self.motion.position = self.actual.position.0;
                command
            }
        }
    }

    /// Follows a velocity with a ramp.
    fn turn(&mut self, wanted: i64, pace: Pace, span: i64) -> ServoCommand {
        self.motion.position = self.actual.position.0;
        self.motion.advance(span, wanted, pace);
        let velocity = Velocity(self.motion.velocity);
        ServoCommand { mode: OperatingMode::Velocity, velocity, ..ServoCommand::default() }
    }

    /// Follows a torque; at the travel limits it does not push further.
    fn push(&mut self, dictionary: &Dictionary) -> ServoCommand {
        self.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        if self.ends_travel(self.torque, dictionary) {
            self.limited = true;
            let still = ServoCommand { mode: OperatingMode::Velocity, ..ServoCommand::default() };
            return still;
        }
        ServoCommand { mode: OperatingMode::Torque, torque: Torque(self.torque), ..ServoCommand::default() }
    }

    /// vl: bits 4 to 6 steer the ramp generator.
    fn follow_speed(&mut self, span: i64, dictionary: &Dictionary) -> ServoCommand {
        let bit = |flag| self.before.contains(flag);
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
            (true, false, _) => self.motion.velocity,
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

    fn torque_offset(&self, dictionary: &Dictionary) -> Torque {
        Torque(self.number(dictionary, index::TORQUE_OFFSET) * TORQUE)
    }

    /// Whether going on in this direction would leave the travel.
    fn ends_travel(&self, way: i64, dictionary: &Dictionary) -> bool {
        let here = self.actual.position.0;
        self.travel(dictionary).is_some_and(|(low, high)| here >= high && way > 0 || here <= low && way < 0)
    }

    /// A velocity within the limits.
    fn limited_speed(&mut self, wanted: i64, dictionary: &Dictionary) -> i64 {
        let top = self.top_speed(dictionary);
        if self.ends_travel(wanted, dictionary) {
            self.limited = true;
            return 0;
        }
        let speed = wanted.clamp(-top, top);
        self.limited |= speed != wanted;
        speed
    }

    /// The position set-point on the way to what the object says, which it reaches after the interpolation period.
    fn interpolate(&mut self, object: i64, span: i64, dictionary: &Dictionary) -> i64 {
        let part = |sub| self.part(dictionary, index::INTERPOLATION_PERIOD, sub);
        let period = InterpolationPeriod {
            value: u8::try_from(part(1)).unwrap_or(1),
            exponent: i8::try_from(part(2)).unwrap_or(-3),
        };
        let length = period.duration().map_or(1, |length| length.0);
        if self.synced || self.segment.object != Some(object) {
            let target = self.scales.position_near(object, self.motion.position);
            let (target, _) = self.within_travel(target, dictionary);
            let from = self.motion.position;
            self.segment = Segment { object: Some(object), from, to: target, passed: 0 };
        }
        let asked = self.scales.position_near(object, self.motion.position);
        let (_, clipped) = self.within_travel(asked, dictionary);
        self.segment.passed = self.segment.passed.saturating_add(span).min(length);
        let way = i128::from(self.segment.to) - i128::from(self.segment.from);
        let gone = way * i128::from(self.segment.passed) / i128::from(length);
        let wanted = i128::from(self.segment.from) + gone;
        // No faster than the limits allow: what is beyond them becomes a following error.
        let most = i128::from(self.top_speed(dictionary)) * i128::from(span) / 1_000_000_000;
        let here = i128::from(self.motion.position);
        let position = i64::try_from(wanted.clamp(here - most, here + most)).unwrap_or(self.motion.position);
        let change = (i128::from(position) - here) * 1_000_000_000 / i128::from(span.max(1));
        self.motion = Motion { position, velocity: i64::try_from(change).unwrap_or(0) };
        self.limited = clipped || i128::from(position) != wanted;
        self.follows = !clipped;
        self.monitor.target = i64::try_from(wanted).ok();
        position
    }

    /// Transitions that the drive makes by itself.
    fn proceed(&mut self, dictionary: &mut Dictionary) {
        let off = matches!(
            self.actual.report,
            ServoReport::Ready | ServoReport::Faulted | ServoReport::AwaitingPower
        );
        if let Some(cause) = self.actual.fault {
            self.raise_fault(faults::code_of(cause), dictionary);
        }
        match self.state {
            State::SwitchedOn if self.enabling && self.actual.report == ServoReport::Operating => {
                self.enabling = false;
                self.begin_following();
                self.motion.velocity = 0;
                self.state = State::OperationEnabled;
            }
            State::OperationEnabled => {
                if let Some((_, to)) = self.leaving.filter(|_| self.stands_braked()) {
                    (self.leaving, self.brake, self.state) = (None, None, to);
                }
            }
            State::QuickStopActive => {
                let holds = QuickStopOption(self.option(dictionary, index::QUICK_STOP_OPTION)).holds();
                if off || !holds && self.stands_braked() {
                    self.disable();
                }
            }
            State::FaultReactionActive if off || self.stands_braked() => {
                self.brake = None;
                self.state = State::Fault;
            }
            State::Fault if self.recovering && self.actual.fault.is_none() => self.leave_fault(dictionary),
            _ => {}
        }
    }

    fn senses(&self, passed: Passed, span: i64) -> Senses {
        let here = self.actual.position;
        let [negative, positive] = self.limit_switches;
        let window = self.servo.parameters().standstill_window.0;
        let velocity = self.actual.velocity.0;
        // 607Eh turns what positions and velocities are told as. Switches stay where they are, and homing looks for them there.
        Senses {
            limits: [here <= negative, here >= positive],
            limit_places: [negative.0, positive.0],
            home: self.actual.digital_inputs & profile_generic::servo::input::HOME_SWITCH != 0,
            passed,
            moves: if velocity.abs() <= window { 0 } else { velocity.signum() },
            span,
        }
    }

    /// One step of homing.
    fn home(&mut self, span: i64, passed: Passed, dictionary: &mut Dictionary) {
        let able = self.state == State::OperationEnabled && self.leaving.is_none();
        if self.mode != Mode::HOMING || !self.homing.is_active() {
            return;
        }
        if !able {
            self.homing.abort();
            return;
        }
        if self.brake.is_some() {
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
        if let Some(home) = self.homing.advance(&mut self.motion, &senses, &speeds) {
            let value = self.scales.distance(self.number(dictionary, index::HOME_OFFSET));
            self.displace(value.saturating_sub(home));
        }
    }

    /// The place of the axis gets a position that is `shift` nanounits more.
    fn displace(&mut self, shift: i64) {
        let moved = |position: Position| Position(position.0.saturating_add(shift));
        self.servo.set_position(moved(self.servo.position()));
        self.actual.position = moved(self.actual.position);
        self.motion.position = self.motion.position.saturating_add(shift);
        self.limit_switches = self.limit_switches.map(moved);
        self.profile.shift(shift);
        self.segment = Segment::default();
    }

    /// Following error, limit switches, windows.
    fn supervise(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary) {
        let enabled = self.state == State::OperationEnabled;
        let leads = matches!(
            self.mode,
            Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION | Mode::INTERPOLATED_POSITION | Mode::HOMING
        );
        let demand = self.monitor.target.take().unwrap_or(self.motion.position);
        let error = if enabled && leads && self.brake.is_none() {
            demand.saturating_sub(self.actual.position.0)
        } else {
            0
        };
        let number = |axis: &Self, index| axis.number(dictionary, index);
        let window = number(self, index::FOLLOWING_WINDOW);
        let beyond =
            window != i64::from(u32::MAX) && self.scales.position.counts(error).saturating_abs() > window;
        let time_out = DurationNs::from_millis(number(self, index::FOLLOWING_TIME_OUT));
        let lost = self.monitor.following(beyond, elapsed, time_out);
        self.monitor.error = error;
        if lost {
            self.raise_fault(ErrorCode::FOLLOWING_ERROR, dictionary);
        }
        let senses = self.senses(Passed::default(), 0);
        let into = senses.limits[0] && senses.moves < 0 || senses.limits[1] && senses.moves > 0;
        if enabled && into && self.mode != Mode::HOMING && !self.ignores_limit_switches {
            self.raise_fault(ErrorCode::REFERENCE_LIMIT, dictionary);
        }
        self.watch_windows(elapsed, dictionary);
    }

    /// Windows for bits 10 and 12.
    fn watch_windows(&mut self, elapsed: DurationNs, dictionary: &Dictionary) {
        let number = |index| self.number(dictionary, index);
        let time = |index| DurationNs::from_millis(number(index));
        let speed = self.actual.velocity.0;
        let counts = |servo: i64| self.scales.velocity.counts(servo).saturating_abs();
        let wanted = self.scales.velocity_of(number(index::TARGET_VELOCITY));
        let (inside, needed) = match self.mode {
            Mode::PROFILE_POSITION => {
                let error = self.scales.position.counts(self.motion.position - self.actual.position.0);
                let near = error.abs() <= number(index::POSITION_WINDOW);
                (self.profile.has_arrived() && near, time(index::POSITION_WINDOW_TIME))
            }
            Mode::PROFILE_VELOCITY => {
                let near = counts(wanted.saturating_sub(speed)) <= number(index::VELOCITY_WINDOW);
                (near, time(index::VELOCITY_WINDOW_TIME))
            }
            Mode::TORQUE => (self.torque == number(index::TARGET_TORQUE) * TORQUE, DurationNs::ZERO),
            Mode::VELOCITY => {
                let object = self.scales.speed.counts(self.motion.velocity) * self.scales.velocity_sign();
                (object == number(index::VL_TARGET_VELOCITY), DurationNs::ZERO)
            }
            _ => (false, DurationNs::ZERO),
        };
        let slow = counts(speed) <= number(index::VELOCITY_THRESHOLD);
        let slow_time = time(index::VELOCITY_THRESHOLD_TIME);
        self.monitor.reached(inside, elapsed, needed);
        self.monitor.standing(slow, elapsed, slow_time);
    }

    /// The statusword.
    fn show_status(&self, dictionary: &mut Dictionary) {
        let (held, value) = self.held_bits;
        let word = self.status().difference(held).union(value);
        self.set(dictionary, index::STATUSWORD, i64::from(word.bits()));
    }

    fn status(&self) -> Statusword {
        let mut word = Statusword::empty().with_state(self.state);
        let parameters = self.servo.parameters();
        let hot = self.actual.temperature.0 > parameters.max_temperature.0 - TEMPERATURE_MARGIN_MILLIDEGREE;
        let warns = hot || self.actual.overload > OVERLOAD_WARNING_PPM || self.actual.warning.is_some();
        word.set(Statusword::WARNING, warns);
        word.set(Statusword::VOLTAGE_ENABLED, self.actual.status.contains(StatusBits::POWER));
        word.set(Statusword::REMOTE, self.remote);
        let enabled = self.state == State::OperationEnabled;
        let limits = StatusBits::VELOCITY_LIMIT | StatusBits::TORQUE_LIMIT;
        word.set(
            Statusword::INTERNAL_LIMIT,
            enabled && (self.limited || self.actual.status.intersects(limits)),
        );
        let stops = self.brake.is_some() && (self.before.contains(Controlword::HALT) || !enabled);
        if !enabled {
            word.set(
                Statusword::TARGET_REACHED,
                self.state == State::QuickStopActive && self.stands_braked(),
            );
            return word;
        }
        match self.mode {
            Mode::PROFILE_POSITION => {
                word.set(Statusword::TARGET_REACHED, self.monitor.has_reached);
                word.set(Statusword::SET_POINT_ACKNOWLEDGE, self.profile.acknowledges());
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::PROFILE_VELOCITY => {
                word.set(Statusword::TARGET_REACHED, self.monitor.has_reached);
                word.set(Statusword::SPEED_ZERO, self.monitor.stands);
            }
            Mode::VELOCITY | Mode::TORQUE => word.set(Statusword::TARGET_REACHED, self.monitor.has_reached),
            Mode::HOMING => word |= self.homing.progress().bits(),
            Mode::INTERPOLATED_POSITION => {
                word.set(Statusword::INTERPOLATION_ACTIVE, self.follows);
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::CYCLIC_POSITION => {
                word.set(Statusword::FOLLOWS_COMMAND, self.follows);
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::CYCLIC_VELOCITY | Mode::CYCLIC_TORQUE => {
                word.set(Statusword::FOLLOWS_COMMAND, self.follows)
            }
            _ => {}
        }
        if stops && self.mode != Mode::HOMING {
            word.set(Statusword::TARGET_REACHED, self.stands_braked());
        }
        word
    }

    /// Actual values, and the statusword.
    fn publish(&self, dictionary: &mut Dictionary) {
        let actual = &self.actual;
        let scales = &self.scales;
        let sign = scales.position_sign();
        let [negative, positive, home, manufacturer] = self.inputs();
        let velocity = scales.velocity_object(actual.velocity.0);
        let speed = |servo: i64| scales.velocity_sign() * scales.speed.counts(servo);
        let leads = matches!(self.mode, Mode::TORQUE | Mode::CYCLIC_TORQUE) && self.brake.is_none();
        let torque = if leads { self.torque } else { actual.torque.0 };
        let rated = self.servo.parameters().rated_current.0.max(1);
        let wrap = |count: i64| i64::from(i32::from_le_bytes(low_half(count)));
        let values = [
            (index::POSITION_ACTUAL, scales.position_object(actual.position.0)),
            (index::POSITION_DEMAND, scales.position_object(self.motion.position)),
            (index::POSITION_INTERNAL, wrap(sign * scales.increments.counts(actual.position.0))),
            (index::POSITION_DEMAND_INTERNAL, wrap(sign * scales.increments.counts(self.motion.position))),
            (index::VELOCITY_SENSOR, velocity),
            (index::VELOCITY_ACTUAL, velocity),
            (index::VELOCITY_DEMAND, scales.velocity_object(self.motion.velocity)),
            (index::CONTROL_EFFORT, scales.velocity_object(self.motion.velocity)),
            (index::VL_VELOCITY_DEMAND, speed(self.motion.velocity)),
            (index::VL_VELOCITY_ACTUAL, speed(actual.velocity.0)),
            (index::TORQUE_DEMAND, torque / TORQUE),
            (index::TORQUE_ACTUAL, actual.torque.0 / TORQUE),
            (index::CURRENT_ACTUAL, actual.current.0.saturating_mul(1_000) / rated),
            (index::DC_LINK_VOLTAGE, actual.bus_voltage.0 / 1_000),
            (index::FOLLOWING_ERROR, scales.distance_object(self.monitor.error)),
            (index::DIGITAL_INPUTS, negative | positive | home | manufacturer),
        ];
        for (index, value) in values {
            self.set(dictionary, index, value);
        }
        self.show_status(dictionary);
    }

    /// Bits of 60FDh: negative limit, positive limit, home switch, and the inputs of the servo from bit 16 up.
    fn inputs(&self) -> [i64; 4] {
        use profile_generic::servo::input as servo;
        let inputs = self.actual.digital_inputs;
        let limits = self.senses(Passed::default(), 0).limits;
        let bit = |set: bool, bit: u32| if set { i64::from(bit) } else { 0 };
        let probes = inputs & (servo::REGISTRATION_1 | servo::REGISTRATION_2);
        let user = inputs >> servo::USER_SHIFT << 3 | probes;
        [
            bit(limits[0], index::input::NEGATIVE_LIMIT),
            bit(limits[1], index::input::POSITIVE_LIMIT),
            bit(inputs & servo::HOME_SWITCH != 0, index::input::HOME),
            i64::from(user.wrapping_shl(index::input::MANUFACTURER_SHIFT)),
        ]
    }
}

/// The low 32 bits.
const fn low_half(number: i64) -> [u8; 4] {
    let [a, b, c, d, ..] = number.to_le_bytes();
    [a, b, c, d]
}
