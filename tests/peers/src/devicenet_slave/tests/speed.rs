//! The AC drive.

use super::*;

#[test]
fn basic_speed_control_runs_forward() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(0);
    assert_eq!(bus.slave.state(), 3);
    assert_eq!(bus.poll(&[0, 0, 0, 0]), [0, 0, 0, 0]);
    // 1500 RPM, forward: with a ramp of 300 ms to 3000 RPM it takes 150 ms.
    assert_eq!(bus.poll(&[0x01, 0, 0xDC, 0x05]), [0x04, 0, 0, 0]);
    assert_eq!(bus.slave.state(), 4);
    bus.wait(75);
    let half = bus.poll(&[0x01, 0, 0xDC, 0x05]);
    let rpm = i16::from_le_bytes([half[2], half[3]]);
    assert!((740..=770).contains(&rpm), "{rpm}");
    bus.wait(80);
    assert_eq!(bus.poll(&[0x01, 0, 0xDC, 0x05]), [0x04, 0, 0xDC, 0x05]);
    assert!(bus.slave.position() > 1.8);
    assert_eq!(bus.poll(&[0x00, 0, 0xDC, 0x05])[0], 0x04);
    assert_eq!(bus.slave.state(), 5);
    bus.wait(160);
    assert_eq!(bus.slave.state(), 3);
    assert_eq!(bus.poll(&[0x00, 0, 0xDC, 0x05]), [0, 0, 0, 0]);
}

fn extended() -> Settings {
    let mut settings = Settings::speed();
    settings.consumed_assembly = 21;
    settings.produced_assembly = 71;
    settings
}

#[test]
fn extended_speed_control_runs_backwards() {
    let mut bus = Bus::new(extended());
    bus.connect(0);
    assert_eq!(bus.poll(&[0x60, 0, 0, 0]), [0x70, 3, 0, 0]);
    assert_eq!(bus.poll(&[0x62, 0, 0x2C, 0x01])[..2], [0x78, 4]);
    bus.wait(100);
    assert_eq!(bus.poll(&[0x62, 0, 0x2C, 0x01]), [0xF8, 4, 0xD4, 0xFE]);
    assert_eq!(bus.slave.velocity(), -300.0);
    assert_eq!(bus.poll(&[0x61, 0, 0x2C, 0x01])[0], 0x74);
    bus.wait(100);
    assert_eq!(bus.slave.velocity(), 300.0);
}

#[test]
fn without_net_bits_it_does_not_obey() {
    let mut bus = Bus::new(extended());
    bus.connect(0);
    assert_eq!(bus.poll(&[0x01, 0, 0x2C, 0x01]), [0x10, 3, 0, 0]);
    // The run bit alone does not start it when network control comes later: it wants an edge.
    assert_eq!(bus.poll(&[0x61, 0, 0x2C, 0x01]), [0x70, 3, 0, 0]);
    bus.poll(&[0x60, 0, 0x2C, 0x01]);
    assert_eq!(bus.poll(&[0x61, 0, 0x2C, 0x01])[1], 4);
    bus.wait(100);
    // Network control is taken away: it stops.
    bus.poll(&[0x01, 0, 0x2C, 0x01]);
    bus.wait(100);
    assert_eq!(bus.slave.state(), 3);
}

#[test]
fn both_run_bits_change_nothing() {
    let mut bus = Bus::new(extended());
    bus.connect(0);
    bus.poll(&[0x60, 0, 0x2C, 0x01]);
    assert_eq!(bus.poll(&[0x63, 0, 0x2C, 0x01])[1], 3);
    assert_eq!(bus.poll(&[0x62, 0, 0x2C, 0x01])[1], 4);
    bus.wait(50);
    assert_eq!(bus.slave.velocity(), -300.0);
}

#[test]
fn the_master_chooses_the_assemblies() {
    let mut bus = Bus::new(Settings::speed());
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x03, MASTER]).data, [MASTER, 0xCB, 0]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 14, 0x20, 4, 0x24, 71, 0x30, 3]), [0x90]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 16, 0x20, 4, 0x24, 21, 0x30, 3]), [0x90]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 16, 0x20, 4, 0x24, 22, 0x30, 3]), [0x94, 0x09, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 5, 2, 9, 0, 0]), [0x90, 0, 0]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 16, 0x20, 4, 0x24, 20, 0x30, 3]), [0x94, 0x0C, 0xFF]);
    assert_eq!(bus.poll(&[0x60, 0, 0, 0]), [0x70, 3, 0, 0]);
    let sets: Vec<u16> = bus.slave.sets().iter().map(|set| set.attribute).collect();
    assert_eq!(sets, [14, 16, 9]);
}

#[test]
fn a_fault_stops_it_and_waits_for_its_reset() {
    let mut bus = Bus::new(extended());
    bus.connect(0);
    bus.poll(&[0x60, 0, 0x2C, 0x01]);
    bus.poll(&[0x61, 0, 0x2C, 0x01]);
    bus.wait(100);
    bus.slave.fail(0x2310);
    assert_eq!(bus.poll(&[0x61, 0, 0x2C, 0x01])[..2], [0x65, 6]);
    bus.wait(100);
    assert_eq!(bus.poll(&[0x61, 0, 0x2C, 0x01]), [0x61, 7, 0, 0]);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 13]), [0x8E, 0x10, 0x23]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 5]), [0x8E, 0x01, 0x04]);
    assert_eq!(bus.poll(&[0x64, 0, 0, 0])[1], 7);
    bus.slave.mend();
    assert_eq!(bus.poll(&[0x60, 0, 0, 0])[1], 7);
    assert_eq!(bus.poll(&[0x64, 0, 0, 0])[1], 2);
    bus.wait(1);
    assert_eq!(bus.poll(&[0x60, 0, 0, 0]), [0x70, 3, 0, 0]);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 13]), [0x8E, 0, 0]);
}

#[test]
fn the_control_supervisor_can_be_used_alone() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(0);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 6]), [0x8E, 3]);
    assert_eq!(bus.ask(&[0x10, 0x2A, 1, 8, 0x64, 0]), [0x90]);
    assert_eq!(bus.ask(&[0x10, 0x29, 1, 3, 1]), [0x90]);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 6]), [0x8E, 4]);
    bus.wait(20);
    assert_eq!(bus.ask(&[0x0E, 0x2A, 1, 7]), [0x8E, 0x64, 0]);
    assert_eq!(bus.ask(&[0x0E, 0x2A, 1, 3]), [0x8E, 1]);
    assert_eq!(bus.ask(&[0x10, 0x29, 1, 3, 2]), [0x94, 0x09, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 0x29, 1, 6, 2]), [0x94, 0x0E, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 0x2A, 1, 18, 2]), [0x94, 0x13, 0xFF]);
    assert_eq!(bus.ask(&[0x0E, 0x28, 1, 12]), [0x8E, 4, 0]);
}

#[test]
fn a_lost_master_is_a_fault() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(10);
    bus.poll(&[0, 0, 0, 0]);
    bus.poll(&[1, 0, 0x64, 0]);
    bus.wait(100);
    assert_eq!(bus.slave.state(), 7);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 13]), [0x8E, 0x00, 0x75]);
}

#[test]
fn a_poll_of_another_length_is_not_taken() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(0);
    assert_eq!(bus.say(0x42D, &[1, 0, 0]), []);
    assert_eq!(bus.say(0x42D, &[1, 0, 0, 0, 0]), []);
    assert_eq!(bus.slave.state(), 3);
    assert_eq!(bus.poll(&[]), [0, 0, 0, 0]);
}

#[test]
fn the_speed_scale_counts() {
    let mut settings = Settings::speed();
    settings.speed_scale = 2;
    let mut bus = Bus::new(settings);
    bus.connect(0);
    bus.poll(&[0, 0, 0, 0]);
    bus.poll(&[1, 0, 0x90, 0x01]);
    bus.wait(50);
    assert_eq!(bus.slave.velocity(), 100.0);
    assert_eq!(bus.poll(&[1, 0, 0x90, 0x01]), [4, 0, 0x90, 0x01]);
}
