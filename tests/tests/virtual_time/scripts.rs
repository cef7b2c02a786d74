//! The scripts that are shipped, each against the whole box.

use std::path::Path;

use axisbridge::mapping::Mapping;
use axisbridge::simulate::script::Script;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::Report;
use profile_generic::time::DurationNs;

/// Runs a script from its file; all of its steps have to pass.
fn run(name: &str) -> (Rig, Report) {
    run_on(name, Settings::default())
}

fn run_on(name: &str, settings: Settings) -> (Rig, Report) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scripts").join(name);
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let script = Script::load(&path, &mapping).unwrap_or_else(|error| panic!("{error}"));
    let mut rig = Rig::ready(settings);
    rig.connect_with(script.config, script.steps.clone());
    let report = rig.run(DurationNs::from_secs(120));
    let at = report.failed_step.and_then(|step| script.titles.get(step));
    assert_eq!(report.failure, None, "{name}, {at:?}\n{}\n{}", rig.log(), rig.told());
    assert_eq!(report.steps_finished, script.steps.len(), "{name}");
    assert!(rig.torque_free(), "{name} leaves no axis energized");
    (rig, report)
}

/// Runs a script that stands here.
fn run_text(text: &str, settings: Settings) -> (Rig, Report) {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let script = Script::parse(text, "test.toml", &mapping).unwrap_or_else(|error| panic!("{error}"));
    let mut rig = Rig::ready(settings);
    rig.connect_with(script.config, script.steps);
    let report = rig.run(DurationNs::from_secs(120));
    (rig, report)
}

#[test]
fn a_watch_position_is_armed_passed_and_expected() {
    let text = r#"
[axis.1]
counts_per_unit = 1_000_000
motion = { velocity = 1.0, acceleration = 10.0 }
[axis.2]
[[step]]
enable = 1
[[step]]
arm = { axis = 1, events = ["Watch Position 1 Fwd"], watch = 0.25 }
[[step]]
move = { axis = 1, to = 0.5 }
[[step]]
expect_event = { axis = 1, type = "Watch 1 Position Forward", position = 0.25, tolerance = 0.001 }
[[step]]
expect_event = { axis = 1, type = "Watch 1 Position Forward", within = "100 ms" }
"#;
    let settings = Settings {
        configuration: BOX.replace("instance = ", "events = \"cyclic\"\ninstance = "),
        ..Settings::default()
    };
    let (rig, report) = run_text(text, settings);
    assert_eq!(report.failed_step, Some(4), "the event comes once\n{}", rig.log());
    let failure = report.failure.expect("a failure").to_string();
    assert!(failure.contains("Watch 1 Position Forward, found nothing after 1"), "{failure}");
}

#[test]
fn a_test_process_runs_and_its_result_is_expected() {
    let text = r#"
[axis.1]
counts_per_unit = 1_000_000
[axis.2]
[[step]]
run_hookup_test = { axis = 1, type = "motor and feedback", channel = 1, distance = 0.05, time = 2.0 }
[[step]]
test_result = { axis = 1, test = "hookup" }
within = "20 s"
[[step]]
expect = { axis = 1, state = "Stopped" }
"#;
    let (rig, report) = run_text(text, Settings::default());
    assert_eq!(report.failure, None, "step {:?}\n{}\n{}", report.failed_step, rig.log(), rig.told());
}

#[test]
fn first_move() {
    let (rig, report) = run("first-move.toml");
    assert!((report.axes[0].reached.expect("axis 1 ran")).abs() < 0.002);
    assert!(rig.position(0).abs() < 2_000_000, "nanounits: {}", rig.position(0));
    assert_eq!(report.axes[1].reached, None, "axis 2 was not touched");
}

#[test]
fn every_mode() {
    let (_, report) = run("every-mode.toml");
    assert!((report.axes[0].reached.expect("axis 1 ran") - 0.3).abs() < 0.002, "in the redefined reference");
    assert_eq!((report.lost_updates, report.malformed), (0, 0));
}

#[test]
fn faults_and_recovery() {
    let (_, report) = run("faults-and-recovery.toml");
    let codes: Vec<u8> = report.axes[0].faults.kept().iter().map(|fault| fault.code).collect();
    assert_eq!(codes, [62, 60], "Controller Initiated Exception and Illegal Control Mode");
}

#[test]
fn connection_abuse() {
    let (_, report) = run("connection-abuse.toml");
    assert!(report.axes[0].reached.expect("axis 1 ran").abs() < 0.002);
}

#[test]
fn fixed_format() {
    let (rig, report) = run_on("fixed-format.toml", Settings::fixed());
    assert!(
        (report.axes[0].reached.expect("axis 1 ran") - 10.25).abs() < 0.002,
        "in the redefined reference"
    );
    let codes: Vec<u8> = report.axes[0].faults.kept().iter().map(|fault| fault.code).collect();
    assert_eq!(codes.first(), Some(&60), "Illegal Control Mode\n{}", rig.log());
    assert!(rig.log().contains("the class: read 32=[03] 33=[00]"), "{}", rig.log());
    assert!(rig.log().contains("node fault: Data Format Error"), "{}", rig.log());
}

/// Connection point 3: a run/idle header in front of each update, both ways. Everything else is as ever.
#[test]
fn a_controller_of_format_revision_3_moves_its_axes() {
    let script = "[connection]\nconnection_point = 3\n[axis.1]\ncounts_per_unit = 1_000_000\n\
         limits = { velocity = 5, acceleration = 50 }\n[[step]]\nenable = 1\n\
         [[step]]\nmove = { axis = 1, to = 1.5, velocity = 2, acceleration = 10 }\n[[step]]\ndisable = 1\n";
    let (rig, report) = run_text(script, Settings::default());
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
    assert!((rig.position(0) - 1_500_000_000).abs() < 10_000_000, "{}", rig.position(0));
    assert!(rig.torque_free());
}
