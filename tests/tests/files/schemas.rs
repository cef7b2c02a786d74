//! The JSON Schemas that the program writes, against every shipped file and some broken ones: by other makers' validators
//! (jsonschema of PyPI; taplo, which editors use).

use std::path::{Path, PathBuf};
use std::process::Command;

use axisbridge::check::schema::{names, schema};
use axisbridge::finding::Severity;
use axisbridge::mapping::Mapping;
use axisbridge::mapping::check::check;
use axisbridge_tests::peer;

/// A file, its schema, and whether it is `good` or `bad`.
type Case = (String, String, &'static str);

/// Writes the schemas into a folder. Gives it and all files.
fn cases(test: &str) -> (PathBuf, Vec<Case>) {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut cases: Vec<Case> = Vec::new();
    for name in names() {
        let schema = schema(name, &mapping).expect("a schema for each name");
        std::fs::write(folder.join(format!("{name}.json")), format!("{schema:#}")).unwrap();
        for below in ["mappings/tables", "mappings/tables/dictionary"] {
            let path = root.join(below).join(format!("{name}.toml"));
            if path.exists() {
                cases.push((path.display().to_string(), name.to_owned(), "good"));
            }
        }
    }
    assert_eq!(cases.len(), 16, "every table has a schema");
    let mut add = |path: &str, name: &str, verdict| {
        cases.push((root.join(path).display().to_string(), name.to_owned(), verdict));
    };
    add("examples/two-axes-in-process.toml", "config", "good");
    add("examples/two-axes-sercos.toml", "config", "good");
    add("examples/two-axes-can.toml", "config", "good");
    add("examples/two-axes-devicenet.toml", "config", "good");
    for (folder, name) in [
        ("examples/overlays", "overlay"),
        ("mappings/tables/families", "overlay"),
        ("examples/scripts", "script"),
    ] {
        for file in root.join(folder).read_dir().expect("a folder").flatten() {
            add(&file.path().display().to_string(), name, "good");
        }
    }
    add("tests/broken/95-script/script.toml", "script", "bad");
    // What the program refuses for its form or for a name, the schema refuses too.
    for (case, verdict) in [
        ("05-wrong-type", "bad"),
        ("06-unknown-key", "bad"),
        ("10-unknown-name", "bad"),
        ("11-bad-idn", "bad"),
        ("22-id-out-of-range", "bad"),
        ("23-all-at-once", "bad"),
        ("73-no-identity", "bad"),
        ("74-unknown-table", "bad"),
        // These are faults only of the whole.
        ("30-unit", "good"),
        ("52-no-way-in", "good"),
        ("70-no-effect", "good"),
        ("72-removes-nothing", "good"),
    ] {
        add(&format!("tests/broken/{case}/overlay.toml"), "overlay", verdict);
    }
    (folder, cases)
}

/// The examples are sound, and `docs/mapping.md` shows them as they are.
#[test]
fn every_overlay_of_the_examples_is_sound_and_in_the_course() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let course = std::fs::read_to_string(root.join("docs/mapping.md")).expect("the course");
    let mut checked = 0;
    for file in root.join("examples/overlays").read_dir().expect("overlays").flatten() {
        let outcome = check(None, &[file.path()]);
        let bad = outcome.findings.count(Severity::Error) + outcome.findings.count(Severity::Warning);
        assert_eq!(bad, 0, "{}", outcome.findings);
        let text = std::fs::read_to_string(file.path()).expect("an overlay");
        let shown: String = text
            .lines()
            .map(|line| if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") })
            .collect();
        assert!(course.contains(&shown), "docs/mapping.md does not show {}", file.path().display());
        checked += 1;
    }
    assert_eq!(checked, 8);
}

#[test]
fn editors_see_every_shipped_file_as_valid_and_broken_ones_not() {
    let Some(taplo) = peer::taplo_or_skip("schemas in editors") else { return };
    let (folder, cases) = cases("schemas-taplo");
    for (file, name, verdict) in &cases {
        let schema = format!("file://{}", folder.join(format!("{name}.json")).display());
        let output = Command::new(&taplo)
            .args(["lint", "--no-auto-config", "--colors", "never", "--schema", &schema, file])
            .output()
            .expect("taplo starts");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), *verdict == "good", "{file}: {text}");
    }
}

#[test]
fn every_shipped_file_is_valid_and_broken_ones_are_not() {
    let Some(python) = peer::python_or_skip("schemas", "jsonschema") else { return };
    let (folder, cases) = cases("schemas");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut command = Command::new(python);
    command.arg(root.join("tests/peers/json_schema.py")).arg(&folder);
    for (file, name, verdict) in &cases {
        command.args([file.as_str(), name.as_str(), verdict]);
    }
    let output = command.output().expect("python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(text.lines().count(), cases.len());
}
