//! What a CANopen device with the drive profile CiA 402 has: objects, codes, bits and states.

use super::cia402_codes::{Cia402CodeSet, resolve_codes};
use super::cia402_objects::{Cia402Object, Cia402Sub, resolve_objects};
use super::documents::{Document, Documents, once};
use crate::Item;
use crate::finding::Findings;
use crate::format::Name;
use crate::load::Tables;
use crate::resolver::Resolver;

/// The modes of operation as rows name them.
pub(super) const MODES: &[&str] = &["pp", "vl", "pv", "tq", "hm", "ip", "csp", "csv", "cst", "cstca"];

/// Objects of the drive profile, for the first axis of a device.
const PROFILE: std::ops::RangeInclusive<u16> = 0x6000..=0x67FF;

/// What lies between an object of one axis and that of the next.
const AXIS_STEP: u16 = 0x800;

/// Axes of a device.
const AXES_MAX: u16 = 8;

/// What a CANopen device with the drive profile CiA 402 has.
#[derive(Debug, Clone, Default)]
pub struct Cia402Dictionary {
    pub(super) documents: Documents,
    pub(super) units: Vec<(String, String)>,
    pub(super) objects: Vec<Cia402Object>,
    pub(super) code_sets: Vec<Cia402CodeSet>,
}

impl Cia402Dictionary {
    pub(super) fn resolve(tables: &Tables, errors: &mut Findings) -> Self {
        let file = &tables.cia402_objects;
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cia402");
        once(&mut resolver, "unit", rows.unit.iter().map(|row| &row.unit));
        let documents = Documents::resolve(&rows.source, "cia402-objects.toml", &mut resolver);
        let units = rows.unit.iter().map(|row| (row.unit.get_ref().clone(), row.meaning.clone()));
        let mut dictionary = Self { documents, units: units.collect(), ..Self::default() };
        resolve_objects(&rows.object, &mut dictionary, &mut resolver);
        resolve_codes(&tables.cia402_codes, &mut dictionary, errors);
        dictionary
    }

    /// Documents that the rows refer to.
    pub fn documents(&self) -> &[Document] {
        self.documents.list()
    }

    /// Units and what they mean.
    pub fn units(&self) -> &[(String, String)] {
        &self.units
    }

    /// All objects, by number.
    pub fn objects(&self) -> &[Cia402Object] {
        &self.objects
    }

    /// The row of an object, without regard to axes.
    pub fn object(&self, index: u16) -> Option<&Cia402Object> {
        let at = self.objects.partition_point(|row| row.index <= index).checked_sub(1)?;
        self.objects.get(at).filter(|row| (row.index..=row.last).contains(&index))
    }

    /// The number that an object of any axis has on the first one.
    pub fn on_first_axis(index: u16) -> u16 {
        let axis = index.checked_sub(*PROFILE.start()).map_or(0, |above| above / AXIS_STEP);
        if axis < AXES_MAX { index - axis * AXIS_STEP } else { index }
    }

    /// The row of an object, and the axis of a multi-axis device it belongs to: 0x6840 is 0x6040 of axis 1.
    pub fn object_of_axis(&self, index: u16) -> Option<(&Cia402Object, u16)> {
        let axis = index.checked_sub(*PROFILE.start()).map_or(0, |above| above / AXIS_STEP);
        if axis >= AXES_MAX {
            return None;
        }
        self.object(index - axis * AXIS_STEP).map(|row| (row, axis))
    }

    /// The number of an object of the first axis on another one; objects outside of the profile are shared by all.
    pub fn on_axis(index: u16, axis: u16) -> Option<u16> {
        match PROFILE.contains(&index) {
            true if axis < AXES_MAX => Some(index + axis * AXIS_STEP),
            false => Some(index),
            true => None,
        }
    }

    /// The row of a sub-object; 0 is that of a variable.
    pub fn sub(&self, index: u16, sub: u8) -> Option<&Cia402Sub> {
        self.object(index)?.sub(sub)
    }

    /// Bytes of an item's value, on whatever axis it is; `None` where nobody says, and for what fills no whole bytes.
    pub fn len_of(&self, item: Item) -> Option<u8> {
        let Item::Object(object) = item else { return None };
        let (row, _) = self.object_of_axis(object.index)?;
        let bits = row.sub(object.sub)?.data_type?.bits()?;
        u8::try_from(bits / 8).ok().filter(|bytes| *bytes > 0)
    }

    /// All sets of codes, bits and states.
    pub fn code_sets(&self) -> &[Cia402CodeSet] {
        &self.code_sets
    }

    /// The set with this name.
    pub fn codes(&self, name: &str) -> Option<&Cia402CodeSet> {
        self.code_sets.iter().find(|set| set.name == name)
    }

    /// The modes that a row names.
    pub(super) fn modes(rows: &[Name], resolver: &mut Resolver<'_>) -> Vec<&'static str> {
        let find = |text: &str| MODES.iter().copied().find(|known| *known == text);
        let mode = |name| resolver.name("modes", name, "a mode of operation", find, MODES.iter().copied());
        rows.iter().filter_map(mode).collect()
    }
}
