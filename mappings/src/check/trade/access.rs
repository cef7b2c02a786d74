//! Nothing is written that cannot be written, and nothing is cyclic that may not be.

use super::Reporter;
use crate::Mapping;
use crate::dictionary::{Cia402Access, Cia402Pdo};
use crate::finding::Findings;
use crate::finding::registry::{NOT_CYCLIC, READ_ONLY};
use crate::format::Name;
use crate::item::Object;

/// The phase in which telegrams carry command values.
const OPERATION: u8 = 4;

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let dictionary = &mapping.dictionaries.sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.signal {
        let known = row.idn.get_ref().parse().ok().and_then(|idn| dictionary.idn(idn));
        let Some(known) = known.filter(|known| known.is_known()) else { continue };
        let idn = row.idn.get_ref();
        let to_drive = row.direction.get_ref() == "to_drive";
        let never_written = known.write.as_ref().is_some_and(|phases| !phases.contains(&OPERATION));
        if to_drive && known.in_mdt.is_empty() && never_written {
            let what = [
                format!("`{}` would be written to {idn}, which cannot be written", row.signal.get_ref()),
                format!("{idn} ({}) is neither in the MDT nor written in CP4", known.name),
                "name the IDN of the command value".to_owned(),
            ];
            reporter.report(READ_ONLY, ("idn", row.idn.span()), what);
        }
        // An IDN that drives have in the MDT and never in the AT is a command.
        if !to_drive && known.in_at.is_empty() && !known.in_mdt.is_empty() {
            let what = [
                format!(
                    "`{}` would come from {idn}, which no drive has in its telegram",
                    row.signal.get_ref()
                ),
                format!("{idn} ({}) goes to the drive", known.name),
                "name the IDN of the actual value".to_owned(),
            ];
            reporter.report(NOT_CYCLIC, ("idn", row.idn.span()), what);
        }
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let words = &file.rows.words;
    let mut reporter = Reporter { source: &file.text, findings };
    for (key, name, written) in [
        ("control", &words.control, true),
        ("mode", &words.mode, true),
        ("status", &words.status, false),
        ("mode_shown", &words.mode_shown, false),
    ] {
        object(mapping, &mut reporter, (key, key, name), written);
    }
    for row in &file.rows.signal {
        let written = row.direction.get_ref() == "to_drive";
        object(mapping, &mut reporter, (row.signal.get_ref(), "object", &row.object), written);
    }
}

/// An object that stands in a PDO: written, or read.
fn object(
    mapping: &Mapping,
    reporter: &mut Reporter<'_>,
    (what, key, name): (&str, &str, &Name),
    written: bool,
) {
    let dictionary = &mapping.dictionaries.cia402;
    let Some(Object { index, sub }) = Object::parse(name.get_ref()) else { return };
    let Some(known) = dictionary.sub(index, sub) else { return };
    let place = (key, name.span());
    let object = name.get_ref();
    match (written, known.access) {
        (true, Some(Cia402Access::Ro | Cia402Access::Const)) => {
            let what = [
                format!("`{what}` would be written to {object}, which cannot be written"),
                format!("{object} ({}) is read-only", known.name),
                "name the object that takes it".to_owned(),
            ];
            return reporter.report(READ_ONLY, place, what);
        }
        (false, Some(Cia402Access::Wo)) => {
            let what = [
                format!("`{what}` would be read from {object}, which cannot be read"),
                format!("{object} ({}) is write-only", known.name),
                "name the object that shows it".to_owned(),
            ];
            return reporter.report(NOT_CYCLIC, place, what);
        }
        _ => {}
    }
    let never = match known.pdo {
        None | Some(Cia402Pdo::Both) => false,
        Some(Cia402Pdo::Rx) => !written,
        Some(Cia402Pdo::Tx) => written,
        Some(Cia402Pdo::No) => true,
    };
    if never {
        let pdo = if written { "RPDO" } else { "TPDO" };
        let what = [
            format!("`{what}` would stand in a {pdo} as {object}, which may not"),
            format!("{object} ({}) cannot be mapped into a {pdo}", known.name),
            "name an object that can be mapped".to_owned(),
        ];
        reporter.report(NOT_CYCLIC, place, what);
    }
}
