//! Stations that hang with their links up: found by loopback commands, and left out.

use std::cell::RefCell;
use std::rc::Rc;

use super::full_slaves::mirror;
use super::ring::{RingRig, ring_config};
use super::*;
use crate::master::config::Ports;
use crate::master::topology::Topology;
use crate::slave::Network;

/// For each slave the cycles in a row, at most, in which no AT with its data came to the master.
fn run(rig: &mut RingRig, cycles: usize) -> Vec<u32> {
    let places = rig.master.layout().slaves.iter().map(|places| places.as_ref().unwrap().status);
    let places: Vec<_> = places.map(|at| HEADER_LEN + usize::from(at.offset)).collect();
    let heard = Rc::new(RefCell::new(vec![false; places.len()]));
    let ears = heard.clone();
    rig.tamper = Box::new(move |_, frame| {
        for (heard, &at) in ears.borrow_mut().iter_mut().zip(&places) {
            *heard |= frame[14] & 0x40 != 0 && frame[at + 1] & 1 != 0;
        }
        true
    });
    let mut rows = vec![(0, 0); heard.borrow().len()];
    for _ in 0..cycles {
        heard.borrow_mut().fill(false);
        rig.step();
        for ((most, row), &heard) in rows.iter_mut().zip(heard.borrow().iter()) {
            *row = if heard { 0 } else { *row + 1 };
            *most = (*most).max(*row);
        }
    }
    rig.tamper = Box::new(|_, _| true);
    rows.into_iter().map(|(most, _)| most).collect()
}

/// In CP4, with the losses that a box allows by default.
fn running(count: u16, ports: Ports) -> RingRig {
    let config = MasterConfig { slave_valid_misses: 5, mst_losses: 20, ports, ..ring_config(count) };
    let slaves = (1..=count).map(mirror).collect();
    let network = if ports == Ports::Both { Network::ring(slaves) } else { Network::line(slaves) };
    let mut rig = RingRig::new(config, network);
    rig.up();
    rig
}

fn isolated(position: u16, port: u8, by: &str) -> String {
    format!(
        "slave at position {position} with address {position} passes no telegrams on though its link is up: those from \
         port {port} are turned round in front of it by the slave with address {by}"
    )
}

fn lost(position: u16) -> String {
    format!("slave at position {position} with address {position} was lost in CP4")
}

/// What was told but for connections, and for those who cannot come in by hot plug.
fn news(rig: &RingRig) -> Vec<String> {
    rig.told().into_iter().filter(|text| !text.starts_with("hot plug:")).collect()
}

fn active(rig: &RingRig) -> Vec<u16> {
    let there = rig.master.slaves().filter(|slave| slave.presence == Presence::Active);
    there.map(|slave| slave.address).collect()
}

#[test]
fn one_of_a_ring_hangs_and_the_others_miss_two_to_five_cycles() {
    let cycles: [[u32; 4]; 4] = [[0, 5, 4, 2], [2, 0, 4, 2], [2, 4, 0, 2], [2, 4, 5, 0]];
    for (hung, wanted) in cycles.into_iter().enumerate() {
        let mut rig = running(4, Ports::Both);
        rig.network.set_hung(hung, true);
        let mut gaps = run(&mut rig, 60);
        gaps[hung] = 0;
        assert_eq!(gaps, wanted, "{hung}: {:?}", rig.told());
        let position = u16::try_from(hung).unwrap() + 1;
        let others: Vec<u16> = (1..=4).filter(|&address| address != position).collect();
        assert_eq!(active(&rig), others);
        let mut told = vec!["topology: broken ring, a line on each port".to_string(), lost(position)];
        if hung == 0 {
            told[0] = "topology: line on port 2".to_string();
            told.push(
                "slave at position 1 with address 1 passes no telegrams on: no slave is reached from port 1"
                    .to_string(),
            );
        } else {
            told.push(isolated(position, 1, &(position - 1).to_string()));
        }
        if hung == 3 {
            told[0] = "topology: line on port 1".to_string();
            told.push(
                "slave at position 4 with address 4 passes no telegrams on: no slave is reached from port 2"
                    .to_string(),
            );
        } else {
            told.push(isolated(position, 2, &(position + 1).to_string()));
        }
        assert_eq!(rig.told(), told);
        // And so it stays: every value arrives, nothing more is told.
        rig.forget();
        rig.cycles(500);
        let mut gaps = rig.gaps();
        gaps[hung] = 0;
        assert_eq!((gaps, news(&rig)), (vec![0; 4], vec![]), "{hung}");
        let mut arrive = rig.commands_arrive();
        arrive[hung] = true;
        assert_eq!(arrive, [true; 4]);
    }
}

#[test]
fn those_in_front_of_a_hung_one_in_a_line_go_on() {
    for (ports, hung) in [(Ports::One, 2), (Ports::One, 1), (Ports::Both, 2)] {
        let mut rig = running(3, ports);
        if ports == Ports::Both {
            rig.network.cut(3);
            rig.cycles(10);
            rig.forget();
        }
        rig.network.set_hung(hung, true);
        let gaps = run(&mut rig, 40);
        let hung = u16::try_from(hung).unwrap();
        assert_eq!(active(&rig), (1..=hung).collect::<Vec<_>>(), "{:?}", rig.told());
        assert_eq!(gaps[..usize::from(hung)], [2, 4][..usize::from(hung)]);
        let lost = (hung + 1..=3).map(lost);
        let told: Vec<_> = lost.chain([isolated(hung + 1, 1, &hung.to_string())]).collect();
        assert_eq!(rig.told(), told);
        rig.forget();
        rig.cycles(300);
        assert_eq!((&rig.gaps()[..usize::from(hung)], news(&rig)), (&[0, 0][..usize::from(hung)], vec![]));
    }
}

#[test]
fn the_first_of_a_line_leaves_nobody() {
    let mut rig = running(3, Ports::One);
    rig.network.set_hung(0, true);
    rig.run_until("given up", |rig| rig.log.contains(&Event::AllSlavesLost));
    assert_eq!(rig.told(), [lost(1), lost(2), lost(3), "all slaves are lost".to_string()]);
    // Phase 0 has no C-DEV: nobody can be asked there, and that is said.
    rig.run_until("searched", |rig| rig.log.contains(&Event::NoSlaves));
    assert_eq!(rig.master.state(), State::Scan);
    rig.network.set_hung(0, false);
    rig.up();
    rig.cycles(10);
    assert_eq!(rig.gaps(), [0; 3]);
}

#[test]
fn two_that_hang_lose_those_between_them_and_no_others() {
    let mut rig = running(6, Ports::Both);
    rig.network.set_hung(1, true);
    rig.network.set_hung(3, true);
    let gaps = run(&mut rig, 60);
    assert_eq!(active(&rig), [1, 5, 6]);
    assert_eq!([0, 4, 5].map(|index: usize| gaps[index]), [2, 4, 2], "{:?}", rig.told());
    assert_eq!(rig.told()[4..], [isolated(2, 1, "1"), isolated(4, 2, "5")]);
    // One after the other: the second one is in what is a line by then.
    let mut rig = running(6, Ports::Both);
    rig.network.set_hung(4, true);
    rig.cycles(60);
    rig.forget();
    rig.network.set_hung(2, true);
    let gaps = run(&mut rig, 60);
    assert_eq!(active(&rig), [1, 2, 6]);
    assert_eq!([0, 1, 5].map(|index: usize| gaps[index]), [2, 4, 0]);
    assert_eq!(rig.told(), [lost(3), lost(4), isolated(3, 1, "2")]);
}

#[test]
fn slaves_that_take_their_time_are_waited_for() {
    // A command takes effect so many cycles later, and each station is asked when the one before is there.
    for (delay, wanted) in [(1, [3, 0, 7, 3]), (2, [4, 0, 10, 4]), (3, [5, 0, 13, 5]), (10, [12, 0, 34, 12])]
    {
        let mut rig = running(4, Ports::Both);
        for slave in rig.network.slaves_mut() {
            slave.set_command_delay(delay);
        }
        rig.network.set_hung(1, true);
        let mut gaps = run(&mut rig, 100);
        gaps[1] = 0;
        assert_eq!(gaps, wanted, "{delay}: {:?}", rig.told());
        assert_eq!(active(&rig), [1, 3, 4], "{delay}: {:?}", rig.told());
        let found = [isolated(2, 1, "1"), isolated(2, 2, "3")];
        assert!(found.iter().all(|found| rig.told().contains(found)), "{delay}: {:?}", rig.told());
        rig.forget();
        rig.cycles(100);
        let mut gaps = rig.gaps();
        gaps[1] = 0;
        assert_eq!((gaps, news(&rig)), (vec![0; 4], vec![]), "{delay}");
    }
}

#[test]
fn the_far_ones_of_a_long_ring_come_back_by_themselves() {
    let mut rig = running(20, Ports::Both);
    rig.network.set_hung(1, true);
    let gaps = run(&mut rig, 80);
    let there: Vec<u16> = (1..=20).filter(|&address| address != 2).collect();
    assert_eq!(active(&rig), there);
    // One cycle for each station; those that were lost count again after ten good cycles.
    let wanted: Vec<u32> = (4..=20).rev().chain([2]).collect();
    assert_eq!(gaps[2..], wanted);
    let returned = rig.log.iter().filter(|event| matches!(event, Event::SlaveReturned { .. })).count();
    assert_eq!(returned, 15);
    rig.forget();
    rig.cycles(50);
    let mut gaps = rig.gaps();
    gaps[1] = 0;
    assert_eq!(gaps, [0; 20]);
}

#[test]
fn losses_that_leave_no_time_lose_all_and_bring_them_back() {
    // Two losses: the slaves in the middle are lost before they are found.
    let mut rig = RingRig::running(6);
    rig.network.set_hung(0, true);
    rig.cycles(60);
    assert_eq!(active(&rig), [2, 3, 4, 5, 6]);
    assert_eq!(rig.master.state(), State::Cp4);
    assert_eq!(rig.log.iter().filter(|event| matches!(event, Event::SlaveReturned { .. })).count(), 4);
}

#[test]
fn one_that_wakes_again_is_not_taken_into_a_closed_ring() {
    for asleep in [20, 60, 900] {
        let mut rig = running(4, Ports::Both);
        rig.network.set_hung(1, true);
        rig.cycles(asleep);
        rig.network.set_hung(1, false);
        rig.cycles(60);
        rig.forget();
        rig.cycles(2000);
        assert_eq!(active(&rig), [1, 3, 4], "{asleep}: {:?}", rig.told());
        let mut gaps = rig.gaps();
        gaps[1] = 0;
        assert_eq!((gaps, news(&rig)), (vec![0; 4], vec![]), "{asleep}");
        assert_eq!(rig.master.topology(), Topology::BrokenRing);
        // The next start finds it.
        rig.master.set_target_phase(Phase::CP0);
        rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
        rig.up();
        rig.cycles(20);
        assert_eq!((rig.master.topology(), rig.gaps()), (Topology::Ring, vec![0; 4]));
    }
}

#[test]
fn a_short_sleep_costs_nobody_his_place() {
    for asleep in 1..=14 {
        let mut rig = running(5, Ports::Both);
        rig.network.set_hung(1, true);
        rig.cycles(asleep);
        rig.network.set_hung(1, false);
        rig.run_until("closed", |rig| rig.master.topology() == Topology::Ring && active(rig).len() == 5);
        rig.cycles(60);
        rig.forget();
        rig.cycles(500);
        assert_eq!((rig.gaps(), rig.told()), (vec![0; 5], vec![]), "{asleep}");
        assert_eq!(rig.master.topology(), Topology::Ring, "{asleep}");
    }
}

#[test]
fn cycles_that_the_master_did_not_hear_are_nobodys_fault() {
    for ports in [Ports::Both, Ports::One] {
        for deaf in 1..=5 {
            let mut rig = running(12, ports);
            rig.tamper = Box::new(|_, _| false);
            rig.cycles(deaf);
            // In a line the first slave has turned the telegrams round in vain, for one cycle.
            let mut wanted = [u32::from(deaf >= 2 && ports == Ports::One); 12];
            wanted[0] = 0;
            assert_eq!(run(&mut rig, 40), wanted, "{ports:?} {deaf}");
            assert_eq!(active(&rig).len(), 12, "{ports:?} {deaf}");
            let blamed = |event: &&Event| matches!(event, Event::Isolated { .. } | Event::CableOpen { .. });
            assert_eq!(rig.log.iter().find(blamed), None, "{ports:?} {deaf}");
            let whole = if ports == Ports::Both { Topology::Ring } else { Topology::LineOne };
            assert_eq!(rig.master.topology(), whole);
            rig.forget();
            rig.cycles(200);
            assert_eq!((rig.gaps(), rig.told()), (vec![0; 12], vec![]), "{ports:?} {deaf}");
        }
    }
}

#[test]
fn a_cable_that_carries_nothing_though_its_links_are_up_is_named() {
    for cable in 0..=4u16 {
        let mut rig = running(4, Ports::Both);
        rig.network.set_blocked(usize::from(cable), true);
        rig.cycles(60);
        assert_eq!(active(&rig), [1, 2, 3, 4], "{cable}: {:?}", rig.told());
        if (1..4).contains(&cable) {
            let text = format!(
                "no connection between the slave with address {cable} and the slave with address {}",
                cable + 1
            );
            let mut told = vec!["topology: broken ring, a line on each port".to_string(), text];
            if let Some((_, last)) = [(1, 2), (3, 3)].iter().find(|(at, _)| *at == cable) {
                // It is the last one to be found, after six cycles.
                told.insert(1, lost(*last));
                told.push(format!("slave at position {last} is valid again and takes part"));
            }
            assert_eq!(rig.told(), told);
        }
        rig.forget();
        rig.cycles(50);
        assert_eq!(rig.gaps(), [0; 4]);
        // It carries again: the ring is closed as behind any cut.
        rig.network.set_blocked(usize::from(cable), false);
        rig.cycles(100);
        assert_eq!(rig.master.topology(), Topology::Ring, "{cable}: {:?}", rig.told());
        assert_eq!(active(&rig), [1, 2, 3, 4]);
    }
}

#[test]
fn one_that_hung_comes_in_by_hot_plug_and_the_ring_is_closed() {
    let classes = crate::slave::communication::CLASSES_WITH_HOT_PLUG;
    let slave = |address| {
        let config = crate::slave::Config { address, classes, ..Default::default() };
        crate::slave::Slave::new(&config, crate::checker::light::Mirror::default())
    };
    let mut config = MasterConfig { slave_valid_misses: 5, mst_losses: 20, ..ring_config(4) };
    for slave in &mut config.slaves {
        slave.hot_plug = Some(crate::master::layout::SlaveNeed::default());
    }
    let mut rig = RingRig::new(config, Network::ring((1..=4).map(slave).collect()));
    rig.up();
    rig.network.set_hung(1, true);
    rig.cycles(500);
    assert_eq!(active(&rig), [1, 3, 4]);
    rig.forget();
    // It has not heard the master for long enough to have left: it comes in like a new one.
    rig.network.set_hung(1, false);
    rig.run_until("closed", |rig| rig.log.contains(&Event::RingClosed));
    assert!(rig.log.contains(&Event::HotPlugged { slave: SlaveId(1), address: 2 }), "{:?}", rig.told());
    assert_eq!(active(&rig), [1, 2, 3, 4]);
    let gaps = rig.gaps();
    assert!([0, 2, 3].iter().all(|&index: &usize| gaps[index] <= 1), "{gaps:?}");
    rig.cycles(200);
    rig.forget();
    rig.cycles(300);
    assert_eq!((rig.gaps(), rig.told()), (vec![0; 4], vec![]));
}

#[test]
fn a_link_comes_back_during_the_search() {
    for cable in [0, 1, 3, 4] {
        for cycle in 0..20 {
            let mut rig = running(4, Ports::Both);
            rig.network.cut(cable);
            rig.cycles(10);
            rig.forget();
            // A station of the line on the other side of the cut hangs.
            let hung = if cable < 2 { 2 } else { 1 };
            rig.network.set_hung(hung, true);
            rig.cycles(cycle);
            rig.network.mend(cable);
            rig.cycles(100);
            let others = active(&rig);
            assert!(!others.contains(&(u16::try_from(hung).unwrap() + 1)), "{cable} {cycle}");
            assert!(!others.is_empty(), "{cable} {cycle}: {:?}", rig.told());
            rig.forget();
            rig.cycles(300);
            assert_eq!(active(&rig), others, "{cable} {cycle}");
            let gaps = others.iter().map(|&address| rig.gaps()[usize::from(address) - 1]);
            assert_eq!(gaps.collect::<Vec<_>>(), vec![0; others.len()], "{cable} {cycle}: {:?}", rig.told());
            assert_eq!(news(&rig), Vec::<String>::new(), "{cable} {cycle}");
        }
    }
}

#[test]
fn one_hangs_on_the_way_up() {
    for state in [
        State::Cp1,
        State::Start2,
        State::Read2,
        State::Connect2,
        State::Write2,
        State::Check2,
        State::Start3,
        State::Check3,
        State::Start4,
    ] {
        let mut rig = RingRig::ring(4);
        rig.master.set_target_phase(Phase::CP4);
        rig.run_until("there", |rig| rig.master.state() == state || rig.master.state() == State::Cp4);
        rig.network.set_hung(1, true);
        rig.run_until("up", |rig| rig.master.state() == State::Cp4);
        rig.cycles(20);
        assert_eq!(active(&rig), [1, 3, 4], "{state:?}: {:?}", rig.told());
        assert!(rig.told().contains(&isolated(2, 1, "1")), "{state:?}: {:?}", rig.told());
        rig.forget();
        rig.cycles(20);
        let mut gaps = rig.gaps();
        gaps[1] = 0;
        assert_eq!(gaps, [0; 4], "{state:?}");
    }
}

#[test]
fn one_that_hangs_in_phase_0_is_told_as_far_as_can_be() {
    let mut rig = RingRig::ring(4);
    rig.network.set_hung(1, true);
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("told", |rig| rig.log.contains(&Event::NoSlaves));
    let told = rig.told();
    assert_eq!(
        told.last().unwrap(),
        "no slave answers; with the link up: a station passes no telegrams on, or it is no SERCOS III slave"
    );
    rig.network.set_hung(1, false);
    rig.run_until("up", |rig| rig.master.state() == State::Cp4);
}

/// Whatever happens to cables and slaves one after the other: when it is over, the network comes to rest, and those who were
/// never touched and can be reached take part.
#[test]
fn any_sequence_of_faults_comes_to_rest() {
    let mut state = 1u32;
    let mut dice = move |sides: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        usize::try_from(state >> 16).unwrap() % sides
    };
    for round in 0..150 {
        let mut rig = running(6, if round % 3 == 0 { Ports::One } else { Ports::Both });
        rig.lenient = true;
        let mut script = Vec::new();
        for _ in 0..=dice(4) {
            let (what, place, on) = (dice(4), dice(6), dice(2) == 0);
            script.push((what, place, on));
            match what {
                0 | 1 => rig.network.set_hung(place, on),
                2 => rig.network.set_blocked(place, on),
                _ => rig.network.set_cable(place, on, on),
            }
            rig.cycles(dice(40));
        }
        rig.cycles(300);
        rig.forget();
        rig.cycles(1500);
        let restless = |event: &&Event| {
            matches!(
                event,
                Event::Topology(_) | Event::CableOpen { .. } | Event::RingClosed | Event::Isolated { .. }
            )
        };
        let events: Vec<_> = rig.log.iter().filter(restless).collect();
        assert_eq!(events, Vec::<&Event>::new(), "{script:?}");
        // Mended, the next start has all of them.
        for place in 0..6 {
            rig.network.set_hung(place, false);
            rig.network.set_blocked(place, false);
            rig.network.mend(place);
        }
        rig.master.set_target_phase(Phase::CP0);
        rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
        rig.up();
        rig.cycles(20);
        assert_eq!((rig.gaps(), active(&rig).len()), (vec![0; 6], 6), "{script:?}");
    }
}
