//! What `axisbridge check` does: reads tables, overlays and a configuration, and finds what is wrong with them beyond what
//! keeps them from being read.
//!
//! The loader, the resolvers and the configuration find what is wrong with a row or a key ([`crate::finding`]). What can be seen
//! only in the whole stands here, one file per question.

mod attributes;
mod axes;
mod bus;
mod faults;
mod rows;
pub mod schema;
mod states;

use std::path::{Path, PathBuf};

use crate::config::Written;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::mapping::{Mapping, TableTexts};

/// What is to be checked.
#[derive(Debug, Default)]
pub struct Request<'a> {
    /// The configuration of a box; its tables and overlays come first.
    pub config: Option<&'a Path>,
    /// Folders of tables in place of the built-in ones, overlays and folders of overlays.
    pub mappings: &'a [PathBuf],
}

/// What was checked, and what was found.
#[derive(Debug, Default)]
pub struct Outcome {
    /// What was found.
    pub findings: Findings,
    /// How many overlays were laid over the tables.
    pub overlays: usize,
    /// How many worked examples came out or did not.
    pub examples: usize,
    /// How many axes the configuration has.
    pub axes: usize,
}

/// Checks.
#[must_use]
pub fn check(request: &Request<'_>) -> Outcome {
    let mut outcome = Outcome::default();
    let findings = &mut outcome.findings;
    let written = request.config.and_then(|path| Written::load(path, findings));
    let Some(texts) = texts(request, written.as_ref(), findings) else { return outcome };
    outcome.overlays = texts.overlays.len();
    outcome.axes = written.as_ref().map_or(0, |written| written.config.axes.len());
    if let Some(mapping) = Mapping::resolve(&texts, findings) {
        outcome.examples = mapping.run_examples(findings);
        tables(&mapping, findings);
        if let Some(written) = &written {
            axes::check(&mapping, written, findings);
            bus::check(&mapping, written, findings);
        }
    }
    outcome
}

/// The texts of the tables; `None` when some cannot be read.
fn texts(request: &Request<'_>, written: Option<&Written>, findings: &mut Findings) -> Option<TableTexts> {
    let before = findings.count(code::UNREADABLE.severity());
    let config = written.map(|written| &written.config);
    let mut folder = config.and_then(|config| config.mappings_dir.clone());
    let mut overlays = config.map(|config| config.overlays.clone()).unwrap_or_default();
    for path in request.mappings {
        if TableTexts::replaces(path) {
            folder = Some(path.clone());
        } else {
            overlays.push(path.clone());
        }
    }
    match TableTexts::load(folder.as_deref(), &overlays) {
        Ok(texts) => Some(texts).filter(|_| findings.count(code::UNREADABLE.severity()) == before),
        Err(found) => {
            findings.extend(found);
            None
        }
    }
}

/// What can be seen in the tables alone, beyond what keeps them from being read.
pub fn tables(mapping: &Mapping, findings: &mut Findings) {
    attributes::check(mapping, findings);
    faults::check(mapping, findings);
    states::check(mapping, findings);
    rows::check(mapping, findings);
    axes::tables(mapping, findings);
}
