//! The arithmetic of one field: ratio, offset, limits.

use crate::ratio::{self, FloatOutcome, Outcome, Ratio, Rounding};

/// Turns a value of one side into a value of the other: `clamp(round(value * ratio) + offset, min, max)`.
///
/// A conversion has one direction; the way back is another conversion, see [`Conversion::inverse`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// What the value is multiplied with.
    pub ratio: Ratio,
    /// What is added after the multiplication, in units of the result.
    pub offset: i64,
    /// How the product is rounded.
    pub rounding: Rounding,
    /// The lowest result.
    pub min: i64,
    /// The highest result, at least `min`.
    pub max: i64,
}

impl Conversion {
    /// Leaves every value as it is.
    pub const IDENTITY: Self = Self::new(Ratio::ONE);

    /// Multiplies only, rounds to nearest, and has no limits but those of 64 bits.
    pub const fn new(ratio: Ratio) -> Self {
        Self { ratio, offset: 0, rounding: Rounding::Nearest, min: i64::MIN, max: i64::MAX }
    }

    /// The same conversion with limits. Limits in the wrong order are swapped.
    pub const fn within(self, min: i64, max: i64) -> Self {
        let (min, max) = if min <= max { (min, max) } else { (max, min) };
        Self { min, max, ..self }
    }

    /// The same conversion with an offset.
    pub const fn with_offset(self, offset: i64) -> Self {
        Self { offset, ..self }
    }

    /// The same conversion with another rounding.
    pub const fn with_rounding(self, rounding: Rounding) -> Self {
        Self { rounding, ..self }
    }

    /// Converts an integer.
    #[inline]
    pub const fn convert(&self, value: i64) -> Outcome {
        if let Some((quotient, inexact)) = self.ratio.short_quotient(value, self.rounding)
            && let Some(value) = quotient.checked_add(self.offset)
        {
            return self.limit(Outcome { value, saturated: false, inexact });
        }
        self.convert_long(value)
    }

    /// The same in 128 bits; apart, so that the ordinary way stays short where it is used.
    #[cold]
    #[inline(never)]
    const fn convert_long(&self, value: i64) -> Outcome {
        self.finish(self.ratio.quotient(value, self.rounding))
    }

    /// Converts a double at its exact value; `None` when it is not finite.
    pub fn convert_f64(&self, value: f64) -> Option<Outcome> {
        self.ratio.quotient_f64(value, self.rounding).map(|quotient| self.finish(quotient))
    }

    /// Converts to a double without rounding to an integer first; the second value is whether it was
    /// clamped.
    pub fn convert_to_f64(&self, value: i64) -> (FloatOutcome<f64>, bool) {
        let (num, saturated) = self.numerator(value);
        (ratio::f64_quotient(num, self.ratio.den()), saturated)
    }

    /// Converts to a single without rounding to an integer first; the second value is whether it was
    /// clamped.
    pub fn convert_to_f32(&self, value: i64) -> (FloatOutcome<f32>, bool) {
        let (num, saturated) = self.numerator(value);
        (ratio::f32_quotient(num, self.ratio.den()), saturated)
    }

    /// The conversion back, without limits: from `value * ratio + offset` to `value`. `None` when the ratio
    /// is zero or the offset does not convert to a whole number.
    pub fn inverse(&self) -> Option<Self> {
        let ratio = self.ratio.inverse()?;
        let offset = ratio.convert(self.offset, self.rounding);
        if offset.saturated || offset.inexact {
            return None;
        }
        Some(Self::new(ratio).with_offset(offset.value.checked_neg()?).with_rounding(self.rounding))
    }

    const fn finish(&self, (quotient, inexact): (i128, bool)) -> Outcome {
        // At most 2^126 plus 2^63.
        let sum = quotient + self.offset as i128;
        self.limit(ratio::clamp((sum, inexact)))
    }

    #[inline]
    const fn limit(&self, outcome: Outcome) -> Outcome {
        if outcome.value < self.min {
            Outcome { value: self.min, saturated: true, ..outcome }
        } else if outcome.value > self.max {
            Outcome { value: self.max, saturated: true, ..outcome }
        } else {
            outcome
        }
    }

    /// The exact result times the denominator, clamped.
    fn numerator(&self, value: i64) -> (i128, bool) {
        if (self.offset, self.min, self.max) == (0, i64::MIN, i64::MAX)
            && let Some(product) = value.checked_mul(self.ratio.num())
        {
            // Over a denominator of at least one that is within all limits.
            return (i128::from(product), false);
        }
        let den = i128::from(self.ratio.den());
        // At most 2^126 plus less than 2^126.
        let num = i128::from(value) * i128::from(self.ratio.num()) + i128::from(self.offset) * den;
        let (min, max) = (i128::from(self.min) * den, i128::from(self.max) * den);
        (num.clamp(min, max), num < min || num > max)
    }
}

impl Default for Conversion {
    fn default() -> Self {
        Self::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ratio(num: i64, den: i64) -> Ratio {
        Ratio::new(num, den).unwrap()
    }

    #[test]
    fn ratio_then_offset_then_limits() {
        let conversion = Conversion::new(ratio(1, 10)).with_offset(-3).within(0, 100);
        let rows =
            [(100, 7, false, false), (104, 7, false, true), (29, 0, false, true), (20, 0, true, false)];
        for (input, value, saturated, inexact) in rows {
            assert_eq!(conversion.convert(input), Outcome { value, saturated, inexact }, "{input}");
        }
        assert_eq!(conversion.convert(i64::MAX), Outcome { value: 100, saturated: true, inexact: true });
    }

    #[test]
    fn the_ends_of_the_range_do_not_wrap() {
        let double = Conversion::new(ratio(2, 1)).with_offset(i64::MAX);
        assert_eq!(double.convert(i64::MAX).value, i64::MAX);
        assert_eq!(double.convert(i64::MIN), Outcome { value: i64::MIN, saturated: true, inexact: false });
        // An offset may bring back what the product alone could not hold.
        assert_eq!(double.convert(-(1 << 62)), Outcome { value: -1, saturated: false, inexact: false });
        assert_eq!(
            double.convert_f64(-1e300),
            Some(Outcome { value: i64::MIN, saturated: true, inexact: true })
        );
        assert_eq!(double.convert_f64(f64::INFINITY), None);
    }

    #[test]
    fn floats_are_not_rounded_to_integers_on_the_way() {
        let conversion = Conversion::new(ratio(1, 4)).with_offset(1).within(-10, 10);
        let (exact, saturated) = conversion.convert_to_f64(5);
        assert_eq!((exact.value, exact.inexact, saturated), (2.25, false, false));
        assert_eq!(conversion.convert_to_f32(5).0.value, 2.25);
        let (held, saturated) = conversion.convert_to_f64(1_000);
        assert_eq!((held.value, saturated), (10.0, true));
        assert!(conversion.convert_to_f32(-1_000).1);
    }

    #[test]
    fn the_way_back_needs_a_whole_offset() {
        let there = Conversion::new(ratio(1, 10)).with_offset(-3);
        assert_eq!(there.inverse(), Some(Conversion::new(ratio(10, 1)).with_offset(30)));
        assert_eq!(Conversion::new(ratio(10, 1)).with_offset(3).inverse(), None);
        assert_eq!(Conversion::new(ratio(0, 1)).inverse(), None);
    }

    #[test]
    fn limits_in_the_wrong_order_are_swapped() {
        assert_eq!(Conversion::IDENTITY.within(5, -5).convert(9).value, 5);
    }

    proptest! {
        #[test]
        fn results_keep_the_limits_and_admit_it(
            num in any::<i64>(), den in 1..i64::MAX, offset in any::<i64>(),
            min in any::<i64>(), max in any::<i64>(),
            value in any::<i64>(),
        ) {
            let Some(ratio) = Ratio::new(num, den) else { return Ok(()) };
            let conversion = Conversion::new(ratio).with_offset(offset).within(min, max);
            let outcome = conversion.convert(value);
            prop_assert!(outcome.value >= conversion.min && outcome.value <= conversion.max);
            if !outcome.saturated {
                let error = i128::from(value) * i128::from(ratio.num())
                    - (i128::from(outcome.value) - i128::from(offset)) * i128::from(ratio.den());
                prop_assert!(2 * error.abs() <= i128::from(ratio.den()));
                prop_assert_eq!(error != 0, outcome.inexact);
            }
            let (float, _) = conversion.convert_to_f64(value);
            prop_assert!(float.value.is_finite());
        }

        #[test]
        fn there_and_back_loses_at_most_one_step_of_the_coarser_side(
            num in 1..1_i64 << 30, den in 1..1_i64 << 30, value in -(1_i64 << 60)..1 << 60,
        ) {
            let there = Conversion::new(ratio(num, den));
            let far = there.convert(value);
            if far.saturated { return Ok(()); }
            let again = there.inverse().unwrap().convert(far.value).value;
            let step = (den + num - 1) / num;
            prop_assert!(value.abs_diff(again) <= step.unsigned_abs());
        }
    }
}
