//! The pages on what the box does of CIP Motion, SERCOS and CANopen name tests; each of them has to exist and to run. The tables of
//! the page on CIP Motion are written from a clause table and from the mapping tables.

mod attributes;
mod clauses;
mod named_tests;

use axisbridge::mapping::Mapping;

use self::attributes::{by_clause, with_numbers};
use self::clauses::Table;
pub use self::named_tests::root;
use self::named_tests::{named_tests, why_not};

/// A page in `docs/` and how many tests it names at least: fewer are a page that is not read rightly.
const PAGES: [(&str, usize); 4] =
    [("compliance-cip-motion.md", 150), ("sercos.md", 150), ("canopen.md", 60), ("architecture.md", 50)];

const ACCEPT: &str = "AXISBRIDGE_ACCEPT";

#[test]
fn every_test_that_a_page_names_exists_and_runs() {
    let root = root();
    for (name, least) in PAGES {
        let page = std::fs::read_to_string(root.join("docs").join(name)).expect("the page is there");
        let tests = named_tests(&page);
        assert!(tests.len() > least, "only {} tests were found in docs/{name}", tests.len());
        let missing: Vec<_> = tests.iter().filter_map(|test| why_not(&root, test).err()).collect();
        assert!(missing.is_empty(), "named in docs/{name}:\n{}", missing.join("\n"));
    }
}

#[test]
fn the_page_is_that_of_the_clause_table_and_of_the_mapping_tables() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let (clauses, all) = by_clause(&mapping);
    let (table, root) = (Table::read(), root());
    let faults = table.faults(&root, &clauses);
    assert!(faults.is_empty(), "in cip-motion.toml:\n{}", faults.join("\n"));
    let path = root.join("docs/compliance-cip-motion.md");
    let page = std::fs::read_to_string(&path).expect("the page is there");
    let written = table.written(&page, &clauses).map(|page| with_numbers(&page, &all));
    let written = written.unwrap_or_else(|why| panic!("{why}"));
    if std::env::var_os(ACCEPT).is_some() {
        std::fs::write(&path, &written).expect("the page can be written");
        return;
    }
    let wrong = page.lines().zip(written.lines()).find(|(page, written)| page != written);
    assert!(page == written, "written anew with {ACCEPT}=1: {wrong:?}");
}
