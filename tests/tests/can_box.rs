//! The box on a CAN bus as a user has it: four processes, a kernel with CAN and nothing in between.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::can_kernel::{self, Kernel};
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer::can_kernel_or_skip;
use axisbridge_tests::process::{Running, axisbridge};

/// What is shipped for two drives on CAN; the test changes only where it runs and how patient everybody is: four processes share
/// the one processor of the guest, which the host stops whenever it likes.
const EXAMPLE: &str = include_str!("../../examples/two-axes-can.toml");

/// Names the binary inside the guest, where nothing can be built.
const BINARY: &str = "AXISBRIDGE_BINARY";

/// How long a process may take to be ready, or to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// Each replacement has to hit something: an example that changes must not make another test of this.
fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "the example has no `{from}`");
        text.replace(from, to)
    })
}

/// A process whose output goes to `log`.
fn start(name: &'static str, binary: &Path, log: &Path, words: &str) -> Running {
    let file = File::create(log).expect("the guest's temporary folder can be written");
    let mut command = Command::new(binary);
    command.args(words.split_whitespace()).stdout(file.try_clone().expect("a file can be shared"));
    Running::start(name, command.stderr(file).stdin(Stdio::null()))
}

fn read(log: &Path) -> String {
    std::fs::read_to_string(log).unwrap_or_default()
}

/// Waits until a log has all of these.
fn wait_for(log: &Path, words: &[&str]) {
    let end = Instant::now() + PATIENCE;
    while !words.iter().all(|word| read(log).contains(word)) {
        assert!(Instant::now() < end, "{words:?} are not told:\n{}", read(log));
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn two_can_drives_run_the_whole_program_of_a_controller() {
    let test = "two_can_drives_run_the_whole_program_of_a_controller";
    if !can_kernel_or_skip(test) {
        return;
    }
    if can_kernel::is_inside() {
        run_the_program();
        return;
    }
    let kernel = Kernel::new().user(65_534).urgent().limit(Duration::from_secs(90));
    let kernel = kernel.environment(BINARY, axisbridge().as_os_str());
    in_real_time(test, || assert!(!kernel.inside(test)));
}

/// Both drives are found once they have started, which takes them a while.
fn scan(binary: &Path) {
    let end = Instant::now() + PATIENCE;
    loop {
        let output = Command::new(binary)
            .args(["scan", "--interface", "vcan0", "--json"])
            .stdin(Stdio::null())
            .output()
            .expect("the scan can be started");
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let nodes = found["nodes"].as_array().cloned().unwrap_or_default();
        if let [first, second] = nodes.as_slice() {
            assert_eq!([&first["node"], &second["node"]], [1, 2]);
            assert_eq!([&first["axes"][0]["supported_modes"], &second["serial_number"]], [1007, 2]);
            assert!(output.status.success());
            return;
        }
        assert!(Instant::now() < end, "{found} {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// What happens in the guest.
fn run_the_program() {
    let binary = PathBuf::from(std::env::var_os(BINARY).expect("the binary is named"));
    let folder = std::env::temp_dir();
    let at = |name: &str| folder.join(name);
    let configuration = changed(
        EXAMPLE,
        &[
            ("192.168.1.10", "127.0.0.2"),
            ("\"can0\"", "\"vcan0\""),
            ("set_bit_rate = true\n", ""),
            ("cycle_time = \"4 ms\"", "cycle_time = \"10 ms\""),
            ("heartbeat = \"100 ms\"", "heartbeat = \"500 ms\"\nallowed_losses = 100"),
            ("min = \"4 ms\", max = \"32 ms\"", "min = \"10 ms\", max = \"80 ms\""),
        ],
    );
    std::fs::write(at("box.toml"), configuration).expect("the guest's temporary folder can be written");
    let drive = |name, log: &str, node: u8| {
        let words = format!("simulate can-drive --interface vcan0 --node {node} --sync-losses 50");
        start(name, &binary, &at(log), &words)
    };
    let _drives = [drive("drive 1", "drive1", 1), drive("drive 2", "drive2", 2)];
    scan(&binary);
    let words = format!("run --config {}", at("box.toml").display());
    let mut gateway = start("the box", &binary, &at("box"), &words);
    wait_for(&at("box"), &["node 1 is in operation", "node 2 is in operation"]);

    let output = Command::new(&binary)
        .args(["simulate", "controller", "--target", "127.0.0.2", "--bind", "127.0.0.3", "--axes", "2"])
        .args(["--update-period-us", "80000", "--counts-per-unit", "1000000,10000"])
        .args(["--speed", "0.5,5", "--seconds", "6", "--json"])
        .stdin(Stdio::null())
        .output()
        .expect("the controller can be started");
    let told = || format!("{}\n{}", String::from_utf8_lossy(&output.stderr), read(&at("box")));
    let result: serde_json::Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}\n{}", told()));
    assert!(output.status.success(), "{result}\n{}", told());
    assert!(result.get("failure").is_none(), "{result}");
    let axes = result["axes"].as_array().expect("an array `axes`");
    assert_eq!(axes.len(), 2, "{result}");
    for (number, axis) in (1..).zip(axes) {
        let value = |key: &str| axis[key].as_f64().unwrap_or_else(|| panic!("{key} in {axis}"));
        assert_eq!(axis["axis"], number);
        assert!(value("target").abs() > 1.0, "the axis is asked to move: {axis}");
        assert!((value("target") - value("reached")).abs() <= value("window"), "{axis}\n{}", told());
        // A servo behind a bus lags: one that follows without any error did not move on set-points of this controller.
        assert!(value("max_following_error") > 0.0, "{axis}");
        assert!(value("cycles") > 75.0, "{axis}");
    }
    let status = gateway.terminate(PATIENCE);
    assert!(status.success(), "the box ended with {status}\n{}", read(&at("box")));
    println!("{result}");
}
