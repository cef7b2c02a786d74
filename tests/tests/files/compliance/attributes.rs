//! The attributes of clause 5-2.3: how many rows of each clause are served by whom.

use std::collections::BTreeMap;

use axisbridge::mapping::{CipAttribute, Mapping, Served};

/// Most attributes that a cell names one by one.
const NAMED: usize = 12;

/// Who serves a row, as the page names it.
const KINDS: [&str; 8] =
    ["device", "connection", "signal", "parameter", "constant", "mechanics", "stored", "rejected"];

fn kind(served: Option<&Served>) -> &'static str {
    match served {
        Some(Served::Device) => "device",
        Some(Served::Connection) => "connection",
        Some(Served::Signal { .. }) => "signal",
        Some(Served::Parameter { .. }) => "parameter",
        Some(Served::Constant(_)) => "constant",
        Some(Served::Mechanics(_)) => "mechanics",
        Some(Served::Stored) => "stored",
        None => "rejected",
    }
}

/// Whether a device that closes a loop needs it: the letters are those of the functions B, E, F, P, V and T.
fn is_required(row: &CipAttribute) -> bool {
    row.need.chars().skip(3).any(|need| need == 'R')
}

/// The rows of one clause by their kind, and those that are required and rejected.
#[derive(Debug, Default)]
pub struct Clause {
    pub kinds: BTreeMap<&'static str, usize>,
    pub missing: Vec<u16>,
}

impl Clause {
    fn count(&self, kind: &str) -> usize {
        self.kinds.get(kind).copied().unwrap_or(0)
    }

    /// `Rows: 5 signal, 4 rejected, of them required: 433, 437.`
    pub fn rows(&self) -> String {
        let kinds = KINDS.iter().filter(|kind| self.count(kind) > 0);
        let counts: Vec<_> = kinds.map(|kind| format!("{} {kind}", self.count(kind))).collect();
        let missing = match self.missing.as_slice() {
            [] => String::new(),
            few if few.len() <= NAMED => {
                let ids: Vec<_> = few.iter().map(ToString::to_string).collect();
                format!(", of them required: {}", ids.join(", "))
            }
            many => format!(", {} of them required", many.len()),
        };
        format!("Rows: {}{missing}.", counts.join(", "))
    }

    /// Whether the box serves nothing of it.
    pub fn is_rejected(&self) -> bool {
        self.count("rejected") == self.kinds.values().sum::<usize>()
    }

    /// Whether every row has an effect.
    pub fn is_whole(&self) -> bool {
        self.count("rejected") + self.count("stored") == 0
    }
}

/// The attributes of each clause, and all of them.
pub fn by_clause(mapping: &Mapping) -> (BTreeMap<&str, Clause>, Clause) {
    let served: BTreeMap<u16, Served> =
        mapping.cip.attributes.iter().map(|row| (row.attribute.id, row.served)).collect();
    let (mut clauses, mut all) = (BTreeMap::<&str, Clause>::new(), Clause::default());
    for row in mapping.dictionaries.cip.attributes() {
        let kind = kind(served.get(&row.id));
        for clause in [clauses.entry(&row.clause).or_default(), &mut all] {
            *clause.kinds.entry(kind).or_default() += 1;
            if kind == "rejected" && is_required(row) {
                clause.missing.push(row.id);
            }
        }
    }
    (clauses, all)
}

/// The page with the number of rows of each kind.
pub fn with_numbers(page: &str, all: &Clause) -> String {
    let line = |line: &str| {
        let mut cells: Vec<String> = line.split(" | ").map(str::to_owned).collect();
        let first = cells[0].trim_start_matches("| ").to_owned();
        if let ([_, _, count], true) = (&mut cells[..], KINDS.contains(&first.as_str())) {
            *count = format!("{} |", all.count(&first));
        }
        cells.join(" | ")
    };
    page.lines().map(line).fold(String::new(), |text, line| text + &line + "\n")
}

#[test]
fn a_number_that_is_not_so_is_noticed() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let (clauses, all) = by_clause(&mapping);
    let wrong = "| connection | written by it | 0 |";
    assert_eq!(with_numbers(wrong, &all).trim_end(), "| connection | written by it | 16 |");
    let rows = |clause| clauses.get(clause).map(Clause::rows).unwrap_or_default();
    assert_eq!(rows("5-2.3.2"), "Rows: 6 device.");
    assert_eq!(rows("5-2.3.24"), "Rows: 6 rejected.");
    assert!(clauses.len() >= 37, "a row for each clause with attributes");
}
