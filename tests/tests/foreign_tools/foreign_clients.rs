//! Clients of other makers against the box as a user starts it: pycomm3, ethernetip (both PyPI) and nmap's `enip-info`.
//!
//! Their scripts stand in `tests/peers/` and print what they got; what it has to be is judged here. A client that is not
//! installed is a visible skip, in CI a failure.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::process::{Running, axisbridge};
use axisbridge_tests::{peer, tshark};
use serde_json::{Value, json};

/// The shipped example that needs no hardware, at an address of this test; it records what passes.
fn start_box(address: &str, name: &str) -> (Running, PathBuf) {
    start_box_of(include_str!("../../../examples/two-axes-in-process.toml"), address, name)
}

/// As [`start_box`], of a configuration like the example.
fn start_box_of(example: &str, address: &str, name: &str) -> (Running, PathBuf) {
    let scratch = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let config = scratch.join(format!("{name}.toml"));
    let example = example
        .replace("\"127.0.0.2\"", &format!("\"{address}\""))
        .replace("127.0.0.1:1502", &format!("{address}:1502"));
    std::fs::write(&config, example).expect("the scratch folder can be written");
    let log = scratch.join(format!("{name}.log"));
    let mut run = Command::new(axisbridge());
    let capture = scratch.join(format!("{name}.pcapng"));
    run.arg("run").arg("--config").arg(&config).arg("--capture").arg(&capture).env("NO_COLOR", "1");
    run.stderr(std::fs::File::create(&log).expect("the log can be written"));
    let mut running = Running::start("run", &mut run);
    let end = Instant::now() + Duration::from_secs(30);
    loop {
        let seen = std::fs::read_to_string(&log).unwrap_or_default();
        if seen.contains("CP4") {
            return (running, capture);
        }
        assert!(running.ended().is_none(), "the box has ended: {seen}");
        assert!(Instant::now() < end, "the drives did not come up: {seen}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Runs a client's script against the box; the JSON object that it prints.
fn ask(python: &PathBuf, script: &str, address: &str) -> Value {
    ask_with(python, script, &[address])
}

/// As [`ask`], with these arguments.
fn ask_with(python: &PathBuf, script: &str, arguments: &[&str]) -> Value {
    let script = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/peers")).join(script);
    let output = Command::new(python)
        .arg(&script)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the client can be started");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{} ended with {}: {errors}", script.display(), output.status);
    serde_json::from_slice(&output.stdout).expect("the client prints one JSON object")
}

/// Vendor 1, device type 37, product 1001, revision 1.1, status (owned or not), serial number, name.
const IDENTITY: &str = "ffff2500e9030101";
const SERIAL: &str = "40e20100";
const NAME: &str = "13417869736272696467652074776f2061786573";

/// Vendor; "attribute not supported"; Axis State Initializing.
const PACKED: &str = "030008000e0012008e000000ffff8e0014008e00000000";

#[test]
fn pycomm3_reads_and_writes_by_every_way_it_knows() {
    const ADDRESS: &str = "127.0.0.61";
    let Some(python) = peer::python_or_skip("pycomm3_reads_and_writes_by_every_way_it_knows", "pycomm3")
    else {
        return;
    };
    let (mut running, capture) = start_box(ADDRESS, "foreign-pycomm3");
    let got = ask(&python, "pycomm3_client.py", ADDRESS);

    assert_eq!(got["list_identity"]["product_name"], "Axisbridge two axes");
    assert_eq!(got["list_identity"]["product_type"], "CIP Motion Drive");
    assert_eq!(got["list_identity"]["product_code"], 1001);
    assert_eq!(got["list_identity"]["serial"], "0001e240");
    assert_eq!(got["list_identity"]["revision"], json!({ "major": 1, "minor": 1 }));
    let identity = got["identity_all"]["value"].as_str().expect("Get_Attributes_All answers");
    assert!(identity.starts_with(IDENTITY) && identity.contains(SERIAL), "{identity}");

    for (what, value) in [
        ("product_name", NAME),
        ("serial_number", SERIAL),
        // 127.0.0.61, 255.0.0.0, no gateway, no name servers, no domain.
        ("interface", "3d00007f000000ff0000000000000000000000000000"),
        // The object's default for CIP transport class 0/1, urgent.
        ("dscp_urgent", "37"),
        ("axis_revision", "0400"),
        ("axis_state", "00"),
        ("gear", "01000000"),
        ("set_gear_as_it_is", ""),
        ("gear_after", "01000000"),
        // Axis State 0 padded to four octets, Axis Faults 0; each behind ID, dimension and element size.
        ("axis_list", "020000008a02000100000000910200080000000000000000"),
        // The same answers over the class 3 connection.
        ("connected_product_name", NAME),
        ("connected_axis_state", "00"),
    ] {
        assert_eq!(got[what], json!({ "value": value, "error": null }), "{what}");
    }
    for (what, error) in [
        ("axis_missing_attribute", "Attribute not supported"),
        ("set_another_gear", "Error in data segment or invalid attribute value"),
        ("set_short", "Insufficient command data"),
        ("set_read_only", "Attribute not settable"),
    ] {
        assert_eq!(got[what]["error"], error, "{what}");
    }
    let unknown = got["axis_missing_instance"]["error"].as_str().expect("refused");
    assert!(unknown.starts_with("Destination unknown"), "{unknown}");
    // Status 0x0A with the good items beside the bad one.
    assert_eq!(got["identity_list"]["value"], "030001000000ffff630014000600000040e20100");
    for what in ["packed", "connected_packed"] {
        assert_eq!(got[what]["value"], PACKED, "{what}");
    }
    assert_eq!((&got["connected"], &got["connection_size"]), (&json!(true), &json!(4000)));

    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
    if peer::tshark_or_skip("pycomm3_reads_and_writes_by_every_way_it_knows") {
        explicit_traffic(&capture);
    }
}

#[test]
fn pycomm3_reads_the_clock_and_uploads_the_data_sheet() {
    const ADDRESS: &str = "127.0.0.64";
    const TEST: &str = "pycomm3_reads_the_clock_and_uploads_the_data_sheet";
    let Some(python) = peer::python_or_skip(TEST, "pycomm3") else { return };
    let (mut running, capture) = start_box(ADDRESS, "foreign-device");
    let got = ask(&python, "pycomm3_device.py", ADDRESS);
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));

    // Of the clock what is true of a host's clock, and nothing of PTP.
    let clock = &got["clock"];
    for (attribute, value) in
        [("1", "00"), ("2", "01"), ("11", "0100"), ("12", "010001000300"), ("27", "0000")]
    {
        assert_eq!(clock[attribute], value, "attribute {attribute}");
    }
    for attribute in ["5", "6", "7", "9", "14", "15", "16", "17", "18", "19", "20", "24"] {
        assert_eq!(clock[attribute], "Attribute not supported", "attribute {attribute}");
    }
    assert_eq!(clock["10"].as_str().map(|local| &local[..16]), Some("024142fffe000001"));
    let refused = got["switched_on"].as_str().expect("PTP cannot be switched on");
    assert!(refused.ends_with("invalid attribute value"), "{refused}");

    // The sheet is the one that the command writes.
    let config = capture.with_extension("toml");
    let written =
        Command::new(axisbridge()).arg("eds").arg("--config").arg(config).output().expect("it starts");
    let sheet = &got["sheet"];
    assert_eq!(sheet["text"].as_str().map(str::as_bytes), Some(&*written.stdout));
    assert_eq!((&sheet["size"], &sheet["total"]), (&json!(written.stdout.len()), &json!(0)));

    if peer::tshark_or_skip(TEST) {
        let frames = tshark::dissect(&capture, "cip.class == 0x43 && cip.rr == 1", &[]);
        let shown = |name: &str| {
            let field = frames.iter().find_map(|frame| frame.field(name));
            field.map(|field| field.show.clone()).unwrap_or_else(|| panic!("tshark reads no {name}"))
        };
        assert!(frames.iter().all(|frame| !frame.has("_ws.malformed")));
        assert_eq!(shown("cip.time_sync.gm_clock.clock_id"), "02:41:42:ff:fe:00:00:01");
        assert_eq!(shown("cip.time_sync.gm_clock.time_source"), "144");
        assert_eq!(shown("cip.time_sync.gm_clock.priority2"), "128");
        assert_eq!(shown("cip.time_sync.port_state_info.port_state"), "3");
        assert_eq!(shown("cip.time_sync.port_proto_addr_info.network_proto"), "1");
        assert_eq!(shown("cip.time_sync.prod_desc"), ";Axisbridge two axes;0001E240");
        assert_eq!(shown("cip.time_sync.steps_removed"), "0");
    }
}

/// What tshark reads in the answers of the box: services and general statuses in their order.
fn explicit_traffic(capture: &Path) {
    let frames = tshark::dissect(capture, "enip && tcp", &[]);
    let mut answers = Vec::new();
    for frame in &frames {
        assert!(!frame.has("_ws.malformed"), "frame {} is malformed", frame.number);
        let statuses: Vec<_> = frame.all("cip.genstat").map(|field| field.value.clone()).collect();
        // The service octets of answers, with the response bit.
        let services: Vec<_> = frame.all("cip.sc").map(|field| field.value.clone()).collect();
        if !statuses.is_empty() {
            answers.push(format!("{} {}", services.join(","), statuses.join(",")));
        }
    }
    let get = |status: &str| format!("8e {status}");
    let packed = "8a,8e,8e,8e 1e,00,14,00".to_owned();
    let mut wanted = vec!["81 00".to_owned()];
    wanted.extend(std::iter::repeat_n(get("00"), 6));
    wanted.extend([get("05"), get("14"), get("00"), "90 00".to_owned(), "90 09".to_owned(), get("00")]);
    wanted.push("90 13".to_owned());
    wanted.extend(["90 0e", "83 0a", "cb 00"].map(str::to_owned));
    wanted.extend([packed.clone(), "db 00".to_owned(), get("00"), get("00"), packed, "ce 00".to_owned()]);
    assert_eq!(answers, wanted);
    // What tshark says of the SERCOS side is judged where that side is.
    let mut findings = tshark::warnings(capture);
    findings.retain(|(_, message)| !message.contains("CP is unknown"));
    assert_eq!(findings, [], "expert findings");
}

#[test]
fn ethernetip_opens_runs_and_closes_the_motion_connection() {
    const ADDRESS: &str = "127.0.0.62";
    let Some(python) =
        peer::python_or_skip("ethernetip_opens_runs_and_closes_the_motion_connection", "ethernetip")
    else {
        return;
    };
    let _running = start_box(ADDRESS, "foreign-ethernetip").0;
    let got = ask(&python, "ethernetip_client.py", ADDRESS);

    assert_eq!(
        got["list_identity"],
        json!({ "vendor": 65535, "device_type": 37, "product_code": 1001, "product_name": "Axisbridge two axes" })
    );
    // CIP over TCP, and class 0 and 1 over UDP.
    assert_eq!(got["list_services"], json!({ "capability": 0x120, "name": "Communications" }));
    assert_eq!(got["register"], 0);
    assert_eq!(got["product_name"], json!({ "status": 0, "value": NAME }));
    assert_eq!(got["control_mode"], json!({ "status": 0, "value": "00" }));
    // This client writes 16-bit segments without their pad octet and rounds the length down: a segment error.
    assert_eq!(got["unpadded_path"], json!({ "status": 4, "value": "" }));
    assert_eq!(got["missing_class"], json!({ "status": 5, "value": "" }));

    assert_eq!(got["wrong_configuration"], 0x0126, "a configuration block of half its size");
    assert_eq!(got["too_small"], 0x0127, "no header fits in 8 octets");
    assert_eq!(got["open"], 0);
    assert_eq!(got["intervals_ms"], json!([8.0, 8.0]), "the intervals granted are those asked for");
    assert_eq!(got["second_owner"], 0x0106);
    // On a host in a hurry the box sends on its own before it hears the first update: those have no update to name.
    let before = |datagram: &&serde_json::Value| {
        datagram["data"].as_str().is_some_and(|data| data.starts_with("070200"))
    };
    let received: Vec<_> = got["received"].as_array().expect("datagrams").iter().skip_while(before).collect();
    assert!(received.len() >= 4, "an answer to each update: {received:?}");
    for datagram in received {
        assert_eq!(datagram["from"], ADDRESS);
        assert_eq!(datagram["mine"], true, "it carries the connection ID of this originator");
        // Format, revision 2, and the update ID of the update before.
        let data = datagram["data"].as_str().expect("hexadecimal");
        assert!(data.starts_with("070201"), "{data}");
    }
    assert_eq!(got["close"], 0);
    assert_eq!(got["close_again"]["status"], 1, "a connection failure");
    let again = got["close_again"]["value"].as_str().expect("hexadecimal");
    assert!(again.starts_with("0701"), "extended status 0x0107, no such connection: {again}");
    assert_eq!(got["second_opens_after_close"], 0, "the connection is free at once");
    assert_eq!(got["second_closes"], 0);
}

/// The example with its slide in a device with assemblies at the second address.
fn with_assembly(example: &str, address: &str) -> String {
    let device =
        &example[example.find("[[device]]").expect("a device")..example.find("[[axis]]").expect("an axis")];
    let second = device
        .replace("name = \"front\"", "name = \"plc\"")
        .replace("127.0.0.2", address)
        .replace("[\"turntable\", \"slide\"]", "[\"slide\"]")
        .replace("product_code = 1001", "product_code = 1002")
        .replace("power_structure_class_id = 0", "assembly = { layout = \"position\" }");
    let both = example.replacen("[\"turntable\", \"slide\"]", "[\"turntable\"]", 1) + "\n" + &second;
    // It has no part in what is tested, and a busy host keeps it.
    let slow = both.replace("cycle_time = \"2 ms\"", "cycle_time = \"10 ms\"");
    slow.replace("min = \"2 ms\", max = \"16 ms\"", "min = \"5 ms\", max = \"50 ms\"")
}

#[test]
fn ethernetip_moves_an_axis_through_assemblies_beside_a_motion_device() {
    const ADDRESS: &str = "127.0.0.66";
    const MOTION: &str = "127.0.0.65";
    const TEST: &str = "ethernetip_moves_an_axis_through_assemblies_beside_a_motion_device";
    let Some(python) = peer::python_or_skip(TEST, "ethernetip") else { return };
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), ADDRESS);
    let (mut running, capture) = start_box_of(&example, MOTION, "foreign-assembly");
    let got = ask_with(&python, "ethernetip_assembly.py", &[ADDRESS, MOTION]);
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));

    assert_eq!((&got["device_type"], &got["motion_device_type"]), (&json!(43), &json!(37)));
    assert_eq!(got["at_the_motion_device"], 0x0117, "it has no assemblies");
    assert_eq!((&got["long"], &got["short"]), (&json!(0x0127), &json!(0x0128)));
    assert_eq!((&got["no_such_output"], &got["no_such_input"]), (&json!(0x012A), &json!(0x012B)));
    assert_eq!(got["multicast"], json!([0, 0]), "opened and closed");
    assert_eq!((&got["open"], &got["second_owner"]), (&json!(0), &json!(0x0106)));

    let number = |what: &str, field: &str| got[what][field].as_i64().expect("a number");
    const TORQUE: i64 = 1 << 14;
    assert_eq!(number("at_first", "status") & TORQUE, 0, "a level does not enable");
    // 10 000 counts in a millimetre.
    let arrived = number("arrived", "position");
    assert!((arrived - 125_000).abs() <= 300, "{arrived}");
    let velocity = number("under_way", "velocity");
    assert!((velocity - 500_000).abs() < 50_000, "{velocity}");
    assert_eq!(got["open_again"], 0);
    let (again, still) = (number("again", "position"), number("still", "position"));
    assert!(again > arrived && again < 7_000_000, "it stopped on its way: {again}");
    assert_eq!(number("still", "status") & TORQUE, 0, "nothing moves on a reconnection");
    assert!((still - again).abs() <= 10, "{still} {again}");
    let lost = i64::from(profile_generic::fault::FaultCause::COMMAND_LOST.0);
    assert_eq!((number("again", "fault"), number("still", "fault")), (lost, lost));
    assert!(number("home", "position").abs() <= 300, "{}", got["home"]);
    assert_eq!((number("off", "fault"), &got["close"]), (0, &json!(0)));

    if peer::tshark_or_skip(TEST) {
        let frames = tshark::dissect(&capture, "enip && udp.port == 2222", &[]);
        assert!(frames.len() > 200, "{} frames", frames.len());
        assert!(frames.iter().all(|frame| !frame.has("_ws.malformed")));
        let in_run = tshark::dissect(&capture, "cip.32bitheader.run_idle == 1", &[]);
        assert!(in_run.len() > 100, "{} frames with a run/idle header", in_run.len());
        let opens = tshark::dissect(&capture, "cip.cm.otrpi && cip.rr == 0", &[]);
        assert!(opens.len() >= 8, "{} requests", opens.len());
    }
}

#[test]
fn pycomm3_reads_assemblies_without_a_connection_and_sets_none() {
    const ADDRESS: &str = "127.0.0.72";
    const MOTION: &str = "127.0.0.71";
    const TEST: &str = "pycomm3_reads_assemblies_without_a_connection_and_sets_none";
    let Some(python) = peer::python_or_skip(TEST, "pycomm3") else { return };
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), ADDRESS);
    let (mut running, _) = start_box_of(&example, MOTION, "foreign-assembly-object");
    let got = ask(&python, "pycomm3_assembly.py", ADDRESS);
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
    for (what, value) in [
        ("revision", "0200"),
        ("output_size", "1000"),
        ("input_size", "1400"),
        // Nobody commands anything.
        ("output", "00000000000000000000000000000000"),
        ("configuration", ""),
    ] {
        assert_eq!(got[what], json!({ "value": value, "error": null }), "{what}");
    }
    for what in ["input", "connected_input"] {
        let input = got[what]["value"].as_str().expect("20 bytes");
        let word = u16::from_str_radix(&format!("{}{}", &input[2..4], &input[..2]), 16).expect("the status");
        // Ready, locked, standstill, without run, torque and fault; the toggle is any.
        assert_eq!((input.len(), word & 0x45FF & !0x1000), (40, 1 | 1 << 7 | 1 << 10), "{what}: {input}");
    }
    for (what, error) in [
        ("set_output", "Attribute not settable"),
        ("set_input", "Attribute not settable"),
        ("members", "Attribute not supported"),
    ] {
        assert_eq!(got[what]["error"], error, "{what}");
    }
    let missing = got["missing"]["error"].as_str().expect("refused");
    assert!(missing.starts_with("Destination unknown"), "{missing}");
}

/// The turntable of the example by a torque in 1024ths of a newton metre, with a motor of 1 Nm.
fn by_torque(example: &str) -> String {
    let assembly = "assembly = { layout = \"speed-torque\", drive_mode = \"torque\", torque_scale = 10 }";
    let motor = "unwind_counts = 1_000_000     # a modulo axis: one turn has as many counts\nmotor = { rated_torque = 1.0 }";
    let (line, _) = motor.split_once('\n').expect("two lines");
    let text = example.replacen("power_structure_class_id = 0", assembly, 1).replacen(line, motor, 1);
    assert!(text.contains(assembly) && text.contains(motor), "{text}");
    text
}

/// A script drives an axis by its torque, and pycomm3 reads which reference counts and what its numbers are.
#[test]
fn an_axis_is_driven_by_torque_and_pycomm3_reads_what_the_numbers_count() {
    const ADDRESS: &str = "127.0.0.59";
    const OTHER: &str = "127.0.0.58";
    const TEST: &str = "an_axis_is_driven_by_torque_and_pycomm3_reads_what_the_numbers_count";
    let Some(python) = peer::python_or_skip(TEST, "pycomm3") else { return };
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), OTHER);
    let (mut running, capture) = start_box_of(&by_torque(&example), ADDRESS, "by-torque");
    let got = ask(&python, "pycomm3_drive_object.py", ADDRESS);
    for (what, value) in [
        ("drive_mode", "03"),
        ("speed_reference", "0000"),
        ("torque_reference", "0000"),
        ("speed_scale", "00"),
        ("torque_scale", "0a"),
    ] {
        assert_eq!(got[what], json!({ "value": value, "error": null }), "{what}");
    }
    assert_eq!(got["set_mode"]["error"], "Attribute not settable");
    assert_eq!(got["acceleration_time"]["error"], "Attribute not supported");

    let script = capture.with_extension("script");
    // 23.4 mNm: friction takes 20 mNm of it, and the rest at 5.7 revolutions a second.
    let steps = "device = \"front\"\ninterval = \"20 ms\"\n\
                 [[step]]\nenable = \"turntable\"\n\
                 [[step]]\nset = { axis = \"turntable\", field = \"torque_reference\", value = 24 }\n\
                 [[step]]\nexpect = { axis = \"turntable\", velocity = 4.0, tolerance = 3.0, within = \"10 s\" }\n\
                 [[step]]\nset = { axis = \"turntable\", field = \"torque_reference\", value = -24 }\n\
                 [[step]]\nexpect = { axis = \"turntable\", velocity = -4.0, tolerance = 3.0, within = \"10 s\" }\n\
                 [[step]]\ndisable = \"turntable\"\n\
                 [[step]]\nexpect = { axis = \"turntable\", status = [\"ready\", \"standstill\"], within = \"5 s\" }\n";
    std::fs::write(&script, steps).expect("the scratch folder can be written");
    let mut command = Command::new(axisbridge());
    command.args(["simulate", "plc", "--config"]).arg(capture.with_extension("toml"));
    let output = command.arg("--script").arg(&script).output().expect("it starts");
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert_eq!(output.status.code(), Some(0), "{}{}", said(&output.stdout), said(&output.stderr));
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
}

#[test]
fn the_python_file_for_users_moves_an_axis_or_says_why_not() {
    const ADDRESS: &str = "127.0.0.70";
    const MOTION: &str = "127.0.0.69";
    const TEST: &str = "the_python_file_for_users_moves_an_axis_or_says_why_not";
    let Some(python) = peer::python_or_skip(TEST, "ethernetip") else { return };
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), ADDRESS);
    let (mut running, capture) = start_box_of(&example, MOTION, "python-file");
    let mut write = Command::new(axisbridge());
    write.args(["assembly", "--format", "python", "--config"]).arg(capture.with_extension("toml"));
    let module = write.output().expect("it starts");
    let file = capture.with_extension("py");
    std::fs::write(&file, &module.stdout).expect("the scratch folder can be written");
    let moved = |to: &str, velocity: &str| {
        let arguments = [ADDRESS, "--axis", "slide", "--to", to, "--velocity", velocity];
        let output = Command::new(&python).arg(&file).args(arguments).output().expect("python starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (code, said, error) = moved("125000", "500000");
    assert_eq!(code, Some(0), "{said}{error}");
    let place: i64 = said.trim().strip_prefix("slide at ").expect("the position").parse().expect("a number");
    assert!((place - 125_000).abs() <= 300, "{said}");
    let (code, said, error) = moved("-55000", "500000");
    assert!(code == Some(1) && error.contains("slide: beyond limit"), "{said}{error}");
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
}

#[test]
fn the_simulated_plc_moves_an_axis_through_assemblies_or_says_why_not() {
    const ADDRESS: &str = "127.0.0.68";
    const MOTION: &str = "127.0.0.67";
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), ADDRESS);
    let (mut running, capture) = start_box_of(&example, MOTION, "simulated-plc");
    let config = capture.with_extension("toml");
    let plc = |axis: &str, to: &str, velocity: &str| {
        let mut command = Command::new(axisbridge());
        command.args([
            "simulate",
            "plc",
            "--interval-us",
            "20000",
            "--axis",
            axis,
            "--to",
            to,
            "--velocity",
            velocity,
        ]);
        let output = command.arg("--config").arg(&config).output().expect("it starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (code, said, error) = plc("slide", "12.5", "50");
    assert_eq!(code, Some(0), "{said}{error}");
    let last = said.lines().last().expect("a line");
    let place: f64 = last.strip_prefix("slide at ").expect("the position").parse().expect("a number");
    assert!((place - 12.5).abs() < 0.05, "{said}");
    let (code, said, error) = plc("slide", "-5.5", "50");
    assert_eq!(code, Some(1), "{said}{error}");
    assert!(error.contains("the axis refuses to move: beyond limit"), "{error}");
    let (code, _, error) = plc("slide", "0", "1001");
    assert!(code == Some(1) && error.contains("the axis refuses to move: too fast"), "{error}");
    let (code, _, error) = plc("turntable", "1", "1");
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("is on the CIP Motion device `front`; expected one with assemblies"), "{error}");
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
    let (code, _, error) = plc("slide", "1", "1");
    assert!(code == Some(1) && error.contains("cannot connect"), "{error}");
}

/// What a script may do to the slide: moves, an idle, a silence and a close amid a movement, and what has to follow.
const SCRIPT: &str = r#"
interval = "20 ms"

[[step]]
enable = "slide"

[[step]]
move = { axis = "slide", to = 12.5, velocity = 50 }

[[step]]
expect = { axis = "slide", position = 12.5, tolerance = 0.05 }

[[step]]
move = { axis = "slide", to = 600, velocity = 50, wait = false }

[[step]]
expect = { axis = "slide", velocity = 50, tolerance = 5, within = "5 s" }

[[step]]
idle = "500 ms"

[[step]]
title = "START and ENABLE as levels move nothing"
expect = { axis = "slide", status = ["fault", "locked", "run"] }

[[step]]
expect = { axis = "slide", fault = "command_lost" }

[[step]]
dwell = "300 ms"

[[step]]
expect = { axis = "slide", status_off = ["torque", "moving"] }

[[step]]
fault_reset = "slide"

[[step]]
enable = "slide"

[[step]]
move = { axis = "slide", by = 500, velocity = 50, wait = false }

[[step]]
silence = "1 s"

[[step]]
connect = true

[[step]]
expect = { axis = "slide", status = ["fault", "locked", "run"] }

[[step]]
close = true

[[step]]
dwell = "100 ms"

[[step]]
connect = true

[[step]]
fault_reset = "slide"

[[step]]
word = { axis = "slide", value = 0x0100 }

[[step]]
expect = { axis = "slide", refusal = "reserved bits" }

[[step]]
enable = "slide"

[[step]]
set = { axis = "slide", field = "velocity", value = -1 }

[[step]]
word = { axis = "slide", bits = ["enable", "start"] }

[[step]]
expect = { axis = "slide", refusal = "not positive" }

[[step]]
move = { axis = "slide", to = 0, velocity = 100 }

[[step]]
disable = "slide"
"#;

#[test]
fn the_simulated_plc_carries_out_a_script_or_says_which_step_failed() {
    const ADDRESS: &str = "127.0.0.74";
    const MOTION: &str = "127.0.0.73";
    let example = with_assembly(include_str!("../../../examples/two-axes-in-process.toml"), ADDRESS);
    let (mut running, capture) = start_box_of(&example, MOTION, "scripted-plc");
    let config = capture.with_extension("toml");
    let plc = |name: &str, script: &str, more: &[&str]| {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, script).expect("the scratch folder can be written");
        let mut command = Command::new(axisbridge());
        command.args(["simulate", "plc", "--script"]).arg(&path).arg("--config").arg(&config).args(more);
        let output = command.output().expect("it starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (code, said, error) = plc("plc-script.toml", SCRIPT, &["--check"]);
    assert_eq!((code, error.as_str()), (Some(0), ""));
    assert!(said.contains("   2  line 7      move slide to 12.5 at 50 per second\n"), "{said}");
    assert!(said.ends_with("1 axes, 28 steps; nothing was sent\n"), "{said}");

    let (code, said, error) = plc("plc-script.toml", SCRIPT, &[]);
    assert_eq!((code, error.as_str()), (Some(0), ""), "{said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("passed")).count(), 28, "{said}");
    let last = said.lines().last().expect("a line");
    let place: f64 = last.strip_prefix("slide at ").expect("the position").parse().expect("a number");
    assert!(place.abs() < 0.05, "{said}");

    let step = |step: &str| format!("[[step]]\nenable = \"slide\"\n[[step]]\n{step}\n");
    for (script, expected) in [
        (
            step("move = { axis = \"slide\", to = -6, velocity = 50 }"),
            "slide: the axis refuses to move: beyond limit",
        ),
        (
            step("expect = { axis = \"slide\", status = [\"fault\"], within = \"200 ms\" }"),
            "slide: expected fault on within 0.2 s, it has ",
        ),
        (
            step("move = { axis = \"slide\", to = 600, velocity = 10 }\nwithin = \"1 s\""),
            "did not move within 1 s",
        ),
    ] {
        let (code, said, error) = plc("plc-failing.toml", &script, &[]);
        assert_eq!(code, Some(1), "{said}{error}");
        assert!(error.contains("step 2: ") && error.contains(expected), "{error}");
        assert!(said.contains("failed     2  line 3"), "{said}");
        assert!(said.contains("disabled and closed"), "{said}");
    }
    let (code, _, error) = plc("plc-wrong.toml", "[[step]]\nenable = \"turntable\"\n", &[]);
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("plc-wrong.toml:2:10") && error.contains("expected one of \"slide\""), "{error}");
    assert_eq!(running.terminate(Duration::from_secs(10)).code(), Some(0));
}

#[test]
fn nmap_identifies_the_box_over_tcp_and_udp() {
    const ADDRESS: &str = "127.0.0.63";
    const TEST: &str = "nmap_identifies_the_box_over_tcp_and_udp";
    if !peer::nmap_or_skip(TEST) {
        return;
    }
    let _running = start_box(ADDRESS, "foreign-nmap").0;
    // Without privileges nmap cannot send UDP probes of its own.
    let udp = peer::namespaces_or_skip(TEST);
    for scan in [&["-sT"][..], &["-sU"]].into_iter().take(if udp { 2 } else { 1 }) {
        let output = Command::new("nmap")
            .args(["-n", "-Pn", "-p", "44818", "--script", "enip-info"])
            .args(scan)
            .arg(ADDRESS)
            .output()
            .expect("nmap can be started");
        let text = String::from_utf8_lossy(&output.stdout);
        for line in [
            "type: CIP Motion Drive (37)",
            "(65535)\n",
            "productName: Axisbridge two axes",
            "serialNumber: 0x0001e240",
            "productCode: 1001",
            "revision: 1.1",
            "deviceIp: 127.0.0.63",
        ] {
            assert!(text.contains(line), "{scan:?}: expected {line:?} in\n{text}");
        }
    }
}
