//! A foreign class 1 scanner on a cable of its own: it moves an axis through assemblies, and the process of the drive says where the
//! motor went. And two hosts that consume its multicast stream. The programs are `tests/peers/ethernetip_scanner.py` and
//! `ethernetip_listener.py`, on the PyPI client ethernetip.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;
use axisbridge_tests::tshark::{self, Frame};
use serde_json::{Value, json};

use super::flood;
use super::{a_bus, configuration, in_namespace, scratch, wait_for};

const DEVICE: &str = "192.168.10.20";

/// Two hosts that listen, and the first group of the device: 32 times 19 behind 239.192.1.0.
const ONE: &str = "192.168.10.1";
const TWO: &str = "192.168.10.2";
const GROUP: &str = "239.192.3.96";

/// Puts both axes of a shipped example behind assemblies.
fn assemblies_in(path: &Path) {
    let text = std::fs::read_to_string(path).expect("it was written");
    let assembly = text.replace("power_structure_class_id = 0", "assembly = { layout = \"position\" }");
    assert_ne!(assembly, text);
    let slow = assembly.replace("max = \"16 ms\"", "max = \"50 ms\"");
    std::fs::write(path, slow).expect("the scratch folder can be written");
}

/// What the drives say when asked: the last line of the slide.
fn slide(line: &mut Running, said: &Path) -> String {
    let count = |text: &str| text.matches("drive 2: ").count();
    let before = count(&std::fs::read_to_string(said).unwrap_or_default());
    line.type_line("status");
    let end = Instant::now() + Duration::from_secs(10);
    loop {
        let text = std::fs::read_to_string(said).unwrap_or_default();
        if count(&text) > before && text.ends_with('\n') {
            return text.rsplit("drive 2: ").next().unwrap_or_default().trim().to_owned();
        }
        assert!(Instant::now() < end, "the drives do not answer: {text}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn place(shown: &str) -> f64 {
    let place = shown.rsplit_once("at ").map(|(_, place)| place.parse());
    place.and_then(Result::ok).unwrap_or_else(|| panic!("no position in {shown:?}"))
}

fn hex(value: &str) -> Vec<u8> {
    let octet = |at: usize| value.get(at..at + 2).and_then(|text| u8::from_str_radix(text, 16).ok());
    (0..value.len()).step_by(2).filter_map(octet).collect()
}

/// The only value of a field.
fn value(frame: &Frame, name: &str) -> String {
    frame.field(name).unwrap_or_else(|| panic!("no {name} in frame {}", frame.number)).show.clone()
}

#[test]
fn a_foreign_scanner_moves_a_drive_in_another_process() {
    let name = "a_foreign_scanner_moves_a_drive_in_another_process";
    if !peer::namespaces_or_skip(name) || !peer::tshark_or_skip(name) {
        return;
    }
    let Some(python) = peer::python_or_skip(name, "ethernetip") else { return };
    let _bus = a_bus();
    in_real_time(name, || {
        let (plc, gateway, drives) = (Namespace::new("plc"), Namespace::new("box"), Namespace::new("drv"));
        cable((&plc, "net0", Some("192.168.10.1/24")), (&gateway, "net0", Some("192.168.10.20/24")));
        cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
        let said = scratch("scanner-drives.log");
        let simulate =
            ["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2", "--linear", "2"];
        let mut line = in_namespace(&drives, &simulate);
        line.args(["--seconds", "90"]).stdin(Stdio::piped());
        line.stderr(std::fs::File::create(&said).expect("the log can be written"));
        let mut line = Running::start("simulate sercos-drive", &mut line);

        let (log, capture) = (scratch("scanner.log"), scratch("scanner.pcapng"));
        let config = configuration("scanner.toml");
        assemblies_in(&config);
        let text = |path: &Path| path.to_str().expect("a path in UTF-8").to_owned();
        let mut run =
            in_namespace(&gateway, &["run", "--config", &text(&config), "--capture", &text(&capture)]);
        run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
        let mut run = Running::start("run", &mut run);
        wait_for(&log, "CP4", &mut run);
        wait_for(&said, "drive 2: CP4, ready", &mut line);
        let start = place(&slide(&mut line, &said));

        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/ethernetip_scanner.py");
        let printed = scratch("scanner-python.log");
        let mut scanner = plc.command(python.to_str().expect("a path in UTF-8"));
        scanner.args([script, DEVICE]).stdin(Stdio::piped());
        scanner.stderr(std::fs::File::create(&printed).expect("the log can be written"));
        let mut scanner = Running::start("scanner", &mut scanner);
        // What the drive says at each step of the scanner, which goes on when it gets a line.
        let mut at = |step: &str| {
            wait_for(&printed, step, &mut scanner);
            let shown = slide(&mut line, &said);
            scanner.type_line("go on");
            shown
        };
        let enabled = at("enabled");
        let moved = at("moved 12.5");
        let idle = at("idle");
        let back = at("moved 2.5");
        let off = at("disabled");
        assert_eq!(
            scanner.wait(Duration::from_secs(30)).code(),
            Some(0),
            "{:?}",
            std::fs::read_to_string(&printed)
        );
        assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0));
        assert_eq!(line.terminate(Duration::from_secs(10)).code(), Some(0));

        assert!(enabled.starts_with("CP4, operating") && (place(&enabled) - start).abs() < 0.05, "{enabled}");
        // Positions of the assembly are those of the drive, from where it stood at power-up.
        assert!(moved.starts_with("CP4, operating"), "{moved}");
        assert!((place(&moved) - 12.5).abs() < 0.05, "{moved}");
        assert!(
            !idle.contains("operating") && place(&idle) > 13.0 && place(&idle) < 700.0,
            "idle amid a movement: {idle}"
        );
        assert!(back.starts_with("CP4, operating") && (place(&back) - 2.5).abs() < 0.05, "{back}");
        assert!(off.starts_with("CP4, ready") && (place(&off) - 2.5).abs() < 0.05, "{off}");
        read_by_tshark(&capture);
    });
}

/// tshark reads the connection, its sizes and its data.
fn read_by_tshark(capture: &Path) {
    let north = "enip";
    let malformed = tshark::dissect(capture, &format!("{north} && _ws.malformed"), &[]);
    assert!(malformed.is_empty(), "{malformed:?}");
    let opens = tshark::dissect(capture, "cip.cm.otrpi && cip.rr == 0", &[]);
    assert_eq!(opens.len(), 1, "one Forward_Open");
    let open = &opens[0];
    // Two axes of 16 and 20 bytes; sequence count, and run/idle header one way.
    let sizes: Vec<_> = open.all("cip.cm.fwo.consize").map(|size| size.show.as_str()).collect();
    assert_eq!(sizes, ["38", "42"]);
    assert_eq!((value(open, "cip.cm.otrpi"), value(open, "cip.cm.torpi")), ("20000".into(), "20000".into()));
    assert_eq!(value(open, "cip.connpoint"), "0x96");
    let data = tshark::dissect(capture, "cipio && cip.seq", &[]);
    let (out, input): (Vec<_>, Vec<_>) = data.iter().partition(|frame| value(frame, "ip.dst") == DEVICE);
    assert!(out.len() > 100 && input.len() > 100, "{} and {}", out.len(), input.len());
    let len = |frame: &&Frame| hex(&frame.field("cipio.data").expect("data").value).len();
    assert!(out.iter().map(len).all(|len| len == 32) && input.iter().map(len).all(|len| len == 40));
    let run = |frame: &&&Frame| value(frame, "cip.32bitheader.run_idle") == "0x00000001";
    assert!(out.iter().filter(run).count() > 50, "in run");
    assert!(out.iter().filter(|frame| !run(frame)).count() > 5, "in idle");
    // The target of the second axis, 12.5 mm in counts of 0.1 um, and the position that it reached.
    let at = |frame: &Frame, from: usize| {
        let data = hex(&frame.field("cipio.data").expect("data").value);
        i32::from_le_bytes(data[from..from + 4].try_into().expect("four"))
    };
    assert!(out.iter().any(|frame| at(frame, 16 + 4) == 125_000));
    assert!(input.iter().any(|frame| (at(frame, 20 + 8) - 125_000).abs() < 300));
    let closes = tshark::dissect(capture, "cip.sc == 0x4e && cip.rr == 1", &[]);
    assert_eq!(closes.len(), 1, "one answer to Forward_Close");
    assert_eq!(value(&closes[0], "cip.genstat"), "0x00");
}

#[test]
fn two_hosts_consume_one_multicast_stream() {
    let name = "two_hosts_consume_one_multicast_stream";
    if !peer::namespaces_or_skip(name) || !peer::tshark_or_skip(name) {
        return;
    }
    let Some(python) = peer::python_or_skip(name, "ethernetip") else { return };
    let _bus = a_bus();
    in_real_time(name, || {
        let [first, second, gateway, switch] = ["one", "two", "box", "sw"].map(Namespace::new);
        flood::run(&switch, "ip link add br0 type bridge");
        flood::run(&switch, "ip link set br0 up");
        for (port, host, address) in [("p0", &first, ONE), ("p1", &second, TWO), ("p2", &gateway, DEVICE)] {
            cable((host, "net0", Some(&format!("{address}/24"))), (&switch, port, None));
            flood::run(&switch, &format!("ip link set {port} master br0"));
        }
        let config = flood::configuration("multicast.toml");
        assemblies_in(&config);
        let (log, capture) = (scratch("multicast.log"), scratch("multicast.pcapng"));
        let text = |path: &Path| path.to_str().expect("a path in UTF-8").to_owned();
        let mut run =
            in_namespace(&gateway, &["run", "--config", &text(&config), "--capture", &text(&capture)]);
        run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
        let mut run = Running::start("run", &mut run);
        wait_for(&log, "CP4", &mut run);

        let listen = |host: &Namespace, address: &str, seconds: &str| {
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/ethernetip_listener.py");
            let (out, said) = (format!("multicast-{address}.json"), format!("multicast-{address}.log"));
            let mut command = host.command(python.to_str().expect("a path in UTF-8"));
            command.args([script, DEVICE, address, seconds]);
            command.stdout(std::fs::File::create(scratch(&out)).expect("it can be written"));
            command.stderr(std::fs::File::create(scratch(&said)).expect("it can be written"));
            let mut running = Running::start("listener", &mut command);
            wait_for(&scratch(&said), "open", &mut running);
            (running, scratch(&out), scratch(&said))
        };
        let result = |(mut running, out, said): (Running, PathBuf, PathBuf)| -> Value {
            let status = running.wait(Duration::from_secs(30));
            assert!(status.success(), "{}", std::fs::read_to_string(said).unwrap_or_default());
            let text = std::fs::read_to_string(out).expect("it was written");
            serde_json::from_str(&text).expect("one JSON object")
        };
        let one = listen(&first, ONE, "3");
        let two = listen(&second, TWO, "5");
        let (one, two) = (result(one), result(two));
        assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0));
        judge(&one, &two);

        let log = std::fs::read_to_string(&log).expect("a log");
        assert_eq!(log.matches(&format!("multicast to {GROUP}")).count(), 4, "{log}");
        let frames = tshark::dissect(&capture, &format!("ip.dst == {GROUP}"), &[]);
        assert!(frames.len() > 200, "{}", frames.len());
        assert!(frames.iter().all(|frame| !frame.has("_ws.malformed") && frame.has("cipio")));
        assert!(
            frames
                .iter()
                .all(|frame| value(frame, "ip.ttl") == "1" && value(frame, "eth.dst") == "01:00:5e:40:03:60")
        );
        let opens = tshark::dissect(&capture, "cip.cm.otrpi && cip.rr == 0 && cip.cm.fwo.type == 1", &[]);
        assert_eq!(opens.len(), 6, "three of each listener");
        let refused =
            tshark::dissect(&capture, "cip.cm.ext112torpi == 20000 && cip.cm.ext112torpi_type == 4", &[]);
        assert_eq!(refused.len(), 1, "the second one's other interval");
    });
}

/// What two listeners have got of the stream.
fn judge(one: &Value, two: &Value) {
    assert_eq!((&one["listen_only"], &two["listen_only"]), (&json!(0x0119), &json!(0)));
    assert_eq!((&one["other_interval"], &two["other_interval"]), (&json!(0), &json!(0x0112)));
    for (own, what) in [(one, "one"), (two, "two")] {
        assert_eq!((&own["open"], &own["close"]), (&json!(0), &json!(0)), "{what}");
        assert_eq!((&own["group"], &own["port"]), (&json!(GROUP), &json!(2222)), "{what}");
    }
    assert_eq!(one["id"], two["id"], "one stream has one connection ID");
    assert_eq!((&one["goes_on"], &two["goes_on"]), (&json!(true), &json!(false)));
    let datagrams = |own: &Value| -> BTreeMap<u64, String> {
        let received = own["received"].as_array().expect("datagrams");
        for datagram in received {
            assert_eq!((&datagram["from"], &datagram["id"]), (&json!(DEVICE), &own["id"]));
            assert_eq!(datagram["ttl"], json!([1]));
        }
        let entry = |one: &Value| {
            (one["number"].as_u64().expect("a number"), one["bytes"].as_str().expect("octets").to_owned())
        };
        received.iter().map(entry).collect()
    };
    let (one, two) = (datagrams(one), datagrams(two));
    let both: Vec<_> = one.keys().filter(|number| two.contains_key(number)).collect();
    // 20 ms apart, and nearly three seconds together.
    assert!(both.len() > 80, "{} in common", both.len());
    assert!(both.iter().all(|number| one[number] == two[number]), "octet for octet the same");
    let last = |own: &BTreeMap<u64, String>| own.keys().next_back().copied().unwrap_or(0);
    assert!(
        last(&two) > last(&one) + 50,
        "the stream goes on for the other one: {} {}",
        last(&one),
        last(&two)
    );
}
