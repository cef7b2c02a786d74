//! Controller and gateway as two processes with two clocks: another offset, a drift, and steps while the axes move.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};

const PATIENCE: Duration = Duration::from_secs(30);

/// Runs the shipped two axes with a controller whose clock is changed by `words`. Gives what the controller tells and the box's log.
fn run(name: &str, octet: u8, words: &str) -> (serde_json::Value, String) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (device, bind) = (format!("127.0.0.{octet}"), format!("127.0.1.{octet}"));
    let mut text = two_axes(&device, "");
    // Updates are counted: the bus is quicker than they are, and the limits let a pause of the host pass, a step of several cycles.
    for (from, to) in [
        ("cycle_time = \"8 ms\"", "cycle_time = \"2 ms\""),
        ("velocity = 10.0 ", "velocity = 40.0 "),
        ("velocity = 1_000.0", "velocity = 4_000.0"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let (config, log) = (folder.join(format!("{name}.toml")), folder.join(format!("{name}.log")));
    fs::write(&config, text).expect("the folder of the tests can be written to");
    let mut command = Command::new(axisbridge());
    command.args(["run", "--config"]).arg(config).env_remove("RUST_LOG").stdout(Stdio::null());
    let mut gateway = Running::start("run", command.stderr(fs::File::create(&log).expect("the log")));
    let read = || fs::read_to_string(&log).unwrap_or_default();
    let end = Instant::now() + PATIENCE;
    while !read().contains("CP4") {
        assert!(Instant::now() < end, "{}", read());
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = Command::new(axisbridge())
        .args(["simulate", "controller", "--target", &device, "--bind", &bind, "--axes", "2"])
        .args(["--counts-per-unit", "1000000,10000", "--speed", "1,10", "--seconds", "6", "--json"])
        .args(words.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .expect("the controller can be started");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}\n{}", read());
    assert!(gateway.terminate(PATIENCE).success(), "{}", read());
    (serde_json::from_slice(&output.stdout).expect("an object"), read())
}

/// Each axis came to its target, no update was lost, and nobody saw a fault.
fn moves(name: &str, octet: u8, words: &str) {
    in_real_time(name, || {
        let (result, told) = run(name, octet, words);
        let axes = result["axes"].as_array().expect("an array `axes`");
        assert_eq!(axes.len(), 2, "{result}");
        for axis in axes {
            let value = |key: &str| axis[key].as_f64().unwrap_or_else(|| panic!("{key} in {axis}"));
            assert!(axis["in_window"] == true && value("target").abs() > 1.0, "{axis}\n{told}");
            assert!(value("lost_updates") < 1.0, "{axis}\n{told}");
        }
        assert!(!told.contains("fault action"), "{told}");
    });
}

/// Half an update period behind is what Group_Sync lets pass; ahead it would refuse the controller.
#[test]
fn a_controller_whose_clock_is_behind_and_drifts_moves_the_axes() {
    moves("two-clocks-gaining", 83, "--clock-offset -4 --clock-drift 100");
    moves("two-clocks-losing", 84, "--clock-offset -2 --clock-drift -100");
}

/// A step is told with the System Time Offset, and moves no axis.
#[test]
fn steps_of_the_controllers_clock_move_no_axis() {
    moves("two-clocks-steps", 85, "--clock-step 3:50 --clock-step 5:-3600000");
}
