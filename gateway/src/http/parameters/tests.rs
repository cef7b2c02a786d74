//! Parameters over HTTP: what reaches the engine, and what everybody is answered.

use std::time::{Duration, Instant};

use profile_sercos::master::svc::request::SvcFailure;
use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
use profile_sercos::wire::svc::Element;
use profile_sercos::wire::svc_error::SvcError;

use super::super::tests::{Bench, PATIENCE};
use super::*;
use crate::engine::direct::{DirectAnswer, DirectFailure, DirectRequest, Target};
use crate::local::server_tests::{queues, shared};
use crate::local::{Hub, Shared};

/// An answer of each kind, with every field.
pub fn examples() -> [(&'static str, Value); 2] {
    let text = || Some("text".to_owned());
    let report = ParameterReport {
        id: "S-0-0104".to_owned(),
        name: text(),
        kind: text(),
        unit: text(),
        minimum: text(),
        maximum: text(),
        attribute: text(),
        access: text(),
        writable: text(),
        value: "1".to_owned(),
        before: text(),
        recommission: true,
        data: "01".to_owned(),
    };
    let refused = ParameterRefusal { code: "absent".to_owned(), text: "text".to_owned() };
    let answer = ParameterAnswer { id: "S-0-0104".to_owned(), report: Some(report), refused: Some(refused) };
    let row = ParameterRow {
        id: "S-0-0104".to_owned(),
        name: text(),
        access: text(),
        kind: text(),
        unit: text(),
        minimum: text(),
        maximum: text(),
    };
    let list = ParameterList {
        axis: "x".to_owned(),
        bus: "sercos".to_owned(),
        source: "S-0-0017".to_owned(),
        parameters: vec![row],
    };
    let answers = ParameterAnswers { parameters: vec![answer] };
    [
        ("ParameterList", serde_json::to_value(list).unwrap()),
        ("ParameterAnswers", serde_json::to_value(answers).unwrap()),
    ]
}

/// What an access came to: the attribute of a SERCOS parameter, or why there is no value.
type Outcome = Result<Option<Attribute>, DirectFailure>;

/// A server, and the engine's side of its accesses. The first axis has a SERCOS drive.
struct Site {
    bench: Bench,
    direct: (rtrb::Consumer<DirectRequest>, rtrb::Producer<DirectAnswer>),
    /// Runs the hub.
    _runtime: tokio::runtime::Runtime,
}

impl Site {
    fn new() -> Self {
        let (ends, _, direct) = queues();
        let names = ["turntable", "slide"].map(str::to_owned).to_vec();
        let (hub, door) = Hub::new(Shared { names, ..shared() }, ends);
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.spawn(hub.run());
        let bench = Bench::of(64, |server| server.read_parameters(door));
        Self { bench, direct, _runtime: runtime }
    }

    /// The access that reaches the engine next.
    fn access(&mut self) -> DirectRequest {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Ok(request) = self.direct.0.pop() {
                return request;
            }
            assert!(Instant::now() < end, "no access reaches the engine");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn answer(
        &mut self,
        request: DirectRequest,
        result: Result<Option<Attribute>, DirectFailure>,
        bytes: &[u8],
    ) {
        let DirectRequest { client, id, mut data, .. } = request;
        data.extend_from_slice(bytes);
        self.direct.1.push(DirectAnswer { client, id, result, data }).unwrap();
    }

    /// Sends a request, and answers its accesses.
    fn ask(&mut self, path: &str, answers: &[(Outcome, &[u8])]) -> (Vec<Target>, u16, Value) {
        let address = self.bench.address;
        let path = path.to_owned();
        let asked = std::thread::spawn(move || get(address, &path));
        let mut targets = Vec::new();
        for (result, bytes) in answers {
            let request = self.access();
            targets.push(request.target);
            self.answer(request, *result, bytes);
        }
        let (code, body) = asked.join().unwrap();
        assert!(self.direct.0.is_empty(), "no more accesses than {targets:?}");
        (targets, code, serde_json::from_str(&body).unwrap_or(Value::String(body)))
    }
}

fn get(address: std::net::SocketAddr, path: &str) -> (u16, String) {
    use std::io::{Read as _, Write as _};
    let mut stream = std::net::TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: gateway\r\n\r\n").as_bytes()).unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
}

fn gain() -> Attribute {
    Attribute::new(ItemLength::Two, Format::Unsigned).with_decimals(2)
}

#[test]
fn list_and_values_are_those_of_the_drive() {
    let mut site = Site::new();
    let idns = [104, 0, 0, 0, 1, 0x80, 0, 0];
    let (_, code, list) = site.ask("/api/v1/parameters?axis=turntable", &[(Ok(None), &idns)]);
    assert_eq!((code, &list["bus"], &list["source"]), (200, &"sercos".into(), &"S-0-0017".into()));
    let rows = list["parameters"].as_array().unwrap();
    let ids: Vec<_> = rows.iter().map(|row| row["id"].as_str().unwrap()).collect();
    assert_eq!(ids, ["code", "S-0-0104", "P-0-0001"]);
    assert_eq!(
        (&rows[0]["access"], &rows[0]["unit"], &rows[0]["name"]),
        (&"write".into(), &"mHz".into(), &Value::Null)
    );
    assert_eq!(rows[1]["name"], "Position loop K_V-factor");

    let absent = SvcFailure::Refused { element: Element::Idn, code: SvcError(0x1001) };
    let locked = gain().protect(false, true, true);
    let (targets, code, read) = site.ask(
        "/api/v1/parameter?axis=turntable&id=S-0-0104&id=P-0-0001&id=S-0-0200&brief",
        &[
            (Ok(Some(gain())), &[0x96, 0]),
            (Ok(None), b"Gain"),
            (Err(DirectFailure::Svc(absent)), &[]),
            (Ok(Some(locked)), &[1, 0]),
            (Ok(None), b"Locked"),
        ],
    );
    assert_eq!((code, targets.len()), (200, 5), "{read}");
    let [one, two, three] = [0, 1, 2].map(|index| &read["parameters"][index]);
    assert_eq!((&one["id"], &one["report"]["value"]), (&"S-0-0104".into(), &"1.50".into()));
    assert_eq!((&one["report"]["writable"], &one["refused"]), (&"without torque".into(), &Value::Null));
    assert_eq!((&two["report"], &two["refused"]["code"]), (&Value::Null, &"absent".into()));
    assert_eq!(two["refused"]["text"], "P-0-0001: the drive refuses the IDN with 0x1001: IDN not available");
    assert_eq!(three["report"]["writable"], "in CP2 only");
    let (_, code, read) = site.ask("/api/v1/parameter?axis=slide&id=S-0-0104", &[]);
    assert_eq!((code, &read["parameters"][0]["refused"]["code"]), (200, &"no-parameter".into()));
}

#[test]
fn viewers_together_have_one_access_at_a_time() {
    let mut site = Site::new();
    let address = site.bench.address;
    let viewers: Vec<_> = (0..6)
        .map(|_| {
            std::thread::spawn(move || get(address, "/api/v1/parameter?axis=turntable&id=S-0-0104&brief"))
        })
        .collect();
    for _ in 0..6 {
        for element in [Element::Data, Element::Name] {
            let request = site.access();
            assert!(matches!(request.target, Target::Element(_, asked) if asked == element));
            // The others have time to ask, and do not.
            std::thread::sleep(Duration::from_millis(20));
            assert!(site.direct.0.is_empty(), "a second access");
            site.answer(request, Ok((element == Element::Data).then(gain)), &[0x96, 0]);
        }
    }
    for viewer in viewers {
        let (code, body) = viewer.join().unwrap();
        assert!(code == 200 && body.contains("\"value\":\"1.50\""), "{body}");
    }
}

#[test]
fn wrong_queries_are_refused_and_nothing_is_asked() {
    let site = Site::new();
    let many = format!("/api/v1/parameter?axis=turntable{}", "&id=S-0-0001".repeat(IDS_MAX + 1));
    for (path, why) in [
        ("/api/v1/parameters", "`axis` needs the name of an axis\n"),
        ("/api/v1/parameters?axis=z", "unknown axis `z`: expected turntable, slide\n"),
        ("/api/v1/parameter?id=S-0-0104", "`parameter` needs the name of an axis\n"),
        ("/api/v1/parameter?axis=turntable", "`parameter` needs id=ID\n"),
        (
            "/api/v1/parameter?axis=turntable&id=",
            "unexpected `id=`: expected the number or name of a parameter after id=\n",
        ),
        (
            "/api/v1/parameter?axis=turntable&value=1",
            "unexpected `value=1`: expected axis=AXIS, id=ID or brief\n",
        ),
        (&many, "unexpected `id=S-0-0001`: expected at most 8 parameters\n"),
    ] {
        let answer = get(site.bench.address, path);
        assert_eq!(answer, (400, why.to_owned()), "{path}");
    }
    let head = site.bench.ask_with("HEAD", "/api/v1/parameter?axis=turntable&id=S-0-0104", "");
    assert_eq!(head.code, 200);
    for method in ["POST", "PUT", "DELETE"] {
        let refused = site.bench.ask_with(method, "/api/v1/parameter?axis=turntable&id=S-0-0104", "");
        assert_eq!(refused.code, 405, "{method}");
    }
    // A word of the protocol cannot be brought in through a parameter.
    let (_, body) = get(site.bench.address, "/api/v1/parameter?axis=turntable&id=S-0-0104%20brief");
    assert!(body.contains("no-parameter"), "{body}");
    assert!(site.direct.0.is_empty(), "the engine was asked");
    let bare = Bench::of(64, |server| server);
    assert_eq!(bare.ask_with("GET", "/api/v1/parameters?axis=turntable", "").code, 503);
}
