//! S-DEV, the device status word (S-0-1045): what a slave says about itself in every cycle.

use crate::generated::bits::device_status;
use core::fmt;

use super::device_control::Topology;
use super::header::Channel;

const TOPOLOGY_SHIFT: u32 = device_status::CURRENT_TOPOLOGY.trailing_zeros();
const PORT_SHIFT: u32 = device_status::INACTIVE_PORT.trailing_zeros();

bitflags::bitflags! {
    /// Device status word; the current topology (bits 13..12) and the inactive port (bits 11..10) have
    /// readers of their own.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct DeviceStatus: u16 {
        /// Bit 15: communication warning, more than half of the permitted MST losses in a row.
        const COMMUNICATION_WARNING = device_status::COMMUNICATION_WARNING;
        /// Bit 14: follows C-DEV bit 14 when a topology command is done.
        const TOPOLOGY_CHANGE = device_status::TOPOLOGY_CHANGE_ACKNOWLEDGE;
        /// Bit 13: high bit of the current topology.
        const TOPOLOGY_1 = 2 << TOPOLOGY_SHIFT;
        /// Bit 12: low bit of the current topology.
        const TOPOLOGY_0 = 1 << TOPOLOGY_SHIFT;
        /// Bit 11: high bit of the inactive port's state.
        const INACTIVE_PORT_1 = 2 << PORT_SHIFT;
        /// Bit 10: low bit of the inactive port's state.
        const INACTIVE_PORT_0 = 1 << PORT_SHIFT;
        /// Bit 9: a connection has failed.
        const CONNECTION_ERROR = device_status::ERROR_IN_A_CONNECTION;
        /// Bit 8: the slave's data in this telegram is valid.
        const SLAVE_VALID = device_status::SLAVE_VALID;
        /// Bit 7: device error (class 1 diagnostic).
        const DEVICE_ERROR = device_status::DEVICE_ERROR_C1D;
        /// Bit 6: device warning (class 2 diagnostic).
        const DEVICE_WARNING = device_status::DEVICE_WARNING_C2D;
        /// Bit 5: a procedure command has ended or failed.
        const COMMAND_CHANGE = device_status::PROCEDURE_COMMAND_CHANGE;
        /// Bit 4: the parameterization level is active.
        const PARAMETERIZATION = device_status::PARAMETERIZATION_LEVEL_ACTIVE;
    }
}

/// What a slave sees on its port at the end of a line; bits 11..10 of S-DEV.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum InactivePort {
    /// No link.
    NoLink,
    /// A link, no telegram.
    Link,
    /// P telegrams arrive there.
    PrimaryTelegram,
    /// S telegrams arrive there.
    SecondaryTelegram,
}

impl InactivePort {
    /// What is shown while telegrams of this channel arrive there.
    #[must_use]
    pub const fn hearing(channel: Channel) -> Self {
        match channel {
            Channel::Primary => InactivePort::PrimaryTelegram,
            Channel::Secondary => InactivePort::SecondaryTelegram,
        }
    }

    /// The two bits in place (11..10).
    pub const fn bits(self) -> u16 {
        match self {
            InactivePort::NoLink => 0,
            InactivePort::Link => 1 << PORT_SHIFT,
            InactivePort::PrimaryTelegram => 2 << PORT_SHIFT,
            InactivePort::SecondaryTelegram => 3 << PORT_SHIFT,
        }
    }
}

impl fmt::Display for InactivePort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            InactivePort::NoLink => "no link",
            InactivePort::Link => "link",
            InactivePort::PrimaryTelegram => "P telegram",
            InactivePort::SecondaryTelegram => "S telegram",
        })
    }
}

impl DeviceStatus {
    const TOPOLOGY: DeviceStatus = DeviceStatus::TOPOLOGY_1.union(DeviceStatus::TOPOLOGY_0);
    const INACTIVE_PORT: DeviceStatus = DeviceStatus::INACTIVE_PORT_1.union(DeviceStatus::INACTIVE_PORT_0);

    /// The bits that report errors, warnings and the parameterization level.
    pub const CONDITIONS: DeviceStatus = DeviceStatus::COMMUNICATION_WARNING
        .union(DeviceStatus::CONNECTION_ERROR)
        .union(DeviceStatus::DEVICE_ERROR)
        .union(DeviceStatus::DEVICE_WARNING)
        .union(DeviceStatus::PARAMETERIZATION);

    const NAMES: [(DeviceStatus, &str); 8] = [
        (Self::COMMUNICATION_WARNING, "communication warning"),
        (Self::TOPOLOGY_CHANGE, "topology change"),
        (Self::CONNECTION_ERROR, "connection error"),
        (Self::SLAVE_VALID, "slave valid"),
        (Self::DEVICE_ERROR, "device error"),
        (Self::DEVICE_WARNING, "device warning"),
        (Self::COMMAND_CHANGE, "command change"),
        (Self::PARAMETERIZATION, "parameterization level"),
    ];

    /// Names of the bits of [`DeviceStatus::CONDITIONS`] that are set.
    pub fn condition_names(self) -> impl Iterator<Item = &'static str> {
        let set = self.intersection(Self::CONDITIONS);
        Self::NAMES.into_iter().filter(move |&(bit, _)| set.contains(bit)).map(|(_, name)| name)
    }

    /// The current topology.
    pub const fn topology(self) -> Topology {
        Topology::from_word(self.bits())
    }

    /// The word with another current topology.
    #[must_use]
    pub const fn with_topology(self, topology: Topology) -> Self {
        DeviceStatus::from_bits_retain(self.bits() & !Self::TOPOLOGY.bits() | topology.bits())
    }

    /// What the slave sees on its inactive port.
    pub const fn inactive_port(self) -> InactivePort {
        match self.bits() >> 10 & 3 {
            0 => InactivePort::NoLink,
            1 => InactivePort::Link,
            2 => InactivePort::PrimaryTelegram,
            _ => InactivePort::SecondaryTelegram,
        }
    }

    /// The word with another state of the inactive port.
    #[must_use]
    pub const fn with_inactive_port(self, port: InactivePort) -> Self {
        DeviceStatus::from_bits_retain(self.bits() & !Self::INACTIVE_PORT.bits() | port.bits())
    }
}

impl fmt::Display for DeviceStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#06x}", self.bits())?;
        profile_generic::wire::display_bits(
            f,
            Self::NAMES.into_iter().filter(|&(bit, _)| self.contains(bit)).map(|(_, name)| name),
        )?;
        write!(f, ", {}", self.topology())?;
        if self.topology() != Topology::FastForward {
            write!(f, ", inactive port: {}", self.inactive_port())?;
        }
        let unknown = self.bits() & !Self::all().bits();
        if unknown != 0 { write!(f, ", unnamed {unknown:#06x}") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_names() {
        // Recording sercos3_startup_line2, frame 1263: slave 1, and slave 2 at the end of the line.
        let first = DeviceStatus::from_bits_retain(0x0100);
        assert_eq!(first.to_string(), "0x0100 (slave valid), fast forward");
        let last = DeviceStatus::from_bits_retain(0x1100);
        assert_eq!(last.topology(), Topology::LoopbackForwardPrimary);
        assert_eq!(last, DeviceStatus::SLAVE_VALID.with_topology(Topology::LoopbackForwardPrimary));
        assert_eq!(last.to_string(), "0x1100 (slave valid), loopback and forward P, inactive port: no link");
        let word = DeviceStatus::from_bits_retain(0x8EE1);
        assert_eq!(word.inactive_port(), InactivePort::SecondaryTelegram);
        assert_eq!(
            word.to_string(),
            "0x8ee1 (communication warning, connection error, device error, device warning, command change), \
             fast forward, unnamed 0x0001"
        );
        assert_eq!(word.with_inactive_port(InactivePort::Link).bits(), 0x86E1);
    }
}
