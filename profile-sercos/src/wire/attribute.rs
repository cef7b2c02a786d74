//! Element 3 of a data block: the attribute.
//!
//! | bits | part |
//! |---|---|
//! | 15..0 | conversion factor |
//! | 17..16 | item length: 1, 2, 4 or 8 bytes |
//! | 18 | variable length (list or text) |
//! | 19 | procedure command |
//! | 22..20 | display format |
//! | 23 | reserved |
//! | 27..24 | digits behind the decimal point |
//! | 28, 29, 30 | write protected in CP2, CP3, CP4 |
//! | 31 | reserved |

use core::fmt;

mod field {
    pub const LENGTH_SHIFT: u32 = 16;
    pub const VARIABLE: u32 = 1 << 18;
    pub const COMMAND: u32 = 1 << 19;
    pub const FORMAT_SHIFT: u32 = 20;
    pub const DECIMALS_SHIFT: u32 = 24;
    pub const PROTECTED_CP2: u32 = 1 << 28;
}

/// How the operation data is to be shown. All eight values have a meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Format {
    /// Bit pattern.
    Binary = 0,
    /// Unsigned integer.
    Unsigned = 1,
    /// Integer, two's complement.
    Signed = 2,
    /// Unsigned integer shown in hexadecimal.
    Hexadecimal = 3,
    /// Text.
    Text = 4,
    /// Identification number.
    Idn = 5,
    /// IEEE 754 number.
    Float = 6,
    /// Value whose meaning comes from another parameter.
    Parameter = 7,
}

impl Format {
    const ALL: [Format; 8] = [
        Format::Binary,
        Format::Unsigned,
        Format::Signed,
        Format::Hexadecimal,
        Format::Text,
        Format::Idn,
        Format::Float,
        Format::Parameter,
    ];

    /// Name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Format::Binary => "binary",
            Format::Unsigned => "unsigned",
            Format::Signed => "signed",
            Format::Hexadecimal => "hexadecimal",
            Format::Text => "text",
            Format::Idn => "IDN",
            Format::Float => "float",
            Format::Parameter => "parameter",
        }
    }
}

/// Bytes of one item of operation data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum ItemLength {
    /// One byte.
    One = 0,
    /// Two bytes.
    Two = 1,
    /// Four bytes.
    Four = 2,
    /// Eight bytes.
    Eight = 3,
}

impl ItemLength {
    const ALL: [ItemLength; 4] = [ItemLength::One, ItemLength::Two, ItemLength::Four, ItemLength::Eight];

    /// Length in bytes: 1, 2, 4 or 8.
    #[must_use]
    pub const fn bytes(self) -> u8 {
        1 << self as u8
    }
}

/// An attribute word. Reserved bits are kept.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Attribute(pub u32);

impl Attribute {
    /// An attribute of conversion factor 1, no decimals, writable in CP2, CP3 and CP4.
    #[must_use]
    pub const fn new(length: ItemLength, format: Format) -> Attribute {
        Attribute(1 | (length as u32) << field::LENGTH_SHIFT | (format as u32) << field::FORMAT_SHIFT)
    }

    /// The same for a list or text of such items.
    #[must_use]
    pub const fn list(self) -> Attribute {
        Attribute(self.0 | field::VARIABLE)
    }

    /// The same for a procedure command.
    #[must_use]
    pub const fn command(self) -> Attribute {
        Attribute(self.0 | field::COMMAND)
    }

    /// The same with `digits` (modulo 16) behind the decimal point.
    #[must_use]
    pub const fn with_decimals(self, digits: u8) -> Attribute {
        let mask = 0xF << field::DECIMALS_SHIFT;
        Attribute(self.0 & !mask | ((digits as u32) << field::DECIMALS_SHIFT) & mask)
    }

    /// The same, write protected in CP2, CP3, CP4 as given.
    #[must_use]
    pub const fn protect(self, cp2: bool, cp3: bool, cp4: bool) -> Attribute {
        let mut word = self.0 & !(7 * field::PROTECTED_CP2);
        if cp2 {
            word |= field::PROTECTED_CP2;
        }
        if cp3 {
            word |= field::PROTECTED_CP2 << 1;
        }
        if cp4 {
            word |= field::PROTECTED_CP2 << 2;
        }
        Attribute(word)
    }

    /// Conversion factor.
    #[must_use]
    pub const fn conversion_factor(self) -> u16 {
        let bytes = self.0.to_le_bytes();
        u16::from_le_bytes([bytes[0], bytes[1]])
    }

    /// Bytes of one item.
    #[must_use]
    pub const fn item_length(self) -> ItemLength {
        ItemLength::ALL[(self.0 >> field::LENGTH_SHIFT & 3) as usize]
    }

    /// Whether the operation data is a list or text with a length of its own.
    #[must_use]
    pub const fn is_list(self) -> bool {
        self.0 & field::VARIABLE != 0
    }

    /// Whether the data block is a procedure command.
    #[must_use]
    pub const fn is_command(self) -> bool {
        self.0 & field::COMMAND != 0
    }

    /// Display format.
    #[must_use]
    pub const fn format(self) -> Format {
        Format::ALL[(self.0 >> field::FORMAT_SHIFT & 7) as usize]
    }

    /// Digits behind the decimal point, 0..=15.
    #[must_use]
    pub const fn decimals(self) -> u8 {
        self.0.to_le_bytes()[3] & 0xF
    }

    /// Whether the operation data cannot be written in communication phase `phase`; phases below 2 have no
    /// service channel and count as protected, those above 4 as 4.
    #[must_use]
    pub const fn write_protected(self, phase: u8) -> bool {
        match phase {
            0 | 1 => true,
            2 => self.0 & field::PROTECTED_CP2 != 0,
            3 => self.0 & field::PROTECTED_CP2 << 1 != 0,
            _ => self.0 & field::PROTECTED_CP2 << 2 != 0,
        }
    }
}

impl fmt::Display for Attribute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} byte {}", self.item_length().bytes(), self.format().name())?;
        if self.is_list() {
            f.write_str(" list")?;
        }
        if self.is_command() {
            f.write_str(" command")?;
        }
        if self.decimals() != 0 {
            write!(f, ", {} decimals", self.decimals())?;
        }
        for phase in 2..=4 {
            if self.write_protected(phase) {
                write!(f, ", protected in CP{phase}")?;
            }
        }
        Ok(())
    }
}

impl fmt::Debug for Attribute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Attribute({:#010x}: {self})", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn vectors() {
        use Format as F;
        use ItemLength as L;
        // (word, source, built, text)
        let vectors: &[(u32, &str, Attribute, &str)] = &[
            (
                0x0001_0001,
                "startup recording, frame 1431",
                Attribute::new(L::Two, F::Binary),
                "2 byte binary",
            ),
            (
                0x0009_0001,
                "startup recording, frame 1591",
                Attribute::new(L::Two, F::Binary).command(),
                "2 byte binary command",
            ),
            (
                0x0005_0001,
                "startup recording, frame 2407",
                Attribute::new(L::Two, F::Binary).list(),
                "2 byte binary list",
            ),
            (0x0011_0001, "drive manuals", Attribute::new(L::Two, F::Unsigned), "2 byte unsigned"),
            (
                0x7001_0001,
                "drive manuals",
                Attribute::new(L::Two, F::Binary).protect(true, true, true),
                "2 byte binary, protected in CP2, protected in CP3, protected in CP4",
            ),
            (
                0x4001_0001,
                "drive manuals",
                Attribute::new(L::Two, F::Binary).protect(false, false, true),
                "2 byte binary, protected in CP4",
            ),
            (
                0x0422_0001,
                "drive manuals",
                Attribute::new(L::Four, F::Signed).with_decimals(4),
                "4 byte signed, 4 decimals",
            ),
            (
                0x7055_0001,
                "drive manuals",
                Attribute::new(L::Two, F::Idn).list().protect(true, true, true),
                "2 byte IDN list, protected in CP2, protected in CP3, protected in CP4",
            ),
            (
                0x7044_0001,
                "drive manuals",
                Attribute::new(L::One, F::Text).list().protect(true, true, true),
                "1 byte text list, protected in CP2, protected in CP3, protected in CP4",
            ),
        ];
        for &(word, source, built, text) in vectors {
            assert_eq!(built, Attribute(word), "{source}");
            assert_eq!(built.to_string(), text, "{source}");
        }
    }

    #[test]
    fn protection_by_phase() {
        let word = Attribute::new(ItemLength::Eight, Format::Float).protect(false, true, false);
        assert_eq!(
            [0, 1, 2, 3, 4, 5].map(|p| word.write_protected(p)),
            [true, true, false, true, false, false]
        );
        assert_eq!(word.item_length().bytes(), 8);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn taken_apart_and_put_together(word: u32) {
            let a = Attribute(word);
            let mut b = Attribute::new(a.item_length(), a.format())
                .with_decimals(a.decimals())
                .protect(a.write_protected(2), a.write_protected(3), a.write_protected(4));
            if a.is_list() {
                b = b.list();
            }
            if a.is_command() {
                b = b.command();
            }
            prop_assert_eq!(b.0 & !0xFFFF | u32::from(a.conversion_factor()), word & !0x8080_0000);
        }
    }
}
