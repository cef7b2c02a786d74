//! Recordings: writing and reading pcapng files, and dressing up socket payloads as frames.
//!
//! A box sees whole Ethernet frames only on the south side. North of it there are UDP and TCP sockets;
//! [`synth`] puts the headers around their payloads that the network had there, so that any protocol analyser
//! dissects the file.

mod blocks;
pub mod can;
pub mod can_bus;
pub mod reader;
mod record;
pub mod recorder;
pub mod synth;
pub mod writer;

#[cfg(test)]
mod tshark_can_tests;
#[cfg(test)]
mod tshark_tests;

use profile_sercos::port::Port;

/// The longest Ethernet frame that is recorded: 1514 bytes and a VLAN tag, without frame check sequence.
pub const FRAME_LEN_MAX: usize = 1518;

/// Where a frame was seen; an interface of its own in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// Towards the controllers: interface 0.
    North,
    /// Towards the drives, on one of the two SERCOS ports: interfaces 1 and 2. A frame that goes out there and one
    /// that comes in look the same in the file; the order tells.
    South(Port),
    /// Towards the drives, on a CAN bus, from 0, below [`CAN_BUSES_MAX`]: interfaces 3 and up, in files that have them.
    Can(u8),
}

/// CAN buses that a recording can have.
pub const CAN_BUSES_MAX: usize = 8;

const CAN_NAMES: [&str; CAN_BUSES_MAX] =
    ["can bus 1", "can bus 2", "can bus 3", "can bus 4", "can bus 5", "can bus 6", "can bus 7", "can bus 8"];

impl Side {
    /// Those of Ethernet, which every file has, in the order of their interface numbers.
    pub const ETHERNET: [Self; 3] = [Self::North, Self::South(Port::One), Self::South(Port::Two)];

    /// How many there are.
    pub(crate) const COUNT: usize = Self::ETHERNET.len() + CAN_BUSES_MAX;

    /// All that a file with so many CAN buses has, in the order of their interface numbers.
    pub fn all(can: usize) -> impl Iterator<Item = Self> {
        let buses = (0..can.min(CAN_BUSES_MAX)).filter_map(|bus| u8::try_from(bus).ok().map(Self::Can));
        Self::ETHERNET.into_iter().chain(buses)
    }

    /// The interface number in files this box writes.
    #[must_use]
    pub fn number(self) -> u32 {
        u32::try_from(self.index()).unwrap_or(u32::MAX)
    }

    /// The interface name in files this box writes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::North => "north",
            Self::South(Port::One) => "sercos port 1",
            Self::South(Port::Two) => "sercos port 2",
            Self::Can(bus) => CAN_NAMES[can_index(bus)],
        }
    }

    /// The side with this name in a recording; `None` for other names.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::all(CAN_BUSES_MAX).find(|side| side.name() == name)
    }

    /// The side at a place in [`Side::all`]; `None` beyond the last.
    pub(crate) fn of_index(index: u8) -> Option<Self> {
        Self::all(CAN_BUSES_MAX).nth(usize::from(index))
    }

    /// Its place in [`Side::all`].
    pub(crate) const fn index(self) -> usize {
        match self {
            Self::North => 0,
            Self::South(Port::One) => 1,
            Self::South(Port::Two) => 2,
            Self::Can(bus) => Self::ETHERNET.len() + can_index(bus),
        }
    }
}

/// Place of a bus; one beyond the last counts as that.
const fn can_index(bus: u8) -> usize {
    let bus = bus as usize;
    if bus < CAN_BUSES_MAX { bus } else { CAN_BUSES_MAX - 1 }
}
