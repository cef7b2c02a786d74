//! The CiA 402 dictionary as tables.

use super::sheet::{Cell, Sheet};
use crate::mapping::{Cia402CodeSet, Cia402Dictionary, Cia402Object, Cia402SetKind, Cia402Sub};

/// Values of objects: a row for each sub-object, and one for each object that has no more than a number.
pub fn objects(dictionary: &Cia402Dictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "index",
        "sub",
        "name",
        "data_type",
        "access",
        "pdo",
        "unit",
        "default",
        "object",
        "kind",
        "category",
        "modes",
        "last_index",
        "last_sub",
        "source",
        "confidence",
        "note",
    ];
    let rows = dictionary.objects().iter().flat_map(|object| object.subs.iter().map(|sub| row(object, sub)));
    Sheet::new(COLUMNS, rows.collect())
}

fn row(object: &Cia402Object, sub: &Cia402Sub) -> Vec<Cell> {
    let default = sub.default.map(|default| match sub.plus_node {
        true => format!("{default:#x} + node"),
        false => default.to_string(),
    });
    vec![
        hex(object.index.into(), 4).into(),
        sub.sub.into(),
        (&sub.name).into(),
        sub.data_type.map(|data_type| data_type.name()).into(),
        sub.access.map(|access| access.name()).into(),
        sub.pdo.map(|pdo| pdo.name()).into(),
        (&sub.unit).into(),
        default.into(),
        (&object.name).into(),
        object.kind.name().into(),
        object.category.map(|category| category.name()).into(),
        object.modes.join(" ").into(),
        (object.last != object.index).then(|| hex(object.last.into(), 4)).into(),
        (sub.last != sub.sub).then_some(sub.last).into(),
        (&object.trust.source).into(),
        object.trust.confidence.name().into(),
        joined(&[&sub.note, &object.note]).into(),
    ]
}

/// Codes, bits and states, each set with its ranges and classes behind what has a name of its own.
pub fn codes(dictionary: &Cia402Dictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "set",
        "code",
        "last",
        "mask",
        "name",
        "kind",
        "modes",
        "class",
        "objects",
        "element",
        "source",
        "confidence",
        "note",
    ];
    let mut rows = Vec::new();
    for set in dictionary.code_sets() {
        let objects = set.objects.iter().map(|index| hex((*index).into(), 4)).collect::<Vec<_>>().join(" ");
        let tail = |source: &str, confidence: &'static str, note: String| -> [Cell; 5] {
            [objects.clone().into(), (&set.element).into(), source.into(), confidence.into(), note.into()]
        };
        let kind = match set.kind {
            Cia402SetKind::Codes => "code",
            Cia402SetKind::Bits => "bit",
            Cia402SetKind::States => "state",
        };
        for code in &set.codes {
            let last = code.last.map(i64::from).filter(|last| *last != code.code);
            let mut cells: Vec<Cell> = vec![
                (&set.name).into(),
                number(set, code.code).into(),
                last.into(),
                code.mask.map(|mask| hex(mask.into(), 4)).into(),
                (&code.name).into(),
                kind.into(),
                code.modes.join(" ").into(),
                set.class_of(code.code).unwrap_or_default().into(),
            ];
            let trust = &code.trust;
            cells.extend(tail(&trust.source, trust.confidence.name(), joined(&[&code.note, &set.note])));
            rows.push(cells);
        }
        let ranges = set.ranges.iter().map(|range| (range.first, range.last, &range.name, range.kind.name()));
        let classes = set.classes.iter().map(|class| (class.first, class.last, &class.name, "class"));
        for (first, last, name, kind) in ranges.chain(classes) {
            let mut cells: Vec<Cell> = vec![
                (&set.name).into(),
                number(set, first).into(),
                number(set, last).into(),
                Cell::None,
                name.into(),
                kind.into(),
                "".into(),
                "".into(),
            ];
            cells.extend(tail(&set.trust.source, set.trust.confidence.name(), set.note.clone()));
            rows.push(cells);
        }
    }
    Sheet::new(COLUMNS, rows)
}

/// A code as one reads it: bits and what can be negative as numbers, long codes with all their digits.
fn number(set: &Cia402CodeSet, code: i64) -> String {
    let negative = set.codes.iter().map(|code| code.code).chain(set.ranges.iter().map(|range| range.first));
    let all = set.codes.iter().map(|code| code.code).chain(set.ranges.iter().map(|range| range.last));
    let most = all.max().unwrap_or_default();
    match set.kind {
        Cia402SetKind::Bits => code.to_string(),
        _ if negative.min().unwrap_or_default() < 0 || most <= 0xFF => code.to_string(),
        _ if most <= 0xFFFF => hex(code, 4),
        _ => hex(code, 8),
    }
}

fn hex(number: i64, digits: usize) -> String {
    format!("0x{number:0digits$X}")
}

fn joined(texts: &[&str]) -> String {
    let said: Vec<&str> = texts.iter().copied().filter(|text| !text.is_empty()).collect();
    said.join("; ")
}
