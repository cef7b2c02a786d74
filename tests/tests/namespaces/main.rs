//! Processes on virtual cables: drives, gateway and controller, each in a network namespace of its own.
//!
//! Needs root and iproute2: a visible skip where they are missing, a failure in CI.

mod attackers;
mod fixed_lists;
mod flood;
mod kills;
mod masters;
mod misbehaviour;
mod ptp;
mod scanner;
mod sercos;
mod synchronous;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::{Running, axisbridge};

/// Set for the copy of this test binary that reads the Modbus map inside the gateway's namespace.
const MODBUS_ADDRESS: &str = "AXISBRIDGE_TEST_MODBUS";

/// Buses share the processors: a fourth one in real time would be a fault of the others' making.
static BUSES: (Mutex<u32>, Condvar) = (Mutex::new(3), Condvar::new());

/// The right to run a bus.
struct Bus;

/// Waits for the right to run a bus.
fn a_bus() -> Bus {
    let (free, freed) = &BUSES;
    let free = free.lock().unwrap_or_else(PoisonError::into_inner);
    let mut free = freed.wait_while(free, |free| *free == 0).unwrap_or_else(PoisonError::into_inner);
    *free -= 1;
    Bus
}

impl Drop for Bus {
    fn drop(&mut self) {
        let (free, freed) = &BUSES;
        *free.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        freed.notify_one();
    }
}

fn in_namespace(namespace: &Namespace, arguments: &[&str]) -> Command {
    let mut command = namespace.command(axisbridge().to_str().expect("a path in UTF-8"));
    command.args(arguments);
    command
}

fn scratch(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Starts the box on the shipped example; its log comes in a file.
fn start_box(namespace: &Namespace, name: &str) -> (Running, PathBuf) {
    let log = scratch(&format!("{name}.log"));
    let config = configuration(&format!("{name}.toml"));
    let mut run = in_namespace(namespace, &["run", "--config", config.to_str().expect("a path in UTF-8")]);
    run.env("NO_COLOR", "1");
    run.stderr(std::fs::File::create(&log).expect("the log can be written"));
    (Running::start("run", &mut run), log)
}

/// Waits until `text` stands in the log of a box.
fn wait_for(log: &Path, text: &str, process: &mut Running) {
    let end = Instant::now() + Duration::from_secs(30);
    loop {
        let seen = std::fs::read_to_string(log).unwrap_or_default();
        if seen.contains(text) {
            return;
        }
        assert!(process.ended().is_none(), "the box has ended: {seen}");
        assert!(Instant::now() < end, "no {text:?} in the log: {seen}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The shipped example, with this test's interface and addresses.
fn configuration(name: &str) -> PathBuf {
    let mut example = include_str!("../../../examples/two-axes-sercos.toml").to_owned();
    for (shipped, here) in [
        ("enp3s0", "sercos0"),
        ("192.168.1.10", "192.168.10.20"),
        // The namespaces of a host have one clock.
        ("source = \"ptp\"", "source = \"shared\""),
        // The machine of the tests has no processor to spare, and others on it that want to sleep.
        ("cpu = 1\n", ""),
        ("stay_awake = true", "stay_awake = false"),
        // Nor does it promise to keep time: two seconds without an answer.
        ("allowed_losses = 4\n", "allowed_losses = 1000\n"),
        // A pause of the host at speed is a step of several cycles, which the limit does not let pass.
        ("velocity = 10.0 ", "velocity = 100.0 "),
        ("velocity = 1_000.0", "velocity = 10_000.0"),
    ] {
        assert!(example.contains(shipped), "the shipped example has {shipped:?}");
        example = example.replace(shipped, here);
    }
    let path = scratch(name);
    std::fs::write(&path, example).expect("the scratch folder can be written");
    path
}

#[test]
fn three_processes_move_two_axes_while_a_modbus_client_reads_them() {
    if !peer::namespaces_or_skip("three_processes_move_two_axes_while_a_modbus_client_reads_them") {
        return;
    }
    let _bus = a_bus();
    in_real_time("three_processes_move_two_axes_while_a_modbus_client_reads_them", three_processes);
}

fn three_processes() {
    let (controller, gateway, drives) = (Namespace::new("ctl"), Namespace::new("box"), Namespace::new("drv"));
    cable((&controller, "net0", Some("192.168.10.1/24")), (&gateway, "net0", Some("192.168.10.20/24")));
    cable((&gateway, "sercos0", None), (&drives, "sercos0", None));

    let mut drive_command = in_namespace(
        &drives,
        &[
            "simulate",
            "sercos-drive",
            "--interface",
            "sercos0",
            "--slaves",
            "2",
            "--linear",
            "2",
            "--seconds",
            "60",
        ],
    );
    let mut line = Running::start("simulate sercos-drive", drive_command.stderr(Stdio::inherit()));
    let (mut gateway_process, log) = start_box(&gateway, "namespaces-three");
    // The two drives on the other end of the cable are taken to cyclic operation.
    wait_for(&log, "CP4", &mut gateway_process);

    let mut reader = gateway.command(std::env::current_exe().expect("own path").to_str().expect("UTF-8"));
    reader.args(["--exact", "modbus_reader", "--nocapture"]).env(MODBUS_ADDRESS, "192.168.10.20:502");
    let modbus = Running::start("modbus reader", reader.stdout(Stdio::null()));

    let output = in_namespace(
        &controller,
        &[
            "simulate",
            "controller",
            "--target",
            "192.168.10.20",
            "--bind",
            "192.168.10.1",
            "--axes",
            "2",
            "--counts-per-unit",
            "1000000,10000",
            "--speed",
            "2,40",
            "--seconds",
            "4",
            "--json",
        ],
    )
    .output()
    .expect("the controller can be started");
    let log_text = std::fs::read_to_string(&log).unwrap_or_default();
    assert!(
        output.status.success(),
        "the controller ended with {}: {}\nthe box said:\n{log_text}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
    let result: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("--json prints one JSON object");
    for axis in result["axes"].as_array().expect("an array `axes`") {
        let (target, reached) = (axis["target"].as_f64().unwrap(), axis["reached"].as_f64().unwrap());
        assert!(
            target.abs() > 1.0 && (target - reached).abs() < 0.01,
            "the axis moved and reached its target: {axis}"
        );
    }
    let mut modbus = modbus;
    assert!(modbus.wait(Duration::from_secs(20)).success(), "the Modbus client saw both axes moving");
    assert!(gateway_process.ended().is_none(), "the box still runs: {log_text}");
    let status = gateway_process.terminate(Duration::from_secs(10));
    assert_eq!(status.code(), Some(0), "a box that is asked to end ends well");
    line.terminate(Duration::from_secs(10));
}

/// Not a test of its own: the process inside the namespace that the test above starts. It ends well once it has seen
/// both axes running and their positions changing.
#[test]
fn modbus_reader() {
    let Ok(address) = std::env::var(MODBUS_ADDRESS) else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let end = Instant::now() + Duration::from_secs(40);
        let mut seen = String::new();
        loop {
            assert!(Instant::now() < end, "no axis was seen moving: {seen}");
            match axisbridge_tests::modbus::watch(address.parse().unwrap(), Duration::from_millis(200)).await
            {
                Ok(axes) if axes.len() == 2 && axes.iter().all(|axis| axis.running && axis.moved) => return,
                Ok(axes) => {
                    seen.clear();
                    write!(seen, "{axes:?}").unwrap();
                }
                Err(error) => seen = error.to_string(),
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    });
}
