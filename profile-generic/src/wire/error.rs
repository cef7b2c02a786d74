//! The error of all wire code.

use core::fmt;

/// What a layout has at the place where an [`Error`] is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// So many bytes: from the offset on, or in all where the error has no offset.
    Bytes(usize),
    /// Nothing more: the part ends here.
    End,
    /// This value, or the nearest permitted one.
    Value(u32),
    /// At most this value, or so many items.
    AtMost(u32),
    /// A value of a range or set that is best described in words.
    OneOf(&'static str),
}

/// Why bytes are not what they should be, or why a value does not fit its buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Error {
    /// The part or field that was read or written.
    pub what: &'static str,
    /// Its offset in bytes from the start of the slice that was handed to the parser; `None` where it is the whole slice, or
    /// where the value counts and not its place.
    pub offset: Option<usize>,
    /// What the layout has there.
    pub expected: Expected,
    /// What came: the number of bytes, or the value.
    pub found: usize,
}

impl Error {
    /// The buffer ends before `what` does, which needs so many bytes from `offset` on.
    #[must_use]
    pub const fn truncated(what: &'static str, offset: usize, needed: usize, available: usize) -> Error {
        Error { what, offset: Some(offset), expected: Expected::Bytes(needed), found: available }
    }

    /// `what` has a fixed length, and the slice has another one.
    #[must_use]
    pub const fn length(what: &'static str, expected: usize, found: usize) -> Error {
        Error { what, offset: None, expected: Expected::Bytes(expected), found }
    }

    /// Bytes are left over behind `what`; `offset` is that of the first one too many.
    #[must_use]
    pub const fn trailing(what: &'static str, offset: usize, excess: usize) -> Error {
        Error { what, offset: Some(offset), expected: Expected::End, found: excess }
    }

    /// The field `what` has a value which the part cannot have.
    #[must_use]
    pub const fn invalid(what: &'static str, offset: usize, expected: u32, found: u32) -> Error {
        Error { what, offset: Some(offset), expected: Expected::Value(expected), found: found as usize }
    }

    /// A value does not fit the field `what`, or there are more items than this code keeps.
    #[must_use]
    pub const fn too_large(what: &'static str, max: u32, value: u32) -> Error {
        Error { what, offset: None, expected: Expected::AtMost(max), found: value as usize }
    }

    /// The field `what` has a value outside of a range or set that `expected` describes.
    #[must_use]
    pub const fn value(what: &'static str, expected: &'static str, found: u32) -> Error {
        Error { what, offset: None, expected: Expected::OneOf(expected), found: found as usize }
    }

    /// The same error in a part that begins `base` bytes behind the start of the slice.
    #[must_use]
    pub fn behind(self, base: usize) -> Error {
        Error { offset: self.offset.map(|offset| offset + base), ..self }
    }

    /// The number of bytes is wrong, whatever they say.
    #[must_use]
    pub const fn is_length(&self) -> bool {
        matches!(self.expected, Expected::Bytes(_) | Expected::End)
    }

    /// There are fewer bytes than the layout has.
    #[must_use]
    pub const fn is_too_short(&self) -> bool {
        matches!(self.expected, Expected::Bytes(expected) if self.found < expected)
    }

    /// There are more bytes than the layout has.
    #[must_use]
    pub const fn is_too_long(&self) -> bool {
        match self.expected {
            Expected::Bytes(expected) => self.found > expected,
            expected => matches!(expected, Expected::End),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Error { what, offset, expected, found } = *self;
        f.write_str(what)?;
        match (offset, expected) {
            (Some(offset), Expected::End) => {
                return write!(f, " ends at byte {offset}, but {found} more bytes follow");
            }
            (Some(offset), _) => write!(f, " at byte {offset}: expected ")?,
            (None, _) => f.write_str(": expected ")?,
        }
        match expected {
            Expected::Bytes(bytes) if offset.is_none() => write!(f, "{bytes} bytes, got {found}"),
            Expected::Bytes(bytes) => write!(f, "{bytes} bytes, found {found}"),
            Expected::End => write!(f, "its end, found {found} more bytes"),
            Expected::Value(value) => write!(f, "{value:#x}, found {found:#x}"),
            Expected::AtMost(max) => write!(f, "at most {max}, found {found}"),
            Expected::OneOf(values) => write!(f, "{values}, got {found:#x}"),
        }
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_says_what_was_expected_and_what_came() {
        let cases = [
            (Error::truncated("word", 1, 4, 2), "word at byte 1: expected 4 bytes, found 2"),
            (Error::length("EMCY", 8, 9), "EMCY: expected 8 bytes, got 9"),
            (Error::trailing("path", 6, 2), "path ends at byte 6, but 2 more bytes follow"),
            (Error::invalid("family", 3, 2, 0x200), "family at byte 3: expected 0x2, found 0x200"),
            (Error::too_large("items", 8, 300), "items: expected at most 8, found 300"),
            (Error::value("node-id", "1 to 127", 200), "node-id: expected 1 to 127, got 0xc8"),
        ];
        for (error, text) in cases {
            assert_eq!(error.to_string(), text);
        }
        assert_eq!(Error::trailing("path", 6, 2).behind(4).offset, Some(10));
        assert_eq!(Error::length("EMCY", 8, 9).behind(4).offset, None);
    }

    #[test]
    fn too_short_and_too_long_are_told_apart() {
        let lengths = [
            Error::truncated("word", 1, 4, 2),
            Error::length("EMCY", 8, 7),
            Error::length("EMCY", 8, 9),
            Error::trailing("path", 6, 2),
            Error::invalid("family", 3, 2, 0x200),
        ];
        assert_eq!(lengths.map(|error| error.is_too_short()), [true, true, false, false, false]);
        assert_eq!(lengths.map(|error| error.is_length()), [true, true, true, true, false]);
        assert_eq!(lengths.map(|error| error.is_too_long()), [false, false, true, true, false]);
    }
}
