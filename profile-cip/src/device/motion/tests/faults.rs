//! What follows from exceptions, and how their records travel: clauses 5-2.3.13 to 5-2.3.18 and 5-2.6.3.

use std::fmt::Write as _;

use super::*;
use crate::device::attribute::id;
use crate::device::axis::SequenceSettings;
use crate::device::axis::drive_link::{AbortCause, AbortOrder};
use crate::device::axis::fault_log::LogKind;
use crate::device::axis::state::AxisState;
use crate::wire::motion::codes::{AlarmType, AxisStatus, ClearingEvent, FaultType, NodeFault};

const MFG: FaultType = FaultType::AXIS_MFG;

fn condition(fault_type: FaultType, code: u8) -> DriveCondition {
    DriveCondition { fault_type, code, sub_code: 7, action: 0x24, at: EPOCH + 5, ..DriveCondition::default() }
}

/// Both arrays of actions set to the same action throughout.
fn set_actions(rig: &mut Rig, action: u8) {
    for id in [id::AXIS_EXCEPTION_ACTION, id::AXIS_EXCEPTION_ACTION_MFG] {
        rig.device.put_attribute(0, id, &[action; 64]).expect("the array");
    }
}

/// A running rig that is asked for alarm records as well, and has told all it had to tell.
fn listening() -> Rig {
    let mut rig = Rig::running();
    rig.blocks[0].status_data_set |= StatusDataSet::ALARM;
    rig.cycles(4);
    rig
}

fn raise(rig: &mut Rig, conditions: &[DriveCondition]) {
    rig.drives[0].image.conditions = DriveConditions::of(conditions);
}

/// The records of `cycles` updates, without repetitions.
fn records(rig: &mut Rig, cycles: usize) -> Vec<String> {
    let mut seen = Vec::new();
    for _ in 0..cycles {
        rig.cycle();
        let status = rig.actual(0).status;
        let fault = status
            .fault
            .map(|r| format!("{} {} sub {} action {:#04x}", r.fault_type, r.code, r.sub_code, r.action));
        let alarm =
            status.alarm.map(|r| format!("{} {} sub {} state {}", r.alarm_type, r.code, r.sub_code, r.state));
        seen.extend(fault.into_iter().chain(alarm));
    }
    seen.dedup();
    seen
}

/// Whether only the bit of `code` is set, or none, or others.
fn bits(word: u64, code: u8) -> &'static str {
    match word {
        0 => "-",
        word if word == 1 << code => "set",
        _ => "wrong",
    }
}

/// What one exception does, with its own number left out so that those that do the same look the same.
fn outcome(fault_type: FaultType, code: u8, action: u8, least: ExceptionAction) -> String {
    let mut rig = listening();
    set_actions(&mut rig, action);
    raise(&mut rig, &[DriveCondition { least, ..condition(fault_type, code) }]);
    let mut told = records(&mut rig, 1);
    let first = rig.state(0);
    let status = |rig: &Rig| rig.actual(0).status.axis_status.map(|(status, _)| status);
    let mut alarm_bit = false;
    for _ in 0..6 {
        alarm_bit |= status(&rig).is_some_and(|status| status.contains(AxisStatus::ALARM));
        told.extend(records(&mut rig, 1));
    }
    told.dedup();
    let told = told.join(", ").replace(&format!(" {code} sub"), " # sub");
    let words = *rig.device.fault_words(0).expect("an axis");
    let bank = usize::from(fault_type == MFG);
    assert_eq!(alarm_bit, words.alarm(AlarmType(fault_type.0)) != 0, "Axis Status bit 1");
    // The condition goes by itself: alarms go with it, faults stay.
    raise(&mut rig, &[]);
    let ended = records(&mut rig, 4).join(", ").replace(&format!(" {code} sub"), " # sub");
    let after = *rig.device.fault_words(0).expect("an axis");
    format!(
        "{first}, then {} | exception {}, fault {}, alarm {} | {told} || gone: fault {}, alarm {} | {ended}",
        rig.state(0),
        bits(words.exceptions[bank], code),
        bits(words.fault(fault_type), code),
        bits(words.alarm(AlarmType(fault_type.0)), code),
        bits(after.fault(fault_type), code),
        bits(after.alarm(AlarmType(fault_type.0)), code),
    )
}

/// Every exception of both tables with every action, and with what a drive that is already off makes of it. Bit 0 is no
/// exception: what claims to be one is an external exception.
#[test]
fn every_exception_follows_its_action() {
    let mut table = String::new();
    for fault_type in [FaultType::AXIS, MFG] {
        for least in [ExceptionAction::IGNORE, ExceptionAction::MAJOR_FAULT] {
            for action in [0, 1, 2, 3, 255] {
                let mut groups: Vec<(String, Vec<u8>)> = Vec::new();
                for code in 1..64 {
                    let result = outcome(fault_type, code, action, least);
                    match groups.iter_mut().find(|(known, _)| *known == result) {
                        Some((_, codes)) => codes.push(code),
                        None => groups.push((result, vec![code])),
                    }
                }
                for (result, codes) in groups {
                    let (first, last) = (codes[0], codes[codes.len() - 1]);
                    assert_eq!(codes.len(), usize::from(last - first) + 1, "a run of codes");
                    let action = ExceptionAction(action);
                    writeln!(table, "{fault_type} {first}-{last}, {action}, at least {least}: {result}")
                        .expect("a string");
                }
            }
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_code_without_a_bit_stops_the_axis_as_an_external_exception() {
    for bad in [condition(FaultType::AXIS, 0), condition(FaultType::AXIS, 64), condition(FaultType(99), 3)] {
        let mut rig = listening();
        raise(&mut rig, &[bad]);
        rig.cycle();
        assert_eq!(rig.device.axis_faults(0), Some(1 << 63));
        assert_eq!(rig.state(0), AxisState::Aborting);
    }
}

/// A rig whose exceptions have rules: 54 can do anything, 33 only Major Fault, 8 is an alarm, the others are unsupported.
fn ruled() -> Rig {
    let rule = |code: u8| {
        let (default, low, high) = match code {
            54 => (3, 0.0, 3.0),
            33 => (3, 3.0, 3.0),
            8 => (1, 0.0, 3.0),
            _ => (255, 255.0, 255.0),
        };
        ElementRule { default: DefaultValue::Integer(default), range: (low, high), keeps: Some(255) }
    };
    let mut definitions = definitions();
    let array = definitions.iter_mut().find(|row| row.id == 672).expect("the array");
    array.element_rules = (0..64).map(rule).collect();
    let mut rig = Rig::with(definitions);
    rig.open();
    rig.configure();
    rig.cycles(3);
    rig
}

fn get_array(rig: &mut Rig) -> Vec<u8> {
    rig.device.attribute(0, 672).expect("the array").to_vec()
}

/// Sets elements of attribute 672 by Set_Axis_Attributes_List; returns status and array index of the answer.
fn set_elements(rig: &mut Rig, transaction: u8, first: u16, values: &[u8]) -> (u8, u8) {
    let count = u16::try_from(values.len()).expect("few");
    let mut body = vec![1, 0, 0, 0, 0xA0, 2, 1, 1];
    body.extend(first.to_le_bytes());
    body.extend(count.to_le_bytes());
    body.extend(values);
    body.resize(body.len().next_multiple_of(4), 0);
    rig.services[1] = Some((transaction, MotionService::SET_AXIS_ATTRIBUTES_LIST, body));
    rig.cycle();
    let (_, _, answer) = rig.response(1).expect("an answer");
    (answer[6], answer[7])
}

#[test]
fn an_action_that_an_exception_does_not_have_is_refused_at_its_place() {
    let mut rig = ruled();
    let defaults = get_array(&mut rig);
    assert_eq!((defaults[54], defaults[33], defaults[8], defaults[9], defaults[0]), (3, 3, 1, 255, 255));
    assert_eq!(set_elements(&mut rig, 1, 54, &[0]), (0, 0));
    assert_eq!(set_elements(&mut rig, 2, 33, &[2]), (0x09, 33), "the drive is off: nothing less than major");
    assert_eq!(set_elements(&mut rig, 3, 9, &[0]), (0x09, 9), "unsupported stays unsupported");
    assert_eq!(set_elements(&mut rig, 4, 9, &[255]), (0, 0));
    assert_eq!(set_elements(&mut rig, 5, 54, &[255]), (0, 0), "a controller that does not know it");
    assert_eq!(get_array(&mut rig)[54], 0, "leaves it as it is");
    assert_eq!(set_elements(&mut rig, 6, 54, &[4]), (0x09, 54), "reserved");
    assert_eq!(set_elements(&mut rig, 7, 53, &[255, 1, 255, 3]), (0x09, 56), "nothing of it is taken");
    let mut expected = defaults.clone();
    expected[54] = 0;
    assert_eq!(get_array(&mut rig), expected);
    assert_eq!(set_elements(&mut rig, 8, 0, &defaults), (0, 0), "the whole array, as it was");
    assert_eq!(get_array(&mut rig), defaults);
    // The array of a controller that knows two of the exceptions.
    let mut few = vec![255; 64];
    (few[8], few[54]) = (0, 1);
    assert_eq!(set_elements(&mut rig, 10, 0, &few), (0, 0));
    let mut expected = defaults.clone();
    (expected[8], expected[54]) = (0, 1);
    assert_eq!(get_array(&mut rig), expected);
    // A new connection begins with the defaults again.
    set_elements(&mut rig, 9, 8, &[3]);
    rig.services[1] = None;
    rig.close();
    rig.open();
    assert_eq!(get_array(&mut rig), defaults);
}

#[test]
fn the_attributes_show_what_is_there() {
    let mut rig = listening();
    set_actions(&mut rig, 1);
    rig.device
        .put_attribute(0, 672, &{
            let mut actions = [1; 64];
            actions[10] = 3;
            actions[11] = 2;
            actions[12] = 0;
            actions
        })
        .expect("the array");
    let all = [10, 11, 12, 13].map(|code| condition(FaultType::AXIS, code));
    let mut both = all.to_vec();
    both.push(condition(MFG, 5));
    both.push(condition(FaultType::APR, 7));
    raise(&mut rig, &both);
    rig.drives[0].image.start_inhibits = 1 << 5;
    rig.cycles(3);
    // By Get_Axis_Attributes_List, so that the values are published for the service.
    let ids = [655_u16, 656, 657, 658, 659, 660, 661, 662, 663, 666, 668, 674, 675, 676, 677];
    let mut body = vec![15, 0, 0, 0];
    for (id, size) in ids.iter().zip([8_u8, 8, 8, 8, 8, 8, 1, 1, 8, 1, 1, 4, 4, 2, 2]) {
        body.extend(id.to_le_bytes());
        body.extend([0, size]);
    }
    rig.services[1] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, body));
    rig.cycle();
    let (_, status, answer) = rig.response(1).expect("an answer");
    assert_eq!(status, 0);
    let mut values = Vec::new();
    let mut rest = &answer[4..];
    while let [_, _, _, size, more @ ..] = rest {
        let (value, padded) = (usize::from(*size), usize::from(*size).next_multiple_of(4));
        let mut octets = [0; 8];
        octets[..value].copy_from_slice(&more[..value]);
        values.push(u64::from_le_bytes(octets));
        rest = &more[padded..];
    }
    let exceptions = 1 << 10 | 1 << 11 | 1 << 12 | 1 << 13;
    assert_eq!(values[..6], [exceptions, 1 << 5, 1 << 10 | 1 << 11, 0, 1 << 13, 1 << 5]);
    // The newest record is the last in the list: the lost absolute position, a minor fault.
    assert_eq!(values[6..11], [7, 5, EPOCH + 5, 7, 0]);
    assert_eq!(values[11..], [0, 0, 1 << 5, 0]);
    assert_eq!(rig.device.fault_words(0).expect("an axis").fault(FaultType::APR), 1 << 7);
}

#[test]
fn records_arrive_one_by_one_whatever_is_lost() {
    let mut rig = listening();
    set_actions(&mut rig, 2);
    let codes = [3, 20, 40, 55];
    raise(&mut rig, &codes.map(|code| condition(FaultType::AXIS, code)));
    let mut taken = Vec::new();
    let mut last_received = rig.header().update_id;
    // Of three updates the controller hears one; what it says it has heard comes twice, or late.
    for round in 0..60 {
        rig.sequence = rig.sequence.wrapping_add(1);
        rig.update_id = rig.update_id.wrapping_add(1);
        let header = CommandHeader { last_received_id: last_received, ..rig.command_header() };
        let packet = rig.packet_with(&header);
        rig.send(&packet);
        rig.run_device();
        rig.now += PERIOD;
        if round % 3 == 0 {
            last_received = rig.header().update_id;
            taken.extend(rig.actual(0).status.fault.map(|record| record.code));
        }
    }
    // Each record once or more, none left out, none after a later one.
    taken.dedup();
    assert_eq!(taken, codes);
    assert_eq!(rig.device.dropped_records(0), Some(0));
}

#[test]
fn a_condition_of_the_drive_is_shown_and_no_stop_is_ordered_for_it() {
    let mut rig = listening();
    set_actions(&mut rig, 3);
    rig.drives[0].stuck = true;
    raise(&mut rig, &[DriveCondition { action: 0x23, ..condition(FaultType::AXIS, 54) }]);
    assert_eq!(records(&mut rig, 1), ["Axis Fault 54 sub 7 action 0x23"]);
    assert_eq!((rig.command(0).action, rig.command(0).abort), (DriveAction::Abort, None));
    let mut both = rig.drives[0].image.conditions;
    both.push(DriveCondition { action: 0x34, ..condition(FaultType::AXIS, 10) });
    rig.drives[0].image.conditions = both;
    assert_eq!(
        records(&mut rig, 5),
        ["Axis Fault 10 sub 7 action 0x34"],
        "each with the stop that it leaves"
    );
    assert_eq!((rig.command(0).action, rig.command(0).abort), (DriveAction::Abort, None));
    rig.drives[0].stuck = false;
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    // Shutdown was latched by the second one.
    raise(&mut rig, &[]);
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::Shutdown);
}

#[test]
fn what_the_device_finds_itself_orders_a_stop_with_its_cause() {
    let mut rig = listening();
    set_actions(&mut rig, 3);
    rig.drives[0].stuck = true;
    // A condition of the drive beside it changes nothing about the order.
    raise(&mut rig, &[DriveCondition { action: 0x34, ..condition(FaultType::AXIS, 10) }]);
    rig.device.set_sequence(0, SequenceSettings { flying_start: false, abort: 0x13 });
    rig.request_all(AxisControl::ABORT);
    rig.cycle();
    let order = AbortOrder { action: 0x13, cause: AbortCause::Controller };
    assert_eq!((rig.command(0).action, rig.command(0).abort), (DriveAction::Abort, Some(order)));
    // A second one makes it harder, and what came first stays the cause.
    let found = |rig: &mut Rig| rig.command(0).abort.expect("an order");
    rig.blocks[0].control_mode = ControlMode(9);
    rig.cycles(2);
    assert_eq!(found(&mut rig), order, "an axis that aborts has no modes to be wrong");
    rig.close();
    assert_eq!(rig.command(0).abort, None, "the connection has ended");

    let mut rig = listening();
    rig.blocks[0].control_mode = ControlMode(9);
    rig.cycle();
    assert_eq!(found(&mut rig), AbortOrder { action: 0x22, cause: AbortCause::IllegalMode });

    let mut rig = listening();
    rig.drives[0].image.online = false;
    rig.cycle();
    assert_eq!(found(&mut rig), AbortOrder { action: 0x24, cause: AbortCause::DriveLost });

    let mut rig = listening();
    rig.drives[0].stuck = true;
    rig.device.raise_node_fault(NodeFault::DATA_FORMAT);
    rig.cycle();
    assert_eq!(found(&mut rig), AbortOrder { action: 0x22, cause: AbortCause::Node });
}

#[test]
fn a_minor_fault_becomes_major_when_its_action_does() {
    let mut rig = listening();
    set_actions(&mut rig, 2);
    raise(&mut rig, &[condition(FaultType::AXIS, 54)]);
    assert_eq!(records(&mut rig, 5), ["Axis Fault 54 sub 7 action 0x00"]);
    assert_eq!(rig.state(0), AxisState::Running);
    set_actions(&mut rig, 3);
    assert_eq!(records(&mut rig, 5), ["Axis Fault 54 sub 7 action 0x24"]);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
}

#[test]
fn initialization_faults_are_there_before_anything_else_and_no_reset_clears_them() {
    let mut rig = Rig::new();
    raise(&mut rig, &[condition(FaultType::INITIALIZATION, 3), condition(FaultType::AXIS, 10)]);
    rig.open();
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    raise(&mut rig, &[]);
    rig.configure();
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(5);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    assert_eq!(
        (rig.actual(0).axis_response, rig.actual(0).response_status),
        (AxisControl::FAULT_RESET, 0x0C)
    );
    let words = rig.device.fault_words(0).expect("an axis");
    assert_eq!((words.fault(FaultType::INITIALIZATION), words.fault(FaultType::AXIS)), (1 << 3, 0));
}

#[test]
fn a_drive_that_is_gone_ends_in_major_faulted_when_its_time_is_over_and_stands_nowhere() {
    let mut rig = listening();
    rig.drives[0].image.axis_status = AxisStatus::VELOCITY_STANDSTILL | AxisStatus::FEEDBACK_INTEGRITY;
    rig.cycles(3);
    rig.drives[0].image.online = false;
    rig.drives[0].stuck = true;
    rig.cycles(100);
    assert_eq!(rig.state(0), AxisState::Aborting, "nobody has seen it stop");
    rig.drives[0].image.stop_complete = true;
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::MajorFaulted, "the time limit of the stop is over");
    rig.services[1] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, vec![1, 0, 0, 0, 0x8B, 2, 0, 4]));
    rig.cycle();
    let (_, _, answer) = rig.response(1).expect("an answer");
    let status = u32::from_le_bytes([answer[8], answer[9], answer[10], answer[11]]);
    let unsaid = AxisStatus::VELOCITY_STANDSTILL | AxisStatus::FEEDBACK_INTEGRITY;
    assert!(!AxisStatus::from_bits_retain(status).intersects(unsaid), "{status:#x}");
}

#[test]
fn the_log_keeps_state_time_and_end_beyond_the_connection() {
    let mut rig = listening();
    set_actions(&mut rig, 3);
    let fault = DriveCondition { detail: 0xBEEF, ..condition(FaultType::AXIS, 10) };
    raise(&mut rig, &[fault]);
    rig.cycles(3);
    rig.close();
    let log = rig.device.fault_log(0).expect("an axis");
    let entry = *log.entries().next().expect("an entry");
    assert_eq!((entry.kind, entry.code, entry.detail), (LogKind::Fault(FaultType::AXIS), 10, 0xBEEF));
    assert_eq!((entry.state, entry.at), (AxisState::Running, EPOCH + 5));
    assert_eq!(entry.ended.map(|(by, _)| by), Some(ClearingEvent::CONNECTION_RESET));
    assert_eq!(std::iter::from_fn(|| rig.device.poll_fault_log(0)).count(), 2, "came and went");
}

#[test]
fn start_inhibits_come_and_go_as_alarm_records() {
    let mut rig = Rig::stopped();
    rig.blocks[0].status_data_set |= StatusDataSet::ALARM;
    rig.cycles(3);
    rig.drives[0].image.start_inhibits = 1 << 5;
    assert_eq!(records(&mut rig, 4), ["Start Inhibit 5 sub 0 state 1"]);
    assert_eq!(rig.state(0), AxisState::StartInhibited);
    rig.drives[0].image.start_inhibits = 0;
    assert_eq!(records(&mut rig, 4), ["Start Inhibit 5 sub 0 state 0"]);
}

#[test]
fn a_shutdown_reset_in_shutdown_clears_minor_faults_and_the_next_one_is_reported() {
    const CAME: &str = "Axis Fault 54 sub 7 action 0x00";
    let mut rig = listening();
    set_actions(&mut rig, 2);
    raise(&mut rig, &[condition(FaultType::AXIS, 54)]);
    assert_eq!(records(&mut rig, 4), [CAME]);
    raise(&mut rig, &[]);
    rig.request_all(AxisControl::SHUTDOWN);
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Shutdown, Some(1 << 54)));
    rig.request_all(AxisControl::SHUTDOWN_RESET);
    assert_eq!(records(&mut rig, 4).len(), 1, "cleared");
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Stopped, Some(0)));
    let entry = rig.device.fault_log(0).and_then(|log| log.entries().next().copied()).expect("an entry");
    assert_eq!(entry.ended.map(|(by, _)| by), Some(ClearingEvent::SHUTDOWN_RESET));
    raise(&mut rig, &[condition(FaultType::AXIS, 54)]);
    assert_eq!(records(&mut rig, 4), [CAME]);
}
