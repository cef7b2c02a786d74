//! The CIP Motion dictionary as tables.

use super::sheet::{Cell, Sheet};
use crate::mapping::{
    CipAttribute, CipDictionary, CipService, Clearing, Enumeration, PolarityEffect, RangeKind, SetKind,
};

/// Attributes of an axis.
pub fn instance(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "id",
        "name",
        "access",
        "data_type",
        "units",
        "B",
        "E",
        "F",
        "P",
        "V",
        "T",
        "source",
        "clause",
        "group",
        "condition",
        "running",
        "polarity",
        "default",
        "min",
        "max",
        "range",
        "length",
        "channel",
        "note",
    ];
    let row = |row: &CipAttribute| {
        let mut cells = vec![
            row.id.into(),
            (&row.name).into(),
            row.access.name().into(),
            row.data_type.name().into(),
            (&row.unit).into(),
        ];
        cells.extend(row.need.chars().map(Cell::from));
        cells.extend([
            (&row.source).into(),
            (&row.clause).into(),
            (&row.group).into(),
            (&row.condition).into(),
            row.running.into(),
            polarity(row.polarity),
            row.default.into(),
            row.min.into(),
            row.max.into(),
            (&row.range).into(),
            row.length.into(),
            row.channel.into(),
            (&row.note).into(),
        ]);
        cells
    };
    Sheet::new(COLUMNS, dictionary.attributes().iter().map(row).collect())
}

/// `sign`, or `swap` and the number of the attribute it changes places with.
fn polarity(effect: PolarityEffect) -> Cell {
    match effect {
        PolarityEffect::None => "".into(),
        PolarityEffect::Sign => "sign".into(),
        PolarityEffect::Swap(with) => format!("swap {with}").into(),
    }
}

/// Attributes of instance 0.
pub fn class(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "id",
        "name",
        "access",
        "data_type",
        "units",
        "need",
        "source",
        "clause",
        "group",
        "default",
        "length",
        "note",
    ];
    let row = |row: &CipAttribute| {
        vec![
            row.id.into(),
            (&row.name).into(),
            row.access.name().into(),
            row.data_type.name().into(),
            (&row.unit).into(),
            (&row.need).into(),
            (&row.source).into(),
            (&row.clause).into(),
            (&row.group).into(),
            row.default.into(),
            row.length.into(),
            (&row.note).into(),
        ]
    };
    Sheet::new(COLUMNS, dictionary.class_attributes().iter().map(row).collect())
}

/// Codes and bits, each set with what it keeps free behind what it names.
pub fn enums(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "set",
        "value",
        "name",
        "kind",
        "need",
        "source",
        "last",
        "free_for",
        "rule",
        "limits",
        "attributes",
        "class_attributes",
        "element",
        "field",
        "note",
    ];
    let sets = dictionary.enumerations().iter().chain(dictionary.bit_sets());
    let rows = sets.flat_map(|set| {
        let kind = match set.kind {
            SetKind::Codes => "enum",
            SetKind::Bits { .. } => "bit",
        };
        values(set).map(move |value| {
            vec![
                (&set.name).into(),
                value.first.into(),
                value.name.into(),
                kind.into(),
                value.need.map_or("".into(), Cell::from),
                (&set.source).into(),
                value.last.into(),
                value.free_for.into(),
                value.rule.into(),
                numbers(value.limits).into(),
                numbers(&set.attributes).into(),
                numbers(&set.class_attributes).into(),
                (&set.element).into(),
                set.field.map_or("".into(), |(low, high)| format!("{low}-{high}").into()),
                joined(&[&set.note, value.note]).into(),
            ]
        })
    });
    Sheet::new(COLUMNS, rows.collect())
}

/// A code, a bit or a range of them.
struct Value<'a> {
    first: u32,
    /// The last of a range.
    last: Option<u32>,
    name: &'a str,
    /// What a range is free for; empty for a single code.
    free_for: &'static str,
    need: Option<char>,
    rule: &'a str,
    limits: &'a [u16],
    note: &'a str,
}

fn values(set: &Enumeration) -> impl Iterator<Item = Value<'_>> {
    let named = set.codes.iter().map(|code| Value {
        first: code.code,
        last: None,
        name: &code.name,
        free_for: "",
        need: code.need,
        rule: &code.rule,
        limits: &code.limits,
        note: &code.note,
    });
    let free = set.ranges.iter().map(|range| Value {
        first: range.first,
        last: Some(range.last),
        name: &range.name,
        free_for: word(RangeKind::NAMED, range.kind),
        need: range.need,
        rule: "",
        limits: &[],
        note: &range.note,
    });
    named.chain(free)
}

/// The word of the files for `value`.
fn word<T: PartialEq>(words: &[(&'static str, T)], value: T) -> &'static str {
    words.iter().find(|(_, known)| *known == value).map_or("", |(word, _)| word)
}

fn numbers(ids: &[u16]) -> String {
    ids.iter().map(u16::to_string).collect::<Vec<_>>().join(" ")
}

/// Conditions of every type of fault, alarm and inhibit, and of the node.
pub fn faults(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "code",
        "name",
        "set",
        "fault_type",
        "alarm_type",
        "latched",
        "configurable",
        "major",
        "cleared_by",
        "rule",
        "limits",
        "seven_segment",
        "display",
        "source",
        "last",
        "free_for",
        "note",
    ];
    let mut rows = Vec::new();
    for record in dictionary.fault_records() {
        let set = dictionary.bits(&record.conditions).or_else(|| dictionary.enumeration(&record.conditions));
        let Some(set) = set else { continue };
        let cleared: Vec<&str> = record.cleared_by.iter().map(|way| word(Clearing::NAMED, *way)).collect();
        rows.extend(values(set).map(|value| {
            vec![
                value.first.into(),
                value.name.into(),
                (&set.name).into(),
                record.fault_type.into(),
                record.alarm_type.into(),
                record.latched.into(),
                record.configurable.into(),
                record.major.into(),
                cleared.join(" ").into(),
                value.rule.into(),
                numbers(value.limits).into(),
                (&record.seven_segment).into(),
                (&record.display).into(),
                joined(&[&set.source, &record.source]).into(),
                value.last.into(),
                value.free_for.into(),
                joined(&[value.note, &record.note]).into(),
            ]
        }));
    }
    Sheet::new(COLUMNS, rows)
}

fn joined(texts: &[&str]) -> String {
    let said: Vec<&str> = texts.iter().copied().filter(|text| !text.is_empty()).collect();
    said.join("; ")
}

/// Services of instance 0 and of an axis.
pub fn services(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "code",
        "name",
        "class",
        "B",
        "E",
        "F",
        "P",
        "V",
        "T",
        "source",
        "clause",
        "explicit",
        "service_data_block",
        "request",
        "response",
        "states",
        "errors",
        "note",
    ];
    let row = |row: &CipService| {
        let mut cells = vec![
            format!("{:#04X}", row.code).replace("0X", "0x").into(),
            (&row.name).into(),
            row.class.into(),
        ];
        cells.extend(row.instance.chars().map(Cell::from));
        cells.extend([
            (&row.source).into(),
            (&row.clause).into(),
            row.explicit.into(),
            row.service_data_block.into(),
            row.request.join("; ").into(),
            row.response.join("; ").into(),
            (&row.states).into(),
            (&row.errors).into(),
            (&row.note).into(),
        ]);
        cells
    };
    Sheet::new(COLUMNS, dictionary.services().iter().map(row).collect())
}

/// Object classes and I/O connection on each network: a row for each class, with the connection repeated.
pub fn networks(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "network",
        "class",
        "name",
        "need",
        "instances",
        "per",
        "interface",
        "formats",
        "transport_class",
        "trigger",
        "priority",
        "axes_min",
        "axes_max",
        "udp_port",
        "paths",
        "source",
        "clause",
        "note",
    ];
    let mut rows = Vec::new();
    for network in dictionary.networks() {
        let formats = network
            .formats
            .iter()
            .map(|(format, axes)| format!("{} for {} to {} axes", format.name(), axes.start(), axes.end()));
        let formats = formats.collect::<Vec<_>>().join("; ");
        for object in &network.objects {
            let notes = [object.note.as_str(), network.note.as_str()];
            let note = notes.into_iter().filter(|note| !note.is_empty()).collect::<Vec<_>>().join("; ");
            rows.push(vec![
                (&network.name).into(),
                format!("{:#04X}", object.class).replace("0X", "0x").into(),
                (&object.name).into(),
                if object.required { "R" } else { "O" }.into(),
                object.instances.into(),
                if object.per_axis { "axis" } else { "node" }.into(),
                object.interface.join("; ").into(),
                formats.clone().into(),
                network.transport_class.into(),
                (&network.trigger).into(),
                (&network.priority).into(),
                (*network.axes.start()).into(),
                (*network.axes.end()).into(),
                network.udp_port.into(),
                (&network.paths).into(),
                format!("IEC 61800-7-302 {}", network.table).into(),
                format!("{}, {}", network.table_clause, network.clause).into(),
                note.into(),
            ]);
        }
    }
    Sheet::new(COLUMNS, rows)
}
