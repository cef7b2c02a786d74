//! What the indicators of the device show (Volume 9 clause 9-1.1, IEC 61800-7-202 clause 7.6.5): Module Status, Network
//! Status and Axis Status LED here, the alphanumeric display in [`display`].
//!
//! Everything is a pure function of states and conditions; who has lamps lights them, and a box without lamps reports what
//! they would show.
//!
//! Table 9-1.2; 1 and 2 are its footnotes, in [`axis_status`]:
//!
//! ```text
//! Identity Object            Module Status     axis state           bus      Axis Status
//! Power Off                  off               Off                           off
//! Self-Testing               flash red/green   Self Test                     flash red/green
//! Standby                    flashing green    Initializing         down     off
//!                                              Initializing         up       flashing green
//!                                              Shutdown             down     off
//!                                              Shutdown             up       flashing amber 1
//!                                              Pre-Charge           down     off
//!                                              Start Inhibited               flashing amber 1
//! Operational                solid green       Stopped                       flashing green 1 2
//!                                              Stopping                      solid green 1 2
//!                                              Starting                      solid green 1 2
//!                                              Running                       solid green 1 2
//!                                              Testing                       solid green 1 2
//! Major Recoverable Fault    flashing red      Aborting                      flashing red
//!                                              Major Faulted                 flashing red
//! Major Unrecoverable Fault  solid red         Aborting                      solid red
//!                                              Major Faulted                 solid red
//! ```

pub mod display;

use profile_generic::open_code;

use crate::device::axis::state::{AxisState, ControlKind};
use crate::device::objects::identity::ModuleState;
use crate::wire::motion::codes::{AlarmType, FaultType};

open_code! {
    /// What a lamp of two colours shows; amber is red and green at once. Never changed, only added to: programs outside
    /// read the numbers.
    pub struct Indication(u8) {
        /// Dark.
        OFF = 0 => "off",
        /// Green and dark in turn.
        FLASHING_GREEN = 1 => "flashing green",
        /// Green.
        SOLID_GREEN = 2 => "solid green",
        /// Amber and dark in turn.
        FLASHING_AMBER = 3 => "flashing amber",
        /// Red and dark in turn.
        FLASHING_RED = 4 => "flashing red",
        /// Red.
        SOLID_RED = 5 => "solid red",
        /// The self test: red and green in turn.
        FLASHING_RED_GREEN = 6 => "flashing red/green",
        /// A minor fault where it would be solid green.
        RED_GREEN = 7 => "red-green",
        /// A minor fault where it would flash green.
        RED_OFF_GREEN_OFF = 8 => "red-off-green-off",
        /// A minor fault where it would flash amber.
        RED_OFF_AMBER_OFF = 9 => "red-off-amber-off",
        /// An alarm where it would be solid green.
        AMBER_GREEN = 10 => "amber-green",
        /// An alarm where it would flash green.
        AMBER_OFF_GREEN_OFF = 11 => "amber-off-green-off",
    }
}

/// How an axis is, as far as it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisCondition {
    /// What it controls.
    pub kind: ControlKind,
    /// Its state.
    pub state: AxisState,
    /// The DC bus is up.
    pub bus_up: bool,
    /// The fault to tell of: its type and its bit number in the table of that type.
    pub fault: Option<(FaultType, u8)>,
    /// A latched fault goes only with a restart of the device.
    pub unrecoverable: bool,
    /// A minor fault is latched.
    pub minor_fault: bool,
    /// The axis alarm to tell of: its type and bit number.
    pub alarm: Option<(AlarmType, u8)>,
    /// The start inhibit to tell of: its type and bit number.
    pub inhibit: Option<(AlarmType, u8)>,
}

impl AxisCondition {
    /// An axis in this state with nothing wrong.
    #[must_use]
    pub const fn new(kind: ControlKind, state: AxisState, bus_up: bool) -> Self {
        Self {
            kind,
            state,
            bus_up,
            fault: None,
            unrecoverable: false,
            minor_fault: false,
            alarm: None,
            inhibit: None,
        }
    }

    fn module_state(&self) -> ModuleState {
        match self.state {
            AxisState::SelfTest => ModuleState::SelfTesting,
            state => ModuleState::of_axis(state.code(), self.unrecoverable),
        }
    }
}

/// State of a device with these axes: the weightiest counts. An axis that controls nothing counts only with a fault,
/// and then as a recoverable one, unless the device has no other axes (clause 9-1.1.1.6).
pub fn module_state<'a>(axes: impl Iterator<Item = &'a AxisCondition> + Clone) -> ModuleState {
    let counted = axes.clone().filter_map(|axis| match (axis.kind, axis.module_state()) {
        (
            ControlKind::FeedbackOnly,
            ModuleState::MajorRecoverableFault | ModuleState::MajorUnrecoverableFault,
        ) => Some(ModuleState::MajorRecoverableFault),
        (ControlKind::FeedbackOnly, _) => None,
        (_, state) => Some(state),
    });
    match counted.max() {
        Some(state) => state,
        None => ModuleState::of_axes(axes.map(AxisCondition::module_state)),
    }
}

/// The Module Status LED, Table 9-1.2. A device without power shows nothing, and asks nobody.
#[must_use]
pub const fn module_status(state: ModuleState) -> Indication {
    match state {
        ModuleState::SelfTesting => Indication::FLASHING_RED_GREEN,
        ModuleState::Standby => Indication::FLASHING_GREEN,
        ModuleState::Operational => Indication::SOLID_GREEN,
        ModuleState::MajorRecoverableFault => Indication::FLASHING_RED,
        ModuleState::MajorUnrecoverableFault => Indication::SOLID_RED,
    }
}

/// The Axis Status LED, Table 9-1.2 with its footnotes.
///
/// 1. A minor fault: solid green turns to red-green, flashing green to red-off-green-off, flashing amber to
///    red-off-amber-off.
/// 2. An alarm: solid green turns to amber-green, flashing green to amber-off-green-off.
///
/// With both the fault is shown, which is the worse. An axis in Initializing has neither footnote. A bus that comes up in
/// Pre-Charge takes the axis out of it, so the bus does not count there.
#[must_use]
// Flat: the table of the display, one arm per row.
pub fn axis_status(axis: &AxisCondition) -> Indication {
    let (plain, minor_faults, alarms) = match (axis.state, axis.bus_up) {
        (AxisState::Off | AxisState::PreCharge, _)
        | (AxisState::Initializing | AxisState::Shutdown, false) => (Indication::OFF, false, false),
        (AxisState::SelfTest, _) => (Indication::FLASHING_RED_GREEN, false, false),
        (AxisState::Initializing, true) => (Indication::FLASHING_GREEN, false, false),
        (AxisState::Shutdown, true) | (AxisState::StartInhibited, _) => {
            (Indication::FLASHING_AMBER, true, false)
        }
        (AxisState::Stopped, _) => (Indication::FLASHING_GREEN, true, true),
        (AxisState::Stopping | AxisState::Starting | AxisState::Running | AxisState::Testing, _) => {
            (Indication::SOLID_GREEN, true, true)
        }
        (AxisState::Aborting | AxisState::MajorFaulted, _) if axis.unrecoverable => {
            (Indication::SOLID_RED, false, false)
        }
        (AxisState::Aborting | AxisState::MajorFaulted, _) => (Indication::FLASHING_RED, false, false),
    };
    let minor_fault = axis.minor_fault && minor_faults;
    let alarm = axis.alarm.is_some() && alarms;
    match plain {
        Indication::SOLID_GREEN if minor_fault => Indication::RED_GREEN,
        Indication::FLASHING_GREEN if minor_fault => Indication::RED_OFF_GREEN_OFF,
        Indication::FLASHING_AMBER if minor_fault => Indication::RED_OFF_AMBER_OFF,
        Indication::SOLID_GREEN if alarm => Indication::AMBER_GREEN,
        Indication::FLASHING_GREEN if alarm => Indication::AMBER_OFF_GREEN_OFF,
        plain => plain,
    }
}

/// How the device is on its network, as far as it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NetworkCondition {
    /// The device tests itself.
    pub self_test: bool,
    /// It has an IP address.
    pub address: bool,
    /// Another station has the same one.
    pub duplicate: bool,
    /// A connection is open, of any transport class.
    pub connected: bool,
    /// The motion connection has timed out, and nobody has opened it since.
    pub timed_out: bool,
}

impl NetworkCondition {
    /// That of a device without a self test, which has the address that it listens at and looks for no other station with it.
    pub const fn listening(connected: bool, timed_out: bool) -> Self {
        Self { self_test: false, address: true, duplicate: false, connected, timed_out }
    }
}

/// The Network Status LED of a device on EtherNet/IP. Volume 9 leaves it to the network, whose Volume 2 is not among
/// our documents: this is what makers of EtherNet/IP devices print in their manuals, all alike.
///
/// ```text
/// self test                              flashing red/green
/// no IP address                          off
/// address of another station             solid red
/// an exclusive owner has timed out       flashing red
/// at least one connection                solid green
/// no connection                          flashing green
/// ```
#[must_use]
pub const fn network_status(network: &NetworkCondition) -> Indication {
    match network {
        NetworkCondition { self_test: true, .. } => Indication::FLASHING_RED_GREEN,
        NetworkCondition { address: false, .. } => Indication::OFF,
        NetworkCondition { duplicate: true, .. } => Indication::SOLID_RED,
        NetworkCondition { timed_out: true, .. } => Indication::FLASHING_RED,
        NetworkCondition { connected: true, .. } => Indication::SOLID_GREEN,
        NetworkCondition { .. } => Indication::FLASHING_GREEN,
    }
}

#[cfg(test)]
mod tests;
