//! The cycles of the buses on the grid of system time: when their frames really go out, and what that does to the axis.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge::engine::phase_lock::LockState;
use axisbridge_tests::rig::Rig;
use profile_cip::controller::{Controller, Step};
use profile_cip::device::motion_device::SyncState;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::CommandFrame;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::checker::checked_bus::Tried;
use profile_sercos::checker::{Rule, Violation};
use profile_sercos::wire::extended::{EXTENDED_OFFSET, Extended};
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind};

use crate::chain::{Bus, Chain};
use crate::scenario::program;

const SECOND: DurationNs = DurationNs::from_millis(1_000);

/// The buses with a cycle that drives are synchronized by.
const CHAINS: [Chain; 2] =
    [Chain { bus: Bus::Sercos, synchronous: true }, Chain { bus: Bus::Canopen, synchronous: true }];

/// Goes on for a time; when each cycle went out, in true time, which is the gateway's monotonic one.
fn cycles(rig: &mut Rig, span: DurationNs) -> Vec<MonotonicTime> {
    let (end, mut sent) = (rig.now() + span, Vec::new());
    while rig.now() < end {
        rig.step();
        sent.extend(rig.cycle_sent_at().filter(|at| sent.last() != Some(at)));
    }
    sent
}

/// How far a cycle is behind the nearest instant of a grid of the gateway's system time, ns.
fn off(rig: &Rig, at: MonotonicTime, grid: u64, cycle: DurationNs) -> i64 {
    let cycle = i128::from(cycle.0);
    let past = (i128::from(rig.gateway_clock.system(at).0) - i128::from(grid)).rem_euclid(cycle);
    i64::try_from(if past > cycle / 2 { past - cycle } else { past }).expect("less than a cycle")
}

/// Each cycle follows the one before after the cycle time, give or take these parts per million.
fn even(chain: Chain, sent: &[MonotonicTime], ppm: i64) {
    let cycle = chain.cycle();
    for pair in sent.windows(2) {
        let step = pair[1].since(pair[0]) - cycle;
        assert!(step.0.abs() <= cycle.0 * ppm / 1_000_000, "{chain}: {step} at {:?}", pair[0]);
    }
}

fn lock(rig: &Rig) -> LockState {
    rig.status().phase_lock.state
}

#[test]
fn cycles_are_pulled_to_system_time_and_stay_on_it() {
    for chain in CHAINS {
        let mut rig = chain.ready();
        // Another grid than the one that the bus began with by chance.
        let now = rig.now();
        rig.gateway_clock.set_offset(now, DurationNs(271_003));
        let pulled = cycles(&mut rig, SECOND);
        even(chain, &pulled, 3_000);
        let first = off(&rig, pulled[2], 0, chain.cycle());
        assert!(first.abs() > 100_000, "{chain}: {first} ns, there was something to pull");
        rig.run_for(SECOND);
        assert_eq!(lock(&rig), LockState::Locked, "{chain}\n{}", rig.told());
        // A crystal that is 100 ppm off the network's.
        let now = rig.now();
        rig.knows_rate = true;
        rig.gateway_clock.drift(now, 100_000);
        rig.run_for(SECOND);
        for at in cycles(&mut rig, SECOND) {
            let off = off(&rig, at, 0, chain.cycle());
            assert!(off.abs() <= 1_000, "{chain}: {off} ns");
        }
        assert_eq!(lock(&rig), LockState::Locked, "{chain}\n{}", rig.told());
    }
}

/// Time stamps of the controller's updates, which are made earlier by so much on their way.
fn stamps(rig: &mut Rig, earlier: u64) -> Rc<RefCell<Vec<u64>>> {
    let stamps = Rc::new(RefCell::new(Vec::new()));
    let seen = Rc::clone(&stamps);
    rig.tamper_command = Some(Box::new(move |datagram| {
        let parsed = Class1Datagram::parse(datagram.as_slice()).ok();
        let header = parsed.and_then(|parsed| Some(*CommandFrame::parse(parsed.data).ok()?.header()));
        if let Some(stamp) = header.and_then(|header| header.time_stamp) {
            let bytes = datagram.as_mut_slice();
            let mut places = bytes.windows(8).map(|window| window == stamp.to_le_bytes());
            let place = places.position(|found| found).expect("the stamp is in the datagram");
            bytes[place..place + 8].copy_from_slice(&(stamp - earlier).to_le_bytes());
            seen.borrow_mut().push(stamp - earlier);
        }
        true
    }));
    stamps
}

#[test]
fn drives_take_set_points_at_the_instants_of_the_controller() {
    for chain in CHAINS {
        let mut rig = chain.ready();
        // A controller whose updates begin between the multiples of the cycle.
        let cycle = chain.cycle();
        let stamps = stamps(&mut rig, cycle.0.unsigned_abs() / 3);
        let config = chain.controller(&rig);
        // Without torque a bus is pulled fast.
        let pause = Step::Dwell { seconds: 1.0 };
        rig.connect_with(config, [vec![pause], program()].concat());
        rig.run_until(SECOND * 5, "the axis is enabled", |rig| rig.report().steps_finished > 1);
        let sent = cycles(&mut rig, SECOND);
        let stamp = *stamps.borrow().last().expect("the controller stamps its updates");
        assert!(stamp % cycle.0.unsigned_abs() > 100_000, "{chain}: {stamp} is on the grid of the epoch");
        for at in &sent {
            let off = off(&rig, *at, stamp, cycle);
            assert!(off.abs() <= 100, "{chain}: {off} ns off the controller's grid");
        }
        assert_eq!(lock(&rig), LockState::Locked, "{chain}\n{}", rig.told());
    }
}

/// Time is lost, drifts away and comes back, and steps, all while the axis moves. The motion checker looks at every set-point.
#[test]
fn neither_unlocking_nor_locking_moves_an_axis() {
    for chain in CHAINS {
        let mut rig = chain.ready();
        let config = chain.controller(&rig);
        rig.connect_with(config, program());
        rig.run_until(SECOND * 5, "the axis is enabled", |rig| rig.report().steps_finished > 0);
        rig.motion_checker.restart_statistics();
        rig.run_for(DurationNs::from_millis(100));
        rig.knows_rate = true;
        let grandmaster = Some(axisbridge::simulate::setup::HOST_CLOCK);
        rig.engine.set_sync(SyncState { grandmaster, synchronized: false, offset: 0 });
        let now = rig.now();
        rig.gateway_clock.drift(now, 200_000);
        rig.controller_clock.drift(now, 200_000);
        // The cycle that was built already is the last one of the grid before.
        let free = cycles(&mut rig, DurationNs::from_millis(150));
        even(chain, &free[2..], 0);
        assert_eq!(lock(&rig), LockState::Free, "{chain}");
        rig.engine.set_sync(SyncState { grandmaster, synchronized: true, offset: 0 });
        let pulled = cycles(&mut rig, DurationNs::from_millis(300));
        even(chain, &pulled, 300);
        let now = rig.now();
        rig.gateway_clock.step(now, DurationNs(1_000_700_000));
        rig.controller_clock.step(now, DurationNs(1_000_700_000));
        even(chain, &cycles(&mut rig, DurationNs::from_millis(200)), 300);
        let closed = |rig: &Rig| rig.controller.as_ref().is_none_or(Controller::is_closed);
        rig.run_until(SECOND * 5, "the end of the program", closed);
        assert_eq!((rig.report().failure, rig.report().steps_finished), (None, 3), "{chain}\n{}", rig.log());
        let statistics = rig.motion_checker.statistics(0);
        let deviation = statistics.percent(statistics.deviation);
        assert!(deviation <= 1.0, "{chain}: {deviation} % of the velocity, {statistics:?}");
    }
}

/// The extended field of each MDT0 that comes back from the line, with when it was sent.
fn extended_fields(rig: &mut Rig) -> Rc<RefCell<Vec<(MonotonicTime, Extended)>>> {
    let fields = Rc::new(RefCell::new(Vec::new()));
    let (seen, clock) = (Rc::clone(&fields), rig.clock());
    rig.tamper_frame = Some(Box::new(move |frame| {
        let frame = frame.as_slice();
        let header = Header::parse(frame).ok();
        if header.is_some_and(|header| header.telegram.kind() == Kind::Mdt && header.telegram.number() == 0) {
            let field = Extended::parse(&frame[HEADER_LEN + EXTENDED_OFFSET..]).expect("a whole MDT0");
            seen.borrow_mut().push((clock.get(), field));
        }
        true
    }));
    fields
}

/// Seconds and nanoseconds of SERCOS time, each half of them in two cycles, are those of the first of the eight cycles.
#[test]
fn slaves_get_system_time() {
    let mut rig = CHAINS[0].ready();
    rig.gateway_clock.set_offset(rig.now(), DurationNs(-777_123_456_789));
    rig.run_for(SECOND);
    let fields = extended_fields(&mut rig);
    rig.run_for(DurationNs::from_millis(100));
    let fields = fields.take();
    let valid = |field: &Extended| field.word & Extended::TIME_VALID != 0;
    let toggle = |field: &Extended| field.word & Extended::TIME_TOGGLE;
    assert!(fields.iter().all(|(_, field)| valid(field)), "{fields:?}");
    let begins = fields.windows(2).position(|pair| toggle(&pair[0].1) != toggle(&pair[1].1));
    let rounds = fields[begins.expect("another time comes") + 1..].chunks_exact(8);
    assert!(rounds.len() >= 5);
    for round in rounds {
        let half = |cycle: usize| u64::from(round[cycle].1.time_fragment);
        assert!(round.iter().step_by(2).zip(round.iter().skip(1).step_by(2)).all(|(a, b)| a.1 == b.1));
        let (seconds, nanos) = (half(0) << 16 | half(2), half(4) << 16 | half(6));
        let sent = rig.gateway_clock.system(round[0].0);
        assert_eq!(seconds * 1_000_000_000 + nanos, sent.0, "{round:?}");
    }
    // Time that is not proven is not sent.
    rig.engine.set_sync(SyncState { grandmaster: None, synchronized: false, offset: 0 });
    rig.run_for(DurationNs::from_millis(20));
    let fields = extended_fields(&mut rig);
    rig.run_for(DurationNs::from_millis(20));
    assert!(!fields.take().iter().any(|(_, field)| valid(field)));
}

/// A port that holds frames gets them a tenth of the cycle ahead, with the instant of the cycle; the axis moves as ever.
#[test]
fn telegrams_go_ahead_to_a_port_that_holds_them() {
    let chain = CHAINS[0];
    let cycle = chain.cycle();
    let mut rig = chain.ready();
    rig.run_for(SECOND);
    assert!(rig.cycle_sent_at() <= Some(rig.now()), "by the cycle thread's own timing");
    rig.hold_frames();
    let config = chain.controller(&rig);
    rig.connect_with(config, program());
    let mut sent: Vec<MonotonicTime> = Vec::new();
    let closed = |rig: &Rig| rig.controller.as_ref().is_none_or(Controller::is_closed);
    let mut ahead = Vec::new();
    // The line of the rig does not wait: what it gets ahead is early once.
    let early = |violation: &Violation| matches!(violation.rule, Rule::MstInterval { .. });
    rig.tolerating(early, |rig| {
        while !closed(rig) {
            rig.step();
            let Some(at) = rig.cycle_sent_at().filter(|at| sent.last() != Some(at)) else { continue };
            sent.push(at);
            ahead.push(at.since(rig.now()));
            assert!(sent.len() < 10_000, "{}", rig.log());
        }
    });
    let lead = ahead[2];
    assert!(lead > DurationNs::ZERO && lead <= DurationNs(cycle.0 / 10), "{lead}");
    assert!(ahead[2..].iter().all(|ahead| *ahead == lead), "{ahead:?}");
    // The controller has another grid than the bus had.
    even(chain, &sent[2..], 3_000);
    assert_eq!(sent.last().map(|at| off(&rig, *at, sent[sent.len() - 100].0, cycle)), Some(0));
    assert_eq!(lock(&rig), LockState::Locked, "{}", rig.told());
    assert_eq!((rig.report().failure, rig.report().steps_finished), (None, 3), "{}", rig.log());
}
