//! Where system time comes from: a thread for the source that is configured, and what it tells.
//!
//! | source | system time | synchronized while |
//! |---|---|---|
//! | `ptp` | the line of the embedded follower | the follower's [`Judge`](super::judge::Judge) says so |
//! | `daemon` | the clock that `ptp4l` keeps | the same judge says so of what `ptp4l` measures |
//! | `host` | the host's clock | the kernel says that a daemon keeps it, with an error below the threshold |
//! | `shared` | the host's clock | always: the controllers read the very same clock |
//! | `none` | not known | never |
//!
//! The thread has no part in the cycle: it writes [`CycleTime`], and a failure of it is a clock that is not synchronized.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use profile_cip::device::time_sync::TimeSyncSetting;
use tracing::{error, info, warn};

use super::daemon::Daemon;
use super::feed::{CycleTime, TimeFeed};
use super::judge::{Reason, SyncPhase};
use super::ptp::wire::{Control, HostWire};
use super::ptp::{FollowerConfig, follow};
use super::status::{Identity, TimeStatus};
use crate::config::{Time, TimeSource};
use crate::latest::{Publisher, latest};
use crate::simulate::setup::HOST_CLOCK;
use crate::sys::card_stamps::{NotUsed, StampsMissing};
use crate::sys::clock::{self, KernelClock, monotonic_now};
use crate::sys::ethtool;
use crate::sys::phc::Phc;
use crate::sys::ptp_socket::{Dscp, OpenError, PtpSockets};
use crate::sys::thread::{self, SMALL_STACK};

/// How often the kernel is asked for the state of the host's clock.
const LOOK: Duration = Duration::from_millis(250);

/// Pause before a follower that has failed begins anew.
const PAUSE: Duration = Duration::from_secs(2);

/// The state of system time, for everybody but the cycle.
#[derive(Debug, Clone)]
pub struct TimeView(Arc<Mutex<TimeStatus>>);

impl TimeView {
    /// A view of a state that stays.
    #[must_use]
    pub fn of(status: TimeStatus) -> Self {
        Self(Arc::new(Mutex::new(status)))
    }

    /// The state now.
    #[must_use]
    pub fn read(&self) -> TimeStatus {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The source at work.
#[derive(Debug)]
pub struct TimeService {
    view: TimeView,
    control: Arc<Control>,
    thread: Option<JoinHandle<()>>,
}

/// Sets in the source what the Time Sync object is told.
#[derive(Debug, Clone)]
pub struct TimeSetter(Arc<Control>);

impl TimeSetter {
    /// Sets it; it has an effect within the next message or a quarter of a second.
    pub fn set(&self, setting: TimeSyncSetting) {
        match setting {
            TimeSyncSetting::MaxOffset => self.0.forget.store(true, Ordering::Relaxed),
            TimeSyncSetting::Domain(domain) => self.0.domain.store(domain, Ordering::Relaxed),
        }
    }
}

/// Identity and network of the clock of the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Its interface towards the controllers, where it has one.
    pub interface: Option<String>,
    /// MAC address of that.
    pub mac: [u8; 6],
    /// Code point of PTP event messages, 0 to 63.
    pub event_dscp: u8,
}

/// Why there is no source.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// PTP needs an interface.
    #[error(
        "PTP needs a network interface, and no interface of this host has the address of the first device: give [time] an `interface`"
    )]
    NoInterface,
    /// Its sockets are not to be had.
    #[error("{0}")]
    Open(#[from] OpenError),
    /// The clock of the network card is not to be had.
    #[error("cannot open the clock {path} of the network card: {source}")]
    Phc {
        /// The device.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The system gives no thread.
    #[error("cannot start the thread of system time: {0}")]
    Thread(std::io::Error),
}

impl TimeService {
    /// Starts the source. Returns it with the feed of the cycle thread.
    ///
    /// # Errors
    /// [`SourceError`].
    pub fn start(config: &Time, place: &Place) -> Result<(Self, TimeFeed), SourceError> {
        let identity = match config.source {
            TimeSource::Ptp | TimeSource::Daemon => identity(place.mac),
            TimeSource::Host | TimeSource::Shared | TimeSource::None => HOST_CLOCK,
        };
        let follower = FollowerConfig {
            identity,
            domain: config.domain,
            threshold: config.threshold.magnitude(),
            asymmetry: config.asymmetry.as_nanos(),
            seed: monotonic_now().0,
        };
        let mut first = TimeStatus::ptp(&follower);
        match config.source {
            TimeSource::Shared => first.phase = SyncPhase::Synchronized,
            TimeSource::Host => first.phase = judge_host(clock::kernel_clock(), first.threshold),
            TimeSource::Ptp | TimeSource::Daemon | TimeSource::None => {}
        }
        if matches!(config.source, TimeSource::Shared | TimeSource::Host) {
            first.grandmaster = Some(HOST_CLOCK);
        }
        let (publisher, reader) = latest(CycleTime::of(&first));
        let is_host = matches!(config.source, TimeSource::Host | TimeSource::Shared);
        let view = TimeView::of(first);
        let control = Arc::new(Control::default());
        control.domain.store(config.domain, Ordering::Relaxed);
        control.threshold.store(follower.threshold, Ordering::Relaxed);
        let reporter = Reporter { publisher, view: view.clone(), said: None };
        let thread = match config.source {
            TimeSource::Ptp => {
                let interface = config.interface.clone().or_else(|| place.interface.clone());
                let interface = interface.ok_or(SourceError::NoInterface)?;
                // A follower sends no general message.
                let dscp = Dscp { event: place.event_dscp, ..Dscp::default() };
                let use_card = config.card_stamps;
                let sockets = PtpSockets::open(&interface, dscp, use_card)?;
                let port = FollowerPort { interface, dscp, use_card };
                let control = Arc::clone(&control);
                Some(spawn(move || run_follower(follower, port, sockets, &control, reporter))?)
            }
            TimeSource::Daemon => {
                let interface = config.interface.as_ref().or(place.interface.as_ref());
                let daemon = Daemon::new(&follower, &config.socket, phc(config, interface)?);
                let control = Arc::clone(&control);
                Some(spawn(move || watch_daemon(daemon, &control, reporter))?)
            }
            TimeSource::Host => {
                let control = Arc::clone(&control);
                Some(spawn(move || watch_host(follower.threshold, &control, reporter))?)
            }
            TimeSource::Shared | TimeSource::None => None,
        };
        let feed = TimeFeed::new(reader, is_host, Arc::clone(&control), follower.threshold);
        Ok((Self { view, control, thread }, feed))
    }

    /// The state of system time.
    #[must_use]
    pub fn view(&self) -> TimeView {
        self.view.clone()
    }

    /// What sets it.
    #[must_use]
    pub fn setter(&self) -> TimeSetter {
        TimeSetter(Arc::clone(&self.control))
    }
}

impl Drop for TimeService {
    fn drop(&mut self) {
        self.control.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic has been printed where it happened.
            let _ = thread.join();
        }
    }
}

fn spawn(run: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, SourceError> {
    thread::named("axisbridge-time", SMALL_STACK).spawn(run).map_err(SourceError::Thread)
}

/// EUI-64 of a MAC address (IEEE 1588-2008, clause 7.5.2.2.2).
#[must_use]
pub const fn identity(mac: [u8; 6]) -> [u8; 8] {
    let [a, b, c, d, e, f] = mac;
    [a, b, c, 0xFF, 0xFE, d, e, f]
}

/// Tells everybody, and logs what is new.
struct Reporter {
    publisher: Publisher<CycleTime>,
    view: TimeView,
    said: Option<(SyncPhase, Option<[u8; 8]>, u32)>,
}

impl Reporter {
    fn report(&mut self, status: &TimeStatus) {
        self.publisher.publish(&CycleTime::of(status));
        *self.view.0.lock().unwrap_or_else(PoisonError::into_inner) = status.clone();
        let now = (status.phase, status.grandmaster, status.steps);
        let before = self.said.replace(now);
        if before == Some(now) {
            return;
        }
        if let (Some(grandmaster), true) =
            (status.grandmaster, before.is_none_or(|before| before.1 != status.grandmaster))
        {
            info!(grandmaster = %Identity(grandmaster), "system time: another grandmaster is followed");
        }
        // A follower that begins anew counts from zero.
        if before.is_some_and(|before| before.2 < status.steps) {
            warn!(steps = status.steps, "system time: the grandmaster's clock has stepped");
        }
        if before.is_none_or(|before| before.0 != status.phase) {
            let was_synchronized = before.is_some_and(|before| before.0.is_synchronized());
            if was_synchronized && !status.phase.is_synchronized() {
                warn!("system time: {status}");
            } else {
                info!("system time: {status}");
            }
        }
    }
}

/// How the sockets of the follower are opened.
struct FollowerPort {
    interface: String,
    dscp: Dscp,
    /// Stamps of the network card are taken where it has some.
    use_card: bool,
}

impl FollowerPort {
    fn open(&self) -> Result<PtpSockets, OpenError> {
        PtpSockets::open(&self.interface, self.dscp, self.use_card)
    }

    /// Says who stamps.
    fn report(&self, sockets: &PtpSockets) {
        let interface = &self.interface;
        match sockets.card() {
            Ok(card) => {
                info!(interface, clock = %card.path().display(), "system time: the network card stamps PTP");
            }
            Err(NotUsed::None | NotUsed::Unwanted) => info!(interface, "system time: the kernel stamps PTP"),
            Err(reason) => {
                warn!(interface, %reason, "system time: the kernel stamps PTP, although the network card could");
            }
        }
    }

    /// Takes the stamps of the kernel from now on if the card gives none, as its driver may promise more than it does.
    fn learn(&mut self, failure: &std::io::Error) {
        self.use_card &= !failure.get_ref().is_some_and(|reason| reason.is::<StampsMissing>());
    }
}

/// Follows until it is stopped; a follower that fails begins anew, and time is not synchronized meanwhile.
fn run_follower(
    config: FollowerConfig,
    mut port: FollowerPort,
    first: PtpSockets,
    control: &Arc<Control>,
    mut reporter: Reporter,
) {
    let mut sockets = Some(first);
    while !control.stop.load(Ordering::Relaxed) {
        let config = FollowerConfig { domain: control.domain.load(Ordering::Relaxed), ..config };
        let opened = sockets.take().map_or_else(|| port.open(), Ok);
        let failure = match opened {
            Ok(sockets) => {
                port.report(&sockets);
                let mut wire = HostWire::new(sockets, config.domain, Arc::clone(control));
                let followed = catch_unwind(AssertUnwindSafe(|| {
                    follow(&config, &mut wire, &mut |status| reporter.report(status))
                }));
                match followed {
                    // The end, or another domain.
                    Ok(Ok(())) => continue,
                    Ok(Err(failure)) => {
                        port.learn(&failure);
                        failure.to_string()
                    }
                    Err(_) => "an error in the PTP library".to_owned(),
                }
            }
            Err(failure) => failure.to_string(),
        };
        error!(interface = port.interface, %failure, "the PTP follower has ended; it begins anew in {} s", PAUSE.as_secs());
        reporter.report(&TimeStatus::ptp(&config));
        let end = monotonic_now().0 + u64::try_from(PAUSE.as_nanos()).unwrap_or(0);
        while monotonic_now().0 < end && !control.stop.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
    }
}

/// The clock of the network card: the configured one, or that of the interface if it has one.
fn phc(config: &Time, interface: Option<&String>) -> Result<Option<Phc>, SourceError> {
    let own = || interface.and_then(|name| ethtool::features(name).ok()?.clock);
    let path = config.phc.clone().or_else(|| own().map(|number| PathBuf::from(format!("/dev/ptp{number}"))));
    let open = |path: PathBuf| {
        Phc::open(&path).map_err(|source| SourceError::Phc { path: path.display().to_string(), source })
    };
    path.map(open).transpose()
}

/// Tells what `ptp4l` says.
fn watch_daemon(mut daemon: Daemon, control: &Control, mut reporter: Reporter) {
    while !control.stop.load(Ordering::Relaxed) {
        daemon.set_domain(control.domain.load(Ordering::Relaxed));
        daemon.set_threshold(control.threshold.load(Ordering::Relaxed));
        if control.forget.swap(false, Ordering::Relaxed) {
            daemon.forget();
        }
        reporter.report(daemon.look(monotonic_now()));
        std::thread::sleep(LOOK);
    }
}

/// Tells what the kernel says of its clock.
fn watch_host(threshold: u64, control: &Control, mut reporter: Reporter) {
    while !control.stop.load(Ordering::Relaxed) {
        let mut status = reporter.view.read();
        let kernel = clock::kernel_clock();
        status.phase = judge_host(kernel, threshold);
        status.error_bound = kernel.map_or(u64::MAX, |kernel| kernel.error_bound);
        reporter.report(&status);
        std::thread::sleep(LOOK);
    }
}

/// Whether the host's clock is everybody's time.
fn judge_host(kernel: Option<KernelClock>, threshold: u64) -> SyncPhase {
    match kernel {
        Some(kernel) if kernel.disciplined && kernel.error_bound <= threshold => SyncPhase::Synchronized,
        Some(kernel) if kernel.disciplined => SyncPhase::Uncalibrated(Reason::Offset),
        _ => SyncPhase::Uncalibrated(Reason::Undisciplined),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_host_is_synchronized_when_a_daemon_says_so_with_a_small_error() {
        let kernel =
            |disciplined, error_bound| Some(KernelClock { disciplined, error_bound, tai_offset_s: 37 });
        for (state, expected) in [
            (None, SyncPhase::Uncalibrated(Reason::Undisciplined)),
            (kernel(false, 0), SyncPhase::Uncalibrated(Reason::Undisciplined)),
            (kernel(true, 10_000), SyncPhase::Synchronized),
            (kernel(true, 10_001), SyncPhase::Uncalibrated(Reason::Offset)),
        ] {
            assert_eq!(judge_host(state, 10_000), expected, "{state:?}");
        }
    }

    #[test]
    fn nothing_is_synchronized_without_a_source_and_what_is_shared_is() {
        let place = Place { interface: None, mac: [0; 6], event_dscp: 59 };
        for (source, phase, grandmaster) in [
            (TimeSource::None, SyncPhase::Listening, None),
            (TimeSource::Shared, SyncPhase::Synchronized, Some(HOST_CLOCK)),
        ] {
            let (service, _) = TimeService::start(&Time { source, ..Time::default() }, &place).unwrap();
            let status = service.view().read();
            assert_eq!((status.phase, status.grandmaster), (phase, grandmaster), "{source:?}");
        }
        let ptp = TimeService::start(&Time { source: TimeSource::Ptp, ..Time::default() }, &place);
        assert!(matches!(ptp, Err(SourceError::NoInterface)));
    }

    #[test]
    fn the_kernel_stamps_when_the_card_does_not_do_what_it_promised() {
        let mut port = FollowerPort { interface: "eth0".to_owned(), dscp: Dscp::default(), use_card: true };
        port.learn(&std::io::Error::other("the network is down"));
        assert!(port.use_card);
        port.learn(&std::io::Error::other(StampsMissing { direction: "were sent" }));
        assert!(!port.use_card);
        port.learn(&std::io::Error::other("the network is down"));
        assert!(!port.use_card, "it stays so");
    }

    #[test]
    fn an_identity_is_made_of_the_mac_address() {
        assert_eq!(identity([1, 2, 3, 4, 5, 6]), [1, 2, 3, 0xFF, 0xFE, 4, 5, 6]);
    }
}
