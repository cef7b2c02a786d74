//! The SERCOS dictionary as tables.

use profile_sercos::wire::idn::Idn;

use super::sheet::{Cell, Sheet};
use crate::mapping::{
    CodeSet, Field, FieldValue, IdnPart, IdnUnit, SercosDictionary, SercosIdn, Trust, Word,
};

/// Parameters and procedure commands, of one list or of both.
pub fn idns(dictionary: &SercosDictionary, part: Option<IdnPart>) -> Sheet {
    const COLUMNS: &[&str] = &[
        "idn",
        "name",
        "length",
        "list",
        "format",
        "command",
        "decimals",
        "unit",
        "scaling",
        "write",
        "cyclic",
        "group",
        "clause",
        "source",
        "confidence",
        "attribute",
        "range",
        "note",
    ];
    let row = |row: &SercosIdn| {
        let (unit, scaling) = match &row.unit {
            IdnUnit::None => ("", ""),
            IdnUnit::Fixed { unit, .. } => (unit.as_str(), ""),
            IdnUnit::Scaled(quantity) => ("", quantity.as_str()),
        };
        vec![
            row.number().into(),
            (&row.name).into(),
            row.length.into(),
            row.list.into(),
            row.format.map(|format| format.name()).into(),
            row.command.into(),
            row.decimals.into(),
            unit.into(),
            scaling.into(),
            row.write.as_deref().map(phases).into(),
            cyclic(row).into(),
            (&row.group).into(),
            (&row.clause).into(),
            (&row.source).into(),
            row.confidence.name().into(),
            row.attribute.map(|word| format!("0x{word:08X}")).into(),
            (&row.range).into(),
            (&row.note).into(),
        ]
    };
    let rows = dictionary.idns().iter().filter(|row| part.is_none_or(|part| row.part == part));
    Sheet::new(COLUMNS, rows.map(row).collect())
}

/// The communication phases in which an IDN can be written; `read only` when there are none.
fn phases(write: &[u8]) -> String {
    if write.is_empty() {
        return "read only".to_owned();
    }
    write.iter().map(|phase| format!("CP{phase}")).collect::<Vec<_>>().join(" ")
}

/// The telegrams that can carry an IDN, with who says so.
fn cyclic(row: &SercosIdn) -> String {
    let said =
        [("AT", &row.in_at), ("MDT", &row.in_mdt)].into_iter().filter(|(_, source)| !source.is_empty());
    said.map(|(telegram, source)| format!("{telegram} ({source})")).collect::<Vec<_>>().join("; ")
}

/// The fields of words, each with its values behind it, and the patterns of several fields.
pub fn bits(dictionary: &SercosDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "idns",
        "word",
        "layout",
        "bits",
        "value",
        "name",
        "kind",
        "codes",
        "element",
        "source",
        "confidence",
        "note",
    ];
    let mut rows = Vec::new();
    for word in dictionary.words() {
        for field in &word.fields {
            rows.push(field_row(dictionary, word, field));
            rows.extend(
                field.values.iter().map(|value| value_row(dictionary, word, field.bits(), value, "value")),
            );
        }
        let patterns = word.patterns.iter();
        rows.extend(patterns.map(|row| value_row(dictionary, word, row.bits(), &row.value, "pattern")));
    }
    Sheet::new(COLUMNS, rows)
}

fn field_row(dictionary: &SercosDictionary, word: &Word, field: &Field) -> Vec<Cell> {
    let kind = if field.name.is_some() { "field" } else { "reserved" };
    let name = field.name.as_deref().unwrap_or_default();
    let mut row = vec![
        numbers(dictionary, &word.idns).into(),
        (&word.name).into(),
        word.layout.name().into(),
        field.bits().into(),
        Cell::None,
        name.into(),
        kind.into(),
        (&field.codes).into(),
        (&word.element).into(),
    ];
    row.extend(told(&field.trust, &joined(&[&word.note, &field.note])));
    row
}

fn value_row(
    dictionary: &SercosDictionary,
    word: &Word,
    bits: String,
    value: &FieldValue,
    kind: &'static str,
) -> Vec<Cell> {
    let mut row = vec![
        numbers(dictionary, &word.idns).into(),
        (&word.name).into(),
        word.layout.name().into(),
        bits.into(),
        value.value.into(),
        (&value.name).into(),
        kind.into(),
        "".into(),
        (&word.element).into(),
    ];
    row.extend(told(&value.trust, &value.note));
    row
}

/// Codes, each set with its groups of codes behind those with a name of their own.
pub fn codes(dictionary: &SercosDictionary) -> Sheet {
    const COLUMNS: &[&str] =
        &["set", "code", "last", "name", "kind", "idns", "element", "field", "source", "confidence", "note"];
    let mut rows = Vec::new();
    for set in dictionary.code_sets() {
        for code in &set.codes {
            let place = [hex(code.code).into(), Cell::None, (&code.name).into(), "code".into()];
            rows.push(code_row(dictionary, set, place, &code.trust, &code.note));
        }
        for group in &set.groups {
            let (first, last) = (hex(group.first), hex(group.last));
            let place = [first.into(), last.into(), (&group.name).into(), group.kind.name().into()];
            rows.push(code_row(dictionary, set, place, &group.trust, &group.note));
        }
    }
    Sheet::new(COLUMNS, rows)
}

fn code_row(
    dictionary: &SercosDictionary,
    set: &CodeSet,
    place: [Cell; 4],
    trust: &Trust,
    note: &str,
) -> Vec<Cell> {
    let mut row = vec![Cell::from(&set.name)];
    row.extend(place);
    row.extend([
        numbers(dictionary, &set.idns).into(),
        (&set.element).into(),
        set.field.map_or("".into(), |(low, high)| format!("{high}-{low}").into()),
    ]);
    row.extend(told(trust, &joined(&[&set.note, note])));
    row
}

fn hex(code: u32) -> String {
    format!("0x{code:04X}")
}

fn told(trust: &Trust, note: &str) -> [Cell; 3] {
    [(&trust.source).into(), trust.confidence.name().into(), note.into()]
}

/// The numbers of IDNs as the dictionary writes them.
fn numbers(dictionary: &SercosDictionary, idns: &[Idn]) -> String {
    let number = |idn: &Idn| dictionary.idn(*idn).map_or_else(|| idn.to_string(), SercosIdn::number);
    idns.iter().map(number).collect::<Vec<_>>().join(" ")
}

fn joined(texts: &[&str]) -> String {
    let said: Vec<&str> = texts.iter().copied().filter(|text| !text.is_empty()).collect();
    said.join("; ")
}
