//! Rows of the dictionaries.

use serde::Deserialize;
use toml::Spanned;

use super::{Name, Source};

/// `mappings/dictionary/generic.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GenericFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `generic`.
    pub profile: Name,
    /// Values of the process image.
    pub signal: Vec<SignalRow>,
    /// Parameters outside the process image.
    pub parameter: Vec<ParameterRow>,
}

/// A signal of the generic model.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalRow {
    /// Name in snake case.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// `command` or `feedback`.
    pub access: Name,
}

/// A parameter of the generic model.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRow {
    /// Name in snake case.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// `integer`, `float` or `text`.
    #[serde(rename = "type")]
    pub data_type: Name,
    /// `read`, `write` or `write_while_disabled`.
    pub access: Name,
}

/// A set of named codes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnumerationRow {
    /// Name of the set.
    pub name: Name,
    /// Where it comes from.
    pub source: Source,
    /// The codes.
    pub codes: Vec<CodeRow>,
}

/// One named code.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CodeRow {
    /// The code.
    pub code: Spanned<u32>,
    /// Its name.
    pub name: Name,
}

/// `mappings/dictionary/sercos.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Parameters and procedure commands.
    pub idn: Vec<IdnRow>,
    /// Words with named fields.
    pub word: Vec<WordRow>,
    /// Enumerated codes.
    pub enumeration: Vec<EnumerationRow>,
}

/// One IDN.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdnRow {
    /// The number, as in `S-0-0047`.
    pub idn: Name,
    /// Its name.
    pub name: Name,
    /// Bytes of the value or of one list item; absent when only the drive knows.
    pub length: Option<Spanned<u8>>,
    /// Whether it is a list.
    #[serde(default)]
    pub list: bool,
    /// Display format.
    pub format: Option<Name>,
    /// Whether it is a procedure command.
    #[serde(default)]
    pub command: bool,
    /// Quantity whose scaling parameters give the unit.
    pub scaling: Option<Name>,
    /// Fixed unit.
    pub unit: Option<Name>,
    /// Digits behind the decimal point of a fixed unit.
    #[serde(default)]
    pub decimals: u8,
    /// Communication phases in which it can be written.
    pub write: Option<Vec<u8>>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium`, `low` or `none`.
    pub confidence: Name,
}

/// A word with named fields.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordRow {
    /// Name of the word.
    pub name: Name,
    /// IDN that holds it.
    pub idn: Name,
    /// Where it comes from.
    pub source: Source,
    /// Its fields.
    pub fields: Vec<FieldRow>,
}

/// A named field of a word.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldRow {
    /// First and last bit.
    pub bits: Spanned<[u32; 2]>,
    /// Name of the field.
    pub name: Name,
}
