//! What does not change of an axis while the gateway runs: its limits, and where each of its values is.

use std::collections::HashMap;
use std::sync::Arc;

use profile_generic::cast::f64_from_i64;
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use schemars::JsonSchema;
use serde::Serialize;

use crate::config::{Axis, Config, DevicenetKind, DriveAt, Limits};
use crate::engine::build::devicenet::parts;
use crate::local::protocol::unit;
use crate::mapping::{Cia402Dictionary, DriveProgram, Mapping, Object, Places};

/// Nanounits in a unit.
const NANO: f64 = 1e9;

/// Millionths of the rated torque in a percent of it.
const PARTS_PER_PERCENT: f64 = 10_000.0;

/// An axis: its limits, and its values with their places on both sides.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AxisSheet {
    /// Its name.
    pub axis: String,
    /// Its drive.
    pub drive: String,
    /// `rev` or `mm`.
    pub unit: String,
    /// What the configuration lets it do.
    pub limits: AxisLimits,
    /// The values: signals first, then parameters by number.
    pub values: Vec<MappedValue>,
}

/// The limits of the configuration; those that are not there are the drive's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AxisLimits {
    /// Lowest position command, in the unit.
    pub position_min: Option<f64>,
    /// Highest position command, in the unit.
    pub position_max: Option<f64>,
    /// Highest speed, in the unit per second.
    pub velocity: Option<f64>,
    /// Highest acceleration, in the unit per second squared.
    pub acceleration: Option<f64>,
    /// Highest torque, percent of the rated torque.
    pub torque: Option<f64>,
    /// Largest following error, in the unit.
    pub following_error: Option<f64>,
}

/// A value of the generic model with its places.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct MappedValue {
    /// Its generic name.
    pub name: String,
    /// `command` or `feedback` for a signal of every cycle, else `parameter`.
    pub kind: String,
    /// Its attributes in the Motion Device Axis Object, and its elements in the updates.
    pub cip: Vec<String>,
    /// Its IDNs, objects or attributes in the drive, by the tables.
    pub drive: Vec<String>,
    /// What the gateway does with it; empty where it passes it on.
    pub gateway: String,
    /// The field of the axis in the status that has its present value, where there is one.
    pub field: Option<String>,
}

/// Drives that have the same places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Alike {
    Sercos,
    /// The axis of a CANopen device, from 0.
    Can(u16),
    /// The axis of the gateway.
    Devicenet(usize),
}

/// The sheets of all axes.
#[derive(Debug, Clone, Default)]
pub struct Sheets(Vec<(AxisSheet, Arc<[MappedValue]>)>);

impl Sheets {
    /// The sheets of the axes of a configuration.
    #[must_use]
    pub fn of(config: &Config, mapping: &Mapping) -> Self {
        let mut known: HashMap<Alike, Arc<[MappedValue]>> = HashMap::new();
        let sheet = |(number, axis): (usize, &Axis)| {
            let alike = alike(config, number, axis);
            let values = known.entry(alike).or_insert_with(|| values(config, axis, alike, mapping).into());
            (head(config, axis), Arc::clone(values))
        };
        Self(config.axes.iter().enumerate().map(sheet).collect())
    }

    /// The sheet of an axis, by its place in the configuration.
    #[must_use]
    pub fn get(&self, axis: usize) -> Option<AxisSheet> {
        let (head, values) = self.0.get(axis)?;
        Some(AxisSheet { values: values.to_vec(), ..head.clone() })
    }
}

fn alike(config: &Config, number: usize, axis: &Axis) -> Alike {
    match axis.drive {
        DriveAt::Sercos { .. } => Alike::Sercos,
        DriveAt::Can { .. } => Alike::Can(config.can_drive(axis).map_or(0, |(_, drive)| drive.axis)),
        DriveAt::Devicenet { .. } => Alike::Devicenet(number),
    }
}

fn head(config: &Config, axis: &Axis) -> AxisSheet {
    let drive = config.sercos_drive(axis).map(|drive| &drive.name);
    let drive = drive.or_else(|| config.can_drive(axis).map(|(_, drive)| &drive.name));
    let drive = drive.or_else(|| config.devicenet_drive(axis).map(|(_, drive)| &drive.name));
    AxisSheet {
        axis: axis.name.clone(),
        drive: drive.cloned().unwrap_or_default(),
        unit: unit(axis.kind).to_owned(),
        limits: AxisLimits::of(&axis.limits),
        values: Vec::new(),
    }
}

impl AxisLimits {
    fn of(limits: &Limits) -> Self {
        let units = |nano: i64| f64_from_i64(nano) / NANO;
        Self {
            position_min: limits.position_min.map(|position| units(position.get())),
            position_max: limits.position_max.map(|position| units(position.get())),
            velocity: limits.velocity.map(|velocity| units(velocity.get())),
            acceleration: limits.acceleration.map(|acceleration| units(acceleration.get())),
            torque: limits.torque.map(|torque| f64_from_i64(torque.get()) / PARTS_PER_PERCENT),
            following_error: limits.following_error.map(|error| units(error.get())),
        }
    }
}

/// The values of an axis that are somewhere on either side.
fn values(config: &Config, axis: &Axis, alike: Alike, mapping: &Mapping) -> Vec<MappedValue> {
    let devicenet = match alike {
        Alike::Devicenet(_) => OnDevicenet::of(config, axis, mapping),
        Alike::Sercos | Alike::Can(_) => None,
    };
    let drive = |places: &Places, of: Value| match (alike, &devicenet) {
        (Alike::Sercos, _) => places.sercos.clone(),
        (Alike::Can(axis), _) => places.cia402.iter().map(|place| on_axis(place, axis)).collect(),
        (Alike::Devicenet(_), Some(drive)) => drive.places(places, of),
        (Alike::Devicenet(_), None) => Vec::new(),
    };
    let generic = &mapping.dictionaries.generic;
    let signals = generic.signals().iter().map(|signal| {
        let places = mapping.places_of_signal(*signal);
        MappedValue {
            name: signal.name().to_owned(),
            kind: if signal.is_command() { "command" } else { "feedback" }.to_owned(),
            drive: drive(&places, Value::Signal(*signal)),
            gateway: places.gateway.to_owned(),
            cip: places.cip,
            field: field(*signal).map(str::to_owned),
        }
    });
    let parameters = generic.parameters().iter().map(|row| {
        let places = mapping.places_of_parameter(row.parameter);
        MappedValue {
            name: row.name.clone(),
            kind: "parameter".to_owned(),
            drive: drive(&places, Value::Parameter(row.parameter)),
            gateway: places.gateway.to_owned(),
            cip: places.cip,
            field: None,
        }
    });
    signals.chain(parameters).filter(|value| !value.cip.is_empty() || !value.drive.is_empty()).collect()
}

/// What is looked for in a program.
#[derive(Debug, Clone, Copy)]
enum Value {
    Signal(Signal),
    Parameter(Parameter),
}

/// A drive on DeviceNet: what it has follows from its program, which the configuration makes.
struct OnDevicenet {
    program: DriveProgram,
    /// The modes of a CIP Motion drive; none of a velocity drive.
    modes: Option<Vec<OperatingMode>>,
}

impl OnDevicenet {
    fn of(config: &Config, axis: &Axis, mapping: &Mapping) -> Option<Self> {
        let (network, drive) = config.devicenet_drive(axis)?;
        let program = parts(network, drive, axis, mapping).ok()?.program;
        let modes = match &drive.kind {
            DevicenetKind::Motion { modes, .. } => Some(modes.clone()),
            DevicenetKind::Speed { .. } => None,
        };
        Some(Self { program, modes })
    }

    fn places(&self, places: &Places, of: Value) -> Vec<String> {
        match of {
            Value::Parameter(parameter) => {
                let held = self.program.parameter(parameter);
                held.map(|held| held.item.to_string()).into_iter().collect()
            }
            Value::Signal(signal) if !self.carries(signal) => Vec::new(),
            // The elements of the updates have the same names on both networks.
            Value::Signal(_) if self.modes.is_some() => {
                places.cip.iter().filter(|place| place.contains(": ")).cloned().collect()
            }
            Value::Signal(_) => vec!["poll message".to_owned()],
        }
    }

    fn carries(&self, signal: Signal) -> bool {
        let modes = self.modes.as_deref().unwrap_or(&[OperatingMode::Velocity]);
        let command =
            |mode: &OperatingMode| self.program.carries((*mode).into()).contains(signal.command_bit());
        if signal.is_command() { modes.iter().any(command) } else { self.program.tells(signal) }
    }
}

/// An object of the first axis of a device, as this axis of it has it.
fn on_axis(place: &str, axis: u16) -> String {
    let object = Object::parse(place);
    let index = object.and_then(|object| Cia402Dictionary::on_axis(object.index, axis));
    match (object, index) {
        (Some(object), Some(index)) => Object { index, ..object }.to_string(),
        _ => place.to_owned(),
    }
}

/// The field of an axis in the status that has the present value of a signal.
const fn field(signal: Signal) -> Option<&'static str> {
    Some(match signal {
        Signal::PositionCommand => "position_command",
        Signal::VelocityCommand => "velocity_command",
        Signal::TorqueCommand => "torque_command",
        Signal::PositionActual => "position",
        Signal::VelocityActual => "velocity",
        Signal::TorqueActual => "torque",
        Signal::FollowingError => "following_error",
        Signal::CurrentActual => "current",
        Signal::BusVoltage => "bus_voltage",
        Signal::Temperature => "temperature",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheets(text: &str) -> Sheets {
        let config = Config::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}"));
        Sheets::of(&config, &Mapping::embedded().unwrap())
    }

    fn examples() -> [Sheets; 3] {
        [
            sheets(include_str!("../../../examples/two-axes-in-process.toml")),
            sheets(include_str!("../../../examples/two-axes-can.toml")),
            sheets(include_str!("../../../examples/two-axes-devicenet.toml")),
        ]
    }

    fn row(sheets: &Sheets, axis: usize, name: &str) -> MappedValue {
        let sheet = sheets.get(axis).unwrap();
        sheet.values.into_iter().find(|value| value.name == name).unwrap_or_else(|| panic!("{name}"))
    }

    #[test]
    fn value_has_its_places_on_each_kind_of_bus() {
        let [sercos, can, devicenet] = examples();
        let command = row(&sercos, 0, "position_command");
        assert_eq!((&*command.kind, command.field.as_deref()), ("command", Some("position_command")));
        assert!(command.cip.iter().any(|place| place.contains("Position")), "{command:?}");
        assert_eq!(command.drive, ["S-0-0047"]);
        assert_eq!(row(&can, 1, "position_command").drive, ["607A:00", "60C1:01"]);
        let other = row(&devicenet, 0, "position_command");
        assert_eq!(
            (&*other.drive, &other.cip),
            (&["Command Data Set: Command Position".to_owned()][..], &command.cip)
        );
        let torque = row(&sercos, 0, "torque_actual");
        assert_eq!((torque.field.as_deref(), &*torque.drive), (Some("torque"), &["S-0-0084".to_owned()][..]));
        assert!(sercos.get(0).unwrap().values.iter().any(|value| value.kind == "parameter"));
        assert_eq!(sercos.get(3), None);
    }

    #[test]
    fn second_axis_of_a_can_device_has_its_own_objects() {
        assert_eq!(on_axis("607A:00", 0), "607A:00");
        assert_eq!(on_axis("607A:00", 2), "707A:00");
        assert_eq!(on_axis("2030:01", 2), "2030:01");
    }

    #[test]
    fn limits_are_those_of_the_configuration() {
        let [sercos, ..] = examples();
        let slide = sercos.get(1).unwrap();
        assert_eq!((&*slide.axis, &*slide.drive, &*slide.unit), ("slide", "drive-b", "mm"));
        let limits = AxisLimits {
            position_min: Some(-5.0),
            position_max: Some(805.0),
            velocity: Some(1_000.0),
            acceleration: Some(10_000.0),
            torque: None,
            following_error: None,
        };
        assert_eq!(slide.limits, limits);
        assert_eq!(sercos.get(0).unwrap().limits.torque, Some(150.0));
    }

    #[test]
    fn every_field_is_one_of_the_status() {
        let overview = crate::local::overview::Overview::of(
            &crate::local::installation::tests::installation(),
            &crate::status::tests::distinct(),
            &crate::time::status::tests::synchronized(),
        );
        let axis = serde_json::to_value(&overview.axes[0]).unwrap();
        for signal in Mapping::embedded().unwrap().dictionaries.generic.signals() {
            if let Some(field) = field(*signal) {
                assert!(axis[field].is_number(), "{field}");
            }
        }
    }
}
