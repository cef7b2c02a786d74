//! The whole axis, without a drive's program: what its parts do together about faults.

use super::*;
use profile_generic::fault::FaultCause;
use profile_generic::fault_set::Origin;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::Request;
use profile_generic::time::SystemTime;

const NOW: MonotonicTime = MonotonicTime(5_000_000_000);
const SYSTEM: SystemTime = SystemTime(9);

const OVERTRAVEL: FaultCause = FaultCause::HARDWARE_OVERTRAVEL_POSITIVE;
const OVERSPEED: FaultCause = FaultCause::MOTOR_OVER_SPEED_USER_LIMIT;

/// An axis in operation.
fn operating() -> AxisChannel {
    let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
    axis.report(NOW, SYSTEM, Report::Ready);
    axis.request(NOW, SYSTEM, Request::Enable);
    axis.report(NOW, SYSTEM, Report::Operating);
    assert_eq!((axis.state(), axis.action()), (DriveState::Operating, Action::Enable));
    axis
}

fn wants(axis: &mut AxisChannel, rows: &[(FaultCause, Reaction)]) {
    let mut reactions = Reactions::default();
    for (cause, reaction) in rows {
        reactions.set(*cause, *reaction);
    }
    axis.set_reactions(NOW, SYSTEM, &reactions);
}

fn watched(axis: &mut AxisChannel, cause: FaultCause) {
    axis.watch_conditions(NOW, SYSTEM, &[(cause, true)]);
}

fn cause(axis: &AxisChannel) -> Option<FaultCause> {
    axis.fault().map(|fault| fault.cause)
}

#[test]
fn what_is_watched_stops_the_axis_at_once_or_is_only_there_as_the_north_side_wants() {
    let rows = [
        (None, DriveState::FaultReaction, Action::Disable),
        (Some(Reaction::Ignore), DriveState::Operating, Action::Enable),
        (Some(Reaction::Alarm), DriveState::Operating, Action::Enable),
        (Some(Reaction::HoldPosition), DriveState::FaultReaction, Action::Disable),
        (Some(Reaction::CoastAndDisable), DriveState::FaultReaction, Action::TorqueOff),
    ];
    for (configured, state, action) in rows {
        let mut axis = operating();
        wants(&mut axis, &configured.map_or(vec![], |reaction| vec![(OVERSPEED, reaction)]));
        watched(&mut axis, OVERSPEED);
        assert_eq!((axis.state(), axis.action()), (state, action), "{configured:?}");
        assert!(axis.fault_set().contains(OVERSPEED, Origin::Watch), "{configured:?}");
        assert_eq!(cause(&axis).is_some(), state == DriveState::FaultReaction, "{configured:?}");
    }
}

#[test]
fn two_faults_at_once_stop_the_axis_by_the_more_severe_reaction_and_the_first_is_its_fault() {
    for (first, second, action) in [
        (Reaction::DecelerateAndDisable, Reaction::CoastAndDisable, Action::TorqueOff),
        (Reaction::CoastAndDisable, Reaction::DecelerateAndDisable, Action::TorqueOff),
        (Reaction::Alarm, Reaction::DecelerateAndDisable, Action::Disable),
    ] {
        let mut axis = operating();
        wants(&mut axis, &[(OVERSPEED, first), (OVERTRAVEL, second)]);
        watched(&mut axis, OVERSPEED);
        watched(&mut axis, OVERTRAVEL);
        assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, action), "{first} {second}");
        let expected = if first.stops() { (OVERSPEED, first) } else { (OVERTRAVEL, second) };
        let fault = axis.fault().expect("a fault");
        assert_eq!((fault.cause, fault.reaction), expected, "each with its own reaction");
    }
}

#[test]
fn a_fault_of_the_drive_is_not_made_milder_by_the_configuration() {
    let mut axis = operating();
    wants(&mut axis, &[(FaultCause::OVER_CURRENT, Reaction::Ignore)]);
    let reaction = FaultCause::OVER_CURRENT.default_reaction();
    axis.drive_fault(NOW, SYSTEM, FaultCause::OVER_CURRENT, reaction, 7);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::TorqueOff));
    // The same cause as something that the gateway watches is for the configuration to say.
    let mut axis = operating();
    let ignored = [FaultCause::OVER_CURRENT, FaultCause::VELOCITY_COMMAND_LIMIT];
    wants(&mut axis, &ignored.map(|cause| (cause, Reaction::Ignore)));
    watched(&mut axis, FaultCause::OVER_CURRENT);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Operating, None));
    // And what the gateway stops for itself stops it.
    axis.raise(NOW, SYSTEM, Fault::new(FaultCause::VELOCITY_COMMAND_LIMIT, SYSTEM));
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Disable));
}

#[test]
fn a_warning_stops_the_axis_only_where_it_is_told_to() {
    let warning = Fault::new(FaultCause::MOTOR_OVERLOAD, SYSTEM).with_reaction(Reaction::Alarm);
    let mut axis = operating();
    assert!(axis.notice(NOW, SYSTEM, warning, Origin::Warning));
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Operating, None));
    let mut axis = operating();
    wants(&mut axis, &[(FaultCause::MOTOR_OVERLOAD, Reaction::HoldPosition)]);
    assert!(axis.notice(NOW, SYSTEM, warning, Origin::Warning));
    assert_eq!(axis.action(), Action::Disable, "a controlled stop is the best that it leaves");
}

#[test]
fn another_configuration_counts_for_a_fault_that_stands() {
    let mut axis = operating();
    wants(&mut axis, &[(OVERSPEED, Reaction::Alarm), (OVERTRAVEL, Reaction::Ignore)]);
    watched(&mut axis, OVERSPEED);
    watched(&mut axis, OVERTRAVEL);
    assert_eq!(axis.state(), DriveState::Operating);
    // Another cause altogether: nothing follows.
    wants(
        &mut axis,
        &[
            (OVERSPEED, Reaction::Alarm),
            (OVERTRAVEL, Reaction::Ignore),
            (FaultCause::HOMING, Reaction::Shutdown),
        ],
    );
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Operating, None));
    wants(&mut axis, &[(OVERSPEED, Reaction::Alarm), (OVERTRAVEL, Reaction::HoldPosition)]);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Disable));
    assert_eq!(cause(&axis), Some(OVERTRAVEL), "the one that now stops it, and not the one that came first");
}

#[test]
fn another_configuration_makes_a_stop_under_way_harder_and_never_milder() {
    let mut axis = operating();
    wants(&mut axis, &[(OVERSPEED, Reaction::DecelerateAndDisable)]);
    watched(&mut axis, OVERSPEED);
    assert_eq!(axis.action(), Action::Disable);
    wants(&mut axis, &[(OVERSPEED, Reaction::CoastAndDisable)]);
    assert_eq!(axis.action(), Action::TorqueOff);
    wants(&mut axis, &[(OVERSPEED, Reaction::Ignore)]);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::TorqueOff));
    assert_eq!(cause(&axis), Some(OVERSPEED), "it has stopped the axis, and stays until a reset");
}

#[test]
fn what_stands_without_torque_stops_nothing_and_lets_no_axis_start() {
    let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
    axis.report(NOW, SYSTEM, Report::Ready);
    let warning = Fault::new(FaultCause::MOTOR_OVERLOAD, SYSTEM).with_reaction(Reaction::Alarm);
    axis.notice(NOW, SYSTEM, warning, Origin::Warning);
    wants(&mut axis, &[(FaultCause::MOTOR_OVERLOAD, Reaction::HoldPosition)]);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Ready, None), "nothing to stop");
    axis.request(NOW, SYSTEM, Request::Enable);
    assert_eq!(axis.state(), DriveState::FaultReaction);
    assert_eq!((axis.action(), cause(&axis)), (Action::Disable, Some(FaultCause::MOTOR_OVERLOAD)));
}

#[test]
fn a_fault_that_the_state_machine_finds_has_the_configured_reaction_too() {
    let mut axis = operating();
    wants(&mut axis, &[(FaultCause::SAFE_TORQUE_OFF, Reaction::Shutdown)]);
    axis.set_inhibits(NOW, SYSTEM, Inhibits::SAFETY);
    let fault = axis.fault().expect("a fault");
    assert_eq!((fault.cause, fault.reaction), (FaultCause::SAFE_TORQUE_OFF, Reaction::Shutdown));
}

#[test]
fn a_reset_ends_the_fault_and_a_condition_that_comes_again_is_one_again() {
    let mut axis = operating();
    watched(&mut axis, OVERSPEED);
    axis.watch_conditions(NOW, SYSTEM, &[(OVERSPEED, false)]);
    axis.report(NOW, SYSTEM, Report::Ready);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Faulted, Some(OVERSPEED)));
    axis.want_reset(NOW, SYSTEM, 1);
    axis.report(NOW, SYSTEM, Report::Ready);
    assert_eq!((axis.state(), cause(&axis), axis.reset_id()), (DriveState::Ready, None, 1));
    axis.request(NOW, SYSTEM, Request::Enable);
    axis.report(NOW, SYSTEM, Report::Operating);
    watched(&mut axis, OVERSPEED);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::FaultReaction, Some(OVERSPEED)));
}

/// An axis that was enabled by a wish and is in operation.
fn enabled_by_wish() -> AxisChannel {
    let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
    axis.report(NOW, SYSTEM, Report::Ready);
    axis.take_wish(NOW, SYSTEM, Wish { intent: Intent::Enable, request: Some(Request::Enable) });
    axis.report(NOW, SYSTEM, Report::Operating);
    assert_eq!(axis.state(), DriveState::Operating);
    axis
}

#[test]
fn rejected_fault_reset_leaves_no_enable_behind() {
    let mut axis = enabled_by_wish();
    watched(&mut axis, OVERSPEED);
    axis.watch_conditions(NOW, SYSTEM, &[(OVERSPEED, false)]);
    axis.want_reset(NOW, SYSTEM, 1);
    // The drive keeps its torque beyond the time limit of the stop, and the reset is rejected.
    let late = NOW + STOP_TIME_OUT + DurationNs(1);
    axis.report(late, SYSTEM, Report::Operating);
    assert_eq!(axis.state(), DriveState::Faulted);
    axis.report(late, SYSTEM, Report::Ready);
    axis.want_reset(late, SYSTEM, 2);
    axis.report(late, SYSTEM, Report::Ready);
    axis.retry_wish(late, SYSTEM);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Ready, None));
}

#[test]
fn rejected_enable_is_tried_again_and_ends_with_a_fault_or_another_north_side() {
    type End = (&'static str, fn(&mut AxisChannel), DriveState);
    let ends: [End; 3] = [
        ("nothing", |_| {}, DriveState::Starting),
        ("another north side", AxisChannel::begin_north, DriveState::Ready),
        (
            "a fault",
            |axis| {
                axis.raise(NOW, SYSTEM, Fault::new(FaultCause::COMMAND_LOST, SYSTEM));
                axis.want_reset(NOW, SYSTEM, 1);
            },
            DriveState::Ready,
        ),
    ];
    for (what, happens, state) in ends {
        let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
        axis.report(NOW, SYSTEM, Report::AwaitingPower);
        axis.take_wish(NOW, SYSTEM, Wish { intent: Intent::Enable, request: Some(Request::Enable) });
        assert_eq!(axis.state(), DriveState::AwaitingPower, "{what}");
        happens(&mut axis);
        axis.report(NOW, SYSTEM, Report::Ready);
        axis.retry_wish(NOW, SYSTEM);
        assert_eq!(axis.state(), state, "{what}");
    }
}

/// An axis in operation that a fault tells to hold its position.
fn told_to_hold() -> AxisChannel {
    let mut axis = operating();
    hold(&mut axis);
    axis
}

fn hold(axis: &mut AxisChannel) {
    let fault = Fault::new(FaultCause::CONTROLLER_ABORT, SYSTEM).with_reaction(Reaction::HoldPosition);
    axis.take_fault(NOW, SYSTEM, fault);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Halt));
}

#[test]
fn hold_has_no_time_limit_and_a_later_movement_has_its_own() {
    let held = NOW + STOP_TIME_OUT + DurationNs::from_secs(1);
    let mut axis = told_to_hold();
    axis.report(NOW, SYSTEM, Report::Halted);
    axis.report(held, SYSTEM, Report::Halted);
    // Faster than zero speed: CiA 402 calls that not halted.
    for now in [held + DurationNs(1), held + STOP_TIME_OUT] {
        axis.report(now, SYSTEM, Report::Operating);
        assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Halt));
    }
    axis.report(held + STOP_TIME_OUT + DurationNs(1), SYSTEM, Report::Operating);
    assert_eq!((axis.state(), axis.action()), (DriveState::Faulted, Action::TorqueOff));
    // A drive that is not heard for a moment keeps it as well.
    let mut axis = told_to_hold();
    axis.report(held, SYSTEM, Report::Halted);
    axis.report(held + DurationNs(1), SYSTEM, Report::Silent);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Halt));
    axis.report(held + SILENCE_TIME_OUT + DurationNs(2), SYSTEM, Report::Silent);
    assert_eq!((axis.state(), axis.action()), (DriveState::Faulted, Action::Disable));
}

#[test]
fn wish_without_torque_ends_a_hold_that_is_reached_later() {
    let wishes = [
        Wish { intent: Intent::Shutdown, request: Some(Request::Shutdown) },
        Wish { intent: Intent::Disable, request: Some(Request::Disable) },
        Wish::default(),
    ];
    for wish in wishes {
        let mut axis = told_to_hold();
        axis.report(NOW, SYSTEM, Report::Operating);
        axis.take_wish(NOW, SYSTEM, wish);
        axis.report(NOW, SYSTEM, Report::Halted);
        assert!(matches!(axis.action(), Action::Disable | Action::TorqueOff), "{wish:?}: {}", axis.action());
        assert_eq!(cause(&axis), Some(FaultCause::CONTROLLER_ABORT), "{wish:?}: the fault stays");
    }
    // A wish holds until the next one.
    let abort = Wish { intent: Intent::Abort, request: Some(Request::Abort) };
    let mut axis = told_to_hold();
    axis.take_wish(NOW, SYSTEM, Wish::default());
    axis.take_wish(NOW, SYSTEM, abort);
    axis.report(NOW, SYSTEM, Report::Halted);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Halt));
    // And it is not of the next hold.
    let mut axis = told_to_hold();
    axis.take_wish(NOW, SYSTEM, Wish::default());
    axis.report(NOW, SYSTEM, Report::Ready);
    axis.want_reset(NOW, SYSTEM, 1);
    axis.request(NOW, SYSTEM, Request::Enable);
    axis.report(NOW, SYSTEM, Report::Operating);
    hold(&mut axis);
    axis.report(NOW, SYSTEM, Report::Halted);
    assert_eq!((axis.state(), axis.action()), (DriveState::FaultReaction, Action::Halt));
}

#[test]
fn silent_drive_keeps_its_fault_until_a_reset_after_it_is_heard() {
    let silence = Some(FaultCause::SOUTH_SILENCE);
    let late = NOW + SILENCE_TIME_OUT + DurationNs(1);
    let silent: [fn(&mut AxisChannel); 2] = [
        |axis| {
            axis.report(NOW, SYSTEM, Report::Silent);
            axis.report(NOW + SILENCE_TIME_OUT + DurationNs(1), SYSTEM, Report::Silent);
            assert_eq!((axis.state(), cause(axis)), (DriveState::Faulted, Some(FaultCause::SOUTH_SILENCE)));
            axis.want_reset(NOW, SYSTEM, 1);
        },
        |axis| {
            axis.report(NOW, SYSTEM, Report::Faulted);
            axis.want_reset(NOW, SYSTEM, 1);
            assert_eq!((axis.state(), axis.reset_id()), (DriveState::Faulted, 0), "the drive is waited for");
            axis.report(NOW, SYSTEM, Report::Silent);
        },
    ];
    for silent in silent {
        let mut axis = operating();
        silent(&mut axis);
        assert_eq!((axis.state(), cause(&axis), axis.reset_id()), (DriveState::Faulted, silence, 1));
        axis.report(late, SYSTEM, Report::Ready);
        assert_eq!((axis.state(), cause(&axis)), (DriveState::Faulted, silence));
        axis.want_reset(late, SYSTEM, 2);
        assert_eq!((axis.state(), cause(&axis), axis.reset_id()), (DriveState::Ready, None, 2));
        axis.request(late, SYSTEM, Request::Enable);
        assert_eq!((axis.state(), cause(&axis)), (DriveState::Starting, None));
    }
}

#[test]
fn configuration_fault_of_a_drive_that_was_never_heard_is_reset() {
    let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
    axis.refuse_configuration(NOW, SYSTEM);
    assert_eq!((axis.state(), cause(&axis)), (DriveState::Faulted, Some(FaultCause::CONFIGURATION)));
    axis.want_reset(NOW, SYSTEM, 1);
    assert_eq!((axis.state(), cause(&axis), axis.reset_id()), (DriveState::NotReady, None, 1));
}
