//! tshark as an independent reader of the files written here.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::Path;
use std::process::Command;

use profile_generic::scaling::UnitKind;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::{MasterConfig, Ports};
use profile_sercos::master::event::{Event, Output};
use profile_sercos::port::Port;
use profile_sercos::wire::describe::NoNames;
use profile_sercos::wire::header::{Channel, Header, Phase};

use super::Side;
use super::reader::Reader;
use super::recorder::{Recorder, Settings};
use super::synth::Synthesizer;
use super::writer::Writer;
use crate::decode::{Options, decode};
use crate::engine::port::{EthernetPort, FRAME_MAX};
use crate::simulate::drives::{InProcessDrives, SIMULATED_MAC, drives};
use crate::sys::clock::KernelTime;

const CLIENT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 50_000);
const SERVER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 44_818);

/// The MST of a phase 0 MDT0 as a Bosch Rexroth soft master sends it, its CRC included (SERCOS III recording,
/// first frame: source address de:bc:6c:7c:a2:4f).
const SERCOS_HEADER: [u8; 20] = [
    0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F, 0x88, 0xCD, 0x20, 0x00, 0xF0,
    0x5E, 0xB0, 0x3A,
];

/// `ListIdentity`: command 0x63, no data, session 0, status 0, sender context "axisbrdg", options 0.
const LIST_IDENTITY: [u8; 24] = *b"\x63\0\0\0\0\0\0\0\0\0\0\0axisbrdg\0\0\0\0";

/// `RegisterSession`: command 0x65, 4 bytes of data, protocol version 1, options 0.
const REGISTER_SESSION: [u8; 28] = *b"\x65\0\x04\0\0\0\0\0\0\0\0\0axisbrdg\0\0\0\0\x01\0\0\0";

fn recording() -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), ["192.0.2.2", "in-process", "not used"], &[]).unwrap();
    let mut synth = Synthesizer::new();
    let mut time = 1_800_000_000_000_000_123;
    let mut frames = Vec::new();
    let mut emit = |frame: &[u8]| frames.push(frame.to_vec());
    synth.udp(CLIENT, SERVER, 0, &LIST_IDENTITY, &mut emit).unwrap();
    synth.tcp_open(CLIENT, SERVER, &mut emit);
    // One message in two pieces, then the answer: the analyser has to reassemble.
    synth.tcp_data(CLIENT, SERVER, &REGISTER_SESSION[..10], &mut emit);
    synth.tcp_data(CLIENT, SERVER, &REGISTER_SESSION[10..], &mut emit);
    synth.tcp_data(SERVER, CLIENT, &REGISTER_SESSION, &mut emit);
    synth.tcp_close(CLIENT, SERVER, &mut emit);
    for frame in frames {
        writer.frame(Side::North, KernelTime(time), &frame, None).unwrap();
        time += 1000;
    }
    let mut sercos = [0; 60];
    sercos[..20].copy_from_slice(&SERCOS_HEADER);
    sercos[20] = 1;
    writer.frame(Side::South(Port::One), KernelTime(time), &sercos, Some("first MDT")).unwrap();
    writer.statistics(Side::South(Port::One), KernelTime(time), 1, 0).unwrap();
    writer.finish().unwrap()
}

/// The fields of every frame, tab separated; `None` when tshark is not installed.
fn dissect(file: &Path, fields: &[&str]) -> Option<Vec<Vec<String>>> {
    let mut command = Command::new("tshark");
    command.args(["-n", "-r"]).arg(file).args(["-T", "fields"]);
    for check in ["ip.check_checksum", "udp.check_checksum", "tcp.check_checksum"] {
        command.args(["-o", &format!("{check}:TRUE")]);
    }
    for field in fields {
        command.args(["-e", field]);
    }
    columns(&mut command)
}

/// What tshark prints, a line a frame, split at the tabs; `None` when it is not installed.
pub(super) fn columns(command: &mut Command) -> Option<Vec<Vec<String>>> {
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "tshark is required in CI: {error}");
            println!("SKIPPED: tshark cannot be run: {error}");
            return None;
        }
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    Some(text.lines().map(|line| line.split('\t').map(str::to_owned).collect()).collect())
}

#[test]
fn tshark_reads_every_frame_without_complaint() {
    let path = std::env::temp_dir().join(format!("axisbridge-tshark-{}.pcapng", std::process::id()));
    std::fs::write(&path, recording()).unwrap();
    let frames = dissect(
        &path,
        &[
            "frame.interface_name",
            "frame.time_epoch",
            "frame.protocols",
            "enip.command",
            "ip.checksum.status",
            "udp.checksum.status",
            "tcp.checksum.status",
            "siii.mst.crc32",
            "frame.comment",
            "_ws.malformed",
            "tcp.analysis.flags",
        ],
    );
    std::fs::remove_file(&path).unwrap();
    let Some(frames) = frames else { return };
    let column = |index: usize| frames.iter().map(|frame| frame[index].as_str()).collect::<Vec<_>>();

    assert_eq!(frames.len(), 11);
    let mut names = ["north"; 11];
    names[10] = "sercos port 1";
    assert_eq!(column(0), names);
    assert_eq!(frames[0][1], "1800000000.000000123");
    assert_eq!(frames[10][1], "1800000000.000010123");
    assert_eq!(frames[0][2], "eth:ethertype:ip:udp:enip");
    assert_eq!(frames[10][2], "eth:ethertype:siii");
    // The message in two segments shows at its second one.
    assert_eq!(column(3), ["0x0063", "", "", "", "", "0x0065", "0x0065", "", "", "", ""]);
    // Status 1 is good.
    assert_eq!(column(4)[..10], ["1"; 10]);
    assert_eq!(frames[0][5], "1");
    assert_eq!(column(6)[1..10], ["1"; 9]);
    assert_eq!(frames[10][7], "0x3ab05ef0");
    assert_eq!(frames[10][8], "first MDT");
    assert_eq!(column(9), [""; 11], "malformed");
    assert_eq!(column(10), [""; 11], "faults in the stream");
}

/// Records a ring of two drives on its way to CP2, and tells how many frames it was.
fn record_a_ring(path: &Path) -> u64 {
    let settings = Settings { depth: 1 << 14, ..Settings::new(path) };
    let (recorder, mut taps) = Recorder::start(settings, 1).unwrap();
    let mut south =
        InProcessDrives::new(drives([(1, UnitKind::Rotary), (2, UnitKind::Rotary)], true), taps.pop());
    let mut master = Master::new(MasterConfig {
        ports: Ports::Both,
        stable_cycles: 10,
        ..MasterConfig::new(SIMULATED_MAC, 2_000_000)
    })
    .unwrap();
    master.set_target_phase(Phase::CP2);
    let (mut now, mut buffer, mut up) = (MonotonicTime::ZERO, [0; FRAME_MAX], false);
    while !up {
        now = master.wake_at().unwrap().max(now);
        while let Some(Output::Transmit { port, frame }) = master.poll(now) {
            assert!(south.send(now, port, frame));
        }
        while let Some((port, length)) = south.receive(&mut buffer) {
            master.handle_frame(now, port, &buffer[..length]).unwrap();
        }
        while let Some(event) = master.poll_event() {
            up |= matches!(event, Event::AwaitingApplication { .. });
        }
    }
    let summary = recorder.finish().unwrap();
    assert_eq!(summary.dropped, 0);
    summary.frames
}

#[test]
fn each_sercos_port_is_an_interface_of_its_own() {
    let path = std::env::temp_dir().join(format!("axisbridge-tshark-ring-{}.pcapng", std::process::id()));
    let count = record_a_ring(&path);
    // Frames by interface and channel, as this reader sees them and as tshark does.
    let [mut ours, mut theirs] = [const { BTreeMap::<(String, String), u64>::new() }; 2];
    let mut reader = Reader::open(&path).unwrap();
    while let Some(frame) = reader.next_frame().unwrap() {
        let channel = match Header::parse(frame.data).unwrap().telegram.channel() {
            Channel::Primary => "0",
            Channel::Secondary => "1",
        };
        *ours.entry((frame.interface_name.unwrap().to_owned(), channel.to_owned())).or_default() += 1;
    }
    let ports = ["sercos port 1", "sercos port 2"];
    // In a ring each telegram goes out on one port and comes in on the other.
    let each = count / 4;
    let rows = ports.into_iter().flat_map(|port| ["0", "1"].map(|channel| (port, channel)));
    let rows: BTreeMap<_, _> = rows.map(|(port, channel)| ((port.into(), channel.into()), each)).collect();
    assert!(each > 200 && ours == rows, "{ours:?}");
    // What slaves answer on one port explains the telegrams of both.
    let mut text = Vec::new();
    decode(Reader::open(&path).unwrap(), &Options::default(), &NoNames, &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let frames: Vec<&str> = text.split("frame ").skip(1).collect();
    for port in ports {
        let named = |frame: &&&str| frame.contains(&format!("on {port} "));
        let steps = frames.iter().filter(named).filter(|frame| frame.contains("S-0-1000"));
        assert!(steps.count() > 4, "the service channel is seen on {port}");
    }
    assert!(!text.contains("not readable"));
    let dissected = dissect(&path, &["frame.interface_name", "siii.channel", "_ws.malformed"]);
    std::fs::remove_file(&path).unwrap();
    for frame in dissected.iter().flatten() {
        assert_eq!(frame[2], "");
        *theirs.entry((frame[0].clone(), frame[1].clone())).or_default() += 1;
    }
    assert!(dissected.is_none() || theirs == rows, "{theirs:?}");
}
