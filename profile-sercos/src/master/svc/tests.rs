use super::request::{SvcData, SvcOperation};
use super::*;
use crate::wire::idn::Idn;

const CYCLE: u64 = 1_000_000;

/// A slave that follows each handshake in the same cycle unless a test makes it fail.
struct Peer {
    ahs: bool,
    busy_cycles: u32,
    deaf: bool,
    error: Option<u16>,
    value: u32,
    seen: Vec<u32>,
}

impl Peer {
    fn new() -> Peer {
        Peer { ahs: true, busy_cycles: 0, deaf: false, error: None, value: 0, seen: Vec::new() }
    }

    fn answer(&mut self, mdt: MdtSvc) -> AtSvc {
        if !self.deaf && mdt.control.mhs() != self.ahs {
            self.ahs = mdt.control.mhs();
            if mdt.control.element() == Element::Idn {
                self.seen.push(mdt.info);
            }
        }
        let mut status = SvcStatus::VALID;
        status.set(SvcStatus::AHS, self.ahs);
        if self.busy_cycles > 0 {
            self.busy_cycles -= 1;
            return AtSvc { status: status | SvcStatus::BUSY, info: 0 };
        }
        match self.error {
            Some(code) => AtSvc { status: status | SvcStatus::ERROR, info: u32::from(code) },
            None => AtSvc { status, info: self.value },
        }
    }
}

fn channel() -> ServiceChannel {
    let mut channel = ServiceChannel::new(SvcLimits::default());
    channel.rest(true);
    channel.set_open(true);
    channel
}

/// Runs cycles until an outcome is there; the cycle it came in.
fn run(channel: &mut ServiceChannel, peer: &mut Peer, limit: u64) -> Option<(u64, SvcOutcome)> {
    for cycle in 0..limit {
        let answer = peer.answer(channel.outgoing());
        channel.receive(MonotonicTime(cycle * CYCLE), Some(answer));
        if let Some((_, _, outcome)) = channel.take_outcome() {
            return Some((cycle, outcome));
        }
    }
    None
}

fn scalar(block: u16) -> SvcRequest {
    SvcRequest::read(Idn::standard(block)).with_shape(request::Shape::Fixed(4))
}

#[test]
fn one_step_a_cycle() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    peer.value = 77;
    channel.submit(scalar(100)).unwrap();
    let (cycle, outcome) = run(&mut channel, &mut peer, 10).unwrap();
    // Cycle 0 prepares the opening, cycle 1 takes its answer, cycle 2 the value.
    assert_eq!(cycle, 2);
    assert_eq!(outcome.data.unsigned(), Some(77));
    // The first toggle is from MHS = 1 to 0, as after CP1.
    assert!(channel.mhs());
    assert!(channel.is_idle());
}

#[test]
fn urgent_before_normal_and_own_before_all() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    for block in [1, 2, 3] {
        channel.submit(scalar(block)).unwrap();
    }
    channel.submit(scalar(4).urgent()).unwrap();
    channel.submit(scalar(5).urgent()).unwrap();
    channel.submit_own(scalar(6));
    for _ in 0..5 {
        run(&mut channel, &mut peer, 10).unwrap();
    }
    assert_eq!(peer.seen, [6, 4, 5, 1, 2, 3]);
    assert_eq!(channel.take_own().unwrap().idn, Idn::standard(6));
}

#[test]
fn a_running_request_is_not_interrupted() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    channel.submit(scalar(1)).unwrap();
    channel.receive(MonotonicTime(0), Some(peer.answer(channel.outgoing())));
    channel.submit(scalar(2).urgent()).unwrap();
    run(&mut channel, &mut peer, 10).unwrap();
    run(&mut channel, &mut peer, 10).unwrap();
    assert_eq!(peer.seen, [1, 2]);
}

#[test]
fn the_queue_is_bounded_and_a_place_is_taken_until_fetched() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    for _ in 0..REQUESTS_MAX {
        channel.submit(scalar(1)).unwrap();
    }
    let again = channel.submit(scalar(9)).unwrap_err();
    assert_eq!(again.idn, Idn::standard(9));
    for cycle in 0..100 {
        channel.receive(MonotonicTime(cycle * CYCLE), Some(peer.answer(channel.outgoing())));
    }
    assert!(channel.is_idle());
    assert!(channel.submit(scalar(9)).is_err());
    assert!(channel.take_outcome().is_some());
    assert!(channel.submit(scalar(9)).is_ok());
}

#[test]
fn handshake_timeout_after_ten_cycles() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    peer.deaf = true;
    channel.submit(scalar(1)).unwrap();
    let (cycle, outcome) = run(&mut channel, &mut peer, 50).unwrap();
    assert_eq!(outcome.result, Err(SvcFailure::HandshakeTimeout { cycles: 10 }));
    assert_eq!(cycle, 10);
    // A slave that comes back is served again.
    peer.deaf = false;
    channel.submit(scalar(2)).unwrap();
    assert!(run(&mut channel, &mut peer, 50).unwrap().1.result.is_ok());
}

#[test]
fn missing_telegrams_count_as_missing_handshake() {
    let mut channel = channel();
    channel.submit(scalar(1)).unwrap();
    for cycle in 0..10 {
        assert!(channel.take_outcome().is_none());
        channel.receive(MonotonicTime(cycle * CYCLE), None);
    }
    let (_, _, outcome) = channel.take_outcome().unwrap();
    assert_eq!(outcome.result, Err(SvcFailure::HandshakeTimeout { cycles: 10 }));
}

#[test]
fn busy_for_a_while_is_waited_for_and_for_ever_is_not() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    channel.submit(scalar(1)).unwrap();
    peer.busy_cycles = 999;
    assert!(run(&mut channel, &mut peer, 1100).unwrap().1.result.is_ok());
    channel.submit(scalar(1)).unwrap();
    peer.busy_cycles = u32::MAX;
    let (cycle, outcome) = run(&mut channel, &mut peer, 1100).unwrap();
    assert_eq!(outcome.result, Err(SvcFailure::BusyTimeout { milliseconds: 1000 }));
    assert_eq!(cycle, 1000);
}

#[test]
fn an_invalid_channel_is_no_answer() {
    let mut channel = channel();
    channel.submit(scalar(1)).unwrap();
    let answer = AtSvc { status: SvcStatus::AHS, info: 0 };
    for cycle in 0..10 {
        channel.receive(MonotonicTime(cycle * CYCLE), Some(answer));
    }
    assert!(matches!(channel.take_outcome().unwrap().2.result, Err(SvcFailure::HandshakeTimeout { .. })));
}

#[test]
fn errors_come_by_name_and_the_next_request_goes_on() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    peer.error = Some(0x1001);
    channel.submit(scalar(1)).unwrap();
    let (_, outcome) = run(&mut channel, &mut peer, 10).unwrap();
    assert!(outcome.result.unwrap_err().is_absent());
    assert_eq!(outcome.to_string(), "S-0-0001: IDN: IDN not available");
    peer.error = None;
    channel.submit(scalar(2)).unwrap();
    assert!(run(&mut channel, &mut peer, 10).unwrap().1.result.is_ok());
}

#[test]
fn abort_ends_all_and_returns_the_buffers() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    channel.submit(scalar(1)).unwrap();
    channel.submit(SvcRequest::read(Idn(2)).with_buffer(Vec::with_capacity(1000))).unwrap();
    channel.receive(MonotonicTime(0), Some(peer.answer(channel.outgoing())));
    channel.abort(SvcFailure::SlaveLost);
    let outcomes: Vec<_> = core::iter::from_fn(|| channel.take_outcome()).map(|(_, _, o)| o).collect();
    assert_eq!(outcomes.len(), 2);
    assert!(outcomes.iter().all(|outcome| outcome.result == Err(SvcFailure::SlaveLost)));
    let SvcData::Buffer(buffer) = &outcomes[1].data else { panic!("buffer lost") };
    assert!(buffer.capacity() >= 1000);
}

#[test]
fn closed_channels_keep_requests_waiting() {
    let (mut channel, mut peer) = (channel(), Peer::new());
    channel.set_open(false);
    channel.submit(SvcRequest::new(Idn(1), SvcOperation::Status)).unwrap();
    assert!(run(&mut channel, &mut peer, 50).is_none());
    assert!(!channel.is_idle());
    channel.set_open(true);
    assert!(run(&mut channel, &mut peer, 10).is_some());
}
