//! What the engine sends through and receives from: sockets in the box, queues in the virtual-time tests.
//!
//! All are non-blocking and called from the cycle: they neither wait nor allocate.

use std::net::SocketAddrV4;

use profile_generic::can::Frame;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

/// Longest frame or datagram that is taken; longer ones are none of ours.
pub const FRAME_MAX: usize = 1518;

/// A datagram that came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datagram {
    /// Its octets in the buffer.
    pub len: usize,
    /// Its sender.
    pub from: SocketAddrV4,
    /// When it arrived at the host, where that is known better than by when it is taken.
    pub arrived_at: Option<MonotonicTime>,
}

/// The class 1 UDP port of one CIP Motion device.
pub trait NorthPort {
    /// The next datagram that came. One that is longer than the buffer has length 0: it counts as one that came, so that whoever
    /// bounds the datagrams of a cycle has bounded these as well.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram>;

    /// Sends a datagram now or not at all; `false` when it could not be sent.
    fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool;
}

/// The Ethernet ports of the SERCOS III master.
pub trait EthernetPort {
    /// The next frame that came: the port it came in on and its length in `buffer`.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)>;

    /// Sends a frame now or not at all; `false` when it could not be sent.
    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool;
}

/// What comes from a CAN controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanInput {
    /// A frame of another station.
    Frame(Frame),
    /// The controller is off the bus, or its interface is down.
    BusOff,
    /// It is back.
    BusOn,
}

/// What came of a frame to be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanSent {
    /// It is in the transmit queue.
    Sent,
    /// The queue is full: it can be tried again when the bus has carried something.
    Full,
    /// It will not be sent.
    Failed,
}

/// A CAN controller.
pub trait CanPort {
    /// What came next.
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput>;

    /// Hands a frame to the transmit queue.
    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent;
}

/// The port of one bus.
pub enum SouthPort<'a> {
    /// Of SERCOS III.
    Ethernet(&'a mut dyn EthernetPort),
    /// Of CAN.
    Can(&'a mut dyn CanPort),
}
