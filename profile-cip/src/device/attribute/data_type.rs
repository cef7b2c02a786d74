//! CIP data types of attributes.

/// CIP data type of an attribute element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataType {
    /// One octet, 0 or 1.
    Bool,
    /// Signed 8 bits.
    Sint,
    /// Signed 16 bits.
    Int,
    /// Signed 32 bits.
    Dint,
    /// Signed 64 bits.
    Lint,
    /// Unsigned 8 bits.
    Usint,
    /// Unsigned 16 bits.
    Uint,
    /// Unsigned 32 bits.
    Udint,
    /// Unsigned 64 bits.
    Ulint,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// Floating point, 32 bits.
    Real,
    /// Floating point, 64 bits.
    Lreal,
    /// One length octet and at most [`SHORT_STRING_MAX`] characters.
    ShortString,
}

/// Most characters of a SHORT_STRING that a device keeps.
pub const SHORT_STRING_MAX: u8 = 32;

impl DataType {
    const NAMES: [(&'static str, Self); 16] = [
        ("BOOL", Self::Bool),
        ("SINT", Self::Sint),
        ("INT", Self::Int),
        ("DINT", Self::Dint),
        ("LINT", Self::Lint),
        ("USINT", Self::Usint),
        ("UINT", Self::Uint),
        ("UDINT", Self::Udint),
        ("ULINT", Self::Ulint),
        ("BYTE", Self::Byte),
        ("WORD", Self::Word),
        ("DWORD", Self::Dword),
        ("LWORD", Self::Lword),
        ("REAL", Self::Real),
        ("LREAL", Self::Lreal),
        ("SHORT_STRING", Self::ShortString),
    ];

    /// The type with this name of the standard, for example `UDINT`.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(known, _)| *known == name).map(|(_, data_type)| *data_type)
    }

    /// Octets of one element; of a string the most there can be.
    #[must_use]
    pub const fn size(self) -> u8 {
        match self {
            Self::Bool | Self::Sint | Self::Usint | Self::Byte => 1,
            Self::Int | Self::Uint | Self::Word => 2,
            Self::Dint | Self::Udint | Self::Dword | Self::Real => 4,
            Self::Lint | Self::Ulint | Self::Lword | Self::Lreal => 8,
            Self::ShortString => 1 + SHORT_STRING_MAX,
        }
    }

    /// The octets of one element as 64 bits without sign; `None` for a string or too few octets.
    pub(super) fn raw(self, element: &[u8]) -> Option<u64> {
        let mut octets = [0; 8];
        let size = usize::from(self.size());
        octets.get_mut(..size)?.copy_from_slice(element.get(..size)?);
        Some(u64::from_le_bytes(octets))
    }

    /// One element as a number, for range checks. Integers beyond 53 bits are rounded; a string is none.
    #[must_use]
    pub fn to_f64(self, element: &[u8]) -> Option<f64> {
        let raw = self.raw(element)?;
        let shift = 64 - 8 * u32::from(self.size());
        Some(match self {
            Self::Real => f64::from(f32::from_bits(u32::try_from(raw).ok()?)),
            Self::Lreal => f64::from_bits(raw),
            Self::Sint | Self::Int | Self::Dint | Self::Lint => {
                i64_to_f64((raw << shift).cast_signed() >> shift)
            }
            _ => u64_to_f64(raw),
        })
    }
}

#[expect(clippy::cast_precision_loss, reason = "only compared with range limits, which are f64 themselves")]
fn i64_to_f64(value: i64) -> f64 {
    value as f64
}

#[expect(clippy::cast_precision_loss, reason = "only compared with range limits, which are f64 themselves")]
fn u64_to_f64(value: u64) -> f64 {
    value as f64
}
