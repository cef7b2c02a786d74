//! Findings for programs. What stands here is a contract: keys are added, never changed.

use serde_json::{Value, json};

use super::{Finding, Findings, Severity};

/// The version of the format.
const FORMAT: u32 = 1;

/// One object with all findings.
#[must_use]
pub fn report(findings: &Findings) -> Value {
    json!({
        "format": FORMAT,
        "errors": findings.count(Severity::Error),
        "warnings": findings.count(Severity::Warning),
        "notes": findings.count(Severity::Note),
        "not_shown": findings.beyond(),
        "findings": findings.list().iter().map(finding).collect::<Vec<_>>(),
    })
}

fn finding(finding: &Finding) -> Value {
    let text = |text: &str| if text.is_empty() { Value::Null } else { Value::from(text) };
    let number = |number: usize| if finding.line == 0 { Value::Null } else { Value::from(number) };
    json!({
        "code": finding.code.to_string(),
        "severity": finding.severity().name(),
        "file": finding.file,
        "line": number(finding.line),
        "column": number(finding.column),
        "length": number(finding.length),
        "key": text(&finding.key),
        "title": finding.title,
        "expected": text(&finding.expected),
        "help": text(&finding.help),
        "related": finding.related.as_ref().map(|related| json!({
            "file": related.file,
            "line": related.line,
            "column": related.column,
            "text": related.text,
        })),
    })
}
