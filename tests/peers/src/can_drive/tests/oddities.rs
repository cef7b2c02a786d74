//! Each odd setting does what it says.

use super::Rig;
use crate::can::Frame;
use crate::can_drive::settings::{CyclicBit, Period, SafetyReaction, ShortPdo, VoltageBit};
use crate::can_drive::{CanDrive, NmtState, Settings, State};

#[test]
fn what_bit_4_means() {
    let words = |bit| {
        let mut rig = Rig::new(Settings { voltage_bit: bit, mode_at_start: 1, ..Settings::default() });
        let mut seen = vec![rig.status()];
        for word in [6, 7, 15] {
            rig.word(word);
            seen.push(rig.status());
        }
        seen
    };
    assert_eq!(words(VoltageBit::Zero), [0x0240, 0x0221, 0x0223, 0x0627]);
    assert_eq!(words(VoltageBit::Enabled), [0x0240, 0x0221, 0x0223, 0x0637]);
    assert_eq!(words(VoltageBit::SwitchedOn), [0x0240, 0x0221, 0x0233, 0x0637]);
    assert_eq!(words(VoltageBit::DcLink), [0x0250, 0x0231, 0x0233, 0x0637]);
}

#[test]
fn without_mains_it_is_not_switched_on() {
    let mut rig = Rig::plain();
    rig.drive.set_mains(false);
    rig.word(6);
    assert_eq!(rig.status(), 0x0221);
    rig.word(7);
    assert_eq!(rig.status(), 0x0221);
    rig.drive.set_mains(true);
    rig.word(15);
    assert!(rig.drive.enabled());
    rig.drive.set_mains(false);
    rig.run(3);
    assert_eq!(rig.drive.state(), State::Fault);
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0x20, 0x32]));
    // Or it is for three seconds.
    let mut rig = Rig::new(Settings { mains_wait_ms: Some(3000), ..Settings::default() });
    rig.drive.set_mains(false);
    rig.word(6);
    rig.word(7);
    rig.word(15);
    rig.run(2990);
    assert_eq!(rig.drive.state(), State::SwitchedOn);
    rig.run(20);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn constant_bits_and_noise() {
    let settings = Settings {
        bits_always: 0x1080,
        bits_never: 0x0200,
        noise: 0xC900,
        noise_ms: 5,
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    let mut seen = Vec::new();
    for _ in 0..4 {
        seen.push(rig.status());
        rig.run(5);
    }
    seen.sort_unstable();
    assert_eq!(seen, [0x10D0, 0x10D0, 0xD9D0, 0xD9D0]);
}

#[test]
fn not_ready_may_last_and_look_like_more() {
    let settings = Settings { not_ready_ms: 100, not_ready_bit_6: true, ..Settings::default() };
    let mut rig = Rig::new(settings);
    assert_eq!(rig.status(), 0x0250);
    assert_eq!(rig.drive.state(), State::NotReady);
    rig.word(6);
    assert_eq!(rig.drive.state(), State::NotReady);
    rig.run(100);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    let mut rig = Rig::new(Settings { ready_after: Some((0x6085, 0)), ..Settings::default() });
    rig.run(500);
    assert_eq!(rig.status(), 0x0210);
    rig.write(0x6085, 0, &[1, 2, 3, 0]);
    rig.run(1);
    assert_eq!(rig.status(), 0x0250);
}

#[test]
fn a_passing_quick_stop() {
    let mut rig = Rig::new(Settings { quick_stop_passes_ms: Some(2), ..Settings::default() });
    rig.write(0x60FF, 0, &100_000_i32.to_le_bytes());
    rig.enable(3);
    rig.run(300);
    rig.word(2);
    assert_eq!(rig.drive.state(), State::QuickStopActive);
    rig.run(3);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    assert!(rig.drive.velocity() > 0);
}

#[test]
fn the_safety_input() {
    let mut rig = Rig::plain();
    rig.enable(8);
    rig.drive.set_safe(true);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.word(6);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.drive.set_safe(false);
    rig.word(6);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);

    let mut rig = Rig::new(Settings { safety: SafetyReaction::SwitchedOn, ..Settings::default() });
    rig.enable(8);
    rig.drive.set_safe(true);
    rig.word(15);
    assert_eq!(rig.drive.state(), State::SwitchedOn);

    let mut rig = Rig::new(Settings { safety: SafetyReaction::Fault(0xFF01), ..Settings::default() });
    rig.enable(8);
    rig.drive.set_safe(true);
    rig.run(2);
    assert_eq!(rig.drive.state(), State::Fault);
}

#[test]
fn pdo_objects_that_refuse() {
    let mut settings = Settings {
        rpdo_types: vec![(0, 0), (254, 255)],
        remap_only_preoperational: true,
        bit_30_fixed: true,
        max_entries: 2,
        ..Settings::default()
    };
    settings.tpdos[0].bit_30 = true;
    let mut rig = Rig::new(settings);
    assert_eq!(rig.write(0x1400, 2, &[1]), 0x0609_0030);
    assert_eq!(rig.write(0x1400, 2, &[0]), 0);
    assert_eq!(rig.read(0x1800, 1), Ok(vec![0x85, 0x01, 0x00, 0x40]));
    assert_eq!(rig.write(0x1800, 1, &[0x85, 0x01, 0x00, 0x80]), 0x0609_0030);
    assert_eq!(rig.write(0x1800, 1, &[0x85, 0x01, 0x00, 0xC0]), 0);
    assert_eq!(rig.write(0x1A00, 0, &[0]), 0);
    assert_eq!(rig.write(0x1A00, 3, &0x6041_0010_u32.to_le_bytes()), 0x0609_0011);
    assert_eq!(rig.write(0x1A00, 0, &[3]), 0x0609_0030);
    rig.send(0, &[1, 5]);
    assert_eq!(rig.write(0x1A00, 0, &[1]), 0x0800_0022);
    assert_eq!(rig.write(0x1800, 1, &[0x85, 0x01, 0x00, 0x40]), 0x0800_0022);
}

#[test]
fn fixed_maps_and_identifiers() {
    let mut rig = Rig::new(Settings { mapping_fixed: true, cob_id_fixed: true, ..Settings::default() });
    assert_eq!(rig.write(0x1600, 0, &[0]), 0x0601_0002);
    assert_eq!(rig.write(0x1A01, 1, &[0; 4]), 0x0601_0002);
    assert_eq!(rig.write(0x1400, 1, &[0x05, 0x02, 0, 0x80]), 0x0601_0002);
    assert_eq!(rig.write(0x1400, 2, &[1]), 0);
}

#[test]
fn objects_that_are_not_there_or_not_so() {
    let mut settings = Settings {
        missing: vec![(0x1018, Some(4)), (0x6075, None), (0x60FF, None)],
        write_only: vec![(0x6060, 0)],
        read_only: vec![(0x6083, 0)],
        values: vec![(0x6098, 0, -1)],
        modes_shown: Some(0),
        device_type: 0x0022_0811,
        ..Settings::default()
    };
    settings = settings.without(0x6076);
    let mut rig = Rig::new(settings);
    assert_eq!(rig.read(0x1018, 4), Err(0x0609_0011));
    assert_eq!(rig.read(0x6075, 0), Err(0x0602_0000));
    assert_eq!(rig.read(0x6076, 0), Err(0x0602_0000));
    assert_eq!(rig.read(0x6060, 0), Err(0x0601_0001));
    assert_eq!(rig.write(0x6083, 0, &[1, 0, 0, 0]), 0x0601_0002);
    assert_eq!(rig.read(0x6098, 0), Ok(vec![0xFF]));
    assert_eq!(rig.read(0x6502, 0), Ok(vec![0; 4]));
    assert_eq!(rig.read(0x1000, 0), Ok(vec![0x11, 0x08, 0x22, 0x00]));
    // RPDO 4 has lost its second entry.
    assert_eq!(rig.read(0x1603, 0), Ok(vec![1]));
    assert_eq!(rig.read(0x1603, 2), Ok(vec![0; 4]));
}

#[test]
fn an_interpolation_period_of_its_own() {
    let read = |period| {
        let mut rig = Rig::new(Settings { period, ..Settings::default() });
        let code = rig.write(0x60C2, 1, &[4]);
        (code, rig.read(0x60C2, 1), rig.read(0x60C2, 2))
    };
    assert_eq!(read(Period::Writable), (0, Ok(vec![4]), Ok(vec![0xFD])));
    assert_eq!(read(Period::ReadOnly(2, -3)), (0x0601_0002, Ok(vec![2]), Ok(vec![0xFD])));
    assert_eq!(read(Period::Sticks(0, -3)), (0, Ok(vec![0]), Ok(vec![0xFD])));
    assert_eq!(read(Period::Absent), (0x0602_0000, Err(0x0602_0000), Err(0x0602_0000)));
}

#[test]
fn a_drive_that_starts_again_on_its_own() {
    let mut rig = Rig::new(Settings { restarts_every_ms: Some(50), boot_ms: 5, ..Settings::default() });
    rig.write(0x6065, 0, &[9, 0, 0, 0]);
    rig.send(0, &[1, 5]);
    assert_eq!(rig.drive.nmt_state(), NmtState::Operational);
    rig.said.clear();
    rig.run(51);
    assert_eq!(rig.heard(0x705), [[0]]);
    assert_eq!(rig.drive.nmt_state(), NmtState::PreOperational);
    assert_eq!(rig.long(0x6065), 20_000);
    assert_eq!(rig.drive.boots(), 2);
    rig.run(110);
    assert_eq!(rig.drive.boots(), 4);
}

#[test]
fn a_silent_start() {
    let mut drive = CanDrive::new(Settings { silent_boot: true, self_starting: true, ..Settings::default() });
    let mut out = Vec::new();
    drive.node.s.sends_at_start = false;
    crate::can::Station::tick(&mut drive, 0, &mut out);
    assert!(out.is_empty());
    assert_eq!(drive.nmt_state(), NmtState::Operational);
    assert_eq!(drive.boots(), 1);
}

#[test]
fn modes_that_do_not_change() {
    let mut rig = Rig::new(Settings { mode_refused_enabled: true, ..Settings::default() });
    rig.enable(8);
    assert_eq!(rig.write(0x6060, 0, &[9]), 0x0800_0022);
    assert_eq!(rig.write(0x6060, 0, &[8]), 0);

    let mut rig = Rig::new(Settings { mode_refused_halted: true, ..Settings::default() });
    rig.word(0x100);
    assert_eq!(rig.write(0x6060, 0, &[9]), 0x0800_0022);
    rig.word(0);
    assert_eq!(rig.write(0x6060, 0, &[9]), 0);

    let mut rig = Rig::new(Settings { mode_detour: Some((3, 6)), mode_at_start: 3, ..Settings::default() });
    for (asked, shown) in [(8, 3), (6, 6), (8, 8)] {
        rig.write(0x6060, 0, &[asked]);
        assert_eq!(rig.read(0x6061, 0), Ok(vec![shown]));
    }

    let mut rig = Rig::new(Settings { mode_zero_refused: true, ..Settings::default() });
    assert_eq!(rig.write(0x6060, 0, &[0]), 0x0609_0030);
}

#[test]
fn a_mode_that_takes_its_time() {
    let mut rig = Rig::new(Settings { mode_delay_ms: 300, mode_meanwhile: Some(-1), ..Settings::default() });
    rig.write(0x6060, 0, &[8]);
    assert_eq!(rig.read(0x6061, 0), Ok(vec![0xFF]));
    rig.run(298);
    assert_eq!(rig.read(0x6061, 0), Ok(vec![0xFF]));
    rig.run(3);
    assert_eq!(rig.read(0x6061, 0), Ok(vec![8]));
}

#[test]
fn mode_zero_in_a_pdo() {
    for (clears, shown) in [(false, 8), (true, 0)] {
        let mut rig =
            Rig::new(Settings { mode_zero_clears: clears, enable_needs_mode: true, ..Settings::default() });
        rig.send(0, &[1, 5]);
        rig.send(0x305, &[6, 0, 8]);
        rig.send(0x305, &[6, 0, 0]);
        assert_eq!(rig.read(0x6061, 0), Ok(vec![shown]));
        rig.send(0x205, &[7, 0]);
        rig.send(0x205, &[15, 0]);
        assert_eq!(rig.drive.state(), State::SwitchedOn);
        rig.send(0x305, &[15, 0, 8]);
        assert_eq!(rig.drive.state(), State::OperationEnabled);
    }
}

#[test]
fn a_fault_that_does_not_go() {
    let mut rig = Rig::new(Settings { reset_needs_mend: true, reset_blocked_ms: 100, ..Settings::default() });
    rig.drive.fail(0x4310);
    rig.run(50);
    rig.drive.mend();
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::Fault);
    rig.run(60);
    // The level is not enough.
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::Fault);
    rig.word(0);
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.drive.fail(0x4310);
    rig.run(200);
    rig.word(0);
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::Fault);
    rig.drive.mend();
    rig.word(0);
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn a_fault_after_a_time() {
    let mut rig = Rig::new(Settings { fault_after: Some((100, 0x5441)), ..Settings::default() });
    rig.run(80);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.said.clear();
    rig.run(20);
    assert_eq!(rig.heard(0x85), [[0x41, 0x54, 0x01, 0, 0, 0, 0, 0]]);
    rig.word(0x80);
    rig.run(500);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn transitions_that_take_time_and_words_that_are_missed() {
    let mut rig = Rig::new(Settings { transition_ms: 20, enable_ms: 100, ..Settings::default() });
    rig.word(6);
    rig.run(19);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.run(2);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
    rig.word(15);
    rig.run(25);
    assert_eq!(rig.drive.state(), State::SwitchedOn);
    rig.run(100);
    assert_eq!(rig.drive.state(), State::SwitchedOn);
    rig.run(20);
    assert_eq!(rig.drive.state(), State::OperationEnabled);

    let mut rig = Rig::new(Settings { control_gap_us: 1000, ..Settings::default() });
    rig.word(6);
    rig.word(7);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
    rig.run(1);
    rig.word(7);
    assert_eq!(rig.drive.state(), State::SwitchedOn);

    let mut rig = Rig::new(Settings { switch_on_and_enable: false, ..Settings::default() });
    rig.word(6);
    rig.word(15);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
}

#[test]
fn a_short_pdo_can_be_worse() {
    let mut rig = Rig::new(Settings { short_pdo: ShortPdo::Fault, ..Settings::default() });
    rig.send(0, &[1, 5]);
    let out = rig.send(0x205, &[6]);
    assert!(out.contains(&Frame::new(0x85, &[0x10, 0x82, 0x11, 0, 0, 0, 0, 0])));
    assert_eq!(rig.drive.state(), State::Fault);
    let mut rig = Rig::new(Settings { short_pdo: ShortPdo::Ignored, ..Settings::default() });
    rig.send(0, &[1, 5]);
    assert!(rig.send(0x205, &[6]).is_empty());
}

#[test]
fn a_lost_sync_is_a_fault() {
    let mut rig = Rig::new(Settings { sync_lost_periods: Some(3), ..Settings::default() });
    rig.write(0x1006, 0, &2000_u32.to_le_bytes());
    rig.send(0, &[1, 5]);
    rig.enable(8);
    for _ in 0..5 {
        rig.run(2);
        rig.sync();
    }
    rig.run(6);
    assert_eq!(rig.drive.state(), State::OperationEnabled);
    rig.said.clear();
    rig.run(2);
    assert_eq!(rig.heard(0x85), [[0x00, 0x87, 0x21, 0, 0, 0, 0, 0]]);
}

#[test]
fn cyclic_bits() {
    let settings = Settings {
        never_follows: true,
        cyclic_bit_10: CyclicBit::Toggle,
        sync_warmup: 3,
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    rig.write(0x60FF, 0, &1000_i32.to_le_bytes());
    rig.send(0, &[1, 5]);
    rig.enable(9);
    let mut seen = Vec::new();
    for _ in 0..4 {
        rig.sync();
        seen.push(rig.status() & 0x1400);
        rig.run(1);
    }
    assert_eq!(seen, [0x0400, 0, 0x0400, 0]);
    // The axis stood until the third SYNC.
    assert_eq!(rig.drive.velocity(), 1000);
    assert_eq!(rig.drive.position(), 2);
}

#[test]
fn local_control_lets_little_through() {
    let mut rig = Rig::plain();
    rig.enable(8);
    rig.drive.settings_mut().remote_obeys = false;
    rig.drive.settings_mut().bits_never = 0x0200;
    rig.word(6);
    assert_eq!(rig.status() & 0x026F, 0x27);
    rig.word(2);
    rig.run(2);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.word(6);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn heartbeat_or_guarding_but_not_both() {
    let mut rig = Rig::new(Settings { heartbeat_or_guarding: true, ..Settings::default() });
    assert_eq!(rig.write(0x1017, 0, &[100, 0]), 0);
    assert_eq!(rig.write(0x100C, 0, &[100, 0]), 0x0604_0043);
    assert_eq!(rig.write(0x1017, 0, &[0, 0]), 0);
    assert_eq!(rig.write(0x100C, 0, &[100, 0]), 0);
    assert_eq!(rig.write(0x100D, 0, &[3]), 0);
    assert_eq!(rig.write(0x1017, 0, &[100, 0]), 0x0604_0043);
}

#[test]
fn another_axis_of_a_device() {
    let mut rig = Rig::new(Settings { axis_offset: 0x800, ..Settings::default() });
    assert_eq!(rig.read(0x6041, 0), Err(0x0602_0000));
    assert_eq!(rig.read(0x6841, 0), Ok(vec![0x50, 0x02]));
    assert_eq!(rig.read(0x1600, 1), Ok(vec![0x10, 0x00, 0x40, 0x68]));
    assert_eq!(rig.write(0x6840, 0, &[6, 0]), 0);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
    rig.send(0, &[1, 5]);
    rig.send(0x205, &[7, 0]);
    assert_eq!(rig.drive.state(), State::SwitchedOn);
}

#[test]
fn requests_without_an_answer() {
    let mut rig = Rig::new(Settings { sdo_drops_every: 3, ..Settings::default() });
    let said: Vec<usize> =
        (0..6).map(|_| rig.send(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]).len()).collect();
    assert_eq!(said, [1, 1, 0, 1, 1, 0]);
}
