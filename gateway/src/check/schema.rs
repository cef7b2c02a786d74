//! JSON Schemas of the files: of the configuration, of scripts and outputs, and of the tables as [`crate::mapping`] has them.

use serde_json::Value;

use crate::config::file::File;
use crate::decode::record::DecodeRecord;
use crate::mapping::Mapping;
use crate::mapping::check::schema;
use crate::simulate::script;
use crate::translate::record::Record as TranslateRecord;

/// The name of the schema of configurations.
const CONFIG: &str = "config";

/// The name of the schema of scripts.
const SCRIPT: &str = "script";

/// The names of the schemas of what `translate` and `decode` print with `--format ndjson`.
pub const OUTPUTS: [&str; 2] = ["translate-output", "decode-output"];

/// The names of all schemas.
pub fn names() -> impl Iterator<Item = &'static str> {
    [CONFIG, SCRIPT].into_iter().chain(OUTPUTS).chain(schema::names())
}

/// The schema with a name; `None` if there is no such.
#[must_use]
pub fn schema(name: &str, mapping: &Mapping) -> Option<Value> {
    match name {
        CONFIG => Some(schema::schema_of::<File>(name)),
        SCRIPT => Some(script::schema::schema(&mapping.dictionaries.cip)),
        "translate-output" => Some(schema::schema_of::<TranslateRecord<'_>>(name)),
        "decode-output" => Some(schema::schema_of::<DecodeRecord<'_>>(name)),
        _ => schema::schema(name, mapping),
    }
}
