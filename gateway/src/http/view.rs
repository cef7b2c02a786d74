//! What the server sees of the gateway: the published status, system time, and the names.

use std::sync::{Mutex, PoisonError};
use std::time::{Instant, SystemTime};

use schemars::JsonSchema;
use serde::Serialize;

use super::health::{Health, Heartbeat};
use crate::latest::Reader;
use crate::local::installation::Installation;
use crate::local::overview::Overview;
use crate::status::BoxStatus;
use crate::time::source::TimeView;

/// A view of a running gateway.
#[derive(Debug)]
pub struct View {
    installation: Installation,
    status: Reader<BoxStatus>,
    time: TimeView,
    started: SystemTime,
    /// Of the published status. Only the server's thread takes the lock.
    heartbeat: Mutex<Heartbeat>,
}

/// What was seen at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Look {
    /// Whether the gateway is alive and ready.
    pub health: Health,
    /// The state of the whole gateway.
    pub status: Overview,
}

impl View {
    /// A view of a gateway that has started at `started`.
    #[must_use]
    pub fn new(
        installation: Installation,
        status: Reader<BoxStatus>,
        time: TimeView,
        started: SystemTime,
    ) -> Self {
        let heartbeat = Mutex::new(Heartbeat::new(Instant::now()));
        Self { installation, status, time, started, heartbeat }
    }

    /// When the gateway has started.
    #[must_use]
    pub fn started(&self) -> SystemTime {
        self.started
    }

    /// Looks at the gateway.
    #[must_use]
    pub fn look(&self) -> Look {
        let status = self.status.read();
        let mut heartbeat = self.heartbeat.lock().unwrap_or_else(PoisonError::into_inner);
        let age = heartbeat.age(Instant::now(), status.uptime);
        drop(heartbeat);
        let overview = Overview::of(&self.installation, &status, &self.time.read());
        Look { health: Health::of(&status, age, &overview), status: overview }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::time::Duration;

    use super::*;
    use crate::latest::{Publisher, latest};
    use crate::local::installation::tests::installation as names;
    use crate::status::tests::distinct;
    use crate::time::status::tests::synchronized;

    /// The names of the gateway of [`distinct`], with a name that has to be escaped.
    pub fn installation() -> Installation {
        Installation { name: "cell \"4\"".to_owned(), ..names() }
    }

    /// A view of [`distinct`], and the end where another status can be published.
    pub fn view() -> (View, Publisher<BoxStatus>) {
        let (publisher, reader) = latest(distinct());
        let started = SystemTime::UNIX_EPOCH + Duration::from_millis(1_700_000_000_250);
        (View::new(installation(), reader, TimeView::of(synchronized()), started), publisher)
    }

    #[test]
    fn look_shows_the_status_that_was_published_last() {
        let (view, mut publisher) = view();
        let look = view.look();
        assert_eq!(look.status, Overview::of(&installation(), &distinct(), &synchronized()));
        assert!(look.health.alive && !look.health.ready);
        let mut next = distinct();
        next.axes[1] = next.axes[0];
        next.buses[1].up = true;
        publisher.publish(&next);
        let look = view.look();
        assert!(look.health.ready && look.status.axes[1].fault.is_none(), "{look:?}");
    }
}
