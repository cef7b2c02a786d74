//! The end of a CIP Motion drive.

use profile_cip::devicenet::master::motion::{MotionEnd, SetPoint, UpdateError, Watched};
use profile_cip::wire::motion::CommandPosition;
use profile_cip::wire::motion::codes::{AxisControl, ControlMode, NodeStatus};
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_generic::time::DurationNs;

use super::{MessageError, Row, word};
use crate::mapping::devicenet::{MODE_AT, POSITION_AT, ROW_LEN, TORQUE_AT, VELOCITY_AT, motion};

/// Cycles over which the velocity is taken from the position: one count in a cycle would be coarse.
const SPAN: usize = 4;

/// Cycles for which the reset of a node fault stands: it is an edge, and comes anew if it has not helped.
const RESET_CYCLES: u8 = 10;

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

    pub(super) fn restart(&mut self) {
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

    pub(super) fn emit_neutral(&mut self, message: &mut [u8]) -> bool {
        self.end.order(None);
        self.end.set(self.at_rest()).is_ok() && self.end.emit(message).is_ok()
    }

    pub(super) fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
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

    pub(super) fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
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

    pub(super) fn handle(&mut self, cycle: u64, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
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

    pub(super) const fn sent(&mut self) {
        self.end.sent();
    }

    pub(super) fn expect(&mut self, message: &[u8]) {
        if let Ok(actual) = FixedActual::parse(message) {
            self.end.expect(actual.update_id);
        }
    }

    pub(super) const fn is_answered(&self) -> bool {
        self.end.actual().is_some()
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

    pub(super) fn restart(&mut self) {
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
