use std::net::SocketAddrV4;

use profile_cip::wire::class1::CLASS1_HEADER_LEN;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_generic::can::{Frame as CanFrame, Id};
use profile_sercos::wire::describe::NoNames;
use profile_sercos::wire::header::{Channel, Kind, PhaseField, TelegramType};

use super::*;
use crate::capture::Side;
use crate::capture::synth::Synthesizer;
use crate::capture::writer::Writer;
use crate::decode::tests::{actual_update, class1};
use crate::mapping::Mapping;
use crate::sys::clock::KernelTime;
use crate::translate::RowNames;

const BOX: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 2);
const OTHER: Ipv4Addr = Ipv4Addr::new(192, 0, 2, 9);

/// An update for the turntable, to a quarter of a turn.
const UPDATE: [u8; 28] =
    [6, 2, 7, 5, 1, 0, 0, 0, 1, 0, 5, 3, 3, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 4, 0x90, 0xD0, 3, 0];

fn config() -> Config {
    Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap()
}

fn writer() -> Writer<Vec<u8>> {
    Writer::new(Vec::new(), ["north", "none", "none"], &[]).unwrap()
}

/// An update with a sequence count at a time, to a device.
fn put(file: &mut Writer<Vec<u8>>, time_ms: u64, count: u16, device: Ipv4Addr) {
    let mut datagram = [0; CLASS1_HEADER_LEN + UPDATE.len()];
    let (header, data) = datagram.split_at_mut(CLASS1_HEADER_LEN);
    Class1Datagram::emit_header(77, count.into(), count, UPDATE.len(), header).unwrap();
    data.copy_from_slice(&UPDATE);
    let from = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), IO_PORT);
    let to = SocketAddrV4::new(device, IO_PORT);
    let at = KernelTime(1_000_000_000 + time_ms * 1_000_000);
    Synthesizer::new()
        .udp(from, to, 0, &datagram, &mut |frame| file.frame(Side::North, at, frame, None).unwrap())
        .unwrap();
}

/// A datagram at a time.
fn put_datagram(file: &mut Writer<Vec<u8>>, time_ms: u64, ends: (SocketAddrV4, SocketAddrV4), data: &[u8]) {
    let at = KernelTime(1_000_000_000 + time_ms * 1_000_000);
    Synthesizer::new()
        .udp(ends.0, ends.1, 0, data, &mut |frame| file.frame(Side::North, at, frame, None).unwrap())
        .unwrap();
}

/// The file with only the first bytes of packet `number`, counted from 0, recorded.
fn with_cut(file: &[u8], number: usize, len: u8) -> Vec<u8> {
    let mut packets = 0;
    let mut cut = Vec::new();
    for block in blocks(file) {
        let is_packet = block[0] == 6;
        if is_packet && packets == number {
            // Type, length, interface, time, recorded and original length, data, length again.
            let size = [28 + len.next_multiple_of(4) + 4, 0, 0, 0];
            let data = &block[28..28 + usize::from(len.next_multiple_of(4))];
            cut.extend(
                [&block[..4], &size, &block[8..20], &[len, 0, 0, 0], &block[24..28], data, &size].concat(),
            );
        } else {
            cut.extend(block);
        }
        packets += usize::from(is_packet);
    }
    cut
}

/// Everything that is written of a recording, with the demonstration's configuration.
fn everything(file: &[u8]) -> (String, Counts) {
    let config = config();
    let stage = Arc::new(Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap());
    let mut text = String::new();
    let captured =
        translate_capture(&stage, &config, Reader::new(file).unwrap(), &NoNames, u64::MAX, &mut |entry| {
            entry.tree.write(&mut text, 0, RowNames::Keys).unwrap();
            true
        });
    (text, captured.counts)
}

/// What is said, whatever it is beside the values; counts; and the error at the end.
fn translated(file: &[u8]) -> (String, Counts, Option<String>) {
    let config = config();
    let stage = Arc::new(Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap());
    let (mut said, mut values) = (String::new(), 0);
    let reader = Reader::new(file).unwrap();
    let Captured { counts, error, .. } =
        translate_capture(&stage, &config, reader, &NoNames, u64::MAX, &mut |entry| {
            if entry.tree.mark == Mark::None {
                let mut text = String::new();
                entry.tree.write(&mut text, 0, RowNames::Keys).unwrap();
                values += usize::from(text.contains("position_command 0.250000000 rev"));
            } else {
                said += &format!("{}\n", entry.tree.text);
            }
            true
        });
    assert_eq!(values, counts.translated, "each frame that counts has its values");
    (said, counts, error.map(|error| error.to_string()))
}

const fn counts(translated: usize, passed_over: usize, failed: usize) -> Counts {
    Counts { translated, passed_over, failed }
}

#[test]
fn a_recording_that_is_whole_says_nothing() {
    let mut file = writer();
    (1..=3).for_each(|count| put(&mut file, u64::from(count) * 2, count, BOX));
    assert_eq!(translated(&file.finish().unwrap()), (String::new(), counts(3, 0, 0), None));
}

#[test]
fn a_recording_cut_in_the_middle_is_translated_up_to_the_cut() {
    let mut file = writer();
    (1..=3).for_each(|count| put(&mut file, u64::from(count) * 2, count, BOX));
    let file = file.finish().unwrap();
    let (said, found, error) = translated(&file[..file.len() - 40]);
    assert_eq!((said.as_str(), found), ("", counts(2, 0, 0)));
    let error = error.unwrap();
    assert!(error.contains("the file ends in the middle of"), "{error}");
}

#[test]
fn updates_to_the_port_that_a_controller_named_are_translated() {
    let mut file = writer();
    let ends = (SocketAddrV4::new(BOX, IO_PORT), SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_000));
    put_datagram(&mut file, 0, ends, &class1(78, 1, &actual_update(250_000)));
    let (text, found) = everything(&file.finish().unwrap());
    assert_eq!(found, counts(1, 0, 0), "{text}");
    assert!(text.contains("Axis State: Running"), "{text}");
}

#[test]
fn an_update_that_is_cut_in_the_recording_is_an_error() {
    let mut file = writer();
    (1..=3).for_each(|count| put(&mut file, u64::from(count) * 2, count, BOX));
    let file = file.finish().unwrap();
    let (text, found) = everything(&with_cut(&file, 1, 60));
    assert!(text.contains("frame 2\n  error: cut in the recording: 30 bytes are missing\n"), "{text}");
    assert_eq!(found, counts(2, 0, 1), "{text}");
    // Before the connection ID.
    assert_eq!(everything(&with_cut(&file, 1, 44)).1, counts(2, 0, 1));
    // Without the ports nobody knows whose it is.
    assert_eq!(everything(&with_cut(&file, 1, 36)).1, counts(2, 1, 0));
}

#[test]
fn what_cannot_be_read_of_a_device_is_an_error_and_what_others_send_is_passed_over() {
    let controller = Ipv4Addr::new(10, 0, 0, 1);
    let ends = |device, port| (SocketAddrV4::new(controller, port), SocketAddrV4::new(device, port));
    let mut file = writer();
    put(&mut file, 0, 1, BOX);
    // No class 1 datagram, and one that has no update in it.
    put_datagram(&mut file, 1, ends(BOX, IO_PORT), &[2, 0, 2, 0x80, 8, 0, 77, 0]);
    let mut other = [0; CLASS1_HEADER_LEN + 4];
    Class1Datagram::emit_header(77, 2, 2, 4, &mut other).unwrap();
    put_datagram(&mut file, 2, ends(BOX, IO_PORT), &other);
    // Class 1 data of another device, and another protocol.
    put_datagram(&mut file, 3, ends(OTHER, IO_PORT), &other);
    put_datagram(&mut file, 4, ends(BOX, 5353), &other);
    let file = file.finish().unwrap();
    let (text, found) = everything(&file);
    assert_eq!(found, counts(1, 2, 2), "{text}");
    assert_eq!(everything(&with_cut(&file, 4, 48)).1, counts(1, 2, 2));
}

#[test]
fn a_sercos_telegram_that_is_cut_or_has_no_header_is_an_error() {
    let phase = PhaseField::new(false, 0, Phase::CP4);
    let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
    let header = Header { source: [2, 0, 0, 0, 0, 1], telegram, phase };
    let mut frame = [0; 60];
    header.emit(&mut frame).unwrap();
    let mut wrong = frame;
    wrong[15] ^= 1;
    let mut file = Writer::new(Vec::new(), ["north", "sercos port 1", "none"], &[]).unwrap();
    let south = Side::South(profile_sercos::port::Port::One);
    for frame in [frame, wrong, frame] {
        file.frame(south, KernelTime(1_000_000_000), &frame, None).unwrap();
    }
    let file = with_cut(&file.finish().unwrap(), 2, 32);
    let (text, found) = everything(&file);
    assert!(text.contains("frame 2\n  error: SERCOS III: "), "{text}");
    assert!(text.contains("frame 3\n  error: cut in the recording: 28 bytes are missing"), "{text}");
    assert_eq!(found.passed_over, 0, "{text}");
}

#[test]
fn a_section_may_have_its_interfaces_in_another_order() {
    let mut file = writer();
    (1..=2).for_each(|count| put(&mut file, u64::from(count), count, BOX));
    let mut file = file.finish().unwrap();
    let mut second = writer();
    (3..=4).for_each(|count| put(&mut second, u64::from(count), count, BOX));
    let second = second.finish().unwrap();
    let mut blocks = blocks(&second).into_iter().map(<[u8]>::to_vec).collect::<Vec<_>>();
    blocks.swap(1, 2);
    for block in &mut blocks {
        block[8] += u8::from(block[0] == 6);
    }
    assert_eq!([blocks[0][0], blocks[1][0], blocks[2][0]], [0x0A, 1, 1]);
    file.extend(blocks.concat());
    assert_eq!(translated(&file), (String::new(), counts(4, 0, 0), None));
}

#[test]
fn missing_updates_and_a_silence_are_said_and_the_rest_is_translated() {
    let mut file = writer();
    for (time, count) in [(0, 1), (2, 2), (10, 6), (12, 6), (1500, 7)] {
        put(&mut file, time, count, BOX);
    }
    let (said, found, error) = translated(&file.finish().unwrap());
    let expected = "frame 3: note: 3 updates 10.0.0.1 -> 127.0.0.2 are missing before this one\n\
                    frame 5: note: nothing was recorded for 1.488 s\n";
    assert_eq!((said.as_str(), found, error), (expected, counts(5, 0, 0), None));
}

#[test]
fn time_that_goes_backwards_is_said_and_the_rest_is_translated() {
    let mut file = writer();
    for (time, count) in [(5000, 1), (5002, 2), (1000, 3), (1002, 4)] {
        put(&mut file, time, count, BOX);
    }
    let (said, found, error) = translated(&file.finish().unwrap());
    assert_eq!(said, "frame 3: note: time goes back by 4.002 s\n");
    assert_eq!((found, error), (counts(4, 0, 0), None));
}

#[test]
fn updates_of_a_second_gateway_are_left_out_and_counted() {
    let mut file = writer();
    for (time, count, device) in [(0, 1, BOX), (1, 1, OTHER), (2, 2, BOX), (3, 2, OTHER)] {
        put(&mut file, time, count, device);
    }
    // The configuration has the one; the other stands for its device only where it is alone.
    let (said, found, _) = translated(&file.finish().unwrap());
    assert_eq!(
        said,
        "frame 2: error: 192.0.2.9 is another gateway, or a device that the configuration does not have: its frames \
         are left out\n"
    );
    assert_eq!(found, counts(2, 0, 2));
    let mut file = writer();
    (1..=2).for_each(|count| put(&mut file, u64::from(count), count, OTHER));
    assert_eq!(translated(&file.finish().unwrap()), (String::new(), counts(2, 0, 0), None));
}

#[test]
fn interfaces_of_a_second_gateway_in_one_file_are_left_out() {
    // As `mergecap` makes one file of two: the second one's interfaces follow those of the first in the same section.
    let mut first = writer();
    put(&mut first, 0, 1, BOX);
    put(&mut first, 2, 2, BOX);
    let mut file = first.finish().unwrap();
    let mut second = writer();
    put(&mut second, 1, 1, BOX);
    let second = second.finish().unwrap();
    for block in blocks(&second) {
        match block[0] {
            1 => file.extend(block),
            6 => {
                let mut block = block.to_vec();
                block[8] += 3;
                file.extend(block);
            }
            _ => {}
        }
    }
    let (said, found, _) = translated(&file);
    let expected = "frame 3: error: interface 3 is `north` of another gateway: all its frames are left out\n";
    assert_eq!((said.as_str(), found), (expected, counts(2, 0, 1)));
}

/// The blocks of a pcapng file of this machine.
fn blocks(file: &[u8]) -> Vec<&[u8]> {
    let (mut blocks, mut at) = (Vec::new(), 0);
    while let Some(len) = file.get(at + 4..at + 8) {
        let len = usize::try_from(u32::from_le_bytes(len.try_into().unwrap())).unwrap();
        blocks.push(&file[at..at + len]);
        at += len;
    }
    blocks
}

#[test]
fn other_link_types_are_said_once_and_counted() {
    // pcap: magic number, version 2.4, zone, accuracy, snap length, link type 113 (Linux cooked capture).
    let mut file =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 113, 0, 0, 0];
    for _ in 0..3 {
        file.extend([[0; 4], [0; 4], [4, 0, 0, 0], [4, 0, 0, 0], [1, 2, 3, 4]].concat());
    }
    let (said, found, error) = translated(&file);
    assert_eq!(
        said,
        "frame 1: error: link type 113 is neither Ethernet nor CAN: all frames of this interface are left out\n"
    );
    assert_eq!((found, error), (counts(0, 0, 3), None));
}

#[test]
fn a_can_interface_in_an_ethernet_recording_does_not_disturb() {
    let mut file = Writer::new(Vec::new(), ["north", "none", "none"], &["simulated, CANopen"]).unwrap();
    put(&mut file, 0, 1, BOX);
    let frame = CanFrame::new(Id::Standard(0x701), &[5]).unwrap();
    file.can_frame(0, KernelTime(1_001_000_000), &frame, None).unwrap();
    put(&mut file, 2, 2, BOX);
    assert_eq!(translated(&file.finish().unwrap()), (String::new(), counts(2, 1, 0), None));
}

/// A recording of a CANopen drive that reports its own scaling: 36000 counts a turn, where the simulated one has 65536.
const CAN_BOX: &str = r#"
[box]
name = "can"
[[device]]
name = "front"
listen = "127.0.0.2"
axes = ["turntable"]
[device.identity]
vendor_id = 1
product_code = 1001
serial_number = 1
product_name = "Axisbridge"
[[axis]]
name = "turntable"
instance = 1
drive = "drive-a"
unit = "revolution"
motion_resolution = 1_000_000
[[south.can]]
interface = "in-process"
bit_rate = 1_000_000
cycle_time = "10 ms"
[[south.can.drive]]
name = "drive-a"
node = 1
"#;

/// What becomes of the recording of a box on CANopen.
fn of_can(values: &str, frames: &[(u16, &[u8])]) -> (String, Vec<String>, Counts) {
    let mut file = Writer::new(Vec::new(), ["north", "none", "none"], &["simulated, CANopen"]).unwrap();
    for (time, (id, data)) in (0..).zip(frames) {
        file.can_frame(0, KernelTime(time), &CanFrame::new(Id::Standard(*id), data).unwrap(), None).unwrap();
    }
    let config = Config::parse(CAN_BOX, "can.toml").unwrap();
    let stage = Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap();
    let stage = if values.is_empty() { stage } else { stage.with_values(values).unwrap() };
    let stage = Arc::new(stage);
    let mut said = String::new();
    let file = file.finish().unwrap();
    let reader = Reader::new(file.as_slice()).unwrap();
    let captured = translate_capture(&stage, &config, reader, &NoNames, u64::MAX, &mut |entry| {
        entry.tree.write(&mut said, 0, RowNames::Keys).unwrap();
        true
    });
    let stand_ins = captured.stage.stand_ins().map(str::to_owned).collect();
    (said, stand_ins, captured.counts)
}

/// The drive's answers: 6092:01 and :02, feed in counts and shaft revolutions.
const COUNTS: [(u16, &[u8]); 2] =
    [(0x581, &[0x43, 0x92, 0x60, 1, 0xA0, 0x8C, 0, 0]), (0x581, &[0x43, 0x92, 0x60, 2, 1, 0, 0, 0])];

/// Its two TPDOs, in operation at 18000 counts.
const TPDOS: [(u16, &[u8]); 2] = [(0x181, &[0x37, 0x16, 8, 0x50, 0x46, 0, 0]), (0x281, &[0, 0, 0, 0, 0, 0])];

#[test]
fn the_scaling_that_a_drive_reports_in_the_recording_counts() {
    let (said, stand_ins, counts) = of_can("", &TPDOS);
    assert!(!said.contains("position_actual 0.500000000 rev"), "{said}");
    assert_eq!((stand_ins, counts.failed), (vec!["drive-a".to_owned()], 0));
    let (said, stand_ins, counts) = of_can("", &[COUNTS, TPDOS].concat());
    assert!(said.contains("frame 3: note: the scaling of drive-a is that of the recording"), "{said}");
    assert!(said.contains("position_actual 0.500000000 rev"), "{said}");
    assert_eq!((stand_ins.len(), counts.translated, counts.failed), (0, 2, 0));
}

#[test]
fn a_can_record_that_cannot_be_read_is_an_error_where_a_drive_may_be_on_its_bus() {
    // pcap with link type 227; a TPDO of the drive, and one of which only 9 of its 15 bytes were recorded.
    let mut file =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 227, 0, 0, 0];
    let record = [0, 0, 1, 0x81, 7, 0, 0, 0, 0x37, 0x16, 8, 0x50, 0x46, 0, 0];
    for len in [15, 9] {
        file.extend([[0; 4], [0; 4], [len, 0, 0, 0], [15, 0, 0, 0]].concat());
        file.extend(&record[..usize::from(len)]);
    }
    let config = Config::parse(CAN_BOX, "can.toml").unwrap();
    let stage = Arc::new(Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap());
    let mut said = String::new();
    let reader = Reader::new(file.as_slice()).unwrap();
    let captured = translate_capture(&stage, &config, reader, &NoNames, u64::MAX, &mut |entry| {
        entry.tree.write(&mut said, 0, RowNames::Keys).unwrap();
        true
    });
    assert_eq!(captured.counts, counts(1, 0, 1), "{said}");
    assert!(said.contains("frame 2\n  error: cut in the recording: 6 bytes are missing\n"), "{said}");
}

#[test]
fn values_that_say_another_scaling_are_an_error_and_the_axis_is_left_out() {
    let values =
        |counts: &str| format!("object drive-a 6092:01 {counts} 00 00\nobject drive-a 6092:02 01 00 00 00\n");
    let (said, _, counts) = of_can(&values("20 4e"), &[COUNTS, TPDOS].concat());
    let text = "frame 3: error: drive-a: the scaling of the recording is not that of the configuration; 6092:01 is a0 8c 00 00 in \
                the recording, and 20 4e 00 00 with the configuration";
    assert!(said.contains(text), "{said}");
    assert!(!said.contains("position_actual"), "{said}");
    assert_eq!((counts.translated, counts.failed), (0, 2));
    let (said, _, counts) = of_can(&values("a0 8c"), &[COUNTS, TPDOS].concat());
    assert!(said.contains("position_actual 0.500000000 rev"), "{said}");
    assert_eq!((counts.translated, counts.failed), (2, 0));
}
