//! EMCY: a device reports an error, or that it is gone.

use crate::generated::bits::error_register;
use core::fmt;

use bitflags::bitflags;

use crate::drive::ErrorCode;

use super::bytes::Bytes;
use profile_generic::wire::display_bits;
use profile_generic::wire::{Error, exact, u16_at};

/// Bytes of EMCY.
pub const EMCY_LEN: usize = 8;

/// Bytes whose meaning the manufacturer gives.
pub const EMCY_VENDOR_LEN: usize = 5;

bitflags! {
    /// Error register (1001).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ErrorRegister: u8 {
        /// Any error.
        const GENERIC = error_register::GENERIC_ERROR;
        /// Current.
        const CURRENT = error_register::CURRENT;
        /// Voltage.
        const VOLTAGE = error_register::VOLTAGE;
        /// Temperature.
        const TEMPERATURE = error_register::TEMPERATURE;
        /// Communication.
        const COMMUNICATION = error_register::COMMUNICATION_ERROR;
        /// Defined by the device profile.
        const PROFILE = error_register::DEVICE_PROFILE_SPECIFIC;
        /// Reserved.
        const RESERVED = 1 << 6;
        /// Defined by the manufacturer.
        const MANUFACTURER = error_register::MANUFACTURER_SPECIFIC;
    }
}

impl fmt::Display for ErrorRegister {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#04x}", self.bits())?;
        display_bits(f, self.iter_names().map(|(name, _)| name))
    }
}

/// An emergency message: error code, error register and five bytes of the maker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Emcy {
    /// Error code.
    pub code: ErrorCode,
    /// The device's error register now.
    pub register: ErrorRegister,
    /// Manufacturer's bytes.
    pub vendor: [u8; EMCY_VENDOR_LEN],
}

impl Emcy {
    /// Reads one.
    ///
    /// # Errors
    /// [`Error::length`] unless there are eight bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let bytes = exact::<EMCY_LEN>("EMCY", bytes)?;
        let [_, _, register, vendor @ ..] = bytes;
        Ok(Self {
            code: ErrorCode(u16_at(&bytes, 0)),
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
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn vectors_both_ways() {
        let vectors = [
            (
                "canopen tests: test_emcy",
                [0x01, 0x20, 0x02, 0x00, 0x01, 0x02, 0x03, 0x04],
                Emcy { code: ErrorCode(0x2001), register: ErrorRegister::CURRENT, vendor: [0, 1, 2, 3, 4] },
                "EMCY 2001, register 0x02 (CURRENT), 00 01 02 03 04",
            ),
            (
                "CO_Emergency.h",
                [0x50, 0x82, 0x11, 0, 0, 0, 0, 0],
                Emcy {
                    code: ErrorCode::RPDO_TIME_OUT,
                    register: ErrorRegister::GENERIC | ErrorRegister::COMMUNICATION,
                    vendor: [0; 5],
                },
                "EMCY 8250 (RPDO time-out), register 0x11 (GENERIC, COMMUNICATION), 00 00 00 00 00",
            ),
            (
                "canopen tests: test_emcy",
                [0; 8],
                Emcy::default(),
                "EMCY 0000 (no error), register 0x00, 00 00 00 00 00",
            ),
        ];
        for (source, bytes, value, text) in vectors {
            check_vectors!(&[(source, bytes, value)], Emcy, whole);
            assert_eq!(value.to_string(), text, "{source}");
        }
    }

    proptest! {
        #[test]
        fn round_trips(bytes: [u8; 8]) {
            prop_assert_eq!(Emcy::parse(&bytes).unwrap().emit(), bytes);
        }
    }
}
