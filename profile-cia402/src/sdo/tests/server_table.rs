//! Every state of the server with every kind of frame.

use super::*;
use crate::wire::sdo::{SdoRequest as Request, SdoResponse as Response};

/// How to bring a server into a state.
const STATES: [(ServerState, &[&str]); 8] = [
    (ServerState::Idle, &[]),
    (ServerState::Download, &["21 00 20 00 0E 00 00 00"]),
    (ServerState::Upload, &["40 08 10 00 00 00 00 00"]),
    (ServerState::BlockDownload, &["C6 00 20 00 0E 00 00 00"]),
    (
        ServerState::BlockDownloadEnd,
        &["C6 00 20 00 0E 00 00 00", "01 31 32 33 34 35 36 37", "82 31 32 33 34 35 36 37"],
    ),
    (ServerState::BlockUploadReady, &["A4 08 10 00 02 00 00 00"]),
    (ServerState::BlockUpload, &["A4 08 10 00 02 00 00 00", "A3 00 00 00 00 00 00 00"]),
    (
        ServerState::BlockUploadEnd,
        &[
            "A4 08 10 00 02 00 00 00",
            "A3 00 00 00 00 00 00 00",
            "A2 02 02 00 00 00 00 00",
            "A2 02 02 00 00 00 00 00",
        ],
    ),
];

const FRAMES: [(&str, &str); 24] = [
    ("download, expedited", "23 00 20 01 09 08 07 06"),
    ("download, expedited, size not told", "22 00 20 01 09 08 07 06"),
    ("download, too short", "2F 00 20 01 09 00 00 00"),
    ("download, segments", "21 00 20 00 0E 00 00 00"),
    ("download, too many bytes", "21 00 20 00 FF FF FF FF"),
    ("download, read-only", "23 08 10 00 09 08 07 06"),
    ("download, no such object", "23 FF 5F 00 09 08 07 06"),
    ("download segment", "00 31 32 33 34 35 36 37"),
    ("download segment, wrong toggle", "10 31 32 33 34 35 36 37"),
    ("download segment, last too soon", "01 31 32 33 34 35 36 37"),
    ("upload, expedited", "40 00 20 01 00 00 00 00"),
    ("upload, segments", "40 08 10 00 00 00 00 00"),
    ("upload, write-only", "40 10 10 01 00 00 00 00"),
    ("upload segment", "60 00 00 00 00 00 00 00"),
    ("upload segment, wrong toggle", "70 00 00 00 00 00 00 00"),
    ("abort", "80 00 20 00 00 00 04 05"),
    ("block download", "C6 00 20 00 0E 00 00 00"),
    ("end of block download", "C1 5F A5 00 00 00 00 00"),
    ("end of block download, wrong CRC", "C1 00 00 00 00 00 00 00"),
    ("block upload", "A4 08 10 00 02 00 00 00"),
    ("block upload, block size 0", "A4 08 10 00 00 00 00 00"),
    ("block upload, start", "A3 00 00 00 00 00 00 00"),
    ("block received", "A2 02 02 00 00 00 00 00"),
    ("unknown", "E0 00 00 00 00 00 00 00"),
];

fn server_in(frames: &[&str], store: &mut Store) -> Server {
    let mut server = Server::new(ServerConfig { block_size: 2, ..ServerConfig::default() });
    for frame in frames {
        server.handle(ms(0), &hex(frame), store).unwrap();
        while server.wake_at() == Some(MonotonicTime::ZERO) {
            server.poll(ms(0));
        }
    }
    server
}

#[test]
fn whole_table() {
    let mut table = String::new();
    for (state, way) in STATES {
        for (name, frame) in FRAMES {
            let mut store = Store::default();
            let mut server = server_in(way, &mut store);
            assert_eq!(server.state(), state);
            let written = store.writes;
            server.handle(ms(0), &hex(frame), &mut store).unwrap();
            let answer = server.poll(ms(0)).map_or("-".into(), |bytes| match server.state() {
                ServerState::BlockUpload => format!("segment {}", bytes[0]),
                _ => Response::parse(&bytes).unwrap().to_string(),
            });
            let wrote = if store.writes > written { ", written" } else { "" };
            table +=
                &format!("{state:<18} {name:<35} -> {:<18} {answer}{wrote}\n", server.state().to_string());
        }
        let mut server = server_in(way, &mut Store::default());
        let late =
            server.poll(ms(1000)).map_or("-".into(), |bytes| Response::parse(&bytes).unwrap().to_string());
        table += &format!("{state:<18} {:<35} -> {:<18} {late}\n", "time-out", server.state().to_string());
    }
    insta::assert_snapshot!(table);
}

#[test]
fn wrong_lengths_change_nothing() {
    for (state, way) in STATES {
        let mut store = Store::default();
        let mut server = server_in(way, &mut store);
        for len in (0..12).filter(|&len| len != SDO_LEN) {
            let error = server.handle(ms(0), &[0x40; 12][..len], &mut store).unwrap_err();
            assert!(error.to_string().ends_with(&format!("expected 8 bytes, got {len}")), "{error}");
        }
        assert_eq!((server.state(), server.poll(ms(0))), (state, None));
    }
}

#[test]
fn requests_print_in_the_table_as_what_they_are() {
    // The names in the table stand for these.
    let kinds = FRAMES.map(|(_, frame)| Request::parse(&hex(frame)).is_ok());
    assert_eq!(kinds.iter().filter(|&&known| !known).count(), 1);
}

#[test]
fn a_server_without_block_transfers_says_so() {
    let mut store = Store::default();
    let mut server = Server::new(ServerConfig { block_size: 0, ..ServerConfig::default() });
    for (request, refusal) in [
        ("C6 00 20 00 0E 00 00 00", "80 00 20 00 01 00 04 05"),
        ("A4 08 10 00 02 00 00 00", "80 08 10 00 01 00 04 05"),
    ] {
        server.handle(ms(0), &hex(request), &mut store).unwrap();
        assert_eq!((server.poll(ms(0)), server.state()), (Some(hex(refusal)), ServerState::Idle));
    }
}

#[test]
fn more_bytes_than_there_is_room_for_are_refused_and_not_kept() {
    let mut store = Store { max: 10, ..Store::default() };
    let before = store.values[&TEXT].clone();
    // Nobody told the size; the second segment is one too many.
    let mut server = server_in(&["20 00 20 00 00 00 00 00", "00 31 32 33 34 35 36 37"], &mut store);
    server.handle(ms(0), &hex("10 31 32 33 34 35 36 37"), &mut store).unwrap();
    assert_eq!(server.poll(ms(0)), Some(hex("80 00 20 00 12 00 07 06")));
    let mut server = server_in(&["C4 00 20 00 00 00 00 00", "01 31 32 33 34 35 36 37"], &mut store);
    server.handle(ms(0), &hex("82 31 32 33 34 35 36 37"), &mut store).unwrap();
    server.poll(ms(0));
    server.handle(ms(0), &hex("C1 00 00 00 00 00 00 00"), &mut store).unwrap();
    assert_eq!(server.poll(ms(0)), Some(hex("80 00 20 00 12 00 07 06")));
    // The server itself has less room than the object.
    store.max = 5000;
    let mut server = Server::new(ServerConfig { capacity: 100, ..ServerConfig::default() });
    server.handle(ms(0), &hex("21 00 20 00 65 00 00 00"), &mut store).unwrap();
    assert_eq!(server.poll(ms(0)), Some(hex("80 00 20 00 05 00 04 05")));
    assert_eq!((store.values[&TEXT].clone(), store.writes), (before, 0));
}

/// A client that does not tell the size sends four bytes for every value: those that the object has no room for are none.
#[test]
fn an_expedited_download_without_a_size_writes_as_many_bytes_as_the_object_has() {
    let mut store = Store { max: 2, ..Store::default() };
    let mut server = server_in(&["22 00 20 00 31 32 33 34"], &mut store);
    assert_eq!((store.values[&TEXT].as_slice(), store.writes), (&b"12"[..], 1));
    // With the size they are too many.
    server.handle(ms(0), &hex("23 00 20 00 31 32 33 34"), &mut store).unwrap();
    assert_eq!(server.poll(ms(0)), Some(hex("80 00 20 00 12 00 07 06")));
    assert_eq!(store.writes, 1);
    store.max = 10;
    server.handle(ms(0), &hex("22 00 20 00 31 32 33 34"), &mut store).unwrap();
    assert_eq!((store.values[&TEXT].as_slice(), store.writes), (&b"1234"[..], 2), "there is room for all");
}

#[test]
fn a_switch_threshold_turns_a_block_upload_into_an_ordinary_one() {
    let mut store = Store::default();
    let mut server = Server::new(ServerConfig::default());
    // 26 bytes: at 25 they come in blocks, at 26 in segments.
    for (threshold, first) in [("19", 0xC6), ("1A", 0x41)] {
        server.handle(ms(0), &hex(&format!("A4 08 10 00 7F {threshold} 00 00")), &mut store).unwrap();
        assert_eq!(server.poll(ms(0)).unwrap()[0], first);
    }
}
