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

mod fault;
pub mod homing;
pub mod parameters;
pub mod probe;
pub mod scaling;

use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::servo::motion::{Motion, Pace};
use profile_generic::servo::{
    Servo, ServoActual, ServoCommand, ServoControl, ServoError, ServoParameters, input,
};
use profile_generic::state::Report;
use profile_generic::time::DurationNs;

use self::homing::{Homing, Senses};
use self::parameters::{MODES, idn};
use self::probe::Probe;
use self::scaling::Scales;
use super::application::{Application, Cycle, Diagnosis, Order, Progress};
use super::communication;
use super::configuration::Invalid;
use super::parameter::Store;
use super::phase::State;
use crate::wire::drive_words::{DriveControl, DriveStatus, ReadyState};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc_error::SvcError;

/// Data blocks of the operation modes that bits 10..8 of S-0-0134 select.
const MODE_BLOCKS: [u16; 8] = [32, 33, 34, 35, 284, 285, 286, 287];
/// Bit of an operation mode: the drive makes up the way to its target by itself.
const INTERPOLATED: u16 = 1 << 4;
/// Distance of motor temperature and overload to their limits at which the drive warns.
const TEMPERATURE_MARGIN_MILLIDEGREE: i64 = 10_000;
/// Part of the overload model, ppm, at which the drive warns.
const OVERLOAD_WARNING_PPM: i64 = 900_000;

/// The drive.
#[derive(Debug)]
pub struct Drive {
    servo: Servo,
    scales: Scales,
    main_power: bool,
    /// Warnings raised from outside, bits of S-0-0012.
    warnings: u16,
    /// Errors shown besides the one that has stopped the drive, bits of S-0-0011.
    further_errors: u16,
    control: DriveControl,
    actual: ServoActual,
    /// Operation mode code in effect, and the number that selects it.
    mode: u16,
    mode_number: u8,
    /// Whole position command in counts.
    position: i64,
    /// Time in operation, up to the drive-on delay.
    on_for: DurationNs,
    /// Time at standstill since the drive was switched off by bit 15.
    off_for: DurationNs,
    follows: bool,
    /// The connection was lost in operation, or a fault was reset: the enabling bits have to go away once.
    locked: bool,
    referenced: bool,
    probe: Probe,
    /// Ready state shown while an error locks the drive.
    locked_ready: ReadyState,
    /// It shows neither bit 3 nor bit 4 of S-0-0135, and knows no halt.
    silent: bool,
    /// Time from the selection of an operation mode to the mode, and how long one has been selected.
    mode_delay: DurationNs,
    mode_selected: DurationNs,
    /// The set-point that the drive makes up by itself, and whether it has come to S-0-0258.
    motion: Motion,
    attained: bool,
    homing: Homing,
    /// Set-points that count from the next cycle on.
    next: ServoCommand,
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
            probe,
            next: ServoCommand::default(),
            scales,
            main_power: true,
            warnings: 0,
            further_errors: 0,
            control: DriveControl::empty(),
            actual: ServoActual::default(),
            mode: MODES[2],
            mode_number: 0,
            position: 0,
            on_for: DurationNs::ZERO,
            off_for: DurationNs::ZERO,
            follows: false,
            locked: false,
            referenced: false,
            locked_ready: ReadyState::NotReady,
            silent: false,
            mode_delay: DurationNs::ZERO,
            mode_selected: DurationNs::ZERO,
            motion: Motion::default(),
            attained: false,
            homing: Homing::default(),
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

    /// What the servo did in the last cycle.
    pub fn actual(&self) -> &ServoActual {
        &self.actual
    }

    /// Whether the brake of the motor is open: it opens with the torque and closes at the end of a stop, S-0-0207 before
    /// the torque ends.
    pub fn brake_released(&self) -> bool {
        self.in_operation() && self.off_for == DurationNs::ZERO
    }

    /// Switches main power.
    pub fn set_main_power(&mut self, on: bool) {
        self.main_power = on;
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
        self.warnings = bits;
    }

    /// Sets errors that are shown together with the one that has stopped the drive, bits of S-0-0011.
    pub fn set_further_errors(&mut self, bits: u16) {
        self.further_errors = bits;
    }

    /// Says whether the position refers to the machine's zero point (S-0-0403).
    pub fn set_referenced(&mut self, referenced: bool) {
        self.referenced = referenced;
    }

    /// Makes it a drive whose status word does not say whether it follows command values, and that knows no halt by bit 13
    /// of S-0-0134.
    pub fn set_silent(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// What bits 15 and 14 of S-0-0135 show while an error locks the drive: families differ, 00 or 10.
    pub fn set_locked_ready(&mut self, ready: ReadyState) {
        self.locked_ready = ready;
    }

    /// How long it takes to another operation mode.
    pub fn set_mode_delay(&mut self, delay: DurationNs) {
        self.mode_delay = delay;
    }

    /// Limits and windows of the parameters, as the servo takes them.
    fn servo_parameters(&self, scales: &Scales, store: &Store, lag_less: bool) -> ServoParameters {
        let number = |idn| store.number_of(idn);
        // Of several limits of the same value the tightest counts.
        let least = |idns: [Idn; 3]| idns.into_iter().map(|idn| store.number_of(idn)).min().unwrap_or(1);
        let torque_limits = [idn::TORQUE_LIMIT, idn::TORQUE_LIMIT_POSITIVE, idn::TORQUE_LIMIT_NEGATIVE];
        let acceleration_limits =
            [idn::ACCELERATION_LIMIT, idn::ACCELERATION_LIMIT_POSITIVE, idn::ACCELERATION_LIMIT_NEGATIVE];
        ServoParameters {
            velocity_limit: Velocity(scales.velocity.generic(number(idn::VELOCITY_LIMIT)).max(1)),
            torque_limit: Torque(scales.torque.generic(least(torque_limits)).max(1)),
            deceleration_limit: Acceleration(scales.acceleration.generic(least(acceleration_limits)).max(1)),
            position_error_tolerance: Position(scales.position.generic(number(idn::MONITORING_WINDOW))),
            in_position_window: Position(scales.position.generic(number(idn::POSITION_WINDOW)).max(1)),
            standstill_window: Velocity(scales.velocity.generic(number(idn::STANDSTILL_WINDOW)).max(1)),
            position_gain: number(idn::POSITION_GAIN).saturating_mul(1_000_000) / 6,
            // 0.01 %.
            velocity_feed_forward: if lag_less { number(idn::VELOCITY_FEED_FORWARD) * 100 } else { 0 },
            ..*self.servo.parameters()
        }
    }

    /// Takes scaling and limits over. What the servo refuses has been refused when it was written or checked.
    fn adopt(&mut self, store: &Store) {
        if let Ok(scales) = Scales::read(store, self.servo.parameters()) {
            if scales != self.scales {
                self.position = scales.position.counts(self.actual.position.0);
            }
            self.scales = scales;
        }
        let parameters = self.servo_parameters(&self.scales, store, self.mode & 8 != 0);
        if parameters != *self.servo.parameters() {
            // An unstable position gain is kept out by `check`.
            let _ = self.servo.set_parameters(parameters);
        }
    }

    /// Whether the servo would run with these parameters.
    fn is_possible(&self, parameters: ServoParameters) -> bool {
        Servo::new(parameters).is_ok()
    }

    /// The operation mode that the control word selects; `None` if there is none behind the number.
    fn select_mode(&mut self, elapsed: DurationNs, store: &Store) -> Option<OperatingMode> {
        let selected = self.control.mode();
        self.mode_selected =
            if selected == self.mode_number { DurationNs::ZERO } else { self.mode_selected + elapsed };
        let waits = self.mode_selected <= self.mode_delay && self.in_operation();
        let number = if waits { self.mode_number } else { selected };
        let block = MODE_BLOCKS[usize::from(number & 7)];
        let [low, high, ..] = store.number_of(Idn::standard(block)).to_le_bytes();
        let code = u16::from_le_bytes([low, high]);
        let mode = match code {
            0x0001 => OperatingMode::Torque,
            0x0002 => OperatingMode::Velocity,
            0x0003 | 0x000B | 0x0013 | 0x001B => OperatingMode::Position,
            _ => return None,
        };
        if (code, number) != (self.mode, self.mode_number) {
            (self.mode, self.mode_number) = (code, number);
            self.adopt(store);
        }
        Some(mode)
    }

    /// The servo's control, from the bits of S-0-0134 and the delays.
    fn servo_control(&mut self, cycle: &Cycle, store: &Store) -> ServoControl {
        let (on, enable) =
            (self.control.contains(DriveControl::ON), self.control.contains(DriveControl::ENABLE));
        let torque = self.in_operation();
        if !enable && (cycle.connected || !torque) {
            return ServoControl::TorqueOff;
        }
        if !on || !cycle.connected || self.locked {
            let stands = self.actual.status.contains(StatusBits::STANDSTILL);
            self.off_for = if stands && torque { self.off_for + cycle.elapsed } else { DurationNs::ZERO };
            let waits = torque
                && cycle.connected
                && !self.locked
                && self.off_for < tenth_millis(store, idn::OFF_DELAY);
            return if waits { ServoControl::Halt } else { ServoControl::Disable };
        }
        self.off_for = DurationNs::ZERO;
        let halt = !self.control.contains(DriveControl::RESTART) && !self.silent;
        let running = matches!(self.actual.report, Report::Operating | Report::Halted);
        if halt && running { ServoControl::Halt } else { ServoControl::Enable }
    }

    fn in_operation(&self) -> bool {
        matches!(
            self.actual.report,
            Report::Operating | Report::Halted | Report::Stopping | Report::FaultReaction | Report::Enabling
        )
    }

    /// The command of this cycle in generic units.
    fn command(&mut self, cycle: &Cycle, mode: OperatingMode, store: &mut Store) -> ServoCommand {
        let control = self.servo_control(cycle, store);
        let running = self.actual.report == Report::Operating;
        let torque = running || self.actual.report == Report::Halted;
        self.on_for = if torque { self.on_for + cycle.elapsed } else { DurationNs::ZERO };
        let delayed = self.on_for < tenth_millis(store, idn::ON_DELAY);
        let able = running && !delayed && control == ServoControl::Enable;
        self.follows = able && !self.homing.leads();
        let mut command = ServoCommand { control, power: self.main_power, mode, ..ServoCommand::default() };
        if let Some(position) = self.lead(cycle, able, mode, store) {
            self.position = self.scales.position.counts(position);
            command.position = Position(position);
            command.mode = OperatingMode::Position;
            return command;
        }
        let actual = self.scales.position.counts(self.actual.position.0);
        self.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        if !self.follows {
            // Command values do not count: the drive stands where it is.
            self.position = actual;
            command.position = self.actual.position;
            if mode == OperatingMode::Torque {
                command.mode = OperatingMode::Velocity;
            }
            return command;
        }
        let number = |idn| store.number_of(idn);
        let sign = |idn, bit: i64| if number(idn) & 1 << bit == 0 { 1 } else { -1 };
        let whole = self
            .scales
            .unfold(sign(idn::POSITION_POLARITY, 0) * number(idn::POSITION_COMMAND), self.position);
        // Position commands begin where the drive is, whatever way it has gone without them.
        self.position = if mode == OperatingMode::Position { whole } else { actual };
        let additive = sign(idn::POSITION_POLARITY, 1) * number(idn::POSITION_ADDITIVE);
        command.position = Position(self.scales.position.generic(self.position.saturating_add(additive)));
        let velocity = |value| Velocity(self.scales.velocity.generic(value));
        command.velocity = velocity(sign(idn::VELOCITY_POLARITY, 0) * number(idn::VELOCITY_COMMAND));
        command.velocity_offset = velocity(sign(idn::VELOCITY_POLARITY, 1) * number(idn::VELOCITY_ADDITIVE));
        let torque = |value| Torque(self.scales.torque.generic(value));
        command.torque = torque(sign(idn::TORQUE_POLARITY, 0) * number(idn::TORQUE_COMMAND));
        command.torque_offset = torque(sign(idn::TORQUE_POLARITY, 1) * number(idn::TORQUE_ADDITIVE));
        if mode == OperatingMode::Position {
            self.motion.position = command.position.0;
        }
        command
    }

    /// The set-point of a motion that the drive makes up by itself: homing, or the way to S-0-0258 in an operation mode
    /// with drive-controlled interpolation.
    fn lead(&mut self, cycle: &Cycle, able: bool, mode: OperatingMode, store: &mut Store) -> Option<i64> {
        let (edge, marker) = self.probe.take_homing_edges();
        let switch = self.actual.digital_inputs & input::HOME_SWITCH != 0;
        let senses = Senses { switch, edge, marker, able, span: cycle.elapsed.0 };
        let (scales, inverted) = (self.scales, store.number_of(idn::POSITION_POLARITY) & 1 << 2 != 0);
        let counts = |position: i64| {
            let counts = scales.position.counts(position);
            scales.fold(if inverted { -counts } else { counts })
        };
        self.homing.watch(&senses, store, counts);
        self.attained = false;
        if self.homing.leads() {
            let shift = self.homing.advance(&mut self.motion, &senses, store, &scales, counts);
            if let Some(shift) = shift {
                self.displace(shift);
            }
            return able.then_some(self.motion.position);
        }
        if !self.follows || mode != OperatingMode::Position || self.mode & INTERPOLATED == 0 {
            return None;
        }
        let number = |idn| store.number_of(idn);
        let sign = if number(idn::POSITION_POLARITY) & 1 == 0 { 1 } else { -1 };
        let here = scales.position.counts(self.motion.position);
        let target = scales.position.generic(scales.unfold(sign * number(idn::TARGET_POSITION), here));
        // 0.01 %.
        let velocity = scales.velocity.generic(number(idn::POSITIONING_VELOCITY).abs());
        let velocity =
            velocity / 10_000 * number(idn::OVERRIDE) + velocity % 10_000 * number(idn::OVERRIDE) / 10_000;
        let limit = self.servo.parameters().velocity_limit.0;
        let acceleration = scales.acceleration.generic(number(idn::POSITIONING_ACCELERATION).abs()).max(1);
        let deceleration = scales.acceleration.generic(number(idn::POSITIONING_DECELERATION).abs());
        let deceleration = if deceleration > 0 { deceleration } else { acceleration };
        if velocity == 0 {
            self.motion.advance(cycle.elapsed.0, 0, Pace { velocity: 1, acceleration, deceleration });
        } else {
            let pace = Pace { velocity: velocity.min(limit), acceleration, deceleration };
            self.attained = self.motion.advance_to(cycle.elapsed.0, target, pace);
        }
        Some(self.motion.position)
    }

    /// The place of the axis gets a position that is `shift` nanounits more, and refers to the machine from now on.
    fn displace(&mut self, shift: i64) {
        let moved = |position: Position| Position(position.0.saturating_add(shift));
        self.servo.set_position(moved(self.servo.position()));
        self.actual.position = moved(self.actual.position);
        self.next.position = moved(self.next.position);
        self.motion.position = self.motion.position.saturating_add(shift);
        self.position = self.scales.position.counts(self.actual.position.0);
        self.homing.shifted(shift);
        self.referenced = true;
    }

    /// The master's order to one of the procedure commands of homing.
    fn order_homing(&mut self, idn: Idn, order: Order, store: &mut Store) -> Result<Progress, SvcError> {
        use self::homing::idn as h;
        let parameter = store.number_of(h::PARAMETER);
        let standing = self.actual.status.contains(StatusBits::STANDSTILL);
        match (idn, order) {
            (h::BY_DRIVE, Order::Start) => {
                if !self.follows || self.homing.leads() || !homing::is_possible(parameter) {
                    return Err(SvcError::NOT_EXECUTABLE);
                }
                self.probe.take_homing_edges();
                self.referenced = false;
                self.homing.start_by_drive(store, self.actual.digital_inputs & input::HOME_SWITCH != 0);
                Ok(Progress::InProcess)
            }
            (h::BY_DRIVE, Order::Cancel) => {
                self.homing.cancel_by_drive();
                Ok(Progress::Done)
            }
            (h::BY_MASTER, Order::Start) => {
                if !homing::is_possible(parameter) {
                    return Err(SvcError::NOT_EXECUTABLE);
                }
                self.probe.take_homing_edges();
                self.referenced = false;
                self.homing.start_by_master(store);
                Ok(Progress::InProcess)
            }
            (h::BY_MASTER, Order::Cancel) => {
                self.homing.cancel_by_master();
                Ok(Progress::Done)
            }
            (h::CALCULATE, Order::Start) => {
                let Some(shift) = self.homing.displacement(store, &self.scales) else {
                    return Err(SvcError::NOT_EXECUTABLE);
                };
                store.set_number_of(h::DISPLACEMENT, self.scales.position.counts(shift));
                Ok(Progress::Done)
            }
            (h::DISPLACE, Order::Start) => {
                let shift = self.homing.displacement(store, &self.scales).filter(|_| standing);
                self.displace(shift.ok_or(SvcError::NOT_EXECUTABLE)?);
                self.homing.set_displaced(true);
                Ok(Progress::Done)
            }
            (h::DISPLACE, Order::Cancel) => {
                self.homing.set_displaced(false);
                Ok(Progress::Done)
            }
            (h::CANCEL, Order::Start) => {
                self.referenced = false;
                Ok(Progress::Done)
            }
            (h::SET_ABSOLUTE, Order::Start) if standing && !self.in_operation() => {
                let sign = if store.number_of(idn::POSITION_POLARITY) & 1 << 2 == 0 { 1 } else { -1 };
                let position = sign * self.scales.position.generic(store.number_of(h::REFERENCE));
                self.displace(position.saturating_sub(self.servo.position().0));
                Ok(Progress::Done)
            }
            (h::CALCULATE | h::CANCEL | h::SET_ABSOLUTE, Order::Cancel) => Ok(Progress::Done),
            _ => Err(SvcError::NOT_EXECUTABLE),
        }
    }

    /// The command for the time up to now: the set-points of a telegram count from the synchronisation after it, so that
    /// all drives of a line follow at the same instant. Everything else counts at once.
    fn synchronous(&mut self, command: ServoCommand) -> ServoCommand {
        let points = core::mem::replace(&mut self.next, command);
        if points.mode != command.mode {
            // Those of another operation mode lead nowhere.
            return command;
        }
        ServoCommand {
            position: points.position,
            velocity: points.velocity,
            torque: points.torque,
            velocity_offset: points.velocity_offset,
            torque_offset: points.torque_offset,
            ..command
        }
    }

    /// Travel limits S-0-0049 and S-0-0050, where S-0-0055 bit 4 enables them.
    fn watch_travel(&mut self, store: &Store) {
        const ENABLED: i64 = 1 << 4;
        let position = self.scales.position.counts(self.actual.position.0);
        let enabled = store.number_of(idn::POSITION_POLARITY) & ENABLED != 0;
        let beyond = [
            (
                FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE,
                position > store.number_of(idn::POSITION_LIMIT_POSITIVE),
            ),
            (
                FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE,
                position < store.number_of(idn::POSITION_LIMIT_NEGATIVE),
            ),
        ];
        for (cause, beyond) in beyond {
            if enabled && beyond { self.servo.raise_fault(cause) } else { self.servo.clear_fault(cause) }
        }
    }

    /// Feedback values and status words into the store.
    fn publish(&self, cycle: &Cycle, store: &mut Store) {
        let actual = &self.actual;
        let number = |store: &Store, idn| store.number_of(idn);
        let sign = |store: &Store, idn, bit: i64| if number(store, idn) & 1 << bit == 0 { 1 } else { -1 };
        let counts = self.scales.position.counts(actual.position.0);
        for (idn, bit) in
            [(idn::POSITION_FEEDBACK, 2), (idn::POSITION_FEEDBACK_2, 3), (idn::ACTIVE_POSITION, 2)]
        {
            let polarity = sign(store, idn::POSITION_POLARITY, bit);
            store.set_number_of(idn, self.scales.fold(polarity * counts));
        }
        let following = self.scales.position.counts(actual.following_error.0);
        store.set_number_of(idn::FOLLOWING_DISTANCE, following);
        let polarity = sign(store, idn::VELOCITY_POLARITY, 2);
        store
            .set_number_of(idn::VELOCITY_FEEDBACK, polarity * self.scales.velocity.counts(actual.velocity.0));
        let polarity = sign(store, idn::TORQUE_POLARITY, 2);
        store.set_number_of(idn::TORQUE_FEEDBACK, polarity * self.scales.torque.counts(actual.torque.0));
        store.set_number_of(idn::BUS_VOLTAGE, actual.bus_voltage.0 / 1_000_000);
        let motor = scaling::temperature(store, actual.temperature.0);
        store.set_number_of(idn::MOTOR_TEMPERATURE, motor);
        // The amplifier warms half as much as the motor; it is always in the unit of element 4.
        let ambient = self.servo.parameters().ambient_temperature;
        store.set_number_of(idn::AMPLIFIER_TEMPERATURE, (actual.temperature.0 + ambient.0) / 200);
        store.set_number_of(idn::POSITION_STATUS, i64::from(self.referenced));
        store.set_number_of(idn::STATUS, i64::from(self.class_3(store)));
        let errors = self.diagnosis().errors;
        let manufacturer = errors & 1 << fault::MANUFACTURER != 0;
        store.set_number_of(idn::MANUFACTURER_ERRORS, i64::from(manufacturer));
        if self.actual.fault == Some(FaultCause::ILLEGAL_MODE) {
            const UNDEFINED_MODE: i64 = 1 << 9;
            let status = store.number_of(communication::idn::INTERFACE_STATUS);
            store.set_number_of(communication::idn::INTERFACE_STATUS, status | UNDEFINED_MODE);
        }
        store.set_number_of(Idn::DRIVE_STATUS, i64::from(self.status(cycle).bits()));
    }

    /// Takes captured positions over as feedback values.
    fn collect_probes(&mut self, store: &mut Store) {
        const POLARITY: i64 = 1 << 2;
        let inverted = store.number_of(idn::POSITION_POLARITY) & POLARITY != 0;
        let scales = self.scales;
        let counts = |position: Position| {
            let counts = scales.position.counts(position.0);
            scales.fold(if inverted { -counts } else { counts })
        };
        self.probe.collect(&mut self.servo, store, counts);
    }

    /// S-0-0013.
    fn class_3(&self, store: &Store) -> u16 {
        let status = self.actual.status;
        let velocity = self.scales.velocity.counts(self.actual.velocity.0).abs();
        let torque = self.scales.torque.counts(self.actual.torque.0).abs();
        let bits = [
            status.contains(StatusBits::AT_VELOCITY),
            status.contains(StatusBits::STANDSTILL),
            velocity < store.number_of(idn::VELOCITY_THRESHOLD),
            torque >= store.number_of(idn::TORQUE_THRESHOLD),
            status.contains(StatusBits::TORQUE_LIMIT),
            status.contains(StatusBits::VELOCITY_LIMIT),
            status.contains(StatusBits::IN_POSITION),
        ];
        const ATTAINED: u32 = 12;
        let attained = u16::from(self.attained) << ATTAINED;
        bits.iter().rev().fold(0, |word, &bit| word << 1 | u16::from(bit)) | attained
    }

    /// S-0-0135.
    fn status(&self, cycle: &Cycle) -> DriveStatus {
        let ready = match (cycle.state, self.actual.report) {
            (State::In(Phase::CP4), Report::Operating | Report::Halted | Report::Stopping) => {
                ReadyState::InOperation
            }
            (State::In(Phase::CP4), Report::FaultReaction) => ReadyState::InOperation,
            (State::In(Phase::CP4), Report::Ready | Report::Enabling) => ReadyState::PowerOn,
            (State::In(Phase::CP4), Report::AwaitingPower) => ReadyState::ReadyForPower,
            (State::In(Phase::CP4), Report::Faulted) => self.locked_ready,
            _ => ReadyState::NotReady,
        };
        let diagnosis = self.diagnosis();
        let mut status = DriveStatus::empty().with_ready(ready).with_mode(self.mode_number);
        status.set(DriveStatus::ERROR, diagnosis.errors != 0);
        status.set(DriveStatus::WARNING, diagnosis.warnings != 0);
        status.set(DriveStatus::REFERENCED, self.referenced);
        if !self.silent {
            status.set(DriveStatus::HALT, self.actual.report == Report::Halted);
            status.set(DriveStatus::FOLLOWS, self.follows && self.actual.report == Report::Operating);
        }
        status
    }

    fn own_warnings(&self) -> u16 {
        let parameters = self.servo.parameters();
        let hot = self.actual.temperature.0 > parameters.max_temperature.0 - TEMPERATURE_MARGIN_MILLIDEGREE;
        let overload = self.actual.overload > OVERLOAD_WARNING_PPM;
        let raised = self.actual.warning.map_or(0, |cause| 1 << fault::class_2_bit(cause));
        self.warnings | raised | u16::from(overload) | u16::from(hot) << 2
    }
}

/// A delay parameter in 0.1 ms.
fn tenth_millis(store: &Store, idn: Idn) -> DurationNs {
    DurationNs(store.number_of(idn).saturating_mul(100_000))
}

impl Application for Drive {
    fn define(&mut self, store: &mut Store) {
        parameters::define(store, self.servo.parameters());
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
        if idn == homing::idn::PARAMETER {
            return if homing::is_possible(value(2)) { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        if idn == idn::POSITION_GAIN {
            let gain = value(2).saturating_mul(1_000_000) / 6;
            let parameters = ServoParameters { position_gain: gain, ..*self.servo.parameters() };
            return if self.is_possible(parameters) { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        let preferential =
            |factors: &[Idn], kind: Idn| factors.contains(&idn) && store.number_of(kind) & 8 == 0;
        use self::scaling::idn as s;
        let fixed = preferential(&[s::POSITION_FACTOR, s::POSITION_EXPONENT], s::POSITION_TYPE)
            || preferential(&[s::VELOCITY_FACTOR, s::VELOCITY_EXPONENT], s::VELOCITY_TYPE)
            || preferential(&[s::ACCELERATION_FACTOR, s::ACCELERATION_EXPONENT], s::ACCELERATION_TYPE)
            || preferential(&[s::TORQUE_FACTOR, s::TORQUE_EXPONENT], s::TORQUE_TYPE);
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
        if idn == probe::idn::COMMAND {
            Ok(self.probe.order(order))
        } else {
            self.order_homing(idn, order, store)
        }
    }

    fn progress(&mut self, idn: Idn, _: &mut Store) -> Progress {
        match idn {
            // Probing goes on until it is cancelled.
            probe::idn::COMMAND => Progress::InProcess,
            homing::idn::BY_DRIVE => self.homing.progress_by_drive(),
            homing::idn::BY_MASTER => self.homing.progress_by_master(),
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
                    invalid.push(idn::POSITION_GAIN);
                }
            }
        }
        if store.number_of(idn::MODE) == 0 {
            invalid.push(idn::MODE);
        }
        let limits =
            [idn::POSITION_LIMIT_NEGATIVE, idn::POSITION_LIMIT_POSITIVE].map(|idn| store.number_of(idn));
        if store.number_of(idn::POSITION_POLARITY) & 1 << 4 != 0 && limits[0] >= limits[1] {
            invalid.push(idn::POSITION_LIMIT_POSITIVE);
        }
    }

    fn cycle(&mut self, cycle: Cycle, store: &mut Store) {
        let [low, high, ..] = store.number_of(Idn::DRIVE_CONTROL).to_le_bytes();
        let received = DriveControl::from_bits_retain(u16::from_le_bytes([low, high]));
        let enabling = DriveControl::ON.union(DriveControl::ENABLE);
        if cycle.connected {
            self.control = received;
            self.locked &= received.contains(enabling);
        } else if cycle.state != State::In(Phase::CP4) && !self.in_operation() {
            self.control = DriveControl::empty();
            self.locked = false;
        } else if self.in_operation() {
            self.locked = true;
        }
        let wants = self.control.contains(enabling) && cycle.connected;
        let mode = self.select_mode(cycle.elapsed, store);
        if mode.is_none() && wants {
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
        let warnings = self.own_warnings();
        let Some(cause) = self.actual.fault else {
            let bit = warnings.trailing_zeros();
            return match fault::CLASS_2_TEXTS.get(usize::try_from(bit).unwrap_or(usize::MAX)) {
                Some(text) => Diagnosis { errors: 0, warnings, number: fault::number(0xE, bit), text },
                None => Diagnosis { errors: 0, warnings, number: 0, text: "" },
            };
        };
        let bit = fault::class_1_bit(cause);
        Diagnosis {
            errors: 1 << bit | self.further_errors,
            warnings,
            number: fault::number(0xF, u32::from(bit)),
            text: fault::CLASS_1_TEXTS[usize::from(bit & 15)],
        }
    }

    fn reset(&mut self, _: &mut Store) -> bool {
        if self.actual.fault.is_none() {
            return true;
        }
        // A stop that is going on goes on; the fault is not reset then.
        let command = ServoCommand {
            control: ServoControl::Disable,
            power: self.main_power,
            reset_fault: true,
            ..ServoCommand::default()
        };
        self.actual = self.servo.step(1, &command);
        // Bits that still stand do not switch the drive on again.
        self.locked = true;
        self.actual.fault.is_none()
    }
}

#[cfg(test)]
mod tests;
