//! Runs that fail: each says what was expected and what came, and leaves nothing open.

use super::peer::Peer;
use super::rig::{Rig, config};
use crate::controller::program::ExplicitMessage;
use crate::controller::{AttributeSet, AxisSet, Controller, ControllerConfig, Failure, Limits, Report, Step};
use crate::wire::motion::codes::{AxisControl, AxisStateCode, NodeAlarm, NodeFault, SyncStatus};
use crate::wire::status::ConnectionStatus;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use proptest::prelude::*;

const LIMITS: Limits = Limits { velocity: 50.0, acceleration: 500.0, jerk: 10_000.0 };

fn enable() -> Step {
    Step::Enable(AxisSet::one(1))
}

fn go() -> Step {
    Step::MoveAbsolute { axis: 1, position: 100.0, limits: LIMITS }
}

/// Runs a program that has to fail, and checks that everything is closed behind it.
fn fail(config: ControllerConfig, peer: Peer, program: Vec<Step>) -> (Rig, Report) {
    let mut rig = Rig::new(config, peer, program);
    let report = rig.run(100);
    assert!(report.failure.is_some(), "{}", rig.log());
    assert!(rig.controller.is_closed());
    (rig, report)
}

fn text(report: &Report) -> String {
    report.failure.unwrap().to_string()
}

#[test]
fn every_refusal_of_a_forward_open_is_told_by_name() {
    let mut lines = String::new();
    let mut refuse = |general: u8, extended: Vec<u16>| {
        let mut peer = Peer::new(&[0.0]);
        peer.refuse_open = Some((general, extended));
        let (rig, report) = fail(config(1), peer, vec![enable()]);
        assert_eq!(rig.peer.seen.last().map(String::as_str), Some("UnRegisterSession"));
        assert_eq!(report.cycles, 0);
        lines += &format!("{}\n", text(&report));
    };
    for (status, _) in ConnectionStatus::NAMED {
        refuse(1, vec![status.0]);
    }
    refuse(1, vec![ConnectionStatus::INVALID_O_TO_T_SIZE.0, 220]);
    refuse(1, vec![0x0999]);
    refuse(9, vec![4]);
    refuse(9, vec![7]);
    refuse(2, vec![]);
    refuse(0xFE, vec![]);
    insta::assert_snapshot!(lines);
}

#[test]
fn another_packet_interval_than_asked_for_is_not_taken() {
    let mut peer = Peer::new(&[0.0]);
    peer.api_offset_us = 500;
    let (rig, report) = fail(config(1), peer, vec![enable()]);
    let expected =
        "packet interval: expected 2000 us both ways, the device gives 2500 us to it and 2500 us from it";
    assert_eq!(text(&report), expected);
    assert!(rig.peer.seen.contains(&"Forward_Close".to_owned()), "what was opened is closed");
}

#[test]
fn a_required_attribute_that_is_refused_ends_the_configuration() {
    let mut config = config(2);
    config.axes[1].attributes =
        vec![AttributeSet::usint(1, 1), AttributeSet::real(461, 1.0), AttributeSet::real(462, 1.0)];
    let mut peer = Peer::new(&[0.0, 0.0]);
    peer.refuse_attributes = vec![(2, 461, 0x09), (2, 462, 0x14)];
    let (rig, report) = fail(config, peer, vec![enable()]);
    assert_eq!(text(&report), "axis 2: attribute 461 refused with status 0x09 (invalid attribute value)");
    assert!(rig.log().contains("axis 2: attribute 462 refused with status 0x14 (attribute not supported)"));
    assert!(rig.peer.axes.iter().all(|axis| axis.state == AxisStateCode::INITIALIZING));
    assert!(!rig.peer.open);
}

#[test]
fn enable_refused_by_a_start_inhibit() {
    let mut peer = Peer::new(&[0.0]);
    peer.axes[0].enable_status = 0x10;
    let (rig, report) = fail(config(1), peer, vec![Step::Dwell { seconds: 0.1 }, enable(), go()]);
    let expected = "axis 1: Enable refused with status 0x10 (device state conflict), state Start Inhibited";
    assert_eq!(text(&report), expected);
    assert_eq!((report.failed_step, report.steps_finished), (Some(1), 1));
    assert!(!rig.peer.open);
}

#[test]
fn enable_that_is_never_acknowledged_is_cancelled() {
    let mut peer = Peer::new(&[0.0]);
    peer.axes[0].enable_hangs = true;
    let step = Step::Within { time_out: DurationNs::from_millis(500), step: Box::new(enable()) };
    let (_, report) = fail(config(1), peer, vec![step]);
    let Some(Failure::RequestTimeOut { axis: 1, request, waited, .. }) = report.failure else {
        panic!("{report}")
    };
    assert_eq!(request, AxisControl::ENABLE);
    assert!(waited > DurationNs::from_millis(500) && waited < DurationNs::from_millis(510));
}

#[test]
fn a_device_that_dies_amid_a_move_times_the_connection_out() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), go()]);
    rig.script = Box::new(|_, updates, peer, _| peer.dead = updates > 300);
    let report = rig.run(30);
    let Some(Failure::ConnectionTimedOut { silent, limit, last_update }) = report.failure else {
        panic!("{report}")
    };
    assert_eq!((limit, last_update), (DurationNs::from_millis(16), 44));
    assert!(silent > limit && silent <= limit + DurationNs::from_millis(2), "{silent}");
    assert_eq!(report.failed_step, Some(1));
    assert!(rig.controller.is_closed(), "though nobody answers the Forward_Close");
    assert!(rig.log().contains("connection timed out from device to controller: silent for"));
}

#[test]
fn too_many_missing_updates_in_a_row_are_noticed_before_the_time_out() {
    let config = ControllerConfig { update_delay_high_limit: Some(4), ..config(1) };
    let mut rig = Rig::new(config, Peer::new(&[0.0]), vec![enable(), go()]);
    rig.lose_actuals = |n| (300..310).contains(&n);
    let report = rig.run(30);
    assert_eq!(text(&report), "5 D-to-C updates missing in a row, allowed 4");
}

#[test]
fn an_axis_fault_amid_a_move_is_in_the_failure() {
    let mut rig = Rig::new(
        config(2),
        Peer::new(&[0.0, 0.0]),
        vec![
            Step::Enable(AxisSet::first(2)),
            Step::Together(vec![go(), Step::MoveAbsolute { axis: 2, position: 100.0, limits: LIMITS }]),
        ],
    );
    rig.script = Box::new(|_, updates, peer, _| {
        if updates == 400 {
            peer.axes[1].fail(54, 1_000);
        }
    });
    let report = rig.run(30);
    let expected = "axis 2: expected state Running, found state Major Faulted, Axis Fault code 54 sub code 1 \
                    action 0x11 at 1000 ns";
    assert_eq!(text(&report), expected);
    // The other axis is stopped and disabled before the connection is closed.
    assert_eq!(rig.peer.axes[0].state, AxisStateCode::STOPPED);
    assert_eq!(rig.peer.axes[0].commands.last().unwrap().1.values.velocity, Some(0.0));
    assert!(!rig.peer.open);
}

#[test]
fn no_synchronization() {
    let mut config = config(1);
    config.time_outs.synchronization = DurationNs::from_secs(2);
    let mut peer = Peer::new(&[0.0]);
    peer.sync_answers = vec![SyncStatus::DIFFERENT_GRANDMASTER; 100].into();
    let (rig, report) = fail(config.clone(), peer, vec![]);
    assert!(text(&report).starts_with("Group_Sync: no success within 2."), "{}", text(&report));
    assert!(text(&report).contains("last answer: different grand master"), "{}", text(&report));
    let asked = rig.log().matches("Group_Sync: different grand master").count();
    assert!((15..=20).contains(&asked), "{asked} requests in 2 s");

    let mut peer = Peer::new(&[0.0]);
    peer.sync_mode = false;
    peer.node_alarm = NodeAlarm::CLOCK_SKEW;
    let (_, report) = fail(config, peer, vec![]);
    assert!(text(&report).contains("node alarm: Clock Skew Alarm"), "{}", text(&report));
}

#[test]
fn a_node_fault_during_configuration_ends_it() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![]);
    rig.peer.node_fault = NodeFault::DATA_FORMAT;
    let report = rig.run(5);
    assert_eq!(text(&report), "node fault: Data Format Error");
    assert_eq!(report.node_fault, Some(NodeFault::DATA_FORMAT));
}

#[test]
fn a_device_that_never_answers_fails_where_it_falls_silent() {
    let mut peer = Peer::new(&[0.0]);
    peer.dead = true;
    let (_, report) = fail(config(1), peer, vec![]);
    assert_eq!(text(&report), "RegisterSession: no answer within 5 s");

    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![]);
    rig.lose_commands = |_| true;
    let report = rig.run(30);
    assert!(text(&report).starts_with("no D-to-C update within 5.00"), "{}", text(&report));
}

#[test]
fn a_stream_closed_amid_a_move_is_opened_again_and_the_run_goes_on() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), go()]);
    rig.script = Box::new(|now, updates, _, controller| {
        if updates == 300 {
            controller.tcp_closed(now);
        }
    });
    let report = rig.run(30);
    assert_eq!((report.failure, report.steps_finished), (None, 2), "{}", rig.log());
    let sessions = rig.peer.seen.iter().filter(|seen| *seen == "RegisterSession").count();
    assert_eq!(sessions, 2, "{:?}", rig.peer.seen);
    assert!(rig.peer.seen.contains(&"Forward_Close".to_owned()));
    assert_eq!(rig.peer.seen.iter().filter(|seen| seen.ends_with("Forward_Open")).count(), 1);
    assert!(rig.log().contains("TCP stream lost; the motion connection goes on"));
}

#[test]
fn a_stream_that_cannot_be_opened_again_is_tried_once_a_second_and_ends_no_move() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), go()]);
    rig.refuse_streams = true;
    rig.script = Box::new(|now, updates, _, controller| {
        if updates == 300 {
            controller.tcp_closed(now);
        }
    });
    let began = rig.now;
    let report = rig.run(30);
    assert_eq!((report.failure, report.steps_finished), (None, 2), "{}", rig.log());
    let seconds = (rig.now - began) / 1_000_000_000;
    assert!((seconds..=seconds + 1).contains(&rig.streams_refused), "{} in {seconds} s", rig.streams_refused);
    assert!(seconds < 15, "it does not wait for ever to close in order: {seconds}");
    assert_eq!(rig.peer.axes[0].state, AxisStateCode::STOPPED, "disabled before the connection ends");
    assert!(!rig.peer.seen.contains(&"Forward_Close".to_owned()));
}

#[test]
fn an_explicit_step_ends_by_its_time_while_there_is_no_session() {
    let message = ExplicitMessage { service: 0x0E, class: 1, instance: 1, attribute: Some(1), data: vec![] };
    let explicit = Step::Explicit { message, status: None };
    let short = Step::Within { time_out: DurationNs::from_millis(200), step: Box::new(explicit.clone()) };
    for (step, expected) in [(explicit, "not finished within 5"), (short, "not finished within 20")] {
        let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![Step::Dwell { seconds: 0.5 }, step]);
        rig.refuse_streams = true;
        rig.script = Box::new(|now, updates, _, controller| {
            if updates == 100 {
                controller.tcp_closed(now);
            }
        });
        let report = rig.run(30);
        assert!(text(&report).starts_with(expected), "{}", text(&report));
    }
}

#[test]
fn an_idle_session_is_kept_alive() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![Step::Dwell { seconds: 200.0 }]);
    let report = rig.run(300);
    assert_eq!(report.failure, None, "{}", rig.log());
    let kept = rig.peer.seen.iter().filter(|seen| seen.contains("Get_Attribute_Single")).count();
    assert_eq!(kept, 6, "every 30 s: {:?}", rig.peer.seen);
}

#[test]
fn a_session_that_answers_no_more_is_registered_anew() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![Step::Dwell { seconds: 60.0 }]);
    rig.script = Box::new(|now, _, peer, _| peer.mute = (29..34).contains(&(now.0 / 1_000_000_000)));
    let report = rig.run(300);
    assert_eq!(report.failure, None, "{}", rig.log());
    assert_eq!(rig.peer.seen.iter().filter(|seen| *seen == "RegisterSession").count(), 2);
}

#[test]
fn steps_that_cannot_be_done_say_why() {
    let run = |program: Vec<Step>| text(&fail(config(1), Peer::new(&[0.0]), program).1);
    assert_eq!(run(vec![go()]), "axis 1: expected state Running, found state Stopped");
    // What is certain to fail is found before anything is sent, what depends on where the axis is only then.
    let refused = |step: Step| Controller::new(config(1), vec![enable(), step]).unwrap_err().to_string();
    let far = Step::MoveAbsolute { axis: 1, position: 3e6, limits: LIMITS };
    let expected = "axis 1: 3000000000 counts are beyond the 32-bit range of Command Position";
    assert_eq!(refused(far), format!("step 1: {expected}"));
    let far = Step::MoveRelative { axis: 1, distance: 3e6, limits: LIMITS };
    assert_eq!(run(vec![enable(), far]), expected);
    assert_eq!(
        run(vec![enable(), Step::Together(vec![go(), go()])]),
        "axis 1: a motion is under way already"
    );
    let limits = Limits { jerk: f64::NAN, ..LIMITS };
    assert_eq!(
        refused(Step::MoveAbsolute { axis: 1, position: 1.0, limits }),
        "step 1: axis 1: jerk limit: expected a number that is finite and above zero, found NaN"
    );
    let slow = Step::Within { time_out: DurationNs::from_millis(100), step: Box::new(go()) };
    assert!(run(vec![enable(), slow]).starts_with("not finished within 10"));
    let wait = Step::WaitInWindow { axis: 1, window: -1.0, seconds: 0.1 };
    assert!(run(vec![enable(), wait]).starts_with("axis 1: expected within -1 of the command, found 0 away"));
    let error = Controller::new(config(1), vec![Step::Enable(AxisSet::one(2))]).unwrap_err();
    assert_eq!(error.to_string(), "step 0: axis 2: expected an axis from 1 to 1");
}

#[test]
fn malformed_bytes_are_counted_and_survived() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), go()]);
    rig.script = Box::new(|now, updates, peer, controller| {
        if updates.is_multiple_of(10) && updates > 0 {
            let update = peer.updates.last().unwrap().clone();
            controller.handle_datagram(now, SystemTime(0), &update);
            controller.handle_datagram(now, SystemTime(0), &[]);
        }
        if updates == 200 {
            let mut stray = [0; 24];
            stray[0] = 0x6F;
            controller.handle_stream(now, &stray);
        }
    });
    let report = rig.run(30);
    assert_eq!(report.failure, None, "{}", rig.log());
    assert!(report.malformed > 100);
    assert!(rig.log().contains("dropped malformed data: command of a reply to nothing asked"));
}

#[test]
fn a_stream_of_nonsense_is_given_up() {
    let mut controller = Controller::new(config(1), vec![]).unwrap();
    controller.tcp_connected(MonotonicTime(0));
    controller.handle_stream(MonotonicTime(0), &[0xFF; 24]);
    assert_eq!(
        controller.report().failure.unwrap().to_string(),
        "TCP stream: encapsulation length: expected at most 4072, found 65535"
    );
    assert!(controller.is_closed());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Every datagram and every reply with one byte changed or cut short: no panic, and the run ends.
    #[test]
    fn changed_bytes_never_panic(seed in 0..400_u64, at in 0..400_usize, to: u8, cut: bool) {
        let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), Step::Dwell { seconds: 0.3 }]);
        rig.spoil = Some((seed, at, to, cut));
        let report = rig.run(100);
        prop_assert!(rig.controller.is_closed());
        prop_assert!(report.cycles < 60_000);
    }
}

/// The handle of the session, changed on the way: the device refuses it, and the controller gives up.
#[test]
fn a_session_handle_that_was_changed_is_refused() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![enable(), Step::Dwell { seconds: 0.3 }]);
    rig.spoil = Some((0, 4, 0, false));
    let report = rig.run(100);
    assert!(rig.controller.is_closed());
    assert!(report.failure.is_some(), "{report:?}");
}
