use super::*;
use crate::cast;
use crate::image::Signal::{AccelerationCommand, PositionCommand, TorqueCommand, VelocityCommand};
use proptest::prelude::*;

const PERIOD: DurationNs = DurationNs::from_millis(2);
const EPOCH: MonotonicTime = MonotonicTime(1_700_000_000_000);

fn interpolator(target_update: TargetUpdate, extrapolate_periods: u32) -> FineInterpolator {
    let config = InterpolatorConfig { target_update, period: PERIOD, extrapolate_periods };
    FineInterpolator::new(config).unwrap()
}

/// The instant `periods` and `part` thousandths after the epoch.
fn time(periods: i64, part: i64) -> MonotonicTime {
    EPOCH + PERIOD * periods + DurationNs(PERIOD.0 / 1000 * part)
}

/// A command with these set-points and nothing else.
fn commanded<const N: usize>(values: [(Signal, i64); N]) -> AxisCommand {
    let mut command = AxisCommand::default();
    for (signal, value) in values {
        assert!(command.set(signal, value));
    }
    command
}

fn position(value: i64) -> AxisCommand {
    commanded([(PositionCommand, value)])
}

fn fine(interpolator: &mut FineInterpolator, now: MonotonicTime) -> (AxisCommand, Quality) {
    let mut command = AxisCommand::default();
    let quality = interpolator.write(now, &mut command);
    (command, quality)
}

fn quality_at(interpolator: &mut FineInterpolator, now: MonotonicTime) -> Quality {
    fine(interpolator, now).1
}

fn position_at(interpolator: &mut FineInterpolator, now: MonotonicTime) -> i64 {
    fine(interpolator, now).0.get(PositionCommand).unwrap()
}

fn velocity_at(interpolator: &mut FineInterpolator, now: MonotonicTime) -> Option<i64> {
    fine(interpolator, now).0.get(VelocityCommand)
}

/// An interpolator that took `values` for targets 1, 2, 3... and was started at 0.
fn fed(values: &[i64]) -> FineInterpolator {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
    interpolator.start(Some(Position(0)));
    for (target, value) in (1..).zip(values) {
        interpolator.update(time(target, 0), &position(*value)).unwrap();
    }
    interpolator
}

#[test]
fn targets_follow_the_stamp_by_the_stated_periods() {
    let stamps = [TargetUpdate::Immediate, TargetUpdate::Extrapolate, TargetUpdate::Interpolate];
    assert_eq!(stamps.map(|update| update.target(EPOCH, PERIOD).since(EPOCH).0), [0, 2_000_000, 4_000_000]);
}

#[test]
fn configurations_outside_their_limits_are_refused() {
    let good =
        InterpolatorConfig { target_update: TargetUpdate::default(), period: PERIOD, extrapolate_periods: 4 };
    assert!(FineInterpolator::new(good).is_some());
    for bad in [
        InterpolatorConfig { period: DurationNs(0), ..good },
        InterpolatorConfig { period: MAX_PERIOD + DurationNs(1), ..good },
        InterpolatorConfig { extrapolate_periods: MAX_EXTRAPOLATION + 1, ..good },
    ] {
        assert!(FineInterpolator::new(bad).is_none());
    }
}

/// The coefficients of Volume 9, 5-2.6.5.2, worked by hand for P-3..P0 = 0, 60, 240, 600 and half a period:
/// dP = 360, dV = 180, dA = 60; 240 + (360 - 90 - 10)/2 + 90/4 + 10/8 = 393.75.
#[test]
fn the_cubic_has_the_coefficients_of_the_standard() {
    let mut interpolator = fed(&[60, 240, 600]);
    assert_eq!(position_at(&mut interpolator, time(2, 0)), 240);
    assert_eq!(position_at(&mut interpolator, time(2, 500)), 394);
    assert_eq!(position_at(&mut interpolator, time(3, 0)), 600);
    // Slope at the end: (260 + 2*90 + 3*10) in 2 ms.
    assert_eq!(velocity_at(&mut interpolator, time(3, 0)), Some(470 * 500));
}

/// For V-2..V0 = 0, 100, 400: dV = 300, dA = 200; 100 + (300 - 100)/2 + 100/4 = 225.
#[test]
fn velocity_is_quadratic_and_torque_linear() {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
    interpolator.start(None);
    for (target, velocity, torque) in [(1, 0, 0), (2, 100, 50), (3, 400, 60)] {
        let set_points =
            commanded([(VelocityCommand, velocity), (TorqueCommand, torque), (AccelerationCommand, -torque)]);
        interpolator.update(time(target, 0), &set_points).unwrap();
    }
    let (fine, _) = fine(&mut interpolator, time(2, 500));
    assert_eq!(fine, commanded([(VelocityCommand, 225), (TorqueCommand, 55), (AccelerationCommand, -55)]));
}

#[test]
fn a_commanded_velocity_is_preferred_to_the_derivative() {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
    interpolator.start(Some(Position(0)));
    let set_points = commanded([(PositionCommand, 1_000_000), (VelocityCommand, 7)]);
    interpolator.update(time(1, 0), &set_points).unwrap();
    assert_eq!(velocity_at(&mut interpolator, time(0, 500)), Some(7));
    assert_eq!(position_at(&mut interpolator, time(0, 500)), 500_000);
}

#[test]
fn the_order_grows_with_the_values_known() {
    // One value after the start: a line. Two: a parabola; 100 + (200 - 50)/2 + 50/4 = 187.5.
    assert_eq!(position_at(&mut fed(&[100]), time(0, 250)), 25);
    assert_eq!(position_at(&mut fed(&[100, 300]), time(1, 500)), 188);
}

#[test]
fn a_segment_begins_at_its_own_time_and_not_when_it_arrives() {
    let mut interpolator = fed(&[1_000, 2_000, 3_000]);
    for (periods, part, expected) in
        [(0, 0, 0), (0, 500, 500), (1, 0, 1_000), (1, 999, 1_999), (2, 500, 2_500)]
    {
        assert_eq!(position_at(&mut interpolator, time(periods, part)), expected, "{periods}.{part}");
    }
}

#[test]
fn before_the_first_update_the_start_is_held() {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 1);
    interpolator.start(Some(Position(42)));
    assert_eq!(fine(&mut interpolator, time(1_000, 0)), (position(42), Quality::Waiting));
}

#[test]
fn immediate_takes_updates_as_they_come() {
    let mut interpolator = interpolator(TargetUpdate::Immediate, 1);
    interpolator.start(Some(Position(0)));
    interpolator.update(time(0, 0), &position(500)).unwrap();
    for part in [0, 500, 1_000, 2_000] {
        let expected = commanded([(PositionCommand, 500), (VelocityCommand, 0)]);
        assert_eq!(fine(&mut interpolator, time(0, part)), (expected, Quality::Fresh), "{part}");
    }
    interpolator.update(time(1, 0), &position(-500)).unwrap();
    assert_eq!(position_at(&mut interpolator, time(1, 0)), -500);
    assert_eq!(quality_at(&mut interpolator, time(3, 1)), Quality::Extrapolated { periods: 1 });
    assert_eq!(quality_at(&mut interpolator, time(4, 1)), Quality::Lost);
}

/// Updates stop: the polynomial goes on for the stated periods, then everything stands and says so.
#[test]
fn a_loss_is_ridden_through_and_then_held() {
    for (update, usual) in [(TargetUpdate::Extrapolate, 1), (TargetUpdate::Interpolate, 0)] {
        for allowed in 0..=MAX_EXTRAPOLATION {
            let mut interpolator = interpolator(update, allowed);
            interpolator.start(Some(Position(0)));
            for target in 1..=5 {
                interpolator.update(time(target, 0), &position(target * 1_000)).unwrap();
            }
            let last = 5 + usual + i64::from(allowed);
            let mut highest = 0;
            for step in 0..20_000 {
                let now = time(4, step);
                let (command, shown) = fine(&mut interpolator, now);
                let beyond = now.since(time(5 + usual, 0)).0.max(0);
                let overdue = u32::try_from((beyond + PERIOD.0 - 1) / PERIOD.0).unwrap();
                let quality = match overdue {
                    0 => Quality::Fresh,
                    periods if periods <= allowed => Quality::Extrapolated { periods },
                    _ => Quality::Lost,
                };
                assert_eq!(shown, quality, "{update} {allowed} {step}");
                let moved = command.get(PositionCommand).unwrap();
                assert!(moved >= highest && moved <= last * 1_000, "{update} {allowed} {step}: {moved}");
                highest = moved;
                let speed = if quality == Quality::Lost { 0 } else { 500_000 };
                assert_eq!(command.get(VelocityCommand), Some(speed), "{update} {allowed} {step}");
            }
            assert_eq!(highest, last * 1_000, "goes on to the limit and not beyond");
            assert_eq!(position_at(&mut interpolator, time(4, 0)), highest, "time stepped back");
            assert_eq!(interpolator.update(time(30, 0), &position(0)), Err(UpdateError::Lost));
            interpolator.start(Some(Position(9)));
            assert_eq!(interpolator.update(time(30, 0), &position(9)), Ok(()));
        }
    }
}

/// Set-points that are made ahead of their instant: an update is overdue when it is not there in time, and not when it could not
/// be there yet. As many as the limit says are ridden through at constant speed, without a step when the next one comes.
#[test]
fn set_points_made_ahead_are_not_overdue_for_that() {
    for tenths in [0, 5, 11, 22, 44] {
        let ahead = DurationNs(PERIOD.0 / 10 * tenths);
        let mut interpolator = interpolator(TargetUpdate::Interpolate, MAX_EXTRAPOLATION);
        interpolator.start(Some(Position(0)));
        // Each update comes half a period behind its stamp; those of 11 to 14 are lost.
        let mut last = None;
        for step in 0..200_i64 {
            let now = time(0, step * 100);
            if step % 10 == 5 && !(11..15).contains(&(step / 10)) {
                let target = step / 10 + 2;
                interpolator.update(time(target, 0), &position(target * 1_000)).unwrap();
            }
            let mut command = AxisCommand::default();
            let quality = interpolator.write_ahead(now + ahead, ahead, &mut command);
            assert_ne!(quality, Quality::Lost, "{ahead} {step}");
            let moved = command.get(PositionCommand).unwrap();
            if let Some(before) = last.replace(moved).filter(|_| step > 60) {
                assert_eq!(moved - before, 100, "{ahead} {step}");
            }
        }
    }
}

#[test]
fn without_updates_an_axis_never_gets_faster_and_goes_on_slowing_down() {
    // Speeding up by 1000 more each period, then silence: it goes on as fast as it was, no faster.
    let mut rising = fed(&[0, 1_000, 3_000, 6_000, 10_000, 15_000]);
    let end = position_at(&mut rising, time(6, 0));
    let fastest = position_at(&mut rising, time(7, 0)) - end;
    assert!((5_000..6_000).contains(&fastest), "{fastest}");
    assert_eq!(position_at(&mut rising, time(8, 0)) - end, 2 * fastest);
    // Slowing down by 1000 less each period: it stands where that leads, and does not turn back.
    let mut falling = fed(&[0, 5_000, 9_000, 12_000, 14_000]);
    let rest = position_at(&mut falling, time(6, 800));
    assert!((15_000..=15_200).contains(&rest), "{rest}");
    assert_eq!(position_at(&mut falling, time(7, 0)), rest);
    assert_eq!(velocity_at(&mut falling, time(7, 0)), Some(0));
}

#[test]
fn velocity_and_torque_go_to_zero_after_a_loss() {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 0);
    interpolator.start(None);
    let set_points = commanded([(VelocityCommand, 9), (TorqueCommand, 8)]);
    interpolator.update(time(1, 0), &set_points).unwrap();
    assert_eq!(fine(&mut interpolator, time(1, 0)).0, set_points);
    let expected = commanded([(VelocityCommand, 0), (TorqueCommand, 0)]);
    assert_eq!(fine(&mut interpolator, time(1, 1)).0, expected);
}

#[test]
fn a_lost_update_is_bridged() {
    let mut interpolator = fed(&[1_000, 2_000, 3_000]);
    // Target 4 never comes; 5 does, while the polynomial is still being followed.
    assert_eq!(quality_at(&mut interpolator, time(3, 500)), Quality::Extrapolated { periods: 1 });
    interpolator.update(time(5, 0), &position(5_000)).unwrap();
    for (periods, part, expected) in [(3, 500, 3_500), (4, 0, 4_000), (4, 500, 4_500), (5, 0, 5_000)] {
        assert_eq!(position_at(&mut interpolator, time(periods, part)), expected, "{periods}.{part}");
        assert_eq!(quality_at(&mut interpolator, time(periods, part)), Quality::Fresh);
    }
}

/// Updates are lost again and again while an axis accelerates: what an estimate was wrong by is taken back with the next
/// update, and is no part of the curve from there on. The velocity is wrong by what the acceleration makes of the periods
/// without an update, and never by more because others were lost before.
#[test]
fn errors_of_estimates_do_not_add_up() {
    // Nanounits per period squared, and which updates of a row that comes round again are lost.
    const ACCELERATION: i64 = 2_000_000;
    let rows: [&[bool]; 6] = [
        &[false, true],
        &[false, true, true],
        &[false, true, false, true, true],
        &[false, true, true, false, true],
        &[false, false, true, false, true, true, false, true],
        &[false, true, true, true, false, true],
    ];
    for row in rows {
        let longest = row.split(|lost| !lost).map(<[bool]>::len).max().unwrap_or(0);
        let longest = i64::try_from(longest).unwrap();
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 4);
        interpolator.start(Some(Position(0)));
        let curve = |periods: i64| ACCELERATION * periods * periods / 2;
        let (mut before, mut worst) = (0, 0);
        for period in 1..80_i64 {
            let lost = period > 8 && row[usize::try_from(period).unwrap() % row.len()];
            if !lost {
                interpolator.update(time(period, 0), &position(curve(period))).unwrap();
            }
            for part in [250, 500, 750, 1_000] {
                let now = position_at(&mut interpolator, time(period - 1, part));
                // Nanounits in a period, less what the controller does.
                let velocity = (now - before) * 4;
                let meant = ACCELERATION * (8 * (period - 1) + part / 125 - 1) / 8;
                worst = worst.max((velocity - meant).abs());
                before = now;
            }
        }
        let bound = ACCELERATION * (longest + 1) * (longest + 2) / 2;
        assert!(worst <= bound, "{row:?}: the velocity is wrong by {worst}, expected {bound} at most");
    }
}

#[test]
fn stamps_that_cannot_be_right_are_refused_and_leave_no_trace() {
    let mut interpolator = fed(&[1_000, 2_000, 3_000]);
    let last = time(3, 0);
    for target in [time(3, 0), time(2, 0), time(3, 499)] {
        let refused = interpolator.update(target, &position(9_999));
        assert_eq!(refused, Err(UpdateError::NotNewer { last, target }));
    }
    let target = time(3 + MAX_GAP + 1, 0);
    assert_eq!(interpolator.update(target, &position(9_999)), Err(UpdateError::Gap { last, target }));
    let target = MonotonicTime::MAX;
    assert_eq!(interpolator.update(target, &position(9_999)), Err(UpdateError::Gap { last, target }));
    assert_eq!(interpolator.update(time(4, 0), &position(i64::MAX)), Err(UpdateError::Jump));
    interpolator.update(time(4, 0), &position(4_000)).unwrap();
    assert_eq!(position_at(&mut interpolator, time(3, 500)), 3_500);
}

/// A controller whose clock is ahead: its updates come long before their time, and each is served at its own (M4).
#[test]
fn updates_far_ahead_of_their_time_wait_for_it() {
    for ahead in [0, 1, 2, 4, 10] {
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
        interpolator.start(Some(Position(0)));
        for period in 1..60_i64 {
            interpolator
                .update(time(period + 2 + ahead, 0), &position((period + 2 + ahead) * 1_000))
                .unwrap();
            for part in [0, 250, 500, 750] {
                let expected = period * 1_000 + part;
                if period > 4 + ahead {
                    assert_eq!(position_at(&mut interpolator, time(period, part)), expected, "{ahead}");
                }
            }
        }
    }
}

#[test]
fn an_update_for_which_there_is_no_room_is_refused_and_the_curve_in_use_goes_on() {
    let mut interpolator = fed(&[1_000, 2_000]);
    assert_eq!(position_at(&mut interpolator, time(0, 500)), 500);
    let mut refused = None;
    for target in 3..40 {
        if let Err(error) = interpolator.update(time(target, 0), &position(target * 1_000)) {
            refused.get_or_insert((target, error));
        }
    }
    assert_eq!(refused, Some((17, UpdateError::Ahead { target: time(17, 0) })));
    for (periods, part) in [(0, 500), (1, 500), (9, 250), (16, 0)] {
        assert_eq!(position_at(&mut interpolator, time(periods, part)), periods * 1_000 + part);
    }
}

#[test]
fn set_points_that_are_not_commanded_become_absent_and_nothing_else_changes() {
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
    interpolator.start(None);
    let mut command = commanded([(PositionCommand, 5), (TorqueCommand, 6), (Signal::TorqueOffset, 7)]);
    let offset = commanded([(Signal::TorqueOffset, 7)]);
    interpolator.write(time(0, 0), &mut command);
    assert_eq!((command.present, command.torque_offset), (offset.present, Torque(7)), "none is held");
    interpolator.update(time(1, 0), &commanded([(VelocityCommand, 8)])).unwrap();
    interpolator.write(time(1, 0), &mut command);
    assert_eq!((command.velocity, command.torque_offset), (Velocity(8), Torque(7)));
    assert_eq!(command.present, offset.present | VelocityCommand.command_bit());
}

proptest! {
    /// Whatever comes, at each target the value is exactly the one sent, and neighbouring segments meet.
    #[test]
    fn every_target_is_met(steps in prop::collection::vec(-(1_i64 << 40)..1 << 40, 1..30)) {
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 0);
        interpolator.start(Some(Position(0)));
        let mut value = 0;
        for (target, step) in (1..).zip(steps) {
            let before = value;
            value += step;
            interpolator.update(time(target, 0), &position(value)).unwrap();
            prop_assert_eq!(position_at(&mut interpolator, time(target - 1, 0)), before);
            prop_assert_eq!(position_at(&mut interpolator, time(target, 0)), value);
        }
    }

    /// The fixed point stays within a nanounit of the polynomial in doubles where doubles are good enough.
    #[test]
    fn the_fixed_point_is_accurate(
        values in prop::array::uniform4(-(1_i64 << 34)..1 << 34), part in 0..1_000_i64,
    ) {
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
        interpolator.start(Some(Position(values[0])));
        for (target, value) in (1..).zip(&values[1..]) {
            interpolator.update(time(target, 0), &position(*value)).unwrap();
        }
        let [p3, p2, p1, p0] = values.map(cast::f64_from_i64);
        let s = cast::f64_from_i64(part) / 1000.0;
        let (d1, d2, d3) = (p0 - p1, p0 - 2.0 * p1 + p2, p0 - 3.0 * p1 + 3.0 * p2 - p3);
        let exact = p1 + (d1 - d2 / 2.0 - d3 / 6.0) * s + d2 / 2.0 * s * s + d3 / 6.0 * s * s * s;
        let fine = position_at(&mut interpolator, time(2, part));
        prop_assert!((cast::f64_from_i64(fine) - exact).abs() <= 1.0, "{fine} {exact}");
    }

    /// Nothing that comes off a wire makes it panic.
    #[test]
    fn any_input_is_survived(
        updates in prop::collection::vec((any::<u64>(), any::<i64>(), any::<i64>()), 1..40),
        spread in 0..64_u32,
    ) {
        let mut interpolator = interpolator(TargetUpdate::Extrapolate, MAX_EXTRAPOLATION);
        interpolator.start(Some(Position(0)));
        for (time, place, speed) in updates {
            let time = MonotonicTime(time >> spread);
            let (place, speed) = (place >> (spread / 2), speed >> (spread / 2));
            let set_points = commanded([(PositionCommand, place), (VelocityCommand, speed)]);
            if interpolator.update(time, &set_points) == Err(UpdateError::Lost) {
                interpolator.start(None);
            }
            fine(&mut interpolator, time);
            fine(&mut interpolator, MonotonicTime(time.0.wrapping_mul(3)));
        }
    }
}

/// A trajectory with a bounded acceleration: position, velocity and acceleration `periods` thousandths after the epoch.
fn swing(at: MonotonicTime) -> Motion {
    // One swing in 0.4 s, 0.2 units to either side: at most 49.3 units per second squared.
    let angle = cast::f64_from_i64(at.since(EPOCH).0) / 1e9 * SWING;
    let nano = |value: f64| cast::i64_from_f64(value * 1e9);
    Motion {
        position: Position(nano(0.2 * angle.sin())),
        velocity: Velocity(nano(0.2 * SWING * angle.cos())),
        acceleration: Acceleration(nano(-0.2 * SWING * SWING * angle.sin())),
        torque: Torque::ZERO,
    }
}

const SWING: f64 = std::f64::consts::TAU / 0.4;

proptest! {
    /// Control mode and Command Target Update change while the axis moves: the velocity never steps by more than the
    /// trajectory's own acceleration allows in that time, with the factor by which a cubic through sampled values
    /// overshoots it.
    #[test]
    fn changes_of_mode_and_target_on_the_move_do_not_step(
        changes in prop::collection::vec((any::<bool>(), any::<bool>(), 1..12_i64), 1..12),
    ) {
        const FINE: DurationNs = DurationNs::from_micros(250);
        let mode = |velocity| if velocity { OperatingMode::Velocity } else { OperatingMode::Position };
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 4);
        interpolator.start_moving(EPOCH, &swing(EPOCH));
        let (mut period, mut by_velocity) = (0, false);
        let mut last: Option<i64> = None;
        for (velocity, extrapolate, periods) in changes {
            let update = if extrapolate { TargetUpdate::Extrapolate } else { TargetUpdate::Interpolate };
            for number in 0..periods {
                // The update stamped at the start of this period arrives a little later.
                let (stamp, arrives) = (time(period, 0), time(period, 100));
                if number == 0 && (velocity != by_velocity || update != interpolator.config().target_update) {
                    let modes = (mode(by_velocity), mode(velocity));
                    interpolator.change(arrives, update, modes, &swing(arrives));
                    by_velocity = velocity;
                }
                let target = update.target(stamp, PERIOD);
                let aim = swing(target);
                let points = if velocity {
                    commanded([(VelocityCommand, aim.velocity.get())])
                } else {
                    position(aim.position.get())
                };
                prop_assert!(!matches!(interpolator.update(target, &points), Err(UpdateError::Jump | UpdateError::Lost)));
                let mut now = arrives;
                while now < time(period + 1, 100) {
                    let speed = velocity_at(&mut interpolator, now).unwrap();
                    if let Some(last) = last {
                        // 50 units/s2 for 0.25 ms, four times.
                        prop_assert!((speed - last).abs() < 4 * 50_000_000_000 / 4_000, "{speed} after {last}");
                    }
                    let error = (speed - swing(now).velocity.get()).abs();
                    prop_assert!(error < 100_000_000, "{error} off the trajectory");
                    last = Some(speed);
                    now = now + FINE;
                }
                period += 1;
            }
        }
    }
}

#[test]
fn a_motion_goes_on_until_the_first_update_after_a_change() {
    let moving = Motion { position: Position(1_000), velocity: Velocity(500_000), ..Motion::default() };
    let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
    interpolator.start_moving(EPOCH, &moving);
    // 500000 a second are 1000 in a period of 2 ms.
    assert_eq!(position_at(&mut interpolator, time(0, 500)), 1_500);
    interpolator.update(time(2, 0), &position(3_000)).unwrap();
    assert_eq!(position_at(&mut interpolator, time(1, 0)), 2_000);
    assert_eq!(position_at(&mut interpolator, time(1, 500)), 2_500);
    // Then by velocity, from the velocity that there is.
    let modes = (OperatingMode::Position, OperatingMode::Velocity);
    interpolator.change(time(1, 500), TargetUpdate::Extrapolate, modes, &Motion::default());
    assert_eq!(velocity_at(&mut interpolator, time(1, 500)), Some(500_000));
    let points = commanded([(VelocityCommand, 500_000)]);
    interpolator.update(time(2, 0), &points).unwrap();
    assert_eq!(fine(&mut interpolator, time(1, 750)).0, points);
    // Before the first update there is nothing to carry on.
    interpolator.start(Some(Position(7)));
    interpolator.change(time(3, 0), TargetUpdate::Interpolate, modes, &moving);
    assert_eq!(fine(&mut interpolator, time(3, 0)), (position(7), Quality::Waiting));
}

/// On the move from one mode to another: what led the axis counts, and feed-forward values beside it do not.
#[test]
fn a_change_of_mode_begins_in_the_motion_that_there_is() {
    use OperatingMode::{Position as ByPosition, Torque as ByTorque, Velocity as ByVelocity};
    // The controller's curve, where one leads, is at 500 000 and slower than the axis; the drive gives 30 % of torque.
    let actual = Motion {
        position: Position(70_000),
        velocity: Velocity(600_000),
        torque: Torque(300_000),
        ..Motion::default()
    };
    let begin = |from, to| {
        let mut interpolator = interpolator(TargetUpdate::Interpolate, 2);
        interpolator.start(Some(Position(1_000)));
        for period in 0..4_i64 {
            let points = commanded([
                (PositionCommand, 1_000 * (period + 1)),
                (VelocityCommand, if from == ByVelocity { 500_000 } else { 0 }),
                (AccelerationCommand, 0),
                (TorqueCommand, if from == ByTorque { 100_000 } else { 20_000 }),
            ]);
            interpolator.update(time(period, 0), &points).unwrap();
        }
        interpolator.change(time(3, 0), TargetUpdate::Interpolate, (from, to), &actual);
        let (points, _) = fine(&mut interpolator, time(3, 0));
        let get = |signal| points.get(signal).unwrap();
        (get(PositionCommand), get(VelocityCommand), get(TorqueCommand))
    };
    assert_eq!(begin(ByPosition, ByVelocity), (4_000, 500_000, 20_000));
    assert_eq!(begin(ByPosition, ByTorque), (4_000, 500_000, 20_000));
    assert_eq!(begin(ByVelocity, ByPosition), (70_000, 500_000, 20_000));
    assert_eq!(begin(ByVelocity, ByTorque), (70_000, 500_000, 20_000));
    assert_eq!(begin(ByTorque, ByPosition), (70_000, 600_000, 100_000));
    assert_eq!(begin(ByTorque, ByVelocity), (70_000, 600_000, 100_000));
    // The same mode for another target goes on as it was commanded.
    assert_eq!(begin(ByVelocity, ByVelocity), (4_000, 500_000, 20_000));
    assert_eq!(begin(ByTorque, ByTorque), (4_000, 0, 100_000));
}
