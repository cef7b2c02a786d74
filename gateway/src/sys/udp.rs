//! The UDP socket of class-1 I/O: never waits, marks what it sends as urgent, and knows when each datagram
//! came.
//!
//! EtherNet/IP's implicit messages go from and to port 2222 at both ends. Two ends on one host work when each
//! binds an address of its own, which is why the address is always given and `SO_REUSEADDR` is set.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use arrayvec::ArrayVec;
use socket2::{Domain, Protocol, SockAddr, Socket, Type};
use thiserror::Error;

use super::clock::KernelTime;
use super::gate::Gate;
use super::receive::{enable_time_stamps, enable_type_of_service, receive, wait_for_input};

/// UDP port of EtherNet/IP implicit messages.
pub const PORT_IO: u16 = 2222;

/// Differentiated services code point of CIP Motion data: the QoS object's default for urgent priority.
pub const DSCP_URGENT: u8 = 55;

/// Room for received datagrams in the kernel: more than a second of 1 ms updates of two connections.
const RECEIVE_BUFFER_LEN: usize = 1 << 20;

/// Why the socket could not be opened.
#[derive(Debug, Error)]
pub enum BindError {
    /// No interface of this host has the address.
    #[error("no network interface of this host has the address {}", address.ip())]
    NoSuchAddress {
        /// The address asked for.
        address: SocketAddrV4,
    },
    /// Another program has the port.
    #[error("UDP {address} is taken by another program")]
    InUse {
        /// The address asked for.
        address: SocketAddrV4,
    },
    /// The system refused for another reason.
    #[error("cannot open UDP {address}: {step}: {source}")]
    System {
        /// The address asked for.
        address: SocketAddrV4,
        /// What was being done.
        step: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

/// A received datagram; its bytes are in the caller's buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datagram {
    /// Bytes written to the buffer.
    pub len: usize,
    /// Whether the datagram was longer than the buffer: then it must not be used.
    pub truncated: bool,
    /// Who sent it.
    pub from: SocketAddrV4,
    /// When the kernel took it from the network, where it says so.
    pub at: Option<KernelTime>,
    /// Code point it is marked with, 0..=63.
    pub dscp: u8,
}

/// An open socket.
#[derive(Debug)]
pub struct IoSocket {
    socket: Socket,
    local: SocketAddrV4,
    time_stamps: bool,
    dscp: Arc<AtomicU8>,
}

/// Changes what a socket marks its datagrams with, from another thread and without its knowing: the cycle thread spends no
/// system call on it.
#[derive(Debug)]
pub struct Marker {
    socket: Socket,
    dscp: Arc<AtomicU8>,
}

impl Marker {
    /// Marks everything sent from now on with this code point, 0 to 63.
    ///
    /// # Errors
    /// What the system says.
    pub fn mark(&self, dscp: u8) -> io::Result<()> {
        set_dscp(&self.socket, dscp)?;
        self.dscp.store(dscp, Ordering::Relaxed);
        Ok(())
    }
}

/// The code point is the upper six bits of the octet once called type of service.
fn set_dscp(socket: &Socket, dscp: u8) -> io::Result<()> {
    socket.set_tos_v4(u32::from(dscp & 0x3F) << 2)
}

impl IoSocket {
    /// Binds `address` (port 0 takes any free one) and marks what is sent with `dscp`, 0 to 63.
    ///
    /// # Errors
    /// [`BindError`], one kind for each thing a person can put right.
    pub fn bind(address: SocketAddrV4, dscp: u8) -> Result<Self, BindError> {
        Self::open(address, dscp, |_| Ok(())).map(|(socket, ())| socket)
    }

    /// As [`IoSocket::bind`], with a [`Gate`] that is closed from the start.
    ///
    /// # Errors
    /// As [`IoSocket::bind`].
    pub fn bind_closed(address: SocketAddrV4, dscp: u8) -> Result<(Self, Gate), BindError> {
        Self::open(address, dscp, |socket| {
            let gate = Gate::new(socket.try_clone()?);
            gate.set(None)?;
            Ok(gate)
        })
    }

    /// Opens a socket; `prepare` sees it before anything can come in.
    fn open<T>(
        address: SocketAddrV4,
        dscp: u8,
        prepare: impl FnOnce(&Socket) -> io::Result<T>,
    ) -> Result<(Self, T), BindError> {
        let system =
            |step: &'static str| move |source: io::Error| BindError::System { address, step, source };
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP)).map_err(system("socket"))?;
        socket.set_nonblocking(true).map_err(system("O_NONBLOCK"))?;
        socket.set_reuse_address(true).map_err(system("SO_REUSEADDR"))?;
        set_dscp(&socket, dscp).map_err(system("IP_TOS"))?;
        enable_type_of_service(socket.as_fd()).map_err(system("IP_RECVTOS"))?;
        // A smaller buffer than asked for is still a working one.
        let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER_LEN);
        let time_stamps = enable_time_stamps(socket.as_fd());
        let prepared = prepare(&socket).map_err(system("SO_ATTACH_FILTER"))?;
        socket.bind(&SockAddr::from(address)).map_err(|source| match source.kind() {
            io::ErrorKind::AddrNotAvailable => BindError::NoSuchAddress { address },
            io::ErrorKind::AddrInUse => BindError::InUse { address },
            _ => BindError::System { address, step: "bind", source },
        })?;
        let local = socket
            .local_addr()
            .map_err(system("getsockname"))?
            .as_socket_ipv4()
            .unwrap_or(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0));
        Ok((Self { socket, local, time_stamps, dscp: Arc::new(AtomicU8::new(dscp)) }, prepared))
    }

    /// Has multicasts leave by the interface of its address, and reach the network of that interface and no other: their time to
    /// live is 1.
    ///
    /// # Errors
    /// What the system says.
    pub fn prepare_multicast(&self) -> Result<(), BindError> {
        let address = self.local;
        let system = |step: &'static str| move |source| BindError::System { address, step, source };
        self.socket.set_multicast_if_v4(address.ip()).map_err(system("IP_MULTICAST_IF"))?;
        self.socket.set_multicast_ttl_v4(1).map_err(system("IP_MULTICAST_TTL"))
    }

    /// What changes the marking of this socket, also from another thread.
    ///
    /// # Errors
    /// What the system says.
    pub fn marker(&self) -> io::Result<Marker> {
        // The options belong to the socket, not to the descriptor.
        Ok(Marker { socket: self.socket.try_clone()?, dscp: Arc::clone(&self.dscp) })
    }

    /// The code point that datagrams are marked with.
    #[must_use]
    pub fn dscp(&self) -> u8 {
        self.dscp.load(Ordering::Relaxed)
    }

    /// The address it is bound to.
    #[must_use]
    pub const fn local_address(&self) -> SocketAddrV4 {
        self.local
    }

    /// Whether received datagrams carry the kernel's time stamp.
    #[must_use]
    pub const fn has_time_stamps(&self) -> bool {
        self.time_stamps
    }

    /// Sends one datagram at once or not at all.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::WouldBlock`] when the transmit queue is full.
    pub fn send_to(&self, data: &[u8], to: SocketAddrV4) -> io::Result<()> {
        let sent = self.socket.send_to(data, &SockAddr::from(SocketAddr::V4(to)))?;
        if sent == data.len() { Ok(()) } else { Err(io::ErrorKind::WriteZero.into()) }
    }

    /// Receives one datagram into `buffer` without waiting; `Ok(None)` when there is none.
    ///
    /// # Errors
    /// What the system says.
    pub fn recv(&self, buffer: &mut [u8]) -> io::Result<Option<Datagram>> {
        let Some(message) = receive(self.socket.as_fd(), buffer)? else { return Ok(None) };
        // `struct sockaddr_in`: family, port and address, the latter two big endian.
        let [_, _, p, q, a, b, c, d, ..] = message.from;
        let from = SocketAddrV4::new(Ipv4Addr::new(a, b, c, d), u16::from_be_bytes([p, q]));
        let dscp = message.tos.unwrap_or(0) >> 2;
        Ok(Some(Datagram { len: message.len, truncated: message.truncated, from, at: message.at, dscp }))
    }
}

/// Waits until a datagram has come, or something on `stream`, or `timeout` is over; `true` when something can be read.
///
/// For threads that are not the cycle's.
///
/// # Errors
/// What `ppoll` refuses.
pub fn wait(socket: &IoSocket, stream: Option<&TcpStream>, timeout: Duration) -> io::Result<bool> {
    let mut descriptors = ArrayVec::<_, 2>::from_iter([socket.as_fd()]);
    descriptors.extend(stream.map(AsFd::as_fd));
    wait_for_input(&descriptors, timeout)
}

impl AsFd for IoSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::time::Instant;

    use super::*;
    use crate::sys::clock::realtime_now;

    fn any(ip: [u8; 4]) -> IoSocket {
        IoSocket::bind(SocketAddrV4::new(Ipv4Addr::from(ip), 0), DSCP_URGENT).unwrap()
    }

    fn wait(socket: &IoSocket, buffer: &mut [u8]) -> Datagram {
        let deadline = Instant::now() + Duration::from_secs(5);
        loop {
            if let Some(datagram) = socket.recv(buffer).unwrap() {
                return datagram;
            }
            assert!(Instant::now() < deadline, "nothing came");
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    #[test]
    fn a_datagram_crosses_with_sender_and_time_stamp() {
        let (a, b) = (any([127, 0, 0, 1]), any([127, 0, 0, 2]));
        assert_eq!(*b.local_address().ip(), Ipv4Addr::new(127, 0, 0, 2));
        let mut buffer = [0xA5; 64];
        assert_eq!(b.recv(&mut buffer).unwrap(), None);

        let before = realtime_now();
        a.send_to(&[1, 2, 3], b.local_address()).unwrap();
        let datagram = wait(&b, &mut buffer);
        assert_eq!((datagram.len, datagram.truncated, datagram.from), (3, false, a.local_address()));
        assert_eq!(buffer[..4], [1, 2, 3, 0xA5]);
        if b.has_time_stamps() {
            let at = datagram.at.unwrap();
            assert!(before <= at && at <= realtime_now(), "{before:?} {at:?}");
        }
    }

    #[test]
    fn waiting_ends_with_what_comes_first() {
        let (a, b) = (any([127, 0, 0, 1]), any([127, 0, 0, 1]));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut peer, _) = listener.accept().unwrap();
        let start = Instant::now();
        assert!(!super::wait(&b, Some(&stream), Duration::from_micros(1_500)).unwrap());
        assert!(start.elapsed() >= Duration::from_micros(1_500), "less than a millisecond counts");
        let long = Duration::from_secs(30);
        a.send_to(&[1], b.local_address()).unwrap();
        assert!(super::wait(&b, None, long).unwrap());
        assert_eq!(wait(&b, &mut [0; 8]).len, 1);
        std::io::Write::write_all(&mut peer, &[1]).unwrap();
        assert!(super::wait(&b, Some(&stream), long).unwrap());
        assert!(start.elapsed() < long);
    }

    #[test]
    fn a_datagram_longer_than_the_buffer_is_marked() {
        let (a, b) = (any([127, 0, 0, 1]), any([127, 0, 0, 1]));
        a.send_to(&[7; 100], b.local_address()).unwrap();
        let datagram = wait(&b, &mut [0; 60]);
        assert_eq!((datagram.len, datagram.truncated), (60, true));
    }

    #[test]
    fn datagrams_arrive_with_the_code_point_they_were_marked_with() {
        let (a, b) = (any([127, 0, 0, 1]), any([127, 0, 0, 1]));
        let marker = a.marker().unwrap();
        for dscp in [55, 47, 0, 63] {
            marker.mark(dscp).unwrap();
            assert_eq!(a.dscp(), dscp);
            a.send_to(&[1], b.local_address()).unwrap();
            assert_eq!(wait(&b, &mut [0; 8]).dscp, dscp);
        }
        let plain = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
        plain.send_to(&[1], b.local_address()).unwrap();
        assert_eq!(wait(&b, &mut [0; 8]).dscp, 0, "what is not marked");
    }

    #[test]
    fn multicasts_leave_by_the_interface_of_the_address() {
        let sender = any([127, 0, 0, 9]);
        sender.prepare_multicast().unwrap();
        let group = Ipv4Addr::new(239, 192, 77, 1);
        let receiver = std::net::UdpSocket::bind((group, 0)).unwrap();
        receiver.join_multicast_v4(&group, &Ipv4Addr::new(127, 0, 0, 1)).unwrap();
        receiver.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let port = receiver.local_addr().unwrap().port();
        sender.send_to(&[5, 6], SocketAddrV4::new(group, port)).unwrap();
        let mut buffer = [0; 8];
        let (len, from) = receiver.recv_from(&mut buffer).unwrap();
        assert_eq!((&buffer[..len], from), (&[5, 6][..], SocketAddr::V4(sender.local_address())));
        assert_eq!(sender.socket.multicast_ttl_v4().unwrap(), 1);
    }

    #[test]
    fn one_port_may_be_bound_on_two_addresses() {
        let a = any([127, 0, 0, 1]);
        let port = a.local_address().port();
        let b = IoSocket::bind(SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 2), port), 0).unwrap();
        a.send_to(&[9], b.local_address()).unwrap();
        assert_eq!(wait(&b, &mut [0; 8]).from, a.local_address());
    }

    #[test]
    fn what_cannot_be_bound_says_why() {
        let foreign = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 0);
        let error = IoSocket::bind(foreign, 0).unwrap_err();
        assert_eq!(error.to_string(), "no network interface of this host has the address 192.0.2.1");
    }
}
