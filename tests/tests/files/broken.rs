//! Tables and configurations that are broken on purpose, one folder each under `tests/broken/`.
//!
//! A folder holds overlays (`*.toml`), a configuration (`box.toml`), a script (`script.toml`), or `make.toml`, which makes what
//! is too long or too strange to stand in a folder. What is found stands next to them as a snapshot.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use axisbridge::check::{Request, check};
use axisbridge::finding::registry::{self as code, Code, REGISTRY};
use axisbridge::finding::{Finding, Findings, json_report};
use axisbridge::mapping::Mapping;
use axisbridge::simulate::script::Script;
use serde::Deserialize;

/// `make.toml`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Make {
    /// Files to be written.
    #[serde(default)]
    file: Vec<MadeFile>,
    /// Tables in which a text is replaced.
    #[serde(default)]
    edit: Vec<Edit>,
    /// Texts that follow in a file, `{n}` counted.
    #[serde(default)]
    append: Vec<Append>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MadeFile {
    name: String,
    text: String,
    times: usize,
    #[serde(default)]
    bytes: Vec<u8>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Edit {
    table: String,
    from: String,
    to: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Append {
    name: String,
    from: usize,
    to: usize,
    text: String,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("broken")
}

fn cases() -> Vec<PathBuf> {
    let mut cases: Vec<PathBuf> =
        fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.retain(|path| path.is_dir());
    cases.sort();
    cases
}

/// A copy of a case with what `make.toml` adds.
fn made(case: &Path) -> PathBuf {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("broken").join(case.file_name().unwrap());
    let _ = fs::remove_dir_all(&place);
    copy(case, &place);
    let Ok(text) = fs::read_to_string(case.join("make.toml")) else { return place };
    fs::remove_file(place.join("make.toml")).unwrap();
    let make: Make = toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", case.display()));
    for file in make.file {
        let path = place.join(&file.name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let mut bytes = file.text.repeat(file.times).into_bytes();
        bytes.extend(file.bytes);
        fs::write(path, bytes).unwrap();
    }
    for edit in make.edit {
        let below = if edit.table.contains("-generic") || edit.table.starts_with("generic-") {
            ""
        } else {
            "dictionary"
        };
        let shipped =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../mappings/tables").join(below).join(&edit.table);
        let text = fs::read_to_string(&shipped).unwrap();
        assert!(text.contains(&edit.from), "{}: {}", edit.table, edit.from);
        let path = place.join("tables").join(below).join(&edit.table);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text.replacen(&edit.from, &edit.to, 1)).unwrap();
    }
    for append in make.append {
        let path = place.join(&append.name);
        let mut text = fs::read_to_string(&path).unwrap_or_default();
        for n in append.from..=append.to {
            text.push_str(&append.text.replace("{n}", &n.to_string()));
        }
        fs::write(path, text).unwrap();
    }
    place
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else if entry.path().extension().is_some_and(|extension| extension == "toml") {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// What is found in a case.
fn found(place: &Path) -> Findings {
    let script = place.join("script.toml");
    if script.exists() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        return Script::load(&script, &mapping).expect_err("the script is broken");
    }
    let config = place.join("box.toml");
    let mut mappings: Vec<PathBuf> =
        fs::read_dir(place).unwrap().map(|entry| entry.unwrap().path()).collect();
    mappings.retain(|path| path.extension().is_some_and(|extension| extension == "toml") && *path != config);
    mappings.sort();
    mappings.extend(Some(place.join("tables")).filter(|tables| tables.exists()));
    check(&Request { config: Some(config.as_path()).filter(|config| config.exists()), mappings: &mappings })
        .tables
        .findings
}

/// What is found without any overlay or configuration.
fn usual() -> &'static Findings {
    static USUAL: LazyLock<Findings> = LazyLock::new(|| check(&Request::default()).tables.findings);
    &USUAL
}

/// What a case has that the shipped tables have not. What every row can hold is shown where it is asked for.
fn own<'f>(case: &Path, findings: &'f Findings) -> Vec<&'f Finding> {
    let numbers = case.file_name().unwrap().to_string_lossy().contains("row-numbers");
    let list = findings.list().iter();
    list.filter(|finding| !usual().list().contains(finding) && (numbers || finding.code != code::ROW_NUMBERS))
        .collect()
}

/// The text of findings without the place where the test has made them.
fn shown(text: &str, place: &Path) -> String {
    let root = place.parent().unwrap().display().to_string();
    text.replace(&format!("{root}/"), "")
}

#[test]
fn every_finding_is_shown_as_it_is_written_down() {
    let cases = cases();
    assert!(cases.len() >= 40, "{} cases", cases.len());
    for case in cases {
        let place = made(&case);
        let findings = found(&place);
        let mut text = String::new();
        for finding in own(&case, &findings) {
            writeln!(text, "{}\n", shown(&finding.to_string(), &place)).unwrap();
        }
        assert!(!text.is_empty(), "{}: nothing found", case.display());
        if case.ends_with("23-all-at-once") {
            assert_eq!(findings, found(&place), "not the same twice");
        }
        insta::with_settings!({ snapshot_path => &case, prepend_module_to_snapshot => false, omit_expression => true }, {
            insta::assert_snapshot!("findings", text);
        });
        fs::remove_dir_all(&place).unwrap();
    }
}

#[test]
fn every_code_is_found_somewhere() {
    // Read from the snapshots, which the other test holds to what is found.
    let mut codes: BTreeSet<Code> = BTreeSet::new();
    for case in cases() {
        let text = fs::read_to_string(case.join("findings.snap")).unwrap_or_default();
        let heads = text.lines().filter_map(|line| line.split_once('[')?.1.split_once(']'));
        codes.extend(heads.filter_map(|(code, _)| Code::parse(code)));
    }
    let missing: Vec<String> = REGISTRY
        .iter()
        .map(|entry| entry.code)
        .filter(|code| !codes.contains(code))
        .map(|code| code.to_string())
        .collect();
    assert_eq!(missing, Vec::<String>::new());
}

#[test]
fn the_shipped_tables_have_neither_errors_nor_warnings() {
    let loud: Vec<String> = usual()
        .list()
        .iter()
        .filter(|finding| finding.severity() != code::Severity::Note)
        .map(ToString::to_string)
        .collect();
    assert_eq!(loud.join("\n\n"), "");
    assert_eq!(usual().beyond(), 0);
}

#[test]
fn json_has_every_finding_with_its_place() {
    let place = made(&folder().join("10-unknown-name"));
    let mut report = json_report(&found(&place));
    let own = report["findings"].as_array().unwrap().iter().filter(|finding| finding["severity"] != "note");
    report["findings"] = own.cloned().collect();
    report["notes"] = 0.into();
    insta::assert_snapshot!(shown(&format!("{report:#}"), &place));
}
