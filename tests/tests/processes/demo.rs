//! The demonstration as a user runs it, and its recording as tshark reads it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use axisbridge::capture::can::LINK_TYPE_CAN;
use axisbridge::capture::reader::{LINK_TYPE_ETHERNET, Reader};
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::{Running, axisbridge};
use axisbridge_tests::tshark::Frame;
use axisbridge_tests::{expected, peer, tshark};
use profile_cia402::wire::{Function, NodeId};
use profile_generic::can::Id;

/// Runs the demo for `seconds` with its own loopback addresses and returns its JSON object and its recording.
fn demo(seconds: u32, listen: &str, name: &str, more: &[&str]) -> (serde_json::Value, PathBuf) {
    let capture = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.pcapng"));
    let output = Command::new(axisbridge())
        .args(["demo", "--json", "--seconds", &seconds.to_string(), "--listen", listen, "--capture"])
        .arg(&capture)
        .args(more)
        .output()
        .expect("the demo can be started");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "the demo ended with {}: {errors}", output.status);
    assert_eq!(errors, "", "a demo that is not on a terminal keeps quiet");
    let result = serde_json::from_slice(&output.stdout).expect("--json prints one JSON object");
    (result, capture)
}

#[test]
fn both_axes_reach_their_targets_and_tshark_agrees_on_every_frame() {
    let name = "both_axes_reach_their_targets_and_tshark_agrees_on_every_frame";
    in_real_time(name, || both_axes_reach_their_targets(name));
}

fn both_axes_reach_their_targets(name: &str) {
    let (result, capture) = demo(3, "127.0.0.34", "demo-tshark", &[]);
    has_moved(&result);
    if peer::tshark_or_skip(name) {
        judge(&capture);
    }
}

/// A PLC moves the same axes through assemblies: on the network there is a class 1 connection and no CIP Motion.
#[test]
fn a_plc_moves_both_axes_through_assemblies_and_tshark_reads_the_connection() {
    let name = "a_plc_moves_both_axes_through_assemblies_and_tshark_reads_the_connection";
    in_real_time(name, || {
        let (result, capture) = demo(3, "127.0.0.37", "demo-assembly", &["--north", "assembly"]);
        has_moved(&result);
        if peer::tshark_or_skip(name) {
            let frames = tshark::dissect(&capture, "udp.port == 2222", &[]);
            assert!(frames.len() > 400, "{} frames", frames.len());
            assert!(frames.iter().all(|frame| !frame.has("cipm") && !frame.has("_ws.malformed")));
            let in_run = tshark::dissect(&capture, "cip.32bitheader.run_idle == 1", &[]);
            assert!(in_run.len() > 200, "{} frames in run", in_run.len());
            let opens = tshark::dissect(&capture, "cip.cm.otrpi && cip.rr == 0", &[]);
            assert_eq!(opens.len(), 1, "one connection");
        }
    });
}

#[test]
fn an_assembly_demo_has_the_time_of_the_host() {
    let mut command = Command::new(axisbridge());
    command.args(["demo", "--north", "assembly", "--time", "ptp"]);
    let output = command.output().expect("the demo can be started");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && errors.contains("expected --time host"), "{errors}");
}

/// Each axis of the result was asked to move, and did.
fn has_moved(result: &serde_json::Value) {
    let axes = result["axes"].as_array().expect("an array `axes`");
    assert_eq!(axes.len(), 2);
    for axis in axes {
        let number = |key: &str| axis[key].as_f64().unwrap_or_else(|| panic!("{key} in {axis}"));
        let (target, reached) = (number("target"), number("reached"));
        assert!(target.abs() > 1.0, "the axis is asked to move: {axis}");
        assert!((target - reached).abs() < 0.01, "the axis reached its target: {axis}");
        // A servo behind a bus lags: an axis that follows without any error did not move on real set-points.
        let following = number("max_following_error");
        assert!(following > 0.0 && following < 1.0, "a drive lags, but not far: {axis}");
        assert!(number("cycles") > 200.0, "{axis}");
        assert!(axis["lost_updates"].is_u64() && axis["late_updates"].is_u64(), "{axis}");
    }
}

/// Grandmaster, controller and gateway as three clocks: the axes only move if Group_Sync finds the same grandmaster and no skew.
#[test]
#[ignore = "twenty seconds; namespaces/synchronous.rs has the same with each part in a process"]
fn three_clocks_move_both_axes() {
    let name = "three_clocks_move_both_axes";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let capture = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("demo-three-clocks.pcapng");
    let demo = |more: &[&str]| {
        let mut command = Command::new(axisbridge());
        command.args(["demo", "--json", "--seconds", "2", "--time", "ptp", "--capture"]).arg(&capture);
        command.args(more).output().expect("the demo can be started")
    };
    in_real_time(name, || {
        let output = demo(&[]);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "the demo ended with {}: {errors}", output.status);
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        let axes = result["axes"].as_array().expect("an array `axes`");
        assert_eq!(axes.len(), 2);
        for axis in axes {
            assert!(axis["in_window"] == true && axis["target"].as_f64().unwrap() > 1.0, "{axis}");
        }
    });
    let refused = demo(&["--listen", "127.0.0.9"]);
    let errors = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && errors.contains("expected no --listen"), "{errors}");
}

/// Every frame of the recording, as tshark reads it, against what was meant.
fn judge(capture: &Path) {
    let raw = frames(capture);
    let cip = tshark::dissect(capture, "udp.port == 2222", &[]);
    assert!(cip.len() > 400, "class 1 data of both directions were recorded: {}", cip.len());
    for frame in &cip {
        assert!(frame.has("cipm"), "frame {} is CIP Motion: {:?}", frame.number, frame.protocols);
        assert!(frame.field("cipm.data").is_none(), "frame {} has no surplus data", frame.number);
        let bytes = &raw[frame.number - 1].1;
        let wanted = expected::cip_motion(bytes).unwrap_or_else(|| panic!("frame {} parses", frame.number));
        compare(frame, &wanted);
    }
    let mut phases = BTreeSet::new();
    let mut kinds = BTreeMap::<(u8, u8), Vec<usize>>::new();
    let mut telegrams = 0;
    for (index, (_, bytes)) in raw.iter().enumerate().filter(|(_, frame)| is_sercos(frame)) {
        telegrams += 1;
        phases.insert(bytes[15] & 0x8F);
        // A few telegrams of each kind in each phase, out and back: all of them would be a gigabyte of PDML.
        let sample = kinds.entry((bytes[14], bytes[15] & 0x8F)).or_default();
        if sample.len() < 6 {
            sample.push(index + 1);
        }
    }
    assert!(telegrams > 1000, "SERCOS telegrams were recorded: {telegrams}");
    let numbers: Vec<String> = kinds.values().flatten().map(ToString::to_string).collect();
    let sercos = tshark::dissect(capture, &format!("frame.number in {{{}}}", numbers.join(",")), &[]);
    assert_eq!(sercos.len(), numbers.len());
    for frame in &sercos {
        assert!(frame.has("siii"), "frame {} is SERCOS III: {:?}", frame.number, frame.protocols);
        compare(frame, &expected::sercos(&raw[frame.number - 1].1));
    }
    // CP0 to CP4 and the switch telegrams to each of CP1 to CP4.
    for phase in [0, 1, 2, 3, 4, 0x81, 0x82, 0x83, 0x84] {
        assert!(phases.contains(&phase), "phase byte {phase:#04x} was recorded: {phases:x?}");
    }
    judge_can(capture, &raw);
    // tshark calls each phase-switch telegram an unknown phase, those of a foreign master too. Nothing else may be found.
    let mut findings = BTreeMap::<String, Vec<usize>>::new();
    for (number, message) in tshark::warnings(capture) {
        let frame = &raw[number - 1];
        let switching = is_sercos(frame) && frame.1[15] & 0x80 != 0;
        if !(switching && message.contains("CP is unknown")) {
            findings.entry(message).or_default().push(number);
        }
    }
    assert!(findings.is_empty(), "tshark finds fault: {findings:?}");
}

/// The CANopen frames of a recording: what they are and of whom, as tshark reads them and as we do.
fn judge_can(capture: &Path, raw: &[(u16, Vec<u8>)]) {
    let told = |frame: &Frame| {
        let number = |name| frame.field(name).and_then(|field| field.show.strip_prefix("0x"));
        let number = |name| u32::from_str_radix(number(name).unwrap_or("0"), 16).expect("a number");
        (number("canopen.function_code"), number("canopen.node_id"))
    };
    // The boot of the node, and two seconds of its operation: all of it would take tshark half a minute.
    let can: Vec<_> = raw.iter().enumerate().filter(|(_, (link, _))| *link == LINK_TYPE_CAN).collect();
    assert!(can.len() > 2_000, "CAN frames were recorded: {}", can.len());
    let last = can[2_000].0 + 1;
    let tshark = tshark::dissect(capture, &format!("can and frame.number <= {last}"), &[]);
    assert_eq!(tshark.len(), 2_001);
    let mut kinds = Vec::new();
    for (frame, (index, (_, bytes))) in tshark.iter().zip(&can) {
        assert_eq!(frame.number, index + 1);
        let identifier = u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        assert!(frame.has("canopen"), "frame {}: {:?}", frame.number, frame.protocols);
        assert_eq!(told(frame), (identifier >> 7, identifier & 0x7F), "frame {}", frame.number);
        let id = Id::Standard(u16::try_from(identifier).expect("a standard identifier"));
        kinds.push(Function::of(id).expect("CANopen"));
    }
    let node = NodeId::new(2).expect("a node");
    let sdo = [Function::SdoRequest(node), Function::SdoResponse(node)];
    let pdo = [Function::Rpdo(1, node), Function::Tpdo(1, node)];
    for kind in sdo.iter().chain(&pdo).chain(&[Function::Nmt, Function::Sync, Function::ErrorControl(node)]) {
        assert!(kinds.contains(kind), "{kind}");
    }
}

fn is_sercos((link, bytes): &(u16, Vec<u8>)) -> bool {
    *link == LINK_TYPE_ETHERNET && bytes[12..14] == [0x88, 0xCD]
}

fn compare(frame: &Frame, wanted: &[expected::Expected]) {
    for (name, position, bytes) in wanted {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let found = frame.all(name).any(|field| field.position == *position && field.value == hex);
        let shown: Vec<_> = frame.all(name).collect();
        assert!(found, "frame {}: expected {name} = {hex} at {position}, tshark has {shown:?}", frame.number);
    }
}

/// All frames of a recording, each with the type of its link.
fn frames(capture: &Path) -> Vec<(u16, Vec<u8>)> {
    let mut reader = Reader::open(capture).expect("our own recording opens");
    let mut frames = Vec::new();
    while let Some(frame) = reader.next_frame().expect("our own recording reads") {
        frames.push((frame.link_type, frame.data.to_vec()));
    }
    frames
}

#[test]
fn an_address_in_use_is_said_with_what_to_do() {
    let blocker = std::net::TcpListener::bind("127.0.0.35:44818").expect("the test's own address is free");
    let mut command = Command::new(axisbridge());
    command.args(["demo", "--json", "--seconds", "1", "--listen", "127.0.0.35"]).stdout(Stdio::piped());
    command.stderr(Stdio::piped());
    let output = command.output().expect("the demo can be started");
    drop(blocker);
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("127.0.0.35:44818") && errors.contains("--listen"), "{errors}");
}

#[test]
fn wrong_usage_ends_with_status_2() {
    for arguments in [&["demo", "--seconds", "0"][..], &["demo", "--listen", "nowhere"], &["fly"], &[]] {
        let mut command = Command::new(axisbridge());
        command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        let status = Running::start("axisbridge", &mut command).wait(Duration::from_secs(10));
        assert_eq!(status.code(), Some(2), "axisbridge {arguments:?}");
    }
}
