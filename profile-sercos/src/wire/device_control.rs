//! C-DEV, the device control word (S-0-1044): what the master tells a slave in every cycle.

use crate::generated::bits::device_control;
use core::fmt;

use super::header::Channel;

const TOPOLOGY_SHIFT: u32 = device_control::COMMANDED_TOPOLOGY.trailing_zeros();

bitflags::bitflags! {
    /// Device control word without the two bits of the commanded topology, which
    /// [`DeviceControl::topology`] reads.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct DeviceControl: u16 {
        /// Bit 15: show the identification light.
        const IDENTIFICATION = device_control::IDENTIFICATION;
        /// Bit 14: toggles with each topology command.
        const TOPOLOGY_CHANGE = device_control::TOPOLOGY_CHANGE;
        /// Bit 13: high bit of the commanded topology.
        const TOPOLOGY_1 = 2 << TOPOLOGY_SHIFT;
        /// Bit 12: low bit of the commanded topology.
        const TOPOLOGY_0 = 1 << TOPOLOGY_SHIFT;
        /// Bit 11: the ring is physically closed.
        const RING_CLOSED = device_control::PHYSICAL_RING_CLOSED;
        /// Bit 8: the master data of this slave is valid.
        const MASTER_VALID = device_control::MASTER_VALID;
    }
}

/// How a slave passes telegrams on; bits 13..12 of C-DEV and of S-DEV.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Topology {
    /// Fast forward between both ports.
    FastForward,
    /// Loopback, and P telegrams are forwarded.
    LoopbackForwardPrimary,
    /// Loopback, and S telegrams are forwarded.
    LoopbackForwardSecondary,
    /// Store and forward, no SERCOS processing (NRT). Only a slave reports it; it is no command.
    StoreAndForward,
}

impl Topology {
    /// How a station turns the telegrams of this channel round.
    #[must_use]
    pub const fn loopback(channel: Channel) -> Self {
        match channel {
            Channel::Primary => Topology::LoopbackForwardPrimary,
            Channel::Secondary => Topology::LoopbackForwardSecondary,
        }
    }

    /// The two bits in place (13..12).
    pub const fn bits(self) -> u16 {
        match self {
            Topology::FastForward => 0,
            Topology::LoopbackForwardPrimary => 1 << TOPOLOGY_SHIFT,
            Topology::LoopbackForwardSecondary => 2 << TOPOLOGY_SHIFT,
            Topology::StoreAndForward => 3 << TOPOLOGY_SHIFT,
        }
    }

    /// Reads bits 13..12 of a device word.
    pub const fn from_word(word: u16) -> Topology {
        match word >> TOPOLOGY_SHIFT & 3 {
            0 => Topology::FastForward,
            1 => Topology::LoopbackForwardPrimary,
            2 => Topology::LoopbackForwardSecondary,
            _ => Topology::StoreAndForward,
        }
    }
}

impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Topology::FastForward => "fast forward",
            Topology::LoopbackForwardPrimary => "loopback and forward P",
            Topology::LoopbackForwardSecondary => "loopback and forward S",
            Topology::StoreAndForward => "store and forward",
        })
    }
}

impl DeviceControl {
    const TOPOLOGY: DeviceControl = DeviceControl::TOPOLOGY_1.union(DeviceControl::TOPOLOGY_0);

    /// The commanded topology.
    pub const fn topology(self) -> Topology {
        Topology::from_word(self.bits())
    }

    /// The word with another commanded topology.
    #[must_use]
    pub const fn with_topology(self, topology: Topology) -> Self {
        DeviceControl::from_bits_retain(self.bits() & !Self::TOPOLOGY.bits() | topology.bits())
    }
}

impl fmt::Display for DeviceControl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#06x}", self.bits())?;
        let names = [
            (Self::IDENTIFICATION, "identification"),
            (Self::TOPOLOGY_CHANGE, "topology change"),
            (Self::RING_CLOSED, "ring closed"),
            (Self::MASTER_VALID, "master valid"),
        ];
        profile_generic::wire::display_bits(
            f,
            names.into_iter().filter(|&(bit, _)| self.contains(bit)).map(|(_, name)| name),
        )?;
        write!(f, ", {}", self.topology())?;
        let unknown = self.bits() & !Self::all().bits();
        if unknown != 0 { write!(f, ", unnamed {unknown:#06x}") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_names() {
        // Recording sercos3_startup_line2, frame 1265, both slots.
        assert_eq!(DeviceControl::from_bits_retain(0x0100), DeviceControl::MASTER_VALID);
        assert_eq!(DeviceControl::MASTER_VALID.to_string(), "0x0100 (master valid), fast forward");
        let word = DeviceControl::from_bits_retain(0xD801);
        assert_eq!(
            word.to_string(),
            "0xd801 (identification, topology change, ring closed), loopback and forward P, unnamed 0x0001"
        );
        assert_eq!(word.topology(), Topology::LoopbackForwardPrimary);
        assert_eq!(word.with_topology(Topology::LoopbackForwardSecondary).bits(), 0xE801);
        for topology in 0..4u16 {
            assert_eq!(Topology::from_word(topology << 12).bits(), topology << 12);
        }
    }
}
