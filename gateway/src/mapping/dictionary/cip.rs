//! What a CIP Motion device has: attributes, enumerations, bits and data sets.

use profile_generic::program::Width;

use super::cip_codes::{resolve_data_set_bits, resolve_sets};
use super::cip_faults::resolve_faults;
use super::{Enumeration, ExceptionAction, FaultRecord, StatusCode, named_code};
use crate::mapping::format::{AttributeRow, CipAttributeFile, CipEnumerationFile, Name};
use crate::mapping::load::{Parsed, TableErrors, Tables};
use crate::mapping::resolver::Resolver;

/// An elementary data type of CIP, as far as axis attributes use them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CipType {
    /// One byte, 0 or 1.
    Bool,
    /// Signed, 1 byte.
    Sint,
    /// Signed, 2 bytes.
    Int,
    /// Signed, 4 bytes.
    Dint,
    /// Signed, 8 bytes.
    Lint,
    /// Unsigned, 1 byte.
    Usint,
    /// Unsigned, 2 bytes.
    Uint,
    /// Unsigned, 4 bytes.
    Udint,
    /// Unsigned, 8 bytes.
    Ulint,
    /// Floating point, 4 bytes.
    Real,
    /// Floating point, 8 bytes.
    Lreal,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// One length byte and that many characters.
    ShortString,
}

impl CipType {
    /// Every type with its name.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("BOOL", Self::Bool),
        ("SINT", Self::Sint),
        ("INT", Self::Int),
        ("DINT", Self::Dint),
        ("LINT", Self::Lint),
        ("USINT", Self::Usint),
        ("UINT", Self::Uint),
        ("UDINT", Self::Udint),
        ("ULINT", Self::Ulint),
        ("REAL", Self::Real),
        ("LREAL", Self::Lreal),
        ("BYTE", Self::Byte),
        ("WORD", Self::Word),
        ("DWORD", Self::Dword),
        ("LWORD", Self::Lword),
        ("SHORT_STRING", Self::ShortString),
    ];

    /// How a number of this type lies in memory; `None` for strings.
    pub const fn width(self) -> Option<Width> {
        Some(match self {
            Self::Bool | Self::Usint | Self::Byte => Width::U8,
            Self::Sint => Width::I8,
            Self::Int => Width::I16,
            Self::Dint => Width::I32,
            Self::Lint => Width::I64,
            Self::Uint | Self::Word => Width::U16,
            Self::Udint | Self::Dword => Width::U32,
            Self::Ulint | Self::Lword => Width::U64,
            Self::Real => Width::F32,
            Self::Lreal => Width::F64,
            Self::ShortString => return None,
        })
    }

    /// Bits of a value of this type; `None` for strings.
    pub fn bits(self) -> Option<u32> {
        if self == Self::Bool { Some(1) } else { self.width().map(Width::bits) }
    }

    /// The name in the standard.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// How an attribute may be accessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Get,
    /// Written by Set services.
    Set,
    /// Written by the connection, not by Set services (Set* in the standard).
    SetCyclic,
}

/// The device functions of the implementation table, in its order.
pub const DEVICE_FUNCTIONS: [char; 6] = ['B', 'E', 'F', 'P', 'V', 'T'];

/// One attribute; "Feedback n" attributes are there once per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CipAttribute {
    /// Attribute number.
    pub id: u16,
    /// Name in the standard.
    pub name: String,
    /// Type of the value or of an array's elements.
    pub data_type: CipType,
    /// Elements of an array; `None` for a single value.
    pub length: Option<u16>,
    /// Access.
    pub access: Access,
    /// Whether it may be set in the Running state.
    pub running: bool,
    /// Need for the device functions B, E, F, P, V and T, in this order: `R`, `O`, `C` or `-`.
    pub need: String,
    /// Unit; empty when there is none.
    pub unit: String,
    /// Value at power-up.
    pub default: i64,
}

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
    data_sets: Vec<(String, Vec<DataElement>)>,
}

impl CipDictionary {
    pub(super) fn resolve(tables: &Tables, errors: &mut TableErrors) -> Self {
        let mut dictionary = Self::resolve_attribute_file(&tables.cip_attributes, errors);
        dictionary.resolve_enumeration_file(&tables.cip_enumerations, errors);
        resolve_faults(&tables.cip_faults, &mut dictionary, errors);
        dictionary
    }

    fn resolve_enumeration_file(&mut self, file: &Parsed<CipEnumerationFile>, errors: &mut TableErrors) {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
        resolve_sets(&rows.enumeration, &rows.bits, self, &mut resolver);
    }

    fn resolve_attribute_file(file: &Parsed<CipAttributeFile>, errors: &mut TableErrors) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
        let mut dictionary = Self {
            class_attributes: resolve_attributes(&rows.class_attribute, 1, &mut resolver),
            attributes: resolve_attributes(&rows.attribute, DEVICE_FUNCTIONS.len(), &mut resolver),
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

    /// The elements of the data set with this name.
    pub fn data_set(&self, name: &str) -> Option<&[DataElement]> {
        self.data_sets.iter().find(|(known, _)| known == name).map(|(_, elements)| elements.as_slice())
    }

    /// The names of all data sets.
    pub fn data_set_names(&self) -> impl Iterator<Item = &str> {
        self.data_sets.iter().map(|(name, _)| name.as_str())
    }

    /// The axis attribute that `key` names in a mapping.
    pub(in crate::mapping) fn attribute_or_error(
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
    pub(in crate::mapping) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.enumeration(set), set, key, name, resolver)
    }

    /// The bit that `key` names in a mapping, from the set of bits `set`.
    pub(in crate::mapping) fn bit_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.bits(set), set, key, name, resolver)
    }
}

fn resolve_attributes(rows: &[AttributeRow], needs: usize, resolver: &mut Resolver<'_>) -> Vec<CipAttribute> {
    let mut attributes = Vec::with_capacity(rows.len());
    for row in rows {
        let data_type = resolver.word("type", &row.data_type, CipType::NAMED);
        let access = [("get", Access::Get), ("set", Access::Set), ("set_cyclic", Access::SetCyclic)];
        let access = resolver.word("access", &row.access, &access);
        let need = row.need.get_ref();
        if need.chars().count() != needs || !need.chars().all(|letter| "ROC-".contains(letter)) {
            let message = format!("expected {needs} letters of R, O, C and -, got `{need}`");
            resolver.error(row.need.span(), "need", message);
        }
        let (Some(data_type), Some(access)) = (data_type, access) else { continue };
        let step = row.channel_step.unwrap_or(0);
        for channel in 0..row.channels.unwrap_or(1) {
            let Some(id) = step.checked_mul(channel).and_then(|above| row.id.get_ref().checked_add(above))
            else {
                resolver.error(row.id.span(), "id", "the number of the last channel is above 65535");
                break;
            };
            let name = match row.channels {
                Some(_) => row.name.get_ref().replacen(" n ", &format!(" {} ", channel + 1), 1),
                None => row.name.get_ref().clone(),
            };
            attributes.push((
                row.id.span(),
                CipAttribute {
                    id,
                    name,
                    data_type,
                    length: row.length,
                    access,
                    running: row.running,
                    need: need.clone(),
                    unit: row.unit.as_ref().map(|unit| unit.get_ref().clone()).unwrap_or_default(),
                    default: row.default.unwrap_or(0),
                },
            ));
        }
    }
    attributes.sort_by_key(|(_, attribute)| attribute.id);
    for pair in attributes.windows(2) {
        if pair[0].1.id == pair[1].1.id {
            let message = format!("attribute {} is there twice", pair[1].1.id);
            resolver.error(pair[1].0.clone(), "id", message);
        }
    }
    attributes.into_iter().map(|(_, attribute)| attribute).collect()
}
