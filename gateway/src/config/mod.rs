//! The configuration file of the box: TOML in, a checked [`Config`] out.
//!
//! [`mod@file`] is the file as it is written: every key, what it means, its default. `check` turns it into the
//! types below, in which every reference is an index and every value is in range, or into [`Findings`]
//! that show each fault at its line.

mod axis;
mod can;
mod check;
mod device;
pub(crate) mod device_file;
mod devicenet;
pub(crate) mod duration;
mod elsewhere;
pub mod file;
pub(crate) mod form;
mod known_object;
mod named;
mod rated;
pub mod scalar;
mod sercos;
pub(crate) mod size;
mod startup_file;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use profile_cip::device::hosts::Hosts;
use profile_generic::time::DurationNs;

pub use self::axis::{Axis, AxisFunction, AxisKind, DriveAt, Limits, Nameplate, StoppingAction};
pub use self::can::{Can, CanDevice, CanDrive, CanLink, DeviceFile, Lss};
pub(crate) use self::check::{DEFAULT_ALLOWED_LOSSES, DEFAULT_JITTER, DEFAULT_PRIORITY};
pub use self::device::{Device, Identity};
pub use self::device_file::is_set_by_gateway;
pub use self::devicenet::{Devicenet, DevicenetDrive, DevicenetKind};
pub use self::known_object::KnownObject;
pub use self::sercos::{Drive, Link, Sercos};

use crate::finding::{Findings, Problem, Source, partial, read_file, registry as code, tree};

pub use self::named::Named;
use crate::modbus::map::Kind;
use crate::sys::realtime;

/// Axes of one box: what its status block, its register map and its cycle have room for. A device has at most 16 of
/// them (IEC 61800-7-302 clause 7.2).
pub const AXES_MAX: usize = 64;

/// Devices of one box: each axis could have one of its own.
pub const DEVICES_MAX: usize = AXES_MAX;

/// Bytes of a configuration file; a real one has a few thousand.
pub const FILE_LEN_MAX: u64 = 1 << 20;

/// A checked configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// Name of the box, for people.
    pub name: String,
    /// System time.
    pub time: Time,
    /// What is logged.
    pub log_level: LogLevel,
    /// The Modbus TCP server; `None` for none.
    pub modbus: Option<Modbus>,
    /// The HTTP server; `None` for none.
    pub http: Option<Http>,
    /// A folder of mapping tables in place of the built-in ones.
    pub mappings_dir: Option<PathBuf>,
    /// What is laid over the tables, files and folders, in this order.
    pub overlays: Vec<PathBuf>,
    /// Where what controllers set is kept; `None` keeps it until the process ends.
    pub settings_file: Option<PathBuf>,
    /// Where the history of faults is kept; `None` keeps it until the process ends.
    pub history_dir: Option<PathBuf>,
    /// The rolling recording; `None` for none.
    pub recording: Option<RollingRecording>,
    /// The CIP Motion devices seen by controllers.
    pub devices: Vec<Device>,
    /// All axes, in the order of the file.
    pub axes: Vec<Axis>,
    /// What to ask of the kernel for the cycle thread.
    pub realtime: realtime::Request,
    /// How long before its instant the work for a cycle begins.
    pub lead: DurationNs,
    /// The SERCOS III bus behind.
    pub sercos: Option<Sercos>,
    /// The CAN buses behind.
    pub can: Vec<Can>,
    /// The DeviceNet networks behind.
    pub devicenet: Vec<Devicenet>,
}

impl Config {
    /// Reads and checks a file. Paths in it count from the file's own folder.
    ///
    /// # Errors
    /// The file cannot be read, or what is wrong in it, each fault shown at its place.
    pub fn load(path: &Path) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        match Written::load(path, &mut findings) {
            Some(written) => Ok(written.config),
            None => Err(findings),
        }
    }

    /// Checks the text of a file; `name` is shown in errors.
    ///
    /// # Errors
    /// Every fault found.
    pub fn parse(source: &str, name: &str) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        match Written::parse(source, name, &mut findings) {
            Some(written) => Ok(written.config),
            None => Err(findings),
        }
    }

    /// The shortest cycle of the buses.
    #[must_use]
    pub fn cycle_time(&self) -> DurationNs {
        let sercos = self.sercos.iter().map(|sercos| sercos.cycle_time);
        let can = self.can.iter().map(|can| can.cycle_time);
        let devicenet = self.devicenet.iter().map(|network| network.cycle_time);
        sercos.chain(can).chain(devicenet).min().unwrap_or(DurationNs::ZERO)
    }

    /// The SERCOS drive of an axis; `None` when it is on another bus.
    #[must_use]
    pub fn sercos_drive(&self, axis: &Axis) -> Option<&Drive> {
        match axis.drive {
            DriveAt::Sercos { drive } => self.sercos.as_ref()?.drives.get(drive),
            DriveAt::Can { .. } | DriveAt::Devicenet { .. } => None,
        }
    }

    /// The CANopen drive of an axis and its bus; `None` when it is on another kind of bus.
    #[must_use]
    pub fn can_drive(&self, axis: &Axis) -> Option<(&Can, &CanDrive)> {
        match axis.drive {
            DriveAt::Sercos { .. } | DriveAt::Devicenet { .. } => None,
            DriveAt::Can { bus, drive } => {
                let bus = self.can.get(bus)?;
                Some((bus, bus.drives.get(drive)?))
            }
        }
    }

    /// The drive on DeviceNet of an axis and its network; `None` when it is on another kind of bus.
    #[must_use]
    pub fn devicenet_drive(&self, axis: &Axis) -> Option<(&Devicenet, &DevicenetDrive)> {
        match axis.drive {
            DriveAt::Sercos { .. } | DriveAt::Can { .. } => None,
            DriveAt::Devicenet { network, drive } => {
                let network = self.devicenet.get(network)?;
                Some((network, network.drives.get(drive)?))
            }
        }
    }

    /// The axes of a device, with their number in [`Config::axes`].
    pub fn axes_of(&self, device: usize) -> impl Iterator<Item = (usize, &Axis)> {
        self.axes.iter().enumerate().filter(move |(_, axis)| axis.device == device)
    }
}

/// A checked configuration with the text that it comes from.
#[derive(Debug)]
pub struct Written {
    /// The text, for messages.
    pub text: Source,
    /// The file as it is written.
    pub file: file::File,
    /// What it comes to.
    pub config: Config,
}

impl Written {
    /// Reads and checks a file; `None` with errors. Paths in it count from the file's own folder.
    pub fn load(path: &Path, findings: &mut Findings) -> Option<Self> {
        Self::read(path, findings).0
    }

    /// The same, with the tables that the file names: those are known although something else in it is wrong.
    pub fn read(path: &Path, findings: &mut Findings) -> (Option<Self>, Option<Named>) {
        let source = match read_file(path, FILE_LEN_MAX) {
            Ok(source) => source,
            Err(found) => {
                findings.extend(found);
                return (None, None);
            }
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.display().to_string();
        let written = Self::parse_in(folder, &source, &name, findings).map(|mut written| {
            let config = &mut written.config;
            let paths = config.mappings_dir.iter_mut().chain(&mut config.overlays);
            let of_http = config.http.iter_mut().flat_map(Http::paths);
            for path in paths.chain(&mut config.settings_file).chain(&mut config.history_dir).chain(of_http) {
                *path = folder.join(&*path);
            }
            written
        });
        (written, Some(Named::of(folder, &source, &name)))
    }

    /// Checks the text of a file, whose name is shown in errors; `None` with them. Paths count from the working directory.
    pub fn parse(source: &str, name: &str, findings: &mut Findings) -> Option<Self> {
        Self::parse_in(Path::new(""), source, name, findings)
    }

    fn parse_in(folder: &Path, source: &str, name: &str, findings: &mut Findings) -> Option<Self> {
        let text = Source::new(name, source);
        let tree = tree(source, &text, findings)?;
        if let Some(problem) = elsewhere::other_kind(tree.get_ref()) {
            findings.push(&text, problem);
            return None;
        }
        let hint = |problem: &Problem| elsewhere::home_of(problem).map(|home| problem.clone().help(home));
        let read = partial::<file::File>(tree, &text, findings, &hint)?;
        let file = read.rows;
        match check::check(&file) {
            Ok(config) if read.faultless => {
                let mut written = Self { text, file, config };
                let devices = device_file::load(folder, &mut written, findings);
                let lists = startup_file::load(folder, &mut written, findings);
                (devices && lists).then_some(written)
            }
            Ok(_) => None,
            Err(problems) => {
                // A name or a number may be lacking because its table has been left out.
                let follows = [code::CONFIG_REFERENCE, code::CONTRADICTION, code::CONFIG_VALUE];
                let own = |problem: &Problem| read.whole || !follows.contains(&problem.code);
                problems.into_iter().filter(own).for_each(|problem| findings.push(&text, problem));
                None
            }
        }
    }
}

/// System time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Time {
    /// Where it comes from.
    pub source: TimeSource,
    /// Interface on which PTP is followed; `None` for that of the first device.
    pub interface: Option<String>,
    /// PTP domain, 0 to 127.
    pub domain: u8,
    /// Largest offset of a clock that is called synchronized.
    pub threshold: DurationNs,
    /// By how much the way from the master is longer than the mean of both ways.
    pub asymmetry: DurationNs,
    /// The follower takes the time stamps of the network card where it has some.
    pub card_stamps: bool,
    /// Management socket of `ptp4l`.
    pub socket: PathBuf,
    /// Clock of the network card that `ptp4l` keeps; `None` for that of the interface, or the host's clock.
    pub phc: Option<PathBuf>,
}

impl Default for Time {
    fn default() -> Self {
        Self {
            source: TimeSource::Host,
            interface: None,
            domain: 0,
            threshold: DurationNs::from_micros(10),
            asymmetry: DurationNs::ZERO,
            card_stamps: true,
            socket: PathBuf::from("/var/run/ptp4l"),
            phc: None,
        }
    }
}

/// Where system time comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeSource {
    /// PTP, by the embedded follower.
    Ptp,
    /// PTP, by `ptp4l` on this host.
    Daemon,
    /// The host's clock, synchronized while a daemon keeps it: TAI where the kernel knows the offset, else UTC.
    Host,
    /// The host's clock, which the controllers read too.
    Shared,
    /// Nowhere: there is no common time.
    None,
}

impl TimeSource {
    /// Its name in the configuration.
    #[must_use]
    pub fn name(self) -> &'static str {
        check::time::SOURCES.iter().find(|(_, source)| *source == self).map_or("", |(name, _)| name)
    }
}

/// How much is logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Only what stops the box.
    Error,
    /// And what an operator should know.
    Warn,
    /// And what happens in normal operation.
    Info,
    /// And what helps to find a fault.
    Debug,
    /// And every step.
    Trace,
}

impl LogLevel {
    /// All levels.
    pub const ALL: [Self; 5] = [Self::Error, Self::Warn, Self::Info, Self::Debug, Self::Trace];

    /// The level's name in the file and in filters.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warn => "warn",
            Self::Info => "info",
            Self::Debug => "debug",
            Self::Trace => "trace",
        }
    }
}

/// The Modbus TCP server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Modbus {
    /// Where it listens.
    pub listen: SocketAddr,
    /// Hosts that are served.
    pub clients: Hosts,
    /// Clients served at once.
    pub clients_max: u8,
    /// Registers that are parameters of drives.
    pub parameters: Vec<ModbusParameter>,
}

/// The rolling recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RollingRecording {
    /// Length of the longest recording that can be taken, 1 to 600 seconds.
    pub seconds: u32,
    /// Bytes of memory for frames, 2 MB to 1 GB.
    pub memory: usize,
}

/// The HTTP server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Http {
    /// Where it listens.
    pub listen: SocketAddr,
    /// Hosts that are served.
    pub clients: Hosts,
    /// Connections open at once, 8 to 256.
    pub connections_max: u16,
    /// File with the hash of the token; without it nobody controls axes.
    pub token: Option<PathBuf>,
    /// The files for TLS; without them nothing is encrypted.
    pub tls: Option<TlsFiles>,
}

/// The files of an HTTP server with TLS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// The certificate of the server and those that have signed it (PEM).
    pub certificate: PathBuf,
    /// Its private key (PEM).
    pub key: PathBuf,
}

impl Http {
    /// The paths of its files.
    fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let tls = self.tls.iter_mut().flat_map(|tls| [&mut tls.certificate, &mut tls.key]);
        self.token.iter_mut().chain(tls)
    }
}

/// Registers that are a parameter of a drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModbusParameter {
    /// The first register.
    pub register: u16,
    /// Size and sign of the value.
    pub kind: Kind,
    /// Position of the axis, from 0.
    pub axis: usize,
    /// Name of the parameter in the tables.
    pub parameter: String,
    /// Whether clients may write it.
    pub write: bool,
}

#[cfg(test)]
mod tests;
