//! Changes of a CAN interface over netlink, with the error that the kernel gives.
//!
//! The crate `socketcan` has the same requests, but keeps the kernel's answer to itself ("no netlink ack received") when it is
//! an error, and who has no privilege must be told so.

use std::io;

use neli::consts::nl::{NlmF, Nlmsg};
use neli::consts::rtnl::{Arphrd, Ifla, IflaInfo, RtAddrFamily, Rtm};
use neli::consts::socket::NlFamily;
use neli::nl::{NlPayload, NlmsghdrBuilder};
use neli::rtnl::{Ifinfomsg, IfinfomsgBuilder, RtattrBuilder};
use neli::socket::synchronous::NlSocketHandle;
use neli::types::{Buffer, RtBuffer};
use neli::utils::Groups;

/// Attributes of `linux/can/netlink.h`.
const BIT_TIMING: u16 = 1;
const CONTROL_MODE: u16 = 5;
const RESTART_MS: u16 = 6;
const RESTART: u16 = 7;
const DATA_BIT_TIMING: u16 = 9;

/// Flag of the control mode: FD frames.
const FD: u32 = 0x20;

/// A bit rate, and where a bit is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timing {
    /// bit/s.
    pub rate: u32,
    /// Thousandths of a bit; 0 lets the driver choose.
    pub sample_point: u32,
}

/// What a controller is set to; `None` leaves a thing as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Parameters {
    /// Everything but FD data.
    pub nominal: Option<Timing>,
    /// FD data.
    pub data: Option<Timing>,
    /// Whether FD frames go.
    pub fd: Option<bool>,
    /// Milliseconds until it restarts by itself; 0 is never.
    pub restart_ms: Option<u32>,
}

/// Sets a controller; its interface has to be down.
///
/// # Errors
/// What the kernel says: `EPERM` without `CAP_NET_ADMIN`, `EBUSY` while the interface is up, `EOPNOTSUPP` and `EINVAL` for what
/// the driver cannot.
pub(super) fn set(interface: i32, parameters: &Parameters) -> io::Result<()> {
    change(interface, &parameters.attributes())
}

/// Restarts a controller that is off the bus.
///
/// # Errors
/// What the kernel says: `EBUSY` where it is not off the bus, `EOPNOTSUPP` where the driver has no restart.
pub(super) fn restart(interface: i32) -> io::Result<()> {
    // The kernel does not look at the value.
    change(interface, &attribute(RESTART, &[1]))
}

/// Switches an interface on or off.
///
/// # Errors
/// What the kernel says: `EPERM` without `CAP_NET_ADMIN`, `EINVAL` where there is no bit rate yet.
pub(super) fn switch(interface: i32, on: bool) -> io::Result<()> {
    let message = message(interface);
    request(if on { message.up() } else { message.down() })
}

impl Parameters {
    fn attributes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (kind, timing) in [(BIT_TIMING, self.nominal), (DATA_BIT_TIMING, self.data)] {
            if let Some(Timing { rate, sample_point }) = timing {
                // The other six the kernel computes.
                bytes.extend(attribute(kind, &[rate, sample_point, 0, 0, 0, 0, 0, 0]));
            }
        }
        if let Some(fd) = self.fd {
            bytes.extend(attribute(CONTROL_MODE, &[FD, if fd { FD } else { 0 }]));
        }
        if let Some(milliseconds) = self.restart_ms {
            bytes.extend(attribute(RESTART_MS, &[milliseconds]));
        }
        bytes
    }
}

/// An attribute of numbers: length and kind, then the numbers.
fn attribute(kind: u16, numbers: &[u32]) -> Vec<u8> {
    let len = u16::try_from(4 + 4 * numbers.len()).unwrap_or(u16::MAX);
    let head = [len.to_ne_bytes(), kind.to_ne_bytes()].concat();
    head.into_iter().chain(numbers.iter().flat_map(|number| number.to_ne_bytes())).collect()
}

fn message(interface: i32) -> IfinfomsgBuilder {
    IfinfomsgBuilder::default()
        .ifi_family(RtAddrFamily::Unspecified)
        .ifi_type(Arphrd::Netrom)
        .ifi_index(interface)
}

fn change(interface: i32, attributes: &[u8]) -> io::Result<()> {
    let info = RtattrBuilder::default().rta_type(Ifla::Linkinfo).rta_payload(Buffer::new());
    let kind = RtattrBuilder::default().rta_type(IflaInfo::Kind).rta_payload("can");
    let data = RtattrBuilder::default().rta_type(IflaInfo::Data).rta_payload(attributes);
    let (info, kind, data) = (
        info.build().map_err(io::Error::other)?,
        kind.build().map_err(io::Error::other)?,
        data.build().map_err(io::Error::other)?,
    );
    let info = info.nest(&kind).and_then(|info| info.nest(&data)).map_err(io::Error::other)?;
    let mut all = RtBuffer::new();
    all.push(info);
    request(message(interface).rtattrs(all))
}

/// Sends a change and waits for the kernel's word on it.
fn request(message: IfinfomsgBuilder) -> io::Result<()> {
    let message = message.build().map_err(io::Error::other)?;
    let header = NlmsghdrBuilder::default()
        .nl_type(Rtm::Newlink)
        .nl_flags(NlmF::REQUEST | NlmF::ACK)
        .nl_payload(NlPayload::Payload(message))
        .build()
        .map_err(io::Error::other)?;
    let socket = NlSocketHandle::connect(NlFamily::Route, None, Groups::empty()).map_err(io::Error::other)?;
    socket.send(&header).map_err(io::Error::other)?;
    let (mut answers, _) = socket.recv::<Nlmsg, Ifinfomsg>().map_err(io::Error::other)?;
    let answer = answers.next().ok_or_else(|| io::Error::other("netlink gave no answer"))?;
    let answer = answer.map_err(io::Error::other)?;
    match answer.nl_payload() {
        NlPayload::Ack(_) => Ok(()),
        NlPayload::Err(error) => Err(io::Error::from_raw_os_error(-error.error())),
        _ => Err(io::Error::other("netlink gave another answer than asked for")),
    }
}
