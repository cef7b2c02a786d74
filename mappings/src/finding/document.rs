//! From a text to its tables and rows, with all that is wrong on the way.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::{Findings, Problem, Source, closest, registry as code};

/// The most rows and keys that are left out of one file to find what is wrong with the others.
const RETRIES_MAX: usize = 200;

/// What to report in place of a problem, where more is known about the file than its text says.
pub type Hint<'h> = &'h dyn Fn(&Problem) -> Option<Problem>;

type Span = std::ops::Range<usize>;

/// The tables of a text; `None` with every fault of its syntax.
pub fn tree<'t>(text: &'t str, source: &Source, findings: &mut Findings) -> Option<Spanned<DeTable<'t>>> {
    let (tree, errors) = DeTable::parse_recoverable(text);
    let mut certain = true;
    let mut line = None;
    for error in &errors {
        let twice = error.message() == "duplicate key";
        let at = error.span().map(|span| source.place(span.start).1);
        // After one fault in a line the others are of no account.
        let follows = at.is_some() && at == line;
        // Behind a bracket that is missing keys seem to be there twice that are not.
        if (certain || !twice)
            && !follows
            && let Some(problem) = Problem::from_syntax(error, source)
        {
            findings.push(source, problem);
        }
        certain &= twice;
        line = at;
    }
    errors.is_empty().then_some(tree)
}

/// What could be made of a tree.
#[derive(Debug)]
pub struct Partial<T> {
    /// The rows that are right.
    pub rows: T,
    /// Whether all rows are there, if not all of their keys.
    pub whole: bool,
    /// Whether nothing was wrong.
    pub faultless: bool,
}

/// The rows of a tree; `None` with what is wrong with each of them.
pub fn deserialize<T: DeserializeOwned>(
    tree: Spanned<DeTable<'_>>,
    source: &Source,
    findings: &mut Findings,
) -> Option<T> {
    partial(tree, source, findings, &|_| None).filter(|read| read.faultless).map(|read| read.rows)
}

/// The rows of a tree that are right, with what is wrong with the others: a key that is unknown or of the wrong type is left
/// out, and a row that cannot do without it.
pub fn partial<T: DeserializeOwned>(
    mut tree: Spanned<DeTable<'_>>,
    source: &Source,
    findings: &mut Findings,
    hint: Hint<'_>,
) -> Option<Partial<T>> {
    // What a group of rows says is wrong in each of them, and is reported once.
    let mut told: Vec<Span> = Vec::new();
    // Keys that were left out, by the table that lacks them now.
    let mut left: Vec<(Span, String)> = Vec::new();
    let mut whole = true;
    for retry in 0..RETRIES_MAX {
        let error = match T::deserialize(toml::de::Deserializer::from(tree.clone())) {
            Ok(rows) => return Some(Partial { rows, whole, faultless: retry == 0 }),
            Err(error) => error,
        };
        let problem = Problem::from_row(&error, source);
        let span = problem.span.clone();
        let missing = problem.code == code::MISSING_KEY;
        let removed = if missing { None } else { leave_out_key(&mut tree, &span) };
        let follows = match &removed {
            // A key that is missing because it was misspelt is reported where it is.
            None => left.iter().any(|(table, left)| *table == span && *left == problem.key),
            // So are tables within one that stands in the wrong place.
            Some(removed) => {
                problem.code == code::WRONG_TYPE
                    && removed.is_table
                    && left.iter().any(|(_, left)| *left == removed.key)
            }
        };
        let meant = meant(&problem);
        if !follows && !told.contains(&span) {
            told.push(span.clone());
            findings.push(source, hint(&problem).unwrap_or(problem));
        }
        if let Some(removed) = removed {
            left.extend(meant.map(|meant| (removed.table.clone(), meant)));
            left.push((removed.table, removed.key));
            whole &= !removed.is_table;
            continue;
        }
        whole = false;
        if !leave_out(tree.get_mut(), &span) {
            break;
        }
    }
    None
}

/// The key that an unknown one was meant to be.
fn meant(problem: &Problem) -> Option<String> {
    let known = problem.expected.split('`').skip(1).step_by(2);
    closest(&problem.key, known).filter(|_| problem.code == code::UNKNOWN_KEY).map(str::to_owned)
}

/// A key that was left out.
struct Removed {
    /// The place of the table that had it.
    table: Span,
    key: String,
    /// Whether its value is a table, or a list of them.
    is_table: bool,
}

/// Leaves out the key at this place, or the one whose value has it.
fn leave_out_key(tree: &mut Spanned<DeTable<'_>>, place: &Span) -> Option<Removed> {
    let span = tree.span();
    key_of_table(tree.get_mut(), span, place)
}

fn key_of_table(table: &mut DeTable<'_>, span: Span, place: &Span) -> Option<Removed> {
    let (key, at_key) = table.iter().find_map(|(key, value)| {
        let at_key = within(&key.span(), place);
        (at_key || has(value, place)).then(|| (key.get_ref().to_string(), at_key))
    })?;
    if !at_key && let Some(value) = table.get_mut(key.as_str()) {
        let span = value.span();
        if let Some(found) = key_of_value(value.get_mut(), span, place) {
            return Some(found);
        }
    }
    let is_table = match table.remove(key.as_str())?.get_ref() {
        DeValue::Table(_) => true,
        DeValue::Array(rows) => rows.iter().any(|row| matches!(row.get_ref(), DeValue::Table(_))),
        _ => false,
    };
    Some(Removed { table: span, key, is_table })
}

fn key_of_value(value: &mut DeValue<'_>, span: Span, place: &Span) -> Option<Removed> {
    match value {
        // The head of a table is the table: what is wrong with all of it is wrong with its key.
        DeValue::Table(_) if span == *place => None,
        DeValue::Table(table) => key_of_table(table, span, place),
        DeValue::Array(rows) => rows.iter_mut().find(|row| has(row, place)).and_then(|row| {
            let span = row.span();
            key_of_value(row.get_mut(), span, place)
        }),
        _ => None,
    }
}

/// Leaves out the smallest row that has something at this place; `false` when there is none.
fn leave_out(table: &mut DeTable<'_>, place: &Span) -> bool {
    let Some((_, value)) =
        table.iter_mut().find(|(key, value)| within(&key.span(), place) || has(value, place))
    else {
        return false;
    };
    leave_out_of(value.get_mut(), place)
}

fn leave_out_of(value: &mut DeValue<'_>, place: &Span) -> bool {
    match value {
        DeValue::Table(table) => leave_out(table, place),
        DeValue::Array(rows) => {
            let Some(at) = rows.iter().position(|row| has(row, place)) else { return false };
            let row = rows.as_mut()[at].get_mut();
            // What is missing in the row is not within one of its values.
            if leave_out_of(row, place) {
                return true;
            }
            if !matches!(row, DeValue::Table(_)) {
                return false;
            }
            let all = std::mem::replace(rows, DeArray::new());
            *rows =
                all.into_iter().enumerate().filter(|(index, _)| *index != at).map(|(_, row)| row).collect();
            true
        }
        _ => false,
    }
}

/// Whether the value or something in it is at this place.
fn has(value: &Spanned<DeValue<'_>>, place: &Span) -> bool {
    within(&value.span(), place)
        || match value.get_ref() {
            DeValue::Table(table) => {
                table.iter().any(|(key, value)| within(&key.span(), place) || has(value, place))
            }
            DeValue::Array(rows) => rows.iter().any(|row| has(row, place)),
            _ => false,
        }
}

fn within(span: &Span, place: &Span) -> bool {
    span.start <= place.start && place.end <= span.end && span.start < span.end
}
