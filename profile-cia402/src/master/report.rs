//! What was read from and written to a device while it came up.

use core::fmt;

use super::boot::BootState;
use crate::sdo::request::{SdoFailure, SdoOperation, SdoOutcome};
use crate::wire::Mux;
use crate::wire::pdo::{Direction, SUB_COB_ID};

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowOutcome {
    /// The value read or written, low 32 bits, and how many bytes it has.
    Value {
        /// The value.
        value: u32,
        /// Bytes.
        len: u16,
    },
    /// The device does not have it, which is permitted.
    Absent,
    /// The device refused, which is permitted.
    Tolerated(SdoFailure),
    /// It failed.
    Failed(SdoFailure),
    /// The value read is not the one that was wanted.
    Differs {
        /// What was read.
        found: u32,
        /// What was wanted.
        expected: u32,
    },
}

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportRow {
    /// Where the device was.
    pub state: BootState,
    /// Index and sub-index.
    pub object: Mux,
    /// Which way.
    pub operation: SdoOperation,
    /// How it ended.
    pub outcome: RowOutcome,
}

impl ReportRow {
    /// A row of an access that went well.
    pub(super) fn new(state: BootState, outcome: &SdoOutcome) -> Self {
        let bytes = outcome.data.as_slice();
        let mut value = [0; 4];
        value.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let len = u16::try_from(bytes.len()).unwrap_or(u16::MAX);
        Self {
            state,
            object: outcome.object,
            operation: outcome.operation,
            outcome: match outcome.result {
                Ok(()) => RowOutcome::Value { value: u32::from_le_bytes(value), len },
                Err(failure) => RowOutcome::Failed(failure),
            },
        }
    }

    /// Whether the device has refused to have the mapping or the identifier of a PDO changed.
    #[must_use]
    pub fn is_refused_mapping(&self) -> bool {
        let refused = matches!(self.outcome, RowOutcome::Failed(SdoFailure::Refused(_)));
        let index = self.object.index;
        let concerned = Direction::BOTH.iter().any(|way| {
            way.mapping().contains(&index)
                || way.communication().contains(&index) && self.object.sub == SUB_COB_ID
        });
        refused && concerned && self.operation == SdoOperation::Download
    }

    pub(super) fn with(self, outcome: RowOutcome) -> Self {
        Self { outcome, ..self }
    }
}

impl fmt::Display for ReportRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let access = match self.operation {
            SdoOperation::Upload => "read",
            SdoOperation::Download => "write",
        };
        write!(f, "{} {access} {}: ", self.state, self.object)?;
        match self.outcome {
            RowOutcome::Value { value, len: 1..=4 } => write!(f, "{value} ({value:#x})"),
            RowOutcome::Value { len, .. } => write!(f, "{len} bytes"),
            RowOutcome::Absent => f.write_str("not available"),
            RowOutcome::Tolerated(failure) => write!(f, "{failure}, gone on without"),
            RowOutcome::Failed(failure) => write!(f, "{failure}"),
            RowOutcome::Differs { found, expected } => write!(f, "expected {expected:#x}, got {found:#x}"),
        }
    }
}
