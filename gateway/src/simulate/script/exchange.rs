//! Verbs that exchange data: attributes, cyclic lists, services, explicit messages, tests.

use profile_cip::controller::program::{CyclicAttribute, CyclicDirection, ExplicitMessage};
use profile_cip::controller::{AttributeSet, Step};
use profile_cip::wire::Writer;
use profile_cip::wire::motion::attribute_list::{AttributeSelector, ListWriter};
use profile_cip::wire::motion::codes::{MotionService, TestStatus};
use profile_cip::wire::motion::test_service::{RunHookupTest, RunInertiaTest, RunMotorTest};
use toml::de::DeValue;

use super::attributes::{Attribute, attribute, data_type, encode};
use super::connection::attribute_sets;
use super::reader::{Keys, Value, folded, hex, table, whole, wrong};
use super::step::{Frame, axis, general_status, instance};

/// Class code of the Motion Device Axis Object.
const MOTION_AXIS_CLASS: u16 = 0x42;
/// Explicit services for one attribute.
const GET_ATTRIBUTE_SINGLE: u8 = 0x0E;
const SET_ATTRIBUTE_SINGLE: u8 = 0x10;
/// Longest body of a list.
const BODY_MAX: usize = 1400;

/// Way of an attribute: the service channel or explicit messages.
pub(super) const WAYS: &[(&str, bool)] = &[("service", false), ("explicit", true)];

/// What a hookup test tests.
pub(super) const HOOKUP_TESTS: &[(&str, u8)] =
    &[("motor and feedback", 0), ("feedback", 1), ("marker", 2), ("commutation", 3)];

/// How a motor test runs.
pub(super) const MOTOR_TESTS: &[(&str, u8)] = &[("static", 0), ("dynamic", 1), ("calculated", 2)];

/// Which way an inertia test turns.
pub(super) const DIRECTIONS: &[(&str, u8)] = &[("forward", 0), ("reverse", 1)];

/// Tests whose result can be awaited.
pub(super) const TESTS: &[(&str, MotionService)] = &[
    ("hookup", MotionService::GET_HOOKUP_TEST_DATA),
    ("motor", MotionService::GET_MOTOR_TEST_DATA),
    ("inertia", MotionService::GET_INERTIA_TEST_DATA),
];

fn keys<'a, 't>(
    value: &'a Value<'t>,
    what: &'a str,
    frame: &'a Frame<'_>,
    first: u8,
) -> Option<(Keys<'a, 't>, u8)> {
    let mut keys = table(value, what, frame.problems)?;
    let axis = instance(keys.need("axis")?, frame, first)?;
    Some((keys, axis))
}

/// `set = { axis, attribute, value, type, by }` or `set = { axis, attributes = { ... }, by }`
pub(super) fn set(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "set", frame, 0)?;
    let explicit = keys.word_or("by", WAYS, false)?;
    let attributes = match keys.find("attributes") {
        Some(list) => {
            let sets = attribute_sets(list, axis == 0, frame.dictionary, frame.problems)?;
            keys.finish()?;
            if explicit {
                let service = MotionService::SET_AXIS_ATTRIBUTES_LIST;
                let data = list_body(value, frame, |list| {
                    sets.iter().try_for_each(|set| list.value(&set.selector, &set.value))
                })?;
                return Some(list_message(axis, service, data));
            }
            sets
        }
        None => {
            let name = keys.need("attribute");
            let new = keys.need("value");
            let data_type = data_type(&mut keys)?;
            let attribute = attribute(name?, data_type, axis == 0, frame.dictionary, frame.problems)?;
            let bytes = encode(new?, &attribute, frame.dictionary, frame.problems)?;
            keys.finish()?;
            if explicit {
                return Some(single(axis, SET_ATTRIBUTE_SINGLE, attribute.id, bytes));
            }
            vec![AttributeSet { selector: attribute.selector(), value: bytes, required: true }]
        }
    };
    Some(Step::SetAttributes { axis, attributes })
}

/// `get = { axis, attribute, type, by }` or `get = { axis, attributes = [...], by }`
pub(super) fn get(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "get", frame, 0)?;
    let explicit = keys.word_or("by", WAYS, false)?;
    if let Some(list) = keys.find("attributes") {
        let selectors: Vec<AttributeSelector> =
            named_list(list, axis == 0, frame)?.iter().map(Attribute::selector).collect();
        keys.finish()?;
        if explicit {
            let service = MotionService::GET_AXIS_ATTRIBUTES_LIST;
            let data = list_body(value, frame, |list| selectors.iter().try_for_each(|s| list.select(s)))?;
            return Some(list_message(axis, service, data));
        }
        return Some(Step::ReadAttributes { axis, attributes: selectors });
    }
    let name = keys.need("attribute");
    let data_type = data_type(&mut keys)?;
    let attribute = attribute(name?, data_type, axis == 0, frame.dictionary, frame.problems)?;
    keys.finish()?;
    if explicit {
        return Some(single(axis, GET_ATTRIBUTE_SINGLE, attribute.id, Vec::new()));
    }
    Some(Step::ReadAttributes { axis, attributes: vec![attribute.selector()] })
}

fn list_body(
    value: &Value<'_>,
    frame: &Frame<'_>,
    write: impl FnOnce(&mut ListWriter<'_>) -> Result<(), profile_cip::wire::Error>,
) -> Option<Vec<u8>> {
    let mut body = vec![0; BODY_MAX];
    let written = ListWriter::new(&mut body).and_then(|mut list| {
        write(&mut list)?;
        Ok(list.finish())
    });
    match written {
        Ok(length) => {
            body.truncate(length);
            Some(body)
        }
        Err(error) => frame.problems.report(value.span(), "the list is too long", error),
    }
}

fn list_message(axis: u8, service: MotionService, data: Vec<u8>) -> Step {
    let (class, instance) = (MOTION_AXIS_CLASS, u16::from(axis));
    let message = ExplicitMessage { service: service.0, class, instance, attribute: None, data };
    Step::Explicit { message, status: Some(0) }
}

fn single(axis: u8, service: u8, attribute: u16, data: Vec<u8>) -> Step {
    let (class, instance) = (MOTION_AXIS_CLASS, u16::from(axis));
    let message = ExplicitMessage { service, class, instance, attribute: Some(attribute), data };
    Step::Explicit { message, status: Some(0) }
}

fn named_list(value: &Value<'_>, class: bool, frame: &Frame<'_>) -> Option<Vec<Attribute>> {
    let DeValue::Array(items) = value.get_ref() else {
        return wrong(value, "attributes", "a list of attributes", frame.problems);
    };
    let found: Vec<Option<Attribute>> =
        items.iter().map(|item| attribute(item, None, class, frame.dictionary, frame.problems)).collect();
    found.into_iter().collect()
}

fn cyclic(set: AttributeSet) -> CyclicAttribute {
    CyclicAttribute { id: set.selector.id, element_size: set.selector.element_size, value: set.value }
}

/// `cyclic_write_list = { axis, attributes = { name = value } }`
pub(super) fn write_list(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "cyclic_write_list", frame, 1)?;
    let sets = attribute_sets(keys.need("attributes")?, false, frame.dictionary, frame.problems)?;
    keys.finish()?;
    let attributes = sets.into_iter().map(cyclic).collect();
    Some(Step::CyclicList { axis, direction: CyclicDirection::Write, attributes })
}

/// `cyclic_read_list = { axis, attributes = [...] }`
pub(super) fn read_list(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "cyclic_read_list", frame, 1)?;
    let list = named_list(keys.need("attributes")?, false, frame)?;
    keys.finish()?;
    let attributes = list
        .iter()
        .map(|attribute| {
            let selector = attribute.selector();
            let value = vec![0; selector.value_len().unwrap_or(0)];
            CyclicAttribute { id: selector.id, element_size: selector.element_size, value }
        })
        .collect();
    Some(Step::CyclicList { axis, direction: CyclicDirection::Read, attributes })
}

/// `cyclic_write = { axis, attributes = { name = value } }`
pub(super) fn cyclic_write(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "cyclic_write", frame, 1)?;
    let sets = attribute_sets(keys.need("attributes")?, false, frame.dictionary, frame.problems)?;
    keys.finish()?;
    let values = sets.into_iter().map(|set| (set.selector.id, set.value)).collect();
    Some(Step::CyclicWrite { axis, values })
}

/// `status`: the general status expected, success where nothing is said, `"any"` for any.
#[expect(clippy::option_option, reason = "any status, or one in particular")]
fn status(keys: &mut Keys<'_, '_>) -> Option<Option<u8>> {
    match keys.find("status") {
        Some(value) if value.get_ref().as_str() == Some("any") => Some(None),
        Some(value) => general_status(value, "status", keys.problems).map(Some),
        None => Some(Some(0)),
    }
}

fn data(keys: &mut Keys<'_, '_>) -> Option<Vec<u8>> {
    match keys.find("data") {
        Some(value) => hex(value, "data", keys.problems),
        None => Some(Vec::new()),
    }
}

/// A service of the axis object by name or number.
fn motion_service(value: &Value<'_>, frame: &Frame<'_>) -> Option<MotionService> {
    if let Some(code) = whole(value).and_then(|number| u8::try_from(number).ok()) {
        return Some(MotionService(code));
    }
    let name = value.get_ref().as_str().unwrap_or_default();
    let known = MotionService::NAMED.iter().find(|(_, known)| folded(known) == folded(name));
    match known {
        Some((service, _)) => Some(*service),
        None => wrong(value, "code", "the code of a service or its name in the standard", frame.problems),
    }
}

/// `service = { axis, code, data, status }`
pub(super) fn service(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "service", frame, 0)?;
    let service = motion_service(keys.need("code")?, frame)?;
    let (data, status) = (data(&mut keys)?, status(&mut keys)?);
    keys.finish()?;
    Some(Step::Service { axis, service, data, status })
}

/// `explicit = { service, class, instance, attribute, data, status }`
pub(super) fn explicit(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    const WORD: std::ops::RangeInclusive<i128> = 0..=0xFFFF;
    let mut keys = table(value, "explicit", frame.problems)?;
    let service = keys.integer("service", 1..=0x7F)?;
    let (class, instance) = (keys.integer("class", WORD)?, keys.integer_or("instance", WORD, 1)?);
    let attribute = match keys.find("attribute") {
        Some(value) => Some(keys.in_range("attribute", value, &WORD)?),
        None => None,
    };
    let (data, status) = (data(&mut keys)?, status(&mut keys)?);
    keys.finish()?;
    Some(Step::Explicit { message: ExplicitMessage { service, class, instance, attribute, data }, status })
}

/// Runs a test of the object; its result is fetched by `test_result`.
fn run_test(
    axis: u8,
    service: MotionService,
    value: &Value<'_>,
    frame: &Frame<'_>,
    emit: impl FnOnce(&mut Writer<'_>) -> Result<(), profile_cip::wire::Error>,
) -> Option<Step> {
    let mut body = [0; 32];
    let mut writer = Writer::new(&mut body);
    if let Err(error) = emit(&mut writer) {
        return frame.problems.report(value.span(), "the request does not fit", error);
    }
    let length = writer.written();
    Some(Step::Service { axis, service, data: body[..length].to_vec(), status: Some(0) })
}

#[expect(clippy::cast_possible_truncation, reason = "REAL is what the request has")]
const fn real(value: f64) -> f32 {
    value as f32
}

/// `run_hookup_test = { axis, type, channel, distance, time }`
pub(super) fn hookup_test(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "run_hookup_test", frame, 1)?;
    let request = RunHookupTest {
        test_type: keys.word("type", HOOKUP_TESTS)?,
        feedback_channel: keys.integer_or("channel", 0..=255, 1)?,
        distance: real(keys.number_or("distance", Some(0.0))?),
        time: real(keys.number_or("time", Some(0.0))?),
    };
    keys.finish()?;
    run_test(axis, MotionService::RUN_HOOKUP_TEST, value, frame, |writer| request.emit(writer))
}

/// `run_motor_test = { axis, type }`
pub(super) fn motor_test(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "run_motor_test", frame, 1)?;
    let request = RunMotorTest { test_type: keys.word("type", MOTOR_TESTS)? };
    keys.finish()?;
    run_test(axis, MotionService::RUN_MOTOR_TEST, value, frame, |writer| request.emit(writer))
}

/// `run_inertia_test = { axis, direction, velocity, torque, travel_limit }`
pub(super) fn inertia_test(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "run_inertia_test", frame, 1)?;
    let request = RunInertiaTest {
        direction: keys.word_or("direction", DIRECTIONS, 0)?,
        velocity: real(keys.number("velocity")?),
        torque: real(keys.number("torque")?),
        travel_limit: real(keys.number("travel_limit")?),
    };
    keys.finish()?;
    run_test(axis, MotionService::RUN_INERTIA_TEST, value, frame, |writer| request.emit(writer))
}

/// `test_result = { axis, test, status }`
pub(super) fn test_result(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let mut keys = table(value, "test_result", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let service = keys.word("test", TESTS)?;
    let status = match keys.find("status") {
        Some(value) => match whole(value).and_then(|code| u8::try_from(code).ok()) {
            Some(code) => TestStatus(code),
            None => {
                let names: Vec<(&str, TestStatus)> =
                    TestStatus::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
                super::reader::word_of(value, "status", &names, frame.problems)?
            }
        },
        None => TestStatus::SUCCESSFUL,
    };
    keys.finish()?;
    Some(Step::TestResult { axis, service, status })
}
