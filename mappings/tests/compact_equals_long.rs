//! The short forms of the tables mean the same as the long one.
//!
//! Rows in groups, actions by the name of what is sent, states of CiA 402 in status rows and named values of fields are written
//! out here as rows of their own with every field by its number. What is compiled from both has to be the same.

use mappings::{
    AxisUnits, CaptureMode, Cia402Axis, CipScaling, Dictionaries, Mapping, Object, ObjectFacts, Plan,
    SercosAxis, TableTexts, Word,
};
use profile_generic::image::Signal;
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::time::DurationNs;
use toml::{Table, Value};

const KINDS: [UnitKind; 2] = [UnitKind::Rotary, UnitKind::Linear];
const CAPTURES: [CaptureMode; 3] = [CaptureMode::Off, CaptureMode::ServiceChannel, CaptureMode::Cyclic];

#[test]
fn compact_tables_compile_to_the_programs_of_the_long_ones() {
    let texts = TableTexts::embedded();
    let compact = Mapping::from_texts(&texts).unwrap();
    let (texts, written_out) = long(texts, &compact.dictionaries);
    // Of every short form there are some, or this test says nothing.
    assert!(written_out.groups > 100, "{written_out:?}");
    assert!(
        written_out.commands > 10 && written_out.states > 10 && written_out.values > 10,
        "{written_out:?}"
    );
    let long = Mapping::from_texts(&texts).unwrap();

    let (of_compact, of_long) = (programs(&compact), programs(&long));
    assert!(of_compact.len() > 1_000, "{} programs", of_compact.len());
    for (compact, long) in of_compact.iter().zip(&of_long) {
        assert_eq!(compact, long);
    }
    assert_eq!(of_compact.len(), of_long.len());
}

/// What was written out, by short form.
#[derive(Debug, Default)]
struct WrittenOut {
    groups: usize,
    commands: usize,
    states: usize,
    values: usize,
}

/// The mapping tables and those of the families in the long form.
fn long(mut texts: TableTexts, dictionaries: &Dictionaries) -> (TableTexts, WrittenOut) {
    let mut done = WrittenOut::default();
    for (name, text) in [
        ("cip-generic", &mut texts.cip_generic.text),
        ("generic-sercos", &mut texts.generic_sercos.text),
        ("generic-cia402", &mut texts.generic_cia402.text),
    ] {
        let mut table: Table = text.parse().unwrap();
        write_out(name, &mut table, dictionaries, &mut done);
        *text = table.to_string();
    }
    for family in &mut texts.families {
        let mut tables: Table = family.text.parse().unwrap();
        for (name, rows) in tables.iter_mut() {
            if let Value::Table(rows) = rows {
                write_out(name, rows, dictionaries, &mut done);
            }
        }
        family.text = tables.to_string().into();
    }
    (texts, done)
}

fn write_out(name: &str, table: &mut Table, dictionaries: &Dictionaries, done: &mut WrittenOut) {
    for (section, rows) in table.iter_mut() {
        let Value::Array(rows) = rows else { continue };
        let short = std::mem::take(rows);
        for row in short {
            match row {
                Value::Table(mut group) if group.contains_key("rows") => {
                    let Some(Value::Array(members)) = group.remove("rows") else { panic!("{group}: rows") };
                    done.groups += 1;
                    for member in members {
                        let Value::Table(member) = member else { panic!("{member}: no row") };
                        let mut single = group.clone();
                        single.extend(member);
                        rows.push(Value::Table(single));
                    }
                }
                row => rows.push(row),
            }
        }
        for row in rows.iter_mut().filter_map(Value::as_table_mut) {
            match name {
                "generic-sercos" => sercos_row(section, row, dictionaries, done),
                "generic-cia402" => cia402_row(section, row, dictionaries, done),
                _ => {}
            }
        }
    }
}

/// Fields with their numbers, those that stand in the row already before the others.
fn add_fields(row: &mut Table, key: &str, fields: impl Iterator<Item = (String, i64)>) {
    let mut pattern = match row.remove(key) {
        Some(Value::Array(pattern)) => pattern,
        _ => Vec::new(),
    };
    for (field, is) in fields {
        if !pattern.iter().any(|known| known["field"].as_str() == Some(&field)) {
            let mut of_field = Table::new();
            of_field.insert("field".to_owned(), Value::String(field));
            of_field.insert("is".to_owned(), Value::Integer(is));
            pattern.push(Value::Table(of_field));
        }
    }
    row.insert(key.to_owned(), Value::Array(pattern));
}

fn bits(first: u32, last: u32) -> i64 {
    (first..=last).fold(0, |mask, bit| mask | 1 << bit)
}

fn sercos_row(section: &str, row: &mut Table, dictionaries: &Dictionaries, done: &mut WrittenOut) {
    let known = &dictionaries.sercos;
    let control: &Word = known.word("Drive control").unwrap();
    let status: &Word = known.word("Drive status").unwrap();
    let word = match section {
        "action" => control,
        "report" => status,
        _ => row.get("word").and_then(Value::as_str).and_then(|name| known.word(name)).unwrap_or(status),
    };
    if let Some(Value::String(name)) = row.remove("send") {
        let named = word.patterns.iter().find(|pattern| pattern.value.name == name).unwrap();
        let (low, high) = named.bits;
        let fields = word.fields.iter().filter_map(|field| match field.parts.as_slice() {
            &[(first, last)] if low <= first && last <= high => {
                let value = i64::from(named.value.value << low) >> first & bits(0, last - first);
                Some((field.name.clone()?, value))
            }
            _ => None,
        });
        add_fields(row, "pattern", fields);
        done.commands += 1;
    }
    for of_field in row.get_mut("pattern").and_then(Value::as_array_mut).into_iter().flatten() {
        let Some(Value::String(name)) = of_field.get("is").cloned() else { continue };
        let field = of_field["field"].as_str().unwrap().to_owned();
        let value = word.values(&field).iter().find(|value| value.name == name).unwrap();
        of_field["is"] = Value::Integer(value.value.into());
        done.values += 1;
    }
}

fn cia402_row(section: &str, row: &mut Table, dictionaries: &Dictionaries, done: &mut WrittenOut) {
    let set = |name| &dictionaries.cia402.codes(name).unwrap().codes;
    let single = |word| {
        let bits =
            set(word).iter().filter(|bit| bit.modes.is_empty() && bit.last == u32::try_from(bit.code).ok());
        bits.map(|bit| (bit.name.clone(), bit.code))
    };
    if let Some(Value::String(name)) = row.remove("send") {
        let command = set("Command").iter().find(|command| command.name == name).unwrap();
        let fields = single("Controlword").map(|(field, bit)| (field, command.code >> bit & 1));
        add_fields(row, "pattern", fields);
        done.commands += 1;
    }
    if section == "status"
        && let Some(Value::String(name)) = row.remove("state")
    {
        let state = set("State").iter().find(|state| state.name == name).unwrap();
        let mask = i64::from(state.mask.unwrap());
        let fields = single("Statusword").filter(|(_, bit)| mask >> bit & 1 != 0);
        let fields: Vec<_> = fields.map(|(field, bit)| (field, state.code >> bit & 1)).collect();
        assert_eq!(fields.len(), usize::try_from(mask.count_ones()).unwrap(), "{name}");
        add_fields(row, "pattern", fields.into_iter());
        done.states += 1;
    }
}

/// All that can be compiled, as text, which has every value.
fn programs(mapping: &Mapping) -> Vec<String> {
    let mut all = Vec::new();
    for kind in KINDS {
        cip_programs(mapping, kind, &mut all);
        sercos_programs(mapping, kind, &mut all);
        for tables in [mapping].into_iter().chain(mapping.families().iter().map(|family| &family.mapping)) {
            cia402_programs(tables, kind, &mut all);
        }
    }
    all
}

fn cip_programs(mapping: &Mapping, kind: UnitKind, all: &mut Vec<String>) {
    for (counts_per_unit, inverted) in [(10_000, false), (10_000, true), (1_000_000, false)] {
        for unwind in [None, Some(counts_per_unit)] {
            let scaling = CipScaling { kind, nanounits_per_unit: NANO, counts_per_unit, inverted, unwind };
            all.push(format!("{:#?}", mapping.cip_program(&scaling).unwrap()));
            all.push(format!("{:#?}", mapping.attribute_definitions(&scaling).unwrap()));
        }
    }
}

fn sercos_programs(mapping: &Mapping, kind: UnitKind, all: &mut Vec<String>) {
    let homing = [InterpolationSource::Drive, InterpolationSource::Controller]
        .map(|interpolation| ModeSelection { mode: OperatingMode::Homing, interpolation });
    for captures in CAPTURES {
        for [modulo, set_scaling, silent] in
            [0_u8, 1, 2, 3, 4, 5, 6, 7].map(|n| [0, 1, 2].map(|bit| n >> bit & 1 != 0))
        {
            let axis = SercosAxis {
                units: AxisUnits { kind, ..AxisUnits::default() },
                modes: mapping.drive_modes().chain(homing).collect(),
                any_mode: true,
                modulo,
                set_scaling,
                captures,
                silent,
                ..SercosAxis::default()
            };
            // A drive that is left alone has the scaling already.
            let scaled = SercosAxis { set_scaling: true, ..axis.clone() };
            let facts = mapping.facts_of_obedient(&scaled).unwrap();
            all.push(format!("{:#?}", mapping.sercos_program(&axis, &facts).unwrap()));
            all.extend(
                [2, 3, 4].map(|phase| format!("{:#?}", mapping.commissioning(&axis, phase, &facts).unwrap())),
            );
        }
    }
}

fn cia402_programs(mapping: &Mapping, kind: UnitKind, all: &mut Vec<String>) {
    let object = |index, sub| Object { index, sub };
    for captures in CAPTURES {
        for (acknowledges, tells_voltage) in [(false, false), (false, true), (true, false), (true, true)] {
            let axis = Cia402Axis {
                units: AxisUnits { kind, ..AxisUnits::default() },
                modes: mapping.cia402.modes().collect(),
                any_mode: true,
                cycle: DurationNs::from_millis(2),
                acknowledges: Some(acknowledges),
                tells_voltage: Some(tells_voltage),
                way_of_a_turn: Ratio::new(10, 1),
                offsets: Signal::OFFSETS.to_vec(),
                captures,
                ..Cia402Axis::default()
            };
            for polarity in [0, 0xC0] {
                let mut facts = ObjectFacts::new();
                facts.note_data(object(0x6502, 0), &0x3FF_u32.to_le_bytes());
                facts.note_data(object(0x607E, 0), &[polarity]);
                for (index, value) in [(0x6092, 3600_u32), (0x6096, 1)] {
                    facts.note_data(object(index, 1), &value.to_le_bytes());
                    facts.note_data(object(index, 2), &1_u32.to_le_bytes());
                }
                all.push(format!("{:#?}", mapping.cia402_program(&axis, &facts).unwrap()));
                all.extend(
                    [Plan::Ask, Plan::Tell]
                        .map(|plan| format!("{:#?}", mapping.cia402_steps(plan, &axis, &facts).unwrap())),
                );
            }
        }
    }
}
