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

/// `mappings/dictionary/cip-motion.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// Attributes of instance 0.
    pub class_attribute: Vec<AttributeRow>,
    /// Attributes of the axis instances.
    pub attribute: Vec<AttributeRow>,
    /// Enumerated codes.
    pub enumeration: Vec<EnumerationRow>,
    /// Bit fields.
    pub bits: Vec<BitsRow>,
    /// Data sets of the cyclic data block.
    pub data_set: Vec<DataSetRow>,
}

/// One attribute of the Motion Device Axis Object.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttributeRow {
    /// Attribute number.
    pub id: Spanned<u16>,
    /// Name in the standard.
    pub name: Name,
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
    /// Value at power-up where it is not 0.
    pub default: Option<i64>,
    /// How many channels repeat the attribute ("Feedback n ...").
    pub channels: Option<u16>,
    /// From the number of one channel to that of the next.
    pub channel_step: Option<u16>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Table of the standard.
    pub source: Source,
}

/// A set of named codes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnumerationRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds such a code.
    pub attribute: Option<Name>,
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

/// A set of named bits.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BitsRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds the bits.
    pub attribute: Option<Name>,
    /// How many bits the value has.
    pub width: u32,
    /// Where it comes from.
    pub source: Source,
    /// The bits.
    pub bits: Vec<BitRow>,
}

/// One named bit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BitRow {
    /// Number of the bit, 0 first.
    pub bit: Spanned<u32>,
    /// Its name.
    pub name: Name,
    /// Device functions it applies to.
    pub rule: Option<String>,
}

/// A data set of the cyclic data block.
#[derive(Debug, Clone, Deserialize)]
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
}

/// One element of a data set.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElementRow {
    /// Bit in the data set.
    pub bit: Spanned<u8>,
    /// Name of the element.
    pub name: Name,
    /// Attributes it carries.
    pub attributes: Vec<Name>,
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
