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
    // The frames are those of tables and overlays, whatever the configuration.
    let output = check(&["--mappings", "examples/overlays"]);
    assert_eq!(output.status.code(), Some(0), "{}", out(&output));
    for config in [
        "examples/two-axes-in-process.toml",
        "examples/two-axes-sercos.toml",
        "examples/two-axes-can.toml",
        "examples/two-axes-devicenet.toml",
    ] {
        let output = check(&["--config", config, "--mappings", "examples/overlays", "--no-frames"]);
        assert_eq!(output.status.code(), Some(0), "{}", out(&output));
        assert!(
            out(&output).contains("checked the tables, those of 7 families of drives, 8 overlays, 2 axes"),
            "{}",
            out(&output)
        );
    }
}

#[test]
fn findings_are_status_one_and_notes_are_shown_when_asked_for() {
    let case = "tests/broken/70-no-effect/overlay.toml";
    let of_case = |more: &[&str]| check(&[&["--mappings", case, "--no-frames"], more].concat());
    let output = of_case(&[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(out(&output).contains("warning[AX0070]") && !out(&output).contains("note["), "{}", out(&output));
    assert!(out(&check(&["--notes", "--no-frames"])).contains("note[AX0050]"));
    assert_eq!(out(&of_case(&["--json"])), out(&of_case(&["--format", "json"])));
    let sarif: serde_json::Value = serde_json::from_str(&out(&of_case(&["--format", "sarif"]))).unwrap();
    let results = sarif["runs"][0]["results"].as_array().unwrap();
    let own = results.iter().find(|result| result["ruleId"] == "AX0070").unwrap();
    let place = &own["locations"][0]["physicalLocation"];
    assert_eq!((&place["artifactLocation"]["uri"], own["level"].as_str()), (&case.into(), Some("warning")));
    let json: serde_json::Value = serde_json::from_str(&out(&of_case(&["--format", "json"]))).unwrap();
    assert_eq!((&json["format"], &json["errors"], &json["warnings"]), (&1.into(), &0.into(), &2.into()));
    let missing = check(&["--config", "no-such-file.toml"]);
    assert_eq!((missing.status.code(), out(&missing).contains("error[AX0001]")), (Some(1), true));
}

#[test]
fn codes_are_explained_and_listed() {
    let output = check(&["--explain", "ax0010"]);
    assert_eq!(output.status.code(), Some(0));
    insta::assert_snapshot!(out(&output));
    for (code, said) in [
        ("AX9999", "error: there is no code AX9999; `axisbridge check --list` prints all codes\n"),
        (
            "AX99",
            "error: `AX99` is no code: expected AX and four digits, such as AX0010; `axisbridge check --list` prints all codes\n",
        ),
    ] {
        let output = check(&["--explain", code]);
        assert_eq!(
            (output.status.code(), String::from_utf8(output.stderr).unwrap().as_str()),
            (Some(2), said)
        );
    }
    for entry in axisbridge::finding::registry::REGISTRY {
        let code = entry.code.to_string();
        let explained = out(&check(&["--explain", &code]));
        let parts = [&*code, entry.title, "Example:", entry.example.lines().next().unwrap(), "What to do: "];
        assert!(parts.iter().all(|part| explained.contains(part)), "{explained}");
    }
    let list = out(&check(&["--list"]));
    assert!(list.contains("AX0010 error   an unknown name\n"), "{list}");
    assert_eq!(out(&check(&["--list", "--format", "markdown"])), include_str!("../../docs/findings.md"));
    assert_eq!(check(&["--format", "markdown"]).status.code(), Some(2));
}

#[test]
fn schemas_are_written() {
    let names = out(&check(&["--schema"]));
    assert_eq!(names.lines().count(), 21, "{names}");
    let schema: serde_json::Value =
        serde_json::from_str(&out(&check(&["--schema", "generic-sercos"]))).unwrap();
    let parameter =
        &schema["definitions"]["SercosParameterRow"]["properties"]["parameter"]["anyOf"][0]["enum"];
    assert!(parameter.as_array().unwrap().contains(&"jerk_limit".into()));
    assert_eq!(check(&["--schema", "nothing"]).status.code(), Some(2));
}

#[test]
fn changes_against_the_shipped_tables_are_told_by_meaning() {
    let output = check(&["--diff"]);
    assert_eq!(
        (output.status.code(), out(&output).as_str()),
        (Some(0), "0 changes, 0 dangerous, 0 not acknowledged\n")
    );
    let overlay = "gateway/tests/diff/line-4.toml";
    let output = check(&["--mappings", overlay, "--diff"]);
    assert_eq!(output.status.code(), Some(1), "{}", out(&output));
    let text = out(&output);
    for said in [
        "S-0-0055 bit 0 -> S-0-0055 bit 1",
        "(60 times)",
        "S-0-0049 -> S-0-0050",
        "refuse -> omit",
        "accepted  fault",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&out(&check(&["--mappings", overlay, "--diff", "--json"]))).unwrap();
    assert_eq!((&json["dangerous"], &json["not_acknowledged"]), (&7.into(), &5.into()));
    // Against itself it changes nothing.
    let output = check(&["--mappings", overlay, "--diff", overlay]);
    assert_eq!(output.status.code(), Some(0), "{}", out(&output));
}

/// The tables of a configuration that cannot be read are not known, so that nothing can be said of what they change.
#[test]
fn tables_of_a_configuration_that_cannot_be_read_are_not_compared() {
    let folder = std::env::temp_dir().join(format!("axisbridge-diff-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("empty")).unwrap();
    let shipped = include_str!("../../examples/two-axes-in-process.toml");
    let overlay = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/diff/line-4.toml");
    let config = folder.join("config.toml");
    let path = config.to_str().unwrap();
    for (tables, said) in [
        ("[mapping]\n".to_owned(), "error[AX0006]"),
        (format!("[mappings]\noverlays = \"{overlay}\"\n"), "error[AX0005]"),
    ] {
        std::fs::write(&config, format!("{shipped}\n{tables}")).unwrap();
        let output = check(&["--config", path, "--diff"]);
        assert_eq!(output.status.code(), Some(1), "{}", out(&output));
        assert!(out(&output).contains(said), "{}", out(&output));
        assert!(out(&output).ends_with("the tables cannot be compared\n"), "{}", out(&output));
    }
    let missing = check(&["--config", "no-such-file.toml", "--diff"]);
    assert_eq!((missing.status.code(), out(&missing).contains("error[AX0001]")), (Some(1), true));
    let json = check(&["--config", "no-such-file.toml", "--diff", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out(&json)).unwrap();
    assert_eq!(json["errors"], 1);
    // A configuration that can be read is compared, whatever is found in its tables.
    std::fs::write(&config, format!("{shipped}\n[mappings]\noverlays = [\"{overlay}\"]\n")).unwrap();
    let output = check(&["--config", path, "--diff", overlay]);
    assert_eq!(
        (output.status.code(), out(&output).as_str()),
        (Some(0), "0 changes, 0 dangerous, 0 not acknowledged\n")
    );
    // A folder without overlays is none to compare with.
    let empty = folder.join("empty");
    let output = check(&["--diff", empty.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1), "{}", out(&output));
    assert!(out(&output).contains("files whose names end in .toml"), "{}", out(&output));
    std::fs::remove_dir_all(folder).unwrap();
}
