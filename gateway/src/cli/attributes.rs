//! `axisbridge attributes`: what success means for each attribute of the axes of a configuration.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::ExitCode;

use serde::Serialize;

use super::{AttributesArguments, CliError, print, translate, usage};
use crate::config::Config;
use crate::mapping::{AttributeTruth, Truth};

/// What is printed of one axis as JSON.
#[derive(Debug, Serialize)]
struct AxisObject<'a> {
    name: &'a str,
    drive: &'a str,
    /// The drive is a simulated one of its kind: the real one may have more or less.
    simulated: bool,
    counts: BTreeMap<&'static str, usize>,
    attributes: Vec<AttributeObject<'a>>,
}

/// What is printed of one attribute as JSON.
#[derive(Debug, Serialize)]
struct AttributeObject<'a> {
    id: u16,
    name: &'a str,
    access: &'static str,
    truth: &'static str,
    by: &'a str,
}

/// Everything that is printed as JSON.
#[derive(Debug, Serialize)]
struct Object<'a> {
    format: u8,
    axes: Vec<AxisObject<'a>>,
}

/// Prints the table.
///
/// # Errors
/// The configuration is faulty, or its drives are not commissioned with it; the output cannot be written.
pub fn run(arguments: &AttributesArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    let stage = translate::stage(&config, arguments.values.as_deref())?;
    let wanted = |name: &str| arguments.axis.as_deref().is_none_or(|axis| axis == name);
    let axes: Vec<_> = stage.axes.iter().filter(|axis| wanted(&axis.name)).collect();
    if let (Some(name), []) = (&arguments.axis, axes.as_slice()) {
        let names: Vec<_> = stage.axes.iter().map(|axis| axis.name.as_str()).collect();
        return Ok(usage(&format!("there is no axis `{name}`; expected one of: {}", names.join(", "))));
    }
    let truths: Vec<_> =
        axes.iter().map(|axis| stage.mapping.truths(&axis.attributes, &axis.south)).collect();
    if arguments.json {
        let axes = axes.iter().zip(&truths).map(|(axis, truths)| AxisObject {
            name: &axis.name,
            drive: &axis.drive,
            simulated: arguments.values.is_none(),
            counts: counts(truths),
            attributes: truths.iter().map(object).collect(),
        });
        let mut text = serde_json::to_string(&Object { format: 1, axes: axes.collect() })
            .map_err(|error| error.to_string())?;
        text.push('\n');
        return print(text, ExitCode::SUCCESS);
    }
    let mut text = String::new();
    for (axis, truths) in axes.iter().zip(&truths) {
        let counts: Vec<_> =
            Truth::ALL.iter().map(|truth| format!("{} {truth}", count(truths, *truth))).collect();
        let gap = if text.is_empty() { "" } else { "\n" };
        let simulated = if arguments.values.is_none() { " (a simulated one)" } else { "" };
        // A string takes everything.
        let _ =
            writeln!(text, "{gap}axis {}, drive {}{simulated}: {}", axis.name, axis.drive, counts.join(", "));
        for row in truths {
            let access = row.access.name();
            let _ =
                writeln!(text, "{:>5}  {:<8}  {access:<10}  {:<44}  {}", row.id, row.truth, row.name, row.by);
        }
    }
    print(text, ExitCode::SUCCESS)
}

fn count(truths: &[AttributeTruth<'_>], truth: Truth) -> usize {
    truths.iter().filter(|row| row.truth == truth).count()
}

fn counts(truths: &[AttributeTruth<'_>]) -> BTreeMap<&'static str, usize> {
    Truth::ALL.iter().map(|truth| (truth.name(), count(truths, *truth))).collect()
}

fn object<'a>(row: &'a AttributeTruth<'_>) -> AttributeObject<'a> {
    AttributeObject {
        id: row.id,
        name: row.name,
        access: row.access.name(),
        truth: row.truth.name(),
        by: &row.by,
    }
}
