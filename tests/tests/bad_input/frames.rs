//! SERCOS telegrams as they come back from the line.

use std::cell::Cell;
use std::rc::Rc;

use axisbridge_tests::rig::motion::{in_motion, long_moves, millis};
use axisbridge_tests::rig::ports::Bytes;
use axisbridge_tests::rig::{Rig, Settings};
use profile_generic::fault::FaultCause;
use profile_sercos::master::event::Refusal;
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, PhaseField, TelegramType};

/// First byte of the header CRC.
const CRC: usize = 16;

/// Puts a changed header with a good CRC into a frame.
fn rewrite(frame: &mut Bytes, change: impl FnOnce(&mut Header)) {
    let mut header = Header::parse(frame.as_slice()).expect("a telegram of the line");
    change(&mut header);
    header.emit(frame.as_mut_slice()).expect("the header has room");
}

/// A rig in motion with one AT changed on its way back, and what the master had refused before.
fn spoiled(spoil: impl Fn(&mut Bytes) + 'static) -> Rig {
    let mut rig = in_motion(Settings::default());
    let done = Rc::new(Cell::new(false));
    let once = Rc::clone(&done);
    rig.tamper_frame = Some(Box::new(move |frame| {
        let at = Header::parse(frame.as_slice()).is_ok_and(|header| header.telegram.kind() == Kind::At);
        if at && !once.replace(true) {
            spoil(frame);
        }
        true
    }));
    rig.run_until(millis(20), "the spoiled telegram", |_| done.get());
    rig.run_for(millis(10));
    rig
}

fn shorter(frame: &mut Bytes, len: usize) {
    *frame = Bytes::of(&frame.as_slice()[..len]);
}

#[test]
fn a_broken_telegram_is_counted_and_costs_one_cycle_of_feedback() {
    type Spoil = fn(&mut Bytes);
    let cases: [(Refusal, Spoil); 7] = [
        (Refusal::Crc, |frame| frame.as_mut_slice()[CRC] ^= 1),
        (Refusal::NotSercos, |frame| shorter(frame, HEADER_LEN - 1)),
        (Refusal::Foreign, |frame| rewrite(frame, |header| header.source[5] ^= 1)),
        (Refusal::Number, |frame| {
            rewrite(frame, |header| header.telegram = TelegramType(header.telegram.0 | 3));
        }),
        (Refusal::Phase, |frame| {
            rewrite(frame, |header| header.phase = PhaseField(header.phase.0 & 0xF0 | 3))
        }),
        (Refusal::CycleCount, |frame| {
            rewrite(frame, |header| header.phase = PhaseField(header.phase.0 ^ 0x10));
        }),
        (Refusal::Length, |frame| shorter(frame, frame.as_slice().len() - 4)),
    ];
    for (reason, spoil) in cases {
        let mut rig = spoiled(spoil);
        let statistics = *rig.sercos().master().statistics();
        for other in Refusal::ALL {
            assert_eq!(statistics.refused(other), u64::from(other == reason), "{reason:?}: {other:?}");
        }
        assert_eq!(statistics.at_missing, 1, "{reason:?}");
        assert_eq!(rig.status().counters.lost_telegrams, 1, "{reason:?}");
        for axis in rig.engine.axes() {
            assert_eq!((axis.counters().lost_telegrams, axis.fault()), (1, None), "{reason:?}");
        }
        let report = rig.run(millis(20_000));
        assert_eq!((report.failure, report.steps_finished), (None, 4), "{reason:?}: {}", rig.log());
    }
}

#[test]
fn strays_on_the_bus_are_counted_and_change_nothing() {
    let mut rig = in_motion(Settings::default());
    let frames: [&[u8]; 4] = [&[], &[0xFF; 60], &[0x55; 1_500], &[0; 14]];
    for (number, frame) in (1..).zip(frames) {
        rig.inject_frame(frame);
        rig.run_for(millis(4));
        assert_eq!(rig.sercos().master().statistics().refused(Refusal::NotSercos), number);
    }
    // A storm of them does not keep the telegrams of the cycle from being taken for long.
    for _ in 0..40 {
        rig.inject_frame(&[0x55; 64]);
    }
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
}

#[test]
fn a_line_whose_answers_are_all_broken_stops_the_axes_with_south_silence() {
    let mut rig = in_motion(Settings::default());
    rig.tamper_frame = Some(Box::new(|frame| {
        frame.as_mut_slice()[CRC] ^= 1;
        true
    }));
    let found = rig.run_until(millis(200), "the fault", |rig| {
        rig.engine.axes().iter().all(|axis| axis.fault().is_some())
    });
    assert!(found < millis(20), "{found}");
    for axis in rig.engine.axes() {
        assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    }
    assert!(rig.sercos().master().statistics().refused(Refusal::Crc) > 2);
    rig.run_until(millis(1_000), "no torque", Rig::torque_free);
    rig.tamper_frame = None;
    // Nothing starts by itself when the answers are good again.
    rig.run_until(millis(20_000), "the bus", |rig| rig.status().phase == 4);
    rig.run_for(millis(500));
    assert!(rig.torque_free());
    // A new connection clears what is over (5-2.6.2.3), and an Enable moves the axes as ever.
    rig.connect(long_moves());
    let report = rig.run(millis(40_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
}
