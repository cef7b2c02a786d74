//! CiA 402 drives on CANopen: what the box would find in a drive, and which PDOs it would lead it by, from its data sheet.

use core::fmt;

use profile_cia402::eds::DeviceDescription;
use profile_cia402::eds::drive::Direction;
use profile_cia402::eds::layout::{self, Wanted};

use super::{Behind, Stage, StageAxis, StageError};
use crate::mapping::{
    Cia402Axis, Cia402Dictionary, CipScaling, DriveProgram, Item, Mapping, Object, ObjectFacts, ObjectStep,
    Plan,
};

/// A CiA 402 drive, or one axis of it.
#[derive(Debug, Clone)]
pub struct CanDrive {
    /// Its node-id.
    pub node: u8,
    /// What it is needed for.
    pub needs: Cia402Axis,
    /// What it has told of itself.
    pub facts: ObjectFacts,
    /// The PDOs that carry its values.
    pub pdos: Vec<CanPdo>,
}

/// A PDO.
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
pub struct CanMember {
    /// Name of the axis.
    pub name: String,
    /// Number of its device.
    pub device: usize,
    /// Its instance there.
    pub instance: u8,
    /// Name of its drive.
    pub drive: String,
    /// The drive's node-id.
    pub node: u8,
    /// Identifiers of PDOs that have none by the data sheet: direction, number from 1, identifier.
    pub ids: Vec<(Direction, u16, u16)>,
    /// What it is needed for.
    pub needs: Cia402Axis,
    /// The scaling of the controller.
    pub scaling: CipScaling,
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
        for part in &pdo.parts {
            let values = flat.get(part.flat..part.flat + part.len);
            if let (Some(place), Some(values)) = (frame.get_mut(part.at..part.at + part.len), values) {
                place.copy_from_slice(values);
            }
        }
        frame
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

impl Stage {
    /// Axes on CiA 402 drives, each with the data sheet of its drive.
    ///
    /// # Errors
    /// A drive with this data sheet cannot be led.
    pub fn of_sheets<'d>(
        mapping: Mapping,
        members: impl IntoIterator<Item = (CanMember, &'d DeviceDescription)>,
    ) -> Result<Self, StageError> {
        let mut axes = Vec::new();
        for (member, sheet) in members {
            let failed = |told: String| StageError::Sheet { axis: member.name.clone(), told };
            let (behind, south) = lead(&mapping, &member, sheet).map_err(failed)?;
            let no_ratio = || failed("a ratio of its scaling does not fit 64 bits".to_owned());
            axes.push(StageAxis {
                north: mapping.cip_program(&member.scaling).ok_or_else(no_ratio)?,
                attributes: mapping.attribute_table(&member.scaling).ok_or_else(no_ratio)?,
                behind: Behind::Can(behind),
                stands_in: member.needs.counts.is_empty(),
                south,
                name: member.name.clone(),
                device: member.device,
                instance: member.instance,
                drive: member.drive.clone(),
                scaling: member.scaling,
            });
        }
        Ok(Self { mapping, axes, layout: Default::default() })
    }
}

/// What the box would find in a drive, and how it would lead it.
fn lead(
    mapping: &Mapping,
    member: &CanMember,
    sheet: &DeviceDescription,
) -> Result<(CanDrive, DriveProgram), String> {
    let (node, needs) = (member.node, &member.needs);
    let mut facts = asked(mapping, node, needs, sheet)?;
    let text = |error: crate::mapping::Cia402Error| error.to_string();
    let mut program = mapping.cia402_program(needs, &facts).map_err(text)?;
    let mut layout = derived(&program, node, sheet);
    // What no PDO can carry is not there in the cycle; the program says whether it can do without.
    for left in &layout.left_out {
        let object = Object { index: left.wanted.index, sub: left.wanted.sub };
        if program.is_head(Item::Object(object)) {
            return Err(left.to_string());
        }
        facts.note_missing(Object { index: Cia402Dictionary::on_first_axis(object.index), ..object });
    }
    if !layout.left_out.is_empty() {
        program = mapping.cia402_program(needs, &facts).map_err(text)?;
        layout = derived(&program, node, sheet);
    }
    let mut pdos = Vec::with_capacity(layout.pdos.len());
    for pdo in &layout.pdos {
        let number = pdo.number + 1;
        let given = member.ids.iter().find(|(way, of, _)| (*way, *of) == (pdo.direction, number));
        let id = given.map(|(.., id)| *id).or(pdo.cob_id.and_then(|id| u16::try_from(id).ok()));
        let id = id.ok_or_else(|| format!("{} ({number}) has no identifier", pdo.direction))?;
        let mut parts = Vec::new();
        let mut at = 0;
        for entry in &pdo.entries {
            let len = usize::from(entry.bits).div_ceil(8);
            let item = Item::object(entry.index, entry.sub);
            let flat = match pdo.direction {
                Direction::Receive => program.place_of_command(item),
                Direction::Transmit => program.place_of_feedback(item),
            };
            if let Some((flat, width)) = flat {
                if width != len {
                    return Err(format!(
                        "{item} has {len} bytes in the data sheet, {width} in the dictionary"
                    ));
                }
                parts.push(CanPart { at, flat, len });
            }
            at += len;
        }
        pdos.push(CanPdo { direction: pdo.direction, number, id, len: at, parts });
    }
    Ok((CanDrive { node, needs: needs.clone(), facts, pdos }, program))
}

/// What a drive answers that has what its data sheet says, and takes what it is told.
fn asked(
    mapping: &Mapping,
    node: u8,
    needs: &Cia402Axis,
    sheet: &DeviceDescription,
) -> Result<ObjectFacts, String> {
    let mut facts = ObjectFacts::new();
    for plan in [Plan::Ask, Plan::Tell] {
        for step in mapping.cia402_steps(plan, needs, &facts).map_err(|error| error.to_string())? {
            let (ObjectStep::Read { object, .. } | ObjectStep::Write { object, .. }) = step;
            let Some(Item::Object(there)) = step.item(needs) else { continue };
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

/// The PDOs for the values of a program.
fn derived(program: &DriveProgram, node: u8, sheet: &DeviceDescription) -> layout::Layout {
    let wanted = |item: &Item, must: bool| match item {
        Item::Object(Object { index, sub }) if must => Some(Wanted::must(*index, *sub)),
        Item::Object(Object { index, sub }) => Some(Wanted::may(*index, *sub)),
        Item::Idn(_) => None,
    };
    let of = |items: &[Item]| -> Vec<Wanted> {
        items.iter().filter_map(|item| wanted(item, program.is_head(*item))).collect()
    };
    layout::derive(sheet, node, &of(&program.telegram.command), &of(&program.telegram.feedback))
}
