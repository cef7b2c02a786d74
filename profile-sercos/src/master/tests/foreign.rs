//! Two masters on one wire.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use crate::master::Master;
use crate::master::foreign::{LISTEN, OtherMaster};
use crate::wire::header::{Channel, Header, Kind, PhaseField, TelegramType};

const OTHER: MacAddress = [2, 0, 0, 0, 0, 9];

/// What is on the wire.
type Wire = Rc<RefCell<Vec<Vec<u8>>>>;

/// A rig all of whose telegrams, as they come back, are on the wire as well.
fn on_a_wire(addresses: &[u16]) -> (Rig, Wire) {
    let mut rig = Rig::of(addresses);
    let wire = Wire::default();
    let taken = Rc::clone(&wire);
    rig.cable = Box::new(move |frame| {
        taken.borrow_mut().push(frame.clone());
        true
    });
    (rig, wire)
}

fn second() -> Master {
    let mut master = Master::new(MasterConfig { mac: OTHER, ..config(&[1, 2]) }).unwrap();
    master.set_target_phase(Phase::CP4);
    master
}

/// Lets a master hear what is on the wire and do what is due, and gives what it sends.
fn attend(master: &mut Master, now: MonotonicTime, wire: &Wire) -> Vec<Vec<u8>> {
    for frame in wire.borrow_mut().drain(..) {
        let _ = master.handle_frame(now, Port::One, &frame);
    }
    let mut out = Vec::new();
    while let Some(Output::Transmit { frame, .. }) = master.poll(now) {
        out.push(frame.to_vec());
    }
    out
}

fn events(master: &mut Master) -> Vec<Event> {
    std::iter::from_fn(|| master.poll_event()).collect()
}

/// An MST without values.
fn mst(source: MacAddress, phase: Phase) -> Vec<u8> {
    let mut frame = vec![0; 60];
    let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
    Header { source, telegram, phase: PhaseField::new(false, 0, phase) }.emit(&mut frame).unwrap();
    frame
}

#[test]
fn a_master_that_comes_second_sends_nothing_and_the_first_loses_no_cycle() {
    // It begins to listen in each phase of the first one, also in its silences, where nothing is heard for 120 ms.
    for state in [State::Settle, State::Silence1, State::Read2, State::Silence3, State::Cp4] {
        let (mut rig, wire) = on_a_wire(&[1, 2]);
        rig.master.set_target_phase(Phase::CP4);
        rig.state(state);
        wire.borrow_mut().clear();
        let mut late = second();
        for _ in 0..300 {
            assert!(attend(&mut late, rig.now, &wire).is_empty(), "{state:?}");
            rig.step();
        }
        assert_eq!((late.state(), late.phase()), (State::Occupied, None), "{state:?}");
    }
    let (mut rig, wire) = on_a_wire(&[1, 2]);
    let mut other = second();
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Settle);
    while rig.cycles.len() < 1_000 {
        assert!(attend(&mut other, rig.now, &wire).is_empty());
        rig.step();
    }
    assert_eq!(rig.master.state(), State::Cp4);
    rig.cycles(1);
    assert_eq!(rig.master.statistics().at_missing, 0);
    assert_eq!(rig.master.statistics().refused(Refusal::Foreign), 0);
    assert_eq!(rig.master.consumer(SlaveId(1), 1).unwrap().state, ConsumerState::Consuming);
    // What it has heard, once: after ten cycles of CP0.
    let told = OtherMaster {
        source: MAC,
        phase: Phase::CP0,
        port: Port::One,
        cycle: Some(DurationNs::from_millis(1)),
    };
    assert_eq!(events(&mut other), [Event::OtherMaster(told)]);
    let text = "another master sends on this wire: CP0 from 02:00:00:00:00:01, a cycle of about 1000 us, heard on port 1";
    assert_eq!(told.to_string(), text);
    assert!(other.other_master().is_some_and(|heard| heard.phase == Phase::CP4), "it listens on");

    // The first one ends, and the second begins once the wire has been silent.
    rig.master.stop();
    while rig.master.phase().is_some() {
        rig.step();
        assert!(attend(&mut other, rig.now, &wire).is_empty());
    }
    let silent = rig.cycles.last().unwrap().0;
    let first = loop {
        let at = other.wake_at().unwrap();
        if !attend(&mut other, at, &wire).is_empty() {
            break at;
        }
    };
    let waited = first - silent;
    assert!(waited >= LISTEN && waited < DurationNs::from_millis(1_300), "{waited}");
    assert_eq!((other.state(), other.other_master()), (State::Settle, None));
}

#[test]
fn two_masters_that_begin_in_the_same_moment_do_not_stay_on_the_wire_together() {
    let mut masters = [second(), Master::new(config(&[1, 2])).unwrap()];
    masters[1].set_target_phase(Phase::CP4);
    let mut now = MonotonicTime::ZERO;
    let mut together = 0;
    while now < MonotonicTime(10_000_000_000) {
        let sent = masters.each_mut().map(|master| attend(master, now, &Wire::default()));
        together += u32::from(sent.iter().all(|frames| !frames.is_empty()));
        let [first, second] = sent;
        for (place, frames) in [(1, first), (0, second)] {
            attend(&mut masters[place], now, &Rc::new(RefCell::new(frames)));
        }
        now = now + DurationNs(250_000);
    }
    let sending = masters.iter().filter(|master| master.phase().is_some()).count();
    assert_eq!(sending, 1, "one has the wire");
    assert_eq!(masters.iter().filter(|master| master.state() == State::Occupied).count(), 1);
    assert!(together <= 4, "they were on the wire together for {together} cycles");
}

#[test]
fn below_cp4_a_master_gives_way_at_once_and_comes_back() {
    for state in [State::Settle, State::Cp0, State::Silence1, State::Cp1, State::Await2, State::Await3] {
        let mut rig = Rig::of(&[1, 2]);
        rig.auto_proceed = state == State::Await3;
        let target = match state {
            State::Await3 => Phase::CP3,
            State::Await2 => Phase::CP2,
            State::Cp0 | State::Settle => Phase::CP0,
            _ => Phase::CP1,
        };
        rig.master.set_target_phase(target);
        rig.state(state);
        rig.log.clear();
        // One is a stray.
        let stray = mst(OTHER, Phase::CP2);
        assert_eq!(rig.master.handle_frame(rig.now, Port::One, &stray), Err(Refusal::Foreign));
        assert_eq!(rig.master.state(), state);
        let later = rig.now + DurationNs::from_millis(2);
        assert_eq!(rig.master.handle_frame(later, Port::One, &stray), Err(Refusal::Foreign));
        assert_eq!((rig.master.state(), rig.master.phase()), (State::Occupied, None), "{state:?}");
        let sent = rig.master.statistics().cycles;
        rig.now = later;
        rig.state(State::Settle);
        assert_eq!(rig.master.statistics().cycles, sent + 1, "the first one after it");
        assert!(rig.now - later >= LISTEN);
        let other = OtherMaster {
            source: OTHER,
            phase: Phase::CP2,
            port: Port::One,
            cycle: Some(DurationNs::from_millis(2)),
        };
        assert_eq!(rig.log[..2], [Event::OtherMaster(other), Event::GaveWay], "{state:?}");
        rig.auto_proceed = true;
        rig.up_to(Phase::CP4);
    }
}

#[test]
fn in_cp4_the_application_is_told_and_decides_when_to_give_way() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    rig.cycles(300);
    rig.log.clear();
    rig.master.give_way(rig.now);
    assert_eq!(rig.master.state(), State::Cp4, "nobody was heard");
    // Strays that are further apart than a master's telegrams, and an AT, which nobody starts a cycle with.
    for _ in 0..3 {
        let _ = rig.master.handle_frame(rig.now, Port::One, &mst(OTHER, Phase::CP4));
        rig.cycles(201);
    }
    let mut at = mst(OTHER, Phase::CP4);
    at[14] |= 0x40;
    let crc = crc32fast::hash(&at[..16]);
    at[16..20].copy_from_slice(&crc.to_le_bytes());
    for _ in 0..10 {
        assert_eq!(rig.master.handle_frame(rig.now, Port::One, &at), Err(Refusal::Foreign));
    }
    assert_eq!((rig.log.len(), rig.master.other_master()), (0, None));

    for _ in 0..5 {
        let _ = rig.master.handle_frame(rig.now, Port::One, &mst(OTHER, Phase::CP0));
        rig.cycles(1);
    }
    assert_eq!(rig.log.iter().filter(|event| matches!(event, Event::OtherMaster(_))).count(), 1);
    assert_eq!(rig.master.statistics().refused(Refusal::Foreign), 3 + 10 + 5);
    assert_eq!(rig.master.state(), State::Cp4, "the axes are led until they stand");
    rig.master.give_way(rig.now);
    let sent = rig.master.statistics().cycles;
    assert_eq!(rig.master.phase(), None);
    // As long as the other one goes on.
    for _ in 0..1_000 {
        rig.now = rig.now + DurationNs::from_millis(1);
        let _ = rig.master.handle_frame(rig.now, Port::One, &mst(OTHER, Phase::CP4));
        assert!(rig.master.wake_at().unwrap() > rig.now);
    }
    assert_eq!(rig.master.statistics().cycles, sent);
    rig.log.clear();
    rig.up_to(Phase::CP4);
    rig.cycles(5);
    assert_eq!(rig.master.consumer(SlaveId(1), 1).unwrap().state, ConsumerState::Consuming);
    // From then on he is somebody new.
    rig.log.clear();
    for _ in 0..3 {
        let _ = rig.master.handle_frame(rig.now, Port::One, &mst(OTHER, Phase::CP0));
        rig.cycles(1);
    }
    assert_eq!(rig.log.iter().filter(|event| matches!(event, Event::OtherMaster(_))).count(), 1);
}

#[test]
fn a_master_with_the_same_address_is_known_by_its_phase() {
    let mut rig = Rig::of(&[1]);
    rig.up_to(Phase::CP4);
    rig.log.clear();
    // Late copies of the phase-up are none.
    for _ in 0..10 {
        assert_eq!(rig.master.handle_frame(rig.now, Port::One, &mst(MAC, Phase::CP3)), Err(Refusal::Phase));
    }
    rig.cycles(250);
    assert_eq!(rig.master.other_master(), None);
    for _ in 0..2 {
        assert_eq!(rig.master.handle_frame(rig.now, Port::One, &mst(MAC, Phase::CP0)), Err(Refusal::Foreign));
        rig.cycles(1);
    }
    assert!(rig.master.other_master().is_some_and(|other| other.source == MAC));
}

#[test]
fn a_master_that_is_stopped_while_it_waits_ends_at_once() {
    let mut master = second();
    let now = MonotonicTime::ZERO;
    assert!(attend(&mut master, now, &Wire::default()).is_empty());
    assert_eq!((master.state(), master.wake_at()), (State::Listen, Some(now + LISTEN)));
    let wire = Rc::new(RefCell::new(vec![mst(MAC, Phase::CP4)]));
    assert!(attend(&mut master, now, &wire).is_empty());
    assert_eq!(master.state(), State::Occupied);
    master.stop();
    wire.borrow_mut().push(mst(MAC, Phase::CP4));
    assert!(attend(&mut master, now, &wire).is_empty());
    assert_eq!((master.state(), events(&mut master)), (State::Nrt, vec![Event::Stopped]));
}
