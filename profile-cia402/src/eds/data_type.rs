//! Data types of CiA 301.

profile_generic::open_code! {
    /// Data type of an object, as data sheets number it (CiA 301).
    pub struct DataType(u16) {
        /// One bit, in a byte outside of PDOs.
        BOOLEAN = 0x01,
        /// 8 bits, two's complement.
        INTEGER8 = 0x02,
        /// 16 bits, two's complement.
        INTEGER16 = 0x03,
        /// 32 bits, two's complement.
        INTEGER32 = 0x04,
        /// 8 bits.
        UNSIGNED8 = 0x05,
        /// 16 bits.
        UNSIGNED16 = 0x06,
        /// 32 bits.
        UNSIGNED32 = 0x07,
        /// 32 bits of IEEE 754.
        REAL32 = 0x08,
        /// Characters.
        VISIBLE_STRING = 0x09,
        /// Bytes.
        OCTET_STRING = 0x0A,
        /// 16-bit characters.
        UNICODE_STRING = 0x0B,
        /// 28 bits milliseconds after midnight, 16 bits days since 1984-01-01.
        TIME_OF_DAY = 0x0C,
        /// As the time of day, as a difference.
        TIME_DIFFERENCE = 0x0D,
        /// Reserved.
        RESERVED_0E = 0x0E => "reserved (0x0e)",
        /// As many bytes as there are.
        DOMAIN = 0x0F,
        /// 24 bits, two's complement.
        INTEGER24 = 0x10,
        /// 64 bits of IEEE 754.
        REAL64 = 0x11,
        /// 40 bits, two's complement.
        INTEGER40 = 0x12,
        /// 48 bits, two's complement.
        INTEGER48 = 0x13,
        /// 56 bits, two's complement.
        INTEGER56 = 0x14,
        /// 64 bits, two's complement.
        INTEGER64 = 0x15,
        /// 24 bits.
        UNSIGNED24 = 0x16,
        /// Reserved.
        RESERVED_17 = 0x17 => "reserved (0x17)",
        /// 40 bits.
        UNSIGNED40 = 0x18,
        /// 48 bits.
        UNSIGNED48 = 0x19,
        /// 56 bits.
        UNSIGNED56 = 0x1A,
        /// 64 bits.
        UNSIGNED64 = 0x1B,
        /// Record of PDO communication parameters.
        PDO_COMMUNICATION_PARAMETER = 0x20,
        /// Record of PDO mapping parameters.
        PDO_MAPPING = 0x21,
        /// Record of SDO parameters.
        SDO_PARAMETER = 0x22,
        /// Record of the identity.
        IDENTITY = 0x23,
    }
}

/// What the values of a type are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Whole numbers without sign.
    Unsigned,
    /// Whole numbers.
    Signed,
    /// Floating point numbers.
    Real,
    /// Text.
    Text,
    /// Bytes.
    Bytes,
    /// A record, or nobody knows.
    Other,
}

impl DataType {
    /// Stands for a type that a data sheet does not say.
    pub const MISSING: Self = Self(0);

    /// Bits of a value in a PDO; `None` when its length is its own or nobody knows.
    #[must_use]
    pub const fn bits(self) -> Option<u8> {
        Some(match self {
            Self::BOOLEAN => 1,
            Self::INTEGER8 | Self::UNSIGNED8 => 8,
            Self::INTEGER16 | Self::UNSIGNED16 => 16,
            Self::INTEGER24 | Self::UNSIGNED24 => 24,
            Self::INTEGER32 | Self::UNSIGNED32 | Self::REAL32 => 32,
            Self::INTEGER40 | Self::UNSIGNED40 => 40,
            Self::INTEGER48 | Self::UNSIGNED48 | Self::TIME_OF_DAY | Self::TIME_DIFFERENCE => 48,
            Self::INTEGER56 | Self::UNSIGNED56 => 56,
            Self::INTEGER64 | Self::UNSIGNED64 | Self::REAL64 => 64,
            _ => return None,
        })
    }

    pub(super) const fn shape(self) -> Shape {
        match self {
            Self::BOOLEAN
            | Self::UNSIGNED8
            | Self::UNSIGNED16
            | Self::UNSIGNED24
            | Self::UNSIGNED32
            | Self::UNSIGNED40
            | Self::UNSIGNED48
            | Self::UNSIGNED56
            | Self::UNSIGNED64
            | Self::TIME_OF_DAY
            | Self::TIME_DIFFERENCE => Shape::Unsigned,
            Self::INTEGER8
            | Self::INTEGER16
            | Self::INTEGER24
            | Self::INTEGER32
            | Self::INTEGER40
            | Self::INTEGER48
            | Self::INTEGER56
            | Self::INTEGER64 => Shape::Signed,
            Self::REAL32 | Self::REAL64 => Shape::Real,
            Self::VISIBLE_STRING | Self::UNICODE_STRING => Shape::Text,
            Self::OCTET_STRING | Self::DOMAIN => Shape::Bytes,
            _ => Shape::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_of_cia_301_has_a_name() {
        for code in 1..=0x1B {
            assert!(DataType(code).name().is_some(), "{code:#x}");
        }
        assert_eq!((DataType::MISSING.name(), DataType(0x1C).name()), (None, None));
    }

    #[test]
    fn numbers_have_their_bits() {
        let bits: Vec<(u16, u8)> =
            (0..0x30).filter_map(|code| Some((code, DataType(code).bits()?))).collect();
        #[rustfmt::skip]
        assert_eq!(bits, [
            (1, 1), (2, 8), (3, 16), (4, 32), (5, 8), (6, 16), (7, 32), (8, 32), (0x0C, 48), (0x0D, 48), (0x10, 24),
            (0x11, 64), (0x12, 40), (0x13, 48), (0x14, 56), (0x15, 64), (0x16, 24), (0x18, 40), (0x19, 48), (0x1A, 56),
            (0x1B, 64),
        ]);
        for code in 0..0x30 {
            let of_length = matches!(DataType(code).shape(), Shape::Unsigned | Shape::Signed | Shape::Real);
            assert_eq!(of_length, DataType(code).bits().is_some(), "{code:#x}");
        }
    }
}
