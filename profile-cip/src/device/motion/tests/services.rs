//! Service channel, explicit services, event channel and cyclic lists of a living device.

use arrayvec::ArrayVec;

use super::*;
use crate::device::attribute::worker::AccessOperation;
use crate::device::motion_link::{ExplicitRequest, ObjectPath};
use crate::wire::motion::attribute_list::{AttributeSelector, GetItem, GetResponse, ListWriter};
use crate::wire::motion::codes::{EventType, SyncStatus};
use crate::wire::motion::id_list::IdList;
use crate::wire::motion::{CommandFrame, ReadBlock, WriteBlock};
use crate::wire::status::GeneralStatus;

fn get(ids: &[(u16, u8)]) -> Vec<u8> {
    let mut body = [0; 200];
    let mut list = ListWriter::new(&mut body).expect("room");
    for (id, size) in ids {
        list.select(&AttributeSelector::scalar(*id, *size)).expect("room");
    }
    let len = list.finish();
    body[..len].to_vec()
}

#[test]
fn engine_attributes_are_read_as_they_are() {
    let mut rig = Rig::running();
    let body = get(&[(14, 1), (15, 1), (16, 1), (18, 4), (34, 4), (1, 2), (35, 4)]);
    rig.services[0] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, body));
    let body = get(&[(650, 1), (40, 1), (651, 4), (99, 1)]);
    rig.services[1] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, body));
    rig.cycle();
    let values = |body: &[u8]| -> Vec<(u16, Vec<u8>)> {
        GetResponse::new(body)
            .expect("a body")
            .map(|item| match item.expect("an item") {
                GetItem::Value(selector, value) => (selector.id, value.to_vec()),
                GetItem::Error(id, status) => (id, vec![0xEE, status]),
            })
            .collect()
    };
    let (_, status, body) = rig.response(0).expect("an answer");
    assert_eq!(status, 0);
    assert_eq!(
        values(&body),
        [
            (14, vec![5]),
            (15, vec![5]),
            (16, vec![0]),
            (18, 2_000_000_u32.to_le_bytes().to_vec()),
            (34, 0x1234_u32.to_le_bytes().to_vec()),
            (1, vec![4, 0]),
            (35, 1_000_000_u32.to_le_bytes().to_vec()),
        ]
    );
    let (_, status, body) = rig.response(1).expect("an answer");
    assert_eq!(status, GeneralStatus::ATTRIBUTE_LIST_ERROR.0);
    let values = values(&body);
    assert_eq!(values[0], (650, vec![4]));
    assert_eq!(values[1], (40, vec![1]));
    // Bus up, power, tracking, feedback integrity, position control.
    assert_eq!(values[2], (651, 0x0042_002C_u32.to_le_bytes().to_vec()));
    assert_eq!(values[3], (99, vec![0xEE, 0x14]));
}

#[test]
fn a_drive_backed_attribute_keeps_the_answer_waiting_while_the_cycle_goes_on() {
    let mut rig = Rig::running();
    let mut body = [0; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(461, 4), &3.0_f32.to_le_bytes()).expect("room");
    list.value(&AttributeSelector::scalar(1316, 4), &7_u32.to_le_bytes()).expect("room");
    let len = list.finish();
    rig.services[2] = Some((8, MotionService::SET_AXIS_ATTRIBUTES_LIST, body[..len].to_vec()));
    rig.cycles(3);
    // 1316 may not be set in Running, so it never reaches the drive.
    let refused = vec![2, 0, 0, 0, 0xCD, 1, 0, 0, 0x24, 5, 0x0C, 0];
    assert_eq!(rig.response(2), Some((8, GeneralStatus::ATTRIBUTE_LIST_ERROR.0, refused)));
    rig.services[2] = Some((9, MotionService::GET_AXIS_ATTRIBUTES_LIST, get(&[(1316, 4)])));
    rig.cycles(3);
    assert_eq!(rig.response(2), None);
    let access = rig.device.poll_attribute_access().expect("an access");
    assert_eq!((access.instance, access.id, &access.operation), (2, 1316, &AccessOperation::Read(4)));
    assert_eq!(rig.device.poll_attribute_access(), None);
    rig.device.complete_attribute(access.ticket, Ok(&[1, 2, 3, 4]));
    rig.cycle();
    assert_eq!(rig.response(2), Some((9, 0, vec![1, 0, 0, 0, 0x24, 5, 0, 4, 1, 2, 3, 4])));
    // A transaction given up: the late answer disturbs nobody.
    rig.services[2] = Some((10, MotionService::GET_AXIS_ATTRIBUTES_LIST, get(&[(1316, 4)])));
    rig.cycle();
    let given_up = rig.device.poll_attribute_access().expect("an access");
    rig.services[2] = Some((11, MotionService::GET_AXIS_ATTRIBUTES_LIST, get(&[(1316, 4)])));
    rig.cycle();
    let access = rig.device.poll_attribute_access().expect("an access");
    rig.device.complete_attribute(given_up.ticket, Ok(&[9, 9, 9, 9]));
    rig.cycle();
    assert_eq!(rig.response(2), None);
    rig.device.complete_attribute(access.ticket, Err(GeneralStatus::DEVICE_STATE_CONFLICT));
    rig.cycle();
    assert_eq!(rig.response(2), Some((11, 0x0A, vec![1, 0, 0, 0, 0x24, 5, 0xFF, 0x10])));
}

#[test]
fn group_sync_tells_what_is_wrong() {
    let mut rig = Rig::stopped();
    let mut transaction = 0;
    let mut ask = |rig: &mut Rig, body: &[u8]| {
        transaction += 1;
        rig.services[0] = Some((transaction, MotionService::GROUP_SYNC, body.to_vec()));
        rig.cycle();
        rig.response(0).map(|(_, status, body)| (status, body.first().copied()))
    };
    assert_eq!(ask(&mut rig, &GRANDMASTER), Some((0, Some(SyncStatus::SYNCHRONIZED.0))));
    assert_eq!(ask(&mut rig, &[9; 8]), Some((0, Some(SyncStatus::DIFFERENT_GRANDMASTER.0))));
    assert_eq!(ask(&mut rig, &[9; 4]), Some((0x13, None)));
    assert_eq!(ask(&mut rig, &[9; 12]), Some((0x15, None)));
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: false, offset: 0 });
    assert_eq!(ask(&mut rig, &GRANDMASTER), Some((0, Some(SyncStatus::NOT_SYNCHRONIZED.0))));
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: 0 });
    // A time stamp three periods old is skew.
    rig.services[0] = Some((100, MotionService::GROUP_SYNC, GRANDMASTER.to_vec()));
    rig.time = TimeDataSet::TIME_STAMP;
    rig.command_packet();
    let mut header = rig.command_header();
    header.time_stamp = Some(EPOCH + rig.now - 3 * PERIOD);
    let packet = rig.packet_with(&header);
    rig.send(&packet);
    rig.run_device();
    assert_eq!(rig.response(0), Some((100, 0, vec![SyncStatus::CLOCK_SKEW.0, 0, 0, 0])));
}

#[test]
fn services_that_are_not_there_are_refused() {
    let mut rig = Rig::stopped();
    for (transaction, code) in (1..).zip(0x4F..=0x52) {
        rig.services[1] = Some((transaction, MotionService(code), vec![0; 4]));
        rig.cycle();
        assert_eq!(rig.response(1), Some((transaction, 0x08, vec![])));
    }
    rig.services[1] = Some((50, MotionService::GROUP_SYNC, GRANDMASTER.to_vec()));
    rig.services[0] = Some((50, MotionService::SET_CYCLIC_READ_LIST, vec![0; 4]));
    rig.cycle();
    assert_eq!((rig.response(0).map(|r| r.1), rig.response(1).map(|r| r.1)), (Some(0x08), Some(0x08)));
}

#[test]
fn an_answer_too_long_for_the_connection_is_an_error_and_others_wait_their_turn() {
    let mut rig = Rig::new();
    rig.t_to_o_size = 150;
    rig.open();
    rig.configure();
    let array = AttributeSelector::array(
        672,
        1,
        &[crate::wire::motion::attribute_list::Range { start: 0, count: 40 }],
    )
    .expect("one dimension");
    let list = |selectors: &[AttributeSelector]| {
        let mut body = [0; 64];
        let mut list = ListWriter::new(&mut body).expect("room");
        selectors.iter().for_each(|s| list.select(s).expect("room"));
        let len = list.finish();
        body[..len].to_vec()
    };
    rig.cycles(3);
    rig.services[1] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, list(&[array])));
    rig.services[2] = Some((1, MotionService::GET_AXIS_ATTRIBUTES_LIST, list(&[array])));
    rig.cycle();
    assert_eq!((rig.response(1).map(|r| r.1), rig.response(2)), (Some(0), None), "one at a time");
    rig.services[1] = None;
    rig.cycle();
    assert_eq!((rig.response(1), rig.response(2).map(|r| r.1)), (None, Some(0)));
    rig.services[2] = Some((2, MotionService::GET_AXIS_ATTRIBUTES_LIST, list(&[array, array, array])));
    rig.cycle();
    assert_eq!(rig.response(2), Some((2, GeneralStatus::REPLY_DATA_TOO_LARGE.0, vec![])));
    assert_eq!(rig.device.counters().left_out, 0);
}

pub(super) fn explicit(
    token: u64,
    service: u8,
    instance: u32,
    attribute: Option<u16>,
    data: &[u8],
) -> MotionRequest {
    MotionRequest::Explicit(ExplicitRequest {
        token: Token(token),
        originator: Ipv4Addr::LOCALHOST,
        service,
        path: ObjectPath { class: 0x42, instance, attribute, ..ObjectPath::default() },
        data: ArrayVec::try_from(data).expect("fits"),
    })
}

pub(super) fn reply_of(reply: Option<MotionReply>) -> (u64, u8, Vec<u8>) {
    match reply {
        Some(MotionReply::Explicit(reply)) => (reply.token.0, reply.general_status, reply.data.to_vec()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn explicit_services_work_beside_the_connection() {
    let mut rig = Rig::stopped();
    let mut ask = |token, service, instance, attribute, data: &[u8]| {
        reply_of(rig.request(explicit(token, service, instance, attribute, data)))
    };
    assert_eq!(ask(1, 0x0E, 1, Some(650), &[]), (1, 0, vec![2]));
    assert_eq!(ask(2, 0x10, 1, Some(461), &2.0_f32.to_le_bytes()), (2, 0, vec![]));
    assert_eq!(ask(3, 0x0E, 1, Some(461), &[]), (3, 0, 2.0_f32.to_le_bytes().to_vec()));
    assert_eq!(ask(4, 0x10, 1, Some(610), &[5]), (4, 0x09, vec![]));
    assert_eq!(ask(5, 0x10, 1, Some(650), &[5]), (5, 0x0E, vec![]));
    assert_eq!(
        ask(6, 0x03, 2, None, &[2, 0, 0x8A, 2, 99, 0]),
        (6, 0x0A, vec![2, 0, 0x8A, 2, 0, 0, 2, 99, 0, 0x14, 0])
    );
    assert_eq!(ask(7, 0x04, 2, None, &[1, 0, 0x62, 2, 3]), (7, 0, vec![1, 0, 0x62, 2, 0, 0]));
    assert_eq!(
        ask(8, 0x4B, 2, None, &[1, 0, 0, 0, 0x62, 2, 0, 1]),
        (8, 0, vec![1, 0, 0, 0, 0x62, 2, 0, 1, 3, 0, 0, 0])
    );
    assert_eq!(ask(9, 0x0E, 3, Some(650), &[]), (9, 0x05, vec![]));
    assert_eq!(ask(10, 0x0E, 1, None, &[]), (10, 0x04, vec![]));
    assert_eq!(ask(11, 0x4F, 1, None, &[0]), (11, 0x08, vec![]));
    assert_eq!(ask(12, 0x0E, 0, Some(1), &[]), (12, 0, vec![4, 0]));
}

#[test]
fn the_commands_of_the_connection_are_read_in_the_form_in_which_they_came() {
    let mut rig = Rig::stopped();
    let values = |rig: &mut Rig, values| {
        rig.blocks[0].values = values;
        rig.cycle();
        [360, 361, 362].map(|id| reply_of(rig.request(explicit(1, 0x0E, 1, Some(id), &[]))).2)
    };
    let float = CommandValues {
        position: Some(CommandPosition::Float(-2.5)),
        velocity: Some(7.5),
        ..CommandValues::default()
    };
    let zero = |size: usize| vec![0; size];
    let expected = [zero(4), (-2.5_f64).to_le_bytes().to_vec(), 7.5_f32.to_le_bytes().to_vec()];
    assert_eq!(values(&mut rig, float), expected);
    let integer = CommandValues { position: Some(CommandPosition::Integer(-3)), ..CommandValues::default() };
    assert_eq!(values(&mut rig, integer), [(-3_i32).to_le_bytes().to_vec(), zero(8), zero(4)]);
}

#[test]
fn explicit_requests_wait_for_the_drive_and_for_each_other() {
    let mut rig = Rig::stopped();
    assert_eq!(rig.request(explicit(1, 0x0E, 1, Some(1316), &[])), None);
    for token in 2..=9 {
        assert_eq!(rig.request(explicit(token, 0x0E, 1, Some(650), &[])), None);
    }
    let overflow = reply_of(rig.request(explicit(10, 0x0E, 1, Some(650), &[])));
    assert_eq!(overflow, (10, GeneralStatus::RESOURCE_UNAVAILABLE.0, vec![]));
    assert_eq!(rig.device.counters().explicit_overflow, 1);
    let access = rig.device.poll_attribute_access().expect("an access");
    rig.device.complete_attribute(access.ticket, Ok(&[4, 3, 2, 1]));
    assert_eq!(reply_of(rig.device.poll_reply()), (1, 0, vec![4, 3, 2, 1]));
    rig.device.poll(rig.now(), rig.system());
    for token in 2..=9 {
        assert_eq!(reply_of(rig.device.poll_reply()), (token, 0, vec![2]));
    }
    assert_eq!(rig.device.poll_reply(), None);
}

#[test]
fn events_travel_with_the_axis() {
    let mut rig = Rig::stopped();
    let home = EventChecking::HOME_POSITIVE;
    rig.events = Some(CommandEvents { checking: home, ..CommandEvents::default() });
    rig.cycle();
    assert_eq!(rig.device.armed_events(0).map(|(bits, _)| bits), Some(home));
    assert!(rig.device.notify_event(0, EventType::HOME_POSITIVE, 0, 77, 5));
    rig.cycle();
    let block = rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.events).expect("a block");
    let told = &block.notifications[0];
    assert_eq!((block.checking, told.position, told.time_stamp), (home, 77, 5));
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: 60 });
    rig.cycle();
    let block = rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.events).expect("a block");
    assert_eq!(block.notifications[0].time_stamp, 65, "in the system time of now");
    rig.events = None;
    rig.cycle();
    let block = rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.events);
    assert_eq!(block, None);
}

/// Sends the rig's next update with a cyclic write block for the first axis.
fn send_write(rig: &mut Rig, data: &[u8]) {
    let packet = rig.command_packet();
    let frame = CommandFrame::parse(&packet[2..]).expect("a good update");
    let mut buffer = [0; 500];
    let mut writer = CommandWriter::new(&mut buffer, frame.header()).expect("room");
    for mut instance in frame.instances() {
        if instance.number == 1 {
            instance.write = Some(WriteBlock { write_block_id: 1, read_block_id: 1, data });
        }
        writer.instance(&instance).expect("room");
    }
    let len = writer.finish();
    let packet = [&packet[..2], &buffer[..len]].concat();
    rig.send(&packet);
    rig.run_device();
    rig.now += PERIOD;
}

#[test]
fn cyclic_lists_are_written_and_read_in_every_update() {
    let mut rig = Rig::stopped();
    let mut body = [0; 16];
    let len = IdList::emit(&mut body, &[461]).expect("room");
    rig.services[1] = Some((1, MotionService::SET_CYCLIC_WRITE_LIST, body[..len].to_vec()));
    rig.cycle();
    assert_eq!(rig.response(1), Some((1, 0, vec![1, 0, 1, 0, 0xCD, 1, 0, 0])));
    let len = IdList::emit(&mut body, &[650, 461]).expect("room");
    rig.services[1] = Some((2, MotionService::SET_CYCLIC_READ_LIST, body[..len].to_vec()));
    rig.cycle();
    assert_eq!(rig.response(1).map(|r| r.1), Some(0));
    rig.services[1] = None;
    let data = 1.5_f32.to_le_bytes();
    send_write(&mut rig, &data);
    assert_eq!(rig.device.attribute(0, 461), Ok(&data[..]));
    let read = rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.read).expect("a block");
    let expected = ReadBlock {
        write_block_id: 1,
        write_status: 0,
        read_block_id: 1,
        read_status: 0,
        data: &[2, 0, 0, 0, 0x00, 0x00, 0xC0, 0x3F],
    };
    assert_eq!(read, expected);
    // Under a node fault nothing is written, and the answer says so.
    let mut malformed = rig.command_packet();
    malformed[2] = 9;
    rig.send(&malformed);
    send_write(&mut rig, &2.5_f32.to_le_bytes());
    assert_eq!(rig.device.attribute(0, 461), Ok(&data[..]));
    let read = rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.read).expect("a block");
    assert_eq!((read.write_block_id, read.write_status), (1, GeneralStatus::OBJECT_STATE_CONFLICT.0));
}

/// The status of the write block in the newest update of the device.
fn write_status(rig: &mut Rig) -> u8 {
    let frame = rig.frame();
    frame.instances().find(|i| i.number == 1).and_then(|i| i.read).expect("a block").write_status
}

#[test]
fn cyclic_write_data_reach_the_drive_and_its_refusal_the_controller() {
    let mut rig = Rig::stopped();
    let mut body = [0; 16];
    let len = IdList::emit(&mut body, &[1316, 461]).expect("room");
    rig.services[1] = Some((1, MotionService::SET_CYCLIC_WRITE_LIST, body[..len].to_vec()));
    rig.cycle();
    assert_eq!(rig.response(1).map(|r| r.1), Some(0));
    rig.services[1] = None;
    let data = |value: u32| [value.to_le_bytes(), 1.5_f32.to_le_bytes()].concat();
    send_write(&mut rig, &data(7));
    assert_eq!(write_status(&mut rig), 0);
    let access = rig.device.poll_attribute_access().expect("an access");
    let wanted = |value: u32| AccessOperation::Write(value.to_le_bytes().into_iter().collect());
    assert_eq!((access.instance, access.id, &access.operation), (1, 1316, &wanted(7)));
    send_write(&mut rig, &data(8));
    send_write(&mut rig, &data(9));
    assert_eq!(rig.device.poll_attribute_access(), None, "one at a time");
    rig.device.complete_attribute(access.ticket, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
    send_write(&mut rig, &data(9));
    assert_eq!(write_status(&mut rig), 0, "nobody wants 7 any more");
    let access = rig.device.poll_attribute_access().expect("the newest value");
    assert_eq!(access.operation, wanted(9));
    rig.device.complete_attribute(access.ticket, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
    for _ in 0..2 {
        send_write(&mut rig, &data(9));
        assert_eq!(write_status(&mut rig), GeneralStatus::INVALID_ATTRIBUTE_VALUE.0);
        assert_eq!(rig.device.poll_attribute_access(), None, "it has said no");
    }
    send_write(&mut rig, &data(10));
    let access = rig.device.poll_attribute_access().expect("another value");
    rig.device.complete_attribute(access.ticket, Ok(&[]));
    send_write(&mut rig, &data(10));
    assert_eq!((write_status(&mut rig), rig.device.poll_attribute_access()), (0, None));
    // The drive is gone and comes back, as it is after a restart. What comes meanwhile is refused.
    rig.drives[0].image.online = false;
    send_write(&mut rig, &data(11));
    let access = rig.device.poll_attribute_access().expect("another value");
    rig.device.complete_attribute(access.ticket, Err(GeneralStatus::DEVICE_STATE_CONFLICT));
    send_write(&mut rig, &data(10));
    let access = rig.device.poll_attribute_access().expect("the one before");
    rig.device.complete_attribute(access.ticket, Err(GeneralStatus::DEVICE_STATE_CONFLICT));
    send_write(&mut rig, &data(10));
    assert_eq!(rig.device.poll_attribute_access(), None, "it is not asked again while it is gone");
    assert_eq!(write_status(&mut rig), GeneralStatus::DEVICE_STATE_CONFLICT.0);
    rig.drives[0].image.online = true;
    send_write(&mut rig, &data(10));
    let access = rig.device.poll_attribute_access().expect("the same value again");
    assert_eq!((access.id, &access.operation), (1316, &wanted(10)));
    rig.device.complete_attribute(access.ticket, Ok(&[]));
    send_write(&mut rig, &data(10));
    assert_eq!((write_status(&mut rig), rig.device.poll_attribute_access()), (0, None));
    // A service sets the attribute to something else: the updates set it back.
    let mut body = [0; 32];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(1316, 4), &3_u32.to_le_bytes()).expect("room");
    let len = list.finish();
    rig.services[1] = Some((2, MotionService::SET_AXIS_ATTRIBUTES_LIST, body[..len].to_vec()));
    rig.cycle();
    let access = rig.device.poll_attribute_access().expect("that of the service");
    assert_eq!(access.operation, wanted(3));
    assert_eq!(rig.device.poll_attribute_access(), None);
    rig.device.complete_attribute(access.ticket, Ok(&[]));
    let access = rig.device.poll_attribute_access().expect("that of the list");
    assert_eq!(access.operation, wanted(10));
}
