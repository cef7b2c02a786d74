//! Tables, values and checks together.

use super::engine::ENGINE;
use super::*;
use crate::wire::status::GeneralStatus;

fn table() -> AttributeTable {
    let set =
        |id, data_type| AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "an attribute");
    let definitions = [
        AttributeDefinition {
            range: Some((-1.0, 1.0)),
            default: DefaultValue::Real(0.5),
            settable_in_running: true,
            ..set(461, DataType::Real)
        },
        AttributeDefinition {
            elements: Some(64),
            range: Some((0.0, 4.0)),
            default: DefaultValue::Integer(3),
            ..set(672, DataType::Usint)
        },
        AttributeDefinition { default: DefaultValue::Integer(-7), ..set(100, DataType::Int) },
    ];
    AttributeTable::new(Scope::Instance, &definitions).expect("a table")
}

#[test]
fn values_start_at_their_defaults_and_return_to_them() {
    let table = table();
    let mut store = AttributeStore::new(&table);
    let real = table.find(461).expect("defined");
    assert_eq!(store.get(real, real.whole()), Ok(&0.5_f32.to_le_bytes()[..]));
    assert_eq!(store.unsigned(&table, 100), Some(u64::from((-7_i16).cast_unsigned())));
    let array = table.find(672).expect("defined");
    assert_eq!(store.put(array, Part { start: 62, count: 2 }, &[1, 2]), Ok(()));
    assert_eq!(store.get(array, Part { start: 61, count: 3 }), Ok(&[3, 1, 2][..]));
    store.reset(&table);
    assert_eq!(store.get(array, Part { start: 61, count: 3 }), Ok(&[3, 3, 3][..]));
}

#[test]
fn every_id_leads_to_its_attribute_and_no_other() {
    let number = |id| AttributeDefinition::new(Scope::Instance, id, DataType::Dint, Access::Set, "a number");
    for ids in [&[][..], &[1], &[4095, 4096], &[5, 4094, 65_535], &[65_534]] {
        let definitions: Vec<_> = ids.iter().map(|id| number(*id)).collect();
        let table = AttributeTable::new(Scope::Instance, &definitions).expect("a table");
        let known: Vec<u16> = table.iter().map(|definition| definition.id).collect();
        assert!(ids.iter().all(|id| known.contains(id)));
        for id in 0..=u16::MAX {
            let found = table.find(id).map(|entry| entry.definition.id);
            assert_eq!(found, known.contains(&id).then_some(id));
        }
    }
}

#[test]
fn changes_are_counted_when_a_value_becomes_another_one() {
    let table = table();
    let mut store = AttributeStore::new(&table);
    let entry = table.find(100).expect("it is there");
    let mut last = store.changes();
    let mut changed =
        |store: &AttributeStore| std::mem::replace(&mut last, store.changes()) != store.changes();
    store.put(entry, entry.whole(), &[0xF9, 0xFF]).expect("two octets");
    assert!(!changed(&store), "it was -7 before");
    store.put(entry, entry.whole(), &[0xF8, 0xFF]).expect("two octets");
    assert!(changed(&store));
    assert!(store.put(entry, entry.whole(), &[0]).is_err());
    assert!(!changed(&store));
    store.publish(&table, 100, 3);
    assert!(changed(&store));
    store.publish(&table, 100, 3);
    assert!(!changed(&store));
    store.reset(&table);
    assert!(changed(&store));
}

#[test]
fn a_set_is_refused_with_its_reason_and_index() {
    let table = table();
    let real = table.find(461).expect("defined");
    let array = table.find(672).expect("defined");
    let check = |entry: &Entry, part, value: &[u8], running| entry.check_set(part, value, running);
    let one = Part { start: 0, count: 1 };
    assert_eq!(check(real, one, &1.0_f32.to_le_bytes(), true), Ok(()));
    let invalid = GeneralStatus::INVALID_ATTRIBUTE_VALUE;
    assert_eq!(check(real, one, &1.5_f32.to_le_bytes(), false), Err((invalid, 0)));
    assert_eq!(check(real, one, &f32::NAN.to_le_bytes(), false), Err((invalid, 0)));
    assert_eq!(check(real, one, &[0; 3], false), Err((GeneralStatus::NOT_ENOUGH_DATA, 0)));
    assert_eq!(check(real, one, &[0; 5], false), Err((GeneralStatus::TOO_MUCH_DATA, 0)));
    assert_eq!(check(array, one, &[3], true), Err((GeneralStatus::OBJECT_STATE_CONFLICT, 0)));
    assert_eq!(check(array, Part { start: 10, count: 3 }, &[3, 5, 3], false), Err((invalid, 11)));
    let outside = Part { start: 63, count: 2 };
    assert_eq!(check(array, outside, &[3, 3], false), Err((GeneralStatus::INVALID_PARAMETER, 63)));
    let state = table.find(id::AXIS_STATE).expect("an engine attribute");
    assert_eq!(check(state, one, &[1], false), Err((GeneralStatus::ATTRIBUTE_NOT_SETTABLE, 0)));
}

#[test]
fn a_table_that_contradicts_the_engine_or_itself_is_refused() {
    let new =
        |id, data_type| AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "an attribute");
    let build = |definitions: &[AttributeDefinition]| {
        AttributeTable::new(Scope::Instance, definitions).map(|t| t.iter().count())
    };
    let expected = TableError::EngineType { scope: Scope::Instance, id: 650, expected: DataType::Usint };
    assert_eq!(build(&[new(650, DataType::Udint)]), Err(expected));
    let twice = [new(5, DataType::Int), new(5, DataType::Dint)];
    assert_eq!(build(&twice), Err(TableError::Duplicate(Scope::Instance, 5)));
    let default = AttributeDefinition { default: DefaultValue::Integer(256), ..new(7, DataType::Usint) };
    assert_eq!(build(&[default]), Err(TableError::Default(Scope::Instance, 7)));
    let limit = AttributeDefinition::new(Scope::Class, 21, DataType::Usint, Access::Set, "a limit");
    let class = AttributeTable::new(Scope::Class, &[limit]).expect("a table");
    assert_eq!(AttributeStore::new(&class).unsigned(&class, 21), Some(4), "the engine's default stands");
    let engine = ENGINE.iter().filter(|row| row.0 == Scope::Instance).count();
    assert_eq!(build(&[new(5, DataType::Int)]), Ok(engine + 1));
}

#[test]
fn numbers_of_every_type_are_read_with_their_sign() {
    let f = |data_type: DataType, octets: &[u8]| data_type.to_f64(octets);
    assert_eq!(f(DataType::Sint, &[0xFF]), Some(-1.0));
    assert_eq!(f(DataType::Usint, &[0xFF]), Some(255.0));
    assert_eq!(f(DataType::Int, &[0, 0x80]), Some(-32768.0));
    assert_eq!(f(DataType::Dint, &(-5_i32).to_le_bytes()), Some(-5.0));
    assert_eq!(f(DataType::Lint, &(-6_i64).to_le_bytes()), Some(-6.0));
    assert_eq!(f(DataType::Real, &2.5_f32.to_le_bytes()), Some(2.5));
    assert_eq!(f(DataType::Lreal, &(-0.25_f64).to_le_bytes()), Some(-0.25));
    assert_eq!(f(DataType::Dint, &[1, 2]), None);
    assert_eq!(DataType::from_name("LWORD"), Some(DataType::Lword));
    assert_eq!(DataType::from_name("SHORT_STRING"), Some(DataType::ShortString));
    assert_eq!(DataType::from_name("STRING"), None);
}
