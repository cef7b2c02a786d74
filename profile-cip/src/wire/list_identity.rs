//! Item 0x000C: who a device is, in a ListIdentity answer.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | encapsulation protocol version, 1 |
//! | 2 | 16 | socket address, big-endian |
//! | 18 | 2 | vendor ID |
//! | 20 | 2 | device type |
//! | 22 | 2 | product code |
//! | 24 | 2 | revision, major and minor |
//! | 26 | 2 | status |
//! | 28 | 4 | serial number |
//! | 32 | 1 + n | product name |
//! | 33 + n | 1 | state |

use super::sockaddr::SockaddrInfo;
use super::{Error, Reader, Writer};
use core::fmt;

/// Longest product name in bytes.
pub const PRODUCT_NAME_MAX: usize = 32;

/// The answer of one device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdentityItem<'a> {
    /// Encapsulation protocol version.
    pub protocol_version: u16,
    /// Where its encapsulation port is.
    pub socket: SockaddrInfo,
    /// Vendor ID.
    pub vendor: u16,
    /// Device type (profile); 0x25 for CIP Motion drives.
    pub device_type: u16,
    /// Identity object, attribute 3.
    pub product_code: u16,
    /// Revision, major and minor.
    pub revision: (u8, u8),
    /// Status word of the Identity object.
    pub status: u16,
    /// Identity object, attribute 6.
    pub serial_number: u32,
    /// Product name, ASCII, at most [`PRODUCT_NAME_MAX`] bytes where this crate writes it.
    pub product_name: &'a [u8],
    /// State of the Identity object.
    pub state: u8,
}

impl<'a> IdentityItem<'a> {
    /// Reads the item's data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`], [`Error::invalid`] for an address family other than IPv4.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let protocol_version = r.u16("protocol version")?;
        let socket = SockaddrInfo::read(&mut r)?;
        let vendor = r.u16("vendor ID")?;
        let device_type = r.u16("device type")?;
        let product_code = r.u16("product code")?;
        let revision = (r.u8("major revision")?, r.u8("minor revision")?);
        let status = r.u16("status")?;
        let serial_number = r.u32("serial number")?;
        let length = r.u8("product name length")?;
        let product_name = r.take("product name", usize::from(length))?;
        let state = r.u8("state")?;
        r.finish("identity item")?;
        Ok(Self {
            protocol_version,
            socket,
            vendor,
            device_type,
            product_code,
            revision,
            status,
            serial_number,
            product_name,
            state,
        })
    }

    /// Bytes of the item's data.
    pub const fn buffer_len(&self) -> usize {
        34 + self.product_name.len()
    }

    /// Writes the item's data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] for a name above 255 bytes.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("protocol version", self.protocol_version)?;
        self.socket.write(&mut w)?;
        w.u16("vendor ID", self.vendor)?;
        w.u16("device type", self.device_type)?;
        w.u16("product code", self.product_code)?;
        w.slice("revision", &[self.revision.0, self.revision.1])?;
        w.u16("status", self.status)?;
        w.u32("serial number", self.serial_number)?;
        let length = u8::try_from(self.product_name.len()).map_err(|_| {
            Error::too_large(
                "product name length",
                255,
                u32::try_from(self.product_name.len()).unwrap_or(u32::MAX),
            )
        })?;
        w.u8("product name length", length)?;
        w.slice("product name", self.product_name)?;
        w.u8("state", self.state)?;
        Ok(w.written())
    }
}

impl fmt::Display for IdentityItem<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "\"{}\" at {}: vendor {:#x} type {:#x} product {:#x} revision {}.{} serial {:#010x}",
            self.product_name.escape_ascii(),
            self.socket.address,
            self.vendor,
            self.device_type,
            self.product_code,
            self.revision.0,
            self.revision.1,
            self.serial_number
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::net::{Ipv4Addr, SocketAddrV4};
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    const VALUE: IdentityItem<'static> = IdentityItem {
        protocol_version: 1,
        socket: SockaddrInfo { address: SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 9), 44818) },
        vendor: 0x1234,
        device_type: 0x25,
        product_code: 7,
        revision: (2, 3),
        status: 0x30,
        serial_number: 0xDEAD_BEEF,
        product_name: b"Axis",
        state: 3,
    };

    #[test]
    fn vectors_both_ways() {
        let vectors: &[(&str, &[u8], IdentityItem)] = &[(
            "a drive",
            &[
                1, 0, 0, 2, 0xAF, 0x12, 10, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0x34, 0x12, 0x25, 0, 7, 0, 2, 3,
                0x30, 0, 0xEF, 0xBE, 0xAD, 0xDE, 4, b'A', b'x', b'i', b's', 3,
            ],
            VALUE,
        )];
        check_vectors!(vectors, IdentityItem);
    }

    proptest! {
        #[test]
        fn round_trip(words: [u16; 5], revision: (u8, u8), serial_number: u32, state: u8,
                      name in prop::collection::vec(any::<u8>(), 0..=PRODUCT_NAME_MAX)) {
            let value = IdentityItem {
                protocol_version: words[0], vendor: words[1], device_type: words[2], product_code: words[3],
                status: words[4], revision, serial_number, state, product_name: &name, ..VALUE
            };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(IdentityItem::parse(&buffer), Ok(value));
        }
    }
}
