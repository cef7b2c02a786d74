//! From a text to its tables and rows, with all that is wrong on the way.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::{Findings, Problem, Source};

/// The most rows that are left out of one file to find what is wrong with the others.
const RETRIES_MAX: usize = 100;

/// The tables of a text; `None` with every fault of its syntax.
pub fn tree<'t>(text: &'t str, source: &Source, findings: &mut Findings) -> Option<Spanned<DeTable<'t>>> {
    let (tree, errors) = DeTable::parse_recoverable(text);
    let mut certain = true;
    for error in &errors {
        let twice = error.message() == "duplicate key";
        // Behind a bracket that is missing keys seem to be there twice that are not.
        if certain || !twice {
            findings.push(source, Problem::from_syntax(error));
        }
        certain &= twice;
    }
    errors.is_empty().then_some(tree)
}

/// The rows of a tree; `None` with what is wrong with each of them. A row that is no row is left out to see what is wrong
/// with the others.
pub fn deserialize<T: DeserializeOwned>(
    mut tree: Spanned<DeTable<'_>>,
    source: &Source,
    findings: &mut Findings,
) -> Option<T> {
    // What a group of rows says is wrong in each of them, and is told once.
    let mut told: Vec<Span> = Vec::new();
    for retry in 0..RETRIES_MAX {
        let error = match T::deserialize(toml::de::Deserializer::from(tree.clone())) {
            Ok(rows) => return Some(rows).filter(|_| retry == 0),
            Err(error) => error,
        };
        let problem = Problem::from_row(&error);
        let span = problem.span.clone();
        if !told.contains(&span) {
            told.push(span.clone());
            findings.push(source, problem);
        }
        if !leave_out(tree.get_mut(), &span) {
            break;
        }
    }
    None
}

type Span = std::ops::Range<usize>;

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
