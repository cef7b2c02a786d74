//! CiA 402 drives on CANopen: updates to RPDOs, TPDOs and EMCY to the device.

use profile_cia402::master::config::Direction;
use profile_cip::wire::motion::codes::AxisControl;

use super::*;
use crate::capture::can::{LINK_TYPE_CAN, RECORD_LEN_MAX, emit};

/// The two axes of a simulated drive with node-id 3.
const BOX: &str = r#"
[box]
name = "box"

[[device]]
name = "front"
listen = "127.0.0.1"
axes = ["turntable", "index"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 1
product_code = 1
serial_number = 1

[[axis]]
name = "turntable"
instance = 1
drive = "drive-c"
unit = "revolution"

[[axis]]
name = "index"
instance = 2
drive = "drive-d"
unit = "revolution"

[[south.can]]
interface = "in-process"
bit_rate = 1_000_000
cycle_time = "4 ms"

[[south.can.drive]]
name = "drive-c"
node = 3

[[south.can.drive]]
name = "drive-d"
node = 3
axis = 1
"#;

/// The same with a drive of this vendor and product.
const ORIENTAL: &str = r#"
[[south.can.device]]
node = 3
identity = { vendor_id = 0x2BE, product_code = 0x13F7 }
"#;

fn stage_of(text: &str) -> Stage {
    Stage::rehearse(&Config::parse(text, "box.toml").unwrap(), Mapping::embedded().unwrap()).unwrap()
}

pub(super) fn stage() -> Stage {
    stage_of(BOX)
}

#[test]
fn the_values_of_an_axis_are_spread_over_pdos() {
    let stage = stage();
    let shown: Vec<String> = stage
        .axes
        .iter()
        .flat_map(|axis| axis.can().unwrap().pdos.iter())
        .filter(|pdo| !pdo.parts.is_empty())
        .map(|pdo| {
            let parts = pdo
                .parts
                .iter()
                .map(|part| format!("{}..{} at {}", part.flat, part.flat + part.len, part.at));
            format!("{pdo} of {}: {}", pdo.len, parts.collect::<Vec<_>>().join(", "))
        })
        .collect();
    insta::assert_snapshot!(shown.join("\n"));
    for axis in &stage.axes {
        let drive = axis.can().unwrap();
        for (direction, bytes) in [
            (Direction::Receive, axis.south.telegram.command_bytes),
            (Direction::Transmit, axis.south.telegram.feedback_bytes),
        ] {
            // Every byte has one place, and comes back from there.
            let flat: Vec<u8> = (1..=u8::try_from(bytes).unwrap()).collect();
            let mut back = vec![0; flat.len()];
            for pdo in drive.pdos.iter().filter(|pdo| pdo.direction == direction) {
                assert!(CanDrive::gather(pdo, &CanDrive::spread(pdo, &flat), &mut back));
                assert!(!CanDrive::gather(pdo, &[], &mut back), "too short");
            }
            assert_eq!(back, flat, "{direction}");
        }
    }
}

#[test]
fn a_position_command_becomes_rpdos() {
    let mut translator = Translator::new(stage());
    insta::assert_snapshot!(text(&translator.frame(&update(position(250_000))).unwrap()));
}

#[test]
fn tpdos_become_an_update_once_all_of_them_have_come() {
    let mut translator = Translator::new(stage());
    insta::assert_snapshot!(lines(
        &mut translator,
        &[
            "can 080",
            "can 183 37 16 08 00 00 04 00",
            "can 283 00 10 00 00 f4 01",
            "can 203 0f 00 08 00 00 04 00",
            "can 303 01"
        ]
    ));
}

#[test]
fn what_drives_say_is_wrong_is_told_of_every_axis() {
    let mut translator = Translator::new(stage());
    insta::assert_snapshot!(lines(
        &mut translator,
        &[
            "can 083 20 23 02 00 00 00 00 00",
            "can 083 11 86 20 00 00 00 00 00",
            "can 083 00 00 00 00 00 00 00 00",
            "object drive-c 603F:00 11 86",
            "object drive-d 6E65:00 e8 03 00 00",
            "object drive-c 6077:00 64 00",
            "set turntable 504 00 00 16 43",
            "can 283 00",
            "can 703 05",
            "can 7ff 05",
        ]
    ));
}

/// Rows of the family that a drive is of, by its identity.
#[test]
fn the_rows_of_a_family_are_named_for_its_drives() {
    // Bit 15: the torque limit of this family, and nothing in other drives.
    let told = |text: &str| {
        let mut translator = Translator::new(stage_of(text));
        lines(&mut translator, &["can 080", "can 183 37 96 08 00 00 04 00", "can 283 00 10 00 00 f4 01"])
    };
    let (any, own) = (told(BOX), told(&(BOX.to_owned() + ORIENTAL)));
    assert!(!any.contains("torque limit") && !any.contains("torque_limit"), "{any}");
    assert!(own.contains("torque limit  <-") && own.contains("[[status]] torque_limit"), "{own}");
}

#[test]
fn requests_follow_the_state_of_the_drive() {
    let mut translator = Translator::new(stage());
    let mut all = String::new();
    let ask = |control| CommandBlock { axis_control: control, ..position(0) };
    for (first, block) in [
        ("40 12 08 00 00 00 00", ask(AxisControl::ENABLE)),
        ("31 12 08 00 00 00 00", ask(AxisControl::ENABLE)),
        ("33 12 08 00 00 00 00", position(10)),
        ("37 12 08 00 00 00 00", position(20)),
        ("37 16 08 00 00 00 00", position(30)),
        ("18 12 08 00 00 00 00", position(40)),
        ("18 12 08 00 00 00 00", ask(AxisControl::FAULT_RESET)),
        ("18 12 08 00 00 00 00", position(50)),
    ] {
        all += &lines(&mut translator, &[&format!("can 183 {first}"), "can 283 00 00 00 00 00 00"]);
        all += &text(&translator.frame(&update(block)).unwrap());
    }
    let told = ["PDOs of drive-c", "drive state", "6040:00", "Axis Control", "line"];
    let kept: Vec<_> = all.lines().filter(|line| told.iter().any(|word| line.contains(word))).collect();
    insta::assert_snapshot!(kept.join("\n"));
}

#[test]
fn recordings_of_a_can_bus_are_translated() {
    let stage = Arc::new(stage());
    let frames: [(u16, &[u8]); 5] = [
        (0x080, &[]),
        (0x203, &[0x0F, 0, 8, 0, 0, 4, 0]),
        (0x183, &[0x37, 0x16, 8, 0, 0, 4, 0]),
        (0x283, &[0, 0x10, 0, 0, 0xF4, 1]),
        (0x603, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]),
    ];
    let mut file = Vec::new();
    // pcap of the format's description: magic number, version 2.4, zone, accuracy, snap length, link type.
    file.extend([0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0]);
    file.extend(u32::from(LINK_TYPE_CAN).to_le_bytes());
    for (id, data) in frames {
        let frame = profile_generic::can::Frame::new(profile_generic::can::Id::Standard(id), data).unwrap();
        let mut record = [0; RECORD_LEN_MAX];
        let len = emit(&frame, &mut record);
        let size = u32::try_from(len).unwrap().to_le_bytes();
        file.extend([[0; 4], [0; 4], size, size].concat());
        file.extend(&record[..len]);
    }
    let config =
        crate::config::Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
    let reader = crate::capture::reader::Reader::new(file.as_slice()).unwrap();
    let names = profile_sercos::wire::describe::NoNames;
    let list =
        List::of(|sink| whole(translate_capture(&stage, &config, reader, &names, u64::MAX, sink))).unwrap();
    assert_eq!((list.frames.len(), list.counts.passed_over, list.counts.failed), (3, 2, 0));
    let last = text(&list.frames[2]);
    assert!(last.starts_with("frame 4 283#00 10 00 00 F4 01\n"), "{last}");
    assert!(last.contains("position_actual 4.000000000 rev"), "{last}");
    assert!(text(&list.frames[1]).contains("TPDO2 (283) to come"));
}
