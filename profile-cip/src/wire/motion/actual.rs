//! Cyclic actual data block of the D-to-C connection with its status data set, clauses 6-2.7.2.1.5 and 6-2.7.1.2.2.
//!
//! | offset | content |
//! |---|---|
//! | 0 | control mode |
//! | 1 | feedback mode, position feedback type (bits 5..4) |
//! | 2 | axis response |
//! | 3 | response status |
//! | 4 | reserved |
//! | 5 | actual data set |
//! | 6 | status data set |
//! | 7 | axis state |
//! | 8 | actual values, then status values, each in the order of the bits |

use core::fmt;

use super::codes::{
    ActualDataSet, AlarmType, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, ClearingEvent,
    ControlMode, FaultType, FeedbackMode, StatusDataSet,
};
use super::value::{ReadValue, WriteValue, invalid};
use crate::wire::status::GeneralStatus;
use crate::wire::{Error, Reader, Writer};

/// Octets of the block without values.
pub const HEADER_LEN: usize = 8;
const BLOCK: &str = "cyclic actual block";
const ACTUAL_SET_AT: usize = 5;
const STATUS_SET_AT: usize = 6;

/// Actual Position in the type that the block's Feedback Mode gives. Unit: position control units (counts).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActualPosition {
    /// DINT; the low 32 bits of the position, it rolls over.
    Dint(i32),
    /// LINT; only where both sides agreed on it.
    Lint(i64),
}

/// Actual values; the present ones make up the Actual Data Set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ActualValues {
    /// Actual Position, position control units.
    pub position: Option<ActualPosition>,
    /// Actual Velocity, velocity control units.
    pub velocity: Option<f32>,
    /// Actual Acceleration, acceleration control units.
    pub acceleration: Option<f32>,
    /// Unwind Cycle Count.
    pub unwind_count: Option<i32>,
    /// Position Displacement, position control units.
    pub position_displacement: Option<i32>,
}

/// Fault record, Table 6-2.23 bit 0 and attributes 661 to 663, 666 and 668.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultRecord {
    /// Source of the fault; zero says that faults were cleared.
    pub fault_type: FaultType,
    /// Bit number of the fault, or a [`ClearingEvent`] if the type is zero.
    pub code: u8,
    /// More detail; its meaning depends on the fault.
    pub sub_code: u8,
    /// What the device did: stopping action in the low nibble, state change in the high one.
    pub action: u8,
    /// System time of the fault, ns.
    pub time_stamp: u64,
}

/// Alarm record, Table 6-2.23 bit 1 and attributes 664, 665, 667, 669 and 670.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AlarmRecord {
    /// Source of the alarm.
    pub alarm_type: AlarmType,
    /// Bit number of the alarm.
    pub code: u8,
    /// More detail; its meaning depends on the alarm.
    pub sub_code: u8,
    /// 1 if the alarm came, 0 if it went.
    pub state: u8,
    /// System time of the change, ns.
    pub time_stamp: u64,
}

/// Safety status, Table 6-2.23 bit 4.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SafetyStatus {
    /// Axis Safety Status, attribute 761.
    pub status: u32,
    /// Axis Safety Status - Mfg, attribute 762.
    pub manufacturer: u32,
    /// Axis Safety State, attribute 760.
    pub state: u8,
}

/// Status values; the present ones make up the Status Data Set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StatusValues {
    /// The next record of the fault log.
    pub fault: Option<FaultRecord>,
    /// The next record of the alarm log.
    pub alarm: Option<AlarmRecord>,
    /// Axis Status and its manufacturer word.
    pub axis_status: Option<(AxisStatus, u32)>,
    /// Axis I/O Status and its manufacturer word.
    pub io_status: Option<(AxisIoStatus, u32)>,
    /// Safety status.
    pub safety: Option<SafetyStatus>,
}

/// Cyclic actual data block.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ActualBlock {
    /// Control Mode in force.
    pub control_mode: ControlMode,
    /// Feedback Mode in force with the position feedback type; [`ActualBlock::emit`] writes the type of the position.
    pub feedback_mode: FeedbackMode,
    /// Acknowledge of a state change request.
    pub axis_response: AxisControl,
    /// General status of the acknowledged request; 0 is success.
    pub response_status: u8,
    /// Axis State.
    pub axis_state: AxisStateCode,
    /// Actual values.
    pub actual: ActualValues,
    /// Status values.
    pub status: StatusValues,
}

impl ActualValues {
    /// The Actual Data Set octet that the present values give.
    #[must_use]
    pub fn data_set(&self) -> ActualDataSet {
        let mut set = ActualDataSet::empty();
        set.set(ActualDataSet::POSITION, self.position.is_some());
        set.set(ActualDataSet::VELOCITY, self.velocity.is_some());
        set.set(ActualDataSet::ACCELERATION, self.acceleration.is_some());
        set.set(ActualDataSet::UNWIND_COUNT, self.unwind_count.is_some());
        set.set(ActualDataSet::POSITION_DISPLACEMENT, self.position_displacement.is_some());
        set
    }

    /// Octets of the values.
    #[must_use]
    pub fn len(&self) -> usize {
        let lint = matches!(self.position, Some(ActualPosition::Lint(_)));
        let values = [
            self.position.is_some(),
            lint,
            self.velocity.is_some(),
            self.acceleration.is_some(),
            self.unwind_count.is_some(),
            self.position_displacement.is_some(),
        ];
        values.map(|present| 4 * usize::from(present)).iter().sum()
    }

    /// Whether there is no value at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.data_set().is_empty()
    }

    #[inline]
    pub(super) fn parse(reader: &mut Reader<'_>, set: ActualDataSet, lint: bool) -> Result<Self, Error> {
        let has = |bit| set.contains(bit);
        Ok(Self {
            position: if !has(ActualDataSet::POSITION) {
                None
            } else if lint {
                Some(ActualPosition::Lint(reader.i64(BLOCK)?))
            } else {
                Some(ActualPosition::Dint(reader.i32(BLOCK)?))
            },
            velocity: has(ActualDataSet::VELOCITY).then(|| reader.f32(BLOCK)).transpose()?,
            acceleration: has(ActualDataSet::ACCELERATION).then(|| reader.f32(BLOCK)).transpose()?,
            unwind_count: has(ActualDataSet::UNWIND_COUNT).then(|| reader.i32(BLOCK)).transpose()?,
            position_displacement: has(ActualDataSet::POSITION_DISPLACEMENT)
                .then(|| reader.i32(BLOCK))
                .transpose()?,
        })
    }

    pub(super) fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        match self.position {
            Some(ActualPosition::Dint(p)) => writer.i32(BLOCK, p)?,
            Some(ActualPosition::Lint(p)) => writer.i64(BLOCK, p)?,
            None => {}
        }
        for value in [self.velocity, self.acceleration].into_iter().flatten() {
            writer.f32(BLOCK, value)?;
        }
        for value in [self.unwind_count, self.position_displacement].into_iter().flatten() {
            writer.i32(BLOCK, value)?;
        }
        Ok(())
    }
}

impl StatusValues {
    /// The Status Data Set octet that the present values give.
    #[must_use]
    pub fn data_set(&self) -> StatusDataSet {
        let mut set = StatusDataSet::empty();
        set.set(StatusDataSet::FAULT, self.fault.is_some());
        set.set(StatusDataSet::ALARM, self.alarm.is_some());
        set.set(StatusDataSet::AXIS_STATUS, self.axis_status.is_some());
        set.set(StatusDataSet::IO_STATUS, self.io_status.is_some());
        set.set(StatusDataSet::SAFETY_STATUS, self.safety.is_some());
        set
    }

    /// Octets of the values.
    #[must_use]
    pub fn len(&self) -> usize {
        12 * usize::from(self.fault.is_some())
            + 12 * usize::from(self.alarm.is_some())
            + 8 * usize::from(self.axis_status.is_some())
            + 8 * usize::from(self.io_status.is_some())
            + 12 * usize::from(self.safety.is_some())
    }

    /// Whether there is no value at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.data_set().is_empty()
    }

    #[inline]
    // Flat: one item per field that may be there.
    fn parse(reader: &mut Reader<'_>, set: StatusDataSet) -> Result<Self, Error> {
        let mut values = Self::default();
        if set.contains(StatusDataSet::FAULT) {
            values.fault = Some(FaultRecord {
                fault_type: FaultType(reader.u8(BLOCK)?),
                code: reader.u8(BLOCK)?,
                sub_code: reader.u8(BLOCK)?,
                action: reader.u8(BLOCK)?,
                time_stamp: reader.u64(BLOCK)?,
            });
        }
        if set.contains(StatusDataSet::ALARM) {
            values.alarm = Some(AlarmRecord {
                alarm_type: AlarmType(reader.u8(BLOCK)?),
                code: reader.u8(BLOCK)?,
                sub_code: reader.u8(BLOCK)?,
                state: reader.u8(BLOCK)?,
                time_stamp: reader.u64(BLOCK)?,
            });
        }
        if set.contains(StatusDataSet::AXIS_STATUS) {
            values.axis_status = Some((AxisStatus::from_bits_retain(reader.u32(BLOCK)?), reader.u32(BLOCK)?));
        }
        if set.contains(StatusDataSet::IO_STATUS) {
            values.io_status = Some((AxisIoStatus::from_bits_retain(reader.u32(BLOCK)?), reader.u32(BLOCK)?));
        }
        if set.contains(StatusDataSet::SAFETY_STATUS) {
            let (status, manufacturer) = (reader.u32(BLOCK)?, reader.u32(BLOCK)?);
            let state = reader.u8(BLOCK)?;
            reader.take(BLOCK, 3)?;
            values.safety = Some(SafetyStatus { status, manufacturer, state });
        }
        Ok(values)
    }

    // Flat: one item per field that may be there.
    fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        if let Some(r) = self.fault {
            writer.slice(BLOCK, &[r.fault_type.0, r.code, r.sub_code, r.action])?;
            writer.u64(BLOCK, r.time_stamp)?;
        }
        if let Some(r) = self.alarm {
            writer.slice(BLOCK, &[r.alarm_type.0, r.code, r.sub_code, r.state])?;
            writer.u64(BLOCK, r.time_stamp)?;
        }
        if let Some((standard, manufacturer)) = self.axis_status {
            writer.u32(BLOCK, standard.bits())?;
            writer.u32(BLOCK, manufacturer)?;
        }
        if let Some((standard, manufacturer)) = self.io_status {
            writer.u32(BLOCK, standard.bits())?;
            writer.u32(BLOCK, manufacturer)?;
        }
        if let Some(s) = self.safety {
            writer.u32(BLOCK, s.status)?;
            writer.u32(BLOCK, s.manufacturer)?;
            writer.u8(BLOCK, s.state)?;
            writer.zeros(BLOCK, 3)?;
        }
        Ok(())
    }
}

impl ActualBlock {
    /// Reads a block; `block` must hold exactly the block.
    ///
    /// # Errors
    /// The octets are too few or too many for the data sets, or a data set has a reserved or vendor specific bit,
    /// whose size is unknown.
    #[inline]
    pub fn parse(block: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(block);
        let [
            control_mode,
            feedback_mode,
            axis_response,
            response_status,
            _,
            actual_set,
            status_set,
            axis_state,
        ] = reader.array(BLOCK)?;
        let feedback_mode = FeedbackMode(feedback_mode);
        let actual_set = ActualDataSet::from_bits_retain(actual_set);
        let status_set = StatusDataSet::from_bits_retain(status_set);
        if actual_set.reserved() != 0 {
            let known = actual_set.bits() & !actual_set.reserved();
            return Err(invalid("actual data set", ACTUAL_SET_AT, actual_set.bits(), known));
        }
        let sized = status_set.bits() & 0b1_1111;
        if status_set.bits() != sized {
            return Err(invalid("status data set", STATUS_SET_AT, status_set.bits(), sized));
        }
        let actual = ActualValues::parse(reader, actual_set, feedback_mode.position_is_lint())?;
        let status = StatusValues::parse(reader, status_set)?;
        reader.finish(BLOCK)?;
        Ok(Self {
            control_mode: ControlMode(control_mode),
            feedback_mode,
            axis_response: AxisControl(axis_response),
            response_status,
            axis_state: AxisStateCode(axis_state),
            actual,
            status,
        })
    }

    /// Octets that [`ActualBlock::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + self.actual.len() + self.status.len()
    }

    /// Writes the block.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let feedback_mode = match self.actual.position {
            Some(ActualPosition::Lint(_)) => self.feedback_mode.with_lint(true),
            Some(ActualPosition::Dint(_)) => self.feedback_mode.with_lint(false),
            None => self.feedback_mode,
        };
        let header: [u8; HEADER_LEN] = [
            self.control_mode.0,
            feedback_mode.0,
            self.axis_response.0,
            self.response_status,
            0,
            self.actual.data_set().bits(),
            self.status.data_set().bits(),
            self.axis_state.0,
        ];
        writer.slice(BLOCK, &header)?;
        self.actual.emit(writer)?;
        self.status.emit(writer)
    }
}

impl fmt::Display for FaultRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.fault_type == FaultType::CLEARED {
            write!(f, "{}: {}", self.fault_type, ClearingEvent(self.code))?;
        } else {
            write!(
                f,
                "{} {}, sub code {}, action 0x{:02X}",
                self.fault_type, self.code, self.sub_code, self.action
            )?;
        }
        write!(f, ", at {} ns", self.time_stamp)
    }
}

impl fmt::Display for AlarmRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let change = match self.state {
            0 => "off",
            1 => "on",
            _ => "reserved state",
        };
        write!(f, "{} {}, sub code {}, {change}", self.alarm_type, self.code, self.sub_code)?;
        write!(f, ", at {} ns", self.time_stamp)
    }
}

impl fmt::Display for ActualValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.position {
            Some(ActualPosition::Dint(p)) => writeln!(f, "    Actual Position: {p} (DINT)")?,
            Some(ActualPosition::Lint(p)) => writeln!(f, "    Actual Position: {p} (LINT)")?,
            None => {}
        }
        let reals = [("Actual Velocity", self.velocity), ("Actual Acceleration", self.acceleration)];
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

impl fmt::Display for ActualBlock {
    // Flat: one item per field that may be there.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Axis State: {}", self.axis_state)?;
        writeln!(f, "    Control Mode: {}", self.control_mode)?;
        writeln!(f, "    Feedback Mode: {}", self.feedback_mode)?;
        writeln!(f, "    Axis Response: {}, {}", self.axis_response, GeneralStatus(self.response_status))?;
        writeln!(f, "    Actual Data Set: {}", self.actual.data_set())?;
        writeln!(f, "    Status Data Set: {}", self.status.data_set())?;
        self.actual.fmt(f)?;
        if let Some(record) = self.status.fault {
            writeln!(f, "    Axis Fault: {record}")?;
        }
        if let Some(record) = self.status.alarm {
            writeln!(f, "    Axis Alarm: {record}")?;
        }
        if let Some((standard, manufacturer)) = self.status.axis_status {
            writeln!(f, "    Axis Status: {standard}; manufacturer 0x{manufacturer:08X}")?;
        }
        if let Some((standard, manufacturer)) = self.status.io_status {
            writeln!(f, "    Axis I/O Status: {standard}; manufacturer 0x{manufacturer:08X}")?;
        }
        if let Some(s) = self.status.safety {
            writeln!(
                f,
                "    Axis Safety Status: 0x{:08X}; manufacturer 0x{:08X}; state {}",
                s.status, s.manufacturer, s.state
            )?;
        }
        Ok(())
    }
}
