//! Data of RegisterSession, request and reply alike.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | protocol version, 1 |
//! | 2 | 2 | options, 0 |

use super::{Error, Reader, Writer};
use core::fmt;

/// Length in bytes.
pub const REGISTER_SESSION_LEN: usize = 4;

/// Version and options of the encapsulation protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterSession {
    /// Requested version; in a reply the highest one supported.
    pub protocol_version: u16,
    /// Session options, none defined.
    pub options: u16,
}

impl RegisterSession {
    /// Reads exactly this block.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let value = Self { protocol_version: r.u16("protocol version")?, options: r.u16("session options")? };
        r.finish("RegisterSession")?;
        Ok(value)
    }

    /// Always [`REGISTER_SESSION_LEN`].
    pub const fn buffer_len(&self) -> usize {
        REGISTER_SESSION_LEN
    }

    /// Writes the block and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("protocol version", self.protocol_version)?;
        w.u16("session options", self.options)?;
        Ok(w.written())
    }
}

impl fmt::Display for RegisterSession {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "protocol version {} options {:#06x}", self.protocol_version, self.options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let vectors: &[(&str, &[u8], RegisterSession)] = &[
            ("version 1", &[1, 0, 0, 0], RegisterSession { protocol_version: 1, options: 0 }),
            ("byte order", &[1, 2, 3, 4], RegisterSession { protocol_version: 0x0201, options: 0x0403 }),
        ];
        check_vectors!(vectors, RegisterSession);
        assert_eq!(RegisterSession::parse(&[1, 0, 0, 0, 0]), Err(Error::trailing("RegisterSession", 4, 1)));
    }

    proptest! {
        #[test]
        fn round_trip(protocol_version: u16, options: u16) {
            let value = RegisterSession { protocol_version, options };
            let mut buffer = [0xA5; 4];
            prop_assert_eq!(value.emit(&mut buffer), Ok(4));
            prop_assert_eq!(RegisterSession::parse(&buffer), Ok(value));
        }
    }
}
