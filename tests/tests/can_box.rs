//! The box on CANopen and on DeviceNet as a user has it: four processes, a kernel with CAN and nothing in between.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use axisbridge::sys::can_interface::{self, Settings};
use axisbridge_tests::can_kernel::{self, Kernel};
use axisbridge_tests::peer::{can_kernel_or_skip, python_or_skip};
use axisbridge_tests::process::{Running, axisbridge};
use axisbridge_tests::slcan::{self, Adapters};
use profile_generic::can::timing::BitRate;

/// What is shipped for two drives on CAN; the test changes only where it runs and how patient everybody is: four processes share
/// the one processor of the guest, which the host stops whenever it likes.
const EXAMPLE: &str = include_str!("../../examples/two-axes-can.toml");

/// The same for two drives on DeviceNet.
const DEVICENET: &str = include_str!("../../examples/two-axes-devicenet.toml");

/// Names the binary inside the guest, where nothing can be built.
const BINARY: &str = "AXISBRIDGE_BINARY";

/// How long a process may take to be ready, or to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// All processes read the clock of the guest. A pause of the host at speed is a step of several cycles, which these limits do not let
/// pass.
const HERE: [(&str, &str); 4] = [
    ("source = \"ptp\"", "source = \"shared\""),
    ("velocity = 10.0 ", "velocity = 40.0 "),
    ("velocity = 200.0", "velocity = 800.0"),
    ("velocity = 500.0", "velocity = 2000.0"),
];

/// Each replacement has to hit something: an example that changes must not make another test of this.
fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    let text = &HERE.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
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
    outside(test);
}

#[test]
fn two_devicenet_drives_run_the_whole_program_of_a_controller() {
    let test = "two_devicenet_drives_run_the_whole_program_of_a_controller";
    if !can_kernel_or_skip(test) {
        return;
    }
    if can_kernel::is_inside() {
        run_the_program_on_devicenet();
        return;
    }
    outside(test);
}

/// Starts a guest that runs the test again.
fn outside(test: &str) {
    runs_in(test, Kernel::new().user(65_534).limit(Duration::from_secs(120)));
}

/// Runs a test again in a guest, one guest after the other: each has four processes that keep time on one processor of the host.
fn runs_in(test: &str, kernel: Kernel) {
    static ALONE: Mutex<()> = Mutex::new(());
    let kernel = kernel.urgent().environment(BINARY, axisbridge().as_os_str());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    kernel.inside_in_real_time(test);
}

/// Drives of somebody else, after what three makers' manuals say of theirs: enabled, moved, faulted, reset, and moved again.
#[test]
fn drives_like_those_of_three_makers_are_led_over_a_kernels_bus() {
    let test = "drives_like_those_of_three_makers_are_led_over_a_kernels_bus";
    if !can_kernel_or_skip(test) {
        return;
    }
    if can_kernel::is_inside() {
        lead_three_makers();
        return;
    }
    outside(test);
}

/// The same over the driver of a real controller, which the box sets up, loses and restarts.
#[test]
fn a_controller_that_is_bus_off_is_restarted_by_the_box() {
    let test = "a_controller_that_is_bus_off_is_restarted_by_the_box";
    let Some(python) = python_or_skip(test, "fcntl") else { return };
    if !can_kernel_or_skip(test) {
        return;
    }
    if can_kernel::is_inside() {
        lose_the_bus(&python);
        return;
    }
    runs_in(test, Kernel::new().interfaces(&[]).module(slcan::MODULE).limit(Duration::from_secs(120)));
}

/// A box with two drives on `interface`, and what it is given to do, in a guest.
struct Guest {
    binary: PathBuf,
    folder: PathBuf,
}

impl Guest {
    fn new() -> Self {
        let binary = std::env::var_os(BINARY).expect("the binary is named").into();
        Self { binary, folder: std::env::temp_dir() }
    }

    fn log(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// What each of the processes told, the box first.
    fn all_logs(&self) -> String {
        let logs = ["box", "drive1", "drive2", "drive5", "drive9"];
        let told =
            logs.map(|name| (name, read(&self.log(name)))).into_iter().filter(|(_, text)| !text.is_empty());
        told.map(|(name, text)| format!("-- {name}\n{text}")).collect()
    }

    fn drives(&self, interface: &str) -> [Running; 2] {
        [("drive 1", "drive1", 1), ("drive 2", "drive2", 2)].map(|(name, log, node)| {
            let words = format!("simulate can-drive --interface {interface} --node {node} --sync-losses 50");
            start(name, &self.binary, &self.log(log), &words)
        })
    }

    /// Starts the box with an example that is shipped but for these changes.
    fn start_box(&self, example: &str, changes: &[(&str, &str)]) -> Running {
        let path = self.folder.join("box.toml");
        std::fs::write(&path, changed(example, changes))
            .expect("the guest's temporary folder can be written");
        start("the box", &self.binary, &self.log("box"), &format!("run --config {}", path.display()))
    }

    /// Has a controller move both axes; gives what it tells of them.
    fn moves_two_axes(&self) -> serde_json::Value {
        let output = Command::new(&self.binary)
            .args(["simulate", "controller", "--target", "127.0.0.2", "--bind", "127.0.0.3", "--axes", "2"])
            .args(["--update-period-us", "80000", "--counts-per-unit", "1000000,10000"])
            .args(["--speed", "0.5,5", "--seconds", "6", "--json"])
            .stdin(Stdio::null())
            .output()
            .expect("the controller can be started");
        let told = || format!("{}\n{}", String::from_utf8_lossy(&output.stderr), self.all_logs());
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
        result
    }

    /// Ends the box.
    fn end(&self, mut gateway: Running) {
        let status = gateway.terminate(PATIENCE);
        assert!(status.success(), "the box ended with {status}\n{}", read(&self.log("box")));
    }
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

/// A first configuration of both drives is written, and has no error.
fn init(guest: &Guest) {
    let path = guest.folder.join("init.toml");
    let output = Command::new(&guest.binary)
        .args(["init", "--interface", "vcan0", "--output"])
        .arg(&path)
        .stdin(Stdio::null())
        .output()
        .expect("init can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.starts_with(&format!("{}: 2 axes, ", path.display())), "{printed}");
    let text = read(&path);
    assert!(text.contains("interface = \"vcan0\"") && text.matches("[[axis]]").count() == 2, "{text}");
}

/// What is changed of the example in any guest.
const PATIENT: [(&str, &str); 2] = [
    ("192.168.1.10", "127.0.0.2"),
    ("heartbeat = \"100 ms\"", "heartbeat = \"500 ms\"\nallowed_losses = 100"),
];

fn run_the_program() {
    let guest = Guest::new();
    let _drives = guest.drives("vcan0");
    scan(&guest.binary);
    init(&guest);
    let changes = [
        ("\"can0\"", "\"vcan0\""),
        ("set_bit_rate = true\n", ""),
        ("cycle_time = \"4 ms\"", "cycle_time = \"10 ms\""),
        ("min = \"4 ms\", max = \"32 ms\"", "min = \"10 ms\", max = \"80 ms\""),
    ];
    let gateway = guest.start_box(EXAMPLE, &[&PATIENT[..], &changes].concat());
    wait_for(&guest.log("box"), &["node 1 is in operation", "node 2 is in operation"]);
    let result = guest.moves_two_axes();
    guest.end(gateway);
    println!("{result}");
}

/// The second drive is a CIP Motion drive as well here, so that both have positions to go to.
fn run_the_program_on_devicenet() {
    let guest = Guest::new();
    let drive = |name, log: &str, more: &str| {
        let words = format!("simulate devicenet-drive --interface vcan0 {more}");
        start(name, &guest.binary, &guest.log(log), &words)
    };
    let _drives =
        [drive("drive 5", "drive5", "--mac 5"), drive("drive 9", "drive9", "--mac 9 --resolution 65536")];
    let changes = [
        ("192.168.1.10", "127.0.0.2"),
        ("\"can0\"", "\"vcan0\""),
        ("set_bit_rate = true\n", "allowed_losses = 50\n"),
        ("cycle_time = \"10 ms\"", "cycle_time = \"20 ms\""),
        ("resolution = 1_048_576", "packet_rate = \"250 ms\"\nresolution = 1_048_576"),
        ("kind = \"ac-dc\"\n", "packet_rate = \"250 ms\"\nresolution = 65_536\n"),
    ];
    let gateway = guest.start_box(DEVICENET, &changes);
    wait_for(&guest.log("box"), &["slave 5: exchanging", "slave 9: exchanging"]);
    let result = guest.moves_two_axes();
    guest.end(gateway);
    println!("{result}");
}

/// A box for an EPOS-like drive in position control, and an Oriental-like and a Faulhaber-like one in velocity control.
const MAKERS: &str = r#"
[box]
name = "three makers"

[[device]]
name = "front"
listen = "127.0.0.2"
axes = ["epos", "oriental", "faulhaber"]
update_period = { min = "20 ms", max = "80 ms" }

[device.identity]
vendor_id = 1
product_code = 1003
serial_number = 0x0001_E242
product_name = "Axisbridge CAN"

[[axis]]
name = "epos"
instance = 1
drive = "epos"
unit = "revolution"
motion_resolution = 1_000_000

[[axis]]
name = "oriental"
instance = 2
drive = "oriental"
unit = "revolution"
motion_resolution = 1_000_000

[[axis]]
name = "faulhaber"
instance = 3
drive = "faulhaber"
unit = "revolution"
motion_resolution = 1_000_000

[[south.can]]
interface = "vcan0"
cycle_time = "20 ms"
heartbeat = "500 ms"
allowed_losses = 100

[[south.can.drive]]
name = "epos"
node = 1
modes = ["position"]
actual_values = []

[[south.can.drive]]
name = "oriental"
node = 2
actual_values = ["velocity"]

[[south.can.drive]]
name = "faulhaber"
node = 3
actual_values = ["velocity"]
"#;

/// What the controller does: each axis moves, its drive has an error (2310, 8611, 3210), and it moves again.
const MAKERS_SCRIPT: &str = r#"
title = "three makers"

[connection]
target = "127.0.0.2"
bind = "127.0.0.3"
update_period = "80 ms"

[axis.1]
counts_per_unit = 1_000_000
motion = { velocity = 0.5, acceleration = 5.0 }

[axis.2]
counts_per_unit = 1_000_000
mode = "velocity"
motion = { velocity = 0.5, acceleration = 5.0 }

[axis.3]
counts_per_unit = 1_000_000
mode = "velocity"
motion = { velocity = 0.5, acceleration = 5.0 }

[[step]]
enable = "all"
within = "30 s"

[[step]]
move = { axis = 1, by = 0.25 }

[[step]]
in_window = { axis = 1, window = 0.01, wait = "10 s" }

[[step]]
velocity = { axis = 2, velocity = 0.5 }

[[step]]
velocity = { axis = 3, velocity = 0.5 }

[[step]]
dwell = "1 s"

[[step]]
expect = { axis = 2, velocity = 0.5, tolerance = 0.1 }

[[step]]
title = "errors of the drives"
expect = { axis = 3, velocity = 0.5, tolerance = 0.1 }

[[step]]
expect = { axis = 1, state = "Major Faulted" }
within = "30 s"

[[step]]
expect = { axis = 2, state = "Major Faulted" }
within = "30 s"

[[step]]
title = "all are faulted"
expect = { axis = 3, state = "Major Faulted" }
within = "30 s"

[[step]]
dwell = "3 s"

[[step]]
fault_reset = "all"
within = "20 s"

[[step]]
enable = "all"
within = "30 s"

[[step]]
move = { axis = 1, by = 0.25 }

[[step]]
in_window = { axis = 1, window = 0.01, wait = "10 s" }

[[step]]
velocity = { axis = 2, velocity = -0.5 }

[[step]]
dwell = "1 s"

[[step]]
expect = { axis = 2, velocity = -0.5, tolerance = 0.1 }

[[step]]
disable = "all"
"#;

fn lead_three_makers() {
    let guest = Guest::new();
    let peer = Path::new(env!("CARGO_BIN_EXE_peer-can-drive"));
    let orders = |name: &str| guest.folder.join(format!("{name}.orders"));
    let makers = [("epos", 1, "2310"), ("oriental", 2, "2310"), ("faulhaber", 3, "3210")];
    let _drives = makers.map(|(name, node, _)| {
        let words = format!("{name} {node} vcan0 {}", orders(name).display());
        start(name, peer, &guest.log(name), &words)
    });
    let path = guest.folder.join("box.toml");
    std::fs::write(&path, MAKERS).expect("the guest's temporary folder can be written");
    let words = format!("run --config {}", path.display());
    let gateway = start("the box", &guest.binary, &guest.log("box"), &words);
    wait_for(
        &guest.log("box"),
        &["node 1 is in operation", "node 2 is in operation", "node 3 is in operation"],
    );
    let script = guest.folder.join("makers.toml");
    std::fs::write(&script, format!("unexpected_faults = \"ignore\"\n{MAKERS_SCRIPT}"))
        .expect("the guest's temporary folder can be written");
    let words = format!("simulate controller --script {}", script.display());
    let mut controller = start("the controller", &guest.binary, &guest.log("controller"), &words);
    let told = || {
        let logs = ["controller", "box", "epos", "oriental", "faulhaber"];
        logs.map(|name| format!("-- {name}\n{}", read(&guest.log(name)))).concat()
    };
    let order = |word: &dyn Fn(&str) -> String| {
        for (name, _, code) in makers {
            let mut text = read(&orders(name));
            text.push_str(&word(code));
            std::fs::write(orders(name), text).expect("the guest's temporary folder can be written");
        }
    };
    wait_for(&guest.log("controller"), &["errors of the drives"]);
    order(&|code| format!("fail {code}\n"));
    wait_for(&guest.log("controller"), &["all are faulted"]);
    order(&|_| "mend\n".to_owned());
    let end = Instant::now() + PATIENCE;
    let status = loop {
        if let Some(status) = controller.ended() {
            break status;
        }
        assert!(Instant::now() < end, "{}", told());
        std::thread::sleep(Duration::from_millis(50));
    };
    assert!(status.success(), "{}", told());
    // What the drives themselves say: each was enabled, faulted, and enabled again.
    for (name, ..) in makers {
        let log = read(&guest.log(name));
        let enabled = log.matches("-> OperationEnabled").count();
        assert!(enabled >= 2 && log.contains("Fault"), "{name}\n{}", told());
    }
    guest.end(gateway);
    println!("{}", read(&guest.log("controller")));
}

fn lose_the_bus(python: &Path) {
    let guest = Guest::new();
    let adapters = Adapters::start(python, 2);
    // The drives' end of the bus is set up by hand; the box sets up its own.
    let rate = Settings { bit_rate: BitRate::classic(1_000_000), queue: Some(128), ..Settings::default() };
    can_interface::configure("can1", &rate).expect("the driver takes 1 Mbit/s");
    let opened = ["up", "1 C", "1 S8", "1 O"];
    adapters.have_said(&opened);
    let _drives = guest.drives("can1");
    let changes = [
        // Serial lines of a guest are slow: what two drives send in 40 ms has room, and nobody moves here.
        ("cycle_time = \"4 ms\"", "cycle_time = \"40 ms\""),
        ("min = \"4 ms\", max = \"32 ms\"", "min = \"40 ms\", max = \"80 ms\""),
    ];
    let gateway = guest.start_box(EXAMPLE, &[&PATIENT[..], &changes].concat());
    let log = guest.log("box");
    wait_for(&log, &["node 1 is in operation", "node 2 is in operation"]);
    let opened = [&opened[..], &["0 C", "0 S8", "0 O"]].concat();
    adapters.have_said(&opened);

    // Warnings are told with what was counted; they stop nobody.
    let before = read(&log).len();
    adapters.say("sp020130");
    wait_for(&log, &["CAN controller: error passive interface=\"can0\""]);
    adapters.say("sa000000");
    wait_for(&log, &["CAN controller: error active interface=\"can0\""]);
    adapters.say("sb000256");
    // The driver has no restart: the box takes its interface down and up.
    adapters.have_said(&[&opened[..], &["0 C", "0 C", "0 S8", "0 O"]].concat());
    for words in [
        "the controller is off the bus",
        "CAN controller: bus off",
        "the CAN controller is restarted",
        "the controller is back on the bus",
        "node 1 is in operation",
        "node 2 is in operation",
    ] {
        let end = Instant::now() + PATIENCE;
        while !read(&log)[before..].contains(words) {
            assert!(Instant::now() < end, "`{words}` is not told:\n{}", read(&log));
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    guest.end(gateway);
}
