//! `axisbridge simulate`: the other sides as processes of their own.

use std::net::Ipv4Addr;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use arrayvec::ArrayVec;
use profile_cia402::wire::NodeId;
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::mode::OperatingMode;
use profile_generic::scaling::UnitKind;

use super::progress::Progress;
use super::report::{AxisResult, RunResult, failure};
use super::{
    CanDriveArguments, CliError, ControllerArguments, DevicenetDriveArguments, DevicenetDriveKind,
    SercosDriveArguments, script, signal,
};
use crate::config::DevicenetKind;
use crate::mapping::Mapping;
use crate::simulate::can_drive;
use crate::simulate::can_process;
use crate::simulate::controller::{self, Endpoints};
use crate::simulate::devicenet_drive;
use crate::simulate::drives;
use crate::simulate::program::{self, AxisPlan};
use crate::simulate::setup;
use crate::sys::can_interface;
use crate::sys::can_socket::{self, CanSocket};
use crate::sys::packet_socket::{ETHER_TYPE_SERCOS, PacketSocket};
use crate::sys::realtime;

/// `SCHED_FIFO` priority of simulated drives: above a master on the same host, as hardware would answer.
const DRIVE_PRIORITY: u8 = 85;

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
        arguments.linear.iter().find(|address| !(arguments.address..=last).contains(address))
    {
        return Err(
            format!("--linear {unknown}: expected an address of {} to {last}", arguments.address).into()
        );
    }
    let mut sockets = ArrayVec::new();
    sockets.push(PacketSocket::open(&arguments.interface, ETHER_TYPE_SERCOS)?);
    if let Some(ring) = &arguments.ring {
        sockets.push(PacketSocket::open(ring, ETHER_TYPE_SERCOS)?);
    }
    let kind =
        |address: &u16| if arguments.linear.contains(address) { UnitKind::Linear } else { UnitKind::Rotary };
    let addresses = (arguments.address..=last).map(|address| (address, kind(&address)));
    let ring = arguments.ring.is_some();
    let mut drives = if arguments.hot_plug {
        drives::hot_plug_drives(addresses, ring)
    } else {
        drives::drives(addresses, ring)
    };
    let stop = signal::stop_on_signals()?;
    if let Some(seconds) = arguments.seconds {
        end_after(Arc::clone(&stop), seconds);
    }
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
    drives::run(&mut drives, &sockets, &stop)?;
    Ok(ExitCode::SUCCESS)
}

/// A simulated CiA 402 drive on a CAN interface.
pub fn can_drive(arguments: &CanDriveArguments) -> Result<ExitCode, CliError> {
    let node = arguments.node.map(NodeId::new).transpose()?;
    let mut drive = can_drive::drive(node, arguments.axes)?;
    drive.set_sync_cycles(arguments.sync_losses);
    if let Some(path) = &arguments.eds {
        std::fs::write(path, drive.eds()).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let mut socket = CanSocket::open(&arguments.interface, &can_socket::Options::default())?;
    let stop = signal::stop_on_signals()?;
    if let Some(seconds) = arguments.seconds {
        end_after(Arc::clone(&stop), seconds);
    }
    // Without it the drive answers later; nothing else changes.
    let refused = ask_for_real_time();
    let mut progress = Progress::new(false);
    progress.step(&format!(
        "a drive with {} on {}, {}{}",
        if arguments.axes == 1 { "one axis".into() } else { format!("{} axes", arguments.axes) },
        arguments.interface,
        node.map_or("waiting for a node-id".into(), |node| format!("node {node}")),
        refused
    ));
    can_process::run(&mut drive, &mut socket, &stop)?;
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
    let mut socket = CanSocket::open(&arguments.interface, &can_socket::Options::default())?;
    // A virtual interface has no rate.
    let rate = can_interface::state(&arguments.interface).ok().and_then(|state| state.nominal);
    let known = [DataRate::Rate125, DataRate::Rate250, DataRate::Rate500];
    let rate = known.into_iter().find(|known| rate == Some(known.bits_per_second()));
    let mut node = devicenet_drive::node(mac, rate.unwrap_or_default(), &kind);
    let stop = signal::stop_on_signals()?;
    if let Some(seconds) = arguments.seconds {
        end_after(Arc::clone(&stop), seconds);
    }
    // Without it the drive answers later; nothing else changes.
    let refused = ask_for_real_time();
    let mut progress = Progress::new(false);
    progress.step(&format!("{shown} on {}, MAC ID {mac}{refused}", arguments.interface));
    can_process::run(&mut node, &mut socket, &stop)?;
    Ok(ExitCode::SUCCESS)
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
    let endpoints =
        Endpoints { target, bind: arguments.bind.unwrap_or(Ipv4Addr::UNSPECIFIED), clock: arguments.clock() };
    let mut progress = Progress::new(arguments.json);
    let steps = program::standard(&plans, seconds);
    let report =
        controller::run(endpoints, config, steps, &stop, &mut |event| progress.step(&event.to_string()))?;
    let result =
        RunResult { axes: AxisResult::all(&plans, &report), capture: None, failure: failure(&report) };
    result.print(arguments.json)
}
