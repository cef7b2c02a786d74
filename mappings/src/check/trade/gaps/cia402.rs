//! What the rows of CiA 402 lack.

use super::super::facts::{
    Binding, CIA402_CAPTURES, CIA402_MODES, CIA402_READS, CIA402_STEPS, CIA402_UNITS, CIA402_WRITTEN,
    CLASSES, CODES, PARAMETERS, SIGNALS, WITHOUT_ENCODER,
};
use super::{Table, by, capture, is, is_named, limits, mode, parameter, reads, signal, steps, units, values};
use crate::Mapping;
use crate::finding::Findings;
use crate::format::{Cia402CommissionRow, Cia402SignalRow, GenericCia402File, Name};

pub(in super::super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let rows = &file.rows;
    let mut table = Table::new(&file.text, &rows.mapping, findings);
    unanswered(&mut table, mapping);
    parameters(&mut table, rows, mapping);
    captures(&mut table, rows);
    units(&mut table, CIA402_UNITS, &rows.unit);
    signals(&mut table, rows);
    without_encoder(&mut table, rows);
    modes(&mut table, rows);
    homing(&mut table, rows);
    fault_classes(&mut table, rows);
    fault_codes(&mut table, rows);
    inputs(&mut table, rows);
    commissioning(&mut table, &rows.commission);
}

/// Objects of the drive profile that are neither bound nor left out for a reason.
fn unanswered(table: &mut Table<'_>, mapping: &Mapping) {
    for index in &mapping.cia402.unanswered {
        let name = mapping.dictionaries.cia402.object(*index).map_or("", |object| object.name.as_str());
        table.unanswered(&format!("{index:04X}"), name);
    }
}

fn parameters(table: &mut Table<'_>, rows: &GenericCia402File, mapping: &Mapping) {
    for binding in PARAMETERS.iter().filter(|binding| !binding.objects.is_empty()) {
        let bound = rows.parameter.iter().any(|row| is(&row.parameter, binding.name));
        // One object limits both directions of the velocity.
        let both = binding.name.contains("negative")
            && rows.parameter.iter().any(|row| binding.objects.contains(&row.object.get_ref().as_str()));
        if !bound && !both && !is_excused(binding, mapping) {
            parameter(table, binding.name, binding.objects);
        }
    }
}

/// Whether an object of a binding is left out for a reason, or reported as a whole.
fn is_excused(binding: &Binding, mapping: &Mapping) -> bool {
    let index = |object: &&str| u16::from_str_radix(object.get(..4).unwrap_or_default(), 16).ok();
    binding.objects.iter().filter_map(index).any(|index| {
        let reason = mapping.cia402.unbound.iter().any(|(known, _)| *known == index);
        reason || mapping.cia402.unanswered.contains(&index)
    })
}

fn captures(table: &mut Table<'_>, rows: &GenericCia402File) {
    for fact in CIA402_CAPTURES {
        let has = rows.capture.iter().any(|row| is(&row.capture, fact.capture) && is(&row.edge, fact.edge));
        capture(table, has, fact.capture, fact.edge);
    }
}

fn signals(table: &mut Table<'_>, rows: &GenericCia402File) {
    for binding in SIGNALS.iter().filter(|binding| !binding.objects.is_empty()) {
        let has = rows.signal.iter().any(|row| is(&row.signal, binding.name));
        signal(table, has, binding.name, binding.objects);
    }
}

/// A position that a drive without an encoder may lack.
fn without_encoder(table: &mut Table<'_>, rows: &GenericCia402File) {
    let (mode, _) = WITHOUT_ENCODER;
    let may_lack = |row: &Cia402SignalRow| {
        is(&row.signal, "position_actual") && row.modes.iter().any(|name| is(name, mode))
    };
    let has = rows.signal.iter().any(may_lack);
    let what = format!("`position_actual` with `modes = [\"{mode}\"]`");
    table.wants(has, "signal", &what, "a frequency converter without an encoder could not be used");
}

/// Every mode with all of its modes of operation.
fn modes(table: &mut Table<'_>, rows: &GenericCia402File) {
    for (name, by_drive, own) in CIA402_MODES {
        let rows_of = rows.mode.iter().filter(|row| is(&row.mode, name));
        let named: Vec<&Name> = rows_of
            .filter(|row| by(row.interpolation.as_ref()) == *by_drive)
            .flat_map(|row| &row.modes)
            .collect();
        let has = own.iter().all(|wanted| named.iter().any(|name| is(name, wanted)));
        mode(table, has, name, *by_drive);
    }
}

fn homing(table: &mut Table<'_>, rows: &GenericCia402File) {
    let has = rows.procedure.iter().any(|row| is(&row.mode, "homing"));
    let why = "a drive that can do it would be taken for one that cannot";
    table.wants(has, "procedure", "the mode `homing`", why);
}

fn fault_classes(table: &mut Table<'_>, rows: &GenericCia402File) {
    for (class, cause) in CLASSES {
        let has = rows.fault_class.iter().any(|row| row.classes.iter().any(|known| is(known, class)));
        let why = format!("its codes without a row of their own would not be reported as `{cause}`");
        table.wants(has, "fault_class", &format!("the class `{class}`"), &why);
    }
}

fn fault_codes(table: &mut Table<'_>, rows: &GenericCia402File) {
    for (code, cause) in CODES {
        let has = rows.fault.iter().any(|row| row.codes.iter().any(|known| is(known, code)));
        let why = format!("it would be reported as its class, and not as `{cause}`");
        table.wants(has, "fault", &format!("the code `{code}`"), &why);
    }
}

/// Switches at the digital inputs of the drive.
fn inputs(table: &mut Table<'_>, rows: &GenericCia402File) {
    for status in ["limit_switches", "positive_limit_switch", "negative_limit_switch", "home_switch"] {
        let has = rows.status.iter().any(|row| is(&row.status, status));
        let why = "an input of the drive would never be seen";
        table.wants(has, "status", &format!("`status = \"{status}\"`"), why);
    }
}

fn commissioning(table: &mut Table<'_>, rows: &[Cia402CommissionRow]) {
    steps(table, CIA402_STEPS, |verb| rows.iter().any(|row| is(&row.step, verb)));
    limits(table, CIA402_WRITTEN, |name| rows.iter().any(|row| is_named(row.parameter.as_ref(), name)));
    values(table, false, |object, value| {
        let writes =
            |row: &Cia402CommissionRow| row.value.as_ref().is_some_and(|known| *known.get_ref() == value);
        rows.iter().any(|row| is_named(row.object.as_ref(), object) && writes(row))
    });
    reads(table, CIA402_READS, |object| {
        rows.iter().any(|row| is(&row.step, "read") && is_named(row.object.as_ref(), object))
    });
}
