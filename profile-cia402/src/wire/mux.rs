//! The multiplexer: which object and which of its parts a transfer is about.

use core::fmt;

use crate::generated::objects;

/// Index and sub-index of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Mux {
    /// Index, 0001h to FFFFh.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl Mux {
    /// Device type.
    pub const DEVICE_TYPE: Self = Self::new(objects::DEVICE_TYPE, 0);
    /// Communication cycle period, microseconds.
    pub const CYCLE_PERIOD: Self = Self::new(objects::COMMUNICATION_CYCLE_PERIOD, 0);
    /// Synchronous window length, microseconds; 0 for the whole cycle.
    pub const SYNC_WINDOW: Self = Self::new(objects::SYNCHRONOUS_WINDOW_LENGTH, 0);
    /// Node guarding: time between two requests, ms; 0 for none.
    pub const GUARD_TIME: Self = Self::new(objects::GUARD_TIME, 0);
    /// Node guarding: guard times without a request after which the master is lost; 0 for never.
    pub const LIFE_TIME_FACTOR: Self = Self::new(objects::LIFE_TIME_FACTOR, 0);
    /// Store parameters: all of them.
    pub const STORE: Self = Self::new(objects::STORE_PARAMETERS, 1);
    /// Time between two heartbeats, ms; 0 for none.
    pub const PRODUCER_HEARTBEAT: Self = Self::new(objects::PRODUCER_HEARTBEAT_TIME, 0);
    /// Identity: vendor.
    pub const VENDOR: Self = Self::new(objects::IDENTITY, 1);
    /// Identity: product code.
    pub const PRODUCT: Self = Self::new(objects::IDENTITY, 2);
    /// Identity: revision.
    pub const REVISION: Self = Self::new(objects::IDENTITY, 3);
    /// Identity: serial number.
    pub const SERIAL: Self = Self::new(objects::IDENTITY, 4);
    /// Counter overflow of SYNC: 0 for no counter, else 2 to 240.
    pub const SYNC_OVERFLOW: Self = Self::new(objects::SYNC_OVERFLOW, 0);
    /// Configuration date, days since 1984-01-01.
    pub const CONFIGURATION_DATE: Self = Self::new(objects::VERIFY_CONFIGURATION, 1);
    /// Configuration time, ms after midnight.
    pub const CONFIGURATION_TIME: Self = Self::new(objects::VERIFY_CONFIGURATION, 2);

    /// This part of this object.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Self { index, sub }
    }

    /// Time out of a heartbeat that the device consumes, by entry from 1: node-id in bits 23..16, ms in 15..0.
    #[must_use]
    pub const fn consumer_heartbeat(entry: u8) -> Self {
        Self::new(objects::CONSUMER_HEARTBEAT_TIME, entry)
    }

    /// The bytes in a frame: index, low byte first, and sub-index.
    pub(crate) const fn emit(self) -> [u8; 3] {
        let [low, high] = self.index.to_le_bytes();
        [low, high, self.sub]
    }

    /// Reads bytes 1 to 3 of a frame.
    pub(crate) const fn of(bytes: &[u8; 8]) -> Self {
        Self::new(u16::from_le_bytes([bytes[1], bytes[2]]), bytes[3])
    }
}

/// As tools print it: `6040:00`.
impl fmt::Display for Mux {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index, self.sub)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiplexers_print_as_tools_do() {
        assert_eq!(Mux::VENDOR.to_string(), "1018:01");
        assert_eq!(Mux::of(&[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]), Mux::VENDOR);
        assert_eq!(Mux::new(0x607A, 0xFE).emit(), [0x7A, 0x60, 0xFE]);
    }
}
