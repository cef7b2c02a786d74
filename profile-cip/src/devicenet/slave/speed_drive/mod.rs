//! A simulated velocity drive of the AC/DC drive profile, with a simulated servo behind it.
//!
//! The poll connection consumes one of the output assemblies 20 to 23 and produces the input assembly that goes with it.
//! The speed follows its reference along a ramp. Run counts only with `NetCtrl`, the reference only with `NetRef`; they are
//! bits of the extended assemblies, and attributes where the assembly has not those bits.
//!
//! | what happens to the poll connection | the drive |
//! |---|---|
//! | times out | faults (7500) and stops along the ramp |
//! | released, deleted | stops along the ramp |
//! | a message without data | stops along the ramp: the master is idle |

pub mod objects;
pub mod supervisor;

use profile_generic::cast;
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Torque, Velocity};
use profile_generic::servo::{Servo, ServoActual, ServoCommand, ServoControl, ServoError, ServoParameters};
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime};

use self::objects::{
    AcDcDrive, Assemblies, CLASS_AC_DC_DRIVE, CLASS_ASSEMBLY, CLASS_CONTROL_SUPERVISOR, CLASS_MOTOR_DATA,
    ControlSupervisor, MotorData, MotorPlate, Settings,
};
use self::supervisor::{Inputs, next};
use super::super::connection::{Change, Connection, ConnectionKind, ConnectionSetup, ConnectionState};
use super::super::fragmentation::{Body, IoData};
use super::super::wire::speed::{
    Assembly, DRIVE_MODE_TORQUE, SpeedActual, SpeedCommand, SpeedControl, SpeedStatus, SupervisorState,
};
use super::super::wire::{MacId, Request};
use super::application::{Application, ServiceError};
use super::explicit::serve;
use crate::device::event::ResetKind;
use crate::device::objects::identity::{Health, ModuleState};
use crate::wire::status::GeneralStatus;

/// Period of the simulation.
const STEP: DurationNs = DurationNs::from_millis(1);

/// Longest time that is made up for in one call; a simulation that stood still for longer goes on from there.
const BACKLOG: DurationNs = DurationNs::from_millis(100);

/// Transport class and trigger of the poll connection: server, class 2.
const TRANSPORT: u8 = 0x82;

/// `FaultCode` of a lost network: communication.
const FAULT_NETWORK: u16 = 0x7500;
/// `FaultCode` of a fault that has no row in [`SpeedDriveConfig::faults`]: general.
const FAULT_GENERAL: u16 = 0x1000;

/// Speed within which the drive is at its reference, rpm.
const AT_REFERENCE_RPM: i64 = 10;

/// What the drive is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpeedDriveConfig {
    /// The output assembly of the poll connection, 20 to 23.
    pub output: Assembly,
    /// `FaultCode` (29:13) of the servo's faults. What is not here is 1000.
    pub faults: Vec<(FaultCause, u16)>,
    /// Mechanics and loops of the simulated axis.
    pub servo: ServoParameters,
}

/// Why a drive cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SpeedDriveError {
    /// It is none of the output assemblies 20 to 23.
    #[error("expected output assembly 20 to 23, got {}", .0.0)]
    Assembly(Assembly),
    /// The servo.
    #[error(transparent)]
    Servo(#[from] ServoError),
}

/// An AC/DC drive (classes 28h, 29h, 2Ah), with a simulated axis.
#[derive(Debug)]
pub struct SpeedDrive {
    config: SpeedDriveConfig,
    settings: Settings,
    servo: Servo,
    actual: ServoActual,
    power: bool,
    state: SupervisorState,
    command: SpeedCommand,
    /// Path to the output and to the input assembly.
    paths: [[u8; 4]; 2],
    /// The poll connection was lost, and that was not reset yet.
    network_fault: bool,
    explicit_reset: bool,
    /// Run and fault reset of the last step.
    before: (bool, bool),
    /// Fault reset has risen, and the servo has not been told.
    resetting: bool,
    /// Speed along the ramp, nanounits a second.
    ramp: i64,
    next: Option<MonotonicTime>,
    changed: bool,
}

/// A value as an INT, held at its ends.
fn word(value: i64) -> i16 {
    i16::try_from(value).unwrap_or(if value < 0 { i16::MIN } else { i16::MAX })
}

/// `value` times 2^`places`, places -7..=7.
fn shift(value: i64, places: i8) -> i64 {
    let places = u32::from(places.unsigned_abs());
    value.saturating_mul(1 << places)
}

/// `value` in units of 2^-`scale`.
fn to_units(value: i64, scale: i8) -> i64 {
    if scale < 0 { value / shift(1, scale) } else { shift(value, scale) }
}

/// So many nano of a value in units of 2^-`scale`.
fn nano(units: i64, scale: i8) -> i64 {
    let nano = units.saturating_mul(1_000_000_000);
    if scale < 0 { shift(nano, scale) } else { nano / shift(1, scale) }
}

/// What is set in a drive as it comes from its maker.
fn settings(config: &SpeedDriveConfig) -> Settings {
    Settings { motor: MotorPlate::of(&config.servo), ..Settings::default() }
}

impl SpeedDrive {
    /// A drive with power.
    ///
    /// # Errors
    /// See [`SpeedDriveError`].
    pub fn new(config: SpeedDriveConfig) -> Result<Self, SpeedDriveError> {
        let Some(input) = config.output.status() else {
            return Err(SpeedDriveError::Assembly(config.output));
        };
        let path = |assembly: Assembly| [0x20, 0x04, 0x24, assembly.0];
        Ok(Self {
            settings: settings(&config),
            servo: Servo::new(config.servo)?,
            actual: ServoActual::default(),
            power: true,
            state: SupervisorState::STARTUP,
            command: SpeedCommand::default(),
            paths: [path(config.output), path(input)],
            network_fault: false,
            explicit_reset: false,
            before: (false, false),
            resetting: false,
            ramp: 0,
            next: None,
            changed: false,
            config,
        })
    }

    /// The servo, to look at it.
    #[must_use]
    pub const fn servo(&self) -> &Servo {
        &self.servo
    }

    /// The servo, to load it and to raise faults.
    pub const fn servo_mut(&mut self) -> &mut Servo {
        &mut self.servo
    }

    /// What the servo did in the last step.
    #[must_use]
    pub const fn actual(&self) -> &ServoActual {
        &self.actual
    }

    /// State of the Control Supervisor.
    #[must_use]
    pub const fn state(&self) -> SupervisorState {
        self.state
    }

    /// What is set.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Switches main power.
    pub fn set_power(&mut self, on: bool) {
        self.power = on;
    }

    fn check_idle(&self) -> Result<(), GeneralStatus> {
        let runs = matches!(
            self.state,
            SupervisorState::ENABLED | SupervisorState::STOPPING | SupervisorState::FAULT_STOP
        );
        if runs { Err(GeneralStatus::OBJECT_STATE_CONFLICT) } else { Ok(()) }
    }

    fn fault_code(&self) -> u16 {
        match self.actual.fault {
            Some(cause) => self
                .config
                .faults
                .iter()
                .find(|(known, _)| *known == cause)
                .map_or(FAULT_GENERAL, |row| row.1),
            None if self.network_fault => FAULT_NETWORK,
            None => 0,
        }
    }

    /// Whether a bit of the command counts: in the extended assemblies it says so itself.
    fn is_networked(&self, bit: SpeedControl, setting: bool) -> bool {
        if self.config.output.is_extended() { self.command.control.contains(bit) } else { setting }
    }

    /// 1 forward, -1 reverse, 0 no run.
    fn direction(&self) -> i64 {
        let control = self.command.control;
        let runs = (control.contains(SpeedControl::RUN_FORWARD), control.contains(SpeedControl::RUN_REVERSE));
        match runs {
            _ if !self.is_networked(SpeedControl::NET_CONTROL, self.settings.net_control) => 0,
            (true, false) => 1,
            (false, true) => -1,
            _ => 0,
        }
    }

    fn nanounits(&self, speed: i64) -> i64 {
        nano(speed, self.settings.speed_scale) / 60
    }

    /// The speed that is wanted, nanounits a second.
    fn reference(&self) -> i64 {
        if !self.is_networked(SpeedControl::NET_REFERENCE, self.settings.net_reference) {
            return 0;
        }
        let speed = i64::from(self.command.speed) * self.direction();
        let (low, high) = (i64::from(self.settings.low_limit), i64::from(self.settings.high_limit));
        // The low limit does not move a drive that is asked to stand.
        let held = if speed == 0 { 0 } else { speed.abs().clamp(low, high) * speed.signum() };
        self.nanounits(held)
    }

    /// Moves the ramp on toward `wanted`.
    fn advance(&mut self, wanted: i64) {
        let full = self.nanounits(i64::from(self.settings.high_limit)).max(1);
        let slower = wanted.abs() < self.ramp.abs() || wanted.signum() * self.ramp.signum() < 0;
        let time = if slower { self.settings.deceleration_ms } else { self.settings.acceleration_ms };
        let change = if time == 0 { full.saturating_mul(2) } else { (full / i64::from(time)).max(1) };
        self.ramp = wanted.clamp(self.ramp.saturating_sub(change), self.ramp.saturating_add(change));
    }

    fn step(&mut self) {
        let run = self.direction() != 0;
        let reset = self.command.control.contains(SpeedControl::FAULT_RESET) || self.explicit_reset;
        self.explicit_reset = false;
        let reset_edge = reset && !self.before.1;
        let run_edge = run && !self.before.0;
        self.before = (run, reset);
        let before = self.state;
        if before == SupervisorState::FAULTED && reset_edge {
            self.network_fault = false;
            self.resetting = true;
        }
        let fault = self.actual.fault.is_some() || self.network_fault;
        let torque = matches!(
            self.actual.report,
            Report::Enabling | Report::Operating | Report::Halted | Report::Stopping | Report::FaultReaction
        );
        let still = self.actual.status.contains(StatusBits::STANDSTILL);
        let inputs = Inputs {
            power: self.power && !matches!(self.actual.report, Report::NotReady | Report::AwaitingPower),
            fault,
            standstill: still && self.ramp == 0 || !torque,
            run,
            run_edge,
            reset: core::mem::take(&mut self.resetting) && !fault,
        };
        // A fault of the servo goes with the reset itself, which takes this step.
        let resets = before == SupervisorState::FAULTED && reset_edge && self.actual.fault.is_some();
        self.resetting = resets;
        self.state = next(before, inputs);
        let command = self.servo_command(resets);
        self.actual = self.servo.step(STEP.0, &command);
        self.changed |= self.state != before;
    }

    fn servo_command(&mut self, reset_fault: bool) -> ServoCommand {
        let still = ServoCommand {
            power: self.power,
            reset_fault,
            mode: OperatingMode::Velocity,
            ..ServoCommand::default()
        };
        match self.state {
            SupervisorState::ENABLED if self.settings.mode == DRIVE_MODE_TORQUE => {
                self.ramp = self.actual.velocity.0;
                let direction = self.direction();
                let micro =
                    nano(i64::from(self.command.torque) * direction, self.settings.torque_scale) / 1000;
                let rated = self.config.servo.rated_torque.0.max(1);
                // Micro newton metres to parts per million of the rated ones.
                let parts = i128::from(micro) * 1_000_000 / i128::from(rated);
                let torque = Torque(i64::try_from(parts).unwrap_or(0));
                ServoCommand { control: ServoControl::Enable, mode: OperatingMode::Torque, torque, ..still }
            }
            SupervisorState::ENABLED | SupervisorState::STOPPING => {
                let wanted = if self.state == SupervisorState::ENABLED { self.reference() } else { 0 };
                self.advance(wanted);
                let velocity = Velocity(self.ramp);
                ServoCommand { control: ServoControl::Enable, velocity, ..still }
            }
            SupervisorState::FAULT_STOP if self.actual.fault.is_none() => {
                self.advance(0);
                let velocity = Velocity(self.ramp);
                ServoCommand { control: ServoControl::Enable, velocity, ..still }
            }
            SupervisorState::FAULT_STOP => {
                // The servo carries out the reaction of its own fault.
                self.ramp = 0;
                ServoCommand { control: ServoControl::Disable, ..still }
            }
            _ => {
                self.ramp = 0;
                ServoCommand { control: ServoControl::TorqueOff, ..still }
            }
        }
    }

    fn status(&self) -> SpeedStatus {
        let state = self.state;
        let moves = matches!(
            state,
            SupervisorState::ENABLED | SupervisorState::STOPPING | SupervisorState::FAULT_STOP
        );
        let forward = self.actual.velocity.0 > 0 || self.actual.velocity.0 == 0 && self.direction() >= 0;
        let net_reference = self.is_networked(SpeedControl::NET_REFERENCE, self.settings.net_reference);
        let off = self.actual.velocity.0.saturating_sub(self.reference()).abs();
        let near = off <= nano(AT_REFERENCE_RPM, 0) / 60;
        let mut status = SpeedStatus::empty();
        status.set(
            SpeedStatus::FAULTED,
            matches!(state, SupervisorState::FAULTED | SupervisorState::FAULT_STOP),
        );
        status.set(SpeedStatus::RUNNING_FORWARD, moves && forward);
        status.set(SpeedStatus::RUNNING_REVERSE, moves && !forward);
        status.set(SpeedStatus::WARNING, self.actual.warning.is_some());
        let ready =
            matches!(state, SupervisorState::READY | SupervisorState::ENABLED | SupervisorState::STOPPING);
        status.set(SpeedStatus::READY, ready);
        let net_control = self.is_networked(SpeedControl::NET_CONTROL, self.settings.net_control);
        status.set(SpeedStatus::CONTROL_FROM_NET, net_control);
        status.set(SpeedStatus::REFERENCE_FROM_NET, net_reference);
        status.set(SpeedStatus::AT_REFERENCE, state == SupervisorState::ENABLED && near);
        status
    }

    fn power_watts(&self) -> i64 {
        // Torque in Nm times 2 pi revolutions a second.
        let torque = cast::f64_from_i64(self.torque_micro()) / 1e6;
        let turns = cast::f64_from_i64(self.actual.velocity.0) / 1e9;
        cast::i64_from_f64(torque * turns * core::f64::consts::TAU)
    }

    fn torque_micro(&self) -> i64 {
        let parts =
            i128::from(self.actual.torque.0) * i128::from(self.config.servo.rated_torque.0) / 1_000_000;
        i64::try_from(parts).unwrap_or(0)
    }

    fn speed_actual(&self) -> SpeedActual {
        let nano_rpm = self.actual.velocity.0.saturating_mul(60);
        let round = |value: i64, one: i64| value.saturating_add(one / 2 * value.signum()) / one;
        let speed = round(to_units(nano_rpm, self.settings.speed_scale), 1_000_000_000);
        let torque = round(to_units(self.torque_micro(), self.settings.torque_scale), 1_000_000);
        SpeedActual { status: self.status(), state: self.state, speed: word(speed), torque: word(torque) }
    }
}

impl Application for SpeedDrive {
    fn setup(&self, kind: ConnectionKind) -> Option<ConnectionSetup> {
        let size = u16::try_from(self.config.output.buffer_len()).unwrap_or(0);
        (kind == ConnectionKind::Poll).then_some(ConnectionSetup {
            transport: TRANSPORT,
            produced_size: size,
            consumed_size: size,
            supervised: true,
        })
    }

    fn paths(&self, kind: ConnectionKind) -> (&[u8], &[u8]) {
        if kind == ConnectionKind::Poll { (&self.paths[1], &self.paths[0]) } else { (&[], &[]) }
    }

    fn classes(&self) -> &[u16] {
        &[CLASS_ASSEMBLY, CLASS_MOTOR_DATA, CLASS_CONTROL_SUPERVISOR, CLASS_AC_DC_DRIVE]
    }

    fn serve(
        &mut self,
        _: MonotonicTime,
        _: MacId,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        match request.class {
            CLASS_MOTOR_DATA => serve(&mut MotorData(self), request, reply),
            CLASS_CONTROL_SUPERVISOR => serve(&mut ControlSupervisor(self), request, reply),
            CLASS_AC_DC_DRIVE => serve(&mut AcDcDrive(self), request, reply),
            _ => {
                let (command, actual) = (&self.command, &self.speed_actual());
                macro_rules! assembly {
                    ($($instance:literal)*) => {
                        match request.instance {
                            $($instance => serve(&mut Assemblies::<$instance> { command, actual }, request, reply),)*
                            _ => Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into()),
                        }
                    };
                }
                assembly!(20 21 22 23 70 71 72 73)
            }
        }
    }

    fn consume(&mut self, _: MonotonicTime, _: ConnectionKind, data: &[u8]) {
        // A length that the assembly has not does not come this far, and one without data commands nothing.
        self.command = SpeedCommand::parse(self.config.output, data).unwrap_or_default();
    }

    fn produce(&mut self, _: MonotonicTime, _: ConnectionKind, data: &mut IoData) {
        let mut bytes = [0; 6];
        if let Some(input) = self.config.output.status()
            && let Ok(len) = self.speed_actual().emit(input, &mut bytes)
        {
            data.extend(bytes[..len].iter().copied());
        }
    }

    fn take_change(&mut self) -> bool {
        core::mem::take(&mut self.changed)
    }

    fn connection_changed(&mut self, _: MonotonicTime, connection: &Connection, change: Change, _: MacId) {
        if connection.kind() != ConnectionKind::Poll {
            return;
        }
        self.command = SpeedCommand::default();
        let lost =
            change.before == ConnectionState::ESTABLISHED && change.after == ConnectionState::TIMED_OUT;
        self.network_fault |= lost && self.check_idle().is_err();
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        let mut next = self.next.unwrap_or(now);
        if now.since(next) > BACKLOG {
            next = now;
        }
        while next <= now {
            self.step();
            next = next + STEP;
        }
        self.next = Some(next);
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        Some(self.next.unwrap_or(MonotonicTime::ZERO))
    }

    fn health(&self) -> Health {
        let state = match self.state {
            SupervisorState::FAULT_STOP | SupervisorState::FAULTED => ModuleState::MajorRecoverableFault,
            SupervisorState::READY | SupervisorState::ENABLED | SupervisorState::STOPPING => {
                ModuleState::Operational
            }
            _ => ModuleState::Standby,
        };
        Health { state, ..Health::default() }
    }

    fn permits_reset(&mut self, _: MonotonicTime) -> bool {
        self.check_idle().is_ok()
    }

    /// Nothing outlives a reset.
    fn reset(&mut self, _: ResetKind) {
        self.settings = settings(&self.config);
        self.command = SpeedCommand::default();
        self.network_fault = false;
        self.state = SupervisorState::STARTUP;
    }
}
