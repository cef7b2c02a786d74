//! Two masters on one bus.

use super::*;
use crate::master::foreign::{LISTEN, OtherMaster};
use crate::wire::Function;

const SYNC: Id = Id::Standard(0x080);
const NMT: Id = Id::Standard(0x000);

fn listening(drives: u8) -> MasterConfig {
    MasterConfig { listens: true, ..network(drives) }
}

/// Lets a master hear frames and do what is due, and gives what it sends.
fn attend(master: &mut Master, now: MonotonicTime, heard: &[Frame]) -> Vec<Frame> {
    for frame in heard {
        let _ = master.handle_frame(now, frame);
    }
    std::iter::from_fn(|| master.poll(now).map(|Output::Transmit(frame)| frame)).collect()
}

#[test]
fn nothing_is_sent_before_the_bus_was_silent_for_the_time() {
    let mut rig = rig(listening(2));
    rig.master.start(rig.now);
    let begin = rig.now;
    assert_eq!((rig.master.wake_at(), rig.master.leads()), (Some(begin + LISTEN), false));
    assert_eq!(rig.master.next_sync(), None);
    // What devices say by themselves is nobody's command.
    for number in [0x701, 0x181, 0x081, 0x581] {
        assert_eq!(rig.hear(Id::Standard(number), &[0; 8]), Err(Refusal::NotOurs));
    }
    rig.until("the first frame", |rig| !rig.sent.is_empty());
    assert_eq!(rig.sent[0].0 - begin, LISTEN);
    rig.comes_up(&[1, 2]);
    assert_eq!(rig.count(|event| matches!(event, Event::OtherMaster(_))), 0);
}

#[test]
fn a_master_that_comes_second_sends_nothing_and_the_first_loses_no_period() {
    let mut rig = running(2);
    let config = MasterConfig {
        heartbeat: Some(MasterHeartbeat { node: id(126), producer_ms: 100, timeout_ms: 300 }),
        ..listening(2)
    };
    let mut second = Master::new(config).unwrap();
    second.start(rig.now);
    rig.keep(&[1, 2]);
    for _ in 0..5_000 {
        rig.sent.clear();
        rig.run_ms(1);
        let heard: Vec<_> = rig.sent.iter().map(|(_, frame)| *frame).collect();
        assert_eq!(attend(&mut second, rig.now, &heard), [], "at {}", rig.now);
    }
    rig.kept();
    assert_eq!(rig.master.statistics().refused(Refusal::SecondMaster), 0);
    let period = Some(DurationNs::from_millis(4));
    let told = OtherMaster { function: Some(Function::Rpdo(1, id(2))), id: Id::Standard(0x202), period };
    let events: Vec<_> = std::iter::from_fn(|| second.poll_event()).collect();
    let [Event::OtherMaster(heard)] = events[..] else { panic!("{events:?}") };
    assert_eq!(heard.period, period);
    assert!(matches!(heard.id, Id::Standard(0x080 | 0x201 | 0x202)), "{heard}");
    let text = "another master is on this bus: an RPDO, identifier 202, a SYNC every 4000 us or so";
    assert_eq!(told.to_string(), text);

    // The first one ends, and the second begins once the bus has been silent.
    rig.master.stop(rig.now);
    rig.sent.clear();
    rig.run_ms(1);
    let last: Vec<_> = rig.sent.iter().map(|(_, frame)| *frame).collect();
    let silent = rig.now;
    assert_eq!(attend(&mut second, silent, &last), []);
    let begin = second.wake_at().unwrap();
    assert!(begin - silent >= LISTEN && begin - silent < DurationNs::from_secs(2));
    assert!(!attend(&mut second, begin, &[]).is_empty() && second.leads());
}

#[test]
fn whatever_a_master_sends_is_heard_and_told_once() {
    let own = Id::Standard(0x700 + 127);
    for (number, data, what) in [
        (SYNC, &[][..], "SYNC, identifier 080"),
        (NMT, &[1, 0], "NMT, identifier 000"),
        (Id::Standard(0x201), &[0; 6], "an RPDO, identifier 201"),
        (own, &[5], "a heartbeat with this master's node-id, identifier 77f"),
    ] {
        let mut rig = rig(listening(2));
        rig.master.start(rig.now);
        rig.run_ms(500);
        assert_eq!(rig.hear(number, data), Err(Refusal::SecondMaster));
        let heard = rig.now;
        rig.until("the first frame", |rig| !rig.sent.is_empty());
        assert!(rig.sent[0].0 - heard >= LISTEN, "{what}");
        let events = rig.log.iter().filter_map(|event| match event {
            Event::OtherMaster(other) => Some(other.to_string().to_lowercase()),
            _ => None,
        });
        let expected = format!("another master is on this bus: {what}").to_lowercase();
        assert_eq!(events.collect::<Vec<_>>(), [expected]);
        rig.comes_up(&[1, 2]);
    }
}

#[test]
fn a_second_sync_in_operation_is_told_and_the_application_decides_when_to_give_way() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    rig.master.give_way(rig.now);
    assert!(rig.master.leads(), "nobody was heard");
    // A tool that sends one now and then is no master.
    for _ in 0..3 {
        assert_eq!(rig.hear(SYNC, &[]), Err(Refusal::SecondMaster));
        rig.run_ms(1_200);
    }
    assert_eq!(rig.hear(NMT, &[1, 0]), Err(Refusal::SecondMaster));
    assert_eq!(rig.hear(NMT, &[1, 0]), Err(Refusal::SecondMaster));
    assert_eq!(rig.count(|event| matches!(event, Event::OtherMaster(_))), 0);
    for _ in 0..5 {
        assert_eq!(rig.hear(SYNC, &[]), Err(Refusal::SecondMaster));
        rig.run_ms(2);
    }
    assert_eq!(rig.count(|event| matches!(event, Event::OtherMaster(_))), 1);
    rig.kept();
    rig.kept.clear();
    rig.master.give_way(rig.now);
    rig.forget();
    let end = rig.now;
    rig.run_ms(1_000);
    assert!(rig.sent.is_empty() && !rig.master.leads() && rig.state(1) == BootState::Off);
    assert_eq!(rig.count(|event| *event == Event::GaveWay), 1);
    // As long as the other one goes on.
    for _ in 0..200 {
        rig.run_ms(20);
        let frame = Frame::new(SYNC, &[]).unwrap();
        assert_eq!(rig.master.handle_frame(rig.now, &frame), Err(Refusal::SecondMaster));
    }
    assert!(rig.sent.is_empty(), "since {end}");
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_master_that_is_stopped_while_it_waits_sends_nothing() {
    let mut rig = rig(listening(1));
    rig.master.start(rig.now);
    rig.run_ms(500);
    rig.master.stop(rig.now);
    assert_eq!(rig.master.wake_at(), None);
    rig.run_ms(5_000);
    assert!(rig.sent.is_empty());
    rig.master.start(rig.now);
    rig.comes_up(&[1]);
}

#[test]
fn a_bus_that_is_back_is_listened_to_before_it_is_used() {
    let mut rig = rig(listening(1));
    rig.master.start(rig.now);
    rig.comes_up(&[1]);
    rig.master.bus_off(rig.now);
    rig.run_ms(50);
    rig.forget();
    rig.master.bus_on(rig.now);
    let back = rig.now;
    rig.until("the first frame", |rig| !rig.sent.is_empty());
    assert_eq!(rig.sent[0].0 - back, LISTEN);
    rig.comes_up(&[1]);
}
