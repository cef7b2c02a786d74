//! What no step may go beyond, whatever it says.

use super::failure::Failure;
use super::trajectory::{Limits, State};

/// By how much a value may pass a limit by rounding alone.
const SLACK: f64 = 1.0 + 1e-9;

/// Limits of an axis; none where the bench has none.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxisLimits {
    /// Units per second.
    pub velocity: Option<f64>,
    /// Units per second squared.
    pub acceleration: Option<f64>,
    /// Lowest and highest position, units.
    pub position: Option<(f64, f64)>,
    /// % of motor rated torque.
    pub torque: Option<f64>,
}

impl AxisLimits {
    /// The first limit that is none, with its name.
    pub(super) fn first_bad(&self) -> Option<(&'static str, f64)> {
        let named = [
            ("velocity limit", self.velocity),
            ("acceleration limit", self.acceleration),
            ("torque limit", self.torque),
        ];
        let bad = named.into_iter().find_map(|(name, value)| {
            value.filter(|value| !(value.is_finite() && *value > 0.0)).map(|value| (name, value))
        });
        bad.or_else(|| {
            let (low, high) = self.position?;
            let good = low.is_finite() && high.is_finite() && low < high;
            (!good).then_some(("position limits", low))
        })
    }

    fn beyond(axis: u8, what: &'static str, value: f64, limit: Option<f64>) -> Result<(), Failure> {
        match limit {
            Some(limit) if value.abs() > limit * SLACK => {
                Err(Failure::BeyondLimit { axis, what, value, limit })
            }
            _ => Ok(()),
        }
    }

    /// Whether a motion may be asked for at all.
    pub(super) fn check_motion(&self, axis: u8, limits: Limits) -> Result<(), Failure> {
        Self::beyond(axis, "velocity", limits.velocity, self.velocity)?;
        Self::beyond(axis, "acceleration", limits.acceleration, self.acceleration)
    }

    /// Whether an axis may be sent to a position, in units.
    pub(super) fn check_position(&self, axis: u8, position: f64) -> Result<(), Failure> {
        match self.position {
            Some((low, _)) if position < low => {
                Err(Failure::BeyondLimit { axis, what: "position", value: position, limit: low })
            }
            Some((_, high)) if position > high => {
                Err(Failure::BeyondLimit { axis, what: "position", value: position, limit: high })
            }
            _ => Ok(()),
        }
    }

    /// Whether a torque may be commanded, in % of the rated one.
    pub(super) fn check_torque(&self, axis: u8, torque: f64) -> Result<(), Failure> {
        Self::beyond(axis, "torque", torque, self.torque)
    }

    /// The last look at a command before it is sent: state in units.
    pub(super) fn check_command(&self, axis: u8, command: State) -> Result<(), Failure> {
        Self::beyond(axis, "velocity", command.velocity, self.velocity)?;
        Self::beyond(axis, "acceleration", command.acceleration, self.acceleration)?;
        self.check_position(axis, command.position)
    }
}
