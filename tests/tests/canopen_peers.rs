//! CANopen against stacks that share no code with this one, in a kernel that has CAN.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge::sys::can_socket::{CanSocket, Content, Filter, Options};
use axisbridge::sys::clock::monotonic_now;
use axisbridge_tests::can_kernel::{Kernel, is_inside};
use axisbridge_tests::peer::{can_kernel_or_skip, python_or_skip};
use axisbridge_tests::process::Running;
use profile_cia402::node::drive::{Device, identity};
use profile_cia402::node::{self, Node};
use profile_cia402::sdo::client::{Client, ClientConfig};
use profile_cia402::sdo::request::{Method, SdoData, SdoFailure, SdoOutcome, SdoRequest};
use profile_cia402::wire::{AbortCode, Mux, NodeId};
use profile_generic::can::{Frame, Id};
use profile_generic::servo::ServoParameters;
use profile_generic::time::DurationNs;

const NODE: u8 = 5;

/// Name of the variable that tells a test inside which Python to use.
const PYTHON: &str = "AXISBRIDGE_PYTHON";

/// The Python to go on with: only inside a guest, on one side with the packages of these peers.
fn python_inside(test: &str) -> Option<PathBuf> {
    if is_inside() {
        return std::env::var_os(PYTHON).map(PathBuf::from);
    }
    if !can_kernel_or_skip(test) {
        return None;
    }
    let python = python_or_skip(test, "canopen, can, durand")?;
    let inside =
        Kernel::new().limit(Duration::from_secs(120)).environment(PYTHON, python.as_os_str()).inside(test);
    assert!(!inside, "there is only one guest");
    None
}

/// A peer of `tests/peers` that runs, and what it has said.
struct Peer {
    running: Running,
    output: PathBuf,
}

impl Peer {
    /// Starts it and waits until it says "up".
    fn start(python: &Path, script: &'static str, arguments: &[&str]) -> Self {
        let output = std::env::temp_dir().join(script);
        let file = File::create(&output).unwrap();
        let path = format!("{}/peers/{script}", env!("CARGO_MANIFEST_DIR"));
        let mut command = Command::new(python);
        command.arg(path).args(arguments).stdout(file.try_clone().unwrap()).stderr(file).stdin(Stdio::null());
        let mut peer = Self { running: Running::start(script, &mut command), output };
        peer.says("up");
        peer
    }

    fn said(&self) -> String {
        std::fs::read_to_string(&self.output).unwrap_or_default()
    }

    /// Waits until it has said this line.
    fn says(&mut self, line: &str) {
        let end = Instant::now() + Duration::from_secs(30);
        while !self.said().lines().any(|said| said == line) {
            assert!(
                Instant::now() < end && self.running.ended().is_none(),
                "no `{line}` in:\n{}",
                self.said()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// An SDO client on a socket.
struct Channel {
    socket: CanSocket,
    client: Client,
}

impl Channel {
    fn open() -> Self {
        let answers = Filter::exactly(Id::Standard(0x580 + u16::from(NODE)));
        let socket = CanSocket::open("vcan0", &Options { filters: vec![answers], own: false }).unwrap();
        let config = ClientConfig { timeout: DurationNs::from_secs(5), ..ClientConfig::default() };
        Self { socket, client: Client::new(config) }
    }

    fn ask(&mut self, request: SdoRequest) -> SdoOutcome {
        self.client.start(monotonic_now(), request).unwrap();
        loop {
            while let Some(data) = self.client.poll(monotonic_now()) {
                let frame = Frame::new(Id::Standard(0x600 + u16::from(NODE)), &data).unwrap();
                self.socket.send(&frame).unwrap();
            }
            if let Some(outcome) = self.client.take_outcome() {
                return outcome;
            }
            let _ = self.socket.wait(Duration::from_millis(100)).unwrap();
            while let Some(received) = self.socket.recv().unwrap() {
                let Content::Frame(frame) = received.content else { panic!("{received:?}") };
                self.client.handle(monotonic_now(), frame.data()).unwrap();
            }
        }
    }
}

/// Bytes that repeat nowhere soon.
fn bytes(len: usize) -> Vec<u8> {
    let mut state = 0x1234_5678_u32;
    let next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    };
    std::iter::repeat_with(next).take(len).collect()
}

#[test]
fn objects_of_every_length_go_to_durand_and_back_in_segments_and_blocks() {
    let Some(python) = python_inside("objects_of_every_length_go_to_durand_and_back_in_segments_and_blocks")
    else {
        return;
    };
    let mut peer = Peer::start(&python, "canopen_blocks.py", &["vcan0", "5"]);
    let mut channel = Channel::open();
    let object = Mux::new(0x2000, 0);
    let number = channel.ask(SdoRequest::upload(Mux::new(0x2001, 0)));
    assert_eq!((number.result, number.data.unsigned()), (Ok(()), Some(0x1234_5678)));
    let first = channel.ask(SdoRequest::upload(object));
    assert_eq!((first.result, first.data.as_slice()), (Ok(()), &b"at the start"[..]));
    // Around one segment and one block (127 segments of 7 bytes), and many blocks.
    for len in [1, 4, 5, 6, 7, 8, 14, 15, 888, 889, 890, 1778, 1779, 5000] {
        for method in [Method::Segments, Method::Blocks] {
            let data = bytes(len);
            let down = SdoRequest::download(object, SdoData::Buffer(data.clone())).by(method);
            let outcome = channel.ask(down);
            assert_eq!(outcome.result, Ok(()), "{len} bytes down by {method:?}");
            peer.says(&format!("{len} {:08X}", crc32(&data)));
            let up = SdoRequest::upload_into(object, Vec::with_capacity(6000)).by(method);
            let outcome = channel.ask(up);
            assert_eq!(outcome.result, Ok(()), "{len} bytes up by {method:?}");
            assert_eq!(outcome.data.as_slice(), data, "{len} bytes by {method:?}");
        }
    }
    let absent = channel.ask(SdoRequest::upload(Mux::new(0x5FFF, 0)));
    assert_eq!(absent.result, Err(SdoFailure::Refused(AbortCode::NO_OBJECT)));
}

/// CRC-32 of zip.
fn crc32(data: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xEDB8_8320 },
        )
    };
    !data.iter().fold(u32::MAX, step)
}

#[test]
fn the_two_foreign_peers_understand_each_other() {
    let Some(python) = python_inside("the_two_foreign_peers_understand_each_other") else { return };
    let mut drive = Peer::start(&python, "canopen_drive.py", &["vcan0", "5", "--heartbeat", "100"]);
    let master = Command::new(&python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peers/canopen_master.py"))
        .args(["vcan0", "5", "--period", "0.03"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&master.stdout);
    assert!(master.status.success(), "{said}\n{}\n{}", String::from_utf8_lossy(&master.stderr), drive.said());
    for line in ["type 00020192", "modes 3A5", "missing 06020000", "state 27", "error 7305", "cleared 40"] {
        assert!(said.lines().any(|said| said == line), "no `{line}` in:\n{said}");
    }
    drive.says("fault -> switch on disabled");
}

/// Runs our simulated drive on the bus until a command has ended, and gives what that said.
fn with_our_drive(mut command: Command) -> (std::process::Output, Node<Device>) {
    let config = node::Config {
        node: NodeId::new(NODE).ok(),
        identity: identity(1, 0x1234_5678),
        boot_time: DurationNs::from_millis(10),
        has_blocks: true,
    };
    let device = Device::new(&[ServoParameters::default()]).unwrap();
    let mut node = Node::new(&config, device);
    let mut socket = CanSocket::open("vcan0", &Options::default()).unwrap();
    let output = std::env::temp_dir().join("master.txt");
    let file = File::create(&output).unwrap();
    command.stdin(Stdio::null()).stdout(file.try_clone().unwrap()).stderr(file);
    let mut master = Running::start("the master", &mut command);
    let status = loop {
        node.handle_time(monotonic_now());
        while let Some(received) = socket.recv().unwrap() {
            if let Content::Frame(frame) = received.content {
                node.handle_frame(monotonic_now(), &frame);
            }
        }
        while let Some(frame) = node.poll(monotonic_now()) {
            socket.send(&frame).unwrap();
        }
        if let Some(status) = master.ended() {
            break status;
        }
        let _ = socket.wait(Duration::from_millis(1)).unwrap();
    };
    let stdout = std::fs::read(&output).unwrap();
    (std::process::Output { status, stdout, stderr: Vec::new() }, node)
}

#[test]
fn our_drive_follows_a_foreign_master() {
    let Some(python) = python_inside("our_drive_follows_a_foreign_master") else { return };
    let mut master = Command::new(&python);
    master.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peers/canopen_master.py"));
    master.args(["vcan0", "5", "--period", "0.02"]);
    let (output, node) = with_our_drive(master);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    for line in ["type 00020192", "missing 06020000", "state 27", "error 7305", "cleared 40"] {
        assert!(said.lines().any(|said| said == line), "no `{line}` in:\n{said}");
    }
    assert!(said.contains("name Axisbridge simulated CiA 402 drive"), "{said}");
    assert_eq!(node.statistics().malformed, 0);
}
