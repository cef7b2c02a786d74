//! The compliance page names tests; each of them has to exist.

use std::collections::BTreeSet;
use std::path::Path;

const PAGE: &str = include_str!("../../docs/compliance-cip-motion.md");

/// What stands between backquotes and looks like `file.rs::function`.
fn named_tests(page: &str) -> BTreeSet<(&str, &str)> {
    page.split('`').skip(1).step_by(2).filter_map(|code| code.split_once("::")).collect()
}

fn has_function(source: &str, name: &str) -> bool {
    let head = format!("fn {name}(");
    source.lines().any(|line| line.trim_start().trim_start_matches("async ").starts_with(&head))
}

#[test]
fn every_test_that_the_page_names_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let tests = named_tests(PAGE);
    assert!(tests.len() > 150, "only {} tests were found in the page", tests.len());
    let mut missing = Vec::new();
    for (file, name) in tests {
        if file == "file" {
            continue; // The explanation of the form.
        }
        match std::fs::read_to_string(root.join(file)) {
            Ok(source) if has_function(&source, name) => {}
            Ok(_) => missing.push(format!("{file} has no `fn {name}`")),
            Err(error) => missing.push(format!("{file}: {error}")),
        }
    }
    assert!(missing.is_empty(), "named in docs/compliance-cip-motion.md:\n{}", missing.join("\n"));
}

#[test]
fn a_test_that_does_not_exist_is_noticed() {
    assert_eq!(
        named_tests("| `a/b.rs::one`<br>`a/b.rs::two` | `x` |"),
        [("a/b.rs", "one"), ("a/b.rs", "two")].into()
    );
    assert!(has_function("    fn one() {", "one"));
    assert!(!has_function("fn one_more() {}\n// fn one()", "one"));
}
