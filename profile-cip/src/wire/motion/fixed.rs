//! Fixed formats 2 and 3 of 16 octets, clause 6-2.7.3.
//!
//! | offset | C-to-D (format 2) | D-to-C (format 3) |
//! |---|---|---|
//! | 0 | connection format | connection format |
//! | 1 | format revision | format revision |
//! | 2 | update ID | update ID |
//! | 3 | node control | node status |
//! | 4 | control mode | control mode |
//! | 5 | feedback mode | feedback mode |
//! | 6 | axis control | axis response |
//! | 7 | reserved | response status |
//! | 8 | command data set | reserved |
//! | 9 | actual data set asked for | actual data set |
//! | 10 | status data set asked for | status data set |
//! | 11 | reserved | axis state |
//! | 12 | one 32-bit command value | one 32-bit actual value |
//!
//! One axis, no time stamps, no event or service channel. A data set names at most one value of 32 bits, whichever of
//! its bits that is; without one the last four octets are zero. The position is a DINT in both directions. Every
//! element of the Status Data Set is longer than the one value, so the device never sends one, whatever is asked for.

use core::fmt;

use super::actual::{ActualBlock, ActualPosition, ActualValues};
use super::codes::{
    ActualDataSet, AxisControl, AxisStateCode, CommandDataSet, CommandTarget, ConnectionFormat, ControlMode,
    ControlStatus, FeedbackMode, NodeControl, NodeStatus, StatusDataSet, TimeDataSet,
};
use super::cyclic::{CommandBlock, CommandPosition, CommandValues};
use super::header::{CommandHeader, FORMAT_REVISION};
use super::value::invalid;
use crate::wire::status::GeneralStatus;
use crate::wire::{Error, Reader, Writer};

/// Octets of either update.
pub const LEN: usize = 16;
const FRAME: &str = "fixed format update";
const COMMAND_SET_AT: usize = 8;
const ACTUAL_SET_AT: usize = 9;
const VALUE_LEN: usize = 4;

/// The two formats that the data of a connection may have, clause 6-2.7. Each has a code for either direction
/// ([`ConnectionFormat`]); it does not change for the life of the connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Format {
    /// Codes 6 and 7: up to all axes of a device, time stamps, event and service channels.
    #[default]
    Variable,
    /// Codes 2 and 3: 16 octets for one axis.
    Fixed,
}

/// C-to-D update of format 2.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FixedCommand {
    /// Update ID.
    pub update_id: u8,
    /// Node Control.
    pub node_control: NodeControl,
    /// Control Mode.
    pub control_mode: ControlMode,
    /// Feedback Mode.
    pub feedback_mode: FeedbackMode,
    /// State change asked for.
    pub axis_control: AxisControl,
    /// Actual values asked for.
    pub actual_data_set: ActualDataSet,
    /// Status values asked for.
    pub status_data_set: StatusDataSet,
    /// At most one value of 32 bits; a position is a DINT.
    pub values: CommandValues,
}

/// D-to-C update of format 3.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FixedActual {
    /// Update ID.
    pub update_id: u8,
    /// Node Status.
    pub node_status: NodeStatus,
    /// Control Mode.
    pub control_mode: ControlMode,
    /// Feedback Mode.
    pub feedback_mode: FeedbackMode,
    /// Acknowledge of a state change request.
    pub axis_response: AxisControl,
    /// General status of that request.
    pub response_status: u8,
    /// Axis State.
    pub axis_state: AxisStateCode,
    /// At most one value of 32 bits; a position is a DINT.
    pub actual: ActualValues,
}

fn head(reader: &mut Reader<'_>, format: ConnectionFormat) -> Result<(u8, u8), Error> {
    let [found, revision, update_id, node] = reader.array(FRAME)?;
    if found != format.0 {
        return Err(invalid("connection format", 0, found, format.0));
    }
    if revision != FORMAT_REVISION {
        return Err(invalid("format revision", 1, revision, FORMAT_REVISION));
    }
    Ok((update_id, node))
}

/// Without a value the last word is reserved.
fn skip_unused(reader: &mut Reader<'_>, used: bool) -> Result<(), Error> {
    if !used {
        reader.take(FRAME, VALUE_LEN)?;
    }
    reader.finish(FRAME)
}

/// The lowest bit that is set, alone.
fn lowest(bits: u8) -> u8 {
    bits & bits.wrapping_neg()
}

/// The answer has room for one of the actual values. A reserved bit asks for nothing, as in the variable format.
fn check_asked(asked: ActualDataSet) -> Result<(), Error> {
    let known = asked.bits() & !asked.reserved();
    if known.count_ones() > 1 {
        return Err(invalid("actual data set", ACTUAL_SET_AT, asked.bits(), lowest(known)));
    }
    Ok(())
}

fn too_long(len: usize) -> Error {
    let value = u32::try_from(len).unwrap_or(u32::MAX);
    Error::too_large("octets of values in a fixed format", 4, value)
}

impl FixedCommand {
    /// Reads an update.
    ///
    /// # Errors
    /// Format, revision or length are wrong, the command data set has more than one bit or a reserved one, or more
    /// actual values are asked for than the answer has room for.
    pub fn parse(update: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(update);
        let (update_id, node) = head(reader, ConnectionFormat::FIXED_COMMAND)?;
        let [control_mode, feedback_mode, axis_control, _] = reader.array(FRAME)?;
        let [command_set, actual_set, status_set, _] = reader.array(FRAME)?;
        let set = CommandDataSet::from_bits_retain(command_set);
        if set.reserved() != 0 || command_set.count_ones() > 1 {
            let one = lowest(command_set & !set.reserved());
            return Err(invalid("command data set", COMMAND_SET_AT, command_set, one));
        }
        let asked = ActualDataSet::from_bits_retain(actual_set);
        check_asked(asked)?;
        let values = CommandValues::parse(reader, set, true)?;
        skip_unused(reader, !set.is_empty())?;
        Ok(Self {
            update_id,
            node_control: NodeControl::from_bits_retain(node),
            control_mode: ControlMode(control_mode),
            feedback_mode: FeedbackMode(feedback_mode),
            axis_control: AxisControl(axis_control),
            actual_data_set: asked,
            status_data_set: StatusDataSet::from_bits_retain(status_set),
            values,
        })
    }

    /// Writes an update of [`LEN`] octets.
    ///
    /// # Errors
    /// The buffer is too short, there is more than one value or an LREAL position, or more than one actual value is
    /// asked for.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        check_asked(self.actual_data_set)?;
        if self.values.len() > VALUE_LEN || matches!(self.values.position, Some(CommandPosition::Float(_))) {
            return Err(too_long(self.values.len()));
        }
        let format = ConnectionFormat::FIXED_COMMAND.0;
        writer.slice(FRAME, &[format, FORMAT_REVISION, self.update_id, self.node_control.bits()])?;
        writer.slice(FRAME, &[self.control_mode.0, self.feedback_mode.0, self.axis_control.0, 0])?;
        let command_set = self.values.data_set().bits();
        writer.slice(FRAME, &[command_set, self.actual_data_set.bits(), self.status_data_set.bits(), 0])?;
        self.values.emit(writer)?;
        writer.zeros(FRAME, VALUE_LEN - self.values.len())
    }

    /// What the update has of the header of the variable format; the rest is zero or absent.
    #[must_use]
    pub fn header(&self) -> CommandHeader {
        CommandHeader {
            update_id: self.update_id,
            node_control: self.node_control,
            instance_count: 1,
            last_received_id: 0,
            time_stamp: None,
            time_offset: None,
            diagnostics: TimeDataSet::empty(),
        }
    }

    /// What the update has of the cyclic block of the variable format. Control Status and Command Control do not
    /// travel in this format. Neither does what cannot be answered: status data and a LINT position.
    #[must_use]
    pub fn block(&self, control_status: ControlStatus, target: CommandTarget) -> CommandBlock {
        CommandBlock {
            control_mode: self.control_mode,
            feedback_mode: self.feedback_mode.with_lint(false),
            axis_control: self.axis_control,
            control_status,
            actual_data_set: self.actual_data_set,
            status_data_set: StatusDataSet::empty(),
            target,
            values: self.values,
        }
    }
}

impl From<&ActualBlock> for FixedActual {
    /// The part of a cyclic block of the variable format that this format has.
    fn from(block: &ActualBlock) -> Self {
        Self {
            update_id: 0,
            node_status: NodeStatus::empty(),
            control_mode: block.control_mode,
            feedback_mode: block.feedback_mode,
            axis_response: block.axis_response,
            response_status: block.response_status,
            axis_state: block.axis_state,
            actual: block.actual,
        }
    }
}

impl FixedActual {
    /// What the update has of the cyclic block of the variable format: everything but status data.
    #[must_use]
    pub fn block(&self) -> ActualBlock {
        ActualBlock {
            control_mode: self.control_mode,
            feedback_mode: self.feedback_mode,
            axis_response: self.axis_response,
            response_status: self.response_status,
            axis_state: self.axis_state,
            actual: self.actual,
            ..ActualBlock::default()
        }
    }

    /// Reads an update.
    ///
    /// # Errors
    /// Format, revision or length are wrong, or the data sets name more than one value of 32 bits.
    pub fn parse(update: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(update);
        let (update_id, node) = head(reader, ConnectionFormat::FIXED_ACTUAL)?;
        let [control_mode, feedback_mode, axis_response, response_status] = reader.array(FRAME)?;
        let [_, actual_set, status_set, axis_state] = reader.array(FRAME)?;
        let set = ActualDataSet::from_bits_retain(actual_set);
        if set.reserved() != 0 || actual_set.count_ones() > 1 {
            return Err(invalid(
                "actual data set",
                ACTUAL_SET_AT,
                actual_set,
                lowest(actual_set & !set.reserved()),
            ));
        }
        if status_set != 0 {
            return Err(invalid("status data set", ACTUAL_SET_AT + 1, status_set, 0));
        }
        let actual = ActualValues::parse(reader, set, false)?;
        skip_unused(reader, !set.is_empty())?;
        Ok(Self {
            update_id,
            node_status: NodeStatus::from_bits_retain(node),
            control_mode: ControlMode(control_mode),
            feedback_mode: FeedbackMode(feedback_mode),
            axis_response: AxisControl(axis_response),
            response_status,
            axis_state: AxisStateCode(axis_state),
            actual,
        })
    }

    /// Writes an update of [`LEN`] octets.
    ///
    /// # Errors
    /// The buffer is too short, or there is more than one value, or a LINT position.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        if self.actual.len() > VALUE_LEN || matches!(self.actual.position, Some(ActualPosition::Lint(_))) {
            return Err(too_long(self.actual.len()));
        }
        let format = ConnectionFormat::FIXED_ACTUAL.0;
        writer.slice(FRAME, &[format, FORMAT_REVISION, self.update_id, self.node_status.bits()])?;
        let modes = [self.control_mode.0, self.feedback_mode.0, self.axis_response.0, self.response_status];
        writer.slice(FRAME, &modes)?;
        writer.slice(FRAME, &[0, self.actual.data_set().bits(), 0, self.axis_state.0])?;
        self.actual.emit(writer)?;
        writer.zeros(FRAME, VALUE_LEN - self.actual.len())
    }
}

impl fmt::Display for FixedCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "CIP Motion C-to-D, fixed format, update {}", self.update_id)?;
        writeln!(f, "  Node Control: {}", self.node_control)?;
        writeln!(f, "    Control Mode: {}", self.control_mode)?;
        writeln!(f, "    Feedback Mode: {}", self.feedback_mode)?;
        writeln!(f, "    Axis Control: {}", self.axis_control)?;
        writeln!(f, "    Actual Data Set: {}", self.actual_data_set)?;
        writeln!(f, "    Status Data Set: {}", self.status_data_set)?;
        self.values.fmt(f)
    }
}

impl fmt::Display for FixedActual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "CIP Motion D-to-C, fixed format, update {}", self.update_id)?;
        writeln!(f, "  Node Status: {}", self.node_status)?;
        writeln!(f, "    Axis State: {}", self.axis_state)?;
        writeln!(f, "    Control Mode: {}", self.control_mode)?;
        writeln!(f, "    Feedback Mode: {}", self.feedback_mode)?;
        writeln!(f, "    Axis Response: {}, {}", self.axis_response, GeneralStatus(self.response_status))?;
        self.actual.fmt(f)
    }
}
