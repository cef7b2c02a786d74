//! What passes between the motion device and the application that runs the drive of an axis.
//!
//! The law: an axis never moves on a stale, late, malformed or half-understood command. These types are made so that
//! breaking it takes effort:
//!
//! - set-points are inside [`Command::Follow`] and exist only while the axis is Running, the connection is alive, the
//!   controller is in remote control, the last update was proven timely and complete, and no fault is active. In every
//!   other case there is a [`Withheld`] reason and no number.
//! - what the drive has to do is a level, [`DriveAction`], that is true at any time and survives missed cycles. It
//!   rises to [`DriveAction::Enable`] only by a new request of the controller.
//! - the drive's answers name the action they belong to ([`DriveImage::action_id`]): "stopped" from before an enable
//!   never ends the stop after it.

use crate::wire::motion::CommandValues;
use crate::wire::motion::actual::SafetyStatus;
use crate::wire::motion::codes::{
    AxisIoStatus, AxisStatus, CommandTarget, ControlMode, EventChecking, FeedbackMode,
};
use crate::wire::motion::test_service::HookupTestData;

pub use super::exception::{DriveCondition, DriveConditions, ExceptionAction};
use super::state::AxisState;
use profile_generic::time::MonotonicTime;

/// What the drive has to do now, and to keep doing until it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DriveAction {
    /// Nothing: no configured connection. The power structure stays off.
    #[default]
    None,
    /// Be ready: let the bus charge; the power structure makes no torque.
    PowerUp,
    /// Energize and follow the command.
    Enable,
    /// Energize and run the test of [`AxisCommandImage::test`]; there is no command.
    Test,
    /// Stop by the configured Stopping Action, then stay stopped.
    Disable,
    /// Stop by the configured Shutdown Action and stay torque-free.
    Shutdown,
    /// Stop by the fault's stopping action and stay stopped.
    Abort,
}

/// Why there is no set-point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Withheld {
    /// No connection is open: the controller has closed it, or has not opened one. The axis stops as for a Disable.
    NotConnected,
    /// The connection was lost, and none was opened since.
    ConnectionLost,
    /// The axis is not Running.
    NotRunning,
    /// No update came for longer than the update delay high limit.
    Stale,
    /// The controller has not taken remote control.
    LocalControl,
    /// A node fault is active.
    NodeFault,
    /// No update with the set-point of the Control Mode has come since the axis runs.
    NoSetPoint,
}

/// The most trims of an update: Position, Velocity, Acceleration and Torque Trim.
pub const TRIMS_MAX: usize = 4;

/// What the cyclic write data of an update add to its set-points, by attribute and in the unit of the attribute. What is
/// not there is zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trims([Option<(u16, f64)>; TRIMS_MAX]);

impl Trims {
    /// Sets the trim with this attribute number; `false` when there is no room for one more.
    pub fn set(&mut self, attribute: u16, value: f64) -> bool {
        let place = self.0.iter_mut().find(|place| place.is_none_or(|(known, _)| known == attribute));
        place.map(|place| *place = Some((attribute, value))).is_some()
    }

    /// Attribute numbers and values.
    pub fn iter(&self) -> impl Iterator<Item = (u16, f64)> + '_ {
        self.0.iter().copied().flatten()
    }
}

/// Set-points of the newest good update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPoints {
    /// Control Mode of the values.
    pub control_mode: ControlMode,
    /// Feedback Mode of the values.
    pub feedback_mode: FeedbackMode,
    /// The values as they came; the one that `control_mode` needs is present.
    pub values: CommandValues,
    /// What the same update adds to them.
    pub trims: Trims,
    /// Whether the set-points are to be applied at once, extrapolated or interpolated.
    pub target: CommandTarget,
    /// Controller Time Stamp in this device's system time, ns; `None` in asynchronous operation.
    pub time_stamp: Option<u64>,
    /// Command Target Time in this device's system time, ns; `None` in asynchronous operation.
    pub target_time: Option<u64>,
    /// When the update would have arrived on an even network: the controller's update clock as its arrivals show it. Set-points
    /// without a target time are placed by it.
    pub paced_at: MonotonicTime,
    /// Subtract from a position command to get back to the reference system of power-up, position control units
    /// (Change Command Position Reference, clause 5-2.6.1.2).
    pub position_reference: i64,
    /// Changes with every update that brought values; equal numbers are the same set-points.
    pub sequence: u32,
    /// Updates missed since these values came; 0 is the newest that could be.
    pub age_updates: u32,
}

/// Set-points, or why there are none.
#[expect(clippy::large_enum_variant, reason = "made in every cycle, in which nothing may be allocated")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Follow these.
    Follow(SetPoints),
    /// Follow nothing; the action says what to do.
    Withheld(Withheld),
}

/// A hookup test, clause 5-2.5.1.9. The marker and the commutation test are not among them: nothing that runs a drive
/// here shows a marker or the phasing of its motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HookupTest {
    /// Moves the motor in its forward direction and watches Feedback 1.
    MotorFeedback,
    /// Watches Feedback 1 while somebody else moves the axis.
    Feedback,
}

impl HookupTest {
    /// The test with this code of Table 5-2.94.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::MotorFeedback),
            1 => Some(Self::Feedback),
            _ => None,
        }
    }

    /// Whether the test energizes the axis.
    #[must_use]
    pub const fn is_active(self) -> bool {
        matches!(self, Self::MotorFeedback)
    }
}

/// A test that the drive has to run. It ends with a [`TestReport`], or when the order is taken back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestOrder {
    /// Names the test; to be returned in [`TestReport::id`].
    pub id: u32,
    /// The motor with torque, or the feedback alone.
    pub test: HookupTest,
    /// Distance that has to be gone in either direction: revolutions, or metres of a linear axis. 0 when `time` counts.
    pub distance: f32,
    /// How long the motor has to be moved, s. 0 when `distance` counts.
    pub time: f32,
}

/// The end of a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestReport {
    /// [`TestOrder::id`].
    pub id: u32,
    /// The result, never "test in progress".
    pub data: HookupTestData,
}

/// Everything the drive of an axis needs from the motion device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisCommandImage {
    /// State of the axis.
    pub state: AxisState,
    /// What to do.
    pub action: DriveAction,
    /// Changes whenever the action changes; to be returned in [`DriveImage::action_id`].
    pub action_id: u32,
    /// Changes whenever the drive has to reset its faults, for the controller or because a connection begins or ends; to
    /// be returned in [`DriveImage::reset_id`] once it has tried, with success or not. A reset moves nothing.
    pub reset_id: u32,
    /// With [`DriveAction::Abort`]: the stop that the device itself orders; it may become more severe while the axis stops.
    /// `None` where the conditions of the drive are the reason: the application that runs the drive stops it for those without an order.
    pub abort: Option<AbortOrder>,
    /// Set-points.
    pub command: Command,
    /// The test to run or, without torque, to watch for.
    pub test: Option<TestOrder>,
}

/// A stop for a fault that the motion device has found itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AbortOrder {
    /// Axis Fault Action, attribute 668: the worst of those that the device has found.
    pub action: u8,
    /// What it has found first.
    pub cause: AbortCause,
}

/// What the motion device orders a stop for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AbortCause {
    /// An Abort request of the controller.
    Controller,
    /// Modes that the axis cannot go on with, or an update without their set-point.
    IllegalMode,
    /// The drive went offline while energized, and nothing says why.
    DriveLost,
    /// The connection is lost, or the node has a fault.
    Node,
}

/// What the drive of an axis reports each cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveImage {
    /// The drive answers and is ready to be used. Losing it while energized is a major fault.
    pub online: bool,
    /// [`AxisCommandImage::action_id`] that `start_complete` and `stop_complete` speak of.
    pub action_id: u32,
    /// The last [`AxisCommandImage::reset_id`] that was carried out.
    pub reset_id: u32,
    /// The Control Modes that the drive has, by their numbers; `None` while nobody knows. What it lacks is refused as if
    /// the axis did not have it.
    pub control_modes: Option<u16>,
    /// The DC bus is up.
    pub bus_up: bool,
    /// The start asked for by `action_id` has ended: the drive follows set-points.
    pub start_complete: bool,
    /// The stop asked for by `action_id` has ended: the axis stands, or its time limit has run out. It counts also when
    /// the drive is not online.
    pub stop_complete: bool,
    /// The power structure is energized.
    pub power_enabled: bool,
    /// The drive tracks the command.
    pub tracking: bool,
    /// The test that has ended last.
    pub test: Option<TestReport>,
    /// Conditions that are there; what follows from them is for the controller to say.
    pub conditions: DriveConditions,
    /// Start Inhibits, attribute 676.
    pub start_inhibits: u16,
    /// Start Inhibits - Mfg, attribute 677.
    pub start_inhibits_mfg: u16,
    /// Actual position in the reference system of power-up, position control units, never unwound. While the drive is not
    /// online, the last one it has reported.
    pub position: i64,
    /// Actual velocity in position control units per second, by which `position` is taken from the instant of its capture to
    /// that of the update. 0 when the drive does not report a velocity.
    pub position_rate: i64,
    /// Cyclic Unwind Position in use, position control units: after so many counts a cyclic axis is where it was. `None`
    /// for an axis that is not cyclic, or whose controller unwinds it (Control Scaling).
    pub unwind: Option<u32>,
    /// Changes when a position control unit becomes something else; changes of the position reference are then forgotten.
    pub scaling_id: u32,
    /// Actual velocity, velocity control units; `None` when the drive does not report it.
    pub velocity: Option<f32>,
    /// Actual acceleration, acceleration control units; `None` when the drive does not report it.
    pub acceleration: Option<f32>,
    /// Bits of Axis Status that only the drive knows; those that the state machine owns are replaced. DC Bus Up counts while the axis is
    /// faulted or shut down.
    pub axis_status: AxisStatus,
    /// Axis Status - Mfg: bits of the vendor.
    pub axis_status_mfg: u32,
    /// Axis I/O Status.
    pub io_status: AxisIoStatus,
    /// Axis I/O Status - Mfg.
    pub io_status_mfg: u32,
    /// Safety status of a drive with a safety core.
    pub safety: Option<SafetyStatus>,
    /// System time at which the actual values were captured, ns; 0 if it is not known.
    pub captured_at: u64,
    /// Actual torque, % of the rated one, of a drive that reports it.
    pub torque: Option<f32>,
    /// Events that can be checked for on this axis, and for registration edges the window checks: those that the drive
    /// looks for, and of [`EventChecking::WATCHES`] and [`EventChecking::HOME_TORQUE`], which the device evaluates itself
    /// from position and torque, those that it may.
    pub events: EventChecking,
    /// Events that the drive is looking for at this moment.
    pub events_checking: EventChecking,
}

impl DriveImage {
    /// Makes it as by [`Default`], without a copy of all the conditions that there can be.
    pub fn clear(&mut self) {
        // Every field is named, so that none can be forgotten.
        let Self {
            online,
            action_id,
            reset_id,
            control_modes,
            bus_up,
            start_complete,
            stop_complete,
            power_enabled,
            tracking,
            test,
            conditions,
            start_inhibits,
            start_inhibits_mfg,
            position,
            position_rate,
            unwind,
            scaling_id,
            velocity,
            acceleration,
            axis_status,
            axis_status_mfg,
            io_status,
            io_status_mfg,
            safety,
            captured_at,
            torque,
            events,
            events_checking,
        } = self;
        (*online, *bus_up, *start_complete, *stop_complete) = (false, false, false, false);
        (*power_enabled, *tracking) = (false, false);
        (*action_id, *reset_id, *scaling_id) = (0, 0, 0);
        (*test, *control_modes) = (None, None);
        conditions.clear();
        (*start_inhibits, *start_inhibits_mfg) = (0, 0);
        (*position, *position_rate, *unwind) = (0, 0, None);
        (*velocity, *acceleration, *torque) = (None, None, None);
        (*axis_status, *axis_status_mfg) = (AxisStatus::empty(), 0);
        (*io_status, *io_status_mfg) = (AxisIoStatus::empty(), 0);
        *safety = None;
        *captured_at = 0;
        (*events, *events_checking) = (EventChecking::empty(), EventChecking::empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_image_is_one_of_which_nothing_is_known() {
        let mut image = DriveImage {
            online: true,
            action_id: 1,
            reset_id: 2,
            control_modes: Some(0b10),
            bus_up: true,
            start_complete: true,
            stop_complete: true,
            power_enabled: true,
            tracking: true,
            test: Some(TestReport { id: 3, data: HookupTestData::default() }),
            conditions: DriveConditions::of(&[DriveCondition { code: 4, ..DriveCondition::default() }]),
            start_inhibits: 5,
            start_inhibits_mfg: 6,
            position: 7,
            position_rate: 77,
            unwind: Some(8),
            scaling_id: 9,
            velocity: Some(10.0),
            acceleration: Some(11.0),
            axis_status: AxisStatus::all(),
            axis_status_mfg: 12,
            io_status: AxisIoStatus::all(),
            io_status_mfg: 13,
            safety: Some(SafetyStatus::default()),
            captured_at: 14,
            torque: Some(15.0),
            events: EventChecking::all(),
            events_checking: EventChecking::all(),
        };
        image.clear();
        assert_eq!(image, DriveImage::default());
    }
}
