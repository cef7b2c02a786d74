//! Writes down what the cycle thread reports: the lines of the log, the history of faults, and the counters of the axes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use profile_generic::time::{DurationNs, MonotonicTime};
use tokio::task::JoinHandle;
use tracing::{debug, info, warn};

use super::NOTICE_INTERVAL;
use crate::engine::notice::{Notice, Severity};
use crate::history::Histories;
use crate::latest::Reader;
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::local::installation::Installation;
use crate::recording::Recording;
use crate::status::BoxStatus;
use crate::sys::clock::monotonic_now;

/// Least time from one writing of the fault history to the next: a fault comes with several changes, and a disk wears.
const SAVE_INTERVAL: Duration = Duration::from_secs(2);

/// Time from one writing of the counters to the next: they change with every cycle of an axis in operation. A loss of power takes the
/// counts of this time.
const COUNTERS_INTERVAL: Duration = Duration::from_secs(600);

/// After this time every line that was left out has a count.
const LONG: DurationNs = DurationNs::from_secs(3_600);

/// Writes down what happens.
#[derive(Debug)]
pub(super) struct Scribe {
    names: Installation,
    axes: Vec<String>,
    histories: Histories,
    status: Reader<BoxStatus>,
    limit: Arc<LineLimit>,
    recording: Option<Arc<Recording>>,
}

impl Scribe {
    pub fn new(
        names: Installation,
        histories: Histories,
        status: Reader<BoxStatus>,
        limit: Arc<LineLimit>,
    ) -> Self {
        let axes = names.axes.iter().map(|axis| axis.name.clone()).collect();
        Self { names, axes, histories, status, limit, recording: None }
    }

    /// The same, which shows a recording what happens.
    #[must_use]
    pub fn with_recording(self, recording: Option<Arc<Recording>>) -> Self {
        Self { recording, ..self }
    }

    /// Takes notices until the cycle thread has ended.
    pub async fn run(self, mut notices: rtrb::Consumer<Notice>, stop: Arc<AtomicBool>) {
        let mut interval = tokio::time::interval(NOTICE_INTERVAL);
        let mut began = tokio::time::Instant::now();
        let mut counted = began;
        let mut saving: Option<JoinHandle<()>> = None;
        let mut recording_saves: Option<JoinHandle<()>> = None;
        loop {
            interval.tick().await;
            let last = stop.load(Ordering::Relaxed);
            while let Ok(notice) = notices.pop() {
                self.take(monotonic_now(), &notice);
            }
            let status = self.status.read();
            self.histories.faults.look(&status);
            if let Some(recording) = &self.recording {
                recording.look(&status);
            }
            self.histories.counters.look(&status, &self.names);
            if last {
                self.limit.report(monotonic_now() + LONG, &self.axes);
                return;
            }
            self.limit.report(monotonic_now(), &self.axes);
            let idle = saving.as_ref().is_none_or(JoinHandle::is_finished);
            if idle && began.elapsed() >= SAVE_INTERVAL && self.histories.faults.is_unsaved() {
                began = tokio::time::Instant::now();
                let faults = Arc::clone(&self.histories.faults);
                // It waits for the disk; notices do not.
                saving = Some(tokio::task::spawn_blocking(move || faults.save()));
            } else if idle && counted.elapsed() >= COUNTERS_INTERVAL && self.histories.counters.is_unsaved() {
                counted = tokio::time::Instant::now();
                let counters = Arc::clone(&self.histories.counters);
                saving = Some(tokio::task::spawn_blocking(move || counters.save()));
            }
            let idle = recording_saves.as_ref().is_none_or(JoinHandle::is_finished);
            if let Some(recording) =
                self.recording.as_ref().filter(|recording| idle && recording.is_unsaved())
            {
                let recording = Arc::clone(recording);
                recording_saves = Some(tokio::task::spawn_blocking(move || recording.save()));
            }
        }
    }

    /// Writes a notice down.
    fn take(&self, now: MonotonicTime, notice: &Notice) {
        self.histories.faults.note(notice, &self.names);
        if let Some(recording) = &self.recording {
            recording.note(notice);
        }
        if limited(notice).is_none_or(|(kind, peer)| self.limit.admits(now, kind, peer)) {
            self.log(notice);
        }
    }

    fn log(&self, notice: &Notice) {
        let place = notice.axis().map(usize::from);
        let named = place.and_then(|axis| self.names.axes.get(axis));
        let axis = named.map(|axis| axis.name.as_str());
        let drive = named.map(|axis| axis.drive.as_str());
        let device = notice.device().and_then(|device| self.names.devices.get(usize::from(device)));
        let device = device.map(|device| device.name.as_str());
        let bus = notice.bus().map(|bus| bus.to_string());
        let bus = bus.or_else(|| self.names.bus_of(place?).map(|bus| bus.name.clone()));
        let (bus, kind) = (bus.as_deref(), notice.kind());
        match notice.severity() {
            Severity::Detail => debug!(axis, device, kind, bus, drive, "{notice}"),
            Severity::Info => info!(axis, device, kind, bus, drive, "{notice}"),
            Severity::Warning => warn!(axis, device, kind, bus, drive, "{notice}"),
        }
    }
}

/// What the line of a notice counts as, where a controller can have as many of them as it likes.
const fn limited(notice: &Notice) -> Option<(LineKind, Peer)> {
    match notice {
        Notice::Refused { axis, .. } | Notice::OrderRefused { axis, .. } => {
            Some((LineKind::Request, Peer::Axis(*axis)))
        }
        Notice::NotEqual { axis, .. }
        | Notice::NotKept { axis, .. }
        | Notice::DriveRefuses { axis, .. }
        | Notice::Scaling { axis, .. } => Some((LineKind::Setting, Peer::Axis(*axis))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use profile_cip::assembly::Refusal;
    use profile_cip::device::axis_object::refused::{RefusalReason, RefusedRequest};
    use profile_cip::device::axis_state::AxisState;
    use profile_cip::wire::motion::codes::AxisControl;
    use profile_cip::wire::status::GeneralStatus;
    use profile_generic::state::DriveState;

    use super::*;
    use crate::history::lines_of;
    use crate::latest::latest;
    use crate::local::installation::tests::installation;
    use crate::status::tests::distinct;

    fn scribe() -> Scribe {
        let (_publisher, status) = latest(distinct());
        Scribe::new(installation(), Histories::default(), status, Arc::default())
    }

    fn refused(axis: u8) -> Notice {
        let refused = RefusedRequest {
            request: AxisControl(1),
            status: GeneralStatus(0x0C),
            reason: RefusalReason::State(AxisState::Off),
        };
        Notice::Refused { axis, refused }
    }

    #[test]
    fn ten_thousand_refused_requests_of_each_axis_are_few_lines_with_their_count() {
        let scribe = scribe();
        let at = |number: i64| MonotonicTime::ZERO + DurationNs::from_millis(number * 5);
        let lines = lines_of(|| {
            for number in 0..10_000 {
                scribe.take(at(number), &refused(0));
                scribe.take(at(number), &refused(1));
                scribe.limit.report(at(number), &scribe.axes);
            }
            scribe.limit.report(at(15_000), &scribe.axes);
        });
        let about: Vec<_> = lines.iter().map(|line| line.axis.as_deref().unwrap_or_default()).collect();
        let of = |axis: &str| about.iter().filter(|one| **one == axis).count();
        assert_eq!((lines.len(), of("turntable"), of("slide")), (10, 5, 5), "{about:?}");
        assert!(
            lines[0].text.contains("was refused with status 0x0c") && lines[0].kind == "refusal",
            "{lines:?}"
        );
        for line in &lines[8..] {
            assert!(
                line.text.starts_with("request refused: more such lines")
                    && line.text.ends_with(" count=9996")
            );
        }
    }

    /// A speed layout has an order refused as often as its bits change.
    #[test]
    fn ten_thousand_refused_orders_of_an_output_assembly_are_few_lines() {
        let scribe = scribe();
        let lines = lines_of(|| {
            for number in 0..10_000 {
                let at = MonotonicTime::ZERO + DurationNs::from_millis(number * 5);
                let order = Notice::OrderRefused { axis: 0, refusal: Refusal::BOTH_DIRECTIONS };
                scribe.take(at, &order);
                scribe.limit.report(at, &scribe.axes);
            }
        });
        let text = "what the controller orders in the output assembly is refused: both directions";
        assert_eq!(lines.len(), 4, "{lines:?}");
        for line in lines {
            let about = (line.text.as_str(), line.kind.as_str(), line.axis.as_deref());
            assert_eq!(about, (text, "refusal", Some("turntable")));
        }
    }

    #[test]
    fn line_names_axis_drive_bus_and_device() {
        let scribe = scribe();
        let lines = lines_of(|| {
            let (from, to) = (DriveState::Ready, DriveState::Starting);
            scribe.take(MonotonicTime::ZERO, &Notice::State { axis: 1, from, to });
            scribe.take(MonotonicTime::ZERO, &Notice::Retry);
            let from = std::net::SocketAddrV4::new(std::net::Ipv4Addr::LOCALHOST, 1);
            let why = crate::engine::admission::Refused::NoConnection;
            scribe.take(MonotonicTime::ZERO, &Notice::Strangers { device: 1, count: 2, from, why });
        });
        let about: Vec<_> = lines
            .iter()
            .map(|line| {
                let names = [&line.axis, &line.drive, &line.bus, &line.device];
                (line.kind.as_str(), names.map(|name| name.clone().unwrap_or_default()))
            })
            .collect();
        let expected = [
            ("state", ["slide", "drive-b", "CAN bus 1", ""].map(str::to_owned)),
            ("bus", ["", "", "SERCOS", ""].map(str::to_owned)),
            ("refusal", ["", "", "", "back"].map(str::to_owned)),
        ];
        assert_eq!(about, expected);
        assert_eq!(lines[0].text, "drive ready -> starting");
    }
}
