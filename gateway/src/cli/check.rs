//! `axisbridge check`: reads tables, overlays and a configuration, and reports everything that is wrong with them.

use std::fmt::Write as _;
use std::process::ExitCode;

use super::{CheckArguments, CheckFormat, CliError, print};
use crate::check::{Outcome, Request, check, schema};
use crate::finding::registry::{self, Code, REGISTRY};
use crate::finding::{Severity, json_report};
use crate::mapping::Mapping;
use crate::mapping::check::page;

/// Exit status of a wrong command line, as clap has it.
const USAGE: u8 = 2;

/// Checks, or tells of the codes.
///
/// # Errors
/// The output cannot be written.
pub fn run(arguments: &CheckArguments) -> Result<ExitCode, CliError> {
    if let Some(text) = &arguments.explain {
        return match Code::parse(text) {
            Some(code) => print(format!("{}\n", code.entry()), ExitCode::SUCCESS),
            None => {
                eprintln!(
                    "error: there is no code `{text}`: expected AX and four digits; --list has all of them"
                );
                Ok(ExitCode::from(USAGE))
            }
        };
    }
    if let Some(name) = &arguments.schema {
        return schema(name);
    }
    if arguments.list {
        return print(list(arguments.format), ExitCode::SUCCESS);
    }
    if arguments.format == CheckFormat::Markdown {
        eprintln!("error: --format markdown is for --list");
        return Ok(ExitCode::from(USAGE));
    }
    let outcome = check(&Request { config: arguments.config.as_deref(), mappings: &arguments.mappings });
    if let Some(path) = &arguments.report {
        std::fs::write(path, page(&outcome.tables))
            .map_err(|error| format!("{}: {error}", path.display()))?;
    }
    let findings = &outcome.tables.findings;
    let bad = findings.has_errors() || findings.count(Severity::Warning) > 0;
    let text = match arguments.format {
        CheckFormat::Json => format!("{:#}\n", json_report(findings)),
        CheckFormat::Text | CheckFormat::Markdown => text(arguments, &outcome),
    };
    print(text, if bad { ExitCode::FAILURE } else { ExitCode::SUCCESS })
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
            eprintln!("error: there is no schema `{name}`: expected one of {}", names.join(", "));
            Ok(ExitCode::from(USAGE))
        }
    }
}

fn text(arguments: &CheckArguments, outcome: &Outcome) -> String {
    let findings = &outcome.tables.findings;
    let mut text = String::new();
    let shown = findings.list().iter().filter(|found| arguments.notes || found.severity() != Severity::Note);
    for finding in shown {
        let _ = writeln!(text, "{finding}\n");
    }
    if findings.beyond() > 0 {
        let _ = writeln!(text, "{} more are not shown\n", findings.beyond());
    }
    let count = |severity| findings.count(severity);
    let (errors, warnings, notes) = (count(Severity::Error), count(Severity::Warning), count(Severity::Note));
    let _ = write!(
        text,
        "{}, {}, {}",
        plural(errors, "error"),
        plural(warnings, "warning"),
        plural(notes, "note")
    );
    if notes > 0 && !arguments.notes {
        text.push_str(" (--notes shows them)");
    }
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
        "; checked the tables, those of {}{overlays}{axes} and {}",
        plural(outcome.tables.families, "family of drives"),
        plural(outcome.tables.examples, "worked example")
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
        CheckFormat::Text => {
            let mut text = String::new();
            for entry in REGISTRY {
                let _ = writeln!(text, "{} {:7} {}", entry.code, entry.severity.name(), entry.title);
            }
            text
        }
    }
}
