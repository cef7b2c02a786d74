//! Every state of the explicit side with every input.

use super::peer::Peer;
use super::rig::config;
use crate::controller::session::{Output, Session};
use crate::wire::encapsulation::{Command, HEADER_LEN, Header, Packet};
use crate::wire::message_router::{Reply, Request};
use crate::wire::status::GeneralStatus;
use profile_generic::time::MonotonicTime;

const NOW: MonotonicTime = MonotonicTime(0);

/// When an idle session is kept alive.
const QUIET: MonotonicTime = MonotonicTime(30_000_000_000);

/// Takes what the session sends, as a list of packets.
fn sent(session: &mut Session) -> Vec<Vec<u8>> {
    let mut buffer = [0; 2048];
    let length = session.poll_transmit(&mut buffer).unwrap_or(0);
    let (mut rest, mut packets) = (&buffer[..length], Vec::new());
    while !rest.is_empty() {
        let end = HEADER_LEN + usize::from(Header::parse(rest).unwrap().length);
        packets.push(rest[..end].to_vec());
        rest = &rest[end..];
    }
    packets
}

/// The service of an unconnected message, or the command.
fn name(packet: &[u8]) -> String {
    let packet = Packet::parse(packet).unwrap();
    if packet.command == Command::SEND_RR_DATA {
        // Interface handle 4, time-out 2, count 2, null item 4, item head 4.
        return Request::parse(&packet.data[16..]).unwrap().service.to_string();
    }
    packet.command.to_string()
}

/// The state in which the session waits for the answer to its request number `requests`, and that request.
fn state(requests: usize) -> (Session, Peer, Option<Vec<u8>>) {
    let mut config = config(1);
    config.list_identity = true;
    let mut session = Session::new(&config);
    let mut peer = Peer::new(&[0.0]);
    let mut waiting = None;
    for request in 0..requests {
        match (request, waiting.take()) {
            (0, _) => session.start(NOW),
            (5, None) => session.close(NOW),
            (_, Some(packet)) => {
                let packet: Vec<u8> = packet;
                let answer = peer.handle_stream(&packet);
                session.handle_stream(NOW, &answer);
            }
            (_, None) => {}
        }
        waiting = sent(&mut session).pop();
    }
    while session.poll().is_some() {}
    (session, peer, waiting)
}

/// The states beside the open connection, beyond those of [`state`].
fn beside(name: &str) -> (Session, Peer, Option<Vec<u8>>) {
    let (mut session, peer, _) = state(5);
    match name {
        "KeepAlive" => session.keep_alive(QUIET),
        _ => session.lose(),
    }
    if name == "Resuming" {
        session.resume(QUIET);
    }
    let waiting = sent(&mut session).pop();
    while session.poll().is_some() {}
    (session, peer, waiting)
}

fn refused(request: &[u8]) -> Vec<u8> {
    let packet = Packet::parse(request).unwrap();
    let mut data = packet.data.to_vec();
    let mut status = crate::wire::encapsulation::EncapsulationStatus::SUCCESS;
    if packet.command == Command::SEND_RR_DATA {
        let reply =
            Reply::new(Request::parse(&data[16..]).unwrap().service, GeneralStatus::RESOURCE_UNAVAILABLE);
        data.truncate(16 + reply.buffer_len());
        reply.emit(&mut data[16..]).unwrap();
        data[14] = 4;
    } else {
        status = crate::wire::encapsulation::EncapsulationStatus::INVALID_COMMAND;
    }
    let answer = Packet { status, data: &data, ..packet };
    let mut bytes = vec![0; answer.buffer_len()];
    answer.emit(&mut bytes).unwrap();
    bytes
}

#[test]
fn the_whole_table() {
    let states = [
        "Idle",
        "ListIdentity",
        "RegisterSession",
        "ReadIdentity",
        "ForwardOpen",
        "Open",
        "ForwardClose",
        "Closed",
        "KeepAlive",
        "Lost",
        "Resuming",
    ];
    let mut table = String::new();
    for (index, state_name) in states.iter().enumerate() {
        let inputs = [
            "start",
            "close",
            "answer",
            "refusal",
            "old answer",
            "time-out",
            "stream closed",
            "keep alive",
            "stream lost",
            "resume",
        ];
        for input in inputs {
            // Open follows the answer to the Forward_Open, Closed that to the Forward_Close.
            let requests = if index == 7 { 7 } else { index };
            let (mut session, mut peer, request) =
                if index < 8 { state(requests) } else { beside(state_name) };
            match (input, &request) {
                ("start", _) => session.start(NOW),
                ("close", _) => session.close(NOW),
                ("answer", Some(request)) => {
                    let answer = peer.handle_stream(request);
                    session.handle_stream(NOW, &answer);
                }
                ("refusal", Some(request)) => session.handle_stream(NOW, &refused(request)),
                ("old answer", Some(request)) => {
                    let mut answer = refused(request);
                    answer[12] ^= 0x80;
                    session.handle_stream(NOW, &answer);
                }
                ("time-out", _) => {
                    let since = if index < 8 { NOW } else { QUIET };
                    session.handle_time(MonotonicTime(since.0 + 5_000_000_000));
                }
                // Only an open connection outlives its stream.
                ("keep alive" | "stream lost" | "resume", _) if index < 5 || (6..8).contains(&index) => {
                    continue;
                }
                ("keep alive", _) => session.keep_alive(QUIET),
                ("stream lost", _) => session.lose(),
                ("resume", _) => session.resume(QUIET),
                ("stream closed", _) => session.stream_closed(),
                _ => continue,
            }
            let outputs: Vec<_> = core::iter::from_fn(|| session.poll())
                .map(|output| match output {
                    Output::Identified(_) => "identified".to_owned(),
                    Output::Registered(_) => "registered".to_owned(),
                    Output::Opened(_) => "opened".to_owned(),
                    Output::Closed => "closed".to_owned(),
                    Output::Lost => "lost".to_owned(),
                    Output::Malformed(error) => format!("malformed: {error}"),
                    Output::Failed(failure) => format!("failed: {failure}"),
                    Output::Answered(..) => "answered".to_owned(),
                })
                .collect();
            let packets: Vec<_> = sent(&mut session).iter().map(|packet| name(packet)).collect();
            let sends = if packets.is_empty() { "nothing".to_owned() } else { packets.join(", ") };
            table += &format!("{state_name:15} | {input:13} | {sends:18} | {}\n", outputs.join("; "));
        }
    }
    insta::assert_snapshot!(table);
}
