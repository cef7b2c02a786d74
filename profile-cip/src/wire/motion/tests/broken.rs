//! Updates that must be refused, each with its reason and place.

use super::super::codes::{AxisControl, ControlMode, MotionService};
use super::super::{
    CommandBlock, CommandEvents, CommandFrame, CommandInstance, CommandPosition, CommandValues, EventAck,
    ServiceRequest, WriteBlock,
};
use super::{emit, header};
use crate::wire::Error;
use profile_generic::wire::Expected;

/// An update with the class and two axes and every kind of block.
fn full() -> Vec<u8> {
    let values = CommandValues {
        position: Some(CommandPosition::Float(1.5)),
        velocity: Some(2.0),
        ..CommandValues::default()
    };
    let block = CommandBlock {
        control_mode: ControlMode::POSITION,
        axis_control: AxisControl::ENABLE,
        values,
        ..CommandBlock::default()
    };
    let mut events = CommandEvents::default();
    events.acks.push(EventAck { event_id: 3, status: 0 });
    let service = ServiceRequest { transaction_id: 1, service: MotionService::GROUP_SYNC, data: &[0; 8] };
    let class = CommandInstance { service: Some(service), ..CommandInstance::default() };
    let write = WriteBlock { write_block_id: 1, read_block_id: 2, data: &[1, 2, 3, 4] };
    let axis = |number| CommandInstance {
        number,
        cyclic: Some(block),
        write: Some(write),
        events: Some(events.clone()),
        service: Some(service),
    };
    emit(&header(1, 0), &[class, axis(1), axis(2)])
}

/// Offsets of the three instance headers of [`full`].
const CLASS: usize = 8;
const AXIS_1: usize = CLASS + 5 * 4;
const AXIS_2: usize = AXIS_1 + (2 + 5 + 2 + 2 + 3) * 4;

fn refused(change: impl FnOnce(&mut Vec<u8>)) -> Error {
    let mut octets = full();
    assert!(CommandFrame::parse(&octets).is_ok());
    change(&mut octets);
    CommandFrame::parse(&octets).map(|f| f.to_string()).expect_err("a broken update")
}

fn invalid(what: &'static str, offset: usize, found: u32, expected: u32) -> Error {
    Error::invalid(what, offset, expected, found)
}

#[test]
fn wrong_fields_are_named_with_their_place() {
    assert_eq!(refused(|o| o[0] = 7), invalid("connection format", 0, 7, 6));
    assert_eq!(refused(|o| o[1] = 3), invalid("format revision", 1, 3, 2));
    assert_eq!(refused(|o| o[7] = 0x20), invalid("time data set", 7, 0x20, 0));
    assert_eq!(refused(|o| o[AXIS_1] = 2), invalid("instance number", AXIS_1, 2, 1));
    assert_eq!(refused(|o| o[AXIS_2] = 1), invalid("instance number", AXIS_2, 1, 2));
    assert_eq!(refused(|o| o[AXIS_1 + 2] = 13), invalid("instance block size", AXIS_1 + 2, 13, 14));
    assert_eq!(refused(|o| o[AXIS_1 + 3] = 6), invalid("cyclic block size", AXIS_1 + 3, 6, 7));
    let set = AXIS_1 + 8 + 4;
    assert_eq!(refused(|o| o[set] |= 0x10), invalid("command data set", set, 0x13, 0x03));
    let control = AXIS_1 + 8 + 7;
    assert_eq!(refused(|o| o[control] = 0x08), invalid("command control", control, 0x08, 0));
    assert_eq!(refused(|o| o[control] = 0x03), invalid("command control", control, 0x03, 0x02));
}

#[test]
fn sizes_that_disagree_with_the_content_are_refused() {
    // The velocity bit taken away leaves four octets too many in the block.
    let set = AXIS_1 + 8 + 4;
    let what = "cyclic command block";
    assert_eq!(refused(|o| o[set] = 1), Error::trailing(what, AXIS_1 + 8 + 16, 4));
    // One more bit asks for four octets that are not there.
    let expected = Error::truncated(what, AXIS_1 + 8 + 20, 4, 0);
    assert_eq!(refused(|o| o[set] = 7), expected);
    // An event block that announces two acknowledgements fits its padding; three do not.
    let events = AXIS_1 + 8 + 20 + 8;
    let expected = Error::truncated("event block", events + 8, 1, 0);
    assert_eq!(refused(|o| o[events + 3] = 0x30), expected);
    assert_eq!(refused(|o| o.push(0)), Error::trailing("instance data blocks", full().len(), 1));
    let len = full().len();
    assert_eq!(refused(|o| o[4] = 4), Error::truncated("instance header", len, 8, 0));
    assert!(matches!(refused(|o| o[4] = 2), Error { offset: Some(AXIS_2), expected: Expected::End, .. }));
}

#[test]
fn what_passes_the_check_is_read_to_its_end() {
    let octets = full();
    let mut passed = 0;
    for at in 8..octets.len() {
        for value in 0..=u8::MAX {
            let mut octets = octets.clone();
            octets[at] = value;
            if let Ok(frame) = CommandFrame::parse(&octets) {
                passed += 1;
                let announced = usize::from(frame.header().instance_count);
                assert_eq!(frame.instances().count(), announced, "octet {at} is {value:#04x}");
            }
        }
    }
    assert!(passed > octets.len(), "values and reserved octets may be anything");
}

#[test]
fn truncation_at_every_octet_is_refused() {
    let octets = full();
    for len in 0..octets.len() {
        assert!(CommandFrame::parse(&octets[..len]).is_err(), "cut to {len} octets");
    }
}

#[test]
fn both_readings_of_the_cyclic_block_size_and_a_bare_instance_are_taken() {
    let mut octets = full();
    octets[AXIS_1 + 3] = 5;
    assert_eq!(CommandFrame::parse(&octets).map(|f| f.instances().count()), Ok(3));
    // Instance block size 0: a header that says there is no instance data block.
    let bare = [6, 2, 1, 5, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    let frame = CommandFrame::parse(&bare).expect("a bare instance");
    assert_eq!(frame.instances().next(), Some(CommandInstance { number: 1, ..CommandInstance::default() }));
}

#[test]
fn without_data_valid_the_instances_do_not_count() {
    let mut octets = full();
    octets[3] = 1;
    let frame = CommandFrame::parse(&octets).expect("a header");
    assert_eq!(frame.instances().count(), 0);
}

#[test]
fn instance_255_ends_the_sequence() {
    let octets = [6, 2, 1, 5, 2, 0, 0, 0, 255, 0, 2, 0, 0, 0, 0, 0, 255, 0, 2, 0, 0, 0, 0, 0];
    let error = CommandFrame::parse(&octets).map(|f| f.to_string());
    assert_eq!(error, Err(invalid("instance number", 16, 255, 255)));
}

#[test]
fn a_service_over_255_words_cannot_be_written() {
    let data = vec![0; 4 * 255];
    let service = ServiceRequest { transaction_id: 1, service: MotionService(0x4C), data: &data };
    let instance = CommandInstance { service: Some(service), ..CommandInstance::default() };
    let mut buffer = [0xA5; 2048];
    let mut writer = crate::wire::Writer::new(&mut buffer);
    let expected = Error::too_large("block size in words", 255, 258);
    assert_eq!(instance.emit(&mut writer), Err(expected));
    assert_eq!(writer.written(), 0);
}
