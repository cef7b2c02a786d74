//! The generic dictionary as a table.

use super::sheet::{Cell, Sheet};
use crate::mapping::{GenericParameter, Mapping, Places};

/// What a parameter is; that of an overlay has its range here.
fn note(row: &GenericParameter) -> String {
    match row.range {
        None => row.description.clone(),
        Some((low, high)) => format!("{} Range: {low} to {high}.", row.description).trim_start().to_owned(),
    }
}

/// Where a value is on each side.
fn places(places: &Places) -> [Cell; 4] {
    let side = |side: &[String]| side.join(", ").as_str().into();
    [side(&places.cip), places.gateway.into(), side(&places.sercos), side(&places.cia402)]
}

/// Parameters, by number, and the signals of the process image, which have none, with where each is on both sides.
pub fn instance(mapping: &Mapping) -> Sheet {
    const COLUMNS: &[&str] = &[
        "id",
        "name",
        "kind",
        "quantity",
        "unit",
        "data_type",
        "access",
        "cip",
        "gateway",
        "sercos",
        "cia402",
        "note",
    ];
    let dictionary = &mapping.dictionaries.generic;
    let parameters = dictionary.parameters().iter().map(|row| {
        let [cip, gateway, sercos, cia402] = places(&mapping.places_of_parameter(row.parameter));
        vec![
            row.parameter.0.into(),
            row.name.as_str().into(),
            "parameter".into(),
            row.quantity.name().into(),
            row.quantity.unit().into(),
            row.kind.name().into(),
            row.access.name().into(),
            cip,
            gateway,
            sercos,
            cia402,
            note(row).as_str().into(),
        ]
    });
    let signals = dictionary.signals().iter().map(|signal| {
        let [cip, gateway, sercos, cia402] = places(&mapping.places_of_signal(*signal));
        vec![
            Cell::None,
            signal.name().into(),
            "signal".into(),
            signal.quantity().name().into(),
            signal.quantity().unit().into(),
            "integer".into(),
            if signal.is_command() { "command" } else { "feedback" }.into(),
            cip,
            gateway,
            sercos,
            cia402,
            "".into(),
        ]
    });
    Sheet::new(COLUMNS, parameters.chain(signals).collect())
}
