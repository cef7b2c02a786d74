//! `axisbridge assembly`: connection points, sizes and offsets of the devices with assemblies, and files for engineering tools.

mod l5x;
mod library;
mod plcopen;
mod python;
mod structured_text;

use std::fmt::Write as _;
use std::process::ExitCode;

use profile_cip::assembly::layout::{CONFIGURATION_POINT, INPUT_ONLY_POINT, LISTEN_ONLY_POINT, Layout};
use profile_cip::assembly::{Assemblies, Placed};
use serde::Serialize;

use self::library::Library;
use super::{AssemblyArguments, AssemblyFormat, CliError, print, usage};
use crate::config::Config;

/// A device with assemblies.
#[derive(Debug, Serialize)]
struct Device<'a> {
    name: &'a str,
    address: String,
    #[serde(skip)]
    axes: Vec<&'a str>,
    /// It can move to targets.
    #[serde(skip)]
    positions: bool,
    /// What moves the axis, where the assemblies have a speed and a torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    drive_mode: Option<&'static str>,
    /// TorqueScale, where they have a torque in Nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    torque_scale: Option<i8>,
    /// Connection point of the configuration assembly, which has no data.
    configuration_point: u16,
    output: Assembly<'a>,
    input: Assembly<'a>,
    input_only_point: u16,
    listen_only_point: u16,
}

/// One of its assemblies.
#[derive(Debug, Serialize)]
struct Assembly<'a> {
    point: u16,
    /// Bytes of data.
    bytes: usize,
    /// Size in a Forward_Open: with the sequence count, and with the run/idle header of the output.
    connection_size: u16,
    fields: Vec<Field<'a>>,
}

/// A field of an axis.
#[derive(Debug, Serialize)]
struct Field<'a> {
    offset: usize,
    bytes: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    axis: &'a str,
    name: &'static str,
    description: &'static str,
}

/// Prints the assemblies.
///
/// # Errors
/// The configuration is faulty; the output cannot be written.
pub fn run(arguments: &AssemblyArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    let mut devices = devices(&config);
    if devices.is_empty() {
        return Ok(usage("no device of the configuration has assemblies; expected [device.assembly]"));
    }
    if let Some(wanted) = &arguments.device {
        let known = names(&devices);
        devices.retain(|device| device.name == wanted);
        if devices.is_empty() {
            return Ok(usage(&format!("no device `{wanted}` with assemblies; expected {known}")));
        }
    }
    let text = match arguments.format {
        AssemblyFormat::Text => text(&devices),
        AssemblyFormat::Markdown => markdown(&devices),
        AssemblyFormat::Json => serde_json::to_string_pretty(&devices)? + "\n",
        format => {
            let [device] = devices.as_slice() else {
                let known = names(&devices);
                return Ok(usage(&format!("the file is of one device; expected --device with {known}")));
            };
            file(&Library::of(device), format)?
        }
    };
    print(text, ExitCode::SUCCESS)
}

/// The file for an engineering tool.
fn file(library: &Library<'_>, format: AssemblyFormat) -> Result<String, CliError> {
    Ok(match format {
        AssemblyFormat::Plcopen => plcopen::file(library),
        AssemblyFormat::L5x => l5x::file(library)?,
        AssemblyFormat::Python => python::file(library),
        _ => structured_text::file(library),
    })
}

fn names(devices: &[Device<'_>]) -> String {
    devices.iter().map(|device| device.name).collect::<Vec<_>>().join(", ")
}

fn devices(config: &Config) -> Vec<Device<'_>> {
    let mut found = Vec::new();
    for (number, device) in config.devices.iter().enumerate() {
        let Some(assemblies) = &device.assembly else { continue };
        let mut axes: Vec<_> = config.axes_of(number).map(|(_, axis)| axis).collect();
        axes.sort_by_key(|axis| axis.instance);
        let names: Vec<_> = axes.iter().map(|axis| axis.name.as_str()).collect();
        let (drive_mode, torque_scale) = match assemblies.layout() {
            Layout::Speed { output, mode, torque_scale } if output.has_torque() => {
                (Some(mode.name()), Some(*torque_scale))
            }
            _ => (None, None),
        };
        found.push(Device {
            name: &device.name,
            address: device.listen.to_string(),
            axes: names.clone(),
            positions: matches!(assemblies.layout(), Layout::Fields { mode: None | Some(1), .. }),
            drive_mode,
            torque_scale,
            configuration_point: CONFIGURATION_POINT,
            output: output(assemblies, &names),
            input: input(assemblies, &names),
            input_only_point: INPUT_ONLY_POINT,
            listen_only_point: LISTEN_ONLY_POINT,
        });
    }
    found
}

impl Device<'_> {
    /// Drive mode and scale in words, where the assemblies have a torque in Nm.
    fn torque(&self) -> Option<String> {
        let (mode, scale) = (self.drive_mode?, self.torque_scale?);
        let other = if mode == "speed" { "torque" } else { "speed" };
        Some(format!(
            "the {mode} reference moves the axis, the {other} reference has no effect; torque in Nm / 2^{scale}"
        ))
    }
}

fn output<'a>(assemblies: &Assemblies, names: &[&'a str]) -> Assembly<'a> {
    Assembly {
        point: assemblies.output_point(),
        bytes: assemblies.output_len(),
        connection_size: assemblies.o_to_t_size(),
        fields: fields(&assemblies.output(), names),
    }
}

fn input<'a>(assemblies: &Assemblies, names: &[&'a str]) -> Assembly<'a> {
    Assembly {
        point: assemblies.input_point(),
        bytes: assemblies.input_len(),
        connection_size: assemblies.t_to_o_size(),
        fields: fields(&assemblies.input(), names),
    }
}

fn fields<'a>(placed: &[Placed], names: &[&'a str]) -> Vec<Field<'a>> {
    let one = |field: &Placed| Field {
        offset: field.offset,
        bytes: field.len,
        kind: field.kind,
        axis: names.get(field.axis).copied().unwrap_or_default(),
        name: field.name,
        description: field.description,
    };
    placed.iter().map(one).collect()
}

fn text(devices: &[Device<'_>]) -> String {
    let mut text = String::new();
    for device in devices {
        let Device { name, address, configuration_point, input_only_point, listen_only_point, .. } = device;
        let _ = writeln!(text, "{name} at {address}");
        let _ = writeln!(text, "  configuration point {configuration_point}, 0 bytes");
        let heartbeats = format!("input only {input_only_point}, listen only {listen_only_point}");
        let _ = writeln!(text, "  heartbeat points: {heartbeats}");
        if let Some(torque) = device.torque() {
            let _ = writeln!(text, "  {torque}");
        }
        for (side, assembly) in [("output", &device.output), ("input", &device.input)] {
            let Assembly { point, bytes, connection_size, .. } = assembly;
            let sizes = format!("{bytes} bytes, {connection_size} in a Forward_Open");
            let _ = writeln!(text, "  {side} point {point}, {sizes}");
            for field in &assembly.fields {
                let Field { offset, kind, axis, name, .. } = field;
                let _ = writeln!(text, "    {offset:4}  {kind:5}  {axis}.{name}");
            }
        }
    }
    text
}

fn markdown(devices: &[Device<'_>]) -> String {
    let mut text = String::new();
    for device in devices {
        let _ = writeln!(text, "## {}\n", device.name);
        let _ = writeln!(text, "| what | value |\n|---|---|");
        let _ = writeln!(text, "| address | {} |", device.address);
        let _ = writeln!(text, "| configuration point | {}, 0 bytes |", device.configuration_point);
        let _ = writeln!(text, "| heartbeat, input only | {} |", device.input_only_point);
        let _ = writeln!(text, "| heartbeat, listen only | {} |", device.listen_only_point);
        if let Some(torque) = device.torque() {
            let _ = writeln!(text, "| references | {torque} |");
        }
        for (side, assembly) in [("Output", &device.output), ("Input", &device.input)] {
            let Assembly { point, bytes, connection_size, .. } = assembly;
            let _ = writeln!(
                text,
                "\n### {side}: point {point}, {bytes} bytes, {connection_size} in a Forward_Open\n"
            );
            let _ = writeln!(text, "| offset | type | axis | field | what it is |\n|---|---|---|---|---|");
            for field in &assembly.fields {
                let Field { offset, kind, axis, name, description, .. } = field;
                let _ = writeln!(text, "| {offset} | {kind} | {axis} | `{name}` | {description} |");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: &str = include_str!("../../../../examples/two-axes-in-process.toml");

    fn config(assembly: &str) -> Config {
        let text = BOX.replacen("power_structure_class_id = 0", &format!("assembly = {assembly}"), 1);
        Config::parse(&text, "box.toml").unwrap_or_else(|findings| panic!("{findings}"))
    }

    #[test]
    fn text_and_markdown_have_every_field_at_its_offset() {
        let config = config("{ layout = \"position\" }");
        let devices = devices(&config);
        let [device] = devices.as_slice() else { panic!("one device") };
        assert_eq!((device.output.bytes, device.output.connection_size), (32, 38));
        assert_eq!((device.input.bytes, device.input.connection_size), (40, 42));
        let text = text(&devices);
        let second = &device.output.fields[5];
        assert_eq!((second.offset, second.name), (16, "control"));
        assert!(text.contains(&format!("      16  UINT   {}.control\n", second.axis)), "{text}");
        assert!(text.contains("  output point 150, 32 bytes, 38 in a Forward_Open\n"), "{text}");
        let markdown = markdown(&devices);
        assert!(markdown.contains(&format!("| 16 | UINT | {} | `control` | Control word. |\n", second.axis)));
        let json = serde_json::to_value(&devices).unwrap();
        assert_eq!(json[0]["input"]["fields"][2]["offset"], 3);
        assert_eq!(json[0]["input"]["fields"][2]["type"], "USINT");
    }
}
