//! What `axisbridge check` does: reads tables, overlays and a configuration, and finds what is wrong with them beyond what
//! keeps them from being read.
//!
//! The loader, the resolvers and the configuration find what is wrong with a row or a key ([`crate::finding`]); what can be seen
//! in the tables as a whole, [`crate::mapping::check`] finds. What a configuration makes of them stands here, one file per
//! question.

mod axes;
mod bus;
mod can_bus;
mod devicenet_bus;
pub mod schema;

use std::path::{Path, PathBuf};

use crate::config::{Config, Written};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::mapping::{self, TableTexts};

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
    /// What the tables came to, and everything that was found, in the configuration as well.
    pub tables: mapping::check::Outcome,
    /// The configuration, where there is one without errors.
    pub config: Option<Config>,
}

/// Checks.
#[must_use]
pub fn check(request: &Request<'_>) -> Outcome {
    let mut findings = Findings::default();
    let written = request.config.and_then(|path| Written::load(path, &mut findings));
    let texts = texts(request, written.as_ref(), &mut findings);
    let mut tables = mapping::check::texts(texts, findings);
    if let (Some(mapping), Some(written)) = (&tables.mapping, &written) {
        let findings = &mut tables.findings;
        axes::check(mapping, written, findings);
        bus::check(mapping, written, findings);
        can_bus::check(mapping, written, findings);
        devicenet_bus::check(mapping, written, findings);
    }
    Outcome { tables, config: written.map(|written| written.config) }
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
