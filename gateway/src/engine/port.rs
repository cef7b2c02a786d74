//! The ports of the engine: sockets in the box, queues in the virtual-time tests.
//!
//! All methods are called in the cycle: they neither wait nor allocate.

use std::net::SocketAddrV4;

use profile_generic::can::Frame;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

/// Longest frame or datagram in bytes. Longer ones are not for the gateway.
pub const FRAME_MAX: usize = 1518;

/// A received datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datagram {
    /// Its length in the buffer, in bytes.
    pub len: usize,
    /// Its sender.
    pub from: SocketAddrV4,
    /// When it arrived at the host, if the kernel has stamped it.
    pub arrived_at: Option<MonotonicTime>,
}

/// The class 1 UDP port of one device.
pub trait NorthPort {
    /// Receives the next datagram; `None` if none waits. A datagram that is longer than the buffer has length 0, so that it
    /// counts towards a limit on the datagrams of a cycle.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram>;

    /// Sends a datagram now or not at all; `false` when it could not be sent.
    fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool;
}

/// The Ethernet ports of the SERCOS III master.
pub trait EthernetPort {
    /// Receives the next frame: its port and its length in `buffer`, in bytes; `None` if none waits.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)>;

    /// Sends a frame or nothing; `false` when it could not be sent. It leaves now, or at `at` where the port holds frames.
    fn send(&mut self, at: MonotonicTime, port: Port, frame: &[u8]) -> bool;

    /// Whether frames are held until their instant: then they are handed over as soon as they are built.
    fn holds_frames(&self) -> bool {
        false
    }
}

/// An input from a CAN controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanInput {
    /// A frame of another station.
    Frame(Frame),
    /// A frame from the transmit queue has left: the oldest that is in there. Not every port reports this.
    Transmitted,
    /// The controller is off the bus, or its interface is down.
    BusOff,
    /// The controller is on the bus again.
    BusOn,
}

/// Message about a work that ends with [`CanInput::BusOff`].
pub const OFF_THE_BUS: &str = "the interface is off the bus";

/// Message about a work that ends because the transmit queue stays full.
pub const UNACKNOWLEDGED: &str = "no station of the bus acknowledges what is sent";

/// The result of sending a CAN frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanSent {
    /// It is in the transmit queue.
    Sent,
    /// The queue is full. Try again when the bus has carried a frame.
    Full,
    /// The frame is not sent and must not be tried again.
    Failed,
}

/// A CAN controller.
pub trait CanPort {
    /// The next input; `None` if none waits.
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput>;

    /// Puts a frame into the transmit queue.
    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent;
}

/// The port of one bus, by the kind of its interface.
pub enum SouthPort<'a> {
    /// Of SERCOS III.
    Ethernet(&'a mut dyn EthernetPort),
    /// The controller of a CANopen or DeviceNet bus.
    Can(&'a mut dyn CanPort),
}

impl SouthPort<'_> {
    /// Whether frames are held until their instant.
    #[must_use]
    pub fn holds_frames(&self) -> bool {
        match self {
            Self::Ethernet(port) => port.holds_frames(),
            Self::Can(_) => false,
        }
    }
}
