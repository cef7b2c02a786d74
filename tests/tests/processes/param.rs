//! `axisbridge param` with a running gateway: a drive is backed up, replaced by a new one, restored, compared and moved; its commands
//! are executed. The same without a gateway.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

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

impl From<Output> for Printed {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        Self { code: output.status.code(), out: text(output.stdout), errors: text(output.stderr) }
    }
}

fn param(gateway: &Gateway, words: &[&str]) -> Printed {
    let socket = gateway.socket.to_str().expect("a path");
    param_with(words, &["--local", socket])
}

fn param_with(words: &[&str], more: &[&str]) -> Printed {
    let mut command = Command::new(axisbridge());
    command.arg("param").args(words).args(more).stdin(Stdio::null());
    command.output().expect("the command can be started").into()
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

/// The drives are in the process of the gateway: those of the next one are others.
#[test]
fn a_devicenet_drive_is_replaced() {
    in_real_time("a_devicenet_drive_is_replaced", || {
        let text = include_str!("../virtual_time/devicenet.toml").replace("10.0.0.2", "127.0.0.90");
        let start = |name: &str| {
            let gateway = Gateway::with(name, &text);
            gateway.connect().until("status turntable", "ok status turntable state=inhibited owner=nobody ");
            gateway
        };
        let gateway = start("param-devicenet-old");
        let printed = param(&gateway, &["write", "turntable", "66.1.441", "75.5"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert_eq!(printed.out, "66.1.441 = 75.5 Radians/Sec (was 50)\n");
        let file = path("param-devicenet-backup.toml");
        let _ = fs::remove_file(&file);
        let name = file.to_str().expect("a path");
        let printed = param(&gateway, &["backup", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let counts = format!(
            "20 parameters of turntable in {name}\n238 parameters of the list are not in this drive\n"
        );
        assert_eq!(printed.out, counts);
        let backup = fs::read_to_string(&file).expect("the backup");
        for part in [
            "bus = \"devicenet\"\nsource = \"dictionary\"\n",
            "product_name = \"simulated drive\"\n",
            "vendor = \"1\"\n",
            "id = \"66.1.441\"\nname = \"Kpp\"\ntype = \"f32\"\nvalue = \"75.5\"\nunit = \"Radians/Sec\"\n",
            "id = \"66.1.1315\"\nname = \"Motor Type\"\ntype = \"u8\"\nvalue = \"1\"\ndata = \"01\"\n",
        ] {
            assert!(backup.contains(part), "{part} in {backup}");
        }
        stop(gateway);

        // Another drive, as it comes from its maker.
        let gateway = start("param-devicenet-new");
        let printed = param(&gateway, &["compare", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(1), ""), "{printed:?}");
        let table =
            "parameter  backup  drive  name\n66.1.441   75.5    50     Kpp\n\n1 of 20 parameters differ\n";
        assert_eq!(printed.out, table);
        let of_others = changed(&file, "product_code = \"1\"", "product_code = \"9\"");
        let printed = param(&gateway, &["restore", "turntable", &of_others]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        let expected =
            "the backup is of another type of drive:\n  product_code: 9 in the backup, 1 in the drive\n";
        assert_eq!(printed.errors, expected);
        // 1e9 is beyond what the drive takes: that is said, and the exit status says it too.
        let refused = changed(&file, "data = \"00009742\"", "data = \"286b6e4e\"");
        let printed = param(&gateway, &["restore", "turntable", &refused]);
        assert_eq!(printed.code, Some(1), "{printed:?}");
        let expected = "not restored: 66.1.441 = 75.5: 66.1.441: the drive refuses it with status 0x09: ";
        assert!(printed.errors.starts_with(expected), "{printed:?}");
        let printed = param(&gateway, &["restore", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let expected =
            "66.1.441 = 75.5\n1 of 20 parameters were written, 19 were the same, 0 were not restored\n";
        assert_eq!(printed.out, expected);
        let printed = param(&gateway, &["compare", "turntable", name]);
        assert_eq!(
            (printed.code, printed.out.as_str()),
            (Some(0), "20 parameters are the same\n"),
            "{printed:?}"
        );

        let mut client = gateway.connect();
        client.until("enable turntable", "ok enable turntable state=operating owner=local ");
        let reply = client.ask("move turntable 0.25 velocity=1 acceleration=5 by=gateway");
        assert!((value(&reply, "position=") - 0.25).abs() < 0.002, "{reply}");
        drop(client);
        stop(gateway);
    });
}

/// The objects of a command with `--json`.
fn objects(printed: &Printed) -> Vec<serde_json::Value> {
    printed.out.lines().map(|line| serde_json::from_str(line).expect("an object")).collect()
}

#[test]
fn a_command_of_a_drive_is_executed_to_its_end() {
    in_real_time("a_command_of_a_drive_is_executed_to_its_end", || {
        let gateway = start("param-command");
        let printed = param(&gateway, &["command", "turntable", "S-0-0264"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let beginning = "S-0-0264 Backup working memory procedure command: done after ";
        assert!(printed.out.starts_with(beginning) && printed.out.ends_with(" s\n"), "{printed:?}");
        // By its name, as the list has it.
        let name = "backup working memory procedure command";
        let printed = param(&gateway, &["command", "turntable", name, "--json"]);
        let objects = objects(&printed);
        let states: Vec<_> = objects.iter().map(|object| object["state"].as_str().expect("text")).collect();
        assert_eq!((printed.code, states), (Some(0), vec!["in-process", "done"]), "{printed:?}");
        let last = &objects[1];
        assert_eq!((&last["status"], &last["result"]), (&"0x0003".into(), &"done".into()), "{printed:?}");
        assert!(
            last["seconds"].as_f64().is_some_and(|seconds| seconds >= 0.15),
            "it takes 0.2 s: {printed:?}"
        );
        let printed = param(&gateway, &["command", "turntable", "S-0-0264", "--cancel"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(0), "S-0-0264: not set\n"), "{printed:?}");
        let printed = param(&gateway, &["command", "turntable", "S-0-0104"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert_eq!(printed.errors, "S-0-0104 is no procedure command: it is a parameter, which is written\n");
        stop(gateway);
    });
}

/// A socket on which the command of a drive never ends, and what a client asks there.
struct Endless(JoinHandle<Vec<String>>);

impl Endless {
    fn new(name: &str) -> (Self, String) {
        let socket = path(name);
        let _ = fs::remove_file(&socket);
        let listener = UnixListener::bind(&socket).expect("the folder of the tests can be written to");
        let serve = move || {
            let (stream, _) = listener.accept().expect("a client");
            let mut asked = Vec::new();
            let mut reader = BufReader::new(stream);
            loop {
                let mut line = String::new();
                // The end of the client.
                if reader.read_line(&mut line).unwrap_or(0) == 0 {
                    return asked;
                }
                let (state, status) = if line.ends_with(" cancel\n") {
                    ("not-set", "0x0000")
                } else {
                    ("in-process", "0x0007")
                };
                let reply = format!(
                    "ok command x {{\"id\":\"P-0-0500\",\"state\":\"{state}\",\"status\":\"{status}\"}}\n"
                );
                reader.get_mut().write_all(reply.as_bytes()).expect("a connection");
                asked.push(line);
            }
        };
        let socket = socket.to_str().expect("a path").to_owned();
        (Self(std::thread::spawn(serve)), socket)
    }

    /// The first and the last request, once the client has ended.
    fn asked(self) -> [String; 2] {
        let asked = self.0.join().expect("a server");
        [asked[0].clone(), asked[asked.len() - 1].clone()]
    }
}

#[test]
fn a_command_that_does_not_end_in_time_is_cancelled() {
    let (server, socket) = Endless::new("param-late.socket");
    let printed =
        param_with(&["command", "x", "P-0-0500", "--time-limit", "1", "--json"], &["--local", &socket]);
    let objects = objects(&printed);
    let last = objects.last().expect("an object");
    assert_eq!(
        (printed.code, objects.len()),
        (Some(1), 2),
        "one object a state, and the result: {printed:?}"
    );
    assert_eq!((&last["state"], &last["result"]), (&"in-process".into(), &"cancelled".into()), "{printed:?}");
    assert_eq!(last["why"], "not done within 1 s");
    assert_eq!(server.asked(), ["command x P-0-0500 start\n", "command x P-0-0500 cancel\n"]);
}

/// Waits for the end of a process.
fn ended(mut child: Child) -> Printed {
    let end = Instant::now() + Duration::from_secs(30);
    while child.try_wait().expect("a child").is_none() {
        assert!(Instant::now() < end, "it does not end");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().expect("its output").into()
}

#[test]
fn an_interrupted_command_is_cancelled() {
    let (server, socket) = Endless::new("param-interrupted.socket");
    let mut command = Command::new(axisbridge());
    command.args(["param", "command", "x", "P-0-0500", "--local", &socket]);
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let child = child.expect("the command can be started");
    std::thread::sleep(Duration::from_millis(700));
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.expect("kill").success());
    let printed = ended(child);
    assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""), "{printed:?}");
    assert!(printed.errors.starts_with("P-0-0500: interrupted, and cancelled after "), "{printed:?}");
    assert_eq!(server.asked(), ["command x P-0-0500 start\n", "command x P-0-0500 cancel\n"]);
}

/// The drives are in the process of the command: each command has new ones.
#[test]
fn drives_are_accessed_without_a_gateway() {
    in_real_time("drives_are_accessed_without_a_gateway", || {
        let config = |name: &str, text: &str| {
            let file = path(name);
            fs::write(&file, text).expect("the folder of the tests can be written to");
            file.to_str().expect("a path").to_owned()
        };
        let sercos = config("alone-sercos.toml", include_str!("../../../examples/two-axes-in-process.toml"));
        let can = config("alone-can.toml", include_str!("../virtual_time/can.toml"));
        let sercos = |words: &[&str]| param_with(words, &["--alone", "--config", &sercos]);
        let can = |words: &[&str]| param_with(words, &["--alone", "--config", &can]);

        // Protected in operation, and not in CP2.
        let printed = sercos(&["write", "turntable", "S-0-0121", "5"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(
            printed.out.starts_with("S-0-0121 = 5") && printed.out.ends_with(" (was 1)\n"),
            "{printed:?}"
        );
        let file = path("alone-backup.toml");
        let _ = fs::remove_file(&file);
        let name = file.to_str().expect("a path");
        let printed = sercos(&["backup", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert_eq!(sercos(&["compare", "turntable", name]).code, Some(0));
        let gear = "id = \"S-0-0121\"\n";
        let text = fs::read_to_string(&file).expect("the backup");
        let at = text.find(gear).expect("the gear");
        let (before, after) = text.split_at(at);
        let after = after.replacen("data = \"01000000\"", "data = \"05000000\"", 1);
        fs::write(&file, format!("{before}{after}")).expect("the backup");
        let printed = sercos(&["restore", "turntable", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(
            printed.out.contains("\n1 of ") && printed.out.contains(" 0 were not restored\n"),
            "{printed:?}"
        );
        let printed = sercos(&["command", "slide", "S-0-0264"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let printed = sercos(&["list", "turntable", "--commands"]);
        assert!(printed.out.ends_with(" parameters, from S-0-0025 of the drive\n"), "{printed:?}");

        let printed = can(&["write", "turntable", "6091h.1", "3"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert_eq!(printed.out, "6091:01 = 3 motor revolutions (was 1)\n");
        let printed = can(&["command", "turntable", "1010:01"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        let printed = can(&["write", "turntable", "6040h", "15"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert_eq!(printed.errors, "6040:00 is not written: the gateway commands the drive with it\n");

        let devicenet = config("alone-devicenet.toml", include_str!("../virtual_time/devicenet.toml"));
        let devicenet = |words: &[&str]| param_with(words, &["--alone", "--config", &devicenet]);
        let printed = devicenet(&["write", "turntable", "66.1.441", "60"]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert_eq!(printed.out, "66.1.441 = 60 Radians/Sec (was 50)\n");
        let printed = devicenet(&["backup", "slide", name]);
        assert_eq!((printed.code, printed.errors.as_str()), (Some(0), ""), "{printed:?}");
        assert!(printed.out.starts_with("20 parameters of slide in "), "{printed:?}");
        assert_eq!(devicenet(&["compare", "turntable", name]).code, Some(0));

        let printed = can(&["read", "nobody", "6081h"]);
        assert_eq!((printed.code, printed.out.as_str()), (Some(1), ""));
        assert_eq!(printed.errors, "unknown axis `nobody`: expected turntable, slide\n");
        let printed = param_with(&["read", "turntable", "6081h"], &["--alone"]);
        assert_eq!(printed.code, Some(2), "the command line is wrong: {printed:?}");
    });
}
