//! The axis state machine of the Motion Device Axis Object, clause 5-2.6.1.
//!
//! [`AxisState::next`] is the table and nothing else: no time, no side effect.
//!
//! Table 5-2.97, active control (SD shutdown latched, BU bus up, IP in process, SI start inhibits):
//!
//! ```text
//! Off             Power Up                             Self Test
//! Self Test       Self Test Complete                   Initializing
//! Initializing    Initialization Fault                 Major Faulted
//! Initializing    Initialization Complete              Pre-Charge
//! Shutdown        Major Fault, Abort                   Major Faulted
//! Shutdown        Shutdown Reset                       Pre-Charge
//! Pre-Charge      Shutdown                             Shutdown
//! Pre-Charge      Major Fault                          Major Faulted
//! Pre-Charge      Bus Up                               Stopped
//! Start Inhibited Shutdown                             Shutdown
//! Start Inhibited Major Fault                          Major Faulted
//! Start Inhibited Inhibits Cleared                     Stopped
//! Major Faulted   Fault Reset      SD                  Shutdown
//! Major Faulted   Fault Reset      !SD !BU             Pre-Charge
//! Major Faulted   Fault Reset      !SD BU SI           Start Inhibited
//! Major Faulted   Fault Reset      !SD BU !SI          Stopped
//! Major Faulted   Reconnection                         Initializing
//! Stopped         Bus Down                             Pre-Charge
//! Stopped         Shutdown                             Shutdown
//! Stopped         Major Fault                          Major Faulted
//! Stopped         Start Inhibit                        Start Inhibited
//! Stopped         Enable, Test                         Starting
//! Starting        Shutdown, Disable                    Stopping
//! Starting        Major Fault, Abort                   Aborting
//! Starting        Start Complete   !IP                 Running
//! Starting        Start Complete   IP                  Testing
//! Stopping        Stop Complete    !SD                 Stopped
//! Stopping        Stop Complete    SD                  Shutdown
//! Stopping        Major Fault                          Aborting
//! Stopping        Enable           flying start        Starting
//! Aborting        Stop Complete                        Major Faulted
//! Aborting        Fault Reset                          Stopping
//! Testing         Shutdown, Disable, Test Complete     Stopping
//! Testing         Major Fault, Abort                   Aborting
//! Running         Shutdown, Disable                    Stopping
//! Running         Major Fault, Abort                   Aborting
//! any             Connection Close                     Initializing
//! any             Connection Loss                      Major Faulted
//! ```
//!
//! Table 5-2.99, feedback only, differs in: Initialization Complete leads to Start Inhibited; Shutdown Reset, Inhibits
//! Cleared and Fault Reset (!SD !SI) lead to Running; Running goes to Shutdown and Major Faulted at once. The bus does
//! not count. Table 5-2.100, converter, differs in: Bus Up leads to Running and Bus Down back to Pre-Charge; start
//! inhibits act in Pre-Charge and clear into it; Fault Reset (!SD) leads to Pre-Charge.
//!
//! One row comes from the text of clause 5-2.6.2.13, which all three tables lack: Shutdown Reset in Major Faulted
//! clears fault and shutdown together and leads to Pre-Charge; for feedback only, which has none, where a Fault Reset
//! without SD leads. "Any" state is one with a connection to close or lose: not Off, not Self Test.
//!
//! One row is narrower than in Table 5-2.97, by the text of the same clause: a stop that ends in Shutdown (SD) is no place for a flying
//! start.
//!
//! A device that fails its self test has an Initialization Fault (clause 5-2.6.2.2), another row that the tables lack.

use core::fmt;

use crate::wire::motion::codes::AxisStateCode;

/// Which of the three state tables an axis follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ControlKind {
    /// The axis controls motion (Control Mode other than No Control).
    #[default]
    Active,
    /// The axis is a feedback device only (Control Mode No Control).
    FeedbackOnly,
    /// The axis is a power converter.
    Converter,
}

/// State of an axis (attribute 650, Axis State).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisState {
    /// Without power.
    Off,
    /// Testing itself after power up.
    SelfTest,
    /// Waiting for connection and configuration.
    Initializing,
    /// Waiting for the DC bus.
    PreCharge,
    /// Ready; no motion.
    Stopped,
    /// Power structure comes up; the command is not followed yet.
    Starting,
    /// Following the command.
    Running,
    /// Running a test of its own.
    Testing,
    /// Coming to a stop on request.
    Stopping,
    /// Coming to a stop because of a fault.
    Aborting,
    /// Faulted and stopped.
    MajorFaulted,
    /// Ready but for a start inhibit.
    StartInhibited,
    /// Shut down until a Shutdown Reset.
    Shutdown,
}

/// What can change the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisEvent {
    /// Power comes on.
    PowerUp,
    /// The self test has passed.
    SelfTestComplete,
    /// Initialization has failed.
    InitializationFault,
    /// The axis is configured.
    InitializationComplete,
    /// The bus has charged.
    BusUp,
    /// The bus has dropped.
    BusDown,
    /// A start inhibit has come.
    StartInhibit,
    /// The last start inhibit has gone.
    InhibitsCleared,
    /// Enable request.
    Enable,
    /// Disable request.
    Disable,
    /// Request of a test that energizes the axis.
    Test,
    /// Starting conditions are met.
    StartComplete,
    /// The axis has stopped.
    StopComplete,
    /// The test has ended.
    TestComplete,
    /// Shutdown request.
    Shutdown,
    /// Shutdown Reset request.
    ShutdownReset,
    /// Abort request.
    Abort,
    /// A major fault has come.
    MajorFault,
    /// Fault Reset request with the faults cleared.
    FaultReset,
    /// A connection was opened after one had been lost.
    Reconnection,
    /// The controller has closed the connection.
    ConnectionClose,
    /// The connection was lost.
    ConnectionLoss,
}

/// Status that some transitions depend on, Table 5-2.98.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisConditions {
    /// BU: the DC bus is in its operating range.
    pub bus_up: bool,
    /// SD: a shutdown is latched.
    pub shutdown: bool,
    /// IP: a test process is active.
    pub in_process: bool,
    /// SI: at least one start inhibit is active.
    pub start_inhibited: bool,
    /// Flying start is enabled.
    pub flying_start: bool,
}

impl AxisState {
    /// Every state, in the order of the standard's tables.
    pub const ALL: [Self; 13] = [
        Self::Off,
        Self::SelfTest,
        Self::Initializing,
        Self::Shutdown,
        Self::PreCharge,
        Self::StartInhibited,
        Self::MajorFaulted,
        Self::Stopped,
        Self::Starting,
        Self::Stopping,
        Self::Aborting,
        Self::Testing,
        Self::Running,
    ];

    /// The state after `event`, or `None` if the event has no effect in this state.
    #[must_use]
    // A flat match: one arm for each row of the table.
    pub fn next(self, kind: ControlKind, event: AxisEvent, conditions: &AxisConditions) -> Option<Self> {
        match (self, event) {
            (Self::Off, AxisEvent::PowerUp) => Some(Self::SelfTest),
            (Self::Off, _) => None,
            (Self::SelfTest, AxisEvent::SelfTestComplete) => Some(Self::Initializing),
            (Self::SelfTest, AxisEvent::InitializationFault) => Some(Self::MajorFaulted),
            (Self::SelfTest, _) => None,
            (_, AxisEvent::ConnectionClose) => Some(Self::Initializing),
            (_, AxisEvent::ConnectionLoss) => Some(Self::MajorFaulted),
            (Self::Initializing, AxisEvent::InitializationFault) => Some(Self::MajorFaulted),
            (Self::MajorFaulted, AxisEvent::Reconnection) => Some(Self::Initializing),
            (Self::MajorFaulted, AxisEvent::FaultReset) => Some(Self::after_reset(kind, conditions)),
            (Self::MajorFaulted, AxisEvent::ShutdownReset) if kind == ControlKind::FeedbackOnly => {
                Some(Self::after_reset(kind, &AxisConditions { shutdown: false, ..*conditions }))
            }
            (Self::MajorFaulted, AxisEvent::ShutdownReset) => Some(Self::PreCharge),
            (Self::Shutdown | Self::StartInhibited, AxisEvent::MajorFault) => Some(Self::MajorFaulted),
            (Self::StartInhibited, AxisEvent::Shutdown) => Some(Self::Shutdown),
            _ => match kind {
                ControlKind::Active => self.next_active(event, conditions),
                ControlKind::FeedbackOnly => self.next_feedback(event),
                ControlKind::Converter => self.next_converter(event),
            },
        }
    }

    /// Fault Reset State Transition Precedence: Shutdown, Pre-Charge, Start Inhibited, Stopped. A fault that is still
    /// present comes first of all; it is a Major Fault event of its own.
    fn after_reset(kind: ControlKind, conditions: &AxisConditions) -> Self {
        match kind {
            _ if conditions.shutdown => Self::Shutdown,
            ControlKind::Converter => Self::PreCharge,
            ControlKind::Active if !conditions.bus_up => Self::PreCharge,
            _ if conditions.start_inhibited => Self::StartInhibited,
            ControlKind::FeedbackOnly => Self::Running,
            ControlKind::Active => Self::Stopped,
        }
    }

    // A flat match: one arm for each row of the table.
    fn next_active(self, event: AxisEvent, conditions: &AxisConditions) -> Option<Self> {
        match (self, event) {
            (Self::Initializing, AxisEvent::InitializationComplete)
            | (Self::Shutdown, AxisEvent::ShutdownReset)
            | (Self::Stopped, AxisEvent::BusDown) => Some(Self::PreCharge),
            (Self::Shutdown, AxisEvent::Abort) | (Self::PreCharge | Self::Stopped, AxisEvent::MajorFault) => {
                Some(Self::MajorFaulted)
            }
            (Self::PreCharge | Self::Stopped, AxisEvent::Shutdown) => Some(Self::Shutdown),
            (Self::PreCharge, AxisEvent::BusUp) | (Self::StartInhibited, AxisEvent::InhibitsCleared) => {
                Some(Self::Stopped)
            }
            (Self::Stopped, AxisEvent::StartInhibit) => Some(Self::StartInhibited),
            (Self::Stopped, AxisEvent::Enable | AxisEvent::Test) => Some(Self::Starting),
            (Self::Stopping, AxisEvent::Enable) if conditions.flying_start && !conditions.shutdown => {
                Some(Self::Starting)
            }
            (Self::Starting, AxisEvent::StartComplete) => {
                Some(if conditions.in_process { Self::Testing } else { Self::Running })
            }
            (Self::Starting | Self::Testing | Self::Running, AxisEvent::Shutdown | AxisEvent::Disable)
            | (Self::Testing, AxisEvent::TestComplete)
            | (Self::Aborting, AxisEvent::FaultReset) => Some(Self::Stopping),
            (Self::Starting | Self::Testing | Self::Running, AxisEvent::MajorFault | AxisEvent::Abort)
            | (Self::Stopping, AxisEvent::MajorFault) => Some(Self::Aborting),
            (Self::Stopping, AxisEvent::StopComplete) => {
                Some(if conditions.shutdown { Self::Shutdown } else { Self::Stopped })
            }
            (Self::Aborting, AxisEvent::StopComplete) => Some(Self::MajorFaulted),
            _ => None,
        }
    }

    fn next_feedback(self, event: AxisEvent) -> Option<Self> {
        match (self, event) {
            (Self::Initializing, AxisEvent::InitializationComplete) => Some(Self::StartInhibited),
            (Self::Shutdown, AxisEvent::ShutdownReset)
            | (Self::StartInhibited, AxisEvent::InhibitsCleared) => Some(Self::Running),
            (Self::Running, AxisEvent::Shutdown) => Some(Self::Shutdown),
            (Self::Running, AxisEvent::MajorFault) => Some(Self::MajorFaulted),
            _ => None,
        }
    }

    fn next_converter(self, event: AxisEvent) -> Option<Self> {
        match (self, event) {
            (Self::Initializing, AxisEvent::InitializationComplete)
            | (Self::Shutdown, AxisEvent::ShutdownReset)
            | (Self::StartInhibited, AxisEvent::InhibitsCleared)
            | (Self::Running, AxisEvent::BusDown) => Some(Self::PreCharge),
            (Self::PreCharge, AxisEvent::StartInhibit) => Some(Self::StartInhibited),
            (Self::PreCharge, AxisEvent::BusUp) => Some(Self::Running),
            (Self::PreCharge | Self::Running, AxisEvent::Shutdown) => Some(Self::Shutdown),
            (Self::PreCharge | Self::Running, AxisEvent::MajorFault) => Some(Self::MajorFaulted),
            _ => None,
        }
    }

    /// Attribute 650. Off and Self Test have no code of their own; they show as Initializing.
    #[must_use]
    pub const fn code(self) -> AxisStateCode {
        match self {
            Self::Off | Self::SelfTest | Self::Initializing => AxisStateCode::INITIALIZING,
            Self::PreCharge => AxisStateCode::PRE_CHARGE,
            Self::Stopped => AxisStateCode::STOPPED,
            Self::Starting => AxisStateCode::STARTING,
            Self::Running => AxisStateCode::RUNNING,
            Self::Testing => AxisStateCode::TESTING,
            Self::Stopping => AxisStateCode::STOPPING,
            Self::Aborting => AxisStateCode::ABORTING,
            Self::MajorFaulted => AxisStateCode::MAJOR_FAULTED,
            Self::StartInhibited => AxisStateCode::START_INHIBITED,
            Self::Shutdown => AxisStateCode::SHUTDOWN,
        }
    }

    /// Whether the power structure is, or may still be, active by the state table.
    #[must_use]
    pub const fn is_energized(self) -> bool {
        matches!(self, Self::Starting | Self::Running | Self::Testing | Self::Stopping | Self::Aborting)
    }
}

impl fmt::Display for AxisState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("Off"),
            Self::SelfTest => f.write_str("Self Test"),
            _ => self.code().fmt(f),
        }
    }
}

#[cfg(test)]
mod tests;
