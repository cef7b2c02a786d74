//! The motion checker finds what is known to be wrong with the motion of the gateway. Each test declares its finding: when
//! it is mended and deleted in `rig::motion_checker::known`, the same test shows that nothing is violated any more.

use axisbridge_tests::rig::motion::{TURNTABLE, in_motion, long_moves, millis};
use axisbridge_tests::rig::motion_checker::MotionChecker;
use axisbridge_tests::rig::motion_checker::known::Known;
use axisbridge_tests::rig::motion_checker::violation::Rule;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::time::DurationNs;
use profile_sercos::checker::checked_bus::Tried;
use profile_sercos::checker::{self, Violation};

/// What the axes do while nothing disturbs them is on the curve to the resolution of the drives.
#[test]
fn an_undisturbed_motion_violates_nothing() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(long_moves());
    assert_eq!(rig.run(millis(20_000)).failure, None);
    assert_eq!(rig.motion_checker.violations(), []);
    let statistics = rig.motion_checker.statistics(0);
    assert!(statistics.set_points > 2_000, "{statistics:?}");
    assert!(statistics.percent(statistics.ripple()) < 0.01, "{statistics:?}");
    assert!((statistics.fastest - 5e9).abs() < 1e3, "{statistics:?}");
}

/// An engine that wakes up late sends its MST late.
fn late(violation: &Violation) -> bool {
    matches!(violation.rule, checker::Rule::MstInterval { .. })
}

/// M1: wake-ups that are late by up to 0.2 ms make noise of the velocity.
#[test]
fn set_points_are_made_for_the_grid_and_not_for_the_wake_up() {
    let mut rig = in_motion(Settings::default());
    rig.motion_checker.expect(Known::M1);
    rig.wake_ups.jitter = DurationNs::from_micros(200);
    rig.breaking(late, |rig| rig.run_for(millis(300)));
}

/// M2: behind a pause of the engine the drive gets the way of the pause in one cycle.
#[test]
fn no_step_behind_a_pause_is_faster_than_the_limit() {
    let mut settings = Settings::default();
    let limits = "[axis.limits]\nfollowing_error = 0.5";
    assert!(settings.configuration.contains(limits));
    settings.configuration =
        settings.configuration.replace(limits, "[axis.limits]\nvelocity = 6.0\nfollowing_error = 0.5");
    let mut rig = in_motion(settings);
    rig.motion_checker.expect_as(Known::M2, |found| found.rule == Rule::Limit);
    // The drives bridge two lost cycles.
    rig.wake_ups.pause(rig.now() + DurationNs::from_micros(5_900));
    rig.breaking(late, |rig| rig.run_for(millis(100)));
}

/// M3: a step of the gateway's system time is one of the set-points.
#[test]
fn a_step_of_system_time_is_no_step_of_the_axis() {
    for step in [20, -20] {
        let mut rig = in_motion(Settings::default());
        rig.motion_checker.expect(Known::M3);
        rig.gateway_clock.step(rig.now(), millis(step));
        rig.run_for(millis(300));
    }
}

/// Nor is a step below the Step Threshold (class attribute 35, 1 ms), of both clocks one after the other: it is worked off by a
/// thousandth of the time (clause 2-2.2).
#[test]
fn a_small_step_of_system_time_is_worked_off() {
    const SLEW: f64 = 1.1e-3;
    let worked_off = |found: &axisbridge_tests::rig::motion_checker::violation::Violation| {
        let speed = [5.0, 200.0][found.axis];
        let beyond = (found.value - found.high).max(found.low - found.value);
        // In cycles of 2 ms, from one way to the other.
        let allowed = match found.rule {
            Rule::Velocity => SLEW * speed,
            Rule::Acceleration => 2.0 * SLEW * speed / 0.002,
            _ => 0.0,
        };
        beyond <= allowed
    };
    for (step, apart) in
        [-101, 101, 300, -900].into_iter().flat_map(|step| [0, 1, 3, 40].map(|apart| (step, apart)))
    {
        for gateway_first in [true, false] {
            let step = DurationNs::from_micros(step);
            let mut rig = in_motion(Settings::default());
            rig.motion_checker.tolerate("clause 2-2.2", worked_off);
            for gateway in [gateway_first, !gateway_first] {
                let now = rig.now();
                if gateway {
                    rig.gateway_clock.step(now, step);
                } else {
                    rig.controller_clock.step(now, step);
                }
                rig.run_for(millis(apart));
            }
            rig.run_for(millis(300));
        }
    }
}

/// M4: the targets of a controller that has got three periods ahead wait in an interpolator that has no room for them.
#[test]
fn a_controller_clock_that_is_ahead_is_served_or_refused() {
    let mut rig = in_motion(Settings::default());
    // 20 ms in a second, up to 12 ms.
    rig.controller_clock.drift(rig.now(), 20_000_000);
    rig.motion_checker.expect(Known::M4);
    rig.run_for(millis(600));
    rig.controller_clock.drift(rig.now(), 0);
    rig.run_for(millis(300));
}

/// From torque to velocity control on the move the axis goes on at the speed that it has: the velocity beside the torque was none of it.
#[test]
fn velocity_control_of_an_axis_that_moves_begins_at_its_speed() {
    let mut rig = Rig::ready(Settings::default());
    let axis = AxisSet::one(1);
    rig.connect(vec![
        Step::Enable(axis),
        Step::Mode { axis: 1, mode: ControlMode::TORQUE },
        Step::Torque { axis: 1, torque: 10.0, rate: 100.0, velocity_limit: 20.0 },
        Step::Dwell { seconds: 0.1 },
        Step::Mode { axis: 1, mode: ControlMode::VELOCITY },
        Step::Stop { axis: 1, acceleration: 20.0, jerk: 400.0 },
        Step::Disable(axis),
    ]);
    assert_eq!(rig.run(millis(20_000)).failure, None);
    assert_eq!(rig.motion_checker.violations(), []);
}

/// M5: without a shared clock set-points stand until the next update.
#[test]
fn asynchronous_operation_is_no_staircase() {
    let mut rig = Rig::ready(Settings::default());
    let mut config = rig.controller_config();
    config.grand_master = None;
    config.rpi_us = 8_000;
    rig.motion_checker.expect(Known::M5);
    let turn = Step::MoveAbsolute { axis: 1, position: 2.0, limits: TURNTABLE };
    rig.connect_with(config, vec![Step::Enable(AxisSet::one(1)), turn, Step::Disable(AxisSet::one(1))]);
    assert_eq!(rig.run(millis(10_000)).failure, None);
}

#[test]
#[should_panic(expected = "no motion was violated though it was declared: a reason")]
fn a_declared_violation_has_to_come() {
    let mut checker = MotionChecker::default();
    checker.allow("a reason", |_| true);
}

/// A frame of the controller that is changed on its way is not what the controller commands. The drive gets it, and the test
/// ends.
#[test]
fn an_undeclared_violation_ends_the_test_and_names_it() {
    let ends = std::panic::catch_unwind(|| {
        let mut rig = in_motion(Settings::default());
        rig.tamper_command = Some(Box::new(|datagram| {
            if let Some(at) = super::programs::command_position(datagram.as_slice()) {
                let bytes = &mut datagram.as_mut_slice()[at..at + 8];
                let position = f64::from_le_bytes(bytes.try_into().expect("eight"));
                // A hundredth of a revolution further: 2.5 revolutions per second in one period.
                bytes.copy_from_slice(&(position + 10_000.0).to_le_bytes());
            }
            true
        }));
        rig.run_for(millis(100));
    });
    let message = *ends.expect_err("it ends").downcast::<String>().expect("a message");
    for part in ["seed 1: ", "axis 1 on SERCOS, cycle ", ": velocity: expected ", "units/s, got "] {
        assert!(message.contains(part), "{message}");
    }
}
