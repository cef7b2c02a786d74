use super::*;
use crate::wire::motion::EventAck;
use crate::wire::motion::event::Window;
use std::fmt::Write as _;

const ALL: EventChecking = EventChecking::EVENTS.union(EventChecking::WINDOWS);

fn block(checking: EventChecking, acks: &[(u8, u8)]) -> CommandEvents {
    let acks =
        acks.iter().map(|(event_id, status)| EventAck { event_id: *event_id, status: *status }).collect();
    CommandEvents { checking, extended: None, acks }
}

fn extended(checking: EventChecking, data: ExtendedEventData) -> CommandEvents {
    CommandEvents { checking, extended: Some(data), acks: ArrayVec::new() }
}

/// Every window from -10 to 10, and everything else that extended checking needs.
fn parameters() -> ExtendedEventData {
    ExtendedEventData {
        windows: [Some(Window { max: 10, min: -10 }); 4],
        home_torque_threshold: Some(50.0),
        home_torque_time: None,
        watch_positions: [Some(5), Some(6)],
    }
}

fn channel(supported: EventChecking) -> EventChannel {
    let mut channel = EventChannel::default();
    channel.support(supported);
    channel
}

/// Takes a block, and the drive looks for what it can.
fn handle(channel: &mut EventChannel, block: &CommandEvents) {
    channel.handle(Some(block));
    channel.confirm(ALL);
}

fn ids(channel: &EventChannel) -> Vec<u8> {
    channel.block().expect("open").notifications.iter().map(|n| n.event_id).collect()
}

#[test]
fn basic_cycle_of_table_6_2_29() {
    let home = EventChecking::HOME_POSITIVE;
    let mut channel = channel(home | EventChecking::MARKER_POSITIVE);
    assert_eq!(channel.block(), None);
    assert!(!channel.notify(EventType::HOME_POSITIVE, 0, 1, 1), "not armed");
    channel.handle(Some(&block(home | EventChecking::HOME_NEGATIVE, &[])));
    assert_eq!((channel.status(), channel.armed()), (EventChecking::empty(), home), "nobody looks yet");
    channel.confirm(home | EventChecking::HOME_NEGATIVE);
    assert_eq!(channel.status(), home, "the negative edge is not supported");
    channel.confirm(EventChecking::empty());
    assert_eq!(channel.status(), home, "a drive that arms its latch again is still checking");
    assert!(channel.notify(EventType::HOME_POSITIVE, 0, -5, 99));
    assert!(!channel.notify(EventType::HOME_POSITIVE, 0, -6, 100), "no rearm: one event");
    assert_eq!((channel.armed(), channel.status()), (EventChecking::empty(), home));
    let note = channel.block().expect("open").notifications[0];
    assert_eq!((note.event_id, note.position, note.time_stamp), (1, -5, 99));
    handle(&mut channel, &block(home, &[(1, 3)]));
    assert_eq!(ids(&channel), [1], "a bad acknowledge asks for it again");
    handle(&mut channel, &block(home, &[(9, 0)]));
    assert_eq!(ids(&channel), [1], "an acknowledge of nothing known changes nothing");
    handle(&mut channel, &block(EventChecking::empty(), &[(1, 0)]));
    assert_eq!((channel.status(), ids(&channel)), (EventChecking::empty(), vec![]));
    handle(&mut channel, &block(home, &[]));
    assert!(channel.notify(EventType::HOME_POSITIVE, 7, -5, 99), "armed again");
    let note = channel.block().expect("open").notifications[0];
    assert_eq!((note.event_id, note.status, note.position, note.time_stamp), (2, 7, 0, 0));
    channel.handle(None);
    assert_eq!(channel.block(), None);
}

#[test]
fn auto_rearm_keeps_checking() {
    // Table 6-2.31.
    let bits = EventChecking::REG_2_NEGATIVE | EventChecking::REG_2_NEGATIVE_REARM;
    let mut channel = channel(EventChecking::REG_2_NEGATIVE);
    handle(&mut channel, &block(bits, &[]));
    assert_eq!(channel.status(), bits);
    for place in 0..40 {
        let taken = channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, place, 0);
        assert_eq!(taken, place < 32, "{place}");
    }
    assert_eq!(channel.counters(), EventCounters { notified: 32, lost: 8, outside_window: 0 });
    assert_eq!(ids(&channel), [1, 2, 3, 4, 5, 6, 7], "the block holds seven");
    handle(&mut channel, &block(bits, &[(1, 0), (3, 0)]));
    assert_eq!(ids(&channel), [2, 4, 5, 6, 7, 8, 9]);
    assert!(channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, 0, 0));
    assert!(channel.notify(EventType::REGISTRATION_2_NEGATIVE, 4, 0, 0), "an error ends the checking");
    assert!(!channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, 0, 0));
}

#[test]
fn every_event_type_has_the_bit_of_its_name() {
    let named = |bits: EventChecking| bits.iter().next().map(|b| b.to_string());
    let pairs = [
        (EventType::REGISTRATION_1_NEGATIVE, "Reg 1 Neg Edge"),
        (EventType::MARKER_POSITIVE, "Marker Pos Edge"),
        (EventType::HOME_NEGATIVE, "Home Switch Neg Edge"),
        (EventType::HOME_MARKER_NN, "Home Switch-Marker --"),
        (EventType::HOME_TORQUE, "Home Torque Threshold"),
        (EventType::WATCH_1_FORWARD, "Watch Position 1 Fwd"),
        (EventType::WATCH_2_REVERSE, "Watch Position 2 Rev"),
    ];
    for (event, name) in pairs {
        assert_eq!(event.checking().and_then(named).as_deref(), Some(name));
    }
    assert_eq!(EventType(17).checking(), None);
    let all = (0..=16).filter_map(|code| EventType(code).checking());
    assert_eq!(all.fold(EventChecking::empty(), |bits, bit| bits | bit), EventChecking::EVENTS);
}

#[test]
fn extended_cycle_of_table_6_2_30() {
    let watch = EventChecking::WATCH_1_FORWARD;
    let mut channel = channel(ALL);
    handle(&mut channel, &block(watch | EventChecking::WATCH_2_REVERSE, &[]));
    assert_eq!(channel.status(), EventChecking::empty(), "no watch position has come");
    let data = ExtendedEventData { watch_positions: [Some(5), None], ..ExtendedEventData::default() };
    handle(&mut channel, &extended(watch | EventChecking::WATCH_2_REVERSE, data));
    assert_eq!(channel.status(), watch, "the second one still has not");
    assert_eq!(channel.block().and_then(|b| b.extended), Some(data.data_sets()));
    let more = ExtendedEventData { watch_positions: [None, Some(6)], ..ExtendedEventData::default() };
    handle(&mut channel, &extended(watch | EventChecking::WATCH_2_REVERSE, more));
    assert_eq!(channel.parameters().watch_positions, [Some(5), Some(6)], "what does not come stays");
    assert_eq!(channel.status(), watch | EventChecking::WATCH_2_REVERSE);
    handle(&mut channel, &block(watch, &[]));
    assert_eq!(channel.block().and_then(|b| b.extended), None);
    assert_eq!(channel.parameters().watch_positions, [Some(5), Some(6)], "the parameters stay");
    channel.handle(None);
    assert_eq!(channel.parameters(), &ExtendedEventData::default(), "until the channel closes");
}

#[test]
fn a_step_of_the_system_time_moves_the_stamps_of_what_was_not_told_yet() {
    let mut channel = channel(ALL);
    handle(&mut channel, &extended(EventChecking::EVENTS, parameters()));
    assert!(channel.notify(EventType::MARKER_POSITIVE, 0, 5, 1_000));
    assert!(channel.notify(EventType::REGISTRATION_1_POSITIVE, 3, 5, 1_000), "it cannot be found");
    channel.shift(250);
    assert!(channel.notify(EventType::WATCH_1_FORWARD, 0, 5, 2_000), "stamped behind the step");
    let stamps = |channel: &EventChannel| -> Vec<u64> {
        channel.block().expect("open").notifications.iter().map(|n| n.time_stamp).collect()
    };
    assert_eq!(stamps(&channel), [1_250, 0, 2_000]);
    let times: Vec<_> = channel.attributes().filter(|(id, _)| [66, 71, 72].contains(id)).collect();
    assert_eq!(times, [(71, 1_250), (66, 0), (72, 2_000)]);
    channel.shift(-5_000);
    assert_eq!(stamps(&channel), [0, 0, 0], "never below zero");
}

#[test]
fn what_the_drive_can_no_longer_check_is_not_pretended() {
    let bits = EventChecking::MARKER_POSITIVE | EventChecking::REG_1_POSITIVE;
    let mut channel = channel(ALL);
    handle(&mut channel, &block(bits, &[]));
    assert!(channel.notify(EventType::MARKER_POSITIVE, 0, 1, 1));
    channel.support(EventChecking::empty());
    assert_eq!(channel.status(), EventChecking::MARKER_POSITIVE, "what has occurred has occurred");
    assert!(!channel.notify(EventType::REGISTRATION_1_POSITIVE, 0, 1, 1));
    channel.support(ALL);
    assert_eq!(channel.status(), EventChecking::MARKER_POSITIVE, "the drive has to look first");
    channel.confirm(ALL);
    assert_eq!(channel.status(), bits);
}

#[test]
fn a_window_reaches_around_the_end_of_the_range() {
    let window = |min, max| Window { min, max };
    let rows = [
        (window(-5, 5), [(-6, false), (-5, true), (5, true), (6, false)]),
        (
            window(i32::MAX - 1, i32::MIN + 1),
            [(i32::MAX - 2, false), (i32::MAX, true), (i32::MIN, true), (0, false)],
        ),
        (window(7, 7), [(6, false), (7, true), (8, false), (-7, false)]),
    ];
    for (window, places) in rows {
        for (place, inside) in places {
            assert_eq!(window.contains(place), inside, "{place} in {window:?}");
        }
    }
}

#[test]
fn attributes_tell_the_last_event_of_each_kind() {
    let mut channel = channel(ALL);
    handle(&mut channel, &extended(EventChecking::EVENTS, parameters()));
    for code in 0..=16_u8 {
        assert!(channel.notify(EventType(code), 0, -i32::from(code) - 1, 100 + u64::from(code)));
    }
    let values: std::collections::BTreeMap<_, _> = channel.attributes().collect();
    let place = |value: i32| u64::from(value.cast_unsigned());
    let expected = [
        (60, 0x81FF_F00F),
        (61, 0xF1FF_F00F),
        (62, place(-1)),
        (63, place(-2)),
        (64, place(-3)),
        (65, place(-4)),
        (66, 100),
        (67, 101),
        (68, 102),
        (69, 103),
        (70, place(-13)),
        (71, 112),
        (72, 114),
        (73, 116),
        (95, 0xF),
        (96, 1),
        (97, 3),
    ];
    assert_eq!(values.into_iter().collect::<Vec<_>>(), expected);
}

/// What an event type does in every combination of arming, window, auto-rearm and a second edge before the
/// acknowledgement: status bits, answers to both edges, IDs in the block, status after the acknowledgement.
fn outcome(event: EventType, armed: bool, window: Option<bool>, rearm: bool) -> String {
    let bit = event.checking().expect("a bit");
    let mut bits = if armed { bit } else { EventChecking::empty() };
    bits.set(bit.windows(), window.is_some());
    bits.set(bit.rearms(), rearm);
    let mut channel = channel(ALL);
    handle(&mut channel, &extended(bits, parameters()));
    let before = channel.status();
    let place = if window == Some(false) { 11 } else { -10 };
    let edges = [channel.notify(event, 0, place, 1), channel.notify(event, 0, place, 2)];
    let told = ids(&channel);
    handle(&mut channel, &block(bits, &told.iter().map(|id| (*id, 0)).collect::<Vec<_>>()));
    let acknowledged = (ids(&channel), channel.armed().contains(bit));
    handle(&mut channel, &block(EventChecking::empty(), &[]));
    let cleared = channel.status();
    format!("status {before}; edges {edges:?}; IDs {told:?}; then {acknowledged:?}; cleared {cleared}")
}

#[test]
fn whole_table() {
    let mut table = String::new();
    for code in 0..=16 {
        let event = EventType(code);
        let registers = !event.checking().expect("a bit").rearms().is_empty();
        let windows: &[_] = if registers { &[None, Some(true), Some(false)] } else { &[None] };
        let rearms: &[_] = if registers { &[false, true] } else { &[false] };
        writeln!(table, "{event}").expect("a string");
        for armed in [false, true] {
            for window in windows {
                for rearm in rearms {
                    let what = outcome(event, armed, *window, *rearm);
                    let window = window.map_or("none", |inside| if inside { "inside" } else { "outside" });
                    writeln!(table, "  armed {armed}, window {window}, rearm {rearm}: {what}")
                        .expect("a string");
                }
            }
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn an_edge_whose_window_is_not_known_is_not_checked() {
    let bits = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_WINDOW;
    let mut channel = channel(ALL);
    handle(&mut channel, &block(bits, &[]));
    assert_eq!((channel.status(), channel.armed()), (EventChecking::empty(), EventChecking::empty()));
    let mut channel = self::channel(EventChecking::EVENTS);
    handle(&mut channel, &extended(bits, parameters()));
    assert_eq!(channel.armed(), EventChecking::empty(), "an axis whose controller does the scaling");
}
