//! Control on a socket: who gets it, what reaches the engine, and what ends it.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
use serde_json::Value;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Error, Message, WebSocket};

use super::super::access::{SECRET, Token, hash};
use super::super::server::HttpServer;
use super::super::tests::{Bench, PATIENCE};
use super::super::tls;
use crate::engine::direct::{DirectAnswer, DirectFailure, DirectRequest, Direction};
use crate::engine::local::{Answer, Failure, Order, Request};
use crate::local::Hub;
use crate::local::server_tests::{queues, shared};

/// A server with control, and the engine's side of its queues.
struct Site {
    bench: Bench,
    requests: rtrb::Consumer<Request>,
    answers: rtrb::Producer<Answer>,
    direct: (rtrb::Consumer<DirectRequest>, rtrb::Producer<DirectAnswer>),
    /// Runs the hub.
    _runtime: tokio::runtime::Runtime,
}

impl Site {
    fn new() -> Self {
        Self::of(|server| server)
    }

    fn of(make: impl FnOnce(HttpServer) -> HttpServer) -> Self {
        let (ends, (requests, answers), direct) = queues();
        let (hub, door) = Hub::new(shared(), ends);
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.spawn(hub.run());
        let token = Token::parse(&hash(SECRET).unwrap()).unwrap();
        let bench = Bench::of(64, |server| make(server).control(token, door));
        Self { bench, requests, answers, direct, _runtime: runtime }
    }

    /// The key of a new session.
    fn log_in(&self) -> String {
        let lines = format!("Authorization: Bearer {SECRET}\r\n");
        let answer = self.bench.ask_with("POST", "/api/v1/session", &lines);
        assert_eq!(answer.code, 200, "{}", answer.body);
        let opened: Value = serde_json::from_str(&answer.body).unwrap();
        assert_eq!(opened["idle_s"], 900);
        opened["session"].as_str().unwrap().to_owned()
    }

    fn open(&self, key: &str) -> Stream {
        self.try_open(key, &[]).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Opens a stream with more header lines.
    fn try_open(&self, key: &str, more: &[(&'static str, &str)]) -> Result<Stream, Box<Error>> {
        let mut request =
            format!("ws://{}/api/v1/control", self.bench.address).into_client_request().unwrap();
        let protocols = format!("axisbridge.control, axisbridge.session.{key}");
        request.headers_mut().insert("sec-websocket-protocol", protocols.parse().unwrap());
        for (name, value) in more {
            request.headers_mut().insert(*name, value.parse().unwrap());
        }
        match tungstenite::client(request, self.bench.connect()) {
            Ok((socket, response)) => {
                assert_eq!(response.headers()["sec-websocket-protocol"], "axisbridge.control");
                Ok(Stream { socket, beat: 0 })
            }
            Err(tungstenite::HandshakeError::Failure(error)) => Err(Box::new(error)),
            Err(interrupted) => panic!("{interrupted}"),
        }
    }

    /// What reaches the engine next.
    fn request(&mut self) -> Request {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Ok(request) = self.requests.pop() {
                return request;
            }
            assert!(Instant::now() < end, "no request reaches the engine");
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Site {
    /// The access that reaches the engine next; its answer is given at once.
    fn answer_access(&mut self, result: Result<Option<Attribute>, DirectFailure>, bytes: &[u8]) -> Direction {
        let end = Instant::now() + PATIENCE;
        let DirectRequest { client, id, direction, mut data, .. } = loop {
            if let Ok(request) = self.direct.0.pop() {
                break request;
            }
            assert!(Instant::now() < end, "no access reaches the engine");
            std::thread::sleep(Duration::from_millis(1));
        };
        if direction == Direction::Read {
            data.extend_from_slice(bytes);
        } else {
            assert_eq!(data, bytes, "what is written");
        }
        self.direct.1.push(DirectAnswer { client, id, result, data }).unwrap();
        direction
    }
}

/// A control stream.
struct Stream {
    socket: WebSocket<TcpStream>,
    beat: u64,
}

impl Stream {
    /// The next reply. Beats are noted on the way.
    fn hear(&mut self) -> String {
        loop {
            match self.socket.read().unwrap() {
                Message::Text(text) => match text.strip_prefix("beat ") {
                    Some(number) => self.beat = number.parse().unwrap(),
                    None => return text.to_string(),
                },
                other => panic!("{other:?}"),
            }
        }
    }

    /// Waits for a beat.
    fn beat(&mut self) -> u64 {
        let last = self.beat;
        while self.beat == last {
            let message = self.socket.read().unwrap();
            let text = message.to_text().unwrap();
            self.beat = text.strip_prefix("beat ").unwrap_or_else(|| panic!("{text}")).parse().unwrap();
        }
        self.beat
    }

    /// Sends a request that answers this beat.
    fn say_at(&mut self, beat: u64, line: &str) {
        self.socket.send(Message::text(format!("{beat} {line}"))).unwrap();
    }

    fn say(&mut self, line: &str) {
        let beat = self.beat();
        self.say_at(beat, line);
    }

    /// Reads until the stream ends: the reason of the gateway.
    fn end(mut self) -> String {
        loop {
            match self.socket.read() {
                Ok(Message::Close(frame)) => return frame.unwrap().reason.to_string(),
                Ok(_) => {}
                Err(error) => panic!("{error}"),
            }
        }
    }
}

/// The status of an error of a handshake.
fn status(result: Result<Stream, Box<Error>>) -> u16 {
    match result.map(|_| ()).map_err(|error| *error) {
        Err(Error::Http(response)) => response.status().as_u16(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn without_a_token_in_the_configuration_nobody_has_control() {
    let bench = Bench::of(64, |server| server);
    let offer = bench.ask_with("GET", "/api/v1/session", "");
    assert_eq!((offer.code, offer.body.as_str()), (200, "{\"control\":false,\"encrypted\":false}"));
    for (method, path) in
        [("POST", "/api/v1/session"), ("DELETE", "/api/v1/session"), ("GET", "/api/v1/control")]
    {
        let lines = format!("Authorization: Bearer {SECRET}\r\n");
        let answer = bench.ask_with(method, path, &lines);
        assert_eq!(answer.code, 403, "{method} {path}");
        assert_eq!(
            answer.body,
            "nobody controls axes over HTTP: `[http]` of the configuration has no `token`\n"
        );
    }
}

#[test]
fn token_opens_a_session_and_nothing_else_does() {
    let site = Site::new();
    let offer = site.bench.ask_with("GET", "/api/v1/session", "");
    assert_eq!(offer.body, "{\"control\":true,\"encrypted\":false}");
    let post = |lines: &str| site.bench.ask_with("POST", "/api/v1/session", lines);
    let good = format!("Authorization: Bearer {SECRET}\r\n");
    for lines in ["", "Authorization: Basic c2l4\r\n", "Authorization: Bearer\r\n", "Cookie: session=1\r\n"] {
        let answer = post(lines);
        assert_eq!(answer.code, 401, "{lines}");
        assert!(answer.head.contains("www-authenticate: bearer"), "{}", answer.head);
    }
    let foreign = post(&format!("{good}Origin: http://evil.example\r\n"));
    assert_eq!(foreign.code, 403);
    let text =
        "the request is from `http://evil.example`, and not from the page of this gateway at `gateway`\n";
    assert_eq!(foreign.body, text);
    assert_eq!(post(&format!("{good}Origin: http://gateway\r\n")).code, 200);
    let begun = Instant::now();
    for left in (0..5).rev() {
        let answer = post("Authorization: Bearer sixteen-letters?\r\n");
        assert_eq!((answer.code, answer.body.as_str()), (401, "the token is wrong\n"), "{left} left");
    }
    let answer = post(&good);
    assert_eq!(answer.code, 429, "the right one is not even looked at: {}", answer.body);
    // Ten seconds after the first wrong one, less what it has taken to verify five.
    let wait =
        answer.head.split_once("retry-after: ").and_then(|(_, rest)| rest.lines().next()?.parse().ok());
    let least = 9_u64.saturating_sub(begun.elapsed().as_secs());
    assert!(wait.is_some_and(|wait: u64| (least..=10).contains(&wait)), "{}", answer.head);
}

#[test]
fn stream_needs_the_key_of_a_session() {
    let site = Site::new();
    let key = site.log_in();
    let wrong = "0".repeat(64);
    assert_eq!(status(site.try_open(&wrong, &[])), 401);
    assert_eq!(status(site.try_open(SECRET, &[])), 401, "the token is no key");
    assert_eq!(status(site.try_open(&key, &[("origin", "http://evil.example")])), 403);
    let own = format!("http://{}", site.bench.address);
    assert!(site.try_open(&key, &[("origin", &own)]).is_ok());
    let bearer = format!("Bearer {key}");
    assert!(site.try_open(&wrong, &[("authorization", &bearer)]).is_ok(), "a program has a header");
    let plain = site.bench.ask_with("GET", "/api/v1/control", &format!("Authorization: {bearer}\r\n"));
    assert_eq!((plain.code, plain.body.as_str()), (426, "expected a WebSocket of version 13\n"));
    assert_eq!(site.bench.ask_with("GET", "/api/v1/control", "").code, 401);
}

#[test]
fn orders_reach_the_engine_and_jogs_are_short() {
    let mut site = Site::new();
    let mut stream = site.open(&site.log_in());
    stream.say("enable y");
    let Request::Order { client, id, axis: 1, order: Order::Enable } = site.request() else {
        panic!("an enable")
    };
    site.answers.push(Answer { client, id, result: Err(Failure::Controller) }).unwrap();
    assert_eq!(
        stream.hear(),
        "error enable y controller: a controller is connected to the device of this axis"
    );
    stream.say("jog x 0.5");
    let Request::Order { id, axis: 0, order: Order::Jog(jog), .. } = site.request() else { panic!("a jog") };
    assert_eq!((jog.velocity.0, jog.time), (500_000_000, super::JOG));
    site.answers.push(Answer { client, id, result: Ok(None) }).unwrap();
    assert!(stream.hear().starts_with("ok jog x state=operating owner=local "));
    stream.say("status x");
    assert!(stream.hear().starts_with("ok status x state=operating "));
    stream.say("axes");
    assert!(stream.hear().ends_with("\nok axes 2"));
    for (line, reply) in [
        ("list x", "error list - not-here: `list` is a request for the Unix socket"),
        ("command x S-0-0264 start", "error command - not-here: `command` is a request for the Unix socket"),
        ("bundle", "error bundle - not-here: `bundle` is a request for the Unix socket"),
        ("enable z", "error enable - no-axis: unknown axis `z`: expected x, y"),
        ("enable\nx", "error - - syntax: the line is not printable UTF-8 text"),
    ] {
        stream.say(line);
        assert_eq!(stream.hear(), reply);
    }
    assert!(site.requests.is_empty(), "nothing of it reaches the engine");
    stream.socket.close(None).unwrap();
    assert_eq!(site.request(), Request::Gone { client });
}

#[test]
fn late_requests_move_nothing_and_may_stop() {
    let mut site = Site::new();
    let mut stream = site.open(&site.log_in());
    let old = stream.beat();
    for _ in 0..4 {
        stream.say("status x");
        stream.hear();
    }
    for line in ["jog x 1", "move x 1 velocity=1", "home x", "enable x", "reset x"] {
        stream.say_at(old, line);
        let word = line.split(' ').next().unwrap();
        assert_eq!(
            stream.hear(),
            format!("error {word} x late: the request was on its way for too long, nothing was done")
        );
        stream.say_at(0, line);
        assert!(stream.hear().contains(" late: "), "never sent");
        stream.say("status x");
        stream.hear();
    }
    assert!(site.requests.is_empty());
    for line in ["stop x", "disable x"] {
        stream.say_at(old, line);
        let Request::Order { order, .. } = site.request() else { panic!("an order") };
        assert_eq!(order.name(), line.split(' ').next().unwrap());
    }
}

#[test]
fn silence_and_late_messages_lose_control() {
    for talks in [false, true] {
        let mut site = Site::new();
        let mut stream = site.open(&site.log_in());
        stream.say("enable x");
        let Request::Order { client, .. } = site.request() else { panic!("an order") };
        let (began, old) = (Instant::now(), stream.beat);
        if talks {
            // It goes on with a beat that gets old.
            while began.elapsed() < Duration::from_millis(1_500) && site.requests.is_empty() {
                if stream.socket.send(Message::text(format!("{old} status x"))).is_err() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        }
        assert_eq!(site.request(), Request::Gone { client });
        let took = began.elapsed();
        assert!(
            (Duration::from_millis(400)..Duration::from_millis(1_500)).contains(&took),
            "{talks}: {took:?}"
        );
        if !talks {
            assert_eq!(stream.end(), "no beat of the client in time");
        }
    }
}

#[test]
fn end_of_connection_message_or_session_loses_control() {
    let mut site = Site::new();
    let key = site.log_in();
    let taken = |site: &mut Site, stream: &mut Stream| {
        stream.say("enable x");
        let Request::Order { client, .. } = site.request() else { panic!("an order") };
        client
    };
    let mut stream = site.open(&key);
    let client = taken(&mut site, &mut stream);
    let began = Instant::now();
    drop(stream);
    assert_eq!(site.request(), Request::Gone { client });
    assert!(began.elapsed() < Duration::from_millis(400), "at once: {:?}", began.elapsed());

    let mut stream = site.open(&key);
    let client = taken(&mut site, &mut stream);
    stream.socket.send(Message::text("x".repeat(5_000))).unwrap();
    assert_eq!(site.request(), Request::Gone { client });

    let mut stream = site.open(&key);
    let client = taken(&mut site, &mut stream);
    stream.socket.send(Message::binary(vec![0; 4])).unwrap();
    assert_eq!(site.request(), Request::Gone { client });
    assert_eq!(stream.end(), "a message was too long, or no text");

    let mut stream = site.open(&key);
    let client = taken(&mut site, &mut stream);
    let lines = format!("Authorization: Bearer {key}\r\n");
    assert_eq!(site.bench.ask_with("DELETE", "/api/v1/session", &lines).code, 204);
    assert_eq!(site.request(), Request::Gone { client });
    assert_eq!(stream.end(), "the session has ended");
    assert_eq!(site.bench.ask_with("DELETE", "/api/v1/session", &lines).code, 401);
    assert_eq!(status(site.try_open(&key, &[])), 401);
}

#[test]
fn four_streams_are_open_at_most() {
    let site = Site::new();
    let key = site.log_in();
    let mut streams: Vec<_> = (0..4).map(|_| site.open(&key)).collect();
    assert_eq!(status(site.try_open(&key, &[])), 503);
    streams.clear();
    let end = Instant::now() + PATIENCE;
    while site.try_open(&key, &[]).is_err() {
        assert!(Instant::now() < end, "the places stay taken");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn plain_requests_and_half_handshakes_do_not_hold_a_place_of_a_server_with_tls() {
    let config = tls::read(&tls::tests::files()).unwrap();
    let time = Duration::from_millis(700);
    let bench = Bench::of(8, |mut server| {
        server.limit_times(time, time);
        server.encrypt(config)
    });
    let mut plain = bench.connect();
    plain.write_all(b"GET /healthz HTTP/1.1\r\nHost: gateway\r\n\r\n").unwrap();
    let mut bytes = Vec::new();
    let _ = plain.read_to_end(&mut bytes);
    assert!(!bytes.starts_with(b"HTTP"), "{bytes:?}");
    let mut half: Vec<_> = (0..6).map(|_| bench.connect()).collect();
    for stream in &mut half {
        stream.write_all(b"\x16\x03\x01\x02\x00\x01").unwrap();
    }
    let began = Instant::now();
    for stream in &mut half {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
    }
    assert!(began.elapsed() >= time / 2 && began.elapsed() < PATIENCE, "{:?}", began.elapsed());
    // A client of the same library that trusts this certificate gets an answer.
    assert!(encrypted(&bench, "/healthz").starts_with("HTTP/1.1 200"));
    assert!(encrypted(&bench, "/api/v1/session").ends_with("{\"control\":false,\"encrypted\":true}"));
}

/// An answer over TLS.
fn encrypted(bench: &Bench, path: &str) -> String {
    use rustls::pki_types::pem::PemObject as _;
    let mut roots = rustls::RootCertStore::empty();
    let pem = std::fs::read(tls::tests::files().certificate).unwrap();
    roots.add(rustls::pki_types::CertificateDer::from_pem_slice(&pem).unwrap()).unwrap();
    let provider = std::sync::Arc::new(rustls::crypto::ring::default_provider());
    let config = rustls::ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let config = config.unwrap().with_root_certificates(roots).with_no_client_auth();
    let name = "localhost".try_into().unwrap();
    let mut client = rustls::ClientConnection::new(std::sync::Arc::new(config), name).unwrap();
    let mut stream = bench.connect();
    let mut stream = rustls::Stream::new(&mut client, &mut stream);
    stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes()).unwrap();
    let mut text = String::new();
    // The server closes after one answer.
    let _ = stream.read_to_string(&mut text);
    text
}

#[test]
fn parameter_is_written_by_a_fresh_request_and_read_back() {
    let mut site = Site::new();
    let mut stream = site.open(&site.log_in());
    let gain = Some(Attribute::new(ItemLength::Two, Format::Unsigned).with_decimals(2));
    stream.say("write x S-0-0104 2.5");
    assert_eq!(site.answer_access(Ok(gain), &[100, 0]), Direction::Read);
    assert_eq!(site.answer_access(Ok(None), &[250, 0]), Direction::Write { rescales: false });
    assert_eq!(site.answer_access(Ok(gain), &[250, 0]), Direction::Read);
    // The unit.
    assert_eq!(site.answer_access(Ok(None), b"1/s"), Direction::Read);
    let reply = stream.hear();
    let report: Value = serde_json::from_str(reply.strip_prefix("ok write x ").expect(&reply)).unwrap();
    assert_eq!((&report["value"], &report["before"]), (&"2.50".into(), &"1.00".into()));

    // One that the drive has changed, and one that the engine refuses.
    stream.say("write x S-0-0104 2.5");
    site.answer_access(Ok(gain), &[100, 0]);
    site.answer_access(Ok(None), &[250, 0]);
    site.answer_access(Ok(gain), &[249, 0]);
    let changed = "error write x not-kept: the drive took S-0-0104 = 2.50 and has 2.49 afterwards";
    assert_eq!(stream.hear(), changed);
    stream.say("write x S-0-0104 2.5");
    site.answer_access(Ok(gain), &[100, 0]);
    site.answer_access(Err(DirectFailure::Torque), &[250, 0]);
    let torque = "error write x torque: S-0-0104: parameters are not written while the drive has torque";
    assert_eq!(stream.hear(), torque);

    // One that the network has kept.
    let beat = stream.beat();
    while stream.beat() < beat + 5 {
        let beat = stream.beat;
        stream.say_at(beat, "status x");
        assert!(stream.hear().starts_with("ok status x "));
    }
    stream.say_at(beat, "write x S-0-0104 2.5");
    let late = "error write x late: the request was on its way for too long, nothing was done";
    assert_eq!(stream.hear(), late);
    assert!(site.direct.0.is_empty(), "nothing of it reaches the engine");
}
