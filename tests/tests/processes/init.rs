//! `axisbridge init`: a first configuration from simulated drives.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use axisbridge_tests::process::axisbridge;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/two-axes-in-process.toml");

fn axb(arguments: &[&str]) -> Output {
    Command::new(axisbridge()).args(arguments).env_remove("RUST_LOG").output().expect("the program")
}

fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

fn place(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_file(&path);
    path
}

#[test]
fn configuration_is_written_once_and_check_finds_no_error() {
    let path = place("init.toml");
    let file = path.to_str().expect("a text");
    let init = ["init", "--config", EXAMPLE, "--output", file];
    let output = axb(&init);
    let (printed, said) = texts(&output);
    assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{printed}");
    assert_eq!(
        printed,
        format!(
            "{file}: 2 axes, 5 lines marked CHANGE\nEdit these lines, then:\n    axisbridge check --config {file}\n    \
             axisbridge run --config {file}\n"
        )
    );
    let text = fs::read_to_string(&path).expect("the file is written");
    let (scanned, _) = texts(&axb(&["scan", "--config", EXAMPLE]));
    assert_eq!(text, scanned, "init writes what scan prints");

    let (checked, _) = texts(&axb(&["check", "--config", file, "--json"]));
    let checked: serde_json::Value = serde_json::from_str(&checked).expect("JSON");
    let findings = checked["findings"].as_array().expect("a list");
    let errors: Vec<_> = findings.iter().filter(|finding| finding["severity"] == "error").collect();
    assert!(errors.is_empty(), "{errors:#?}");

    // What a person has edited since then stays.
    let own = format!("# mine\n{text}");
    fs::write(&path, &own).expect("the file can be edited");
    let output = axb(&init);
    let (printed, said) = texts(&output);
    assert_eq!((output.status.code(), printed.as_str()), (Some(1), ""));
    assert_eq!(
        said,
        format!("{file} exists already and is not overwritten: name another file with --output\n")
    );
    assert_eq!(fs::read_to_string(&path).expect("the file"), own);
}

#[test]
fn folder_that_is_not_there_is_an_error() {
    let missing = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-such-folder/gateway.toml");
    let file = missing.to_str().expect("a text");
    let output = axb(&["init", "--config", EXAMPLE, "--output", file]);
    let (printed, said) = texts(&output);
    assert_eq!((output.status.code(), printed.as_str()), (Some(1), ""));
    assert_eq!(said, format!("cannot write {file}: No such file or directory (os error 2)\n"));
}

#[test]
fn bus_has_to_be_named() {
    let output = axb(&["init"]);
    let (_, said) = texts(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--config <FILE>|--interface <IF>"), "{said}");
}
