//! A box that is asked to end while an axis turns: it waits until the axis stands, or says which one does not.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};

fn file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).expect("the folder of the tests can be written to");
    path
}

/// A box whose turntable is commissioned to brake by 0.2 rev/s^2, and a controller that turns it up by as much; after `seconds` of
/// that the box is asked to end. Gives the box and its log.
fn turning(name: &str, octet: u8, seconds: u64) -> (Running, Running, PathBuf) {
    let (device, controller) = (format!("127.0.0.{octet}"), format!("127.0.1.{octet}"));
    let text = two_axes(&device, "");
    assert!(text.contains("acceleration = 200.0"), "the example limits the turntable");
    let text = text.replace("acceleration = 200.0", "acceleration = 0.2");
    let config = file(&format!("{name}.toml"), &text);
    let log = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.log"));
    let mut run = Command::new(axisbridge());
    run.args(["run", "--config"]).arg(config).env_remove("RUST_LOG").stdout(Stdio::null());
    let run = Running::start("run", run.stderr(fs::File::create(&log).expect("the log")));
    wait_for(&log, "CP4");

    let script = format!(
        "[connection]\ntarget = \"{device}\"\nbind = \"{controller}\"\nupdate_period = \"8 ms\"\n\
         [axis.1]\ncounts_per_unit = 1_000_000\nmotion = {{ velocity = 2.0, acceleration = 0.19 }}\n[axis.2]\n\
         [[step]]\nenable = 1\nwithin = \"30 s\"\n[[step]]\nmode = {{ axis = 1, control = \"velocity\" }}\n\
         [[step]]\nvelocity = {{ axis = 1, velocity = 2.0 }}\n[[step]]\ndwell = \"60 s\"\n"
    );
    let script = file(&format!("{name}-script.toml"), &script);
    let mut command = Command::new(axisbridge());
    command.args(["simulate", "controller", "--script"]).arg(script);
    let controller = Running::start("controller", command.stdout(Stdio::null()).stderr(Stdio::null()));
    wait_for(&log, "-> Running");
    std::thread::sleep(Duration::from_secs(seconds));
    (run, controller, log)
}

fn wait_for(log: &PathBuf, text: &str) {
    let end = Instant::now() + Duration::from_secs(60);
    loop {
        let seen = fs::read_to_string(log).unwrap_or_default();
        if seen.contains(text) {
            return;
        }
        assert!(Instant::now() < end, "no {text:?} in the log: {seen}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_box_that_is_asked_to_end_waits_for_a_long_stop() {
    let name = "a_box_that_is_asked_to_end_waits_for_a_long_stop";
    in_real_time(name, || {
        let (mut run, mut controller, log) = turning("ending-waits", 81, 9);
        let begin = Instant::now();
        let status = run.terminate(Duration::from_secs(60));
        let (took, text) = (begin.elapsed(), fs::read_to_string(&log).expect("the log"));
        assert!(took > Duration::from_millis(5_500), "it ended after {took:?}:\n{text}");
        assert_eq!(status.code(), Some(0), "{text}");
        assert!(!text.contains("come to rest"), "{text}");
        controller.terminate(Duration::from_secs(30));
    });
}

#[test]
fn a_second_signal_ends_the_wait_with_status_1_and_says_which_axis_turns() {
    let name = "a_second_signal_ends_the_wait_with_status_1_and_says_which_axis_turns";
    in_real_time(name, || {
        let (mut run, mut controller, log) = turning("ending-hurries", 82, 5);
        run.signal("TERM");
        std::thread::sleep(Duration::from_millis(700));
        assert_eq!(run.ended(), None, "it waits");
        let begin = Instant::now();
        let status = run.terminate(Duration::from_secs(60));
        let (took, text) = (begin.elapsed(), fs::read_to_string(&log).expect("the log"));
        assert!(took < Duration::from_secs(4), "it ended after {took:?}:\n{text}");
        assert_eq!(status.code(), Some(1), "{text}");
        let line = text.lines().find(|line| line.contains("ERROR")).unwrap_or_default();
        assert!(line.contains("axis turntable did not come to rest: 0."), "{text}");
        assert!(line.ends_with(" rev/s, drive state fault_reaction"), "{line}");
        controller.terminate(Duration::from_secs(30));
    });
}
