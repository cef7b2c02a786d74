//! `axisbridge scan`: what is on the south bus, and a configuration to begin with.

use std::process::ExitCode;
use std::sync::atomic::Ordering;

use profile_generic::time::DurationNs;
use profile_sercos::master::config::{MasterConfig, Ports};

use super::progress::Progress;
use super::{BusArguments, CliError, ScanArguments, print, scan_can, signal};
use crate::config::{Config, Link};
use crate::engine::build::Host;
use crate::engine::build::sercos::master_config;
use crate::engine::port::EthernetPort;
use crate::mapping::Mapping;
use crate::runner::port::PacketPort;
use crate::scan::{self, Bus, Scanner};
use crate::simulate::drives::{InProcessDrives, SIMULATED_MAC};
use crate::sys::clock;

/// Cycle that is declared where there is no configuration. No cycle of this length is run: the scan ends in CP2.
const CYCLE_NS: u32 = 2_000_000;

/// Longest time of a scan: 511 slaves with a busy service channel take less.
const LIMIT: DurationNs = DurationNs::from_secs(120);

/// What a scan has found.
pub struct Scanned {
    /// Remarks on what is there, and a configuration if there is a drive to begin with: the whole is a file that `axisbridge run`
    /// takes.
    pub text: String,
    /// The text has a configuration.
    pub has_starter: bool,
    /// What is there, for programs.
    pub json: serde_json::Value,
    /// Something is there, and nothing is odd.
    pub good: bool,
}

/// Looks at the bus and prints what is there.
///
/// # Errors
/// As [`find`]; the output cannot be written.
pub fn run(arguments: &ScanArguments) -> Result<ExitCode, CliError> {
    let scanned = find(&arguments.bus, arguments.json)?;
    let output = if arguments.json { format!("{:#}\n", scanned.json) } else { scanned.text };
    print(output, if scanned.good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Looks at the bus, with its progress on standard error unless it is `quiet`.
///
/// # Errors
/// The configuration is faulty, the interface cannot be opened.
pub fn find(arguments: &BusArguments, quiet: bool) -> Result<Scanned, CliError> {
    if let Some(interface) = arguments.interface.as_deref().filter(|_| arguments.ring.is_none())
        && scan_can::is_can(interface)?
    {
        return scan_can::find(interface, quiet);
    }
    let config = arguments.config.as_deref().map(Config::load).transpose()?;
    let mapping = Mapping::embedded()?;
    let sercos = match &config {
        Some(config) => Some(
            config
                .sercos
                .as_ref()
                .ok_or("expected [south.sercos] in the configuration: the scan is of SERCOS III")?,
        ),
        None => None,
    };
    let link = match (sercos, &arguments.interface) {
        (Some(sercos), _) => sercos.link.clone(),
        (None, Some(name)) => Link::Interface { name: name.clone(), ring: arguments.ring.clone() },
        // clap lets nothing else through.
        (None, None) => return Err("expected --config FILE or --interface IF".into()),
    };
    let (mut south, mac): (Box<dyn EthernetPort>, _) = match (&link, config.as_ref().zip(sercos)) {
        (Link::Interface { name, ring }, _) => {
            let port = PacketPort::open(name, ring.as_deref())?;
            let mac = port.mac();
            (Box::new(port), mac)
        }
        (Link::InProcess { .. }, Some((config, sercos))) => {
            (Box::new(InProcessDrives::of(config, sercos, None)), SIMULATED_MAC)
        }
        (Link::InProcess { .. }, None) => return Err("there are no drives in this process".into()),
    };
    let master = match sercos {
        Some(sercos) => master_config(sercos, Host { mac, incarnation: 1 }),
        None => MasterConfig {
            ports: if link.has_ring() { Ports::Both } else { Ports::One },
            ..MasterConfig::new(mac, CYCLE_NS)
        },
    };
    let interface = match &link {
        Link::InProcess { .. } => "in-process",
        Link::Interface { name, .. } => name,
    };
    let stop = signal::stop_on_signals()?;
    let mut progress = Progress::new(quiet);
    progress.step(&format!("scanning {interface}"));
    let mut scanner = Scanner::new(master)?;
    let end = clock::monotonic_now() + LIMIT;
    loop {
        let now = clock::monotonic_now();
        if stop.load(Ordering::Relaxed) {
            scanner.give_up("interrupted");
        } else if end <= now {
            scanner.give_up("not done in time");
        }
        if scanner.step(now, &mut *south) {
            break;
        }
        let Some(at) = scanner.wake_at() else { break };
        clock::sleep_until(at)?;
    }
    let bus = scanner.finish();
    let starter = scan::starter(&bus, &link);
    let good =
        bus.findings.is_empty() && !bus.slaves.is_empty() && !bus.slaves.iter().any(|slave| slave.lost);
    Ok(Scanned {
        text: report(&bus, &mapping, starter.as_deref(), interface, config.as_ref()),
        has_starter: starter.is_some(),
        json: scan::json(&bus, &mapping.dictionaries.sercos),
        good,
    })
}

/// What was found as remarks, and behind it a configuration: the whole is a file that `axisbridge run` takes.
fn report(
    bus: &Bus,
    mapping: &Mapping,
    starter: Option<&str>,
    interface: &str,
    config: Option<&Config>,
) -> String {
    let mut remarks = format!("axisbridge scan of {interface}: ");
    remarks.push_str(&scan::text(bus, &mapping.dictionaries.sercos));
    if let Some(config) = config {
        for difference in differences(bus, config) {
            remarks.push_str(&format!("\n! {difference}"));
        }
    }
    let mut out = String::new();
    for line in remarks.lines() {
        out.push_str(format!("# {line}").trim_end());
        out.push('\n');
    }
    if let Some(starter) = starter {
        out.push('\n');
        out.push_str(starter);
    }
    out
}

/// Where the bus is another one than the configuration says.
fn differences(bus: &Bus, config: &Config) -> Vec<String> {
    let Some(sercos) = &config.sercos else { return Vec::new() };
    let drives = &sercos.drives;
    let missing = drives.iter().filter(|drive| bus.slaves.iter().all(|slave| slave.address != drive.address));
    let missing = missing.map(|drive| {
        format!("drive \"{}\" of the configuration, address {}, is not there", drive.name, drive.address)
    });
    let unknown = bus.slaves.iter().filter(|slave| drives.iter().all(|drive| slave.address != drive.address));
    let unknown =
        unknown.map(|slave| format!("the slave with address {} is not in the configuration", slave.address));
    missing.chain(unknown).collect()
}
