//! Laying the rows of one tree over those of another.

use std::fmt::Write as _;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::Layer;
use super::sections::{Section, sections};
use crate::finding::registry::{self as code, Code};
use crate::finding::{Findings, Problem, Source, closest};
use crate::groups;

/// The key that takes a row away, or keys of it.
const REMOVE: &str = "remove";

/// The key of a new row that comes behind those that are there, although the first one that fits counts.
const LAST: &str = "last";

type Value<'t> = Spanned<DeValue<'t>>;

/// What is known of new rows, by their places.
pub(crate) type Hints = Vec<(Range<usize>, Hint)>;

/// What comes of laying rows over a table.
#[derive(Debug, Default)]
pub(crate) struct Laid {
    /// What to do about keys that new rows lack.
    pub hints: Hints,
    /// Values that were taken away or replaced, and the row that did it, by their places.
    pub losses: Vec<(Range<usize>, Range<usize>)>,
}

/// What is known of a row that the table does not have.
#[derive(Debug)]
pub(crate) struct Hint {
    /// The key that identifies it.
    key: String,
    /// The place of its value.
    span: Range<usize>,
    /// Key and value.
    written: String,
    /// The value of a row that the table has, if it is close.
    near: Option<String>,
}

impl Hint {
    /// What to say of a key that the row lacks.
    pub fn about(&self, missing: &Problem) -> Problem {
        let title = format!("the table has no row with {}", self.written);
        match &self.near {
            Some(near) => Problem::new(code::UNKNOWN_NAME, self.span.clone())
                .key(&self.key)
                .title(title)
                .expected("expected the name of a row of the table, or all keys of a new row")
                .help(format!("did you mean `{near}`?")),
            None => missing.clone().help(format!("{title}, and a new row needs all keys")),
        }
    }
}

/// Lays what a layer has of a table over it. `base` is where the layer begins in the source.
pub(crate) fn lay<'t>(
    layer: &Layer<'t>,
    base: usize,
    name: &str,
    table: &mut DeTable<'t>,
    source: &Source,
    findings: &mut Findings,
) -> Laid {
    let Some(rows) = layer.rows(name) else { return Laid::default() };
    let mut merger = Merger { source, findings, table: name, laid: Laid::default() };
    let rows = shifted(rows, base);
    let span = rows.span();
    let DeValue::Table(mut rows) = rows.into_inner() else {
        let lists: Vec<String> =
            sections(name).iter().take(3).map(|section| format!("[[{name}.{}]]", section.name)).collect();
        let problem =
            Problem::new(code::WRONG_TYPE, span).title(format!("`{name}` without the list of its rows"));
        let problem = problem.expected("expected the name of a table and of a list in it");
        merger
            .findings
            .push(source, problem.help(format!("write the list as well, as in {}", lists.join(", "))));
        return merger.laid;
    };
    groups::spread(&mut rows);
    if name == "cip-generic" {
        answer_once(table, &rows);
    }
    for (key, value) in rows {
        let known: Vec<String> = table.keys().map(|key| key.get_ref().to_string()).collect();
        let section = sections(name).iter().find(|section| section.name == *key.get_ref());
        if section.is_some() && !table.contains_key(key.get_ref().as_ref()) {
            // A list that no shipped row is in.
            table.insert(key.clone(), Spanned::new(key.span(), DeValue::Array(DeArray::new())));
        }
        match (section, table.get_mut(key.get_ref().as_ref())) {
            (Some(section), Some(list)) => merger.list(section, list, value),
            (None, Some(single)) if matches!(single.get_ref(), DeValue::Table(_)) => {
                merger.single(&key, single, value)
            }
            (None, Some(_)) => {
                merger.problem(
                    code::UNKNOWN_TABLE,
                    key.span(),
                    key.get_ref(),
                    "expected rows: the head of a table stays as it is",
                );
            }
            (_, None) => {
                let close = closest(key.get_ref(), known.iter().map(String::as_str));
                let problem = Problem::new(code::UNKNOWN_TABLE, key.span()).key(key.get_ref().as_ref());
                let problem = problem.expected(format!("expected rows that {name} has"));
                let problem = match close {
                    Some(close) => problem.help(format!("did you mean `{name}.{close}`?")),
                    None => problem.help(format!("they are {}", known.join(", "))),
                };
                merger.findings.push(merger.source, problem);
            }
        }
    }
    merger.laid
}

struct Merger<'a> {
    source: &'a Source,
    findings: &'a mut Findings,
    /// The table that rows are laid over.
    table: &'a str,
    laid: Laid,
}

impl Merger<'_> {
    fn problem(&mut self, code: Code, span: Range<usize>, key: &str, expected: impl Into<String>) {
        self.findings.push(self.source, Problem::new(code, span).key(key).expected(expected));
    }

    /// Notes that a row took a value away, with all that is in it.
    fn lost(&mut self, value: &Value<'_>, by: &Range<usize>) {
        self.laid.losses.push((value.span(), by.clone()));
        match value.get_ref() {
            DeValue::Array(values) => values.iter().for_each(|value| self.lost(value, by)),
            DeValue::Table(table) => table.values().for_each(|value| self.lost(value, by)),
            _ => {}
        }
    }

    /// Lays rows over a list.
    fn list<'t>(&mut self, section: &Section, list: &mut Value<'t>, rows: Value<'t>) {
        let span = rows.span();
        let (DeValue::Array(list), DeValue::Array(rows)) = (list.get_mut(), rows.into_inner()) else {
            let problem = Problem::new(code::WRONG_TYPE, span).key(section.name);
            let help = format!("write the head in double brackets: [[{}.{}]]", self.table, section.name);
            return self.findings.push(self.source, problem.expected("expected a list of rows").help(help));
        };
        let mut known: Vec<Value<'t>> = std::mem::replace(list, DeArray::new()).into_iter().collect();
        let mut seen: Vec<(String, Range<usize>)> = Vec::new();
        // Rows that are added in front keep the order in which they stand.
        let mut added = 0;
        for row in rows {
            let span = row.span();
            let DeValue::Table(mut row) = row.into_inner() else {
                self.problem(code::WRONG_TYPE, span, section.name, "expected a row");
                continue;
            };
            let Some(id) = identity(section, &row) else {
                self.no_identity(section, &row, span, &known);
                continue;
            };
            if let Some((_, first)) = seen.iter().find(|(known, _)| *known == id) {
                let problem = Problem::new(code::TWICE, span).key(section.name);
                let problem = problem.expected("expected one row of this overlay for the same thing");
                let problem =
                    problem.related(first.clone(), "the row is here first").help("put all keys into one row");
                self.findings.push(self.source, problem);
                continue;
            }
            let at = known.iter().position(|known| match known.get_ref() {
                DeValue::Table(known) => identity(section, known).as_ref() == Some(&id),
                _ => false,
            });
            seen.push((id, span.clone()));
            let remove = row.remove(REMOVE);
            let last = row.remove(LAST).map(|value| (value.span(), value.get_ref().clone()));
            let last = match (last, at.is_none() && section.first_wins) {
                (Some((_, DeValue::Boolean(last))), true) => last,
                (Some((place, _)), _) => {
                    let message =
                        "expected true or false in a new row of a list whose first row that fits counts";
                    self.problem(code::CONTRADICTION, place, LAST, message);
                    false
                }
                (None, _) => false,
            };
            match (at, remove.as_ref().map(|value| (value.span(), value.get_ref()))) {
                (Some(at), Some((place, DeValue::Boolean(true)))) => {
                    if row.keys().any(|key| !section.key.contains(&key.get_ref().as_ref())) {
                        self.problem(
                            code::CONTRADICTION,
                            place,
                            REMOVE,
                            "expected no other keys in a row that is removed",
                        );
                    }
                    self.lost(&known.remove(at), &span);
                }
                (None, Some((place, _))) => {
                    let message = format!("expected a row of `{}` that is there", section.name);
                    let problem =
                        Problem::new(code::OVERLAY_REMOVES_NOTHING, place).key(REMOVE).expected(message);
                    let near = hint(section, &row, &known).and_then(|hint| hint.near);
                    let help = near.map(|near| format!("did you mean `{near}`?"));
                    self.findings.push(self.source, problem.help(help.unwrap_or_default()));
                }
                (Some(at), remove) => {
                    let removed = remove
                        .is_some_and(|(place, value)| self.remove_keys(&mut known[at], place, value, &span));
                    self.row(section, &mut known[at], row, span, removed);
                }
                (None, None) => {
                    self.laid.hints.extend(hint(section, &row, &known).map(|hint| (span.clone(), hint)));
                    let row = Spanned::new(span, DeValue::Table(row));
                    if section.first_wins && !last {
                        known.insert(added, row);
                        added += 1;
                    } else {
                        known.push(row);
                    }
                }
            }
        }
        *list = known.into_iter().collect();
    }

    /// Reports a row that does not say which one it is.
    fn no_identity(&mut self, section: &Section, row: &DeTable<'_>, span: Range<usize>, known: &[Value<'_>]) {
        let first = section.key.first().copied().unwrap_or_default();
        let unknown = row.keys().find(|key| {
            let name = key.get_ref().as_ref();
            closest(name, section.key.iter().copied()).is_some() && !section.key.contains(&name)
        });
        let keys: Vec<String> = section.key.iter().map(|key| format!("`{key}`")).collect();
        if let Some(key) = unknown {
            let name = key.get_ref().as_ref();
            let meant = closest(name, section.key.iter().copied()).unwrap_or(first);
            let problem = Problem::new(code::UNKNOWN_KEY, key.span()).key(name);
            let problem = problem.title(format!("unknown key `{name}`"));
            let problem =
                problem.expected(format!("expected {}, by which the row is found", keys.join(", ")));
            return self.findings.push(self.source, problem.help(format!("did you mean `{meant}`?")));
        }
        let message = format!("expected {}, by which the row is found", keys.join(", "));
        let example = known
            .iter()
            .find_map(|known| known.get_ref().as_table()?.get(first).map(|value| canonical(value.get_ref())));
        let problem = Problem::new(code::OVERLAY_NO_KEY, span).key(section.name).expected(message);
        let help = example.map(|value| format!("add it, as in `{first} = {value}`")).unwrap_or_default();
        self.findings.push(self.source, problem.help(help));
    }

    /// Takes keys of a row away; whether there were any.
    fn remove_keys(
        &mut self,
        row: &mut Value<'_>,
        place: Range<usize>,
        keys: &DeValue<'_>,
        by: &Range<usize>,
    ) -> bool {
        let (DeValue::Table(row), DeValue::Array(keys)) = (row.get_mut(), keys) else {
            self.problem(code::WRONG_TYPE, place, REMOVE, "expected true, or a list of keys");
            return true;
        };
        for key in keys {
            let found = key.get_ref().as_str().and_then(|name| row.remove(name));
            if let Some(found) = &found {
                self.lost(found, by);
            } else {
                let keys: Vec<String> = row.keys().map(|key| format!("`{}`", key.get_ref())).collect();
                let message = format!("expected a key that the row has: {}", keys.join(", "));
                self.problem(code::OVERLAY_REMOVES_NOTHING, key.span(), REMOVE, message);
            }
        }
        true
    }

    /// Lays the keys of a row over one that is there.
    fn row<'t>(
        &mut self,
        section: &Section,
        known: &mut Value<'t>,
        row: DeTable<'t>,
        span: Range<usize>,
        mut changed: bool,
    ) {
        let before = known.span();
        let DeValue::Table(mut table) = std::mem::replace(known.get_mut(), DeValue::Boolean(false)) else {
            return;
        };
        if section.either.iter().any(|key| row.contains_key(*key)) {
            for key in section.either.iter().filter(|key| !row.contains_key(**key)) {
                let old = table.remove(*key);
                changed |= old.is_some();
                old.iter().for_each(|old| self.lost(old, &span));
            }
        }
        let mut nested = false;
        for (key, value) in row {
            let is_key = section.key.contains(&key.get_ref().as_ref());
            let list = section.lists.iter().find(|list| list.name == *key.get_ref());
            match (list, table.get_mut(key.get_ref().as_ref())) {
                (Some(list), Some(known)) => {
                    nested = true;
                    self.list(list, known, value);
                }
                _ => {
                    // What identifies the row is shown where the overlay has it.
                    let old = table.remove(key.get_ref().as_ref());
                    let same = |old: &Value<'_>| canonical(old.get_ref()) == canonical(value.get_ref());
                    if !is_key && !old.as_ref().is_some_and(same) {
                        changed = true;
                        old.iter().for_each(|old| self.lost(old, &span));
                    }
                    table.insert(key, value);
                }
            }
        }
        // What is wrong with the row now is wrong with the overlay.
        *known = Spanned::new(span.clone(), DeValue::Table(table));
        // The rows of a list within say themselves whether they change something.
        if !changed && !nested {
            let problem = Problem::new(code::OVERLAY_NO_EFFECT, span).key(section.name);
            let problem = problem.expected("every key of this row is as it was");
            self.findings.push(self.source, problem.related(before, "the row as it was"));
        }
    }

    /// Lays keys over a table that is there once.
    fn single<'t>(&mut self, key: &Spanned<toml::de::DeString<'t>>, known: &mut Value<'t>, value: Value<'t>) {
        let (span, name) = (value.span(), key.get_ref().as_ref());
        let (DeValue::Table(known), DeValue::Table(value)) = (known.get_mut(), value.into_inner()) else {
            return self.problem(code::WRONG_TYPE, span, name, "expected a table");
        };
        let mut changed = false;
        for (key, value) in value {
            let old = known.remove(key.get_ref().as_ref());
            let same = |old: &Value<'_>| canonical(old.get_ref()) == canonical(value.get_ref());
            if !old.as_ref().is_some_and(same) {
                changed = true;
                old.iter().for_each(|old| self.lost(old, &value.span()));
            }
            known.insert(key, value);
        }
        if !changed {
            self.problem(code::OVERLAY_NO_EFFECT, span, name, "every key of this table is as it was");
        }
    }
}

/// What is known of a row that the table does not have.
fn hint(section: &Section, row: &DeTable<'_>, known: &[Value<'_>]) -> Option<Hint> {
    let key = *section.key.first()?;
    let own = row.get(key)?;
    let names = known.iter().filter_map(|row| row.get_ref().as_table()?.get(key)?.get_ref().as_str());
    let near = own.get_ref().as_str().and_then(|own| closest(own, names.filter(|name| *name != own)));
    Some(Hint {
        key: key.to_owned(),
        span: own.span(),
        written: format!("`{key} = {}`", canonical(own.get_ref())),
        near: near.map(str::to_owned),
    })
}

/// What tells the row from others; `None` without the first of the keys.
fn identity(section: &Section, row: &DeTable<'_>) -> Option<String> {
    let values = section.key.iter().map(|key| row.get(*key));
    let texts: Vec<String> = values
        .map(|value| value.map_or_else(|| "-".to_owned(), |value| canonical(value.get_ref())))
        .collect();
    // A field of bits in pieces has no `bits`.
    let has_one = section.key.iter().take(2).any(|key| row.contains_key(*key));
    let first = section.key.first().is_some_and(|key| row.contains_key(*key));
    (first || has_one && section.name == "fields").then(|| texts.join("|"))
}

/// The same text for the same value, however it is written.
pub(crate) fn canonical(value: &DeValue<'_>) -> String {
    let mut text = String::new();
    write_canonical(value, &mut text);
    text
}

fn write_canonical(value: &DeValue<'_>, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = match value {
        DeValue::String(value) => write!(text, "{value:?}"),
        DeValue::Integer(value) => match i128::from_str_radix(value.as_str(), value.radix()) {
            Ok(number) => write!(text, "{number}"),
            Err(_) => write!(text, "{value}"),
        },
        DeValue::Float(value) => match value.as_str().parse::<f64>() {
            Ok(number) => write!(text, "{number:?}"),
            Err(_) => write!(text, "{value}"),
        },
        DeValue::Boolean(value) => write!(text, "{value}"),
        DeValue::Datetime(value) => write!(text, "{value}"),
        DeValue::Array(values) => {
            text.push('[');
            for value in values {
                write_canonical(value.get_ref(), text);
                text.push(',');
            }
            write!(text, "]")
        }
        DeValue::Table(table) => {
            text.push('{');
            for (key, value) in table {
                let _ = write!(text, "{:?}=", key.get_ref());
                write_canonical(value.get_ref(), text);
                text.push(',');
            }
            write!(text, "}}")
        }
    };
}

/// An attribute has one answer: what an overlay serves is rejected no more, and the other way round.
fn answer_once(table: &mut DeTable<'_>, rows: &DeTable<'_>) {
    let name =
        |row: &Value<'_>| Some(row.get_ref().as_table()?.get("attribute")?.get_ref().as_str()?.to_owned());
    let served: Vec<String> = list(rows, "attribute").filter_map(name).collect();
    let rejected: Vec<String> = list(rows, "reject")
        .filter_map(|row| row.get_ref().as_table()?.get("attributes")?.get_ref().as_array())
        .flat_map(|names| names.iter())
        .filter_map(|name| name.get_ref().as_str().map(str::to_owned))
        .collect();
    if let Some(DeValue::Array(attributes)) = table.get_mut("attribute").map(Spanned::get_mut) {
        let all = std::mem::replace(attributes, DeArray::new());
        *attributes =
            all.into_iter().filter(|row| name(row).is_none_or(|name| !rejected.contains(&name))).collect();
    }
    let Some(DeValue::Array(rejects)) = table.get_mut("reject").map(Spanned::get_mut) else { return };
    for row in rejects.iter_mut() {
        let DeValue::Table(row) = row.get_mut() else { continue };
        let Some(DeValue::Array(names)) = row.get_mut("attributes").map(Spanned::get_mut) else { continue };
        let said = |name: &Value<'_>| {
            name.get_ref()
                .as_str()
                .is_some_and(|name| served.iter().chain(&rejected).any(|known| known == name))
        };
        let all = std::mem::replace(names, DeArray::new());
        *names = all.into_iter().filter(|name| !said(name)).collect();
    }
}

/// The rows of a list of a tree.
fn list<'a, 't>(rows: &'a DeTable<'t>, name: &str) -> impl Iterator<Item = &'a Value<'t>> {
    rows.get(name).and_then(|list| list.get_ref().as_array()).into_iter().flat_map(|rows| rows.iter())
}

/// The same tree with its places further behind.
fn shifted<'t>(value: &Value<'t>, by: usize) -> Value<'t> {
    let span = value.span();
    let span = span.start + by..span.end + by;
    let shifted = match value.get_ref() {
        DeValue::Array(values) => DeValue::Array(values.iter().map(|value| shifted(value, by)).collect()),
        DeValue::Table(table) => {
            let move_key = |key: &Spanned<toml::de::DeString<'t>>| {
                let span = key.span();
                Spanned::new(span.start + by..span.end + by, key.get_ref().clone())
            };
            DeValue::Table(table.iter().map(|(key, value)| (move_key(key), shifted(value, by))).collect())
        }
        other => other.clone(),
    };
    Spanned::new(span, shifted)
}
