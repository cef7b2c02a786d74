//! Causes and what only follows from them.
//!
//! A row that cannot be used leaves others without what they name, and a value that is bound to the wrong place has the wrong
//! sign and the wrong size there as well. They all go with the cause, so only the cause is reported.

use std::ops::Range;
use std::sync::Arc;

use super::registry::{
    self as code, EXAMPLE_FAILS, LIMIT_UNFIT, RANGE_LOST, READ_ONLY, WRONG_BINDING, WRONG_SCALE, WRONG_SHAFT,
    WRONG_SIGN,
};
use super::source::Place;
use super::{Code, Finding, Severity};

/// What an error of a row explains of the others about the same value.
const EXPLAINS: [(Code, &[Code]); 5] = [
    (LIMIT_UNFIT, &[RANGE_LOST]),
    (WRONG_BINDING, &[READ_ONLY, WRONG_SIGN, WRONG_SCALE, EXAMPLE_FAILS]),
    (WRONG_SIGN, &[EXAMPLE_FAILS]),
    (WRONG_SHAFT, &[WRONG_SCALE, EXAMPLE_FAILS]),
    (WRONG_SCALE, &[EXAMPLE_FAILS]),
];

/// The keys by which rows are known.
const DEFINES: [&str; 16] = [
    "idn",
    "name",
    "signal",
    "parameter",
    "unit",
    "scaling",
    "action",
    "cause",
    "key",
    "attribute",
    "object",
    "index",
    "word",
    "state",
    "mode",
    "element",
];

/// Findings of rows that are left out, whatever is wrong with the key by which they are known.
const LEFT_OUT: [Code; 4] = [code::UNKNOWN_KEY, code::MISSING_KEY, code::WRONG_TYPE, code::OVERLAY_NO_KEY];

/// Where a finding comes from, as far as others may follow from it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Origin {
    /// The value that the row binds.
    about: String,
    /// The name that nothing defines.
    lacks: String,
    /// The file.
    text: Arc<str>,
    /// The row in it.
    row: Range<usize>,
}

impl Origin {
    pub fn new(place: &Place<'_>, about: String, lacks: String) -> Self {
        let lines = place.row();
        let row = place.part.line(*lines.start()).start..place.part.line(*lines.end()).end;
        Self { about, lacks, text: Arc::clone(&place.part.text), row }
    }
}

/// Forgets the consequences of other findings.
pub(super) fn forget(list: &mut Vec<Finding>) {
    // Of each that is forgotten, what explains it.
    let mut because: Vec<Option<usize>> = vec![None; list.len()];
    for index in 0..list.len() {
        let explained =
            |cause: &usize| explains(&list[*cause], &list[index]) && !leads_to(&because, *cause, index);
        because[index] = (0..list.len()).find(explained);
    }
    let mut because = because.into_iter();
    list.retain(|_| because.next().flatten().is_none());
}

/// Whether one is explained by another in the end: two never explain each other.
fn leads_to(because: &[Option<usize>], from: usize, to: usize) -> bool {
    std::iter::successors(Some(from), |at| because[*at]).any(|at| at == to)
}

fn explains(cause: &Finding, finding: &Finding) -> bool {
    if cause.severity() != Severity::Error {
        return false;
    }
    let (before, after) = (&cause.origin, &finding.origin);
    let same = !after.about.is_empty() && before.about == after.about;
    if same && EXPLAINS.iter().any(|(code, others)| *code == cause.code && others.contains(&finding.code)) {
        return true;
    }
    // What else is wrong in a row is wrong by itself.
    let apart = before.row != after.row || before.text != after.text;
    apart && !after.lacks.is_empty() && before.lacks != after.lacks && takes_away(cause, &after.lacks)
}

/// Whether the error keeps a name from being defined.
fn takes_away(cause: &Finding, name: &str) -> bool {
    let Origin { text, row, .. } = &cause.origin;
    // Of a text that cannot be parsed nothing is defined.
    let text = if cause.code == code::SYNTAX { Some(&**text) } else { text.get(row.clone()) };
    let left_out = LEFT_OUT.contains(&cause.code);
    let written = if name.starts_with("0x") { name.to_owned() } else { format!("\"{name}\"") };
    let defined = text.is_some_and(|text| {
        text.match_indices(&written).any(|(at, _)| left_out || DEFINES.contains(&key_before(&text[..at])))
    });
    defined || cause.help.contains(&format!("`{name}`"))
}

/// The key whose value comes next.
fn key_before(text: &str) -> &str {
    let Some(text) = text.trim_end().strip_suffix('=') else { return "" };
    text.trim_end()
        .rsplit(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
        .next()
        .unwrap_or_default()
}
