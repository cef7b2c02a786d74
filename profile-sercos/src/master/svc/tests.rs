use super::request::{SvcData, SvcOperation};
use super::*;
use crate::wire::data_status::DataStatus;
use crate::wire::idn::Idn;
use crate::wire::svc::{Element, SvcStatus};

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

/// A slave with procedure commands that stay in process until they are let go.
struct Commands {
    ahs: bool,
    open: u32,
    info: u32,
    /// Data status by data block.
    status: std::collections::BTreeMap<u32, u32>,
    seen: Vec<String>,
}

impl Commands {
    fn new() -> Commands {
        Commands { ahs: true, open: 0, info: 0, status: Default::default(), seen: Vec::new() }
    }

    fn answer(&mut self, mdt: MdtSvc) -> AtSvc {
        if mdt.control.mhs() != self.ahs {
            self.ahs = mdt.control.mhs();
            self.info = 0;
            match (mdt.control.element(), mdt.control.write()) {
                (Element::Idn, _) => {
                    self.open = mdt.info;
                    self.info = self.status.get(&self.open).copied().unwrap_or(0);
                    self.seen.push(format!("open {}", self.open));
                }
                (Element::Data, true) => {
                    let status = if mdt.info == 3 { 7 } else { mdt.info };
                    self.status.insert(self.open, status);
                    self.seen.push(format!("write {}", self.open));
                }
                _ => self.seen.push(format!("read {}", self.open)),
            }
        }
        let mut status = SvcStatus::VALID;
        status.set(SvcStatus::AHS, self.ahs);
        AtSvc { status, info: self.info }
    }
}

#[test]
fn a_command_in_process_lets_others_pass() {
    let (mut channel, mut peer) = (channel(), Commands::new());
    let mut cycle = 0;
    let mut cycles = |channel: &mut ServiceChannel, peer: &mut Commands, count: usize, change: bool| {
        for _ in 0..count {
            cycle += 1;
            let answer = peer.answer(channel.outgoing());
            channel.command_change(change);
            channel.receive(MonotonicTime(cycle * CYCLE), Some(answer));
        }
    };
    channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
    let status = |channel: &ServiceChannel| channel.active.as_ref().map(|(_, transfer, _)| transfer.status());
    assert!(!channel.is_running());
    assert_eq!(status(&channel), None);
    cycles(&mut channel, &mut peer, 8, false);
    assert_eq!(status(&channel), Some(DataStatus::from_bits_retain(7)));
    assert_eq!(channel.request(), Some((Idn::standard(100), SvcOperation::Command)));
    assert_eq!(peer.seen[..4], ["open 100", "write 100", "open 100", "write 100"]);
    // Nothing else waits: asked about in every cycle.
    assert_eq!(peer.seen[4..], ["open 100", "open 100", "open 100"]);
    peer.seen.clear();
    // A read beside it, another command, and one on the same data block, which has to wait.
    channel.submit(scalar(7)).unwrap();
    channel.submit(SvcRequest::command(Idn::standard(200))).unwrap();
    channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
    cycles(&mut channel, &mut peer, 12, false);
    let expected = [
        "open 100",
        "open 7",
        "read 7",
        "open 200",
        "write 200",
        "open 200",
        "write 200",
        "open 200",
        "open 100",
        "open 200",
        "open 100",
        "open 200",
    ];
    assert_eq!(peer.seen, expected);
    assert_eq!(channel.take_outcome().unwrap().2.idn, Idn::standard(7));
    assert!(channel.take_outcome().is_none() && channel.is_running());
    // The second command ends; S-DEV says so while many requests wait.
    for _ in 0..REQUESTS_MAX - 3 {
        channel.submit(scalar(8)).unwrap();
    }
    peer.seen.clear();
    peer.status.insert(200, 3);
    cycles(&mut channel, &mut peer, 2, false);
    cycles(&mut channel, &mut peer, 8, true);
    let asked: Vec<&str> = peer.seen.iter().map(String::as_str).filter(|step| step.ends_with("00")).collect();
    assert!(asked.len() <= 6 && asked.contains(&"write 200"), "{:?}", peer.seen);
    let outcome =
        core::iter::from_fn(|| channel.take_outcome()).find(|(_, _, outcome)| outcome.idn.block() == 200);
    assert!(outcome.unwrap().2.result.is_ok());
    // The first one is finished after all, and then the one that waited for its data block runs.
    peer.status.insert(100, 3);
    cycles(&mut channel, &mut peer, 60, true);
    peer.status.insert(100, 3);
    cycles(&mut channel, &mut peer, 60, true);
    let blocks: Vec<u16> =
        core::iter::from_fn(|| channel.take_outcome()).map(|(_, _, outcome)| outcome.idn.block()).collect();
    assert_eq!(blocks.iter().filter(|&&block| block == 100).count(), 2, "{blocks:?}");
    assert!(channel.is_idle());
}

#[test]
fn a_stream_of_requests_does_not_starve_a_command() {
    let (mut channel, mut peer) = (channel(), Commands::new());
    channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
    for cycle in 0..400u64 {
        while channel.submit(scalar(8).urgent()).is_ok() {}
        let answer = peer.answer(channel.outgoing());
        channel.receive(MonotonicTime(cycle * CYCLE), Some(answer));
        while channel.take_outcome().is_some() {}
        if cycle == 10 {
            // It never gets on the wire before the urgent ones: it has not begun.
            assert!(!peer.seen.iter().any(|step| step == "open 100"));
        }
    }
    let (mut channel, mut peer) = (self::channel(), Commands::new());
    channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
    for cycle in 0..400u64 {
        if cycle > 8 {
            while channel.submit(scalar(8)).is_ok() {}
        }
        let answer = peer.answer(channel.outgoing());
        channel.receive(MonotonicTime(cycle * CYCLE), Some(answer));
        while channel.take_outcome().is_some() {}
    }
    let polls = peer.seen.iter().filter(|step| *step == "open 100").count();
    assert!((8..=16).contains(&polls), "{polls}");
}

/// Every state of a channel, with what it takes to get there.
fn states() -> Vec<(&'static str, ServiceChannel, Commands)> {
    let mut list = Vec::new();
    let mut add = |name, make: &dyn Fn(&mut ServiceChannel, &mut Commands)| {
        let (mut channel, mut peer) = (channel(), Commands::new());
        channel.receive(MonotonicTime(0), Some(peer.answer(channel.outgoing())));
        make(&mut channel, &mut peer);
        list.push((name, channel, peer));
    };
    let turn = |channel: &mut ServiceChannel, peer: &mut Commands| {
        channel.receive(MonotonicTime(0), Some(peer.answer(channel.outgoing())));
    };
    add("closed", &|channel, _| channel.set_open(false));
    add("closed, one waits", &|channel, _| {
        channel.set_open(false);
        channel.submit(scalar(1)).unwrap();
    });
    add("idle", &|_, _| {});
    add("waiting", &|channel, _| drop(channel.submit(scalar(1))));
    add("first step", &|channel, _| {
        channel.submit(scalar(1)).unwrap();
        channel.kick();
    });
    add("second step", &|channel, peer| {
        channel.submit(scalar(1)).unwrap();
        channel.kick();
        turn(channel, peer);
    });
    add("busy", &|channel, peer| {
        channel.submit(scalar(1)).unwrap();
        channel.kick();
        let mut answer = peer.answer(channel.outgoing());
        answer.status |= SvcStatus::BUSY;
        channel.receive(MonotonicTime(0), Some(answer));
    });
    add("in process", &|channel, peer| {
        channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
        channel.kick();
        (0..6).for_each(|_| turn(channel, peer));
    });
    add("in process, other step", &|channel, peer| {
        channel.submit(SvcRequest::command(Idn::standard(100))).unwrap();
        channel.kick();
        (0..6).for_each(|_| turn(channel, peer));
        channel.submit(scalar(1)).unwrap();
        turn(channel, peer);
    });
    add("answered", &|channel, peer| {
        channel.submit(scalar(1)).unwrap();
        channel.kick();
        (0..2).for_each(|_| turn(channel, peer));
    });
    list
}

/// A channel as a line: the step on the wire, the requests, and what has come out.
fn shown(channel: &mut ServiceChannel) -> String {
    let sent = channel.outgoing();
    format!("{:04x} {:08x} {}", sent.control.0, sent.info, channel.slots.shown())
}

/// What happens to a channel.
type Act<'a> = &'a dyn Fn(&mut ServiceChannel, &mut Commands);

#[test]
fn whole_state_table() {
    let events: &[(&str, Act)] = &[
        ("answer", &|channel, peer| {
            let answer = peer.answer(channel.outgoing());
            channel.receive(MonotonicTime(CYCLE), Some(answer));
        }),
        ("error", &|channel, peer| {
            let mut answer = peer.answer(channel.outgoing());
            answer.status |= SvcStatus::ERROR;
            answer.info = 0x7012;
            channel.receive(MonotonicTime(CYCLE), Some(answer));
        }),
        ("busy", &|channel, peer| {
            let mut answer = peer.answer(channel.outgoing());
            answer.status |= SvcStatus::BUSY;
            channel.receive(MonotonicTime(CYCLE), Some(answer));
        }),
        ("busy for a second", &|channel, peer| {
            let mut answer = peer.answer(channel.outgoing());
            answer.status |= SvcStatus::BUSY;
            channel.receive(MonotonicTime(CYCLE), Some(answer));
            channel.receive(MonotonicTime(1001 * CYCLE), Some(answer));
        }),
        ("no handshake", &|channel, peer| {
            let mut answer = peer.answer(channel.outgoing());
            answer.status.toggle(SvcStatus::AHS);
            channel.receive(MonotonicTime(CYCLE), Some(answer));
        }),
        ("not valid", &|channel, peer| {
            let mut answer = peer.answer(channel.outgoing());
            answer.status.remove(SvcStatus::VALID);
            channel.receive(MonotonicTime(CYCLE), Some(answer));
        }),
        ("no AT", &|channel, _| channel.receive(MonotonicTime(CYCLE), None)),
        ("ten cycles without AT", &|channel, _| {
            (0..10).for_each(|_| channel.receive(MonotonicTime(CYCLE), None));
        }),
        ("command change", &|channel, _| {
            channel.command_change(true);
            channel.kick();
        }),
        ("submit", &|channel, _| {
            channel.submit(scalar(2)).unwrap();
            channel.kick();
        }),
        ("submit own", &|channel, _| {
            channel.submit_own(scalar(3));
            channel.kick();
        }),
        ("open", &|channel, _| {
            channel.set_open(true);
            channel.kick();
        }),
        ("close", &|channel, _| {
            channel.set_open(false);
            channel.kick();
        }),
        ("abort", &|channel, _| channel.abort(SvcFailure::SlaveLost)),
    ];
    let mut table = String::new();
    for index in 0..states().len() {
        for (event, act) in events {
            let (name, mut channel, mut peer) = states().swap_remove(index);
            let before = shown(&mut channel);
            act(&mut channel, &mut peer);
            let after = shown(&mut channel);
            let after = if after == before { "-".to_string() } else { after };
            table += &format!("{name:<23} {event:<22} {after}\n");
        }
    }
    insta::assert_snapshot!(table);
}
