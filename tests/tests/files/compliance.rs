//! The pages on what the box does of CIP Motion, SERCOS and CANopen name tests; each of them has to exist.

use std::collections::BTreeSet;
use std::path::Path;

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
