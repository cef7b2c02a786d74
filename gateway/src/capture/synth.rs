//! Puts Ethernet, IPv4 and UDP or TCP headers around payloads seen at a socket.
//!
//! The frames are such as the network carried, as far as a socket can know: right lengths and checksums; for
//! TCP a handshake, sequence and acknowledge numbers without gaps in each stream, so that an analyser
//! reassembles it. The Ethernet addresses are made from the IP addresses (locally administered `02:00` and
//! the four bytes), identification and initial sequence numbers are counted.

use std::net::SocketAddrV4;

use thiserror::Error;

/// Streams tracked at once; the one silent for the longest makes room for a new one, and starts anew when it
/// speaks.
pub const STREAMS_MAX: usize = 64;

/// The longest payload of a TCP segment: a 1500-byte packet less two headers of 20 bytes.
pub const SEGMENT_LEN_MAX: usize = 1460;

/// The longest payload of a UDP datagram in one frame: a 1500-byte packet less headers of 20 and 8 bytes.
pub const DATAGRAM_LEN_MAX: usize = 1472;

/// The longest frame made here.
pub const FRAME_LEN: usize = ETHERNET_LEN + IPV4_LEN + TCP_LEN + SEGMENT_LEN_MAX;

const ETHERNET_LEN: usize = 14;
const IPV4_LEN: usize = 20;
const UDP_LEN: usize = 8;
const TCP_LEN: usize = 20;

const PROTOCOL_TCP: u8 = 6;
const PROTOCOL_UDP: u8 = 17;

const FIN: u8 = 0x01;
const SYN: u8 = 0x02;
const PSH: u8 = 0x08;
const ACK: u8 = 0x10;

/// A datagram that does not fit one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("a datagram of {len} bytes does not fit one frame: at most {DATAGRAM_LEN_MAX}")]
pub struct TooLong {
    /// Its payload's length.
    pub len: usize,
}

/// One direction of a stream: who sends, and its next sequence number.
#[derive(Debug, Clone, Copy)]
struct Half {
    from: SocketAddrV4,
    next: u32,
}

#[derive(Debug, Clone, Copy)]
struct Stream {
    halves: [Half; 2],
    used: u64,
}

/// Makes frames; keeps the state of the TCP streams.
#[derive(Debug, Default)]
pub struct Synthesizer {
    streams: Vec<Stream>,
    clock: u64,
    identification: u16,
}

impl Synthesizer {
    /// One without streams.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A UDP datagram with the type-of-service octet `tos` (code point times four).
    ///
    /// # Errors
    /// [`TooLong`] beyond [`DATAGRAM_LEN_MAX`]: nothing is emitted.
    pub fn udp(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        tos: u8,
        payload: &[u8],
        emit: &mut dyn FnMut(&[u8]),
    ) -> Result<(), TooLong> {
        if payload.len() > DATAGRAM_LEN_MAX {
            return Err(TooLong { len: payload.len() });
        }
        let mut header = [0; UDP_LEN];
        header[0..2].copy_from_slice(&from.port().to_be_bytes());
        header[2..4].copy_from_slice(&to.port().to_be_bytes());
        header[4..6].copy_from_slice(&length(UDP_LEN + payload.len()).to_be_bytes());
        let checksum = match transport_checksum(from, to, PROTOCOL_UDP, &header, payload) {
            // Zero would mean that there is none (RFC 768).
            0 => 0xFFFF,
            sum => sum,
        };
        header[6..8].copy_from_slice(&checksum.to_be_bytes());
        self.frame(from, to, tos, PROTOCOL_UDP, &header, payload, emit);
        Ok(())
    }

    /// The three segments that open a stream; an older stream between the two ends is forgotten.
    pub fn tcp_open(&mut self, client: SocketAddrV4, server: SocketAddrV4, emit: &mut dyn FnMut(&[u8])) {
        if let Some((index, _)) = self.find(client, server) {
            self.streams.swap_remove(index);
        }
        if self.streams.len() == STREAMS_MAX
            && let Some((oldest, _)) = self.streams.iter().enumerate().min_by_key(|(_, stream)| stream.used)
        {
            self.streams.swap_remove(oldest);
        }
        self.clock += 1;
        // Spread, so that streams are distinguished in a listing of raw numbers.
        let serial = u32::try_from(self.clock & 0xFFFF).unwrap_or(0);
        let initial = serial.wrapping_mul(0x9E37_79B1);
        let halves = [
            Half { from: client, next: initial },
            Half { from: server, next: initial.wrapping_add(0x4000_0000) },
        ];
        self.streams.push(Stream { halves, used: self.clock });
        let index = self.streams.len() - 1;
        self.segment(index, 0, SYN, &[], emit);
        self.segment(index, 1, SYN | ACK, &[], emit);
        self.segment(index, 0, ACK, &[], emit);
    }

    /// Bytes of a stream, in as many segments as they need. A stream that was not opened is opened first,
    /// `from` as client.
    pub fn tcp_data(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        payload: &[u8],
        emit: &mut dyn FnMut(&[u8]),
    ) {
        if self.find(from, to).is_none() {
            self.tcp_open(from, to, emit);
        }
        let Some((index, half)) = self.find(from, to) else { return };
        for part in payload.chunks(SEGMENT_LEN_MAX) {
            self.segment(index, half, PSH | ACK, part, emit);
        }
    }

    /// The three segments with which `from` closes a stream; nothing when the stream is not known.
    pub fn tcp_close(&mut self, from: SocketAddrV4, to: SocketAddrV4, emit: &mut dyn FnMut(&[u8])) {
        let Some((index, half)) = self.find(from, to) else { return };
        self.segment(index, half, FIN | ACK, &[], emit);
        self.segment(index, 1 - half, FIN | ACK, &[], emit);
        self.segment(index, half, ACK, &[], emit);
        self.streams.swap_remove(index);
    }

    /// The stream between two ends and which of its halves `from` is.
    fn find(&self, from: SocketAddrV4, to: SocketAddrV4) -> Option<(usize, usize)> {
        self.streams.iter().enumerate().find_map(|(index, stream)| {
            let [a, b] = stream.halves.map(|half| half.from);
            if (a, b) == (from, to) {
                Some((index, 0))
            } else if (b, a) == (from, to) {
                Some((index, 1))
            } else {
                None
            }
        })
    }

    fn segment(&mut self, index: usize, half: usize, flags: u8, payload: &[u8], emit: &mut dyn FnMut(&[u8])) {
        self.clock += 1;
        let stream = &mut self.streams[index];
        stream.used = self.clock;
        let (from, to) = (stream.halves[half].from, stream.halves[1 - half].from);
        let sequence = stream.halves[half].next;
        let acknowledge = if flags & ACK == 0 { 0 } else { stream.halves[1 - half].next };
        let control = u32::from(flags & (SYN | FIN) != 0);
        stream.halves[half].next =
            sequence.wrapping_add(u32::from(length(payload.len()))).wrapping_add(control);

        let mut header = [0; TCP_LEN];
        header[0..2].copy_from_slice(&from.port().to_be_bytes());
        header[2..4].copy_from_slice(&to.port().to_be_bytes());
        header[4..8].copy_from_slice(&sequence.to_be_bytes());
        header[8..12].copy_from_slice(&acknowledge.to_be_bytes());
        // Five words of header.
        header[12] = 5 << 4;
        header[13] = flags;
        header[14..16].copy_from_slice(&0xFFFF_u16.to_be_bytes());
        let checksum = transport_checksum(from, to, PROTOCOL_TCP, &header, payload);
        header[16..18].copy_from_slice(&checksum.to_be_bytes());
        self.frame(from, to, 0, PROTOCOL_TCP, &header, payload, emit);
    }

    #[allow(clippy::too_many_arguments, reason = "the parts of one frame, used in two places")]
    fn frame(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        tos: u8,
        protocol: u8,
        header: &[u8],
        payload: &[u8],
        emit: &mut dyn FnMut(&[u8]),
    ) {
        self.identification = self.identification.wrapping_add(1);
        let mut ip = [0; IPV4_LEN];
        // Version 4, five words of header.
        ip[0] = 0x45;
        ip[1] = tos;
        ip[2..4].copy_from_slice(&length(IPV4_LEN + header.len() + payload.len()).to_be_bytes());
        ip[4..6].copy_from_slice(&self.identification.to_be_bytes());
        // Do not fragment.
        ip[6] = 0x40;
        // Multicasts stay on their network.
        ip[8] = if to.ip().is_multicast() { 1 } else { 64 };
        ip[9] = protocol;
        ip[12..16].copy_from_slice(&from.ip().octets());
        ip[16..20].copy_from_slice(&to.ip().octets());
        let checksum = fold(sum(0, &ip));
        ip[10..12].copy_from_slice(&checksum.to_be_bytes());

        let mut frame = [0; FRAME_LEN];
        let mut at = 0;
        for part in [&mac(to)[..], &mac(from), &[0x08, 0x00], &ip, header, payload] {
            frame[at..at + part.len()].copy_from_slice(part);
            at += part.len();
        }
        emit(&frame[..at]);
    }
}

/// All lengths here are below 65536: payloads are bounded by a frame's length.
fn length(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}

fn mac(of: SocketAddrV4) -> [u8; 6] {
    let ip = of.ip();
    if ip.is_multicast() {
        // RFC 1112: the low 23 bits of the group.
        let [_, b, c, d] = ip.octets();
        return [0x01, 0x00, 0x5E, b & 0x7F, c, d];
    }
    if ip.is_broadcast() {
        return [0xFF; 6];
    }
    let [a, b, c, d] = ip.octets();
    [0x02, 0x00, a, b, c, d]
}

fn transport_checksum(
    from: SocketAddrV4,
    to: SocketAddrV4,
    protocol: u8,
    header: &[u8],
    payload: &[u8],
) -> u16 {
    let mut total = sum(0, &from.ip().octets());
    total = sum(total, &to.ip().octets());
    total = sum(total, &[0, protocol]);
    total = sum(total, &length(header.len() + payload.len()).to_be_bytes());
    total = sum(total, header);
    fold(sum(total, payload))
}

/// Adds 16-bit words; an odd last byte counts as the high half of one. Only the last part of a sum may be
/// odd.
fn sum(start: u32, bytes: &[u8]) -> u32 {
    bytes.chunks(2).fold(start, |total, pair| {
        let low = pair.get(1).copied().unwrap_or(0);
        total + u32::from(u16::from_be_bytes([pair[0], low]))
    })
}

fn fold(mut total: u32) -> u16 {
    while total > 0xFFFF {
        total = (total & 0xFFFF) + (total >> 16);
    }
    !u16::try_from(total).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use proptest::prelude::*;

    use super::*;

    fn at(last: u8, port: u16) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, last), port)
    }

    /// Sequence, acknowledge, flags and payload length of a TCP frame.
    fn tcp(frame: &[u8]) -> (u32, u32, u8, usize) {
        let number = |at: usize| u32::from_be_bytes(frame[at..at + 4].try_into().unwrap());
        (number(38), number(42), frame[47], frame.len() - 54)
    }

    fn collect(run: impl FnOnce(&mut dyn FnMut(&[u8]))) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        run(&mut |frame: &[u8]| frames.push(frame.to_vec()));
        frames
    }

    #[test]
    fn an_internet_header_has_the_known_checksum() {
        // The much used example: 4500 0073 0000 4000 4011 c0a8 0001 c0a8 00c7 has the sum b861.
        let header = [0x45, 0, 0, 0x73, 0, 0, 0x40, 0, 0x40, 0x11, 0, 0, 192, 168, 0, 1, 192, 168, 0, 199];
        assert_eq!(fold(sum(0, &header)), 0xB861);
    }

    #[test]
    fn a_stream_has_a_handshake_and_no_gaps() {
        let mut synth = Synthesizer::new();
        let (client, server) = (at(1, 50_000), at(2, 44_818));
        let open = collect(|emit| synth.tcp_open(client, server, emit));
        let [(s0, 0, SYN, 0), (t0, a1, 0x12, 0), (s1, a2, ACK, 0)] =
            open.iter().map(|f| tcp(f)).collect::<Vec<_>>()[..]
        else {
            panic!("{open:02x?}")
        };
        assert_eq!((a1, s1, a2), (s0 + 1, s0 + 1, t0.wrapping_add(1)));

        let request = collect(|emit| synth.tcp_data(client, server, &[1; 28], emit));
        assert_eq!(request.iter().map(|f| tcp(f)).collect::<Vec<_>>(), [(s1, a2, 0x18, 28)]);
        let reply = collect(|emit| synth.tcp_data(server, client, &[2; 3000], emit));
        assert_eq!(
            reply.iter().map(|f| tcp(f)).collect::<Vec<_>>(),
            [
                (a2, s1 + 28, 0x18, 1460),
                (a2.wrapping_add(1460), s1 + 28, 0x18, 1460),
                (a2.wrapping_add(2920), s1 + 28, 0x18, 80)
            ]
        );
        let close = collect(|emit| synth.tcp_close(server, client, emit));
        assert_eq!(
            close.iter().map(|f| tcp(f)).collect::<Vec<_>>(),
            [
                (a2.wrapping_add(3000), s1 + 28, 0x11, 0),
                (s1 + 28, a2.wrapping_add(3001), 0x11, 0),
                (a2.wrapping_add(3001), s1 + 29, ACK, 0)
            ]
        );
        assert!(collect(|emit| synth.tcp_close(server, client, emit)).is_empty());
    }

    #[test]
    fn a_stream_that_was_not_opened_is_opened_by_its_first_bytes() {
        let mut synth = Synthesizer::new();
        let frames = collect(|emit| synth.tcp_data(at(1, 1), at(2, 2), &[0; 4], emit));
        assert_eq!(frames.iter().map(|f| tcp(f).2).collect::<Vec<_>>(), [SYN, SYN | ACK, ACK, PSH | ACK]);
    }

    #[test]
    fn the_number_of_streams_is_bounded_and_the_most_silent_goes() {
        let mut synth = Synthesizer::new();
        for port in 1..=u16::try_from(STREAMS_MAX).unwrap() {
            synth.tcp_open(at(1, port), at(2, 44_818), &mut |_| ());
        }
        synth.tcp_data(at(2, 44_818), at(1, 1), &[0], &mut |_| ());
        synth.tcp_open(at(1, 1000), at(2, 44_818), &mut |_| ());
        assert_eq!(synth.streams.len(), STREAMS_MAX);
        assert!(synth.find(at(1, 1), at(2, 44_818)).is_some());
        assert!(synth.find(at(1, 2), at(2, 44_818)).is_none());
    }

    #[test]
    fn a_datagram_has_its_addresses_and_code_point() {
        let mut synth = Synthesizer::new();
        let to = SocketAddrV4::new(Ipv4Addr::new(239, 192, 1, 2), 2222);
        let frames = collect(|emit| synth.udp(at(1, 2222), to, 55 << 2, &[0xEE; 3], emit).unwrap());
        let frame = &frames[0];
        assert_eq!(frame[..14], [1, 0, 0x5E, 0x40, 1, 2, 2, 0, 192, 0, 2, 1, 8, 0]);
        assert_eq!((frame[15], frame.len()), (55 << 2, 45));
        assert_eq!(frame[34..40], [0x08, 0xAE, 0x08, 0xAE, 0, 11]);
        let refused = synth.udp(at(1, 1), to, 0, &[0; 1473], &mut |_| panic!("emitted"));
        assert_eq!(refused, Err(TooLong { len: 1473 }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A checksum is right when the sum over everything it covers, itself included, is all ones.
        #[test]
        fn checksums_verify(payload in proptest::collection::vec(any::<u8>(), 0..300), port: u16, udp: bool) {
            let mut synth = Synthesizer::new();
            let (from, to) = (at(1, port), at(2, 44_818));
            let frames = collect(|emit| {
                if udp {
                    synth.udp(from, to, 0, &payload, emit).unwrap();
                } else {
                    synth.tcp_data(from, to, &payload, emit);
                }
            });
            for frame in frames {
                prop_assert_eq!(fold(sum(0, &frame[14..34])), 0);
                let segment = &frame[34..];
                let length = u32::try_from(segment.len()).unwrap();
                let pseudo = sum(sum(0, &frame[26..34]), &[0, frame[23]]) + length;
                prop_assert_eq!(fold(sum(pseudo, segment)), 0);
            }
        }
    }
}
