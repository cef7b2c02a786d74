//! Rows of the generic dictionary: what there is, and what is computed from it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, RatioRow, Source, listed};

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
    /// Constants that computed values use.
    #[serde(default)]
    pub constant: Vec<ConstantRow>,
    /// Parameters whose values are computed from others.
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

/// A parameter whose value is computed: one of `sum`, `product`, `ratio`, `selection` and `limit` of other parameters, of signals and of
/// constants, times `factor`. One of an overlay is in no drive; one of the catalogue is computed for drives that lack it.
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
    /// What is limited by `least`, `most` and `within`.
    pub limit: Option<Name>,
    /// Lower ends of `limit`: the highest that the drive has counts.
    #[serde(default)]
    pub least: Vec<Name>,
    /// Upper ends of `limit`: the lowest that the drive has counts.
    #[serde(default)]
    pub most: Vec<Name>,
    /// Ends of `limit` in both directions, as magnitudes.
    #[serde(default)]
    pub within: Vec<Name>,
    /// What a value is that is not between its ends: `hold` (at the end, the default) or `none` (no value: what it is computed from does
    /// not say how much more was asked for).
    pub at_limit: Option<Name>,
    /// The operands that are signals: values of the process image at the moment of the access. One that the drive does not send is
    /// read as the parameter of that name; an offset is not.
    #[serde(default)]
    pub signals: Vec<Name>,
    /// The operands that are 0 in a drive without the parameter: terms that the loops of its profile do not have.
    #[serde(default)]
    pub zero_if_missing: Vec<Name>,
    /// Operating modes in which it is computed. In others, and without torque, the value is 0; while the drive moves by itself there is
    /// none. Default: always.
    #[serde(default)]
    pub modes: Vec<Name>,
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

impl ComputedRow {
    /// How the value is computed, in words.
    pub(crate) fn words(&self) -> String {
        let row = self;
        let mut says = String::new();
        if !row.sum.is_empty() {
            says = format!("sum of {}", listed(&row.sum));
            if !row.less.is_empty() {
                says += &format!(", less {}", listed(&row.less));
            }
        } else if !row.product.is_empty() {
            says = format!("product of {}", listed(&row.product));
        } else if let Some([dividend, divisor]) = &row.ratio {
            says = format!("{} over {}", dividend.get_ref(), divisor.get_ref());
        } else if let Some(by) = &row.by {
            let taken = |choice: &ChoiceRow| format!("{} at {}", choice.take.get_ref(), choice.is.get_ref());
            let taken: Vec<String> = row.selection.iter().map(taken).collect();
            says = format!("selected by {}: {}", by.get_ref(), taken.join(", "));
        } else if let Some(limited) = &row.limit {
            says = limited.get_ref().clone();
            for (word, names) in [("at least", &row.least), ("at most", &row.most), ("within", &row.within)] {
                if !names.is_empty() {
                    says += &format!(", {word} {}", listed(names));
                }
            }
            if row.at_limit.as_ref().is_some_and(|word| word.get_ref() == "none") {
                says += ", none at a limit";
            }
        }
        if let Some(factor) = &row.factor {
            let [num, den] = factor.get_ref();
            says += &format!(", times {num}/{den}");
        }
        for (word, names) in
            [("signals", &row.signals), ("0 if missing", &row.zero_if_missing), ("in the modes", &row.modes)]
        {
            if !names.is_empty() {
                says += &format!(", {word} {}", listed(names));
            }
        }
        says += &format!(", rounded {}", row.rounding.as_ref().map_or("nearest", |name| name.get_ref()));
        if row.saturates.is_some() {
            says += ", saturates";
        }
        says
    }

    /// Everything that it computes with, but what selects.
    pub(crate) fn operands(&self) -> impl Iterator<Item = &Name> {
        let taken = self.selection.iter().map(|choice| &choice.take);
        let plain = self.sum.iter().chain(&self.less).chain(&self.product).chain(self.ratio.iter().flatten());
        let ends = self.least.iter().chain(&self.most).chain(&self.within);
        plain.chain(taken).chain(&self.limit).chain(ends)
    }
}
