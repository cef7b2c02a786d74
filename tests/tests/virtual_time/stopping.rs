//! How axes start and stop: Stopping Actions, brakes, holds, shutdown, and what is no drive.

use std::fmt::Write as _;

use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::motion_checker::violation::Rule;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::class1::CLASS1_HEADER_LEN;
use profile_cip::wire::motion::codes::{AxisControl, AxisStateCode, ControlMode};
use profile_cip::wire::motion::{ActualFrame, CommandFrame, CommandInstance};
use profile_generic::fault::FaultCause;
use profile_generic::sequence::SequenceStep;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::DurationNs;

const TURNTABLE: AxisSet = AxisSet::one(1);
const SLOW: Limits = Limits { velocity: 2.0, acceleration: 50.0, jerk: 1_000.0 };

/// Numbers of the attributes that these tests set.
mod id {
    pub const RAMP_DECELERATION: u16 = 377;
    pub const FLYING_START_ENABLE: u16 = 380;
    pub const DECELERATION_LIMIT: u16 = 486;
    pub const ZERO_SPEED_TIME: u16 = 609;
    pub const STOPPING_ACTION: u16 = 610;
    pub const STOPPING_TIME_LIMIT: u16 = 612;
    pub const BRAKE_RELEASE_DELAY: u16 = 615;
    pub const BRAKE_ENGAGE_DELAY: u16 = 616;
    pub const COASTING_TIME_LIMIT: u16 = 617;
    pub const SHUTDOWN_ACTION: u16 = 629;
}

/// What the controller sets before it enables the turntable.
fn attributes(action: u8, brake: bool) -> Step {
    let delay = if brake { 0.1 } else { 0.0 };
    Step::SetAttributes {
        axis: 1,
        attributes: vec![
            AttributeSet::usint(id::STOPPING_ACTION, action),
            AttributeSet::real(id::STOPPING_TIME_LIMIT, 5.0),
            AttributeSet::real(id::COASTING_TIME_LIMIT, 3.0),
            AttributeSet::real(id::BRAKE_RELEASE_DELAY, delay),
            AttributeSet::real(id::BRAKE_ENGAGE_DELAY, delay),
            AttributeSet::real(id::DECELERATION_LIMIT, 10.0),
        ],
    }
}

/// Axis Control, or Axis Response, in a cyclic block, and Axis State in that of the device.
const REQUEST_AT: usize = 2;
const STATE_AT: usize = 7;

/// Replaces the request of the turntable in everything that the controller sends from now on. The controller is shown a
/// Running axis that answers nothing, so that it goes on with what it does.
pub(super) fn request(rig: &mut Rig, request: AxisControl) {
    rig.tamper_command = Some(Box::new(move |bytes| {
        let data = &bytes.as_slice()[CLASS1_HEADER_LEN..];
        let frame = CommandFrame::parse(data).ok();
        let header = frame.map(|frame| (frame.header().buffer_len(), frame.instances().any(first)));
        if let Some((header, true)) = header {
            bytes.as_mut_slice()[CLASS1_HEADER_LEN + header + INSTANCE_LEN + REQUEST_AT] = request.0;
        }
        true
    }));
    rig.tamper_actual = Some(Box::new(|bytes| {
        let data = &bytes.as_slice()[CLASS1_HEADER_LEN..];
        let header = ActualFrame::parse(data).ok().map(|frame| frame.header().buffer_len());
        if let Some(header) = header {
            let block = &mut bytes.as_mut_slice()[CLASS1_HEADER_LEN + header + INSTANCE_LEN..];
            block[REQUEST_AT..REQUEST_AT + 2].fill(0);
            block[STATE_AT] = AxisStateCode::RUNNING.0;
        }
        true
    }));
}

/// Octets of the instance header in front of a cyclic block.
const INSTANCE_LEN: usize = 8;

/// The turntable's instance, which is the first one, with a cyclic block.
fn first(instance: CommandInstance<'_>) -> bool {
    instance.number == 1 && instance.cyclic.is_some()
}

/// What can be seen of the turntable.
fn shown(rig: &Rig) -> (String, String, bool, bool) {
    let drive = rig.drive(0);
    let state = rig.engine.devices()[0].axis_states().next().map_or(AxisState::Off, |(_, state)| state);
    let torque = !matches!(
        drive.actual().report,
        Report::NotReady | Report::AwaitingPower | Report::Ready | Report::Faulted | Report::Silent
    );
    (state.to_string(), rig.engine.axes()[0].sequence_step().to_string(), torque, drive.brake_released())
}

/// Each change of what can be seen, with its time, for `span`.
fn watch(rig: &mut Rig, span: DurationNs, out: &mut String) {
    let start = rig.now();
    let mut last = None;
    while rig.now().since(start) < span {
        let now = shown(rig);
        if last.as_ref() != Some(&now) {
            let (state, step, torque, open) = &now;
            let speed = rig.velocity(0) / (NANO / 100);
            writeln!(
                out,
                "{:>5} ms  {state:<14} {step:<14} {:<7} {:<12} {}.{:02} rev/s",
                rig.now().since(start).0 / 1_000_000,
                if *torque { "torque" } else { "" },
                if *open { "brake open" } else { "" },
                speed / 100,
                speed.abs() % 100,
            )
            .expect("a string");
            last = Some(now);
        }
        rig.step();
    }
}

/// A rig whose turntable is enabled, standing or on its way.
fn running(settings: Settings, moving: bool, first: Step) -> Rig {
    let mut rig = Rig::ready(settings);
    let motion = Step::MoveAbsolute { axis: 1, position: 1_000.0, limits: SLOW };
    let then = if moving { motion } else { Step::Dwell { seconds: 100.0 } };
    rig.connect(vec![first, Step::Enable(TURNTABLE), then]);
    rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 2);
    rig.run_for(millis(1_000));
    assert_eq!(rig.velocity(0) > 19 * NANO / 10, moving, "{}", rig.velocity(0));
    rig
}

#[test]
fn every_stopping_action_standing_and_moving_with_a_brake_and_without() {
    let mut out = String::new();
    for brake in [false, true] {
        for moving in [false, true] {
            for action in 0..=4 {
                let mut rig = running(Settings::default(), moving, attributes(action, brake));
                let with = if brake { "brake" } else { "no brake" };
                let how = if moving { "moving" } else { "standing" };
                writeln!(out, "== Stopping Action {action}, {how}, {with}").expect("a string");
                request(&mut rig, AxisControl::DISABLE);
                watch(&mut rig, millis(6_000), &mut out);
                let held = action >= 3;
                let end = shown(&rig);
                assert_eq!((end.0.as_str(), end.2), ("Stopped", held), "{out}");
                assert!(rig.velocity(0).abs() < NANO / 100, "{}", rig.velocity(0));
                assert_eq!(rig.engine.axes()[0].fault(), None, "{out}");
            }
        }
    }
    insta::assert_snapshot!(out);
}

/// The state of the turntable's axis.
fn state(rig: &Rig) -> AxisState {
    rig.engine.devices()[0].axis_states().next().map_or(AxisState::Off, |(_, state)| state)
}

#[test]
fn a_stop_that_takes_too_long_ends_without_torque_and_with_a_fault() {
    let mut first = attributes(2, false);
    if let Step::SetAttributes { attributes, .. } = &mut first {
        // From 2 rev/s at 10 rev/s2 it would take 200 ms.
        attributes.push(AttributeSet::real(id::STOPPING_TIME_LIMIT, 0.1));
    }
    let mut rig = running(Settings::default(), true, first);
    request(&mut rig, AxisControl::DISABLE);
    rig.run_until(millis(120), "the end of the torque", |rig| !shown(rig).2);
    assert_eq!(rig.engine.axes()[0].fault().map(|fault| fault.cause), Some(FaultCause::STOP_TIME_OUT));
    assert!(rig.velocity(0) > NANO / 2, "it still moves: {}", rig.velocity(0));
    rig.run_for(millis(20));
    assert_eq!(state(&rig), AxisState::Aborting);
    rig.run_until(millis(10_000), "rest", |rig| state(rig) == AxisState::MajorFaulted);
    assert!(rig.velocity(0).abs() <= NANO / 10, "Major Faulted only at rest: {}", rig.velocity(0));
}

/// A Ramped Decel takes the deceleration of the ramp generator; the Deceleration Limit where that was not set.
#[test]
fn a_ramped_stop_takes_the_ramp_deceleration_that_was_set() {
    for (ramp, after) in [(None, 0), (Some(2.0), 150), (Some(4.0), 100)] {
        let mut first = attributes(2, false);
        if let (Some(ramp), Step::SetAttributes { attributes, .. }) = (ramp, &mut first) {
            attributes.push(AttributeSet::real(id::RAMP_DECELERATION, ramp));
        }
        let mut rig = running(Settings::default(), true, first);
        request(&mut rig, AxisControl::DISABLE);
        rig.run_until(millis(50), "Stopping", |rig| state(rig) == AxisState::Stopping);
        rig.run_for(millis(250));
        // From 2 rev/s; at 10 rev/s2 it stands after 200 ms.
        let speed = rig.velocity(0) / (NANO / 100);
        assert!((speed - after).abs() <= 4, "{ramp:?}: {speed} hundredths of a rev/s");
    }
}

#[test]
fn a_shutdown_takes_the_torque_at_once_and_stays() {
    let mut rig = running(Settings::default(), true, attributes(2, false));
    request(&mut rig, AxisControl::SHUTDOWN);
    rig.run_until(millis(20), "the end of the torque", |rig| !shown(rig).2);
    assert!(rig.velocity(0) > 19 * NANO / 10, "it coasts: {}", rig.velocity(0));
    assert_eq!(state(&rig), AxisState::Stopping);
    rig.run_until(millis(10_000), "rest", |rig| state(rig) == AxisState::Shutdown);
    // A lost connection does not end it; a new one does, and still nothing is switched on.
    rig.kill_controller();
    rig.run_for(millis(1_000));
    assert_eq!((state(&rig), rig.watched[0].on), (AxisState::MajorFaulted, false));
    (rig.tamper_command, rig.tamper_actual) = (None, None);
    rig.connect(vec![Step::Enable(TURNTABLE), Step::Disable(TURNTABLE)]);
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

#[test]
fn a_shutdown_ends_a_stop_under_way() {
    // The drive brakes from 2 rev/s within 200 ms.
    let mut rig = running(Settings::default(), true, attributes(1, false));
    request(&mut rig, AxisControl::DISABLE);
    rig.run_for(millis(20));
    assert_eq!((state(&rig), shown(&rig).2), (AxisState::Stopping, true));
    request(&mut rig, AxisControl::SHUTDOWN);
    rig.run_until(millis(20), "the end of the torque", |rig| !shown(rig).2);
    assert!(rig.velocity(0) > NANO, "it coasts: {}", rig.velocity(0));
    rig.run_until(millis(10_000), "rest", |rig| state(rig) == AxisState::Shutdown);
}

#[test]
fn an_axis_that_is_held_starts_again_without_a_jump_and_lets_go_when_its_controller_is_gone() {
    let mut rig = running(Settings::default(), true, attributes(4, false));
    request(&mut rig, AxisControl::DISABLE);
    rig.run_until(millis(2_000), "the hold", |rig| state(rig) == AxisState::Stopped);
    rig.run_for(millis(500));
    assert!(shown(&rig).2, "held");
    // A hundred-thousandth of a revolution: the set-point is where the ramp ended, not where the drive holds.
    rig.motion_checker.allow("out of a hold the drive begins where the ramp ended", |found| {
        found.rule == Rule::Begin && found.value.abs() < 2e-5
    });
    let place = rig.position(0);
    request(&mut rig, AxisControl::NONE);
    rig.run_for(millis(50));
    request(&mut rig, AxisControl::ENABLE);
    // Until it follows the controller again it has not moved.
    while state(&rig) != AxisState::Running {
        assert!((rig.position(0) - place).abs() < NANO / 1_000, "{} {place}", rig.position(0));
        rig.step();
    }
    let mut rig = running(Settings::default(), false, attributes(3, false));
    request(&mut rig, AxisControl::DISABLE);
    rig.run_until(millis(2_000), "the hold", |rig| state(rig) == AxisState::Stopped);
    rig.kill_controller();
    rig.run_for(millis(2_000));
    assert!(rig.torque_free(), "the configured reaction to lost commands is the floor");
    assert_eq!(state(&rig), AxisState::MajorFaulted);
}

/// A rig whose turntable goes at 2 rev/s, or stands, when it is aborted by Stopping Action `action`; `then` follows.
fn aborted(action: u8, moving: bool, then: Vec<Step>) -> Rig {
    let mut rig = Rig::ready(Settings::default());
    let mut program = vec![attributes(action, false), Step::Enable(TURNTABLE)];
    if moving {
        program.push(Step::Mode { axis: 1, mode: ControlMode::VELOCITY });
        program.push(Step::RunAt { axis: 1, velocity: 2.0, acceleration: 50.0, jerk: 1_000.0 });
    }
    program.push(Step::Dwell { seconds: 0.5 });
    let before = program.len();
    program.push(Step::Abort(TURNTABLE));
    program.extend(then);
    rig.connect(program);
    rig.run_until(millis(10_000), "the motion", |rig| rig.report().steps_finished == before);
    assert_eq!(rig.velocity(0) > 19 * NANO / 10, moving, "{}", rig.velocity(0));
    rig.run_until(millis(50), "Aborting", |rig| rig.axis_states(0).contains(&AxisState::Aborting));
    rig
}

#[test]
fn an_abort_that_holds_ends_in_major_faulted_with_torque() {
    // 5-2.3.16.1.1: the last state is always Major Faulted, and the fault action says what becomes of the torque.
    for action in [3, 4] {
        for moving in [false, true] {
            let mut rig = aborted(action, moving, vec![Step::Dwell { seconds: 100.0 }]);
            let stop = rig.run_until(millis(2_000), "rest", |rig| state(rig) == AxisState::MajorFaulted);
            assert!(rig.velocity(0).abs() <= NANO / 10, "Major Faulted only at rest: {}", rig.velocity(0));
            assert_eq!(stop > millis(10), moving, "{stop}");
            // Beyond every time limit of a stop, once.
            rig.run_for(millis(if action == 3 && moving { 35_000 } else { 500 }));
            assert_eq!(
                (state(&rig), shown(&rig).2),
                (AxisState::MajorFaulted, true),
                "for as long as it takes"
            );
            assert_eq!(rig.drive(0).actual().report, Report::Halted);
        }
    }
}

/// A turntable that its abort holds in Major Faulted, and where it stands.
fn held_after_abort(then: Vec<Step>) -> (Rig, i64) {
    let dwell = vec![Step::Dwell { seconds: 0.5 }];
    let mut rig = aborted(3, true, [dwell, then].concat());
    rig.run_for(millis(400));
    assert_eq!((state(&rig), shown(&rig).2), (AxisState::MajorFaulted, true));
    let place = rig.position(0);
    (rig, place)
}

#[test]
fn a_hold_after_an_abort_is_let_go_by_a_reset_a_shutdown_and_the_end_of_the_connection() {
    let still = |rig: &Rig, place: i64| (rig.position(0) - place).abs() < NANO / 100;
    let dwell = Step::Dwell { seconds: 0.5 };
    // A Fault Reset leads to Stopped, without torque and without motion.
    let (mut rig, place) = held_after_abort(vec![Step::FaultReset(TURNTABLE), dwell.clone()]);
    rig.run_until(millis(2_000), "Stopped", |rig| state(rig) == AxisState::Stopped);
    assert!(!shown(&rig).2 && still(&rig, place));

    // An axis in Major Faulted with a shutdown is as in Shutdown: free of torque (5-2.6.2.12 and .13).
    let reset = Step::FaultReset(TURNTABLE);
    let then = vec![Step::Shutdown(TURNTABLE), dwell.clone(), reset, dwell, Step::ShutdownReset(TURNTABLE)];
    let (mut rig, place) = held_after_abort(then);
    let done = rig.report().steps_finished;
    rig.run_until(millis(1_000), "the shutdown", |rig| rig.report().steps_finished == done + 2);
    assert_eq!((state(&rig), shown(&rig).2), (AxisState::MajorFaulted, false), "acknowledged when it is so");
    rig.run_until(millis(2_000), "Shutdown", |rig| state(rig) == AxisState::Shutdown);
    rig.run_until(millis(2_000), "Stopped", |rig| state(rig) == AxisState::Stopped);
    assert!(!shown(&rig).2 && still(&rig, place));

    // So does a harder reaction, as to a controller that is gone; a new connection switches nothing on.
    let (mut rig, place) = held_after_abort(vec![Step::Dwell { seconds: 100.0 }]);
    rig.kill_controller();
    rig.run_for(millis(2_000));
    assert_eq!((state(&rig), rig.torque_free()), (AxisState::MajorFaulted, true));
    let lost = rig.watched[0].changes.len();
    rig.connect(vec![Step::Dwell { seconds: 0.5 }, Step::Enable(TURNTABLE), Step::Disable(TURNTABLE)]);
    rig.run_until(millis(5_000), "the dwell", |rig| rig.report().steps_finished == 1);
    assert_eq!((state(&rig), rig.watched[0].changes.len()), (AxisState::Stopped, lost));
    assert!(still(&rig, place));
    assert_eq!(rig.run(millis(20_000)).failure, None, "{}", rig.log());

    // A controller that closes the connection leaves no axis with torque.
    let (mut rig, place) = held_after_abort(vec![Step::Reconnect, Step::Dwell { seconds: 0.5 }]);
    rig.run_until(millis(2_000), "Initializing", |rig| state(rig) == AxisState::Initializing);
    rig.run_until(millis(5_000), "the end of Initializing", |rig| state(rig) != AxisState::Initializing);
    assert!(!shown(&rig).2 && still(&rig, place), "an axis is not ready before it is free of torque");
}

#[test]
fn what_the_box_cannot_do_is_refused() {
    for (number, value) in [(id::STOPPING_ACTION, 5), (id::SHUTDOWN_ACTION, 1), (id::FLYING_START_ENABLE, 2)]
    {
        let mut rig = Rig::ready(Settings::default());
        let attributes = vec![AttributeSet::usint(number, value)];
        rig.connect(vec![Step::SetAttributes { axis: 1, attributes }]);
        let report = rig.run(millis(20_000));
        assert!(report.failure.is_some(), "{number} took {value}");
    }
    // Proving is not offered: nobody could prove anything.
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::usint(590, 1)] }]);
    assert!(rig.run(millis(20_000)).failure.is_some());
}

#[test]
fn a_flying_start_goes_on_from_the_speed_that_there_is() {
    let mut first = attributes(2, false);
    if let Step::SetAttributes { attributes, .. } = &mut first {
        attributes.push(AttributeSet::usint(id::FLYING_START_ENABLE, 1));
        attributes.push(AttributeSet::real(id::DECELERATION_LIMIT, 2.0));
    }
    for flying in [true, false] {
        let mut first = first.clone();
        if let (false, Step::SetAttributes { attributes, .. }) = (flying, &mut first) {
            attributes.push(AttributeSet::usint(id::FLYING_START_ENABLE, 0));
        }
        let mut rig = Rig::ready(Settings::default());
        let jog = Step::Jog { axis: 1, velocity: 2.0, acceleration: 50.0, jerk: 1_000.0, seconds: 100.0 };
        let mut config = rig.controller_config();
        config.axes[0].control_mode = ControlMode::VELOCITY;
        rig.connect_with(config, vec![first, Step::Enable(TURNTABLE), jog]);
        rig.run_until(millis(10_000), "the speed", |rig| rig.velocity(0) > 199 * NANO / 100);
        rig.run_for(millis(100));
        request(&mut rig, AxisControl::DISABLE);
        rig.run_for(millis(300));
        assert_eq!(state(&rig), AxisState::Stopping);
        let before = rig.velocity(0);
        assert!((NANO..19 * NANO / 10).contains(&before), "{before}");
        request(&mut rig, AxisControl::ENABLE);
        if !flying {
            rig.run_for(millis(14));
            assert_eq!(state(&rig), AxisState::Stopping, "without it an Enable in Stopping is refused");
            continue;
        }
        rig.run_until(millis(14), "Starting", |rig| state(rig) == AxisState::Starting);
        while state(&rig) == AxisState::Starting {
            assert!((rig.velocity(0) - before).abs() < NANO / 20, "{} after {before}", rig.velocity(0));
            rig.step();
        }
        assert_eq!(state(&rig), AxisState::Running);
    }
}

/// The mains are switched off while the axis coasts, and the controller enables it again: a flying start that cannot begin. It does not
/// begin by itself when somebody switches the mains on again.
#[test]
fn an_enable_that_waits_for_main_power_becomes_a_fault_and_power_starts_nothing() {
    let mut first = attributes(0, false);
    if let Step::SetAttributes { attributes, .. } = &mut first {
        attributes.push(AttributeSet::usint(id::FLYING_START_ENABLE, 1));
        // It does not count as stopped before the supply has gone.
        attributes.push(AttributeSet::real(id::ZERO_SPEED_TIME, 2.0));
    }
    let mut rig = Rig::ready(Settings::default());
    let jog = Step::Jog { axis: 1, velocity: 2.0, acceleration: 50.0, jerk: 1_000.0, seconds: 100.0 };
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    rig.connect_with(config, vec![first, Step::Enable(TURNTABLE), jog]);
    rig.run_until(millis(10_000), "the speed", |rig| rig.velocity(0) > 199 * NANO / 100);
    request(&mut rig, AxisControl::DISABLE);
    rig.run_for(millis(100));
    rig.drive_mut(0).set_main_power(false);
    rig.run_until(millis(500), "the end of the supply", |rig| {
        rig.engine.axes()[0].state() == DriveState::AwaitingPower
    });
    assert_eq!(
        (state(&rig), rig.engine.axes()[0].sequence_step()),
        (AxisState::Stopping, SequenceStep::Coasting)
    );
    request(&mut rig, AxisControl::ENABLE);
    rig.run_until(millis(20), "Starting", |rig| state(rig) == AxisState::Starting);
    let waited = rig.run_until(millis(10_000), "the refusal", |rig| {
        rig.told().contains("axis 1: the request Enable (1) was refused with status 0x0c")
    });
    assert!((millis(1_900)..millis(2_100)).contains(&waited), "{waited}");
    assert_eq!(rig.engine.axes()[0].fault().map(|fault| fault.cause), Some(FaultCause::START_TIME_OUT));
    rig.run_for(millis(8_000));
    let changes = rig.watched[0].changes.len();
    rig.drive_mut(0).set_main_power(true);
    rig.run_for(millis(3_000));
    assert_eq!((state(&rig), rig.watched[0].changes.len()), (AxisState::MajorFaulted, changes));
    assert!(rig.torque_free());
    request(&mut rig, AxisControl::FAULT_RESET);
    rig.run_until(millis(1_000), "Stopped", |rig| state(rig) == AxisState::Stopped);
    rig.run_for(millis(3_000));
    assert_eq!((state(&rig), rig.torque_free()), (AxisState::Stopped, true));
}

/// The drive takes half a second to reset its fault. A controller that cancels the reset and shuts the axis down finds it shut down, and
/// can reset that.
#[test]
fn a_shutdown_during_a_reset_that_takes_time_stays_until_its_own_reset() {
    for (reset, shut_down_before) in [
        (AxisControl::FAULT_RESET, false),
        (AxisControl::SHUTDOWN_RESET, false),
        (AxisControl::SHUTDOWN_RESET, true),
    ] {
        let mut rig = running(Settings::default(), false, attributes(2, false));
        request(&mut rig, AxisControl::NONE);
        rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
        rig.run_until(millis(1_000), "Major Faulted", |rig| state(rig) == AxisState::MajorFaulted);
        rig.run_for(millis(500));
        let before = if shut_down_before { AxisControl::SHUTDOWN } else { AxisControl::NONE };
        for asked in [before, AxisControl::NONE, reset, AxisControl::CANCEL, AxisControl::SHUTDOWN] {
            request(&mut rig, asked);
            rig.run_for(millis(100));
            assert_eq!(state(&rig), AxisState::MajorFaulted, "{asked}");
        }
        rig.run_for(millis(200));
        rig.drive_mut(0).recover(FaultCause::OVER_CURRENT);
        rig.run_until(millis(1_000), "Shutdown", |rig| state(rig) == AxisState::Shutdown);
        rig.run_for(millis(6_000));
        assert_eq!((state(&rig), shown(&rig).2), (AxisState::Shutdown, false), "{reset}");
        request(&mut rig, AxisControl::SHUTDOWN_RESET);
        rig.run_until(millis(1_000), "Stopped", |rig| state(rig) == AxisState::Stopped);
    }
}

/// The box of the rig with another function of its turntable.
fn with_function(function: &str) -> Settings {
    let line = format!("function = \"{function}\"\nunit = \"revolution\"");
    let configuration =
        BOX.replace("unit = \"revolution\"", &line).replace("[axis.limits]\nfollowing_error = 0.5\n", "");
    Settings { configuration, ..Settings::default() }
}

#[test]
fn an_encoder_is_seen_and_never_switched_on() {
    let mut rig = Rig::ready(with_function("encoder"));
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    rig.run_until(millis(10_000), "Running", |rig| state(rig) == AxisState::Running);
    for asked in [AxisControl::ENABLE, AxisControl::NONE, AxisControl(200), AxisControl::ENABLE] {
        request(&mut rig, asked);
        rig.run_for(millis(300));
    }
    assert_eq!((state(&rig), rig.watched[0].changes.len()), (AxisState::Running, 0));
    assert!(rig.torque_free());
    let seen = rig.axis_states(0);
    assert!(!seen.contains(&AxisState::Stopped) && !seen.contains(&AxisState::Starting), "{seen:?}");
    request(&mut rig, AxisControl::SHUTDOWN);
    rig.run_until(millis(100), "Shutdown", |rig| state(rig) == AxisState::Shutdown);
    request(&mut rig, AxisControl::SHUTDOWN_RESET);
    rig.run_until(millis(100), "Running", |rig| state(rig) == AxisState::Running);
}

#[test]
fn a_converter_runs_while_its_bus_is_up() {
    let mut rig = Rig::ready(with_function("converter"));
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    rig.run_until(millis(10_000), "Running", |rig| state(rig) == AxisState::Running);
    request(&mut rig, AxisControl::ENABLE);
    rig.run_for(millis(300));
    assert_eq!((state(&rig), rig.watched[0].changes.len()), (AxisState::Running, 0));
    rig.drive_mut(0).set_main_power(false);
    rig.run_until(millis(1_000), "Pre-Charge", |rig| state(rig) == AxisState::PreCharge);
    rig.drive_mut(0).set_main_power(true);
    rig.run_until(millis(1_000), "Running", |rig| state(rig) == AxisState::Running);
    assert!(rig.torque_free());
}
