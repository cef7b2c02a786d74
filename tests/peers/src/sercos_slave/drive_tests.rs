//! The drive alone: its parameters are set by hand.

use super::super::parameters;
use super::*;

struct Bench {
    drive: Drive,
    table: Table,
    settings: Settings,
    now: u64,
}

impl Bench {
    fn new(settings: Settings) -> Self {
        let table = parameters::table(&settings);
        Self { drive: Drive::new(&table, &settings), table, settings, now: 0 }
    }

    fn put(&mut self, block: u32, value: i64) {
        let width = self.table.get(Idn::s(block)).unwrap().width();
        self.table.set(Idn::s(block), &value.to_le_bytes()[..width]);
    }

    fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            self.now += 1_000_000;
            self.drive.tick(self.now, &mut self.table, &self.settings, true);
        }
    }

    fn status(&self) -> u16 {
        self.drive.status(&self.settings, 0)
    }
}

#[test]
fn the_states_come_in_their_order() {
    let settings =
        Settings { ready_ms: 5, mains_ms: 10, power_up_ms: 20, follow_ms: 30, ..Settings::default() };
    let mut b = Bench::new(settings);
    b.put(134, 0xE000);
    let mut seen = vec![b.status()];
    for _ in 0..80 {
        b.run(1);
        if seen.last() != Some(&b.status()) {
            seen.push(b.status());
        }
    }
    assert_eq!(seen, [0x0000, 0x4000, 0x8000, 0xC000, 0xC008]);
}

#[test]
fn without_mains_it_stays_at_01() {
    let mut b = Bench::new(Settings { mains: false, ..Settings::default() });
    b.put(134, 0xE000);
    b.run(500);
    assert_eq!((b.status(), b.drive.enabled()), (0x4000, false));
}

#[test]
fn a_velocity_is_reached_along_the_ramp() {
    let mut b = Bench::new(Settings::default());
    b.put(134, 0xE000);
    b.run(1);
    b.put(36, 30_000_000);
    b.run(50);
    // 500 rev/s^2 for 50 ms are 25 rev/s.
    assert!((b.drive.velocity() - 25.0).abs() < 0.6, "{}", b.drive.velocity());
    b.run(100);
    assert_eq!(b.table.signed(Idn::s(40)), 30_000_000);
    b.put(36, i64::from(i32::MAX));
    b.run(500);
    assert_eq!(b.table.signed(Idn::s(40)), 60_000_000);
}

#[test]
fn a_position_is_reached_and_its_polarity_turned() {
    let mut settings = Settings { selected_modes: [0x0B, 0, 0, 0], ..Settings::default() };
    settings.scaling.position_polarity = 0x0F;
    let mut b = Bench::new(settings);
    b.put(134, 0xE000);
    b.run(1);
    b.put(47, 3_600_000);
    b.run(1000);
    assert!((b.drive.position() + 1.0).abs() < 1e-4, "{}", b.drive.position());
    assert!((b.table.signed(Idn::s(51)) - 3_600_000).abs() < 400);
}

#[test]
fn a_modulo_axis_takes_the_short_way() {
    let mut settings = Settings { selected_modes: [3, 0, 0, 0], ..Settings::default() };
    settings.scaling.position_type = 0x82;
    let mut b = Bench::new(settings);
    b.put(134, 0xE000);
    b.run(1);
    b.put(47, 3_500_000);
    b.run(1000);
    assert!((b.drive.position() + 100_000.0 / 3_600_000.0).abs() < 1e-4);
    assert!((b.table.signed(Idn::s(51)) - 3_500_000).abs() < 400);
}

#[test]
fn a_torque_speeds_the_motor_up_and_friction_holds_it() {
    let mut b = Bench::new(Settings { selected_modes: [1, 0, 0, 0], ..Settings::default() });
    b.put(134, 0xE000);
    b.run(1);
    // 10 % of 2 Nm against 0.01 Nm for each revolution a second: 20 rev/s.
    b.put(80, 100);
    b.run(10_000);
    assert!((b.drive.velocity() - 20.0).abs() < 0.1, "{}", b.drive.velocity());
    assert_eq!(b.table.signed(Idn::s(84)), 100);
}

#[test]
fn bit_15_stops_before_the_torque_goes_and_bit_14_coasts() {
    let mut b = Bench::new(Settings { off_ms: 10, ..Settings::default() });
    b.put(134, 0xE000);
    b.run(1);
    b.put(36, 6_000_000);
    b.run(100);
    b.put(134, 0x6000);
    b.run(1);
    assert_eq!(b.status(), 0xC000);
    b.run(100);
    assert_eq!((b.status(), b.drive.velocity() == 0.0), (0x8000, true));
    b.put(134, 0xE000);
    b.run(100);
    b.put(134, 0xA000);
    b.run(2);
    assert_eq!(b.status(), 0x8000);
    assert!(b.drive.velocity() > 9.0);
}

#[test]
fn halt_is_acknowledged_at_standstill() {
    let mut b = Bench::new(Settings::default());
    b.put(134, 0xE000);
    b.put(36, 6_000_000);
    b.run(100);
    assert_eq!(b.status(), 0xC008);
    b.put(134, 0xC000);
    b.run(1);
    assert_eq!(b.status(), 0xC000);
    b.run(100);
    assert_eq!(b.status(), 0xC010);
    b.put(134, 0xE000);
    b.run(100);
    assert_eq!(b.table.signed(Idn::s(40)), 6_000_000);
}

#[test]
fn a_following_error_stops_the_drive_until_it_is_reset() {
    let settings = Settings { selected_modes: [3, 0, 0, 0], monitoring_window: 1000, ..Settings::default() };
    let mut b = Bench::new(settings);
    b.put(134, 0xE000);
    b.run(1);
    b.put(47, 36_000_000);
    b.run(100);
    assert_eq!((b.status(), b.drive.errors), (0xA000, C1D_DEVIATION));
    assert!(!b.drive.reset(C1D_DEVIATION));
    assert!(b.drive.reset(0));
    b.put(134, 0x6000);
    b.run(1);
    assert_eq!(b.status(), 0x8000);
}

#[test]
fn an_edge_may_be_needed_to_turn_on() {
    let settings = Settings { enable_needs_edge: true, ..Settings::default() };
    let mut b = Bench::new(settings);
    b.put(134, 0xE000);
    b.run(2);
    assert!(b.drive.enabled());
    b.drive.raise(1);
    b.run(10);
    assert!(b.drive.reset(0));
    b.run(10);
    assert!(!b.drive.enabled());
    b.put(134, 0x6000);
    b.run(1);
    b.put(134, 0xE000);
    b.run(2);
    assert!(b.drive.enabled());
}

#[test]
fn a_mode_without_definition_is_an_error() {
    let mut b = Bench::new(Settings { selected_modes: [2, 3, 0, 0], ..Settings::default() });
    b.put(134, 0xE000);
    b.run(2);
    b.put(134, 0xE100);
    b.run(2);
    assert_eq!(b.status(), 0xC108);
    b.put(134, 0xE200);
    b.run(2);
    assert_eq!((b.drive.no_mode, b.drive.errors), (true, C1D_COMMUNICATION));
}

#[test]
fn old_mode_bits_are_11_9_8() {
    let settings = Settings { old_mode_bits: true, ..Settings::default() };
    let mut b = Bench::new(settings);
    for (control, mode) in [(0xE100, 1), (0xE800, 4), (0xEB00, 7), (0xE400, 0)] {
        b.put(134, control);
        b.run(1);
        assert_eq!(b.status() >> 8 & 7, mode, "{control:x}");
    }
}

#[test]
fn a_blocked_shaft_does_not_turn() {
    let mut b = Bench::new(Settings { blocked: true, ..Settings::default() });
    b.put(134, 0xE000);
    b.put(36, 6_000_000);
    b.run(100);
    assert_eq!((b.table.signed(Idn::s(51)), b.table.signed(Idn::s(40))), (0, 0));
    assert!(b.table.signed(Idn::s(84)) > 1000);
}

#[test]
fn homing_finds_its_mark() {
    let mut b = Bench::new(Settings { start_position: 3.0, ..Settings::default() });
    assert!(!b.drive.home(&b.table));
    b.put(134, 0xE000);
    b.put(52, 1_800_000);
    b.run(2);
    assert!(b.drive.home(&b.table));
    b.run(1);
    assert_eq!((b.status() & 8, b.drive.homed()), (0, None));
    b.run(5000);
    assert_eq!(b.drive.homed(), Some(true));
    assert_eq!(b.table.signed(Idn::s(51)), 1_800_000);
    b.drive.end_homing();
    b.run(1);
    assert_eq!(b.status() & 8, 8);
}
