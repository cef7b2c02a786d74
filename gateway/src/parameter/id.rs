//! How people write the number of a parameter in a drive.
//!
//! | drive | written | is |
//! |---|---|---|
//! | SERCOS | `S-0-0100`, `P-0-4000`, `S-0-1300.0.3` | an IDN |
//! | CANopen | `6081h`, `0x6081`, `6081h.0`, `0x60C2.1`, `60C2:01` | an object; behind `:` hexadecimal, behind `.` decimal |
//! | DeviceNet | `1.1.7`, `0x42.1.661` | class, instance, attribute |

use std::fmt;

use profile_sercos::wire::idn::Idn;

use crate::engine::direct::Target;
use crate::mapping::{Attribute, Item, Object};

/// The number of a parameter in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Id {
    /// An IDN of a SERCOS drive.
    Idn(Idn),
    /// An object of a CANopen device.
    Object(Object),
    /// An attribute of a drive on DeviceNet.
    Path {
        /// Class code.
        class: u16,
        /// Instance number; 0 is the class.
        instance: u16,
        /// Number of the attribute.
        attribute: u16,
    },
}

impl Id {
    /// Reads a number; `None` for what is none, so that it can be a name.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        text.parse().ok().map(Self::Idn).or_else(|| object(text).map(Self::Object)).or_else(|| path(text))
    }

    /// Whether a word is meant as a number, although it may not be one: no name begins so.
    #[must_use]
    pub fn is_meant(text: &str) -> bool {
        let idn = ["S-", "s-", "P-", "p-"].iter().any(|start| text.starts_with(start));
        idn || text.starts_with(|first: char| first.is_ascii_digit())
    }

    /// The bus whose drives have such numbers.
    #[must_use]
    pub const fn bus(self) -> &'static str {
        match self {
            Self::Idn(_) => "SERCOS",
            Self::Object(_) => "CANopen",
            Self::Path { .. } => "DeviceNet",
        }
    }

    /// What is accessed for its value.
    #[must_use]
    pub const fn target(self) -> Target {
        match self {
            Self::Idn(idn) => Target::Element(idn, profile_sercos::wire::svc::Element::Data),
            Self::Object(object) => Target::Object(object),
            Self::Path { class, instance, attribute } => Target::Attribute { class, instance, attribute },
        }
    }
}

impl From<Item> for Id {
    fn from(item: Item) -> Self {
        match item {
            Item::Idn(idn) => Self::Idn(idn),
            Item::Object(object) => Self::Object(object),
            // The instance is the axis itself.
            Item::Attribute(Attribute { class, id }) => Self::Path { class, instance: 1, attribute: id },
        }
    }
}

/// As [`Id::parse`] reads it: `S-0-0100`, `60C2:01`, `1.1.7`.
impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Idn(idn) => write!(f, "{idn}"),
            Self::Object(object) => write!(f, "{object}"),
            Self::Path { class, instance, attribute } => write!(f, "{class}.{instance}.{attribute}"),
        }
    }
}

fn object(text: &str) -> Option<Object> {
    let (index, sub) = match text.split_once(':') {
        Some((index, sub)) => (index, u8::from_str_radix(digits(sub, 16)?, 16).ok()?),
        None => match text.split_once('.') {
            Some((index, sub)) => (index, number(sub)?),
            None => (text, 0),
        },
    };
    let bare = index.strip_prefix("0x").or_else(|| index.strip_suffix('h'));
    // Without a mark it is an index only in front of `:`: a bare number could be anything.
    let bare = bare.or_else(|| text.contains(':').then_some(index)).filter(|index| index.len() == 4)?;
    Some(Object { index: u16::from_str_radix(digits(bare, 16)?, 16).ok()?, sub })
}

fn path(text: &str) -> Option<Id> {
    let mut parts = text.split('.');
    let (class, instance, attribute) =
        (number(parts.next()?)?, number(parts.next()?)?, number(parts.next()?)?);
    parts.next().is_none().then_some(Id::Path { class, instance, attribute })
}

/// A number, decimal or with `0x` hexadecimal.
fn number<T: TryFrom<u32>>(text: &str) -> Option<T> {
    let number = match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(digits(hex, 16)?, 16),
        None => digits(text, 10)?.parse(),
    };
    T::try_from(number.ok()?).ok()
}

/// The text, if it is one of digits only: the standard library takes a sign too.
fn digits(text: &str, radix: u32) -> Option<&str> {
    text.chars().all(|digit| digit.is_digit(radix)).then_some(text).filter(|text| !text.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_write_them() {
        let object = |index, sub| Some(Id::Object(Object { index, sub }));
        let path = |class, instance, attribute| Some(Id::Path { class, instance, attribute });
        for (text, id, shown) in [
            ("S-0-0100", Some(Id::Idn(Idn::standard(100))), "S-0-0100"),
            ("s-0-100", Some(Id::Idn(Idn::standard(100))), "S-0-0100"),
            ("P-0-4000", Some(Id::Idn(Idn::product(4000))), "P-0-4000"),
            ("S-0-1300.0.3", Some(Id::Idn(Idn::structured(1300, 0, 3))), "S-0-1300.0.3"),
            ("6081h", object(0x6081, 0), "6081:00"),
            ("0x6081", object(0x6081, 0), "6081:00"),
            ("0x6081.0", object(0x6081, 0), "6081:00"),
            ("0x60C2.1", object(0x60C2, 1), "60C2:01"),
            ("2001h.16", object(0x2001, 16), "2001:10"),
            ("2001:10", object(0x2001, 16), "2001:10"),
            ("0x2001:FF", object(0x2001, 255), "2001:FF"),
            ("1.1.7", path(1, 1, 7), "1.1.7"),
            ("0x42.1.661", path(0x42, 1, 661), "66.1.661"),
        ] {
            assert_eq!(Id::parse(text), id, "{text}");
            assert!(Id::is_meant(text), "{text}");
            assert_eq!(id.unwrap().to_string(), shown);
            assert_eq!(Id::parse(shown), id, "{shown}");
        }
    }

    #[test]
    fn what_could_be_anything_is_no_number() {
        for text in [
            "",
            "notch",
            "6081",
            "6081.0",
            "S-0",
            "S-8-0001",
            "S-0-4096",
            "0x608",
            "0x60811",
            "0x6081.256",
            "0x6081.-1",
            "6081:100",
            "60+1:00",
            "1.1",
            "1.1.1.1",
            "1.1.70000",
            "1.1.+7",
            "1..7",
            ":",
            ".",
            "h",
        ] {
            assert_eq!(Id::parse(text), None, "{text}");
        }
        assert!(["S-0", "6081", "p-9"].iter().all(|text| Id::is_meant(text)));
        assert!(["speed", "p", "position_gain"].iter().all(|text| !Id::is_meant(text)));
    }
}
