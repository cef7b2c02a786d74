//! `axisbridge simulate`: the other sides as processes of their own.

use std::net::Ipv4Addr;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use profile_cia402::wire::NodeId;
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::mode::OperatingMode;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::progress::Progress;
use super::report::{AxisResult, RunResult, failure};
use super::{
    CanDriveArguments, CliError, ControllerArguments, DevicenetDriveArguments, DevicenetDriveKind,
    SercosDriveArguments, script, signal,
};
use crate::config::DevicenetKind;
use crate::mapping::Mapping;
use crate::simulate::can_actor::Actor;
use crate::simulate::can_drive;
use crate::simulate::can_process;
use crate::simulate::can_twin;
use crate::simulate::controller::{self, Endpoints};
use crate::simulate::controller_time::ControllerTime;
use crate::simulate::devicenet_drive;
use crate::simulate::drive_events::console::{Director, say, typed_lines};
use crate::simulate::drive_events::{Names, Script};
use crate::simulate::drives::{self, DriveLine, LineKind};
use crate::simulate::program::{self, AxisPlan};
use crate::simulate::sercos_twin::Twin;
use crate::simulate::setup;
use crate::sys::can_interface;
use crate::sys::can_socket::{self, CanSocket};
use crate::sys::clock;
use crate::sys::packet_socket::{self, ETHER_TYPE_SERCOS, PacketSocket};
use crate::sys::realtime;

/// `SCHED_FIFO` priority of simulated drives: above a master on the same host, as hardware would answer.
const DRIVE_PRIORITY: u8 = 85;

/// How often it is said that an interface is down.
const DOWN_SAID_EVERY: Duration = Duration::from_secs(10);

/// How often an interface that is down is looked at.
const DOWN_WAIT: Duration = Duration::from_millis(100);

/// How far from its target an axis may end, in its units.
const WINDOW: f64 = 0.005;

/// A line of simulated drives on a network interface.
pub fn sercos_drive(arguments: &SercosDriveArguments) -> Result<ExitCode, CliError> {
    let last = arguments.address.checked_add(arguments.slaves - 1).filter(|last| *last <= 511);
    let Some(last) = last else {
        return Err(format!(
            "expected addresses up to 511, got {} drives from address {}",
            arguments.slaves, arguments.address
        )
        .into());
    };
    if let Some(unknown) =
        arguments.linear.iter().find(|address| !(arguments.address..=last).contains(*address))
    {
        return Err(
            format!("--linear {unknown}: expected an address of {} to {last}", arguments.address).into()
        );
    }
    let names = Names { what: "drive", numbers: arguments.address..=last };
    let script = events(arguments.script.as_deref(), &names)?;
    let kind =
        |address: &u16| if arguments.linear.contains(address) { UnitKind::Linear } else { UnitKind::Rotary };
    let addresses = (arguments.address..=last).map(|address| (address, kind(&address)));
    let ring = arguments.ring.is_some();
    let idns = |list: &String| -> Result<Vec<Idn>, CliError> {
        let idn =
            |text: &str| text.trim().parse::<Idn>().map_err(|error| format!("--fixed-lists {list}: {error}"));
        Ok(list.split(',').map(idn).collect::<Result<_, _>>()?)
    };
    let line = match arguments.fixed_lists.as_slice() {
        [to, from] => LineKind::Fixed([idns(to)?, idns(from)?]),
        _ if arguments.hot_plug => LineKind::HotPlug,
        _ => LineKind::Plain,
    };
    let twin = arguments.like.as_deref().map(Twin::load).transpose()?;
    let mut drives = DriveLine::like(addresses, ring, &line, &script.setup, twin.as_ref())?;
    let stop = stop_after(arguments.seconds)?;
    let mut sockets = ArrayVec::new();
    for interface in std::iter::once(&arguments.interface).chain(&arguments.ring) {
        let open = || PacketSocket::open(interface, ETHER_TYPE_SERCOS);
        let is_down = |error: &_| matches!(error, packet_socket::OpenError::InterfaceDown { .. });
        let Some(socket) = when_up(interface, &stop, open, is_down)? else { return Ok(ExitCode::SUCCESS) };
        sockets.push(socket);
    }
    // Before the priority of this thread rises: typing needs none.
    let lines = typed_lines()?;
    // Without it the drives answer later, which the master counts; nothing else changes.
    let refused = ask_for_real_time();
    let mut progress = Progress::new(false);
    progress.step(&format!(
        "{} drives with addresses {} to {last} on {}{}",
        arguments.slaves,
        arguments.address,
        arguments.ring.iter().fold(arguments.interface.clone(), |all, ring| format!("{all}, {ring}")),
        refused
    ));
    let mut director = Director::new(names, script, clock::monotonic_now(), lines);
    drives::run(&mut drives, &sockets, &mut director, &stop)?;
    Ok(ExitCode::SUCCESS)
}

/// A simulated CiA 402 drive on a CAN interface.
pub fn can_drive(arguments: &CanDriveArguments) -> Result<ExitCode, CliError> {
    let twin = arguments.like.as_deref().map(can_twin::Sheet::load).transpose()?;
    let of_sheet = twin.as_ref().and_then(can_twin::Sheet::node);
    let node = arguments.node.map(NodeId::new).transpose()?.or(of_sheet);
    let axes = twin.as_ref().map_or(arguments.axes.unwrap_or(1), can_twin::Sheet::axes);
    let names = Names { what: "axis", numbers: 1..=u16::from(axes) };
    let script = events(arguments.script.as_deref(), &names)?;
    // Two that wait for a node-id must not be one to LSS.
    let own = || node.map_or_else(std::process::id, |node| u32::from(node.get()));
    let serial = arguments.serial.unwrap_or_else(own);
    let mut drive = match twin {
        None => can_drive::drive_with(node, serial, axes, &script.setup)?,
        Some(sheet) => {
            for oddity in sheet.oddities() {
                eprintln!("{oddity}");
            }
            sheet.drive(node, serial, &script.setup)?
        }
    };
    drive.set_sync_cycles(arguments.sync_losses);
    if let Some(path) = &arguments.eds {
        std::fs::write(path, drive.eds()).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let stop = stop_after(arguments.seconds)?;
    let Some(mut socket) = can_socket_when_up(&arguments.interface, &stop)? else {
        return Ok(ExitCode::SUCCESS);
    };
    let lines = typed_lines()?;
    // Without it the drive answers later; nothing else changes.
    let refused = ask_for_real_time();
    let mut progress = Progress::new(false);
    progress.step(&format!(
        "a drive with {} on {}, {}{}",
        if axes == 1 { "one axis".into() } else { format!("{axes} axes") },
        arguments.interface,
        node.map_or(format!("with serial number {serial}, waiting for a node-id"), |node| format!(
            "node {node}"
        )),
        refused
    ));
    let mut director = Director::new(names, script, clock::monotonic_now(), lines);
    can_process::run(&mut Actor::new(drive), &mut socket, &mut director, &stop)?;
    Ok(ExitCode::SUCCESS)
}

/// A simulated drive on a DeviceNet.
pub fn devicenet_drive(arguments: &DevicenetDriveArguments) -> Result<ExitCode, CliError> {
    let mac = MacId::new(arguments.mac).ok_or("expected a MAC ID of 0 to 63")?;
    let (kind, shown) = match arguments.kind {
        DevicenetDriveKind::Motion => {
            let modes = vec![OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
            (
                DevicenetKind::Motion { modes, resolution: arguments.resolution },
                "a CIP Motion drive".to_owned(),
            )
        }
        DevicenetDriveKind::AcDc => {
            let assembly = Assembly(arguments.assembly);
            (DevicenetKind::Speed { assembly, scale: 0 }, format!("a velocity drive with {assembly}"))
        }
    };
    let names = Names { what: "MAC ID", numbers: arguments.mac.into()..=arguments.mac.into() };
    let script = events(arguments.script.as_deref(), &names)?;
    let stop = stop_after(arguments.seconds)?;
    let Some(mut socket) = can_socket_when_up(&arguments.interface, &stop)? else {
        return Ok(ExitCode::SUCCESS);
    };
    // A virtual interface has no rate.
    let rate = can_interface::state(&arguments.interface).ok().and_then(|state| state.nominal);
    let known = [DataRate::Rate125, DataRate::Rate250, DataRate::Rate500];
    let rate = known.into_iter().find(|known| rate == Some(known.bits_per_second()));
    let node = devicenet_drive::node_with(mac, rate.unwrap_or_default(), &kind, &script.setup)?;
    let lines = typed_lines()?;
    // Without it the drive answers later; nothing else changes.
    let refused = ask_for_real_time();
    let mut progress = Progress::new(false);
    progress.step(&format!("{shown} on {}, MAC ID {mac}{refused}", arguments.interface));
    let mut director = Director::new(names, script, clock::monotonic_now(), lines);
    can_process::run(&mut Actor::new(node), &mut socket, &mut director, &stop)?;
    Ok(ExitCode::SUCCESS)
}

/// The script of simulated drives; an empty one where none is named.
fn events(path: Option<&Path>, names: &Names) -> Result<Script, CliError> {
    Ok(path.map(|path| Script::load(path, names)).transpose()?.unwrap_or_default())
}

/// Opens a CAN interface as soon as it is up; `None` when the process is to end before.
fn can_socket_when_up(interface: &str, stop: &AtomicBool) -> Result<Option<CanSocket>, CliError> {
    let open = || CanSocket::open(interface, &can_socket::Options::default());
    let is_down = |error: &_| matches!(error, can_socket::OpenError::InterfaceDown { .. });
    Ok(when_up(interface, stop, open, is_down)?)
}

/// Opens an interface as soon as it is up; `None` when the process is to end before.
fn when_up<S, E>(
    interface: &str,
    stop: &AtomicBool,
    mut open: impl FnMut() -> Result<S, E>,
    is_down: impl Fn(&E) -> bool,
) -> Result<Option<S>, E> {
    let start = clock::monotonic_now();
    let mut said: Option<Instant> = None;
    while !stop.load(Ordering::Relaxed) {
        match open() {
            Err(error) if is_down(&error) => {
                if said.is_none_or(|said| said.elapsed() >= DOWN_SAID_EVERY) {
                    say(clock::monotonic_now(), start, &format!("waiting for {interface}: link down"));
                    said = Some(Instant::now());
                }
                std::thread::sleep(DOWN_WAIT);
            }
            opened => return opened.map(Some),
        }
    }
    Ok(None)
}

/// A flag that a signal sets, or the time that the process was given.
pub(super) fn stop_after(seconds: Option<u64>) -> Result<Arc<AtomicBool>, CliError> {
    let stop = signal::stop_on_signals()?;
    if let Some(seconds) = seconds {
        end_after(Arc::clone(&stop), seconds);
    }
    Ok(stop)
}

/// Asks for the scheduling of a drive. Returns what was refused, in brackets behind a space; empty when all was granted.
fn ask_for_real_time() -> String {
    let request = realtime::Request { priority: Some(DRIVE_PRIORITY), ..realtime::Request::default() };
    let refused = realtime::apply(&request).refused().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    if refused.is_empty() { refused } else { format!(" ({refused})") }
}

fn end_after(stop: Arc<AtomicBool>, seconds: u64) {
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(seconds));
        stop.store(true, Ordering::Relaxed);
    });
}

/// The time of a controller with the address `bind`, as soon as others share it.
pub fn controller_time(
    arguments: &ControllerArguments,
    bind: Option<Ipv4Addr>,
    progress: &mut Progress,
    stop: &AtomicBool,
) -> Result<ControllerTime, CliError> {
    let ControllerArguments { time, leadership, clock, .. } = arguments;
    let plan = super::time::plan(time, leadership, clock, bind)?;
    super::time::start(plan, Duration::from_secs(time.limit.into()), progress, stop)
}

/// A CIP Motion controller that moves the axes of a device.
pub fn controller(arguments: &ControllerArguments) -> Result<ExitCode, CliError> {
    if let Some(path) = &arguments.script {
        return script::run(arguments, path);
    }
    let Some(target) = arguments.target else { return Err("expected --target ADDR".into()) };
    let stop = signal::stop_on_signals()?;
    let seconds = f64::from(arguments.seconds);
    let counts = |axis: usize| {
        let last = arguments.counts_per_unit.last().copied().unwrap_or(setup::COUNTS_PER_UNIT);
        f64::from(arguments.counts_per_unit.get(axis).copied().unwrap_or(last))
    };
    let speed = |axis: usize| {
        let last = arguments.speed.last().copied().unwrap_or(setup::SPEED);
        arguments.speed.get(axis).copied().unwrap_or(last)
    };
    let axes: Vec<_> = (0..usize::from(arguments.axes)).map(counts).collect();
    let plans: Vec<_> = (1..=arguments.axes)
        .map(|axis| AxisPlan::new(axis, speed(usize::from(axis) - 1), setup::REACH, WINDOW, seconds))
        .collect();
    let mapping = Mapping::embedded()?;
    let config = setup::controller(&mapping, &axes, arguments.update_period_us);
    let endpoints = Endpoints { target, bind: arguments.bind.unwrap_or(Ipv4Addr::UNSPECIFIED) };
    let mut progress = Progress::new(arguments.json);
    let mut time = controller_time(arguments, arguments.bind, &mut progress, &stop)?;
    let steps = program::standard(&plans, seconds);
    let report = controller::run(endpoints, config, &mut time, steps, &stop, &mut |event| {
        progress.step(&event.to_string());
    })?;
    let result =
        RunResult { axes: AxisResult::all(&plans, &report), capture: None, failure: failure(&report) };
    result.print(arguments.json)
}
