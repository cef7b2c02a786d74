//! JSON Schemas of the files: of the configuration, and of the tables as [`crate::mapping`] has them.

use serde_json::Value;

use crate::config::file::File;
use crate::mapping::Mapping;
use crate::mapping::check::schema;

/// The name of the schema of configurations.
const CONFIG: &str = "config";

/// The names of all schemas.
pub fn names() -> impl Iterator<Item = &'static str> {
    [CONFIG].into_iter().chain(schema::names())
}

/// The schema with a name; `None` if there is no such.
#[must_use]
pub fn schema(name: &str, mapping: &Mapping) -> Option<Value> {
    if name == CONFIG { Some(schema::schema_of::<File>(name)) } else { schema::schema(name, mapping) }
}
