//! Keys and files that stand in the wrong place.

use serde_json::Value;
use toml::de::DeTable;

use super::file::File;
use crate::finding::Problem;
use crate::finding::registry as code;
use crate::mapping::check::schema;

/// Where a key belongs that is unknown in its table, as the schema has it.
pub(super) fn home_of(problem: &Problem) -> Option<String> {
    if problem.code != code::UNKNOWN_KEY || !problem.help.is_empty() {
        return None;
    }
    let schema = schema::schema_of::<File>("config");
    let mut homes = Vec::new();
    homes_in(&schema, &schema, &problem.key, "", &mut homes);
    homes.dedup();
    // A table that stands in this one is nearer than others.
    let known: Vec<&str> = problem.expected.split('`').skip(1).step_by(2).collect();
    let within = |home: &&String| {
        let name = home.trim_matches(['[', ']']).rsplit('.').next().unwrap_or_default();
        known.contains(&name) && name != problem.key
    };
    let nearer: Vec<String> = homes.iter().filter(within).cloned().collect();
    let homes = if nearer.is_empty() { homes } else { nearer };
    match homes.as_slice() {
        [] => None,
        homes => Some(format!("it belongs to {}", homes.join(" or "))),
    }
}

/// Adds the heads of the tables at and below `table` that have the key.
fn homes_in(schema: &Value, table: &Value, key: &str, path: &str, homes: &mut Vec<String>) {
    let Some(properties) = table["properties"].as_object() else { return };
    for (name, property) in properties {
        let is_list = property["type"] == "array" || property["type"][0] == "array";
        let table = table_of(schema, property);
        let head = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        let bracketed = if is_list && table.is_some() { format!("[[{head}]]") } else { format!("[{head}]") };
        if name == key {
            homes.push(match (table, path) {
                (Some(_), _) => bracketed,
                (None, "") => "the top of the file".to_owned(),
                (None, _) => head_of(schema, path),
            });
        } else if let Some(table) = table {
            homes_in(schema, table, key, &head, homes);
        }
    }
}

/// The head of the table at a path, with double brackets where it is one of a list.
fn head_of(schema: &Value, path: &str) -> String {
    let mut table = Some(schema);
    let mut is_list = false;
    for name in path.split('.') {
        let property = table.map(|table| &table["properties"][name]);
        is_list =
            property.is_some_and(|property| property["type"] == "array" || property["type"][0] == "array");
        table = property.and_then(|property| table_of(schema, property));
    }
    if is_list { format!("[[{path}]]") } else { format!("[{path}]") }
}

/// The table that a property is, or that its items are.
fn table_of<'s>(schema: &'s Value, property: &'s Value) -> Option<&'s Value> {
    let all = [property, &property["items"], &property["anyOf"][0], &property["allOf"][0]];
    all.into_iter().find_map(|property| match property["$ref"].as_str() {
        Some(name) => schema.pointer(name.strip_prefix('#')?).filter(|table| table["properties"].is_object()),
        None => Some(property).filter(|property| property["properties"].is_object()),
    })
}

/// What is wrong with a file of another kind that was named as a configuration.
pub(super) fn other_kind(tree: &DeTable<'_>) -> Option<Problem> {
    let key = |name: &str| tree.keys().find(|key| key.get_ref().as_ref() == name).map(|key| key.span());
    let problem = |span, title: &str, help: &str| {
        let problem = Problem::new(code::WRONG_HEAD, span).title(title);
        problem.expected("expected a configuration, with [box], [[device]], [[axis]] and [south]").help(help)
    };
    if key("box").is_some() || key("south").is_some() || key("device").is_some() {
        return None;
    }
    if let Some(span) = key("overlay") {
        let help = "name it under `overlays` of [mappings] in a configuration, or with --mappings";
        return Some(problem(span, "this file is an overlay, not a configuration", help));
    }
    if let Some(span) = key("mapping").or_else(|| key("profile")) {
        return Some(problem(
            span,
            "this file is a table, not a configuration",
            "name its folder with --mappings",
        ));
    }
    let span = key("step")?;
    Some(problem(
        span,
        "this file is a script, not a configuration",
        "`axisbridge simulate controller` runs scripts",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn home(key: &str) -> Option<String> {
        home_of(&Problem::new(code::UNKNOWN_KEY, 0..0).key(key))
    }

    #[test]
    fn a_key_is_found_where_it_belongs() {
        for (key, expected) in [
            ("priority", "it belongs to [south.realtime]"),
            ("sercos", "it belongs to [south.sercos]"),
            ("can", "it belongs to [[south.can]]"),
            ("limits", "it belongs to [axis.limits]"),
            ("position_max", "it belongs to [axis.limits]"),
            ("set_scaling", "it belongs to [[south.sercos.drive]]"),
            ("bit_rate", "it belongs to [[south.can]] or [[south.devicenet]]"),
        ] {
            assert_eq!(home(key).as_deref(), Some(expected), "{key}");
        }
        assert_eq!(home("nonsense"), None);
    }
}
