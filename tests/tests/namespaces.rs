//! Processes on virtual cables: drives, gateway and controller, each in a network namespace of its own.
//!
//! Needs root and iproute2: a visible skip where they are missing, a failure in CI.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::{Running, axisbridge};

/// Set for the copy of this test binary that reads the Modbus map inside the gateway's namespace.
const MODBUS_ADDRESS: &str = "AXISBRIDGE_TEST_MODBUS";

fn in_namespace(namespace: &Namespace, arguments: &[&str]) -> Command {
    let mut command = namespace.command(axisbridge().to_str().expect("a path in UTF-8"));
    command.args(arguments);
    command
}

fn scratch(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The shipped example, with this test's interface and addresses.
fn configuration(name: &str) -> PathBuf {
    let example = include_str!("../../examples/two-axes-sercos.toml");
    let path = scratch(name);
    std::fs::write(&path, example).expect("the scratch folder can be written");
    path
}

#[test]
fn three_processes_move_two_axes_while_a_modbus_client_reads_them() {
    if !peer::namespaces_or_skip("three_processes_move_two_axes_while_a_modbus_client_reads_them") {
        return;
    }
    let (controller, gateway, drives) = (Namespace::new("ctl"), Namespace::new("box"), Namespace::new("drv"));
    // The addresses and interface names of examples/two-axes-sercos.toml.
    cable((&controller, "net0", Some("192.168.10.1/24")), (&gateway, "net0", Some("192.168.10.20/24")));
    cable((&gateway, "sercos0", None), (&drives, "sercos0", None));

    let mut drive_command =
        in_namespace(&drives, &["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2", "--seconds", "60"]);
    let mut line = Running::start("simulate sercos-drive", drive_command.stderr(Stdio::inherit()));
    let log = scratch("namespaces-box.log");
    let config = configuration("namespaces.toml");
    let mut run = in_namespace(&gateway, &["run", "--config", config.to_str().expect("a path in UTF-8")]);
    run.stderr(std::fs::File::create(&log).expect("the log can be written"));
    let mut gateway_process = Running::start("run", &mut run);

    let mut reader = gateway.command(std::env::current_exe().expect("own path").to_str().expect("UTF-8"));
    reader.args(["--exact", "modbus_reader", "--nocapture"]).env(MODBUS_ADDRESS, "192.168.10.20:502");
    let modbus = Running::start("modbus reader", reader.stdout(Stdio::null()));

    let output = in_namespace(
        &controller,
        &[
            "simulate", "controller", "--target", "192.168.10.20", "--bind", "192.168.10.1", "--axes", "2", "--seconds", "4",
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
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("--json prints one JSON object");
    for axis in result["axes"].as_array().expect("an array `axes`") {
        let (target, reached) = (axis["target"].as_f64().unwrap(), axis["reached"].as_f64().unwrap());
        assert!(target.abs() > 1.0 && (target - reached).abs() < 0.01, "the axis moved and reached its target: {axis}");
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
            match axisbridge_tests::modbus::watch(address.parse().unwrap(), Duration::from_millis(200)).await {
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
