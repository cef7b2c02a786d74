//! What the rows between CIP Motion and the generic model say.

use super::{Aspect, Fact, Reader, Spanned, said, text};
use crate::Mapping;
use crate::format::{CipScalingRow, MechanicsRow, listed};

pub(super) fn facts(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "cip-generic");
    reader.units(&rows.unit);
    for row in &rows.displacement_unit {
        let ratio = Spanned::new(row.nanounits.span(), [*row.nanounits.get_ref(), 1]);
        let id = format!("{} of {}", row.code.get_ref(), row.enumeration.get_ref());
        reader.scale(("displacement_unit", &id), &ratio, 0, "");
        reader.named(("displacement_unit", &id), Aspect::Unit, &row.kind);
    }
    scaling(&mut reader, &rows.scaling);
    for row in &rows.cyclic {
        reader.named(("cyclic", row.element.get_ref()), Aspect::Binding, &row.signal);
        reader.named(("cyclic", row.element.get_ref()), Aspect::Missing, &row.missing);
        let wraps = if row.wraps { "wraps" } else { "does not wrap" };
        let says = format!("{wraps}, {}", row.direction.get_ref());
        let id = format!("{}, direction", row.element.get_ref());
        reader.say(("cyclic", &id), Aspect::Binding, says, row.element.span());
    }
    for row in &rows.mode {
        reader.named(("mode", row.control_mode.get_ref()), Aspect::Mode, &row.mode);
    }
    for row in &rows.feedback_mode {
        reader.named(("feedback_mode", row.feedback_mode.get_ref()), Aspect::Mode, &row.feedback);
    }
    for row in &rows.request {
        let says = format!("{}, {}", text(row.request.as_ref()), row.axis_response.get_ref());
        reader.say(("request", row.axis_control.get_ref()), Aspect::State, says, row.axis_control.span());
    }
    for row in &rows.drive_action {
        let says = text(row.request.as_ref());
        reader.say(
            ("drive_action", row.drive_action.get_ref()),
            Aspect::State,
            says,
            row.drive_action.span(),
        );
    }
    for row in &rows.state {
        let says = format!("{}: {}", row.axis_state.get_ref(), listed(&row.conditions));
        reader.say(("state", row.state.get_ref()), Aspect::State, says, row.axis_state.span());
    }
    for row in &rows.status {
        let mode = row.mode.as_ref().map_or("every mode", |mode| mode.get_ref());
        let id = format!("{}, by {} in {mode}", row.axis_status.get_ref(), listed(&row.status));
        reader.say(("status", &id), Aspect::State, "set", row.axis_status.span());
    }
    for row in &rows.io_status {
        let inverted = said("inverted", row.inverted.as_ref());
        let says = format!("{}, without {}{inverted}", listed(&row.status), listed(&row.without));
        reader.say(("io_status", row.io_status.get_ref()), Aspect::State, says, row.io_status.span());
    }
    for row in &rows.inhibit {
        let bit = row.manufacturer.as_ref().map(|bit| format!("manufacturer {}", bit.get_ref()));
        let says = bit.unwrap_or_else(|| text(row.start_inhibit.as_ref()).to_owned());
        reader.say(("inhibit", row.inhibit.get_ref()), Aspect::State, says, row.inhibit.span());
    }
    for row in &rows.fault {
        let named = [&row.exception, &row.node_fault, &row.initialization, &row.apr];
        let named = named.into_iter().flatten().next();
        let (least, default) = (text(row.least.as_ref()), text(row.default.as_ref()));
        let bit = row.manufacturer.as_ref().map(|bit| format!("manufacturer {}", bit.get_ref()));
        let more = said("found by", row.found_by.as_ref()) + &said("inverted", row.inverted.as_ref());
        let says =
            format!("{}, least {least}, default {default}{more}", bit.as_deref().unwrap_or(text(named)));
        reader.say(("fault", row.cause.get_ref()), Aspect::Fault, says, row.cause.span());
    }
    for row in &rows.reaction {
        let says = format!("{}, {}", row.stop.get_ref(), row.state_change.get_ref());
        reader.say(("reaction", row.reaction.get_ref()), Aspect::Fault, says, row.reaction.span());
    }
    for row in &rows.stopping {
        let says = format!("{}, holds {}, {}", row.method.get_ref(), row.holds, row.abort.get_ref());
        reader.say(
            ("stopping", row.stopping_action.get_ref()),
            Aspect::Fault,
            says,
            row.stopping_action.span(),
        );
    }
    for (key, name) in rows.sequence.attributes() {
        reader.named(("sequence", key), Aspect::Binding, name);
    }
    mechanics(&mut reader, &rows.mechanics);
    for row in &rows.event {
        let keys =
            [("capture", &row.capture), ("edge", &row.edge), ("signal", &row.signal), ("unit", &row.unit)];
        let more: String = keys.into_iter().map(|(key, name)| said(key, name.as_ref())).collect();
        let says = format!("{}{more}", row.checking.get_ref());
        reader.say(("event", row.event.get_ref()), Aspect::Binding, says, row.event.span());
    }
    for row in &rows.capture_status {
        let says = row.event_status.to_string();
        reader.say(("capture_status", row.status.get_ref()), Aspect::State, says, row.status.span());
    }
    for row in &rows.attribute {
        let id = ("attribute", row.attribute.get_ref().as_str());
        let named = [&row.parameter, &row.signal, &row.served_by];
        let named: Vec<&str> = named.into_iter().flatten().map(|name| name.get_ref().as_str()).collect();
        let named = named.join(" or ");
        let value = row.value.map_or_else(String::new, |value| format!(" {value}"));
        reader.say(id, Aspect::Binding, format!("{named}{value}"), row.attribute.span());
        if let Some(missing) = &row.missing {
            reader.named(id, Aspect::Missing, missing);
        }
        reader.range(id, row.range, row.attribute.span());
        if !row.without.is_empty() {
            reader.say(id, Aspect::State, format!("without {}", listed(&row.without)), row.without[0].span());
        }
    }
    reader.facts
}

/// The attributes that define what a count is.
fn scaling(reader: &mut Reader<'_>, row: &CipScalingRow) {
    for (key, name) in [
        ("configuration", &row.configuration),
        ("drive_scaling", &row.drive_scaling),
        ("unit", &row.unit),
        ("resolution", &row.resolution),
        ("unwind", &row.unwind),
        ("unwind_position", &row.unwind_position),
        ("feedback_unit", &row.feedback_unit),
    ] {
        reader.named(("scaling", key), Aspect::Scale, name);
    }
    let says = listed(&row.feedback_resolution);
    reader.say(("scaling", "feedback_resolution"), Aspect::Scale, says, row.configuration.span());
    reader.named(("scaling", "polarity"), Aspect::Sign, &row.polarity);
    reader.named(("scaling", "inverted"), Aspect::Sign, &row.inverted);
}

/// The attributes of what lies between motor and load.
fn mechanics(reader: &mut Reader<'_>, row: &MechanicsRow) {
    for (key, name) in [
        ("load_type", &row.load_type),
        ("direct_rotary", &row.direct_rotary),
        ("rotary_transmission", &row.rotary_transmission),
        ("linear_actuator", &row.linear_actuator),
        ("actuator_type", &row.actuator_type),
        ("no_actuator", &row.no_actuator),
        ("actuator", &row.actuator),
        ("lead", &row.lead),
        ("diameter", &row.diameter),
        ("unit_ratio", &row.unit_ratio),
    ] {
        reader.named(("mechanics", key), Aspect::Binding, name);
    }
}
