//! One stream of a peer: its bytes in, its bytes out, its encapsulation session, and the one request under
//! way.
//!
//! Memory is bounded: a stream holds at most one packet of input beyond what it has answered, and stops
//! taking packets while its peer does not fetch the answers.

use core::net::SocketAddrV4;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::adapter::SessionSlot;
use super::node::Await;
use crate::wire::encapsulation::{HEADER_LEN, Header};

/// Longest data behind an encapsulation header. The longest message, of a large explicit connection, has 4002
/// bytes and 20 of items around it.
pub const PACKET_DATA_MAX: usize = 4096;

/// Input a stream holds at most.
pub const INPUT_MAX: usize = HEADER_LEN + PACKET_DATA_MAX;

/// With more output than this waiting, no further packet is taken from the stream.
pub const OUTPUT_HIGH: usize = 2 * INPUT_MAX;

/// A stream that sends this many packets of no known command, or of an impossible length, in a row is closed.
const GARBLED_MAX: u8 = 8;

/// How long a stream may live without registering a session.
pub(crate) const UNREGISTERED_TIMEOUT: DurationNs = DurationNs::from_secs(30);

/// How a reply travels back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReplyTo {
    Unconnected { sender_context: [u8; 8] },
    Connected { sender_context: [u8; 8], o_to_t_id: u32, sequence: u16 },
}

/// A request that waits for the motion device.
#[derive(Debug)]
pub(crate) struct Transaction {
    pub reply_to: ReplyTo,
    pub awaited: Await,
    pub deadline: MonotonicTime,
    pub t_to_o_socket: Option<SocketAddrV4>,
    /// The packet of services this request is a part of.
    pub multiple: Option<Multiple>,
    /// What was opened on the way.
    pub opened: Opened,
}

/// What requests of a message have opened: the reply then says where datagrams go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Opened {
    /// A connection whose datagrams come to this device.
    pub io: bool,
    /// A connection that consumes the multicast stream, which goes there.
    pub group: Option<SocketAddrV4>,
}

impl Opened {
    /// Both together. A device has one multicast stream.
    pub fn and(self, other: Self) -> Self {
        Self { io: self.io || other.io, group: self.group.or(other.group) }
    }
}

/// A Multiple_Service_Packet under way.
#[derive(Debug)]
pub(crate) struct Multiple {
    /// Service data of the packet.
    pub data: Vec<u8>,
    /// Next service to run.
    pub next: u16,
    /// Replies so far.
    pub replies: Vec<Vec<u8>>,
    /// Whether one of them is not a success.
    pub failed: bool,
}

/// What the input holds next.
pub(crate) enum Input {
    /// Not enough yet.
    Wait,
    /// A whole packet.
    Packet(Vec<u8>),
    /// A header whose data is longer than anything valid; the data will be skipped as it comes.
    Oversize(Header),
}

/// The stream.
#[derive(Debug)]
pub(crate) struct Session {
    pub slot: SessionSlot,
    pub peer: SocketAddrV4,
    /// Session handle, once registered.
    pub handle: Option<u32>,
    pub transaction: Option<Transaction>,
    /// To be closed as soon as the output is out.
    pub closing: bool,
    /// When the last whole packet came, or the stream was opened.
    pub last_activity: MonotonicTime,
    input: Vec<u8>,
    output: Vec<u8>,
    skip: usize,
    garbled: u8,
}

impl Session {
    pub fn new(slot: SessionSlot, peer: SocketAddrV4, now: MonotonicTime) -> Self {
        Self {
            slot,
            peer,
            handle: None,
            transaction: None,
            closing: false,
            last_activity: now,
            input: Vec::new(),
            output: Vec::new(),
            skip: 0,
            garbled: 0,
        }
    }

    /// Bytes that would be taken now.
    pub fn room(&self) -> usize {
        if self.closing { 0 } else { INPUT_MAX - self.input.len() + self.skip }
    }

    /// Takes bytes, as many as there is room for, and returns how many.
    pub fn take(&mut self, bytes: &[u8]) -> usize {
        if self.closing {
            return 0;
        }
        let skipped = self.skip.min(bytes.len());
        self.skip -= skipped;
        let rest = &bytes[skipped..];
        let taken = rest.len().min(INPUT_MAX - self.input.len());
        self.input.extend_from_slice(&rest[..taken]);
        skipped + taken
    }

    /// Cuts the next packet out of the input.
    pub fn next(&mut self) -> Input {
        let Ok(header) = Header::parse(&self.input) else { return Input::Wait };
        let length = usize::from(header.length);
        if length > PACKET_DATA_MAX {
            let end = (HEADER_LEN + length).min(self.input.len());
            self.input.drain(..end);
            self.skip = HEADER_LEN + length - end;
            return Input::Oversize(header);
        }
        let end = HEADER_LEN + length;
        if self.input.len() < end {
            return Input::Wait;
        }
        Input::Packet(self.input.drain(..end).collect())
    }

    /// Whether another packet may be taken from the input.
    pub fn is_ready(&self) -> bool {
        !self.closing && self.transaction.is_none() && self.output.len() < OUTPUT_HIGH
    }

    pub fn send(&mut self, packet: &[u8]) {
        self.output.extend_from_slice(packet);
    }

    pub fn has_output(&self) -> bool {
        !self.output.is_empty()
    }

    /// Moves output into `out` and returns how much.
    pub fn fetch(&mut self, out: &mut [u8]) -> usize {
        let count = self.output.len().min(out.len());
        out[..count].copy_from_slice(&self.output[..count]);
        self.output.drain(..count);
        count
    }

    /// Notes whether a packet made sense; tells `false` when the stream has been senseless for too long.
    pub fn judge(&mut self, sensible: bool) -> bool {
        self.garbled = if sensible { 0 } else { self.garbled + 1 };
        self.garbled < GARBLED_MAX
    }

    /// When the stream is closed for silence, unless it never is. A request under way is not silence.
    pub fn inactive_at(&self, inactivity_timeout_s: u16) -> Option<MonotonicTime> {
        let timeout = match (self.handle, inactivity_timeout_s) {
            (None, _) => UNREGISTERED_TIMEOUT,
            (Some(_), 0) => return None,
            (Some(_), seconds) => DurationNs::from_secs(i64::from(seconds)),
        };
        if self.transaction.is_some() || self.closing { None } else { Some(self.last_activity + timeout) }
    }
}
