//! The worked examples of clauses 7-1.1 to 7-1.3, 6-2.7.3 and 5-2.5.1 in both directions.
//!
//! Two examples contradict the figures they use and are left out as octets: the responses to
//! Set_Axis_Attributes_List print 5 and 43 words where Figure 5-2.22 gives 4 and 42. The sizes of the figures are
//! asserted here.

use super::super::attribute_list::{
    AttributeSelector, GetItem, GetRequest, GetResponse, ListWriter, Range, SetRequest, SetResponse,
    SetStatus,
};
use super::super::codes::{
    ActualDataSet, AxisControl, AxisStateCode, ControlMode, FeedbackMode, FeedbackSource, MotionService,
    NodeAlarm, NodeControl, NodeFault, NodeStatus, StatusDataSet,
};
use super::super::fixed::{FixedActual, FixedCommand};
use super::super::id_list::{IdList, IdStatus, IdStatusList, parse_group_sync};
use super::super::{
    ActualFrame, ActualHeader, ActualInstance, ActualValues, ActualWriter, CommandFrame, CommandHeader,
    CommandInstance, CommandValues, ServiceRequest, ServiceResponse,
};
use super::{emit, header};
use crate::wire::Writer;

fn service<'a>(transaction_id: u8, service: MotionService, data: &'a [u8]) -> Option<ServiceRequest<'a>> {
    Some(ServiceRequest { transaction_id, service, data })
}

#[test]
fn initial_update_of_the_controller() {
    // Clause 7-1.1, first table.
    let octets = [6, 2, 0, 1, 0, 0, 0, 0];
    let first = CommandHeader { node_control: NodeControl::REMOTE_CONTROL, ..header(0, 0) };
    assert_eq!(emit(&first, &[]), octets);
    let frame = CommandFrame::parse(&octets).expect("the standard's example");
    assert_eq!(*frame.header(), first);
    assert_eq!(frame.instances().count(), 0);
}

#[test]
fn initial_update_of_the_device() {
    // Clause 7-1.1, second table; the text's Node Status 1 is taken, the figure prints 0.
    let octets = [7, 2, 0, 1, 0, 0, 0, 0];
    let first = ActualHeader {
        update_id: 0,
        node_status: NodeStatus::REMOTE_MODE,
        instance_count: 0,
        node_fault: NodeFault::NONE,
        node_alarm: NodeAlarm::NONE,
        last_received_id: 0,
        time_stamp: None,
        time_offset: None,
        update_diagnostics: None,
        time_diagnostics: None,
    };
    let mut buffer = [0xA5; 8];
    assert_eq!(ActualWriter::new(&mut buffer, &first).map(ActualWriter::finish), Ok(8));
    assert_eq!(buffer, octets);
    assert_eq!(ActualFrame::parse(&octets).map(|f| *f.header()), Ok(first));
}

#[test]
fn first_class_configuration_has_6_words_of_service_and_8_of_instance() {
    // Clause 7-1.2: transaction 1, service 76, two attributes; the values are 4-octet class attributes.
    let mut body = [0xA5; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    for (id, value) in [(18, 2_000_000_u32), (35, 1_000_000)] {
        list.value(&AttributeSelector::scalar(id, 4), &value.to_le_bytes()).expect("room");
    }
    let len = list.finish();
    let data = &body[..len];
    let instance = CommandInstance {
        service: service(1, MotionService::SET_AXIS_ATTRIBUTES_LIST, data),
        ..CommandInstance::default()
    };
    let octets = emit(&header(1, 0), std::slice::from_ref(&instance));
    #[rustfmt::skip]
    let expected = [
        6, 2, 1, 5, 1, 0, 0, 0, // header
        0, 0, 8, 0, 0, 0, 0, 6, // instance header: 8 words, 6 of them service
        1, 76, 0, 0, // service block
        2, 0, 0, 0, // two attributes
        18, 0, 0, 4, 0x80, 0x84, 0x1E, 0x00,
        35, 0, 0, 4, 0x40, 0x42, 0x0F, 0x00,
    ];
    assert_eq!(octets, expected);
    let frame = CommandFrame::parse(&octets).expect("what was emitted");
    assert_eq!(frame.instances().collect::<Vec<_>>(), [instance]);
    let values: Vec<_> =
        SetRequest::new(data).expect("a body").collect::<Result<_, _>>().expect("two values");
    assert_eq!(values[0], (AttributeSelector::scalar(18, 4), &2_000_000_u32.to_le_bytes()[..]));
    assert_eq!(values[1].0.id, 35);
}

#[test]
fn first_class_configuration_response_has_one_word_less_than_printed() {
    // Clause 7-1.2 prints 5 words for two attributes, Figure 5-2.22 gives 4.
    let mut body = [0xA5; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    let statuses = [SetStatus { id: 18, status: 0, index: 0 }, SetStatus { id: 35, status: 9, index: 0 }];
    for status in statuses {
        list.status(status).expect("room");
    }
    let len = list.finish();
    let parsed: Result<Vec<_>, _> = SetResponse::new(&body[..len]).expect("a body").collect();
    assert_eq!(parsed, Ok(statuses.to_vec()));
    let instance = ActualInstance {
        service: Some(ServiceResponse {
            transaction_id: 1,
            service: MotionService::SET_AXIS_ATTRIBUTES_LIST,
            general_status: 0x0A,
            extended_status: 0,
            data: &body[..len],
        }),
        ..ActualInstance::default()
    };
    let mut buffer = [0xA5; 64];
    let mut writer = Writer::new(&mut buffer);
    instance.emit(&mut writer).expect("room");
    let written = writer.written();
    #[rustfmt::skip]
    assert_eq!(buffer[..written], [
        0, 0, 6, 0, 0, 0, 0, 4,
        1, 76, 0x0A, 0,
        2, 0, 0, 0,
        18, 0, 0, 0,
        35, 0, 9, 0,
    ]);
}

#[test]
fn first_axis_configuration_has_82_words_of_service_and_84_of_instance() {
    // Clause 7-1.2: 40 attributes; the response of Figure 5-2.22 has 42 words, not the printed 43.
    let mut body = [0xA5; 512];
    let mut list = ListWriter::new(&mut body).expect("room");
    for id in 0..40 {
        list.value(&AttributeSelector::scalar(1000 + id, 4), &[1, 2, 3, 4]).expect("room");
    }
    let len = list.finish();
    let instance = CommandInstance {
        number: 1,
        service: service(1, MotionService::SET_AXIS_ATTRIBUTES_LIST, &body[..len]),
        ..CommandInstance::default()
    };
    let octets = emit(&header(4, 3), &[instance]);
    assert_eq!(octets[8..16], [1, 0, 84, 0, 0, 0, 0, 82]);
    assert_eq!(octets.len(), 8 + 4 * 84);

    let mut body = [0xA5; 512];
    let mut list = ListWriter::new(&mut body).expect("room");
    for id in 0..40 {
        list.status(SetStatus { id, status: 0, index: 0 }).expect("room");
    }
    assert_eq!(4 + list.finish(), 4 * 42);
}

#[test]
fn group_sync_request_has_3_words_of_service_and_5_of_instance() {
    // Clause 7-1.3, update 12, transaction 3, service 28.
    let clock = [0x00, 0x1D, 0x9C, 0xFF, 0xFE, 0xC0, 0xFF, 0xEE];
    let instance = CommandInstance {
        service: service(3, MotionService::GROUP_SYNC, &clock),
        ..CommandInstance::default()
    };
    let octets = emit(&header(12, 11), &[instance]);
    #[rustfmt::skip]
    assert_eq!(octets, [
        6, 2, 12, 5, 1, 0, 11, 0,
        0, 0, 5, 0, 0, 0, 0, 3,
        3, 28, 0, 0,
        0x00, 0x1D, 0x9C, 0xFF, 0xFE, 0xC0, 0xFF, 0xEE,
    ]);
    let frame = CommandFrame::parse(&octets).expect("what was emitted");
    let request = frame.instances().next().and_then(|i| i.service).expect("a service");
    assert_eq!(parse_group_sync(request.data), Ok(clock));
}

#[test]
fn get_list_bodies_of_figures_5_2_12_to_5_2_16() {
    let array = AttributeSelector::array(43, 2, &[Range { start: 0, count: 3 }]).expect("one dimension");
    let matrix =
        AttributeSelector::array(27, 4, &[Range { start: 0, count: 2 }, Range { start: 2, count: 3 }])
            .expect("two dimensions");
    assert_eq!(matrix.value_len(), Some(24));
    // Figure 5-2.16: attribute 25 = 43.5, attribute 29 not supported, three elements of attribute 43.
    let mut body = [0xA5; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(25, 4), &43.5_f32.to_le_bytes()).expect("room");
    list.error(29, 0x14).expect("room");
    list.value(&array, &[55, 0, 45, 0, 35, 0]).expect("room");
    let len = list.finish();
    #[rustfmt::skip]
    let expected = [
        3, 0, 0, 0,
        25, 0, 0, 4, 0x00, 0x00, 0x2E, 0x42,
        29, 0, 0xFF, 0x14,
        43, 0, 1, 2, 0, 0, 3, 0, 55, 0, 45, 0, 35, 0, 0, 0,
    ];
    assert_eq!(body[..len], expected);
    let items: Vec<_> =
        GetResponse::new(&expected).expect("a body").collect::<Result<_, _>>().expect("3 items");
    assert_eq!(items[0], GetItem::Value(AttributeSelector::scalar(25, 4), &43.5_f32.to_le_bytes()));
    assert_eq!(items[1], GetItem::Error(29, 0x14));
    assert_eq!(items[2], GetItem::Value(array, &[55, 0, 45, 0, 35, 0]));

    // Figure 5-2.10: a request names the same parts without values.
    let mut body = [0xA5; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    for selector in [array, matrix, AttributeSelector::scalar(20, 2)] {
        list.select(&selector).expect("room");
    }
    let len = list.finish();
    #[rustfmt::skip]
    assert_eq!(body[..len], [
        3, 0, 0, 0,
        43, 0, 1, 2, 0, 0, 3, 0,
        27, 0, 2, 4, 0, 0, 2, 0, 2, 0, 3, 0,
        20, 0, 0, 2,
    ]);
    let selectors: Result<Vec<_>, _> = GetRequest::new(&body[..len]).expect("a body").collect();
    assert_eq!(selectors, Ok(vec![array, matrix, AttributeSelector::scalar(20, 2)]));
}

#[test]
fn cyclic_list_bodies_of_figures_5_2_23_and_5_2_24() {
    let mut body = [0xA5; 32];
    let len = IdList::emit(&mut body, &[440, 441, 461]).expect("room");
    assert_eq!(body[..len], [3, 0, 0, 0, 0xB8, 1, 0xB9, 1, 0xCD, 1, 0, 0]);
    let list = IdList::parse(&body[..len]).expect("a body");
    assert_eq!(list.iter().collect::<Vec<_>>(), [440, 441, 461]);
    let statuses = [IdStatus { id: 440, status: 0 }, IdStatus { id: 441, status: 0x14 }];
    let len = IdStatusList::emit(&mut body, 7, &statuses).expect("room");
    assert_eq!(body[..len], [2, 0, 7, 0, 0xB8, 1, 0, 0, 0xB9, 1, 0x14, 0]);
    let parsed = IdStatusList::parse(&body[..len]).expect("a body");
    assert_eq!((parsed.block_id, parsed.iter().collect::<Vec<_>>()), (7, statuses.to_vec()));
}

#[test]
fn fixed_format_of_the_variable_speed_drive() {
    // Tables 6-2.49 and 6-2.50 with a command velocity of 2.5 and an actual velocity of 2.25.
    let command = FixedCommand {
        update_id: 9,
        node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
        control_mode: ControlMode::VELOCITY,
        feedback_mode: FeedbackMode(FeedbackSource::NONE.0),
        axis_control: AxisControl::ENABLE,
        actual_data_set: ActualDataSet::VELOCITY,
        status_data_set: StatusDataSet::empty(),
        values: CommandValues { velocity: Some(2.5), ..CommandValues::default() },
    };
    let octets = [2, 2, 9, 5, 2, 0, 1, 0, 2, 2, 0, 0, 0x00, 0x00, 0x20, 0x40];
    let mut buffer = [0xA5; 16];
    assert_eq!(command.emit(&mut Writer::new(&mut buffer)), Ok(()));
    assert_eq!(buffer, octets);
    assert_eq!(FixedCommand::parse(&octets), Ok(command));

    let actual = FixedActual {
        update_id: 9,
        node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID,
        control_mode: ControlMode::VELOCITY,
        feedback_mode: FeedbackMode(0),
        axis_response: AxisControl::ENABLE,
        response_status: 0,
        axis_state: AxisStateCode::RUNNING,
        actual: ActualValues { velocity: Some(2.25), ..ActualValues::default() },
    };
    let octets = [3, 2, 9, 5, 2, 0, 1, 0, 0, 2, 0, 4, 0x00, 0x00, 0x10, 0x40];
    let mut buffer = [0xA5; 16];
    assert_eq!(actual.emit(&mut Writer::new(&mut buffer)), Ok(()));
    assert_eq!(buffer, octets);
    assert_eq!(FixedActual::parse(&octets), Ok(actual));
}
