//! `axisbridge init`: a configuration to begin with, from the drives that answer on a bus.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::process::ExitCode;

use super::scan::{self, Scanned};
use super::{CliError, InitArguments, has_colours, print};
use crate::check::{Request, check};
use crate::finding::Finding;
use crate::finding::registry as code;

/// Scans the bus, writes the file and checks it. An existing file is never touched.
///
/// # Errors
/// The file exists already or cannot be written, the bus cannot be scanned, there is no drive, or the file has an error.
pub fn run(arguments: &InitArguments) -> Result<ExitCode, CliError> {
    let path = arguments.output.as_path();
    // Before the scan, which takes its time. Who makes the file meanwhile is noticed below.
    if path.try_exists().map_err(|error| format!("cannot look for {}: {error}", path.display()))? {
        return Err(exists(path).into());
    }
    let scanned = scan::find(&arguments.bus, false)?;
    let Scanned { text, has_starter, good, .. } = &scanned;
    if !has_starter {
        eprint!("{text}");
        return Err("no drive answers that a configuration could begin with: nothing is written".into());
    }
    write_new(path, text)?;
    let outcome = check(&Request { config: Some(path), mappings: &[], frames: false });
    let findings = &outcome.tables.findings;
    if findings.has_errors() {
        eprint!("{}", findings.shown(has_colours(&std::io::stderr()), Finding::asks));
        return Err(format!("{} is written, but has the errors above", path.display()).into());
    }
    let marks = findings.list().iter().filter(|finding| finding.code == code::PLACEHOLDER).count();
    let axes = outcome.config.map_or(0, |config| config.axes.len());
    let file = path.display();
    let summary = format!(
        "{file}: {axes} {}, {marks} lines marked CHANGE\n\
         Edit these lines, then:\n    axisbridge check --config {file}\n    axisbridge run --config {file}\n",
        if axes == 1 { "axis" } else { "axes" },
    );
    if !good {
        eprintln!("warning: something is odd on the bus: the remarks at the head of {file} say what");
    }
    print(summary, if *good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn exists(path: &Path) -> String {
    format!("{} exists already and is not overwritten: name another file with --output", path.display())
}

/// Writes a file that is not there yet.
fn write_new(path: &Path, text: &str) -> Result<(), CliError> {
    let mut file =
        OpenOptions::new().write(true).create_new(true).open(path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => exists(path),
            _ => format!("cannot write {}: {error}", path.display()),
        })?;
    file.write_all(text.as_bytes())
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}
