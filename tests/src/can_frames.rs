//! The axes of `tests/frames-can`: those of `tests/frames` on simulated CiA 402 drives.

use std::path::PathBuf;

use axisbridge::config::Config;
use axisbridge::mapping::Mapping;
use axisbridge::translate::{Stage, StageError};

/// The folder with the lists.
#[must_use]
pub fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/frames-can"))
}

/// The axes of its configuration with these tables.
///
/// # Errors
/// The tables make no program for one of them.
///
/// # Panics
/// The configuration is faulty.
pub fn stage(mapping: Mapping) -> Result<Stage, StageError> {
    let config = Config::parse(include_str!("../frames-can/config.toml"), "config.toml");
    Stage::rehearse(&config.expect("a configuration"), mapping)
}
