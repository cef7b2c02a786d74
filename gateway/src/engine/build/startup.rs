//! What of the start-up list of a drive is used: not what the gateway sets itself.

use crate::config::{Can, CanDrive, DevicenetDrive, KnownObject};
use crate::engine::bus::devicenet::setup::SetupStep;
use crate::mapping::{Attribute, Cia402Axis, Cia402Type, DriveFacts, Item, Mapping, SercosAxis, Telegram};
use crate::parameter::attributes::attributes;
use crate::parameter::id::Id;
use crate::parameter::known::{belongs_to_gateway, is_of, objects};
use crate::parameter::startup::{StartupEntry, StartupValue};

/// The parameters of a drive in which a list has no say.
#[derive(Debug)]
pub struct Reserved {
    cyclic: Vec<Id>,
    written: Vec<Id>,
    /// Which axis of its device it is, where that decides.
    axis: Option<u16>,
}

impl Reserved {
    /// Those of a SERCOS drive.
    #[must_use]
    pub fn of_sercos(mapping: &Mapping, needs: &SercosAxis) -> Self {
        // A mode without a row is found elsewhere.
        let telegram = mapping.telegram(needs, &DriveFacts::new()).unwrap_or_default();
        let written = mapping.sercos_written(needs);
        Self { cyclic: ids(&telegram), written: written.into_iter().map(Id::Idn).collect(), axis: None }
    }

    /// Those of a CANopen drive.
    #[must_use]
    pub fn of_can(mapping: &Mapping, needs: &Cia402Axis) -> Self {
        let telegram = mapping.cia402_telegram(needs).unwrap_or_default();
        let written = mapping.cia402_written(needs);
        let written = written.into_iter().map(Id::Object).collect();
        Self { cyclic: ids(&telegram), written, axis: Some(needs.axis) }
    }

    /// Those of a drive on DeviceNet that is set up by these steps.
    #[must_use]
    pub fn of_devicenet(steps: &[SetupStep]) -> Self {
        let path = |step: &SetupStep| {
            let Attribute { class, id } = step.attribute;
            Id::Path { class, instance: 1, attribute: id }
        };
        Self { cyclic: Vec::new(), written: steps.iter().map(path).collect(), axis: None }
    }

    /// Why a list has no say in a parameter; `None` where it has.
    #[must_use]
    pub fn why(&self, id: Id) -> Option<&'static str> {
        if self.cyclic.contains(&id) {
            return Some("it is in the telegrams of every cycle");
        }
        if let Some(why) = belongs_to_gateway(id) {
            return Some(why);
        }
        if self.written.contains(&id) {
            return Some("the gateway writes it at commissioning, from other keys of the axis and its drive");
        }
        match (id, self.axis) {
            (Id::Object(object), Some(axis)) if !is_of(object, axis) => {
                Some("it is an object of another axis of the device")
            }
            _ => None,
        }
    }
}

fn ids(telegram: &Telegram) -> Vec<Id> {
    let both = telegram.command.iter().chain(&telegram.feedback);
    let id = |item: &Item| match item {
        Item::Idn(idn) => Some(Id::Idn(*idn)),
        Item::Object(object) => Some(Id::Object(*object)),
        Item::Attribute(_) => None,
    };
    both.filter_map(id).collect()
}

/// The list of a SERCOS drive.
#[must_use]
pub fn of_sercos(startup: &[StartupEntry], needs: &SercosAxis, mapping: &Mapping) -> Vec<StartupEntry> {
    if startup.is_empty() {
        return Vec::new();
    }
    let reserved = Reserved::of_sercos(mapping, needs);
    startup.iter().filter(|entry| reserved.why(entry.id).is_none()).cloned().collect()
}

/// The list of a CANopen drive, with the types of its objects where they are known.
#[must_use]
pub fn of_can(bus: &Can, drive: &CanDrive, needs: &Cia402Axis, mapping: &Mapping) -> Vec<StartupEntry> {
    if drive.startup.is_empty() {
        return Vec::new();
    }
    let reserved = Reserved::of_can(mapping, needs);
    let (_, known) = objects(bus, drive, mapping);
    let of_object = |id| {
        let is_this = |known: &&KnownObject| Id::Object(known.object) == id;
        known.iter().find(is_this)?.data_type
    };
    let free = drive.startup.iter().filter(|entry| reserved.why(entry.id).is_none());
    free.map(|entry| typed(entry, of_object)).collect()
}

/// An entry with the type that is known of its parameter, unless it says its own.
fn typed(entry: &StartupEntry, known: impl Fn(Id) -> Option<Cia402Type>) -> StartupEntry {
    // Of a value of the configuration that says its own bytes, no type is expected.
    let is_hex = matches!(&entry.value, StartupValue::Text(text) if text.starts_with("hex:"));
    let found = if is_hex { None } else { known(entry.id) };
    StartupEntry { data_type: entry.data_type.or(found), ..entry.clone() }
}

/// The list of a drive on DeviceNet that is set up by these steps, with the types of its attributes where they are known.
#[must_use]
pub fn of_devicenet(drive: &DevicenetDrive, steps: &[SetupStep], mapping: &Mapping) -> Vec<StartupEntry> {
    if drive.startup.is_empty() {
        return Vec::new();
    }
    let reserved = Reserved::of_devicenet(steps);
    let known = attributes(&drive.kind, mapping);
    let of_attribute = |id| known.iter().find(|known| known.id == id)?.data_type();
    let free = drive.startup.iter().filter(|entry| reserved.why(entry.id).is_none());
    free.map(|entry| typed(entry, of_attribute)).collect()
}
