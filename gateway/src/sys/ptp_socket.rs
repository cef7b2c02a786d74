//! The sockets of a PTP clock: UDP 319 for event messages, with the kernel's stamps of receipt and sending, and UDP 320 for general
//! ones.
//!
//! The stamps are those of the network card where it has some ([`CardStamps`]), else those of the kernel, taken in the driver or just
//! above it. For the latter `CLOCK_REALTIME` is only between them and the monotonic
//! clock of the same moment: a step of it spoils the messages of that moment, and those are left out.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::time::Duration;

use profile_generic::time::MonotonicTime;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::{Domain, InterfaceIndexOrAddress, Protocol, SockAddr, Socket, Type};
use thiserror::Error;

use super::card_stamps::{CardStamps, NotUsed};
use super::clock::{exactly_monotonic, monotonic_now};
use super::link;
use super::option::set_option;
use super::receive::{
    Message, enable_sent_time_stamps, enable_time_stamps, receive, receive_sent, wait_for_input,
};

/// Ports of event and general messages.
const EVENT: u16 = 319;
const GENERAL: u16 = 320;

/// Where PTP messages go (IEEE 1588-2008, annex D).
const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 1, 129);

/// How long the kernel may take to tell when a message left.
const SENT_TIME_OUT: Duration = Duration::from_millis(20);

/// Why there are no sockets.
#[derive(Debug, Error)]
pub enum OpenError {
    /// There is no such interface.
    #[error("there is no network interface {interface}")]
    NoSuchInterface {
        /// Its name.
        interface: String,
    },
    /// Another program has the port.
    #[error(
        "UDP {port} is taken by another program: does ptp4l run here? Then source = \"daemon\" takes the time from it"
    )]
    InUse {
        /// 319 or 320.
        port: u16,
    },
    /// The ports below 1024 need a privilege.
    #[error("UDP {port} needs the capability CAP_NET_BIND_SERVICE, or root")]
    NoPrivilege {
        /// 319 or 320.
        port: u16,
    },
    /// The system refused for another reason.
    #[error("cannot open UDP {port} for PTP: {step}: {source}")]
    System {
        /// 319 or 320.
        port: u16,
        /// What was being done.
        step: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

/// Code points that mark the messages, 0 to 63.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dscp {
    /// Of event messages.
    pub event: u8,
    /// Of general messages.
    pub general: u8,
}

impl Default for Dscp {
    /// Those of CIP Sync.
    fn default() -> Self {
        Self { event: 59, general: 47 }
    }
}

/// A message that came; its bytes are in the caller's buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrived {
    /// How many bytes.
    pub len: usize,
    /// When, for an event message (port 319); `None` for a general one (port 320).
    pub event: Option<MonotonicTime>,
}

/// See the module.
#[derive(Debug)]
pub struct PtpSockets {
    interface: String,
    index: i32,
    event: Socket,
    general: Socket,
    /// Those of the card, or why the kernel's are taken.
    card: Result<CardStamps, NotUsed>,
}

impl PtpSockets {
    /// Opens them on an interface. `use_card`: stamps of the network card are taken where it has some.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn open(interface: &str, dscp: Dscp, use_card: bool) -> Result<Self, OpenError> {
        let index = link::index(interface)
            .map_err(|_| OpenError::NoSuchInterface { interface: interface.to_owned() })?;
        let number = u32::try_from(index).unwrap_or(0);
        let event = open(EVENT, number, dscp.event)?;
        let system = |step| move |source| OpenError::System { port: EVENT, step, source };
        if !enable_time_stamps(event.as_fd()) {
            return Err(system("SO_TIMESTAMPNS")(io::Error::last_os_error()));
        }
        let card =
            if use_card { CardStamps::start(interface, event.as_fd()) } else { Err(NotUsed::Unwanted) };
        if card.is_err() {
            enable_sent_time_stamps(event.as_fd()).map_err(system("SO_TIMESTAMPING"))?;
        }
        let general = open(GENERAL, number, dscp.general)?;
        Ok(Self { interface: interface.to_owned(), index, event, general, card })
    }

    /// Whether the interface has gone and come back as another one under its name: its group was left with the first one, and
    /// nothing is heard on these sockets any more.
    #[must_use]
    pub fn is_replaced(&self) -> bool {
        link::index(&self.interface).is_ok_and(|index| index != self.index)
    }

    /// The card that stamps, or why the kernel does.
    ///
    /// # Errors
    /// The reason is no failure.
    pub fn card(&self) -> Result<&CardStamps, &NotUsed> {
        self.card.as_ref()
    }

    /// Waits for a message until an instant at most.
    ///
    /// # Errors
    /// What the system says.
    pub fn wait(&self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
        if let Some(arrived) = self.take(buffer)? {
            return Ok(Some(arrived));
        }
        let left = Duration::from_nanos(until.0.saturating_sub(monotonic_now().0));
        if wait_for_input(&[self.event.as_fd(), self.general.as_fd()], left)? {
            self.take(buffer)
        } else {
            Ok(None)
        }
    }

    /// Sends an event message to all. Returns when it left, if the kernel says so in time.
    ///
    /// # Errors
    /// What the system says; a message that could not be sent is no error, as a cable that was pulled comes back.
    pub fn send_event(&self, message: &[u8]) -> io::Result<Option<MonotonicTime>> {
        self.forget_sent()?;
        match self.event.send_to(message, &SockAddr::from(SocketAddrV4::new(GROUP, EVENT))) {
            Ok(_) => self.sent(),
            Err(_) => Ok(None),
        }
    }

    /// Sends a general message to all.
    pub fn send_general(&self, message: &[u8]) {
        // One that could not be sent is no error, as a cable that was pulled comes back.
        let _ = self.general.send_to(message, &SockAddr::from(SocketAddrV4::new(GROUP, GENERAL)));
    }

    /// A stamp that came too late is that of no message, and wakes everybody who waits.
    fn forget_sent(&self) -> io::Result<()> {
        while receive_sent(self.event.as_fd())?.is_some() {}
        Ok(())
    }

    /// The next message that is there.
    fn take(&self, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
        while let Some(message) = receive(self.event.as_fd(), buffer)? {
            // Without the time of its receipt an event message says nothing.
            let at = match &self.card {
                Ok(card) if is_event(buffer.get(..message.len).unwrap_or(&[])) => {
                    card.received(message.card).map_err(io::Error::other)?
                }
                Ok(_) => None,
                Err(_) => message.at.and_then(exactly_monotonic),
            };
            if let (Some(at), false) = (at, message.truncated) {
                return Ok(Some(Arrived { len: message.len, event: Some(at) }));
            }
        }
        while let Some(message) = receive(self.general.as_fd(), buffer)? {
            if !message.truncated {
                return Ok(Some(Arrived { len: message.len, event: None }));
            }
        }
        self.forget_sent()?;
        Ok(None)
    }

    /// When the message sent last left.
    fn sent(&self) -> io::Result<Option<MonotonicTime>> {
        let end = monotonic_now().0 + u64::try_from(SENT_TIME_OUT.as_nanos()).unwrap_or(0);
        loop {
            let left = end.saturating_sub(monotonic_now().0);
            match receive_sent(self.event.as_fd())? {
                Some(message) => return self.left_at(Some(&message)),
                None if left == 0 => return self.left_at(None),
                None => wait_for_sent(self.event.as_fd(), left)?,
            }
        }
    }

    /// When a message left, by what the kernel says of it.
    fn left_at(&self, message: Option<&Message>) -> io::Result<Option<MonotonicTime>> {
        match &self.card {
            Ok(card) => card.sent(message.and_then(|message| message.card)).map_err(io::Error::other),
            Err(_) => Ok(message.and_then(|message| message.at).and_then(exactly_monotonic)),
        }
    }
}

/// Whether this is an event message of PTP version 2, as the filter of a card knows it.
fn is_event(message: &[u8]) -> bool {
    matches!(message, [kind, version, ..] if kind & 0x0F < 4 && version & 0x0F == 2)
}

/// Waits until something can be read from the error queue.
fn wait_for_sent(socket: BorrowedFd<'_>, nanoseconds: u64) -> io::Result<()> {
    let mut entry = [PollFd::from_borrowed_fd(socket, PollFlags::ERR)];
    let timeout = Timespec { tv_sec: 0, tv_nsec: nanoseconds.min(999_999_999).try_into().unwrap_or(0) };
    match poll(&mut entry, Some(&timeout)) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

fn open(port: u16, index: u32, dscp: u8) -> Result<Socket, OpenError> {
    let system = |step: &'static str| move |source: io::Error| OpenError::System { port, step, source };
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP)).map_err(system("socket"))?;
    socket.set_nonblocking(true).map_err(system("O_NONBLOCK"))?;
    socket.bind(&SockAddr::from(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port))).map_err(|source| {
        match source.kind() {
            io::ErrorKind::AddrInUse => OpenError::InUse { port },
            io::ErrorKind::PermissionDenied => OpenError::NoPrivilege { port },
            _ => OpenError::System { port, step: "bind", source },
        }
    })?;
    let interface = InterfaceIndexOrAddress::Index(index);
    socket.join_multicast_v4_n(&GROUP, &interface).map_err(system("IP_ADD_MEMBERSHIP"))?;
    // Messages of other interfaces, joined by other programs, are not ours.
    socket.set_multicast_all_v4(false).map_err(system("IP_MULTICAST_ALL"))?;
    let outgoing = libc::ip_mreqn {
        imr_multiaddr: libc::in_addr { s_addr: 0 },
        imr_address: libc::in_addr { s_addr: 0 },
        imr_ifindex: index.try_into().unwrap_or(0),
    };
    set_option(socket.as_fd(), libc::IPPROTO_IP, libc::IP_MULTICAST_IF, &outgoing)
        .map_err(system("IP_MULTICAST_IF"))?;
    socket.set_multicast_ttl_v4(1).map_err(system("IP_MULTICAST_TTL"))?;
    socket.set_multicast_loop_v4(false).map_err(system("IP_MULTICAST_LOOP"))?;
    socket.set_tos_v4(u32::from(dscp & 0x3F) << 2).map_err(system("IP_TOS"))?;
    Ok(socket)
}
