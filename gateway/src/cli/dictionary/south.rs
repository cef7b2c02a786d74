//! The SERCOS and the generic dictionary as tables.

use super::sheet::{Cell, Sheet};
use crate::mapping::{GenericDictionary, IdnUnit, SercosDictionary, SercosIdn};

/// Parameters and procedure commands.
pub fn idns(dictionary: &SercosDictionary) -> Sheet {
    const COLUMNS: &[&str] = &[
        "idn",
        "name",
        "length",
        "list",
        "format",
        "command",
        "unit",
        "decimals",
        "scaling",
        "write",
        "source",
        "confidence",
        "note",
    ];
    let row = |row: &SercosIdn| {
        let (unit, decimals, scaling) = match &row.unit {
            IdnUnit::None => ("", None, ""),
            IdnUnit::Fixed { unit, decimals } => (unit.as_str(), Some(*decimals), ""),
            IdnUnit::Scaled(quantity) => ("", None, quantity.as_str()),
        };
        vec![
            row.idn.to_string().into(),
            (&row.name).into(),
            row.length.into(),
            row.list.into(),
            row.format.map(|format| format.name()).into(),
            row.command.into(),
            unit.into(),
            decimals.into(),
            scaling.into(),
            row.write.as_deref().map(phases).into(),
            (&row.source).into(),
            (&row.confidence).into(),
            (&row.note).into(),
        ]
    };
    Sheet::new(COLUMNS, dictionary.idns().iter().map(row).collect())
}

/// The communication phases in which an IDN can be written; `read only` when there are none.
fn phases(write: &[u8]) -> String {
    if write.is_empty() {
        return "read only".to_owned();
    }
    write.iter().map(|phase| format!("CP{phase}")).collect::<Vec<_>>().join(" ")
}

/// Codes, and the fields of words.
pub fn codes(dictionary: &SercosDictionary) -> Sheet {
    const COLUMNS: &[&str] = &["set", "value", "last", "name", "kind", "idn", "source"];
    let codes = dictionary.enumerations().iter().flat_map(|set| {
        set.codes.iter().map(move |code| {
            vec![
                (&set.name).into(),
                code.code.into(),
                Cell::None,
                (&code.name).into(),
                "enum".into(),
                "".into(),
                (&set.source).into(),
            ]
        })
    });
    let fields = dictionary.words().iter().flat_map(|word| {
        word.fields.iter().map(move |(name, low, high)| {
            vec![
                (&word.name).into(),
                (*low).into(),
                (*high).into(),
                name.into(),
                "bit".into(),
                word.idn.to_string().into(),
                (&word.source).into(),
            ]
        })
    });
    Sheet::new(COLUMNS, codes.chain(fields).collect())
}

/// Parameters, by number, and the signals of the process image, which have none.
pub fn generic(dictionary: &GenericDictionary) -> Sheet {
    const COLUMNS: &[&str] = &["id", "name", "kind", "quantity", "unit", "data_type", "access", "note"];
    let parameters = dictionary.parameters().iter().map(|row| {
        vec![
            row.parameter.0.into(),
            row.parameter.name().into(),
            "parameter".into(),
            row.quantity.name().into(),
            row.quantity.unit().into(),
            row.kind.name().into(),
            row.access.name().into(),
            row.description.into(),
        ]
    });
    let signals = dictionary.signals().iter().map(|signal| {
        vec![
            Cell::None,
            signal.name().into(),
            "signal".into(),
            signal.quantity().name().into(),
            signal.quantity().unit().into(),
            "integer".into(),
            if signal.is_command() { "command" } else { "feedback" }.into(),
            "".into(),
        ]
    });
    Sheet::new(COLUMNS, parameters.chain(signals).collect())
}
