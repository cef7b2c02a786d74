//! What was read from and written to a slave on the way up.

use core::fmt;

use super::svc::request::{SvcFailure, SvcOperation, SvcOutcome};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc::Element;

/// Rows kept per slave; a phase-up with eight connections has fewer than 120.
pub const REPORT_MAX: usize = 192;

/// What came out of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowOutcome {
    /// Read or written: up to the first four bytes, and how many there were.
    Value {
        /// The first four bytes, little endian.
        value: u32,
        /// Bytes of the element; a list's without its head.
        len: u16,
    },
    /// A procedure command went through.
    Done,
    /// The slave does not have this optional parameter.
    Absent,
    /// It failed.
    Failed(SvcFailure),
}

/// One service channel request of the phase-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportRow {
    /// Phase in which it was made.
    pub phase: Phase,
    /// Parameter.
    pub idn: Idn,
    /// What was asked.
    pub operation: SvcOperation,
    /// What came out.
    pub outcome: RowOutcome,
}

impl ReportRow {
    pub(super) fn new(phase: Phase, outcome: &SvcOutcome, optional: bool) -> ReportRow {
        let row = match outcome.result {
            Err(failure) if optional && failure.is_absent() => RowOutcome::Absent,
            Err(failure) => RowOutcome::Failed(failure),
            Ok(reply) => match outcome.operation {
                SvcOperation::Execute | SvcOperation::Cancel | SvcOperation::Command => RowOutcome::Done,
                SvcOperation::Length(_) => {
                    RowOutcome::Value { value: 0, len: reply.head.unwrap_or_default().current }
                }
                SvcOperation::Status => RowOutcome::Value { value: u32::from(reply.status.bits()), len: 2 },
                SvcOperation::Read(_) | SvcOperation::Write(_) => {
                    let bytes = outcome.data.as_slice();
                    let mut value = [0; 4];
                    value.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                    let len = u16::try_from(bytes.len()).unwrap_or(u16::MAX);
                    RowOutcome::Value { value: u32::from_le_bytes(value), len }
                }
            },
        };
        ReportRow { phase, idn: outcome.idn, operation: outcome.operation, outcome: row }
    }
}

impl fmt::Display for ReportRow {
    // Flat: one arm per operation, then one per outcome.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let access = match self.operation {
            SvcOperation::Status => "status",
            SvcOperation::Read(_) => "read",
            SvcOperation::Write(_) => "write",
            SvcOperation::Length(_) => "length",
            SvcOperation::Execute => "execute",
            SvcOperation::Cancel => "cancel",
            SvcOperation::Command => "command",
        };
        write!(f, "{} {access} {}", self.phase, self.idn)?;
        match self.operation {
            SvcOperation::Read(element) | SvcOperation::Write(element) if element != Element::Data => {
                write!(f, " {element}")?;
            }
            _ => {}
        }
        match self.outcome {
            RowOutcome::Value { len, .. } if matches!(self.operation, SvcOperation::Length(_)) => {
                write!(f, ": {len} bytes")
            }
            RowOutcome::Value { value, len: 1..=4 } => write!(f, ": {value} ({value:#x})"),
            RowOutcome::Value { len, .. } => write!(f, ": {len} bytes"),
            RowOutcome::Done => f.write_str(": done"),
            RowOutcome::Absent => f.write_str(": not available"),
            RowOutcome::Failed(failure) => write!(f, ": {failure}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::svc::request::{SvcData, SvcReply};
    use super::*;
    use crate::wire::svc_error::SvcError;

    #[test]
    fn rows_as_text() {
        let outcome = |operation, result, data: &[u8]| SvcOutcome {
            idn: Idn::CYCLE_TIME,
            operation,
            result,
            data: SvcData::inline(data).unwrap(),
        };
        let row = |outcome, optional| ReportRow::new(Phase::CP2, &outcome, optional).to_string();
        let ok = Ok(SvcReply::default());
        let write = SvcOperation::Write(Element::Data);
        assert_eq!(
            row(outcome(write, ok, &[0x80, 0x96, 0x98, 0]), false),
            "CP2 write S-0-1002: 10000000 (0x989680)"
        );
        assert_eq!(row(outcome(write, ok, &[0; 8]), false), "CP2 write S-0-1002: 8 bytes");
        let minimum = SvcOperation::Read(Element::Minimum);
        assert_eq!(row(outcome(minimum, ok, &[5, 0]), false), "CP2 read S-0-1002 minimum: 5 (0x5)");
        let absent = Err(SvcFailure::Refused { element: Element::Idn, code: SvcError::NO_IDN });
        assert_eq!(row(outcome(write, absent, &[]), true), "CP2 write S-0-1002: not available");
        assert_eq!(row(outcome(write, absent, &[]), false), "CP2 write S-0-1002: IDN: IDN not available");
        assert_eq!(row(outcome(SvcOperation::Execute, ok, &[]), false), "CP2 execute S-0-1002: done");
    }
}
