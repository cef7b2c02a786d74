//! The time of a simulated controller, and `axisbridge simulate grandmaster`.

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use profile_generic::time::DurationNs;

use super::CliError;
use super::progress::Progress;
use super::simulate::stop_after;
use crate::simulate::clock::{ClockPlan, ClockStep};
use crate::simulate::controller_time::{ControllerTime, Leadership, PtpPlace, Readiness, TimePlan};
use crate::sys::interfaces;

/// How often a clock that is not ready is looked at.
const LOOK: Duration = Duration::from_millis(50);

/// Where the time of a simulated controller comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum TimeFrom {
    /// The host's clock, as the gateway on this host has it.
    #[default]
    Host,
    /// A grandmaster on the network, by PTP.
    Ptp,
    /// The controller is the grandmaster.
    Grandmaster,
}

/// The time of a controller.
#[derive(Debug, Args)]
pub struct TimeArguments {
    /// Where the controller's system time comes from.
    #[arg(long = "time", value_name = "SOURCE", value_enum, default_value_t)]
    pub source: TimeFrom,
    /// Network interface for PTP [default: that with the address of --bind]
    #[arg(long = "time-interface", value_name = "IF")]
    pub interface: Option<String>,
    /// PTP domain.
    #[arg(long = "time-domain", value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=127))]
    pub domain: u8,
    /// Largest offset of a time that is called synchronized, in microseconds (--time ptp).
    #[arg(long = "time-threshold", value_name = "US", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub threshold: u32,
    /// How long to wait until the time is synchronized, in seconds.
    #[arg(long = "time-limit", value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub limit: u32,
}

/// How a grandmaster tells its time.
#[derive(Debug, Args)]
pub struct LeadershipArguments {
    /// First priority of the grandmaster among clocks. The lower one wins.
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub priority1: u8,
    /// Second priority of the grandmaster, where the first and the quality of clocks are equal.
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub priority2: u8,
    /// Interval of the grandmaster's Announces: 2^N seconds.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(i8).range(-3..=4))]
    pub log_announce: i8,
    /// Interval of the grandmaster's Syncs: 2^N seconds.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(i8).range(-5..=1))]
    pub log_sync: i8,
}

impl LeadershipArguments {
    const fn leadership(&self) -> Leadership {
        Leadership {
            priorities: [self.priority1, self.priority2],
            log_announce: self.log_announce,
            log_sync: self.log_sync,
        }
    }
}

/// A clock of its own.
#[derive(Debug, Args)]
pub struct ClockArguments {
    /// How far the clock is ahead of the host's, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 0, allow_negative_numbers = true)]
    pub clock_offset: i32,
    /// What the clock gains, in parts per million.
    #[arg(long, value_name = "PPM", default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-5_000..=5_000))]
    pub clock_drift: i32,
    /// After S seconds, step the clock by MS milliseconds, such as 3:-50. Can be repeated.
    #[arg(long, value_name = "S:MS")]
    pub clock_step: Vec<ClockStep>,
}

impl ClockArguments {
    /// The clock.
    pub fn plan(&self) -> ClockPlan {
        ClockPlan {
            offset: DurationNs::from_millis(self.clock_offset.into()),
            drift_ppb: i64::from(self.clock_drift) * 1_000,
            steps: self.clock_step.clone(),
        }
    }
}

/// Arguments of `simulate grandmaster`.
#[derive(Debug, Args)]
pub struct GrandmasterArguments {
    /// Network interface.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// PTP domain.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=127))]
    domain: u8,
    #[command(flatten)]
    leadership: LeadershipArguments,
    #[command(flatten)]
    clock: ClockArguments,
    /// End after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// The plan of a controller with the address `bind`.
///
/// # Errors
/// Arguments that contradict each other, or no interface.
pub fn plan(
    time: &TimeArguments,
    leadership: &LeadershipArguments,
    clock: &ClockArguments,
    bind: Option<Ipv4Addr>,
) -> Result<TimePlan, CliError> {
    let plan = clock.plan();
    let place = || {
        let own = || bind.filter(|address| !address.is_unspecified()).and_then(interfaces::name_of);
        let interface = time.interface.clone().or_else(own).ok_or(
            "PTP needs a network interface: expected --time-interface IF, or --bind with the address of one",
        )?;
        Ok::<_, CliError>(PtpPlace { interface, domain: time.domain })
    };
    match time.source {
        TimeFrom::Host => Ok(TimePlan::Host(plan)),
        TimeFrom::Ptp if plan != ClockPlan::default() => {
            Err("--time ptp follows the clock of another: expected no --clock-offset, --clock-drift and --clock-step"
                .into())
        }
        TimeFrom::Ptp => Ok(TimePlan::Ptp(place()?, DurationNs::from_micros(time.threshold.into()))),
        TimeFrom::Grandmaster => Ok(TimePlan::Grandmaster(place()?, leadership.leadership(), plan)),
    }
}

/// Starts the time of a controller, and waits until others share it: `limit` at most.
///
/// # Errors
/// No time, or none within the limit.
pub fn start(
    plan: TimePlan,
    limit: Duration,
    progress: &mut Progress,
    stop: &AtomicBool,
) -> Result<ControllerTime, CliError> {
    let is_host = matches!(plan, TimePlan::Host(_));
    let mut time = ControllerTime::start(plan)?;
    if is_host {
        return Ok(time);
    }
    let end = Instant::now() + limit;
    let mut said = None;
    loop {
        let waits = match time.readiness()? {
            Readiness::Ready => {
                progress.step(&format!("time: {}", time.description()));
                return Ok(time);
            }
            Readiness::Waits(waits) => waits,
        };
        if said.as_ref() != Some(&waits) {
            progress.step(&format!("time: {waits}"));
            said = Some(waits.clone());
        }
        if stop.load(Ordering::Relaxed) {
            return Err("ended before the time was synchronized".into());
        }
        if Instant::now() > end {
            let limit = limit.as_secs();
            return Err(
                format!("expected a synchronized time within {limit} s (--time-limit): {waits}").into()
            );
        }
        std::thread::sleep(LOOK);
    }
}

/// A grandmaster that tells its time until it is ended.
///
/// # Errors
/// No sockets, or it has ended by itself.
pub fn grandmaster(arguments: &GrandmasterArguments) -> Result<ExitCode, CliError> {
    let stop = stop_after(arguments.seconds)?;
    let place = PtpPlace { interface: arguments.interface.clone(), domain: arguments.domain };
    let plan = TimePlan::Grandmaster(place, arguments.leadership.leadership(), arguments.clock.plan());
    let mut time = ControllerTime::start(plan)?;
    let mut said = None;
    while !stop.load(Ordering::Relaxed) {
        time.readiness()?;
        let description = time.description();
        if said.as_ref() != Some(&description) {
            println!("{description}");
            said = Some(description);
        }
        std::thread::sleep(LOOK);
    }
    Ok(ExitCode::SUCCESS)
}
