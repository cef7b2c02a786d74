//! The polynomials of fine interpolation (CIP Volume 9, 5-2.6.5.2), in fixed point.
//!
//! With `s` the part of the segment that has passed, and the differences `d1`, `d2`, `d3` of the last values,
//! all of them are `base + (d1 - d2/2 - d3/6) s + (d2/2) s^2 + (d3/6) s^3`, of which lower orders leave out
//! the higher differences. The coefficients are held times six, so that they are whole.

use super::UpdateError;
use crate::time::DurationNs;

/// Binary places of the part of the segment that has passed.
const TIME_PLACES: u32 = 40;

/// The end of the segment.
const ONE: i128 = 1 << TIME_PLACES;

/// Binary places of intermediate results.
const VALUE_PLACES: u32 = 20;

/// The largest step between two values: some 17000 units in one period.
const MAX_STEP: i64 = 1 << 44;

/// The furthest a polynomial is followed, in lengths of its segment.
const MAX_LENGTHS: i128 = 8;

/// A polynomial over one segment. As steps are at most 2^44, the coefficients are below 2^49.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Polynomial {
    base: i64,
    first: i128,
    second: i128,
    third: i128,
    /// What an estimate for an update that was lost is away from the curve at the start. It is taken back evenly over the
    /// segment; behind its end the curve is that of the values that were sent.
    away: i64,
}

impl Polynomial {
    const fn constant(base: i64) -> Self {
        Self { base, first: 0, second: 0, third: 0, away: 0 }
    }

    const fn new(base: i64, d1: i128, d2: i128, d3: i128) -> Self {
        Self { base, first: 6 * d1 - 3 * d2 - d3, second: 3 * d2, third: d3, away: 0 }
    }

    /// From `base` with a way of `velocity` in the length of the segment, which `acceleration` makes longer by half of
    /// itself.
    pub(super) fn moving(base: i64, velocity: i64, acceleration: i64) -> Self {
        let within = |value: i64| i128::from(value.clamp(-MAX_STEP, MAX_STEP));
        Self { base, first: 6 * within(velocity), second: 3 * within(acceleration), third: 0, away: 0 }
    }

    /// The value at a place, saturated.
    pub(super) fn value(&self, at: &Place) -> i64 {
        let part = at.part;
        // Below 2^49 with 20 places; the part of at most 8 with 40 places takes that below 2^116 in the last
        // step.
        let sum = times(self.third << VALUE_PLACES, part) + (self.second << VALUE_PLACES);
        let sum = times(sum, part) + (self.first << VALUE_PLACES);
        let away = if self.away == 0 { 0 } else { times(i128::from(self.away), (ONE - part).max(0)) };
        saturate(i128::from(self.base) + away + rounded_value(times(sum, part), 6))
    }

    /// The derivative at a place, per second, saturated.
    pub(super) fn slope_per_second(&self, at: &Place) -> i64 {
        let Place { part, length } = *at;
        let sum = times((3 * self.third) << VALUE_PLACES, part) + ((2 * self.second) << VALUE_PLACES);
        let back = if part < ONE { (6 * i128::from(self.away)) << VALUE_PLACES } else { 0 };
        let per_segment = times(sum, part) + (self.first << VALUE_PLACES) - back;
        // Below 2^90 with 20 places; a second is below 2^30 nanoseconds.
        let per_second = per_segment.saturating_mul(1_000_000_000);
        saturate(rounded_value(per_second, 6 * i128::from(length.0)))
    }

    /// The second derivative at a place, per second squared.
    pub(super) fn bend_per_second(&self, at: &Place) -> i64 {
        let Place { part, length } = *at;
        let per_segment = times((6 * self.third) << VALUE_PLACES, part) + ((2 * self.second) << VALUE_PLACES);
        // In two steps, each of which stays below 2^120: the value is below 2^70, a second below 2^30 nanoseconds.
        let per_second = rounded(per_segment.saturating_mul(1_000_000_000), i128::from(length.0));
        saturate(rounded_value(per_second.saturating_mul(1_000_000_000), 6 * i128::from(length.0)))
    }
}

/// How far along a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// The part of the segment that has passed, with [`TIME_PLACES`] places.
    part: i128,
    length: DurationNs,
}

impl Place {
    /// `elapsed` after the start of a segment of this length; before the start, at the start.
    pub(super) fn new(elapsed: DurationNs, length: DurationNs) -> Self {
        let part = rounded(i128::from(elapsed.0) << TIME_PLACES, i128::from(length.0));
        Self { part: part.clamp(0, MAX_LENGTHS << TIME_PLACES), length }
    }
}

fn times(value: i128, part: i128) -> i128 {
    rounded(value * part, 1 << TIME_PLACES)
}

/// A value with [`VALUE_PLACES`] places over `den`, to the nearest, ties away from zero; `den` is above zero. The quotient of
/// what is left without the places is the same, and mostly one of 64 bits.
#[inline]
fn rounded_value(num: i128, den: i128) -> i128 {
    let half = den.unsigned_abs() << (VALUE_PLACES - 1);
    let whole = num.unsigned_abs().saturating_add(half) >> VALUE_PLACES;
    let quotient = match (u64::try_from(whole), u64::try_from(den)) {
        (Ok(whole), Ok(den)) => i128::from(whole / den),
        _ => i128::try_from(whole / den.unsigned_abs()).unwrap_or(i128::MAX),
    };
    if num < 0 { -quotient } else { quotient }
}

/// The quotient to the nearest, ties away from zero; `den` is above zero.
#[inline]
fn rounded(num: i128, den: i128) -> i128 {
    if let (Ok(num), Ok(den)) = (i64::try_from(num), i64::try_from(den)) {
        // Nearly always: one division of the processor in place of one of the library.
        let (quotient, rest) = (num / den, num % den);
        let up = rest.unsigned_abs() >= den.unsigned_abs() - rest.unsigned_abs();
        return i128::from(quotient) + if up { i128::from(num.signum()) } else { 0 };
    }
    let half = den / 2;
    if num >= 0 { (num + half) / den } else { (num - half) / den }
}

fn saturate(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value > 0 { i64::MAX } else { i64::MIN })
}

/// The last values of one kind of set-point; makes polynomials of at most `ORDER`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Channel<const ORDER: usize> {
    /// The newest first. Values of updates that were lost are those of the curve through the ones that were sent.
    values: [i64; 4],
    known: usize,
    /// Updates that were lost since the newest value, and where the set-point was led to for the last of them.
    lost: Option<(i64, i64)>,
}

impl<const ORDER: usize> Channel<ORDER> {
    /// A channel that knows one value, or none.
    pub(super) fn starting_at(value: Option<i64>) -> Self {
        let mut channel = Self::default();
        channel.fill(value);
        channel
    }

    /// Takes a value that nobody sent: the start, or those of the motion that is gone on from. It is held within the largest
    /// step, so that the bounds of the polynomials hold whatever it is.
    pub(super) fn fill(&mut self, value: Option<i64>) {
        if let Some(value) = value {
            let value = if self.known > 0 { near(value, self.values[0]) } else { value };
            self.shift(value);
        }
    }

    /// An update was lost; the set-point was led to `estimate` in its place. Estimates are held within the largest step too.
    pub(super) fn lose(&mut self, estimate: Option<i64>) {
        if let Some(estimate) = estimate.filter(|_| self.known > 0) {
            let (count, before) = self.lost.unwrap_or((0, self.values[0]));
            self.lost = Some((count + 1, near(estimate, before)));
        }
    }

    fn shift(&mut self, value: i64) {
        self.values.rotate_right(1);
        self.values[0] = value;
        self.known = (self.known + 1).min(self.values.len());
    }

    /// Puts the values between the newest and `value` in place of the `lost` ones: those of the parabola through the last two
    /// and `value`, or of the straight line where only one is known.
    fn mend(&mut self, lost: i64, value: i64) {
        let [newest, before, ..] = self.values;
        // Periods since `newest` until `value`, and the differences from `newest`.
        let all = i128::from(lost) + 1;
        let rise = i128::from(value) - i128::from(newest);
        let fall = if self.known > 1 { i128::from(newest) - i128::from(before) } else { 0 };
        // Behind `newest` by k: k/all of the rise, and what the bend of the parabola puts in between.
        let bend = if self.known > 1 { rise - all * fall } else { 0 };
        for passed in 1..all {
            let straight = rounded(rise * passed, all);
            let bent = rounded(bend * passed * (passed - all), all * (all + 1));
            let mended = saturate(i128::from(newest) + straight + bent);
            self.shift(near(mended, self.values[0]));
        }
    }

    /// Takes a value that was sent and returns the polynomial that leads to it. A value that is absent makes
    /// the channel forget its past.
    pub(super) fn push(
        &mut self,
        value: Option<i64>,
        immediate: bool,
    ) -> Result<Option<Polynomial>, UpdateError> {
        let Some(value) = value else {
            *self = Self::default();
            return Ok(None);
        };
        let lost = self.lost.take();
        let start = lost.map_or(self.values[0], |(_, estimate)| estimate);
        if self.known > 0 && start.abs_diff(value) > MAX_STEP.unsigned_abs() {
            return Err(UpdateError::Jump);
        }
        if let Some((lost, _)) = lost {
            self.mend(lost, value);
        }
        self.shift(value);
        let order = if immediate { 0 } else { ORDER.min(self.known - 1) };
        let [v0, v1, v2, v3] = self.values.map(i128::from);
        let d1 = v0 - v1;
        let d2 = if order >= 2 { v0 - 2 * v1 + v2 } else { 0 };
        let d3 = if order >= 3 { v0 - 3 * v1 + 3 * v2 - v3 } else { 0 };
        let [newest, before, ..] = self.values;
        if order == 0 {
            return Ok(Some(Polynomial::constant(newest)));
        }
        let away = if lost.is_some() { start.saturating_sub(before) } else { 0 };
        Ok(Some(Polynomial { away, ..Polynomial::new(before, d1, d2, d3) }))
    }
}

/// The value nearest to `value` that is no further than the largest step from `from`.
fn near(value: i64, from: i64) -> i64 {
    value.clamp(from.saturating_sub(MAX_STEP), from.saturating_add(MAX_STEP))
}
