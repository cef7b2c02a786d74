//! Rows of the faults in the CIP Motion dictionary.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{CipSetRow, Name, Source};

/// `mappings/tables/dictionary/cip-faults.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipFaultFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// Sets of named codes.
    pub enumeration: Vec<CipSetRow>,
    /// Sets of named bits.
    pub bits: Vec<CipSetRow>,
    /// What the types of faults and alarms mean.
    pub fault_record: Vec<FaultRecordRow>,
    /// What the exception actions do.
    pub exception_action: Vec<ExceptionActionRow>,
    /// General status codes.
    pub status: Vec<StatusCodeRow>,
}

/// What one type of fault or alarm means.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultRecordRow {
    /// Set that names the codes.
    pub conditions: Name,
    /// Axis Fault Type of its record.
    pub fault_type: Option<Name>,
    /// Axis Alarm Type of its record.
    pub alarm_type: Option<Name>,
    /// Whether it stays after the condition has gone.
    pub latched: bool,
    /// Whether Axis Exception Action decides what happens.
    pub configurable: bool,
    /// Whether the axis goes to Major Faulted; absent where it depends.
    pub major: Option<bool>,
    /// What clears it.
    pub cleared_by: Vec<Name>,
    /// What a seven-segment display shows.
    pub seven_segment: Option<String>,
    /// What a display of several characters shows.
    pub display: Option<String>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Where it comes from.
    pub source: Source,
}

/// What one exception action does.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExceptionActionRow {
    /// Name in the set Axis Exception Action.
    pub action: Name,
    /// Whether the bit is set in Axis Exceptions.
    pub exceptions: bool,
    /// Whether the bit is set in Axis Alarms.
    pub alarms: bool,
    /// Whether the bit is set in Axis Faults.
    pub faults: bool,
    /// Whether the axis is brought to a stop.
    pub stops: bool,
}

/// A general status code and where it occurs.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StatusCodeRow {
    /// General status.
    pub general: Spanned<u8>,
    /// Extended status, where it has one; the first of them where an index is added.
    pub extended: Option<u8>,
    /// Name of the code.
    pub name: Name,
    /// Service or field it occurs in.
    #[serde(rename = "where")]
    pub occurs: String,
    /// Where it comes from.
    pub source: Source,
}
