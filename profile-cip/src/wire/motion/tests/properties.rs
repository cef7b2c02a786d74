//! Round trips of arbitrary updates, and parsers fed with arbitrary octets.

use proptest::prelude::*;

use super::super::actual::SafetyStatus;
use super::super::attribute_list::{GetRequest, GetResponse, SetRequest, SetResponse};
use super::super::codes::{
    ActualDataSet, AlarmType, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, CommandTarget,
    ControlMode, ControlStatus, EventChecking, EventType, FaultType, FeedbackMode, MotionService, NodeAlarm,
    NodeControl, NodeFault, NodeStatus, StatusDataSet, TimeDataSet,
};
use super::super::event::{ExtendedAck, ExtendedEventData, Window};
use super::super::fixed::{FixedActual, FixedCommand};
use super::super::id_list::{IdList, IdStatusList};
use super::super::{
    ActualBlock, ActualEvents, ActualFrame, ActualHeader, ActualInstance, ActualPosition, ActualValues,
    ActualWriter, AlarmRecord, CommandBlock, CommandEvents, CommandFrame, CommandHeader, CommandInstance,
    CommandPosition, CommandValues, EventAck, EventNotification, FaultRecord, ReadBlock, ServiceRequest,
    ServiceResponse, StatusValues, TimeDiagnostics, UpdateDiagnostics, WriteBlock,
};
use super::emit;

fn words(max: usize) -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<[u8; 4]>(), 0..max).prop_map(|w| w.concat())
}

prop_compose! {
    fn command_values()(
        position in prop::option::of(prop_oneof![
            any::<f64>().prop_map(CommandPosition::Float),
            any::<i32>().prop_map(CommandPosition::Integer),
        ]),
        velocity in any::<Option<f32>>(),
        acceleration in any::<Option<f32>>(),
        torque in any::<Option<f32>>(),
        unwind_count in any::<Option<i32>>(),
        position_displacement in any::<Option<i32>>(),
    ) -> CommandValues {
        CommandValues { position, velocity, acceleration, torque, unwind_count, position_displacement }
    }
}

prop_compose! {
    fn command_block()(octets in any::<[u8; 6]>(), target in 0u8..3, values in command_values()) -> CommandBlock {
        CommandBlock {
            control_mode: ControlMode(octets[0]),
            feedback_mode: FeedbackMode(octets[1]),
            axis_control: AxisControl(octets[2]),
            control_status: ControlStatus::from_bits_retain(octets[3]),
            actual_data_set: ActualDataSet::from_bits_retain(octets[4]),
            status_data_set: StatusDataSet::from_bits_retain(octets[5]),
            target: CommandTarget(target),
            values,
        }
    }
}

prop_compose! {
    fn extended()(
        windows in any::<[Option<(i32, i32)>; 4]>(),
        home_torque_threshold in any::<Option<f32>>(),
        home_torque_time in any::<Option<f32>>(),
        watch_positions in any::<[Option<i32>; 2]>(),
    ) -> ExtendedEventData {
        let windows = windows.map(|w| w.map(|(max, min)| Window { max, min }));
        ExtendedEventData { windows, home_torque_threshold, home_torque_time, watch_positions }
    }
}

prop_compose! {
    fn command_events()(
        checking in 0u32..0x1000_0000,
        extended in prop::option::of(extended()),
        acks in prop::collection::vec(any::<(u8, u8)>(), 0..8),
    ) -> CommandEvents {
        let acks = acks.into_iter().map(|(event_id, status)| EventAck { event_id, status }).collect();
        CommandEvents { checking: EventChecking::from_bits_retain(checking), extended, acks }
    }
}

prop_compose! {
    fn actual_events()(
        checking in 0u32..0x1000_0000,
        extended in any::<Option<(u8, u8, u8)>>(),
        notes in prop::collection::vec(any::<(u8, u8, u8, i32, u64)>(), 0..8),
    ) -> ActualEvents {
        let extended = extended.map(|(registration, home, watch)| ExtendedAck { registration, home, watch });
        let notifications = notes
            .into_iter()
            .map(|(event_id, status, kind, position, time_stamp)| EventNotification {
                event_id,
                status,
                event_type: EventType(kind),
                position,
                time_stamp,
            })
            .collect();
        ActualEvents { checking: EventChecking::from_bits_retain(checking), extended, notifications }
    }
}

prop_compose! {
    fn actual_block()(
        octets in any::<[u8; 5]>(),
        position in prop::option::of(prop_oneof![
            any::<i32>().prop_map(ActualPosition::Dint),
            any::<i64>().prop_map(ActualPosition::Lint),
        ]),
        velocity in any::<Option<f32>>(),
        acceleration in any::<Option<f32>>(),
        counts in any::<[Option<i32>; 2]>(),
        fault in any::<Option<([u8; 4], u64)>>(),
        alarm in any::<Option<([u8; 4], u64)>>(),
        axis_status in any::<Option<(u32, u32)>>(),
        io_status in any::<Option<(u32, u32)>>(),
        safety in any::<Option<(u32, u32, u8)>>(),
    ) -> ActualBlock {
        let lint = matches!(position, Some(ActualPosition::Lint(_)));
        let feedback_mode = FeedbackMode(octets[1]);
        let feedback_mode = if position.is_some() { feedback_mode.with_lint(lint) } else { feedback_mode };
        ActualBlock {
            control_mode: ControlMode(octets[0]),
            feedback_mode,
            axis_response: AxisControl(octets[2]),
            response_status: octets[3],
            axis_state: AxisStateCode(octets[4]),
            actual: ActualValues {
                position,
                velocity,
                acceleration,
                unwind_count: counts[0],
                position_displacement: counts[1],
            },
            status: StatusValues {
                fault: fault.map(|(o, time_stamp)| FaultRecord {
                    fault_type: FaultType(o[0]), code: o[1], sub_code: o[2], action: o[3], time_stamp,
                }),
                alarm: alarm.map(|(o, time_stamp)| AlarmRecord {
                    alarm_type: AlarmType(o[0]), code: o[1], sub_code: o[2], state: o[3], time_stamp,
                }),
                axis_status: axis_status.map(|(s, m)| (AxisStatus::from_bits_retain(s), m)),
                io_status: io_status.map(|(s, m)| (AxisIoStatus::from_bits_retain(s), m)),
                safety: safety.map(|(status, manufacturer, state)| SafetyStatus { status, manufacturer, state }),
            },
        }
    }
}

type OwnedCommand =
    (Option<CommandBlock>, Option<(u8, u8, Vec<u8>)>, Option<CommandEvents>, Option<(u8, u8, Vec<u8>)>);

fn command_instance() -> impl Strategy<Value = OwnedCommand> {
    (
        prop::option::of(command_block()),
        prop::option::of((any::<u8>(), any::<u8>(), words(5))),
        prop::option::of(command_events()),
        prop::option::of((any::<u8>(), any::<u8>(), words(9))),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn command_updates_round_trip(
        octets in any::<[u8; 4]>(),
        time_stamp in any::<Option<u64>>(),
        time_offset in any::<Option<i64>>(),
        first in 0u8..3,
        owned in prop::collection::vec(command_instance(), 0..4),
    ) {
        let instances: Vec<CommandInstance> = (first..).zip(&owned).map(|(number, (cyclic, write, events, service))| {
            CommandInstance {
                number,
                cyclic: *cyclic,
                write: write.as_ref().map(|(write_block_id, read_block_id, data)| WriteBlock {
                    write_block_id: *write_block_id, read_block_id: *read_block_id, data,
                }),
                events: events.clone(),
                service: service.as_ref().map(|(transaction_id, code, data)| ServiceRequest {
                    transaction_id: *transaction_id, service: MotionService(*code), data,
                }),
            }
        }).collect();
        let header = CommandHeader {
            update_id: octets[0],
            node_control: NodeControl::from_bits_retain(octets[1]) | NodeControl::DATA_VALID,
            instance_count: u8::try_from(instances.len()).unwrap(),
            last_received_id: octets[2],
            time_stamp,
            time_offset,
            diagnostics: TimeDataSet::from_bits_retain(octets[3]) & (TimeDataSet::UPDATE_DIAGNOSTICS | TimeDataSet::TIME_DIAGNOSTICS),
        };
        let update = emit(&header, &instances);
        let frame = CommandFrame::parse(&update).expect("what was emitted");
        prop_assert_eq!(*frame.header(), header);
        prop_assert_eq!(frame.instances().collect::<Vec<_>>(), instances);
    }

    #[test]
    fn actual_updates_round_trip(
        octets in any::<[u8; 3]>(),
        fault in 0u8..16,
        alarm in 0u8..16,
        times in any::<(Option<u64>, Option<i64>, Option<(u8, u8)>, Option<(u64, u64)>)>(),
        block in prop::option::of(actual_block()),
        read in prop::option::of((any::<[u8; 4]>(), words(5))),
        events in prop::option::of(actual_events()),
        service in prop::option::of((any::<[u8; 4]>(), words(9))),
    ) {
        let instance = ActualInstance {
            number: 1,
            cyclic: block,
            read: read.as_ref().map(|(o, data)| ReadBlock {
                write_block_id: o[0], write_status: o[1], read_block_id: o[2], read_status: o[3], data,
            }),
            events,
            service: service.as_ref().map(|(o, data)| ServiceResponse {
                transaction_id: o[0], service: MotionService(o[1]), general_status: o[2], extended_status: o[3], data,
            }),
        };
        let header = ActualHeader {
            update_id: octets[0],
            node_status: NodeStatus::from_bits_retain(octets[1]) | NodeStatus::DATA_VALID,
            instance_count: 1,
            node_fault: NodeFault(fault),
            node_alarm: NodeAlarm(alarm),
            last_received_id: octets[2],
            time_stamp: times.0,
            time_offset: times.1,
            update_diagnostics: times.2.map(|(lost_updates, late_updates)| UpdateDiagnostics { lost_updates, late_updates }),
            time_diagnostics: times.3.map(|(received_at, transmitted_at)| TimeDiagnostics { received_at, transmitted_at }),
        };
        let mut buffer = vec![0xA5; 1024];
        let mut writer = ActualWriter::new(&mut buffer, &header).expect("room");
        writer.instance(&instance).expect("room");
        let len = writer.finish();
        let frame = ActualFrame::parse(&buffer[..len]).expect("what was emitted");
        prop_assert_eq!(*frame.header(), header);
        prop_assert_eq!(frame.instances().collect::<Vec<_>>(), vec![instance]);
        for cut in 0..len {
            prop_assert!(ActualFrame::parse(&buffer[..cut]).is_err());
        }
    }

    #[test]
    fn arbitrary_octets_never_panic(octets in prop::collection::vec(any::<u8>(), 0..200), valid in any::<bool>()) {
        let mut octets = octets;
        if valid && octets.len() > 8 {
            let head = [6, 2, octets[2], 5, octets[4] % 3, 0, 0, octets[7] & 3];
            octets[..8].copy_from_slice(&head);
        }
        // Printing walks every instance and every body.
        if let Ok(frame) = CommandFrame::parse(&octets) {
            let _ = frame.to_string();
        }
        if let Some(format) = octets.first_mut() {
            *format = 7;
        }
        if let Ok(frame) = ActualFrame::parse(&octets) {
            let _ = frame.to_string();
        }
        let _ = (FixedCommand::parse(&octets), FixedActual::parse(&octets));
        let _ = (IdList::parse(&octets), IdStatusList::parse(&octets));
        // The announced count never makes a list longer than the octets can hold.
        let bound = octets.len() / 4 + 1;
        prop_assert!(GetRequest::new(&octets).map_or(0, Iterator::count) <= bound);
        prop_assert!(GetResponse::new(&octets).map_or(0, Iterator::count) <= bound);
        prop_assert!(SetRequest::new(&octets).map_or(0, Iterator::count) <= bound);
        prop_assert!(SetResponse::new(&octets).map_or(0, Iterator::count) <= bound);
    }
}
