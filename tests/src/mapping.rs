//! Mappings that many tests need: each is read and compiled once in a process, which takes longer than most scenarios run.

use std::sync::{Mutex, PoisonError};

use axisbridge::finding::Findings;
use axisbridge::mapping::{Mapping, Overlay, TableTexts};

/// What was compiled, by the texts of its overlays.
static COMPILED: Mutex<Vec<(Vec<String>, Mapping)>> = Mutex::new(Vec::new());

/// The shipped tables.
///
/// # Panics
/// They are not sound.
#[must_use]
pub fn shipped() -> Mapping {
    with_overlays(&[])
}

/// The shipped tables with overlays.
///
/// # Panics
/// A check finds an error.
#[must_use]
pub fn with_overlays(overlays: &[&str]) -> Mapping {
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, mapping)) = compiled.iter().find(|(known, _)| known == overlays) {
        return mapping.clone();
    }
    let mapping = compile(overlays);
    compiled.push((overlays.iter().map(|text| (*text).to_owned()).collect(), mapping.clone()));
    mapping
}

fn compile(overlays: &[&str]) -> Mapping {
    let mut texts = TableTexts::embedded();
    texts.overlays = overlays.iter().map(|text| Overlay::new("own.toml", text)).collect();
    let mut findings = Findings::default();
    let mapping = Mapping::resolve(&texts, &mut findings);
    assert!(!findings.has_errors(), "{findings}");
    mapping.expect("the tables are sound")
}
