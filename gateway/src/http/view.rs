//! What the server sees of the gateway: the published status, system time, and the names.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use schemars::JsonSchema;
use serde::Serialize;

use super::files::Files;
use super::health::Health;
use super::sheet::{AxisSheet, Sheets};
use super::traces::{AxisTraces, TimeTraces, Traces};
use crate::bundle::Sources;
use crate::history::{FaultRecord, LogEvent, LogQuery, Selection};
use crate::local::overview::Overview;
use crate::local::protocol::unit;

/// Most lines of the log in an answer: what answers to all connections together take of the memory is bounded.
pub(super) const HTTP_LINES_MAX: usize = 1_000;

/// Most faults in an answer.
pub(super) const HTTP_FAULTS_MAX: usize = 200;

/// A view of a running gateway.
#[derive(Debug)]
pub struct View {
    sources: Arc<Sources>,
    fixed: Fixed,
    started: SystemTime,
    /// What the charts show. Only the server's thread takes the lock.
    traces: Mutex<Traces>,
}

/// What does not change while the gateway runs.
#[derive(Debug, Clone, Default)]
pub struct Fixed {
    /// The axes with their limits, and where each value is.
    pub sheets: Sheets,
    /// What can be downloaded.
    pub files: Files,
}

/// What was seen at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Look {
    /// Whether the gateway is alive and ready.
    pub health: Health,
    /// The state of the whole gateway.
    pub status: Overview,
    /// Whether there is something new in the histories.
    pub history: Newest,
}

/// How far the histories are: a viewer that has seen these numbers has seen everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Newest {
    /// Number of the newest line of the log.
    pub log: u64,
    /// Changes of the history of faults.
    pub faults: u64,
}

/// Faults that are present, and faults that were.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FaultList {
    /// The faults, newest first.
    pub faults: Vec<FaultRecord>,
}

/// Lines of the log.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LogLines {
    /// The lines, oldest first.
    pub events: Vec<LogEvent>,
    /// The number to go on after.
    pub next: u64,
    /// Lines after the wanted number that are no longer there.
    pub missed: u64,
}

impl View {
    /// A view of a gateway that has started at `started`.
    #[must_use]
    pub fn new(sources: Arc<Sources>, fixed: Fixed, started: SystemTime) -> Self {
        Self { sources, fixed, started, traces: Mutex::default() }
    }

    /// What is shown, and what downloads are made of.
    pub(super) const fn sources(&self) -> &Arc<Sources> {
        &self.sources
    }

    /// When the gateway has started.
    #[must_use]
    pub fn started(&self) -> SystemTime {
        self.started
    }

    /// Takes a sample for the charts; to be called once in [`super::traces::PERIOD`].
    pub fn sample(&self) {
        let status = self.sources.status.read();
        self.traces().take(&status, || self.sources.time.read());
    }

    fn traces(&self) -> MutexGuard<'_, Traces> {
        self.traces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Samples of an axis, by its place, after this number.
    #[must_use]
    pub fn axis_traces(&self, place: usize, after: u64) -> Option<AxisTraces> {
        let axis = self.sources.installation.axes.get(place)?;
        Some(self.traces().of_axis(place, (&axis.name, unit(axis.kind)), after))
    }

    /// Samples of system time after this number.
    #[must_use]
    pub fn time_traces(&self, after: u64) -> TimeTraces {
        let buses = self.sources.installation.buses.iter().map(|bus| bus.name.as_str());
        self.traces().of_time(buses, after)
    }

    /// Limits and places of the values of an axis, by its place.
    #[must_use]
    pub fn sheet(&self, place: usize) -> Option<AxisSheet> {
        self.fixed.sheets.get(place)
    }

    /// What can be downloaded.
    #[must_use]
    pub fn files(&self) -> &Files {
        &self.fixed.files
    }

    /// Looks at the gateway.
    #[must_use]
    pub fn look(&self) -> Look {
        let Sources { histories, .. } = &*self.sources;
        let overview = self.sources.overview();
        let history = Newest { log: histories.events.newest(), faults: histories.faults.changes() };
        Look { health: Health::of(&overview), status: overview, history }
    }

    /// The faults of an axis, or of all.
    #[must_use]
    pub fn faults(&self, axis: Option<&str>) -> FaultList {
        let mut faults = self.sources.histories.faults.list(axis);
        faults.truncate(HTTP_FAULTS_MAX);
        FaultList { faults }
    }

    /// Lines of the log.
    #[must_use]
    pub fn log(&self, query: &LogQuery) -> LogLines {
        let Selection { events, next, missed } = self.sources.histories.events.select(query);
        LogLines { events: events.iter().map(|event| LogEvent::clone(event)).collect(), next, missed }
    }

    /// Names of the axes.
    #[must_use]
    pub fn axes(&self) -> Vec<String> {
        self.sources.installation.axes.iter().map(|axis| axis.name.clone()).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::time::Duration;

    use profile_generic::fault::{Fault, FaultCause};

    use super::*;
    use crate::bundle;
    use crate::engine::notice::Notice;
    use crate::history::Histories;
    use crate::latest::{Publisher, latest};
    use crate::local::installation::Installation;
    use crate::local::installation::tests::installation as names;
    use crate::status::BoxStatus;
    use crate::status::tests::distinct;
    use crate::time::source::TimeView;
    use crate::time::status::tests::synchronized;

    /// The names of the gateway of [`distinct`], with a name that has to be escaped.
    pub fn installation() -> Installation {
        Installation { name: "cell \"4\"".to_owned(), ..names() }
    }

    /// A view of [`distinct`], and the end where another status can be published.
    pub fn view() -> (View, Publisher<BoxStatus>) {
        let (publisher, reader) = latest(distinct());
        let started = SystemTime::UNIX_EPOCH + Duration::from_millis(1_700_000_000_250);
        let time = TimeView::of(synchronized());
        let sources = Sources {
            installation: installation(),
            status: reader,
            time,
            histories: histories(),
            ..bundle::tests::sources()
        };
        (View::new(Arc::new(sources), fixed(), started), publisher)
    }

    /// Sheets of the axes of an example, which have the same names, and the files of two devices.
    fn fixed() -> Fixed {
        let text = include_str!("../../../examples/two-axes-in-process.toml");
        let config = crate::config::Config::parse(text, "two-axes-in-process.toml").unwrap();
        let sheets = Sheets::of(&config, &crate::mapping::Mapping::embedded().unwrap());
        let files = Files {
            sheets: ["front", "back"]
                .map(|name| (name.to_owned(), format!("$ sheet of {name}\n").into_bytes().into()))
                .to_vec(),
            configuration: Some("[box]\nname = \"cell 4\"\n".to_owned()),
        };
        Fixed { sheets, files }
    }

    /// A fault that the drive has explained, and two lines of the log.
    pub fn histories() -> Histories {
        let histories = Histories::default();
        for (level, axis) in [("info", None), ("warn", Some("slide"))] {
            histories.events.push(LogEvent {
                level: level.to_owned(),
                axis: axis.map(str::to_owned),
                text: format!("a line of {level}"),
                ..LogEvent::default()
            });
        }
        let fault = Fault::new(FaultCause::OVER_CURRENT, profile_generic::time::SystemTime(5));
        let fault = Notice::Fault { axis: 1, fault, loss: None, trip: None, jump: None };
        histories.faults.note(&fault, &installation());
        histories
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
