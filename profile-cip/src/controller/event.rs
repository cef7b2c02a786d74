//! What the controller tells its caller while it runs.

use core::fmt;

use super::failure::Failure;
use super::misbehaviour::Misbehaviour;
use super::status;
use crate::wire;
use crate::wire::motion::codes::{
    AxisStateCode, ClearingEvent, FaultType, MotionService, NodeAlarm, NodeFault, SyncStatus,
};
use crate::wire::motion::{AlarmRecord, EventNotification, FaultRecord};

/// Who the device says it is.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceIdentity {
    /// Vendor ID.
    pub vendor: u16,
    /// Device type; 0x25 for a CIP Motion drive.
    pub device_type: u16,
    /// Identity object, attribute 3.
    pub product_code: u16,
    /// Identity object, attribute 4, first byte.
    pub major_revision: u8,
    /// Identity object, attribute 4, second byte.
    pub minor_revision: u8,
    /// Status word.
    pub status: u16,
    /// Identity object, attribute 6.
    pub serial_number: u32,
    /// Identity object, attribute 7.
    pub product_name: String,
}

impl fmt::Display for DeviceIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?} vendor {:#06x} type {:#04x} product {} revision {}.{} serial {:#010x}",
            self.product_name,
            self.vendor,
            self.device_type,
            self.product_code,
            self.major_revision,
            self.minor_revision,
            self.serial_number
        )
    }
}

/// One attribute of a read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttributeValue {
    /// Attribute ID.
    pub id: u16,
    /// The value in wire order, or the general status that says why there is none.
    pub value: Result<Vec<u8>, u8>,
}

/// Something worth knowing.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The device told who it is.
    Identified(DeviceIdentity),
    /// The session is registered.
    SessionRegistered {
        /// Session handle.
        handle: u32,
    },
    /// The motion I/O connection is open.
    ConnectionOpened {
        /// Connection ID towards the device.
        o_to_t_id: u32,
        /// Connection ID from the device.
        t_to_o_id: u32,
    },
    /// All attributes of an instance have been written; 0 is the class.
    Configured {
        /// Instance number.
        instance: u8,
        /// How many attributes.
        attributes: usize,
    },
    /// The device refused an attribute.
    AttributeRefused {
        /// Instance number; 0 is the class.
        instance: u8,
        /// Attribute ID.
        attribute: u16,
        /// General status.
        status: u8,
    },
    /// The device answered Group_Sync.
    GroupSync(SyncStatus),
    /// The device runs synchronously, or asynchronously for want of a grand master.
    Started {
        /// Whether Sync Mode is on.
        synchronous: bool,
    },
    /// An axis changed its state.
    AxisState {
        /// Instance number.
        axis: u8,
        /// State before, unless this is the first one seen.
        from: Option<AxisStateCode>,
        /// State now.
        to: AxisStateCode,
    },
    /// An entry of an axis' fault log came.
    AxisFault {
        /// Instance number.
        axis: u8,
        /// The entry.
        fault: FaultRecord,
    },
    /// An entry of an axis' alarm log came.
    AxisAlarm {
        /// Instance number.
        axis: u8,
        /// The entry.
        alarm: AlarmRecord,
    },
    /// An event that was armed on an axis occurred, or cannot be found.
    AxisEvent {
        /// Instance number.
        axis: u8,
        /// What the device tells of it.
        notification: EventNotification,
    },
    /// The fault of the communications node changed.
    NodeFault(NodeFault),
    /// The alarm of the communications node changed.
    NodeAlarm(NodeAlarm),
    /// The answer to [`Step::ReadAttributes`](super::program::Step::ReadAttributes).
    AttributesRead {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The values in the order of the answer.
        values: Vec<AttributeValue>,
    },
    /// The answer to [`Step::Service`](super::program::Step::Service) or a test result.
    ServiceAnswered {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The service.
        service: MotionService,
        /// General status.
        status: u8,
        /// Body of the answer.
        data: Vec<u8>,
    },
    /// The answer to [`Step::Explicit`](super::program::Step::Explicit).
    ExplicitAnswered {
        /// Service code.
        service: u8,
        /// General status.
        status: u8,
        /// First word of the extended status.
        extended: Option<u16>,
        /// Reply data.
        data: Vec<u8>,
    },
    /// A cyclic list is in use.
    CyclicListInUse {
        /// Instance number.
        axis: u8,
        /// Block ID.
        block_id: u8,
    },
    /// The scaling of an axis was taken from the device.
    Scaled {
        /// Instance number.
        axis: u8,
        /// Counts in a unit.
        counts: f64,
    },
    /// The controller misbehaves from now on.
    Misbehaving(Misbehaviour),
    /// The connection is lost, as is to be expected of a controller that misbehaves.
    ConnectionLost,
    /// The TCP stream was lost while the motion connection goes on; another one is opened, with a new session.
    SessionLost,
    /// Session and connection are opened anew.
    Reconnecting,
    /// A step of the program began.
    StepStarted {
        /// Place in the program, from 0.
        step: usize,
    },
    /// A step of the program has finished.
    StepFinished {
        /// Place in the program, from 0.
        step: usize,
    },
    /// Bytes from the device could not be understood; they were dropped.
    Malformed {
        /// Why.
        error: wire::Error,
    },
    /// The connection is closed, in whatever way the run ended; nothing follows.
    Closed,
    /// The run has failed; the controller disables the axes and closes the connection as far as it can.
    Failed(Failure),
}

/// A fault record in one line.
pub(super) struct FaultText(pub FaultRecord);

impl fmt::Display for FaultText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let r = self.0;
        if r.fault_type == FaultType::CLEARED {
            return write!(f, "{} by {} at {} ns", r.fault_type, ClearingEvent(r.code), r.time_stamp);
        }
        write!(
            f,
            "{} code {} sub code {} action {:#04x} at {} ns",
            r.fault_type, r.code, r.sub_code, r.action, r.time_stamp
        )
    }
}

/// "the class" or "axis n".
pub(super) struct Instance(pub u8);

impl fmt::Display for Instance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("the class"),
            axis => write!(f, "axis {axis}"),
        }
    }
}

impl fmt::Display for Event {
    // Flat: one arm per event.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identified(identity) => write!(f, "device {identity}"),
            Self::SessionRegistered { handle } => write!(f, "session {handle:#010x} registered"),
            Self::ConnectionOpened { o_to_t_id, t_to_o_id } => {
                write!(
                    f,
                    "motion connection open, to the device {o_to_t_id:#010x}, from it {t_to_o_id:#010x}"
                )
            }
            Self::Configured { instance, attributes } => {
                write!(f, "{}: {attributes} attributes written", Instance(*instance))
            }
            Self::AttributeRefused { instance, attribute, status } => {
                let status = status::Named(*status);
                write!(f, "{}: attribute {attribute} refused with {status}", Instance(*instance))
            }
            Self::GroupSync(status) => write!(f, "Group_Sync: {status}"),
            Self::Started { synchronous: true } => f.write_str("synchronous operation"),
            Self::Started { synchronous: false } => f.write_str("asynchronous operation"),
            Self::AxisState { axis, from: None, to } => write!(f, "axis {axis}: {to}"),
            Self::AxisState { axis, from: Some(from), to } => write!(f, "axis {axis}: {from} -> {to}"),
            Self::AxisFault { axis, fault } => write!(f, "axis {axis}: {}", FaultText(*fault)),
            Self::AxisEvent { axis, notification } => write!(
                f,
                "axis {axis}: event {}: {}, status {}, position {}, at {} ns",
                notification.event_id,
                notification.event_type,
                notification.status,
                notification.position,
                notification.time_stamp
            ),
            Self::AxisAlarm { axis, alarm } => write!(
                f,
                "axis {axis}: {} code {} sub code {} state {} at {} ns",
                alarm.alarm_type, alarm.code, alarm.sub_code, alarm.state, alarm.time_stamp
            ),
            Self::NodeFault(fault) => write!(f, "node fault: {fault}"),
            Self::NodeAlarm(alarm) => write!(f, "node alarm: {alarm}"),
            Self::AttributesRead { instance, values } => {
                write!(f, "{}: read", Instance(*instance))?;
                values.iter().try_for_each(|v| match &v.value {
                    Ok(bytes) => write!(f, " {}={bytes:02X?}", v.id),
                    Err(s) => write!(f, " {}: {}", v.id, status::Named(*s)),
                })
            }
            Self::ServiceAnswered { instance, service, status, data } => {
                write!(f, "{}: {service}: {} {data:02X?}", Instance(*instance), status::Named(*status))
            }
            Self::ExplicitAnswered { service, status, extended, data } => {
                write!(f, "explicit service {service:#04x}: {}", status::Named(*status))?;
                extended.map_or(Ok(()), |word| write!(f, ", extended status {word:#06x}"))?;
                write!(f, " {data:02X?}")
            }
            Self::CyclicListInUse { axis, block_id } => {
                write!(f, "axis {axis}: cyclic list in use as block {block_id}")
            }
            Self::Scaled { axis, counts } => write!(f, "axis {axis}: {counts} counts in a unit"),
            Self::Misbehaving(kind) => write!(f, "misbehaving: {kind}"),
            Self::ConnectionLost => f.write_str("connection lost"),
            Self::SessionLost => {
                f.write_str("TCP stream lost; the motion connection goes on, opening another stream")
            }
            Self::Reconnecting => f.write_str("reconnecting"),
            Self::StepStarted { step } => write!(f, "step {step} started"),
            Self::StepFinished { step } => write!(f, "step {step} finished"),
            Self::Malformed { error } => write!(f, "dropped malformed data: {error}"),
            Self::Closed => f.write_str("closed"),
            Self::Failed(failure) => write!(f, "failed: {failure}"),
        }
    }
}
