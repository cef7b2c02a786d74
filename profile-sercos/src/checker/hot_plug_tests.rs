//! Each rule of hot plug, kept and broken on purpose.

use std::fmt::Write as _;

use super::bus::VirtualBus;
use super::checked_bus::Tried as _;
use super::light::{COMMAND, FEEDBACK, Mirror};
use crate::master::config::{ConnectionConfig, MasterConfig, Ports, SlaveConfig};
use crate::master::event::{Event, Port};
use crate::master::layout::{ConnectionNeed, SlaveNeed};
use crate::master::phase::State;
use crate::slave::{self, Network, STRANGER, Slave};
use crate::wire::header::{Channel, HEADER_LEN, Header, Kind, Phase, PhaseField, TelegramType};
use crate::wire::hot_plug::{HOT_PLUG_LEN, HotPlug};
use crate::wire::scp::{ScpClass, ScpEntry};
use profile_generic::time::MonotonicTime;

const CLASSES: &[ScpEntry] = &[
    ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
    ScpEntry { class: ScpClass::SYNC, version: 1 },
    ScpEntry { class: ScpClass::NRT, version: 1 },
    ScpEntry { class: ScpClass::HOT_PLUG, version: 1 },
];

type Bus = VirtualBus<Network<Mirror>>;

fn slave(address: u16) -> Slave<Mirror> {
    let config = slave::Config { address, classes: CLASSES, ..slave::Config::default() };
    Slave::new(&config, Mirror::default())
}

/// Slaves 1 and 2, and a place for slave 7.
fn bus(ring: bool) -> Bus {
    let need = |instance, slave_produces| ConnectionNeed { instance, slave_produces, len: 6 };
    let room = SlaveNeed {
        connections: [need(0, false), need(1, true)].into_iter().collect(),
        ..SlaveNeed::default()
    };
    let configured = |address| SlaveConfig {
        address,
        connections: [
            ConnectionConfig::new(0, false, &[COMMAND]).unwrap(),
            ConnectionConfig::new(1, true, &[FEEDBACK]).unwrap(),
        ]
        .into_iter()
        .collect(),
        hot_plug: (address == 7).then(|| room.clone()),
    };
    let config = MasterConfig {
        slaves: [1, 2, 7].map(configured).to_vec(),
        ports: if ring { Ports::Both } else { Ports::One },
        stable_cycles: 10,
        ..MasterConfig::new([2, 0, 0, 0, 0, 1], 1_000_000)
    };
    let slaves = vec![slave(1), slave(2)];
    let network = if ring { Network::ring(slaves) } else { Network::line(slaves) };
    let mut bus = VirtualBus::new(config, network).unwrap();
    bus.master.set_target_phase(Phase::CP4);
    bus
}

fn plug(bus: &mut Bus) {
    bus.line.append(slave(7));
    bus.line.mend(2);
}

/// Changes the hot-plug field of the master's MDT0 where `which` says so.
fn master(bus: &mut Bus, change: impl Fn(&mut HotPlug) + 'static) {
    bus.outward = Box::new(move |frame| {
        if frame[14] & 0x4F == 0 {
            let mut field = HotPlug::parse(&frame[HEADER_LEN..]).unwrap();
            change(&mut field);
            field.emit(&mut frame[HEADER_LEN..]).unwrap();
        }
        true
    });
}

/// What the checker says first within 400 cycles of CP4 in which slave 7 is plugged in.
fn said(misdeed: impl FnOnce(&mut Bus)) -> String {
    let mut bus = bus(false);
    bus.state(State::Cp4);
    plug(&mut bus);
    misdeed(&mut bus);
    bus.breaking(|_| true, |bus| bus.cycles(400));
    let violation = &bus.checked.checker.violations()[0];
    format!("{}: {}", violation.offender, violation.rule)
}

#[test]
fn a_slave_comes_in_by_the_rules_and_is_watched_from_then_on() {
    let mut bus = bus(false);
    bus.state(State::Cp4);
    plug(&mut bus);
    bus.run_until("in", |bus| bus.log.iter().any(|event| matches!(event, Event::HotPlugged { .. })));
    bus.cycles(20);
    assert_eq!(bus.checked.checker.violations(), []);
    // Its slots are known: one byte beside them is somebody else's.
    let at = usize::from(bus.master.layout().slaves[2].as_ref().unwrap().svc_at.offset);
    bus.station = Box::new(move |number, outward, frame| {
        if number == STRANGER + 2 && outward && frame[14] & 0x4F == 0x40 {
            frame[HEADER_LEN + at - 1] ^= 1;
        }
    });
    bus.breaking(|_| true, |bus| bus.cycles(1));
    let violation = bus.checked.checker.violations()[0].to_string();
    assert!(violation.contains(&format!("changed byte {} of AT0 P", at - 1)), "{violation}");
}

/// An AT0 may end anywhere inside of the field; noise on the line makes such frames.
#[test]
fn an_at0_too_short_for_the_field_holds_no_answer() {
    let mut bus = bus(false);
    bus.state(State::Cp4);
    plug(&mut bus);
    let enabled = |bus: &Bus| bus.checked.checker.hot_plugs.is_enabled(Channel::Primary);
    bus.run_until("hot plug is on", enabled);
    let count = bus.checked.checker.violations().len();
    for len in 0..HOT_PLUG_LEN {
        let mut before = vec![0; HEADER_LEN + len];
        let telegram = TelegramType::new(Channel::Primary, Kind::At, 0);
        let header = Header { source: [2; 6], telegram, phase: PhaseField::new(false, 0, Phase::CP4) };
        header.emit(&mut before).unwrap();
        let mut after = before.clone();
        after[HEADER_LEN..].fill(0x55);
        bus.checked.checker.passed(MonotonicTime::ZERO, STRANGER + 2, true, &before, &after);
        assert_eq!(bus.checked.checker.violations().len(), count, "{len} bytes");
    }
}

#[test]
fn every_rule_of_hot_plug_is_seen_broken() {
    let mut seen = String::new();
    let mut case = |what: &str, said: String| writeln!(seen, "{what:<28} {said}").unwrap();
    let on = |code: u8, change: fn(&mut HotPlug)| {
        said(move |bus| {
            master(bus, move |field| {
                if field.word & HotPlug::ENABLED != 0 && field.code().0 == code {
                    change(field);
                }
            });
        })
    };
    case("cycle time", on(1, |field| field.info += 1));
    case("t6", on(2, |field| field.info += 1));
    case("t7", on(3, |field| field.info += 1));
    case("length of an MDT", on(0x10, |field| field.info += 2));
    case("length of an AT", on(0x21, |field| field.info = 40));
    case("communication version", on(5, |field| field.info |= 1 << 20));
    case("unused bit", on(1, |field| field.word |= 1 << 10));
    case("unknown code", on(1, |field| field.word = field.word & 0xFF00 | 0x77));
    case("not supported", on(1, |field| field.word &= !HotPlug::SUPPORTED));
    case("parameter to one slave", on(0x11, |field| field.selection = 7));
    case("scan of an address", on(0, |field| field.selection = 7));
    case("place of another slave", on(0x80, |field| field.info = 14));
    case("place beyond the telegram", on(0x81, |field| field.info = 0x0FF0));
    case("address that takes part", on(0x80, |field| field.selection = 2));
    case("hot plug that is half off", {
        said(|bus| {
            master(bus, |field| {
                if field.word & HotPlug::SWITCH_TO_SVC != 0 {
                    field.word &= !HotPlug::ENABLED;
                }
            });
        })
    });
    let station = |misdeed: fn(&mut [u8])| {
        said(move |bus| {
            bus.station = Box::new(move |number, outward, frame| {
                if number == STRANGER + 2 && outward && frame[14] & 0x4F == 0x40 {
                    misdeed(&mut frame[HEADER_LEN..]);
                }
            });
        })
    };
    case(
        "an answer nobody asked",
        station(|data| {
            if data[2] != 0 {
                data[2] = 0x42;
            }
        }),
    );
    case("a byte beside the field", station(|data| data[8] ^= u8::from(data[2] != 0)));
    case("a slave that takes part", {
        said(|bus| {
            bus.station = Box::new(|number, outward, frame| {
                if number == 2 && outward && frame[14] & 0x4F == 0x40 && frame[HEADER_LEN + 2] == 0 {
                    frame[HEADER_LEN] ^= 7;
                }
            });
        })
    });
    case("in CP3", {
        let mut bus = bus(false);
        bus.state(State::Check3);
        master(&mut bus, |field| field.word |= HotPlug::SUPPORTED | HotPlug::ENABLED);
        bus.breaking(|_| true, |bus| bus.cycles(1));
        bus.checked.checker.violations()[0].rule.to_string()
    });
    case("in a closed ring", {
        let mut bus = bus(true);
        bus.state(State::Cp4);
        bus.cycles(5);
        master(&mut bus, |field| field.word |= HotPlug::SUPPORTED | HotPlug::ENABLED);
        bus.breaking(|_| true, |bus| bus.cycles(2));
        assert!(bus.line.master_link(Port::Two));
        bus.checked.checker.violations()[0].rule.to_string()
    });
    insta::assert_snapshot!(seen);
}
