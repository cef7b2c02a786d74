//! Connection header and time data of the variable formats 6 and 7, clauses 6-2.7.1.1 and 6-2.7.2.1.
//!
//! | offset | C-to-D | D-to-C |
//! |---|---|---|
//! | 0 | connection format (6) | connection format (7) |
//! | 1 | format revision | format revision |
//! | 2 | update ID | update ID |
//! | 3 | node control | node status |
//! | 4 | instance count | instance count |
//! | 5 | reserved | node fault (high nibble), node alarm (low nibble) |
//! | 6 | last received ID | last received ID |
//! | 7 | time data set | time data set |
//! | 8 | time stamp u64 if bit 0 | time stamp u64 if bit 0 |
//! | | time offset i64 if bit 1 | time offset i64 if bit 1 |
//! | | | lost, late updates u8 each and two reserved bytes if bit 2 |
//! | | | receive and transmit time stamp u64 each if bit 3 |
//!
//! The class-1 sequence count that precedes the header belongs to the transport and is not part of these types.

use core::fmt;

use super::codes::{ConnectionFormat, NodeAlarm, NodeControl, NodeFault, NodeStatus, TimeDataSet};
use super::value::{ReadValue, WriteValue, invalid};
use crate::wire::{Error, Reader, Writer};

mod field {
    pub const FORMAT: usize = 0;
    pub const REVISION: usize = super::REVISION_AT;
    pub const TIME_DATA_SET: usize = 7;
    pub const FIXED_END: usize = 8;
}

/// Format Revision of this edition of the connection, clause 6-2.7.1.1. It equals the connection point.
pub const FORMAT_REVISION: u8 = 2;
/// Format Revision of a later edition, as Wireshark knows it: the same, behind a [run/idle header](super::run_idle).
pub const FORMAT_REVISION_RUN_IDLE: u8 = 3;
/// Place of the Format Revision in an update.
pub const REVISION_AT: usize = 1;
/// Octets of a header without time data.
pub const HEADER_LEN: usize = field::FIXED_END;
const HEADER: &str = "connection header";
const TIME_DATA: &str = "time data";

/// Header of a C-to-D connection update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandHeader {
    /// Update ID, incremented by the controller each update period.
    pub update_id: u8,
    /// What the controller asks of the communications node.
    pub node_control: NodeControl,
    /// Number of instance data blocks that follow.
    pub instance_count: u8,
    /// Update ID of the last D-to-C update that the controller processed.
    pub last_received_id: u8,
    /// Controller Time Stamp, ns of system time.
    pub time_stamp: Option<u64>,
    /// Controller Time Offset, ns.
    pub time_offset: Option<i64>,
    /// Diagnostics asked of the device; only [`TimeDataSet::UPDATE_DIAGNOSTICS`] and
    /// [`TimeDataSet::TIME_DIAGNOSTICS`] count here, the other bits follow from the fields above.
    pub diagnostics: TimeDataSet,
}

/// Lost and late update counters of a D-to-C header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UpdateDiagnostics {
    /// Lost C-to-D updates since the connection was opened, modulo 256.
    pub lost_updates: u8,
    /// Late C-to-D updates since the connection was opened, modulo 256.
    pub late_updates: u8,
}

/// Time diagnostics of a D-to-C header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeDiagnostics {
    /// System time at which the last C-to-D update was received, ns.
    pub received_at: u64,
    /// System time at which this update was handed over for transmission, ns.
    pub transmitted_at: u64,
}

/// Header of a D-to-C connection update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActualHeader {
    /// Update ID; equals that of the C-to-D update of the same cycle.
    pub update_id: u8,
    /// Status of the communications node.
    pub node_status: NodeStatus,
    /// Number of instance data blocks that follow.
    pub instance_count: u8,
    /// Active node fault; four bits.
    pub node_fault: NodeFault,
    /// Active node alarm; four bits.
    pub node_alarm: NodeAlarm,
    /// Update ID of the last C-to-D update that the device processed.
    pub last_received_id: u8,
    /// Device Time Stamp, ns of system time.
    pub time_stamp: Option<u64>,
    /// Device Time Offset, ns.
    pub time_offset: Option<i64>,
    /// Update diagnostics.
    pub update_diagnostics: Option<UpdateDiagnostics>,
    /// Time diagnostics.
    pub time_diagnostics: Option<TimeDiagnostics>,
}

const REQUESTS: TimeDataSet = TimeDataSet::UPDATE_DIAGNOSTICS.union(TimeDataSet::TIME_DIAGNOSTICS);

/// Reads the time data set; a reserved bit could stand for data of unknown size, so it is refused.
fn parse_time_data_set(reader: &mut Reader<'_>) -> Result<TimeDataSet, Error> {
    let set = TimeDataSet::from_bits_retain(reader.u8(HEADER)?);
    if set.reserved() == 0 {
        Ok(set)
    } else {
        Err(invalid("time data set", field::TIME_DATA_SET, set.bits(), set.bits() & !set.reserved()))
    }
}

fn expect_format(reader: &mut Reader<'_>, format: ConnectionFormat, revision: u8) -> Result<(), Error> {
    let (found, found_revision) = (reader.u8(HEADER)?, reader.u8(HEADER)?);
    if found != format.0 {
        return Err(invalid("connection format", field::FORMAT, found, format.0));
    }
    if found_revision != revision {
        return Err(invalid("format revision", field::REVISION, found_revision, revision));
    }
    Ok(())
}

impl CommandHeader {
    /// Reads a header of this format revision and leaves `reader` at the first instance data block.
    ///
    /// # Errors
    /// The octets are too few, or format, revision or time data set are not those that are known.
    pub fn parse(reader: &mut Reader<'_>, revision: u8) -> Result<Self, Error> {
        expect_format(reader, ConnectionFormat::VARIABLE_COMMAND, revision)?;
        let update_id = reader.u8(HEADER)?;
        let node_control = NodeControl::from_bits_retain(reader.u8(HEADER)?);
        let instance_count = reader.u8(HEADER)?;
        reader.u8(HEADER)?;
        let last_received_id = reader.u8(HEADER)?;
        let set = parse_time_data_set(reader)?;
        Ok(Self {
            update_id,
            node_control,
            instance_count,
            last_received_id,
            time_stamp: set.contains(TimeDataSet::TIME_STAMP).then(|| reader.u64(TIME_DATA)).transpose()?,
            time_offset: set.contains(TimeDataSet::TIME_OFFSET).then(|| reader.i64(TIME_DATA)).transpose()?,
            diagnostics: set & REQUESTS,
        })
    }

    /// The Time Data Set octet that these fields give.
    #[must_use]
    pub fn time_data_set(&self) -> TimeDataSet {
        let mut set = self.diagnostics & REQUESTS;
        set.set(TimeDataSet::TIME_STAMP, self.time_stamp.is_some());
        set.set(TimeDataSet::TIME_OFFSET, self.time_offset.is_some());
        set
    }

    /// Octets that [`CommandHeader::emit`] writes.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + 8 * usize::from(self.time_stamp.is_some()) + 8 * usize::from(self.time_offset.is_some())
    }

    /// Writes the header.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u8(HEADER, ConnectionFormat::VARIABLE_COMMAND.0)?;
        writer.u8(HEADER, FORMAT_REVISION)?;
        writer.u8(HEADER, self.update_id)?;
        writer.u8(HEADER, self.node_control.bits())?;
        writer.u8(HEADER, self.instance_count)?;
        writer.u8(HEADER, 0)?;
        writer.u8(HEADER, self.last_received_id)?;
        writer.u8(HEADER, self.time_data_set().bits())?;
        self.time_stamp.map_or(Ok(()), |t| writer.u64(TIME_DATA, t))?;
        self.time_offset.map_or(Ok(()), |t| writer.i64(TIME_DATA, t))
    }
}

impl ActualHeader {
    /// Reads a header of this format revision and leaves `reader` at the first instance data block.
    ///
    /// # Errors
    /// The octets are too few, or format, revision or time data set are not those that are known.
    // Flat: one line per field, each with its error.
    pub fn parse(reader: &mut Reader<'_>, revision: u8) -> Result<Self, Error> {
        expect_format(reader, ConnectionFormat::VARIABLE_ACTUAL, revision)?;
        let update_id = reader.u8(HEADER)?;
        let node_status = NodeStatus::from_bits_retain(reader.u8(HEADER)?);
        let instance_count = reader.u8(HEADER)?;
        let fault_alarm = reader.u8(HEADER)?;
        let last_received_id = reader.u8(HEADER)?;
        let set = parse_time_data_set(reader)?;
        let time_stamp = set.contains(TimeDataSet::TIME_STAMP).then(|| reader.u64(TIME_DATA)).transpose()?;
        let time_offset =
            set.contains(TimeDataSet::TIME_OFFSET).then(|| reader.i64(TIME_DATA)).transpose()?;
        let update_diagnostics = if set.contains(TimeDataSet::UPDATE_DIAGNOSTICS) {
            let (lost_updates, late_updates) = (reader.u8(TIME_DATA)?, reader.u8(TIME_DATA)?);
            reader.u16(TIME_DATA)?;
            Some(UpdateDiagnostics { lost_updates, late_updates })
        } else {
            None
        };
        let time_diagnostics = if set.contains(TimeDataSet::TIME_DIAGNOSTICS) {
            Some(TimeDiagnostics {
                received_at: reader.u64(TIME_DATA)?,
                transmitted_at: reader.u64(TIME_DATA)?,
            })
        } else {
            None
        };
        Ok(Self {
            update_id,
            node_status,
            instance_count,
            node_fault: NodeFault(fault_alarm >> 4),
            node_alarm: NodeAlarm(fault_alarm & 0x0F),
            last_received_id,
            time_stamp,
            time_offset,
            update_diagnostics,
            time_diagnostics,
        })
    }

    /// The Time Data Set octet that these fields give.
    #[must_use]
    pub fn time_data_set(&self) -> TimeDataSet {
        let mut set = TimeDataSet::empty();
        set.set(TimeDataSet::TIME_STAMP, self.time_stamp.is_some());
        set.set(TimeDataSet::TIME_OFFSET, self.time_offset.is_some());
        set.set(TimeDataSet::UPDATE_DIAGNOSTICS, self.update_diagnostics.is_some());
        set.set(TimeDataSet::TIME_DIAGNOSTICS, self.time_diagnostics.is_some());
        set
    }

    /// Octets that [`ActualHeader::emit`] writes.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN
            + 8 * usize::from(self.time_stamp.is_some())
            + 8 * usize::from(self.time_offset.is_some())
            + 4 * usize::from(self.update_diagnostics.is_some())
            + 16 * usize::from(self.time_diagnostics.is_some())
    }

    /// Writes the header; codes beyond four bits are cut to their low four bits.
    ///
    /// # Errors
    /// The buffer is too short.
    // Flat: one line per field, each with its error.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u8(HEADER, ConnectionFormat::VARIABLE_ACTUAL.0)?;
        writer.u8(HEADER, FORMAT_REVISION)?;
        writer.u8(HEADER, self.update_id)?;
        writer.u8(HEADER, self.node_status.bits())?;
        writer.u8(HEADER, self.instance_count)?;
        writer.u8(HEADER, (self.node_fault.0 << 4) | (self.node_alarm.0 & 0x0F))?;
        writer.u8(HEADER, self.last_received_id)?;
        writer.u8(HEADER, self.time_data_set().bits())?;
        self.time_stamp.map_or(Ok(()), |t| writer.u64(TIME_DATA, t))?;
        self.time_offset.map_or(Ok(()), |t| writer.i64(TIME_DATA, t))?;
        if let Some(d) = self.update_diagnostics {
            writer.u8(TIME_DATA, d.lost_updates)?;
            writer.u8(TIME_DATA, d.late_updates)?;
            writer.u16(TIME_DATA, 0)?;
        }
        if let Some(d) = self.time_diagnostics {
            writer.u64(TIME_DATA, d.received_at)?;
            writer.u64(TIME_DATA, d.transmitted_at)?;
        }
        Ok(())
    }
}

fn write_times(
    f: &mut fmt::Formatter<'_>,
    who: &str,
    stamp: Option<u64>,
    offset: Option<i64>,
) -> fmt::Result {
    if let Some(t) = stamp {
        writeln!(f, "  {who} Time Stamp: {t} ns")?;
    }
    if let Some(t) = offset {
        writeln!(f, "  {who} Time Offset: {t} ns")?;
    }
    Ok(())
}

impl fmt::Display for CommandHeader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.describe(FORMAT_REVISION, f)
    }
}

impl CommandHeader {
    /// Writes the header of an update with this format revision as lines of text.
    pub(super) fn describe(&self, revision: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "CIP Motion C-to-D, format revision {revision}, update {}", self.update_id)?;
        writeln!(f, "  Node Control: {}", self.node_control)?;
        writeln!(f, "  Instance Count: {}", self.instance_count)?;
        writeln!(f, "  Last Received ID: {}", self.last_received_id)?;
        writeln!(f, "  Time Data Set: {}", self.time_data_set())?;
        write_times(f, "Controller", self.time_stamp, self.time_offset)
    }
}

impl fmt::Display for ActualHeader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.describe(FORMAT_REVISION, f)
    }
}

impl ActualHeader {
    /// Writes the header of an update with this format revision as lines of text.
    pub(super) fn describe(&self, revision: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "CIP Motion D-to-C, format revision {revision}, update {}", self.update_id)?;
        writeln!(f, "  Node Status: {}", self.node_status)?;
        writeln!(f, "  Instance Count: {}", self.instance_count)?;
        writeln!(f, "  Node Fault: {}", self.node_fault)?;
        writeln!(f, "  Node Alarm: {}", self.node_alarm)?;
        writeln!(f, "  Last Received ID: {}", self.last_received_id)?;
        writeln!(f, "  Time Data Set: {}", self.time_data_set())?;
        write_times(f, "Device", self.time_stamp, self.time_offset)?;
        if let Some(d) = self.update_diagnostics {
            writeln!(f, "  Lost Updates: {}, Late Updates: {}", d.lost_updates, d.late_updates)?;
        }
        if let Some(d) = self.time_diagnostics {
            writeln!(f, "  Data Received: {} ns, Data Transmitted: {} ns", d.received_at, d.transmitted_at)?;
        }
        Ok(())
    }
}
