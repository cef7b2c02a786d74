//! What follows from a description for a drive: axes, modes, PDOs.

use core::fmt;

use super::description::DeviceDescription;
use crate::generated::objects;
pub use crate::wire::pdo::Direction;

/// The number of the drive profile, as the low word of device types has it.
pub const PROFILE: u16 = 402;

/// What lies between an object of one axis and that of the next.
pub const AXIS_STEP: u16 = 0x800;

/// The most axes of a device.
pub const AXES_MAX: u16 = 8;

/// Bit 31 of a COB-ID: the PDO does not exist.
const NOT_VALID: u32 = 1 << 31;

/// Bit 29 of a COB-ID: the identifier has 29 bits.
const EXTENDED: u32 = 1 << 29;

/// One entry of a PDO mapping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MappingEntry {
    /// The object.
    pub index: u16,
    /// The sub-object.
    pub sub: u8,
    /// Bits of the value.
    pub bits: u8,
}

impl MappingEntry {
    /// The entry that a mapping parameter is.
    #[must_use]
    pub const fn of_word(word: u32) -> Self {
        let [bits, sub, low, high] = word.to_le_bytes();
        Self { index: u16::from_le_bytes([low, high]), sub, bits }
    }

    /// The mapping parameter that it is.
    #[must_use]
    pub const fn word(self) -> u32 {
        let [low, high] = self.index.to_le_bytes();
        u32::from_le_bytes([self.bits, self.sub, low, high])
    }
}

/// `6041:0/16`.
impl fmt::Display for MappingEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:X}/{}", self.index, self.sub, self.bits)
    }
}

/// A PDO as a device has it after a reset, or as a configuration sets it up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pdo {
    /// From the view of the device.
    pub direction: Direction,
    /// Its number, from 0: objects 1400 + number and 1600 + number, or 1800 and 1A00.
    pub number: u16,
    /// Its identifier, when the description has one of 11 bits; of a PDO that is switched off too.
    pub cob_id: Option<u32>,
    /// Whether it is switched on.
    pub valid: bool,
    /// Its transmission type.
    pub transmission: Option<u8>,
    /// What it carries.
    pub mapping: Vec<MappingEntry>,
    /// How many entries its mapping can have; 0 when it cannot be changed.
    pub entries_max: u8,
    /// Whether its identifier can be changed, and with it whether it can be switched on and off.
    pub cob_id_writable: bool,
    /// Whether its transmission type can be changed.
    pub transmission_writable: bool,
}

impl Pdo {
    /// Whether what it carries can be changed.
    #[must_use]
    pub const fn is_changeable(&self) -> bool {
        self.entries_max > 0
    }

    /// Bits that it carries.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.mapping.iter().map(|entry| u32::from(entry.bits)).sum()
    }

    /// The number of the object with its communication parameters.
    #[must_use]
    pub const fn communication(&self) -> u16 {
        self.direction.first_communication() + self.number
    }
}

/// An axis of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// Its number, from 0.
    pub number: u16,
    /// Its device type; `None` when the description does not say.
    pub device_type: Option<u32>,
    /// Its supported drive modes, 6502; `None` when the description does not say and the drive must be asked.
    pub modes: Option<u32>,
}

impl Axis {
    /// The number that an object of the first axis has on this one.
    #[must_use]
    pub const fn index(&self, of_first: u16) -> u16 {
        of_first + self.number * AXIS_STEP
    }

    /// Whether it has a mode, by the code that 6060 takes: 1 pp, 2 vl, 3 pv, 4 tq, 6 hm, 7 ip, 8 csp, 9 csv, 10 cst, 11 cstca.
    /// `None` when nobody knows.
    #[must_use]
    pub fn has_mode(&self, mode: u8) -> Option<bool> {
        let modes = self.modes?;
        Some((1..=32).contains(&mode) && modes >> (mode - 1) & 1 == 1)
    }
}

impl DeviceDescription {
    /// Whether it describes a drive of CiA 402.
    #[must_use]
    pub fn is_drive(&self) -> bool {
        let profile = self.number(objects::DEVICE_TYPE, 0, 0).map(|device_type| device_type & 0xFFFF);
        match profile {
            Some(profile) if profile != 0 => profile == u32::from(PROFILE),
            // A type of 0 or none says nothing.
            _ => self.object(objects::CONTROLWORD).is_some() && self.object(objects::STATUSWORD).is_some(),
        }
    }

    /// The axes that have controlword and statusword.
    #[must_use]
    pub fn axes(&self) -> Vec<Axis> {
        let there = |number: &u16| {
            let offset = number * AXIS_STEP;
            self.object(objects::CONTROLWORD + offset).is_some()
                && self.object(objects::STATUSWORD + offset).is_some()
        };
        let axis = |number: u16| {
            let own = self.number(objects::AXIS_DEVICE_TYPE + number * AXIS_STEP, 0, 0);
            let device_type = own.or_else(|| self.number(objects::DEVICE_TYPE, 0, 0).filter(|_| number == 0));
            Axis {
                number,
                device_type,
                modes: self.number(objects::SUPPORTED_MODES + number * AXIS_STEP, 0, 0),
            }
        };
        (0..AXES_MAX).filter(there).map(axis).collect()
    }

    /// PDOs of one direction that a node with this node-ID has, by number.
    #[must_use]
    pub fn pdos(&self, direction: Direction, node: u8) -> Vec<Pdo> {
        let objects = self.objects.iter().filter(|object| direction.communication().contains(&object.index));
        objects
            .map(|object| self.pdo(direction, object.index - direction.first_communication(), node))
            .collect()
    }

    fn pdo(&self, direction: Direction, number: u16, node: u8) -> Pdo {
        let (communication, mapping) =
            (direction.first_communication() + number, direction.first_mapping() + number);
        let word = self.number(communication, 1, node);
        let identifier =
            word.filter(|word| word & EXTENDED == 0).map(|word| word & 0x7FF).filter(|id| *id != 0);
        let writable = |index, sub| self.sub(index, sub).is_some_and(|value| value.access.writes());
        let count = self.number(mapping, 0, node).unwrap_or_default();
        let subs = self.object(mapping).map(|object| object.subs.as_slice()).unwrap_or_default();
        let used = subs.iter().filter(|sub| sub.sub > 0 && u32::from(sub.sub) <= count);
        let words = used.filter_map(|sub| sub.setting().and_then(|setting| setting.value.as_u32()));
        let entries = subs.iter().skip_while(|sub| sub.sub == 0).zip(1_u8..);
        let entries = entries.take_while(|(sub, number)| sub.sub == *number && sub.access.writes()).count();
        let entries_max = if writable(mapping, 0) { u8::try_from(entries).unwrap_or(u8::MAX) } else { 0 };
        Pdo {
            direction,
            number,
            cob_id: identifier,
            valid: word.is_some_and(|word| word & NOT_VALID == 0),
            transmission: self.number(communication, 2, node).and_then(|word| u8::try_from(word).ok()),
            mapping: words.filter(|word| *word != 0).map(MappingEntry::of_word).collect(),
            entries_max: if self.device.granularity == Some(0) { 0 } else { entries_max },
            cob_id_writable: writable(communication, 1),
            transmission_writable: writable(communication, 2),
        }
    }
}
