//! Tests that pages name as `file::function`: whether each exists, is part of a test program, and runs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What stands between backquotes and looks like `file.rs::function`.
pub fn named_tests(page: &str) -> BTreeSet<&str> {
    let codes = page.split('`').skip(1).step_by(2);
    codes.filter(|code| code.split_once("::").is_some_and(|(file, name)| is_test(file, name))).collect()
}

/// Whether it is neither the explanation of the form nor the path of an item.
fn is_test(file: &str, name: &str) -> bool {
    file != "file" && file.ends_with(".rs") && !name.starts_with(|letter: char| letter.is_uppercase())
}

/// What keeps a test, as `file::function`, from being one that runs.
pub fn why_not(root: &Path, test: &str) -> Result<(), String> {
    let Some((file, name)) = test.split_once("::") else {
        return Err(format!("`{test}`: expected file::function"));
    };
    let path = root.join(file);
    let source = std::fs::read_to_string(&path).map_err(|error| format!("{file}: {error}"))?;
    in_source(&source, name).map_err(|why| format!("{file}: {why}"))?;
    if is_compiled(&path) { Ok(()) } else { Err(format!("{file}: no `mod` line makes it part of a program")) }
}

/// Whether a source has the function, and whether it is a test that runs.
pub fn in_source(source: &str, name: &str) -> Result<(), String> {
    let head = format!("fn {name}(");
    let lines: Vec<&str> = source.lines().map(str::trim_start).collect();
    let is_it = |line: &&str| line.trim_start_matches("async ").starts_with(&head);
    let at = lines.iter().position(is_it).ok_or_else(|| format!("it has no `fn {name}`"))?;
    let above = lines[..at].iter().rev();
    let above: Vec<_> =
        above.take_while(|line| ["#[", "//"].iter().any(|start| line.starts_with(start))).collect();
    let has = |start: &str| above.iter().any(|line| line.starts_with(start));
    if !has("#[test]") && !has("#[tokio::test") {
        return Err(format!("`{name}` is no test"));
    }
    match ["#[ignore", "#[cfg("].into_iter().find(|start| has(start)) {
        Some("#[ignore") => Err(format!("`{name}` is ignored")),
        Some(_) => Err(format!("`{name}` is not always compiled")),
        None => Ok(()),
    }
}

/// Whether `mod` lines lead from the root of a crate or of a test program to a file.
pub fn is_compiled(file: &Path) -> bool {
    let Some(folder) = file.parent() else { return false };
    let stem = |path: &Path| path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned);
    let Some(name) = stem(file) else { return false };
    let is_root = matches!(name.as_str(), "lib" | "main");
    if folder.ends_with("src") && is_root {
        return true;
    }
    if is_program(folder) || (is_root && folder.parent().is_some_and(is_program)) {
        return true;
    }
    // The folder in which the module stands, and its name there.
    let (folder, name) = match name.as_str() {
        "mod" => match (folder.parent(), stem(folder)) {
            (Some(above), Some(name)) => (above, name),
            _ => return false,
        },
        _ => (folder, name),
    };
    let inside = ["mod.rs", "lib.rs", "main.rs"].map(|file| folder.join(file));
    let parents = inside.into_iter().chain([folder.with_extension("rs")]);
    let declares = |parent: &PathBuf| {
        let source = std::fs::read_to_string(parent).unwrap_or_default();
        let line = format!("mod {name};");
        let is_it = |text: &str| text == line || text.ends_with(&format!(" {line}"));
        source.lines().map(str::trim_start).any(|text| is_it(text) && !text.starts_with("//"))
    };
    parents.filter(declares).any(|parent| is_compiled(&parent))
}

/// Whether each file of a folder is a test program of its own.
fn is_program(folder: &Path) -> bool {
    folder.ends_with("tests") && folder.parent().is_some_and(|crate_| crate_.join("Cargo.toml").is_file())
}

#[test]
fn a_test_that_does_not_run_is_noticed() {
    let source = "#[test]\nfn runs() {}\n\n#[test]\n#[ignore = \"slow\"]\nfn ignored() {}\n\nfn helper() {}\n\n/// Text.\n#[test]\n\
                  #[cfg(feature = \"x\")]\nfn sometimes() {}\n\n    #[tokio::test]\n    async fn later() {}\n// fn gone()\n";
    assert_eq!(in_source(source, "runs"), Ok(()));
    assert_eq!(in_source(source, "later"), Ok(()));
    for (name, why) in [
        ("ignored", "`ignored` is ignored"),
        ("helper", "`helper` is no test"),
        ("sometimes", "`sometimes` is not always compiled"),
        ("gone", "it has no `fn gone`"),
        ("run", "it has no `fn run`"),
    ] {
        assert_eq!(in_source(source, name).unwrap_err(), why);
    }
    let root = root();
    let own = "tests/tests/files/compliance/named_tests.rs::a_test_that_does_not_run_is_noticed";
    assert_eq!(why_not(&root, own), Ok(()));
    assert!(
        why_not(&root, "tests/tests/nowhere.rs::one").unwrap_err().starts_with("tests/tests/nowhere.rs: ")
    );
    assert!(why_not(&root, "no name").is_err());
}

#[test]
fn a_file_that_no_program_has_is_noticed() {
    let root = root();
    for file in [
        "tests/tests/allocation.rs",
        "tests/tests/files/main.rs",
        "tests/tests/files/compliance/mod.rs",
        "profile-cip/src/device/motion/tests/faults.rs",
        "mappings/src/tests/shipped_tables.rs",
        "mappings/tests/generated.rs",
        "gateway/src/main.rs",
    ] {
        assert!(is_compiled(&root.join(file)), "{file}");
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("named_tests/src");
    std::fs::create_dir_all(&folder).expect("a folder");
    for (file, text) in [("lib.rs", "pub mod a;\n// mod b;\n"), ("a.rs", ""), ("b.rs", "")] {
        std::fs::write(folder.join(file), text).expect("a file");
    }
    assert!(is_compiled(&folder.join("a.rs")) && !is_compiled(&folder.join("b.rs")));
}

#[test]
fn tests_are_found_between_backquotes() {
    let page = "| `a/b.rs::one`<br>`a/b.rs::two` | `x` | `file::function` `std.rs::Item` |";
    assert_eq!(named_tests(page), ["a/b.rs::one", "a/b.rs::two"].into());
}
