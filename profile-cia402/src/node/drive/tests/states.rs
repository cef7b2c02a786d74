//! The state machine whole: each state with each event, and the option codes.

use std::fmt::Write as _;

use profile_generic::fault::FaultCause;

use crate::drive::{State, Statusword, index};
use crate::node::Application as _;
use crate::node::application::Event;
use crate::node::tests::Rig;

const TURN: i64 = 65_536;

/// What the state goes through in a time, with whether the axis turns at the end.
fn watch(rig: &mut Rig, milliseconds: usize) -> String {
    let mut seen = Vec::new();
    for _ in 0..milliseconds {
        let state = rig.state();
        if seen.last() != Some(&state) {
            seen.push(state);
        }
        rig.run(1);
    }
    let turns = rig.node.application().axes()[0].actual().velocity.0.abs() > 100_000_000;
    let seen: Vec<_> = seen.into_iter().map(State::name).collect();
    format!("{}{}", seen.join(" -> "), if turns { ", turning" } else { "" })
}

fn word(rig: &mut Rig, word: i64) {
    rig.set(index::CONTROLWORD, 0, word).expect("a controlword");
}

fn event(rig: &mut Rig, event: Event) {
    let now = rig.now;
    rig.node.handle_time(now);
    let mut dictionary = rig.node.dictionary().clone();
    rig.node.application_mut().event(event, &mut dictionary);
    *rig.node.dictionary_mut() = dictionary;
}

/// In pv, at ten turns a second.
fn turn(rig: &mut Rig) {
    rig.enable(3);
    rig.set(index::TARGET_VELOCITY, 0, 10 * TURN).expect("a velocity");
    assert!(rig.run_until(1_000, |rig| rig.status(0).contains(Statusword::TARGET_REACHED)));
}

type Start = (&'static str, fn(&mut Rig));

const STARTS: [Start; 9] = [
    ("not ready to switch on", |rig| {
        event(rig, Event::Reset);
        rig.run(1);
    }),
    ("switch on disabled", |_| {}),
    ("ready to switch on", |rig| word(rig, 6)),
    ("switched on", |rig| {
        word(rig, 6);
        word(rig, 7);
        rig.run(2);
    }),
    ("enabling", |rig| {
        word(rig, 6);
        word(rig, 7);
        rig.run(2);
        word(rig, 15);
        rig.run(2);
    }),
    ("operation enabled, turning", turn),
    ("quick stop active, holding", |rig| {
        rig.set(index::QUICK_STOP_OPTION, 0, 6).expect("an option");
        turn(rig);
        word(rig, 2);
        rig.run(300);
    }),
    ("fault reaction active", |rig| {
        rig.set(index::QUICK_STOP_DECELERATION, 0, 100 * TURN).expect("a deceleration");
        turn(rig);
        rig.set(0x2FFF, 1, 0x9000).expect("a fault");
        rig.run(5);
    }),
    ("fault", |rig| {
        rig.set(0x2FFF, 1, 0x9000).expect("a fault");
        rig.run(5);
        word(rig, 0);
    }),
];

type What = (&'static str, fn(&mut Rig));

const EVENTS: [What; 17] = [
    ("shutdown", |rig| word(rig, 6)),
    ("switch on", |rig| word(rig, 7)),
    ("enable operation", |rig| word(rig, 15)),
    ("disable voltage", |rig| word(rig, 0)),
    ("quick stop", |rig| word(rig, 2)),
    ("quick stop, then enable", |rig| {
        word(rig, 2);
        word(rig, 15);
    }),
    ("fault reset", |rig| word(rig, 0x80)),
    ("halt", |rig| word(rig, 0x10F)),
    ("no mode", |rig| rig.set(index::MODE, 0, 0).expect("a mode")),
    ("local control, shutdown", |rig| {
        rig.node.application_mut().axes_mut()[0].set_remote(false);
        word(rig, 6);
    }),
    ("fault 7305h", |rig| rig.set(0x2FFF, 1, 0x7305).expect("a fault")),
    ("servo fault that coasts", |rig| {
        rig.node.application_mut().axes_mut()[0].servo_mut().raise_fault(FaultCause::OVER_CURRENT);
    }),
    ("servo fault that brakes", |rig| {
        rig.node.application_mut().axes_mut()[0].servo_mut().raise_fault(FaultCause::EXTERNAL_INPUT);
    }),
    ("main power off", |rig| rig.node.application_mut().axes_mut()[0].set_main_power(false)),
    ("connection lost", |rig| event(rig, Event::ConnectionLost)),
    ("SYNC lost", |rig| event(rig, Event::SyncLost)),
    ("reset", |rig| event(rig, Event::Reset)),
];

#[test]
fn every_state_with_every_event() {
    let mut text = String::new();
    for (start, begin) in STARTS {
        writeln!(text, "{start}").expect("a string");
        for (name, happen) in EVENTS {
            let mut rig = Rig::new(1);
            begin(&mut rig);
            happen(&mut rig);
            writeln!(text, "  {name:<24} {}", watch(&mut rig, 600)).expect("a string");
        }
    }
    insta::assert_snapshot!(text);
}

/// How fast the axis comes to a stand, and where it ends, with each option code of each object.
#[test]
fn option_codes_tell_how_the_axis_stops() {
    let mut text = String::new();
    type Object = (&'static str, u16, std::ops::RangeInclusive<i64>, fn(&mut Rig));
    let objects: [Object; 6] = [
        ("605Ah quick stop", index::QUICK_STOP_OPTION, 0..=8, |rig| word(rig, 2)),
        ("605Bh shutdown", index::SHUTDOWN_OPTION, 0..=1, |rig| word(rig, 6)),
        ("605Ch disable operation", index::DISABLE_OPTION, 0..=1, |rig| word(rig, 7)),
        ("605Dh halt", index::HALT_OPTION, 1..=4, |rig| word(rig, 0x10F)),
        ("605Eh fault reaction", index::FAULT_REACTION_OPTION, 0..=4, |rig| {
            rig.set(0x2FFF, 1, 0x9000).expect("a fault");
        }),
        ("6007h abort connection", index::ABORT_CONNECTION_OPTION, 0..=3, |rig| {
            event(rig, Event::ConnectionLost)
        }),
    ];
    for (name, object, codes, happen) in objects {
        for code in codes {
            let mut rig = Rig::new(1);
            // Ramps of 50 and 200 turns per second squared: 200 and 50 ms from ten turns a second.
            rig.set(index::PROFILE_DECELERATION, 0, 50 * TURN).expect("a deceleration");
            rig.set(index::QUICK_STOP_DECELERATION, 0, 200 * TURN).expect("a deceleration");
            rig.set(object, 0, code).expect("an option");
            turn(&mut rig);
            happen(&mut rig);
            let speed = |rig: &mut Rig| rig.node.application().axes()[0].actual().velocity.0.abs();
            let start = rig.now;
            rig.run_until(1_000, |rig| speed(rig) < 100_000_000);
            let time = rig.now.since(start).0 / 1_000_000;
            let path = watch(&mut rig, 50);
            writeln!(text, "{name:<24} {code}: below 0.1 turns/s after {time:>4} ms, {path}")
                .expect("a string");
        }
    }
    insta::assert_snapshot!(text);
}

#[test]
fn a_fault_is_told_held_and_reset() {
    let mut rig = Rig::new(1);
    rig.enable(9);
    rig.take();
    rig.set(0x2FFF, 1, 0x7305).unwrap();
    assert_eq!(rig.state(), State::FaultReactionActive);
    assert!(rig.run_until(50, |rig| rig.state() == State::Fault));
    assert_eq!(rig.take_of(0x85), [[0x05, 0x73, 0x21, 1, 0, 0, 0, 0]]);
    assert_eq!((rig.read(index::ERROR_CODE, 0), rig.read(0x1001, 0)), (Ok(0x7305), Ok(0x21)));
    rig.set(0x2FFF, 1, 0x4310).unwrap();
    assert_eq!(rig.read(index::ERROR_CODE, 0), Ok(0x7305), "the first one stays");
    word(&mut rig, 0x8F);
    rig.run(5);
    assert_eq!(rig.state(), State::SwitchOnDisabled, "bit 7 alone enables nothing");
    assert_eq!(rig.take_of(0x85), [[0, 0, 0, 1, 0, 0, 0, 0]]);
    assert_eq!((rig.read(index::ERROR_CODE, 0), rig.read(0x1001, 0)), (Ok(0), Ok(0)));
    rig.enable(9);
}

#[test]
fn a_fault_whose_cause_stays_is_not_reset() {
    let mut rig = Rig::new(1);
    rig.enable(9);
    let servo = |rig: &mut Rig, on: bool| {
        let servo = rig.node.application_mut().axes_mut()[0].servo_mut();
        if on {
            servo.raise_fault(FaultCause::OVER_CURRENT)
        } else {
            servo.clear_fault(FaultCause::OVER_CURRENT)
        }
    };
    servo(&mut rig, true);
    rig.run(50);
    assert_eq!((rig.state(), rig.read(index::ERROR_CODE, 0)), (State::Fault, Ok(0x2310)));
    for _ in 0..2 {
        word(&mut rig, 0x80);
        word(&mut rig, 0);
        rig.run(5);
    }
    assert_eq!(rig.state(), State::Fault);
    servo(&mut rig, false);
    word(&mut rig, 0x80);
    assert_eq!(rig.state(), State::SwitchOnDisabled);
}

#[test]
fn without_voltage_nothing_is_switched_on() {
    let mut rig = Rig::new(1);
    rig.node.application_mut().axes_mut()[0].set_main_power(false);
    rig.run_until(5_000, |rig| !rig.status(0).contains(Statusword::VOLTAGE_ENABLED));
    word(&mut rig, 6);
    word(&mut rig, 7);
    rig.run(50);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
    rig.node.application_mut().axes_mut()[0].set_main_power(true);
    assert!(rig.run_until(2_000, |rig| rig.state() == State::SwitchedOn), "as soon as there is");
}

/// A fault in a state without torque must not give any.
#[test]
fn a_fault_never_gives_torque_to_an_axis_that_has_none() {
    for words in [&[][..], &[6], &[6, 7]] {
        let mut rig = Rig::new(1);
        for &number in words {
            word(&mut rig, number);
            rig.run(5);
        }
        rig.set(0x2FFF, 1, 0x9000).unwrap();
        for _ in 0..20 {
            rig.run(1);
            let report = rig.node.application().axes()[0].actual().report;
            assert_eq!(report, profile_generic::state::Report::Ready, "{words:?}");
        }
        assert_eq!(rig.state(), State::Fault);
    }
}
