//! What a count is, computed once by the tables and once by the formulas of the standards.

pub(super) mod sercos;

use profile_generic::ratio::Ratio;

use super::super::axes::short;
use super::Reporter;
use super::facts::{CIA402_UNITS, DISPLACEMENTS, FACTORS, SCALED_UNITS, TURN, UNITS};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{WRONG_SCALE, WRONG_SHAFT};
use crate::format::{Cia402MethodRow, RatioRow, UnitRow};

/// Ratios of the tables are rounded to 64 bits; a wrong one is off by far more.
const TOLERANCE: f64 = 1e-9;

fn units(reporter: &mut Reporter<'_>, rows: &[UnitRow]) {
    for row in rows {
        let name = row.unit.get_ref().as_str();
        if row.reciprocal {
            // One over it are seconds, which the generic model counts in nanoseconds.
            ratio(reporter, name, &row.generic_per_unit, 1e9);
        } else if let Some((_, right)) = UNITS.iter().find(|(known, _)| *known == name) {
            ratio(reporter, name, &row.generic_per_unit, *right);
        }
    }
}

/// What each unit measures.
fn measures(reporter: &mut Reporter<'_>, rows: &[UnitRow], facts: &[(&str, &str)]) {
    for row in rows {
        let fact = facts.iter().find(|(unit, _)| unit == row.unit.get_ref());
        let Some((unit, right)) = fact.filter(|(_, right)| row.quantity.get_ref() != right) else { continue };
        let what = [
            format!("`{unit}` measures a {}", row.quantity.get_ref()),
            format!("expected `{right}`"),
            format!("write `quantity = \"{right}\"`"),
        ];
        reporter.report(WRONG_SCALE, ("quantity", row.quantity.span()), what);
    }
}

/// A ratio as a number; no number where it is none.
fn quotient(num: i64, den: i64) -> f64 {
    Ratio::new(num, den).map_or(f64::NAN, |ratio| ratio.to_f64(1))
}

fn ratio(reporter: &mut Reporter<'_>, name: &str, given: &RatioRow, right: f64) {
    let [num, den] = *given.get_ref();
    let value = quotient(num, den);
    let off = value / right;
    if (off - 1.0).abs() <= TOLERANCE {
        return;
    }
    let what = [
        format!("`{name}` has the wrong scale"),
        format!("one {name} is {right:.9e} generic units, not {value:.9e}: {} times", short(off)),
        "correct the ratio".to_owned(),
    ];
    reporter.report(WRONG_SCALE, ("generic_per_unit", given.span()), what);
}

pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    for row in &file.rows.unit {
        let name = row.unit.get_ref().as_str();
        let given = row.times.as_ref().map(|name| name.get_ref().as_str());
        let right = SCALED_UNITS.iter().find(|(known, _)| *known == name).map(|(_, times)| *times);
        if right.is_some() {
            ratio(&mut reporter, name, &row.generic_per_unit, 1.0);
        }
        if given != right && (right.is_some() || UNITS.iter().any(|(known, _)| *known == name)) {
            let what = [
                format!("`{name}` follows another scaling of the axis"),
                format!("expected {}", right.unwrap_or("none")),
                right.map_or_else(
                    || "remove `times`".to_owned(),
                    |right| format!("write `times = \"{right}\"`"),
                ),
            ];
            reporter.report(WRONG_SCALE, ("unit", row.unit.span()), what);
        }
    }
    for row in &file.rows.displacement_unit {
        let code = row.code.get_ref();
        let end = code.rsplit(' ').next().unwrap_or_default();
        let Some((_, right)) = DISPLACEMENTS.iter().find(|(known, _)| *known == end) else { continue };
        let turns = if end.starts_with("Rev") { "rotary" } else { "linear" };
        if row.kind.get_ref() != turns {
            let what = [
                format!("`{code}` is taken for a {} unit", row.kind.get_ref()),
                format!("it is {turns}"),
                format!("write `kind = \"{turns}\"`"),
            ];
            reporter.report(WRONG_SCALE, ("kind", row.kind.span()), what);
        }
        let given = quotient(*row.nanounits.get_ref(), 1);
        if (given / right - 1.0).abs() > TOLERANCE {
            let what = [
                format!("`{code}` has the wrong scale"),
                format!("it is {right:.9e} nanounits, not {given:.9e}: {} times", short(given / right)),
                format!("write `nanounits = {right:.0}`"),
            ];
            reporter.report(WRONG_SCALE, ("nanounits", row.nanounits.span()), what);
        }
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    measures(&mut reporter, &file.rows.unit, CIA402_UNITS);
    for row in &file.rows.scaling {
        let unit = row.unit.get_ref().as_str();
        for method in &row.methods {
            if let Some((base, right)) = method.base.as_ref().zip(base(unit, method)) {
                ratio(&mut reporter, &method.name, base, right);
            }
            factors(&mut reporter, &method.name, method);
        }
    }
}

/// What a method of CiA 402 counts from, in generic units.
fn base(unit: &str, method: &Cia402MethodRow) -> Option<f64> {
    if let Some((object, code)) = &method.when {
        return (object.get_ref() == "60A9:00").then(|| coded(*code)).flatten();
    }
    match unit {
        "position" => Some(TURN),
        "vl velocity" => Some(TURN / 60.0),
        "permille of rated torque" => Some(1e3),
        _ => None,
    }
}

/// A unit of velocity by its code: power of ten, numerator, denominator, each a byte from the top.
fn coded(code: i64) -> Option<f64> {
    let [_, denominator, numerator, power] = u32::try_from(code).ok()?.to_le_bytes();
    let power = i32::from(i8::from_le_bytes([power]));
    let seconds = match (numerator, denominator) {
        (0xB4, 0x47) => 60.0,
        (0xB4, 0x03) => 1.0,
        _ => return None,
    };
    Some(TURN * 10_f64.powi(power) / seconds)
}

/// The ratios of the factor group stand the right way round, and whole.
fn factors(reporter: &mut Reporter<'_>, name: &str, method: &Cia402MethodRow) {
    let has = |list: &[crate::format::Name], object: &str| list.iter().any(|name| name.get_ref() == object);
    for (times, over) in FACTORS {
        let right = has(&method.times, times) && has(&method.over, over);
        let anywhere = |object: &str| has(&method.times, object) || has(&method.over, object);
        if right && !has(&method.over, times) && !has(&method.times, over)
            || !anywhere(times) && !anywhere(over)
        {
            continue;
        }
        let place = method
            .times
            .iter()
            .chain(&method.over)
            .find(|object| [*times, *over].contains(&object.get_ref().as_str()));
        let Some(place) = place else { continue };
        let what = [
            format!("the method `{name}` has a ratio of the factor group the wrong way round"),
            format!("a count is multiplied by {times} and divided by {over}"),
            format!("write {times} in `times` and {over} in `over`"),
        ];
        reporter.report(WRONG_SHAFT, ("times", place.span()), what);
    }
}
