//! Rows of a drive's program and messages of its poll connection: the one from the other.
//!
//! What stands in a row says `mapping::devicenet`.

use profile_cip::devicenet::master::motion::{MotionEnd, SetPoint, UPDATE_LEN, UpdateError, Watched};
use profile_cip::devicenet::master::speed::{SpeedEnd, SpeedError};
use profile_cip::devicenet::wire::speed::{Assembly, SpeedCommand, SpeedControl};
use profile_cip::wire::Error;
use profile_cip::wire::motion::CommandPosition;
use profile_cip::wire::motion::codes::{AxisControl, ControlMode, NodeStatus};
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_generic::time::DurationNs;

use crate::mapping::devicenet::{MODE_AT, POSITION_AT, ROW_LEN, TORQUE_AT, VELOCITY_AT, motion, speed};

/// The values of a drive as its program sees them.
pub type Row = [u8; ROW_LEN];

/// Cycles over which the velocity is taken from the position: one count in a cycle would be coarse.
const SPAN: usize = 4;

/// Cycles for which the reset of a node fault stands: it is an edge, and comes anew if it has not helped.
const RESET_CYCLES: u8 = 10;

/// Why a message of a drive was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// Of a CIP Motion drive.
    #[error(transparent)]
    Update(#[from] UpdateError),
    /// Of a velocity drive.
    #[error(transparent)]
    Assembly(#[from] Error),
}

/// The box's end of a poll connection.
#[derive(Debug, Clone)]
pub enum End {
    /// Of a CIP Motion drive.
    Motion(MotionLink),
    /// Of a velocity drive.
    Speed(SpeedLink),
}

impl End {
    /// Lengths of its messages: to the drive, and from it.
    #[must_use]
    pub const fn lengths(&self) -> (usize, usize) {
        match self {
            Self::Motion(_) => (UPDATE_LEN, UPDATE_LEN),
            Self::Speed(link) => link.end.lengths(),
        }
    }

    /// The connection was taken anew: nothing of before counts.
    pub fn restart(&mut self) {
        match self {
            Self::Motion(link) => link.restart(),
            Self::Speed(link) => link.end.restart(),
        }
    }

    /// Writes the next message of a drive that is led; `false` when there is none.
    pub fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
        match self {
            Self::Motion(link) => link.emit(row, message),
            Self::Speed(link) => link.emit(row, message),
        }
    }

    /// Writes the next message of a drive that is set up: it asks for nothing.
    pub fn emit_neutral(&mut self, message: &mut [u8]) -> bool {
        match self {
            Self::Motion(link) => link.emit_neutral(message),
            Self::Speed(link) => {
                link.end.stop();
                link.end.emit(message).is_ok()
            }
        }
    }

    /// The message that was written last has gone out: the next one is another one, and does not take its place.
    pub const fn sent(&mut self) {
        if let Self::Motion(link) = self {
            link.end.sent();
        }
    }

    /// Takes a message that somebody else has sent to the drive into a row of commands: the next message of the drive answers it.
    ///
    /// # Errors
    /// It cannot be read, and the row stays as it was.
    pub fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        match self {
            Self::Motion(link) => link.overhear(message, row),
            Self::Speed(link) => link.overhear(message, row),
        }
    }

    /// The next message of the drive is this one, whatever was sent before.
    pub fn expect(&mut self, message: &[u8]) {
        if let (Self::Motion(link), Ok(actual)) = (self, FixedActual::parse(message)) {
            link.end.expect(actual.update_id);
        }
    }

    /// Takes a message of the drive into its row; `cycle` counts those of the bus.
    ///
    /// # Errors
    /// It does not count, and the row stays as it was.
    pub fn handle(&mut self, cycle: u64, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        match self {
            Self::Motion(link) => link.handle(cycle, message, row),
            Self::Speed(link) => link.handle(message, row),
        }
    }

    /// Whether the drive has answered on this connection: its explicit side can be set up then.
    #[must_use]
    pub const fn is_answered(&self) -> bool {
        match self {
            Self::Motion(link) => link.end.actual().is_some(),
            Self::Speed(link) => link.end.actual().is_some(),
        }
    }
}

/// The end of a CIP Motion drive.
#[derive(Debug, Clone)]
pub struct MotionLink {
    end: MotionEnd,
    /// What it asks for while it has no other mode, with its value at rest.
    neutral: SetPoint,
    velocity: VelocityMeter,
    reset_cycles: u8,
}

impl MotionLink {
    /// The end of a drive that has `mode` among its modes, with so many counts in a unit.
    #[must_use]
    pub fn new(mode: ControlMode, resolution: u32, cycle: DurationNs) -> Self {
        let neutral = match mode {
            ControlMode::VELOCITY => SetPoint::Velocity(0.0),
            ControlMode::TORQUE => SetPoint::Torque(0.0),
            _ => SetPoint::Position(0),
        };
        let end = MotionEnd::new(neutral, Watched::Position);
        Self { end, neutral, velocity: VelocityMeter::new(resolution, cycle), reset_cycles: 0 }
    }

    fn restart(&mut self) {
        self.end.restart();
        self.velocity.restart();
        self.reset_cycles = 0;
    }

    /// At rest: where the drive is, or nothing.
    fn at_rest(&self) -> SetPoint {
        match self.neutral {
            SetPoint::Position(counts) => SetPoint::Position(self.end.position().unwrap_or(counts)),
            other => other,
        }
    }

    fn emit_neutral(&mut self, message: &mut [u8]) -> bool {
        self.end.order(None);
        self.end.set(self.at_rest()).is_ok() && self.end.emit(message).is_ok()
    }

    fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
        let set_point = match ControlMode(row[MODE_AT]) {
            ControlMode::POSITION => SetPoint::Position(i32::from_le_bytes(word(row, POSITION_AT))),
            ControlMode::VELOCITY => SetPoint::Velocity(f32::from_le_bytes(word(row, VELOCITY_AT))),
            ControlMode::TORQUE => SetPoint::Torque(f32::from_le_bytes(word(row, TORQUE_AT))),
            _ => self.at_rest(),
        };
        let wanted = Some(AxisControl(row[0])).filter(|code| *code != AxisControl::NONE);
        let taken_back = row[1] & motion::MAY_RUN == 0 && self.end.asked() == AxisControl::ENABLE;
        self.end.order(wanted.or(taken_back.then_some(AxisControl::DISABLE)));
        let faulted = self.end.actual().is_some_and(|actual| actual.node_status.contains(NodeStatus::FAULT));
        self.reset_cycles = match (faulted, self.reset_cycles) {
            (false, _) => 0,
            (true, 0) if wanted == Some(AxisControl::FAULT_RESET) => RESET_CYCLES,
            (true, left) => left.saturating_sub(1),
        };
        self.end.reset_node_fault(self.reset_cycles > 0);
        // What is no number is no command.
        self.end.set(set_point).is_ok() && self.end.emit(message).is_ok()
    }

    fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let command = FixedCommand::parse(message).map_err(UpdateError::Malformed)?;
        self.end.overhear(&command);
        *row = [0; ROW_LEN];
        row[..POSITION_AT].copy_from_slice(&[command.axis_control.0, 0, command.control_mode.0]);
        if let Some(CommandPosition::Integer(position)) = command.values.position {
            row[POSITION_AT..VELOCITY_AT].copy_from_slice(&position.to_le_bytes());
        }
        if let Some(velocity) = command.values.velocity {
            row[VELOCITY_AT..TORQUE_AT].copy_from_slice(&velocity.to_le_bytes());
        }
        if let Some(torque) = command.values.torque {
            row[TORQUE_AT..].copy_from_slice(&torque.to_le_bytes());
        }
        Ok(())
    }

    fn handle(&mut self, cycle: u64, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let actual = *self.end.handle(message)?;
        let mut flags = 0;
        if self.end.is_valid() {
            flags |= motion::VALID;
        }
        if actual.node_status.contains(NodeStatus::FAULT) {
            flags |= motion::NODE_FAULT;
        }
        row[..POSITION_AT].copy_from_slice(&[actual.axis_state.0, flags, actual.control_mode.0]);
        // A position that is not valid leaves what there was: the report says that the drive is not ready.
        if let Some(position) = self.end.position() {
            row[POSITION_AT..VELOCITY_AT].copy_from_slice(&position.to_le_bytes());
            let velocity = self.velocity.take(cycle, position);
            row[VELOCITY_AT..TORQUE_AT].copy_from_slice(&velocity.to_le_bytes());
        }
        Ok(())
    }
}

/// The velocity of a drive whose updates have room for its position only.
#[derive(Debug, Clone)]
struct VelocityMeter {
    /// Units per second of one count in a cycle.
    per_count: f64,
    seen: [Option<(u64, i32)>; SPAN],
    next: usize,
}

impl VelocityMeter {
    fn new(resolution: u32, cycle: DurationNs) -> Self {
        let cycles_per_second = 1e9 / profile_generic::cast::f64_from_i64(cycle.as_nanos().max(1));
        Self { per_count: cycles_per_second / f64::from(resolution.max(1)), seen: [None; SPAN], next: 0 }
    }

    fn restart(&mut self) {
        self.seen = [None; SPAN];
    }

    /// Units per second; not a number at the first position.
    fn take(&mut self, cycle: u64, position: i32) -> f32 {
        // Of those that are kept the oldest one; what lies further back belongs to another motion.
        let kept = self.seen.iter().flatten().filter(|(at, _)| cycle.saturating_sub(*at) <= 2 * SPAN as u64);
        let oldest = kept.min_by_key(|(at, _)| *at).copied();
        self.seen[self.next] = Some((cycle, position));
        self.next = (self.next + 1) % SPAN;
        match oldest {
            Some((at, before)) if at < cycle => {
                let counts = f64::from(position.wrapping_sub(before));
                let cycles = u32::try_from(cycle - at).unwrap_or(u32::MAX);
                narrow(counts * self.per_count / f64::from(cycles))
            }
            _ => f32::NAN,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a REAL has fewer digits; rounding is what is wanted")]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// The end of a velocity drive.
#[derive(Debug, Clone)]
pub struct SpeedLink {
    end: SpeedEnd,
}

impl SpeedLink {
    /// The end of a drive with this output assembly.
    ///
    /// # Errors
    /// It is none.
    pub fn new(assembly: Assembly) -> Result<Self, SpeedError> {
        Ok(Self { end: SpeedEnd::new(assembly)? })
    }

    fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
        let [low, high, ..] = word(row, POSITION_AT);
        if row[0] & speed::RESET != 0 {
            if !self.end.is_resetting() {
                self.end.reset_fault();
            }
        } else if row[0] & speed::RUN == 0 {
            self.end.stop();
        } else if self.end.run(i16::from_le_bytes([low, high])).is_err() {
            return false;
        }
        self.end.emit(message).is_ok()
    }

    fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let SpeedCommand { control, speed, .. } = SpeedCommand::parse(self.end.output(), message)?;
        let reverse = control.contains(SpeedControl::RUN_REVERSE);
        let runs = control.intersects(SpeedControl::RUN_FORWARD | SpeedControl::RUN_REVERSE);
        *row = [0; ROW_LEN];
        row[0] = if runs { speed::RUN } else { 0 };
        if control.contains(SpeedControl::FAULT_RESET) {
            row[0] |= speed::RESET;
        }
        row[MODE_AT] = ControlMode::VELOCITY.0;
        let speed = if reverse { speed.saturating_neg() } else { speed };
        row[POSITION_AT..POSITION_AT + 2].copy_from_slice(&speed.to_le_bytes());
        Ok(())
    }

    fn handle(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let actual = self.end.handle(message)?;
        row[..POSITION_AT].copy_from_slice(&[actual.status.bits(), actual.state.0, ControlMode::VELOCITY.0]);
        row[POSITION_AT..POSITION_AT + 2].copy_from_slice(&actual.speed.to_le_bytes());
        Ok(())
    }
}

/// Four bytes of a row.
fn word(row: &Row, at: usize) -> [u8; 4] {
    row.get(at..).and_then(|bytes| bytes.first_chunk()).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests;
