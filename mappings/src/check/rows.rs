//! Rows that fit nothing: modes of one side only, units that nothing uses, values that do not fit their type.

use profile_generic::mode::OperatingMode;
use profile_generic::program::Width;

use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::{DriveFacts, IdnUnit, Mapping, SercosIdn};

/// Looks at modes, units and values.
pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    units(mapping, findings);
    commissioning(mapping, findings);
    attributes(mapping, findings);
}

/// The same for CiA 402 drives, and the modes of all.
pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    modes(mapping, findings);
    cia402_units(mapping, findings);
}

fn modes(mapping: &Mapping, findings: &mut Findings) {
    let (cip, sercos) = (&mapping.tables().cip_generic, &mapping.tables().generic_sercos);
    let cia402 = &mapping.tables().generic_cia402;
    for row in &cip.rows.mode {
        let mode = row.mode.get_ref();
        let none = mode == OperatingMode::None.name();
        if !none && !sercos.rows.mode.iter().any(|other| other.mode.get_ref() == mode) {
            let problem = Problem::new(code::MODE_UNSERVED, row.mode.span()).key("mode");
            let problem = problem.title(format!("no drive has the operating mode `{mode}`"));
            findings.push(
                &cip.text,
                problem.expected("generic-sercos.toml has no [[mode]] row of it: it is refused"),
            );
        }
        if !none && !cia402.rows.mode.iter().any(|other| other.mode.get_ref() == mode) {
            let problem = Problem::new(code::MODE_UNSERVED, row.mode.span()).key("mode");
            let problem = problem.title(format!("no CiA 402 drive has the operating mode `{mode}`"));
            findings.push(
                &cip.text,
                problem.expected("generic-cia402.toml has no [[mode]] row of it: it is refused"),
            );
        }
    }
    for row in &sercos.rows.mode {
        let mode = row.mode.get_ref();
        if !cip.rows.mode.iter().any(|other| other.mode.get_ref() == mode) {
            let problem = Problem::new(code::MODE_UNSERVED, row.mode.span()).key("mode");
            let problem = problem.title(format!("no controller asks for the operating mode `{mode}`"));
            findings.push(&sercos.text, problem.expected("cip-generic.toml has no [[mode]] row of it"));
        }
    }
    for row in &cia402.rows.mode {
        let mode = row.mode.get_ref();
        if !cip.rows.mode.iter().any(|other| other.mode.get_ref() == mode) {
            let problem = Problem::new(code::MODE_UNSERVED, row.mode.span()).key("mode");
            let problem = problem.title(format!("no controller asks for the operating mode `{mode}`"));
            findings.push(&cia402.text, problem.expected("cip-generic.toml has no [[mode]] row of it"));
        }
    }
}

fn units(mapping: &Mapping, findings: &mut Findings) {
    let (cip, sercos) = (&mapping.tables().cip_generic, &mapping.tables().generic_sercos);
    let dictionaries = &mapping.dictionaries;
    for row in &cip.rows.unit {
        let unit = row.unit.get_ref();
        let used = dictionaries.cip.attributes().iter().any(|attribute| attribute.unit == *unit)
            || cip.rows.event.iter().any(|row| row.unit.as_ref().is_some_and(|name| name.get_ref() == unit));
        if !used {
            let problem = Problem::new(code::UNUSED, row.unit.span()).key("unit");
            findings.push(&cip.text, problem.expected("no attribute is in this unit"));
        }
    }
    let in_unit =
        |idn: &SercosIdn, wanted: &str| matches!(&idn.unit, IdnUnit::Fixed { unit, .. } if unit == wanted);
    for row in &sercos.rows.unit {
        let unit = row.unit.get_ref();
        // What drives spell otherwise may come from any of them.
        if row.texts.is_empty() && !dictionaries.sercos.idns().iter().any(|idn| in_unit(idn, unit)) {
            let problem = Problem::new(code::UNUSED, row.unit.span()).key("unit");
            findings.push(&sercos.text, problem.expected("no IDN of the dictionary is in this unit"));
        }
    }
    for row in &sercos.rows.signal {
        let signal = row.signal.get_ref();
        let mut modes = sercos.rows.mode.iter().flat_map(|mode| mode.command.iter().chain(&mode.actual));
        if !modes.any(|name| name.get_ref() == signal) {
            let problem = Problem::new(code::UNUSED, row.signal.span()).key("signal");
            findings.push(&sercos.text, problem.expected("no [[mode]] row has it in a telegram"));
        }
    }
}

fn cia402_units(mapping: &Mapping, findings: &mut Findings) {
    let cia402 = &mapping.tables().generic_cia402;
    let objects = mapping.dictionaries.cia402.objects();
    for name in
        cia402.rows.unit.iter().map(|row| &row.unit).chain(cia402.rows.scaling.iter().map(|row| &row.unit))
    {
        if !objects.iter().flat_map(|object| &object.subs).any(|sub| sub.unit == *name.get_ref()) {
            let problem = Problem::new(code::UNUSED, name.span()).key("unit");
            findings.push(&cia402.text, problem.expected("no object of the dictionary is in this unit"));
        }
    }
    for row in &cia402.rows.signal {
        let signal = row.signal.get_ref();
        let mut modes = cia402.rows.mode.iter().flat_map(|mode| mode.command.iter().chain(&mode.actual));
        if !modes.any(|name| name.get_ref() == signal) {
            let problem = Problem::new(code::UNUSED, row.signal.span()).key("signal");
            findings.push(&cia402.text, problem.expected("no [[mode]] row has it in a PDO"));
        }
    }
}

/// What commissioning writes fits the IDN.
fn commissioning(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let dictionary = &mapping.dictionaries.sercos;
    let facts = DriveFacts::new();
    for row in &file.rows.commission {
        let (Some(name), Some(value)) = (&row.idn, &row.value) else { continue };
        let width = name.get_ref().parse().ok().and_then(|idn| facts.width(idn, dictionary));
        fits(*value.get_ref(), width, name.get_ref()).into_iter().for_each(|message| {
            findings.push(
                &file.text,
                Problem::new(code::OUT_OF_RANGE, value.span()).key("value").expected(message),
            )
        });
    }
}

/// Constants and ranges of attributes fit their types.
fn attributes(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    for row in &file.rows.attribute {
        let Some(attribute) = mapping.dictionaries.cip.attribute(row.attribute.get_ref()) else { continue };
        let values = row.value.into_iter().chain(row.range.into_iter().flatten());
        for value in values {
            let width = attribute.data_type.width().filter(|width| !width.is_float());
            if let Some(message) = fits(value, width, &attribute.name) {
                let problem = Problem::new(code::OUT_OF_RANGE, row.attribute.span()).key("attribute");
                findings.push(&file.text, problem.expected(message));
            }
        }
    }
}

/// Why a value does not fit; `None` when it does, or nobody knows how long it is.
fn fits(value: i64, width: Option<Width>, what: &str) -> Option<String> {
    let width = width?;
    let (low, high) = width.range();
    // 64 bits without sign are held as those with.
    let fits = (low..=high).contains(&value) || width == Width::U64 && value >= 0;
    (!fits).then(|| format!("expected {low} to {high}, which {what} can hold, got {value}"))
}
