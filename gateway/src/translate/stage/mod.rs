//! The programs that a configuration leads to, without a machine: the box commissions simulated drives in virtual time.
//!
//! What is compiled depends on what the drives tell about themselves, their scaling before all. The simulated ones stand in
//! for those of the machine.

mod can;
mod devicenet;
mod values;

use std::net::SocketAddrV4;

use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::wire::layout::Layout;

pub use can::{CanDrive, CanMember, CanPart, CanPdo};
pub use devicenet::DevicenetDrive;
pub use values::ValuesError;

use crate::config::Config;
use crate::engine::build::{BuildError, Built, Host, build, scaling};
use crate::engine::port::{Datagram, NorthPort, SouthPort};
use crate::mapping::{AttributeTable, CipProgram, CipScaling, DriveFacts, DriveProgram, Mapping, SercosAxis};
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::drives::{InProcessDrives, SIMULATED_MAC};

/// Virtual time in which the drives must be ready: 511 of them take less.
const LIMIT: DurationNs = DurationNs::from_secs(120);

/// When it begins; the instant does not matter.
const START: MonotonicTime = MonotonicTime(1_000_000_000);

/// One axis with its programs.
#[derive(Debug, Clone)]
pub struct StageAxis {
    /// Name of the axis.
    pub name: String,
    /// Number of its device in the configuration.
    pub device: usize,
    /// Its instance there.
    pub instance: u8,
    /// Name of its drive.
    pub drive: String,
    /// Number of its bus among the CAN buses of the configuration, which has those of CANopen first; 0 for SERCOS.
    pub bus: usize,
    /// The drive, by its profile.
    pub behind: Behind,
    /// Whether what is known of the drive's scaling is that of a simulated one.
    pub stands_in: bool,
    /// The scaling of the controller.
    pub scaling: CipScaling,
    /// Its attributes.
    pub attributes: AttributeTable,
    /// The program of the CIP side.
    pub north: CipProgram,
    /// The program of the drive.
    pub south: DriveProgram,
}

/// What is behind an axis.
#[derive(Debug, Clone)]
pub enum Behind {
    /// A SERCOS III drive.
    Sercos(SercosDrive),
    /// A CiA 402 drive on CANopen.
    Can(CanDrive),
    /// A drive on DeviceNet.
    Devicenet(DevicenetDrive),
}

/// A SERCOS III drive.
#[derive(Debug, Clone)]
pub struct SercosDrive {
    /// Its address.
    pub address: u16,
    /// Its topology address.
    pub topology: u16,
    /// Its status word does not tell that it follows and is halted.
    pub silent: bool,
    /// What it is needed for.
    pub needs: SercosAxis,
    /// What it has told of itself.
    pub facts: DriveFacts,
}

impl StageAxis {
    /// Whether its drive is on a CAN bus; every one may be the bus where that is not known.
    #[must_use]
    pub fn may_be_on(&self, bus: Option<usize>) -> bool {
        bus.is_none_or(|bus| bus == self.bus)
    }

    /// The drive, where it is a SERCOS drive.
    #[must_use]
    pub fn sercos(&self) -> Option<&SercosDrive> {
        match &self.behind {
            Behind::Sercos(drive) => Some(drive),
            Behind::Can(_) | Behind::Devicenet(_) => None,
        }
    }

    /// The drive, where it is on CANopen.
    #[must_use]
    pub fn can(&self) -> Option<&CanDrive> {
        match &self.behind {
            Behind::Can(drive) => Some(drive),
            Behind::Sercos(_) | Behind::Devicenet(_) => None,
        }
    }

    /// The drive, where it is on DeviceNet.
    #[must_use]
    pub fn devicenet(&self) -> Option<&DevicenetDrive> {
        match &self.behind {
            Behind::Devicenet(drive) => Some(drive),
            Behind::Sercos(_) | Behind::Can(_) => None,
        }
    }
}

/// All axes of a configuration, and where each drive has its place in the telegrams.
#[derive(Debug)]
pub struct Stage {
    /// The tables.
    pub mapping: Mapping,
    /// The axes in the order of the configuration.
    pub axes: Vec<StageAxis>,
    /// The SERCOS telegrams of CP4.
    pub layout: Layout,
}

/// Why there are no programs.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The configuration makes no box.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A drive on CANopen cannot be led by its data sheet.
    #[error("axis {axis}: the drive of its data sheet cannot be used: {told}")]
    Sheet {
        /// The axis.
        axis: String,
        /// Why.
        told: String,
    },
    /// No program can be made for an axis.
    #[error("axis {axis}: its program cannot be compiled: {told}")]
    Program {
        /// The axis.
        axis: String,
        /// Why.
        told: String,
    },
    /// A drive was not commissioned.
    #[error("axis {axis}: its simulated drive is not commissioned: {told}")]
    Drive {
        /// The axis.
        axis: String,
        /// What the box told about the bus last.
        told: String,
    },
}

/// Nobody is connected on this side.
struct Silent;

impl NorthPort for Silent {
    fn receive(&mut self, _: &mut [u8]) -> Option<Datagram> {
        None
    }

    fn send(&mut self, _: &[u8], _: SocketAddrV4) -> bool {
        false
    }
}

impl Stage {
    /// Commissions simulated drives as the box would.
    ///
    /// # Errors
    /// The configuration makes no box, or a drive does not come to cyclic operation with it.
    pub fn rehearse(config: &Config, mapping: Mapping) -> Result<Self, StageError> {
        let host = Host { mac: SIMULATED_MAC, incarnation: 1 };
        let Built { mut engine, mut notices, mut commissioners, .. } = build(config, mapping.clone(), host)?;
        let mut sercos = config.sercos.as_ref().map(|sercos| InProcessDrives::of(config, sercos, None));
        let mut can: Vec<_> = config.can.iter().map(|bus| InProcessCan::of(bus, None)).collect();
        let mut south: Vec<SouthPort<'_>> = sercos.iter_mut().map(|port| SouthPort::Ethernet(port)).collect();
        south.extend(can.iter_mut().map(|port| SouthPort::Can(port)));
        let devicenet = config.devicenet.iter().map(|network| InProcessCan::of_devicenet(network, None));
        let mut devicenet: Vec<_> = devicenet.collect();
        south.extend(devicenet.iter_mut().map(|port| SouthPort::Can(port)));
        let mut ports: Vec<Silent> = config.devices.iter().map(|_| Silent).collect();
        let mut ports: Vec<&mut dyn NorthPort> =
            ports.iter_mut().map(|port| port as &mut dyn NorthPort).collect();
        let mut now = START;
        let mut told = Vec::new();
        let ready = |engine: &crate::engine::Engine| engine.axes().iter().all(|axis| axis.south().is_some());
        while !ready(&engine) && now.since(START) < LIMIT {
            now = engine.cycle(now, &mut ports, &mut south).max(now + DurationNs(1));
            commissioners.poll();
            while let Ok(notice) = notices.pop() {
                told.push(notice.to_string());
            }
        }
        let mut axes = Vec::with_capacity(config.axes.len());
        for bus in 0..config.can.len() {
            axes.extend(can::configured(config, bus, &mapping)?);
        }
        for network in 0..config.devicenet.len() {
            axes.extend(devicenet::configured(config, network, &mapping)?);
        }
        for ((number, axis), channel) in config.axes.iter().enumerate().zip(engine.axes()) {
            let unready = || {
                let about = told.iter().rev().find(|line| !line.contains(" -> ")).cloned();
                StageError::Drive { axis: axis.name.clone(), told: about.unwrap_or_default() }
            };
            let south = channel.south().ok_or_else(unready)?;
            let Some((drive, bus)) = config.sercos_drive(axis).zip(engine.sercos()) else { continue };
            let slave = bus.master().slave_by_address(drive.address);
            let scaling = scaling(axis);
            let (Some(slave), Some((needs, facts)), Some(attributes)) =
                (slave, bus.drive(number), mapping.attribute_table(&scaling))
            else {
                return Err(unready());
            };
            let on_sercos = StageAxis {
                name: axis.name.clone(),
                device: axis.device,
                instance: axis.instance,
                drive: drive.name.clone(),
                bus: 0,
                behind: Behind::Sercos(SercosDrive {
                    address: drive.address,
                    topology: slave.topology_address(),
                    silent: !drive.acknowledges,
                    needs: needs.clone(),
                    facts: facts.clone(),
                }),
                stands_in: !drive.set_scaling,
                scaling,
                attributes,
                north: engine.cip_program(number).ok_or_else(unready)?.clone(),
                south: south.clone(),
            };
            axes.push((number, on_sercos));
        }
        axes.sort_by_key(|(number, _)| *number);
        let axes = axes.into_iter().map(|(_, axis)| axis).collect();
        let topology = |index: usize| u16::try_from(index + 1).unwrap_or(u16::MAX);
        let layout = engine.sercos().map(|bus| bus.master().layout().to_wire(topology)).unwrap_or_default();
        Ok(Self { axes, layout, mapping })
    }

    /// The same axes and drives with other tables.
    ///
    /// # Errors
    /// A program cannot be made with them.
    pub fn with_mapping(&self, mapping: Mapping) -> Result<Self, StageError> {
        let axes = self.axes.iter().map(|axis| {
            let failed = |told: String| StageError::Program { axis: axis.name.clone(), told };
            let south = match &axis.behind {
                Behind::Sercos(drive) => mapping
                    .sercos_program(&drive.needs, &drive.facts)
                    .map_err(|error| failed(error.to_string()))?,
                Behind::Can(drive) => mapping
                    .of_drive(&drive.facts)
                    .cia402_program(&drive.needs, &drive.facts)
                    .map_err(|error| failed(error.to_string()))?,
                Behind::Devicenet(drive) => {
                    mapping.devicenet_program(&drive.needs).map_err(|error| failed(error.to_string()))?
                }
            };
            let no_ratio = || failed("a ratio of its scaling does not fit 64 bits".to_owned());
            let north = mapping.cip_program(&axis.scaling).ok_or_else(no_ratio)?;
            let attributes = mapping.attribute_table(&axis.scaling).ok_or_else(no_ratio)?;
            Ok(StageAxis { south, north, attributes, ..axis.clone() })
        });
        let axes = axes.collect::<Result<_, StageError>>()?;
        Ok(Self { axes, layout: self.layout.clone(), mapping })
    }

    /// The axis with this name.
    #[must_use]
    pub fn axis(&self, name: &str) -> Option<usize> {
        self.axes.iter().position(|axis| axis.name == name)
    }

    /// The axis on the drive with this name.
    #[must_use]
    pub fn axis_of_drive(&self, name: &str) -> Option<usize> {
        self.axes.iter().position(|axis| axis.drive == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drives_of_the_demonstration_are_commissioned() {
        let config = Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
        let stage = Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap();
        let seen: Vec<_> =
            stage.axes.iter().filter_map(|axis| Some((axis.instance, axis.sercos()?))).collect();
        let seen: Vec<_> =
            seen.iter().map(|(instance, drive)| (*instance, drive.address, drive.topology)).collect();
        assert_eq!(seen, [(1, 1, 1), (2, 2, 2)]);
        let telegram = &stage.axes[0].south.telegram;
        assert_eq!(telegram.command[0].to_string(), "S-0-0134");
        // Hot-plug field, extended field, two service channels and two C-DEVs come before.
        let place = stage.layout.devices[0].connections.iter().find(|place| place.index == 0).unwrap();
        assert_eq!((place.at.telegram, usize::from(place.len)), (0, usize::from(telegram.command_bytes) + 2));
    }
}
