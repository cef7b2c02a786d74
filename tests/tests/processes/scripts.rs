//! `simulate controller --script` as a user runs it, on real sockets.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};

/// Addresses of this test alone.
const BOX: &str = "127.0.0.46";
const CONTROLLER: &str = "127.0.1.46";
const FIXED_BOX: &str = "127.0.0.47";
const FIXED_CONTROLLER: &str = "127.0.1.47";

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// A file of this test alone.
fn file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).expect("the folder of the tests can be written to");
    path
}

fn script(path: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(axisbridge());
    command.args(["simulate", "controller", "--script"]).arg(path).args(more);
    command.output().expect("the controller can be started")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_wrong_script_ends_with_status_2_and_its_place() {
    let path = file("wrong.toml", "[axis.1]\n[[step]]\nenable = 2\n");
    let output = script(&path, &["--target", BOX]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(text(&output.stdout), "");
    let errors = text(&output.stderr);
    assert!(errors.contains("wrong.toml:3:10") && errors.contains("expected 1 to 1"), "{errors}");
    let path = file("nowhere.toml", "[axis.1]\n");
    let output = script(&path, &[]);
    assert_eq!(output.status.code(), Some(2), "no device is named");
    let output = script(Path::new("/does/not/exist.toml"), &[]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

#[test]
fn a_check_prints_the_plan_and_sends_nothing() {
    let output = script(&example("scripts/first-move.toml"), &["--check"]);
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
    let plan = text(&output.stdout);
    assert!(plan.contains("   2  line 29     Move axis 1 to 0.25\n"), "{plan}");
    assert!(plan.ends_with("2 axes, 8 steps; nothing was sent\n"), "{plan}");
}

/// Starts a box with this configuration.
fn start(name: &str, configuration: &str) -> Running {
    let mut command = Command::new(axisbridge());
    command.args(["run", "--config"]).arg(file(name, configuration));
    Running::start("run", command.stdout(Stdio::null()).stderr(Stdio::null()))
}

/// Runs a shipped script as soon as the box listens; it has to pass. Gives its JSON object.
fn passes(name: &str, places: &[&str]) -> serde_json::Value {
    let end = Instant::now() + Duration::from_secs(60);
    let output = loop {
        let output = script(&example(name), places);
        if !output.stdout.is_empty() || Instant::now() > end {
            break output;
        }
        std::thread::sleep(Duration::from_millis(200));
    };
    let result: serde_json::Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("one JSON object, {error}: {}", text(&output.stderr)));
    assert_eq!(result["passed"], true, "{result}");
    assert_eq!(output.status.code(), Some(0));
    result
}

#[test]
fn a_script_runs_over_the_fixed_format() {
    in_real_time("a_script_runs_over_the_fixed_format", runs_over_the_fixed_format);
}

fn runs_over_the_fixed_format() {
    let _box = start("fixed-box.toml", &axisbridge_tests::rig::FIXED_BOX.replace("10.0.0.2", FIXED_BOX));
    let places = ["--target", FIXED_BOX, "--bind", FIXED_CONTROLLER, "--json"];
    let result = passes("scripts/fixed-format.toml", &places);
    assert!(result["axes"][0]["actual"].as_f64().is_some_and(|at| (at - 10.25).abs() < 0.01), "{result}");
    assert!(result["updates"]["interval"]["count"].as_u64().is_some_and(|count| count > 20), "{result}");
}

#[test]
fn a_script_moves_the_axes_of_a_box() {
    in_real_time("a_script_moves_the_axes_of_a_box", moves_the_axes_of_a_box);
}

fn moves_the_axes_of_a_box() {
    let configuration = std::fs::read_to_string(example("../gateway/src/cli/demo/two-axes.toml"))
        .expect("the demonstration's configuration")
        .replace("127.0.0.2", BOX);
    let _box = start("script-box.toml", &configuration);
    let places = ["--target", BOX, "--bind", CONTROLLER, "--json"];
    let result = passes("scripts/first-move.toml", &places);
    assert_eq!(result["steps"][1]["line"], 29);
    assert_eq!(result["steps"][1]["result"], "passed");
    assert!(result["steps"][1]["seconds"].as_f64().is_some_and(|seconds| seconds > 0.1), "{result}");
    assert!(result["axes"][0]["actual"].as_f64().is_some_and(|at| at.abs() < 0.01), "{result}");
    assert!(result["updates"]["round_trip"]["count"].as_u64().is_some_and(|count| count > 20), "{result}");

    // One expectation that cannot come true: the run fails there, and the axis is disabled behind it.
    let failing = "[axis.1]\ncounts_per_unit = 1_000_000\n[axis.2]\n[[step]]\nenable = 1\nwithin = \"30 s\"\n\
                   [[step]]\nexpect = { axis = 1, state = \"Shutdown\", within = \"100 ms\" }\n[[step]]\nabort = 1\n";
    let output = script(&file("failing.toml", failing), &places);
    assert_eq!(output.status.code(), Some(1));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let results: Vec<_> = (0..4).map(|step| result["steps"][step]["result"].clone()).collect();
    assert_eq!(results, ["passed", "failed", "not run", "not run"]);
    assert_eq!(result["axes"][0]["state"], "Stopped", "{result}");
    let failure = result["failure"].as_str().expect("a failure");
    let expected = "step 2 (line 7), Expect axis 1: state Shutdown within 100 ms: expected axis 1: state Shutdown, found state Running after ";
    assert!(failure.starts_with(expected), "{failure}");
    assert!(text(&output.stderr).contains(failure));
}
