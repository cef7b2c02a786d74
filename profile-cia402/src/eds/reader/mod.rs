//! From the bytes of a file to a description.

mod checks;
mod head;
mod objects;

use super::description::DeviceDescription;
use super::diagnostic::{Diagnostics, Kind, Place};
use super::ini::{self, Document, Entry, Refused, Section};
use super::number;

/// A description, and what was odd about the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reading {
    /// What the file says.
    pub description: DeviceDescription,
    /// What is odd about it, by lines.
    pub diagnostics: Diagnostics,
}

/// Reads a data sheet or a configuration.
///
/// # Errors
/// [`Refused`]: the file is too long to be one, or not text.
pub fn read(bytes: &[u8]) -> Result<Reading, Refused> {
    let mut diagnostics = Diagnostics::default();
    let text = ini::text(bytes, &mut diagnostics)?;
    let document = ini::parse(&text, &mut diagnostics)?;
    let mut reader = Reader { document: &document, diagnostics, expanded: 0 };
    let mut description = reader.head();
    description.objects = reader.objects(&description);
    reader.checks(&mut description);
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort();
    Ok(Reading { description, diagnostics })
}

/// What a section is, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SectionKind {
    /// An object.
    Object(u16),
    /// A sub-object.
    Sub(u16, u8),
    /// Names of the sub-objects of a compact object.
    Names(u16),
    /// Values of the sub-objects of a compact object.
    Values(u16),
    /// Further names of the sub-objects of a compact object, which are not read.
    Denotations(u16),
    /// Of a module.
    Module(u16),
    /// Another one that CiA 306 has.
    Known,
    /// Nobody knows.
    Unknown,
}

/// Sections that have neither the number of an object nor of a module.
const KNOWN: &[&str] = &[
    "FileInfo",
    "DeviceInfo",
    "DeviceComissioning",
    "DeviceCommissioning",
    "DummyUsage",
    "Comments",
    "MandatoryObjects",
    "OptionalObjects",
    "ManufacturerObjects",
    "SupportedModules",
    "ConnectedModules",
    "DynamicChannels",
    "Tools",
];

impl SectionKind {
    fn of(name: &str) -> Self {
        if KNOWN.iter().any(|known| name.eq_ignore_ascii_case(known)) {
            return Self::Known;
        }
        let lower = name.to_ascii_lowercase();
        if let Some(index) = lower.get(..4).and_then(hexadecimal) {
            let index = u16::try_from(index).unwrap_or_default();
            let behind = lower.get(4..).unwrap_or_default();
            return match behind {
                "" => Self::Object(index),
                "name" => Self::Names(index),
                "value" => Self::Values(index),
                "denotation" => Self::Denotations(index),
                // Links to descriptions.
                "objectlinks" => Self::Known,
                _ => match behind.strip_prefix("sub").and_then(hexadecimal).map(u8::try_from) {
                    Some(Ok(sub)) => Self::Sub(index, sub),
                    _ => Self::Unknown,
                },
            };
        }
        if lower.strip_prefix("tool").is_some_and(|number| number.parse::<u16>().is_ok()) {
            return Self::Known;
        }
        let module = lower.strip_prefix('m').map(|rest| rest.split_at(digits(rest)));
        match module.map(|(number, behind)| (number.parse(), behind)) {
            Some((Ok(number), behind)) if !behind.is_empty() => Self::Module(number),
            _ => Self::Unknown,
        }
    }
}

/// How many digits a text begins with.
fn digits(text: &str) -> usize {
    text.bytes().take_while(u8::is_ascii_digit).count()
}

/// Up to four hexadecimal digits and nothing else.
fn hexadecimal(text: &str) -> Option<u32> {
    let plausible = (1..=4).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if plausible { u32::from_str_radix(text, 16).ok() } else { None }
}

/// Takes a document apart and notes what is odd.
struct Reader<'d, 't> {
    document: &'d Document<'t>,
    diagnostics: Diagnostics,
    /// Bytes of what compact sections stood for.
    expanded: usize,
}

impl<'d, 't> Reader<'d, 't> {
    /// The text behind a key; empty when it is not there.
    fn text(&self, section: usize, key: &str) -> &'t str {
        self.document.entry(section, key).map_or("", |entry| entry.value)
    }

    /// A whole number without sign; `None` when it is not there, empty or none.
    fn number<T: TryFrom<i128>>(&mut self, section: usize, key: &str) -> Option<T> {
        let entry = self.document.entry(section, key).filter(|entry| !entry.value.is_empty())?;
        let place = self.document.sections.get(section)?.value_place(entry);
        self.number_of(place, entry.value)
    }

    /// The number that a text is.
    fn number_of<T: TryFrom<i128>>(&mut self, place: Place<'_>, text: &str) -> Option<T> {
        match number::plain(text) {
            Ok((value, _)) => {
                let fits = T::try_from(value).ok();
                if fits.is_none() {
                    let bits = core::mem::size_of::<T>() * 8;
                    self.diagnostics.push(Kind::Range, place, format!("a number of {bits} bits"), text);
                }
                fits
            }
            Err(_) => {
                self.diagnostics.push(Kind::Number, place, number::EXPECTED, text);
                None
            }
        }
    }

    /// Whether a key is there and not 0.
    fn flag(&mut self, section: usize, key: &str) -> bool {
        self.number::<u32>(section, key).is_some_and(|value| value != 0)
    }

    /// The entries of a section whose keys are numbers, with these.
    fn numbered(&self, section: &'d Section<'t>) -> impl Iterator<Item = (u32, &'d Entry<'t>)> + 'd {
        // Keys count in decimal, whatever zeros they begin with.
        section.entries.iter().filter_map(|entry| Some((entry.key.parse().ok()?, entry)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_known_by_their_names() {
        for (name, kind) in [
            ("1000", SectionKind::Object(0x1000)),
            ("1a0F", SectionKind::Object(0x1A0F)),
            ("1018sub1", SectionKind::Sub(0x1018, 1)),
            ("1018SUB0a", SectionKind::Sub(0x1018, 10)),
            ("1018subFE", SectionKind::Sub(0x1018, 0xFE)),
            ("1018sub100", SectionKind::Unknown),
            ("1018sub", SectionKind::Unknown),
            ("1018x", SectionKind::Unknown),
            ("1003Name", SectionKind::Names(0x1003)),
            ("1003VALUE", SectionKind::Values(0x1003)),
            ("1003Denotation", SectionKind::Denotations(0x1003)),
            ("6000ObjectLinks", SectionKind::Known),
            ("M1ModuleInfo", SectionKind::Module(1)),
            ("m12SubExt6000", SectionKind::Module(12)),
            ("M1", SectionKind::Unknown),
            ("M", SectionKind::Unknown),
            ("M99999ModuleInfo", SectionKind::Unknown),
            ("Tool1", SectionKind::Known),
            ("Toolbox", SectionKind::Unknown),
            ("fileinfo", SectionKind::Known),
            ("DeviceComissioning", SectionKind::Known),
            ("DeviceCommissioning", SectionKind::Known),
            ("100", SectionKind::Unknown),
            ("+100", SectionKind::Unknown),
            ("äöü", SectionKind::Unknown),
            ("10äö", SectionKind::Unknown),
        ] {
            assert_eq!(SectionKind::of(name), kind, "{name}");
        }
    }
}
