//! Transfers as they stand in the tests of the Python package `canopen` (test_sdo), which has most of them from a maker of
//! CANopen tools.

use super::*;
use crate::wire::sdo::{SdoRequest as Request, SdoResponse as Response};

const UPLOAD: &[&str] = &[
    "> 40 08 10 00 00 00 00 00",
    "< 41 08 10 00 1A 00 00 00",
    "> 60 00 00 00 00 00 00 00",
    "< 00 54 69 6E 79 20 4E 6F",
    "> 70 00 00 00 00 00 00 00",
    "< 10 64 65 20 2D 20 4D 65",
    "> 60 00 00 00 00 00 00 00",
    "< 00 67 61 20 44 6F 6D 61",
    "> 70 00 00 00 00 00 00 00",
    "< 15 69 6E 73 20 21 00 00",
];

const DOWNLOAD: &[&str] = &[
    "> 21 00 20 00 0D 00 00 00",
    "< 60 00 20 00 00 00 00 00",
    "> 00 41 20 6C 6F 6E 67 20",
    "< 20 00 20 00 00 00 00 00",
    "> 13 73 74 72 69 6E 67 00",
    "< 30 00 20 00 00 00 00 00",
];

const BLOCK_DOWNLOAD: &[&str] = &[
    "> C6 00 20 00 1E 00 00 00",
    "< A4 00 20 00 7F 00 00 00",
    "> 01 41 20 72 65 61 6C 6C",
    "> 02 79 20 72 65 61 6C 6C",
    "> 03 79 20 6C 6F 6E 67 20",
    "> 04 73 74 72 69 6E 67 2E",
    "> 85 2E 2E 00 00 00 00 00",
    "< A2 05 7F 00 00 00 00 00",
    "> D5 45 69 00 00 00 00 00",
    "< A1 00 00 00 00 00 00 00",
];

const BLOCK_UPLOAD: &[&str] = &[
    "> A4 08 10 00 7F 00 00 00",
    "< C6 08 10 00 1A 00 00 00",
    "> A3 00 00 00 00 00 00 00",
    "< 01 54 69 6E 79 20 4E 6F",
    "< 02 64 65 20 2D 20 4D 65",
    "< 03 67 61 20 44 6F 6D 61",
    "< 84 69 6E 73 20 21 00 00",
    "> A2 04 7F 00 00 00 00 00",
    "< C9 40 E1 00 00 00 00 00",
    "> A1 00 00 00 00 00 00 00",
];

/// The client sends what the recorded client sent, and takes what the recorded server answered.
fn play_client(frames: &[&str], request: SdoRequest) -> SdoOutcome {
    let mut client = Client::new(ClientConfig::default());
    client.start(ms(0), request).unwrap();
    for (place, line) in frames.iter().enumerate() {
        let (way, bytes) = line.split_at(2);
        if way == "> " {
            assert_eq!(client.poll(ms(1)), Some(hex(bytes)), "frame {place}");
        } else {
            assert_eq!(client.handle(ms(1), &hex(bytes)), Ok(true), "frame {place}");
        }
    }
    assert_eq!(client.poll(ms(1)), None);
    client.take_outcome().unwrap()
}

/// The server answers what the recorded server answered; bytes that are reserved may differ.
fn play_server(frames: &[&str]) -> Store {
    let (mut server, mut store) = (Server::new(ServerConfig::default()), Store::default());
    let mut in_block = false;
    for (place, line) in frames.iter().enumerate() {
        let (way, bytes) = line.split_at(2);
        if way == "> " {
            server.handle(ms(1), &hex(bytes), &mut store).unwrap();
            in_block = Request::parse(&hex(bytes)) == Ok(Request::StartBlockUpload);
        } else {
            let answer = server.poll(ms(1)).unwrap();
            if in_block {
                assert_eq!(answer, hex(bytes), "frame {place}");
            } else {
                assert_eq!(Response::parse(&answer), Response::parse(&hex(bytes)), "frame {place}");
            }
        }
    }
    assert_eq!((server.poll(ms(1)), server.state()), (None, ServerState::Idle));
    store
}

#[test]
fn uploads() {
    for (frames, method) in [(UPLOAD, Method::Segments), (BLOCK_UPLOAD, Method::Blocks)] {
        let outcome = play_client(frames, SdoRequest::upload(NAME).by(method));
        assert_eq!((outcome.result, outcome.data.as_slice()), (Ok(()), &b"Tiny Node - Mega Domains !"[..]));
        play_server(frames);
    }
}

#[test]
fn downloads() {
    let cases = [
        (DOWNLOAD, Method::Segments, &b"A long string"[..]),
        (BLOCK_DOWNLOAD, Method::Blocks, b"A really really long string..."),
    ];
    for (frames, method, value) in cases {
        let outcome = play_client(frames, SdoRequest::download(TEXT, text(value)).by(method));
        assert_eq!(outcome.result, Ok(()));
        let store = play_server(frames);
        assert_eq!((store.values[&TEXT].as_slice(), store.writes), (value, 1));
    }
}

#[test]
fn a_download_without_a_size_and_with_an_empty_end() {
    // Written piece by piece; the answer to the second segment has the toggle bit of the segment.
    let store = play_server(&[
        "> 20 00 20 00 00 00 00 00",
        "< 60 00 20 00 00 00 00 00",
        "> 00 31 32 33 34 35 36 37",
        "< 20 00 20 00 00 00 00 00",
        "> 1A 38 39 00 00 00 00 00",
        "< 30 00 20 00 00 00 00 00",
        "> 0F 00 00 00 00 00 00 00",
        "< 20 00 20 00 00 00 00 00",
    ]);
    assert_eq!(store.values[&TEXT], b"123456789");
}

#[test]
fn an_upload_that_is_refused() {
    let frames = ["> 40 18 10 01 00 00 00 00", "< 80 18 10 01 11 00 09 06"];
    let outcome = play_client(&frames, SdoRequest::upload(Mux::VENDOR));
    assert_eq!(outcome.result, Err(SdoFailure::Refused(AbortCode::NO_SUB_INDEX)));
    assert_eq!(outcome.to_string(), "read 1018:01: refused with 06090011: sub-index does not exist");
}
