//! The dictionaries: what each profile has, looked up by name or number.

mod cia402;
mod cia402_codes;
mod cia402_objects;
mod cip;
mod cip_attributes;
mod cip_codes;
mod cip_faults;
mod cip_networks;
mod cip_services;
mod computed;
mod documents;
mod generic;
mod sercos;
mod sercos_bits;
mod sercos_codes;
mod sercos_idns;
mod sercos_terms;

pub use cia402::Cia402Dictionary;
pub use cia402_codes::{Cia402Class, Cia402Code, Cia402CodeSet, Cia402Range, Cia402RangeKind, Cia402SetKind};
pub use cia402_objects::{
    Cia402Access, Cia402Category, Cia402Kind, Cia402Object, Cia402Pdo, Cia402Sub, Cia402Type,
};
pub use cip::{CipDictionary, DataElement};
pub use cip_attributes::{Access, CipAttribute, CipType, DEVICE_FUNCTIONS, PolarityEffect};
pub use cip_faults::{Clearing, ExceptionAction, FaultRecord, StatusCode};
pub use cip_networks::{CipNetwork, ConnectionDataFormat, ETHERNET_IP, NetworkObject, networks};
pub use cip_services::CipService;
pub(crate) use computed::{AT_LIMIT, ROUNDINGS};
pub use documents::{Confidence, Document, Documents, Trust};
pub use generic::{GenericDictionary, GenericParameter};
pub use sercos::SercosDictionary;
pub use sercos_bits::{Field, FieldValue, Layout, Pattern, Word};
pub use sercos_codes::{CodeGroup, CodeSet, GroupKind, NamedCode};
pub use sercos_idns::{IdnFormat, IdnPart, IdnUnit, SercosIdn};
pub use sercos_terms::{ScaledQuantity, SercosTerms};

use profile_generic::quantity::Quantity;

use super::format::Name;
use super::load::Tables;
use super::resolver::Resolver;
use crate::finding::Findings;
use crate::finding::registry as code;

/// A generic quantity by name.
pub(super) fn quantity(resolver: &mut Resolver<'_>, name: &Name) -> Option<Quantity> {
    let names = Quantity::ALL.iter().map(|quantity| quantity.name());
    resolver.name("quantity", name, "a quantity of the generic model", Quantity::parse, names)
}

/// Whether a set names codes or bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetKind {
    /// Codes: one of them is the value.
    Codes,
    /// Bits, 0 first: any of them may be set.
    Bits {
        /// Bits of the value.
        width: u32,
    },
}

/// One named code or bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Code {
    /// The code, or the number of the bit.
    pub code: u32,
    /// Its name.
    pub name: String,
    /// `R`, `O`, `C` or `-`; `None` where the standard prints nothing.
    pub need: Option<char>,
    /// To what the need applies, as the standard prints it; empty when nothing is said.
    pub rule: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
    /// Numbers of the attributes that say when a condition is met, of instance 0 where the set belongs to it.
    pub limits: Vec<u16>,
}

/// What codes without a name of their own are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RangeKind {
    /// For later editions: not to be used.
    Reserved,
    /// For the maker of the device.
    Vendor,
    /// For the device, by its profile.
    Device,
    /// The code is a number.
    Number,
}

impl RangeKind {
    /// Every kind with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("reserved", Self::Reserved),
        ("vendor", Self::Vendor),
        ("device", Self::Device),
        ("number", Self::Number),
    ];
}

/// Codes or bits without a name of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeRange {
    /// The first of them.
    pub first: u32,
    /// The last of them.
    pub last: u32,
    /// What they are for.
    pub kind: RangeKind,
    /// What such a code means; mostly empty.
    pub name: String,
    /// `R`, `O`, `C` or `-`; `None` where the standard prints nothing.
    pub need: Option<char>,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// Named codes or bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// Name of the set.
    pub name: String,
    /// Codes or bits.
    pub kind: SetKind,
    /// Numbers of the axis attributes that hold such a value.
    pub attributes: Vec<u16>,
    /// Numbers of the attributes of instance 0 that do.
    pub class_attributes: Vec<u16>,
    /// The field or the part of the attribute that does, in words; empty when it is all of it.
    pub element: String,
    /// Where it comes from.
    pub source: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
    /// First and last bit of the code where it is only a part of the value.
    pub field: Option<(u32, u32)>,
    /// The codes or bits.
    pub codes: Vec<Code>,
    /// Codes or bits without a name of their own.
    pub ranges: Vec<CodeRange>,
}

impl Enumeration {
    /// Checks that no code and no name is defined twice; `names` are those of the codes, in order.
    fn unique<'a>(&self, names: impl Iterator<Item = &'a Name>, resolver: &mut Resolver<'_>) {
        for (at, (code, name)) in self.codes.iter().zip(names).enumerate() {
            if self.codes[..at].iter().any(|known| known.code == code.code || known.name == code.name) {
                resolver.error(code::TWICE, name.span(), "name", "the code or its name is defined twice");
            }
        }
    }
}

/// The code of the name that `key` has, of the names and codes of a set.
fn named_code<'c>(
    codes: impl Iterator<Item = (&'c str, u32)> + Clone,
    set_name: &str,
    key: &str,
    name: &Name,
    resolver: &mut Resolver<'_>,
) -> Option<u32> {
    let find = |text: &str| codes.clone().find(|(known, _)| *known == text).map(|(_, code)| code);
    let known = codes.clone().map(|(known, _)| known);
    resolver.name(key, name, &format!("a name of {set_name}"), find, known)
}

/// All dictionaries.
#[derive(Debug, Clone, Default)]
pub struct Dictionaries {
    /// The generic model.
    pub generic: GenericDictionary,
    /// CIP Motion.
    pub cip: CipDictionary,
    /// SERCOS.
    pub sercos: SercosDictionary,
    /// CANopen with the drive profile CiA 402.
    pub cia402: Cia402Dictionary,
}

impl Dictionaries {
    pub(super) fn resolve(tables: &Tables, errors: &mut Findings) -> Self {
        Self {
            generic: GenericDictionary::resolve(&tables.generic, errors),
            cip: CipDictionary::resolve(tables, errors),
            sercos: SercosDictionary::resolve(tables, errors),
            cia402: Cia402Dictionary::resolve(tables, errors),
        }
    }
}
