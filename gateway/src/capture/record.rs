//! Records of what was seen, as they travel from a tap to the recorder thread: a head of fixed length and the bytes, one after the other in a
//! queue of bytes. A record takes as many bytes as it has, so that pushing a short frame of a CAN bus costs no more than that.

use std::net::{Ipv4Addr, SocketAddrV4};

use rtrb::{Consumer, Producer};

use super::{FRAME_LEN_MAX, Side};
use crate::sys::clock::KernelTime;

/// Bytes of a head.
const HEAD_LEN: usize = 24;

/// Most bytes that a record takes in a queue.
pub(super) const RECORD_LEN_MAX: usize = HEAD_LEN + FRAME_LEN_MAX;

/// What was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Frame(Side),
    Datagram { from: SocketAddrV4, to: SocketAddrV4, tos: u8 },
    Opened { client: SocketAddrV4, server: SocketAddrV4 },
    Stream { from: SocketAddrV4, to: SocketAddrV4 },
    Closed { from: SocketAddrV4, to: SocketAddrV4 },
}

impl Kind {
    pub(super) const fn side(self) -> Side {
        match self {
            Self::Frame(side) => side,
            _ => Side::North,
        }
    }
}

/// A record without its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Head {
    /// When it was seen.
    pub at: KernelTime,
    pub kind: Kind,
    /// How many bytes follow.
    pub len: u16,
}

impl Head {
    /// Octets 0 to 7 time, 8 and 9 length, 10 kind, 11 side or type of service, 12 to 17 and 18 to 23 addresses.
    fn encode(&self) -> [u8; HEAD_LEN] {
        let mut octets = [0; HEAD_LEN];
        octets[..8].copy_from_slice(&self.at.0.to_le_bytes());
        octets[8..10].copy_from_slice(&self.len.to_le_bytes());
        let (kind, detail, addresses) = match self.kind {
            Kind::Frame(side) => (0, u8::try_from(side.index()).unwrap_or(u8::MAX), None),
            Kind::Datagram { from, to, tos } => (1, tos, Some((from, to))),
            Kind::Opened { client, server } => (2, 0, Some((client, server))),
            Kind::Stream { from, to } => (3, 0, Some((from, to))),
            Kind::Closed { from, to } => (4, 0, Some((from, to))),
        };
        (octets[10], octets[11]) = (kind, detail);
        if let Some((from, to)) = addresses {
            for (place, address) in [(12, from), (18, to)] {
                octets[place..place + 4].copy_from_slice(&address.ip().octets());
                octets[place + 4..place + 6].copy_from_slice(&address.port().to_le_bytes());
            }
        }
        octets
    }

    /// The head that was encoded so; `None` for what no head is.
    fn decode(octets: &[u8; HEAD_LEN]) -> Option<Self> {
        let [a, b, c, d, e, f, g, h, low, high, kind, detail, rest @ ..] = *octets;
        let address = |place: usize| {
            let [a, b, c, d, low, high] = *rest[place..].first_chunk::<6>()?;
            Some(SocketAddrV4::new(Ipv4Addr::new(a, b, c, d), u16::from_le_bytes([low, high])))
        };
        let (from, to) = (address(0)?, address(6)?);
        let kind = match kind {
            0 => Kind::Frame(Side::of_index(detail)?),
            1 => Kind::Datagram { from, to, tos: detail },
            2 => Kind::Opened { client: from, server: to },
            3 => Kind::Stream { from, to },
            4 => Kind::Closed { from, to },
            _ => return None,
        };
        let at = KernelTime(u64::from_le_bytes([a, b, c, d, e, f, g, h]));
        Some(Self { at, kind, len: u16::from_le_bytes([low, high]) })
    }
}

/// Puts a record into a queue; `false` when there is no room for it, or when it is longer than any record: nobody could take that out.
pub(super) fn push(queue: &mut Producer<u8>, at: KernelTime, kind: Kind, bytes: &[u8]) -> bool {
    let len = u16::try_from(bytes.len()).ok().filter(|len| usize::from(*len) <= FRAME_LEN_MAX);
    let Some(len) = len else { return false };
    let needed = HEAD_LEN + bytes.len();
    // What the recorder thread has taken lately is only looked at when it is needed: its counter is in another core's cache.
    if queue.cached_slots() < needed && queue.slots() < needed {
        return false;
    }
    // There is room for both, and this is the only producer: neither is refused.
    queue.push_entire_slice(&Head { at, kind, len }.encode()).is_ok()
        && queue.push_entire_slice(bytes).is_ok()
}

/// The taking end of a queue.
#[derive(Debug)]
pub(super) struct Records {
    queue: Consumer<u8>,
    /// The head of the next record, which was taken already.
    head: Option<Head>,
}

impl Records {
    pub(super) fn new(queue: Consumer<u8>) -> Self {
        Self { queue, head: None }
    }

    /// Bytes that wait.
    pub(super) fn waiting(&self) -> usize {
        self.queue.slots() + if self.head.is_some() { HEAD_LEN } else { 0 }
    }

    /// The next record, as soon as all of it is there.
    pub(super) fn next(&mut self) -> Option<Head> {
        if self.head.is_none() {
            let mut octets = [0; HEAD_LEN];
            self.queue.pop_entire_slice(&mut octets).ok()?;
            // Only heads come here.
            self.head = Head::decode(&octets);
        }
        self.head.filter(|head| self.queue.slots() >= usize::from(head.len))
    }

    /// Takes the record that is next, with its bytes; how many bytes it had in the queue.
    pub(super) fn take<'b>(&mut self, buffer: &'b mut [u8; FRAME_LEN_MAX]) -> Option<(Head, &'b [u8])> {
        let head = self.next()?;
        let bytes = buffer.get_mut(..usize::from(head.len))?;
        self.queue.pop_entire_slice(bytes).ok()?;
        self.head = None;
        Some((head, bytes))
    }
}

/// Bytes that a record has in its queue.
pub(super) fn len_in_queue(head: &Head) -> usize {
    HEAD_LEN + usize::from(head.len)
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_sercos::port::Port;
    use rtrb::RingBuffer;

    const ONE: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 50_000);
    const OTHER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(198, 51, 100, 2), 2_222);

    #[test]
    fn records_of_every_kind_come_out_as_they_went_in_and_across_the_end_of_the_queue() {
        let (mut queue, records) = RingBuffer::new(100);
        let mut records = Records::new(records);
        let kinds = [
            Kind::Frame(Side::North),
            Kind::Frame(Side::South(Port::One)),
            Kind::Frame(Side::South(Port::Two)),
            Kind::Frame(Side::Can(0)),
            Kind::Frame(Side::Can(7)),
            Kind::Datagram { from: ONE, to: OTHER, tos: 0xB8 },
            Kind::Opened { client: ONE, server: OTHER },
            Kind::Stream { from: ONE, to: OTHER },
            Kind::Closed { from: OTHER, to: ONE },
        ];
        let mut buffer = [0; FRAME_LEN_MAX];
        for (number, kind) in (0_u8..).zip(kinds.into_iter().cycle().take(90)) {
            let bytes: Vec<u8> = (number..number + number % 37).collect();
            let at = KernelTime(u64::from(number) << 40);
            assert!(push(&mut queue, at, kind, &bytes));
            let head = Head { at, kind, len: u16::from(number % 37) };
            assert_eq!(records.waiting(), len_in_queue(&head));
            assert_eq!(records.next(), Some(head));
            assert_eq!(records.waiting(), len_in_queue(&head), "a look takes nothing");
            assert_eq!(records.take(&mut buffer), Some((head, &bytes[..])));
            assert_eq!((records.next(), records.waiting()), (None, 0));
        }
    }

    #[test]
    fn record_without_room_is_refused_as_a_whole() {
        let (mut queue, records) = RingBuffer::new(2 * RECORD_LEN_MAX);
        let mut records = Records::new(records);
        let mut buffer = [0; FRAME_LEN_MAX];
        let kind = Kind::Frame(Side::North);
        assert!(
            !push(&mut queue, KernelTime(1), kind, &[0; FRAME_LEN_MAX + 1]),
            "there is room, but not for one so long"
        );
        assert!(push(&mut queue, KernelTime(2), kind, &[7; FRAME_LEN_MAX]));
        assert_eq!(
            records.take(&mut buffer).map(|(head, bytes)| (head.at, bytes.len())),
            Some((KernelTime(2), FRAME_LEN_MAX))
        );

        let (mut queue, records) = RingBuffer::new(2 * HEAD_LEN + 10);
        let mut records = Records::new(records);
        assert!(push(&mut queue, KernelTime(1), kind, &[1; 5]));
        assert!(!push(&mut queue, KernelTime(2), kind, &[2; 6]));
        assert!(push(&mut queue, KernelTime(3), kind, &[3; 5]));
        assert!(!push(&mut queue, KernelTime(4), kind, &[]));
        assert!(!push(&mut queue, KernelTime(5), kind, &[0; 70_000]), "longer than any record");
        for (at, byte) in [(1, 1), (3, 3)] {
            let (head, bytes) = records.take(&mut buffer).expect("a record");
            assert_eq!((head.at, bytes), (KernelTime(at), &[byte; 5][..]));
        }
        assert_eq!(records.take(&mut buffer), None);
    }

    #[test]
    fn record_is_seen_when_all_of_it_is_there() {
        let (mut queue, records) = RingBuffer::new(100);
        let mut records = Records::new(records);
        let head = Head { at: KernelTime(7), kind: Kind::Frame(Side::Can(1)), len: 2 };
        queue.push_entire_slice(&head.encode()).expect("room");
        assert_eq!(records.next(), None);
        queue.push_entire_slice(&[1, 2]).expect("room");
        assert_eq!(records.next(), Some(head));
        let mut wrong = head.encode();
        wrong[10] = 5;
        assert_eq!(Head::decode(&wrong), None);
    }
}
