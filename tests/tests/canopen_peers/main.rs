//! CANopen against stacks that share no code with this one, in a kernel that has CAN.

mod bench;
mod blocks;
mod lss;
mod our_drive;
mod our_master;
mod recording;

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::can_kernel::{Kernel, is_inside};
use axisbridge_tests::peer::{can_kernel_or_skip, python_or_skip};
use axisbridge_tests::process::{Running, axisbridge};

/// The device under test or the foreign one.
const NODE: u8 = 5;

/// The interface of a guest.
const INTERFACE: &str = "vcan0";

/// Names of the variables that tell a test inside which programs to use.
const PYTHON: &str = "AXISBRIDGE_PYTHON";
const BINARY: &str = "AXISBRIDGE_BINARY";
const RECORDING: &str = "AXISBRIDGE_RECORDING";

/// The kernel that these tests run in; they wait for a Python that shares one processor with them.
fn kernel(python: &Path) -> Kernel {
    // For a new snapshot.
    let snapshots = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/canopen_peers/snapshots"));
    Kernel::new().limit(Duration::from_secs(120)).writable(snapshots).environment(PYTHON, python.as_os_str())
}

/// Asks, outside, for a Python with the packages of these peers.
fn python_outside(test: &str) -> Option<PathBuf> {
    can_kernel_or_skip(test).then(|| python_or_skip(test, "canopen, can, durand")).flatten()
}

/// A program that a test inside was told of.
fn told(name: &str) -> PathBuf {
    std::env::var_os(name).map(PathBuf::from).unwrap_or_else(|| panic!("{name} is set in a guest"))
}

/// The Python to go on with: only inside a guest. Outside it runs `test` in one.
fn python_inside(test: &str) -> Option<PathBuf> {
    if is_inside() {
        return Some(told(PYTHON));
    }
    let python = python_outside(test)?;
    kernel(&python).inside_in_real_time(test);
    None
}

/// As [`python_inside`], with our own program too, which no guest can build.
fn python_and_binary_inside(test: &str) -> Option<(PathBuf, PathBuf)> {
    if is_inside() {
        return Some((told(PYTHON), told(BINARY)));
    }
    let python = python_outside(test)?;
    kernel(&python).environment(BINARY, axisbridge().as_os_str()).inside_in_real_time(test);
    None
}

/// A process that runs, and what it has said.
struct Peer {
    running: Running,
    output: PathBuf,
}

impl Peer {
    /// Starts a script of `tests/peers`.
    fn script(python: &Path, script: &'static str, arguments: &[&str]) -> Self {
        let mut command = Command::new(python);
        command.arg(format!("{}/peers/{script}", env!("CARGO_MANIFEST_DIR"))).args(arguments);
        Self::command(script, command)
    }

    /// Starts a script of `tests/peers` and waits until it says "up".
    fn start(python: &Path, script: &'static str, arguments: &[&str]) -> Self {
        let mut peer = Self::script(python, script, arguments);
        peer.says("up");
        peer
    }

    fn command(name: &'static str, mut command: Command) -> Self {
        let output = std::env::temp_dir().join(name);
        let file = File::create(&output).unwrap();
        command.stdout(file.try_clone().unwrap()).stderr(file).stdin(Stdio::null());
        Self { running: Running::start(name, &mut command), output }
    }

    fn said(&self) -> String {
        std::fs::read_to_string(&self.output).unwrap_or_default()
    }

    fn has_said(&self, line: &str) -> bool {
        self.said().lines().any(|said| said == line)
    }

    /// Waits until it has said this line.
    fn says(&mut self, line: &str) {
        let end = Instant::now() + Duration::from_secs(30);
        while !self.has_said(line) {
            assert!(
                Instant::now() < end && self.running.ended().is_none(),
                "no `{line}` in:\n{}",
                self.said()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until it has ended well, and gives what it has said.
    fn succeeds(mut self) -> String {
        let status = self.running.wait(Duration::from_secs(100));
        let said = self.said();
        assert!(status.success(), "{status}\n{said}");
        said
    }
}

/// That each of these is a line of what was said.
#[track_caller]
fn has_lines(said: &str, lines: &[&str]) {
    for line in lines {
        assert!(said.lines().any(|said| said == *line), "no `{line}` in:\n{said}");
    }
}
