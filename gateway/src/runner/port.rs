//! The engine's ports on real sockets, with the recording beside them.

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use arrayvec::ArrayVec;
use profile_generic::can::Frame;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::engine::port::{CanInput, CanPort, CanSent, Datagram, EthernetPort, NorthPort, SouthPort};
use crate::sys::can_error::BusEvent;
use crate::sys::can_socket::{self, CanSocket, Content, Options};
use crate::sys::clock;
use crate::sys::interface_lock::{InterfaceLock, LockError};
use crate::sys::link::LinkError;
use crate::sys::packet_socket::{ETHER_TYPE_SERCOS, OpenError, PacketSocket};
use crate::sys::udp::IoSocket;

/// The port of a bus, whatever is behind it.
pub enum OpenPort {
    /// Of SERCOS III.
    Ethernet(Box<dyn EthernetPort + Send>),
    /// The controller of a CANopen or DeviceNet bus.
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
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram> {
        // An error of one datagram, such as an unreachable peer's, says nothing of the next.
        let datagram = self.socket.recv(buffer).ok().flatten()?;
        if datagram.truncated {
            return Some(Datagram { len: 0, from: datagram.from, arrived_at: None });
        }
        if let Some(tap) = self.tap.as_mut() {
            let at = datagram.at.unwrap_or_else(clock::realtime_now);
            let payload = &buffer[..datagram.len];
            tap.datagram(at, datagram.from, self.socket.local_address(), datagram.dscp << 2, payload);
        }
        let arrived_at = datagram.at.and_then(clock::monotonic_of);
        Some(Datagram { len: datagram.len, from: datagram.from, arrived_at })
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
    /// Nobody else on this host is the master there.
    _locks: ArrayVec<InterfaceLock, 2>,
}

/// Why a master cannot have its interfaces.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// One of them cannot be opened.
    #[error("{0}")]
    Open(#[from] OpenError),
    /// One of them has a master.
    #[error("{0}")]
    Lock(#[from] LockError),
}

impl PacketPort {
    /// Opens the interfaces, for the one master on this host that may use them.
    ///
    /// # Errors
    /// One of them cannot be opened, or has a master already.
    pub fn open(name: &str, ring: Option<&str>) -> Result<Self, PortError> {
        let (mut sockets, mut locks) = (ArrayVec::new(), ArrayVec::new());
        for name in std::iter::once(name).chain(ring) {
            sockets.push(PacketSocket::open(name, ETHER_TYPE_SERCOS)?);
            locks.push(InterfaceLock::take(name)?);
        }
        Ok(Self { sockets, first: 0, tap: None, _locks: locks })
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

    fn send(&mut self, at: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        let holds = self.holds_frames();
        let socket =
            PORTS.iter().position(|known| *known == port).and_then(|number| self.sockets.get(number));
        let Some(socket) = socket else { return false };
        if let Some(tap) = self.tap.as_mut() {
            let at = if holds { clock::realtime_of(at) } else { clock::realtime_now() };
            tap.frame(at, Side::South(port), frame);
        }
        if holds { socket.send_at(frame, at).is_ok() } else { socket.send(frame).is_ok() }
    }

    fn holds_frames(&self) -> bool {
        self.sockets.iter().all(PacketSocket::launches)
    }
}

/// A question of the cycle thread about a CAN interface, and the answer of who watches it: whether it is on the bus. Interface
/// flags tell it up to a second late, and what the driver knows is to be had over netlink only, which waits.
#[derive(Debug, Default)]
pub struct BackOnBus {
    asked: AtomicU32,
    answered: AtomicU32,
}

impl BackOnBus {
    /// From now on the answer is no.
    pub(super) fn ask(&self) {
        self.asked.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether the last question was answered.
    pub(super) fn is_answered(&self) -> bool {
        self.asked.load(Ordering::Relaxed) == self.answered.load(Ordering::Acquire)
    }

    /// The question, to be fetched before the interface is looked at.
    pub(super) fn question(&self) -> u32 {
        self.asked.load(Ordering::Relaxed)
    }

    /// The interface is on the bus.
    pub(super) fn answer(&self, question: u32) {
        self.answered.store(question, Ordering::Release);
    }
}

/// A CAN interface.
#[derive(Debug)]
pub struct CanSocketPort {
    socket: CanSocket,
    /// It is off the bus.
    off: bool,
    back: Arc<BackOnBus>,
    /// The recording, and the number of the bus in it.
    tap: Option<(Tap, u8)>,
    /// Nobody else on this host is the master there.
    _lock: InterfaceLock,
}

impl CanSocketPort {
    /// Opens an interface, for the one master on this host that may use it.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(name: &str, lock: InterfaceLock) -> Result<Self, can_socket::OpenError> {
        let socket = CanSocket::open(name, &Options { own: true, ..Options::default() })?;
        Ok(Self { socket, off: false, back: Arc::default(), tap: None, _lock: lock })
    }

    /// Where the thread that watches the interface reports that it is back on the bus.
    #[must_use]
    pub fn back(&self) -> Arc<BackOnBus> {
        Arc::clone(&self.back)
    }

    /// Number of the interface that it is open on.
    #[must_use]
    pub const fn index(&self) -> i32 {
        self.socket.index()
    }

    /// The same, with a recording of what goes to and fro.
    #[must_use]
    pub fn recorded(self, tap: Option<(Tap, u8)>) -> Self {
        Self { tap, ..self }
    }

    /// It is off the bus; `None` when that was told already.
    fn go_off(&mut self) -> Option<CanInput> {
        self.back.ask();
        let told = std::mem::replace(&mut self.off, true);
        (!told).then_some(CanInput::BusOff)
    }
}

impl CanPort for CanSocketPort {
    fn receive(&mut self, _now: MonotonicTime) -> Option<CanInput> {
        if self.off && self.back.is_answered() {
            self.off = false;
            return Some(CanInput::BusOn);
        }
        loop {
            let received = match self.socket.recv() {
                Ok(received) => received?,
                Err(_) => return self.go_off(),
            };
            match received.content {
                // It is in the recording since it was handed over.
                Content::Frame(_) if received.own => return Some(CanInput::Transmitted),
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
                            BusEvent::Off => told = self.go_off().or(told),
                            BusEvent::Restarted if std::mem::take(&mut self.off) => {
                                told = Some(CanInput::BusOn)
                            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_to_an_earlier_question_brings_no_bus_back() {
        let back = BackOnBus::default();
        back.ask();
        assert!(!back.is_answered());
        // Who looked before the bus went off once more has seen another bus.
        let earlier = back.question();
        back.ask();
        back.answer(earlier);
        assert!(!back.is_answered());
        back.answer(back.question());
        assert!(back.is_answered());
        back.ask();
        assert!(!back.is_answered());
    }
}
