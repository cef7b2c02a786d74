//! `axisbridge check` as a process: arguments, exit status, output.

use std::process::{Command, Output};

fn check(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_axisbridge"));
    command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    command.arg("check").args(arguments).output().expect("the program starts")
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn what_is_shipped_is_good() {
    let output = check(&[]);
    assert_eq!(output.status.code(), Some(0), "{}", out(&output));
    assert!(out(&output).starts_with("0 errors, 0 warnings, "), "{}", out(&output));
    for config in [
        "examples/two-axes-in-process.toml",
        "examples/two-axes-sercos.toml",
        "examples/two-axes-can.toml",
        "examples/two-axes-devicenet.toml",
    ] {
        let output = check(&["--config", config, "--mappings", "examples/overlays"]);
        assert_eq!(output.status.code(), Some(0), "{}", out(&output));
        assert!(
            out(&output).contains("checked the tables, those of 6 families of drives, 1 overlay, 2 axes"),
            "{}",
            out(&output)
        );
    }
}

#[test]
fn findings_are_status_one_and_notes_are_shown_when_asked_for() {
    let case = "tests/broken/70-no-effect/overlay.toml";
    let output = check(&["--mappings", case]);
    assert_eq!(output.status.code(), Some(1));
    assert!(out(&output).contains("warning[AX0070]") && !out(&output).contains("note["), "{}", out(&output));
    assert!(out(&check(&["--notes"])).contains("note[AX0050]"));
    let json: serde_json::Value =
        serde_json::from_str(&out(&check(&["--mappings", case, "--format", "json"]))).unwrap();
    assert_eq!((&json["format"], &json["errors"], &json["warnings"]), (&1.into(), &0.into(), &2.into()));
    let missing = check(&["--config", "no-such-file.toml"]);
    assert_eq!((missing.status.code(), out(&missing).contains("error[AX0001]")), (Some(1), true));
}

#[test]
fn codes_are_explained_and_listed() {
    let output = check(&["--explain", "ax0010"]);
    assert_eq!(output.status.code(), Some(0));
    insta::assert_snapshot!(out(&output));
    assert_eq!(check(&["--explain", "AX9999"]).status.code(), Some(2));
    let list = out(&check(&["--list"]));
    assert!(list.contains("AX0010 error   an unknown name\n"), "{list}");
    assert_eq!(out(&check(&["--list", "--format", "markdown"])), include_str!("../../docs/findings.md"));
    assert_eq!(check(&["--format", "markdown"]).status.code(), Some(2));
}

#[test]
fn schemas_are_written() {
    let names = out(&check(&["--schema"]));
    assert_eq!(names.lines().count(), 18, "{names}");
    let schema: serde_json::Value =
        serde_json::from_str(&out(&check(&["--schema", "generic-sercos"]))).unwrap();
    let parameter = &schema["definitions"]["SercosParameterRow"]["properties"]["parameter"]["enum"];
    assert!(parameter.as_array().unwrap().contains(&"jerk_limit".into()));
    assert_eq!(check(&["--schema", "nothing"]).status.code(), Some(2));
}
