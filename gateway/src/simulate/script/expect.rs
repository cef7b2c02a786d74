//! Verbs that wait until something is so.

use profile_cip::controller::Step;
use profile_cip::controller::condition::{AlarmPattern, Condition, FaultPattern};
use profile_cip::wire::motion::codes::{
    AlarmType, AxisIoStatus, AxisStateCode, AxisStatus, FaultType, NodeAlarm, NodeFault,
};
use profile_generic::time::DurationNs;
use toml::de::DeValue;

use super::attributes::{attribute, check, data_type};
use super::connection::MODES;
use super::reader::{Keys, Problems, Value, folded, table, whole, word_of, words, wrong};
use super::step::{Frame, Modifiers, axis, instance};
use crate::mapping::CipDictionary;

/// How long to wait where the step does not say.
const WITHIN: DurationNs = DurationNs::from_secs(1);

/// Conditions of an axis, by their key.
const OF_AXIS: &[&str] = &[
    "state",
    "position",
    "velocity",
    "mode",
    "status",
    "status_off",
    "io_status",
    "io_status_off",
    "attribute",
    "cyclic",
];

pub(super) fn done(
    keys: &mut Keys<'_, '_>,
    modifiers: &mut Modifiers<'_>,
    condition: Condition,
) -> Option<Step> {
    // Beside the verb or among its arguments, `within` says the same.
    let within = keys.duration_or("within", modifiers.within.take().unwrap_or(WITHIN))?;
    Some(Step::Expect { condition, within })
}

/// `expect = { axis, state | position | ..., within }`
pub(super) fn expect(value: &Value<'_>, frame: &Frame<'_>, modifiers: &mut Modifiers<'_>) -> Option<Step> {
    let mut keys = table(value, "expect", frame.problems)?;
    let of_axis = keys.keys().any(|(name, ..)| OF_AXIS.contains(&name));
    let condition =
        if of_axis { axis_condition(&mut keys, frame)? } else { node_condition(&mut keys, frame)? };
    let step = done(&mut keys, modifiers, condition)?;
    keys.finish()?;
    Some(step)
}

fn axis_condition(keys: &mut Keys<'_, '_>, frame: &Frame<'_>) -> Option<Condition> {
    let problems = frame.problems;
    let place = keys.need("axis")?;
    let class_too = keys.keys().any(|(name, ..)| name == "attribute");
    let axis = instance(place, frame, u8::from(!class_too))?;
    if let Some(value) = keys.find("state") {
        let names: Vec<_> = AxisStateCode::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
        return Some(Condition::State { axis, state: word_of(value, "state", &names, problems)? });
    }
    if let Some(value) = keys.find("position") {
        let position = keys.finite("position", value)?;
        return Some(Condition::Position { axis, position, tolerance: keys.number("tolerance")? });
    }
    if let Some(value) = keys.find("velocity") {
        let velocity = keys.finite("velocity", value)?;
        return Some(Condition::Velocity { axis, velocity, tolerance: keys.number("tolerance")? });
    }
    if let Some(value) = keys.find("mode") {
        return Some(Condition::Mode { axis, mode: word_of(value, "mode", MODES, problems)? });
    }
    for (key, on) in [("status", true), ("status_off", false)] {
        if let Some(value) = keys.find(key) {
            let bits = AxisStatus::from_bits_retain(bits(value, key, "Axis Status", frame)?);
            return Some(Condition::Status { axis, bits, on });
        }
    }
    for (key, on) in [("io_status", true), ("io_status_off", false)] {
        if let Some(value) = keys.find(key) {
            let bits = AxisIoStatus::from_bits_retain(bits(value, key, "Axis I/O Status", frame)?);
            return Some(Condition::IoStatus { axis, bits, on });
        }
    }
    attribute_condition(keys, axis, frame)
}

fn attribute_condition(keys: &mut Keys<'_, '_>, axis: u8, frame: &Frame<'_>) -> Option<Condition> {
    let cyclic = keys.find("cyclic");
    let name = match cyclic {
        Some(name) => name,
        None => keys.need("attribute")?,
    };
    let data_type = data_type(keys)?;
    let attribute = attribute(name, data_type, axis == 0, frame.dictionary, frame.problems)?;
    let wanted = keys.need("value")?;
    let tolerance = keys.number_or("tolerance", Some(0.0))?;
    let check = check(wanted, tolerance, &attribute, frame.dictionary, frame.problems)?;
    Some(match cyclic {
        Some(_) => Condition::CyclicRead { axis, attribute: attribute.id, check },
        None => Condition::Attribute { axis, selector: attribute.selector(), check },
    })
}

fn node_condition(keys: &mut Keys<'_, '_>, frame: &Frame<'_>) -> Option<Condition> {
    let problems = frame.problems;
    if let Some(value) = keys.find("node_fault") {
        let names: Vec<_> = NodeFault::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
        return Some(Condition::NodeFault(word_of(value, "node_fault", &names, problems)?));
    }
    if let Some(value) = keys.find("node_alarm") {
        let names: Vec<_> = NodeAlarm::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
        return Some(Condition::NodeAlarm(word_of(value, "node_alarm", &names, problems)?));
    }
    if let Some(value) = keys.find("connection") {
        word_of(value, "connection", &[("lost", ())], problems)?;
        return Some(Condition::ConnectionLost);
    }
    if let Some(value) = keys.find("lost_updates") {
        return Some(Condition::LostUpdates(keys.in_range("lost_updates", value, &(1..=255))?));
    }
    if let Some(value) = keys.find("late_updates") {
        return Some(Condition::LateUpdates(keys.in_range("late_updates", value, &(1..=255))?));
    }
    if keys.find("synchronous").is_some() {
        return Some(Condition::Synchronous(keys.boolean_or("synchronous", true)?));
    }
    if let Some(value) = keys.find("no_fault") {
        return match value.get_ref() {
            DeValue::Boolean(true) => Some(Condition::NoFault),
            _ => wrong(value, "no_fault", "true", problems),
        };
    }
    let names =
        ["node_fault", "node_alarm", "connection", "lost_updates", "late_updates", "synchronous", "no_fault"];
    let all: Vec<_> = OF_AXIS.iter().chain(&names).map(|name| format!("`{name}`")).collect();
    let unknown = keys.keys().find(|(name, ..)| !["axis", "within"].contains(name));
    let (span, title) = match unknown {
        Some((name, span, _)) => (span, format!("unknown key `{name}` in expect")),
        None => (keys.span(), "nothing is expected".to_owned()),
    };
    problems.report(span, title, format_args!("expected one of {}", all.join(", ")))
}

/// Named bits of a status word.
fn bits(value: &Value<'_>, key: &str, set: &str, frame: &Frame<'_>) -> Option<u32> {
    let names = bit_names(set, frame.dictionary);
    let set: Vec<(&str, u32)> = names.iter().map(|(name, bit)| (name.as_str(), *bit)).collect();
    let found = words(value, key, &set, frame.problems)?;
    if found.is_empty() {
        return frame.problems.report(value.span(), "no bit is named", "expected a list of names");
    }
    Some(found.into_iter().fold(0, |all, bit| all | (1 << bit)))
}

fn bit_names(set: &str, dictionary: &CipDictionary) -> Vec<(String, u32)> {
    let known = dictionary.bits(set).map(|set| set.codes.as_slice()).unwrap_or_default();
    known.iter().filter(|code| code.code < 32).map(|code| (code.name.clone(), code.code)).collect()
}

/// The number of a fault or alarm: as it is, or by the name of the exception.
fn code(value: &Value<'_>, frame: &Frame<'_>) -> Option<u8> {
    if let Some(code) = whole(value).and_then(|number| u8::try_from(number).ok()) {
        return Some(code);
    }
    let Some(name) = value.get_ref().as_str() else {
        return wrong(value, "code", "the number of a fault or its name in the standard", frame.problems);
    };
    let known = frame.dictionary.bits("Axis Exceptions").map(|set| set.codes.as_slice()).unwrap_or_default();
    let found = known.iter().find(|code| folded(&code.name) == folded(name));
    match found.and_then(|code| u8::try_from(code.code).ok()) {
        Some(code) => Some(code),
        None => {
            let near = super::attributes::nearest(name, known.iter().map(|code| code.name.as_str()));
            let expected = near.map(|near| format!("did you mean \"{near}\"?"));
            let expected =
                expected.unwrap_or_else(|| "expected a name of the standard, or a number".to_owned());
            frame.problems.report(value.span(), format_args!("`{name}` is no fault of an axis"), expected)
        }
    }
}

fn maybe<T>(found: Option<Option<T>>) -> Option<Option<T>> {
    match found {
        Some(Some(value)) => Some(Some(value)),
        Some(None) => None,
        None => Some(None),
    }
}

fn kinds<T: Copy>(named: &[(T, &'static str)]) -> Vec<(&'static str, T)> {
    named.iter().map(|(code, name)| (*name, *code)).collect()
}

fn kind<T: Copy>(
    keys: &mut Keys<'_, '_>,
    named: &[(T, &'static str)],
    problems: &Problems,
) -> Option<Option<T>> {
    maybe(keys.find("type").map(|value| word_of(value, "type", &kinds(named), problems)))
}

/// `expect_fault = { axis, type, code, sub_code, within }`
pub(super) fn fault(value: &Value<'_>, frame: &Frame<'_>, modifiers: &mut Modifiers<'_>) -> Option<Step> {
    let mut keys = table(value, "expect_fault", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let fault_type = kind(&mut keys, FaultType::NAMED, frame.problems)?;
    let sub = keys.find("sub_code");
    let pattern = FaultPattern {
        fault_type,
        code: maybe(keys.find("code").map(|value| code(value, frame)))?,
        sub_code: maybe(sub.map(|value| keys.in_range("sub_code", value, &(0..=255))))?,
    };
    let step = done(&mut keys, modifiers, Condition::Fault { axis, pattern })?;
    keys.finish()?;
    Some(step)
}

/// `expect_alarm = { axis, type, code, raised, within }`
pub(super) fn alarm(value: &Value<'_>, frame: &Frame<'_>, modifiers: &mut Modifiers<'_>) -> Option<Step> {
    let mut keys = table(value, "expect_alarm", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let alarm_type = kind(&mut keys, AlarmType::NAMED, frame.problems)?;
    let raised = match keys.find("raised") {
        Some(_) => Some(keys.boolean_or("raised", true)?),
        None => None,
    };
    let code = maybe(keys.find("code").map(|value| code(value, frame)))?;
    let step = done(
        &mut keys,
        modifiers,
        Condition::Alarm { axis, pattern: AlarmPattern { alarm_type, code, raised } },
    )?;
    keys.finish()?;
    Some(step)
}
