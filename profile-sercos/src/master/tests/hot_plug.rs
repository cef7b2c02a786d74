//! Slaves that come in by hot plug, against the crate's slave role and under the checker.

use super::full_slaves::{configured, mirror};
use super::ring::{RingRig, ring_config};
use super::*;
use crate::checker::checked_bus::Tried as _;
use crate::checker::light::{COMMAND, Mirror};
use crate::checker::{Offender, Violation};
use crate::master::config::Ports;
use crate::master::event::{HotPlugRefusal, Invalid};
use crate::master::layout::{ConnectionNeed, SlaveNeed};
use crate::master::topology::Topology;
use crate::slave::phase::State as SlaveState;
use crate::slave::{self, Network, Slave};
use crate::wire::scp::{ScpClass, ScpEntry};

const CLASSES: &[ScpEntry] = &[
    ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
    ScpEntry { class: ScpClass::SYNC, version: 1 },
    ScpEntry { class: ScpClass::NRT, version: 1 },
    ScpEntry { class: ScpClass::HOT_PLUG, version: 1 },
];

/// A slave with SCP_HP.
fn pluggable(address: u16) -> Slave<Mirror> {
    let config = slave::Config { address, classes: CLASSES, ..slave::Config::default() };
    Slave::new(&config, Mirror::default())
}

/// A slave that may come later: six bytes for each of its connections, C-CON and four.
fn later(address: u16) -> SlaveConfig {
    let need = |instance, slave_produces| ConnectionNeed { instance, slave_produces, len: 6 };
    let room = SlaveNeed {
        connections: [need(0, false), need(1, true)].into_iter().collect(),
        ..SlaveNeed::default()
    };
    SlaveConfig { hot_plug: Some(room), ..configured(address) }
}

fn plug_config(there: &[u16], to_come: &[u16], ports: Ports) -> MasterConfig {
    let there = there.iter().map(|&address| configured(address));
    MasterConfig {
        slaves: there.chain(to_come.iter().map(|&address| later(address))).collect(),
        ports,
        close_cycles: 20,
        ..config(&[])
    }
}

/// A line on port 1 in CP4, with values going round.
fn line(there: &[u16], to_come: &[u16]) -> RingRig {
    let network = Network::line(there.iter().map(|&address| pluggable(address)).collect());
    let mut rig = RingRig::new(plug_config(there, to_come, Ports::One), network);
    rig.up();
    rig
}

/// Plugs a slave in behind the last one.
fn plug(rig: &mut RingRig, slave: Slave<Mirror>) {
    let cable = rig.network.slaves().len();
    rig.network.append(slave);
    rig.network.mend(cable);
}

fn plugged(address: u16) -> impl Fn(&RingRig) -> bool {
    move |rig| {
        rig.log.iter().any(|event| matches!(event, Event::HotPlugged { address: a, .. } if *a == address))
    }
}

fn refusals(rig: &RingRig) -> Vec<(Option<u16>, HotPlugRefusal)> {
    let refused = rig.log.iter().filter_map(|event| match event {
        Event::HotPlugRefused { address, reason } => Some((*address, *reason)),
        _ => None,
    });
    refused.collect()
}

#[test]
fn a_slave_that_is_plugged_in_takes_part() {
    let mut rig = line(&[1, 2], &[7]);
    assert_eq!(rig.gaps()[..2], [0, 0]);
    let layout = rig.master.layout().clone();
    plug(&mut rig, pluggable(7));
    rig.run_until("plugged in", plugged(7));
    assert_eq!(rig.gaps()[..2], [0, 0], "nobody loses a cycle: {:?}", rig.told());
    rig.cycles(5);
    rig.forget();
    rig.cycles(50);
    assert_eq!(rig.gaps(), [0, 0, 0], "{:?}", rig.told());
    assert_eq!(rig.master.layout(), &layout, "no telegram has changed");
    assert_eq!(rig.told(), Vec::<String>::new());
}

/// Nobody loses a cycle any more, and every command value arrives.
fn runs(rig: &mut RingRig) {
    rig.cycles(20);
    rig.forget();
    rig.cycles(30);
    assert!(rig.gaps().iter().all(|&gap| gap == 0), "{:?}: {:?}", rig.gaps(), rig.told());
    assert!(rig.commands_arrive().iter().all(|&arrives| arrives), "{:?}", rig.told());
}

#[test]
fn slaves_come_in_one_after_the_other_in_any_order() {
    for order in [[7, 8, 9], [9, 7, 8]] {
        let mut rig = line(&[1], &[7, 8, 9]);
        for address in order {
            plug(&mut rig, pluggable(address));
            rig.run_until("plugged in", plugged(address));
            assert_eq!(rig.gaps()[0], 0, "{:?}", rig.told());
        }
        runs(&mut rig);
    }
}

#[test]
fn several_slaves_that_are_plugged_in_at_once_come_in_one_after_the_other() {
    let mut rig = line(&[1, 2], &[7, 8, 9]);
    for address in [8, 9, 7] {
        rig.network.append(pluggable(address));
    }
    for cable in [4, 3, 2] {
        rig.network.mend(cable);
    }
    for address in [8, 9, 7] {
        rig.run_until("plugged in", plugged(address));
    }
    assert_eq!((rig.gaps()[..2].to_vec(), refusals(&rig)), (vec![0, 0], vec![]));
    runs(&mut rig);
}

/// A network of which `there` are there, by place, and the others switched off.
fn partly(addresses: &[u16], there: &[usize], ports: Ports, ring: bool) -> RingRig {
    let slaves = addresses.iter().map(|&address| pluggable(address)).collect();
    let mut network = if ring { Network::ring(slaves) } else { Network::line(slaves) };
    let (mut now, mut then) = (Vec::new(), Vec::new());
    for (index, &address) in addresses.iter().enumerate() {
        network.set_power(index, there.contains(&index));
        if there.contains(&index) { now.push(address) } else { then.push(address) }
    }
    RingRig::new(plug_config(&now, &then, ports), network)
}

#[test]
fn slaves_come_in_at_the_end_of_a_line_on_port_2() {
    for ports in [Ports::Two, Ports::Both] {
        let mut rig = partly(&[8, 7, 2, 1], &[2, 3], ports, true);
        rig.network.cut(0);
        rig.up();
        assert_eq!(rig.master.topology(), Topology::LineTwo);
        for (index, address) in [(1, 7), (0, 8)] {
            rig.network.set_power(index, true);
            rig.run_until("plugged in", plugged(address));
            assert!(rig.gaps()[..2].iter().all(|&gap| gap == 0), "{:?}", rig.told());
        }
        runs(&mut rig);
        if ports == Ports::Two {
            continue;
        }
        // The last one reaches the master's port 1: the ring is closed, and the delays are measured as in a ring.
        rig.network.mend(0);
        rig.run_until("measured", |rig| rig.log.contains(&Event::Measured { slaves: 4 }));
        assert_eq!(rig.master.topology(), Topology::Ring, "{:?}", rig.told());
        runs(&mut rig);
        rig.network.cut(2);
        rig.cycles(10);
        let text = "no connection between the slave with address 7 and the slave with address 2";
        assert!(rig.told().iter().any(|told| told == text), "{:?}", rig.told());
    }
}

#[test]
fn a_slave_comes_in_at_the_masters_own_port() {
    for (addresses, there, new) in [([1, 2, 7], [0, 1], 2), ([7, 2, 1], [1, 2], 0)] {
        let mut rig = partly(&addresses, &there, Ports::Both, true);
        rig.up();
        rig.network.cut(if new == 2 { 2 } else { 1 });
        rig.network.set_power(new, true);
        rig.run_until("plugged in", plugged(7));
        assert!(rig.gaps()[..2].iter().all(|&gap| gap == 0), "{:?}", rig.told());
        assert_eq!(rig.master.topology(), Topology::BrokenRing);
        runs(&mut rig);
        rig.network.mend(if new == 2 { 2 } else { 1 });
        rig.run_until("measured", |rig| rig.log.contains(&Event::Measured { slaves: 3 }));
        assert_eq!(rig.master.topology(), Topology::Ring);
        runs(&mut rig);
    }
}

#[test]
fn slaves_come_in_on_both_sides_of_a_gap() {
    let mut rig = partly(&[1, 7, 8, 2], &[0, 3], Ports::Both, true);
    rig.network.cut(2);
    rig.up();
    assert_eq!(rig.master.topology(), Topology::BrokenRing);
    rig.network.set_power(1, true);
    rig.network.set_power(2, true);
    for address in [7, 8] {
        rig.run_until("plugged in", plugged(address));
    }
    assert!(rig.gaps()[..2].iter().all(|&gap| gap == 0), "{:?}", rig.told());
    runs(&mut rig);
    rig.network.mend(2);
    rig.run_until("measured", |rig| rig.log.contains(&Event::Measured { slaves: 4 }));
    assert!(rig.log.contains(&Event::RingClosed));
    runs(&mut rig);
}

#[test]
fn one_address_on_both_sides_of_a_gap_comes_in_once() {
    let mut network = Network::ring([1, 7, 7, 2].map(pluggable).into_iter().collect());
    network.cut(2);
    network.set_power(1, false);
    network.set_power(2, false);
    let mut rig = RingRig::new(plug_config(&[1, 2], &[7], Ports::Both), network);
    rig.up();
    rig.network.set_power(1, true);
    rig.network.set_power(2, true);
    rig.run_until("plugged in", plugged(7));
    // The other one did not hear what was meant for this one.
    let there = |rig: &RingRig| {
        let state = |index: usize| rig.network.slaves()[index].state();
        [1, 2].map(|index| state(index) == SlaveState::In(Phase::CP4))
    };
    assert_eq!(there(&rig), [true, false]);
    rig.cycles(100);
    assert_eq!((there(&rig), rig.gaps()[..2].to_vec()), ([true, false], vec![0, 0]));
}

#[test]
fn the_gap_is_closed_by_a_slave_that_is_plugged_in_on_both_sides() {
    // Also where the slave was there before: in a ring it is lost alone, and the ring is whole again afterwards.
    for there_before in [false, true] {
        let there: &[usize] = if there_before { &[0, 1, 2, 3] } else { &[0, 1, 3] };
        let mut rig = partly(&[1, 2, 7, 3], there, Ports::Both, true);
        rig.up();
        let new = if there_before { 2 } else { 3 };
        rig.network.set_power(2, false);
        rig.cycles(20);
        let others = |rig: &RingRig| {
            let gaps = rig.gaps().into_iter().enumerate().filter(|(index, _)| *index != new);
            gaps.map(|(_, gap)| gap).collect::<Vec<_>>()
        };
        assert!(others(&rig).iter().all(|&gap| gap <= 1));
        rig.forget();
        rig.network.set_power(2, true);
        rig.run_until("plugged in", plugged(7));
        rig.run_until("closed", |rig| rig.log.contains(&Event::RingClosed));
        rig.run_until("measured", |rig| rig.log.contains(&Event::Measured { slaves: 4 }));
        assert!(others(&rig).iter().all(|&gap| gap <= 1), "{:?}", rig.told());
        runs(&mut rig);
    }
}

#[test]
fn a_slave_can_be_unplugged_and_plugged_in_again() {
    let mut rig = line(&[1, 2], &[7]);
    plug(&mut rig, pluggable(7));
    rig.run_until("plugged in", plugged(7));
    for round in 0..4 {
        rig.forget();
        rig.network.cut(2);
        rig.cycles(30 + round);
        let lost = Event::SlaveLost { slave: SlaveId(2), address: 7, phase: Phase::CP4 };
        assert!(rig.log.contains(&lost), "{:?}", rig.told());
        let open = "no connection between the slave with address 2 and the slave with address 7";
        assert!(rig.told().iter().any(|told| told == open), "{:?}", rig.told());
        rig.network.mend(2);
        rig.run_until("plugged in again", plugged(7));
        assert_eq!(rig.gaps()[..2], [0, 0]);
        runs(&mut rig);
    }
    // Another device with the same address takes the place.
    rig.network.cut(2);
    rig.network.set_power(2, false);
    rig.cycles(20);
    let mut other = Network::line(vec![pluggable(7)]);
    std::mem::swap(&mut rig.network.slaves_mut()[2], &mut other.slaves_mut()[0]);
    rig.network.set_power(2, true);
    rig.network.mend(2);
    rig.forget();
    rig.run_until("the other one", plugged(7));
    runs(&mut rig);
}

#[test]
fn a_tail_that_was_cut_off_comes_back() {
    // However long the cable was cut; nothing in the configuration is needed where the slaves have SCP_HP.
    for cycles in [1, 3, 8, 12, 100] {
        let mut rig = line(&[1, 2, 3, 4], &[]);
        rig.network.cut(2);
        rig.cycles(cycles);
        rig.network.mend(2);
        for address in [3, 4] {
            rig.run_until("plugged in", plugged(address));
        }
        assert_eq!(rig.gaps()[..2], [0, 0], "{cycles}: {:?}", rig.told());
        runs(&mut rig);
    }
}

/// The class that lets a slave come in is its own: an attempt that fails before it was read again does not take it away.
#[test]
fn a_slave_whose_way_in_has_failed_is_let_in_later_without_a_place_in_the_configuration() {
    let mut out = Vec::new();
    for cycles in 0..60 {
        let mut rig = line(&[1, 2, 3], &[]);
        rig.network.cut(2);
        rig.cycles(20);
        rig.network.mend(2);
        rig.cycles(cycles);
        rig.network.cut(2);
        rig.cycles(60);
        rig.network.mend(2);
        rig.forget();
        rig.cycles(1_500);
        if !plugged(3)(&rig) {
            out.push(cycles);
        }
    }
    assert_eq!(out, [0; 0]);
}

#[test]
fn a_tail_without_hot_plug_stays_out_and_is_named() {
    let network = Network::line((1..=4).map(mirror).collect());
    let mut rig = RingRig::new(MasterConfig { ports: Ports::One, ..ring_config(4) }, network);
    rig.up();
    rig.network.cut(2);
    rig.cycles(20);
    rig.network.mend(2);
    rig.cycles(1000);
    assert_eq!(refusals(&rig), [(Some(3), HotPlugRefusal::NoTelegram)]);
    assert_eq!(rig.gaps()[..2], [0, 0]);
    // CP0 finds them.
    rig.master.set_target_phase(Phase::CP0);
    rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
    rig.up();
    runs(&mut rig);
}

#[test]
fn there_is_no_hot_plug_in_a_closed_ring() {
    let slaves = || [1, 2, 3].map(pluggable).into_iter().collect();
    let mut rig = RingRig::new(plug_config(&[1, 2, 3], &[7], Ports::Both), Network::ring(slaves()));
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("in CP4", |rig| rig.master.state() == State::Cp4);
    // The checker would see hot plug.
    rig.cycles(100);
    assert_eq!(refusals(&rig), [(Some(7), HotPlugRefusal::RingClosed)]);
    assert!(rig.log.contains(&Event::PlaceKept { address: 7 }));
    // Once it is open, a slave comes in at its end, and the closed ring is told of again.
    rig.network.cut(3);
    plug_at_the_end(&mut rig, 7);
    rig.forget();
    rig.network.cut(1);
    rig.cycles(20);
    assert_eq!(refusals(&rig), []);
}

/// The cable to the master's port 2 is open: a slave is plugged in there, and closes the ring.
fn plug_at_the_end(rig: &mut RingRig, address: u16) {
    plug(rig, pluggable(address));
    rig.run_until("plugged in", plugged(address));
    let last = rig.network.slaves().len();
    rig.network.mend(last);
    rig.run_until("closed", |rig| rig.log.contains(&Event::RingClosed));
    runs(rig);
}

/// What is done to the network, or to what comes back from it.
type Harm = Box<dyn Fn(&mut RingRig)>;

/// A slave that is no good is plugged in. The refusal must come, nobody else may lose more than `lost` cycles, and once
/// it is unplugged a good slave comes in.
fn refused(
    what: &str,
    bad: Slave<Mirror>,
    harm: Harm,
    wanted: (Option<u16>, HotPlugRefusal),
    lost: u32,
) -> RingRig {
    let mut rig = line(&[1, 2], &[7, 8]);
    plug(&mut rig, bad);
    harm(&mut rig);
    let told = |rig: &RingRig| !refusals(rig).is_empty();
    rig.run_until(what, told);
    rig.cycles(300);
    assert_eq!(refusals(&rig), [wanted], "{what}: {:?}", rig.told());
    assert!(rig.gaps()[..2].iter().all(|&gap| gap <= lost), "{what}: {:?}", rig.gaps());
    let presence =
        rig.master.slave_by_address(7).and_then(|slave| rig.master.slave(slave)).map(|info| info.presence);
    assert_eq!(presence, None, "{what}");
    // Another one in its place.
    rig.network.cut(2);
    rig.auto_proceed = true;
    rig.tamper = Box::new(|_, _| true);
    rig.cycles(20);
    let mut good = Network::line(vec![pluggable(8)]);
    std::mem::swap(&mut rig.network.slaves_mut()[2], &mut good.slaves_mut()[0]);
    rig.network.set_power(2, false);
    rig.network.set_power(2, true);
    rig.network.mend(2);
    rig.before = std::mem::take(&mut rig.log);
    rig.forget();
    rig.run_until(what, plugged(8));
    assert_eq!(rig.gaps()[..2], [0, 0], "{what}");
    rig.cycles(20);
    rig.forget();
    rig.cycles(20);
    assert_eq!([rig.gaps()[0], rig.gaps()[1], rig.gaps()[3]], [0; 3], "{what}");
    rig
}

fn nothing() -> Harm {
    Box::new(|_| {})
}

#[test]
fn addresses_that_do_not_belong_there() {
    use HotPlugRefusal as R;
    for (address, told, reason) in [
        (9, Some(9), R::Unknown),
        (1, Some(1), R::Duplicate),
        (2, Some(2), R::Duplicate),
        (0, None, R::NoAddress),
    ] {
        refused(&format!("{address}"), pluggable(address), nothing(), (told, reason), 0);
    }
}

#[test]
fn a_slave_without_the_class_is_told_of() {
    refused("no SCP_HP", mirror(7), nothing(), (None, HotPlugRefusal::NoTelegram), 0);
}

/// Changes AT0 of CP4 on its way to the master.
fn in_at0(rig: &mut RingRig, change: impl Fn(&mut [u8]) + 'static) {
    rig.tamper = Box::new(move |_, frame| {
        if frame[14] & 0x4F == 0x40 && frame[15] & 0x8F == 4 {
            change(&mut frame[HEADER_LEN..]);
        }
        true
    });
}

#[test]
fn answers_in_the_hot_plug_field_that_are_no_good() {
    use HotPlugRefusal as R;
    type Change = fn(u16) -> u16;
    // Status word of the answer, by what the slave says itself.
    let cases: [(&str, Option<u16>, R, Change); 7] =
        [
            ("nothing at all", None, R::Silent, |_| 0),
            ("an unknown code", None, R::Silent, |_| 0x33),
            ("a failed scan", None, R::Scan { code: 5 }, |_| 0x105),
            ("no offset in the MDT", Some(7), R::Offset { code: 0x80 }, |word| {
                if word == 0x80 { 0x180 } else { word }
            }),
            ("no offset in the AT", Some(7), R::Offset { code: 0x81 }, |word| {
                if word == 0x81 { 0x181 } else { word }
            }),
            ("silence after the scan", Some(7), R::Silent, |word| if word == 0x80 { 0 } else { word }),
            ("the switch is refused", Some(7), R::Switch, |word| if word == 0x81 { 0x102 } else { word }),
        ];
    for (what, address, reason, change) in cases {
        let harm: Harm = Box::new(move |rig| {
            in_at0(rig, move |data| {
                let word = u16::from_le_bytes([data[2], data[3]]);
                if word != 0 {
                    data[2..4].copy_from_slice(&change(word).to_le_bytes());
                }
            });
        });
        if what == "the switch is refused" {
            // It must be told where the offsets have been taken: the answer stays as it was.
            let harm: Harm = Box::new(|rig| {
                let armed = std::cell::Cell::new(0);
                in_at0(rig, move |data| {
                    if u16::from_le_bytes([data[2], data[3]]) == 0x81 {
                        armed.set(1);
                    } else if armed.get() == 1 {
                        data[2..4].copy_from_slice(&0x102u16.to_le_bytes());
                    }
                });
            });
            refused(what, pluggable(7), harm, (address, reason), 0);
            continue;
        }
        refused(what, pluggable(7), harm, (address, reason), 0);
    }
    // A second slave in the device.
    let harm: Harm = Box::new(|rig| {
        in_at0(rig, |data| {
            if data[1] & 0xF0 == 0x10 {
                data[..2].copy_from_slice(&0x1008u16.to_le_bytes());
            }
        });
    });
    refused("a device of two", pluggable(7), harm, (Some(7), R::Several), 0);
}

#[test]
fn a_slave_that_cannot_be_set_up() {
    use HotPlugRefusal as R;
    let checked = |phase| {
        let config = slave::Config { address: 7, classes: CLASSES, ..slave::Config::default() };
        Slave::new(&config, Mirror { refuses: Some(phase) })
    };
    for phase in [Phase::CP3, Phase::CP4] {
        let before = Phase(phase.0 - 1);
        let rig = refused("a check", checked(phase), nothing(), (Some(7), R::SetUp), 0);
        let invalid = Invalid::from_iter([crate::checker::light::MODE]);
        let failed = Event::CheckFailed { slave: SlaveId(2), phase: before, invalid };
        assert!(rig.before.contains(&failed), "{:?}", rig.before);
    }
    // Its service channel falls silent in the middle of HP2.
    let harm: Harm = Box::new(|rig| {
        let at = usize::from(rig.master.layout().slaves[2].as_ref().unwrap().svc_at.offset);
        let steps = std::cell::Cell::new(0);
        in_at0(rig, move |data| {
            steps.set(steps.get() + u32::from(data[at] != 0));
            if steps.get() > 60 {
                data[at..at + 6].fill(0);
            }
        });
    });
    refused("silence in HP2", pluggable(7), harm, (Some(7), R::SetUp), 0);
}

#[test]
fn a_slave_that_needs_more_than_was_kept() {
    let mut config = plug_config(&[1], &[7], Ports::One);
    config.slaves[1].hot_plug.as_mut().unwrap().connections[1].len = 4;
    let mut rig = RingRig::new(config, Network::line(vec![pluggable(1)]));
    rig.up();
    plug(&mut rig, pluggable(7));
    rig.run_until("refused", |rig| !refusals(rig).is_empty());
    let misfit = crate::master::hot_plug::Misfit::Connection { instance: 1, needed: 6, room: 4 };
    assert_eq!(refusals(&rig), [(Some(7), HotPlugRefusal::Misfit(misfit))]);
    assert_eq!(rig.gaps()[0], 0);
}

#[test]
fn the_application_can_leave_a_slave_out() {
    for phase in [Phase::CP2, Phase::CP3] {
        let mut rig = line(&[1, 2], &[7]);
        rig.auto_proceed = false;
        plug(&mut rig, pluggable(7));
        let awaits = move |rig: &RingRig, phase: Phase| {
            rig.log.contains(&Event::HotPlugAwaits { slave: SlaveId(2), address: 7, phase })
        };
        rig.run_until("awaited", |rig| awaits(rig, Phase::CP2));
        let request = SvcRequest::read(Idn::standard(1040));
        assert!(rig.master.svc_submit(SlaveId(2), request).is_ok(), "its service channel can be used");
        assert_eq!(rig.master.slave(SlaveId(2)).unwrap().presence, Presence::Joining);
        rig.cycles(50);
        assert!(
            rig.log.iter().any(
                |event| matches!(event, Event::Svc { outcome, .. } if outcome.data.unsigned() == Some(7))
            )
        );
        if phase == Phase::CP3 {
            rig.master.proceed_hot_plug(SlaveId(2)).unwrap();
            assert_eq!(rig.master.proceed_hot_plug(SlaveId(2)), Err(CallError::State), "once");
            rig.run_until("awaited", |rig| awaits(rig, Phase::CP3));
            let late = rig.master.set_connections(SlaveId(2), configured(7).connections);
            assert_eq!(late, Err(CallError::State));
        }
        rig.master.exclude(SlaveId(2)).unwrap();
        rig.cycles(30);
        assert_eq!(refusals(&rig), [(Some(7), HotPlugRefusal::Application)]);
        assert_eq!(rig.gaps()[..2], [0, 0]);
        assert_eq!(rig.master.exclude(SlaveId(2)), Err(CallError::State));
        assert_eq!(rig.network.slaves()[2].state(), SlaveState::Nrt);
        // After a while it is tried again.
        rig.auto_proceed = true;
        rig.run_until("plugged in", plugged(7));
        assert_eq!(rig.gaps()[..2], [0, 0]);
    }
}

#[test]
fn two_slaves_with_one_address_get_no_command_value() {
    // In a row they hear the same: the second one is on the first one's service channel all the way.
    let mut rig = line(&[1, 2], &[7]);
    rig.network.append(pluggable(7));
    rig.network.append(pluggable(7));
    rig.network.mend(3);
    rig.network.mend(2);
    // The checker sees the second one write where the first one has its place.
    let shadow = |violation: &Violation| violation.offender == Offender::Slave(515);
    rig.breaking(shadow, |rig| rig.run_until("refused", |rig| !refusals(rig).is_empty()));
    assert_eq!(refusals(&rig), [(Some(7), HotPlugRefusal::Shadow)]);
    rig.tolerating(shadow, |rig| rig.cycles(3000));
    assert_eq!(refusals(&rig)[1..], [(None, HotPlugRefusal::Occupied)]);
    assert_eq!(rig.gaps()[..2], [0, 0]);
    for slave in &rig.network.slaves()[2..] {
        let told = slave.store().number_of(COMMAND);
        assert_eq!(told, 0, "nobody moves");
    }
    // Unplugged they fall back, and one of them alone comes in.
    rig.network.cut(2);
    rig.network.cut(3);
    rig.cycles(50);
    rig.network.mend(2);
    rig.forget();
    rig.run_until("plugged in", plugged(7));
    assert_eq!(rig.gaps()[..2], [0, 0]);
}

#[test]
fn a_slave_that_goes_again_on_its_way_in() {
    // Unplugged, or in NRT again, so many cycles after it was plugged in: in every stage.
    for nrt in [false, true] {
        for cycles in (5..400).step_by(7) {
            let mut rig = line(&[1, 2], &[7]);
            plug(&mut rig, pluggable(7));
            rig.cycles(cycles);
            if plugged(7)(&rig) {
                break;
            }
            if nrt {
                rig.network.slaves_mut()[2].restart();
            } else {
                rig.network.cut(2);
            }
            rig.cycles(60);
            // Two cycles, and in the third one the counter has gone on by three.
            let lost = if nrt { 3 } else { 0 };
            assert!(rig.gaps()[..2].iter().all(|&gap| gap <= lost), "{nrt} {cycles}: {:?}", rig.gaps());
            assert!([1, 2].iter().all(|&address| {
                rig.master.slave(rig.master.slave_by_address(address).unwrap()).unwrap().presence
                    == Presence::Active
            }));
            rig.network.mend(2);
            rig.forget();
            rig.run_until("plugged in", plugged(7));
            assert_eq!(rig.gaps()[..2], [0, 0], "{nrt} {cycles}: {:?}", rig.told());
        }
    }
}

#[test]
fn the_line_in_front_can_be_cut_at_any_time() {
    for cycles in (5..400).step_by(11) {
        let mut rig = line(&[1, 2, 3], &[7]);
        plug(&mut rig, pluggable(7));
        rig.cycles(cycles);
        rig.network.cut(1);
        rig.cycles(40);
        assert_eq!(rig.gaps()[0], 0, "{cycles}: {:?}", rig.told());
        rig.forget();
        rig.network.mend(1);
        for address in [2, 3, 7] {
            rig.run_until("plugged in", plugged(address));
        }
        assert_eq!(rig.gaps()[0], 0, "{cycles}: {:?}", rig.told());
        rig.cycles(20);
        rig.forget();
        rig.cycles(20);
        assert_eq!(rig.gaps(), [0; 4], "{cycles}");
    }
}

#[test]
fn the_network_can_go_down_at_any_time() {
    for cycles in (5..400).step_by(13) {
        let mut rig = line(&[1, 2], &[7]);
        plug(&mut rig, pluggable(7));
        rig.cycles(cycles);
        rig.forget();
        rig.master.set_target_phase(Phase::CP0);
        rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
        assert!(
            !rig.log.iter().any(|event| matches!(event, Event::SwitchFailed { .. })),
            "{cycles}: {:?}",
            rig.told()
        );
        rig.up();
        assert_eq!(rig.master.slaves().count(), 3, "{cycles}");
        runs(&mut rig);
    }
}

#[test]
fn lost_telegrams_do_not_keep_a_slave_out() {
    for every in [5, 9, 23] {
        let mut rig = line(&[1, 2], &[7]);
        let count = std::cell::Cell::new(0u32);
        rig.tamper = Box::new(move |_, frame| {
            count.set(count.get() + u32::from(frame[14] & 0x40 != 0));
            frame[14] & 0x40 == 0 || !count.get().is_multiple_of(every)
        });
        plug(&mut rig, pluggable(7));
        rig.run_until("plugged in", plugged(7));
        assert!(rig.master.slaves().all(|slave| slave.presence == Presence::Active));
    }
}
