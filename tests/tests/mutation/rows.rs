//! Every row of the mapping tables counts: each one is taken out, and each of its keys changed, and something must notice.
//!
//! A change is noticed by the checks of the tables themselves, by a worked example, or by the snapshot of everything that the
//! tables say (`tables.rs`). The count of each is printed; what nobody notices is a survivor. With `AXISBRIDGE_TEST_SPLIT` set, what the snapshot
//! notices is put to the golden texts of `tests/frames` and `tests/frames-can` as well, and those changes are named that no frame shows.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use axisbridge::config::Config;
use axisbridge::finding::Findings;
use axisbridge::mapping::{Mapping, check};
use axisbridge::translate::{RowNames, Stage, translate_list};
use axisbridge_tests::{can_frames, can_led, tables};
use toml::de::{DeTable, DeValue};

/// What a key says to people alone.
pub const REMARKS: [&str; 5] = ["source", "note", "examples", "reason", "name"];

/// Set to see how many of the changes a frame of `tests/frames` or `tests/frames-can` shows, and which do not show in any.
const SPLIT: &str = "AXISBRIDGE_TEST_SPLIT";

/// The mapping tables.
pub const FILES: [(&str, &str); 3] = [
    ("cip-generic.toml", include_str!("../../../mappings/tables/cip-generic.toml")),
    ("generic-sercos.toml", include_str!("../../../mappings/tables/generic-sercos.toml")),
    ("generic-cia402.toml", include_str!("../../../mappings/tables/generic-cia402.toml")),
];

/// A table with one change.
struct Mutant {
    file: usize,
    what: String,
    text: String,
}

/// Who notices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Noticed {
    Check,
    Example,
    Golden,
    Listing,
    Nobody,
}

impl fmt::Display for Noticed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Check => "noticed by the checks of the tables",
            Self::Example => "noticed by a worked example",
            Self::Golden => "noticed by a golden text of frames",
            Self::Listing => "noticed by the listing of the tables",
            Self::Nobody => "survivors",
        })
    }
}

/// A row: its bytes, and its keys with the bytes of their values.
pub struct Row {
    pub name: String,
    pub section: String,
    /// One of several.
    pub repeats: bool,
    pub span: (usize, usize),
    pub keys: Vec<(String, (usize, usize))>,
}

pub fn rows(text: &str) -> Vec<Row> {
    let tree = DeTable::parse(text).expect("the tables are TOML").into_inner();
    let mut rows: Vec<Row> = Vec::new();
    for (section, value) in &tree {
        match value.get_ref() {
            DeValue::Table(table) => rows.push(row(text, section.get_ref(), table, false)),
            DeValue::Array(list) => {
                for item in list {
                    let DeValue::Table(table) = item.get_ref() else { continue };
                    // What a group says in common is changed once for all of its rows.
                    let group = table.get("rows").map(|rows| rows.get_ref());
                    let row = row(text, section.get_ref(), table, group.is_none());
                    if !row.keys.is_empty() {
                        rows.push(row);
                    }
                    let Some(DeValue::Array(members)) = group else { continue };
                    rows.extend(members.iter().filter_map(|member| {
                        let DeValue::Table(table) = member.get_ref() else { return None };
                        let rest = &text[member.span().end..];
                        let end = member.span().end + usize::from(rest.starts_with(','));
                        let span = (member.span().start, end);
                        Some(Row { span, ..self::row(text, section.get_ref(), table, true) })
                    }));
                }
            }
            _ => {}
        }
    }
    rows.sort_by_key(|row| row.span);
    rows
}

fn row(text: &str, section: &str, table: &DeTable<'_>, repeats: bool) -> Row {
    let own = table.iter().filter(|(key, _)| *key.get_ref() != "rows");
    let mut keys: Vec<_> =
        own.map(|(key, value)| (key.get_ref().to_string(), (value.span().start, value.span().end))).collect();
    keys.sort_by_key(|(_, span)| *span);
    let first = keys.first().map_or("", |(_, (start, end))| &text[*start..*end]);
    let name = format!("[{section}] {first}");
    // From its head to the end of its last value.
    let start = keys.first().and_then(|(_, (start, _))| text[..*start].rfind("\n["));
    let end = keys.last().map_or(0, |(_, (_, end))| *end);
    let start = start.map_or(0, |start| start + 1);
    Row { name, section: section.to_owned(), repeats, span: (start, end), keys }
}

/// The values in the inline tables of a value, with their keys.
pub fn inner(value: &str) -> Vec<(usize, usize, &str)> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(next) = value[at..].find(" = ") {
        let equals = at + next;
        at = equals + 3;
        let key = value[..equals].rsplit([' ', '{', '\n']).next().unwrap_or_default();
        let (mut depth, mut quoted) = (0, false);
        let end = value[at..].char_indices().find(|(_, letter)| {
            match letter {
                '"' => quoted = !quoted,
                '[' | '{' if !quoted => depth += 1,
                ']' | '}' if !quoted => depth -= 1,
                _ => {}
            }
            depth < 0 || (depth == 0 && *letter == ',' && !quoted)
        });
        let end = end.map_or(value.len(), |(end, _)| at + end);
        if !REMARKS.contains(&key) {
            found.push((at, at + value[at..end].trim_end().len(), key));
        }
    }
    found
}

/// The first string in a value, without its quotation marks.
pub fn string(value: &str) -> Option<(usize, usize)> {
    let start = value.find('"')? + 1;
    let end = start + value[start..].find('"')?;
    Some((start, end))
}

/// The first whole number in a value.
pub fn number(value: &str) -> Option<(usize, usize)> {
    let start = value.find(|letter: char| letter.is_ascii_digit())?;
    let rest = &value[start..];
    let end =
        rest.find(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_').unwrap_or(rest.len());
    Some((start, start + end))
}

/// The value with one thing in it changed.
fn changed(value: &str, others: &[&str]) -> Option<String> {
    if let Some((start, end)) = string(value) {
        let own = &value[start..end];
        let other = others.iter().find(|other| **other != own);
        let other = other.map_or_else(|| format!("{own}x"), |other| (*other).to_owned());
        return Some(format!("{}{other}{}", &value[..start], &value[end..]));
    }
    for (word, other) in [("true", "false"), ("false", "true")] {
        if value.trim_start().starts_with(word) {
            return Some(value.replacen(word, other, 1));
        }
    }
    let (start, end) = number(value)?;
    let digits = value[start..end].replace('_', "");
    let parsed = match digits.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok()?,
        None => digits.parse().ok()?,
    };
    Some(format!("{}{}{}", &value[..start], parsed + 1, &value[end..]))
}

fn mutants() -> Vec<Mutant> {
    let mut mutants = Vec::new();
    for (file, (_, text)) in FILES.into_iter().enumerate() {
        let rows = rows(text);
        // What else stands behind a key in rows of this kind.
        let mut strings: BTreeMap<(&str, &str), Vec<&str>> = BTreeMap::new();
        for row in &rows {
            for (key, (start, end)) in &row.keys {
                if let Some((from, to)) = string(&text[*start..*end]) {
                    let known = strings.entry((&row.section, key)).or_default();
                    let own = &text[start + from..start + to];
                    if !known.contains(&own) {
                        known.push(own);
                    }
                }
            }
        }
        for row in &rows {
            if row.repeats {
                let without = format!("{}{}", &text[..row.span.0], &text[row.span.1..]);
                mutants.push(Mutant { file, what: format!("{}: taken out", row.name), text: without });
            }
            for (key, (start, end)) in row.keys.iter().filter(|(key, _)| !REMARKS.contains(&key.as_str())) {
                let value = &text[*start..*end];
                for (from, to, key) in inner(value) {
                    let (from, to) = (start + from, start + to);
                    let Some(other) = changed(&text[from..to], &[]) else { continue };
                    let what = format!("{}: {key} = {} -> {other} at byte {from}", row.name, &text[from..to]);
                    let text = format!("{}{other}{}", &text[..from], &text[to..]);
                    mutants.push(Mutant { file, what, text });
                }
                if value.contains("{ ") {
                    continue;
                }
                let others =
                    strings.get(&(row.section.as_str(), key.as_str())).map_or(&[][..], Vec::as_slice);
                let Some(other) = changed(value, others) else { continue };
                let what = format!("{}: {key} = {} -> {}", row.name, value.trim(), other.trim());
                let text = format!("{}{other}{}", &text[..*start], &text[*end..]);
                mutants.push(Mutant { file, what, text });
            }
        }
    }
    mutants
}

/// The golden texts of a stage with the lists that they belong to, the shortest first.
struct Golden {
    lists: Vec<(String, Vec<String>)>,
}

impl Golden {
    fn new(stage: &Arc<Stage>, folder: &Path) -> Self {
        let mut lists: Vec<_> = std::fs::read_dir(folder)
            .expect("the folder of frames")
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path.extension().is_some_and(|ending| ending == "hex"))
            .map(|path| std::fs::read_to_string(path).expect("a list of frames"))
            .map(|list| {
                let golden = texts(stage, &list);
                (list, golden)
            })
            .collect();
        lists.sort_by_key(|(list, _)| list.len());
        Self { lists }
    }

    fn notices(&self, stage: &Arc<Stage>) -> bool {
        self.lists.iter().any(|(list, golden)| texts(stage, list) != *golden)
    }
}

fn texts(stage: &Arc<Stage>, list: &str) -> Vec<String> {
    let list = translate_list(stage, list).expect("a list of frames");
    let text = |frame: &axisbridge::translate::Node| {
        let mut text = String::new();
        frame.write(&mut text, 0, RowNames::Keys).expect("a string takes it");
        text
    };
    list.frames.iter().map(text).collect()
}

struct Judge {
    mapping: Mapping,
    stage: Arc<Stage>,
    golden: Golden,
    /// The same on CiA 402 drives, and what is led there by generic commands.
    golden_can: Golden,
    generic: Option<String>,
    listing: String,
    /// Warnings and notes of the shipped tables.
    findings: usize,
    /// Whether to tell apart what a frame shows and what the listing alone does: that takes minutes.
    splits: bool,
}

impl Judge {
    fn new() -> Self {
        let config =
            Config::parse(include_str!("../../frames/config.toml"), "config.toml").expect("a configuration");
        let mapping = Mapping::embedded().expect("the shipped tables");
        let stage = Arc::new(Stage::rehearse(&config, mapping.clone()).expect("its drives"));
        let golden = Golden::new(&stage, &Path::new(env!("CARGO_MANIFEST_DIR")).join("frames"));
        let can = Arc::new(can_frames::stage(mapping.clone()).expect("its drives"));
        let golden_can = Golden::new(&can, &can_frames::folder());
        let generic = can_led::text(&mapping).ok();
        let listing = tables::listing(&mapping, &stage);
        let mut findings = Findings::default();
        check::tables(&mapping, &mut findings);
        Self {
            mapping,
            stage,
            golden,
            golden_can,
            generic,
            listing,
            findings: findings.list().len(),
            splits: std::env::var_os(SPLIT).is_some(),
        }
    }

    fn noticed(&self, mutant: &Mutant) -> Noticed {
        let Ok(mapping) = self.mapping.with_table(FILES[mutant.file].0, &mutant.text) else {
            return Noticed::Check;
        };
        let mut findings = Findings::default();
        mapping.run_examples(&mut findings);
        if findings.has_errors() {
            return Noticed::Example;
        }
        if tables::listing(&mapping, &self.stage) == self.listing {
            // Only what nothing is made of may be left to the checks of the whole, which take their time.
            check::tables(&mapping, &mut findings);
            return if findings.list().len() == self.findings { Noticed::Nobody } else { Noticed::Check };
        }
        if !self.splits {
            return Noticed::Listing;
        }
        if can_led::text(&mapping).ok() != self.generic {
            return Noticed::Golden;
        }
        // What is not a program any more does not move anything either.
        let can = can_frames::stage(mapping.clone());
        if can.map_or(true, |stage| self.golden_can.notices(&Arc::new(stage))) {
            return Noticed::Golden;
        }
        let Ok(stage) = self.stage.with_mapping(mapping) else { return Noticed::Golden };
        if self.golden.notices(&Arc::new(stage)) { Noticed::Golden } else { Noticed::Listing }
    }
}

#[test]
fn a_change_of_any_row_is_noticed() {
    let judge = Judge::new();
    let mutants = mutants();
    assert!(mutants.len() > 1500, "rows were found: {}", mutants.len());
    let next = AtomicUsize::new(0);
    let results = Mutex::new(vec![None; mutants.len()]);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some((number, mutant)) = {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    mutants.get(number).map(|mutant| (number, mutant))
                } {
                    let noticed = judge.noticed(mutant);
                    results.lock().expect("no panic")[number] = Some(noticed);
                }
            });
        }
    });
    let results = results.into_inner().expect("no panic");
    let mut counts: BTreeMap<Noticed, Vec<&Mutant>> = BTreeMap::new();
    for (mutant, noticed) in mutants.iter().zip(results) {
        counts.entry(noticed.expect("every one was judged")).or_default().push(mutant);
    }
    println!("{} changes of rows", mutants.len());
    for noticed in [Noticed::Check, Noticed::Example, Noticed::Golden, Noticed::Listing, Noticed::Nobody] {
        println!("{:5} {noticed}", counts.get(&noticed).map_or(0, Vec::len));
    }
    for (file, (name, _)) in FILES.into_iter().enumerate() {
        let of_file = |list: &Vec<&Mutant>| list.iter().filter(|mutant| mutant.file == file).count();
        let counted: usize = counts.values().map(of_file).sum();
        println!(
            "{counted:5} of them in {name}, {} survivors",
            counts.get(&Noticed::Nobody).map_or(0, of_file)
        );
    }
    let name = |mutant: &&Mutant| format!("{} {}", FILES[mutant.file].0, mutant.what);
    if std::env::var_os(SPLIT).is_some() {
        for mutant in counts.get(&Noticed::Listing).into_iter().flatten() {
            println!("listing alone: {}", name(mutant));
        }
    }
    let survivors: Vec<_> = counts.get(&Noticed::Nobody).into_iter().flatten().map(name).collect();
    assert!(survivors.is_empty(), "nobody notices:\n{}", survivors.join("\n"));
}
