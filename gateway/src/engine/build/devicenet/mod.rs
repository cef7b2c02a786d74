//! The DeviceNet networks of a configuration.

mod motion;
mod speed;

use std::sync::Arc;

use profile_cip::device::config::DEVICE_TYPE_CIP_MOTION_DRIVE;
use profile_cip::devicenet::master::config::{ExpectedIdentity, MasterConfig, SlaveConfig};

use super::{BuildError, axis_data, startup};
use crate::config::{Axis, Config, Devicenet, DevicenetDrive, DevicenetKind, DriveAt};
use crate::engine::bus::devicenet::commissioner::{Commissioner, commissioner};
use crate::engine::bus::devicenet::end::End;
use crate::engine::bus::devicenet::setup::SetupStep;
use crate::engine::bus::devicenet::{DevicenetBus, DrivePlan};
use crate::mapping::devicenet::{DevicenetAxis, DevicenetError};
use crate::mapping::{DriveProgram, Mapping};

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

/// What a drive is controlled by.
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

/// What a drive is controlled by.
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
            motion::parts(network, drive, axis, mapping, (modes.as_slice(), *resolution))
        }
        DevicenetKind::Speed { assembly, scale } => speed::parts(drive, axis, mapping, (*assembly, *scale)),
    }
}
