//! The configuration file of the box: TOML in, a checked [`Config`] out.
//!
//! [`mod@file`] is the file as it is written: every key, what it means, its default. `check` turns it into the
//! types below, in which every reference is an index and every value is in range, or into [`Findings`]
//! that show each fault at its line.

mod can;
mod can_device;
mod check;
mod connection_format;
mod device_file;
mod devicenet;
pub(crate) mod duration;
pub mod file;
mod rated;

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use profile_cia402::eds::drive::Pdo;
use profile_cia402::master::config::{Expected, GuardingConfig, Stamp, Write};
use profile_cia402::wire::NodeId;
use profile_cia402::wire::lss::LssAddress;
use profile_cia402::wire::pdo::TransmissionType;
use profile_cip::devicenet::master::config::{DataRate, ExpectedIdentity};
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_cip::wire::motion::Format;
use profile_generic::can::timing::BitRate;
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Position, Quantity, Torque, Velocity};
use profile_generic::ratio::Ratio;
use profile_generic::time::DurationNs;
use profile_sercos::master::config::AddressPolicy;

pub(crate) use check::{DEFAULT_ALLOWED_LOSSES, DEFAULT_JITTER, DEFAULT_PRIORITY};

use crate::finding::{Findings, Source, deserialize, read_file, tree};
use crate::mapping::{CaptureMode, Rated};
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
    /// Where system time comes from.
    pub time: TimeSource,
    /// What is logged.
    pub log_level: LogLevel,
    /// The Modbus TCP server; `None` for none.
    pub modbus: Option<Modbus>,
    /// A folder of mapping tables in place of the built-in ones.
    pub mappings_dir: Option<PathBuf>,
    /// What is laid over the tables, files and folders, in this order.
    pub overlays: Vec<PathBuf>,
    /// Where what controllers set is kept; `None` keeps it until the process ends.
    pub settings_file: Option<PathBuf>,
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
        let source = read_file(path, FILE_LEN_MAX).map_err(|found| findings.extend(found)).ok()?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut written = Self::parse_in(folder, &source, &path.display().to_string(), findings)?;
        let config = &mut written.config;
        let paths = config.mappings_dir.iter_mut().chain(&mut config.overlays);
        for path in paths.chain(&mut config.settings_file) {
            *path = folder.join(&*path);
        }
        Some(written)
    }

    /// Checks the text of a file, whose name is shown in errors; `None` with them. Paths count from the working directory.
    pub fn parse(source: &str, name: &str, findings: &mut Findings) -> Option<Self> {
        Self::parse_in(Path::new(""), source, name, findings)
    }

    fn parse_in(folder: &Path, source: &str, name: &str, findings: &mut Findings) -> Option<Self> {
        let text = Source::new(name, source);
        let tree = tree(source, &text, findings)?;
        let file: file::File = deserialize(tree, &text, findings)?;
        match check::check(&file) {
            Ok(config) => {
                let mut written = Self { text, file, config };
                device_file::load(folder, &mut written, findings).then_some(written)
            }
            Err(problems) => {
                problems.into_iter().for_each(|problem| findings.push(&text, problem));
                None
            }
        }
    }
}

/// Where system time comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeSource {
    /// The host's clock: TAI where the kernel knows the offset, else UTC.
    Host,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Modbus {
    /// Where it listens.
    pub listen: SocketAddr,
    /// Clients served at once.
    pub clients_max: u8,
}

/// A CIP Motion device as controllers see it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    /// Name, unique among devices.
    pub name: String,
    /// Its IP address, for TCP and UDP 44818 and UDP 2222.
    pub listen: Ipv4Addr,
    /// The Identity object.
    pub identity: Identity,
    /// Motion Device Axis Object, class attribute 34; 0 when each axis has its own.
    pub power_structure_class_id: u32,
    /// Format of the motion connection; the fixed one only with a single axis.
    pub connection_format: Format,
    /// Shortest controller update period accepted.
    pub update_period_min: DurationNs,
    /// Longest controller update period accepted.
    pub update_period_max: DurationNs,
}

/// The Identity object of a device; its device type follows from what its axes are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Vendor number given by ODVA.
    pub vendor_id: u16,
    /// Name of that vendor, for the electronic data sheet.
    pub vendor_name: String,
    /// Catalogue number of the product, for the electronic data sheet.
    pub catalog: String,
    /// The vendor's number of the product.
    pub product_code: u16,
    /// Major revision, 1 to 127.
    pub revision_major: u8,
    /// Minor revision, 1 to 255.
    pub revision_minor: u8,
    /// Number of the piece.
    pub serial_number: u32,
    /// Printable ASCII, at most 32 characters.
    pub product_name: String,
}

/// Whether an axis turns or slides, and with it the unit of its quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisKind {
    /// Revolutions.
    Rotary,
    /// Millimetres.
    Linear,
}

/// What an axis is (the state tables of the Motion Device Axis Object, clause 5-2.6.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisFunction {
    /// Controlled in motion.
    Drive,
    /// A feedback device, or the feedback of a drive that is never switched on.
    Encoder,
    /// A supply of the DC bus, without motion.
    Converter,
}

impl AxisFunction {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Drive, Self::Encoder, Self::Converter];

    /// The name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drive => "drive",
            Self::Encoder => "encoder",
            Self::Converter => "converter",
        }
    }
}

/// An axis: one instance of the Motion Device Axis Object in front, one drive behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Name, unique among axes.
    pub name: String,
    /// Instance number, unique in its device, from 1.
    pub instance: u8,
    /// Index in [`Config::devices`].
    pub device: usize,
    /// Its drive; no two axes share one.
    pub drive: DriveAt,
    /// What it is.
    pub function: AxisFunction,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// Position counts of the controller for one axis unit.
    pub motion_resolution: u32,
    /// Position counts after which the axis is at its start again; `None` for an axis with ends.
    pub unwind_counts: Option<u32>,
    /// Motion Device Axis Object, attribute 725; 0 when the device's class attribute says it.
    pub power_structure_axis_id: u32,
    /// What the axis may do, beside what its drive allows.
    pub limits: Limits,
    /// What happens when commands stay away.
    pub on_command_loss: StoppingAction,
    /// How the drive's captures of events are used.
    pub events: CaptureMode,
}

/// Limits of an axis that the box holds; `None` leaves them to the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits {
    /// Lowest position command.
    pub position_min: Option<Position>,
    /// Highest position command.
    pub position_max: Option<Position>,
    /// Highest speed, either direction.
    pub velocity: Option<Velocity>,
    /// Highest acceleration, either direction.
    pub acceleration: Option<Acceleration>,
    /// Highest torque or force, either direction.
    pub torque: Option<Torque>,
    /// Largest distance of actual from commanded position.
    pub following_error: Option<Position>,
}

/// How an axis stops (Motion Device Axis Object, attribute 610).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoppingAction {
    /// Torque off at once; the axis coasts (IEC 60204-1 category 0).
    DisableAndCoast,
    /// As fast as torque allows, then torque off (category 1).
    CurrentDecelAndDisable,
    /// On the ramp, then torque off (category 1).
    RampedDecelAndDisable,
    /// As fast as torque allows, then hold (category 2).
    CurrentDecelAndHold,
    /// On the ramp, then hold (category 2).
    RampedDecelAndHold,
}

impl StoppingAction {
    /// All of them, in the order of their codes.
    pub const ALL: [Self; 5] = [
        Self::DisableAndCoast,
        Self::CurrentDecelAndDisable,
        Self::RampedDecelAndDisable,
        Self::CurrentDecelAndHold,
        Self::RampedDecelAndHold,
    ];

    /// The code of the attribute.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::DisableAndCoast => 0,
            Self::CurrentDecelAndDisable => 1,
            Self::RampedDecelAndDisable => 2,
            Self::CurrentDecelAndHold => 3,
            Self::RampedDecelAndHold => 4,
        }
    }

    /// The name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DisableAndCoast => "disable-and-coast",
            Self::CurrentDecelAndDisable => "current-decel-and-disable",
            Self::RampedDecelAndDisable => "ramped-decel-and-disable",
            Self::CurrentDecelAndHold => "current-decel-and-hold",
            Self::RampedDecelAndHold => "ramped-decel-and-hold",
        }
    }
}

/// How the bus is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Link {
    /// Simulated drives inside this process.
    InProcess {
        /// In a ring; else in a line.
        ring: bool,
    },
    /// Network interfaces of the host.
    Interface {
        /// The master's port 1.
        name: String,
        /// Its port 2: the other end of a ring, or a second line.
        ring: Option<String>,
    },
}

impl Link {
    /// Whether the master has both of its ports.
    #[must_use]
    pub const fn has_ring(&self) -> bool {
        matches!(self, Self::InProcess { ring: true } | Self::Interface { ring: Some(_), .. })
    }
}

/// The SERCOS III bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sercos {
    /// How it is reached.
    pub link: Link,
    /// Communication cycle in phases 3 and 4 (S-0-1002).
    pub cycle_time: DurationNs,
    /// Cycle of phases 0 to 2; `None` for the shortest one.
    pub setup_cycle: Option<DurationNs>,
    /// The master's Ethernet address; `None` takes the interface's.
    pub master_mac: Option<[u8; 6]>,
    /// How far the start of a cycle may lie off its time, declared to the slaves (S-0-1023).
    pub jitter: DurationNs,
    /// Cycles for which topology and addresses must stay the same in phase 0.
    pub cp0_stable_cycles: u16,
    /// Cycles in a row that may be lost before a slave or the master gives up (S-0-1003).
    pub allowed_losses: u16,
    /// What to do about slaves that have no address or share one.
    pub addresses: AddressPolicy,
    /// The drives on it.
    pub drives: Vec<Drive>,
}

impl Sercos {
    /// Most slaves of a SERCOS III network.
    const SLAVES_MAX: u16 = 511;

    /// Slaves that may be on the bus without being configured: they are told of instead of keeping the bus down.
    const SPARE_SLAVES: u16 = 16;

    /// Slaves that a bus with so many drives has room for.
    #[must_use]
    pub fn slaves_max(drives: usize) -> u16 {
        let drives = u16::try_from(drives).unwrap_or(Self::SLAVES_MAX);
        drives.saturating_add(Self::SPARE_SLAVES).min(Self::SLAVES_MAX)
    }
}

/// A drive on the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drive {
    /// Name, unique among drives.
    pub name: String,
    /// SERCOS address, 1 to 511, unique.
    pub address: u16,
    /// Whether its scaling is set to the preferential one of the axis's unit; else it is read and left as it is.
    pub set_scaling: bool,
    /// Whether its status word tells that it follows command values, and that it is halted.
    pub acknowledges: bool,
    /// The operating modes that it must have; `None`: all that it has.
    pub modes: Option<Vec<OperatingMode>>,
    /// Rated torque or force of its motor, where it is known.
    pub rated: Option<Rated>,
    /// Whether it may be plugged in while the bus is in operation.
    pub hot_plug: bool,
}

/// Where a drive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveAt {
    /// On the SERCOS III bus.
    Sercos {
        /// Index in [`Sercos::drives`].
        drive: usize,
    },
    /// On a CAN bus.
    Can {
        /// Index in [`Config::can`].
        bus: usize,
        /// Index in [`Can::drives`].
        drive: usize,
    },
    /// On a DeviceNet network.
    Devicenet {
        /// Index in [`Config::devicenet`].
        network: usize,
        /// Index in [`Devicenet::drives`].
        drive: usize,
    },
}

/// A CAN bus with CANopen drives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Can {
    /// How it is reached.
    pub link: CanLink,
    /// Its bit rate.
    pub bit_rate: BitRate,
    /// Time from one SYNC to the next (1006).
    pub cycle_time: DurationNs,
    /// Node-id of the box.
    pub node: NodeId,
    /// Time between two heartbeats (1017), ms.
    pub heartbeat_ms: u16,
    /// TPDOs in a row that may be missing.
    pub allowed_losses: u16,
    /// The drives on it.
    pub drives: Vec<CanDrive>,
    /// What is said of devices as a whole; of those that are not here nothing is.
    pub devices: Vec<CanDevice>,
}

impl Can {
    /// What is said of the device with this node-id.
    #[must_use]
    pub fn device(&self, node: NodeId) -> Option<&CanDevice> {
        self.devices.iter().find(|device| device.node == node)
    }
}

/// A CANopen device, with one axis or several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanDevice {
    /// Its node-id.
    pub node: NodeId,
    /// What it has to be.
    pub expected: Expected,
    /// How it gets its node-id, where it has none.
    pub lss: Option<Lss>,
    /// What it is given at its boot-up.
    pub file: Option<DeviceFile>,
    /// Whether it keeps that.
    pub stores: bool,
    /// Whether its PDOs are used as they are.
    pub keeps_mapping: bool,
    /// Transmission types of its RPDOs and TPDOs, where it is not left to the device.
    pub types: [Option<TransmissionType>; 2],
    /// Node guarding, in place of a heartbeat.
    pub guarding: Option<GuardingConfig>,
}

/// A device that is given its node-id by LSS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lss {
    /// Who it is.
    pub address: LssAddress,
    /// Whether it is to keep the node-id.
    pub stores: bool,
}

/// What a device is given at its boot-up, by its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceFile {
    /// Its values, in the order of writing.
    pub writes: Vec<Write>,
    /// By what the device tells that it has them (1020); another one for other values.
    pub stamp: Stamp,
    /// The PDOs that it has then, where the file tells them.
    pub pdos: Option<[Vec<Pdo>; 2]>,
}

/// How a CAN bus, or a DeviceNet network, is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CanLink {
    /// Simulated drives inside this process.
    InProcess,
    /// An interface of the host.
    Interface {
        /// Its name.
        name: String,
        /// Whether its bit rate is set.
        set_bit_rate: bool,
    },
}

impl CanLink {
    /// The interface of the host; `None` inside this process.
    #[must_use]
    pub fn interface(&self) -> Option<&str> {
        match self {
            Self::InProcess => None,
            Self::Interface { name, .. } => Some(name),
        }
    }
}

/// A CANopen drive, or one axis of a device with several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanDrive {
    /// Name, unique among drives.
    pub name: String,
    /// Its device.
    pub node: NodeId,
    /// Which axis of the device, from 0.
    pub axis: u16,
    /// What it is used for, the mode at start first; `None`: all that it has.
    pub modes: Option<Vec<OperatingMode>>,
    /// Actual values that are not sent in every cycle.
    pub left_out: Vec<Signal>,
    /// Offsets that the drive adds to its set-points.
    pub offsets: Vec<Signal>,
    /// Whether its statusword tells that it follows command values; `None`: as the tables say.
    pub acknowledges: Option<bool>,
    /// Whether its statusword tells that the power stage is supplied; `None`: as the tables say.
    pub tells_voltage: Option<bool>,
    /// Its modes of operation, where it does not tell them, or tells wrong ones.
    pub drive_modes: Option<Vec<i8>>,
    /// Nanounits of a linear axis in a nanoturn.
    pub way_of_a_turn: Option<Ratio>,
    /// Generic units in one count, where the drive is not to be asked.
    pub counts: Vec<(Quantity, Ratio)>,
}

/// A DeviceNet network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Devicenet {
    /// How it is reached.
    pub link: CanLink,
    /// Its data rate.
    pub rate: DataRate,
    /// Time from one poll to the next.
    pub cycle_time: DurationNs,
    /// MAC ID of the box.
    pub mac: MacId,
    /// Answers in a row that may be missing.
    pub allowed_losses: u8,
    /// The drives on it.
    pub drives: Vec<DevicenetDrive>,
}

impl Devicenet {
    /// Its data rate as that of a CAN bus.
    ///
    /// # Panics
    /// Never: a data rate is a bit rate.
    #[must_use]
    pub fn bit_rate(&self) -> BitRate {
        BitRate::classic(self.rate.bits_per_second()).expect("a data rate is a bit rate")
    }
}

/// A drive on DeviceNet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DevicenetDrive {
    /// Name, unique among drives.
    pub name: String,
    /// Its MAC ID.
    pub mac: MacId,
    /// Expected packet rate of its poll connection, ms.
    pub packet_rate_ms: u16,
    /// Who it has to be.
    pub identity: ExpectedIdentity,
    /// Nanounits of a linear axis in a nanoturn.
    pub way_of_a_turn: Option<Ratio>,
    /// What it is.
    pub kind: DevicenetKind,
}

/// What a drive on DeviceNet is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DevicenetKind {
    /// A CIP Motion drive.
    Motion {
        /// What it is used for, the mode at start first.
        modes: Vec<OperatingMode>,
        /// Position counts in a position unit.
        resolution: u32,
    },
    /// A velocity drive of the AC/DC drive profile.
    Speed {
        /// Its output assembly.
        assembly: Assembly,
        /// SpeedScale.
        scale: i8,
    },
}

#[cfg(test)]
mod tests;
