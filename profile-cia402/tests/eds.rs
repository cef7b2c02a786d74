//! Data sheets and configurations: a corpus written for these tests, each with what was read, what was odd about it and the PDOs
//! that follow; and what may never happen with any bytes.

use std::fmt::Write as _;
use std::path::PathBuf;

use profile_cia402::eds::drive::{Direction, Pdo};
use profile_cia402::eds::layout::{Layout, Wanted, derive};
use profile_cia402::eds::{
    DataType, DeviceDescription, Form, Kind, Object, Reading, Refused, Setting, Severity, SubObject, Value,
    concise, read,
};
use profile_cia402::node::dictionary::{Access as NodeAccess, Mapping};
use profile_cia402::node::drive::{Device, identity};
use profile_cia402::node::{Config, Node};
use profile_cia402::wire::cob_id::NodeId;
use profile_generic::servo::ServoParameters;
use profile_generic::time::DurationNs;
use proptest::prelude::*;

/// Every file of the corpus.
const FILES: &[&str] = &[
    "broken.eds",
    "compact.dcf",
    "empty.eds",
    "every_type.eds",
    "fixed_mapping.eds",
    "hash_and_time.dcf",
    "huge.eds",
    "latin1.eds",
    "lists_that_lie.eds",
    "little_room.eds",
    "modular.eds",
    "not_an_eds.eds",
    "odd.eds",
    "plain_servo.eds",
    "plain_servo_node5.dcf",
    "two_axes.eds",
];

/// The node that defaults are shown for.
const NODE: u8 = 5;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/eds")
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(folder().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn reading(name: &str) -> Reading {
    read(&bytes(name)).unwrap_or_else(|refused| panic!("{name}: {refused}"))
}

fn description(name: &str) -> DeviceDescription {
    reading(name).description
}

#[test]
fn the_corpus_is_all_of_the_folder() {
    let entries = std::fs::read_dir(folder()).expect("the folder is there");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("readable").file_name().into_string().expect("plain")).collect();
    names.sort();
    assert_eq!(names, FILES);
}

#[test]
fn files_are_read_as_they_were() {
    for name in FILES {
        let reading = reading(name);
        let stem = name.replace('.', "_");
        insta::assert_snapshot!(format!("{stem}_parsed"), summary(&reading.description));
        insta::assert_snapshot!(format!("{stem}_diagnostics"), reading.diagnostics.to_string());
        insta::assert_snapshot!(format!("{stem}_layout"), layouts(&reading.description));
    }
}

/// Everything that a description says, one line for each value.
fn summary(description: &DeviceDescription) -> String {
    let mut text = format!("{:#?}\n{:#?}\n", description.file, description.device);
    if let Some(commissioning) = &description.commissioning {
        writeln!(text, "{commissioning:#?}").unwrap();
    }
    writeln!(text, "dummies {:?}\ncomments {:?}", description.dummies, description.comments).unwrap();
    for module in &description.modules {
        writeln!(text, "{module:?}").unwrap();
    }
    for object in &description.objects {
        let list = object.list.map_or_else(|| "in no list".to_owned(), |list| format!("{list:?}"));
        let flags = if object.flags == 0 { String::new() } else { format!(" flags {:#x}", object.flags) };
        writeln!(text, "{:04X} {:?} {} ({list}){flags}", object.index, object.kind, object.name).unwrap();
        object.subs.iter().for_each(|value| writeln!(text, "  {}", line(value)).unwrap());
    }
    text
}

fn line(value: &SubObject) -> String {
    let mut text = format!("{:X} {} {} {}", value.sub, value.data_type, value.access.word(), value.name);
    let settings = [
        ("default", &value.default),
        ("value", &value.parameter),
        ("low", &value.low),
        ("high", &value.high),
    ];
    for (what, setting) in settings {
        if let Some(setting) = setting {
            write!(text, " {what} {setting}").unwrap();
        }
    }
    if value.pdo_mapping {
        text.push_str(" PDO");
    }
    text
}

/// What the gateway wants of an axis in the cyclic synchronous modes, and what follows.
fn layouts(description: &DeviceDescription) -> String {
    let mut text = format!("drive {}\n", description.is_drive());
    for axis in description.axes() {
        let kind = axis.device_type.map_or("?".to_owned(), |kind| format!("{kind:#010x}"));
        let known = |mode: &(u8, &str)| axis.has_mode(mode.0).unwrap_or(false);
        let names = [
            (1, "pp"),
            (2, "vl"),
            (3, "pv"),
            (4, "tq"),
            (6, "hm"),
            (7, "ip"),
            (8, "csp"),
            (9, "csv"),
            (10, "cst"),
        ];
        let modes: Vec<&str> = names.into_iter().filter(known).map(|(_, name)| name).collect();
        let modes = if axis.modes.is_some() { modes.join(" ") } else { "unknown".to_owned() };
        writeln!(text, "axis {}: type {kind}, modes {modes}", axis.number).unwrap();
    }
    for direction in Direction::BOTH {
        description.pdos(direction, NODE).iter().for_each(|pdo| writeln!(text, "{}", pdo_line(pdo)).unwrap());
    }
    let axes = description.axes();
    let of_axes = |objects: &[Wanted]| -> Vec<Wanted> {
        let axes = axes.iter();
        axes.flat_map(|axis| {
            objects.iter().map(|wanted| Wanted { index: axis.index(wanted.index), ..*wanted })
        })
        .collect()
    };
    let receive = of_axes(&[
        Wanted::must(0x6040, 0),
        Wanted::must(0x607A, 0),
        Wanted::may(0x60B2, 0),
        Wanted::may(0x6060, 0),
        Wanted::may(0x60FF, 0),
        Wanted::may(0x60FE, 1),
    ]);
    let transmit = of_axes(&[
        Wanted::must(0x6041, 0),
        Wanted::must(0x6064, 0),
        Wanted::may(0x6077, 0),
        Wanted::may(0x6061, 0),
        Wanted::may(0x606C, 0),
        Wanted::may(0x60F4, 0),
        Wanted::may(0x6502, 0),
    ]);
    text.push_str(&layout_text(&derive(description, NODE, &receive, &transmit)));
    text
}

fn pdo_line(pdo: &Pdo) -> String {
    let name = if pdo.direction == Direction::Receive { "RPDO" } else { "TPDO" };
    let id = pdo.cob_id.map_or("none".to_owned(), |id| format!("{id:03X}"));
    let entries: Vec<String> = pdo.mapping.iter().map(ToString::to_string).collect();
    let on = if pdo.valid { "on" } else { "off" };
    let kind = pdo.transmission.map_or("?".to_owned(), |kind| kind.to_string());
    let changeable = match pdo.entries_max {
        0 => "fixed".to_owned(),
        entries => format!("up to {entries}"),
    };
    format!("{name}{} id {id} {on} type {kind} {changeable}: {}", pdo.number + 1, entries.join(" "))
}

fn layout_text(layout: &Layout) -> String {
    let mut text = format!("layout, usable: {}\n", layout.is_usable());
    for pdo in &layout.pdos {
        let name = if pdo.direction == Direction::Receive { "RPDO" } else { "TPDO" };
        let id = pdo.cob_id.map_or("to be given".to_owned(), |id| format!("{id:03X}"));
        let entries: Vec<String> = pdo.entries.iter().map(ToString::to_string).collect();
        let how = if pdo.write_mapping { "written" } else { "as it is" };
        writeln!(
            text,
            "  {name}{} id {id} {how}, {} bytes: {}",
            pdo.number + 1,
            pdo.bytes(),
            entries.join(" ")
        )
        .unwrap();
    }
    for (direction, number) in &layout.unused {
        let name = if *direction == Direction::Receive { "RPDO" } else { "TPDO" };
        writeln!(text, "  {name}{} to be switched off", number + 1).unwrap();
    }
    layout.left_out.iter().for_each(|left| writeln!(text, "  left out {left}").unwrap());
    text
}

#[test]
fn good_files_have_no_diagnostics() {
    for name in [
        "every_type.eds",
        "fixed_mapping.eds",
        "hash_and_time.dcf",
        "huge.eds",
        "little_room.eds",
        "plain_servo.eds",
        "plain_servo_node5.dcf",
        "two_axes.eds",
    ] {
        assert_eq!(reading(name).diagnostics.to_string(), "", "{name}");
    }
}

#[test]
fn the_broken_file_has_most_kinds_of_diagnostics() {
    let files = [
        "broken.eds",
        "compact.dcf",
        "odd.eds",
        "latin1.eds",
        "lists_that_lie.eds",
        "modular.eds",
        "empty.eds",
    ];
    let readings = files.map(reading);
    let told = |kind: &Kind| {
        let mut all = readings.iter().flat_map(|reading| reading.diagnostics.list());
        all.any(|diagnostic| diagnostic.kind == *kind)
    };
    let untold: Vec<&Kind> = Kind::ALL.iter().filter(|kind| !told(kind)).collect();
    // Only a file of megabytes has it.
    assert_eq!(untold, [&Kind::TooMany]);
    assert_eq!(readings[0].diagnostics.worst(), Some(Severity::Error));
}

/// What is wrong costs the entry that it stands in, and nothing else.
#[test]
fn what_is_good_in_a_broken_file_is_read() {
    let broken = description("broken.eds");
    assert_eq!(broken.device.vendor_name, "Axisbridge test files");
    assert_eq!((broken.device.vendor_number, broken.device.rpdos), (None, Some(4)));
    // Of two values the first counts, and that is none.
    assert_eq!(broken.sub(0x1000, 0).unwrap().default, None);
    assert_eq!(broken.sub(0x6040, 0).unwrap().data_type, DataType::UNSIGNED16);
    assert_eq!(broken.sub(0x2001, 0).unwrap().parameter, Some(Setting::plain(Value::Signed(-500))));
    assert_eq!(broken.commissioning.as_ref().unwrap().node_id, None);
}

#[test]
fn odd_files_say_what_plain_ones_do() {
    let odd = description("odd.eds");
    assert_eq!(odd.device.vendor_number, Some(0xA8B1));
    assert_eq!((odd.device.product_number, odd.device.revision_number), (Some(0o777), Some(0x1_0000)));
    assert_eq!(odd.device.product_name, "Odd; but a semicolon within");
    assert_eq!(odd.value(0x1014, 0, NODE), Some(Value::Unsigned(0x85)));
    assert_eq!(odd.value(0x1400, 1, NODE), Some(Value::Unsigned(0x205)));
    assert_eq!(odd.value(0x1400, 2, NODE), Some(Value::Unsigned(255)));
    assert_eq!(odd.value(0x1008, 0, NODE), Some(Value::Text("Odd servo, rev. A=1".to_owned())));
    assert_eq!(odd.value(0x6060, 0, NODE), Some(Value::Signed(-1)));
    assert_eq!(odd.value(0x607A, 0, NODE), Some(Value::Signed(-16)));
    assert_eq!(odd.value(0x2000, 0, NODE), Some(Value::Real(-2500.0)));
    assert_eq!(odd.value(0x2001, 0, NODE), Some(Value::Bytes(vec![0xDE, 0xAD, 0xBE, 0xEF])));
    assert_eq!(odd.sub(0x2002, 0).unwrap().data_type, DataType::DOMAIN);
    assert_eq!(description("latin1.eds").device.vendor_name, "Müller & Söhne");
}

/// A hash begins no comment within a line, and the two types of time are numbers of 48 bits: kept, transferred and written back.
#[test]
fn hashes_are_characters_and_times_are_numbers_of_48_bits() {
    let before = description("hash_and_time.dcf");
    let set = before.commissioning.as_ref().expect("a configuration");
    assert_eq!(
        (before.device.product_name.as_str(), before.device.order_code.as_str()),
        ("Servo #2", "#4711-A")
    );
    assert_eq!(set.node_name, "Press #3");
    assert_eq!(before.comments, ["# is a character like any other here", "Two # in # a line"]);
    assert_eq!(before.object(0x2001).expect("there").name, "# of starts");
    let text = before.to_text(Form::Configuration);
    let after = read(text.as_bytes()).expect("not refused");
    assert_eq!(after.diagnostics.to_string(), "");
    for description in [&before, &after.description] {
        for (index, data_type, default, parameter) in [
            (0x2000, DataType::VISIBLE_STRING, Some("#1"), Some("Axis #3, press # 2")),
            (0x2002, DataType::UNICODE_STRING, Some("#FF8000"), Some("a#b")),
            (0x2010, DataType::TIME_OF_DAY, Some("0"), Some("0x3C8A0499A7C0")),
            (0x2011, DataType::TIME_OF_DAY, Some("0x5265BFF"), Some("0x100000000")),
            (0x2012, DataType::TIME_OF_DAY, None, None),
            (0x2013, DataType::TIME_DIFFERENCE, Some("0xFFFF0FFFFFFF"), Some("1")),
            (0x2014, DataType::TIME_DIFFERENCE, Some("0xEA60"), None),
            (0x2015, DataType::TIME_DIFFERENCE, None, None),
        ] {
            let value = description.sub(index, 0).expect("there");
            let shown = |setting: &Option<Setting>| setting.as_ref().map(ToString::to_string);
            let found = (value.data_type, shown(&value.default), shown(&value.parameter));
            assert_eq!(
                found,
                (data_type, default.map(str::to_owned), parameter.map(str::to_owned)),
                "{index:04X}"
            );
        }
        let high = description.sub(0x2011, 0).and_then(|value| value.high.clone());
        assert_eq!(high, Some(Setting::plain(Value::Unsigned(0xFFFF_FFFF_FFFF))));
    }
    // 28 bits of milliseconds, 4 reserved ones, 16 of days, little endian (CiA 301).
    let writes = before.configuration(NODE).writes;
    let lines: Vec<String> = writes.iter().map(|write| write.entry().to_string()).collect();
    assert!(lines.contains(&"2010:0 = C0 A7 99 04 8A 3C".to_owned()), "{lines:?}");
    assert!(lines.contains(&"2011:0 = 00 00 00 00 01 00".to_owned()), "{lines:?}");
    assert!(lines.contains(&"2013:0 = 01 00 00 00 00 00".to_owned()), "{lines:?}");
}

/// What is no time of 48 bits, and no number because of what a hash begins, is named by line, section and key.
#[test]
fn wrong_times_and_numbers_with_a_hash_are_named_by_line_and_key() {
    let object = |index: u16, data_type: &str, value: &str| {
        format!(
            "[{index:04X}]\nParameterName=x\nObjectType=7\nDataType={data_type}\nAccessType=rw\n{value}\n"
        )
    };
    let text = [
        object(0x2000, "0x000C", "DefaultValue=0x1000000000000"),
        object(0x2001, "0x000D", "ParameterValue=-1"),
        object(0x2002, "0x000C", "ParameterValue=12:00:00"),
        object(0x2003, "0x0007", "DefaultValue=0x10 # sixteen"),
        object(0x2004, "0x0007", "# DefaultValue=5"),
    ]
    .concat();
    let Reading { description, diagnostics } = read(text.as_bytes()).expect("not refused");
    let errors: Vec<String> = diagnostics
        .list()
        .iter()
        .filter(|diagnostic| diagnostic.severity() == Severity::Error)
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        errors,
        [
            "6:14: error[range]: [2000] DefaultValue: expected 0 to 281474976710655, as TIME_OF_DAY has, got 0x1000000000000",
            "12:16: error[range]: [2001] ParameterValue: expected 0 to 281474976710655, as TIME_DIFFERENCE has, got -1",
            "18:16: error[value]: [2002] ParameterValue: expected a number (0x hexadecimal, 0 octal, decimal), got 12:00:00",
            "24:14: error[value]: [2003] DefaultValue: expected a number (0x hexadecimal, 0 octal, decimal), got 0x10 # sixteen",
        ]
    );
    let values = description.objects.iter().map(|object| object.subs[0].setting());
    assert!(values.into_iter().all(|setting| setting.is_none()), "a value that is wrong is none");
}

#[test]
fn a_configuration_is_written_in_the_order_that_drives_accept() {
    let configuration = description("plain_servo_node5.dcf").configuration(NODE);
    let lines: Vec<String> = configuration.writes.iter().map(|write| write.entry().to_string()).collect();
    assert_eq!(
        lines,
        [
            "1016:1 = 2C 01 7F 00",
            "1017:0 = 64 00",
            "6060:0 = 08",
            "607D:1 = 60 79 FE FF",
            "607D:2 = A0 86 01 00",
            "60C2:1 = 02",
            "1400:1 = 05 02 00 80",
            "1600:0 = 00",
            "1600:1 = 10 00 40 60",
            "1600:2 = 20 00 7A 60",
            "1600:0 = 02",
            "1400:2 = 01",
            "1400:1 = 05 02 00 00",
            "1800:1 = 85 01 00 C0",
            "1A00:0 = 00",
            "1A00:1 = 10 00 41 60",
            "1A00:2 = 20 00 64 60",
            "1A00:3 = 10 00 77 60",
            "1A00:0 = 03",
            "1800:2 = 01",
            "1800:1 = 85 01 00 40",
            "1020:1 = 2B 3D 00 00",
            "1020:2 = 80 62 EE 01",
            "1010:1 = 73 61 76 65",
        ]
    );
    // The status word has a value in the file and cannot be written.
    assert_eq!(configuration.left_out, [(0x6041, 0)]);
    let bytes = configuration.to_bytes();
    let back: Vec<String> = concise::parse(&bytes).unwrap().iter().map(ToString::to_string).collect();
    assert_eq!(back, lines);
}

/// What only may be there never takes the place of what must be, and controlword and set-point of an axis travel together.
#[test]
fn what_must_be_there_comes_first_and_axis_by_axis() {
    let two = description("two_axes.eds");
    let wanted = [
        Wanted::may(0x60FE, 1),
        Wanted::may(0x60FF, 0),
        Wanted::must(0x6040, 0),
        Wanted::must(0x6840, 0),
        Wanted::must(0x607A, 0),
        Wanted::must(0x687A, 0),
    ];
    let layout = derive(&two, NODE, &wanted, &[]);
    let place = |index| layout.find(Direction::Receive, index, 0).map(|(pdo, bit)| (pdo.number, bit));
    assert_eq!((place(0x6040), place(0x607A)), (Some((0, 0)), Some((0, 16))));
    assert_eq!((place(0x6840), place(0x687A)), (Some((64, 0)), Some((64, 16))));
    assert!(layout.is_usable() && layout.left_out.is_empty(), "{layout:?}");
    assert_eq!(layout.unused, [(Direction::Transmit, 0), (Direction::Transmit, 1)]);
}

/// An RPDO as it is brings everything that is in it: that is taken only where there is no use without.
#[test]
fn fixed_rpdos_with_more_than_is_wanted_are_taken_only_for_what_must_be_there() {
    let fixed = description("fixed_mapping.eds");
    let layout = derive(
        &fixed,
        NODE,
        &[Wanted::must(0x6040, 0), Wanted::must(0x607A, 0), Wanted::may(0x60B2, 0)],
        &[],
    );
    let numbers: Vec<u16> = layout.pdos.iter().map(|pdo| pdo.number).collect();
    // 60B1 would come with 60B2.
    assert_eq!((numbers, layout.left_out.len()), (vec![1], 1));
    let layout = derive(&fixed, NODE, &[Wanted::must(0x60B2, 0)], &[]);
    assert_eq!((layout.pdos[0].number, layout.pdos[0].write_mapping), (2, false));
}

#[test]
fn values_of_a_configuration_must_fit_the_object() {
    let mut servo = description("plain_servo.eds");
    assert!(servo.set_parameter(0x6060, 0, Setting::plain(Value::Signed(8))));
    assert!(!servo.set_parameter(0x6060, 0, Setting::plain(Value::Unsigned(8))));
    assert!(!servo.set_parameter(0x6060, 1, Setting::plain(Value::Signed(8))));
    assert!(!servo.set_parameter(0x5FFF, 0, Setting::plain(Value::Signed(8))));
    let configuration = servo.configuration(1);
    assert_eq!(configuration.writes.len(), 1);
    assert_eq!(configuration.writes[0].data, [8]);
}

/// A device that has the mapping already and gives no value for the count: it is cleared for the entries and comes back.
#[test]
fn a_count_that_is_not_given_comes_back_behind_the_entries() {
    let mut servo = description("plain_servo.eds");
    assert!(servo.set_parameter(0x1600, 1, Setting::plain(Value::Unsigned(0x6071_0010))));
    let lines: Vec<String> =
        servo.configuration(1).writes.iter().map(|write| write.entry().to_string()).collect();
    assert_eq!(
        lines,
        [
            "1400:1 = 01 02 00 80",
            "1600:0 = 00",
            "1600:1 = 10 00 71 60",
            "1600:0 = 01",
            "1400:1 = 01 02 00 00"
        ]
    );
}

/// What is written reads as what was written, and a second time the text is the same.
#[test]
fn written_files_say_the_same() {
    for name in FILES {
        let mut before = description(name);
        // Objects of modules are not written.
        before.modules.clear();
        let text = before.to_text(Form::Configuration);
        let after = read(text.as_bytes()).expect("read").description;
        let mut expected = before.clone();
        if let Some(set) = &mut expected.commissioning {
            // The commissioning of a file without a value is written without one.
            set.net_number = set.net_number.or(None);
        }
        assert_eq!(summary(&after), summary(&expected), "{name}");
        assert_eq!(after.to_text(Form::Configuration), text, "{name}");
        let sheet = read(before.to_text(Form::Sheet).as_bytes()).expect("read").description;
        assert_eq!(sheet.commissioning, None, "{name}");
        assert!(
            sheet.objects.iter().flat_map(|object| &object.subs).all(|value| value.parameter.is_none()),
            "{name}"
        );
    }
}

#[test]
fn truncation_at_every_byte_never_panics() {
    for name in FILES {
        let bytes = bytes(name);
        // All prefixes of a large file would take minutes: of most places it is what stands before them.
        // The huge one has nothing that the others have not.
        let step = if *name == "huge.eds" { 23 } else { 1 };
        for end in (0..bytes.len()).step_by(step) {
            let _ = read(&bytes[end.saturating_sub(150)..end]).expect("a part of a file is not refused");
        }
        for end in (0..bytes.len()).step_by(4999) {
            let _ = layouts(&read(&bytes[..end]).expect("a part of a file is not refused").description);
        }
    }
}

#[test]
fn small_files_are_cut_at_every_byte() {
    for name in ["broken.eds", "compact.dcf", "odd.eds", "modular.eds", "not_an_eds.eds"] {
        let bytes = bytes(name);
        for end in 0..bytes.len() {
            let description = read(&bytes[..end]).expect("a part of a file is not refused").description;
            let _ = (layouts(&description), description.configuration(NODE));
        }
    }
}

/// A small file that asks for gigabytes gets none.
#[test]
fn compact_sections_take_no_more_than_a_device_can_have() {
    let mut text = String::new();
    for index in 0..0xFFFF {
        writeln!(text, "[{index:04X}]\nParameterName=x\nDataType=7\nAccessType=rw\nCompactSubObj=254")
            .unwrap();
    }
    let reading = read(text.as_bytes()).expect("not refused");
    let subs: usize = reading.description.objects.iter().map(|object: &Object| object.subs.len()).sum();
    assert!(subs < 300_000, "{subs}");
    assert!(reading.diagnostics.more() > 0);
    assert_eq!(reading.diagnostics.worst(), Some(Severity::Error));
}

#[test]
fn what_is_no_data_sheet_is_refused_with_a_reason() {
    let refused = |bytes: &[u8]| read(bytes).expect_err("refused").to_string();
    assert_eq!(
        refused(&vec![b'\n'; 10 * 1024 * 1024 + 1]),
        "expected at most 10485760 bytes, got 10485761: not a data sheet"
    );
    assert_eq!(
        refused(&vec![b'x'; 20_000]),
        "line 1: expected at most 16384 bytes, got 20000: not a data sheet"
    );
    assert_eq!(
        refused("[a]\n".repeat(1_000_000).as_bytes()),
        "line 100001: expected at most 100000 sections, got one more: not a data sheet"
    );
    assert_eq!(read(&[0xFE, 0xFF, 0, b'[']), Err(Refused::Utf16));
}

fn any_text() -> impl Strategy<Value = String> {
    // Pieces of which data sheets are made, in any order.
    let pieces = prop::sample::select(vec![
        "[1000]",
        "[1018]",
        "[1018sub1]",
        "[1003Name]",
        "[1003Value]",
        "[1003]",
        "[1400]",
        "[1400sub1]",
        "[1600sub0]",
        "[1600sub1]",
        "[1600]",
        "[DeviceInfo]",
        "[MandatoryObjects]",
        "[OptionalObjects]",
        "[DeviceComissioning]",
        "[DummyUsage]",
        "[Comments]",
        "[M1ModuleInfo]",
        "ParameterName=x",
        "ObjectType=8",
        "ObjectType=9",
        "ObjectType=7",
        "DataType=7",
        "DataType=0x0002",
        "DataType=8",
        "AccessType=rw",
        "AccessType=ro",
        "DefaultValue=$NODEID+0x80",
        "DefaultValue=-1",
        "DefaultValue=0xFFFFFFFF",
        "ParameterValue=3",
        "LowLimit=5",
        "HighLimit=1",
        "CompactSubObj=3",
        "CompactSubObj=255",
        "CompactPDO=255",
        "NrOfRXPDO=600",
        "NrOfTXPDO=65535",
        "SubNumber=2",
        "SupportedObjects=2",
        "1=0x1000",
        "2=0x1018",
        "NrOfEntries=1",
        "3=4",
        "PDOMapping=1",
        "Dummy0005=1",
        "Line1=x",
        "Lines=1",
        "NodeID=5",
        "Granularity=0",
        "=",
        "[",
        "]",
        ";",
        "\u{e4}",
        "[10\u{e4}\u{f6}]",
        "\u{0}",
    ]);
    let line_end = prop::sample::select(vec!["\n", "\r\n", "\r", " "]);
    prop::collection::vec((pieces, line_end), 0..80)
        .prop_map(|lines| lines.into_iter().map(|(piece, end)| format!("{piece}{end}")).collect())
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let _ = read(&bytes);
    }

    #[test]
    fn no_order_of_lines_makes_it_panic(text in any_text()) {
        let description = read(text.as_bytes()).expect("not refused").description;
        let _ = (layouts(&description), description.configuration(NODE).to_bytes());
        for diagnostic in read(text.as_bytes()).expect("not refused").diagnostics.list() {
            let lines = text.replace("\r\n", "\n").replace('\r', "\n").split('\n').count();
            prop_assert!(usize::try_from(diagnostic.line).unwrap() <= lines, "{diagnostic}");
        }
    }

    /// What any text says is said by what is written of it.
    #[test]
    fn any_description_is_read_as_it_was_written(text in any_text()) {
        let mut before = read(text.as_bytes()).expect("not refused").description;
        before.modules.clear();
        let after = read(before.to_text(Form::Configuration).as_bytes()).expect("not refused").description;
        prop_assert_eq!(summary(&after), summary(&before));
    }

    /// Whatever is wanted of whatever device: no PDO has too much, nothing is lost without a word.
    #[test]
    fn layouts_hold_what_they_promise(
        name in prop::sample::select(FILES),
        wanted in prop::collection::vec((0x6040_u16..0x6100, 0_u8..3, any::<bool>()), 0..30),
    ) {
        let description = description(name);
        let wanted: Vec<Wanted> =
            wanted.into_iter().map(|(index, sub, must)| Wanted { index, sub, must }).collect();
        let layout = derive(&description, NODE, &wanted, &wanted);
        for pdo in &layout.pdos {
            prop_assert!(pdo.bytes() <= 8 || !pdo.write_mapping);
            let own = description.pdos(pdo.direction, NODE).into_iter().find(|own| own.number == pdo.number);
            let own = own.expect("a PDO that the device has");
            prop_assert!(!pdo.write_mapping || pdo.entries.len() <= usize::from(own.entries_max));
            prop_assert!(pdo.write_mapping || pdo.entries == own.mapping);
        }
        for direction in Direction::BOTH {
            for wish in &wanted {
                let found = layout.find(direction, wish.index, wish.sub).is_some();
                let left = layout.left_out.iter().any(|left| {
                    left.direction == direction && (left.wanted.index, left.wanted.sub) == (wish.index, wish.sub)
                });
                prop_assert!(found != left, "{wish}");
            }
        }
    }
}

/// The data sheet that a simulated drive carries says what the drive has.
#[test]
fn the_simulated_drive_carries_a_good_data_sheet() {
    for axes in [1, 2, 8] {
        let device = Device::new(&vec![ServoParameters::default(); axes]).expect("a device");
        let config = Config {
            node: NodeId::new(NODE).ok(),
            identity: identity(axes, 1),
            boot_time: DurationNs::from_millis(10),
            has_blocks: true,
            has_mapping: true,
        };
        let node = Node::new(&config, device);
        let Reading { description, diagnostics } = read(node.eds()).expect("not refused");
        assert_eq!(diagnostics.to_string(), "", "{axes} axes");
        assert_eq!((description.is_drive(), description.axes().len()), (true, axes));
        assert_eq!(description.number(0x1018, 1, NODE), Some(config.identity.vendor));
        assert_eq!(description.number(0x1018, 2, NODE), Some(config.identity.product));
        let entries = node.dictionary().entries();
        let described: usize = description.objects.iter().map(|object| object.subs.len()).sum();
        assert_eq!(described, entries.len());
        for entry in entries {
            let mux = entry.mux();
            let value = description.sub(mux.index, mux.sub).unwrap_or_else(|| panic!("{mux:?}"));
            assert_eq!(value.data_type.0, entry.definition().data_type.code(), "{mux:?}");
            assert_eq!(value.access.writes(), entry.definition().access == NodeAccess::ReadWrite, "{mux:?}");
            let mapping = entry.definition().mapping;
            let [receives, transmits] =
                [value.access.receives(), value.access.transmits()].map(|may| may && value.pdo_mapping);
            assert_eq!(receives, matches!(mapping, Mapping::Rpdo | Mapping::Both), "{mux:?}");
            assert_eq!(transmits, matches!(mapping, Mapping::Tpdo | Mapping::Both), "{mux:?}");
        }
        // And a drive in csp finds its way into PDOs, axis by axis.
        let axes = description.axes();
        let wanted = |objects: [u16; 2]| -> Vec<Wanted> {
            axes.iter().flat_map(|axis| objects.map(|index| Wanted::must(axis.index(index), 0))).collect()
        };
        let layout = derive(&description, NODE, &wanted([0x6040, 0x607A]), &wanted([0x6041, 0x6064]));
        assert!(layout.is_usable(), "{layout:?}");
        for axis in &axes {
            let own =
                |index| layout.find(Direction::Receive, axis.index(index), 0).map(|(pdo, _)| pdo.number);
            assert_eq!(own(0x6040), own(0x607A));
        }
    }
}
