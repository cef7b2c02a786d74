//! What a SERCOS drive has: IDNs, words and operation modes.

use profile_sercos::wire::attribute::Format;
use profile_sercos::wire::idn::Idn;

use super::{Enumeration, named_code, resolve_codes};
use crate::mapping::format::{IdnRow, Name, SercosFile};
use crate::mapping::load::{Parsed, TableErrors};
use crate::mapping::resolver::Resolver;

/// How the value of an IDN is displayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IdnFormat {
    /// Bits.
    Binary,
    /// Unsigned.
    Unsigned,
    /// Signed.
    Signed,
    /// Hexadecimal.
    Hexadecimal,
    /// Text.
    Text,
    /// IDNs.
    Idn,
}

impl IdnFormat {
    /// Every format with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("binary", Self::Binary),
        ("unsigned", Self::Unsigned),
        ("signed", Self::Signed),
        ("hexadecimal", Self::Hexadecimal),
        ("text", Self::Text),
        ("idn", Self::Idn),
    ];

    /// The format of element 3 that it stands for.
    pub fn of_attribute(self) -> Format {
        match self {
            Self::Binary => Format::Binary,
            Self::Unsigned => Format::Unsigned,
            Self::Signed => Format::Signed,
            Self::Hexadecimal => Format::Hexadecimal,
            Self::Text => Format::Text,
            Self::Idn => Format::Idn,
        }
    }

    /// The word in the files.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// What one unit in the last place of an IDN is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IdnUnit {
    /// No unit.
    None,
    /// 10^-decimals of a fixed unit.
    Fixed {
        /// The unit.
        unit: String,
        /// Digits behind the decimal point.
        decimals: u8,
    },
    /// What the drive's scaling parameters for this quantity say.
    Scaled(String),
}

/// One IDN.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SercosIdn {
    /// The number.
    pub idn: Idn,
    /// Its name.
    pub name: String,
    /// Bytes of the value or of a list item; `None` when only the drive knows.
    pub length: Option<u8>,
    /// Whether it is a list.
    pub list: bool,
    /// Display format.
    pub format: Option<IdnFormat>,
    /// Whether it is a procedure command.
    pub command: bool,
    /// Unit.
    pub unit: IdnUnit,
    /// Communication phases in which it can be written; `None` when not known.
    pub write: Option<Vec<u8>>,
    /// Keys of the documents it was read in.
    pub source: String,
    /// How far to trust it: `high`, `medium`, `low` or `none`.
    pub confidence: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// A word with named fields.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Name of the word.
    pub name: String,
    /// IDN that holds it.
    pub idn: Idn,
    /// Fields: name, first bit, last bit.
    pub fields: Vec<(String, u32, u32)>,
    /// Where it comes from.
    pub source: String,
}

impl Word {
    /// First and last bit of the field with this name.
    pub fn field(&self, name: &str) -> Option<(u32, u32)> {
        self.fields.iter().find(|(known, _, _)| known == name).map(|(_, low, high)| (*low, *high))
    }

    /// The names of all fields.
    pub fn field_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.fields.iter().map(|(name, _, _)| name.as_str())
    }
}

/// What a SERCOS drive has.
#[derive(Debug, Clone, Default)]
pub struct SercosDictionary {
    idns: Vec<SercosIdn>,
    words: Vec<Word>,
    enumerations: Vec<Enumeration>,
}

impl SercosDictionary {
    pub(super) fn resolve(file: &Parsed<SercosFile>, errors: &mut TableErrors) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "sercos");
        let mut idns: Vec<SercosIdn> = Vec::with_capacity(rows.idn.len());
        for row in &rows.idn {
            if let Some(idn) = resolve_idn(row, &mut resolver) {
                if idns.iter().any(|known| known.idn == idn.idn) {
                    resolver.error(row.idn.span(), "idn", format!("{} is there twice", idn.idn));
                }
                idns.push(idn);
            }
        }
        idns.sort_by_key(|row| row.idn);
        let mut dictionary = Self {
            idns,
            words: Vec::new(),
            enumerations: rows.enumeration.iter().map(|row| resolve_codes(row, &mut resolver)).collect(),
        };
        for row in &rows.word {
            let Some(idn) = dictionary.idn_or_error("idn", &row.idn, &mut resolver).map(|row| row.idn) else {
                continue;
            };
            let mut fields: Vec<(String, u32, u32)> = Vec::with_capacity(row.fields.len());
            for field in &row.fields {
                let [low, high] = *field.bits.get_ref();
                if low > high || high > 31 {
                    let message = format!("expected first and last bit up to 31, got [{low}, {high}]");
                    resolver.error(field.bits.span(), "bits", message);
                    continue;
                }
                if fields.iter().any(|(_, other_low, other_high)| low <= *other_high && *other_low <= high) {
                    resolver.error(field.bits.span(), "bits", "the field overlaps another one");
                }
                fields.push((field.name.get_ref().clone(), low, high));
            }
            let (name, source) = (row.name.get_ref().clone(), row.source.get_ref().clone());
            dictionary.words.push(Word { name, idn, fields, source });
        }
        dictionary
    }

    /// All IDNs, by number.
    pub fn idns(&self) -> &[SercosIdn] {
        &self.idns
    }

    /// The row of an IDN.
    pub fn idn(&self, idn: Idn) -> Option<&SercosIdn> {
        let at = self.idns.binary_search_by_key(&idn, |row| row.idn).ok()?;
        self.idns.get(at)
    }

    /// The word with this name.
    pub fn word(&self, name: &str) -> Option<&Word> {
        self.words.iter().find(|word| word.name == name)
    }

    /// The word that this IDN holds.
    pub fn word_of(&self, idn: Idn) -> Option<&Word> {
        self.words.iter().find(|word| word.idn == idn)
    }

    /// All words.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// All sets of named codes.
    pub fn enumerations(&self) -> &[Enumeration] {
        &self.enumerations
    }

    /// The set of named codes with this name.
    pub fn enumeration(&self, name: &str) -> Option<&Enumeration> {
        self.enumerations.iter().find(|set| set.name == name)
    }

    /// The IDN that `key` names in a mapping.
    pub(in crate::mapping) fn idn_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&SercosIdn> {
        let idn = parse_idn(key, name, resolver)?;
        let row = self.idn(idn);
        if row.is_none() {
            resolver.error(name.span(), key, format!("expected an IDN of the dictionary, got {idn}"));
        }
        row
    }

    /// The code that `key` names in a mapping, from the enumeration `set`.
    pub(in crate::mapping) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.enumeration(set), set, key, name, resolver)
    }
}

fn parse_idn(key: &str, name: &Name, resolver: &mut Resolver<'_>) -> Option<Idn> {
    match name.get_ref().parse() {
        Ok(idn) => Some(idn),
        Err(error) => {
            resolver.error(name.span(), key, format!("expected an IDN, got `{}`: {error}", name.get_ref()));
            None
        }
    }
}

fn resolve_idn(row: &IdnRow, resolver: &mut Resolver<'_>) -> Option<SercosIdn> {
    const CONFIDENCES: [(&str, ()); 4] = [("high", ()), ("medium", ()), ("low", ()), ("none", ())];
    let idn = parse_idn("idn", &row.idn, resolver)?;
    let format = match &row.format {
        Some(name) => Some(resolver.word("format", name, IdnFormat::NAMED)?),
        None => None,
    };
    resolver.word("confidence", &row.confidence, &CONFIDENCES)?;
    if let Some(length) = &row.length
        && ![1, 2, 4, 8].contains(length.get_ref())
    {
        resolver.error(length.span(), "length", format!("expected 1, 2, 4 or 8, got {}", length.get_ref()));
        return None;
    }
    let unit = match (&row.scaling, &row.unit) {
        (Some(scaling), None) => IdnUnit::Scaled(scaling.get_ref().clone()),
        (None, Some(unit)) => IdnUnit::Fixed { unit: unit.get_ref().clone(), decimals: row.decimals },
        (None, None) => IdnUnit::None,
        (Some(_), Some(unit)) => {
            resolver.error(unit.span(), "unit", "expected `scaling` or `unit`, got both");
            return None;
        }
    };
    Some(SercosIdn {
        idn,
        name: row.name.get_ref().clone(),
        length: row.length.as_ref().map(|length| *length.get_ref()),
        list: row.list,
        format,
        command: row.command,
        unit,
        write: row.write.clone(),
        source: row.source.get_ref().clone(),
        confidence: row.confidence.get_ref().clone(),
        note: row.note.clone().unwrap_or_default(),
    })
}
