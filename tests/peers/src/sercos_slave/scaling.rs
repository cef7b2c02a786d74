//! From the numbers on the wire to revolutions of the motor, and back.
//!
//! Assumptions where the sheets are silent. Without scaling (method 000) a position is increments of the motor's encoder and a
//! velocity is increments a second. An inch has 25.4 mm, and the preferential LSB of an inch position is 10^-6 inch. A linear
//! datum is at the load whatever bit 6 says. A force is a torque over the feed constant.

use super::idn::{Idn, Table};

/// A number for the axis. Values of a drive are far below 2^52.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "values of a drive are far below 2^52")]
pub fn real(value: i64) -> f64 {
    value as f64
}

/// The nearest whole number, held to what fits.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates, and NaN becomes 0")]
pub fn whole(value: f64) -> i64 {
    value.round() as i64
}

/// How many counts of the wire stand for one unit at the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Counts of a position for one revolution of the motor.
    pub position: f64,
    /// Counts of a velocity for one revolution a second of the motor.
    pub velocity: f64,
    /// Counts of an acceleration for one revolution a second squared of the motor.
    pub acceleration: f64,
    /// Counts of a torque for one newton metre.
    pub torque: f64,
    /// Counts after which a position begins again; 0 for none.
    pub modulo: i64,
    /// S-0-0043.
    pub velocity_polarity: u16,
    /// S-0-0055.
    pub position_polarity: u16,
    /// S-0-0085.
    pub torque_polarity: u16,
}

fn power(table: &Table, factor: u32, exponent: u32) -> f64 {
    let exponent = i32::try_from(table.signed(Idn::s(exponent))).unwrap_or(0).clamp(-64, 64);
    f64::from(table.unsigned(Idn::s(factor))) * 10f64.powi(exponent)
}

/// An LSB of 0 would divide by zero: it counts as 1.
fn usable(lsb: f64) -> f64 {
    if lsb.is_finite() && lsb > 0.0 { lsb } else { 1.0 }
}

impl Scaling {
    /// Reads the parameters of scaling, gear, modulo and polarity.
    #[must_use]
    pub fn new(table: &Table, encoder: u32, stall_torque: f64) -> Self {
        let tau = std::f64::consts::TAU;
        let input = f64::from(table.unsigned(Idn::s(121)).max(1));
        let output = f64::from(table.unsigned(Idn::s(122)).max(1));
        let gear = output / input;
        // Metres at the load for one revolution of the motor.
        let feed = usable(real(table.signed(Idn::s(123))) * 1e-7) * gear;
        let kind = |idn: u32| table.word(Idn::s(idn));
        let length = |word: u16| if word & 0x10 == 0 { 1.0 } else { 0.0254 };
        let shaft = |word: u16| if word & 0x40 == 0 { 1.0 } else { gear };

        let p = kind(76);
        let position = match p & 7 {
            1 if p & 8 == 0 => feed / (length(p) * if p & 0x10 == 0 { 1e-7 } else { 1e-6 }),
            1 => feed / usable(length(p) * power(table, 77, 78)),
            2 if p & 8 == 0 => 3_600_000.0 * shaft(p),
            2 => f64::from(table.unsigned(Idn::s(79)).max(1)) * shaft(p),
            _ => f64::from(encoder),
        };
        let v = kind(44);
        let seconds = if v & 0x20 == 0 { 60.0 } else { 1.0 };
        let velocity = match v & 7 {
            1 if v & 8 == 0 => feed * seconds / (length(v) * if v & 0x10 == 0 { 1e-6 } else { 1e-5 }),
            1 => feed * seconds / usable(length(v) * power(table, 45, 46)),
            2 if v & 8 == 0 => shaft(v) * seconds / if v & 0x20 == 0 { 1e-4 } else { 1e-6 },
            2 => shaft(v) * seconds / usable(power(table, 45, 46)),
            _ => f64::from(encoder),
        };
        let a = kind(160);
        let acceleration = match a & 7 {
            1 if a & 8 == 0 => feed / (length(a) * 1e-6),
            1 => feed / usable(length(a) * power(table, 161, 162)),
            2 if a & 8 == 0 => shaft(a) * tau / 1e-3,
            2 => shaft(a) * tau / usable(power(table, 161, 162)),
            _ => f64::from(encoder),
        };
        let t = kind(86);
        let torque = match t & 7 {
            1 if t & 8 == 0 => tau / feed,
            1 => tau / feed / usable(power(table, 93, 94)),
            2 if t & 8 == 0 => 100.0,
            2 => 1.0 / usable(power(table, 93, 94)),
            _ => 1000.0 / usable(stall_torque),
        };
        Self {
            position,
            velocity,
            acceleration,
            torque,
            modulo: if p & 0x80 == 0 { 0 } else { table.signed(Idn::s(103)).max(0) },
            velocity_polarity: kind(43),
            position_polarity: kind(55),
            torque_polarity: kind(85),
        }
    }

    /// Wraps a position in counts into the modulo range.
    #[must_use]
    pub fn wrap(&self, counts: i64) -> i64 {
        if self.modulo > 0 { counts.rem_euclid(self.modulo) } else { counts }
    }

    /// The sign that a bit of a polarity word asks for.
    #[must_use]
    pub fn sign(word: u16, bit: u16) -> f64 {
        if word >> bit & 1 == 0 { 1.0 } else { -1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{parameters, settings::Settings};
    use super::*;

    fn scaling(change: impl Fn(&mut Settings)) -> Scaling {
        let mut settings = Settings::default();
        change(&mut settings);
        Scaling::new(&parameters::table(&settings), settings.encoder, settings.stall_torque)
    }

    #[test]
    fn preferential_rotation_is_a_ten_thousandth() {
        let s = scaling(|_| {});
        assert!((s.position - 3_600_000.0).abs() < 1e-6);
        assert!((s.velocity - 600_000.0).abs() < 1e-6);
        assert!((s.acceleration - 6_283.185_307).abs() < 1e-3);
    }

    #[test]
    fn a_linear_axis_with_a_gear_in_inches_a_second() {
        let s = scaling(|s| {
            s.scaling.position_type = 0x49;
            s.scaling.position_factor = 5;
            s.scaling.position_exponent = -6;
            s.scaling.velocity_type = 0x79;
            s.scaling.velocity_factor = 1;
            s.scaling.velocity_exponent = -3;
            s.scaling.gear_input = 4;
            s.scaling.gear_output = 2;
            s.scaling.feed_constant = 254_000;
        });
        // 25.4 mm at the load for two revolutions: 12.7 mm each, in steps of 5 um, and half an inch in steps of 0.001 inch.
        assert!((s.position - 2540.0).abs() < 1e-6);
        assert!((s.velocity - 500.0).abs() < 1e-6);
    }

    #[test]
    fn a_torque_is_a_tenth_of_a_percent_or_a_hundredth_of_a_newton_metre() {
        assert!((scaling(|s| s.stall_torque = 4.0).torque - 250.0).abs() < 1e-9);
        assert!((scaling(|s| s.scaling.torque_type = 2).torque - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_scaling_of_zero_divides_nothing_by_zero() {
        let s = scaling(|s| {
            s.scaling.position_type = 9;
            s.scaling.position_factor = 0;
            s.scaling.velocity_type = 0x0A;
            s.scaling.velocity_factor = 0;
            s.scaling.gear_input = 0;
            s.scaling.feed_constant = 0;
        });
        assert!(s.position.is_finite() && s.velocity.is_finite() && s.position > 0.0);
        assert_eq!(s.wrap(-5), -5);
        let m = scaling(|s| {
            s.scaling.position_type = 0x82;
            s.scaling.modulo = 3_600_000;
        });
        assert_eq!((m.wrap(-5), m.wrap(3_600_001)), (3_599_995, 1));
    }
}
