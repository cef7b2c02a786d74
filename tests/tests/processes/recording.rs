//! What a running gateway keeps of its frames: the last seconds, recordings of faults, first contacts, and the diagnostics bundle.

use std::fs;
use std::io::Read as _;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};
use axisbridge_tests::{peer, tshark};
use serde_json::Value;

use super::histories::{ask, provoke};
use super::http::{address, connect};
use super::local::{Gateway, path};

const PATIENCE: Duration = Duration::from_secs(60);

/// The example on an address of its own, with HTTP and a directory.
fn configuration(device: &str, directory: &str) -> String {
    let tables = format!("[http]\nlisten = \"127.0.0.1:0\"\n\n[history]\ndirectory = \"{directory}\"\n\n");
    two_axes(device, &tables)
}

fn contacts(gateway: &Gateway) -> Vec<Value> {
    let (code, text, errors) = ask(gateway, &["contacts", "--json"]);
    assert_eq!(code, Some(0), "{errors}");
    let object: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    object["contacts"].as_array().expect("a list").clone()
}

/// Waits until something is there.
fn until<T>(gateway: &Gateway, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "{:?}\n{}", contacts(gateway), gateway.log());
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn controller(device: &str, bind: &str) -> Command {
    let mut command = Command::new(axisbridge());
    command.args(["simulate", "controller", "--target", device, "--bind", bind, "--axes", "2"]);
    command.args(["--counts-per-unit", "1000000,10000", "--speed", "1,10", "--seconds", "4"]);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// What `decode` prints of a file.
fn decoded(file: &Path) -> String {
    let output = Command::new(axisbridge()).arg("decode").arg(file).output().expect("it can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Code and body of an answer.
fn get(address: SocketAddr, path: &str) -> (u16, Vec<u8>) {
    let mut bytes = Vec::new();
    let mut stream = connect(address, &format!("GET {path} HTTP/1.1\r\nHost: gateway\r\n\r\n"));
    stream.read_to_end(&mut bytes).expect("an answer");
    let end = bytes.windows(4).position(|window| window == b"\r\n\r\n").expect("a head") + 4;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let code = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or_default();
    let length = format!("content-length: {}\r\n", bytes.len() - end);
    assert!(head.to_ascii_lowercase().contains(&length), "{head}");
    (code, bytes.split_off(end))
}

fn names(archive: &Path) -> Vec<String> {
    let output = Command::new("tar").arg("-tf").arg(archive).output().expect("tar");
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    String::from_utf8(output.stdout).expect("text").lines().map(str::to_owned).collect()
}

fn written(gateway: &Gateway, words: &[&str], file: &Path) {
    let mut words = words.to_vec();
    words.push(file.to_str().expect("a path"));
    let (code, text, errors) = ask(gateway, &words);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{text}{}", gateway.log());
}

#[test]
fn contact_recording_fault_and_bundle_of_a_running_gateway() {
    const NAME: &str = "contact_recording_fault_and_bundle_of_a_running_gateway";
    in_real_time(NAME, || {
        let directory: PathBuf = path("recording-state");
        let _ = fs::remove_dir_all(&directory);
        let device = "127.0.0.94";
        let text = configuration(device, "recording-state");
        let mut gateway = Gateway::with("recording", &text);
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        assert!(contacts(&gateway).is_empty());

        // A controller, and one that may not have the device.
        let mut first = Running::start("controller", &mut controller(device, "127.0.1.94"));
        let open = |contact: &Value| contact["kind"] == "motion" && contact["end"].is_null();
        until(&gateway, || contacts(&gateway).iter().any(open).then_some(()));
        let refused = controller(device, "127.0.1.95").status().expect("it can be started");
        assert!(!refused.success());
        let ended = |contact: &Value| contact["kind"] == "motion" && !contact["end"].is_null();
        let contact = until(&gateway, || contacts(&gateway).into_iter().find(ended));
        first.terminate(PATIENCE);
        let phases: Vec<_> =
            contact["phases"].as_array().expect("a list").iter().map(|one| &one["phase"]).collect();
        assert_eq!(phases[0], "forward_open");
        for phase in ["configuration", "group_sync", "synchronous", "first_enable"] {
            assert!(phases.iter().any(|one| *one == phase), "{contact}");
        }
        assert!(contact["peer"].as_str().is_some_and(|peer| peer.starts_with("127.0.1.94:")), "{contact}");
        assert!(
            contact["end"]["by"].as_str().is_some_and(|by| by.contains("closed by its originator")),
            "{contact}"
        );
        assert!(contact["frames"].as_u64().is_some_and(|frames| frames > 100), "{contact}");
        let other =
            contacts(&gateway).into_iter().find(|contact| contact["kind"] == "refused").expect("refused");
        assert!(other["peer"].as_str().is_some_and(|peer| peer.starts_with("127.0.1.95:")), "{other}");
        assert_eq!(other["refused"][0]["service"], "Forward_Open");
        assert!(
            other["refused"][0]["reason"].as_str().is_some_and(|reason| reason.contains("0x01")),
            "{other}"
        );

        // The frames of the contact, and the last seconds of both sides.
        let number = contact["number"].to_string();
        let (frames, last) = (path("recording-contact.pcapng"), path("recording-last.pcapng"));
        written(&gateway, &["contacts", &number, "--pcapng"], &frames);
        let tree = decoded(&frames);
        for part in
            ["SYN", "REGISTER_SESSION", "Forward_Open request", "Forward_Open reply: success", "D-to-C"]
        {
            assert!(tree.contains(part), "no {part:?} in {tree:.20000}");
        }
        written(&gateway, &["record", "--last", "3", "--output"], &last);
        let tree = decoded(&last);
        assert!(tree.contains(" on north ") && tree.contains(" on sercos port 1 "), "{tree:.2000}");
        let mut translate = Command::new(axisbridge());
        translate.arg("translate").arg(&last).arg("--config").arg(path("recording.toml"));
        let output = translate.output().expect("it can be started");
        assert!(output.status.code().is_some_and(|code| code < 2), "{output:?}");
        assert!(!output.stdout.is_empty());
        if peer::tshark_or_skip(NAME) {
            for (file, filters) in [(&frames, &["enip && tcp", "cipm"][..]), (&last, &["siii"])] {
                for filter in filters {
                    assert!(!tshark::dissect(file, filter, &[]).is_empty(), "{filter}");
                }
                let mut warnings = tshark::warnings(file);
                // tshark does not read telegrams that announce a phase.
                warnings.retain(|(_, message)| !message.contains("CP is unknown"));
                assert!(warnings.is_empty(), "{warnings:?}");
            }
        }

        // A fault keeps a recording by itself.
        provoke(&gateway);
        let kept = until(&gateway, || {
            let files = fs::read_dir(directory.join("recordings")).ok()?.flatten();
            let mut files = files.map(|file| file.path());
            files.find(|path| path.extension() == Some("pcapng".as_ref()))
        });
        assert!(kept.to_string_lossy().ends_with("Z-turntable.pcapng"), "{kept:?}");
        assert!(decoded(&kept).contains(" on sercos port 1 "));

        // Everything in one file, over the socket and over HTTP.
        let archive = path("recording-bundle.tar");
        written(&gateway, &["bundle", "--output"], &archive);
        let listed = names(&archive);
        for name in [
            "status.json",
            "faults.json",
            "log.jsonl",
            "contacts.json",
            "configuration.toml",
            "doctor.txt",
            "recording.pcapng",
        ] {
            assert!(listed.contains(&format!("axisbridge-bundle/{name}")), "{listed:?}");
        }
        assert!(listed.contains(&format!("axisbridge-bundle/contact-{number}.pcapng")), "{listed:?}");
        let address = address(&gateway);
        let (code, bytes) = get(address, "/bundle");
        fs::write(&archive, bytes).expect("the folder of the tests can be written to");
        assert_eq!((code, names(&archive).len()), (200, listed.len()));
        let (code, bytes) = get(address, "/recording.pcapng?last=5");
        fs::write(&last, bytes).expect("the folder of the tests can be written to");
        assert!(code == 200 && decoded(&last).contains(" on sercos port 1 "));
        assert_eq!(get(address, "/recording.pcapng?last=0").0, 400);
        assert_eq!(get(address, "/contact.pcapng?number=99").0, 404);
        let (code, bytes) = get(address, "/api/v1/contacts");
        let list: Value = serde_json::from_slice(&bytes).expect("an object");
        assert_eq!((code, list["contacts"].as_array().map(Vec::len)), (200, Some(2)));

        // The contacts outlive the gateway.
        assert!(gateway.run.terminate(PATIENCE).success(), "{}", gateway.log());
        let gateway = Gateway::with("recording-again", &text);
        gateway.connect().until("status turntable", "ok status turntable state=");
        let known: Vec<_> = contacts(&gateway).iter().map(|contact| contact["number"].clone()).collect();
        assert_eq!(known, [2, 1], "{}", gateway.log());
        written(&gateway, &["contacts", &number, "--pcapng"], &frames);
        assert!(decoded(&frames).contains("Forward_Open reply: success"));
    });
}
