//! Data sheets and configurations of CANopen devices: our reader and writer against the reader of another maker (canopen, PyPI).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use axisbridge_tests::peer;
use profile_cia402::eds::{DeviceDescription, Form, Object, ObjectKind, Setting, SubObject, Value, read};
use serde_json::{Value as Json, json};

/// The node that `$NODEID` stands for.
const NODE: u8 = 5;

/// What the other reader refuses, and why: it wants keys in exactly one spelling, each once, and nothing else; and of compact
/// objects every name up to the last.
const REFUSED: &[&str] = &["broken.eds", "compact.dcf", "not_an_eds.eds", "odd.eds"];

fn corpus() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../profile-cia402/tests/eds");
    let entries = std::fs::read_dir(folder).expect("the corpus is there");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.sort();
    files
}

fn name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).expect("a plain name")
}

fn asked(python: &Path, files: &[PathBuf]) -> BTreeMap<String, Json> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/canopen_eds.py");
    let output =
        Command::new(python).arg(script).arg(NODE.to_string()).args(files).output().expect("python starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let all: BTreeMap<String, Json> = serde_json::from_slice(&output.stdout).expect("JSON");
    all.into_iter().map(|(path, found)| (name(Path::new(&path)).to_owned(), found)).collect()
}

/// A value as the other reader has it. It does not know of signs where a number is written as a bit pattern.
fn value(setting: Option<&Setting>) -> Json {
    match setting.and_then(|setting| setting.at(NODE)) {
        None => Json::Null,
        Some(Value::Unsigned(value)) => json!(value),
        Some(Value::Signed(value)) => json!(value),
        Some(Value::Real(value)) => json!(value),
        Some(Value::Text(text)) => json!(text),
        Some(Value::Bytes(bytes)) => {
            json!({ "bytes": bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>() })
        }
    }
}

fn sub(sub: &SubObject) -> Json {
    // Limits of a floating point number it takes for whole numbers: they are compared where they are.
    let limit = |limit: &Option<Setting>| match value(limit.as_ref()) {
        Json::Number(number) => json!(number.as_f64()),
        other => other,
    };
    json!({
        "name": sub.name,
        "type": sub.data_type.0,
        "access": sub.access.word(),
        "pdo": sub.pdo_mapping,
        "default": value(sub.default.as_ref()),
        "value": value(sub.parameter.as_ref()),
        "low": limit(&sub.low),
        "high": limit(&sub.high),
    })
}

fn object(object: &Object) -> Json {
    let kind = match object.kind {
        ObjectKind::Array => "array",
        ObjectKind::Record => "record",
        _ => "variable",
    };
    let subs: serde_json::Map<String, Json> =
        object.subs.iter().map(|value| (value.sub.to_string(), sub(value))).collect();
    json!({ "kind": kind, "name": object.name, "subs": subs })
}

/// What both say of a file.
fn compare(name: &str, ours: &DeviceDescription, theirs: &Json) {
    let found = theirs["objects"].as_object().unwrap_or_else(|| panic!("{name}: {}", theirs["error"]));
    let indices: Vec<String> = ours.objects.iter().map(|object| format!("{:04X}", object.index)).collect();
    let mut known: Vec<&String> = found.keys().collect();
    known.sort();
    assert_eq!(indices.iter().collect::<Vec<_>>(), known, "{name}: objects");
    for own in &ours.objects {
        let index = format!("{:04X}", own.index);
        let mut theirs = found[&index].clone();
        for value in theirs["subs"].as_object_mut().into_iter().flat_map(|subs| subs.values_mut()) {
            for limit in ["low", "high"] {
                value[limit] = json!(value[limit].as_f64());
            }
        }
        assert_eq!(object(own), theirs, "{name} {index}");
    }
    let device = &ours.device;
    let or_null = |text: &str| if text.is_empty() { Json::Null } else { json!(text) };
    assert_eq!(json!([or_null(&device.vendor_name), device.vendor_number]), theirs["vendor"], "{name}");
    let product = json!([
        or_null(&device.product_name),
        device.product_number,
        device.revision_number,
        or_null(&device.order_code)
    ]);
    assert_eq!(product, theirs["product"], "{name}");
    let rates: Vec<u32> = device.bit_rates.iter().map(|rate| u32::from(*rate) * 1000).collect();
    assert_eq!(json!(rates), theirs["rates"], "{name}");
    assert_eq!(json!([device.rpdos, device.tpdos]), theirs["pdos"], "{name}");
    let bit_rate =
        ours.commissioning.as_ref().and_then(|set| set.bit_rate).map(|rate| u32::from(rate) * 1000);
    assert_eq!(json!(bit_rate), theirs["bit_rate"], "{name}");
}

#[test]
fn another_reader_finds_the_same_objects_types_and_values() {
    let Some(python) = peer::python_or_skip("device descriptions", "canopen") else { return };
    let files = corpus();
    let theirs = asked(&python, &files);
    let mut compared = 0;
    for path in &files {
        let name = name(path);
        let ours = read(&std::fs::read(path).expect("readable")).expect("not refused").description;
        let theirs = &theirs[name];
        if REFUSED.contains(&name) {
            assert!(theirs["error"].is_string(), "{name} is read by both now");
            continue;
        }
        compare(name, &ours, theirs);
        compared += 1;
    }
    assert_eq!(compared, files.len() - REFUSED.len());
}

/// What we write is read by it as what we meant, also of files that it cannot read itself.
#[test]
fn another_reader_reads_what_we_write() {
    let Some(python) = peer::python_or_skip("written device descriptions", "canopen") else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("written-descriptions");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut written = Vec::new();
    for path in corpus() {
        let mut description =
            read(&std::fs::read(&path).expect("readable")).expect("not refused").description;
        // Without a type or a name it refuses a value, and numbers it has no values of types that nobody knows.
        for object in &mut description.objects {
            object.subs.retain(|value| {
                value.data_type.bits().is_some() || value.data_type.0 >= 9 && value.data_type.0 <= 0x0F
            });
            for value in &mut object.subs {
                if value.name.is_empty() {
                    value.name = "without a name".to_owned();
                }
            }
            if object.name.is_empty() {
                object.name.clone_from(
                    &object.subs.first().map_or("nothing".to_owned(), |value| value.name.clone()),
                );
            }
        }
        description.objects.retain(|object| !object.subs.is_empty());
        let place =
            folder.join(format!("{}.dcf", name(&path).replace("latin1", "umlauts").replace('.', "-")));
        std::fs::write(&place, description.to_text(Form::Configuration)).expect("written");
        written.push((place, description));
    }
    let files: Vec<PathBuf> = written.iter().map(|(place, _)| place.clone()).collect();
    let theirs = asked(&python, &files);
    for (place, description) in &written {
        compare(name(place), description, &theirs[name(place)]);
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}
