//! The attributes of the class that say what the device itself is: how many axes and which attributes and services it has, and how
//! good its time is. Clause 5-2.2; attributes 2 to 7 are those of every class (Volume 1, chapter 4).

use super::{AttributeDefinition, AttributeTable, DefaultValue, ElementRule, Scope, id};
use crate::wire::motion::codes::MotionService;

/// Sync Threshold of a controller, ns: as little as a clock can tell, up to a second.
const SYNC_THRESHOLD: (f64, f64) = (1.0, 1e9);

/// What the attributes of the class are made of.
pub(in crate::device) struct ClassFacts<'t> {
    pub axes: usize,
    /// The attributes of the axes.
    pub axis_table: &'t AttributeTable,
    pub supports_sync: bool,
    /// Sync Threshold that the clock of the device works with, ns; `None` if it measures nothing.
    pub sync_threshold: Option<u32>,
}

/// The definitions of the class with what they say of the device. Those that this device cannot serve are left out.
pub(in crate::device) fn complete(
    definitions: &[AttributeDefinition],
    facts: &ClassFacts<'_>,
) -> Vec<AttributeDefinition> {
    let mut class: Vec<_> = definitions.iter().filter(|row| row.scope == Scope::Class).cloned().collect();
    if facts.sync_threshold.is_none() {
        class.retain(|row| !matches!(row.id, id::SYNC_VARIANCE | id::SYNC_THRESHOLD | id::SYNC_UPDATE_DELAY));
    }
    let last = class.iter().map(|row| row.id).max().unwrap_or(0).max(id::CONNECTION_CONFIGURATION_BITS);
    let axes = i64::try_from(facts.axes).unwrap_or(i64::MAX);
    for row in &mut class {
        match row.id {
            id::MAX_INSTANCE | id::NUMBER_OF_INSTANCES => row.default = DefaultValue::Integer(axes),
            id::OPTIONAL_ATTRIBUTE_LIST => {
                let optional = facts.axis_table.iter().filter(|row| row.is_optional);
                list(row, optional.map(|row| row.id).collect());
            }
            id::OPTIONAL_SERVICE_LIST => {
                let group_sync = facts.supports_sync.then_some(u16::from(MotionService::GROUP_SYNC.0));
                list(row, group_sync.into_iter().collect());
            }
            id::MAX_CLASS_ATTRIBUTE => row.default = DefaultValue::Integer(last.into()),
            id::MAX_INSTANCE_ATTRIBUTE => {
                let last = facts.axis_table.iter().map(|row| row.id).max();
                row.default = DefaultValue::Integer(last.unwrap_or(0).into());
            }
            id::SYNC_VARIANCE => row.default = DefaultValue::Integer(u32::MAX.into()),
            id::SYNC_THRESHOLD => {
                row.default = DefaultValue::Integer(facts.sync_threshold.unwrap_or(0).into());
                row.range = Some(SYNC_THRESHOLD);
            }
            _ => {}
        }
    }
    class
}

/// A number of entries, and the entries.
fn list(row: &mut AttributeDefinition, mut entries: Vec<u16>) {
    entries.sort_unstable();
    let count = u16::try_from(entries.len()).unwrap_or(u16::MAX - 1);
    entries.insert(0, count);
    row.elements = Some(count + 1);
    let fixed = |entry: u16| {
        let default = DefaultValue::Integer(entry.into());
        ElementRule { default, range: (f64::from(entry), f64::from(entry)), keeps: None }
    };
    row.element_rules = entries.into_iter().map(fixed).collect();
}

#[cfg(test)]
mod tests {
    use super::super::{Access, AttributeStore, DataType};
    use super::*;

    fn definitions() -> Vec<AttributeDefinition> {
        let class = |id, data_type, access| AttributeDefinition::new(Scope::Class, id, data_type, access, "");
        let axis = |id, is_optional| AttributeDefinition {
            is_optional,
            ..AttributeDefinition::new(Scope::Instance, id, DataType::Real, Access::Set, "")
        };
        let numbers = [
            id::MAX_INSTANCE,
            id::NUMBER_OF_INSTANCES,
            id::OPTIONAL_ATTRIBUTE_LIST,
            id::OPTIONAL_SERVICE_LIST,
            id::MAX_CLASS_ATTRIBUTE,
            id::MAX_INSTANCE_ATTRIBUTE,
        ];
        let mut all: Vec<_> = numbers.map(|id| class(id, DataType::Uint, Access::Get)).into();
        all.push(class(id::SYNC_VARIANCE, DataType::Udint, Access::Get));
        all.push(class(id::SYNC_THRESHOLD, DataType::Udint, Access::Set));
        all.push(class(id::SYNC_UPDATE_DELAY, DataType::Real, Access::Get));
        all.extend([axis(900, true), axis(441, true), axis(442, false)]);
        all
    }

    fn class_of(supports_sync: bool, sync_threshold: Option<u32>) -> (AttributeTable, AttributeStore) {
        let axis_table = AttributeTable::new(Scope::Instance, &definitions()).unwrap();
        let facts = ClassFacts { axes: 3, axis_table: &axis_table, supports_sync, sync_threshold };
        let table = AttributeTable::new(Scope::Class, &complete(&definitions(), &facts)).unwrap();
        let store = AttributeStore::new(&table);
        (table, store)
    }

    #[test]
    fn the_class_says_what_the_device_has() {
        let (table, store) = class_of(true, Some(10_000));
        let value = |id| {
            let entry = table.find(id).unwrap();
            store.get(entry, entry.whole()).unwrap().to_vec()
        };
        assert_eq!(value(id::MAX_INSTANCE), [3, 0]);
        assert_eq!(value(id::NUMBER_OF_INSTANCES), [3, 0]);
        assert_eq!(value(id::OPTIONAL_ATTRIBUTE_LIST), [2, 0, 0xB9, 1, 0x84, 3], "441 and 900");
        assert_eq!(value(id::OPTIONAL_SERVICE_LIST), [1, 0, 0x1C, 0]);
        assert_eq!(value(id::MAX_CLASS_ATTRIBUTE), [36, 0]);
        assert_eq!(value(id::CONNECTION_CONFIGURATION_BITS), [0], "no connection");
        assert_eq!(value(id::MAX_INSTANCE_ATTRIBUTE), [0x84, 3]);
        assert_eq!(value(id::SYNC_VARIANCE), [0xFF; 4], "nothing is measured yet");
        assert_eq!(value(id::SYNC_THRESHOLD), 10_000_u32.to_le_bytes());
    }

    #[test]
    fn a_device_that_measures_no_time_has_no_attributes_of_its_quality() {
        let (table, store) = class_of(false, None);
        for id in [id::SYNC_VARIANCE, id::SYNC_THRESHOLD, id::SYNC_UPDATE_DELAY] {
            assert!(table.find(id).is_none(), "{id}");
        }
        let services = table.find(id::OPTIONAL_SERVICE_LIST).unwrap();
        assert_eq!(store.get(services, services.whole()), Ok(&[0, 0][..]));
    }

    #[test]
    fn a_threshold_can_be_anything_but_nothing() {
        let (table, _) = class_of(true, Some(10_000));
        let entry = table.find(id::SYNC_THRESHOLD).unwrap();
        let set = |value: u32| entry.check_set(entry.whole(), &value.to_le_bytes(), false).is_ok();
        assert_eq!(
            [0, 1, 2_565_904, 1_000_000_000, 1_000_000_001].map(set),
            [false, true, true, true, false]
        );
    }
}
