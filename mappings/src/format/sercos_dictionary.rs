//! Rows of the SERCOS dictionary.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, Source};

/// `mappings/tables/dictionary/sercos-terms.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosTermFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Documents.
    pub source: Vec<SourceRow>,
    /// Units.
    pub unit: Vec<SercosUnitRow>,
    /// Quantities whose unit the drive's scaling gives.
    pub scaling: Vec<QuantityRow>,
    /// Function groups and drive functions.
    pub group: Vec<GroupRow>,
}

/// A document.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceRow {
    /// The key by which rows name it.
    pub key: Name,
    /// Whom it comes from: documents of one family are one witness.
    pub family: String,
    /// What it is.
    pub title: String,
}

/// A unit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosUnitRow {
    /// The unit as rows name it.
    pub unit: Name,
    /// In words.
    pub meaning: String,
}

/// A quantity whose unit the drive's scaling gives.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuantityRow {
    /// The quantity as rows name it.
    pub scaling: Name,
    /// IDN with the scaling type.
    #[serde(rename = "type")]
    pub scaling_type: Name,
    /// IDNs with factor, exponent, resolution and range.
    pub parameters: Vec<Name>,
}

/// A function group or drive function.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupRow {
    /// The group as rows name it.
    pub group: Name,
    /// Clause of IEC 61800-7-204.
    pub clause: String,
}

/// `mappings/tables/dictionary/sercos-idns.toml` and `sercos-communication.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosIdnFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Parameters and procedure commands.
    pub idn: Vec<IdnRow>,
}

/// One IDN.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdnRow {
    /// The number, as in `S-0-0047` or `S-0-1050.x.6`.
    pub idn: Name,
    /// Its name; absent when only the number is known.
    pub name: Option<String>,
    /// Clause of IEC 61800-7-204.
    pub clause: Option<String>,
    /// Function group or drive function.
    pub group: Option<Name>,
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
    /// Digits behind the decimal point; without them those of `attribute` count.
    pub decimals: Option<Spanned<u8>>,
    /// Communication phases in which it can be written.
    pub write: Option<Spanned<Vec<u8>>>,
    /// Telegrams that can carry it.
    pub cyclic: Option<Spanned<IdnCyclicRow>>,
    /// Element 3 of a live drive.
    pub attribute: Option<Spanned<u32>>,
    /// What one source shows.
    pub range: Option<String>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium`, `low` or `unknown`.
    pub confidence: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// Who says that a telegram can carry an IDN.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdnCyclicRow {
    /// Keys of the documents that have it in the AT.
    pub at: Option<Source>,
    /// Keys of the documents that have it in the MDT.
    pub mdt: Option<Source>,
}

/// `mappings/tables/dictionary/sercos-bits.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosBitFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Words with named fields.
    pub word: Vec<WordRow>,
}

/// A word with named fields.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WordRow {
    /// Name of the word.
    pub name: Name,
    /// IDNs that hold it.
    #[serde(default)]
    pub idns: Vec<Name>,
    /// What holds it beside or instead of an IDN, in words.
    pub element: Option<String>,
    /// `all`, `I/II` or `III`.
    pub layout: Name,
    /// Bits of the word.
    pub width: Spanned<u32>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium` or `low`.
    pub confidence: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Its fields.
    pub fields: Vec<FieldRow>,
    /// Values that several fields have together.
    #[serde(default)]
    pub patterns: Vec<PatternRow>,
}

/// A field of a word.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldRow {
    /// First and last bit.
    pub bits: Option<Spanned<[u32; 2]>>,
    /// First and last bit of each piece, the most significant first.
    pub parts: Option<Spanned<Vec<[u32; 2]>>>,
    /// Name of the field.
    pub name: Option<Name>,
    /// Whether the bits are reserved and have no name.
    #[serde(default)]
    pub reserved: bool,
    /// Set of codes that names the values.
    pub codes: Option<Name>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents; those of the word when absent.
    pub source: Option<Source>,
    /// As for the word.
    pub confidence: Option<Name>,
    /// Named values.
    #[serde(default)]
    pub values: Vec<ValueRow>,
}

/// A named value of a field.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ValueRow {
    /// The value.
    pub value: Spanned<u32>,
    /// Its name.
    pub name: String,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents; those of the field when absent.
    pub source: Option<Source>,
    /// As for the field.
    pub confidence: Option<Name>,
}

/// A value that several fields have together.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatternRow {
    /// First and last bit.
    pub bits: Spanned<[u32; 2]>,
    /// The value of these bits.
    pub value: Spanned<u32>,
    /// Its name.
    pub name: String,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents; those of the word when absent.
    pub source: Option<Source>,
    /// As for the word.
    pub confidence: Option<Name>,
}

/// `mappings/tables/dictionary/sercos-codes.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosCodeFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Sets of codes.
    pub enumeration: Vec<SercosCodesRow>,
}

/// A set of named codes.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosCodesRow {
    /// Name of the set.
    pub name: Name,
    /// IDNs that hold such a code.
    #[serde(default)]
    pub idns: Vec<Name>,
    /// What holds it beside or instead of an IDN, in words.
    pub element: Option<String>,
    /// First and last bit of the code where it is a part of the value.
    pub field: Option<Spanned<[u32; 2]>>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium` or `low`.
    pub confidence: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// The codes.
    pub codes: Vec<SercosCodeRow>,
    /// Codes without a name of their own.
    #[serde(default)]
    pub ranges: Vec<SercosRangeRow>,
}

/// One named code.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosCodeRow {
    /// The code.
    pub code: Spanned<u32>,
    /// Its name.
    pub name: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents; those of the set when absent.
    pub source: Option<Source>,
    /// As for the set.
    pub confidence: Option<Name>,
}

/// Codes without a name of their own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosRangeRow {
    /// The first of them.
    pub from: Spanned<u32>,
    /// The last of them.
    pub to: Spanned<u32>,
    /// `group` or `vendor`.
    pub kind: Name,
    /// What they have in common.
    pub name: String,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents; those of the set when absent.
    pub source: Option<Source>,
    /// As for the set.
    pub confidence: Option<Name>,
}
