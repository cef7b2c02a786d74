//! The page that explains every kind of row: what a key means, from the types that the files are read into, and a row of the shipped
//! tables as an example.

use std::fmt::Write as _;

use mappings::check::schema::schema;
use mappings::{Mapping, TableTexts};
use serde_json::Value;
use toml::de::{DeTable, DeValue};

/// Where the page lies, from the root of the repository.
pub const PATH: &str = "docs/reference/rows.md";

/// Keys of the head of a file.
const HEAD: [&str; 3] = ["format", "mapping", "profile"];

/// The page.
pub fn page(mapping: &Mapping, texts: &TableTexts) -> String {
    let mut page = String::from(
        "# Rows of the mapping tables\n\n\
         Every kind of row of the mapping tables, with an example from the shipped tables and what its keys mean. It is written as in\n\
         an overlay; in the tables themselves the name of the table is missing, and rows that share keys stand under `rows` of one\n\
         group. [Mapping tables](../mapping.md) explains how the tables work. Bold keys are required in a new row.\n\n\
         This page is generated: `cargo run -p mappings --example generate`.\n",
    );
    for (name, text) in [
        ("cip-generic", &texts.cip_generic),
        ("generic-sercos", &texts.generic_sercos),
        ("generic-cia402", &texts.generic_cia402),
    ] {
        let _ = writeln!(page, "\n## `{name}`");
        let schema = schema(name, mapping).unwrap_or_default();
        table(&mut page, name, &text.text, &schema);
    }
    page
}

fn table(page: &mut String, name: &str, text: &str, schema: &Value) {
    let Ok(tree) = DeTable::parse(text) else { return };
    let mut sections: Vec<_> =
        tree.get_ref().iter().filter(|(key, _)| !HEAD.contains(&key.get_ref().as_ref())).collect();
    sections.sort_by_key(|(key, _)| key.span().start);
    for (key, value) in sections {
        let section = key.get_ref().as_ref();
        let property = &schema["properties"][section];
        let (brackets, row) = match value.get_ref() {
            DeValue::Array(rows) => match rows.iter().next().map(toml::Spanned::get_ref) {
                Some(DeValue::Table(row)) => (["[[", "]]"], row),
                _ => continue,
            },
            DeValue::Table(row) => (["[", "]"], row),
            _ => continue,
        };
        let [open, close] = brackets;
        let about = property["description"].as_str().unwrap_or_default();
        let _ = writeln!(page, "\n### `{open}{section}{close}`\n\n{}\n", oneline(about));
        let _ = writeln!(page, "```toml\n{open}{name}.{section}{close}");
        for (key, value) in keys(row) {
            let value = text.get(value).unwrap_or_default();
            let _ = writeln!(page, "{key} = {value}");
        }
        page.push_str("```\n\n| key | meaning |\n|---|---|\n");
        let definition = definition(schema, property);
        let required: Vec<&str> =
            definition["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        for (key, property) in definition["properties"].as_object().into_iter().flatten() {
            let mark = if required.contains(&key.as_str()) { "**" } else { "" };
            let about = property["description"].as_str().unwrap_or_default();
            let _ = writeln!(page, "| {mark}`{key}`{mark} | {} |", oneline(about).replace('|', "\\|"));
        }
    }
}

/// Keys and places of the values of a row in the order of the file; of a group, those of its first row with them.
fn keys<'r>(row: &'r DeTable<'_>) -> Vec<(&'r str, std::ops::Range<usize>)> {
    let own = |row: &'r DeTable<'_>| {
        let mut own: Vec<_> = row.iter().filter(|(key, _)| key.get_ref() != "rows").collect();
        own.sort_by_key(|(key, _)| key.span().start);
        own.into_iter().map(|(key, value)| (key.get_ref().as_ref(), value.span())).collect::<Vec<_>>()
    };
    let first =
        row.get("rows").and_then(|rows| rows.get_ref().as_array()).and_then(|rows| rows.iter().next());
    let first = first.and_then(|row| row.get_ref().as_table()).map(own).unwrap_or_default();
    let of_group = own(row).into_iter().filter(|(key, _)| first.iter().all(|(known, _)| known != key));
    let of_group: Vec<_> = of_group.collect();
    first.into_iter().chain(of_group).collect()
}

/// The definition of a row: that of its list, or of the table itself.
fn definition<'s>(schema: &'s Value, property: &'s Value) -> &'s Value {
    let places = [
        &property["items"]["$ref"],
        &property["$ref"],
        &property["allOf"][0]["$ref"],
        &property["anyOf"][0]["$ref"],
    ];
    let path = places.into_iter().find_map(Value::as_str).unwrap_or_default();
    let path = path.trim_end_matches(".group").trim_start_matches('#');
    schema.pointer(path).unwrap_or(&Value::Null)
}

fn oneline(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
