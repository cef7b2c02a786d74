//! The cyclic planes: every combination of the data sets, cyclic axes, LINT, feedback modes, lists, changes of reference.

use super::*;
use crate::device::axis::state::AxisState;
use crate::wire::motion::codes::{AxisStatus, CommandDataSet, FeedbackMode};
use crate::wire::motion::{ActualPosition, ActualValues};

const VALUES: ActualDataSet = ActualDataSet::POSITION
    .union(ActualDataSet::VELOCITY)
    .union(ActualDataSet::ACCELERATION)
    .union(ActualDataSet::UNWIND_COUNT)
    .union(ActualDataSet::POSITION_DISPLACEMENT);

/// A running axis 1 that tells everything a drive can tell.
fn telling(unwind: Option<u32>) -> Rig {
    let mut rig = Rig::running();
    let image = &mut rig.drives[0].image;
    image.position = -730;
    image.velocity = Some(1.5);
    image.acceleration = Some(-2.25);
    image.unwind = unwind;
    rig
}

#[test]
fn every_actual_data_set_is_answered_with_live_values() {
    for (unwind, lint) in [(None, false), (Some(360), false), (None, true), (Some(360), true)] {
        let mut rig = telling(unwind);
        rig.blocks[0].feedback_mode = FeedbackMode(rig.blocks[0].feedback_mode.0).with_lint(lint);
        for bits in 0..=u8::MAX {
            let asked = ActualDataSet::from_bits_retain(bits);
            rig.blocks[0].actual_data_set = asked;
            rig.cycle();
            let has = |bit| asked.contains(bit);
            // -730 is 10 counts before two cycles below zero.
            let position = i64::from(if unwind.is_some() { 350 } else { -730 });
            let short = i32::try_from(position).expect("fits");
            let expected = ActualValues {
                position: has(ActualDataSet::POSITION).then_some(if lint {
                    ActualPosition::Lint(position)
                } else {
                    ActualPosition::Dint(short)
                }),
                velocity: has(ActualDataSet::VELOCITY).then_some(1.5),
                acceleration: has(ActualDataSet::ACCELERATION).then_some(-2.25),
                unwind_count: (has(ActualDataSet::UNWIND_COUNT) && unwind.is_some()).then_some(-3),
                position_displacement: has(ActualDataSet::POSITION_DISPLACEMENT).then_some(0),
            };
            let actual = rig.actual(0);
            assert_eq!(actual.actual, expected, "{asked} {unwind:?}");
            let mut answered = asked & VALUES;
            answered.set(ActualDataSet::UNWIND_COUNT, has(ActualDataSet::UNWIND_COUNT) && unwind.is_some());
            assert_eq!(actual.actual.data_set(), answered, "bits that have no value are clear");
        }
    }
}

#[test]
fn what_the_drive_does_not_tell_is_left_out() {
    let mut rig = telling(None);
    rig.drives[0].image.velocity = None;
    rig.drives[0].image.acceleration = None;
    rig.blocks[0].actual_data_set = ActualDataSet::all();
    rig.cycle();
    let answered = ActualDataSet::POSITION | ActualDataSet::POSITION_DISPLACEMENT;
    assert_eq!(rig.actual(0).actual.data_set(), answered);
}

#[test]
fn every_status_data_set_is_answered_once_and_again_after_a_change() {
    for bits in 0..=u8::MAX {
        let asked = StatusDataSet::from_bits_retain(bits);
        let mut rig = telling(None);
        rig.blocks[0].status_data_set = asked;
        rig.blocks[0].actual_data_set = ActualDataSet::empty();
        rig.cycles(6);
        // Whatever was told before has been acknowledged by now.
        assert_eq!(rig.actual(0).status.data_set(), StatusDataSet::empty(), "{asked}");
        let image = &mut rig.drives[0].image;
        image.axis_status = AxisStatus::VELOCITY_LIMIT;
        image.io_status = crate::wire::motion::codes::AxisIoStatus::HOME_INPUT;
        image.safety =
            Some(crate::wire::motion::actual::SafetyStatus { status: 1, manufacturer: 2, state: 3 });
        rig.blocks[0].axis_control = AxisControl::FAULT_RESET;
        rig.cycle();
        let mut answered = asked
            & (StatusDataSet::FAULT
                | StatusDataSet::AXIS_STATUS
                | StatusDataSet::IO_STATUS
                | StatusDataSet::SAFETY_STATUS);
        // Vendor bits, the reserved one and an alarm that is not there stay clear.
        answered.remove(StatusDataSet::ALARM);
        let mut told = rig.actual(0).status.data_set();
        rig.cycle();
        told |= rig.actual(0).status.data_set();
        assert_eq!(told, answered, "{asked}");
        rig.cycles(4);
        assert_eq!(rig.actual(0).status.data_set(), StatusDataSet::empty(), "{asked}");
    }
}

#[test]
fn every_command_data_set_is_taken_and_the_set_point_of_the_mode_is_needed() {
    for integer in [false, true] {
        for bits in 0..64_u8 {
            let has = |bit: u8| bits & (1 << bit) != 0;
            let mut rig = Rig::running();
            rig.blocks[0].values = CommandValues {
                position: has(0).then_some(if integer {
                    CommandPosition::Integer(-5)
                } else {
                    CommandPosition::Float(-5.5)
                }),
                velocity: has(1).then_some(1.0),
                acceleration: has(2).then_some(2.0),
                torque: has(3).then_some(3.0),
                unwind_count: has(4).then_some(4),
                position_displacement: has(5).then_some(5),
            };
            let sent = rig.blocks[0].values;
            rig.cycle();
            if has(0) {
                assert_eq!(rig.follow(0).values, sent);
                assert_eq!(rig.follow(0).position_reference, 0, "a displacement alone changes nothing");
            } else {
                assert_eq!(rig.state(0), AxisState::Aborting, "{bits:b}");
                assert_eq!(rig.device.axis_faults(0), Some(1 << 60));
            }
            assert_eq!(rig.device.counters().malformed, 0);
        }
    }
}

#[test]
fn an_update_whose_data_set_and_size_disagree_is_refused_as_a_whole() {
    let mut rig = Rig::running();
    rig.blocks[0].values.unwind_count = Some(7);
    let before = rig.follow(0);
    let good = rig.command_packet();
    // Sequence count and header, then the instance header of 8 octets; the data set is octet 4 of the block.
    let at = good.len() - (8 + 8 + 8) - (8 + 8 + 12) + 8 + 4;
    assert_eq!(good[at], (CommandDataSet::POSITION | CommandDataSet::UNWIND_COUNT).bits());
    for bit in [1, 2, 3, 7] {
        let mut bad = good.clone();
        bad[at] |= 1 << bit;
        let malformed = rig.device.counters().malformed;
        rig.sequence = rig.sequence.wrapping_add(1);
        bad[..2].copy_from_slice(&rig.sequence.to_le_bytes());
        rig.send(&bad);
        assert_eq!(rig.device.counters().malformed, malformed + 1, "bit {bit}");
    }
    assert!(
        rig.device.axis_state(0).is_some_and(|state| state != AxisState::Running),
        "node fault 4 stops the axis"
    );
    assert_eq!(before.values.unwind_count, None);
}

#[test]
fn updates_late_doubled_or_out_of_order_move_no_reference() {
    let mut rig = telling(Some(360));
    rig.blocks[0].actual_data_set = ActualDataSet::POSITION | ActualDataSet::UNWIND_COUNT;
    rig.blocks[0].values.position_displacement = Some(100);
    let old = rig.command_packet();
    rig.cycles(2);
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    let request = rig.command_packet();
    rig.send(&request);
    rig.send(&request);
    rig.send(&old);
    rig.send(&request);
    rig.run_device();
    rig.now += PERIOD;
    let seen = |rig: &Rig| (rig.actual(0).actual.position, rig.actual(0).actual.unwind_count);
    // -630 is 90 within cycle -2.
    assert_eq!(seen(&rig), (Some(ActualPosition::Dint(90)), Some(-2)));
    rig.cycles(3);
    assert_eq!(seen(&rig), (Some(ActualPosition::Dint(90)), Some(-2)), "a standing request counts once");
    rig.blocks[0].axis_control = AxisControl::CANCEL;
    rig.cycle();
    assert_eq!(rig.actual(0).axis_response, AxisControl::CANCEL);
    assert_eq!(
        seen(&rig),
        (Some(ActualPosition::Dint(90)), Some(-2)),
        "it was complete, there is nothing to cancel"
    );
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    rig.cycle();
    assert_eq!(seen(&rig), (Some(ActualPosition::Dint(190)), Some(-2)), "a new request is a new change");
}

#[test]
fn half_a_change_of_reference_is_no_ground_to_start_on() {
    let mut rig = Rig::stopped();
    rig.blocks[0].values.position_displacement = Some(5_000);
    let ask = |rig: &mut Rig, control| {
        rig.blocks[0].axis_control = AxisControl::NONE;
        rig.cycle();
        rig.blocks[0].axis_control = control;
        rig.cycles(4);
        (rig.actual(0).axis_response, rig.actual(0).response_status)
    };
    assert_eq!(ask(&mut rig, AxisControl::CHANGE_ACTUAL_POSITION), (AxisControl::CHANGE_ACTUAL_POSITION, 0));
    assert_eq!(ask(&mut rig, AxisControl::ENABLE), (AxisControl::ENABLE, 0x0C));
    assert_eq!(rig.state(0), AxisState::Stopped);
    // Where no position is commanded there is nothing to lead astray.
    rig.blocks[0].control_mode = ControlMode::VELOCITY;
    rig.blocks[0].values.velocity = Some(0.0);
    assert_eq!(ask(&mut rig, AxisControl::ENABLE), (AxisControl::ENABLE, 0));
    rig.blocks[0].control_mode = ControlMode::POSITION;
    rig.cycle();
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Aborting, Some(1 << 60)));
    rig.cycles(4);
    assert_eq!(ask(&mut rig, AxisControl::FAULT_RESET), (AxisControl::FAULT_RESET, 0));
    assert_eq!(
        ask(&mut rig, AxisControl::CHANGE_COMMAND_POSITION),
        (AxisControl::CHANGE_COMMAND_POSITION, 0)
    );
    assert_eq!(ask(&mut rig, AxisControl::ENABLE), (AxisControl::ENABLE, 0));
    assert_eq!(rig.follow(0).position_reference, 5_000);
}

#[test]
fn the_feedback_mode_is_chosen_while_the_axis_stands_and_no_other_while_it_runs() {
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(1);
    rig.blocks[0].axis_control = AxisControl::ENABLE;
    rig.cycles(2);
    assert_eq!((rig.actual(0).axis_response, rig.actual(0).response_status), (AxisControl::ENABLE, 0x09));
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.blocks[0].feedback_mode = FeedbackMode(3);
    rig.cycle();
    rig.blocks[0].axis_control = AxisControl::ENABLE;
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.follow(0).feedback_mode), (AxisState::Running, FeedbackMode(3)));
    rig.blocks[0].feedback_mode = FeedbackMode(3).with_lint(true);
    rig.cycle();
    assert_eq!(rig.state(0), AxisState::Running, "the type of the position is no mode");
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    assert_eq!((rig.state(0), rig.device.axis_faults(0)), (AxisState::Aborting, Some(1 << 60)));
}

#[test]
fn another_scaling_forgets_the_references() {
    let mut rig = telling(Some(360));
    rig.blocks[0].values.position_displacement = Some(100);
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    rig.cycle();
    assert_eq!(rig.actual(0).actual.position, Some(ActualPosition::Dint(90)));
    rig.drives[0].image.scaling_id = 1;
    rig.cycle();
    assert_eq!(rig.actual(0).actual.position, Some(ActualPosition::Dint(350)));
}

#[test]
fn updates_of_a_cyclic_axis_read_well() {
    let mut rig = telling(Some(360));
    rig.blocks[0].actual_data_set = ActualDataSet::all();
    rig.blocks[0].status_data_set = StatusDataSet::all();
    rig.blocks[0].values.unwind_count = Some(-3);
    rig.blocks[0].values.position_displacement = Some(100);
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    let packet = rig.command_packet();
    rig.send(&packet);
    rig.run_device();
    let command = crate::wire::motion::CommandFrame::parse(&packet[2..]).expect("a good update");
    insta::assert_snapshot!(format!("{command}\n{}", rig.frame()));
}
