//! The schema of a configuration and the program refuse the same values: every key, with values on both sides of every border,
//! judged by the program and by another maker's validator (jsonschema-rs, PyPI).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use axisbridge::check::schema::{OUTPUTS, names as schemas, schema};
use axisbridge::config::Config;
use axisbridge::finding::Severity;
use axisbridge::mapping::Mapping;
use axisbridge::simulate::script::Script;
use axisbridge_tests::peer;
use serde_json::{Value, json};

/// Every key of a configuration, in four files since not all of them go together.
const DOCUMENTS: [&str; 4] = [
    include_str!("every_key/assembly.toml"),
    include_str!("every_key/sercos.toml"),
    include_str!("every_key/can.toml"),
    include_str!("every_key/devicenet.toml"),
];

/// What a value can be refused for by itself: form, missing, word, range. Others are beside other values: twice, contradicting.
const BY_ITSELF: [&str; 6] = ["AX0005", "AX0006", "AX0007", "AX0012", "AX0013", "AX0080"];

/// Keys that are times.
const TIMES: [&str; 11] = [
    "min",
    "max",
    "cycle_time",
    "setup_cycle",
    "jitter",
    "threshold",
    "asymmetry",
    "lead",
    "heartbeat",
    "guarding",
    "packet_rate",
];

const NUMBERS: [i64; 52] = [
    i64::MIN,
    -1_000_000,
    -16,
    -15,
    -1,
    0,
    1,
    2,
    3,
    5,
    7,
    8,
    15,
    16,
    19,
    20,
    21,
    22,
    63,
    64,
    65,
    99,
    100,
    101,
    127,
    128,
    240,
    241,
    253,
    254,
    255,
    256,
    511,
    512,
    1_000,
    1_001,
    1_023,
    1_024,
    4_159,
    4_160,
    9_999,
    10_000,
    65_532,
    65_533,
    65_535,
    65_536,
    125_000,
    1_000_001,
    2_147_483_647,
    2_147_483_648,
    4_294_967_295,
    4_294_967_296,
];

const TEXTS: [&str; 56] = [
    "",
    " ",
    "x",
    "a b",
    "-_",
    "ä",
    "a/b",
    "eth0",
    "in-process",
    "fifteen-letters",
    "sixteen-letters-",
    "no such word",
    "thirty-two-letters-have-to-do---",
    "thirty-three-letters-are-too-many",
    "3 parsec",
    "2 ms",
    " 2ms ",
    "2 µs",
    "1.50 ms",
    "0.5 ns",
    "1.0 ns",
    "31.25 us",
    "1.2345 us",
    ".5 ms",
    "1. s",
    "-1 ms",
    "1.1234567891 s",
    "1.12345678900 s",
    "192.0.2.1",
    "0.0.0.0",
    "224.0.0.1",
    "240.0.0.1",
    "255.255.255.255",
    "256.0.0.1",
    "01.0.0.1",
    "192.0.2.1:502",
    "[::]:502",
    "0.0.0.0:65536",
    "02:00:00:00:00:01",
    "03:00:00:00:00:01",
    "00:00:00:00:00:00",
    "1.1",
    "128.1",
    "1.0",
    "127.255",
    "0 Nm",
    "2.5 Nm",
    "192.0.2.0/24",
    "192.0.2.0/33",
    "192.0.2.0/08",
    "192.0.2.0/",
    "2001:db8::1",
    "2001:db8::/64",
    "2001:db8::/129",
    "2001:db8::/064",
    "plc.local",
];

fn lists() -> Vec<Value> {
    vec![
        json!([]),
        json!(["x"]),
        json!(["position", "position"]),
        json!(["homing"]),
        json!(["position", "homing"]),
        json!(["velocity", "torque"]),
        json!(["csp", "pv"]),
        json!(["inputs"]),
        json!(["control", "mode", "mode"]),
        json!(["status", "age"]),
        json!([""]),
    ]
}

/// Values for the place of another one of the same kind.
fn others(value: &Value) -> Vec<Value> {
    match value {
        Value::Number(number) if number.is_f64() => vec![json!(-1.5), json!(0.0), json!(0.001), json!(1e6)],
        Value::Number(_) => NUMBERS.iter().map(|number| json!(number)).collect(),
        Value::String(_) => TEXTS.iter().map(|text| json!(text)).chain([json!(1)]).collect(),
        Value::Bool(value) => vec![json!(!value), json!("yes")],
        Value::Array(items) if items.iter().all(Value::is_string) => lists(),
        Value::Array(_) => vec![json!([])],
        Value::Object(_) => vec![json!({}), json!({ "stranger": 1 })],
        Value::Null => Vec::new(),
    }
}

/// The places of all values, as JSON pointers.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    if !at.is_empty() {
        found.push(at.to_owned());
    }
    let members: Vec<(String, &Value)> = match value {
        Value::Object(members) => members.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(items) if !items.iter().all(Value::is_string) => {
            items.iter().enumerate().map(|(index, value)| (index.to_string(), value)).collect()
        }
        _ => Vec::new(),
    };
    for (key, value) in members {
        places(value, &format!("{at}/{key}"), found);
    }
}

/// What the program says: the codes of its errors, without that of files which are not there (AX0001).
fn program(document: &Value) -> Vec<String> {
    let text = toml::to_string(document).expect("a document");
    match Config::parse(&text, "config.toml") {
        Ok(_) => Vec::new(),
        Err(findings) => {
            let errors = findings.list().iter().filter(|finding| finding.severity() == Severity::Error);
            errors.map(|finding| finding.code.to_string()).filter(|code| code != "AX0001").collect()
        }
    }
}

/// A time that is written well: its range is beyond a schema.
fn is_time(value: &Value) -> bool {
    let Some(text) = value.as_str().map(str::trim) else { return false };
    let (number, unit) =
        text.split_at(text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len()));
    // No finer than a nanosecond: that a schema can say.
    let decimals = number.split_once('.').map_or("", |(_, decimals)| decimals.trim_end_matches('0')).len();
    let most = [("ns", 0), ("us", 3), ("µs", 3), ("ms", 6), ("s", 9)]
        .into_iter()
        .find(|(known, _)| *known == unit.trim_start());
    number.parse::<f64>().is_ok() && most.is_some_and(|(_, most)| decimals <= most)
}

/// What the validator says of documents: for each the first error.
fn judged(python: &Path, schema: &Value, name: &str, documents: &[&Value]) -> Vec<Option<String>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("schema-values-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("schema.json"), schema.to_string()).unwrap();
    std::fs::write(folder.join("documents.json"), json!(documents).to_string()).unwrap();
    let output = Command::new(python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/json_schema.py"))
        .arg("--documents")
        .args([folder.join("schema.json"), folder.join("documents.json")])
        .output()
        .expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let verdicts: Vec<Option<String>> = serde_json::from_slice(&output.stdout).expect("a list");
    assert_eq!(verdicts.len(), documents.len());
    verdicts
}

/// The document with other values at a place, and without it.
fn changed(document: &Value, place: &str, others: Vec<Value>) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for other in others {
        let mut changed = document.clone();
        *changed.pointer_mut(place).expect("it was there") = other.clone();
        found.push((format!("{place} = {other}"), changed));
    }
    let (table, key) = place.rsplit_once('/').expect("a pointer");
    let mut without = document.clone();
    if let Some(table) = without.pointer_mut(table).and_then(Value::as_object_mut) {
        table.remove(key);
        found.push((format!("{place} removed"), without));
    }
    found
}

#[test]
fn the_schema_and_the_program_refuse_the_same_values() {
    let Some(python) = peer::python_or_skip("schema values", "jsonschema_rs") else { return };
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let schema = schema("config", &mapping).expect("the schema");
    let mut probes: Vec<(String, Value)> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for text in DOCUMENTS {
        let document: Value = toml::from_str(text).expect("a configuration");
        assert_eq!(program(&document), Vec::<String>::new());
        let mut all = Vec::new();
        places(&document, "", &mut all);
        for place in all {
            seen.insert(
                place.split('/').filter(|part| part.parse::<usize>().is_err()).collect::<Vec<_>>().join("/"),
            );
            probes.extend(changed(
                &document,
                &place,
                others(document.pointer(&place).expect("it was there")),
            ));
        }
    }
    assert_eq!(missing(&schema, &schema, "", &seen), Vec::<String>::new(), "keys that no document has");
    let documents: Vec<&Value> = probes.iter().map(|(_, document)| document).collect();
    let verdicts = judged(&python, &schema, "config", &documents);
    let mut differences = Vec::new();
    let mut refused = 0;
    for ((what, document), verdict) in probes.iter().zip(verdicts) {
        let codes = program(document);
        let by_itself = codes.iter().any(|code| BY_ITSELF.contains(&code.as_str()));
        match verdict {
            Some(error) if codes.is_empty() => differences.push(format!("{what}: only the schema: {error}")),
            None if by_itself && !excused(what) => {
                differences.push(format!("{what}: only the program: {codes:?}"))
            }
            Some(_) => refused += 1,
            None => {}
        }
    }
    assert!(differences.is_empty(), "{} of {}:\n{}", differences.len(), probes.len(), differences.join("\n"));
    assert!(refused > 1_000, "{refused} of {} refused", probes.len());
}

/// Scripts with every verb: the schema lets through what the program takes, and both refuse strange and missing keys and values
/// of another kind.
#[test]
fn the_schema_of_scripts_agrees_with_the_program() {
    let Some(python) = peer::python_or_skip("schema values", "jsonschema_rs") else { return };
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let schema = schema("script", &mapping).expect("the schema");
    let program = |document: &Value| {
        let text = toml::to_string(document).expect("a document");
        Script::parse(&text, "script.toml", &mapping).err().map(|findings| findings.to_string())
    };
    let mut scripts = vec![include_str!("../../../gateway/src/simulate/script/every_verb.toml").to_owned()];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scripts");
    for file in folder.read_dir().expect("the examples").flatten() {
        scripts.push(std::fs::read_to_string(file.path()).expect("an example"));
    }
    assert_eq!(scripts.len(), 6);
    let mut probes: Vec<(String, Value)> = Vec::new();
    let mut small = Vec::new();
    for text in &scripts {
        let document: Value = toml::from_str(text).expect("a script");
        assert_eq!(program(&document), None);
        // One document for the head, and one for each step: they are soon judged.
        let steps = document["step"].as_array().cloned().unwrap_or_default();
        let with = |step: &[Value]| {
            let mut document = document.clone();
            document["step"] = json!(step);
            document
        };
        small.push((with(&[]), ""));
        small.extend(steps.iter().map(|step| (with(std::slice::from_ref(step)), "/step/0")));
        probes.push(("as it is".to_owned(), document));
    }
    for (document, below) in small {
        let mut all = Vec::new();
        places(&document, "", &mut all);
        for place in all.into_iter().filter(|place| place.starts_with(below)) {
            let others = match document.pointer(&place).expect("it was there") {
                Value::Object(table) => {
                    let mut more = table.clone();
                    more.insert("stranger".to_owned(), json!(1));
                    vec![json!(more), json!(-7)]
                }
                Value::Array(_) => vec![json!({ "stranger": 1 })],
                Value::Bool(_) => vec![json!("yes"), json!(3)],
                Value::Number(_) => vec![json!(-70_000_000_000_i64), json!(0), json!(1), json!({})],
                _ => vec![json!({}), json!(-7)],
            };
            probes.extend(changed(&document, &place, others));
        }
    }
    let documents: Vec<&Value> = probes.iter().map(|(_, document)| document).collect();
    let verdicts = judged(&python, &schema, "script", &documents);
    let mut differences = Vec::new();
    let (mut refused, mut beyond) = (0, 0);
    for ((what, document), verdict) in probes.iter().zip(verdicts) {
        match (program(document), verdict) {
            (None, Some(error)) => differences.push(format!("{what}: only the schema: {error}")),
            // Names of the standard are offered, and others are left to the program.
            (Some(error), None)
                if error.contains("is no attribute") || error.contains("is no general status") =>
            {
                beyond += 1
            }
            (Some(error), None) if !what.ends_with("removed") && !what.ends_with(char::is_numeric) => {
                differences.push(format!("{what}: only the program: {error}"));
            }
            (Some(_), None) => beyond += 1,
            (Some(_), Some(_)) => refused += 1,
            (None, None) => {}
        }
    }
    assert!(differences.is_empty(), "{} of {}:\n{}", differences.len(), probes.len(), differences.join("\n"));
    assert!(
        refused > 500 && beyond < refused / 4,
        "{refused} refused by both, {beyond} by the program alone"
    );
}

/// The first row of every list of a table that has the key, for each key with a text: where it is.
fn texts(value: &Value, at: &str, list: &str, found: &mut BTreeMap<String, String>) {
    match value {
        Value::Object(row) => {
            for (key, value) in row {
                texts(value, &format!("{at}/{key}"), &format!("{list}/{key}"), found);
            }
        }
        Value::Array(rows) => {
            for (index, row) in rows.iter().enumerate() {
                texts(row, &format!("{at}/{index}"), list, found);
            }
        }
        Value::String(_) => {
            found.entry(list.replace("/rows", "")).or_insert_with(|| at.to_owned());
        }
        _ => {}
    }
}

/// The document with only the row of a list in which a place is.
fn row(document: &Value, at: &str) -> Value {
    let mut parts = at.split('/').skip(1);
    let (list, index) = (parts.next(), parts.next().and_then(|index| index.parse::<usize>().ok()));
    let mut small = document.clone();
    for (key, value) in small.as_object_mut().into_iter().flatten() {
        if let Value::Array(rows) = value {
            let kept = index.filter(|_| list == Some(key)).map(|index| rows.swap_remove(index));
            *rows = kept.into_iter().collect();
        }
    }
    small
}

/// Every key of the tables that takes words of a list: with another word the program refuses the table, and the schema does.
#[test]
fn words_of_the_tables_are_those_of_the_schemas() {
    let Some(python) = peer::python_or_skip("schema values", "jsonschema_rs") else { return };
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("../mappings/tables");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schema-words");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("dictionary")).unwrap();
    let others =
        |name: &&str| ["config", "script", "overlay"].iter().chain(&OUTPUTS).all(|other| other != name);
    let names: Vec<&str> = schemas().filter(others).collect();
    let place = |name: &str| {
        let file = format!("{name}.toml");
        if tables.join(&file).exists() { PathBuf::from(file) } else { Path::new("dictionary").join(file) }
    };
    for name in &names {
        std::fs::copy(tables.join(place(name)), folder.join(place(name))).unwrap();
    }
    let mut differences = Vec::new();
    let mut refused = 0;
    for name in &names {
        let text = std::fs::read_to_string(tables.join(place(name))).unwrap();
        let document: Value = toml::from_str(&text).expect("a table");
        let mut found = BTreeMap::new();
        texts(&document, "", "", &mut found);
        let probes: Vec<(String, Value, Value)> = found
            .into_iter()
            .map(|(key, at)| {
                let mut changed = document.clone();
                *changed.pointer_mut(&at).expect("it was there") = json!("no such word");
                let row = row(&changed, &at);
                (key, changed, row)
            })
            .collect();
        let schema = schema(name, &mapping).expect("a schema");
        let rows: Vec<&Value> = probes.iter().map(|(.., row)| row).collect();
        for ((key, changed, _), verdict) in probes.iter().zip(judged(&python, &schema, name, &rows)) {
            if verdict.is_some() {
                refused += 1;
                continue;
            }
            std::fs::write(folder.join(place(name)), toml::to_string(changed).expect("a table")).unwrap();
            let findings = Mapping::load(Some(&folder), &[]).err().unwrap_or_default();
            if findings.list().iter().any(|finding| finding.code.to_string() == "AX0012") {
                differences.push(format!("{name}{key}: only the program"));
            }
        }
        std::fs::write(folder.join(place(name)), text).unwrap();
    }
    assert!(differences.is_empty(), "{refused} refused:\n{}", differences.join("\n"));
    assert!(refused > 60, "{refused}");
}

/// A time in a key for times is refused only for its range, which a schema of texts cannot say.
fn excused(what: &str) -> bool {
    let Some((place, value)) = what.split_once(" = ") else { return false };
    place.rsplit('/').next().is_some_and(|key| TIMES.contains(&key))
        && serde_json::from_str(value).is_ok_and(|value| is_time(&value))
}

/// Keys of the schema that no document has.
fn missing(root: &Value, schema: &Value, at: &str, seen: &std::collections::BTreeSet<String>) -> Vec<String> {
    let mut found = Vec::new();
    for (key, property) in schema["properties"].as_object().into_iter().flatten() {
        let place = format!("{at}/{key}");
        if !seen.contains(&place) {
            found.push(place.clone());
        }
        let target = [property, &property["items"], &property["anyOf"][0], &property["allOf"][0]]
            .into_iter()
            .find_map(|value| value["$ref"].as_str());
        if let Some(path) = target {
            let table = root.pointer(path.trim_start_matches('#')).expect("a definition");
            found.extend(missing(root, table, &place, seen));
        }
    }
    found
}
