use profile_cip::devicenet::wire::speed::Assembly;
use profile_cip::wire::Writer;
use profile_cip::wire::motion::codes::{
    ActualDataSet, AxisControl, AxisStateCode, ControlMode, NodeControl, NodeStatus,
};
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_cip::wire::motion::{ActualPosition, ActualValues, CommandPosition};
use profile_generic::time::DurationNs;

use super::*;
use crate::mapping::devicenet::{MODE_AT, POSITION_AT, TORQUE_AT, VELOCITY_AT, motion};

const CYCLE: DurationNs = DurationNs::from_millis(10);

fn motion() -> End {
    End::Motion(MotionLink::new(ControlMode::POSITION, 1000, CYCLE))
}

/// The row of a position command with this request.
fn row(request: AxisControl, may_run: bool, position: i32) -> Row {
    let mut row = [0; ROW_LEN];
    row[..POSITION_AT].copy_from_slice(&[request.0, u8::from(may_run), ControlMode::POSITION.0]);
    row[POSITION_AT..VELOCITY_AT].copy_from_slice(&position.to_le_bytes());
    row
}

fn sent(end: &mut End, row: &Row) -> FixedCommand {
    let mut message = [0xA5; UPDATE_LEN];
    assert!(end.emit(row, &mut message));
    FixedCommand::parse(&message).unwrap()
}

/// The drive's answer to update `update_id`.
fn answer(update_id: u8, response: AxisControl, state: AxisStateCode, position: i32) -> FixedActual {
    FixedActual {
        update_id,
        node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID,
        control_mode: ControlMode::POSITION,
        axis_response: response,
        axis_state: state,
        actual: ActualValues { position: Some(ActualPosition::Dint(position)), ..Default::default() },
        ..Default::default()
    }
}

fn take(end: &mut End, cycle: u64, actual: &FixedActual, row: &mut Row) -> Result<(), MessageError> {
    let mut message = [0; UPDATE_LEN];
    actual.emit(&mut Writer::new(&mut message)).unwrap();
    end.handle(cycle, &message, row)
}

#[test]
fn a_request_stands_until_it_is_answered_and_is_taken_back_by_a_disable() {
    let mut end = motion();
    let mut seen = [0; ROW_LEN];
    let first = sent(&mut end, &row(AxisControl::ENABLE, true, 7));
    assert_eq!((first.update_id, first.axis_control), (1, AxisControl::ENABLE));
    assert_eq!(first.values.position, Some(CommandPosition::Integer(7)));
    assert_eq!(first.actual_data_set, ActualDataSet::POSITION);
    // The axis has left Stopped: nothing new is asked, and the request stands.
    take(&mut end, 1, &answer(1, AxisControl::NONE, AxisStateCode::STARTING, 7), &mut seen).unwrap();
    assert_eq!(sent(&mut end, &row(AxisControl::NONE, true, 8)).axis_control, AxisControl::ENABLE);
    // It may not run any more: the enable must not come true later.
    assert_eq!(sent(&mut end, &row(AxisControl::NONE, false, 8)).axis_control, AxisControl::DISABLE);
    let id = sent(&mut end, &row(AxisControl::NONE, false, 8)).update_id;
    take(&mut end, 2, &answer(id, AxisControl::DISABLE, AxisStateCode::STOPPED, 7), &mut seen).unwrap();
    assert_eq!(sent(&mut end, &row(AxisControl::NONE, false, 8)).axis_control, AxisControl::NONE);
    assert_eq!(seen[..POSITION_AT], [AxisStateCode::STOPPED.0, motion::VALID, ControlMode::POSITION.0]);
}

#[test]
fn torque_off_goes_before_an_enable_that_is_under_way() {
    let mut end = motion();
    assert_eq!(sent(&mut end, &row(AxisControl::ENABLE, true, 0)).axis_control, AxisControl::ENABLE);
    assert_eq!(sent(&mut end, &row(AxisControl::SHUTDOWN, false, 0)).axis_control, AxisControl::SHUTDOWN);
}

#[test]
fn an_enable_that_waits_for_the_handshake_is_forgotten_with_its_cause() {
    let mut end = motion();
    let mut seen = [0; ROW_LEN];
    let id = sent(&mut end, &row(AxisControl::DISABLE, false, 0)).update_id;
    take(&mut end, 1, &answer(id, AxisControl::DISABLE, AxisStateCode::STOPPED, 0), &mut seen).unwrap();
    // The response has not gone back to 0: the enable waits, and is not wanted any more before it does.
    assert_eq!(sent(&mut end, &row(AxisControl::ENABLE, true, 0)).axis_control, AxisControl::NONE);
    let id = sent(&mut end, &row(AxisControl::NONE, false, 0)).update_id;
    take(&mut end, 2, &answer(id, AxisControl::NONE, AxisStateCode::STOPPED, 0), &mut seen).unwrap();
    assert_eq!(sent(&mut end, &row(AxisControl::NONE, false, 0)).axis_control, AxisControl::NONE);
}

#[test]
fn the_velocity_is_the_way_over_four_cycles() {
    let mut end = motion();
    let mut seen = [0; ROW_LEN];
    let mut found = Vec::new();
    // A thousandth of a unit a count: 5 counts in 10 ms are 0.5 units a second, over the end of the DINT too.
    for (cycle, position) in (0..6).map(|cycle| (cycle, (i32::MAX - 12).wrapping_add(5 * cycle))) {
        let id = sent(&mut end, &row(AxisControl::NONE, false, 0)).update_id;
        let actual = answer(id, AxisControl::NONE, AxisStateCode::STOPPED, position);
        take(&mut end, cycle.unsigned_abs().into(), &actual, &mut seen).unwrap();
        assert_eq!(i32::from_le_bytes(word(&seen, POSITION_AT)), position);
        found.push(f32::from_le_bytes(word(&seen, VELOCITY_AT)));
    }
    assert!(found[0].is_nan(), "nothing is known from one position");
    assert!(found[1..].iter().all(|velocity| (velocity - 0.5).abs() < 1e-6), "{found:?}");
}

#[test]
fn what_does_not_count_leaves_the_row_alone() {
    let mut end = motion();
    let id = sent(&mut end, &row(AxisControl::NONE, false, 0)).update_id;
    let mut seen = [0x5A; ROW_LEN];
    let old = answer(id.wrapping_sub(1), AxisControl::NONE, AxisStateCode::RUNNING, 9);
    assert!(take(&mut end, 1, &old, &mut seen).is_err(), "an answer to an older update");
    assert!(end.handle(1, &[], &mut seen).is_err() && end.handle(1, &[0; 15], &mut seen).is_err());
    assert_eq!(seen, [0x5A; ROW_LEN]);
    // What is no number is no command.
    let mut broken = row(AxisControl::NONE, false, 0);
    broken[MODE_AT] = ControlMode::VELOCITY.0;
    broken[VELOCITY_AT..TORQUE_AT].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(!end.emit(&broken, &mut [0; UPDATE_LEN]));
}

#[test]
fn the_fault_of_a_node_is_reset_by_node_control_until_it_is_gone() {
    let mut end = motion();
    let mut seen = [0; ROW_LEN];
    let id = sent(&mut end, &row(AxisControl::NONE, false, 0)).update_id;
    let mut actual = answer(id, AxisControl::NONE, AxisStateCode::MAJOR_FAULTED, 0);
    actual.node_status |= NodeStatus::FAULT;
    take(&mut end, 1, &actual, &mut seen).unwrap();
    assert_eq!(seen[1], motion::VALID | motion::NODE_FAULT);
    let reset = |command: &FixedCommand| command.node_control.contains(NodeControl::FAULT_RESET);
    assert!(!reset(&sent(&mut end, &row(AxisControl::NONE, false, 0))));
    assert!(reset(&sent(&mut end, &row(AxisControl::FAULT_RESET, false, 0))));
    let command = sent(&mut end, &row(AxisControl::NONE, false, 0));
    assert!(reset(&command), "it stands");
    let actual = answer(command.update_id, AxisControl::NONE, AxisStateCode::STOPPED, 0);
    take(&mut end, 2, &actual, &mut seen).unwrap();
    assert!(!reset(&sent(&mut end, &row(AxisControl::NONE, false, 0))));
}

#[test]
fn a_velocity_drive_runs_either_way_only_with_the_extended_assembly() {
    let speed = |assembly| End::Speed(SpeedLink::new(Assembly(assembly)).unwrap());
    let mut row = [0; ROW_LEN];
    row[0] = crate::mapping::devicenet::speed::RUN;
    row[POSITION_AT..POSITION_AT + 2].copy_from_slice(&(-600_i16).to_le_bytes());
    let mut message = [0xA5; 4];
    assert!(speed(21).emit(&row, &mut message));
    assert_eq!(message, [0x62, 0, 0x58, 2], "run reverse at 600 rpm, led from the network");
    assert!(!speed(20).emit(&row, &mut message), "and the drive is sent nothing");
    let mut end = speed(21);
    let mut seen = [0; ROW_LEN];
    end.handle(1, &[0x64, 4, 0x58, 2], &mut seen).unwrap();
    assert_eq!(seen[..5], [0x64, 4, ControlMode::VELOCITY.0, 0x58, 2]);
    assert!(end.handle(1, &[0x64, 4, 0x58], &mut seen).is_err());
    row[0] = crate::mapping::devicenet::speed::RESET;
    // The edge may be lost: it stands for five messages.
    for message_of in 0..8 {
        row[0] = if message_of < 2 { row[0] } else { 0 };
        assert!(end.emit(&row, &mut message));
        assert_eq!(message[0] & 4 != 0, message_of < 5, "message {message_of}: {message:02x?}");
    }
}
