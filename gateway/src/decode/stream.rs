//! Puts the bytes of TCP streams together, in order, each direction for itself.
//!
//! What has arrived again is passed over; after a gap the stream is read anew from the segment behind it,
//! which is taken to begin with a message.

use std::collections::VecDeque;
use std::net::SocketAddrV4;

use super::packet::Segment;

/// Directions followed at once; the one silent for the longest is forgotten.
const STREAMS_MAX: usize = 256;

/// The longest encapsulation message: header and 65535 bytes.
const MESSAGE_LEN_MAX: usize = 24 + 65_535;

const FIN: u8 = 0x01;
const SYN: u8 = 0x02;
const RST: u8 = 0x04;

/// One direction of a stream.
#[derive(Debug)]
struct Direction {
    from: SocketAddrV4,
    to: SocketAddrV4,
    next: u32,
    bytes: Vec<u8>,
}

/// What a segment brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arrival {
    /// Bytes in order.
    InOrder,
    /// Nothing but what had come before.
    Repeated,
    /// This many bytes are missing before it; what was left of a message is given up.
    Gap(u32),
}

/// The directions in order of use, the latest last.
#[derive(Debug, Default)]
pub(super) struct Streams(VecDeque<Direction>);

impl Streams {
    /// Takes a segment in; the bytes not yet consumed of its direction are given to `read`, which returns how
    /// many it used.
    pub fn segment(&mut self, segment: &Segment<'_>, mut read: impl FnMut(Arrival, &[u8]) -> usize) {
        let known = self.0.iter().position(|known| known.from == segment.from && known.to == segment.to);
        let mut direction = known.and_then(|index| self.0.remove(index)).unwrap_or_else(|| Direction {
            from: segment.from,
            to: segment.to,
            next: segment.sequence,
            bytes: Vec::new(),
        });
        let mut start = segment.sequence;
        if segment.flags & SYN != 0 {
            start = start.wrapping_add(1);
            direction.next = start;
            direction.bytes.clear();
        }
        if !segment.payload.is_empty() {
            let (arrival, fresh) = direction.sort(start, segment.payload);
            direction.bytes.extend_from_slice(fresh);
            let used = read(arrival, &direction.bytes);
            direction.bytes.drain(..used.min(direction.bytes.len()));
            // A message is used up when it is whole, so nothing longer can be left.
            direction.bytes.truncate(MESSAGE_LEN_MAX);
        }
        if segment.flags & (FIN | RST) == 0 {
            if self.0.len() == STREAMS_MAX {
                self.0.pop_front();
            }
            self.0.push_back(direction);
        }
    }
}

impl Direction {
    /// The part of a payload that is new, and how it fits.
    fn sort<'a>(&mut self, start: u32, payload: &'a [u8]) -> (Arrival, &'a [u8]) {
        let length = u32::try_from(payload.len()).unwrap_or(u32::MAX);
        let ahead = start.wrapping_sub(self.next);
        let end = start.wrapping_add(length);
        // Sequence numbers wrap: half of the circle is ahead, the other half has been.
        if ahead == 0 {
            self.next = end;
            (Arrival::InOrder, payload)
        } else if ahead < 1 << 31 {
            self.next = end;
            self.bytes.clear();
            (Arrival::Gap(ahead), payload)
        } else {
            let old = usize::try_from(self.next.wrapping_sub(start)).unwrap_or(usize::MAX);
            match payload.get(old..) {
                Some(fresh) if !fresh.is_empty() => {
                    self.next = end;
                    (Arrival::InOrder, fresh)
                }
                _ => (Arrival::Repeated, &[]),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    fn end(port: u16) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::LOCALHOST, port)
    }

    /// What `read` is told for a segment, using up `used` bytes.
    fn feed(
        streams: &mut Streams,
        sequence: u32,
        flags: u8,
        payload: &[u8],
        used: usize,
    ) -> Option<(Arrival, Vec<u8>)> {
        let segment = Segment { from: end(1), to: end(2), sequence, flags, payload };
        let mut told = None;
        streams.segment(&segment, |arrival, bytes| {
            told = Some((arrival, bytes.to_vec()));
            used
        });
        told
    }

    #[test]
    fn bytes_are_put_together_across_the_wrap_of_the_numbers() {
        let mut streams = Streams::default();
        assert_eq!(feed(&mut streams, u32::MAX - 2, SYN, &[], 0), None);
        assert_eq!(feed(&mut streams, u32::MAX - 1, 0, b"abc", 0), Some((Arrival::InOrder, b"abc".to_vec())));
        assert_eq!(feed(&mut streams, 1, 0, b"de", 4), Some((Arrival::InOrder, b"abcde".to_vec())));
        // Wholly, then partly repeated.
        assert_eq!(feed(&mut streams, 1, 0, b"de", 0), Some((Arrival::Repeated, b"e".to_vec())));
        assert_eq!(feed(&mut streams, 2, 0, b"ef", 0), Some((Arrival::InOrder, b"ef".to_vec())));
    }

    #[test]
    fn after_a_gap_the_rest_is_read_anew() {
        let mut streams = Streams::default();
        feed(&mut streams, 100, 0, b"ab", 0);
        assert_eq!(feed(&mut streams, 105, 0, b"xy", 2), Some((Arrival::Gap(3), b"xy".to_vec())));
        assert_eq!(feed(&mut streams, 107, 0, b"z", 1), Some((Arrival::InOrder, b"z".to_vec())));
    }

    #[test]
    fn the_end_of_a_stream_forgets_it_and_the_number_of_streams_is_bounded() {
        let mut streams = Streams::default();
        feed(&mut streams, 100, 0, b"ab", 0);
        feed(&mut streams, 102, FIN, b"", 0);
        assert_eq!(feed(&mut streams, 500, 0, b"q", 0), Some((Arrival::InOrder, b"q".to_vec())));
        for port in 0..1000 {
            let segment = Segment { from: end(port), to: end(9), sequence: 1, flags: 0, payload: b"x" };
            streams.segment(&segment, |_, _| 0);
        }
        assert_eq!(streams.0.len(), STREAMS_MAX);
    }
}
