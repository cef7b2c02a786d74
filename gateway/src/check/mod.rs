//! What `axisbridge check` does: reads tables, overlays and a configuration, and finds what is wrong with them beyond what
//! keeps them from being read.
//!
//! The loader, the resolvers and the configuration find what is wrong with a row or a key ([`crate::finding`]); what can be seen
//! in the tables as a whole, [`crate::mapping::check`] finds. What a configuration makes of them stands here, one file per
//! question.

mod axes;
mod bus;
mod can_bus;
mod data_sheet;
mod devicenet_bus;
mod frames;
mod http;
mod marks;
mod modbus;
pub mod schema;
mod startup;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::config::{Config, Named, Written};
use crate::finding::Findings;
use crate::mapping::{self, Mapping, TableTexts};

/// What is to be checked.
#[derive(Debug, Default)]
pub struct Request<'a> {
    /// The configuration of a box; its tables and overlays come first.
    pub config: Option<&'a Path>,
    /// Folders of tables in place of the built-in ones, overlays and folders of overlays.
    pub mappings: &'a [PathBuf],
    /// Whether frames are sent through the gateway with the tables.
    pub frames: bool,
}

/// What was checked, and what was found.
#[derive(Debug, Default)]
pub struct Outcome {
    /// What the tables came to, and everything that was found, in the configuration as well.
    pub tables: mapping::check::Outcome,
    /// The configuration, where there is one without errors.
    pub config: Option<Config>,
    /// Its text.
    pub text: Option<Arc<str>>,
    /// How many facts were shown by frames.
    pub frames: usize,
}

/// Checks the tables, the overlays and the configuration of a request. What is wrong is in the findings: what is wrong with the
/// configuration does not keep the tables that it names from being checked, nor the other way round.
#[must_use]
pub fn check(request: &Request<'_>) -> Outcome {
    let mut findings = Findings::default();
    let (written, named) = request.config.map(|path| Written::read(path, &mut findings)).unwrap_or_default();
    if let Some(named) = &named {
        marks::check(named, written.as_ref(), &mut findings);
    }
    let mut of_tables = Findings::default();
    let texts = texts(request, named.as_ref(), &mut of_tables);
    let mut tables = mapping::check::texts(texts, of_tables);
    if let Some(written) = &written {
        axes(&tables, written, &mut findings);
        http::check(written, &mut findings);
    }
    tables.findings.extend(findings);
    tables.findings.settle();
    // What is wrong with a row by itself says more than what comes of it.
    let mapping::check::Outcome { mapping, findings, .. } = &mut tables;
    let shown = mapping.as_ref().filter(|_| request.frames && !findings.has_errors());
    let frames = shown.map_or(0, |mapping| frames::check(mapping, findings));
    let text = written.as_ref().and_then(|written| written.text.first());
    Outcome { tables, config: written.map(|written| written.config), text, frames }
}

/// What the tables make of a configuration. Of tables in which something is wrong it counts only where it is so with the
/// shipped ones as well: the rest would only follow from the tables.
fn axes(tables: &mapping::check::Outcome, written: &Written, findings: &mut Findings) {
    let of = |mapping: &Mapping| {
        let mut findings = Findings::default();
        axes::check(mapping, written, &mut findings);
        bus::check(mapping, written, &mut findings);
        can_bus::check(mapping, written, &mut findings);
        data_sheet::check(mapping, written, &mut findings);
        devicenet_bus::check(mapping, written, &mut findings);
        modbus::check(mapping, written, &mut findings);
        startup::check(mapping, written, &mut findings);
        findings
    };
    let own = tables.mapping.as_ref().map(of);
    if !tables.findings.has_errors() {
        return findings.extend(own.unwrap_or_default());
    }
    let mut with_shipped = Mapping::embedded().map(|mapping| of(&mapping)).unwrap_or_default();
    if let Some(own) = own {
        with_shipped.retain(|finding| own.list().contains(finding));
    }
    findings.extend(with_shipped);
}

/// The texts of the tables; `None` when some cannot be read.
fn texts(request: &Request<'_>, named: Option<&Named>, findings: &mut Findings) -> Option<TableTexts> {
    let (mut folder, mut overlays) = named.map(|named| named.there(findings)).unwrap_or_default();
    for path in request.mappings {
        if TableTexts::replaces(path) {
            folder = Some(path.clone());
        } else {
            overlays.push(path.clone());
        }
    }
    TableTexts::load(folder.as_deref(), &overlays).map_err(|found| findings.extend(found)).ok()
}
