//! A fault of a drive is reported as what it is.

use super::facts::{CIP_FAULTS, CLASSES, SERCOS_FAULTS};
use super::{Reporter, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{WEAKER_REACTION, WRONG_FAULT};
use crate::format::{CipFaultRow, FieldIs, Name};

/// The faults of CIP Motion that causes stand for.
pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.fault {
        let cause = row.cause.get_ref();
        let given = answer(row);
        let own = CIP_FAULTS.iter().find(|(known, ..)| known == cause);
        let shown = given.map_or_else(
            || "a bit of the manufacturer".to_owned(),
            |(_, name)| format!("`{}`", name.get_ref()),
        );
        let (key, place) = place_of(
            given.map_or("cause", |(key, _)| key),
            given.map(|(_, name)| name),
            ("cause", &row.cause),
        );
        let what = match (own, given) {
            (Some((_, _, right)), Some((_, name))) if name.get_ref() == right => continue,
            (None, None) => continue,
            (Some((_, key, right)), _) => [
                format!("`{cause}` would be reported as {shown}"),
                format!("expected `{right}`, which says what is wrong"),
                format!("write `{key} = \"{right}\"`"),
            ],
            (None, Some((_, name))) => {
                // A name that the standard has for another cause.
                let other = CIP_FAULTS.iter().find(|(_, _, known)| known == name.get_ref());
                let Some((other, ..)) = other else { continue };
                [
                    format!("`{cause}` would be reported as {shown}"),
                    format!("that is `{other}`, which is something else"),
                    "write `manufacturer` with a bit that is free".to_owned(),
                ]
            }
        };
        reporter.report(WRONG_FAULT, (key, place), what);
    }
}

/// The name that a row has for its cause; `None` for a bit of the manufacturer.
fn answer(row: &CipFaultRow) -> Option<(&'static str, &Name)> {
    [
        ("exception", &row.exception),
        ("node_fault", &row.node_fault),
        ("initialization", &row.initialization),
        ("apr", &row.apr),
    ]
    .into_iter()
    .find_map(|(key, name)| Some((key, name.as_ref()?)))
}

/// The bits of the diagnostic words.
pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.fault {
        silent(&mut reporter, &row.cause, row.reaction.as_ref());
        // Several bits together, and values of fields, are what a vendor says with them.
        let [field] = row.pattern.as_slice() else { continue };
        if !matches!(field.is.get_ref(), FieldIs::Number(1)) {
            continue;
        }
        let name = field.field.get_ref().as_str();
        let fact = SERCOS_FAULTS.iter().find(|(known, _)| *known == name);
        wrong(&mut reporter, &row.cause, name, fact);
    }
}

/// The classes of error codes, and how hard a code is taken.
pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.fault_class {
        silent(&mut reporter, &row.cause, row.reaction.as_ref());
        for class in &row.classes {
            let name = class.get_ref().as_str();
            wrong(&mut reporter, &row.cause, name, CLASSES.iter().find(|(known, _)| *known == name));
        }
        warns(&mut reporter, &row.classes, row.reaction.as_ref());
    }
    for row in &file.rows.fault {
        silent(&mut reporter, &row.cause, row.reaction.as_ref());
        warns(&mut reporter, &row.codes, row.reaction.as_ref());
    }
}

/// A row whose cause is not what its bit or class says.
fn wrong(reporter: &mut Reporter<'_>, cause: &Name, says: &str, fact: Option<&(&str, &str)>) {
    let Some((_, right)) = fact.filter(|(_, right)| cause.get_ref() != right) else { return };
    let what = [
        format!("`{says}` would be reported as `{}`", cause.get_ref()),
        format!("expected `{right}`"),
        format!("write `cause = \"{right}\"`"),
    ];
    reporter.report(WRONG_FAULT, ("cause", cause.span()), what);
}

/// A row that keeps what the drive reports from everybody.
fn silent(reporter: &mut Reporter<'_>, cause: &Name, reaction: Option<&Name>) {
    let Some(reaction) = reaction.filter(|reaction| reaction.get_ref() == "ignore") else { return };
    let what = [
        format!("`{}` would be reported to nobody", cause.get_ref()),
        "the drive says that something is wrong".to_owned(),
        "write `reaction = \"alarm\"` for a warning, or remove `reaction`".to_owned(),
    ];
    reporter.report(WRONG_FAULT, ("reaction", reaction.span()), what);
}

/// Error codes that are faults, of which a row makes a warning.
fn warns(reporter: &mut Reporter<'_>, codes: &[Name], reaction: Option<&Name>) {
    let Some(reaction) = reaction.filter(|reaction| reaction.get_ref() == "alarm") else { return };
    let Some(fault) = codes.iter().find(|code| !code.get_ref().ends_with("warning")) else { return };
    let what = [
        format!("`{}` would only warn", fault.get_ref()),
        "the drive is in the state Fault with each of its error codes".to_owned(),
        "remove `reaction`".to_owned(),
    ];
    reporter.report(WEAKER_REACTION, ("reaction", reaction.span()), what);
}
