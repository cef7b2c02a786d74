//! Rows of the CiA 402 dictionary.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, Source, SourceRow};

/// `mappings/tables/dictionary/cia402-objects.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ObjectFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cia402`.
    pub profile: Name,
    /// Documents.
    pub source: Vec<SourceRow>,
    /// Units.
    pub unit: Vec<Cia402UnitRow>,
    /// Objects.
    pub object: Vec<Cia402ObjectRow>,
}

/// A unit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402UnitRow {
    /// The unit as rows name it.
    pub unit: Name,
    /// In words.
    pub meaning: String,
}

/// An object, or several with numbers one behind the other.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ObjectRow {
    /// The number, or the first one.
    pub index: Spanned<u16>,
    /// The last number.
    pub to: Option<Spanned<u16>>,
    /// Its name; empty when only the number is known.
    pub name: String,
    /// `var` when absent, `array` or `record`.
    pub kind: Option<Name>,
    /// Data type of the value or of every sub-object.
    #[serde(rename = "type")]
    pub data_type: Option<Name>,
    /// `ro`, `rw`, `wo` or `const`.
    pub access: Option<Name>,
    /// `no`, `rx`, `tx` or `both`.
    pub pdo: Option<Name>,
    /// Unit.
    pub unit: Option<Name>,
    /// Value after a reset.
    pub default: Option<Spanned<i64>>,
    /// Whether the node-ID is added to the default.
    #[serde(default)]
    pub plus_node: bool,
    /// `mandatory`, `optional` or `conditional`.
    pub category: Option<Name>,
    /// Modes of operation.
    #[serde(default)]
    pub modes: Vec<Name>,
    /// Sub-objects.
    #[serde(default)]
    pub subs: Vec<Cia402SubRow>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium`, `low` or `unknown`.
    pub confidence: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// A sub-object, or several with numbers one behind the other. What it does not say it has from its object.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402SubRow {
    /// The sub-index, or the first one.
    pub sub: Spanned<u8>,
    /// The last sub-index.
    pub to: Option<Spanned<u8>>,
    /// Its name.
    pub name: String,
    /// Data type.
    #[serde(rename = "type")]
    pub data_type: Option<Name>,
    /// `ro`, `rw`, `wo` or `const`.
    pub access: Option<Name>,
    /// `no`, `rx`, `tx` or `both`.
    pub pdo: Option<Name>,
    /// Unit.
    pub unit: Option<Name>,
    /// Value after a reset.
    pub default: Option<Spanned<i64>>,
    /// Whether the node-ID is added to the default.
    #[serde(default)]
    pub plus_node: bool,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// `mappings/tables/dictionary/cia402-codes.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402CodeFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cia402`.
    pub profile: Name,
    /// Sets of codes, bits and states.
    pub enumeration: Vec<Cia402SetRow>,
}

/// A set of named codes, bits or states.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402SetRow {
    /// Name of the set.
    pub name: Name,
    /// `codes` when absent, `bits` or `states`.
    pub kind: Option<Name>,
    /// Numbers of the objects that hold such a value.
    #[serde(default)]
    pub objects: Vec<Spanned<u16>>,
    /// What holds it beside or instead of an object, in words.
    pub element: Option<String>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium` or `low`.
    pub confidence: Name,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// The codes, bits or states.
    pub codes: Vec<Cia402CodeRow>,
    /// Codes without a name of their own.
    #[serde(default)]
    pub ranges: Vec<Cia402RangeRow>,
    /// What codes have in common.
    #[serde(default)]
    pub classes: Vec<Cia402ClassRow>,
}

/// One named code, bit or state.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402CodeRow {
    /// The code, the number of the bit, or the value of the state under its mask.
    pub code: Spanned<i64>,
    /// The last of several bits.
    pub last: Option<Spanned<u32>>,
    /// What of the value counts for a state.
    pub mask: Option<Spanned<u32>>,
    /// Its name.
    pub name: Name,
    /// Modes of operation in which it means this; all when absent.
    #[serde(default)]
    pub modes: Vec<Name>,
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
pub struct Cia402RangeRow {
    /// The first of them.
    pub from: Spanned<i64>,
    /// The last of them.
    pub to: Spanned<i64>,
    /// `group`, `number`, `vendor` or `reserved`.
    pub kind: Name,
    /// What they have in common.
    pub name: String,
}

/// What codes have in common, named or not.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ClassRow {
    /// The first of them.
    pub from: Spanned<i64>,
    /// The last of them.
    pub to: Spanned<i64>,
    /// What they have in common.
    pub name: Name,
}
