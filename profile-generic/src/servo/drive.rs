//! The drive: its states, its faults, and the step that puts everything together.

use super::captures::Captures;
use super::control::{Control, Offsets, Target};
use super::marks::{self, Marks, Stretch};
use super::plant::{self, Plant, nano, parts, ppm, seconds, units};
use super::{
    MAX_ACTIVE_FAULTS, MAX_STEP, SUB_STEP, ServoActual, ServoCommand, ServoControl, ServoError,
    ServoParameters, input,
};
use crate::capture::{CaptureRequest, CaptureResult, CaptureSource, CaptureWindow};
use crate::cast;
use crate::fault::{FaultCause, Reaction};
use crate::image::StatusBits;
use crate::mode::OperatingMode;
use crate::quantity::{Acceleration, Current, Position, Temperature, Torque, Velocity, Voltage};
use crate::ratio::{Ratio, Rounding};
use crate::scaling::{AxisScaling, fold};
use crate::state::Report;
use crate::time::{DurationNs, MonotonicTime};
use arrayvec::ArrayVec;

/// Velocity in parts of the limit from which the drive faults.
const OVER_SPEED: f64 = 1.2;

/// Use of the overload model from which the drive faults.
const OVERLOAD: f64 = 1.1;

/// What the drive is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// No torque.
    Off,
    /// Building up torque; the time that is left.
    Starting(DurationNs),
    /// Following set-points.
    Following,
    /// Slowing down along a ramp that is at this velocity.
    Stopping { ramp: f64, then: Afterwards },
    /// Standing with torque at this position.
    Holding(Position),
}

/// What comes after a controlled stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Afterwards {
    Off,
    Hold,
}

/// A simulated servo axis; see the module documentation.
#[derive(Clone, Debug)]
pub struct Servo {
    parameters: ServoParameters,
    to_counts: Ratio,
    from_counts: Ratio,
    plant: Plant,
    control: Control,
    captures: Captures,
    stage: Stage,
    /// A command to have no torque was seen while the drive was ready.
    armed: bool,
    reset_before: bool,
    registration: [bool; 2],
    inputs: u32,
    /// The position set-point at the end of the last step, in position control.
    set_point: Option<Position>,
    /// Faults whose condition is present.
    active: ArrayVec<FaultCause, MAX_ACTIVE_FAULTS>,
    latched: Option<(FaultCause, Reaction)>,
    warning: Option<FaultCause>,
    /// How long the DC bus has been charged, up to the power-up time.
    charged_for: DurationNs,
    /// How long the brake has been closing at the end of a stop.
    closing: DurationNs,
    /// Feedback values are those of the last step before.
    frozen: bool,
    last: ServoActual,
    now: MonotonicTime,
}

impl Servo {
    /// A servo at standstill, without power.
    ///
    /// # Errors
    /// [`ServoError`] names the parameter that is out of range, or that makes the loops unstable.
    pub fn new(parameters: ServoParameters) -> Result<Self, ServoError> {
        plant::check(&parameters)?;
        let scaling = AxisScaling::new(parameters.kind, i64::from(parameters.encoder_counts), 1)
            .ok_or(ServoError::OutOfRange("encoder_counts"))?;
        Ok(Self {
            parameters,
            to_counts: scaling.to_counts(),
            from_counts: scaling.from_counts(),
            plant: Plant::new(&parameters)?,
            control: Control::new(&parameters)?,
            captures: Captures::new(marks::of_feedback(&parameters)),
            stage: Stage::Off,
            armed: false,
            reset_before: false,
            registration: [false; 2],
            inputs: 0,
            set_point: None,
            active: ArrayVec::new(),
            latched: None,
            warning: None,
            charged_for: DurationNs::ZERO,
            closing: DurationNs::ZERO,
            frozen: false,
            last: ServoActual::default(),
            now: MonotonicTime::ZERO,
        })
    }

    /// Mechanics, loops and limits as they are now.
    pub const fn parameters(&self) -> &ServoParameters {
        &self.parameters
    }

    /// Changes the parameters while the axis goes on as it is.
    ///
    /// # Errors
    /// As [`Servo::new`]; the servo is then unchanged. The start position and the parameters of the encoder
    /// and the motor have no effect any more: they are refused when they differ.
    pub fn set_parameters(&mut self, parameters: ServoParameters) -> Result<(), ServoError> {
        let fixed = |of: &ServoParameters| {
            (of.kind, of.encoder_counts, of.encoder_bits, of.rated_torque, of.inertia, of.start_position)
        };
        if fixed(&parameters) != fixed(&self.parameters) {
            return Err(ServoError::OutOfRange("motor and encoder"));
        }
        let fresh = Self::new(parameters)?;
        self.control = fresh.control.resuming(&self.control);
        self.plant.retune(&fresh.plant);
        self.captures.set_markers(marks::of_feedback(&parameters));
        self.parameters = parameters;
        Ok(())
    }

    /// Sets the simulated instant; each step moves it on.
    pub fn set_time(&mut self, now: MonotonicTime) {
        self.now = now;
    }

    /// Gives the place where the axis is a new position, as homing does. The set-point of position control
    /// moves along, so that nothing jumps.
    pub fn set_position(&mut self, position: Position) {
        let shift = position.saturating_sub(self.plant.position());
        self.plant.set_position(position);
        self.set_point = self.set_point.map(|set_point| set_point.saturating_add(shift));
        if let Stage::Holding(place) = &mut self.stage {
            *place = place.saturating_add(shift);
        }
    }

    /// Lets the encoder count a motion that there was none: a slipped coupling, lost lines. Set-points stay, so that an
    /// axis with position control goes back by this distance.
    pub fn jump_position(&mut self, distance: Position) {
        self.plant.set_position(self.plant.position().saturating_add(distance));
    }

    /// Freezes the feedback values that the drive shows, position, velocity, acceleration, torque, current and following
    /// error, as they are now, or lets them go on. The loops see the true ones.
    pub fn set_frozen(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Raises a warning, or ends it. It stops nothing.
    pub fn set_warning(&mut self, warning: Option<FaultCause>) {
        self.warning = warning;
    }

    /// Where the axis is, to the nanounit: what the encoder cannot show.
    pub const fn position(&self) -> Position {
        self.plant.position()
    }

    /// Sets the torque with which the load works against positive motion.
    pub fn set_load(&mut self, torque: Torque) {
        self.plant.load = parts(torque.0);
    }

    /// Sets the digital inputs from bit [`input::USER_SHIFT`] up.
    pub fn set_inputs(&mut self, inputs: u32) {
        self.inputs = inputs << input::USER_SHIFT;
    }

    /// Sets where the home switch is active.
    pub fn set_home_switch(&mut self, window: Option<CaptureWindow>) {
        self.captures.set_home_switch(window);
    }

    /// Sets the marks that switch a registration input, 1 or 2, while the axis passes them; any other number changes
    /// nothing. What [`Servo::set_registration`] has set counts beside them.
    pub fn set_marks(&mut self, number: usize, marks: Option<Marks>) {
        self.captures.set_marks(number, marks);
    }

    /// Sets a registration input, 1 or 2; any other number changes nothing.
    pub fn set_registration(&mut self, number: usize, active: bool) {
        let source = match number {
            1 => CaptureSource::Registration1,
            2 => CaptureSource::Registration2,
            _ => return,
        };
        let before = core::mem::replace(&mut self.registration[number - 1], active);
        if before != active {
            self.captures.on_input(source, active, self.plant.position(), self.now);
        }
    }

    /// Arms or disarms a capture.
    pub fn capture(&mut self, request: CaptureRequest) {
        self.captures.request(request, self.now);
    }

    /// Takes the oldest result of a capture.
    pub fn poll_capture(&mut self) -> Option<CaptureResult> {
        self.captures.poll()
    }

    /// Raises a fault with its default reaction; its condition stays until [`Servo::clear_fault`].
    pub fn raise_fault(&mut self, cause: FaultCause) {
        self.raise_fault_with(cause, cause.default_reaction());
    }

    /// Raises a fault with another reaction. A reaction that does not stop the axis leaves it as it is.
    pub fn raise_fault_with(&mut self, cause: FaultCause, reaction: Reaction) {
        if reaction.stops() && !self.active.contains(&cause) {
            // Beyond the list the fault is latched all the same, and can be reset without being cleared.
            let _ = self.active.try_push(cause);
        }
        self.latch(cause, reaction);
    }

    /// Ends the condition of a fault; the fault stays latched until it is reset.
    pub fn clear_fault(&mut self, cause: FaultCause) {
        self.active.retain(|active| *active != cause);
    }

    /// Ends the condition of a fault, and the fault with it, as in a drive that resets itself: it goes on with the stop that it has
    /// begun, and then can be enabled again.
    pub fn recover(&mut self, cause: FaultCause) {
        self.clear_fault(cause);
        if self.active.is_empty() {
            self.latched = None;
        }
    }

    /// Takes the torque away without a word, as a drive does whose enable input is opened.
    pub fn lose_torque(&mut self) {
        self.switch_off();
        self.armed = false;
    }

    /// Ends the conditions of all faults.
    pub fn clear_faults(&mut self) {
        self.active.clear();
    }

    /// Lets `dt_ns` nanoseconds pass with these inputs. Longer steps than [`MAX_STEP`] and such below one
    /// nanosecond are held at these ends.
    pub fn step(&mut self, dt_ns: i64, command: &ServoCommand) -> ServoActual {
        let whole = dt_ns.clamp(1, MAX_STEP.0);
        let count = (whole + SUB_STEP.0 - 1) / SUB_STEP.0;
        self.obey(command);
        let goal = self.position_goal(command);
        let from = self.set_point.or(goal);
        let mut done = 0;
        for number in 1..=count {
            let until = whole * number / count;
            let set_point = goal.zip(from).map(|(goal, from)| {
                let way = i128::from(goal.0) - i128::from(from.0);
                let passed = way * i128::from(until) / i128::from(whole);
                // Between two 64-bit numbers.
                Position(i64::try_from(i128::from(from.0) + passed).unwrap_or(goal.0))
            });
            let speed = match (goal, from) {
                (Some(goal), Some(from)) => units(goal.0.saturating_sub(from.0)) / seconds(DurationNs(whole)),
                _ => 0.0,
            };
            let before = self.plant;
            self.sub_step(DurationNs(until - done), command, set_point.map(|place| (place, speed)));
            done = until;
            // Without torque, a plant that does not change in one sub-step does not change in the others.
            if self.stage == Stage::Off && self.plant == before {
                self.pass(DurationNs(whole - done), before.position());
                break;
            }
        }
        let actual = self.actual(command);
        self.last = if self.frozen { stale(actual, &self.last) } else { actual };
        self.last
    }

    /// The position set-point at the end of this step, when position control is on.
    fn position_goal(&self, command: &ServoCommand) -> Option<Position> {
        let follows = matches!(self.stage, Stage::Following | Stage::Starting(_));
        (follows && command.mode == OperatingMode::Position).then_some(command.position)
    }

    /// Takes the control word.
    // Flat: one arm per control value, once faults are seen to.
    fn obey(&mut self, command: &ServoCommand) {
        let reset = command.reset_fault && !self.reset_before;
        self.reset_before = command.reset_fault;
        if reset && self.latched.is_some() && self.active.is_empty() {
            self.reset_fault();
        }
        if !command.power && self.has_torque() {
            self.latch(FaultCause::POWER_LOSS, Reaction::CoastAndDisable);
        }
        if self.latched.is_some() {
            self.armed = false;
            match command.control {
                ServoControl::TorqueOff => self.switch_off(),
                ServoControl::Disable if matches!(self.stage, Stage::Holding(_)) => {
                    self.begin_stop(Afterwards::Off);
                }
                _ => {}
            }
            return;
        }
        match command.control {
            ServoControl::TorqueOff => {
                self.switch_off();
                self.armed = self.is_ready();
            }
            ServoControl::Disable => self.disable(),
            ServoControl::Halt if matches!(self.stage, Stage::Following) => self.begin_stop(Afterwards::Hold),
            ServoControl::Halt => {}
            ServoControl::Enable => self.enable(command),
        }
    }

    fn reset_fault(&mut self) {
        match self.stage {
            Stage::Off => self.latched = None,
            // An enable that still stands must not move the axis when the fault goes, so the hold ends in a stop.
            Stage::Holding(_) => {
                self.latched = None;
                self.begin_stop(Afterwards::Off);
            }
            _ => {}
        }
    }

    fn disable(&mut self) {
        match self.stage {
            Stage::Off => self.armed = self.is_ready(),
            Stage::Starting(_) => self.switch_off(),
            Stage::Stopping { ramp, .. } => self.stage = Stage::Stopping { ramp, then: Afterwards::Off },
            Stage::Following | Stage::Holding(_) => self.begin_stop(Afterwards::Off),
        }
    }

    fn enable(&mut self, command: &ServoCommand) {
        match self.stage {
            Stage::Off if self.armed && self.is_ready() && command.power => match command.mode {
                OperatingMode::None => {}
                OperatingMode::Homing => self.latch(FaultCause::ILLEGAL_MODE, Reaction::default()),
                _ => {
                    self.armed = false;
                    self.control.reset();
                    let time = self.parameters.starting_time + self.parameters.brake_time;
                    self.stage = Stage::Starting(time);
                }
            },
            // A halt ends when the drive is enabled again; a stop that was to end without torque does not.
            Stage::Holding(_) | Stage::Stopping { then: Afterwards::Hold, .. } => {
                self.stage = Stage::Following;
            }
            _ => {}
        }
    }

    /// Whether the DC bus has its voltage, and the power-up time is over.
    fn is_ready(&self) -> bool {
        self.plant.is_charged() && self.charged_for >= self.parameters.power_up_time
    }

    const fn has_torque(&self) -> bool {
        !matches!(self.stage, Stage::Off)
    }

    fn switch_off(&mut self) {
        self.stage = Stage::Off;
        self.set_point = None;
    }

    fn begin_stop(&mut self, then: Afterwards) {
        self.stage = Stage::Stopping { ramp: self.plant.velocity, then };
        self.set_point = None;
        self.closing = DurationNs::ZERO;
    }

    /// Latches a fault and begins its reaction; a fault that is latched already gives way only to a stronger
    /// one.
    fn latch(&mut self, cause: FaultCause, reaction: Reaction) {
        if !reaction.stops() || self.latched.is_some_and(|(_, latched)| latched >= reaction) {
            return;
        }
        self.latched = Some((cause, reaction));
        self.armed = false;
        match (self.stage, reaction) {
            (Stage::Off, _) => {}
            (Stage::Starting(_), _) | (_, Reaction::CoastAndDisable | Reaction::Shutdown) => {
                self.switch_off()
            }
            (Stage::Stopping { ramp, then }, Reaction::DecelerateAndDisable) if then != Afterwards::Off => {
                self.stage = Stage::Stopping { ramp, then: Afterwards::Off };
            }
            (Stage::Stopping { .. }, _) => {}
            (_, Reaction::HoldPosition) => self.begin_stop(Afterwards::Hold),
            _ => self.begin_stop(Afterwards::Off),
        }
    }

    fn sub_step(&mut self, time: DurationNs, command: &ServoCommand, set_point: Option<(Position, f64)>) {
        if time <= DurationNs::ZERO {
            return;
        }
        let time_s = seconds(time);
        self.advance_stage(time, time_s);
        let seen = self.seen_position();
        let mut offsets = Offsets::default();
        let target = match self.stage {
            Stage::Off => None,
            Stage::Starting(_) => {
                self.set_point = set_point.map(|(place, _)| place);
                Some(Target::Torque(0.0))
            }
            Stage::Stopping { ramp, .. } => Some(Target::Velocity(ramp)),
            Stage::Holding(place) => Some(Target::Position(place, 0.0)),
            Stage::Following => {
                offsets.velocity = units(command.velocity_offset.0);
                offsets.torque = parts(command.torque_offset.0);
                self.set_point = set_point.map(|(place, _)| place);
                Some(match (command.mode, set_point) {
                    (OperatingMode::Position, Some((place, speed))) => Target::Position(place, speed),
                    (OperatingMode::Acceleration, _) => {
                        Target::Torque(units(command.acceleration.0) / self.plant.gain)
                    }
                    (OperatingMode::Torque, _) => Target::Torque(parts(command.torque.0)),
                    (OperatingMode::Velocity, _) => Target::Velocity(units(command.velocity.0)),
                    _ => Target::Velocity(0.0),
                })
            }
        };
        let from = self.plant.position();
        let torque = target.map(|target| self.control.torque(target, offsets, seen, &self.plant, time_s));
        self.plant.step(time_s, torque, command.power);
        self.pass(time, from);
        self.supervise(command);
    }

    /// Time has passed in which the axis has moved from `from` to where it is.
    fn pass(&mut self, time: DurationNs, from: Position) {
        self.charged_for = if self.plant.is_charged() {
            (self.charged_for + time).min(self.parameters.power_up_time)
        } else {
            DurationNs::ZERO
        };
        let stretch = Stretch { from, to: self.plant.position(), begin: self.now, length: time };
        self.captures.on_motion(&stretch);
        self.now = self.now + time;
    }

    fn advance_stage(&mut self, time: DurationNs, time_s: f64) {
        match &mut self.stage {
            Stage::Starting(left) => {
                *left = *left - time;
                if *left <= DurationNs::ZERO {
                    self.stage = Stage::Following;
                }
            }
            Stage::Stopping { ramp, then } => {
                let step = units(self.parameters.deceleration_limit.0) * time_s;
                *ramp = if ramp.abs() <= step { 0.0 } else { *ramp - step.copysign(*ramp) };
                let stands = self.plant.velocity.abs() <= units(self.parameters.standstill_window.0);
                if *ramp == 0.0 && stands {
                    match then {
                        Afterwards::Off if self.closing >= self.parameters.brake_time => self.switch_off(),
                        Afterwards::Off => self.closing = self.closing + time,
                        Afterwards::Hold => self.stage = Stage::Holding(self.plant.position()),
                    }
                }
            }
            Stage::Off | Stage::Following | Stage::Holding(_) => {}
        }
    }

    /// Watches what a drive watches by itself.
    fn supervise(&mut self, command: &ServoCommand) {
        if !self.has_torque() {
            return;
        }
        let tolerance = self.parameters.position_error_tolerance.0;
        let error = self.following_error().0.saturating_abs();
        if self.stage == Stage::Following && tolerance > 0 && error > tolerance {
            self.latch(FaultCause::EXCESSIVE_POSITION_ERROR, Reaction::DecelerateAndDisable);
        }
        if self.plant.velocity.abs() > OVER_SPEED * self.control.velocity_limit {
            self.latch(FaultCause::MOTOR_OVER_SPEED, Reaction::CoastAndDisable);
        }
        if self.temperature() > self.parameters.max_temperature {
            self.latch(FaultCause::MOTOR_OVER_TEMPERATURE, Reaction::CoastAndDisable);
        }
        if self.plant.overload > OVERLOAD {
            self.latch(FaultCause::MOTOR_OVERLOAD, Reaction::DecelerateAndDisable);
        }
        if self.stage == Stage::Following && command.mode == OperatingMode::Homing {
            self.latch(FaultCause::ILLEGAL_MODE, Reaction::DecelerateAndDisable);
        }
    }

    /// The encoder's counts, not wrapped.
    fn counts(&self) -> i64 {
        self.to_counts.convert(self.plant.position().0, Rounding::Floor).value
    }

    /// The position as the encoder shows it.
    fn seen_position(&self) -> Position {
        Position(self.from_counts.convert(self.counts(), Rounding::Nearest).value)
    }

    fn following_error(&self) -> Position {
        let set_point = match self.stage {
            Stage::Holding(place) => Some(place),
            _ => self.set_point,
        };
        set_point.map_or(Position::ZERO, |set_point| set_point.saturating_sub(self.seen_position()))
    }

    fn temperature(&self) -> Temperature {
        let rise = cast::f64_from_i64(self.parameters.temperature_rise.0) * self.plant.warmth();
        Temperature(self.parameters.ambient_temperature.0.saturating_add(cast::i64_from_f64(rise)))
    }

    fn report(&self) -> Report {
        match (self.stage, self.latched) {
            (Stage::Off, Some(_)) => Report::Faulted,
            (Stage::Stopping { .. }, Some(_)) => Report::FaultReaction,
            (Stage::Off, None) if self.is_ready() => Report::Ready,
            (Stage::Off, None) => Report::AwaitingPower,
            (Stage::Starting(_), _) => Report::Enabling,
            (Stage::Following, _) => Report::Operating,
            (Stage::Stopping { then: Afterwards::Hold, .. }, None) => Report::Operating,
            (Stage::Stopping { then: Afterwards::Off, .. }, None) => Report::Stopping,
            (Stage::Holding(_), _) => Report::Halted,
        }
    }

    fn status(&self, command: &ServoCommand, report: Report) -> StatusBits {
        let window = units(self.parameters.standstill_window.0);
        let follows = self.stage == Stage::Following;
        let error = self.following_error().0.saturating_abs();
        let velocity_error = self.plant.velocity - units(command.velocity.0);
        let mut status = StatusBits::empty();
        status.set(StatusBits::READY, matches!(report, Report::Ready));
        status.set(StatusBits::POWER, self.is_ready());
        status.set(StatusBits::ENABLED, self.has_torque());
        status.set(StatusBits::TRACKING, follows);
        let positions = follows && command.mode == OperatingMode::Position;
        status.set(StatusBits::IN_POSITION, positions && error <= self.parameters.in_position_window.0);
        let speeds = follows && command.mode == OperatingMode::Velocity;
        status.set(
            StatusBits::AT_VELOCITY,
            speeds && velocity_error.abs() <= units(self.parameters.at_velocity_window.0),
        );
        status.set(StatusBits::STANDSTILL, self.plant.velocity.abs() <= window);
        status.set(StatusBits::VELOCITY_LIMIT, self.has_torque() && self.control.velocity_limited);
        status.set(StatusBits::TORQUE_LIMIT, self.has_torque() && self.control.torque_limited);
        status.set(StatusBits::HALT, report == Report::Halted);
        status.set(StatusBits::FAULT, self.latched.is_some());
        let moves_brake = self.parameters.brake_time > DurationNs::ZERO
            && (matches!(self.stage, Stage::Starting(_)) || self.closing > DurationNs::ZERO);
        status.set(StatusBits::BRAKE_RELEASED, self.has_torque() && !moves_brake);
        status.set(StatusBits::WARNING, self.warning.is_some());
        status
    }

    fn actual(&self, command: &ServoCommand) -> ServoActual {
        let place = self.plant.position();
        let marked = |number| self.registration[number] || self.captures.is_marked(number + 1, place);
        let bits = [
            (self.captures.home_switch_at(place), input::HOME_SWITCH),
            (marked(0), input::REGISTRATION_1),
            (marked(1), input::REGISTRATION_2),
        ];
        let report = self.report();
        let current = cast::f64_from_i64(self.parameters.rated_current.0) * self.plant.torque;
        let voltage = cast::f64_from_i64(self.parameters.bus_voltage.0) * self.plant.bus_voltage();
        ServoActual {
            report,
            position: self.seen_position(),
            encoder: fold(self.counts(), 1 << self.parameters.encoder_bits),
            velocity: Velocity(nano(self.plant.velocity)),
            acceleration: Acceleration(nano(self.plant.acceleration)),
            torque: Torque(ppm(self.plant.torque)),
            current: Current(cast::i64_from_f64(current)),
            bus_voltage: Voltage(cast::i64_from_f64(voltage)),
            temperature: self.temperature(),
            overload: ppm(self.plant.overload),
            following_error: self.following_error(),
            digital_inputs: bits
                .iter()
                .fold(self.inputs, |inputs, (set, bit)| inputs | if *set { *bit } else { 0 }),
            status: self.status(command, report),
            fault: self.latched.map(|(cause, _)| cause),
            warning: self.warning,
            at: self.now,
        }
    }
}

/// The state of now with the feedback values of before.
fn stale(now: ServoActual, before: &ServoActual) -> ServoActual {
    ServoActual {
        position: before.position,
        encoder: before.encoder,
        velocity: before.velocity,
        acceleration: before.acceleration,
        torque: before.torque,
        current: before.current,
        following_error: before.following_error,
        ..now
    }
}
