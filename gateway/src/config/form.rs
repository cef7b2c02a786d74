//! What the values of a configuration look like, as the JSON Schema says it. [`check`](super::check) refuses the same values; a test
//! holds the two together (`tests/tests/files/schema_values.rs`).

use schemars::Schema;
use serde_json::{Value, json};

/// A byte of an IPv4 address.
const BYTE: &str = "(25[0-5]|2[0-4][0-9]|1[0-9]{2}|[1-9]?[0-9])";
const PORT: &str = "(6553[0-5]|655[0-2][0-9]|65[0-4][0-9]{2}|6[0-4][0-9]{3}|[1-5][0-9]{4}|[0-9]{1,4})";

fn pattern(schema: &mut Schema, pattern: impl Into<String>) {
    schema.insert("pattern".to_owned(), Value::from(pattern.into()));
}

/// A name that other parts of the file refer to.
pub fn name(schema: &mut Schema) {
    pattern(schema, "^[A-Za-z0-9_-]{1,32}$");
}

/// A name for people.
pub fn label(schema: &mut Schema) {
    pattern(schema, "^(?=.*[!-~])[ -~]{1,32}$");
}

/// A path.
pub fn path(schema: &mut Schema) {
    schema.insert("minLength".to_owned(), Value::from(1));
}

/// A time: a decimal number and a unit, no finer than a nanosecond.
pub fn time(schema: &mut Schema) {
    let units = [("0", "ns"), ("[0-9]{1,3}0", "(us|µs)"), ("[0-9]{1,6}0", "ms"), ("[0-9]{1,9}0", "s")];
    let units = units.map(|(decimals, unit)| format!("[0-9]+(\\.{decimals}*)?\\s*{unit}"));
    pattern(schema, format!("^\\s*({})\\s*$", units.join("|").replace("\\.0*", "\\.0+")));
}

/// The memory of the rolling recording, 2 MB to 1 GB: a whole number and a unit.
pub fn size(schema: &mut Schema) {
    let kilo = "0*([2-9][0-9]{3}|[1-9][0-9]{4,5}|1000000)\\s*kB";
    let mega = "0*([2-9]|[1-9][0-9]{1,2}|1000)\\s*MB";
    pattern(schema, format!("^\\s*({kilo}|{mega}|0*1\\s*GB)\\s*$"));
}

/// A torque or force: a decimal number above zero with at most six decimals, and a unit.
pub fn torque(schema: &mut Schema) {
    pattern(schema, "^\\s*(?=[^1-9]*[1-9])[0-9]+(\\.[0-9]{1,6}0*)?\\s*(Nm|N)\\s*$");
}

/// An IPv4 address that a station can have.
pub fn own_address(schema: &mut Schema) {
    let any = "(?!0\\.0\\.0\\.0$)(?!255\\.255\\.255\\.255$)(?!(22[4-9]|23[0-9])\\.)";
    pattern(schema, format!("^{any}({BYTE}\\.){{3}}{BYTE}$"));
}

/// IPv4 addresses and networks.
pub fn hosts_v4(schema: &mut Schema) {
    list(schema, format!("^{}$", host_v4()));
}

/// Addresses and networks.
pub fn hosts(schema: &mut Schema) {
    const BITS: &str = "([0-9]|[1-9][0-9]|1[01][0-9]|12[0-8])";
    list(schema, format!("^({}|[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*(/{BITS})?)$", host_v4()));
}

/// An IPv4 address or a network.
fn host_v4() -> String {
    format!("({BYTE}\\.){{3}}{BYTE}(/([0-9]|[12][0-9]|3[0-2]))?")
}

/// A list of texts of this form.
fn list(schema: &mut Schema, form: String) {
    schema.insert("items".to_owned(), json!({ "type": "string", "pattern": form }));
}

/// An address with a port.
pub fn socket_address(schema: &mut Schema) {
    pattern(schema, format!("^(({BYTE}\\.){{3}}{BYTE}|\\[[0-9A-Fa-f:.]+(%[0-9]+)?\\]):0*{PORT}$"));
}

/// A network interface.
pub fn interface(schema: &mut Schema) {
    pattern(schema, "^[^/ \\u0000]{1,15}$");
}

/// The Ethernet address of a station.
pub fn station(schema: &mut Schema) {
    pattern(schema, "^(?!00(:00){5}$)[0-9A-Fa-f][02468ACEace](:[0-9A-Fa-f]{2}){5}$");
}

/// Major and minor revision.
pub fn revision(schema: &mut Schema) {
    pattern(schema, "^0*([1-9][0-9]?|1[01][0-9]|12[0-7])\\.0*([1-9][0-9]?|1[0-9]{2}|2[0-4][0-9]|25[0-5])$");
}

/// A number of up to 8 bits as a text.
const OCTET: &str = "0*(25[0-5]|2[0-4][0-9]|1[0-9]{2}|[1-9]?[0-9])";

/// The number of a parameter of a SERCOS drive.
pub fn idn(schema: &mut Schema) {
    let block = "0*(409[0-5]|40[0-8][0-9]|[1-3][0-9]{3}|[1-9]?[0-9]{1,2})";
    pattern(schema, format!("^[SsPp]-0*[0-7]-{block}(\\.{OCTET}\\.{OCTET})?$"));
}

/// The number of an object of a CANopen device.
pub fn object(schema: &mut Schema) {
    let (index, sub) = ("[0-9A-Fa-f]{4}", "0*[0-9A-Fa-f]{1,2}");
    let marked = format!("(0x{index}|{index}h)");
    pattern(schema, format!("^({marked}(\\.({OCTET}|0x{sub}))?|({marked}|{index}):{sub})$"));
}

/// Class, instance and attribute of a drive on DeviceNet.
pub fn attribute(schema: &mut Schema) {
    let number = "(0*[0-9]{1,5}|0x0*[0-9A-Fa-f]{1,4})";
    pattern(schema, format!("^{number}\\.{number}\\.{number}$"));
}

/// A number above zero.
pub fn positive(schema: &mut Schema) {
    schema.insert("exclusiveMinimum".to_owned(), Value::from(0));
}

/// A number that is not negative.
pub fn not_negative(schema: &mut Schema) {
    schema.insert("minimum".to_owned(), Value::from(0));
}

/// A table with a key at least.
pub fn not_empty(schema: &mut Schema) {
    schema.insert("minProperties".to_owned(), Value::from(1));
}

/// One of some numbers.
pub fn one_of(numbers: &'static [i64]) -> impl Fn(&mut Schema) {
    move |schema| {
        schema.insert("enum".to_owned(), json!(numbers));
    }
}

/// A transmission type of an RPDO.
pub fn rpdo_type(schema: &mut Schema) {
    schema.insert(
        "anyOf".to_owned(),
        json!([{ "minimum": 0, "maximum": 240 }, { "minimum": 254, "maximum": 255 }]),
    );
}

/// One of the words.
pub fn word<T>(known: &[(&'static str, T)]) -> impl Fn(&mut Schema) + use<T> {
    let words = names(known);
    move |schema| {
        schema.insert("enum".to_owned(), words.clone());
    }
}

/// Some of the words, each once.
pub fn words<T>(known: &[(&'static str, T)]) -> impl Fn(&mut Schema) + use<T> {
    let words = names(known);
    move |schema| {
        schema.insert("uniqueItems".to_owned(), Value::Bool(true));
        schema.insert("items".to_owned(), json!({ "type": "string", "enum": words }));
    }
}

/// Words in an order, some of them more than once.
pub fn list_of<T>(known: &[(&'static str, T)]) -> impl Fn(&mut Schema) + use<T> {
    let words = names(known);
    move |schema| {
        schema.insert("items".to_owned(), json!({ "type": "string", "enum": words }));
    }
}

/// At least one of the words, each once.
pub fn some_words<T>(known: &[(&'static str, T)]) -> impl Fn(&mut Schema) + use<T> {
    let words = words(known);
    move |schema| {
        words(schema);
        schema.insert("minItems".to_owned(), Value::from(1));
    }
}

/// What an axis is used for: some of the words, each once, the first one of those that come first in the list.
pub fn modes<T>(all: &[(&'static str, T)], starting: usize) -> impl Fn(&mut Schema) + use<T> {
    let list = some_words(all);
    let first = json!({ "type": "string", "enum": names(&all[..starting]) });
    move |schema| {
        list(schema);
        let all = schema.insert("items".to_owned(), json!([first])).unwrap_or_default();
        schema.insert("additionalItems".to_owned(), all);
    }
}

fn names<T>(known: &[(&'static str, T)]) -> Value {
    known.iter().map(|(name, _)| Value::from(*name)).collect()
}

/// Keys of a table that need another one.
pub fn together(pairs: &'static [(&'static str, &'static str)]) -> impl Fn(&mut Schema) {
    move |schema| {
        let pairs = pairs.iter().map(|(key, other)| ((*key).to_owned(), json!([other])));
        schema.insert("dependencies".to_owned(), Value::Object(pairs.collect()));
    }
}

/// What keys of a CANopen device need: LSS the whole identity.
pub fn can_device(schema: &mut Schema) {
    together(&[("life_time_factor", "guarding"), ("store", "configuration")])(schema);
    let all = ["vendor_id", "product_code", "revision_number", "serial_number"];
    let whole = json!({ "required": ["identity"], "properties": { "identity": { "required": all } } });
    if let Some(dependencies) = schema.get_mut("dependencies").and_then(Value::as_object_mut) {
        dependencies.insert("lss".to_owned(), whole);
    }
}

/// At least one bus.
pub fn some_bus(schema: &mut Schema) {
    let list = |name: &str| json!({ "required": [name], "properties": { name: { "minItems": 1 } } });
    schema.insert("anyOf".to_owned(), json!([{ "required": ["sercos"] }, list("can"), list("devicenet")]));
}

/// The keys of a drive on a DeviceNet depend on its kind.
pub fn kind_of_drive(schema: &mut Schema) {
    let none_of = |keys: [&str; 2]| json!({ "anyOf": keys.map(|key| json!({ "required": [key] })) });
    schema.insert(
        "if".to_owned(),
        json!({ "properties": { "kind": { "const": "ac-dc" } }, "required": ["kind"] }),
    );
    schema.insert("then".to_owned(), json!({ "not": none_of(["modes", "resolution"]) }));
    schema.insert(
        "else".to_owned(),
        json!({ "required": ["resolution"], "not": none_of(["assembly", "speed_scale"]) }),
    );
}
