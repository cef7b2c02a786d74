//! How well the host of a test keeps time.
//!
//! Processes that drive a bus in real time stop their axes when the host stops them: rightly so, and it says nothing about
//! what a test asks. Such a test runs again, visibly. Where the host kept time a failure is a failure.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// A pause of the host that may stop an axis: the slaves of the examples as they are shipped fall out of their line after five cycles of
/// 2 ms, and the watch sees less of a pause than the process that it hits.
const PAUSE: Duration = Duration::from_millis(6);

/// Read while a test of processes in real time runs beside others, written while one runs alone: on a small host they may disturb
/// each other.
static BESIDE: RwLock<()> = RwLock::new(());

/// Runs of a test on a host that pauses in each of them.
const ATTEMPTS: u32 = 6;

/// How often the watch looks at the clock.
const INTERVAL: Duration = Duration::from_millis(2);

/// One thread for each processor that sees how long the host leaves it waiting: a host may take one processor away and leave
/// the others.
struct Watch {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Duration>>,
}

impl Watch {
    fn start() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let threads = processors()
            .into_iter()
            .map(|processor| {
                let stop = Arc::clone(&stop);
                std::thread::spawn(move || {
                    // Where the host refuses, the thread watches the processors that it is given.
                    let _ = processor.map(|processor| sched_setaffinity(None, &processor));
                    longest_pause(&stop)
                })
            })
            .collect();
        Self { stop, threads }
    }

    fn longest_pause(self) -> Duration {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.into_iter().map(|thread| thread.join().unwrap_or_default()).max().unwrap_or_default()
    }
}

/// The processors that this process may run on, each as a set of its own; one `None` where the system does not say.
fn processors() -> Vec<Option<CpuSet>> {
    let Ok(all) = sched_getaffinity(None) else { return vec![None] };
    let one = |processor| {
        let mut set = CpuSet::new();
        set.set(processor);
        set
    };
    (0..CpuSet::MAX_CPU)
        .filter(|&processor| all.is_set(processor))
        .map(|processor| Some(one(processor)))
        .collect()
}

/// Sleeps for short times until `stop` is set. Gives the longest time by which a sleep was too long.
fn longest_pause(stop: &AtomicBool) -> Duration {
    let mut longest = Duration::ZERO;
    let mut last = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(INTERVAL);
        let now = Instant::now();
        longest = longest.max(now.duration_since(last).saturating_sub(INTERVAL));
        last = now;
    }
    longest
}

/// Says past the test harness's capture why a test runs again.
fn again(test: &str, why: &str) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "AGAIN {test}: {why}");
}

/// Runs a test of processes in real time beside others of this program. If it fails it runs again, as one
/// [alone](alone_in_real_time).
///
/// # Panics
/// As `run` does.
pub fn in_real_time(test: &str, run: impl Fn()) {
    let beside = BESIDE.read().unwrap_or_else(PoisonError::into_inner);
    let is_good = catch_unwind(AssertUnwindSafe(&run)).is_ok();
    drop(beside);
    if !is_good {
        again(test, "it failed beside another test");
        alone_in_real_time(test, run);
    }
}

/// Runs a test of processes in real time, alone among those of this program, and again (six runs at most) when it failed while
/// the host paused for 6 ms or more.
///
/// # Panics
/// As `run` does.
pub fn alone_in_real_time(test: &str, run: impl Fn()) {
    let tell = |paused: Duration| again(test, &format!("the host paused for {paused:?} meanwhile"));
    let watch = || {
        let watch = Watch::start();
        || watch.longest_pause()
    };
    let _alone = BESIDE.write().unwrap_or_else(PoisonError::into_inner);
    watched(run, watch, tell);
}

/// `watch` starts to watch the host; what it returns tells the longest pause since. `tell` gets to know why a run is repeated.
fn watched<W: FnOnce() -> Duration>(run: impl Fn(), watch: impl Fn() -> W, tell: impl Fn(Duration)) {
    for attempt in 1.. {
        let longest_pause = watch();
        let result = catch_unwind(AssertUnwindSafe(&run));
        let paused = longest_pause();
        let Err(panic) = result else { return };
        if paused < PAUSE || attempt == ATTEMPTS {
            resume_unwind(panic);
        }
        tell(paused);
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Runs of a test that fails so many times on a host with this longest pause, and whether it fails in the end.
    fn runs(failures: u32, pause: Duration) -> (u32, bool) {
        let runs = Cell::new(0);
        let run = || {
            runs.set(runs.get() + 1);
            assert!(runs.get() > failures, "on purpose");
        };
        let result = catch_unwind(AssertUnwindSafe(|| watched(run, || || pause, |_| {})));
        (runs.get(), result.is_err())
    }

    #[test]
    fn only_a_failure_on_a_host_that_pauses_is_tried_again() {
        assert_eq!(runs(0, PAUSE), (1, false));
        assert_eq!(runs(1, PAUSE), (2, false));
        assert_eq!(runs(9, PAUSE), (ATTEMPTS, true), "the last failure counts");
        assert_eq!(
            runs(1, PAUSE - Duration::from_nanos(1)),
            (1, true),
            "where the host kept time it counts at once"
        );
    }

    #[test]
    fn what_fails_beside_others_runs_again_alone_and_its_failure_there_counts() {
        for (failures, runs_expected, fails) in [(0, 1, false), (1, 2, false)] {
            let runs = Cell::new(0);
            let run = || {
                runs.set(runs.get() + 1);
                assert!(runs.get() > failures, "on purpose");
            };
            let result = catch_unwind(AssertUnwindSafe(|| in_real_time("on purpose", run)));
            assert_eq!((runs.get(), result.is_err()), (runs_expected, fails));
        }
        let result = catch_unwind(|| in_real_time("on purpose", || panic!("on purpose")));
        assert!(result.is_err());
    }

    #[test]
    fn the_watch_ends_and_tells() {
        let watch = Watch::start();
        assert_eq!(watch.threads.len(), std::thread::available_parallelism().map_or(1, Into::into));
        std::thread::sleep(Duration::from_millis(5));
        assert!(watch.longest_pause() < Duration::from_secs(60));
    }
}
