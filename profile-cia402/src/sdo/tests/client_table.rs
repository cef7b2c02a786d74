//! Every state of the client with every kind of frame.

use super::*;
use crate::wire::sdo::SdoRequest as Request;

fn download(len: usize, method: Method) -> SdoRequest {
    SdoRequest::download(TEXT, text(&[0x31; 30][..len])).by(method)
}

fn upload(method: Method) -> SdoRequest {
    SdoRequest::upload(TEXT).by(method)
}

/// How to bring a client into a state: a request and the answers to it.
fn states() -> [(ClientState, SdoRequest, &'static [&'static str]); 11] {
    use ClientState as S;
    let segments = Method::Segments;
    let blocks = Method::Blocks;
    [
        (S::Idle, download(4, segments), &["60 00 20 00 00 00 00 00"]),
        (S::Download, download(4, segments), &[]),
        (S::DownloadSegments, download(14, segments), &["60 00 20 00 00 00 00 00"]),
        (S::Upload, upload(segments), &[]),
        (S::UploadSegments, upload(segments), &["41 00 20 00 07 00 00 00"]),
        (S::BlockDownload, download(14, blocks), &[]),
        (S::BlockDownloadSegments, download(14, blocks), &["A4 00 20 00 02 00 00 00"]),
        (S::BlockDownloadEnd, download(14, blocks), &["A4 00 20 00 02 00 00 00", "A2 02 02 00 00 00 00 00"]),
        (S::BlockUpload, upload(blocks), &[]),
        (S::BlockUploadSegments, upload(blocks), &["C6 00 20 00 07 00 00 00"]),
        (S::BlockUploadEnd, upload(blocks), &["C6 00 20 00 07 00 00 00", "81 31 32 33 34 35 36 37"]),
    ]
}

const FRAMES: [(&str, &str); 23] = [
    ("uploaded, expedited", "43 00 20 00 09 08 07 06"),
    ("uploaded, segments", "41 00 20 00 0E 00 00 00"),
    ("uploaded, too many bytes", "41 00 20 00 FF FF FF FF"),
    ("uploaded, another object", "43 00 20 01 09 08 07 06"),
    ("segment, last", "01 31 32 33 34 35 36 37"),
    ("segment, not last", "00 31 32 33 34 35 36 37"),
    ("segment, wrong toggle", "11 31 32 33 34 35 36 37"),
    ("segment, wrong size", "03 31 32 33 34 35 36 00"),
    ("downloaded", "60 00 20 00 00 00 00 00"),
    ("segment taken", "20 00 00 00 00 00 00 00"),
    ("segment taken, wrong toggle", "30 00 00 00 00 00 00 00"),
    ("abort", "80 00 20 00 00 00 02 06"),
    ("abort, another object", "80 00 20 01 00 00 02 06"),
    ("abort, no object", "80 00 00 00 01 00 04 05"),
    ("block download", "A4 00 20 00 02 00 00 00"),
    ("block download, size 0", "A4 00 20 00 00 00 00 00"),
    ("block taken", "A2 02 02 00 00 00 00 00"),
    ("block taken, more than was sent", "A2 03 02 00 00 00 00 00"),
    ("block download ended", "A1 00 00 00 00 00 00 00"),
    ("block upload", "C6 00 20 00 07 00 00 00"),
    ("block upload ended", "C1 D6 86 00 00 00 00 00"),
    ("block upload ended, wrong CRC", "C1 00 00 00 00 00 00 00"),
    ("unknown", "E0 00 00 00 00 00 00 00"),
];

fn drain(client: &mut Client) -> Vec<[u8; SDO_LEN]> {
    core::iter::from_fn(|| client.poll(ms(0))).collect()
}

fn client_in(request: SdoRequest, answers: &[&str]) -> Client {
    let mut client = Client::new(ClientConfig { block_size: 2, ..ClientConfig::default() });
    client.start(ms(0), request).unwrap();
    drain(&mut client);
    for answer in answers {
        assert_eq!(client.handle(ms(0), &hex(answer)), Ok(true));
        drain(&mut client);
    }
    if client.state() == ClientState::Idle {
        client.take_outcome().unwrap();
    }
    client
}

fn describe(client: &mut Client, frames: &[[u8; SDO_LEN]]) -> String {
    let mut text = match client.take_outcome() {
        Some(SdoOutcome { result: Ok(()), .. }) => "done ".to_string(),
        Some(SdoOutcome { result: Err(failure), .. }) => format!("{failure} "),
        None => String::new(),
    };
    if client.state() == ClientState::BlockDownloadSegments {
        return text + &format!("{} segments", frames.len());
    }
    for frame in frames {
        text += &match Request::parse(frame).unwrap() {
            Request::Abort(abort) => format!("(abort {:08X}) ", abort.code.0),
            request => format!("{request} "),
        };
    }
    if text.is_empty() { "-".into() } else { text.trim_end().to_string() }
}

#[test]
fn whole_table() {
    let mut table = String::new();
    for (state, request, answers) in states() {
        for (name, frame) in FRAMES {
            let mut client = client_in(request.clone(), answers);
            assert_eq!(client.state(), state);
            let stray = client.handle(ms(0), &hex(frame)) == Ok(false);
            let frames = drain(&mut client);
            let what = if stray { "not asked for".into() } else { describe(&mut client, &frames) };
            let after = format!("{:?}", client.state());
            table += &format!("{:<21} {name:<31} -> {after:<21} {what}\n", format!("{state:?}"));
        }
        let mut client = client_in(request, answers);
        let frames: Vec<_> = client.poll(ms(500)).into_iter().collect();
        let what = describe(&mut client, &frames);
        let after = format!("{:?}", client.state());
        table += &format!("{:<21} {:<31} -> {after:<21} {what}\n", format!("{state:?}"), "time-out");
    }
    insta::assert_snapshot!(table);
}

#[test]
fn wrong_lengths_change_nothing() {
    for (state, request, answers) in states() {
        let mut client = client_in(request, answers);
        for len in (0..12).filter(|&len| len != SDO_LEN) {
            let error = client.handle(ms(0), &[0x60; 12][..len]).unwrap_err();
            assert!(error.to_string().ends_with(&format!("expected 8 bytes, got {len}")), "{error}");
        }
        assert_eq!((client.state(), client.take_outcome()), (state, None));
    }
}

#[test]
fn one_request_at_a_time() {
    let mut client = client_in(upload(Method::Auto), &[]);
    let second = upload(Method::Auto);
    assert_eq!(client.start(ms(0), second.clone()), Err(second.clone()));
    client.handle(ms(0), &hex("43 00 20 00 09 08 07 06")).unwrap();
    // The outcome has to be taken first.
    assert_eq!(client.start(ms(0), second.clone()), Err(second.clone()));
    assert_eq!(client.take_outcome().unwrap().data.unsigned(), Some(0x0607_0809));
    assert_eq!(client.start(ms(0), second), Ok(()));
}

#[test]
fn a_server_without_block_transfers_is_asked_for_segments_and_remembered() {
    let long = || SdoRequest::download(TEXT, text(&[0x31; 200]));
    let mut client = client_in(long(), &[]);
    assert_eq!(client.state(), ClientState::BlockDownload);
    client.handle(ms(0), &hex("80 00 20 00 01 00 04 05")).unwrap();
    assert_eq!(client.poll(ms(0)), Some(hex("21 00 20 00 C8 00 00 00")));
    client.cancel(SdoFailure::NodeLost);
    assert_eq!(client.poll(ms(0)), Some(hex("80 00 20 00 00 00 00 08")));
    assert_eq!(client.take_outcome().unwrap().result, Err(SdoFailure::NodeLost));
    client.start(ms(0), long()).unwrap();
    assert_eq!(client.poll(ms(0)), Some(hex("21 00 20 00 C8 00 00 00")));
    // A device that restarts may be another one.
    client.drop_server();
    assert_eq!(
        (client.poll(ms(0)), client.take_outcome().unwrap().result),
        (None, Err(SdoFailure::NodeLost))
    );
    client.start(ms(0), long()).unwrap();
    assert_eq!(client.poll(ms(0)), Some(hex("C6 00 20 00 C8 00 00 00")));
}

#[test]
fn an_answer_that_comes_too_late_does_no_harm() {
    let mut client = client_in(SdoRequest::upload(NAME), &[]);
    assert_eq!(client.poll(ms(500)), Some(hex("80 08 10 00 00 00 04 05")));
    assert_eq!(client.take_outcome().unwrap().result, Err(SdoFailure::Timeout { milliseconds: 500 }));
    client.start(ms(500), SdoRequest::upload(NUMBER)).unwrap();
    assert_eq!(client.handle(ms(501), &hex("41 08 10 00 1A 00 00 00")), Ok(false));
    assert_eq!(client.handle(ms(502), &hex("43 00 20 01 01 00 00 00")), Ok(true));
    assert_eq!(client.take_outcome().unwrap().data.unsigned(), Some(1));
}
