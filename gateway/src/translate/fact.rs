//! The typed side of a line: what a value is, on which side of the gateway it was seen, and where its bytes stood.

use profile_cip::wire::motion::codes::{AxisControl, AxisStateCode};
use profile_cip::wire::motion::{
    ActualBlock, ActualPosition, ActualValues, CommandBlock, CommandPosition, CommandValues,
};
use profile_generic::fault::FaultCause;
use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::program::Field;
use profile_generic::quantity::Quantity;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{Action, DriveState, Report};
use schemars::JsonSchema;
use serde::Serialize;

use super::stage::StageAxis;
use super::telegram::bytes_of;
use crate::mapping::CipScaling;

/// On which of the four ways a value was seen.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// The command of the controller.
    FromController,
    /// What went to the drive.
    ToDrive,
    /// What the drive sent.
    FromDrive,
    /// What the controller was told.
    ToController,
}

/// A value, and where it was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// Number of the axis in the configuration.
    pub axis: usize,
    /// Which way it went.
    pub direction: Direction,
    /// Its bytes were in the frame; otherwise the gateway has made them of it.
    pub recorded: bool,
    /// What it is.
    pub what: What,
    /// Its bytes.
    pub raw: Option<Raw>,
}

/// What a value is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum What {
    /// A signal in its generic unit; none where the drive does not follow it.
    Signal(Signal, Option<i64>),
    /// An operating mode; none where the drive shows one that was not set up.
    Mode(Option<OperatingMode>),
    /// What a drive is asked to do.
    Action(Action),
    /// What a drive says of its state.
    Report(Report),
    /// The state of the axis.
    State(DriveState),
    /// The same for the controller.
    AxisState(AxisStateCode),
    /// A request of the controller; also that there is none.
    Request(AxisControl),
    /// What a drive reports beside its state; empty if it reports nothing.
    Status(StatusBits),
    /// A control word that was recorded.
    ControlWord(u16),
    /// A fault that was raised; none at the end of one.
    Fault(Option<FaultCause>),
}

/// The bytes of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raw {
    bytes: [u8; 8],
    len: u8,
    /// The number in them.
    pub number: Option<f64>,
    /// First byte of them in what carries them.
    pub offset: Option<u16>,
    /// What carries them.
    pub of: Carrier,
}

/// What carries a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// The values of a connection in a SERCOS telegram, without C-CON.
    Sercos,
    /// The PDO of this number to a drive.
    Rpdo(u16),
    /// The PDO of this number from a drive.
    Tpdo(u16),
    /// A message on DeviceNet.
    Message,
    /// The cyclic block of an instance in an update.
    Block,
    /// An object, an IDN or an EMCY beside the cyclic values.
    Object,
}

impl Raw {
    /// Bytes as they stand in what carries them; more than eight are cut.
    pub fn new(bytes: &[u8], number: Option<f64>, offset: Option<usize>, of: Carrier) -> Self {
        let mut all = [0; 8];
        all.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        let len = u8::try_from(bytes.len().min(all.len())).unwrap_or(0);
        Self { bytes: all, len, number, offset: offset.and_then(|at| u16::try_from(at).ok()), of }
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }

    /// The bytes of a field of a drive's program.
    pub(super) fn of_field(axis: &StageAxis, field: &Field, telegram: &[u8]) -> Self {
        let bytes = bytes_of(field, telegram);
        let number = match (field.width.is_float(), bytes) {
            (true, &[a, b, c, d]) => Some(f64::from(f32::from_le_bytes([a, b, c, d]))),
            (true, _) => None,
            (false, _) => field.width.integer(bytes).map(number_of),
        };
        let start = usize::from(field.offset);
        let (offset, of) = if let Some(drive) = axis.devicenet() {
            (drive.value(field).1, Carrier::Message)
        } else {
            place(axis, field.signal.is_command(), start)
        };
        Self::new(bytes, number, offset, of)
    }

    /// The first bytes of a telegram or PDO to or from a drive: control or status word.
    pub(super) fn of_word(axis: &StageAxis, command: bool, at: usize, telegram: &[u8]) -> Option<Self> {
        let bytes = telegram.get(at..at + 2)?;
        let number = bytes.first_chunk().map(|word| f64::from(u16::from_le_bytes(*word)));
        let (offset, of) = place(axis, command, at);
        Some(Self::new(bytes, number, offset, of))
    }
}

/// Where a byte of the values of a program stands on the bus.
fn place(axis: &StageAxis, command: bool, flat: usize) -> (Option<usize>, Carrier) {
    use profile_cia402::master::config::Direction as Way;
    let Some(drive) = axis.can() else {
        let of = if axis.devicenet().is_some() { Carrier::Message } else { Carrier::Sercos };
        return (Some(flat), of);
    };
    let way = if command { Way::Receive } else { Way::Transmit };
    let found = drive.place(way, flat);
    let number = found.map_or(0, |(pdo, _)| pdo.number);
    let of = if command { Carrier::Rpdo(number) } else { Carrier::Tpdo(number) };
    (found.map(|(_, at)| at), of)
}

/// An integer as JSON and a plot have it.
#[allow(
    clippy::cast_precision_loss,
    reason = "beyond 2^53 the last digits of a drawing do not count; `exact` has them"
)]
pub(crate) const fn number_of(value: i64) -> f64 {
    value as f64
}

/// Unit and decimals of a quantity of an axis.
pub(super) const fn unit(kind: UnitKind, quantity: Quantity) -> (&'static str, u8) {
    match (quantity, kind) {
        (Quantity::Position, UnitKind::Rotary) => ("rev", 9),
        (Quantity::Position, UnitKind::Linear) => ("mm", 9),
        (Quantity::Velocity, UnitKind::Rotary) => ("rev/s", 9),
        (Quantity::Velocity, UnitKind::Linear) => ("mm/s", 9),
        (Quantity::Acceleration, UnitKind::Rotary) => ("rev/s2", 9),
        (Quantity::Acceleration, UnitKind::Linear) => ("mm/s2", 9),
        (Quantity::Torque, _) => ("%", 4),
        (Quantity::TorqueAbsolute, UnitKind::Rotary) => ("Nm", 6),
        (Quantity::TorqueAbsolute, UnitKind::Linear) => ("N", 6),
        (Quantity::Current, _) => ("A", 6),
        (Quantity::Voltage, _) => ("V", 6),
        (Quantity::Temperature, _) => ("degC", 3),
        (other, _) => (other.unit(), 0),
    }
}

/// The bytes of the values of a command block, each with its signal.
pub(super) fn of_command(block: &CommandBlock) -> impl Iterator<Item = (Signal, Raw)> {
    let values = block.values;
    let mut at = CommandBlock { values: CommandValues::default(), ..*block }.buffer_len();
    let position = values.position.map(|position| match position {
        CommandPosition::Float(value) => (value.to_le_bytes().to_vec(), value),
        CommandPosition::Integer(value) => (value.to_le_bytes().to_vec(), f64::from(value)),
    });
    let real = |value: Option<f32>| value.map(|value| (value.to_le_bytes().to_vec(), f64::from(value)));
    let values = [
        (Signal::PositionCommand, position),
        (Signal::VelocityCommand, real(values.velocity)),
        (Signal::AccelerationCommand, real(values.acceleration)),
        (Signal::TorqueCommand, real(values.torque)),
    ];
    values.into_iter().filter_map(|(signal, value)| Some((signal, value?))).map(
        move |(signal, (bytes, number))| {
            let raw = Raw::new(&bytes, Some(number), Some(at), Carrier::Block);
            at += bytes.len();
            (signal, raw)
        },
    )
}

/// The generic values and bytes of the actual values of a block.
pub(super) fn of_actual(
    block: &ActualBlock,
    scaling: &CipScaling,
) -> impl Iterator<Item = (Signal, i64, Raw)> {
    let actual = block.actual;
    let bare = ActualBlock { actual: ActualValues::default(), status: Default::default(), ..*block };
    let mut at = bare.buffer_len();
    let sign = if scaling.inverted { -1 } else { 1 };
    let per_unit = i128::from(scaling.nanounits_per_unit);
    let of_counts = |counts: i64| {
        let value = i128::from(counts) * per_unit / i128::from(scaling.counts_per_unit.max(1)) * sign;
        i64::try_from(value).unwrap_or(i64::MAX)
    };
    #[allow(clippy::cast_possible_truncation, reason = "saturates; a value of that size is no velocity")]
    let of_real = |value: f32| {
        (f64::from(value) * number_of(scaling.nanounits_per_unit)) as i64
            * if scaling.inverted { -1 } else { 1 }
    };
    let position = actual.position.map(|position| match position {
        ActualPosition::Dint(value) => {
            (of_counts(value.into()), value.to_le_bytes().to_vec(), f64::from(value))
        }
        ActualPosition::Lint(value) => (of_counts(value), value.to_le_bytes().to_vec(), number_of(value)),
    });
    let real = |value: Option<f32>| {
        value.map(|value| (of_real(value), value.to_le_bytes().to_vec(), f64::from(value)))
    };
    let values = [
        (Signal::PositionActual, position),
        (Signal::VelocityActual, real(actual.velocity)),
        (Signal::AccelerationActual, real(actual.acceleration)),
    ];
    values.into_iter().filter_map(|(signal, value)| Some((signal, value?))).map(
        move |(signal, (generic, bytes, number))| {
            let raw = Raw::new(&bytes, Some(number), Some(at), Carrier::Block);
            at += bytes.len();
            (signal, generic, raw)
        },
    )
}
