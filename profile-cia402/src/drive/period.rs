//! Interpolation time period, object 60C2h: `value * 10^exponent` seconds.

use core::fmt;

use profile_generic::time::DurationNs;

/// Sub-indices 1 and 2 of 60C2h.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct InterpolationPeriod {
    /// 60C2h:1, 1 to 255.
    pub value: u8,
    /// 60C2h:2, -9 to 0 here; the object may hold -128 to 63.
    pub exponent: i8,
}

/// No pair of [`InterpolationPeriod`] gives the period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected 1 to 255 times a power of ten, 1 ns to 255 s; got {} ns", .0.0)]
pub struct PeriodError(pub DurationNs);

impl InterpolationPeriod {
    /// The pair for a period, with the highest exponent that gives it exactly.
    ///
    /// # Errors
    /// [`PeriodError`]: 1.5 ms is 15 times 10^-4 s, but 2.57 ms is no number of 255 steps of any power of ten.
    pub fn new(period: DurationNs) -> Result<Self, PeriodError> {
        let mut step = 1_000_000_000;
        for exponent in (-9..=0_i8).rev() {
            if period.0 > 0 && period.0 % step == 0 {
                return match u8::try_from(period.0 / step) {
                    Ok(value) => Ok(Self { value, exponent }),
                    Err(_) => Err(PeriodError(period)),
                };
            }
            step /= 10;
        }
        Err(PeriodError(period))
    }

    /// The period; `None` for 0, and for what is shorter than 1 ns or longer than 10^9 s.
    #[must_use]
    pub fn duration(self) -> Option<DurationNs> {
        let power = i32::from(self.exponent) + 9;
        let step = 10_i64.checked_pow(u32::try_from(power).ok()?).filter(|_| power <= 18)?;
        let length = i64::from(self.value).checked_mul(step)?;
        (length > 0).then_some(DurationNs(length))
    }
}

impl fmt::Display for InterpolationPeriod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} * 10^{} s", self.value, self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn periods_are_made_of_two_numbers() {
        let pairs = [
            (1_000_000, 1, -3),
            (250_000, 25, -5),
            (62_500, 625, 0),
            (1_500_000, 15, -4),
            (4_000_000, 4, -3),
        ];
        for (period, value, exponent) in pairs {
            let made = InterpolationPeriod::new(DurationNs(period));
            match u8::try_from(value) {
                Ok(value) => assert_eq!(made, Ok(InterpolationPeriod { value, exponent })),
                Err(_) => assert_eq!(made, Err(PeriodError(DurationNs(period)))),
            }
        }
        for period in [0, -1_000_000, i64::MAX] {
            assert_eq!(InterpolationPeriod::new(DurationNs(period)), Err(PeriodError(DurationNs(period))));
        }
        let odd = |value, exponent| InterpolationPeriod { value, exponent }.duration();
        assert_eq!([odd(0, -3), odd(1, -10), odd(255, 63), odd(1, -128)], [None; 4]);
        assert_eq!(odd(2, -3), Some(DurationNs(2_000_000)));
    }

    proptest! {
        #[test]
        fn periods_survive(value in 1..=u8::MAX, exponent in -9..=0_i8) {
            let period = InterpolationPeriod { value, exponent }.duration().unwrap();
            prop_assert_eq!(InterpolationPeriod::new(period).unwrap().duration(), Some(period));
        }

        #[test]
        fn no_pair_panics(value in any::<u8>(), exponent in any::<i8>()) {
            let _ = InterpolationPeriod { value, exponent }.duration();
        }
    }
}
