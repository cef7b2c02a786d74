//! Local control over the socket of a running gateway, with simulated drives and the clock of this host.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};

/// A running gateway and the paths of its socket and its log.
pub struct Gateway {
    pub run: Running,
    pub socket: PathBuf,
    log: PathBuf,
}

/// A file of the tests.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

impl Gateway {
    /// Starts it with two simulated SERCOS drives in its process.
    pub fn start(name: &str, device: &str) -> Self {
        let text = two_axes(device, "");
        let modes = "address = 1\nmodes = [\"position\", \"positioning\", \"homing\"]";
        assert_eq!(text.matches("address = 1\n").count(), 1, "{text}");
        Self::with(name, &text.replacen("address = 1", modes, 1))
    }

    /// Starts it with this configuration.
    pub fn with(name: &str, text: &str) -> Self {
        let config = path(&format!("{name}.toml"));
        fs::write(&config, text).expect("the folder of the tests can be written to");
        let (socket, log) = (path(&format!("{name}.socket")), path(&format!("{name}.log")));
        let mut run = Command::new(axisbridge());
        run.args(["run", "--config"]).arg(config).arg("--local").arg(&socket);
        run.env_remove("RUST_LOG").stdout(Stdio::null()).stderr(fs::File::create(&log).expect("the log"));
        Self { run: Running::start("run", &mut run), socket, log }
    }

    pub fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// `axisbridge status` while local control has the turntable: all is well, in words and as an object.
    fn shows_its_status(&self) {
        let status = |words: &[&str], socket: &PathBuf| {
            let mut command = Command::new(axisbridge());
            command.arg("status").args(words).arg("--local").arg(socket).stdin(Stdio::null());
            let output = command.output().expect("the command can be started");
            let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
            (output.status.code(), text(output.stdout), text(output.stderr))
        };
        let (code, text, errors) = status(&["--json"], &self.socket);
        assert_eq!((code, errors.as_str()), (Some(0), ""), "{text}");
        let object: serde_json::Value = serde_json::from_str(&text).expect("one object");
        assert_eq!(object["state"], "ready", "{text}");
        assert_eq!(
            (&object["time"]["source"], &object["time"]["synchronized"]),
            (&"shared".into(), &true.into())
        );
        let [turntable, slide] = [0, 1].map(|axis| &object["axes"][axis]);
        assert_eq!(
            (&turntable["name"], &turntable["owner"]),
            (&"turntable".into(), &"local".into()),
            "{text}"
        );
        assert_eq!((&turntable["state"], &slide["owner"]), (&"operating".into(), &"nobody".into()), "{text}");
        let position = turntable["position"].as_f64().expect("a number");
        assert!((position + 0.5).abs() < 0.002, "{text}");
        let (code, text, _) = status(&[], &self.socket);
        assert_eq!(code, Some(0), "{text}");
        let line = text.lines().find(|line| line.starts_with("turntable ")).expect("a line for the axis");
        assert!(line.contains(" operating ") && line.contains(" local "), "{text}");
        // -0.5 within the tolerance of a movement.
        assert!(["-0.50", "-0.49"].iter().any(|position| line.contains(position)), "{text}");
        let (code, text, errors) = status(&[], &path("nobody.socket"));
        assert_eq!((code, text.as_str()), (Some(1), ""));
        assert!(errors.starts_with("no gateway answers at "), "{errors}");
    }

    /// `axisbridge attributes` says of the commissioned drives what it says of those of the configuration, which are the same here.
    fn shows_its_attributes(&self, name: &str) {
        let attributes = |words: &[&str], path: &PathBuf| {
            let mut command = Command::new(axisbridge());
            command.arg("attributes").args(words).arg(path).stdin(Stdio::null());
            let output = command.output().expect("the command can be started");
            let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
            (output.status.code(), text(output.stdout), text(output.stderr))
        };
        let (code, of_gateway, errors) = attributes(&["--local"], &self.socket);
        assert_eq!((code, errors.as_str()), (Some(0), ""), "{of_gateway}");
        let (_, of_configuration, _) = attributes(&["--config"], &path(&format!("{name}.toml")));
        let of_configuration = of_configuration.replace(" (a simulated one)", "");
        let both = of_gateway.lines().zip(of_configuration.lines());
        let differing: Vec<_> = both.filter(|(gateway, configuration)| gateway != configuration).collect();
        assert!(differing.is_empty(), "{differing:?}");
        let lines = [&of_gateway, &of_configuration].map(|text| text.lines().count());
        assert_eq!(lines, [2 * 453 + 1; 2]);
        let (code, _, errors) = attributes(&["--axis", "nobody", "--local"], &self.socket);
        let expected = "error: there is no axis `nobody`; expected one of: turntable, slide\n";
        assert_eq!((code, errors.as_str()), (Some(2), expected));
    }

    pub fn connect(&self) -> Client {
        let end = Instant::now() + Duration::from_secs(30);
        loop {
            if let Ok(stream) = UnixStream::connect(&self.socket) {
                stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a socket");
                return Client(BufReader::new(stream));
            }
            assert!(Instant::now() < end, "no socket: {}", self.log());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// A client of local control.
pub struct Client(BufReader<UnixStream>);

impl Client {
    fn say(&mut self, line: &str) {
        writeln!(self.0.get_mut(), "{line}").expect("a connection");
    }

    fn hear(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).expect("a reply");
        line
    }

    /// Sends a request and returns its reply.
    pub fn ask(&mut self, line: &str) -> String {
        self.say(line);
        self.hear()
    }

    /// Repeats a request until its reply begins so.
    pub fn until(&mut self, line: &str, beginning: &str) -> String {
        let end = Instant::now() + Duration::from_secs(30);
        loop {
            let reply = self.ask(line);
            if reply.starts_with(beginning) {
                return reply;
            }
            assert!(Instant::now() < end, "{line} gives {reply}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

/// The value of a name in a reply.
pub fn value(reply: &str, name: &str) -> f64 {
    let word = reply.split(' ').find_map(|word| word.strip_prefix(name)).unwrap_or_default();
    word.trim_end().parse().unwrap_or_else(|_| panic!("no {name} in {reply}"))
}

#[test]
fn people_move_an_axis_home_it_and_leave_it() {
    let name = "people_move_an_axis_home_it_and_leave_it";
    in_real_time(name, || {
        let mut gateway = Gateway::start("local-people", "127.0.0.86");
        let mut client = gateway.connect();
        client.until("enable turntable", "ok enable turntable state=operating owner=local ");
        let reply = client.ask("move turntable 0.75 velocity=1 acceleration=5 by=gateway");
        assert!(reply.starts_with("ok move turntable "), "{reply}");
        assert!((value(&reply, "position=") - 0.75).abs() < 0.002, "{reply}");
        let reply = client.ask("move turntable -0.5 velocity=2 acceleration=5 by=drive");
        assert!((value(&reply, "position=") + 0.5).abs() < 0.002, "{reply}");
        gateway.shows_its_status();
        gateway.shows_its_attributes("local-people");
        let reply = client.ask("home slide");
        assert!(reply.starts_with("error home slide not-enabled: "), "{reply}");
        // Nothing switches the home switch of this simulated drive: it seeks until a stop replaces the order.
        client.say("home turntable");
        std::thread::sleep(Duration::from_millis(1_000));
        let reply = client.ask("status turntable");
        assert!(reply.contains(" mode=homing ") && value(&reply, "velocity=") > 0.1, "{reply}");
        client.say("stop turntable");
        assert_eq!(client.hear(), "error home turntable replaced: replaced by `stop`\n");
        let reply = client.hear();
        assert!(reply.starts_with("ok stop turntable state=operating "), "{reply}");
        assert!(value(&reply, "velocity=").abs() < 0.15, "{reply}");
        // The client disappears while the axis moves.
        let reply = client.ask("jog turntable 1 acceleration=5");
        assert!(reply.starts_with("ok jog turntable "), "{reply}");
        drop(client);
        let mut client = gateway.connect();
        let reply = client.until("status turntable", "ok status turntable state=inhibited owner=nobody ");
        assert!(value(&reply, "velocity=").abs() < 0.05, "{reply}");
        let text = gateway.log();
        for line in ["local control: client connected", "under local control", "released by local control"] {
            assert!(text.contains(line), "no {line:?} in {text}");
        }
        let status = gateway.run.terminate(Duration::from_secs(30));
        assert_eq!(status.code(), Some(0), "{}", gateway.log());
        assert!(!gateway.socket.exists(), "the socket is removed");
    });
}
