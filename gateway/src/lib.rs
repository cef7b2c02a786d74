//! The Axisbridge gateway.

pub mod alone;
pub mod bundle;
pub mod capture;
pub mod check;
pub mod cli;
pub mod config;
pub mod decode;
pub mod doctor;
pub mod eds;
pub mod engine;
pub mod history;
pub mod host;
pub mod http;
pub mod latest;
pub mod line_limit;
pub mod local;
pub mod log_limit;
pub mod modbus;
pub mod north;
pub mod parameter;
pub mod places;
pub mod recording;
mod replace_file;
pub mod runner;
pub mod scan;
pub mod settings;
pub mod simulate;
pub mod status;
pub mod sys;
pub mod time;
pub mod translate;

/// The mapping tables and what was found in them, under the names by which the parts here know them.
pub use mappings as mapping;
pub use mappings::finding;
