//! Identification numbers (IDN): the 32-bit name of a parameter or procedure command.
//!
//! | bits | part | range |
//! |---|---|---|
//! | 31..24 | structure instance (SI) | 0..=255 |
//! | 23..16 | structure element (SE) | 0..=255 |
//! | 15 | 0 standard (S), 1 product specific (P) | |
//! | 14..12 | parameter set | 0..=7 |
//! | 11..0 | data block | 0..=4095 |
//!
//! Printed as `S-0-1050.1.3` (kind, set, data block, SI, SE); `.SI.SE` is left out when both are 0.
//! SERCOS I and II and SoE know the low half only.

pub use crate::generated::idns::connection;
use core::fmt;
use core::str::FromStr;

mod field {
    pub const SI_SHIFT: u32 = 24;
    pub const SE_SHIFT: u32 = 16;
    pub const PRODUCT: u32 = 1 << 15;
    pub const SET_SHIFT: u32 = 12;
    pub const SET_MAX: u32 = 7;
    pub const BLOCK_MAX: u32 = 0xFFF;
}

/// A 32-bit identification number. Every bit pattern is one.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Idn(pub u32);

impl Idn {
    /// Data block of the connection parameters, S-0-1050.x.y.
    pub const CONNECTION_BLOCK: u16 = 1050;

    /// A standard IDN of parameter set 0 without structure; `block` is taken modulo 4096.
    #[must_use]
    pub const fn standard(block: u16) -> Idn {
        Idn(block as u32 & field::BLOCK_MAX)
    }

    /// A product specific IDN of parameter set 0 without structure; `block` is taken modulo 4096.
    #[must_use]
    pub const fn product(block: u16) -> Idn {
        Idn(field::PRODUCT | (block as u32 & field::BLOCK_MAX))
    }

    /// A standard IDN of parameter set 0 with structure instance and element; `block` is taken modulo 4096.
    #[must_use]
    pub const fn structured(block: u16, instance: u8, element: u8) -> Idn {
        Idn::standard(block).with_structure(instance, element)
    }

    /// S-0-1050.`connection`.`element`.
    #[must_use]
    pub const fn connection(connection: u8, element: u8) -> Idn {
        Idn::structured(Idn::CONNECTION_BLOCK, connection, element)
    }

    /// The same data block with another structure instance and element.
    #[must_use]
    pub const fn with_structure(self, instance: u8, element: u8) -> Idn {
        Idn(self.0 & 0xFFFF | (instance as u32) << field::SI_SHIFT | (element as u32) << field::SE_SHIFT)
    }

    /// The same data block in another parameter set; `set` is taken modulo 8.
    #[must_use]
    pub const fn with_set(self, set: u8) -> Idn {
        let mask = field::SET_MAX << field::SET_SHIFT;
        Idn(self.0 & !mask | ((set as u32) << field::SET_SHIFT) & mask)
    }

    /// Whether the IDN is product specific (P), not of the standard (S).
    #[must_use]
    pub const fn is_product(self) -> bool {
        self.0 & field::PRODUCT != 0
    }

    /// Parameter set, 0..=7.
    #[must_use]
    pub const fn set(self) -> u8 {
        self.0.to_le_bytes()[1] >> 4 & 7
    }

    /// Data block, 0..=4095.
    #[must_use]
    pub const fn block(self) -> u16 {
        let bytes = self.0.to_le_bytes();
        u16::from_le_bytes([bytes[0], bytes[1] & 0x0F])
    }

    /// Structure instance (SI).
    #[must_use]
    pub const fn instance(self) -> u8 {
        self.0.to_le_bytes()[3]
    }

    /// Structure element (SE).
    #[must_use]
    pub const fn element(self) -> u8 {
        self.0.to_le_bytes()[2]
    }
}

impl fmt::Display for Idn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.is_product() { 'P' } else { 'S' };
        write!(f, "{kind}-{}-{:04}", self.set(), self.block())?;
        if self.instance() != 0 || self.element() != 0 {
            write!(f, ".{}.{}", self.instance(), self.element())?;
        }
        Ok(())
    }
}

impl fmt::Debug for Idn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Why a text is not an IDN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ParseIdnError {
    /// The text does not begin with `S-` or `P-`.
    #[error("an IDN begins with S- or P-")]
    Kind,
    /// The parameter set is not a number of 0..=7.
    #[error("the parameter set of an IDN is a number from 0 to 7")]
    Set,
    /// The data block is not a number of 0..=4095.
    #[error("the data block of an IDN is a number from 0 to 4095")]
    Block,
    /// Behind the data block stands something else than `.SI.SE`, both 0..=255.
    #[error("behind the data block an IDN has nothing or .SI.SE, both numbers from 0 to 255")]
    Structure,
}

/// A number without sign or blanks.
fn number<T: FromStr>(text: &str) -> Option<T> {
    text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok()).flatten()
}

impl FromStr for Idn {
    type Err = ParseIdnError;

    fn from_str(text: &str) -> Result<Idn, ParseIdnError> {
        let (base, rest) = match text.split_at_checked(2) {
            Some(("S-" | "s-", rest)) => (0, rest),
            Some(("P-" | "p-", rest)) => (field::PRODUCT, rest),
            _ => return Err(ParseIdnError::Kind),
        };
        let (set, rest) = rest.split_once('-').ok_or(ParseIdnError::Set)?;
        let set: u8 = number(set).filter(|&s| u32::from(s) <= field::SET_MAX).ok_or(ParseIdnError::Set)?;
        let mut parts = rest.split('.');
        let block: u16 = parts
            .next()
            .and_then(number)
            .filter(|&b| u32::from(b) <= field::BLOCK_MAX)
            .ok_or(ParseIdnError::Block)?;
        let plain = Idn(base | u32::from(block)).with_set(set);
        match (parts.next(), parts.next(), parts.next()) {
            (None, None, None) => Ok(plain),
            (Some(instance), Some(element), None) => {
                let instance = number(instance).ok_or(ParseIdnError::Structure)?;
                let element = number(element).ok_or(ParseIdnError::Structure)?;
                Ok(plain.with_structure(instance, element))
            }
            _ => Err(ParseIdnError::Structure),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// (text, value, where it was seen); recording frames carry the value in the open step of the MDT.
    const VECTORS: &[(&str, u32, &str)] = &[
        ("S-0-1302.0.1", 0x0001_0516, "startup recording, frame 1401"),
        ("S-0-0099", 0x0000_0063, "startup recording, frame 1561"),
        ("S-0-1000", 0x0000_03E8, "startup recording, frame 2209"),
        ("S-0-1050.1.3", 0x0103_041A, "startup recording, frame 3689"),
        ("S-0-1050.0.11", 0x000B_041A, "startup recording, frame 4209"),
        ("S-0-1027.0.2", 0x0002_0403, "startup recording, frame 4505"),
        ("S-0-0127", 0x0000_007F, "startup recording, frame 4769"),
        ("P-0-0012", 0x0000_800C, "IDN layout: bit 15"),
        ("P-7-4095.255.255", 0xFFFF_FFFF, "IDN layout: every bit"),
        ("S-3-0000", 0x0000_3000, "IDN layout: bits 14..12"),
    ];

    #[test]
    fn vectors_both_ways() {
        for &(text, value, source) in VECTORS {
            assert_eq!(Idn(value).to_string(), text, "{source}");
            assert_eq!(text.parse(), Ok(Idn(value)), "{source}");
        }
        assert_eq!(Idn::MTU_EFFECTIVE, Idn(0x0002_0403));
        assert_eq!(Idn::connection(1, 3), Idn(0x0103_041A));
        assert_eq!(Idn::product(12), Idn(0x800C));
    }

    #[test]
    fn parts() {
        let idn = Idn(0x0103_D41A);
        assert!(idn.is_product());
        assert_eq!((idn.set(), idn.block(), idn.instance(), idn.element()), (5, 1050, 1, 3));
    }

    #[test]
    fn texts_that_are_no_idn() {
        let table: &[(&str, ParseIdnError)] = &[
            ("", ParseIdnError::Kind),
            ("Q-0-0001", ParseIdnError::Kind),
            ("S0-0001", ParseIdnError::Kind),
            ("S-", ParseIdnError::Set),
            ("S-8-0001", ParseIdnError::Set),
            ("S--0001", ParseIdnError::Set),
            ("S-0-4096", ParseIdnError::Block),
            ("S-0-", ParseIdnError::Block),
            ("S-0-+1", ParseIdnError::Block),
            ("S-0-1050.1", ParseIdnError::Structure),
            ("S-0-1050.1.", ParseIdnError::Structure),
            ("S-0-1050.1.256", ParseIdnError::Structure),
            ("S-0-1050.1.2.3", ParseIdnError::Structure),
            ("\u{2013}-0-1", ParseIdnError::Kind),
        ];
        for &(text, error) in table {
            assert_eq!(text.parse::<Idn>(), Err(error), "{text:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn text_round_trip(value: u32) {
            prop_assert_eq!(Idn(value).to_string().parse(), Ok(Idn(value)));
        }

        #[test]
        fn any_text_is_survived(text in ".{0,24}") {
            let _ = text.parse::<Idn>();
        }
    }
}
