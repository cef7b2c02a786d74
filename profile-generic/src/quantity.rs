//! Physical quantities as integers in fixed, fine units.
//!
//! The units are chosen so that every conversion to and from a profile's units is an exact ratio and so that
//! 64 bits hold any machine: a position reaches 9.2 thousand million revolutions or millimetres.

use crate::code::named_enum;
use core::fmt;

named_enum! {
    /// What a number measures. It decides which unit the number is in throughout the generic model.
    pub enum Quantity {
        /// A bare number: a count, an enumeration, bits.
        None = "none",
        /// Nanounits: 1e-9 of an axis unit, see [`Position`].
        Position = "position",
        /// Nanounits per second, see [`Velocity`].
        Velocity = "velocity",
        /// Nanounits per second squared, see [`Acceleration`].
        Acceleration = "acceleration",
        /// Nanounits per second cubed.
        Jerk = "jerk",
        /// Parts per million of rated torque or force, see [`Torque`].
        Torque = "torque",
        /// Micro newton metre or micro newton, see [`TorqueAbsolute`].
        TorqueAbsolute = "torque_absolute",
        /// Microampere, see [`Current`].
        Current = "current",
        /// Microvolt, see [`Voltage`].
        Voltage = "voltage",
        /// Millidegree Celsius, see [`Temperature`].
        Temperature = "temperature",
        /// Milliwatt.
        Power = "power",
        /// Nanoseconds.
        Time = "time",
        /// Millihertz.
        Frequency = "frequency",
        /// Parts per million of a stated whole.
        Fraction = "fraction",
        /// Nano kilogram metre squared, or micro kilogram for a linear motor.
        Inertia = "inertia",
        /// Micro ohm.
        Resistance = "resistance",
        /// Nano henry.
        Inductance = "inductance",
        /// Microradian per second per microradian: a loop gain in 1e-6 per second.
        Gain = "gain",
    }
}

impl Quantity {
    /// The unit of the integer, as printed in dictionaries.
    // Flat: a table from quantity to unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Position => "nu",
            Self::Velocity => "nu/s",
            Self::Acceleration => "nu/s2",
            Self::Jerk => "nu/s3",
            Self::Torque | Self::Fraction => "ppm",
            Self::TorqueAbsolute => "uNm",
            Self::Current => "uA",
            Self::Voltage => "uV",
            Self::Temperature => "mdegC",
            Self::Power => "mW",
            Self::Time => "ns",
            Self::Frequency => "mHz",
            Self::Inertia => "nkgm2",
            Self::Resistance => "uOhm",
            Self::Inductance => "nH",
            Self::Gain => "1e-6/s",
        }
    }
}

/// A number with its unit, written exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal<'u> {
    /// The number, times ten to the power of `decimals`.
    pub value: i64,
    /// Digits after the point, 1 to 18; others count as the nearer of these.
    pub decimals: u8,
    /// What is counted.
    pub unit: &'u str,
}

/// Sign, point, and the digits of the longest number.
const DECIMAL_LEN: usize = 22;

impl fmt::Display for Decimal<'_> {
    // Without `write!`: recordings are translated to many millions of these.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let decimals = self.decimals.clamp(1, 18);
        let mut text = [0_u8; DECIMAL_LEN];
        let mut rest = self.value.unsigned_abs();
        let mut from = text.len();
        let mut digits = 0;
        while rest > 0 || digits <= decimals {
            if digits == decimals {
                from -= 1;
                text[from] = b'.';
            }
            let [digit, ..] = (rest % 10).to_le_bytes();
            from -= 1;
            text[from] = b'0' + digit;
            rest /= 10;
            digits += 1;
        }
        if self.value < 0 {
            from -= 1;
            text[from] = b'-';
        }
        // Digits, point and sign only.
        f.write_str(core::str::from_utf8(&text[from..]).unwrap_or_default())?;
        f.write_str(" ")?;
        f.write_str(self.unit)
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $kind:ident, $decimals:literal, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub i64);

        impl $name {
            /// Nothing of it.
            pub const ZERO: Self = Self(0);
            /// What this type measures.
            pub const QUANTITY: Quantity = Quantity::$kind;

            /// The integer in the unit of the type.
            pub const fn get(self) -> i64 {
                self.0
            }

            /// The sum, or the nearest end of the range.
            pub const fn saturating_add(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }

            /// The difference, or the nearest end of the range.
            pub const fn saturating_sub(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }

        impl From<i64> for $name {
            fn from(value: i64) -> Self {
                Self(value)
            }
        }

        impl From<$name> for i64 {
            fn from(value: $name) -> Self {
                value.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                Decimal { value: self.0, decimals: $decimals, unit: $unit }.fmt(f)
            }
        }
    };
}

quantity! {
    /// A position in nanounits: 1e-9 revolution for a rotary axis, 1e-9 millimetre for a linear one.
    Position, Position, 9, "u"
}
quantity! {
    /// A velocity in nanounits per second.
    Velocity, Velocity, 9, "u/s"
}
quantity! {
    /// An acceleration in nanounits per second squared.
    Acceleration, Acceleration, 9, "u/s2"
}
quantity! {
    /// A torque or force in parts per million of the motor's rated torque or force.
    Torque, Torque, 4, "%"
}
quantity! {
    /// A torque in micro newton metre, or a force in micro newton.
    TorqueAbsolute, TorqueAbsolute, 6, "Nm"
}
quantity! {
    /// A current in microampere.
    Current, Current, 6, "A"
}
quantity! {
    /// A voltage in microvolt.
    Voltage, Voltage, 6, "V"
}
quantity! {
    /// A temperature in millidegree Celsius.
    Temperature, Temperature, 3, "degC"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_print_exactly_with_their_unit() {
        assert_eq!(Position(1_500_000_000).to_string(), "1.500000000 u");
        assert_eq!(Position(-1).to_string(), "-0.000000001 u");
        assert_eq!(Position(i64::MIN).to_string(), "-9223372036.854775808 u");
        assert_eq!(Torque(1_000_000).to_string(), "100.0000 %");
        assert_eq!(Temperature(-12_345).to_string(), "-12.345 degC");
        assert_eq!(Voltage(560_000_000).to_string(), "560.000000 V");
        assert_eq!(Position(i64::MAX).to_string(), "9223372036.854775807 u");
        assert_eq!(Position::ZERO.to_string(), "0.000000000 u");
        let most = Decimal { value: i64::MIN, decimals: u8::MAX, unit: "x" };
        assert_eq!(most.to_string(), "-9.223372036854775808 x");
        assert_eq!(Decimal { value: -5, decimals: 0, unit: "x" }.to_string(), "-0.5 x");
    }

    #[test]
    fn sums_saturate() {
        assert_eq!(Velocity(i64::MAX).saturating_add(Velocity(1)), Velocity(i64::MAX));
        assert_eq!(Velocity(i64::MIN).saturating_sub(Velocity(1)), Velocity(i64::MIN));
    }

    #[test]
    fn every_quantity_has_a_name_that_leads_back() {
        for quantity in Quantity::ALL {
            assert_eq!(Quantity::parse(quantity.name()), Some(*quantity));
        }
        assert_eq!(Position::QUANTITY.unit(), "nu");
    }
}
