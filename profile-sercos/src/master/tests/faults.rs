use super::peer::Faults;
use super::*;
use crate::checker::checked_bus::Tried;
use crate::checker::{Offender, Rule, Violation};
use crate::master::event::Invalid;
use crate::wire::svc::Element;
use crate::wire::svc_error::SvcError;

fn fix_crc(frame: &mut [u8]) {
    let crc = crc32fast::hash(&frame[..16]);
    frame[16..20].copy_from_slice(&crc.to_le_bytes());
}

/// A disturbed cable in CP4: what is refused, and that nothing else comes of it.
fn disturbed(cable: fn(&mut Vec<u8>) -> bool, reason: Refusal, said: &str) {
    assert_eq!(reason.to_string(), said);
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    rig.cycles(5);
    rig.log.clear();
    rig.cable = Box::new(cable);
    rig.cycles(2);
    assert!(rig.master.statistics().refused(reason) >= 2, "{reason}");
    for other in Refusal::ALL.into_iter().filter(|&other| other != reason) {
        assert_eq!(rig.master.statistics().refused(other), 0, "{reason}: {other}");
    }
    for slave in [SlaveId(0), SlaveId(1)] {
        let consumer = rig.master.consumer(slave, 1).unwrap();
        assert_eq!((consumer.state, consumer.missed, consumer.fresh), (ConsumerState::Warning, 1, false));
    }
    rig.cable = Box::new(|_| true);
    rig.cycles(2);
    for slave in [SlaveId(0), SlaveId(1)] {
        assert_eq!(rig.master.consumer(slave, 1).unwrap().state, ConsumerState::Consuming);
    }
    assert!(rig.log.iter().all(|event| matches!(event, Event::Connection { .. })), "{:?}", rig.log);
}

#[test]
fn refused_frames_change_nothing() {
    disturbed(
        |frame| {
            frame[16] ^= 1;
            true
        },
        Refusal::Crc,
        "wrong header CRC",
    );
    disturbed(
        |frame| {
            frame[15] = frame[15] & 0xF0 | 3;
            fix_crc(frame);
            true
        },
        Refusal::Phase,
        "wrong phase",
    );
    disturbed(
        |frame| {
            frame[15] ^= 0x40;
            fix_crc(frame);
            true
        },
        Refusal::CycleCount,
        "wrong cycle counter",
    );
    disturbed(
        |frame| {
            frame.push(0);
            true
        },
        Refusal::Length,
        "wrong length",
    );
    disturbed(
        |frame| {
            frame[14] |= 2;
            fix_crc(frame);
            true
        },
        Refusal::Number,
        "telegram number that is not in use",
    );
    disturbed(
        |frame| {
            // Not the MST: that would be another master's.
            if frame[14] & 0x40 != 0 {
                frame[11] ^= 0x10;
                fix_crc(frame);
            }
            true
        },
        Refusal::Foreign,
        "telegram of another master",
    );
}

#[test]
fn frames_on_the_other_port_are_refused() {
    let mut rig = Rig::of(&[1]);
    rig.up_to(Phase::CP4);
    rig.now = rig.master.wake_at().unwrap();
    let Some(Output::Transmit { frame, .. }) = rig.master.poll(rig.now) else { panic!("no frame") };
    let frame = frame.to_vec();
    assert_eq!(rig.master.handle_frame(rig.now, Port::Two, &frame), Err(Refusal::Port));
    assert_eq!(rig.master.statistics().refused(Refusal::Port), 1);
}

#[test]
fn three_missing_telegrams_lose_every_slave() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    rig.cable = Box::new(|_| false);
    rig.cycles(2 + 1);
    assert!(!rig.log.iter().any(|event| matches!(event, Event::SlaveLost { .. })));
    rig.cycles(1);
    assert!(rig.log.contains(&Event::SlaveLost { slave: SlaveId(0), address: 1, phase: Phase::CP4 }));
    // The first slave of the line is asked to turn the telegrams round, in vain.
    rig.cycles(10);
    assert!(!rig.log.contains(&Event::AllSlavesLost));
    rig.cycles(2);
    assert!(rig.log.contains(&Event::AllSlavesLost));
    // The master looks for slaves again and goes no further by itself.
    rig.run_until("scanning", |rig| rig.log.contains(&Event::NoSlaves));
    rig.cable = Box::new(|_| true);
    rig.state(State::Cp0);
    rig.log.clear();
    rig.up_to(Phase::CP4);
}

#[test]
fn a_vanishing_slave_leaves_the_others_running() {
    let lost = |phase| Event::SlaveLost { slave: SlaveId(1), address: 2, phase };
    for (phase, state) in [
        (Phase::CP1, State::Identify),
        (Phase::CP1, State::Cp1),
        (Phase::CP2, State::Start2),
        (Phase::CP2, State::Read2),
        (Phase::CP2, State::Await2),
        (Phase::CP2, State::Connect2),
        (Phase::CP2, State::Write2),
        (Phase::CP2, State::Check2),
        (Phase::CP3, State::Start3),
        (Phase::CP3, State::Await3),
        (Phase::CP3, State::Check3),
        (Phase::CP4, State::Start4),
        (Phase::CP4, State::Cp4),
    ] {
        let mut rig = Rig::of(&[1, 2, 3]);
        rig.auto_proceed = !matches!(state, State::Await2 | State::Await3);
        let target = if state == State::Cp1 { Phase::CP1 } else { Phase::CP4 };
        rig.master.set_target_phase(target);
        if state == State::Await3 {
            rig.state(State::Await2);
            rig.master.proceed().unwrap();
        }
        rig.state(state);
        rig.line.peers[1].faults.gone = true;
        rig.run_until("noticed", |rig| rig.log.contains(&lost(phase)));
        let said = format!("slave at position 2 with address 2 was lost in {phase}");
        assert_eq!(lost(phase).to_string(), said);
        rig.auto_proceed = true;
        rig.master.set_target_phase(Phase::CP4);
        let _ = rig.master.proceed();
        rig.state(State::Cp4);
        rig.cycles(10);
        let presence: Vec<_> = rig.master.slaves().map(|slave| slave.presence).collect();
        assert_eq!(presence, [Presence::Active, Presence::Lost, Presence::Active], "{state:?}");
        for slave in [0, 2] {
            let consumer = rig.master.consumer(SlaveId(slave), 1).unwrap();
            assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true), "{state:?}");
        }
        assert_eq!(
            rig.master.svc_submit(SlaveId(1), SvcRequest::read(Idn::FSP_TYPE)).unwrap_err().0,
            SubmitError::NoSlave
        );
    }
}

#[test]
fn a_slave_that_vanishes_in_cp0_changes_the_scan() {
    let mut rig = Rig::of(&[1, 2]);
    rig.master.set_target_phase(Phase::CP0);
    rig.state(State::Cp0);
    rig.line.peers[1].faults.gone = true;
    rig.state(State::Scan);
    rig.state(State::Cp0);
    assert!(rig.log.contains(&Event::Scanned { slaves: 1 }));
    let missing = Event::Missing { address: 2 };
    assert!(rig.log.contains(&missing));
    assert_eq!(missing.to_string(), "the slave with address 2 was not found");
    // The other one goes on.
    rig.up_to(Phase::CP4);
    rig.cycles(5);
    let consumer = rig.master.consumer(SlaveId(0), 1).unwrap();
    assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true));
}

#[test]
fn a_lost_slave_that_is_valid_again_in_cp4_takes_part_again() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    rig.cycles(3);
    let pending = rig.master.svc_submit(SlaveId(1), SvcRequest::read(Idn::FSP_TYPE)).unwrap();
    rig.line.peers[1].faults.gone = true;
    rig.cycles(20);
    let aborted = rig.log.iter().any(|event| {
        matches!(event, Event::Svc { ticket, outcome }
            if *ticket == pending && outcome.result == Err(SvcFailure::SlaveLost))
    });
    assert!(aborted, "{:?}", rig.log);
    let states = rig.log.iter().filter_map(|event| match event {
        Event::Connection { slave: SlaveId(1), state, .. } => Some(*state),
        _ => None,
    });
    let states: Vec<_> = states.into_iter().collect();
    assert_eq!(states[states.len() - 2..], [ConsumerState::Warning, ConsumerState::Error]);
    let presence = |rig: &Rig| rig.master.slave(SlaveId(1)).unwrap().presence;
    let returned = Event::SlaveReturned { slave: SlaveId(1) };
    assert_eq!(returned.to_string(), "slave at position 2 is valid again and takes part");
    // A bad contact: valid for nine cycles, away for one, and again.
    for _ in 0..3 {
        rig.line.peers[1].faults.gone = false;
        rig.cycles(9);
        rig.line.peers[1].faults.gone = true;
        rig.cycles(1);
    }
    assert_eq!(presence(&rig), Presence::Lost);
    assert!(!rig.log.contains(&returned));
    rig.line.peers[1].faults.gone = false;
    rig.cycles(10);
    assert_eq!(presence(&rig), Presence::Active);
    assert_eq!(rig.log.iter().filter(|event| **event == returned).count(), 1);
    rig.cycles(3);
    let consumer = rig.master.consumer(SlaveId(1), 1).unwrap();
    assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true));
    assert!(rig.result(1, SvcRequest::read(Idn::FSP_TYPE)).is_ok(), "its service channel is served again");
    // It can be lost again.
    rig.line.peers[1].faults.gone = true;
    rig.cycles(4);
    assert_eq!(presence(&rig), Presence::Lost);
}

#[test]
fn refused_checks_show_what_is_wrong() {
    let wrong = vec![Idn::CYCLE_TIME, Idn::connection(1, 3)];
    for (check, phase, state) in
        [(Idn::CP3_CHECK, Phase::CP2, State::Await2), (Idn::CP4_CHECK, Phase::CP3, State::Await3)]
    {
        let mut rig = Rig::of(&[1, 2]);
        rig.line.peers[1].faults.invalid = Some((check, wrong.clone()));
        rig.master.set_target_phase(Phase::CP4);
        let invalid = wrong.iter().copied().collect::<Invalid>();
        let failed = Event::CheckFailed { slave: SlaveId(1), phase, invalid };
        rig.run_until("refused", |rig| rig.log.contains(&failed));
        rig.auto_proceed = false;
        rig.state(state);
        // The command is cancelled, the application is asked again, and a second attempt succeeds.
        let steps = &rig.line.peers[1].steps;
        let last = steps.iter().rfind(|step| step.idn == check && step.element == Element::Data).unwrap();
        assert_eq!((last.write, last.info), (true, 0));
        rig.line.peers[1].faults = Faults::default();
        rig.auto_proceed = true;
        let _ = rig.master.proceed();
        rig.state(State::Cp4);
    }
}

#[test]
fn a_slave_that_stays_busy_is_named() {
    let mut rig = Rig::of(&[1, 2]);
    rig.line.peers[0].faults.busy_at = Some(Idn::CYCLE_TIME);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    let failure = SvcFailure::BusyTimeout { milliseconds: 1000 };
    let failed = Event::StepFailed { slave: SlaveId(0), idn: Idn::CYCLE_TIME, failure };
    rig.run_until("busy", |rig| rig.log.contains(&failed));
    rig.state(State::Await2);
}

#[test]
fn a_slave_without_handshake_is_named() {
    let mut rig = Rig::of(&[1]);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.line.peers[0].faults.deaf = true;
    let failure = SvcFailure::HandshakeTimeout { cycles: 10 };
    assert_eq!(rig.result(0, SvcRequest::read(Idn::FSP_TYPE)), Err(failure));
}

#[test]
fn error_replies_are_named_and_stop_the_way_up() {
    let mut rig = Rig::of(&[1, 2]);
    rig.line.peers[1].faults.error_at = Some((Idn::CYCLE_TIME, 0x7007));
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    rig.state(State::Write2);
    rig.state(State::Await2);
    let failure = SvcFailure::Refused { element: Element::Data, code: SvcError::ABOVE_MAXIMUM };
    let failed = Event::StepFailed { slave: SlaveId(1), idn: Idn::CYCLE_TIME, failure };
    assert!(rig.log.contains(&failed), "{:?}", rig.log);
    let row = rig.master.report(SlaveId(1)).last().unwrap().to_string();
    assert_eq!(row, "CP2 write S-0-1002: operation data: operation data is above the maximum");
    // The other slave is not disturbed and the second attempt goes through.
    rig.line.peers[1].faults = Faults::default();
    rig.auto_proceed = true;
    rig.master.proceed().unwrap();
    rig.state(State::Cp4);
}

#[test]
fn slow_commands_are_waited_for() {
    let mut rig = Rig::of(&[1, 2]);
    rig.line.peers[0].faults.command_cycles = 20;
    rig.up_to(Phase::CP4);
    let polls = |index: usize| {
        let steps = &rig.line.peers[index].steps;
        steps.iter().filter(|s| s.idn == Idn::CP3_CHECK && s.element == Element::Idn).count()
    };
    assert_eq!((polls(0), polls(1)), (24, 5));
}

#[test]
fn a_slave_that_does_not_stop_inserting_stops_the_switch() {
    for (state, from, to) in
        [(State::Leave2, Phase::CP2, Phase::CP3), (State::Leave3, Phase::CP3, Phase::CP4)]
    {
        let mut rig = Rig::of(&[1, 2]);
        rig.master.set_target_phase(Phase::CP4);
        rig.state(if state == State::Leave2 { State::Await2 } else { State::Await3 });
        rig.line.peers[0].faults.stubborn = true;
        let late = Rule::InsertsWhileSwitching { phase: from };
        let failed = Event::SwitchFailed { from, to, slave: Some(SlaveId(0)) };
        let named =
            move |violation: &Violation| violation.rule == late && violation.offender == Offender::Slave(1);
        rig.breaking(named, |rig| rig.run_until("failed", |rig| rig.log.contains(&failed)));
        assert_eq!(
            failed.to_string(),
            format!("{from} to {to}: slave at position 1 did not stop inserting data in time")
        );
        rig.line.peers[0].faults.stubborn = false;
        // Back in CP0, where the master stays.
        rig.state(State::Cp0);
        rig.cycles(20);
        assert_eq!(rig.master.state(), State::Cp0);
        assert_eq!(rig.master.target_phase(), Some(Phase::CP0));
    }
}

#[test]
fn contradicting_classes_are_refused() {
    let mut rig = Rig::of(&[1]);
    let both = [0x01, 0x01, 0x01, 0x02].to_vec();
    rig.line.peers[0].parameters.get_mut(&Idn::SCP_CLASSES).unwrap().bytes = both;
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    rig.run_until("refused", |rig| rig.log.contains(&Event::ClassMismatch { slave: SlaveId(0) }));
    rig.state(State::Await2);
}

#[test]
fn a_layout_that_does_not_fit_is_refused() {
    let mut rig = Rig::with(MasterConfig { cycle_ns: 62_500, ..config(&[1, 2]) }, &[1, 2]);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    rig.master.proceed().unwrap();
    rig.cycles(5);
    rig.state(State::Await2);
    let refused = rig.log.iter().any(|event| matches!(event, Event::LayoutRefused(_)));
    assert!(refused, "{:?}", rig.log);
}

#[test]
fn too_many_slaves_stay_in_cp0() {
    let mut rig = Rig::with(MasterConfig { slaves_max: 1, ..config(&[1]) }, &[1, 2]);
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("refused", |rig| rig.log.contains(&Event::TooManySlaves { found: 2, max: 1 }));
    rig.cycles(100);
    assert_eq!(rig.master.state(), State::Scan);
}

#[test]
fn nobody_there() {
    let mut rig = Rig::of(&[]);
    rig.cable = Box::new(|_| false);
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("alone", |rig| rig.log.contains(&Event::NoSlaves));
    assert_eq!(rig.master.state(), State::Scan);
}
