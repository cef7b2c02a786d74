//! The instants of the cycles: when the next one begins, and when its frames go out.

use profile_generic::time::{DurationNs, MonotonicTime};

/// The grid of the cycles.
#[derive(Debug)]
pub(super) struct Grid {
    /// Start of the next cycle that is not built yet; in a silence its end.
    pub next_cycle: MonotonicTime,
    /// When the frames that are built go out.
    pub send_at: MonotonicTime,
    /// The frames of the last cycle were built and left out: nothing can have come back.
    pub left_out: bool,
    /// The frames that are out have been evaluated.
    pub evaluated: bool,
}

impl Grid {
    pub fn new() -> Grid {
        Grid {
            next_cycle: MonotonicTime::ZERO,
            send_at: MonotonicTime::ZERO,
            left_out: false,
            evaluated: true,
        }
    }

    /// Nothing is sent until this time.
    pub fn pause_until(&mut self, end: MonotonicTime) {
        self.evaluated = true;
        self.next_cycle = end;
    }

    /// A cycle is built that begins `now`: the next one follows on the same grid. Gives the number of cycles that are over and
    /// left out.
    pub fn built(&mut self, now: MonotonicTime, cycle: DurationNs) -> u64 {
        self.evaluated = false;
        self.send_at = now;
        self.next_cycle = self.next_cycle + cycle;
        let late = now - self.next_cycle;
        if late < DurationNs::ZERO { 0 } else { self.skip(late.as_nanos() / cycle.as_nanos() + 1, cycle) }
    }

    /// Leaves out the cycles that could only begin late, by more than half of one. Gives their number.
    pub fn skip_late(&mut self, now: MonotonicTime, cycle: DurationNs) -> u64 {
        if !is_late(now, self.next_cycle, cycle) {
            return 0;
        }
        let behind = now.since(self.next_cycle).as_nanos() + cycle.as_nanos() / 2;
        self.skip((behind / cycle.as_nanos()).max(1), cycle)
    }

    /// Moves the cycles that are not built yet.
    pub fn shift(&mut self, by: DurationNs) {
        self.next_cycle = self.next_cycle + by;
    }

    fn skip(&mut self, cycles: i64, cycle: DurationNs) -> u64 {
        self.next_cycle = self.next_cycle + cycle * cycles;
        cycles.unsigned_abs()
    }
}

/// Whether what had to begin `at` is late by more than half a cycle.
pub(super) fn is_late(now: MonotonicTime, at: MonotonicTime, cycle: DurationNs) -> bool {
    now.since(at).as_nanos() > cycle.as_nanos() / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: DurationNs = DurationNs(1_000);

    #[test]
    fn late_cycle_stays_on_the_grid() {
        let mut grid = Grid::new();
        grid.pause_until(MonotonicTime(5_000));
        assert_eq!(grid.built(MonotonicTime(5_300), CYCLE), 0);
        assert_eq!((grid.send_at, grid.next_cycle), (MonotonicTime(5_300), MonotonicTime(6_000)));
        assert!(!grid.evaluated);
        assert_eq!(grid.built(MonotonicTime(8_999), CYCLE), 2);
        assert_eq!(grid.next_cycle, MonotonicTime(9_000));
        assert_eq!(grid.built(MonotonicTime(10_000), CYCLE), 1);
        assert_eq!(grid.next_cycle, MonotonicTime(11_000));
    }

    #[test]
    fn cycle_is_left_out_from_half_a_cycle_on() {
        let mut grid = Grid::new();
        grid.pause_until(MonotonicTime(5_000));
        assert_eq!(grid.skip_late(MonotonicTime(5_500), CYCLE), 0);
        assert_eq!(grid.skip_late(MonotonicTime(5_501), CYCLE), 1);
        assert_eq!(grid.next_cycle, MonotonicTime(6_000));
        assert_eq!(grid.skip_late(MonotonicTime(8_600), CYCLE), 3);
        assert_eq!(grid.next_cycle, MonotonicTime(9_000));
    }
}
