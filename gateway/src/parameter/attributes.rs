//! Attributes of drives on DeviceNet that are known before the drive is asked: those of the Identity object; of a CIP Motion drive those
//! of the Motion Device Axis Object that the dictionary has, with what overlays add to it; of a velocity drive those of the AC/DC drive
//! profile.
//!
//! The backup of a drive has the attributes that a Set service writes. Not in it are states and actual values (Get), control mode, data
//! sets, commands and trims (Set*, which the connection writes), run, reset and references of a velocity drive, and outputs.

use super::id::Id;
use super::known::belongs_to_gateway;
use super::speed_attributes;
use super::value::Kind;
use crate::config::DevicenetKind;
use crate::mapping::devicenet::motion;
use crate::mapping::{Access, Cia402Type, CipAttribute, CipType, Mapping};

/// Class code of the Identity object.
const IDENTITY: u16 = 0x01;

/// Instance of every object that is listed.
const INSTANCE: u16 = 1;

/// Digital and analog outputs of the drive: what is set is a command.
const OUTPUTS: [u16; 3] = [731, 734, 735];

/// An attribute that a list of parameters has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownAttribute {
    /// Its number: class, instance, attribute.
    pub id: Id,
    /// Its name.
    pub name: String,
    /// What its value is.
    pub kind: Kind,
    /// What can be done with it.
    pub access: Access,
    /// Its unit; empty when there is none.
    pub unit: String,
    /// Least and greatest value where the standard states them.
    pub limits: [Option<i64>; 2],
    /// Whether it is a parameter of the drive, which a backup keeps.
    pub is_kept: bool,
}

impl KnownAttribute {
    fn identity(attribute: u16, name: &str, kind: Kind) -> Self {
        Self {
            id: Id::Path { class: IDENTITY, instance: INSTANCE, attribute },
            name: name.to_owned(),
            kind,
            access: Access::Get,
            unit: String::new(),
            limits: [None; 2],
            is_kept: false,
        }
    }

    /// One of a device profile, by class and number.
    pub(super) fn of_profile(
        (class, attribute): (u16, u16),
        name: &str,
        kind: Kind,
        access: Access,
        unit: &str,
    ) -> Self {
        let id = Id::Path { class, instance: INSTANCE, attribute };
        let is_kept = access == Access::Set && belongs_to_gateway(id).is_none();
        Self { id, name: name.to_owned(), kind, access, unit: unit.to_owned(), limits: [None; 2], is_kept }
    }

    fn of_axis(row: &CipAttribute) -> Self {
        let id = Id::Path { class: motion::CLASS, instance: INSTANCE, attribute: row.id };
        let is_set = row.access == Access::Set && belongs_to_gateway(id).is_none();
        Self {
            id,
            name: row.name.clone(),
            kind: kind(row),
            access: row.access,
            unit: row.unit.clone(),
            limits: [row.min, row.max],
            is_kept: is_set && !OUTPUTS.contains(&row.id),
        }
    }

    /// Its type, where it is a single number.
    #[must_use]
    pub const fn data_type(&self) -> Option<Cia402Type> {
        match self.kind {
            Kind::Object(data_type) => Some(data_type),
            _ => None,
        }
    }
}

/// What is known of a drive of this kind, in the order of the numbers.
#[must_use]
pub fn attributes(kind: &DevicenetKind, mapping: &Mapping) -> Vec<KnownAttribute> {
    use Cia402Type as T;
    let number = Kind::Object;
    let identity = [
        KnownAttribute::identity(1, "Vendor ID", number(T::U16)),
        KnownAttribute::identity(2, "Device Type", number(T::U16)),
        KnownAttribute::identity(3, "Product Code", number(T::U16)),
        KnownAttribute::identity(4, "Revision", Kind::Array(T::U8, 2)),
        KnownAttribute::identity(5, "Status", number(T::U16)),
        KnownAttribute::identity(6, "Serial Number", number(T::U32)),
        KnownAttribute::identity(7, "Product Name", Kind::ShortString),
    ];
    let mut all: Vec<_> = identity.into();
    match kind {
        DevicenetKind::Motion { .. } => {
            all.extend(mapping.dictionaries.cip.attributes().iter().map(KnownAttribute::of_axis));
        }
        DevicenetKind::Speed { .. } => all.extend(speed_attributes::all()),
    }
    all
}

fn kind(row: &CipAttribute) -> Kind {
    let element = match row.data_type {
        CipType::Bool => Cia402Type::Bool,
        CipType::Sint => Cia402Type::I8,
        CipType::Int => Cia402Type::I16,
        CipType::Dint => Cia402Type::I32,
        CipType::Lint => Cia402Type::I64,
        CipType::Usint | CipType::Byte => Cia402Type::U8,
        CipType::Uint | CipType::Word => Cia402Type::U16,
        CipType::Udint | CipType::Dword => Cia402Type::U32,
        CipType::Ulint | CipType::Lword => Cia402Type::U64,
        CipType::Real => Cia402Type::F32,
        CipType::Lreal => Cia402Type::F64,
        CipType::ShortString => return Kind::ShortString,
    };
    row.length.map_or(Kind::Object(element), |length| Kind::Array(element, length))
}

#[cfg(test)]
mod tests {
    use profile_cip::devicenet::wire::speed::Assembly;

    use super::*;

    fn known(text: &str) -> KnownAttribute {
        let kind = DevicenetKind::Motion { modes: Vec::new(), resolution: 1 };
        let all = attributes(&kind, &Mapping::embedded().unwrap());
        let id = Id::parse(text).unwrap();
        all.into_iter().find(|known| known.id == id).unwrap_or_else(|| panic!("{text}"))
    }

    #[test]
    fn parameters_are_what_a_service_sets_and_neither_states_nor_commands() {
        for (text, name, kind, unit) in [
            ("66.1.504", "Torque Limit - Positive", "f32", "% Motor Rated"),
            ("66.1.610", "Stopping Action", "u8", ""),
            ("66.1.672", "Axis Exception Action", "u8[64]", ""),
            ("66.1.1371", "Transmission Ratio Input", "i32", "Input Shaft Revs"),
            ("66.1.1466", "Feedback 2 Cycle Resolution", "u32", ""),
        ] {
            let known = known(text);
            assert!(known.is_kept, "{text}");
            assert_eq!((known.name.as_str(), known.kind.describe().as_str()), (name, kind), "{text}");
            assert_eq!(known.unit, unit, "{text}");
        }
        // Control Mode, Control Status, a data set, a set-point, a trim, Axis State, an output, the vendor.
        for text in ["66.1.40", "66.1.89", "66.1.90", "66.1.362", "66.1.451", "66.1.650", "66.1.731", "1.1.1"]
        {
            assert!(!known(text).is_kept, "{text}");
        }
        assert_eq!(known("66.1.83").limits, [Some(0), Some(1)], "Cyclic Unwind Control");
    }

    #[test]
    fn every_attribute_has_a_type_and_its_number_once_and_those_of_a_velocity_drive_are_few() {
        let mapping = Mapping::embedded().unwrap();
        let motion = attributes(&DevicenetKind::Motion { modes: Vec::new(), resolution: 1 }, &mapping);
        let kept = motion.iter().filter(|known| known.is_kept).count();
        assert_eq!((motion.len(), kept), (459, 258));
        let mut ids: Vec<String> = motion.iter().map(|known| known.id.to_string()).collect();
        ids.sort();
        ids.dedup();
        assert_eq!(ids.len(), motion.len());
        assert!(motion.iter().all(|known| known.kind != Kind::Unknown));
        let speed = DevicenetKind::Speed { assembly: Assembly(21), scale: 0 };
        let speed = attributes(&speed, &mapping);
        let number = |known: &KnownAttribute| match known.id {
            Id::Path { class, attribute, .. } => (class, attribute),
            _ => panic!("{known:?}"),
        };
        assert!(speed.windows(2).all(|pair| number(&pair[0]) < number(&pair[1])), "in order, and once");
        assert!(speed.iter().all(|known| known.kind != Kind::Unknown));
    }

    /// What a person sets is a parameter; what the connection carries, or the gateway sets for it, is not.
    #[test]
    fn parameters_of_a_velocity_drive_are_neither_its_states_nor_its_commands() {
        let kind = DevicenetKind::Speed { assembly: Assembly(21), scale: 0 };
        let speed = attributes(&kind, &Mapping::embedded().unwrap());
        let known = |text: &str| {
            let id = Id::parse(text).unwrap();
            speed.iter().find(|known| known.id == id).unwrap_or_else(|| panic!("{text}"))
        };
        for (text, name, kind, unit) in [
            ("40.1.6", "RatedCurrent", "u16", "100 mA"),
            ("41.1.16", "DNFaultMode", "u8", ""),
            ("42.1.18", "AccelTime", "u16", "ms / 2^TimeScale"),
            ("42.1.21", "HighSpdLimit", "u16", "rpm / 2^SpeedScale"),
            ("42.1.22", "SpeedScale", "i8", ""),
        ] {
            let known = known(text);
            assert!(known.is_kept, "{text}");
            assert_eq!((known.name.as_str(), known.kind.describe().as_str()), (name, kind), "{text}");
            assert_eq!(known.unit, unit, "{text}");
        }
        // The vendor; run, control from the net, state, reset, a fault that is forced; source of the reference, actual value,
        // references.
        for text in [
            "1.1.1", "41.1.3", "41.1.4", "41.1.5", "41.1.6", "41.1.12", "41.1.17", "42.1.4", "42.1.7",
            "42.1.8", "42.1.12", "42.1.14",
        ] {
            assert!(!known(text).is_kept, "{text}");
        }
        assert_eq!(speed.iter().filter(|known| known.is_kept).count(), 28);
    }

    #[test]
    fn what_an_overlay_adds_to_the_dictionary_is_a_parameter_like_others() {
        let overlay = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/overlays/vendor-parameter.toml");
        let mapping = Mapping::load(None, &[overlay.into()]).unwrap();
        let all = attributes(&DevicenetKind::Motion { modes: Vec::new(), resolution: 1 }, &mapping);
        let id = Id::parse("66.1.2001").unwrap();
        let notch = all.iter().find(|known| known.id == id).expect("the attribute of the overlay");
        assert_eq!((notch.name.as_str(), notch.unit.as_str()), ("Notch Frequency", "Hertz"));
        assert_eq!((notch.kind, notch.is_kept), (Kind::Object(Cia402Type::F32), true));
    }
}
