//! Axis scaling: units and counts, and counters that wrap.

use crate::code::named_enum;
use crate::ratio::Ratio;

named_enum! {
    /// How an axis moves; decides what the axis unit is.
    #[derive(Default)]
    pub enum UnitKind {
        /// Turns: the axis unit is one revolution.
        #[default]
        Rotary = "rotary",
        /// Moves along a line: the axis unit is one millimetre.
        Linear = "linear",
    }
}

/// Nanounits in one axis unit.
pub const NANO: i64 = 1_000_000_000;

/// How the counts of a profile relate to the axis unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisScaling {
    /// How the axis moves.
    pub kind: UnitKind,
    /// Counts in `units` axis units, above zero.
    counts: i64,
    /// Axis units, above zero. With `counts` it allows counts that are not whole per unit, as behind a
    /// gearbox.
    units: i64,
}

impl AxisScaling {
    /// `counts` counts in `units` axis units, or `None` unless both are above zero and the conversion fits 64
    /// bits.
    pub fn new(kind: UnitKind, counts: i64, units: i64) -> Option<Self> {
        let scaling = Self { kind, counts, units };
        (counts > 0 && units > 0).then_some(())?;
        scaling.ratio()?.inverse()?;
        Some(scaling)
    }

    fn ratio(self) -> Option<Ratio> {
        Ratio::new(self.counts, self.units)?.then(Ratio::new(1, NANO)?)
    }

    /// From nanounits (also per second, and so on) to counts.
    pub fn to_counts(self) -> Ratio {
        self.ratio().unwrap_or_default()
    }

    /// From counts (also per second, and so on) to nanounits.
    pub fn from_counts(self) -> Ratio {
        self.to_counts().inverse().unwrap_or_default()
    }
}

/// `value` folded into `0..modulus`.
///
/// `modulus` must be above zero; a value is returned as it is otherwise.
#[inline]
pub const fn fold(value: i64, modulus: i64) -> i64 {
    if modulus > 0 { value.rem_euclid(modulus) } else { value }
}

/// Unrolls a counter that wraps into one that does not, without drift.
///
/// Between two updates the counter may move by less than half its modulus; exactly half counts as backward.
/// The sum of all steps is a pure integer, so no number of wraps loses a count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrapTracker {
    /// Above one; at most 2^64.
    modulus: i128,
    last: Option<i64>,
    total: i64,
}

impl WrapTracker {
    /// For a counter that wraps every `modulus` counts, or `None` when that is less than two.
    pub fn new(modulus: i64) -> Option<Self> {
        (modulus >= 2).then_some(Self { modulus: i128::from(modulus), last: None, total: 0 })
    }

    /// For a counter of `bits` bits, signed or not, or `None` unless there are 1 to 64.
    pub fn of_bits(bits: u32) -> Option<Self> {
        (1..=64).contains(&bits).then(|| Self { modulus: 1 << bits, last: None, total: 0 })
    }

    /// Takes the counter and returns the unrolled count. The first value is taken as it is.
    ///
    /// The unrolled count wraps at 64 bits, which a machine does not reach.
    #[inline]
    pub fn update(&mut self, raw: i64) -> i64 {
        let Some(last) = self.last.replace(raw) else {
            self.total = raw;
            return raw;
        };
        let step = match (i64::try_from(self.modulus), raw.checked_sub(last)) {
            (Ok(modulus), Some(difference)) => short_step(difference, modulus),
            _ => self.long_step(i128::from(raw) - i128::from(last)),
        };
        self.total = self.total.wrapping_add(step);
        self.total
    }

    /// The shorter way round for a difference of any counters.
    #[cold]
    #[inline(never)]
    fn long_step(&self, difference: i128) -> i64 {
        let step = difference.rem_euclid(self.modulus);
        let step = if step >= self.modulus - step { step - self.modulus } else { step };
        // Half of at most 2^64, so it fits 64 bits.
        i64::try_from(step).unwrap_or(0)
    }

    /// The unrolled count.
    pub const fn total(&self) -> i64 {
        self.total
    }

    /// Sets the unrolled count, keeping the counter's own place: a change of the reference.
    pub fn set_total(&mut self, total: i64) {
        self.total = total;
    }

    /// Moves the reference of the counter itself by `by` counts: the next value comes in the new reference, and what it
    /// has moved since the last one is distinguished from the change.
    pub fn shift(&mut self, by: i64) {
        self.last = self.last.map(|last| last.wrapping_add(by));
        self.total = self.total.wrapping_add(by);
    }

    /// Forgets where the counter was; the next value is taken as it is. After a loss of communication in
    /// which the counter may have moved by more than half its modulus.
    pub fn restart(&mut self) {
        self.last = None;
    }
}

/// The shorter way round, for counters and a modulus of 64 bits: those that a drive sends.
#[inline]
const fn short_step(difference: i64, modulus: i64) -> i64 {
    // Values that a drive sends lie within one modulus: no division for them.
    let step = if difference >= 0 && difference < modulus {
        difference
    } else if difference < 0 && difference >= -modulus {
        difference + modulus
    } else {
        difference.rem_euclid(modulus)
    };
    if step >= modulus - step { step - modulus } else { step }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ratio::Rounding;
    use proptest::prelude::*;

    #[test]
    fn a_revolution_is_a_thousand_million_nanounits() {
        let scaling = AxisScaling::new(UnitKind::Rotary, 1 << 20, 1).unwrap();
        assert_eq!(scaling.to_counts().apply(NANO, Rounding::Nearest), Ok(1 << 20));
        assert_eq!(scaling.from_counts().apply(1 << 19, Rounding::Nearest), Ok(NANO / 2));
        // A gear of 3 motor turns to 7 load turns: 3 * 1000 counts in 7 units.
        let geared = AxisScaling::new(UnitKind::Linear, 3_000, 7).unwrap();
        assert_eq!(geared.to_counts().apply(7 * NANO, Rounding::Nearest), Ok(3_000));
    }

    #[test]
    fn scaling_refuses_what_makes_no_sense() {
        for (counts, units) in [(0, 1), (1, 0), (-1, 1), (1, -1)] {
            assert_eq!(AxisScaling::new(UnitKind::Rotary, counts, units), None);
        }
        assert_eq!(AxisScaling::new(UnitKind::Rotary, 1, i64::MAX), None, "denominator beyond 64 bits");
    }

    #[test]
    fn folding_is_always_inside() {
        assert_eq!([-1, 0, 359, 360, 361, -721].map(|value| fold(value, 360)), [359, 0, 359, 0, 1, 359]);
        assert_eq!(fold(i64::MIN, 7), i64::MIN.rem_euclid(7));
        assert_eq!(fold(-5, 0), -5);
    }

    #[test]
    fn the_first_value_stands_and_half_a_turn_counts_backward() {
        let mut tracker = WrapTracker::new(10).unwrap();
        assert_eq!([7, 9, 1, 6, 1].map(|raw| tracker.update(raw)), [7, 9, 11, 6, 1]);
        tracker.set_total(100);
        assert_eq!(tracker.update(2), 101);
        tracker.restart();
        assert_eq!(tracker.update(9), 9);
        assert_eq!(
            (WrapTracker::new(1), WrapTracker::of_bits(0), WrapTracker::of_bits(65)),
            (None, None, None)
        );
    }

    #[test]
    fn counters_of_full_width_wrap() {
        let mut tracker = WrapTracker::of_bits(64).unwrap();
        tracker.update(i64::MAX);
        assert_eq!(tracker.update(i64::MIN), i64::MIN, "one step on, and the unrolled count wraps too");
        let mut tracker = WrapTracker::of_bits(16).unwrap();
        assert_eq!(
            [32_767, -32_768, -32_767, 32_766].map(|raw| tracker.update(raw)),
            [32_767, 32_768, 32_769, 32_766]
        );
    }

    /// Ten million steps of any size below half the modulus, with about a million wraps: not one count is
    /// lost.
    #[test]
    fn ten_million_steps_do_not_drift() {
        let modulus = 1_000_003_i64;
        let mut tracker = WrapTracker::new(modulus).unwrap();
        let mut random = 0x9E37_79B9_7F4A_7C15_u64;
        let (mut truth, mut wraps) = (tracker.update(0), 0_u32);
        for _ in 0..10_000_000 {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            let step = i64::try_from(random % 1_000_001).unwrap() - 400_000;
            let step = step.clamp(-500_001, 500_001);
            let before = truth.div_euclid(modulus);
            truth += step;
            wraps += u32::from(truth.div_euclid(modulus) != before);
            tracker.update(fold(truth, modulus));
        }
        assert_eq!(tracker.total(), truth);
        assert!(wraps > 1_000_000, "{wraps}");
    }

    proptest! {
        #[test]
        fn short_and_long_steps_agree(difference in any::<i64>(), modulus in 2..i64::MAX, shift in 0..62_u32) {
            let modulus = (modulus >> shift).max(2);
            let tracker = WrapTracker::new(modulus).unwrap();
            for difference in [difference, difference >> shift, modulus, -modulus, modulus - 1, 1 - modulus, modulus / 2] {
                prop_assert_eq!(short_step(difference, modulus), tracker.long_step(i128::from(difference)));
            }
        }

        #[test]
        fn any_modulus_unrolls(
            modulus in 3..i64::MAX, start in 0..i64::MAX,
            steps in prop::collection::vec(-1.0..1.0_f64, 1..50),
        ) {
            let mut tracker = WrapTracker::new(modulus).unwrap();
            let start = fold(start, modulus);
            let mut truth = i128::from(tracker.update(start));
            for part in steps {
                // Below half the modulus and below 2^54, so that the double holds it.
                let half = crate::cast::f64_from_i64(((modulus - 1) / 2).min(1 << 54));
                let step = i128::from(crate::cast::i64_from_f64(part * half * 0.999));
                truth += step;
                let raw = i64::try_from(truth.rem_euclid(i128::from(modulus))).unwrap();
                let total = tracker.update(raw);
                prop_assert_eq!(i128::from(total), truth);
                if i64::try_from(truth).is_err() { break; }
            }
        }
    }
}
