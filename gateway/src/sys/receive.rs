//! One `recvmsg` with sender address and the kernel's receive time stamp, shared by the sockets of this
//! module.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd as _, BorrowedFd};
use std::time::Duration;

use arrayvec::ArrayVec;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::clock::{KernelTime, nanoseconds};
use super::option::set_option;

/// Bytes of the longest socket address here, a `sockaddr_can`.
const ADDRESS_LEN: usize = size_of::<libc::sockaddr_can>();

/// What one `recvmsg` brought; the data are in the caller's buffer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Message {
    /// Socket address of the sender as the kernel writes it, zero after its end.
    pub from: [u8; ADDRESS_LEN],
    /// Bytes written to the buffer.
    pub len: usize,
    /// Whether the message was longer than the buffer.
    pub truncated: bool,
    /// When the kernel took the message from the network.
    pub at: Option<KernelTime>,
    /// When the network card stamped it, ns of the card's own clock.
    pub card: Option<u64>,
    /// Type of service octet of an IPv4 datagram: code point and congestion bits.
    pub tos: Option<u8>,
    /// Messages that this socket has lost so far because they were not fetched in time, where that was asked for.
    pub dropped: Option<u32>,
    /// Whether this socket has sent the message itself (CAN).
    pub own: bool,
}

/// Space for the control messages of a received message: `SCM_TIMESTAMPNS`, `SCM_TIMESTAMPING`, and one `IP_TOS` or `SO_RXQ_OVFL`.
const RECEIVED_LEN: usize = 128;

/// Space for those of a sent one: `SCM_TIMESTAMPNS`, `SCM_TIMESTAMPING`, `IP_TOS` and `IP_RECVERR`.
const SENT_LEN: usize = 192;

/// Control messages, aligned as `cmsghdr` asks.
#[repr(C, align(8))]
struct Control<const LEN: usize>([u8; LEN]);

/// Receives one message without waiting; `Ok(None)` when there is none.
pub(super) fn receive(socket: BorrowedFd<'_>, buffer: &mut [u8]) -> io::Result<Option<Message>> {
    receive_from::<RECEIVED_LEN>(socket, buffer, 0)
}

/// Takes what the kernel tells of a message that was sent (`MSG_ERRQUEUE`): when it left.
pub(super) fn receive_sent(socket: BorrowedFd<'_>) -> io::Result<Option<Message>> {
    receive_from::<SENT_LEN>(socket, &mut [], libc::MSG_ERRQUEUE)
}

fn receive_from<const LEN: usize>(
    socket: BorrowedFd<'_>,
    buffer: &mut [u8],
    flags: libc::c_int,
) -> io::Result<Option<Message>> {
    let mut part = libc::iovec { iov_base: buffer.as_mut_ptr().cast(), iov_len: buffer.len() };
    let (mut from, mut control) = ([0; ADDRESS_LEN], Control([0; LEN]));
    // SAFETY: `msghdr` is integers and pointers, for which all zeroes is a value.
    let mut message: libc::msghdr = unsafe { std::mem::zeroed() };
    message.msg_name = from.as_mut_ptr().cast();
    message.msg_namelen = libc::socklen_t::try_from(ADDRESS_LEN).unwrap_or(0);
    message.msg_iov = &raw mut part;
    message.msg_iovlen = 1;
    message.msg_control = control.0.as_mut_ptr().cast();
    message.msg_controllen = control.0.len() as _;

    // SAFETY: name, buffer and control point to writable memory of the lengths given, all alive through the
    // call.
    let received = unsafe { libc::recvmsg(socket.as_raw_fd(), &raw mut message, libc::MSG_DONTWAIT | flags) };
    let Ok(len) = usize::try_from(received) else {
        let error = io::Error::last_os_error();
        return match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(None),
            _ => Err(error),
        };
    };

    let (mut at, mut card, mut tos, mut dropped) = (None, None, None, None);
    for (level, kind, data) in ControlMessages(control.0.get(..message.msg_controllen as _).unwrap_or(&[])) {
        match (level, kind) {
            (libc::SOL_SOCKET, libc::SCM_TIMESTAMPNS) => at = time_stamp(data),
            // Three, each zero where there is none: of the kernel, one that is not used any more, and of the card.
            (libc::SOL_SOCKET, libc::SCM_TIMESTAMPING) => {
                let stamp = |place| time_stamp(data.get(place * TIME_STAMP_LEN..)?).filter(|at| at.0 > 0);
                at = at.or(stamp(0));
                card = stamp(2).map(|at| at.0);
            }
            (libc::IPPROTO_IP, libc::IP_TOS) => tos = data.first().copied(),
            (libc::SOL_SOCKET, libc::SO_RXQ_OVFL) => {
                dropped = data.first_chunk().map(|bytes| u32::from_ne_bytes(*bytes));
            }
            _ => {}
        }
    }
    let flag = |flag: libc::c_int| message.msg_flags & flag != 0;
    let (truncated, own) = (flag(libc::MSG_TRUNC), flag(libc::MSG_CONFIRM));
    Ok(Some(Message { from, len, truncated, at, card, tos, dropped, own }))
}

/// The control messages of one `recvmsg`: level, type and data of each. A `cmsghdr` is length (with itself), level and type; each
/// begins at a multiple of the length of a word.
struct ControlMessages<'a>(&'a [u8]);

impl<'a> Iterator for ControlMessages<'a> {
    type Item = (libc::c_int, libc::c_int, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (length, rest) = self.0.split_first_chunk()?;
        let (level, rest) = rest.split_first_chunk()?;
        let kind = rest.first_chunk()?;
        let length = usize::from_ne_bytes(*length);
        let data = self.0.get(size_of::<libc::cmsghdr>()..length)?;
        self.0 = self.0.get(length.next_multiple_of(size_of::<usize>())..).unwrap_or(&[]);
        Some((libc::c_int::from_ne_bytes(*level), libc::c_int::from_ne_bytes(*kind), data))
    }
}

/// Bytes of a `timespec`.
const TIME_STAMP_LEN: usize = size_of::<libc::timespec>();

/// A `timespec`.
fn time_stamp(data: &[u8]) -> Option<KernelTime> {
    let (seconds, rest) = data.split_first_chunk()?;
    let rest = libc::c_long::from_ne_bytes(*rest.first_chunk()?);
    Some(KernelTime(nanoseconds(libc::time_t::from_ne_bytes(*seconds), rest)))
}

/// Waits until something can be received from one of the descriptors (two at most) or `timeout` is over; `true` when something
/// can.
pub(super) fn wait_for_input(descriptors: &[BorrowedFd<'_>], timeout: Duration) -> io::Result<bool> {
    let entry = |descriptor| PollFd::from_borrowed_fd(descriptor, PollFlags::IN);
    let mut entries: ArrayVec<_, 2> = descriptors.iter().copied().take(2).map(entry).collect();
    let timeout = Timespec {
        tv_sec: i64::try_from(timeout.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: timeout.subsec_nanos().into(),
    };
    match poll(&mut entries, Some(&timeout)) {
        Ok(ready) => Ok(ready > 0),
        Err(Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Asks the kernel to stamp received messages; `false` when it will not.
pub(super) fn enable_time_stamps(socket: BorrowedFd<'_>) -> bool {
    set_option(socket, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS, &1_i32).is_ok()
}

/// Asks the kernel to stamp messages when they leave; they are told by [`receive_sent`].
pub(super) fn enable_sent_time_stamps(socket: BorrowedFd<'_>) -> io::Result<()> {
    let flags = libc::SOF_TIMESTAMPING_TX_SOFTWARE
        | libc::SOF_TIMESTAMPING_SOFTWARE
        | libc::SOF_TIMESTAMPING_OPT_TSONLY;
    set_option(socket, libc::SOL_SOCKET, libc::SO_TIMESTAMPING, &flags)
}

/// Asks the kernel to tell the type of service octet of received datagrams.
pub(super) fn enable_type_of_service(socket: BorrowedFd<'_>) -> io::Result<()> {
    set_option(socket, libc::IPPROTO_IP, libc::IP_RECVTOS, &1_i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_messages_are_read_one_after_the_other_and_end_where_one_is_cut() {
        let word = |value: usize| value.to_ne_bytes().to_vec();
        let header = |length, level: i32, kind: i32| {
            [word(length), level.to_ne_bytes().to_vec(), kind.to_ne_bytes().to_vec()].concat()
        };
        let head = size_of::<usize>() + 8;
        // One octet and its padding, then four octets.
        let mut bytes =
            [header(head + 1, 0, 1), vec![0xB8; size_of::<usize>()], header(head + 4, 1, 40)].concat();
        bytes.extend([1, 2, 3, 4]);
        let read = |bytes: &[u8]| {
            ControlMessages(bytes).map(|(level, kind, data)| (level, kind, data.to_vec())).collect::<Vec<_>>()
        };
        assert_eq!(read(&bytes), [(0, 1, vec![0xB8]), (1, 40, vec![1, 2, 3, 4])]);
        assert_eq!(read(&bytes[..bytes.len() - 1]), [(0, 1, vec![0xB8])]);
        assert_eq!(read(&header(3, 0, 1)), []);
        assert_eq!(read(&[]), []);
    }
}
