//! SERCOS communication profile (SCP) classes: the words of S-0-1000 and S-0-1000.0.1.
//!
//! High byte the class, low byte its version.

pub use crate::generated::codes::ScpClass;
use core::fmt;

/// One entry of the class list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ScpEntry {
    /// The class.
    pub class: ScpClass,
    /// Its version, counted from 1.
    pub version: u8,
}

impl ScpEntry {
    /// The entry in a list word.
    #[must_use]
    pub const fn from_word(word: u16) -> ScpEntry {
        let [version, class] = word.to_le_bytes();
        ScpEntry { class: ScpClass(class), version }
    }

    /// The list word of the entry.
    #[must_use]
    pub const fn to_word(self) -> u16 {
        u16::from_le_bytes([self.version, self.class.0])
    }
}

impl fmt::Display for ScpEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} V{}", self.class, self.version)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_recording() {
        // Startup recording, frames 2335 and 2359: 0x0201, 0x0301, 0x0A01.
        let texts = [0x0201, 0x0301, 0x0A01, 0x3002].map(|word| ScpEntry::from_word(word).to_string());
        assert_eq!(texts, ["SCP_VarCFG V1", "SCP_Sync V1", "SCP_NRT V1", "0x30 V2"]);
        for word in 0..=u16::MAX {
            assert_eq!(ScpEntry::from_word(word).to_word(), word);
        }
    }
}
