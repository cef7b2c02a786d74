//! `axisbridge demo`: the whole chain in one process.
//!
//! A CIP Motion controller or a PLC on real TCP and UDP sockets, the gateway as `run` runs it, and behind it simulated drives inside the
//! process, which get and give the very same frames as on a wire: of SERCOS III, of CANopen, of DeviceNet, or
//! one of each. Controller and gateway read the host's clock, or are two clocks that follow a third one ([`clocks`]).

mod assembly;
mod clocks;
mod drives;
mod page;

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub use self::assembly::DemoNorth;
pub use self::clocks::DemoTime;
pub use self::drives::{DRIVES, DriveKind, configuration};
pub use self::page::PAGE;

use profile_cip::controller::ControllerConfig;

use self::clocks::Clocks;

use super::progress::Progress;
use super::report::{AxisResult, RunResult, failure};
use super::{CliError, DemoArguments, signal, usage};
use crate::bundle::Files;
use crate::config::Config;
use crate::mapping::Mapping;
use crate::runner::{self, RunningBox, StartError};
use crate::settings::Store;
use crate::simulate::clock::ClockPlan;
use crate::simulate::controller::{self, Endpoints};
use crate::simulate::controller_time::{ControllerTime, TimePlan};
use crate::simulate::program::{self, AxisPlan};
use crate::simulate::setup;
use crate::status::BoxState;

/// The demonstration's configuration with SERCOS III drives; only the address is chosen by the caller.
const CONFIGURATION: &str = include_str!("two-axes.toml");

/// The address that stands in the configuration.
const ADDRESS: &str = "127.0.0.2";

/// Update period of the controller in microseconds: four cycles of the bus, between which the gateway interpolates. A
/// controller on real-time hardware has a shorter one; here it has to live with the pauses of an ordinary host.
const UPDATE_PERIOD_US: u32 = 8_000;

/// What each axis has: speed in units per second, reach in units, window in units.
const AXES: [(f64, f64, f64); 3] = [(2.0, 600.0, 0.002), (40.0, 700.0, 0.02), (3.0, 600.0, 0.004)];

/// How long the buses may take to cyclic operation.
const START_TIME_OUT: Duration = Duration::from_secs(20);

/// The last communication phase; what comes after has no number.
const CYCLIC_PHASE: u8 = 4;

/// How often the start is looked at.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// What came of the axes.
struct Ran {
    axes: Vec<AxisResult>,
    failure: Option<String>,
}

/// Runs the demonstration.
pub fn run(arguments: &DemoArguments) -> Result<ExitCode, CliError> {
    let by_assembly = arguments.north == DemoNorth::Assembly;
    if by_assembly && arguments.time == DemoTime::Ptp {
        return Ok(usage("--north assembly has no time of its own: expected --time host"));
    }
    let [stop, hurry] = signal::stop_and_hurry_on_signals()?;
    let mut progress = Progress::new(arguments.json);
    let clocks = match arguments.time {
        DemoTime::Host => None,
        DemoTime::Ptp => Some(Clocks::start(arguments.listen, &mut progress)?),
    };
    let listen = clocks.as_ref().map_or(arguments.listen, |_| clocks::GATEWAY);
    let text = drives::configuration(&arguments.drives).replace(ADDRESS, &listen.to_string());
    let text = if by_assembly { assembly::with_assemblies(&text) } else { text };
    let text = if clocks.is_some() { text.replace(clocks::SHARED, clocks::PTP) } else { text };
    let text = arguments.page.map_or_else(|| text.clone(), |address| page::with_page(&text, address));
    let config = Config::parse(&text, "demo.toml")?;
    let mapping = Mapping::embedded()?;
    let seconds = f64::from(arguments.seconds);
    let plans: Vec<_> = (1..)
        .zip(AXES)
        .take(config.axes.len())
        .map(|(axis, (speed, reach, window))| AxisPlan::new(axis, speed, reach, window, seconds))
        .collect();
    let counts: Vec<_> = config.axes.iter().map(|axis| f64::from(axis.motion_resolution)).collect();

    let settings = Arc::new(Store::open(None)?);
    let files = Files { configuration: text, findings: String::new() };
    let start = || {
        let extras = runner::Extras {
            capture: Some(&arguments.capture),
            local: None,
            histories: None,
            files: Some(&files),
        };
        runner::start(&config, mapping.clone(), extras, &settings).map_err(|error| in_use(error, listen))
    };
    let running = match &clocks {
        Some(clocks) => clocks.gateway.inside(start)??,
        None => start()?,
    };
    progress.step(&format!(
        "gateway on {listen}, {} simulated drives behind: {}",
        config.axes.len(),
        drives::title(&arguments.drives)
    ));
    if let Some(address) = arguments.page {
        let url = page::url(address);
        progress.step(&format!("page: {url}"));
        page::open(&url);
    }
    wait_until_ready(&running, &mut progress)?;

    let outcome = if by_assembly {
        let address = endpoints(listen).target;
        assembly::run(&config, address, (&plans, seconds), &mut progress, &stop).map_err(CliError::from)
    } else {
        let controller = setup::controller(&mapping, &counts, UPDATE_PERIOD_US);
        cip_motion(seconds, &running, (clocks.as_ref(), listen), controller, &plans, &mut progress, &stop)
    };
    let status = running.status();
    let stopped = running.stop(&|| hurry.load(Ordering::Relaxed));
    progress.step(&format!(
        "{} bus cycles, {} late, {} telegrams lost",
        status.counters.cycles, status.counters.late_cycles, status.counters.lost_telegrams
    ));
    if !stopped.unrested.is_empty() {
        return Err(stopped.unrested.join("\n").into());
    }
    if let Some(dropped) = stopped.recording.transpose()?.filter(|dropped| *dropped > 0) {
        eprintln!("warning: {dropped} frames are missing in the recording");
    }
    let Ran { axes, failure } = outcome?;
    let capture = Some(arguments.capture.display().to_string());
    RunResult { axes, capture, failure }.print(arguments.json)
}

/// Moves the axes by a CIP Motion controller.
fn cip_motion(
    seconds: f64,
    running: &RunningBox,
    (clocks, listen): (Option<&Clocks>, Ipv4Addr),
    controller_config: ControllerConfig,
    plans: &[AxisPlan],
    progress: &mut Progress,
    stop: &AtomicBool,
) -> Result<Ran, CliError> {
    let steps = program::standard(plans, seconds);
    let told = program::titles(plans);
    let run = |endpoints, time: &mut ControllerTime, progress: &mut Progress| {
        controller::run(endpoints, controller_config, time, steps, stop, &mut |event| {
            use profile_cip::controller::Event;
            match event {
                Event::StepStarted { step } => progress.step(told.get(*step).map_or("", String::as_str)),
                Event::StepFinished { .. } => {}
                event => progress.step(&event.to_string()),
            }
        })
    };
    let report = match clocks {
        Some(clocks) => clocks.controller.inside(|| {
            clocks::wait_for_gateway(running, progress, stop)?;
            let mut time = clocks.controller_time(progress, stop)?;
            let report = run(clocks::endpoints(), &mut time, progress)?;
            progress.step(&format!("time of the controller: {}", time.description()));
            Ok::<_, CliError>(report)
        })??,
        None => {
            let mut time = ControllerTime::start(TimePlan::Host(ClockPlan::default()))?;
            run(endpoints(listen), &mut time, progress)?
        }
    };
    Ok(Ran { axes: AxisResult::all(plans, &report), failure: failure(&report) })
}

/// The controller has an address of its own on loopback, so that both ends have UDP port 2222.
fn endpoints(listen: Ipv4Addr) -> Endpoints {
    let target = if listen.is_unspecified() { Ipv4Addr::new(127, 0, 0, 2) } else { listen };
    let [.., last] = target.octets();
    Endpoints { target, bind: Ipv4Addr::new(127, 0, 1, last) }
}

fn wait_until_ready(running: &RunningBox, progress: &mut Progress) -> Result<(), CliError> {
    let end = Instant::now() + START_TIME_OUT;
    let mut shown = None;
    loop {
        let status = running.status();
        if shown != Some(status.phase) && status.phase <= CYCLIC_PHASE {
            progress.step(&format!("SERCOS communication phase {}", status.phase));
            shown = Some(status.phase);
        }
        if status.state == BoxState::READY {
            progress.step("every drive is in cyclic operation");
            return Ok(());
        }
        if Instant::now() > end {
            let state = status.state;
            return Err(format!(
                "expected every bus in operation within {START_TIME_OUT:?}, the gateway is {state}"
            )
            .into());
        }
        std::thread::sleep(LOOK_INTERVAL);
    }
}

/// Says how another address is chosen when the default one is taken.
fn in_use(error: StartError, listen: Ipv4Addr) -> CliError {
    let [a, b, c, d] = listen.octets();
    let other = Ipv4Addr::new(a, b, c, d.wrapping_add(1));
    match error {
        StartError::Bind(_) | StartError::Serve(_) => {
            format!("{error}\nanother address is chosen with --listen, such as --listen {other}").into()
        }
        error => error.into(),
    }
}
