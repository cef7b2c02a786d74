//! Something is wrong with a drive, or with a command.

use std::cell::RefCell;
use std::net::SocketAddrV4;
use std::rc::Rc;

use axisbridge::engine::axis::{Awaited, SILENCE_TIME_OUT};
use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, SLIDE, TURNTABLE, at_rest, both, in_motion, millis};
use axisbridge_tests::rig::motion_checker::violation::Rule;
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Failure, Step};
use profile_cip::device::exception::ExceptionAction;
use profile_cip::device::fault_log::LogKind;
use profile_cip::wire::class1::CLASS1_HEADER_LEN;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::motion::attribute_list::{AttributeSelector, Range};
use profile_cip::wire::motion::codes::{AlarmType, AxisStateCode, ClearingEvent, FaultType, NodeFault};
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::inhibit::Inhibits;
use profile_generic::quantity::Torque;
use profile_generic::state::{DriveState, Report};

const TURNTABLE_ONLY: AxisSet = AxisSet::one(1);

/// What the drive's error is told as before its words have been read: number 1 of the manufacturer.
const UNDIAGNOSED: (FaultType, u8) = (FaultType::AXIS_MFG, 1);

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
    assert_eq!(codes(&rig, 0), [UNDIAGNOSED, (FaultType::AXIS, 10)]);
    assert_eq!(rig.report().axes[0].faults.kept()[1].sub_code, 0x80);
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::MAJOR_FAULTED));
    assert_eq!(rig.drive(0).actual().report, Report::Faulted);
    assert!(!rig.watched[0].on && rig.watched[1].on);
    assert_eq!(drive_says(&rig, 0), ["the drive reports 0xC00F0007 \"overcurrent error\""]);
    assert_eq!(drive_says(&rig, 1), [""; 0]);
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
        assert_eq!(codes(&rig, 1), [UNDIAGNOSED, (FaultType::AXIS, code)], "{name}");
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
    assert_eq!(codes(&rig, 1), [UNDIAGNOSED, (FaultType::AXIS, 33)]);
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
    // The controller's own curve does not have this jump, and without limits of the axis nothing in the box holds it up.
    rig.motion_checker
        .allow("a jump without limits", |found| matches!(found.rule, Rule::Velocity | Rule::Acceleration));
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

/// Alarm type, code and state of each entry of an axis' alarm log that the controller got.
fn alarms(rig: &Rig, place: usize) -> Vec<(AlarmType, u8, u8)> {
    let kept = rig.report().axes[place].alarms.kept().to_vec();
    kept.iter().map(|alarm| (alarm.alarm_type, alarm.code, alarm.state)).collect()
}

#[test]
fn a_warning_of_the_drive_is_an_alarm_while_it_lasts_and_stops_nothing() {
    let mut rig = in_motion(Settings::default());
    // Motor overtemperature warning: Motor Overtemperature UL.
    rig.drive_mut(0).set_warnings(1 << 2);
    rig.run_for(millis(100));
    let came = (AlarmType::AXIS, 6, 1);
    assert_eq!(alarms(&rig, 0), [came]);
    // Number and text of the drive follow, once.
    rig.run_for(millis(200));
    assert_eq!(drive_says(&rig, 0), ["the drive reports 0xC00E0002 \"motor overtemperature warning\""]);
    // Another one while the first stands: the status word does not change, the word is read again.
    rig.drive_mut(0).set_warnings(1 << 2 | 1 << 15);
    rig.run_for(millis(400));
    let second = (AlarmType::AXIS_MFG, 29, 1);
    assert_eq!(alarms(&rig, 0), [came, second]);
    rig.drive_mut(0).set_warnings(1 << 15);
    rig.run_for(millis(400));
    assert_eq!(alarms(&rig, 0), [came, second, (AlarmType::AXIS, 6, 0)]);
    rig.drive_mut(0).set_warnings(0);
    rig.run_for(millis(50));
    assert_eq!(
        alarms(&rig, 0).last(),
        Some(&(AlarmType::AXIS_MFG, 29, 0)),
        "gone with the bit of the status word"
    );
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::RUNNING));
    assert_eq!(codes(&rig, 0), []);
    let words = *rig.engine.devices()[0].device().fault_words(0).expect("an axis");
    assert_eq!((words.exceptions, words.alarms), ([0, 0], [0; 4]));
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

#[test]
fn a_warning_that_shall_be_a_major_fault_stops_the_axis_by_its_own_cause() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        action_of(1, 6, ExceptionAction::MAJOR_FAULT),
        Step::Enable(TURNTABLE_ONLY),
        Step::MoveAbsolute { axis: 1, position: 40.0, limits: TURNTABLE },
    ]);
    rig.run_until(millis(20_000), "full speed", |rig| rig.velocity(0) > 49 * NANO / 10);
    rig.drive_mut(0).set_warnings(1 << 2);
    rig.run_until(millis(100), "the fault", |rig| rig.engine.axes()[0].fault().is_some());
    let fault = rig.engine.axes()[0].fault().map(|fault| (fault.cause, fault.reaction));
    let cause = FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT;
    assert_eq!(fault, Some((cause, Reaction::DecelerateAndDisable)));
    let report = rig.run(millis(20_000));
    assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 1, .. })), "{report}");
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS, 6)]);
    rig.run_until(millis(3_000), "rest", at_rest);
    assert!(rig.torque_free());
}

#[test]
fn an_action_that_changes_counts_for_a_warning_that_stands() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(TURNTABLE_ONLY),
        Step::Disable(TURNTABLE_ONLY),
        Step::Dwell { seconds: 0.5 },
        action_of(1, 6, ExceptionAction::MAJOR_FAULT),
        Step::Dwell { seconds: 0.5 },
        Step::FaultReset(TURNTABLE_ONLY),
        Step::Enable(TURNTABLE_ONLY),
        Step::Disable(TURNTABLE_ONLY),
    ]);
    rig.run_until(millis(20_000), "the disable", |rig| rig.report().steps_finished == 2);
    rig.drive_mut(0).set_warnings(1 << 2);
    rig.run_until(millis(20_000), "the action", |rig| rig.report().steps_finished == 4);
    rig.run_for(millis(100));
    assert_eq!(alarms(&rig, 0), [(AlarmType::AXIS, 6, 1), (AlarmType::AXIS, 6, 0)], "no alarm any more");
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::MAJOR_FAULTED));
    let axis = &rig.engine.axes()[0];
    assert_eq!((axis.state(), axis.fault()), (DriveState::Ready, None), "there is no torque to take away");
    rig.drive_mut(0).set_warnings(0);
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, codes(&rig, 0)), (None, vec![(FaultType::AXIS, 6)]), "{}", rig.log());
}

/// Diagnostic messages of the drive that were logged, in order.
fn drive_says(rig: &Rig, axis: u8) -> Vec<String> {
    let says = |notice: &&Notice| matches!(notice, Notice::DriveSays { axis: of, .. } if *of == axis);
    rig.notices.iter().filter(says).map(ToString::to_string).collect()
}

/// Sets one element of Axis Exception Action.
fn action_of(axis: u8, exception: u16, action: ExceptionAction) -> Step {
    let range = Range { start: exception, count: 1 };
    let selector = AttributeSelector::array(672, 1, &[range]).expect("one dimension");
    let set = AttributeSet { selector, value: vec![action.0], required: true };
    Step::SetAttributes { axis, attributes: vec![set] }
}

/// The turntable turns faster than the box is told to let it.
fn too_fast() -> Settings {
    let configuration = BOX.replace("following_error = 0.5", "following_error = 0.5\nvelocity = 4.6");
    Settings { configuration, ..Settings::default() }
}

/// At full speed, which is within the limit; then the load pushes the axis beyond it.
fn pushed(action: ExceptionAction) -> Rig {
    let mut rig = Rig::ready(too_fast());
    rig.connect(turn(action));
    rig.run_until(millis(20_000), "full speed", |rig| rig.velocity(0) > 49 * NANO / 10);
    rig.drive_mut(0).servo_mut().set_load(Torque(-1_500_000));
    rig
}

fn turn(action: ExceptionAction) -> Vec<Step> {
    vec![
        action_of(1, 4, action),
        Step::Enable(TURNTABLE_ONLY),
        Step::MoveAbsolute { axis: 1, position: 4.0, limits: TURNTABLE },
        Step::Disable(TURNTABLE_ONLY),
    ]
}

#[test]
fn what_the_box_watches_is_ignored_told_or_obeyed_as_the_controller_says() {
    // Motor Overspeed UL, bit 4.
    let cases = [
        (ExceptionAction::IGNORE, vec![], 0),
        (ExceptionAction::ALARM, vec![], 2),
        (ExceptionAction::MINOR_FAULT, vec![(FaultType::AXIS, 4)], 0),
    ];
    for (action, faults, records) in cases {
        let mut rig = pushed(action);
        let mut seen = 0;
        rig.run_until(millis(20_000), "the overspeed", |rig| {
            seen |= rig.engine.devices()[0].device().fault_words(0).expect("an axis").exceptions[0];
            seen != 0
        });
        rig.drive_mut(0).servo_mut().set_load(Torque::ZERO);
        rig.run_until(millis(20_000), "the end", |rig| rig.report().steps_finished == 4);
        assert_eq!(seen, 1 << 4, "{action}: seen in Axis Exceptions");
        assert_eq!(rig.report().failure, None, "{action}: {}", rig.log());
        assert_eq!(codes(&rig, 0), faults, "{action}");
        // It comes and goes, once or twice.
        let seen = alarms(&rig, 0).len();
        assert!(seen >= records && seen.is_multiple_of(2) && (records > 0 || seen == 0), "{action}: {seen}");
        assert!((rig.position(0) - 4 * NANO).abs() < NANO / 100, "{action}: {}", rig.position(0));
    }
    let mut rig = pushed(ExceptionAction::MAJOR_FAULT);
    rig.run_until(millis(20_000), "the fault", |rig| rig.engine.axes()[0].fault().is_some());
    rig.drive_mut(0).servo_mut().set_load(Torque::ZERO);
    assert_eq!(
        rig.engine.axes()[0].fault().map(|fault| fault.cause),
        Some(FaultCause::MOTOR_OVER_SPEED_USER_LIMIT)
    );
    let report = rig.run(millis(20_000));
    assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 1, .. })), "{report}");
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS, 4)]);
    // Stopped under control: a current limited stop (3), then disabled (2).
    assert_eq!(rig.report().axes[0].faults.kept()[0].action, 0x23);
    rig.run_until(millis(3_000), "rest", at_rest);
    assert!(rig.torque_free());
    assert_eq!(rig.engine.axes()[0].fault(), None, "the Forward_Close of the controller has cleared it");
}

/// Excessive Position Error that the box finds, because its tolerance is narrower than the drive's.
fn astray(action: ExceptionAction) -> Rig {
    let configuration = BOX.replace("following_error = 0.5", "following_error = 0.00001");
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    // The drive is told to look away: Position Error Tolerance.
    let tolerance = vec![AttributeSet::real(444, 500_000.0)];
    rig.connect(vec![
        Step::SetAttributes { axis: 1, attributes: tolerance },
        action_of(1, 54, action),
        Step::Enable(TURNTABLE_ONLY),
        Step::MoveAbsolute { axis: 1, position: 4.0, limits: TURNTABLE },
        Step::Disable(TURNTABLE_ONLY),
    ]);
    rig.run(millis(20_000));
    rig
}

#[test]
fn an_excessive_position_error_that_the_box_finds_can_be_ignored_and_one_of_the_drive_cannot() {
    let rig = astray(ExceptionAction::IGNORE);
    assert_eq!((rig.report().failure, codes(&rig, 0)), (None, vec![]), "{}", rig.log());
    let rig = astray(ExceptionAction::MAJOR_FAULT);
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS, 54)]);
    assert!(matches!(rig.report().failure, Some(Failure::AxisNotRunning { axis: 1, .. })));

    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        action_of(1, 54, ExceptionAction::IGNORE),
        Step::Enable(TURNTABLE_ONLY),
        Step::Dwell { seconds: 5.0 },
    ]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 2);
    rig.drive_mut(0).raise_fault(FaultCause::EXCESSIVE_POSITION_ERROR);
    rig.run_for(millis(500));
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::MAJOR_FAULTED));
    let told = [UNDIAGNOSED, (FaultType::AXIS, 54)];
    assert_eq!(codes(&rig, 0), told, "the drive is off, whatever the attribute says");
}

#[test]
fn an_action_that_the_drive_would_not_obey_is_refused() {
    let mut rig = Rig::ready(Settings::default());
    // Bus Undervoltage FL: the drive switches itself off.
    rig.connect(vec![action_of(1, 33, ExceptionAction::MINOR_FAULT)]);
    let report = rig.run(millis(20_000));
    let failure = report.failure.expect("a refusal").to_string();
    assert!(failure.contains("672"), "{failure}");
}

#[test]
fn two_faults_at_once_are_both_told_and_one_reset_ends_both() {
    let mut rig = in_motion(Settings::default());
    // Undervoltage besides the overcurrent, then overvoltage a second later.
    rig.drive_mut(0).set_further_errors(1 << 9);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    rig.run_for(millis(200));
    assert_eq!(codes(&rig, 0), [UNDIAGNOSED, (FaultType::AXIS, 10), (FaultType::AXIS, 33)]);
    rig.drive_mut(0).set_further_errors(1 << 9 | 1 << 8);
    rig.run_for(millis(400));
    // The controller has given up by now; the box still sees it.
    let there: Vec<_> = rig.engine.axes()[0].faults().map(|active| active.fault.cause).collect();
    let expected = [FaultCause::OVER_CURRENT, FaultCause::UNDER_VOLTAGE, FaultCause::OVER_VOLTAGE];
    assert_eq!(there, expected);
    rig.run(millis(30_000));
    // The controller's Forward_Close has had the drive reset its faults, in vain.
    rig.run_for(millis(6_000));
    let fault = rig.engine.axes()[0].fault().map(|fault| fault.cause);
    assert!(fault.is_some_and(|cause| expected.contains(&cause)), "{fault:?}");
    rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT);
    rig.drive_mut(0).set_further_errors(0);
    rig.connect(vec![
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        Step::Disable(both()),
    ]);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

#[test]
fn a_reset_with_the_condition_still_there_is_a_fault_again_with_a_record_of_its_own() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(TURNTABLE_ONLY),
        Step::Dwell { seconds: 0.3 },
        Step::FaultReset(TURNTABLE_ONLY),
        Step::Dwell { seconds: 1.0 },
    ]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_VOLTAGE);
    rig.run(millis(30_000));
    let fault = (FaultType::AXIS, 35);
    let told: Vec<_> =
        rig.report().axes[0].faults.kept().iter().map(|record| (record.fault_type, record.code)).collect();
    assert_eq!(told, [UNDIAGNOSED, fault, fault], "which one it is was known when the reset was asked for");
    let log = rig.engine.devices()[0].fault_log(0).expect("an axis");
    let entries: Vec<_> =
        log.entries().map(|entry| (entry.kind, entry.code, entry.ended.map(|(by, _)| by))).collect();
    let of = |(fault_type, code)| (LogKind::Fault(fault_type), code, Some(ClearingEvent::FAULT_RESET));
    assert_eq!(entries.len(), 3);
    assert_eq!(entries[1..], [of(fault), of(UNDIAGNOSED)], "the newest first");
    assert_eq!(
        rig.axis_states(0).last().map(ToString::to_string).as_deref(),
        Some("Initializing"),
        "closed by now"
    );
}

#[test]
fn a_lost_drive_is_major_faulted_when_nobody_waits_for_its_stop_any_longer_and_a_reset_does_not_help() {
    let slide_only = AxisSet::one(2);
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(slide_only),
        Step::Dwell { seconds: 3.0 },
        Step::FaultReset(slide_only),
        Step::Dwell { seconds: 60.0 },
    ]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    rig.line.cut(1);
    let device = |rig: &Rig| rig.engine.devices()[0].device().axis_state(1).expect("an axis").to_string();
    rig.run_until(millis(200), "the fault", |rig| device(rig) == "Aborting");
    let since = rig.now();
    rig.run_until(SILENCE_TIME_OUT + millis(500), "the time limit", |rig| device(rig) != "Aborting");
    assert!(rig.now().since(since) > SILENCE_TIME_OUT - millis(50), "not before: nobody has seen it stop");
    assert_eq!(device(&rig), "Major Faulted");
    rig.run_for(millis(8_000));
    assert_eq!(device(&rig), "Major Faulted", "it is still not there");
    let log = rig.engine.devices()[0].fault_log(1).expect("an axis");
    let silence =
        log.entries().filter(|entry| entry.kind == LogKind::Fault(FaultType::AXIS_MFG) && entry.code == 17);
    assert!(silence.count() >= 1);
}

/// It keeps its links up and passes nothing on: nobody turns the telegrams round for it, and nothing comes back at all.
#[test]
fn a_drive_that_hangs_with_its_link_up_is_left_out_while_the_one_in_front_of_it_moves() {
    let turntable = AxisSet::one(1);
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(turntable),
        Step::MoveAbsolute { axis: 1, position: 60.0, limits: TURNTABLE },
        Step::WaitInWindow { axis: 1, window: 0.001, seconds: 1.0 },
        Step::Disable(turntable),
    ]);
    rig.run_until(millis(5_000), "full speed", |rig| rig.velocity(0) > 49 * NANO / 10);
    let before = rig.status();
    rig.line.set_hung(1, true);
    let mut slowest = i64::MAX;
    rig.run_until(millis(500), "the search", |rig| {
        slowest = slowest.min(rig.velocity(0));
        rig.told().contains("passes no telegrams on")
    });
    assert!(slowest > 49 * NANO / 10, "{slowest}");
    let line = "slave at position 2 with address 2 passes no telegrams on though its link is up: those from port 1 are \
                turned round in front of it by the slave with address 1";
    assert_eq!(rig.told().lines().filter(|told| *told == line).count(), 1, "{}", rig.told());
    let report = rig.run(millis(60_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    assert!((rig.position(0) - 60 * NANO).abs() < NANO / 1_000);
    assert_eq!(rig.status().axes[0].faults, 0);
    // Two cycles in which nothing came back; in the third one the turntable turned the telegrams round.
    assert_eq!(rig.status().axes[0].lost_telegrams - before.axes[0].lost_telegrams, 2);
    // Nobody is connected any more, and still the bus is not started anew: phase 0 would find nobody.
    rig.run_for(millis(60_000));
    assert_eq!(rig.status().phase, 4, "{}", rig.told());
}

/// What the controller gets as a status, the log has as a sentence.
#[test]
fn a_refused_enable_is_logged_with_its_reason() {
    let mut rig = Rig::ready(Settings::default());
    rig.drive_mut(0).set_main_power(false);
    rig.connect(vec![Step::Enable(AxisSet::NONE.with(1))]);
    rig.run_for(millis(3_000));
    let text =
        "axis 1: the request Enable (1) was refused with status 0x0c: the axis came to Major Faulted instead";
    assert_eq!(rig.told().lines().filter(|line| *line == text).count(), 1, "{}\n{}", rig.told(), rig.log());
}

/// Nothing happens, and somebody stands before the machine: the log says what each axis waits for, and by which bit of which word.
#[test]
fn an_axis_that_waits_for_longer_than_a_second_says_what_for() {
    let mut rig = Rig::ready(Settings::default());
    rig.drive_mut(0).set_main_power(false);
    rig.run_for(millis(12_000));
    let waits = |rig: &Rig, of: u8| -> Vec<String> {
        let notices = rig.notices.iter();
        notices
            .filter(|notice| matches!(notice, Notice::Waiting { axis, .. } if *axis == of))
            .map(ToString::to_string)
            .collect()
    };
    let line = |seconds| {
        format!(
            "has waited {seconds} s for its drive to be ready, or for main power; S-0-0135 = 4000, expected \
             bit 14 = 0, bit 15 = 1"
        )
    };
    let up = "has waited 1 s for its drive: it is not on the bus, or not commissioned yet".to_owned();
    let told = [up.clone(), line(1), line(10)];
    assert_eq!(waits(&rig, 0), told, "after a second, and ten times as long after it");
    assert_eq!(waits(&rig, 1), std::slice::from_ref(&up), "it has all it needs");
    // The status has the same line, and the inhibits say it in a bit.
    let shown =
        |rig: &Rig| rig.status().axes[..2].iter().map(|axis| (axis.wait, axis.inhibits)).collect::<Vec<_>>();
    let now = shown(&rig);
    let (wait, inhibits) = now[0];
    let wait = wait.expect("it waits");
    assert_eq!(wait.to_string(), line(wait.seconds), "{} s", wait.seconds);
    assert!((10..12).contains(&wait.seconds), "{} s", wait.seconds);
    assert_eq!((wait.item(), wait.word(), wait.mask(), wait.value()), (135, 0x4000, 0xC000, 0x8000));
    // No controller has configured either.
    let unconfigured = Inhibits::CONFIGURATION_INCOMPLETE;
    assert_eq!((inhibits, now[1]), (Inhibits::NO_POWER | unconfigured, (None, unconfigured)));
    rig.drive_mut(0).set_main_power(true);
    rig.line.cut(1);
    rig.run_for(millis(3_000));
    assert_eq!(waits(&rig, 0).len(), 3);
    assert_eq!(waits(&rig, 1), [up, "has waited 1 s for its drive to be heard again".to_owned()]);
    let now = shown(&rig);
    assert_eq!(now[0], (None, unconfigured), "it has power");
    assert_eq!(now[1].1, Inhibits::NO_DRIVE | unconfigured);
    let wait = now[1].0.expect("it waits");
    assert_eq!((wait.waiting.awaited, wait.waiting.shown), (Awaited::Hearing, None));
}

/// Volume 9 has a state and a status bit for missing power, and no start inhibit (Table 5-2.74): the axis is in Pre-Charge with
/// DC Bus Up at 0, no bit of 676 and 677 is set, and an Enable is an error that leaves it there.
#[test]
fn an_axis_without_main_power_is_in_pre_charge_and_not_start_inhibited() {
    let mut rig = Rig::ready(Settings::default());
    rig.drive_mut(0).set_main_power(false);
    rig.connect(vec![Step::Dwell { seconds: 4.0 }]);
    rig.run_for(millis(2_500));
    let client = Client::connect(&mut rig, CONTROLLER);
    let mut word = |instance, id| {
        let (status, data) = client.ask(&mut rig, 0x0E, instance, Some(id), &[]);
        assert_eq!(status, 0, "attribute {id}");
        data.iter().rev().fold(0_u32, |word, octet| word << 8 | u32::from(*octet))
    };
    let [pre_charge, stopped] =
        [AxisStateCode::PRE_CHARGE, AxisStateCode::STOPPED].map(|state| u32::from(state.0));
    assert_eq!([1, 2].map(|axis| word(axis, 650)), [pre_charge, stopped]);
    // Axis Status, DC Bus Up.
    assert_eq!([1, 2].map(|axis| word(axis, 651) >> 2 & 1), [0, 1]);
    assert_eq!([676, 677].map(|id| word(1, id)), [0, 0]);
    assert_eq!(rig.status().axes[0].inhibits, Inhibits::NO_POWER, "the box's own status says it");
}

/// Of two calls of the gateway the first brings a wrong update and the second the reset: the axis shows in the second one that it stops
/// for the fault of the node.
#[test]
fn a_node_fault_that_is_reset_in_the_next_cycle_leaves_no_other_one_behind() {
    // Where the counters stand, and behind the class 1 header format, Update ID and Node Control with the bit Node Fault Reset.
    const COUNTERS: [usize; 3] = [10, 18, CLASS1_HEADER_LEN + 2];
    const FORMAT: usize = CLASS1_HEADER_LEN;
    const NODE_CONTROL: usize = CLASS1_HEADER_LEN + 3;
    const RESET: u8 = 1 << 3;
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Enable(TURNTABLE_ONLY), Step::Dwell { seconds: 5.0 }]);
    rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
    rig.run_for(millis(200));
    let spoiled = Rc::new(RefCell::new(None));
    let sent = Rc::clone(&spoiled);
    rig.tamper_command = Some(Box::new(move |datagram| {
        let is_first = sent.borrow().is_none();
        if is_first {
            *sent.borrow_mut() = Some(datagram.as_slice().to_vec());
            datagram.as_mut_slice()[FORMAT] = 0xFF;
        }
        is_first
    }));
    let node = |rig: &Rig| rig.engine.devices()[0].device().node_fault();
    rig.run_until(millis(20), "the node fault", |rig| node(rig) == NodeFault::DATA_FORMAT);
    let mut next = spoiled.borrow_mut().take().expect("the update");
    for at in COUNTERS {
        next[at] = next[at].wrapping_add(1);
    }
    next[NODE_CONTROL] |= RESET;
    rig.inject_datagram(&next, SocketAddrV4::new(CONTROLLER, IO_PORT));
    rig.cycle_in(|cycle| cycle());
    let axis = &rig.engine.axes()[0];
    assert_eq!(
        (axis.fault().map(|fault| fault.cause), node(&rig)),
        (Some(FaultCause::COMMAND_LOST), NodeFault::NONE)
    );
    rig.cycle_in(|cycle| cycle());
    assert_eq!(node(&rig), NodeFault::NONE, "{}", rig.told());
}
