//! Drives on DeviceNet: updates to polls, answers to the device.

use super::*;
use crate::capture::can_bus::CanProtocol;
use crate::capture::reader::Reader;
use crate::capture::writer::Writer;
use crate::config::CanLink;
use crate::sys::clock::KernelTime;
use profile_generic::can::{Frame, Id};
use profile_sercos::wire::describe::NoNames;

/// A CIP Motion drive with MAC ID 5 on the turntable, and a velocity drive with MAC ID 9 on the conveyor.
const BOX: &str = include_str!("../../../../examples/two-axes-devicenet.toml");

fn config() -> Config {
    Config::parse(BOX, "box.toml").unwrap()
}

fn translator() -> Translator {
    Translator::new(Stage::rehearse(&config(), Mapping::embedded().unwrap()).unwrap())
}

#[test]
fn a_position_command_becomes_a_poll() {
    let mut translator = translator();
    insta::assert_snapshot!(text(&translator.frame(&update(position(250_000))).unwrap()));
}

#[test]
fn polls_and_their_answers_are_put_together_and_belong_to_each_other() {
    let mut translator = translator();
    insta::assert_snapshot!(lines(
        &mut translator,
        &[
            "devicenet 42d 00 02 02 07 05 01 02 00",
            "devicenet 42d 41 00 01 01 00 00 00 00",
            "devicenet 42d 82 04 00",
            // The answer to another update says nothing, that to this one everything.
            "devicenet 3c5 00 03 02 06 05 01 02 00",
            "devicenet 3c5 41 00 00 01 00 04 00 00",
            "devicenet 3c5 82 04 00",
            "devicenet 3c5 00 03 02 07 05 01 02 00",
            "devicenet 3c5 41 00 00 01 00 04 00 00",
            "devicenet 3c5 82 04 00",
            "devicenet 3c5 00 03 02 08 05 01 02 00",
            "devicenet 3c5 82 04 00",
            "devicenet 3c5",
            "devicenet 42d",
            "devicenet 42f 00 01 00 05 00 00 00",
            "at drive-a 03 02 21 05 01 02 00 00 00 01 00 04 00 00 08 00",
            "devicenet 44d 61 00 dc 05",
            "devicenet 3c9 74 04 dc 05",
            "devicenet 44d 62 00 dc 05",
            "devicenet 3c9 01 07 00 00",
            "object drive-a 603F:00 20 23",
        ]
    ));
}

#[test]
fn requests_follow_the_state_of_the_drive() {
    let mut translator = translator();
    let mut all = String::new();
    let ask = |control| CommandBlock { axis_control: control, ..position(0) };
    for (state, block) in [
        ("02", ask(AxisControl::ENABLE)),
        ("03", position(10)),
        ("04", position(20)),
        ("04", ask(AxisControl::DISABLE)),
        ("06", position(30)),
        ("08", ask(AxisControl::FAULT_RESET)),
        ("02", position(40)),
    ] {
        all += &lines(
            &mut translator,
            &[&format!("at drive-a 03 02 00 05 01 02 00 00 00 01 00 {state} 00 00 00 00")],
        );
        all += &text(&translator.frame(&update(block)).unwrap());
    }
    let told = ["poll of", "drive state", "Axis Control", "Axis State"];
    let kept: Vec<_> = all.lines().filter(|line| told.iter().any(|word| line.contains(word))).collect();
    insta::assert_snapshot!(kept.join("\n"));
}

/// The same bytes are other things on the other bus: only what tells which bus it is counts.
#[test]
fn recordings_are_translated_by_their_buses() {
    let poll: [(u16, &[u8]); 2] = [(0x44D, &[0x61, 0, 0xDC, 5]), (0x3C9, &[0x74, 4, 0xDC, 5])];
    let recording = |protocol: CanProtocol| {
        let link = CanLink::Interface { name: "can7".to_owned(), set_bit_rate: false };
        let mut file =
            Writer::new(Vec::new(), ["north", "none", "none"], &[&protocol.describe(&link)]).unwrap();
        for (time, (id, data)) in (0..).zip(poll) {
            file.can_frame(0, KernelTime(time), &Frame::new(Id::Standard(id), data).unwrap(), None).unwrap();
        }
        file.finish().unwrap()
    };
    let stage = Arc::new(Stage::rehearse(&config(), Mapping::embedded().unwrap()).unwrap());
    let translated = |file: &[u8], config: &Config| {
        let list = List::of(|sink| {
            whole(translate_capture(&stage, config, Reader::new(file).unwrap(), &NoNames, u64::MAX, sink))
        })
        .unwrap();
        (list.frames.iter().map(text).collect::<String>(), list.counts.passed_over, list.counts.failed)
    };
    let (told, passed_over, failed) = translated(&recording(CanProtocol::Devicenet), &config());
    assert_eq!((passed_over, failed), (0, 0));
    assert!(told.contains("speed reference: 1500"), "{told}");
    assert!(
        told.contains("velocity_actual 1562.500000000 mm/s"),
        "25 turns a second of 62.5 mm each: {told}"
    );
    let (told, passed_over, failed) = translated(&recording(CanProtocol::Canopen), &config());
    assert_eq!((told.as_str(), passed_over, failed), ("", 2, 0));
    // An interface that is neither of the two is not guessed at, and that is said once.
    let mixed = BOX.to_owned() + CANOPEN;
    let mixed = Config::parse(&mixed, "box.toml").unwrap();
    let mut file =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 227, 0, 0, 0];
    for (id, data) in poll {
        let mut record = [0; crate::capture::can::RECORD_LEN_MAX];
        let len = crate::capture::can::emit(&Frame::new(Id::Standard(id), data).unwrap(), &mut record);
        let size = u32::try_from(len).unwrap().to_le_bytes();
        file.extend([[0; 4], [0; 4], size, size].concat());
        file.extend(&record[..len]);
    }
    let (told, passed_over, failed) = translated(&file, &mixed);
    assert_eq!((passed_over, failed), (0, 2), "{told}");
    assert!(
        told.contains("which has CANopen and DeviceNet, got one without name: all its frames are left out"),
        "{told}"
    );
    assert_eq!(translated(&file, &config()).1, 0, "a configuration with one bus tells which it is");
}

/// A CANopen bus with a drive that no axis uses.
const CANOPEN: &str = r#"
[[south.can]]
interface = "can1"
bit_rate = 1_000_000
cycle_time = "10 ms"

[[south.can.drive]]
name = "drive-c"
node = 3
"#;
