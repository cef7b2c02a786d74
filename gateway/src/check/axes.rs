//! What the tables make of the axes of a configuration: programs, ranges, precision.

use profile_generic::parameter::Parameter;

use crate::config::file::AxisTable;
use crate::config::{Axis, AxisFunction, AxisKind, Written};
use crate::engine::build::scaling;
use crate::engine::build::sercos::needs;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source};
use crate::mapping::check::axes::{describe, obedient, short};
use crate::mapping::{DriveProgram, Mapping, RowNumbers, SercosAxis, SercosError};

/// Nanounits, and parts per million, in the unit in which a configuration has its limits.
const NANO: f64 = 1e9;
const PERCENT: f64 = 1e4;

/// Looks at each axis of a configuration.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    for (axis, table) in written.config.axes.iter().zip(&written.file.axis) {
        let table = table.get_ref();
        let scaling = scaling(axis);
        ends(axis, table, &written.text, findings);
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
        match obedient(mapping, &needs) {
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

/// A linear axis that does not unwind has an end, and limits that keep it from there.
fn ends(axis: &Axis, table: &AxisTable, text: &Source, findings: &mut Findings) {
    let has_end =
        axis.function == AxisFunction::Drive && axis.kind == AxisKind::Linear && axis.unwind_counts.is_none();
    let limited = axis.limits.position_min.is_some() && axis.limits.position_max.is_some();
    let span = table.unit.span();
    if !has_end || limited || text.accepts(&span).is_some() {
        return;
    }
    let title = format!("the linear axis `{}` has no limits of its position", table.name.get_ref());
    let problem = Problem::new(code::LIMITS_MISSING, span).key("unit").title(title);
    let problem = problem.expected("nothing stops a command beyond its end");
    let help = "add `position_min` and `position_max` to [axis.limits]; of an axis without an end, write `# accept: no end`";
    findings.push(text, problem.help(help));
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
                let problem = Problem::new(code::LIMIT_UNFIT, value.span()).key(key).expected(message);
                findings.push(text, problem.about(format!("{} {key}", table.name.get_ref())));
                break;
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
            let message =
                format!("the drive ends at {} and {}: commands beyond are clamped", short(low), short(high));
            findings.push(
                text,
                Problem::new(code::RANGE_LOST, value.span())
                    .key(key)
                    .title(title)
                    .expected(message)
                    .about(format!("{} {key}", table.name.get_ref())),
            );
        }
    }
}
