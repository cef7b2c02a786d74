//! What the controller tells its caller while it runs, and why it gave up.

use core::fmt;

use super::status;
use super::trajectory::ProfileError;
use crate::wire;
use crate::wire::motion::codes::{
    AxisControl, AxisStateCode, MotionService, NodeAlarm, NodeFault, SyncStatus,
};
use crate::wire::motion::{AlarmRecord, FaultRecord};
use profile_generic::time::DurationNs;

/// Who the device says it is.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceIdentity {
    /// Vendor ID.
    pub vendor: u16,
    /// Device type; 0x25 for a CIP Motion drive.
    pub device_type: u16,
    /// Product code.
    pub product_code: u16,
    /// Major revision.
    pub major_revision: u8,
    /// Minor revision.
    pub minor_revision: u8,
    /// Status word.
    pub status: u16,
    /// Serial number.
    pub serial_number: u32,
    /// Product name.
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

/// An explicit exchange, for messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exchange {
    /// ListIdentity.
    ListIdentity,
    /// RegisterSession.
    RegisterSession,
    /// Get_Attributes_All of the Identity object.
    ReadIdentity,
    /// Forward_Open.
    ForwardOpen,
    /// Large_Forward_Open.
    LargeForwardOpen,
    /// Forward_Close.
    ForwardClose,
}

impl fmt::Display for Exchange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ListIdentity => "ListIdentity",
            Self::RegisterSession => "RegisterSession",
            Self::ReadIdentity => "Get_Attributes_All of the Identity object",
            Self::ForwardOpen => "Forward_Open",
            Self::LargeForwardOpen => "Large_Forward_Open",
            Self::ForwardClose => "Forward_Close",
        })
    }
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

/// Why a run failed: what was expected and what came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// The device closed the TCP stream.
    StreamClosed,
    /// The stream carries something that is not an encapsulation packet of this session.
    StreamMalformed(wire::Error),
    /// No answer to an explicit request.
    ExplicitTimeOut {
        /// The request.
        exchange: Exchange,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// The encapsulation layer refused a request.
    Encapsulation {
        /// The request.
        exchange: Exchange,
        /// Encapsulation status.
        status: u32,
    },
    /// The device refused an explicit request.
    Explicit {
        /// The request.
        exchange: Exchange,
        /// General status.
        general: u8,
        /// First word of the extended status.
        extended: Option<u16>,
        /// Second word of the extended status: the size expected, where the first one speaks of sizes.
        detail: Option<u16>,
    },
    /// An answer could not be understood.
    AnswerMalformed {
        /// The request.
        exchange: Exchange,
        /// Why.
        error: wire::Error,
    },
    /// The device wants another packet interval, which CIP Motion does not permit (clause 7-1.1).
    PacketInterval {
        /// Requested, microseconds.
        requested_us: u32,
        /// What the device gives from controller to device, microseconds.
        o_to_t_us: u32,
        /// What the device gives from device to controller, microseconds.
        t_to_o_us: u32,
    },
    /// No first D-to-C update.
    NoFirstUpdate {
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// No D-to-C update any more.
    ConnectionTimedOut {
        /// Silence from device to controller.
        silent: DurationNs,
        /// Silence allowed.
        limit: DurationNs,
        /// Update ID of the last D-to-C update.
        last_update: u8,
    },
    /// Too many D-to-C updates missing in a row.
    UpdatesMissing {
        /// Update periods without an update.
        missing: u32,
        /// Update periods allowed.
        limit: u8,
    },
    /// The device refused attributes without which the controller may not go on (clause 5-2.6.2.3).
    AttributeRefused {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The first refused attribute.
        attribute: u16,
        /// General status.
        status: u8,
    },
    /// The device refused a request of the service channel.
    ServiceRefused {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The request.
        service: MotionService,
        /// General status.
        status: u8,
    },
    /// No answer in the service channel.
    ServiceTimeOut {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The request.
        service: MotionService,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// An attribute does not fit the connection even alone.
    AttributeTooLong {
        /// Instance number; 0 is the class.
        instance: u8,
        /// Attribute ID.
        attribute: u16,
        /// Bytes that fit.
        room: usize,
    },
    /// The answer in the service channel could not be understood.
    ServiceMalformed {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The request.
        service: MotionService,
        /// Why.
        error: wire::Error,
    },
    /// Group_Sync did not succeed.
    NotSynchronized {
        /// The last answer.
        status: SyncStatus,
        /// System time of the controller less the device's time stamp, at the last answer.
        skew: Option<DurationNs>,
        /// How long the controller tried.
        waited: DurationNs,
    },
    /// Sync Mode did not come on.
    NoSyncMode {
        /// How long the controller waited.
        waited: DurationNs,
        /// Node alarm of the device.
        alarm: NodeAlarm,
    },
    /// The device reports a fault of its communications node.
    NodeFault(NodeFault),
    /// An axis did not become ready.
    AxisNotReady {
        /// Instance number.
        axis: u8,
        /// State it is in; none if the device sends no cyclic block for it.
        state: Option<AxisStateCode>,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// The device refused an Axis Control request.
    RequestRefused {
        /// Instance number.
        axis: u8,
        /// The request.
        request: AxisControl,
        /// Response Status.
        status: u8,
        /// State the axis is in.
        state: AxisStateCode,
    },
    /// The device did not acknowledge an Axis Control request.
    RequestTimeOut {
        /// Instance number.
        axis: u8,
        /// The request.
        request: AxisControl,
        /// Axis Response that came instead.
        response: AxisControl,
        /// State the axis is in.
        state: AxisStateCode,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// A motion needs a Running axis.
    AxisNotRunning {
        /// Instance number.
        axis: u8,
        /// State the axis is in.
        state: Option<AxisStateCode>,
        /// The last fault, if there was one.
        fault: Option<FaultRecord>,
    },
    /// A motion was asked of an axis that has one under way.
    AxisBusy {
        /// Instance number.
        axis: u8,
    },
    /// The axis is not in the control mode that the step needs.
    WrongMode {
        /// Instance number.
        axis: u8,
    },
    /// No motion can be planned.
    Profile {
        /// Instance number.
        axis: u8,
        /// Why.
        error: ProfileError,
    },
    /// A motion would leave the 32-bit range of Command Position (attributes 360 and 361).
    OutOfRange {
        /// Instance number.
        axis: u8,
        /// Where it would end, counts.
        counts: f64,
    },
    /// The actual position did not reach the window.
    OutOfWindow {
        /// Instance number.
        axis: u8,
        /// The window, units.
        window: f64,
        /// Distance between command and actual position, units.
        distance: f64,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// A step took too long.
    StepTimeOut {
        /// How long the controller waited.
        waited: DurationNs,
    },
}

/// "the class" or "axis n".
struct Instance(u8);

impl fmt::Display for Instance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("the class"),
            axis => write!(f, "axis {axis}"),
        }
    }
}

/// A fault record in one line.
pub(super) struct FaultText(pub FaultRecord);

impl fmt::Display for FaultText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let r = self.0;
        write!(
            f,
            "{} code {} sub code {} action {:#04x} at {} ns",
            r.fault_type, r.code, r.sub_code, r.action, r.time_stamp
        )
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let status = status::Named;
        match *self {
            Self::StreamClosed => f.write_str("the device closed the TCP stream"),
            Self::StreamMalformed(error) => write!(f, "TCP stream: {error}"),
            Self::ExplicitTimeOut { exchange, waited } => write!(f, "{exchange}: no answer within {waited}"),
            Self::Encapsulation { exchange, status } => {
                write!(f, "{exchange}: expected encapsulation status 0, found {status:#06x}")
            }
            Self::Explicit { exchange, general, extended, detail } => {
                write!(f, "{exchange}: refused with {}", status(general))?;
                if let Some(code) = extended {
                    write!(f, ", {}", status::Extended { general, code })?;
                }
                detail.map_or(Ok(()), |size| write!(f, ", the device expects {size}"))
            }
            Self::AnswerMalformed { exchange, error } => write!(f, "answer to {exchange}: {error}"),
            Self::PacketInterval { requested_us, o_to_t_us, t_to_o_us } => write!(
                f,
                "packet interval: expected {requested_us} us both ways, the device gives {o_to_t_us} us to it \
                 and {t_to_o_us} us from it"
            ),
            Self::NoFirstUpdate { waited } => {
                write!(f, "no D-to-C update within {waited} after Forward_Open")
            }
            Self::ConnectionTimedOut { silent, limit, last_update } => write!(
                f,
                "connection timed out from device to controller: silent for {silent}, allowed {limit}, last \
                 update {last_update}"
            ),
            Self::UpdatesMissing { missing, limit } => {
                write!(f, "{missing} D-to-C updates missing in a row, allowed {limit}")
            }
            Self::AttributeRefused { instance, attribute, status: s } => {
                write!(f, "{}: attribute {attribute} refused with {}", Instance(instance), status(s))
            }
            Self::ServiceRefused { instance, service, status: s } => {
                write!(f, "{}: {service} refused with {}", Instance(instance), status(s))
            }
            Self::ServiceTimeOut { instance, service, waited } => {
                write!(f, "{}: {service} not answered within {waited}", Instance(instance))
            }
            Self::AttributeTooLong { instance, attribute, room } => write!(
                f,
                "{}: attribute {attribute} does not fit the {room} bytes that the connection leaves",
                Instance(instance)
            ),
            Self::ServiceMalformed { instance, service, error } => {
                write!(f, "{}: answer to {service}: {error}", Instance(instance))
            }
            Self::NotSynchronized { status, skew, waited } => {
                write!(f, "Group_Sync: no success within {waited}, last answer: {status}")?;
                skew.map_or(Ok(()), |skew| write!(f, ", device time stamp older by {skew}"))
            }
            Self::NoSyncMode { waited, alarm } => {
                write!(f, "Sync Mode not on within {waited}, node alarm: {alarm}")
            }
            Self::NodeFault(fault) => write!(f, "node fault: {fault}"),
            Self::AxisNotReady { axis, state, waited } => {
                write!(f, "axis {axis}: not ready within {waited}, ")?;
                StateText(state).fmt(f)
            }
            Self::RequestRefused { axis, request, status: s, state } => {
                write!(f, "axis {axis}: {request} refused with {}, state {state}", status(s))
            }
            Self::RequestTimeOut { axis, request, response, state, waited } => write!(
                f,
                "axis {axis}: {request} not acknowledged within {waited}, axis response {response}, state {state}"
            ),
            Self::AxisNotRunning { axis, state, fault } => {
                write!(f, "axis {axis}: expected state Running, ")?;
                StateText(state).fmt(f)?;
                fault.map_or(Ok(()), |fault| write!(f, ", {}", FaultText(fault)))
            }
            Self::AxisBusy { axis } => write!(f, "axis {axis}: a motion is under way already"),
            Self::WrongMode { axis } => write!(f, "axis {axis}: expected position control for this step"),
            Self::Profile { axis, error } => write!(f, "axis {axis}: {error}"),
            Self::OutOfRange { axis, counts } => {
                write!(f, "axis {axis}: {counts} counts are beyond the 32-bit range of Command Position")
            }
            Self::OutOfWindow { axis, window, distance, waited } => write!(
                f,
                "axis {axis}: expected within {window} of the command, found {distance} away after {waited}"
            ),
            Self::StepTimeOut { waited } => write!(f, "not finished within {waited}"),
        }
    }
}

impl std::error::Error for Failure {}

struct StateText(Option<AxisStateCode>);

impl fmt::Display for StateText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(state) => write!(f, "found state {state}"),
            None => f.write_str("found no cyclic data"),
        }
    }
}

impl fmt::Display for Event {
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
            Self::StepStarted { step } => write!(f, "step {step} started"),
            Self::StepFinished { step } => write!(f, "step {step} finished"),
            Self::Malformed { error } => write!(f, "dropped malformed data: {error}"),
            Self::Closed => f.write_str("closed"),
            Self::Failed(failure) => write!(f, "failed: {failure}"),
        }
    }
}
