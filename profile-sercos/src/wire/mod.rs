//! The bytes of SERCOS III: one file per telegram or telegram part.
//!
//! Each file has a plain `Repr` (or word type) with `parse`, `buffer_len` and `emit`. `parse(emit(x)) == x`
//! for every value, and parsing never panics and never allocates, whatever the bytes are.

pub mod attribute;
pub mod connection;
pub mod data_status;
pub mod drive_words;
pub mod error;
pub mod idn;
pub mod procedure;
pub mod scp;
pub mod svc;
pub mod svc_error;

pub use error::Error;
