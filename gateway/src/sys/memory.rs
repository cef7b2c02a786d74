//! Memory that goes back to the system as soon as it is not needed.
#![allow(unsafe_code)]

/// Blocks of at least this many bytes are mapped by themselves.
#[cfg(target_env = "gnu")]
const LARGE: libc::c_int = 1 << 20;

/// Lets large blocks go back to the system when they are freed: bundles, recordings and the verification of a token take tens of megabytes
/// for a moment. Otherwise glibc learns from the first one to keep such blocks, for each thread, and they would stay locked in memory.
pub fn return_large_blocks() {
    #[cfg(target_env = "gnu")]
    // SAFETY: the call takes two numbers and changes only how the allocator gets memory from now on. A refusal leaves it as it is.
    let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE) };
}

/// Gives back what was freed until now. Called once, before the memory is locked: from then on nothing goes back, because the system keeps
/// locked pages.
pub fn return_freed_memory() {
    #[cfg(target_env = "gnu")]
    // SAFETY: the call takes a number of bytes to keep and gives free memory of the allocator back. Nobody has references to that.
    let _ = unsafe { libc::malloc_trim(0) };
}
