//! Whole slaves on a line: from NRT to CP4, and what is odd about them.

use super::rig::Rig;
use super::telegram::{build, get_u16, header};
use super::*;

fn addressed(address: u16) -> Settings {
    Settings { address, ..Settings::default() }
}

#[test]
fn the_recorded_scan_of_two_slaves_is_given() {
    let mut rig = Rig::new(vec![addressed(1), addressed(2)]);
    // The frames of the recording: MDT0 and AT0 of the first cycle.
    let mac = [0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F];
    let mut mdt = vec![0; 40];
    mdt[0] = 1;
    let mdt = build(mac, 0x20, 0, &mdt);
    assert_eq!(rig.send(mdt.clone(), false), Some((mdt, false)));
    let mut words = vec![0xFF; 1024];
    words[..2].copy_from_slice(&[1, 0]);
    let (at, at_end) = rig.send(build(mac, 0x60, 0, &words), false).unwrap();
    assert!(!at_end);
    assert_eq!(at[16..20], [0xF5, 0x11, 0xC9, 0xCA]);
    assert_eq!(at[20..30], [0x04, 0x00, 0x01, 0x00, 0x02, 0x00, 0xFF, 0xFF, 0xFF, 0xFF]);
    assert_eq!(rig.slaves[1].topology_address(), Some(2));
}

#[test]
fn an_address_need_not_be_the_place() {
    let mut rig = Rig::new(vec![addressed(7), addressed(511), addressed(0)]);
    rig.cycles(3);
    assert_eq!(rig.ats[0][20..30], [6, 0, 7, 0, 0xFF, 1, 0, 0, 0xFF, 0xFF]);
}

#[test]
fn a_ring_is_scanned_from_both_ends() {
    let mut rig = Rig::new(vec![addressed(1), addressed(2), addressed(3)]);
    rig.ring = true;
    rig.slaves[2].set_neighbour(2, true);
    rig.cycles(3);
    assert_eq!(rig.ats[0][20..28], [4, 0, 1, 0, 2, 0, 3, 0]);
    assert_eq!(rig.secondary[0][20..28], [4, 0x80, 3, 0, 2, 0, 1, 0]);
    rig.up_to_cp4(true);
    assert_eq!(rig.ats[0][20..], rig.secondary[0][20..]);
    assert_eq!(rig.slaves[2].consumer(0), Some(Consumer::Consuming));
}

#[test]
fn the_version_bits_are_acknowledged() {
    for (version, word) in [(1, 5), (1 << 21 | 1, 0x8005)] {
        let mut rig = Rig::one(addressed(5));
        rig.version = version;
        rig.cycles(2);
        assert_eq!(get_u16(&rig.ats[0], 22), Some(word));
    }
    let mut rig = Rig::one(Settings { acknowledge_version: false, ..addressed(5) });
    rig.version = 1 << 20;
    rig.cycles(2);
    assert_eq!(get_u16(&rig.ats[0], 22), Some(5));
}

#[test]
fn a_switch_takes_the_insertions_away() {
    let mut rig = Rig::one(Settings::default());
    rig.cycles(2);
    rig.cps = true;
    rig.cycles(2);
    assert_eq!(rig.ats[0][20..24], [1, 0, 0xFF, 0xFF]);
    rig.cps = false;
    rig.wait(120_000_000);
    rig.phase = 1;
    rig.cycles(2);
    assert_eq!((rig.s_dev(0), rig.s_svc(0)), (0x1100, (0x0008, 0)));
    rig.stations[0].mhs = true;
    rig.cycle();
    assert_eq!(rig.s_svc(0), (0x0009, 0));
    rig.cps = true;
    rig.cycles(2);
    assert_eq!((rig.s_dev(0), rig.s_svc(0)), (0, (0, 0)));
    rig.cps = false;
    rig.wait(120_000_000);
    rig.phase = 2;
    rig.cycle();
    assert_eq!((rig.s_dev(0), rig.s_svc(0)), (0x1100, (0x0009, 0)));
}

#[test]
fn the_recorded_steps_of_cp2_get_their_answers() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp2();
    // Control words and INFO as the foreign master sent them; the answers by the sheet.
    let steps: [(u16, u32, u16, u32); 14] = [
        (0x000E, 0x0001_0516, 0x08, 0),
        (0x001D, 0x0001_0516, 0x09, 0x7001_0001),
        (0x003C, 0x0001_0516, 0x08, 2),
        (0x000F, 0x0000_0020, 0x09, 0),
        (0x003E, 0x0000_0003, 0x08, 0),
        (0x000F, 0x0000_03E8, 0x09, 0),
        (0x0038, 0x0000_03E8, 0x08, 0x0040_0006),
        (0x0007, 0x0000_03E8, 0x09, 0),
        (0x000E, 0x0000_03EE, 0x08, 0),
        (0x002D, 0x0000_03EE, 0x09, 0),
        (0x000E, 0x0003_041A, 0x08, 0x0100),
        (0x003F, 0x0003_081E, 0x09, 0),
        (0x000E, 0x0000_0FFF, 0x0C, 0x1001),
        (0x0021, 0x0000_0000, 0x0D, 0x0001),
    ];
    for (control, info, status, answer) in steps {
        let s = &mut rig.stations[0];
        (s.mhs, s.control, s.info) = (control & 1 == 1, control & !1, info);
        rig.cycle();
        assert_eq!(rig.s_svc(0), (status, answer), "{control:x} {info:x}");
    }
    assert_eq!(rig.slaves[0].data(Idn::se(1050, 0, 3)), Some(&[0x1E, 0x08][..]));
    assert_eq!(rig.slaves[0].writes()[0].idn, "S-0-0032");
    assert_eq!(rig.slaves[0].writes()[1].bytes, [0x1E, 0x08]);
    assert_eq!(rig.slaves[0].refused().len(), 1);
}

#[test]
fn a_variable_slave_goes_to_cp4_and_turns() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    assert_eq!(rig.slaves[0].phase(), Some(4));
    assert_eq!(rig.s_dev(0) & 0x0100, 0x0100);
    assert_eq!(rig.slaves[0].data(Idn::se(1050, 1, 5)), Some(&[12, 0][..]));
    rig.drive(0, 0xE000, 6_000_000);
    rig.cycles(100);
    assert!((rig.slaves[0].velocity() - 10.0).abs() < 1e-3);
    let at = rig.produced(0);
    assert_eq!(at[2..4], [0x08, 0xC0]);
    assert_eq!(at[8..12], 6_000_000i32.to_le_bytes());
    assert_eq!(u16::from_le_bytes([at[0], at[1]]) & 1, 1);
    assert!(rig.slaves[0].enabled());
    rig.drive(0, 0, 0);
    rig.cycles(2);
    assert!(!rig.slaves[0].enabled());
}

#[test]
fn a_fixed_slave_refuses_lists_and_works_as_it_is() {
    let mut rig = Rig::new(vec![Settings::fixcfg(), Settings::default()]);
    rig.up_to_cp2();
    assert_eq!(rig.write_list(0, Idn::se(1050, 0, 6), &[0x86, 0, 0, 0]), Err(0x7004));
    assert_eq!(rig.read(0, Idn::se(1050, 0, 5), 7), Ok(8));
    assert_eq!(rig.read(0, Idn::se(1050, 1, 5), 7), Ok(12));
    assert_eq!(rig.write(0, Idn::se(1050, 0, 5), 4), Err(0x7004));
    assert_eq!(rig.read_list(0, Idn::se(1050, 1, 6), 7).unwrap(), [135, 0, 0, 0, 51, 0, 0, 0, 40, 0, 0, 0]);
    assert_eq!(rig.open(0, Idn::s(1051)), Err(0x1001));
    rig.configure(0, false, false);
    rig.configure(1, true, false);
    for i in 0..2 {
        assert_eq!(rig.command(i, Idn::s(127)), Ok(3));
    }
    rig.switch();
    for i in 0..2 {
        assert_eq!(rig.command(i, Idn::s(128)), Ok(3));
    }
    rig.switch();
    rig.drive(0, 0xE000, 600_000);
    rig.cycles(100);
    assert_eq!(rig.produced(0)[8..12], 600_000i32.to_le_bytes());
    assert!(!rig.slaves[1].enabled());
}

#[test]
fn the_producer_may_come_first_and_a_third_stay_unused() {
    let mut rig = Rig::one(Settings::odd_order());
    rig.up_to_cp2();
    assert_eq!(rig.write(0, Idn::se(1050, 0, 1), 0x8000), Err(0x7008));
    rig.configure(0, false, true);
    assert_eq!(rig.write(0, Idn::se(1050, 2, 1), 0), Ok(()));
    assert_eq!(rig.command(0, Idn::s(127)), Ok(3));
    rig.switch();
    assert_eq!(rig.command(0, Idn::s(128)), Ok(3));
    rig.switch();
    rig.cycles(3);
    assert_eq!(rig.slaves[0].consumer(1), Some(Consumer::Consuming));
}

#[test]
fn a_declared_length_may_contradict_the_list() {
    let mut settings = Settings::fixcfg();
    settings.connections[1].declared_length = Some(10);
    let mut rig = Rig::one(settings);
    rig.up_to_cp2();
    assert_eq!(rig.read(0, Idn::se(1050, 1, 5), 7), Ok(10));
    assert_eq!(rig.read_list(0, Idn::se(1050, 1, 6), 7).map(|list| list.len()), Ok(12));
}

#[test]
fn a_refused_transition_names_its_parameters() {
    let settings =
        Settings { refuse_cp3: vec![Idn::p(7)], command_ms: vec![(Idn::s(127), 30)], ..Settings::default() };
    let mut rig = Rig::one(settings);
    rig.up_to_cp2();
    rig.configure(0, true, false);
    rig.write(0, Idn::s(127), 3).unwrap();
    assert_eq!(rig.open(0, Idn::s(127)), Ok(7));
    assert_eq!(rig.read(0, Idn::s(390), 7), Ok(0xC30C_0100));
    rig.cycles(30);
    assert_eq!(rig.open(0, Idn::s(127)), Ok(0xF));
    assert_eq!(rig.s_dev(0) & 0x20, 0x20);
    assert_eq!(rig.read(0, Idn::s(390), 7), Ok(0xC30C_0101));
    assert_eq!(rig.read_list(0, Idn::s(21), 7).unwrap(), [7, 0x80, 0, 0]);
    rig.write(0, Idn::s(127), 0).unwrap();
    assert_eq!(rig.s_dev(0) & 0x20, 0);
    rig.switch();
    assert_eq!(rig.slaves[0].phase(), None);
    assert_eq!(rig.slaves[0].data(Idn::s(14)), Some(&[0x02, 0x01][..]));
}

#[test]
fn a_refused_cp4_lists_what_is_wrong() {
    let settings = Settings { refuse_cp4: vec![Idn::s(100)], ..Settings::default() };
    let mut rig = Rig::one(settings);
    rig.up_to_cp2();
    rig.configure(0, true, false);
    assert_eq!(rig.command(0, Idn::s(127)), Ok(3));
    rig.switch();
    assert_eq!(rig.slaves[0].phase(), Some(3));
    assert_eq!(rig.command(0, Idn::s(128)), Ok(0xF));
    assert_eq!(rig.read_list(0, Idn::s(22), 7).unwrap(), [100, 0, 0, 0]);
}

#[test]
fn lost_mst_lead_to_nrt() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    rig.drop_mdt = true;
    rig.cycles(2);
    assert_eq!(rig.s_dev(0), 0, "without an MST nothing is inserted");
    rig.drop_mdt = false;
    rig.cycle();
    assert_eq!(rig.s_dev(0), 0x1100);
    assert_eq!(rig.slaves[0].data(Idn::s(1028)), Some(&[2, 0][..]));
    rig.drop_mdt = true;
    rig.cycles(5);
    assert_eq!(rig.slaves[0].phase(), None);
    assert_eq!(rig.slaves[0].data(Idn::s(14)), Some(&[0x0C, 0][..]));
    assert_eq!(rig.slaves[0].data(Idn::s(11)), Some(&[0, 0x10][..]));
}

#[test]
fn frozen_data_put_the_drive_into_error() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    rig.drive(0, 0xE000, 600_000);
    rig.cycles(20);
    rig.freeze = true;
    rig.cycles(2);
    assert_eq!(rig.slaves[0].consumer(0), Some(Consumer::Warning));
    rig.cycles(10);
    assert_eq!(rig.slaves[0].consumer(0), Some(Consumer::Error));
    assert_eq!(rig.s_dev(0) & 0x0280, 0x0280);
    assert!(!rig.slaves[0].enabled());
}

#[test]
fn a_hung_slave_lets_frames_through() {
    let mut rig = Rig::new(vec![Settings::default(), Settings::default()]);
    rig.up_to_cp4(true);
    let now = rig.now;
    rig.slaves[0].settings_mut().hung_from_ns = Some(now);
    rig.cycles(2);
    assert_eq!((rig.s_dev(0), rig.s_dev(1) & 0x0100), (0, 0x0100));
    assert_eq!(rig.produced(0), [0; 12]);
    rig.slaves[0].settings_mut().dead_from_ns = Some(now);
    rig.cycle();
    assert!(rig.ats[0].is_empty());
}

#[test]
fn an_error_may_last_for_one_telegram() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    let from = rig.now + 2_500_000;
    rig.slaves[0].settings_mut().flash_error = Some((from, 0x0080));
    let mut seen = Vec::new();
    for _ in 0..6 {
        rig.cycle();
        seen.push((rig.produced(0)[3] & 0x20 != 0, rig.s_dev(0) & 0x80 != 0));
    }
    let (no, yes) = ((false, false), (true, true));
    assert_eq!(seen, [no, no, no, yes, no, no]);
}

#[test]
fn an_error_may_have_no_number_and_may_not_go() {
    let settings = Settings { no_diagnostic_number: true, lasting_errors: 0x0200, ..Settings::default() };
    let mut rig = Rig::one(settings);
    rig.up_to_cp4(true);
    rig.slaves[0].raise(0x0202);
    assert_eq!(rig.read(0, Idn::s(390), 7), Ok(0xC30A_0040));
    assert_eq!(rig.command(0, Idn::s(99)), Ok(0xF));
    assert_eq!(rig.read(0, Idn::s(11), 7), Ok(0x0200));
    rig.slaves[0].settings_mut().lasting_errors = 0;
    rig.slaves[0].settings_mut().no_diagnostic_number = false;
    assert_eq!(rig.read(0, Idn::s(390), 7), Ok(0xC00F_0009));
    assert_eq!(rig.command(0, Idn::s(99)), Ok(3));
    assert_eq!(rig.read(0, Idn::s(11), 7), Ok(0));
}

#[test]
fn busy_and_chosen_error_codes() {
    let settings = Settings {
        busy_cycles: 1,
        busy_on: vec![(Idn::s(32), 4)],
        svc_errors: vec![
            SvcError { idn: Idn::s(33), element: 7, write: false, code: 0x7009 },
            SvcError { idn: Idn::s(34), element: 1, write: true, code: 0x7012 },
        ],
        ..Settings::default()
    };
    let mut rig = Rig::one(settings);
    rig.up_to_cp2();
    let before = rig.now;
    assert_eq!(rig.read(0, Idn::s(32), 7), Ok(2));
    assert_eq!((rig.now - before) / rig.cycle_ns, 12);
    assert_eq!(rig.read(0, Idn::s(33), 7), Err(0x7009));
    assert_eq!(rig.write(0, Idn::s(33), 2), Ok(()));
    assert_eq!(rig.open(0, Idn::s(34)), Err(0x7012));
}

#[test]
fn a_handshake_that_sticks_is_never_answered() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp2();
    rig.slaves[0].settings_mut().stuck_handshake_from_ns = Some(0);
    assert_eq!(rig.open(0, Idn::s(32)), Err(0));
}

#[test]
fn new_data_that_stick_do_not_count() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    rig.cycle();
    let before = rig.produced(0);
    rig.cycle();
    assert_ne!(rig.produced(0)[..2], before[..2]);
    rig.slaves[0].settings_mut().stuck_new_data_from_ns = Some(0);
    rig.cycle();
    let stuck = rig.produced(0);
    rig.cycles(3);
    assert_eq!(rig.produced(0)[..2], stuck[..2]);
}

#[test]
fn odd_names_are_read_byte_for_byte() {
    let mut rig = Rig::one(Settings::odd_names());
    rig.up_to_cp2();
    let name = rig.read_list(0, Idn::s(36), 2).unwrap();
    assert_eq!(name.last(), Some(&0xB5));
    assert_eq!(rig.read_list(0, Idn::s(40), 2), Ok(vec![]));
    assert_eq!(rig.read_list(0, Idn::s(51), 2).map(|n| n.len()), Ok(4000));
    assert_eq!(rig.read_list(0, Idn::s(51), 4), Ok(vec![0xB0]));
    assert_eq!(rig.read_list(0, Idn::s(11), 4), Err(0x4001));
}

#[test]
fn long_lists_and_absent_parameters() {
    let mut rig = Rig::one(Settings { long_list: 1000, ..Settings::sparse() });
    rig.up_to_cp2();
    let list = rig.read_list(0, Idn::p(100), 7).unwrap();
    assert_eq!((list.len(), &list[3996..]), (4000, &[0xE7, 3, 0, 0][..]));
    for block in [33, 34, 35, 292, 95] {
        assert_eq!(rig.open(0, Idn::s(block)), Err(0x1001), "{block}");
    }
    let all = rig.read_list(0, Idn::s(17), 7).unwrap();
    assert!(!all.chunks(4).any(|quad| quad == [33, 0, 0, 0]));
    assert!(all.chunks(4).any(|quad| quad == [32, 0, 0, 0]));
}

#[test]
fn protection_follows_the_phase() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp2();
    assert_eq!(rig.write(0, Idn::s(32), 3), Ok(()));
    assert_eq!(rig.write(0, Idn::s(148), 3), Err(0x7005));
    assert_eq!(rig.write(0, Idn::s(51), 3), Err(0x7004));
    assert_eq!(rig.write(0, Idn::s(1040), 512), Err(0x7007));
    rig.configure(0, true, false);
    rig.command(0, Idn::s(127)).unwrap();
    rig.switch();
    assert_eq!(rig.write(0, Idn::s(1002), 3), Err(0x7005));
    assert_eq!(rig.write(0, Idn::s(32), 2), Ok(()));
    rig.command(0, Idn::s(128)).unwrap();
    rig.switch();
    assert_eq!(rig.write(0, Idn::s(32), 3), Err(0x7005));
    assert_eq!(rig.write(0, Idn::s(36), 3), Err(0x700A));
    assert_eq!(rig.write(0, Idn::s(37), 3), Ok(()));
    assert_eq!(rig.slaves[0].refused().last().unwrap().code, 0x700A);
}

#[test]
fn homing_by_command() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    assert_eq!(rig.command(0, Idn::s(148)), Ok(0xF));
    rig.drive(0, 0xE000, 0);
    rig.cycles(5);
    assert_eq!(rig.command(0, Idn::s(148)), Ok(3));
    assert_eq!(rig.produced(0)[2] & 0x20, 0x20);
    assert_eq!(rig.read(0, Idn::s(403), 7), Ok(1));
    assert_eq!(rig.command(0, Idn::s(191)), Ok(3));
    assert_eq!(rig.read(0, Idn::s(403), 7), Ok(0));
}

#[test]
fn a_way_back_to_cp0_and_up_again() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    rig.switch();
    assert_eq!(rig.slaves[0].phase(), Some(0));
    rig.stations[0] = super::rig::Station { c_dev: 0x0100, command: vec![0; 6], ..Default::default() };
    rig.up_to_cp4(true);
    assert_eq!(rig.slaves[0].phase(), Some(4));
}

#[test]
fn a_slave_may_ignore_a_switch() {
    let mut rig = Rig::one(Settings { ignore_switch_to: Some(3), ..Settings::default() });
    rig.up_to_cp2();
    rig.cps = true;
    rig.cycles(3);
    assert_eq!(rig.s_dev(0) & 0x0100, 0x0100);
}

#[test]
fn every_truncation_and_every_byte_is_harmless() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    let slave = rig.slaves[0].clone();
    for type_byte in [0x20u8, 0x21, 0x60, 0x63, 0xA0, 0xE0, 0xFF] {
        for phase_byte in [0x00u8, 0x01, 0x02, 0x03, 0x04, 0x80, 0x83, 0xFF] {
            let whole = build([2; 6], type_byte, phase_byte, &[0xA5; 60]);
            for length in 0..=whole.len() {
                let mut slave = slave.clone();
                let mut cut = whole[..length].to_vec();
                let out = slave.pass(rig.now, 1, &mut cut);
                assert_eq!(cut.len(), length);
                assert!(matches!(out, None | Some(1 | 2)));
                slave.tick(rig.now + 1_000_000);
                if length >= 20 {
                    assert_eq!(cut[..20], whole[..20], "the header stays");
                    assert!(header(&cut, true).is_ok());
                }
            }
        }
    }
    let mut slave = slave;
    assert_eq!(slave.pass(0, 0, &mut []), None);
    assert_eq!(slave.pass(0, 3, &mut [0; 60]), None);
    assert_eq!(slave.pass(u64::MAX, 1, &mut [0; 60]), None);
    slave.tick(u64::MAX);
}

#[test]
fn a_frame_with_a_wrong_crc_is_only_forwarded() {
    let mut rig = Rig::one(Settings::default());
    rig.up_to_cp4(true);
    let mut frame = build([2; 6], 0x20, 0x04, &[0; 40]);
    frame[16] ^= 1;
    let before = frame.clone();
    assert_eq!(rig.slaves[0].pass(rig.now, 1, &mut frame), Some(1));
    assert_eq!(frame, before);
    assert_eq!(rig.slaves[0].data(Idn::s(1035)), Some(&[1, 0, 0, 0][..]));
}

#[test]
fn the_same_input_gives_the_same_output() {
    let run = || {
        let mut rig = Rig::one(Settings::default());
        rig.up_to_cp4(true);
        rig.drive(0, 0xE000, 1_234_567);
        rig.cycles(50);
        (rig.ats, rig.slaves[0].position().to_bits(), rig.slaves[0].log().to_vec())
    };
    assert_eq!(run(), run());
}
