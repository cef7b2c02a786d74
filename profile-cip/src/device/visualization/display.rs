//! The alphanumeric display (Tables 9-1.3 to 9-1.5).
//!
//! The tables say what is shown for a condition, not which of several conditions comes first. Here it is one line, and
//! the first of these that holds:
//!
//! ```text
//! self test                               SELF-TEST
//! node fault                              NODE FLT ##
//! the axis still moves because of a fault ABORTING
//! fault of the axis                       INIT FLT, SAFE FLT, FLT, APR FLT
//! the connection is not ready yet         STANDBY, CONNECTING, CONFIGURING, SYNCING
//! node alarm                              NODE ALARM ##
//! start inhibit                           INHIBIT
//! alarm of the axis                       ALARM
//! state of the axis                       PRE-CHARGE, SHUTDOWN, STOPPED, ...
//! ```
//!
//! An axis in motion does not wait for Group_Sync, and its state is shown. The tables have no string for an APR fault;
//! APR FLT is ours, made like the others.

use core::fmt::Write as _;

use arrayvec::ArrayString;
use profile_generic::open_code;

use super::AxisCondition;
use crate::device::axis::state::{AxisState, ControlKind};
use crate::wire::motion::codes::{AlarmType, FaultType, NodeAlarm, NodeFault};

/// Characters that hold any line: `X255:SAFE FLT M255` and less.
pub const LINE_MAX: usize = 20;

open_code! {
    /// The string of a line without its code. Never changed, only added to: programs outside read the numbers.
    pub struct LineText(u8) {
        /// Nothing to show.
        NONE = 0 => "",
        /// Executing the device's self test.
        SELF_TEST = 1 => "SELF-TEST",
        /// Waiting for Forward_Open.
        STANDBY = 2 => "STANDBY",
        /// Waiting for the first Set of an attribute.
        CONNECTING = 3 => "CONNECTING",
        /// Attributes of class and axes are being set.
        CONFIGURING = 4 => "CONFIGURING",
        /// Waiting for a successful Group_Sync.
        SYNCING = 5 => "SYNCING",
        /// Waiting for the DC bus.
        PRE_CHARGE = 6 => "PRE-CHARGE",
        /// Shut down.
        SHUTDOWN = 7 => "SHUTDOWN",
        /// Stopped.
        STOPPED = 8 => "STOPPED",
        /// Start inhibited.
        INHIBITED = 9 => "INHIBITED",
        /// Starting.
        STARTING = 10 => "STARTING",
        /// Running.
        RUNNING = 11 => "RUNNING",
        /// Executing a test procedure.
        TESTING = 12 => "TESTING",
        /// Decelerating to a stop because of a disable.
        STOPPING = 13 => "STOPPING",
        /// Decelerating to a stop because of a fault.
        ABORTING = 14 => "ABORTING",
        /// Initialization fault.
        INIT_FAULT = 15 => "INIT FLT S",
        /// Initialization fault of the manufacturer.
        INIT_FAULT_MFG = 16 => "INIT FLT M",
        /// Axis fault.
        FAULT = 17 => "FLT S",
        /// Axis fault of the manufacturer.
        FAULT_MFG = 18 => "FLT M",
        /// Axis alarm.
        ALARM = 19 => "ALARM S",
        /// Axis alarm of the manufacturer.
        ALARM_MFG = 20 => "ALARM M",
        /// Start inhibit.
        INHIBIT = 21 => "INHIBIT S",
        /// Start inhibit of the manufacturer.
        INHIBIT_MFG = 22 => "INHIBIT M",
        /// Axis safety fault.
        SAFETY_FAULT = 23 => "SAFE FLT S",
        /// Axis safety fault of the manufacturer.
        SAFETY_FAULT_MFG = 24 => "SAFE FLT M",
        /// Node fault.
        NODE_FAULT = 25 => "NODE FLT ",
        /// Node alarm.
        NODE_ALARM = 26 => "NODE ALARM ",
        /// APR fault.
        APR_FAULT = 27 => "APR FLT S",
        /// APR fault of the manufacturer.
        APR_FAULT_MFG = 28 => "APR FLT M",
    }
}

impl LineText {
    /// Whether a code follows.
    const fn is_coded(self) -> bool {
        matches!(self.0, 15..=28)
    }

    /// Whether the line is of one axis: with several axes its instance number comes first (Table 9-1.5).
    const fn is_of_axis(self) -> bool {
        !matches!(self, Self::NODE_FAULT | Self::NODE_ALARM) && self.0 > Self::PRE_CHARGE.0
    }

    /// Before the code on a display of seven segments, or the whole of it (Table 9-1.3).
    ///
    /// "Device is operational" is everything behind the start of the device; a display of one digit has no more.
    // Flat: the table of the display, one arm per character.
    const fn segments(self) -> &'static str {
        match self {
            Self::NONE => "",
            Self::SELF_TEST => "8",
            Self::STANDBY | Self::CONNECTING => "0",
            Self::CONFIGURING => "1",
            Self::SYNCING => "2",
            Self::PRE_CHARGE => "3",
            Self::INIT_FAULT => "I",
            Self::INIT_FAULT_MFG => "Ic",
            // The table has none for APR faults.
            Self::FAULT | Self::APR_FAULT => "F",
            Self::FAULT_MFG | Self::APR_FAULT_MFG => "Fc",
            Self::ALARM => "A",
            Self::ALARM_MFG => "Ac",
            Self::INHIBIT => "S",
            Self::INHIBIT_MFG => "Sc",
            Self::SAFETY_FAULT => "SF",
            Self::SAFETY_FAULT_MFG => "SFc",
            Self::NODE_FAULT => "nF",
            Self::NODE_ALARM => "nA",
            _ => "4",
        }
    }
}

/// A line of the display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Line {
    /// The string.
    pub text: LineText,
    /// The code behind it; 0 for a string without one.
    pub code: u8,
}

impl Line {
    const fn plain(text: LineText) -> Self {
        Self { text, code: 0 }
    }

    /// The line on a display of many characters; `instance` is the axis in a device that has several.
    #[must_use]
    pub fn characters(self, instance: Option<u8>) -> ArrayString<LINE_MAX> {
        let mut out = ArrayString::new();
        // Every text with instance and code is shorter than the line.
        let _ = match instance.filter(|_| self.text.is_of_axis()) {
            Some(instance) => write!(out, "X{instance}:{}", self.text),
            None => write!(out, "{}", self.text),
        };
        if self.text.is_coded() {
            let _ = write!(out, "{:02}", self.code);
        }
        out
    }

    /// The line on a display of seven segments, one character after the other.
    #[must_use]
    pub fn segments(self) -> ArrayString<LINE_MAX> {
        let mut out = ArrayString::new();
        let _ = out.write_str(self.text.segments());
        if self.text.is_coded() {
            let _ = write!(out, "{:02}", self.code);
        }
        out
    }
}

/// How far the device is with its connection (clause 7-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Startup {
    /// There is none.
    #[default]
    Standby,
    /// It is open, and refreshed.
    Connecting,
    /// Attributes are being set.
    Configuring,
    /// Everything is set; the clocks are not proven to be the same.
    Syncing,
    /// It is ready.
    Complete,
}

/// The node of a device, as far as it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NodeCondition {
    /// Its connection.
    pub startup: Startup,
    /// Node fault.
    pub fault: NodeFault,
    /// Node alarm.
    pub alarm: NodeAlarm,
}

/// The line that an axis shows. An axis that controls nothing shows none unless something is wrong (clause 9-1.1.1.6).
#[must_use]
pub fn line(node: &NodeCondition, axis: &AxisCondition) -> Line {
    let of_state = state_line(axis.state);
    let silent = axis.kind == ControlKind::FeedbackOnly;
    let moves = matches!(
        axis.state,
        AxisState::Starting | AxisState::Running | AxisState::Testing | AxisState::Stopping
    );
    let startup = match node.startup {
        Startup::Standby => Some(LineText::STANDBY),
        Startup::Connecting => Some(LineText::CONNECTING),
        Startup::Configuring if axis.state == AxisState::Initializing => Some(LineText::CONFIGURING),
        Startup::Syncing if !moves => Some(LineText::SYNCING),
        Startup::Configuring | Startup::Syncing | Startup::Complete => None,
    };
    if matches!(axis.state, AxisState::Off | AxisState::SelfTest) {
        of_state
    } else if node.fault != NodeFault::NONE {
        Line { text: LineText::NODE_FAULT, code: node.fault.0 }
    } else if axis.state == AxisState::Aborting {
        of_state
    } else if let Some(line) = axis.fault.and_then(fault_line) {
        line
    } else if let Some(text) = startup {
        Line::plain(text)
    } else if node.alarm != NodeAlarm::NONE {
        Line { text: LineText::NODE_ALARM, code: node.alarm.0 }
    } else if let Some(line) =
        axis.inhibit.filter(|_| axis.state == AxisState::StartInhibited).and_then(alarm_line)
    {
        line
    } else if let Some(line) = axis.alarm.and_then(alarm_line) {
        line
    } else if silent {
        Line::default()
    } else {
        of_state
    }
}

fn state_line(state: AxisState) -> Line {
    Line::plain(match state {
        AxisState::Off => LineText::NONE,
        AxisState::SelfTest => LineText::SELF_TEST,
        AxisState::Initializing => LineText::CONFIGURING,
        AxisState::PreCharge => LineText::PRE_CHARGE,
        AxisState::Shutdown => LineText::SHUTDOWN,
        AxisState::StartInhibited => LineText::INHIBITED,
        AxisState::Stopped => LineText::STOPPED,
        AxisState::Starting => LineText::STARTING,
        AxisState::Running => LineText::RUNNING,
        AxisState::Testing => LineText::TESTING,
        AxisState::Stopping => LineText::STOPPING,
        AxisState::Aborting => LineText::ABORTING,
        // Reached only by an axis whose fault has no bit.
        AxisState::MajorFaulted => LineText::FAULT,
    })
}

fn fault_line((fault_type, code): (FaultType, u8)) -> Option<Line> {
    let text = match fault_type {
        FaultType::INITIALIZATION => LineText::INIT_FAULT,
        FaultType::INITIALIZATION_MFG => LineText::INIT_FAULT_MFG,
        FaultType::AXIS => LineText::FAULT,
        FaultType::AXIS_MFG => LineText::FAULT_MFG,
        FaultType::APR => LineText::APR_FAULT,
        FaultType::APR_MFG => LineText::APR_FAULT_MFG,
        FaultType::SAFETY => LineText::SAFETY_FAULT,
        FaultType::SAFETY_MFG => LineText::SAFETY_FAULT_MFG,
        _ => return None,
    };
    Some(Line { text, code })
}

fn alarm_line((alarm_type, code): (AlarmType, u8)) -> Option<Line> {
    let text = match alarm_type {
        AlarmType::START_INHIBIT => LineText::INHIBIT,
        AlarmType::START_INHIBIT_MFG => LineText::INHIBIT_MFG,
        AlarmType::AXIS => LineText::ALARM,
        AlarmType::AXIS_MFG => LineText::ALARM_MFG,
        _ => return None,
    };
    Some(Line { text, code })
}
