//! What the set-points of an axis were like, for tables.

use super::curve::Bands;

/// Part of the highest velocity within which the curve counts as one of constant velocity.
const CONSTANT: f64 = 1e-6;

/// How far set-points were from the controller's curve. All values are of the axis in nanounits.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Set-points seen.
    pub set_points: u64,
    /// Highest speed of the controller's curve.
    pub fastest: f64,
    /// Largest distance of a velocity from those of the curve.
    pub deviation: f64,
    /// Largest acceleration of a set-point.
    pub acceleration: f64,
    /// Largest acceleration of the curve.
    pub curve_acceleration: f64,
    /// Sum of the squares of the deviations at constant velocity, and how many.
    squares: f64,
    constant: f64,
}

impl Statistics {
    /// Takes a set-point.
    pub fn add(&mut self, velocity: Option<f64>, acceleration: Option<f64>, bands: &Bands) {
        let (low, high) = (bands.velocity.low, bands.velocity.high);
        self.fastest = self.fastest.max(low.abs()).max(high.abs());
        self.curve_acceleration =
            self.curve_acceleration.max(bands.acceleration.low.abs()).max(bands.acceleration.high.abs());
        let Some(velocity) = velocity else { return };
        self.set_points += 1;
        self.deviation = self.deviation.max(bands.velocity.outside(velocity));
        self.acceleration = self.acceleration.max(acceleration.unwrap_or(0.0).abs());
        if high - low <= CONSTANT * self.fastest && high.abs() > self.fastest / 2.0 {
            self.squares += (velocity - high).powi(2);
            self.constant += 1.0;
        }
    }

    /// Root mean square of the deviation at constant velocity; 0 without any.
    #[must_use]
    pub fn ripple(&self) -> f64 {
        if self.constant > 0.0 { (self.squares / self.constant).sqrt() } else { 0.0 }
    }

    /// The part of the fastest velocity that `value` is, in percent.
    #[must_use]
    pub fn percent(&self, value: f64) -> f64 {
        if self.fastest > 0.0 { value / self.fastest * 100.0 } else { 0.0 }
    }
}
