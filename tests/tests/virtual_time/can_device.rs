//! What the configuration says of CANopen devices as a whole: who they have to be, their node-id, configuration, mappings that are
//! kept, guarding.

use std::fs;
use std::path::{Path, PathBuf};

use axisbridge::config::CanDevice;
use axisbridge::simulate::can_drive::{drive, stand_in};
use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge::status::BoxState;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::eds::concise::{Entry, emit};
use profile_cia402::master::config::Expected;
use profile_cia402::node::Node;
use profile_cia402::node::drive::Device;
use profile_cia402::wire::nmt::NmtState;
use profile_cia402::wire::{Mux, NodeId};
use profile_cip::controller::{AxisSet, Step};
use profile_generic::can::{Frame, Id};
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;

const BOX: &str = include_str!("can.toml");

/// What drive-a has besides; `more` stands behind its drive.
fn settings(device: &str, more: &str) -> Settings {
    let drive = "name = \"drive-a\"\nnode = 1\n";
    assert!(BOX.contains(drive));
    let text = BOX.replace(drive, &format!("{drive}{more}\n[[south.can.device]]\nnode = 1\n{device}\n"));
    Settings::without_line(text)
}

fn node(rig: &mut Rig, device: usize) -> &mut Node<Device> {
    rig.can[0].bus.nodes_mut().nth(device).expect("a device")
}

fn number(rig: &mut Rig, index: u16, sub: u8) -> i64 {
    node(rig, 0).dictionary().number(index, sub)
}

/// Both axes make their ways, as if nothing were special.
#[track_caller]
fn goes(rig: &mut Rig) {
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    assert!(rig.torque_free());
}

/// How often something was told.
fn told(rig: &Rig, text: &str) -> usize {
    rig.told().lines().filter(|line| line.contains(text)).count()
}

/// A file in a folder of the test.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("can_device");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_device_that_is_what_it_has_to_be_is_led() {
    let mut rig = Rig::ready(settings(
        "identity = { vendor_id = 0x319, product_code = 7, revision_number = 0x1_0002, serial_number = 42 }",
        "",
    ));
    assert_eq!([1, 2, 3, 4].map(|sub| number(&mut rig, 0x1018, sub)), [0x319, 7, 0x1_0002, 42]);
    goes(&mut rig);
}

/// Each number of the identity: a drive that has another one is never set up nor moved.
#[test]
fn a_device_that_is_another_one_is_never_led() {
    let cases = [
        (1, "vendor_id = 0x319", "D: another vendor", "expected 0x319, got 0x318"),
        (2, "product_code = 7", "M: another product code", "expected 0x7, got 0x6"),
        (3, "revision_number = 5", "N: another revision", "expected 0x5, got 0x4"),
        (4, "serial_number = 9", "O: another serial number", "expected 0x9, got 0x8"),
    ];
    for (sub, key, status, step) in cases {
        let mut rig = Rig::new(settings(&format!("identity = {{ {key} }}"), ""));
        let other = number(&mut rig, 0x1018, sub) - 1;
        node(&mut rig, 0).dictionary_mut().set(0x1018, sub, other);
        rig.run_for(millis(5_000));
        assert!(told(&rig, status) > 0 && told(&rig, step) > 0, "{sub}: {}", rig.told());
        let drive = node(&mut rig, 0);
        assert_eq!(drive.dictionary().number(0x1006, 0), 0, "{sub}: nothing was set up");
        assert_eq!(drive.statistics().rpdos, 0, "{sub}");
        assert!(node(&mut rig, 1).statistics().rpdos > 0, "{sub}: the other one is led");
    }
}

#[test]
fn a_guarded_drive_is_led_and_missed() {
    let mut rig = Rig::ready(settings("guarding = \"50 ms\"\nlife_time_factor = 4", ""));
    let own = [0x100C, 0x100D, 0x1017].map(|index| number(&mut rig, index, 0));
    assert_eq!(own, [50, 4, 0], "guarded, and without a heartbeat");
    goes(&mut rig);
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, false);
    rig.run_until(millis(2_000), "the loss", |rig| told(rig, "guarding") > 0);
    // Four requests that nobody answers, and the time up to the first of them.
    let took = rig.now().since(now);
    assert!(took >= millis(150) && took <= millis(300), "{took}");
}

/// A configuration of both forms, for a drive that keeps it: it has what the file says, and is not written a second time.
#[test]
fn a_configuration_is_written_and_kept() {
    let concise = emit([
        Entry { index: 0x6081, sub: 0, data: &777_u32.to_le_bytes() },
        Entry { index: 0x6098, sub: 0, data: &[37] },
        // What the box sets itself.
        Entry { index: 0x1017, sub: 0, data: &[1, 0] },
        Entry { index: 0x6040, sub: 0, data: &[0x0F, 0] },
    ]);
    let mut text = String::from_utf8(drive(NodeId::new(1).ok(), 1).unwrap().eds().to_vec()).unwrap();
    for (section, value) in [("[6081]", "777"), ("[6098]", "37"), ("[1017]", "1"), ("[6040]", "0x0F")] {
        assert!(text.contains(&format!("\n{section}\n")), "{section}");
        text = text.replacen(&format!("\n{section}\n"), &format!("\n{section}\nParameterValue={value}\n"), 1);
    }
    for (name, bytes) in [("own.cdcf", concise.as_slice()), ("own.dcf", text.as_bytes())] {
        let path = file(name, bytes);
        let mut rig = Rig::ready(settings(
            &format!("configuration = {:?}\nstore = true", path.display().to_string()),
            "",
        ));
        let own = [(0x6081, 0), (0x6098, 0), (0x1017, 0)].map(|(index, sub)| number(&mut rig, index, sub));
        assert_eq!(own, [777, 37, 100], "{name}");
        goes(&mut rig);
        // The next box finds it there, by date and time.
        let drive = node(&mut rig, 0);
        let handle = drive.dictionary().find(Mux::new(0x6098, 0)).unwrap();
        drive.dictionary_mut().set_number(handle, 35);
        rig.restart_box();
        rig.run_until(millis(20_000), "the second start", |rig| rig.status().state == BoxState::READY);
        assert_eq!(number(&mut rig, 0x6098, 0), 35, "{name}: it was written again");
    }
}

/// A drive whose mapping cannot be written: its second to fourth PDOs bring what an axis needs.
#[test]
fn a_drive_that_keeps_its_mapping_is_led_by_the_pdos_that_it_has() {
    let mut rig = Rig::ready(settings(
        "pdo_mapping = \"keep\"",
        "modes = [\"position\", \"velocity\"]\nactual_values = [\"velocity\"]",
    ));
    let mapped = |rig: &mut Rig, index: u16| {
        let count = u8::try_from(number(rig, index, 0)).unwrap();
        (1..=count).map(|sub| number(rig, index, sub)).collect::<Vec<_>>()
    };
    assert_eq!(mapped(&mut rig, 0x1602), [0x6040_0010, 0x607A_0020]);
    assert_eq!(mapped(&mut rig, 0x1A03), [0x6041_0010, 0x606C_0020]);
    // Which of them are on: the controlword comes with mode and targets, and the first one alone is not needed.
    let valid = |rig: &mut Rig, index: u16| [0, 1, 2, 3].map(|pdo| number(rig, index + pdo, 1) >> 31 == 0);
    assert_eq!(valid(&mut rig, 0x1400), [false, true, true, true]);
    assert_eq!(valid(&mut rig, 0x1800), [false, true, true, true]);
    goes(&mut rig);
}

/// The torque is in none of its PDOs: told by name. An axis that needs it is not led, and told what there is; another one does
/// without.
#[test]
fn what_a_kept_mapping_lacks_is_named() {
    let mut rig = Rig::ready(settings("pdo_mapping = \"keep\"", "modes = [\"position\", \"velocity\"]"));
    let text =
        "axis 1: node 1 keeps its PDOs, and 6077:00 is in none that can be used: the axis works without";
    assert_eq!(told(&rig, text), 1, "{}", rig.told());
    goes(&mut rig);
    let mut rig = Rig::new(settings("pdo_mapping = \"keep\"", "modes = [\"position\", \"torque\"]"));
    rig.run_for(millis(5_000));
    let text = "6071:00 is in no RPDO that can be used, and the mapping is kept: expected one with only values that the gateway sets, \
                got 1: 6040:00, 2: 6040:00 6060:00, 3: 6040:00 607A:00, 4: 6040:00 60FF:00; it is left out";
    assert!(told(&rig, text) > 0, "{}", rig.told());
    assert_eq!(node(&mut rig, 0).statistics().rpdos, 0);
}

/// A drive that does not let its mapping be written, and of which nobody has said so.
#[test]
fn a_drive_that_does_not_let_its_mapping_be_changed_is_led_by_the_pdos_that_it_has() {
    let modes = "modes = [\"position\", \"velocity\"]\nactual_values = [\"velocity\"]";
    let mut rig = Rig::new(settings("pdo_mapping = \"keep\"", modes));
    rig.restart_box_with(&settings("", modes).configuration);
    node(&mut rig, 0)
        .dictionary_mut()
        .make_constant(|index| matches!(index, 0x1600..0x1800 | 0x1A00..0x1C00));
    goes(&mut rig);
    assert_eq!(told(&rig, "map write 1600:00: refused with 06010002"), 1, "{}", rig.told());
    let mapped = |index: u16| [1, 2].map(|sub| (index, sub));
    let [first, second] = mapped(0x1602).map(|(index, sub)| number(&mut rig, index, sub));
    assert_eq!([first, second], [0x6040_0010, 0x607A_0020]);
    assert_eq!(number(&mut rig, 0x1402, 1) >> 31, 0, "it is used");
}

/// Nobody says which modes the drive has: they are tried, before it has torque.
#[test]
fn modes_that_the_drive_does_not_tell_are_tried() {
    let mut rig = Rig::new(settings("", ""));
    node(&mut rig, 0).dictionary_mut().set(0x6502, 0, 0);
    goes(&mut rig);
    let text = "node 1: 6502 reports no modes of operation; tried by 6060 and 6061, it has csp, ip, csv, pv, vl, cst, tq";
    assert_eq!(told(&rig, text), 1, "{}", rig.told());
    // One that is told what it has is not tried, even where it tells something else.
    let mut rig = Rig::new(settings("", "drive_modes = [\"ip\", \"pv\", \"tq\"]"));
    goes(&mut rig);
    assert_eq!(told(&rig, "tried by 6060"), 0);
    assert_eq!(number(&mut rig, 0x6060, 0), 7, "{}", rig.told());
}

/// A drive that never comes to the mode that it was given is not put into operation, and the start ends after its time.
#[test]
fn a_drive_that_does_not_show_the_mode_gets_no_torque() {
    const TPDO: Id = Id::Standard(0x181);
    let mut rig = Rig::ready(settings("", ""));
    // Behind the statusword is 6061: cst in place of csp.
    rig.can[0].tamper = Some(Box::new(|_, frame| {
        if frame.id() == TPDO {
            let mut data = frame.data().to_vec();
            data[2] = 10;
            *frame = Frame::new(TPDO, &data).expect("a frame");
        }
        true
    }));
    rig.connect(vec![Step::Enable(AxisSet::one(1))]);
    rig.run_until(millis(10_000), "the start", |rig| rig.states(0).last() == Some(&DriveState::Starting));
    let (begun, mut control) = (rig.now(), 0);
    while rig.engine.axes()[0].state() == DriveState::Starting {
        control = number(&mut rig, 0x6040, 0);
        rig.step();
        let word = number(&mut rig, 0x6041, 0);
        assert_ne!(word & 0x6F, 0x27, "operation enabled after {}", rig.now() - begun);
    }
    assert_eq!(control & 0x0F, 7, "it was switched on and no more");
    assert!(rig.now() - begun >= millis(10_000), "{}", rig.told());
    let fault = rig.engine.axes()[0].fault().map(|fault| fault.cause);
    assert_eq!(fault, Some(FaultCause::START_TIME_OUT), "{}", rig.told());
}

/// The answer to a write is lost, and the read-back that is already under way comes before the write is repeated.
#[test]
fn a_read_back_counts_that_came_after_its_write() {
    const ANSWERS: Id = Id::Standard(0x581);
    let mut rig = Rig::new(settings("", ""));
    let mut lost = false;
    // The drive answers success and keeps 1 ms.
    rig.can[0].tamper = Some(Box::new(move |_, frame| {
        if frame.id() == ANSWERS && frame.data().starts_with(&[0x60, 0xC2, 0x60, 1]) {
            return std::mem::replace(&mut lost, true);
        }
        if frame.id() == ANSWERS && frame.data().starts_with(&[0x4F, 0xC2, 0x60, 1]) {
            *frame = Frame::new(ANSWERS, &[0x4F, 0xC2, 0x60, 1, 1, 0, 0, 0]).expect("a frame");
        }
        true
    }));
    rig.run_until(millis(20_000), "the bus up", |rig| rig.status().state == BoxState::READY);
    let text = "node 1 expects set-points every 1 ms (60C2), and they come every 4 ms";
    assert_eq!(told(&rig, text), 1, "{}", rig.told());
}

/// What 6502 does not name is not used, and what it is told with its value.
#[test]
fn a_mode_that_the_drive_lacks_is_told_with_what_it_has() {
    let all = "modes = [\"position\", \"velocity\", \"torque\"]";
    let mut rig = Rig::new(settings("", all));
    node(&mut rig, 0).dictionary_mut().set(0x6502, 0, 0x2D);
    rig.run_for(millis(5_000));
    let text = "node 1 cannot be used: position needs one of the modes csp, ip, the drive has none of them: 6502:00 is 0x0000002d; it is left out";
    assert!(told(&rig, text) > 0, "{}", rig.told());
    assert_eq!(node(&mut rig, 0).statistics().rpdos, 0);
}

/// Nothing is written to a device that is no drive, and the other one is led.
#[test]
fn a_device_that_is_no_drive_is_left_alone() {
    for (key, led) in [("", false), ("device_type = \"drive\"", false), ("device_type = \"any\"", true)] {
        let mut rig = Rig::new(settings(key, ""));
        node(&mut rig, 0).dictionary_mut().set(0x1000, 0, 0x0003_0191);
        rig.run_for(millis(5_000));
        let text = "C: another device type: identify read 1000:00: expected 0x30192, got 0x30191; nothing was written to it; \
                    for a drive nevertheless, `device_type = \"any\"` in its [[south.can.device]]";
        assert_eq!(told(&rig, text) > 0, !led, "{key}: {}", rig.told());
        assert_eq!(number(&mut rig, 0x1017, 0) > 0, led, "{key}");
        assert_eq!(node(&mut rig, 0).statistics().rpdos > 0, led, "{key}");
        assert!(node(&mut rig, 1).statistics().rpdos > 0, "{key}: the other one is led");
    }
}

/// PDOs that are taken as they arrive, and sent by a timer: the axis goes as with those at SYNC.
#[test]
fn asynchronous_pdos_lead_a_drive_as_well() {
    for (keys, types) in [
        ("rpdo_type = 0", [0, 1, 0]),
        ("rpdo_type = 255", [255, 1, 0]),
        ("tpdo_type = 254", [1, 254, 4]),
        ("rpdo_type = 254\ntpdo_type = 255", [254, 255, 4]),
    ] {
        let mut rig = Rig::new(settings(keys, ""));
        goes(&mut rig);
        let found = [(0x1400, 2), (0x1800, 2), (0x1800, 5)].map(|(index, sub)| number(&mut rig, index, sub));
        assert_eq!(found, types, "{keys}");
        assert_eq!(told(&rig, "missing"), 0, "{}", rig.told());
    }
}

const IDENTITY: &str =
    "identity = { vendor_id = 0x319, product_code = 7, revision_number = 0x1_0002, serial_number = 42 }";

/// A drive that is delivered without a node-id gets that of the configuration, and is led.
#[test]
fn a_device_without_a_node_id_is_given_it() {
    for (word, more) in [("assign", ""), ("store", " and stores it")] {
        let mut rig = Rig::new(settings(&format!("{IDENTITY}\nlss = \"{word}\""), ""));
        assert_eq!(node(&mut rig, 0).node(), None);
        rig.run_until(millis(20_000), "the axes", |rig| {
            let nodes: Vec<_> = rig.can[0].bus.nodes().map(|node| node.state()).collect();
            nodes.iter().all(|state| *state == NmtState::OPERATIONAL)
        });
        assert_eq!(node(&mut rig, 0).node(), NodeId::new(1).ok());
        let text = format!(
            "the device with vendor 00000319 product 00000007 revision 00010002 serial 0000002A was given node-id 1{more}"
        );
        assert_eq!(rig.told().lines().filter(|line| line.ends_with(&text)).count(), 1, "{}", rig.told());
        goes(&mut rig);
    }
}

/// Somebody else without a node-id stays without one, and a device with another node-id keeps it.
#[test]
fn nobody_else_is_given_a_node_id() {
    let mut rig = Rig::new(settings(&format!("{IDENTITY}\nlss = \"assign\""), ""));
    let stranger = drive(None, 1).unwrap();
    rig.can[0].bus.add(stranger);
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, false);
    rig.run_for(millis(15_000));
    assert_eq!(rig.can[0].bus.nodes().nth(2).expect("the stranger").node(), None);
    assert_eq!(told(&rig, "was given node-id"), 0, "{}", rig.told());
    assert!(node(&mut rig, 1).statistics().rpdos > 0, "the other drive is led");
    // Plugged in late.
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, true);
    rig.run_until(millis(20_000), "the node-id", |rig| told(rig, "was given node-id 1") == 1);
}

/// The device was given another node-id by somebody: it keeps that, and is told once.
#[test]
fn a_device_that_has_another_node_id_keeps_it() {
    let mut rig = Rig::new(settings(&format!("{IDENTITY}\nlss = \"assign\""), ""));
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, false);
    let device = CanDevice {
        node: NodeId::new(9).unwrap(),
        expected: Expected {
            vendor: Some(0x319),
            product: Some(7),
            revision: Some(0x1_0002),
            serial: Some(42),
            ..Expected::DRIVE
        },
        lss: None,
        eds: None,
        file: None,
        stores: false,
        keeps_mapping: false,
        types: [None; 2],
        guarding: None,
    };
    rig.can[0].bus.add(stand_in(device.node, 1, Some(&device)).unwrap());
    rig.run_for(millis(15_000));
    assert_eq!(told(&rig, "has node-id 9: expected none, or 1; it is left as it is"), 1, "{}", rig.told());
    assert_eq!(rig.can[0].bus.nodes().nth(2).expect("the device").node(), Some(device.node));
    assert!(node(&mut rig, 1).statistics().rpdos > 0, "the other drive is led");
}
