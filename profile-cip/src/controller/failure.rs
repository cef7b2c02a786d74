//! Why a run failed, for people.

use core::fmt;

use super::event::{FaultText, Instance};
use super::status;
use super::trajectory::ProfileError;
use crate::wire;
use crate::wire::motion::FaultRecord;
use crate::wire::motion::codes::{
    AxisControl, AxisStateCode, MotionService, NodeAlarm, NodeFault, SyncStatus,
};
use profile_generic::time::DurationNs;

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
                "packet interval: expected {requested_us} us both ways, the device gives {o_to_t_us} us to \
                 it and {t_to_o_us} us from it"
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
                "axis {axis}: {request} not acknowledged within {waited}, axis response {response}, \
                 state {state}"
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
