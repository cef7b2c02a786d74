//! The CAN buses, their CANopen devices and drives.

use std::path::PathBuf;

use profile_cia402::eds::drive::Pdo;
use profile_cia402::master::config::{Expected, GuardingConfig, Stamp, Write};
use profile_cia402::wire::NodeId;
use profile_cia402::wire::lss::LssAddress;
use profile_cia402::wire::pdo::TransmissionType;
use profile_generic::can::timing::BitRate;
use profile_generic::image::Signal;
use profile_generic::mode::ModeSelection;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::time::DurationNs;

use super::known_object::KnownObject;
use crate::parameter::startup::StartupEntry;

/// A CAN bus with CANopen drives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Can {
    /// How it is reached.
    pub link: CanLink,
    /// Bit rate of the nominal phase; every station of the bus must have the same.
    pub bit_rate: BitRate,
    /// Time from one SYNC to the next (1006).
    pub cycle_time: DurationNs,
    /// Node-id of the box.
    pub node: NodeId,
    /// Time between two heartbeats (1017), ms.
    pub heartbeat_ms: u16,
    /// TPDOs in a row that may be missing.
    pub allowed_losses: u16,
    /// The configured drives, in the order of the file.
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
    /// Its data sheet, by which it is checked before it is there.
    pub eds: Option<PathBuf>,
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
    /// By what the device reports that it has them (1020); another one for other values.
    pub stamp: Stamp,
    /// The PDOs that it has then, where the file reports them.
    pub pdos: Option<[Vec<Pdo>; 2]>,
    /// The objects that the file describes; a concise one describes none.
    pub objects: Vec<KnownObject>,
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
    pub modes: Option<Vec<ModeSelection>>,
    /// Actual values that are not sent in every cycle.
    pub left_out: Vec<Signal>,
    /// Offsets that the drive adds to its set-points.
    pub offsets: Vec<Signal>,
    /// Whether its statusword tells that it follows command values; `None`: as the tables say.
    pub acknowledges: Option<bool>,
    /// Whether its statusword tells that the power stage is supplied; `None`: as the tables say.
    pub tells_voltage: Option<bool>,
    /// Its modes of operation, where it does not report them, or reports wrong ones.
    pub drive_modes: Option<Vec<i8>>,
    /// Nanounits of a linear axis in a nanoturn.
    pub way_of_a_turn: Option<Ratio>,
    /// Generic units in one count, where the drive is not to be asked.
    pub counts: Vec<(Quantity, Ratio)>,
    /// Its start-up list.
    pub startup: Vec<StartupEntry>,
}
