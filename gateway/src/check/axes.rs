//! What the tables make of the axes of a configuration: programs, ranges, precision.

use std::ops::Range;

use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;

use crate::config::Written;
use crate::config::file::AxisTable;
use crate::engine::build::scaling;
use crate::engine::build::sercos::needs;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source};
use crate::mapping::{
    AxisUnits, Cia402Axis, CipScaling, DriveFacts, DriveProgram, Mapping, ObjectFacts, RowNumbers,
    SercosAxis, SercosError,
};

/// Nanounits, and parts per million, in the unit in which a configuration has its limits.
const NANO: f64 = 1e9;
const PERCENT: f64 = 1e4;

/// Looks at each axis of a configuration.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    for (axis, table) in written.config.axes.iter().zip(&written.file.axis) {
        let table = table.get_ref();
        let scaling = scaling(axis);
        let mut problem = |problem: Problem| findings.push(&written.text, problem);
        if mapping.cip_program(&scaling).is_none() {
            let span = table.motion_resolution.as_ref().unwrap_or(&table.instance).span();
            let title = format!("no exact ratio for {} counts in a unit", scaling.counts_per_unit);
            problem(
                Problem::new(code::AXIS_TABLES, span).title(title).expected("expected one that fits 64 bits"),
            );
            continue;
        }
        // A CANopen drive is looked at with its bus.
        let Some(drive) = written.config.sercos_drive(axis) else { continue };
        let mut needs = needs(axis, drive);
        if !drive.set_scaling {
            let what = format!("the scaling of the drive `{}` is its own", drive.name);
            let problem_of = Problem::new(code::DRIVE_SCALING, table.drive.span()).title(what);
            problem(problem_of.expected("range and precision are not known before it is there"));
        }
        // With the drive's own scaling it can still be seen whether a program can be made at all.
        needs.set_scaling = true;
        match programs(mapping, &needs) {
            Ok(program) if drive.set_scaling => {
                let rows = mapping.row_numbers(&scaling, &program);
                numbers(&rows, table, &written.text, findings);
                limits(&program, &needs, table, &written.text, findings);
            }
            // Range and precision are the drive's own affair, and so is whether its scaling can be converted.
            Ok(_) => {}
            Err(SercosError::Scaling(_)) if !drive.set_scaling => {}
            Err(error) => {
                let title = format!("the tables make no program for the axis `{}`", table.name.get_ref());
                let problem = Problem::new(code::AXIS_TABLES, table.name.span()).title(title);
                findings.push(&written.text, problem.expected(error.to_string()));
            }
        }
    }
}

/// The program behind a drive that takes all that is written to it.
fn programs(mapping: &Mapping, needs: &SercosAxis) -> Result<DriveProgram, SercosError> {
    let facts = mapping.facts_of_obedient(needs)?;
    mapping.sercos_program(needs, &facts)
}

/// What the box writes into the drive at start fits there.
fn limits(
    program: &DriveProgram,
    needs: &SercosAxis,
    table: &AxisTable,
    text: &Source,
    findings: &mut Findings,
) {
    let Some(written) = &table.limits else { return };
    let keys = [
        (
            "acceleration",
            &written.acceleration,
            &[Parameter::ACCELERATION_LIMIT, Parameter::DECELERATION_LIMIT][..],
        ),
        (
            "torque_percent",
            &written.torque_percent,
            &[Parameter::TORQUE_LIMIT_POSITIVE, Parameter::TORQUE_LIMIT_NEGATIVE],
        ),
        ("following_error", &written.following_error, &[Parameter::POSITION_ERROR_TOLERANCE]),
    ];
    for (key, value, parameters) in keys {
        let Some(value) = value else { continue };
        for (parameter, generic) in needs.parameters.iter().filter(|(known, _)| parameters.contains(known)) {
            let Some((row, conversion)) =
                program.parameter(*parameter).and_then(|row| Some((row, row.to_drive?)))
            else {
                continue;
            };
            if conversion.convert(*generic).saturated {
                let count = conversion.within(i64::MIN, i64::MAX).convert(*generic).value;
                let message = format!(
                    "{} holds {} to {}, and this would be {count}",
                    row.item, conversion.min, conversion.max
                );
                findings.push(text, Problem::new(code::LIMIT_UNFIT, value.span()).key(key).expected(message));
            }
        }
    }
}

/// Range and precision of each row on an axis.
fn numbers(rows: &[RowNumbers], table: &AxisTable, text: &Source, findings: &mut Findings) {
    let place = table.motion_resolution.as_ref().map_or_else(|| table.name.span(), |value| value.span());
    for row in rows {
        let what = format!("{} `{}`", if row.is_signal { "signal" } else { "parameter" }, row.name);
        findings.push(
            text,
            Problem::new(code::ROW_NUMBERS, table.name.span())
                .title(format!("{what} in {}", row.item))
                .expected(describe(row)),
        );
        if let Some(lost) = row.lost {
            let title = format!("{what} loses precision in {}", row.item);
            let message = format!(
                "one count of the drive is {} of {}: {} comes back as {}, and values are off by up to {}",
                short(row.step),
                row.unit,
                lost.value,
                lost.back,
                short(lost.most)
            );
            findings.push(
                text,
                Problem::new(code::PRECISION_LOST, place.clone())
                    .key("motion_resolution")
                    .title(title)
                    .expected(message),
            );
        }
    }
    let Some(limits) = &table.limits else { return };
    let wanted = [
        ("position_min", &limits.position_min, "position_command", NANO),
        ("position_max", &limits.position_max, "position_command", NANO),
        ("velocity", &limits.velocity, "velocity_command", NANO),
        ("torque_percent", &limits.torque_percent, "torque_command", PERCENT),
    ];
    for (key, value, signal, scale) in wanted {
        let Some(value) = value else { continue };
        let Some(row) = rows.iter().find(|row| row.is_signal && row.name == signal) else { continue };
        let Some((low, high)) = row.generic_range else { continue };
        let (low, high) = (
            profile_generic::cast::f64_from_i64(low) / scale,
            profile_generic::cast::f64_from_i64(high) / scale,
        );
        if !(low..=high).contains(value.get_ref()) {
            let title = format!("`{key}` is beyond what the drive can hold in {}", row.item);
            let message = format!(
                "the drive ends at {} and {}: commands beyond are held there",
                short(low),
                short(high)
            );
            findings.push(
                text,
                Problem::new(code::RANGE_LOST, value.span()).key(key).title(title).expected(message),
            );
        }
    }
}

/// What a row can hold, in words.
fn describe(row: &RowNumbers) -> String {
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
pub(super) fn short(value: f64) -> String {
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

/// The same for the tables alone: a turning and a sliding axis with the usual resolution, SERCOS drives scaled by the box, and
/// CiA 402 drives that count in increments of their encoder.
pub(super) fn tables(mapping: &Mapping, findings: &mut Findings) {
    for kind in [UnitKind::Rotary, UnitKind::Linear] {
        let scaling = CipScaling {
            kind,
            nanounits_per_unit: profile_generic::scaling::NANO,
            counts_per_unit: 10_000,
            inverted: false,
            unwind: None,
        };
        sercos(mapping, &scaling, findings);
        cia402(mapping, &scaling, findings);
    }
}

fn sercos(mapping: &Mapping, scaling: &CipScaling, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let axis = SercosAxis {
        units: AxisUnits { kind: scaling.kind, ..AxisUnits::default() },
        modes: mapping.drive_modes().collect(),
        set_scaling: true,
        ..SercosAxis::default()
    };
    let made = mapping.telegram(&axis, &DriveFacts::new()).and_then(|_| programs(mapping, &axis));
    let place = |row: &RowNumbers| {
        let rows = &file.rows;
        let signal = rows.signal.iter().find(|known| row.is_signal && known.signal.get_ref() == row.name);
        let mut parameters = rows.parameter.iter();
        let parameter = parameters.find(|known| !row.is_signal && known.parameter.get_ref() == row.name);
        signal.map(|known| known.idn.span()).or(parameter.map(|known| known.idn.span()))
    };
    match made {
        Ok(program) => rows(mapping, scaling, &program, (&file.text, "idn"), place, findings),
        Err(error) => {
            none(scaling.kind, "", &error.to_string(), &file.text, file.rows.mapping.span(), findings)
        }
    }
}

fn cia402(mapping: &Mapping, scaling: &CipScaling, findings: &mut Findings) {
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
        let signal = rows.signal.iter().find(|known| row.is_signal && known.signal.get_ref() == row.name);
        let mut parameters = rows.parameter.iter();
        let parameter = parameters.find(|known| !row.is_signal && known.parameter.get_ref() == row.name);
        signal.map(|known| known.object.span()).or(parameter.map(|known| known.object.span()))
    };
    match mapping.cia402_program(&axis, &ObjectFacts::new()) {
        Ok(program) => rows(mapping, scaling, &program, (&file.text, "object"), place, findings),
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
