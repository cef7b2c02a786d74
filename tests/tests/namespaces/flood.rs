//! Datagrams of a stranger at UDP 2222, at full speed, beside moving axes.
//!
//! ```text
//! controller 192.168.10.1 ---+
//! gateway    192.168.10.20 --+-- switch (a bridge in a namespace of its own)
//! stranger   192.168.10.66 --+
//! ```
//!
//! The drives are simulated in the gateway's process: nothing but the front is under test.

use std::fmt::Write as _;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::alone_in_real_time;
use axisbridge_tests::modbus::counters;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;
use axisbridge_tests::rig::network::Random;
use profile_cip::wire::class1::Class1Datagram;

use super::{a_bus, in_namespace, scratch, wait_for};

pub(super) const CONTROLLER: &str = "192.168.10.1";
pub(super) const GATEWAY: &str = "192.168.10.20";
pub(super) const STRANGER: &str = "192.168.10.66";

/// Set for the copy of this test binary that floods: which kinds, one after the other, as [`Kind::name`] has them.
const FLOOD: &str = "AXISBRIDGE_TEST_FLOOD";
/// Set for the copy that reads the counters of the box.
const COUNTERS: &str = "AXISBRIDGE_TEST_COUNTERS";

/// Datagrams a second at most.
const RATE: u64 = 80_000;

/// How long each kind is sent.
const FLOOD_TIME: Duration = Duration::from_secs(3);

/// What a stranger sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Octets without a meaning.
    Garbage,
    /// Class 1 datagrams of connections that there are not.
    Class1,
    /// The same from the address of the owner, and another port than its.
    Owner,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Garbage, Self::Class1, Self::Owner];

    const fn name(self) -> &'static str {
        match self {
            Self::Garbage => "garbage",
            Self::Class1 => "class1",
            Self::Owner => "owner",
        }
    }

    /// Where it comes from.
    fn source(self) -> String {
        match self {
            Self::Garbage | Self::Class1 => format!("{STRANGER}:40000"),
            Self::Owner => format!("{CONTROLLER}:40001"),
        }
    }

    fn write(self, random: &mut Random, buffer: &mut [u8; 120]) {
        if self == Self::Garbage {
            buffer.fill_with(|| random.next().to_le_bytes()[0]);
            return;
        }
        let [a, b, c, d, e, f, ..] = random.next().to_le_bytes();
        let datagram = Class1Datagram {
            connection_id: u32::from_le_bytes([a, b, c, d]),
            encapsulation_sequence: 1,
            sequence_count: u16::from_le_bytes([e, f]),
            data: &[6; 100],
        };
        datagram.emit(buffer).expect("room");
    }
}

/// The three hosts at their switch.
pub(super) struct Network {
    pub(super) controller: Namespace,
    pub(super) gateway: Namespace,
    pub(super) stranger: Namespace,
    _switch: Namespace,
}

pub(super) fn run(namespace: &Namespace, words: &str) -> String {
    let mut words = words.split(' ');
    let mut command = namespace.command(words.next().expect("a program"));
    let output = command.args(words).output().expect("it can be started");
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

impl Network {
    pub(super) fn new() -> Self {
        let [controller, gateway, stranger, switch] = ["ctl", "box", "str", "sw"].map(Namespace::new);
        run(&switch, "ip link add br0 type bridge");
        run(&switch, "ip link set br0 up");
        for (port, host, address) in
            [("p0", &controller, CONTROLLER), ("p1", &gateway, GATEWAY), ("p2", &stranger, STRANGER)]
        {
            cable((host, "net0", Some(&format!("{address}/24"))), (&switch, port, None));
            run(&switch, &format!("ip link set {port} master br0"));
        }
        // The stranger takes the address of the owner without a word to anybody: it neither asks nor answers who has it.
        let mac = run(&gateway, "cat /sys/class/net/net0/address");
        run(&stranger, "ip link set net0 arp off");
        run(&stranger, &format!("ip addr add {CONTROLLER}/32 dev net0"));
        run(&stranger, &format!("ip neigh replace {GATEWAY} lladdr {mac} nud permanent dev net0"));
        Self { controller, gateway, stranger, _switch: switch }
    }

    /// Starts a copy of this test binary in a namespace, for the role that `name` and `value` say.
    pub(super) fn copy(namespace: &Namespace, test: &str, name: &str, value: &str) -> std::process::Command {
        let own = std::env::current_exe().expect("own path");
        let mut command = namespace.command(own.to_str().expect("UTF-8"));
        command.args(["--exact", test, "--nocapture"]).env(name, value);
        command
    }

    /// Starts the gateway, whose log comes in a file, and waits until its bus is up.
    pub(super) fn start_gateway(&self, name: &str, config: &Path) -> (Running, PathBuf) {
        let log = scratch(&format!("{name}.log"));
        let mut command = in_namespace(&self.gateway, &["run", "--config", config.to_str().expect("UTF-8")]);
        command.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
        let mut gateway = Running::start("run", &mut command);
        wait_for(&log, "CP4", &mut gateway);
        (gateway, log)
    }

    /// Starts a controller that moves both axes for so long, and then prints how it went.
    pub(super) fn start_controller(&self, seconds: u64) -> Child {
        let words = ["simulate", "controller", "--target", GATEWAY, "--bind", CONTROLLER, "--axes", "2"];
        let mut command = in_namespace(&self.controller, &words);
        command.args(["--counts-per-unit", "1000000,10000", "--speed", "2,40", "--json"]);
        // A host that is shared by other tests pauses for more than a short period now and then.
        command.args(["--update-period-us", "16000", "--seconds", &seconds.to_string()]);
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the controller can be started")
    }

    /// Floods with these kinds to the end, and returns how many datagrams were sent.
    fn flood(&self, kinds: &[Kind]) -> u64 {
        let kinds = kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(" ");
        let output = Self::copy(&self.stranger, "flood::flooder", FLOOD, &kinds).output().expect("it starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        numbers(&output.stdout, "SENT").iter().sum()
    }

    /// Lost updates, and datagrams that the cycle had to refuse.
    fn counted(&self) -> [u64; 2] {
        self.counted_at("127.0.0.1:1502")
    }

    /// The same of a gateway whose Modbus server is there.
    pub(super) fn counted_at(&self, modbus: &str) -> [u64; 2] {
        let output =
            Self::copy(&self.gateway, "flood::counter_reader", COUNTERS, modbus).output().expect("it starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        numbers(&output.stdout, "COUNTED").try_into().expect("two numbers")
    }
}

/// The numbers in the lines that begin with a word. The harness of the copy may have begun the line.
pub(super) fn numbers(output: &[u8], word: &str) -> Vec<u64> {
    let text = String::from_utf8_lossy(output);
    let of_line = |line: &str| {
        let rest = line.split_once(word)?.1;
        Some(rest.split_whitespace().map(|number| number.parse().expect("a number")).collect::<Vec<u64>>())
    };
    text.lines().filter_map(of_line).flatten().collect()
}

/// The shipped example with simulated drives, at the address of this test.
pub(super) fn configuration(name: &str) -> PathBuf {
    let mut example = include_str!("../../../examples/two-axes-in-process.toml").to_owned();
    let listen = format!("listen = \"{GATEWAY}\"");
    for (shipped, here) in [
        ("listen = \"127.0.0.2\"", listen.as_str()),
        ("[log]\n", "[time]\nsource = \"shared\"\n[log]\n"),
        ("priority = 0 ", "priority = 40 "),
        // The machine of the tests does not promise to keep time: two seconds without an answer.
        ("allowed_losses = 4\n", "allowed_losses = 1000\n"),
        // A pause of the host at speed is a step of several cycles, which the limit does not let pass.
        ("velocity = 10.0 ", "velocity = 100.0 "),
        ("velocity = 1_000.0", "velocity = 10_000.0"),
    ] {
        assert!(example.contains(shipped), "the shipped example has {shipped:?}");
        example = example.replace(shipped, here);
    }
    let path = scratch(name);
    std::fs::write(&path, example).expect("the scratch folder can be written");
    path
}

#[test]
fn a_flood_of_a_stranger_costs_moving_axes_nothing() {
    let name = "a_flood_of_a_stranger_costs_moving_axes_nothing";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    alone_in_real_time(name, || flooded(name));
}

fn flooded(name: &str) {
    let network = Network::new();
    let (mut gateway, log) = network.start_gateway(name, &configuration(&format!("{name}.toml")));

    // With no connection open the port takes nothing.
    let sent = network.flood(&[Kind::Garbage]);
    let [_, refused] = network.counted();
    assert!(
        refused <= few(sent),
        "{refused} of {sent} datagrams reached the cycle while no connection was open"
    );

    let controller = network.start_controller(FLOOD_TIME.as_secs() * 3 + 5);
    wait_for(&log, "-> Running", &mut gateway);
    let [_, before] = network.counted();
    let lines = |log: &PathBuf| std::fs::read_to_string(log).expect("a log").lines().count();
    let quiet = lines(&log);
    let sent = network.flood(&Kind::ALL);
    let noise = lines(&log) - quiet;
    let [lost, after] = network.counted();
    let output = controller.wait_with_output().expect("the controller ends");
    let text = std::fs::read_to_string(&log).expect("a log");
    let mut said = String::new();
    let _ = write!(
        said,
        "{sent} sent, {} refused in the cycle, {lost} updates lost, {noise} lines",
        after - before
    );
    println!("{said}");
    all_arrived(&output, &format!("{said}\n{text}"));
    assert_eq!(lost, 0, "{said}\n{text}");
    assert!(sent > 3 * RATE, "that was no flood: {said}");
    assert!(after - before <= few(sent), "the kernel drops what is not the owner's: {said}\n{text}");
    // Moves write lines of their own. About the flood there is one of the kernel's count and one of a sample.
    let about = |what: &str| text.lines().filter(|line| line.contains(what)).count();
    assert!(noise < 40, "{said}\n{text}");
    assert!((1..=2).contains(&about("dropped before they reached the cycle")), "{said}\n{text}");
    assert!(about("the last one from") <= 2, "{said}\n{text}");
    assert_eq!(gateway.terminate(Duration::from_secs(10)).code(), Some(0));
}

/// Each axis of a controller that has ended is where it was sent, and no update was lost.
pub(super) fn all_arrived(controller: &Output, said: &str) {
    assert!(controller.status.success(), "the controller ended with {}: {said}", controller.status);
    let result: serde_json::Value =
        serde_json::from_slice(&controller.stdout).expect("--json prints one JSON object");
    for axis in result["axes"].as_array().expect("an array `axes`") {
        let number = |key: &str| axis[key].as_f64().expect("a number");
        assert!((number("target") - number("reached")).abs() < 0.01, "{said}: {axis}");
        assert!(number("lost_updates") < 0.5, "{said}: {axis}");
    }
}

/// What may pass the filter of so many datagrams: one in 4096, chosen at random, and three times that.
const fn few(sent: u64) -> u64 {
    sent / 1_365 + 20
}

/// Not a test of its own: the stranger, which sends what its role says, bounded in time and number.
#[test]
fn flooder() {
    let Ok(kinds) = std::env::var(FLOOD) else { return };
    let mut random = Random::new(66);
    let mut buffer = [0; 120];
    for kind in Kind::ALL.into_iter().filter(|kind| kinds.split(' ').any(|name| name == kind.name())) {
        let socket = UdpSocket::bind(kind.source()).expect("the stranger's address");
        socket.connect((GATEWAY, 2222)).expect("a route");
        let start = Instant::now();
        let most = RATE * FLOOD_TIME.as_secs();
        let mut sent = 0;
        while start.elapsed() < FLOOD_TIME && sent < most {
            let micros = u64::try_from(start.elapsed().as_micros()).expect("short");
            // After a pause of this host not everything comes at once.
            let due = (micros * RATE / 1_000_000).min(sent + RATE / 100);
            while sent < due {
                kind.write(&mut random, &mut buffer);
                // A full queue, or a port that nobody has yet.
                let _ = socket.send(&buffer);
                sent += 1;
            }
            std::thread::sleep(Duration::from_micros(500));
        }
        println!("SENT {sent}");
    }
}

/// Not a test of its own: reads the counters of the box from inside its namespace.
#[test]
fn counter_reader() {
    let Ok(address) = std::env::var(COUNTERS) else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let counters = runtime.block_on(counters(address.parse().expect("an address"))).expect("Modbus answers");
    println!("COUNTED {} {}", counters.lost_updates, counters.refused_frames);
}
