//! What the profiles have and no row binds: a row that was taken away.
//!
//! An IDN or object that is left out on purpose stands in [[unbound]] with a reason. A status bit, an event, an edge or a step of
//! commissioning has no such place: without its row, the axis comes to operation and lacks it in silence.

use profile_sercos::wire::idn::Idn;

use super::Reporter;
use super::facts::{
    ATTRIBUTES, AXIS_STATUS, Binding, CIA402_CAPTURES, CIA402_MODES, CIA402_READS, CIA402_STEPS,
    CIA402_UNITS, CIA402_WRITTEN, CLASSES, CODES, CONTROL_MODES, CYCLIC, EVENTS, INHIBITS, IO_STATUS,
    MODE_SLOTS, OWN_EVENT_STATUS, OWN_INHIBITS, PARAMETERS, PROCEDURES, SERCOS_CAPTURES, SERCOS_CODES,
    SERCOS_EDGES, SERCOS_FAULTS, SERCOS_NUMBERS, SERCOS_READS, SERCOS_STATUS, SERCOS_STEPS, SERCOS_UNITS,
    SERCOS_WRITTEN, SIGNALS, SPELLINGS, STOPPINGS, WITHOUT_ENCODER, WRITES,
};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::NOTHING_BOUND;
use crate::format::{
    Cia402SignalRow, CipAttributeRow, DisplacementUnitRow, FieldIs, FieldValueRow, Name, SercosFaultRow,
    UnitRow,
};

/// A table in which rows are missed, with the place that stands for it.
struct Table<'a> {
    reporter: Reporter<'a>,
    mapping: &'a Name,
}

impl Table<'_> {
    /// Reports what no row of a list has.
    fn lacks(&mut self, list: &str, what: &str, why: &str) {
        let what =
            [format!("no [[{list}]] row has {what}"), why.to_owned(), format!("add the row to [[{list}]]")];
        self.reporter.report(NOTHING_BOUND, ("mapping", self.mapping.span()), what);
    }

    /// Reports what is neither bound nor left out for a reason.
    fn unanswered(&mut self, what: &str, name: &str) {
        let what = [
            format!("no row binds {what} ({name})"),
            "nothing would be read from it or written to it, and nobody has said why".to_owned(),
            "bind it, or name it in an [[unbound]] row with the reason".to_owned(),
        ];
        self.reporter.report(NOTHING_BOUND, ("mapping", self.mapping.span()), what);
    }
}

fn is(name: &Name, wanted: &str) -> bool {
    name.get_ref() == wanted
}

pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows;
    let mut table = Table { reporter: Reporter { source: &file.text, findings }, mapping: &rows.mapping };
    for (bit, status, mode) in AXIS_STATUS {
        let shows = rows.status.iter().any(|row| {
            is(&row.axis_status, bit)
                && matches!(row.status.as_slice(), [one] if is(one, status))
                && row.mode.as_ref().map(|mode| mode.get_ref().as_str()) == *mode
        });
        if !shows {
            let of_mode = mode.map(|mode| format!(" in the mode `{mode}`")).unwrap_or_default();
            let what = format!("`axis_status = \"{bit}\"` for `{status}`{of_mode}");
            table.lacks("status", &what, "the controller would never see the bit for it");
        }
    }
    for (event, ..) in EVENTS {
        if !rows.event.iter().any(|row| is(&row.event, event)) {
            table.lacks(
                "event",
                &format!("`event = \"{event}\"`"),
                "the controller would wait for it in vain",
            );
        }
    }
    for (element, _) in CYCLIC {
        if !rows.cyclic.iter().any(|row| is(&row.element, element)) {
            let why = "the value would be left out of every update";
            table.lacks("cyclic", &format!("`element = \"{element}\"`"), why);
        }
    }
    for (attribute, value) in ATTRIBUTES {
        let is_stored = |row: &&CipAttributeRow| is(&row.attribute, attribute) && row.served_by.is_some();
        if rows.attribute.iter().any(|row| is_stored(&row)) {
            let why = "what the controller sets would be stored, and never reach a drive";
            table.lacks("attribute", &format!("`{value}` for `{attribute}`"), why);
        }
    }
    for (control, _) in CONTROL_MODES {
        if !rows.mode.iter().any(|row| is(&row.control_mode, control)) {
            let why = "the controller could not ask for the mode";
            table.lacks("mode", &format!("`control_mode = \"{control}\"`"), why);
        }
    }
    for (action, ..) in STOPPINGS {
        if !rows.stopping.iter().any(|row| is(&row.stopping_action, action)) {
            let why = "the controller could not choose the stop";
            table.lacks("stopping", &format!("`stopping_action = \"{action}\"`"), why);
        }
    }
    for (bit, ..) in IO_STATUS {
        if !rows.io_status.iter().any(|row| is(&row.io_status, bit)) {
            table.lacks("io_status", &format!("`io_status = \"{bit}\"`"), "the input would never be seen");
        }
    }
    for set in ["Motion Unit", "Feedback Unit"] {
        let codes = mapping.dictionaries.cip.enumeration(set).map_or(&[][..], |set| &set.codes);
        for code in codes {
            let known = |row: &DisplacementUnitRow| is(&row.enumeration, set) && is(&row.code, &code.name);
            if !rows.displacement_unit.iter().any(known) {
                let why = "an axis in this unit could not be configured";
                table.lacks("displacement_unit", &format!("`{}` of `{set}`", code.name), why);
            }
        }
    }
    let inhibits = INHIBITS.iter().map(|(name, _)| *name).chain(OWN_INHIBITS.iter().map(|(name, _)| *name));
    for inhibit in inhibits {
        if !rows.inhibit.iter().any(|row| is(&row.inhibit, inhibit)) {
            let why = "the axis would not start, and the controller would not know why";
            table.lacks("inhibit", &format!("`inhibit = \"{inhibit}\"`"), why);
        }
    }
    for (status, _) in OWN_EVENT_STATUS {
        if !rows.capture_status.iter().any(|row| is(&row.status, status)) {
            let why = "the controller would not be told how the event has ended";
            table.lacks("capture_status", &format!("`status = \"{status}\"`"), why);
        }
    }
}

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let rows = &file.rows;
    let mut table = Table { reporter: Reporter { source: &file.text, findings }, mapping: &rows.mapping };
    for idn in &mapping.sercos.unanswered {
        let name = mapping.dictionaries.sercos.idn(*idn).map_or("", |row| row.name.as_str());
        table.unanswered(&idn.to_string(), name);
    }
    let left = |binding: &Binding| {
        mapping.sercos.unbound.iter().any(|(idn, _)| binding.idns.contains(&idn.to_string().as_str()))
    };
    for binding in PARAMETERS.iter().filter(|binding| !binding.idns.is_empty()) {
        let open = |idn: &Idn| binding.idns.contains(&idn.to_string().as_str());
        let answered = !mapping.sercos.unanswered.iter().any(open);
        if answered && !rows.parameter.iter().any(|row| is(&row.parameter, binding.name)) && !left(binding) {
            parameter(&mut table, binding.name, binding.idns);
        }
    }
    for (word, field, status) in SERCOS_STATUS {
        if !rows.status.iter().any(|row| is(&row.word, word) && is_set(&row.pattern, field)) {
            let what = format!("the bit `{field}` of the word `{word}`");
            table.lacks("status", &what, &format!("`{status}` would never be seen"));
        }
    }
    for (field, cause) in SERCOS_FAULTS {
        if !rows.fault.iter().any(|row| is_set(&row.pattern, field)) {
            let why = format!("`{cause}` would not be reported");
            table.lacks("fault", &format!("the bit `{field}`"), &why);
        }
    }
    for (fields, cause) in SERCOS_NUMBERS {
        let of_fields = |row: &&SercosFaultRow| {
            row.word.get_ref() == "Diagnostic number"
                && row.pattern.len() == fields.len()
                && is(&row.cause, cause)
        };
        if !rows.fault.iter().any(|row| of_fields(&row)) {
            let why = "an error that the drive says by its number alone would come without its cause";
            table.lacks("fault", &format!("`{cause}` for errors of S-0-0390"), why);
        }
    }
    for fact in SERCOS_CAPTURES {
        if !rows.capture.iter().any(|row| is(&row.capture, fact.capture) && is(&row.edge, fact.edge)) {
            capture(&mut table, fact.capture, fact.edge);
        }
    }
    for (capture, edge) in SERCOS_EDGES {
        if !rows.capture.iter().any(|row| is(&row.capture, capture) && is(&row.edge, edge)) {
            self::capture(&mut table, capture, edge);
        }
    }
    for (unit, text) in SPELLINGS.iter().map(|(text, unit)| (*unit, *text)) {
        if !rows
            .unit
            .iter()
            .any(|row| is(&row.unit, unit) && row.texts.iter().any(|known| known.as_str() == text))
        {
            let why = "a parameter of a drive that writes it so would be missing";
            table.lacks("unit", &format!("the spelling `{text}` of `{unit}`"), why);
        }
    }
    units(&mut table, SERCOS_UNITS, &rows.unit);
    for binding in SIGNALS.iter().filter(|binding| !binding.idns.is_empty()) {
        if !rows.signal.iter().any(|row| is(&row.signal, binding.name)) {
            signal(&mut table, binding.name, binding.idns);
        }
    }
    for (mode, by_drive, _) in SERCOS_CODES {
        if !rows.mode.iter().any(|row| is(&row.mode, mode) && by(row.interpolation.as_ref()) == *by_drive) {
            self::mode(&mut table, mode, *by_drive);
        }
    }
    for (mode, source, _) in PROCEDURES {
        if !rows.procedure.iter().any(|row| is(&row.mode, mode) && is(&row.interpolation, source)) {
            let why = "a drive that can do it would be taken for one that cannot";
            table.lacks("procedure", &format!("the mode `{mode}` by the {source}"), why);
        }
    }
    for (slot, idn) in (0_u32..).zip(MODE_SLOTS) {
        if !rows.mode_slot.iter().any(|row| *row.slot.get_ref() == slot) {
            let why = format!("the operation mode in {idn} could not be used");
            table.lacks("mode_slot", &format!("`slot = {slot}`"), &why);
        }
    }
    steps(&mut table, SERCOS_STEPS, |verb| rows.commission.iter().any(|row| is(&row.step, verb)));
    let written = |name: &str| {
        rows.commission.iter().any(|row| row.parameter.as_ref().is_some_and(|known| is(known, name)))
    };
    limits(&mut table, SERCOS_WRITTEN, written);
    let written = |idn: &str, value: i64| {
        rows.commission.iter().any(|row| {
            row.idn.as_ref().is_some_and(|known| is(known, idn))
                && row.value.as_ref().is_some_and(|known| *known.get_ref() == value)
        })
    };
    values(&mut table, true, written);
    reads(&mut table, SERCOS_READS, |idn| {
        rows.commission
            .iter()
            .any(|row| is(&row.step, "read") && row.idn.as_ref().is_some_and(|known| is(known, idn)))
    });
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let rows = &file.rows;
    let mut table = Table { reporter: Reporter { source: &file.text, findings }, mapping: &rows.mapping };
    for index in &mapping.cia402.unanswered {
        let name = mapping.dictionaries.cia402.object(*index).map_or("", |object| object.name.as_str());
        table.unanswered(&format!("{index:04X}"), name);
    }
    let left = |binding: &Binding| {
        let index = |object: &&str| u16::from_str_radix(object.get(..4).unwrap_or_default(), 16).ok();
        let mut indexes = binding.objects.iter().filter_map(index);
        indexes.any(|index| {
            let reason = mapping.cia402.unbound.iter().any(|(known, _)| *known == index);
            // It is reported as a whole.
            reason || mapping.cia402.unanswered.contains(&index)
        })
    };
    for binding in PARAMETERS.iter().filter(|binding| !binding.objects.is_empty()) {
        let bound = rows.parameter.iter().any(|row| is(&row.parameter, binding.name));
        // One object limits both directions of the velocity.
        let both = binding.name.contains("negative")
            && rows.parameter.iter().any(|row| binding.objects.contains(&row.object.get_ref().as_str()));
        if !bound && !both && !left(binding) {
            parameter(&mut table, binding.name, binding.objects);
        }
    }
    for fact in CIA402_CAPTURES {
        if !rows.capture.iter().any(|row| is(&row.capture, fact.capture) && is(&row.edge, fact.edge)) {
            capture(&mut table, fact.capture, fact.edge);
        }
    }
    units(&mut table, CIA402_UNITS, &rows.unit);
    for binding in SIGNALS.iter().filter(|binding| !binding.objects.is_empty()) {
        if !rows.signal.iter().any(|row| is(&row.signal, binding.name)) {
            signal(&mut table, binding.name, binding.objects);
        }
    }
    let (without_encoder, _) = WITHOUT_ENCODER;
    let may_lack = |name: &str| {
        let own = |row: &&Cia402SignalRow| {
            is(&row.signal, name) && row.modes.iter().any(|mode| is(mode, without_encoder))
        };
        rows.signal.iter().any(|row| own(&row))
    };
    if !may_lack("position_actual") {
        let what = format!("`position_actual` with `modes = [\"{without_encoder}\"]`");
        table.lacks("signal", &what, "a frequency converter without an encoder could not be used");
    }
    for (mode, by_drive, own) in CIA402_MODES {
        let rows_of = rows.mode.iter().filter(|row| is(&row.mode, mode));
        let named: Vec<&Name> = rows_of
            .filter(|row| by(row.interpolation.as_ref()) == *by_drive)
            .flat_map(|row| &row.modes)
            .collect();
        if own.iter().any(|wanted| !named.iter().any(|name| is(name, wanted))) {
            self::mode(&mut table, mode, *by_drive);
        }
    }
    if !rows.procedure.iter().any(|row| is(&row.mode, "homing")) {
        let why = "a drive that can do it would be taken for one that cannot";
        table.lacks("procedure", "the mode `homing`", why);
    }
    for (class, cause) in CLASSES {
        if !rows.fault_class.iter().any(|row| row.classes.iter().any(|known| is(known, class))) {
            let why = format!("its codes without a row of their own would not be reported as `{cause}`");
            table.lacks("fault_class", &format!("the class `{class}`"), &why);
        }
    }
    for (code, cause) in CODES {
        if !rows.fault.iter().any(|row| row.codes.iter().any(|known| is(known, code))) {
            let why = format!("it would be reported as its class, and not as `{cause}`");
            table.lacks("fault", &format!("the code `{code}`"), &why);
        }
    }
    for status in ["limit_switches", "positive_limit_switch", "negative_limit_switch", "home_switch"] {
        if !rows.status.iter().any(|row| is(&row.status, status)) {
            let why = "an input of the drive would never be seen";
            table.lacks("status", &format!("`status = \"{status}\"`"), why);
        }
    }
    steps(&mut table, CIA402_STEPS, |verb| rows.commission.iter().any(|row| is(&row.step, verb)));
    let written = |name: &str| {
        rows.commission.iter().any(|row| row.parameter.as_ref().is_some_and(|known| is(known, name)))
    };
    limits(&mut table, CIA402_WRITTEN, written);
    let written = |object: &str, value: i64| {
        rows.commission.iter().any(|row| {
            row.object.as_ref().is_some_and(|known| is(known, object))
                && row.value.as_ref().is_some_and(|known| *known.get_ref() == value)
        })
    };
    values(&mut table, false, written);
    reads(&mut table, CIA402_READS, |object| {
        rows.commission
            .iter()
            .any(|row| is(&row.step, "read") && row.object.as_ref().is_some_and(|known| is(known, object)))
    });
}

/// Whether the drive makes the way.
fn by(interpolation: Option<&Name>) -> bool {
    interpolation.is_some_and(|name| is(name, "drive"))
}

fn mode(table: &mut Table<'_>, mode: &str, by_drive: bool) {
    let what = if by_drive { "by the drive" } else { "by the controller" };
    let why = "a drive that can do it would be taken for one that cannot";
    table.lacks("mode", &format!("the mode `{mode}` {what}, or not all of its operation modes"), why);
}

/// Whether a pattern is one bit that has to be set.
fn is_set(pattern: &[FieldValueRow], field: &str) -> bool {
    matches!(pattern, [one] if is(&one.field, field) && matches!(one.is.get_ref(), FieldIs::Number(1)))
}

fn parameter(table: &mut Table<'_>, name: &str, places: &[&str]) {
    let why = format!("drives hold it in {}, and nobody would read or set it there", places.join(" or "));
    table.lacks("parameter", &format!("`parameter = \"{name}\"`"), &why);
}

fn signal(table: &mut Table<'_>, name: &str, places: &[&str]) {
    let why = format!("drives have it in {}, and no telegram could carry it", places.join(" or "));
    table.lacks("signal", &format!("`signal = \"{name}\"`"), &why);
}

fn capture(table: &mut Table<'_>, capture: &str, edge: &str) {
    let why = "the edge would never be told";
    table.lacks("capture", &format!("the {edge} edge of `{capture}`"), why);
}

fn units(table: &mut Table<'_>, facts: &[(&str, &str)], rows: &[UnitRow]) {
    for (unit, quantity) in facts {
        if !rows.iter().any(|row| is(&row.unit, unit)) {
            let why = format!("a {quantity} that a drive gives in it would be missing");
            table.lacks("unit", &format!("`unit = \"{unit}\"`"), &why);
        }
    }
}

fn steps(table: &mut Table<'_>, verbs: &[&str], has: impl Fn(&str) -> bool) {
    for verb in verbs.iter().filter(|verb| !has(verb)) {
        let why = "the axis would not know how its drive is, or the drive not what is wanted of it";
        table.lacks("commission", &format!("`do = \"{verb}\"`"), why);
    }
}

fn limits(table: &mut Table<'_>, names: &[&str], written: impl Fn(&str) -> bool) {
    for name in names.iter().filter(|name| !written(name)) {
        let why = "what the configuration says of it would not reach the drive";
        table.lacks("commission", &format!("`do = \"write\"` with `parameter = \"{name}\"`"), why);
    }
}

/// What is asked of every drive beside its parameters.
fn reads(table: &mut Table<'_>, places: &[&str], read: impl Fn(&str) -> bool) {
    for place in places.iter().filter(|place| !read(place)) {
        let why = "what the drive says of itself there would not be known";
        table.lacks("commission", &format!("`do = \"read\"` of {place}"), why);
    }
}

fn values(table: &mut Table<'_>, sercos: bool, written: impl Fn(&str, i64) -> bool) {
    for (place, values) in WRITES.iter().filter(|(place, _)| place.starts_with("S-") == sercos) {
        for value in values.iter().filter(|value| !written(place, **value)) {
            let why = "the drive would keep what somebody has set there before";
            table.lacks("commission", &format!("`do = \"write\"` of {value:#x} to {place}"), why);
        }
    }
}
