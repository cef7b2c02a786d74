//! What the rows of CIP Motion lack.

use super::super::facts::{
    ATTRIBUTES, AXIS_STATUS, CONTROL_MODES, CYCLIC, EVENTS, INHIBITS, IO_STATUS, OWN_EVENT_STATUS,
    OWN_INHIBITS, STOPPINGS,
};
use super::{Table, is};
use crate::Mapping;
use crate::dictionary::Dictionaries;
use crate::finding::Findings;
use crate::format::{CipAttributeRow, CipGenericFile, DisplacementUnitRow};

pub(in super::super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows;
    let mut table = Table::new(&file.text, &rows.mapping, findings);
    states(&mut table, rows);
    events(&mut table, rows);
    elements(&mut table, rows);
    attributes(&mut table, rows);
    control_modes(&mut table, rows);
    stoppings(&mut table, rows);
    inputs(&mut table, rows);
    displacement_units(&mut table, rows, &mapping.dictionaries);
    inhibits(&mut table, rows);
    event_status(&mut table, rows);
}

/// Bits of Axis Status.
fn states(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (bit, status, mode) in AXIS_STATUS {
        let shows = rows.status.iter().any(|row| {
            is(&row.axis_status, bit)
                && matches!(row.status.as_slice(), [one] if is(one, status))
                && row.mode.as_ref().map(|mode| mode.get_ref().as_str()) == *mode
        });
        let of_mode = mode.map(|mode| format!(" in the mode `{mode}`")).unwrap_or_default();
        let what = format!("`axis_status = \"{bit}\"` for `{status}`{of_mode}");
        table.wants(shows, "status", &what, "the controller would never see the bit for it");
    }
}

fn events(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (event, ..) in EVENTS {
        let has = rows.event.iter().any(|row| is(&row.event, event));
        let why = "the controller would wait for it in vain";
        table.wants(has, "event", &format!("`event = \"{event}\"`"), why);
    }
}

/// Elements of the cyclic data blocks.
fn elements(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (element, _) in CYCLIC {
        let has = rows.cyclic.iter().any(|row| is(&row.element, element));
        let why = "the value would be left out of every update";
        table.wants(has, "cyclic", &format!("`element = \"{element}\"`"), why);
    }
}

/// Attributes that a drive has to see.
fn attributes(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (attribute, value) in ATTRIBUTES {
        let is_stored = |row: &CipAttributeRow| is(&row.attribute, attribute) && row.served_by.is_some();
        let reaches = !rows.attribute.iter().any(is_stored);
        let why = "what the controller sets would be stored, and never reach a drive";
        table.wants(reaches, "attribute", &format!("`{value}` for `{attribute}`"), why);
    }
}

fn control_modes(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (control, _) in CONTROL_MODES {
        let has = rows.mode.iter().any(|row| is(&row.control_mode, control));
        let why = "the controller could not ask for the mode";
        table.wants(has, "mode", &format!("`control_mode = \"{control}\"`"), why);
    }
}

fn stoppings(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (action, ..) in STOPPINGS {
        let has = rows.stopping.iter().any(|row| is(&row.stopping_action, action));
        let why = "the controller could not choose the stop";
        table.wants(has, "stopping", &format!("`stopping_action = \"{action}\"`"), why);
    }
}

/// Bits of Axis I/O Status.
fn inputs(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (bit, ..) in IO_STATUS {
        let has = rows.io_status.iter().any(|row| is(&row.io_status, bit));
        table.wants(has, "io_status", &format!("`io_status = \"{bit}\"`"), "the input would never be seen");
    }
}

/// Every code of the units that an axis can be configured in.
fn displacement_units(table: &mut Table<'_>, rows: &CipGenericFile, dictionaries: &Dictionaries) {
    for set in ["Motion Unit", "Feedback Unit"] {
        let codes = dictionaries.cip.enumeration(set).map_or(&[][..], |set| &set.codes);
        for code in codes {
            let known = |row: &DisplacementUnitRow| is(&row.enumeration, set) && is(&row.code, &code.name);
            let has = rows.displacement_unit.iter().any(known);
            let why = "an axis in this unit could not be configured";
            table.wants(has, "displacement_unit", &format!("`{}` of `{set}`", code.name), why);
        }
    }
}

/// Start inhibits of the standard and the gateway's own.
fn inhibits(table: &mut Table<'_>, rows: &CipGenericFile) {
    let inhibits = INHIBITS.iter().map(|(name, _)| *name).chain(OWN_INHIBITS.iter().map(|(name, _)| *name));
    for inhibit in inhibits {
        let has = rows.inhibit.iter().any(|row| is(&row.inhibit, inhibit));
        let why = "the axis would not start, and the controller would not know why";
        table.wants(has, "inhibit", &format!("`inhibit = \"{inhibit}\"`"), why);
    }
}

/// How an event that was not found is reported.
fn event_status(table: &mut Table<'_>, rows: &CipGenericFile) {
    for (status, _) in OWN_EVENT_STATUS {
        let has = rows.capture_status.iter().any(|row| is(&row.status, status));
        let why = "the controller would not be told how the event has ended";
        table.wants(has, "capture_status", &format!("`status = \"{status}\"`"), why);
    }
}
