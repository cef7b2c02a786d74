//! Status codes as text for messages: the number first, then its name.

use core::fmt;

use crate::wire::status::{ConnectionStatus, GeneralStatus};

/// A general status.
pub(super) struct Named(pub u8);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "status {:#04x}", self.0)?;
        GeneralStatus(self.0).name().map_or(Ok(()), |name| write!(f, " ({name})"))
    }
}

/// An extended status; its meaning depends on the general one.
pub(super) struct Extended {
    /// General status.
    pub general: u8,
    /// First extended status word.
    pub code: u16,
}

impl fmt::Display for Extended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "extended status {:#06x}", self.code)?;
        match (GeneralStatus(self.general), self.code) {
            (GeneralStatus::CONNECTION_FAILURE, code) => {
                ConnectionStatus(code).name().map_or(Ok(()), |name| write!(f, " ({name})"))
            }
            // Clause 7-1.1: 4 for the class ID, 5 + n for the ID of the axis with index n.
            (GeneralStatus::INVALID_ATTRIBUTE_VALUE, 4) => {
                f.write_str(" (data segment: drive power structure of the class)")
            }
            (GeneralStatus::INVALID_ATTRIBUTE_VALUE, code @ 5..) => {
                write!(f, " (data segment: drive power structure of axis {})", code - 4)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_number_and_name() {
        assert_eq!(Named(0x0E).to_string(), "status 0x0e (attribute not settable)");
        assert_eq!(Named(0xD0).to_string(), "status 0xd0");
        let text = |general, code| Extended { general, code }.to_string();
        assert_eq!(text(1, 0x0106), "extended status 0x0106 (ownership conflict)");
        assert_eq!(text(1, 0xFFFF), "extended status 0xffff");
        assert_eq!(text(9, 4), "extended status 0x0004 (data segment: drive power structure of the class)");
        assert_eq!(text(9, 6), "extended status 0x0006 (data segment: drive power structure of axis 2)");
        assert_eq!(text(9, 3), "extended status 0x0003");
    }
}
