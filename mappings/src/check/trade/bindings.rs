//! Every generic value is bound to what holds it by the standard.

use super::facts::{
    ATTRIBUTES, AXIS_STATUS, Binding, CIA402_CAPTURES, CIA402_LIMITS, CIA402_PROBES, CIA402_PROBING,
    CIA402_SAMPLES, CYCLIC, CaptureFact, EVENTS, LOADS, MODE_SLOTS, OF_MOTOR, OF_THE_DRIVE,
    OF_THE_SERCOS_DRIVE, OPPOSITES, PARAMETERS, PROCEDURES, SERCOS_CAPTURES, SERCOS_PROBES, SERCOS_PROBING,
    SERCOS_STATUS, SIGNALS, Trigger, WORDS, WRAPPING,
};
use super::{Reporter, is_standard, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{DIRECTION, WRONG_BINDING, WRONG_SIGN, WRONG_STATE, WRONG_WRAP};
use crate::format::{
    Cia402ParameterRow, CipAttributeRow, CipEventRow, FieldIs, FieldValueRow, ModeSlotRow, Name,
    ProcedureRow, SercosCaptureRow, SercosStatusRow, StatusRow,
};

/// Which of the places of a binding.
type Places = fn(&Binding) -> &'static [&'static str];

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    let places: Places = |known| known.idns;
    let rows = &file.rows;
    for (word, idn) in [
        ("control", &rows.words.control),
        ("status", &rows.words.status),
        ("modes_supported", &rows.supported_modes.list),
    ] {
        bound(&mut reporter, WORDS, word, ("idn", idn), places, true);
    }
    for row in &rows.signal {
        bound(&mut reporter, SIGNALS, row.signal.get_ref(), ("idn", &row.idn), places, true);
        let load = row.load.as_ref().map(|load| &load.idn);
        of_load(&mut reporter, (&row.signal, &row.idn), load, places);
    }
    for row in &rows.parameter {
        bound(&mut reporter, PARAMETERS, row.parameter.get_ref(), ("idn", &row.idn), places, false);
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    let places: Places = |known| known.objects;
    for (word, object) in file.rows.words.objects() {
        bound(&mut reporter, WORDS, word, (word, object), places, true);
    }
    for row in &file.rows.signal {
        bound(&mut reporter, SIGNALS, row.signal.get_ref(), ("object", &row.object), places, true);
        // A row for some modes of operation may have none, as that of drives without an encoder (vl).
        if row.modes.is_empty() || row.load.is_some() {
            of_load(&mut reporter, (&row.signal, &row.object), row.load.as_ref(), places);
        }
    }
    for row in &file.rows.parameter {
        bound(&mut reporter, PARAMETERS, row.parameter.get_ref(), ("object", &row.object), places, false);
        limits(&mut reporter, row);
        let more = [("inverted", &row.inverted), ("common", &row.common)];
        for (key, object) in more {
            let Some(object) = object else { continue };
            let name = if key == "inverted" {
                opposite(row.parameter.get_ref())
            } else {
                row.parameter.get_ref().clone()
            };
            bound(&mut reporter, PARAMETERS, &name, (key, object), places, false);
        }
    }
}

/// What a limit of one direction needs besides its object: the object of the other direction, for drives that invert their
/// positions, and that of both directions, for drives that have no other.
fn limits(reporter: &mut Reporter<'_>, row: &Cia402ParameterRow) {
    let (name, object) = (row.parameter.get_ref(), row.object.get_ref());
    let Some((_, inverted, common)) = CIA402_LIMITS.iter().find(|(known, ..)| known == object) else {
        return;
    };
    for (code, key, given, right, without) in [
        (
            WRONG_SIGN,
            "inverted",
            &row.inverted,
            inverted,
            "in a drive that inverts its positions the limits of both directions would be exchanged",
        ),
        (WRONG_BINDING, "common", &row.common, common, "a drive that has no other limit would get none"),
    ] {
        if given.is_none() {
            let what = [
                format!("`{name}` has no `{key}`"),
                format!("expected {right}: {without}"),
                format!("write `{key} = \"{right}\"`"),
            ];
            reporter.report(code, ("parameter", row.parameter.span()), what);
        }
    }
}

/// A value by the encoder of the load, of an axis that goes by that one.
fn of_load(
    reporter: &mut Reporter<'_>,
    (signal, place): (&Name, &Name),
    given: Option<&Name>,
    places: Places,
) {
    let name = signal.get_ref();
    let right = LOADS.iter().find(|fact| fact.name == name).and_then(|fact| places(fact).first().copied());
    let what = match (given.map(|given| given.get_ref().as_str()), right) {
        (Some(given), _) if !is_standard(given) || right == Some(given) => return,
        (Some(given), Some(right)) => [
            format!("`{name}` by the encoder of the load is bound to {given}"),
            format!("the encoder of the load has it in {right}"),
            format!("write {right} in `load`"),
        ],
        (Some(given), None) => [
            format!("`{name}` by the encoder of the load is bound to {given}"),
            "it is the same by either encoder".to_owned(),
            "remove `load`".to_owned(),
        ],
        (None, Some(right)) if OF_MOTOR.contains(&place.get_ref().as_str()) => [
            format!("`{name}` has no value by the encoder of the load"),
            format!("an axis that goes by that encoder would get {}, that of the motor", place.get_ref()),
            format!("write {right} in `load`"),
        ],
        (None, _) => return,
    };
    reporter.report(WRONG_BINDING, place_of("load", given, ("signal", signal)), what);
}

/// The name of the same value in the other direction.
fn opposite(name: &str) -> String {
    if name.contains("positive") {
        name.replace("positive", "negative")
    } else {
        name.replace("negative", "positive")
    }
}

/// `strict`: nothing else of the standard will do. Otherwise only what the standard has for another value is wrong.
fn bound(
    reporter: &mut Reporter<'_>,
    facts: &[Binding],
    name: &str,
    (key, place): (&str, &Name),
    places: Places,
    strict: bool,
) {
    let given = place.get_ref().as_str();
    let Some(known) = facts.iter().find(|fact| fact.name == name) else { return };
    let right = places(known);
    if right.is_empty() || right.contains(&given) || !is_standard(given) {
        return;
    }
    // A parameter is not read from what goes through the telegrams as another value, and no signal from a parameter.
    let all = facts.iter().chain(SIGNALS).chain(WORDS).chain(PARAMETERS);
    let other = all.into_iter().find(|fact| places(fact).contains(&given));
    if other.is_none() && !strict {
        return;
    }
    let holds = other.map_or_else(|| "something else".to_owned(), |fact| format!("`{}`", fact.name));
    let what = [
        format!("`{name}` is bound to {given}"),
        format!("{given} is {holds} by the standard; `{name}` is {}", right.join(" or ")),
        format!("write `{key} = \"{}\"`", right[0]),
    ];
    reporter.report(WRONG_BINDING, (key, place.span()), what);
}

/// Elements and attributes of CIP Motion.
pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.cyclic {
        let element = row.element.get_ref().as_str();
        let wraps = WRAPPING.contains(&element);
        if row.wraps != wraps && CYCLIC.iter().any(|(known, _)| *known == element) {
            let what = match wraps {
                true => [
                    format!("`{element}` does not wrap"),
                    "a position goes round at the end of its DINT and at the unwind position: an axis that turns \
                     on would be led back all the way"
                        .to_owned(),
                    "write `wraps = true`".to_owned(),
                ],
                false => [
                    format!("`{element}` wraps"),
                    "it is no position: a value beyond its range is one that the controller wants".to_owned(),
                    "remove `wraps`".to_owned(),
                ],
            };
            reporter.report(WRONG_WRAP, ("element", row.element.span()), what);
        }
        let known = CYCLIC.iter().find(|(element, _)| element == row.element.get_ref());
        let Some((element, signal)) = known.filter(|(_, signal)| signal != row.signal.get_ref()) else {
            continue;
        };
        let what = [
            format!("`{element}` is bound to `{}`", row.signal.get_ref()),
            format!("expected `{signal}`"),
            format!("write `signal = \"{signal}\"`"),
        ];
        reporter.report(WRONG_BINDING, ("signal", row.signal.span()), what);
    }
    for row in &file.rows.attribute {
        for (key, bound) in [("parameter", &row.parameter), ("signal", &row.signal)] {
            let Some(bound) = bound else { continue };
            let attribute = row.attribute.get_ref();
            let Some((one, other)) = contradiction(attribute, bound.get_ref()) else { continue };
            let what = [
                format!("`{attribute}` is bound to `{}`", bound.get_ref()),
                format!("one says {one}, the other {other}"),
                format!("bind it to the {key} that says {one}"),
            ];
            reporter.report(WRONG_BINDING, (key, bound.span()), what);
        }
    }
}

/// The words by which two names exclude each other.
fn contradiction(one: &str, other: &str) -> Option<(&'static str, &'static str)> {
    let one = one.to_lowercase();
    let says = |text: &str, word: &str| text.contains(word);
    let pairs = OPPOSITES.iter().flat_map(|(left, right)| [(*left, *right), (*right, *left)]);
    let mut pairs = pairs.filter(|(left, right)| says(&one, left) && !says(&one, right));
    pairs.find(|(left, right)| says(other, right) && !says(other, left))
}

/// Elements, attributes and events of CIP Motion whose names say what they are.
pub(super) fn cip_names(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.attribute {
        attribute(&mut reporter, row);
    }
    for row in &file.rows.event {
        event(&mut reporter, row);
    }
    for row in &file.rows.status {
        axis_status(&mut reporter, row);
    }
}

fn attribute(reporter: &mut Reporter<'_>, row: &CipAttributeRow) {
    let attribute = row.attribute.get_ref();
    let Some((_, right)) = ATTRIBUTES.iter().find(|(known, _)| known == attribute) else { return };
    for (key, bound) in [("parameter", &row.parameter), ("signal", &row.signal)] {
        let Some(bound) = bound.as_ref().filter(|bound| bound.get_ref() != right) else { continue };
        // What a vendor defines may stand for anything.
        if ATTRIBUTES.iter().any(|(_, known)| known == bound.get_ref()) {
            let what = [
                format!("`{attribute}` is bound to `{}`", bound.get_ref()),
                format!("expected `{right}`"),
                format!("write `{key} = \"{right}\"`"),
            ];
            reporter.report(WRONG_BINDING, (key, bound.span()), what);
        }
    }
}

/// Who looks for an event, and what brings it.
fn event(reporter: &mut Reporter<'_>, row: &CipEventRow) {
    let event = row.event.get_ref();
    let Some((_, checking, trigger)) = EVENTS.iter().find(|(known, ..)| known == event) else { return };
    let mut keys = vec![("checking", Some(&row.checking), *checking)];
    match trigger {
        Trigger::Capture(capture, edge) => {
            keys.push(("capture", row.capture.as_ref(), capture));
            keys.push(("edge", row.edge.as_ref(), edge));
        }
        Trigger::Signal(signal) => keys.push(("signal", row.signal.as_ref(), signal)),
    }
    for (key, given, right) in keys {
        let shown = given.map_or("nothing", |name| name.get_ref().as_str());
        if shown == right {
            continue;
        }
        let what = [
            format!("the event `{event}` would come by `{key}` = `{shown}`"),
            format!("expected `{right}`"),
            format!("write `{key} = \"{right}\"`"),
        ];
        reporter.report(WRONG_BINDING, place_of(key, given, ("event", &row.event)), what);
    }
}

/// What sets a bit of Axis Status, in which mode.
fn axis_status(reporter: &mut Reporter<'_>, row: &StatusRow) {
    let [status] = row.status.as_slice() else { return };
    let mode = row.mode.as_ref().map(|mode| mode.get_ref().as_str());
    let bit = row.axis_status.get_ref();
    let facts = || AXIS_STATUS.iter().filter(|(known, ..)| known == bit);
    if facts().next().is_none() || facts().any(|(_, one, of)| one == status.get_ref() && *of == mode) {
        return;
    }
    let shown = |one: &str, of: Option<&str>| match of {
        Some(of) => format!("`{one}` in the mode `{of}`"),
        None => format!("`{one}`"),
    };
    let right: Vec<String> = facts().map(|(_, one, of)| shown(one, *of)).collect();
    let what = [
        format!("`{bit}` would be set by `{}`", status.get_ref()),
        format!("expected {}", right.join(" or ")),
        "correct `status`, `mode` or `axis_status`".to_owned(),
    ];
    reporter.report(WRONG_STATE, ("axis_status", row.axis_status.span()), what);
}

/// Procedures, slots of modes, edges that a SERCOS drive captures, and bits of its status.
pub(super) fn sercos_places(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let rows = &file.rows;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &rows.procedure {
        procedure(&mut reporter, row);
    }
    for row in &rows.mode_slot {
        mode_slot(&mut reporter, row);
    }
    for row in &rows.capture {
        captured(&mut reporter, SERCOS_CAPTURES, (&row.capture, &row.edge), &row.pattern, row.value.as_ref());
        sercos_probe(&mut reporter, row);
    }
    for row in &rows.parameter {
        direction(&mut reporter, &row.parameter, &row.idn, &row.direction);
    }
    for row in &rows.status {
        sercos_status(&mut reporter, row);
    }
}

/// The procedure commands of a mode, in their order.
fn procedure(reporter: &mut Reporter<'_>, row: &ProcedureRow) {
    let of_row = |(mode, source, _): &&(&str, &str, &[&str])| {
        row.mode.get_ref() == mode && row.interpolation.get_ref() == source
    };
    let Some((mode, source, right)) = PROCEDURES.iter().find(of_row) else { return };
    let given: Vec<&str> = row.commands.iter().map(|name| name.get_ref().as_str()).collect();
    if given == *right || !given.iter().all(|idn| is_standard(idn)) {
        return;
    }
    let listed: Vec<String> = right.iter().map(|idn| format!("\"{idn}\"")).collect();
    let what = [
        format!("the mode `{mode}` by the {source} executes other procedure commands"),
        format!("expected {}, in this order", right.join(", ")),
        format!("write `commands = [{}]`", listed.join(", ")),
    ];
    reporter.report(WRONG_BINDING, ("mode", row.mode.span()), what);
}

/// The IDN in which the drive keeps the mode of a slot.
fn mode_slot(reporter: &mut Reporter<'_>, row: &ModeSlotRow) {
    let slot = usize::try_from(*row.slot.get_ref()).ok();
    let right = slot.and_then(|slot| MODE_SLOTS.get(slot));
    let Some(right) = right.filter(|right| row.idn.get_ref() != *right) else { return };
    let what = [
        format!("the mode in {} would be chosen as that of slot {}", row.idn.get_ref(), row.slot.get_ref()),
        format!("the drive has the mode of this slot in {right}"),
        format!("write `idn = \"{right}\"`"),
    ];
    reporter.report(WRONG_BINDING, ("slot", row.slot.span()), what);
}

/// What arms the probe of a capture: its enable, and the procedure command of both.
fn sercos_probe(reporter: &mut Reporter<'_>, row: &SercosCaptureRow) {
    let probe = SERCOS_PROBES.iter().find(|(known, _)| known == row.capture.get_ref());
    let Some((_, enable)) = probe else { return };
    for (key, given, right) in
        [("enable", row.enable.as_ref(), *enable), ("command", row.command.as_ref(), SERCOS_PROBING)]
    {
        let other = |given: &&Name| given.get_ref() != right && is_standard(given.get_ref());
        let Some(given) = given.filter(other) else { continue };
        let what = [
            format!("`{}` would be armed by {}", row.capture.get_ref(), given.get_ref()),
            format!("{right} lets its edges through"),
            format!("write `{key} = \"{right}\"`"),
        ];
        reporter.report(WRONG_BINDING, (key, given.span()), what);
    }
}

/// What a bit of a status word shows.
fn sercos_status(reporter: &mut Reporter<'_>, row: &SercosStatusRow) {
    let [field] = row.pattern.as_slice() else { return };
    let of_row =
        |(word, name, _): &&(&str, &str, &str)| word == row.word.get_ref() && name == field.field.get_ref();
    let Some((word, name, right)) = SERCOS_STATUS.iter().find(of_row) else { return };
    let set = matches!(field.is.get_ref(), FieldIs::Number(1));
    if row.status.get_ref() == right && set {
        return;
    }
    let what = [
        format!("`{}` is taken from another bit of `{word}`", row.status.get_ref()),
        format!("`{name}` = 1 shows `{right}`"),
        format!("write `status = \"{right}\"`, or correct the field"),
    ];
    reporter.report(WRONG_STATE, ("status", row.status.span()), what);
}

/// Edges that a CiA 402 drive captures.
pub(super) fn cia402_places(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.capture {
        captured(&mut reporter, CIA402_CAPTURES, (&row.capture, &row.edge), &row.pattern, row.value.as_ref());
        let probe = row.capture.get_ref().strip_prefix("registration_");
        let own = row.function.as_ref().is_some_and(|object| object.get_ref() == CIA402_PROBING);
        let Some(probe) = probe.filter(|_| own) else { continue };
        let named = |text: &str| text.replace("{n}", probe).replace("{edge}", row.edge.get_ref());
        let has = |list: &[FieldValueRow], name: &str, is: u32| {
            let known = |field: &&FieldValueRow| field.field.get_ref() == name;
            list.iter().find(known).is_some_and(|field| match field.is.get_ref() {
                FieldIs::Number(number) => *number == is,
                FieldIs::Name(_) => true,
            })
        };
        let enables = CIA402_PROBES.iter().map(|(name, is)| (&row.enable, "enable", named(name), *is));
        let selects = [(&row.select, "select", named(CIA402_SAMPLES), 1)];
        for (_, key, name, is) in enables.chain(selects).filter(|(list, _, name, is)| !has(list, name, *is)) {
            let what = [
                format!("the {} edge of `{}` is armed otherwise", row.edge.get_ref(), row.capture.get_ref()),
                format!("the drive is asked for it by `{name}` = {is}"),
                format!("write `{{ field = \"{name}\", is = {is} }}` into `{key}`"),
            ];
            reporter.report(WRONG_STATE, ("edge", row.edge.span()), what);
        }
    }
    for row in &file.rows.parameter {
        direction(&mut reporter, &row.parameter, &row.object, &row.direction);
    }
}

/// A parameter is read, and what is the drive's is not written.
fn direction(reporter: &mut Reporter<'_>, parameter: &Name, place: &Name, direction: &Name) {
    let name = parameter.get_ref().as_str();
    let own = OF_THE_DRIVE.contains(&name) || OF_THE_SERCOS_DRIVE.contains(&place.get_ref().as_str());
    let given = direction.get_ref().as_str();
    if !is_standard(place.get_ref()) || given == "from_drive" || given == "both" && !own {
        return;
    }
    let what = if own {
        [
            format!("`{name}` would be written into the drive"),
            "it is what the drive shows, or how its motor and mechanics were set up with its own tool"
                .to_owned(),
            "write `direction = \"from_drive\"`".to_owned(),
        ]
    } else {
        [
            format!("`{name}` would never be read from the drive"),
            "the controller reads back what the drive holds".to_owned(),
            "write `direction = \"both\"`".to_owned(),
        ]
    };
    reporter.report(DIRECTION, ("direction", direction.span()), what);
}

/// An edge: the field that tells it, and the position that was stored.
fn captured(
    reporter: &mut Reporter<'_>,
    facts: &[CaptureFact],
    (capture, edge): (&Name, &Name),
    pattern: &[FieldValueRow],
    value: Option<&Name>,
) {
    let of_row = |fact: &&CaptureFact| capture.get_ref() == fact.capture && edge.get_ref() == fact.edge;
    let Some(fact) = facts.iter().find(of_row) else { return };
    let known = |field: &FieldValueRow| facts.iter().any(|fact| field.field.get_ref() == fact.field);
    let what = format!("the {} edge of `{}`", fact.edge, fact.capture);
    let tells = |field: &FieldValueRow| {
        field.field.get_ref() == fact.field
            && matches!(field.is.get_ref(), FieldIs::Number(is) if *is == fact.is)
    };
    // A field that no fact has is the vendor's.
    if !pattern.iter().any(tells) && (pattern.is_empty() || pattern.iter().any(known)) {
        let what = [
            format!("{what} is taken from something else"),
            format!("the drive tells it by `{}` = {}", fact.field, fact.is),
            format!("write `pattern = [{{ field = \"{}\", is = {} }}]`", fact.field, fact.is),
        ];
        reporter.report(WRONG_STATE, ("edge", edge.span()), what);
    }
    if let (Some(given), Some(right)) = (value, fact.value)
        && is_standard(given.get_ref())
        && given.get_ref() != right
    {
        let what = [
            format!("{what} would have the position in {}", given.get_ref()),
            format!("the drive stores it in {right}"),
            format!("write `value = \"{right}\"`"),
        ];
        reporter.report(WRONG_BINDING, ("value", given.span()), what);
    }
}
