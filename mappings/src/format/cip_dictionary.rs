//! Rows of the CIP Motion dictionary.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, Source};

/// `mappings/tables/dictionary/cip-attributes.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipAttributeFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// How the attributes of the feedback channels repeat.
    pub feedback_channels: ChannelsRow,
    /// Where the sources stand in the standard.
    pub clauses: Vec<ClauseRow>,
    /// Attributes of instance 0.
    pub class_attribute: Vec<AttributeRow>,
    /// Attributes of the axis instances.
    pub attribute: Vec<AttributeRow>,
    /// Data sets of the cyclic data block.
    pub data_set: Vec<DataSetRow>,
}

/// How the attributes of the feedback channels repeat.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsRow {
    /// How many channels there are.
    pub count: u16,
    /// From the number of an attribute of one channel to that of the next.
    pub step: u16,
}

/// Where a source stands in the standard.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClauseRow {
    /// The source as rows name it.
    pub source: String,
    /// The clause.
    pub clause: String,
    /// What it lists.
    pub title: String,
}

/// One attribute of the Motion Device Axis Object.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttributeRow {
    /// Attribute number.
    pub id: Spanned<u16>,
    /// Name in the standard.
    pub name: Name,
    /// Whether each feedback channel has it ("Feedback n ...").
    #[serde(default)]
    pub per_channel: bool,
    /// CIP data type.
    #[serde(rename = "type")]
    pub data_type: Name,
    /// Elements of an array; absent for a single value.
    pub length: Option<u16>,
    /// `get`, `set` or `set_cyclic`.
    pub access: Name,
    /// Whether it may be set in the Running state.
    #[serde(default)]
    pub running: bool,
    /// `R`, `O`, `C` or `-` per device function B E F P V T; one letter for a class attribute.
    pub need: Name,
    /// Condition on the need.
    pub condition: Option<String>,
    /// Unit as the standard names it.
    pub unit: Option<Name>,
    /// Value at power-up where the standard states one.
    pub default: Option<i64>,
    /// Least value.
    pub min: Option<Spanned<i64>>,
    /// Greatest value.
    pub max: Option<Spanned<i64>>,
    /// What the standard says about the range in words.
    pub range: Option<String>,
    /// `sign`: Motion Polarity turns the sign.
    pub polarity: Option<Name>,
    /// The attribute with which Motion Polarity exchanges the value.
    pub swaps_with: Option<Name>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Table of the standard.
    pub source: Source,
}

/// A data set of the cyclic data block.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSetRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds the bits of the set.
    pub attribute: Name,
    /// Where it comes from.
    pub source: Source,
    /// What the bits stand for.
    pub elements: Vec<ElementRow>,
    /// Bits without a name of their own.
    #[serde(default)]
    pub ranges: Vec<CipRangeRow>,
}

/// One element of a data set.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElementRow {
    /// Bit in the data set.
    pub bit: Spanned<u8>,
    /// Name of the element.
    pub name: Name,
    /// Attributes it carries.
    pub attributes: Vec<Name>,
    /// `R`, `O`, `C` or `-`.
    pub need: Option<Name>,
    /// To what the need applies.
    pub rule: Option<String>,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// `mappings/tables/dictionary/cip-enumerations.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipEnumerationFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// Sets of named codes.
    pub enumeration: Vec<CipSetRow>,
    /// Sets of named bits.
    pub bits: Vec<CipSetRow>,
}

/// A set of named codes or of named bits.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipSetRow {
    /// Name of the set.
    pub name: Name,
    /// Attributes of the axis that hold such a value.
    #[serde(default)]
    pub attributes: Vec<Name>,
    /// Attributes of instance 0 that hold such a value.
    #[serde(default)]
    pub class_attributes: Vec<Name>,
    /// The field or the part of the attribute that holds it, in words.
    pub element: Option<String>,
    /// First and last bit of the code where it is only a part of the value; not of a set of bits.
    pub field: Option<Spanned<[u32; 2]>>,
    /// How many bits the value has; of a set of bits only.
    pub width: Option<Spanned<u32>>,
    /// Where it comes from.
    pub source: Source,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// The codes; `bits` in a set of bits.
    #[serde(alias = "bits")]
    pub codes: Vec<CipCodeRow>,
    /// Codes or bits without a name of their own.
    #[serde(default)]
    pub ranges: Vec<CipRangeRow>,
}

/// One named code or bit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipCodeRow {
    /// The code; `bit`, its number from 0, in a set of bits.
    #[serde(alias = "bit")]
    pub code: Spanned<u32>,
    /// Its name.
    pub name: Name,
    /// `R`, `O`, `C` or `-`.
    pub need: Option<Name>,
    /// To what the need applies.
    pub rule: Option<String>,
    /// Attributes that say when the condition is met, for sets of faults and alarms.
    #[serde(default)]
    pub limits: Vec<Name>,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// Codes or bits without a name of their own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipRangeRow {
    /// The first of them.
    pub from: Spanned<u32>,
    /// The last of them.
    pub to: Spanned<u32>,
    /// `reserved`, `vendor`, `device` or `number`.
    pub kind: Name,
    /// What such a code means, where the standard says it.
    pub name: Option<String>,
    /// `R`, `O`, `C` or `-`.
    pub need: Option<Name>,
    /// Anything worth knowing.
    pub note: Option<String>,
}

/// `mappings/tables/dictionary/cip-services.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipServiceFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// The services.
    pub service: Vec<ServiceRow>,
}

/// One service.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ServiceRow {
    /// Service code.
    pub code: Spanned<u8>,
    /// Name in the standard.
    pub name: Name,
    /// `R`, `O`, `C` or `-` for instance 0.
    pub class: Name,
    /// `R`, `O`, `C` or `-` for an axis, per device function B E F P V T.
    pub instance: Name,
    /// `explicit`, `service_data_block`: what may carry it.
    pub via: Vec<Name>,
    /// Fields of the request data, in words.
    pub request: Vec<String>,
    /// Fields of the response data, in words.
    pub response: Vec<String>,
    /// Axis states in which it is taken, in words.
    pub states: Option<String>,
    /// What a bad request is answered, in words.
    pub errors: Option<String>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Table of the standard.
    pub source: Source,
    /// Clause that describes it.
    pub clause: String,
}
