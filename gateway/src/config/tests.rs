use std::net::Ipv4Addr;
use std::path::Path;

use profile_cip::wire::motion::Format;
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::scaling::UnitKind;
use profile_sercos::master::config::AddressPolicy;

use super::*;
use crate::mapping::{CaptureMode, FeedbackUse, Rated};

/// A small configuration without faults; the cases below break it in one place.
const GOOD: &str = r#"[box]
name = "press"

[[device]]
name = "front"
listen = "192.0.2.10"
axes = ["x", "y"]
[device.identity]
vendor_id = 1
product_code = 2
serial_number = 3

[[axis]]
name = "x"
instance = 1
drive = "a"
unit = "revolution"

[[axis]]
name = "y"
instance = 2
drive = "b"
unit = "millimetre"
limits = { position_min = -1.5, position_max = 2.0 }

[south.sercos]
interface = "in-process"
cycle_time = "2 ms"

[[south.sercos.drive]]
name = "a"
address = 1

[[south.sercos.drive]]
name = "b"
address = 2
"#;

fn good() -> Config {
    Config::parse(GOOD, "box.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// The errors of [`GOOD`] with `old` replaced by `new` at its first place.
fn broken(old: &str, new: &str) -> String {
    assert!(GOOD.contains(old), "{old}");
    match Config::parse(&GOOD.replacen(old, new, 1), "box.toml") {
        Ok(config) => panic!("accepted: {config:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn defaults_are_those_of_the_documentation() {
    let config = good();
    assert_eq!(config.name, "press");
    assert_eq!(
        (&config.time, config.log_level, config.modbus.clone(), config.http.clone()),
        (&Time::default(), LogLevel::Info, None, None)
    );
    assert_eq!((&config.mappings_dir, &config.settings_file, &config.history_dir), (&None, &None, &None));
    assert_eq!(config.recording, Some(RollingRecording { seconds: 10, memory: 16_000_000 }));
    assert_eq!(config.overlays.len(), 0);
    let device = &config.devices[0];
    assert_eq!(
        (device.update_period_min, device.update_period_max),
        (DurationNs(2_000_000), DurationNs(32_000_000))
    );
    assert_eq!(device.power_structure_class_id, 0);
    assert_eq!(
        device.identity,
        Identity {
            vendor_id: 1,
            vendor_name: "Vendor 1".to_owned(),
            catalog: "Axisbridge".to_owned(),
            product_code: 2,
            revision_major: 1,
            revision_minor: 1,
            serial_number: 3,
            product_name: "Axisbridge".to_owned(),
        }
    );
    assert_eq!(
        config.axes[0],
        Axis {
            name: "x".to_owned(),
            instance: 1,
            device: 0,
            drive: DriveAt::Sercos { drive: 0 },
            function: AxisFunction::Drive,
            feedback: FeedbackUse::Motor,
            kind: AxisKind::Rotary,
            motion_resolution: 1_000_000,
            unwind_counts: None,
            power_structure_axis_id: 0,
            limits: Limits::default(),
            nameplate: Nameplate::default(),
            on_command_loss: StoppingAction::RampedDecelAndDisable,
            events: CaptureMode::Cyclic,
        }
    );
    assert_eq!(config.axes[1].kind, AxisKind::Linear);
    assert_eq!(config.axes[1].limits.position_min, Some(Position(-1_500_000_000)));
    assert_eq!(config.axes[1].limits.position_max, Some(Position(2_000_000_000)));
    assert_eq!(
        config.sercos,
        Some(Sercos {
            link: Link::InProcess { ring: false },
            setup_cycle: None,
            cycle_time: DurationNs(2_000_000),
            master_mac: None,
            jitter: DurationNs(50_000),
            cp0_stable_cycles: 100,
            allowed_losses: 5,
            addresses: AddressPolicy::Refuse,
            drives: vec![
                Drive {
                    name: "a".to_owned(),
                    address: 1,
                    set_scaling: false,
                    acknowledges: true,
                    modes: None,
                    rated: None,
                    hot_plug: false,
                    startup: Vec::new(),
                },
                Drive {
                    name: "b".to_owned(),
                    address: 2,
                    set_scaling: false,
                    acknowledges: true,
                    modes: None,
                    rated: None,
                    hot_plug: false,
                    startup: Vec::new(),
                },
            ],
        })
    );
    assert_eq!(
        config.realtime,
        realtime::Request { priority: Some(80), cpu: None, lock_memory: true, stay_awake: false }
    );
    assert!(config.can.is_empty());
    assert_eq!(
        config.axes_of(0).map(|(index, axis)| (index, axis.instance)).collect::<Vec<_>>(),
        [(0, 1), (1, 2)]
    );
}

#[test]
fn values_given_are_taken() {
    let text = GOOD
        .replace("[[device]]", "[time]\nsource = \"host\"\n[log]\nlevel = \"debug\"\n[modbus]\nlisten = \"[::1]:502\"\nclients_max = 3\n[http]\nlisten = \"[::1]:80\"\nconnections_max = 256\n[mappings]\ndir = \"maps\"\noverlays = [\"own.toml\"]\n[[device]]")
        .replace("serial_number = 3", "serial_number = 0xFFFF_FFFF\nrevision = \"127.255\"\nproduct_name = \"P\"")
        .replace("axes = [\"x\", \"y\"]", "axes = [\"x\", \"y\"]\npower_structure_class_id = 7\nupdate_period = { min = \"4 ms\", max = \"4 ms\" }")
        .replace("unit = \"revolution\"", "unit = \"revolution\"\nmotion_resolution = 4096\nunwind_counts = 8192\npower_structure_axis_id = 9\non_command_loss = \"disable-and-coast\"\nlimits = { velocity = 12.5, acceleration = 100, torque_percent = 150.5, following_error = 0.1 }")
        .replace("cycle_time = \"2 ms\"", "cycle_time = \"62.5 us\"\nmaster_mac = \"02:00:00:00:00:Af\"\njitter = \"15.625 us\"\nassign_addresses = true\ncp0_stable_cycles = 1\nallowed_losses = 65535\n").replace("[south.sercos]", "[south]\nrealtime = { priority = 0, cpu = 3, lock_memory = false, stay_awake = true }\n[south.sercos]")
        .replace("in-process", "enp3s0")
        .replace("address = 2", "address = 511\nset_scaling = true\nacknowledges = false\nrated_torque = \"2.5 Nm\"\nhot_plug = true");
    let config = Config::parse(&text, "box.toml").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(config.log_level, LogLevel::Debug);
    assert_eq!(
        config.modbus,
        Some(Modbus {
            listen: "[::1]:502".parse().unwrap(),
            clients: Hosts::EVERYBODY,
            clients_max: 3,
            parameters: Vec::new()
        })
    );
    assert_eq!(
        config.http,
        Some(Http {
            listen: "[::1]:80".parse().unwrap(),
            clients: Hosts::EVERYBODY,
            connections_max: 256,
            token: None,
            tls: None
        })
    );
    assert_eq!(config.mappings_dir.as_deref(), Some(Path::new("maps")));
    let device = &config.devices[0];
    assert_eq!(device.listen, Ipv4Addr::new(192, 0, 2, 10));
    assert_eq!(device.power_structure_class_id, 7);
    assert_eq!(
        (device.update_period_min, device.update_period_max),
        (DurationNs(4_000_000), DurationNs(4_000_000))
    );
    assert_eq!((device.identity.revision_major, device.identity.revision_minor), (127, 255));
    assert_eq!((device.identity.serial_number, device.identity.product_name.as_str()), (u32::MAX, "P"));
    let axis = &config.axes[0];
    assert_eq!(
        (axis.motion_resolution, axis.unwind_counts, axis.power_structure_axis_id),
        (4096, Some(8192), 9)
    );
    assert_eq!(axis.on_command_loss, StoppingAction::DisableAndCoast);
    assert_eq!(
        axis.limits,
        Limits {
            position_min: None,
            position_max: None,
            velocity: Some(Velocity(12_500_000_000)),
            acceleration: Some(Acceleration(100_000_000_000)),
            torque: Some(Torque(1_505_000)),
            following_error: Some(Position(100_000_000)),
        }
    );
    let sercos = config.sercos.as_ref().unwrap();
    assert_eq!(sercos.link, Link::Interface { name: "enp3s0".to_owned(), ring: None });
    assert_eq!((sercos.cycle_time, sercos.jitter), (DurationNs(62_500), DurationNs(15_625)));
    assert_eq!(sercos.master_mac, Some([2, 0, 0, 0, 0, 0xAF]));
    assert_eq!((sercos.cp0_stable_cycles, sercos.allowed_losses), (1, 65_535));
    assert_eq!(sercos.addresses, AddressPolicy::Assign);
    assert_eq!(
        config.realtime,
        realtime::Request { priority: None, cpu: Some(3), lock_memory: false, stay_awake: true }
    );
    assert_eq!((sercos.drives[1].address, sercos.drives[1].set_scaling), (511, true));
    assert!(!sercos.drives[1].acknowledges);
    assert_eq!([sercos.drives[0].hot_plug, sercos.drives[1].hot_plug], [false, true]);
    assert_eq!(sercos.drives[1].rated, Some(Rated { kind: UnitKind::Rotary, value: 2_500_000 }));
}

#[test]
fn one_drive_at_least_is_there_from_the_start() {
    let both = GOOD
        .replace("address = 1", "address = 1\nhot_plug = true")
        .replace("address = 2", "address = 2\nhot_plug = true");
    let error = Config::parse(&both, "box.toml").unwrap_err().to_string();
    assert!(error.contains("every drive has `hot_plug = true`"), "{error}");
    assert!(error.contains("expected at least one drive without it"), "{error}");
    let one = both.replacen("hot_plug = true", "hot_plug = false", 1);
    let drives = Config::parse(&one, "box.toml").unwrap().sercos.unwrap().drives;
    assert_eq!(drives.iter().map(|drive| drive.hot_plug).collect::<Vec<_>>(), [false, true]);
}

#[test]
fn cycle_times_are_those_of_the_standard() {
    let accepts =
        |time: &str| Config::parse(&GOOD.replacen("\"2 ms\"", &format!("\"{time}\""), 1), "box.toml").is_ok();
    for time in ["31.25 us", "62500 ns", "125 us", "250 us", "500 us", "0.75 ms", "1 ms", "65 ms"] {
        assert!(accepts(time), "{time}");
    }
    for time in ["0 ms", "31 us", "93.75 us", "187.5 us", "300 us", "65.25 ms", "1 s", "1100 us"] {
        assert!(!accepts(time), "{time}");
    }
}

/// Each case: what it shows, what is replaced, by what.
const BROKEN: &[(&str, &str, &str)] = &[
    ("syntax", "name = \"press\"", "name = press"),
    ("unclosed_string", "name = \"press\"", "name = \"press"),
    ("unknown_key", "instance = 1", "instanze = 1"),
    ("unknown_table", "[box]", "[boxes]\n[box]"),
    ("missing_key", "drive = \"a\"\n", ""),
    ("missing_table", "[box]\nname = \"press\"\n", ""),
    ("wrong_type", "instance = 1", "instance = \"one\""),
    ("duplicate_key", "instance = 1", "instance = 1\ninstance = 2"),
    ("duplicate_sercos_address", "address = 2", "address = 1"),
    ("sercos_address_out_of_range", "address = 2", "address = 512"),
    ("cycle_time_off_the_steps", "\"2 ms\"", "\"1.1 ms\""),
    ("time_without_unit", "\"2 ms\"", "\"2\""),
    ("axis_without_its_drive", "drive = \"a\"", "drive = \"c\""),
    ("drive_of_two_axes", "drive = \"b\"", "drive = \"a\""),
    ("axis_name_twice", "name = \"y\"", "name = \"x\""),
    ("axis_of_no_device", "axes = [\"x\", \"y\"]", "axes = [\"x\"]"),
    ("axis_listed_twice", "axes = [\"x\", \"y\"]", "axes = [\"x\", \"y\", \"x\"]"),
    ("unknown_axis_in_device", "axes = [\"x\", \"y\"]", "axes = [\"x\", \"y\", \"z\"]"),
    ("device_without_axes", "axes = [\"x\", \"y\"]", "axes = []"),
    ("instance_twice", "instance = 2", "instance = 1"),
    ("instance_zero", "instance = 2", "instance = 0"),
    (
        "update_period_below_cycle",
        "[device.identity]",
        "update_period = { min = \"400 us\" }\n[device.identity]",
    ),
    (
        "update_period_reversed",
        "[device.identity]",
        "update_period = { min = \"8 ms\", max = \"4 ms\" }\n[device.identity]",
    ),
    (
        "update_period_out_of_range",
        "[device.identity]",
        "update_period = { max = \"1 s\" }\n[device.identity]",
    ),
    ("listen_with_port", "\"192.0.2.10\"", "\"192.0.2.10:44818\""),
    ("listen_unspecified", "\"192.0.2.10\"", "\"0.0.0.0\""),
    ("modbus_without_port", "[[device]]", "[modbus]\nlisten = \"0.0.0.0\"\n[[device]]"),
    ("revision", "product_code = 2", "product_code = 2\nrevision = \"0.1\""),
    ("product_name_not_ascii", "product_code = 2", "product_code = 2\nproduct_name = \"Brücke\""),
    ("unit", "\"revolution\"", "\"degree\""),
    ("function", "unit = \"revolution\"", "unit = \"revolution\"\nfunction = \"encodr\""),
    (
        "encoder_limits",
        "unit = \"revolution\"",
        "unit = \"revolution\"\nfunction = \"encoder\"\non_command_loss = \"disable-and-coast\"\nlimits = { velocity = 1.0 }",
    ),
    (
        "converter_unwind",
        "unit = \"revolution\"",
        "unit = \"revolution\"\nfunction = \"converter\"\nunwind_counts = 1000",
    ),
    ("stopping_action", "unit = \"revolution\"", "unit = \"revolution\"\non_command_loss = \"stop\""),
    ("limits_reversed", "position_max = 2.0", "position_max = -2.0"),
    ("limit_alone", "position_min = -1.5, ", ""),
    ("limits_of_endless_axis", "limits = {", "unwind_counts = 5000\nlimits = {"),
    ("limit_not_positive", "position_min = -1.5, position_max = 2.0", "velocity = 0.0"),
    ("limit_too_large", "position_min = -1.5, position_max = 2.0", "velocity = 1e10"),
    ("interface_name", "\"in-process\"", "\"a name with blanks\""),
    (
        "mac_of_a_group",
        "[[south.sercos.drive]]",
        "master_mac = \"01:00:5e:00:00:01\"\n[[south.sercos.drive]]",
    ),
    ("jitter", "[[south.sercos.drive]]", "jitter = \"1 ms\"\n[[south.sercos.drive]]"),
    ("priority", "[south.sercos]", "[south]\nrealtime = { priority = 100 }\n[south.sercos]"),
    ("connection_format", "[device.identity]", "connection_format = \"fixd\"\n[device.identity]"),
    ("fixed_format_for_two_axes", "[device.identity]", "connection_format = \"fixed\"\n[device.identity]"),
    ("log_level", "[[device]]", "[log]\nlevel = \"loud\"\n[[device]]"),
    ("time_source", "[[device]]", "[time]\nsource = \"gps\"\n[[device]]"),
    ("name_with_blank", "name = \"b\"", "name = \"b b\""),
];

#[test]
fn faults_are_shown_at_their_place() {
    let mut text = String::new();
    for (case, old, new) in BROKEN {
        text += &format!("== {case}\n{}\n\n", broken(old, new));
    }
    insta::assert_snapshot!(text);
}

#[test]
fn a_device_with_one_axis_may_have_the_fixed_format() {
    let one = GOOD.replace("[\"x\", \"y\"]", "[\"x\"]\nconnection_format = \"fixed\"");
    let text = format!(
        "{one}\n[[device]]\nname = \"back\"\nlisten = \"192.0.2.11\"\naxes = [\"y\"]\n\
         connection_format = \"variable\"\nidentity = {{ vendor_id = 1, product_code = 2, serial_number = 4 }}\n"
    );
    let config = Config::parse(&text, "box.toml").unwrap_or_else(|error| panic!("{error}"));
    let formats: Vec<_> = config.devices.iter().map(|device| device.connection_format).collect();
    assert_eq!(formats, [Format::Fixed, Format::Variable]);
    assert_eq!(good().devices[0].connection_format, Format::Variable);
}

#[test]
fn every_fault_of_a_file_is_reported_in_its_order() {
    let text = GOOD
        .replace("instance = 1", "instance = 300")
        .replace("address = 2", "address = 0")
        .replace("2 ms", "7 us");
    let error = Config::parse(&text, "box.toml").unwrap_err();
    let places: Vec<_> =
        error.list().iter().map(|found| (found.line, found.column, found.title.as_str())).collect();
    assert_eq!(
        places,
        [
            (15, 12, "the instance is 300"),
            (28, 14, "7 us is not a SERCOS III cycle time"),
            (36, 11, "the SERCOS address is 0")
        ]
    );
}

/// A box with so many axes: 16 in a device, their drives on the SERCOS line, on two CAN buses and on DeviceNet in turn.
fn crowd(axes: usize) -> String {
    let mut text = "[box]\nname = \"crowd\"\n".to_owned();
    let numbers: Vec<usize> = (1..=axes).collect();
    for (device, axes) in (1..).zip(numbers.chunks(16)) {
        let list: Vec<_> = axes.iter().map(|axis| format!("\"a{axis}\"")).collect();
        text += &format!(
            "[[device]]\nname = \"front-{device}\"\nlisten = \"192.0.2.{device}\"\naxes = [{}]\n\
             identity = {{ vendor_id = 1, product_code = 2, serial_number = {device} }}\n",
            list.join(", ")
        );
    }
    for axis in &numbers {
        text += &format!(
            "[[axis]]\nname = \"a{axis}\"\ninstance = {}\ndrive = \"d{axis}\"\nunit = \"revolution\"\n",
            (axis - 1) % 16 + 1
        );
    }
    let mut bus = |place: usize, head: &str, line: &dyn Fn(usize) -> String| {
        let drives: String =
            numbers.iter().filter(|axis| **axis % 4 == place).map(|axis| line(*axis)).collect();
        if !drives.is_empty() {
            text += &format!("[{head}\ninterface = \"in-process\"\n{drives}");
        }
    };
    bus(0, "south.sercos]\ncycle_time = \"2 ms\"", &|axis| {
        format!("[[south.sercos.drive]]\nname = \"d{axis}\"\naddress = {axis}\n")
    });
    for number in [1, 2] {
        bus(number, "[south.can]]\ncycle_time = \"8 ms\"", &|axis| {
            format!("[[south.can.drive]]\nname = \"d{axis}\"\nnode = {axis}\n")
        });
    }
    bus(3, "[south.devicenet]]\ncycle_time = \"40 ms\"", &|axis| {
        format!("[[south.devicenet.drive]]\nname = \"d{axis}\"\nmac_id = {axis}\nresolution = 1_048_576\n")
    });
    text
}

#[test]
fn a_box_may_have_64_axes_in_several_devices_on_mixed_buses() {
    let config = Config::parse(&crowd(64), "box.toml").unwrap_or_else(|error| panic!("{error}"));
    let of = |device| config.axes_of(device).count();
    assert_eq!((0..config.devices.len()).map(of).collect::<Vec<_>>(), [16; 4]);
    assert_eq!(config.sercos.as_ref().map(|bus| bus.drives.len()), Some(16));
    assert_eq!(config.can.iter().map(|bus| bus.drives.len()).collect::<Vec<_>>(), [16, 16]);
    assert_eq!(config.devicenet.iter().map(|bus| bus.drives.len()).collect::<Vec<_>>(), [16]);
}

#[test]
fn the_65th_axis_is_refused_at_its_line() {
    let text = crowd(65);
    let error = Config::parse(&text, "box.toml").unwrap_err();
    let line = text.lines().position(|line| line == "name = \"a65\"").unwrap();
    let found: Vec<_> = error
        .list()
        .iter()
        .map(|found| (found.line, found.title.as_str(), found.expected.as_str()))
        .collect();
    // The place is that of its table.
    assert_eq!(found, [(line, "too many axes: 65", "expected at most 64")]);
}

#[test]
fn the_17th_axis_of_a_device_is_refused() {
    let text = crowd(17).replace("\"a16\"]", "\"a16\", \"a17\"]");
    let text = text.replace("instance = 1\ndrive = \"d17\"", "instance = 17\ndrive = \"d17\"");
    let start = text.find("[[device]]\nname = \"front-2\"").unwrap();
    let end = text.find("[[axis]]").unwrap();
    let text = format!("{}{}", &text[..start], &text[end..]);
    let error = Config::parse(&text, "box.toml").unwrap_err();
    let titles: Vec<_> = error.list().iter().map(|found| found.title.as_str()).collect();
    assert_eq!(titles, ["the device `front-1` has 17 axes"]);
    let expected = &error.list()[0].expected;
    assert_eq!(expected, "expected 1 to 16 axes of a node on EtherNet/IP (IEC 61800-7-302 clause 7.2)");
}

#[test]
fn the_65th_device_is_refused_at_its_line() {
    let one = |number: usize| {
        format!(
            "[[device]]\nname = \"f{number}\"\nlisten = \"192.0.2.{number}\"\naxes = [\"x{number}\"]\n\
             identity = {{ vendor_id = 1, product_code = 2, serial_number = {number} }}\n"
        )
    };
    let devices: String = (1..=65).map(one).collect();
    let text = format!("{devices}{}", crowd(1));
    let text = text.replace("[box]\nname = \"crowd\"\n", "");
    let text = format!("[box]\nname = \"crowd\"\n{text}");
    let error = Config::parse(&text, "box.toml").unwrap_err();
    let line = text.lines().position(|line| line == "name = \"f65\"").unwrap();
    let too_many = error.list().iter().find(|found| found.title.starts_with("too many")).unwrap();
    assert_eq!(
        (too_many.line, too_many.title.as_str(), too_many.expected.as_str()),
        (line, "too many devices: 66", "expected at most 64")
    );
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let error = Config::load(Path::new("/nonexistent/box.toml")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "error[AX0001]: the file cannot be read\n --> /nonexistent/box.toml\n  = expected a file, got: No such file or directory (os error 2)"
    );
}

#[test]
fn every_example_loads() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut loaded = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            Config::load(&path).unwrap_or_else(|error| panic!("{error}"));
            loaded += 1;
        }
    }
    assert!(loaded >= 2, "{loaded} examples in {}", folder.display());
}

#[test]
fn paths_count_from_the_file() {
    let folder = std::env::temp_dir().join(format!("axisbridge-config-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("box.toml");
    let http =
        "[http]\nlisten = \"127.0.0.1:80\"\ntoken = \"hash\"\ncertificate = \"c.pem\"\nkey = \"/k.pem\"\n";
    let text = GOOD
        .replace(
            "[[device]]",
            &format!("{http}[mappings]\ndir = \"maps\"\noverlays = [\"own.toml\"]\n[[device]]"),
        )
        .replace("[box]", "[history]\ndirectory = \"state\"\n[box]\nsettings_file = \"set.toml\"");
    std::fs::write(&path, text).unwrap();
    let config = Config::load(&path).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(config.mappings_dir, Some(folder.join("maps")));
    assert_eq!(config.overlays, [folder.join("own.toml")]);
    assert_eq!(config.settings_file, Some(folder.join("set.toml")));
    assert_eq!(config.history_dir, Some(folder.join("state")));
    let http = config.http.unwrap();
    assert_eq!(http.token, Some(folder.join("hash")));
    let files = TlsFiles { certificate: folder.join("c.pem"), key: "/k.pem".into() };
    assert_eq!(http.tls, Some(files));
}

#[test]
fn the_reference_describes_every_key() {
    let page = include_str!("../../../docs/reference/configuration.md");
    let keys =
        include_str!("file.rs").lines().filter_map(|line| line.strip_prefix("    pub ")?.split(':').next());
    for key in keys {
        // The tables of the top level stand in their headings, without a row of their own.
        let shown = match key {
            "the_box" => "`[box]`".to_owned(),
            "time" | "log" | "history" | "recording" | "modbus" | "http" | "mappings" => format!("`[{key}]`"),
            "device" | "axis" => format!("`[[{key}]]`"),
            "south" => "`[south]`".to_owned(),
            key => format!("`{key}`"),
        };
        assert!(page.contains(&shown), "docs/reference/configuration.md does not describe {shown}");
    }
}
