//! One axis: the state machine, the modes of operation, and the servo behind them.

mod set_points;
mod status;

use arrayvec::ArrayVec;
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::quantity::{Acceleration, Position, Torque};
use profile_generic::servo::{Servo, ServoActual, ServoCommand, ServoError, ServoParameters};
use profile_generic::state::Report as ServoReport;
use profile_generic::time::DurationNs;

use self::set_points::{Brake, Path};
use crate::drive::controlword::Command;
use crate::drive::homing::Method;
use crate::drive::modes::SupportedModes;
use crate::drive::options::{AbortConnectionOption, DisableOption, QuickStopOption, ShutdownOption, Stop};
use crate::drive::states::transition;
use crate::drive::{Controlword, ErrorCode, Mode, State, Statusword, index};
use crate::node::application::{Event, Report};
use crate::node::dictionary::Dictionary;
use crate::node::drive::faults;
use crate::node::drive::homing::Homing;
use crate::node::drive::monitor::Monitor;
use crate::node::drive::objects::{FAULT_INJECTION, FEED_FORWARD, MODES};
use crate::node::drive::probe::{Passed, Probes};
use crate::node::drive::profile::{Profile, SetPoint};
use crate::node::drive::scaling::{Scales, TORQUE};

/// From power-on to *switch on disabled*.
pub const BOOT_TIME: DurationNs = DurationNs::from_millis(20);

/// Reports that wait to be taken; a step makes two at most.
const REPORTS_MAX: usize = 8;

/// Where the state machine is.
#[derive(Debug)]
struct Machine {
    state: State,
    /// Time in *not ready to switch on*.
    booting: DurationNs,
    /// Transition 4 has begun; the torque builds up.
    enabling: bool,
    /// Transition 5 or 8 has begun: the axis brakes before it.
    leaving: Option<(Stop, State)>,
    brake: Option<Brake>,
    before: Controlword,
    fault: Option<ErrorCode>,
    /// It leaves Fault by itself.
    recovering: bool,
}

impl Machine {
    fn new() -> Self {
        Self {
            state: State::NotReadyToSwitchOn,
            booting: DurationNs::ZERO,
            enabling: false,
            leaving: None,
            brake: None,
            before: Controlword::empty(),
            fault: None,
            recovering: false,
        }
    }

    /// No transition is under way any more.
    fn enter(&mut self, state: State) {
        self.state = state;
        (self.enabling, self.leaving, self.brake) = (false, None, None);
    }

    fn quick_stop(&mut self) {
        self.state = State::QuickStopActive;
        (self.leaving, self.brake) = (None, None);
    }

    fn stands_braked(&self) -> bool {
        self.brake.is_some_and(|brake| brake.held.is_some())
    }
}

/// What is around the drive.
#[derive(Debug)]
struct Wiring {
    main_power: bool,
    /// The controlword is obeyed.
    remote: bool,
    /// Bits of the statusword that stay as they are, and how.
    held_bits: (Statusword, Statusword),
    limit_switches: [Position; 2],
    /// It shows its limit switches, and does nothing about them.
    ignores_limit_switches: bool,
}

/// One axis of the device: states and modes of CiA 402 with a simulated motor.
#[derive(Debug)]
pub struct Axis {
    /// Offset of its objects from those of axis 0.
    offset: u16,
    /// Its number in EMCY.
    source: u8,
    servo: Servo,
    actual: ServoActual,
    scales: Scales,
    machine: Machine,
    path: Path,
    homing: Homing,
    probes: Probes,
    monitor: Monitor,
    reports: ArrayVec<Report, REPORTS_MAX>,
    wiring: Wiring,
    modes: SupportedModes,
    /// It has the objects of the simulated drive's own manufacturer.
    has_own_objects: bool,
    /// How far the encoder of the load (60E4h) is ahead of the motor's, nanounits.
    slip: i64,
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
            machine: Machine::new(),
            path: Path::new(),
            homing: Homing::default(),
            monitor: Monitor::default(),
            reports: ArrayVec::new(),
            wiring: Wiring {
                main_power: true,
                remote: true,
                held_bits: (Statusword::empty(), Statusword::empty()),
                limit_switches: [Position(i64::MIN), Position(i64::MAX)],
                ignores_limit_switches: false,
            },
            modes: MODES,
            has_own_objects: true,
            slip: 0,
        })
    }

    /// Its modes of operation.
    pub fn modes(&self) -> SupportedModes {
        self.modes
    }

    /// Makes it one of another manufacturer, with these of its modes.
    pub(super) fn take_modes(&mut self, modes: SupportedModes) {
        self.modes = MODES.intersection(modes);
        self.has_own_objects = false;
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

    /// Its state in the state machine of CiA 402.
    pub fn state(&self) -> State {
        self.machine.state
    }

    /// Switches main power.
    pub fn set_main_power(&mut self, on: bool) {
        self.wiring.main_power = on;
    }

    /// Whether the controlword is obeyed: bit 9 of the statusword.
    pub fn set_remote(&mut self, remote: bool) {
        self.wiring.remote = remote;
    }

    /// The load is this far ahead of the motor, as after a slip of its coupling: the additional encoder shows it.
    pub fn set_slip(&mut self, slip: Position) {
        self.slip = slip.0;
    }

    /// Holds bits of the statusword at a value whatever the drive does, as makers do who use them for something else.
    pub fn hold_status_bits(&mut self, bits: Statusword, value: Statusword) {
        self.wiring.held_bits = (bits, value.intersection(bits));
    }

    /// Sets where the limit switches close, in positions of the servo: one at and below, the other at and above its place.
    pub fn set_limit_switches(&mut self, lower: Position, upper: Position) {
        self.wiring.limit_switches = [lower, upper];
    }

    /// Whether the drive leaves it to its master to stop the axis at a limit switch.
    pub fn set_ignores_limit_switches(&mut self, ignores: bool) {
        self.wiring.ignores_limit_switches = ignores;
    }

    /// Raises a fault, as writing its code to 2FFFh:1 does. One that comes while another one is present is not told.
    pub fn raise_fault(&mut self, code: ErrorCode, dictionary: &mut Dictionary) {
        if code == ErrorCode::NO_ERROR
            || matches!(self.machine.state, State::FaultReactionActive | State::Fault)
        {
            return;
        }
        self.machine.fault = Some(code);
        self.report(code, true);
        self.homing.abort();
        self.machine.enter(State::FaultReactionActive);
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
            velocity_feed_forward: if self.has_own_objects {
                self.number(dictionary, FEED_FORWARD) * 1_000
            } else {
                self.servo.parameters().velocity_feed_forward
            },
            ..*self.servo.parameters()
        };
        if parameters != *self.servo.parameters() {
            // All of these fit any servo that works.
            let _ = self.servo.set_parameters(parameters);
        }
    }

    /// The device starts anew.
    fn reset(&mut self, dictionary: &mut Dictionary) {
        self.machine = Machine { recovering: self.machine.recovering, ..Machine::new() };
        self.path.mode = Mode::NONE;
        (self.path.profile, self.homing) = (Profile::default(), Homing::default());
        self.adopt(dictionary);
        self.acknowledge();
    }

    /// Resets what the servo has latched; whether that could be.
    fn acknowledge(&mut self) -> bool {
        let command =
            ServoCommand { power: self.wiring.main_power, reset_fault: true, ..ServoCommand::default() };
        self.actual = self.servo.step(1, &command);
        self.actual.fault.is_none()
    }

    /// Out of Fault, to Switch on disabled.
    fn leave_fault(&mut self, dictionary: &mut Dictionary) {
        self.machine.recovering = false;
        self.machine.enter(State::SwitchOnDisabled);
        if let Some(code) = self.machine.fault.take() {
            self.report(code, false);
        }
        self.set(dictionary, index::ERROR_CODE, 0);
    }

    /// Ends a fault of the servo, as in a drive that resets itself: it leaves Fault when the reaction to it has ended.
    pub fn recover(&mut self, cause: FaultCause) {
        self.servo.recover(cause);
        self.machine.recovering = true;
    }

    /// Something happens to the communication.
    // Flat: one arm per event.
    pub(super) fn event(&mut self, event: Event, dictionary: &mut Dictionary) {
        let runs = self.machine.enabling
            || matches!(self.machine.state, State::OperationEnabled | State::QuickStopActive);
        match event {
            Event::Reset => self.reset(dictionary),
            Event::Sync => self.path.synced = true,
            Event::SyncLost if runs && self.path.mode.is_cyclic() => {
                self.raise_fault(ErrorCode::SYNC_CONTROLLER, dictionary);
            }
            Event::ConnectionLost if runs => {
                match AbortConnectionOption(self.option(dictionary, index::ABORT_CONNECTION_OPTION)) {
                    AbortConnectionOption::NONE => {}
                    AbortConnectionOption::DISABLE_VOLTAGE => self.machine.enter(State::SwitchOnDisabled),
                    AbortConnectionOption::QUICK_STOP if self.machine.state == State::OperationEnabled => {
                        self.machine.quick_stop()
                    }
                    AbortConnectionOption::QUICK_STOP if self.machine.enabling => {
                        self.machine.enter(State::SwitchOnDisabled)
                    }
                    AbortConnectionOption::QUICK_STOP => {}
                    _ => self.raise_fault(ErrorCode::COMMUNICATION_MODULE, dictionary),
                }
            }
            Event::SyncLost | Event::ConnectionLost => {}
        }
        self.show_status(dictionary);
    }

    /// Takes controlword, mode and touch probe function. No time passes.
    pub(super) fn command(&mut self, dictionary: &mut Dictionary) {
        let injected = u16::try_from(self.part(dictionary, FAULT_INJECTION, 1)).unwrap_or_default();
        if injected != 0 && self.has_own_objects {
            dictionary.set(FAULT_INJECTION + self.offset, 1, 0);
            self.raise_fault(ErrorCode(injected), dictionary);
        }
        self.probes.command(self.offset, dictionary);
        self.select_mode(dictionary);
        if self.wiring.remote {
            self.obey(dictionary);
        }
        self.show_status(dictionary);
    }

    fn select_mode(&mut self, dictionary: &mut Dictionary) {
        let wanted = Mode(i8::try_from(self.number(dictionary, index::MODE)).unwrap_or_default());
        // A mode that came by PDO and is not supported changes nothing; by SDO it is refused.
        if wanted != self.path.mode && self.modes.has(wanted) {
            self.path.mode = wanted;
            self.begin_following();
            self.set(dictionary, index::MODE_DISPLAY, i64::from(wanted.0));
        }
    }

    fn obey(&mut self, dictionary: &mut Dictionary) {
        let word = u16::try_from(self.number(dictionary, index::CONTROLWORD)).unwrap_or_default();
        let word = Controlword::from_bits_retain(word);
        let before = core::mem::replace(&mut self.machine.before, word);
        if self.machine.enabling && Command::decode(word) != Some(Command::EnableOperation) {
            self.machine.enabling = false;
        }
        let holds = QuickStopOption(self.option(dictionary, index::QUICK_STOP_OPTION)).holds();
        if let Some(taken) = transition(self.machine.state, word, before, holds) {
            self.take(taken.number(), dictionary);
        }
        if self.machine.state == State::OperationEnabled {
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
            2 | 6 => self.machine.state = State::ReadyToSwitchOn,
            // Without voltage there is nothing to switch on.
            3 if charged => self.machine.state = State::SwitchedOn,
            4 if !self.machine.enabling => {
                self.machine.enabling = true;
                self.begin_following();
                self.path.motion.velocity = 0;
            }
            5 => {
                let stop = DisableOption(self.option(dictionary, index::DISABLE_OPTION)).stop();
                (self.machine.state, self.machine.leaving) = leave(stop, State::SwitchedOn);
            }
            8 => {
                let stop = ShutdownOption(self.option(dictionary, index::SHUTDOWN_OPTION)).stop();
                (self.machine.state, self.machine.leaving) = leave(stop, State::ReadyToSwitchOn);
            }
            7 | 9 | 10 | 12 => self.machine.enter(State::SwitchOnDisabled),
            11 => self.machine.quick_stop(),
            15 if self.acknowledge() => self.leave_fault(dictionary),
            16 => {
                self.machine.state = State::OperationEnabled;
                self.machine.brake = None;
                self.begin_following();
            }
            _ => {}
        }
    }

    /// Bits 4 to 6 and 9, while operation is enabled.
    fn obey_mode(&mut self, word: Controlword, rises: bool, dictionary: &Dictionary) {
        match self.path.mode {
            Mode::PROFILE_POSITION if rises && self.machine.leaving.is_none() => {
                let object = self.number(dictionary, index::TARGET_POSITION);
                let target = if word.contains(Controlword::RELATIVE) {
                    let from = self.path.profile.last_target().unwrap_or(self.path.motion.position);
                    from.saturating_add(self.scales.distance(object))
                } else {
                    self.scales.position_near(object, self.path.motion.position)
                };
                let (target, _) = self.within_travel(target, dictionary);
                let point = SetPoint {
                    target,
                    pace: self.pace(index::PROFILE_ACCELERATION, index::PROFILE_DECELERATION, dictionary),
                    blends: word.contains(Controlword::CHANGE_ON_SET_POINT),
                };
                self.path.profile.offer(point, word.contains(Controlword::CHANGE_IMMEDIATELY));
            }
            Mode::PROFILE_POSITION if !word.contains(Controlword::NEW_SET_POINT) => {
                self.path.profile.release()
            }
            Mode::HOMING if rises && self.machine.leaving.is_none() => {
                let method = Method(i8::try_from(self.number(dictionary, index::HOMING_METHOD)).unwrap_or(0));
                self.homing.start(method.plan(), &self.senses(Passed::default(), 0));
            }
            Mode::HOMING if !word.contains(Controlword::START_HOMING) => self.homing.stop(),
            _ => {}
        }
    }

    /// Time passes.
    pub(super) fn step(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary) {
        if self.machine.state == State::NotReadyToSwitchOn {
            self.machine.booting = self.machine.booting + elapsed;
            if self.machine.booting >= BOOT_TIME {
                self.machine.state = State::SwitchOnDisabled;
            }
        }
        self.command(dictionary);
        let command = self.servo_command(elapsed.0, dictionary);
        self.path.synced = false;
        self.actual = self.servo.step(elapsed.0, &ServoCommand { power: self.wiring.main_power, ..command });
        self.proceed(dictionary);
        let passed = self.probes.collect(&mut self.servo, &self.scales, self.offset, dictionary);
        self.home(elapsed.0, passed, dictionary);
        self.supervise(elapsed, dictionary);
        self.publish(dictionary);
    }

    /// Transitions that the drive makes by itself.
    // Flat: one arm per state.
    fn proceed(&mut self, dictionary: &mut Dictionary) {
        let off = matches!(
            self.actual.report,
            ServoReport::Ready | ServoReport::Faulted | ServoReport::AwaitingPower
        );
        if let Some(cause) = self.actual.fault {
            self.raise_fault(faults::code_of(cause), dictionary);
        }
        match self.machine.state {
            State::SwitchedOn if self.machine.enabling && self.actual.report == ServoReport::Operating => {
                self.machine.enabling = false;
                self.begin_following();
                self.path.motion.velocity = 0;
                self.machine.state = State::OperationEnabled;
            }
            State::OperationEnabled => {
                if let Some((_, to)) = self.machine.leaving.filter(|_| self.machine.stands_braked()) {
                    (self.machine.leaving, self.machine.brake, self.machine.state) = (None, None, to);
                }
            }
            State::QuickStopActive => {
                let holds = QuickStopOption(self.option(dictionary, index::QUICK_STOP_OPTION)).holds();
                if off || !holds && self.machine.stands_braked() {
                    self.machine.enter(State::SwitchOnDisabled);
                }
            }
            State::FaultReactionActive if off || self.machine.stands_braked() => {
                self.machine.brake = None;
                self.machine.state = State::Fault;
            }
            State::Fault if self.machine.recovering && self.actual.fault.is_none() => {
                self.leave_fault(dictionary)
            }
            _ => {}
        }
    }
}
