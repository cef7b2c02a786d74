//! Six bytes of a service channel slot as they travel, before anybody reads a meaning into them.
//!
//! | byte | size | field |
//! |---|---|---|
//! | 0 | 2 | control word (in MDTs) or status word (in ATs) |
//! | 2 | 4 | INFO |

use core::fmt;

use profile_generic::wire::{Error, need, put_u16, put_u32, u16_at, u32_at};

/// Bytes of a slot.
pub const SLOT_LEN: usize = 6;

/// One service channel slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct SvcSlot {
    /// Control word (MDT) or status word (AT).
    pub word: u16,
    /// INFO: an IDN, up to four bytes of an element, or an error code.
    pub info: u32,
}

impl SvcSlot {
    /// Reads a slot from the start of `bytes`.
    pub fn parse(bytes: &[u8]) -> Result<SvcSlot, Error> {
        need("service channel slot", SLOT_LEN, bytes.len())?;
        Ok(SvcSlot { word: u16_at(bytes, 0), info: u32_at(bytes, 2) })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        SLOT_LEN
    }

    /// Writes the slot to the start of `bytes`.
    pub fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        need("service channel slot", SLOT_LEN, bytes.len())?;
        put_u16(bytes, 0, self.word);
        put_u32(bytes, 2, self.info);
        Ok(())
    }
}

impl fmt::Display for SvcSlot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#06x} INFO {:#010x}", self.word, self.info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;

    /// Recording sercos3_startup_line2: frame, bytes, slot.
    const VECTORS: &[(u32, [u8; 6], SvcSlot)] = &[
        (1401, [0x0E, 0x00, 0x16, 0x05, 0x01, 0x00], SvcSlot { word: 0x000E, info: 0x0001_0516 }),
        (1431, [0x09, 0x00, 0x01, 0x00, 0x01, 0x00], SvcSlot { word: 0x0009, info: 0x0001_0001 }),
    ];

    #[test]
    fn vectors_both_ways_and_truncation() {
        check_vectors!(VECTORS, SvcSlot, fixed);
        assert_eq!(VECTORS[0].2.to_string(), "0x000e INFO 0x00010516");
    }
}
