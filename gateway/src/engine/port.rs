//! What the engine sends through and receives from: sockets in the box, queues in the virtual-time tests.
//!
//! Both are non-blocking and called from the cycle: they neither wait nor allocate.

use std::net::SocketAddrV4;

use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

/// Longest frame or datagram that is taken; longer ones are none of ours.
pub const FRAME_MAX: usize = 1518;

/// The class 1 UDP port of one CIP Motion device.
pub trait NorthPort {
    /// The next datagram that came: its length in `buffer` and its sender. Truncated ones are left out.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(usize, SocketAddrV4)>;

    /// Sends a datagram now or not at all; `false` when it could not be sent.
    fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool;
}

/// The Ethernet ports of the SERCOS III master.
pub trait SouthPort {
    /// The next frame that came: the port it came in on and its length in `buffer`.
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)>;

    /// Sends a frame now or not at all; `false` when it could not be sent.
    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool;
}
