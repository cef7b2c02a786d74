//! Options of sockets that neither `rustix` nor `socket2` knows.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd as _, BorrowedFd};

/// `setsockopt` with a plain C value.
pub(super) fn set_option<Value: Copy>(
    socket: BorrowedFd<'_>,
    level: libc::c_int,
    option: libc::c_int,
    value: &Value,
) -> io::Result<()> {
    let length = libc::socklen_t::try_from(size_of::<Value>()).unwrap_or(0);
    // SAFETY: `value` is readable for `length` bytes through the call; the kernel copies it.
    let result = unsafe {
        libc::setsockopt(socket.as_raw_fd(), level, option, std::ptr::from_ref(value).cast(), length)
    };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// `getsockopt` of a structure of 32 bit counters: the first `N` of them, 0 for those that the kernel does not have.
pub(super) fn counters<const N: usize>(
    socket: BorrowedFd<'_>,
    level: libc::c_int,
    option: libc::c_int,
) -> io::Result<[u32; N]> {
    let mut counters = [0_u32; N];
    let mut length = libc::socklen_t::try_from(size_of_val(&counters)).unwrap_or(0);
    // SAFETY: `counters` is writable for `length` bytes, any of which are values of it, and both outlive the call.
    let result = unsafe {
        let (value, length) = (counters.as_mut_ptr().cast(), &raw mut length);
        libc::getsockopt(socket.as_raw_fd(), level, option, value, length)
    };
    if result == 0 { Ok(counters) } else { Err(io::Error::last_os_error()) }
}
