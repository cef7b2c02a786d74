//! What a repository with tables of its own tests about them: an example, and a test of what this crate offers for it.
//!
//! The tables are a folder as the program takes it, with an overlay for one machine. Copy this file, and write what your machine
//! needs in place of the values here.

use std::path::PathBuf;

use mappings::check::{Outcome, check};
use mappings::finding::Severity;
use mappings::{AxisUnits, Mapping, SercosAxis};
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tables"))
}

fn overlay() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/own_tables/line-9.toml"))
}

/// A rotary axis in position control on a drive that the tables scale.
fn axis() -> SercosAxis {
    SercosAxis {
        units: AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() },
        modes: [OperatingMode::Position.into()].into_iter().collect(),
        set_scaling: true,
        ..SercosAxis::default()
    }
}

#[test]
fn the_tables_have_no_error_and_no_warning() {
    let Outcome { findings, overlays, examples, .. } = check(Some(&folder()), &[overlay()]);
    assert_eq!(findings.count(Severity::Error), 0, "{findings}");
    assert_eq!(findings.count(Severity::Warning), 0, "{findings}");
    assert_eq!(overlays, 1);
    assert!(examples > 0, "no worked example was run");
}

#[test]
fn the_window_is_written_as_the_drive_counts_it() {
    let mapping = Mapping::load(Some(&folder()), &[overlay()]).unwrap();
    let facts = mapping.facts_of_obedient(&axis()).unwrap();
    let program = mapping.sercos_program(&axis(), &facts).unwrap();
    let window = program.parameter(Parameter::IN_POSITION_WINDOW).unwrap();
    assert_eq!(window.item, Idn::standard(57).into());
    // A quarter of a turn in nanoturns; the drive has 3 600 000 counts in a turn.
    let (bytes, len, clamped) = window.encode(250_000_000).unwrap();
    assert_eq!((&bytes[..len], clamped), (900_000_i32.to_le_bytes().as_slice(), false));
}

#[test]
fn a_jerk_limit_is_refused_where_the_drive_has_none() {
    let mapping = Mapping::load(Some(&folder()), &[overlay()]).unwrap();
    let mut facts = mapping.facts_of_obedient(&axis()).unwrap();
    facts.note_missing(Idn::standard(349));
    let program = mapping.sercos_program(&axis(), &facts).unwrap();
    assert!(program.rejects(Parameter::JERK_LIMIT));
    let shipped = Mapping::embedded().unwrap().sercos_program(&axis(), &facts).unwrap();
    assert!(!shipped.rejects(Parameter::JERK_LIMIT), "as shipped it is kept without effect");
}
