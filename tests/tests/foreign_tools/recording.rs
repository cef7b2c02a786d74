//! A foreign master's recording through the decoder of `axisbridge decode`: what a maintainer reads.

use std::path::Path;

use axisbridge::capture::reader::Reader;
use axisbridge::decode::{Options, decode};
use axisbridge::mapping::{Mapping, SercosDictionary};
use profile_sercos::wire::describe::Names;
use profile_sercos::wire::idn::Idn;

const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/captures/sercos3_startup_line2_part.pcap");

/// Frames of this part of the recording.
const FRAMES: usize = 674;

/// Offsets of telegram type and phase in an Ethernet frame, table 4 of the telegram header.
const TYPE: usize = 14;
const PHASE: usize = 15;

/// Lines of the service channel that the snapshot shows.
const EXCERPT: usize = 150;

struct Dictionary<'a>(&'a SercosDictionary);

impl Names for Dictionary<'_> {
    fn name(&self, idn: Idn) -> Option<&str> {
        self.0.idn(idn.with_structure(0, idn.element())).map(|row| row.name.as_str())
    }

    fn length(&self, idn: Idn) -> Option<usize> {
        self.0.idn(idn).filter(|row| !row.list)?.length.map(usize::from)
    }
}

/// The text of each frame.
fn printed() -> Vec<String> {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let mut out = Vec::new();
    let reader = Reader::open(Path::new(RECORDING)).expect("the recording opens");
    let names = Dictionary(&mapping.dictionaries.sercos);
    let summary = decode(reader, &Options::default(), &names, &mut out).expect("the recording is decoded");
    assert_eq!((summary.frames, summary.printed, summary.cut), (674, 674, false));
    let text = String::from_utf8(out).expect("the tree is text");
    let mut frames = Vec::<String>::new();
    for line in text.lines() {
        if line.starts_with("frame ") {
            frames.push(String::new());
        }
        let frame = frames.last_mut().expect("a frame begins with its heading");
        frame.push_str(line);
        frame.push('\n');
    }
    frames
}

fn raw() -> Vec<Vec<u8>> {
    let mut reader = Reader::open(Path::new(RECORDING)).expect("the recording opens");
    let mut frames = Vec::new();
    while let Some(frame) = reader.next_frame().expect("the recording is read") {
        frames.push(frame.data.to_vec());
    }
    frames
}

#[test]
fn every_frame_shows_its_telegram_its_phase_and_a_good_checksum() {
    let printed = printed();
    let raw = raw();
    assert_eq!((printed.len(), raw.len()), (FRAMES, FRAMES));
    for (number, (text, bytes)) in (1..).zip(printed.iter().zip(&raw)) {
        // Bit 6 of the type tells AT from MDT, its low bits number the telegram; bit 7 of the phase
        // announces it.
        let kind = if bytes[TYPE] & 0x40 == 0 { "MDT" } else { "AT" };
        let telegram = bytes[TYPE] & 0x0F;
        let announced = if bytes[PHASE] & 0x80 == 0 { "" } else { "switching to " };
        let phase = bytes[PHASE] & 0x0F;
        let head = format!("  {kind}{telegram} P {announced}CP{phase} cycle ");
        let line = text.lines().nth(1).unwrap_or_default();
        assert!(line.starts_with(&head), "frame {number}: expected {head:?} in {line:?}");
        assert!(line.ends_with(&format!(", {} bytes, CRC ok", bytes.len())), "frame {number}: {line}");
        assert!(!text.contains("not readable") && !text.contains("BAD"), "frame {number}: {text}");
    }
}

#[test]
fn the_scan_shows_the_address_of_each_slave() {
    let addresses = |text: &&String| text.contains("AT0 P CP0 ") && text.contains("topology address");
    let frames = printed();
    let scans: Vec<_> = frames.iter().filter(addresses).collect();
    assert_eq!(scans.len(), 6, "the answers of CP0 as they came back");
    for text in scans {
        assert!(text.contains("    topology address 1: SERCOS address 1\n"), "{text}");
        assert!(text.contains("    topology address 2: SERCOS address 2\n"), "{text}");
    }
}

/// What the master does over the service channel of slave 1, with the answers, one line a step.
fn service_channel(frames: &[String]) -> Vec<String> {
    let mut lines = Vec::new();
    for frame in frames {
        let phase =
            frame.lines().nth(1).and_then(|line| line.split_whitespace().find(|word| word.starts_with("CP")));
        let mut slave = "";
        for line in frame.lines() {
            let text = line.trim_start();
            if text.starts_with("slave ") {
                slave = text;
            }
            let channel = text.starts_with("C-SVC") || text.starts_with("S-SVC");
            // What a step means stands behind the fields; a slot without a step has nothing there.
            if let Some((fields, meaning)) = text.split_once(": ")
                && channel
                && slave == "slave 1"
            {
                let side = if fields.starts_with('C') { "->" } else { "<-" };
                let step = format!("{} {side} {meaning}", phase.unwrap_or_default());
                if lines.last() != Some(&step) {
                    lines.push(step);
                }
            }
        }
    }
    lines
}

#[test]
fn the_service_channel_shows_parameter_and_element_of_each_step() {
    let lines = service_channel(&printed());
    insta::assert_snapshot!(lines[..EXCERPT].join("\n"));
}
