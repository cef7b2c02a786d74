//! The grid of a bus: the nominal instants of its cycles, seen from when its frames were sent.

use profile_generic::cast::f64_from_i64;
use profile_generic::time::{DurationNs, MonotonicTime};

/// A cycle that is further off than this part of it is not pulled but another one.
const PULL_MAX: u64 = 100;

/// Counts the cycles of a bus.
#[derive(Debug, Clone)]
pub struct Grid {
    cycle: DurationNs,
    /// The last cycle that was sent: its number and its nominal instant.
    last: Option<(i64, MonotonicTime)>,
    /// The last one as it was sent, if that was on time.
    on_time: Option<MonotonicTime>,
    /// By which part of the cycle the last two that were on time were further apart than it, or closer.
    pull: f64,
}

impl Grid {
    /// A bus with this cycle time, that has not been seen yet.
    #[must_use]
    pub const fn new(cycle: DurationNs) -> Self {
        Self { cycle, last: None, on_time: None, pull: 0.0 }
    }

    /// Time from one cycle to the next.
    #[must_use]
    pub const fn cycle(&self) -> DurationNs {
        self.cycle
    }

    /// By which part of the cycle time the last cycle began before its nominal instant, or after: a bus that follows a clock of
    /// another rate, or is pulled to a grid. The drive takes it for the cycle time nevertheless.
    #[must_use]
    pub const fn pull(&self) -> f64 {
        self.pull
    }

    /// Takes a cycle whose frames were sent at `at`; gives its number. `late` says whether they may have been sent late: then
    /// they are of the last instant of the grid, and those on time are on the grid.
    pub fn sent(&mut self, at: MonotonicTime, late: bool) -> i64 {
        let before = std::mem::replace(&mut self.on_time, (!late).then_some(at));
        let apart = before.filter(|_| !late).map_or(self.cycle, |before| at.since(before)) - self.cycle;
        let is_pull = apart.magnitude() < self.cycle.magnitude() / PULL_MAX;
        self.pull =
            if is_pull { f64_from_i64(apart.0).abs() / f64_from_i64(self.cycle.0.max(1)) } else { 0.0 };
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

    #[test]
    fn pull_is_what_two_cycles_on_time_are_apart_beside_the_cycle() {
        let mut grid = Grid::new(DurationNs(2_000));
        let mut pull = |at, late| {
            grid.sent(MonotonicTime(at), late);
            (grid.pull() * 1e4).round()
        };
        assert_eq!((pull(10_000, false), pull(12_001, false)), (0.0, 5.0));
        assert_eq!((pull(14_000, false), pull(16_000, false)), (5.0, 0.0));
        assert_eq!((pull(18_300, true), pull(20_000, false), pull(22_001, false)), (0.0, 0.0, 5.0));
        assert_eq!(pull(24_300, false), 0.0, "no pull but another grid");
    }
}
