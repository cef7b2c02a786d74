//! What a repository with tables of its own tests about them. Copy this file and the overlay beside it, and write what your
//! machine needs in place of the values here.

use std::path::PathBuf;

use mappings::check::{Outcome, check};
use mappings::finding::Severity;
use mappings::{AxisUnits, DriveFacts, DriveProgram, Mapping, SercosAxis};
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

/// The overlays of the machine, files or folders; `cargo test` runs in the folder of the crate.
fn overlays() -> [PathBuf; 1] {
    [PathBuf::from("tests/own_tables")]
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

/// The program of the axis on a drive that has everything but `missing`.
fn program(mapping: &Mapping, missing: &[Idn]) -> DriveProgram {
    let mut facts: DriveFacts = mapping.facts_of_obedient(&axis()).unwrap();
    missing.iter().for_each(|idn| facts.note_missing(*idn));
    mapping.sercos_program(&axis(), &facts).unwrap()
}

#[test]
fn the_tables_have_no_error_and_no_warning() {
    let Outcome { findings, overlays, examples, .. } = check(None, &overlays());
    assert_eq!(findings.count(Severity::Error), 0, "{findings}");
    assert_eq!(findings.count(Severity::Warning), 0, "{findings}");
    assert_eq!(overlays, 1);
    assert!(examples > 0, "no worked example was run");
}

#[test]
fn the_window_is_written_in_counts_of_the_drive() {
    let mapping = Mapping::load(None, &overlays()).unwrap();
    let program = program(&mapping, &[]);
    let window = program.parameter(Parameter::IN_POSITION_WINDOW).unwrap();
    assert_eq!(window.item, Idn::POSITION_WINDOW.into());
    // A quarter of a turn in nanoturns; the drive has 3 600 000 counts in a turn.
    let (bytes, len, clamped) = window.encode(250_000_000).unwrap();
    assert_eq!((&bytes[..len], clamped), (900_000_i32.to_le_bytes().as_slice(), false));
}

#[test]
fn the_jerk_limit_of_the_drive_is_only_read() {
    let writes = |mapping: &Mapping| {
        let program = program(mapping, &[]);
        program.parameter(Parameter::JERK_LIMIT).unwrap().to_drive.is_some()
    };
    assert!(!writes(&Mapping::load(None, &overlays()).unwrap()));
    assert!(writes(&Mapping::embedded().unwrap()), "as shipped a controller may set it");
}

#[test]
fn a_drive_without_a_jerk_limit_has_no_such_parameter() {
    let own = Mapping::load(None, &overlays()).unwrap();
    assert!(program(&own, &[Idn::standard(349)]).parameter(Parameter::JERK_LIMIT).is_none());
}

#[test]
fn the_row_of_the_jerk_limit_is_the_one_of_the_overlay() {
    let own = Mapping::load(None, &overlays()).unwrap();
    let row = own.parameter_row(Parameter::JERK_LIMIT).unwrap();
    assert_eq!(row.to_string(), "line-9.toml:8 [[parameter]] jerk_limit");
}
