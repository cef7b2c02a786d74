//! Grandmaster, controller and gateway as three clocks that know each other by PTP only, each in a network namespace.
//!
//! ```text
//! grandmaster 192.0.2.1 ---+
//! controller  192.0.2.2 ---+-- switch (a bridge)
//! gateway     192.0.2.3 ---+
//! ```
//!
//! All of them are in this process. A namespace goes with its last socket.

use std::io;
use std::net::Ipv4Addr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use profile_generic::time::DurationNs;

use super::super::progress::Progress;
use super::super::{CliError, time};
use super::{ADDRESS, Endpoints, LOOK_INTERVAL};
use crate::runner::RunningBox;
use crate::simulate::clock::ClockPlan;
use crate::simulate::controller_time::{ControllerTime, Leadership, PtpPlace, TimePlan};
use crate::sys::namespace::{Namespace, run_ip};

/// Where controller and gateway have their time from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum DemoTime {
    /// Both read the host's clock.
    #[default]
    Host,
    /// A grandmaster with a clock of its own, by PTP, in three network namespaces.
    Ptp,
}

/// Address of the gateway.
pub const GATEWAY: Ipv4Addr = Ipv4Addr::new(192, 0, 2, 3);
const GRANDMASTER: Ipv4Addr = Ipv4Addr::new(192, 0, 2, 1);
const CONTROLLER: Ipv4Addr = Ipv4Addr::new(192, 0, 2, 2);

/// The interface of each.
const INTERFACE: &str = "net0";

/// The time of the gateway in the demonstration's configuration, and what stands there with PTP.
pub const SHARED: &str = "source = \"shared\"";
pub const PTP: &str = "source = \"ptp\"\nthreshold = \"100 us\"";

/// Largest offset that counts as synchronized: the stamps of a host that runs everything are late now and then.
const THRESHOLD: DurationNs = DurationNs::from_micros(100);

/// The grandmaster's clock is off the host's by so much. The other two have the host's oscillator, so this is what their clocks differ
/// by as well.
const OFFSET: DurationNs = DurationNs::from_millis(4);
const DRIFT_PPB: i64 = 40_000;

/// More often than CIP Sync does, for a short wait.
const LEADERSHIP: Leadership = Leadership { priorities: [128; 2], log_announce: -1, log_sync: -2 };

/// How long the controller waits for the time.
const LIMIT: Duration = Duration::from_secs(60);

/// The network, with the grandmaster at work.
pub struct Clocks {
    /// Where the gateway is.
    pub gateway: Namespace,
    /// Where the controller is.
    pub controller: Namespace,
    /// The switch and the grandmaster, as long as they are needed.
    _switch: Namespace,
    _grandmaster: ControllerTime,
}

impl Clocks {
    /// Lays the cables and starts the grandmaster. `listen` is the address that was asked for.
    pub fn start(listen: Ipv4Addr, progress: &mut Progress) -> Result<Self, CliError> {
        if listen.to_string() != ADDRESS {
            return Err(
                format!("--time ptp has a network of its own: expected no --listen, got {listen}").into()
            );
        }
        let missing = |error: io::Error| {
            format!(
                "three clocks need network namespaces: the capability CAP_SYS_ADMIN (or root), and `ip` of iproute2: {error}"
            )
        };
        let switch = Namespace::new().map_err(missing)?;
        switch.inside(|| run_ip("link add switch type bridge mcast_snooping 0"))?.map_err(missing)?;
        switch.inside(|| run_ip("link set switch up"))?.map_err(missing)?;
        let plug = |place: u8, address: Ipv4Addr| -> Result<Namespace, CliError> {
            let host = Namespace::new().map_err(missing)?;
            let port = format!("port{place}");
            switch.inside(|| {
                let peer = format!("peer name {INTERFACE} netns {}", host.path());
                run_ip(&format!("link add {port} type veth {peer}"))?;
                run_ip(&format!("link set {port} master switch up"))
            })??;
            host.inside(|| {
                run_ip("link set lo up")?;
                run_ip(&format!("addr add {address}/24 dev {INTERFACE}"))?;
                run_ip(&format!("link set {INTERFACE} up"))
            })??;
            Ok(host)
        };
        let (grandmaster, controller, gateway) =
            (plug(1, GRANDMASTER)?, plug(2, CONTROLLER)?, plug(3, GATEWAY)?);
        let clock = ClockPlan { offset: OFFSET, drift_ppb: DRIFT_PPB, steps: Vec::new() };
        let plan = TimePlan::Grandmaster(place(), LEADERSHIP, clock);
        let time = grandmaster.inside(|| ControllerTime::start(plan))??;
        progress.step(&format!(
            "grandmaster on {GRANDMASTER}: {} ms ahead of the host's clock, gains {} ppm",
            OFFSET.as_nanos() / 1_000_000,
            DRIFT_PPB / 1_000
        ));
        Ok(Self { gateway, controller, _switch: switch, _grandmaster: time })
    }

    /// The time of the controller, as soon as it is synchronized. Only inside its namespace.
    pub fn controller_time(
        &self,
        progress: &mut Progress,
        stop: &AtomicBool,
    ) -> Result<ControllerTime, CliError> {
        time::start(TimePlan::Ptp(place(), THRESHOLD), LIMIT, progress, stop)
    }
}

/// Waits until the gateway has the grandmaster's time, so that the first time stamps of the controller mean something to it.
pub fn wait_for_gateway(
    running: &RunningBox,
    progress: &mut Progress,
    stop: &AtomicBool,
) -> Result<(), CliError> {
    let (view, end) = (running.time(), Instant::now() + LIMIT);
    loop {
        let status = view.read();
        if status.sample.is_some() {
            progress.step(&format!("time of the gateway: {status}"));
            return Ok(());
        }
        if stop.load(Ordering::Relaxed) {
            return Err("ended before the gateway had the grandmaster's time".into());
        }
        if Instant::now() > end {
            return Err(
                format!("expected the grandmaster's time in the gateway within {LIMIT:?}: {status}").into()
            );
        }
        std::thread::sleep(LOOK_INTERVAL);
    }
}

/// Where controller and gateway find each other.
pub const fn endpoints() -> Endpoints {
    Endpoints { target: GATEWAY, bind: CONTROLLER }
}

fn place() -> PtpPlace {
    PtpPlace { interface: INTERFACE.to_owned(), domain: 0 }
}
