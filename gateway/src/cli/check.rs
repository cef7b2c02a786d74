//! `axisbridge check`: reads tables, overlays and a configuration, and reports everything that is wrong with them.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use super::{CheckArguments, CheckFormat, CliError, has_colours, print, usage};
use crate::check::{Outcome, Request, check, schema};
use crate::finding::registry::{self, Code, REGISTRY};
use crate::finding::{Finding, Findings, Severity, json_report, sarif_report};
use crate::mapping::check::{diff, page};
use crate::mapping::{Mapping, TableTexts};

/// Checks, or reports the codes.
///
/// # Errors
/// The output cannot be written.
pub fn run(arguments: &CheckArguments) -> Result<ExitCode, CliError> {
    if let Some(text) = &arguments.explain {
        return match Code::parse(text) {
            Some(code) => print(format!("{}\n", code.entry()), ExitCode::SUCCESS),
            None => Ok(usage(&unknown(text))),
        };
    }
    if let Some(name) = &arguments.schema {
        return schema(name);
    }
    let format = if arguments.json { CheckFormat::Json } else { arguments.format };
    if arguments.list {
        return print(list(format), ExitCode::SUCCESS);
    }
    if format == CheckFormat::Markdown || format == CheckFormat::Sarif && arguments.diff.is_some() {
        return Ok(usage("--format markdown is for --list, and --format sarif for findings"));
    }
    let outcome = check(&Request {
        config: arguments.config.as_deref(),
        mappings: &arguments.mappings,
        // What tables change is compared row by row.
        frames: !arguments.no_frames && arguments.diff.is_none(),
    });
    if let Some(old) = &arguments.diff {
        return changes(arguments, old.as_deref(), format, &outcome);
    }
    if let Some(path) = &arguments.report {
        std::fs::write(path, page(&outcome.tables))
            .map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let findings = &outcome.tables.findings;
    let bad = findings.has_errors() || findings.count(Severity::Warning) > 0;
    let text = match format {
        CheckFormat::Json => format!("{:#}\n", json_report(findings)),
        CheckFormat::Sarif => format!("{:#}\n", sarif_report(findings)),
        CheckFormat::Text | CheckFormat::Markdown => text(arguments, &outcome),
    };
    print(text, if bad { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// What is wrong with a code that is to be explained.
fn unknown(text: &str) -> String {
    let digits = text.get(2..).filter(|_| text.get(..2).is_some_and(|head| head.eq_ignore_ascii_case("AX")));
    let listed = "`axisbridge check --list` prints all codes";
    if digits.is_some_and(|digits| digits.len() == 4 && digits.bytes().all(|digit| digit.is_ascii_digit())) {
        format!("there is no code {}; {listed}", text.to_ascii_uppercase())
    } else {
        format!("`{text}` is no code: expected AX and four digits, such as AX0010; {listed}")
    }
}

/// What the tables change against others.
fn changes(
    arguments: &CheckArguments,
    old: Option<&Path>,
    format: CheckFormat,
    outcome: &Outcome,
) -> Result<ExitCode, CliError> {
    let before = match old {
        None => Mapping::embedded(),
        Some(old) if TableTexts::replaces(old) => Mapping::load(Some(old), &[]),
        Some(old) => Mapping::load(None, &[old.to_owned()]),
    };
    // Of a configuration that cannot be read nobody knows the tables.
    let read = arguments.config.is_none() || outcome.config.is_some();
    let (Ok(before), Some(mapping), true) = (&before, &outcome.tables.mapping, read) else {
        let mut findings = outcome.tables.findings.clone();
        findings.extend(before.err().unwrap_or_default());
        findings.retain(|finding| finding.severity() == Severity::Error);
        let text = match format {
            CheckFormat::Json => format!("{:#}\n", json_report(&findings)),
            _ => format!("{}the tables cannot be compared\n", shown(arguments, &findings)),
        };
        return print(text, ExitCode::FAILURE);
    };
    let changes = diff::changes(before, mapping);
    let text = match format {
        CheckFormat::Json => format!("{:#}\n", changes.json()),
        _ => changes.to_string(),
    };
    print(text, if changes.open() > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The findings one after the other, with colours on a terminal.
fn shown(arguments: &CheckArguments, findings: &Findings) -> String {
    findings.shown(has_colours(&std::io::stdout()), |found| arguments.notes || found.asks())
}

/// A schema, or the names of all.
fn schema(name: &str) -> Result<ExitCode, CliError> {
    if name.is_empty() {
        return print(schema::names().map(|name| format!("{name}\n")).collect::<String>(), ExitCode::SUCCESS);
    }
    match schema::schema(name, &Mapping::embedded()?) {
        Some(schema) => print(format!("{schema:#}\n"), ExitCode::SUCCESS),
        None => {
            let names: Vec<&str> = schema::names().collect();
            Ok(usage(&format!("there is no schema `{name}`: expected one of {}", names.join(", "))))
        }
    }
}

fn text(arguments: &CheckArguments, outcome: &Outcome) -> String {
    let findings = &outcome.tables.findings;
    let mut text = shown(arguments, findings);
    let counted = |found: &&Finding| arguments.notes || found.asks();
    let count = |severity| {
        findings.list().iter().filter(counted).filter(|found| found.severity() == severity).count()
    };
    let (errors, warnings, notes) = (count(Severity::Error), count(Severity::Warning), count(Severity::Note));
    let _ = write!(
        text,
        "{}, {}, {}",
        plural(errors, "error"),
        plural(warnings, "warning"),
        plural(notes, "note")
    );
    let overlays = if outcome.tables.overlays > 0 {
        format!(", {}", plural(outcome.tables.overlays, "overlay"))
    } else {
        String::new()
    };
    let axes = if arguments.config.is_some() {
        format!(", {}", plural(outcome.config.as_ref().map_or(0, |config| config.axes.len()), "axis"))
    } else {
        String::new()
    };
    let _ = writeln!(
        text,
        "; checked the tables, those of {}{overlays}{axes}, {} and {}",
        plural(outcome.tables.families, "family of drives"),
        plural(outcome.tables.examples, "worked example"),
        plural(outcome.frames, "frame")
    );
    text
}

fn plural(count: usize, what: &str) -> String {
    match (count, what) {
        (1, _) => format!("1 {what}"),
        (_, "family of drives") => format!("{count} families of drives"),
        (_, "axis") => format!("{count} axes"),
        _ => format!("{count} {what}s"),
    }
}

fn list(format: CheckFormat) -> String {
    match format {
        CheckFormat::Markdown => registry::page(),
        CheckFormat::Json => {
            let entries = REGISTRY.iter().map(|entry| {
                serde_json::json!({
                    "code": entry.code.to_string(),
                    "severity": entry.severity.name(),
                    "title": entry.title,
                    "explanation": entry.explanation,
                    "example": entry.example,
                    "remedy": entry.remedy,
                })
            });
            format!("{:#}\n", serde_json::Value::Array(entries.collect()))
        }
        CheckFormat::Text | CheckFormat::Sarif => {
            let mut text = String::new();
            for entry in REGISTRY {
                let _ = writeln!(text, "{} {:7} {}", entry.code, entry.severity.name(), entry.title);
            }
            text
        }
    }
}
