//! JSON Schemas of the tables, so that editors complete keys and names and mark what is wrong.
//!
//! They come from the types that the files are read into. What a key may name is added from the tables: signals, parameters,
//! attributes, IDNs.

mod words;

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Map, Value, json};

use self::words::{Known, Names};
use crate::format::{
    Cia402CodeFile, Cia402ObjectFile, CipAttributeFile, CipEnumerationFile, CipFaultFile, CipGenericFile,
    CipNetworkFile, CipServiceFile, GenericCia402File, GenericFile, GenericSercosFile, SercosBitFile,
    SercosCodeFile, SercosIdnFile, SercosTermFile,
};
use crate::{Mapping, OverlayHead, Section, groups, sections};

/// A kind of file that has a schema.
struct Kind {
    name: &'static str,
    root: fn(&mut SchemaGenerator) -> Value,
}

/// Keys that go by two names: sets of codes and sets of bits have the same rows.
const ALIASES: [(&str, &str, &str); 2] = [("CipSetRow", "codes", "bits"), ("CipCodeRow", "code", "bit")];

fn root<T: JsonSchema>(generator: &mut SchemaGenerator) -> Value {
    let mut schema = generator.root_schema_for::<T>().to_value();
    for (row, key, alias) in ALIASES {
        let Some(definition) = schema.pointer_mut(&format!("/definitions/{row}")) else { continue };
        definition["properties"][alias] = definition["properties"][key].clone();
        if let Some(required) = definition.get_mut("required").and_then(Value::as_array_mut) {
            required.retain(|name| name != key);
        }
        definition["anyOf"] = either(key, alias);
    }
    schema
}

/// One of two keys is required.
fn either(one: &str, other: &str) -> Value {
    json!([{ "required": [one] }, { "required": [other] }])
}

const KINDS: [Kind; 16] = [
    Kind { name: "generic", root: root::<GenericFile> },
    Kind { name: "cip-attributes", root: root::<CipAttributeFile> },
    Kind { name: "cip-enumerations", root: root::<CipEnumerationFile> },
    Kind { name: "cip-faults", root: root::<CipFaultFile> },
    Kind { name: "cip-services", root: root::<CipServiceFile> },
    Kind { name: "cip-networks", root: root::<CipNetworkFile> },
    Kind { name: "sercos-terms", root: root::<SercosTermFile> },
    Kind { name: "sercos-idns", root: root::<SercosIdnFile> },
    Kind { name: "sercos-communication", root: root::<SercosIdnFile> },
    Kind { name: "sercos-bits", root: root::<SercosBitFile> },
    Kind { name: "sercos-codes", root: root::<SercosCodeFile> },
    Kind { name: "cia402-objects", root: root::<Cia402ObjectFile> },
    Kind { name: "cia402-codes", root: root::<Cia402CodeFile> },
    Kind { name: "cip-generic", root: root::<CipGenericFile> },
    Kind { name: "generic-sercos", root: root::<GenericSercosFile> },
    Kind { name: "generic-cia402", root: root::<GenericCia402File> },
];

/// The name of the schema of overlays.
const OVERLAY: &str = "overlay";

/// The names of all schemas.
pub fn names() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name).chain([OVERLAY])
}

/// The schema with a name; `None` if there is no such.
#[must_use]
pub fn schema(name: &str, mapping: &Mapping) -> Option<Value> {
    if name == OVERLAY {
        return Some(overlay(mapping));
    }
    let kind = KINDS.iter().find(|kind| kind.name == name)?;
    let mut schema = titled(name, kind.root);
    complete(&mut schema, mapping);
    let lists: Vec<String> = lists(&schema["properties"]);
    for list in lists {
        add_groups(&mut schema, &["properties", &list]);
    }
    Some(schema)
}

/// The properties that are lists of rows.
fn lists(properties: &Value) -> Vec<String> {
    let all = properties.as_object().into_iter().flatten();
    all.filter(|(_, list)| list["items"]["$ref"].is_string()).map(|(name, _)| name.clone()).collect()
}

/// Lets the elements of a list be groups: keys of the rows, and under `rows` the rows, which have the others. It is one schema for
/// both, so that validators report the key which is wrong, and not the row.
fn add_groups(schema: &mut Value, place: &[&str]) {
    let list = place.iter().fold(&*schema, |value, key| &value[*key]);
    let Some(row) =
        list["items"]["$ref"].as_str().and_then(|path| path.rsplit('/').next()).map(str::to_owned)
    else {
        return;
    };
    let (part, group) = (format!("{row}.part"), format!("{row}.group"));
    let whole = schema["definitions"][&row].clone();
    let mut of_part = whole.clone();
    // What a row does not have its group may have.
    loosen(&mut of_part);
    let mut of_group = of_part.clone();
    of_group["properties"][groups::ROWS] = json!({
        "description": "Rows that share the other keys of this table.",
        "type": "array",
        "items": { "$ref": format!("#/definitions/{part}") },
    });
    of_group["if"] = json!({ "not": { "required": [groups::ROWS] } });
    let needs =
        ["required", "anyOf"].into_iter().filter_map(|key| Some((key.to_owned(), whole.get(key)?.clone())));
    of_group["then"] = Value::Object(needs.collect());
    schema["definitions"][&part] = of_part;
    schema["definitions"][&group] = of_group;
    let list = place.iter().fold(schema, |value, key| &mut value[*key]);
    list["items"] = json!({ "$ref": format!("#/definitions/{group}") });
}

/// The schema of files that are read into `T`, which are no tables.
#[must_use]
pub fn schema_of<T: JsonSchema>(name: &str) -> Value {
    titled(name, root::<T>)
}

fn titled(name: &str, root: fn(&mut SchemaGenerator) -> Value) -> Value {
    let mut schema = root(&mut generator());
    set_title(&mut schema, name);
    schema
}

fn generator() -> SchemaGenerator {
    SchemaSettings::draft07().into_generator()
}

fn set_title(schema: &mut Value, name: &str) {
    schema["title"] = Value::from(format!("axisbridge {name}"));
}

/// The rows of every table under its name, none of whose keys is required but those that identify it.
fn overlay(mapping: &Mapping) -> Value {
    let mut overlay = root::<OverlayHead>(&mut generator());
    let mut all = overlay["definitions"].as_object().cloned().unwrap_or_default();
    let mut tables = Map::new();
    for kind in &KINDS {
        let mut schema = (kind.root)(&mut generator());
        complete(&mut schema, mapping);
        let Value::Object(schema) = rename(schema, kind.name) else { continue };
        let definitions = schema.get("definitions").and_then(Value::as_object).cloned().unwrap_or_default();
        for (name, mut definition) in definitions {
            loosen(&mut definition);
            all.insert(name, definition);
        }
        let head = ["format", "mapping", "profile"];
        let rows = schema.get("properties").and_then(Value::as_object).cloned().unwrap_or_default();
        let rows: Map<String, Value> =
            rows.into_iter().filter(|(key, _)| !head.contains(&key.as_str())).collect();
        let table = json!({ "type": "object", "additionalProperties": false, "properties": rows });
        tables.insert(kind.name.to_owned(), table);
        identify(sections(kind.name), &rows_of(&tables, kind.name), &mut all);
    }
    if let Some(properties) = overlay.get_mut("properties").and_then(Value::as_object_mut) {
        properties.extend(tables);
    }
    overlay["additionalProperties"] = Value::Bool(false);
    overlay["definitions"] = Value::Object(all);
    for kind in &KINDS {
        for list in lists(&overlay["properties"][kind.name]["properties"]) {
            add_groups(&mut overlay, &["properties", kind.name, "properties", &list]);
        }
    }
    set_title(&mut overlay, OVERLAY);
    overlay
}

fn rows_of(tables: &Map<String, Value>, name: &str) -> Map<String, Value> {
    tables[name]["properties"].as_object().cloned().unwrap_or_default()
}

/// Says of the rows of lists which keys they must have, and that they may be taken away.
fn identify(sections: &[Section], rows: &Map<String, Value>, definitions: &mut Map<String, Value>) {
    for section in sections {
        let reference = rows.get(section.name).and_then(|list| list["items"]["$ref"].as_str());
        let Some(name) = reference.and_then(|path| path.rsplit('/').next()) else { continue };
        let Some(definition) = definitions.get_mut(name) else { continue };
        let alias = ALIASES.iter().find(|(row, key, alias)| {
            name.ends_with(row) && (section.key[0] == *key || section.key[0] == *alias)
        });
        match alias {
            Some((_, key, alias)) => definition["anyOf"] = either(key, alias),
            // A field has bits or pieces.
            None if section.name == "fields" => {}
            None => definition["required"] = json!([section.key[0]]),
        }
        if let Some(properties) = definition.get_mut("properties").and_then(Value::as_object_mut) {
            properties.insert(
                "remove".to_owned(),
                json!({
                    "description": "Removes the row, or keys of it.",
                    "anyOf": [{ "const": true }, { "type": "array", "items": { "type": "string" } }],
                }),
            );
            if section.first_wins {
                properties.insert(
                    "last".to_owned(),
                    json!({ "description": "Puts a new row after the existing ones.", "type": "boolean" }),
                );
            }
            let rows = properties.clone();
            identify(section.lists, &rows, definitions);
        }
    }
}

/// Takes out what the rows of a table must have, since most of it is inherited.
fn loosen(definition: &mut Value) {
    if let Some(definition) = definition.as_object_mut() {
        definition.remove("required");
        definition.remove("anyOf");
    }
}

/// The same schema with definitions that begin with the name of the table: two tables may have rows of the same name.
fn rename(schema: Value, table: &str) -> Value {
    match schema {
        Value::Object(object) => Value::Object(
            object
                .into_iter()
                .map(|(key, value)| match (key.as_str(), value) {
                    ("$ref", Value::String(path)) => {
                        (key, Value::from(path.replace("#/definitions/", &format!("#/definitions/{table}."))))
                    }
                    ("definitions", Value::Object(definitions)) => {
                        let renamed = definitions
                            .into_iter()
                            .map(|(name, value)| (format!("{table}.{name}"), rename(value, table)));
                        (key, Value::Object(renamed.collect()))
                    }
                    (_, value) => (key, rename(value, table)),
                })
                .collect(),
        ),
        Value::Array(values) => Value::Array(values.into_iter().map(|value| rename(value, table)).collect()),
        other => other,
    }
}

/// Adds what the keys of a mapping may name.
fn complete(schema: &mut Value, mapping: &Mapping) {
    let names = Names::new(mapping);
    let Some(definitions) = schema.get_mut("definitions").and_then(Value::as_object_mut) else { return };
    for (row, definition) in definitions {
        let Some(properties) = definition.get_mut("properties").and_then(Value::as_object_mut) else {
            continue;
        };
        for (key, property) in properties {
            if let Some(known) = names.of(row, key) {
                restrict(property, &known);
            }
        }
    }
}

/// Puts the names into the texts of a property, which may be a list or absent.
fn restrict(property: &mut Value, known: &Known<'_>) {
    if let Some(items) = property.get_mut("items") {
        return restrict(items, known);
    }
    let kind = property.get("type");
    let optional = kind.and_then(Value::as_array).is_some_and(|kinds| kinds.contains(&Value::from("null")));
    if !optional && kind != Some(&Value::from("string")) {
        return;
    }
    match known {
        // TOML has no null: a key that may be missing has no other value.
        Known::Only(names) => property["enum"] = json!(names),
        Known::Form(form) => property["pattern"] = Value::from(*form),
        Known::Offered(names, form) => property["anyOf"] = json!([{ "enum": names }, { "pattern": form }]),
    }
}
