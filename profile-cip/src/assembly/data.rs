//! The values of one axis in an assembly: from bytes and to bytes.

use core::fmt;

use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::time::SystemTime;

use super::field::{InputField, OutputField};
use super::handshake::{Control, Refusal, Status};
use super::layout::{Assemblies, DriveMode, Layout, SPEED_LEN_MAX, TORQUE_SCALE_MAX};
use crate::devicenet::wire::speed::{SpeedActual, SpeedCommand, SpeedControl, SpeedStatus, SupervisorState};
use crate::wire::{Reader, Writer};

/// Nanounits of a revolution or millimetre.
const NANO: i128 = 1_000_000_000;
/// Of a torque in thousandths of the rated one, in the units of [`Torque`].
const TORQUE_STEP: i64 = 1_000;

/// Units of [`Torque`], and micronewtonmetres, in a whole.
const MILLION: i128 = 1_000_000;

/// What the values of an axis are counted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    /// Counts that make a revolution or millimetre, above zero.
    pub counts_per_unit: u32,
    /// Rated torque of the motor, uNm; 0 where it is not known, and no torque can be in Nm.
    pub rated_torque: i64,
}

impl Scale {
    /// Nanounits of so many counts, rounded to the nearest; `None` beyond 64 bits.
    #[must_use]
    pub fn nano(self, counts: i64) -> Option<i64> {
        i64::try_from(rounded(i128::from(counts) * NANO, i128::from(self.counts_per_unit.max(1)))).ok()
    }

    /// Counts of so many nanounits, rounded to the nearest; `None` beyond 64 bits.
    #[must_use]
    pub fn counts(self, nano: i64) -> Option<i64> {
        i64::try_from(rounded(i128::from(nano) * i128::from(self.counts_per_unit), NANO)).ok()
    }

    /// The torque that is so many Nm / 2^`torque_scale`, rounded to the nearest; `None` beyond 64 bits, or where the rated torque is not
    /// known.
    #[must_use]
    pub fn torque(self, units: i16, torque_scale: i8) -> Option<Torque> {
        let rated = i128::from(self.rated_torque);
        let parts = i128::from(units) * MILLION * MILLION;
        let (parts, divisor) = shifted(parts, rated, torque_scale);
        (rated > 0).then(|| i64::try_from(rounded(parts, divisor)).ok().map(Torque)).flatten()
    }

    /// A torque in Nm / 2^`torque_scale`, rounded to the nearest and held at the ends of 16 bits; 0 where the rated torque is not known.
    #[must_use]
    pub fn torque_units(self, torque: Torque, torque_scale: i8) -> i16 {
        let torque = i128::from(torque.get()) * i128::from(self.rated_torque.max(0));
        let (divisor, torque) = shifted(MILLION * MILLION, torque, torque_scale);
        held(rounded(torque, divisor))
    }
}

/// A value times 2^-`places`, as two factors of which the other one divides.
fn shifted(value: i128, divisor: i128, places: i8) -> (i128, i128) {
    let by = 1 << u32::from(places.unsigned_abs().min(TORQUE_SCALE_MAX.unsigned_abs()));
    if places < 0 { (value.saturating_mul(by), divisor) } else { (value, divisor.saturating_mul(by)) }
}

/// A value in 16 bits, held at its ends.
fn held(value: i128) -> i16 {
    i16::try_from(value).unwrap_or(if value < 0 { i16::MIN } else { i16::MAX })
}

fn rounded(number: i128, divisor: i128) -> i128 {
    number.saturating_add(number.signum() * (divisor / 2)) / divisor
}

/// Data that do not have the bytes of the assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SizeError {
    /// Bytes of the assembly.
    pub expected: usize,
    /// Bytes there are.
    pub found: usize,
}

impl fmt::Display for SizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the assembly has {} bytes, found {}", self.expected, self.found)
    }
}

impl std::error::Error for SizeError {}

/// What a controller wants of an axis. What its layout has no field for is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisOutput {
    /// Control word.
    pub control: Control,
    /// Mode.
    pub mode: u8,
    /// Target or set-point.
    pub position: Option<Position>,
    /// Velocity.
    pub velocity: Option<Velocity>,
    /// Acceleration; zero takes the limit of the axis.
    pub acceleration: Option<Acceleration>,
    /// Torque.
    pub torque: Option<Torque>,
    /// Added to the velocity.
    pub velocity_offset: Option<Velocity>,
    /// Added to the torque.
    pub torque_offset: Option<Torque>,
    /// Instant of the set-points; `None` for as soon as possible.
    pub time_stamp: Option<SystemTime>,
    /// What is wrong with the values themselves.
    pub refusal: Option<Refusal>,
}

/// What a controller is shown of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisInput {
    /// Status word.
    pub status: Status,
    /// Mode in use.
    pub mode: u8,
    /// Why the last order was refused.
    pub refusal: Refusal,
    /// Cause of the fault.
    pub fault: u16,
    /// Actual position.
    pub position: Position,
    /// Actual velocity.
    pub velocity: Velocity,
    /// Actual torque.
    pub torque: Torque,
    /// Following error.
    pub following_error: Position,
    /// Digital inputs.
    pub inputs: u32,
    /// Age of the actual values, us.
    pub age_us: u32,
    /// Instant of the actual values; 0 when it is not known.
    pub time_stamp: SystemTime,
    /// Whether the velocity or torque that is wanted is reached.
    pub at_reference: bool,
}

impl Default for AxisInput {
    fn default() -> Self {
        Self {
            status: Status::empty(),
            mode: 0,
            refusal: Refusal::NONE,
            fault: 0,
            position: Position::ZERO,
            velocity: Velocity::ZERO,
            torque: Torque::ZERO,
            following_error: Position::ZERO,
            inputs: 0,
            age_us: 0,
            time_stamp: SystemTime(0),
            at_reference: false,
        }
    }
}

impl Assemblies {
    /// The values of an axis in the data of the output assembly.
    ///
    /// # Errors
    /// [`SizeError`], when the data do not have the bytes of the assembly, or there is no such axis.
    pub fn output_of(&self, axis: usize, data: &[u8], scale: Scale) -> Result<AxisOutput, SizeError> {
        let error = SizeError { expected: self.output_len(), found: data.len() };
        if data.len() != error.expected {
            return Err(error);
        }
        let bytes = data.chunks_exact(self.layout().output_len()).nth(axis).ok_or(error)?;
        match self.layout() {
            Layout::Fields { output, mode, .. } => {
                let mut values = AxisOutput { mode: mode.unwrap_or(0), ..AxisOutput::default() };
                let mut reader = Reader::new(bytes);
                for field in output {
                    let found = reader.take(field.name(), field.size()).map_err(|_| error)?;
                    values.take(*field, signed(found), unsigned(found), scale);
                }
                Ok(values)
            }
            Layout::Speed { output, mode, torque_scale } => {
                let command = SpeedCommand::parse(*output, bytes).map_err(|_| error)?;
                let axis = of_speed(command, output.is_extended());
                Ok(match mode {
                    DriveMode::Speed => axis,
                    DriveMode::Torque => {
                        of_torque(axis, command, scale.torque(command.torque, *torque_scale))
                    }
                })
            }
        }
    }

    /// Puts the values of an axis into the data of the input assembly. Values that their fields cannot hold are held at the
    /// nearest one, and the status word says so.
    ///
    /// # Errors
    /// [`SizeError`], when the buffer does not have the bytes of the assembly, or there is no such axis.
    pub fn put_input(
        &self,
        axis: usize,
        values: &AxisInput,
        scale: Scale,
        data: &mut [u8],
    ) -> Result<(), SizeError> {
        let error = SizeError { expected: self.input_len(), found: data.len() };
        if data.len() != error.expected {
            return Err(error);
        }
        let bytes = data.chunks_exact_mut(self.layout().input_len()).nth(axis).ok_or(error)?;
        match self.layout() {
            Layout::Fields { input, .. } => {
                let mut status = values.status;
                for field in input {
                    let (_, fits) = values.value(*field, scale);
                    status.set(Status::SATURATED, status.contains(Status::SATURATED) || !fits);
                }
                let values = AxisInput { status, ..*values };
                let mut writer = Writer::new(bytes);
                for field in input {
                    let (value, _) = values.value(*field, scale);
                    let octets = &value.to_le_bytes()[..field.size()];
                    writer.slice(field.name(), octets).map_err(|_| error)?;
                }
                Ok(())
            }
            Layout::Speed { output, torque_scale, .. } => {
                let kind = output.status().ok_or(error)?;
                let mut octets = [0; SPEED_LEN_MAX];
                let torque = scale.torque_units(values.torque, *torque_scale);
                let len = to_speed(values, torque).emit(kind, &mut octets).map_err(|_| error)?;
                bytes.copy_from_slice(octets.get(..len).ok_or(error)?);
                Ok(())
            }
        }
    }
}

impl AxisOutput {
    fn take(&mut self, field: OutputField, value: i64, bits: u64, scale: Scale) {
        let nano = scale.nano(value);
        let unusable = match field {
            OutputField::Control => {
                let [low, high, ..] = bits.to_le_bytes();
                self.control = Control::from_bits_retain(u16::from_le_bytes([low, high]));
                false
            }
            OutputField::Mode => {
                self.mode = bits.to_le_bytes()[0];
                false
            }
            OutputField::TargetPosition32 | OutputField::TargetPosition64 => {
                self.position = nano.map(Position);
                nano.is_none()
            }
            OutputField::Velocity => {
                self.velocity = nano.map(Velocity);
                nano.is_none()
            }
            OutputField::Acceleration => {
                self.acceleration = nano.map(Acceleration);
                nano.is_none()
            }
            OutputField::VelocityOffset => {
                self.velocity_offset = nano.map(Velocity);
                nano.is_none()
            }
            OutputField::Torque => {
                self.torque = Some(torque(value));
                false
            }
            OutputField::TorqueOffset => {
                self.torque_offset = Some(torque(value));
                false
            }
            OutputField::TimeStamp => {
                self.time_stamp = (value != 0).then_some(SystemTime(bits));
                value < 0
            }
            OutputField::Pad8 | OutputField::Pad16 | OutputField::Pad32 => false,
        };
        if unusable {
            self.refusal = Some(Refusal::VALUE);
        }
    }
}

impl AxisInput {
    /// What stands in a field, and whether it holds the value.
    fn value(&self, field: InputField, scale: Scale) -> (i64, bool) {
        let whole = |nano: i64| match scale.counts(nano) {
            Some(counts) => (counts, true),
            None => (if nano < 0 { i64::MIN } else { i64::MAX }, false),
        };
        let in_32 = |nano: i64| {
            let (counts, fits) = whole(nano);
            let held = counts.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
            (held, fits && held == counts)
        };
        match field {
            InputField::Status => (i64::from(self.status.bits()), true),
            InputField::Mode => (i64::from(self.mode), true),
            InputField::Refusal => (i64::from(self.refusal.0), true),
            InputField::Fault => (i64::from(self.fault), true),
            InputField::ActualPosition32 => in_32(self.position.get()),
            InputField::ActualPosition64 => whole(self.position.get()),
            InputField::ActualVelocity => in_32(self.velocity.get()),
            InputField::FollowingError => in_32(self.following_error.get()),
            InputField::ActualTorque => {
                let torque = self.torque.get() / TORQUE_STEP;
                let held = torque.clamp(i64::from(i16::MIN), i64::from(i16::MAX));
                (held, held == torque)
            }
            InputField::Inputs => (i64::from(self.inputs), true),
            InputField::Age => (i64::from(self.age_us), true),
            InputField::TimeStamp => (i64::try_from(self.time_stamp.0).unwrap_or(i64::MAX), true),
            InputField::Pad8 | InputField::Pad16 | InputField::Pad32 => (0, true),
        }
    }
}

fn torque(thousandths: i64) -> Torque {
    Torque(thousandths.saturating_mul(TORQUE_STEP))
}

/// Up to eight bytes, low byte first, without a sign.
fn unsigned(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// The same with a sign.
fn signed(bytes: &[u8]) -> i64 {
    let fill = if bytes.last().is_some_and(|byte| byte & 0x80 != 0) { 0xFF } else { 0 };
    let mut octets = [fill; 8];
    octets.iter_mut().zip(bytes).for_each(|(octet, byte)| *octet = *byte);
    i64::from_le_bytes(octets)
}

/// Mode in which the velocity is followed on the ramp of the gateway.
const VELOCITY_MODE: u8 = 2;

/// Mode in which each datagram has the torque.
const TORQUE_MODE: u8 = 5;

/// Without control and reference from the network, assemblies 21 and 23 have no say over the drive.
fn of_speed(command: SpeedCommand, extended: bool) -> AxisOutput {
    let SpeedCommand { control, speed, .. } = command;
    let from_network = !extended || control.contains(SpeedControl::NET_CONTROL | SpeedControl::NET_REFERENCE);
    let (forward, reverse) =
        (control.contains(SpeedControl::RUN_FORWARD), control.contains(SpeedControl::RUN_REVERSE));
    let both = forward && reverse;
    let mut word = Control::empty();
    word.set(Control::ENABLE, (forward != reverse) && from_network);
    word.set(Control::RESET, control.contains(SpeedControl::FAULT_RESET));
    let nano = rounded(i128::from(speed) * NANO, 60);
    let velocity = i64::try_from(if reverse { -nano } else { nano }).unwrap_or(0);
    AxisOutput {
        control: word,
        mode: VELOCITY_MODE,
        velocity: Some(Velocity(velocity)),
        refusal: both.then_some(Refusal::BOTH_DIRECTIONS),
        ..AxisOutput::default()
    }
}

/// In torque control the direction is that of the torque, and the speed reference does not count.
fn of_torque(axis: AxisOutput, command: SpeedCommand, torque: Option<Torque>) -> AxisOutput {
    let reverse = command.control.contains(SpeedControl::RUN_REVERSE);
    let directed = torque.map_or(Torque::ZERO, |torque| if reverse { Torque(-torque.get()) } else { torque });
    AxisOutput {
        mode: TORQUE_MODE,
        velocity: None,
        torque: Some(directed),
        refusal: axis.refusal.or(torque.is_none().then_some(Refusal::VALUE)),
        ..axis
    }
}

fn to_speed(values: &AxisInput, torque: i16) -> SpeedActual {
    let has = |status| values.status.contains(status);
    let rpm = rounded(i128::from(values.velocity.get()) * 60, NANO);
    let speed = held(rpm);
    let enabled = has(Status::ENABLED);
    let mut status = SpeedStatus::empty();
    status.set(SpeedStatus::FAULTED, has(Status::FAULT));
    status.set(SpeedStatus::WARNING, has(Status::WARNING));
    status.set(SpeedStatus::RUNNING_FORWARD, enabled && speed >= 0);
    status.set(SpeedStatus::RUNNING_REVERSE, enabled && speed < 0);
    status.set(SpeedStatus::READY, has(Status::READY) || enabled);
    status.set(SpeedStatus::CONTROL_FROM_NET, has(Status::RUN));
    status.set(SpeedStatus::REFERENCE_FROM_NET, has(Status::RUN));
    status.set(SpeedStatus::AT_REFERENCE, enabled && values.at_reference);
    let state = match (has(Status::FAULT), enabled, has(Status::TORQUE), has(Status::READY)) {
        (true, ..) => SupervisorState::FAULTED,
        (_, true, ..) => SupervisorState::ENABLED,
        (_, _, true, _) => SupervisorState::STOPPING,
        (.., true) => SupervisorState::READY,
        _ => SupervisorState::NOT_READY,
    };
    SpeedActual { status, state, speed, torque }
}
