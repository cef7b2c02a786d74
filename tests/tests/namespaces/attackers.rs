//! A stranger on the plant network against every open port, beside axes that move.
//!
//! The hosts are those of [`super::flood`]. Each attack has a time of its own; `AXISBRIDGE_ATTACK_SECONDS` makes it longer, and the table
//! that the test prints is that of `docs/security.md`.

use std::fmt::Write as _;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use axisbridge_tests::host::alone_in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::rig::network::Random;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{Command, EncapsulationStatus, Packet};
use profile_cip::wire::forward_open::{ForwardOpen, Transport, Trigger};
use profile_cip::wire::message_router::Request;
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_cip::wire::status::Service;
use profile_cip::wire::triad::ConnectionTriad;

use super::flood::{GATEWAY, Network, STRANGER, all_arrived, numbers, run};
use super::{a_bus, wait_for};

/// Set for the copy of this test binary that attacks: the name of the attack, and the milliseconds that it has.
const ATTACK: &str = "AXISBRIDGE_TEST_ATTACK";

/// How many seconds each attack has, where it is not to be half a one.
const SECONDS: &str = "AXISBRIDGE_ATTACK_SECONDS";

const EXPLICIT: u16 = 44_818;
const HTTP: u16 = 8_080;
const MODBUS: u16 = 1_502;

/// Memory that all attacks together may take: a bundle that is being made, which has the recordings twice, and what full places hold.
const GROWTH_MAX_KB: u64 = 48_000;

/// What is done to a port until the time is over; the result is how often.
type Attack = fn(Instant) -> u64;

/// The attacks by name.
const ATTACKS: [(&str, Attack); 20] = [
    ("List requests, UDP 44818", |end| datagrams(end, list_identity)),
    ("octets without a meaning, UDP 44818", |end| datagrams(end, noise)),
    ("connections opened and closed, TCP 44818", |end| connects(end, EXPLICIT)),
    ("200 connections with four bytes, TCP 44818", |end| half_open(end, EXPLICIT, &[0x65, 0, 4, 0])),
    ("one byte in 20 ms on 24 connections, TCP 44818", slow),
    ("octets without a meaning, TCP 44818", |end| streams(end, EXPLICIT, noise)),
    ("lengths of 65535 bytes, TCP 44818", |end| streams(end, EXPLICIT, oversized)),
    ("Forward_Opens of the motion connection", |end| requests(end, &motion_open())),
    ("Set_Attribute_Single of an axis", |end| requests(end, &set_axis())),
    ("Set_Attribute_Single of the inactivity time-out", |end| {
        requests(end, &set_network(0xF5, 13, &[10, 0]))
    }),
    ("Set_Attribute_Single of a code point", |end| requests(end, &set_network(0x48, 4, &[0]))),
    ("Resets", |end| requests(end, &message(Service::RESET, &[0x20, 1, 0x24, 1], &[0]))),
    ("requests whose answers are not read, TCP 44818", unread),
    ("requests, HTTP", |end| streams(end, HTTP, get_metrics)),
    ("200 connections with half a head, HTTP", |end| half_open(end, HTTP, b"GET / HTTP/1.1\r\nHo")),
    ("recordings and bundles that are not read, HTTP", downloads),
    ("wrong tokens, HTTP", |end| streams(end, HTTP, wrong_token)),
    ("control without a session, HTTP", |end| streams(end, HTTP, no_session)),
    ("octets without a meaning, Modbus", |end| streams(end, MODBUS, noise)),
    ("200 connections with half a request, Modbus", |end| half_open(end, MODBUS, &[0, 1, 0, 0, 0, 6])),
];

fn to(port: u16) -> SocketAddr {
    SocketAddr::new(GATEWAY.parse().expect("an address"), port)
}

fn connect(port: u16) -> Option<TcpStream> {
    let stream = TcpStream::connect_timeout(&to(port), Duration::from_millis(500)).ok()?;
    stream.set_read_timeout(Some(Duration::from_millis(500))).ok()?;
    stream.set_write_timeout(Some(Duration::from_millis(500))).ok()?;
    Some(stream)
}

fn packet(command: Command, session: u32, data: &[u8]) -> Vec<u8> {
    let status = EncapsulationStatus::SUCCESS;
    let packet =
        Packet { command, session_handle: session, status, sender_context: *b"stranger", options: 0, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).expect("room");
    bytes
}

pub(super) fn message(service: Service, path: &[u8], data: &[u8]) -> Vec<u8> {
    let request = Request { service, path, data };
    let mut bytes = vec![0; request.buffer_len()];
    request.emit(&mut bytes).expect("room");
    bytes
}

/// A Forward_Open that the device would take if nobody owned it.
fn motion_open() -> Vec<u8> {
    let size = NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size: 220,
    };
    let open = ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 0x5500_0001,
        triad: ConnectionTriad { connection_serial: 66, originator_vendor: 66, originator_serial: 66 },
        timeout_multiplier: 2,
        o_to_t_rpi_us: 16_000,
        o_to_t: size,
        t_to_o_rpi_us: 16_000,
        t_to_o: size,
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: &[0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02],
    };
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).expect("room");
    message(open.service(), &[0x20, 6, 0x24, 1], &data)
}

/// Position Trim of the first axis: set by somebody else it would be a jump.
fn set_axis() -> Vec<u8> {
    message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 0x42, 0x24, 1, 0x31, 0, 0x5C, 0x01], &[0; 8])
}

/// An attribute of the network, which is kept in the device.
fn set_network(class: u8, attribute: u8, value: &[u8]) -> Vec<u8> {
    message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, class, 0x24, 1, 0x30, attribute], value)
}

fn list_identity(_: &mut Random) -> Vec<u8> {
    packet(Command::LIST_IDENTITY, 0, &[])
}

fn noise(random: &mut Random) -> Vec<u8> {
    (0..120).map(|_| random.next().to_le_bytes()[0]).collect()
}

fn oversized(random: &mut Random) -> Vec<u8> {
    let mut bytes = packet(Command::SEND_RR_DATA, 1, &[]);
    bytes[2..4].copy_from_slice(&[0xFF, 0xFF]);
    bytes.extend(noise(random).repeat(500));
    bytes
}

fn get_metrics(_: &mut Random) -> Vec<u8> {
    b"GET /metrics HTTP/1.1\r\nHost: gateway\r\n\r\n".to_vec()
}

/// A token that is guessed.
fn wrong_token(random: &mut Random) -> Vec<u8> {
    let guess: String = noise(random).iter().map(|byte| char::from(b'a' + byte % 26)).take(40).collect();
    let head = "POST /api/v1/session HTTP/1.1\r\nHost: gateway\r\nAuthorization: Bearer ";
    format!("{head}sixteen-letters-{guess}\r\n\r\n").into_bytes()
}

/// A stream with the key of a session that is guessed.
fn no_session(_: &mut Random) -> Vec<u8> {
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let key = "0123456789abcdef".repeat(4);
    format!("GET /api/v1/control HTTP/1.1\r\nHost: gateway\r\n{upgrade}Authorization: Bearer {key}\r\n\r\n")
        .into_bytes()
}

/// Datagrams, at most 40 000 a second.
fn datagrams(end: Instant, content: fn(&mut Random) -> Vec<u8>) -> u64 {
    let socket = UdpSocket::bind((STRANGER, 0)).expect("the stranger's address");
    socket.connect(to(EXPLICIT)).expect("a route");
    let mut random = Random::new(66);
    let mut count = 0;
    while Instant::now() < end {
        for _ in 0..40 {
            let _ = socket.send(&content(&mut random));
            count += 1;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    count
}

fn connects(end: Instant, port: u16) -> u64 {
    let mut count = 0;
    while Instant::now() < end {
        count += u64::from(connect(port).is_some());
    }
    count
}

/// Connections that send the beginning of a request and stay, opened anew when they are closed.
fn half_open(end: Instant, port: u16, beginning: &[u8]) -> u64 {
    let mut count = 0;
    let mut held = Vec::new();
    while Instant::now() < end {
        let Some(mut stream) = connect(port) else { continue };
        let _ = stream.write_all(beginning);
        held.push(stream);
        count += 1;
        if held.len() > 200 {
            held.clear();
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    count
}

/// A request byte by byte.
fn slow(end: Instant) -> u64 {
    let mut streams: Vec<_> = (0..24).filter_map(|_| connect(EXPLICIT)).collect();
    let bytes = packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]);
    let mut count = 0;
    for byte in bytes.iter().cycle() {
        if end <= Instant::now() {
            break;
        }
        for stream in &mut streams {
            count += u64::from(stream.write_all(&[*byte]).is_ok());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    count
}

/// Sends this on connection after connection, and takes what comes.
fn streams(end: Instant, port: u16, content: fn(&mut Random) -> Vec<u8>) -> u64 {
    let mut random = Random::new(67);
    let mut count = 0;
    let mut answer = [0; 4_096];
    while Instant::now() < end {
        let Some(mut stream) = connect(port) else { continue };
        let _ = stream.set_read_timeout(Some(Duration::from_millis(20)));
        let _ = stream.write_all(&content(&mut random));
        let _ = stream.read(&mut answer);
        count += 1;
    }
    count
}

fn register() -> Option<(TcpStream, u32)> {
    register_on(connect(EXPLICIT)?)
}

fn register_on(mut stream: TcpStream) -> Option<(TcpStream, u32)> {
    stream.write_all(&packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0])).ok()?;
    let mut answer = [0; 28];
    stream.read_exact(&mut answer).ok()?;
    Some((stream, u32::from_le_bytes(answer[4..8].try_into().ok()?)))
}

fn unconnected(message: &[u8]) -> Vec<u8> {
    let items = [
        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
        Item { item_type: ItemType::UNCONNECTED_DATA, data: message },
    ];
    let body = EncapsulatedPacket { packet: CommonPacket::new(&items), ..EncapsulatedPacket::default() };
    let mut bytes = vec![0; body.buffer_len()];
    body.emit(&mut bytes).expect("room");
    bytes
}

/// One request after the other, as fast as they are answered; none may be granted.
fn requests(end: Instant, message: &[u8]) -> u64 {
    let (mut stream, session) = register().expect("a session");
    let request = packet(Command::SEND_RR_DATA, session, &unconnected(message));
    let mut count = 0;
    let mut answer = [0; 1_024];
    while Instant::now() < end {
        stream.write_all(&request).expect("the session lives");
        let len = stream.read(&mut answer).expect("an answer");
        // Header, items, service, reserved byte, general status.
        assert!(len > 42 && answer[42] != 0, "granted: {:02x?}", &answer[..len]);
        count += 1;
    }
    count
}

/// Data of the answer to a request, or its general status.
pub(super) fn answer_of(device: &str, message: &[u8]) -> Result<Vec<u8>, u8> {
    let stream = TcpStream::connect(device).expect("the device listens");
    let (mut stream, session) = register_on(stream).expect("a session");
    let request = packet(Command::SEND_RR_DATA, session, &unconnected(message));
    stream.write_all(&request).expect("the session lives");
    let mut answer = [0; 1_024];
    let len = stream.read(&mut answer).expect("an answer");
    assert!(len >= 44, "{:02x?}", &answer[..len]);
    if answer[42] == 0 { Ok(answer[44..len].to_vec()) } else { Err(answer[42]) }
}

/// Requests with long answers that nobody reads.
fn unread(end: Instant) -> u64 {
    let mut count = 0;
    let all = message(Service(0x01), &[0x20, 1, 0x24, 1], &[]);
    while Instant::now() < end {
        let Some((mut stream, session)) = register() else { continue };
        let _ = stream.set_write_timeout(Some(Duration::from_millis(50)));
        let request = packet(Command::SEND_RR_DATA, session, &unconnected(&all)).repeat(100);
        while Instant::now() < end && stream.write_all(&request).is_ok() {
            count += 100;
        }
    }
    count
}

/// Files that are asked for and not read.
fn downloads(end: Instant) -> u64 {
    let mut count = 0;
    let mut held = Vec::new();
    for path in ["/recording.pcapng?last=10", "/bundle", "/events", "/api/v1/log"].iter().cycle() {
        if end <= Instant::now() {
            break;
        }
        let Some(mut stream) = connect(HTTP) else { continue };
        let _ = stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: gateway\r\n\r\n").as_bytes());
        held.push(stream);
        count += 1;
        if held.len() > 100 {
            held.clear();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    count
}

/// The shipped example with all servers on the plant network.
fn configuration(name: &str) -> PathBuf {
    let path = super::flood::configuration(name);
    let text = std::fs::read_to_string(&path).expect("a configuration");
    let (shipped, here) = ("listen = \"127.0.0.1:1502\"\n", format!("listen = \"{GATEWAY}:{MODBUS}\"\n"));
    assert!(text.contains(shipped), "{text}");
    let token = path.with_extension("token");
    let hash = axisbridge::http::hash("the-token-of-this-test").expect("it is long enough");
    std::fs::write(&token, hash).expect("the scratch folder can be written");
    let keys = format!("token = \"{}\"\nplain = true", token.display());
    let servers = format!("{here}\n[http]\nlisten = \"{GATEWAY}:{HTTP}\"\n{keys}\n");
    std::fs::write(&path, text.replace(shipped, &servers)).expect("the scratch folder can be written");
    path
}

/// Resident memory of a process, in kB.
fn memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse().unwrap_or_default()
}

/// How long each attack takes.
fn time_of_each() -> Duration {
    let seconds = std::env::var(SECONDS).ok().and_then(|text| text.parse().ok());
    seconds.map_or(Duration::from_millis(500), Duration::from_secs)
}

#[test]
fn attacks_on_every_port_cost_moving_axes_nothing() {
    let name = "attacks_on_every_port_cost_moving_axes_nothing";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    alone_in_real_time(name, || attacked(name));
}

fn attacked(name: &str) {
    let each = time_of_each();
    let network = Network::new();
    // The stranger answers nobody who asks for its Ethernet address.
    let mac = run(&network.stranger, "cat /sys/class/net/net0/address");
    run(&network.gateway, &format!("ip neigh replace {STRANGER} lladdr {mac} nud permanent dev net0"));
    let (mut gateway, log) = network.start_gateway(name, &configuration(&format!("{name}.toml")));
    let attacks = u64::try_from(ATTACKS.len()).expect("few");
    // Each is between two looks at the counters.
    let controller = network
        .start_controller(attacks * (u64::try_from(each.as_millis()).expect("short") + 400) / 1_000 + 5);
    wait_for(&log, "-> Running", &mut gateway);
    let text = || std::fs::read_to_string(&log).expect("a log");
    let (first, began) = (memory(gateway.id()), Instant::now());
    let quiet = text().lines().count();

    let mut table = String::from("| attack | how often | lost updates | memory |\n|---|---|---|---|\n");
    let mut lost_before = network.counted_at(&format!("{GATEWAY}:{MODBUS}"))[0];
    for (what, _) in ATTACKS {
        let before = memory(gateway.id());
        let given = format!("{what};{}", each.as_millis());
        let output = Network::copy(&network.stranger, "attackers::attacker", ATTACK, &given)
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{what}: {}", String::from_utf8_lossy(&output.stderr));
        let count = numbers(&output.stdout, "DONE")[0];
        assert!(count > 3, "{what}: that was no attack");
        // Modbus may be full: its places are given back when the attacker's process has ended.
        let lost = network.counted_at(&format!("{GATEWAY}:{MODBUS}"))[0];
        let grown = memory(gateway.id()).saturating_sub(before);
        let _ = writeln!(table, "| {what} | {count} | {} | +{grown} kB |", lost - lost_before);
        lost_before = lost;
    }
    let seconds = usize::try_from(began.elapsed().as_secs()).expect("short");
    let (grown, noise) = (memory(gateway.id()).saturating_sub(first), text().lines().count() - quiet);
    println!("{table}\nmemory +{grown} kB, {noise} lines in {seconds} s");
    let output = controller.wait_with_output().expect("the controller ends");
    let text = text();
    all_arrived(&output, &format!("{table}\n{text}"));
    assert_eq!(lost_before, 0, "{table}\n{text}");
    assert!(grown < GROWTH_MAX_KB, "{grown} kB\n{table}");
    assert!(noise < 100 + 100 * (seconds / 60 + 1), "{noise} lines\n{text}");
    assert_eq!(gateway.terminate(Duration::from_secs(10)).code(), Some(0));
}

/// Not a test of its own: the stranger, which attacks as its role says, for as long as it says.
#[test]
fn attacker() {
    let Ok(given) = std::env::var(ATTACK) else { return };
    let (name, millis) = given.split_once(';').expect("a name and a time");
    let (_, attack) = ATTACKS.iter().find(|(known, _)| *known == name).expect("a known attack");
    let end = Instant::now() + Duration::from_millis(millis.parse().expect("a number"));
    println!("DONE {}", attack(end));
}
