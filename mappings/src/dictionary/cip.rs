//! What a CIP Motion device has: attributes, enumerations, bits and data sets.

use super::cip_attributes::{CipAttribute, resolve_class_attributes, resolve_instance_attributes};
use super::cip_codes::{resolve_data_set_bits, resolve_sets};
use super::cip_faults::resolve_faults;
use super::cip_networks::{CipNetwork, resolve_networks};
use super::cip_services::{CipService, resolve_services};
use super::{Enumeration, ExceptionAction, FaultRecord, StatusCode, named_code};
use crate::finding::Findings;
use crate::format::{CipAttributeFile, CipEnumerationFile, Name};
use crate::load::{Parsed, Tables};
use crate::resolver::Resolver;

/// An element of a data set of the cyclic data block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataElement {
    /// Bit in the data set.
    pub bit: u8,
    /// Name.
    pub name: String,
    /// Numbers of the attributes it carries.
    pub attributes: Vec<u16>,
}

/// What a CIP Motion device has.
#[derive(Debug, Clone, Default)]
pub struct CipDictionary {
    class_attributes: Vec<CipAttribute>,
    attributes: Vec<CipAttribute>,
    pub(super) enumerations: Vec<Enumeration>,
    pub(super) bits: Vec<Enumeration>,
    pub(super) fault_records: Vec<FaultRecord>,
    pub(super) exception_actions: Vec<ExceptionAction>,
    pub(super) status_codes: Vec<StatusCode>,
    services: Vec<CipService>,
    networks: Vec<CipNetwork>,
    data_sets: Vec<(String, Vec<DataElement>)>,
}

impl CipDictionary {
    pub(super) fn resolve(tables: &Tables, errors: &mut Findings) -> Self {
        let mut dictionary = Self::resolve_attribute_file(&tables.cip_attributes, errors);
        dictionary.resolve_enumeration_file(&tables.cip_enumerations, errors);
        resolve_faults(&tables.cip_faults, &mut dictionary, errors);
        dictionary.services = resolve_services(&tables.cip_services, errors);
        dictionary.networks = resolve_networks(&tables.cip_networks, errors);
        dictionary
    }

    fn resolve_enumeration_file(&mut self, file: &Parsed<CipEnumerationFile>, errors: &mut Findings) {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
        resolve_sets(&rows.enumeration, &rows.bits, self, &mut resolver);
    }

    fn resolve_attribute_file(file: &Parsed<CipAttributeFile>, errors: &mut Findings) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
        let mut dictionary = Self {
            class_attributes: resolve_class_attributes(rows, &mut resolver),
            attributes: resolve_instance_attributes(rows, &mut resolver),
            ..Self::default()
        };
        for row in &rows.data_set {
            let bits = resolve_data_set_bits(row, &dictionary, &mut resolver);
            dictionary.bits.push(bits);
            let mut elements = Vec::with_capacity(row.elements.len());
            for element in &row.elements {
                let bit = *element.bit.get_ref();
                let attributes = element
                    .attributes
                    .iter()
                    .filter_map(|name| dictionary.attribute_or_error("attributes", name, &mut resolver))
                    .map(|attribute| attribute.id)
                    .collect();
                elements.push(DataElement { bit, name: element.name.get_ref().clone(), attributes });
            }
            dictionary.data_sets.push((row.name.get_ref().clone(), elements));
        }
        dictionary
    }

    /// The attributes of instance 0, by number.
    pub fn class_attributes(&self) -> &[CipAttribute] {
        &self.class_attributes
    }

    /// The attributes of an axis, by number.
    pub fn attributes(&self) -> &[CipAttribute] {
        &self.attributes
    }

    /// The axis attribute with this name.
    pub fn attribute(&self, name: &str) -> Option<&CipAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// The axis attribute with this number.
    pub fn attribute_by_id(&self, id: u16) -> Option<&CipAttribute> {
        let at = self.attributes.binary_search_by_key(&id, |attribute| attribute.id).ok()?;
        self.attributes.get(at)
    }

    /// The attribute of instance 0 with this number.
    pub fn class_attribute_by_id(&self, id: u16) -> Option<&CipAttribute> {
        self.class_attributes.iter().find(|attribute| attribute.id == id)
    }

    /// The set of named codes with this name.
    pub fn enumeration(&self, name: &str) -> Option<&Enumeration> {
        self.enumerations.iter().find(|set| set.name == name)
    }

    /// All sets of named codes.
    pub fn enumerations(&self) -> &[Enumeration] {
        &self.enumerations
    }

    /// All sets of named bits.
    pub fn bit_sets(&self) -> &[Enumeration] {
        &self.bits
    }

    /// The set of named bits with this name.
    pub fn bits(&self, name: &str) -> Option<&Enumeration> {
        self.bits.iter().find(|set| set.name == name)
    }

    /// What the types of faults and alarms mean.
    pub fn fault_records(&self) -> &[FaultRecord] {
        &self.fault_records
    }

    /// What the exception actions do.
    pub fn exception_actions(&self) -> &[ExceptionAction] {
        &self.exception_actions
    }

    /// The general status codes the standard says something of.
    pub fn status_codes(&self) -> &[StatusCode] {
        &self.status_codes
    }

    /// The services, by code.
    pub fn services(&self) -> &[CipService] {
        &self.services
    }

    /// CIP Motion on each of the networks.
    pub fn networks(&self) -> &[CipNetwork] {
        &self.networks
    }

    /// The elements of the data set with this name.
    pub fn data_set(&self, name: &str) -> Option<&[DataElement]> {
        self.data_sets.iter().find(|(known, _)| known == name).map(|(_, elements)| elements.as_slice())
    }

    /// The names of all data sets.
    pub fn data_set_names(&self) -> impl Iterator<Item = &str> {
        self.data_sets.iter().map(|(name, _)| name.as_str())
    }

    /// The axis attribute that `key` names in a mapping.
    pub(crate) fn attribute_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&CipAttribute> {
        let known = self.attributes.iter().map(|attribute| attribute.name.as_str());
        resolver.name(key, name, "an attribute of the axis object", |text| self.attribute(text), known)
    }

    /// The attribute of instance 0 that `key` names.
    pub(super) fn class_attribute_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&CipAttribute> {
        let find = |text: &str| self.class_attributes.iter().find(|attribute| attribute.name == text);
        let known = self.class_attributes.iter().map(|attribute| attribute.name.as_str());
        resolver.name(key, name, "an attribute of instance 0", find, known)
    }

    /// The code that `key` names in a mapping, from the enumeration `set`.
    pub(crate) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(names(self.enumeration(set)), set, key, name, resolver)
    }

    /// The bit that `key` names in a mapping, from the set of bits `set`.
    pub(crate) fn bit_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(names(self.bits(set)), set, key, name, resolver)
    }
}

/// The names and codes of a set.
fn names(set: Option<&Enumeration>) -> impl Iterator<Item = (&str, u32)> + Clone {
    set.into_iter().flat_map(|set| &set.codes).map(|code| (code.name.as_str(), code.code))
}
