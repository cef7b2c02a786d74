//! The assemblies of a sheet, and the connections to them.

use profile_cip::assembly::layout::{CONFIGURATION_POINT, INPUT_ONLY_POINT, LISTEN_ONLY_POINT, Placed};
use profile_cip::assembly::{Assemblies, RUN_IDLE_LEN};
use profile_cip::device::config::AdapterConfig;
use profile_cip::device::objects::class::CLASS_ASSEMBLY;

use super::writer::{Field, Writer};
use super::{PARAM_RPI, parameters, transport};

/// Bits of the first word of a connection beside those of every sheet.
mod application {
    pub const CLASS_1: u32 = 1 << 1;
    pub const LISTEN_ONLY: u32 = 1 << 24;
    pub const INPUT_ONLY: u32 = 1 << 25;
}

/// Bits of the second word: real time formats O->T.
mod format {
    pub const RUN_IDLE_HEADER: u32 = 4 << 8;
    pub const HEARTBEAT: u32 = 3 << 8;
}

/// Bits in a field of connection types.
mod connection_type {
    pub const MULTICAST: u32 = 1;
    pub const POINT_TO_POINT: u32 = 2;
}

fn point(number: u16) -> String {
    format!("Assem{number}")
}

/// A logical path segment of 8 or 16 bits.
fn segment(kind: u8, number: u16) -> String {
    let [low, high] = number.to_le_bytes();
    match high {
        0 => format!("{kind:02X} {low:02X}"),
        _ => format!("{:02X} 00 {low:02X} {high:02X}", kind + 1),
    }
}

/// Number of the parameter that stands for the first field of the output assembly; those of the others follow, output before input.
const FIRST_FIELD: u16 = 10;

/// Characters that a help text may have.
const HELP_MAX: usize = 64;

/// The fields of both assemblies, each with the number of its parameter.
fn fields(assemblies: &Assemblies) -> [Vec<(u16, Placed)>; 2] {
    let mut numbers = FIRST_FIELD..;
    [assemblies.output(), assemblies.input()]
        .map(|placed| placed.into_iter().zip(&mut numbers).map(|(field, number)| (number, field)).collect())
}

/// A parameter for each field: its name, data type and description.
pub(super) fn field_parameters(w: &mut Writer, assemblies: &Assemblies) {
    for (number, field) in fields(assemblies).iter().flatten() {
        let name = match assemblies.axes() {
            1 => field.name.to_owned(),
            _ => format!("axis {} {}", field.axis + 1, field.name),
        };
        let whole = Some(field.description).filter(|text| text.len() <= HELP_MAX);
        let help = whole.or_else(|| field.description.split([':', '.', ';']).next()).unwrap_or_default();
        let help = if help.len() <= HELP_MAX { help } else { "" };
        let range = [Field::Empty, Field::Empty, Field::Number(0)];
        super::parameter(w, *number, field.kind, [&name, "", help], range);
    }
}

/// The section with the assemblies. The members of an assembly are its fields in their order: each one begins where the one before it ends.
pub(super) fn section(w: &mut Writer, adapter: &AdapterConfig) {
    let Some(assemblies) = &adapter.assembly else { return };
    w.section("Assembly");
    w.entry("Object_Name", &[Field::Text("Assembly Object")]);
    w.entry("Object_Class_Code", &[Field::Hex(u32::from(CLASS_ASSEMBLY), 2)]);
    let size = |len: usize| Field::Number(u32::try_from(len).unwrap_or(0));
    let [output, input] = fields(assemblies);
    for (number, name, len, members) in [
        (assemblies.output_point(), "Output", assemblies.output_len(), output),
        (assemblies.input_point(), "Input", assemblies.input_len(), input),
        (CONFIGURATION_POINT, "Configuration", 0, Vec::new()),
        (INPUT_ONLY_POINT, "Heartbeat of input only", 0, Vec::new()),
        (LISTEN_ONLY_POINT, "Heartbeat of listen only", 0, Vec::new()),
    ] {
        let path = format!("20 04 {}", segment(0x24, number));
        let mut row = vec![
            Field::Text(name),
            Field::Text(&path),
            size(len),
            Field::Hex(0, 4),
            Field::Empty,
            Field::Empty,
        ];
        for (parameter, field) in members {
            row.extend([size(8 * field.len), Field::Reference(parameter)]);
        }
        w.entry(&point(number), &row);
    }
}

/// The connections to the assemblies.
pub(super) fn connections(w: &mut Writer, assemblies: &Assemblies) {
    let types = 1 << (parameters::O_TO_T_TYPES + connection_type::POINT_TO_POINT)
        | 1 << (parameters::T_TO_O_TYPES + connection_type::MULTICAST)
        | 1 << (parameters::T_TO_O_TYPES + connection_type::POINT_TO_POINT)
        | parameters::O_TO_T_FIXED
        | parameters::T_TO_O_FIXED
        | parameters::O_TO_T_SCHEDULED
        | parameters::T_TO_O_SCHEDULED;
    let len = |len: usize| Field::Number(u32::try_from(len).unwrap_or(0));
    let input = point(assemblies.input_point());
    for (number, name, help, application, format, consumed, size) in [
        (
            1,
            "Exclusive Owner",
            "Moves the axes of the device",
            transport::EXCLUSIVE_OWNER,
            format::RUN_IDLE_HEADER,
            assemblies.output_point(),
            assemblies.output_len(),
        ),
        (
            2,
            "Input Only",
            "Reads the axes of the device",
            application::INPUT_ONLY,
            format::HEARTBEAT,
            INPUT_ONLY_POINT,
            0,
        ),
        (
            3,
            "Listen Only",
            "Reads the axes of the device while somebody else is connected",
            application::LISTEN_ONLY,
            format::HEARTBEAT,
            LISTEN_ONLY_POINT,
            0,
        ),
    ] {
        let path = [
            "20 04".to_owned(),
            segment(0x24, CONFIGURATION_POINT),
            segment(0x2C, consumed),
            segment(0x2C, assemblies.input_point()),
        ];
        let output = point(consumed);
        w.entry(
            &format!("Connection{number}"),
            &[
                Field::Hex(application::CLASS_1 | transport::CYCLIC | application, 8),
                Field::Hex(types | format, 8),
                Field::Reference(PARAM_RPI),
                len(size),
                Field::Word(&output),
                Field::Reference(PARAM_RPI),
                len(assemblies.input_len()),
                Field::Word(&input),
                Field::Empty,
                Field::Empty,
                len(0),
                Field::Word("Assem151"),
                Field::Text(name),
                Field::Text(help),
                Field::Text(&path.join(" ")),
            ],
        );
    }
}

const _: () = assert!(RUN_IDLE_LEN == 4 && CONFIGURATION_POINT == 151);

#[cfg(test)]
mod tests {
    use profile_cip::assembly::field::{InputField, OutputField};
    use profile_cip::assembly::{DriveMode, Layout};

    use super::*;

    #[test]
    fn every_field_has_a_data_type_of_its_size() {
        let output = OutputField::ALL.iter().map(|field| (field.kind(), field.size()));
        let input = InputField::ALL.iter().map(|field| (field.kind(), field.size()));
        let speed = Layout::shipped("speed-torque").unwrap().with_torque(DriveMode::Speed, 0);
        let speed = Assemblies::new(speed, 1).unwrap();
        let fields = [speed.output(), speed.input()].concat();
        let fields = fields.iter().map(|field| (field.kind, field.len));
        for (kind, len) in output.chain(input).chain(fields) {
            let (code, size) = super::super::data_type(kind);
            assert!(code != 0 && usize::from(size) == len, "{kind}");
        }
    }
}
