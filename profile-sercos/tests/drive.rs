//! The simulated drive as a master sees it in CP4.

#[path = "support/bench.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod bench;

use std::fmt::Write;

use bench::Bench;
use profile_generic::fault::FaultCause;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoParameters;
use profile_sercos::wire::data_status::CommandState;
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::drive_words::{DriveStatus, ReadyState};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc_error::SvcError;

const FOLLOW: u16 = 0xE000;
const HALT: u16 = 0xC000;
const ENABLE_ONLY: u16 = 0x4000;

/// A drive in CP4 whose primary operation mode is `mode`, with more parameters written in CP2.
fn drive_in(mode: i64, parameters: &[(u16, i64)]) -> Bench {
    let mut bench = Bench::new(1, ServoParameters::default());
    bench.up_to_cp2();
    bench.configure();
    bench.write(0, Idn::standard(32), mode).unwrap();
    for &(block, value) in parameters {
        bench.write(0, Idn::standard(block), value).unwrap();
    }
    bench.up_to_cp4();
    bench
}

/// Enables the drive with command = feedback and waits until it follows.
fn enable(bench: &mut Bench) {
    bench.commands[0].position = bench.feedback[0].position;
    bench.commands[0].control = FOLLOW;
    bench.cycles(10);
    let status = bench.feedback[0].status;
    assert_eq!((status.ready(), status.contains(DriveStatus::FOLLOWS)), (ReadyState::InOperation, true));
}

#[test]
fn the_way_to_torque_and_back() {
    let mut bench = drive_in(0x0002, &[(206, 30), (207, 20)]);
    let mut log = String::new();
    let mut last = DriveStatus::empty();
    bench.drive(0).set_main_power(false);
    let script: [(&str, u16, i32, usize); 7] = [
        ("no main power", 0, 0, 400),
        ("main power", 0, 0, 400),
        ("drive on, enable, follow", FOLLOW, 600_000, 60),
        ("halt", HALT, 600_000, 400),
        ("restart", FOLLOW, 600_000, 60),
        ("drive off", ENABLE_ONLY, 600_000, 400),
        ("all off", 0, 0, 10),
    ];
    for (what, control, velocity, cycles) in script {
        writeln!(log, "{what}: S-0-0134 = {control:#06x}").unwrap();
        if what == "main power" {
            bench.drive(0).set_main_power(true);
        }
        bench.commands[0].control = control;
        bench.commands[0].velocity = velocity;
        for cycle in 1..=cycles {
            bench.cycle();
            let status = bench.feedback[0].status;
            if status != last {
                writeln!(log, "  cycle {cycle}: {:#06x} {status}", status.bits()).unwrap();
                last = status;
            }
        }
        // Whole revolutions a minute: the last digits belong to the servo's loops.
        writeln!(log, "  then at {} 1/min", bench.feedback[0].velocity / 10_000).unwrap();
    }
    insta::assert_snapshot!(log);
}

#[test]
fn velocity_is_followed_in_the_scaling_of_the_parameters() {
    // Parameter scaling: 0.01 1/min.
    let mut bench = drive_in(0x0002, &[(44, 0x0A), (46, -2)]);
    enable(&mut bench);
    bench.commands[0].velocity = 120_000;
    bench.cycles(400);
    let velocity = bench.feedback[0].velocity;
    assert!((velocity - 120_000).abs() < 200, "{velocity}");
    let turns = bench.drive(0).actual().velocity;
    assert!((turns.0 - 20_000_000_000).abs() < 40_000_000, "1200 1/min are 20 turns a second: {turns}");
}

#[test]
fn position_is_followed_and_the_polarity_turns_it() {
    let mut bench = drive_in(0x000B, &[(55, 0x000F)]);
    enable(&mut bench);
    let start = bench.feedback[0].position;
    for step in 1..=1000 {
        bench.commands[0].position = start + step * 3_600;
        bench.cycle();
    }
    bench.cycles(300);
    // One turn, in 0.0001 degree; the encoder resolves four of them.
    let there = bench.feedback[0].position - start;
    assert!((there - 3_600_000).abs() <= 40, "{there}");
    let actual = bench.drive(0).actual().position;
    assert!((actual.0 + 1_000_000_000).abs() <= 10_000, "the other way round: {actual}");
    let distance = bench.read(0, Idn::standard(189)).unwrap();
    assert!(i32::from_le_bytes(distance.to_le_bytes()).abs() <= 40);
    let status = bench.read(0, Idn::standard(13)).unwrap() & 0xFFFF;
    assert_eq!(status & 0x42, 0x42, "in position and standing: {status:#06x}");
}

#[test]
fn modulo_positions_run_on_for_ever() {
    let mut bench = drive_in(0x0003, &[(76, 0x82), (103, 3_600_000)]);
    enable(&mut bench);
    let mut position = i64::from(bench.feedback[0].position);
    for _ in 0..3000 {
        position += 36_000;
        bench.commands[0].position = i32::try_from(position.rem_euclid(3_600_000)).unwrap();
        bench.cycle();
        assert!((0..3_600_000).contains(&bench.feedback[0].position));
    }
    bench.cycles(500);
    let turns = bench.drive(0).actual().position;
    assert!((turns.0 - 30_000_000_000).abs() < 20_000, "30 turns: {turns}");
}

#[test]
fn torque_is_applied_in_tenths_of_a_percent() {
    let mut bench = drive_in(0x0001, &[]);
    enable(&mut bench);
    bench.drive(0).servo_mut().set_load(Torque(300_000));
    bench.commands[0].torque = 300;
    bench.cycles(50);
    assert!((bench.feedback[0].torque - 300).abs() <= 3, "{}", bench.feedback[0].torque);
}

#[test]
fn an_operation_mode_is_selected_by_the_control_word() {
    let mut bench = drive_in(0x0002, &[(33, 0x0003)]);
    enable(&mut bench);
    assert_eq!(bench.feedback[0].status.mode(), 0);
    bench.commands[0].position = bench.feedback[0].position;
    bench.commands[0].control = FOLLOW | 0x0100;
    bench.cycles(5);
    assert_eq!((bench.feedback[0].status.mode(), bench.feedback[0].status.bits() & 0x2000), (1, 0));
    // Behind number 2 there is no mode.
    bench.commands[0].control = FOLLOW | 0x0200;
    bench.cycles(50);
    assert!(bench.feedback[0].status.contains(DriveStatus::ERROR));
    assert_eq!(bench.read(0, Idn::standard(14)).unwrap() & 0xFFFF, 1 << 9);
    assert_eq!(bench.read(0, Idn::standard(11)).unwrap() & 0xFFFF, 1 << 12);
}

#[test]
fn a_following_error_locks_the_drive_until_it_is_reset() {
    let mut bench = drive_in(0x0003, &[(159, 36_000)]);
    enable(&mut bench);
    bench.commands[0].position += 3_600_000;
    bench.cycles(400);
    let status = bench.feedback[0].status;
    assert!(status.contains(DriveStatus::ERROR) && status.ready() != ReadyState::InOperation, "{status}");
    assert!(bench.feedback[0].device.contains(DeviceStatus::DEVICE_ERROR));
    assert_eq!(bench.read(0, Idn::standard(11)).unwrap() & 0xFFFF, 1 << 11);
    assert_eq!(bench.read(0, Idn::standard(390)), Ok(0xC00F_000B));
    let text = bench.read_list(0, Idn::standard(95)).unwrap();
    assert_eq!(String::from_utf8(text).unwrap(), "excessive position deviation");
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycles(20);
    let status = bench.feedback[0].status;
    assert_eq!((status.contains(DriveStatus::ERROR), status.ready()), (false, ReadyState::PowerOn));
    // The bits that still stand do not switch it on again; a new edge does.
    bench.commands[0].control = 0;
    bench.cycles(2);
    enable(&mut bench);
}

#[test]
fn a_fault_with_its_cause_present_cannot_be_reset() {
    let mut bench = drive_in(0x0002, &[]);
    enable(&mut bench);
    bench.drive(0).raise_fault(FaultCause::OVER_VOLTAGE);
    bench.cycles(3);
    assert_eq!(bench.read(0, Idn::standard(11)).unwrap() & 0xFFFF, 1 << 8);
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Failed));
    bench.drive(0).clear_fault(FaultCause::OVER_VOLTAGE);
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycle();
    assert_eq!(bench.read(0, Idn::standard(11)).unwrap() & 0xFFFF, 0);
}

#[test]
fn a_reset_without_a_fault_does_not_disturb_the_motion() {
    let mut bench = drive_in(0x0002, &[]);
    enable(&mut bench);
    bench.commands[0].velocity = 5_000_000;
    bench.cycles(300);
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycles(10);
    assert_eq!(bench.feedback[0].status.ready(), ReadyState::InOperation);
    assert!((bench.feedback[0].velocity - 5_000_000).abs() < 20_000, "{}", bench.feedback[0].velocity);
}

#[test]
fn warnings_are_shown_and_pass() {
    let mut bench = drive_in(0x0002, &[]);
    bench.drive(0).set_warnings(1 << 3);
    bench.cycles(2);
    assert!(bench.feedback[0].status.contains(DriveStatus::WARNING));
    assert!(bench.feedback[0].device.contains(DeviceStatus::DEVICE_WARNING));
    assert_eq!(bench.read(0, Idn::standard(12)).unwrap() & 0xFFFF, 8);
    assert_eq!(bench.read(0, Idn::standard(390)), Ok(0xC00E_0003));
    bench.drive(0).set_warnings(0);
    bench.cycles(2);
    assert_eq!(bench.feedback[0].status.bits() & 0x1000, 0);
    assert_eq!(bench.read(0, Idn::standard(390)), Ok(0xC30A_0040));
}

#[test]
fn a_lost_connection_stops_the_drive_and_it_does_not_start_by_itself() {
    let mut bench = drive_in(0x0002, &[]);
    enable(&mut bench);
    bench.commands[0].velocity = 5_000_000;
    bench.cycles(200);
    assert!(bench.feedback[0].velocity > 4_000_000);
    bench.producing = false;
    bench.cycles(300);
    assert_eq!(bench.feedback[0].velocity / 10_000, 0);
    assert_ne!(bench.feedback[0].status.ready(), ReadyState::InOperation);
    bench.producing = true;
    assert_eq!(bench.command(0, Idn::RESET_C1D), Ok(CommandState::Done));
    bench.cycles(50);
    assert_eq!(bench.feedback[0].status.ready(), ReadyState::PowerOn, "0xE000 still stands");
    bench.commands[0].control = 0;
    bench.cycles(2);
    enable(&mut bench);
}

#[test]
fn the_master_vanishing_stops_the_drive() {
    let mut bench = drive_in(0x0002, &[]);
    enable(&mut bench);
    bench.commands[0].velocity = 5_000_000;
    bench.cycles(200);
    for _ in 0..100 {
        bench.now = bench.line.wake_at().unwrap();
        let now = bench.now;
        bench.line.handle_time(now);
    }
    let actual = *bench.drive(0).actual();
    assert!(actual.velocity.0.abs() < 60_000_000, "{}", actual.velocity);
    assert_eq!(bench.line.slaves()[0].store().number_of(Idn::standard(135)) & 0xC000, 0);
}

#[test]
fn travel_limits_stop_the_drive() {
    let limits = [(49, 1_000_000), (50, -1_000_000), (55, 0x0010)];
    let mut bench = drive_in(0x0002, &limits);
    enable(&mut bench);
    bench.commands[0].velocity = 1_000_000;
    bench.cycles(1000);
    assert!(bench.feedback[0].status.contains(DriveStatus::ERROR));
    assert_eq!(bench.read(0, Idn::standard(11)).unwrap() & 0xFFFF, 1 << 13);
}

#[test]
fn scaling_is_guarded() {
    let mut bench = Bench::new(1, ServoParameters::default());
    bench.up_to_cp2();
    assert_eq!(bench.write(0, Idn::standard(46), -5), Err(SvcError::OTHER_SETTINGS), "preferential");
    assert_eq!(bench.write(0, Idn::standard(46), -4), Ok(0), "what it is already");
    bench.write(0, Idn::standard(44), 0x22).unwrap();
    assert_eq!(bench.read(0, Idn::standard(46)).map(|word| word & 0xFFFF), Ok(0xFFFA), "per second: 10^-6");
    assert_eq!(bench.write(0, Idn::standard(91), 0), Err(SvcError::BELOW_MINIMUM));
    assert_eq!(bench.write(0, Idn::standard(104), 0xFFFF), Err(SvcError::INVALID_DATA), "unstable");
    bench.configure();
    bench.write(0, Idn::standard(76), 3).unwrap();
    bench.command(0, Idn::CP3_CHECK).unwrap();
    bench.switch(profile_sercos::wire::header::Phase::CP3);
    assert_eq!(bench.command(0, Idn::CP4_CHECK), Ok(CommandState::Failed));
    assert_eq!(
        bench.read_list(0, Idn::INVALID_CP3),
        Ok(76u32.to_le_bytes().to_vec()),
        "neither linear nor rotational"
    );
}

#[test]
fn a_linear_axis_moves_in_tenths_of_a_micrometre() {
    let servo = ServoParameters {
        kind: UnitKind::Linear,
        start_position: Position(5_000_000_000),
        rated_velocity: Velocity(1_000_000_000_000),
        ..ServoParameters::default()
    };
    let mut bench = Bench::new(1, servo);
    bench.up_to_cp2();
    bench.configure();
    bench.up_to_cp4();
    assert!((bench.feedback[0].position - 50_000).abs() <= 1, "5 mm: {}", bench.feedback[0].position);
    enable(&mut bench);
    for step in 1..=500 {
        bench.commands[0].position = 50_000 + step * 20;
        bench.cycle();
    }
    bench.cycles(300);
    let position = bench.drive(0).actual().position;
    assert!((position.0 - 6_000_000_000).abs() <= 200_000, "{position}");
}
