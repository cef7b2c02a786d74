//! The HTTP server of a running gateway: every path, a fault of a simulated drive, and peers that misbehave.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::{alone_in_real_time, in_real_time};
use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use serde_json::{Value, json};

use super::local::{Gateway, path, value};

const PATIENCE: Duration = Duration::from_secs(30);

/// The fault that the drive has when its following error exceeds its monitoring window.
const FAULT: &str = "excessive_position_error";

/// The example on an address of its own, with HTTP in place of Modbus.
pub fn configuration(device: &str) -> String {
    two_axes(device, "[http]\nlisten = \"127.0.0.1:0\"\nconnections_max = 16\n\n")
}

/// The address in the log.
pub fn address(gateway: &Gateway) -> SocketAddr {
    address_of(gateway, "HTTP")
}

/// The same for this protocol.
pub fn address_of(gateway: &Gateway, protocol: &str) -> SocketAddr {
    let end = Instant::now() + PATIENCE;
    loop {
        let log = gateway.log();
        let found = log
            .lines()
            .find_map(|line| line.split_once(&format!(" {protocol} address="))?.1.trim().parse().ok());
        if let Some(address) = found {
            return address;
        }
        assert!(Instant::now() < end, "{log}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

pub fn connect(address: SocketAddr, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).expect("the gateway listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    let _ = stream.write_all(request.as_bytes());
    stream
}

/// Code, head and body of the answer; code 0 when the connection was closed.
pub fn ask(address: SocketAddr, method: &str, path: &str) -> (u16, String, String) {
    ask_with(address, method, path, "")
}

/// The same with more header lines.
pub fn ask_with(address: SocketAddr, method: &str, path: &str, lines: &str) -> (u16, String, String) {
    let mut stream = connect(address, &format!("{method} {path} HTTP/1.1\r\nHost: gateway\r\n{lines}\r\n"));
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    let text = String::from_utf8(bytes).expect("text");
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or_default();
    let code = head.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or_default();
    (code, head.to_owned(), body.to_owned())
}

pub fn get(address: SocketAddr, path: &str) -> (u16, String) {
    let (code, _, body) = ask(address, "GET", path);
    (code, body)
}

/// Asks again until an answer is as wanted.
pub fn until(address: SocketAddr, path: &str, wanted: impl Fn(u16, &str) -> bool) -> String {
    let end = Instant::now() + PATIENCE;
    loop {
        let (code, body) = get(address, path);
        if wanted(code, &body) {
            return body;
        }
        assert!(Instant::now() < end, "{path}: {code} {body}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The stream of a viewer.
struct Events {
    stream: TcpStream,
    /// What was read and not looked at yet.
    rest: String,
}

impl Events {
    fn open(address: SocketAddr) -> Self {
        let stream = connect(address, "GET /events HTTP/1.1\r\nHost: gateway\r\n\r\n");
        Self { stream, rest: String::new() }
    }

    /// The next event; `None` at the end of the stream.
    fn next(&mut self) -> Option<Value> {
        let mut buffer = [0; 8192];
        loop {
            if let Some((event, rest)) = self.rest.split_once("\n\n") {
                let (event, rest) = (event.to_owned(), rest.to_owned());
                self.rest = rest;
                let (_, data) = event.split_once("event: status\ndata: ").expect("an event with data");
                return Some(serde_json::from_str(data).expect("JSON"));
            }
            match self.stream.read(&mut buffer) {
                Ok(0) | Err(_) => return None,
                Ok(count) => self.rest.push_str(std::str::from_utf8(&buffer[..count]).expect("ASCII")),
            }
        }
    }
}

/// What `axisbridge status --json` prints.
fn status_of_the_command_line(gateway: &Gateway) -> Value {
    let mut command = Command::new(axisbridge());
    command.args(["status", "--json", "--local"]).arg(&gateway.socket).stdin(Stdio::null());
    let output = command.output().expect("the command can be started");
    serde_json::from_slice(&output.stdout).expect("one object")
}

/// Fields of an object and of the objects in it, without their values.
fn shape(value: &Value) -> Value {
    match value {
        Value::Object(fields) => fields.iter().map(|(key, value)| (key.clone(), shape(value))).collect(),
        Value::Array(items) => items.iter().map(shape).collect(),
        _ => Value::Null,
    }
}

/// Another maker's validator accepts the answers as what the description says.
fn described(description: &Value, answers: &[(&str, &Value)]) {
    let Some(python) = peer::python_or_skip("HTTP answers", "jsonschema") else { return };
    for (name, answer) in answers {
        let mut schema = json!({ "$ref": format!("#/components/schemas/{name}") });
        schema["components"] = description["components"].clone();
        let mut wrong: Value = (*answer).clone();
        wrong.as_object_mut().expect("an object").remove("status");
        for required in ["axes", "faults", "events"] {
            wrong.as_object_mut().expect("an object").remove(required);
        }
        let (at, documents) =
            (path(&format!("http-{name}.json")), path(&format!("http-{name}-answers.json")));
        std::fs::write(&at, schema.to_string()).expect("the folder of the tests");
        std::fs::write(&documents, json!([answer, wrong]).to_string()).expect("the folder of the tests");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/json_schema.py");
        let mut command = Command::new(&python);
        let output =
            command.arg(script).arg("--documents").args([at, documents]).output().expect("python starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let verdicts: Vec<Option<String>> = serde_json::from_slice(&output.stdout).expect("a list");
        assert!(verdicts[0].is_none() && verdicts[1].is_some(), "{name}: {verdicts:?}");
    }
}

#[test]
fn fault_of_a_drive_has_one_name_in_status_metrics_and_page_stream() {
    in_real_time("fault_of_a_drive_has_one_name_in_status_metrics_and_page_stream", || {
        let mut gateway = Gateway::with("http-fault", &configuration("127.0.0.88"));
        let address = address(&gateway);
        let mut client = gateway.connect();
        assert_eq!(until(address, "/readyz", |code, _| code == 200), "ready\n");
        assert_eq!(get(address, "/healthz"), (200, "alive\n".to_owned()));

        let (_, description) = get(address, "/api/v1/openapi.json");
        let description: Value = serde_json::from_str(&description).expect("JSON");
        let paths: Vec<&String> = description["paths"].as_object().expect("paths").keys().collect();
        for path in &paths {
            let needed = match path.as_str() {
                "/api/v1/traces" | "/api/v1/axis" | "/api/v1/parameters" => "?axis=slide",
                "/api/v1/parameter" => "?axis=slide&id=S-0-0104",
                "/api/v1/eds" => "?device=front",
                _ => "",
            };
            // Which contact has to be said.
            let expected = match path.as_str() {
                "/contact.pcapng" => 400,
                "/api/v1/control" => 403,
                _ => 200,
            };
            assert_eq!(ask(address, "HEAD", &format!("{path}{needed}")).0, expected, "{path}");
            // There is no token.
            let refused = if *path == "/api/v1/session" { 403 } else { 405 };
            assert_eq!(ask(address, "POST", path).0, refused, "{path}");
        }
        assert!(paths.len() > 8, "{paths:?}");
        assert_eq!(get(address, "/nothing").0, 404);
        let (_, page) = get(address, "/");
        assert!(page.contains("<h2 id=\"axes-title\">Axes</h2>"), "{page}");
        assert!(!page.contains("http://") && !page.contains("https://"), "nothing from elsewhere: {page}");

        let mut events = Events::open(address);
        let first = events.next().expect("the state at the beginning");
        assert_eq!(
            (&first["health"]["ready"], &first["status"]["axes"][0]["fault"]),
            (&true.into(), &Value::Null)
        );

        // A window that the drive leaves as soon as it moves.
        let reply = client.ask("write turntable S-0-0159 0.0001");
        assert!(reply.starts_with("ok write turntable "), "{reply}");
        client.until("enable turntable", "ok enable turntable state=operating ");
        let reply = client.ask("jog turntable 5 acceleration=100");
        assert!(reply.contains(" jog turntable "), "{reply}");
        let faulted = |look: &Value| look["status"]["axes"][0]["fault"] == FAULT;
        let look = std::iter::from_fn(|| events.next()).find(faulted).expect("an event with the fault");
        let missing = until(address, "/readyz", |code, _| code == 503);
        assert_eq!(missing, format!("axis turntable: fault {FAULT}\n"));
        until(address, "/metrics", |_, text| {
            text.contains(&format!("\naxisbridge_axis_fault{{axis=\"turntable\",fault=\"{FAULT}\"}} 1.0\n"))
                && text.contains("\naxisbridge_axis_faulted{axis=\"slide\"} 0.0\n")
        });
        let status: Value = serde_json::from_str(&get(address, "/api/v1/status").1).expect("JSON");
        let turntable = &status["axes"][0];
        assert_eq!(turntable["fault"], FAULT);
        let ours = status_of_the_command_line(&gateway);
        assert_eq!((shape(&ours), &ours["axes"][0]["advice"]), (shape(&status), &turntable["advice"]));
        assert_eq!(
            (&ours["axes"][0]["fault"], &ours["version"]),
            (&turntable["fault"], &env!("CARGO_PKG_VERSION").into())
        );
        let reply = client.ask("status turntable");
        assert!(
            reply.contains(&format!(" fault={FAULT}")) && value(&reply, "position=").abs() < 1.0,
            "{reply}"
        );
        let (_, list) = get(address, "/api/v1/faults?axis=turntable");
        let list: Value = serde_json::from_str(&list).expect("JSON");
        let causes: Vec<&Value> =
            list["faults"].as_array().expect("a list").iter().map(|fault| &fault["cause"]).collect();
        assert!(causes.contains(&&FAULT.into()), "{list}");
        let (_, lines) = get(address, "/api/v1/log?axis=turntable&level=warn");
        let lines: Value = serde_json::from_str(&lines).expect("JSON");
        let texts: Vec<&str> = lines["events"]
            .as_array()
            .expect("a list")
            .iter()
            .filter_map(|event| event["text"].as_str())
            .collect();
        assert!(texts.iter().any(|text| text.starts_with(FAULT)), "{texts:?}");
        described(
            &description,
            &[("Overview", &status), ("Look", &look), ("FaultList", &list), ("LogLines", &lines)],
        );

        // The stream ends with the gateway.
        let ended = gateway.run.terminate(Duration::from_secs(30));
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
        assert_eq!(std::iter::from_fn(|| events.next()).find(|look| !faulted(look)), None);
        assert!(TcpStream::connect(address).is_err(), "nobody listens any more");
    });
}

#[test]
fn two_hundred_connections_leave_the_gateway_working() {
    alone_in_real_time("two_hundred_connections_leave_the_gateway_working", || {
        let mut gateway = Gateway::with("http-flood", &configuration("127.0.0.89"));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        let half = |number: usize| match number % 4 {
            0 => "GET /healthz HTTP/1.1\r\nHost",
            1 => "",
            2 => "GET /events HTTP/1.1\r\nHost: gateway\r\n\r\n",
            _ => "POST / HTTP/1.1\r\nHost: gateway\r\nContent-Length: 1000000000\r\n\r\nxxxx",
        };
        let held: Vec<TcpStream> = (0..200).map(|number| connect(address, half(number))).collect();
        let oversized = "x".repeat(100_000);
        drop(connect(address, &format!("GET /{oversized} HTTP/1.1\r\n\r\n")));
        // Half-open connections end by themselves, and pages leave half of the places free.
        let cycles = |text: &str| {
            let line = text
                .lines()
                .find_map(|line| line.strip_prefix("axisbridge_bus_cycles_total{bus=\"SERCOS\"} "));
            line.and_then(|count| count.parse::<u64>().ok()).expect("cycles")
        };
        let first = cycles(&until(address, "/metrics", |code, _| code == 200));
        let text = until(address, "/metrics", |code, text| code == 200 && cycles(text) > first + 100);
        let refused =
            text.lines().find_map(|line| line.strip_prefix("axisbridge_http_refused_connections_total "));
        assert!(
            refused.is_some_and(|count| count.parse::<u32>().is_ok_and(|count| count > 100)),
            "{refused:?}"
        );
        assert_eq!(get(address, "/readyz"), (200, "ready\n".to_owned()));
        let lines = gateway.log().matches("HTTP connection refused: this host has 12 open").count();
        assert!((1..20).contains(&lines), "{lines} lines: {}", gateway.log());
        drop(held);
        let ended = gateway.run.terminate(Duration::from_secs(30));
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}
