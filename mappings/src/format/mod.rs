//! What the table files look like: one Rust type per kind of row, nothing resolved yet.
//!
//! Every value that can be wrong keeps its place in the file ([`Spanned`]), so that an error can point at
//! it. Names of signals, IDNs, attributes and codes are plain text here; the resolvers turn them into what
//! they name.

mod cia402_dictionary;
mod cip_dictionary;
mod cip_faults;
mod cip_generic;
mod cip_networks;
mod dictionary;
mod generic_cia402;
mod generic_sercos;
mod sercos_dictionary;

pub use cia402_dictionary::*;
pub use cip_dictionary::*;
pub use cip_faults::*;
pub use cip_generic::*;
pub use cip_networks::*;
pub use dictionary::*;
pub use generic_cia402::*;
pub use generic_sercos::*;
pub use sercos_dictionary::*;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

/// A name that some dictionary must know.
pub type Name = Spanned<String>;

/// Where a row comes from: document and clause, or a vendor document.
pub type Source = Spanned<String>;

/// Names with commas between them.
#[must_use]
pub fn listed(names: &[Name]) -> String {
    let names: Vec<&str> = names.iter().map(|name| name.get_ref().as_str()).collect();
    names.join(", ")
}

/// A ratio `[numerator, denominator]`.
pub type RatioRow = Spanned<[i64; 2]>;

/// How a unit of a profile becomes the unit of a generic quantity.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnitRow {
    /// Unit as the dictionary names it.
    pub unit: Name,
    /// Generic quantity.
    pub quantity: Name,
    /// Generic units in one unit of the profile.
    pub generic_per_unit: RatioRow,
    /// What multiplies the ratio: a scaling of the axis.
    pub times: Option<Name>,
    /// The value is one over the generic one, as a bandwidth is of its time constant; 0 on both sides is "none". Of attributes only.
    #[serde(default)]
    pub reciprocal: bool,
    /// How drives spell the unit, in addition to the dictionary.
    #[serde(default)]
    pub texts: Vec<String>,
    /// Where it comes from.
    pub source: Source,
}
