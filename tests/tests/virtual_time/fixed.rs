//! A device with one axis over the fixed connection format: 16 octets each way, services beside it.

use std::f64::consts::PI;

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::fixed::{FixedController, IMMEDIATE, INTERPOLATE, settings};
use profile_cip::wire::motion::codes::{ActualDataSet, AxisControl, AxisStateCode, ControlMode, NodeStatus};
use profile_cip::wire::motion::{ActualPosition, CommandPosition, CommandValues};
use profile_generic::cast::i64_from_f64;
use profile_generic::time::DurationNs;

/// Nanounits in a revolution.
const REVOLUTION: i64 = 1_000_000_000;
const GET_ATTRIBUTE_SINGLE: u8 = 0x0E;
const AXIS_STATE: u16 = 650;

fn rig() -> Rig {
    Rig::ready(settings())
}

fn velocity(value: f32) -> CommandValues {
    CommandValues { velocity: Some(value), ..CommandValues::default() }
}

fn position(counts: i32) -> CommandValues {
    CommandValues { position: Some(CommandPosition::Integer(counts)), ..CommandValues::default() }
}

#[test]
fn an_axis_runs_in_velocity_control_and_stops_when_the_controller_vanishes() {
    let mut rig = rig();
    assert_eq!(FixedController::open(&mut rig, 16).err(), Some(1), "the sequence count belongs to the size");
    let mut controller = FixedController::open(&mut rig, 18).expect("a connection");
    controller.configure(&mut rig, IMMEDIATE);
    assert!(rig.torque_free());
    controller.request(&mut rig, AxisControl::ENABLE);
    assert_eq!(controller.actual().axis_state, AxisStateCode::RUNNING);
    // Up to two revolutions a second in half a second.
    for step in 1..=250_u16 {
        controller.command.values = velocity(2.0 * f32::from(step) / 250.0);
        controller.cycle(&mut rig);
    }
    (0..250).for_each(|_| controller.cycle(&mut rig));
    let close = |value: i64, wanted: i64, within: i64| (value - wanted).abs() < within;
    assert!(close(rig.velocity(0), 2 * REVOLUTION, REVOLUTION / 50), "{}", rig.velocity(0));
    let told = controller.actual().actual.velocity.expect("what was asked for");
    assert!((told - 2.0).abs() < 0.05, "{told}");
    // A service beside the running connection.
    let state = controller.client.ask(&mut rig, GET_ATTRIBUTE_SINGLE, 1, Some(AXIS_STATE), &[]);
    assert_eq!(state, (0, vec![AxisStateCode::RUNNING.0]));
    controller.cycle(&mut rig);
    assert!(!controller.actual().node_status.contains(NodeStatus::FAULT), "{}", controller.actual());
    // Nothing comes any more.
    let stop = rig.run_until(DurationNs::from_secs(3), "rest", |rig| rig.torque_free());
    assert!(stop < DurationNs::from_millis(1500), "{stop}");
    assert!(close(rig.velocity(0), 0, REVOLUTION / 100), "{}", rig.velocity(0));
}

#[test]
fn an_axis_moves_half_a_revolution_in_position_control() {
    let mut rig = rig();
    let mut controller = FixedController::open(&mut rig, 18).expect("a connection");
    controller.command.actual_data_set = ActualDataSet::POSITION;
    controller.configure(&mut rig, INTERPOLATE);
    let at = |controller: &FixedController| match controller.actual().actual.position {
        Some(ActualPosition::Dint(counts)) => counts,
        other => panic!("{other:?}"),
    };
    let (start, began) = (at(&controller), rig.position(0));
    controller.command.control_mode = ControlMode::POSITION;
    controller.command.values = position(start);
    controller.request(&mut rig, AxisControl::ENABLE);
    // A cosine of one second.
    for step in 0..=500_i32 {
        let share = (1.0 - (PI * f64::from(step) / 500.0).cos()) / 2.0;
        let way = i32::try_from(i64_from_f64(500_000.0 * share)).expect("half a revolution");
        controller.command.values = position(start + way);
        controller.cycle(&mut rig);
    }
    (0..250).for_each(|_| controller.cycle(&mut rig));
    let moved = rig.position(0) - began;
    assert!((moved - REVOLUTION / 2).abs() < REVOLUTION / 10_000, "{moved}");
    assert!((at(&controller) - start - 500_000).abs() < 100, "{}", at(&controller));
    controller.request(&mut rig, AxisControl::DISABLE);
    assert_eq!(controller.actual().axis_state, AxisStateCode::STOPPED);
    assert!(rig.torque_free());
    assert_eq!(controller.actual().node_status, NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID);
}
