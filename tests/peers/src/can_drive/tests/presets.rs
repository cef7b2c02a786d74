//! The presets answer as the facts sheet says.

use super::Rig;
use crate::can_drive::{Settings, State};

/// Statuswords in "switch on disabled", "ready", "switched on" and "operation enabled".
fn ladder(settings: Settings) -> [u16; 4] {
    let mut rig = Rig::new(settings);
    rig.run(100);
    let mut seen = [rig.status(); 4];
    for (at, word) in [(1, 6), (2, 7), (3, 15)] {
        rig.run(2);
        rig.word(word);
        seen[at] = rig.status();
    }
    assert_eq!(rig.drive.state(), State::OperationEnabled);
    seen
}

/// 1000h, 1018:1, 1018:2 and 6502.
fn identity(settings: Settings) -> [Option<u32>; 4] {
    let mut rig = Rig::new(settings);
    let mut value = |index, sub| {
        let data = rig.read(index, sub).ok()?;
        Some(u32::from_le_bytes([data[0], data[1], data[2], data[3]]))
    };
    [value(0x1000, 0), value(0x1018, 1), value(0x1018, 2), value(0x6502, 0)]
}

#[test]
fn who_they_are() {
    assert_eq!(identity(Settings::epos_like()), [0x0002_0192, 0xFB, 0x6150_0000, 0x3A5].map(Some));
    assert_eq!(identity(Settings::oriental_like()), [0x0002_0192, 0x2BE, 0x13F7, 0x25].map(Some));
    assert_eq!(identity(Settings::faulhaber_like()), [0x0042_0192, 0x147, 0xC4E, 0x25].map(Some));
    assert_eq!(identity(Settings::faulhaber_cf_like()), [Some(0x0002_0192), Some(0x147), Some(0xC4E), None]);
    assert_eq!(identity(Settings::ipos_like())[3], Some(0x001F_0065));
    assert_eq!(identity(Settings::kollmorgen_rgm_like())[3], Some(0));
    assert_eq!(identity(Settings::eyou_like()), [0x0022_0811, 0x668, 0x1234, 0x3CD].map(Some));
    assert_eq!(identity(Settings::elmo_like()), [0x192, 0x9A, 0x30923, 0x3ED].map(Some));
    assert_eq!(identity(Settings::lexium_like())[3], Some(0xED));
}

#[test]
fn what_their_statuswords_look_like() {
    assert_eq!(ladder(Settings::epos_like()), [0x0140, 0x0121, 0x0123, 0x0537]);
    assert_eq!(ladder(Settings::zeroerr_like()), [0x12D0, 0x12B1, 0x12B3, 0x12B7]);
    assert_eq!(ladder(Settings::elmo_like()), [0x0250, 0x0231, 0x0233, 0x0637]);
    assert_eq!(ladder(Settings::akd_like())[0], 0x0250);
    assert_eq!(ladder(Settings::oriental_like())[1], 0x0331);
    assert_eq!(ladder(Settings::ipos_like())[1], 0x0231);
    assert_eq!(ladder(Settings::eyou_like())[1], 0x0231);
    assert_eq!(ladder(Settings::kollmorgen_rgm_like())[1], 0x0231);
    assert_eq!(ladder(Settings::faulhaber_cf_like())[1], 0x0231);
    assert_eq!(ladder(Settings::lexium_like())[1], 0x0231);
}

#[test]
fn their_pdos_at_delivery() {
    let cob = |settings, index| {
        let data = Rig::new(settings).read(index, 1).unwrap();
        u32::from_le_bytes([data[0], data[1], data[2], data[3]])
    };
    assert_eq!(cob(Settings::epos_like(), 0x1800), 0x4000_0185);
    assert_eq!(cob(Settings::epos_like(), 0x1801), 0xC000_0285);
    assert_eq!(cob(Settings::epos_like(), 0x1401), 0x8000_0305);
    assert_eq!(cob(Settings::oriental_like(), 0x1803), 0x4000_0485);
    assert_eq!(cob(Settings::ipos_like(), 0x1802), 0x8000_0385);
    assert_eq!(cob(Settings::kollmorgen_rgm_like(), 0x1400), 0x8000_0205);
    assert_eq!(cob(Settings::kollmorgen_rgm_like(), 0x1809), 0x8000_0000);
    let mut rig = Rig::new(Settings::kollmorgen_rgm_like());
    assert_eq!(rig.write(0x1600, 0, &[0]), 0x0601_0002);
    assert_eq!(rig.write(0x1400, 1, &[0x05, 0x02, 0, 0]), 0);
    let mut rig = Rig::new(Settings::ipos_like());
    assert_eq!(rig.read(0x1800, 3), Ok(vec![0x2C, 0x01]));
}

#[test]
fn faulhaber_cf_answers_requests_only() {
    let mut rig = Rig::new(Settings::faulhaber_cf_like());
    assert_eq!(rig.read(0x1403, 1), Err(0x0602_0000));
    assert_eq!(rig.read(0x1801, 2), Ok(vec![253]));
    assert_eq!(rig.read(0x1017, 0), Err(0x0602_0000));
    rig.send(0, &[1, 5]);
    rig.send(0x305, &[0xB4, 1, 2, 3, 4]);
    assert_eq!(rig.request(0x285)[0].data, [0xB4, 1, 2, 3, 4]);
}

#[test]
fn velocity_units() {
    // 1000 rpm is 1000 turns of 8192 counts in a minute.
    let mut rig = Rig::new(Settings::epos_like());
    rig.write(0x60FF, 0, &1000_i32.to_le_bytes());
    rig.enable(9);
    rig.run(100);
    assert_eq!(rig.drive.velocity(), 136_533);
    assert_eq!(rig.long(0x606C), 1000);
    // 16.16 counts per millisecond.
    let mut rig = Rig::new(Settings::ipos_like());
    rig.write(0x60FF, 0, &(10_i32 << 16).to_le_bytes());
    rig.enable(3);
    rig.run(500);
    assert_eq!(rig.drive.velocity(), 10_000);
    assert_eq!(rig.long(0x606C), 10 << 16);
}

#[test]
fn elmo_resets_a_fault_after_a_second() {
    let mut rig = Rig::new(Settings::elmo_like());
    rig.drive.fail(0x7300);
    rig.run(500);
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::Fault);
    rig.word(0);
    rig.run(500);
    rig.word(0x80);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}
