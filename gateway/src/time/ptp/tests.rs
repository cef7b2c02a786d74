//! The follower against masters in virtual time. The messages of the masters are made here, byte by byte.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;

use profile_generic::time::MonotonicTime;

use super::super::judge::{Reason, SyncPhase};
use super::super::status::TimeStatus;
use super::guard::Refusal;
use super::guard::tests::{announce, head, sync};
use super::wire::{Arrived, Wire};
use super::{FollowerConfig, follow};

const SECOND: u64 = 1_000_000_000;
/// The monotonic clock when a test begins, ns.
const START: u64 = 50 * SECOND;
/// The masters' time when a test begins, ns.
const EPOCH: i128 = 1_700_000_000 * SECOND as i128;

/// A master clock on the network.
#[derive(Debug, Clone, Copy)]
struct Clock {
    identity: u8,
    priority: u8,
    /// Seconds of the test in which it is there.
    there: (u64, u64),
    /// Its rate against our monotonic clock, parts per thousand million.
    ppb: i128,
    /// How far it is ahead of the time of the test, ns: from second .0 on, .1.
    ahead: i128,
    step: Option<(u64, i128)>,
    /// From second .0 on its rate is another one by .1.
    rate_step: Option<(u64, i128)>,
    /// Delay of the way from it, and of the way to it, ns.
    delays: (u64, u64),
    two_step: bool,
    announces: bool,
    syncs: bool,
    answers: bool,
    /// One of so many Syncs and answers is lost.
    loses: u64,
    /// Every so many Syncs come later by .1 ns.
    jitter: Option<(u64, u64)>,
}

const MASTER: Clock = Clock {
    identity: 1,
    priority: 128,
    there: (0, u64::MAX),
    ppb: 40_000,
    ahead: 4_000_000,
    step: None,
    rate_step: None,
    delays: (3_000, 3_000),
    two_step: true,
    announces: true,
    syncs: true,
    answers: true,
    loses: u64::MAX,
    jitter: None,
};

impl Clock {
    fn time(&self, at: u64) -> u64 {
        let since = i128::from(at) - i128::from(START);
        let step = self.step.filter(|(second, _)| at >= START + second * SECOND).map_or(0, |(_, step)| step);
        let changed = self.rate_step.map_or(0, |(second, ppb)| {
            i128::from(at.saturating_sub(START + second * SECOND)) * ppb / 1_000_000_000
        });
        let gained = since * self.ppb / 1_000_000_000 + changed;
        u64::try_from(EPOCH + since + gained + self.ahead + step).unwrap()
    }
}

fn stamp(message: &mut [u8], time: u64) {
    message[34..40].copy_from_slice(&(time / SECOND).to_be_bytes()[2..]);
    message[40..44].copy_from_slice(&u32::try_from(time % SECOND).unwrap().to_be_bytes());
}

/// A message on its way: when it comes, whether it is an event message, its bytes.
type UnderWay = (u64, bool, Vec<u8>);

/// A network in virtual time.
struct Network {
    clocks: Vec<Clock>,
    now: u64,
    end: u64,
    /// Messages on their way.
    under_way: VecDeque<UnderWay>,
    /// Seconds for which the messages of the masters were made.
    made: u64,
    /// Messages of others, made anew each second.
    others: fn(u64) -> Vec<UnderWay>,
    requests: u64,
    /// Threshold that a controller has said, ns.
    threshold: Option<u64>,
}

impl Network {
    fn new(clocks: &[Clock], seconds: u64) -> Self {
        Self {
            clocks: clocks.to_vec(),
            now: START,
            end: START + seconds * SECOND,
            under_way: VecDeque::new(),
            made: 0,
            others: |_| Vec::new(),
            requests: 0,
            threshold: None,
        }
    }

    fn post(&mut self, at: u64, event: bool, message: Vec<u8>) {
        let place = self.under_way.partition_point(|(other, ..)| *other <= at);
        self.under_way.insert(place, (at, event, message));
    }

    /// The messages of a second.
    fn make(&mut self, second: u64) {
        let begin = START + second * SECOND;
        let sequence = u16::try_from(second % 0x1_0000).unwrap();
        for clock in self.clocks.clone() {
            if !(clock.there.0..clock.there.1).contains(&second) {
                continue;
            }
            // Each clock has its own instants.
            let at = begin + 1_000_000 * u64::from(clock.identity);
            if clock.announces && second.is_multiple_of(2) {
                self.post(at, false, announce(clock.identity, clock.priority, sequence / 2));
            }
            if !clock.syncs || second % clock.loses == clock.loses - 1 {
                continue;
            }
            let late =
                clock.jitter.filter(|(every, _)| second.is_multiple_of(*every)).map_or(0, |(_, late)| late);
            let left = clock.time(at);
            if clock.two_step {
                let mut first = head(0x0, 44, clock.identity, sequence);
                first[6] = 2;
                self.post(at + clock.delays.0 + late, true, first);
                let mut follow_up = head(0x8, 44, clock.identity, sequence);
                stamp(&mut follow_up, left);
                self.post(at + clock.delays.0 + late + 50_000, false, follow_up);
            } else {
                let mut one = sync(clock.identity, sequence, 2);
                stamp(&mut one, left);
                self.post(at + clock.delays.0 + late, true, one);
            }
        }
        for (at, event, message) in (self.others)(second) {
            self.post(begin + at, event, message);
        }
    }
}

impl Wire for Network {
    fn now(&self) -> MonotonicTime {
        MonotonicTime(self.now)
    }

    fn wait(&mut self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
        while START + self.made * SECOND <= until.0 {
            self.make(self.made);
            self.made += 1;
        }
        let Some((at, event, message)) = self.under_way.pop_front_if(|(at, ..)| *at <= until.0.max(self.now))
        else {
            self.now = self.now.max(until.0);
            return Ok(None);
        };
        self.now = self.now.max(at);
        buffer[..message.len()].copy_from_slice(&message);
        Ok(Some(Arrived { len: message.len(), event: event.then_some(MonotonicTime(at)) }))
    }

    fn send_event(&mut self, request: &[u8]) -> io::Result<Option<MonotonicTime>> {
        assert_eq!((request[0] & 0xF, request[1], request.len()), (1, 2, 44), "a Delay_Req of version 2");
        self.requests += 1;
        let (left, second) = (self.now, (self.now - START) / SECOND);
        for clock in self.clocks.clone() {
            let is_there = (clock.there.0..clock.there.1).contains(&second);
            if !is_there || !clock.answers || self.requests % clock.loses == clock.loses - 1 {
                continue;
            }
            let mut response = head(0x9, 54, clock.identity, 0);
            response[30..32].copy_from_slice(&request[30..32]);
            response[44..54].copy_from_slice(&request[20..30]);
            stamp(&mut response, clock.time(left + clock.delays.1));
            self.post(left + clock.delays.0 + clock.delays.1, false, response);
        }
        Ok(Some(MonotonicTime(left)))
    }

    fn send_general(&mut self, message: &[u8]) {
        panic!("a follower sends no general message: {message:?}");
    }

    fn is_ended(&self) -> bool {
        self.now >= self.end
    }

    fn threshold(&self) -> Option<u64> {
        self.threshold
    }
}

const CONFIG: FollowerConfig =
    FollowerConfig { identity: [9; 8], domain: 0, threshold: 10_000, asymmetry: 0, seed: 5 };

/// States with the second each began in.
type Phases = Vec<(u64, SyncPhase)>;

/// Runs a network. Returns each state with the second it began in, and the last status.
fn run(mut network: Network) -> (Phases, TimeStatus) {
    let seen: RefCell<(Phases, Option<TimeStatus>)> = RefCell::default();
    let mut clock = 0;
    let mut report = |status: &TimeStatus| {
        let mut seen = seen.borrow_mut();
        // The sample has the instant at which the status was told.
        clock = status.sample.map_or(clock, |sample| sample.at.0);
        if seen.0.last().is_none_or(|(_, phase)| *phase != status.phase) {
            seen.0.push((clock.saturating_sub(START) / SECOND, status.phase));
        }
        seen.1 = Some(status.clone());
    };
    follow(&CONFIG, &mut network, &mut report).unwrap();
    let (phases, last) = seen.into_inner();
    (phases, last.unwrap())
}

/// How far the told time is from a clock's, ns.
fn error(status: &TimeStatus, clock: &Clock) -> i64 {
    let sample = status.sample.expect("a time");
    sample.system.0.cast_signed() - clock.time(sample.at.0).cast_signed()
}

fn phases(run: &[(u64, SyncPhase)]) -> Vec<SyncPhase> {
    run.iter().map(|(_, phase)| *phase).collect()
}

#[test]
fn the_bound_of_the_error_grows_while_the_master_is_silent() {
    let master = Clock { there: (0, 30), ..MASTER };
    let (run, status) = run(Network::new(&[master], 90));
    assert_eq!(run.last().unwrap().1, SyncPhase::Listening, "{run:?}");
    // 500 ns each second since the last Sync.
    assert!((28_000..32_000).contains(&status.error_bound), "{}", status.error_bound);
}

#[test]
fn a_clock_of_another_rate_and_phase_is_followed() {
    for two_step in [true, false] {
        let master = Clock { two_step, ..MASTER };
        let (run, status) = run(Network::new(&[master], 40));
        assert_eq!(run.last().unwrap().1, SyncPhase::Synchronized, "{run:?}");
        assert!(run.last().unwrap().0 <= 20, "{run:?}");
        assert!(error(&status, &master).abs() < 20, "{}", error(&status, &master));
        let followed = status.master.unwrap();
        assert_eq!((status.grandmaster, followed.parent), (Some([1; 8]), ([1; 8], 1)));
        assert_eq!(
            (followed.priorities, followed.steps_removed, followed.quality.class),
            ([128, 128], 1, 248)
        );
        assert!((status.mean_path_delay.unwrap() - 3_000).abs() < 5);
        assert!((status.sample.unwrap().rate_ppb - 40_000).abs() <= 1);
    }
}

#[test]
fn an_asymmetric_path_is_half_of_its_difference_off_and_can_be_report() {
    let master = Clock { delays: (103_000, 3_000), ..MASTER };
    let (_, status) = run(Network::new(&[master], 40));
    let off = error(&status, &master);
    assert!((off + 50_000).abs() < 50, "{off}");
    let seen = RefCell::new(None);
    let config = FollowerConfig { asymmetry: 50_000, ..CONFIG };
    follow(&config, &mut Network::new(&[master], 40), &mut |status| {
        *seen.borrow_mut() = Some(status.clone())
    })
    .unwrap();
    let off = error(&seen.into_inner().unwrap(), &master);
    assert!(off.abs() < 50, "{off}");
}

#[test]
fn without_sync_or_answers_nothing_is_synchronized() {
    for (clock, reason) in [
        (Clock { syncs: false, ..MASTER }, Reason::NoSync),
        (Clock { answers: false, ..MASTER }, Reason::NoDelay),
    ] {
        let (run, status) = run(Network::new(&[clock], 40));
        assert!(!phases(&run).iter().any(|phase| phase.is_synchronized()), "{run:?}");
        assert_eq!((status.phase, status.sample), (SyncPhase::Uncalibrated(reason), None));
    }
    let (run, status) = run(Network::new(&[Clock { announces: false, ..MASTER }], 40));
    assert_eq!((phases(&run), status.sample), (vec![SyncPhase::Listening], None));
}

#[test]
fn a_master_that_dies_is_held_over_and_its_return_ends_that() {
    let there = Clock { there: (0, 30), ..MASTER };
    let back = Clock { there: (38, u64::MAX), ..MASTER };
    let (run, status) = run(Network::new(&[there, back], 60));
    let tail = phases(&run[run.len() - 3..]);
    assert_eq!(tail, [SyncPhase::Synchronized, SyncPhase::Holdover, SyncPhase::Synchronized], "{run:?}");
    assert!(error(&status, &MASTER).abs() < 50, "{}", error(&status, &MASTER));
    // And when it stays away.
    let (run, status) = self::run(Network::new(&[there], 120));
    assert_eq!(status.phase, SyncPhase::Listening, "{run:?}");
    assert!(error(&status, &MASTER).abs() < 200, "the rate is held: {}", error(&status, &MASTER));
}

#[test]
fn a_better_clock_is_followed_and_samples_of_two_are_never_mixed() {
    let better = Clock { identity: 2, priority: 100, there: (30, u64::MAX), ahead: 300_000_000, ..MASTER };
    let (run, status) = run(Network::new(&[MASTER, better], 70));
    assert!(phases(&run).contains(&SyncPhase::Uncalibrated(Reason::Grandmaster)), "{run:?}");
    assert_eq!((status.phase, status.grandmaster), (SyncPhase::Synchronized, Some([2; 8])), "{run:?}");
    assert_eq!(status.steps, 0, "no step: another clock");
    assert!(error(&status, &better).abs() < 50, "{}", error(&status, &better));
    assert!((status.mean_path_delay.unwrap() - 3_000).abs() < 5);
}

#[test]
fn a_better_clock_of_another_rate_is_followed() {
    for ppb in [0, 15_000, 80_000, -100_000, 200_000] {
        let better = Clock { identity: 2, priority: 100, there: (30, u64::MAX), ppb, ..MASTER };
        let (run, status) = run(Network::new(&[MASTER, better], 70));
        assert_eq!((status.phase, status.steps), (SyncPhase::Synchronized, 0), "{ppb}: {run:?}");
        assert!(run.last().unwrap().0 <= 55, "{ppb}: {run:?}");
        assert!(error(&status, &better).abs() < 50, "{ppb}: {}", error(&status, &better));
        assert!((status.sample.unwrap().rate_ppb - i64::try_from(ppb).unwrap()).abs() <= 1);
        assert!((status.mean_path_delay.unwrap() - 3_000).abs() < 5, "{ppb}");
    }
}

#[test]
fn a_master_that_changes_its_rate_is_followed() {
    for by in [15_000, 40_000, -80_000, 150_000] {
        let master = Clock { rate_step: Some((30, by)), ..MASTER };
        let (run, status) = run(Network::new(&[master], 70));
        assert_eq!(status.phase, SyncPhase::Synchronized, "{by}: {run:?}");
        assert!(run.last().unwrap().0 <= 50, "{by}: {run:?}");
        assert!(error(&status, &master).abs() < 50, "{by}: {}", error(&status, &master));
        assert!((status.sample.unwrap().rate_ppb - 40_000 - i64::try_from(by).unwrap()).abs() <= 1);
    }
}

#[test]
fn a_tie_is_decided_by_identity() {
    let (_, status) = run(Network::new(&[Clock { identity: 2, ..MASTER }, MASTER], 30));
    assert_eq!(status.grandmaster, Some([1; 8]));
}

#[test]
fn a_step_of_the_master_is_told_once_and_followed() {
    for step in [10_000_000, -10_000_000, 3_600_000_000_000, -1_600_000_000_000_000_000] {
        let master = Clock { step: Some((30, step)), ..MASTER };
        let (run, status) = run(Network::new(&[master], 60));
        assert!(phases(&run).contains(&SyncPhase::Uncalibrated(Reason::Step)), "{step}: {run:?}");
        assert_eq!((status.phase, status.steps), (SyncPhase::Synchronized, 1), "{step}: {run:?}");
        assert!(error(&status, &master).abs() < 50, "{step}: {}", error(&status, &master));
    }
}

#[test]
fn a_step_within_the_threshold_leaves_it_synchronized() {
    for (threshold, steps) in [(100_000, 0), (40_000, 1)] {
        let master = Clock { step: Some((30, 50_000)), ..MASTER };
        let network = Network { threshold: Some(threshold), ..Network::new(&[master], 60) };
        let (run, status) = run(network);
        assert_eq!((status.phase, status.steps), (SyncPhase::Synchronized, steps), "{threshold}: {run:?}");
        let is_lost = run.iter().any(|(second, phase)| *second >= 30 && !phase.is_synchronized());
        assert_eq!(is_lost, steps > 0, "{threshold}: {run:?}");
        assert!(error(&status, &master).abs() < 50, "{threshold}: {}", error(&status, &master));
    }
}

#[test]
fn loss_and_jitter_leave_it_synchronized() {
    let lossy = Clock { loses: 5, ..MASTER };
    let (run, status) = run(Network::new(&[lossy], 200));
    assert_eq!(status.phase, SyncPhase::Synchronized, "{run:?}");
    assert!(run.len() <= 5, "a fifth is lost, and nothing flaps: {run:?}");
    let jittery = Clock { jitter: Some((7, 200_000)), ..MASTER };
    let (run, status) = self::run(Network::new(&[jittery], 200));
    assert_eq!((status.phase, status.steps), (SyncPhase::Synchronized, 0), "{run:?}");
    assert!(error(&status, &MASTER).abs() < 3_000, "{}", error(&status, &MASTER));
}

#[test]
fn a_clock_100_ppm_off_is_followed() {
    for ppb in [100_000, -100_000, 200_000] {
        let master = Clock { ppb, ..MASTER };
        let (run, status) = run(Network::new(&[master], 60));
        assert_eq!(status.phase, SyncPhase::Synchronized, "{ppb}: {run:?}");
        assert!(error(&status, &master).abs() < 50, "{ppb}: {}", error(&status, &master));
    }
}

/// Each second: what strangers send, while a good master is there.
fn strangers(second: u64) -> Vec<UnderWay> {
    let sequence = u16::try_from(second).unwrap();
    let of = |message: Vec<u8>, place: usize, bytes: &[u8]| {
        let mut message = message;
        message[place..place + bytes.len()].copy_from_slice(bytes);
        message
    };
    let now = 1_700_000_000 + second;
    let mut messages = vec![
        (100_000_000, true, of(sync(1, sequence, now), 4, &[7])),
        (110_000_000, true, of(sync(1, sequence, now), 1, &[1])),
        (120_000_000, true, sync(1, sequence.wrapping_sub(1), now + 77)),
        (130_000_000, true, of(sync(1, sequence + 1, now), 8, &[0x7F, 0xFF])),
        (140_000_000, false, announce(1, 1, sequence)[..50].to_vec()),
        (150_000_000, true, sync(3, sequence, now + 99)),
        (160_000_000, false, of(announce(4, 0, sequence), 61, &[0xFF, 0xFF])),
        (170_000_000, false, of(announce(5, 0, sequence), 4, &[3])),
        (180_000_000, false, vec![0xFF; 60]),
    ];
    // Clocks that announce themselves and are worse.
    messages.extend(
        (10..18).map(|sender| {
            (u64::from(sender) * 1_000_000 + 200_000_000, false, announce(sender, 250, sequence))
        }),
    );
    messages.extend((0..200).map(|number: u64| {
        let mut stranger = announce(30, 250, sequence);
        stranger[20..22].copy_from_slice(&u16::try_from(number).unwrap().to_be_bytes());
        (300_000_000 + number * 100_000, false, stranger)
    }));
    messages
}

#[test]
fn what_strangers_send_moves_nothing() {
    // The bad clocks are there first.
    let master = Clock { there: (4, u64::MAX), ..MASTER };
    let network = Network { others: strangers, ..Network::new(&[master], 90) };
    let (run, status) = run(network);
    assert_eq!(
        (status.phase, status.grandmaster, status.steps),
        (SyncPhase::Synchronized, Some([1; 8]), 0),
        "{run:?}"
    );
    assert!(error(&status, &master).abs() < 50, "{}", error(&status, &master));
    let refused =
        |reason: Refusal| status.refused[Refusal::ALL.iter().position(|known| *known == reason).unwrap()];
    for reason in [
        Refusal::Domain,
        Refusal::Version,
        Refusal::Sequence,
        Refusal::Correction,
        Refusal::Short,
        Refusal::Steps,
        Refusal::Flood,
        Refusal::Worse,
    ] {
        assert!(refused(reason) >= 80, "{reason}: {}", refused(reason));
    }
}

/// A network whose Syncs are some ten microseconds off: synchronized for a controller that takes as much, and for no other.
#[test]
fn what_counts_as_synchronized_is_what_the_controller_says() {
    let master = Clock { jitter: Some((2, 60_000)), ..MASTER };
    let with = |threshold| {
        let network = Network { threshold, ..Network::new(&[master], 40) };
        let (run, status) = run(network);
        (run.last().unwrap().1, status.threshold)
    };
    assert!(!with(None).0.is_synchronized(), "{:?}", with(None));
    assert_eq!(with(Some(100_000)), (SyncPhase::Synchronized, 100_000));
    let exact = |threshold| run(Network { threshold, ..Network::new(&[MASTER], 40) }).0.last().unwrap().1;
    assert_eq!(exact(Some(1_000)), SyncPhase::Synchronized);
}
