//! `axisbridge doctor` as a process: what it finds, and with which status it ends.

use std::path::PathBuf;
use std::process::{Command, Output};

use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use serde_json::Value;

/// The shipped example with another interface, the device on an address of this host.
fn configuration(name: &str, interface: &str) -> PathBuf {
    let example = include_str!("../../../examples/two-axes-sercos.toml");
    let text = example.replace("enp3s0", interface).replace("192.168.1.10", "127.0.0.2");
    // Not every machine of the tests has a second processor, and none can spare one.
    let text = text.replace("cpu = 1\n", "").replace("stay_awake = true", "stay_awake = false");
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.toml"));
    std::fs::write(&path, text).expect("the scratch folder can be written");
    path
}

fn doctor(mut command: Command, config: Option<&PathBuf>) -> (Output, Value) {
    command.args(["doctor", "--json", "--seconds", "1"]);
    if let Some(config) = config {
        command.arg("--config").arg(config);
    }
    let output = command.output().expect("the doctor can be started");
    let value = serde_json::from_slice(&output.stdout).expect("--json prints one JSON object");
    (output, value)
}

fn check<'v>(value: &'v Value, what: &str) -> &'v Value {
    let checks = value["checks"].as_array().expect("an array `checks`");
    checks.iter().find(|check| check["what"] == what).unwrap_or_else(|| panic!("no {what:?} in {checks:#?}"))
}

#[test]
fn without_a_configuration_the_usual_cycles_are_tried() {
    let (output, value) = doctor(Command::new(axisbridge()), None);
    assert_eq!(value["format"], 1);
    let unfit = value["verdict"] == "unfit";
    assert_eq!(output.status.code(), Some(i32::from(unfit)), "{value:#}");
    let cycles = value["cycles"].as_array().expect("an array `cycles`");
    let times: Vec<_> = cycles.iter().map(|cycle| cycle["cycle_time"].as_u64()).collect();
    assert_eq!(times, [Some(1_000_000), Some(2_000_000), Some(4_000_000)]);
    for cycle in cycles {
        let number = |key: &str| cycle[key].as_u64().unwrap_or_else(|| panic!("no {key} in {cycle}"));
        assert_eq!(number("wakes"), 1_000_000_000 / number("cycle_time"));
        assert!([number("p50"), number("p99"), number("p999")].is_sorted(), "{cycle}");
        assert!(number("usual_lateness") <= number("latest"), "{cycle}");
        assert!(number("outside") <= number("wakes"), "{cycle}");
    }
    assert_eq!(check(&value, "timer slack 1 ns")["verdict"], "good");
}

#[test]
fn what_the_box_would_not_find_is_unfit_by_name() {
    let config = configuration("doctor-missing", "axb-none");
    let (output, value) = doctor(Command::new(axisbridge()), Some(&config));
    assert_eq!((output.status.code(), &value["verdict"]), (Some(1), &Value::from("unfit")));
    let interface = check(&value, "interface axb-none");
    assert_eq!(interface["found"], "there is no network interface `axb-none`");
    assert!(
        interface["advice"].as_str().is_some_and(|advice| advice.contains("[south.sercos]")),
        "{interface}"
    );
}

#[test]
fn a_broken_configuration_is_told_as_check_tells_it() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("doctor-broken.toml");
    std::fs::write(&path, "[box]\nname = 7\n").expect("the scratch folder can be written");
    let output =
        Command::new(axisbridge()).arg("doctor").arg("--config").arg(&path).output().expect("it starts");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("doctor-broken.toml:2"), "{said}");
}

#[test]
fn a_cable_is_tried_as_the_box_will_use_it() {
    if !peer::namespaces_or_skip("a_cable_is_tried_as_the_box_will_use_it") {
        return;
    }
    let (host, drives) = (Namespace::new("dr1"), Namespace::new("dr2"));
    cable((&host, "sercos0", Some("192.0.2.1/24")), (&drives, "sercos0", None));
    let config = configuration("doctor-cable", "sercos0");
    let command = || host.command(axisbridge().to_str().expect("a path in UTF-8"));
    let (_, value) = doctor(command(), Some(&config));
    assert_eq!(check(&value, "interface sercos0")["found"], "up");
    assert_eq!(check(&value, "time stamps of sercos0")["verdict"], "good");
    let wire = check(&value, "wire of sercos0");
    assert!(wire["found"].as_str().is_some_and(|found| found.starts_with("veth")), "{wire}");
    let other = check(&value, "other traffic on sercos0");
    assert_eq!(other["verdict"], "doubtful", "it has an address: {other}");
    assert!(
        other["advice"].as_str().is_some_and(|advice| advice.contains("ip addr flush dev sercos0")),
        "{other}"
    );
    let cycle = &value["cycles"][0];
    assert_eq!((&cycle["what"], &cycle["cycle_time"]), (&"SERCOS III on sercos0".into(), &2_000_000.into()));

    drives.set_link("sercos0", false);
    // The kernel tells the other end of the cable a little later.
    let lost = (0..10).any(|_| {
        let (_, value) = doctor(command(), Some(&config));
        check(&value, "interface sercos0")["found"] == "no carrier"
    });
    assert!(lost, "the cable has no other end");
    host.set_link("sercos0", false);
    let (output, value) = doctor(command(), Some(&config));
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        check(&value, "interface sercos0")["found"],
        "the network interface `sercos0` is down (`ip link set sercos0 up`)"
    );
}
