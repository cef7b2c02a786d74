//! `axisbridge param` with a running gateway: a drive is backed up, replaced by a new one, restored, compared and moved.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::axisbridge;

use super::local::{Gateway, path, value};

/// What a command printed on standard output and standard error, and its exit status.
#[derive(Debug)]
struct Printed {
    code: Option<i32>,
    out: String,
    errors: String,
}

fn param(gateway: &Gateway, words: &[&str]) -> Printed {
    let mut command = Command::new(axisbridge());
    command.arg("param").args(words).arg("--local").arg(&gateway.socket).stdin(Stdio::null());
    let output = command.output().expect("the command can be started");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    Printed { code: output.status.code(), out: text(output.stdout), errors: text(output.stderr) }
}

/// Starts a gateway with drives as they come from their maker, and waits until they are commissioned.
fn start(name: &str) -> Gateway {
    let gateway = Gateway::start(name, "127.0.0.88");
    gateway.connect().until("status turntable", "ok status turntable state=inhibited owner=nobody ");
    gateway
}

fn stop(mut gateway: Gateway) {
    let status = gateway.run.terminate(Duration::from_secs(30));
    assert_eq!(status.code(), Some(0), "{}", gateway.log());
}

fn reads_and_writes(gateway: &Gateway) {
    let printed = param(gateway, &["write", "turntable", "S-0-0104", "2.5"]);
    assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""));
    assert!(printed.out.starts_with("S-0-0104 = 2.50 1000/min (was "), "{printed:?}");
    let printed = param(gateway, &["read", "turntable", "S-0-0104", "S-0-0124"]);
    assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""));
    for line in [
        "S-0-0104 Position loop Kv-factor\n",
        "  value      2.50 1000/min\n",
        "  minimum    0.01 1000/min\n",
        "S-0-0124 ",
    ] {
        assert!(printed.out.contains(line), "{line} in {printed:?}");
    }
    let printed = param(gateway, &["read", "turntable", "S-0-0104", "--json"]);
    let object: serde_json::Value = serde_json::from_str(&printed.out).expect("one object");
    assert_eq!((&object["value"], &object["data"]), (&"2.50".into(), &"fa00".into()), "{object}");
    let printed = param(gateway, &["write", "turntable", "S-0-0104", "0"]);
    assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
    assert!(printed.errors.contains("with 0x7006: operation data is below the minimum"), "{printed:?}");
    let printed = param(gateway, &["list", "turntable", "--backup"]);
    assert_eq!(printed.code, Some(0), "{printed:?}");
    assert!(printed.out.ends_with(" parameters, from S-0-0192 of the drive\n"), "{printed:?}");
    let printed = param(gateway, &["read", "nobody", "S-0-0104"]);
    assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
    assert!(printed.errors.contains("unknown axis `nobody`"), "{printed:?}");
}

/// The file of a backup with one line changed.
fn changed(file: &Path, from: &str, to: &str) -> String {
    let text = fs::read_to_string(file).expect("the backup");
    assert!(text.contains(from), "{from} in {text}");
    let other = file.with_extension("changed.toml");
    fs::write(&other, text.replacen(from, to, 1)).expect("the folder of the tests can be written to");
    other.to_str().expect("a path").to_owned()
}

#[test]
fn a_drive_is_replaced() {
    in_real_time("a_drive_is_replaced", || {
        let gateway = start("param-old");
        reads_and_writes(&gateway);
        let file = path("param-backup.toml");
        let _ = fs::remove_file(&file);
        let name = file.to_str().expect("a path");
        let printed = param(&gateway, &["backup", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let printed = param(&gateway, &["compare", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(printed.out.ends_with(" parameters are the same\n"), "{printed:?}");
        stop(gateway);

        // Another drive, as it comes from its maker.
        let gateway = start("param-new");
        let printed = param(&gateway, &["compare", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(1), ""), "{printed:?}");
        let row = printed.out.lines().find(|line| line.starts_with("S-0-0104 ")).expect("the gain");
        assert!(row.contains(" 2.50 "), "{printed:?}");
        assert!(printed.out.contains("\n1 of "), "{printed:?}");
        let of_others = changed(&file, "device_id = \"", "device_id = \"other ");
        let printed = param(&gateway, &["restore", "turntable", &of_others]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert!(
            printed.errors.starts_with("the backup is of another type of drive:\n  device_id: other "),
            "{printed:?}"
        );
        // Kv of 0.00 is below what the drive takes: that is said, and the exit status says it too.
        let refused = changed(&file, "data = \"fa00\"", "data = \"0000\"");
        let printed = param(&gateway, &["restore", "turntable", &refused]);
        assert_eq!(printed.code, Some(1), "{printed:?}");
        assert!(
            printed.errors.starts_with("not restored: S-0-0104 = 2.50: S-0-0104: the drive refuses"),
            "{printed:?}"
        );
        assert!(
            printed.out.contains("0 of ") && printed.out.contains(" 1 were not restored\n"),
            "{printed:?}"
        );

        let printed = param(&gateway, &["restore", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(printed.out.starts_with("S-0-0104 = 2.50\n1 of "), "{printed:?}");
        let printed = param(&gateway, &["compare", "turntable", name, "--json"]);
        let object: serde_json::Value = serde_json::from_str(&printed.out).expect("one object");
        assert_eq!((printed.code, &object["differences"]), (Some(0), &serde_json::json!([])), "{object}");
        assert!(object["compared"].as_u64().is_some_and(|count| count > 20), "{object}");

        let mut client = gateway.connect();
        client.until("enable turntable", "ok enable turntable state=operating owner=local ");
        let reply = client.ask("move turntable 0.25 velocity=1 acceleration=5 by=gateway");
        assert!((value(&reply, "position=") - 0.25).abs() < 0.002, "{reply}");
        // While somebody has the axis, nothing is written.
        let printed = param(&gateway, &["write", "turntable", "S-0-0104", "9"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert_eq!(printed.errors, "S-0-0104: a client of local control has this axis\n");
        drop(client);
        stop(gateway);
    });
}

/// A CANopen drive has no list of its own: the backup has what the tables know and the drive has.
#[test]
fn a_canopen_drive_is_backed_up_changed_and_restored() {
    in_real_time("a_canopen_drive_is_backed_up_changed_and_restored", || {
        let text = include_str!("../virtual_time/can.toml").replace("10.0.0.2", "127.0.0.89");
        let gateway = Gateway::with("param-can", &text);
        gateway.connect().until("status turntable", "ok status turntable state=inhibited owner=nobody ");
        let file = path("param-can-backup.toml");
        let _ = fs::remove_file(&file);
        let name = file.to_str().expect("a path");
        let printed = param(&gateway, &["backup", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(printed.out.contains(" parameters of the list are not in this drive\n"), "{printed:?}");
        let backup = fs::read_to_string(&file).expect("the backup");
        assert!(backup.contains("id = \"6081:00\"\nname = \"Profile velocity\"\n"), "{backup}");
        assert!(backup.contains("bus = \"canopen\"") && !backup.contains("6040:00"), "{backup}");
        let before = param(&gateway, &["read", "turntable", "6081h"]);
        let printed = param(&gateway, &["write", "turntable", "6081h", "4711"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let printed = param(&gateway, &["compare", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(1), ""), "{printed:?}");
        assert!(printed.out.contains("\n6081:00 ") && printed.out.contains(" 4711 "), "{printed:?}");
        // A backup of one kind of bus is not for a drive of another one.
        let other = changed(&file, "bus = \"canopen\"", "bus = \"sercos\"");
        let printed = param(&gateway, &["restore", "turntable", &other, "--force"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert_eq!(printed.errors, "the backup is of a drive on sercos, and this one is on canopen\n");
        let printed = param(&gateway, &["restore", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(printed.out.contains("\n1 of "), "{printed:?}");
        assert_eq!(param(&gateway, &["read", "turntable", "6081h"]).out, before.out);
        assert_eq!(param(&gateway, &["compare", "turntable", name]).code, Some(0));
        stop(gateway);
    });
}
