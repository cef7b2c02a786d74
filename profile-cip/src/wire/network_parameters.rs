//! Network connection parameters of a Forward_Open: one 16-bit word a direction, 32-bit in the large form.
//!
//! | 16-bit | 32-bit | field |
//! |---|---|---|
//! | 15 | 31 | redundant owner |
//! | 14..13 | 30..29 | connection type |
//! | 12 | 28 | reserved |
//! | 11..10 | 27..26 | priority |
//! | 9 | 25 | variable size |
//! | 8..0 | 15..0 | connection size in bytes |

use super::Error;
use core::fmt;
use profile_generic::open_code;

open_code! {
    /// Connection type of one direction.
    pub struct ConnectionType(u8) {
        /// No data in this direction, or nothing to change.
        NULL = 0 => "null",
        /// To a multicast group.
        MULTICAST = 1 => "multicast",
        /// To one receiver.
        POINT_TO_POINT = 2 => "point to point",
    }
}

open_code! {
    /// Priority of one direction.
    pub struct Priority(u8) {
        /// Low.
        LOW = 0 => "low",
        /// High.
        HIGH = 1 => "high",
        /// Scheduled.
        SCHEDULED = 2 => "scheduled",
        /// Urgent: CIP Motion.
        URGENT = 3 => "urgent",
    }
}

/// Largest connection size the 16-bit form can say.
pub const SMALL_SIZE_MAX: u16 = 0x1FF;

/// One direction of a connection. Reserved bits are dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkParameters {
    /// Several owners may hold the connection.
    pub redundant_owner: bool,
    /// How it is sent, 2 bits.
    pub connection_type: ConnectionType,
    /// How urgent it is, 2 bits.
    pub priority: Priority,
    /// Whether shorter data may be sent.
    pub variable: bool,
    /// Largest data in bytes; for class 1 and 3 including the 2-byte sequence count.
    pub size: u16,
}

impl NetworkParameters {
    /// From the 16-bit form.
    pub fn from_u16(word: u16) -> Self {
        let [_, high] = word.to_le_bytes();
        Self::from_parts(high, word & SMALL_SIZE_MAX)
    }

    /// From the 32-bit form.
    pub fn from_u32(word: u32) -> Self {
        let [low, second, _, high] = word.to_le_bytes();
        Self::from_parts(high, u16::from_le_bytes([low, second]))
    }

    // The top bytes of both forms have the same layout: 7 owner, 6..5 type, 3..2 priority, 1 variable.
    fn from_parts(high: u8, size: u16) -> Self {
        Self {
            redundant_owner: high & 0x80 != 0,
            connection_type: ConnectionType(high >> 5 & 3),
            priority: Priority(high >> 2 & 3),
            variable: high & 2 != 0,
            size,
        }
    }

    fn high(&self) -> u8 {
        u8::from(self.redundant_owner) << 7
            | (self.connection_type.0 & 3) << 5
            | (self.priority.0 & 3) << 2
            | u8::from(self.variable) << 1
    }

    /// The 16-bit form.
    ///
    /// # Errors
    /// [`Error::too_large`] for a size above [`SMALL_SIZE_MAX`].
    pub fn to_u16(&self) -> Result<u16, Error> {
        if self.size > SMALL_SIZE_MAX {
            let (value, max) = (u32::from(self.size), u32::from(SMALL_SIZE_MAX));
            return Err(Error::too_large("connection size", max, value));
        }
        Ok(u16::from(self.high()) << 8 | self.size)
    }

    /// The 32-bit form.
    pub fn to_u32(&self) -> u32 {
        u32::from(self.high()) << 24 | u32::from(self.size)
    }
}

impl fmt::Display for NetworkParameters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shape = if self.variable { "up to " } else { "" };
        write!(f, "{}, {} priority, {shape}{} bytes", self.connection_type, self.priority, self.size)?;
        if self.redundant_owner { write!(f, ", redundant owner") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MOTION: NetworkParameters = NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size: 220,
    };

    #[test]
    fn vectors_both_ways() {
        // Point to point, urgent, variable, 220 bytes: 0100_1110 and the size (Volume 9 clause 7-1.1's
        // example).
        assert_eq!(NetworkParameters::from_u16(0x4EDC), MOTION);
        assert_eq!(MOTION.to_u16(), Ok(0x4EDC));
        assert_eq!(NetworkParameters::from_u32(0x4E00_00DC), MOTION);
        assert_eq!(MOTION.to_u32(), 0x4E00_00DC);
        let owner = NetworkParameters {
            redundant_owner: true,
            connection_type: ConnectionType::MULTICAST,
            priority: Priority::LOW,
            variable: false,
            size: 4002,
        };
        assert_eq!(NetworkParameters::from_u32(0xA000_0FA2), owner);
        assert_eq!(owner.to_u32(), 0xA000_0FA2);
        assert_eq!(owner.to_u16(), Err(Error::too_large("connection size", 511, 4002)));
        assert_eq!(MOTION.to_string(), "point to point, urgent priority, up to 220 bytes");
    }

    proptest! {
        #[test]
        fn round_trip(word: u32) {
            let large = NetworkParameters::from_u32(word);
            prop_assert_eq!(NetworkParameters::from_u32(large.to_u32()), large);
            prop_assert_eq!(large.to_u32(), word & 0xEE00_FFFF);
            let [low, high, ..] = word.to_le_bytes();
            let word = u16::from_le_bytes([low, high]);
            prop_assert_eq!(NetworkParameters::from_u16(word).to_u16(), Ok(word & 0xEFFF));
        }
    }
}
