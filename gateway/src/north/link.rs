//! The way between the adapter (supervisor) and the motion device (cycle thread): two bounded queues, and a number each way.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use arrayvec::ArrayVec;
use profile_cip::device::connection_manager::LISTENERS_MAX;
use profile_cip::device::motion_link::{MotionReply, MotionRequest};
use rtrb::{Consumer, Producer, PushError, RingBuffer};

/// Requests, and replies, that can be under way: one for each stream an adapter serves at once.
pub const QUEUE_LEN: usize = 32;

/// Connections of a device whose loss can wait to be reported: all that it can have.
const LOST_MAX: usize = 1 + LISTENERS_MAX;

/// Both ends of a new link.
#[must_use]
pub fn motion_link() -> (AdapterEnd, DeviceEnd) {
    let (request_in, request_out) = RingBuffer::new(QUEUE_LEN);
    let (reply_in, reply_out) = RingBuffer::new(QUEUE_LEN);
    let connections = Arc::new(AtomicUsize::new(0));
    let owner_port = Arc::new(AtomicU64::new(0));
    let adapter = AdapterEnd {
        requests: request_in,
        replies: reply_out,
        connections: Arc::clone(&connections),
        owner_port: Arc::clone(&owner_port),
    };
    let lost = ArrayVec::new();
    (adapter, DeviceEnd { requests: request_out, replies: reply_in, lost, connections, owner_port })
}

/// Marks a port as known, in one number with a connection ID (upper 32 bits) and the port (lower 16).
const KNOWN: u64 = 1 << 16;

/// Connection ID and port in one number.
fn with_port(connection_id: u32, port: u16) -> u64 {
    u64::from(connection_id) << 32 | KNOWN | u64::from(port)
}

/// The end beside the adapter.
#[derive(Debug)]
pub struct AdapterEnd {
    requests: Producer<MotionRequest>,
    replies: Consumer<MotionReply>,
    connections: Arc<AtomicUsize>,
    owner_port: Arc<AtomicU64>,
}

impl AdapterEnd {
    /// Sends a request to the motion device.
    ///
    /// # Errors
    /// The queue is full; the request comes back.
    #[expect(clippy::result_large_err, reason = "the request is handed back, and boxing would allocate")]
    pub fn request(&mut self, request: MotionRequest) -> Result<(), MotionRequest> {
        self.requests.push(request).map_err(|PushError::Full(request)| request)
    }

    /// Tells how many explicit connections are open.
    pub fn tell_connections(&self, count: usize) {
        self.connections.store(count, Ordering::Relaxed);
    }

    /// Source port of the updates of this connection, once the motion device has taken one.
    #[must_use]
    pub fn owner_port(&self, connection_id: u32) -> Option<u16> {
        let known = self.owner_port.load(Ordering::Relaxed);
        let [low, high, ..] = known.to_le_bytes();
        let port = u16::from_le_bytes([low, high]);
        (known == with_port(connection_id, port)).then_some(port)
    }

    /// The next reply of the motion device.
    pub fn reply(&mut self) -> Option<MotionReply> {
        self.replies.pop().ok()
    }
}

/// The end in the cycle thread. Nothing here waits, allocates or calls the system.
#[derive(Debug)]
pub struct DeviceEnd {
    requests: Consumer<MotionRequest>,
    replies: Producer<MotionReply>,
    /// Connections that were lost, and the queue had no room to say so: ID, and silence in microseconds.
    lost: ArrayVec<(u32, u64), LOST_MAX>,
    connections: Arc<AtomicUsize>,
    owner_port: Arc<AtomicU64>,
}

impl DeviceEnd {
    /// Explicit connections that were open when the adapter told it last.
    #[must_use]
    pub fn explicit_connections(&self) -> usize {
        self.connections.load(Ordering::Relaxed)
    }

    /// Tells from which source port the updates of this connection come.
    pub fn tell_owner_port(&self, connection_id: u32, port: u16) {
        self.owner_port.store(with_port(connection_id, port), Ordering::Relaxed);
    }

    /// The next request of the adapter.
    pub fn request(&mut self) -> Option<MotionRequest> {
        self.requests.pop().ok()
    }

    /// Sends a reply.
    ///
    /// # Errors
    /// The queue is full; the reply comes back, to be offered again in a later cycle.
    #[expect(clippy::result_large_err, reason = "the reply is handed back, and boxing would allocate")]
    pub fn reply(&mut self, reply: MotionReply) -> Result<(), MotionReply> {
        self.replies.push(reply).map_err(|PushError::Full(reply)| reply)
    }

    /// Reports that a connection was lost. Nobody waits for that as for an answer: what does not fit is kept for [`Self::report_kept`].
    pub fn report_lost(&mut self, o_to_t_id: u32, silent_us: u64) {
        if self.lost.is_full() {
            // More than a device can have: the adapter has closed the oldest by itself.
            self.lost.remove(0);
        }
        self.lost.push((o_to_t_id, silent_us));
        self.report_kept();
    }

    /// Reports lost connections for which the queue had no room. Call it in every cycle.
    pub fn report_kept(&mut self) {
        while let Some(&(o_to_t_id, silent_us)) = self.lost.first() {
            if self.reply(MotionReply::ConnectionLost { o_to_t_id, silent_us }).is_err() {
                return;
            }
            self.lost.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use profile_cip::device::motion_link::{CloseParameters, ConnectionTriad, Token};

    use super::*;

    pub fn close(token: u64) -> MotionRequest {
        let triad = ConnectionTriad { connection_serial: 1, originator_vendor: 2, originator_serial: 3 };
        MotionRequest::Close(CloseParameters { token: Token(token), triad, o_to_t_id: 4 })
    }

    #[test]
    fn both_directions_keep_their_order_and_hand_back_what_does_not_fit() {
        let (mut adapter, mut device) = motion_link();
        for token in 0..32 {
            assert_eq!(adapter.request(close(token)), Ok(()));
            assert_eq!(device.reply(MotionReply::Closed { token: Token(token) }), Ok(()));
        }
        adapter.tell_connections(3);
        assert_eq!(device.explicit_connections(), 3);
        assert_eq!(adapter.owner_port(0), None);
        device.tell_owner_port(0x7A00_0001, 0);
        assert_eq!((adapter.owner_port(0x7A00_0001), adapter.owner_port(0x7A00_0002)), (Some(0), None));
        device.tell_owner_port(0x7A00_0002, 2222);
        assert_eq!((adapter.owner_port(0x7A00_0001), adapter.owner_port(0x7A00_0002)), (None, Some(2222)));
        assert_eq!(adapter.request(close(32)), Err(close(32)));
        let reply = MotionReply::Closed { token: Token(32) };
        assert_eq!(device.reply(reply.clone()), Err(reply));
        let tokens: Vec<u64> = std::iter::from_fn(|| device.request()).map(|one| one.token().0).collect();
        assert_eq!(tokens, (0..32).collect::<Vec<u64>>());
        assert_eq!(adapter.reply(), Some(MotionReply::Closed { token: Token(0) }));
        assert_eq!(std::iter::from_fn(|| adapter.reply()).count(), 31);
    }
}
