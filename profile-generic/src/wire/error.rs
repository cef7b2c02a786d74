//! The error of all wire code.

use core::fmt;

/// Why bytes are not what they should be, or why a value does not fit its buffer.
///
/// Offsets count from the start of the slice that was handed to the parser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// The buffer ends before the part named `what` does.
    Truncated {
        /// The part that was read or written.
        what: &'static str,
        /// Offset of the part in bytes.
        offset: usize,
        /// Bytes needed from that offset on.
        needed: usize,
        /// Bytes there from that offset on.
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
    /// A value does not fit the field it should be written to, or there are more items than this code keeps.
    OutOfRange {
        /// The field.
        what: &'static str,
        /// The value.
        value: u32,
        /// The largest permitted value.
        max: u32,
    },
    /// Bytes are left over behind the part named `what`.
    Trailing {
        /// The part that was read.
        what: &'static str,
        /// Offset of the first byte too many.
        offset: usize,
        /// How many bytes are left over.
        excess: usize,
    },
    /// A frame of a fixed length has another number of bytes.
    Length {
        /// The kind of frame.
        what: &'static str,
        /// Its length in bytes.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// A field has a value outside a range or set that is best described in words.
    Value {
        /// The field.
        what: &'static str,
        /// The permitted values, in words.
        expected: &'static str,
        /// The value that came.
        found: u32,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::Truncated { what, offset, needed, available } => {
                write!(f, "{what} at byte {offset}: expected {needed} bytes, found {available}")
            }
            Error::Invalid { what, offset, found, expected } => {
                write!(f, "{what} at byte {offset}: expected {expected:#x}, found {found:#x}")
            }
            Error::OutOfRange { what, value, max } => {
                write!(f, "{what}: expected at most {max}, found {value}")
            }
            Error::Trailing { what, offset, excess } => {
                write!(f, "{what} ends at byte {offset}, but {excess} more bytes follow")
            }
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
