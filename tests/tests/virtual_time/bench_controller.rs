//! The bench controller keeps its session, and leaves no axis in motion behind when its run ends.

use axisbridge_tests::rig::motion::{NANO, both, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::condition::Condition;
use profile_cip::controller::{Controller, Event, Failure, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::{ControlMode, NodeFault};
use profile_generic::time::DurationNs;

/// A slow ramp, so that its curve can be seen.
const GENTLE: Limits = Limits { velocity: 100.0, acceleration: 200.0, jerk: 4_000.0 };

fn lost_sessions(rig: &Rig) -> usize {
    rig.events.iter().filter(|event| matches!(event, Event::SessionLost)).count()
}

/// The connection was closed in order, and nobody found fault with anything.
fn ended_in_order(rig: &Rig) {
    let device = rig.engine.devices()[0].device();
    assert_eq!(
        (device.counters().connection_losses, device.node_fault()),
        (0, NodeFault::NONE),
        "{}",
        rig.log()
    );
    assert_eq!(rig.status().connections, 0);
    for axis in 0..2 {
        assert_eq!(rig.engine.axes()[axis].counters().faults, 0, "axis {axis}: {}", rig.told());
    }
    assert!(rig.torque_free());
}

#[test]
fn a_dwell_beyond_the_inactivity_time_out_keeps_session_and_connection() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Enable(both()), Step::Dwell { seconds: 200.0 }, Step::Disable(both())]);
    let report = rig.run(DurationNs::from_secs(260));
    assert_eq!((report.failure, report.steps_finished), (None, 3), "{}", rig.log());
    assert_eq!(rig.adapter.counters().sessions_timed_out, 0);
    assert_eq!(lost_sessions(&rig), 0);
    ended_in_order(&rig);
}

#[test]
fn a_session_that_the_device_closes_amid_a_move_is_registered_anew() {
    let mut rig = Rig::ready(Settings::default());
    let there = Step::MoveAbsolute { axis: 2, position: 300.0, limits: GENTLE };
    rig.connect(vec![Step::Enable(both()), there, Step::Disable(both())]);
    rig.run_until(millis(8_000), "motion", |rig| rig.velocity(1) > 99 * NANO);
    rig.close_stream();
    let mut slowest = i64::MAX;
    let end = rig.now() + millis(1_000);
    rig.run_until(millis(1_100), "a second of the move", |rig| {
        slowest = slowest.min(rig.velocity(1));
        rig.now() >= end
    });
    assert!(slowest > 98 * NANO, "the motion does not notice: {slowest}");
    assert_eq!((lost_sessions(&rig), rig.adapter.sessions()), (1, 1));
    let report = rig.run(millis(30_000));
    assert_eq!((report.failure, report.steps_finished), (None, 3), "{}", rig.log());
    assert!((rig.position(1) - 300 * NANO).abs() < NANO / 50, "{}", rig.position(1));
    ended_in_order(&rig);
}

#[test]
fn a_device_that_takes_no_stream_for_a_while_gets_its_forward_close_later() {
    let mut rig = Rig::ready(Settings::default());
    let there = Step::MoveAbsolute { axis: 2, position: 300.0, limits: GENTLE };
    rig.connect(vec![Step::Enable(both()), there, Step::Disable(both())]);
    rig.run_until(millis(8_000), "motion", |rig| rig.velocity(1) > 99 * NANO);
    rig.accepts_streams = false;
    rig.close_stream();
    rig.run_until(millis(20_000), "the end of the program", |rig| rig.report().steps_finished == 3);
    rig.run_for(millis(1_500));
    assert_eq!(rig.status().connections, 1, "it waits for a stream, and its updates go on");
    rig.accepts_streams = true;
    let report = rig.run(millis(10_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    ended_in_order(&rig);
}

/// Follows the slide from here to the end of the run: it slows down at no more than its own limits, is at rest before the
/// torque goes, and without torque before the connection is closed. Gives how long the ramp took.
fn ramps_down(rig: &mut Rig, limits: Limits) -> DurationNs {
    let (start, begun) = (rig.now(), rig.velocity(1));
    assert!(begun > 99 * NANO, "in motion: {begun}");
    let nano = |units: f64| profile_generic::cast::i64_from_f64(units * 1e9);
    let (mut at, mut last, mut rest) = (start, begun, None);
    rig.run_until(DurationNs::from_secs(60), "the end of the run", |rig| {
        let (now, velocity) = (rig.now(), rig.velocity(1));
        if now.since(at) >= millis(20) {
            let most = nano(limits.acceleration * 1.05) / 50 + NANO;
            let change = velocity - last;
            // The first updates under way still bring the old velocity, and a servo overshoots a little.
            assert!(change <= NANO, "it never gets faster: {last} to {velocity}");
            assert!(-change <= most, "no steeper than its ramp: {last} to {velocity}");
            (at, last) = (now, velocity);
        }
        if velocity.abs() < NANO {
            rest.get_or_insert(now.since(start));
        }
        let on = rig.watched[1].on;
        assert!(on || rest.is_some(), "torque off at {velocity}");
        assert!(rig.status().connections == 1 || !on, "closed with the torque on");
        rig.controller.as_ref().is_none_or(Controller::is_closed)
    });
    rest.expect("rest")
}

/// The slide runs at a velocity and the program goes on with `then`.
fn runs(limits: Limits, then: Vec<Step>) -> Rig {
    // A slow ramp is a long one.
    let configuration = BOX.replace("position_max = 1_000.0", "position_max = 10_000.0");
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    let mut config = rig.controller_config();
    config.axes[1].control_mode = ControlMode::VELOCITY;
    let Limits { velocity, acceleration, jerk } = limits;
    let mut program = vec![Step::Enable(both()), Step::RunAt { axis: 2, velocity, acceleration, jerk }];
    program.extend(then);
    rig.connect_with(config, program);
    rig.run_until(millis(60_000), "speed", |rig| {
        rig.velocity(1) > 99 * NANO && rig.report().steps_finished >= 2
    });
    rig
}

#[test]
fn an_interrupt_in_motion_ramps_down_disables_and_closes() {
    let mut rig = Rig::ready(Settings::default());
    let there = Step::MoveAbsolute { axis: 2, position: 900.0, limits: GENTLE };
    rig.connect(vec![Step::Enable(both()), there]);
    rig.run_until(millis(8_000), "motion", |rig| rig.velocity(1) > 199 * NANO / 2);
    let now = rig.now();
    rig.controller.as_mut().expect("a controller").interrupt(now);
    let took = ramps_down(&mut rig, GENTLE);
    // 100 mm/s at 200 mm/s², and 50 ms for the jerk.
    assert!((millis(450)..millis(700)).contains(&took), "{took}");
    assert_eq!(rig.report().failure, Some(Failure::Interrupted));
    assert!(!rig.axis_states(1).contains(&AxisState::Aborting));
    ended_in_order(&rig);
}

#[test]
fn the_end_of_a_script_with_an_axis_in_motion_ramps_down_disables_and_closes() {
    let mut rig = runs(GENTLE, vec![]);
    ramps_down(&mut rig, GENTLE);
    assert_eq!(rig.report().failure, None, "{}", rig.log());
    ended_in_order(&rig);
}

#[test]
fn a_ramp_longer_than_any_time_out_is_not_cut_off() {
    let slow = Limits { velocity: 100.0, acceleration: 5.0, jerk: 100.0 };
    let mut rig = runs(slow, vec![]);
    let took = ramps_down(&mut rig, slow);
    assert!((DurationNs::from_secs(19)..DurationNs::from_secs(22)).contains(&took), "{took}");
    ended_in_order(&rig);
}

#[test]
fn a_failure_in_motion_ramps_down_disables_and_closes() {
    let never = Step::Expect { condition: Condition::LostUpdates(200), within: millis(300) };
    let mut rig = runs(GENTLE, vec![never]);
    rig.run_until(millis(2_000), "the failure", |rig| rig.report().failure.is_some());
    ramps_down(&mut rig, GENTLE);
    assert_eq!(rig.report().failed_step, Some(2));
    ended_in_order(&rig);
}

#[test]
fn a_session_lost_right_before_the_end_delays_the_close_and_no_ramp() {
    let mut rig = runs(GENTLE, vec![Step::Dwell { seconds: 100.0 }]);
    rig.accepts_streams = false;
    rig.close_stream();
    let now = rig.now();
    rig.controller.as_mut().expect("a controller").interrupt(now);
    rig.run_until(millis(2_000), "rest", |rig| rig.velocity(1).abs() < NANO && !rig.watched[1].on);
    assert_eq!(rig.status().connections, 1);
    rig.accepts_streams = true;
    rig.run(millis(10_000));
    ended_in_order(&rig);
    // One that does not come back is not waited for without end.
    let mut rig = runs(GENTLE, vec![Step::Dwell { seconds: 100.0 }]);
    rig.accepts_streams = false;
    rig.close_stream();
    let now = rig.now();
    rig.controller.as_mut().expect("a controller").interrupt(now);
    rig.run(millis(10_000));
    assert!(rig.torque_free() && !rig.watched[1].on);
}
