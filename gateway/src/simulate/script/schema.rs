//! The JSON Schema of scripts: keys, kinds of values, ranges and words, for editors and validators.
//!
//! Names of the standard (attributes, states, faults) are offered, and others are let through: the reader takes them in any spelling.

use profile_cip::wire::motion::codes::{
    AlarmType, AxisStateCode, EventChecking, EventType, FaultType, NodeAlarm, NodeFault,
};
use profile_cip::wire::status::GeneralStatus;
use schemars::Schema;
use serde_json::{Map, Value, json};

use super::UNEXPECTED_FAULTS;
use super::connection::{
    ACTUAL_POSITION_TYPES, ACTUALS, COMMANDS, FEEDBACKS, FORMATS, MODES, MULTIPLIERS, POSITION_TYPES,
    STATUSES, TARGETS, TIMES,
};
use super::exchange::{DIRECTIONS, HOOKUP_TESTS, MOTOR_TESTS, TESTS, WAYS};
use super::misbehave::UPDATES;
use super::step::VERBS;
use crate::config::form;
use crate::mapping::{CipDictionary, CipType};

/// A key of a table: its name, with `!` behind one that has to be there, and its values.
type Key<'k> = (&'k str, Value);

/// The schema.
#[must_use]
pub fn schema(dictionary: &CipDictionary) -> Value {
    let names = Names::new(dictionary);
    let axes: Map<String, Value> = (1..=16).map(|axis: u8| (axis.to_string(), reference("axis"))).collect();
    let root = [
        ("title", text()),
        ("unexpected_faults", word_of(UNEXPECTED_FAULTS)),
        ("connection", connection(&names)),
        (
            "axis!",
            json!({ "type": "object", "additionalProperties": false, "required": ["1"], "properties": axes }),
        ),
        ("step", list(reference("step"))),
    ];
    let mut schema = table(root);
    schema["$schema"] = Value::from("http://json-schema.org/draft-07/schema#");
    schema["title"] = Value::from("axisbridge script");
    schema["description"] = Value::from("A script of `axisbridge simulate controller --script FILE`.");
    schema["definitions"] = json!({ "axis": axis(&names), "step": step(&names) });
    schema
}

/// What the standard has names for.
struct Names {
    attribute: Value,
    class_attribute: Value,
    fault: Value,
    status: Value,
    io_status: Value,
}

impl Names {
    fn new(dictionary: &CipDictionary) -> Self {
        let attributes =
            |rows: &[crate::mapping::CipAttribute]| rows.iter().map(|row| row.name.clone()).collect();
        let bits = |set: &str| {
            let codes = dictionary.bits(set).map(|set| set.codes.as_slice()).unwrap_or_default();
            offered(codes.iter().map(|code| code.name.clone()).collect())
        };
        Self {
            attribute: offered(attributes(dictionary.attributes())),
            class_attribute: offered(attributes(dictionary.class_attributes())),
            fault: bits("Axis Exceptions"),
            status: bits("Axis Status"),
            io_status: bits("Axis I/O Status"),
        }
    }

    /// An attribute of an axis or of the class, by name or number.
    fn attribute(&self) -> Value {
        json!({ "anyOf": [self.attribute, self.class_attribute, whole(0, 65_535)] })
    }

    fn attributes(&self) -> Value {
        list(self.attribute())
    }

    /// A table of attributes and their values.
    fn values(&self) -> Value {
        let optional = table([("value!", value()), ("optional", boolean())]);
        json!({ "type": "object", "additionalProperties": { "anyOf": [value(), optional] } })
    }
}

fn connection(names: &Names) -> Value {
    let word = || whole(0, 0xFFFF);
    let key = [
        ("vendor_id", word()),
        ("device_type", word()),
        ("product_code", word()),
        ("major_revision", whole(0, 127)),
        ("minor_revision", whole(0, 255)),
        ("compatible", boolean()),
    ];
    let waits = [
        "explicit",
        "first_update",
        "service",
        "synchronization",
        "initialization",
        "axis_control",
        "motion_margin",
    ];
    let multipliers: Vec<i64> = MULTIPLIERS.iter().filter_map(|number| i64::try_from(*number).ok()).collect();
    table([
        ("target", text()),
        ("bind", text()),
        ("update_period", time()),
        ("timeout_multiplier", json!({ "enum": multipliers })),
        ("format", word_of(FORMATS)),
        ("synchronous", boolean()),
        ("grand_master", hex()),
        ("size", whole(50, 1400)),
        ("connection_point", whole(2, 3)),
        ("command_target", word_of(TARGETS)),
        ("time_data", words(TIMES)),
        ("late_after", whole(1, 255)),
        ("give_up_after", whole(1, 255)),
        ("list_identity", boolean()),
        ("key", table(key)),
        ("power_structure", whole(0, 0xFFFF_FFFF)),
        ("wait", table(waits.map(|key| (key, time())))),
        ("attributes", names.values()),
    ])
}

fn axis(names: &Names) -> Value {
    let limits = [
        ("velocity", positive()),
        ("acceleration", positive()),
        ("torque", positive()),
        ("position_min", number()),
        ("position_max", number()),
    ];
    let motion = ["velocity", "acceleration", "jerk"].map(|key| (key, number()));
    table([
        ("counts_per_unit", json!({ "anyOf": [positive(), { "const": "device" }] })),
        ("mode", word_of(MODES)),
        ("feedback", word_of(FEEDBACKS)),
        ("position_type", word_of(POSITION_TYPES)),
        ("actual_position_type", word_of(ACTUAL_POSITION_TYPES)),
        ("command", words(COMMANDS)),
        ("actual", words(ACTUALS)),
        ("status", words(STATUSES)),
        ("limits", table(limits)),
        ("motion", table(motion)),
        ("attributes", names.values()),
    ])
}

/// A step: one verb, and what goes with any of them.
fn step(names: &Names) -> Value {
    let verbs: Vec<Value> = VERBS.iter().map(|(verb, _)| json!({ "required": [verb] })).collect();
    let keys = VERBS.iter().map(|(verb, _)| (*verb, arguments(verb, names)));
    let more = [
        ("title", text()),
        ("within", time()),
        ("wait", boolean()),
        ("refused", json!({ "anyOf": [boolean(), general_status()] })),
    ];
    let mut step = table(keys.chain(more).collect::<Vec<_>>());
    step["oneOf"] = Value::Array(verbs);
    step
}

/// What a verb takes.
fn arguments(verb: &str, names: &Names) -> Value {
    match verb {
        "enable" | "disable" | "shutdown" | "shutdown_reset" | "abort" | "fault_reset" | "stop_process"
        | "cancel" => axes(),
        "request" => table([("axes!", axes()), ("code!", whole(1, 255))]),
        "node_fault_reset" | "reconnect" => json!({ "const": true }),
        "move" | "jog" | "velocity" | "torque" | "stop" | "mode" | "feedback" | "redefine_position"
        | "in_window" => motion(verb),
        "data_sets" => of_axis(vec![
            ("command", words(COMMANDS)),
            ("actual", words(ACTUALS)),
            ("status", words(STATUSES)),
            ("position_type", word_of(POSITION_TYPES)),
        ]),
        "time_data" => words(TIMES),
        "command_target" => word_of(TARGETS),
        "dwell" => time(),
        "together" | "sequence" => list(reference("step")),
        "set" | "get" | "cyclic_write_list" | "cyclic_read_list" | "cyclic_write" | "service"
        | "explicit" => exchange(verb, names),
        "run_hookup_test" | "run_motor_test" | "run_inertia_test" | "test_result" => test(verb),
        "arm" | "disarm" | "expect_event" => event(verb),
        "expect" | "expect_fault" | "expect_alarm" => expectation(verb, names),
        "misbehave" => misbehaviour(),
        // A test finds a verb without arguments.
        _ => Value::Bool(false),
    }
}

fn motion(verb: &str) -> Value {
    let to_or_by = |mut table: Value| {
        table["oneOf"] = json!([{ "required": ["to"] }, { "required": ["by"] }]);
        table
    };
    let ramp = || [("acceleration", number()), ("jerk", number())];
    let with_ramp = |keys: Vec<Key<'static>>| of_axis(keys.into_iter().chain(ramp()).collect());
    match verb {
        "move" => to_or_by(with_ramp(vec![("to", number()), ("by", number()), ("velocity", number())])),
        "jog" => with_ramp(vec![("velocity!", number()), ("for!", time())]),
        "velocity" => with_ramp(vec![("velocity!", number())]),
        "torque" => of_axis(vec![("torque!", number()), ("rate!", number()), ("velocity_limit!", number())]),
        "stop" => with_ramp(Vec::new()),
        "mode" => of_axis(vec![("control!", word_of(MODES))]),
        "feedback" => of_axis(vec![
            ("source!", word_of(FEEDBACKS)),
            ("actual_position_type", word_of(ACTUAL_POSITION_TYPES)),
        ]),
        "redefine_position" => to_or_by(of_axis(vec![("to", number()), ("by", number())])),
        _ => of_axis(vec![("window!", number()), ("wait", time())]),
    }
}

fn exchange(verb: &str, names: &Names) -> Value {
    let by = || ("by", word_of(WAYS));
    let data_type = || ("type", offered(CipType::NAMED.iter().map(|(name, _)| (*name).to_owned()).collect()));
    let one_of = |mut table: Value, one: &[&str]| {
        table["oneOf"] = json!([{ "required": ["attributes"] }, { "required": one }]);
        table
    };
    let status = || ("status", json!({ "anyOf": [{ "const": "any" }, general_status()] }));
    match verb {
        "set" => {
            let keys = vec![
                by(),
                ("attributes", names.values()),
                ("attribute", names.attribute()),
                ("value", value()),
                data_type(),
            ];
            one_of(of_class(keys), &["attribute", "value"])
        }
        "get" => {
            let keys =
                vec![by(), ("attributes", names.attributes()), ("attribute", names.attribute()), data_type()];
            one_of(of_class(keys), &["attribute"])
        }
        "cyclic_read_list" => of_axis(vec![("attributes!", names.attributes())]),
        "cyclic_write_list" | "cyclic_write" => of_axis(vec![("attributes!", names.values())]),
        "service" => {
            of_class(vec![("code!", json!({ "anyOf": [whole(0, 255), text()] })), ("data", hex()), status()])
        }
        _ => table([
            ("service!", whole(1, 0x7F)),
            ("class!", whole(0, 0xFFFF)),
            ("instance", whole(0, 0xFFFF)),
            ("attribute", whole(0, 0xFFFF)),
            ("data", hex()),
            status(),
        ]),
    }
}

fn test(verb: &str) -> Value {
    match verb {
        "run_hookup_test" => of_axis(vec![
            ("type!", word_of(HOOKUP_TESTS)),
            ("channel", whole(0, 255)),
            ("distance", number()),
            ("time", number()),
        ]),
        "run_motor_test" => of_axis(vec![("type!", word_of(MOTOR_TESTS))]),
        "run_inertia_test" => of_axis(vec![
            ("direction", word_of(DIRECTIONS)),
            ("velocity!", number()),
            ("torque!", number()),
            ("travel_limit!", number()),
        ]),
        _ => {
            of_axis(vec![("test!", word_of(TESTS)), ("status", json!({ "anyOf": [text(), whole(0, 255)] }))])
        }
    }
}

fn event(verb: &str) -> Value {
    let named = EventChecking::NAMED.iter().filter(|(bit, _)| EventChecking::EVENTS.contains(*bit));
    let mut events = list(offered(named.map(|(_, name)| (*name).to_owned()).collect()));
    events["minItems"] = Value::from(1);
    match verb {
        "arm" => of_axis(vec![
            ("events!", events),
            ("rearm", boolean()),
            ("window", json!({ "type": "array", "items": number(), "minItems": 2, "maxItems": 2 })),
            ("watch", number()),
            ("home_torque_threshold", number()),
            ("home_torque_time", number()),
        ]),
        "disarm" => of_axis(vec![("events!", events)]),
        _ => {
            let mut expected = of_axis(vec![
                ("type!", named_codes(EventType::NAMED)),
                ("position", number()),
                ("tolerance", number()),
                ("within", time()),
            ]);
            expected["dependencies"] = json!({ "position": ["tolerance"] });
            expected
        }
    }
}

fn expectation(verb: &str, names: &Names) -> Value {
    let code = || json!({ "anyOf": [names.fault, whole(0, 255)] });
    let within = || ("within", time());
    match verb {
        "expect_fault" => of_axis(vec![
            ("type", named_codes(FaultType::NAMED)),
            ("code", code()),
            ("sub_code", whole(0, 255)),
            within(),
        ]),
        "expect_alarm" => of_axis(vec![
            ("type", named_codes(AlarmType::NAMED)),
            ("code", code()),
            ("raised", boolean()),
            within(),
        ]),
        _ => {
            let axis = ("axis!", whole(0, 16));
            let data_type = data_type();
            let some = |names: &Value| json!({ "type": "array", "items": names, "minItems": 1 });
            let of_axis = [
                vec![("state!", named_codes(AxisStateCode::NAMED))],
                vec![("position!", number()), ("tolerance!", number())],
                vec![("velocity!", number()), ("tolerance!", number())],
                vec![("mode!", word_of(MODES))],
                vec![("status!", some(&names.status))],
                vec![("status_off!", some(&names.status))],
                vec![("io_status!", some(&names.io_status))],
                vec![("io_status_off!", some(&names.io_status))],
                vec![
                    ("attribute!", names.attribute()),
                    ("value!", value()),
                    ("type", data_type.clone()),
                    ("tolerance", number()),
                ],
                vec![
                    ("cyclic!", names.attribute()),
                    ("value!", value()),
                    ("type", data_type),
                    ("tolerance", number()),
                ],
            ];
            let of_node = [
                ("node_fault!", named_codes(NodeFault::NAMED)),
                ("node_alarm!", named_codes(NodeAlarm::NAMED)),
                ("connection!", json!({ "const": "lost" })),
                ("lost_updates!", whole(1, 255)),
                ("late_updates!", whole(1, 255)),
                ("synchronous!", boolean()),
                ("no_fault!", json!({ "const": true })),
            ];
            let of_axis = of_axis
                .into_iter()
                .map(|keys| table(keys.into_iter().chain([axis.clone(), within()]).collect::<Vec<_>>()));
            let of_node = of_node.into_iter().map(|key| table([key, within()]));
            json!({ "anyOf": of_axis.chain(of_node).collect::<Vec<_>>() })
        }
    }
}

fn misbehaviour() -> Value {
    let count = || whole(1, i64::try_from(*UPDATES.end()).unwrap_or(i64::MAX));
    let updates = || ("updates", count());
    let kinds = [
        table([("skip_updates!", count())]),
        table([("delay!", time()), updates()]),
        table([("duplicate!", count())]),
        table([("reorder!", count())]),
        table([("stale_time_stamp!", time()), updates()]),
        table([("wrong_sequence!", whole(1, 0x7FFF_FFFF)), updates()]),
        table([("wrong_update_id!", whole(1, 255)), updates()]),
        table([("truncate!", whole(1, 1400)), updates()]),
        table([("omit_set_point!", axes()), updates()]),
        table([("wrong_mode!", whole(0, 15)), ("axes!", axes()), updates()]),
        table([("vanish!", json!({ "const": true }))]),
        table([("drop_tcp!", json!({ "const": true }))]),
    ];
    json!({ "anyOf": kinds })
}

/// A table with these keys and no others.
fn table<'k>(keys: impl IntoIterator<Item = Key<'k>>) -> Value {
    let mut required = Vec::new();
    let mut properties = Map::new();
    for (key, value) in keys {
        let name = key.trim_end_matches('!');
        if name != key {
            required.push(name);
        }
        properties.insert(name.to_owned(), value);
    }
    json!({ "type": "object", "additionalProperties": false, "required": required, "properties": properties })
}

/// A table about an axis.
fn of_axis(keys: Vec<Key<'_>>) -> Value {
    table(keys.into_iter().chain([("axis!", whole(1, 16))]))
}

/// A table about an axis or, with 0, the class.
fn of_class(keys: Vec<Key<'_>>) -> Value {
    table(keys.into_iter().chain([("axis!", whole(0, 16))]))
}

fn axes() -> Value {
    json!({ "anyOf": [{ "const": "all" }, whole(1, 16), list(whole(1, 16))] })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/definitions/{name}") })
}

fn list(items: Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn text() -> Value {
    json!({ "type": "string" })
}

fn boolean() -> Value {
    json!({ "type": "boolean" })
}

fn number() -> Value {
    json!({ "type": "number" })
}

fn positive() -> Value {
    json!({ "type": "number", "exclusiveMinimum": 0 })
}

fn whole(least: i64, most: i64) -> Value {
    json!({ "type": "integer", "minimum": least, "maximum": most })
}

/// The value of an attribute: a number, a name of an enumeration, a string, or a list of them.
fn value() -> Value {
    json!({ "type": ["number", "string", "boolean", "array"] })
}

fn hex() -> Value {
    json!({ "type": "string", "pattern": "^(\\s*[0-9A-Fa-f]\\s*[0-9A-Fa-f])*\\s*$" })
}

fn time() -> Value {
    let mut schema: Schema = schemars::json_schema!({ "type": "string" });
    form::time(&mut schema);
    schema.to_value()
}

/// One of the words of the reader.
fn word_of<T>(known: &[(&str, T)]) -> Value {
    json!({ "enum": known.iter().map(|(name, _)| *name).collect::<Vec<_>>() })
}

fn words<T>(known: &[(&str, T)]) -> Value {
    list(word_of(known))
}

/// Names of the standard, and any other text.
fn offered(names: Vec<String>) -> Value {
    json!({ "anyOf": [{ "enum": names }, text()] })
}

fn data_type() -> Value {
    offered(CipType::NAMED.iter().map(|(name, _)| (*name).to_owned()).collect())
}

fn named_codes<T>(named: &[(T, &str)]) -> Value {
    offered(named.iter().map(|(_, name)| (*name).to_owned()).collect())
}

fn general_status() -> Value {
    json!({ "anyOf": [named_codes(GeneralStatus::NAMED), whole(0, 255)] })
}
