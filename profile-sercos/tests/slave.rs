//! The communication of a slave, from CP0 to CP4 and out of it.

#[path = "support/bench.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod bench;

use bench::{Bench, CYCLE};
use profile_generic::servo::ServoParameters;
use profile_generic::time::DurationNs;
use profile_sercos::checker::checked_bus::Tried;
use profile_sercos::checker::{Offender, Rule, Violation};
use profile_sercos::slave::phase::{Fault, State};
use profile_sercos::wire::data_status::CommandState;
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::header::{Channel, HEADER_LEN, Header, Kind, Phase, PhaseField, TelegramType};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::SvcStatus;
use profile_sercos::wire::svc_error::SvcError;

fn by_the_master(violation: &Violation) -> bool {
    violation.offender == Offender::Master
}

/// What noise in place of telegrams breaks. It may hold what looks like a slave's answer; what a slave must never do,
/// writing outside of its slots, is not in this list.
fn from_noise(violation: &Violation) -> bool {
    by_the_master(violation)
        || match violation.rule {
            Rule::Handshake | Rule::Busy | Rule::Production { .. } | Rule::InsertsWhileSwitching { .. } => {
                true
            }
            // From the primary port it comes to the port where slaves write into it only on its way back.
            Rule::ReturnPath { telegram } => telegram.channel() == Channel::Secondary,
            _ => false,
        }
}

fn bench(count: u16) -> Bench {
    Bench::new(count, ServoParameters::default())
}

#[test]
fn a_line_is_scanned() {
    for count in [1, 2, 7, 200] {
        let mut bench = bench(count);
        let at = bench.scan();
        assert_eq!(at.counter.count(), 2 * count, "1 + (2N - 1)");
        let found: Vec<_> = at.slaves().map(|(topology, field)| (topology, field.address())).collect();
        let wanted: Vec<_> = (1..=count).map(|address| (address, Some(address))).collect();
        assert_eq!(found, wanted);
        bench.switching = Some(Phase::CP1);
        let at = bench.scan();
        assert_eq!((at.counter.count(), at.slaves().count()), (1, 0), "nothing is inserted in a switch");
    }
}

#[test]
fn a_broken_line_turns_round_at_the_break() {
    let mut bench = bench(3);
    bench.line.cut(2);
    bench.cycle();
    let at = bench.scan();
    assert_eq!((at.counter.count(), at.slaves().count()), (4, 2));
    assert_eq!(bench.line.slaves()[2].state(), State::Nrt);
}

#[test]
fn the_last_slave_says_that_it_is_the_end() {
    let mut bench = bench(2);
    bench.up_to_cp2();
    let words: Vec<u16> = bench.feedback.iter().map(|feedback| feedback.device.bits()).collect();
    assert_eq!(words, [0x0100, 0x1100]);
    assert!(bench.feedback.iter().all(|feedback| feedback.svc.status == SvcStatus::VALID | SvcStatus::AHS));
}

#[test]
fn every_parameter_of_the_drive_can_be_read() {
    let mut bench = bench(1);
    bench.up_to_cp2();
    let idns: Vec<Idn> = bench.line.slaves()[0].store().iter().map(|parameter| parameter.idn()).collect();
    let listed = bench.read_list(0, Idn::standard(17)).unwrap();
    assert_eq!(listed.len(), 4 * idns.len());
    for idn in idns {
        bench.open(0, idn).unwrap();
        let parameter = bench.line.slaves()[0].store();
        let parameter = parameter.get(parameter.find(idn).unwrap());
        let (list, data) = (parameter.attribute().is_list(), parameter.data().to_vec());
        if list {
            assert_eq!(bench.read_list(0, idn).unwrap(), data, "{idn}");
        } else {
            let value = bench.read(0, idn).unwrap().to_le_bytes();
            assert_eq!(value[..data.len()], data, "{idn}");
        }
    }
}

#[test]
fn a_bad_layout_is_named_and_can_be_corrected() {
    let mut bench = bench(2);
    bench.up_to_cp2();
    bench.configure();
    bench.write(1, Idn::SVC_MDT_OFFSET, 25).unwrap();
    bench.write(1, Idn::connection(1, 3), 0x0FFF).unwrap();
    assert_eq!(bench.command(0, Idn::CP3_CHECK), Ok(CommandState::Done));
    bench.write(1, Idn::CP3_CHECK, 3).unwrap();
    assert_eq!(bench.open(1, Idn::CP3_CHECK).unwrap().command_state(), CommandState::Failed);
    assert!(bench.feedback[1].device.contains(DeviceStatus::COMMAND_CHANGE));
    let list = bench.read_list(1, Idn::INVALID_CP2).unwrap();
    let wanted = [Idn::SVC_MDT_OFFSET, Idn::connection(1, 3)].map(|idn| idn.0.to_le_bytes()).concat();
    assert_eq!(list, wanted);
    assert_eq!(bench.read(1, Idn::standard(390)), Ok(0xC30C_0101));
    bench.write(1, Idn::CP3_CHECK, 0).unwrap();
    assert!(!bench.feedback[1].device.contains(DeviceStatus::COMMAND_CHANGE));
    bench.configure();
    bench.up_to_cp4();
    assert!(bench.line.slaves().iter().all(|slave| slave.state() == State::In(Phase::CP4)));
    assert_eq!(bench.read_list(1, Idn::INVALID_CP2), Ok(vec![]));
}

#[test]
fn application_parameters_are_checked_before_cp4() {
    let mut bench = bench(1);
    bench.up_to_cp2();
    bench.configure();
    bench.write(0, Idn::standard(32), 0).unwrap();
    assert_eq!(bench.write(0, Idn::standard(32), 0x15), Err(SvcError::INVALID_DATA));
    assert_eq!(bench.command(0, Idn::CP3_CHECK), Ok(CommandState::Done));
    bench.switch(Phase::CP3);
    assert_eq!(bench.command(0, Idn::CP4_CHECK), Ok(CommandState::Failed));
    assert_eq!(bench.read_list(0, Idn::INVALID_CP3), Ok(32u32.to_le_bytes().to_vec()));
    bench.write(0, Idn::standard(32), 2).unwrap();
    assert_eq!(bench.command(0, Idn::CP4_CHECK), Ok(CommandState::Done));
    assert_eq!(bench.command(0, Idn::CP3_CHECK), Err(SvcError::NOT_EXECUTABLE));
    bench.switch(Phase::CP4);
    assert_eq!(bench.line.slaves()[0].state(), State::In(Phase::CP4));
    assert_eq!(bench.write(0, Idn::standard(32), 1), Err(SvcError::DATA_PROTECTED));
    assert_eq!(bench.write(0, Idn::standard(36), 1), Err(SvcError::CYCLIC));
}

#[test]
fn a_switch_without_its_check_ends_in_nrt_with_an_error() {
    let mut bench = bench(1);
    bench.up_to_cp2();
    bench.configure();
    bench.command(0, Idn::CP3_CHECK).unwrap();
    // A communication parameter written behind the check voids it.
    bench.write(0, Idn::MST_LOSSES, 3).unwrap();
    bench.switch(Phase::CP3);
    let slave = &bench.line.slaves()[0];
    assert_eq!((slave.state(), slave.fault()), (State::Nrt, Some(Fault::NotReady)));
    assert_eq!(slave.store().number_of(Idn::standard(14)), 0x0102, "in CP2, not acknowledged");
    assert_eq!(slave.store().number_of(Idn::standard(11)), 1 << 12);
    // The error stays until S-0-0099.
    bench.restart();
    bench.up_to_cp2();
    assert!(bench.feedback[0].device.contains(DeviceStatus::DEVICE_ERROR));
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycle();
    assert!(!bench.feedback[0].device.contains(DeviceStatus::DEVICE_ERROR));
    assert_eq!(bench.read(0, Idn::standard(11)), Ok(0));
}

#[test]
fn lost_msts_are_counted_warned_of_and_end_in_nrt() {
    let mut bench = Bench::in_cp4(1);
    assert_eq!(bench.feedback[0].device, DeviceStatus::from_bits_retain(0x1100));
    let late = |violation: &Violation| {
        by_the_master(violation) && matches!(violation.rule, Rule::MstInterval { .. })
    };
    bench.now = bench.now + CYCLE * 2;
    bench.breaking(late, Bench::cycle);
    assert_eq!(bench.feedback[0].device.bits(), 0x1100, "two of four are no warning");
    bench.now = bench.now + CYCLE * 3;
    bench.breaking(late, Bench::cycle);
    assert_eq!(bench.feedback[0].device.bits() & 0x8040, 0x8040);
    assert_eq!(bench.line.slaves()[0].store().number_of(Idn::standard(1028)), 5);
    bench.cycle();
    assert_eq!(bench.feedback[0].device.bits() & 0x8040, 0);
    let wake = bench.line.wake_at().unwrap();
    assert_eq!(wake, bench.now + CYCLE * 5 + DurationNs(500_001));
    bench.line.handle_time(wake - DurationNs(1));
    assert_eq!(bench.line.slaves()[0].state(), State::In(Phase::CP4));
    bench.line.handle_time(wake);
    let slave = &bench.line.slaves()[0];
    assert_eq!((slave.state(), slave.fault()), (State::Nrt, Some(Fault::MstLoss)));
    assert_eq!(slave.store().number_of(Idn::standard(390)), 0xC30F_0008);
}

#[test]
fn connections_that_stop_are_an_error_that_can_be_reset() {
    let mut bench = Bench::in_cp4(2);
    bench.producing = false;
    bench.cycles(2);
    assert!(!bench.feedback[1].device.contains(DeviceStatus::CONNECTION_ERROR), "two losses are permitted");
    bench.cycle();
    let wanted = DeviceStatus::CONNECTION_ERROR | DeviceStatus::DEVICE_ERROR;
    assert!(bench.feedback.iter().all(|feedback| feedback.device.contains(wanted)));
    assert_eq!(bench.read(0, Idn::connection(0, 12)).map(|losses| losses & 0xFFFF), Ok(3));
    bench.producing = true;
    bench.cycles(3);
    assert!(bench.feedback[0].device.contains(wanted));
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycles(2);
    assert!(!bench.feedback[0].device.intersects(wanted));
    assert!(bench.feedback[1].device.contains(wanted), "the other one was not reset");
}

#[test]
fn a_second_copy_of_a_telegram_changes_nothing() {
    let mut bench = Bench::in_cp4(1);
    bench.cycles(1);
    let (mut mdt, at) = bench.next_telegrams();
    let (mut again, mut first, mut second) = (mdt.clone(), at.clone(), at);
    bench.send(&mut mdt);
    bench.send(&mut first);
    let twice = |violation: &Violation| {
        by_the_master(violation)
            && matches!(violation.rule, Rule::CycleCounter { .. } | Rule::MstInterval { .. })
    };
    bench.breaking(twice, |bench| {
        bench.send(&mut again);
        bench.send(&mut second);
    });
    assert_eq!(first, second);
    assert_ne!(first[HEADER_LEN..], [0; 60][..first.len().min(60) - HEADER_LEN]);
}

#[test]
fn broken_headers_are_passed_on_and_counted() {
    let mut bench = Bench::in_cp4(1);
    let (mut mdt, mut at) = bench.next_telegrams();
    mdt[16] ^= 1;
    let sent = mdt.clone();
    // Without its MST the AT is one of the cycle before, and the production is not seen.
    let broken = |violation: &Violation| {
        use Rule as R;
        let follows = matches!(
            violation.rule,
            R::Order { .. }
                | R::PhaseMixed { .. }
                | R::TelegramTooLate { .. }
                | R::CycleCounter { .. }
                | R::MstInterval { .. }
                | R::Production { .. }
        );
        by_the_master(violation) && (violation.rule == Rule::Header || follows)
    };
    bench.breaking(broken, |bench| {
        assert!(bench.send(&mut mdt));
        bench.send(&mut at);
        bench.cycle();
    });
    assert_eq!(mdt, sent);
    assert_eq!(bench.read_list(0, Idn::standard(1035)), Ok(vec![1, 0, 0, 0]));
    bench.write_list(0, Idn::standard(1035), &[0; 4]).unwrap();
    assert_eq!(bench.read_list(0, Idn::standard(1035)), Ok(vec![0; 4]));
}

#[test]
fn down_to_cp0_and_up_again() {
    let mut bench = Bench::in_cp4(2);
    bench.switch(Phase::CP0);
    assert!(bench.line.slaves().iter().all(|slave| slave.state() == State::In(Phase::CP0)));
    assert_eq!(bench.line.slaves()[0].fault(), None);
    bench.up_to_cp2();
    bench.configure();
    bench.up_to_cp4();
    assert!(bench.line.slaves().iter().all(|slave| slave.state() == State::In(Phase::CP4)));
    let before = bench.feedback[0].connection;
    bench.cycle();
    assert_eq!(bench.feedback[0].connection, before.produced(), "counts and toggles");
}

/// The line belongs to the primary channel: slaves write into an AT of the other one where that enters them.
#[test]
fn an_at_of_the_other_channel_is_written_on_its_way_back() {
    let mut bench = Bench::in_cp4(2);
    bench.cycle();
    let mut frame = bench.frame(Channel::Secondary, Kind::At, 0, 60);
    let on_the_way_back = |found: &Violation| matches!(found.rule, Rule::ReturnPath { telegram } if telegram.channel() == Channel::Secondary);
    assert!(bench.breaking(on_the_way_back, |bench| bench.send(&mut frame)));
    assert!(frame[HEADER_LEN..].iter().any(|&byte| byte != 0));
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(64))]
    /// Whatever arrives in whatever phase, nothing panics, and only ATs are changed.
    #[test]
    fn any_frames_are_survived(frames in proptest::collection::vec(
        (0u8..=255, 0u8..=255, proptest::collection::vec(0u8..=255, 0..80)), 1..40
    )) {
        let mut bench = Bench::in_cp4(2);
        for (telegram, phase, data) in frames {
            let mut frame = vec![0; HEADER_LEN];
            frame.extend(data);
            let header = Header { source: [2; 6], telegram: TelegramType(telegram), phase: PhaseField(phase) };
            header.emit(&mut frame).unwrap();
            let sent = frame.clone();
            bench.now = bench.now + CYCLE;
            bench.tolerating(from_noise, |bench| bench.send(&mut frame));
            proptest::prop_assert!(header.telegram.kind() == Kind::At || frame == sent);
        }
    }
}
