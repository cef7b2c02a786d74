//! The codec kit of all protocol crates: checked cursors for layouts of variable length, offsets for fixed ones, one error.

mod error;
mod fixed;
mod reader;
mod writer;

pub use error::Error;
pub use fixed::{exact, need, put_u16, put_u32, u16_at, u32_at};
pub use reader::Reader;
pub use writer::Writer;
