//! Every frame of a foreign master's start-up is parsed into values and rebuilt from them, byte for byte: all 5944 of
//! them, from the first telegram of CP0 to cyclic data in CP4.
//!
//! `SERCOS_RECORDING=FILE` runs the same test on another recording with the same telegram layout.

mod support;

use profile_sercos::wire::describe::{DecodeContext, describe};
use profile_sercos::wire::header::{Header, Kind, Phase};
use profile_sercos::wire::layout::{ConnectionLayout, DeviceLayout, Layout, Offset};
use profile_sercos::wire::telegram::{Body, Frame, PhaseTracker};

/// The layout which the recording's master writes in CP2: S-0-1009 to S-0-1014 and S-0-1050.x.3.
fn layout() -> Layout {
    let device = |address: u16, words: [u16; 4], connections: [(u16, u16); 2]| {
        let place = |word| Some(Offset::from_parameter(word));
        let connection = |index: u8, (assignment, len)| {
            let (kind, at) = Offset::from_assignment(assignment);
            ConnectionLayout { index, kind, at, len }
        };
        DeviceLayout {
            address,
            device_control: place(words[0]),
            device_status: place(words[1]),
            svc_mdt: place(words[2]),
            svc_at: place(words[3]),
            connections: vec![connection(0, connections[0]), connection(1, connections[1])],
        }
    };
    Layout {
        mdt_len: [46, 0, 0, 0],
        at_len: [48, 0, 0, 0],
        extended: false,
        devices: vec![
            device(1, [26, 20, 14, 8], [(0x081E, 8), (0x0018, 12)]),
            device(2, [28, 22, 20, 14], [(0x0826, 8), (0x0024, 12)]),
        ],
    }
}

#[test]
fn every_frame_comes_back_byte_for_byte() {
    let frames = support::whole();
    let layout = layout();
    let mut context = DecodeContext::default();
    let mut tracker = PhaseTracker::default();
    let mut counts = std::collections::BTreeMap::<(Phase, bool, String), u32>::new();
    for (index, (_, bytes)) in frames.iter().enumerate() {
        describe(bytes, &mut context);
        let header = Header::parse(bytes).unwrap_or_else(|error| panic!("frame {}: {error}", index + 1));
        let phase = tracker.layout_phase(&header);
        let frame = Frame::parse(bytes, phase, &layout)
            .unwrap_or_else(|error| panic!("frame {} in {phase}: {error}", index + 1));
        assert!(frame.trailer.is_empty());
        let shape = match (&frame.body, header.telegram.kind()) {
            (Body::Cp0Mdt(_), Kind::Mdt) | (Body::Cp0At(_), Kind::At) => "scan",
            (Body::Cp12(_), _) => "slots",
            (Body::Cyclic(repr), _) => {
                // Hot-plug, two slots, two words, two connections; in the MDT a gap for the extended field.
                assert_eq!(repr.parts.len(), 7 + usize::from(header.telegram.kind() == Kind::Mdt));
                "cyclic"
            }
            (body, kind) => panic!("frame {}: {kind} read as {body:?}", index + 1),
        };
        let mut again = vec![0xA5; bytes.len()];
        frame.emit(&mut again).unwrap();
        assert_eq!(&again, bytes, "frame {}", index + 1);
        let key = (phase, header.phase.switching(), format!("{} {shape}", header.telegram));
        *counts.entry(key).or_default() += 1;
    }
    // The places are those which the master told its slaves in this recording.
    assert_eq!(context.layout(), &layout);
    let table: String = counts
        .iter()
        .map(|((phase, switching, what), count)| {
            format!("{phase}{} {what}: {count}\n", if *switching { " switching" } else { "" })
        })
        .collect();
    println!("{} frames\n{table}", frames.len());
    if std::env::var_os("SERCOS_RECORDING").is_none() {
        insta::assert_snapshot!(table);
    }
}
