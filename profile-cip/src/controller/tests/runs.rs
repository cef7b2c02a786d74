//! Runs that succeed.

use super::peer::Peer;
use super::rig::{Rig, config};
use crate::controller::{AttributeSet, AxisSet, AxisSetup, ControllerConfig, Event, Limits, Report, Step};
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{AxisStateCode, ControlMode, NodeControl, SyncStatus};
use crate::wire::motion::{CommandFrame, CommandPosition};

const LIMITS: Limits = Limits { velocity: 50.0, acceleration: 500.0, jerk: 10_000.0 };

fn moves() -> Vec<Step> {
    let both = AxisSet::first(2);
    vec![
        Step::Enable(both),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 12.5, limits: LIMITS },
            Step::MoveRelative { axis: 2, distance: -3.0, limits: LIMITS },
        ]),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
        Step::Dwell { seconds: 0.05 },
        Step::Jog { axis: 2, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.3 },
        Step::MoveAbsolute { axis: 2, position: 0.0, limits: LIMITS },
        Step::Disable(both),
    ]
}

/// No command of an axis jumps: neither at Enable nor between modes nor in a motion.
fn assert_smooth(rig: &Rig, velocity_counts: f64) {
    for (n, axis) in rig.peer.axes.iter().enumerate() {
        let mut last: Option<(u64, f64)> = None;
        for (at, block) in &axis.commands {
            let Some(position) = block.values.position.map(CommandPosition::as_f64) else {
                last = None;
                continue;
            };
            if let Some((before, previous)) = last {
                let allowed = velocity_counts * super::rig::seconds(at - before) * 1.001 + 1.0;
                let step = (position - previous).abs();
                assert!(step <= allowed, "axis {} jumps by {step} counts", n + 1);
            }
            last = Some((*at, position));
        }
    }
}

fn assert_good(report: &Report, rig: &Rig) {
    assert_eq!(report.failure, None, "{}", rig.log());
    assert!(rig.controller.is_closed() && !rig.peer.open);
    assert_eq!(rig.peer.seen.last().map(String::as_str), Some("UnRegisterSession"));
}

#[test]
fn a_whole_program_runs_and_every_axis_arrives() {
    let mut rig = Rig::new(config(2), Peer::new(&[4321.0, -777.0]), moves());
    let report = rig.run(30);
    assert_good(&report, &rig);
    assert!(report.synchronous);
    assert_eq!(report.steps_finished, 7);
    let [one, two] = report.axes.as_slice() else { panic!("two axes") };
    assert_eq!((one.commanded, one.reached), (Some(12.5), Some(12.5)));
    assert_eq!((two.commanded, two.reached), (Some(0.0), Some(0.0)));
    // The plant is ideal and counts are rounded to one half.
    assert!(one.following_error_max <= 0.001 && two.following_error_max <= 0.001, "{report}");
    assert!(one.following_samples > 100);
    use AxisStateCode as S;
    let states = [S::PRE_CHARGE, S::STOPPED, S::STARTING, S::RUNNING, S::STOPPING, S::STOPPED];
    assert_eq!(one.states.kept(), states);
    assert_eq!((report.lost_updates, report.late_updates, report.malformed), (0, 0, 0));
    assert_eq!(report.cycles, report.updates);
    assert_smooth(&rig, 50_000.0);
    let identity = report.identity.as_ref().unwrap();
    assert_eq!((identity.vendor, identity.device_type, identity.serial_number), (0x4D, 0x25, 99));
}

#[test]
fn the_events_of_a_run_tell_its_story() {
    let program =
        vec![Step::Enable(AxisSet::one(1)), Step::MoveAbsolute { axis: 1, position: 1.0, limits: LIMITS }];
    let mut config = config(1);
    config.list_identity = true;
    config.class_attributes = vec![AttributeSet::usint(22, 2).optional(), AttributeSet::udint(35, 2_000_000)];
    config.axes[0].attributes = vec![AttributeSet::usint(41, 1), AttributeSet::real(441, 80.0)];
    let mut peer = Peer::new(&[0.0]);
    peer.refuse_attributes.push((0, 22, 0x14));
    peer.sync_answers.push_back(SyncStatus::NOT_SYNCHRONIZED);
    let mut rig = Rig::new(config, peer, program);
    let report = rig.run(10);
    assert_good(&report, &rig);
    insta::assert_snapshot!(rig.log());
}

#[test]
fn the_start_up_follows_clause_7_1() {
    let mut config = config(2);
    config.class_attributes = vec![AttributeSet::udint(35, 2_000_000)];
    for axis in &mut config.axes {
        axis.attributes = vec![AttributeSet::usint(610, 1)];
    }
    config.power_structure = Some(0x0403_0201);
    config.key.vendor = 0x4D;
    let mut rig = Rig::new(config, Peer::new(&[0.0, 0.0]), vec![]);
    let report = rig.run(5);
    assert_good(&report, &rig);
    assert_eq!(
        rig.peer.seen,
        ["RegisterSession", "Get_Attributes_All", "Forward_Open", "Forward_Close", "UnRegisterSession"]
    );
    #[rustfmt::skip]
    assert_eq!(rig.peer.path, [
        0x34, 4, 0x4D, 0, 0, 0, 0, 0, 0, 0, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 1, 0, 0, 1, 2, 3, 4,
    ]);
    // Initial update of clause 7-1.1, then the class as in clause 7-1.2, then Group_Sync as in clause 7-1.3.
    let updates = &rig.peer.updates;
    assert_eq!(updates[0], [6, 2, 0, 1, 0, 0, 0, 0]);
    #[rustfmt::skip]
    assert_eq!(updates[1], [
        6, 2, 1, 5, 1, 0, 0, 4,
        0, 0, 6, 0, 0, 0, 0, 4,
        1, 0x4C, 0, 0, 1, 0, 0, 0, 35, 0, 0, 4, 0x80, 0x84, 0x1E, 0,
    ]);
    let sync = updates.iter().position(|u| u.get(25) == Some(&0x1C)).unwrap();
    assert_eq!(updates[sync][7], 5, "time stamps come before Group_Sync, with the offset or without");
    assert_eq!(updates[sync][24..], [2, 0x1C, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(
        rig.peer.written.iter().map(|w| (w.0, w.1)).collect::<Vec<_>>(),
        [(0, 35), (1, 610), (2, 610)]
    );
    // Sync Control comes only when everything is configured, together with Configuration Complete.
    for update in updates {
        let frame = CommandFrame::parse(update).unwrap();
        let synchronous = frame.header().node_control.contains(NodeControl::SYNC_CONTROL);
        let configured = frame.instances().filter(|i| i.cyclic.is_some()).count();
        assert_eq!(configured, if synchronous { 2 } else { 0 });
    }
}

#[test]
fn the_update_id_counts_up_and_the_time_stamp_marks_the_period() {
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), vec![Step::Dwell { seconds: 1.5 }]);
    assert_good(&rig.run(5), &rig);
    let headers: Vec<_> =
        rig.peer.updates.iter().map(|u| *CommandFrame::parse(u).unwrap().header()).collect();
    assert!(headers.len() > 600, "the ID rolls over twice");
    for pair in headers.windows(2) {
        assert_eq!(pair[1].update_id, pair[0].update_id.wrapping_add(1));
        assert_eq!(pair[1].last_received_id, pair[0].update_id);
        if let (Some(before), Some(after)) = (pair[0].time_stamp, pair[1].time_stamp) {
            assert_eq!(after - before, 2_000_000);
        }
    }
    let offsets: Vec<_> = headers.iter().filter_map(|h| h.time_offset).collect();
    assert_eq!(offsets, [1_700_000_000_000_000_000], "sent until the device has it, and not again");
}

#[test]
fn without_a_grand_master_the_run_is_asynchronous() {
    let config = ControllerConfig { grand_master: None, ..config(2) };
    let mut rig = Rig::new(config, Peer::new(&[0.0, 0.0]), moves());
    let report = rig.run(30);
    assert_good(&report, &rig);
    assert!(!report.synchronous);
    assert_eq!(report.axes[0].reached, Some(12.5));
    for update in &rig.peer.updates {
        let header = *CommandFrame::parse(update).unwrap().header();
        assert_eq!(
            (header.time_stamp, header.node_control.contains(NodeControl::SYNC_CONTROL)),
            (None, false)
        );
    }
}

#[test]
fn lost_datagrams_both_ways_are_counted_and_ridden_through() {
    let mut rig = Rig::new(config(2), Peer::new(&[100.0, 200.0]), moves());
    rig.lose_commands = |n| n > 100 && n % 17 < 2;
    rig.lose_actuals = |n| n > 100 && n % 23 == 0;
    let report = rig.run(30);
    assert_good(&report, &rig);
    assert_eq!(report.axes[0].reached, Some(12.5));
    assert_eq!(report.axes[1].reached, Some(0.0));
    let lost = report.cycles - report.updates;
    assert!(lost > 50, "{report}");
    assert_eq!(report.lost_updates, lost, "every missing update is noticed by its ID");
    assert!(report.device_lost_updates > 0);
    assert_smooth(&rig, 50_000.0);
}

#[test]
fn late_wake_ups_leave_the_path_as_it_is() {
    let program =
        vec![Step::Enable(AxisSet::one(1)), Step::MoveAbsolute { axis: 1, position: 50.0, limits: LIMITS }];
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), program);
    // Every fiftieth time the caller comes late by three periods and a bit.
    rig.connect();
    let mut calls = 0_u64;
    while !rig.controller.is_closed() {
        calls += 1;
        let late = if calls.is_multiple_of(50) { 6_300_000 } else { 0 };
        rig.step(rig.controller.wake_at().unwrap().0 + late);
        assert!(calls < 20_000, "{}", rig.log());
    }
    let report = rig.controller.report();
    assert_good(&report, &rig);
    assert_eq!(report.axes[0].reached, Some(50.0));
    assert!(report.missed_cycles > 9, "{report}");
    let headers = rig.peer.updates.iter().map(|u| *CommandFrame::parse(u).unwrap().header());
    let stamped: Vec<_> = headers.filter_map(|h| h.time_stamp.map(|stamp| (stamp, h.update_id))).collect();
    for pair in stamped.windows(2) {
        let periods = (pair[1].0 - pair[0].0) / 2_000_000;
        let ids = u64::from(pair[1].1.wrapping_sub(pair[0].1));
        assert_eq!(ids, periods, "the update ID counts periods, missed ones too");
    }
    assert_smooth(&rig, 50_000.0);
}

#[test]
fn a_jog_runs_in_velocity_control_and_hands_back_without_a_jump() {
    let program = vec![
        Step::Enable(AxisSet::one(1)),
        Step::Dwell { seconds: 0.05 },
        Step::Jog { axis: 1, velocity: -20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.5 },
        Step::MoveRelative { axis: 1, distance: 1.0, limits: LIMITS },
    ];
    let mut rig = Rig::new(config(1), Peer::new(&[5000.0]), program);
    let report = rig.run(10);
    assert_good(&report, &rig);
    let commands = &rig.peer.axes[0].commands;
    let modes: Vec<_> = commands.iter().map(|(_, block)| block.control_mode).collect();
    let mut changes = modes.clone();
    changes.dedup();
    assert_eq!(changes, [ControlMode::POSITION, ControlMode::VELOCITY, ControlMode::POSITION]);
    let fastest = commands.iter().filter_map(|(_, b)| b.values.velocity).fold(0.0_f32, |a, v| a.min(v));
    assert!((fastest + 20.0).abs() < 0.001, "{fastest}");
    // Position control resumes where the axis stands.
    let back = modes.iter().rposition(|m| *m == ControlMode::VELOCITY).unwrap() + 1;
    let resumed = commands[back].1.values.position.unwrap().as_f64();
    let travelled = (5000.0 - resumed) / 1000.0;
    assert!((travelled - 10.0).abs() < 0.5, "{travelled}");
    assert!((report.axes[0].reached.unwrap() - (resumed / 1000.0 + 1.0)).abs() < 1e-9);
}

#[test]
fn stop_ends_a_move_smoothly_and_the_move_with_it() {
    let program = vec![
        Step::Enable(AxisSet::one(1)),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 100.0, limits: LIMITS },
            Step::Sequence(vec![
                Step::Dwell { seconds: 0.5 },
                Step::Stop { axis: 1, acceleration: 1000.0, jerk: 50_000.0 },
            ]),
        ]),
        Step::MoveRelative { axis: 1, distance: 1.0, limits: LIMITS },
    ];
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), program);
    let report = rig.run(10);
    assert_good(&report, &rig);
    let reached = report.axes[0].reached.unwrap();
    assert!(reached > 20.0 && reached < 40.0, "{reached}");
    assert_smooth(&rig, 50_000.0);
}

#[test]
fn attributes_are_split_over_requests_and_read_back() {
    let mut config = config(1);
    config.connection_size = 200;
    config.axes[0].attributes = (1000..1040).map(|id| AttributeSet::udint(id, u32::from(id) * 3)).collect();
    let selectors: Vec<_> = (1000..1040).chain([2000]).map(|id| AttributeSelector::scalar(id, 4)).collect();
    let program = vec![
        Step::ReadAttributes { axis: 1, attributes: selectors },
        Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::udint(1003, 5)] },
        Step::ReadAttributes { axis: 1, attributes: vec![AttributeSelector::scalar(1003, 4)] },
    ];
    let mut rig = Rig::new(config, Peer::new(&[0.0]), program);
    let report = rig.run(10);
    assert_good(&report, &rig);
    assert_eq!(rig.peer.written.len(), 41);
    assert!(rig.peer.updates.iter().all(|u| u.len() <= 198));
    let reads: Vec<_> = rig
        .events
        .iter()
        .filter_map(|e| if let Event::AttributesRead { values, .. } = e { Some(values) } else { None })
        .collect();
    assert_eq!(reads[0].len(), 41);
    for value in &reads[0][..40] {
        assert_eq!(value.value, Ok((u32::from(value.id) * 3).to_le_bytes().to_vec()));
    }
    assert_eq!((reads[0][40].id, &reads[0][40].value), (2000, &Err(0x14)));
    assert_eq!(reads[1][0].value, Ok(vec![5, 0, 0, 0]));
}

#[test]
fn command_position_as_dint_and_above_511_bytes_a_large_forward_open() {
    let mut config = config(2);
    config.connection_size = 1000;
    let mut axis = AxisSetup::position(1000.0);
    axis.sets.integer_position = true;
    config.axes = vec![axis; 2];
    let mut rig = Rig::new(config, Peer::new(&[0.0, 0.0]), moves());
    let report = rig.run(30);
    assert_good(&report, &rig);
    assert!(rig.peer.seen.contains(&"Large_Forward_Open".to_owned()));
    let mut positions = rig.peer.axes[0].commands.iter().filter_map(|(_, block)| block.values.position);
    assert!(positions.clone().count() > 100);
    assert!(positions.clone().all(|p| matches!(p, CommandPosition::Integer(_))));
    assert_eq!(positions.next_back(), Some(CommandPosition::Integer(12_500)));
}

#[test]
fn before_enable_the_command_stands_at_the_actual_position() {
    let program =
        vec![Step::Dwell { seconds: 0.1 }, Step::Enable(AxisSet::one(1)), Step::Dwell { seconds: 0.1 }];
    let mut rig = Rig::new(config(1), Peer::new(&[-123_456.0]), program);
    assert_good(&rig.run(5), &rig);
    let positions: Vec<_> = rig
        .peer
        .updates
        .iter()
        .filter_map(|u| CommandFrame::parse(u).unwrap().instances().find_map(|i| i.cyclic))
        .skip(2)
        .filter_map(|block| block.values.position)
        .collect();
    assert!(positions.len() > 100);
    assert!(positions.iter().all(|p| *p == CommandPosition::Float(-123_456.0)), "{positions:?}");
}

#[test]
fn shutdown_and_its_reset_and_a_fault_and_its_reset() {
    let one = AxisSet::one(1);
    let program = vec![
        Step::Enable(one),
        Step::Shutdown(one),
        Step::ShutdownReset(one),
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(one),
        Step::NodeFaultReset,
        Step::Enable(one),
        Step::Disable(one),
    ];
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), program);
    let mut failed = false;
    rig.script = Box::new(move |_, _, peer, controller| {
        if controller.report().steps_finished == 3 && !failed {
            failed = true;
            peer.axes[0].fail(34, 42);
            peer.node_fault = crate::wire::motion::codes::NodeFault::CLOCK_SYNC;
        }
    });
    let report = rig.run(10);
    assert_good(&report, &rig);
    let axis = &report.axes[0];
    assert_eq!((axis.faults.total, axis.alarms.total), (1, 1), "a repeated record counts once");
    let fault = axis.faults.kept()[0];
    assert_eq!((fault.code, fault.sub_code, fault.action, fault.time_stamp), (34, 1, 0x11, 42));
    assert!(axis.states.kept().contains(&AxisStateCode::MAJOR_FAULTED));
    assert_eq!(report.node_fault, Some(crate::wire::motion::codes::NodeFault::CLOCK_SYNC));
}

#[test]
fn finish_stops_disables_and_closes() {
    let program =
        vec![Step::Enable(AxisSet::one(1)), Step::MoveAbsolute { axis: 1, position: 1000.0, limits: LIMITS }];
    let mut rig = Rig::new(config(1), Peer::new(&[0.0]), program);
    rig.script = Box::new(|now, updates, _, controller| {
        if updates == 500 {
            controller.finish(now);
        }
    });
    let report = rig.run(10);
    assert_good(&report, &rig);
    assert_eq!(report.steps_finished, 1);
    let commands = &rig.peer.axes[0].commands;
    let last = commands.last().unwrap().1;
    assert_eq!(last.values.velocity, Some(0.0), "at standstill before Disable");
    assert_smooth(&rig, 50_000.0);
    assert_eq!(rig.peer.axes[0].state, AxisStateCode::STOPPED);
}

#[test]
fn an_axis_in_velocity_control_jogs_but_does_not_move() {
    let mut config = config(1);
    config.axes[0].control_mode = ControlMode::VELOCITY;
    let jog = Step::Jog { axis: 1, velocity: 5.0, acceleration: 100.0, jerk: 5000.0, seconds: 0.2 };
    let program = vec![
        Step::Enable(AxisSet::one(1)),
        jog,
        Step::MoveAbsolute { axis: 1, position: 0.0, limits: LIMITS },
    ];
    let mut rig = Rig::new(config, Peer::new(&[0.0]), program);
    let report = rig.run(10);
    assert_eq!(report.steps_finished, 2);
    assert_eq!(report.failure.unwrap().to_string(), "axis 1: this step does not go with Velocity Control");
    assert!((report.axes[0].reached.unwrap() - 1.0).abs() < 0.1, "{report}");
    assert!(rig.peer.axes[0].commands.iter().all(|(_, b)| b.control_mode == ControlMode::VELOCITY));
    assert!(rig.peer.axes[0].commands.iter().all(|(_, b)| b.values.position.is_none()));
}

#[test]
fn endless_turning_rolls_over_and_position_control_goes_on_there() {
    let start = f64::from(i32::MAX) - 1000.0;
    let program = vec![
        Step::Enable(AxisSet::one(1)),
        Step::Jog { axis: 1, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.5 },
        Step::MoveRelative { axis: 1, distance: 1.0, limits: LIMITS },
    ];
    let mut rig = Rig::new(config(1), Peer::new(&[start]), program);
    let report = rig.run(10);
    assert_good(&report, &rig);
    let commands = &rig.peer.axes[0].commands;
    let back = commands.iter().rposition(|(_, b)| b.control_mode == ControlMode::VELOCITY).unwrap() + 1;
    let resumed = commands[back].1.values.position.unwrap().as_f64();
    // 10 units on, less the 1000 counts to the end of the range, from its other end.
    let expected = f64::from(i32::MIN) + 10_000.0 - 1001.0;
    assert!((resumed - expected).abs() < 500.0, "{resumed} against {expected}");
    assert!((report.axes[0].reached.unwrap() * 1000.0 - (resumed + 1000.0)).abs() <= 1.0);
}
