//! EMCY: a device reports an error, or that it is gone.

use core::fmt;

use bitflags::bitflags;
use profile_generic::open_code;

use super::bytes::Bytes;
use super::display_bits;
use profile_generic::wire::{Error, exact, u16_at};

/// Bytes of EMCY.
pub const EMCY_LEN: usize = 8;

/// Bytes whose meaning the manufacturer gives.
pub const EMCY_VENDOR_LEN: usize = 5;

open_code! {
    /// Error code. Those that the communication profile itself defines have a name here; those of drives stand in
    /// [`drive`](crate::drive).
    pub struct EmcyCode(u16) {
        /// An error is gone; with an error register of 0, all are.
        NO_ERROR = 0x0000 => "error reset or no error",
        /// Generic error.
        GENERIC = 0x1000 => "generic error",
        /// Frames were lost.
        CAN_OVERRUN = 0x8110 => "CAN overrun",
        /// The device is error passive.
        CAN_PASSIVE = 0x8120 => "CAN error passive",
        /// Heartbeat or node guarding of another device was missed.
        HEARTBEAT = 0x8130 => "life guard or heartbeat error",
        /// The device was bus off and is back.
        BUS_OFF_RECOVERED = 0x8140 => "recovered from bus off",
        /// Somebody else uses one of the device's identifiers.
        ID_COLLISION = 0x8150 => "CAN identifier collision",
        /// A PDO had fewer bytes than its mapping.
        PDO_LENGTH = 0x8210 => "PDO not processed: too short",
        /// A PDO had more bytes than its mapping.
        PDO_LENGTH_EXCEEDED = 0x8220 => "PDO too long",
        /// A multiplexed PDO named an object that does not exist.
        MPDO_OBJECT = 0x8230 => "multiplexed PDO not processed: no such object",
        /// SYNC had another length than 1019 says.
        SYNC_LENGTH = 0x8240 => "unexpected SYNC length",
        /// An RPDO did not come in time.
        RPDO_TIMEOUT = 0x8250 => "RPDO time-out",
    }
}

bitflags! {
    /// Error register (1001).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ErrorRegister: u8 {
        /// Any error.
        const GENERIC = 1 << 0;
        /// Current.
        const CURRENT = 1 << 1;
        /// Voltage.
        const VOLTAGE = 1 << 2;
        /// Temperature.
        const TEMPERATURE = 1 << 3;
        /// Communication.
        const COMMUNICATION = 1 << 4;
        /// Defined by the device profile.
        const PROFILE = 1 << 5;
        /// Reserved.
        const RESERVED = 1 << 6;
        /// Defined by the manufacturer.
        const MANUFACTURER = 1 << 7;
    }
}

impl fmt::Display for ErrorRegister {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#04x}", self.bits())?;
        display_bits(f, self.iter_names().map(|(name, _)| name))
    }
}

/// EMCY.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Emcy {
    /// Error code.
    pub code: EmcyCode,
    /// The device's error register now.
    pub register: ErrorRegister,
    /// Manufacturer's bytes.
    pub vendor: [u8; EMCY_VENDOR_LEN],
}

impl Emcy {
    /// Reads one.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are eight bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let bytes = exact::<EMCY_LEN>("EMCY", bytes)?;
        let [_, _, register, vendor @ ..] = bytes;
        Ok(Self {
            code: EmcyCode(u16_at(&bytes, 0)),
            register: ErrorRegister::from_bits_retain(register),
            vendor,
        })
    }

    /// The bytes.
    #[must_use]
    pub fn emit(&self) -> [u8; EMCY_LEN] {
        let ([low, high], [a, b, c, d, e]) = (self.code.0.to_le_bytes(), self.vendor);
        [low, high, self.register.bits(), a, b, c, d, e]
    }
}

impl fmt::Display for Emcy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EMCY {:04X}", self.code.0)?;
        if let Some(name) = self.code.name() {
            write!(f, " ({name})")?;
        }
        let vendor = Bytes::<EMCY_VENDOR_LEN>::truncated(&self.vendor);
        write!(f, ", register {}, {vendor}", self.register)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn vectors_both_ways() {
        let vectors = [
            (
                "canopen tests: test_emcy",
                [0x01, 0x20, 0x02, 0x00, 0x01, 0x02, 0x03, 0x04],
                Emcy { code: EmcyCode(0x2001), register: ErrorRegister::CURRENT, vendor: [0, 1, 2, 3, 4] },
                "EMCY 2001, register 0x02 (CURRENT), 00 01 02 03 04",
            ),
            (
                "CO_Emergency.h",
                [0x50, 0x82, 0x11, 0, 0, 0, 0, 0],
                Emcy {
                    code: EmcyCode::RPDO_TIMEOUT,
                    register: ErrorRegister::GENERIC | ErrorRegister::COMMUNICATION,
                    vendor: [0; 5],
                },
                "EMCY 8250 (RPDO time-out), register 0x11 (GENERIC, COMMUNICATION), 00 00 00 00 00",
            ),
            (
                "canopen tests: test_emcy",
                [0; 8],
                Emcy::default(),
                "EMCY 0000 (error reset or no error), register 0x00, 00 00 00 00 00",
            ),
        ];
        for (source, bytes, value, text) in vectors {
            assert_eq!(Emcy::parse(&bytes), Ok(value), "{source}");
            assert_eq!((value.emit(), value.to_string()), (bytes, text.to_string()), "{source}");
        }
        for len in (0..16).filter(|&len| len != EMCY_LEN) {
            let error = Error::Length { what: "EMCY", expected: 8, found: len };
            assert_eq!(Emcy::parse(&[0; 16][..len]), Err(error));
        }
    }

    proptest! {
        #[test]
        fn round_trips(bytes: [u8; 8]) {
            prop_assert_eq!(Emcy::parse(&bytes).unwrap().emit(), bytes);
        }
    }
}
