//! The generic dictionary as a table.

use super::sheet::{Cell, Sheet};
use crate::mapping::{GenericDictionary, GenericParameter};

/// What a parameter is; that of an overlay has its range here.
fn note(row: &GenericParameter) -> String {
    match row.range {
        None => row.description.clone(),
        Some((low, high)) => format!("{} Range: {low} to {high}.", row.description).trim_start().to_owned(),
    }
}

/// Parameters, by number, and the signals of the process image, which have none.
pub fn instance(dictionary: &GenericDictionary) -> Sheet {
    const COLUMNS: &[&str] = &["id", "name", "kind", "quantity", "unit", "data_type", "access", "note"];
    let parameters = dictionary.parameters().iter().map(|row| {
        vec![
            row.parameter.0.into(),
            row.name.as_str().into(),
            "parameter".into(),
            row.quantity.name().into(),
            row.quantity.unit().into(),
            row.kind.name().into(),
            row.access.name().into(),
            note(row).as_str().into(),
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
