use super::*;
use crate::checker::checked_bus::Tried;
use crate::checker::{Offender, Rule, Violation};
use crate::wire::scp::ScpClass;
use crate::wire::svc::Element;

fn phases(rig: &Rig) -> Vec<Phase> {
    let phase = |event: &Event| match event {
        Event::Phase(phase) => Some(*phase),
        _ => None,
    };
    rig.log.iter().filter_map(phase).collect()
}

fn addresses(count: u16) -> Vec<u16> {
    (0..count).map(|index| 100 + index).collect()
}

#[test]
fn one_two_and_sixteen_slaves_reach_cp4() {
    for count in [1, 2, 16] {
        let addresses = addresses(count);
        let mut rig = Rig::of(&addresses);
        rig.up_to(Phase::CP4);
        assert_eq!(phases(&rig), [Phase::CP0, Phase::CP1, Phase::CP2, Phase::CP3, Phase::CP4]);
        assert!(rig.log.contains(&Event::Scanned { slaves: count }));
        rig.cycles(10);
        for (slave, &address) in (0..).map(SlaveId).zip(&addresses) {
            assert_eq!(rig.master.slave_by_address(address), Some(slave));
            let info = rig.master.slave(slave).unwrap();
            assert_eq!((info.presence, info.facts.fsp_type), (Presence::Active, Some(2)));
            assert_eq!(info.facts.version(ScpClass::SYNC), Some(1));
            let consumer = rig.master.consumer(slave, 1).unwrap();
            assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true));
            assert_eq!(consumer.data, [u8::try_from(address).unwrap(); 10]);
            assert!(rig.master.consumer(slave, 0).is_none());
        }
        assert_eq!(rig.master.statistics().at_missing, 0);
        assert!(Refusal::ALL.iter().all(|&reason| rig.master.statistics().refused(reason) == 0));
    }
}

#[test]
fn what_the_slaves_were_told() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    let peer = &rig.line.peers[1];
    assert_eq!(peer.value(Idn::CYCLE_TIME), 1_000_000);
    assert_eq!(peer.value(Idn::MDT_LENGTHS), 46);
    assert_eq!(peer.value(Idn::AT_LENGTHS), 48);
    assert_eq!(peer.value(Idn::SVC_MDT_OFFSET), 20);
    assert_eq!(peer.value(Idn::CONTROL_OFFSET), 28);
    assert_eq!(peer.value(Idn::SVC_AT_OFFSET), 14);
    assert_eq!(peer.value(Idn::STATUS_OFFSET), 22);
    assert_eq!(peer.value(Idn::connection(0, 1)), 0x8000);
    assert_eq!(peer.value(Idn::connection(1, 1)), 0xC000);
    assert_eq!(peer.value(Idn::connection(0, 3)), 0x0826);
    assert_eq!(peer.value(Idn::connection(1, 3)), 0x0024);
    assert_eq!(peer.value(Idn::connection(1, 2)), 3);
    assert_eq!(peer.value(Idn::connection(1, 10)), 1_000_000);
    assert_eq!(peer.value(Idn::connection(1, 11)), 10);
    assert_eq!(peer.value(Idn::SYNC_JITTER), 23_260);
    assert_eq!(peer.value(Idn::MTU_REQUESTED), 1500);
    assert_eq!(peer.value(Idn::SCP_ACTIVE), 0x0A01_0301_0201);
}

#[test]
fn values_travel_with_toggle_and_counter() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    // Nothing committed: the producer is not ready.
    rig.cycles(1);
    assert_eq!(rig.line.peers[0].mdt_seen[38..40], [0, 0]);
    for (cycle, control) in [0x1003u16, 0x2001, 0x3003].into_iter().enumerate() {
        let value = u8::try_from(cycle).unwrap();
        rig.master.producer(SlaveId(1), 0).unwrap().fill(value);
        assert!(rig.master.commit(SlaveId(1), 0));
        rig.step();
        let seen = &rig.line.peers[1].mdt_seen[38..46];
        assert_eq!(seen[..2], control.to_le_bytes());
        assert_eq!(seen[2..], [value; 6]);
    }
    // Without a commit the values stay as they are and the counter stands.
    rig.master.producer(SlaveId(1), 0).unwrap().fill(9);
    rig.step();
    assert_eq!(rig.line.peers[1].mdt_seen[38..41], [0x03, 0x30, 2]);
    assert!(!rig.master.commit(SlaveId(1), 1), "the slave produces this one");
    rig.master.withdraw(SlaveId(1), 0);
    rig.step();
    assert_eq!(rig.line.peers[1].mdt_seen[38..40], [0, 0]);
}

#[test]
fn lower_targets_are_kept() {
    let mut rig = Rig::of(&[1]);
    rig.auto_proceed = false;
    for (target, state) in [(Phase::CP0, State::Cp0), (Phase::CP1, State::Cp1), (Phase::CP2, State::Await2)] {
        rig.master.set_target_phase(target);
        rig.state(state);
        rig.cycles(50);
        assert_eq!(rig.master.state(), state);
    }
    // The application is through with CP2, but CP2 is the target.
    rig.master.proceed().unwrap();
    rig.cycles(50);
    assert_eq!(rig.master.state(), State::Await2);
    rig.master.set_target_phase(Phase::CP3);
    rig.state(State::Await3);
    assert_eq!(rig.master.phase(), Some(Phase::CP3));
}

#[test]
fn down_and_up_again() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    assert!(rig.master.slave(SlaveId(0)).unwrap().facts.gap);
    rig.master.set_target_phase(Phase::CP0);
    rig.state(State::Cp0);
    // Another slave in the same place: nothing is known of it from before.
    rig.line.peers[0].parameters.remove(&Idn::INTER_FRAME_GAP);
    rig.line.peers[0].parameters.remove(&Idn::FSP_TYPE);
    rig.log.clear();
    rig.up_to(Phase::CP4);
    let facts = rig.master.slave(SlaveId(0)).unwrap().facts;
    assert_eq!((facts.gap, facts.fsp_type), (false, None));
    rig.cycles(5);
    assert_eq!(rig.master.consumer(SlaveId(0), 1).unwrap().state, ConsumerState::Consuming);
    rig.master.stop();
    rig.state(State::Nrt);
    assert_eq!(rig.log.last(), Some(&Event::Stopped));
    assert_eq!(rig.master.wake_at(), None);
    let sent = rig.master.statistics().cycles;
    rig.cycles(10);
    assert_eq!(rig.master.statistics().cycles, sent);
    // From every phase on the way up.
    for (target, state) in
        [(Phase::CP1, State::Cp1), (Phase::CP2, State::Await2), (Phase::CP3, State::Await3)]
    {
        rig.auto_proceed = target == Phase::CP3;
        rig.master.set_target_phase(target);
        rig.state(state);
        rig.master.set_target_phase(Phase::CP0);
        rig.state(State::Down);
        rig.state(State::Silence0);
        rig.state(State::Cp0);
    }
}

/// In every cycle of the way up to CP4, and so in every state on it, the one in which CP0 is left included.
#[test]
fn a_master_can_be_stopped_at_any_moment() {
    let mut rig = Rig::of(&[1, 2]);
    rig.auto_proceed = true;
    rig.master.set_target_phase(Phase::CP4);
    let mut cycles = 0;
    while rig.master.state() != State::Cp4 {
        rig.cycles(1);
        cycles += 1;
    }
    let mut seen = Vec::new();
    for cycles in 0..cycles {
        let mut rig = Rig::of(&[1, 2]);
        rig.auto_proceed = true;
        rig.master.set_target_phase(Phase::CP4);
        rig.cycles(cycles);
        let state = rig.master.state();
        if !seen.contains(&state) {
            seen.push(state);
        }
        rig.master.stop();
        rig.cycles(500);
        assert_eq!((rig.master.state(), rig.master.phase()), (State::Nrt, None), "{state:?} after {cycles}");
    }
    for state in [State::Scan, State::Leave0, State::Silence1, State::Leave1, State::Leave2, State::Leave3] {
        assert!(seen.contains(&state), "{state:?} not among {seen:?}");
    }
}

#[test]
fn a_reading_that_was_cut_off_is_made_again() {
    for state in [State::Read2, State::Connect2, State::Write2, State::Check2] {
        let mut rig = Rig::of(&[1, 2]);
        rig.master.set_target_phase(Phase::CP4);
        rig.state(state);
        // S-0-1000 is under way in the fourth cycle of the reading.
        rig.cycles(4);
        rig.master.set_target_phase(Phase::CP0);
        rig.state(State::Cp0);
        rig.log.clear();
        rig.up_to(Phase::CP4);
        let info = rig.master.slave(SlaveId(0)).unwrap();
        assert_eq!(info.facts.version(ScpClass::SYNC), Some(1), "{state:?}");
        assert!(!rig.log.iter().any(|event| matches!(event, Event::StepFailed { .. })), "{:?}", rig.log);
    }
}

/// First cycle of each stretch of the same CPS and phase.
fn stretches(rig: &Rig) -> Vec<(u8, MonotonicTime, MonotonicTime)> {
    let mut list: Vec<(u8, MonotonicTime, MonotonicTime)> = Vec::new();
    for &(at, byte) in &rig.cycles {
        match list.last_mut() {
            Some((last, _, end)) if *last == byte & 0x8F => *end = at,
            _ => list.push((byte & 0x8F, at, at)),
        }
    }
    list
}

#[test]
fn pauses_and_phase_bytes() {
    let mut rig = Rig::of(&[1, 2]);
    rig.up_to(Phase::CP4);
    rig.cycles(3);
    rig.master.set_target_phase(Phase::CP0);
    rig.state(State::Settle);
    rig.cycles(1);
    let list = stretches(&rig);
    let bytes: Vec<u8> = list.iter().map(|&(byte, _, _)| byte).collect();
    assert_eq!(bytes, [0x00, 0x81, 0x01, 0x82, 0x02, 0x83, 0x03, 0x84, 0x04, 0x80, 0x00]);
    // 200 ms of listening before the first telegram; 120 ms of silence between the end of one telegram layout and the start of
    // the next, counted from the end of the last cycle; none between CP3 and CP4.
    assert_eq!(list[0].1, MonotonicTime(200_000_000));
    let gaps: Vec<i64> = list.windows(2).map(|pair| (pair[1].1 - pair[0].2).as_nanos() / 1000).collect();
    assert_eq!(gaps, [1000, 121_000, 1000, 121_000, 1000, 121_000, 1000, 1000, 1000, 121_000]);
    // CPS lasts two cycles, towards CP4 three.
    let switching = |byte: u8| rig.cycles.iter().filter(|(_, b)| b & 0x8F == byte).count();
    assert_eq!([0x81, 0x82, 0x83, 0x84, 0x80].map(switching), [2, 2, 2, 3, 2]);
    // CP0 settles for 200 ms; the ten stable cycles for the topology and ten for the list have passed by then.
    assert_eq!((list[0].2 - list[0].1).as_nanos() / 1_000_000, 200);
    // The cycle counter runs through.
    let counters: Vec<u8> = rig.cycles.iter().map(|(_, byte)| byte >> 4 & 7).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) & 7));
}

#[test]
fn late_polls_skip_cycles_and_keep_the_grid() {
    let mut rig = Rig::of(&[1]);
    rig.up_to(Phase::CP4);
    let due = rig.master.wake_at().unwrap();
    rig.now = due + DurationNs(3_400_000);
    let late = |violation: &Violation| {
        violation.offender == Offender::Master && matches!(violation.rule, Rule::MstInterval { .. })
    };
    rig.breaking(late, |rig| rig.cycles(1));
    assert_eq!(rig.master.statistics().skipped, 3);
    assert_eq!(rig.master.wake_at(), Some(due + DurationNs(4_000_000)));
}

#[test]
fn telegrams_that_are_built_and_come_too_late_are_left_out_with_their_number() {
    let mut rig = Rig::of(&[1]);
    rig.up_to(Phase::CP4);
    rig.cycles(3);
    rig.master.prepare();
    let due = rig.master.wake_at().unwrap();
    assert!(!rig.master.skip_late(due + DurationNs(500_000)), "half a cycle is late, and not too late");
    rig.now = due + DurationNs(1_200_000);
    assert!(rig.master.skip_late(rig.now));
    assert_eq!(
        (rig.master.statistics().skipped, rig.master.next_cycle()),
        (1, Some(due + DurationNs(1_000_000)))
    );
    let late = |violation: &Violation| {
        violation.offender == Offender::Master && matches!(violation.rule, Rule::MstInterval { .. })
    };
    rig.breaking(late, |rig| rig.cycles(3));
    let counters: Vec<u8> = rig.cycles.iter().map(|(_, byte)| byte >> 4 & 7).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) & 7), "{counters:?}");
}

#[test]
fn the_application_works_in_cp2_and_cp3() {
    let mut rig = Rig::of(&[1, 2]);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Leave0);
    let early = rig.master.svc_submit(SlaveId(0), SvcRequest::read(Idn::FSP_TYPE));
    assert_eq!(early.unwrap_err().0, SubmitError::Phase);
    assert_eq!(rig.master.proceed(), Err(CallError::State));
    rig.state(State::Await2);
    rig.cycles(20);
    assert_eq!(rig.result(1, SvcRequest::read(Idn::INTER_FRAME_GAP)), Ok(Some(37)));
    assert_eq!(rig.master.set_connections(SlaveId(9), slave(1).connections), Err(CallError::NoSlave));
    let mut other = slave(1).connections;
    other[0].idns.push(Idn::standard(80));
    rig.master.set_connections(SlaveId(0), other).unwrap();
    // Requests that are under way are finished before S-0-0127.
    for _ in 0..8 {
        rig.master.svc_submit(SlaveId(0), SvcRequest::read(Idn::SCP_CLASSES)).unwrap();
    }
    rig.master.proceed().unwrap();
    rig.state(State::Connect2);
    let answers = rig
        .log
        .iter()
        .filter(|event| matches!(event, Event::Svc { outcome, .. } if outcome.idn == Idn::SCP_CLASSES));
    assert_eq!(answers.count(), 8);
    rig.state(State::Await3);
    assert_eq!(rig.line.peers[0].value(Idn::connection(0, 5)), 12);
    assert_eq!(rig.master.layout().mdt_len, [50, 0, 0, 0]);
    assert_eq!(rig.result(0, SvcRequest::read(Idn::FSP_TYPE)), Ok(Some(2)));
    rig.master.proceed().unwrap();
    rig.state(State::Cp4);
    assert_eq!(rig.result(0, SvcRequest::read(Idn::CYCLE_TIME).urgent()), Ok(Some(1_000_000)));
}

#[test]
fn the_report_names_every_step() {
    let mut rig = Rig::of(&[1]);
    rig.line.peers[0].parameters.remove(&Idn::SCP_ACTIVE);
    rig.up_to(Phase::CP4);
    let mut text = String::new();
    for row in rig.master.report(SlaveId(0)) {
        writeln!(text, "{row}").unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn unknown_missing_and_unused() {
    let mut rig = Rig::with(config(&[1, 7]), &[1, 9]);
    rig.up_to(Phase::CP4);
    assert!(rig.log.contains(&Event::Missing { address: 7 }));
    assert!(rig.log.contains(&Event::Unknown { slave: SlaveId(1), address: 9 }));
    // The unknown slave takes part, its connections are switched off.
    let peer = &rig.line.peers[1];
    let setups: Vec<_> = peer.steps.iter().filter(|step| step.idn == Idn::connection(1, 1)).collect();
    assert_eq!(setups.len(), 2);
    assert_eq!((setups[1].element, setups[1].info), (Element::Data, 0));
    assert!(rig.master.consumer(SlaveId(1), 1).is_none());
    assert_eq!(rig.master.slave(SlaveId(1)).unwrap().presence, Presence::Active);
}

#[test]
fn double_addresses_stop_in_cp2() {
    let mut rig = Rig::with(config(&[5]), &[5, 5]);
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("refused", |rig| rig.log.contains(&Event::AddressConflict { slave: SlaveId(0) }));
    let double = Event::DoubleAddress { address: 5, first: SlaveId(0), second: SlaveId(1) };
    assert!(rig.log.contains(&double));
    rig.cycles(50);
    assert_eq!(rig.master.state(), State::Await2);
    // With one of them left out the way is free.
    rig.master.exclude(SlaveId(1)).unwrap();
    rig.master.proceed().unwrap();
    rig.state(State::Cp4);
    assert_eq!(rig.master.slave(SlaveId(1)).unwrap().presence, Presence::Excluded);
}

#[test]
fn a_soft_master_says_so() {
    let mut rig = Rig::of(&[1]);
    let classes = [0x01, 0x02, 0x02, 0x03, 0x01, 0x0A].to_vec();
    let peer = &mut rig.line.peers[0];
    peer.parameters.get_mut(&Idn::SCP_CLASSES).unwrap().bytes = classes;
    let control = peer.parameters[&Idn::CYCLE_TIME].clone();
    peer.parameters.insert(Idn::COMMUNICATION_CONTROL, control);
    rig.up_to(Phase::CP4);
    assert_eq!(rig.line.peers[0].value(Idn::COMMUNICATION_CONTROL), 1 << 4);
    // With a system time the extended field is announced as well, and used.
    let mut rig = Rig::with(MasterConfig { system_time: true, ..config(&[1]) }, &[1]);
    let classes = [0x01, 0x02, 0x02, 0x03, 0x01, 0x0A].to_vec();
    let peer = &mut rig.line.peers[0];
    peer.parameters.get_mut(&Idn::SCP_CLASSES).unwrap().bytes = classes;
    let control = peer.parameters[&Idn::CYCLE_TIME].clone();
    peer.parameters.insert(Idn::COMMUNICATION_CONTROL, control);
    let nanos = 0x1234_5678 * 1_000_000_000 + 0x0102_0304;
    let time = Some(profile_generic::time::SystemTime(nanos));
    rig.up_to(Phase::CP4);
    assert_eq!(rig.line.peers[0].value(Idn::COMMUNICATION_CONTROL), 1 << 4 | 1 << 2);
    rig.run_until("at the start of a round", |rig| rig.cycles.last().unwrap().1 & 0x70 == 0x70);
    let mut fragments = Vec::new();
    let mut words = Vec::new();
    for _ in 0..16 {
        rig.master.set_system_time(time);
        rig.step();
        let seen = &rig.line.peers[0].mdt_seen;
        words.push(u16::from_le_bytes([seen[8], seen[9]]));
        fragments.push(u16::from_le_bytes([seen[10], seen[11]]));
    }
    let half = [0x1234, 0x1234, 0x5678, 0x5678, 0x0102, 0x0102, 0x0304, 0x0304];
    assert_eq!(fragments[..8], half);
    assert_eq!(fragments[8..], half);
    assert!(words.iter().all(|word| word & 1 << 14 != 0));
    assert_eq!(words[0] ^ words[8], 1 << 15);
    assert_eq!(words[0], words[7]);
}

/// A system time belongs to the cycle that it was set for: one that this cycle did not send is not sent in a later one.
#[test]
fn a_system_time_of_a_cycle_without_the_field_is_not_sent_later() {
    let mut sent = Vec::new();
    // Every eighth cycle begins a time: the first one of CP3 may be one of those.
    for more in 0..8 {
        let mut rig = Rig::with(MasterConfig { system_time: true, ..config(&[1]) }, &[1]);
        rig.up_to(Phase::CP4);
        rig.master.set_target_phase(Phase::CP0);
        rig.master.set_system_time(Some(profile_generic::time::SystemTime(1_000_000_000)));
        rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
        (0..more).for_each(|_| rig.step());
        let valid = std::rc::Rc::new(std::cell::Cell::new(0));
        let count = std::rc::Rc::clone(&valid);
        rig.outward = Box::new(move |frame| {
            // MDT0 of CP3, and the word of its extended field.
            let word = u16::from_le_bytes([frame[HEADER_LEN + 8], frame[HEADER_LEN + 9]]);
            let in_cp3 = frame[14] & 0x4F == 0 && frame[15] & 0x0F == 3;
            count.set(count.get() + u32::from(in_cp3 && word & 1 << 14 != 0));
            true
        });
        rig.master.set_target_phase(Phase::CP4);
        rig.run_until("in CP4", |rig| rig.master.state() == State::Cp4);
        sent.push(valid.get());
    }
    assert_eq!(sent, [0; 8]);
}

#[test]
fn four_telegrams_for_many_slaves() {
    let config = MasterConfig { slaves_max: 300, setup_cycle_ns: 2_000_000, ..config(&[]) };
    let addresses: Vec<u16> = (1..=300).collect();
    let mut rig = Rig::with(config, &addresses);
    rig.auto_proceed = false;
    rig.up_to(Phase::CP2);
    rig.state(State::Await2);
    assert_eq!(rig.result(299, SvcRequest::read(Idn::FSP_TYPE)), Ok(Some(2)));
}

#[test]
fn frames_are_padded_and_headed() {
    let mut rig = Rig::of(&[1]);
    rig.up_to(Phase::CP3);
    let layout = rig.master.layout();
    // One slave: 14 + 6 + 2 + 8 = 30 bytes of data, filled up to 40.
    assert_eq!((layout.mdt_len[0], layout.at_len[0]), (40, 40));
    rig.step();
    rig.now = rig.master.wake_at().unwrap();
    let Some(Output::Transmit { frame, .. }) = rig.master.poll(rig.now) else { panic!("no frame") };
    assert_eq!(frame.len(), HEADER_LEN + 40);
}
