//! `[device.assembly]`.

use profile_cip::assembly::layout::{SHIPPED, TORQUE_SCALE_MAX};
use profile_cip::assembly::{Assemblies, DriveMode, InputField, Layout, LayoutError, OutputField};
use profile_generic::parameter::Parameter;

use super::{Problems, value};
use crate::config::file::{AssemblyTable, DeviceTable};
use crate::config::{Axis, AxisFunction, AxisKind, Device};
use crate::finding::Spanned;
use crate::finding::registry as code;

/// Names of the shipped layouts.
pub(in crate::config) const LAYOUTS: [(&str, &str); 7] = {
    let [a, b, c, d, e, f, g] = SHIPPED;
    [(a, a), (b, b), (c, c), (d, d), (e, e), (f, f), (g, g)]
};

const DEFAULT_LAYOUT: &str = "position";

/// Names of the modes of assemblies with speed and torque.
pub(in crate::config) fn drive_modes() -> Vec<(&'static str, DriveMode)> {
    DriveMode::NAMED.to_vec()
}

/// Fields of the output assembly.
pub(in crate::config) fn output_fields() -> Vec<(&'static str, OutputField)> {
    OutputField::ALL.iter().map(|field| (field.name(), *field)).collect()
}

/// Fields of the input assembly.
pub(in crate::config) fn input_fields() -> Vec<(&'static str, InputField)> {
    InputField::ALL.iter().map(|field| (field.name(), *field)).collect()
}

/// The assemblies of a device; the inner `None` for a CIP Motion device.
#[expect(clippy::option_option, reason = "the outer one says that there is an error, as everywhere here")]
pub(super) fn check(problems: &mut Problems, device: &DeviceTable) -> Option<Option<Assemblies>> {
    let Some(table) = &device.assembly else { return Some(None) };
    let motion_only = [
        device.power_structure_class_id.as_ref().map(|key| ("power_structure_class_id", key.span())),
        device.connection_format.as_ref().map(|key| ("connection_format", key.span())),
    ];
    let mut sound = true;
    for (key, span) in motion_only.into_iter().flatten() {
        sound = false;
        problems.report_as::<()>(
            code::CONTRADICTION,
            span,
            format_args!("`{key}` of a device with assemblies"),
            "expected it for CIP Motion devices only",
        );
    }
    let layout = layout(problems, table)?;
    let layout = torque(problems, table, layout)?;
    match Assemblies::new(layout, device.axes.get_ref().len()) {
        Ok(assemblies) => sound.then_some(Some(assemblies)),
        Err(error) => {
            let expected = match error {
                LayoutError::OneAxis { .. } => "expected one axis in the device, or another layout",
                _ => "expected fewer fields or axes",
            };
            problems.report_as(code::CONTRADICTION, table.span(), format_args!("{error}"), expected)
        }
    }
}

fn layout(problems: &mut Problems, table: &Spanned<AssemblyTable>) -> Option<Layout> {
    let AssemblyTable { layout, output, input, .. } = table.get_ref();
    match (layout, output, input) {
        (Some(name), None, None) => Layout::shipped(value::word(problems, name, "layout", &LAYOUTS)?),
        (None, None, None) => Layout::shipped(DEFAULT_LAYOUT),
        (None, Some(output), Some(input)) => {
            let output = fields(problems, output, "output field", &output_fields());
            let input = fields(problems, input, "input field", &input_fields());
            match Layout::of_fields(output?, input?) {
                Ok(layout) => Some(layout),
                Err(error) => problems.report_as(
                    code::CONTRADICTION,
                    table.span(),
                    format_args!("{error}"),
                    "expected `control` and `mode` in the output, `status` in the input, each field once, one width of the target",
                ),
            }
        }
        (Some(name), ..) => problems.report_as(
            code::CONTRADICTION,
            name.span(),
            "a shipped layout and fields of its own",
            "expected `layout`, or `output` and `input`",
        ),
        (None, ..) => problems.report_as(
            code::CONTRADICTION,
            table.span(),
            "the fields of one direction only",
            "expected both `output` and `input`",
        ),
    }
}

/// Mode and scale of a layout with speed and torque: which of them moves a machine is to be said. No other layout has them.
fn torque(problems: &mut Problems, table: &Spanned<AssemblyTable>, layout: Layout) -> Option<Layout> {
    let AssemblyTable { layout: name, drive_mode, torque_scale, .. } = table.get_ref();
    if !layout.has_torque_in_nm() {
        let keys = [
            drive_mode.as_ref().map(|key| ("drive_mode", key.span())),
            torque_scale.as_ref().map(|key| ("torque_scale", key.span())),
        ];
        let mut sound = true;
        for (key, span) in keys.into_iter().flatten() {
            sound = false;
            problems.report_as::<()>(
                code::CONTRADICTION,
                span,
                format_args!("`{key}` of a layout without speed and torque"),
                "expected it with the layouts \"speed-torque\" and \"speed-torque-basic\" only",
            );
        }
        return sound.then_some(layout);
    }
    let range = -i64::from(TORQUE_SCALE_MAX)..=i64::from(TORQUE_SCALE_MAX);
    let scale = value::number_or(problems, torque_scale, "TorqueScale", range, 0_i8);
    let Some(mode) = drive_mode else {
        return problems.report_as(
            code::CONTRADICTION,
            name.as_ref().map_or(table.span(), Spanned::span),
            "the layout has a speed and a torque, and nothing says which of them moves the axis",
            "expected `drive_mode = \"speed\"` or `drive_mode = \"torque\"`",
        );
    };
    let mode = value::word(problems, mode, "drive mode", &drive_modes())?;
    Some(layout.with_torque(mode, scale?))
}

fn fields<T: Copy>(
    problems: &mut Problems,
    names: &Spanned<Vec<Spanned<String>>>,
    what: &str,
    known: &[(&str, T)],
) -> Option<Vec<T>> {
    let fields: Vec<_> =
        names.get_ref().iter().map(|name| value::word(problems, name, what, known)).collect();
    fields.into_iter().collect()
}

/// What a layout needs of the axes of its device.
pub(super) fn axes(
    problems: &mut Problems,
    tables: &[Spanned<DeviceTable>],
    devices: &[Option<Device>],
    axes: &[Option<Axis>],
) {
    for (number, (table, device)) in tables.iter().zip(devices).enumerate() {
        let (Some(written), Some(device)) = (&table.get_ref().assembly, device) else { continue };
        let Some(assemblies) = &device.assembly else { continue };
        let own = || axes.iter().flatten().filter(|axis| axis.device == number);
        for axis in own().filter(|axis| axis.function != AxisFunction::Drive) {
            problems.report_as::<()>(
                code::CONTRADICTION,
                written.span(),
                format_args!("the axis `{}` of a device with assemblies is no drive", axis.name),
                "expected drives only",
            );
        }
        let has_acceleration = match assemblies.layout() {
            Layout::Fields { output, mode, .. } => {
                output.contains(&OutputField::Acceleration) || *mode == Some(3)
            }
            Layout::Speed { .. } => false,
        };
        for axis in own().filter(|axis| !has_acceleration && axis.limits.acceleration.is_none()) {
            problems.report_as::<()>(
                code::CONTRADICTION,
                written.span(),
                format_args!("neither the layout nor the axis `{}` gives an acceleration", axis.name),
                "expected `acceleration` in the limits of the axis, or a layout with it",
            );
        }
        let Layout::Speed { mode, .. } = assemblies.layout() else { continue };
        if assemblies.layout().has_torque_in_nm() {
            in_newton_metres(problems, written, *mode, own());
        }
        let linear = |axis: &&Axis| axis.kind == AxisKind::Linear;
        for axis in own().filter(linear) {
            problems.report_as::<()>(
                code::CONTRADICTION,
                written.span(),
                format_args!("the speed of the axis `{}` is not in revolutions", axis.name),
                "expected an axis in revolutions, or another layout",
            );
        }
    }
}

/// What a torque in Nm needs of the axes.
fn in_newton_metres<'a>(
    problems: &mut Problems,
    written: &Spanned<AssemblyTable>,
    mode: DriveMode,
    axes: impl Iterator<Item = &'a Axis>,
) {
    let AssemblyTable { layout, drive_mode, .. } = written.get_ref();
    let at = |key: &Option<Spanned<String>>| key.as_ref().map_or(written.span(), Spanned::span);
    for axis in axes.filter(|axis| axis.kind == AxisKind::Rotary) {
        if axis.nameplate.value(Parameter::MOTOR_RATED_TORQUE).is_none() {
            problems.report_as::<()>(
                code::CONTRADICTION,
                at(layout),
                format_args!(
                    "the torque of the layout is in Nm, and the axis `{}` has no rated torque",
                    axis.name
                ),
                "expected `rated_torque` in the `motor` of the axis: drives count torque in parts of it",
            );
        }
        if mode == DriveMode::Torque && axis.limits.velocity.is_none() {
            problems.report_as::<()>(
                code::CONTRADICTION,
                at(drive_mode),
                format_args!(
                    "the axis `{}` has no velocity limit, and a torque alone does not limit it",
                    axis.name
                ),
                "expected `velocity` in the limits of the axis",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn device(keys: &str) -> Result<Option<Assemblies>, Vec<String>> {
        let text = format!(
            "name = \"d\"\nlisten = \"192.0.2.1\"\naxes = [\"x\", \"y\"]\n{keys}\n[identity]\nvendor_id = 7\nproduct_code = 1\nserial_number = 1\n"
        );
        checked(&text, check)
    }

    #[test]
    fn a_layout_is_shipped_or_of_fields() {
        assert_eq!(device(""), Ok(None));
        let sizes = |keys: &str| {
            device(keys)
                .unwrap()
                .map(|one| (one.output_point(), one.output_len(), one.input_point(), one.input_len()))
        };
        assert_eq!(sizes("assembly = {}"), Some((150, 32, 100, 40)));
        assert_eq!(sizes("assembly = { layout = \"mixed\" }"), Some((150, 64, 100, 80)));
        let own = "assembly = { output = [\"mode\", \"pad_8\", \"control\"], input = [\"status\", \"age\"] }";
        assert_eq!(sizes(own), Some((150, 8, 100, 12)));
    }

    #[test]
    fn what_makes_no_assemblies_is_refused() {
        for (keys, title) in [
            ("{ layout = \"positions\" }", "unknown layout `positions`"),
            ("{ layout = \"speed\" }", "the layout carries one axis, the device has 2"),
            ("{ layout = \"mixed\", input = [\"status\"] }", "a shipped layout and fields of its own"),
            ("{ output = [\"control\", \"mode\"] }", "the fields of one direction only"),
            ("{ output = [\"control\"], input = [\"status\"] }", "the output has no field `mode`"),
            (
                "{ layout = \"speed\", drive_mode = \"speed\" }",
                "`drive_mode` of a layout without speed and torque",
            ),
            ("{ torque_scale = 1 }", "`torque_scale` of a layout without speed and torque"),
            (
                "{ layout = \"speed-torque\", torque_scale = 1 }",
                "the layout has a speed and a torque, and nothing says which of them moves the axis",
            ),
            ("{ layout = \"speed-torque\", drive_mode = \"position\" }", "unknown drive mode `position`"),
            ("{ layout = \"speed-torque\", drive_mode = \"speed\", torque_scale = 16 }", "TorqueScale is 16"),
            ("{ output = [\"control\", \"modes\"], input = [\"status\"] }", "unknown output field `modes`"),
        ] {
            assert_eq!(device(&format!("assembly = {keys}")), Err(vec![title.to_owned()]), "{keys}");
        }
        let found = device("assembly = {}\nconnection_format = \"variable\"");
        assert_eq!(found, Err(vec!["`connection_format` of a device with assemblies".to_owned()]));
    }
}
