//! What the rows of SERCOS lack.

use profile_sercos::wire::idn::Idn;

use super::super::facts::{
    MODE_SLOTS, PARAMETERS, PROCEDURES, SERCOS_CAPTURES, SERCOS_CODES, SERCOS_EDGES, SERCOS_FAULTS,
    SERCOS_NUMBERS, SERCOS_READS, SERCOS_STATUS, SERCOS_STEPS, SERCOS_UNITS, SERCOS_WRITTEN, SIGNALS,
    SPELLINGS,
};
use super::{Table, by, capture, is, is_named, limits, mode, parameter, reads, signal, steps, units, values};
use crate::Mapping;
use crate::finding::Findings;
use crate::format::{CommissionRow, FieldIs, FieldValueRow, GenericSercosFile, SercosFaultRow, UnitRow};

pub(in super::super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let rows = &file.rows;
    let mut table = Table::new(&file.text, &rows.mapping, findings);
    unanswered(&mut table, mapping);
    parameters(&mut table, rows, mapping);
    status(&mut table, rows);
    faults(&mut table, rows);
    diagnostic_numbers(&mut table, rows);
    captures(&mut table, rows);
    spellings(&mut table, &rows.unit);
    units(&mut table, SERCOS_UNITS, &rows.unit);
    signals(&mut table, rows);
    modes(&mut table, rows);
    procedures(&mut table, rows);
    mode_slots(&mut table, rows);
    commissioning(&mut table, &rows.commission);
}

/// IDNs of the drive profile that are neither bound nor left out for a reason.
fn unanswered(table: &mut Table<'_>, mapping: &Mapping) {
    for idn in &mapping.sercos.unanswered {
        let name = mapping.dictionaries.sercos.idn(*idn).map_or("", |row| row.name.as_str());
        table.unanswered(&idn.to_string(), name);
    }
}

fn parameters(table: &mut Table<'_>, rows: &GenericSercosFile, mapping: &Mapping) {
    let (unanswered, unbound) = (&mapping.sercos.unanswered, &mapping.sercos.unbound);
    for binding in PARAMETERS.iter().filter(|binding| !binding.idns.is_empty()) {
        let of_binding = |idn: &Idn| binding.idns.contains(&idn.to_string().as_str());
        // What nobody answers for is reported as a whole.
        let excused = unanswered.iter().any(of_binding) || unbound.iter().any(|(idn, _)| of_binding(idn));
        if !excused && !rows.parameter.iter().any(|row| is(&row.parameter, binding.name)) {
            parameter(table, binding.name, binding.idns);
        }
    }
}

fn status(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (word, field, status) in SERCOS_STATUS {
        let has = rows.status.iter().any(|row| is(&row.word, word) && is_set(&row.pattern, field));
        let what = format!("the bit `{field}` of the word `{word}`");
        table.wants(has, "status", &what, &format!("`{status}` would never be seen"));
    }
}

/// Bits of the class diagnostics.
fn faults(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (field, cause) in SERCOS_FAULTS {
        let has = rows.fault.iter().any(|row| is_set(&row.pattern, field));
        let why = format!("`{cause}` would not be reported");
        table.wants(has, "fault", &format!("the bit `{field}`"), &why);
    }
}

/// Errors that a drive reports by S-0-0390 alone.
fn diagnostic_numbers(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (fields, cause) in SERCOS_NUMBERS {
        let of_fields = |row: &SercosFaultRow| {
            row.word.get_ref() == "Diagnostic number"
                && row.pattern.len() == fields.len()
                && is(&row.cause, cause)
        };
        let has = rows.fault.iter().any(of_fields);
        let why = "an error that the drive says by its number alone would come without its cause";
        table.wants(has, "fault", &format!("`{cause}` for errors of S-0-0390"), why);
    }
}

/// Edges of a field of their own, then the others.
fn captures(table: &mut Table<'_>, rows: &GenericSercosFile) {
    let by_field = SERCOS_CAPTURES.iter().map(|fact| (fact.capture, fact.edge));
    for (kind, edge) in by_field.chain(SERCOS_EDGES.iter().copied()) {
        let has = rows.capture.iter().any(|row| is(&row.capture, kind) && is(&row.edge, edge));
        capture(table, has, kind, edge);
    }
}

/// How drives write a unit in element 4.
fn spellings(table: &mut Table<'_>, rows: &[UnitRow]) {
    for (text, unit) in SPELLINGS {
        let spells = |row: &UnitRow| row.texts.iter().any(|known| known.as_str() == *text);
        let has = rows.iter().any(|row| is(&row.unit, unit) && spells(row));
        let why = "a parameter of a drive that writes it so would be missing";
        table.wants(has, "unit", &format!("the spelling `{text}` of `{unit}`"), why);
    }
}

fn signals(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for binding in SIGNALS.iter().filter(|binding| !binding.idns.is_empty()) {
        let has = rows.signal.iter().any(|row| is(&row.signal, binding.name));
        signal(table, has, binding.name, binding.idns);
    }
}

fn modes(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (name, by_drive, _) in SERCOS_CODES {
        let of_row = |interpolation| by(interpolation) == *by_drive;
        let has = rows.mode.iter().any(|row| is(&row.mode, name) && of_row(row.interpolation.as_ref()));
        mode(table, has, name, *by_drive);
    }
}

fn procedures(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (mode, source, _) in PROCEDURES {
        let has = rows.procedure.iter().any(|row| is(&row.mode, mode) && is(&row.interpolation, source));
        let why = "a drive that can do it would be taken for one that cannot";
        table.wants(has, "procedure", &format!("the mode `{mode}` by the {source}"), why);
    }
}

fn mode_slots(table: &mut Table<'_>, rows: &GenericSercosFile) {
    for (slot, idn) in (0_u32..).zip(MODE_SLOTS) {
        let has = rows.mode_slot.iter().any(|row| *row.slot.get_ref() == slot);
        let why = format!("the operation mode in {idn} could not be used");
        table.wants(has, "mode_slot", &format!("`slot = {slot}`"), &why);
    }
}

fn commissioning(table: &mut Table<'_>, rows: &[CommissionRow]) {
    steps(table, SERCOS_STEPS, |verb| rows.iter().any(|row| is(&row.step, verb)));
    limits(table, SERCOS_WRITTEN, |name| rows.iter().any(|row| is_named(row.parameter.as_ref(), name)));
    values(table, true, |idn, value| {
        let writes = |row: &CommissionRow| row.value.as_ref().is_some_and(|known| *known.get_ref() == value);
        rows.iter().any(|row| is_named(row.idn.as_ref(), idn) && writes(row))
    });
    reads(table, SERCOS_READS, |idn| {
        rows.iter().any(|row| is(&row.step, "read") && is_named(row.idn.as_ref(), idn))
    });
}

/// Whether a pattern is one bit that has to be set.
fn is_set(pattern: &[FieldValueRow], field: &str) -> bool {
    matches!(pattern, [one] if is(&one.field, field) && matches!(one.is.get_ref(), FieldIs::Number(1)))
}
