//! What has happened in a running gateway: a fault of a simulated drive in `axisbridge faults`, in `axisbridge log`, and again after
//! the gateway was ended, killed, and given a damaged file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};
use serde_json::Value;

use super::local::{Gateway, path};

const PATIENCE: Duration = Duration::from_secs(30);

/// The fault that the drive has when its following error exceeds its monitoring window.
const FAULT: &str = "excessive_position_error";

/// The example on an address of its own, with a directory for the history.
fn configuration(device: &str, directory: &str) -> String {
    two_axes(device, &format!("[history]\ndirectory = \"{directory}\"\n\n"))
}

/// What a command that is a client of the gateway prints, and its exit status.
pub fn ask(gateway: &Gateway, words: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(axisbridge());
    command.args(words).arg("--local").arg(&gateway.socket).stdin(Stdio::null());
    let output = command.output().expect("the command can be started");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn faults(gateway: &Gateway) -> (Option<i32>, Value) {
    let (code, text, errors) = ask(gateway, &["faults", "--json"]);
    (code, serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}{errors}")))
}

/// Waits until the faults are as wanted.
fn until(gateway: &Gateway, wanted: impl Fn(&Value) -> bool) -> (Option<i32>, Value) {
    let end = Instant::now() + PATIENCE;
    loop {
        let (code, object) = faults(gateway);
        if wanted(&object) {
            return (code, object);
        }
        assert!(Instant::now() < end, "{object}\n{}", gateway.log());
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Waits until a file has this text.
fn until_file(path: &Path, wanted: &str) -> String {
    let end = Instant::now() + PATIENCE;
    loop {
        let text = fs::read_to_string(path).unwrap_or_default();
        if text.contains(wanted) {
            return text;
        }
        assert!(Instant::now() < end, "no {wanted:?} in {}: {text}", path.display());
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Moves the turntable out of the window that its drive monitors.
pub fn provoke(gateway: &Gateway) {
    let mut client = gateway.connect();
    client.until("write turntable S-0-0159 0.0001", "ok write turntable ");
    client.until("enable turntable", "ok enable turntable state=operating ");
    let reply = client.ask("jog turntable 5 acceleration=100");
    assert!(reply.contains(" jog turntable "), "{reply}");
    // Until then the client stays: the axis stops without it.
    client.until("status turntable", "ok status turntable state=faulted ");
}

fn is_of(record: &Value, cause: &str) -> bool {
    record["axis"] == "turntable" && record["cause"] == cause
}

/// Numbers of the records of the fault, newest first.
fn numbers(object: &Value) -> Vec<u64> {
    let records = object["history"].as_array().expect("a list");
    let records = records.iter().filter(|record| is_of(record, FAULT));
    records.map(|record| record["number"].as_u64().expect("a number")).collect()
}

/// Level and text of an event.
fn logged(event: &Value) -> String {
    let part = |name: &str| event[name].as_str().expect("a text");
    format!("{} {}", part("level").to_ascii_uppercase(), part("text"))
}

/// Level and text of a line of the log, without time, axis and device.
fn without_names(line: &str) -> String {
    let (_, line) = line.split_once(' ').expect("a time");
    let about = ["turntable", "slide", "front"]
        .map(|name| [format!(" axis=\"{name}\""), format!(" device=\"{name}\"")]);
    about.iter().flatten().fold(line.trim_start().to_owned(), |line, about| line.replace(about.as_str(), ""))
}

#[test]
fn fault_is_in_the_history_and_in_the_log_and_outlives_the_gateway() {
    in_real_time("fault_is_in_the_history_and_in_the_log_and_outlives_the_gateway", || {
        let directory: PathBuf = path("histories-state");
        let _ = fs::remove_dir_all(&directory);
        let text = configuration("127.0.0.90", "histories-state");
        let mut gateway = Gateway::with("histories", &text);
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        assert_eq!(faults(&gateway).0, Some(0), "{}", gateway.log());

        // A fault, while somebody follows the log.
        let followed = path("histories-followed");
        let mut follow = Command::new(axisbridge());
        follow
            .args(["log", "--follow", "--lines", "1", "--axis", "turntable", "--local"])
            .arg(&gateway.socket);
        follow.stdin(Stdio::null()).stdout(fs::File::create(&followed).expect("the folder of the tests"));
        let mut follow = Running::start("log --follow", &mut follow);
        provoke(&gateway);
        let known = |object: &Value| {
            let records = object["history"].as_array().expect("a list");
            records.iter().any(|record| is_of(record, FAULT) && record["drive_says"].is_string())
        };
        let (code, object) = until(&gateway, known);
        assert_eq!(code, Some(1), "{object}");
        let present = &object["present"][0];
        assert!(
            is_of(present, FAULT) && present["drive"] == "drive-a" && present["bus"] == "SERCOS",
            "{object}"
        );
        let record =
            object["history"].as_array().expect("a list").iter().find(|one| is_of(one, FAULT)).unwrap();
        assert!(record["gateway"].as_str().is_some_and(|text| text.starts_with(FAULT)), "{record}");
        assert_eq!((&record["end"], &record["advice"]), (&Value::Null, &present["advice"]));
        let first = record["number"].as_u64().expect("a number");
        let (code, shown, _) = ask(&gateway, &["faults", "--axis", "turntable"]);
        assert_eq!(code, Some(1), "{shown}");
        for part in
            ["Present:\n  turntable: ", "\n  drive       drive-a on SERCOS, ", "\n  to do       Check that"]
        {
            assert!(shown.contains(part), "no {part:?} in {shown}");
        }
        let (code, shown, _) = ask(&gateway, &["faults", "--axis", "slide"]);
        assert_eq!(
            (code, shown.as_str()),
            (Some(0), "No fault is present.\n\nNo fault is in the history.\n")
        );
        let (code, _, errors) = ask(&gateway, &["faults", "--axis", "lathe"]);
        assert_eq!((code, errors.trim()), (Some(1), "unknown axis `lathe`: expected turntable, slide"));
        until_file(&followed, FAULT);
        follow.signal("INT");
        assert_eq!(follow.wait(PATIENCE).code(), Some(0));

        // The log of the command line is the log.
        let (code, lines, errors) = ask(&gateway, &["log", "--json", "--lines", "10000"]);
        assert_eq!((code, errors.as_str()), (Some(0), ""));
        // Threads log at the same time: their lines may change places, and nothing else may differ.
        let mut events: Vec<String> =
            lines.lines().map(|line| logged(&serde_json::from_str(line).expect("an object"))).collect();
        let mut written: Vec<String> = gateway.log().lines().take(events.len()).map(without_names).collect();
        events.sort();
        written.sort();
        assert_eq!(events, written);
        assert!(events.len() > 20, "{events:?}");
        let (code, lines, _) = ask(&gateway, &["log", "--axis", "turntable", "--level", "warn"]);
        assert_eq!(code, Some(0));
        assert!(lines.lines().all(|line| line.contains(" WARN turntable: ")), "{lines}");
        assert!(lines.contains(&format!(" WARN turntable: {FAULT} (axis fault, ")), "{lines}");
        assert_eq!(ask(&gateway, &["log", "--lines", "2"]).1.lines().count(), 2);

        // A reset ends it, and the end is in the file after a restart.
        gateway.connect().until("reset turntable", "ok reset turntable ");
        let (code, object) =
            until(&gateway, |object| object["present"].as_array().is_some_and(Vec::is_empty));
        assert_eq!(code, Some(0), "{object}");
        until(&gateway, |object| object["history"][0]["end"]["time"].is_string());
        assert_eq!(gateway.run.terminate(PATIENCE).code(), Some(0), "{}", gateway.log());
        let file = directory.join("faults.jsonl");
        let kept = fs::read_to_string(&file).expect("the history");
        let mut gateway = Gateway::with("histories", &text);
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        let (code, object) = faults(&gateway);
        assert_eq!((code, numbers(&object)), (Some(0), vec![first]), "{object}");
        assert!(object["history"][0]["end"]["time"].is_string(), "{object}");
        assert_eq!(fs::read_to_string(&file).expect("the history"), kept, "nothing new is written");

        // Another fault; then the gateway disappears without any end.
        provoke(&gateway);
        until(&gateway, |object| numbers(object).len() == 2);
        let (_, object) = faults(&gateway);
        let second = numbers(&object)[0];
        until_file(&file, &format!("\n{{\"number\":{second},"));
        gateway.run.signal("KILL");
        gateway.run.wait(PATIENCE);
        let mut gateway = Gateway::with("histories", &text);
        gateway.connect();
        let (_, object) = until(&gateway, |object| numbers(object).len() == 2);
        assert_eq!(numbers(&object), [second, first], "{object}");
        let newest = object["history"].as_array().expect("a list").iter().find(|one| is_of(one, FAULT));
        let end = &newest.expect("the second fault")["end"];
        assert_eq!(
            (&end["time"], &end["by"]),
            (&Value::Null, &"not seen: the gateway ended first".into()),
            "{object}"
        );
        gateway.run.terminate(PATIENCE);

        // A damaged file does not keep the gateway from starting.
        let good = fs::read_to_string(&file).expect("the history");
        fs::write(&file, &good[..good.len() / 2]).expect("the history");
        let mut gateway = Gateway::with("histories", &text);
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        assert_eq!(
            faults(&gateway),
            (Some(0), serde_json::json!({ "format": 1, "present": [], "history": [] }))
        );
        let log = gateway.log();
        assert!(
            log.contains("faults.jsonl is damaged: its last line has no end: it was cut; it is kept as "),
            "{log}"
        );
        let aside = fs::read_to_string(directory.join("faults.jsonl.damaged-1")).expect("the damaged file");
        assert_eq!(aside, good[..good.len() / 2]);
        assert_eq!(gateway.run.terminate(PATIENCE).code(), Some(0));
    });
}
