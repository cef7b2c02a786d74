//! The master with two ports against networks of the crate's slaves: lines on either port, rings, cuts and heals.

use super::full_slaves::{configured, mirror};
use super::*;
use crate::checker::checked_bus::{CheckedBus, Tried};
use crate::checker::light::{COMMAND, Mirror};
use crate::master::Master;
use crate::master::config::Ports;
use crate::master::event::End;
use crate::master::topology::Topology;
use crate::slave::Network;
use crate::wire::header::{Channel, Kind};

/// What happens to a frame on its way to the master; false when it does not arrive.
pub(super) type Tamper = Box<dyn FnMut(Port, &mut [u8]) -> bool>;

pub(super) struct RingRig {
    pub now: MonotonicTime,
    pub master: Master,
    pub network: Network<Mirror>,
    checked: CheckedBus,
    pub tamper: Tamper,
    pub log: Vec<Event>,
    /// An older log, where a test keeps it.
    pub before: Vec<Event>,
    /// Cables cut in the middle of a cycle, behind so many frames.
    cut_after: Option<(usize, usize)>,
    /// Refused frames are no failure of the test.
    pub lenient: bool,
    /// Calls `proceed_hot_plug`.
    pub auto_proceed: bool,
    value: i32,
    /// Feedback of each slave, and the cycles in a row that did not bring it.
    missed: Vec<(u32, u32)>,
    /// The same without those whose value was new, though not the next one.
    lost: Vec<(u32, u32)>,
}

pub(super) fn ring_config(count: u16) -> MasterConfig {
    MasterConfig {
        slaves: (1..=count).map(configured).collect(),
        ports: Ports::Both,
        close_cycles: 20,
        ..config(&[])
    }
}

impl Tried for RingRig {
    fn checked(&mut self) -> &mut CheckedBus {
        &mut self.checked
    }
}

impl RingRig {
    pub fn new(config: MasterConfig, network: Network<Mirror>) -> RingRig {
        RingRig {
            now: MonotonicTime::ZERO,
            missed: vec![(0, 0); network.slaves().len().max(config.slaves.len())],
            lost: vec![(0, 0); network.slaves().len().max(config.slaves.len())],
            master: Master::new(config).unwrap(),
            network,
            checked: CheckedBus::new(MonotonicTime::ZERO),
            tamper: Box::new(|_, _| true),
            log: Vec::new(),
            before: Vec::new(),
            cut_after: None,
            lenient: false,
            auto_proceed: true,
            value: 0,
        }
    }

    pub fn ring(count: u16) -> RingRig {
        RingRig::new(ring_config(count), Network::ring((1..=count).map(mirror).collect()))
    }

    /// In CP4 with values going round.
    pub fn running(count: u16) -> RingRig {
        let mut rig = RingRig::ring(count);
        rig.up();
        rig
    }

    pub fn up(&mut self) {
        self.master.set_target_phase(Phase::CP4);
        self.run_until("up", |rig| rig.master.state() == State::Cp4);
        self.cycles(5);
        self.forget();
    }

    pub fn forget(&mut self) {
        self.log.clear();
        self.missed.fill((0, 0));
        self.lost.fill((0, 0));
    }

    pub fn step(&mut self) {
        self.now = self.now.max(self.master.wake_at().unwrap());
        self.network.handle_time(self.now);
        if self.master.state() == State::Cp4 {
            self.value += 1;
            for index in 0..u16::try_from(self.missed.len()).unwrap() {
                if let Some(values) = self.master.producer(SlaveId(index), 0) {
                    values.copy_from_slice(&(self.value * 1000 + i32::from(index)).to_le_bytes());
                    self.master.commit(SlaveId(index), 0);
                }
            }
        }
        let mut out = Vec::new();
        while let Some(Output::Transmit { port, frame }) = self.master.poll(self.now) {
            out.push((port, frame.to_vec()));
        }
        for (sent, (port, mut frame)) in out.into_iter().enumerate() {
            if let Some((cable, _)) = self.cut_after.take_if(|(_, after)| *after == sent) {
                self.network.cut(cable);
            }
            let (now, master, tamper, lenient) = (self.now, &mut self.master, &mut self.tamper, self.lenient);
            let mut arrived = |port, frame: &mut [u8]| {
                if tamper(port, frame) {
                    let taken = master.handle_frame(now, port, frame);
                    assert!(lenient || taken.is_ok(), "{taken:?} on {port}: {:02x?}", &frame[14..16]);
                }
            };
            self.checked.send(now, port, &mut frame, &mut self.network, &mut |_, _, _| {}, &mut arrived);
        }
        self.checked.judge();
        while let Some(event) = self.master.poll_event() {
            if matches!(event, Event::AwaitingApplication { .. }) {
                self.master.proceed().unwrap();
            }
            if let Event::HotPlugAwaits { slave, .. } = event
                && self.auto_proceed
            {
                self.master.proceed_hot_plug(slave).unwrap();
            }
            self.log.push(event);
        }
        let complete = self.master.cycle_complete();
        for (index, (missed, lost)) in (0u16..).zip(self.missed.iter_mut().zip(&mut self.lost)) {
            let consumer =
                self.master.consumer(SlaveId(index), 1).filter(|consumer| consumer.fresh && complete);
            let next = consumer.is_some_and(|consumer| consumer.state == ConsumerState::Consuming);
            for ((most, row), good) in [(missed, next), (lost, consumer.is_some())] {
                *row = if good { 0 } else { *row + 1 };
                *most = (*most).max(*row);
            }
        }
    }

    pub fn cycles(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.step();
        }
    }

    pub fn run_until(&mut self, what: &str, done: impl Fn(&RingRig) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            self.step();
        }
        panic!("never {what}: {:?} at {}, {:#?}", self.master.state(), self.now, self.log);
    }

    /// Longest row of cycles without data, by slave.
    pub fn gaps(&self) -> Vec<u32> {
        self.missed.iter().map(|(most, _)| *most).collect()
    }

    /// Events without those of connections.
    pub fn told(&self) -> Vec<String> {
        let events = self.log.iter().filter(|event| !matches!(event, Event::Connection { .. }));
        events.map(ToString::to_string).collect()
    }

    fn addresses(&self) -> Vec<u16> {
        self.master.slaves().map(|slave| slave.address).collect()
    }

    /// Each slave has the newest or the last command value, and its own.
    pub fn commands_arrive(&self) -> Vec<bool> {
        let value = |index: usize| {
            let address = self.network.slaves()[index].store().number_of(Idn::ADDRESS);
            let place = self.addresses().iter().position(|&other| i64::from(other) == address).unwrap();
            let store = self.network.slaves()[index].store();
            let newest = i64::from(self.value) * 1000 + i64::try_from(place).unwrap();
            (newest - store.number_of(COMMAND)) % 1000 == 0 && newest - store.number_of(COMMAND) <= 1000
        };
        (0..self.network.slaves().len()).map(value).collect()
    }
}

/// Cable `cable` of a ring of `count` slaves as events tell it.
fn cable_text(cable: u16, count: u16) -> String {
    let end = |address: u16, port| match address {
        0 => format!("the master's port {port}"),
        address => format!("the slave with address {address}"),
    };
    let above = if cable == count { 0 } else { cable + 1 };
    format!("no connection between {} and {}", end(cable, 1), end(above, 2))
}

#[test]
fn every_topology_is_found_and_comes_up() {
    let network = || Network::ring((1..=5).map(mirror).collect());
    let defect = |defective| Topology::DefectRing { defective };
    type Change = fn(&mut Network<Mirror>);
    let cases: [(Topology, &[u16], Change); 10] = [
        (Topology::Ring, &[1, 2, 3, 4, 5], |_| {}),
        (Topology::LineOne, &[1, 2, 3, 4, 5], |n| n.cut(5)),
        (Topology::LineTwo, &[5, 4, 3, 2, 1], |n| n.cut(0)),
        (Topology::BrokenRing, &[1, 2, 5, 4, 3], |n| n.cut(2)),
        (Topology::BrokenRing, &[1, 5, 4, 3, 2], |n| n.cut(1)),
        (defect(Channel::Secondary), &[1, 2, 3, 4, 5], |n| n.set_cable(2, true, false)),
        (defect(Channel::Primary), &[1, 2, 5, 4, 3], |n| n.set_cable(2, false, true)),
        (defect(Channel::Primary), &[5, 4, 3, 2, 1], |n| n.set_cable(0, false, true)),
        (defect(Channel::Secondary), &[1, 2, 3, 4, 5], |n| n.set_cable(0, true, false)),
        (Topology::Ring, &[1, 2, 3, 4, 5], |n| {
            n.turn(1);
            n.turn(4);
        }),
    ];
    for (topology, addresses, change) in cases {
        let mut network = network();
        change(&mut network);
        let mut rig = RingRig::new(ring_config(5), network);
        rig.lenient = true;
        rig.up();
        assert_eq!((rig.master.topology(), rig.addresses()), (topology, addresses.to_vec()));
        rig.cycles(20);
        assert_eq!(rig.gaps(), [0; 5], "{topology}");
        assert_eq!(rig.commands_arrive(), [true; 5], "{topology}");
        assert!(rig.told().is_empty(), "{topology}: {:?}", rig.told());
        for (index, slave) in rig.network.slaves().iter().enumerate() {
            let address = u16::try_from(index + 1).unwrap();
            let place = addresses.iter().position(|&other| other == address).unwrap();
            assert_eq!(usize::from(slave.topology_address()), place + 1, "{topology}");
        }
    }
}

#[test]
fn a_line_on_port_2_alone() {
    let mut network = Network::ring((1..=3).map(mirror).collect());
    network.cut(0);
    let mut rig = RingRig::new(MasterConfig { ports: Ports::Two, ..ring_config(3) }, network);
    rig.up();
    rig.cycles(20);
    assert_eq!((rig.addresses(), rig.gaps()), (vec![3, 2, 1], vec![0; 3]));
    assert_eq!(rig.master.topology(), Topology::LineTwo);
    assert_eq!(rig.network.slaves()[0].ports().topology().to_string(), "loopback and forward S");
    rig.network.cut(1);
    rig.cycles(10);
    let lost = Event::SlaveLost { slave: SlaveId(2), address: 1, phase: Phase::CP4 };
    assert!(rig.log.contains(&lost), "{:?}", rig.told());
    assert_eq!(rig.told()[0], "no connection between the slave with address 1 and the slave with address 2");
    assert_eq!(rig.gaps()[..2], [0, 0]);
}

#[test]
fn a_cut_anywhere_costs_at_most_a_cycle_and_is_located() {
    for cable in 0..=4u16 {
        // Six frames: MDT0 P and S, AT0 P and S; the cut comes before each of them.
        for after in 0..4 {
            let mut rig = RingRig::running(4);
            rig.cut_after = Some((usize::from(cable), after));
            rig.cycles(10);
            assert!(rig.gaps().iter().all(|&gap| gap <= 1), "cable {cable} after {after}: {:?}", rig.gaps());
            rig.missed.fill((0, 0));
            rig.cycles(100);
            assert_eq!(rig.gaps(), [0; 4], "cable {cable}");
            assert_eq!(rig.commands_arrive(), [true; 4]);
            let topology = match cable {
                0 => Topology::LineTwo,
                4 => Topology::LineOne,
                _ => Topology::BrokenRing,
            };
            assert_eq!(rig.master.topology(), topology);
            let mut told = rig.told();
            told.sort();
            assert_eq!(told, [cable_text(cable, 4), format!("topology: {topology}")], "after {after}");
            assert!(rig.master.slaves().all(|slave| slave.presence == Presence::Active));
        }
    }
}

#[test]
fn a_mended_cable_closes_the_ring_again() {
    for cable in 0..=4usize {
        let mut rig = RingRig::running(4);
        rig.network.cut(cable);
        rig.cycles(20);
        rig.forget();
        rig.network.mend(cable);
        rig.cycles(15);
        assert_ne!(rig.master.topology(), Topology::Ring, "20 cycles must speak for it");
        rig.cycles(20);
        assert_eq!(rig.master.topology(), Topology::Ring, "cable {cable}: {:?}", rig.told());
        let told = rig.told();
        assert_eq!(told, ["topology: ring", "the ring is closed again"], "cable {cable}");
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "cable {cable}: {:?}", rig.gaps());
        rig.forget();
        rig.cycles(50);
        assert_eq!((rig.gaps(), rig.told().len()), (vec![0; 4], 0));
        assert_eq!(rig.commands_arrive(), [true; 4]);
        // And once more elsewhere.
        rig.network.cut((cable + 2) % 5);
        rig.cycles(10);
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "{:?}", rig.gaps());
        let wanted = cable_text(u16::try_from((cable + 2) % 5).unwrap(), 4);
        assert!(rig.told().contains(&wanted), "{:?}", rig.told());
    }
}

#[test]
fn one_wire_alone_can_break_and_be_mended() {
    for (cable, up) in (0..=3usize).flat_map(|cable| [(cable, true), (cable, false)]) {
        let mut rig = RingRig::running(3);
        rig.network.set_cable(cable, up, !up);
        rig.cycles(30);
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "cable {cable} {up}: {:?}", rig.gaps());
        let defective = if up { Channel::Secondary } else { Channel::Primary };
        assert_eq!(rig.master.topology(), Topology::DefectRing { defective }, "{:?}", rig.told());
        rig.forget();
        rig.network.mend(cable);
        rig.cycles(60);
        assert_eq!(rig.master.topology(), Topology::Ring, "cable {cable} {up}: {:?}", rig.told());
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "cable {cable} {up}: {:?}", rig.gaps());
    }
}

#[test]
fn a_second_cut_loses_the_slaves_between_and_no_others() {
    let mut rig = RingRig::running(6);
    rig.network.cut(2);
    rig.cycles(10);
    rig.forget();
    rig.network.cut(4);
    rig.cycles(10);
    let lost: Vec<_> = rig
        .log
        .iter()
        .filter_map(|event| match event {
            Event::SlaveLost { address, phase, .. } => Some((*address, *phase)),
            _ => None,
        })
        .collect();
    assert_eq!(lost, [(3, Phase::CP4), (4, Phase::CP4)]);
    assert!(rig.told().contains(&cable_text(4, 6)), "{:?}", rig.told());
    assert_eq!([0, 1, 4, 5].map(|index: usize| rig.gaps()[index]), [0; 4]);
    // One cable mended: the two are in the middle of a line, and the ring must not be closed around them.
    rig.network.mend(2);
    rig.cycles(200);
    rig.network.mend(4);
    rig.forget();
    rig.cycles(200);
    assert_eq!(rig.master.topology(), Topology::BrokenRing, "{:?}", rig.told());
    assert_eq!([0, 1, 4, 5].map(|index: usize| rig.gaps()[index]), [0; 4]);
    // A new way up finds all of them.
    rig.master.set_target_phase(Phase::CP0);
    rig.run_until("in CP0", |rig| rig.master.state() == State::Cp0);
    rig.up();
    rig.cycles(20);
    assert_eq!((rig.master.topology(), rig.gaps()), (Topology::Ring, vec![0; 6]));
}

#[test]
fn a_slave_that_is_switched_off_in_a_ring_is_lost_alone() {
    let mut rig = RingRig::running(5);
    rig.network.set_power(2, false);
    rig.cycles(20);
    let told = rig.told();
    let lost = Event::SlaveLost { slave: SlaveId(2), address: 3, phase: Phase::CP4 }.to_string();
    assert!(
        told.contains(&lost) && told.contains(&cable_text(2, 5)) && told.contains(&cable_text(3, 5)),
        "{told:?}"
    );
    assert_eq!([0, 1, 3, 4].map(|index: usize| rig.gaps()[index] <= 1), [true; 4], "{:?}", rig.gaps());
    // It comes back in NRT and passes telegrams on like a switch: the ring is not closed through it.
    rig.network.set_power(2, true);
    rig.forget();
    rig.cycles(300);
    assert_eq!(rig.master.topology(), Topology::BrokenRing, "{:?}", rig.told());
    assert_eq!([0, 1, 3, 4].map(|index: usize| rig.gaps()[index]), [0; 4]);
}

#[test]
fn lost_telegrams_of_one_way_cost_nothing() {
    let mut rig = RingRig::running(3);
    for (port, channel) in [(Port::One, Channel::Secondary), (Port::Two, Channel::Primary)] {
        let mut count = 0u32;
        rig.tamper = Box::new(move |at, _| {
            count += u32::from(at == port);
            at != port || !count.is_multiple_of(4)
        });
        let before = *rig.master.statistics();
        rig.cycles(40);
        rig.tamper = Box::new(|_, _| true);
        rig.cycles(1);
        let after = rig.master.statistics();
        let lost = |port, kind| after.lost(port, kind) - before.lost(port, kind);
        assert_eq!(lost(port, Kind::Mdt) + lost(port, Kind::At), 20, "{channel:?}");
        assert_eq!(lost(port.other(), Kind::Mdt) + lost(port.other(), Kind::At), 0);
        assert_eq!(after.at_missing, before.at_missing);
    }
    assert_eq!((rig.gaps(), rig.told()), (vec![0; 3], vec![]));
    assert_eq!(rig.master.topology(), Topology::Ring);
}

#[test]
fn a_telegram_on_the_wrong_port_is_refused() {
    let mut rig = RingRig::running(3);
    rig.network.cut(3);
    rig.cycles(10);
    assert_eq!(rig.master.topology(), Topology::LineOne);
    rig.forget();
    for _ in 0..20 {
        rig.now = rig.now.max(rig.master.wake_at().unwrap());
        let mut out = Vec::new();
        while let Some(Output::Transmit { port, frame }) = rig.master.poll(rig.now) {
            out.push((port, frame.to_vec()));
        }
        for (port, mut frame) in out {
            let (now, master) = (rig.now, &mut rig.master);
            if port == Port::Two {
                // The S telegram comes in on port 1, untouched by any slave.
                rig.checked.sent(now, port, &frame);
                assert_eq!(master.handle_frame(now, Port::One, &frame), Err(Refusal::Port));
                continue;
            }
            let mut arrived = |port, frame: &mut [u8]| master.handle_frame(now, port, frame).unwrap();
            rig.checked.send(now, port, &mut frame, &mut rig.network, &mut |_, _, _| {}, &mut arrived);
        }
        rig.checked.judge();
    }
    assert_eq!((rig.master.topology(), rig.told()), (Topology::LineOne, vec![]));
    assert_eq!(rig.master.statistics().refused(Refusal::Port), 40);
    assert!(rig.master.slaves().all(|slave| slave.presence == Presence::Active));
}

/// S-DEV of a slave in the AT of CP4.
fn with_status(rig: &RingRig, slave: usize, change: impl Fn(u16) -> u16 + 'static) -> Tamper {
    let at = rig.master.layout().slaves[slave].as_ref().unwrap().status;
    let at = HEADER_LEN + usize::from(at.offset);
    Box::new(move |_, frame| {
        let word = u16::from_le_bytes([frame[at], frame[at + 1]]);
        if frame[14] & 0x40 != 0 && word & 0x0100 != 0 {
            frame[at..at + 2].copy_from_slice(&change(word).to_le_bytes());
        }
        true
    })
}

#[test]
fn a_slave_that_does_not_follow_the_command_is_named_and_the_ring_stays_open() {
    // It acknowledges and shows another topology, shows nothing new at all, or acknowledges the wrong way round.
    let wrong: [fn(u16) -> u16; 3] =
        [|word| word & 0xCFFF | 0x1000, |word| word & 0x8FFF | 0x1000, |word| word ^ 0x4000];
    for change in wrong {
        let mut rig = RingRig::running(4);
        rig.network.cut(2);
        rig.cycles(10);
        rig.forget();
        rig.tamper = with_status(&rig, 1, change);
        rig.network.mend(2);
        rig.cycles(60);
        let refused = Event::RingNotClosed { slave: SlaveId(1), address: 2 };
        assert_eq!(rig.log.iter().filter(|event| **event == refused).count(), 1, "{:?}", rig.told());
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "{:?}", rig.gaps());
        assert!(rig.master.slaves().all(|slave| slave.presence == Presence::Active));
        // Once it answers rightly, the ring closes.
        rig.tamper = Box::new(|_, _| true);
        rig.forget();
        rig.run_until("closed", |rig| rig.log.contains(&Event::RingClosed));
        assert!(rig.gaps().iter().all(|&gap| gap <= 1), "{:?}", rig.gaps());
    }
}

#[test]
fn a_link_that_flaps_does_not_close_the_ring() {
    let mut rig = RingRig::running(4);
    for round in 0..40 {
        rig.network.cut(3);
        rig.cycles(1 + round % 3);
        rig.network.mend(3);
        rig.cycles(1 + round % 7);
    }
    assert!(!rig.log.contains(&Event::RingClosed));
    assert!(rig.gaps().iter().all(|&gap| gap <= 1), "{:?}", rig.gaps());
    rig.cycles(40);
    assert_eq!(rig.log.iter().filter(|event| **event == Event::RingClosed).count(), 1);
    assert_eq!(rig.master.topology(), Topology::Ring);
    let place = |cable: &Event| matches!(cable, Event::CableOpen { low: End::Slave { address: 3, .. }, .. });
    assert_eq!(rig.log.iter().filter(|event| place(event)).count(), 1, "{:?}", rig.told());
}

#[test]
fn a_cut_while_the_ring_is_being_closed() {
    for cycle in 15..35 {
        for second in 0..=4 {
            let mut rig = RingRig::running(4);
            rig.network.cut(2);
            rig.cycles(10);
            rig.network.mend(2);
            rig.cycles(cycle);
            rig.forget();
            rig.network.cut(second);
            rig.cycles(40);
            let single = second == 2 || rig.log.contains(&Event::RingClosed) || cycle > 24;
            if single {
                // One cycle without a new value. In the next one the value is new, but its counter has gone on by two:
                // the consumer tells that as a loss, though there is none any more.
                let lost: Vec<_> = rig.lost.iter().map(|(most, _)| *most).collect();
                assert!(lost.iter().all(|&lost| lost <= 1), "{cycle} {second}: {lost:?}");
                assert!(rig.gaps().iter().all(|&gap| gap <= 2), "{cycle} {second}: {:?}", rig.gaps());
            }
            let lost = rig.master.slaves().filter(|slave| slave.presence != Presence::Active).count();
            assert!(lost == 0 || !single, "{cycle} {second}: {:?}", rig.told());
        }
    }
}

#[test]
fn cuts_on_the_way_up_do_not_stop_it() {
    for state in [
        State::OpenSvc,
        State::Cp1,
        State::Leave1,
        State::Start2,
        State::Read2,
        State::Write2,
        State::Check2,
        State::Leave2,
        State::Start3,
        State::Check3,
        State::Leave3,
        State::Start4,
        State::Cp4,
    ] {
        for cable in 0..=3 {
            let mut rig = RingRig::ring(3);
            rig.master.set_target_phase(Phase::CP4);
            rig.run_until("there", |rig| rig.master.state() == state || rig.master.state() == State::Cp4);
            rig.network.cut(cable);
            rig.run_until("up", |rig| rig.master.state() == State::Cp4);
            rig.cycles(10);
            rig.forget();
            rig.cycles(10);
            assert_eq!(rig.gaps(), [0; 3], "{state:?} {cable}");
            assert!(rig.master.slaves().all(|slave| slave.presence == Presence::Active));
            rig.network.mend(cable);
            rig.run_until("closed", |rig| rig.log.contains(&Event::RingClosed));
        }
    }
}

#[test]
fn a_slave_that_goes_off_in_any_phase_leaves_the_others_running() {
    for state in [
        State::Scan,
        State::Cp0,
        State::Leave0,
        State::Identify,
        State::OpenSvc,
        State::Leave1,
        State::Start2,
        State::Read2,
        State::Connect2,
        State::Write2,
        State::Check2,
        State::Leave2,
        State::Start3,
        State::Check3,
        State::Leave3,
        State::Start4,
        State::Cp4,
    ] {
        let mut rig = RingRig::ring(4);
        rig.master.set_target_phase(if state == State::Cp0 { Phase::CP0 } else { Phase::CP4 });
        rig.run_until("there", |rig| rig.master.state() == state);
        rig.network.set_power(1, false);
        if state == State::Cp0 {
            rig.run_until("rescanned", |rig| rig.log.contains(&Event::Scanned { slaves: 3 }));
            rig.master.set_target_phase(Phase::CP4);
        }
        rig.run_until("up or given up", |rig| {
            rig.master.state() == State::Cp4 || rig.master.target_phase() == Some(Phase::CP0)
        });
        assert_eq!(rig.master.state(), State::Cp4, "{state:?}: {:?}", rig.told());
        rig.cycles(20);
        let named = rig.log.iter().any(|event| {
            matches!(event, Event::SlaveLost { address: 2, .. } | Event::Missing { address: 2 })
        });
        assert!(named, "{state:?}: {:?}", rig.told());
        rig.forget();
        rig.cycles(10);
        for slave in [1, 3, 4] {
            let id = rig.master.slave_by_address(slave).unwrap();
            assert_eq!(rig.missed[id.index()], (0, 0), "{state:?} {slave}");
        }
    }
}

#[test]
fn a_ring_that_cannot_be_numbered_is_not_taken() {
    // The wire into the master's port 2 is broken: nobody but the master can know, and P telegrams do not come back.
    let mut network = Network::ring((1..=3).map(mirror).collect());
    network.set_cable(3, false, true);
    let mut rig = RingRig::new(ring_config(3), network);
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("refused", |rig| rig.log.contains(&Event::ScanUnstable));
    assert_eq!(rig.master.state(), State::Scan);
}

#[test]
fn nothing_comes_back_from_ports_that_are_joined() {
    let mut rig = RingRig::new(ring_config(1), Network::ring(Vec::new()));
    rig.master.set_target_phase(Phase::CP4);
    rig.run_until("alone", |rig| rig.log.contains(&Event::NoSlaves));
    assert_eq!(rig.master.state(), State::Scan);
}
