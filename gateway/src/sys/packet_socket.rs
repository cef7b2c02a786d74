//! Whole Ethernet frames of one EtherType on one interface (`AF_PACKET`).
//!
//! The south bus of a SERCOS box: frames leave past the queueing discipline, or at a given instant by one that holds them, and
//! arrive with the kernel's time stamp; frames sent by this host are not seen. Sending and receiving never wait and never allocate.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::time::Duration;

use arrayvec::ArrayVec;
use rustix::net::{AddressFamily, SendFlags, SocketFlags, SocketType, send, socket_with};
use thiserror::Error;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::clock::{self, KernelTime};
use super::launch;
use super::link::{self, LinkError, LinkState};
use super::option::{counters, set_option};
use super::receive::{enable_time_stamps, receive, wait_for_input};

/// EtherType of SERCOS III.
pub const ETHER_TYPE_SERCOS: u16 = 0x88CD;

/// Frames of our own that one [`PacketSocket::recv`] passes over before it gives the caller its time back.
const OUTGOING_SKIPPED_MAX: usize = 32;

/// Place of `sll_pkttype` in a `sockaddr_ll`.
const PACKET_TYPE_AT: usize = std::mem::offset_of!(libc::sockaddr_ll, sll_pkttype);

/// A frame that would have to leave sooner is too late for a discipline that throws away what is late.
const LAUNCH_MIN: DurationNs = DurationNs::from_micros(100);

/// Room for received frames in the kernel: 64 cycles of eight frames of the longest kind.
const RECEIVE_BUFFER_LEN: i32 = 1 << 20;

/// Why a packet socket could not be opened.
#[derive(Debug, Error)]
pub enum OpenError {
    /// No interface has this name.
    #[error("there is no network interface `{name}`")]
    NoSuchInterface {
        /// The name asked for.
        name: String,
    },
    /// The name cannot be one of an interface.
    #[error("`{name}` cannot be the name of a network interface (1 to 15 bytes, no zero)")]
    BadName {
        /// The name asked for.
        name: String,
    },
    /// The process may not open packet sockets.
    #[error(
        "not allowed to send raw frames on `{name}`: the process needs CAP_NET_RAW (run as root, or `setcap cap_net_raw+ep` on the program)"
    )]
    NotPermitted {
        /// The name asked for.
        name: String,
    },
    /// The interface is there and switched off.
    #[error("the network interface `{name}` is down (`ip link set {name} up`)")]
    InterfaceDown {
        /// The name asked for.
        name: String,
    },
    /// The interface does not carry Ethernet frames.
    #[error("the network interface `{name}` is not Ethernet (hardware type {hardware_type})")]
    NotEthernet {
        /// The name asked for.
        name: String,
        /// Linux's `ARPHRD_` number.
        hardware_type: u16,
    },
    /// The system refused for another reason.
    #[error("cannot open `{name}`: {step}: {source}")]
    System {
        /// The name asked for.
        name: String,
        /// The system call that failed.
        step: &'static str,
        /// Its error.
        source: io::Error,
    },
}

/// A received frame; its bytes are in the caller's buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received {
    /// Bytes of the frame, from the destination address on, without frame check sequence.
    pub len: usize,
    /// When the kernel took it from the interface, where it says so.
    pub at: Option<KernelTime>,
}

/// An open packet socket.
#[derive(Debug)]
pub struct PacketSocket {
    socket: OwnedFd,
    name: String,
    index: i32,
    mac: [u8; 6],
    time_stamps: bool,
    /// Frames have an instant at which they leave.
    launches: bool,
}

impl PacketSocket {
    /// Opens the interface `name` for frames of `ether_type`, promiscuous and without waiting.
    ///
    /// # Errors
    /// [`OpenError`], one kind for each thing a person can put right.
    pub fn open(name: &str, ether_type: u16) -> Result<Self, OpenError> {
        let owned = || name.to_owned();
        let system =
            |step: &'static str, source: io::Error| OpenError::System { name: owned(), step, source };
        let index = match link::index(name) {
            Ok(index) => index,
            Err(link::NoIndex::BadName) => return Err(OpenError::BadName { name: owned() }),
            Err(link::NoIndex::NoSuchInterface) => return Err(OpenError::NoSuchInterface { name: owned() }),
        };

        // Protocol 0 receives nothing: no frame of another interface can slip in before the bind below.
        let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
        let socket = socket_with(AddressFamily::PACKET, SocketType::RAW, flags, None)
            .map_err(io::Error::from)
            .map_err(|error| match error.kind() {
                io::ErrorKind::PermissionDenied => OpenError::NotPermitted { name: owned() },
                _ => system("socket", error),
            })?;

        match link::state(socket.as_fd(), index, name) {
            LinkState::Up | LinkState::NoCarrier => {}
            LinkState::Down => return Err(OpenError::InterfaceDown { name: owned() }),
            LinkState::Gone => return Err(OpenError::NoSuchInterface { name: owned() }),
        }
        let (hardware_type, mac) =
            link::hardware_address(socket.as_fd(), name).map_err(|error| system("SIOCGIFHWADDR", error))?;
        if hardware_type != libc::ARPHRD_ETHER {
            return Err(OpenError::NotEthernet { name: owned(), hardware_type });
        }

        let launches = launch::holds_frames(index) && launch::enable(socket.as_fd()).is_ok();
        // What is to be held until its instant has to go through the discipline that holds it.
        if !launches {
            set_option(socket.as_fd(), libc::SOL_PACKET, libc::PACKET_QDISC_BYPASS, &1_i32)
                .map_err(|error| system("PACKET_QDISC_BYPASS", error))?;
        }
        // Older kernels do not know this one; `recv` looks at the packet type in any case.
        let _ = set_option(socket.as_fd(), libc::SOL_PACKET, libc::PACKET_IGNORE_OUTGOING, &1_i32);
        // A smaller buffer than asked for is still a working one.
        let _ = set_option(socket.as_fd(), libc::SOL_SOCKET, libc::SO_RCVBUF, &RECEIVE_BUFFER_LEN);
        let membership = libc::packet_mreq {
            mr_ifindex: index,
            mr_type: u16::try_from(libc::PACKET_MR_PROMISC).unwrap_or(1),
            mr_alen: 0,
            mr_address: [0; 8],
        };
        set_option(socket.as_fd(), libc::SOL_PACKET, libc::PACKET_ADD_MEMBERSHIP, &membership)
            .map_err(|error| system("PACKET_ADD_MEMBERSHIP", error))?;
        let time_stamps = enable_time_stamps(socket.as_fd());

        let address = libc::sockaddr_ll {
            sll_family: libc::sa_family_t::try_from(libc::AF_PACKET).unwrap_or(0),
            sll_protocol: ether_type.to_be(),
            sll_ifindex: index,
            sll_hatype: 0,
            sll_pkttype: 0,
            sll_halen: 0,
            sll_addr: [0; 8],
        };
        let length = libc::socklen_t::try_from(size_of::<libc::sockaddr_ll>()).unwrap_or(0);
        // SAFETY: `address` is a valid `sockaddr_ll` of the length given and outlives the call.
        let bound = unsafe { libc::bind(socket.as_raw_fd(), (&raw const address).cast(), length) };
        if bound != 0 {
            return Err(system("bind", io::Error::last_os_error()));
        }
        Ok(Self { socket, name: owned(), index, mac, time_stamps, launches })
    }

    /// Name of the interface.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The interface's Ethernet address.
    #[must_use]
    pub const fn mac(&self) -> [u8; 6] {
        self.mac
    }

    /// Whether received frames carry the kernel's time stamp.
    #[must_use]
    pub const fn has_time_stamps(&self) -> bool {
        self.time_stamps
    }

    /// Whether frames are held until the instant that [`Self::send_at`] gives them.
    #[must_use]
    pub const fn launches(&self) -> bool {
        self.launches
    }

    /// Hands over one whole frame that is to leave at this instant, or as soon as the kernel can if that is nearly past or over.
    /// Only where frames are held: [`Self::launches`].
    ///
    /// # Errors
    /// [`LinkError`]: the frame will not leave. One that the kernel throws away later, because it came too late, is not told.
    pub fn send_at(&self, frame: &[u8], at: MonotonicTime) -> Result<(), LinkError> {
        let at = at.max(clock::monotonic_now() + LAUNCH_MIN);
        launch::send(self.socket.as_fd(), frame, clock::tai_of(at))
            .map_err(|error| LinkError::from_io(&error))
    }

    /// State of the interface now.
    #[must_use]
    pub fn link_state(&self) -> LinkState {
        link::state(self.socket.as_fd(), self.index, &self.name)
    }

    /// Sends one whole frame, from the destination address on, at once or not at all.
    ///
    /// # Errors
    /// [`LinkError`]: the frame has not left.
    pub fn send(&self, frame: &[u8]) -> Result<(), LinkError> {
        let sent = send(&self.socket, frame, SendFlags::DONTWAIT | SendFlags::NOSIGNAL);
        sent.map(|_| ()).map_err(|error| LinkError::from_io(&error.into()))
    }

    /// Receives one frame into `buffer` without waiting; `Ok(None)` when there is none.
    ///
    /// A frame longer than `buffer` is cut to it.
    ///
    /// # Errors
    /// [`LinkError`]: once when the interface has gone down; receiving may be tried again.
    pub fn recv(&self, buffer: &mut [u8]) -> Result<Option<Received>, LinkError> {
        for _ in 0..OUTGOING_SKIPPED_MAX {
            let message = receive(self.socket.as_fd(), buffer).map_err(|error| LinkError::from_io(&error))?;
            let Some(message) = message else { return Ok(None) };
            if message.from[PACKET_TYPE_AT] == libc::PACKET_OUTGOING {
                continue;
            }
            return Ok(Some(Received { len: message.len, at: message.at }));
        }
        Ok(None)
    }

    /// Frames the kernel dropped since the last call because they were not fetched in time.
    #[must_use]
    pub fn take_dropped(&self) -> u32 {
        // `struct tpacket_stats`: frames, dropped frames.
        let [_, dropped] =
            counters(self.socket.as_fd(), libc::SOL_PACKET, libc::PACKET_STATISTICS).unwrap_or([0; 2]);
        dropped
    }
}

/// Waits until a frame can be received from one of the sockets (two at most) or `timeout` is over; `true` when one can.
///
/// For threads that are not the cycle's.
///
/// # Errors
/// What `poll` refuses.
pub fn wait(sockets: &[PacketSocket], timeout: Duration) -> io::Result<bool> {
    let descriptors: ArrayVec<_, 2> = sockets.iter().take(2).map(AsFd::as_fd).collect();
    wait_for_input(&descriptors, timeout)
}

impl AsFd for PacketSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sys::clock::realtime_now;
    use crate::sys::namespace::{in_namespace, ip};

    fn frame(ether_type: u16, payload: u8) -> [u8; 60] {
        let mut frame = [payload; 60];
        frame[..6].fill(0xFF);
        frame[6..12].copy_from_slice(&[2, 0, 0, 0, 0, 1]);
        frame[12..14].copy_from_slice(&ether_type.to_be_bytes());
        frame
    }

    fn veth() {
        ip("link add south0 address 02:00:00:00:00:0a type veth peer name south1");
        ip("link set south0 up");
        ip("link set south1 up");
    }

    /// The kernel reports a carrier in its own time, up to a second later.
    fn comes_to(socket: &PacketSocket, state: LinkState) {
        let end = std::time::Instant::now() + Duration::from_secs(5);
        while socket.link_state() != state && std::time::Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(socket.link_state(), state);
    }

    #[test]
    fn frames_cross_a_cable_with_time_stamps_and_without_our_own() {
        in_namespace("frames_cross_a_cable", || {
            veth();
            let a = PacketSocket::open("south0", ETHER_TYPE_SERCOS).unwrap();
            let b = PacketSocket::open("south1", ETHER_TYPE_SERCOS).unwrap();
            assert_eq!(a.mac(), [2, 0, 0, 0, 0, 0x0A]);
            assert_eq!(a.name(), "south0");
            comes_to(&a, LinkState::Up);

            let before = realtime_now();
            a.send(&frame(0x0800, 1)).unwrap();
            a.send(&frame(ETHER_TYPE_SERCOS, 2)).unwrap();
            a.send(&frame(ETHER_TYPE_SERCOS, 3)).unwrap();

            let mut buffer = [0xA5; 1518];
            for payload in [2, 3] {
                assert!(wait(std::slice::from_ref(&b), Duration::from_secs(5)).unwrap());
                let received = b.recv(&mut buffer).unwrap().unwrap();
                assert_eq!(buffer[..received.len], frame(ETHER_TYPE_SERCOS, payload));
                if b.has_time_stamps() {
                    let at = received.at.unwrap();
                    assert!(before <= at && at <= realtime_now(), "{before:?} {at:?}");
                }
            }
            assert_eq!(b.recv(&mut buffer).unwrap(), None);
            assert_eq!(a.recv(&mut buffer).unwrap(), None, "the sender sees its own frames");
            assert!(!wait(std::slice::from_ref(&a), Duration::from_millis(1)).unwrap());
            assert_eq!(b.take_dropped(), 0);
        });
    }

    #[test]
    fn an_interface_that_goes_down_is_reported_and_comes_back() {
        in_namespace("an_interface_that_goes_down", || {
            veth();
            let a = PacketSocket::open("south0", ETHER_TYPE_SERCOS).unwrap();
            let b = PacketSocket::open("south1", ETHER_TYPE_SERCOS).unwrap();
            comes_to(&a, LinkState::Up);
            let mut buffer = [0; 1518];

            ip("link set south1 down");
            comes_to(&a, LinkState::NoCarrier);
            assert_eq!(a.send(&frame(ETHER_TYPE_SERCOS, 1)), Err(LinkError::Full));

            ip("link set south0 down");
            comes_to(&a, LinkState::Down);
            assert_eq!(a.send(&frame(ETHER_TYPE_SERCOS, 1)), Err(LinkError::Down));
            assert_eq!(a.recv(&mut buffer), Err(LinkError::Down));
            assert_eq!(a.recv(&mut buffer), Ok(None), "the error is reported once");
            assert!(matches!(
                PacketSocket::open("south0", ETHER_TYPE_SERCOS),
                Err(OpenError::InterfaceDown { name }) if name == "south0"
            ));

            ip("link set south0 up");
            ip("link set south1 up");
            assert_eq!(b.recv(&mut buffer), Err(LinkError::Down));
            comes_to(&a, LinkState::Up);
            a.send(&frame(ETHER_TYPE_SERCOS, 7)).unwrap();
            assert!(wait(std::slice::from_ref(&b), Duration::from_secs(5)).unwrap());
            assert_eq!(b.recv(&mut buffer).unwrap().unwrap().len, 60);

            ip("link del south0");
            assert_eq!(a.link_state(), LinkState::Gone);
            assert_eq!(a.send(&frame(ETHER_TYPE_SERCOS, 1)), Err(LinkError::Gone));
        });
    }

    #[test]
    fn lengths_the_interface_does_not_take_are_refused() {
        in_namespace("lengths_the_interface_does_not_take", || {
            veth();
            let a = PacketSocket::open("south0", ETHER_TYPE_SERCOS).unwrap();
            let mut long = [0; 1600];
            long[..60].copy_from_slice(&frame(ETHER_TYPE_SERCOS, 1));
            assert_eq!(a.send(&long), Err(LinkError::Length));
            assert_eq!(a.send(&long[..10]), Err(LinkError::Length));
            a.send(&long[..1514]).unwrap();
        });
    }

    #[test]
    fn what_cannot_be_opened_says_why() {
        let text = |name: &str| PacketSocket::open(name, ETHER_TYPE_SERCOS).unwrap_err().to_string();
        assert_eq!(text("axb-none"), "there is no network interface `axb-none`");
        assert!(text("a-name-longer-than-fifteen").contains("cannot be the name of a network interface"));
        assert!(text("").contains("cannot be the name of a network interface"));
        assert!(text("a\0b").contains("cannot be the name of a network interface"));
        in_namespace("what_cannot_be_opened", || {
            ip("link set lo up");
            assert!(matches!(
                PacketSocket::open("lo", ETHER_TYPE_SERCOS),
                Err(OpenError::NotEthernet { hardware_type: libc::ARPHRD_LOOPBACK, .. })
            ));
        });
    }
}
