//! What the controller does once the axes are ready: a list of steps.
//!
//! Axes are named by their instance number, from 1. Positions, velocities and so on are in units of the
//! program, which are the velocity control units of the device: velocities and accelerations go out as they
//! stand here, positions in counts by
//! [`AxisSetup::counts_per_unit`](super::config::AxisSetup::counts_per_unit).

use core::fmt;

use super::config::{AttributeSet, MAX_AXES};
use super::trajectory::Limits;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::AxisControl;
use profile_generic::time::DurationNs;

const _: () = assert!(MAX_AXES == 16, "an axis set has one bit for each axis");

/// A set of axes, by instance number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AxisSet(u16);

impl AxisSet {
    /// No axis.
    pub const NONE: Self = Self(0);

    /// One axis; instances beyond the largest number of axes make an empty set.
    #[must_use]
    pub const fn one(instance: u8) -> Self {
        if instance == 0 || instance > 16 { Self::NONE } else { Self(1 << (instance - 1)) }
    }

    /// The axes 1 to `count`.
    #[must_use]
    pub fn first(count: u8) -> Self {
        (1..=count).fold(Self::NONE, |set, axis| set.with(axis))
    }

    /// This set and one axis more.
    #[must_use]
    pub const fn with(self, instance: u8) -> Self {
        Self(self.0 | Self::one(instance).0)
    }

    /// This set without that axis.
    #[must_use]
    pub const fn without(self, instance: u8) -> Self {
        Self(self.0 & !Self::one(instance).0)
    }

    /// Whether the axis is in the set.
    #[must_use]
    pub const fn contains(self, instance: u8) -> bool {
        self.0 & Self::one(instance).0 != 0
    }

    /// Whether no axis is in the set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The instance numbers in ascending order.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=16).filter(move |instance| self.contains(*instance))
    }
}

impl fmt::Display for AxisSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.iter().count() == 1 { "axis" } else { "axes" })?;
        self.iter().try_for_each(|axis| write!(f, " {axis}"))
    }
}

/// One step of a program. It has finished when what it says has happened, and it fails when that cannot
/// happen or takes too long.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Close the loops; ends with every axis Running. The command stands at the actual position.
    Enable(AxisSet),
    /// Stop by the device's Stopping Action and open the loops.
    Disable(AxisSet),
    /// Stop by the device's Shutdown Action; the axes end in Shutdown.
    Shutdown(AxisSet),
    /// Leave Shutdown and reset faults.
    ShutdownReset(AxisSet),
    /// Raise the Controller Initiated Exception.
    Abort(AxisSet),
    /// Reset axis faults.
    FaultReset(AxisSet),
    /// Reset the fault of the communications node.
    NodeFaultReset,
    /// Move from rest to a position and wait until the command has arrived.
    MoveAbsolute {
        /// Instance number.
        axis: u8,
        /// End position in units.
        position: f64,
        /// Limits in units.
        limits: Limits,
    },
    /// Move from rest by a distance and wait until the command has arrived.
    MoveRelative {
        /// Instance number.
        axis: u8,
        /// Distance in units; its sign is the direction.
        distance: f64,
        /// Limits in units.
        limits: Limits,
    },
    /// Change over to velocity control, turn for a time, slow down, and change back at standstill.
    Jog {
        /// Instance number.
        axis: u8,
        /// Velocity in units/s; its sign is the direction.
        velocity: f64,
        /// Acceleration limit in units/s².
        acceleration: f64,
        /// Jerk limit in units/s³.
        jerk: f64,
        /// Seconds from the start of the jog to the start of slowing down.
        seconds: f64,
    },
    /// End the motion under way on an axis, in a controlled manner; the axis stays Running. The step that
    /// began the motion ends with it.
    Stop {
        /// Instance number.
        axis: u8,
        /// Acceleration limit in units/s².
        acceleration: f64,
        /// Jerk limit in units/s³.
        jerk: f64,
    },
    /// Wait.
    Dwell {
        /// How long.
        seconds: f64,
    },
    /// Wait until the actual position stays within `window` of the command.
    WaitInWindow {
        /// Instance number.
        axis: u8,
        /// Units on either side.
        window: f64,
        /// How long to wait in seconds before the step fails.
        seconds: f64,
    },
    /// Read attributes by Get_Axis_Attributes_List; the values come as events.
    ReadAttributes {
        /// Instance number; 0 is the class.
        axis: u8,
        /// What to read.
        attributes: Vec<AttributeSelector>,
    },
    /// Write attributes by Set_Axis_Attributes_List.
    SetAttributes {
        /// Instance number; 0 is the class.
        axis: u8,
        /// What to write.
        attributes: Vec<AttributeSet>,
    },
    /// All of these at once; ends when the last one does.
    Together(Vec<Step>),
    /// One after the other; of use inside of [`Step::Together`].
    Sequence(Vec<Step>),
    /// A step with a time-out of its own instead of the usual one.
    Within {
        /// How long it may take.
        time_out: DurationNs,
        /// The step.
        step: Box<Step>,
    },
}

impl Step {
    /// The Axis Control request that the step makes, and of which axes.
    #[must_use]
    pub const fn request(&self) -> Option<(AxisSet, AxisControl)> {
        match self {
            Self::Enable(axes) => Some((*axes, AxisControl::ENABLE)),
            Self::Disable(axes) => Some((*axes, AxisControl::DISABLE)),
            Self::Shutdown(axes) => Some((*axes, AxisControl::SHUTDOWN)),
            Self::ShutdownReset(axes) => Some((*axes, AxisControl::SHUTDOWN_RESET)),
            Self::Abort(axes) => Some((*axes, AxisControl::ABORT)),
            Self::FaultReset(axes) => Some((*axes, AxisControl::FAULT_RESET)),
            _ => None,
        }
    }

    /// The first axis in the step that the device of `count` axes does not have.
    #[must_use]
    pub fn unknown_axis(&self, count: u8) -> Option<u8> {
        let beyond = |axis: u8, first: u8| (axis < first || axis > count).then_some(axis);
        match self {
            Self::MoveAbsolute { axis, .. }
            | Self::MoveRelative { axis, .. }
            | Self::Jog { axis, .. }
            | Self::Stop { axis, .. }
            | Self::WaitInWindow { axis, .. } => beyond(*axis, 1),
            Self::ReadAttributes { axis, .. } | Self::SetAttributes { axis, .. } => beyond(*axis, 0),
            Self::Together(steps) | Self::Sequence(steps) => steps.iter().find_map(|s| s.unknown_axis(count)),
            Self::Within { step, .. } => step.unknown_axis(count),
            Self::Dwell { .. } | Self::NodeFaultReset => None,
            _ => self.request().and_then(|(axes, _)| axes.iter().find_map(|axis| beyond(axis, 1))),
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |f: &mut fmt::Formatter<'_>, name: &str, steps: &[Step]| {
            write!(f, "{name}")?;
            steps.iter().enumerate().try_for_each(|(n, s)| {
                let separator = if n == 0 { ": " } else { "; " };
                write!(f, "{separator}{s}")
            })
        };
        match self {
            Self::NodeFaultReset => f.write_str("Node Fault Reset"),
            Self::MoveAbsolute { axis, position, .. } => write!(f, "Move axis {axis} to {position}"),
            Self::MoveRelative { axis, distance, .. } => write!(f, "Move axis {axis} by {distance}"),
            Self::Jog { axis, velocity, seconds, .. } => {
                write!(f, "Jog axis {axis} at {velocity}/s for {seconds} s")
            }
            Self::Stop { axis, .. } => write!(f, "Stop axis {axis}"),
            Self::Dwell { seconds } => write!(f, "Dwell {seconds} s"),
            Self::WaitInWindow { axis, window, .. } => write!(f, "Wait for axis {axis} within {window}"),
            Self::ReadAttributes { axis, attributes } => {
                write!(f, "Read {} attributes of instance {axis}", attributes.len())
            }
            Self::SetAttributes { axis, attributes } => {
                write!(f, "Set {} attributes of instance {axis}", attributes.len())
            }
            Self::Together(steps) => list(f, "Together", steps),
            Self::Sequence(steps) => list(f, "In sequence", steps),
            Self::Within { step, .. } => step.fmt(f),
            _ => match self.request() {
                Some((axes, code)) => write!(f, "{code} {axes}"),
                None => Ok(()),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_axes_by_instance_number() {
        let set = AxisSet::one(3).with(1).with(16);
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 3, 16]);
        assert_eq!(set.without(3).to_string(), "axes 1 16");
        assert_eq!(AxisSet::first(2), AxisSet::one(1).with(2));
        assert_eq!((AxisSet::one(0), AxisSet::one(17)), (AxisSet::NONE, AxisSet::NONE));
        assert!(!set.contains(0) && !set.contains(2) && set.contains(16));
        assert_eq!(AxisSet::first(255).iter().count(), MAX_AXES);
    }

    #[test]
    fn axes_that_the_device_lacks_are_found_at_any_depth() {
        let limits = Limits { velocity: 1.0, acceleration: 1.0, jerk: 1.0 };
        let inner = Step::MoveAbsolute { axis: 3, position: 0.0, limits };
        let step = Step::Together(vec![
            Step::Enable(AxisSet::first(2)),
            Step::Within { time_out: DurationNs::from_secs(1), step: Box::new(inner) },
        ]);
        assert_eq!(step.unknown_axis(2), Some(3));
        assert_eq!(step.unknown_axis(3), None);
        assert_eq!(Step::Enable(AxisSet::one(4)).unknown_axis(3), Some(4));
        assert_eq!(Step::ReadAttributes { axis: 0, attributes: vec![] }.unknown_axis(1), None);
        assert_eq!(Step::Stop { axis: 0, acceleration: 1.0, jerk: 1.0 }.unknown_axis(1), Some(0));
        assert_eq!(step.to_string(), "Together: Enable axes 1 2; Move axis 3 to 0");
    }
}
