//! The fixed format: every value it can carry both ways, what it cannot carry, round trips. Tables 6-2.49 and 6-2.50.

use proptest::prelude::*;

use super::super::codes::{
    ActualDataSet, AxisControl, AxisStateCode, CommandTarget, ControlMode, ControlStatus, FeedbackMode,
    FeedbackSource, NodeControl, NodeStatus, StatusDataSet,
};
use super::super::fixed::{FixedActual, FixedCommand, LEN};
use super::super::{ActualPosition, ActualValues, CommandPosition, CommandValues};
use crate::wire::Writer;

fn command(values: CommandValues) -> FixedCommand {
    FixedCommand {
        update_id: 9,
        node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
        axis_control: AxisControl::ENABLE,
        actual_data_set: ActualDataSet::POSITION,
        status_data_set: StatusDataSet::FAULT,
        values,
    }
}

fn actual(values: ActualValues) -> FixedActual {
    FixedActual {
        update_id: 9,
        node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID | NodeStatus::FAULT,
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
        axis_response: AxisControl::ENABLE,
        response_status: 0x0C,
        axis_state: AxisStateCode::STOPPED,
        actual: values,
    }
}

fn emitted(emit: impl FnOnce(&mut Writer<'_>) -> Result<(), crate::wire::Error>) -> Vec<u8> {
    let mut buffer = [0xA5; LEN + 4];
    let mut writer = Writer::new(&mut buffer);
    emit(&mut writer).expect("room");
    let len = writer.written();
    assert_eq!(buffer[len..], [0xA5; 4], "nothing is written behind the update");
    buffer[..len].to_vec()
}

#[test]
fn every_command_value_both_ways() {
    let none = CommandValues::default();
    let cases = [
        (none, 0x00, [0, 0, 0, 0]),
        (
            CommandValues { position: Some(CommandPosition::Integer(-2)), ..none },
            0x01,
            [0xFE, 0xFF, 0xFF, 0xFF],
        ),
        (CommandValues { velocity: Some(2.5), ..none }, 0x02, [0x00, 0x00, 0x20, 0x40]),
        (CommandValues { acceleration: Some(-1.5), ..none }, 0x04, [0x00, 0x00, 0xC0, 0xBF]),
        (CommandValues { torque: Some(100.0), ..none }, 0x08, [0x00, 0x00, 0xC8, 0x42]),
        (CommandValues { unwind_count: Some(3), ..none }, 0x40, [3, 0, 0, 0]),
        (CommandValues { position_displacement: Some(0x1234), ..none }, 0x80, [0x34, 0x12, 0, 0]),
    ];
    for (values, set, value) in cases {
        let command = command(values);
        let octets = [&[2, 2, 9, 5, 1, 2, 1, 0, set, 1, 1, 0], &value[..]].concat();
        assert_eq!(emitted(|writer| command.emit(writer)), octets, "{set:#04x}");
        assert_eq!(FixedCommand::parse(&octets), Ok(command), "{set:#04x}");
    }
}

#[test]
fn every_actual_value_both_ways() {
    let none = ActualValues::default();
    let cases = [
        (none, 0x00, [0, 0, 0, 0]),
        (ActualValues { position: Some(ActualPosition::Dint(i32::MIN)), ..none }, 0x01, [0, 0, 0, 0x80]),
        (ActualValues { velocity: Some(2.25), ..none }, 0x02, [0x00, 0x00, 0x10, 0x40]),
        (ActualValues { acceleration: Some(0.5), ..none }, 0x04, [0x00, 0x00, 0x00, 0x3F]),
        (ActualValues { unwind_count: Some(-1), ..none }, 0x40, [0xFF; 4]),
        (ActualValues { position_displacement: Some(7), ..none }, 0x80, [7, 0, 0, 0]),
    ];
    for (values, set, value) in cases {
        let actual = actual(values);
        let octets = [&[3, 2, 9, 0b1101, 1, 2, 1, 0x0C, 0, set, 0, 2], &value[..]].concat();
        assert_eq!(emitted(|writer| actual.emit(writer)), octets, "{set:#04x}");
        assert_eq!(FixedActual::parse(&octets), Ok(actual), "{set:#04x}");
    }
}

#[test]
fn what_the_octets_cannot_mean_is_refused() {
    let good = emitted(|writer| command(CommandValues::default()).emit(writer));
    let said = |at: usize, octet: u8| {
        let mut octets = good.clone();
        octets[at] = octet;
        FixedCommand::parse(&octets).map_or_else(|error| error.to_string(), |_| "taken".to_owned())
    };
    let at = |offset, what: &str, found: &str, expected: &str| {
        let text = said(offset, u8::from_str_radix(&found[2..], 16).expect("hex"));
        assert!(
            text.contains(what) && text.contains(found) && text.contains(expected),
            "{what} {found} {expected}: {text}"
        );
    };
    at(0, "connection format", "0x6", "0x2");
    at(0, "connection format", "0x3", "0x2");
    at(1, "format revision", "0x1", "0x2");
    at(8, "command data set", "0x3", "0x1");
    at(8, "command data set", "0x12", "0x2");
    at(8, "command data set", "0x10", "0x0");
    at(9, "actual data set", "0x3", "0x1");
    at(9, "actual data set", "0xc0", "0x40");
    // Reserved octets, reserved bits of what is asked for, and status data nobody can send.
    for (offset, octet) in [(7, 0xFF), (11, 0xFF), (9, 0x38), (9, 0x39), (10, 0xFF)] {
        assert_eq!(said(offset, octet), "taken", "octet {offset} = {octet:#04x}");
    }
    let good = emitted(|writer| actual(ActualValues::default()).emit(writer));
    let refused = |at: usize, octet: u8| {
        let mut octets = good.clone();
        octets[at] = octet;
        FixedActual::parse(&octets).is_err()
    };
    // A fault record has 12 octets and the shortest status element 8: none has room.
    for (at, octet) in [(0, 2), (0, 7), (1, 3), (9, 3), (9, 8), (10, 1), (10, 4)] {
        assert!(refused(at, octet), "octet {at} = {octet}");
    }
    assert!(!refused(8, 0xFF), "reserved");
}

#[test]
fn what_has_no_room_is_not_written() {
    let mut buffer = [0; LEN];
    let none = CommandValues::default();
    let float = CommandValues { position: Some(CommandPosition::Float(1.0)), ..none };
    let two = CommandValues { velocity: Some(1.0), torque: Some(1.0), ..none };
    for values in [float, two] {
        assert!(command(values).emit(&mut Writer::new(&mut buffer)).is_err(), "{values:?}");
    }
    let asked = ActualDataSet::POSITION | ActualDataSet::VELOCITY;
    let greedy = FixedCommand { actual_data_set: asked, ..command(none) };
    assert!(greedy.emit(&mut Writer::new(&mut buffer)).is_err());
    let lint = ActualValues { position: Some(ActualPosition::Lint(1)), ..ActualValues::default() };
    assert!(actual(lint).emit(&mut Writer::new(&mut buffer)).is_err());
    assert!(command(none).emit(&mut Writer::new(&mut buffer[..LEN - 1])).is_err());
}

#[test]
fn an_update_is_the_header_and_the_block_of_the_variable_format() {
    let values = CommandValues { position: Some(CommandPosition::Integer(5)), ..CommandValues::default() };
    let update = FixedCommand { feedback_mode: FeedbackMode(0x12), ..command(values) };
    let header = update.header();
    assert_eq!((header.update_id, header.node_control.bits(), header.instance_count), (9, 5, 1));
    assert_eq!((header.time_stamp, header.time_offset, header.time_data_set().bits()), (None, None, 0));
    let block = update.block(ControlStatus::CONFIGURATION_COMPLETE, CommandTarget::INTERPOLATE);
    assert_eq!(block.values, values);
    assert_eq!(block.axis_control, AxisControl::ENABLE);
    assert_eq!(block.feedback_mode, FeedbackMode(0x02), "the position comes back as DINT");
    assert_eq!(block.status_data_set, StatusDataSet::empty(), "status data are never answered");
    assert_eq!((block.control_status.bits(), block.target), (1, CommandTarget::INTERPOLATE));
}

proptest! {
    #[test]
    fn sixteen_octets_are_refused_or_come_back(head in any::<[u8; 8]>(), sets in any::<[u8; 4]>(), value in any::<[u8; 4]>(), small in any::<bool>()) {
        let mut octets = [head.as_slice(), &sets, &value].concat();
        octets[1] = 2;
        if small {
            octets[8] = 1 << (octets[8] % 8);
            octets[9] = 1 << (octets[9] % 8);
        }
        octets[0] = 2;
        // What is reserved comes back as zero.
        octets[7] = 0;
        octets[11] = 0;
        if octets[8] == 0 {
            octets[12..].fill(0);
        }
        if let Ok(command) = FixedCommand::parse(&octets) {
            prop_assert_eq!(emitted(|writer| command.emit(writer)), octets.clone());
            for cut in 0..LEN {
                prop_assert!(FixedCommand::parse(&octets[..cut]).is_err(), "cut to {} octets", cut);
            }
            octets.push(0);
            prop_assert!(FixedCommand::parse(&octets).is_err(), "one octet too many");
            octets.pop();
        } else {
            prop_assert!(octets[8].count_ones() > 1 || octets[8] & 0x30 != 0 || (octets[9] & 0xC7).count_ones() > 1);
        }
        octets[0] = 3;
        octets[7] = head[7];
        octets[8] = 0;
        octets[10] = 0;
        octets[11] = sets[3];
        if octets[9] == 0 {
            octets[12..].fill(0);
        }
        if let Ok(actual) = FixedActual::parse(&octets) {
            prop_assert_eq!(emitted(|writer| actual.emit(writer)), octets.clone());
            for cut in 0..LEN {
                prop_assert!(FixedActual::parse(&octets[..cut]).is_err(), "cut to {} octets", cut);
            }
        } else {
            prop_assert!(octets[9].count_ones() > 1 || octets[9] & 0x38 != 0);
        }
    }
}
