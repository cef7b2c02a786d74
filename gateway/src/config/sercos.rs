//! The SERCOS III bus and its drives.

use profile_generic::mode::ModeSelection;
use profile_generic::time::DurationNs;
use profile_sercos::master::config::AddressPolicy;

use crate::mapping::Rated;
use crate::parameter::startup::StartupEntry;

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
    /// The configured drives, in the order of the file.
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
    pub modes: Option<Vec<ModeSelection>>,
    /// Rated torque or force of its motor, where it is known.
    pub rated: Option<Rated>,
    /// Whether it may be plugged in while the bus is in operation.
    pub hot_plug: bool,
    /// Its start-up list.
    pub startup: Vec<StartupEntry>,
}
