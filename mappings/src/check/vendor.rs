//! Parameters that overlays define: each leads from an attribute to a drive, and both ends hold its range.

use std::ops::Range;

use profile_generic::quantity::Quantity;

use crate::attributes::Backing;
use crate::computed::Computation;
use crate::dictionary::GenericParameter;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source};
use crate::format::Name;
use crate::{CipScaling, DriveProgram, Mapping};

/// The parameters of vendors with their names where they are defined.
fn defined(mapping: &Mapping) -> impl Iterator<Item = (&GenericParameter, &Name)> {
    let rows = &mapping.tables().generic.rows.parameter;
    let name =
        |row: &GenericParameter| rows.iter().map(|row| &row.name).find(|name| *name.get_ref() == row.name);
    let parameters = mapping.dictionaries.generic.parameters().iter();
    parameters.filter(|row| row.parameter.is_of_vendor()).filter_map(move |row| Some((row, name(row)?)))
}

/// Whether each has an attribute, and a place in a drive.
pub(super) fn bindings(mapping: &Mapping, findings: &mut Findings) {
    let tables = mapping.tables();
    let of_families = mapping.families().iter().map(|family| &family.mapping);
    let cia402: Vec<_> =
        of_families.chain([mapping]).map(|known| &known.tables().generic_cia402.rows).collect();
    let generic = &mapping.dictionaries.generic;
    for (row, name) in defined(mapping) {
        let is = |other: &Name| *other.get_ref() == row.name;
        let is_computed = generic.computation(row.parameter).is_some();
        let needs = |computation: &Computation| {
            let own = computation.rows.last().is_some_and(|last| last.parameter == row.parameter);
            let reads = computation.reads.iter().any(|read| read.parameter == Some(row.parameter));
            !own && (reads || computation.rows.iter().any(|known| known.parameter == row.parameter))
        };
        let is_operand = generic.computations().iter().any(needs);
        let attributes = &tables.cip_generic.rows.attribute;
        let north = is_operand || attributes.iter().any(|row| row.parameter.as_ref().is_some_and(is));
        let south = is_computed
            || tables.generic_sercos.rows.parameter.iter().any(|row| is(&row.parameter))
            || cia402.iter().any(|rows| rows.parameter.iter().any(|row| is(&row.parameter)));
        let expected = match (north, south) {
            (true, true) => continue,
            (false, _) => {
                "expected an [[attribute]] row of cip-generic with this parameter, or a computed value that uses it, got none"
            }
            (true, false) => {
                "expected a [[parameter]] row of generic-sercos or generic-cia402, or a [[computed]] row, got none"
            }
        };
        let problem = Problem::new(code::ROW_MISSING, name.span()).key("name");
        findings.push(&tables.generic.text, problem.expected(expected));
    }
}

/// Whether the range of each fits its attribute. What depends on the axis cannot be seen in the tables alone.
pub(super) fn attributes(mapping: &Mapping, scaling: &CipScaling, findings: &mut Findings) {
    let Some(table) = mapping.attribute_table(scaling) else { return };
    let file = &mapping.tables().cip_generic;
    for entry in table.entries() {
        let Backing::Parameter { parameter, .. } = entry.backing else { continue };
        let Some((row, (low, high))) = ranged(mapping, parameter.0) else { continue };
        let clamped = |value| entry.from_generic(value, &mut [0; 8]).is_ok_and(|(_, clamped)| clamped);
        let own = file.rows.attribute.iter();
        let mut own = own.filter_map(|known| known.parameter.as_ref());
        let Some(place) = own.find(|known| *known.get_ref() == row.name) else { continue };
        if clamped(low) || clamped(high) {
            let kind = entry.data_type.name();
            let message = format!("{low} to {high} {} do not fit a {kind}", row.quantity.unit());
            let problem = Problem::new(code::OUT_OF_RANGE, place.span()).key("parameter");
            findings.push(&file.text, problem.expected(message));
        }
    }
}

/// Whether the drive's value holds the range; `place` is where the row says which value that is.
pub(super) fn held(
    mapping: &Mapping,
    program: &DriveProgram,
    (text, key): (&Source, &'static str),
    place: impl Fn(&str) -> Option<Range<usize>>,
    findings: &mut Findings,
) {
    for entry in program.parameters() {
        let Some((row, (low, high))) = ranged(mapping, entry.parameter.0) else { continue };
        let clamped = |value| entry.encode(value).is_some_and(|(.., clamped)| clamped);
        let Some(span) = place(&row.name).filter(|_| clamped(low) || clamped(high)) else { continue };
        let (unit, bytes) = (row.quantity.unit(), entry.width.bytes());
        let message = format!("{low} to {high} {unit} do not fit the {bytes} bytes of {}", entry.item);
        findings.push(text, Problem::new(code::OUT_OF_RANGE, span).key(key).expected(message));
    }
}

/// A vendor's parameter with a range that does not depend on the scaling of an axis.
fn ranged(mapping: &Mapping, number: u16) -> Option<(&GenericParameter, (i64, i64))> {
    let parameters = mapping.dictionaries.generic.parameters().iter();
    let row = parameters.rev().find(|row| row.parameter.0 == number)?;
    let scaled = [Quantity::Position, Quantity::Velocity, Quantity::Acceleration, Quantity::Jerk];
    Some((row, row.range?)).filter(|_| !scaled.contains(&row.quantity))
}
