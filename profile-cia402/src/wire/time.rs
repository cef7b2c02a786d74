//! TIME: time of day and date.

use core::fmt;

use profile_generic::wire::{Error, exact, u16_at, u32_at};

/// Bytes of TIME.
pub const TIME_LEN: usize = 6;

/// Bits of the milliseconds; the four above are reserved.
const MS_MASK: u32 = 0x0FFF_FFFF;

/// Days from 1970-01-01 to 1984-01-01.
const EPOCH_DAYS: u64 = 5_113;

const MS_PER_DAY: u64 = 86_400_000;

/// A time of day.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct TimeOfDay {
    /// Milliseconds after midnight, 28 bits.
    pub milliseconds: u32,
    /// Days since 1984-01-01.
    pub days: u16,
}

impl TimeOfDay {
    /// The time of day at so many milliseconds after 1970-01-01; `None` before 1984 and after 2163.
    #[must_use]
    pub fn from_unix_ms(ms: u64) -> Option<Self> {
        let days = (ms / MS_PER_DAY).checked_sub(EPOCH_DAYS)?;
        let milliseconds = u32::try_from(ms % MS_PER_DAY).ok()?;
        Some(Self { milliseconds, days: u16::try_from(days).ok()? })
    }

    /// Milliseconds after 1970-01-01.
    #[must_use]
    pub fn unix_ms(self) -> u64 {
        (u64::from(self.days) + EPOCH_DAYS) * MS_PER_DAY + u64::from(self.milliseconds)
    }

    /// Reads one; the reserved bits are ignored.
    ///
    /// # Errors
    /// [`Error::length`] unless there are six bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let bytes = exact::<TIME_LEN>("TIME", bytes)?;
        Ok(Self { milliseconds: u32_at(&bytes, 0) & MS_MASK, days: u16_at(&bytes, 4) })
    }

    /// The bytes; bits above 28 of the milliseconds are left out.
    #[must_use]
    pub fn emit(&self) -> [u8; TIME_LEN] {
        let [a, b, c, d] = (self.milliseconds & MS_MASK).to_le_bytes();
        let [e, f] = self.days.to_le_bytes();
        [a, b, c, d, e, f]
    }
}

impl fmt::Display for TimeOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TIME day {} and {} ms", self.days, self.milliseconds)
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn vectors_both_ways() {
        // canopen tests: test_time, but for the days, which that release counted from 1970; the second is the origin.
        let vectors = [
            (1_486_236_238_000, [0xB0, 0xA4, 0x29, 0x04, 0x38, 0x2F], 69_838_000, 12_088),
            (441_763_200_000, [0, 0, 0, 0, 0, 0], 0, 0),
        ];
        for (unix, bytes, milliseconds, days) in vectors {
            let value = TimeOfDay { milliseconds, days };
            assert_eq!(TimeOfDay::from_unix_ms(unix), Some(value), "{unix}");
            assert_eq!(value.unix_ms(), unix);
            check_vectors!(&[(unix, bytes, value)], TimeOfDay, whole);
        }
        assert_eq!(TimeOfDay::from_unix_ms(441_763_199_999), None);
        assert_eq!(TimeOfDay::from_unix_ms(u64::MAX), None);
        assert_eq!(TimeOfDay { milliseconds: 7, days: 2 }.to_string(), "TIME day 2 and 7 ms");
    }

    proptest! {
        #[test]
        fn round_trips(milliseconds in 0..=MS_MASK, days: u16, bytes: [u8; 6]) {
            let value = TimeOfDay { milliseconds, days };
            prop_assert_eq!(TimeOfDay::parse(&value.emit()), Ok(value));
            let parsed = TimeOfDay::parse(&bytes).unwrap();
            prop_assert_eq!(TimeOfDay::parse(&parsed.emit()), Ok(parsed));
        }
    }
}
