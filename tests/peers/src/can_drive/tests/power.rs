//! The power state machine and the modes.

use super::Rig;
use crate::can_drive::{Settings, State};

#[test]
fn the_way_up_and_down_step_by_step() {
    let mut rig = Rig::plain();
    assert_eq!(rig.status(), 0x0250);
    rig.word(0x0F);
    assert_eq!(rig.status(), 0x0250);
    rig.word(0x06);
    assert_eq!(rig.status(), 0x0231);
    rig.word(0x07);
    assert_eq!(rig.status(), 0x0233);
    rig.word(0x0F);
    assert_eq!(rig.status() & 0x6F, 0x27);
    assert!(rig.drive.enabled());
    rig.word(0x07);
    rig.run(2);
    assert_eq!(rig.status(), 0x0233);
    rig.word(0x0F);
    rig.word(0x06);
    assert_eq!(rig.status(), 0x0231);
    // Enable in "ready" goes through "switched on".
    rig.word(0x0F);
    assert_eq!(rig.status() & 0x6F, 0x27);
    rig.word(0x00);
    assert_eq!(rig.status(), 0x0250);
}

#[test]
fn quick_stop_ends_in_switch_on_disabled_or_stays() {
    let mut rig = Rig::plain();
    rig.write(0x60FF, 0, &100_000_i32.to_le_bytes());
    rig.enable(3);
    rig.run(400);
    assert_eq!(rig.drive.velocity(), 100_000);
    rig.word(0x02);
    assert_eq!(rig.status() & 0x6F, 0x07);
    // 6085 is 5 million counts/s^2: 20 ms.
    rig.run(15);
    assert_eq!(rig.drive.state(), State::QuickStopActive);
    assert_eq!(rig.drive.velocity(), 25_000);
    rig.run(10);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
    assert_eq!(rig.drive.velocity(), 0);

    assert_eq!(rig.write(0x605A, 0, &[6, 0]), 0);
    rig.enable(3);
    rig.run(400);
    rig.word(0x02);
    rig.run(100);
    assert_eq!(rig.status() & 0x6F, 0x07);
    assert_eq!(rig.drive.velocity(), 0);
    rig.word(0x0F);
    assert_eq!(rig.drive.state(), State::OperationEnabled);
}

#[test]
fn a_fault_of_a_moving_axis_stops_it_first() {
    let mut rig = Rig::plain();
    rig.write(0x60FF, 0, &100_000_i32.to_le_bytes());
    rig.enable(3);
    rig.run(400);
    rig.drive.fail(0x7121);
    assert_eq!(rig.drive.state(), State::FaultReaction);
    assert_eq!(rig.status() & 0x4F, 0x0F);
    rig.run(30);
    assert_eq!(rig.drive.state(), State::Fault);
    // The controlword still says 000F; an edge of bit 7 resets.
    rig.word(0x8F);
    assert_eq!(rig.drive.state(), State::SwitchOnDisabled);
}

#[test]
fn pp_takes_a_set_point_at_the_edge_of_bit_4() {
    let mut rig = Rig::plain();
    rig.enable(1);
    rig.write(0x607A, 0, &3000_i32.to_le_bytes());
    rig.run(50);
    assert_eq!(rig.drive.position(), 0);
    assert_eq!(rig.status() & 0x1400, 0x0400);
    rig.word(0x1F);
    assert_eq!(rig.status() & 0x1400, 0x1000);
    rig.word(0x0F);
    assert_eq!(rig.status() & 0x1000, 0);
    rig.run(30);
    assert_eq!(rig.status() & 0x0400, 0);
    // 50000 counts/s and 500000 counts/s^2: no plateau, 2 * sqrt(3000 / 500000) s = 155 ms.
    rig.run(110);
    assert!(rig.drive.position() < 3000);
    rig.run(30);
    assert_eq!(rig.drive.position(), 3000);
    assert_eq!(rig.long(0x6064), 3000);
    assert_eq!(rig.status() & 0x0400, 0x0400);
    // Relative, and one set-point waiting.
    rig.write(0x607A, 0, &(-500_i32).to_le_bytes());
    rig.word(0x5F);
    rig.word(0x4F);
    rig.word(0x5F);
    rig.run(400);
    assert_eq!(rig.drive.position(), 2000);
}

#[test]
fn halt_stops_a_profile_and_lets_it_go_on() {
    let mut rig = Rig::plain();
    rig.enable(1);
    rig.write(0x607A, 0, &50_000_i32.to_le_bytes());
    rig.word(0x1F);
    rig.run(200);
    assert!(rig.drive.velocity() > 40_000);
    rig.word(0x11F);
    rig.run(200);
    assert_eq!(rig.drive.velocity(), 0);
    assert_eq!(rig.status() & 0x0400, 0x0400);
    let stood = rig.drive.position();
    assert!(stood < 20_000);
    rig.word(0x1F);
    rig.run(2000);
    assert_eq!(rig.drive.position(), 50_000);
}

#[test]
fn homing_gives_the_place_a_number() {
    let mut rig = Rig::new(Settings { start_position: 1234, ..Settings::default() });
    rig.write(0x607C, 0, &100_i32.to_le_bytes());
    rig.write(0x6098, 0, &[37]);
    rig.enable(6);
    assert_eq!(rig.status() & 0x3400, 0x0400);
    rig.word(0x1F);
    rig.run(3);
    assert_eq!(rig.long(0x6064), 100);
    assert_eq!(rig.status() & 0x3400, 0x1400);
    // To the switch, 5000 counts of the encoder: now it is at 3866.
    rig.word(0x0F);
    rig.write(0x6098, 0, &[17]);
    rig.word(0x1F);
    rig.run(20);
    assert_eq!(rig.status() & 0x3400, 0);
    rig.run(600);
    assert_eq!(rig.long(0x6064), 100);
    assert_eq!(rig.status() & 0x3400, 0x1400);
    assert_eq!(rig.write(0x6098, 0, &[38]), 0x0609_0030);
}

#[test]
fn torque_accelerates_and_friction_holds_against_it() {
    let mut rig = Rig::plain();
    rig.write(0x6071, 0, &50_i16.to_le_bytes());
    rig.enable(4);
    rig.run(100);
    assert_eq!(rig.read(0x6077, 0), Ok(vec![50, 0]));
    assert!(rig.drive.velocity() > 20_000);
    rig.run(5000);
    // 100 thousandths hold full speed, 50 hold half of it.
    assert!((490_000..=510_000).contains(&rig.drive.velocity()), "{}", rig.drive.velocity());
    rig.drive.set_load(100);
    rig.run(3000);
    assert!(rig.drive.velocity() < 0);
}

#[test]
fn a_following_error_is_a_fault() {
    let mut rig = Rig::plain();
    rig.enable(1);
    rig.write(0x6065, 0, &100_u32.to_le_bytes());
    rig.write(0x6066, 0, &[5, 0]);
    rig.drive.set_blocked(true);
    rig.write(0x607A, 0, &5000_i32.to_le_bytes());
    rig.word(0x1F);
    rig.run(22);
    assert_eq!(rig.drive.state(), State::OperationEnabled);
    assert!(rig.long(0x60F4) > 100);
    assert_eq!(rig.status() & 0x2000, 0x2000);
    rig.run(10);
    assert_eq!(rig.drive.state(), State::Fault);
    assert_eq!(rig.read(0x603F, 0), Ok(vec![0x11, 0x86]));
}
