//! What drive families do differently, and what happens between two operation modes.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::motion::{NANO, TURNTABLE, at_rest, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Limits, Step};
use profile_cip::wire::motion::CommandValues;
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::fault::FaultCause;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::Torque;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::DurationNs;
use profile_sercos::wire::drive_words::ReadyState;

use super::planes::change_command;

/// The turntable alone.
const TABLE: AxisSet = AxisSet::one(1);

/// A drive that an error locks shows 00 or 10 beside the error bit: the axis faults, is reset by S-0-0099 and goes on.
#[test]
fn errors_are_understood_and_reset_in_both_layouts_of_the_status_word() {
    for ready in [ReadyState::NotReady, ReadyState::PowerOn] {
        for cause in [FaultCause::OVER_CURRENT, FaultCause::EXCESSIVE_POSITION_ERROR] {
            let mut rig = Rig::ready(Settings::default());
            rig.drive_mut(0).set_locked_ready(ready);
            rig.connect(vec![
                Step::Enable(TABLE),
                Step::MoveAbsolute { axis: 1, position: 1_000.0, limits: TURNTABLE },
            ]);
            rig.run_until(millis(5_000), "the motion", |rig| rig.velocity(0) > 49 * NANO / 10);
            rig.drive_mut(0).raise_fault(cause);
            rig.run_until(millis(3_000), "the fault", |rig| {
                rig.engine.axes()[0].state() == DriveState::Faulted
            });
            rig.run_for(millis(100));
            let faults: Vec<_> = rig.engine.axes()[0].faults().map(|active| active.fault.cause).collect();
            assert!(faults.contains(&cause), "{ready}: {faults:?}");
            assert_eq!(rig.engine.axes()[0].feedback().report, Report::Faulted, "{ready}");
            rig.kill_controller();
            rig.drive_mut(0).clear_fault(cause);
            rig.run_for(millis(500));
            assert!(rig.torque_free());
            rig.connect(vec![
                Step::Dwell { seconds: 0.2 },
                Step::FaultReset(TABLE),
                Step::Enable(TABLE),
                Step::Jog { axis: 1, velocity: 1.0, acceleration: 20.0, jerk: 1_000.0, seconds: 0.3 },
                Step::Disable(TABLE),
            ]);
            let report = rig.run(millis(20_000));
            assert_eq!(report.failure, None, "{ready} {cause}: {}\n{}", rig.log(), rig.told());
        }
    }
}

/// The simulated drives are as the dictionary says, and what they lack is one line for each.
#[test]
fn a_start_tells_of_nothing_that_is_in_order() {
    let rig = Rig::ready(Settings::default());
    let warnings: Vec<_> =
        rig.notices.iter().filter(|notice| matches!(notice, Notice::Difference { .. })).collect();
    assert!(warnings.is_empty(), "{warnings:?}");
    let lacking = |axis: u8| {
        rig.notices
            .iter()
            .filter(move |notice| matches!(notice, Notice::PassedOver { .. }) && notice.axis() == Some(axis))
    };
    let told: Vec<String> = lacking(0).map(ToString::to_string).collect();
    assert_eq!((told.len(), lacking(1).count()), (1, 1), "{told:?}");
    assert!(told[0].starts_with("commissioning continues without reading S-0-0294, "), "{told:?}");
}

/// What the controller's cyclic block of the turntable is changed to: another control mode, with its one set-point.
type Change = Rc<RefCell<Option<(ControlMode, CommandValues)>>>;

/// A turntable that runs at 2 rev/s in position control, and whose control mode can be changed on the move.
fn running() -> (Rig, Change) {
    let mut rig = Rig::ready(Settings::default());
    let change = Change::default();
    let wanted = Rc::clone(&change);
    rig.tamper_command = Some(Box::new(move |datagram| {
        change_command(datagram, |block| {
            if let Some((mode, values)) = &*wanted.borrow() {
                block.control_mode = *mode;
                block.values = *values;
            }
        });
        true
    }));
    let limits = Limits { velocity: 2.0, ..TURNTABLE };
    rig.connect(vec![Step::Enable(TABLE), Step::MoveAbsolute { axis: 1, position: 1_000.0, limits }]);
    rig.run_until(millis(10_000), "the speed", |rig| rig.velocity(0) > 199 * NANO / 100);
    rig.run_for(millis(300));
    (rig, change)
}

/// Runs until the drive shows the mode; the lowest and highest speed until then.
fn until(rig: &mut Rig, mode: OperatingMode) -> (i64, i64) {
    let told = |rig: &Rig| rig.engine.axes()[0].command().mode == mode;
    rig.run_until(millis(100), "the order to change", told);
    let begun = rig.now();
    let (mut low, mut high) = (i64::MAX, i64::MIN);
    while rig.engine.axes()[0].feedback().mode != mode {
        rig.step();
        (low, high) = (low.min(rig.velocity(0)), high.max(rig.velocity(0)));
        assert!(rig.now().since(begun) < millis(95), "the drive never changed\n{}", rig.told());
    }
    assert!(rig.now().since(begun) > millis(50), "it took its time");
    (low, high)
}

/// Until the drive shows the new mode it goes on by values of the old one: no dip, no jump.
#[test]
fn between_two_modes_the_axis_keeps_its_speed() {
    let (mut rig, change) = running();
    rig.drive_mut(0).set_mode_delay(DurationNs::from_millis(60));
    let velocity = CommandValues { velocity: Some(2.0), ..CommandValues::default() };
    let torque = CommandValues { torque: Some(2.1), ..CommandValues::default() };
    for (control, mode, values) in [
        (ControlMode::VELOCITY, OperatingMode::Velocity, velocity),
        (ControlMode::TORQUE, OperatingMode::Torque, torque),
        (ControlMode::VELOCITY, OperatingMode::Velocity, velocity),
    ] {
        change.replace(Some((control, values)));
        let (low, high) = until(&mut rig, mode);
        // 2.1 % hold the speed against the friction.
        assert!(low > 18 * NANO / 10 && high < 22 * NANO / 10, "to {control}: {low} to {high}");
        rig.run_for(millis(if mode == OperatingMode::Torque { 5 } else { 300 }));
    }
    assert!((rig.velocity(0) - 2 * NANO).abs() < NANO / 20, "{}", rig.velocity(0));
    assert_eq!(rig.engine.axes()[0].faults().count(), 0, "{}", rig.told());
}

#[test]
fn a_drive_that_does_not_come_to_its_mode_is_stopped() {
    let (mut rig, change) = running();
    rig.drive_mut(0).set_mode_delay(DurationNs::from_secs(100));
    let velocity = CommandValues { velocity: Some(2.0), ..CommandValues::default() };
    change.replace(Some((ControlMode::VELOCITY, velocity)));
    rig.run_until(millis(2_000), "the fault", |rig| {
        rig.engine.axes()[0].faults().any(|active| active.fault.cause == FaultCause::ILLEGAL_MODE)
    });
    rig.run_until(millis(3_000), "the stop", |rig| at_rest(rig) && rig.torque_free());
}

/// Settings for a turntable whose drive tells neither that it follows nor that it is halted.
fn silent(key: &str) -> Settings {
    let configuration = BOX.replace("address = 1", &format!("address = 1{key}")).replace(
        "name = \"turntable\"",
        "name = \"turntable\"\non_command_loss = \"current-decel-and-hold\"",
    );
    Settings { configuration, ..Settings::default() }
}

#[test]
fn a_drive_without_acknowledgement_is_led_and_held_by_its_command() {
    let mut rig = Rig::ready(silent("\nacknowledges = false"));
    rig.drive_mut(0).set_silent(true);
    rig.connect(vec![
        Step::Enable(TABLE),
        Step::MoveAbsolute { axis: 1, position: 3.0, limits: TURNTABLE },
        Step::Dwell { seconds: 0.3 },
        Step::Disable(TABLE),
    ]);
    rig.run_until(millis(10_000), "the target", |rig| rig.report().steps_finished == 3);
    assert!((rig.position(0) - 3 * NANO).abs() < NANO / 500, "{}", rig.position(0));
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    assert!(rig.torque_free());
    // The controller vanishes on the move: the axis comes to rest and holds its place against a load.
    rig.connect(vec![
        Step::Enable(TABLE),
        Step::MoveAbsolute { axis: 1, position: 1_000.0, limits: TURNTABLE },
    ]);
    rig.run_until(millis(5_000), "full speed", |rig| rig.velocity(0) > 49 * NANO / 10);
    rig.kill_controller();
    rig.run_until(millis(3_000), "rest", |rig| rig.velocity(0).abs() < NANO / 100);
    rig.run_for(millis(300));
    let place = rig.position(0);
    rig.drive_mut(0).servo_mut().set_load(Torque(500_000));
    let places = Rc::new(RefCell::new(Vec::new()));
    for _ in 0..200 {
        rig.run_for(millis(10));
        places.borrow_mut().push(rig.position(0) - place);
    }
    let places = places.borrow();
    let drift = places.iter().map(|place| place.abs()).max().unwrap_or(0);
    assert!(!rig.torque_free(), "held\n{}", rig.told());
    assert!(drift < NANO / 50, "it drifts by {drift}\n{}", rig.told());
}

/// The same drive without the key never shows that it follows: nothing moves, and the start is given up.
#[test]
fn a_drive_that_never_follows_is_not_led() {
    let mut rig = Rig::ready(silent(""));
    rig.drive_mut(0).set_silent(true);
    rig.connect(vec![Step::Enable(TABLE), Step::MoveAbsolute { axis: 1, position: 3.0, limits: TURNTABLE }]);
    rig.run_until(millis(15_000), "the fault", |rig| {
        rig.engine.axes()[0].faults().any(|active| active.fault.cause == FaultCause::START_TIME_OUT)
    });
    assert!(rig.position(0).abs() < NANO / 1_000);
    rig.run_until(millis(3_000), "the end of the torque", Rig::torque_free);
}
