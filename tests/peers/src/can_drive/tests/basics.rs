//! NMT, error control, emergencies and the SDO server.

use super::Rig;
use crate::can::{Frame, Station};
use crate::can_drive::settings::Block;
use crate::can_drive::{CanDrive, NmtState, Settings, State};

#[test]
fn boot_up_comes_after_its_time_and_only_once() {
    let mut drive = CanDrive::new(Settings { boot_ms: 30, ..Settings::default() });
    let mut out = Vec::new();
    for now in 0..30 {
        drive.tick(now * 1000, &mut out);
        drive.hear(now * 1000, &Frame::new(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), &mut out);
    }
    assert!(out.is_empty());
    assert_eq!(drive.boots(), 0);
    for now in 30..60 {
        drive.tick(now * 1000, &mut out);
    }
    assert_eq!(out, [Frame::new(0x705, &[0])]);
    assert_eq!(drive.nmt_state(), NmtState::PreOperational);
    assert_eq!(drive.boots(), 1);
}

#[test]
fn expedited_uploads_tell_their_size() {
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo([0x40, 0x00, 0x10, 0, 0, 0, 0, 0]), [0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]);
    assert_eq!(rig.sdo([0x40, 0x18, 0x10, 0, 0, 0, 0, 0]), [0x4F, 0x18, 0x10, 0, 4, 0, 0, 0]);
    assert_eq!(rig.sdo([0x40, 0x41, 0x60, 0, 0, 0, 0, 0]), [0x4B, 0x41, 0x60, 0, 0x50, 0x02, 0, 0]);
    // 6502: pp pv tq hm csp csv cst.
    assert_eq!(rig.read(0x6502, 0), Ok(vec![0xAD, 0x03, 0, 0]));
}

#[test]
fn uploads_without_a_size_say_so() {
    let mut rig = Rig::new(Settings { upload_without_size: true, ..Settings::default() });
    assert_eq!(rig.sdo([0x40, 0x17, 0x10, 0, 0, 0, 0, 0]), [0x42, 0x17, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]), [0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
}

#[test]
fn aborts_say_what_is_wrong() {
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo([0x40, 0x00, 0x50, 0, 0, 0, 0, 0]), [0x80, 0x00, 0x50, 0, 0x00, 0x00, 0x02, 0x06]);
    assert_eq!(rig.read(0x1018, 9), Err(0x0609_0011));
    assert_eq!(rig.write(0x1000, 0, &[0, 0, 0, 0]), 0x0601_0002);
    assert_eq!(rig.write(0x6041, 0, &[0, 0]), 0x0601_0002);
    assert_eq!(rig.write(0x6040, 0, &[0, 0, 0, 0]), 0x0607_0010);
    assert_eq!(rig.write(0x6060, 0, &[2]), 0x0609_0030);
    assert_eq!(rig.read(0x1003, 1), Err(0x0800_0024));
    assert_eq!(rig.write(0x1010, 1, &[1, 2, 3, 4]), 0x0800_0020);
    assert_eq!(rig.sdo([0xE0, 0x18, 0x10, 0, 0, 0, 0, 0]), [0x80, 0x18, 0x10, 0, 0x01, 0x00, 0x04, 0x05]);
    assert_eq!(rig.drive.refused().len(), 9);
    assert_eq!(rig.drive.refused()[0].code, 0x0602_0000);
    assert!(rig.drive.writes().is_empty());
}

#[test]
fn an_expedited_download_without_size_takes_what_the_object_needs() {
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo([0x22, 0x17, 0x10, 0, 0xE8, 0x03, 0x77, 0x77]), [0x60, 0x17, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.read(0x1017, 0), Ok(vec![0xE8, 0x03]));
    assert_eq!(rig.drive.writes()[0].data, [0xE8, 0x03]);
    assert_eq!(rig.drive.writes()[0].index, 0x1017);
}

#[test]
fn a_text_comes_in_segments() {
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]), [0x41, 0x08, 0x10, 0, 11, 0, 0, 0]);
    assert_eq!(rig.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), *b"\x00Plain d");
    assert_eq!(rig.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]), *b"\x17rive\0\0\0");
    assert_eq!(rig.sdo([0x60, 0, 0, 0, 0, 0, 0, 0])[..1], [0x80]);
}

#[test]
fn a_toggle_that_stays_aborts() {
    let mut rig = Rig::plain();
    rig.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    rig.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x80, 0x08, 0x10, 0, 0, 0, 0x03, 0x05]);
}

#[test]
fn a_download_in_segments_arrives() {
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo([0x21, 0x7A, 0x60, 0, 4, 0, 0, 0]), [0x60, 0x7A, 0x60, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0x07, 0x10, 0x27, 0, 0, 0, 0, 0]), [0x20, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.long(0x607A), 10_000);
    // Two segments are more than four bytes.
    assert_eq!(rig.sdo([0x20, 0x7A, 0x60, 0, 0, 0, 0, 0])[0], 0x60);
    assert_eq!(rig.sdo([0x00, 1, 2, 3, 4, 5, 6, 7]), [0x20, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0x1D, 8, 0, 0, 0, 0, 0, 0]), [0x80, 0x7A, 0x60, 0, 0x10, 0x00, 0x07, 0x06]);
    // The size is checked at once.
    assert_eq!(rig.sdo([0x21, 0x7A, 0x60, 0, 5, 0, 0, 0]), [0x80, 0x7A, 0x60, 0, 0x10, 0x00, 0x07, 0x06]);
}

#[test]
fn blocks_are_refused_or_work() {
    let upload = [0xA4, 0x08, 0x10, 0, 8, 0, 0, 0];
    let mut rig = Rig::plain();
    assert_eq!(rig.sdo(upload), [0x80, 0x08, 0x10, 0, 0x01, 0x00, 0x04, 0x05]);

    let mut rig = Rig::new(Settings { block: Block::PlainAnswer, ..Settings::default() });
    assert_eq!(rig.sdo(upload), [0x41, 0x08, 0x10, 0, 11, 0, 0, 0]);

    let mut rig = Rig::new(Settings { block: Block::Works, name: "123456789".into(), ..Settings::default() });
    assert_eq!(rig.sdo(upload), [0xC6, 0x08, 0x10, 0, 9, 0, 0, 0]);
    let out = rig.send(0x605, &[0xA3, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(out[0].data, *b"\x011234567");
    assert_eq!(out[1].data, *b"\x8289\0\0\0\0\0");
    assert_eq!(out.len(), 2);
    assert_eq!(rig.sdo([0xA2, 2, 8, 0, 0, 0, 0, 0]), [0xD5, 0xC3, 0x31, 0, 0, 0, 0, 0]);
    assert!(rig.send(0x605, &[0xA1, 0, 0, 0, 0, 0, 0, 0]).is_empty());
    assert_eq!(rig.read(0x1017, 0), Ok(vec![0, 0]));
}

#[test]
fn a_block_download_is_checked_by_its_crc() {
    let mut rig = Rig::new(Settings { block: Block::Works, ..Settings::default() });
    assert_eq!(rig.sdo([0xC6, 0x7A, 0x60, 0, 4, 0, 0, 0]), [0xA4, 0x7A, 0x60, 0, 16, 0, 0, 0]);
    assert_eq!(rig.sdo([0x81, 1, 0, 0, 0, 0, 0, 0]), [0xA2, 1, 16, 0, 0, 0, 0, 0]);
    // CRC of 01 00 00 00 is 1021h shifted through three zero bytes; a wrong one first.
    assert_eq!(rig.sdo([0xCD, 0, 0, 0, 0, 0, 0, 0]), [0x80, 0x7A, 0x60, 0, 0x04, 0x00, 0x04, 0x05]);
    rig.sdo([0xC2, 0x7A, 0x60, 0, 4, 0, 0, 0]);
    rig.sdo([0x81, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0xCD, 0, 0, 0, 0, 0, 0, 0]), [0xA1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.long(0x607A), 1);
}

#[test]
fn an_empty_text_is_an_empty_segment() {
    let mut rig = Rig::new(Settings { empty_text: true, ..Settings::default() });
    assert_eq!(rig.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]), [0x41, 0x08, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.sdo([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x0F, 0, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn a_slow_server_answers_later() {
    let mut rig = Rig::new(Settings { sdo_delay_ms: 10, ..Settings::default() });
    rig.said.clear();
    assert!(rig.send(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]).is_empty());
    rig.run(9);
    assert!(rig.heard(0x585).is_empty());
    rig.run(1);
    assert_eq!(rig.heard(0x585), [vec![0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]]);
}

#[test]
fn heartbeats_tell_the_state() {
    let mut rig = Rig::plain();
    rig.said.clear();
    assert_eq!(rig.write(0x1017, 0, &[10, 0]), 0);
    rig.run(25);
    assert_eq!(rig.heard(0x705), [vec![0x7F], vec![0x7F]]);
    rig.send(0, &[1, 5]);
    rig.run(10);
    assert_eq!(rig.heard(0x705), [vec![5]]);
    rig.send(0, &[2, 0]);
    rig.run(10);
    assert_eq!(rig.heard(0x705), [vec![4]]);
    assert!(rig.send(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]).is_empty());
    // Somebody else's command.
    rig.send(0, &[1, 6]);
    assert_eq!(rig.drive.nmt_state(), NmtState::Stopped);
}

#[test]
fn guarding_toggles_and_misses_the_master() {
    let mut rig = Rig::new(Settings { guarding_only: true, ..Settings::default() });
    assert_eq!(rig.read(0x1017, 0), Err(0x0602_0000));
    assert_eq!(rig.write(0x100C, 0, &[20, 0]), 0);
    assert_eq!(rig.write(0x100D, 0, &[2]), 0);
    assert_eq!(rig.request(0x705)[0].data, [0x7F]);
    assert_eq!(rig.request(0x705)[0].data, [0xFF]);
    rig.send(0, &[1, 5]);
    assert_eq!(rig.request(0x705)[0].data, [0x05]);
    rig.said.clear();
    rig.run(41);
    assert_eq!(rig.heard(0x85), [vec![0x30, 0x81, 0x11, 0, 0, 0, 0, 0]]);
    assert_eq!(rig.drive.nmt_state(), NmtState::PreOperational);
}

#[test]
fn a_lost_master_is_a_fault_of_an_enabled_drive() {
    let mut rig = Rig::plain();
    // Watches node 1 for 50 ms.
    assert_eq!(rig.write(0x1016, 1, &[50, 0, 1, 0]), 0);
    rig.send(0, &[1, 5]);
    rig.enable(8);
    rig.send(0x701, &[5]);
    rig.run(50);
    assert_eq!(rig.drive.state(), State::OperationEnabled);
    rig.run(3);
    assert_eq!(rig.drive.state(), State::Fault);
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0x30, 0x81]));
}

#[test]
fn a_fault_is_told_kept_and_reset() {
    let mut rig = Rig::plain();
    rig.said.clear();
    rig.drive.fail(0x2310);
    rig.run(2);
    assert_eq!(rig.heard(0x85), [vec![0x10, 0x23, 0x03, 0, 0, 0, 0, 0]]);
    assert_eq!(rig.status() & 0x4F, 0x08);
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0x10, 0x23]));
    assert_eq!(rig.read(0x1001, 0), Ok(vec![0x03]));
    assert_eq!(rig.read(0x1003, 0), Ok(vec![1]));
    assert_eq!(rig.read(0x1003, 1), Ok(vec![0x10, 0x23, 0, 0]));
    let out = rig.send(0x605, &[0x2B, 0x40, 0x60, 0, 0x80, 0, 0, 0]);
    assert!(out.contains(&Frame::new(0x85, &[0; 8])));
    assert_eq!(rig.status() & 0x4F, 0x40);
    assert_eq!(rig.read(0x1001, 0), Ok(vec![0]));
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0, 0]));
    assert_eq!(rig.write(0x1003, 0, &[0]), 0);
    assert_eq!(rig.read(0x1003, 1), Err(0x0800_0024));
}

#[test]
fn a_reset_forgets_what_was_not_stored() {
    let mut rig = Rig::plain();
    assert_eq!(rig.write(0x6081, 0, &[1, 0, 0, 0]), 0);
    assert_eq!(rig.write(0x1010, 1, b"save"), 0);
    assert_eq!(rig.write(0x6081, 0, &[2, 0, 0, 0]), 0);
    rig.said.clear();
    let out = rig.send(0, &[129, 5]);
    assert!(out.is_empty());
    rig.run(2);
    assert_eq!(rig.heard(0x705), [vec![0]]);
    assert_eq!(rig.long(0x6081), 1);
    assert_eq!(rig.write(0x1011, 1, b"load"), 0);
    rig.send(0, &[129, 0]);
    rig.run(2);
    assert_eq!(rig.long(0x6081), 50_000);
    assert_eq!(rig.drive.boots(), 3);
    rig.send(0, &[130, 5]);
    rig.run(2);
    assert_eq!(rig.drive.boots(), 4);
}

#[test]
fn nothing_makes_a_parser_panic() {
    for block in [Block::Refused, Block::Works, Block::PlainAnswer, Block::Silent] {
        let mut rig = Rig::new(Settings { block, ..Settings::default() });
        rig.send(0, &[1, 5]);
        let mut seed = 1_u32;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed.to_be_bytes()[0]
        };
        for round in 0..40_000_u64 {
            let ids =
                [0, 0x80, 0x85, 0x205, 0x305, 0x405, 0x505, 0x185, 0x605, 0x605, 0x605, 0x705, 0x701, 0x7E5];
            let id = ids[usize::from(next()) % ids.len()];
            let mut data: Vec<u8> = (0..next() % 10).map(|_| next()).collect();
            if id == 0x605 && next() % 2 == 0 {
                let indices: [u16; 11] =
                    [0x1003, 0x1400, 0x1600, 0x1802, 0x1A00, 0x1017, 0x6040, 0x6060, 0x60C2, 0x607A, 0x60FF];
                let [low, high] = indices[usize::from(next()) % indices.len()].to_le_bytes();
                data = vec![next() & 0xEF, low, high, next() % 3, next(), next(), next(), next()];
            }
            if id == 0 && next() % 4 != 0 {
                data = vec![1, 5];
            }
            let frame = Frame { id, remote: next() % 8 == 0, data };
            rig.drive.hear(rig.now + round * 300, &frame, &mut rig.said);
            rig.said.clear();
        }
        rig.drive.tick(u64::MAX / 2, &mut rig.said);
        assert!(rig.drive.boots() > 0);
    }
}
