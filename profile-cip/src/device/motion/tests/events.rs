//! Events of an axis through the whole device.

use super::{EPOCH, PERIOD, Rig};
use crate::device::axis::event_channel::EventCounters;
use crate::wire::motion::codes::{AxisControl, EventChecking, EventType};
use crate::wire::motion::event::{ActualEvents, ExtendedEventData};
use crate::wire::motion::{CommandEvents, EventAck, EventNotification};

fn block(rig: &Rig) -> ActualEvents {
    rig.frame().instances().find(|i| i.number == 1).and_then(|i| i.events).expect("a block")
}

fn arm(rig: &mut Rig, checking: EventChecking, data: Option<ExtendedEventData>) {
    rig.drives[0].image.events = EventChecking::EVENTS | EventChecking::WINDOWS;
    rig.events = Some(CommandEvents { checking, extended: data, ..CommandEvents::default() });
    rig.cycle();
}

/// A cycle in which the drive is at `position` with `torque`.
fn at(rig: &mut Rig, position: i64, torque: f32) {
    let image = &mut rig.drives[0].image;
    (image.position, image.torque) = (position, Some(torque));
    image.captured_at = EPOCH + rig.now;
    rig.cycle();
}

fn told(events: &ActualEvents) -> Vec<(EventType, i32, u64)> {
    events.notifications.iter().map(|n| (n.event_type, n.position, n.time_stamp)).collect()
}

#[test]
fn watch_positions_tell_where_and_when_between_two_samples() {
    let mut rig = Rig::stopped();
    at(&mut rig, 0, 0.0);
    let data = ExtendedEventData { watch_positions: [Some(100), Some(-1)], ..ExtendedEventData::default() };
    let bits =
        EventChecking::WATCH_1_FORWARD | EventChecking::WATCH_1_REVERSE | EventChecking::WATCH_2_FORWARD;
    arm(&mut rig, bits, Some(data));
    at(&mut rig, 50, 0.0);
    assert_eq!((block(&rig).checking, told(&block(&rig))), (bits, vec![]));
    let before = EPOCH + rig.now - PERIOD;
    at(&mut rig, 150, 0.0);
    let crossed = before + PERIOD / 2;
    assert_eq!(told(&block(&rig)), [(EventType::WATCH_1_FORWARD, 100, crossed)]);
    at(&mut rig, 90, 0.0);
    at(&mut rig, 160, 0.0);
    let kinds: Vec<_> = told(&block(&rig)).iter().map(|(event, ..)| *event).collect();
    assert_eq!(kinds, [EventType::WATCH_1_FORWARD, EventType::WATCH_1_REVERSE], "each once");
    // The same sample again, or one of before, shows no crossing.
    rig.drives[0].image.position = -10;
    rig.cycle();
    rig.drives[0].image.position = 10;
    rig.cycle();
    assert_eq!(told(&block(&rig)).len(), 2);
    assert_eq!(rig.device.event_counters(0).map(|c| c.notified), Some(2));
}

#[test]
fn home_torque_has_to_last() {
    let mut rig = Rig::stopped();
    at(&mut rig, 5, 99.0);
    let seconds = 1.9 * 2e-3;
    let data = ExtendedEventData {
        home_torque_threshold: Some(40.0),
        home_torque_time: Some(seconds),
        ..ExtendedEventData::default()
    };
    arm(&mut rig, EventChecking::HOME_TORQUE, Some(data));
    for torque in [41.0, -41.0, 40.0, -50.0, 60.0] {
        at(&mut rig, 5, torque);
        assert_eq!(told(&block(&rig)), [], "{torque}");
    }
    let now = EPOCH + rig.now;
    at(&mut rig, 6, -41.0);
    assert_eq!(told(&block(&rig)), [(EventType::HOME_TORQUE, 6, now)]);
}

#[test]
fn a_drive_that_tells_no_torque_or_no_time_checks_for_neither() {
    let mut rig = Rig::stopped();
    let data = ExtendedEventData {
        home_torque_threshold: Some(40.0),
        watch_positions: [Some(1), None],
        ..ExtendedEventData::default()
    };
    let bits = EventChecking::HOME_TORQUE | EventChecking::WATCH_1_FORWARD;
    arm(&mut rig, bits, Some(data));
    assert_eq!(block(&rig).checking, EventChecking::empty());
    rig.drives[0].image.captured_at = 1;
    rig.cycle();
    assert_eq!(block(&rig).checking, EventChecking::WATCH_1_FORWARD);
    rig.drives[0].image.online = false;
    rig.cycle();
    assert_eq!(block(&rig).checking, EventChecking::empty(), "a drive that is gone checks for nothing");
}

#[test]
fn positions_are_in_the_reference_system_of_the_controller_and_roll_over() {
    let mut rig = Rig::stopped();
    let rearm = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_REARM;
    rig.drives[0].image.events_checking = EventChecking::EVENTS;
    arm(&mut rig, rearm, None);
    rig.blocks[0].axis_control = AxisControl::CHANGE_ACTUAL_POSITION;
    rig.blocks[0].values.position_displacement = Some(1_000);
    rig.cycle();
    assert!(rig.device.notify_event(0, EventType::REGISTRATION_1_POSITIVE, 0, -1, 5));
    let far = (1 << 40) + i64::from(i32::MAX);
    assert!(rig.device.notify_event(0, EventType::REGISTRATION_1_POSITIVE, 0, far, 6));
    rig.cycle();
    let expected = [
        (EventType::REGISTRATION_1_POSITIVE, 999, 5),
        (EventType::REGISTRATION_1_POSITIVE, i32::MIN + 999, 6),
    ];
    assert_eq!(told(&block(&rig)), expected);
}

#[test]
fn notifications_wait_for_room_and_push_out_no_axis() {
    let mut rig = Rig::new();
    // Two axes of 40 octets with their headers, the header of the update, the block, and three notifications.
    rig.t_to_o_size = 2 + 8 + 2 * 40 + 4 + 3 * 16 + 15;
    rig.open();
    rig.configure();
    rig.cycles(3);
    let rearm = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_REARM;
    rig.drives[0].image.events_checking = EventChecking::EVENTS;
    arm(&mut rig, rearm, None);
    for place in 0..9 {
        assert!(rig.device.notify_event(0, EventType::REGISTRATION_1_POSITIVE, 0, place, 1));
    }
    let mut all: Vec<EventNotification> = Vec::new();
    for _ in 0..6 {
        rig.cycle();
        assert_eq!(rig.frame().instances().count(), 2, "the second axis is there");
        let told = block(&rig).notifications;
        all.extend(told.iter().filter(|n| !all.contains(n)).copied().collect::<Vec<_>>());
        let acks = told.iter().map(|n| EventAck { event_id: n.event_id, status: 0 }).collect();
        rig.events = Some(CommandEvents { checking: rearm, extended: None, acks });
    }
    assert_eq!(all.iter().map(|n| n.position).collect::<Vec<_>>(), (0..9).collect::<Vec<_>>());
    assert_eq!(rig.device.counters().left_out, 0);
    let counters = EventCounters { notified: 9, ..EventCounters::default() };
    assert_eq!(rig.device.event_counters(0), Some(counters));
}
