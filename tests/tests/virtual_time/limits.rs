//! Set-points against the limits of an axis: the guard before the telegram, and the way back from beyond a software limit.

use axisbridge::engine::axis::Trip;
use axisbridge_tests::rig::motion::{NANO, SLIDE, at_rest, in_motion, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Limits, Step};
use profile_generic::fault::FaultCause;
use profile_generic::quantity::Quantity;
use profile_generic::time::DurationNs;

/// The limit fault of an axis, with what the log says of it.
fn tripped(rig: &Rig, axis: usize) -> (FaultCause, Trip, String) {
    let channel = &rig.engine.axes()[axis];
    let (fault, trip) = (channel.fault().expect("a fault"), channel.tripped().expect("a limit"));
    let line = rig.told().lines().find(|line| line.contains(", limit")).map(str::to_owned);
    (fault.cause, trip, line.unwrap_or_default())
}

fn limited(limits: &str) -> Settings {
    let slide = "position_max = 1_000.0";
    Settings { configuration: BOX.replace(slide, &format!("{slide}\n{limits}")), ..Settings::default() }
}

/// M2: one set-point 0.2 revolutions further, which is 50 revolutions a second where 10 are allowed.
#[test]
fn a_set_point_that_needs_more_than_the_limits_is_not_sent() {
    let error = "following_error = 0.5";
    let configuration = BOX.replace(error, &format!("{error}\nvelocity = 10.0"));
    let mut rig = in_motion(Settings { configuration, ..Settings::default() });
    let before = rig.velocity(0);
    rig.motion_checker.tolerate("the updates on their way are not those of the controller", |_| true);
    let mut done = false;
    rig.tamper_command = Some(Box::new(move |datagram| {
        let at = super::programs::command_position(datagram.as_slice());
        if let Some(at) = at.filter(|_| !std::mem::replace(&mut done, true)) {
            let place = &mut datagram.as_mut_slice()[at..at + 8];
            let position = f64::from_le_bytes((&*place).try_into().expect("eight"));
            place.copy_from_slice(&(position + 200_000.0).to_le_bytes());
        }
        true
    }));
    let mut fastest = 0;
    rig.run_until(millis(200), "the fault", |rig| {
        fastest = fastest.max(rig.velocity(0));
        rig.engine.axes()[0].fault().is_some()
    });
    let (cause, trip, line) = tripped(&rig, 0);
    assert_eq!(
        (cause, trip.quantity, trip.limit),
        (FaultCause::VELOCITY_COMMAND_LIMIT, Quantity::Velocity, 10 * NANO)
    );
    assert!(trip.value > 30 * NANO, "{trip}");
    assert!(line.contains("velocity_command_limit") && line.contains("limit 10.000 u/s"), "{line}");
    assert!(fastest < before + NANO / 2, "{fastest} nanounits a second: nothing of it has reached the drive");
    rig.run_until(millis(3_000), "rest", at_rest);
}

/// M2: the same step in one cycle, because cycles were left out.
#[test]
fn a_pause_at_speed_is_a_fault_when_the_step_behind_it_is_beyond_the_limit() {
    let mut rig = in_motion(limited("velocity = 300.0"));
    rig.motion_checker.tolerate("what a pause leaves out", |_| true);
    rig.wake_ups.pause(rig.now() + DurationNs::from_micros(7_600));
    rig.run_until(millis(100), "the fault", |rig| rig.engine.axes()[1].fault().is_some());
    let (cause, trip, line) = tripped(&rig, 1);
    assert_eq!((cause, trip.limit), (FaultCause::VELOCITY_COMMAND_LIMIT, 300 * NANO));
    assert!(trip.value > 390 * NANO, "{trip}");
    assert!(trip.late > millis(4) && line.contains("ms late"), "{line}");
}

/// M7.
#[test]
fn an_axis_beyond_its_software_limit_may_stand_there_and_come_back_and_not_go_further_out() {
    let slide = AxisSet::one(2);
    let to = |position| Step::MoveAbsolute { axis: 2, position, limits: SLIDE };
    let settings = || Settings {
        configuration: BOX.replace("position_min = -5.0", "position_min = 5.0"),
        ..Settings::default()
    };
    let mut rig = Rig::ready(settings());
    rig.connect(vec![
        Step::Enable(slide),
        Step::Dwell { seconds: 0.2 },
        to(2.0),
        Step::Dwell { seconds: 0.2 },
        to(20.0),
        Step::WaitInWindow { axis: 2, window: 0.02, seconds: 1.0 },
        to(6.0),
        Step::Disable(slide),
    ]);
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}", rig.told());
    assert!((rig.position(1) - 6 * NANO).abs() < NANO / 20, "{}", rig.position(1));

    let mut rig = Rig::ready(settings());
    let out = Step::MoveAbsolute { axis: 2, position: -3.0, limits: Limits { velocity: 20.0, ..SLIDE } };
    rig.connect(vec![Step::Enable(slide), out]);
    rig.run_until(millis(8_000), "the fault", |rig| rig.engine.axes()[1].fault().is_some());
    let (cause, trip, line) = tripped(&rig, 1);
    assert_eq!(
        (cause, trip.quantity, trip.limit),
        (FaultCause::POSITION_COMMAND_LIMIT, Quantity::Position, 5 * NANO)
    );
    assert!((-NANO / 10..0).contains(&trip.value), "{line}");
    assert!(rig.position(1) > -NANO / 10, "{}", rig.position(1));
}
