//! A fault of an axis, in everybody's words.

use profile_generic::fault::FaultCause;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::local::advice::advice;

/// A fault of an axis.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultRecord {
    /// Its number, from 1; it goes on after a restart where the history is kept in a file.
    pub number: u64,
    /// When it came: UTC, RFC 3339.
    pub time: String,
    /// The axis.
    pub axis: String,
    /// Its drive.
    pub drive: String,
    /// The bus of the drive.
    pub bus: String,
    /// The cause in the generic drive model.
    pub cause: String,
    /// The fault as the gateway has it: cause, class, reaction, and why.
    pub gateway: Option<String>,
    /// The fault as its record for the controller has it.
    pub controller: Option<String>,
    /// The drive's own code; 0 if it has reported none.
    pub drive_code: u32,
    /// The drive's diagnostic number and text.
    pub drive_says: Option<String>,
    /// What to do about it.
    pub advice: String,
    /// How it has ended; without it the fault is present.
    pub end: Option<FaultEnd>,
}

/// How a fault has ended.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultEnd {
    /// When: UTC, RFC 3339; unknown if nobody has seen it.
    pub time: Option<String>,
    /// What has ended it.
    pub by: String,
}

impl FaultRecord {
    /// Whether the fault is there now.
    #[must_use]
    pub const fn is_present(&self) -> bool {
        self.end.is_none()
    }

    /// Gives it a cause of the generic model.
    pub(super) fn set_cause(&mut self, cause: FaultCause) {
        self.cause = cause.to_string();
        advice(cause).clone_into(&mut self.advice);
    }
}
