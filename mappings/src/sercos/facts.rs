//! What a drive has reported about itself over its service channel.

use core::fmt;
use std::collections::BTreeMap;

use profile_generic::program::Width;
use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
use profile_sercos::wire::idn::Idn;

use crate::dictionary::{IdnFormat, IdnUnit, SercosDictionary};

/// What a drive has said about itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DriveFacts {
    facts: BTreeMap<Idn, Fact>,
    fixed_connections: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Fact {
    attribute: Option<Attribute>,
    unit: Option<String>,
    /// Elements 5 and 6.
    limits: [Option<Vec<u8>>; 2],
    data: Option<Vec<u8>>,
    missing: bool,
    /// The drive has refused what was written to it last.
    refused: bool,
    /// The drive has not given element 7, though it has the IDN.
    unread: bool,
}

/// Something that a drive says of an IDN and the dictionary says otherwise. The drive is followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The IDN.
    pub idn: Idn,
    /// Its name in the dictionary.
    pub name: String,
    /// What differs.
    pub what: &'static str,
    /// By the dictionary.
    pub expected: String,
    /// By the drive.
    pub found: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { idn, name, what, expected, found } = self;
        write!(f, "{idn} ({name}): expected {what} {expected} by the dictionary, found {found} in the drive")
    }
}

impl DriveFacts {
    /// Nothing known.
    pub fn new() -> Self {
        Self::default()
    }

    /// What the drive's communication classes say: it is one of SCP_FixCFG, whose connections cannot be configured.
    pub fn note_fixed_connections(&mut self, fixed: bool) {
        self.fixed_connections = fixed;
    }

    /// Whether the connections of the drive cannot be configured.
    pub fn has_fixed_connections(&self) -> bool {
        self.fixed_connections
    }

    /// The drive has given element 3 of an IDN.
    pub fn note_attribute(&mut self, idn: Idn, attribute: Attribute) {
        self.facts.entry(idn).or_default().attribute = Some(attribute);
    }

    /// The drive has given element 4 of an IDN. Letters beyond ASCII come in one byte, as in ISO 8859-1.
    pub fn note_unit(&mut self, idn: Idn, text: &[u8]) {
        let text: String = text.iter().map(|byte| char::from(*byte)).collect();
        let unit = text.trim_matches(|letter: char| letter.is_whitespace() || letter == '\0').to_owned();
        self.facts.entry(idn).or_default().unit = Some(unit);
    }

    /// The drive has given element 5 (minimum) or 6 of an IDN.
    pub fn note_limit(&mut self, idn: Idn, maximum: bool, data: &[u8]) {
        self.facts.entry(idn).or_default().limits[usize::from(maximum)] = Some(data.to_vec());
    }

    /// The drive has given element 7 of an IDN, or has taken these bytes for it.
    pub fn note_data(&mut self, idn: Idn, data: &[u8]) {
        let fact = self.facts.entry(idn).or_default();
        fact.data = Some(data.to_vec());
        fact.refused = false;
    }

    /// The drive has refused what was written to an IDN.
    pub fn note_refused(&mut self, idn: Idn) {
        self.facts.entry(idn).or_default().refused = true;
    }

    /// Whether the drive has refused what was written to an IDN last.
    pub fn is_refused(&self, idn: Idn) -> bool {
        self.facts.get(&idn).is_some_and(|fact| fact.refused)
    }

    /// The drive has not given element 7 of an IDN.
    pub fn note_unread(&mut self, idn: Idn) {
        self.facts.entry(idn).or_default().unread = true;
    }

    /// Whether the drive was asked for element 7 of an IDN, whatever it has said.
    pub fn is_told(&self, idn: Idn) -> bool {
        self.facts.get(&idn).is_some_and(|fact| fact.data.is_some() || fact.missing || fact.unread)
    }

    /// Element 7 of a list, or of a value, as words of two bytes, if the drive has given it.
    pub fn words(&self, idn: Idn) -> Option<Vec<u16>> {
        let data = self.data(idn)?;
        Some(data.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect())
    }

    /// The drive has no such IDN.
    pub fn note_missing(&mut self, idn: Idn) {
        self.facts.entry(idn).or_default().missing = true;
    }

    /// Whether the drive has said that it has no such IDN.
    pub fn is_missing(&self, idn: Idn) -> bool {
        self.facts.get(&idn).is_some_and(|fact| fact.missing)
    }

    /// Element 3, if the drive has given it.
    pub fn attribute(&self, idn: Idn) -> Option<Attribute> {
        self.facts.get(&idn)?.attribute
    }

    /// Element 4, if the drive has given one.
    pub fn unit(&self, idn: Idn) -> Option<&str> {
        self.facts.get(&idn)?.unit.as_deref().filter(|unit| !unit.is_empty())
    }

    /// Elements 5 and 6 as numbers, if the drive has given both and there is room between them.
    pub fn limits(&self, idn: Idn, dictionary: &SercosDictionary) -> Option<(i64, i64)> {
        let [minimum, maximum] = &self.facts.get(&idn)?.limits;
        let signed = self.is_signed(idn, dictionary);
        let limits = (number(minimum.as_deref()?, signed)?, number(maximum.as_deref()?, signed)?);
        (limits.0 < limits.1).then_some(limits)
    }

    /// Element 7 as bytes, if the drive has given it.
    pub fn data(&self, idn: Idn) -> Option<&[u8]> {
        self.facts.get(&idn)?.data.as_deref()
    }

    /// Element 7 as a whole number, signed or not as the drive or the dictionary says.
    pub fn number(&self, idn: Idn, dictionary: &SercosDictionary) -> Option<i64> {
        let float = |attribute: Attribute| attribute.format() == Format::Float;
        if self.attribute(idn).is_some_and(float) {
            return None;
        }
        number(self.data(idn)?, self.is_signed(idn, dictionary))
    }

    fn is_signed(&self, idn: Idn, dictionary: &SercosDictionary) -> bool {
        match self.attribute(idn) {
            Some(attribute) => attribute.format() == Format::Signed,
            None => dictionary.idn(idn).is_some_and(|row| row.format == Some(IdnFormat::Signed)),
        }
    }

    /// How the value of an IDN lies in a telegram; the drive's word counts more than the dictionary's.
    /// `None` for lists and when nobody knows the length.
    pub fn width(&self, idn: Idn, dictionary: &SercosDictionary) -> Option<Width> {
        let row = dictionary.idn(idn);
        let length = match self.attribute(idn) {
            Some(attribute) if attribute.is_list() => return None,
            Some(attribute) => match attribute.item_length() {
                ItemLength::One => 1,
                ItemLength::Two => 2,
                ItemLength::Four => 4,
                ItemLength::Eight => 8,
            },
            None => row.filter(|row| !row.list)?.length?,
        };
        let is_float = match self.attribute(idn) {
            Some(attribute) => attribute.format() == Format::Float,
            None => row.is_some_and(|row| row.format == Some(IdnFormat::Float)),
        };
        if is_float {
            return match length {
                4 => Some(Width::F32),
                8 => Some(Width::F64),
                _ => None,
            };
        }
        Some(match (length, self.is_signed(idn, dictionary)) {
            (1, false) => Width::U8,
            (1, true) => Width::I8,
            (2, false) => Width::U16,
            (2, true) => Width::I16,
            (4, false) => Width::U32,
            (4, true) => Width::I32,
            (8, false) => Width::U64,
            (8, true) => Width::I64,
            _ => return None,
        })
    }

    /// Where what the drive has reported of its IDNs is not what the dictionary says, by number. What the dictionary does not
    /// know cannot differ.
    pub fn differences(&self, dictionary: &SercosDictionary) -> Vec<Difference> {
        let mut differences = Vec::new();
        for (idn, fact) in &self.facts {
            let (Some(attribute), Some(row)) = (fact.attribute, dictionary.idn(*idn)) else { continue };
            let mut differ = |what, expected: String, found: String| {
                let name = row.name.clone();
                differences.push(Difference { idn: *idn, name, what, expected, found });
            };
            let length = attribute.item_length().bytes();
            if let Some(expected) = row.length_on_sercos_3().filter(|expected| *expected != length) {
                differ("length", expected.to_string(), length.to_string());
            }
            if row.length.is_some() && row.list != attribute.is_list() {
                let word = |list| if list { "a list" } else { "a value" };
                differ("shape", word(row.list).to_owned(), word(attribute.is_list()).to_owned());
            }
            if row.command != attribute.is_command() {
                let word = |command| if command { "a procedure command" } else { "a parameter" };
                differ("use", word(row.command).to_owned(), word(attribute.is_command()).to_owned());
            }
            // Only a sign, or another kind of number, changes what the bytes mean.
            let meaning = |format| match format {
                Format::Signed => 1,
                Format::Text => 2,
                Format::Float => 3,
                _ => 0,
            };
            let wanted = row.format.map(IdnFormat::of_attribute);
            if let Some(wanted) = wanted.filter(|wanted| meaning(*wanted) != meaning(attribute.format())) {
                differ("format", wanted.name().to_owned(), attribute.format().name().to_owned());
            }
            if let IdnUnit::Fixed { unit, decimals } = &row.unit {
                if *decimals != attribute.decimals() {
                    differ(
                        "digits behind the decimal point",
                        decimals.to_string(),
                        attribute.decimals().to_string(),
                    );
                }
                if let Some(found) = self.unit(*idn).filter(|found| !found.eq_ignore_ascii_case(unit)) {
                    differ("unit", unit.clone(), found.to_owned());
                }
            }
        }
        differences
    }
}

/// The bytes of a value as a number; `None` when there are more than eight.
fn number(data: &[u8], signed: bool) -> Option<i64> {
    let fill = if signed && data.last().is_some_and(|byte| byte & 0x80 != 0) { 0xFF } else { 0 };
    let mut bytes = [fill; 8];
    bytes.get_mut(..data.len())?.copy_from_slice(data);
    Some(i64::from_le_bytes(bytes))
}
