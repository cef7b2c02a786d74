//! The one error of the wire code.

use core::fmt;

/// Why the data of a frame are not what they should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// A frame of this kind has another number of bytes.
    Length {
        /// The kind of frame.
        what: &'static str,
        /// Bytes it has.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// A field has a value which it cannot have.
    Value {
        /// The field.
        what: &'static str,
        /// What it can be, in words.
        expected: &'static str,
        /// The value that came.
        found: u32,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::Length { what, expected, found } => {
                write!(f, "{what}: expected {expected} bytes, got {found}")
            }
            Error::Value { what, expected, found } => {
                write!(f, "{what}: expected {expected}, got {found:#x}")
            }
        }
    }
}

impl std::error::Error for Error {}

/// The bytes as an array, if there are exactly so many.
pub(crate) fn exact<const N: usize>(what: &'static str, bytes: &[u8]) -> Result<[u8; N], Error> {
    bytes.try_into().map_err(|_| Error::Length { what, expected: N, found: bytes.len() })
}

/// Little-endian `u16` at `offset` of an array that holds it.
pub(crate) const fn u16_at<const N: usize>(bytes: &[u8; N], offset: usize) -> u16 {
    u16::from_le_bytes([bytes[offset], bytes[offset + 1]])
}

/// Little-endian `u32` at `offset` of an array that holds it.
pub(crate) const fn u32_at<const N: usize>(bytes: &[u8; N], offset: usize) -> u32 {
    u32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
}
