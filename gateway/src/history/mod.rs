//! What has happened: the last lines of the log, the faults of each axis, and what each axis has done in its life.
//!
//! ```text
//! tracing --line--> standard error
//!            \-----> EventRing  --> local socket, HTTP
//! notices of the cycle --> FaultHistory --> local socket, HTTP
//!                              \--------> file
//! published status --> CounterHistory --> file, and from there into the axes of the next run
//! ```
//!
//! They are fed outside the cycle. The ring is a layer of the logger, so that it has exactly the lines that are logged.

mod book;
mod counters;
mod event;
mod faults;
mod file;
mod layer;
mod record;
mod ring;

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

pub use self::counters::CounterHistory;
pub use self::event::LogEvent;
pub use self::faults::FaultHistory;
pub use self::layer::{LinesOf, RingLayer};
pub use self::record::{FaultEnd, FaultRecord};
pub use self::ring::{EventRing, LINES_MAX, LogQuery, Selection};

/// The histories of a gateway.
#[derive(Debug, Clone, Default)]
pub struct Histories {
    /// The last lines of the log.
    pub events: Arc<EventRing>,
    /// The faults of the axes.
    pub faults: Arc<FaultHistory>,
    /// The counters of the axes.
    pub counters: Arc<CounterHistory>,
}

impl Histories {
    /// The same with the files of a directory.
    #[must_use]
    pub fn kept_in(&self, directory: &Path) -> Self {
        Self {
            events: Arc::clone(&self.events),
            faults: Arc::new(FaultHistory::open(directory)),
            counters: Arc::new(CounterHistory::open(directory)),
        }
    }
}

/// The last second that RFC 3339 can name, since 1970.
const LAST_SECOND: Duration = Duration::from_secs(253_402_300_799);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A time of the host as text: UTC, RFC 3339, microseconds. A clock that is set beyond what the text can have is at its end.
pub(crate) fn utc(time: SystemTime) -> String {
    let since = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().min(LAST_SECOND);
    humantime::format_rfc3339_micros(SystemTime::UNIX_EPOCH + since).to_string()
}

/// The same of nanoseconds since 1970.
pub(crate) fn utc_nanos(nanos: u64) -> String {
    utc(SystemTime::UNIX_EPOCH + Duration::from_nanos(nanos))
}

/// The lines that this thread logs while `run` runs.
#[cfg(test)]
pub(crate) fn lines_of(run: impl FnOnce()) -> Vec<LogEvent> {
    use tracing_subscriber::layer::SubscriberExt as _;
    let ring = Arc::new(EventRing::default());
    let subscriber = tracing_subscriber::registry().with(RingLayer::new(Arc::clone(&ring)));
    tracing::subscriber::with_default(subscriber, run);
    let all = LogQuery { lines: LINES_MAX, ..LogQuery::default() };
    ring.select(&all).events.iter().map(|event| LogEvent::clone(event)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_of_a_clock_is_a_text() {
        let epoch = SystemTime::UNIX_EPOCH;
        for (time, text) in [
            (epoch + Duration::from_micros(1_795_822_878_463_237), "2026-11-27T23:41:18.463237Z"),
            (epoch, "1970-01-01T00:00:00.000000Z"),
            (epoch - Duration::from_secs(9), "1970-01-01T00:00:00.000000Z"),
            (epoch + 2 * LAST_SECOND, "9999-12-31T23:59:59.000000Z"),
        ] {
            assert_eq!(utc(time), text);
        }
    }
}
