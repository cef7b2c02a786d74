//! Process data: types, timers, remapping, and the cyclic modes.

use super::Rig;
use crate::can::Frame;
use crate::can_drive::{Settings, State};

const RPDO1: u16 = 0x1400;
const TPDO1: u16 = 0x1800;

impl Rig {
    /// Remaps a PDO in the proper order: 0, or the first abort code.
    pub fn remap(&mut self, index: u16, base: u32, kind: u8, map: &[u32]) -> u32 {
        let cob = base + 5;
        let at = index + 0x200;
        let count = u8::try_from(map.len()).unwrap();
        let mut steps = vec![
            self.write(index, 1, &(cob | 0x8000_0000).to_le_bytes()),
            self.write(index, 2, &[kind]),
            self.write(at, 0, &[0]),
        ];
        for (sub, entry) in (1..).zip(map) {
            steps.push(self.write(at, sub, &entry.to_le_bytes()));
        }
        steps.push(self.write(at, 0, &[count]));
        steps.push(self.write(index, 1, &cob.to_le_bytes()));
        steps.into_iter().find(|code| *code != 0).unwrap_or(0)
    }

    fn disable_rest(&mut self) {
        for index in [0x1801, 0x1802, 0x1803] {
            let cob = self.read(index, 1).unwrap();
            self.write(index, 1, &[cob[0], cob[1], cob[2], cob[3] | 0x80]);
        }
    }

    /// A SYNC: the TPDOs right after it.
    pub fn sync(&mut self) -> Vec<Frame> {
        self.send(0x80, &[])
    }

    /// Ready for a cyclic mode with controlword and target in RPDO 1.
    fn cyclic(settings: Settings, mode: u8, target: u32, actual: u32) -> Self {
        let mut rig = Self::new(settings);
        assert_eq!(rig.remap(RPDO1, 0x200, 1, &[0x6040_0010, target]), 0);
        assert_eq!(rig.remap(TPDO1, 0x180, 1, &[0x6041_0010, actual]), 0);
        rig.disable_rest();
        assert_eq!(rig.write(0x6060, 0, &[mode]), 0);
        rig.send(0, &[1, 5]);
        rig
    }

    /// One cycle of 1 ms: RPDO 1, a millisecond, SYNC. Gives statusword and value.
    fn cycle(&mut self, word: u8, value: i32) -> (u16, i32) {
        let [a, b, c, d] = value.to_le_bytes();
        self.send(0x205, &[word, 0, a, b, c, d]);
        self.run(1);
        let out = self.sync();
        let data = &out.iter().find(|frame| frame.id == 0x185).unwrap().data;
        let actual = i32::from_le_bytes([data[2], data[3], data[4], data[5]]);
        (u16::from_le_bytes([data[0], data[1]]), actual)
    }
}

#[test]
fn event_pdos_go_out_at_start_and_at_a_change() {
    let mut rig = Rig::plain();
    let out = rig.send(0, &[1, 5]);
    assert_eq!(
        out,
        [
            Frame::new(0x185, &[0x50, 0x02]),
            Frame::new(0x285, &[0x50, 0x02, 0]),
            Frame::new(0x385, &[0x50, 0x02, 0, 0, 0, 0]),
            Frame::new(0x485, &[0x50, 0x02, 0, 0, 0, 0]),
        ]
    );
    rig.said.clear();
    rig.run(5);
    assert!(rig.said.is_empty());
    let out = rig.send(0x205, &[6, 0]);
    assert_eq!(out.len(), 4);
    assert_eq!(out[0], Frame::new(0x185, &[0x31, 0x02]));
    // Mode and controlword in RPDO 2.
    let out = rig.send(0x305, &[7, 0, 8]);
    assert_eq!(out[1], Frame::new(0x285, &[0x33, 0x02, 8]));
}

#[test]
fn no_pdo_outside_operational() {
    let mut rig = Rig::plain();
    assert!(rig.send(0x205, &[6, 0]).is_empty());
    assert!(rig.sync().is_empty());
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn inhibit_time_and_event_timer() {
    let mut rig = Rig::plain();
    rig.disable_rest();
    // The inhibit time cannot change while the PDO is valid.
    assert_eq!(rig.write(TPDO1, 3, &[100, 0]), 0x0609_0030);
    rig.write(TPDO1, 1, &[0x85, 1, 0, 0x80]);
    assert_eq!(rig.write(TPDO1, 3, &[100, 0]), 0);
    assert_eq!(rig.write(TPDO1, 5, &[50, 0]), 0);
    rig.write(TPDO1, 1, &[0x85, 1, 0, 0]);
    rig.send(0, &[1, 5]);
    rig.said.clear();
    // 10 ms have not passed since the start.
    assert!(rig.send(0x205, &[6, 0]).is_empty());
    rig.run(9);
    assert!(rig.said.is_empty());
    rig.run(1);
    assert_eq!(rig.heard(0x185), [[0x31, 0x02]]);
    rig.run(49);
    assert!(rig.said.is_empty());
    rig.run(1);
    assert_eq!(rig.heard(0x185), [[0x31, 0x02]]);
}

#[test]
fn every_third_sync() {
    let mut rig = Rig::plain();
    assert_eq!(rig.remap(TPDO1, 0x180, 3, &[0x6041_0010, 0x6061_0008]), 0);
    rig.disable_rest();
    rig.send(0, &[1, 5]);
    let said: Vec<usize> = (0..7).map(|_| rig.sync().len()).collect();
    assert_eq!(said, [0, 0, 1, 0, 0, 1, 0]);
    // Type 0: only after a change.
    assert_eq!(rig.write(TPDO1, 2, &[0]), 0);
    assert_eq!(rig.sync().len(), 1);
    assert_eq!(rig.sync().len(), 0);
    rig.send(0x205, &[6, 0]);
    assert_eq!(rig.sync(), [Frame::new(0x185, &[0x31, 0x02, 0])]);
}

#[test]
fn remote_requests() {
    let mut rig = Rig::plain();
    rig.disable_rest();
    assert_eq!(rig.write(TPDO1, 2, &[252]), 0);
    rig.send(0, &[1, 5]);
    assert!(rig.request(0x185).is_empty());
    assert!(rig.sync().is_empty());
    rig.send(0x205, &[6, 0]);
    assert_eq!(rig.request(0x185), [Frame::new(0x185, &[0x50, 0x02])]);
    assert_eq!(rig.write(TPDO1, 2, &[253]), 0);
    assert_eq!(rig.request(0x185), [Frame::new(0x185, &[0x31, 0x02])]);
    // Bit 30: no requests.
    assert_eq!(rig.write(TPDO1, 1, &[0x85, 1, 0, 0x40]), 0);
    assert!(rig.request(0x185).is_empty());
}

#[test]
fn a_synchronous_rpdo_waits_for_the_sync() {
    let mut rig = Rig::plain();
    assert_eq!(rig.write(RPDO1, 2, &[1]), 0);
    rig.send(0, &[1, 5]);
    rig.send(0x205, &[6, 0]);
    rig.run(5);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    rig.sync();
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
}

#[test]
fn a_mapping_changes_only_in_its_order() {
    let mut rig = Rig::plain();
    assert_eq!(rig.write(0x1600, 0, &[0]), 0x0601_0000);
    assert_eq!(rig.write(RPDO1, 1, &[0x06, 2, 0, 0]), 0x0609_0030);
    assert_eq!(rig.write(RPDO1, 1, &[0x05, 2, 0, 0x80]), 0);
    assert_eq!(rig.write(0x1600, 1, &0x607A_0020_u32.to_le_bytes()), 0x0601_0000);
    assert_eq!(rig.write(0x1600, 0, &[0]), 0);
    assert_eq!(rig.write(0x1600, 1, &0x6041_0010_u32.to_le_bytes()), 0x0604_0041);
    assert_eq!(rig.write(0x1600, 1, &0x5000_0010_u32.to_le_bytes()), 0x0602_0000);
    assert_eq!(rig.write(0x1600, 1, &0x607A_0110_u32.to_le_bytes()), 0x0609_0011);
    assert_eq!(rig.write(0x1600, 1, &0x607A_0010_u32.to_le_bytes()), 0x0604_0041);
    for (sub, entry) in (1..).zip([0x607A_0020_u32, 0x60FF_0020, 0x6040_0010]) {
        assert_eq!(rig.write(0x1600, sub, &entry.to_le_bytes()), 0);
    }
    assert_eq!(rig.write(0x1600, 0, &[3]), 0x0604_0042);
    assert_eq!(rig.write(0x1600, 0, &[9]), 0x0609_0030);
    assert_eq!(rig.write(0x1600, 0, &[2]), 0);
    assert_eq!(rig.write(RPDO1, 1, &[0x05, 6, 0, 0]), 0x0609_0030);
    assert_eq!(rig.write(RPDO1, 1, &[0x05, 2, 0, 0x20]), 0x0609_0030);
    assert_eq!(rig.write(RPDO1, 1, &[0x05, 2, 0, 0]), 0);
    assert_eq!(rig.write(RPDO1, 2, &[241]), 0x0609_0030);
}

#[test]
fn a_dummy_fills_an_rpdo() {
    let mut rig = Rig::plain();
    assert_eq!(rig.remap(RPDO1, 0x200, 255, &[0x0007_0020, 0x6040_0010]), 0);
    rig.send(0, &[1, 5]);
    rig.send(0x205, &[1, 2, 3, 4, 6, 0]);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
}

#[test]
fn a_short_pdo_is_not_used_and_told() {
    let mut rig = Rig::plain();
    rig.send(0, &[1, 5]);
    assert_eq!(rig.send(0x205, &[6]), [Frame::new(0x85, &[0x10, 0x82, 0x11, 0, 0, 0, 0, 0])]);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    // A long one is.
    rig.send(0x205, &[6, 0, 9]);
    assert_eq!(rig.drive.state(), State::ReadyToSwitchOn);
}

#[test]
fn an_rpdo_that_stays_away_is_told() {
    let mut rig = Rig::plain();
    assert_eq!(rig.write(RPDO1, 5, &[20, 0]), 0);
    rig.send(0, &[1, 5]);
    rig.send(0x205, &[6, 0]);
    rig.said.clear();
    rig.run(30);
    assert_eq!(rig.heard(0x85), [[0x50, 0x82, 0x11, 0, 0, 0, 0, 0]]);
}

#[test]
fn csp_follows_its_targets() {
    let mut rig = Rig::cyclic(Settings::default(), 8, 0x607A_0020, 0x6064_0020);
    for word in [6, 7, 15] {
        rig.cycle(word, 0);
        rig.cycle(word, 0);
    }
    assert_eq!(rig.drive.state(), State::OperationEnabled);
    let mut target = 0;
    for _ in 0..200 {
        target += 20;
        rig.cycle(15, target);
    }
    let (status, actual) = rig.cycle(15, target + 20);
    assert_eq!(status & 0x1000, 0x1000);
    assert_eq!(rig.drive.velocity(), 20_000);
    // The target before this one, and the lag of the controller: 5 % of 20000 / 200 counts.
    assert_eq!(actual, target - 5);
    assert_eq!(rig.long(0x60F4), 5);
    for _ in 0..100 {
        rig.cycle(15, target);
    }
    assert_eq!(rig.drive.position(), i64::from(target));
    assert_eq!(rig.drive.velocity(), 0);
}

#[test]
fn csp_holds_its_place_until_a_target_comes_and_faults_at_a_jump() {
    let settings = Settings { start_position: 77_000, ..Settings::default() };
    let mut rig = Rig::cyclic(settings, 8, 0x607A_0020, 0x6064_0020);
    for word in [6, 7, 15] {
        rig.cycle(word, 77_000);
    }
    for _ in 0..20 {
        rig.run(1);
        rig.sync();
    }
    assert_eq!(rig.drive.position(), 77_000);
    rig.cycle(15, 0);
    rig.run(10);
    assert!(matches!(rig.drive.state(), State::FaultReaction | State::Fault));
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0x11, 0x86]));
}

#[test]
fn csv_and_cst_take_their_targets() {
    let mut rig = Rig::cyclic(Settings::default(), 9, 0x60FF_0020, 0x606C_0020);
    for word in [6, 7, 15] {
        rig.cycle(word, 0);
    }
    for _ in 0..10 {
        rig.cycle(15, -30_000);
    }
    assert_eq!(rig.cycle(15, -30_000).1, -30_000);
    assert_eq!(rig.drive.velocity(), -30_000);
    assert_eq!(rig.write(0x60B1, 0, &1000_i32.to_le_bytes()), 0);
    rig.run(5);
    assert_eq!(rig.drive.velocity(), -29_000);
    assert_eq!(rig.write(0x6071, 0, &200_i16.to_le_bytes()), 0);
    assert_eq!(rig.write(0x60B2, 0, &(-50_i16).to_le_bytes()), 0);
    assert_eq!(rig.write(0x6060, 0, &[10]), 0);
    rig.run(3);
    assert_eq!(rig.drive.torque(), 150);
    assert_eq!(rig.read(0x6077, 0), Ok(vec![150, 0]));
    // The torque limit.
    assert_eq!(rig.write(0x6072, 0, &[100, 0]), 0);
    rig.run(2);
    assert_eq!(rig.drive.torque(), 100);
}

#[test]
fn the_start_value_waits_for_its_sync() {
    let mut rig = Rig::plain();
    rig.disable_rest();
    rig.write(0x1019, 0, &[4]);
    rig.write(TPDO1, 1, &[0x85, 1, 0, 0x80]);
    assert_eq!(rig.write(TPDO1, 6, &[3]), 0);
    assert_eq!(rig.write(TPDO1, 2, &[2]), 0);
    rig.write(TPDO1, 1, &[0x85, 1, 0, 0]);
    rig.send(0, &[1, 5]);
    let said: Vec<usize> = [1, 2, 3, 4, 1, 2].iter().map(|count| rig.send(0x80, &[*count]).len()).collect();
    assert_eq!(said, [0, 0, 1, 0, 1, 0]);
    assert_eq!(rig.send(0x80, &[]), [Frame::new(0x85, &[0x40, 0x82, 0x11, 0, 0, 0, 0, 0])]);
}
