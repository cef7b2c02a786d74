//! What `axisbridge check` does: reads tables, overlays and a configuration, and finds what is wrong with them beyond what
//! keeps them from being read.
//!
//! The loader, the resolvers and the configuration find what is wrong with a row or a key ([`crate::finding`]). What can be seen
//! only in the whole stands here, one file per question.

mod attributes;
mod axes;
mod bus;
mod can_bus;
mod devicenet_bus;
mod faults;
mod page;
mod rows;
pub mod schema;
mod states;

use std::path::{Path, PathBuf};

pub use page::page;

use crate::config::{Config, Written};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
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
    /// The texts of the tables, where they could be read.
    pub texts: Option<TableTexts>,
    /// The configuration, where there is one without errors.
    pub config: Option<Config>,
    /// The tables, where they could be resolved.
    pub mapping: Option<Mapping>,
    /// What was found.
    pub findings: Findings,
    /// How many overlays were laid over the tables.
    pub overlays: usize,
    /// How many families of drives have rows of their own.
    pub families: usize,
    /// How many worked examples came out or did not.
    pub examples: usize,
}

/// Checks.
#[must_use]
pub fn check(request: &Request<'_>) -> Outcome {
    let mut outcome = Outcome::default();
    let findings = &mut outcome.findings;
    let written = request.config.and_then(|path| Written::load(path, findings));
    if let Some(texts) = texts(request, written.as_ref(), findings) {
        outcome.overlays = texts.overlays.len();
        outcome.mapping = Mapping::resolve(&texts, findings);
        outcome.families = outcome.mapping.as_ref().map_or(0, |mapping| mapping.families().len());
        outcome.texts = Some(texts);
    }
    if let Some(mapping) = &outcome.mapping {
        outcome.examples = mapping.run_examples(findings);
        tables(mapping, findings);
        mapping.families().iter().for_each(|family| tables(&family.mapping, findings));
        if let Some(written) = &written {
            axes::check(mapping, written, findings);
            bus::check(mapping, written, findings);
            can_bus::check(mapping, written, findings);
            devicenet_bus::check(mapping, written, findings);
        }
    }
    outcome.config = written.map(|written| written.config);
    outcome
}

/// The texts of the tables; `None` when some cannot be read.
fn texts(request: &Request<'_>, written: Option<&Written>, findings: &mut Findings) -> Option<TableTexts> {
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
    if let Some(written) = written {
        named(written, findings);
    }
    TableTexts::load(folder.as_deref(), &overlays).map_err(|found| findings.extend(found)).ok()
}

/// Marks what the configuration names and is not there.
fn named(written: &Written, findings: &mut Findings) {
    let Some(table) = &written.file.mappings else { return };
    let config = &written.config;
    let names = table.dir.iter().chain(&table.overlays);
    let missing =
        names.zip(config.mappings_dir.iter().chain(&config.overlays)).filter(|(_, path)| !path.exists());
    for (name, _) in missing {
        findings.push(
            &written.text,
            Problem::new(code::UNREADABLE, name.span()).expected("expected a file or folder that is there"),
        );
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
