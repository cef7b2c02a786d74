//! What the tables make of a turning and a sliding axis: programs, ranges, precision.

use std::ops::Range;

use profile_generic::image::Signal;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;

use super::{computed, vendor};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source};
use crate::{
    AxisUnits, Cia402Axis, CipScaling, DriveFacts, DriveProgram, Mapping, ObjectFacts, RowNumbers,
    SercosAxis, SercosError,
};

/// The program behind a drive that takes all that is written to it.
///
/// # Errors
/// None can be made of the tables.
pub fn obedient(mapping: &Mapping, needs: &SercosAxis) -> Result<DriveProgram, SercosError> {
    let facts = mapping.facts_of_obedient(needs)?;
    mapping.sercos_program(needs, &facts)
}

/// What a row can hold, in words.
#[must_use]
pub fn describe(row: &RowNumbers) -> String {
    let mut text = match row.range {
        Some((low, high)) => format!("{} to {} {}", short(low), short(high), row.unit),
        None => format!("without ends, in {}", row.unit),
    };
    text.push_str(&format!(", in steps of {}", short(row.step)));
    if let Some(exact) = row.float_exact {
        text.push_str(&format!("; a floating point number tells them apart up to {}", short(exact)));
    }
    text
}

/// A number with the digits that matter.
#[must_use]
pub fn short(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-3..1e7).contains(&magnitude) {
        let digits: usize = if magnitude >= 1_000.0 {
            1
        } else if magnitude >= 1.0 {
            4
        } else {
            7
        };
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.4e}")
    }
}

/// Counts that a CiA 402 drive has in a turn, or in 10 mm, where no drive is known: an encoder of 20 bits, a spindle.
const COUNTS_OF_A_TURN: i64 = 1 << 20;
const WAY_OF_A_TURN: i64 = 10;
/// Parts per million of the rated torque in a count.
const TORQUE_COUNT: i64 = 1_000;

/// A turning and a sliding axis with the usual resolution.
fn axes() -> [CipScaling; 2] {
    [UnitKind::Rotary, UnitKind::Linear].map(|kind| CipScaling {
        kind,
        nanounits_per_unit: profile_generic::scaling::NANO,
        counts_per_unit: 10_000,
        inverted: false,
        unwind: None,
    })
}

/// Makes programs of the tables alone for SERCOS drives that are scaled by the box.
pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    axes().iter().for_each(|scaling| sercos_axis(mapping, scaling, findings));
}

/// The same for CiA 402 drives that count in increments of their encoder.
pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    axes().iter().for_each(|scaling| cia402_axis(mapping, scaling, findings));
}

fn sercos_axis(mapping: &Mapping, scaling: &CipScaling, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let axis = SercosAxis {
        units: AxisUnits { kind: scaling.kind, ..AxisUnits::default() },
        modes: mapping.drive_modes().collect(),
        set_scaling: true,
        ..SercosAxis::default()
    };
    let made = mapping.telegram(&axis, &DriveFacts::new()).and_then(|_| obedient(mapping, &axis));
    let place = |row: &RowNumbers| {
        let rows = &file.rows;
        let signal = rows.signal.iter().find(|known| row.is_signal && *known.signal.get_ref() == row.name);
        let mut parameters = rows.parameter.iter();
        let parameter = parameters.find(|known| !row.is_signal && *known.parameter.get_ref() == row.name);
        signal.map(|known| known.idn.span()).or(parameter.map(|known| known.idn.span()))
    };
    match made {
        Ok(program) => {
            rows(mapping, scaling, &program, (&file.text, "idn"), place, findings);
            if scaling.kind == UnitKind::Rotary {
                let rows = || file.rows.parameter.iter();
                let place =
                    |name: &str| rows().find(|row| row.parameter.get_ref() == name).map(|row| row.idn.span());
                vendor::attributes(mapping, scaling, findings);
                vendor::held(mapping, &program, (&file.text, "idn"), place, findings);
                computed::ranges(mapping, scaling, (&program, "generic-sercos"), findings);
            }
        }
        Err(error) => {
            none(scaling.kind, "", &error.to_string(), &file.text, file.rows.mapping.span(), findings)
        }
    }
}

fn cia402_axis(mapping: &Mapping, scaling: &CipScaling, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let unit = match scaling.kind {
        UnitKind::Rotary => profile_generic::scaling::NANO,
        UnitKind::Linear => profile_generic::scaling::NANO * WAY_OF_A_TURN,
    };
    let Some(count) = Ratio::new(unit, COUNTS_OF_A_TURN) else { return };
    let axis = Cia402Axis {
        units: AxisUnits { kind: scaling.kind, ..AxisUnits::default() },
        modes: mapping.cia402.modes().collect(),
        way_of_a_turn: Ratio::new(WAY_OF_A_TURN, 1),
        counts: [Quantity::Position, Quantity::Velocity, Quantity::Acceleration]
            .map(|of| (of, count))
            .into_iter()
            .chain(Ratio::new(TORQUE_COUNT, 1).map(|ratio| (Quantity::Torque, ratio)))
            .collect(),
        offsets: Signal::OFFSETS.to_vec(),
        ..Cia402Axis::default()
    };
    let place = |row: &RowNumbers| {
        let rows = &file.rows;
        let signal = rows.signal.iter().find(|known| row.is_signal && *known.signal.get_ref() == row.name);
        let mut parameters = rows.parameter.iter();
        let parameter = parameters.find(|known| !row.is_signal && *known.parameter.get_ref() == row.name);
        signal.map(|known| known.object.span()).or(parameter.map(|known| known.object.span()))
    };
    match mapping.cia402_program(&axis, &ObjectFacts::new()) {
        Ok(program) => {
            rows(mapping, scaling, &program, (&file.text, "object"), place, findings);
            if scaling.kind == UnitKind::Rotary {
                let rows = || file.rows.parameter.iter();
                let place = |name: &str| {
                    rows().find(|row| row.parameter.get_ref() == name).map(|row| row.object.span())
                };
                vendor::held(mapping, &program, (&file.text, "object"), place, findings);
                computed::ranges(mapping, scaling, (&program, "generic-cia402"), findings);
            }
        }
        Err(error) => {
            none(
                scaling.kind,
                " with a CiA 402 drive",
                &error.to_string(),
                &file.text,
                file.rows.mapping.span(),
                findings,
            );
        }
    }
}

/// No program can be made of the tables.
fn none(
    kind: UnitKind,
    drive: &str,
    error: &str,
    text: &Source,
    span: Range<usize>,
    findings: &mut Findings,
) {
    let problem = Problem::new(code::AXIS_TABLES, span);
    let problem = problem.title(format!("no program can be made for a {kind} axis{drive}"));
    findings.push(text, problem.expected(error));
}

/// Range and precision of each row, at the row.
fn rows(
    mapping: &Mapping,
    scaling: &CipScaling,
    program: &DriveProgram,
    (text, key): (&Source, &'static str),
    place: impl Fn(&RowNumbers) -> Option<Range<usize>>,
    findings: &mut Findings,
) {
    let kind = scaling.kind;
    let unit = if kind == UnitKind::Rotary { "revolution" } else { "millimetre" };
    for row in mapping.row_numbers(scaling, program) {
        let Some(span) = place(&row) else { continue };
        let what = format!("in {} on a {kind} axis of 10000 counts in a {unit}", row.item);
        let problem = Problem::new(code::ROW_NUMBERS, span.clone()).key(key);
        findings.push(text, problem.title(format!("`{}` {what}", row.name)).expected(describe(&row)));
        if let Some(lost) = row.lost.filter(|lost| lost.most > 0.5) {
            let message = format!(
                "one count of the drive is {} of {}: {} comes back as {}",
                short(row.step),
                row.unit,
                lost.value,
                lost.back
            );
            let problem = Problem::new(code::PRECISION_LOST, span).key(key);
            let problem = problem.title(format!("`{}` loses precision {what}", row.name));
            findings.push(text, problem.expected(message));
        }
    }
}
