//! The fragmentation byte, and the acknowledge of a fragment.
//!
//! | bits | content |
//! |---|---|
//! | 7, 6 | 0 first, 1 middle, 2 last, 3 acknowledge |
//! | 5..0 | fragment count |
//!
//! In an explicit message it stands behind the message header, whose bit 7 is then set; an acknowledge has one more byte, its
//! status. In an I/O message of a connection whose size is above 8 bytes it is the first byte of every frame, and nothing is
//! acknowledged.

use core::fmt;

pub use crate::generated::devicenet::AcknowledgeStatus;

/// Which part of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FragmentKind {
    /// The first.
    First,
    /// Neither the first nor the last.
    Middle,
    /// The last.
    Last,
    /// No part: the acknowledge of one.
    Acknowledge,
}

/// Count of the first fragment of an I/O message that is the last one as well.
pub const ONLY: u8 = 0x3F;

/// A fragmentation byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Fragment {
    /// Which part.
    pub kind: FragmentKind,
    /// Its number, 0 to 63; it starts again at 0 after 63.
    pub count: u8,
}

impl Fragment {
    /// Reads the byte; every value has a meaning.
    #[must_use]
    pub const fn parse(byte: u8) -> Self {
        let kind = match byte >> 6 {
            0 => FragmentKind::First,
            1 => FragmentKind::Middle,
            2 => FragmentKind::Last,
            _ => FragmentKind::Acknowledge,
        };
        Self { kind, count: byte & 0x3F }
    }

    /// The byte; of the count the low six bits.
    #[must_use]
    pub const fn byte(self) -> u8 {
        let kind = match self.kind {
            FragmentKind::First => 0,
            FragmentKind::Middle => 1,
            FragmentKind::Last => 2,
            FragmentKind::Acknowledge => 3,
        };
        kind << 6 | self.count & 0x3F
    }

    /// The count of the next fragment.
    #[must_use]
    pub const fn next(count: u8) -> u8 {
        (count + 1) & 0x3F
    }
}

impl fmt::Display for Fragment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            FragmentKind::First => "first fragment",
            FragmentKind::Middle => "middle fragment",
            FragmentKind::Last => "last fragment",
            FragmentKind::Acknowledge => "acknowledge of fragment",
        };
        write!(f, "{kind} {}", self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rockwell 1760-UM003A, 4-12: 80 01 is a last fragment... of count 1 behind header 80; ICP DAS I-7242D, 7.2.11.
    #[test]
    fn every_byte_comes_back() {
        let cases = [
            (0x00, FragmentKind::First, 0),
            (0x41, FragmentKind::Middle, 1),
            (0x81, FragmentKind::Last, 1),
            (0xC1, FragmentKind::Acknowledge, 1),
            (0x3F, FragmentKind::First, ONLY),
        ];
        for (byte, kind, count) in cases {
            assert_eq!(Fragment::parse(byte), Fragment { kind, count });
        }
        for byte in 0..=255 {
            assert_eq!(Fragment::parse(byte).byte(), byte);
        }
        assert_eq!((Fragment::next(0), Fragment::next(62), Fragment::next(63)), (1, 63, 0));
        assert_eq!(Fragment::parse(0x82).to_string(), "last fragment 2");
        assert_eq!(AcknowledgeStatus(1).to_string(), "too much data");
    }
}
