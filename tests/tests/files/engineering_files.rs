//! The files for engineering tools that `axisbridge assembly` writes, as the parsers of other makers read them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use serde_json::{Value, json};

use super::data_sheet::scratch;

const EXAMPLE: &str = include_str!("../../../examples/two-axes-in-process.toml");

fn assembly(config: &Path, arguments: &[&str]) -> Output {
    Command::new(axisbridge())
        .arg("assembly")
        .arg("--config")
        .arg(config)
        .args(arguments)
        .output()
        .expect("the program starts")
}

/// A configuration whose device has assemblies with this layout.
fn configuration(name: &str, layout: &str) -> PathBuf {
    let file = scratch(name).join("box.toml");
    let text = EXAMPLE.replacen("power_structure_class_id = 0", &format!("assembly = {layout}"), 1);
    std::fs::write(&file, text.replace("\"front\"", "\"plc-1\"")).expect("written");
    file
}

/// What the parsers read in all four files.
fn read(python: &Path, config: &Path) -> Value {
    let folder = config.parent().expect("a folder");
    for (format, file) in [
        ("structured-text", "library.st"),
        ("plcopen", "library.xml"),
        ("l5x", "library.l5x"),
        ("python", "library.py"),
    ] {
        let output = assembly(config, &["--format", format]);
        assert!(output.status.success(), "{format}: {}", String::from_utf8_lossy(&output.stderr));
        std::fs::write(folder.join(file), &output.stdout).expect("written");
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/engineering_files.py");
    let output = Command::new(python).arg(script).arg(folder).output().expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

#[test]
fn parsers_of_other_makers_read_the_files_for_engineering_tools() {
    const TEST: &str = "parsers_of_other_makers_read_the_files_for_engineering_tools";
    let Some(python) = peer::python_or_skip(TEST, "blark, plcopen, l5x") else { return };
    let got = read(&python, &configuration("engineering-mixed", "{ layout = \"mixed\" }"));

    let members = [
        ("control", "UINT"),
        ("mode", "USINT"),
        ("pad_8", "USINT"),
        ("velocity", "DINT"),
        ("target_position_64", "LINT"),
        ("acceleration", "DINT"),
        ("torque", "INT"),
        ("torque_offset", "INT"),
        ("time_stamp", "LINT"),
    ];
    let names: Vec<_> = members.iter().map(|(name, _)| *name).collect();
    let text = &got["structured_text"];
    assert_eq!(text["types"]["plc_1_AxisOutput"], json!(members));
    let axes = json!([["turntable", "plc_1_AxisOutput"], ["slide", "plc_1_AxisOutput"]]);
    assert_eq!(text["types"]["plc_1_Output"], axes);
    let block = &text["blocks"]["plc_1_Axis"];
    let statements = block["statements"].as_u64().expect("a number");
    assert!(statements > 20, "{block}");

    let xml = &got["plcopen"];
    assert_eq!(xml["types"]["plc_1_AxisOutput"], json!(names));
    assert_eq!(xml["types"]["plc_1_Input"], json!(["turntable", "slide"]));
    let pou = &xml["blocks"]["plc_1_Axis"];
    assert_eq!(pou["type"], "functionBlock");
    let inputs =
        ["Connected", "Enable", "Execute", "Relative", "Halt", "Reset", "Target", "Velocity", "Acceleration"];
    assert_eq!(pou["inputs"], json!(inputs));
    let body = pou["statements"].as_str().expect("text");
    assert!(body.contains("ToAxis.control := DINT_TO_UINT(ControlWord);"), "{body}");

    let logix = &got["l5x"];
    assert_eq!(logix["target"], "plc_1_Axis");
    let signed = members.map(|(name, kind)| match kind {
        "UINT" => (name, "INT"),
        "USINT" => (name, "SINT"),
        kind => (name, kind),
    });
    assert_eq!(logix["types"]["plc_1_AxisOutput"], json!(signed));
    let parameters = &logix["instructions"]["plc_1_Axis"]["parameters"];
    assert_eq!(parameters[0], json!(["EnableIn", "BOOL", "Input"]));
    assert_eq!(parameters[2], json!(["ToAxis", "plc_1_AxisOutput", "InOut"]));
    assert_eq!(parameters[10], json!(["Target", "LINT", "InOut"]), "{parameters}");

    let module = &got["python"];
    assert_eq!(module["axes"], json!(["turntable", "slide"]));
    let axis = |control: &str, velocity: &str| format!("{control}0000{velocity}{}", "00".repeat(24));
    assert_eq!(module["packed"], axis("0201", "000000ff") + &axis("0301", "fffffffe"));
    let second = &module["shown"][1];
    // Each axis has 40 bytes.
    assert_eq!((&second["status"], &second["mode"]), (&json!(0x2928), &json!(0x2A)));
    assert_eq!(second["actual_position_64"], json!(0x3736_3534_3332_3130_u64), "{second}");
}

#[test]
fn layouts_without_targets_have_types_only() {
    const TEST: &str = "layouts_without_targets_have_types_only";
    let Some(python) = peer::python_or_skip(TEST, "blark, plcopen, l5x") else { return };
    let got = read(&python, &configuration("engineering-motion", "{ layout = \"motion\" }"));
    assert_eq!(got["structured_text"]["blocks"], json!({}));
    assert_eq!(got["plcopen"]["blocks"], json!({}));
    assert_eq!((&got["l5x"]["instructions"], &got["l5x"]["target"]), (&json!({}), &json!("plc_1_Output")));
    let members = [["control", "INT"], ["torque_offset", "INT"], ["velocity_offset", "DINT"]];
    let types = &got["l5x"]["types"]["plc_1_AxisOutput"];
    assert_eq!(types.as_array().expect("members")[..3], json!(members).as_array().expect("members")[..]);
}

#[test]
fn fields_that_a_tool_would_lay_out_otherwise_are_refused() {
    let layout = "{ output = [\"control\", \"mode\", \"velocity\", \"pad_8\"], input = [\"status\"] }";
    let config = configuration("engineering-odd", layout);
    let output = assembly(&config, &["--format", "l5x"]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    let expected = "the output field `velocity` of 4 bytes is at offset 3: in L5X a field has to be at a multiple of its size";
    assert!(said.contains(expected), "{said}");
    assert!(assembly(&config, &["--format", "structured-text"]).status.success());

    let output = assembly(&config, &["--device", "other"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("no device `other` with assemblies; expected plc-1"), "{said}");
}

/// A byte of bits is a byte in every tool, and six bytes of one axis are no gap.
#[test]
fn assemblies_of_the_drive_profile_have_types_of_each_tool() {
    const TEST: &str = "assemblies_of_the_drive_profile_have_types_of_each_tool";
    let Some(python) = peer::python_or_skip(TEST, "blark, plcopen, l5x") else { return };
    let file = scratch("engineering-torque").join("box.toml");
    std::fs::write(&file, include_str!("every_key/assembly.toml")).expect("written");
    let folder = file.parent().expect("a folder");
    let text = std::fs::read_to_string(&file).expect("read");
    // The device with speed and torque alone.
    let from = text.find("[[device]]").expect("the first device");
    let own = text.find("[[device]]\nname = \"side\"").expect("the device");
    let axes = text.find("[[axis]]").expect("axes");
    let axis = text.find("[[axis]]\nname = \"winder\"").expect("its axis");
    let south = text.find("[south.sercos]").expect("the bus");
    let drives = text.find("[[south.sercos.drive]]").expect("drives");
    let drive = text.find("[[south.sercos.drive]]\nname = \"drive-c\"").expect("its drive");
    let parts = [&text[..from], &text[own..axes], &text[axis..south], &text[south..drives], &text[drive..]];
    std::fs::write(&file, parts.concat().replace("\"side\"", "\"plc-1\"")).expect("written");
    let got = read(&python, &file);
    let members = |byte: &str| {
        json!([
            ["control", byte],
            ["pad_8", if byte == "BYTE" { "USINT" } else { byte }],
            ["speed_reference", "INT"],
            ["torque_reference", "INT"]
        ])
    };
    assert_eq!(got["structured_text"]["types"]["plc_1_AxisOutput"], members("BYTE"));
    assert_eq!(got["structured_text"]["blocks"], json!({}));
    assert_eq!(
        got["plcopen"]["types"]["plc_1_AxisInput"],
        json!(["status", "drive_state", "actual_speed", "actual_torque"])
    );
    assert_eq!(got["l5x"]["types"]["plc_1_AxisOutput"], members("SINT"));
    let module = &got["python"];
    assert_eq!((&module["axes"], &module["packed"]), (&json!(["winder"]), &json!("020000000000")));
    let shown = json!({ "status": 0, "drive_state": 1, "actual_speed": 0x0302, "actual_torque": 0x0504 });
    assert_eq!(module["shown"], json!([shown]));
    let said = std::fs::read_to_string(folder.join("library.st")).expect("the file");
    let expected = "References: the torque reference moves the axis, the speed reference has no effect; torque in Nm / 2^8.";
    assert!(said.contains(expected), "{said}");
    let output = assembly(&file, &[]);
    let said = String::from_utf8_lossy(&output.stdout);
    for line in [
        "  the torque reference moves the axis, the speed reference has no effect; torque in Nm / 2^8\n",
        "  output point 23, 6 bytes, 12 in a Forward_Open\n",
        "       4  INT    winder.torque_reference\n",
        "  input point 73, 6 bytes, 8 in a Forward_Open\n",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
}
