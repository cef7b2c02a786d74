//! Why a run failed, for people.

use core::fmt;

use super::condition::{Condition, Found};
use super::event::{FaultText, Instance};
use super::status;
use super::trajectory::ProfileError;
use crate::wire;
use crate::wire::motion::FaultRecord;
use crate::wire::motion::codes::{
    AxisControl, AxisStateCode, ControlMode, EventChecking, MotionService, NodeAlarm, NodeFault, SyncStatus,
    TestStatus,
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
    /// A request of the program with this service code.
    Message(u8),
    /// Get_Attribute_Single of the Identity object, so that an idle session stays open.
    KeepAlive,
}

impl fmt::Display for Exchange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Self::Message(service) = self {
            return write!(f, "explicit service {service:#04x}");
        }
        f.write_str(match self {
            Self::ListIdentity => "ListIdentity",
            Self::RegisterSession => "RegisterSession",
            Self::ReadIdentity => "Get_Attributes_All of the Identity object",
            Self::ForwardOpen => "Forward_Open",
            Self::LargeForwardOpen => "Large_Forward_Open",
            Self::ForwardClose => "Forward_Close",
            Self::Message(_) => "message",
            Self::KeepAlive => "Get_Attribute_Single of the Identity object",
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
    /// The answer to a list of attributes is without one of them, or its value has another length.
    AttributeMissing {
        /// Instance number; 0 is the class.
        instance: u8,
        /// Attribute ID.
        attribute: u16,
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
        /// What Axis Control asked for.
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
        /// What Axis Control asked for.
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
        /// Mode it is in.
        mode: ControlMode,
    },
    /// A step names an axis that the configuration does not have.
    UnknownAxis {
        /// Instance number.
        axis: u8,
        /// How many axes there are.
        count: u8,
    },
    /// Nobody knows how many counts a unit of the axis has, so it may not move.
    NotScaled {
        /// Instance number.
        axis: u8,
    },
    /// A step goes beyond a limit of the axis.
    BeyondLimit {
        /// Instance number.
        axis: u8,
        /// What.
        what: &'static str,
        /// The value, in units, units/s, units/s² or %.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// The data sets of all axes do not fit the connection.
    DataTooLong {
        /// Bytes that the axes need in the longer direction.
        needed: usize,
        /// Bytes of the connection.
        size: u16,
    },
    /// A step asks for something that the fixed connection format cannot carry.
    NotInFormat {
        /// What the format has instead, or has not.
        what: &'static str,
    },
    /// Position control without Actual Position in the updates: the fixed connection format brings another value.
    NoPosition {
        /// Instance number.
        axis: u8,
    },
    /// A request does not fit the connection.
    ServiceTooLong {
        /// Instance number; 0 is the class.
        instance: u8,
        /// The request.
        service: MotionService,
        /// Bytes that fit.
        room: usize,
    },
    /// A value is not in the cyclic list, or not as long as that has it.
    NotInList {
        /// Instance number.
        axis: u8,
        /// Attribute ID.
        attribute: u16,
    },
    /// The device does not take cyclic data of the list agreed.
    CyclicRefused {
        /// Instance number.
        axis: u8,
        /// General status.
        status: u8,
    },
    /// The scaling cannot be taken from the device.
    ScalingUnknown {
        /// Instance number.
        axis: u8,
        /// What the device says of Motion Scaling Configuration (45), if anything.
        configuration: Option<u8>,
    },
    /// An expectation was not met.
    Unmet {
        /// What was expected.
        condition: Condition,
        /// What came.
        found: Found,
        /// How long the controller waited.
        waited: DurationNs,
    },
    /// An answer has another status than expected.
    OtherStatus {
        /// Service code.
        service: u8,
        /// Expected.
        expected: u8,
        /// Found.
        found: u8,
    },
    /// A request that had to be refused was not.
    NotRefused {
        /// Instance number.
        axis: u8,
        /// What Axis Control asked for.
        request: AxisControl,
        /// Response Status expected, if it mattered.
        expected: Option<u8>,
        /// Response Status found.
        found: u8,
    },
    /// A test ended otherwise than expected.
    TestResult {
        /// Instance number.
        axis: u8,
        /// Expected.
        expected: TestStatus,
        /// Found.
        found: TestStatus,
    },
    /// The device does not check for events that are armed.
    EventsNotChecked {
        /// Instance number.
        axis: u8,
        /// Armed.
        wanted: EventChecking,
        /// Event Checking Status.
        found: EventChecking,
    },
    /// The run was ended from outside.
    Interrupted,
    /// No motion can be planned.
    Profile {
        /// Instance number.
        axis: u8,
        /// Why.
        error: ProfileError,
    },
    /// A motion would leave the 32-bit range of Command Position (attributes 360 and 361), or of its Unwind Cycle Count.
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
    // Flat: one arm per failure.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let status = status::Named;
        match *self {
            Self::StreamClosed => f.write_str("the device closed the TCP stream"),
            Self::StreamMalformed(error) => write!(f, "TCP stream: {error}"),
            Self::ExplicitTimeOut { exchange, waited } => write!(f, "{exchange}: no answer within {waited}"),
            Self::Encapsulation { exchange, status } => {
                write!(f, "{exchange}: expected encapsulation status 0, found {status:#06x}")
            }
            Self::Explicit { exchange, general, extended, detail } => write!(
                f,
                "{exchange}: refused with {}{}{}",
                status(general),
                Suffix(", ", extended.map(|code| status::Extended { general, code })),
                Suffix(", the device expects ", detail)
            ),
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
            Self::AttributeMissing { instance, attribute } => {
                write!(f, "{}: no value of attribute {attribute} in the answer", Instance(instance))
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
            Self::NotSynchronized { status, skew, waited } => write!(
                f,
                "Group_Sync: no success within {waited}, last answer: {status}{}",
                Suffix(", device time stamp older by ", skew)
            ),
            Self::NoSyncMode { waited, alarm } => {
                write!(f, "Sync Mode not on within {waited}, node alarm: {alarm}")
            }
            Self::NodeFault(fault) => write!(f, "node fault: {fault}"),
            Self::AxisNotReady { axis, state, waited } => {
                write!(f, "axis {axis}: not ready within {waited}, {}", StateText(state))
            }
            Self::RequestRefused { axis, request, status: s, state } => {
                write!(f, "axis {axis}: {request} refused with {}, state {state}", status(s))
            }
            Self::RequestTimeOut { axis, request, response, state, waited } => write!(
                f,
                "axis {axis}: {request} not acknowledged within {waited}, axis response {response}, \
                 state {state}"
            ),
            Self::AxisNotRunning { axis, state, fault } => write!(
                f,
                "axis {axis}: expected state Running, {}{}",
                StateText(state),
                Suffix(", ", fault.map(FaultText))
            ),
            Self::AxisBusy { axis } => write!(f, "axis {axis}: a motion is under way already"),
            Self::WrongMode { axis, mode } => write!(f, "axis {axis}: this step does not go with {mode}"),
            Self::UnknownAxis { axis, count } => write!(f, "axis {axis}: expected an axis from 1 to {count}"),
            Self::NotScaled { axis } => {
                write!(f, "axis {axis}: does not move, because the counts of its unit are not known")
            }
            Self::BeyondLimit { axis, what, value, limit } => {
                write!(f, "axis {axis}: {what} {value} is beyond the limit {limit}")
            }
            Self::DataTooLong { needed, size } => {
                write!(f, "the data sets of the axes need {needed} bytes, the connection has {size}")
            }
            Self::NotInFormat { what } => write!(f, "the fixed connection format has {what}"),
            Self::NoPosition { axis } => {
                write!(f, "axis {axis}: expected the position as actual value, which position control needs")
            }
            Self::ServiceTooLong { instance, service, room } => write!(
                f,
                "{}: {service} does not fit the {room} bytes that the connection leaves",
                Instance(instance)
            ),
            Self::NotInList { axis, attribute } => {
                write!(f, "axis {axis}: attribute {attribute} is not in the cyclic list with this length")
            }
            Self::CyclicRefused { axis, status: s } => {
                write!(f, "axis {axis}: cyclic data refused with {}", status(s))
            }
            Self::ScalingUnknown { axis, configuration: Some(found) } => {
                write!(f, "axis {axis}: expected the device to scale (attribute 45 is 1), found {found}")
            }
            Self::ScalingUnknown { axis, configuration: None } => write!(
                f,
                "axis {axis}: expected the device to scale (attribute 45 is 1), found no such attribute"
            ),
            Self::Unmet { condition, found, waited } => {
                write!(f, "expected {condition}, found {found} after {waited}")
            }
            Self::OtherStatus { service, expected, found } => {
                write!(f, "service {service:#04x}: expected {}, found {}", status(expected), status(found))
            }
            Self::NotRefused { axis, request, expected, found } => write!(
                f,
                "axis {axis}: expected {request} refused{}, found {}",
                Suffix(" with ", expected.map(status)),
                status(found)
            ),
            Self::TestResult { axis, expected, found } => {
                write!(f, "axis {axis}: expected {expected}, found {found}")
            }
            Self::EventsNotChecked { axis, wanted, found } => {
                write!(f, "axis {axis}: expected events checked: {wanted}, found {found}")
            }
            Self::Interrupted => f.write_str("interrupted"),
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

/// A text and a value behind it; nothing without a value.
struct Suffix<T>(&'static str, Option<T>);

impl<T: fmt::Display> fmt::Display for Suffix<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.1.as_ref().map_or(Ok(()), |value| write!(f, "{}{value}", self.0))
    }
}

struct StateText(Option<AxisStateCode>);

impl fmt::Display for StateText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(state) => write!(f, "found state {state}"),
            None => f.write_str("found no cyclic data"),
        }
    }
}
