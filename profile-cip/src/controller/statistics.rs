//! Spans of time in figures.

use core::fmt;

use profile_generic::time::DurationNs;

/// Smallest, largest and mean of many spans.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Spread {
    /// How many there were.
    pub count: u64,
    /// The smallest.
    pub min: DurationNs,
    /// The largest.
    pub max: DurationNs,
    sum: i128,
}

impl Spread {
    pub(super) fn add(&mut self, span: DurationNs) {
        self.min = if self.count == 0 { span } else { self.min.min(span) };
        self.max = if self.count == 0 { span } else { self.max.max(span) };
        self.sum += i128::from(span.0);
        self.count += 1;
    }

    /// The mean; zero when there were none.
    #[must_use]
    pub fn mean(&self) -> DurationNs {
        let mean = self.sum / i128::from(self.count.max(1));
        DurationNs(i64::try_from(mean).unwrap_or(i64::MAX))
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}, mean {}", self.min, self.max, self.mean())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_three_spans() {
        let mut spread = Spread::default();
        assert_eq!(spread.mean(), DurationNs::ZERO);
        for span in [3, -1, 7] {
            spread.add(DurationNs(span));
        }
        assert_eq!((spread.count, spread.min.0, spread.max.0, spread.mean().0), (3, -1, 7, 3));
    }
}
