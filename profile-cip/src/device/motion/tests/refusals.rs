//! Every bad input: refused, counted, without any other effect.

use super::*;
use crate::device::axis::drive_link::{DriveAction, Withheld};
use crate::device::axis::state::AxisState;
use crate::device::motion::io_counters::MotionCounters;
use crate::wire::Error;
use crate::wire::motion::codes::NodeFault;
use crate::wire::motion::event::ExtendedEventData;
use profile_generic::wire::Expected;

/// Sends a packet to a running rig, and returns the counters that changed, the node fault and the follow-up state.
fn after(packet: impl FnOnce(&mut Rig) -> Vec<u8>) -> (MotionCounters, NodeFault, Rig) {
    let mut rig = Rig::running();
    let before = *rig.device.counters();
    let sequence = rig.follow(0).sequence;
    let packet = packet(&mut rig);
    rig.send(&packet);
    let now = *rig.device.counters();
    let moved = matches!(rig.command(0).command, Command::Follow(s) if s.sequence != sequence);
    assert!(!moved, "a refused packet brings no set-point");
    let difference = MotionCounters {
        applied: now.applied - before.applied,
        refreshes: now.refreshes - before.refreshes,
        out_of_order: now.out_of_order - before.out_of_order,
        repeated: now.repeated - before.repeated,
        oversize: now.oversize - before.oversize,
        malformed: now.malformed - before.malformed,
        not_finite: now.not_finite - before.not_finite,
        unknown_instance: now.unknown_instance - before.unknown_instance,
        not_valid: now.not_valid - before.not_valid,
        lost_updates: now.lost_updates - before.lost_updates,
        ..MotionCounters::default()
    };
    let fault = rig.device.node_fault();
    (difference, fault, rig)
}

const NONE: MotionCounters = MotionCounters {
    applied: 0,
    not_valid: 0,
    refreshes: 0,
    out_of_order: 0,
    repeated: 0,
    unconnected: 0,
    oversize: 0,
    malformed: 0,
    not_finite: 0,
    unknown_instance: 0,
    too_late: 0,
    untimed: 0,
    ahead_of_time: 0,
    stamp_jumps: 0,
    lost_updates: 0,
    late_updates: 0,
    connection_losses: 0,
    transmitted: 0,
    left_out: 0,
    explicit_overflow: 0,
};

#[test]
fn wrong_forms_raise_node_fault_4() {
    let format = NodeFault::DATA_FORMAT;
    let malformed = MotionCounters { malformed: 1, ..NONE };
    for octet in [2, 3, 9] {
        let (counters, fault, rig) = after(|rig| {
            let mut packet = rig.command_packet();
            packet[octet] = 0x40;
            packet
        });
        assert_eq!((counters, fault), (malformed, format), "octet {octet}");
        assert!(matches!(
            rig.device.last_error(),
            Some(Error { expected: Expected::Value(_), found: 0x40, .. })
        ));
        assert_eq!(rig.withheld(0), Some(Withheld::NodeFault));
        assert_eq!(rig.command(0).action, DriveAction::Abort, "and the axis stops");
    }
    let (counters, fault, _) = after(|rig| {
        let packet = rig.command_packet();
        packet[..packet.len() - 1].to_vec()
    });
    assert_eq!((counters, fault), (malformed, format));
    let (counters, fault, _) = after(|_| vec![1]);
    assert_eq!((counters, fault), (malformed, format));
    let (counters, fault, _) = after(|_| vec![0; 501]);
    assert_eq!((counters, fault), (MotionCounters { oversize: 1, ..NONE }, format));
    let (counters, fault, _) = after(|rig| {
        rig.blocks.push(rig.blocks[0]);
        rig.services.push(None);
        rig.command_packet()
    });
    assert_eq!((counters, fault), (MotionCounters { unknown_instance: 1, ..NONE }, format));
    for position in [f64::NAN, f64::INFINITY] {
        let (counters, fault, _) = after(|rig| {
            rig.blocks[1].values.position = Some(CommandPosition::Float(position));
            rig.command_packet()
        });
        assert_eq!((counters, fault), (MotionCounters { not_finite: 1, ..NONE }, format));
    }
    for (threshold, time) in [(f32::NAN, 0.5), (f32::NEG_INFINITY, 0.5), (40.0, f32::NAN)] {
        let (counters, fault, _) = after(|rig| {
            let data = ExtendedEventData {
                home_torque_threshold: Some(threshold),
                home_torque_time: Some(time),
                ..ExtendedEventData::default()
            };
            let checking = EventChecking::HOME_TORQUE;
            rig.events = Some(CommandEvents { checking, extended: Some(data), ..CommandEvents::default() });
            rig.command_packet()
        });
        let expected = (MotionCounters { not_finite: 1, ..NONE }, format);
        assert_eq!((counters, fault), expected, "{threshold} for {time} s");
    }
}

#[test]
fn a_malformed_update_changes_nothing_else() {
    let (_, _, mut rig) = after(|rig| {
        // A good command to axis 0 before a broken axis 1: none of it may count.
        rig.request_all(AxisControl::SHUTDOWN);
        let mut packet = rig.command_packet();
        let last = packet.len() - 16;
        packet[last + 4] = 0xFF;
        packet
    });
    rig.request_all(AxisControl::NONE);
    rig.run_device();
    assert_eq!(rig.actual(0).axis_response, AxisControl::NONE);
    assert_ne!(rig.state(0), AxisState::Shutdown);
    assert_eq!(rig.header().last_received_id, rig.update_id - 1, "it was not received");
}

#[test]
fn node_fault_4_ends_with_a_node_fault_reset_and_the_axes_stay_faulted() {
    let (_, _, mut rig) = after(|rig| {
        let [low, high] = rig.sequence.wrapping_add(1).to_le_bytes();
        vec![low, high, 9]
    });
    rig.cycles(3);
    // Whoever runs the axes sees that they lost their command. That is a consequence, not a fault of its own.
    rig.device.raise_node_fault(NodeFault::CONNECTION_UPDATE);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    rig.control |= NodeControl::FAULT_RESET;
    rig.cycles(2);
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    rig.control -= NodeControl::FAULT_RESET;
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::Stopped);
    assert_eq!(rig.actual(0).axis_response, AxisControl::FAULT_RESET);
}

#[test]
fn a_refresh_keeps_the_connection_alive_and_nothing_else() {
    let (counters, fault, _) = after(|rig| {
        // A new update under an older sequence count.
        rig.sequence -= 2;
        rig.command_packet()
    });
    assert_eq!((counters.out_of_order, fault), (1, NodeFault::NONE));

    let mut rig = Rig::running();
    let packet = rig.command_packet();
    rig.send(&packet);
    let sequence = rig.follow(0).sequence;
    for cycle in 0..5 {
        rig.now += PERIOD;
        rig.send(&packet);
        assert_eq!(rig.device.counters().refreshes, cycle + 1);
    }
    let set_points = rig.follow(0);
    assert_eq!((set_points.sequence, set_points.age_updates), (sequence, 4), "the command ages");
    rig.now += PERIOD;
    rig.send(&packet);
    rig.run_device();
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    for _ in 0..100 {
        rig.now += PERIOD;
        rig.send(&packet);
        rig.run_device();
    }
    assert!(rig.device.connection().is_some(), "but the connection is alive");
}

#[test]
fn old_and_repeated_update_ids_are_not_applied() {
    let (counters, fault, _) = after(|rig| {
        rig.update_id -= 1;
        rig.command_packet()
    });
    assert_eq!((counters, fault), (MotionCounters { repeated: 1, ..NONE }, NodeFault::NONE));
    let (counters, fault, _) = after(|rig| {
        rig.update_id -= 3;
        rig.command_packet()
    });
    assert_eq!((counters, fault), (MotionCounters { out_of_order: 1, ..NONE }, NodeFault::NONE));
}

#[test]
fn without_a_connection_nothing_is_taken() {
    let mut rig = Rig::new();
    let packet = rig.command_packet();
    rig.send(&packet);
    assert_eq!(*rig.device.counters(), MotionCounters { unconnected: 1, ..NONE });
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
}

#[test]
fn data_taken_away_stops_the_axes_like_silence() {
    let mut rig = Rig::running();
    rig.control -= NodeControl::DATA_VALID;
    rig.cycles(6);
    assert_eq!(rig.device.counters().not_valid, 6);
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!(rig.command(0).action, DriveAction::Abort);
}

#[test]
fn local_control_stops_the_axes_and_is_obeyed_in_nothing() {
    let mut rig = Rig::running();
    rig.control -= NodeControl::REMOTE_CONTROL;
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::Stopped);
    assert_eq!(rig.withheld(0), Some(Withheld::LocalControl));
    assert_eq!(rig.actual(0).axis_response, AxisControl::NONE);
    assert!(rig.actual(0).status.axis_status.is_none_or(|(s, _)| s.bits() & 1 == 1));
}

#[test]
fn a_missing_set_point_or_a_foreign_mode_faults_the_axis() {
    for (mode, values, sub_code) in [
        (ControlMode::POSITION, CommandValues { velocity: Some(1.0), ..CommandValues::default() }, 2),
        (ControlMode::TORQUE, CommandValues { torque: Some(1.0), ..CommandValues::default() }, 1),
    ] {
        let mut rig = Rig::running();
        rig.blocks[0].control_mode = mode;
        rig.blocks[0].values = values;
        rig.cycle();
        assert_eq!((rig.state(0), rig.state(1)), (AxisState::Aborting, AxisState::Running));
        assert_eq!(rig.command(0).action, DriveAction::Abort);
        assert_eq!(rig.withheld(0), Some(Withheld::NotRunning));
        let record = rig.actual(0).status.fault.expect("a record");
        assert_eq!((record.code, record.sub_code), (60, sub_code));
        assert_eq!(rig.device.axis_faults(0), Some(1 << 60));
    }
    // A mode that the axis has may be changed to while it runs.
    let mut rig = Rig::running();
    rig.blocks[0].control_mode = ControlMode::VELOCITY;
    rig.blocks[0].values = CommandValues { velocity: Some(2.0), ..CommandValues::default() };
    rig.cycle();
    assert_eq!(rig.follow(0).control_mode, ControlMode::VELOCITY);
    assert_eq!(rig.follow(0).values.velocity, Some(2.0));
}
