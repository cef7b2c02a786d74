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

/// The longest Ethernet frame that is recorded: 1514 bytes and a VLAN tag, without frame check sequence.
pub const FRAME_LEN_MAX: usize = 1518;

/// The side of the box on which a frame was seen; the interface number in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// Towards the controllers: interface 0.
    North,
    /// Towards the drives: interface 1.
    South,
}

impl Side {
    /// Both sides, in the order of their interface numbers.
    pub const ALL: [Self; 2] = [Self::North, Self::South];

    /// The interface number in files this box writes.
    #[must_use]
    pub const fn number(self) -> u32 {
        match self {
            Self::North => 0,
            Self::South => 1,
        }
    }

    /// The interface name in files this box writes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::North => "north",
            Self::South => "south",
        }
    }
}
