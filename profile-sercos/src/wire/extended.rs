//! Extended field of MDT0 (data field bytes 8 to 11), where S-0-1032 bit 2 says that it is used: cycle
//! reference counter and SERCOS time.
//!
//! | byte | size | field |
//! |---|---|---|
//! | 0 | 2 | 13..0 TSref counter, 14 time valid, 15 time toggle |
//! | 2 | 2 | fragment of the SERCOS time |
//!
//! The time goes over in fragments of 16 bits during eight cycles: high and low half of the seconds, high and
//! low half of the nanoseconds, each one twice.

use core::fmt;

use profile_generic::wire::{Error, need, put_u16, u16_at};

/// Bytes of the field.
pub const EXTENDED_LEN: usize = 4;
/// Offset in the data field of MDT0: behind the hot-plug field.
pub const EXTENDED_OFFSET: usize = super::hot_plug::HOT_PLUG_LEN;

/// The extended field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Extended {
    /// Counter and time bits, whole.
    pub word: u16,
    /// Fragment of the SERCOS time; which one follows from the cycle count.
    pub time_fragment: u16,
}

impl Extended {
    /// Bit 14: the SERCOS time is valid.
    pub const TIME_VALID: u16 = 1 << 14;
    /// Bit 15: toggles when a new time begins.
    pub const TIME_TOGGLE: u16 = 1 << 15;

    /// Reads the field from the start of `bytes`.
    pub fn parse(bytes: &[u8]) -> Result<Extended, Error> {
        need("extended field", EXTENDED_LEN, bytes.len())?;
        Ok(Extended { word: u16_at(bytes, 0), time_fragment: u16_at(bytes, 2) })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        EXTENDED_LEN
    }

    /// Writes the field to the start of `bytes`.
    pub fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        need("extended field", EXTENDED_LEN, bytes.len())?;
        put_u16(bytes, 0, self.word);
        put_u16(bytes, 2, self.time_fragment);
        Ok(())
    }

    /// The TSref counter, 0..=16383.
    pub const fn tsref(&self) -> u16 {
        self.word & 0x3FFF
    }
}

impl fmt::Display for Extended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let valid = if self.word & Self::TIME_VALID != 0 { "valid" } else { "not valid" };
        write!(f, "TSref {}, SERCOS time {valid}, fragment {:#06x}", self.tsref(), self.time_fragment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn layout() {
        let field = Extended { word: Extended::TIME_VALID | 0x123, time_fragment: 0xABCD };
        check_vectors!(&[("time valid", [0x23, 0x41, 0xCD, 0xAB], field)], Extended, fixed);
        assert_eq!(field.tsref(), 0x123);
        assert_eq!(field.to_string(), "TSref 291, SERCOS time valid, fragment 0xabcd");
    }

    proptest! {
        #[test]
        fn any_bytes_come_back(bytes: [u8; EXTENDED_LEN]) {
            let mut again = [0xA5; EXTENDED_LEN];
            Extended::parse(&bytes).unwrap().emit(&mut again).unwrap();
            prop_assert_eq!(again, bytes);
        }
    }
}
