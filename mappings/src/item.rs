//! What a drive of any profile keeps: a parameter, a command or a word, by its number there.

use core::fmt;

use profile_sercos::wire::idn::Idn;

/// An object of a CANopen drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl Object {
    /// Reads what the tables write: `607A:00`.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let (index, sub) = text.split_once(':')?;
        let hex = |text: &str, len| text.len() == len && text.bytes().all(|digit| digit.is_ascii_hexdigit());
        if !hex(index, 4) || !hex(sub, 2) {
            return None;
        }
        Some(Self { index: u16::from_str_radix(index, 16).ok()?, sub: u8::from_str_radix(sub, 16).ok()? })
    }
}

/// As the tables write it: `607A:00`.
impl fmt::Display for Object {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index, self.sub)
    }
}

/// An attribute of instance 1 of an object of a drive on DeviceNet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Attribute {
    /// Class code.
    pub class: u16,
    /// Number of the attribute.
    pub id: u16,
}

/// `class 0x42 attribute 661`.
impl fmt::Display for Attribute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "class {:#04x} attribute {}", self.class, self.id)
    }
}

/// The number of something that a drive keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Item {
    /// An IDN of a SERCOS drive.
    Idn(Idn),
    /// An object of a CANopen drive.
    Object(Object),
    /// An attribute of a drive on DeviceNet.
    Attribute(Attribute),
}

impl Item {
    /// An object of a CANopen drive.
    #[must_use]
    pub const fn object(index: u16, sub: u8) -> Self {
        Self::Object(Object { index, sub })
    }

    /// An attribute of a drive on DeviceNet.
    #[must_use]
    pub const fn attribute(class: u16, id: u16) -> Self {
        Self::Attribute(Attribute { class, id })
    }

    /// The IDN, where it is one.
    #[must_use]
    pub const fn idn(self) -> Option<Idn> {
        match self {
            Self::Idn(idn) => Some(idn),
            Self::Object(_) | Self::Attribute(_) => None,
        }
    }
}

impl From<Idn> for Item {
    fn from(idn: Idn) -> Self {
        Self::Idn(idn)
    }
}

/// As the tables write it: `S-0-0047`, `607A:00`.
impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Idn(idn) => write!(f, "{idn}"),
            Self::Object(object) => write!(f, "{object}"),
            Self::Attribute(attribute) => write!(f, "{attribute}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_print_as_the_tables_write_them() {
        let texts = [Item::from(Idn::standard(47)), Item::object(0x607A, 0), Item::object(0x60C2, 1)];
        assert_eq!(texts.map(|item| item.to_string()), ["S-0-0047", "607A:00", "60C2:01"]);
        assert_eq!(texts.map(Item::idn), [Some(Idn::standard(47)), None, None]);
    }
}
