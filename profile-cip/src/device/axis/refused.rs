//! Why a request of Axis Control was refused. The controller gets a status; people get the reason.

use core::fmt;

use super::state::AxisState;
use crate::wire::motion::codes::{AxisControl, ControlMode, FeedbackMode};
use crate::wire::status::GeneralStatus;

/// Why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalReason {
    /// The axis controls nothing: an encoder, a converter.
    ControlsNothing,
    /// Control Mode 0: the axis reports its feedback and does nothing else.
    FeedbackOnly,
    /// A hookup test is under way.
    Testing,
    /// The axis does not have the Control Mode.
    ControlMode(ControlMode),
    /// The axis does not have the Feedback Mode.
    FeedbackMode(FeedbackMode),
    /// The position reference is being changed; position control has to wait for the second step.
    ReferenceChanging,
    /// The controller has not taken remote control.
    LocalControl,
    /// A node fault stands.
    NodeFault,
    /// The drive is not there.
    DriveOffline,
    /// These start inhibits stand: of the standard, of the manufacturer.
    Inhibited(u16, u16),
    /// It means nothing in this state.
    State(AxisState),
    /// It was begun, and ended in this state.
    EndedIn(AxisState),
    /// The controller has set that nothing follows from it (Axis Exception Action).
    Ignored,
    /// Only a restart of the device clears the fault.
    Unrecoverable,
    /// The block lacks the value that it is about.
    ValueMissing,
    /// Its value leads beyond 64 bits.
    ValueTooFar,
    /// There is no such request.
    Unknown,
}

impl RefusalReason {
    /// What the controller is told.
    pub(super) fn status(self) -> GeneralStatus {
        match self {
            Self::ControlMode(_) | Self::FeedbackMode(_) => GeneralStatus::INVALID_ATTRIBUTE_VALUE,
            Self::ValueMissing => GeneralStatus::NOT_ENOUGH_DATA,
            Self::ValueTooFar => GeneralStatus::INVALID_PARAMETER,
            Self::Unknown => GeneralStatus::SERVICE_NOT_SUPPORTED,
            _ => GeneralStatus::OBJECT_STATE_CONFLICT,
        }
    }
}

impl fmt::Display for RefusalReason {
    // A flat match: one arm for each variant.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ControlsNothing => f.write_str("the axis controls nothing"),
            Self::FeedbackOnly => {
                f.write_str("Control Mode is 0: the axis tells its feedback and follows nothing")
            }
            Self::Testing => f.write_str("a hookup test is under way"),
            Self::ControlMode(mode) => write!(f, "the axis does not have Control Mode {} ({mode})", mode.0),
            Self::FeedbackMode(mode) => {
                write!(f, "the axis does not have Feedback Mode {} in this Control Mode", mode.0)
            }
            Self::ReferenceChanging => f.write_str("only one of the two position references was changed"),
            Self::LocalControl => f.write_str("the controller does not have remote control (Node Control)"),
            Self::NodeFault => f.write_str("a node fault stands"),
            Self::DriveOffline => f.write_str("the drive is not on its bus, or not commissioned yet"),
            Self::Inhibited(standard, manufacturer) => {
                write!(f, "start inhibits stand: {standard:#06x}, of the manufacturer {manufacturer:#06x}")
            }
            Self::State(state) => write!(f, "the axis is {state}"),
            Self::EndedIn(state) => write!(f, "the axis came to {state} instead"),
            Self::Ignored => f.write_str("its Axis Exception Action is Ignore"),
            Self::Unrecoverable => f.write_str("an initialization fault stands, which only a restart clears"),
            Self::ValueMissing => f.write_str("the update has no position displacement"),
            Self::ValueTooFar => f.write_str("the reference would leave 64 bits"),
            Self::Unknown => f.write_str("there is no such request"),
        }
    }
}

/// A request that was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefusedRequest {
    /// What the controller has asked for.
    pub request: AxisControl,
    /// What the controller was told.
    pub status: GeneralStatus,
    /// Why.
    pub reason: RefusalReason,
}

impl fmt::Display for RefusedRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { request, status, reason } = self;
        write!(f, "the request {request} ({}) was refused with status {:#04x}: {reason}", request.0, status.0)
    }
}
