//! A fault of a drive is reported as what it is.

use super::facts::{
    CIP_FAULTS, CLASSES, CODES, INHIBITS, OWN_EVENT_STATUS, OWN_FAULTS, OWN_INHIBITS, SERCOS_FAULTS,
    SERCOS_NUMBERS,
};
use super::{Reporter, place_of};
use crate::Mapping;
use crate::finding::registry::{WEAKER_REACTION, WRONG_FAULT};
use crate::finding::{Findings, Spanned};
use crate::format::{CipFaultRow, FieldIs, FieldValueRow, Name, SercosFaultRow};

/// Causes without a name of their own: they say less than a bit or class, and nothing that is wrong.
const NAMELESS: [&str; 2] = ["drive_specific", "drive_warning"];

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
    for row in &file.rows.fault {
        own(&mut reporter, &row.cause, row.manufacturer.as_ref(), OWN_FAULTS);
    }
    for row in &file.rows.inhibit {
        own(&mut reporter, &row.inhibit, row.manufacturer.as_ref(), OWN_INHIBITS);
        let name = row.inhibit.get_ref();
        let right = INHIBITS.iter().find(|(known, _)| known == name).map(|(_, right)| *right);
        let given = row.start_inhibit.as_ref();
        if let Some(given) = given.filter(|given| right.is_some_and(|right| given.get_ref() != right)) {
            let right = right.unwrap_or_default();
            let what = [
                format!("`{name}` would be reported as `{}`", given.get_ref()),
                format!("expected `{right}`"),
                format!("write `start_inhibit = \"{right}\"`"),
            ];
            reporter.report(WRONG_FAULT, ("start_inhibit", given.span()), what);
        }
    }
    for row in &file.rows.capture_status {
        let fact = OWN_EVENT_STATUS.iter().find(|(known, _)| known == row.status.get_ref());
        if let Some((status, right)) = fact.filter(|(_, right)| row.event_status != *right) {
            let what = [
                format!("`{status}` would be reported as Event Status {}", row.event_status),
                format!("expected {right}: programs of controllers rely on it"),
                format!("write `event_status = {right}`"),
            ];
            reporter.report(WRONG_FAULT, ("status", row.status.span()), what);
        }
    }
}

/// A bit of the manufacturer.
fn own(reporter: &mut Reporter<'_>, name: &Name, bit: Option<&Spanned<u32>>, facts: &[(&str, u32)]) {
    let Some((_, right)) = facts.iter().find(|(known, _)| known == name.get_ref()) else { return };
    let Some(bit) = bit.filter(|bit| bit.get_ref() != right) else { return };
    let what = [
        format!("`{}` would be reported by bit {} of the manufacturer", name.get_ref(), bit.get_ref()),
        format!("expected bit {right}: programs of controllers rely on it"),
        format!("write `manufacturer = {right}`"),
    ];
    reporter.report(WRONG_FAULT, ("manufacturer", bit.span()), what);
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
        let of_class = |field: &FieldValueRow| {
            field.field.get_ref() == "Class" && matches!(field.is.get_ref(), FieldIs::Number(0xF))
        };
        if row.word.get_ref() == "Diagnostic number" && !row.pattern.iter().any(of_class) {
            let what = [
                format!("`{}` would be reported for a diagnosis that is no error", row.cause.get_ref()),
                "the class of S-0-0390 is F for a class 1 diagnostic".to_owned(),
                "write `{ field = \"Class\", is = 0xF }` into `pattern`".to_owned(),
            ];
            reporter.report(WRONG_FAULT, ("cause", row.cause.span()), what);
        }
        number(&mut reporter, row);
        // Several bits together, and values of fields, are what a vendor says with them.
        let [field] = row.pattern.as_slice() else { continue };
        let name = field.field.get_ref().as_str();
        let fact = SERCOS_FAULTS.iter().find(|(known, _)| *known == name);
        if fact.is_some() && matches!(field.is.get_ref(), FieldIs::Number(0)) {
            let what = [
                format!("`{}` would be reported while `{name}` is 0", row.cause.get_ref()),
                "the drive sets the bit when something is wrong".to_owned(),
                format!("write `pattern = [{{ field = \"{name}\", is = 1 }}]`"),
            ];
            reporter.report(WRONG_FAULT, ("cause", row.cause.span()), what);
            continue;
        }
        wrong(&mut reporter, &row.cause, name, fact);
    }
}

/// A row of the diagnostic number. Status codes, and what else a vendor says in it, are the vendor's.
fn number(reporter: &mut Reporter<'_>, row: &SercosFaultRow) {
    let cause = row.cause.get_ref().as_str();
    if row.word.get_ref() != "Diagnostic number" {
        return;
    }
    let has = |(field, is): &(&str, u32)| {
        let known = |row: &FieldValueRow| {
            row.field.get_ref() == field
                && matches!(row.is.get_ref(), FieldIs::Number(number) if number == is)
        };
        row.pattern.iter().any(known)
    };
    let whole = |fields: &[(&str, u32)]| fields.len() == row.pattern.len() && fields.iter().all(has);
    let by_cause = SERCOS_NUMBERS.iter().find(|(_, known)| *known == cause);
    let by_fields = SERCOS_NUMBERS.iter().find(|(fields, _)| whole(fields));
    let right = match (by_cause, by_fields) {
        (_, Some((_, right))) if *right != cause => {
            format!("expected `cause = \"{right}\"` for these fields")
        }
        (Some((fields, _)), None) => {
            let fields: Vec<String> =
                fields.iter().map(|(field, is)| format!("`{field}` = {is:#X}")).collect();
            format!("expected {}", fields.join(", "))
        }
        _ => return,
    };
    let what = [
        format!("`{cause}` would be reported for another number of S-0-0390"),
        right,
        "correct `pattern` or `cause`; codes of a vendor have causes of their own".to_owned(),
    ];
    reporter.report(WRONG_FAULT, ("cause", row.cause.span()), what);
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
        for code in &row.codes {
            let name = code.get_ref().as_str();
            wrong(&mut reporter, &row.cause, name, CODES.iter().find(|(known, _)| *known == name));
        }
        warns(&mut reporter, &row.codes, row.reaction.as_ref());
    }
}

/// A row whose cause is not what its bit or class says.
fn wrong(reporter: &mut Reporter<'_>, cause: &Name, says: &str, fact: Option<&(&str, &str)>) {
    let given = cause.get_ref().as_str();
    let says_less = NAMELESS.contains(&given);
    let Some((_, right)) = fact.filter(|(_, right)| given != *right && !says_less) else { return };
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
