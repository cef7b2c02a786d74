//! How evenly a thread wakes that sleeps as the cycle thread does, and what that means for a bus.

use std::time::Duration;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::Verdict;
use crate::sys::clock;
use crate::sys::realtime::{self, Outcome};

/// Wakes that are kept at most: an hour of the longest cycles, some minutes of the shortest.
const WAKES_MAX: usize = 4_000_000;

/// The cycle of a bus, and what it bears.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cycle {
    /// Whose it is.
    pub what: String,
    /// Its length.
    pub time: DurationNs,
    /// How far the beginning of a cycle may lie off its time. On SERCOS III that is the declared jitter (S-0-1023).
    pub tolerance: DurationNs,
    /// Cycles in a row that may be lost.
    pub losses: u16,
}

/// What came of a cycle. A thread that always wakes late by the same time shifts the grid of the bus, and the slaves follow it:
/// what counts is how far a wake lies off the usual lateness.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Result {
    /// What was tried.
    pub cycle: Cycle,
    /// The usual lateness: as many wakes were earlier as later.
    pub usual: DurationNs,
    /// The latest wake.
    pub latest: DurationNs,
    /// How far each wake was off the usual lateness, the nearest first.
    off: Vec<DurationNs>,
    /// Cycles that were over before the thread woke.
    pub skipped: u64,
}

/// The longest trial of a cycle: as many wakes as are kept.
#[must_use]
pub fn longest(cycle: &Cycle) -> Duration {
    let wakes = i64::try_from(WAKES_MAX).unwrap_or(i64::MAX);
    Duration::from_nanos(cycle.time.as_nanos().saturating_mul(wakes).unsigned_abs())
}

/// Wakes at the beginning of each cycle for so long, on a thread of its own with what `request` asks of the kernel. Also says
/// what the kernel granted.
///
/// # Panics
/// When the system gives no thread.
#[must_use]
pub fn measure(cycle: Cycle, time: Duration, request: realtime::Request) -> (Vec<Outcome>, Result) {
    let period = u64::try_from(cycle.time.as_nanos()).unwrap_or(0).max(1);
    let count = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX) / period;
    let count = usize::try_from(count).unwrap_or(WAKES_MAX).clamp(1, WAKES_MAX);
    let work = move || {
        let report = realtime::apply(&request);
        let mut lateness = Vec::with_capacity(count);
        let (mut due, mut skipped) = (clock::monotonic_now().0 + period, 0);
        for _ in 0..count {
            if clock::sleep_until(MonotonicTime(due)).is_err() {
                break;
            }
            let late = clock::monotonic_now().0.saturating_sub(due);
            lateness.push(DurationNs(i64::try_from(late).unwrap_or(i64::MAX)));
            // As the master does it: what is over is not made up for, and the grid stays.
            let over = late / period;
            skipped += over;
            due += (over + 1) * period;
        }
        (report.outcomes().to_vec(), lateness, skipped)
    };
    let thread = std::thread::spawn(work).join();
    let (outcomes, lateness, skipped) = thread.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    (outcomes, Result::new(cycle, lateness, skipped))
}

impl Result {
    fn new(cycle: Cycle, mut lateness: Vec<DurationNs>, skipped: u64) -> Self {
        lateness.sort_unstable();
        let middle = |all: &[DurationNs]| all.get(all.len() / 2).copied().unwrap_or(DurationNs::ZERO);
        let usual = middle(&lateness);
        let latest = lateness.last().copied().unwrap_or(DurationNs::ZERO);
        lateness.iter_mut().for_each(|late| *late = DurationNs((*late - usual).as_nanos().abs()));
        lateness.sort_unstable();
        Self { cycle, usual, latest, off: lateness, skipped }
    }

    /// How often the thread woke.
    #[must_use]
    pub fn wakes(&self) -> usize {
        self.off.len()
    }

    /// So many thousandths of the wakes were not farther off the usual lateness than this.
    #[must_use]
    pub fn permille(&self, permille: usize) -> DurationNs {
        let at = (self.off.len() * permille).div_ceil(1000).saturating_sub(1);
        self.off.get(at).copied().unwrap_or(DurationNs::ZERO)
    }

    /// Wakes that were farther off than the bus bears.
    #[must_use]
    pub fn outside(&self) -> usize {
        self.off.len() - self.off.partition_point(|off| *off <= self.cycle.tolerance)
    }

    /// Cycles that the longest pause took.
    #[must_use]
    pub fn longest_gap(&self) -> i64 {
        self.latest.as_nanos() / self.cycle.time.as_nanos().max(1)
    }

    /// Good: no wake was farther off than the bus bears. Doubtful: less than one in a hundred was, and none so late that the bus
    /// is lost.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if self.longest_gap() > i64::from(self.cycle.losses) || self.permille(990) > self.cycle.tolerance {
            Verdict::Unfit
        } else if self.outside() > 0 {
            Verdict::Doubtful
        } else {
            Verdict::Good
        }
    }

    /// What the verdict rests on.
    #[must_use]
    pub fn reason(&self) -> String {
        let Cycle { time, tolerance, losses, .. } = &self.cycle;
        let gap = self.longest_gap();
        if gap > i64::from(*losses) {
            return format!(
                "a pause of {} takes {gap} cycles of {time}, and the bus allows {losses}",
                self.latest
            );
        }
        match self.outside() {
            0 => format!("no wake-up was more than {tolerance} off"),
            outside => format!("{outside} of {} wake-ups were more than {tolerance} off", self.wakes()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(lateness_us: &[i64], skipped: u64) -> Result {
        let cycle = Cycle {
            what: "a bus".to_owned(),
            time: DurationNs::from_millis(2),
            tolerance: DurationNs::from_micros(50),
            losses: 5,
        };
        Result::new(cycle, lateness_us.iter().copied().map(DurationNs::from_micros).collect(), skipped)
    }

    /// So many wakes that are late by 10 us, and these.
    fn with(others: &[i64], usual: usize) -> Result {
        result(&[&vec![10; usual], others].concat(), 0)
    }

    #[test]
    fn percentiles_are_of_what_lies_off_the_usual() {
        let all: Vec<i64> = (0..=1000).rev().collect();
        let result = result(&all, 0);
        let us = |permille| result.permille(permille).as_nanos() / 1000;
        assert_eq!((result.usual.as_nanos(), result.latest.as_nanos()), (500_000, 1_000_000));
        assert_eq!([0, 1, 500, 990, 1000].map(us), [0, 1, 250, 495, 500]);
        assert_eq!((result.wakes(), result.outside()), (1001, 900));
    }

    #[test]
    fn no_wakes_are_no_reason_to_panic() {
        let result = result(&[], 0);
        assert_eq!(
            (result.permille(990), result.latest, result.outside()),
            (DurationNs::ZERO, DurationNs::ZERO, 0)
        );
    }

    #[test]
    fn a_cycle_is_judged_by_what_its_bus_bears() {
        let rows = [
            (with(&[], 1000), Verdict::Good, "no wake-up was more than 50 us off"),
            // Always late is not uneven.
            (result(&[400; 1000], 0), Verdict::Good, "no wake-up was more than 50 us off"),
            (with(&[60], 1000), Verdict::Good, "no wake-up was more than 50 us off"),
            (with(&[61], 999), Verdict::Doubtful, "1 of 1000 wake-ups were more than 50 us off"),
            (with(&[9_000; 10], 990), Verdict::Doubtful, "10 of 1000 wake-ups were more than 50 us off"),
            (with(&[70; 11], 989), Verdict::Unfit, "11 of 1000 wake-ups were more than 50 us off"),
            // Six cycles are lost only when the pause is as long as six cycles.
            (with(&[11_999], 999), Verdict::Doubtful, "1 of 1000 wake-ups were more than 50 us off"),
            (
                with(&[12_000], 999),
                Verdict::Unfit,
                "a pause of 12 ms takes 6 cycles of 2 ms, and the bus allows 5",
            ),
        ];
        for (result, verdict, reason) in rows {
            assert_eq!((result.verdict(), result.reason().as_str()), (verdict, reason));
        }
    }

    #[test]
    fn the_longest_trial_is_an_hour_of_a_millisecond_and_two_minutes_of_the_shortest_cycle() {
        let of = |micros: i64, nanos: i64| {
            let time = DurationNs(micros * 1_000 + nanos);
            longest(&Cycle { time, ..result(&[], 0).cycle })
        };
        assert_eq!((of(1_000, 0).as_secs(), of(31, 250).as_secs()), (4_000, 125));
    }

    #[test]
    fn the_grid_stays_and_every_wake_is_counted() {
        let cycle = Cycle { time: DurationNs::from_millis(1), ..result(&[], 0).cycle };
        let start = clock::monotonic_now();
        let (outcomes, result) = measure(cycle, Duration::from_millis(30), realtime::Request::default());
        let took = clock::monotonic_now().since(start);
        assert_eq!(result.wakes(), 30);
        assert!(took.as_nanos() >= 30_000_000, "each wake comes at its time and not before: {took}");
        assert_eq!(outcomes.len(), 1, "the timer slack is always asked for");
        assert!(result.latest >= result.usual);
    }
}
