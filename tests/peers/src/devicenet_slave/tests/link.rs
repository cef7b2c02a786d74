//! Duplicate MAC ID check, allocation, explicit messages, watchdogs.

use super::*;

#[test]
fn it_checks_its_mac_twice() {
    let mut bus = Bus { slave: DevicenetSlave::new(Settings::speed()), now_us: 0 };
    let out = bus.wait(2_000);
    let check = Frame::new(0x42F, &[0x00, 0x39, 0x05, 0xC4, 0xB2, 0xA1, 0x00]);
    assert_eq!(out, [check.clone(), check]);
    assert!(!bus.slave.on_line());
    assert_eq!(bus.say(0x42E, &[MASTER, 0x4B, 3, 1, 0x01, MASTER]), []);
    bus.wait(2);
    assert!(bus.slave.on_line());
}

#[test]
fn it_answers_the_check_of_another() {
    let mut bus = Bus::new(Settings::motion());
    let answer = bus.one(0x42F, &[0x00, 1, 0, 2, 0, 0, 0]);
    assert_eq!(answer, Frame::new(0x42F, &[0x80, 0x39, 0x05, 0xC3, 0xB2, 0xA1, 0x00]));
    assert_eq!(bus.say(0x42F, &[0x80, 1, 0, 2, 0, 0, 0]), []);
    assert_eq!(bus.say(0x417, &[0x00, 1, 0, 2, 0, 0, 0]), []);
}

#[test]
fn it_is_silent_after_a_conflict() {
    let mut bus = Bus { slave: DevicenetSlave::new(Settings::speed()), now_us: 0 };
    bus.wait(10);
    assert_eq!(bus.say(0x42F, &[0x80, 1, 0, 2, 0, 0, 0]), []);
    assert_eq!(bus.wait(3_000), []);
    assert!(!bus.slave.on_line());
}

#[test]
fn a_master_allocates_and_releases() {
    let mut bus = Bus::new(Settings::speed());
    let answer = bus.one(0x42E, &[0x41, 0x4B, 3, 1, 0x03, MASTER]);
    assert_eq!(answer, Frame::new(0x42B, &[0x41, 0xCB, 0x00]));
    assert_eq!(bus.slave.allocated(), Some((1, 3)));
    assert_eq!(bus.slave.connection_states(), (3, 1));
    assert_eq!(bus.ask(&[0x0E, 3, 1, 5]), [0x8E, 3, 1]);
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x02, MASTER]).data, [MASTER, 0x94, 0x0B, 0x02]);
    assert_eq!(bus.one(0x42E, &[2, 0x4B, 3, 1, 0x01, 2]).data, [2, 0x94, 0x0C, 0x01]);
    assert_eq!(bus.one(0x42E, &[2, 0x4C, 3, 1, 0x01]).data, [2, 0x94, 0x0C, 0x01]);
    assert_eq!(bus.ask(&[0x4C, 3, 1, 0x02]), [0xCC]);
    assert_eq!(bus.slave.allocated(), Some((1, 1)));
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4C, 3, 1, 0x01]).data, [MASTER, 0xCC]);
    assert_eq!(bus.slave.allocated(), None);
    assert_eq!(bus.slave.refused().len(), 3);
}

#[test]
fn odd_choices_are_refused() {
    let mut bus = Bus::new(Settings::speed());
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x00, MASTER]).data, [MASTER, 0x94, 0x09, 0x02]);
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x05, MASTER]).data, [MASTER, 0x94, 0x02, 0x02]);
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x01]).data, [MASTER, 0x94, 0x13, 0xFF]);
    assert_eq!(bus.one(0x42E, &[MASTER, 0x0E, 1, 1, 1]).data, [MASTER, 0x94, 0x08, 0x03]);
    assert_eq!(bus.say(0x42C, &[MASTER, 0x0E, 1, 1, 1]), []);
}

#[test]
fn the_identity_is_told() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(100);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 1]), [0x8E, 0x39, 0x05]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 2]), [0x8E, 0x25, 0x00]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 3]), [0x8E, 77, 0]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 4]), [0x8E, 2, 1]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 5]), [0x8E, 1, 0]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 6]), [0x8E, 0xC3, 0xB2, 0xA1, 0x00]);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 99]), [0x94, 0x14, 0xFF]);
    assert_eq!(bus.ask(&[0x0E, 1, 2, 1]), [0x94, 0x16, 0xFF]);
    assert_eq!(bus.ask(&[0x0E, 99, 1, 1]), [0x94, 0x16, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 1, 1, 1, 0, 0]), [0x94, 0x0E, 0xFF]);
    assert_eq!(bus.ask(&[0x77, 1, 1]), [0x94, 0x08, 0xFF]);
}

#[test]
fn a_long_answer_comes_in_fragments() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(100);
    let first = bus.one(0x42C, &[0x41, 0x0E, 1, 1, 7]);
    assert_eq!(first, Frame::new(0x42B, &[0xC1, 0x00, 0x8E, 10, b'O', b'd', b'd', b' ']));
    let last = bus.one(0x42C, &[0xC1, 0xC0, 0x00]);
    assert_eq!(last, Frame::new(0x42B, &[0xC1, 0x81, b'M', b'o', b't', b'i', b'o', b'n']));
    assert_eq!(bus.say(0x42C, &[0xC1, 0xC1, 0x00]), []);
    assert_eq!(bus.wait(1_500), []);
}

#[test]
fn a_fragment_without_acknowledge_comes_twice() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(100);
    let first = bus.one(0x42C, &[MASTER, 0x0E, 1, 1, 7]);
    let out = bus.wait(1_010);
    assert_eq!(out, [first]);
    assert_eq!(bus.wait(3_000), []);
}

#[test]
fn a_long_request_is_acknowledged() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(100);
    let ack = bus.one(0x42C, &[0x81, 0x00, 0x04, 0x42, 1, 1, 0, 0xB9]);
    assert_eq!(ack, Frame::new(0x42B, &[0x81, 0xC0, 0x00]));
    let again = bus.one(0x42C, &[0x81, 0x00, 0x04, 0x42, 1, 1, 0, 0xB9]);
    assert_eq!(again, ack);
    let out = bus.say(0x42C, &[0x81, 0x81, 0x01, 0x00, 0x00, 0x80, 0x3F]);
    assert_eq!(out[0], Frame::new(0x42B, &[0x81, 0xC1, 0x00]));
    assert_eq!(out[1], Frame::new(0x42B, &[0x01, 0x84, 1, 0, 0xB9, 0x01, 0, 0]));
    let set = &bus.slave.sets()[1];
    assert_eq!((set.class, set.instance, set.attribute), (0x42, 1, 441));
    assert_eq!(set.data, 1.0_f32.to_le_bytes());
    assert_eq!(bus.say(0x42C, &[0x81, 0x45, 1, 2]), []);
}

#[test]
fn too_long_a_request_is_told_so() {
    let mut settings = Settings::motion();
    settings.longest_request = 10;
    let mut bus = Bus::new(settings);
    bus.connect(100);
    assert_eq!(bus.one(0x42C, &[0x81, 0x00, 1, 2, 3, 4, 5, 6]).data, [0x81, 0xC0, 0]);
    assert_eq!(bus.one(0x42C, &[0x81, 0x41, 1, 2, 3, 4, 5, 6]).data, [0x81, 0xC1, 1]);
    assert_eq!(bus.say(0x42C, &[0x81, 0x82, 1]), []);
}

#[test]
fn the_poll_connection_tells_its_attributes() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(200);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 1]), [0x8E, 3]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 2]), [0x8E, 1]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 4]), [0x8E, 0xC5, 0x03]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 5]), [0x8E, 0x2D, 0x04]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 7]), [0x8E, 4, 0]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 8]), [0x8E, 4, 0]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 9]), [0x8E, 200, 0]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 13]), [0x8E, 6, 0]);
    assert_eq!(bus.ask_long(&[0x0E, 5, 2, 14]), [0x8E, 0x20, 4, 0x24, 70, 0x30, 3]);
    assert_eq!(bus.ask(&[0x0E, 5, 1, 9]), [0x8E, 0xC4, 0x09]);
    assert_eq!(bus.ask(&[0x0E, 5, 4, 1]), [0x94, 0x16, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 5, 2, 7, 8, 0]), [0x94, 0x0E, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 5, 2, 12, 7]), [0x94, 0x09, 0xFF]);
}

#[test]
fn the_poll_connection_times_out() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(10);
    bus.poll(&[0, 0, 0, 0]);
    bus.wait(39);
    assert_eq!(bus.slave.connection_states(), (3, 3));
    bus.wait(2);
    assert_eq!(bus.slave.connection_states(), (3, 4));
    assert_eq!(bus.say(0x42D, &[0, 0, 0, 0]), []);
    assert_eq!(bus.ask(&[0x05, 5, 2]), [0x85]);
    assert_eq!(bus.slave.connection_states(), (3, 3));
    bus.poll(&[0, 0, 0, 0]);
}

#[test]
fn a_watchdog_that_resets_and_one_that_deletes() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(10);
    assert_eq!(bus.ask(&[0x10, 5, 2, 12, 2]), [0x90]);
    bus.poll(&[0, 0, 0, 0]);
    bus.wait(500);
    assert_eq!(bus.slave.connection_states(), (3, 3));
    assert_eq!(bus.ask(&[0x10, 5, 2, 12, 1]), [0x90]);
    bus.wait(50);
    assert_eq!(bus.slave.connection_states(), (3, 0));
}

#[test]
fn everything_runs_out_when_the_master_is_gone() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(10);
    bus.wait(9_990);
    assert_eq!(bus.slave.allocated(), Some((1, 3)));
    bus.wait(30);
    assert_eq!(bus.slave.allocated(), None);
    assert_eq!(bus.slave.connection_states(), (0, 0));
    bus.connect(10);
}

#[test]
fn a_deferred_explicit_connection_comes_back() {
    let mut bus = Bus::new(Settings::speed());
    bus.connect(0);
    assert_eq!(bus.ask(&[0x10, 5, 1, 12, 3]), [0x90]);
    assert_eq!(bus.ask(&[0x10, 5, 1, 9, 100, 0]), [0x90, 100, 0]);
    bus.wait(410);
    assert_eq!(bus.slave.connection_states(), (5, 3));
    assert_eq!(bus.ask(&[0x0E, 5, 1, 1]), [0x8E, 3]);
}

#[test]
fn other_body_formats() {
    for (format, code, request) in [
        (BodyFormat::EightSixteen, 1, &[0x0E, 1, 1, 0, 1][..]),
        (BodyFormat::SixteenSixteen, 2, &[0x0E, 1, 0, 1, 0, 1]),
        (BodyFormat::SixteenEight, 3, &[0x0E, 1, 0, 1, 1]),
        (BodyFormat::Path, 4, &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1]),
    ] {
        let mut settings = Settings::speed();
        settings.body_format = format;
        let mut bus = Bus::new(settings);
        assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x01, MASTER]).data, [MASTER, 0xCB, code]);
        assert_eq!(bus.ask_long(request), [0x8E, 0x39, 0x05]);
    }
}

#[test]
fn no_frame_makes_it_panic() {
    for settings in [Settings::motion(), Settings::speed()] {
        let mut bus = Bus::new(settings);
        bus.connect(0);
        let mut number = 12_345_u32;
        let mut next = || {
            number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            number.to_be_bytes()
        };
        for round in 0..40_000_u32 {
            let [choice, length, first, _] = next();
            let [b, c, d, e] = next();
            let [f, g, h, i] = next();
            let mut data = vec![first, b, c % 8, d % 4, e, f, g, h];
            match choice % 4 {
                0 => data[0] = MASTER,
                1 => data[..2].copy_from_slice(&[0x80 | MASTER, i]),
                2 => data[..4].copy_from_slice(&[2, 2, i, 5]),
                _ => {}
            }
            data.truncate(usize::from(length % 9));
            let id = [0x42C, 0x42D, 0x42E, 0x42D][usize::from(i % 4)];
            bus.say(id, &data);
            if round % 500 == 0 {
                bus.wait(3);
                bus.say(0x42E, &[MASTER, 0x4B, 3, 1, 0x01, MASTER]);
                bus.say(0x42E, &[MASTER, 0x4B, 3, 1, 0x02, MASTER]);
                bus.say(0x42C, &[MASTER, 0x10, 5, 2, 9, 0, 0]);
            }
        }
        assert!(bus.slave.position().is_finite());
    }
}
