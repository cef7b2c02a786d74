//! The engine's ports on real sockets, with the recording beside them.

use std::net::SocketAddrV4;

use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::engine::port::{NorthPort, SouthPort};
use crate::sys::clock;
use crate::sys::packet_socket::PacketSocket;
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

/// The network interface of a SERCOS III line.
#[derive(Debug)]
pub struct PacketPort {
    socket: PacketSocket,
    tap: Option<Tap>,
}

impl PacketPort {
    /// A port on an open socket.
    #[must_use]
    pub fn new(socket: PacketSocket, tap: Option<Tap>) -> Self {
        Self { socket, tap }
    }
}

impl SouthPort for PacketPort {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        // A link that is down gives nothing, which the master sees by itself.
        let received = self.socket.recv(buffer).ok().flatten()?;
        let len = received.len.min(buffer.len());
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(received.at.unwrap_or_else(clock::realtime_now), Side::South, &buffer[..len]);
        }
        Some((Port::One, len))
    }

    fn send(&mut self, _now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        if port != Port::One {
            return false;
        }
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South, frame);
        }
        self.socket.send(frame).is_ok()
    }
}
