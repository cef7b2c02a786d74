use proptest::prelude::*;

use super::*;

const fn mux(index: u16, sub: u8) -> Mux {
    Mux::new(index, sub)
}

fn expedited(data: &[u8]) -> Transfer {
    Transfer::expedited(data).unwrap()
}

fn segment(toggle: bool, data: &[u8], last: bool) -> Segment {
    Segment { toggle, data: Bytes::new(data).unwrap(), last }
}

#[test]
fn requests_both_ways() {
    use SdoRequest as R;
    // canopen tests: test_sdo, unless said otherwise.
    let vectors: [([u8; 8], R, &str); 19] = [
        ([0x40, 0x18, 0x10, 1, 0, 0, 0, 0], R::Upload(mux(0x1018, 1)), "SDO upload 1018:01"),
        (
            [0x2B, 0x17, 0x10, 0, 0xA0, 0x0F, 0, 0],
            R::Download(mux(0x1017, 0), expedited(&[0xA0, 0x0F])),
            "SDO download 1017:00: A0 0F",
        ),
        // The other lengths by the facts that four stacks agree on.
        (
            [0x2F, 0x60, 0x60, 0, 8, 0, 0, 0],
            R::Download(mux(0x6060, 0), expedited(&[8])),
            "SDO download 6060:00: 08",
        ),
        (
            [0x27, 0, 0x20, 0, 1, 2, 3, 0],
            R::Download(mux(0x2000, 0), expedited(&[1, 2, 3])),
            "SDO download 2000:00: 01 02 03",
        ),
        (
            [0x23, 0, 0x14, 1, 1, 2, 0, 0x80],
            R::Download(mux(0x1400, 1), expedited(&[1, 2, 0, 0x80])),
            "SDO download 1400:01: 01 02 00 80",
        ),
        (
            [0x22, 0, 0x14, 1, 1, 2, 0, 0x80],
            R::Download(
                mux(0x1400, 1),
                Transfer::Expedited { data: Bytes::new(&[1, 2, 0, 0x80]).unwrap(), sized: false },
            ),
            "SDO download 1400:01: 01 02 00 80 or less",
        ),
        (
            [0x21, 0, 0x20, 0, 0x0D, 0, 0, 0],
            R::Download(mux(0x2000, 0), Transfer::Segmented { size: Some(13) }),
            "SDO download 2000:00: 13 bytes in segments",
        ),
        (
            [0x20, 0, 0x20, 0, 0, 0, 0, 0],
            R::Download(mux(0x2000, 0), Transfer::Segmented { size: None }),
            "SDO download 2000:00: segments",
        ),
        (
            [0x00, 0x41, 0x20, 0x6C, 0x6F, 0x6E, 0x67, 0x20],
            R::DownloadSegment(segment(false, b"A long ", false)),
            "SDO download segment t0: 41 20 6C 6F 6E 67 20",
        ),
        (
            [0x13, 0x73, 0x74, 0x72, 0x69, 0x6E, 0x67, 0],
            R::DownloadSegment(segment(true, b"string", true)),
            "SDO download segment t1 last: 73 74 72 69 6E 67",
        ),
        (
            [0x0F, 0, 0, 0, 0, 0, 0, 0],
            R::DownloadSegment(segment(false, b"", true)),
            "SDO download segment t0 last: ",
        ),
        ([0x70, 0, 0, 0, 0, 0, 0, 0], R::UploadSegment { toggle: true }, "SDO upload segment t1"),
        (
            [0xC6, 0, 0x20, 0, 0x1E, 0, 0, 0],
            R::BlockDownload { mux: mux(0x2000, 0), crc: true, size: Some(30) },
            "SDO block download 2000:00, 30 bytes, CRC",
        ),
        (
            [0xD5, 0x45, 0x69, 0, 0, 0, 0, 0],
            R::EndBlockDownload { unused: 5, crc: 0x6945 },
            "SDO block download end, 5 bytes unused, CRC 6945",
        ),
        (
            [0xA4, 0x08, 0x10, 0, 0x7F, 0, 0, 0],
            R::BlockUpload { mux: mux(0x1008, 0), crc: true, block_size: 127, switch_threshold: 0 },
            "SDO block upload 1008:00, blocks of 127, switch at 0, CRC",
        ),
        ([0xA3, 0, 0, 0, 0, 0, 0, 0], R::StartBlockUpload, "SDO block upload start"),
        (
            [0xA2, 4, 0x7F, 0, 0, 0, 0, 0],
            R::BlockReceived { acknowledged: 4, block_size: 127 },
            "SDO block upload received to 4, next blocks of 127",
        ),
        ([0xA1, 0, 0, 0, 0, 0, 0, 0], R::EndBlockUpload, "SDO block upload end"),
        (
            [0x80, 0x18, 0x10, 1, 0, 0, 4, 5],
            R::Abort(Abort { mux: mux(0x1018, 1), code: AbortCode::TIMEOUT }),
            "SDO client abort 1018:01: 05040000 SDO protocol timed out",
        ),
    ];
    for (bytes, value, text) in vectors {
        assert_eq!(R::parse(&bytes), Ok(value));
        assert_eq!((value.emit(), value.to_string()), (bytes, text.to_string()));
    }
}

#[test]
fn responses_both_ways() {
    use SdoResponse as R;
    // canopen tests: test_sdo.
    let vectors: [([u8; 8], R, &str); 14] = [
        (
            [0x43, 0x18, 0x10, 1, 4, 0, 0, 0],
            R::Upload(mux(0x1018, 1), expedited(&[4, 0, 0, 0])),
            "SDO uploaded 1018:01: 04 00 00 00",
        ),
        (
            [0x4F, 0, 0x14, 2, 0xFE, 0, 0, 0],
            R::Upload(mux(0x1400, 2), expedited(&[0xFE])),
            "SDO uploaded 1400:02: FE",
        ),
        (
            [0x42, 0, 0x14, 2, 0xFE, 0, 0, 0],
            R::Upload(
                mux(0x1400, 2),
                Transfer::Expedited { data: Bytes::new(&[0xFE, 0, 0, 0]).unwrap(), sized: false },
            ),
            "SDO uploaded 1400:02: FE 00 00 00 or less",
        ),
        (
            [0x41, 0x08, 0x10, 0, 0x1A, 0, 0, 0],
            R::Upload(mux(0x1008, 0), Transfer::Segmented { size: Some(26) }),
            "SDO uploaded 1008:00: 26 bytes in segments",
        ),
        (
            [0x00, 0x54, 0x69, 0x6E, 0x79, 0x20, 0x4E, 0x6F],
            R::UploadSegment(segment(false, b"Tiny No", false)),
            "SDO uploaded segment t0: 54 69 6E 79 20 4E 6F",
        ),
        (
            [0x15, 0x69, 0x6E, 0x73, 0x20, 0x21, 0, 0],
            R::UploadSegment(segment(true, b"ins !", true)),
            "SDO uploaded segment t1 last: 69 6E 73 20 21",
        ),
        ([0x60, 0x17, 0x10, 0, 0, 0, 0, 0], R::Download(mux(0x1017, 0)), "SDO downloaded 1017:00"),
        ([0x30, 0, 0, 0, 0, 0, 0, 0], R::DownloadSegment { toggle: true }, "SDO downloaded segment t1"),
        (
            [0xA4, 0, 0x20, 0, 0x7F, 0, 0, 0],
            R::BlockDownload { mux: mux(0x2000, 0), crc: true, block_size: 127 },
            "SDO block download of 2000:00, blocks of 127, CRC",
        ),
        (
            [0xA2, 5, 0x7F, 0, 0, 0, 0, 0],
            R::BlockReceived { acknowledged: 5, block_size: 127 },
            "SDO block download received to 5, next blocks of 127",
        ),
        ([0xA1, 0, 0, 0, 0, 0, 0, 0], R::EndBlockDownload, "SDO block download ended"),
        (
            [0xC6, 0x08, 0x10, 0, 0x1A, 0, 0, 0],
            R::BlockUpload { mux: mux(0x1008, 0), crc: true, size: Some(26) },
            "SDO block upload of 1008:00, 26 bytes, CRC",
        ),
        (
            [0xC9, 0x40, 0xE1, 0, 0, 0, 0, 0],
            R::EndBlockUpload { unused: 2, crc: 0xE140 },
            "SDO block upload ended, 2 bytes unused, CRC E140",
        ),
        (
            [0x80, 0x18, 0x10, 1, 0x11, 0, 9, 6],
            R::Abort(Abort { mux: mux(0x1018, 1), code: AbortCode::NO_SUB_INDEX }),
            "SDO server abort 1018:01: 06090011 sub-index does not exist",
        ),
    ];
    for (bytes, value, text) in vectors {
        assert_eq!(R::parse(&bytes), Ok(value));
        assert_eq!((value.emit(), value.to_string()), (bytes, text.to_string()));
    }
}

#[test]
fn block_segments_both_ways() {
    // canopen tests: test_sdo.
    let bytes = [0x84, 0x69, 0x6E, 0x73, 0x20, 0x21, 0, 0];
    let value = BlockSegment { sequence: 4, last: true, data: *b"ins !\0\0" };
    assert_eq!((BlockSegment::parse(&bytes), value.emit()), (Ok(value), bytes));
    assert_eq!(value.to_string(), "block segment 4 last: 69 6E 73 20 21 00 00");
    // An abort is no segment.
    let error = BlockSegment::parse(&[0x80, 0, 0, 0, 0, 0, 0, 0]).unwrap_err();
    assert_eq!(error.to_string(), "sequence number: expected 1 to 127, got 0x0");
}

#[test]
fn the_crc_is_that_of_the_recorded_transfers() {
    // canopen tests: test_sdo; the last is the check value of CRC-16/XMODEM.
    assert_eq!(crc16(0, b"A really really long string..."), 0x6945);
    assert_eq!(crc16(0, b"Tiny Node - Mega Domains !"), 0xE140);
    assert_eq!(crc16(crc16(0, b"12345"), b"6789"), 0x31C3);
}

#[test]
fn wrong_lengths_and_unknown_commands_are_named() {
    for len in (0..16).filter(|&len| len != SDO_LEN) {
        let bytes = &[0x80; 16][..len];
        let error = |what| Error::length(what, 8, len);
        assert_eq!(SdoRequest::parse(bytes), Err(error("SDO request")));
        assert_eq!(SdoResponse::parse(bytes), Err(error("SDO response")));
        assert_eq!(BlockSegment::parse(bytes), Err(error("SDO block segment")));
        assert_eq!(Abort::parse(bytes), None);
    }
    let known = |parse: fn(&[u8]) -> bool| {
        let unknown = (0..=255).filter(|&first| !parse(&[first, 0, 0, 0, 0, 0, 0, 0]));
        unknown.collect::<Vec<u8>>()
    };
    assert_eq!(known(|bytes| SdoRequest::parse(bytes).is_ok()), (0xE0..=0xFF).collect::<Vec<_>>());
    let responses = (0xA0..=0xBF).filter(|first| first & 3 == 3).chain(0xE0..=0xFF);
    assert_eq!(known(|bytes| SdoResponse::parse(bytes).is_ok()), responses.collect::<Vec<_>>());
    let error = SdoRequest::parse(&[0xE0; 8]).unwrap_err().to_string();
    assert_eq!(error, "SDO request: expected a known command specifier, got 0xe0");
}

proptest! {
    #[test]
    fn round_trips(bytes: [u8; 8]) {
        if let Ok(value) = SdoRequest::parse(&bytes) {
            prop_assert_eq!(SdoRequest::parse(&value.emit()), Ok(value));
        }
        if let Ok(value) = SdoResponse::parse(&bytes) {
            prop_assert_eq!(SdoResponse::parse(&value.emit()), Ok(value));
        }
        if let Ok(value) = BlockSegment::parse(&bytes) {
            prop_assert_eq!(value.emit(), bytes);
        }
        if let Some(value) = Abort::parse(&bytes) {
            prop_assert_eq!(value.emit(), bytes);
        }
    }
}
