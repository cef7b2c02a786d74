//! A simulated drive behind a slave: the drive profile of IEC 61800-7-204 on a simulated servo axis.
//!
//! ```text
//! bits 15..14 of S-0-0135                       S-0-0134
//! 00 not ready       before CP4
//! 01 ready for main power                       main power comes and goes outside of SERCOS
//! 10 main power on   <-------------+            bit 14 = 0, a fault, or the end of a stop
//!        |                         |
//!        | bits 15 and 14 = 1, CP4 |            an edge of bit 15 or 14 is needed after each switch-off
//!        v                         |
//! 11 in operation  ----------------+            bit 15 = 0: stop, S-0-0207, then off
//!    bit 3 = 1 follows                          bit 13 = 1, after S-0-0206
//!    bit 4 = 1 halted                           bit 13 = 0
//! ```
//!
//! When the connection with S-0-0134 no longer delivers the drive stops as if bit 15 had gone to 0.

mod control;
mod fault;
pub mod homing;
pub mod memory;
pub mod parameters;
pub mod probe;
pub mod scaling;
mod set_points;
mod status;
mod twin;

use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::servo::{
    Servo, ServoActual, ServoCommand, ServoControl, ServoError, ServoParameters, input,
};
use profile_generic::state::Report;
use profile_generic::time::DurationNs;

use self::control::{Control, MODE_BLOCKS, ModeSwitch};
use self::homing::Homing;
use self::memory::Memory;
use self::parameters::{MODES, NEGATIVE_VELOCITY_LIMIT, POSITIVE_VELOCITY_LIMIT, VELOCITY_WINDOW};
use self::probe::Probe;
use self::scaling::Scales;
use self::set_points::Path;
pub use self::twin::Given;
use super::application::{Application, Cycle, Diagnosis, Order, Progress};
use super::configuration::Invalid;
use super::parameter::{Parameter, Store};
use crate::wire::drive_words::{DriveControl, ReadyState};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc_error::SvcError;

/// What is shown besides what the servo reports.
#[derive(Debug, Default)]
struct Shown {
    /// Warnings raised from outside, bits of S-0-0012.
    warnings: u16,
    /// Errors shown besides the one that has stopped the drive, bits of S-0-0011.
    further_errors: u16,
    /// Ready state shown while an error locks the drive.
    locked_ready: ReadyState,
}

/// The drive profile on a slave: parameters, states and a simulated axis.
#[derive(Debug)]
pub struct Drive {
    servo: Servo,
    scales: Scales,
    actual: ServoActual,
    control: Control,
    mode: ModeSwitch,
    path: Path,
    shown: Shown,
    referenced: bool,
    probe: Probe,
    homing: Homing,
    memory: Memory,
    /// Time does not pass for motor and loops.
    paused: bool,
    /// How far the encoder of the load (feedback 2) is ahead of the motor's, nanounits.
    slip: i64,
    /// The parameters of the drive that it is like, until its own are made.
    given: Option<Vec<Given>>,
}

impl Drive {
    /// A drive with this servo, with main power. Fails when the servo's parameters do.
    pub fn new(parameters: ServoParameters) -> Result<Self, ServoError> {
        let mut store = Store::new();
        parameters::define(&mut store, &parameters);
        // The preset scaling fits every servo that can be built.
        let scales = Scales::read(&store, &parameters).map_err(|_| ServoError::OutOfRange("kind"))?;
        let mut servo = Servo::new(parameters)?;
        let probe = Probe::new(&mut servo);
        Ok(Drive {
            servo,
            scales,
            actual: ServoActual::default(),
            control: Control::new(),
            mode: ModeSwitch::new(),
            path: Path::default(),
            shown: Shown::default(),
            referenced: false,
            probe,
            homing: Homing::default(),
            memory: Memory::default(),
            paused: false,
            slip: 0,
            given: None,
        })
    }

    /// The same with the settings of another drive, and with no other settings. What goes over the bus in every cycle, the procedure
    /// commands, and the parameters of the communication it has in any case.
    ///
    /// # Errors
    /// As [`Drive::new`].
    pub fn like(parameters: ServoParameters, given: Vec<Given>) -> Result<Self, ServoError> {
        Ok(Self { given: Some(given), ..Self::new(parameters)? })
    }

    /// The servo, to look at it.
    pub fn servo(&self) -> &Servo {
        &self.servo
    }

    /// The servo, to load it, to move its switches, to place it.
    pub fn servo_mut(&mut self) -> &mut Servo {
        &mut self.servo
    }

    /// What the servo did in the last cycle.
    pub fn actual(&self) -> &ServoActual {
        &self.actual
    }

    /// Whether the brake of the motor is open: it opens with the torque and closes at the end of a stop, S-0-0207 before
    /// the torque ends.
    pub fn brake_released(&self) -> bool {
        self.in_operation() && self.control.off_for == DurationNs::ZERO
    }

    /// Stops the time of motor and loops, or lets it go on. Parameters keep their values meanwhile and the words from the master
    /// have no effect: for a test bench that answers in place of the drive.
    pub fn set_paused(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Switches main power.
    pub fn set_main_power(&mut self, on: bool) {
        self.control.main_power = on;
    }

    /// Raises a fault; its cause stays until [`clear_fault`](Self::clear_fault).
    pub fn raise_fault(&mut self, cause: FaultCause) {
        self.servo.raise_fault(cause);
    }

    /// Ends the cause of a fault. The fault itself stays until S-0-0099.
    pub fn clear_fault(&mut self, cause: FaultCause) {
        self.servo.clear_fault(cause);
    }

    /// Ends a fault, as in a drive that resets itself.
    pub fn recover(&mut self, cause: FaultCause) {
        self.servo.recover(cause);
    }

    /// Sets the warnings that come from outside, bits of S-0-0012.
    pub fn set_warnings(&mut self, bits: u16) {
        self.shown.warnings = bits;
    }

    /// Sets errors that are shown together with the one that has stopped the drive, bits of S-0-0011.
    pub fn set_further_errors(&mut self, bits: u16) {
        self.shown.further_errors = bits;
    }

    /// Says whether the position refers to the machine's zero point (S-0-0403).
    pub fn set_referenced(&mut self, referenced: bool) {
        self.referenced = referenced;
    }

    /// Makes it a drive whose status word does not say whether it follows command values, and that knows no halt by bit 13
    /// of S-0-0134.
    pub fn set_silent(&mut self, silent: bool) {
        self.control.silent = silent;
    }

    /// What bits 15 and 14 of S-0-0135 show while an error locks the drive: families differ, 00 or 10.
    pub fn set_locked_ready(&mut self, ready: ReadyState) {
        self.shown.locked_ready = ready;
    }

    /// How long it takes to store parameters (S-0-0264), and whether that fails in the end.
    pub fn set_memory(&mut self, time: DurationNs, is_broken: bool) {
        (self.memory.time, self.memory.is_broken) = (time, is_broken);
    }

    /// The load is this far ahead of the motor, as after a slip of its coupling: feedback 2 shows it.
    pub fn set_slip(&mut self, slip: Position) {
        self.slip = slip.0;
    }

    /// How far the encoder of the position loop is ahead of the motor's.
    fn loop_slip(&self) -> i64 {
        if control::is_by_load(self.mode.code) { self.slip } else { 0 }
    }

    /// How long it takes to another operation mode.
    pub fn set_mode_delay(&mut self, delay: DurationNs) {
        self.mode.delay = delay;
    }

    /// Limits and windows of the parameters, as the servo takes them.
    fn servo_parameters(&self, scales: &Scales, store: &Store, lag_less: bool) -> ServoParameters {
        let number = |idn| store.number_of(idn);
        // Of several limits of the same value the tightest counts; that backward is negative.
        let velocity_limit = number(Idn::BIPOLAR_VELOCITY_LIMIT)
            .min(number(POSITIVE_VELOCITY_LIMIT))
            .min(number(NEGATIVE_VELOCITY_LIMIT).saturating_neg());
        let least = |idns: [Idn; 3]| idns.into_iter().map(|idn| store.number_of(idn)).min().unwrap_or(1);
        let torque_limits =
            [Idn::BIPOLAR_TORQUE_LIMIT, Idn::POSITIVE_TORQUE_LIMIT, Idn::NEGATIVE_TORQUE_LIMIT];
        let acceleration_limits =
            [Idn::BIPOLAR_ACCELERATION_LIMIT, Idn::ACCELERATION_LIMIT, Idn::DECELERATION_LIMIT];
        ServoParameters {
            velocity_limit: Velocity(scales.velocity.generic(velocity_limit).max(1)),
            torque_limit: Torque(scales.torque.generic(least(torque_limits)).max(1)),
            deceleration_limit: Acceleration(scales.acceleration.generic(least(acceleration_limits)).max(1)),
            position_error_tolerance: Position(scales.position.generic(number(Idn::MONITORING_WINDOW))),
            in_position_window: Position(scales.position.generic(number(Idn::POSITION_WINDOW)).max(1)),
            standstill_window: Velocity(scales.velocity.generic(number(Idn::STANDSTILL_WINDOW)).max(1)),
            at_velocity_window: Velocity(scales.velocity.generic(number(VELOCITY_WINDOW)).max(1)),
            position_gain: number(Idn::POSITION_LOOP_KV).saturating_mul(1_000_000) / 6,
            // 0.01 %.
            velocity_feed_forward: if lag_less { number(Idn::VELOCITY_FEED_FORWARD_GAIN) * 100 } else { 0 },
            ..*self.servo.parameters()
        }
    }

    /// Takes scaling and limits over. What the servo refuses has been refused when it was written or checked.
    fn adopt(&mut self, store: &Store) {
        if let Ok(scales) = Scales::read(store, self.servo.parameters()) {
            if scales != self.scales {
                self.path.position = scales.position.counts(self.actual.position.0);
            }
            self.scales = scales;
        }
        let parameters = self.servo_parameters(&self.scales, store, self.mode.code & 8 != 0);
        if parameters != *self.servo.parameters() {
            // An unstable position gain is kept out by `check`.
            let _ = self.servo.set_parameters(parameters);
        }
    }

    /// Whether the servo would run with these parameters.
    fn is_possible(&self, parameters: ServoParameters) -> bool {
        Servo::new(parameters).is_ok()
    }

    fn in_operation(&self) -> bool {
        matches!(
            self.actual.report,
            Report::Operating | Report::Halted | Report::Stopping | Report::FaultReaction | Report::Enabling
        )
    }

    /// The master's order to one of the procedure commands of homing.
    // Flat: one arm per order.
    fn order_homing(&mut self, idn: Idn, order: Order, store: &mut Store) -> Result<Progress, SvcError> {
        let standing = self.actual.status.contains(StatusBits::STANDSTILL);
        let displacement = || self.homing.displacement(store, &self.scales).ok_or(SvcError::NOT_EXECUTABLE);
        match (idn, order) {
            (Idn::DRIVE_CONTROLLED_HOMING | Idn::CONTROL_UNIT_CONTROLLED_HOMING, Order::Start) => {
                return self.start_homing(idn == Idn::DRIVE_CONTROLLED_HOMING, store);
            }
            (Idn::DRIVE_CONTROLLED_HOMING, Order::Cancel) => self.homing.cancel_by_drive(),
            (Idn::CONTROL_UNIT_CONTROLLED_HOMING, Order::Cancel) => self.homing.cancel_by_master(),
            (Idn::CALCULATE_DISPLACEMENT, Order::Start) => {
                let shift = self.scales.position.counts(displacement()?);
                store.set_number_of(Idn::DISPLACEMENT_PARAMETER_1, shift);
            }
            (Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM, Order::Start) if standing => {
                let shift = displacement()?;
                self.displace(shift);
                self.homing.set_displaced(true);
            }
            (Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM, Order::Cancel) => self.homing.set_displaced(false),
            (Idn::CANCEL_REFERENCE_POINT, Order::Start) => self.referenced = false,
            (Idn::SET_ABSOLUTE_POSITION, Order::Start) if standing && !self.in_operation() => {
                let sign =
                    if store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & 1 << 2 == 0 { 1 } else { -1 };
                let position =
                    sign * self.scales.position.generic(store.number_of(Idn::REFERENCE_DISTANCE_1));
                self.displace(position.saturating_sub(self.servo.position().0));
            }
            (
                Idn::CALCULATE_DISPLACEMENT | Idn::CANCEL_REFERENCE_POINT | Idn::SET_ABSOLUTE_POSITION,
                Order::Cancel,
            ) => {}
            _ => return Err(SvcError::NOT_EXECUTABLE),
        }
        Ok(Progress::Done)
    }

    fn start_homing(&mut self, by_drive: bool, store: &mut Store) -> Result<Progress, SvcError> {
        let able = !by_drive || self.control.follows && !self.homing.leads();
        if !able || !homing::is_possible(store.number_of(Idn::HOMING_PARAMETER)) {
            return Err(SvcError::NOT_EXECUTABLE);
        }
        self.probe.take_homing_edges();
        self.referenced = false;
        if by_drive {
            self.homing.start_by_drive(store, self.actual.digital_inputs & input::HOME_SWITCH != 0);
        } else {
            self.homing.start_by_master(store);
        }
        Ok(Progress::InProcess)
    }
}

impl Application for Drive {
    fn define(&mut self, store: &mut Store) {
        let communication: Vec<Idn> = store.iter().map(Parameter::idn).collect();
        parameters::define(store, self.servo.parameters());
        if let Some(given) = self.given.take() {
            twin::shape(store, &communication, &given, self.servo.parameters());
            self.adopt(store);
        }
    }

    fn refresh(&mut self, _: Idn, _: &mut Store) {}

    fn check(&self, idn: Idn, data: &[u8], store: &Store) -> Result<(), SvcError> {
        let value =
            |len: usize| data.iter().take(len).rev().fold(0i64, |value, &b| value << 8 | i64::from(b));
        if idn.is_product() || idn.instance() != 0 || idn.element() != 0 {
            return Ok(());
        }
        if MODE_BLOCKS.contains(&idn.block()) {
            let code = value(2);
            let known = code == 0 || MODES.iter().any(|&mode| i64::from(mode) == code);
            return if known { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        if idn == Idn::HOMING_PARAMETER {
            return if homing::is_possible(value(2)) { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        if idn == Idn::POSITION_LOOP_KV {
            let gain = value(2).saturating_mul(1_000_000) / 6;
            let parameters = ServoParameters { position_gain: gain, ..*self.servo.parameters() };
            return if self.is_possible(parameters) { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        let kind = scaling::type_of_factor(idn);
        let fixed = kind.is_some_and(|kind| store.number_of(kind) & 8 == 0);
        let own = data != store.find(idn).map_or(&[][..], |handle| store.get(handle).data());
        if fixed && own { Err(SvcError::OTHER_SETTINGS) } else { Ok(()) }
    }

    fn written(&mut self, idn: Idn, store: &mut Store) {
        let kind = store.number_of(idn);
        for &(idn, value) in scaling::preferential(idn, kind) {
            store.set_number_of(idn, value);
        }
        self.adopt(store);
    }

    fn order(&mut self, idn: Idn, order: Order, store: &mut Store) -> Result<Progress, SvcError> {
        match idn {
            Idn::PROBING_CYCLE => Ok(self.probe.order(order)),
            memory::BACKUP => Ok(self.memory.order(order)),
            _ => self.order_homing(idn, order, store),
        }
    }

    fn progress(&mut self, idn: Idn, _: &mut Store) -> Progress {
        match idn {
            // Probing goes on until it is cancelled.
            Idn::PROBING_CYCLE => Progress::InProcess,
            memory::BACKUP => self.memory.progress(),
            Idn::DRIVE_CONTROLLED_HOMING => self.homing.progress_by_drive(),
            Idn::CONTROL_UNIT_CONTROLLED_HOMING => self.homing.progress_by_master(),
            _ => Progress::Failed,
        }
    }

    fn check_phase(&self, phase: Phase, store: &Store, invalid: &mut Invalid) {
        if phase == Phase::CP3 {
            return;
        }
        match Scales::read(store, self.servo.parameters()) {
            Err(idn) => invalid.push(idn),
            Ok(scales) => {
                let parameters = self.servo_parameters(&scales, store, false);
                if !self.is_possible(parameters) {
                    invalid.push(Idn::POSITION_LOOP_KV);
                }
            }
        }
        if store.number_of(Idn::PRIMARY_OPERATION_MODE) == 0 {
            invalid.push(Idn::PRIMARY_OPERATION_MODE);
        }
        let limits =
            [Idn::NEGATIVE_POSITION_LIMIT, Idn::POSITIVE_POSITION_LIMIT].map(|idn| store.number_of(idn));
        if store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & 1 << 4 != 0 && limits[0] >= limits[1] {
            invalid.push(Idn::POSITIVE_POSITION_LIMIT);
        }
    }

    fn cycle(&mut self, cycle: Cycle, store: &mut Store) {
        self.memory.step(cycle.elapsed);
        if self.paused {
            return;
        }
        let [low, high, ..] = store.number_of(Idn::DRIVE_CONTROL).to_le_bytes();
        let received = DriveControl::from_bits_retain(u16::from_le_bytes([low, high]));
        self.control.take(received, &cycle, self.in_operation());
        let mode = self.select_mode(cycle.elapsed, store);
        if mode.is_none() && self.control.wants_torque(&cycle) {
            self.servo.raise_fault(FaultCause::ILLEGAL_MODE);
        } else {
            self.servo.clear_fault(FaultCause::ILLEGAL_MODE);
        }
        let command = self.command(&cycle, mode.unwrap_or(OperatingMode::Velocity), store);
        // What happened before this cycle counts as the enables were before it.
        self.collect_probes(store);
        self.probe.enable(store);
        let step = self.synchronous(command);
        self.actual = self.servo.step(cycle.elapsed.0, &step);
        self.collect_probes(store);
        self.watch_travel(store);
        self.publish(&cycle, store);
        self.probe.publish(&self.actual, store);
    }

    fn diagnosis(&self) -> Diagnosis {
        match self.diagnose() {
            Diagnosis { number: 0, text: "", errors, warnings } if self.memory.has_failed() => {
                Diagnosis { errors, warnings, number: memory::FAILURE, text: memory::FAILURE_TEXT }
            }
            diagnosis => diagnosis,
        }
    }

    fn reset(&mut self, _: &mut Store) -> bool {
        if self.actual.fault.is_none() {
            return true;
        }
        // A stop that is going on goes on; the fault is not reset then.
        let command = ServoCommand {
            control: ServoControl::Disable,
            power: self.control.main_power,
            reset_fault: true,
            ..ServoCommand::default()
        };
        self.actual = self.servo.step(1, &command);
        // Bits that still stand do not switch the drive on again.
        self.control.locked = true;
        self.actual.fault.is_none()
    }
}

#[cfg(test)]
mod tests;
