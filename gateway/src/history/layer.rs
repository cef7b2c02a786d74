//! From the logger into the ring: the fields that say what a line is about, and the rest as its text.

use std::fmt::{self, Debug};
use std::sync::Arc;
use std::time::SystemTime;

use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::field::RecordFields;
use tracing_subscriber::fmt::format::{DefaultVisitor, Writer};
use tracing_subscriber::fmt::{FormatFields, FormattedFields};
use tracing_subscriber::layer::Context;

use super::event::LogEvent;
use super::ring::EventRing;
use super::utc;
use crate::sys::clock::monotonic_now;

/// Fields that are for the ring only: a line of the log says the same in its text, or by its axis.
const UNSHOWN: [&str; 3] = ["kind", "bus", "drive"];

/// Writes every line that the logger writes into the ring.
#[derive(Debug)]
pub struct RingLayer(Arc<EventRing>);

impl RingLayer {
    /// Writes into this ring.
    #[must_use]
    pub const fn new(ring: Arc<EventRing>) -> Self {
        Self(ring)
    }
}

impl<S: Subscriber> Layer<S> for RingLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let mut line = LogEvent {
            time: utc(SystemTime::now()),
            monotonic_ns: monotonic_now().0,
            level: metadata.level().as_str().to_ascii_lowercase(),
            kind: part(metadata.target()).to_owned(),
            ..LogEvent::default()
        };
        let mut text = FormattedFields::<LinesOf>::new(String::new());
        {
            let mut plain = DefaultVisitor::new(text.as_writer(), true);
            event.record(&mut Split { plain: &mut plain, line: Some(&mut line) });
        }
        line.text = text.fields;
        self.0.push(line);
    }
}

/// The part of the gateway that logs, or the library.
fn part(target: &str) -> &str {
    let mut modules = target.split("::");
    match (modules.next(), modules.next()) {
        (Some("axisbridge"), Some("north")) => "ethernet-ip",
        (Some("axisbridge"), Some(part @ ("modbus" | "http" | "local" | "time"))) => part,
        (Some("statime"), _) => "time",
        _ => "gateway",
    }
}

/// Formats the fields of a line of the log as usual, without those that are for the ring only.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinesOf;

impl<'writer> FormatFields<'writer> for LinesOf {
    fn format_fields<R: RecordFields>(&self, writer: Writer<'writer>, fields: R) -> fmt::Result {
        use tracing_subscriber::field::VisitOutput as _;
        let mut plain = DefaultVisitor::new(writer, true);
        fields.record(&mut Split { plain: &mut plain, line: None });
        plain.finish()
    }
}

/// Splits the fields: what a line is about goes to the line, if there is one, the rest to the text.
struct Split<'a, 'w> {
    plain: &'a mut DefaultVisitor<'w>,
    line: Option<&'a mut LogEvent>,
}

impl Split<'_, '_> {
    /// Whether the field was taken, or is not for the text.
    fn takes(&mut self, field: &Field, value: impl FnOnce() -> String) -> bool {
        let Some(line) = &mut self.line else { return UNSHOWN.contains(&field.name()) };
        match field.name() {
            "axis" => line.axis = Some(value()),
            "drive" => line.drive = Some(value()),
            "device" => line.device = Some(value()),
            "bus" => line.bus = Some(value()),
            "kind" => line.kind = value(),
            _ => return false,
        }
        true
    }
}

impl Visit for Split<'_, '_> {
    fn record_str(&mut self, field: &Field, value: &str) {
        if !self.takes(field, || value.to_owned()) {
            self.plain.record_str(field, value);
        }
    }

    fn record_error(&mut self, field: &Field, value: &(dyn std::error::Error + 'static)) {
        if !self.takes(field, || value.to_string()) {
            self.plain.record_error(field, value);
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if !self.takes(field, || format!("{value:?}")) {
            self.plain.record_debug(field, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::{Mutex, PoisonError};

    use tracing_subscriber::layer::SubscriberExt as _;

    use super::super::ring::LogQuery;
    use super::*;

    /// Standard error of a test.
    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Written {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn ring_has_the_lines_of_the_log_taken_apart() {
        let ring = Arc::new(EventRing::default());
        let written = Written::default();
        let writer = written.clone();
        let log = tracing_subscriber::fmt::layer().fmt_fields(LinesOf).with_target(false).without_time();
        let log = log.with_ansi(false).with_writer(move || writer.clone());
        let subscriber = tracing_subscriber::registry()
            .with(tracing_subscriber::filter::LevelFilter::INFO)
            .with(log)
            .with(RingLayer::new(Arc::clone(&ring)));
        tracing::subscriber::with_default(subscriber, || {
            let (axis, kind) = (Some("turntable"), "state");
            let (drive, bus) = (Some("drive-a"), None::<&str>);
            tracing::info!(axis, kind, drive, bus, "drive ready -> starting");
            tracing::warn!(target: "axisbridge::modbus::server", peer = %"192.0.2.1", count = 3, "refused");
            tracing::info!(target: "axisbridge::cli::run", device = "front", text = "a b", "indicators");
            tracing::debug!("not logged");
        });
        let text = String::from_utf8(written.0.lock().unwrap().clone()).unwrap();
        assert_eq!(
            text.lines().map(str::trim_start).collect::<Vec<_>>(),
            [
                "INFO drive ready -> starting axis=\"turntable\"",
                "WARN refused peer=192.0.2.1 count=3",
                "INFO indicators device=\"front\" text=\"a b\"",
            ]
        );
        let events = ring.select(&LogQuery::default()).events;
        let lines: Vec<_> = events
            .iter()
            .map(|event| (event.level.as_str(), event.kind.as_str(), event.text.as_str()))
            .collect();
        assert_eq!(
            lines,
            [
                ("info", "state", "drive ready -> starting"),
                ("warn", "modbus", "refused peer=192.0.2.1 count=3"),
                ("info", "gateway", "indicators text=\"a b\""),
            ]
        );
        let about = |event: &LogEvent| {
            [&event.axis, &event.drive, &event.device, &event.bus]
                .map(|name| name.clone().unwrap_or_default())
        };
        assert_eq!(about(&events[0]), ["turntable", "drive-a", "", ""]);
        assert_eq!(about(&events[2]), ["", "", "front", ""]);
        assert!(events[0].monotonic_ns > 0 && events[0].time.ends_with('Z'), "{:?}", events[0]);
    }
}
