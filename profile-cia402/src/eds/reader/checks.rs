//! What the parts of a file say of each other: lists of objects, counts, mappings.

use super::{Reader, SectionKind};
use crate::eds::description::{DeviceDescription, ObjectList};
use crate::eds::diagnostic::{Kind, Place};
use crate::eds::drive::{Direction, MappingEntry};
use crate::generated::objects;

/// Objects that every device has.
const MANDATORY: [u16; 3] = [objects::DEVICE_TYPE, objects::ERROR_REGISTER, objects::IDENTITY];

/// Objects below this number are data types, which stand for gaps in a mapping.
const DUMMIES_END: u16 = 0x20;

impl<'t> Reader<'_, 't> {
    pub(super) fn checks(&mut self, description: &mut DeviceDescription) {
        for (name, list) in ObjectList::ALL {
            self.list(name, *list, description);
        }
        self.unlisted(description);
        self.mandatory(description);
        self.pdo_counts(description);
        for direction in Direction::BOTH {
            self.mappings(direction, description);
        }
    }

    /// One of the three lists of objects.
    fn list(&mut self, name: &str, list: ObjectList, description: &mut DeviceDescription) {
        let document = self.document;
        let Some((at, section)) = document.section(name) else {
            // A device need not have objects of its maker's.
            if list != ObjectList::Manufacturer {
                let expected = format!("a section [{name}]");
                self.diagnostics.push(Kind::SectionMissing, Place::default(), expected, "none");
            }
            return;
        };
        let mut count = 0_usize;
        for (_, entry) in self.numbered(section) {
            count += 1;
            let place = section.value_place(entry);
            let Some(index) = self.number_of::<u16>(place, entry.value) else { continue };
            let found = description.objects.binary_search_by_key(&index, |object| object.index);
            let Some(object) = found.ok().and_then(|at| description.objects.get_mut(at)) else {
                let expected = format!("a section [{index:04X}]");
                self.diagnostics.push(Kind::ListedOnly, place, expected, "none");
                continue;
            };
            if object.list.is_some() {
                self.diagnostics.push(Kind::ListedTwice, place, "each object in one list, once", entry.value);
            } else {
                object.list = Some(list);
            }
        }
        match self.number::<usize>(at, "SupportedObjects") {
            Some(said) if said != count => {
                let expected = format!("{said} objects, as `SupportedObjects` says");
                self.diagnostics.push(Kind::ListCount, section.place(), expected, format!("{count}"));
            }
            _ => {}
        }
    }

    /// Objects in none of the lists.
    fn unlisted(&mut self, description: &DeviceDescription) {
        for section in &self.document.sections {
            let SectionKind::Object(index) = SectionKind::of(section.name) else { continue };
            let in_none = description.object(index).is_some_and(|object| object.list.is_none());
            // Data types that are described have no list.
            if in_none && index >= 0x1000 {
                let expected = format!("0x{index:04X} in a list of objects");
                self.diagnostics.push(Kind::Unlisted, section.place(), expected, "none");
            }
        }
    }

    fn mandatory(&mut self, description: &DeviceDescription) {
        for index in MANDATORY {
            if description.object(index).is_none() {
                let expected = format!("a section [{index:04X}]");
                self.diagnostics.push(Kind::MandatoryMissing, Place::default(), expected, "none");
            }
        }
    }

    /// `NrOfRXPDO` and `NrOfTXPDO` are how many communication parameters there are.
    fn pdo_counts(&mut self, description: &DeviceDescription) {
        let said = [
            ("NrOfRXPDO", description.device.rpdos, Direction::Receive),
            ("NrOfTXPDO", description.device.tpdos, Direction::Transmit),
        ];
        for (key, said, direction) in said {
            let there = description.objects.iter();
            let there = there.filter(|object| direction.communication().contains(&object.index)).count();
            let Some(said) = said.filter(|said| usize::from(*said) != there) else { continue };
            let place = self.document.section("DeviceInfo").and_then(|(at, section)| {
                self.document.entry(at, key).map(|entry| section.value_place(entry))
            });
            let expected = format!("{there}, as are described");
            self.diagnostics.push(Kind::PdoCount, place.unwrap_or_default(), expected, format!("{said}"));
        }
    }

    /// What PDOs carry by default can be mapped, has the length it says, and is not too much.
    fn mappings(&mut self, direction: Direction, description: &DeviceDescription) {
        for object in description.objects.iter().filter(|object| direction.mapping().contains(&object.index))
        {
            let count = description.number(object.index, 0, 0).unwrap_or_default();
            let mut bits = 0_u32;
            let used = object.subs.iter().filter(|sub| sub.sub > 0 && u32::from(sub.sub) <= count);
            for sub in used {
                let Some(word) = sub.setting().and_then(|setting| setting.value.as_u32()) else { continue };
                if word == 0 {
                    continue;
                }
                let entry = MappingEntry::of_word(word);
                bits += u32::from(entry.bits);
                if let Some(wrong) = wrong_entry(entry, direction, description) {
                    let place = self.value_place(object.index, sub.sub);
                    self.diagnostics.push(Kind::Mapping, place, wrong, format!("{entry}"));
                }
            }
            if bits > MAPPED_BITS_MAX {
                let place = self.value_place(object.index, 0);
                let expected = format!("at most {MAPPED_BITS_MAX} bits in a PDO");
                self.diagnostics.push(Kind::Mapping, place, expected, format!("{bits}"));
            }
        }
    }

    /// Where the value of a sub-object stands; the header of its object for a compact one.
    fn value_place(&self, index: u16, sub: u8) -> Place<'t> {
        let document = self.document;
        for name in [format!("{index:04X}sub{sub:X}"), format!("{index:04X}Value"), format!("{index:04X}")] {
            let Some((at, section)) = document.section(&name) else { continue };
            for key in ["ParameterValue", "DefaultValue", &sub.to_string()] {
                if let Some(entry) = document.entry(at, key) {
                    return section.value_place(entry);
                }
            }
            return section.place();
        }
        Place::default()
    }
}

/// Bits of a PDO; CANopen FD, which has more, is not described by these files.
const MAPPED_BITS_MAX: u32 = 64;

/// What is wrong with an entry of a mapping, as what was expected of it.
fn wrong_entry(entry: MappingEntry, direction: Direction, description: &DeviceDescription) -> Option<String> {
    if entry.index < DUMMIES_END {
        return None;
    }
    let Some(value) = description.sub(entry.index, entry.sub) else {
        return Some("an object that is described".to_owned());
    };
    let allowed = match direction {
        Direction::Receive => value.access.receives(),
        Direction::Transmit => value.access.transmits(),
    };
    if !value.pdo_mapping || !allowed {
        return Some(format!("an object that {direction}s can carry"));
    }
    match value.data_type.bits() {
        // A boolean may take a bit or a byte.
        Some(1) if entry.bits == 8 => None,
        Some(bits) if bits != entry.bits => Some(format!("{bits} bits, as the object has")),
        _ => None,
    }
}
