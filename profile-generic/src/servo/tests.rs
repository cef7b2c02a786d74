use super::*;
use crate::capture::{CaptureEdge, CaptureRequest, CaptureSource, CaptureStatus, CaptureWindow};
use crate::fault::Reaction;
use proptest::prelude::*;

const MS: i64 = 1_000_000;
const UNIT: i64 = 1_000_000_000;

/// Runs `ticks` steps of a millisecond.
fn run(servo: &mut Servo, ticks: u32, command: &ServoCommand) -> ServoActual {
    let mut actual = servo.step(MS, command);
    for _ in 1..ticks {
        actual = servo.step(MS, command);
    }
    actual
}

fn command(mode: OperatingMode) -> ServoCommand {
    ServoCommand { control: ServoControl::Enable, mode, ..ServoCommand::default() }
}

/// A servo that follows set-points in this mode.
fn enabled(parameters: ServoParameters, command: &ServoCommand) -> Servo {
    let mut servo = Servo::new(parameters).unwrap();
    assert_eq!(run(&mut servo, 500, &ServoCommand::default()).report, Report::Ready);
    assert_eq!(servo.step(MS, command).report, Report::Enabling);
    assert_eq!(run(&mut servo, 10, command).report, Report::Operating);
    servo
}

fn turning(velocity: Velocity) -> (Servo, ServoCommand) {
    let command = ServoCommand { velocity, ..command(OperatingMode::Velocity) };
    let mut servo = enabled(ServoParameters::default(), &command);
    run(&mut servo, 300, &command);
    (servo, command)
}

#[test]
fn it_charges_waits_and_starts() {
    let mut servo = Servo::new(ServoParameters::default()).unwrap();
    let off = ServoCommand { power: false, ..ServoCommand::default() };
    assert_eq!(run(&mut servo, 100, &off).report, Report::AwaitingPower);
    let enable = command(OperatingMode::Velocity);
    assert_eq!(run(&mut servo, 500, &enable).report, Report::Ready, "an enable from before does not count");
    let ready = servo.step(MS, &ServoCommand::default());
    assert!(ready.status.contains(StatusBits::READY | StatusBits::POWER | StatusBits::STANDSTILL));
    assert!((ready.bus_voltage.0 - 560_000_000).abs() < 1_000_000, "{}", ready.bus_voltage);
    assert_eq!(run(&mut servo, 4, &enable).report, Report::Enabling);
    assert_eq!(run(&mut servo, 2, &enable).report, Report::Operating);
    assert_eq!(run(&mut servo, 500, &off).report, Report::Faulted, "power lost in operation");
    assert_eq!(servo.step(MS, &off).fault, Some(FaultCause::POWER_LOSS));
}

#[test]
fn a_position_step_lags_and_settles_without_much_overshoot() {
    let mut target = command(OperatingMode::Position);
    let mut servo = enabled(ServoParameters::default(), &target);
    target.position = Position(UNIT / 2);
    let first = servo.step(MS, &target);
    assert!(first.position.0 < UNIT / 100, "cannot be there at once: {}", first.position);
    assert!(first.following_error.0 > UNIT * 49 / 100);
    let (mut highest, mut tick_of_half) = (0, 0);
    let mut last = first;
    for tick in 1..1_000 {
        last = servo.step(MS, &target);
        highest = highest.max(last.position.0);
        if tick_of_half == 0 && last.position.0 > UNIT / 4 {
            tick_of_half = tick;
        }
    }
    assert!((10..40).contains(&tick_of_half), "half way after {tick_of_half} ms");
    assert!(highest < UNIT / 2 * 110 / 100, "overshoot to {}", Position(highest));
    assert!((last.position.0 - UNIT / 2).abs() <= 1_000_000, "{}", last.position);
    assert!(last.status.contains(StatusBits::IN_POSITION | StatusBits::STANDSTILL | StatusBits::TRACKING));
}

/// In steady motion the position error is the velocity over the gain: 10 per second over 50 per second is
/// 0.2.
#[test]
fn the_following_error_is_velocity_over_gain() {
    let run_ramp = |parameters: ServoParameters| {
        let mut target = command(OperatingMode::Position);
        let mut servo = enabled(parameters, &target);
        let mut actual = ServoActual::default();
        for _ in 0..1_000 {
            target.position.0 += UNIT / 100;
            actual = servo.step(MS, &target);
        }
        actual
    };
    let actual = run_ramp(ServoParameters::default());
    assert!((actual.following_error.0 - UNIT / 5).abs() < UNIT / 500, "{}", actual.following_error);
    assert!((actual.velocity.0 - 10 * UNIT).abs() < UNIT / 100, "{}", actual.velocity);
    let led = ServoParameters { velocity_feed_forward: 1_000_000, ..ServoParameters::default() };
    let actual = run_ramp(led);
    assert!(actual.following_error.0.abs() < UNIT / 100, "{}", actual.following_error);
}

#[test]
fn a_velocity_step_overshoots_a_little_and_settles() {
    let target = ServoCommand { velocity: Velocity(20 * UNIT), ..command(OperatingMode::Velocity) };
    let mut servo = enabled(ServoParameters::default(), &target);
    let mut highest = 0;
    for _ in 0..500 {
        highest = highest.max(servo.step(MS, &target).velocity.0);
    }
    let actual = servo.step(MS, &target);
    assert!(highest > 20 * UNIT && highest < 25 * UNIT, "{}", Velocity(highest));
    assert!((actual.velocity.0 - 20 * UNIT).abs() < UNIT / 1_000, "{}", actual.velocity);
    assert!(actual.status.contains(StatusBits::AT_VELOCITY));
    // Friction: 2 % and 3 % times 20/50.
    assert!((actual.torque.0 - 32_000).abs() < 100, "{}", actual.torque);
    assert!((actual.current.0 - 96_000).abs() < 300, "{}", actual.current);
}

#[test]
fn torque_and_velocity_stay_within_their_limits() {
    let parameters = ServoParameters { torque_limit: Torque(500_000), ..ServoParameters::default() };
    let target = ServoCommand { velocity: Velocity(500 * UNIT), ..command(OperatingMode::Velocity) };
    let mut servo = enabled(parameters, &target);
    let mut seen = StatusBits::empty();
    for _ in 0..2_000 {
        let actual = servo.step(MS, &target);
        assert!(actual.torque.0.abs() <= 500_000, "{}", actual.torque);
        seen |= actual.status & StatusBits::TORQUE_LIMIT;
    }
    let actual = servo.step(MS, &target);
    assert_eq!(seen, StatusBits::TORQUE_LIMIT);
    assert!(actual.status.contains(StatusBits::VELOCITY_LIMIT));
    assert!((actual.velocity.0 - 60 * UNIT).abs() < UNIT / 100, "held at the limit: {}", actual.velocity);
}

#[test]
fn torque_mode_gives_the_torque_and_is_fenced_by_the_velocity_limit() {
    let target = ServoCommand { torque: Torque(100_000), ..command(OperatingMode::Torque) };
    let mut servo = enabled(ServoParameters::default(), &target);
    let actual = run(&mut servo, 50, &target);
    assert!((actual.torque.0 - 100_000).abs() < 200, "{}", actual.torque);
    // 1 Nm on 1e-4 kgm2 is 1591.5 revolutions per second squared; a tenth less friction.
    let gain = 1_591.5 * (0.1 - 0.02);
    assert!((actual.acceleration.0 - nano(gain)).abs() < 8 * UNIT, "{}", actual.acceleration);
    let actual = run(&mut servo, 3_000, &target);
    assert!(actual.velocity.0 <= 60 * UNIT + UNIT / 10, "{}", actual.velocity);

    let target =
        ServoCommand { acceleration: Acceleration(200 * UNIT), ..command(OperatingMode::Acceleration) };
    let mut servo =
        enabled(ServoParameters { coulomb_friction: Torque(0), ..ServoParameters::default() }, &target);
    let actual = run(&mut servo, 20, &target);
    assert!((actual.acceleration.0 - 200 * UNIT).abs() < 12 * UNIT, "{}", actual.acceleration);
}

fn nano(units: f64) -> i64 {
    crate::cast::i64_from_f64(units * 1e9)
}

#[test]
fn a_controlled_stop_keeps_its_deceleration_and_a_coast_takes_its_time() {
    let (mut servo, follow) = turning(Velocity(40 * UNIT));
    let mut coasting = servo.clone();
    let disable = ServoCommand { control: ServoControl::Disable, ..follow };
    let mut before = servo.step(MS, &disable);
    assert_eq!(before.report, Report::Stopping);
    let mut ticks = 1;
    while before.report == Report::Stopping {
        let actual = servo.step(MS, &disable);
        let slowed = before.velocity.0 - actual.velocity.0;
        assert!(
            slowed <= 600_000_000,
            "500 per second squared and what the loop needs: {slowed} after {ticks} ms"
        );
        before = actual;
        ticks += 1;
    }
    assert_eq!((before.report, before.torque.0), (Report::Ready, 0));
    assert!((75..110).contains(&ticks), "40 at 500 per second squared is 80 ms, took {ticks}");

    let off = ServoCommand { control: ServoControl::TorqueOff, ..follow };
    let actual = coasting.step(MS, &off);
    assert_eq!((actual.report, actual.torque.0), (Report::Ready, 0));
    assert!(actual.velocity.0 > 39 * UNIT);
    let mut ticks = 1;
    while !coasting.step(MS, &off).status.contains(StatusBits::STANDSTILL) {
        ticks += 1;
    }
    assert!(ticks > 300, "coasted {ticks} ms only");
}

#[test]
fn a_halt_holds_and_an_enable_goes_on() {
    let (mut servo, follow) = turning(Velocity(10 * UNIT));
    let halt = ServoCommand { control: ServoControl::Halt, ..follow };
    assert_eq!(servo.step(MS, &halt).report, Report::Operating);
    let halted = run(&mut servo, 200, &halt);
    assert_eq!(halted.report, Report::Halted);
    assert!(halted.status.contains(StatusBits::HALT | StatusBits::ENABLED | StatusBits::STANDSTILL));
    // Pushed by the load, it comes back.
    servo.set_load(Torque(500_000));
    let pushed = run(&mut servo, 500, &halt);
    assert!((pushed.position.0 - halted.position.0).abs() < UNIT / 1_000, "{}", pushed.position);
    assert!((pushed.torque.0 - 500_000).abs() < 25_000, "{}", pushed.torque);
    servo.set_load(Torque(0));
    assert_eq!(run(&mut servo, 5, &follow).report, Report::Operating);
    assert!(run(&mut servo, 300, &follow).velocity.0 > 9 * UNIT);
}

#[test]
fn faults_react_latch_and_need_a_reset_and_a_new_enable() {
    let (mut servo, follow) = turning(Velocity(10 * UNIT));
    servo.raise_fault(FaultCause::EXTERNAL_INPUT);
    assert_eq!(servo.step(MS, &follow).report, Report::FaultReaction);
    let actual = run(&mut servo, 100, &follow);
    assert_eq!((actual.report, actual.fault), (Report::Faulted, Some(FaultCause::EXTERNAL_INPUT)));
    let reset = ServoCommand { reset_fault: true, ..follow };
    assert_eq!(servo.step(MS, &reset).report, Report::Faulted, "the condition is still there");
    servo.clear_fault(FaultCause::EXTERNAL_INPUT);
    assert_eq!(servo.step(MS, &reset).report, Report::Faulted, "no edge");
    servo.step(MS, &follow);
    assert_eq!(servo.step(MS, &reset).report, Report::Ready);
    assert_eq!(run(&mut servo, 100, &follow).report, Report::Ready, "the old enable does not count");
    servo.step(MS, &ServoCommand { control: ServoControl::Disable, ..follow });
    assert_eq!(run(&mut servo, 10, &follow).report, Report::Operating);

    servo.raise_fault(FaultCause::OVER_CURRENT);
    let actual = servo.step(MS, &follow);
    assert_eq!((actual.report, actual.torque.0), (Report::Faulted, 0), "coasts at once");
}

#[test]
fn a_stronger_fault_overtakes_and_an_alarm_does_nothing() {
    let (mut servo, follow) = turning(Velocity(10 * UNIT));
    servo.raise_fault_with(FaultCause::COOLING, Reaction::Alarm);
    assert_eq!(servo.step(MS, &follow).report, Report::Operating);
    servo.raise_fault_with(FaultCause::BRAKE_SLIP, Reaction::HoldPosition);
    assert_eq!(run(&mut servo, 200, &follow).report, Report::Halted);
    servo.raise_fault(FaultCause::OVER_VOLTAGE);
    let actual = servo.step(MS, &follow);
    assert_eq!((actual.report, actual.fault), (Report::Faulted, Some(FaultCause::OVER_VOLTAGE)));
    servo.raise_fault(FaultCause::EXTERNAL_INPUT);
    assert_eq!(servo.step(MS, &follow).fault, Some(FaultCause::OVER_VOLTAGE), "the weaker does not overtake");
}

#[test]
fn a_hold_because_of_a_fault_ends_in_a_stop() {
    let (mut servo, follow) = turning(Velocity(10 * UNIT));
    servo.raise_fault_with(FaultCause::BRAKE_SLIP, Reaction::HoldPosition);
    run(&mut servo, 200, &follow);
    servo.clear_fault(FaultCause::BRAKE_SLIP);
    run(&mut servo, 1, &ServoCommand { reset_fault: true, ..follow });
    assert_eq!(run(&mut servo, 50, &follow).report, Report::Ready);
    assert_eq!(servo.step(MS, &follow).velocity, Velocity(0));
}

#[test]
fn the_drive_watches_position_error_overload_and_temperature() {
    let mut target = command(OperatingMode::Position);
    let mut servo = enabled(ServoParameters::default(), &target);
    target.position = Position(100 * UNIT);
    assert_eq!(run(&mut servo, 5, &target).fault, Some(FaultCause::EXCESSIVE_POSITION_ERROR));

    let stalled = |parameters| {
        let target = ServoCommand { torque: Torque(2_000_000), ..command(OperatingMode::Torque) };
        let mut servo = enabled(parameters, &target);
        servo.set_load(Torque(2_000_000));
        let mut ticks = 0;
        loop {
            let actual = servo.step(MS, &target);
            ticks += 1;
            if let Some(fault) = actual.fault {
                return (fault, ticks, actual);
            }
            assert!(ticks < 100_000);
        }
    };
    // Twice the current is four times the heat: 1.1 of it after 10 s * ln(4 / 2.9) = 3.22 s.
    let (fault, ticks, _) = stalled(ServoParameters::default());
    assert_eq!(fault, FaultCause::MOTOR_OVERLOAD);
    assert!((3_100..3_300).contains(&ticks), "{ticks}");
    // 25 and four times 80 degrees in the end; 60 after 1 s * ln(320 / 285) = 0.116 s.
    let quick = ServoParameters {
        thermal_time_constant: DurationNs::from_secs(1),
        max_temperature: Temperature(60_000),
        ..ServoParameters::default()
    };
    let (fault, ticks, actual) = stalled(quick);
    assert_eq!(fault, FaultCause::MOTOR_OVER_TEMPERATURE);
    assert!((100..130).contains(&ticks), "{ticks}");
    assert!(actual.temperature.0 > 59_000, "{}", actual.temperature);
}

#[test]
fn the_encoder_wraps_and_is_quantised() {
    let parameters =
        ServoParameters { encoder_counts: 1_000, encoder_bits: 12, ..ServoParameters::default() };
    let target = ServoCommand { velocity: Velocity(20 * UNIT), ..command(OperatingMode::Velocity) };
    let mut servo = enabled(parameters, &target);
    let mut tracker = crate::scaling::WrapTracker::of_bits(12).unwrap();
    let mut wraps = 0;
    let mut before = 0;
    for _ in 0..2_000 {
        let actual = servo.step(MS, &target);
        assert!((0..4_096).contains(&actual.encoder));
        assert_eq!(actual.position.0 % (UNIT / 1_000), 0, "quantised to a count");
        wraps += u32::from(actual.encoder < before);
        before = actual.encoder;
        assert_eq!(tracker.update(actual.encoder) * (UNIT / 1_000), actual.position.0);
    }
    assert!(wraps >= 9, "{wraps}");
}

/// A third of a nanounit in each sub-step still adds up.
#[test]
fn the_slowest_motion_is_not_lost() {
    let target = ServoCommand { velocity: Velocity(10_000), ..command(OperatingMode::Velocity) };
    let parameters = ServoParameters { coulomb_friction: Torque(0), ..ServoParameters::default() };
    let mut servo = enabled(parameters, &target);
    run(&mut servo, 500, &target);
    let before = servo.position().0;
    run(&mut servo, 1_000, &target);
    assert!((servo.position().0 - before - 10_000).abs() < 20, "{}", servo.position().0 - before);
}

#[test]
fn captures_are_exact_in_place_and_time() {
    let (mut servo, follow) = turning(Velocity(10 * UNIT));
    let start = servo.step(MS, &follow);
    let turn = start.position.0.div_euclid(UNIT);
    let watch = Position((turn + 2) * UNIT + UNIT / 4);
    let arm = |id, source| CaptureRequest::arm(id, source, CaptureEdge::Positive);
    servo.capture(CaptureRequest { watch_position: watch, ..arm(1, CaptureSource::WatchPosition) });
    servo.capture(CaptureRequest { auto_rearm: true, ..arm(2, CaptureSource::Marker) });
    servo.capture(arm(3, CaptureSource::HomeSwitch));
    servo.capture(arm(4, CaptureSource::HomeSwitchMarkerPositive));
    let home =
        CaptureWindow { from: Position((turn + 3) * UNIT + 7), to: Position((turn + 3) * UNIT + UNIT / 2) };
    servo.set_home_switch(Some(home));
    let mut results = Vec::new();
    let mut home_seen = false;
    for _ in 0..450 {
        let actual = servo.step(MS, &follow);
        home_seen |= actual.digital_inputs & input::HOME_SWITCH != 0;
        assert_eq!(actual.digital_inputs & input::HOME_SWITCH != 0, home.contains(servo.position()));
        results.extend(core::iter::from_fn(|| servo.poll_capture()));
    }
    assert!(home_seen);
    let of = |id| results.iter().filter(move |result| result.id == id).collect::<Vec<_>>();
    assert_eq!(of(1).iter().map(|result| result.position).collect::<Vec<_>>(), [watch]);
    let markers: Vec<_> = of(2).iter().map(|result| result.position.0).collect();
    assert_eq!(markers, (1..=4).map(|more| (turn + more) * UNIT).collect::<Vec<_>>());
    // 10 revolutions a second: a marker each 100 ms, to a microsecond.
    for pair in of(2).windows(2) {
        let apart = pair[1].at.since(pair[0].at).0;
        assert!((apart - 100 * MS).abs() < 1_000, "{apart}");
    }
    assert_eq!(of(3)[0].position, home.from);
    assert_eq!(of(4)[0].position, Position((turn + 4) * UNIT), "the first marker after the switch");
    assert!(results.iter().all(|result| result.status == CaptureStatus::Captured));
}

/// Forward and back over a home switch that begins a quarter turn before a marker, with marks on input 1.
#[test]
fn every_order_of_home_switch_and_marker_and_every_edge_of_a_mark() {
    let mut target = ServoCommand { velocity: Velocity(2 * UNIT), ..command(OperatingMode::Velocity) };
    let mut servo = enabled(ServoParameters::default(), &target);
    servo.set_home_switch(Some(CaptureWindow { from: Position(3 * UNIT / 4), to: Position(5 * UNIT / 4) }));
    servo.set_marks(
        1,
        Some(Marks { from: Position(500), length: Position(1_000), every: Some(Position(UNIT / 2)) }),
    );
    let source = |source| {
        [CaptureEdge::Positive, CaptureEdge::Negative].map(|edge| CaptureRequest::arm(0, source, edge))
    };
    let arm = |servo: &mut Servo, auto_rearm| {
        for request in [CaptureSource::HomeSwitchMarkerPositive, CaptureSource::HomeSwitchMarkerNegative]
            .into_iter()
            .flat_map(source)
        {
            servo.capture(request);
        }
        for request in source(CaptureSource::Registration1) {
            servo.capture(CaptureRequest { auto_rearm, ..request });
        }
    };
    let mut pass = |servo: &mut Servo, velocity, steps| {
        arm(servo, true);
        target.velocity = Velocity(velocity);
        let mut results = Vec::new();
        for _ in 0..steps {
            servo.step(MS, &target);
            results.extend(core::iter::from_fn(|| servo.poll_capture()));
        }
        assert!(results.is_sorted_by_key(|result| result.at));
        results.into_iter().map(|result| (result.source, result.edge, result.position.0)).collect::<Vec<_>>()
    };
    use CaptureEdge::{Negative as N, Positive as P};
    use CaptureSource::{HomeSwitchMarkerNegative as Hn, HomeSwitchMarkerPositive as Hp};
    let homes = |results: &[(CaptureSource, CaptureEdge, i64)]| {
        results.iter().filter(|result| result.0 != CaptureSource::Registration1).copied().collect::<Vec<_>>()
    };
    let width = 1_000_000;
    let there = pass(&mut servo, 2 * UNIT, 1_150);
    let expected =
        [(Hp, P, UNIT), (Hn, P, UNIT + width - 1), (Hp, N, 2 * UNIT), (Hn, N, 2 * UNIT + width - 1)];
    assert_eq!(homes(&there), expected);
    let marks: Vec<_> = there.iter().filter(|result| result.0 == CaptureSource::Registration1).collect();
    assert_eq!(marks[0].2.rem_euclid(UNIT / 2), 500);
    for (number, pair) in (0..).zip(marks.chunks(2)) {
        let place = marks[0].2 + number * UNIT / 2;
        assert_eq!([(pair[0].1, pair[0].2), (pair[1].1, pair[1].2)], [(P, place), (N, place + 999)]);
    }
    assert!(marks.len() >= 8, "{}", marks.len());
    let back = pass(&mut servo, -2 * UNIT, 1_400);
    let expected = [(Hp, P, UNIT + width - 1), (Hn, P, UNIT), (Hp, N, width - 1), (Hn, N, 0)];
    assert_eq!(homes(&back), expected, "a marker that is passed backward rises at its other end");
}

#[test]
fn registration_inputs_capture_on_their_edge_within_their_window() {
    let mut servo =
        Servo::new(ServoParameters { start_position: Position(55), ..ServoParameters::default() }).unwrap();
    servo.set_time(MonotonicTime(1_000));
    let outside = CaptureWindow { from: Position(60), to: Position(70) };
    servo.capture(CaptureRequest {
        window: Some(outside),
        ..CaptureRequest::arm(1, CaptureSource::Registration1, CaptureEdge::Positive)
    });
    servo.capture(CaptureRequest::arm(2, CaptureSource::Registration2, CaptureEdge::Negative));
    servo.set_registration(1, true);
    servo.set_registration(2, true);
    servo.set_registration(3, true);
    assert_eq!(servo.poll_capture(), None, "outside the window, and the wrong edge");
    servo.set_inputs(0b101);
    let actual = servo.step(MS, &ServoCommand::default());
    assert_eq!(
        actual.digital_inputs,
        input::REGISTRATION_1 | input::REGISTRATION_2 | 0b101 << input::USER_SHIFT
    );
    servo.set_registration(2, false);
    let result = servo.poll_capture().unwrap();
    assert_eq!((result.id, result.position, result.at), (2, Position(55), MonotonicTime(1_000 + 1_000_000)));
    servo.set_registration(2, true);
    servo.set_registration(2, false);
    assert_eq!(servo.poll_capture(), None, "once only");
    servo.capture(CaptureRequest::disarm(1, CaptureSource::Registration1, CaptureEdge::Positive));
    assert_eq!(servo.poll_capture().map(|result| result.status), Some(CaptureStatus::Disarmed));
}

#[test]
fn a_new_reference_moves_nothing() {
    let mut target = command(OperatingMode::Position);
    let mut servo = enabled(ServoParameters::default(), &target);
    target.position = Position(UNIT);
    run(&mut servo, 1_000, &target);
    servo.set_position(Position(7 * UNIT));
    target.position = Position(7 * UNIT);
    let actual = run(&mut servo, 100, &target);
    assert!((actual.position.0 - 7 * UNIT).abs() < UNIT / 100, "{}", actual.position);
    assert!(actual.velocity.0.abs() < UNIT / 10, "{}", actual.velocity);
}

#[test]
fn far_from_zero_it_moves_as_near_it() {
    let far = 9_000_000_000 * UNIT / 1_000 * 999;
    let shape = |start: i64| {
        let mut target = ServoCommand { position: Position(start), ..command(OperatingMode::Position) };
        let parameters = ServoParameters {
            start_position: Position(start),
            encoder_counts: 1_000_000,
            ..ServoParameters::default()
        };
        let mut servo = enabled(parameters, &target);
        target.position.0 += UNIT;
        (0..200).map(|_| servo.step(MS, &target).position.0 - start).collect::<Vec<_>>()
    };
    assert_eq!(shape(0), shape(far));
}

#[test]
fn parameters_that_cannot_work_are_refused() {
    let good = ServoParameters::default();
    let rows = [
        (ServoParameters { encoder_counts: 0, ..good }, ServoError::OutOfRange("encoder_counts")),
        (ServoParameters { encoder_bits: 63, ..good }, ServoError::OutOfRange("encoder_bits")),
        (ServoParameters { inertia: 0, ..good }, ServoError::OutOfRange("inertia")),
        (ServoParameters { inertia: i64::MAX, ..good }, ServoError::OutOfRange("inertia")),
        (
            ServoParameters { coulomb_friction: Torque(-1), ..good },
            ServoError::OutOfRange("coulomb_friction"),
        ),
        (
            ServoParameters { velocity_limit: Velocity(i64::MAX), ..good },
            ServoError::OutOfRange("velocity_limit"),
        ),
        (ServoParameters { velocity_gain: 2_000_000_000, ..good }, ServoError::Unstable("velocity_gain")),
        (ServoParameters { position_gain: 300_000_000, ..good }, ServoError::Unstable("position_gain")),
        (
            ServoParameters { velocity_integral_time: DurationNs::from_millis(1), ..good },
            ServoError::Unstable("velocity_integral_time"),
        ),
    ];
    for (parameters, error) in rows {
        assert_eq!(Servo::new(parameters).err(), Some(error));
    }
    let mut servo = Servo::new(good).unwrap();
    let other = ServoParameters { encoder_counts: 7, ..good };
    assert_eq!(servo.set_parameters(other), Err(ServoError::OutOfRange("motor and encoder")));
    assert_eq!(servo.parameters(), &good);
}

#[test]
fn gains_change_while_it_runs() {
    let mut target = command(OperatingMode::Position);
    let mut servo = enabled(ServoParameters::default(), &target);
    let stiffer = ServoParameters { position_gain: 100_000_000, ..ServoParameters::default() };
    servo.set_parameters(stiffer).unwrap();
    let mut actual = ServoActual::default();
    for _ in 0..1_000 {
        target.position.0 += UNIT / 100;
        actual = servo.step(MS, &target);
    }
    assert!((actual.following_error.0 - UNIT / 10).abs() < UNIT / 500, "{}", actual.following_error);
}

#[test]
fn any_step_length_gives_nearly_the_same_motion() {
    let land = |dt: i64| {
        let mut target = command(OperatingMode::Position);
        let mut servo = enabled(ServoParameters::default(), &target);
        target.position = Position(UNIT / 2);
        let mut highest = 0;
        for _ in 0..600 * MS / dt {
            let actual = servo.step(dt, &target);
            assert!(actual.velocity.0.abs() < 40 * UNIT, "unstable at {dt}: {}", actual.velocity);
            highest = highest.max(actual.position.0);
        }
        let last = servo.step(dt, &target).position.0;
        assert!((last - UNIT / 2).abs() < UNIT / 500, "{dt}: {}", Position(last));
        highest
    };
    for dt in [31_250, 62_500, 100_000, 250_000, 1_000_000, 2_000_000, 10_000_000] {
        let highest = land(dt);
        assert!(highest < UNIT * 56 / 100, "{dt}: {}", Position(highest));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Any commands: always the same motion for the same commands, torque and velocity within bounds, no
    /// panic.
    #[test]
    fn it_is_deterministic_and_bounded(
        steps in prop::collection::vec(
            (1..10_000_000_i64, 0..4_usize, 0..6_usize, any::<i64>(), 0..8_u8, any::<bool>()), 1..60,
        ),
    ) {
        let mut first = Servo::new(ServoParameters::default()).unwrap();
        let mut second = first.clone();
        run(&mut first, 300, &ServoCommand::default());
        run(&mut second, 300, &ServoCommand::default());
        for (dt, control, mode, value, bits, small) in steps {
            let value = if small { value >> 24 } else { value };
            let controls =
                [ServoControl::TorqueOff, ServoControl::Disable, ServoControl::Enable, ServoControl::Halt];
            let command = ServoCommand {
                control: controls[control],
                power: bits & 3 != 0,
                reset_fault: bits & 4 != 0,
                mode: OperatingMode::ALL[mode],
                position: Position(value),
                velocity: Velocity(value),
                acceleration: Acceleration(value),
                torque: Torque(value),
                velocity_offset: Velocity(value >> 4),
                torque_offset: Torque(value >> 8),
            };
            let actual = first.step(dt, &command);
            prop_assert_eq!(actual, second.step(dt, &command));
            prop_assert!(actual.torque.0.abs() <= 3_000_001, "{}", actual.torque);
            prop_assert!(actual.velocity.0.abs() <= 90 * UNIT, "{}", actual.velocity);
            if matches!(actual.report, Report::Ready | Report::Faulted | Report::AwaitingPower) {
                prop_assert_eq!(actual.torque, Torque(0));
            }
        }
    }
}

#[test]
fn a_jump_of_the_encoder_is_an_error_that_the_axis_follows_back() {
    let target = command(OperatingMode::Position);
    let mut servo = enabled(ServoParameters::default(), &target);
    run(&mut servo, 100, &target);
    servo.jump_position(Position(UNIT / 10));
    let jumped = servo.step(1, &target);
    assert!((jumped.position.0 - UNIT / 10).abs() < UNIT / 1000, "{}", jumped.position);
    let back = run(&mut servo, 500, &target);
    assert!(back.position.0.abs() < UNIT / 1000, "{}", back.position);
    servo.jump_position(Position(3 * UNIT));
    assert_eq!(servo.step(MS, &target).fault, Some(FaultCause::EXCESSIVE_POSITION_ERROR));
}

#[test]
fn frozen_feedback_stands_while_the_axis_moves_on() {
    let (mut servo, command) = turning(Velocity(2 * UNIT));
    let before = servo.step(MS, &command);
    servo.set_frozen(true);
    let frozen = run(&mut servo, 100, &command);
    assert_eq!((frozen.position, frozen.velocity), (before.position, before.velocity));
    assert!(frozen.at > before.at);
    servo.set_frozen(false);
    let moved = servo.step(MS, &command).position.0 - before.position.0;
    assert!((moved - 202 * UNIT / 1000).abs() < UNIT / 1000, "{moved}");
}

#[test]
fn a_warning_is_shown_and_stops_nothing() {
    let (mut servo, command) = turning(Velocity(2 * UNIT));
    servo.set_warning(Some(FaultCause::MOTOR_OVERLOAD));
    let warned = run(&mut servo, 10, &command);
    assert_eq!((warned.report, warned.warning), (Report::Operating, Some(FaultCause::MOTOR_OVERLOAD)));
    assert!(warned.status.contains(StatusBits::WARNING));
    servo.set_warning(None);
    assert!(!servo.step(MS, &command).status.contains(StatusBits::WARNING));
}

#[test]
fn the_drive_takes_its_time_to_be_ready_to_have_torque_and_to_move_its_brake() {
    let mut servo = Servo::new(ServoParameters::default()).unwrap();
    let slow = ServoParameters {
        power_up_time: DurationNs::from_millis(700),
        starting_time: DurationNs::from_millis(40),
        brake_time: DurationNs::from_millis(60),
        ..ServoParameters::default()
    };
    servo.set_parameters(slow).unwrap();
    assert_eq!(run(&mut servo, 700, &ServoCommand::default()).report, Report::AwaitingPower);
    assert_eq!(run(&mut servo, 200, &ServoCommand::default()).report, Report::Ready);
    let enable = command(OperatingMode::Velocity);
    let starting = run(&mut servo, 99, &enable);
    assert_eq!(starting.report, Report::Enabling);
    assert!(!starting.status.contains(StatusBits::BRAKE_RELEASED));
    assert_eq!(run(&mut servo, 2, &enable).report, Report::Operating);
    let disable = ServoCommand { control: ServoControl::Disable, ..enable };
    let closing = run(&mut servo, 59, &disable);
    assert_eq!(closing.report, Report::Stopping);
    assert!(!closing.status.contains(StatusBits::BRAKE_RELEASED));
    assert_eq!(run(&mut servo, 4, &disable).report, Report::Ready);
    let negative = ServoParameters { power_up_time: DurationNs(-1), ..slow };
    assert_eq!(servo.set_parameters(negative), Err(ServoError::OutOfRange("power_up_time")));
}

/// An axis that rests passes a long step at once. It must show what it shows when it takes every sub-step.
#[test]
fn resting_axis_shows_the_same_in_long_and_short_steps() {
    for power in [true, false] {
        let mut long = Servo::new(ServoParameters::default()).unwrap();
        let command = ServoCommand { power, ..ServoCommand::default() };
        let mut short = long.clone();
        for _ in 0..2_500 {
            let at_once = long.step(2_000_000, &command);
            let mut in_parts = ServoActual::default();
            for _ in 0..64 {
                in_parts = short.step(31_250, &command);
            }
            assert_eq!(at_once, in_parts);
        }
        assert_eq!(long.step(1, &command).report, if power { Report::Ready } else { Report::AwaitingPower });
    }
}
