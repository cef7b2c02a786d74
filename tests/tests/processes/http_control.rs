//! Control over HTTP with the gateway as a user runs it: the token, TLS, what moves, and everything that stops it.

use std::fs;
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::process::{Running, axisbridge};
use serde_json::Value;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

use super::http::{address, address_of, ask, ask_with, configuration, get, until};
use super::local::{Gateway, path, value};

const PATIENCE: Duration = Duration::from_secs(30);

/// An axis is at rest below this speed, rev/s.
const REST: f64 = 0.05;

/// A certificate of the tests.
fn certificate(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("certificates").join(name)
}

/// Makes a token as a user does: the token, and the file with its hash.
pub fn token(name: &str) -> (String, PathBuf) {
    let file = path(&format!("{name}.token"));
    let output = Command::new(axisbridge())
        .args(["token", "--replace", "--output"])
        .arg(&file)
        .stdin(Stdio::null())
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{output:?}");
    assert_eq!(fs::metadata(&file).expect("it is written").permissions().mode() & 0o777, 0o600);
    let token = String::from_utf8(output.stdout).expect("text").trim_end().to_owned();
    assert!(token.len() == 40 && !fs::read_to_string(&file).expect("text").contains(&token), "{token}");
    (token, file)
}

/// Keys of `[http]` for TLS and this token.
fn tls_keys(token: &Path, key: &Path) -> String {
    let (token, good, key) = (token.display(), certificate("test-certificate.pem"), key.display());
    format!("token = \"{token}\"\ncertificate = \"{}\"\nkey = \"{key}\"", good.display())
}

/// The configuration with more keys of `[http]`.
fn with_keys(device: &str, keys: &str) -> String {
    configuration(device).replacen("[http]\n", &format!("[http]\n{keys}\n"), 1)
}

/// The first axis as the gateway reads its drive.
fn turntable(address: SocketAddr) -> Value {
    let status: Value = serde_json::from_str(&get(address, "/api/v1/status").1).expect("JSON");
    status["axes"][0].clone()
}

fn speed(axis: &Value) -> f64 {
    axis["velocity"].as_f64().expect("a number").abs()
}

/// Waits until the axis is at rest without torque and without an owner: how long it took.
fn let_go(address: SocketAddr) -> Duration {
    let began = Instant::now();
    loop {
        let axis = turntable(address);
        if axis["owner"] == "nobody" && axis["state"] == "inhibited" && speed(&axis) < REST {
            return began.elapsed();
        }
        assert!(began.elapsed() < PATIENCE, "{axis}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The key of a session.
fn log_in(address: SocketAddr, token: &str) -> String {
    let (code, _, body) =
        ask_with(address, "POST", "/api/v1/session", &format!("Authorization: Bearer {token}\r\n"));
    assert_eq!(code, 200, "{body}");
    let opened: Value = serde_json::from_str(&body).expect("JSON");
    opened["session"].as_str().expect("a key").to_owned()
}

/// A control stream, which is lost as soon as nobody reads and answers its beats.
struct Stream {
    socket: WebSocket<TcpStream>,
    beat: u64,
}

impl Stream {
    fn open(address: SocketAddr, key: &str) -> Self {
        let mut request = format!("ws://{address}/api/v1/control").into_client_request().expect("an address");
        request.headers_mut().insert("authorization", format!("Bearer {key}").parse().expect("a value"));
        let stream = TcpStream::connect(address).expect("the gateway listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let (socket, _) = tungstenite::client(request, stream).expect("a stream");
        Self { socket, beat: 0 }
    }

    /// The next message: a reply, or nothing after a beat.
    fn next(&mut self) -> Option<String> {
        let message = self.socket.read().expect("a message");
        let text = message.into_text().expect("text");
        match text.strip_prefix("beat ") {
            Some(number) => {
                self.beat = number.parse().expect("a number");
                None
            }
            None => Some(text.to_string()),
        }
    }

    fn say(&mut self, line: &str) {
        self.socket.send(Message::text(format!("{} {line}", self.beat))).expect("a connection");
    }

    /// Sends a request and answers beats until its reply is there.
    fn ask(&mut self, line: &str) -> String {
        while self.beat == 0 {
            assert_eq!(self.next(), None);
        }
        self.say(line);
        let word = line.split(' ').next().expect("a word");
        let end = Instant::now() + PATIENCE;
        loop {
            assert!(Instant::now() < end, "{line} has no reply");
            match self.next() {
                None => self.say("axes"),
                Some(reply) if reply.split(' ').nth(1) == Some(word) => return reply,
                Some(_) => {}
            }
        }
    }

    /// The same until the reply begins so.
    fn until(&mut self, line: &str, beginning: &str) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            let reply = self.ask(line);
            if reply.starts_with(beginning) {
                return reply;
            }
            assert!(Instant::now() < end, "{line} gives {reply}");
        }
    }

    /// Answers each beat for a time with this line, and returns the last reply to it.
    fn go_on(&mut self, line: &str, time: Duration) -> String {
        let (end, mut last) = (Instant::now() + time, String::new());
        while Instant::now() < end {
            match self.next() {
                None => self.say(line),
                Some(reply) if !reply.starts_with("axis ") => last = reply,
                Some(_) => {}
            }
        }
        last
    }

    /// Lets the axis turn by jogs: its speed.
    fn turn(&mut self) -> f64 {
        self.until("enable turntable", "ok enable turntable state=operating owner=local ");
        let reply = self.go_on("jog turntable 2 acceleration=50", Duration::from_millis(600));
        assert!(reply.starts_with("ok jog turntable "), "{reply}");
        value(&reply, "velocity=")
    }
}

#[test]
fn axis_moves_with_the_token_and_stands_without_it() {
    in_real_time("axis_moves_with_the_token_and_stands_without_it", || {
        let (token, file) = token("http-control");
        let keys = format!("token = \"{}\"", file.display());
        let mut gateway = Gateway::with("http-control", &with_keys("127.0.2.97", &keys));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);

        let wrong = "Authorization: Bearer 0123456789abcdef0123\r\n";
        for lines in ["", wrong] {
            assert_eq!(ask_with(address, "POST", "/api/v1/session", lines).0, 401, "{lines}");
        }
        let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        assert_eq!(ask_with(address, "GET", "/api/v1/control", upgrade).0, 401);
        let with_token = format!("{upgrade}Authorization: Bearer {token}\r\n");
        assert_eq!(ask_with(address, "GET", "/api/v1/control", &with_token).0, 401, "the token is no key");
        let foreign = format!("Authorization: Bearer {token}\r\nOrigin: http://evil.example\r\n");
        assert_eq!(ask_with(address, "POST", "/api/v1/session", &foreign).0, 403);
        let axis = turntable(address);
        assert_eq!((&axis["state"], &axis["owner"]), (&"inhibited".into(), &"nobody".into()));

        let key = log_in(address, &token);
        let mut stream = Stream::open(address, &key);
        stream.until("enable turntable", "ok enable turntable state=operating owner=local ");
        let reply = stream.ask("move turntable 0.75 velocity=1 acceleration=5");
        assert!((value(&reply, "position=") - 0.75).abs() < 0.002, "{reply}");
        let at = turntable(address)["position"].as_f64().expect("a number");
        assert!((at - 0.75).abs() < 0.002, "{at}");
        // A client on the socket cannot have the axis meanwhile.
        let reply = gateway.connect().ask("jog turntable 1");
        assert!(reply.starts_with("error jog turntable held: "), "{reply}");

        // Without another jog the axis brakes, although the beats go on.
        let fast = stream.turn();
        assert!((fast - 2.0).abs() < 0.2, "{fast}");
        let reply = stream.go_on("status turntable", Duration::from_millis(450));
        assert!(value(&reply, "velocity=").abs() < REST, "{reply}");
        assert!(reply.contains(" state=operating owner=local "), "with torque: {reply}");
        let reply = stream.ask("disable turntable");
        assert!(reply.starts_with("ok disable turntable state=inhibited owner=nobody "), "{reply}");

        let log = gateway.log();
        for line in [
            "HTTP control refused: the token is wrong from=127.0.0.1:",
            "HTTP control: session opened with the token from=127.0.0.1:",
            "local control: enable axis=\"turntable\"",
            "local control: move axis=\"turntable\"",
            "local control: jog axis=\"turntable\"",
        ] {
            assert!(log.contains(line), "no {line:?} in {log}");
        }
        // One of the stream, and that of the socket.
        assert_eq!(log.matches("local control: jog ").count(), 2, "a jog that goes on is one order: {log}");
        let (_, history) = get(address, "/api/v1/log?axis=turntable");
        assert!(
            history.contains("local control: enable client=") && history.contains("from=127.0.0.1:"),
            "{history}"
        );
        assert!(!log.contains(&token) && !log.contains(&key), "neither token nor key is in the log");
        drop(stream);
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}

#[test]
fn axis_stops_however_control_is_lost() {
    in_real_time("axis_stops_however_control_is_lost", || {
        let (token, file) = token("http-lost");
        let keys = format!("token = \"{}\"", file.display());
        let mut gateway = Gateway::with("http-lost", &with_keys("127.0.2.98", &keys));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        let key = log_in(address, &token);

        // The connection is cut.
        let mut stream = Stream::open(address, &key);
        assert!(stream.turn() > 1.8);
        drop(stream);
        let took = let_go(address);
        assert!(took < Duration::from_millis(1_500), "{took:?}");

        // It is there, but nothing comes any more: a page that hangs, a cable that is pulled.
        let mut stream = Stream::open(address, &key);
        assert!(stream.turn() > 1.8);
        let began = Instant::now();
        while speed(&turntable(address)) > 1.0 {
            assert!(began.elapsed() < PATIENCE);
        }
        let braked = began.elapsed();
        assert!(braked < Duration::from_millis(450), "a jog lasts 200 ms: {braked:?}");
        let took = began.elapsed() + let_go(address);
        assert!(took < Duration::from_millis(2_000), "{took:?}");
        drop(stream);

        // A move ends in the same way.
        let mut stream = Stream::open(address, &key);
        stream.until("enable turntable", "ok enable turntable state=operating owner=local ");
        stream.say("move turntable 100000 velocity=2 acceleration=50");
        assert!(value(&stream.go_on("status turntable", Duration::from_millis(500)), "velocity=") > 1.8);
        let began = Instant::now();
        while speed(&turntable(address)) > 1.0 {
            assert!(began.elapsed() < PATIENCE);
        }
        let braked = began.elapsed();
        assert!(braked < Duration::from_millis(900), "control is lost after 500 ms: {braked:?}");
        let_go(address);
        drop(stream);

        // The session is given back, by another request.
        let mut stream = Stream::open(address, &key);
        assert!(stream.turn() > 1.8);
        let lines = format!("Authorization: Bearer {key}\r\n");
        assert_eq!(ask_with(address, "DELETE", "/api/v1/session", &lines).0, 204);
        let took = let_go(address);
        assert!(took < Duration::from_millis(1_500), "{took:?}");
        drop(stream);
        assert_eq!(ask_with(address, "DELETE", "/api/v1/session", &lines).0, 401, "it is no more");
        let log = gateway.log();
        for why in ["the connection has ended", "no beat of the client in time", "the session has ended"] {
            assert!(log.contains(&format!("why=\"{why}\"")), "no {why:?} in {log}");
        }
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}

#[test]
fn controller_comes_before_everybody_with_the_token() {
    in_real_time("controller_comes_before_everybody_with_the_token", || {
        let (token, file) = token("http-controller");
        let keys = format!("token = \"{}\"", file.display());
        let mut gateway = Gateway::with("http-controller", &with_keys("127.0.2.99", &keys));
        let address = address(&gateway);
        until(address, "/readyz", |code, _| code == 200);
        let mut stream = Stream::open(address, &log_in(address, &token));
        assert!(stream.turn() > 1.8);
        let mut command = Command::new(axisbridge());
        command.args([
            "simulate",
            "controller",
            "--target",
            "127.0.2.99",
            "--bind",
            "127.0.3.99",
            "--axes",
            "2",
        ]);
        let mut controller = Running::start(
            "controller",
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()),
        );
        let end = Instant::now() + PATIENCE;
        while turntable(address)["owner"] != "controller" {
            stream.go_on("jog turntable 2 acceleration=50", Duration::from_millis(120));
            assert!(Instant::now() < end, "{}", gateway.log());
        }
        for line in ["jog turntable 2", "enable turntable", "move turntable 1 velocity=1", "stop turntable"] {
            let reply = stream.ask(line);
            let word = line.split(' ').next().expect("a word");
            assert!(reply.starts_with(&format!("error {word} turntable controller: ")), "{reply}");
        }
        controller.terminate(PATIENCE);
        drop(stream);
        let ended = gateway.run.terminate(PATIENCE);
        assert!(ended.code().is_some(), "{}", gateway.log());
    });
}

#[test]
fn server_speaks_tls_to_clients_of_others() {
    in_real_time("server_speaks_tls_to_clients_of_others", || {
        let (token, file) = token("http-tls");
        let (good, key) = (certificate("test-certificate.pem"), certificate("test-key.pem"));
        let keys = |key: &Path| tls_keys(&file, key);
        let mut gateway = Gateway::with("http-tls", &with_keys("127.0.2.100", &keys(&key)));
        let address = address_of(&gateway, "HTTPS");
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        assert_eq!(ask(address, "GET", "/healthz").0, 0, "plain HTTP has no answer");
        let url = |path: &str| format!("https://localhost:{}{path}", address.port());
        if let Some(python) = peer::python_or_skip("TLS", "ssl") {
            let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/tls.py");
            let mut command = Command::new(python);
            command.arg(script).arg(&good).arg(address.port().to_string()).arg(&token).stdin(Stdio::null());
            let output = command.output().expect("python starts");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
            assert_eq!(report["health"], serde_json::json!([200, "alive\n"]), "{report}");
            assert_eq!(
                report["offer"],
                serde_json::json!({ "control": true, "encrypted": true }),
                "{report}"
            );
            assert_eq!((&report["session"], &report["key"]), (&200.into(), &64.into()), "{report}");
            assert_eq!(
                report["versions"],
                serde_json::json!({ "TLSv1.2": "TLSv1.2", "TLSv1.3": "TLSv1.3" }),
                "{report}"
            );
            assert_eq!(report["untrusted"], true, "{report}");
        }
        for (program, trust) in [("curl", "--cacert"), ("wget", "--ca-certificate")] {
            if !peer::has_program(program) {
                peer::skip("TLS", program);
                continue;
            }
            let quiet: &[&str] =
                if program == "curl" { &["-sS", "--noproxy", "*"] } else { &["-q", "--no-proxy", "-O", "-"] };
            let mut command = Command::new(program);
            let output =
                command.args(quiet).arg(trust).arg(&good).arg(url("/healthz")).output().expect("it starts");
            assert_eq!(String::from_utf8_lossy(&output.stdout), "alive\n", "{program}: {output:?}");
        }
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());

        // What is wrong is said at the start, and nothing runs.
        for (name, keys, text) in [
            ("http-other-key", keys(&certificate("other-key.pem")), "the private key cannot be used"),
            (
                "http-no-key",
                keys(Path::new("/none.pem")),
                "`key` of [http]: /none.pem: No such file or directory",
            ),
        ] {
            let mut refused = Gateway::with(name, &with_keys("127.0.2.100", &keys));
            let end = Instant::now() + PATIENCE;
            while refused.run.ended().is_none() {
                assert!(Instant::now() < end, "{}", refused.log());
                std::thread::sleep(Duration::from_millis(20));
            }
            assert!(refused.log().contains(text), "{}", refused.log());
        }
        let open = with_keys("127.0.2.100", &format!("token = \"{}\"", file.display()));
        let mut refused = Gateway::with("http-open", &open.replace("127.0.0.1:0", "0.0.0.0:0"));
        let end = Instant::now() + PATIENCE;
        while refused.run.ended().is_none() {
            assert!(Instant::now() < end, "{}", refused.log());
            std::thread::sleep(Duration::from_millis(20));
        }
        let text = "the token would cross the network to 0.0.0.0:0 without encryption";
        assert!(refused.log().contains(text), "{}", refused.log());
    });
}

#[test]
fn page_jogs_while_the_button_is_held_and_stops_when_it_closes() {
    let Some(chromium) = peer::chromium_or_skip("control in a browser") else { return };
    let Some(python) = peer::python_or_skip("control in a browser", "json") else { return };
    in_real_time("page_jogs_while_the_button_is_held_and_stops_when_it_closes", || {
        let (token, file) = token("http-page");
        let keys = tls_keys(&file, &certificate("test-key.pem"));
        let mut gateway = Gateway::with("http-page", &with_keys("127.0.2.101", &keys));
        let address = address_of(&gateway, "HTTPS");
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/page_control.py");
        let mut browser = Command::new(&python);
        browser
            .arg(script)
            .arg(&chromium)
            .arg(format!("https://localhost:{}/", address.port()))
            .arg(path("control-pictures"))
            .arg(&token)
            .arg(certificate("test-certificate.pem"))
            .arg(&gateway.socket);
        let output = browser.stdin(Stdio::null()).output().expect("python starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: Value = serde_json::from_slice(&output.stdout).expect("one object");
        // Only that the wrong token is refused is said on the console.
        let complaints = report["complaints"].as_array().expect("a list");
        assert!(
            complaints.len() == 1 && complaints[0].as_str().is_some_and(|text| text.contains("401")),
            "{complaints:?}"
        );
        assert_eq!(report["wrong"], "Not logged in: the token is wrong.");
        for way in ["mouse", "keys", "arrows", "blur", "stop"] {
            let seen = &report[way];
            let of = |key: &str| seen[key].as_f64().unwrap_or_else(|| panic!("{way}: {seen}"));
            assert!(of("fastest") > 0.9, "{way} moves: {seen}");
            assert!(of("rest_ms") < 1_500.0, "{way} stops: {seen}");
            // It stands, and goes on standing, also where the button is still down.
            assert!(of("later") < REST, "{way}: {seen}");
            assert_eq!(seen["state"], "operating", "{way}: {seen}");
        }
        assert!(report["turned"].as_f64().expect("a number") < 0.0, "Jog - turns backward: {report}");
        assert!((report["moved"].as_f64().expect("a number") - 0.25).abs() < 0.002, "{report}");
        assert_eq!(report["faint"], Value::Array(Vec::new()), "too little contrast");
        assert_eq!(report["wide"], false, "wider than the screen");
        assert_eq!(
            report["kept"],
            serde_json::json!(["operating", "local", true]),
            "control outlives a reconnection of the events"
        );
        // The stream of the page was open while another client took the axis, which kept its torque.
        assert!(
            report["other_has"].as_str().is_some_and(|reply| reply.starts_with("ok enable turntable ")),
            "{report}"
        );
        assert_eq!(report["state_of_other"], "operating");
        // Left by hiding it, by another view, and at last by closing the page while the button is held.
        assert_eq!(report["view"], "Control was given back: another view was opened.");
        assert!(
            report["closing"].as_f64().expect("a number") > 0.9,
            "it moves when the page closes: {report}"
        );
        // The page has been closed for 1.5 s.
        let reply = gateway.connect().ask("status turntable");
        assert!(reply.starts_with("ok status turntable state=inhibited owner=nobody "), "{reply}");
        assert!(value(&reply, "velocity=").abs() < REST, "{reply}");
        let ended = gateway.run.terminate(PATIENCE);
        assert_eq!(ended.code(), Some(0), "{}", gateway.log());
    });
}
