//! The duplicate MAC ID check message, sent on [`super::Identifier::DuplicateMacCheck`] of the MAC ID in question.
//!
//! | byte | content |
//! |---|---|
//! | 0 | bit 7: 0 request, 1 response; bits 6..0: physical port number |
//! | 1, 2 | vendor ID |
//! | 3 to 6 | serial number |
//!
//! Vendor ID and serial number make every message different, so that two nodes that send it in the same instant destroy
//! each other's frame instead of hiding behind it.

use core::fmt;

use crate::wire::{Error, Reader, Writer};

/// Bytes of the message.
pub const LEN: usize = 7;
const MESSAGE: &str = "duplicate MAC ID check message";
const RESPONSE: u8 = 0x80;

/// A request or a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DuplicateMac {
    /// A response of the node that has the MAC ID.
    pub response: bool,
    /// Physical port of the sender, 0 to 127; 0 for a device with one port.
    pub port: u8,
    /// Vendor ID of the sender.
    pub vendor: u16,
    /// Serial number of the sender, unique within its vendor.
    pub serial: u32,
}

impl DuplicateMac {
    /// Reads the data of a frame.
    ///
    /// # Errors
    /// It has not seven bytes.
    pub fn parse(data: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(data);
        let first = reader.u8(MESSAGE)?;
        let value = Self {
            response: first & RESPONSE != 0,
            port: first & !RESPONSE,
            vendor: reader.u16(MESSAGE)?,
            serial: reader.u32(MESSAGE)?,
        };
        reader.finish(MESSAGE)?;
        Ok(value)
    }

    /// Bytes that [`Self::emit`] writes.
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        LEN
    }

    /// Writes the data of a frame.
    ///
    /// # Errors
    /// The port number has more than seven bits, or the buffer is too short.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        if self.port & RESPONSE != 0 {
            let (value, max) = (u32::from(self.port), 127);
            return Err(Error::too_large("physical port number", max, value));
        }
        let available = buffer.len();
        let Some(buffer) = buffer.get_mut(..LEN) else {
            return Err(Error::truncated(MESSAGE, 0, LEN, available));
        };
        let writer = &mut Writer::new(buffer);
        writer.u8(MESSAGE, if self.response { RESPONSE } else { 0 } | self.port)?;
        writer.u16(MESSAGE, self.vendor)?;
        writer.u32(MESSAGE, self.serial)?;
        Ok(writer.written())
    }
}

impl fmt::Display for DuplicateMac {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.response { "response" } else { "request" };
        let Self { port, vendor, serial, .. } = self;
        write!(f, "duplicate MAC ID check {kind}, port {port}, vendor {vendor:#06x}, serial {serial:#010x}")
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use profile_generic::wire::check::check_vectors;

    /// Layout: Lika SFA-5000 and Datalogic AMT58 manuals, 6.4.1.
    const VECTORS: &[(&str, &[u8], DuplicateMac)] = &[
        (
            "request",
            &[0x00, 0x23, 0x03, 0x01, 0x00, 0x00, 0x00],
            DuplicateMac { response: false, port: 0, vendor: 0x0323, serial: 1 },
        ),
        (
            "response of port 127",
            &[0xFF, 0x34, 0x12, 0xEF, 0xBE, 0xAD, 0xDE],
            DuplicateMac { response: true, port: 127, vendor: 0x1234, serial: 0xDEAD_BEEF },
        ),
    ];

    #[test]
    fn vectors() {
        check_vectors!(VECTORS, DuplicateMac);
        assert_eq!(DuplicateMac::parse(&[0; 8]), Err(Error::trailing(MESSAGE, 7, 1)));
        let port = DuplicateMac { port: 128, ..VECTORS[0].2 };
        assert!(port.emit(&mut [0; 8]).is_err());
        assert_eq!(
            VECTORS[1].2.to_string(),
            "duplicate MAC ID check response, port 127, vendor 0x1234, serial 0xdeadbeef"
        );
    }

    proptest! {
        #[test]
        fn any_seven_bytes_come_back(bytes in any::<[u8; LEN]>()) {
            let mut buffer = [0xA5; LEN];
            prop_assert_eq!(DuplicateMac::parse(&bytes).unwrap().emit(&mut buffer), Ok(LEN));
            prop_assert_eq!(buffer, bytes);
        }
    }
}
