//! The JSON Schemas that the program writes, against every shipped file and some broken ones: by another maker's validator
//! (jsonschema, PyPI).

use std::path::Path;
use std::process::Command;

use axisbridge::check::schema::{names, schema};
use axisbridge::mapping::Mapping;
use axisbridge_tests::peer;

#[test]
fn every_shipped_file_is_valid_and_broken_ones_are_not() {
    let Some(python) = peer::python_or_skip("schemas", "jsonschema") else { return };
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schemas");
    std::fs::create_dir_all(&folder).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut cases: Vec<(String, String, &str)> = Vec::new();
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
    add("examples/overlays/line-4.toml", "overlay", "good");
    for family in
        root.join("mappings/tables/families").read_dir().expect("the settings of families").flatten()
    {
        add(&family.path().display().to_string(), "overlay", "good");
    }
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
