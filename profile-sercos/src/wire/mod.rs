//! The bytes of SERCOS III: one file per telegram or telegram part.
//!
//! Each file has a plain `Repr` (or word type) with `parse`, `buffer_len` and `emit`. `parse(emit(x)) == x`
//! for every value, and parsing never panics and never allocates, whatever the bytes are.

pub mod attribute;
pub mod connection;
pub mod cp0;
pub mod cp12;
pub mod cyclic;
pub mod data_status;
pub mod describe;
pub mod device_control;
pub mod device_status;
pub mod drive_words;
pub mod extended;
pub mod header;
pub mod hot_plug;
pub mod idn;
pub mod layout;
pub mod procedure;
pub mod scp;
pub mod slot;
pub mod svc;
pub mod svc_error;
pub mod telegram;

pub use profile_generic::wire::Error;
