//! Cyclic command data block of the C-to-D connection, clause 6-2.7.1.2.2.
//!
//! | offset | content |
//! |---|---|
//! | 0 | control mode (low nibble) |
//! | 1 | feedback mode (low nibble), position feedback type (bits 5..4) |
//! | 2 | axis control |
//! | 3 | control status |
//! | 4 | command data set |
//! | 5 | actual data set asked for |
//! | 6 | status data set asked for |
//! | 7 | command control |
//! | 8 | values in the order of the command data set bits |

use core::fmt;

use super::codes::{
    ActualDataSet, AxisControl, CommandDataSet, CommandTarget, ControlMode, ControlStatus, FeedbackMode,
    StatusDataSet,
};
use super::value::{ReadValue, WriteValue, invalid};
use crate::wire::{Error, Reader, Writer};

/// Octets of the block without values.
pub const HEADER_LEN: usize = 8;
const BLOCK: &str = "cyclic command block";
const COMMAND_SET_AT: usize = 4;
const COMMAND_CONTROL_AT: usize = 7;
const POSITION_TYPE_SHIFT: u8 = 2;

/// Command Position in the type that Command Control gives, Table 6-2.24. Unit: position control units (counts).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CommandPosition {
    /// LREAL.
    Float(f64),
    /// DINT.
    Integer(i32),
}

impl CommandPosition {
    /// The position as a floating point number; exact for both types.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Float(p) => p,
            Self::Integer(p) => f64::from(p),
        }
    }
}

/// Command values; the present ones make up the Command Data Set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CommandValues {
    /// Command Position, position control units.
    pub position: Option<CommandPosition>,
    /// Command Velocity, velocity control units.
    pub velocity: Option<f32>,
    /// Command Acceleration, acceleration control units.
    pub acceleration: Option<f32>,
    /// Command Torque, % of motor rated torque.
    pub torque: Option<f32>,
    /// Unwind Cycle Count.
    pub unwind_count: Option<i32>,
    /// Position Displacement, position control units.
    pub position_displacement: Option<i32>,
}

impl CommandValues {
    /// The Command Data Set octet that the present values give.
    #[must_use]
    pub fn data_set(&self) -> CommandDataSet {
        let mut set = CommandDataSet::empty();
        set.set(CommandDataSet::POSITION, self.position.is_some());
        set.set(CommandDataSet::VELOCITY, self.velocity.is_some());
        set.set(CommandDataSet::ACCELERATION, self.acceleration.is_some());
        set.set(CommandDataSet::TORQUE, self.torque.is_some());
        set.set(CommandDataSet::UNWIND_COUNT, self.unwind_count.is_some());
        set.set(CommandDataSet::POSITION_DISPLACEMENT, self.position_displacement.is_some());
        set
    }

    /// Whether every floating point value is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let position = !matches!(self.position, Some(CommandPosition::Float(p)) if !p.is_finite());
        position && [self.velocity, self.acceleration, self.torque].iter().flatten().all(|v| v.is_finite())
    }

    /// Octets of the values.
    #[must_use]
    pub fn len(&self) -> usize {
        let position = match self.position {
            Some(CommandPosition::Float(_)) => 8,
            Some(CommandPosition::Integer(_)) => 4,
            None => 0,
        };
        let others = [
            self.velocity.is_some(),
            self.acceleration.is_some(),
            self.torque.is_some(),
            self.unwind_count.is_some(),
            self.position_displacement.is_some(),
        ];
        position + others.map(|present| 4 * usize::from(present)).iter().sum::<usize>()
    }

    /// Whether there is no value at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.data_set().is_empty()
    }

    #[inline]
    pub(super) fn parse(
        reader: &mut Reader<'_>,
        set: CommandDataSet,
        position_is_integer: bool,
    ) -> Result<Self, Error> {
        let has = |bit| set.contains(bit);
        Ok(Self {
            position: if !has(CommandDataSet::POSITION) {
                None
            } else if position_is_integer {
                Some(CommandPosition::Integer(reader.i32(BLOCK)?))
            } else {
                Some(CommandPosition::Float(reader.f64(BLOCK)?))
            },
            velocity: has(CommandDataSet::VELOCITY).then(|| reader.f32(BLOCK)).transpose()?,
            acceleration: has(CommandDataSet::ACCELERATION).then(|| reader.f32(BLOCK)).transpose()?,
            torque: has(CommandDataSet::TORQUE).then(|| reader.f32(BLOCK)).transpose()?,
            unwind_count: has(CommandDataSet::UNWIND_COUNT).then(|| reader.i32(BLOCK)).transpose()?,
            position_displacement: has(CommandDataSet::POSITION_DISPLACEMENT)
                .then(|| reader.i32(BLOCK))
                .transpose()?,
        })
    }

    pub(super) fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        match self.position {
            Some(CommandPosition::Float(p)) => writer.f64(BLOCK, p)?,
            Some(CommandPosition::Integer(p)) => writer.i32(BLOCK, p)?,
            None => {}
        }
        for value in [self.velocity, self.acceleration, self.torque].into_iter().flatten() {
            writer.f32(BLOCK, value)?;
        }
        for value in [self.unwind_count, self.position_displacement].into_iter().flatten() {
            writer.i32(BLOCK, value)?;
        }
        Ok(())
    }
}

impl fmt::Display for CommandValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.position {
            Some(CommandPosition::Float(p)) => writeln!(f, "    Command Position: {p} (LREAL)")?,
            Some(CommandPosition::Integer(p)) => writeln!(f, "    Command Position: {p} (DINT)")?,
            None => {}
        }
        let reals = [
            ("Command Velocity", self.velocity),
            ("Command Acceleration", self.acceleration),
            ("Command Torque", self.torque),
        ];
        for (name, value) in reals {
            if let Some(value) = value {
                writeln!(f, "    {name}: {value}")?;
            }
        }
        let counts = [
            ("Unwind Cycle Count", self.unwind_count),
            ("Position Displacement", self.position_displacement),
        ];
        for (name, value) in counts {
            if let Some(value) = value {
                writeln!(f, "    {name}: {value}")?;
            }
        }
        Ok(())
    }
}

/// Cyclic command data block.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CommandBlock {
    /// Control Mode; the reserved high nibble is kept.
    pub control_mode: ControlMode,
    /// Feedback Mode with the position feedback type.
    pub feedback_mode: FeedbackMode,
    /// State change asked for.
    pub axis_control: AxisControl,
    /// State of the control.
    pub control_status: ControlStatus,
    /// Actual values asked for in the next D-to-C update.
    pub actual_data_set: ActualDataSet,
    /// Status values asked for in the next D-to-C update.
    pub status_data_set: StatusDataSet,
    /// Update for which the values are meant; two bits.
    pub target: CommandTarget,
    /// Command values.
    pub values: CommandValues,
}

impl CommandBlock {
    /// Reads a block; `block` must hold exactly the block.
    ///
    /// # Errors
    /// The octets are too few or too many for the data set, the data set or the position type hold reserved codes,
    /// whose size is unknown, or the Command Target Update is the reserved one.
    #[inline]
    pub fn parse(block: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(block);
        let [
            control_mode,
            feedback_mode,
            axis_control,
            control_status,
            set,
            actual_data_set,
            status_data_set,
            command_control,
        ] = reader.array(BLOCK)?;
        let set = CommandDataSet::from_bits_retain(set);
        if set.reserved() != 0 {
            let known = set.bits() & !set.reserved();
            return Err(invalid("command data set", COMMAND_SET_AT, set.bits(), known));
        }
        let position_type = command_control >> POSITION_TYPE_SHIFT;
        if position_type > 1 {
            let known = command_control & 0b111;
            return Err(invalid("command control", COMMAND_CONTROL_AT, command_control, known));
        }
        // A target that nobody has defined is no instant to be somewhere.
        let target = CommandTarget(command_control & 0b11);
        if target.0 > CommandTarget::INTERPOLATE.0 {
            let known = command_control & !0b11 | CommandTarget::INTERPOLATE.0;
            return Err(invalid("command control", COMMAND_CONTROL_AT, command_control, known));
        }
        let values = CommandValues::parse(reader, set, position_type == 1)?;
        reader.finish(BLOCK)?;
        Ok(Self {
            control_mode: ControlMode(control_mode),
            feedback_mode: FeedbackMode(feedback_mode),
            axis_control: AxisControl(axis_control),
            control_status: ControlStatus::from_bits_retain(control_status),
            actual_data_set: ActualDataSet::from_bits_retain(actual_data_set),
            status_data_set: StatusDataSet::from_bits_retain(status_data_set),
            target,
            values,
        })
    }

    /// Octets that [`CommandBlock::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + self.values.len()
    }

    /// Writes the block.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let integer = matches!(self.values.position, Some(CommandPosition::Integer(_)));
        let header: [u8; HEADER_LEN] = [
            self.control_mode.0,
            self.feedback_mode.0,
            self.axis_control.0,
            self.control_status.bits(),
            self.values.data_set().bits(),
            self.actual_data_set.bits(),
            self.status_data_set.bits(),
            (u8::from(integer) << POSITION_TYPE_SHIFT) | (self.target.0 & 0b11),
        ];
        writer.slice(BLOCK, &header)?;
        self.values.emit(writer)
    }
}

impl fmt::Display for CommandBlock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Control Mode: {}", self.control_mode)?;
        writeln!(f, "    Feedback Mode: {}", self.feedback_mode)?;
        writeln!(f, "    Axis Control: {}", self.axis_control)?;
        writeln!(f, "    Control Status: {}", self.control_status)?;
        writeln!(f, "    Command Data Set: {}", self.values.data_set())?;
        writeln!(f, "    Actual Data Set: {}", self.actual_data_set)?;
        writeln!(f, "    Status Data Set: {}", self.status_data_set)?;
        writeln!(f, "    Command Target Update: {}", self.target)?;
        self.values.fmt(f)
    }
}
