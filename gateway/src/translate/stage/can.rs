//! CiA 402 drives on CANopen: what the box would find in a drive, and which PDOs it would lead it by, from its data sheet.

use core::fmt;

use profile_cia402::eds::{self, DeviceDescription};
use profile_cia402::master::config::Direction;
use profile_cia402::wire::NodeId;
use profile_cia402::wire::pdo::mapped_len;
use profile_generic::can::Id;

use super::{Behind, Held, RowCache, StageAxis, StageError};
use crate::config::Config;
use crate::engine::build::can::{described, network};
use crate::engine::build::scaling;
use crate::engine::bus::can::commissioner;
use crate::engine::bus::can::layout::{AxisPdos, FoundPdos, Part};
use crate::mapping::{
    Cia402Axis, Cia402Dictionary, CipScaling, DriveIdentity, DriveProgram, Item, Mapping, Object,
    ObjectFacts, ObjectStep, Plan,
};
use crate::simulate::can_bus::InProcessCan;

/// A CiA 402 drive, or one axis of it.
#[derive(Debug, Clone)]
pub struct CanDrive {
    /// Its node-id.
    pub node: u8,
    /// What it is needed for.
    pub needs: Cia402Axis,
    /// What it has reported about itself.
    pub facts: ObjectFacts,
    /// The PDOs that carry its values.
    pub pdos: Vec<CanPdo>,
}

/// A PDO that carries values of the drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanPdo {
    /// Which way it goes, as the drive sees it.
    pub direction: Direction,
    /// Its number, from 1.
    pub number: u16,
    /// Its identifier.
    pub id: u16,
    /// Bytes of its frame.
    pub len: usize,
    /// What of it belongs to the axis.
    pub parts: Vec<CanPart>,
}

impl CanPdo {
    /// `RPDO` or `TPDO`.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self.direction {
            Direction::Receive => "RPDO",
            Direction::Transmit => "TPDO",
        }
    }
}

/// `RPDO1 (201)`.
impl fmt::Display for CanPdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{} ({:03X})", self.kind(), self.number, self.id)
    }
}

/// A value in a PDO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CanPart {
    /// First byte in the PDO.
    pub at: usize,
    /// First byte among the values of the program.
    pub flat: usize,
    /// Bytes.
    pub len: usize,
}

/// An axis of the box on a CiA 402 drive.
#[derive(Debug, Clone)]
struct CanMember {
    /// Name of the axis.
    name: String,
    /// Number of its device.
    device: usize,
    /// Its instance there.
    instance: u8,
    /// Name of its drive.
    drive: String,
    /// The drive's node-id.
    node: NodeId,
    /// The PDOs that it may have.
    pdos: AxisPdos,
    /// The PDOs that its device has, where they are used as they are.
    found: Option<FoundPdos>,
    /// What it is needed for.
    needs: Cia402Axis,
    /// The scaling of the controller.
    scaling: CipScaling,
    /// What it holds in place of what its data sheet says.
    held: Vec<(Object, Vec<u8>)>,
}

impl CanDrive {
    /// The PDO of this direction with this number, from 1.
    #[must_use]
    pub fn pdo(&self, direction: Direction, number: u16) -> Option<&CanPdo> {
        self.pdos.iter().find(|pdo| pdo.direction == direction && pdo.number == number)
    }

    /// The PDO of this direction that carries a byte of the program's values, and where.
    #[must_use]
    pub fn place(&self, direction: Direction, flat: usize) -> Option<(&CanPdo, usize)> {
        self.pdos.iter().filter(|pdo| pdo.direction == direction).find_map(|pdo| {
            let part = pdo.parts.iter().find(|part| (part.flat..part.flat + part.len).contains(&flat))?;
            Some((pdo, part.at + flat - part.flat))
        })
    }

    /// The frame of a PDO with the values of the program; what belongs to other axes is zero.
    #[must_use]
    pub fn spread(pdo: &CanPdo, flat: &[u8]) -> Vec<u8> {
        let mut frame = vec![0; pdo.len];
        Self::put(pdo, flat, &mut frame);
        frame
    }

    /// Puts the values of the program into the frame of a PDO, and leaves alone what belongs to other axes.
    pub fn put(pdo: &CanPdo, flat: &[u8], frame: &mut [u8]) {
        for part in &pdo.parts {
            let values = flat.get(part.flat..part.flat + part.len);
            if let (Some(place), Some(values)) = (frame.get_mut(part.at..part.at + part.len), values) {
                place.copy_from_slice(values);
            }
        }
    }

    /// Takes the values of a PDO; whether the frame was long enough.
    pub fn gather(pdo: &CanPdo, frame: &[u8], flat: &mut [u8]) -> bool {
        if frame.len() < pdo.len {
            return false;
        }
        for part in &pdo.parts {
            let values = frame.get(part.at..part.at + part.len);
            if let (Some(values), Some(place)) = (values, flat.get_mut(part.flat..part.flat + part.len)) {
                place.copy_from_slice(values);
            }
        }
        true
    }
}

/// The axes of a CAN bus of a configuration, each with its number there. Simulated drives stand in for those of the machine.
/// `held` is what they hold in place of their own.
///
/// # Errors
/// A simulated drive cannot be led as the configuration says.
pub(super) fn configured(
    config: &Config,
    bus: usize,
    mapping: &Mapping,
    held: &[Held],
) -> Result<Vec<(usize, StageAxis)>, StageError> {
    let simulated = InProcessCan::of(&config.can[bus], None);
    let mut axes = Vec::new();
    for ((node, setups), device) in network(config, bus, mapping)?.devices.into_iter().zip(simulated.nodes())
    {
        for setup in setups {
            let axis = &config.axes[setup.axis];
            let failed = |told: String| StageError::Sheet { axis: axis.name.clone(), told };
            let sheet = eds::read(device.eds()).map_err(|error| failed(error.to_string()))?.description;
            let drive = config.can_drive(axis).map(|(_, drive)| drive.name.clone()).unwrap_or_default();
            let own = held.iter().filter(|held| held.drive == drive);
            let own = own.filter_map(|held| match held.item {
                Item::Object(object) => Some((on_first_axis(object), held.bytes.clone())),
                Item::Idn(_) | Item::Attribute(_) => None,
            });
            let held = own.collect();
            let member = CanMember {
                held,
                name: axis.name.clone(),
                device: axis.device,
                instance: axis.instance,
                drive,
                node,
                pdos: setup.pdos,
                found: described(&config.can[bus], node),
                needs: setup.needs,
                scaling: scaling(axis),
            };
            axes.push((setup.axis, StageAxis { bus, ..on_can(mapping, member, &sheet)? }));
        }
    }
    Ok(axes)
}

/// The object as the tables have it, whichever axis of its device it is.
fn on_first_axis(object: Object) -> Object {
    Object { index: Cia402Dictionary::on_first_axis(object.index), ..object }
}

/// An axis on the drive with this data sheet.
fn on_can(mapping: &Mapping, member: CanMember, sheet: &DeviceDescription) -> Result<StageAxis, StageError> {
    let failed = |told: String| StageError::Sheet { axis: member.name.clone(), told };
    let (behind, south) = lead(mapping, &member, sheet).map_err(failed)?;
    let no_ratio = || failed("a ratio of its scaling does not fit 64 bits".to_owned());
    Ok(StageAxis {
        north: mapping.cip_program(&member.scaling).ok_or_else(no_ratio)?,
        attributes: mapping.attribute_table(&member.scaling).ok_or_else(no_ratio)?,
        bus: 0,
        behind: Behind::Can(behind),
        stands_in: member.needs.counts.is_empty(),
        south,
        name: member.name,
        device: member.device,
        instance: member.instance,
        drive: member.drive,
        scaling: member.scaling,
        rows: RowCache::default(),
    })
}

/// What the box would find in a drive, and how it would lead it.
fn lead(
    mapping: &Mapping,
    member: &CanMember,
    sheet: &DeviceDescription,
) -> Result<(CanDrive, DriveProgram), String> {
    let (node, needs) = (member.node, &member.needs);
    let number = |sub| sheet.sub(0x1018, sub)?.setting()?.at(node.get())?.as_u32();
    let identity = DriveIdentity { vendor: number(1), product: number(2) };
    let mapping = mapping.family_of(&identity).map_or(mapping, |family| &family.mapping);
    let facts = asked(mapping, identity, member, sheet)?;
    let program = mapping.cia402_program(needs, &facts).map_err(|error| error.to_string())?;
    let telegram = &program.telegram;
    let both = commissioner::pdos(
        mapping,
        &member.pdos,
        &telegram.command,
        &telegram.feedback,
        member.found.as_ref(),
    );
    let both = both.map_err(|error| error.to_string())?;
    let mut pdos = Vec::new();
    for (direction, (configs, spread)) in Direction::BOTH.into_iter().zip(both) {
        for (place, config) in configs.iter().enumerate() {
            let id = config.id(direction, node).and_then(|id| match id {
                Id::Standard(id) => Some(id),
                Id::Extended(_) => None,
            });
            let id = id.ok_or_else(|| format!("PDO {} has no identifier", config.number))?;
            let part = |part: &Part| CanPart { at: part.at, flat: part.from, len: part.len };
            pdos.push(CanPdo {
                direction,
                number: config.number,
                id,
                len: mapped_len(&config.mapping).unwrap_or(0),
                parts: spread.parts().iter().filter(|part| part.pdo == place).map(part).collect(),
            });
        }
    }
    Ok((CanDrive { node: node.get(), needs: needs.clone(), facts, pdos }, program))
}

/// What a drive answers that has what its data sheet says, and takes what it is told.
fn asked(
    mapping: &Mapping,
    identity: DriveIdentity,
    member: &CanMember,
    sheet: &DeviceDescription,
) -> Result<ObjectFacts, String> {
    let (node, needs) = (member.node.get(), &member.needs);
    let mut facts = ObjectFacts::of(identity);
    for plan in [Plan::Ask, Plan::Tell] {
        for step in mapping.cia402_steps(plan, needs, &facts).map_err(|error| error.to_string())? {
            let (ObjectStep::Read { object, .. } | ObjectStep::Write { object, .. }) = step;
            let Some(Item::Object(there)) = step.item(needs) else { continue };
            let instead = member.held.iter().find(|(known, _)| *known == object);
            if let (Some((_, bytes)), ObjectStep::Read { .. }) = (instead, &step) {
                facts.note_data(object, bytes);
                continue;
            }
            let held = sheet.sub(there.index, there.sub);
            match (held, step) {
                (None, _) => facts.note_missing(object),
                (Some(held), ObjectStep::Read { .. }) => {
                    let value = held.setting().and_then(|setting| setting.at(node));
                    if let Some(bytes) = value.and_then(|value| value.to_bytes(held.data_type)) {
                        facts.note_data(object, &bytes);
                    }
                }
                (Some(_), ObjectStep::Write { bytes, .. }) => facts.note_data(object, &bytes),
            }
        }
    }
    Ok(facts)
}
