//! How late the calls of the engine are: a histogram of counters with fixed bounds.

use profile_generic::time::DurationNs;

/// Upper bounds of the classes, ns: from what a tuned real-time kernel keeps to what an ordinary host under load does. Calls that are
/// later than the last one have a class of their own.
pub const BOUNDS_NS: [u32; 11] = [
    10_000,
    20_000,
    50_000,
    100_000,
    200_000,
    500_000,
    1_000_000,
    2_000_000,
    5_000_000,
    10_000_000,
    100_000_000,
];

/// Classes: one for each bound, and one above.
pub const CLASSES: usize = BOUNDS_NS.len() + 1;

/// Words in the published form.
pub(super) const LATENESS_WORDS: usize = CLASSES + 1;

/// Calls of the engine since the start, by how late they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lateness {
    /// Calls in each class: late by at most its bound, and by more than the bound before.
    pub counts: [u64; CLASSES],
    /// Lateness of all calls together, ns.
    pub sum_ns: u64,
}

impl Lateness {
    /// No call yet.
    pub const NONE: Self = Self { counts: [0; CLASSES], sum_ns: 0 };

    /// Counts a call. A lateness below zero counts as none.
    pub fn count(&mut self, late: DurationNs) {
        let late = u64::try_from(late.as_nanos()).unwrap_or(0);
        let class = BOUNDS_NS.partition_point(|bound| u64::from(*bound) < late);
        self.counts[class] += 1;
        self.sum_ns = self.sum_ns.saturating_add(late);
    }

    pub(super) fn to_words(self) -> [u64; LATENESS_WORDS] {
        let mut words = [self.sum_ns; LATENESS_WORDS];
        words[..CLASSES].copy_from_slice(&self.counts);
        words
    }

    pub(super) fn from_words(words: &[u64; LATENESS_WORDS]) -> Self {
        let [counts @ .., sum_ns] = *words;
        Self { counts, sum_ns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn call_is_counted_up_to_and_with_its_bound() {
        let mut lateness = Lateness::NONE;
        for nanos in [-5, 0, 10_000, 10_001, 20_000, 100_000_000, 100_000_001, i64::MAX] {
            lateness.count(DurationNs(nanos));
        }
        assert_eq!(lateness.counts, [3, 2, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2]);
        assert_eq!(lateness.sum_ns, 10_000 + 10_001 + 20_000 + 200_000_001 + i64::MAX.unsigned_abs());
        assert_eq!(Lateness::from_words(&lateness.to_words()), lateness);
    }
}
