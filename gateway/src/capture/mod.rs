//! Recordings: writing and reading pcapng files, and dressing up socket payloads as frames.
//!
//! A box sees whole Ethernet frames only on the south side. North of it there are UDP and TCP sockets;
//! [`synth`] puts the headers around their payloads that the network had there, so that any protocol analyser
//! dissects the file.

pub mod reader;
pub mod recorder;
pub mod synth;
pub mod writer;

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
}

impl Side {
    /// All of them, in the order of their interface numbers.
    pub const ALL: [Self; 3] = [Self::North, Self::South(Port::One), Self::South(Port::Two)];

    /// The interface number in files this box writes.
    #[must_use]
    pub const fn number(self) -> u32 {
        match self {
            Self::North => 0,
            Self::South(Port::One) => 1,
            Self::South(Port::Two) => 2,
        }
    }

    /// The interface name in files this box writes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::North => "north",
            Self::South(Port::One) => "sercos port 1",
            Self::South(Port::Two) => "sercos port 2",
        }
    }

    /// The one with this name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|side| side.name() == name)
    }

    /// Its place in [`Side::ALL`].
    pub(crate) const fn index(self) -> usize {
        match self {
            Self::North => 0,
            Self::South(Port::One) => 1,
            Self::South(Port::Two) => 2,
        }
    }
}
