//! SDO in segments and blocks, both ways, against PyPI's durand.

use axisbridge::sys::can_socket::{CanSocket, Content, Filter, Options};
use axisbridge::sys::clock::monotonic_now;
use profile_cia402::sdo::client::{Client, ClientConfig};
use profile_cia402::sdo::request::{Method, SdoData, SdoFailure, SdoOutcome, SdoRequest};
use profile_cia402::wire::{AbortCode, Mux};
use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;

use super::*;

/// An SDO client on a socket.
pub struct Channel {
    socket: CanSocket,
    client: Client,
}

impl Channel {
    pub fn open() -> Self {
        let answers = Filter::exactly(Id::Standard(0x580 + u16::from(NODE)));
        let socket = CanSocket::open(INTERFACE, &Options { filters: vec![answers], own: false }).unwrap();
        let config = ClientConfig { timeout: DurationNs::from_secs(5), ..ClientConfig::default() };
        Self { socket, client: Client::new(config) }
    }

    pub fn ask(&mut self, request: SdoRequest) -> SdoOutcome {
        self.client.start(monotonic_now(), request).unwrap();
        loop {
            while let Some(data) = self.client.poll(monotonic_now()) {
                let frame = Frame::new(Id::Standard(0x600 + u16::from(NODE)), &data).unwrap();
                self.socket.send(&frame).unwrap();
            }
            if let Some(outcome) = self.client.take_outcome() {
                return outcome;
            }
            let _ = self.socket.wait(Duration::from_millis(100)).unwrap();
            while let Some(received) = self.socket.recv().unwrap() {
                let Content::Frame(frame) = received.content else { panic!("{received:?}") };
                self.client.handle(monotonic_now(), frame.data()).unwrap();
            }
        }
    }
}

/// Bytes that repeat nowhere soon.
fn bytes(len: usize) -> Vec<u8> {
    let mut state = 0x1234_5678_u32;
    let next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    };
    std::iter::repeat_with(next).take(len).collect()
}

#[test]
fn objects_of_every_length_go_to_durand_and_back_in_segments_and_blocks() {
    let Some(python) =
        python_inside("blocks::objects_of_every_length_go_to_durand_and_back_in_segments_and_blocks")
    else {
        return;
    };
    let mut peer = Peer::start(&python, "canopen_blocks.py", &[INTERFACE, "5"]);
    let mut channel = Channel::open();
    let object = Mux::new(0x2000, 0);
    let number = channel.ask(SdoRequest::upload(Mux::new(0x2001, 0)));
    assert_eq!((number.result, number.data.unsigned()), (Ok(()), Some(0x1234_5678)));
    let first = channel.ask(SdoRequest::upload(object));
    assert_eq!((first.result, first.data.as_slice()), (Ok(()), &b"at the start"[..]));
    // Around one segment and one block (127 segments of 7 bytes), and many blocks.
    for len in [1, 4, 5, 6, 7, 8, 14, 15, 888, 889, 890, 1778, 1779, 5000] {
        for method in [Method::Segments, Method::Blocks] {
            let data = bytes(len);
            let down = SdoRequest::download(object, SdoData::Buffer(data.clone())).by(method);
            let outcome = channel.ask(down);
            assert_eq!(outcome.result, Ok(()), "{len} bytes down by {method:?}");
            peer.says(&format!("{len} {:08X}", crc32(&data)));
            let up = SdoRequest::upload_into(object, Vec::with_capacity(6000)).by(method);
            let outcome = channel.ask(up);
            assert_eq!(outcome.result, Ok(()), "{len} bytes up by {method:?}");
            assert_eq!(outcome.data.as_slice(), data, "{len} bytes by {method:?}");
        }
    }
    let absent = channel.ask(SdoRequest::upload(Mux::new(0x5FFF, 0)));
    assert_eq!(absent.result, Err(SdoFailure::Refused(AbortCode::NO_OBJECT)));
}

/// CRC-32 of zip.
fn crc32(data: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 0 { crc >> 1 } else { crc >> 1 ^ 0xEDB8_8320 },
        )
    };
    !data.iter().fold(u32::MAX, step)
}
