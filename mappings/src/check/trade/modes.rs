//! What comes from a drive in one mode comes from it in the others.

use super::Reporter;
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::MODES_DIFFER;
use crate::format::Name;

/// What only a position loop has.
const OF_POSITION: &str = "following_error";

/// A [[mode]] row: its mode, and what comes from the drive in it.
type Mode<'a> = (&'a Name, &'a [Name]);

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let modes: Vec<Mode<'_>> = file.rows.mode.iter().map(|row| (&row.mode, row.actual.as_slice())).collect();
    check(&mut Reporter { source: &file.text, findings }, &modes);
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let modes: Vec<Mode<'_>> = file.rows.mode.iter().map(|row| (&row.mode, row.actual.as_slice())).collect();
    check(&mut Reporter { source: &file.text, findings }, &modes);
}

fn check(reporter: &mut Reporter<'_>, modes: &[Mode<'_>]) {
    let has = |list: &[Name], name: &str| list.iter().any(|known| known.get_ref() == name);
    let mut all: Vec<&str> =
        modes.iter().flat_map(|(_, actual)| *actual).map(|name| name.get_ref().as_str()).collect();
    all.sort_unstable();
    all.dedup();
    for (mode, actual) in modes {
        let missing = all
            .iter()
            .filter(|name| !has(actual, name) && (**name != OF_POSITION || mode.get_ref() == "position"));
        for name in missing {
            let other = modes.iter().find(|(_, actual)| has(actual, name));
            let other = other.map_or("", |(mode, _)| mode.get_ref().as_str());
            let what = [
                format!("`{name}` does not come from the drive in the mode `{}`", mode.get_ref()),
                format!("it does in the mode `{other}`"),
                format!("add \"{name}\" to `actual`"),
            ];
            reporter.report(MODES_DIFFER, ("mode", mode.span()), what);
        }
    }
}
