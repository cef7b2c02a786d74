//! Networks of every size come up under the checker, and every rule is broken once on purpose.

use std::cell::RefCell;
use std::rc::Rc;

use super::bus::VirtualBus;
use super::checked_bus::Tried;
use super::learned::Learned;
use super::light::{COMMAND, FEEDBACK, Mirror};
use super::*;
use crate::master::config::{AddressPolicy, ConnectionConfig, Connections, MasterConfig, SlaveConfig};
use crate::master::connection::ConsumerState;
use crate::master::event::{Event, Refusal, SlaveId};
use crate::master::phase::State;
use crate::slave::communication::FixedConnection;
use crate::slave::parameter::Definition;
use crate::slave::{self, Network, Slave};
use crate::wire::idn::Idn;
use crate::wire::scp::{ScpClass, ScpEntry};

type Bus = VirtualBus<Network<Mirror>>;

/// So many slaves; the first `connected` of them have a connection of four bytes each way.
fn bus(count: u16, connected: u16, cycle_ns: u32, hot_plug_in_all: bool) -> Bus {
    let connections: Connections = [
        ConnectionConfig::new(0, false, &[COMMAND]).unwrap(),
        ConnectionConfig::new(1, true, &[FEEDBACK]).unwrap(),
    ]
    .into_iter()
    .collect();
    let slaves = (1..=count).map(|address| SlaveConfig {
        address,
        connections: if address <= connected { connections.clone() } else { Connections::new() },
        hot_plug: None,
    });
    let four = count > 255;
    let config = MasterConfig {
        slaves: slaves.collect(),
        slaves_max: count,
        setup_cycle_ns: if four { 2_000_000 } else { 1_000_000 },
        stable_cycles: 10,
        hot_plug_in_all,
        ..MasterConfig::new([2, 0, 0, 0, 0, 1], cycle_ns)
    };
    let slave = |address| {
        let config = slave::Config { address, connections: 2, ..slave::Config::default() };
        Slave::new(&config, Mirror::default())
    };
    VirtualBus::new(config, Network::line((1..=count).map(slave).collect())).unwrap()
}

/// Brings a bus to CP4 and sends a value to and from each connected slave.
fn comes_up(count: u16, connected: u16, cycle_ns: u32, hot_plug_in_all: bool) -> Bus {
    let mut bus = bus(count, connected, cycle_ns, hot_plug_in_all);
    bus.up_to(Phase::CP4);
    bus.cycles(3);
    for index in 0..connected {
        let slave = SlaveId(index);
        bus.master.producer(slave, 0).unwrap().copy_from_slice(&(i32::from(index) + 7).to_le_bytes());
        assert!(bus.master.commit(slave, 0));
    }
    bus.cycles(3);
    for index in 0..connected {
        let consumer = bus.master.consumer(SlaveId(index), 1).unwrap();
        assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true), "{index}");
        assert_eq!(consumer.data, (i32::from(index) + 7).to_le_bytes());
    }
    assert!(Refusal::ALL.iter().all(|&reason| bus.master.statistics().refused(reason) == 0));
    assert_eq!(bus.checked.checker.violations(), []);
    bus
}

#[test]
fn up_to_64_slaves_come_up() {
    for (count, hot_plug_in_all) in [(1, true), (4, false), (16, true), (64, false), (64, true)] {
        comes_up(count, count, 2_000_000, hot_plug_in_all);
    }
}

#[test]
fn so_do_254() {
    let bus = comes_up(254, 254, 4_000_000, true);
    let used = |lengths: [u16; TELEGRAMS_MAX]| lengths.iter().filter(|&&len| len > 0).count();
    let layout = bus.master.layout();
    assert_eq!((used(layout.mdt_len), used(layout.at_len)), (3, 3));
}

#[test]
fn and_511_with_four_telegrams_each_way() {
    let bus = comes_up(511, 290, 4_000_000, false);
    let layout = bus.master.layout();
    assert!(layout.mdt_len.iter().chain(&layout.at_len).all(|&len| len > 0), "{layout:?}");
    assert_eq!(bus.master.state(), State::Cp4);
    assert_eq!(bus.master.slaves().count(), 511);
}

fn fix_crc(frame: &mut [u8]) {
    let crc = crc32fast::hash(&frame[..16]);
    frame[16..20].copy_from_slice(&crc.to_le_bytes());
}

fn is(frame: &[u8], kind: Kind, number: u8) -> bool {
    let telegram = TelegramType(frame[14]);
    telegram.kind() == kind && telegram.number() == number
}

/// Lets a bus of two slaves come to `state`, breaks a rule there, and gives what the checker says first.
fn broken(state: State, misdeed: impl FnOnce(&mut Bus)) -> String {
    let mut bus = bus(2, 2, 1_000_000, true);
    bus.master.set_target_phase(Phase::CP4);
    bus.auto_proceed = state != State::Await2;
    bus.state(state);
    if state == State::Cp4 {
        bus.cycles(2);
        for slave in [SlaveId(0), SlaveId(1)] {
            bus.master.commit(slave, 0);
        }
        bus.cycles(3);
    }
    assert_eq!(bus.checked.checker.violations(), []);
    bus.tolerating(
        |_| true,
        |bus| {
            misdeed(bus);
            bus.cycles(8);
        },
    );
    let Some(first) = bus.checked.checker.violations().first() else {
        return format!("NOTHING WAS SEEN in {state:?}");
    };
    format!("{}: {}", first.offender, first.rule)
}

/// The master's telegram `kind` `number` is changed by `edit`; a wrong CRC is made right.
fn master(state: State, kind: Kind, number: u8, edit: impl Fn(&mut Vec<u8>) + 'static) -> String {
    broken(state, |bus| {
        bus.outward = Box::new(move |frame| {
            if is(frame, kind, number) {
                edit(frame);
                fix_crc(frame);
            }
            true
        });
    })
}

/// Slave 2 changes `kind` `number` on its way out.
fn slave_two(state: State, kind: Kind, number: u8, edit: impl Fn(&mut [u8]) + 'static) -> String {
    broken(state, |bus| {
        bus.station = Box::new(move |slave, outward, frame| {
            if slave == 2 && outward && is(frame, kind, number) {
                edit(frame);
            }
        });
    })
}

/// Places of slave 2 in CP1 and CP2.
const SVC_2: usize = HEADER_LEN + 12;
const DEVICE_2: usize = HEADER_LEN + 768 + 8;

#[test]
fn every_rule_of_the_telegrams_is_seen_broken() {
    let mut seen = String::new();
    let mut case = |what: &str, said: String| {
        seen += &format!("{what:<34} {said}\n");
    };
    case(
        "wrong header CRC",
        broken(State::Await2, |bus| {
            bus.outward = Box::new(|frame| {
                frame[16] ^= 1;
                true
            });
        }),
    );
    case("counter stands still", master(State::Await2, Kind::Mdt, 0, |frame| frame[15] &= 0x8F));
    case("phase of an AT", master(State::Await2, Kind::At, 1, |frame| frame[15] ^= 1));
    case("phase above", master(State::Await2, Kind::Mdt, 0, |frame| frame[15] |= 4));
    case("telegram 3 of two", master(State::Await2, Kind::Mdt, 1, |frame| frame[14] |= 3));
    case("AT before its time", master(State::Await2, Kind::Mdt, 1, |frame| frame[14] |= 0x40));
    case("telegram twice", master(State::Await2, Kind::At, 1, |frame| frame[14] &= 0xFE));
    case(
        "telegram left out",
        broken(State::Await2, |bus| bus.outward = Box::new(|frame| !is(frame, Kind::At, 1))),
    );
    case("length in CP2", master(State::Await2, Kind::Mdt, 0, |frame| frame.truncate(1000)));
    case("length in CP4", master(State::Cp4, Kind::At, 0, |frame| frame.push(0)));
    case("cycle in CP2", broken(State::Await2, |bus| bus.now = bus.now + DurationNs::from_micros(1600)));
    case("late MST in CP4", broken(State::Cp4, |bus| bus.now = bus.now + DurationNs::from_micros(1600)));
    case("AT before t1", broken(State::Await3, |bus| bus.checked.checker.config.soft_master = false));
    case(
        "AT in the UC channel",
        broken(State::Cp4, |bus| {
            let mut at = vec![0; 60];
            let telegram = TelegramType::new(Channel::Primary, Kind::At, 0);
            let phase = bus.checked.checker.cycle.as_ref().unwrap().phase;
            Header { source: [2; 6], telegram, phase }.emit(&mut at).unwrap();
            bus.checked.checker.cycle.as_mut().unwrap().seen.clear();
            bus.checked.checker.sent(bus.now + DurationNs::from_micros(900), &at);
        }),
    );
    case("first telegram in CP1", {
        let mut checker = Checker::new(CheckerConfig::default(), MonotonicTime::ZERO);
        let mut mdt = vec![0; 60];
        let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
        Header { source: [2; 6], telegram, phase: PhaseField(1) }.emit(&mut mdt).unwrap();
        checker.sent(MonotonicTime(200_000_000), &mdt);
        checker.violations()[0].rule.to_string()
    });
    case("no silence at the start", {
        let mut checker = Checker::new(CheckerConfig::default(), MonotonicTime::ZERO);
        let mut mdt = vec![0; 60];
        let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
        Header { source: [2; 6], telegram, phase: PhaseField(0) }.emit(&mut mdt).unwrap();
        checker.sent(MonotonicTime(119_000_000), &mdt);
        checker.violations()[0].rule.to_string()
    });
    case(
        "no silence before CP2",
        // The announcement is taken back at once.
        master(State::Leave1, Kind::Mdt, 0, |frame| frame[15] &= 0x7F),
    );
    case("step before the answer", {
        broken(State::Read2, |bus| {
            bus.station = Box::new(|slave, outward, frame| {
                if slave == 2 && outward && is(frame, Kind::At, 0) {
                    frame[SVC_2] |= 2;
                }
            });
            bus.cable = Box::new(|frame| {
                if is(frame, Kind::At, 0) {
                    frame[SVC_2] &= !2;
                }
                true
            });
        })
    });
    case("step changed", master(State::Await2, Kind::Mdt, 0, |frame| frame[SVC_2 + 2] ^= frame[15] & 0x10));
    case("bits that are not on the wire", master(State::Await2, Kind::Mdt, 0, |frame| frame[SVC_2 + 1] = 1));
    let topology = |frame: &mut Vec<u8>, bits: u8| frame[DEVICE_2 + 1] |= bits & frame[15].wrapping_mul(2);
    case(
        "topology without handshake",
        master(State::Await2, Kind::Mdt, 0, move |frame| topology(frame, 0x20)),
    );
    case("store and forward", master(State::Await2, Kind::Mdt, 0, |frame| frame[DEVICE_2 + 1] |= 0x30));
    case("S telegrams command otherwise", {
        broken(State::Await2, |bus| {
            // The same MDT again as an S telegram, in which slave 2 is to turn P telegrams round.
            let sent = Rc::new(RefCell::new(Vec::new()));
            let copy = sent.clone();
            bus.outward = Box::new(move |frame| {
                if is(frame, Kind::Mdt, 0) {
                    copy.replace(frame.clone());
                }
                true
            });
            bus.cycles(1);
            let mut frame = sent.borrow().clone();
            frame[14] |= 0x80;
            frame[DEVICE_2 + 1] ^= 0x50;
            fix_crc(&mut frame);
            bus.checked.checker.sent(bus.now, &frame);
        })
    });
    case("step in CP1", master(State::OpenSvc, Kind::Mdt, 0, |frame| frame[SVC_2] |= 0x0E));
    case("byte of another slave", slave_two(State::Await2, Kind::At, 0, |frame| frame[SVC_2 - 1] ^= 1));
    case("byte of nobody in CP4", slave_two(State::Cp4, Kind::At, 0, |frame| frame[HEADER_LEN + 3] ^= 1));
    case("an MDT", slave_two(State::Cp4, Kind::Mdt, 0, |frame| frame[HEADER_LEN + 14] ^= 1));
    case("the header", slave_two(State::Cp4, Kind::At, 0, |frame| frame[6] ^= 1));
    case(
        "on the way back",
        broken(State::Cp4, |bus| {
            bus.station = Box::new(|slave, outward, frame| {
                if slave == 1 && !outward && is(frame, Kind::At, 0) {
                    frame[HEADER_LEN + 20] ^= 1;
                }
            });
        }),
    );
    case("sequence counter", slave_two(State::Settle, Kind::At, 0, |frame| frame[HEADER_LEN] += 1));
    case(
        "topology field of another",
        slave_two(State::Settle, Kind::At, 0, |frame| frame[HEADER_LEN + 2] = 9),
    );
    case("AHS flips", slave_two(State::Await2, Kind::At, 0, |frame| frame[SVC_2] ^= frame[15] >> 4 & 1));
    case("busy again", slave_two(State::Await2, Kind::At, 0, |frame| frame[SVC_2] |= frame[15] >> 3 & 2));
    case("C-CON counter", {
        slave_two(State::Cp4, Kind::At, 0, |frame| {
            let at = HEADER_LEN + 24 + 6;
            frame[at + 1] = frame[at + 1].wrapping_add((frame[15] >> 4 & 1) << 5);
        })
    });
    case(
        "left while a slave inserts",
        broken(State::Leave2, |bus| {
            // The master is told that the slave has stopped.
            bus.station = Box::new(|slave, outward, frame| {
                if slave == 2 && outward && is(frame, Kind::At, 0) && frame.len() > DEVICE_2 {
                    frame[DEVICE_2 + 1] = 1;
                }
            });
            bus.cable = Box::new(|frame| {
                if is(frame, Kind::At, 0) && frame.len() > DEVICE_2 {
                    frame[DEVICE_2 + 1] = 0;
                }
                true
            });
        }),
    );
    assert!(!seen.contains("NOTHING"), "{seen}");
    insta::assert_snapshot!(seen);
}

/// A bus in CP4 whose master sends one telegram too late.
fn late(bus: &mut Bus) {
    bus.now = bus.now + DurationNs::from_micros(1600);
    bus.cycles(1);
}

#[test]
#[should_panic(expected = "master: 1600 us from MST to MST, the cycle has 1000 us +- 23 us")]
fn a_violation_that_was_not_declared_ends_a_test_with_station_and_rule() {
    let mut bus = bus(1, 1, 1_000_000, true);
    bus.up_to(Phase::CP4);
    bus.cycles(2);
    late(&mut bus);
}

#[test]
#[should_panic(expected = "master: 1600 us from MST to MST")]
fn a_declaration_is_over_with_its_script() {
    let mut bus = bus(1, 1, 1_000_000, true);
    bus.up_to(Phase::CP4);
    bus.cycles(2);
    let declared = |violation: &Violation| matches!(violation.rule, Rule::MstInterval { .. });
    bus.breaking(declared, |bus| {
        late(bus);
        bus.cycles(5);
    });
    late(&mut bus);
}

#[test]
#[should_panic(expected = "1600 us from MST to MST")]
fn another_violation_than_the_declared_one_ends_a_test() {
    let mut bus = bus(1, 1, 1_000_000, true);
    bus.up_to(Phase::CP4);
    bus.cycles(2);
    bus.tolerating(|violation| violation.offender == Offender::Slave(1), late);
}

#[test]
#[should_panic(expected = "the rule that was to be broken on purpose was kept")]
fn a_declared_violation_that_does_not_come_ends_a_test() {
    let mut bus = bus(1, 1, 1_000_000, true);
    bus.up_to(Phase::CP4);
    bus.breaking(|_| true, |bus| bus.cycles(3));
}

#[test]
fn the_counter_is_free_across_a_silence_and_nowhere_else() {
    let telegram = |kind, len: usize, count| {
        let mut frame = vec![0; HEADER_LEN + len];
        let telegram = TelegramType::new(Channel::Primary, kind, 0);
        let phase = PhaseField::new(false, count, Phase::CP0);
        Header { source: [2; 6], telegram, phase }.emit(&mut frame).unwrap();
        frame
    };
    let mut checker = Checker::new(CheckerConfig::default(), MonotonicTime::ZERO);
    let mut cycle = |now: i64, count: u8| {
        let now = MonotonicTime::ZERO + DurationNs::from_micros(now);
        checker.sent(now, &telegram(Kind::Mdt, cp0::MDT_LEN, count));
        checker.sent(now + DurationNs::from_micros(10), &telegram(Kind::At, cp0::AT_LEN, count));
        checker.take_violations().iter().map(|violation| violation.rule.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(cycle(200_000, 6), [""; 0], "any count begins");
    assert_eq!(cycle(201_000, 7), [""; 0]);
    assert_eq!(cycle(202_000, 0), [""; 0]);
    assert_eq!(cycle(203_000, 5), ["cycle counter 5, expected 1"]);
    assert_eq!(cycle(204_000, 6), [""; 0]);
    // From NRT, behind 130 ms.
    assert_eq!(cycle(334_000, 2), [""; 0]);
    assert_eq!(cycle(335_000, 2), ["cycle counter 2, expected 3"]);
}

#[test]
fn a_slave_that_never_stops_inserting_is_named() {
    let mut bus = bus(2, 2, 1_000_000, true);
    bus.master.set_target_phase(Phase::CP4);
    bus.state(State::Leave2);
    bus.station = Box::new(|slave, outward, frame| {
        if slave == 2 && outward && is(frame, Kind::At, 0) {
            frame[DEVICE_2 + 1] = 1;
        }
    });
    let inserts = |violation: &Violation| matches!(violation.rule, Rule::InsertsWhileSwitching { .. });
    bus.breaking(inserts, |bus| bus.cycles(205));
    let rule = Rule::InsertsWhileSwitching { phase: Phase::CP2 };
    let found = bus.checked.checker.violations().iter().find(|violation| violation.rule == rule);
    assert_eq!(found.map(|violation| violation.offender), Some(Offender::Slave(2)));
}

/// Two slaves as the recording's master configures them: MDT {134, 36}, AT {135, 40, 51}.
fn told() -> [Learned; 2] {
    let slave = |svc: [u16; 2], words: [u16; 2], connections: [u16; 2]| {
        let mut learned = Learned::default();
        learned.checked = true;
        let mut half = |idn, value: u16| learned.tell(idn, &u32::from(value).to_le_bytes());
        half(Idn::SVC_MDT_OFFSET, svc[0]);
        half(Idn::SVC_AT_OFFSET, svc[1]);
        half(Idn::CONTROL_OFFSET, words[0]);
        half(Idn::STATUS_OFFSET, words[1]);
        half(Idn::connection(0, 1), 0x8000);
        half(Idn::connection(1, 1), 0xC000);
        half(Idn::connection(0, 3), 0x0800 | connections[0]);
        half(Idn::connection(1, 3), connections[1]);
        half(Idn::connection(0, 5), 8);
        half(Idn::connection(1, 5), 12);
        half(Idn::INTER_FRAME_GAP, 19);
        for (idn, value) in [
            (Idn::CYCLE_TIME, 10_000_000u32),
            (Idn::AT_START, 31_020),
            (Idn::SYNC_TIME, 24_860),
            (Idn::COMMAND_VALID, 11_680),
            (Idn::SYNC_JITTER, 23_260),
        ] {
            learned.tell(idn, &value.to_le_bytes());
        }
        learned.tell(Idn::MDT_LENGTHS, &[8, 0, 8, 0, 46, 0, 0, 0, 0, 0, 0, 0]);
        learned.tell(Idn::AT_LENGTHS, &[8, 0, 8, 0, 48, 0, 0, 0, 0, 0, 0, 0]);
        learned.tell(Idn::UC_TIMES, &[8, 0, 8, 0, 0xF8, 0xF2, 0, 0, 0xE4, 0x28, 0x98, 0]);
        learned
    };
    [slave([14, 8], [26, 20], [30, 24]), slave([20, 14], [28, 22], [38, 36])]
}

#[test]
fn the_recorded_configuration_breaks_nothing() {
    let [first, second] = told();
    let mut broken = Vec::new();
    let plan = Plan::new(&[&first, &second], &mut broken);
    assert_eq!(broken, []);
    assert_eq!((plan.uc_start_ns, plan.at_start_ns, plan.soft), (Some(62_200), Some(31_020), false));
    assert_eq!(plan.slaves[1].as_ref().unwrap().own[0], [14..20, 22..24, 36..48]);
}

#[test]
fn every_rule_of_the_configuration_is_seen_broken() {
    let mut seen = String::new();
    let mut case = |what: &str, change: &dyn Fn(&mut [Learned; 2])| {
        let mut slaves = told();
        change(&mut slaves);
        let [first, second] = &slaves;
        let mut broken = Vec::new();
        Plan::new(&[first, second], &mut broken);
        assert!(!broken.is_empty(), "{what}");
        broken.dedup();
        for rule in broken {
            seen += &format!("{what:<28} {rule}\n");
        }
    };
    let x = Idn::connection;
    let half = |value: u16| u32::from(value).to_le_bytes();
    let both = |slaves: &mut [Learned; 2], idn, value: u32| {
        slaves.iter_mut().for_each(|slave| slave.tell(idn, &value.to_le_bytes()));
    };
    case("service channels overlap", &|slaves| slaves[1].tell(Idn::SVC_AT_OFFSET, &half(12)));
    case("connections overlap", &|slaves| slaves[1].tell(x(1, 3), &half(35)));
    case("connection over a word", &|slaves| slaves[0].tell(x(0, 3), &half(0x0800 | 27)));
    case("word in the hot-plug field", &|slaves| slaves[0].tell(Idn::STATUS_OFFSET, &half(6)));
    case("channel in the extended field", &|slaves| slaves[0].tell(Idn::SVC_MDT_OFFSET, &half(8)));
    case("connection too long", &|slaves| slaves[1].tell(x(1, 5), &half(13)));
    case("telegram that is not sent", &|slaves| slaves[1].tell(x(1, 3), &half(0x1000)));
    case("offset not told", &|slaves| {
        let checked = std::mem::take(&mut slaves[1]).checked;
        slaves[1].checked = checked;
    });
    case("assignment not told", &|slaves| slaves[1].tell(x(3, 1), &half(0xC000)));
    case("lengths not alike", &|slaves| {
        slaves[1].tell(Idn::AT_LENGTHS, &[8, 0, 8, 0, 50, 0, 0, 0, 0, 0, 0, 0]);
    });
    case("times not alike", &|slaves| slaves[1].tell(Idn::SYNC_TIME, &24_000u32.to_le_bytes()));
    case("no cycle time", &|slaves| both(slaves, Idn::CYCLE_TIME, 10_100_000));
    case("UC channel in a short cycle", &|slaves| both(slaves, Idn::CYCLE_TIME, 125_000));
    case("more than the cycle", &|slaves| {
        both(slaves, Idn::CYCLE_TIME, 125_000);
        for slave in slaves {
            slave.tell(Idn::MDT_LENGTHS, &[8, 0, 8, 0, 0xDC, 5, 0, 0, 0, 0, 0, 0]);
        }
    });
    case("t1 within the MDTs", &|slaves| both(slaves, Idn::AT_START, 7_000));
    case("t1 at the end", &|slaves| both(slaves, Idn::AT_START, 9_999_000));
    case("tSync behind the cycle", &|slaves| both(slaves, Idn::SYNC_TIME, 10_000_000));
    case("t3 behind the cycle", &|slaves| both(slaves, Idn::COMMAND_VALID, 10_000_001));
    case("t6 within the ATs", &|slaves| {
        for slave in slaves {
            slave.tell(Idn::UC_TIMES, &[8, 0, 8, 0, 0x20, 0x80, 0, 0, 0xE4, 0x28, 0x98, 0]);
        }
    });
    case("a short UC channel", &|slaves| {
        for slave in slaves {
            slave.tell(Idn::UC_TIMES, &[8, 0, 8, 0, 0xF8, 0xF2, 0, 0, 0xF8, 0xF2, 1, 0]);
        }
    });
    insta::assert_snapshot!(seen);
}

#[test]
fn addresses_are_unique_from_cp3_on() {
    let mut bus = bus(3, 0, 1_000_000, true);
    bus.master.set_target_phase(Phase::CP4);
    bus.state(State::Await2);
    bus.checked.checker.stations[2].address = 1;
    bus.breaking(|violation| matches!(violation.rule, Rule::Address { .. }), |bus| bus.state(State::Await3));
    assert_eq!(bus.checked.checker.violations()[0].rule, Rule::Address { slave: 3, address: 1 });
}

const fn class(class: ScpClass, version: u8) -> ScpEntry {
    ScpEntry { class, version }
}

/// A fixed configuration: connection 0 is consumed, connection 1 produced.
const FIXED: &[FixedConnection] = &[
    FixedConnection { produces: false, idns: &[COMMAND] },
    FixedConnection { produces: true, idns: &[FEEDBACK] },
];

#[test]
fn classes_of_both_kinds_and_versions_come_up_in_one_line() {
    use ScpClass as C;
    const ONE: &[ScpEntry] = &[class(C::FIX_CFG, 1), class(C::SYNC, 1)];
    const BARE: &[ScpEntry] = &[class(C::FIX_CFG, 1)];
    const TWO: &[ScpEntry] = &[class(C::VAR_CFG, 2), class(C::SYNC, 2), class(C::NRT, 1)];
    const BOTH: &[ScpEntry] =
        &[class(C::VAR_CFG, 1), class(C::VAR_CFG, 2), class(C::SYNC, 1), class(C::SYNC, 2)];
    let mut bus = bus(5, 5, 2_000_000, true);
    let kinds = [(ONE, FIXED), (BARE, FIXED), (TWO, &[][..]), (BOTH, &[]), (ONE, FIXED)];
    let slaves = (1u16..).zip(kinds).map(|(address, (classes, fixed))| {
        let config = slave::Config { address, classes, fixed, ..slave::Config::default() };
        Slave::new(&config, Mirror::default())
    });
    bus.line = Network::line(slaves.collect());
    // The third slave's V2 classes tell jitter and t11.
    bus.line.slaves_mut()[2].store_mut().set_number_of(Idn::SLAVE_JITTER, 640);
    bus.line.slaves_mut()[2].store_mut().set_number_of(Idn::CONSUMER_TIME, 4_000);
    bus.up_to(Phase::CP4);
    bus.cycles(2);
    for slave in (0..5).map(SlaveId) {
        bus.master.producer(slave, 0).unwrap().copy_from_slice(&9i32.to_le_bytes());
        assert!(bus.master.commit(slave, 0));
    }
    bus.cycles(3);
    for slave in (0..5).map(SlaveId) {
        let consumer = bus.master.consumer(slave, 1).unwrap();
        assert_eq!((consumer.state, consumer.data), (ConsumerState::Consuming, &9i32.to_le_bytes()[..]));
    }
    // 13 + 27 * 640 * 3162 / 640000 for five slaves.
    assert_eq!(bus.master.layout().times.gap, 98);
    let told = |bus: &Bus, slave: usize, idn| bus.line.slaves()[slave].store().number_of(idn);
    let soft = 1 << 4;
    let control: Vec<i64> = (0..5).map(|slave| told(&bus, slave, Idn::COMMUNICATION_CONTROL)).collect();
    assert_eq!(control, [0, 0, soft, 0, 0], "S-0-1032 belongs to version 2");
    let starts: Vec<bool> = (0..5).map(|slave| told(&bus, slave, Idn::AT_START) > 0).collect();
    assert_eq!(starts, [true, false, true, true, true], "t1 belongs to SCP_Sync");
    let active = |slave: usize| {
        let store = bus.line.slaves()[slave].store();
        let data = store.get(store.find(Idn::SCP_ACTIVE).unwrap()).data();
        data.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect::<Vec<_>>()
    };
    assert_eq!(active(2), [0x0202, 0x0302, 0x0A01]);
    assert_eq!(active(3), [0x0201, 0x0301], "the lowest version of each class");
    let rows = |slave| {
        let row = |row: &crate::master::report::ReportRow| row.to_string();
        bus.master.report(SlaveId(slave)).iter().map(row).collect::<Vec<_>>()
    };
    assert!(rows(2).contains(&"CP2 read S-0-1037: 640 (0x280)".to_owned()), "{:?}", rows(2));
    assert!(!rows(3).iter().any(|row| row.contains("S-0-1037") || row.contains("S-0-1047")));
    let fixed = rows(1);
    assert!(!fixed.iter().any(|row| row.contains("S-0-1051") || row.contains(".1.2")), "{fixed:?}");
    // Its configuration lists are what they are: read and compared, never written.
    let lists: Vec<_> = fixed.iter().filter(|row| row.contains(".6:")).collect();
    assert!(!lists.is_empty() && lists.iter().all(|row| row.contains(" read ")), "{lists:?}");
    assert!(rows(0).contains(&"CP2 write S-0-1050.1.1: 49152 (0xc000)".to_owned()), "{:?}", rows(0));
}

#[test]
fn a_connection_that_the_slave_does_not_have_is_refused() {
    let mut bus = bus(2, 2, 1_000_000, true);
    let config = slave::Config { address: 2, connections: 1, ..slave::Config::default() };
    bus.line.slaves_mut()[1] = Slave::new(&config, Mirror::default());
    bus.line.mend(1);
    bus.auto_proceed = false;
    bus.master.set_target_phase(Phase::CP4);
    bus.state(State::Await2);
    bus.master.proceed().unwrap();
    let refused = Event::NoConnection { slave: SlaveId(1), instance: 1, available: 1 };
    bus.run_until("refused", |bus| bus.saw(&refused));
    bus.state(State::Await2);
    bus.master.exclude(SlaveId(1)).unwrap();
    bus.master.proceed().unwrap();
    bus.auto_proceed = true;
    bus.state(State::Cp4);
}

/// A bus of slaves with these addresses; those of the first list are configured.
fn addressed(configured: &[u16], found: &[u16], addresses: AddressPolicy) -> Bus {
    let count = u16::try_from(found.len()).unwrap();
    let model = bus(count, 1, 1_000_000, true);
    let connections = model.master.config().slaves[0].connections.clone();
    let slaves = configured.iter().map(|&address| SlaveConfig {
        address,
        connections: connections.clone(),
        hot_plug: None,
    });
    let config = MasterConfig { slaves: slaves.collect(), addresses, ..model.master.config().clone() };
    let slave = |&address| {
        let config = slave::Config { address, ..slave::Config::default() };
        Slave::new(&config, Mirror::default())
    };
    VirtualBus::new(config, Network::line(found.iter().map(slave).collect())).unwrap()
}

fn addresses(bus: &Bus) -> Vec<u16> {
    bus.master.slaves().map(|slave| slave.address).collect()
}

#[test]
fn slaves_without_an_address_of_their_own_are_given_one() {
    let mut bus = addressed(&[5, 9], &[0, 5, 5, 9, 7, 7], AddressPolicy::Assign);
    bus.up_to(Phase::CP4);
    // Nobody keeps the configured address 5 which two slaves share; the first one keeps 7.
    assert_eq!(addresses(&bus), [1, 2, 3, 9, 7, 4]);
    let assigned = |slave, old, new| Event::AddressAssigned { slave: SlaveId(slave), old, new };
    for event in [assigned(0, 0, 1), assigned(1, 5, 2), assigned(2, 5, 3), assigned(5, 7, 4)] {
        assert!(bus.saw(&event), "{event}");
    }
    assert_eq!(bus.log.iter().filter(|event| **event == Event::Missing { address: 5 }).count(), 1);
    assert_eq!(bus.master.slave_by_address(5), None);
    let configured: Vec<bool> = bus.master.slaves().map(|slave| slave.configured).collect();
    assert_eq!(configured, [false, false, false, true, false, false]);
    assert!(bus.master.consumer(SlaveId(1), 1).is_none() && bus.master.consumer(SlaveId(3), 1).is_some());
    let report: Vec<_> = bus.master.report(SlaveId(1)).iter().map(ToString::to_string).collect();
    assert_eq!(report[0], "CP2 write S-0-1040: 2 (0x2)");
    // The slaves keep what they were given.
    bus.master.set_target_phase(Phase::CP0);
    bus.state(State::Cp0);
    bus.log.clear();
    bus.up_to(Phase::CP4);
    assert_eq!(addresses(&bus), [1, 2, 3, 9, 7, 4]);
    let again = bus.log.iter().any(|event| {
        matches!(
            event,
            Event::DoubleAddress { .. } | Event::AddressAssigned { .. } | Event::AddressConflict { .. }
        )
    });
    assert!(!again, "{:?}", bus.log);
}

#[test]
fn without_the_policy_they_are_refused() {
    let mut bus = addressed(&[5], &[5, 0, 5], AddressPolicy::Refuse);
    bus.master.set_target_phase(Phase::CP4);
    bus.run_until("refused", |bus| bus.saw(&Event::AddressConflict { slave: SlaveId(0) }));
    assert!(bus.saw(&Event::DoubleAddress { address: 5, first: SlaveId(0), second: SlaveId(2) }));
    bus.cycles(50);
    assert_eq!((bus.master.state(), addresses(&bus)), (State::Await2, vec![5, 0, 5]));
}

#[test]
fn a_slave_that_does_not_take_its_address_is_named_and_the_others_go_on() {
    let mut bus = addressed(&[5], &[5, 0, 0], AddressPolicy::Assign);
    // S-0-1040 of the second slave cannot be written.
    bus.line.slaves_mut()[1].store_mut().define(Definition::value(Idn::ADDRESS, 0x7011_0001, "address", 0));
    bus.master.set_target_phase(Phase::CP4);
    bus.run_until("refused", |bus| bus.saw(&Event::AddressConflict { slave: SlaveId(1) }));
    let failed = bus.log.iter().find_map(|event| match event {
        Event::StepFailed { slave: SlaveId(1), idn, failure } => Some(format!("{idn}: {failure}")),
        _ => None,
    });
    assert_eq!(failed.as_deref(), Some("S-0-1040: operation data: operation data cannot be changed"));
    bus.master.exclude(SlaveId(1)).unwrap();
    bus.master.proceed().unwrap();
    bus.state(State::Cp4);
    assert_eq!(addresses(&bus), [5, 0, 2]);
}
