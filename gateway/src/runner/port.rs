//! The engine's ports on real sockets, with the recording beside them.

use std::net::SocketAddrV4;

use arrayvec::ArrayVec;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::engine::port::{NorthPort, SouthPort};
use crate::sys::clock;
use crate::sys::packet_socket::{ETHER_TYPE_SERCOS, OpenError, PacketSocket};
use crate::sys::udp::IoSocket;

/// The UDP socket of one motion device.
#[derive(Debug)]
pub struct UdpPort {
    socket: IoSocket,
    tap: Option<Tap>,
}

impl UdpPort {
    /// A port on a bound socket.
    #[must_use]
    pub fn new(socket: IoSocket, tap: Option<Tap>) -> Self {
        Self { socket, tap }
    }
}

impl NorthPort for UdpPort {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(usize, SocketAddrV4)> {
        loop {
            // An error of one datagram, such as an unreachable peer's, says nothing of the next.
            let datagram = self.socket.recv(buffer).ok().flatten()?;
            if datagram.truncated {
                continue;
            }
            if let Some(tap) = self.tap.as_mut() {
                let at = datagram.at.unwrap_or_else(clock::realtime_now);
                let payload = &buffer[..datagram.len];
                tap.datagram(at, datagram.from, self.socket.local_address(), datagram.dscp << 2, payload);
            }
            return Some((datagram.len, datagram.from));
        }
    }

    fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool {
        if let Some(tap) = self.tap.as_mut() {
            let tos = self.socket.dscp() << 2;
            tap.datagram(clock::realtime_now(), self.socket.local_address(), to, tos, datagram);
        }
        self.socket.send_to(datagram, to).is_ok()
    }
}

/// The network interfaces of a SERCOS III master: its port 1, and its port 2 where it has one.
#[derive(Debug)]
pub struct PacketPort {
    sockets: ArrayVec<PacketSocket, 2>,
    /// Which one is asked first: the other one than last time.
    first: usize,
    tap: Option<Tap>,
}

impl PacketPort {
    /// Opens the interfaces.
    ///
    /// # Errors
    /// One of them cannot be opened.
    pub fn open(name: &str, ring: Option<&str>) -> Result<Self, OpenError> {
        let mut sockets = ArrayVec::new();
        sockets.push(PacketSocket::open(name, ETHER_TYPE_SERCOS)?);
        if let Some(ring) = ring {
            sockets.push(PacketSocket::open(ring, ETHER_TYPE_SERCOS)?);
        }
        Ok(Self { sockets, first: 0, tap: None })
    }

    /// The same, with a recording of what goes to and fro.
    #[must_use]
    pub fn recorded(self, tap: Option<Tap>) -> Self {
        Self { tap, ..self }
    }

    /// Ethernet address of port 1, from which both send.
    #[must_use]
    pub fn mac(&self) -> [u8; 6] {
        self.sockets[0].mac()
    }
}

/// The ports by the number of their socket.
const PORTS: [Port; 2] = [Port::One, Port::Two];

impl SouthPort for PacketPort {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let count = self.sockets.len();
        for step in 0..count {
            let number = (self.first + step) % count;
            // A link that is down gives nothing, which the master sees by itself.
            let Some(received) = self.sockets[number].recv(buffer).ok().flatten() else { continue };
            self.first = (number + 1) % count;
            let len = received.len.min(buffer.len());
            if let Some(tap) = self.tap.as_mut() {
                let at = received.at.unwrap_or_else(clock::realtime_now);
                tap.frame(at, Side::South(PORTS[number]), &buffer[..len]);
            }
            return Some((PORTS[number], len));
        }
        None
    }

    fn send(&mut self, _now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        let socket =
            PORTS.iter().position(|known| *known == port).and_then(|number| self.sockets.get(number));
        let Some(socket) = socket else { return false };
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South(port), frame);
        }
        socket.send(frame).is_ok()
    }
}
