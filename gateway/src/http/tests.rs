//! The server on a socket: what each path answers, and what peers that misbehave get.

use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::server::HttpServer;
use super::view::tests::{installation, view};
use super::{RunningServer, openapi};
use crate::latest::Publisher;
use crate::local::overview::Overview;
use crate::status::BoxStatus;
use crate::status::tests::distinct;
use crate::time::status::tests::synchronized;

/// How long an answer may take on a busy machine.
pub(super) const PATIENCE: Duration = Duration::from_secs(20);

/// A server and the end where another status can be published.
pub(super) struct Bench {
    pub address: SocketAddr,
    publisher: Publisher<BoxStatus>,
    server: RunningServer,
}

/// An answer: status code, head and body.
pub(super) struct Answer {
    pub code: u16,
    pub head: String,
    pub body: String,
}

impl Bench {
    fn start() -> Self {
        Self::with(64, |_| {})
    }

    fn with(connections_max: u16, change: impl FnOnce(&mut HttpServer)) -> Self {
        Self::of(connections_max, |mut server| {
            change(&mut server);
            server
        })
    }

    /// A server that is made of a usual one.
    pub fn of(connections_max: u16, make: impl FnOnce(HttpServer) -> HttpServer) -> Self {
        let (view, publisher) = view();
        let server = HttpServer::bind((Ipv4Addr::LOCALHOST, 0).into(), connections_max).unwrap();
        let server = make(server);
        let address = server.local_address().unwrap();
        Self { address, publisher, server: server.start(view).unwrap() }
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Sends these bytes and returns everything that comes back.
    pub fn send(&self, bytes: &[u8]) -> String {
        let mut stream = self.connect();
        // A server that has seen enough closes the connection before the end.
        let _ = stream.write_all(bytes);
        let mut text = Vec::new();
        let _ = stream.read_to_end(&mut text);
        String::from_utf8(text).unwrap()
    }

    fn ask(&self, method: &str, path: &str) -> Answer {
        self.ask_with(method, path, "")
    }

    /// Asks with more header lines.
    pub fn ask_with(&self, method: &str, path: &str, lines: &str) -> Answer {
        let text = self.send(format!("{method} {path} HTTP/1.1\r\nHost: gateway\r\n{lines}\r\n").as_bytes());
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("{path}: {text:?}"));
        let code = head.split(' ').nth(1).unwrap().parse().unwrap();
        Answer { code, head: head.to_ascii_lowercase(), body: body.to_owned() }
    }

    fn get(&self, path: &str) -> Answer {
        self.ask("GET", path)
    }

    /// A status in which nothing is wrong.
    fn publish_good(&mut self) {
        let mut status = distinct();
        status.buses[1].up = true;
        status.axes[1] = status.axes[0];
        self.publisher.publish(&status);
    }
}

/// Reads until the text contains `wanted`.
fn read_until(stream: &mut TcpStream, wanted: &str) -> String {
    let end = Instant::now() + PATIENCE;
    let mut text = String::new();
    let mut buffer = [0; 4096];
    while !text.contains(wanted) {
        assert!(Instant::now() < end, "{text}");
        let count = stream.read(&mut buffer).unwrap();
        assert!(count > 0, "the stream has ended: {text}");
        text.push_str(std::str::from_utf8(&buffer[..count]).unwrap());
    }
    text
}

#[test]
fn status_is_the_object_of_the_command_line() {
    let bench = Bench::start();
    let answer = bench.get("/api/v1/status");
    assert!(answer.code == 200 && answer.head.contains("content-type: application/json"), "{}", answer.head);
    let expected = Overview::of(&installation(), &distinct(), &synchronized());
    assert_eq!(answer.body, serde_json::to_string(&expected).unwrap());
}

#[test]
fn histories_are_answered_by_axis_level_and_number() {
    let bench = Bench::start();
    let json = |path: &str| -> Value {
        let answer = bench.get(path);
        assert!(
            answer.code == 200 && answer.head.contains("content-type: application/json"),
            "{}",
            answer.head
        );
        serde_json::from_str(&answer.body).unwrap()
    };
    let faults = json("/api/v1/faults?axis=slide");
    assert_eq!(
        (&faults["faults"][0]["cause"], &faults["faults"][0]["axis"]),
        (&"over_current".into(), &"slide".into())
    );
    assert_eq!(json("/api/v1/faults?axis=turntable")["faults"], Value::Array(Vec::new()));
    assert_eq!(json("/api/v1/faults"), faults);
    let texts = |path: &str| -> Vec<String> {
        let events = json(path)["events"].as_array().unwrap().clone();
        events.iter().map(|event| event["text"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(texts("/api/v1/log"), ["a line of info", "a line of warn"]);
    assert_eq!(texts("/api/v1/log?level=warn&lines=5"), ["a line of warn"]);
    assert_eq!(texts("/api/v1/log?after=2"), [""; 0]);
    for (path, why) in [
        ("/api/v1/log?lines=0", "unexpected `lines=0`: expected lines=1 to lines=1000\n"),
        ("/api/v1/log?after=-1", "`-1` is not a whole number of 64 bits\n"),
        (
            "/api/v1/log?level=loud",
            "unexpected `level=loud`: expected level=error, warn, info, debug or trace\n",
        ),
        ("/api/v1/faults?axis=lathe", "unknown axis `lathe`: expected turntable, slide\n"),
        ("/api/v1/faults?lines=1", "unexpected `lines=1`: expected axis=AXIS\n"),
    ] {
        let answer = bench.get(path);
        assert_eq!((answer.code, answer.body.as_str()), (400, why), "{path}");
    }
}

#[test]
fn traces_are_answered_by_axis_and_number() {
    let mut bench = Bench::start();
    let json = |bench: &Bench, path: &str| -> Value {
        let answer = bench.get(path);
        assert_eq!(answer.code, 200, "{path}: {}", answer.body);
        serde_json::from_str(&answer.body).unwrap()
    };
    // The server samples by itself.
    let end = Instant::now() + PATIENCE;
    while json(&bench, "/api/v1/traces?axis=slide")["next"] == 0 {
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut later = distinct();
    later.uptime.0 += 1_500_000_000;
    later.axes[0].position.0 = 7_500_000_000;
    bench.publisher.publish(&later);
    let fresh = loop {
        let fresh = json(&bench, "/api/v1/traces?axis=turntable&after=1");
        if fresh["next"] == 2 {
            break fresh;
        }
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!((&fresh["axis"], &fresh["unit"]), (&"turntable".into(), &"rev".into()));
    assert_eq!(fresh["position"], serde_json::json!([7.5]));
    for (key, value) in [("uptime_s", 989.154_321_012), ("position_command", -1_234.567_890_046)] {
        assert!((fresh[key][0].as_f64().unwrap() - value).abs() < 1e-9, "{fresh}");
    }
    let time = json(&bench, "/api/v1/time");
    assert_eq!(
        (&time["next"], &time["buses"][1]["phase_error_ns"]),
        (&2.into(), &serde_json::json!([456, 456]))
    );
    assert_eq!(json(&bench, "/api/v1/time?after=2")["uptime_s"], serde_json::json!([]));
    for (path, why) in [
        ("/api/v1/traces", "`traces` needs the name of an axis\n"),
        ("/api/v1/traces?axis=lathe", "unknown axis `lathe`: expected turntable, slide\n"),
        ("/api/v1/traces?axis=slide&lines=1", "unexpected `lines=1`: expected axis=AXIS or after=N\n"),
        ("/api/v1/traces?axis=slide&after=x", "`x` is not a whole number of 64 bits\n"),
        ("/api/v1/time?axis=slide", "unexpected `axis=slide`: expected after=N\n"),
        ("/api/v1/axis", "`axis` needs the name of an axis\n"),
        ("/api/v1/axis?name=slide", "unexpected `name=slide`: expected axis=AXIS\n"),
        ("/api/v1/eds?device=side", "unexpected `device=side`: expected device= and one of front, back\n"),
    ] {
        let answer = bench.get(path);
        assert_eq!((answer.code, answer.body.as_str()), (400, why), "{path}");
    }
}

#[test]
fn files_are_downloaded_under_their_names() {
    let bench = Bench::start();
    for (path, name, body) in [
        ("/api/v1/eds?device=back", "back.eds", "$ sheet of back\n"),
        ("/api/v1/configuration", "axisbridge.toml", "[box]\nname = \"cell 4\"\n"),
    ] {
        let answer = bench.get(path);
        assert_eq!((answer.code, answer.body.as_str()), (200, body), "{path}");
        let disposition = format!("content-disposition: attachment; filename=\"{name}\"");
        assert!(answer.head.contains(&disposition), "{}", answer.head);
    }
    let sheet: Value = serde_json::from_str(&bench.get("/api/v1/axis?axis=slide").body).unwrap();
    assert_eq!((&sheet["limits"]["position_max"], &sheet["limits"]["torque"]), (&805.0.into(), &Value::Null));
}

#[test]
fn health_and_readiness_are_answered_with_reasons() {
    let mut bench = Bench::start();
    let answer = bench.get("/healthz");
    assert_eq!((answer.code, answer.body.as_str()), (200, "alive\n"));
    let answer = bench.get("/readyz");
    let missing = "bus CAN bus 1: not in cyclic operation\naxis slide: fault safety_core\n";
    assert_eq!((answer.code, answer.body.as_str()), (503, missing));
    bench.publish_good();
    let answer = bench.get("/readyz");
    assert_eq!((answer.code, answer.body.as_str()), (200, "ready\n"));
    // The cycle thread publishes nothing any more.
    let end = Instant::now() + PATIENCE;
    loop {
        let answer = bench.get("/healthz");
        if answer.code == 503 {
            assert!(
                answer.body.starts_with("the cycle thread has published nothing for "),
                "{}",
                answer.body
            );
            break;
        }
        assert!(Instant::now() < end, "{}", answer.body);
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(bench.get("/readyz").code, 503);
}

#[test]
fn metrics_are_open_metrics() {
    let bench = Bench::start();
    let answer = bench.get("/metrics");
    let kind = "content-type: application/openmetrics-text; version=1.0.0; charset=utf-8";
    assert!(answer.code == 200 && answer.head.contains(kind), "{}", answer.head);
    assert!(answer.body.contains("\naxisbridge_axis_fault{axis=\"slide\",fault=\"safety_core\"} 1"));
    assert!(
        answer.body.contains("\naxisbridge_axis_position_revolutions{axis=\"turntable\"} -1234.567890123\n")
    );
    assert!(answer.body.ends_with("# EOF\n"));
}

#[test]
fn every_path_of_the_description_is_answered_and_no_other() {
    let bench = Bench::start();
    let answer = bench.get("/api/v1/openapi.json");
    let description: Value = serde_json::from_str(&answer.body).unwrap();
    assert_eq!(description, openapi());
    let paths: Vec<&String> = description["paths"].as_object().unwrap().keys().collect();
    assert_eq!(paths.len(), 24);
    for path in paths {
        let needed = match path.as_str() {
            "/api/v1/traces" | "/api/v1/axis" | "/api/v1/parameters" => "?axis=slide",
            "/api/v1/parameter" => "?axis=slide&id=S-0-0104",
            "/api/v1/eds" => "?device=back",
            _ => "",
        };
        // A stream has no end: its head is enough.
        let answer = bench.ask("HEAD", &format!("{path}{needed}"));
        let good = &description["paths"][path]["get"]["responses"][answer.code.to_string()];
        let kind = good["content"].as_object().and_then(|content| content.keys().next()).expect(path);
        assert!(answer.head.contains(&format!("content-type: {kind}")), "{path}: {}", answer.head);
        assert_eq!(answer.body, "", "{path}: a head has no body");
        for part in
            ["content-security-policy: default-src 'none'; script-src 'self'", "cache-control: no-store"]
        {
            assert!(answer.head.contains(part), "{path}: {}", answer.head);
        }
        let own = description["paths"][path].as_object().unwrap();
        for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"] {
            let answer = bench.ask(method, path);
            if own.contains_key(&method.to_ascii_lowercase()) {
                // There is no token.
                assert_eq!(answer.code, 403, "{method} {path}");
                continue;
            }
            assert_eq!(answer.code, 405, "{method} {path}");
            assert!(answer.head.contains("allow: get,head"), "{}", answer.head);
        }
    }
    for path in ["/index.html", "/api", "/api/v1/status/", "/../etc/passwd", "/metrics/x", "//"] {
        assert_eq!(bench.get(path).code, 404, "{path}");
    }
}

#[test]
fn stream_begins_with_the_state_and_follows_it() {
    let mut bench = Bench::start();
    let mut stream = bench.connect();
    stream.write_all(b"GET /events HTTP/1.1\r\nHost: gateway\r\nAccept: text/event-stream\r\n\r\n").unwrap();
    let first = read_until(&mut stream, "\"fault\":\"safety_core\"");
    assert!(first.contains("content-type: text/event-stream"), "{first}");
    assert!(first.contains("retry: 2000\nevent: status\ndata: {\"health\":{\"alive\":true,"), "{first}");
    bench.publish_good();
    read_until(&mut stream, "\"ready\":true");
    // The stream ends with the server.
    drop(bench.server);
    let mut rest = Vec::new();
    let _ = stream.read_to_end(&mut rest);
}

#[test]
fn viewers_leave_room_for_other_requests() {
    let bench = Bench::with(8, |_| {});
    let viewer = || {
        let mut stream = bench.connect();
        stream.write_all(b"GET /events HTTP/1.1\r\nHost: gateway\r\n\r\n").unwrap();
        read_until(&mut stream, "\r\n\r\n");
        stream
    };
    let mut viewers: Vec<_> = (0..4).map(|_| viewer()).collect();
    let answer = bench.get("/events");
    assert_eq!((answer.code, answer.body.as_str()), (503, "too many viewers\n"));
    assert_eq!(bench.get("/healthz").code, 200);
    // The place of a viewer who has gone becomes free.
    viewers.pop();
    let end = Instant::now() + PATIENCE;
    loop {
        let mut stream = bench.connect();
        stream.write_all(b"GET /events HTTP/1.1\r\nHost: gateway\r\n\r\n").unwrap();
        if read_until(&mut stream, "\r\n").starts_with("HTTP/1.1 200") {
            break;
        }
        assert!(Instant::now() < end, "the place stays taken");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn oversized_and_malformed_requests_are_refused() {
    let bench = Bench::start();
    let long = format!("GET /{} HTTP/1.1\r\nHost: gateway\r\n\r\n", "x".repeat(20_000));
    let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(65));
    for bytes in [long, many, format!("GET / HTTP/1.1\r\nA: {}\r\n\r\n", "b".repeat(20_000))] {
        let answer = bench.send(bytes.as_bytes());
        // The rest of what was sent may reset the connection before the answer is read.
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 431"), "{answer}");
    }
    for bytes in [&b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"[..], b"hello\r\n\r\n", b"\0\0\0\0\r\n\r\n"]
    {
        let answer = bench.send(bytes);
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 400"), "{answer}");
    }
    // A body is never read.
    let head = "GET /healthz HTTP/1.1\r\nHost: gateway\r\nContent-Length: 1000000000000\r\n\r\n";
    assert!(bench.send(head.as_bytes()).starts_with("HTTP/1.1 200"), "answered before the body");
    assert_eq!(bench.get("/healthz").code, 200);
}

#[test]
fn half_open_connections_end_and_more_than_the_limit_are_closed() {
    let time_out = Duration::from_millis(1_500);
    let bench = Bench::with(16, |server| server.limit_times(time_out, time_out));
    let began = Instant::now();
    let mut silent: Vec<TcpStream> = (0..200).map(|_| bench.connect()).collect();
    for (number, stream) in silent.iter_mut().enumerate() {
        // The first ones send half a head, the others nothing.
        if number % 2 == 0 {
            let _ = stream.write_all(b"GET /healthz HTTP/1.1\r\nHo");
        }
    }
    for mut stream in silent {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
        assert!(rest.is_empty() || rest.starts_with(b"HTTP/1.1 408"), "{rest:?}");
    }
    assert!(began.elapsed() < PATIENCE, "{:?}", began.elapsed());
    let answer = bench.get("/metrics");
    let refused = answer.body.lines().find_map(|line| {
        line.strip_prefix("axisbridge_http_refused_connections_total ")?.parse::<u32>().ok()
    });
    assert!(refused.is_some_and(|refused| (1..=188).contains(&refused)), "{refused:?}");
}

#[test]
fn peer_that_has_finished_sending_is_no_error() {
    let bench = Bench::start();
    let mut stream = bench.connect();
    stream.write_all(b"GET /healthz HTTP/1.0\r\n\r\n").unwrap();
    let text = read_until(&mut stream, "alive\n");
    assert!(text.starts_with("HTTP/1.0 200"), "{text}");
    let _ = stream.shutdown(Shutdown::Write);
}
