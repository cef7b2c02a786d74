//! What the controller does once the axes are ready: a list of steps.
//!
//! Axes are named by their instance number, from 1. Positions, velocities and so on are in units of the
//! program, which are the velocity control units of the device: velocities and accelerations go out as they
//! stand here, positions in counts by
//! the [`Scaling`](super::config::Scaling) of the axis.

use core::fmt;

pub use super::axis_set::AxisSet;
use super::condition::Condition;
use super::config::AttributeSet;
use super::event::Instance;
use super::misbehaviour::Misbehaviour;
use super::sets::DataSets;
use super::trajectory::Limits;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{
    AxisControl, CommandTarget, ControlMode, EventChecking, FeedbackMode, MotionService, TestStatus,
    TimeDataSet,
};
use crate::wire::motion::event::ExtendedEventData;
use profile_generic::time::DurationNs;

/// Direction of a cyclic attribute list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CyclicDirection {
    /// Controller to device, Set_Cyclic_Write_List.
    Write,
    /// Device to controller, Set_Cyclic_Read_List.
    Read,
}

/// An attribute of a cyclic list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CyclicAttribute {
    /// Attribute ID.
    pub id: u16,
    /// Bytes of one element, by which the value is aligned.
    pub element_size: u8,
    /// The value in wire order; of a read list only its length counts.
    pub value: Vec<u8>,
}

/// A request beside the motion connection, as an unconnected message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExplicitMessage {
    /// Service code.
    pub service: u8,
    /// Class.
    pub class: u16,
    /// Instance.
    pub instance: u16,
    /// Attribute, for services that need one in the path.
    pub attribute: Option<u16>,
    /// Request data.
    pub data: Vec<u8>,
}

/// By how much a position reference changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Redefine {
    /// The position becomes this one, in units.
    To(f64),
    /// All positions change by this distance, in units.
    By(f64),
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
    /// Stop a test process and the motion that it makes.
    StopProcess(AxisSet),
    /// Give up the Axis Control request under way.
    Cancel(AxisSet),
    /// Make an Axis Control request and go on without waiting for its acknowledge.
    Ask {
        /// The axes that it applies to.
        axes: AxisSet,
        /// What Axis Control asks for.
        request: AxisControl,
    },
    /// Make an Axis Control request that the device has to refuse.
    Refused {
        /// The axes that it applies to.
        axes: AxisSet,
        /// What Axis Control asks for.
        request: AxisControl,
        /// The Response Status, if it matters.
        status: Option<u8>,
    },
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
    /// Take an axis in velocity or acceleration control to a velocity and leave it there.
    RunAt {
        /// Instance number.
        axis: u8,
        /// Velocity in units/s; its sign is the direction.
        velocity: f64,
        /// Acceleration limit in units/s².
        acceleration: f64,
        /// Jerk limit in units/s³.
        jerk: f64,
    },
    /// Take an axis in torque control to a torque and leave it there.
    Torque {
        /// Instance number.
        axis: u8,
        /// Torque in % of motor rated torque.
        torque: f64,
        /// How fast it changes, %/s.
        rate: f64,
        /// Velocity in units/s above which the step fails and the torque goes away.
        velocity_limit: f64,
    },
    /// Change the Control Mode on line. A motion under way is refused, an axis in torque control is brought to
    /// standstill by velocity control first.
    Mode {
        /// Instance number.
        axis: u8,
        /// The mode.
        mode: ControlMode,
    },
    /// Change the Feedback Mode.
    Feedback {
        /// Instance number.
        axis: u8,
        /// The mode.
        mode: FeedbackMode,
    },
    /// Change what travels in the updates of an axis.
    DataSets {
        /// Instance number.
        axis: u8,
        /// From now on.
        sets: DataSets,
    },
    /// Change the diagnostics asked for in the header.
    TimeData(TimeDataSet),
    /// Change the update that commands are meant for.
    Target(CommandTarget),
    /// Change the position reference of a standing axis: first of the actual, then of the command position,
    /// Table 5-2.109.
    RedefinePosition {
        /// Instance number.
        axis: u8,
        /// By how much.
        change: Redefine,
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
    /// Agree on a list of attributes that travel in every update, and use it from then on.
    CyclicList {
        /// Instance number.
        axis: u8,
        /// Which way.
        direction: CyclicDirection,
        /// The attributes; of a write list with the values to begin with.
        attributes: Vec<CyclicAttribute>,
    },
    /// Change values of the cyclic write data.
    CyclicWrite {
        /// Instance number.
        axis: u8,
        /// Attribute IDs and values in wire order.
        values: Vec<(u16, Vec<u8>)>,
    },
    /// Arm events, with the parameters that extended checking needs; ends when the device says that it checks for
    /// them.
    ArmEvents {
        /// Instance number.
        axis: u8,
        /// Events, windows and auto-rearm.
        checking: EventChecking,
        /// Windows, watch positions in counts, homing torque; boxed, since few steps have them.
        parameters: Option<Box<ExtendedEventData>>,
    },
    /// Disarm events; ends when the device no longer checks for them.
    DisarmEvents {
        /// Instance number.
        axis: u8,
        /// The events.
        checking: EventChecking,
    },
    /// Make any request in the service channel; the answer comes as an event.
    Service {
        /// Instance number; 0 is the class.
        axis: u8,
        /// The service.
        service: MotionService,
        /// Its body.
        data: Vec<u8>,
        /// General status that the answer has to have; `None` takes any.
        status: Option<u8>,
    },
    /// Ask for the result of a test again and again until the test is over.
    TestResult {
        /// Instance number.
        axis: u8,
        /// The service that gets the result.
        service: MotionService,
        /// What it has to be.
        status: TestStatus,
    },
    /// Make a request beside the motion connection; the answer comes as an event.
    Explicit {
        /// The request.
        message: ExplicitMessage,
        /// General status that the answer has to have; `None` takes any.
        status: Option<u8>,
    },
    /// Wait until something is so, and fail when it does not come to be.
    Expect {
        /// What.
        condition: Condition,
        /// For how long to wait.
        within: DurationNs,
    },
    /// Misbehave, and go on when the updates meant by it are over.
    Misbehave(Misbehaviour),
    /// Close the connection if it is still there, and open session and connection anew.
    Reconnect,
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
            Self::StopProcess(axes) => Some((*axes, AxisControl::STOP_PROCESS)),
            Self::Cancel(axes) => Some((*axes, AxisControl::CANCEL)),
            Self::Ask { axes, request } | Self::Refused { axes, request, .. } => Some((*axes, *request)),
            _ => None,
        }
    }

    /// Whether the step can do its work when the motion connection is lost.
    #[must_use]
    pub const fn works_without_connection(&self) -> bool {
        matches!(
            self,
            Self::Dwell { .. }
                | Self::Expect {
                    condition: Condition::ConnectionLost
                        | Condition::NoFault
                        | Condition::NodeFault(_)
                        | Condition::NodeAlarm(_)
                        | Condition::Fault { .. }
                        | Condition::Alarm { .. },
                    ..
                }
                | Self::Misbehave(_)
                | Self::Reconnect
                | Self::Together(_)
                | Self::Sequence(_)
                | Self::Within { .. }
        )
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
            | Self::RunAt { axis, .. }
            | Self::Torque { axis, .. }
            | Self::Mode { axis, .. }
            | Self::Feedback { axis, .. }
            | Self::DataSets { axis, .. }
            | Self::RedefinePosition { axis, .. }
            | Self::CyclicList { axis, .. }
            | Self::CyclicWrite { axis, .. }
            | Self::ArmEvents { axis, .. }
            | Self::DisarmEvents { axis, .. }
            | Self::TestResult { axis, .. }
            | Self::WaitInWindow { axis, .. } => beyond(*axis, 1),
            Self::ReadAttributes { axis, .. }
            | Self::SetAttributes { axis, .. }
            | Self::Service { axis, .. } => beyond(*axis, 0),
            Self::Expect { condition, .. } => {
                let first = u8::from(!matches!(condition, Condition::Attribute { .. }));
                condition.axis().and_then(|axis| beyond(axis, first))
            }
            Self::Together(steps) | Self::Sequence(steps) => steps.iter().find_map(|s| s.unknown_axis(count)),
            Self::Within { step, .. } => step.unknown_axis(count),
            Self::Misbehave(
                Misbehaviour::OmitSetPoint { axes, .. } | Misbehaviour::WrongMode { axes, .. },
            ) => axes.iter().find_map(|axis| beyond(axis, 1)),
            _ => self.request().and_then(|(axes, _)| axes.iter().find_map(|axis| beyond(axis, 1))),
        }
    }
}

impl fmt::Display for Step {
    // Flat: one arm per step.
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
            Self::RunAt { axis, velocity, .. } => write!(f, "Run axis {axis} at {velocity}/s"),
            Self::Torque { axis, torque, .. } => write!(f, "Torque of axis {axis} to {torque} %"),
            Self::Mode { axis, mode } => write!(f, "{mode} of axis {axis}"),
            Self::Feedback { axis, mode } => write!(f, "{mode} of axis {axis}"),
            Self::DataSets { axis, .. } => write!(f, "Data sets of axis {axis}"),
            Self::TimeData(set) => write!(f, "Time data: {set}"),
            Self::Target(target) => write!(f, "Command target: {target}"),
            Self::RedefinePosition { axis, change: Redefine::To(position) } => {
                write!(f, "Redefine position of axis {axis} to {position}")
            }
            Self::RedefinePosition { axis, change: Redefine::By(distance) } => {
                write!(f, "Redefine position of axis {axis} by {distance}")
            }
            Self::CyclicList { axis, direction, attributes } => {
                let name = if *direction == CyclicDirection::Write { "write" } else { "read" };
                write!(f, "Cyclic {name} list of {} attributes for axis {axis}", attributes.len())
            }
            Self::CyclicWrite { axis, values } => {
                write!(f, "Write {} attributes of axis {axis} cyclically", values.len())
            }
            Self::ArmEvents { axis, checking, .. } => write!(f, "Arm events of axis {axis}: {checking}"),
            Self::DisarmEvents { axis, checking } => write!(f, "Disarm events of axis {axis}: {checking}"),
            Self::Service { axis, service, .. } => write!(f, "{service} to {}", Instance(*axis)),
            Self::TestResult { axis, service, status } => {
                write!(f, "{service} of axis {axis}: expect {status}")
            }
            Self::Explicit { message, .. } => write!(
                f,
                "Explicit service {:#04x} to class {:#x} instance {}",
                message.service, message.class, message.instance
            ),
            Self::Expect { condition, within } => write!(f, "Expect {condition} within {within}"),
            Self::Misbehave(kind) => write!(f, "Misbehave: {kind}"),
            Self::Reconnect => f.write_str("Reconnect"),
            Self::Ask { axes, request } => write!(f, "{request} {axes} without waiting"),
            Self::Refused { axes, request, .. } => write!(f, "{request} {axes}, to be refused"),
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
