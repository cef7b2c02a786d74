//! What makes a row the row that it is.

/// A list of rows in a table, or in a row.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// The key of the list.
    pub name: &'static str,
    /// The keys that tell one row from another. A row has the first of them at least.
    pub key: &'static [&'static str],
    /// Whether the first row that fits wins, so that rows that are added come before those that are there.
    pub first_wins: bool,
    /// Keys that say the same thing in different ways: where a row of an overlay has some of them, the others of the row that is there go.
    pub either: &'static [&'static str],
    /// Lists of rows in a row that are laid over row by row as well; any other list is replaced as a whole.
    pub lists: &'static [Section],
}

const fn section(name: &'static str, key: &'static [&'static str]) -> Section {
    Section { name, key, first_wins: false, either: &[], lists: &[] }
}

const fn first(name: &'static str, key: &'static [&'static str]) -> Section {
    Section { first_wins: true, ..section(name, key) }
}

const fn nested(name: &'static str, key: &'static [&'static str], lists: &'static [Section]) -> Section {
    Section { lists, ..section(name, key) }
}

/// What an action sends stands as a whole in the row that says it: by a name, by fields, or by both.
const fn action(key: &'static [&'static str]) -> Section {
    Section { either: &["pattern", "send"], ..section("action", key) }
}

const RANGES: Section = section("ranges", &["from"]);
const CODES: &[Section] = &[section("codes", &["code"]), RANGES];
const BITS: &[Section] = &[section("bits", &["bit"]), RANGES];
const SETS: [Section; 2] = [nested("enumeration", &["name"], CODES), nested("bits", &["name"], BITS)];
const ELEMENTS: &[Section] = &[section("elements", &["bit"]), RANGES];
const OBJECTS: &[Section] = &[section("object", &["class"])];
const VALUES: &[Section] = &[section("values", &["value"])];
const FIELDS: &[Section] =
    &[nested("fields", &["bits", "parts"], VALUES), section("patterns", &["bits", "value"])];
const METHODS: &[Section] = &[first("methods", &["pattern"])];

/// A computed value has one way in which it is computed.
const COMPUTED: Section = Section {
    either: &[
        "sum",
        "less",
        "product",
        "ratio",
        "selection",
        "by",
        "limit",
        "least",
        "most",
        "within",
        "at_limit",
        "signals",
        "zero_if_missing",
        "modes",
    ],
    ..section("computed", &["parameter"])
};

const GENERIC: &[Section] = &[
    section("signal", &["name"]),
    section("parameter", &["name"]),
    section("constant", &["name"]),
    COMPUTED,
];

const CIP_ATTRIBUTES: &[Section] = &[
    section("clauses", &["source"]),
    section("class_attribute", &["id"]),
    section("attribute", &["id"]),
    nested("data_set", &["name"], ELEMENTS),
];

const CIP_FAULTS: &[Section] = &[
    SETS[0],
    SETS[1],
    section("fault_record", &["conditions", "fault_type", "alarm_type"]),
    section("exception_action", &["action"]),
    section("status", &["general", "extended"]),
];

const SERCOS_TERMS: &[Section] = &[
    section("source", &["key"]),
    section("unit", &["unit"]),
    section("scaling", &["scaling"]),
    section("group", &["group"]),
];

const CIA402_OBJECTS: &[Section] = &[
    section("source", &["key"]),
    section("unit", &["unit"]),
    nested("object", &["index"], const { &[section("subs", &["sub"])] }),
];

const CIA402_SETS: &[Section] = &[nested(
    "enumeration",
    &["name"],
    const { &[section("codes", &["code", "name"]), RANGES, section("classes", &["from", "name"])] },
)];

const CIP_GENERIC: &[Section] = &[
    section("unit", &["unit", "quantity"]),
    section("displacement_unit", &["enumeration", "code"]),
    section("cyclic", &["set", "element"]),
    section("mode", &["control_mode"]),
    section("feedback_mode", &["feedback_mode"]),
    section("request", &["axis_control"]),
    section("drive_action", &["drive_action"]),
    section("state", &["state"]),
    section("status", &["status", "mode", "axis_status"]),
    section("io_status", &["io_status"]),
    section("fault", &["cause"]),
    section("reaction", &["reaction"]),
    section("inhibit", &["inhibit"]),
    section("stopping", &["stopping_action"]),
    section("event", &["event"]),
    section("capture_status", &["status"]),
    section("attribute", &["attribute"]),
    section("reject", &["reason"]),
    section("unraised", &["reason"]),
];

const GENERIC_SERCOS: &[Section] = &[
    section("unit", &["unit", "quantity"]),
    nested("scaling", &["scaling"], METHODS),
    section("signal", &["signal"]),
    section("mode", &["mode", "interpolation"]),
    section("mode_slot", &["slot"]),
    section("procedure", &["mode", "interpolation"]),
    action(&["action"]),
    first("report", &["pattern", "acknowledges", "procedure"]),
    section("status", &["status", "word", "pattern", "acknowledges"]),
    first("fault", &["word", "pattern"]),
    section("parameter", &["parameter"]),
    section("capture", &["capture", "edge"]),
    section("commission", &["do", "phase", "idn", "parameter", "value", "when"]),
    section("unbound", &["reason"]),
];

const GENERIC_CIA402: &[Section] = &[
    section("unit", &["unit", "quantity"]),
    nested("scaling", &["unit"], const { &[first("methods", &["name"])] }),
    section("signal", &["signal", "modes"]),
    first("mode", &["mode", "interpolation", "modes"]),
    section("procedure", &["mode", "interpolation"]),
    action(&["action", "when"]),
    first("report", &["state", "pattern", "modes", "follows", "voltage"]),
    section("status", &["status", "object", "state", "pattern", "modes", "follows", "voltage"]),
    first("fault", &["codes"]),
    first("fault_class", &["classes"]),
    section("parameter", &["parameter"]),
    section("capture", &["capture", "edge"]),
    section("commission", &["do", "object", "parameter", "value", "modes"]),
    section("unbound", &["reason"]),
];

/// The lists of a table by its name; everything else in it is a table of single keys.
pub fn sections(table: &str) -> &'static [Section] {
    match table {
        "generic" => GENERIC,
        "cip-attributes" => CIP_ATTRIBUTES,
        "cip-enumerations" => &SETS,
        "cip-faults" => CIP_FAULTS,
        "cip-services" => const { &[section("service", &["code"])] },
        "cip-networks" => const { &[nested("network", &["name"], OBJECTS)] },
        "sercos-terms" => SERCOS_TERMS,
        "sercos-idns" | "sercos-communication" => const { &[section("idn", &["idn"])] },
        "sercos-bits" => const { &[nested("word", &["name", "layout"], FIELDS)] },
        "sercos-codes" => const { &[nested("enumeration", &["name"], CODES)] },
        "cia402-objects" => CIA402_OBJECTS,
        "cia402-codes" => CIA402_SETS,
        "cip-generic" => CIP_GENERIC,
        "generic-sercos" => GENERIC_SERCOS,
        "generic-cia402" => GENERIC_CIA402,
        _ => &[],
    }
}
