//! Rows of a mapping table that stand there twice: the first one counts, and the second one is never reached.
//!
//! A row is known by the keys that an overlay finds it by ([`sections`]). In a list whose first row that fits counts, two rows for the
//! same thing can differ in what they say, and `check` finds the one that is never used (AX0057); there a row is found here only if
//! it repeats another one as a whole. Overlays cannot double a row: theirs changes the one that is there.

use std::collections::HashMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use crate::finding::{Findings, Problem, Source, registry as code};
use crate::overlay::{Section, canonical, sections};

/// The tables whose rows are compared. The dictionaries hold every name and number of theirs against all others by themselves.
const TABLES: [&str; 3] = ["cip-generic", "generic-sercos", "generic-cia402"];

/// Keys that say nothing to the program.
const REMARKS: [&str; 3] = ["source", "note", "examples"];

/// Takes rows that stand twice out of a table, and reports them.
pub(crate) fn leave_out(name: &str, table: &mut DeTable<'_>, text: &Source, findings: &mut Findings) {
    if TABLES.contains(&name) {
        in_lists(sections(name), table, text, findings);
    }
}

fn in_lists(lists: &[Section], table: &mut DeTable<'_>, text: &Source, findings: &mut Findings) {
    for section in lists {
        if let Some(DeValue::Array(rows)) = table.get_mut(section.name).map(Spanned::get_mut) {
            *rows = once(section, std::mem::replace(rows, DeArray::new()), text, findings);
        }
    }
}

/// The rows of a list, each once.
fn once<'t>(section: &Section, rows: DeArray<'t>, text: &Source, findings: &mut Findings) -> DeArray<'t> {
    let mut known: HashMap<String, Range<usize>> = HashMap::new();
    let mut kept = Vec::new();
    for mut row in rows {
        let span = row.span();
        let DeValue::Table(table) = row.get_mut() else {
            kept.push(row);
            continue;
        };
        let place = place(section, table, span);
        match known.get(&identity(section, table)) {
            Some(first) => findings.push(text, problem(section, table, place, first.clone())),
            None => {
                known.insert(identity(section, table), place);
                in_lists(section.lists, table, text, findings);
                kept.push(row);
            }
        }
    }
    kept.into_iter().collect()
}

fn problem(section: &Section, row: &DeTable<'_>, place: Range<usize>, first: Range<usize>) -> Problem {
    let key = section.key.iter().copied().find(|key| row.contains_key(*key)).unwrap_or(section.name);
    let which = row.get(key).map(|value| canonical(value.get_ref())).unwrap_or_default();
    let problem = Problem::new(code::TWICE, place).key(key);
    let problem = problem.title(format!("the [[{}]] row of {key} = {which} is there twice", section.name));
    let problem = problem.expected("the first one counts, this one is never reached");
    problem
        .related(first, "the row is here first")
        .help("remove one of the two, or correct the keys that identify it")
}

/// Where a row is shown: at the first of the keys by which it is known, or as a whole where a group says that key.
fn place(section: &Section, row: &DeTable<'_>, span: Range<usize>) -> Range<usize> {
    let keys = section.key.iter().filter_map(|key| row.get(*key)).map(Spanned::span);
    let mut own = keys.filter(|key| key.start >= span.start);
    own.next().unwrap_or(span)
}

/// The same text for rows that stand for the same thing.
fn identity(section: &Section, row: &DeTable<'_>) -> String {
    let counts = |key: &str| match section.first_wins {
        true => !REMARKS.contains(&key),
        false => section.key.contains(&key),
    };
    let mut keys: Vec<String> = row
        .iter()
        .filter(|(key, _)| counts(key.get_ref()))
        .map(|(key, value)| format!("{} = {}", key.get_ref(), unordered(value.get_ref())))
        .collect();
    keys.sort_unstable();
    keys.join("\n")
}

/// A value without the order of a list of names or of fields: which of them are meant is the same in any order.
fn unordered(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Array(list) if !list.iter().any(|one| matches!(one.get_ref(), DeValue::Integer(_))) => {
            let mut all: Vec<String> = list.iter().map(|one| unordered(one.get_ref())).collect();
            all.sort_unstable();
            format!("[{}]", all.join(","))
        }
        other => canonical(other),
    }
}
