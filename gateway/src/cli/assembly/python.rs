//! A module for Python: the assemblies, and a program that moves an axis with the client `ethernetip`.

use std::fmt::Write as _;

use profile_cip::assembly::handshake::{Control, Refusal, Status};

use super::Field;
use super::library::Library;

/// What is the same in every file: the words and the mover, and the program.
const MOVER: &str = include_str!("mover.py");

/// The file.
pub fn file(library: &Library<'_>) -> String {
    let device = library.device;
    let mut text = String::from("\"\"\"");
    for line in library.about() {
        let _ = writeln!(text, "{}", line.replace('\\', "/").replace('"', "'"));
    }
    text.push_str("\"\"\"\n\nimport enum\nimport struct\nimport typing\n\n");
    for (name, value) in [
        ("OUTPUT_POINT", usize::from(device.output.point)),
        ("OUTPUT_BYTES", device.output.bytes),
        ("INPUT_POINT", usize::from(device.input.point)),
        ("INPUT_BYTES", device.input.bytes),
        ("CONFIGURATION_POINT", usize::from(device.configuration_point)),
    ] {
        let _ = writeln!(text, "{name} = {value}");
    }
    let _ = writeln!(text, "AXES = {:?}\n", device.axes);
    record(&mut text, "AxisOutput", "One axis, to the gateway.", library.output());
    record(&mut text, "AxisInput", "One axis, from the gateway.", library.input());
    text.push_str(
        "\ndef pack_output(axes):\n    \"\"\"The output assembly of one AxisOutput for each axis, in the order of AXES.\"\"\"\n    \
         return b\"\".join(AXIS_OUTPUT.pack(*axis) for axis in axes)\n\n\n\
         def unpack_input(data):\n    \"\"\"One AxisInput for each axis, in the order of AXES.\"\"\"\n    \
         if len(data) != INPUT_BYTES:\n        raise ValueError(f\"expected {INPUT_BYTES} bytes, got {len(data)}\")\n    \
         return [AxisInput(*axis) for axis in AXIS_INPUT.iter_unpack(data)]\n",
    );
    let Some(block) = library.block() else { return text };
    words(&mut text);
    let target = block.target_field();
    let optional = |on: bool, line: &str| if on { line.to_owned() } else { String::new() };
    text.push_str(
        &MOVER
            .replace("{TARGET}", target)
            .replace("{ACTUAL}", &target.replacen("target", "actual", 1))
            .replace(
                "            {ACCELERATION}\n",
                &optional(block.has_acceleration(), "            acceleration=acceleration,\n"),
            )
            .replace(
                "        {MODE}\n",
                &optional(block.has_mode(), "        self.output = self.output._replace(mode=1)\n"),
            ),
    );
    text
}

/// A named tuple and its layout.
fn record(text: &mut String, name: &str, about: &str, fields: &[Field<'_>]) {
    let codes: String = fields.iter().map(|field| code(field.kind)).collect();
    let constant = if name == "AxisOutput" { "AXIS_OUTPUT" } else { "AXIS_INPUT" };
    let _ = writeln!(text, "{constant} = struct.Struct(\"<{codes}\")\n\n");
    let _ = writeln!(text, "class {name}(typing.NamedTuple):\n    \"\"\"{about}\"\"\"\n");
    let mut pads = 0;
    for field in fields {
        // A pad may stand there more than once.
        let name = match field.name.starts_with("pad_") {
            true => {
                pads += 1;
                format!("{}_{pads}", field.name)
            }
            false => field.name.to_owned(),
        };
        let _ = writeln!(text, "    {name}: int = 0\n    \"\"\"{}\"\"\"", field.description);
    }
    text.push('\n');
}

/// The words with their bits, and the reasons for refusals.
fn words(text: &mut String) {
    let _ = writeln!(text, "\n\nclass Control(enum.IntFlag):\n    \"\"\"Control word.\"\"\"\n");
    for (name, bits) in Control::all().iter_names() {
        let _ = writeln!(text, "    {name} = 0x{:04X}", bits.bits());
    }
    let _ = writeln!(text, "\n\nclass Status(enum.IntFlag):\n    \"\"\"Status word.\"\"\"\n");
    for (name, bits) in Status::all().iter_names() {
        let _ = writeln!(text, "    {name} = 0x{:04X}", bits.bits());
    }
    text.push_str("\n\nREFUSALS = {\n");
    for refusal in (0..=u8::MAX).map(Refusal) {
        if let Some(name) = refusal.name() {
            let _ = writeln!(text, "    {}: \"{name}\",", refusal.0);
        }
    }
    text.push_str("}\n");
}

/// The letter of the module `struct` for a type.
fn code(kind: &str) -> char {
    match kind {
        "USINT" | "BYTE" => 'B',
        "INT" => 'h',
        "UINT" => 'H',
        "DINT" => 'i',
        "UDINT" => 'I',
        _ => 'q',
    }
}
