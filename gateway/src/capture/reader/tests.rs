use std::fmt::Write as _;

use profile_sercos::port::Port;
use proptest::prelude::*;

use super::*;
use crate::capture::Side;
use crate::capture::writer::Writer;

fn written() -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), ["192.0.2.1", "in-process", "not used"], &[]).unwrap();
    writer.frame(Side::North, KernelTime(1_800_000_000_000_000_007), &[1; 61], None).unwrap();
    writer
        .frame(Side::South(Port::One), KernelTime(1_800_000_000_001_000_000), &[2; 60], Some("phase 2"))
        .unwrap();
    writer.statistics(Side::South(Port::One), KernelTime(1_800_000_000_002_000_000), 1, 0).unwrap();
    writer.frame(Side::North, KernelTime(1_800_000_000_003_000_000), &[], None).unwrap();
    writer.finish().unwrap()
}

/// All frames of a file as text, then the error it ends with, if any.
fn listing(file: &[u8]) -> String {
    let mut text = String::new();
    let mut reader = match Reader::new(file) {
        Ok(reader) => reader,
        Err(error) => return format!("error: {error}\n"),
    };
    loop {
        match reader.next_frame() {
            Ok(None) => return text,
            Ok(Some(frame)) => {
                let at = frame.at.map(|at| at.0);
                writeln!(
                    text,
                    "{} at {at:?} on {} {:?} link {} len {}/{} {:02x?} {:?}",
                    frame.number,
                    frame.interface,
                    frame.interface_name,
                    frame.link_type,
                    frame.data.len(),
                    frame.original_len,
                    frame.data.first(),
                    frame.comment
                )
                .unwrap();
            }
            Err(error) => {
                writeln!(text, "error: {error}").unwrap();
                return text;
            }
        }
    }
}

#[test]
fn what_the_writer_wrote_is_read() {
    assert_eq!(
        listing(&written()),
        "1 at Some(1800000000000000007) on 0 Some(\"north\") link 1 len 61/61 Some(01) None\n\
         2 at Some(1800000000001000000) on 1 Some(\"sercos port 1\") link 1 len 60/60 Some(02) Some(\"phase 2\")\n\
         3 at Some(1800000000003000000) on 0 Some(\"north\") link 1 len 0/0 None None\n"
    );
}

fn pcap(magic: [u8; 4], big: bool, fraction: u32) -> Vec<u8> {
    let u32 = |value: u32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    let u16 = |value: u16| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    let mut file = magic.to_vec();
    file.extend(u16(2));
    file.extend(u16(4));
    for value in [0, 0, 65_535, 1, 1_700_000_000, fraction, 3, 64] {
        file.extend(u32(value));
    }
    file.extend([0xAA, 0xBB, 0xCC]);
    file
}

#[test]
fn pcap_is_read_in_both_byte_orders_and_resolutions() {
    for (magic, big, at) in [
        ([0xA1, 0xB2, 0xC3, 0xD4], true, 1_700_000_000_000_005_000_u64),
        ([0xA1, 0xB2, 0x3C, 0x4D], true, 1_700_000_000_000_000_005),
        ([0xD4, 0xC3, 0xB2, 0xA1], false, 1_700_000_000_000_005_000),
        ([0x4D, 0x3C, 0xB2, 0xA1], false, 1_700_000_000_000_000_005),
    ] {
        let expected = format!("1 at Some({at}) on 0 None link 1 len 3/64 Some(aa) None\n");
        assert_eq!(listing(&pcap(magic, big, 5)), expected);
    }
}

fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let length = u32::try_from(body.len() + 12).unwrap().to_be_bytes();
    [&kind.to_be_bytes()[..], &length, body, &length].concat()
}

fn section() -> Vec<u8> {
    block(blocks::SECTION, &[0x1A, 0x2B, 0x3C, 0x4D, 0, 1, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255])
}

#[test]
fn units_of_time_and_simple_and_obsolete_packets_in_big_endian() {
    let mut file = section();
    // Link type, reserved, snap length 4; no options: microseconds.
    file.extend(block(blocks::INTERFACE, &[0, 1, 0, 0, 0, 0, 0, 4]));
    // 2^-10 s, starting at 5 s.
    file.extend(block(
        blocks::INTERFACE,
        &[0, 113, 0, 0, 0, 0, 0, 0, 0, 9, 0, 1, 0x8A, 0, 0, 0, 0, 14, 0, 8, 0, 0, 0, 0, 0, 0, 0, 5],
    ));
    // Simple packet: six bytes long, cut to the snap length.
    file.extend(block(blocks::SIMPLE, &[0, 0, 0, 6, 9, 8, 7, 6]));
    let fields = [0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 2, 0, 0, 0, 2, 0xAB, 0xCD, 0, 0];
    file.extend(block(blocks::ENHANCED, &[&[0, 0, 0, 1], &fields[..]].concat()));
    file.extend(block(blocks::PACKET_OBSOLETE, &[&[0, 0, 0, 7], &fields[..]].concat()));
    file.extend(block(99, &[1, 2, 3, 4]));
    assert_eq!(
        listing(&file),
        "1 at None on 0 None link 1 len 4/6 Some(09) None\n\
         2 at Some(6000000000) on 1 None link 113 len 2/2 Some(ab) None\n\
         3 at Some(1024000) on 0 None link 1 len 2/2 Some(ab) None\n"
    );
}

#[test]
fn errors_say_where_and_what() {
    let good_interface = block(blocks::INTERFACE, &[0, 1, 0, 0, 0, 0, 0, 0]);
    let enhanced = |id: u8, captured: [u8; 4]| {
        let mut body = vec![0; 24];
        body[3] = id;
        body[12..16].copy_from_slice(&captured);
        block(blocks::ENHANCED, &body)
    };
    let mut wrong_trailer = block(99, &[0; 4]);
    wrong_trailer[15] = 20;
    let mut long_frame = pcap([0xA1, 0xB2, 0xC3, 0xD4], true, 0);
    long_frame[32..36].copy_from_slice(&[0, 4, 0, 1]);
    let mut old = pcap([0xA1, 0xB2, 0xC3, 0xD4], true, 0);
    old[5] = 1;
    let cases: &[(&[u8], &str)] = &[
        (b"", "not a pcap or pcapng file: it begins with 00 00 00 00"),
        (b"GIF89a", "not a pcap or pcapng file: it begins with 47 49 46 38"),
        (&old, "offset 4: the major version is 0x1, expected 2"),
        (&long_frame, "offset 24: the captured length is 262145, expected at most 262144"),
        (
            &[section(), enhanced(0, [0; 4])].concat(),
            "offset 28: the packet is of interface 0, and 0 interfaces are described before it",
        ),
        (
            &[section(), good_interface.clone(), enhanced(0, [0, 0, 0, 5])].concat(),
            "offset 48: the captured length is 5, expected no more than the block holds",
        ),
        (
            &[section(), wrong_trailer].concat(),
            "offset 28: the length at the end of the block is 20, expected the same as at its beginning",
        ),
        (
            &[section(), vec![0, 0, 0, 9, 0, 0, 0, 13]].concat(),
            "offset 28: the block's length is 13, expected a multiple of 4 from 12 (28 for a section header) to 16777216",
        ),
        (
            &[section(), vec![0, 0, 0, 9, 1, 0, 0, 0]].concat(),
            "offset 28: the file ends in the middle of a block: 16777208 bytes expected, 0 left",
        ),
        (
            &[section(), block(blocks::INTERFACE, &[0, 1, 0, 0, 0, 0, 0, 0, 0, 9, 0, 1, 20, 0, 0, 0])]
                .concat(),
            "offset 28: the resolution of time stamps is 0x14, expected at most 19 decimal or 64 binary digits",
        ),
        (
            &[section(), block(blocks::INTERFACE, &[0, 1, 0, 0])].concat(),
            "offset 28: the file ends in the middle of an interface description: 8 bytes expected, 4 left",
        ),
    ];
    for (file, expected) in cases {
        assert_eq!(listing(file), format!("error: {expected}\n"));
    }
}

#[test]
fn a_file_cut_anywhere_gives_its_whole_frames_and_then_an_error_or_the_end() {
    let whole = written();
    let all = listing(&whole);
    let mut ends = 0;
    for length in 0..whole.len() {
        let text = listing(&whole[..length]);
        let frames: Vec<&str> = text.lines().filter(|line| !line.starts_with("error")).collect();
        assert!(
            all.starts_with(&frames.iter().fold(String::new(), |text, line| text + line + "\n")),
            "{length}"
        );
        ends += usize::from(frames.len() == text.lines().count());
    }
    // Clean ends: after the section header, three interfaces, two packets, the statistics.
    assert_eq!(ends, 7);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn no_bytes_make_it_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..200), magic in 0..6_usize) {
        let starts: [&[u8]; 6] = [
            &[0xA1, 0xB2, 0xC3, 0xD4, 0, 2],
            &[0x4D, 0x3C, 0xB2, 0xA1, 2, 0],
            &section(),
            &[0x0A, 0x0D, 0x0D, 0x0A],
            &[],
            &written()[..200],
        ];
        bytes.splice(0..0, starts[magic].iter().copied());
        listing(&bytes);
    }

    #[test]
    fn one_changed_byte_does_not_make_it_panic(at in 0..usize::MAX, value: u8) {
        let mut file = written();
        let index = at % file.len();
        file[index] = value;
        listing(&file);
    }
}
