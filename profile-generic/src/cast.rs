//! The one place where integers and floating point numbers turn into each other.
//!
//! Every `as` of the crate that could lose something stands here, with the reason why it does not, or with
//! what it loses stated.

/// The nearest double; ties to even. Exact up to 53 bits.
#[expect(clippy::cast_precision_loss, reason = "rounding to nearest is what this function is for")]
pub const fn f64_from_i64(value: i64) -> f64 {
    value as f64
}

/// The nearest double; ties to even. Exact up to 53 bits.
#[expect(clippy::cast_precision_loss, reason = "rounding to nearest is what this function is for")]
pub const fn f64_from_u128(value: u128) -> f64 {
    value as f64
}

/// The nearest single; ties to even.
#[expect(clippy::cast_precision_loss, reason = "the nearest single is what is wanted")]
pub const fn f32_from_i64(value: i64) -> f32 {
    value as f32
}

/// The nearest single; ties to even. Exact up to 24 bits.
#[expect(clippy::cast_precision_loss, reason = "rounding to nearest is what this function is for")]
pub const fn f32_from_u128(value: u128) -> f32 {
    value as f32
}

/// The nearest integer, ties away from zero, held at the ends of the range; 0 for a value that is not a
/// number.
#[expect(clippy::cast_possible_truncation, reason = "a cast from float saturates and takes NaN to 0")]
pub fn i64_from_f64(value: f64) -> i64 {
    value.round() as i64
}

/// A finite double taken apart exactly: `sign * mantissa * 2^exponent`, with a mantissa below 2^53.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Whether the number is below zero.
    pub negative: bool,
    /// The digits, below 2^53.
    pub mantissa: u64,
    /// The power of two they are multiplied with, -1074 to 971.
    pub exponent: i32,
}

/// Takes a double apart exactly (IEEE 754 binary64), or `None` when it is infinite or not a number.
pub const fn parts(value: f64) -> Option<Parts> {
    let bits = value.to_bits();
    let biased = ((bits >> 52) & 0x7FF) as i32;
    let fraction = bits & ((1 << 52) - 1);
    let (mantissa, exponent) = match biased {
        0x7FF => return None,
        0 => (fraction, -1074),
        _ => (fraction | 1 << 52, biased - 1075),
    };
    Some(Parts { negative: bits >> 63 != 0, mantissa, exponent })
}

/// Two to the `exponent`, exactly; `exponent` is -1022 to 1023.
#[expect(clippy::cast_sign_loss, reason = "the biased exponent is 1 to 2046 within the stated range")]
pub const fn exp2(exponent: i32) -> f64 {
    debug_assert!(exponent >= -1022 && exponent <= 1023);
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Two to the `exponent`, exactly; `exponent` is -126 to 127.
#[expect(clippy::cast_sign_loss, reason = "the biased exponent is 1 to 254 within the stated range")]
pub const fn exp2_f32(exponent: i32) -> f32 {
    debug_assert!(exponent >= -126 && exponent <= 127);
    f32::from_bits(((exponent + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn doubles_to_integers_saturate_and_round_ties_away() {
        let cases = [
            (0.5, 1),
            (-0.5, -1),
            (2.499, 2),
            (1e30, i64::MAX),
            (f64::NEG_INFINITY, i64::MIN),
            (f64::NAN, 0),
        ];
        for (value, expected) in cases {
            assert_eq!(i64_from_f64(value), expected, "{value}");
        }
    }

    #[test]
    fn special_doubles_have_known_parts() {
        assert_eq!(parts(1.0), Some(Parts { negative: false, mantissa: 1 << 52, exponent: -52 }));
        assert_eq!(parts(-0.0), Some(Parts { negative: true, mantissa: 0, exponent: -1074 }));
        assert_eq!(parts(5e-324), Some(Parts { negative: false, mantissa: 1, exponent: -1074 }));
        assert_eq!((parts(f64::NAN), parts(f64::INFINITY)), (None, None));
    }

    proptest! {
        #[test]
        fn parts_make_up_the_double_again(value in -1e200_f64..1e200) {
            let parts = parts(value).unwrap();
            let digits = f64_from_i64(i64::try_from(parts.mantissa).unwrap());
            let magnitude = digits * exp2(parts.exponent.max(-1022));
            let again = if parts.negative { -magnitude } else { magnitude };
            if parts.exponent >= -1022 {
                prop_assert_eq!(again.to_bits(), value.to_bits());
            }
        }
    }

    #[test]
    fn powers_of_two_are_exact() {
        assert_eq!((exp2(0), exp2(-3), exp2(10)), (1.0, 0.125, 1024.0));
        assert_eq!((exp2_f32(0), exp2_f32(-3), exp2_f32(10)), (1.0, 0.125, 1024.0));
    }
}
