//! The printed tree of a full update of either direction.

use super::super::actual::SafetyStatus;
use super::super::attribute_list::{AttributeSelector, ListWriter, Range};
use super::super::codes::{
    ActualDataSet, AlarmType, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, CommandTarget,
    ControlMode, ControlStatus, EventChecking, EventType, FaultType, FeedbackMode, MotionService, NodeAlarm,
    NodeFault, NodeStatus, StatusDataSet, TimeDataSet,
};
use super::super::event::{ExtendedAck, ExtendedEventData, Window};
use super::super::{
    ActualBlock, ActualEvents, ActualFrame, ActualHeader, ActualInstance, ActualPosition, ActualValues,
    ActualWriter, AlarmRecord, CommandBlock, CommandEvents, CommandFrame, CommandHeader, CommandInstance,
    CommandPosition, CommandValues, EventAck, EventNotification, FaultRecord, ReadBlock, ServiceRequest,
    ServiceResponse, StatusValues, TimeDiagnostics, UpdateDiagnostics, WriteBlock,
};
use super::{emit, header};

#[test]
fn command_tree() {
    let header = CommandHeader {
        time_stamp: Some(1_700_000_000_000_000_000),
        time_offset: Some(-5),
        diagnostics: TimeDataSet::UPDATE_DIAGNOSTICS,
        ..header(17, 16)
    };
    let clock = [1, 2, 3, 4, 5, 6, 7, 8];
    let class = CommandInstance {
        service: Some(ServiceRequest { transaction_id: 3, service: MotionService::GROUP_SYNC, data: &clock }),
        ..CommandInstance::default()
    };
    let mut events = CommandEvents {
        checking: EventChecking::REG_1_POSITIVE | EventChecking::HOME_POSITIVE,
        extended: Some(ExtendedEventData {
            windows: [Some(Window { max: 100, min: -100 }), None, None, None],
            home_torque_time: Some(0.5),
            watch_positions: [None, Some(7)],
            ..ExtendedEventData::default()
        }),
        ..CommandEvents::default()
    };
    events.acks.push(EventAck { event_id: 4, status: 0 });
    let mut body = [0; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(461, 4), &12.5_f32.to_le_bytes()).expect("room");
    let array = AttributeSelector::array(672, 1, &[Range { start: 54, count: 2 }]).expect("one dimension");
    list.value(&array, &[3, 1]).expect("room");
    let len = list.finish();
    let axis = CommandInstance {
        number: 1,
        cyclic: Some(CommandBlock {
            control_mode: ControlMode::POSITION,
            feedback_mode: FeedbackMode(2),
            axis_control: AxisControl::ENABLE,
            control_status: ControlStatus::CONFIGURATION_COMPLETE | ControlStatus::CONVERTER_BUS_UP,
            actual_data_set: ActualDataSet::POSITION | ActualDataSet::VELOCITY,
            status_data_set: StatusDataSet::FAULT | StatusDataSet::AXIS_STATUS,
            target: CommandTarget::INTERPOLATE,
            values: CommandValues {
                position: Some(CommandPosition::Float(1234.25)),
                velocity: Some(-3.5),
                unwind_count: Some(1),
                ..CommandValues::default()
            },
        }),
        write: Some(WriteBlock { write_block_id: 1, read_block_id: 2, data: &[1, 2, 3, 4] }),
        events: Some(events),
        service: Some(ServiceRequest {
            transaction_id: 9,
            service: MotionService::SET_AXIS_ATTRIBUTES_LIST,
            data: &body[..len],
        }),
    };
    let update = emit(&header, &[class, axis]);
    insta::assert_snapshot!(CommandFrame::parse(&update).expect("what was emitted").to_string());
}

#[test]
fn actual_tree() {
    let header = ActualHeader {
        update_id: 17,
        node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID | NodeStatus::FAULT,
        instance_count: 0,
        node_fault: NodeFault::DATA_FORMAT,
        node_alarm: NodeAlarm::CONNECTION_UPDATE,
        last_received_id: 17,
        time_stamp: Some(1_700_000_000_000_001_000),
        time_offset: None,
        update_diagnostics: Some(UpdateDiagnostics { lost_updates: 2, late_updates: 1 }),
        time_diagnostics: Some(TimeDiagnostics { received_at: 10, transmitted_at: 20 }),
    };
    let mut events = ActualEvents {
        checking: EventChecking::REG_1_POSITIVE,
        extended: Some(ExtendedAck { registration: 1, home: 2, watch: 2 }),
        ..ActualEvents::default()
    };
    events.notifications.push(EventNotification {
        event_id: 5,
        status: 0,
        event_type: EventType::REGISTRATION_1_POSITIVE,
        position: -77,
        time_stamp: 123,
    });
    let instance = ActualInstance {
        number: 1,
        cyclic: Some(ActualBlock {
            control_mode: ControlMode::POSITION,
            feedback_mode: FeedbackMode(2),
            axis_response: AxisControl::FAULT_RESET,
            response_status: 0x0C,
            axis_state: AxisStateCode::MAJOR_FAULTED,
            actual: ActualValues {
                position: Some(ActualPosition::Lint(5_000_000_000)),
                velocity: Some(0.25),
                ..ActualValues::default()
            },
            status: StatusValues {
                fault: Some(FaultRecord {
                    fault_type: FaultType::AXIS,
                    code: 54,
                    sub_code: 1,
                    action: 0x24,
                    time_stamp: 99,
                }),
                alarm: Some(AlarmRecord {
                    alarm_type: AlarmType::START_INHIBIT,
                    code: 5,
                    sub_code: 0,
                    state: 1,
                    time_stamp: 98,
                }),
                axis_status: Some((AxisStatus::DC_BUS_UP | AxisStatus::from_bits_retain(1 << 30), 0)),
                io_status: Some((AxisIoStatus::HOME_INPUT, 1)),
                safety: Some(SafetyStatus { status: 8, manufacturer: 0, state: 4 }),
            },
        }),
        read: Some(ReadBlock {
            write_block_id: 1,
            write_status: 0,
            read_block_id: 2,
            read_status: 0x14,
            data: &[],
        }),
        events: Some(events),
        service: Some(ServiceResponse {
            transaction_id: 9,
            service: MotionService::SET_AXIS_ATTRIBUTES_LIST,
            general_status: 0x0A,
            extended_status: 0,
            data: &[1, 0, 0, 0, 0xCD, 1, 9, 0],
        }),
    };
    let mut buffer = [0xA5; 512];
    let mut writer = ActualWriter::new(&mut buffer, &header).expect("room");
    writer.instance(&instance).expect("room");
    let len = writer.finish();
    insta::assert_snapshot!(ActualFrame::parse(&buffer[..len]).expect("what was emitted").to_string());
}
