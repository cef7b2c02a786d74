//! The clause table: `cip-motion.toml` in this folder. The tables of the page are written from it, and the state of each row is derived.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::attributes::Clause;
use super::named_tests::why_not;

/// The head of a table that is written.
const HEAD: &str = "| clause | what it requires | state | where | shown by | gap, notes |";
const RULE: &str = "|---|---|---|---|---|---|";

/// Where paths begin that are not those of the repository.
const DEVICE: &str = "profile-cip/src/device";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    section: Vec<Section>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    title: String,
    row: Vec<Row>,
}

/// The head of the file explains the keys.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Row {
    pub clause: String,
    pub requires: String,
    pub place: String,
    pub tests: Vec<String>,
    pub refused_by: Vec<String>,
    pub gap: String,
    pub note: String,
    pub not_applicable: String,
    pub of_the_drive: String,
}

/// What a row may claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    Done,
    Partly,
    Not,
    TheDrives,
    NotApplicable,
}

impl Row {
    /// The state that follows from what the row has, and from the attributes of its clause; or why none does.
    pub fn state(&self, attributes: Option<&Clause>) -> Result<State, String> {
        let (tests, gap) = (!self.tests.is_empty(), !self.gap.is_empty());
        let state = match (self.not_applicable.is_empty(), self.of_the_drive.is_empty()) {
            (false, false) => return Err("it is n/a and the drive's".to_owned()),
            (true, true) => match (tests, gap) {
                (true, false) => State::Done,
                (true, true) => State::Partly,
                (false, true) => State::Not,
                (false, false) => return Err("it has neither test nor gap nor reason".to_owned()),
            },
            _ if tests || gap || !self.refused_by.is_empty() => {
                return Err("with a reason, it has no test and no gap".to_owned());
            }
            (false, true) => State::NotApplicable,
            (true, false) => State::TheDrives,
        };
        let Some(attributes) = attributes else { return Ok(state) };
        match (state, attributes.is_rejected(), attributes.is_whole()) {
            (State::Not, true, _) | (State::Partly, false, _) | (State::Done, false, true) => Ok(state),
            (State::Done, false, false) => {
                Err("attributes are rejected or without effect: a gap is expected".to_owned())
            }
            (_, true, _) => Err("every attribute is rejected: a gap and no test is expected".to_owned()),
            _ => Err("attributes are served: a test is expected".to_owned()),
        }
    }

    /// The row of the page.
    fn line(&self, state: State, attributes: Option<&Clause>) -> String {
        let state = match state {
            State::Done => "done".to_owned(),
            State::Partly => "partly".to_owned(),
            State::Not => "not".to_owned(),
            State::TheDrives => format!("the drive's: {}", self.of_the_drive),
            State::NotApplicable => format!("n/a: {}", self.not_applicable),
        };
        let requires = match attributes {
            Some(attributes) => format!("{} {}", self.requires, attributes.rows()),
            None => self.requires.clone(),
        };
        let test = |test: &String| format!("`{test}`");
        let refusal = |test: &String| format!("refused: `{test}`");
        let tests: Vec<_> = self.tests.iter().map(test).chain(self.refused_by.iter().map(refusal)).collect();
        let note = Some(&self.note).filter(|note| !note.is_empty()).map(|note| format!("note: {note}"));
        let gap = Some(self.gap.clone()).filter(|gap| !gap.is_empty());
        let last: Vec<_> = gap.into_iter().chain(note).collect();
        let cells =
            [self.clause.clone(), requires, state, self.place.clone(), tests.join("<br>"), last.join("; ")];
        let cells = cells.map(|cell| if cell.is_empty() { "-".to_owned() } else { cell });
        format!("| {} |", cells.join(" | "))
    }

    /// Paths of a row that are not there.
    fn lost_paths(&self, root: &Path) -> Vec<String> {
        let is_path =
            |word: &&str| word.contains('/') || [".rs", ".toml", ".md"].iter().any(|end| word.ends_with(end));
        let words = self.place.split('`').skip(1).step_by(2).filter(is_path);
        let lost = words
            .filter(|word| ![root.join(word), root.join(DEVICE).join(word)].iter().any(|path| path.exists()));
        lost.map(|word| format!("{}: `{word}` is not there", self.clause)).collect()
    }
}

impl Table {
    pub fn read() -> Self {
        toml::from_str(include_str!("cip-motion.toml")).expect("the clause table")
    }

    fn rows(&self) -> impl Iterator<Item = &Row> {
        self.section.iter().flat_map(|section| &section.row)
    }

    /// What is wrong in it.
    pub fn faults(&self, root: &Path, attributes: &BTreeMap<&str, Clause>) -> Vec<String> {
        let mut faults = Vec::new();
        for row in self.rows() {
            let clause = &row.clause;
            faults.extend(
                row.state(attributes.get(clause.as_str())).err().map(|why| format!("{clause}: {why}")),
            );
            faults.extend(row.lost_paths(root));
            let tests = row.tests.iter().chain(&row.refused_by);
            faults.extend(
                tests.filter_map(|test| why_not(root, test).err()).map(|why| format!("{clause}: {why}")),
            );
            let texts =
                [&row.requires, &row.place, &row.gap, &row.note, &row.not_applicable, &row.of_the_drive];
            if texts.iter().any(|text| text.contains(['|', '\n'])) {
                faults.push(format!("{clause}: a cell has a `|` or a line break"));
            }
            if self.rows().filter(|other| other.clause == *clause).count() > 1 {
                faults.push(format!("{clause}: there are two rows"));
            }
        }
        let known = |clause: &&str| self.rows().any(|row| row.clause == **clause);
        let lost = attributes.keys().filter(|clause| !known(clause));
        faults.extend(lost.map(|clause| format!("{clause}: it has attributes and no row")));
        faults
    }

    /// The page with its tables of clauses as they follow from this one. A table stands below the heading of its section.
    pub fn written(&self, page: &str, attributes: &BTreeMap<&str, Clause>) -> Result<String, String> {
        let mut text = String::new();
        let mut section: Option<&Section> = None;
        let (mut written, mut is_table) = (Vec::new(), false);
        for line in page.lines() {
            if let Some(title) = line.strip_prefix("## ") {
                section = self.section.iter().find(|section| section.title == title);
            }
            if is_table && line.starts_with('|') {
                continue;
            }
            is_table = line.starts_with("| clause | what it requires |");
            if !is_table {
                text += line;
                text.push('\n');
                continue;
            }
            let section = section.ok_or_else(|| format!("a table below a heading that has none: {line}"))?;
            if written.contains(&&section.title) {
                return Err(format!("two tables below {}", section.title));
            }
            written.push(&section.title);
            text += &format!("{HEAD}\n{RULE}\n");
            for row in &section.row {
                let attributes = attributes.get(row.clause.as_str());
                let state = row.state(attributes).map_err(|why| format!("{}: {why}", row.clause))?;
                text += &row.line(state, attributes);
                text.push('\n');
            }
        }
        match self.section.iter().find(|section| !written.contains(&&section.title)) {
            Some(section) => Err(format!("the page has no table below {}", section.title)),
            None => Ok(text),
        }
    }
}

fn row(tests: usize, gap: &str) -> Row {
    let own = "tests/tests/files/compliance/clauses.rs::a_state_follows_from_tests_gap_and_reason";
    Row {
        clause: "9-9".to_owned(),
        tests: vec![own.to_owned(); tests],
        gap: gap.to_owned(),
        ..Row::default()
    }
}

#[test]
fn a_state_follows_from_tests_gap_and_reason() {
    assert_eq!(row(1, "").state(None), Ok(State::Done));
    assert_eq!(row(2, "half of it").state(None), Ok(State::Partly));
    assert_eq!(row(0, "all of it").state(None), Ok(State::Not));
    assert_eq!(row(0, "").state(None).unwrap_err(), "it has neither test nor gap nor reason");
    let reason = || "a reason".to_owned();
    for (tests, gap, good) in [(0, "", true), (1, "", false), (0, "a gap", false)] {
        let other = Row { not_applicable: reason(), ..row(tests, gap) };
        assert_eq!(other.state(None).ok(), good.then_some(State::NotApplicable));
        let drives = Row { of_the_drive: reason(), ..row(tests, gap) };
        assert_eq!(drives.state(None).ok(), good.then_some(State::TheDrives));
    }
    let both = Row { not_applicable: reason(), of_the_drive: reason(), ..Row::default() };
    assert_eq!(both.state(None).unwrap_err(), "it is n/a and the drive's");
}

#[test]
fn a_state_is_never_better_than_the_attributes_of_its_clause() {
    let clause = |kinds: &[(&'static str, usize)]| Clause {
        kinds: kinds.iter().copied().collect(),
        ..Clause::default()
    };
    let (whole, some) = (clause(&[("parameter", 4)]), clause(&[("parameter", 4), ("rejected", 1)]));
    let (stored, none) = (clause(&[("parameter", 4), ("stored", 1)]), clause(&[("rejected", 3)]));
    assert_eq!(row(1, "").state(Some(&whole)), Ok(State::Done));
    assert_eq!(row(1, "a gap").state(Some(&whole)), Ok(State::Partly));
    for clause in [&some, &stored] {
        assert!(row(1, "").state(Some(clause)).unwrap_err().ends_with("a gap is expected"));
        assert_eq!(row(1, "a gap").state(Some(clause)), Ok(State::Partly));
        assert!(row(0, "a gap").state(Some(clause)).unwrap_err().ends_with("a test is expected"));
    }
    assert_eq!(row(0, "all of it").state(Some(&none)), Ok(State::Not));
    for row in [row(1, ""), row(1, "a gap"), Row { not_applicable: "a reason".to_owned(), ..Row::default() }]
    {
        assert!(row.state(Some(&none)).unwrap_err().starts_with("every attribute is rejected"));
    }
}

#[test]
fn what_is_wrong_in_a_row_is_named() {
    let root = super::named_tests::root();
    let faults = |row: Row| {
        let table = Table { section: vec![Section { title: "9".to_owned(), row: vec![row] }] };
        table.faults(&root, &BTreeMap::new())
    };
    assert_eq!(faults(row(1, "")), [""; 0]);
    let place = "`motion/receive.rs`, `gateway/src/eds/`, `[scaling]`, `nowhere.rs`".to_owned();
    assert_eq!(faults(Row { place, ..row(1, "") }), ["9-9: `nowhere.rs` is not there"]);
    let test = "tests/tests/files/compliance/clauses.rs::row".to_owned();
    let refused = Row { refused_by: vec![test], ..row(0, "all of it") };
    assert_eq!(faults(refused), ["9-9: tests/tests/files/compliance/clauses.rs: `row` is no test"]);
    assert_eq!(faults(row(0, "a | b")), ["9-9: a cell has a `|` or a line break"]);
}

#[test]
fn a_table_that_the_page_lacks_or_has_too_much_is_noticed() {
    let table =
        |title: &str| Table { section: vec![Section { title: title.to_owned(), row: vec![row(0, "x")] }] };
    let page = "## 9\n\nText.\n\n| clause | what it requires | state |\n|---|\n| old | done |\n\nMore.\n";
    let none = BTreeMap::new();
    let written = format!("## 9\n\nText.\n\n{HEAD}\n{RULE}\n| 9-9 | - | not | - | - | x |\n\nMore.\n");
    assert_eq!(table("9").written(page, &none), Ok(written));
    assert!(table("8").written(page, &none).is_err());
    assert_eq!(table("9").written("## 9\n", &none).unwrap_err(), "the page has no table below 9");
}
