//! What is wrong with tables beyond what keeps them from being read.
//!
//! The loader and the resolvers find what is wrong with a row or a key ([`crate::finding`]). What can be seen only in the whole
//! stands here, one file per question.

mod attributes;
pub mod axes;
mod computed;
pub mod diff;
mod faults;
mod page;
mod rows;
pub mod schema;
mod states;
mod trade;
mod vendor;

use std::path::{Path, PathBuf};

pub use page::{escaped, page};

use crate::finding::Findings;
use crate::{Mapping, TableTexts};

/// What was checked, and what was found.
#[derive(Debug, Default)]
pub struct Outcome {
    /// The texts of the tables, where they could be read.
    pub texts: Option<TableTexts>,
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

/// Checks the tables in a folder, or those built in, with overlays over them.
#[must_use]
pub fn check(folder: Option<&Path>, overlays: &[PathBuf]) -> Outcome {
    let mut findings = Findings::default();
    let read = TableTexts::load(folder, overlays).map_err(|found| findings.extend(found)).ok();
    texts(read, findings)
}

/// Checks the tables in these texts; `findings` are those made while they were read.
#[must_use]
pub fn texts(texts: Option<TableTexts>, findings: Findings) -> Outcome {
    let mut outcome = Outcome { texts, findings, ..Outcome::default() };
    let findings = &mut outcome.findings;
    if let Some(texts) = &outcome.texts {
        outcome.overlays = texts.overlays.len();
        outcome.mapping = Mapping::resolve(texts, findings);
    }
    if let Some(mapping) = &outcome.mapping {
        outcome.families = mapping.families().len();
        outcome.examples = mapping.run_examples(findings);
        let mut walks = states::Walks::of(mapping);
        for_all_drives(mapping, &mut walks, findings);
        mapping.families().iter().for_each(|family| for_cia402(&family.mapping, &mut walks, findings));
    }
    findings.settle();
    outcome
}

/// What can be seen in the tables alone, beyond what keeps them from being read.
pub fn tables(mapping: &Mapping, findings: &mut Findings) {
    for_all_drives(mapping, &mut states::Walks::of(mapping), findings);
}

fn for_all_drives(mapping: &Mapping, walks: &mut states::Walks, findings: &mut Findings) {
    attributes::check(mapping, findings);
    faults::check(mapping, findings);
    states::check(mapping, walks, findings);
    rows::check(mapping, findings);
    vendor::bindings(mapping, findings);
    computed::bindings(mapping, findings);
    axes::sercos(mapping, findings);
    trade::check(mapping, findings);
    for_cia402(mapping, walks, findings);
}

/// What depends on the rows for CiA 402 drives, of which a family can have its own.
fn for_cia402(mapping: &Mapping, walks: &mut states::Walks, findings: &mut Findings) {
    faults::cia402(mapping, findings);
    states::cia402(mapping, walks, findings);
    rows::cia402(mapping, findings);
    axes::cia402(mapping, findings);
    trade::cia402(mapping, findings);
}
