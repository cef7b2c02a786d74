//! The DeviceNet networks and their drives.

use profile_cip::devicenet::master::config::{DataRate, ExpectedIdentity};
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::can::timing::BitRate;
use profile_generic::mode::OperatingMode;
use profile_generic::ratio::Ratio;
use profile_generic::time::DurationNs;

use super::CanLink;
use crate::parameter::startup::StartupEntry;

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
    /// The configured drives, in the order of the file.
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

/// A configured slave of the network: a CIP Motion drive or an AC/DC drive.
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
    /// What parameters of the drive have to be before it takes part in the cycle.
    pub startup: Vec<StartupEntry>,
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
