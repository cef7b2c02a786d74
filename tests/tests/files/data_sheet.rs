//! The electronic data sheet: the command that writes it, the parser and checker of another maker (eds-pie, PyPI), and the
//! networks' table against what the device really is.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use axisbridge::config::Config;
use axisbridge::engine::build::{Host, adapter_config};
use axisbridge::mapping::{ConnectionDataFormat, ETHERNET_IP, Mapping, networks};
use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use profile_cip::device::motion_open;
use profile_cip::device::object_list::OBJECT_CLASSES;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::forward_open::Trigger;
use profile_cip::wire::motion::Format;
use serde_json::{Value, json};

const EXAMPLE: &str = include_str!("../../../examples/two-axes-in-process.toml");

pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the scratch folder can be written");
    folder
}

fn eds(arguments: &[&str]) -> Output {
    Command::new(axisbridge()).arg("eds").args(arguments).output().expect("the program starts")
}

/// The example with its two axes in two devices.
fn two_devices() -> String {
    let second = EXAMPLE
        .find("[[axis]]")
        .map(|at| {
            let device = &EXAMPLE[EXAMPLE.find("[[device]]").expect("a device")..at];
            device
                .replace("name = \"front\"", "name = \"second\"")
                .replace("127.0.0.2", "127.0.0.3")
                .replace("[\"turntable\", \"slide\"]", "[\"slide\"]")
                .replace("product_code = 1001", "product_code = 1002")
        })
        .expect("an axis");
    EXAMPLE.replace("[\"turntable\", \"slide\"]", "[\"turntable\"]") + "\n" + &second
}

#[test]
fn the_command_writes_the_bytes_that_the_device_serves() {
    let folder = scratch("eds-command");
    let file = folder.join("box.toml");
    std::fs::write(&file, EXAMPLE).expect("written");
    let path = file.to_str().expect("a plain path");
    let config = Config::parse(EXAMPLE, "box.toml").expect("the example is good");
    let served = adapter_config(&config, 0, Host { mac: [2; 6], incarnation: 3 }).expect("a device").eds;

    let printed = eds(&["--config", path]);
    assert_eq!((printed.status.code(), &*printed.stdout), (Some(0), &*served));
    let name = config.devices[0].name.clone();
    let out = folder.join("sheets");
    let written = eds(&["--config", path, "--output", out.to_str().expect("a plain path")]);
    let sheet = out.join(format!("{name}.eds"));
    assert_eq!(written.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&written.stdout), format!("{}\n", sheet.display()));
    assert_eq!(std::fs::read(&sheet).expect("the sheet is there"), &*served);

    let unknown = eds(&["--config", path, "--device", "nobody"]);
    assert_eq!((unknown.status.code(), unknown.stdout.len()), (Some(2), 0));
    let expected = format!("error: there is no device `nobody`; expected one of: {name}\n");
    assert_eq!(String::from_utf8_lossy(&unknown.stderr), expected);
    assert_eq!(eds(&["--config", "/nonexistent.toml"]).status.code(), Some(1));
}

#[test]
fn of_several_devices_one_is_named_or_all_are_written() {
    let folder = scratch("eds-devices");
    let file = folder.join("box.toml");
    std::fs::write(&file, two_devices()).expect("written");
    let path = file.to_str().expect("a plain path");
    let config = Config::load(&file).expect("two devices are good");
    let names: Vec<_> = config.devices.iter().map(|device| device.name.as_str()).collect();

    let both = eds(&["--config", path]);
    assert_eq!((both.status.code(), both.stdout.len()), (Some(2), 0));
    let message = format!(
        "error: there are several devices, {}; name one with --device, or give --output\n",
        names.join(", ")
    );
    assert_eq!(String::from_utf8_lossy(&both.stderr), message);
    let one = eds(&["--config", path, "--device", names[1]]);
    assert!(String::from_utf8_lossy(&one.stdout).contains("ProdCode = 1002;"));
    let written = eds(&["--config", path, "--output", folder.to_str().expect("a plain path")]);
    assert_eq!(written.status.code(), Some(0));
    for name in &names {
        assert!(folder.join(format!("{name}.eds")).is_file(), "{name}");
    }
}

#[test]
fn the_parser_of_another_maker_reads_the_sheet_and_finds_nothing_wrong() {
    const TEST: &str = "the_parser_of_another_maker_reads_the_sheet_and_finds_nothing_wrong";
    let Some(python) = peer::python_or_skip(TEST, "eds_pie") else { return };
    let folder = scratch("eds-pie");
    let file = folder.join("box.toml");
    std::fs::write(&file, EXAMPLE).expect("written");
    let sheet = folder.join("device.eds");
    let printed = eds(&["--config", file.to_str().expect("a plain path")]);
    std::fs::write(&sheet, &printed.stdout).expect("written");

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/eds_pie_reader.py");
    let output = Command::new(python).arg(script).arg(&sheet).output().expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let got: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(got["protocol"], "EtherNetIP");
    let sections = &got["sections"];
    let connection = &sections["Connection Manager"]["Connection1"];
    assert_eq!(
        connection,
        &json!([
            0x0401_0002u32,
            0x4444_000Au32,
            "Param1",
            "Param2",
            "",
            "Param1",
            "Param3",
            "",
            "",
            "",
            "",
            "",
            "CIP Motion",
            "The motion connection: commands and actual values of all axes",
            "20 42 2C 51 2C 02 80 04 01 00 00 00 00 00 00 00"
        ])
    );
    assert_eq!(sections["Device"]["ProdType"], json!([37]));
    let limits = |number: u8| {
        let fields = &sections["Params"][format!("Param{number}")];
        (fields[9].as_u64(), fields[10].as_u64())
    };
    assert_eq!(limits(1), (Some(2000), Some(16_000)));
    assert_eq!(limits(2), (Some(8), Some(1398)));
    assert_eq!(sections["Capacity"]["TSpec1"], json!(["Rx", 1400, 500]));
    // It has never heard of the Time Sync object; there is nothing else that it does not like.
    let findings: Vec<_> =
        got["findings"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    for finding in &findings {
        let known = finding.contains("[Time Sync Class]") || finding.contains("{section.keyword,}");
        assert!(known, "{finding}");
    }
    assert_eq!(findings.iter().filter(|finding| finding.contains("Unknown Section")).count(), 1);
}

#[test]
fn the_parser_of_another_maker_reads_the_assemblies_of_a_sheet() {
    const TEST: &str = "the_parser_of_another_maker_reads_the_assemblies_of_a_sheet";
    let Some(python) = peer::python_or_skip(TEST, "eds_pie") else { return };
    let folder = scratch("eds-pie-assembly");
    let file = folder.join("box.toml");
    let example = EXAMPLE.replacen("power_structure_class_id = 0", "assembly = { layout = \"position\" }", 1);
    std::fs::write(&file, example).expect("written");
    let sheet = folder.join("device.eds");
    let printed = eds(&["--config", file.to_str().expect("a plain path")]);
    std::fs::write(&sheet, &printed.stdout).expect("written");

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/eds_pie_reader.py");
    let output = Command::new(python).arg(script).arg(&sheet).output().expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let got: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let sections = &got["sections"];
    assert_eq!(sections["Device"]["ProdType"], json!([43]));
    let members = |assembly: &str, head: Value| {
        let entry = sections["Assembly"][assembly].as_array().expect("an entry");
        assert_eq!(json!(entry[..6]), head);
        let members = entry[6..].chunks(2).map(|member| {
            let parameter = &sections["Params"][member[1].as_str().expect("the name of a parameter")];
            // Name, data type, and bits in the assembly; the size of the parameter is the same in bytes.
            assert_eq!(parameter[5].as_u64().map(|bytes| 8 * bytes), member[0].as_u64());
            (parameter[6].as_str().expect("a name"), parameter[4].as_u64(), member[0].as_u64().expect("bits"))
        });
        members.collect::<Vec<_>>()
    };
    let output = members("Assem150", json!(["Output", "20 04 24 96", 32, 0, "", ""]));
    let input = members("Assem100", json!(["Input", "20 04 24 64", 40, 0, "", ""]));
    for (members, bytes) in [(&output, 32), (&input, 40)] {
        assert_eq!(members.iter().map(|(.., bits)| bits).sum::<u64>(), 8 * bytes, "{members:?}");
    }
    // As `axisbridge assembly` prints them.
    assert_eq!(output[..2], [("axis 1 control", Some(0xC7), 16), ("axis 1 pad_16", Some(0xC7), 16)]);
    assert_eq!(input[input.len() / 2].0, "axis 2 status", "{input:?}");
    assert_eq!(
        sections["Connection Manager"]["Connection1"],
        json!([
            0x0401_0002u32,
            0x4464_0405u32,
            "Param1",
            32,
            "Assem150",
            "Param1",
            40,
            "Assem100",
            "",
            "",
            0,
            "Assem151",
            "Exclusive Owner",
            "Moves the axes of the device",
            "20 04 24 97 2C 96 2C 64"
        ])
    );
    let bits = |number: u8| {
        let fields = &sections["Connection Manager"][format!("Connection{number}")];
        (fields[0].as_u64(), fields[1].as_u64())
    };
    assert_eq!(bits(2), (Some(0x0201_0002), Some(0x4464_0305)), "input only");
    assert_eq!(bits(3), (Some(0x0101_0002), Some(0x4464_0305)), "listen only");
    assert_eq!(sections["Capacity"]["TSpec1"], json!(["Rx", 38, 500]));
    let findings: Vec<_> =
        got["findings"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    for finding in &findings {
        let known = finding.contains("[Time Sync Class]") || finding.contains("{section.keyword,}");
        assert!(known, "{finding}");
    }
}

#[test]
fn the_assemblies_are_printed_with_their_offsets() {
    let folder = scratch("assembly-command");
    let file = folder.join("box.toml");
    let run = |text: &str, format: &str| {
        std::fs::write(&file, text).expect("written");
        let path = file.to_str().expect("a plain path");
        let mut command = Command::new(axisbridge());
        command.args(["assembly", "--config", path, "--format", format]);
        let output = command.output().expect("the program starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let example = EXAMPLE.replacen("power_structure_class_id = 0", "assembly = { layout = \"position\" }", 1);
    let (code, text, _) = run(&example, "text");
    assert_eq!(code, Some(0));
    assert!(text.contains("  output point 150, 32 bytes, 38 in a Forward_Open\n"), "{text}");
    assert!(text.contains("      20  DINT   slide.target_position_32\n"), "{text}");
    let (_, json, _) = run(&example, "json");
    let got: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((&got[0]["input"]["point"], &got[0]["input"]["connection_size"]), (&json!(100), &json!(42)));
    assert_eq!(got[0]["output"]["fields"][9]["offset"], 28);
    let (_, markdown, _) = run(&example, "markdown");
    assert!(markdown.contains("| 8 | DINT | turntable | `actual_position_32` |"), "{markdown}");
    std::fs::write(&file, &example).expect("written");
    let path = file.to_str().expect("a plain path");
    let output =
        Command::new(axisbridge()).args(["attributes", "--config", path]).output().expect("it starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{error}");
    let expected =
        "the axes of the device front are moved through assemblies: expected CIP Motion devices only";
    assert!(error.contains(expected), "{error}");
    let (code, text, error) = run(EXAMPLE, "text");
    assert_eq!((code, text.as_str()), (Some(2), ""));
    assert!(error.contains("no device of the configuration has assemblies"), "{error}");
}

#[test]
fn the_device_is_what_its_network_asks_for() {
    let mapping = Mapping::embedded().expect("the shipped tables are good");
    assert_eq!(mapping.dictionaries.cip.networks(), networks());
    let network = networks().iter().find(|network| network.name == ETHERNET_IP).expect("EtherNet/IP");
    // Table 4: every required class is there. The optional one is there as well.
    for object in &network.objects {
        let own = OBJECT_CLASSES.iter().find(|own| own.class == object.class);
        let own = own.unwrap_or_else(|| panic!("the device lacks the {}", object.name));
        assert_eq!(own.instance.is_none(), object.per_axis, "{}", object.name);
        assert_eq!(own.name.to_lowercase(), object.name.to_lowercase());
    }
    assert_eq!(network.objects.iter().filter(|object| object.required).count(), 7);
    // The list of clause 7.2.
    assert_eq!(
        network.formats.iter().map(|(format, _)| *format).collect::<Vec<_>>(),
        [ConnectionDataFormat::Variable]
    );
    // A device that is not told otherwise has the format in general use.
    assert_eq!(Format::default(), Format::Variable);
    assert_eq!(motion_open::TRANSPORT.class, network.transport_class);
    assert_eq!((network.trigger.as_str(), motion_open::TRANSPORT.trigger), ("cyclic", Trigger::CYCLIC));
    assert_eq!(network.priority, "urgent");
    assert_eq!(network.udp_port, Some(IO_PORT));
    assert_eq!(usize::from(*network.axes.end()), profile_cip::device::config::AXES_MAX);
    assert_eq!(usize::from(*network.axes.end()), profile_cip::device::motion_device::AXES_MAX);
    assert_eq!(network.axes, 1..=16);
}

#[test]
fn the_other_networks_are_as_the_tables_print_them() {
    let of = |name: &str| networks().iter().find(|network| network.name == name).expect("a network");
    let classes = |name: &str| {
        let row = |object: &axisbridge::mapping::NetworkObject| {
            let need = if object.required { 'R' } else { 'O' };
            format!("{:02X} {need} {}", object.class, object.instances)
        };
        of(name).objects.iter().map(row).collect::<Vec<_>>()
    };
    assert_eq!(classes("DeviceNet"), ["01 R 1", "05 R 2", "02 R 1", "03 R 1", "43 O 1", "42 R 1"]);
    assert_eq!(classes("ControlNet"), ["01 R 1", "06 R 1", "02 R 1", "F0 R 1", "43 O 1", "42 R 1"]);
    assert_eq!(
        classes("EtherNet/IP"),
        ["01 R 1", "06 R 1", "02 R 1", "F5 R 1", "F6 R 1", "43 O 1", "48 R 1", "42 R 1"]
    );
    let device_net = of("DeviceNet");
    assert_eq!(device_net.formats, [(ConnectionDataFormat::Fixed, 1..=1)]);
    assert_eq!((device_net.axes.clone(), device_net.priority.as_str()), (1..=1, "very_high"));
    assert_eq!(device_net.paths, "Motion Device Axis Object");
    let control_net = of("ControlNet");
    assert_eq!(
        control_net.formats,
        [(ConnectionDataFormat::Fixed, 1..=1), (ConnectionDataFormat::Variable, 1..=4)]
    );
    assert_eq!(control_net.udp_port, None);
}
