//! What stands in the tables of `mappings`, as constants: written by `cargo run -p mappings --example generate`.

// Not every bit of a word is used.
#[allow(dead_code)]
pub(crate) mod bits;
pub(crate) mod codes;
pub(crate) mod objects;
