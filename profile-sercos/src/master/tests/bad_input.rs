//! Slaves that do what they must not, one at a time: each is named, and the others keep running.

use crate::master::event::Invalid;
use std::collections::VecDeque;

use super::full_slaves::{FullRig, full_rig};
use super::*;
use crate::checker::checked_bus::Tried;
use crate::checker::light::{FEEDBACK, MODE, Mirror};
use crate::checker::{Offender, Rule, Violation};
use crate::slave::communication::FixedConnection;
use crate::slave::{self, Slave};
use crate::wire::data_status::DataStatus;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, TelegramType};
use crate::wire::idn::Idn;
use crate::wire::layout::Offset;
use crate::wire::scp::{ScpClass, ScpEntry};
use crate::wire::svc::SVC_LEN;

/// Position and SlaveId of the slave that misbehaves.
const BAD: u16 = 2;
const BAD_ID: SlaveId = SlaveId(1);

fn is(frame: &[u8], kind: Kind, number: u8) -> bool {
    let telegram = TelegramType(frame[14]);
    telegram.kind() == kind && telegram.number() == number
}

/// A line of three slaves in CP4 that exchanges values.
fn in_cp4() -> FullRig {
    let mut rig = full_rig(3);
    rig.up_to(Phase::CP4);
    rig.cycles(3);
    runs(&mut rig, &[0, 1, 2]);
    rig.log.clear();
    rig
}

/// Values go to these slaves and come back.
fn runs(rig: &mut FullRig, slaves: &[u16]) {
    static NEXT: std::sync::atomic::AtomicI32 = std::sync::atomic::AtomicI32::new(1);
    let value = NEXT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    for _ in 0..3 {
        for slave in slaves.iter().map(|&slave| SlaveId(slave)) {
            rig.master.producer(slave, 0).unwrap().copy_from_slice(&value.to_le_bytes());
            assert!(rig.master.commit(slave, 0));
        }
        rig.step();
    }
    for slave in slaves.iter().map(|&slave| SlaveId(slave)) {
        let consumer = rig.master.consumer(slave, 1).unwrap();
        assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true), "{slave}");
        assert_eq!(consumer.data, value.to_le_bytes(), "{slave}");
    }
}

/// Changes what the bad slave puts into a part of AT0, from now on.
fn misbehave(rig: &mut FullRig, at: Offset, len: usize, mut misdeed: impl FnMut(&mut [u8]) + 'static) {
    let range = at.range(len);
    rig.station = Box::new(move |slave, outward, frame| {
        if slave == BAD && outward && is(frame, Kind::At, at.telegram) {
            misdeed(&mut frame[HEADER_LEN..][range.clone()]);
        }
    });
}

fn behave(rig: &mut FullRig) {
    rig.station = Box::new(|_, _, _| {});
}

/// The bad slave breaks this rule.
fn by_the_bad_one(broken: fn(&Rule) -> bool) -> impl Fn(&Violation) -> bool + 'static {
    move |violation| violation.offender == Offender::Slave(BAD) && broken(&violation.rule)
}

fn svc_at(rig: &FullRig) -> Offset {
    rig.master.layout().slaves[1].as_ref().unwrap().svc_at
}

fn fix_crc(frame: &mut [u8]) {
    let crc = crc32fast::hash(&frame[..16]);
    frame[16..20].copy_from_slice(&crc.to_le_bytes());
}

/// What follows for the checker when a cycle seems to have no MST: its telegrams are those of the cycle before.
fn without_an_mst(violation: &Violation) -> bool {
    use Rule as R;
    let follows = matches!(
        violation.rule,
        R::Order { .. }
            | R::PhaseMixed { .. }
            | R::TelegramTooLate { .. }
            | R::CycleCounter { .. }
            | R::MstInterval { .. }
    );
    violation.offender == Offender::Master && follows
}

/// Two cycles of damaged MDTs: the slaves go on with the values they had and take the next good ones.
fn damaged_on_the_way_out(said: &str, broken: fn(&Rule) -> bool, damage: fn(&mut Vec<u8>)) {
    let mut rig = in_cp4();
    let msts_missed = |rig: &FullRig| {
        let stores = rig.line.slaves().iter().map(Slave::store);
        stores.map(|store| store.number_of(Idn::MST_ERROR_COUNTER)).collect::<Vec<_>>()
    };
    let before = msts_missed(&rig);
    rig.outward = Box::new(move |frame| {
        if is(frame, Kind::Mdt, 0) {
            damage(frame);
        }
        true
    });
    let named =
        move |violation: &Violation| violation.offender == Offender::Master && broken(&violation.rule);
    rig.tolerating(without_an_mst, |rig| {
        rig.breaking(named, |rig| {
            rig.cycles(2);
            rig.outward = Box::new(|_| true);
            rig.cycles(2);
        });
    });
    let lost = |event: &Event| matches!(event, Event::SlaveLost { .. } | Event::AllSlavesLost);
    assert!(!rig.log.iter().any(lost), "{:?}", rig.log);
    runs(&mut rig, &[0, 1, 2]);
    for slave in rig.line.slaves() {
        assert_eq!(slave.fault(), None);
    }
    // The master counts what comes back with the reason, and each slave the MSTs that it missed.
    for reason in Refusal::ALL {
        let expected = if reason.to_string() == said { 2 } else { 0 };
        assert_eq!(rig.master.statistics().refused(reason), expected, "{reason}");
    }
    let missed: Vec<_> = msts_missed(&rig).iter().zip(before).map(|(now, before)| now - before).collect();
    let none = matches!(said, "wrong length" | "wrong cycle counter");
    assert_eq!(missed, if none { [0; 3] } else { [2; 3] }, "S-0-1028");
}

#[test]
fn an_mdt_with_a_wrong_crc() {
    damaged_on_the_way_out("wrong header CRC", |rule| *rule == Rule::Header, |frame| frame[16] ^= 1);
}

#[test]
fn an_mdt_with_a_wrong_number() {
    damaged_on_the_way_out(
        "telegram number that is not in use",
        |rule| matches!(rule, Rule::Unexpected { .. }),
        |frame| {
            frame[14] |= 2;
            fix_crc(frame);
        },
    );
}

#[test]
fn an_mdt_with_a_wrong_counter() {
    damaged_on_the_way_out(
        "wrong cycle counter",
        |rule| matches!(rule, Rule::CycleCounter { .. }),
        |frame| {
            frame[15] ^= 0x40;
            fix_crc(frame);
        },
    );
}

#[test]
fn an_mdt_of_a_wrong_length() {
    damaged_on_the_way_out(
        "wrong length",
        |rule| matches!(rule, Rule::Length { .. }),
        |frame| frame.truncate(HEADER_LEN + 16),
    );
}

#[test]
fn an_mdt_of_a_wrong_phase_ends_communication_and_the_bus_comes_up_again() {
    let mut rig = in_cp4();
    rig.outward = Box::new(|frame| {
        frame[15] = frame[15] & 0xF0 | 2;
        fix_crc(frame);
        true
    });
    let phase = |violation: &Violation| matches!(violation.rule, Rule::PhaseSequence { .. });
    // A frame of CP4 has not the telegrams of CP2, and the way back to CP4 begins in the middle of a step.
    let follows = |violation: &Violation| {
        use Rule as R;
        matches!(violation.rule, R::Length { .. } | R::Missing { .. } | R::StepTooEarly { .. })
            && violation.offender == Offender::Master
    };
    rig.tolerating(follows, |rig| {
        rig.breaking(phase, |rig| {
            rig.cycles(1);
            rig.outward = Box::new(|_| true);
            // Each slave falls to NRT by itself: the master sees them go and names each.
            rig.run_until("lost", |rig| rig.saw(&Event::AllSlavesLost));
        });
    });
    for (slave, address) in (0..3).map(SlaveId).zip(1..) {
        let lost = Event::SlaveLost { slave, address, phase: Phase::CP4 };
        assert!(rig.saw(&lost));
        assert_eq!(
            lost.to_string(),
            format!("slave at position {address} with address {address} was lost in CP4")
        );
    }
    rig.state(State::Cp0);
    rig.log.clear();
    rig.up_to(Phase::CP4);
}

/// The service channel's answers of the bad slave come so many cycles late.
fn late_by(rig: &mut FullRig, cycles: usize) {
    let mut answers = VecDeque::new();
    misbehave(rig, svc_at(rig), SVC_LEN, move |svc| {
        answers.push_back(svc.to_vec());
        if answers.len() > cycles {
            answers.pop_front();
        }
        svc.copy_from_slice(&answers[0]);
    });
}

#[test]
fn a_slave_that_answers_late_is_waited_for() {
    let mut rig = in_cp4();
    let at = svc_at(&rig);
    assert_eq!(at.telegram, 0);
    late_by(&mut rig, 5);
    let start = rig.cycles.len();
    let outcome = rig.request(BAD_ID, SvcRequest::read(MODE));
    assert!(outcome.result.is_ok(), "{outcome}");
    assert!(rig.cycles.len() - start >= 10);
    let start = rig.cycles.len();
    assert!(rig.request(SlaveId(0), SvcRequest::read(Idn::CYCLE_TIME)).result.is_ok());
    assert_eq!(rig.cycles.len() - start, 3, "the others are as fast as before");
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_slave_that_answers_too_late_is_named() {
    let mut rig = in_cp4();
    late_by(&mut rig, 15);
    let outcome = rig.request(BAD_ID, SvcRequest::read(Idn::CYCLE_TIME));
    assert_eq!(outcome.to_string(), "S-0-1002: no handshake from the slave within 10 cycles");
    assert!(rig.request(SlaveId(2), SvcRequest::read(Idn::CYCLE_TIME)).result.is_ok());
    behave(&mut rig);
    rig.cycles(3);
    assert!(rig.request(BAD_ID, SvcRequest::read(Idn::CYCLE_TIME)).result.is_ok());
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_slave_that_sets_error_in_its_device_status() {
    let mut rig = in_cp4();
    let at = rig.master.layout().slaves[1].as_ref().unwrap().status;
    let status = DeviceStatus::DEVICE_ERROR | DeviceStatus::COMMUNICATION_WARNING;
    let words = move |word: &mut [u8]| {
        word[0] |= 0x80;
        word[1] |= 0x80;
    };
    misbehave(&mut rig, at, 2, words);
    rig.cycles(3);
    let event = Event::DeviceStatus { slave: BAD_ID, status };
    assert_eq!(rig.log, std::slice::from_ref(&event), "told once");
    assert_eq!(event.to_string(), "slave at position 2: communication warning, device error");
    runs(&mut rig, &[0, 1, 2]);
    behave(&mut rig);
    rig.cycles(1);
    let over = Event::DeviceStatus { slave: BAD_ID, status: DeviceStatus::empty() };
    assert_eq!(rig.log.last(), Some(&over));
    assert_eq!(over.to_string(), "slave at position 2: no error or warning any more");
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_slave_that_refuses_s_0_0127_is_named_and_left_out() {
    let mut rig = full_rig(3);
    rig.line.slaves_mut()[1].application_mut().refuses = Some(Phase::CP3);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    let refused =
        Event::CheckFailed { slave: BAD_ID, phase: Phase::CP2, invalid: Invalid::from_iter([MODE]) };
    rig.run_until("refused", |rig| rig.saw(&refused));
    let said = "slave at position 2: the check to leave CP2 failed: the slave reports as invalid S-0-0032";
    assert_eq!(refused.to_string(), said);
    rig.state(State::Await2);
    let report: Vec<_> = rig.master.report(BAD_ID).iter().map(ToString::to_string).collect();
    let said = "CP2 execute S-0-0127: procedure command";
    assert!(report.iter().any(|row| row.starts_with(said)), "{report:?}");
    assert!(report.iter().any(|row| row.starts_with("CP2 read S-0-0021")), "{report:?}");
    go_on_without(&mut rig);
}

/// The application leaves the bad slave out; the others reach CP4 and run.
fn go_on_without(rig: &mut FullRig) {
    rig.master.exclude(BAD_ID).unwrap();
    rig.master.proceed().unwrap();
    rig.auto_proceed = true;
    rig.state(State::Cp4);
    rig.cycles(3);
    runs(rig, &[0, 2]);
}

const FIXED: &[ScpEntry] =
    &[ScpEntry { class: ScpClass::FIX_CFG, version: 1 }, ScpEntry { class: ScpClass::SYNC, version: 1 }];
const CONNECTIONS: &[FixedConnection] = &[
    FixedConnection { produces: false, idns: &[Idn::standard(36)] },
    FixedConnection { produces: true, idns: &[FEEDBACK] },
];

/// A slave whose parameter `idn` reads as `value`: what it fails with in CP2, and that the others go on.
fn reports(idn: Idn, value: i64, said: &str) {
    let mut rig = full_rig(3);
    let config = slave::Config { address: 2, classes: FIXED, fixed: CONNECTIONS, ..slave::Config::default() };
    rig.line.slaves_mut()[1] = Slave::new(&config, Mirror::default());
    rig.line.mend(1);
    rig.line.slaves_mut()[1].store_mut().set_number_of(idn, value);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    rig.state(State::Connect2);
    rig.state(State::Await2);
    let failed = rig.log.iter().find_map(|event| match event {
        Event::StepFailed { slave, .. } => Some((*slave, event.to_string())),
        _ => None,
    });
    assert_eq!(failed, Some((BAD_ID, format!("slave at position 2: {idn}: {said}"))));
    go_on_without(&mut rig);
}

#[test]
fn a_slave_with_a_length_that_does_not_fit() {
    let length = Idn::connection(1, 5);
    reports(length, 0, "0 bytes to write where 2 are needed");
    reports(length, 1, "1 bytes to write where 2 are needed");
    reports(length, 1400, "the slave asks for 1400, at most 256 is possible");
}

#[test]
fn a_slave_whose_times_no_cycle_can_hold() {
    reports(Idn::FEEDBACK_TIME, 2_000_000, "the slave asks for 2000000, at most 1000000 is possible");
}

#[test]
fn a_slave_that_keeps_busy_for_ever() {
    let mut rig = in_cp4();
    let at = svc_at(&rig);
    misbehave(&mut rig, at, SVC_LEN, |svc| svc[0] |= 2);
    let stuck = rig.master.svc_submit(BAD_ID, SvcRequest::read(MODE)).unwrap();
    // The others are read and run meanwhile.
    for _ in 0..3 {
        assert!(rig.request(SlaveId(0), SvcRequest::read(MODE)).result.is_ok());
        assert!(rig.request(SlaveId(2), SvcRequest::read(MODE)).result.is_ok());
        runs(&mut rig, &[0, 1, 2]);
    }
    assert_eq!(rig.outcome(stuck), None);
    rig.run_until("given up", |rig| rig.outcome(stuck).is_some());
    let said = rig.outcome(stuck).unwrap().to_string();
    assert_eq!(said, "S-0-0032: the slave was busy for more than 1000 ms");
}

#[test]
fn a_slave_that_flips_ahs_twice() {
    let mut rig = in_cp4();
    let at = svc_at(&rig);
    let mut flips = 0;
    misbehave(&mut rig, at, SVC_LEN, move |svc| {
        flips += 1;
        svc[0] ^= u8::from(flips == 2);
    });
    rig.breaking(by_the_bad_one(|rule| *rule == Rule::Handshake), |rig| rig.cycles(2));
    // Asked while AHS stands wrong: the master does not take the slave's old answer for a new one.
    let wrong = rig.master.svc_submit(BAD_ID, SvcRequest::read(Idn::CYCLE_TIME)).unwrap();
    rig.run_until("answered", |rig| rig.outcome(wrong).is_some());
    assert_eq!(rig.outcome(wrong).unwrap().data.unsigned(), Some(1_000_000));
    let named = rig.checked.checker.violations().iter().map(ToString::to_string).collect::<Vec<_>>();
    assert_eq!(named.len(), 1, "the way back is to where MHS is: {named:?}");
    assert!(named[0].ends_with("slave at position 2: AHS moved without MHS"), "{named:?}");
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_slave_whose_ahs_stays_wrong() {
    let mut rig = in_cp4();
    let at = svc_at(&rig);
    misbehave(&mut rig, at, SVC_LEN, |svc| svc[0] ^= 1);
    let outcome = rig.breaking(by_the_bad_one(|rule| *rule == Rule::Handshake), |rig| {
        rig.cycles(1);
        rig.request(BAD_ID, SvcRequest::read(Idn::CYCLE_TIME))
    });
    assert_eq!(outcome.to_string(), "S-0-1002: no handshake from the slave within 10 cycles");
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_connection_counter_out_of_order() {
    let mut rig = in_cp4();
    let place = rig.master.layout().slaves[1].as_ref().unwrap().connections[1];
    let mut cycle = 0u8;
    misbehave(&mut rig, place.at, 2, move |control| {
        cycle += 1;
        // Every other value claims to be three later.
        control[1] = control[1].wrapping_add(if cycle.is_multiple_of(2) { 0x30 } else { 0 });
    });
    rig.breaking(by_the_bad_one(|rule| matches!(rule, Rule::Production { .. })), |rig| {
        rig.cycles(4);
        let warned = Event::Connection { slave: BAD_ID, instance: 1, state: ConsumerState::Warning };
        assert_eq!(rig.log, [warned], "one warning while it lasts");
        rig.cycles(12);
        assert_eq!(rig.master.consumer(BAD_ID, 1).unwrap().state, ConsumerState::Error);
        let said = rig.log.iter().map(ToString::to_string).collect::<Vec<_>>();
        let both = ["warning", "error"]
            .map(|state| format!("slave at position 2: connection 1 is in state {state}"));
        assert_eq!(said, both);
        runs(rig, &[0, 2]);
        behave(rig);
        rig.master.reset_consumer(BAD_ID, 1);
        rig.cycles(2);
    });
    runs(&mut rig, &[0, 1, 2]);
}

#[test]
fn a_slave_that_duplicates_an_address() {
    let mut rig = full_rig(3);
    rig.line.slaves_mut()[1].store_mut().set_number_of(Idn::ADDRESS, 3);
    rig.master.set_target_phase(Phase::CP4);
    let conflict = Event::AddressConflict { slave: BAD_ID };
    rig.run_until("refused", |rig| rig.saw(&conflict));
    assert_eq!(conflict.to_string(), "slave at position 2 has no address of its own: CP3 refused");
    let double = Event::DoubleAddress { address: 3, first: BAD_ID, second: SlaveId(2) };
    assert!(rig.saw(&double) && rig.saw(&Event::Missing { address: 2 }));
    assert_eq!(double.to_string(), "slave at position 2 and slave at position 3 both have address 3");
    go_on_without(&mut rig);
}

#[test]
fn data_that_a_slave_calls_invalid_is_told_with_its_status() {
    let mut rig = in_cp4();
    let handle = rig.line.slaves()[1].store().find(MODE).unwrap();
    rig.line.slaves_mut()[1].store_mut().set_status(handle, DataStatus::INVALID);
    let outcome = rig.request(BAD_ID, SvcRequest::read(MODE));
    assert!(outcome.result.unwrap().status.contains(DataStatus::INVALID));
}

#[test]
fn a_slave_left_out_after_its_check_does_not_enter_cp3_with_old_places() {
    let mut rig = full_rig(3);
    // The third slave fails its check while the bad one's goes through.
    rig.line.slaves_mut()[2].application_mut().refuses = Some(Phase::CP3);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    rig.state(State::Check2);
    rig.state(State::Await2);
    rig.line.slaves_mut()[2].application_mut().refuses = None;
    rig.master.exclude(BAD_ID).unwrap();
    rig.master.proceed().unwrap();
    rig.run_until("noticed", |rig| rig.saw(&Event::Stale { slave: BAD_ID }));
    rig.state(State::Cp0);
    rig.auto_proceed = true;
    rig.up_to(Phase::CP4);
    rig.cycles(3);
    runs(&mut rig, &[0, 1, 2]);
}
