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
    check(&Request {
        config: Some(config.as_path()).filter(|config| config.exists()),
        mappings: &mappings,
        frames: place.to_string_lossy().contains("-frames"),
    })
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
        // A magnitude that only a frame shows is found before by a rule; `check/frames.rs` of the gateway shows it alone.
        .filter(|code| code != "AX0048")
        .collect();
    assert_eq!(missing, Vec::<String>::new());
}

/// A box in which an example of the registry stands: its keys take the place of these.
const EXAMPLE_BOX: &str = "[box]\nname = \"x\"\n\n[[device]]\nname = \"d\"\nlisten = \"192.0.2.1\"\naxes = [\"x\"]\n\n[device.identity]\nvendor_id = 65_000\nproduct_code = 1\nserial_number = 1\n\n[[axis]]\nname = \"x\"\ninstance = 1\ndrive = \"a\"\nunit = \"revolution\"\n\n";
const EXAMPLE_SERCOS: &str = "[south.sercos]\ninterface = \"in-process\"\ncycle_time = \"2 ms\"\n\n[[south.sercos.drive]]\nname = \"a\"\naddress = 1\n";
const EXAMPLE_CAN: &str = "[[south.can]]\ninterface = \"in-process\"\ncycle_time = \"8 ms\"\n\n[[south.can.drive]]\nname = \"a\"\nnode = 1\n";

/// Examples that are files of their own, too long to stand in the registry, or comments; the folders of `tests/broken/` show
/// them. AX0048, which a rule finds before the frames, is shown alone in `check/frames.rs` of the gateway.
const SHOWN_ELSEWHERE: [&str; 16] = [
    "AX0002", "AX0003", "AX0009", "AX0017", "AX0048", "AX0083", "AX0087", "AX0088", "AX0090", "AX0093",
    "AX0094", "AX0096", "AX0097", "AX0098", "AX0099", "AX0101",
];

/// The tables of one text with the keys of another, row by row.
fn merged(into: &mut toml::Table, from: toml::Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(known)), toml::Value::Table(own)) => merged(known, own),
            (Some(toml::Value::Array(known)), toml::Value::Table(own)) => {
                if let Some(toml::Value::Table(last)) = known.last_mut() {
                    merged(last, own);
                }
            }
            (Some(toml::Value::Array(known)), toml::Value::Array(own))
                if own.iter().all(toml::Value::is_table) =>
            {
                for (index, row) in own.into_iter().enumerate() {
                    match (known.get_mut(index), row) {
                        (Some(toml::Value::Table(known)), toml::Value::Table(row)) => merged(known, row),
                        (_, row) => known.push(row),
                    }
                }
            }
            (_, value) => drop(into.insert(key, value)),
        }
    }
}

/// What is found with the example of a code.
fn found_in_example(place: &Path, code: &str, example: &str) -> Findings {
    let of_script = example.contains("[[step]]");
    let tables = ["[[generic", "[[cip", "[[sercos", "[[cia402", "[generic", "overlay =", "[[parameter]"];
    let is_overlay = tables.iter().any(|head| example.contains(head));
    let path = |name: &str| place.join(name);
    if of_script {
        fs::write(path("script.toml"), example).unwrap();
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        return Script::load(&path("script.toml"), &mapping).expect_err("the script is broken");
    }
    let own = if is_overlay { "" } else { example };
    let bus = if own.contains("south.can") { EXAMPLE_CAN } else { EXAMPLE_SERCOS };
    let mut table: toml::Table = toml::from_str(&format!("{EXAMPLE_BOX}{bus}")).unwrap();
    // Scalings are compared with those that the gateway sets.
    if ["AX0038", "AX0039", "AX0085"].contains(&code) {
        merged(&mut table, toml::from_str("[[south.sercos.drive]]\nset_scaling = true").unwrap());
    }
    merged(&mut table, toml::from_str(own).unwrap());
    let config = toml::to_string(&table).unwrap();
    fs::write(path("box.toml"), config).unwrap();
    let mut mappings = Vec::new();
    if is_overlay {
        let head = if example.contains("overlay =") { "" } else { "format = 1\noverlay = \"example\"\n\n" };
        fs::write(path("this-file.toml"), format!("{head}{example}\n")).unwrap();
        mappings.push(path("this-file.toml"));
    }
    let frames = ["AX0047", "AX0048", "AX0049"].contains(&code);
    check(&Request { config: Some(&path("box.toml")), mappings: &mappings, frames }).tables.findings
}

#[test]
fn every_example_of_the_registry_gives_its_code() {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("registry");
    let mut wrong = Vec::new();
    for entry in REGISTRY.iter().filter(|entry| !SHOWN_ELSEWHERE.contains(&entry.code.to_string().as_str())) {
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(&place).unwrap();
        let findings = found_in_example(&place, &entry.code.to_string(), entry.example);
        if !findings.list().iter().any(|finding| finding.code == entry.code) {
            let codes: Vec<String> = findings
                .list()
                .iter()
                .filter(|found| found.asks())
                .map(|found| found.code.to_string())
                .collect();
            wrong.push(format!("{}: {codes:?}", entry.code));
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
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
