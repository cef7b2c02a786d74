//! The page of a running gateway in a browser: every view, both colour schemes, desk and phone, and the keyboard alone.

use std::path::Path;
use std::process::{Command, Stdio};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use serde_json::Value;

use super::http::{address, get, until};
use super::local::{Gateway, path};

/// An axis on each kind of bus.
pub const CONFIGURATION: &str = include_str!("page.toml");

const FAULT: &str = "excessive_position_error";

/// What the browser has seen of one view.
struct Seen<'a>(&'a Value);

impl<'a> Seen<'a> {
    fn text(&self, key: &str) -> &'a str {
        self.0[key].as_str().unwrap_or_else(|| panic!("{key}: {}", self.0))
    }

    fn shows(&self, wanted: &str) {
        let text = self.text("text");
        assert!(text.contains(wanted), "{} shows no `{wanted}`: {text}", self.text("view"));
    }
}

#[test]
fn every_view_of_the_page_works_in_a_browser() {
    let Some(chromium) = peer::chromium_or_skip("the page in a browser") else { return };
    let Some(python) = peer::python_or_skip("the page in a browser", "json") else { return };
    in_real_time("every_view_of_the_page_works_in_a_browser", || {
        let mut gateway = Gateway::with("page", CONFIGURATION);
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        // A fault with a code of the drive: a window that it leaves as soon as it moves.
        let mut client = gateway.connect();
        let reply = client.ask("write turntable S-0-0159 0.0001");
        assert!(reply.starts_with("ok write turntable "), "{reply}");
        client.until("enable turntable", "ok enable turntable state=operating ");
        client.ask("jog turntable 5 acceleration=100");
        until(address, "/readyz", |code, body| code == 503 && body.contains(FAULT));
        drop(client);
        let standing = |_: u16, body: &str| {
            let status: Value = serde_json::from_str(body).expect("JSON");
            status["axes"][0]["state"] == "faulted" && status["axes"][0]["owner"] == "nobody"
        };
        until(address, "/api/v1/status", standing);

        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/page.py");
        let mut browser = Command::new(&python);
        browser.arg(script).arg(&chromium).arg(format!("http://{address}/")).arg(path("page-pictures"));
        let output = browser.stdin(Stdio::null()).output().expect("python starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
        let (_, status) = get(address, "/api/v1/status");
        let status: Value = serde_json::from_str(&status).expect("JSON");
        let (_, faults) = get(address, "/api/v1/faults?axis=turntable");
        let faults: Value = serde_json::from_str(&faults).expect("JSON");

        assert_eq!(report["complaints"], Value::Array(Vec::new()), "the console is silent");
        let own = format!("http://{address}/");
        let foreign =
            |url: &&Value| !url.as_str().is_some_and(|url| url.starts_with(&own) || url.starts_with("data:"));
        let requests = report["requests"].as_array().expect("a list");
        assert_eq!(requests.iter().find(foreign), None, "nothing from elsewhere");
        views(&report, &status, &faults);
        assert_eq!(report["bookmark"], "slide");
        let rows = report["filtered"].as_array().expect("a list");
        assert!(
            (1..=3).contains(&rows.len())
                && rows.iter().all(|row| row.as_str().is_some_and(|row| row.contains("S-0-0047"))),
            "{rows:?}"
        );
        keyboard(&report["keyboard"], &status);
        let ended = gateway.run.terminate(std::time::Duration::from_secs(30));
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}

#[test]
fn page_begins_anew_after_a_restart_and_shows_what_a_lost_drive_has_reported_last() {
    let Some(chromium) = peer::chromium_or_skip("the page in a browser") else { return };
    let Some(python) = peer::python_or_skip("the page in a browser", "json") else { return };
    in_real_time("page_begins_anew_after_a_restart_and_shows_what_a_lost_drive_has_reported_last", || {
        // The page finds the gateway again at the same port.
        let text =
            CONFIGURATION.replacen("127.0.0.1:0", "127.0.2.104:8104", 1).replace("127.0.0.91", "127.0.2.104");
        let mut gateway = Gateway::with("page-restart", &text);
        until(address(&gateway), "/readyz", |code, _| code == 200);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/page_restart.py");
        let mut browser = Command::new(&python);
        browser.arg(script).arg(&chromium).arg("http://127.0.2.104:8104/").arg(path("page-restart.toml"));
        browser.arg(gateway.run.id().to_string());
        let output = browser.stdin(Stdio::null()).output().expect("python starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert_eq!((&report["before"], &report["after"]), (&"1".into(), &"1.2".into()));
        // The first question of the mapping and of the axis has failed, and they are shown all the same.
        assert_eq!(report["failed"], serde_json::json!([1, 1]));
        let absent = report["absent"].as_str().expect("a text");
        for name in ["Torque", "Velocity"] {
            assert!(absent.contains(&format!("{name}\nnot reported")), "{absent}");
        }
        let count = |key: &str| report[key].as_str().map(|text| text.matches("last reported").count());
        assert!(count("values") >= Some(4), "{report}");
        assert_eq!(count("limits"), Some(1), "{report}");
        assert!(count("mapping") >= Some(3), "{report}");
        let ended = gateway.run.terminate(std::time::Duration::from_secs(30));
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}

/// Each view has the values of the status, readable, in both schemes and sizes.
fn views(report: &Value, status: &Value, faults: &Value) {
    let all = report["views"].as_array().expect("a list");
    assert_eq!(all.len(), 8 * 4, "eight views, two schemes, two sizes");
    let fault = &faults["faults"][0];
    for seen in all {
        let (at, seen) = (seen, Seen(seen));
        let name = format!("{} {} {}", seen.text("view"), seen.text("scheme"), seen.text("size"));
        assert_eq!(at["faint"], Value::Array(Vec::new()), "{name}: too little contrast");
        assert_eq!(at["wide"], false, "{name}: wider than the screen");
        let title = format!("{}: not ready", status["name"].as_str().expect("a name"));
        assert!(seen.text("title").ends_with(&title), "{name}: {}", seen.text("title"));
        match seen.text("view") {
            "#/" => {
                for axis in status["axes"].as_array().expect("axes") {
                    for key in ["name", "state", "cip_state", "owner"] {
                        seen.shows(axis[key].as_str().expect("a text"));
                    }
                    seen.shows(&position(axis));
                }
                seen.shows(FAULT);
            }
            "#/axis/turntable" => {
                let axis = &status["axes"][0];
                seen.shows(axis["cip_state"].as_str().expect("a text"));
                seen.shows(&position(axis));
                for key in ["gateway", "drive_says", "advice"] {
                    seen.shows(fault[key].as_str().expect("a text"));
                }
                seen.shows(fault["controller"].as_str().unwrap_or("not reported"));
                seen.shows(&format!("{:#06X}", fault["drive_code"].as_u64().expect("a code")));
                seen.shows("10.000 rev/s");
            }
            "#/bus/SERCOS" => {
                seen.shows("CP4");
                seen.shows(status["buses"][0]["topology"].as_str().expect("a text"));
                seen.shows(status["axes"][0]["node"]["link"].as_str().expect("a text"));
            }
            "#/bus/CAN%20bus%201" => {
                ["operational", "node 2", "with all stuff bits"].iter().for_each(|text| seen.shows(text))
            }
            "#/bus/DeviceNet%201" => ["MAC ID 3", "exchange"].iter().for_each(|text| seen.shows(text)),
            "#/time" => ["shared", "10 µs", "Lateness of the cycle"].iter().for_each(|text| seen.shows(text)),
            "#/mapping/slide" => ["position_command", "607A:00"].iter().for_each(|text| seen.shows(text)),
            _ => ["front.eds", "axisbridge.toml", "status.json"].iter().for_each(|text| seen.shows(text)),
        }
    }
    let background = |scheme: &str| {
        let seen = all.iter().find(|seen| seen["scheme"] == scheme).expect("a view");
        seen["background"].clone()
    };
    assert_ne!(background("light"), background("dark"));
}

/// The actual position, as the page writes it.
fn position(axis: &Value) -> String {
    let (position, unit) =
        (axis["position"].as_f64().expect("a number"), axis["unit"].as_str().expect("a unit"));
    format!("{position:.6} {unit}")
}

/// Tab and Enter reach every page, the focus is seen, and it goes to the title of the page.
fn keyboard(keys: &Value, status: &Value) {
    let reached = keys["reached"].as_object().expect("an object");
    let axes = status["axes"].as_array().expect("axes").iter();
    let wanted: Vec<String> = axes
        .map(|axis| format!("#/axis/{}", axis["name"].as_str().expect("a name")))
        .chain(
            ["#/", "#/time", "#/mapping/turntable", "#/downloads", "#/bus/SERCOS", "#/bus/CAN%20bus%201"]
                .map(str::to_owned),
        )
        .collect();
    for target in wanted {
        let at = reached.get(&target).unwrap_or_else(|| panic!("{target} is not reached: {keys}"));
        let view = target.split('/').nth(1).filter(|view| !view.is_empty()).unwrap_or("overview");
        assert_eq!(at["view"], format!("view-{view}"), "{target}");
        assert_eq!(at["outline"], "solid", "{target}: the focus is not seen");
        if view != "overview" {
            assert_eq!(at["focus"], "H2", "{target}: {at}");
        }
    }
    assert_eq!(keys["skip"], serde_json::json!({ "first": "#main", "focus": "main", "hash": "#/time" }));
}
