//! The master and simulated drives on one CAN bus at 1 Mbit/s, in virtual time: every frame takes as long as its bits take, and the bus
//! names whoever sends what cannot be.

use profile_cia402::drive::controlword::Command;
use profile_cia402::drive::{ErrorCode, State, Statusword};
use profile_cia402::lss::master::{LssReply, LssTask, Master as LssMaster, MasterConfig as LssConfig};
use profile_cia402::master::boot::BootState;
use profile_cia402::master::config::{
    Expected, GuardingConfig, HeartbeatConfig, MasterConfig, MasterHeartbeat, NodeConfig, PdoConfig,
    SyncConfig,
};
use profile_cia402::master::event::{Event, Output};
use profile_cia402::master::{ConsumerState, Master, Priority};
use profile_cia402::node::drive::{Device, identity};
use profile_cia402::node::{Config, Node};
use profile_cia402::sdo::request::{Method, SdoData, SdoRequest};
use profile_cia402::wire::pdo::MappingEntry;
use profile_cia402::wire::{Mux, NodeId, cob_id, frame};
use profile_generic::can::bus::{self, Bus, Disturbance, Effect, Station};
use profile_generic::can::timing::BitRate;
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Frames that the master's queue holds, as many as Linux gives an interface.
const QUEUE: usize = bus::QUEUE_DEFAULT;

const PERIOD_MS: u32 = 4;

fn id(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

/// A drive in cyclic synchronous position: controlword and target, statusword and position.
fn drive(number: u8) -> NodeConfig {
    let entry = |index, bits| MappingEntry::new(Mux::new(index, 0), bits);
    NodeConfig {
        expected: Expected {
            device_type: Some(0x0002_0192),
            serial: Some(number.into()),
            ..Expected::default()
        },
        heartbeat: Some(HeartbeatConfig { producer_ms: 50, timeout_ms: 150 }),
        rpdos: vec![PdoConfig::cyclic(1, vec![entry(0x6040, 16), entry(0x607A, 32)])],
        tpdos: vec![PdoConfig::cyclic(1, vec![entry(0x6041, 16), entry(0x6064, 32)])],
        ..NodeConfig::new(id(number))
    }
}

fn network(drives: u8) -> MasterConfig {
    MasterConfig {
        nodes: (1..=drives).map(drive).collect(),
        sync: Some(SyncConfig { period_ns: PERIOD_MS * 1_000_000, window_ns: 0, counter_overflow: 0 }),
        heartbeat: Some(MasterHeartbeat { node: id(127), producer_ms: 100, timeout_ms: 300 }),
        listens: false,
        ..MasterConfig::default()
    }
}

fn node(number: Option<u8>, serial: u32) -> Node<Device> {
    let config = Config {
        node: number.map(id),
        identity: identity(1, serial),
        boot_time: DurationNs::from_millis(20),
        has_blocks: true,
        has_mapping: true,
    };
    Node::new(&config, Device::new(&[ServoParameters::default()]).unwrap())
}

/// What the application does with a drive in each period.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    /// Wants it enabled.
    enable: bool,
    state: Option<State>,
    position: i32,
    target: i32,
    /// Where the target began.
    origin: i32,
    /// Periods in operation enabled.
    periods: i32,
    /// Largest distance of the position from the target of two periods ago, while enabled.
    error_max: u32,
    /// Periods without a position since it was enabled first.
    stale: u32,
    last: [i32; 3],
}

impl Axis {
    /// The words for the next period.
    fn step(&mut self, word: Statusword, position: i32) -> [u8; 6] {
        self.state = word.state();
        self.position = position;
        let command = match self.state {
            Some(State::SwitchOnDisabled) if self.enable => Command::Shutdown,
            Some(State::ReadyToSwitchOn) => Command::SwitchOn,
            Some(State::SwitchedOn | State::OperationEnabled) => Command::EnableOperation,
            _ => Command::DisableVoltage,
        };
        if self.state == Some(State::OperationEnabled) {
            // A sine of a turn and a half in four seconds, from where the drive stands.
            self.periods += 1;
            let angle =
                f64::from(self.periods) * f64::from(PERIOD_MS) / 1000.0 * core::f64::consts::FRAC_PI_2;
            #[expect(clippy::cast_possible_truncation, reason = "a small number")]
            let offset = ((1.0 - angle.cos()) * 50_000.0) as i32;
            self.target = self.origin + offset;
            if self.periods > 3 {
                self.error_max = self.error_max.max(position.abs_diff(self.last[2]));
            }
        } else {
            // The target follows the drive until it is enabled.
            (self.target, self.origin, self.periods) = (position, position, 0);
        }
        self.last = [self.target, self.last[0], self.last[1]];
        let [a, b] = command.word().bits().to_le_bytes();
        let [c, d, e, f] = self.target.to_le_bytes();
        [a, b, c, d, e, f]
    }
}

struct Rig {
    bus: Bus,
    master: Master,
    lss: LssMaster,
    at_master: Station,
    nodes: Vec<(Station, Node<Device>)>,
    axes: Vec<Axis>,
    now: MonotonicTime,
    log: Vec<Event>,
}

fn rig(config: MasterConfig, nodes: Vec<Node<Device>>) -> Rig {
    let mut bus = Bus::new(BitRate::MAX_CLASSIC);
    let at_master = bus.add(QUEUE).unwrap();
    // Slaves that are asked by LSS answer with the same frame.
    bus.share(cob_id::LSS_RESPONSE);
    Rig {
        at_master,
        axes: vec![Axis { enable: true, ..Axis::default() }; config.nodes.len()],
        nodes: nodes.into_iter().map(|node| (bus.add(128).unwrap(), node)).collect(),
        bus,
        master: Master::new(config).unwrap(),
        lss: LssMaster::new(LssConfig::default()),
        now: MonotonicTime(1_000_000),
        log: vec![],
    }
}

/// Two drives in operation and enabled, and the log empty.
fn enabled() -> Rig {
    let mut rig = rig(network(2), vec![node(Some(1), 1), node(Some(2), 2)]);
    rig.master.start(rig.now);
    rig.until("enabled drives", |rig| {
        rig.axes.iter().all(|axis| axis.state == Some(State::OperationEnabled))
    });
    rig.log.clear();
    rig
}

impl Rig {
    fn settle(&mut self) {
        let now = self.now;
        loop {
            let mut moved = false;
            while let Some(output) = self.bus.poll(now) {
                moved = true;
                if let bus::Output::State { at, station, state } = output {
                    self.controller(at, station, state);
                }
                if let bus::Output::Received { at, to, frame, .. } = output {
                    if to == self.at_master {
                        let _ = self.master.handle_frame(at, &frame);
                        if frame.id() == cob_id::LSS_RESPONSE {
                            self.lss.handle(at, frame.data()).unwrap();
                        }
                    } else if let Some((_, node)) = self.nodes.iter_mut().find(|(station, _)| *station == to)
                    {
                        node.handle_frame(at, &frame);
                    }
                }
            }
            for (station, node) in &mut self.nodes {
                if node.wake_at() <= now {
                    node.handle_time(now);
                }
                while let Some(frame) = node.poll(now) {
                    moved = true;
                    // A drive that is off the bus, or was pulled, talks to itself.
                    let sent = self.bus.send(now, *station, &frame);
                    assert!(matches!(
                        sent,
                        Ok(()) | Err(bus::SendError::BusOff | bus::SendError::Disconnected)
                    ));
                }
            }
            if self.master.next_sync().is_some_and(|at| now >= at) {
                self.lead();
            }
            // A full queue waits, as a full queue of a CAN interface does.
            while self.bus.waiting(self.at_master) < QUEUE {
                let Some(Output::Transmit(frame)) = self.master.poll(now) else { break };
                moved = true;
                if self.bus.send(now, self.at_master, &frame).is_err() {
                    self.master.transmit_failed(frame.id());
                }
            }
            if let Some(bytes) = self.lss.poll(now) {
                moved = true;
                self.bus.send(now, self.at_master, &frame(cob_id::LSS_REQUEST, &bytes)).unwrap();
            }
            while let Some(event) = self.master.poll_event() {
                moved = true;
                if let Event::AwaitingApplication { node, .. } = event {
                    self.commission(node);
                }
                self.log.push(event);
            }
            if !moved {
                return;
            }
        }
    }

    /// The state of a controller changes: its owner is told when it goes off the bus, and when it is back.
    fn controller(&mut self, at: MonotonicTime, station: Station, state: bus::State) {
        let off = state == bus::State::BusOff;
        if station == self.at_master {
            if off { self.master.bus_off(at) } else { self.master.bus_on(at) }
        } else if let Some((_, node)) = self.nodes.iter_mut().find(|(own, _)| *own == station)
            && off
        {
            node.bus_off();
        }
    }

    /// Axis `place` has been led all the time and has not noticed anything.
    fn undisturbed(&self, place: usize) {
        let (axis, node) = (&self.axes[place], id(u8::try_from(place + 1).unwrap()));
        assert_eq!(axis.state, Some(State::OperationEnabled), "{:#?}", self.log);
        assert!(axis.error_max < 1_000 && axis.periods > 20, "{axis:?}");
        assert_eq!(axis.stale, 0, "{axis:?}");
        let consumer = self.master.consumer(node, 1).unwrap();
        assert_eq!((consumer.state, consumer.missed), (ConsumerState::Good, 0));
    }

    /// Whether the servo of a drive has no torque and does not move.
    fn rests(&self, place: usize) -> bool {
        let axis = &self.nodes[place].1.application().axes()[0];
        axis.actual().velocity.0 == 0 && axis.actual().torque.0 == 0
    }

    /// Cyclic synchronous position, at the period of the network.
    fn commission(&mut self, node: NodeId) {
        for (object, value, len) in [
            (Mux::new(0x60C2, 1), u64::from(PERIOD_MS), 1),
            (Mux::new(0x60C2, 2), 0xFD, 1),
            (Mux::new(0x6060, 0), 8, 1),
        ] {
            self.master
                .sdo_submit(node, SdoRequest::download_number(object, value, len), Priority::Normal)
                .unwrap();
        }
        self.master.node_ready(node).unwrap();
    }

    /// Leads the axes whose drives have just told where they are.
    fn lead(&mut self) {
        let nodes: Vec<_> = self.master.config().nodes.iter().map(|node| node.node).collect();
        for (node, axis) in nodes.into_iter().zip(&mut self.axes) {
            let Some(consumer) = self.master.consumer(node, 1) else { continue };
            if !consumer.fresh {
                axis.stale += u32::from(axis.state.is_some());
                axis.state = None;
                continue;
            }
            let [a, b, c, d, e, f] = consumer.data.try_into().unwrap();
            let word = Statusword::from_bits_retain(u16::from_le_bytes([a, b]));
            let words = axis.step(word, i32::from_le_bytes([c, d, e, f]));
            self.master.producer(node, 1).unwrap().copy_from_slice(&words);
            assert!(self.master.commit(node, 1));
        }
    }

    fn step(&mut self, until: MonotonicTime) {
        self.settle();
        let nodes = self.nodes.iter().map(|(_, node)| node.wake_at());
        let full = self.bus.waiting(self.at_master) >= QUEUE;
        let master = self.master.wake_at().filter(|_| !full);
        let others = [self.bus.wake_at(), master, self.master.next_sync(), self.lss.wake_at()];
        let next = nodes.chain(others.into_iter().flatten()).min().unwrap_or(until);
        self.now = next.max(MonotonicTime(self.now.0 + 1)).min(until);
    }

    fn run_ms(&mut self, milliseconds: u64) {
        let until = MonotonicTime(self.now.0 + milliseconds * 1_000_000);
        while self.now < until {
            self.step(until);
        }
        self.settle();
    }

    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end = MonotonicTime(self.now.0 + 30_000_000_000);
        while !done(self) {
            assert!(self.now < end, "no {what}: {:#?} {:?}", self.log, self.axes);
            self.step(end);
            self.settle();
        }
    }

    fn saw(&self, event: &Event) -> bool {
        self.log.contains(event)
    }

    fn task(&mut self, task: LssTask) -> LssReply {
        assert!(self.lss.start(self.now, task));
        let end = MonotonicTime(self.now.0 + 30_000_000_000);
        loop {
            self.settle();
            if let Some(outcome) = self.lss.take_outcome() {
                return outcome.unwrap();
            }
            assert!(self.now < end, "{task:?} does not end");
            self.step(end);
        }
    }
}

#[test]
fn two_drives_follow_their_targets() {
    let mut rig = enabled();
    rig.run_ms(4_000);
    for axis in &rig.axes {
        assert_eq!(axis.state, Some(State::OperationEnabled));
        // A whole sine, followed within a hundredth of its height; one period to the drive and one back.
        assert!(axis.periods >= 1_000 && axis.target.abs_diff(axis.origin) < 1_000, "{axis:?}");
        assert!(axis.error_max < 1_000, "{axis:?}");
    }
    for number in [1, 2] {
        let consumer = rig.master.consumer(id(number), 1).unwrap();
        assert_eq!((consumer.state, consumer.missed), (ConsumerState::Good, 0));
    }
    assert_eq!(rig.master.statistics().pdos_missed, 0);
    assert_eq!(rig.master.statistics().syncs_skipped, 0);
    assert_eq!(rig.log, []);
    rig.bus.judge();
}

#[test]
fn a_drive_that_reboots_while_it_is_enabled() {
    let mut rig = enabled();
    rig.run_ms(500);
    let now = rig.now;
    rig.nodes[0].1.power_cycle(now);
    rig.until("boot-up", |rig| rig.saw(&Event::Rebooted { node: id(1), operational: true }));
    assert!(rig.now.since(now) < DurationNs::from_millis(25));
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.fresh, consumer.state), (false, ConsumerState::Waiting));
    rig.axes[0].enable = false;
    rig.until("operation", |rig| rig.master.node(id(1)).unwrap().state == BootState::Operational);
    rig.run_ms(500);
    // It stands still until it is enabled again, and the other one never noticed.
    assert_eq!(rig.axes[0].state, Some(State::SwitchOnDisabled));
    assert_eq!(rig.axes[1].state, Some(State::OperationEnabled));
    assert!(rig.axes[1].error_max < 1_000, "{:?}", rig.axes[1]);
    assert_eq!(rig.master.consumer(id(2), 1).unwrap().missed, 0);
    rig.axes[0].enable = true;
    rig.until("enabled", |rig| rig.axes[0].state == Some(State::OperationEnabled));
    rig.bus.judge();
}

#[test]
fn a_fault_comes_as_emcy_and_in_the_statusword() {
    let mut rig = enabled();
    let fault = SdoRequest::download_number(Mux::new(0x2FFF, 1), 0x7305, 2);
    rig.master.sdo_submit(id(1), fault, Priority::Urgent).unwrap();
    rig.until("fault", |rig| rig.axes[0].state == Some(State::Fault));
    let emcy = rig.log.iter().find_map(|event| match event {
        Event::Emcy { node, emcy } if *node == id(1) => Some(emcy.code.0),
        _ => None,
    });
    assert_eq!(emcy, Some(0x7305), "{:?}", rig.log);
    rig.run_ms(200);
    assert_eq!((rig.axes[1].state, rig.axes[1].error_max < 1_000), (Some(State::OperationEnabled), true));
    rig.bus.judge();
}

#[test]
fn a_drive_whose_plug_is_pulled_stops_by_itself() {
    let mut rig = enabled();
    rig.run_ms(900);
    assert!(!rig.rests(0) && rig.nodes[0].1.application().axes()[0].actual().velocity.0 != 0);
    let (now, station) = (rig.now, rig.nodes[0].0);
    rig.bus.disconnect(now, station);
    rig.until("loss of its PDO", |rig| rig.saw(&Event::PdoLost { node: id(1), number: 1 }));
    assert!(
        rig.now.since(now) <= DurationNs::from_millis(4 * i64::from(PERIOD_MS)),
        "told after a few periods"
    );
    rig.until("loss", |rig| rig.saw(&Event::HeartbeatLost { node: id(1) }));
    assert!(rig.now.since(now) <= DurationNs::from_millis(150));
    // SYNC stays away: three periods later it brakes along its ramp, as 605Eh says.
    rig.run_ms(500);
    let axis = &rig.nodes[0].1.application().axes()[0];
    assert_eq!((axis.state(), rig.rests(0)), (State::Fault, true));
    let code = rig.nodes[0].1.dictionary().number(0x603F, 0);
    assert_eq!(code, i64::from(ErrorCode::SYNC_CONTROLLER.0), "{code:04X}");
    rig.undisturbed(1);
    // Plugged in again it comes into operation, and stands there with its fault.
    let now = rig.now;
    rig.bus.connect(now, station);
    rig.until("operation", |rig| rig.master.node(id(1)).unwrap().state == BootState::Operational);
    rig.run_ms(500);
    assert_eq!((rig.axes[0].state, rig.rests(0)), (Some(State::Fault), true));
    rig.undisturbed(1);
}

#[test]
fn a_drive_that_goes_bus_off_stops_by_itself() {
    let mut rig = enabled();
    rig.bus.set_restart(Some(DurationNs::from_millis(1_000)));
    rig.run_ms(900);
    let (now, station) = (rig.now, rig.nodes[0].0);
    rig.bus.take_off(now, station);
    rig.until("loss", |rig| rig.saw(&Event::HeartbeatLost { node: id(1) }));
    rig.run_ms(500);
    let axis = &rig.nodes[0].1.application().axes()[0];
    assert_eq!((axis.state(), rig.rests(0)), (State::Fault, true));
    // Its abort connection option says fault: 7500h, communication.
    let code = rig.nodes[0].1.dictionary().number(0x603F, 0);
    assert_eq!(code, i64::from(ErrorCode::COMMUNICATION_MODULE.0), "{code:04X}");
    rig.undisturbed(1);
    rig.until("operation", |rig| rig.master.node(id(1)).unwrap().state == BootState::Operational);
    rig.undisturbed(1);
}

#[test]
fn a_guarded_drive_beside_one_with_a_heartbeat() {
    let mut config = network(2);
    let guarding = GuardingConfig { guard_time_ms: 50, life_time_factor: 3 };
    (config.nodes[0].heartbeat, config.nodes[0].guarding) = (None, Some(guarding));
    // Nothing else tells the drive that the master is gone.
    config.heartbeat = None;
    let mut rig = rig(config, vec![node(Some(1), 1), node(Some(2), 2)]);
    rig.master.start(rig.now);
    rig.until("enabled drives", |rig| {
        rig.axes.iter().all(|axis| axis.state == Some(State::OperationEnabled))
    });
    rig.log.clear();
    rig.run_ms(2_000);
    rig.undisturbed(0);
    rig.undisturbed(1);
    assert_eq!(rig.log, []);
    // Requests do not reach the drive any more, which tells that and stops; answers do not come.
    let (from, to) = (rig.at_master, rig.nodes[0].0);
    let request = cob_id::error_control(id(1));
    assert!(rig.bus.disturb(Disturbance::all(Effect::Lose).from(from).to(to).id(request)));
    rig.until("loss", |rig| rig.saw(&Event::GuardingLost { node: id(1) }));
    let code = |event: &Event| match event {
        Event::Emcy { node, emcy } if *node == id(1) => Some(emcy.code.0),
        _ => None,
    };
    rig.run_ms(400);
    assert!(rig.log.iter().filter_map(code).any(|code| code == ErrorCode::HEARTBEAT.0), "{:#?}", rig.log);
    assert!(rig.rests(0));
    rig.undisturbed(1);
    rig.bus.judge();
}

#[test]
fn every_drive_stops_when_the_master_goes_bus_off() {
    let mut rig = enabled();
    rig.bus.set_restart(Some(DurationNs::from_millis(2_000)));
    rig.run_ms(900);
    let (now, station) = (rig.now, rig.at_master);
    rig.bus.take_off(now, station);
    rig.run_ms(700);
    assert!(rig.saw(&Event::BusOff) && !rig.saw(&Event::BusOn));
    for place in [0, 1] {
        let axis = &rig.nodes[place].1.application().axes()[0];
        assert_eq!((axis.state(), rig.rests(place)), (State::Fault, true), "axis {place}");
    }
    // Nothing moves when the bus is back: the faults stay.
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.run_ms(500);
    assert!([0, 1].map(|place| rig.rests(place)) == [true; 2]);
    assert_eq!([rig.axes[0].state, rig.axes[1].state], [Some(State::Fault); 2]);
}

#[test]
fn a_storm_of_emcys_delays_nobody() {
    let mut rig = enabled();
    let babbler = rig.bus.add(8).unwrap();
    rig.bus.share(cob_id::emcy(id(1)));
    // One in every millisecond, with more precedence than any PDO: an eighth of the bus.
    for number in 0..500_u16 {
        let [low, high] = number.to_le_bytes();
        let emcy = frame(cob_id::emcy(id(1)), &[0x11, 0x86, 1, low, high, 0, 0, 0]);
        let now = rig.now;
        rig.bus.send(now, babbler, &emcy).unwrap();
        rig.run_ms(1);
    }
    assert!(rig.saw(&Event::EmcyStorm { node: id(1) }));
    let told = rig.log.iter().filter(|event| matches!(event, Event::Emcy { .. })).count();
    assert!((16..=32).contains(&told), "{told} told one by one in half a second");
    // One of them is the drive's own: 8150h, another station sends what only it may send.
    assert_eq!(rig.master.statistics().emcys_suppressed, 501 - u64::try_from(told).unwrap());
    assert_eq!(rig.master.node(id(1)).unwrap().emcy.unwrap().vendor[..2], 499_u16.to_le_bytes());
    rig.undisturbed(0);
    rig.undisturbed(1);
    rig.bus.judge();
}

#[test]
fn a_noisy_bus_costs_time_and_nothing_else() {
    let mut rig = enabled();
    for skip in [3, 40, 41, 90, 200, 201, 202, 400] {
        assert!(rig.bus.disturb(Disturbance::all(Effect::Spoil).skip(skip).count(1)));
    }
    rig.run_ms(1_000);
    assert!(rig.bus.traffic().errors >= 8);
    rig.undisturbed(0);
    rig.undisturbed(1);
    assert_eq!(rig.log, []);
    rig.bus.judge();
}

#[test]
fn a_second_drive_with_the_same_node_id_is_not_let_into_operation() {
    let mut rig = enabled();
    let station = rig.bus.add(128).unwrap();
    // Another device of the same kind that was given this node-id by mistake.
    rig.nodes.push((station, node(Some(1), 99)));
    rig.until("the boot-up of the other one", |rig| {
        rig.saw(&Event::Rebooted { node: id(1), operational: true })
    });
    rig.run_ms(3_000);
    let info = rig.master.node(id(1)).unwrap();
    assert!(info.state != BootState::Operational, "{:#?}", rig.log);
    for place in [0, 2] {
        assert!(rig.rests(place), "axis {place}");
    }
    rig.undisturbed(1);
    rig.bus.pardon();
}

#[test]
fn a_drive_without_a_node_id_gets_one_by_lss_and_comes_into_operation() {
    let mut rig = rig(network(2), vec![node(Some(1), 1), node(None, 2)]);
    rig.master.start(rig.now);
    rig.until("the first drive", |rig| rig.axes[0].state == Some(State::OperationEnabled));
    let LssReply::Address(address) = rig.task(LssTask::Fastscan) else { panic!("nobody") };
    assert_eq!(address.0, [0x7FFF_FFFF, 402, 1, 2]);
    assert_eq!(rig.task(LssTask::SetNodeId(Some(id(2)))), LssReply::Done);
    assert_eq!(rig.task(LssTask::SwitchAllToWaiting), LssReply::Done);
    rig.until("the second drive", |rig| rig.axes[1].state == Some(State::OperationEnabled));
    assert_eq!(rig.axes[0].state, Some(State::OperationEnabled));
    rig.bus.judge();
}

/// Time that a transfer of the scratch object takes, and what of it the bus was busy, per mille.
fn transfer(method: Method, upload: bool) -> (u64, u64) {
    let mut config = network(1);
    (config.sync, config.heartbeat) = (None, None);
    (config.nodes[0].rpdos, config.nodes[0].tpdos, config.nodes[0].heartbeat) = (vec![], vec![], None);
    let mut rig = rig(config, vec![node(Some(1), 1)]);
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let scratch = Mux::new(0x2FFE, 0);
    let value: Vec<u8> = (0..4096_u32).map(|place| (place * 7 % 251).to_le_bytes()[0]).collect();
    let ask = |rig: &mut Rig, request: SdoRequest| {
        rig.log.clear();
        let (begin, busy) = (rig.now, rig.bus.traffic().busy);
        rig.master.sdo_submit(id(1), request.by(method), Priority::Normal).unwrap();
        rig.until("outcome", |rig| rig.log.iter().any(|event| matches!(event, Event::Sdo { .. })));
        let time = rig.now.since(begin).magnitude();
        let busy = (rig.bus.traffic().busy - busy).magnitude();
        let Some(Event::Sdo { outcome, .. }) = rig.log.pop() else { panic!("{:?}", rig.log) };
        assert_eq!(outcome.result, Ok(()));
        assert_eq!(outcome.data.as_slice(), value);
        (time / 1000, busy * 1000 / time)
    };
    let down = ask(&mut rig, SdoRequest::download(scratch, SdoData::Buffer(value.clone())));
    let up = ask(&mut rig, SdoRequest::upload_into(scratch, Vec::with_capacity(4096)));
    rig.bus.judge();
    if upload { up } else { down }
}

#[test]
fn sdo_transfers_keep_the_bus_busy() {
    // 4096 bytes: 586 segments. Neither side waits for anything but the bus.
    let mut table = String::new();
    for (method, upload) in
        [(Method::Blocks, false), (Method::Blocks, true), (Method::Segments, false), (Method::Segments, true)]
    {
        let (us, busy) = transfer(method, upload);
        let way = if upload { "upload" } else { "download" };
        table += &format!(
            "{way} of 4096 bytes in {method:?}: {us} us, bus busy {busy} per mille, {} kB/s\n",
            4_096_000 / us
        );
        assert!(busy >= 990, "{table}");
    }
    insta::assert_snapshot!(table);
}
