//! CAN frames of one interface (`SocketCAN`, `CAN_RAW`).
//!
//! Sending and receiving never wait and never allocate. Received frames carry the kernel's time stamp. What the controller
//! says of the bus, its state and its errors, comes in as error frames ([`Content::Error`]); a virtual interface has none.
//! Frames of this socket are not received, unless they are asked for ([`Options::own`]) to know when they went out; frames
//! of other programs on this host are, as from the bus.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use profile_generic::can::{Frame, Id};
use socketcan::id::FdFlags;
use socketcan::{
    CanAddr, CanDataFrame, CanFdFrame, CanFdSocket, CanFilter, CanRemoteFrame, EmbeddedFrame as _,
    Socket as _, SocketOptions as _,
};
use thiserror::Error;

use super::can_error::ErrorFrame;
use super::clock::KernelTime;
use super::link::{self, LinkError, LinkState};
use super::option::set_option;
use super::receive::{enable_time_stamps, receive, wait_for_input};

/// Lengths of the kernel's `struct can_frame` and `struct canfd_frame`.
const CLASSIC_LEN: usize = 16;
const FD_LEN: usize = 72;

/// Flags in the kernel's identifier word.
const EXTENDED_FLAG: u32 = 0x8000_0000;
const REMOTE_FLAG: u32 = 0x4000_0000;
const ERROR_FLAG: u32 = 0x2000_0000;

/// Bit rate switch in the flags of a `struct canfd_frame`.
const BIT_RATE_SWITCH: u8 = 0x01;

/// Messages that are no frames of ours which one [`CanSocket::recv`] passes over before it gives the caller its time back.
const SKIPPED_MAX: usize = 32;

/// Room for received frames in the kernel.
const RECEIVE_BUFFER_LEN: i32 = 1 << 20;

/// Why a CAN socket could not be opened.
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
    /// The process may not open CAN sockets.
    #[error("not allowed to open CAN sockets on `{name}`")]
    NotPermitted {
        /// The name asked for.
        name: String,
    },
    /// The interface is there and switched off.
    #[error("the CAN interface `{name}` is down (`ip link set {name} up`)")]
    InterfaceDown {
        /// The name asked for.
        name: String,
    },
    /// The interface carries no CAN frames.
    #[error("the network interface `{name}` is not CAN (hardware type {hardware_type})")]
    NotCan {
        /// The name asked for.
        name: String,
        /// Linux's `ARPHRD_` number.
        hardware_type: u16,
    },
    /// The kernel has no CAN.
    #[error("this kernel has no CAN (`modprobe can_raw`)")]
    NoCan,
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

/// Frames that a socket takes: those whose identifier has the bits of `id` where `mask` has ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Filter {
    /// The bits; an identifier of 11 bits fits no frame of 29, and the other way round.
    pub id: Id,
    /// Which of them count.
    pub mask: u32,
}

impl Filter {
    /// Exactly this identifier, data frames and remote frames.
    #[must_use]
    pub const fn exactly(id: Id) -> Self {
        Self { id, mask: Id::EXTENDED_MAX }
    }

    fn to_kernel(self) -> CanFilter {
        match self.id {
            Id::Standard(id) => {
                CanFilter::new(u32::from(id), self.mask & u32::from(Id::STANDARD_MAX) | EXTENDED_FLAG)
            }
            Id::Extended(id) => {
                CanFilter::new(id | EXTENDED_FLAG, self.mask & Id::EXTENDED_MAX | EXTENDED_FLAG)
            }
        }
    }
}

/// How a socket is opened.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// What it takes; everything if there are none. Error frames come in any case.
    pub filters: Vec<Filter>,
    /// Whether frames that this socket has sent are received, once they have gone out ([`Received::own`]).
    pub own: bool,
}

/// What came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received {
    /// When the kernel took it from the interface, where it says so.
    pub at: Option<KernelTime>,
    /// Whether this socket has sent it.
    pub own: bool,
    /// A frame of the bus, or what the controller reports.
    pub content: Content,
}

/// A frame of the bus or word of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// A frame of another station, or one of this socket.
    Frame(Frame),
    /// What the controller says of the bus.
    Error(ErrorFrame),
}

/// An open CAN socket.
#[derive(Debug)]
pub struct CanSocket {
    socket: CanFdSocket,
    name: String,
    index: i32,
    time_stamps: bool,
    /// The kernel's count of frames that were not fetched in time, and how much of it has been reported.
    dropped: u32,
    dropped_told: u32,
    unreadable: u32,
}

impl CanSocket {
    /// Opens the interface `name`, without waiting.
    ///
    /// # Errors
    /// [`OpenError`], one kind for each thing a person can put right.
    pub fn open(name: &str, options: &Options) -> Result<Self, OpenError> {
        let owned = || name.to_owned();
        let system =
            |step: &'static str, source: io::Error| OpenError::System { name: owned(), step, source };
        let index = match link::index(name) {
            Ok(index) => index,
            Err(link::NoIndex::BadName) => return Err(OpenError::BadName { name: owned() }),
            Err(link::NoIndex::NoSuchInterface) => return Err(OpenError::NoSuchInterface { name: owned() }),
        };
        // Any socket can ask; one of CAN cannot be had on an interface that is none.
        let probe = std::net::UdpSocket::bind("0.0.0.0:0").map_err(|error| system("socket", error))?;
        match link::state(probe.as_fd(), index, name) {
            LinkState::Up | LinkState::NoCarrier => {}
            LinkState::Down => return Err(OpenError::InterfaceDown { name: owned() }),
            LinkState::Gone => return Err(OpenError::NoSuchInterface { name: owned() }),
        }
        let (hardware_type, _) =
            link::hardware_address(probe.as_fd(), name).map_err(|error| system("SIOCGIFHWADDR", error))?;
        if hardware_type != libc::ARPHRD_CAN {
            return Err(OpenError::NotCan { name: owned(), hardware_type });
        }
        let address = CanAddr::new(u32::try_from(index).unwrap_or(0));
        let socket = CanFdSocket::open_addr(&address).map_err(|error| match error.raw_os_error() {
            Some(libc::EAFNOSUPPORT | libc::EPROTONOSUPPORT) => OpenError::NoCan,
            Some(libc::EPERM | libc::EACCES) => OpenError::NotPermitted { name: owned() },
            Some(libc::ENODEV | libc::ENXIO) => OpenError::NoSuchInterface { name: owned() },
            _ => system("socket", error),
        })?;
        if !options.filters.is_empty() {
            let filters: Vec<CanFilter> = options.filters.iter().map(|filter| filter.to_kernel()).collect();
            socket.set_filters(&filters).map_err(|error| system("CAN_RAW_FILTER", error))?;
        }
        socket.set_error_filter_accept_all().map_err(|error| system("CAN_RAW_ERR_FILTER", error))?;
        socket.set_recv_own_msgs(options.own).map_err(|error| system("CAN_RAW_RECV_OWN_MSGS", error))?;
        let plain = socket.as_raw_socket();
        plain.set_cloexec(true).map_err(|error| system("FD_CLOEXEC", error))?;
        plain.set_nonblocking(true).map_err(|error| system("O_NONBLOCK", error))?;
        // A smaller buffer than asked for is still a working one, and an older kernel does not count what it drops.
        let _ = set_option(socket.as_fd(), libc::SOL_SOCKET, libc::SO_RCVBUF, &RECEIVE_BUFFER_LEN);
        let _ = set_option(socket.as_fd(), libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &1_i32);
        let time_stamps = enable_time_stamps(socket.as_fd());
        let opened =
            Self { socket, name: owned(), index, time_stamps, dropped: 0, dropped_told: 0, unreadable: 0 };
        Ok(opened)
    }

    /// Name of the interface.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of the interface, to which the socket is bound: it does not follow the name.
    #[must_use]
    pub const fn index(&self) -> i32 {
        self.index
    }

    /// Whether received frames carry the kernel's time stamp.
    #[must_use]
    pub const fn has_time_stamps(&self) -> bool {
        self.time_stamps
    }

    /// State of the interface now. [`LinkState::NoCarrier`] is a controller that is off the bus.
    #[must_use]
    pub fn link_state(&self) -> LinkState {
        link::state(self.socket.as_fd(), self.index, &self.name)
    }

    /// Hands a frame to the transmit queue at once or not at all.
    ///
    /// # Errors
    /// [`LinkError`]: the frame will not be sent. [`LinkError::Full`] is no fault of the bus: the queue is short
    /// (`txqueuelen`) and empties at the pace of the bus. [`LinkError::Length`] is an FD frame on a classic interface.
    pub fn send(&self, frame: &Frame) -> Result<(), LinkError> {
        let id = match frame.id() {
            Id::Standard(id) => socketcan::StandardId::new(id).map(socketcan::Id::Standard),
            Id::Extended(id) => socketcan::ExtendedId::new(id).map(socketcan::Id::Extended),
        };
        let id = id.ok_or(LinkError::Length)?;
        let sent = if frame.is_fd() {
            let flags = if frame.is_fast() { FdFlags::BRS } else { FdFlags::empty() };
            CanFdFrame::with_flags(id, frame.data(), flags).map(|frame| self.socket.write_frame(&frame))
        } else if frame.is_remote() {
            CanRemoteFrame::new_remote(id, frame.len()).map(|frame| self.socket.write_frame(&frame))
        } else {
            CanDataFrame::new(id, frame.data()).map(|frame| self.socket.write_frame(&frame))
        };
        sent.ok_or(LinkError::Length)?.map_err(|error| LinkError::from_io(&error))
    }

    /// Receives one frame without waiting; `Ok(None)` when there is none.
    ///
    /// # Errors
    /// [`LinkError`]: once when the interface has gone down; receiving may be tried again.
    pub fn recv(&mut self) -> Result<Option<Received>, LinkError> {
        let mut buffer = [0; FD_LEN];
        for _ in 0..SKIPPED_MAX {
            let message =
                receive(self.socket.as_fd(), &mut buffer).map_err(|error| LinkError::from_io(&error))?;
            let Some(message) = message else { return Ok(None) };
            self.dropped = message.dropped.unwrap_or(self.dropped);
            let content = buffer.get(..message.len).filter(|_| !message.truncated).and_then(content);
            match content {
                Some(content) => return Ok(Some(Received { at: message.at, own: message.own, content })),
                None => self.unreadable = self.unreadable.saturating_add(1),
            }
        }
        Ok(None)
    }

    /// Frames since the last call that were lost because they were not fetched in time, or could not be read.
    pub fn take_dropped(&mut self) -> u32 {
        let new = self.dropped.wrapping_sub(self.dropped_told).saturating_add(self.unreadable);
        (self.dropped_told, self.unreadable) = (self.dropped, 0);
        new
    }

    /// Waits until a frame can be received or `timeout` is over; `true` when one can.
    ///
    /// For threads that are not the cycle's.
    ///
    /// # Errors
    /// What `poll` refuses.
    pub fn wait(&self, timeout: Duration) -> io::Result<bool> {
        wait_for_input(&[self.socket.as_fd()], timeout)
    }
}

impl AsFd for CanSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Reads the kernel's `struct can_frame` or `struct canfd_frame`: identifier word, length, flags, three bytes of padding, data.
fn content(bytes: &[u8]) -> Option<Content> {
    let (head, data) = bytes.split_first_chunk::<8>()?;
    let word = u32::from_ne_bytes([head[0], head[1], head[2], head[3]]);
    let len = usize::from(head[4]);
    if word & ERROR_FLAG != 0 {
        return Some(Content::Error(ErrorFrame::read(word, data.first_chunk()?)));
    }
    let id = if word & EXTENDED_FLAG != 0 {
        Id::Extended(word & Id::EXTENDED_MAX)
    } else {
        Id::Standard(u16::try_from(word & u32::from(Id::STANDARD_MAX)).ok()?)
    };
    let frame = match bytes.len() {
        CLASSIC_LEN if word & REMOTE_FLAG != 0 => Frame::remote(id, len),
        CLASSIC_LEN => Frame::new(id, data.get(..len)?),
        FD_LEN => Frame::fd(id, data.get(..len)?, head[5] & BIT_RATE_SWITCH != 0),
        _ => return None,
    };
    frame.ok().map(Content::Frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kernel(word: u32, len: u8, flags: u8, data: &[u8], size: usize) -> Vec<u8> {
        let mut bytes = word.to_ne_bytes().to_vec();
        bytes.extend([len, flags, 0, 0]);
        bytes.extend(data);
        bytes.resize(size, 0);
        bytes
    }

    fn read(word: u32, len: u8, flags: u8, data: &[u8], size: usize) -> Option<String> {
        content(&kernel(word, len, flags, data, size)).map(|content| match content {
            Content::Frame(frame) => frame.to_string(),
            Content::Error(error) => error.to_string(),
        })
    }

    /// Layouts of linux/can.h.
    #[test]
    fn the_kernel_s_structures_are_read() {
        let text = |text: &str| Some(text.to_owned());
        assert_eq!(read(0x181, 2, 0, &[0x27, 6], CLASSIC_LEN), text("181#27 06"));
        assert_eq!(read(0x8000_1234, 0, 0, &[], CLASSIC_LEN), text("00001234#"));
        assert_eq!(read(0x4000_0701, 1, 0, &[], CLASSIC_LEN), text("701#R1"));
        assert_eq!(read(0x181, 12, 1, &[5; 12], FD_LEN), text("181##105 05 05 05 05 05 05 05 05 05 05 05"));
        assert_eq!(read(0x181, 1, 0, &[5], FD_LEN), text("181##005"));
        // Lengths that no frame has.
        assert_eq!(read(0x181, 9, 0, &[0; 8], CLASSIC_LEN), None);
        assert_eq!(read(0x181, 9, 0, &[0; 64], FD_LEN), None);
        assert_eq!(read(0x181, 65, 0, &[0; 64], FD_LEN), None);
        assert_eq!(read(0x181, 0, 0, &[], 20), None);
        assert_eq!(content(&[0; 7]), None);
    }

    #[test]
    fn filters_keep_the_two_kinds_of_identifier_apart() {
        let of = |filter: Filter| {
            let kernel: libc::can_filter = *filter.to_kernel().as_ref();
            (kernel.can_id, kernel.can_mask)
        };
        assert_eq!(of(Filter::exactly(Id::Standard(0x581))), (0x581, 0x8000_07FF));
        assert_eq!(of(Filter::exactly(Id::Extended(5))), (0x8000_0005, 0x9FFF_FFFF));
        assert_eq!(of(Filter { id: Id::Standard(0x180), mask: 0x780 }), (0x180, 0x8000_0780));
    }

    #[test]
    fn what_cannot_be_opened_says_why() {
        let text = |name: &str| CanSocket::open(name, &Options::default()).unwrap_err().to_string();
        assert_eq!(text("axb-none"), "there is no network interface `axb-none`");
        assert!(text("").contains("cannot be the name of a network interface"));
        assert!(text("a-name-longer-than-fifteen").contains("cannot be the name of a network interface"));
        super::super::namespace::in_namespace("what_cannot_be_opened", || {
            let text = |name: &str| CanSocket::open(name, &Options::default()).unwrap_err().to_string();
            assert_eq!(text("lo"), "the CAN interface `lo` is down (`ip link set lo up`)");
            super::super::namespace::ip("link set lo up");
            assert_eq!(text("lo"), "the network interface `lo` is not CAN (hardware type 772)");
        });
    }

    proptest::proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..80)) {
            let _ = content(&bytes);
        }
    }
}
