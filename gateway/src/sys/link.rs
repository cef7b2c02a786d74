//! What all sockets bound to an interface have in common: its index, state, address and transmit queue, and why a frame was not
//! sent.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};

use nix::net::if_::if_nametoindex;
use thiserror::Error;

/// Longest name of an interface on Linux, without the closing zero.
const NAME_LEN_MAX: usize = libc::IFNAMSIZ - 1;

/// Why a name has no index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoIndex {
    /// It cannot be one of an interface.
    BadName,
    /// No interface has it.
    NoSuchInterface,
}

/// Index of the interface with this name.
pub(super) fn index(name: &str) -> Result<i32, NoIndex> {
    if name.is_empty() || name.len() > NAME_LEN_MAX || name.contains('\0') {
        return Err(NoIndex::BadName);
    }
    let index = if_nametoindex(name).map_err(|_| NoIndex::NoSuchInterface)?;
    i32::try_from(index).map_err(|_| NoIndex::NoSuchInterface)
}

/// Why a frame was not sent or nothing can be received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LinkError {
    /// The interface has been switched off (`ENETDOWN`).
    #[error("the network interface is down")]
    Down,
    /// The interface has been removed (`ENXIO`, `ENODEV`).
    #[error("the network interface is gone")]
    Gone,
    /// The transmit queue is full or the link has no carrier (`ENOBUFS`, `EAGAIN`).
    #[error("the transmit queue is full or there is no carrier")]
    Full,
    /// The frame is longer than the interface takes (`EMSGSIZE`), shorter than an Ethernet header, or an FD frame on a classic
    /// CAN interface (`EINVAL`).
    #[error("the frame's length does not suit the interface")]
    Length,
    /// Another error of the system.
    #[error("system error {0}")]
    System(i32),
}

impl LinkError {
    pub(super) fn from_io(error: &io::Error) -> Self {
        match error.raw_os_error().unwrap_or(libc::EIO) {
            libc::ENETDOWN => Self::Down,
            libc::ENXIO | libc::ENODEV => Self::Gone,
            libc::ENOBUFS | libc::EAGAIN => Self::Full,
            libc::EMSGSIZE | libc::EINVAL => Self::Length,
            other => Self::System(other),
        }
    }
}

/// State of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    /// Switched on, with carrier.
    Up,
    /// Switched on; no cable, or the other end is off.
    NoCarrier,
    /// Switched off.
    Down,
    /// No longer there.
    Gone,
}

/// `struct ifreq` of Linux, as far as it is used here: the questions fill at most 16 bytes after the name; the kernel
/// copies 40 bytes in and out.
#[repr(C, align(8))]
struct InterfaceRequest {
    name: [u8; libc::IFNAMSIZ],
    value: [u8; 24],
}

const SIOCGIFFLAGS: libc::c_ulong = 0x8913;
const SIOCGIFHWADDR: libc::c_ulong = 0x8927;
const SIOCGIFTXQLEN: libc::c_ulong = 0x8942;
const SIOCSIFTXQLEN: libc::c_ulong = 0x8943;

impl InterfaceRequest {
    fn ask(
        socket: BorrowedFd<'_>,
        name: &str,
        question: libc::c_ulong,
        value: [u8; 24],
    ) -> io::Result<[u8; 24]> {
        let mut request = Self { name: [0; libc::IFNAMSIZ], value };
        for (slot, byte) in request.name[..NAME_LEN_MAX].iter_mut().zip(name.bytes()) {
            *slot = byte;
        }
        // SAFETY: all these requests read and write a `struct ifreq`, which `request` is, alive through the call.
        let result = unsafe { libc::ioctl(socket.as_raw_fd(), question as _, &raw mut request) };
        if result < 0 { Err(io::Error::last_os_error()) } else { Ok(request.value) }
    }
}

/// State of the interface that had this index and name.
pub(super) fn state(socket: BorrowedFd<'_>, index: i32, name: &str) -> LinkState {
    let Ok(value) = InterfaceRequest::ask(socket, name, SIOCGIFFLAGS, [0; 24]) else {
        return LinkState::Gone;
    };
    // The name may have passed to another interface since.
    let same = self::index(name) == Ok(index);
    let flags = i32::from(u16::from_ne_bytes([value[0], value[1]]));
    if !same {
        LinkState::Gone
    } else if flags & libc::IFF_UP == 0 {
        LinkState::Down
    } else if flags & libc::IFF_RUNNING == 0 {
        LinkState::NoCarrier
    } else {
        LinkState::Up
    }
}

/// Linux's `ARPHRD_` number of an interface, and its address.
pub(super) fn hardware_address(socket: BorrowedFd<'_>, name: &str) -> io::Result<(u16, [u8; 6])> {
    let value = InterfaceRequest::ask(socket, name, SIOCGIFHWADDR, [0; 24])?;
    let hardware_type = u16::from_ne_bytes([value[0], value[1]]);
    let mut mac = [0; 6];
    mac.copy_from_slice(&value[2..8]);
    Ok((hardware_type, mac))
}

/// Frames that the transmit queue of an interface holds.
pub(super) fn queue_length(socket: BorrowedFd<'_>, name: &str) -> io::Result<u32> {
    let value = InterfaceRequest::ask(socket, name, SIOCGIFTXQLEN, [0; 24])?;
    Ok(u32::from_ne_bytes([value[0], value[1], value[2], value[3]]))
}

/// Lets the transmit queue of an interface hold so many frames.
pub(super) fn set_queue_length(socket: BorrowedFd<'_>, name: &str, frames: u32) -> io::Result<()> {
    let mut value = [0; 24];
    value[..4].copy_from_slice(&frames.to_ne_bytes());
    InterfaceRequest::ask(socket, name, SIOCSIFTXQLEN, value).map(|_| ())
}
