//! `[[step]]`: one verb with its arguments.

use std::time::Duration;

use profile_cip::assembly::handshake::Status;
use profile_cip::assembly::{Control, Refusal};
use profile_generic::cast::{f64_from_i64, i64_from_f64};
use profile_generic::fault::FaultCause;
use toml::de::DeValue;

use crate::simulate::plc::image::fits;
use crate::simulate::plc::step::names;
use crate::simulate::plc::{Condition, HANDSHAKE, Images, Movement, Plan, Planned, PlcError, Step};
use crate::simulate::script::reader::{
    self, Keys, Problems, Value, number, table, time, whole, word_of, words, wrong,
};

/// How long a movement may take, and an expectation, where the step does not say.
const MOVEMENT: Duration = Duration::from_secs(60);
const EXPECTATION: Duration = Duration::from_secs(1);

/// What steps are checked against.
pub(super) struct Frame<'a> {
    pub plan: &'a Plan,
    pub images: &'a Images,
    pub problems: &'a Problems,
}

/// A step, the time that it has, and its title.
type Made = (Step, Duration, String);

/// A verb: its name, and how its arguments make a step.
type Verb = (&'static str, fn(&Value<'_>, &Frame<'_>) -> Option<Made>);

/// Every verb.
const VERBS: &[Verb] = &[
    ("enable", |v, f| of_axes(v, f, "enable", Step::Enable)),
    ("disable", |v, f| of_axes(v, f, "disable", Step::Disable)),
    ("fault_reset", |v, f| of_axes(v, f, "reset the faults of", Step::FaultReset)),
    ("stop", stop),
    ("move", go),
    ("velocity", follow),
    ("word", word),
    ("set", set),
    ("dwell", |v, f| lasting(v, f, "dwell", "go on for", Step::Dwell)),
    ("idle", |v, f| lasting(v, f, "idle", "idle for", Step::Idle)),
    ("silence", |v, f| lasting(v, f, "silence", "send nothing for", Step::Silence)),
    ("close", |v, f| flag(v, f, "close", Step::Close)),
    ("connect", |v, f| flag(v, f, "connect", Step::Connect)),
    ("expect", expect),
];

/// Reads one step.
pub(super) fn step(value: &Value<'_>, line: usize, frame: &Frame<'_>) -> Option<Planned> {
    let problems = frame.problems;
    let mut keys = table(value, "the step", problems)?;
    let own_title = reader::title(&mut keys)?;
    let own_time = match keys.find("within") {
        Some(value) => Some(span(value, "within", problems)?),
        None => None,
    };
    let (read, arguments) =
        reader::verb(value, &mut keys, VERBS, &["within", "title"], "expected one verb in a step")?;
    keys.finish()?;
    let (step, within, title) = read(arguments, frame)?;
    let (within, title) = (own_time.unwrap_or(within), own_title.unwrap_or(title));
    Some(Planned { step, within, title, line: Some(line) })
}

// ---- arguments ---------------------------------------------------------------------------------------------------

fn span(value: &Value<'_>, key: &str, problems: &Problems) -> Option<Duration> {
    super::nanos(time(value, key, problems)?)
}

/// An axis by its name.
fn axis(value: &Value<'_>, frame: &Frame<'_>) -> Option<usize> {
    let Some(name) = value.get_ref().as_str() else {
        return wrong(value, "axis", "the name of an axis", frame.problems);
    };
    let found = frame.plan.names.iter().position(|known| known == name);
    found.or_else(|| {
        let title = format!("the device has no axis `{name}`");
        let names: Vec<_> = frame.plan.names.iter().map(|name| format!("\"{name}\"")).collect();
        frame.problems.report(value.span(), title, format_args!("expected one of {}", names.join(", ")))
    })
}

/// `"all"`, an axis, or a list of axes.
fn axes(value: &Value<'_>, frame: &Frame<'_>) -> Option<Vec<usize>> {
    match value.get_ref() {
        DeValue::String(name) if name == "all" => Some((0..frame.plan.names.len()).collect()),
        DeValue::Array(items) if !items.is_empty() => items.iter().map(|item| axis(item, frame)).collect(),
        DeValue::String(_) => axis(value, frame).map(|axis| vec![axis]),
        _ => wrong(value, "axes", "\"all\", the name of an axis, or a list of names", frame.problems),
    }
}

fn of_axes(value: &Value<'_>, frame: &Frame<'_>, verb: &str, step: fn(Vec<usize>) -> Step) -> Option<Made> {
    let axes = axes(value, frame)?;
    let names: Vec<_> = axes.iter().map(|axis| frame.plan.name(*axis)).collect();
    let title = format!("{verb} {}", names.join(", "));
    Some((step(axes), HANDSHAKE, title))
}

/// `stop = axes`
fn stop(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let word = Control::ENABLE | Control::STOP;
    carried(value, frame, |images| {
        (0..frame.plan.names.len()).try_for_each(|axis| images.set_word(axis, word))
    })?;
    of_axes(value, frame, "stop", Step::Stop)
}

fn lasting(
    value: &Value<'_>,
    frame: &Frame<'_>,
    key: &str,
    verb: &str,
    step: fn(Duration) -> Step,
) -> Option<Made> {
    let time = time(value, key, frame.problems)?;
    Some((step(super::nanos(time)?), HANDSHAKE, format!("{verb} {time}")))
}

fn flag(value: &Value<'_>, frame: &Frame<'_>, key: &str, step: Step) -> Option<Made> {
    match value.get_ref() {
        DeValue::Boolean(true) => Some((step, HANDSHAKE, key.to_owned())),
        _ => wrong(value, key, "true", frame.problems),
    }
}

/// Counts of a value in units of the axis.
fn counts(units: f64, axis: usize, frame: &Frame<'_>) -> i64 {
    let counts = frame.plan.counts.get(axis).copied().unwrap_or(1);
    i64_from_f64((units * f64::from(counts)).round())
}

/// Tries a step on the assemblies: what they cannot carry is wrong at this place.
fn carried(
    value: &Value<'_>,
    frame: &Frame<'_>,
    put: impl FnOnce(&mut Images) -> Result<(), PlcError>,
) -> Option<()> {
    let mut images = frame.images.clone();
    match put(&mut images) {
        Ok(()) => Some(()),
        Err(error) => {
            let expected = "expected what the layout of the device can carry: see `axisbridge assembly`";
            frame.problems.report(value.span(), error, expected)
        }
    }
}

// ---- verbs -------------------------------------------------------------------------------------------------------

/// `move = { axis, to | by, velocity, acceleration, wait }`
fn go(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let mut keys = table(value, "move", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let (to, by) = (keys.maybe_number("to")?, keys.maybe_number("by")?);
    let velocity = keys.number("velocity")?;
    let acceleration = keys.number_or("acceleration", Some(0.0))?;
    let wait = keys.boolean_or("wait", true)?;
    let (target, relative) = match (to, by) {
        (Some(target), None) => (target, false),
        (None, Some(distance)) => (distance, true),
        _ => {
            let title = "`to` and `by` are one or the other";
            return frame.problems.report(keys.span(), title, "expected one of them");
        }
    };
    keys.finish()?;
    let movement = Movement {
        target: counts(target, axis, frame),
        relative,
        velocity: counts(velocity, axis, frame),
        acceleration: counts(acceleration, axis, frame),
    };
    carried(value, frame, |images| {
        images.set_mode(axis, 1)?;
        images.set_target(axis, movement.target)?;
        images.set(axis, "velocity", movement.velocity)?;
        images.set_acceleration(axis, movement.acceleration)
    })?;
    let preposition = if relative { "by" } else { "to" };
    let title = format!("move {} {preposition} {target} at {velocity} per second", frame.plan.name(axis));
    Some((Step::Move { axis, movement, wait }, MOVEMENT, title))
}

/// `velocity = { axis, velocity, acceleration, wait }`
fn follow(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let mut keys = table(value, "velocity", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let units = keys.number("velocity")?;
    let velocity = counts(units, axis, frame);
    let acceleration = counts(keys.number_or("acceleration", Some(0.0))?, axis, frame);
    let wait = keys.boolean_or("wait", true)?;
    keys.finish()?;
    carried(value, frame, |images| {
        images.set_mode(axis, 2)?;
        images.set_velocity(axis, velocity)?;
        images.set_acceleration(axis, acceleration)
    })?;
    let title = format!("run {} at {units} per second", frame.plan.name(axis));
    Some((Step::Velocity { axis, velocity, acceleration, wait }, HANDSHAKE, title))
}

/// `word = { axis, bits | value }`
fn word(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let mut keys = table(value, "word", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let known: Vec<_> = Control::all().iter_names().collect();
    let word = match (keys.find("bits"), keys.find("value")) {
        (Some(bits), None) => words(bits, "bits", &known, frame.problems)?.into_iter().collect(),
        (None, Some(value)) => Control::from_bits_retain(keys.in_range("value", value, &(0..=0xFFFF))?),
        _ => {
            let title = "`bits` and `value` are one or the other";
            return frame.problems.report(keys.span(), title, "expected one of them");
        }
    };
    keys.finish()?;
    carried(value, frame, |images| images.set_word(axis, word))?;
    let title = format!("control word of {}: {:#06x}", frame.plan.name(axis), word.bits());
    Some((Step::Word { axis, word }, HANDSHAKE, title))
}

/// `set = { axis, field, value }`
fn set(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let problems = frame.problems;
    let mut keys = table(value, "set", problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let place = keys.need("field")?;
    let Some(name) = place.get_ref().as_str() else {
        return wrong(place, "field", "the name of a field of the output", problems);
    };
    let Some(field) = frame.images.find_output(axis, name) else {
        let title = format!("the output has no field `{name}`");
        return problems.report(place.span(), title, "expected one that `axisbridge assembly` lists");
    };
    let place = keys.need("value")?;
    let Some(number) = whole(place).and_then(|number| i64::try_from(number).ok()) else {
        return wrong(place, "value", "a whole number, as it is sent", problems);
    };
    if !fits(&field, number) {
        let title = format!("{number} does not fit the field `{name}`");
        return problems.report(place.span(), title, format_args!("expected a {}", field.kind));
    }
    keys.finish()?;
    let title = format!("{name} of {}: {number}", frame.plan.name(axis));
    Some((Step::Set { axis, field: field.name, value: number }, HANDSHAKE, title))
}

/// `expect = { axis, status | status_off | fault | refusal | position | velocity, tolerance, within }`
fn expect(value: &Value<'_>, frame: &Frame<'_>) -> Option<Made> {
    let problems = frame.problems;
    let mut keys = table(value, "expect", problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let within = match keys.find("within") {
        Some(value) => span(value, "within", problems)?,
        None => EXPECTATION,
    };
    let conditions = ["status", "status_off", "fault", "refusal", "position", "velocity"];
    let named: Vec<_> = keys.keys().filter(|(name, ..)| conditions.contains(name)).collect();
    let [(name, _, wanted)] = named.as_slice() else {
        let title = format!("the step expects {} things", named.len());
        let expected = format!("expected one of {}", conditions.join(", "));
        return problems.report(keys.span(), title, expected);
    };
    conditions.iter().filter(|known| *known == name).for_each(|known| {
        keys.find(known);
    });
    let (condition, text) = condition(&mut keys, (name, wanted), axis, frame)?;
    keys.finish()?;
    let title = format!("expect {text} of {}", frame.plan.name(axis));
    Some((Step::Expect { axis, condition }, within, title))
}

fn condition(
    keys: &mut Keys<'_, '_>,
    (name, wanted): (&str, &Value<'_>),
    axis: usize,
    frame: &Frame<'_>,
) -> Option<(Condition, String)> {
    let problems = frame.problems;
    match name {
        "status" | "status_off" => {
            let known: Vec<_> = Status::all().iter_names().collect();
            let bits: Status = words(wanted, name, &known, problems)?.into_iter().collect();
            if bits.is_empty() {
                return problems.report(wanted.span(), "no bit is named", "expected a list of bits");
            }
            let on = name == "status";
            Some((
                Condition::Status { bits, on },
                format!("{} {}", names(bits), if on { "on" } else { "off" }),
            ))
        }
        "fault" => {
            let none = [("none", FaultCause(0))];
            let known: Vec<_> =
                none.into_iter().chain(FaultCause::NAMED.iter().map(|(code, name)| (*name, *code))).collect();
            let cause = match whole(wanted).and_then(|code| u16::try_from(code).ok()) {
                Some(code) => FaultCause(code),
                None => word_of(wanted, name, &known, problems)?,
            };
            shown(wanted, axis, "fault", frame)?;
            let condition = Condition::Fault(cause);
            Some((condition, condition.to_string()))
        }
        "refusal" => {
            let known: Vec<_> = Refusal::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
            let refusal = match whole(wanted).and_then(|code| u8::try_from(code).ok()) {
                Some(code) => Refusal(code),
                None => word_of(wanted, name, &known, problems)?,
            };
            shown(wanted, axis, "refusal", frame)?;
            let condition = Condition::Refusal(refusal);
            Some((condition, condition.to_string()))
        }
        _ => {
            let units = match number(wanted).filter(|number| number.is_finite()) {
                Some(units) => units,
                None => return wrong(wanted, name, "a finite number", problems),
            };
            let room = keys.number("tolerance")?;
            let (value, tolerance) = (counts(units, axis, frame), counts(room.abs(), axis, frame));
            let condition = match name {
                "position" => Condition::Position { value, tolerance },
                _ => Condition::Velocity { value, tolerance },
            };
            let shown = match name {
                "position" => frame.images.position(axis),
                _ => frame.images.velocity(axis),
            };
            if shown.is_none() {
                let title = format!("the input has no actual {name}");
                return problems.report(wanted.span(), title, "expected a layout with it");
            }
            let shown = |value: i64| f64_from_i64(value) / f64::from(frame.plan.counts[axis]);
            Some((condition, format!("{name} {} +/- {}", shown(value), shown(tolerance))))
        }
    }
}

/// Whether the input has a field of which something is expected.
fn shown(wanted: &Value<'_>, axis: usize, field: &str, frame: &Frame<'_>) -> Option<()> {
    match frame.images.find_input(axis, field) {
        Some(_) => Some(()),
        None => {
            let title = format!("the input has no field `{field}`");
            frame.problems.report(wanted.span(), title, "expected a layout with it")
        }
    }
}
