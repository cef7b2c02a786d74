//! Something is wrong with a drive, or with a command.

use axisbridge_tests::rig::motion::{NANO, SLIDE, TURNTABLE, at_rest, both, in_motion, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{AxisSet, Failure, Step};
use profile_cip::wire::motion::codes::{AxisStateCode, FaultType};
use profile_generic::fault::FaultCause;
use profile_generic::state::{DriveState, Report};

const TURNTABLE_ONLY: AxisSet = AxisSet::one(1);

/// Fault type and code of each entry of an axis' fault log that the controller got.
fn codes(rig: &Rig, place: usize) -> Vec<(FaultType, u8)> {
    rig.report().axes[place].faults.kept().iter().map(|fault| (fault.fault_type, fault.code)).collect()
}

#[test]
fn a_fault_of_one_drive_leaves_the_other_axis_moving_and_can_be_reset() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(both()),
        // The slide moves all the time, the turntable is faulted meanwhile, reset, and moves again.
        Step::Together(vec![
            Step::MoveAbsolute { axis: 2, position: 500.0, limits: SLIDE },
            Step::Sequence(vec![
                Step::Dwell { seconds: 0.8 },
                Step::FaultReset(TURNTABLE_ONLY),
                Step::Enable(TURNTABLE_ONLY),
                Step::MoveAbsolute { axis: 1, position: 3.0, limits: TURNTABLE },
            ]),
        ]),
        Step::WaitInWindow { axis: 1, window: 0.001, seconds: 1.0 },
        Step::WaitInWindow { axis: 2, window: 0.02, seconds: 1.0 },
        Step::Disable(both()),
    ]);
    rig.run_until(millis(5_000), "the slide in motion", |rig| rig.velocity(1) > 199 * NANO);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    rig.run_for(millis(100));
    // Inverter Overcurrent, with the drive's bit of S-0-0011 as the sub code.
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS, 10)]);
    assert_eq!(rig.report().axes[0].faults.kept()[0].sub_code, 0x80);
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::MAJOR_FAULTED));
    assert_eq!(rig.drive(0).actual().report, Report::Faulted);
    assert!(!rig.watched[0].on && rig.watched[1].on);
    assert!(rig.velocity(1) > 199 * NANO, "the slide goes on");
    rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT);
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 5), "{}", rig.log());
    assert_eq!(report.axes[1].faults.total, 0);
    assert!((rig.position(0) - 3 * NANO).abs() < NANO / 1_000, "{}", rig.position(0));
    assert!((rig.position(1) - 500 * NANO).abs() < NANO / 50, "{}", rig.position(1));
    insta::assert_snapshot!(
        rig.states(0).iter().map(ToString::to_string).collect::<Vec<_>>().join(" -> ")
            + "\n"
            + &rig.axis_states(0).iter().map(ToString::to_string).collect::<Vec<_>>().join(" -> ")
    );
}

#[test]
fn a_fault_that_is_still_there_comes_back_after_a_reset() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(TURNTABLE_ONLY),
        Step::Dwell { seconds: 0.3 },
        Step::FaultReset(TURNTABLE_ONLY),
        Step::Dwell { seconds: 0.1 },
        Step::Enable(TURNTABLE_ONLY),
    ]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_VOLTAGE);
    let report = rig.run(millis(30_000));
    let Some(Failure::RequestRefused { axis: 1, state, .. }) = report.failure else {
        panic!("{:?}\n{}", report.failure, rig.log())
    };
    assert_eq!(state, AxisStateCode::MAJOR_FAULTED);
    assert!(rig.torque_free() && !rig.watched[0].on);
}

#[test]
fn faults_amid_a_move_are_told_by_the_code_of_the_standard() {
    // Bits of Axis Exceptions, attribute 653: what a drive trips on are factory limits.
    let cases = [
        (FaultCause::MOTOR_OVER_TEMPERATURE, 5, "Motor Overtemperature FL"),
        (FaultCause::OVER_CURRENT, 10, "Inverter Overcurrent"),
        (FaultCause::OVER_VOLTAGE, 35, "Bus Overvoltage FL"),
        (FaultCause::FEEDBACK_LOSS, 43, "Feedback Signal Loss FL"),
    ];
    for (cause, code, name) in cases {
        let mut rig = in_motion(Settings::default());
        rig.drive_mut(1).raise_fault(cause);
        let report = rig.run(millis(30_000));
        assert_eq!(codes(&rig, 1), [(FaultType::AXIS, code)], "{name}");
        assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 2, .. })), "{name}: {report}");
        assert_eq!(report.axes[0].faults.total, 0, "{name}");
        rig.run_until(millis(3_000), "rest", at_rest);
        assert!(rig.torque_free(), "{name}");
    }
}

#[test]
fn lost_main_power_faults_the_axis_and_it_starts_again_when_power_is_back_and_it_is_asked_to() {
    let mut rig = in_motion(Settings::default());
    rig.drive_mut(1).set_main_power(false);
    let report = rig.run(millis(30_000));
    assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 2, .. })), "{report}");
    // Bus Undervoltage FL.
    assert_eq!(codes(&rig, 1), [(FaultType::AXIS, 33)]);
    rig.run_until(millis(3_000), "rest", at_rest);
    assert!(rig.torque_free());
    rig.drive_mut(1).set_main_power(true);
    rig.run_for(millis(1_000));
    assert!(rig.torque_free() && !rig.watched[1].on, "power alone starts nothing");
    rig.connect(vec![
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(AxisSet::one(2)),
        Step::Enable(both()),
        Step::Disable(both()),
    ]);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

#[test]
fn a_command_beyond_the_limits_of_the_box_is_a_fault_and_is_not_followed() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Enable(both()), Step::MoveAbsolute { axis: 2, position: -20.0, limits: SLIDE }]);
    let report = rig.run(millis(30_000));
    let Some(Failure::AxisNotRunning { axis: 2, .. }) = report.failure else {
        panic!("{:?}", report.failure)
    };
    // The box's own limit: position command limit of the manufacturer's table.
    assert_eq!(codes(&rig, 1), [(FaultType::AXIS_MFG, 6)]);
    assert!(rig.torque_free());
    // The limit is -5 mm; the drive came to rest on its ramp close behind it.
    let stands = rig.position(1);
    assert!((-6 * NANO..-4 * NANO).contains(&stands), "{stands}");
    assert_eq!(rig.engine.axes()[0].counters().faults, 0);
}

#[test]
fn a_jump_of_the_command_is_a_fault_and_is_not_followed() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Enable(TURNTABLE_ONLY), Step::Dwell { seconds: 5.0 }]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    // From one update to the next by forty revolutions: every Command Position but a zero one is moved.
    rig.tamper_command = Some(Box::new(|datagram| {
        if let Some(at) = super::programs::command_position(datagram.as_slice()) {
            datagram.as_mut_slice()[at..at + 8].copy_from_slice(&40_000_000.0_f64.to_le_bytes());
        }
        true
    }));
    let mut farthest = 0;
    rig.run_until(millis(1_000), "the fault", |rig| {
        farthest = farthest.max(rig.position(0).abs());
        rig.engine.axes()[0].fault().is_some()
    });
    // The drive's own watch finds it first; before that it moved by less than a hundredth of a revolution.
    let fault = rig.engine.axes()[0].fault().expect("a fault");
    assert_eq!(fault.cause, FaultCause::EXCESSIVE_POSITION_ERROR);
    assert!(farthest < NANO / 100, "{farthest}");
    rig.run_until(millis(1_000), "rest", at_rest);
    assert_ne!(rig.engine.axes()[0].state(), DriveState::Operating);
}
