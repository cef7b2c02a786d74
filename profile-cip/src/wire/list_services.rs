//! Item 0x0100: one communication service of a ListServices answer.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | encapsulation protocol version, 1 |
//! | 2 | 2 | capability flags: 5 CIP over TCP, 8 class 0 and 1 over UDP |
//! | 4 | 16 | name, zero-terminated |

use super::{Error, Reader, Writer};
use core::fmt;

/// Length of the item's data in bytes.
pub const SERVICES_ITEM_LEN: usize = 20;

/// CIP encapsulation over TCP.
pub const CAPABILITY_CIP_TCP: u16 = 1 << 5;

/// Class 0 and class 1 connections over UDP.
pub const CAPABILITY_CLASS1_UDP: u16 = 1 << 8;

/// The one service of CIP devices.
pub const COMMUNICATIONS: [u8; 16] = *b"Communications\0\0";

/// One service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServicesItem {
    /// Encapsulation protocol version.
    pub protocol_version: u16,
    /// What it can do.
    pub capabilities: u16,
    /// ASCII name, zero-terminated.
    pub name: [u8; 16],
}

impl ServicesItem {
    /// Reads the item's data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let value = Self {
            protocol_version: r.u16("protocol version")?,
            capabilities: r.u16("capability flags")?,
            name: r.array("service name")?,
        };
        r.finish("services item")?;
        Ok(value)
    }

    /// Always [`SERVICES_ITEM_LEN`].
    pub const fn buffer_len(&self) -> usize {
        SERVICES_ITEM_LEN
    }

    /// Writes the item's data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("protocol version", self.protocol_version)?;
        w.u16("capability flags", self.capabilities)?;
        w.slice("service name", &self.name)?;
        Ok(w.written())
    }
}

impl fmt::Display for ServicesItem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = self.name.iter().position(|byte| *byte == 0).unwrap_or(self.name.len());
        write!(f, "{} capabilities {:#06x}", self.name[..end].escape_ascii(), self.capabilities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let value = ServicesItem {
            protocol_version: 1,
            capabilities: CAPABILITY_CIP_TCP | CAPABILITY_CLASS1_UDP,
            name: COMMUNICATIONS,
        };
        let vectors: &[(&str, &[u8], ServicesItem)] =
            &[("CIP over TCP and UDP", b"\x01\x00\x20\x01Communications\0\0", value)];
        check_vectors!(vectors, ServicesItem);
        assert_eq!(value.to_string(), "Communications capabilities 0x0120");
    }

    proptest! {
        #[test]
        fn round_trip(protocol_version: u16, capabilities: u16, name: [u8; 16]) {
            let value = ServicesItem { protocol_version, capabilities, name };
            let mut buffer = [0xA5; SERVICES_ITEM_LEN];
            prop_assert_eq!(value.emit(&mut buffer), Ok(SERVICES_ITEM_LEN));
            prop_assert_eq!(ServicesItem::parse(&buffer), Ok(value));
        }
    }
}
