//! The sockets of explicit messaging: TCP and UDP at one address and port, and UDP broadcasts to that port.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4};

use socket2::{Domain, Protocol, SockAddr, Socket, TcpKeepalive, Type};
use tokio::net::{TcpListener, TcpStream, UdpSocket};

use super::error::ServeError;
use super::server::STALL_LIMIT;

/// Streams that may wait to be accepted.
const BACKLOG: i32 = 64;

/// What the kernel may hold for a peer that does not read, in bytes (it doubles the number for its own
/// needs).
const SEND_BUFFER_LEN: usize = 32 * 1024;

/// Port numbers tried when any free one will do: the one TCP gets may be taken for UDP.
const FREE_PORT_TRIES: usize = 16;

/// The open sockets. Nothing is lost between their opening and their use: the kernel keeps it.
#[derive(Debug)]
pub(super) struct Sockets {
    tcp: Socket,
    udp: Socket,
    /// Broadcasts do not come to a socket that is bound to one address.
    broadcast: Vec<(Socket, SocketAddrV4)>,
    pub address: SocketAddrV4,
}

impl Sockets {
    /// Opens all of them; port 0 takes any free one. `dscp` marks what is sent.
    pub fn open(address: SocketAddrV4, netmask: Ipv4Addr, dscp: u8) -> Result<Self, ServeError> {
        let mut tries = if address.port() == 0 { FREE_PORT_TRIES } else { 1 };
        let (tcp, udp, address) = loop {
            tries -= 1;
            let (tcp, bound) = open(Transport::Tcp, address, dscp)?;
            match open(Transport::Udp, bound, dscp) {
                Ok((udp, bound)) => break (tcp, udp, bound),
                Err(ServeError::InUse { .. }) if tries > 0 => {}
                Err(error) => return Err(error),
            }
        };
        let broadcast = broadcast_addresses(*address.ip(), netmask)
            .filter_map(|ip| open_broadcast(SocketAddrV4::new(ip, address.port())))
            .collect();
        Ok(Self { tcp, udp, broadcast, address })
    }

    /// Hands all of them to the runtime of the caller: the listener, and the sockets for datagrams with their
    /// addresses, the one that is bound to the device's own address first.
    pub fn register(self) -> Result<(TcpListener, Vec<(UdpSocket, SocketAddrV4)>), ServeError> {
        let Self { tcp, udp, broadcast, address } = self;
        let system = |transport: Transport| {
            move |source| ServeError::System {
                address,
                transport: transport.name(),
                step: "register",
                source,
            }
        };
        let listener = TcpListener::from_std(tcp.into()).map_err(system(Transport::Tcp))?;
        let datagrams = std::iter::once((udp, address)).chain(broadcast).map(|(socket, to)| {
            UdpSocket::from_std(socket.into()).map(|socket| (socket, to)).map_err(system(Transport::Udp))
        });
        Ok((listener, datagrams.collect::<Result<_, _>>()?))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transport {
    Tcp,
    Udp,
}

impl Transport {
    const fn name(self) -> &'static str {
        match self {
            Self::Tcp => "TCP",
            Self::Udp => "UDP",
        }
    }
}

fn open(transport: Transport, address: SocketAddrV4, dscp: u8) -> Result<(Socket, SocketAddrV4), ServeError> {
    let name = transport.name();
    let system = |step: &'static str| {
        move |source: io::Error| match source.kind() {
            io::ErrorKind::AddrNotAvailable => ServeError::NoSuchAddress { address },
            io::ErrorKind::AddrInUse => ServeError::InUse { address, transport: name },
            _ => ServeError::System { address, transport: name, step, source },
        }
    };
    let (kind, protocol) = match transport {
        Transport::Tcp => (Type::STREAM, Protocol::TCP),
        Transport::Udp => (Type::DGRAM, Protocol::UDP),
    };
    let socket = Socket::new(Domain::IPV4, kind, Some(protocol)).map_err(system("socket"))?;
    socket.set_nonblocking(true).map_err(system("O_NONBLOCK"))?;
    // The code point is the upper six bits of the octet once called type of service. Accepted streams inherit
    // it, and the buffer size.
    socket.set_tos_v4(u32::from(dscp & 0x3F) << 2).map_err(system("IP_TOS"))?;
    if transport == Transport::Tcp {
        // Streams of the last run that are still winding down must not keep this one from starting. Two
        // listeners on one port are refused all the same.
        socket.set_reuse_address(true).map_err(system("SO_REUSEADDR"))?;
        socket.set_send_buffer_size(SEND_BUFFER_LEN).map_err(system("SO_SNDBUF"))?;
    }
    socket.bind(&SockAddr::from(address)).map_err(system("bind"))?;
    if transport == Transport::Tcp {
        socket.listen(BACKLOG).map_err(system("listen"))?;
    }
    let bound = socket.local_addr().map_err(system("getsockname"))?;
    Ok((socket, bound.as_socket_ipv4().unwrap_or(address)))
}

/// Where broadcasts for a device with this address go: everywhere, and to its subnet.
fn broadcast_addresses(address: Ipv4Addr, netmask: Ipv4Addr) -> impl Iterator<Item = Ipv4Addr> {
    // A socket bound to no address gets broadcasts anyhow, and there are none on the loopback interface.
    let wanted = !address.is_loopback() && !address.is_unspecified();
    let subnet = Ipv4Addr::from_bits(address.to_bits() | !netmask.to_bits());
    let subnet = (subnet != address && subnet != Ipv4Addr::BROADCAST).then_some(subnet);
    let all = std::iter::once(Ipv4Addr::BROADCAST).chain(subnet);
    all.filter(move |_| wanted)
}

/// A socket for broadcasts. Without it the device works, but tools do not find it by themselves.
fn open_broadcast(address: SocketAddrV4) -> Option<(Socket, SocketAddrV4)> {
    let opened = || -> io::Result<Socket> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        socket.set_nonblocking(true)?;
        // Every device of this host gets the broadcast.
        socket.set_reuse_address(true)?;
        socket.bind(&SockAddr::from(address))?;
        Ok(socket)
    };
    match opened() {
        Ok(socket) => Some((socket, address)),
        Err(error) => {
            tracing::warn!(%address, %error, "broadcast ListIdentity requests will not be heard");
            None
        }
    }
}

/// Sets an accepted stream up: short packets go at once, and a peer that is no more is found out.
pub(super) fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    socket2::SockRef::from(stream).set_tcp_keepalive(&TcpKeepalive::new().with_time(STALL_LIMIT))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broadcasts_of_everywhere_and_the_subnet() {
        let of = |address: [u8; 4], mask: [u8; 4]| {
            broadcast_addresses(address.into(), mask.into()).map(|ip| ip.octets()).collect::<Vec<_>>()
        };
        assert_eq!(of([10, 1, 2, 3], [255, 255, 0, 0]), [[255; 4], [10, 1, 255, 255]]);
        assert_eq!(of([10, 1, 2, 3], [255; 4]), [[255; 4]]);
        assert_eq!(of([10, 1, 2, 3], [0; 4]), [[255; 4]]);
        assert_eq!(of([127, 0, 0, 2], [255, 0, 0, 0]), [[0; 4]; 0]);
        assert_eq!(of([0; 4], [0; 4]), [[0; 4]; 0]);
    }
}
