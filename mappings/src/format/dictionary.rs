//! Rows of the generic dictionary.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::Name;

/// `mappings/tables/dictionary/generic.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SignalRow {
    /// Name in snake case.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// `command` or `feedback`.
    pub access: Name,
    /// What it is, in a sentence.
    pub about: Option<Name>,
}

/// A parameter of the generic model.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParameterRow {
    /// Number; the high byte groups them. A parameter of an overlay has a number from 0x8000 to 0xFFFF.
    pub number: Option<Spanned<u16>>,
    /// Name in snake case.
    pub name: Name,
    /// Functional element that it belongs to.
    pub element: Option<Name>,
    /// What it measures.
    pub quantity: Name,
    /// `integer`, `float` or `text`.
    #[serde(rename = "type")]
    pub data_type: Name,
    /// `read`, `write` or `write_while_disabled`.
    pub access: Name,
    /// What it is, in a sentence.
    pub about: Option<Name>,
    /// Least and greatest value that may be set, in the unit of the quantity. Only a parameter of an overlay has one.
    pub range: Option<Spanned<[i64; 2]>>,
}
