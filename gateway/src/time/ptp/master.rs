//! A clock that may be the grandmaster, for the bench: it tells its time as long as no better clock is heard.
//!
//! ```text
//!  +-----------+  no Announce for 6 to 12 s +--------+  a better clock  +-----------+
//!  | Listening |--------------------------->| Master |----------------->| Outranked |
//!  +-----------+                            +--------+ <----------------+-----------+
//!        |            a better clock                      it is silent        ^
//!        +--------------------------------------------------------------------+
//! ```
//!
//! What it tells of itself is what it is: class 248, accuracy 0xFE, source 0xA0, nothing traceable, and a time scale of its own: a host
//! that took it for TAI would set its clock some 37 s wrong.

use std::fmt;
use std::io;

use profile_generic::time::{MonotonicTime, SystemTime};
use statime::config::{ClockIdentity, InstanceConfig, SdoId};
use statime::observability::port::PortState;
use statime::time::Time;

use super::guard::{Guard, MESSAGE_MAX, kind};
use super::wire::{Arrived, Wire};
use super::{ClockPort, Instance, LOG_ANNOUNCE, LOG_SYNC, PortSettings, time_properties};
use crate::time::status::Identity;

/// What the clock is, and how often it tells the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterConfig {
    /// Identity of the clock, EUI-64.
    pub identity: [u8; 8],
    /// Domain, 0..=127.
    pub domain: u8,
    /// First and second priority: the lower, the better.
    pub priorities: [u8; 2],
    /// Interval of Announce, 2^n s.
    pub log_announce: i8,
    /// Interval of Sync, 2^n s.
    pub log_sync: i8,
    /// Where the randomness of the time before the first Announce begins.
    pub seed: u64,
}

impl MasterConfig {
    /// A clock with the intervals and priorities of CIP Sync.
    #[must_use]
    pub const fn new(identity: [u8; 8]) -> Self {
        Self {
            identity,
            domain: 0,
            priorities: [128; 2],
            log_announce: LOG_ANNOUNCE,
            log_sync: LOG_SYNC,
            seed: 0,
        }
    }
}

/// What the clock is among others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MasterState {
    /// It listens whether there is a master.
    #[default]
    Listening,
    /// It is the grandmaster.
    Master,
    /// A better clock is the grandmaster. Nobody follows this one.
    Outranked {
        /// Identity of the better one.
        by: [u8; 8],
    },
}

impl fmt::Display for MasterState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listening => f.write_str("listening for other masters"),
            Self::Master => f.write_str("grandmaster"),
            Self::Outranked { by } => write!(f, "no grandmaster: {} is a better clock", Identity(*by)),
        }
    }
}

/// Flag of an Announce, in the second octet of the flag field: the time counts seconds of TAI (clause 13.3.2.6).
const PTP_TIME_SCALE: u8 = 0x08;

/// Where a message has the interval of its kind, 2^n s.
const LOG_INTERVAL: usize = 33;

/// The wire of a master, which puts right what the library writes: it calls the time of every grandmaster TAI, and the interval of
/// every message a second.
struct MasterWire<'a, W> {
    wire: &'a mut W,
    log_announce: i8,
    log_sync: i8,
}

impl<W> MasterWire<'_, W> {
    /// The message as it goes out, in `buffer`.
    fn corrected<'b>(&self, message: &'b [u8], buffer: &'b mut [u8; MESSAGE_MAX]) -> &'b [u8] {
        let Some(copy) = buffer.get_mut(..message.len()) else { return message };
        copy.copy_from_slice(message);
        let kind = message.first().map_or(0, |first| first & 0x0F);
        let log_interval = match kind {
            kind::SYNC | kind::FOLLOW_UP => self.log_sync,
            kind::ANNOUNCE => self.log_announce,
            _ => return copy,
        };
        if let Some(place) = copy.get_mut(LOG_INTERVAL) {
            *place = log_interval.cast_unsigned();
        }
        if let Some(flags) = copy.get_mut(7).filter(|_| kind == kind::ANNOUNCE) {
            *flags &= !PTP_TIME_SCALE;
        }
        copy
    }
}

impl<W: Wire> Wire for MasterWire<'_, W> {
    fn now(&self) -> MonotonicTime {
        self.wire.now()
    }

    fn wait(&mut self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
        self.wire.wait(until, buffer)
    }

    fn send_event(&mut self, message: &[u8]) -> io::Result<Option<MonotonicTime>> {
        let mut buffer = [0; MESSAGE_MAX];
        let message = self.corrected(message, &mut buffer);
        self.wire.send_event(message)
    }

    fn send_general(&mut self, message: &[u8]) {
        let mut buffer = [0; MESSAGE_MAX];
        let message = self.corrected(message, &mut buffer);
        self.wire.send_general(message);
    }

    fn is_ended(&self) -> bool {
        self.wire.is_ended()
    }
}

/// Tells the time until the wire ends. `time` gives the time of the clock at an instant of the wire; `report` gets each other state.
///
/// # Errors
/// What the wire says.
pub fn lead(
    config: &MasterConfig,
    wire: &mut impl Wire,
    time: &impl Fn(MonotonicTime) -> SystemTime,
    report: &mut dyn FnMut(MasterState),
) -> io::Result<()> {
    let [priority_1, priority_2] = config.priorities;
    let settings = PortSettings {
        instance: InstanceConfig {
            clock_identity: ClockIdentity(config.identity),
            priority_1,
            priority_2,
            domain_number: config.domain,
            slave_only: false,
            sdo_id: SdoId::default(),
            path_trace: false,
        },
        log_announce: config.log_announce,
        log_sync: config.log_sync,
        asymmetry: 0,
    };
    let time = |at| Time::from_nanos(time(at).0);
    let wire = &mut MasterWire { wire, log_announce: config.log_announce, log_sync: config.log_sync };
    let instance = Instance::new(settings.instance, time_properties());
    let guard = Guard::of_master(config.identity, config.domain);
    let mut port = ClockPort::start(&instance, &settings, config.seed, guard, wire)?;
    let mut reported = None;
    while !wire.is_ended() {
        let state = match (port.state(), port.master()) {
            (Some(PortState::Master), _) => MasterState::Master,
            (_, Some(master)) => MasterState::Outranked { by: master.grandmaster },
            _ => MasterState::Listening,
        };
        if reported.replace(state) != Some(state) {
            report(state);
        }
        port.turn(wire, &time)?;
        // The time of another master is not taken.
        while port.measurements.take().is_some() {}
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::guard::tests::{announce, head};
    use super::*;

    const SECOND: u64 = 1_000_000_000;
    const START: MonotonicTime = MonotonicTime(50 * SECOND);
    const OWN: [u8; 8] = [9; 8];
    /// How long a message takes through the host, ns.
    const SENDING: u64 = 7_000;

    /// A message on the wire: when, on which port, its bytes.
    type Message = (u64, u16, Vec<u8>);

    /// A network in virtual time: what comes, and what was sent. Times are since the start, ns.
    struct Network {
        now: MonotonicTime,
        end: u64,
        coming: Vec<Message>,
        sent: Vec<Message>,
    }

    impl Network {
        fn passed(&self) -> u64 {
            self.now.0 - START.0
        }
    }

    impl Wire for Network {
        fn now(&self) -> MonotonicTime {
            self.now
        }

        fn wait(&mut self, until: MonotonicTime, buffer: &mut [u8]) -> io::Result<Option<Arrived>> {
            let until = until.0 - START.0;
            let first = self.coming.first().filter(|(at, ..)| *at <= until).map(|(at, ..)| *at);
            self.now = MonotonicTime(START.0 + first.unwrap_or(until).max(self.passed()));
            if first.is_none() {
                return Ok(None);
            }
            let (at, port, message) = self.coming.remove(0);
            buffer[..message.len()].copy_from_slice(&message);
            let event = (port == 319).then_some(MonotonicTime(START.0 + at));
            Ok(Some(Arrived { len: message.len(), event }))
        }

        fn send_event(&mut self, message: &[u8]) -> io::Result<Option<MonotonicTime>> {
            self.sent.push((self.passed(), 319, message.to_vec()));
            Ok(Some(MonotonicTime(self.now.0 + SENDING)))
        }

        fn send_general(&mut self, message: &[u8]) {
            self.sent.push((self.passed(), 320, message.to_vec()));
        }

        fn is_ended(&self) -> bool {
            self.passed() >= self.end
        }
    }

    /// The clock is 3 s ahead of the wire and gains 100 ppm.
    fn told(at: MonotonicTime) -> SystemTime {
        let passed = at.0 - START.0;
        SystemTime(at.0 + 3 * SECOND + passed / 10_000)
    }

    /// Runs the clock for some seconds. Gives what it has sent, and its states.
    fn run(seconds: u64, log_sync: i8, mut coming: Vec<Message>) -> (Vec<Message>, Vec<MasterState>) {
        coming.sort();
        let mut network = Network { now: START, end: seconds * SECOND, coming, sent: Vec::new() };
        let mut states = Vec::new();
        let config = MasterConfig { priorities: [120, 121], log_sync, ..MasterConfig::new(OWN) };
        lead(&config, &mut network, &told, &mut |state| states.push(state)).unwrap();
        (network.sent, states)
    }

    fn of_kind(sent: &[Message], kind: u8) -> Vec<&Message> {
        sent.iter().filter(|(.., message)| message[0] & 0xF == kind).collect()
    }

    fn time_in(message: &[u8]) -> u64 {
        let seconds = u64::from_be_bytes([&[0, 0], &message[34..40]].concat().try_into().unwrap());
        seconds * SECOND + u64::from(u32::from_be_bytes(message[40..44].try_into().unwrap()))
    }

    #[test]
    fn a_clock_alone_tells_its_own_time_in_the_intervals_of_cip_sync() {
        let mut request = head(0x1, 44, 5, 77);
        request[8..16].copy_from_slice(&(3_i64 << 16).to_be_bytes());
        let asked = 15 * SECOND + 123_456;
        let (sent, states) = run(30, LOG_SYNC, vec![(asked, 319, request)]);
        assert_eq!(states, [MasterState::Listening, MasterState::Master]);
        let began = sent[0].0;
        assert!(
            (6 * SECOND..=12 * SECOND).contains(&began),
            "it listens for three to six intervals: {began}"
        );

        let announces = of_kind(&sent, 0xB);
        assert!(announces.iter().all(|(_, port, message)| *port == 320 && message.len() == 64));
        assert!(announces.iter().all(|(.., message)| message[LOG_INTERVAL] == 1));
        assert!(announces.windows(2).all(|pair| pair[1].0 - pair[0].0 == 2 * SECOND), "{announces:?}");
        let (.., message) = announces.last().unwrap();
        // Priority 1, class, accuracy; priority 2, identity, steps; source.
        assert_eq!((message[1] & 0xF, message[4], message[47..50].to_vec()), (2, 0, vec![120, 248, 0xFE]));
        assert_eq!((message[52], &message[53..61], &message[61..64]), (121, &OWN[..], &[0, 0, 0xA0][..]));
        assert_eq!(message[6..8], [0, 0], "neither TAI nor a UTC offset, and nothing is traceable");

        let (syncs, follow_ups) = (of_kind(&sent, 0x0), of_kind(&sent, 0x8));
        assert!((18..=25).contains(&syncs.len()) && syncs.len() == follow_ups.len());
        for (sync, follow_up) in syncs.iter().zip(&follow_ups) {
            assert_eq!((sync.1, sync.2.len(), sync.2[6]), (319, 44, 0x02), "two-step");
            assert_eq!((follow_up.1, follow_up.2.len()), (320, 44));
            assert_eq!(sync.2[30..32], follow_up.2[30..32], "the same sequence number");
            let left = MonotonicTime(START.0 + sync.0 + SENDING);
            assert_eq!(time_in(&follow_up.2), told(left).0);
        }
        assert!(syncs.windows(2).all(|pair| pair[1].0 - pair[0].0 == SECOND));

        let answers = of_kind(&sent, 0x9);
        assert_eq!(answers.len(), 1);
        let (.., answer) = answers[0];
        assert_eq!((answer.len(), &answer[30..32], answer[33]), (54, &[0, 77][..], 0));
        assert_eq!(answer[44..52], [5; 8], "for who has asked");
        assert_eq!(answer[8..16], (3_i64 << 16).to_be_bytes(), "with the correction of the request");
        assert_eq!(time_in(answer), told(MonotonicTime(START.0 + asked)).0);
    }

    #[test]
    fn an_interval_that_is_asked_for_is_kept_and_told() {
        let (sent, _) = run(30, -2, Vec::new());
        let syncs = of_kind(&sent, 0x0);
        assert!(syncs.windows(2).all(|pair| pair[1].0 - pair[0].0 == SECOND / 4));
        let told =
            [0x0, 0x8].map(|kind| of_kind(&sent, kind).iter().all(|(.., message)| message[33] == 0xFE));
        assert_eq!(told, [true, true]);
    }

    #[test]
    fn a_better_clock_is_left_alone_while_it_is_heard() {
        let worse = |second: u64| (second * SECOND, 320, announce(1, 130, u16::try_from(second).unwrap()));
        let (sent, states) = run(30, LOG_SYNC, (1..30).map(worse).collect());
        assert_eq!(states, [MasterState::Listening, MasterState::Master]);
        assert!(of_kind(&sent, 0x0).len() > 20, "a worse one is no reason to wait");

        let better = |second: u64| (second * SECOND, 320, announce(1, 100, u16::try_from(second).unwrap()));
        let (sent, states) = run(50, LOG_SYNC, (15..30).map(better).collect());
        let outranked = MasterState::Outranked { by: [1; 8] };
        let course = [MasterState::Listening, MasterState::Master, outranked, MasterState::Master];
        assert_eq!(states, course);
        let silent = sent.iter().filter(|(at, port, _)| *port == 320 && (20..30).contains(&(at / SECOND)));
        assert_eq!(silent.count(), 0);
        assert!(of_kind(&sent, 0xB).iter().any(|(at, ..)| *at > 45 * SECOND), "it is the master again");
    }
}
