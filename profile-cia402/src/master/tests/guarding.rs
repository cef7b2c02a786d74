//! Devices without a heartbeat: the master asks, and they ask to be asked.

use super::*;

/// Two drives, of which the first one is guarded: asked every 50 ms, lost after 150.
fn guarded() -> MasterConfig {
    let mut config = network(2);
    let guarding = GuardingConfig { guard_time_ms: 50, life_time_factor: 3 };
    (config.nodes[0].heartbeat, config.nodes[0].guarding) = (None, Some(guarding));
    config
}

fn in_operation() -> Rig {
    let mut rig = rig(guarded());
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.run_ms(40);
    rig.forget();
    rig.keep(&[2]);
    rig
}

#[test]
fn a_guarded_device_is_set_up_and_asked_on_a_grid() {
    let mut rig = rig(guarded());
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let report = rig.master.node(id(1)).unwrap().report.iter().map(ToString::to_string);
    let control: Vec<_> = report.filter(|row| row.starts_with("control")).collect();
    assert_eq!(
        control,
        [
            "control write 1016:01: 8323372 (0x7f012c)",
            "control write 1017:00: 0 (0x0)",
            "control write 100C:00: 50 (0x32)",
            "control write 100D:00: 3 (0x3)",
        ]
    );
    rig.run_ms(1_000);
    let times: Vec<_> = rig.device(1).guarded.iter().map(|at| at.0).collect();
    assert!(times.len() >= 20, "{times:?}");
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 50_000_000), "{times:?}");
    assert_eq!(rig.device(2).guarded, []);
    let requests: Vec<_> = rig.sent.iter().filter(|(_, frame)| frame.is_remote()).collect();
    assert!(requests.iter().all(|(_, frame)| frame.id() == Id::Standard(0x701) && frame.len() == 1));
    rig.runs(&[1, 2]);
}

#[test]
fn a_guarded_device_that_does_not_answer() {
    let mut rig = in_operation();
    rig.device(1).no_heartbeat = true;
    let before = rig.now;
    rig.until("loss", |rig| rig.saw(&Event::GuardingLost { node: id(1) }));
    assert!((100..=150).contains(&((rig.now.0 - before.0) / 1_000_000)));
    rig.run_ms(1);
    assert_eq!((rig.state(1), rig.device(1).state), (BootState::Lost, NmtState::STOPPED));
    assert_eq!(rig.master.node(id(1)).unwrap().status, Some(BootStatus::GUARDING));
    // It is not asked any more until it is brought up again.
    let asked = rig.device(1).guarded.len();
    rig.run_ms(500);
    assert_eq!(rig.device(1).guarded.len(), asked);
    rig.device(1).no_heartbeat = false;
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.kept();
    rig.comes_up(&[1, 2]);
}

#[test]
fn an_answer_that_does_not_alternate_is_none() {
    let mut rig = in_operation();
    rig.device(1).stuck = true;
    let unexpected = rig.master.statistics().refused(Refusal::Unexpected);
    rig.until("loss", |rig| rig.saw(&Event::GuardingLost { node: id(1) }));
    assert!(rig.master.statistics().refused(Refusal::Unexpected) - unexpected >= 2);
    rig.kept();
}

#[test]
fn an_answer_that_is_lost_on_the_way_costs_two_and_no_more() {
    let mut rig = in_operation();
    let mut lose = true;
    rig.arrives = Box::new(move |frame| frame.id() != Id::Standard(0x701) || !core::mem::take(&mut lose));
    let unexpected = rig.master.statistics().refused(Refusal::Unexpected);
    rig.run_ms(1_000);
    // The one behind it has the bit of the one before.
    assert_eq!(rig.master.statistics().refused(Refusal::Unexpected) - unexpected, 1);
    assert_eq!(rig.log, []);
    rig.runs(&[1, 2]);
}

#[test]
fn a_guarded_device_that_reboots_or_leaves_operation() {
    let mut rig = in_operation();
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("boot-up", |rig| rig.saw(&Event::Rebooted { node: id(1), operational: true }));
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.forget();
    rig.device(1).state = NmtState::PRE_OPERATIONAL;
    let now = rig.now;
    let state = NmtState::PRE_OPERATIONAL;
    rig.until("loss", |rig| rig.saw(&Event::StateChanged { node: id(1), state }));
    assert!(rig.now.0 - now.0 <= 51_000_000, "with the next answer");
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.kept();
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_guarded_device_that_is_not_there_when_it_is_started() {
    for silent in [true, false] {
        let mut rig = beside(guarded(), |device| {
            // It says nothing, or does not obey.
            (device.no_heartbeat, device.lazy) = (silent, !silent);
        });
        rig.until("failure", |rig| rig.count(|event| matches!(event, Event::BootFailed { .. })) > 0);
        let info = rig.master.node(id(1)).unwrap();
        assert_eq!((info.state, info.status), (BootState::Failed, Some(BootStatus::GUARDING)));
        rig.kept();
    }
}

#[test]
fn devices_without_the_objects_of_guarding_are_guarded_nevertheless() {
    let mut rig = beside(guarded(), |device| {
        for object in [Mux::GUARD_TIME, Mux::LIFE_TIME_FACTOR, Mux::PRODUCER_HEARTBEAT] {
            device.objects.values.remove(&object);
        }
        device.objects.values.insert(Mux::PRODUCER_HEARTBEAT, vec![0; 2]);
    });
    rig.comes_up(&[1, 2]);
    // One that has them and refuses is not what it should be.
    let mut rig = beside(guarded(), |device| {
        device.objects.refuse.insert(Mux::GUARD_TIME, AbortCode::READ_ONLY);
    });
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let step = "control write 100C:00: refused with 06010002: attempt to write a read-only object";
    assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
    rig.kept();
}

#[test]
fn a_guarded_device_in_operation_may_stay_so() {
    let mut rig = in_operation();
    rig.kept.clear();
    let mut config = guarded();
    config.nodes[0].keep_alive = true;
    rig.master = Master::new(config).unwrap();
    rig.device(1).objects.writes.clear();
    rig.device(1).guarded.clear();
    let start = rig.now;
    rig.master.start(start);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert!(rig.saw(&Event::AwaitingApplication { node: id(1), kept: true }));
    assert_eq!(rig.device(1).objects.writes, []);
    rig.comes_up(&[1, 2]);
    // It was asked at once and all the time, so that it never missed the master.
    let mut times: Vec<_> = rig.device(1).guarded.iter().map(|at| at.0).collect();
    times.insert(0, start.0);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] <= 50_000_000), "{times:?}");
}
