//! One `recvmsg` with sender address and the kernel's receive time stamp, shared by the sockets of this
//! module.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd, RawFd};
use std::time::Duration;

use arrayvec::ArrayVec;

use super::clock::{KernelTime, nanoseconds};

/// What one `recvmsg` brought; the data are in the caller's buffer, the address in the caller's storage.
#[derive(Debug, Clone, Copy)]
pub(super) struct Message {
    /// Bytes written to the buffer.
    pub len: usize,
    /// Whether the message was longer than the buffer.
    pub truncated: bool,
    /// When the kernel took the message from the network.
    pub at: Option<KernelTime>,
    /// Type of service octet of an IPv4 datagram: code point and congestion bits.
    pub tos: Option<u8>,
    /// Messages that this socket has lost so far because they were not fetched in time, where that was asked for.
    pub dropped: Option<u32>,
    /// Whether this socket has sent the message itself (CAN).
    pub own: bool,
}

/// Space for one `SCM_TIMESTAMPNS` and one `IP_TOS` or `SO_RXQ_OVFL` control message, aligned as `cmsghdr` asks.
#[repr(C, align(8))]
struct Control([u8; 64]);

/// A C address structure of integers, into which the kernel may write any bytes.
///
/// # Safety
/// Every bit pattern, also one the kernel has filled in part, must be a value of the type.
pub(super) unsafe trait PlainAddress: Sized {
    /// The address of all zeroes.
    fn zeroed() -> Self {
        // SAFETY: the trait promises that any bit pattern is a value.
        unsafe { std::mem::zeroed() }
    }
}

// SAFETY: both consist of integers and arrays of integers.
unsafe impl PlainAddress for libc::sockaddr_in {}
// SAFETY: as above.
unsafe impl PlainAddress for libc::sockaddr_ll {}
// SAFETY: a family, an index and a union of structures of integers.
unsafe impl PlainAddress for libc::sockaddr_can {}

/// Receives one message without waiting; `Ok(None)` when there is none.
pub(super) fn receive<Address: PlainAddress>(
    socket: BorrowedFd<'_>,
    buffer: &mut [u8],
    from: &mut Address,
) -> io::Result<Option<Message>> {
    let mut part = libc::iovec { iov_base: buffer.as_mut_ptr().cast(), iov_len: buffer.len() };
    let mut control = Control([0; 64]);
    // SAFETY: `msghdr` is integers and pointers, for which all zeroes is a value.
    let mut message: libc::msghdr = unsafe { std::mem::zeroed() };
    message.msg_name = std::ptr::from_mut(from).cast();
    message.msg_namelen = libc::socklen_t::try_from(size_of::<Address>()).unwrap_or(0);
    message.msg_iov = &raw mut part;
    message.msg_iovlen = 1;
    message.msg_control = control.0.as_mut_ptr().cast();
    message.msg_controllen = control.0.len() as _;

    // SAFETY: name, buffer and control point to writable memory of the lengths given, all alive through the
    // call.
    let received = unsafe { libc::recvmsg(socket.as_raw_fd(), &raw mut message, libc::MSG_DONTWAIT) };
    let Ok(len) = usize::try_from(received) else {
        let error = io::Error::last_os_error();
        return match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(None),
            _ => Err(error),
        };
    };

    let (mut at, mut tos, mut dropped) = (None, None, None);
    // SAFETY: the kernel has filled `message`; the macros walk only within `msg_controllen` bytes of
    // `control`.
    let mut header = unsafe { libc::CMSG_FIRSTHDR(&raw const message) };
    while !header.is_null() {
        // SAFETY: a header that is not null points into `control`, at a place aligned and long enough for it.
        let (level, kind) = unsafe { ((*header).cmsg_level, (*header).cmsg_type) };
        if level == libc::SOL_SOCKET && kind == libc::SCM_TIMESTAMPNS {
            // SAFETY: this message carries one `timespec`; it need not be aligned for it.
            let stamp = unsafe { libc::CMSG_DATA(header).cast::<libc::timespec>().read_unaligned() };
            at = Some(KernelTime(nanoseconds(stamp)));
        }
        if level == libc::IPPROTO_IP && kind == libc::IP_TOS {
            // SAFETY: this message carries one octet.
            tos = Some(unsafe { libc::CMSG_DATA(header).read() });
        }
        if level == libc::SOL_SOCKET && kind == libc::SO_RXQ_OVFL {
            // SAFETY: this message carries one integer of 32 bits; it need not be aligned for it.
            dropped = Some(unsafe { libc::CMSG_DATA(header).cast::<u32>().read_unaligned() });
        }
        // SAFETY: as for CMSG_FIRSTHDR; `header` came from it.
        header = unsafe { libc::CMSG_NXTHDR(&raw const message, header) };
    }
    let flag = |flag: libc::c_int| message.msg_flags & flag != 0;
    let (truncated, own) = (flag(libc::MSG_TRUNC), flag(libc::MSG_CONFIRM));
    Ok(Some(Message { len, truncated, at, tos, dropped, own }))
}

/// Waits until something can be received from one of the descriptors (two at most) or `timeout` is over; `true` when something
/// can.
pub(super) fn wait_for_input(descriptors: &[RawFd], timeout: Duration) -> io::Result<bool> {
    let entry = |descriptor: &RawFd| libc::pollfd { fd: *descriptor, events: libc::POLLIN, revents: 0 };
    let mut entries: ArrayVec<_, 2> = descriptors.iter().take(2).map(entry).collect();
    let count = libc::nfds_t::try_from(entries.len()).unwrap_or(0);
    let timeout = libc::timespec {
        tv_sec: libc::time_t::try_from(timeout.as_secs()).unwrap_or(libc::time_t::MAX),
        tv_nsec: libc::c_long::from(timeout.subsec_nanos().cast_signed()),
    };
    // SAFETY: `entries` are `count` valid, writable `pollfd`s, and they and `timeout` outlive the call; without a signal mask
    // the process keeps its own.
    let ready = unsafe { libc::ppoll(entries.as_mut_ptr(), count, &raw const timeout, std::ptr::null()) };
    if ready < 0 {
        let error = io::Error::last_os_error();
        return if error.kind() == io::ErrorKind::Interrupted { Ok(false) } else { Err(error) };
    }
    Ok(ready > 0)
}

/// Asks the kernel to stamp received messages; `false` when it will not.
pub(super) fn enable_time_stamps(socket: BorrowedFd<'_>) -> bool {
    set_option(socket, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS, &1_i32).is_ok()
}

/// Asks the kernel to tell the type of service octet of received datagrams.
pub(super) fn enable_type_of_service(socket: BorrowedFd<'_>) -> io::Result<()> {
    set_option(socket, libc::IPPROTO_IP, libc::IP_RECVTOS, &1_i32)
}

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
