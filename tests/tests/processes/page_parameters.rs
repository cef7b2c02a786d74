//! Parameters on the page: a browser reads and writes them, and another process sees what the drive has.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use serde_json::Value;

use super::http::{address, ask, get, until};
use super::http_control::token;
use super::local::{Gateway, path};
use super::page::CONFIGURATION;

const PATIENCE: Duration = Duration::from_secs(30);

/// The gateway of the page with a device at this address, and with more keys of `[http]`.
fn configuration(device: Ipv4Addr, keys: &str) -> String {
    assert_eq!(CONFIGURATION.matches("127.0.0.91").count(), 1);
    let text = CONFIGURATION.replace("127.0.0.91", &device.to_string());
    text.replacen("[http]\n", &format!("[http]\n{keys}\n"), 1)
}

fn object(address: SocketAddr, path: &str) -> Value {
    let (code, body) = get(address, path);
    assert_eq!(code, 200, "{path}: {body}");
    serde_json::from_str(&body).expect("JSON")
}

#[test]
fn parameters_of_every_bus_are_read_without_a_token_and_not_written() {
    in_real_time("parameters_of_every_bus_are_read_without_a_token_and_not_written", || {
        let mut gateway = Gateway::with("parameters-read", &configuration([127, 0, 2, 102].into(), ""));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        for (axis, bus, id, name) in [
            ("turntable", "sercos", "S-0-0104", "Position loop K_V-factor"),
            ("slide", "canopen", "6081:00", "Profile velocity"),
            ("spindle", "devicenet", "66.1.504", "Torque Limit - Positive"),
        ] {
            let list = object(address, &format!("/api/v1/parameters?axis={axis}"));
            assert_eq!((&list["axis"], &list["bus"]), (&axis.into(), &bus.into()));
            let rows = list["parameters"].as_array().expect("a list");
            let row = rows.iter().find(|row| row["id"] == id).unwrap_or_else(|| panic!("{list}"));
            let shown = row["name"].as_str().unwrap_or_default().to_lowercase();
            assert_eq!(shown, name.to_lowercase(), "{row}");
            let read = object(address, &format!("/api/v1/parameter?axis={axis}&id={id}"));
            let report = &read["parameters"][0]["report"];
            // The same words as those of the command.
            let mut command = Command::new(axisbridge());
            command.args(["param", "read", axis, id, "--json", "--local"]).arg(&gateway.socket);
            let output = command.stdin(Stdio::null()).output().expect("it starts");
            let expected: Value = serde_json::from_slice(&output.stdout).expect("JSON");
            assert_eq!(*report, expected);
            assert!(report["value"].as_str().is_some_and(|value| !value.is_empty()), "{read}");
            assert_eq!(report["writable"], "without torque", "{read}");
        }
        // Every row of a list that can be read is read while the buses stay as they are.
        let cycles = |address| object(address, "/api/v1/status")["cycles"].clone();
        let before = cycles(address);
        let list = object(address, "/api/v1/parameters?axis=turntable");
        let ids: Vec<_> = list["parameters"].as_array().expect("a list").iter().collect();
        assert!(ids.len() > 100, "{}", ids.len());
        let mut refused = Vec::new();
        for lot in ids.chunks(8).take(6) {
            let query: Vec<_> =
                lot.iter().map(|row| format!("id={}", row["id"].as_str().expect("text"))).collect();
            let path = format!("/api/v1/parameter?axis=turntable&{}&brief", query.join("&"));
            let read = object(address, &path);
            let answers = read["parameters"].as_array().expect("a list");
            assert_eq!(answers.len(), lot.len());
            refused.extend(answers.iter().filter(|answer| answer["report"].is_null()).cloned());
        }
        assert_eq!(refused, Vec::<Value>::new());
        let after = cycles(address);
        assert_eq!(before["lost_telegrams"], after["lost_telegrams"], "{before} {after}");
        // Nobody writes without a stream, and there is none without a token.
        for method in ["POST", "PUT", "PATCH", "DELETE"] {
            let path = "/api/v1/parameter?axis=turntable&id=S-0-0104&value=9";
            assert_eq!(ask(address, method, path).0, 405, "{method}");
        }
        assert_eq!(get(address, "/api/v1/parameter?axis=turntable&id=S-0-0104&value=9").0, 400);
        assert_eq!(get(address, "/api/v1/control").0, 403);
        let read = object(address, "/api/v1/parameter?axis=turntable&id=S-0-0104&brief");
        assert_eq!(read["parameters"][0]["report"]["value"], "3.00", "{read}");
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}

#[test]
fn page_reads_and_writes_parameters_of_the_drive() {
    let Some(chromium) = peer::chromium_or_skip("parameters in a browser") else { return };
    let Some(python) = peer::python_or_skip("parameters in a browser", "json") else { return };
    in_real_time("page_reads_and_writes_parameters_of_the_drive", || {
        let (token, file) = token("http-parameters");
        let keys = format!("token = \"{}\"", file.display());
        let mut gateway = Gateway::with("http-parameters", &configuration([127, 0, 2, 103].into(), &keys));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/page_parameters.py");
        let mut browser = Command::new(&python);
        browser.arg(script).arg(&chromium).arg(format!("http://{address}/")).arg(path("parameter-pictures"));
        browser.arg(&token).arg(axisbridge()).arg(&gateway.socket);
        let output = browser.stdin(Stdio::null()).output().expect("python starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert_eq!(report["before"], 0, "nothing is read before somebody comes to it");
        let gain = &report["gain"];
        assert!(
            gain["name"].as_str().is_some_and(|name| name.to_lowercase().contains("position loop")),
            "{gain}"
        );
        let cells = |seen: &Value| -> Vec<String> {
            let cells = seen["cells"].as_array().expect("a list");
            cells.iter().map(|cell| cell.as_str().expect("text").to_owned()).collect()
        };
        let [id, value, range, written] = &cells(gain)[..] else { panic!("{gain}") };
        assert_eq!((id.as_str(), written.as_str()), ("S-0-0104", "without torque"), "{gain}");
        assert!(value.starts_with("3.00"), "{gain}");
        assert!(range.contains("0.01 to "), "{gain}");

        assert_eq!(report["says"], "Parameters are read only until you log in at Local control.");
        assert_eq!(report["form_without_token"], false);
        assert_eq!(report["without_token"], "3.00", "nothing is written without the token");

        assert_eq!(report["kept"], "Kept: 2.50, before 3.00.");
        assert_eq!(report["after_kept"], "2.50", "another process reads what the page has written");
        let refused = report["refused"].as_str().expect("text");
        let words = "Refused: S-0-0104: the drive refuses the operation data with 0x7006: operation data is below the minimum";
        assert_eq!(refused, words);
        assert_eq!(report["after_refused"], "2.50");
        let said = ["Written: 120000.", "Not kept: the drive took S-0-0104 = 2.00 and has 1.99 afterwards"];
        assert_eq!(report["replies"], serde_json::json!(said));
        assert!(report["seen_after_s"].as_f64().is_some_and(|seconds| seconds < 10.0), "{report}");
        let cells_after = cells(&report["gain_after"]);
        assert_eq!(&cells_after[2], range, "limits stay although only the value is read again");
        let command = cells(&report["command"]);
        assert!(command[3].starts_with("not through the gateway: "), "{command:?}");
        assert_eq!(report["form_of_command"], false);

        let of = |key: &str| report[key].as_u64().unwrap_or_else(|| panic!("{key}: {report}"));
        assert!(of("on_screen") < of("rows"), "{report}");
        assert!(of("read") >= 1 && of("read") < of("rows"), "only what is on the screen is read: {report}");
        assert_eq!(report["with_torque"], true);
        assert_eq!(report["wide"], false, "wider than the screen");
        assert_eq!(report["faint"], Value::Array(Vec::new()), "too little contrast");
        for (axis, id, after) in [("slide", "6081:00", "1234"), ("spindle", "66.1.504", "150")] {
            let other = &report["others"][axis];
            let cells = cells(other);
            assert_eq!((cells[0].as_str(), cells[3].as_str()), (id, "without torque"), "{cells:?}");
            assert_eq!(other["form_without_control"], false, "{axis}");
            let before = other["before"].as_str().expect("text");
            assert_ne!(before, after, "{axis}: the write changes something");
            assert_eq!(other["said"], format!("Kept: {after}, before {before}."), "{axis}");
            assert_eq!(other["after"], after, "{axis}: another process reads what the page has written");
        }
        assert_eq!(report["complaints"], Value::Array(Vec::new()), "the console is silent");
        let requests = report["requests"].as_array().expect("a list");
        let own = format!("http://{address}/");
        assert!(
            requests
                .iter()
                .all(|url| url.as_str().is_some_and(|url| url.starts_with(&own) || url.starts_with("data:"))),
            "nothing from elsewhere: {requests:?}"
        );

        let log = gateway.log();
        let line = "local control: write axis=\"turntable\" parameter=\"S-0-0104\"";
        assert!(log.contains(line), "no {line:?} in {log}");
        // Of a browser and of a tool.
        assert!(log.matches(line).count() >= 3, "{log}");
        let end = Instant::now() + PATIENCE;
        while gateway.connect().ask("status turntable").contains(" state=operating ") {
            assert!(Instant::now() < end, "the axis keeps its torque");
        }
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}
