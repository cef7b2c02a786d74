//! How well the host of a test keeps time.
//!
//! Processes that drive a bus in real time stop their axes when the host stops them: rightly so, and it says nothing about
//! what a test asks. Such a test runs again, visibly. Where the host kept time a failure is a failure.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A pause of the host that may stop an axis: some updates of a controller, some tens of bus cycles.
const PAUSE: Duration = Duration::from_millis(20);

/// Runs of a test on a host that pauses in each of them.
const ATTEMPTS: u32 = 3;

/// How often the watch looks at the clock.
const INTERVAL: Duration = Duration::from_millis(2);

/// A thread that sees how long the host leaves it waiting.
struct Watch {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Duration>,
}

impl Watch {
    fn start() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut longest = Duration::ZERO;
            let mut last = Instant::now();
            while !asked.load(Ordering::Relaxed) {
                std::thread::sleep(INTERVAL);
                let now = Instant::now();
                longest = longest.max(now.duration_since(last).saturating_sub(INTERVAL));
                last = now;
            }
            longest
        });
        Self { stop, thread }
    }

    fn longest_pause(self) -> Duration {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

/// Runs a test of processes in real time, and again (three times at most) when it failed while the host paused for 20 ms
/// or more.
///
/// # Panics
/// As `run` does.
pub fn in_real_time(test: &str, run: impl Fn()) {
    let tell = |paused: Duration| {
        // Past the test harness's capture.
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "AGAIN {test}: the host paused for {paused:?} meanwhile");
    };
    let watch = || {
        let watch = Watch::start();
        || watch.longest_pause()
    };
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
        assert_eq!(runs(9, PAUSE), (3, true), "the last failure counts");
        assert_eq!(
            runs(1, PAUSE - Duration::from_nanos(1)),
            (1, true),
            "where the host kept time it counts at once"
        );
    }

    #[test]
    fn the_watch_ends_and_tells() {
        let watch = Watch::start();
        std::thread::sleep(Duration::from_millis(5));
        assert!(watch.longest_pause() < Duration::from_secs(60));
    }
}
