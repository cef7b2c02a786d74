//! Exact rational conversion.
//!
//! A ratio of two 64-bit integers is applied in 128-bit arithmetic and rounded once, at the end, in a stated
//! way. What cannot be held is clamped and reported, never wrapped.

use crate::cast;
use core::fmt;

/// How a quotient becomes an integer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// To the nearest integer, ties away from zero.
    #[default]
    Nearest,
    /// To the integer at or below.
    Floor,
    /// To the integer nearer to zero.
    TowardZero,
}

impl Rounding {
    /// The name in snake case.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Floor => "floor",
            Self::TowardZero => "toward_zero",
        }
    }

    /// The rounding with this exact name.
    pub fn parse(name: &str) -> Option<Self> {
        [Self::Nearest, Self::Floor, Self::TowardZero].into_iter().find(|rounding| rounding.name() == name)
    }
}

/// A result did not fit; carries the nearest value that does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("result exceeds the range and was held at {value}")]
pub struct Saturated {
    /// The end of the range that was exceeded.
    pub value: i64,
}

/// A floating point number could not be converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FloatError {
    /// Infinite, or not a number.
    #[error("expected a finite number, got an infinity or NaN")]
    NotFinite,
    /// Beyond the range.
    #[error(transparent)]
    Saturated(#[from] Saturated),
}

/// A converted value, and what happened to it on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// The result, clamped and rounded as far as necessary.
    pub value: i64,
    /// Whether the result was clamped.
    pub saturated: bool,
    /// Whether the result was rounded.
    pub inexact: bool,
}

/// A floating point result, and whether it is exactly the quotient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloatOutcome<F> {
    /// The nearest floating point number, ties to even.
    pub value: F,
    /// Whether the result was rounded.
    pub inexact: bool,
}

/// A rational number: reduced, with a denominator above zero.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ratio {
    num: i64,
    den: i64,
    by_den: Reciprocal,
}

impl Ratio {
    /// One to one.
    pub const ONE: Self = Self { num: 1, den: 1, by_den: Reciprocal::new(1) };

    /// The ratio in lowest terms, or `None` when the denominator is zero or the reduced ratio needs more than
    /// 64 bits (which only a term of -2^63 can cause).
    pub const fn new(num: i64, den: i64) -> Option<Self> {
        Self::reduce(num as i128, den as i128)
    }

    const fn reduce(num: i128, den: i128) -> Option<Self> {
        if den == 0 {
            return None;
        }
        let divisor = gcd(num.unsigned_abs(), den.unsigned_abs());
        // The divisor is at most 2^126 for products of 64-bit terms and never zero, as the denominator is
        // not.
        let divisor = divisor.cast_signed();
        let (num, den) = (num / divisor, den / divisor);
        let (num, den) = if den < 0 { (-num, -den) } else { (num, den) };
        match (narrow(num), narrow(den)) {
            (Some(num), Some(den)) => Some(Self { num, den, by_den: Reciprocal::new(den.unsigned_abs()) }),
            _ => None,
        }
    }

    /// The numerator, with the sign.
    pub const fn num(self) -> i64 {
        self.num
    }

    /// The denominator, above zero.
    pub const fn den(self) -> i64 {
        self.den
    }

    /// `value` times this ratio, and whether it was rounded or clamped.
    pub const fn convert(self, value: i64, rounding: Rounding) -> Outcome {
        clamp(self.quotient(value, rounding))
    }

    /// `value` times this ratio, and whether it was rounded, where the product fits 64 bits: the way of nearly every value of a
    /// cycle, without a division. `None` for others, and where rounding would lead beyond what [`Reciprocal`] divides.
    #[inline]
    pub(crate) const fn short_quotient(self, value: i64, rounding: Rounding) -> Option<(i64, bool)> {
        let Some(product) = value.checked_mul(self.num) else { return None };
        if self.den == 1 {
            return Some((product, false));
        }
        let den = self.den.unsigned_abs();
        // What lifts a magnitude to the next whole multiple of the denominator where it is rounded away from zero.
        let lift = match rounding {
            Rounding::Nearest => den / 2,
            Rounding::Floor if product < 0 => den - 1,
            Rounding::Floor | Rounding::TowardZero => 0,
        };
        let magnitude = product.unsigned_abs();
        let lifted = magnitude + lift;
        if lifted >= Reciprocal::LIMIT {
            return None;
        }
        let quotient = self.by_den.divide(lifted);
        let signed = quotient.cast_signed();
        Some((if product < 0 { -signed } else { signed }, quotient * den != magnitude))
    }

    /// `value` times this ratio before clamping, and whether it was rounded. The magnitude is at most 2^126.
    pub(crate) const fn quotient(self, value: i64, rounding: Rounding) -> (i128, bool) {
        divide(value as i128 * self.num as i128, self.den as i128, rounding)
    }

    /// `value` times this ratio, rounded; the error carries the clamped result.
    pub const fn apply(self, value: i64, rounding: Rounding) -> Result<i64, Saturated> {
        let outcome = self.convert(value, rounding);
        if outcome.saturated { Err(Saturated { value: outcome.value }) } else { Ok(outcome.value) }
    }

    /// A double times this ratio, and whether it was rounded or clamped; `None` when it is not finite. The
    /// double is taken at its exact binary value, and nothing is rounded before the end.
    pub fn convert_f64(self, value: f64, rounding: Rounding) -> Option<Outcome> {
        self.quotient_f64(value, rounding).map(clamp)
    }

    /// As [`Ratio::quotient`] for a double. What is beyond 64 bits comes back as some value beyond 64 bits
    /// and within 2^127.
    pub(crate) fn quotient_f64(self, value: f64, rounding: Rounding) -> Option<(i128, bool)> {
        let parts = cast::parts(value)?;
        // 53 bits times 64 bits: 117 bits at most.
        let product = i128::from(parts.mantissa) * i128::from(self.num);
        let product = if parts.negative { -product } else { product };
        let den = i128::from(self.den);
        if product == 0 {
            return Some((0, false));
        }
        let shift = parts.exponent.unsigned_abs();
        if parts.exponent >= 0 {
            if shift + 1 < product.unsigned_abs().leading_zeros() {
                return Some(divide(product << shift, den, rounding));
            }
            // At least 2^126 over less than 2^63 is beyond any 64-bit integer, also with an offset of 63
            // bits.
            return Some((product.signum() << 100, true));
        }
        if shift + 1 < den.unsigned_abs().leading_zeros() {
            return Some(divide(product, den << shift, rounding));
        }
        // Less than 2^117 over at least 2^126: between -1/2 and 1/2, and not zero.
        let below = matches!(rounding, Rounding::Floor) && product < 0;
        Some((if below { -1 } else { 0 }, true))
    }

    /// A double times this ratio, rounded once at the end.
    ///
    /// # Errors
    /// [`FloatError::NotFinite`], or [`FloatError::Saturated`] with the clamped result.
    pub fn apply_f64(self, value: f64, rounding: Rounding) -> Result<i64, FloatError> {
        let outcome = self.convert_f64(value, rounding).ok_or(FloatError::NotFinite)?;
        if outcome.saturated { Err(Saturated { value: outcome.value }.into()) } else { Ok(outcome.value) }
    }

    /// The double nearest to `value` times this ratio, and whether it is exact.
    pub fn convert_to_f64(self, value: i64) -> FloatOutcome<f64> {
        f64_quotient(i128::from(value) * i128::from(self.num), self.den)
    }

    /// The single nearest to `value` times this ratio, and whether it is exact.
    pub fn convert_to_f32(self, value: i64) -> FloatOutcome<f32> {
        f32_quotient(i128::from(value) * i128::from(self.num), self.den)
    }

    /// The double nearest to `value` times this ratio; ties to even.
    pub fn to_f64(self, value: i64) -> f64 {
        self.convert_to_f64(value).value
    }

    /// One over this ratio, or `None` for zero.
    pub const fn inverse(self) -> Option<Self> {
        Self::new(self.den, self.num)
    }

    /// This ratio followed by `next`: the product, or `None` when it cannot be held in 64 bits.
    pub const fn then(self, next: Self) -> Option<Self> {
        Self::reduce(self.num as i128 * next.num as i128, self.den as i128 * next.den as i128)
    }

    /// This ratio followed by `next`, as near to the product as 64 bits allow: off by less than one part in 2^62. For
    /// units that are no fractions of each other anyway, a radian and a turn. `None` when the product is zero or beyond
    /// 2^63 either way.
    pub fn then_nearest(self, next: Self) -> Option<Self> {
        if let Some(exact) = self.then(next) {
            return Some(exact).filter(|ratio| ratio.num != 0);
        }
        let num = i128::from(self.num) * i128::from(next.num);
        let den = i128::from(self.den) * i128::from(next.den);
        let (mut upper, mut lower) = (num.unsigned_abs(), den.unsigned_abs());
        // The last convergent of the continued fraction whose terms fit.
        let (mut before, mut last) = ((0_u128, 1_u128), (1_u128, 0_u128));
        while lower != 0 {
            let whole = upper / lower;
            let term = |last: u128, before: u128| {
                let term = whole.checked_mul(last)?.checked_add(before)?;
                i64::try_from(term).is_ok().then_some(term)
            };
            let (Some(num), Some(den)) = (term(last.0, before.0), term(last.1, before.1)) else { break };
            (before, last) = (last, (num, den));
            (upper, lower) = (lower, upper % lower);
        }
        let (top, bottom) = (i64::try_from(last.0).ok()?, i64::try_from(last.1).ok()?);
        Self::new(if num < 0 { -top } else { top }, bottom).filter(|ratio| ratio.num != 0)
    }
}

/// Division by a constant as multiplication: for every `n` below 2^63, `n / den` is `n * factor / 2^(64 + shift)`, rounded
/// down.
///
/// With `2^shift < den <= 2^(shift + 1)` the factor is the next whole number above `2^(64 + shift) / den`; it exceeds that by at
/// most one, so that the product is too large by less than `n / 2^(64 + shift) < 1 / den`: never as much as is missing to the
/// next quotient (Granlund and Montgomery, Division by Invariant Integers using Multiplication, theorem 4.2).
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Reciprocal {
    factor: u64,
    shift: u8,
}

impl Reciprocal {
    /// What is divided has to be below this.
    const LIMIT: u64 = 1 << 63;

    /// For a divisor above one; for one, which needs no division, there is none.
    #[expect(clippy::cast_possible_truncation, reason = "the quotient is below 2^64 and the shift below 63")]
    const fn new(den: u64) -> Self {
        if den < 2 {
            return Self { factor: 0, shift: 0 };
        }
        let shift = (den - 1).ilog2();
        let factor = (1_u128 << (64 + shift)) / den as u128 + 1;
        Self { factor: factor as u64, shift: shift as u8 }
    }

    #[inline]
    const fn divide(self, number: u64) -> u64 {
        ((number as u128 * self.factor as u128) >> 64) as u64 >> self.shift
    }
}

impl Default for Ratio {
    fn default() -> Self {
        Self::ONE
    }
}

impl fmt::Display for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.num, self.den)
    }
}

impl fmt::Debug for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Ratio({self})")
    }
}

/// A quotient of whole numbers of up to 127 bits, rounded once and clamped to 64 bits. `None` for a divisor of zero, and where a
/// term is -2^127.
pub const fn quotient(num: i128, den: i128, rounding: Rounding) -> Option<Outcome> {
    match (num.checked_neg(), den.checked_neg()) {
        (_, Some(0)) | (None, _) | (_, None) => None,
        (Some(_), Some(_)) if den > 0 => Some(clamp(divide(num, den, rounding))),
        (Some(num), Some(den)) => Some(clamp(divide(num, den, rounding))),
    }
}

const fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[expect(clippy::cast_possible_truncation, reason = "the range is checked first")]
const fn narrow(value: i128) -> Option<i64> {
    if value >= i64::MIN as i128 && value <= i64::MAX as i128 { Some(value as i64) } else { None }
}

/// The rounded quotient, and whether it was rounded. `den` is above zero.
const fn divide(num: i128, den: i128, rounding: Rounding) -> (i128, bool) {
    // Nearly every double of a cycle takes this way: one division of the processor instead of two of the library.
    let (quotient, rest) = match (narrow(num), narrow(den)) {
        (Some(num), Some(1)) => (num as i128, 0),
        (Some(num), Some(den)) => ((num / den) as i128, (num % den) as i128),
        _ => (num / den, num % den),
    };
    if rest == 0 {
        return (quotient, false);
    }
    let rounded = match rounding {
        Rounding::TowardZero => quotient,
        Rounding::Floor if num < 0 => quotient - 1,
        Rounding::Floor => quotient,
        // Compares |rest| with den - |rest| instead of doubling, which could overflow.
        Rounding::Nearest if rest.unsigned_abs() >= den.unsigned_abs() - rest.unsigned_abs() => {
            quotient + num.signum()
        }
        Rounding::Nearest => quotient,
    };
    (rounded, true)
}

/// The quotient as `quotient * 2^-shift` with at least 64 bits, so that a sticky last bit decides every
/// rounding.
struct LongQuotient {
    quotient: u128,
    shift: i32,
    sticky: bool,
}

impl LongQuotient {
    /// `den` is above zero.
    fn new(num: i128, den: i64) -> Self {
        let magnitude = num.unsigned_abs();
        if magnitude == 0 {
            return Self { quotient: 0, shift: 0, sticky: false };
        }
        // The magnitude is not zero, so at most 127 places.
        let shift = magnitude.leading_zeros();
        let (numerator, den) = (magnitude << shift, u128::from(den.unsigned_abs()));
        let (quotient, rest) = (numerator / den, numerator % den);
        Self { quotient, shift: shift.cast_signed(), sticky: rest != 0 }
    }
}

/// The double nearest to `num / den`; `den` is above zero.
pub(crate) fn f64_quotient(num: i128, den: i64) -> FloatOutcome<f64> {
    let LongQuotient { quotient, shift, sticky } = LongQuotient::new(num, den);
    let magnitude = cast::f64_from_u128(quotient | u128::from(sticky)) * cast::exp2(-shift);
    let inexact = sticky || significant_bits(quotient) > f64::MANTISSA_DIGITS;
    FloatOutcome { value: if num < 0 { -magnitude } else { magnitude }, inexact }
}

/// The single nearest to `num / den`, where a division of 64 bits tells it: its quotient has two bits more than a single at
/// least, and a sticky last bit decides the rounding.
fn short_f32_quotient(num: i128, den: i64) -> Option<FloatOutcome<f32>> {
    const DEN_BITS: u32 = u64::BITS - 1 - (f32::MANTISSA_DIGITS + 2);
    let (num, den) = (narrow(num)?, den.unsigned_abs());
    let magnitude = num.unsigned_abs();
    if magnitude == 0 || den >> DEN_BITS != 0 {
        return None;
    }
    // The highest bit stays free: the conversion of a signed number is one instruction.
    let shift = magnitude.leading_zeros().checked_sub(1)?;
    let numerator = magnitude << shift;
    let (quotient, rest) = (numerator / den, numerator % den);
    let value = cast::f32_from_i64((quotient | u64::from(rest != 0)).cast_signed());
    let magnitude = value * cast::exp2_f32(-shift.cast_signed());
    let bits = u64::BITS - quotient.leading_zeros() - quotient.trailing_zeros();
    let inexact = rest != 0 || bits > f32::MANTISSA_DIGITS;
    Some(FloatOutcome { value: if num < 0 { -magnitude } else { magnitude }, inexact })
}

/// The single nearest to `num / den`; `den` is above zero.
pub(crate) fn f32_quotient(num: i128, den: i64) -> FloatOutcome<f32> {
    if let Some(outcome) = short_f32_quotient(num, den) {
        return outcome;
    }
    long_f32_quotient(num, den)
}

fn long_f32_quotient(num: i128, den: i64) -> FloatOutcome<f32> {
    let LongQuotient { quotient, shift, sticky } = LongQuotient::new(num, den);
    // One bit less, because the largest single is just below 2^128.
    let half = quotient >> 1 | quotient & 1 | u128::from(sticky);
    let magnitude = cast::f32_from_u128(half) * cast::exp2_f32(1 - shift);
    let inexact = sticky || significant_bits(quotient) > f32::MANTISSA_DIGITS;
    FloatOutcome { value: if num < 0 { -magnitude } else { magnitude }, inexact }
}

/// Holds a quotient within 64 bits.
pub(crate) const fn clamp((value, inexact): (i128, bool)) -> Outcome {
    match narrow(value) {
        Some(value) => Outcome { value, saturated: false, inexact },
        None if value > 0 => Outcome { value: i64::MAX, saturated: true, inexact },
        None => Outcome { value: i64::MIN, saturated: true, inexact },
    }
}

/// The bits from the highest set one to the lowest set one.
const fn significant_bits(value: u128) -> u32 {
    if value == 0 { 0 } else { u128::BITS - value.leading_zeros() - value.trailing_zeros() }
}

#[cfg(test)]
mod tests {

    use super::*;
    use proptest::prelude::*;

    fn ratio(num: i64, den: i64) -> Ratio {
        Ratio::new(num, den).unwrap()
    }

    #[test]
    fn ratios_are_reduced_with_the_sign_above() {
        assert_eq!((ratio(6, -4).num(), ratio(6, -4).den()), (-3, 2));
        assert_eq!(ratio(0, -7).to_string(), "0/1");
        assert_eq!(Ratio::new(1, 0), None);
        assert_eq!(Ratio::new(i64::MIN, -1), None);
        assert_eq!(ratio(i64::MIN, i64::MIN), Ratio::ONE);
        assert_eq!(ratio(i64::MIN, -2), ratio(1 << 62, 1));
    }

    #[test]
    fn rounding_is_as_stated() {
        let half = ratio(1, 2);
        let rows = [(3, 2, 1, 1), (-3, -2, -2, -1), (1, 1, 0, 0), (-1, -1, -1, 0), (4, 2, 2, 2)];
        for (value, nearest, floor, toward_zero) in rows {
            assert_eq!(half.apply(value, Rounding::Nearest), Ok(nearest), "{value}");
            assert_eq!(half.apply(value, Rounding::Floor), Ok(floor), "{value}");
            assert_eq!(half.apply(value, Rounding::TowardZero), Ok(toward_zero), "{value}");
        }
        assert_eq!(ratio(1, 3).apply(4, Rounding::Nearest), Ok(1));
        assert_eq!(ratio(1, 3).apply(5, Rounding::Nearest), Ok(2));
    }

    #[test]
    fn what_does_not_fit_is_clamped_and_reported() {
        assert_eq!(ratio(2, 1).apply(i64::MAX, Rounding::Nearest), Err(Saturated { value: i64::MAX }));
        assert_eq!(ratio(-2, 1).apply(i64::MAX, Rounding::Nearest), Err(Saturated { value: i64::MIN }));
        assert_eq!(ratio(-1, 1).apply(i64::MIN, Rounding::Nearest), Err(Saturated { value: i64::MAX }));
        assert_eq!(
            ratio(1, 1).apply_f64(1e300, Rounding::Nearest),
            Err(Saturated { value: i64::MAX }.into())
        );
        assert_eq!(
            ratio(-1, 1).apply_f64(1e19, Rounding::Nearest),
            Err(Saturated { value: i64::MIN }.into())
        );
        assert_eq!(ratio(1, 1).apply_f64(f64::NAN, Rounding::Nearest), Err(FloatError::NotFinite));
    }

    #[test]
    fn doubles_are_taken_at_their_exact_value() {
        // 0.1 is a little more than a tenth: 0.1000000000000000055511151231257827...
        let tenth = ratio(1_000_000_000_000_000_000, 1);
        assert_eq!(tenth.apply_f64(0.1, Rounding::Floor), Ok(100_000_000_000_000_005));
        assert_eq!(tenth.apply_f64(-0.1, Rounding::Floor), Ok(-100_000_000_000_000_006));
        assert_eq!(ratio(1, 1).apply_f64(0.49999999999999994, Rounding::Nearest), Ok(0));
        assert_eq!(ratio(1, 1).apply_f64(-5e-324, Rounding::Floor), Ok(-1));
        assert_eq!(ratio(1, 1).apply_f64(5e-324, Rounding::Nearest), Ok(0));
        assert_eq!(ratio(1, i64::MAX).apply_f64(1e37, Rounding::Floor), Ok(1_084_202_172_485_504_384));
    }

    #[test]
    fn the_way_to_a_double_rounds_once() {
        // 2^53 + 1 over 1 is a tie; over 3 times 3 the long way it would not be.
        assert_eq!(ratio(1, 1).convert_to_f64((1 << 53) + 1).value, 9_007_199_254_740_992.0);
        assert!(ratio(1, 1).convert_to_f64((1 << 53) + 1).inexact);
        assert_eq!(ratio(1, 3).to_f64(1), 1.0 / 3.0);
        assert_eq!(ratio(-1, 1_000_000_000).to_f64(1_500_000_000), -1.5);
        assert!(!ratio(-1, 1_000_000_000).convert_to_f64(1_500_000_000).inexact);
        assert_eq!(ratio(1, 10).convert_to_f32(1), FloatOutcome { value: 0.1_f32, inexact: true });
        assert_eq!(ratio(i64::MAX, 1).convert_to_f32(i64::MIN).value, -8.507_059e37_f32);
        assert_eq!(ratio(1, i64::MAX).convert_to_f32(1).value, 1.084_202_2e-19_f32);
        assert_eq!(ratio(5, 1).convert_to_f32(0), FloatOutcome { value: 0.0, inexact: false });
    }

    /// A quotient just above a tie, by less than the digits that are computed can show, still rounds up.
    #[test]
    fn what_is_beyond_the_digits_decides_a_tie() {
        let den = (1_i64 << 62) - 1;
        let tie = |digits: u32| ((1_i128 << digits) + 1) * i128::from(den);
        assert_eq!(f64_quotient(tie(53), den).value, 9_007_199_254_740_992.0);
        assert_eq!(f64_quotient(tie(53) + 1, den).value, 9_007_199_254_740_994.0);
        assert_eq!(f64_quotient(-tie(53) - 1, den).value, -9_007_199_254_740_994.0);
        assert_eq!(f32_quotient(tie(24), den).value, 16_777_216.0);
        assert_eq!(f32_quotient(tie(24) + 1, den).value, 16_777_218.0);
        // The last of the digits alone, with no rest after it.
        let last_digit = (((1_i128 << 24) + 1) << 41 | 1) << 60;
        assert_eq!(f32_quotient(last_digit, 1 << 62).value, 16_777_218.0 * cast::exp2_f32(39));
    }

    #[test]
    fn inverse_and_chain() {
        assert_eq!(ratio(3, 4).inverse(), Some(ratio(4, 3)));
        assert_eq!(ratio(0, 4).inverse(), None);
        assert_eq!(ratio(3, 4).then(ratio(8, 9)), Some(ratio(2, 3)));
        assert_eq!(ratio(i64::MAX, 1).then(ratio(2, 1)), None);
        assert_eq!(ratio(i64::MIN, 1).then(ratio(i64::MIN, 1)), None);
    }

    #[test]
    fn roundings_have_names_that_lead_back() {
        for rounding in [Rounding::Nearest, Rounding::Floor, Rounding::TowardZero] {
            assert_eq!(Rounding::parse(rounding.name()), Some(rounding));
        }
    }

    /// Where a reciprocal that is wrong by the least would show: around every multiple at the ends of the range.
    #[test]
    fn reciprocals_divide_at_the_ends_of_their_range() {
        let powers = (1..63).flat_map(|power| [(1 << power) - 1, 1 << power, (1 << power) + 1]);
        let others = [3, 7, 10, 641, 1_000_000_000, 6_700_417, Reciprocal::LIMIT - 1];
        for den in powers.chain(others).filter(|den| *den > 1) {
            let reciprocal = Reciprocal::new(den);
            let last = (Reciprocal::LIMIT - 1) / den;
            for multiple in [0, 1, 2, last / 2, last - 1, last] {
                let multiple = multiple.min(last) * den;
                for number in [multiple.saturating_sub(1), multiple, multiple + 1, multiple + (den - 1)] {
                    let number = number.min(Reciprocal::LIMIT - 1);
                    assert_eq!(reciprocal.divide(number), number / den, "{number} / {den}");
                }
            }
        }
    }

    fn any_ratio() -> impl Strategy<Value = Ratio> {
        (any::<i64>(), any::<i64>()).prop_filter_map("not a ratio", |(num, den)| Ratio::new(num, den))
    }

    /// Beyond 64 bits the nearest fraction is found, and its error is what it promises.
    #[test]
    fn products_beyond_64_bits_come_near() {
        let radian = Ratio::new(78_256_779_000_000_000, 491_701_844).unwrap();
        for gear in [(65_537, 7_919), (4_294_967_291, 4_294_967_279), (7, 4_294_967_291), (-13, 7)] {
            for power in [Ratio::new(1, 1_000).unwrap(), Ratio::new(100, 1).unwrap()] {
                let gear = Ratio::new(gear.0, gear.1).unwrap();
                let near = radian.then_nearest(gear).unwrap().then_nearest(power).unwrap();
                let parts = [gear.num, power.num, gear.den, power.den].map(|part| Ratio::ONE.to_f64(part));
                let exact = 78_256_779e9 / 491_701_844.0 * parts[0] * parts[1] / parts[2] / parts[3];
                let got = Ratio::ONE.to_f64(near.num) / Ratio::ONE.to_f64(near.den);
                assert!(((got - exact) / exact).abs() < 1e-15, "{near}: {got} for {exact}");
            }
        }
        let large = Ratio::new(i64::MAX, 1).unwrap();
        assert_eq!(large.then_nearest(large), None);
        assert_eq!(large.inverse().unwrap().then_nearest(large.inverse().unwrap()), None);
        assert_eq!(large.then_nearest(Ratio::new(0, 1).unwrap()), None);
        assert_eq!(large.then_nearest(large.inverse().unwrap()), Some(Ratio::ONE));
    }

    proptest! {
        /// The result lies within half a step of the true quotient, by multiplication instead of division.
        #[test]
        fn nearest_is_nearest(ratio in any_ratio(), value in any::<i64>()) {
            let exact = i128::from(value) * i128::from(ratio.num());
            if let Ok(result) = ratio.apply(value, Rounding::Nearest) {
                let error = exact - i128::from(result) * i128::from(ratio.den());
                prop_assert!(2 * error.unsigned_abs() <= u128::from(ratio.den().unsigned_abs()));
            } else {
                prop_assert!(exact.unsigned_abs() / u128::from(ratio.den().unsigned_abs()) >= 1 << 62);
            }
        }

        #[test]
        fn floor_is_at_or_below_and_less_than_one_off(ratio in any_ratio(), value in any::<i64>()) {
            let exact = i128::from(value) * i128::from(ratio.num());
            if let Ok(result) = ratio.apply(value, Rounding::Floor) {
                let error = exact - i128::from(result) * i128::from(ratio.den());
                prop_assert!(error >= 0 && error < i128::from(ratio.den()));
            }
        }

        /// What is divided by a reciprocal comes to the same place.
        #[test]
        fn short_and_long_quotients_agree(
            num in any::<i64>(), small in -1_000_i64..1_000, den in 1..i64::MAX, step in 1..100_i64, value in any::<i64>(),
        ) {
            for rounding in [Rounding::Nearest, Rounding::Floor, Rounding::TowardZero] {
                for (num, den) in [(num, den), (num, step), (small, step), (small, den), (num, 1), (1, step)] {
                    for value in [value, value >> 32, value >> 48, value >> 60] {
                        let ratio = ratio(num, den);
                        if let Some((short, inexact)) = ratio.short_quotient(value, rounding) {
                            prop_assert_eq!((i128::from(short), inexact), ratio.quotient(value, rounding));
                        } else {
                            let product = i128::from(value) * i128::from(ratio.num());
                            prop_assert!(product.unsigned_abs() + u128::from(ratio.den().unsigned_abs()) >= 1 << 63);
                        }
                    }
                }
            }
        }

        /// What fits 64 bits takes another way, to the same place.
        #[test]
        fn short_and_long_division_agree(num in any::<i64>(), small in -1_000_i64..1_000, den in 1..i64::MAX, step in 1..100_i64) {
            for rounding in [Rounding::Nearest, Rounding::Floor, Rounding::TowardZero] {
                for (num, den) in [(num, den), (num, step), (small, step), (num, 1), (i64::MIN, den), (i64::MIN, 1)] {
                    let (num, den) = (i128::from(num), i128::from(den));
                    prop_assert_eq!(divide(num, den, rounding), divide(num << 63, den << 63, rounding));
                }
            }
        }

        /// There and back loses at most one step of the coarser side.
        #[test]
        fn a_round_trip_loses_at_most_one_step(
            num in 1..=1_i64 << 40, den in 1..=1_i64 << 40, value in -(1_i64 << 50)..1 << 50,
        ) {
            let there = ratio(num, den);
            let back = there.inverse().unwrap();
            if let Ok(far) = there.apply(value, Rounding::Nearest) {
                let again = back.apply(far, Rounding::Nearest).unwrap();
                let coarse = i128::from(den).max(i128::from(num));
                // One step of the far side, seen from the near side, is den/num; the coarser side has at
                // least 1.
                let loss = i128::from(value.abs_diff(again)) * i128::from(num);
                prop_assert!(loss <= coarse, "{value} -> {far} -> {again}");
            }
        }

        /// Whole numbers as doubles give what they give as integers.
        #[test]
        fn doubles_agree_with_integers(ratio in any_ratio(), value in -(1_i64 << 53)..=1 << 53) {
            for rounding in [Rounding::Nearest, Rounding::Floor, Rounding::TowardZero] {
                let outcome = ratio.convert_f64(cast::f64_from_i64(value), rounding).unwrap();
                prop_assert_eq!(outcome.value, ratio.convert(value, rounding).value);
            }
        }

        /// Fractions as doubles: m/2^k times n/d is m*n over d*2^k, checked by multiplication.
        #[test]
        fn fractions_are_exact(
            num in -(1_i64 << 40)..1 << 40, den in 1..1_i64 << 30,
            mantissa in -(1_i64 << 53)..1 << 53, shift in 0..30_i32,
        ) {
            let value = cast::f64_from_i64(mantissa) * cast::exp2(-shift);
            if let Ok(result) = ratio(num, den).apply_f64(value, Rounding::Nearest) {
                let scaled_den = i128::from(den) << shift;
                let error = i128::from(mantissa) * i128::from(num) - i128::from(result) * scaled_den;
                prop_assert!(2 * error.abs() <= scaled_den);
            }
        }

        /// No double is nearer to the quotient than the one returned: it comes back to the same integer.
        #[test]
        fn doubles_bring_back_what_fits_them(
            num in 1..1_i64 << 20, den in 1..1_i64 << 20, value in -(1_i64 << 32)..1 << 32,
        ) {
            let there = ratio(num, den);
            let back = there.inverse().unwrap();
            prop_assert_eq!(back.apply_f64(there.to_f64(value), Rounding::Nearest), Ok(value));
        }
    }
}
