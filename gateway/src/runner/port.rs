//! The engine's ports on real sockets, with the recording beside them.

use std::net::SocketAddrV4;

use arrayvec::ArrayVec;
use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::master::event::Port;

use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::engine::port::{CanInput, CanPort, CanSent, EthernetPort, NorthPort, SouthPort};
use crate::sys::can_error::BusEvent;
use crate::sys::can_socket::{self, CanSocket, Content, Options};
use crate::sys::clock;
use crate::sys::link::{LinkError, LinkState};
use crate::sys::packet_socket::{ETHER_TYPE_SERCOS, OpenError, PacketSocket};
use crate::sys::udp::IoSocket;

/// The port of a bus, whatever is behind it.
pub enum OpenPort {
    /// Of SERCOS III.
    Ethernet(Box<dyn EthernetPort + Send>),
    /// Of CAN.
    Can(Box<dyn CanPort + Send>),
}

impl OpenPort {
    /// As the engine takes it.
    pub fn port(&mut self) -> SouthPort<'_> {
        match self {
            Self::Ethernet(port) => SouthPort::Ethernet(&mut **port),
            Self::Can(port) => SouthPort::Can(&mut **port),
        }
    }
}

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

impl EthernetPort for PacketPort {
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

/// How often a CAN interface that is off the bus is looked at, whether it is back.
const CAN_LOOK_INTERVAL: DurationNs = DurationNs::from_millis(100);

/// A CAN interface.
#[derive(Debug)]
pub struct CanSocketPort {
    socket: CanSocket,
    /// When to look whether it is back, while it is off the bus.
    off: Option<MonotonicTime>,
    /// The recording, and the number of the bus in it.
    tap: Option<(Tap, u8)>,
}

impl CanSocketPort {
    /// Opens an interface.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(name: &str) -> Result<Self, can_socket::OpenError> {
        let socket = CanSocket::open(name, &Options::default())?;
        Ok(Self { socket, off: None, tap: None })
    }

    /// The same, with a recording of what goes to and fro.
    #[must_use]
    pub fn recorded(self, tap: Option<(Tap, u8)>) -> Self {
        Self { tap, ..self }
    }

    /// It is off the bus; `None` when that was told already.
    fn go_off(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let told = self.off.replace(now + CAN_LOOK_INTERVAL).is_some();
        (!told).then_some(CanInput::BusOff)
    }

    /// Whether an interface that was off is back.
    fn is_back(&mut self, now: MonotonicTime) -> bool {
        if self.off.is_none_or(|at| now < at) {
            return false;
        }
        self.off = Some(now + CAN_LOOK_INTERVAL);
        let back = self.socket.link_state() == LinkState::Up;
        if back {
            self.off = None;
        }
        back
    }
}

impl CanPort for CanSocketPort {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        if self.is_back(now) {
            return Some(CanInput::BusOn);
        }
        loop {
            let received = match self.socket.recv() {
                Ok(received) => received?,
                Err(_) => return self.go_off(now),
            };
            match received.content {
                Content::Frame(frame) => {
                    if let Some((tap, bus)) = self.tap.as_mut() {
                        let at = received.at.unwrap_or_else(clock::realtime_now);
                        tap.can_frame(at, *bus, &frame);
                    }
                    return Some(CanInput::Frame(frame));
                }
                Content::Error(error) => {
                    // What is not about being on the bus or off it costs nothing but time.
                    let mut told = None;
                    for event in error.events() {
                        match event {
                            BusEvent::Off => told = self.go_off(now).or(told),
                            BusEvent::Restarted if self.off.take().is_some() => told = Some(CanInput::BusOn),
                            _ => {}
                        }
                    }
                    if told.is_some() {
                        return told;
                    }
                }
            }
        }
    }

    fn send(&mut self, _now: MonotonicTime, frame: &Frame) -> CanSent {
        match self.socket.send(frame) {
            Ok(()) => {
                if let Some((tap, bus)) = self.tap.as_mut() {
                    tap.can_frame(clock::realtime_now(), *bus, frame);
                }
                CanSent::Sent
            }
            Err(LinkError::Full) => CanSent::Full,
            Err(_) => CanSent::Failed,
        }
    }
}
