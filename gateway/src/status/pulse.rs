//! Whether the cycle thread is alive: it publishes its status, and each publication has another uptime.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use profile_generic::time::DurationNs;

use super::{BoxState, BoxStatus};

/// Least age of the published status that means that the cycle thread has stopped. It publishes every 10 ms, or every cycle of
/// its fastest bus.
const SILENCE: Duration = Duration::from_secs(1);

/// Cycles without publication that mean the same, for slow buses.
const SILENT_CYCLES: u32 = 4;

/// Why the cycle thread is not alive whose published status has not changed for `age`; `None` while it is.
#[must_use]
pub fn silence(status: &BoxStatus, age: Duration) -> Option<String> {
    if status.state == BoxState::STARTING {
        return Some("the cycle thread has not started yet".to_owned());
    }
    let slow = Duration::from_nanos(u64::from(status.cycle_time_ns)) * SILENT_CYCLES;
    let late = age > SILENCE.max(slow);
    late.then(|| format!("the cycle thread has published nothing for {} s", age.as_secs()))
}

/// Since when the published status is the same.
#[derive(Debug)]
pub struct Heartbeat {
    uptime: DurationNs,
    since: Instant,
}

impl Heartbeat {
    /// Begins to watch.
    #[must_use]
    pub fn new(now: Instant) -> Self {
        Self { uptime: DurationNs::ZERO, since: now }
    }

    /// Takes the uptime of a status, which each publication changes, and returns for how long it has been the same.
    pub fn age(&mut self, now: Instant, uptime: DurationNs) -> Duration {
        if self.uptime != uptime {
            *self = Self { uptime, since: now };
        }
        now.saturating_duration_since(self.since)
    }
}

/// A [`Heartbeat`] for several who look at the status. The age counts from the first look at it: somebody has to look regularly.
#[derive(Debug)]
pub struct Pulse(Mutex<Heartbeat>);

impl Default for Pulse {
    fn default() -> Self {
        Self(Mutex::new(Heartbeat::new(Instant::now())))
    }
}

impl Pulse {
    /// For how long this status has been the same.
    pub fn age(&self, status: &BoxStatus) -> Duration {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).age(Instant::now(), status.uptime)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn age_counts_from_the_last_change_of_uptime() {
        let start = Instant::now();
        let mut heartbeat = Heartbeat::new(start);
        let mut age = |millis, uptime| {
            heartbeat.age(start + Duration::from_millis(millis), DurationNs(uptime)).as_millis()
        };
        assert_eq!([age(5, 0), age(7, 1), age(9, 1), age(30, 1), age(31, 2)], [5, 0, 2, 23, 0]);
    }
}
