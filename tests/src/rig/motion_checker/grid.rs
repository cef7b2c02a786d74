//! The grid of a bus: the nominal instants of its cycles, seen from when its frames were sent.

use profile_generic::time::{DurationNs, MonotonicTime};

/// Counts the cycles of a bus.
#[derive(Debug, Clone)]
pub struct Grid {
    cycle: DurationNs,
    /// The last cycle that was sent: its number and its nominal instant.
    last: Option<(i64, MonotonicTime)>,
}

impl Grid {
    /// A bus with this cycle time, that has not been seen yet.
    #[must_use]
    pub const fn new(cycle: DurationNs) -> Self {
        Self { cycle, last: None }
    }

    /// Time from one cycle to the next.
    #[must_use]
    pub const fn cycle(&self) -> DurationNs {
        self.cycle
    }

    /// Takes a cycle whose frames were sent at `at`; gives its number. `late` says whether they may have been sent late: then
    /// they are of the last instant of the grid, and those on time are on the grid.
    pub fn sent(&mut self, at: MonotonicTime, late: bool) -> i64 {
        let Some((number, nominal)) = self.last else {
            self.last = Some((0, at));
            return 0;
        };
        let (passed, cycle) = (at.since(nominal).0, self.cycle.0.max(1));
        let (cycles, nominal) = if late {
            let cycles = passed / cycle;
            (cycles, nominal + self.cycle * cycles)
        } else {
            ((passed + cycle / 2) / cycle, at)
        };
        let number = number + cycles.max(1);
        self.last = Some((number, nominal));
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_frames_belong_to_the_instant_before() {
        let mut grid = Grid::new(DurationNs(2_000));
        let mut sent = |at, late| grid.sent(MonotonicTime(at), late);
        assert_eq!(sent(10_000, false), 0);
        assert_eq!(sent(12_000, false), 1);
        assert_eq!(sent(15_900, true), 2, "1900 late");
        assert_eq!(sent(16_000, false), 3);
        assert_eq!(sent(23_500, true), 6, "three cycles without frames");
        assert_eq!(sent(24_010, true), 7);
        assert_eq!(sent(26_500, false), 8, "a bus that begins its grid anew");
        assert_eq!(sent(28_500, false), 9);
    }
}
