//! What is shipped and what users write: tables, configurations, schemas, data sheets, and the pages that name tests.

mod broken;
mod compliance;
mod data_sheet;
mod device_descriptions;
mod engineering_files;
mod mistakes;
mod schema_values;
mod schemas;
mod sizes;
