//! Ethernet, IPv4, UDP and TCP headers, as far as they are needed to reach the payload.

use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::wire::encapsulation::IO_PORT;

const ETHERNET_LEN: usize = 14;
const VLAN_LEN: usize = 4;
/// Tags of a frame that are passed over: one, or two where a provider added its own.
const VLANS_MAX: usize = 2;

const ETHER_TYPE_IPV4: u16 = 0x0800;
const ETHER_TYPE_VLAN: u16 = 0x8100;
const ETHER_TYPE_VLAN_OUTER: u16 = 0x88A8;
const ETHER_TYPE_SERCOS: u16 = 0x88CD;

const PROTOCOL_TCP: u8 = 6;
const PROTOCOL_UDP: u8 = 17;

/// More fragments, and the fragment's offset.
const FRAGMENT: u16 = 0x3FFF;

/// A TCP segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Segment<'a> {
    pub from: SocketAddrV4,
    pub to: SocketAddrV4,
    pub sequence: u32,
    pub flags: u8,
    pub payload: &'a [u8],
}

/// What a frame carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Packet<'a> {
    Sercos,
    Udp {
        from: SocketAddrV4,
        to: SocketAddrV4,
        payload: &'a [u8],
    },
    /// The beginning of a UDP datagram, and in words what is missing.
    CutUdp {
        from: SocketAddrV4,
        to: SocketAddrV4,
        payload: &'a [u8],
        what: String,
    },
    Tcp(Segment<'a>),
    /// Something else, in words.
    Other(String),
}

/// Whether a datagram between these ends has data of a class 1 connection. They go to the I/O port, or from it to the port that
/// the originator has named in its Forward_Open.
pub(crate) const fn is_io(from: SocketAddrV4, to: SocketAddrV4) -> bool {
    from.port() == IO_PORT || to.port() == IO_PORT
}

/// Reads an Ethernet frame.
pub(crate) fn parse(frame: &[u8]) -> Packet<'_> {
    let Some(mut ether_type) = u16_at(frame, 12) else {
        return short("Ethernet header", ETHERNET_LEN, frame.len());
    };
    let mut at = ETHERNET_LEN;
    for _ in 0..VLANS_MAX {
        if ether_type != ETHER_TYPE_VLAN && ether_type != ETHER_TYPE_VLAN_OUTER {
            break;
        }
        let Some(inner) = u16_at(frame, at + 2) else {
            return short("VLAN tag", VLAN_LEN, frame.len() - at);
        };
        ether_type = inner;
        at += VLAN_LEN;
    }
    match ether_type {
        ETHER_TYPE_SERCOS if at == ETHERNET_LEN => Packet::Sercos,
        ETHER_TYPE_IPV4 => ipv4(&frame[at..]),
        0x0806 => Packet::Other("ARP, not decoded".to_owned()),
        0x86DD => Packet::Other("IPv6, not decoded".to_owned()),
        0x88F7 => Packet::Other("PTP, not decoded".to_owned()),
        0..0x0600 => Packet::Other(format!("IEEE 802.3 frame of {ether_type} bytes, not decoded")),
        other => Packet::Other(format!("EtherType {other:#06x}, not decoded")),
    }
}

fn ipv4(packet: &[u8]) -> Packet<'_> {
    let Some(header) = packet.get(..20) else { return short("IPv4 header", 20, packet.len()) };
    let header_len = usize::from(header[0] & 0x0F) * 4;
    let total_len = usize::from(u16::from_be_bytes([header[2], header[3]]));
    if header[0] >> 4 != 4 || header_len < 20 || total_len < header_len {
        return Packet::Other("IPv4 header with impossible version or lengths".to_owned());
    }
    let is_fragment = u16::from_be_bytes([header[6], header[7]]) & FRAGMENT != 0;
    let from = Ipv4Addr::new(header[12], header[13], header[14], header[15]);
    let to = Ipv4Addr::new(header[16], header[17], header[18], header[19]);
    // Ethernet fills short frames up: what is behind the packet is not of it.
    let Some(payload) = packet.get(header_len..total_len) else {
        let what = shortage("IPv4 packet", total_len, packet.len());
        return match packet.get(header_len..) {
            Some(beginning) if header[9] == PROTOCOL_UDP && !is_fragment => {
                cut_udp(from, to, beginning, what)
            }
            _ => Packet::Other(what),
        };
    };
    if is_fragment {
        return Packet::Other("IPv4 fragment, not decoded".to_owned());
    }
    match header[9] {
        PROTOCOL_UDP => udp(from, to, payload),
        PROTOCOL_TCP => tcp(from, to, payload),
        other => Packet::Other(format!("IPv4 {from} -> {to}, protocol {other}, not decoded")),
    }
}

fn udp(from: Ipv4Addr, to: Ipv4Addr, datagram: &[u8]) -> Packet<'_> {
    let Some(header) = datagram.get(..8) else { return short("UDP header", 8, datagram.len()) };
    let length = usize::from(u16::from_be_bytes([header[4], header[5]]));
    let Some(payload) = datagram.get(8..length) else {
        return cut_udp(from, to, datagram, shortage("UDP datagram", length.max(8), datagram.len()));
    };
    let (from, to) = ends(from, to, header);
    Packet::Udp { from, to, payload }
}

/// A datagram that is shorter than its headers say.
fn cut_udp(from: Ipv4Addr, to: Ipv4Addr, datagram: &[u8], what: String) -> Packet<'_> {
    let Some((header, payload)) = datagram.split_at_checked(8) else { return Packet::Other(what) };
    let (from, to) = ends(from, to, header);
    Packet::CutUdp { from, to, payload, what }
}

fn tcp(from: Ipv4Addr, to: Ipv4Addr, segment: &[u8]) -> Packet<'_> {
    let Some(header) = segment.get(..20) else { return short("TCP header", 20, segment.len()) };
    let header_len = usize::from(header[12] >> 4) * 4;
    let Some(payload) = segment.get(header_len..).filter(|_| header_len >= 20) else {
        return short("TCP header", header_len.max(20), segment.len());
    };
    let (from, to) = ends(from, to, header);
    let sequence = u32::from_be_bytes([header[4], header[5], header[6], header[7]]);
    Packet::Tcp(Segment { from, to, sequence, flags: header[13], payload })
}

/// UDP and TCP both begin with the two ports.
fn ends(from: Ipv4Addr, to: Ipv4Addr, header: &[u8]) -> (SocketAddrV4, SocketAddrV4) {
    let port = |at: usize| u16::from_be_bytes([header[at], header[at + 1]]);
    (SocketAddrV4::new(from, port(0)), SocketAddrV4::new(to, port(2)))
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}

fn short(what: &str, expected: usize, found: usize) -> Packet<'static> {
    Packet::Other(shortage(what, expected, found))
}

fn shortage(what: &str, expected: usize, found: usize) -> String {
    format!("{what}: expected {expected} bytes, found {found}")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::capture::synth::Synthesizer;

    const A: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2222);
    const B: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 44_818);

    fn udp_frame() -> Vec<u8> {
        let mut frames = Vec::new();
        Synthesizer::new().udp(A, B, 0, &[1, 2, 3], &mut |frame| frames.push(frame.to_vec())).unwrap();
        frames.remove(0)
    }

    fn other(frame: &[u8]) -> String {
        match parse(frame) {
            Packet::Other(what) | Packet::CutUdp { what, .. } => what,
            known => panic!("{known:?}"),
        }
    }

    #[test]
    fn payloads_are_found_behind_tags_and_before_padding() {
        let expected = Packet::Udp { from: A, to: B, payload: &[1, 2, 3] };
        let mut frame = udp_frame();
        assert_eq!(parse(&frame), expected);
        frame.extend([0xEE; 15]);
        assert_eq!(parse(&frame), expected);
        frame.splice(12..12, [0x81, 0x00, 0xE0, 0x05]);
        assert_eq!(parse(&frame), expected);
        frame.splice(12..12, [0x88, 0xA8, 0xE0, 0x05]);
        assert_eq!(parse(&frame), expected);
    }

    #[test]
    fn what_is_not_decoded_is_named() {
        let mut frame = udp_frame();
        frame[20] = 0x20;
        assert_eq!(other(&frame), "IPv4 fragment, not decoded");
        frame[20] = 0;
        frame[23] = 1;
        assert_eq!(other(&frame), "IPv4 192.0.2.1 -> 192.0.2.2, protocol 1, not decoded");
        frame[14] = 0x65;
        assert_eq!(other(&frame), "IPv4 header with impossible version or lengths");
        frame[12..14].copy_from_slice(&[0x08, 0x06]);
        assert_eq!(other(&frame), "ARP, not decoded");
        frame[12..14].copy_from_slice(&[0x88, 0xCC]);
        assert_eq!(other(&frame), "EtherType 0x88cc, not decoded");
        frame[12..14].copy_from_slice(&[0x00, 0x26]);
        assert_eq!(other(&frame), "IEEE 802.3 frame of 38 bytes, not decoded");
    }

    #[test]
    fn a_frame_cut_anywhere_is_named() {
        let frame = udp_frame();
        for length in 0..frame.len() {
            let what = other(&frame[..length]);
            assert!(what.contains("expected") && what.contains("found"), "{length}: {what}");
            // Behind the ports it is known whose datagram it is.
            let is_known = matches!(parse(&frame[..length]), Packet::CutUdp { from: A, to: B, .. });
            assert_eq!(is_known, length >= 42, "{length}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..80), tcp: bool) {
            parse(&bytes);
            let mut frame = udp_frame();
            frame.truncate(14);
            frame.extend(&bytes);
            if tcp && frame.len() > 23 {
                frame[14] = 0x45;
                frame[23] = PROTOCOL_TCP;
            }
            parse(&frame);
        }
    }
}
