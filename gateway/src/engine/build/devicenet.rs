//! The DeviceNet networks of a configuration.

use std::sync::Arc;

use profile_cip::device::config::DEVICE_TYPE_CIP_MOTION_DRIVE;
use profile_cip::devicenet::master::config::{ExpectedIdentity, MasterConfig, SlaveConfig};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::mode::OperatingMode;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};

use super::{BuildError, axis_data, kind, parameters, startup};
use crate::config::{Axis, AxisFunction, Config, Devicenet, DevicenetDrive, DevicenetKind, DriveAt};
use crate::engine::bus::devicenet::commissioner::{Commissioner, commissioner};
use crate::engine::bus::devicenet::end::{End, MotionLink, SpeedLink};
use crate::engine::bus::devicenet::setup::{SetupStep, motion_steps, speed_steps};
use crate::engine::bus::devicenet::{DevicenetBus, DrivePlan};
use crate::mapping::devicenet::{DevicenetAxis, DevicenetError, MotionAxis, SpeedAxis};
use crate::mapping::{CipScaling, DriveProgram, Mapping};

/// Highest SpeedScale and, with a minus, the lowest one that a ratio has room for.
const SCALE_MAX: u32 = 30;

/// The master of a network without slaves.
fn without_slaves(config: &Config, network: &Devicenet) -> MasterConfig {
    // The box is one node there, whatever its devices are.
    let identity = config.devices.first().map(|device| &device.identity);
    let (vendor, serial) = identity.map_or((0, 0), |identity| (identity.vendor_id, identity.serial_number));
    MasterConfig::new(network.mac, vendor, serial, network.rate, network.cycle_time)
}

/// Who a drive has to be.
fn identity(drive: &DevicenetDrive) -> ExpectedIdentity {
    match drive.kind {
        // The poll connection of another device could carry anything.
        DevicenetKind::Motion { .. } => {
            ExpectedIdentity { device_type: Some(DEVICE_TYPE_CIP_MOTION_DRIVE), ..drive.identity }
        }
        DevicenetKind::Speed { .. } => drive.identity,
    }
}

/// The master of a network that takes the explicit connection of one drive, and nothing else.
#[must_use]
pub fn explicit_master(config: &Config, network: &Devicenet, drive: &DevicenetDrive) -> MasterConfig {
    let slave = SlaveConfig { identity: identity(drive), ..SlaveConfig::explicit(drive.mac) };
    MasterConfig { slaves: vec![slave], ..without_slaves(config, network) }
}

/// What the master of a network is told. Slaves that no axis is on are not taken.
#[must_use]
pub fn master(config: &Config, place: usize) -> MasterConfig {
    let network = &config.devicenet[place];
    let mut master = without_slaves(config, network);
    for (number, drive) in network.drives.iter().enumerate() {
        if axis_of(config, place, number).is_none() {
            continue;
        }
        let (output, input) = lengths(drive);
        let mut slave = SlaveConfig::polled(drive.mac, output, input, drive.packet_rate_ms);
        slave.identity = identity(drive);
        if let DevicenetKind::Speed { assembly, .. } = drive.kind {
            let assemblies = assembly.status().map(|status| [assembly.0, status.0]);
            slave.connections.iter_mut().for_each(|poll| poll.assemblies = assemblies);
        }
        master.slaves.push(SlaveConfig { missed_max: network.allowed_losses, ..slave });
    }
    master
}

/// Bytes of the messages of a drive: to it, and from it.
fn lengths(drive: &DevicenetDrive) -> (usize, usize) {
    use profile_cip::devicenet::master::motion::UPDATE_LEN;
    match drive.kind {
        DevicenetKind::Motion { .. } => (UPDATE_LEN, UPDATE_LEN),
        DevicenetKind::Speed { assembly, .. } => {
            (assembly.buffer_len(), assembly.status().map_or(0, |status| status.buffer_len()))
        }
    }
}

fn axis_of(config: &Config, network: usize, drive: usize) -> Option<(usize, &Axis)> {
    let at = DriveAt::Devicenet { network, drive };
    config.axes.iter().enumerate().find(|(_, axis)| axis.drive == at)
}

/// A network, and what goes through the start-up lists of its drives.
pub(super) fn bus(
    config: &Config,
    place: usize,
    mapping: &Mapping,
) -> Result<(DevicenetBus, Commissioner), BuildError> {
    let network = &config.devicenet[place];
    let mut drives = Vec::with_capacity(network.drives.len());
    let mut lists = Vec::with_capacity(network.drives.len());
    for (number, drive) in network.drives.iter().enumerate() {
        if let Some((number, axis)) = axis_of(config, place, number) {
            let made = plan(network, drive, axis, number, mapping);
            let mut made =
                made.map_err(|error| BuildError::DevicenetDrive { name: axis.name.clone(), error })?;
            let list = startup::of_devicenet(drive, &made.steps, mapping);
            made.has_list = !list.is_empty();
            lists.push((number, list));
            drives.push(made);
        }
    }
    let name = network.link.interface().unwrap_or("in-process");
    let number = u8::try_from(place).unwrap_or(u8::MAX);
    let (commissioner, end) = commissioner(lists.iter().map(|(axis, list)| (*axis, list.as_slice())));
    let bus = DevicenetBus::new(number, master(config, place), drives, end)
        .map_err(|error| BuildError::Devicenet { network: name.to_owned(), error })?;
    Ok((bus, commissioner))
}

fn plan(
    network: &Devicenet,
    drive: &DevicenetDrive,
    axis: &Axis,
    number: usize,
    mapping: &Mapping,
) -> Result<DrivePlan, DevicenetError> {
    let Parts { end, mut program, steps, .. } = parts(network, drive, axis, mapping)?;
    program.set_data(&axis_data(axis));
    Ok(DrivePlan { axis: number, mac: drive.mac, end, program: Arc::new(program), has_list: false, steps })
}

/// What a drive is led by.
#[derive(Debug, Clone)]
pub struct Parts {
    /// The box's end of its poll connection.
    pub end: End,
    /// What its program is made of.
    pub needs: DevicenetAxis,
    /// How its axis speaks to it.
    pub program: DriveProgram,
    /// How it is set up.
    pub steps: Vec<SetupStep>,
}

/// What a drive is led by.
///
/// # Errors
/// The tables have nothing for it, or its numbers do not fit.
pub fn parts(
    network: &Devicenet,
    drive: &DevicenetDrive,
    axis: &Axis,
    mapping: &Mapping,
) -> Result<Parts, DevicenetError> {
    match &drive.kind {
        DevicenetKind::Motion { modes, resolution } => {
            let modes: &[OperatingMode] = match axis.function {
                AxisFunction::Drive => modes,
                // What is only looked at has its position looked at.
                AxisFunction::Encoder | AxisFunction::Converter => &[OperatingMode::Position],
            };
            let scaling = scaling(drive, axis, *resolution)?;
            let needs = MotionAxis { scaling, modes: modes.to_vec() };
            let program = mapping.devicenet_motion_program(&needs)?;
            let limits = parameters(axis);
            let limits = limits
                .into_iter()
                .map(|(parameter, value)| mapping.devicenet_parameter(&scaling, parameter, value))
                .collect::<Result<Vec<_>, _>>()?;
            let first = match modes.first() {
                Some(OperatingMode::Velocity) => ControlMode::VELOCITY,
                Some(OperatingMode::Torque) => ControlMode::TORQUE,
                _ => ControlMode::POSITION,
            };
            let link = MotionLink::new(first, *resolution, network.cycle_time);
            let (end, needs) = (End::Motion(link), DevicenetAxis::Motion(needs));
            Ok(Parts { end, needs, program, steps: motion_steps(&limits) })
        }
        DevicenetKind::Speed { assembly, scale } => {
            let speed = speed(drive, axis, *scale).ok_or(DevicenetError::Overflow)?;
            let extended = assembly.is_extended();
            let needs = SpeedAxis { speed, extended };
            let program = mapping.devicenet_speed_program(&needs)?;
            let link = SpeedLink::new(*assembly).map_err(|_| DevicenetError::Assembly(*assembly))?;
            let (end, needs) = (End::Speed(link), DevicenetAxis::Speed(needs));
            Ok(Parts { end, needs, program, steps: speed_steps(*scale, extended) })
        }
    }
}

/// The units of a CIP Motion drive: revolutions of its motor, or millimetres.
fn scaling(drive: &DevicenetDrive, axis: &Axis, resolution: u32) -> Result<CipScaling, DevicenetError> {
    // Nanounits of the axis in a turn; a way that is no whole number of them cannot be.
    let way = match drive.way_of_a_turn {
        Some(way) if kind(axis) == UnitKind::Linear => {
            let whole = way.convert(NANO, profile_generic::ratio::Rounding::Nearest);
            if whole.inexact || whole.saturated {
                return Err(DevicenetError::Overflow);
            }
            whole.value
        }
        _ => NANO,
    };
    Ok(CipScaling {
        kind: kind(axis),
        nanounits_per_unit: way,
        counts_per_unit: i64::from(resolution),
        inverted: false,
        unwind: None,
    })
}

/// Nanounits of the axis per second in a unit of the speed: rpm / 2^SpeedScale.
fn speed(drive: &DevicenetDrive, axis: &Axis, scale: i8) -> Option<Ratio> {
    let steps = u32::from(scale.unsigned_abs()).min(SCALE_MAX);
    let power = 1_i64 << steps;
    let rpm = Ratio::new(NANO, 60)?;
    let unit = rpm.then(if scale < 0 { Ratio::new(power, 1)? } else { Ratio::new(1, power)? })?;
    match kind(axis) {
        UnitKind::Rotary => Some(unit),
        UnitKind::Linear => unit.then(drive.way_of_a_turn?),
    }
}
