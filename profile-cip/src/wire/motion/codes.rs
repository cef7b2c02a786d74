//! Codes of the CIP Motion connection. Unknown codes are kept as they came.

pub use crate::generated::motion_codes::{
    AlarmType, AxisControl, AxisStateCode, ClearingEvent, CommandTarget, ConnectionFormat, ControlMode,
    EventType, FaultType, FeedbackSource, MotionService, NodeAlarm, NodeFault, SyncStatus, TestStatus,
};
use core::fmt;

pub use super::flags::{
    ActualDataSet, AxisIoStatus, AxisStatus, CommandDataSet, ControlStatus, EventChecking, NodeControl,
    NodeStatus, StatusDataSet, TimeDataSet,
};

/// Feedback Mode octet, Table 6-2.16: the mode in the low four bits.
///
/// Bits 5..4 are reserved in this edition; later ones use them for the type of the position feedback (0 DINT, 1 LINT),
/// and so does common diagnostic software. The type is taken from the octet that travels with the position.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FeedbackMode(pub u8);

const POSITION_TYPE_MASK: u8 = 0x30;
const POSITION_TYPE_LINT: u8 = 0x10;

impl FeedbackMode {
    /// The mode proper.
    #[must_use]
    pub const fn source(self) -> FeedbackSource {
        FeedbackSource(self.0 & 0x0F)
    }

    /// Whether the position feedback beside this octet is a LINT.
    #[must_use]
    pub const fn position_is_lint(self) -> bool {
        self.0 & POSITION_TYPE_MASK == POSITION_TYPE_LINT
    }

    /// The same mode with the position feedback as LINT, or as DINT.
    #[must_use]
    pub const fn with_lint(self, lint: bool) -> Self {
        let rest = self.0 & !POSITION_TYPE_MASK;
        Self(if lint { rest | POSITION_TYPE_LINT } else { rest })
    }
}

impl fmt::Display for FeedbackMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.position_is_lint() { "LINT" } else { "DINT" };
        write!(f, "{}, position as {kind}", self.source())
    }
}
