//! Rows of the generic dictionary: what there is, and what is computed from it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, RatioRow, Source};

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
    /// Constants that computed values use. Only overlays have some.
    #[serde(default)]
    pub constant: Vec<ConstantRow>,
    /// Parameters whose values are computed from others. Only overlays have some.
    #[serde(default)]
    pub computed: Vec<ComputedRow>,
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
    /// Least and greatest value that may be set, in the unit of the quantity, or that the drive may have where the parameter
    /// is only read. Only a parameter of an overlay has one.
    pub range: Option<Spanned<[i64; 2]>>,
}

/// A constant that computed values use.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstantRow {
    /// Name in snake case; no parameter has the same.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// Its value, in the unit of the quantity.
    pub value: Spanned<i64>,
    /// What it is, in a sentence.
    pub about: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A parameter of an overlay whose value is computed: one of `sum`, `product`, `ratio` and `selection` of other parameters and of
/// constants, times `factor`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComputedRow {
    /// The parameter, which has a `[[parameter]]` row.
    pub parameter: Name,
    /// What is added.
    #[serde(default)]
    pub sum: Vec<Name>,
    /// What is taken away from the sum.
    #[serde(default)]
    pub less: Vec<Name>,
    /// What is multiplied.
    #[serde(default)]
    pub product: Vec<Name>,
    /// Dividend and divisor.
    pub ratio: Option<[Name; 2]>,
    /// What is taken by the value of `by`.
    #[serde(default)]
    pub selection: Vec<ChoiceRow>,
    /// Whose value selects.
    pub by: Option<Name>,
    /// What the result is multiplied by; a bare number. Units are converted without it.
    pub factor: Option<RatioRow>,
    /// How the result becomes a whole number: `nearest` (default; ties away from zero), `floor` or `toward_zero`.
    pub rounding: Option<Name>,
    /// The one operand that is written when the parameter is written, so that the result is what was set.
    pub writes: Option<Name>,
    /// Why a result beyond `range` of the parameter is held at its end. Without it, such a result is refused, and `check`
    /// does not let it be possible.
    pub saturates: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A choice of a selection.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChoiceRow {
    /// The value of the parameter that selects.
    pub is: Spanned<i64>,
    /// What is taken then.
    pub take: Name,
}
