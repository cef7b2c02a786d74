//! Datagrams at UDP 2222 that are not the owner's: forged updates, replays, floods.
//!
//! Here all of them reach the cycle. On a host the kernel drops most of them before: `tests/namespaces/flood.rs`.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use axisbridge::engine::admission::Refused;
use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::motion::{SLIDE_END, TURNTABLE_END, both, in_motion, long_moves, millis};
use axisbridge_tests::rig::network::Random;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::Step;
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_generic::time::DurationNs;

use super::updates::{SEQUENCE_COUNT, instances};

const STRANGER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 66);
const OWNER: SocketAddrV4 = SocketAddrV4::new(CONTROLLER, IO_PORT);
/// Where the connection ID stands.
const CONNECTION_ID: usize = 6;

/// The last datagrams that the controller has sent, the newest last.
type Sent = Rc<RefCell<VecDeque<Vec<u8>>>>;

/// Keeps so many datagrams of the controller.
fn record(rig: &mut Rig, count: usize) -> Sent {
    let sent = Sent::default();
    let copy = Rc::clone(&sent);
    rig.tamper_command = Some(Box::new(move |datagram| {
        let mut sent = copy.borrow_mut();
        if sent.len() == count {
            sent.pop_front();
        }
        sent.push_back(datagram.as_slice().to_vec());
        true
    }));
    sent
}

/// An update that is as good as the owner's next one, and commands axis 1 half a turn away.
fn displaced(update: &[u8]) -> Vec<u8> {
    let mut forged = update.to_vec();
    let at = instances(&forged)[0] + 16;
    let position = f64::from_le_bytes(forged[at..at + 8].try_into().expect("eight octets"));
    // Half a turn, in counts of the controller.
    forged[at..at + 8].copy_from_slice(&(position + 500_000.0).to_le_bytes());
    forged
}

/// A rig in motion in which somebody forges every update for 200 ms and is faster than the owner with each; returns how many
/// were forged.
fn forge(rig: &mut Rig, from: SocketAddrV4, change: impl Fn(&mut Vec<u8>)) -> u64 {
    let sent = record(rig, 1);
    let mut count = 0;
    let end = rig.now() + millis(200);
    while rig.now() < end {
        rig.step();
        if let Some(update) = sent.borrow_mut().pop_front() {
            let mut forged = displaced(&update);
            change(&mut forged);
            rig.inject_datagram(&forged, from);
            count += 1;
        }
    }
    rig.tamper_command = None;
    rig.run_for(millis(4));
    count
}

/// The owner has noticed nothing: no fault, no axis out of its way, no lost update, the whole program carried out.
fn owner_goes_on(rig: &mut Rig, name: &str) {
    let report = rig.run(millis(20_000));
    assert_eq!(
        (report.failure, report.steps_finished, report.node_fault),
        (None, 4, None),
        "{name}: {}",
        rig.log()
    );
    let counters = *rig.engine.devices()[0].device().counters();
    assert_eq!(
        (counters.lost_updates, counters.late_updates, counters.connection_losses),
        (0, 0, 0),
        "{name}"
    );
    for axis in 0..2 {
        let states = rig.axis_states(axis);
        let bad = [AxisState::Aborting, AxisState::MajorFaulted];
        assert!(!states.iter().any(|state| bad.contains(state)), "{name}: {states:?}");
    }
    let millionths = |place| rig.position(place) / 1_000;
    let ends = [TURNTABLE_END, SLIDE_END].map(|end| format!("{:.0}", end * 1e6));
    let way = [0, 1].map(|place| ends[place].parse::<i64>().expect("a number") - millionths(place));
    assert!(way[0].abs() < 1_000 && way[1].abs() < 20_000, "{name}: off by {way:?}");
}

/// Forged updates from one sender: every one is refused, and the owner goes on. Returns what the log says of the last one.
fn forged_updates_are_refused(name: &str, from: SocketAddrV4, change: impl Fn(&mut Vec<u8>)) -> Refused {
    let mut rig = in_motion(Settings::default());
    let before = rig.engine.devices()[0].counters().refused;
    let speed = rig.velocity(0);
    let forged = forge(&mut rig, from, change);
    assert_eq!(forged, 50, "{name}: one in each update period");
    assert_eq!(rig.engine.devices()[0].counters().refused - before, forged, "{name}");
    assert!((rig.velocity(0) - speed).abs() < speed / 100, "{name}: {} {speed}", rig.velocity(0));
    rig.run_for(millis(1_100));
    let told: Vec<_> = rig
        .notices
        .iter()
        .filter_map(|notice| match notice {
            Notice::Strangers { device: 0, count, from, why } => Some((*count, *from, *why)),
            _ => None,
        })
        .collect();
    let [(count, last, why)] = told[..] else { panic!("{name}: one line: {told:?}") };
    assert_eq!((count, last), (forged, from), "{name}");
    owner_goes_on(&mut rig, name);
    why
}

#[test]
fn an_update_from_the_owners_address_with_another_port_is_refused() {
    for port in [IO_PORT + 1, 50_000, 0] {
        let why = forged_updates_are_refused("another port", SocketAddrV4::new(CONTROLLER, port), |_| {});
        assert_eq!(why, Refused::Port { expected: IO_PORT });
        assert_eq!(why.to_string(), "the updates of the motion connection come from port 2222");
    }
}

#[test]
fn an_update_from_the_owners_address_with_another_connection_id_is_refused() {
    for bit in [0, 7, 31] {
        let why = forged_updates_are_refused("another connection", OWNER, |update| {
            update[CONNECTION_ID + bit / 8] ^= 1 << (bit % 8);
        });
        let Refused::ConnectionId { expected, found } = why else { panic!("{why}") };
        assert_eq!(expected ^ found, 1 << bit);
    }
}

#[test]
fn an_update_with_the_right_connection_id_from_another_address_is_refused() {
    for from in [SocketAddrV4::new(STRANGER, IO_PORT), SocketAddrV4::new(STRANGER, 40_000)] {
        let why = forged_updates_are_refused("another address", from, |_| {});
        assert_eq!(why, Refused::Address { expected: CONTROLLER });
    }
}

/// What the three tests above keep out: the same updates, with everything right, do take the axis away.
#[test]
fn the_forged_updates_of_these_tests_would_be_felt() {
    let mut rig = in_motion(Settings::default());
    rig.motion_checker.tolerate("the forged updates are to be felt", |_| true);
    forge(&mut rig, OWNER, |_| {});
    rig.run_for(millis(1_000));
    assert!(rig.axis_states(0).contains(&AxisState::MajorFaulted), "{}", rig.told());
}

#[test]
fn a_controller_may_send_from_any_port_and_keeps_it_for_the_life_of_its_connection() {
    let mut rig = Rig::ready(Settings::default());
    rig.command_port = 51_234;
    rig.connect(long_moves());
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
    assert_eq!(rig.engine.devices()[0].counters().refused, 0);
    // The next connection is another one, and may have another port.
    rig.command_port = 51_235;
    rig.connect(vec![Step::Enable(both()), Step::Dwell { seconds: 100.0 }]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    assert_eq!(rig.engine.devices()[0].counters().refused, 0);
    // In the middle of a connection another port is somebody else's: the axes stop as without a controller.
    rig.command_port = 51_236;
    rig.run_until(millis(2_000), "the loss", |rig| rig.engine.devices()[0].device().connection().is_none());
    rig.run_for(millis(1_000));
    assert!(rig.engine.devices()[0].counters().refused > 10);
    assert_eq!(rig.axis_states(0).last(), Some(&AxisState::MajorFaulted));
    assert!(rig.torque_free());
}

#[test]
fn duplicates_and_replays_of_the_owners_own_updates_change_nothing() {
    let mut rig = in_motion(Settings::default());
    let sent = record(&mut rig, 60);
    rig.run_for(millis(250));
    let refused = rig.engine.devices()[0].counters().refused;
    let before = *rig.engine.devices()[0].device().counters();
    let (mut duplicates, mut replays) = (0, 0);
    for age in [0, 1, 2, 3, 10, 59] {
        let old = sent.borrow().iter().rev().nth(age).cloned().expect("a datagram of the controller");
        // The newest may still be under way: then it is the owner's own that comes second.
        rig.inject_datagram(&old, OWNER);
        rig.inject_datagram(&old, OWNER);
        rig.step();
        (duplicates, replays) = if age == 0 { (2, replays) } else { (duplicates, replays + 2) };
    }
    // The same after the counter has gone round by a half and more: ahead of the owner by its number.
    let newest = sent.borrow().back().cloned().expect("a datagram of the controller");
    let count = u16::from_le_bytes([newest[SEQUENCE_COUNT], newest[SEQUENCE_COUNT + 1]]);
    for ahead in [0x7FFF, 0x4000, 1_000, 200] {
        let mut old = sent.borrow().front().cloned().expect("a datagram of the controller");
        let number = count.wrapping_add(ahead);
        old[SEQUENCE_COUNT..SEQUENCE_COUNT + 2].copy_from_slice(&number.to_le_bytes());
        rig.inject_datagram(&displaced(&old), OWNER);
        rig.run_for(millis(2));
        replays += 1;
    }
    rig.run_for(millis(8));
    let after = *rig.engine.devices()[0].device().counters();
    assert_eq!(after.out_of_order - before.out_of_order, replays, "{after:?}");
    assert_eq!(after.refreshes - before.refreshes, duplicates, "{after:?}");
    assert_eq!(rig.engine.devices()[0].counters().refused, refused, "they are of the connection");
    rig.tamper_command = None;
    owner_goes_on(&mut rig, "replays");
}

/// So many datagrams in each millisecond of the box, for a second, in front of the owner's; the owner misses nothing, and the
/// log has one line.
fn flood(
    name: &str,
    per_step: usize,
    mut datagram: impl FnMut(&Rig, &mut Random) -> (Vec<u8>, SocketAddrV4),
) {
    let mut rig = in_motion(Settings::default());
    let mut random = Random::new(5);
    let (from, mut count) = (rig.now(), 0);
    let before = rig.engine.devices()[0].counters().refused;
    while rig.now().since(from) < millis(1_000) {
        for _ in 0..per_step {
            let (bytes, from) = datagram(&rig, &mut random);
            rig.inject_datagram(&bytes, from);
            count += 1;
        }
        rig.step();
    }
    rig.run_for(millis(1_100));
    let refused = rig.engine.devices()[0].counters().refused - before;
    assert_eq!(refused, count, "{name}");
    let lines = rig.notices.iter().filter(|notice| matches!(notice, Notice::Strangers { .. })).count();
    assert_eq!(lines, 1, "{name}");
    owner_goes_on(&mut rig, name);
}

#[test]
fn a_flood_that_reaches_the_cycle_does_not_hold_up_the_owner() {
    let stranger = SocketAddrV4::new(STRANGER, 40_000);
    flood("garbage", 60, |_, random| {
        let len = usize::try_from(random.below(1_400)).expect("small");
        ((0..len).map(|_| random.next().to_le_bytes()[0]).collect(), stranger)
    });
    flood("empty datagrams from the owner's address", 60, |_, _| (Vec::new(), OWNER));
    flood("the owner's address with another port", 60, |_, _| {
        (vec![0xA5; 60], SocketAddrV4::new(CONTROLLER, 7))
    });
}

#[test]
fn the_log_has_a_line_a_minute_about_strangers_and_none_about_the_end_of_a_connection() {
    let mut rig = Rig::ready(Settings::default());
    let stranger = SocketAddrV4::new(STRANGER, 40_000);
    for _ in 0..100 {
        rig.inject_datagram(&[1, 2, 3], stranger);
        rig.run_for(DurationNs::from_secs(2));
    }
    let lines: Vec<_> =
        rig.told().lines().filter(|line| line.contains("refused")).map(str::to_owned).collect();
    // The first one after a second, the others a minute apart: 200 s have three more.
    assert_eq!(
        lines,
        [
            "device 0: refused 1 datagram, the last one from 10.0.0.66:40000: no motion connection is open",
            "device 0: refused 30 datagrams, the last one from 10.0.0.66:40000: no motion connection is open",
            "device 0: refused 30 datagrams, the last one from 10.0.0.66:40000: no motion connection is open",
            "device 0: refused 30 datagrams, the last one from 10.0.0.66:40000: no motion connection is open",
        ]
    );
    rig.connect(long_moves());
    let sent = record(&mut rig, 1);
    rig.run(millis(20_000));
    rig.run_for(DurationNs::from_secs(70));
    let before = rig.told().lines().count();
    let last = sent.borrow_mut().pop_front().expect("a datagram of the controller");
    rig.inject_datagram(&last, OWNER);
    rig.run_for(DurationNs::from_secs(5));
    assert_eq!(rig.told().lines().count(), before, "{}", rig.told());
}
