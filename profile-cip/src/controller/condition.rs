//! What a step can expect of the device.

use core::fmt;

use super::event::{FaultText, Instance};
use super::status;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{
    AlarmType, AxisIoStatus, AxisStateCode, AxisStatus, ClearingEvent, ControlMode, EventType, FaultType,
    NodeAlarm, NodeFault,
};
use crate::wire::motion::{AlarmRecord, FaultRecord};
use profile_generic::program::Width;

/// A number as an attribute carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// Of an integer type; an unsigned one of 64 bits by its bits.
    Integer(i64),
    /// Of a floating point type.
    Float(f64),
}

impl Number {
    /// Reads a value in wire order; `None` when the bytes are not as many as the type has.
    #[must_use]
    pub fn read(width: Width, bytes: &[u8]) -> Option<Self> {
        macro_rules! whole {
            ($kind:ty) => {
                Self::Integer(i64::from(<$kind>::from_le_bytes(bytes.try_into().ok()?)))
            };
        }
        Some(match width {
            Width::U8 => whole!(u8),
            Width::I8 => whole!(i8),
            Width::U16 => whole!(u16),
            Width::I16 => whole!(i16),
            Width::U32 => whole!(u32),
            Width::I32 => whole!(i32),
            Width::U64 | Width::I64 => Self::Integer(i64::from_le_bytes(bytes.try_into().ok()?)),
            Width::F32 => Self::Float(f64::from(f32::from_le_bytes(bytes.try_into().ok()?))),
            Width::F64 => Self::Float(f64::from_le_bytes(bytes.try_into().ok()?)),
        })
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
        }
    }
}

/// A value that an attribute is to have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueCheck {
    /// How the value lies in memory.
    pub width: Width,
    /// The value.
    pub value: Number,
    /// How far from it is near enough; integers with zero compare exactly.
    pub tolerance: f64,
}

impl ValueCheck {
    /// The value in these bytes, and whether it is the one wanted.
    pub(super) fn judge(&self, bytes: &[u8]) -> (Option<Number>, bool) {
        let found = Number::read(self.width, bytes);
        let good = match (found, self.value) {
            (Some(Number::Integer(found)), Number::Integer(wanted)) => {
                let distance = match self.width {
                    Width::U64 => found.cast_unsigned().abs_diff(wanted.cast_unsigned()),
                    _ => found.abs_diff(wanted),
                };
                distance == 0 || super::number::distance(distance) <= self.tolerance
            }
            (Some(Number::Float(found)), Number::Float(wanted)) => (found - wanted).abs() <= self.tolerance,
            _ => false,
        };
        (found, good)
    }
}

/// Which fault records count; what is `None` may be anything.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultPattern {
    /// Axis Fault Type; anything but Faults Cleared where nothing is said.
    pub fault_type: Option<FaultType>,
    /// Axis Fault Code: the bit number.
    pub code: Option<u8>,
    /// Axis Fault Sub Code.
    pub sub_code: Option<u8>,
}

impl FaultPattern {
    pub(super) fn matches(&self, record: &FaultRecord) -> bool {
        let right_type = match self.fault_type {
            Some(wanted) => record.fault_type == wanted,
            None => record.fault_type != FaultType::CLEARED,
        };
        right_type
            && self.code.is_none_or(|code| record.code == code)
            && self.sub_code.is_none_or(|code| record.sub_code == code)
    }
}

/// Which alarm records count; what is `None` may be anything.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AlarmPattern {
    /// Axis Alarm Type.
    pub alarm_type: Option<AlarmType>,
    /// Axis Alarm Code: the bit number.
    pub code: Option<u8>,
    /// Whether the alarm came or went.
    pub raised: Option<bool>,
}

impl AlarmPattern {
    pub(super) fn matches(&self, record: &AlarmRecord) -> bool {
        self.alarm_type.is_none_or(|wanted| record.alarm_type == wanted)
            && self.code.is_none_or(|code| record.code == code)
            && self.raised.is_none_or(|raised| raised == (record.state != 0))
    }
}

/// What is expected. Records of faults and alarms are taken by the expectation that they meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Condition {
    /// An axis is in a state.
    State {
        /// Instance number.
        axis: u8,
        /// The state.
        state: AxisStateCode,
    },
    /// An axis is at a position.
    Position {
        /// Instance number.
        axis: u8,
        /// Actual position in units.
        position: f64,
        /// Units on either side.
        tolerance: f64,
    },
    /// An axis moves at a velocity.
    Velocity {
        /// Instance number.
        axis: u8,
        /// Actual velocity in units/s: as the device reports it, or from the actual positions if it does not.
        velocity: f64,
        /// Units/s on either side.
        tolerance: f64,
    },
    /// The Control Mode in force.
    Mode {
        /// Instance number.
        axis: u8,
        /// The mode.
        mode: ControlMode,
    },
    /// Bits of Axis Status (651).
    Status {
        /// Instance number.
        axis: u8,
        /// The bits.
        bits: AxisStatus,
        /// Whether all of them are to be on, or all of them off.
        on: bool,
    },
    /// Bits of Axis I/O Status (653).
    IoStatus {
        /// Instance number.
        axis: u8,
        /// The bits.
        bits: AxisIoStatus,
        /// Whether all of them are to be on, or all of them off.
        on: bool,
    },
    /// A record came into the fault log.
    Fault {
        /// Instance number.
        axis: u8,
        /// Which one.
        pattern: FaultPattern,
    },
    /// A record came into the alarm log.
    Alarm {
        /// Instance number.
        axis: u8,
        /// Which one.
        pattern: AlarmPattern,
    },
    /// An event that was armed has occurred.
    Event {
        /// Instance number.
        axis: u8,
        /// What.
        event_type: EventType,
        /// Where, in units and on either side, if it matters.
        position: Option<(f64, f64)>,
    },
    /// No fault of node or axis is there, and none came that no expectation has taken.
    NoFault,
    /// The communications node reports this fault, now or since the last expectation of it.
    NodeFault(NodeFault),
    /// The communications node reports this alarm, now or since the last expectation of it.
    NodeAlarm(NodeAlarm),
    /// The device works synchronously, or asynchronously.
    Synchronous(bool),
    /// The connection is lost: silence from device to controller for longer than its time-out.
    ConnectionLost,
    /// The device counts at least so many lost updates since the connection was opened.
    LostUpdates(u8),
    /// The device counts at least so many late updates since the connection was opened.
    LateUpdates(u8),
    /// An attribute, read by Get_Axis_Attributes_List again and again.
    Attribute {
        /// Instance number; 0 is the class.
        axis: u8,
        /// What to read.
        selector: AttributeSelector,
        /// Its value.
        check: ValueCheck,
    },
    /// A value of the cyclic read data.
    CyclicRead {
        /// Instance number.
        axis: u8,
        /// Attribute ID, one of the list agreed.
        attribute: u16,
        /// Its value.
        check: ValueCheck,
    },
    /// What the device said last of the cyclic write data of the list in use.
    CyclicWriteStatus {
        /// Instance number.
        axis: u8,
        /// General status; 0 for success.
        status: u8,
    },
}

impl Condition {
    /// The instance that it speaks of; `None` for the node.
    #[must_use]
    pub const fn axis(&self) -> Option<u8> {
        match self {
            Self::State { axis, .. }
            | Self::Position { axis, .. }
            | Self::Velocity { axis, .. }
            | Self::Mode { axis, .. }
            | Self::Status { axis, .. }
            | Self::IoStatus { axis, .. }
            | Self::Fault { axis, .. }
            | Self::Alarm { axis, .. }
            | Self::Event { axis, .. }
            | Self::Attribute { axis, .. }
            | Self::CyclicRead { axis, .. }
            | Self::CyclicWriteStatus { axis, .. } => Some(*axis),
            _ => None,
        }
    }
}

impl fmt::Display for Condition {
    // Flat: one arm per condition.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(axis) = self.axis() {
            write!(f, "{}: ", Instance(axis))?;
        }
        let switch = |on: bool| if on { "on" } else { "off" };
        match self {
            Self::State { state, .. } => write!(f, "state {state}"),
            Self::Position { position, tolerance, .. } => write!(f, "position {position} within {tolerance}"),
            Self::Velocity { velocity, tolerance, .. } => write!(f, "velocity {velocity} within {tolerance}"),
            Self::Mode { mode, .. } => mode.fmt(f),
            Self::Status { bits, on, .. } => write!(f, "Axis Status {bits} {}", switch(*on)),
            Self::IoStatus { bits, on, .. } => write!(f, "Axis I/O Status {bits} {}", switch(*on)),
            Self::Fault { pattern, .. } => {
                match pattern.fault_type {
                    Some(FaultType::CLEARED) => {
                        f.write_str("faults cleared")?;
                        return pattern.code.map_or(Ok(()), |code| write!(f, " by {}", ClearingEvent(code)));
                    }
                    Some(kind) => kind.fmt(f)?,
                    None => f.write_str("a fault")?,
                }
                pattern.code.map_or(Ok(()), |code| write!(f, " code {code}"))?;
                pattern.sub_code.map_or(Ok(()), |code| write!(f, " sub code {code}"))
            }
            Self::Alarm { pattern, .. } => {
                match pattern.alarm_type {
                    Some(kind) => kind.fmt(f)?,
                    None => f.write_str("an alarm")?,
                }
                pattern.code.map_or(Ok(()), |code| write!(f, " code {code}"))?;
                pattern.raised.map_or(Ok(()), |on| f.write_str(if on { " raised" } else { " gone" }))
            }
            Self::Event { event_type, position, .. } => {
                event_type.fmt(f)?;
                match position {
                    Some((position, tolerance)) => write!(f, " at {position} within {tolerance}"),
                    None => Ok(()),
                }
            }
            Self::NoFault => f.write_str("no fault that nothing expected"),
            Self::NodeFault(NodeFault::NONE) => f.write_str("no node fault"),
            Self::NodeFault(fault) => write!(f, "node fault: {fault}"),
            Self::NodeAlarm(NodeAlarm::NONE) => f.write_str("no node alarm"),
            Self::NodeAlarm(alarm) => write!(f, "node alarm: {alarm}"),
            Self::Synchronous(true) => f.write_str("synchronous operation"),
            Self::Synchronous(false) => f.write_str("asynchronous operation"),
            Self::ConnectionLost => f.write_str("the connection lost"),
            Self::LostUpdates(count) => write!(f, "{count} lost updates or more counted by the device"),
            Self::LateUpdates(count) => write!(f, "{count} late updates or more counted by the device"),
            Self::Attribute { selector: AttributeSelector { id, .. }, check, .. } => {
                write!(f, "attribute {id} {}", check.value)?;
                if check.tolerance > 0.0 { write!(f, " within {}", check.tolerance) } else { Ok(()) }
            }
            Self::CyclicRead { attribute, check, .. } => {
                write!(f, "attribute {attribute} {} in the cyclic read data", check.value)?;
                if check.tolerance > 0.0 { write!(f, " within {}", check.tolerance) } else { Ok(()) }
            }
            Self::CyclicWriteStatus { status, .. } => {
                write!(f, "status 0x{status:02X} of the cyclic write data")
            }
        }
    }
}

/// What came instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found {
    /// Nothing.
    Nothing,
    /// An axis state.
    State(AxisStateCode),
    /// A number.
    Number(Number),
    /// A Control Mode.
    Mode(ControlMode),
    /// Axis Status.
    Status(AxisStatus),
    /// Axis I/O Status.
    IoStatus(AxisIoStatus),
    /// A fault record of an axis.
    Fault(u8, FaultRecord),
    /// An alarm record.
    Alarm(AlarmRecord),
    /// An event of an axis, and where, in units.
    Event(EventType, f64),
    /// A fault of the node.
    NodeFault(NodeFault),
    /// An alarm of the node.
    NodeAlarm(NodeAlarm),
    /// A general status.
    Refused(u8),
    /// The opposite.
    Otherwise,
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing"),
            Self::State(state) => write!(f, "state {state}"),
            Self::Number(number) => number.fmt(f),
            Self::Mode(mode) => mode.fmt(f),
            Self::Status(status) => status.fmt(f),
            Self::IoStatus(status) => status.fmt(f),
            Self::Fault(axis, fault) => write!(f, "axis {axis}: {}", FaultText(*fault)),
            Self::Alarm(alarm) => write!(f, "{} code {}", alarm.alarm_type, alarm.code),
            Self::Event(event_type, position) => write!(f, "{event_type} at {position}"),
            Self::NodeFault(fault) => write!(f, "node fault: {fault}"),
            Self::NodeAlarm(alarm) => write!(f, "node alarm: {alarm}"),
            Self::Refused(general) => status::Named(*general).fmt(f),
            Self::Otherwise => f.write_str("the opposite"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_by_their_type_and_judged_with_their_tolerance() {
        assert_eq!(Number::read(Width::I16, &[0xFE, 0xFF]), Some(Number::Integer(-2)));
        assert_eq!(Number::read(Width::U32, &[0xFF; 4]), Some(Number::Integer(0xFFFF_FFFF)));
        assert_eq!(Number::read(Width::F32, &1.5_f32.to_le_bytes()), Some(Number::Float(1.5)));
        assert_eq!(Number::read(Width::U16, &[1]), None);
        let judge = |value, tolerance, found: i32| {
            ValueCheck { width: Width::I32, value: Number::Integer(value), tolerance }
                .judge(&found.to_le_bytes())
                .1
        };
        assert!(judge(5, 0.0, 5) && !judge(5, 0.0, 6) && judge(5, 1.0, 6) && !judge(5, 1.0, 3));
        let far = |width, wanted: i64, found: i64| {
            ValueCheck { width, value: Number::Integer(wanted), tolerance: 1.0 }.judge(&found.to_le_bytes()).1
        };
        let most = 5_000_000_000_000_000_000;
        assert!(!far(Width::I64, -most, most) && !far(Width::I64, most, -most) && far(Width::I64, -1, 0));
        // The bits of an unsigned value: the largest one is not near zero, and has no sign in the middle.
        assert!(!far(Width::U64, 0, -1) && far(Width::U64, i64::MAX, i64::MIN) && far(Width::U64, -2, -1));
        let real = ValueCheck { width: Width::F32, value: Number::Float(1.0), tolerance: 0.5 };
        assert!(real.judge(&1.5_f32.to_le_bytes()).1 && !real.judge(&1.6_f32.to_le_bytes()).1);
        assert!(!real.judge(&f32::NAN.to_le_bytes()).1 && !real.judge(&[0]).1);
    }

    #[test]
    fn a_pattern_matches_what_it_names() {
        let fault = FaultRecord { fault_type: FaultType::AXIS, code: 34, sub_code: 2, ..Default::default() };
        let cleared = FaultRecord { fault_type: FaultType::CLEARED, code: 2, ..Default::default() };
        let any = FaultPattern::default();
        assert!(any.matches(&fault) && !any.matches(&cleared));
        let by_code = FaultPattern { code: Some(34), sub_code: Some(3), ..any };
        assert!(!by_code.matches(&fault) && FaultPattern { sub_code: None, ..by_code }.matches(&fault));
        let cleared_by = FaultPattern { fault_type: Some(FaultType::CLEARED), ..any };
        assert!(cleared_by.matches(&cleared) && !cleared_by.matches(&fault));
        let alarm = AlarmRecord { alarm_type: AlarmType::AXIS, code: 7, state: 1, ..Default::default() };
        let gone = AlarmPattern { raised: Some(false), ..AlarmPattern::default() };
        assert!(AlarmPattern::default().matches(&alarm) && !gone.matches(&alarm));
    }
}
