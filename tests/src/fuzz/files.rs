//! Files that people and other programs write: configurations, tables, scripts, recordings, lists of frames; and the registers
//! that a Modbus client asks for.

use std::fmt::Write as _;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::{Arc, LazyLock};

use axisbridge::capture::reader::Reader;
use axisbridge::capture::synth::Synthesizer;
use axisbridge::capture::writer::Writer;
use axisbridge::capture::{FRAME_LEN_MAX, Side};
use axisbridge::config::Config;
use axisbridge::decode::{Options, decode as decode_recording};
use axisbridge::engine::build::build;
use axisbridge::finding::{FINDINGS_MAX, Findings};
use axisbridge::mapping::{Mapping, Overlay, TableTexts, check};
use axisbridge::modbus::map::{COUNT_MAX, MAP_LEN, registers};
use axisbridge::simulate::script::Script;
use axisbridge::status::BoxStatus;
use axisbridge::sys::clock::KernelTime;
use axisbridge::translate::{RowNames, Stage, translate_list};
use profile_cip::controller::Controller;
use profile_cip::wire::encapsulation::{EXPLICIT_PORT, IO_PORT};
use profile_sercos::port::Port;
use profile_sercos::wire::describe::NoNames;

use super::conversation::Bytes;
use crate::can_frames;
use crate::rig::HOST;

static MAPPING: LazyLock<Mapping> =
    LazyLock::new(|| Mapping::embedded().expect("the shipped tables are sound"));

/// Findings stand in the text and are not endless, however broken it is.
fn assert_findings(findings: &Findings, text: &str) {
    assert!(findings.list().len() <= FINDINGS_MAX);
    let lines = text.lines().count() + 1;
    for finding in findings.list() {
        assert!(finding.line <= lines, "line {} of {lines}: {finding}", finding.line);
    }
    let shown = findings.to_string().len();
    assert!(shown <= (findings.list().len() + 1) * (4_000 + 4 * text.len()), "{shown} bytes of findings");
}

/// A configuration that is sound makes a box, or the reason is told.
pub fn config(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Config::parse(&text, "fuzz.toml") {
        Ok(config) => drop(build(&config, MAPPING.clone(), HOST).map_err(|error| error.to_string())),
        Err(findings) => {
            assert!(!findings.is_empty());
            assert_findings(&findings, &text);
        }
    }
}

/// Rows laid over the shipped tables. Tables that can be resolved can be checked and run their examples.
pub fn overlay(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut texts = TableTexts::embedded();
    texts.overlays.push(Overlay::new("fuzz.toml", &text));
    let mut findings = Findings::default();
    if let Some(mapping) = Mapping::resolve(&texts, &mut findings) {
        mapping.run_examples(&mut findings);
        check::tables(&mapping, &mut findings);
    }
    assert!(findings.list().len() <= FINDINGS_MAX);
}

/// A script that is sound is one that a controller takes.
pub fn script(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Script::parse(&text, "fuzz.toml", &MAPPING) {
        Ok(script) => {
            assert_eq!(script.titles.len(), script.steps.len());
            Controller::new(script.config, script.steps).expect("a checked script");
        }
        Err(findings) => assert_findings(&findings, &text),
    }
}

/// Recordings, pcap and pcapng.
pub fn capture(data: &[u8]) {
    let Ok(mut reader) = Reader::new(data) else { return };
    let mut number = 0;
    while let Ok(Some(frame)) = reader.next_frame() {
        number += 1;
        assert_eq!(frame.number, number);
        assert!(frame.data.len() < data.len(), "a frame has no bytes that the file has not");
        assert!(number <= data.len() as u64 / 8, "a frame has a head");
    }
    // What is broken cannot be decoded either, and says so.
    let mut text = Vec::new();
    let _ = decode_recording(
        Reader::new(data).expect("it was read before"),
        &Options::default(),
        &NoNames,
        &mut text,
    );
    assert!(text.len() <= 10_000 + 1_000 * data.len(), "{} bytes of text", text.len());
}

const CONTROLLER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 1);
const DEVICE: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 9);

/// What is seen on networks: a byte that says where, then a CAN frame, or a length of two bytes and an Ethernet frame, a datagram, or
/// a part of a stream of EtherNet/IP.
pub fn decode(data: &[u8]) {
    let (mut bytes, mut synth) = (Bytes::new(data), Synthesizer::new());
    let mut writer = Writer::new(Vec::new(), [""; 3], &["", ""]).expect("memory takes it");
    let at = KernelTime(0);
    let mut seen = 0;
    while !bytes.is_over() {
        let place = bytes.byte() % 8;
        if place < 2 {
            let Some(frame) = bytes.frame() else { continue };
            writer.can_frame(place, at, &frame, None).expect("memory takes it");
            seen += 1;
            continue;
        }
        let len = usize::from(bytes.word()).min(FRAME_LEN_MAX - 60);
        let payload = bytes.take(len);
        let mut frame = |frame: &[u8]| {
            writer.frame(Side::North, at, frame, None).expect("memory takes it");
            seen += 1;
        };
        let explicit = SocketAddrV4::new(DEVICE, EXPLICIT_PORT);
        let (io, client) = (SocketAddrV4::new(DEVICE, IO_PORT), SocketAddrV4::new(CONTROLLER, 50_000));
        let controller = SocketAddrV4::new(CONTROLLER, IO_PORT);
        match place {
            2 => synth.udp(controller, io, 0, payload, &mut frame).expect("short enough"),
            3 => synth.udp(io, controller, 0, payload, &mut frame).expect("short enough"),
            4 => synth.tcp_data(client, explicit, payload, &mut frame),
            5 => synth.tcp_data(explicit, client, payload, &mut frame),
            6 => frame(payload),
            _ => {
                writer.frame(Side::South(Port::One), at, payload, None).expect("memory takes it");
                seen += 1;
            }
        }
    }
    let file = writer.finish().expect("memory takes it");
    let reader = Reader::new(&file[..]).expect("our own file");
    let mut text = Vec::new();
    let summary = decode_recording(reader, &Options::default(), &NoNames, &mut text).expect("our own file");
    assert_eq!((summary.frames, summary.printed, summary.cut), (seen, seen, false));
    assert!(core::str::from_utf8(&text).is_ok());
    assert!(text.len() <= 10_000 + 1_000 * (data.len() + file.len()), "{} bytes of text", text.len());
}

static STAGE: LazyLock<Arc<Stage>> =
    LazyLock::new(|| Arc::new(can_frames::stage(MAPPING.clone()).expect("its drives have programs")));

/// Lists of frames, translated by the shipped tables.
pub fn translate(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match translate_list(&STAGE, &text) {
        Ok(list) => {
            let mut shown = String::new();
            for frame in &list.frames {
                frame.write(&mut shown, 0, RowNames::Keys).expect("a string takes it");
            }
            assert!(
                shown.len() <= 10_000 + 40_000 * (list.frames.len() + 1),
                "{} bytes of text",
                shown.len()
            );
        }
        Err(error) => {
            assert!(error.line <= text.lines().count());
            let mut shown = String::new();
            write!(shown, "{error}").expect("a string takes it");
            assert!(shown.len() <= 1_000 + text.len());
        }
    }
}

/// Registers that a Modbus client asks for: an address and a count.
pub fn modbus(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (address, count) = (bytes.word(), bytes.word());
    let found = registers(&BoxStatus::STARTING, address, count);
    let last = u32::from(address) + u32::from(count);
    let there = (1..=COUNT_MAX).contains(&count) && last <= u32::from(MAP_LEN);
    assert_eq!(found.map(|values| values.len()).ok(), there.then_some(usize::from(count)));
}
