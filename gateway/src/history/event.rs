//! A line of the log, taken apart.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::config::LogLevel;

/// A line of the log.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LogEvent {
    /// Its number since the start of the process, from 1.
    pub number: u64,
    /// When it was logged: UTC, RFC 3339.
    pub time: String,
    /// The same on the host's monotonic clock, which no correction of the time changes.
    pub monotonic_ns: u64,
    /// `error`, `warn`, `info`, `debug` or `trace`.
    pub level: String,
    /// What it is about: `bus`, `commissioning`, `state`, `wait`, `fault`, `refusal`, `time`, or the part of the gateway.
    pub kind: String,
    /// The axis that it is about.
    pub axis: Option<String>,
    /// The drive of the axis.
    pub drive: Option<String>,
    /// The device that it is about.
    pub device: Option<String>,
    /// The bus that it is about.
    pub bus: Option<String>,
    /// The line as it is in the log, without time, level, axis and device.
    pub text: String,
}

impl LogEvent {
    /// Whether it matters at least as much as this level.
    #[must_use]
    pub fn is_of(&self, level: LogLevel) -> bool {
        LogLevel::ALL.iter().take_while(|one| **one <= level).any(|one| one.name() == self.level)
    }
}
