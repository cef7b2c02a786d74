//! The controller's end of a CIP Motion connection on DeviceNet: what goes into the poll messages of a slave, and what comes
//! out of them.
//!
//! | the controller | the device |
//! |---|---|
//! | numbers its updates (Update ID), one number for each new one | answers with the number of the update it answers |
//! | sets Remote Control and Controller Data Valid in Node Control | sets Remote Mode and Device Data Valid in Node Status once it obeys |
//! | sets attribute 89 (Configuration Complete) by a service, when every attribute is set | leaves Initializing |
//! | sends at most one value of 32 bits, that of its Control Mode: position (DINT), velocity, torque | without it a running axis has an Illegal Control Mode fault |
//! | asks for one actual value: position (DINT) or velocity | sends that one |
//! | asks by Axis Control and keeps it until Axis Response is the same; then 0 until the response is 0 | carries out what changes, never what stays |
//! | raises Node Fault Reset, when Node Status has a fault | clears it with its cause gone |
//!
//! The codes of node fault and of axis faults are read by a service: there is no room for them. Only what
//! [`MotionEnd::handle`] has taken counts; an update without data, a malformed one and an answer to an older update leave
//! everything as it was, and say so.

use crate::controller::handshake::Handshake;
use crate::wire::motion::codes::{
    ActualDataSet, AxisControl, AxisStateCode, ControlMode, FeedbackMode, FeedbackSource, NodeControl,
    NodeStatus, StatusDataSet,
};
use crate::wire::motion::fixed::{FixedActual, FixedCommand, LEN};
use crate::wire::motion::{ActualPosition, CommandPosition, CommandValues};
use crate::wire::{Error, Writer};

use super::event::ExplicitRequest;
use crate::device::attribute::id;

/// Class code of the Motion Device Axis Object.
const CLASS: u16 = crate::device::objects::class::CLASS_MOTION_DEVICE_AXIS;

/// Attribute Control Status, whose bit 0 is Configuration Complete.
const CONTROL_STATUS: u8 = id::CONTROL_STATUS.to_le_bytes()[0];

/// Bytes of either message.
pub const UPDATE_LEN: usize = LEN;

/// The one value of a command: its kind is the Control Mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SetPoint {
    /// Position control: position control units (counts).
    Position(i32),
    /// Velocity control: velocity control units.
    Velocity(f32),
    /// Torque control: % of the rated torque.
    Torque(f32),
}

impl SetPoint {
    const fn mode(self) -> ControlMode {
        match self {
            Self::Position(_) => ControlMode::POSITION,
            Self::Velocity(_) => ControlMode::VELOCITY,
            Self::Torque(_) => ControlMode::TORQUE,
        }
    }

    fn values(self) -> CommandValues {
        let none = CommandValues::default();
        match self {
            Self::Position(counts) => {
                CommandValues { position: Some(CommandPosition::Integer(counts)), ..none }
            }
            Self::Velocity(velocity) => CommandValues { velocity: Some(velocity), ..none },
            Self::Torque(torque) => CommandValues { torque: Some(torque), ..none },
        }
    }
}

/// The actual value that the device is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Watched {
    /// Actual Position, DINT.
    #[default]
    Position,
    /// Actual Velocity.
    Velocity,
}

/// Why a message of the device was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum UpdateError {
    /// It has no data: the device has nothing valid to tell.
    #[error("an update without data")]
    Empty,
    /// It is no update of the fixed format.
    #[error(transparent)]
    Malformed(#[from] Error),
    /// It answers another update than the last one.
    #[error("expected the answer to update {expected}, got that to {found}")]
    Stale {
        /// Update ID sent last.
        expected: u8,
        /// Update ID of the answer.
        found: u8,
    },
    /// A value is no number.
    #[error("an actual value that is no number")]
    NotFinite,
}

/// The controller's end.
#[derive(Debug, Clone)]
pub struct MotionEnd {
    update_id: u8,
    /// It has not gone out.
    unsent: bool,
    set_point: SetPoint,
    watched: Watched,
    reset_node: bool,
    handshake: Handshake,
    actual: Option<FixedActual>,
}

impl MotionEnd {
    /// An end that has sent nothing yet.
    #[must_use]
    pub fn new(set_point: SetPoint, watched: Watched) -> Self {
        Self {
            update_id: 0,
            unsent: false,
            set_point,
            watched,
            reset_node: false,
            handshake: Handshake::default(),
            actual: None,
        }
    }

    /// The request that ends the configuration: every attribute has been set before it.
    #[must_use]
    pub fn configuration_complete() -> Option<ExplicitRequest> {
        ExplicitRequest::set(CLASS, 1, CONTROL_STATUS, &[1])
    }

    /// The connection was taken anew: nothing that was asked or told counts any more.
    pub fn restart(&mut self) {
        *self = Self::new(self.set_point, self.watched);
    }

    /// The value to send from the next update on. In position control it has to be the actual position before the axis is
    /// enabled.
    ///
    /// # Errors
    /// It is no number.
    pub fn set(&mut self, set_point: SetPoint) -> Result<(), UpdateError> {
        if !set_point.values().is_finite() {
            return Err(UpdateError::NotFinite);
        }
        self.set_point = set_point;
        Ok(())
    }

    /// The actual value to ask for.
    pub fn watch(&mut self, watched: Watched) {
        self.watched = watched;
    }

    /// Asks for a change of state, as soon as the one before is answered.
    pub fn request(&mut self, request: AxisControl) {
        self.handshake.request(request);
    }

    /// What the axis is to be asked for from now on, in place of whatever is asked for; the same one again changes nothing.
    /// `None` lets a request that is under way end, and makes no new one.
    pub fn order(&mut self, request: Option<AxisControl>) {
        match request {
            None => self.handshake.withdraw(),
            Some(request) if self.handshake.code() == AxisControl::NONE => self.handshake.request(request),
            Some(request) if self.handshake.code() != request => self.handshake.chain(request),
            Some(_) => {}
        }
    }

    /// The change of state that is asked for now and not answered.
    #[must_use]
    pub const fn asked(&self) -> AxisControl {
        self.handshake.code()
    }

    /// Response Status of `request`, once: 0 is success.
    pub fn take_answer(&mut self, request: AxisControl) -> Option<u8> {
        self.handshake.take(request).map(|answer| answer.status)
    }

    /// Raises or lowers Node Fault Reset.
    pub fn reset_node_fault(&mut self, raised: bool) {
        self.reset_node = raised;
    }

    /// The last update of the device that counts.
    #[must_use]
    pub const fn actual(&self) -> Option<&FixedActual> {
        self.actual.as_ref()
    }

    /// Whether the device obeys and its axis data are valid.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let wanted = NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID;
        self.actual.is_some_and(|actual| actual.node_status.contains(wanted))
    }

    /// Axis State, while it is valid.
    #[must_use]
    pub fn axis_state(&self) -> Option<AxisStateCode> {
        self.actual.filter(|_| self.is_valid()).map(|actual| actual.axis_state)
    }

    /// Actual Position in counts, while it is valid and asked for.
    #[must_use]
    pub fn position(&self) -> Option<i32> {
        match self.actual.filter(|_| self.is_valid())?.actual.position? {
            ActualPosition::Dint(counts) => Some(counts),
            ActualPosition::Lint(_) => None,
        }
    }

    /// Actual Velocity, while it is valid and asked for.
    #[must_use]
    pub fn velocity(&self) -> Option<f32> {
        self.actual.filter(|_| self.is_valid())?.actual.velocity
    }

    /// Writes the next update.
    ///
    /// # Errors
    /// The buffer is shorter than [`UPDATE_LEN`].
    pub fn emit(&mut self, buffer: &mut [u8]) -> Result<(), Error> {
        let update_id = self.update_id.wrapping_add(u8::from(!self.unsent));
        let mut node_control = NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID;
        node_control.set(NodeControl::FAULT_RESET, self.reset_node);
        let command = FixedCommand {
            update_id,
            node_control,
            control_mode: self.set_point.mode(),
            feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
            axis_control: self.handshake.code(),
            actual_data_set: match self.watched {
                Watched::Position => ActualDataSet::POSITION,
                Watched::Velocity => ActualDataSet::VELOCITY,
            },
            status_data_set: StatusDataSet::empty(),
            values: self.set_point.values(),
        };
        command.emit(&mut Writer::new(buffer))?;
        (self.update_id, self.unsent) = (update_id, true);
        Ok(())
    }

    /// The update that was written last has gone out. Until this is said the next one takes its place and has its Update ID,
    /// because the device counts those that it does not get as lost.
    pub const fn sent(&mut self) {
        self.unsent = false;
    }

    /// Takes note of an update that somebody else has sent to the device: its next message answers that.
    pub fn overhear(&mut self, command: &FixedCommand) {
        self.expect(command.update_id);
        match command.axis_control {
            AxisControl::NONE if self.asked() == AxisControl::NONE => {}
            AxisControl::NONE => self.handshake = Handshake::default(),
            code => self.order(Some(code)),
        }
    }

    /// The next message of the device answers this update.
    pub const fn expect(&mut self, update_id: u8) {
        (self.update_id, self.unsent) = (update_id, false);
    }

    /// Takes a message of the device.
    ///
    /// # Errors
    /// It does not count.
    pub fn handle(&mut self, data: &[u8]) -> Result<&FixedActual, UpdateError> {
        if data.is_empty() {
            return Err(UpdateError::Empty);
        }
        let actual = FixedActual::parse(data)?;
        if actual.update_id != self.update_id {
            return Err(UpdateError::Stale { expected: self.update_id, found: actual.update_id });
        }
        let finite = |value: Option<f32>| value.is_none_or(f32::is_finite);
        if !finite(actual.actual.velocity) || !finite(actual.actual.acceleration) {
            return Err(UpdateError::NotFinite);
        }
        self.handshake.handle(actual.axis_response, actual.response_status);
        Ok(self.actual.insert(actual))
    }
}
