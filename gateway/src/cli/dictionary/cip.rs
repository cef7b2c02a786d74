//! The CIP Motion dictionary as tables.

use super::sheet::{Cell, Sheet};
use crate::mapping::{CipAttribute, CipDictionary, CipService, Enumeration, PolarityEffect, SetKind};

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

/// Codes and bits.
pub fn enums(dictionary: &CipDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "set",
        "value",
        "name",
        "kind",
        "need",
        "source",
        "rule",
        "attributes",
        "class_attributes",
        "element",
        "note",
    ];
    let sets = dictionary.enumerations().iter().chain(dictionary.bit_sets());
    Sheet::new(COLUMNS, sets.flat_map(codes).collect())
}

fn codes(set: &Enumeration) -> impl Iterator<Item = Vec<Cell>> {
    let kind = match set.kind {
        SetKind::Codes => "enum",
        SetKind::Bits { .. } => "bit",
    };
    let ids = |ids: &[u16]| ids.iter().map(u16::to_string).collect::<Vec<_>>().join(" ");
    set.codes.iter().map(move |code| {
        vec![
            (&set.name).into(),
            code.code.into(),
            (&code.name).into(),
            kind.into(),
            code.need.map_or("".into(), Cell::from),
            (&set.source).into(),
            (&code.rule).into(),
            ids(&set.attributes).into(),
            ids(&set.class_attributes).into(),
            (&set.element).into(),
            joined(&[&set.note, &code.note]).into(),
        ]
    })
}

fn joined(notes: &[&String]) -> String {
    let said: Vec<&str> = notes.iter().map(|note| note.as_str()).filter(|note| !note.is_empty()).collect();
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
