//! What stands in the tables of `mappings`, as constants: written by `cargo run -p mappings --example generate`.

pub(crate) mod parameters;
pub(crate) mod signals;
