//! The engine's ports as queues. They own fixed storage: what the engine does in a cycle can be weighed
//! without them.

use std::net::{Ipv4Addr, SocketAddrV4};

use axisbridge::capture::Side;
use axisbridge::capture::recorder::Tap;
use axisbridge::engine::port::{CanInput, CanPort, CanSent, Datagram, EthernetPort, FRAME_MAX, NorthPort};
use axisbridge::simulate::can_bus::{CanNode, InProcessCan};
use axisbridge::simulate::can_drive::DriveNode;
use axisbridge::sys::clock::{KernelTime, realtime_now};
use profile_generic::can::{Frame, Id};
use profile_generic::time::MonotonicTime;
use profile_sercos::checker::bus::Stations;
use profile_sercos::checker::checked_bus::CheckedBus;
use profile_sercos::master::event::Port;

/// Frames or datagrams that a queue holds; more are lost.
const QUEUE: usize = 64;

/// Datagrams for a device that a queue holds: a flood comes between two calls.
const FLOOD: usize = 1024;

/// Identifiers whose last frame is remembered: a box uses fewer.
const SENT_MAX: usize = 256;

/// Bytes of a frame or datagram.
#[derive(Debug, Clone)]
pub struct Bytes {
    bytes: [u8; FRAME_MAX],
    len: usize,
}

impl Bytes {
    /// A copy of `bytes`, at most [`FRAME_MAX`] of them.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        let mut copy = Self { bytes: [0; FRAME_MAX], len: bytes.len().min(FRAME_MAX) };
        copy.bytes[..copy.len].copy_from_slice(&bytes[..copy.len]);
        copy
    }

    /// The bytes.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    /// Other bytes in their place, at most [`FRAME_MAX`] of them.
    pub fn replace(&mut self, bytes: &[u8]) {
        *self = Self::of(bytes);
    }

    /// The bytes, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [u8] {
        &mut self.bytes[..self.len]
    }
}

/// A queue of frames or datagrams in fixed storage, each with what belongs to it. In and out go as many bytes as a frame has, and
/// not as many as it could have: that would be most of what a cycle of the engine seems to cost.
#[derive(Debug)]
pub struct Ring<T> {
    slots: Vec<(Bytes, Option<T>)>,
    first: usize,
    count: usize,
}

impl<T> Default for Ring<T> {
    fn default() -> Self {
        Self::with_room(QUEUE)
    }
}

impl<T> Ring<T> {
    /// A queue for so many.
    fn with_room(room: usize) -> Self {
        let slot = || (Bytes::of(&[]), None);
        Self { slots: std::iter::repeat_with(slot).take(room).collect(), first: 0, count: 0 }
    }

    fn slot(&mut self, at: usize) -> &mut (Bytes, Option<T>) {
        let room = self.slots.len();
        &mut self.slots[(self.first + at) % room]
    }

    /// The oldest leaves; an empty queue begins where it began, in memory that was used before.
    fn leave(&mut self) {
        self.count -= 1;
        self.first = if self.count == 0 { 0 } else { (self.first + 1) % self.slots.len() };
    }

    /// Puts a copy behind the others; `false` when there is no room, or it is too long.
    pub fn push(&mut self, bytes: &[u8], with: T) -> bool {
        let (full, count) = (self.count == self.slots.len(), self.count);
        let slot = self.slot(count);
        let Some(place) = slot.0.bytes.get_mut(..bytes.len()).filter(|_| !full) else {
            return false;
        };
        place.copy_from_slice(bytes);
        (slot.0.len, slot.1) = (bytes.len(), Some(with));
        self.count += 1;
        true
    }

    /// Takes the oldest out into `buffer`: its length, and what belongs to it.
    ///
    /// # Panics
    /// When the buffer is too short.
    pub fn pop_into(&mut self, buffer: &mut [u8]) -> Option<(usize, T)> {
        let (bytes, with) = self.slot(0);
        let with = with.take()?;
        let len = bytes.len;
        buffer[..len].copy_from_slice(bytes.as_slice());
        self.leave();
        Some((len, with))
    }

    /// Takes the oldest out.
    pub fn pop(&mut self) -> Option<(Bytes, T)> {
        let (bytes, with) = self.slot(0);
        let with = with.take()?;
        let bytes = bytes.clone();
        self.leave();
        Some((bytes, with))
    }

    /// All that are in it, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &Bytes> {
        (0..self.count).map(|at| &self.slots[(self.first + at) % self.slots.len()].0)
    }
}

/// Where recorded datagrams of a device come from and go to.
const RECORDED: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 2, 1), 2_222);

/// The UDP port of a device.
#[derive(Debug)]
pub struct NorthQueue {
    /// What the device receives, with its sender and when it arrived.
    pub inbound: Ring<(SocketAddrV4, MonotonicTime)>,
    /// What the device has sent, with its destination.
    pub outbound: Ring<SocketAddrV4>,
    /// Records what goes to and fro, as the port of a gateway does.
    pub tap: Option<Tap>,
}

impl Default for NorthQueue {
    fn default() -> Self {
        Self { inbound: Ring::with_room(FLOOD), outbound: Ring::default(), tap: None }
    }
}

impl NorthPort for NorthQueue {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram> {
        let (len, (from, arrived_at)) = self.inbound.pop_into(buffer)?;
        if let Some(tap) = &mut self.tap {
            tap.datagram(KernelTime(arrived_at.0), from, RECORDED, 0, &buffer[..len]);
        }
        Some(Datagram { len, from, arrived_at: Some(arrived_at) })
    }

    fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool {
        if let Some(tap) = &mut self.tap {
            tap.datagram(realtime_now(), RECORDED, to, 0, datagram);
        }
        self.outbound.push(datagram, to)
    }
}

/// The Ethernet ports of the SERCOS master; the second one is used where the configuration has one.
#[derive(Debug, Default)]
pub struct SouthQueue {
    /// What comes back from the line.
    pub inbound: Ring<Port>,
    /// What the master has sent.
    pub outbound: Ring<Port>,
    /// When it has begun to send last: that of the MST.
    pub sent_at: Option<MonotonicTime>,
    /// Frames are handed over with their instant, as to a port that holds them until then.
    pub holds: bool,
    /// Records what goes to and fro, as the port of a gateway does.
    pub tap: Option<Tap>,
}

impl SouthQueue {
    /// Sends what the master has put out through the line, before the checker. `back` may change or lose what comes
    /// back; without a `line` there is no cable, and nothing does.
    ///
    /// # Panics
    /// With station and rule when a telegram breaks one.
    pub fn exchange(
        &mut self,
        now: MonotonicTime,
        checked: &mut CheckedBus,
        mut line: Option<&mut dyn Stations>,
        back: &mut dyn FnMut(&mut Bytes) -> bool,
    ) {
        while let Some((mut frame, port)) = self.outbound.pop() {
            let Some(line) = line.as_deref_mut() else {
                checked.sent(now, port, frame.as_slice());
                continue;
            };
            let inbound = &mut self.inbound;
            let mut arrived = |port, frame: &mut [u8]| {
                let mut frame = Bytes::of(frame);
                if back(&mut frame) {
                    inbound.push(frame.as_slice(), port);
                }
            };
            checked.send(now, port, frame.as_mut_slice(), line, &mut |_, _, _| {}, &mut arrived);
        }
        checked.judge();
    }
}

impl EthernetPort for SouthQueue {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let (len, port) = self.inbound.pop_into(buffer)?;
        if let Some(tap) = &mut self.tap {
            tap.frame(KernelTime(0), Side::South(port), &buffer[..len]);
        }
        Some((port, len))
    }

    fn send(&mut self, at: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        self.sent_at = Some(at);
        if let Some(tap) = &mut self.tap {
            tap.frame(realtime_now(), Side::South(port), frame);
        }
        self.outbound.push(frame, port)
    }

    fn holds_frames(&self) -> bool {
        self.holds
    }
}

/// Changes a frame on its way from the bus to the box; `false` loses it there, and nobody notices.
pub type TamperCan = Box<dyn FnMut(MonotonicTime, &mut Frame) -> bool>;

/// A CAN bus as the box sees it, which may be something else than what is there.
pub struct CanWire<N = DriveNode> {
    /// The bus with its drives.
    pub bus: InProcessCan<N>,
    /// What happens to frames that the box receives.
    pub tamper: Option<TamperCan>,
    /// Runs what happens on the bus and in its drives; a test that weighs the box leaves it out.
    pub aside: fn(&mut dyn FnMut()),
    /// When the box has sent a frame with an identifier last.
    sent: Vec<(Id, MonotonicTime)>,
}

impl<N: CanNode> CanWire<N> {
    /// All there is, as it is.
    #[must_use]
    pub fn new(bus: InProcessCan<N>) -> Self {
        Self { bus, tamper: None, aside: |run| run(), sent: Vec::with_capacity(SENT_MAX) }
    }

    /// When the box has sent a frame with this identifier last.
    #[must_use]
    pub fn sent_at(&self, id: Id) -> Option<MonotonicTime> {
        self.sent.iter().find(|(known, _)| *known == id).map(|(_, at)| *at)
    }
}

impl<N: CanNode> CanPort for CanWire<N> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        loop {
            let Self { bus, aside, .. } = self;
            let mut input = None;
            aside(&mut || input = bus.receive(now));
            match input? {
                CanInput::Frame(mut frame) => {
                    if self.tamper.as_mut().is_none_or(|tamper| tamper(now, &mut frame)) {
                        return Some(CanInput::Frame(frame));
                    }
                }
                other => return Some(other),
            }
        }
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let Self { bus, aside, .. } = self;
        let mut sent = CanSent::Failed;
        aside(&mut || sent = bus.send(now, frame));
        match self.sent.iter().position(|(known, _)| *known == frame.id()) {
            Some(place) => self.sent[place].1 = now,
            None if self.sent.len() < SENT_MAX => self.sent.push((frame.id(), now)),
            None => {}
        }
        sent
    }
}
