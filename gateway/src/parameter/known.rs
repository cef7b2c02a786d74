//! What the gateway knows of the parameters of its drives, before it asks them.

use std::sync::Arc;

use profile_cia402::drive::index::{AXIS_OFFSET, on_first_axis};
use profile_sercos::wire::idn::Idn;

use super::attributes::{KnownAttribute, attributes};
use super::id::Id;
use crate::config::{Can, CanDrive, Config, DriveAt, KnownObject, is_set_by_gateway};
use crate::mapping::devicenet::{motion, speed};
use crate::mapping::{Cia402Dictionary, Dictionaries, Mapping, Object};

/// The bus of a drive, with what is known of the drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Bus {
    /// SERCOS III: the drive itself has lists of its parameters.
    Sercos,
    /// CANopen.
    Can {
        /// Where the list is from.
        source: &'static str,
        /// The objects of this axis and of the device, in the order of their numbers.
        objects: Vec<KnownObject>,
    },
    /// DeviceNet.
    Devicenet {
        /// What the dictionary has of the drive, in the order of the numbers.
        attributes: Vec<KnownAttribute>,
    },
}

/// A drive of which nothing is known.
static UNKNOWN: Bus = Bus::Devicenet { attributes: Vec::new() };

impl Bus {
    /// Its name in replies and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Sercos => "sercos",
            Self::Can { .. } => "canopen",
            Self::Devicenet { .. } => "devicenet",
        }
    }

    /// Whether its drives have such numbers.
    #[must_use]
    pub const fn has(&self, id: Id) -> bool {
        matches!(
            (self, id),
            (Self::Sercos, Id::Idn(_))
                | (Self::Can { .. }, Id::Object(_))
                | (Self::Devicenet { .. }, Id::Path { .. })
        )
    }

    /// What is known of an object of the drive.
    #[must_use]
    pub fn object(&self, object: Object) -> Option<&KnownObject> {
        let Self::Can { objects, .. } = self else { return None };
        objects.iter().find(|known| known.object == object)
    }

    /// What is known of an attribute of the drive.
    #[must_use]
    pub fn attribute(&self, id: Id) -> Option<&KnownAttribute> {
        let Self::Devicenet { attributes } = self else { return None };
        attributes.iter().find(|known| known.id == id)
    }
}

/// What is known of the drives of all axes.
#[derive(Debug, Clone)]
pub struct Catalogue {
    dictionaries: Arc<Dictionaries>,
    axes: Vec<Bus>,
}

impl Catalogue {
    /// What configuration and tables say.
    #[must_use]
    pub fn of(config: &Config, mapping: &Mapping) -> Self {
        let axes = config.axes.iter().map(|axis| match axis.drive {
            DriveAt::Sercos { .. } => Bus::Sercos,
            DriveAt::Devicenet { .. } => {
                let drive = config.devicenet_drive(axis);
                let known = drive.map(|(_, drive)| attributes(&drive.kind, mapping));
                Bus::Devicenet { attributes: known.unwrap_or_default() }
            }
            DriveAt::Can { .. } => {
                let (source, objects) = config
                    .can_drive(axis)
                    .map_or(("dictionary", Vec::new()), |(bus, drive)| objects(bus, drive, mapping));
                Bus::Can { source, objects }
            }
        });
        Self::new(axes.collect(), mapping)
    }

    /// The same of these drives, in the order of the axes.
    #[must_use]
    pub fn new(axes: Vec<Bus>, mapping: &Mapping) -> Self {
        Self { axes, dictionaries: Arc::clone(&mapping.dictionaries) }
    }

    /// The drive of an axis.
    #[must_use]
    pub fn bus(&self, axis: usize) -> &Bus {
        self.axes.get(axis).unwrap_or(&UNKNOWN)
    }

    /// The name of an IDN in the tables, without asking a drive.
    #[must_use]
    pub fn idn_name(&self, idn: Idn) -> Option<&str> {
        self.dictionaries.sercos.idn(idn).map(|row| row.name.as_str()).filter(|name| !name.is_empty())
    }
}

/// What is known of the objects of a CANopen drive and its device, in the order of their numbers, and where that is from.
#[must_use]
pub fn objects(bus: &Can, drive: &CanDrive, mapping: &Mapping) -> (&'static str, Vec<KnownObject>) {
    let file = bus.device(drive.node).and_then(|device| device.file.as_ref());
    match file.filter(|file| !file.objects.is_empty()) {
        Some(file) => {
            let of_axis = file.objects.iter().filter(|known| is_of(known.object, drive.axis));
            ("file", of_axis.cloned().collect())
        }
        None => ("dictionary", dictionary(mapping, drive.axis)),
    }
}

/// Whether an object is one of the device, or of this axis of it.
#[must_use]
pub fn is_of(object: Object, axis: u16) -> bool {
    match object.index.checked_sub(0x6000) {
        Some(behind) if object.index < 0xA000 => behind / AXIS_OFFSET == axis,
        _ => true,
    }
}

/// The objects of the tables that an axis can have, without those of the communication.
fn dictionary(mapping: &Mapping, axis: u16) -> Vec<KnownObject> {
    let rows = mapping.dictionaries.cia402.objects().iter();
    let rows = rows.filter(|row| row.index < 0x1100 || (0x2000..0x6800).contains(&row.index));
    let mut objects = Vec::new();
    for row in rows {
        // Rows of several objects or values that are alike stand for the first of them.
        for sub in row.subs.iter().filter(|sub| !sub.name.is_empty() || !row.name.is_empty()) {
            let index = match row.index {
                0x6000.. => Cia402Dictionary::on_axis(row.index, axis),
                index => Some(index),
            };
            let Some(index) = index else { continue };
            let name = match (row.subs.len(), sub.name.is_empty() || sub.name == row.name) {
                (1, _) | (_, true) => row.name.clone(),
                _ => format!("{}: {}", row.name, sub.name),
            };
            objects.push(KnownObject {
                object: Object { index, sub: sub.sub },
                name,
                data_type: sub.data_type,
                access: sub.access,
                unit: sub.unit.clone(),
            });
        }
    }
    objects.sort_by_key(|known| known.object);
    objects.dedup_by_key(|known| known.object);
    objects
}

/// Why a parameter is not written through the gateway: what it is. `None` for those that may be.
#[must_use]
pub fn belongs_to_gateway(id: Id) -> Option<&'static str> {
    const COMMUNICATION: &str = "the gateway sets it for its communication with the drive";
    const COMMAND: &str = "the gateway commands the drive with it";
    match id {
        Id::Idn(idn) if idn.is_product() => None,
        Id::Idn(idn) => match idn.block() {
            // Telegrams, timing and classes of the communication profile.
            1..=10 | 15 | 16 | 24 | 87..=90 | 96 | 1000..=1299 => Some(COMMUNICATION),
            // Control word and operation modes; set-points.
            32..=37 | 47 | 48 | 80 | 81 | 134 | 258..=260 => Some(COMMAND),
            _ => None,
        },
        Id::Object(object) => match object.index {
            0x1010 | 0x1011 => {
                Some("it is a command and has no value that can be read back; `param command` executes it")
            }
            index if is_set_by_gateway(index) && index < 0x2000 => Some(COMMUNICATION),
            index if is_set_by_gateway(index) => Some(COMMAND),
            0x1200..=0x1BFF => Some(COMMUNICATION),
            _ => None,
        },
        Id::Path { class, attribute, .. } => match (class, attribute) {
            // DeviceNet, message router, connections, assemblies.
            (0x02..=0x05, _) => Some(COMMUNICATION),
            // Control Status, data sets, Command Control.
            (motion::CLASS, 89..=97) => Some(COMMUNICATION),
            // Control Mode, Feedback Mode, Event Checking Control; set-points; trims.
            (motion::CLASS, 40 | 42 | 60 | 360..=364 | 431 | 451 | 481 | 491) => Some(COMMAND),
            // NetCtrl, NetRef.
            (speed::CLASS_SUPERVISOR, 5) | (speed::CLASS_DRIVE, 4) => Some(COMMUNICATION),
            // Run, fault reset, a forced fault; references.
            (speed::CLASS_SUPERVISOR, 3 | 4 | 12 | 17) | (speed::CLASS_DRIVE, 8 | 12 | 14) => Some(COMMAND),
            _ => None,
        },
    }
}

/// Whether a parameter decides what the values of its drive mean: its program was made of what it was when the drive was
/// commissioned.
#[must_use]
pub fn rescales(id: Id) -> bool {
    match id {
        Id::Idn(idn) if idn.is_product() => false,
        Id::Idn(idn) => match idn.block() {
            // Velocity: polarity, scaling. Position: polarity, scaling, resolution. Torque: scaling, polarity. Modulo value, gear,
            // feed constant. Acceleration: scaling. Temperature: scaling. Resolution of the encoders.
            43..=46 | 55 | 76..=79 | 85 | 86 | 93 | 94 | 103 | 116..=118 | 121..=123 | 160..=162 | 208 => {
                true
            }
            _ => false,
        },
        Id::Object(object) => match object.index {
            index @ 0x6000..=0x9FFF => matches!(
                on_first_axis(index),
                // Range of positions, polarity; notations and dimensions, resolutions, ratios, feed, factors; units.
                0x607B | 0x607E | 0x6089..=0x608F | 0x6090..=0x6097 | 0x60A8..=0x60AA | 0x60C2
            ),
            _ => false,
        },
        // Nothing is read from the drive at the start: the configuration says what the drive is to be.
        Id::Path { class: motion::CLASS, attribute, .. } => match attribute {
            // Ratio of the feedbacks, scaling, unit, resolution, polarity, unwind; polarity of the motor; gear and actuator.
            44 | 45 | 77..=79 | 83 | 84 | 1317 | 1370..=1377 => true,
            // Units, polarity, resolution and range of each feedback channel.
            1400..=1599 => matches!(attribute % 50, 10 | 11 | 14 | 16..=19),
            _ => false,
        },
        // The program of a velocity drive knows the scale of its speed.
        Id::Path { class: speed::CLASS_DRIVE, attribute, .. } => attribute == speed::SPEED_SCALE,
        Id::Path { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::Cia402Type;

    fn id(text: &str) -> Id {
        Id::parse(text).unwrap()
    }

    #[test]
    fn what_the_gateway_sets_is_not_for_clients() {
        for text in [
            "S-0-0134",
            "S-0-0047",
            "S-0-1050.0.6",
            "6040h",
            "0x6840",
            "607Ah",
            "1600h.1",
            "1017h",
            "1010h.1",
            "3.1.1",
            "0x42.1.40",
            "0x42.1.89",
            "0x42.1.97",
            "0x42.1.361",
            "0x42.1.451",
            "0x29.1.3",
            "0x29.1.5",
            "0x29.1.12",
            "0x2A.1.4",
            "0x2A.1.8",
        ] {
            assert!(belongs_to_gateway(id(text)).is_some(), "{text}");
        }
        for text in [
            "S-0-0100",
            "P-0-0134",
            "S-0-0091",
            "6081h",
            "2001h",
            "60FBh.1",
            "1.1.7",
            "0x2A.1.22",
            "66.1.504",
        ] {
            assert_eq!(belongs_to_gateway(id(text)), None, "{text}");
        }
    }

    #[test]
    fn scaling_is_known_on_every_axis_of_a_device() {
        for text in [
            "S-0-0076",
            "S-0-0079",
            "S-0-0123",
            "6091h.1",
            "0x6891.2",
            "607Eh",
            "608Fh.1",
            "66.1.78",
            "66.1.1371",
            "66.1.1466",
            "0x2A.1.22",
        ] {
            assert!(rescales(id(text)), "{text}");
        }
        for text in ["S-0-0100", "P-0-0076", "6081h", "0x6081.0", "2091h", "1.1.7", "66.1.504", "66.1.1434"] {
            assert!(!rescales(id(text)), "{text}");
        }
    }

    #[test]
    fn objects_of_an_axis_are_those_of_its_range() {
        let mapping = Mapping::embedded().unwrap();
        for (axis, velocity) in [(0, 0x6081), (2, 0x7081)] {
            let objects = dictionary(&mapping, axis);
            let known =
                objects.iter().find(|known| known.object.index == velocity).expect("profile velocity");
            assert_eq!((known.name.as_str(), known.data_type), ("Profile velocity", Some(Cia402Type::U32)));
            assert!(known.is_kept());
            let behind = |known: &KnownObject| is_of(known.object, axis);
            assert!(objects.iter().all(behind), "no object of another axis");
            assert!(objects.windows(2).all(|pair| pair[0].object < pair[1].object), "in order, and once");
        }
        let objects = dictionary(&mapping, 0);
        let word = objects.iter().find(|known| known.object.index == 0x6040).expect("controlword");
        assert!(!word.is_kept(), "the gateway's");
    }
}
