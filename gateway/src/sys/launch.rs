//! Frames that leave at a given instant (`SO_TXTIME`), where the interface has the `etf` discipline: the kernel holds each frame
//! until its instant, or the network card does.
//!
//! ```text
//! tc qdisc replace dev IF root etf clockid CLOCK_TAI delta 200000 [offload]
//! ```
//!
//! The discipline throws away a frame without an instant and one whose instant has passed.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd as _, BorrowedFd};

use neli::consts::nl::NlmF;
use neli::consts::rtnl::{Rtm, Tca};
use neli::consts::socket::NlFamily;
use neli::nl::{NlPayload, NlmsghdrBuilder};
use neli::rtnl::{Tcmsg, TcmsgBuilder};
use neli::socket::synchronous::NlSocketHandle;
use neli::utils::Groups;

use super::clock::KernelTime;
use super::option::set_option;

/// `SO_TXTIME`, and `SCM_TXTIME`: the same number (`asm-generic/socket.h`).
const SO_TXTIME: libc::c_int = 61;

/// `TC_H_ROOT`: the parent of the discipline that every frame goes through.
const ROOT: u32 = u32::MAX;

/// Name of the discipline.
const ETF: &str = "etf";

/// Room for the control message, in words: a header of 16 bytes and an instant of 8.
const CONTROL_WORDS: usize = 3;

/// The discipline that every frame of an interface goes through; `None` if nobody has set one.
///
/// # Errors
/// What netlink refuses.
pub fn root_discipline(interface: i32) -> io::Result<Option<String>> {
    let question = TcmsgBuilder::default()
        .tcm_family(0)
        .tcm_ifindex(interface)
        .tcm_handle(0)
        .tcm_parent(0)
        .tcm_info(0)
        .build()
        .map_err(io::Error::other)?;
    let header = NlmsghdrBuilder::default()
        .nl_type(Rtm::Getqdisc)
        .nl_flags(NlmF::REQUEST | NlmF::DUMP)
        .nl_payload(NlPayload::Payload(question))
        .build()
        .map_err(io::Error::other)?;
    let socket = NlSocketHandle::connect(NlFamily::Route, None, Groups::empty()).map_err(io::Error::other)?;
    socket.send(&header).map_err(io::Error::other)?;
    loop {
        // A dump comes in several messages; the last one says that it is.
        let (answers, _) = socket.recv::<Rtm, Tcmsg>().map_err(io::Error::other)?;
        let mut none = true;
        for answer in answers {
            let Ok(answer) = answer else { return Ok(None) };
            none = false;
            let NlPayload::Payload(found) = answer.nl_payload() else { return Ok(None) };
            if *found.tcm_ifindex() == interface && *found.tcm_parent() == ROOT {
                let attributes = found.rtattrs().get_attr_handle();
                let kind = attributes.get_attr_payload_as_with_len_borrowed::<&str>(Tca::Kind);
                // The kernel ends the name with a zero.
                return Ok(kind.ok().map(|kind| kind.trim_end_matches('\0').to_owned()));
            }
        }
        if none {
            return Ok(None);
        }
    }
}

/// Whether an interface holds frames until their instant. One that cannot be asked does not.
#[must_use]
pub fn holds_frames(interface: i32) -> bool {
    root_discipline(interface).ok().flatten().as_deref() == Some(ETF)
}

/// Lets the frames of a socket have an instant, on the clock of TAI: `etf` knows no other.
///
/// # Errors
/// What the kernel refuses: older ones than 4.19 do not know it.
pub(super) fn enable(socket: BorrowedFd<'_>) -> io::Result<()> {
    let value = libc::sock_txtime { clockid: libc::CLOCK_TAI, flags: 0 };
    set_option(socket, libc::SOL_SOCKET, SO_TXTIME, &value)
}

/// Hands a frame over that is to leave at `at` of `CLOCK_TAI`; never waits.
///
/// # Errors
/// What the kernel says: the frame has not been taken.
pub(super) fn send(socket: BorrowedFd<'_>, frame: &[u8], at: KernelTime) -> io::Result<()> {
    // Words, so that the header stands where it may.
    let mut control = [0_u64; CONTROL_WORDS];
    let mut part = libc::iovec { iov_base: frame.as_ptr().cast_mut().cast(), iov_len: frame.len() };
    // SAFETY: `msghdr` is integers and pointers, for which all zeroes is a value.
    let mut message: libc::msghdr = unsafe { std::mem::zeroed() };
    message.msg_iov = &raw mut part;
    message.msg_iovlen = 1;
    message.msg_control = control.as_mut_ptr().cast();
    message.msg_controllen = size_of_val(&control);
    // SAFETY: `control` has room for one header with eight bytes behind it and is aligned for both; the macros stay within
    // `msg_controllen`.
    unsafe {
        let header = libc::CMSG_FIRSTHDR(&raw const message);
        (*header).cmsg_level = libc::SOL_SOCKET;
        (*header).cmsg_type = SO_TXTIME;
        (*header).cmsg_len = libc::CMSG_LEN(8) as usize;
        libc::CMSG_DATA(header).cast::<u64>().write_unaligned(at.0);
    }
    let flags = libc::MSG_DONTWAIT | libc::MSG_NOSIGNAL;
    // SAFETY: `message` and everything that it points to live through the call; the kernel reads the frame and writes nothing.
    let sent = unsafe { libc::sendmsg(socket.as_raw_fd(), &raw const message, flags) };
    if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;
    use crate::sys::link;
    use crate::sys::namespace::{in_namespace, ip};

    #[test]
    fn the_kernel_says_which_discipline_all_frames_of_an_interface_go_through() {
        in_namespace("the_kernel_says_which_discipline", || {
            ip("link add south0 type veth peer name south1");
            ip("link set south0 up");
            let Ok(south) = link::index("south0") else { panic!("it is there") };
            let tc = Command::new("tc").args(["qdisc", "replace", "dev", "south0", "root", "pfifo"]).status();
            assert!(tc.expect("tc belongs to iproute2").success());
            assert_eq!(root_discipline(south).unwrap().as_deref(), Some("pfifo"));
            assert!(!holds_frames(south));
            assert_eq!(root_discipline(99_999).unwrap(), None, "no such interface");
        });
    }
}
