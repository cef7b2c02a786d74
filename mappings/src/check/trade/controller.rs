//! What a controller is shown beside states and values: inputs, reactions, and what it may do about an exception.

use super::facts::{FOUND_BY_BOX, FOUND_BY_DEVICE, IGNORABLE, IO_STATUS, OWN_FAULTS, REACTIONS};
use super::{Reporter, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{WRONG_FAULT, WRONG_STATE};
use crate::format::{CipFaultRow, Name};

pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    let text = |name: &Option<Name>| name.as_ref().map(|name| name.get_ref().clone());
    for row in &file.rows.io_status {
        let bit = row.io_status.get_ref();
        let Some((_, status, without, inverted)) = IO_STATUS.iter().find(|(known, ..)| known == bit) else {
            continue;
        };
        let one =
            |list: &[Name]| list.iter().map(|name| name.get_ref().clone()).collect::<Vec<_>>().join(" and ");
        let given = [one(&row.status), one(&row.without), text(&row.inverted).unwrap_or_default()];
        let right = [*status, without.unwrap_or_default(), inverted.unwrap_or_default()];
        if given == right {
            continue;
        }
        let what = [
            format!("`{bit}` is set by something else"),
            format!(
                "expected `{}` without `{}`, and `{}` for an inverted axis",
                right[0], right[1], right[2]
            ),
            "correct `status`, `without` or `inverted`".to_owned(),
        ];
        reporter.report(WRONG_STATE, ("io_status", row.io_status.span()), what);
    }
    for row in &file.rows.reaction {
        let fact = REACTIONS.iter().find(|(known, ..)| known == row.reaction.get_ref());
        let Some((reaction, stop, change)) = fact else { continue };
        for (key, given, right) in [("stop", &row.stop, stop), ("state_change", &row.state_change, change)] {
            if given.get_ref() != right {
                let what = [
                    format!("`{reaction}` would be shown as `{}`", given.get_ref()),
                    format!("expected `{right}`"),
                    format!("write `{key} = \"{right}\"`"),
                ];
                reporter.report(WRONG_STATE, (key, given.span()), what);
            }
        }
    }
    for row in &file.rows.fault {
        exception(&mut reporter, row);
    }
}

/// Who finds an exception, what may be set for it, and which one it is for an inverted axis.
fn exception(reporter: &mut Reporter<'_>, row: &CipFaultRow) {
    let cause = row.cause.get_ref().as_str();
    if row.exception.is_none() && !OWN_FAULTS.iter().any(|(known, _)| *known == cause) {
        return;
    }
    let finder = match cause {
        _ if FOUND_BY_BOX.contains(&cause) => Some("box"),
        _ if FOUND_BY_DEVICE.contains(&cause) => Some("device"),
        _ => None,
    };
    let opposite = [("positive", "negative"), ("negative", "positive")]
        .iter()
        .find(|(one, _)| cause.contains("overtravel") && cause.ends_with(one))
        .map(|(one, other)| cause.replace(one, other));
    let keys = [
        ("found_by", &row.found_by, finder.map(str::to_owned)),
        ("least", &row.least, Some("Ignore".to_owned()).filter(|_| IGNORABLE.contains(&cause))),
        ("inverted", &row.inverted, opposite),
    ];
    for (key, given, right) in keys {
        let shown = given.as_ref().map(|name| name.get_ref().as_str());
        if shown == right.as_deref() {
            continue;
        }
        let what = [
            format!("`{cause}` has `{key}` = {}", shown.unwrap_or("nothing")),
            format!("expected {}", right.as_deref().unwrap_or("nothing")),
            match &right {
                Some(right) => format!("write `{key} = \"{right}\"`"),
                None => format!("remove `{key}`"),
            },
        ];
        reporter.report(WRONG_FAULT, place_of(key, given.as_ref(), ("cause", &row.cause)), what);
    }
}
