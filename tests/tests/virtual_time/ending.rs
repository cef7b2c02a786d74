//! The end of the box waits until every axis stands, as its drive tells it, or has had the time that its own limits give it.

use axisbridge::engine::axis::STOP_TIME_OUT;
use axisbridge::engine::axis::rest::Unrested;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::wire::motion::codes::{AxisControl, ControlMode};
use profile_generic::quantity::{Acceleration, Torque, Velocity};
use profile_generic::servo::ServoParameters;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;

use super::beside::connect;
use super::stopping::request;

/// The turntable turns at 2 rev/s; its drive is another one, and stops as configured when commands stay away.
fn turning(on_command_loss: &str, drive: impl Fn(ServoParameters) -> ServoParameters) -> Rig {
    let line = format!("on_command_loss = \"{on_command_loss}\"\ninstance = ");
    let configuration = BOX.replace("instance = ", &line);
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    let turn = Step::RunAt { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0 };
    connect(&mut rig, vec![Step::Enable(AxisSet::one(1)), turn, Step::Dwell { seconds: 500.0 }]);
    rig.run_until(millis(10_000), "the speed", |rig| rig.velocity(0) > 199 * NANO / 100);
    let servo = rig.drive_mut(0).servo_mut();
    let parameters = drive(*servo.parameters());
    servo.set_parameters(parameters).expect("such a servo exists");
    rig
}

/// One that brakes by 0.2 rev/s^2.
fn slow(servo: ServoParameters) -> ServoParameters {
    ServoParameters { deceleration_limit: Acceleration(NANO / 5), ..servo }
}

/// One that nothing brakes without torque.
fn frictionless(servo: ServoParameters) -> ServoParameters {
    ServoParameters { coulomb_friction: Torque(0), viscous_friction: Torque(0), ..servo }
}

fn stop(rig: &mut Rig) {
    let now = rig.now();
    rig.engine.stop(now);
}

/// Lets the box end, and says how long that took. Until the axis stands, or the limit is over, the bus is there.
fn ends(rig: &mut Rig, limit: DurationNs) -> DurationNs {
    rig.run_until(limit, "the end", |rig| {
        let fast = rig.velocity(0).abs() > NANO / 5;
        let down = rig.sercos().master().phase() != Some(profile_sercos::wire::header::Phase::CP4);
        assert!(!(fast && down && rig.engine.unrested().is_empty()), "at {} nrev/s", rig.velocity(0));
        rig.engine.is_stopped()
    })
}

#[test]
fn a_stop_of_ten_seconds_is_waited_for_and_the_bus_goes_down_last() {
    let mut rig = turning("current-decel-and-disable", slow);
    stop(&mut rig);
    let took = ends(&mut rig, millis(15_000));
    assert!(took > millis(8_000) && took < millis(12_000), "{took}");
    assert_eq!(rig.engine.unrested(), []);
    assert!(rig.torque_free() && rig.velocity(0).abs() < NANO / 10);
    assert_eq!(rig.sercos().master().phase(), None);
}

#[test]
fn an_axis_that_coasts_is_waited_for_as_long_as_its_limits_say_and_named_when_it_turns_still() {
    let mut rig = turning("disable-and-coast", frictionless);
    stop(&mut rig);
    rig.run_for(millis(100));
    assert!(rig.torque_free(), "it coasts");
    let took = ends(&mut rig, millis(70_000));
    // A stop, and the coasting after it, of 30 s each at most, and a second.
    assert!(took > STOP_TIME_OUT * 2 && took < STOP_TIME_OUT * 2 + millis(3_000), "{took}");
    let [Unrested { axis: 0, state, velocity: Some(velocity) }] = *rig.engine.unrested() else {
        panic!("{:?}", rig.engine.unrested())
    };
    assert!((velocity.get() - 2 * NANO).abs() < NANO / 10, "{velocity}");
    assert!(!state.may_have_torque(), "{state}");
    assert_eq!(rig.sercos().master().phase(), None, "the bus went down all the same");
}

#[test]
fn who_is_in_a_hurry_is_told_what_turns() {
    let mut rig = turning("current-decel-and-disable", slow);
    stop(&mut rig);
    rig.run_for(millis(2_000));
    assert!(!rig.engine.is_stopped());
    let now = rig.now();
    rig.engine.hurry(now);
    let took = ends(&mut rig, millis(2_000));
    assert!(took < millis(500), "{took}");
    let [Unrested { axis: 0, state: DriveState::FaultReaction, velocity: Some(velocity) }] =
        *rig.engine.unrested()
    else {
        panic!("{:?}", rig.engine.unrested())
    };
    assert!(velocity > Velocity(NANO) && velocity < Velocity(2 * NANO), "{velocity}");
}

#[test]
fn a_drive_that_is_lost_while_it_stops_is_not_known_to_stand() {
    let mut rig = turning("current-decel-and-disable", slow);
    stop(&mut rig);
    rig.run_for(millis(500));
    rig.cable = false;
    let took = rig.run_until(millis(10_000), "the end", |rig| rig.engine.is_stopped());
    assert!(took < millis(5_000), "nobody can see it stop: {took}");
    let [Unrested { axis: 0, velocity: None, .. }] = *rig.engine.unrested() else {
        panic!("{:?}", rig.engine.unrested())
    };
}

/// While one axis stops as its controller wants, the controller wants to switch the other one on.
#[test]
fn no_axis_is_switched_on_while_the_box_ends() {
    let mut rig = Rig::ready(Settings::default());
    let run = Step::RunAt { axis: 2, velocity: 100.0, acceleration: 1_000.0, jerk: 20_000.0 };
    let (slide, dwell) = (AxisSet::one(2), Step::Dwell { seconds: 1.0 });
    let mut config = rig.controller_config();
    config.axes[1].control_mode = ControlMode::VELOCITY;
    rig.connect_with(config, vec![Step::Enable(slide), run, dwell, Step::Disable(slide)]);
    rig.run_until(millis(10_000), "the speed", |rig| rig.velocity(1) > 99 * NANO);
    let servo = rig.drive_mut(1).servo_mut();
    let slow = ServoParameters { deceleration_limit: Acceleration(20 * NANO), ..*servo.parameters() };
    servo.set_parameters(slow).expect("such a servo exists");
    rig.run_until(millis(5_000), "the stop", |rig| rig.engine.axes()[1].state() == DriveState::Stopping);
    stop(&mut rig);
    request(&mut rig, AxisControl::ENABLE);
    let took = rig.run_until(millis(30_000), "the end", |rig| {
        assert!(!rig.watched[0].on && !rig.engine.axes()[0].may_have_torque(), "{}", rig.told());
        rig.engine.is_stopped()
    });
    assert!(took > millis(1_000), "{took}");
    assert_eq!(rig.engine.unrested(), []);
}

/// Drives that are not heard any more because the box takes its buses down are nothing to be told of.
#[test]
fn an_end_without_faults_tells_of_none() {
    let can = include_str!("can.toml");
    let devicenet = include_str!("devicenet.toml");
    for (name, mut rig) in [
        ("SERCOS", Rig::ready(Settings::default())),
        ("CANopen", Rig::ready(Settings::without_line(can))),
        ("DeviceNet", Rig::ready(Settings::without_line(devicenet))),
    ] {
        rig.run_for(millis(500));
        stop(&mut rig);
        rig.run_until(millis(5_000), "the end", |rig| rig.engine.is_stopped());
        rig.run_for(millis(20));
        let told = rig.told();
        assert!(!told.contains("south_silence") && !told.contains("Fault"), "{name}: {told}");
    }
}

#[test]
fn an_axis_that_was_not_switched_on_is_not_waited_for() {
    let mut rig = Rig::ready(Settings::default());
    rig.cable = false;
    rig.run_for(millis(100));
    stop(&mut rig);
    let took = rig.run_until(millis(5_000), "the end", |rig| rig.engine.is_stopped());
    assert!(took < millis(2_500), "{took}");
    assert_eq!(rig.engine.unrested(), []);
}
