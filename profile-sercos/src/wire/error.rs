//! The one error of the wire code.

use core::fmt;

/// Why bytes are not what they should be, or why a value does not fit its buffer.
///
/// Offsets count from the start of the slice that was handed to the parser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// The buffer ends before the part named `what` does.
    Truncated {
        /// The telegram part that was read or written.
        what: &'static str,
        /// Bytes needed.
        needed: usize,
        /// Bytes there.
        available: usize,
    },
    /// A field has a value which the part named `what` cannot have.
    Invalid {
        /// The field.
        what: &'static str,
        /// Offset of the field in bytes.
        offset: usize,
        /// The value found.
        found: u32,
        /// The value wanted, or the nearest permitted one.
        expected: u32,
    },
    /// A value does not fit the field it should be written to.
    OutOfRange {
        /// The field.
        what: &'static str,
        /// The value.
        value: u32,
        /// The largest permitted value.
        max: u32,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::Truncated { what, needed, available } => {
                write!(f, "{what}: needs {needed} bytes, {available} are there")
            }
            Error::Invalid { what, offset, found, expected } => {
                write!(f, "{what} at byte {offset}: expected {expected:#x}, found {found:#x}")
            }
            Error::OutOfRange { what, value, max } => write!(f, "{what}: {value} is above {max}"),
        }
    }
}

impl std::error::Error for Error {}

/// Fails with [`Error::Truncated`] unless `available` bytes are at least `needed`.
pub const fn need(what: &'static str, needed: usize, available: usize) -> Result<(), Error> {
    if available < needed { Err(Error::Truncated { what, needed, available }) } else { Ok(()) }
}

/// Little-endian `u16` at `offset`; the caller has checked the length with [`need`].
pub(crate) fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    u16::from_le_bytes([bytes[offset], bytes[offset + 1]])
}

/// Little-endian `u32` at `offset`; the caller has checked the length with [`need`].
pub(crate) fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
}

/// Writes a little-endian `u16` at `offset`; the caller has checked the length with [`need`].
pub(crate) fn put_u16(bytes: &mut [u8], offset: usize, value: u16) {
    bytes[offset..offset + 2].copy_from_slice(&value.to_le_bytes());
}

/// Writes a little-endian `u32` at `offset`; the caller has checked the length with [`need`].
pub(crate) fn put_u32(bytes: &mut [u8], offset: usize, value: u32) {
    bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
}
