//! What stands in the tables of `mappings`, as constants: written by `cargo run -p mappings --example generate`.

// Not every bit of a word is used.
pub(crate) mod attributes;
pub(crate) mod devicenet;
#[allow(dead_code)]
pub(crate) mod motion_bits;
pub(crate) mod motion_codes;
