//! The lines of code that `docs/architecture.md` gives, counted anew.

use std::path::Path;

use super::compliance::root;

/// Lines of code of a source: without blank lines, comments and what is compiled for tests only.
fn lines_of_code(source: &str) -> usize {
    let mut lines = source.lines().filter(|line| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with("//")
    });
    let mut count = 0;
    while let Some(line) = lines.next() {
        if !line.trim_start().starts_with("#[cfg(test)]") && !line.trim_start().starts_with("#[cfg(all(test")
        {
            count += 1;
            continue;
        }
        let Some(item) = lines.next() else { break };
        if item.ends_with('{') {
            let indent = &item[..item.len() - item.trim_start().len()];
            let end = format!("{indent}}}");
            lines.by_ref().find(|line| *line == end);
        }
    }
    count
}

/// Lines of code of a file, or of what a folder has besides tests.
fn size(path: &Path) -> usize {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    if path.is_dir() {
        let entries = std::fs::read_dir(path).expect("the folder can be read");
        let tests = name == "tests" || name.ends_with("_tests");
        return if tests { 0 } else { entries.flatten().map(|entry| size(&entry.path())).sum() };
    }
    let is_test =
        ["test.rs", "tests.rs"].iter().any(|end| name == *end || name.ends_with(&format!("_{end}")));
    if !name.ends_with(".rs") || is_test {
        return 0;
    }
    lines_of_code(
        &std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())),
    )
}

/// Where a path of the page is: of a crate, or below `gateway/src`.
fn place(root: &Path, path: &str) -> std::path::PathBuf {
    let of_crate = root.join(path);
    if path.ends_with('/') && !path.trim_end_matches('/').contains('/') && of_crate.is_dir() {
        return of_crate.join("src");
    }
    if of_crate.exists() { of_crate } else { root.join("gateway/src").join(path) }
}

#[test]
fn what_is_code_is_counted() {
    let source = "//! Doc.\n\nuse a;\n/// Doc.\nfn b() {\n    c(); // why\n}\n\n#[cfg(test)]\nmod tests {\n    fn d() {\n    }\n}\n#[cfg(test)]\nmod e;\nfn f() {}\n";
    assert_eq!(lines_of_code(source), 5);
}

/// Rows whose first cell is made of paths and whose last is a number. A hundredth of it, or three lines, are no difference.
#[test]
fn the_page_on_the_architecture_has_the_sizes_of_the_sources() {
    let root = root();
    let page = std::fs::read_to_string(root.join("docs/architecture.md")).expect("the page is there");
    let mut wrong = Vec::new();
    let mut rows = 0;
    for line in page.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [what, given] = cells[..] else { continue };
        let Ok(given) = given.trim_matches('*').parse::<usize>() else { continue };
        let paths: Vec<_> = what.split('`').skip(1).step_by(2).collect();
        if paths.is_empty() {
            continue;
        }
        rows += 1;
        let counted: usize = paths.iter().map(|path| size(&place(&root, path))).sum();
        if counted.abs_diff(given) > (given / 100).max(3) {
            wrong.push(format!("{what}: the page has {given}, the sources have {counted}"));
        }
    }
    assert!(rows >= 15, "{rows} rows were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
