//! The codec kit of all protocol crates: checked cursors for layouts of variable length, offsets for fixed ones, one error.

#[doc(hidden)]
pub mod check;
mod error;
mod fixed;
mod reader;
mod writer;

use core::fmt;

pub use error::{Error, Expected};
pub use fixed::{exact, need, put_u16, put_u32, u16_at, u32_at};
pub use reader::Reader;
pub use writer::Writer;

/// Writes names in brackets, separated by commas; nothing if there are none.
///
/// # Errors
/// As the formatter.
pub fn display_bits(f: &mut fmt::Formatter<'_>, names: impl Iterator<Item = &'static str>) -> fmt::Result {
    let mut open = false;
    for name in names {
        write!(f, "{}{name}", if open { ", " } else { " (" })?;
        open = true;
    }
    if open { f.write_str(")") } else { Ok(()) }
}
