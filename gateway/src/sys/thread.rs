//! Threads with a name, and a stack whose size is chosen.
//!
//! Locking the memory of the process makes every stack that there is then resident as a whole: the 2 MiB that a thread has unless
//! something is said are most of what a gateway takes.

use std::thread::Builder;

/// Bytes of the stack of a thread that waits for a signal and sets a flag.
pub const WAITING_STACK: usize = 64 * 1_024;

/// Bytes of the stack of a thread that does one small thing.
pub const SMALL_STACK: usize = 384 * 1_024;

/// Bytes of the stack of a thread that runs the cycle, or answers requests.
pub const STACK: usize = 1_024 * 1_024;

/// A thread with this name and a stack of so many bytes, to be started.
pub fn named(name: &str, stack: usize) -> Builder {
    Builder::new().name(name.to_owned()).stack_size(stack)
}
