//! The server's end of a channel.

use crate::wire::{AbortCode, Mux};

/// What a server gives access to: an object dictionary.
///
/// Values go in and out as a whole: what comes in segments or blocks is collected by the server, so that no object ever has
/// half of a value.
pub trait ObjectAccess {
    /// Copies the value of an object to the start of `into`, and returns how many bytes it has.
    ///
    /// # Errors
    /// The abort code that the client shall have; [`AbortCode::OUT_OF_MEMORY`] when `into` is too short.
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode>;

    /// Whether an object may be written now, `size` bytes if that is told. It is asked when a transfer begins, so that nobody
    /// sends what is refused in the end. Returns the most bytes that the object takes; of four bytes whose number is not told,
    /// no more than these are taken.
    ///
    /// # Errors
    /// The abort code that the client shall have.
    fn write_begins(&mut self, object: Mux, size: Option<u32>) -> Result<usize, AbortCode>;

    /// Writes a value. The object may refuse it by what it is.
    ///
    /// # Errors
    /// The abort code that the client shall have; the object is as before.
    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode>;
}
