//! Conversions between counts, floating point values and times, with their bounds stated.

use profile_generic::time::DurationNs;

/// A count as a floating point number; beyond 2^53 the nearest one.
#[expect(clippy::cast_precision_loss, reason = "the nearest number is what is wanted")]
pub(super) const fn float(counts: i64) -> f64 {
    counts as f64
}

/// A distance between counts as a floating point number; beyond 2^53 the nearest one.
#[expect(clippy::cast_precision_loss, reason = "the nearest number is what is wanted")]
pub(super) const fn distance(counts: u64) -> f64 {
    counts as f64
}

/// A floating point value rounded to the nearest count, ties away from zero; beyond the range its end.
#[expect(clippy::cast_possible_truncation, reason = "rounded before, and the cast saturates")]
pub(super) fn counts(value: f64) -> i64 {
    value.round() as i64
}

/// A value as the REAL of the connection; too large becomes infinite, which the limits of a profile rule out.
#[expect(clippy::cast_possible_truncation, reason = "REAL is what the connection carries")]
pub(super) const fn real(value: f64) -> f32 {
    value as f32
}

/// A span of time in seconds.
pub(super) const fn seconds(span: DurationNs) -> f64 {
    float(span.0) / 1e9
}

/// Seconds as a span of time; negative and not-a-number become zero, too long the longest.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
pub(super) fn span(seconds: f64) -> DurationNs {
    DurationNs((seconds.max(0.0) * 1e9) as i64)
}

/// The position whose low 32 bits are `raw` and that lies nearest to `near`: a rolled-over DINT unrolled.
pub(super) const fn unroll(near: i64, raw: i32) -> i64 {
    let [a, b, c, d, ..] = near.to_le_bytes();
    let low = i32::from_le_bytes([a, b, c, d]);
    near.wrapping_add(raw.wrapping_sub(low) as i64)
}

/// The low 32 bits of a position: a position as DINT.
pub(super) const fn roll(position: i64) -> i32 {
    let [a, b, c, d, ..] = position.to_le_bytes();
    i32::from_le_bytes([a, b, c, d])
}

/// A position within a cycle of `unwind` counts, and its cycle.
pub(super) fn fold(position: f64, unwind: u32) -> (f64, i32) {
    let unwind = f64::from(unwind);
    let within = position.rem_euclid(unwind);
    // Rounding may lead to the very end of the cycle, which is the beginning of the next.
    let within = if within < unwind { within } else { 0.0 };
    (within, roll(counts((position - within) / unwind)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_unroll_over_the_end_of_a_dint() {
        assert_eq!(unroll(i64::from(i32::MAX), i32::MIN), i64::from(i32::MAX) + 1);
        assert_eq!(unroll(i64::from(i32::MIN), i32::MAX), i64::from(i32::MIN) - 1);
        assert_eq!(unroll(5_000_000_000, roll(5_000_000_123)), 5_000_000_123);
        assert_eq!(unroll(-5_000_000_000, roll(-5_000_000_123)), -5_000_000_123);
        assert_eq!(unroll(0, -7), -7);
        assert_eq!(roll(i64::from(i32::MAX) + 1), i32::MIN);
    }

    #[test]
    fn spans_and_counts_keep_to_their_ends() {
        assert_eq!(span(1.5), DurationNs(1_500_000_000));
        assert_eq!((span(-1.0), span(f64::NAN), span(1e30)), (DurationNs(0), DurationNs(0), DurationNs::MAX));
        assert_eq!((counts(2.5), counts(-2.5), counts(1e300)), (3, -3, i64::MAX));
        assert!((seconds(DurationNs(250_000_000)) - 0.25).abs() < 1e-15);
    }
}
