use super::Encoding::{Packed, Padded};
use super::*;
use profile_generic::wire::Expected;
use proptest::prelude::*;

fn read_all(bytes: &[u8], encoding: Encoding) -> Result<Vec<Segment<'_>>, Error> {
    segments(bytes, encoding).collect()
}

fn logical(kind: LogicalType, value: LogicalValue) -> Segment<'static> {
    Segment::Logical { kind, value }
}

#[test]
fn vectors_both_ways() {
    let key = ElectronicKey {
        vendor: 1,
        device_type: 0x25,
        product_code: 0x0102,
        compatible: true,
        major: 2,
        minor: 3,
    };
    let vectors: &[(&str, Encoding, &[u8], &[Segment<'_>])] = &[
        (
            "motion path of Volume 9 clause 7-1.1, configuration block revision 1",
            Padded,
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 4, 1, 1, 0, 0, 9, 8, 7, 6],
            &[
                Segment::class(0x42),
                Segment::connection_point(0x51),
                Segment::connection_point(2),
                Segment::Data(&[1, 1, 0, 0, 9, 8, 7, 6]),
            ],
        ),
        (
            "16-bit class, 32-bit instance, 16-bit attribute",
            Padded,
            &[0x21, 0, 0x34, 0x12, 0x26, 0, 4, 3, 2, 1, 0x31, 0, 0xB9, 1],
            &[
                Segment::class(0x1234),
                logical(LogicalType::INSTANCE, LogicalValue::U32(0x0102_0304)),
                Segment::attribute(441),
            ],
        ),
        (
            "the same, packed",
            Packed,
            &[0x21, 0x34, 0x12, 0x26, 4, 3, 2, 1, 0x31, 0xB9, 1],
            &[
                Segment::class(0x1234),
                logical(LogicalType::INSTANCE, LogicalValue::U32(0x0102_0304)),
                Segment::attribute(441),
            ],
        ),
        (
            "electronic key",
            Padded,
            &[0x34, 4, 1, 0, 0x25, 0, 2, 1, 0x82, 3, 0x20, 6],
            &[Segment::Key(key), Segment::class(6)],
        ),
        (
            "ports: slot, IPv4 text of even and odd length, extended port",
            Padded,
            &[
                0x01, 0x00, 0x12, 8, b'1', b'0', b'.', b'0', b'.', b'0', b'.', b'9', 0x12, 3, b'a', b'b',
                b'c', 0, 0x0F, 0x10, 0x00, 7,
            ],
            &[
                Segment::Port { port: 1, link: &[0] },
                Segment::Port { port: 2, link: b"10.0.0.9" },
                Segment::Port { port: 2, link: b"abc" },
                Segment::Port { port: 16, link: &[7] },
            ],
        ),
        (
            "symbols, network segments, member and service",
            Padded,
            &[
                0x91, 3, b'T', b'a', b'g', 0, 0x63, b'a', b'b', b'c', 0x62, b'x', b'y', 0, 0x43, 5, 0x51, 2,
                1, 2, 3, 4, 0x28, 1, 0x38, 0x0E,
            ],
            &[
                Segment::ExtendedSymbol(b"Tag"),
                Segment::Symbol(b"abc"),
                Segment::Symbol(b"xy"),
                Segment::Network { subtype: 3, data: &[5] },
                Segment::Network { subtype: 0x11, data: &[1, 2, 3, 4] },
                logical(LogicalType::MEMBER, LogicalValue::U8(1)),
                logical(LogicalType::SERVICE, LogicalValue::U8(0x0E)),
            ],
        ),
    ];
    for (name, encoding, bytes, path) in vectors {
        assert_eq!(read_all(bytes, *encoding).as_deref(), Ok(*path), "{name}");
        assert_eq!(path_len(path, *encoding), bytes.len(), "{name}");
        let mut buffer = vec![0xA5; bytes.len() + 2];
        assert_eq!(emit_path(path, *encoding, &mut buffer), Ok(bytes.len()), "{name}");
        assert_eq!(&buffer[..bytes.len()], *bytes, "{name}");
        assert_eq!(&buffer[bytes.len()..], [0xA5; 2], "{name}");
        for room in 0..bytes.len() {
            assert!(emit_path(path, *encoding, &mut buffer[..room]).is_err(), "{name} into {room}");
            // A cut at a segment border is a shorter path, never the whole one.
            assert_ne!(read_all(&bytes[..room], *encoding).as_deref(), Ok(*path), "{name} cut at {room}");
        }
    }
}

#[test]
fn every_single_segment_is_refused_when_cut() {
    for bytes in [
        &[0x20, 0x42][..],
        &[0x25, 0, 1, 0],
        &[0x26, 0, 1, 0, 0, 0],
        &[0x34, 4, 1, 0, 0x25, 0, 1, 0, 1, 0],
        &[0x12, 3, b'a', b'b', b'c', 0],
        &[0x91, 3, b'a', b'b', b'c', 0],
        &[0x62, b'a', b'b', 0],
        &[0x80, 2, 1, 2, 3, 4],
        &[0x51, 1, 1, 2],
        &[0x43, 1],
    ] {
        assert_eq!(read_all(bytes, Padded).map(|path| path.len()), Ok(1));
        for cut in 1..bytes.len() {
            assert!(
                matches!(read_all(&bytes[..cut], Padded), Err(Error { expected: Expected::Bytes(_), .. })),
                "{bytes:02x?} cut at {cut}"
            );
        }
    }
}

#[test]
fn a_data_segment_longer_than_its_path_says_how_long() {
    assert_eq!(
        read_all(&[0x20, 6, 0x80, 0xFF, 0, 0], Padded),
        Err(Error::truncated("data segment", 4, 510, 2))
    );
}

#[test]
fn reserved_and_unsupported_segments_are_refused_where_they_stand() {
    for (bytes, what) in [
        (&[0x20, 1, 0x23, 0][..], "logical format"),
        (&[0x20, 1, 0x3C, 1], "logical segment"),
        (&[0x20, 1, 0x35, 1], "logical segment"),
        (&[0x20, 1, 0x39, 0, 1, 0], "service segment format"),
        (&[0x20, 1, 0x60, 1], "segment type"),
        (&[0x20, 1, 0x81, 0], "segment type"),
        (&[0x20, 1, 0xA0, 0], "segment type"),
        (&[0x20, 1, 0xE0, 0], "segment type"),
        (&[0x20, 1, 0x00, 0], "port"),
        // Port 0 is reserved however it is written.
        (&[0x20, 1, 0x0F, 0, 0, 8], "extended port"),
    ] {
        let found = u32::from(bytes[2]);
        let error = Error::invalid(what, 2, 0x20, found);
        let mut walk = segments(bytes, Padded);
        assert_eq!(walk.next(), Some(Ok(Segment::class(1))));
        assert_eq!(walk.next(), Some(Err(error)));
        assert_eq!(walk.next(), None, "stops behind the fault");
    }
    assert_eq!(
        read_all(&[0x34, 5, 0, 0, 0, 0, 0, 0, 0, 0], Padded),
        Err(Error::invalid("electronic key format", 1, 4, 5))
    );
}

#[test]
fn values_a_segment_cannot_carry_are_not_emitted() {
    let mut buffer = [0; 1024];
    let long = [0; 512];
    for segment in [
        Segment::Data(&long),
        Segment::Data(&long[..3]),
        Segment::ExtendedSymbol(&long[..256]),
        Segment::Symbol(&long[..32]),
        Segment::Symbol(&[]),
        Segment::Port { port: 0, link: &[1] },
        Segment::Network { subtype: 3, data: &[1, 2] },
        Segment::Network { subtype: 0x20, data: &[1] },
        logical(LogicalType(5), LogicalValue::U8(0)),
        logical(LogicalType(9), LogicalValue::U8(0)),
        logical(LogicalType::SERVICE, LogicalValue::U16(0)),
        Segment::Key(ElectronicKey { major: 0x80, ..ElectronicKey::default() }),
    ] {
        assert!(emit_path(&[segment], Padded, &mut buffer).is_err(), "{segment:?}");
    }
}

#[test]
fn display_reads_like_a_path() {
    let path = [0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 1, 0, 0, 0x12, 2, b'a', b'b'];
    let text: Vec<_> = segments(&path, Padded).map(|segment| segment.unwrap().to_string()).collect();
    assert_eq!(
        text.join(", "),
        "class 0x42, connection point 0x51, connection point 0x2, data of 2 bytes, port 2 link \"ab\""
    );
}

#[derive(Debug, Clone)]
enum Plan {
    Port(u16, Vec<u8>),
    Logical(u8, u8, u32),
    Key(u16, u16, u16, bool, u8, u8),
    Network(u8, Vec<u8>),
    Symbol(Vec<u8>),
    ExtendedSymbol(Vec<u8>),
    Data(Vec<u8>),
}

impl Plan {
    fn segment(&self) -> Segment<'_> {
        match *self {
            Plan::Port(port, ref link) => Segment::Port { port, link },
            Plan::Logical(kind, width, value) => {
                let [low, high, ..] = value.to_le_bytes();
                let value = match width {
                    0 => LogicalValue::U8(low),
                    1 => LogicalValue::U16(u16::from_le_bytes([low, high])),
                    _ => LogicalValue::U32(value),
                };
                logical(LogicalType(kind), value)
            }
            Plan::Key(vendor, device_type, product_code, compatible, major, minor) => {
                Segment::Key(ElectronicKey { vendor, device_type, product_code, compatible, major, minor })
            }
            Plan::Network(subtype, ref data) => Segment::Network { subtype, data },
            Plan::Symbol(ref text) => Segment::Symbol(text),
            Plan::ExtendedSymbol(ref text) => Segment::ExtendedSymbol(text),
            Plan::Data(ref data) => Segment::Data(data),
        }
    }
}

fn bytes(range: core::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), range)
}

fn plan() -> impl Strategy<Value = Plan> {
    prop_oneof![
        (1u16.., bytes(0..12)).prop_map(|(port, link)| Plan::Port(port, link)),
        (0u8..5, 0u8..3, any::<u32>()).prop_map(|(kind, width, value)| Plan::Logical(kind, width, value)),
        any::<u8>().prop_map(|value| Plan::Logical(6, 0, u32::from(value))),
        (any::<u16>(), any::<u16>(), any::<u16>(), any::<bool>(), 0u8..128, any::<u8>())
            .prop_map(|(v, t, p, c, major, minor)| Plan::Key(v, t, p, c, major, minor)),
        (0u8..16, bytes(1..2)).prop_map(|(subtype, data)| Plan::Network(subtype, data)),
        (16u8..32, bytes(0..5))
            .prop_map(|(subtype, data)| Plan::Network(subtype, [data.clone(), data].concat())),
        bytes(1..32).prop_map(Plan::Symbol),
        bytes(0..40).prop_map(Plan::ExtendedSymbol),
        bytes(0..20).prop_map(|data| Plan::Data([data.clone(), data].concat())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn round_trip(plans in prop::collection::vec(plan(), 0..6), padded: bool) {
        let encoding = if padded { Padded } else { Packed };
        let path: Vec<_> = plans.iter().map(Plan::segment).collect();
        let mut buffer = vec![0xA5; path_len(&path, encoding)];
        prop_assert_eq!(emit_path(&path, encoding, &mut buffer), Ok(buffer.len()));
        prop_assert_eq!(read_all(&buffer, encoding), Ok(path));
        if padded { prop_assert_eq!(buffer.len() % 2, 0); }
    }

    #[test]
    fn any_bytes_end(bytes in prop::collection::vec(any::<u8>(), 0..64), padded: bool) {
        let encoding = if padded { Padded } else { Packed };
        prop_assert!(segments(&bytes, encoding).count() <= bytes.len());
    }
}
