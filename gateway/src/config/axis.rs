//! The axes, their limits, and where their drives are.

use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};

use crate::mapping::{CaptureMode, FeedbackUse};

/// Whether an axis turns or slides, and with it the unit of its quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisKind {
    /// Revolutions.
    Rotary,
    /// Millimetres.
    Linear,
}

/// What an axis is (the state tables of the Motion Device Axis Object, clause 5-2.6.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisFunction {
    /// Controlled in motion.
    Drive,
    /// A feedback device, or the feedback of a drive that is never switched on.
    Encoder,
    /// A supply of the DC bus, without motion.
    Converter,
}

impl AxisFunction {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Drive, Self::Encoder, Self::Converter];

    /// The name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drive => "drive",
            Self::Encoder => "encoder",
            Self::Converter => "converter",
        }
    }
}

/// An axis: one instance of the Motion Device Axis Object in front, one drive behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Name, unique among axes.
    pub name: String,
    /// Instance number, unique in its device, from 1.
    pub instance: u8,
    /// Index in [`Config::devices`](super::Config::devices).
    pub device: usize,
    /// Its drive; no two axes share one.
    pub drive: DriveAt,
    /// What it is.
    pub function: AxisFunction,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// Whose encoder its position and velocity are of.
    pub feedback: FeedbackUse,
    /// Position counts of the controller for one axis unit.
    pub motion_resolution: u32,
    /// Position counts after which the axis is at its start again; `None` for an axis with ends.
    pub unwind_counts: Option<u32>,
    /// Motion Device Axis Object, attribute 725; 0 when the device's class attribute says it.
    pub power_structure_axis_id: u32,
    /// What the axis may do, beside what its drive allows.
    pub limits: Limits,
    /// Data of motor and power stage.
    pub nameplate: Nameplate,
    /// What happens when commands stay away.
    pub on_command_loss: StoppingAction,
    /// How the drive's captures of events are used.
    pub events: CaptureMode,
}

/// Data of motor and power stage that the drive does not show, in the units of the parameters and in the order of their numbers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Nameplate(pub Vec<(Parameter, i64)>);

impl Nameplate {
    /// What it says of a parameter, in the unit of the parameter.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> Option<i64> {
        self.0.iter().find(|(known, _)| *known == parameter).map(|(_, value)| *value)
    }
}

/// Limits of an axis that the box holds; `None` leaves them to the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits {
    /// Lowest position command.
    pub position_min: Option<Position>,
    /// Highest position command.
    pub position_max: Option<Position>,
    /// Highest speed, either direction.
    pub velocity: Option<Velocity>,
    /// Highest acceleration, either direction.
    pub acceleration: Option<Acceleration>,
    /// Highest torque or force, either direction.
    pub torque: Option<Torque>,
    /// Largest distance of actual from commanded position.
    pub following_error: Option<Position>,
}

/// How an axis stops (Motion Device Axis Object, attribute 610).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoppingAction {
    /// Torque off at once; the axis coasts (IEC 60204-1 category 0).
    DisableAndCoast,
    /// As fast as torque allows, then torque off (category 1).
    CurrentDecelAndDisable,
    /// On the ramp, then torque off (category 1).
    RampedDecelAndDisable,
    /// As fast as torque allows, then hold (category 2).
    CurrentDecelAndHold,
    /// On the ramp, then hold (category 2).
    RampedDecelAndHold,
}

impl StoppingAction {
    /// All of them, in the order of their codes.
    pub const ALL: [Self; 5] = [
        Self::DisableAndCoast,
        Self::CurrentDecelAndDisable,
        Self::RampedDecelAndDisable,
        Self::CurrentDecelAndHold,
        Self::RampedDecelAndHold,
    ];

    /// The code of the attribute.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::DisableAndCoast => 0,
            Self::CurrentDecelAndDisable => 1,
            Self::RampedDecelAndDisable => 2,
            Self::CurrentDecelAndHold => 3,
            Self::RampedDecelAndHold => 4,
        }
    }

    /// The name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DisableAndCoast => "disable-and-coast",
            Self::CurrentDecelAndDisable => "current-decel-and-disable",
            Self::RampedDecelAndDisable => "ramped-decel-and-disable",
            Self::CurrentDecelAndHold => "current-decel-and-hold",
            Self::RampedDecelAndHold => "ramped-decel-and-hold",
        }
    }
}

/// Where a drive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveAt {
    /// On the SERCOS III bus.
    Sercos {
        /// Index in [`Sercos::drives`](super::Sercos::drives).
        drive: usize,
    },
    /// On a CAN bus.
    Can {
        /// Index in [`Config::can`](super::Config::can).
        bus: usize,
        /// Index in [`Can::drives`](super::Can::drives).
        drive: usize,
    },
    /// On a DeviceNet network.
    Devicenet {
        /// Index in [`Config::devicenet`](super::Config::devicenet).
        network: usize,
        /// Index in [`Devicenet::drives`](super::Devicenet::drives).
        drive: usize,
    },
}
