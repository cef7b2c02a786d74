//! SYNC, PDOs and times.

use super::*;
use crate::wire::time::TimeOfDay;

/// Identifiers that the master sends in one period.
fn period(rig: &mut Rig) -> Vec<Id> {
    rig.run_ms(3);
    rig.forget();
    let next = rig.master.next_sync().unwrap();
    rig.now = next;
    rig.settle();
    // Without the master's heartbeat.
    rig.sent.iter().map(|(_, frame)| frame.id()).filter(|&id| id != Id::Standard(0x77F)).collect()
}

#[test]
fn rpdos_follow_sync_and_go_only_when_committed() {
    let mut rig = running(2);
    assert_eq!(period(&mut rig)[..3], [cob_id::SYNC, Id::Standard(0x201), Id::Standard(0x202)]);
    rig.cyclic = false;
    assert_eq!(period(&mut rig), [cob_id::SYNC]);
    rig.master.producer(id(2), 1).unwrap().copy_from_slice(&[9, 8, 7, 6, 5, 4]);
    assert!(rig.master.commit(id(2), 1));
    assert_eq!(period(&mut rig), [cob_id::SYNC, Id::Standard(0x202)]);
    assert_eq!(rig.device(2).received.last().unwrap(), &[9, 8, 7, 6, 5, 4]);
    // Once.
    assert_eq!(period(&mut rig), [cob_id::SYNC]);
    assert!(rig.master.commit(id(1), 1));
    rig.master.withdraw(id(1), 1);
    assert_eq!(period(&mut rig), [cob_id::SYNC]);
    assert!(!rig.master.commit(id(1), 2));
}

/// A started device sends before its heartbeat says that it is in operation: that is neither used nor a fault of anybody.
#[test]
fn a_pdo_between_start_and_heartbeat_is_neither_used_nor_refused() {
    let mut rig = rig(network(1));
    rig.cyclic = false;
    rig.master.start(rig.now);
    let pdo = |rig: &mut Rig| rig.hear(Id::Standard(0x181), &[1, 2, 3, 4, 5, 6]);
    rig.until("map", |rig| rig.state(1) == BootState::Map);
    assert_eq!(pdo(&mut rig), Err(Refusal::NotOperational));
    rig.device(1).no_heartbeat = true;
    rig.until("start", |rig| rig.state(1) == BootState::Starting);
    let before = rig.master.statistics().refused;
    assert_eq!(pdo(&mut rig), Ok(()));
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.fresh, consumer.state), (false, ConsumerState::Waiting));
    assert_eq!(rig.master.statistics().refused, before);
    rig.device(1).no_heartbeat = false;
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert_eq!(pdo(&mut rig), Ok(()));
    assert!(rig.master.consumer(id(1), 1).unwrap().fresh);
}

#[test]
fn what_devices_send_is_fresh_for_one_period() {
    let mut rig = running(1);
    rig.device(1).values = [1, 2, 3, 4, 5, 6, 0, 0];
    period(&mut rig);
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.fresh, consumer.state), (false, ConsumerState::Good));
    rig.run_ms(1);
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.fresh, consumer.data), (true, &[1, 2, 3, 4, 5, 6][..]));
}

#[test]
fn missing_tpdos_are_counted_and_told() {
    let mut rig = running(2);
    let missed = rig.master.statistics().pdos_missed;
    rig.arrives = Box::new(|frame| frame.id() != Id::Standard(0x181));
    rig.until("loss", |rig| rig.saw(&Event::PdoLost { node: id(1), number: 1 }));
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.state, consumer.missed, consumer.fresh), (ConsumerState::Lost, 2, false));
    assert_eq!(rig.master.statistics().pdos_missed - missed, 2);
    rig.arrives = Box::new(|_| true);
    rig.until("return", |rig| rig.saw(&Event::PdoBack { node: id(1), number: 1 }));
    rig.runs(&[1, 2]);
    assert_eq!(rig.count(|event| matches!(event, Event::PdoLost { .. })), 1);
}

#[test]
fn the_grid_stays_when_the_caller_is_late() {
    let mut rig = running(1);
    let next = rig.master.next_sync().unwrap();
    // Late by more than two periods: one SYNC goes, two are left out.
    rig.now = MonotonicTime(next.0 + 9_000_000);
    rig.settle();
    assert_eq!(rig.sent.iter().filter(|(_, frame)| frame.id() == cob_id::SYNC).count(), 1);
    assert_eq!(rig.master.next_sync(), Some(MonotonicTime(next.0 + 12_000_000)));
    assert_eq!(rig.master.statistics().syncs_skipped, 2);
}

#[test]
fn the_counter_of_sync_begins_again_at_its_overflow() {
    let mut config = network(1);
    config.sync = Some(SyncConfig { period_ns: 1_000_000, window_ns: 0, counter_overflow: 3 });
    let mut rig = rig(config);
    rig.master.start(rig.now);
    rig.run_ms(6);
    let counters: Vec<_> = rig.devices[0].syncs.iter().map(|data| data[0]).collect();
    assert_eq!(counters, [1, 2, 3, 1, 2, 3, 1]);
}

#[test]
fn tpdos_after_the_synchronous_window_are_late() {
    for (window_ns, late) in [(400_000, true), (600_000, false), (0, false)] {
        let mut config = network(1);
        config.sync = Some(SyncConfig { period_ns: 4_000_000, window_ns, counter_overflow: 0 });
        let mut rig = rig(config);
        rig.master.start(rig.now);
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        // The device takes 500 us.
        period(&mut rig);
        rig.run_ms(1);
        assert_eq!(rig.master.consumer(id(1), 1).unwrap().late, late, "{window_ns}");
        assert_eq!(rig.master.statistics().pdos_late > 0, late);
    }
}

#[test]
fn sdo_frames_are_bounded_per_period() {
    let mut config = network(2);
    config.sdo_frames_per_cycle = 1;
    let mut rig = rig(config);
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let mut in_period = 0;
    for (_, frame) in &rig.sent {
        let request = matches!(Function::of(frame.id()), Some(Function::SdoRequest(_)));
        in_period = if frame.id() == cob_id::SYNC { 0 } else { in_period + usize::from(request) };
        assert!(in_period <= 1);
    }
}

/// A network with an event-driven RPDO 2 at its device, in operation.
fn event_driven(sync: Option<SyncConfig>) -> Rig {
    let mut config = network(1);
    config.sync = sync;
    config.nodes[0].rpdos = vec![PdoConfig {
        transmission: TransmissionType::EVENT_PROFILE,
        ..PdoConfig::cyclic(2, vec![CONTROLWORD])
    }];
    if sync.is_none() {
        config.nodes[0].tpdos.clear();
    }
    let mut rig = rig(config);
    rig.cyclic = false;
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.run_ms(1);
    rig.forget();
    rig
}

#[test]
fn event_driven_rpdos_go_at_once_in_a_network_without_sync() {
    let mut rig = event_driven(None);
    rig.master.producer(id(1), 2).unwrap().copy_from_slice(&[6, 0]);
    assert!(rig.master.commit(id(1), 2));
    rig.settle();
    let sent: Vec<_> = rig.sent.iter().map(|(_, frame)| frame.to_string()).collect();
    assert_eq!(sent, ["301#06 00"]);
}

/// A device that takes an RPDO as soon as it is there gets it when a synchronous one takes what it was sent a period before.
#[test]
fn event_driven_rpdos_wait_for_the_sync_at_which_synchronous_ones_count() {
    let mut rig = event_driven(network(1).sync);
    // Values of three periods, of which the second has none, and one that is taken back.
    let mut periods = Vec::new();
    for value in [Some(6), None, Some(7), Some(15), None] {
        rig.until("SYNC", |rig| rig.sent.iter().any(|(_, frame)| frame.id() == cob_id::SYNC));
        rig.settle();
        let sent = rig.sent.iter().filter(|(_, frame)| frame.id() == Id::Standard(0x301));
        periods.push(sent.map(|(_, frame)| frame.data()[0]).collect::<Vec<_>>());
        rig.forget();
        if let Some(value) = value {
            rig.master.producer(id(1), 2).unwrap().copy_from_slice(&[value, 0]);
            assert!(rig.master.commit(id(1), 2));
        }
        if value == Some(15) {
            rig.master.withdraw(id(1), 2);
        }
    }
    assert_eq!(periods, [vec![], vec![], vec![6], vec![], vec![]], "7 was sent with 15 taken back");
    rig.master.producer(id(1), 2).unwrap().copy_from_slice(&[9, 0]);
    assert!(rig.master.commit(id(1), 2));
    rig.run_ms(9);
    let sent: Vec<_> = rig.sent.iter().filter(|(_, frame)| frame.id() == Id::Standard(0x301)).collect();
    assert_eq!(sent.iter().map(|(_, frame)| frame.data()[0]).collect::<Vec<_>>(), [9]);
}

#[test]
fn pdos_go_in_fd_frames_on_an_fd_bus() {
    let mut config = network(1);
    config.fd = Some(true);
    let mut rig = rig(config);
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let ids = period(&mut rig);
    assert_eq!(ids[..2], [cob_id::SYNC, Id::Standard(0x201)]);
    assert!(rig.sent[1].1.is_fast() && !rig.sent[0].1.is_fd());
}

#[test]
fn the_network_stops() {
    let mut rig = running(2);
    rig.master.send_time(TimeOfDay { milliseconds: 1, days: 2 });
    rig.settle();
    assert!(rig.sent.iter().any(|(_, frame)| frame.to_string() == "100#01 00 00 00 02 00"));
    rig.forget();
    rig.master.stop(rig.now);
    rig.run_ms(100);
    let sent: Vec<_> = rig.sent.iter().map(|(_, frame)| frame.to_string()).collect();
    assert_eq!(sent, ["000#02 00"]);
    assert!(rig.devices.iter().all(|device| device.state == NmtState::STOPPED));
    assert_eq!((rig.master.wake_at(), rig.master.next_sync()), (None, None));
    assert!(!rig.master.commit(id(1), 1));
    // And starts again.
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.runs(&[1, 2]);
}

#[test]
fn one_device_is_stopped_and_tried_again() {
    let mut rig = running(2);
    rig.master.stop_node(rig.now, id(1)).unwrap();
    rig.run_ms(20);
    assert_eq!((rig.state(1), rig.device(1).state), (BootState::Off, NmtState::STOPPED));
    assert_eq!(rig.master.stop_node(rig.now, id(1)), Err(CallError::State(BootState::Off)));
    assert_eq!(rig.master.retry(rig.now, id(2)), Err(CallError::State(BootState::Operational)));
    assert_eq!(rig.master.retry(rig.now, id(99)), Err(CallError::NoNode));
    rig.runs(&[2]);
    rig.master.retry(rig.now, id(1)).unwrap();
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.runs(&[1, 2]);
}

/// Nothing is allocated once the network is there; what grows would show.
#[test]
fn storage_stays_as_it_is() {
    let mut rig = running(2);
    let sizes = |rig: &Rig| {
        let of = |station: &Station| (station.report.capacity(), station.steps.capacity());
        (rig.master.events.capacity(), rig.master.stations.iter().map(of).collect::<Vec<_>>())
    };
    let before = sizes(&rig);
    for number in [1, 2] {
        let now = rig.now;
        rig.device(number).reset(now);
        rig.forget();
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    }
    assert_eq!(sizes(&rig), before);
}
