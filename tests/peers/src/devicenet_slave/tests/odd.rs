//! Odd behaviour, one setting at a time.

use super::*;

fn with(change: impl FnOnce(&mut Settings)) -> Settings {
    let mut settings = Settings::speed();
    change(&mut settings);
    settings
}

fn motion(change: impl FnOnce(&mut Settings)) -> Bus {
    let mut settings = Settings::motion();
    change(&mut settings);
    let mut bus = Bus::new(settings);
    bus.connect(0);
    bus
}

/// A motion poll without motion; the answer without fragments.
fn block(bus: &mut Bus, id: u8, control: u8) -> Vec<u8> {
    assert_eq!(bus.say(0x42D, &[0x00, 2, 2, id, 5, 2, 2, control]), []);
    assert_eq!(bus.say(0x42D, &[0x41, 0, 2, 2, 0, 0, 0, 0]), []);
    let out = bus.say(0x42D, &[0x82, 0, 0]);
    out.iter().flat_map(|frame| frame.data[1..].to_vec()).collect()
}

#[test]
fn duplicate_checks() {
    let mut bus = Bus::new(with(|settings| settings.ignores_dup_check = true));
    assert_eq!(bus.say(0x42F, &[0, 1, 0, 2, 0, 0, 0]), []);
    let mut bus = Bus::new(with(|settings| settings.conflict_with = Some(1)));
    assert_eq!(bus.one(0x40F, &[0, 1, 0, 2, 0, 0, 0]).data[0], 0x80);
    let mut settings = with(|settings| settings.skips_dup_check = true);
    settings.mac = 63;
    let mut slave = DevicenetSlave::new(settings);
    let mut out = Vec::new();
    slave.hear(0, &Frame::new(0x5FE, &[1, 0x4B, 3, 1, 1, 1]), &mut out);
    assert_eq!(out, [Frame::new(0x5FB, &[1, 0xCB, 0])]);
}

#[test]
fn allocations() {
    let mut bus = Bus::new(with(|settings| settings.refuse_allocation = Some((0x02, 0xFF))));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 1, 1]).data, [1, 0x94, 0x02, 0xFF]);
    let mut bus = Bus::new(with(|settings| {
        settings.foreign_master = Some(9);
        settings.foreign_master_ms = 3_000;
    }));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 1, 1]).data, [1, 0x94, 0x0C, 0x01]);
    bus.wait(1_000);
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 1, 1]).data, [1, 0xCB, 0]);
    let mut bus = Bus::new(with(|settings| settings.choices = 0x01));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 3, 1]).data, [1, 0x94, 0x02, 0x02]);
    let mut bus = Bus::new(with(|settings| settings.io_needs_explicit = true));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 2, 1]).data, [1, 0x94, 0x09, 0x02]);
    bus.slave.settings().io_needs_explicit = false;
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 2, 1]).data, [1, 0xCB, 0]);
    assert_eq!(bus.slave.allocated(), Some((1, 2)));
}

#[test]
fn explicit_answers() {
    let mut bus = Bus::new(with(|settings| settings.explicit_delay_ms = 50));
    assert_eq!(bus.say(0x42E, &[1, 0x4B, 3, 1, 1, 1]), []);
    assert_eq!(bus.wait(49), []);
    assert_eq!(bus.wait(2), [Frame::new(0x42B, &[1, 0xCB, 0])]);
    let mut bus = Bus::new(with(|settings| settings.wrong_service = true));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 1, 1]).data, [1, 0xCC, 0]);
    let mut bus = Bus::new(with(|settings| settings.wrong_mac = true));
    assert_eq!(bus.one(0x42E, &[0x41, 0x4B, 3, 1, 1, 1]).data, [0x45, 0xCB, 0]);
    let mut bus = Bus::new(with(|settings| settings.wrong_transaction = true));
    assert_eq!(bus.one(0x42E, &[0x41, 0x4B, 3, 1, 1, 1]).data, [0x01, 0xCB, 0]);
    let mut bus = Bus::new(with(|settings| settings.explicit_missing_every = 2));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 1, 1]).data, [1, 0xCB, 0]);
    assert_eq!(bus.say(0x42C, &[1, 0x0E, 1, 1, 1]), []);
    assert_eq!(bus.ask(&[0x0E, 1, 1, 1]), [0x8E, 0x39, 0x05]);
}

#[test]
fn refused_sets() {
    let refuse = RefusedSet { class: 0x2A, attribute: 18, status: 0x0F };
    let rate = RefusedSet { class: 5, attribute: 12, status: 0x1F };
    let mut bus = Bus::new(with(|settings| settings.refuse_sets = vec![refuse, rate]));
    bus.connect(0);
    assert_eq!(bus.ask(&[0x10, 0x2A, 1, 18, 1, 0]), [0x94, 0x0F, 0xFF]);
    assert_eq!(bus.ask(&[0x10, 0x2A, 1, 19, 1, 0]), [0x90]);
    assert_eq!(bus.ask(&[0x10, 5, 2, 12, 2]), [0x94, 0x1F, 0xFF]);
    let last = bus.slave.refused().last().unwrap();
    assert_eq!((last.class, last.attribute, last.general), (5, Some(12), 0x1F));
    let refuse = RefusedSet { class: 0x42, attribute: 610, status: 0x09 };
    let mut bus = motion(|settings| settings.refuse_sets = vec![refuse]);
    assert_eq!(bus.ask_long(&[0x04, 0x42, 1, 1, 0, 0x62, 2, 1]), [0x84, 1, 0, 0x62, 2, 9, 0]);
    bus.slave.settings().list_error_as_error = true;
    assert_eq!(bus.ask_long(&[0x04, 0x42, 1, 1, 0, 0x62, 2, 1]), [0x94, 0x0A, 0xFF]);
    bus.slave.settings().missing_axis_attributes = vec![610];
    assert_eq!(bus.ask_long(&[0x03, 0x42, 1, 1, 0, 0x62, 2]), [0x94, 0x0A, 0xFF]);
}

#[test]
fn packet_rates() {
    let mut bus = Bus::new(with(|settings| settings.packet_rate_step_ms = 8));
    assert_eq!(bus.one(0x42E, &[1, 0x4B, 3, 1, 3, 1]).data, [1, 0xCB, 0]);
    assert_eq!(bus.ask(&[0x10, 5, 2, 9, 10, 0]), [0x90, 16, 0]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 9]), [0x8E, 16, 0]);
    bus.slave.settings().silent_packet_rate = true;
    assert_eq!(bus.ask(&[0x10, 5, 2, 9, 24, 0]), [0x90]);
}

#[test]
fn sizes_and_assemblies() {
    let mut bus = Bus::new(with(|settings| {
        settings.assemblies = vec![20, 70];
        settings.consumed_size = Some(6);
        settings.produced_size = Some(8);
        settings.told_produced_size = Some(4);
    }));
    bus.connect(0);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 7]), [0x8E, 4, 0]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 8]), [0x8E, 6, 0]);
    assert_eq!(bus.ask(&[0x0E, 4, 71, 3]), [0x94, 0x16, 0xFF]);
    assert_eq!(bus.ask(&[0x0E, 4, 70, 3]), [0x8E, 0, 0, 0, 0]);
    assert_eq!(bus.say(0x42D, &[0, 0, 0, 0]), []);
    assert_eq!(bus.poll(&[0, 0, 0, 0, 0, 0]), [0; 8]);
}

#[test]
fn poll_answers() {
    let mut bus = Bus::new(with(|settings| settings.poll_delay_ms = 7));
    bus.connect(0);
    assert_eq!(bus.say(0x42D, &[0, 0, 0, 0]), []);
    assert_eq!(bus.wait(6), []);
    assert_eq!(bus.wait(1).len(), 1);
    bus.slave.settings().poll_delay_ms = 0;
    bus.slave.settings().poll_missing_every = 3;
    assert_eq!(bus.poll(&[0, 0, 0, 0]).len(), 4);
    assert_eq!(bus.say(0x42D, &[0, 0, 0, 0]), []);
    bus.slave.settings().poll_short_by = 1;
    assert_eq!(bus.poll(&[0, 0, 0, 0]).len(), 3);
    bus.slave.settings().poll_short_by = 0;
    bus.slave.settings().poll_long_by = 2;
    assert_eq!(bus.poll(&[0, 0, 0, 0]).len(), 6);
}

#[test]
fn motion_headers() {
    let mut bus = motion(|settings| {
        settings.update_id = UpdateId::Fixed(9);
        settings.format_revision = 1;
        settings.connection_format = 7;
        settings.axes = 2;
    });
    assert_eq!(block(&mut bus, 4, 0)[..4], [7, 1, 9, 5]);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 3]), [0x8E, 2, 0]);
    bus.slave.settings().update_id = UpdateId::OwnCount;
    assert_eq!(block(&mut bus, 4, 0)[2], 2);
}

#[test]
fn a_fault_for_one_poll() {
    let fault = PlannedFault { poll: 2, code: 0x4310, lasts: Lasts::OnePoll };
    let mut bus = Bus::new(with(|settings| settings.fault = Some(fault)));
    bus.connect(0);
    assert_eq!(bus.poll(&[0, 0, 0, 0])[0], 0);
    assert_eq!(bus.poll(&[0, 0, 0, 0])[0], 1);
    assert_eq!(bus.poll(&[0, 0, 0, 0])[0], 0);
    let mut bus = motion(|settings| settings.fault = Some(PlannedFault { code: 7, ..fault }));
    block(&mut bus, 1, 0);
    bus.wait(25);
    assert_eq!(block(&mut bus, 2, 0)[11], 8);
    assert_eq!(block(&mut bus, 3, 0)[11], 2);
}

#[test]
fn a_fault_for_good_and_a_refused_reset() {
    let fault = PlannedFault { poll: 1, code: 0x4310, lasts: Lasts::ForGood };
    let mut bus = Bus::new(with(|settings| settings.fault = Some(fault)));
    bus.connect(0);
    assert_eq!(bus.poll(&[0, 0, 0, 0])[0], 1);
    assert_eq!(bus.poll(&[4, 0, 0, 0])[0], 1);
    let mut bus = motion(|settings| {
        settings.fault = Some(PlannedFault { poll: 2, code: 7, lasts: Lasts::UntilReset });
        settings.reset_refused_ms = 100;
    });
    block(&mut bus, 1, 0);
    bus.wait(25);
    assert_eq!(block(&mut bus, 2, 0)[11], 8);
    assert_eq!(block(&mut bus, 3, 6)[6..12], [6, 0x0C, 0, 2, 0, 8]);
    bus.wait(100);
    block(&mut bus, 4, 0);
    assert_eq!(block(&mut bus, 5, 6)[6..12], [6, 0, 0, 2, 0, 2]);
}

#[test]
fn it_restarts_itself() {
    let mut bus = Bus::new(with(|settings| settings.restart_every_ms = 5_000));
    bus.connect(0);
    let out = bus.wait(3_000);
    assert_eq!(out[0].id, 0x42F);
    assert_eq!(bus.slave.allocated(), None);
    assert!(!bus.slave.on_line());
    let mut bus = Bus::new(with(|_| {}));
    bus.connect(0);
    assert_eq!(bus.ask(&[0x05, 1, 1]), [0x85]);
    assert_eq!(bus.wait(1)[0].id, 0x42F);
}

#[test]
fn a_cause_outlives_a_restart() {
    let mut bus = Bus::new(with(|_| {}));
    bus.slave.fail(0x2310);
    bus.connect(0);
    bus.ask(&[0x05, 1, 1]);
    bus.wait(2_002);
    bus.connect(0);
    assert_eq!(bus.poll(&[0, 0, 0, 0])[0], 1);
}

#[test]
fn the_same_frames_give_the_same_answers() {
    let run = || {
        let mut bus = Bus::new(with(|settings| settings.poll_delay_ms = 3));
        bus.connect(0);
        let mut heard = Vec::new();
        for speed in 0..50 {
            heard.extend(bus.say(0x42D, &[u8::from(speed > 2), 0, speed, 1]));
            heard.extend(bus.wait(5));
        }
        (heard, bus.slave.log().to_vec(), bus.slave.position().to_bits())
    };
    let first = run();
    assert_eq!(first.0.len(), 50);
    assert_eq!(first, run());
}

#[test]
fn paths_of_a_motion_drive() {
    let mut bus = Bus::new(Settings::motion());
    bus.one(0x42E, &[1, 0x4B, 3, 1, 3, 1]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 14, 0x20, 0x42, 0x24, 1]), [0x90]);
    assert_eq!(bus.ask_long(&[0x10, 5, 2, 16, 0x20, 0x42, 0x24, 2]), [0x94, 0x09, 0xFF]);
    assert_eq!(bus.ask(&[0x0E, 5, 2, 3]), [0x8E, 0x82]);
}

#[test]
fn the_speed_drive_that_will_not() {
    let extended = |change: fn(&mut Settings)| {
        let mut bus = Bus::new(with(|settings| {
            settings.consumed_assembly = 21;
            settings.produced_assembly = 71;
            change(settings);
        }));
        bus.connect(0);
        bus.poll(&[0x60, 0, 0x64, 0]);
        bus
    };
    let mut bus = extended(|settings| settings.never_at_reference = true);
    bus.poll(&[0x61, 0, 0x64, 0]);
    bus.wait(50);
    assert_eq!(bus.poll(&[0x61, 0, 0x64, 0]), [0x74, 4, 0x64, 0]);
    let mut bus = extended(|settings| settings.never_ready = true);
    assert_eq!(bus.poll(&[0x61, 0, 0x64, 0]), [0x60, 2, 0, 0]);
    let mut bus = extended(|settings| settings.local_control = true);
    assert_eq!(bus.poll(&[0x61, 0, 0x64, 0]), [0x10, 3, 0, 0]);
    let mut bus = extended(|settings| settings.fault_without_code = true);
    bus.slave.fail(0x2310);
    assert_eq!(bus.ask(&[0x0E, 0x29, 1, 13]), [0x8E, 0, 0]);
    let mut bus = extended(|settings| {
        settings.run_needs_net_ctrl = false;
        settings.reference_needs_net_ref = false;
        settings.unsigned_speed = true;
    });
    bus.poll(&[0x02, 0, 0x64, 0]);
    bus.wait(50);
    assert_eq!(bus.poll(&[0x02, 0, 0x64, 0]), [0xF8, 4, 0x64, 0]);
}

#[test]
fn waiting_and_locking() {
    let mut bus = motion(|settings| {
        settings.waits_for_complete = true;
        settings.locked_while_running = true;
        settings.starting_ms = 1;
    });
    assert_eq!(block(&mut bus, 1, 0)[11], 0);
    assert_eq!(bus.ask(&[0x10, 0x42, 1, 89, 1]), [0x90]);
    assert_eq!(block(&mut bus, 2, 0)[11], 1);
    bus.wait(25);
    block(&mut bus, 3, 1);
    bus.wait(5);
    assert_eq!(block(&mut bus, 4, 1)[11], 4);
    assert_eq!(bus.ask(&[0x10, 0x42, 1, 41, 2]), [0x94, 0x0C, 0xFF]);
    assert_eq!(bus.ask_long(&[0x04, 0x42, 1, 1, 0, 0xB9, 1, 0, 0, 0, 0])[5..], [0, 0]);
    bus.slave.settings().control_modes = 0b10;
    assert_eq!(block(&mut bus, 5, 0)[11], 7);
    assert!(bus.slave.faulted());
}
