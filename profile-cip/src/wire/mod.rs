//! The bytes of EtherNet/IP, CIP and CIP Motion: one file per block.
//!
//! Each file has a plain value with `parse`, `buffer_len` and `emit`. `parse(emit(x)) == x` for every value,
//! and parsing never panics and never allocates, whatever the bytes are.

pub mod error;
pub mod reader;
pub mod writer;

pub use error::Error;
pub use reader::Reader;
pub use writer::Writer;
