//! The bytes of CANopen: one file per kind of frame.
//!
//! Each file has plain values with `parse`, which takes the data of a frame, and `emit`, which gives them. `parse(emit(x)) == x`
//! for every value, and parsing never panics and never allocates, whatever the bytes are. Which kind a frame is follows from its
//! identifier: [`cob_id::Function`].
//!
//! Sources named in the tests: "CO_*.h" are the headers of CANopenNode, "canopen tests" those of the Python package `canopen`;
//! both hold bytes that other implementations send.

pub mod abort;
pub mod bytes;
pub mod cob_id;
pub mod emcy;
pub mod error_control;
pub mod lss;
pub mod mux;
pub mod nmt;
pub mod pdo;
pub mod sdo;
pub mod sync;
pub mod time;

pub use abort::AbortCode;
pub use bytes::Bytes;
pub use cob_id::{CobId, Function, NodeId};
pub use mux::Mux;
pub use profile_generic::wire::Error;

use profile_generic::can::{Frame, Id};

/// A classic frame.
///
/// # Panics
/// With more than eight bytes, or an identifier that none of [`cob_id`] has made.
#[must_use]
pub fn frame(id: Id, data: &[u8]) -> Frame {
    Frame::new(id, data).expect("an identifier in its range and at most eight bytes")
}
