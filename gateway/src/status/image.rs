//! The published part of the process image that is not in the state of an axis itself: set-points and further actual values.

use profile_generic::image::{AxisCommand, AxisFeedback, CommandSet, FeedbackSet};
use profile_generic::quantity::{Current, Position, Temperature, Torque, Velocity, Voltage};

use super::{pair, split};

/// Words in the published form.
pub(super) const IMAGE_WORDS: usize = 7;

/// Set-points as the drive has got them last, and further actual values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ImageStatus {
    /// Which set-points there are.
    pub commands: CommandSet,
    /// Which actual values there are, those of the state of the axis among them.
    pub actual: FeedbackSet,
    /// Position set-point, 1e-9 revolution or mm.
    pub position_command: Position,
    /// Velocity set-point, 1e-9 revolution/s or mm/s.
    pub velocity_command: Velocity,
    /// Torque set-point, 1e-6 of the rated torque.
    pub torque_command: Torque,
    /// Motor current, 1e-6 A.
    pub current: Current,
    /// Voltage of the DC bus, 1e-6 V.
    pub bus_voltage: Voltage,
    /// Temperature of the motor, 1e-3 degrees Celsius.
    pub temperature: Temperature,
}

impl ImageStatus {
    /// Nothing.
    pub const NONE: Self = Self {
        commands: CommandSet::empty(),
        actual: FeedbackSet::empty(),
        position_command: Position(0),
        velocity_command: Velocity(0),
        torque_command: Torque(0),
        current: Current(0),
        bus_voltage: Voltage(0),
        temperature: Temperature(0),
    };

    /// What an axis has.
    #[must_use]
    pub const fn of(command: &AxisCommand, feedback: &AxisFeedback) -> Self {
        Self {
            commands: command.present,
            actual: feedback.present,
            position_command: command.position,
            velocity_command: command.velocity,
            torque_command: command.torque,
            current: feedback.current,
            bus_voltage: feedback.bus_voltage,
            temperature: feedback.temperature,
        }
    }

    pub(super) fn to_words(self) -> [u64; IMAGE_WORDS] {
        [
            pair(self.commands.bits().into(), self.actual.bits().into()),
            self.position_command.0.cast_unsigned(),
            self.velocity_command.0.cast_unsigned(),
            self.torque_command.0.cast_unsigned(),
            self.current.0.cast_unsigned(),
            self.bus_voltage.0.cast_unsigned(),
            self.temperature.0.cast_unsigned(),
        ]
    }

    pub(super) fn from_words(words: &[u64; IMAGE_WORDS]) -> Self {
        let (commands, actual) = split(words[0]);
        let [_, position, velocity, torque, current, voltage, temperature] = words.map(u64::cast_signed);
        // Sixteen bits each were written.
        let bits = |word: u32| u16::try_from(word).unwrap_or(0);
        Self {
            commands: CommandSet::from_bits_retain(bits(commands)),
            actual: FeedbackSet::from_bits_retain(bits(actual)),
            position_command: Position(position),
            velocity_command: Velocity(velocity),
            torque_command: Torque(torque),
            current: Current(current),
            bus_voltage: Voltage(voltage),
            temperature: Temperature(temperature),
        }
    }
}
