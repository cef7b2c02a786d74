//! The pages on what the box does of CIP Motion, SERCOS and CANopen name tests; each of them has to exist.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use axisbridge::mapping::{CipAttribute, Mapping, Served};

/// A page in `docs/` and how many tests it names at least: fewer are a page that is not read rightly.
const PAGES: [(&str, &str, usize); 4] = [
    ("compliance-cip-motion.md", include_str!("../../../docs/compliance-cip-motion.md"), 150),
    ("sercos.md", include_str!("../../../docs/sercos.md"), 150),
    ("canopen.md", include_str!("../../../docs/canopen.md"), 60),
    ("architecture.md", include_str!("../../../docs/architecture.md"), 50),
];

/// What stands between backquotes and looks like `file.rs::function`.
fn named_tests(page: &str) -> BTreeSet<(&str, &str)> {
    page.split('`').skip(1).step_by(2).filter_map(|code| code.split_once("::")).collect()
}

fn has_function(source: &str, name: &str) -> bool {
    let head = format!("fn {name}(");
    source.lines().any(|line| line.trim_start().trim_start_matches("async ").starts_with(&head))
}

/// What a page names and the repository does not have.
fn missing(page: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut missing = Vec::new();
    for (file, name) in named_tests(page) {
        if file == "file" || name.starts_with(|letter: char| letter.is_uppercase()) || !file.ends_with(".rs")
        {
            continue; // The explanation of the form, or the path of an item.
        }
        match std::fs::read_to_string(root.join(file)) {
            Ok(source) if has_function(&source, name) => {}
            Ok(_) => missing.push(format!("{file} has no `fn {name}`")),
            Err(error) => missing.push(format!("{file}: {error}")),
        }
    }
    missing
}

#[test]
fn every_test_that_a_page_names_exists() {
    for (name, page, least) in PAGES {
        let tests = named_tests(page);
        assert!(tests.len() > least, "only {} tests were found in docs/{name}", tests.len());
        let missing = missing(page);
        assert!(missing.is_empty(), "named in docs/{name}:\n{}", missing.join("\n"));
    }
}

#[test]
fn a_test_that_does_not_exist_is_noticed() {
    assert_eq!(
        named_tests("| `a/b.rs::one`<br>`a/b.rs::two` | `x` |"),
        [("a/b.rs", "one"), ("a/b.rs", "two")].into()
    );
    let page = "`tests/tests/files/compliance.rs::no_such_test` `tests/tests/nowhere.rs::one`";
    let [none, nowhere] = &missing(page)[..] else { panic!("two are missing") };
    assert!(nowhere.starts_with("tests/tests/nowhere.rs: "), "{nowhere}");
    assert_eq!(none, "tests/tests/files/compliance.rs has no `fn no_such_test`");
    assert!(has_function("    fn one() {", "one"));
    assert!(!has_function("fn one_more() {}\n// fn one()", "one"));
}

const ACCEPT: &str = "AXISBRIDGE_ACCEPT";

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
#[derive(Default)]
struct Clause {
    kinds: BTreeMap<&'static str, usize>,
    missing: Vec<u16>,
}

impl Clause {
    fn count(&self, kind: &str) -> usize {
        self.kinds.get(kind).copied().unwrap_or(0)
    }

    /// `Rows: 5 signal, 4 rejected, of them required: 433, 437.`
    fn rows(&self) -> String {
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

    /// The state that the page may claim at best.
    fn state<'a>(&self, claimed: &'a str) -> &'a str {
        let without_effect = self.count("rejected") + self.count("stored");
        match claimed {
            _ if self.count("rejected") == self.kinds.values().sum::<usize>() => "not",
            "done" | "partly" if without_effect == 0 => claimed,
            _ => "partly",
        }
    }
}

/// The page with the numbers and states of clause 5-2.3 as the tables have them.
fn corrected(page: &str, mapping: &Mapping) -> String {
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
    let line = |line: &str| {
        let mut cells: Vec<String> = line.split(" | ").map(str::to_owned).collect();
        let first = cells[0].trim_start_matches("| ").to_owned();
        if let ([_, what, state, ..], Some(clause)) = (&mut cells[..], clauses.get(first.as_str()))
            && let Some((words, _)) = what.split_once("Rows: ")
        {
            (*what, *state) = (format!("{words}{}", clause.rows()), clause.state(state).to_owned());
        } else if let ([_, _, count], true) = (&mut cells[..], KINDS.contains(&first.as_str())) {
            *count = format!("{} |", all.count(&first));
        }
        cells.join(" | ")
    };
    page.lines().map(line).fold(String::new(), |text, line| text + &line + "\n")
}

#[test]
fn the_numbers_of_the_page_are_those_of_the_tables() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/compliance-cip-motion.md");
    let page = std::fs::read_to_string(&path).expect("the page is there");
    let corrected = corrected(&page, &mapping);
    assert!(corrected.matches("Rows: ").count() >= 37, "a row for each clause with attributes");
    if std::env::var_os(ACCEPT).is_some() {
        std::fs::write(&path, &corrected).expect("the page can be written");
        return;
    }
    let wrong = page.lines().zip(corrected.lines()).find(|(written, right)| written != right);
    assert!(page == corrected, "written anew with {ACCEPT}=1: {wrong:?}");
}

#[test]
fn a_number_or_state_that_is_not_so_is_noticed() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    for (wrong, right) in [
        (
            "| 5-2.3.2 | Scaling. Rows: 5 device. | partly | x |",
            "| 5-2.3.2 | Scaling. Rows: 6 device. | partly | x |",
        ),
        (
            "| 5-2.3.24 | Safety. Rows: none. | done | x |",
            "| 5-2.3.24 | Safety. Rows: 6 rejected. | not | x |",
        ),
        ("| 5-2.3.4.2 | PM. Rows: . | done | x |", "| 5-2.3.4.2 | PM. Rows: 4 parameter. | done | x |"),
        ("| connection | written by it | 0 |", "| connection | written by it | 16 |"),
    ] {
        assert_eq!(corrected(wrong, &mapping).trim_end(), right);
    }
}
