//! Start-up lists: what a drive has otherwise is written in the right phase and read back, refuses the drive, or is reported; and the
//! axis moves by what the list says.

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use axisbridge::config::DevicenetKind;
use axisbridge::simulate::can_bus::CanNode as _;
use axisbridge::simulate::devicenet_drive::{self, DevicenetNode};
use axisbridge::simulate::drives::linear;
use axisbridge_tests::rig::motion::{NANO, TURNTABLE, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cia402::node::Node;
use profile_cia402::node::dictionary::{DataType, Definition as ObjectDefinition};
use profile_cia402::node::drive::Device;
use profile_cia402::wire::Mux;
use profile_cia402::wire::nmt::NmtState;
use profile_cip::controller::{AxisSet, Step};
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::wire::MacId;
use profile_generic::scaling::UnitKind;
use profile_generic::state::DriveState;
use profile_sercos::slave::communication::CLASSES_WITH_HOT_PLUG;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::slave::{Config as SlaveConfig, Slave};
use profile_sercos::wire::idn::Idn;

/// A value that is nowhere else in a telegram.
const RARE: u32 = 0x5EC0_71E5;

/// Elements 3 of four unsigned bytes: writable in CP2 and CP3, in CP3 only, in CP4 only, and never.
const CP2_CP3: u32 = 0x4012_0001;
const CP3: u32 = 0x5012_0001;
const CP4: u32 = 0x3012_0001;
const NEVER: u32 = 0x7012_0001;

fn entry(parameter: &str, value: &str, more: &str) -> String {
    format!("[[startup]]\nparameter = \"{parameter}\"\nvalue = {value}\n{more}\n")
}

/// The configuration of a box, with these keys and entries for the first drive.
fn with(configuration: &str, drive: &str, bus: &str, keys: &str, entries: &str) -> String {
    assert!(configuration.contains(drive));
    let entries = entries.replace("[[startup]]", &format!("[[south.{bus}.drive.startup]]"));
    configuration.replacen(drive, &format!("{drive}{keys}\n{entries}\n"), 1)
}

fn sercos(keys: &str, entries: &[String]) -> Settings {
    let drive = "name = \"drive-a\"\naddress = 1\n";
    let configuration = with(BOX, drive, "sercos", keys, &entries.concat());
    Settings { configuration, ..Settings::default() }
}

fn can(keys: &str, entries: &[String]) -> Settings {
    let drive = "name = \"drive-a\"\nnode = 1\n";
    let configuration = with(include_str!("can.toml"), drive, "can", keys, &entries.concat());
    Settings::without_line(configuration)
}

fn devicenet(keys: &str, entries: &[String]) -> Settings {
    let drive = "name = \"drive-a\"\nmac_id = 5\n";
    let configuration = include_str!("devicenet.toml");
    // The keys of the drive come ahead of its entries.
    let (resolution, rest) = ("resolution = 1_048_576\n", format!("{drive}resolution = 1_048_576\n"));
    assert!(configuration.contains(&rest));
    let keys = format!("{resolution}{keys}");
    let configuration =
        with(&configuration.replacen(&rest, drive, 1), drive, "devicenet", &keys, &entries.concat());
    Settings::without_line(configuration)
}

/// An attribute of the Motion Device Axis Object of the first drive, a REAL.
pub(super) fn real(rig: &Rig, id: u16) -> f32 {
    let Some(DevicenetNode::Motion(slave)) = rig.devicenet[0].bus.nodes().next() else {
        panic!("a CIP Motion drive")
    };
    let bytes = slave.application().device().attribute(0, id).expect("the attribute");
    f32::from_le_bytes(bytes.try_into().expect("a REAL"))
}

/// Takes the first drive off its network, and puts another one in its place, as it comes from its maker.
pub(super) fn replace_devicenet_drive(rig: &mut Rig) {
    replace_devicenet_drive_by(rig, &DevicenetKind::Motion { modes: Vec::new(), resolution: 1_048_576 });
}

/// The same by a drive of this kind.
pub(super) fn replace_devicenet_drive_by(rig: &mut Rig, kind: &DevicenetKind) {
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, false);
    rig.run_for(millis(500));
    let now = rig.now();
    let mac = MacId::new(5).expect("a MAC ID");
    let mut drive = devicenet_drive::node(mac, DataRate::Rate500, kind);
    drive.start(now);
    *rig.devicenet[0].bus.nodes_mut().next().expect("a drive") = drive;
    rig.devicenet[0].bus.connect(now, 0, true);
}

/// Lines of the log about start-up lists.
fn told(rig: &Rig) -> Vec<String> {
    rig.told().lines().filter(|line| line.contains("start-up list")).map(str::to_owned).collect()
}

fn held(rig: &Rig, idn: Idn) -> i64 {
    rig.line.slaves()[0].store().number_of(idn)
}

fn own(number: u16) -> Idn {
    Idn::product(number)
}

/// A box whose drive has a parameter of its own.
fn with_own(settings: Settings, attribute: u32, value: i64) -> Rig {
    let mut rig = Rig::new(settings);
    rig.line.slaves_mut()[0].store_mut().define(Definition::value(own(123), attribute, "Own", value));
    rig
}

/// Until the bus is in CP4, and a while longer.
fn come_up(rig: &mut Rig) {
    rig.run_until(millis(20_000), "CP4", |rig| rig.status().phase == 4);
    rig.run_for(millis(100));
}

/// The drive counts at the motor. Its gear and a parameter of its own are set by the list, each in the phase that lets it, and the axis
/// goes as far as the gear of the list says.
#[test]
fn what_a_sercos_drive_has_otherwise_is_written_in_its_phase_and_the_axis_moves_by_it() {
    let entries = [
        entry("S-0-0121", "5", ""),
        entry("S-0-0122", "2", "on_difference = \"write\""),
        entry("P-0-0123", &RARE.to_string(), ""),
        entry("S-0-0104", "3.00", "on_difference = \"refuse\""),
    ];
    let mut rig = with_own(sercos("", &entries), CP3, 0);
    let kv = rig.line.slaves()[0].store().number_of(Idn::standard(104));
    assert_eq!(kv, 300, "the drive has what the list expects");
    rig.line.slaves_mut()[0].preset(Idn::standard(76), 0x02);
    // The phases in which the value of the own parameter is on the wire.
    let seen: Rc<RefCell<Vec<u8>>> = Rc::default();
    let phases = Rc::clone(&seen);
    rig.tamper_frame = Some(Box::new(move |frame| {
        let bytes = frame.as_slice();
        if bytes.windows(4).any(|window| window == RARE.to_le_bytes()) {
            phases.borrow_mut().push(bytes[15] & 0x0F);
        }
        true
    }));
    let gear = [121, 122].map(Idn::standard);
    rig.run_until(millis(20_000), "the gear", |rig| gear.map(|idn| held(rig, idn)) == [5, 2]);
    assert_eq!((rig.status().phase, held(&rig, own(123))), (2, 0), "{}", rig.told());
    rig.run_until(millis(20_000), "the own parameter", |rig| held(rig, own(123)) == i64::from(RARE));
    assert_eq!(rig.status().phase, 3, "{}", rig.told());
    rig.until_ready();
    rig.tamper_frame = None;
    let mut phases = seen.take();
    phases.dedup();
    assert_eq!(phases, [3], "written and read back there");
    let expected = [
        "axis 1: start-up list: S-0-0121 was 1 and is set to 5",
        "axis 1: start-up list: S-0-0122 was 1 and is set to 2",
        &format!("axis 1: start-up list: P-0-0123 was 0 and is set to {RARE}"),
        "axis 1: start-up list: 4 entries hold, 3 of them written",
    ];
    assert_eq!(told(&rig), expected);
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits: TURNTABLE },
        Step::Dwell { seconds: 0.5 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(20_000), "the end of the move", |rig| rig.report().steps_finished == 3);
    let error = rig.position(0) - NANO;
    assert!(error.abs() < NANO / 500, "{error} nanorevolutions away");
    // 2.5 turns of the motor at 0.0001 degree.
    let counts = held(&rig, Idn::POSITION_FEEDBACK_VALUE_1);
    assert!((counts - 9_000_000).abs() < 20_000, "{counts} counts at the motor");
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    // With the next start it is only compared.
    let before = rig.notices.len();
    let configuration = sercos("", &entries).configuration;
    rig.restart_box_with(&configuration);
    come_up(&mut rig);
    let again: Vec<_> =
        rig.notices[before.min(rig.notices.len())..].iter().map(ToString::to_string).collect();
    assert!(
        again.iter().any(|line| line == "start-up list: 4 entries hold, 0 of them written"),
        "{again:#?}"
    );
}

/// The scaling of a drive whose gear can only be written in CP3 is read after it was written.
#[test]
fn what_is_written_in_cp3_is_what_the_scaling_is_made_of() {
    let entries = [entry("S-0-0121", "5", ""), entry("S-0-0122", "2", "")];
    let mut rig = Rig::new(sercos("", &entries));
    let slave = &mut rig.line.slaves_mut()[0];
    slave.preset(Idn::standard(76), 0x02);
    for (number, name) in [(121, "Input revolutions"), (122, "Output revolutions")] {
        slave.store_mut().define(Definition::value(Idn::standard(number), CP3, name, 1));
    }
    rig.until_ready();
    assert_eq!([121, 122].map(|number| held(&rig, Idn::standard(number))), [5, 2], "{}", rig.told());
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits: TURNTABLE },
        Step::Dwell { seconds: 0.5 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(20_000), "the end of the move", |rig| rig.report().steps_finished == 3);
    let error = rig.position(0) - NANO;
    assert!(error.abs() < NANO / 500, "{error} nanorevolutions away\n{}", rig.told());
}

/// What keeps a SERCOS drive from being used, and what the log says of it. The other axis is not concerned.
#[test]
fn a_sercos_drive_that_does_not_fit_its_list_is_left_out_with_the_reason() {
    let own_entry = |value: &str, more: &str| entry("P-0-0123", value, more);
    let cases = [
        (
            "refuse",
            CP2_CP3,
            own_entry("7", "on_difference = \"refuse\""),
            "P-0-0123 is 3, expected 7 (on_difference = \"refuse\")",
        ),
        (
            "never",
            NEVER,
            own_entry("7", ""),
            "P-0-0123 is 3, expected 7, and is write protected in every phase to come (by its attribute)",
        ),
        (
            "cp4",
            CP4,
            own_entry("7", ""),
            "P-0-0123 is 3, expected 7, and is write protected until CP4, where the axis may move (by its attribute)",
        ),
        (
            "range",
            CP2_CP3,
            own_entry("11", ""),
            "writing P-0-0123 = 11 (it is 3): the drive refuses the operation data with 0x7007: ",
        ),
        ("value", CP2_CP3, own_entry("1.5", ""), "P-0-0123: `1.5` is not a whole number"),
        ("absent", CP2_CP3, entry("P-0-0124", "1", ""), "P-0-0124: the drive refuses the IDN with 0x1001: "),
    ];
    for (what, attribute, entry, why) in cases {
        // Set before the one that fails: it stays, and is named.
        let first = self::entry("S-0-0121", "1", "");
        let mut rig = Rig::new(sercos("", &[first, entry]));
        let definition = Definition::value(own(123), attribute, "Own", 3).range(0, 10);
        rig.line.slaves_mut()[0].store_mut().define(definition);
        come_up(&mut rig);
        let line = format!("axis 1: the start-up list of the drive failed: {why}");
        let told = told(&rig);
        assert!(told.iter().any(|told| told.starts_with(&line)), "{what}: expected {line}\n{told:#?}");
        assert!(told.iter().all(|told| told.ends_with("; the drive is left out")), "{what}: {told:#?}");
        assert_eq!(held(&rig, own(123)), 3, "{what}");
        assert_eq!(rig.engine.axes()[0].state(), DriveState::NotReady, "{what}");
        assert_ne!(rig.engine.axes()[1].state(), DriveState::NotReady, "{what}: {}", rig.told());
    }
}

/// A drive that accepts a value and has another one afterwards.
#[test]
fn a_sercos_drive_that_does_not_keep_a_value_is_left_out() {
    let mut rig = with_own(sercos("", &[entry("P-0-0123", "7", "")]), CP2_CP3, 3);
    for _ in 0..40_000 {
        rig.run_for(profile_generic::time::DurationNs::from_micros(500));
        rig.line.slaves_mut()[0].store_mut().set_number_of(own(123), 3);
        if rig.status().phase == 4 {
            break;
        }
    }
    let expected = "axis 1: the start-up list of the drive failed: the drive took P-0-0123 = 7 and has 3 afterwards; written \
                    before: P-0-0123; the drive is left out";
    assert_eq!(told(&rig).first().map(String::as_str), Some(expected), "{}", rig.told());
    assert_eq!(rig.engine.axes()[0].state(), DriveState::NotReady);
}

#[test]
fn a_difference_that_only_warns_leaves_drive_and_axis_as_they_are() {
    let entries = [entry("P-0-0123", "7", ""), entry("S-0-0121", "1", "on_difference = \"refuse\"")];
    let mut rig = with_own(sercos("on_startup_difference = \"warn\"", &entries), CP2_CP3, 3);
    rig.until_ready();
    rig.run_for(millis(100));
    let expected = [
        "axis 1: start-up list: P-0-0123 is 3, expected 7; the drive is used nevertheless (on_difference = \"warn\")",
        "axis 1: start-up list: 1 entry holds, 0 of them written",
    ];
    assert_eq!(told(&rig), expected);
    assert_eq!(held(&rig, own(123)), 3);
    assert_ne!(rig.engine.axes()[0].state(), DriveState::NotReady);
}

/// A slide that comes by hot plug, and comes back.
#[test]
fn a_drive_that_is_plugged_in_gets_its_list_every_time() {
    let drive = "name = \"drive-b\"\naddress = 2\n";
    let configuration = with(BOX, drive, "sercos", "hot_plug = true\n", &entry("S-0-0123", "5.5", ""));
    let settings = Settings { configuration, drives: vec![(1, UnitKind::Rotary)], ..Settings::default() };
    let mut rig = Rig::ready(settings);
    let config = SlaveConfig { address: 2, classes: CLASSES_WITH_HOT_PLUG, ..SlaveConfig::default() };
    let feed = Idn::FEED_CONSTANT;
    let lines = |rig: &Rig, text: &str| told(rig).iter().filter(|line| line.contains(text)).count();
    rig.line.append(Slave::new(&config, Drive::new(linear()).expect("the servo works")));
    rig.line.mend(1);
    let set = "axis 2: start-up list: S-0-0123 was 10.0000 and is set to 5.5000";
    rig.run_until(millis(9_000), "the drive", |rig| rig.engine.axes()[1].state() != DriveState::NotReady);
    assert_eq!(rig.line.slaves()[1].store().number_of(feed), 55_000);
    assert_eq!(lines(&rig, set), 1, "{:#?}", told(&rig));
    // It forgets while it is away.
    rig.line.cut(1);
    rig.run_for(millis(3_000));
    rig.line.slaves_mut()[1].store_mut().set_number_of(feed, 100_000);
    rig.line.mend(1);
    rig.run_until(millis(9_000), "the list", |rig| rig.line.slaves()[1].store().number_of(feed) == 55_000);
    rig.run_for(millis(3_000));
    assert_eq!(lines(&rig, set), 2, "{:#?}", told(&rig));
    assert_eq!(rig.status().phase, 4);
}

fn node(rig: &Rig) -> &Node<Device> {
    rig.can[0].bus.nodes().next().expect("a device")
}

fn object(rig: &Rig, index: u16, sub: u8) -> i64 {
    node(rig).dictionary().number(index, sub)
}

#[test]
fn what_a_canopen_drive_has_otherwise_is_written_before_it_is_started_and_the_axis_moves_by_it() {
    let entries = [
        entry("6091:01", "5", ""),
        entry("0x6091.2", "2", "type = \"u32\""),
        entry("608F:02", "1", "type = \"u32\"\non_difference = \"refuse\""),
    ];
    let mut rig = Rig::new(can("", &entries));
    rig.run_until(millis(20_000), "the gear", |rig| [1, 2].map(|sub| object(rig, 0x6091, sub)) == [5, 2]);
    assert_eq!(node(&rig).state(), NmtState::PRE_OPERATIONAL, "{}", rig.told());
    rig.until_ready();
    let expected = [
        "axis 1: start-up list: 6091:01 was 1 and is set to 5",
        "axis 1: start-up list: 6091:02 was 1 and is set to 2",
        "axis 1: start-up list: 3 entries hold, 2 of them written",
    ];
    assert_eq!(told(&rig), expected);
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits: TURNTABLE },
        Step::Dwell { seconds: 0.5 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(20_000), "the end of the move", |rig| rig.report().steps_finished == 3);
    let motor = node(&rig).application().axes()[0].actual().position.get();
    assert!((motor - 5 * NANO / 2).abs() < NANO / 100, "{motor} nanoturns of the motor");
    let axis = rig.engine.axes()[0].feedback().position.get();
    assert!((axis - NANO).abs() < NANO / 250, "{axis} nanorevolutions of the axis");
}

#[test]
fn a_canopen_drive_that_does_not_fit_its_list_is_left_out_with_the_reason() {
    let cases = [
        (
            entry("2100:00", "7", "type = \"u16\"\non_difference = \"refuse\""),
            "2100:00 is 3, expected 7 (on_difference = \"refuse\")",
        ),
        (entry("2100:00", "7", "type = \"u32\""), "2100:00: the drive has 2 bytes, and the type `u32` has 4"),
        (
            entry("2100:00", "11", "type = \"u16\""),
            "writing 2100:00 = 11 (it is 3): the drive refuses it with 0x06090031: ",
        ),
        (
            entry("2101:00", "7", "type = \"u16\""),
            "writing 2101:00 = 7 (it is 5): the drive refuses it with 0x06010002: ",
        ),
        (entry("2102:00", "7", "type = \"u16\""), "2102:00: the drive refuses it with 0x06020000: "),
    ];
    for (entry, why) in cases {
        let mut rig = Rig::new(can("", &[entry]));
        let dictionary = rig.can[0].bus.nodes_mut().next().expect("a device").dictionary_mut();
        let value = ObjectDefinition::new("Own", DataType::U16, 3).range(0, 10);
        dictionary.add(Mux::new(0x2100, 0), value);
        dictionary.add(Mux::new(0x2101, 0), ObjectDefinition::new("Fixed", DataType::U16, 5).constant());
        rig.run_for(millis(3_000));
        let line = format!("axis 1: the start-up list of the drive failed: {why}");
        let told = told(&rig);
        assert!(
            told.iter().any(|told| told.starts_with(&line)),
            "expected {line}\n{told:#?}\n{}",
            rig.told()
        );
        assert_eq!(object(&rig, 0x2100, 0), 3);
        assert_ne!(node(&rig).state(), NmtState::OPERATIONAL, "{why}");
        assert_eq!(rig.engine.axes()[0].state(), DriveState::NotReady, "{why}");
        assert_ne!(rig.engine.axes()[1].state(), DriveState::NotReady, "{why}: {}", rig.told());
    }
}

#[test]
fn a_canopen_drive_that_does_not_keep_a_value_is_left_out_and_one_that_comes_back_gets_its_list() {
    let entries = [entry("6091:01", "5", ""), entry("6091:02", "2", "")];
    let mut rig = Rig::ready(can("", &entries));
    // Switched off and on, it has forgotten its gear.
    let forget = |rig: &mut Rig| {
        let now = rig.now();
        rig.can[0].bus.nodes_mut().next().expect("a device").power_cycle(now);
    };
    forget(&mut rig);
    rig.run_until(millis(20_000), "the gear", |rig| object(rig, 0x6091, 1) == 5);
    rig.run_until(millis(20_000), "operation", |rig| node(rig).state() == NmtState::OPERATIONAL);
    let set = "axis 1: start-up list: 6091:01 was 1 and is set to 5";
    assert_eq!(told(&rig).iter().filter(|line| *line == set).count(), 2, "{:#?}", told(&rig));
    // And now it does not keep it.
    forget(&mut rig);
    let expected = "axis 1: the start-up list of the drive failed: the drive took 6091:01 = 5 and has 1 afterwards; written \
                    before: 6091:01; the drive is left out";
    for _ in 0..20_000 {
        rig.run_for(profile_generic::time::DurationNs::from_micros(100));
        rig.can[0].bus.nodes_mut().next().expect("a device").dictionary_mut().set(0x6091, 1, 1);
        if told(&rig).iter().any(|line| line == expected) {
            return;
        }
    }
    panic!("{:#?}", told(&rig));
}

/// A backup of the drive is the list: what differs is written, what the gateway sets itself is left out, and the drive of another type
/// is refused.
#[test]
fn a_backup_is_a_list() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("startup_lists");
    fs::create_dir_all(&folder).expect("a folder");
    let backup = |name: &str, code: &str| -> PathBuf {
        let text = format!(
            "format = 1\naxis = \"turntable\"\nbus = \"sercos\"\nsource = \"S-0-0192\"\n\n[drive]\nvendor_code = \"{code}\"\n\
             serial_number = \"17\"\n\n[[parameter]]\nid = \"S-0-0032\"\nname = \"Primary operation mode\"\nvalue = \"\"\n\
             data = \"0100\"\n\n[[parameter]]\nid = \"S-0-0121\"\nname = \"Gear\"\nvalue = \"5\"\ndata = \"05000000\"\n\n\
             [[parameter]]\nid = \"S-0-0122\"\nname = \"Gear\"\nvalue = \"2\"\ndata = \"02000000\"\n"
        );
        let path = folder.join(name);
        fs::write(&path, text).expect("a file");
        path
    };
    let key = |path: &Path| format!("startup_file = \"{}\"", path.display());
    let vendor = |rig: &Rig| rig.line.slaves()[0].store().number_of(Idn::structured(1300, 0, 3));
    let code = format!("{:#06X}", vendor(&Rig::new(Settings::default()))).replace("0X", "0x");
    // The entry of the configuration counts more than that of the file.
    let path = backup("own.toml", &code);
    let mut rig = Rig::new(sercos(&key(&path), &[entry("S-0-0122", "3", "")]));
    rig.until_ready();
    assert_eq!([121, 122].map(|number| held(&rig, Idn::standard(number))), [5, 3], "{}", rig.told());
    let last = told(&rig).last().cloned().unwrap_or_default();
    assert_eq!(last, "axis 1: start-up list: 3 entries hold, 2 of them written");
    let path = backup("other.toml", "0x7777");
    let mut rig = Rig::new(sercos(&key(&path), &[]));
    come_up(&mut rig);
    let expected = "axis 1: the start-up list of the drive failed: S-0-1300.0.3 is ";
    let told = told(&rig);
    assert!(
        told[0].starts_with(expected) && told[0].contains(", expected 30583 (on_difference"),
        "{told:#?}"
    );
    assert_eq!(held(&rig, Idn::standard(121)), 1, "nothing is written to it");
}

/// Torque Limit - Positive (504) and Acceleration Limit (485) of the Motion Device Axis Object.
const TORQUE: &str = "0x42.1.504";
const ACCELERATION: &str = "66.1.485";

#[test]
fn what_a_devicenet_drive_has_otherwise_is_written_before_it_is_used_and_each_time_it_is_taken() {
    let entries = [
        entry(TORQUE, "80.5", "type = \"f32\""),
        entry(ACCELERATION, "\"hex:00007a44\"", "on_difference = \"write\""),
    ];
    let mut rig = Rig::new(devicenet("", &entries));
    assert_eq!((real(&rig, 504), real(&rig, 485)), (0.0, 0.0), "as it comes from its maker");
    rig.until_ready();
    assert_eq!((real(&rig, 504), real(&rig, 485)), (80.5, 1_000.0), "{}", rig.told());
    let written = [
        "axis 1: start-up list: 66.1.504 was 0 and is set to 80.5",
        "axis 1: start-up list: 66.1.485 was hex:00000000 and is set to hex:00007a44",
        "axis 1: start-up list: 2 entries hold, 2 of them written",
    ];
    assert_eq!(told(&rig), written, "{}", rig.told());
    assert!(rig.engine.axes().iter().all(|axis| axis.south().is_some()), "{}", rig.told());
    // Lost and taken anew, it has kept both.
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, false);
    rig.run_for(millis(500));
    assert_ne!(rig.engine.axes()[0].state(), DriveState::Inhibited, "{}", rig.told());
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, true);
    rig.run_until(millis(20_000), "the list again", |rig| told(rig).len() == 4);
    assert_eq!(told(&rig)[3], "axis 1: start-up list: 2 entries hold, 0 of them written");
    // Another one in its place gets them.
    replace_devicenet_drive(&mut rig);
    assert_eq!((real(&rig, 504), real(&rig, 485)), (0.0, 0.0), "as it comes from its maker");
    rig.run_until(millis(20_000), "the list again", |rig| told(rig).len() == 7);
    assert_eq!(told(&rig)[4..], written);
    assert_eq!((real(&rig, 504), real(&rig, 485)), (80.5, 1_000.0));
    rig.run_until(millis(5_000), "the drive", |rig| rig.engine.axes()[0].south().is_some());
}

/// A backup of a drive on DeviceNet is its list: the bytes of the file, with the types of the dictionary in the log. What the gateway
/// writes from the limits of the axis is left out, and a drive of another type is refused.
#[test]
fn a_backup_of_a_devicenet_drive_is_a_list() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("startup_lists");
    fs::create_dir_all(&folder).expect("a folder");
    let backup = |name: &str, product: u16| -> PathBuf {
        let parameter = |id: &str, value: f32| {
            let data: String = value.to_le_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
            format!(
                "\n[[parameter]]\nid = \"{id}\"\nname = \"x\"\nvalue = \"\"\ntype = \"f32\"\ndata = \"{data}\"\n"
            )
        };
        let text = format!(
            "format = 1\naxis = \"turntable\"\nbus = \"devicenet\"\nsource = \"dictionary\"\n\n[drive]\nvendor = \"1\"\n\
             device_type = \"37\"\nproduct_code = \"{product}\"\n{}{}{}",
            parameter("66.1.441", 75.5),
            // Position Error Tolerance, which the gateway writes; and a value that the drive has already.
            parameter("66.1.444", 9.0),
            parameter("66.1.461", 250.0),
        );
        let path = folder.join(name);
        fs::write(&path, text).expect("a file");
        path
    };
    let key = |path: &Path| format!("startup_file = \"{}\"\n", path.display());
    let path = backup("devicenet.toml", 1);
    let mut rig = Rig::new(devicenet(&key(&path), &[entry("66.1.462", "120", "")]));
    assert_eq!([441, 461, 462].map(|id| real(&rig, id)), [50.0, 250.0, 100.0], "as it comes from its maker");
    rig.until_ready();
    assert_eq!([441, 461, 462].map(|id| real(&rig, id)), [75.5, 250.0, 120.0], "{}", rig.told());
    let written = [
        "axis 1: start-up list: 66.1.441 was 50 and is set to 75.5",
        "axis 1: start-up list: 66.1.462 was 100 and is set to 120",
        "axis 1: start-up list: 6 entries hold, 2 of them written",
    ];
    assert_eq!(told(&rig), written, "{}", rig.told());
    assert_eq!(real(&rig, 444), 0.5 * 1_048_576.0, "that of the axis");
    let path = backup("devicenet-other.toml", 2);
    let mut rig = Rig::new(devicenet(&key(&path), &[]));
    rig.run_until(millis(20_000), "the list", |rig| !told(rig).is_empty());
    let expected = "axis 1: the start-up list of the drive failed: 1.1.3 is 1, expected 2 (on_difference";
    assert!(told(&rig)[0].starts_with(expected), "{:#?}", told(&rig));
    assert_eq!(real(&rig, 441), 50.0, "nothing is written to it");
}

#[test]
fn a_devicenet_drive_that_is_not_as_its_list_says_is_left_out_and_the_other_goes_on() {
    let cases = [
        (
            entry(TORQUE, "80.5", "type = \"f32\"\non_difference = \"refuse\""),
            "66.1.504 is 0, expected 80.5 (on_difference = \"refuse\")",
        ),
        // Axis State can only be read.
        (
            entry("0x42.1.650", "99", "type = \"u8\""),
            "writing 66.1.650 = 99 (it is 0): the drive refuses it with status 0x0e: ",
        ),
        (entry("0x77.1.3", "1", "type = \"u8\""), "119.1.3: the drive refuses it with status 0x16: "),
    ];
    for (entry, why) in cases {
        let mut rig = Rig::new(devicenet("", &[entry]));
        rig.run_for(millis(3_000));
        let told = told(&rig);
        let line = format!("axis 1: the start-up list of the drive failed: {why}");
        assert!(
            told.iter().any(|told| told.starts_with(&line)),
            "expected {line}\n{told:#?}\n{}",
            rig.told()
        );
        assert_eq!(real(&rig, 504), 0.0, "nothing was written");
        let [left_out, good] = rig.engine.axes() else { panic!("two axes") };
        assert!(left_out.south().is_none() && good.south().is_some(), "{why}: {}", rig.told());
    }
}

#[test]
fn a_devicenet_drive_with_another_value_is_used_with_a_warning() {
    let entries = [entry(TORQUE, "80.5", "type = \"f32\"")];
    let mut rig = Rig::ready(devicenet("on_startup_difference = \"warn\"\n", &entries));
    rig.run_for(millis(100));
    assert_eq!(real(&rig, 504), 0.0);
    let expected = [
        "axis 1: start-up list: 66.1.504 is 0, expected 80.5; the drive is used nevertheless (on_difference = \"warn\")",
        "axis 1: start-up list: 0 entries hold, 0 of them written",
    ];
    assert_eq!(told(&rig), expected, "{}", rig.told());
    assert!(rig.engine.axes()[0].south().is_some());
}
