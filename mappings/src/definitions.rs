//! From the tables to the attributes of the CIP Motion device: what may be read and set, and what its values may be.

use profile_cip::device::attribute::{self, AttributeDefinition, DataType, DefaultValue, Scope};

use profile_generic::cast;

use super::Mapping;
use super::attributes::{AttributeTable, Backing};
use super::dictionary::{Access, CipAttribute, CipDictionary, Enumeration, SetKind};

/// The definitions of class and axis for a device. Parameters are asked of the drive, whether or not this one has them:
/// which drive there is, and what it has, is known only while it is on the bus.
pub(super) fn definitions(mapping: &Mapping, table: &AttributeTable) -> Vec<AttributeDefinition> {
    let dictionary = &mapping.dictionaries.cip;
    let class = dictionary.class_attributes().iter().filter_map(|row| {
        let sets = |set: &&Enumeration| set.class_attributes.contains(&row.id);
        definition(Scope::Class, row, dictionary, sets)
    });
    let instance = table.entries().iter().filter_map(|entry| {
        let row = dictionary.attribute_by_id(entry.id)?;
        let sets = |set: &&Enumeration| set.attributes.contains(&row.id);
        let mut definition = definition(Scope::Instance, row, dictionary, sets)?;
        if let Some(served) = mapping.cip.attributes.iter().find(|served| served.attribute.id == entry.id) {
            definition.codes.retain(|code| !served.without.contains(code));
        }
        let narrowed = entry.range.map(|(low, high)| (cast::f64_from_i64(low), cast::f64_from_i64(high)));
        definition.range = narrowed.or(definition.range);
        definition.element_rules = match entry.id {
            attribute::id::AXIS_EXCEPTION_ACTION => mapping.exception_rules(false),
            attribute::id::AXIS_EXCEPTION_ACTION_MFG => mapping.exception_rules(true),
            _ => Vec::new(),
        };
        definition.backing = match entry.backing {
            Backing::Signal { .. } => attribute::Backing::Signal,
            // Computed anew in each cycle where a list has it.
            Backing::Parameter { parameter, feedback: None, .. }
                if row.access == Access::Get && mapping.dictionaries.generic.is_cyclic(parameter) =>
            {
                attribute::Backing::Signal
            }
            Backing::Parameter { .. } | Backing::Mechanics(_) => attribute::Backing::Drive,
            Backing::Constant(value) => {
                definition.default = DefaultValue::Integer(value);
                attribute::Backing::Stored
            }
            Backing::Device | Backing::Connection | Backing::Stored => attribute::Backing::Stored,
        };
        Some(definition)
    });
    class.chain(instance).collect()
}

/// Whether an attribute with this need, a letter for each device function, is required of a device that closes a loop.
pub(crate) fn requires(need: &str) -> bool {
    need.chars().zip("BEFPVT".chars()).any(|(need, function)| need == 'R' && "PVT".contains(function))
}

/// What the standard itself says of the range; the rest of it is the drive's.
fn limits(row: &CipAttribute) -> Option<(f64, f64)> {
    let number = |limit: Option<i64>, none: f64| limit.map_or(none, cast::f64_from_i64);
    (row.min.is_some() || row.max.is_some())
        .then(|| (number(row.min, f64::NEG_INFINITY), number(row.max, f64::INFINITY)))
}

/// `holds` says whether a set of names is for this attribute.
fn definition(
    scope: Scope,
    row: &CipAttribute,
    dictionary: &CipDictionary,
    holds: impl Fn(&&Enumeration) -> bool,
) -> Option<AttributeDefinition> {
    let data_type = DataType::from_name(row.data_type.name())?;
    let access = match row.access {
        Access::Get => attribute::Access::Get,
        Access::Set => attribute::Access::Set,
        Access::SetCyclic => attribute::Access::Cyclic,
    };
    let mut definition = AttributeDefinition::new(scope, row.id, data_type, access, &row.name);
    definition.elements = row.length;
    definition.settable_in_running = row.running;
    definition.is_optional = !requires(&row.need);
    definition.default = DefaultValue::Integer(row.default.unwrap_or(0));
    definition.range = limits(row);
    // What names only a part of the value says nothing about the rest.
    let whole = |set: &&Enumeration| set.element.is_empty() && holds(set);
    if let Some(set) = dictionary.enumerations().iter().find(whole).filter(|set| set.kind == SetKind::Codes) {
        definition.codes = set.codes.iter().map(|code| code.code).collect();
        definition.codes.sort_unstable();
    }
    if let Some(set) = dictionary.bit_sets().iter().find(whole) {
        let mask = set.codes.iter().filter_map(|bit| 1_u64.checked_shl(bit.code));
        definition.bits = Some(mask.fold(0, |bits, bit| bits | bit));
    }
    Some(definition)
}
