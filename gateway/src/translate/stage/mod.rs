//! The programs that a configuration leads to, without a machine: the box commissions simulated drives in virtual time.
//!
//! What is compiled depends on what the drives tell about themselves, their scaling before all. The simulated ones stand in
//! for those of the machine.

mod can;
mod devicenet;
mod values;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use profile_cip::wire::motion::Format;
use profile_sercos::wire::layout::Layout;

pub use can::{CanDrive, CanPart, CanPdo};
pub use devicenet::DevicenetDrive;
pub use values::ValuesError;

use super::bench::Bench;
pub use super::rows::RowCache;
use crate::config::Config;
use crate::engine::build::{BuildError, scaling};
use crate::mapping::{
    AttributeTable, Cia402Dictionary, CipProgram, CipScaling, DriveFacts, DriveProgram, Item, Mapping,
    SercosAxis,
};

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
    /// The attribute table that its device serves.
    pub attributes: AttributeTable,
    /// The program of the CIP side.
    pub north: CipProgram,
    /// The program of the drive.
    pub south: DriveProgram,
    /// Rows of its tables that were looked up.
    pub rows: RowCache,
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
    /// SERCOS address, 1 to 511.
    pub address: u16,
    /// Its topology address.
    pub topology: u16,
    /// Its status word does not tell that it follows and is halted.
    pub silent: bool,
    /// What it is needed for.
    pub needs: SercosAxis,
    /// What it has reported about itself.
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

/// A value that a drive holds in place of its own.
#[derive(Debug, Clone)]
pub(super) struct Held {
    /// Name of the drive.
    pub drive: String,
    /// The IDN or object.
    pub item: Item,
    /// Its bytes, the least significant first.
    pub bytes: Vec<u8>,
}

/// All axes of a configuration, and where each drive has its place in the telegrams.
#[derive(Debug)]
pub struct Stage {
    config: Config,
    /// What the drives hold while they are commissioned, in place of their own.
    held: Vec<Held>,
    /// Benches that nobody uses now.
    benches: Mutex<Vec<Box<Bench>>>,
    /// The tables.
    pub mapping: Mapping,
    /// The axes in the order of the configuration.
    pub axes: Vec<StageAxis>,
    /// The SERCOS telegrams of CP4.
    pub layout: Layout,
    /// Names of IDNs and objects that were looked up.
    labels: Mutex<BTreeMap<Item, Arc<str>>>,
}

/// Why there are no programs.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The configuration makes no box.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The axes of a device are not moved by CIP Motion.
    #[error("the axes of the device {device} are moved through assemblies: expected CIP Motion devices only")]
    Assembly {
        /// The device.
        device: String,
    },
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

impl Stage {
    /// Commissions simulated drives as the box would.
    ///
    /// # Errors
    /// The configuration makes no box, or a drive does not come to cyclic operation with it.
    pub fn rehearse(config: &Config, mapping: Mapping) -> Result<Self, StageError> {
        Self::rehearse_holding(config, mapping, Vec::new())
    }

    /// The same with drives that hold other values while the box asks them, and so get other telegrams.
    fn rehearse_holding(config: &Config, mapping: Mapping, held: Vec<Held>) -> Result<Self, StageError> {
        if let Some(device) = config.devices.iter().find(|device| device.assembly.is_some()) {
            return Err(StageError::Assembly { device: device.name.clone() });
        }
        let mut bench = Bench::new(config, mapping.clone(), &held)?;
        let told: Vec<String> = bench.take_notices().iter().map(ToString::to_string).collect();
        let engine = bench.engine();
        let mut axes = Vec::with_capacity(config.axes.len());
        for bus in 0..config.can.len() {
            axes.extend(can::configured(config, bus, &mapping, &held)?);
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
            let Some((drive, bus)) = config.sercos_drive(axis).zip(engine.sercos()) else {
                // The programs are those that the engine has made of what the drives have answered.
                if let Some((_, known)) = axes.iter_mut().find(|(known, _)| *known == number) {
                    known.south = south.clone();
                }
                continue;
            };
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
                rows: RowCache::default(),
            };
            axes.push((number, on_sercos));
        }
        axes.sort_by_key(|(number, _)| *number);
        let axes = axes.into_iter().map(|(_, axis)| axis).collect();
        let topology = |index: usize| u16::try_from(index + 1).unwrap_or(u16::MAX);
        let layout = engine.sercos().map(|bus| bus.master().layout().to_wire(topology)).unwrap_or_default();
        let (benches, labels) = (Mutex::new(vec![Box::new(bench)]), Mutex::default());
        Ok(Self { config: config.clone(), held, axes, layout, mapping, benches, labels })
    }

    /// A bench with the programs of the stage, on which nothing was said yet.
    pub(super) fn bench(&self) -> Result<Box<Bench>, StageError> {
        let kept = self.benches.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut bench = match kept {
            Some(bench) => bench,
            None => Box::new(Bench::new(&self.config, self.mapping.clone(), &self.held)?),
        };
        bench.restart(&self.axes);
        Ok(bench)
    }

    /// Takes back a bench, for the next list.
    pub(super) fn keep(&self, bench: Box<Bench>) {
        self.benches.lock().unwrap_or_else(PoisonError::into_inner).push(bench);
    }

    /// The same axes and drives with other tables.
    ///
    /// # Errors
    /// As [`Self::rehearse`].
    pub fn with_mapping(&self, mapping: Mapping) -> Result<Self, StageError> {
        Self::rehearse(&self.config, mapping)
    }

    /// The same box with other programs for its axes.
    pub(super) fn with_axes(&self, axes: Vec<StageAxis>) -> Self {
        Self {
            config: self.config.clone(),
            held: self.held.clone(),
            benches: Mutex::default(),
            mapping: self.mapping.clone(),
            axes,
            layout: self.layout.clone(),
            labels: Mutex::default(),
        }
    }

    /// The same with programs for drives that hold what is known of them now.
    fn compiled_anew(mut self) -> Result<Self, StageError> {
        for axis in &mut self.axes {
            axis.rows = RowCache::default();
            let failed = |told: String| StageError::Program { axis: axis.name.clone(), told };
            axis.south = match &axis.behind {
                Behind::Sercos(drive) => self
                    .mapping
                    .sercos_program(&drive.needs, &drive.facts)
                    .map_err(|error| failed(error.to_string()))?,
                Behind::Can(drive) => self
                    .mapping
                    .of_drive(&drive.facts)
                    .cia402_program(&drive.needs, &drive.facts)
                    .map_err(|error| failed(error.to_string()))?,
                Behind::Devicenet(_) => continue,
            };
        }
        // A bench gets these programs when it is used again.
        self.benches
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .iter_mut()
            .for_each(|bench| bench.note_use());
        Ok(self)
    }

    /// Whether each value has the place in the telegrams that it has for these axes.
    pub(super) fn has_telegrams_of(&self, axes: &[StageAxis]) -> bool {
        let telegrams =
            |axes: &[StageAxis]| -> Vec<_> { axes.iter().map(|axis| axis.south.telegram.clone()).collect() };
        telegrams(&self.axes) == telegrams(axes)
    }

    /// An IDN or object with its name.
    pub(super) fn label(&self, item: Item) -> Arc<str> {
        let mut labels = self.labels.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(labels.entry(item).or_insert_with(|| self.named(item).into()))
    }

    fn named(&self, item: Item) -> String {
        let dictionaries = &self.mapping.dictionaries;
        let name = match item {
            Item::Idn(idn) => dictionaries.sercos.idn(idn).map(|row| row.name.clone()),
            Item::Attribute(_) => None,
            Item::Object(object) => {
                let index = Cia402Dictionary::on_first_axis(object.index);
                let row = dictionaries.cia402.object(index);
                row.map(|row| match row.sub(object.sub).map(|sub| sub.name.as_str()) {
                    Some(sub) if object.sub > 0 && !sub.is_empty() => format!("{}, {sub}", row.name),
                    _ => row.name.clone(),
                })
            }
        };
        name.map_or_else(|| item.to_string(), |name| format!("{item} {name}"))
    }

    /// The format of the updates of a device.
    pub(super) fn format(&self, device: usize) -> Format {
        self.config.devices.get(device).map_or(Format::Variable, |device| device.connection_format)
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
