//! The drive of an axis without a gateway: `--alone`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use profile_generic::time::{DurationNs, MonotonicTime};

use super::drive::{Link, Reply};
use crate::alone::can::CanLine;
use crate::alone::devicenet::DevicenetLine;
use crate::alone::sercos::SercosLine;
use crate::alone::{Line, Session, Wait};
use crate::cli::progress::Progress;
use crate::cli::{CliError, signal};
use crate::config::{Axis, Config, DriveAt, Link as Wire};
use crate::engine::build::Host;
use crate::engine::build::devicenet::explicit_master;
use crate::engine::build::sercos::master_config;
use crate::engine::port::EthernetPort;
use crate::mapping::Mapping;
use crate::parameter::known::Catalogue;
use crate::runner::port::{PacketPort, PortError};
use crate::runner::{StartError, can_port};
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::drives::{InProcessDrives, SIMULATED_MAC};
use crate::sys::clock;
use crate::sys::interface_lock::LockError;

/// Longest sleep: frames come at any time.
const PATIENCE: DurationNs = DurationNs::from_millis(1);

/// A drive on its bus.
pub struct Alone {
    session: Session,
    stop: Arc<AtomicBool>,
}

impl Alone {
    /// Takes the bus of an axis up.
    pub fn open(config: &Path, axis: &str) -> Result<Self, CliError> {
        let config = Config::load(config)?;
        let mapping = Mapping::load(config.mappings_dir.as_deref(), &config.overlays)?;
        let names: Vec<String> = config.axes.iter().map(|axis| axis.name.clone()).collect();
        let number = names.iter().position(|name| name == axis);
        let number = number.ok_or_else(|| format!("unknown axis `{axis}`: expected {}", names.join(", ")))?;
        let line = line(&config, &config.axes[number])?;
        let stop = signal::stop_on_signals()?;
        let mut progress = Progress::new(false);
        progress.at(|| "starting the bus".to_owned());
        let catalogue = Catalogue::of(&config, &mapping);
        let go_on = || !stop.load(Ordering::Relaxed);
        let session = Session::open(line, wait(), (names, number), catalogue, go_on);
        progress.clear();
        Ok(Self { session: session?, stop })
    }
}

impl Link for Alone {
    fn ask(&mut self, request: &str) -> Result<Reply, CliError> {
        // A command that was started is to be cancelled even now.
        if self.stop.load(Ordering::Relaxed) && !request.starts_with("command ") {
            return Err("interrupted".into());
        }
        Ok(Reply::of(&self.session.ask(request)?))
    }

    fn stop(&mut self) -> Result<Arc<AtomicBool>, CliError> {
        Ok(Arc::clone(&self.stop))
    }

    fn is_alone(&self) -> bool {
        true
    }
}

/// Sleeps in the time of the host.
fn wait() -> Wait {
    Box::new(|until: Option<MonotonicTime>| {
        let latest = clock::monotonic_now() + PATIENCE;
        // A sleep that fails is a short one.
        let _ = clock::sleep_until(until.map_or(latest, |at| at.min(latest)));
        clock::monotonic_now()
    })
}

/// The bus of an axis.
fn line(config: &Config, axis: &Axis) -> Result<Box<dyn Line>, CliError> {
    match axis.drive {
        DriveAt::Sercos { .. } => {
            let both = config.sercos.as_ref().zip(config.sercos_drive(axis));
            let (sercos, drive) = both.ok_or("expected [south.sercos] in the configuration")?;
            let (port, mac): (Box<dyn EthernetPort>, _) = match &sercos.link {
                Wire::Interface { name, ring } => {
                    let port = PacketPort::open(name, ring.as_deref())
                        .map_err(|error| no_port(&StartError::Interface(error)))?;
                    let mac = port.mac();
                    (Box::new(port), mac)
                }
                Wire::InProcess { .. } => {
                    (Box::new(InProcessDrives::of(config, sercos, None)), SIMULATED_MAC)
                }
            };
            let master = master_config(sercos, Host { mac, incarnation: 1 });
            Ok(Box::new(SercosLine::new(master, port, drive.address)?))
        }
        DriveAt::Can { .. } => {
            let (can, drive) = config.can_drive(axis).ok_or("expected [[south.can]] in the configuration")?;
            // Nobody watches the interface for long.
            let mut watches = Vec::new();
            let port = can_port(&can.link, can.bit_rate, &mut watches, None, |tap| {
                Box::new(InProcessCan::of(can, tap).in_host_time(can.cycle_time))
            });
            let port = port.map_err(|error| no_port(&error))?;
            let axes = can.drives.iter().filter(|other| other.node == drive.node).map(|other| other.axis);
            Ok(Box::new(CanLine::new(port, drive.node, axes)))
        }
        DriveAt::Devicenet { .. } => {
            let found = config.devicenet_drive(axis);
            let (network, drive) = found.ok_or("expected [[south.devicenet]] in the configuration")?;
            let mut watches = Vec::new();
            let port = can_port(&network.link, network.bit_rate(), &mut watches, None, |tap| {
                Box::new(InProcessCan::of_devicenet(network, tap).in_host_time(network.cycle_time))
            });
            let port = port.map_err(|error| no_port(&error))?;
            let master = explicit_master(config, network, drive);
            Ok(Box::new(DevicenetLine::new(master, port, drive.mac, &drive.kind)?))
        }
    }
}

/// Why an interface cannot be used; of one that has a master, what to do.
fn no_port(error: &StartError) -> CliError {
    let hint = match error {
        StartError::Lock(LockError::Held { .. })
        | StartError::Interface(PortError::Lock(LockError::Held { .. })) => {
            "\nif that is a gateway, leave out --alone: it gives access to its drives (--local SOCKET)"
        }
        _ => "",
    };
    format!("{error}{hint}").into()
}
