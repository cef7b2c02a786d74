//! Whether a host is fit for a box: kernel, processors, privileges, clock, network, and how late its timers wake.
//!
//! Facts come from text files of the kernel and from attempts: what the box will do at its start is done here, and given up
//! again. Nothing is sent on any bus. A [`Check`] says what was found, what it means, and what a person can do about it; what
//! the box needs and cannot have is [`Verdict::Unfit`], what it can live with is [`Verdict::Doubtful`].

pub mod latency;

mod kernel;
mod network;
mod report;
mod time;

use std::fmt;
use std::path::Path;
use std::time::Duration;

use crate::config::{CanLink, Config, DEFAULT_ALLOWED_LOSSES, DEFAULT_JITTER, DEFAULT_PRIORITY, Link};
use crate::sys::realtime;
use latency::Cycle;
use profile_generic::time::DurationNs;

pub use report::{json, text};

/// Cycles that are tried where there is no configuration.
const CYCLES: [DurationNs; 3] =
    [DurationNs::from_millis(1), DurationNs::from_millis(2), DurationNs::from_millis(4)];

/// How good something is, the better first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// As it should be.
    Good,
    /// The box runs with it, not as well as it could.
    Doubtful,
    /// The box does not run with it, or not for long.
    Unfit,
}

impl Verdict {
    /// Its name, also in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Doubtful => "doubtful",
            Self::Unfit => "unfit",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// What it belongs to: `kernel`, `real time`, `clock`, `network`.
    pub area: &'static str,
    /// What was looked at.
    pub what: String,
    /// How good it is.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What a person can do about it; `None` where it is good.
    pub advice: Option<String>,
}

impl Check {
    fn good(area: &'static str, what: impl Into<String>, found: impl Into<String>) -> Self {
        Self { area, what: what.into(), verdict: Verdict::Good, found: found.into(), advice: None }
    }

    fn doubtful(
        area: &'static str,
        what: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self { verdict: Verdict::Doubtful, advice: Some(advice.into()), ..Self::good(area, what, found) }
    }

    fn unfit(
        area: &'static str,
        what: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self { verdict: Verdict::Unfit, ..Self::doubtful(area, what, found, advice) }
    }
}

/// All that was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnosis {
    /// What was looked at, by area.
    pub checks: Vec<Check>,
    /// How late the timers wake, for each cycle.
    pub cycles: Vec<latency::Result>,
}

impl Diagnosis {
    /// The worst of all.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let checks = self.checks.iter().map(|check| check.verdict);
        checks.chain(self.cycles.iter().map(latency::Result::verdict)).max().unwrap_or(Verdict::Good)
    }
}

/// Looks at the host for a box with this configuration; without one, for one with the usual cycles. Each cycle is tried for
/// `each`; `tell` hears what is being done.
pub fn examine(config: Option<&Config>, each: Duration, mut tell: impl FnMut(&str)) -> Diagnosis {
    let request = config.map_or_else(usual_request, |config| config.realtime);
    tell("looking at kernel, clock and network");
    let mut checks = kernel::checks(Path::new("/"), request);
    checks.extend(time::checks(config));
    checks.extend(network::checks(Path::new("/"), config));
    let mut grants = Vec::new();
    let mut results = Vec::new();
    for cycle in cycles(config) {
        let time = latency::longest(&cycle).min(each);
        let cut = if time < each { ", the longest trial of this cycle" } else { "" };
        tell(&format!("waking every {} for {} s{cut}", cycle.time, time.as_secs()));
        let (granted, result) = latency::measure(cycle, time, request);
        grants = granted;
        results.push(result);
    }
    let at = checks.iter().take_while(|check| check.area == kernel::AREA).count();
    checks.splice(at..at, grants.iter().map(kernel::grant));
    Diagnosis { checks, cycles: results }
}

/// Looks at the host of a box that runs: kernel, processors and clock. Cycles are not tried, and neither interfaces and
/// addresses nor the source of time are opened: that would disturb the box, which has them.
#[must_use]
pub fn look(config: &Config) -> Diagnosis {
    Diagnosis { checks: kernel::checks(Path::new("/"), config.realtime), cycles: Vec::new() }
}

/// What the box asks of the kernel where the file says nothing.
fn usual_request() -> realtime::Request {
    realtime::Request { priority: Some(DEFAULT_PRIORITY), lock_memory: true, ..realtime::Request::default() }
}

/// The cycles of the buses.
fn cycles(config: Option<&Config>) -> Vec<Cycle> {
    let Some(config) = config else {
        let usual = |time| Cycle {
            what: "without a configuration".to_owned(),
            time,
            tolerance: DEFAULT_JITTER,
            losses: DEFAULT_ALLOWED_LOSSES,
        };
        return CYCLES.map(usual).to_vec();
    };
    let sercos = config.sercos.iter().map(|bus| Cycle {
        what: match &bus.link {
            Link::Interface { name, .. } => format!("SERCOS III on {name}"),
            Link::InProcess { .. } => "SERCOS III in the process".to_owned(),
        },
        time: bus.cycle_time,
        tolerance: bus.jitter,
        losses: bus.allowed_losses,
    });
    // Neither declares a jitter: a SYNC or poll half a cycle late is one that the box itself counts as late.
    let on_can = |kind: &str, link: &CanLink, time: DurationNs, losses| Cycle {
        what: match link.interface() {
            Some(name) => format!("{kind} on {name}"),
            None => format!("{kind} in the process"),
        },
        time,
        tolerance: DurationNs(time.as_nanos() / 2),
        losses,
    };
    let can = config.can.iter().map(|bus| on_can("CANopen", &bus.link, bus.cycle_time, bus.allowed_losses));
    let devicenet = config.devicenet.iter();
    let devicenet =
        devicenet.map(|bus| on_can("DeviceNet", &bus.link, bus.cycle_time, bus.allowed_losses.into()));
    sercos.chain(can).chain(devicenet).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cycles_are_those_of_the_buses() {
        let config = include_str!("../../../examples/two-axes-sercos.toml");
        let config = Config::parse(config, "two-axes-sercos.toml").unwrap_or_else(|error| panic!("{error}"));
        let bus = config.sercos.clone().unwrap();
        let expected = Cycle {
            what: "SERCOS III on enp3s0".to_owned(),
            time: bus.cycle_time,
            tolerance: bus.jitter,
            losses: bus.allowed_losses,
        };
        assert_eq!(cycles(Some(&config)), [expected]);
        let config = include_str!("../../../examples/two-axes-devicenet.toml");
        let config = Config::parse(config, "devicenet.toml").unwrap_or_else(|error| panic!("{error}"));
        let [network] = &cycles(Some(&config))[..] else { panic!("one network") };
        assert_eq!((network.what.as_str(), network.time.as_nanos()), ("DeviceNet on can0", 10_000_000));
        assert_eq!(network.tolerance.as_nanos(), 5_000_000);
        let without = cycles(None);
        assert_eq!(
            without.iter().map(|cycle| cycle.time.as_nanos()).collect::<Vec<_>>(),
            [1_000_000, 2_000_000, 4_000_000]
        );
    }

    #[test]
    fn the_worst_check_is_the_verdict() {
        let check = |verdict| Check { verdict, ..Check::good("kernel", "x", "y") };
        let of = |verdicts: &[Verdict]| {
            Diagnosis { checks: verdicts.iter().copied().map(check).collect(), cycles: Vec::new() }.verdict()
        };
        use Verdict::{Doubtful, Good, Unfit};
        assert_eq!(of(&[]), Good);
        assert_eq!(of(&[Good, Doubtful, Good]), Doubtful);
        assert_eq!(of(&[Unfit, Doubtful]), Unfit);
    }

    #[test]
    fn a_host_is_examined_whole_and_keeps_what_it_has() {
        let config = include_str!("../../../examples/two-axes-in-process.toml");
        let mut config = Config::parse(config, "in-process.toml").unwrap_or_else(|error| panic!("{error}"));
        config.realtime = realtime::Request::default();
        let mut told = Vec::new();
        let each = Duration::from_millis(20);
        let diagnosis = examine(Some(&config), each, |text| told.push(text.to_owned()));
        assert_eq!((diagnosis.cycles.len(), told.len()), (1, 2));
        let mut areas: Vec<_> = diagnosis.checks.iter().map(|check| check.area).collect();
        areas.dedup();
        assert_eq!(areas, ["kernel", "real time", "clock", "network"], "each area stands together");
        let advised = |check: &Check| (check.verdict == Verdict::Good) == check.advice.is_none();
        assert!(diagnosis.checks.iter().all(advised), "{:?}", diagnosis.checks);
    }
}
